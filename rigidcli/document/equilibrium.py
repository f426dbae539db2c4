"""The equilibrium about which small oscillations are asked: its coordinates, or where to look for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pydantic import ValidationInfo

from rigidcli.document.parameters import read_names
from rigidcli.document.variables import MOST_COORDINATES, require_known
from rigidcli.errors import ValueProblem, gathered, shown
from rigidcli.fields.section import environment, refuse
from rigidcli.language.expression import Expression


@dataclass(frozen=True, slots=True)
class Equilibrium:
    """Values of all coordinates, in the parameters; if it `is_sought`, they are only near it."""

    values: Mapping[str, Expression]
    is_sought: bool


def read_equilibrium(raw: object, info: ValidationInfo) -> Equilibrium:
    """The equilibrium in a document: `{theta: pi}`, or `{find: {theta: 3}}`. Raises ValueProblem."""
    env, given = environment(info), raw
    below: tuple[str, ...] = ()
    if isinstance(raw, Mapping) and "find" in raw and "find" not in (env.coordinates or ()):
        given, below = raw["find"], ("find",)
    if not isinstance(given, Mapping):
        raise ValueProblem(
            f"read {shown(given)}, expected the coordinates there, such as {{theta: 0}}, "
            "or near it, such as {find: {theta: 3}}"
        )
    if len(given) > MOST_COORDINATES:
        raise ValueProblem(f"read {len(given)} values, expected at most {MOST_COORDINATES}")
    spelling, problems = read_names(given)
    if below and isinstance(raw, Mapping):
        problems = [problem.below(*below) for problem in problems]
        problems += [
            ValueProblem("stands beside `find`, expected in it", path=(key,)) for key in raw if key != "find"
        ]
    names, values = env.coordinates, {}
    for name, key in spelling.items():
        with gathered(problems, *below, key):
            require_known(name, names, f"expected the coordinates {', '.join(names or ())}")
            values[name] = env.symbolic(given[key])
            env.admit(values[name], ())
    problems += [
        ValueProblem("missing, expected its value at the equilibrium, such as 0", path=(*below, name))
        for name in names or ()
        if name not in spelling
    ]
    refuse("equilibrium", problems)
    return Equilibrium(values, bool(below))
