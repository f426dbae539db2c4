"""A system in generalized coordinates: by its Lagrangian, its energies, its particles or its Hamiltonian."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import Field, ValidationInfo
from pydantic.json_schema import JsonSchemaValue

from rigidcli.document.parameters import read_mapping, read_name
from rigidcli.document.variables import (
    EXPRESSION_SCHEMA,
    MOST_COORDINATES,
    derived_names,
    momentum,
    names_schema,
    read_new_names,
    take,
    velocity,
)
from rigidcli.errors import ValueProblem, shown, with_article
from rigidcli.fields.dimensions import ANGLE, ENERGY, LENGTH, MASS, MOMENT_OF_INERTIA, Dimension
from rigidcli.fields.quantities import AsList, worked_out
from rigidcli.fields.readers import SHARED, ReadBy, Reader
from rigidcli.fields.section import Section, environment, optional
from rigidcli.language.expression import Expression
from rigidcli.language.tree import UnknownFunction

MOST_PARTICLES = 200
"""The most particles of a system: far more than anybody writes, and still quick to derive."""

MOST_ARGUMENTS = 6
"""The most arguments of an unknown function: two points in space."""

HIGHEST_DERIVATIVE = 3
"""The highest derivative of an unknown function that may be written in a document, such as dV_dx_dx_dx."""


def _read_coordinates(raw: object, info: ValidationInfo) -> tuple[str, ...]:
    names = read_new_names(raw, info, MOST_COORDINATES, "coordinates", derived_names)
    environment(info).coordinates = names
    return names


@dataclass(frozen=True)
class SystemExpression(Reader):
    """Marks a field as an expression in the parameters, the coordinates of the system, t, and `besides`.

    It has this dimension, as far as the parameters have units that tell; None is any.
    """

    dimension: Dimension | None
    besides: tuple[Literal["velocities", "momenta"], ...]
    sign: Literal["positive", "nonnegative"] | None = None

    def json_schema(self) -> JsonSchemaValue:
        """A number or a text, with the variables that may stand in it, under a name of its own."""
        what, variables = str(self.dimension or "force"), ["coordinates", *self.besides]
        name = "-in-".join([what.partition(" (")[0].replace(" ", "-"), "-and-".join(variables)])
        words = f"An expression for {with_article(what)} in the parameters, {', '.join(variables)} and t"
        return {SHARED: name, "schema": EXPRESSION_SCHEMA | {"description": words}}

    def read(self, raw: object, info: ValidationInfo) -> Expression:
        """The expression, in which names stay names."""
        env = environment(info)
        if env.coordinates is None:
            return env.symbolic(raw, self.dimension, None)
        named = {"velocities": velocity, "momenta": momentum}
        further = (named[kind](name) for kind in self.besides for name in env.coordinates)
        expression = env.symbolic(raw, self.dimension, (*env.coordinates, *further, "t"))
        if self.sign is not None:
            value = env.value(expression)
            if value is not None and (value < 0 or (value == 0 and self.sign == "positive")):
                raise ValueProblem(f"{worked_out(raw, value)}, expected a {self.sign} number")
        return expression


InVelocities: TypeAlias = Annotated[Expression, SystemExpression(ENERGY, ("velocities",))]
InMomenta: TypeAlias = Annotated[Expression, SystemExpression(ENERGY, ("momenta",))]
CartesianCoordinate: TypeAlias = Annotated[Expression, SystemExpression(LENGTH, ())]
Turning: TypeAlias = Annotated[Expression, SystemExpression(ANGLE, ())]
Inertia: TypeAlias = Annotated[Expression, SystemExpression(MASS, (), "positive")]
RotationalInertia: TypeAlias = Annotated[Expression, SystemExpression(MOMENT_OF_INERTIA, (), "nonnegative")]


def _read_forces(raw: object, info: ValidationInfo) -> dict[str, Expression]:
    """Generalized forces by their coordinates."""
    names = environment(info).coordinates
    return read_mapping(
        raw, lambda name, value: _FORCE.read(value, info), example="{x: -c*xdot}", names=names
    )


_FORCE = SystemExpression(None, ("velocities", "momenta"))
Forces: TypeAlias = Annotated[
    dict[str, Expression],
    ReadBy(_read_forces, {"type": "object", "additionalProperties": EXPRESSION_SCHEMA}),
]


def _read_functions(raw: object, info: ValidationInfo) -> tuple[UnknownFunction, ...]:
    """Functions without a formula: of a potential V(x), only the name and the arguments are given."""
    env = environment(info)
    slopes: dict[str, UnknownFunction] = {}

    def read(name: str, value: Any) -> UnknownFunction:
        arguments = _arguments(value)
        take(env, {name: "an unknown function"})
        for order in range(HIGHEST_DERIVATIVE + 1):
            for by in combinations_with_replacement(range(len(arguments)), order):
                slope = UnknownFunction(name, arguments, by)
                slopes[str(slope)] = slope
        return slopes[name]

    def twice(spelling: Mapping[str, str]) -> Iterator[ValueProblem]:
        for name in spelling:
            if name in slopes and (base := slopes[name].base) != name:
                message = f"`{name}` is the derivative of `{base}`, expected another name"
                yield ValueProblem(message, path=(spelling[name],))

    functions = read_mapping(raw, read, example="{V: [x]}", besides=twice)
    env.functions = slopes
    return tuple(functions.values())


def _arguments(raw: object) -> list[str]:
    """The names of the arguments: one, or a list of them."""
    entries = [raw] if isinstance(raw, str) else raw
    if not isinstance(entries, list | tuple) or not 1 <= len(entries) <= MOST_ARGUMENTS:
        raise ValueProblem(f"read {shown(raw)}, expected a list of 1 to {MOST_ARGUMENTS} names, such as [x]")
    names = [entry if entry == "t" else read_name(entry) for entry in entries]
    if len(set(names)) < len(names):
        raise ValueProblem(f"read {', '.join(names)}: expected different names")
    return names


Functions: TypeAlias = Annotated[
    tuple[UnknownFunction, ...],
    ReadBy(
        _read_functions,
        {
            "type": "object",
            "additionalProperties": names_schema(1, MOST_ARGUMENTS),
            "description": "Functions without a formula, with the names of their arguments, such as V: [x]",
        },
    ),
]
Position: TypeAlias = Annotated[tuple[CartesianCoordinate, ...], AsList, Field(min_length=1, max_length=3)]
Coordinates: TypeAlias = Annotated[
    tuple[str, ...], ReadBy(_read_coordinates, names_schema(1, MOST_COORDINATES))
]


class Particle(Section):
    """A point mass, or a rigid body by its centre of mass and the angle by which it turns about an axis."""

    NEEDS: ClassVar = {"position": "mass", "moment_of_inertia": "angle", "angle": "moment_of_inertia"}

    mass: Inertia | None = None
    position: Position | None = optional("One to three Cartesian coordinates, in an inertial frame")
    moment_of_inertia: RotationalInertia | None = optional(
        "Moment of inertia about the axis of the turn, or about that through the centre of mass"
    )
    angle: Turning | None = optional("The angle by which it has turned (rad)")
    potential: InVelocities | None = None

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        yield from super()._contradictions(raw)
        if all(raw.get(key) is None for key in cls.NEEDS):
            hint = "a body that only turns has a `moment_of_inertia` and an `angle` instead"
            yield ValueProblem("missing, expected where the particle is", path=("position",), hint=hint)


Particles: TypeAlias = Annotated[tuple[Particle, ...], AsList, Field(min_length=1, max_length=MOST_PARTICLES)]


class System(Section):
    """A system in generalized coordinates. The velocity of x is xdot, its momentum p_x, the time t.

    A `lagrangian` may stand beside `kinetic` and `potential`: it then moves the system, and T + V is what
    the Hamiltonian is compared with.
    """

    FORMS: ClassVar = ("lagrangian", "kinetic", "particles", "hamiltonian")

    coordinates: Coordinates = Field(
        description="Names of the generalized coordinates; the velocity of x is xdot, its momentum p_x"
    )
    functions: Functions = optional(
        "Functions without a formula; the derivative of V(x) is written dV_dx(x)", ()
    )
    lagrangian: InVelocities | None = optional("L, in coordinates and velocities")
    kinetic: InVelocities | None = optional("T, in coordinates and velocities")
    potential: InVelocities | None = optional("V, in coordinates")
    particles: Particles | None = None
    hamiltonian: InMomenta | None = optional("H, in coordinates and momenta")
    forces: Forces | None = optional(
        "Generalized forces beside those of the potential, by their coordinates: {x: -c*xdot}"
    )

    @classmethod
    def _unknown(cls, key: str, raw: Mapping[str, Any]) -> ValueProblem:
        if key in ("constraint", "constraints"):
            hint = (
                "choose coordinates that obey them, such as `phi` of a wheel that rolls with speed `R*phidot`"
            )
            return ValueProblem("unknown key: a system has no constraints beside its coordinates", hint=hint)
        return super()._unknown(key, raw)

    def expressions(self) -> list[Expression]:
        """The expressions that make the system."""
        whole = (self.lagrangian, self.kinetic, self.potential, self.hamiltonian)
        parts = [part for each in self.particles or () for part in (*(each.position or ()), each.potential)]
        return [expression for expression in (*whole, *parts) if expression is not None]

    @property
    def velocities(self) -> tuple[str, ...]:
        """Names of the velocities, in the order of the coordinates."""
        return tuple(map(velocity, self.coordinates))

    @property
    def momenta(self) -> tuple[str, ...]:
        """Names of the momenta, in the order of the coordinates."""
        return tuple(map(momentum, self.coordinates))

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        yield from super()._contradictions(raw)
        given = [key for key in cls.FORMS if raw.get(key) is not None]
        if len(given) != 1 and given != ["lagrangian", "kinetic"]:
            forms, read = (", ".join(f"`{key}`" for key in keys) for keys in (cls.FORMS, given))
            hint = "`lagrangian` may stand beside `kinetic` and `potential` only" if given else None
            yield ValueProblem(f"expected exactly one of {forms}; read {read or 'none of them'}", hint=hint)
        elif raw.get("potential") is not None and given[-1] not in ("kinetic", "particles"):
            hint = "a Lagrangian is T - V already, a Hamiltonian has V in it"
            message = f"goes with `kinetic` or `particles`; `{given[0]}` is given"
            yield ValueProblem(message, path=("potential",), hint=hint)
