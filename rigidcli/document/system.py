"""A system in generalized coordinates, and the orbit that is asked for."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self, TypeAlias

import numpy as np
from pydantic import AfterValidator, Field, ValidationError, ValidationInfo
from pydantic.json_schema import JsonSchemaValue

from rigidcli.core.arithmetic import Floats, Scalar
from rigidcli.document.parameters import read_list, read_mapping, read_name
from rigidcli.document.phase_space import (
    EXPRESSION_SCHEMA,
    EXPRESSIONS_SCHEMA,
    MOST_COORDINATES,
    MULTIPLIER,
    derived_names,
    momentum,
    names_schema,
    of_the_state,
    read_equation,
    read_new_names,
    take,
    velocity,
)
from rigidcli.document.sampling import Ensemble, OrMany, Sampling
from rigidcli.errors import MOST_LISTED, ValueProblem, shown, with_article
from rigidcli.fields.dimensions import ANGLE, ENERGY, LENGTH, MASS, MOMENT_OF_INERTIA, POWER, Dimension
from rigidcli.fields.environment import Environment
from rigidcli.fields.quantities import AsList, worked_out
from rigidcli.fields.section import SHARED_SCHEMA, ReadBy, Reader, Section, environment, optional
from rigidcli.fields.words import variable_called, with_colon
from rigidcli.language.expression import Expression
from rigidcli.language.tree import UnknownFunction

# The most particles of a system: far more than anybody writes, and still quick to derive.
MOST_PARTICLES = 200
MOST_ARGUMENTS = 6  # the most arguments of an unknown function: two points in space
# The highest derivative of an unknown function that may be written in a document, such as dV_dx_dx_dx.
HIGHEST_DERIVATIVE = 3


def _read_coordinates(raw: object, info: ValidationInfo) -> tuple[str, ...]:
    names = read_new_names(raw, info, MOST_COORDINATES, "coordinates", derived_names)
    environment(info).names.coordinates = names
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
        return {SHARED_SCHEMA: name, "schema": EXPRESSION_SCHEMA | {"description": words}}

    def read(self, raw: object, info: ValidationInfo) -> Expression:
        """The expression, in which names stay names."""
        env = environment(info)
        if env.names.coordinates is None:
            return env.symbolic(raw, self.dimension, None)
        named = {"velocities": velocity, "momenta": momentum}
        further = (named[kind](name) for kind in self.besides for name in env.names.coordinates)
        expression = env.symbolic(raw, self.dimension, (*env.names.coordinates, *further, "t"))
        if self.sign is not None:
            value = env.value(expression)
            if value is not None and (value < 0 or (value == 0 and self.sign == "positive")):
                raise ValueProblem(f"{worked_out(raw, value)}, expected a {self.sign} number")
        return expression


InVelocities: TypeAlias = Annotated[Expression, SystemExpression(ENERGY, ("velocities",))]
InMomenta: TypeAlias = Annotated[Expression, SystemExpression(ENERGY, ("momenta",))]
Dissipation: TypeAlias = Annotated[Expression, SystemExpression(POWER, ("velocities",))]
CartesianCoordinate: TypeAlias = Annotated[Expression, SystemExpression(LENGTH, ())]
Turning: TypeAlias = Annotated[Expression, SystemExpression(ANGLE, ())]
Angles: TypeAlias = Annotated[tuple[Turning, Turning, Turning], AsList]
PositiveMass: TypeAlias = Annotated[Expression, SystemExpression(MASS, (), "positive")]
RotationalInertia: TypeAlias = Annotated[Expression, SystemExpression(MOMENT_OF_INERTIA, (), "nonnegative")]


def _read_forces(raw: object, info: ValidationInfo) -> dict[str, Expression]:
    names = environment(info).names.coordinates
    return read_mapping(
        raw, lambda name, value: _FORCE.read(value, info), example="{x: -c*xdot}", names=names
    )


_FORCE = SystemExpression(None, ("velocities", "momenta"))
Forces: TypeAlias = Annotated[dict[str, Expression], ReadBy(_read_forces, EXPRESSIONS_SCHEMA)]


class Equation(NamedTuple):
    """A constraint of a document: its key or its place in the list, and what vanishes by it."""

    place: str | int
    expression: Expression


def _read_constraints(raw: object, info: ValidationInfo) -> dict[str, Equation]:
    """Constraints by the names of their multipliers, which are lambda1, lambda2 and so on in a list."""

    def read(name: str, typed: object, place: str | int) -> Equation:
        take(environment(info), {name: MULTIPLIER})
        hint = "write the equation that holds while they touch; `orbit.until` may end the motion"
        equation = read_equation(typed, lambda side: _CONSTRAINT.read(side, info), "an equation", hint)
        return Equation(place, equation)

    if isinstance(raw, str):
        return {"lambda1": read("lambda1", raw, 0)}
    example = "[x**2 + y**2 - l**2], or {tension: r - l} with a name for its multiplier"
    if not isinstance(raw, list | tuple | Mapping):
        raise ValueProblem(f"read {shown(raw)}, expected constraints, such as {example}")
    if not 1 <= len(raw) <= MOST_COORDINATES:
        raise ValueProblem(f"read {len(raw)} entries, expected 1 to {MOST_COORDINATES} constraints")
    if isinstance(raw, Mapping):
        return read_mapping(raw, lambda name, typed: read(name, typed, name), example=example)
    numbered = read_list(raw, lambda typed, place: read(f"lambda{place + 1}", typed, place), "constraints")
    return {f"lambda{place}": equation for place, equation in enumerate(numbered, start=1)}


_CONSTRAINT = SystemExpression(None, ("velocities",))
_LIST_SCHEMA = {"type": "array", "items": EXPRESSION_SCHEMA, "minItems": 1}
_CONSTRAINTS_SCHEMA = {
    "anyOf": [EXPRESSION_SCHEMA, _LIST_SCHEMA, EXPRESSIONS_SCHEMA],
    "description": "Expressions that vanish, or equations: a list, or by names of multipliers",
}
Constraints: TypeAlias = Annotated[dict[str, Equation], ReadBy(_read_constraints, _CONSTRAINTS_SCHEMA)]


def _read_functions(raw: object, info: ValidationInfo) -> tuple[UnknownFunction, ...]:
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
        for name, key in spelling.items():
            if name in slopes and (base := slopes[name].base) != name:
                message = f"`{name}` is the derivative of `{base}`, expected another name"
                yield ValueProblem(message, path=(key,))

    functions = read_mapping(raw, read, example="{V: [x]}", besides=twice)
    env.names.functions = slopes
    return tuple(functions.values())


def _arguments(raw: object) -> list[str]:
    entries = [raw] if isinstance(raw, str) else raw
    if not isinstance(entries, list | tuple) or not 1 <= len(entries) <= MOST_ARGUMENTS:
        raise ValueProblem(f"read {shown(raw)}, expected a list of 1 to {MOST_ARGUMENTS} names, such as [x]")
    names = [entry if entry == "t" else read_name(entry) for entry in entries]
    if len(set(names)) < len(names):
        raise ValueProblem(f"read {', '.join(names)}: expected different names")
    return names


_FUNCTIONS_SCHEMA = {
    "type": "object",
    "additionalProperties": names_schema(1, MOST_ARGUMENTS),
    "description": "Functions without a formula, with the names of their arguments, such as V: [x]",
}
Functions: TypeAlias = Annotated[tuple[UnknownFunction, ...], ReadBy(_read_functions, _FUNCTIONS_SCHEMA)]
Position: TypeAlias = Annotated[tuple[CartesianCoordinate, ...], AsList, Field(min_length=1, max_length=3)]
Coordinates: TypeAlias = Annotated[
    tuple[str, ...], ReadBy(_read_coordinates, names_schema(1, MOST_COORDINATES))
]


def _of_a_body(moments: tuple[Expression, ...], info: ValidationInfo) -> tuple[Expression, ...]:
    values = [environment(info).value(moment) for moment in moments]
    known = [value for value in values if value is not None]
    if len(known) == 3 and 2 * max(known) > sum(known) * (1 + ROUNDING_OF_MOMENTS):
        largest = f"{max(known):.6g} > {sum(known) - max(known):.6g}"
        raise ValueProblem(f"{largest}, the sum of the others: no body has these moments")
    return moments


# The largest moment may exceed the sum of the others by this, in units of all: they may be typed so.
ROUNDING_OF_MOMENTS = 1e-6

Moments: TypeAlias = Annotated[
    tuple[RotationalInertia, RotationalInertia, RotationalInertia], AsList, AfterValidator(_of_a_body)
]


class Particle(Section):
    """A point mass, or a rigid body that turns about an axis by an `angle`, or in space by `euler` angles."""

    NEEDS: ClassVar = {
        "position": "mass",
        "moment_of_inertia": "angle",
        "angle": "moment_of_inertia",
        "moments": "euler",
        "euler": "moments",
    }
    AT_MOST_ONE_OF: ClassVar = (("angle", "euler"),)

    mass: PositiveMass | None = None
    position: Position | None = optional("One to three Cartesian coordinates, in an inertial frame")
    moment_of_inertia: RotationalInertia | None = optional(
        "Moment of inertia about the axis of the turn, or about that through the centre of mass"
    )
    angle: Turning | None = optional("The angle by which it has turned (rad)")
    moments: Moments | None = optional(
        "Principal moments of inertia about its centre of mass, or about a point of it that is fixed"
    )
    euler: Angles | None = optional(
        "Euler's angles [phi, theta, psi] (zxz) that turn its principal axes from those of space (rad)"
    )
    potential: InVelocities | None = None

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        yield from super()._contradictions(raw)
        if all(raw.get(key) is None for key in cls.NEEDS):
            alone = "a `moment_of_inertia` and an `angle` instead"
            hint = f"a body that only turns has `moments` and `euler`, or {alone}"
            yield ValueProblem("missing, expected where the particle is", path=("position",), hint=hint)


Particles: TypeAlias = Annotated[tuple[Particle, ...], AsList, Field(min_length=1, max_length=MOST_PARTICLES)]


# A sine, cosine or tangent without another function in it, and its argument.
_IN_TURNS = re.compile(r"\b(?:sin|cos|tan)\(([^()]*)\)")


class System(Section):
    """A system in generalized coordinates. The velocity of x is xdot, its momentum p_x, the time t.

    A `lagrangian` may stand beside `kinetic` and `potential`: it then moves the system, and T + V is what
    the Hamiltonian is compared with.
    """

    EXAMPLE: ClassVar = "{coordinates: [x], lagrangian: xdot^2/2}"
    FORMS: ClassVar = ("lagrangian", "kinetic", "particles", "hamiltonian")

    coordinates: Coordinates = Field(
        description="Names of the generalized coordinates; the velocity of x is xdot, its momentum p_x"
    )
    functions: Functions = optional("Functions without a formula; the derivative of V(x) is dV_dx(x)", ())
    lagrangian: InVelocities | None = optional("L, in coordinates and velocities")
    kinetic: InVelocities | None = optional("T, in coordinates and velocities")
    potential: InVelocities | None = optional("V, in coordinates")
    particles: Particles | None = None
    hamiltonian: InMomenta | None = optional("H, in coordinates and momenta")
    forces: Forces | None = optional(
        "Generalized forces beside those of the potential, by their coordinates: {x: -c*xdot}"
    )

    dissipation: Dissipation | None = optional(
        "Rayleigh's function F, in coordinates and velocities: the forces are -dF/d(velocity)"
    )
    constraints: Constraints | None = optional(
        "Equations between coordinates and t, or linear in the velocities, by the names of their multipliers"
    )

    @property
    def angles(self) -> set[str]:
        """The coordinates that stand alone, without a parameter, in a sine, cosine or tangent."""
        expressions = [self.lagrangian, self.kinetic, self.potential, self.hamiltonian]
        for particle in self.particles or ():
            expressions += [*(particle.position or ()), particle.potential]
        expressions += [equation.expression for equation in (self.constraints or {}).values()]
        arguments = _IN_TURNS.findall(" ".join(each.text for each in expressions if each is not None))
        names = [{*re.findall(r"[^\W\d]\w*", argument)} - {"pi"} for argument in arguments]
        return set[str]().union(*(alone for alone in names if alone <= {*self.coordinates}))

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
            if not given and raw.get("potential") is not None:
                hint = "T is written `kinetic`; what has velocities in it, as T - V, is the `lagrangian`"
            yield ValueProblem(f"expected exactly one of {forms}; read {read or 'none of them'}", hint=hint)
        elif raw.get("potential") is not None and given[-1] not in ("kinetic", "particles"):
            hint = "a Lagrangian is T - V already, a Hamiltonian has V in it"
            message = f"goes with `kinetic` or `particles`; `{given[0]}` is given"
            yield ValueProblem(message, path=("potential",), hint=hint)
        elif re.fullmatch(r"\s*[TK]\s*-\s*[UV]\s*", str(raw.get("lagrangian"))):
            hint = "leave it out: it is that of `kinetic` and `potential`"
            yield ValueProblem(f"read {shown(raw['lagrangian'])}", path=("lagrangian",), hint=hint)


# --- the orbit


def _initial_names(env: Environment) -> list[str]:
    coordinates = env.names.coordinates or ()
    return [*coordinates, *map(momentum, coordinates), *map(velocity, coordinates)]


def _read_initial(raw: object, info: ValidationInfo) -> dict[str, Scalar]:
    env = environment(info)
    names = env.names.coordinates or ()
    return read_mapping(
        raw,
        lambda name, value: env.read(value, None),
        example="{x: 1, p_x: 0}",
        names=_initial_names(env) or None,
        needed=names,
        besides=lambda given: _missing(given, names),
    )


def _missing(given: Mapping[str, str], coordinates: tuple[str, ...]) -> Iterator[ValueProblem]:
    momenta, velocities = (list(map(kind, coordinates)) for kind in (momentum, velocity))
    read = [", ".join(name for name in half if name in given) for half in (momenta, velocities)]
    expected = f"expected all momenta ({', '.join(momenta)}) or all velocities ({', '.join(velocities)})"
    if all(read):
        message = f"momenta and velocities are mixed: read {' and '.join(read)}"
        yield ValueProblem(message, hint=expected)
    elif coordinates and not any(read):
        yield ValueProblem(f"no momenta and no velocities, {expected}")
    else:
        lacking = [name for name in (momenta if read[0] else velocities) if name not in given]
        yield from (ValueProblem("missing", path=(name,)) for name in lacking)


def _names(heads: Sequence[str], info: ValidationInfo) -> tuple[str, ...]:
    try:
        return tuple(_read_initial(dict.fromkeys(heads, 0.0), info))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]["ctx"]["error"]
        raise ValueProblem(": ".join([*map(str, first.path), first.message])) from None


_START = Annotated[dict[str, Scalar], ReadBy(_read_initial, EXPRESSIONS_SCHEMA | {"minProperties": 2})]
_OR_MANY = OrMany(_START, dict, _names, "x,p_x")


def _read_event(raw: object, info: ValidationInfo) -> Expression:
    """A function of the state whose zeros are events, or an equation between two functions."""
    env = environment(info)
    variables = None if env.names.coordinates is None else of_the_state(env)
    hint = "write an equation, such as `y = 0`, or what vanishes, such as `y`"
    whole = read_equation(
        raw, lambda side: env.symbolic(side, None, variables), "where something passes zero", hint
    )
    if variables is not None and whole.names.isdisjoint(variables):
        moving = ", ".join(variables[:MOST_LISTED])
        raise ValueProblem(f"read {shown(raw)}: it never changes, expected a function of {moving}")
    return whole


Event: TypeAlias = Annotated[Expression, ReadBy(_read_event, EXPRESSION_SCHEMA)]


class PoincareSection(Section):
    """The states in which a function of the state passes zero: a Poincare section."""

    EXAMPLE: ClassVar = "{at: x, direction: up}"

    at: Event = Field(description="What passes zero, in coordinates, momenta, velocities, t and observables")
    direction: Literal["up", "down", "both"] = Field(
        default="up", description="Whether it passes upwards, downwards, or either way"
    )


class Orbit(Sampling):
    """An orbit from t = 0 on: all coordinates are given there, and all momenta or all velocities."""

    EXAMPLE: ClassVar = "{initial: {x: 1, p_x: 0}, duration: 10}"
    STARTS: ClassVar = "initial"

    initial: Annotated[dict[str, Scalar] | Ensemble, _OR_MANY] = Field(
        description="Coordinates at t = 0, and all momenta or all velocities; or several starts: an ensemble"
    )
    method: Literal["auto", "symplectic", "stiff", "taylor"] = Field(
        default="auto",
        description="`symplectic` keeps the energy error bounded over very long spans, with a fixed step; "
        "`stiff` is scipy's Radau, for rates of very different sizes; `taylor` is by heyoka (extra `taylor`)",
    )

    until: Event | None = optional(
        "The orbit ends where this passes zero; the duration is the longest: lambda1, or an equation r = R"
    )
    section: PoincareSection | None = optional(
        "Only the states in which a function passes zero: {at: x, direction: up}"
    )

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        yield from super()._contradictions(raw)
        if all(raw.get(key) is None for key in ("duration", "times", "step")):
            yield ValueProblem("missing, expected how long the orbit is followed", path=("duration",))

    @classmethod
    def _stranger(cls, key: str, raw: Mapping[str, Any], env: Environment) -> ValueProblem:
        """The problem of another key; a value at t = 0, such as `x0`, belongs inside `initial`."""
        name = variable_called(key, _initial_names(env))
        if name in (None, key) or raw.get("initial") is not None:
            return super()._stranger(key, raw, env)
        return cls._belongs_inside("initial", name, raw[key])

    @classmethod
    def _unguessed(cls, key: str, raw: Mapping[str, Any], env: Environment) -> ValueProblem:
        if "=" in key and (pair := with_colon(key)):
            return cls._belongs_inside("initial", *pair.split(": ", 1))
        if raw.get("initial") is not None:
            return super()._unguessed(key, raw, env)
        return cls._belongs_inside("initial", key, "...")

    @property
    def events(self) -> dict[str, Expression]:
        """The functions whose zeros are events, by their keys."""
        places = {"orbit.until": self.until, "orbit.section.at": self.section.at if self.section else None}
        return {key: typed for key, typed in places.items() if typed is not None}

    def start(self, system: System) -> tuple[Floats, Floats | None, Floats | None]:
        """Coordinates, momenta and velocities at t = 0, arrays of shape (n); None where they are absent."""
        assert not isinstance(self.initial, Ensemble)
        q, p, v = (
            np.array([self.initial[name] for name in names]) if names[0] in self.initial else None
            for names in (system.coordinates, system.momenta, system.velocities)
        )
        assert q is not None
        return q, p, v

    def at_start(self, place: int) -> Self:
        """The orbit from one start of the ensemble."""
        assert self.ensemble is not None
        return self.model_copy(update={"initial": self.ensemble.start(place)})
