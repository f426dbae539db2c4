"""A change of variables in phase space, from the old to the new ones or back."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, TypeAlias

from pydantic import Field, ValidationInfo

from rigidcli.document.parameters import read_mapping
from rigidcli.document.variables import (
    EXPRESSION_SCHEMA,
    MOST_COORDINATES,
    RESULTS,
    derived_names,
    momentum,
    names_schema,
    read_expression,
    read_new_names,
)
from rigidcli.errors import ValueProblem
from rigidcli.fields.readers import ReadBy
from rigidcli.fields.section import Section, environment, optional, refuse
from rigidcli.language.expression import Expression


def _meanings(coordinates: tuple[str, ...]) -> dict[str, str]:
    """What the names of a system are."""
    return {name: f"the coordinate `{name}`" for name in coordinates} | derived_names(coordinates)


def _read_new_variables(raw: object, info: ValidationInfo) -> tuple[str, ...]:
    env = environment(info)
    taken = {**RESULTS, **_meanings(env.coordinates or ())}
    index, problems = read_new_names(raw, env, taken, 2 * MOST_COORDINATES, "new variables")
    refuse("new variables", problems)
    names, count = tuple(index), 2 * len(env.coordinates or ())
    if len(names) % 2:
        hint = "new coordinates first, then their momenta in the same order, as in [Q1, Q2, P1, P2]"
        raise ValueProblem(f"read {len(names)} names, expected an even number of them", hint=hint)
    if count and len(names) != count:
        why = "as many as there are coordinates and momenta"
        raise ValueProblem(f"read {len(names)} names, expected {count}: {why}")
    return names


def _read_side(raw: object, info: ValidationInfo) -> dict[str, Expression]:
    """The variables of one side as expressions in those of the other; `info` tells which side it is."""
    env = environment(info)
    new: tuple[str, ...] | None = info.data.get("new_variables")
    coordinates = env.coordinates
    old = None if coordinates is None else (*coordinates, *map(momentum, coordinates))
    side, other, hint = old, new, "under `old` the old variables are written in the new ones"
    if info.field_name == "new":
        side, other = new, old
        hint = "under `new` the new variables are written in the old coordinates and momenta"
    meanings = _meanings(coordinates or ()) | dict.fromkeys(new or (), "a new variable")
    misplaced = {name: what for name, what in meanings.items() if name not in (other or ())}

    def read(name: str, value: Any) -> Expression:
        if other is None:
            return env.symbolic(value)
        return read_expression(value, env, (*other, "t"), misplaced, hint)

    found = read_mapping(
        raw,
        read,
        example="{x: Q + P, p_x: P}",
        most=2 * MOST_COORDINATES,
        names=side,
        expected=f"expected {', '.join(side or ())}",
        needed=side or (),
        lacks="expected an expression for it",
    )
    return {name: found[name] for name in side or found}


Side: TypeAlias = Annotated[
    dict[str, Expression],
    ReadBy(_read_side, {"type": "object", "additionalProperties": EXPRESSION_SCHEMA}),
]
NewVariables: TypeAlias = Annotated[
    tuple[str, ...], ReadBy(_read_new_variables, names_schema(2, 2 * MOST_COORDINATES))
]


class Transform(Section):
    """New variables of phase space: half of them coordinates, then their momenta in the same order."""

    ONE_OF: ClassVar = ("old", "new")

    # The first to be read: the expressions are in these names.
    new_variables: NewVariables = Field(
        description="New coordinates, then their momenta in the same order: [Q1, Q2, P1, P2]"
    )
    old: Side | None = optional("Old coordinates and momenta, as expressions in the new variables and t")
    new: Side | None = optional("New variables, as expressions in the old coordinates, momenta and t")

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The new coordinates."""
        return self.new_variables[: len(self.new_variables) // 2]

    @property
    def momenta(self) -> tuple[str, ...]:
        """The new momenta, in the order of the new coordinates."""
        return self.new_variables[len(self.new_variables) // 2 :]
