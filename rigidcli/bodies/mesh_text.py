"""Numbers in lines of text, read all at once; a message names the line of what is no number."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple, NoReturn, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, shown

NUMERAL = re.compile(rb"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
"""A number as meshes of text have it."""

_NUMERALS = b"0123456789+-.eE \t\r\n\v\f"
"""What numbers and the blanks between them consist of."""

MOST_LINES = 1_500_000
"""The most lines of a text: those of half a million triangles, with normals and places in pictures."""

MOST_NUMBERS = 4_000_000
"""The most numbers of one kind in a file, such as those of all vertices: to read them takes a second."""

SMALLER = "simplify the mesh, or save it as binary STL"
"""What to do about a file that would take too long to be read."""

Numbers: TypeAlias = NDArray[np.intp]

Characters: TypeAlias = NDArray[np.uint8]


class Rows(NamedTuple):
    """The numbers of lines of text: all `values`, and where those of each line begin, and how many it has."""

    values: Floats
    starts: Numbers
    lengths: Numbers


def split(data: bytes, path: Path) -> list[bytes]:
    """The lines of a text. Raises ValueProblem where there are too many."""
    require_few(data.count(b"\n"), MOST_LINES, "lines", path)
    return data.split(b"\n")


def require_few(count: int, most: int, what: str, path: Path) -> None:
    """Raise ValueProblem where there is more in a file than can be read in a few seconds."""
    if count > most:
        raise ValueProblem(f"{path}: {count:,} {what}, expected at most {most:,}", hint=SMALLER)


def read_rows(lines: Sequence[bytes], numbers: Sequence[int], path: Path) -> Rows:
    """The numbers that lines of text, of these numbers in the file, consist of. Raises ValueProblem."""
    text = b"\n".join(lines)
    begins, _ = words_of(np.frombuffer(text, dtype=np.uint8))
    require_few(len(begins), MOST_NUMBERS, "numbers", path)
    values = parsed(text, len(begins))
    if values is None:
        _refuse_word(lines, numbers, path)
    newlines = np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == ord("\n"))
    lengths = np.bincount(np.searchsorted(newlines, begins), minlength=len(lines))
    return Rows(values, np.cumsum(lengths) - lengths, lengths)


def words_of(text: Characters) -> tuple[Numbers, Numbers]:
    """Where the words of a text begin, and where they end."""
    # A blank before and after the text, so that every word has both.
    is_blank = np.ones(len(text) + 2, dtype=np.bool_)
    is_blank[1:-1] = (text == ord(" ")) | ((ord("\t") <= text) & (text <= ord("\r")))
    changes = np.flatnonzero(is_blank[1:] != is_blank[:-1])
    return changes[::2], changes[1::2]


def parsed(text: bytes, count: int) -> Floats | None:
    """The numbers that a text of `count` words consists of; None where a word is no number."""
    if text.translate(None, _NUMERALS):
        return None
    with warnings.catch_warnings(), suppress(ValueError, DeprecationWarning):
        warnings.simplefilter("error", DeprecationWarning)  # of older versions of numpy, which end there
        values = np.fromstring(text, sep=" ") if count else np.empty(0)
        return values if len(values) == count else None
    return None


def _refuse_word(lines: Sequence[bytes], numbers: Sequence[int], path: Path) -> NoReturn:
    for line, number in zip(lines, numbers, strict=True):
        for word in line.split():
            if NUMERAL.fullmatch(word) is None:
                read = shown(word.decode("utf-8", "replace"))
                raise ValueProblem(f"{path}:{number}: read {read}, expected a number")
    raise ValueProblem(f"{path}: a number that cannot be read")


def columns_at(rows: Rows, places: Sequence[int], numbers: Sequence[int], what: str, path: Path) -> Floats:
    """The numbers at some places of each line (n, k). Raises ValueProblem where a line is too short."""
    needed = max(places) + 1
    short = np.flatnonzero(rows.lengths < needed)
    if short.size:
        read = rows.lengths[short[0]]
        raise ValueProblem(
            f"{path}:{numbers[short[0]]}: read {read} numbers, expected the {needed} of {what}"
        )
    columns: Floats = rows.values[rows.starts[:, None] + np.array(places)]
    return columns


def lists_at(rows: Rows, place: int, numbers: Sequence[int], path: Path) -> tuple[Numbers, Numbers]:
    """Lists that begin at a place of each line with their length: the lengths, and all entries."""
    lengths = whole(columns_at(rows, [place], numbers, "a face", path)[:, 0], path)
    wrong = np.flatnonzero((lengths < 0) | (lengths >= rows.lengths - place))
    if wrong.size:
        read, told = rows.lengths[wrong[0]] - place - 1, lengths[wrong[0]]
        raise ValueProblem(f"{path}:{numbers[wrong[0]]}: read {read} vertices of a face, expected {told}")
    first = rows.starts + place + 1 - np.cumsum(lengths) + lengths
    return lengths, whole(rows.values[np.repeat(first, lengths) + np.arange(lengths.sum())], path)


def whole(values: Floats, path: Path) -> Numbers:
    """Numbers of vertices, which are whole and not beyond all bounds. Raises ValueProblem."""
    wrong = ~((values == np.rint(values)) & (np.abs(values) < 2**53))
    if wrong.any():
        raise ValueProblem(f"{path}: read {values[wrong][0]:.17g}, expected the number of a vertex")
    return values.astype(np.intp)
