"""Functions without a formula, such as a potential V(x) of which nothing is known but its arguments."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations_with_replacement
from typing import Any

from pydantic import ValidationInfo

from rigidcli.document.parameters import read_mapping, read_name
from rigidcli.document.variables import MOST_COORDINATES, blame_parameter, derived_names
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.readers import ReadBy
from rigidcli.fields.section import environment
from rigidcli.language.tree import UnknownFunction

MOST_ARGUMENTS = 6
"""The most arguments of an unknown function: two points in space."""

HIGHEST_DERIVATIVE = 3
"""The highest derivative of an unknown function that may be written in a document, such as dV_dx_dx_dx."""


def _read_functions(raw: object, info: ValidationInfo) -> tuple[UnknownFunction, ...]:
    env = environment(info)
    coordinates = env.coordinates or ()
    taken = dict.fromkeys(coordinates, "a coordinate") | derived_names(coordinates)
    slopes: dict[str, UnknownFunction] = {}

    def read(name: str, value: Any) -> UnknownFunction:
        function = UnknownFunction(name, _arguments(value))
        if name in taken:
            raise ValueProblem(f"`{name}` is {taken[name]}, expected another name")
        blame_parameter(name, "an unknown function", env)
        slopes.update({str(slope): slope for slope in _with_derivatives(function)})
        return function

    def twice(spelling: Mapping[str, str]) -> Iterator[ValueProblem]:
        for name in spelling:
            if name in slopes and (base := slopes[name].base) != name:
                message = f"`{name}` is the derivative of `{base}`, expected another name"
                yield ValueProblem(message, path=(spelling[name],))

    functions = read_mapping(raw, read, example="{V: [x]}", most=MOST_COORDINATES, besides=twice)
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
