"""The section `orbit`: the start of a system in phase space, the times, and the method of integration."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self, TypeAlias

import numpy as np
from pydantic import Field, ValidationError, ValidationInfo

from rigidcli.core.arithmetic import Floats, Scalar
from rigidcli.document.parameters import read_mapping
from rigidcli.document.sampling import Ensemble, OrMany, Sampling
from rigidcli.document.variables import EXPRESSION_SCHEMA, momentum, of_the_state, read_equation, velocity
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.environment import LONGEST_LIST, Environment
from rigidcli.fields.quantities import FULL_TURN
from rigidcli.fields.section import ReadBy, Section, environment, optional
from rigidcli.fields.words import variable_called, with_colon
from rigidcli.language.expression import Expression

if TYPE_CHECKING:
    from rigidcli.document.system import System


def _read_initial(raw: object, info: ValidationInfo) -> dict[str, Scalar]:
    env = environment(info)
    names = env.names.coordinates or ()
    return read_mapping(
        raw,
        lambda name, value: env.read(value, None),
        example="{x: 1, p_x: 0}",
        names=[*names, *map(momentum, names), *map(velocity, names)] or None,
        needed=names,
        besides=lambda given: _missing(given, names),
    )


def _missing(given: Mapping[str, str], coordinates: tuple[str, ...]) -> Iterator[ValueProblem]:
    """Problems of missing momenta or velocities, and of a mixture of both."""
    momenta, velocities = (list(map(kind, coordinates)) for kind in (momentum, velocity))
    read = [", ".join(name for name in half if name in given) for half in (momenta, velocities)]
    expected = f"expected all momenta ({', '.join(momenta)}) or all velocities ({', '.join(velocities)})"
    if all(read):
        message = f"momenta and velocities are mixed: read {' and '.join(read)}"
        yield ValueProblem(message, hint=expected)
    elif coordinates and not any(read):
        yield ValueProblem(f"no momenta and no velocities, {expected}")
    else:
        for name in momenta if read[0] else velocities:
            if name not in given:
                yield ValueProblem("missing", path=(name,))


def _names(heads: Sequence[str], info: ValidationInfo) -> tuple[str, ...]:
    try:
        return tuple(_read_initial(dict.fromkeys(heads, 0.0), info))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]["ctx"]["error"]
        raise ValueProblem(": ".join([*map(str, first.path), first.message])) from None


_SCHEMA = {"type": "object", "additionalProperties": EXPRESSION_SCHEMA, "minProperties": 2}
_START = Annotated[dict[str, Scalar], ReadBy(_read_initial, _SCHEMA)]
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
        moving = ", ".join(variables[:LONGEST_LIST])
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


_OF_ANGLES = re.compile(r"\b(?:sin|cos|tan)\(([^()]*)\)")
"""A sine, cosine or tangent without another function in it, and its argument."""


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
    def _unknown(cls, key: str, raw: Mapping[str, Any]) -> ValueProblem:
        problem = super()._unknown(key, raw)
        if (raw.get("initial") is None or "=" in key) and "known keys" in (problem.hint or ""):
            pair = with_colon(key) if "=" in key else f"{key}: ..."
            return ValueProblem("belongs inside `initial`", hint=f"write `initial: {{{pair}}}`")
        return problem

    @classmethod
    def _stranger(cls, key: str, raw: Mapping[str, Any], env: Environment) -> ValueProblem:
        """The problem of another key; a value at t = 0, such as `x0`, belongs inside `initial`."""
        names = env.names.coordinates or ()
        name = variable_called(key, (*names, *map(momentum, names), *map(velocity, names)))
        if name in (None, key) or raw.get("initial") is not None:
            return super()._stranger(key, raw, env)
        return ValueProblem("belongs inside `initial`", hint=f"write `initial: {{{name}: {raw[key]}}}`")

    def degrees_meant(self, system: System, typed: Mapping[str, Any]) -> Iterator[str]:
        """Notes on angles that start at a bare number beyond a full turn.

        A coordinate counts as an angle where it is the argument of a sine, cosine or tangent, without a
        parameter beside it.
        """
        arguments = _OF_ANGLES.findall(" ".join(expression.text for expression in system.expressions()))
        names = [set(re.findall(r"[^\W\d]\w*", argument)) - {"pi"} for argument in arguments]
        angles = set[str]().union(*(alone for alone in names if alone <= {*system.coordinates}))
        for name, value in typed.items():
            is_bare = isinstance(value, int | float | Decimal) and not isinstance(value, bool)
            if name in angles and is_bare and abs(value) > FULL_TURN:
                yield f"`orbit.initial.{name}` of {value} rad is beyond a full turn; {value} deg meant?"

    @property
    def events(self) -> dict[str, Expression]:
        """The functions of which zeros are looked for, by their keys."""
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
