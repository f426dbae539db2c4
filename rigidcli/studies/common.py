"""Functions of every study: they make reports, and refuse documents whose parameters lack values.

`results.csv` has the names in JSON, titles, symbols and units of the results; the studies give the values. It
has a row for each result, in the order in which they are shown. A result is added there, and
gets its value in its study. The columns are

    commands   the commands that have it
    key        the name in JSON
    title      the title in tables for people, which leave out results without a title
    symbol     the symbol in LaTeX; for a sample in time, the symbol of each column
    unit       the SI unit
    cells      the columns of CSV; behind a colon the place in an array: `I12:01` is the entry [0, 1]
    kind       `counts` for a vector whose small entries are no rounding; `diagnostic` for results that people
               see with `-v` only
    means      the meaning, where the title does not say it

`words.csv` has the words that people see in place of a result that is a single word, yes or no, or missing.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import replace
from importlib import import_module
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidcli.commands import COMMANDS
from rigidcli.document.document import Document
from rigidcli.errors import ComputationError, DocumentError, UsageError
from rigidcli.fields.texts import STDIN
from rigidcli.report import NOISE, Field, Report, Step, Table, Value, yes_or_no

if TYPE_CHECKING:
    from rigidcli.picture import Picture


def report(
    document: Document,
    study: str,
    fields: Iterable[Field],
    notes: Iterable[str] = (),
    tables: Iterable[Table] = (),
    steps: Iterable[Step] = (),
    pictures: Iterable[Picture] = (),
) -> Report:
    """The report of a study, in which no zero has a sign.

    Raises ComputationError for a result that floats cannot hold to all their digits.
    """
    fields = tuple(fields)
    for field in () if document.arithmetic.exact else fields:
        value = field.value
        if isinstance(value, float):
            largest = abs(value)
        elif isinstance(value, np.ndarray) and value.dtype.kind == "f":
            largest = float(np.abs(value).max(initial=0.0))
        else:
            continue
        if not largest < math.inf or 0 < largest < TINY:
            message = f"the {field.title or field.key} is beyond the range of floating-point numbers"
            raise ComputationError(message)
        field.value = _unsigned(value)
    name, every = called(document.name, document.source), (*document.notes, *notes)
    shown = tuple(map(_unsigned, tables)), tuple(map(_unsigned, steps)), tuple(pictures)
    head = f"rigidcli.{study}/1", name, document.source, COMMANDS[study].title
    return Report(*head, fields, every, *shown, document=document.draft.whole)


def worked(study: str, is_asked: bool, *result: object) -> Iterable[Step]:
    """The working of a result, by `steps` in the study's module of this name; none unless it is asked."""
    if not is_asked:
        return ()
    steps: Iterable[Step] = import_module(f"rigidcli.studies.{study}.steps").steps(*result)
    return steps


def called(name: str | None, source: str) -> str:
    """The name of a document in results: `name`, or the name of the file; none for a document from Python."""
    if name or (source.startswith("<") and source != STDIN):
        return name or ""
    return "stdin" if source == STDIN else PurePath(source).stem


def _unsigned(value: Value) -> Value:
    """A float, an array of floats, or the entries of a table or a step, without a signed zero."""
    if isinstance(value, float):
        return float(value) + 0.0
    if isinstance(value, np.ndarray) and value.dtype.kind == "f":
        return np.add(value, 0.0, order="C")  # in the order in which it is written
    if isinstance(value, Table):
        columns = tuple(replace(column, values=_unsigned(column.values)) for column in value.columns)
        return replace(value, columns=columns)
    if isinstance(value, Step):
        fields = tuple(replace(entry, value=_unsigned(entry.value)) for entry in value.fields)
        return replace(value, fields=fields, tables=tuple(map(_unsigned, value.tables)))
    return value


TINY = float(np.finfo(np.float64).tiny)  # the least float with all digits
SHOWN_DIGITS = 6  # the digits that people see by default: a result with fewer trusted digits says so


def noise(trusted_digits: float | None) -> float:
    """The size of errors in samples with this many trusted digits, in units of the largest sample.

    It is ten times the last trusted digit, as variables differ in size, and at most 1e-12: what is larger may
    be a small sample and no error, and is not shown as zero.
    """
    return NOISE if trusted_digits is None else min(max(NOISE, 10 ** (1 - trusted_digits)), 1e-12)


def trusted(study: str, key: str, digits: float) -> Field:
    """The result with the number of trusted digits."""
    return field_of(study, key, digits, diagnostic=digits >= SHOWN_DIGITS)


def if_known(field: Field) -> Field:
    """The field, which people do not see where it has neither a value nor words."""
    if field.value is None and not field.words:
        field.title = ""
    return field


def require_values(document: Document, task: str) -> None:
    """Raise unless the document's numbers are floats, which `task`, such as "an orbit", needs.

    Raises DocumentError with the parameters that have no value, and UsageError where every parameter has one
    and exact numbers were asked for.
    """
    missing = document.symbols
    if document.arithmetic.exact and not missing:
        missing = tuple(name for name, value in (document.parameters or {}).items() if value is None)
    if missing:
        message = f"missing: {task} needs its value"
        raise DocumentError([document.problem(message, f"parameters.{name}") for name in missing])
    if document.arithmetic.exact:
        raise UsageError(f"{task} has no exact results", hint="leave out `--exact`")


def _rows(name: str) -> list[list[str]]:
    with Path(__file__).with_name(name).open(encoding="utf-8") as table:
        return [*csv.reader(table)][1:]


def _read() -> dict[str, dict[str, Field]]:
    results: dict[str, dict[str, Field]] = {}
    for commands, key, title, symbol, unit, cells, kind, means in _rows("results.csv"):
        places = (cell.partition(":") for cell in cells.split())
        columns = {name: tuple(map(int, place)) for name, _, place in places}
        kinds = "counts" in kind, "diagnostic" in kind
        field = Field(key, None, title, symbol, unit, columns, "", *kinds, means)
        for command in commands.split():
            results.setdefault(command, {})[key] = field
    return results


_BY_KEY = _read()
_WORDED = (str, bool, type(None))  # results that are words: a union would be made anew at each result
WORDS = {(key, value): words for key, value, words in _rows("words.csv")}
# The results of each study, still without values, by the name of its command.
RESULTS = {study: tuple(fields.values()) for study, fields in _BY_KEY.items()}


def field_of(study: str, key: str, value: Value, /, words: str = "", **changes: Any) -> Field:
    """The field of a result by results.csv, with its value, words for it, and `changes` of the field."""
    field, words = _BY_KEY[study][key], words or _in_words(key, value)
    # `replace` or a frozen class takes three times as long.
    looks = field.cells, words, field.counts, field.diagnostic, field.means
    field = Field(key, value, field.title, field.symbol, field.unit, *looks)
    for name, change in changes.items():
        setattr(field, name, change)
    return field


def _in_words(key: str, value: Value) -> str:
    if not isinstance(value, _WORDED):
        return ""
    text = "" if value is None else value if isinstance(value, str) else yes_or_no(value)
    return WORDS.get((key, text), text)


def celled(key: str, value: Value, title: str = "", symbol: str = "", **changes: Any) -> Field:
    """The field of a result whose key has a name of the document in it, which is its cell of CSV, too."""
    return Field(key, value, title, symbol, cells={key: ()}, **changes)
