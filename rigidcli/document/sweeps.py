"""`--sweep KEY=VALUES`: the values over which a key of a document runs, and grids of several keys.

Values are texts, as after `--set`. A value of a range is computed exactly when it is needed, so that a sweep
of 1e9 values takes no memory.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from decimal import Context
from fractions import Fraction
from typing import Any, NamedTuple

from rigidcli.document.draft import SWEEP, split_setting
from rigidcli.document.yaml_reader import read_value
from rigidcli.errors import DocumentError, UsageError, ValueProblem, shown
from rigidcli.fields.environment import Amount, Environment, arithmetic_for, finite
from rigidcli.fields.texts import csv_rows
from rigidcli.fields.units import exact_text
from rigidcli.language.tree import Number
from rigidcli.suggestions import guess

# The ways to write values, for messages.
FORMS_OF_VALUES = "START:STOP:COUNT, log:START:STOP:COUNT, 1,2,5 or @table.csv:column"
MOST_VALUES_OF_RANGE = 10**15  # the most values of a range: more than any machine works out
# Logarithmic steps are worked with 40 digits, so that 1 to 1000 in four steps has 10 and 100 in it.
FORTY_DIGITS = Context(prec=40)


@dataclass(frozen=True)
class Range:
    """The texts of `count` values from `start` to `stop`, both included, all in the same `unit`.

    They are computed exactly and rounded once: 0:1:11 has 0.3, where a sum of floats has 0.30000000000000004.
    In a `logarithmic` range neighbours have the same ratio, else the same difference. A range `is_rounded`
    where an end is an expression such as `pi/2`.
    """

    start: Fraction
    stop: Fraction
    count: int
    unit: str
    is_rounded: bool
    logarithmic: bool

    def text(self, index: int, exact: bool) -> str:
        """The value at an index. Raises UsageError where an `exact` value would have to be rounded."""
        last = max(self.count - 1, 1)
        if self.logarithmic and 0 < index < last:
            ratio = self.stop / self.start
            step = FORTY_DIGITS.divide(ratio.numerator, ratio.denominator)
            value = self.start * Fraction(FORTY_DIGITS.power(step, FORTY_DIGITS.divide(index, last)))
        else:
            value = self.start + (self.stop - self.start) * Fraction(index, last)
        text = exact_text(value, 0) if exact else repr(float(value))
        if exact and (self.is_rounded or self.logarithmic or ("/" in text and self.unit)):
            hint = "choose another COUNT, or list the values, as in `--sweep KEY=0,pi/4,pi/2`"
            raise UsageError("the values of this range would be rounded, expected exact numbers", hint=hint)
        return f"{text} {self.unit}".rstrip()


class SweptKey(NamedTuple):
    """A key of a document, the values over which it runs, and the file with these values, if there is one."""

    name: str
    values: Range | tuple[str, ...]
    file: str = ""

    @property
    def size(self) -> int:
        """The number of its values, which may be larger than a list can have."""
        return self.values.count if isinstance(self.values, Range) else len(self.values)


@dataclass(frozen=True)
class Sweep:
    """The values of one key or several: a grid, in which the first key changes slowest, or pairs.

    Values of ranges are `exact` numbers or floats.
    """

    keys: tuple[SweptKey, ...]
    paired: bool = False
    exact: bool = False

    @property
    def count(self) -> int:
        """The number of points."""
        return math.prod(key.size for key in self.keys[: 1 if self.paired else None])

    @property
    def files(self) -> tuple[str, ...]:
        """The tables that values are read from."""
        return tuple(key.file for key in self.keys if key.file)

    def point(self, index: int) -> tuple[str, ...]:
        """The values at one point of the sweep: a text for each key. Raises UsageError as `Range.text`."""
        texts = []
        for key in reversed(self.keys):
            rest, place = (index, index) if self.paired else divmod(index, key.size)
            values, index = key.values, rest
            texts.append(values.text(place, self.exact) if isinstance(values, Range) else values[place])
        return tuple(reversed(texts))

    def settings(self, point: Sequence[str]) -> list[str]:
        """The point as texts `KEY=VALUE`."""
        return [f"{key.name}={text}" for key, text in zip(self.keys, point, strict=True)]

    def swept(self, point: Sequence[str], exact: bool) -> Iterator[tuple[str, Any, str]]:
        """For each key its name, its value in results, and the SI unit of that where a unit is typed."""
        for key, text in zip(self.keys, point, strict=True):
            yield key.name, *_value(text, exact)


def read_sweep(texts: Sequence[str], paired: bool) -> Sweep:
    """The sweep that the texts after `--sweep` describe. Raises UsageError."""
    keys = tuple(map(_read_key, texts))
    names = [key.name for key in keys]
    if twice := [name for name in names if names.count(name) > 1]:
        raise UsageError(f"`{twice[0]}` is swept twice")
    if paired and len(keys) < 2:
        raise UsageError("`--zip` pairs the values of several keys", hint="give `--sweep` for each of them")
    if paired and len({key.size for key in keys}) > 1:
        each = ", ".join(f"{key.size:,} of `{key.name}`" for key in keys)
        raise UsageError(f"`--zip` needs as many values of each key, read {each}")
    return Sweep(keys, paired)


def _read_key(text: str) -> SweptKey:
    path, values = split_setting(text, SWEEP, f"KEY={FORMS_OF_VALUES}", "top.spin=100:2000:20")
    values = values.strip()
    name = ".".join(map(str, path))
    if cure := _colons_meant(values):
        raise _unreadable(name, values, f"write `{name}={cure}`")
    if values.startswith("@"):
        return SweptKey(name, *_column(name, values[1:]))
    parts = split_outside(values, ":")
    if len(parts) > 1:
        return SweptKey(name, _range(name, values, parts))
    texts = split_outside(values, ",")
    if not all(texts):
        raise _unreadable(name, values)
    return SweptKey(name, texts)


def _unreadable(name: str, values: str, hint: str | None = None) -> UsageError:
    return UsageError(f"`{name}`: read {shown(values)}, expected {FORMS_OF_VALUES}", hint=hint)


# A range as it is written elsewhere: `1..10`, `1-10`, `1 to 10`.
_SPAN = re.compile(r"\s*(-?[\d.]*?\d)\s*(?:\.\.+|…|to|-)\s*(-?\d[\d.]*)\s*")


def _colons_meant(typed: str) -> str | None:
    """The range START:STOP:COUNT that was meant by `1..10` or `linspace(1, 10, 5)`; None for others."""
    if call := re.fullmatch(r"(?:np\.)?(linspace|range|arange)\((.*)\)", typed):
        parts = [part.strip() for part in call[2].split(",")]
        return ":".join([*parts[:2], parts[2] if len(parts) > 2 and call[1] == "linspace" else "10"])
    if span := _SPAN.fullmatch(typed):
        with suppress(ValueError):
            start, stop = float(span[1]), float(span[2])
            if start < stop:
                return f"{span[1]}:{span[2]}:{int(stop - start) + 1 if start.is_integer() else 10}"
    return None


def _range(name: str, typed: str, parts: Sequence[str]) -> Range:
    logarithmic = parts[0] == "log"
    if len(parts) != 3 + logarithmic:
        raise _unreadable(name, typed)
    *texts, last = parts[-3:]
    numbers, units, is_rounded = list[Fraction](), set[str](), False
    for text in texts:
        try:
            end = Environment().typed(text)
            if isinstance(end, Amount):
                number, unit = finite(end.number), end.unit
            else:  # a number, perhaps with a sign, or something like pi/2
                is_rounded |= not isinstance(getattr(end.root, "operand", end.root), Number)
                number, unit = finite(end.evaluate({})), None
        except ValueProblem as problem:
            read = "" if problem.message.startswith("read ") else f"read {shown(text)}, expected a number: "
            raise UsageError(f"`{name}`: {read}{problem.message}", hint=problem.hint) from None
        numbers.append(Fraction(repr(number)))
        if unit or number:  # zero needs no unit
            units.add(unit.text if unit else "")
    if len(units) > 1:
        hint = "write both in the same unit, as in `1 cm:20 cm:20`"
        raise UsageError(f"`{name}`: read {shown(typed)}, whose ends differ in their units", hint=hint)
    if logarithmic and numbers[0] * numbers[1] <= 0:
        raise UsageError(f"`{name}`: logarithmic steps need ends of the same sign, and not 0")
    with suppress(ValueError):
        count = finite(last)
        if count.is_integer() and 1 <= count <= MOST_VALUES_OF_RANGE:
            start, stop = numbers
            return Range(start, stop, int(count), "".join(units), is_rounded, logarithmic)
    raise UsageError(f"`{name}`: read {shown(last)}, expected a COUNT from 1 to {MOST_VALUES_OF_RANGE:.0e}")


_PIECES = re.compile(r'"(?:[^"\\]|\\.)*"|\'[^\']*\'|.', re.DOTALL)  # A text in quotes, or one character


def split_outside(text: str, mark: str) -> tuple[str, ...]:
    """The parts of a text between marks that stand outside of brackets and quotes."""
    parts, depth = [""], 0
    for piece in _PIECES.findall(text):
        depth += (piece in "[{(") - (piece in "]})") if len(piece) == 1 else 0
        if piece == mark and depth == 0:
            parts.append("")
        else:
            parts[-1] += piece
    return tuple(part.strip() for part in parts)


def _column(name: str, text: str) -> tuple[tuple[str, ...], str]:
    """The values of a column, with the unit in a head such as `x (cm)`, and its file."""
    path, _, head = text.rpartition(":")
    if not path or not head:
        raise UsageError(f"`{name}`: read {shown('@' + text)}, expected @table.csv:column")
    try:
        rows = csv_rows(path)
        _, heads = next(rows, (1, []))
        if head not in heads:
            hint = f"its columns are {', '.join(heads)}"
            raise UsageError(f"`{path}` has no column {shown(head)}{guess(head, heads)}", hint=hint)
        place, cells = heads.index(head), []
        unit = re.search(r"(?<=[(\[])[^)\]]+(?=[)\]]$)", head)
        for line, row in rows:
            cells.append("".join(row[place : place + 1]))
            if not cells[-1]:
                raise UsageError(f"{path}:{line}: this cell of the column is empty")
    except ValueProblem as problem:
        raise UsageError(f"`{path}` {problem.message}") from None
    return tuple(f"{cell} {unit[0]}" if unit else cell for cell in cells), path


def _value(text: str, exact: bool) -> tuple[Any, str]:
    """The SI value of a number, or of a quantity with its SI unit; other texts as they are typed."""
    if not exact:
        with suppress(ValueError):
            return finite(text), ""
    env = Environment(arithmetic_for(exact))
    try:
        typed = env.typed(read_value(text, ""))
        unit = typed.unit if isinstance(typed, Amount) else None
        return env.worked(typed, None), unit.dimension.unit if unit else ""
    except (DocumentError, ValueProblem):
        return text, ""
