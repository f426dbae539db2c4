"""Observables: functions of the state of a system by their names, and Poisson brackets of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, NamedTuple, TypeAlias

from pydantic import ValidationInfo

from rigidcli.document.parameters import MOST_ENTRIES, in_order, read_mapping, read_names
from rigidcli.document.variables import EXPRESSION_SCHEMA, MULTIPLIER, momentum, take, velocity
from rigidcli.errors import ValueProblem, gathered, shown
from rigidcli.fields.environment import Environment
from rigidcli.fields.readers import ReadBy
from rigidcli.fields.section import environment, refuse
from rigidcli.language.expression import Expression

ENERGIES = ("H", "T", "V")
"""The energies of the system in observables. A parameter or a function may be called T or V, too."""

OBSERVABLE = "one of the observables"
"""The meaning of a name, in messages."""


def _variables(env: Environment) -> tuple[str, ...]:
    """What observables may be made of, besides parameters and each other."""
    names = env.names.coordinates or ()
    limits = [name for name, meaning in env.names.meanings.items() if meaning == MULTIPLIER]
    taken = {
        *env.declared,
        *env.names.meanings,
        *(function.base for function in env.names.functions.values()),
    }
    energies = [name for name in ENERGIES if name not in taken]
    return (*names, *map(momentum, names), *map(velocity, names), *limits, *energies, "t")


def of_the_state(env: Environment) -> tuple[str, ...]:
    """What further functions of the state may be made of, besides parameters."""
    observed = [name for name, meaning in env.names.meanings.items() if meaning == OBSERVABLE]
    return tuple(dict.fromkeys([*_variables(env), *observed]))


def _read_observables(raw: object, info: ValidationInfo) -> dict[str, Expression]:
    """Observables, none of which uses itself."""
    env = environment(info)
    names = [*read_names(raw)[0]] if isinstance(raw, Mapping) else []
    variables = tuple(dict.fromkeys([*(name for name in _variables(env) if name not in names), *names]))

    def read(name: str, value: object) -> Expression:
        if name not in ENERGIES[1:]:
            take(env, {name: OBSERVABLE})
        return env.symbolic(value, None, variables)

    given = read_mapping(raw, read, example="{Lz: x*p_y - y*p_x}")
    uses = {name: e.names & given.keys() for name, e in given.items()}
    problems = list[ValueProblem]()
    in_order(uses, problems, {name: name for name in given}, "observables")
    refuse("observables", problems)
    return given


class Bracket(NamedTuple):
    """Two functions of the state, of which the Poisson bracket is asked for."""

    first: Expression
    second: Expression


def _read_brackets(raw: object, info: ValidationInfo) -> tuple[Bracket, ...]:
    """Pairs of observables, variables or H, or of expressions in them."""
    env = environment(info)
    example = "[[Lx, Ly], [Lx, H]]"
    if not isinstance(raw, list | tuple) or not 1 <= len(raw) <= MOST_ENTRIES:
        typed = re.fullmatch(
            r"[{\[(]?([^,{}\[\]]+),([^,{}\[\]]+)[}\])]?", raw if isinstance(raw, str) else ""
        )
        hint = typed and f"write `[[{typed[1].strip()}, {typed[2].strip()}]]`"
        raise ValueProblem(f"read {shown(raw)}, expected a list of pairs, such as {example}", hint=hint)
    if len(raw) == 2 and all(isinstance(entry, str) and "," not in entry for entry in raw):
        raw = [raw]
    variables = of_the_state(env)
    brackets, problems = list[Bracket](), list[ValueProblem]()
    for place, entry in enumerate(raw):
        with gathered(problems, place):
            pair = [*map(str.strip, entry.strip("{} ").split(","))] if isinstance(entry, str) else entry
            if isinstance(pair, Mapping) and set(pair.values()) == {None}:  # {Lx, Ly} is a mapping in YAML
                pair = [*pair]
            if not isinstance(pair, list | tuple) or len(pair) != 2:
                raise ValueProblem(f"read {shown(entry)}, expected a pair, such as [Lx, Ly]")
            brackets.append(Bracket(*(env.symbolic(side, None, variables) for side in pair)))
    refuse("brackets", problems)
    return tuple(brackets)


Observables: TypeAlias = Annotated[
    dict[str, Expression],
    ReadBy(_read_observables, {"type": "object", "additionalProperties": EXPRESSION_SCHEMA}),
]
_PAIR = {"type": "array", "items": EXPRESSION_SCHEMA, "minItems": 2, "maxItems": 2}
Brackets: TypeAlias = Annotated[
    tuple[Bracket, ...], ReadBy(_read_brackets, {"type": "array", "items": _PAIR, "minItems": 1})
]
