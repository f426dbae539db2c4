"""Tables as text: a line with the names of the columns, then a line of numbers for each row.

Commas, semicolons, tabs or blanks separate the cells; where commas do not, numbers may have decimal commas.
A head may have a unit: `t`, `Time (s)`, `t [ms]`, `theta/rad`. Empty lines, and lines with `#` before the
heads, are passed over; as numpy writes a table, the last of these has the heads.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ExpressionError, ValueProblem, shown
from rigidcli.fields.units import Unit, parse_unit
from rigidcli.homework.base import Tree, Unreadable
from rigidcli.homework.numbers import read_numbers, read_units, scale_in
from rigidcli.language import tree
from rigidcli.language.expression import array, parse
from rigidcli.language.latex import plain

TIME = "t"

SECOND = parse_unit("s")

_UNIT = re.compile(r"(?P<name>[^(\[/]*?)\s*(?:\((?P<round>.*)\)|\[(?P<square>.*)\]|/(?P<below>.*))")
_DECIMAL = re.compile(r"[-+]?(?:[0-9]{1,30}\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,2})?")
"""A decimal number within the range of numbers; others, and expressions, take longer to read."""


@dataclass(frozen=True, slots=True)
class TypedColumn:
    """The numbers of a column (n) as typed, under a head with a `name` and perhaps a `unit`."""

    name: str
    unit: Unit | None
    values: Floats

    def in_si(self, unit: Unit | None) -> Floats:
        """The numbers in SI units; a column without a unit of its own is in `unit`. Raises Unreadable."""
        own = self.unit or unit
        if own is None:
            return self.values
        try:
            return self.values * scale_in(own, (unit or own).dimension)
        except ValueProblem as problem:
            raise Unreadable("unit_incompatible", problem.message, place=shown(self.name)) from None


def read_table(text: str, wanted: Collection[str] | None = None) -> dict[str, TypedColumn]:
    """The columns of a table by their names: those `wanted`, in any usual spelling, as far as there are any.

    Names are compared as typed, then without regard to capitals, underscores and Greek letters; two heads
    that come to the same name are none of them. Raises Unreadable.
    """
    text = text.removeprefix("\ufeff").translate({ord('"'): None, ord("\N{MINUS SIGN}"): "-"})
    lines = [(n, line) for n, line in enumerate(re.split("\r\n?|\n", text), 1) if line.strip()]
    heads, separator, begin = _heads([line for _, line in lines])
    rows = [(number, _cells(line, separator)) for number, line in lines[begin:]]
    if not rows:
        raise Unreadable("wrong_shape", "there are no rows of numbers")
    for number, cells in rows:
        if len(cells) != len(heads):
            detail = f"{len(cells)} cells, expected {len(heads)}"
            if separator == "," and len(cells) == 2 * len(heads):
                detail += "; with decimal commas, separate cells with `;`"
            raise Unreadable("wrong_shape", detail, place=f"line {number}")
    named = [_head(head) for head in heads]
    columns = {}
    for name, place in _places([name for name, _ in named], wanted).items():
        numbers = [_number(cells[place], line, name) for line, cells in rows]
        columns[name] = TypedColumn(name, named[place][1], np.array(numbers))
    return columns


def _heads(lines: Sequence[str]) -> tuple[list[str], str | None, int]:
    """The heads of columns, what separates cells (None for blanks), and the index of the first row."""
    begin = next((k for k, line in enumerate(lines) if not line.lstrip().startswith("#")), None)
    if begin is None:
        raise Unreadable("wrong_shape", "read an empty table, expected a line of names and lines of numbers")
    separator = next((each for each in ";\t," if each in lines[begin]), None)
    heads = lines[begin].split(separator)
    if all(map(_DECIMAL.fullmatch, _cells(lines[begin], separator))):
        above = lines[begin - 1].lstrip(" #").split(separator) if begin else []
        if len(above) != len(heads):
            raise Unreadable("missing_column", "the first line has no names of columns", place=shown(TIME))
        heads, begin = above, begin - 1
    return [head.strip() for head in heads], separator, begin + 1


def _cells(line: str, separator: str | None) -> list[str]:
    """The cells of a line, with decimal points; blanks separate them where `separator` is None."""
    return [cell.strip() for cell in (line if separator == "," else line.replace(",", ".")).split(separator)]


def _number(cell: str, line: int, name: str) -> float:
    if _DECIMAL.fullmatch(cell):
        return float(cell)
    return read_numbers(cell, None, f"line {line}, column {shown(name)}")[0].value


def _head(text: str) -> tuple[str, Unit | None]:
    """The name and the unit in a head such as `x (cm)`; an unknown unit counts as none."""
    match = _UNIT.fullmatch(text) if len(text) <= 200 else None  # a longer one takes long
    if match is None:
        return text, None
    unit = (match["round"] or match["square"] or match["below"] or "").strip()
    with suppress(Unreadable):
        # A column `x(t)` is a function of the time, and not in tonnes.
        return match["name"], None if unit.casefold() in ("", TIME, "time") else read_units(unit)[0]
    return match["name"], None


def _places(heads: Sequence[str], wanted: Collection[str] | None) -> dict[str, int]:
    """The index of each wanted column. Raises Unreadable for two columns of one name."""
    if wanted is None:
        wanted = dict.fromkeys(TIME if _usual(head) == TIME else head for head in heads)
    usual = [_usual(head) for head in heads]
    indices = {}
    for name in wanted:
        places = [k for k, head in enumerate(heads) if head == name]
        if len(places) > 1:
            raise Unreadable("duplicate_key", "there are several columns of this name", place=shown(name))
        if not places:
            places = [k for k, head in enumerate(usual) if head == _usual(name) and heads[k] not in wanted]
        if not places and name.startswith("p_") and sum(each.startswith("p_") for each in wanted) == 1:
            places = [k for k, head in enumerate(usual) if head == "p"]
        if len(places) == 1:
            indices[name] = places[0]
    return indices


def _usual(name: str) -> str:
    """A name in small ASCII letters without underscores: `Θ_1` is theta1, `omega_1` is w1, `Time` is t."""
    with suppress(ExpressionError):  # a head that is no name
        name = plain(name)
    small = re.sub(r"[\s_{}]", "", name).casefold()
    return {"time": TIME}.get(small) or re.sub(r"omega(?=[0-9]|$)", "w", small)


def table_text(answer: Tree) -> str:
    """The table of an answer. Raises Unreadable."""
    text = answer["csv"] if isinstance(answer, dict) and set(answer) == {"csv"} else answer
    if not isinstance(text, str) or "\n" not in text.strip():
        hint = "expected `{file: orbit.csv}`, or `csv: |` and the table"
        raise Unreadable("wrong_shape", f"read {shown(answer)}, {hint}")
    return text


def tabulated(span: Tree, texts: Tree) -> dict[str, TypedColumn]:
    """The columns of formulas of `t`, at as many times as they ask for or more. Raises ValueProblem."""
    times = _times(span)
    columns = {TIME: TypedColumn(TIME, None, times)}
    for name, text in texts.items() if isinstance(texts, dict) else ():
        place = ("answer", "columns", name)
        try:
            root = parse(str(text)).root
        except ExpressionError as error:
            raise ValueProblem(error.message, path=place) from None
        if not tree.names_in(root) <= {TIME} or name == TIME:
            raise ValueProblem("expected a formula of `t` and numbers alone", path=place)
        values = array(root, {TIME: times}) + 0 * times
        if not np.isfinite(values).all():
            raise ValueProblem("has no finite real value at some of the times", path=place)
        columns[str(name)] = TypedColumn(str(name), None, values)
    return columns


def _times(span: Tree) -> Floats:
    """Times from `start` to `stop`, at least as dense as `step`. Raises ValueProblem."""
    try:
        start, stop, step = (read_numbers(entry, SECOND)[0].value for entry in span)
    except (Unreadable, TypeError, ValueError):
        start, stop, step = 0.0, 0.0, 0.0
    if not (start < stop and 0 < step <= stop - start and (stop - start) / step < 1_000_000):
        hint = "write three numbers, the start before the stop, and a step that fits between"
        raise ValueProblem("expected `[start, stop, step]`", path=("answer", TIME), hint=hint)
    # Of fewer rows, a line between two would not be near.
    return np.linspace(start, stop, max(4001, round((stop - start) / step) + 1))
