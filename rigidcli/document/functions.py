"""Functions without a formula, such as a potential V(x) of which nothing is known but its arguments."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations_with_replacement

from pydantic import ValidationInfo

from rigidcli.document.parameters import read_name, read_names
from rigidcli.document.variables import blame_parameter, derived_names
from rigidcli.errors import ValueProblem, gathered, shown
from rigidcli.fields.readers import ReadBy
from rigidcli.fields.section import environment, refuse
from rigidcli.language.tree import UnknownFunction

MOST_ARGUMENTS = 6
"""The most arguments of an unknown function: two points in space."""

HIGHEST_DERIVATIVE = 3
"""The highest derivative of an unknown function that may be written in a document, such as dV_dx_dx_dx."""


def _read_functions(raw: object, info: ValidationInfo) -> tuple[UnknownFunction, ...]:
    env = environment(info)
    if not isinstance(raw, Mapping):
        raise ValueProblem(
            f"read {shown(raw)}, expected a mapping from names to arguments, such as {{V: [x]}}"
        )
    spelling, problems = read_names(raw)
    coordinates = env.coordinates or ()
    taken = dict.fromkeys(coordinates, "a coordinate") | derived_names(coordinates)
    found = []
    for name, key in spelling.items():
        with gathered(problems, key):
            if name in taken:
                raise ValueProblem(f"`{name}` is {taken[name]}, expected another name")
            found.append(UnknownFunction(name, _arguments(raw[key])))
            blame_parameter(name, "an unknown function", env)
    slopes = [slope for function in found for slope in _with_derivatives(function)]
    env.functions = {str(slope): slope for slope in slopes}
    for function in found:
        other = next((slope for slope in slopes if slope == function and slope.by), None)
        if other is not None:
            message = f"`{function}` is the derivative of `{other.base}`, expected another name"
            problems.append(ValueProblem(message, path=(spelling[function],)))
    refuse("functions", problems)
    return tuple(found)


def _arguments(raw: object) -> list[str]:
    """The names of the arguments: one, or a list of them."""
    entries = [raw] if isinstance(raw, str) else raw
    if not isinstance(entries, list | tuple) or not 1 <= len(entries) <= MOST_ARGUMENTS:
        raise ValueProblem(f"read {shown(raw)}, expected a list of 1 to {MOST_ARGUMENTS} names, such as [x]")
    names = [entry if entry == "t" else read_name(entry) for entry in entries]
    if len(set(names)) < len(names):
        raise ValueProblem(f"read {', '.join(names)}: expected different names")
    return names


def _with_derivatives(function: UnknownFunction) -> list[UnknownFunction]:
    """The function and its derivatives that a document may write."""
    places = range(len(function.parameters))
    return [
        UnknownFunction(function.base, function.parameters, by)
        for order in range(HIGHEST_DERIVATIVE + 1)
        for by in combinations_with_replacement(places, order)
    ]


FUNCTIONS = ReadBy(
    _read_functions,
    {
        "type": "object",
        "additionalProperties": {
            "anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}],
        },
        "description": "Functions without a formula, with the names of their arguments, such as V: [x]",
    },
)
"""Marks the field with the unknown functions of a system."""
