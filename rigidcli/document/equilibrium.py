"""The equilibrium about which small oscillations are asked: its coordinates, or where to look for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationInfo

from rigidcli.document.parameters import read_mapping
from rigidcli.document.variables import MOST_COORDINATES
from rigidcli.fields.section import environment
from rigidcli.language.expression import Expression


@dataclass(frozen=True, slots=True)
class Equilibrium:
    """Values of all coordinates, in the parameters; if it `is_sought`, they are only near it."""

    values: Mapping[str, Expression]
    is_sought: bool


def read_equilibrium(raw: object, info: ValidationInfo) -> Equilibrium:
    """The equilibrium in a document: `{theta: pi}`, or `{find: {theta: 3}}`. Raises ValueProblem."""
    env = environment(info)
    names = env.coordinates or ()

    def read(name: str, value: Any) -> Expression:
        expression = env.symbolic(value)
        env.admit(expression, ())
        return expression

    is_sought = isinstance(raw, Mapping) and raw.keys() == {"find"} and "find" not in names
    values = read_mapping(
        raw["find"] if isinstance(raw, Mapping) and is_sought else raw,
        read,
        example="{theta: 0}, or near it {find: {theta: 3}}",
        most=MOST_COORDINATES,
        names=env.coordinates,
        expected=f"expected the coordinates {', '.join(names)}",
        needed=names,
        lacks="expected its value at the equilibrium, such as 0",
        below=("find",) if is_sought else (),
    )
    return Equilibrium(values, is_sought)
