"""Tables of csv that instructors give."""

from __future__ import annotations

import csv
import io
import os
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice

from rigidcli.errors import DocumentError, Problem
from rigidcli.fields.texts import read_text, safe_name

# Length of a file that an instructor gives: a gradebook of thousands of students has some 5 MB.
MOST_BYTES = 50_000_000
ROWS_TRIED = 20  # rows by which the separator of cells is chosen


def read_own(path: str | os.PathLike[str]) -> str:
    """The text of a file that an instructor gives, or of a pipe. Raises DocumentError.

    Spreadsheets write UTF-8, UTF-16 with its mark, or Windows' own code.
    """
    return read_text(os.fspath(path), safe_name(path), MOST_BYTES, fallback="cp1252")


@dataclass(frozen=True, slots=True)
class Spreadsheet:
    """A table of csv with its `text`, and what separates the cells of its `rows`; `source` is its name.

    `lines` tells on which line of the text each row begins.
    """

    source: str
    text: str
    separator: str
    rows: list[list[str]]
    lines: list[int]

    def with_rows(self, rows: Sequence[Sequence[str]]) -> str:
        """The text of these rows, whose lines end like those of this table."""
        end = next((end for end in ("\r\n", "\n") if end in self.text), "\r")
        target = io.StringIO(newline="")
        csv.writer(target, delimiter=self.separator, lineterminator=end).writerows(rows)
        text = target.getvalue() if self.text.endswith(end) else target.getvalue().removesuffix(end)
        return "\ufeff" * self.text.startswith("\ufeff") + text


def read_spreadsheet(path: str | os.PathLike[str]) -> Spreadsheet:
    """The table of csv in a file. Raises DocumentError."""
    return spreadsheet_of(read_own(path), safe_name(path))


def spreadsheet_of(text: str, source: str = "") -> Spreadsheet:
    """A text as a table of csv, whatever separates the cells. Raises DocumentError."""
    body = text.removeprefix("\ufeff")
    separator = max(",;\t", key=lambda mark: _fit(body, mark))
    rows, lines = list[list[str]](), [1]
    reader = csv.reader(io.StringIO(body, newline=""), delimiter=separator)
    try:
        for row in reader:
            rows.append(row)
            lines.append(reader.line_num + 1)
        if rows and "".join(rows[-1][-1:]).endswith(("\n", "\r")) and not body.rstrip().endswith('"'):
            lines.pop()
            raise csv.Error("a quotation mark is opened, and not closed")
    except csv.Error as error:
        message = f"cannot be read as a table: {error}"
        raise DocumentError([Problem(source, message, lines[-1])]) from None
    return Spreadsheet(source, text, separator, rows, lines)


def _fit(text: str, separator: str) -> tuple[int, int]:
    """How many of the first rows have the same number of cells, if these are several, and that number."""
    rows = islice(csv.reader(io.StringIO(text, newline=""), delimiter=separator), ROWS_TRIED)
    with suppress(csv.Error):
        numbers = Counter(len(row) for row in rows if len(row) > 1)
        return max(((count, number) for number, count in numbers.items()), default=(0, 0))
    return 0, 0


def cell(row: Sequence[str], place: int) -> str:
    """The text of a cell; it is empty behind the end of a short row."""
    return row[place].strip() if place < len(row) else ""


def points_in(text: str) -> float | None:
    """The points in a cell, perhaps with a decimal comma; None where it holds no number."""
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return None
