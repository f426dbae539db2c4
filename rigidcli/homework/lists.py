"""Lists, tables and mappings as people type them: with brackets or without, in YAML or in one text."""

from __future__ import annotations

import re
from typing import Any

from rigidcli.errors import ExpressionError, shown
from rigidcli.homework.base import Tree, Unreadable
from rigidcli.homework.numbers import with_hint
from rigidcli.homework.vectors import from_columns, in_unit_vectors, spread, undressed
from rigidcli.language.decoration import DECIMAL, undecorated
from rigidcli.language.latex import plain as without_latex
from rigidcli.language.statements import cut, without_brackets
from rigidcli.language.typed import unnamed

_OPEN, _CLOSE = "[({", "])}"
_UNIT_TAIL = re.compile(r"(?P<entry>.*[\d)\]])\s+(?P<unit>(?![\d+*/^)\]-])\S.*)", re.DOTALL)
_NUMBER = re.compile(rf"[-+]?{DECIMAL}(?:[eE][-+]?\d+)?(?:/\d+)?")
_NAMED = re.compile(r"(?<!\w)[^\W\d]\w*+\s*[=:]")
_NEXT_NAME = re.compile(r"(?<=[\w)])\s+(?=(?:[^\W\d]|[^\W\d_]+_?\d)\s*=)")
"""What stands between `I1 = 3` and the next name with a digit, or of one letter."""
_ARRAY = re.compile(r"(?:\b(?:np|numpy|sp|sympy)\.)?\b(?:array|[Mm]atrix|[Vv]ector|vec)\s*(?=\()")
_DIAGONAL = re.compile(r"\bdiag(?:onal)?\s*[(\[{]")
_PAIR = re.compile(r"\s*(?P<name>[^\W\d][\w ]*?)\s*[=:]\s*(?P<value>[^=:]+)\Z", re.DOTALL)


def read_list(answer: Tree, *, is_square: bool = False) -> Tree:
    """A list, a table or a mapping, with or without brackets: `1, 2, 3`, `M/12 * [[1, 2], [3, 4]] kg`.

    A factor before it and a unit behind it are moved into each entry, which is a text. Where `;` separates, a
    comma between digits is a decimal comma. Raises Unreadable.
    """
    if isinstance(answer, dict):
        return answer
    if isinstance(answer, list):
        if not any(isinstance(entry, str) and ";" in entry for entry in answer):
            several = [spread(entry) if isinstance(entry, str) else [entry] for entry in answer]
            return [_entry(each) for entries in several for each in entries]
        if any(isinstance(entry, list | dict) for entry in answer):
            raise Unreadable("wrong_shape", "`;` and `,` are mixed, separate entries with `;`")
        answer = ",".join(map(str, answer))  # YAML has cut `1,5; 2,5` at its decimal commas
    if not isinstance(answer, str):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list")
    answer = undressed(undecorated(answer))
    if not is_square and (components := in_unit_vectors(answer)) is not None:
        return components
    try:
        text = from_columns(without_latex(answer))
        text = _ARRAY.sub("", re.sub(r",?\s+(?:and|und|et)\s+", ";" if ";" in answer else ",", text))
        if diagonal := _DIAGONAL.search(text):
            return _on_diagonal(read_list(text[: diagonal.start()] + text[diagonal.end() - 1 :]), is_square)
        is_mapping = len(_NAMED.findall(without_brackets(text))) > 1
        if is_mapping and not re.search(r"[,;\n]", text):
            text = _NEXT_NAME.sub("; ", text)
        factor, inner, unit = _parts(text.strip() if is_mapping else unnamed(text).strip())
        entries = _entries(inner)
    except ExpressionError as error:
        raise Unreadable(error.code or "parse_error", with_hint(error)) from None
    return _moved(entries, factor, unit) if factor or unit else _with_unit_of_last(entries)


def _on_diagonal(entries: Tree, is_square: bool) -> Tree:
    """The rows of `diag(2, 11, 11)`, or its entries where no matrix is asked for."""
    if not is_square or not isinstance(entries, list):
        return entries
    return [[e if row == column else "0" for column in range(len(entries))] for row, e in enumerate(entries)]


def _moved(entry: Tree, factor: str, unit: str) -> Tree:
    """The entries of a list with its factor and its unit, of which one may be empty."""
    if isinstance(entry, list):
        return [_moved(each, factor, unit) for each in entry]
    if isinstance(entry, dict):
        return {name: _moved(each, factor, unit) for name, each in entry.items()}
    return f"({factor})*({entry}) {unit}".rstrip() if factor else f"{entry} {unit}"


def _entry(entry: Tree) -> Tree:
    """An entry of a list in YAML, which may itself be a row typed as text: `(1, 2, 3)`."""
    if not isinstance(entry, str):
        return entry
    if re.fullmatch(r"\s*[\[(].*[,;].*[\])]\s*", entry, re.DOTALL) and not _is_call(entry):
        return read_list(entry)
    return entry if entry.strip()[:1] in tuple(_OPEN) else _row(entry)


def _is_call(text: str) -> bool:
    """Whether the first bracket of a text is closed before its end, so that the text is a product."""
    text = text.strip()
    return _closings(text)[0] != len(text) - 1


def _closings(text: str) -> dict[int, int]:
    """Where the brackets of a text are closed, by where they open. Raises ExpressionError."""
    opened, ends = list[int](), dict[int, int]()
    for place, sign in enumerate(text):
        if sign in _OPEN:
            opened.append(place)
        elif sign in _CLOSE and opened:
            ends[opened.pop()] = place
    if opened:
        raise ExpressionError(f"`{text[opened[-1]]}` is never closed")
    return ends


def _parts(text: str) -> tuple[str, str, str]:
    """What stands before, in, and behind the outer brackets of a list."""
    for start, end in sorted(_closings(text).items()):
        within = text[start + 1 : end]
        if max(len(split(within)), len(_blanks(within))) > 1 or within.lstrip()[:1] in ("[", "{"):
            factor = re.sub(r"[\s*]+\Z", "", text[:start])
            if text[start] == "(" and re.search(r"\batan2\Z", text[:start]):
                continue  # the bracket of a function, as in `atan2(1, 2), 3`
            behind = text[end + 1 :].strip()
            if divided := re.match(rf"/\s*((?:sqrt)?\s*\(?{DECIMAL}\)?)\s*(.*)", behind, re.DOTALL):
                return f"({factor or 1})/{divided[1]}", within, divided[2]
            if re.match(r"[,;+/-]|\n\s*[\[({]", text[end + 1 :].lstrip(" ")) or re.search(
                r"[,;\n+]\s*\Z", text[:start]
            ):
                break  # rows without brackets round them
            return factor, within, behind.lstrip("* ")
        if not re.search(r"[,;\n]", text):
            break
    return "", text, ""


def split(text: str) -> list[str]:
    """A text cut at the weakest sign that separates entries outside of brackets."""
    for sign in ("\n", ";", ","):
        pieces = [piece.strip().rstrip(",;" * (sign == "\n")) for piece in cut(text, re.compile(sign))]
        if not pieces[-1]:
            pieces.pop()
        if len(pieces) > 1:
            return pieces
    return [text.strip()]


def _entries(text: str) -> Any:
    """The entries of a text, of rows where its pieces are lists themselves."""
    pieces = [part for piece in split(text) if piece for part in spread(piece)]
    pairs = [_PAIR.match(piece) for piece in pieces]
    if pieces and all(pairs):
        return {pair["name"].strip(): pair["value"].strip() for pair in pairs if pair}
    if len(pieces) == 1 and pieces[0].startswith(("[[", "[(")):
        return _entries(pieces[0][1:-1])
    if len(pieces) == 1:
        pieces = _blanks(pieces[0])
    elif "," in text and not re.search(r"[;\n]", without_brackets(text)):
        return [_inner(piece) for piece in pieces]
    return [_row(piece) for piece in pieces]


def _inner(piece: str) -> Any:
    piece = piece.strip()
    bracketed = piece[:1] in tuple(_OPEN) and not _is_call(piece)
    if bracketed and (piece[0] != "(" or max(len(split(piece[1:-1])), len(_blanks(piece[1:-1]))) > 1):
        return _entries(piece[1:-1])
    return piece


def _row(piece: str) -> Any:
    """A piece between semicolons or lines: a row where it holds blanks, or commas that are not decimal."""
    inner = _inner(piece)
    if not isinstance(inner, str):
        return inner
    numbers, commas = _blanks(inner), split(inner)
    if len(numbers) > 1:
        return numbers
    is_decimal = re.fullmatch(r"[^,]*\d,\d[^,]*", inner) is not None
    return inner if len(commas) == 1 or is_decimal else [_inner(comma) for comma in commas]


def _blanks(piece: str) -> list[Any]:
    """The numbers of a row that only blanks separate; else the piece alone."""
    numbers = piece.split()
    return list(numbers) if len(numbers) > 1 and all(map(_NUMBER.fullmatch, numbers)) else [piece]


def _with_unit_of_last(entries: Tree) -> Tree:
    """A list where the unit behind the last entry is that of all, if no other has one: `1, 2, 3 kg m^2`."""
    if not isinstance(entries, list):
        return entries
    *others, last = entries or [""]
    tail = _UNIT_TAIL.fullmatch(last) if isinstance(last, str) else None
    if tail is None or not others or any(not isinstance(e, str) or _UNIT_TAIL.fullmatch(e) for e in others):
        return entries
    return _moved([*others, tail["entry"]], "", tail["unit"])
