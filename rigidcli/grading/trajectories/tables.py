"""A table as text: a line with the names of columns, then a line of numbers for each row.

Cells are parted by commas, semicolons, tabs or blanks, whichever the line of names has first in this order;
quotation marks mean nothing. Empty lines, and lines with `#` before the names, are passed over; as numpy
writes it, the last of these may hold the names. A head is a name, perhaps with a unit: `t`, `Time (s)`,
`t [ms]`, `theta/rad`, `θ1`, `px`. Names are told from each other as typed, then in ASCII and without the
unit, then in the usual spellings, and at last without regard to case or blanks: each time only where one head
and one column have the same name.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ExpressionError, shown
from rigidcli.fields.dimensions import TIME as OF_TIME
from rigidcli.grading.expressions.formula import spellings
from rigidcli.grading.numbers import read_written
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.units import read_unit
from rigidcli.language.expression import parse
from rigidcli.language.tree import Name

TIME = "t"

MOST_CHARACTERS = 1_000_000
"""Of a table."""

MOST_EXPRESSIONS = 1_000
"""Cells that are no decimal numbers, but expressions such as `pi/6`."""

MOST_HEADS, LONGEST_HEAD = 200, 200
"""Heads, and characters of one, that may be spelled differently from what is asked for."""

SEPARATORS = ",;\t"

USUAL = {"time": TIME}
"""Names that mean another, in small letters."""

# All that decimal numbers consist of: of such characters, float() accepts nothing else.
_DECIMALS = re.compile(r"[0-9eE+\-.\s]*")
_UNIT = re.compile(
    r"(?P<name>[^(\[/]*?)\s*(?:\((?P<round>.*)\)|\[(?P<square>.*)\]|/(?P<below>.*))", re.DOTALL
)
_BRACKETS = re.compile(r"\s{0,9}[(\[][^()\[\]]{0,60}[)\]]")
_OMEGA = re.compile(r"omega(?=[0-9]|$)")


@dataclass(frozen=True, slots=True)
class Head:
    """The `text` over a column, the `name` that it has in ASCII, and its `unit` as typed (empty for none)."""

    text: str
    name: str
    unit: str = ""

    @classmethod
    def read(cls, text: str) -> Head:
        """What a head tells."""
        if len(text) > LONGEST_HEAD:
            return cls(text, text)
        found = _UNIT.fullmatch(text)
        unit = "" if found is None else found["round"] or found["square"] or found["below"] or ""
        name = unicodedata.normalize("NFKC", text if found is None else found["name"])
        try:
            root = parse(name).root
        except ExpressionError:
            root = None
        return cls(text, root.name if isinstance(root, Name) else name, unit.strip())

    def scale(self, *, any_unit: bool) -> float:
        """What makes SI units of the unit: of `any_unit`, or of one of time; 1 where it is not known."""
        try:
            # A column `x(t)` is a function of the time, and not in tonnes.
            unit = read_unit(self.unit) if self.unit.casefold() not in ("", TIME, *USUAL) else None
        except Unreadable:
            unit = None
        return unit.scale if unit is not None and (any_unit or unit.dimension == OF_TIME) else 1.0


def read_columns(
    text: str, wanted: Collection[str] | None = None, further: Collection[str] = (), *, in_si: bool = False
) -> dict[str, Floats]:
    """The columns of a table (n each) that are `wanted`, in any spelling, as far as it has them; or all.

    Those `further` ones are read that go by their own name. Of a unit in its head, the time is converted to
    seconds, and to be `in_si` units other columns are, too. Raises Unreadable.
    """
    if len(text) > MOST_CHARACTERS:
        raise Unreadable("too_large", f"expected at most {MOST_CHARACTERS:,} characters")
    numbers, lines = _lines(text)
    heads, separator, begin = _header(lines)
    rows, numbers = [line.split(separator) for line in lines[begin:]], numbers[begin:]
    if not rows:
        raise Unreadable("wrong_shape", "there are no rows of numbers")
    for number, row in zip(numbers, rows, strict=True):
        if len(row) != len(heads):
            message = f"{len(row)} cells, expected {len(heads)}"
            raise Unreadable("wrong_shape", message, place=f"line {number}")
    if wanted is None:
        names = [Head.read(head).name for head in heads]
        wanted = dict.fromkeys(
            TIME if name.casefold() in USUAL and TIME not in names else name for name in names
        )
    columns = {}
    for name, (place, head) in _places(heads, wanted, further).items():
        column = _column([row[place] for row in rows], name, numbers)
        columns[name] = column * head.scale(any_unit=in_si) if in_si or name == TIME else column
    return columns


def _lines(text: str) -> tuple[list[int], list[str]]:
    """The numbers of the lines that are not empty, and these lines."""
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    text = text.replace('"', "").replace("\N{MINUS SIGN}", "-")
    told = [(number, line) for number, line in enumerate(text.split("\n"), start=1) if line.strip()]
    return [number for number, _ in told], [line for _, line in told]


def _header(lines: Sequence[str]) -> tuple[list[str], str | None, int]:
    """The heads of columns, what parts cells (None for blanks), and the index of the first row."""
    begin = 0
    while begin < len(lines) and lines[begin].lstrip().startswith("#"):
        begin += 1
    if begin == len(lines):
        raise Unreadable("wrong_shape", "read an empty table, expected a line of names and lines of numbers")
    line = lines[begin]
    separator = next((each for each in SEPARATORS if each in line), None)
    heads = _split(line, separator)
    if not _DECIMALS.fullmatch("".join(heads)):
        return heads, separator, begin + 1
    above = _split(lines[begin - 1].lstrip(" #"), separator) if begin else []
    if len(above) != len(heads):
        raise Unreadable("missing_column", "the first line has no names of columns", place=TIME)
    return above, separator, begin


def _split(line: str, separator: str | None) -> list[str]:
    """The heads in a line, parted by blanks where there is no separator: `t (s)  x (m)` are two."""
    if separator is None:
        line = _BRACKETS.sub(lambda found: "*".join(found[0].split()), line)
    return [head.strip() for head in line.split(separator)]


def _column(cells: list[str], name: str, numbers: Sequence[int]) -> Floats:
    """The numbers in cells of any kind, which are in lines of these `numbers`. Raises Unreadable."""
    if _DECIMALS.fullmatch("".join(cells)):
        try:
            values = np.array(list(map(float, cells)))
        except ValueError:
            pass  # such as `1e`: what follows says where
        else:
            if np.isfinite(values).all():
                return values
    read, expressions = [], 0
    for cell, number in zip(cells, numbers, strict=True):
        place = f"line {number}, column {shown(name)}"
        written = read_written(cell.strip(), place)
        if written.unit is not None:
            raise Unreadable("not_a_number", f"read {shown(cell)}, expected no unit", place=place)
        expressions += not written.mantissa
        if expressions > MOST_EXPRESSIONS:
            raise Unreadable("too_large", f"expected at most {MOST_EXPRESSIONS:,} expressions", place=place)
        read.append(written.value)
    return np.array(read)


def _places(
    texts: Sequence[str], wanted: Collection[str], further: Collection[str]
) -> Mapping[str, tuple[int, Head]]:
    """Where the columns stand that are `wanted`, and those `further` ones that go by their own name.

    Raises Unreadable where several have the same name.
    """
    heads = [Head.read(text) for text in texts[:MOST_HEADS]]
    heads += [Head(text, text) for text in texts[MOST_HEADS:]]
    momenta = [name for name in wanted if name.startswith("p_")]
    other = spellings((*wanted, *further), momenta, ())
    capital = {spelling.casefold(): name for spelling, name in other.items()}

    def usual(name: str) -> str:
        return _OMEGA.sub("w", other.get(name, USUAL.get(name, name)).replace("_", ""))

    def small(name: str) -> str:
        name = "".join(name.split()).casefold()
        return usual(USUAL.get(name, capital.get(name, name))).casefold()

    found: dict[str, int] = {}
    _match(found, [head.text for head in heads], wanted, str, several=True)
    names = [head.name for head in heads]
    _match(found, names, wanted, str, several=True)
    _match(found, names[:MOST_HEADS], wanted, usual)
    _match(found, names[:MOST_HEADS], wanted, small)
    _match(found, names, further, str, several=True)
    return {name: (place, heads[place]) for name, place in found.items()}


def _match(
    found: dict[str, int],
    heads: Sequence[str],
    wanted: Collection[str],
    form: Callable[[str], str],
    *,
    several: bool = False,
) -> None:
    """Adds where the columns stand that are not `found` yet, and have the same `form` as one head alone.

    Raises Unreadable where `several` have it, if that is not to be passed over.
    """
    taken = set(found.values())
    lacking = [name for name in wanted if name not in found]
    meant = Counter(map(form, lacking))
    at: dict[str, list[int]] = {}
    for place, head in enumerate(heads if lacking else ()):
        if place not in taken:
            at.setdefault(form(head), []).append(place)
    for name in lacking:
        own = at.get(form(name), [])
        if several and len(own) > 1:
            raise Unreadable("duplicate_key", "there are several columns of this name", place=shown(name))
        if len(own) == 1 and meant[form(name)] == 1:
            found[name] = own[0]
