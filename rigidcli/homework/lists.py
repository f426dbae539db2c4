"""Lists, tables, vectors and mappings as people type them, with brackets or without, in YAML or in one text.

read_list("1, 2, 3 kg")                    # ["1 kg", "2 kg", "3 kg"]
read_list("M/12 * [[1, 2], [3, 4]]")       # [["(M/12)*(1)", "(M/12)*(2)"], ...]
read_list("2 j + 12 k")                    # ["0", "2", "12"]
"""

from __future__ import annotations

import re
from contextlib import suppress
from itertools import chain
from typing import Any

from rigidcli.errors import ExpressionError, shown
from rigidcli.homework.base import Tree, Unreadable
from rigidcli.homework.numbers import advice
from rigidcli.language import tree, typed
from rigidcli.language.expression import numbers
from rigidcli.language.latex import HAT, with_hats
from rigidcli.language.text import reading
from rigidcli.language.tokens import rewritten, rules
from rigidcli.language.tree import fold
from rigidcli.language.typed import closings_of, cut, is_enclosed, without_brackets
from rigidcli.language.words import CALLED, said

# The most brackets of a text that are looked into for a list, as each look reads all that is inside.
MOST_BRACKETS = 40
_NUMBER = re.compile(rf"[-+]?{typed.DECIMAL}(?:[eE][-+]?\d+)?(?:/\d+)?")
_NAMED = re.compile(r"(?<![\w^])[^\W\d]\w*+\s*[=:]")
# What stands between `I1 = 3` and the next name with a digit, or of one letter.
_NEXT_NAME = re.compile(r"(?<=[\w)])\s+(?=(?:[^\W\d]|[^\W\d_]+_?\d|[^\W\d_]_?[xyz]{1,2})\s*[=:])")
# What stands before brackets for a list: programs write it, and `diag` and `transpose` say what is meant.
_FUNCTION = re.compile(
    r"(?:\b(?:np|numpy|sp|sympy)\.)?\b(?:(?P<diagonal>[Dd]iag(?:onal)?(?:Matrix)?)|(?P<flipped>[Tt]ranspose)"
    r"|array|[Mm]atrix|[Vv]ector|vec)\s*\Z"
)
_TRANSPOSED = r"\s*(?:\^\s*\(?\s*(?:⊤|T|top|tr?)\s*\)?|[ᵀᵗ]|\.?'|\.T)(?!\w)"


def read_list(answer: Tree, *, is_square: bool = False) -> Tree:
    """A list, a table or a mapping, with or without brackets: `1, 2, 3`, `M/12 * [[1, 2], [3, 4]] kg`.

    A factor before it and a unit behind it are moved into each entry, which is a text. Where `;` separates, a
    comma between digits is a decimal comma. Rows of a matrix, which `is_square`, may have blanks between
    formulas. Raises Unreadable.
    """
    if isinstance(answer, dict):
        return answer
    if isinstance(answer, list):
        if not all(isinstance(entry, str) for entry in answer) or ";" not in "".join(answer):
            several = [map(_row, _repeated(entry)) if isinstance(entry, str) else [entry] for entry in answer]
            return list(chain.from_iterable(several))
        answer = ",".join(answer)  # YAML has cut `1,5; 2,5` at its decimal commas
    if not isinstance(answer, str):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list")
    answer = re.sub(r"\A[^\W\d]\w*\s*=\s*\n\s*", "", typed.undecorated(answer))  # as Octave shows a matrix
    if re.fullmatch(r"(?s)(?:[^|]*=)?\s*\|+\s*[(\[{][^|]*[)\]}]\s*\|+[^|]*", answer):
        raise Unreadable("parse_error", "bars mean a length: give the components")
    try:
        text = in_brackets(answer)
        components = None if is_square or _AND.search(text) else _in_unit_vectors(text)
        return _in_text(text.replace(HAT, ""), is_square) if components is None else components
    except ExpressionError as error:
        raise Unreadable(error.code or "parse_error", advice(error)) from None


def _in_text(text: str, is_square: bool) -> Tree:
    """The entries of a text with brackets, commas and lines only. Raises ExpressionError, Unreadable."""
    text, before = _separated(text).strip(), list[str]()
    if _is_chain(text):
        text, before = typed.last_member(text)
    elif not re.search(r"[,;\n]", text):
        text = _NEXT_NAME.sub("; ", text)
    factor, within, behind = _parts(text.strip())
    function, transposed = _FUNCTION.search(factor), re.match(_TRANSPOSED, behind)
    factor = _FUNCTION.sub("", factor).rstrip(" *")
    unit = behind[transposed.end() if transposed else 0 :].strip()
    if re.match(r"\^|\*\*", unit):
        raise Unreadable("parse_error", "brackets have a power behind them: give the entries of the result")
    entries = _entries(within, is_square)
    if function and function["diagonal"] and is_square and isinstance(entries, list):
        entries = _diagonal([cell for row in entries for cell in (row if isinstance(row, list) else [row])])
    elif isinstance(entries, list) and (transposed or (function and function["flipped"])):
        entries = _transposed(entries)
    divided = typed.divisor(before[0]) if before else ""
    return _moved(_moved(entries, factor, unit), divided, "")


def _diagonal(cells: list[Tree]) -> Tree:
    places = range(len(cells))
    return [[cells[row] if row == column else "0" for column in places] for row in places]


def _transposed(rows: list[Tree]) -> Tree:
    """Columns as rows; one row or one column, and rows of several lengths, stay as they are."""
    is_table = all(isinstance(row, list) and len(row) == len(rows[0]) for row in rows)
    is_line = len(rows) == 1 or not is_table or len(rows[0]) == 1
    return rows if is_line else list(map(list, zip(*rows, strict=True)))


_ARROW, _EQUALS = re.compile("=>|->"), re.compile(r"(?<![<>=!:])==?(?![>=])")


def earlier_members(answer: Tree) -> list[str]:
    """What stands before the last member of a chain: `(1, 2)` in `v = (1, 2) = (1, 3)`, or before an arrow.

    What has another name leads to the answer, and is no member; `x = 1, y = 2` is no chain.
    """
    with suppress(ExpressionError):
        text = in_brackets(typed.undecorated(answer)) if isinstance(answer, str) else ""
        *reasons, (name, *members) = (cut(part, _EQUALS) for part in cut(text, _ARROW))
        if _is_chain("=".join([name, *members])):
            same = [each for each in reasons if len(each) == 1 or each[0].strip() == name.strip()]
            return [*[name, *members][: len(members)], *chain.from_iterable(same)]
    return []


def _is_chain(text: str) -> bool:
    """Whether one value has all the names in a text, as in `L = I ω = (1, 2)`, but not in `x = 1, y = 2`."""
    outside = without_brackets(text)
    is_list = re.search(r"=[^=]*[(\[{][^=]*[,;&\n][^=]*\Z", text) and not re.search(r"[,;\n]", outside)
    return len(_NAMED.findall(outside)) < 2 or bool(is_list)


# --- the parts of a list


def _parts(text: str) -> tuple[str, str, str]:
    """The factor before, the entries in, and the divisor or unit behind the brackets of a list."""
    text = text if _is_several(_bare(text)) else _bare(text)
    for start, end in sorted(closings_of(text).items())[:MOST_BRACKETS]:
        before, within, behind = text[:start], text[start + 1 : end], text[end + 1 :]
        is_list = _is_several(_bare(within)) or within.lstrip()[:1] in ("[", "{")
        if not is_list or (text[start] == "(" and before.endswith("atan2")):
            continue
        is_row = re.search(r"[,;\n+]\s*\Z", before) or re.match(r" *(?:[,;+-]|\n\s*[\[({])", behind)
        if is_row or (behind.lstrip()[:1] == "/" and re.search("[,;\n]", without_brackets(behind))):
            break  # rows without brackets round them
        factor = re.sub(r"\A\s*([-+])\s*\Z", r"\g<1>1", before).rstrip(" \t\n*")
        behind = behind.strip()
        within = _bare(within) if _is_several(_bare(within)) else within
        return factor, within, behind if behind.startswith("**") else behind.removeprefix("*").lstrip()
    return "", text, ""


def _bare(text: str) -> str:
    """A text without brackets around the whole of it."""
    text, depth = text.strip(), 0
    ends = closings_of(text)
    while ends.get(depth) == len(text) - 1 - depth:
        depth += 1
    return text[depth : len(text) - depth]


def _is_several(text: str) -> bool:
    return max(len(split(text)), len(_blanks(text))) > 1


def split(text: str) -> list[str]:
    """A text cut at its lines, else at semicolons, else at commas, outside of brackets.

    Where blanks stand behind commas, and each piece has a comma of its own, these are decimal commas.
    """
    for sign in ("\n", ";", r",\s", ","):
        if sign == "," and len(numbers := _blanks(text)) > 1:  # 1,5 2,5
            return numbers
        pieces = [piece.strip().rstrip(",;" * (sign == "\n")) for piece in cut(text, re.compile(sign))]
        if not pieces[-1]:
            pieces.pop()
        is_cut = sign != r",\s" or all(re.search(r"\d,\d", piece) for piece in pieces)
        if len(pieces) > 1 and is_cut:
            return pieces
    return [text.strip()]


def _entries(text: str, is_square: bool = False) -> Any:
    """The entries of a text without outer brackets; rows are lists, and pairs with names a mapping."""
    pieces = [part for piece in split(text) if piece for part in _repeated(piece)]
    pairs = [list(map(str.strip, re.split("[=:]", piece))) for piece in pieces]
    if pairs and all(len(pair) == 2 and re.fullmatch(r"[^\W\d][\w ]*", pair[0]) for pair in pairs):
        named = dict(pairs)
        for name, value in pairs:
            if value != named[name] and re.search(r"_\w+\Z|\d\Z", name):  # L_x = 0, L_x = -2: one is another
                raise Unreadable("duplicate_key", f"read {shown(name)} twice")
        return named if len(named) == len(pairs) else [value for _, value in pairs]
    if len(pieces) == 1:
        is_table = pieces[0].startswith(("[[", "[("))
        return _entries(pieces[0][1:-1]) if is_table else _blanks(pieces[0])
    rows = [_blanks(_bare(piece), len(pieces)) for piece in pieces] if is_square else []
    if rows and all(len(row) > 1 for row in rows):
        return rows
    are_rows = "," not in text or re.search(r"[;\n]", without_brackets(text))
    return list(map(_row if are_rows else _inner, pieces))


def _inner(piece: str) -> Any:
    """The entries in the brackets of a piece, or the piece: round ones may be those of a formula."""
    piece = piece.strip()
    if is_enclosed(piece) and (piece[0] != "(" or _is_several(piece[1:-1])):
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
    is_decimal = re.fullmatch(r"[^,;]*\d,\d[^,;]*", inner) is not None
    return inner if len(commas) == 1 or is_decimal else list(map(_inner, commas))


# What joins formulas of a row that only blanks separate: signs, and functions before arguments: `cos phi`.
_JOINED = re.compile(
    rf"\s*([*/^])\s*|(?<=[\w)])\s+([-+])\s+|(?<![^\W\d_])({'|'.join(sorted(CALLED))})\s+(?=[^\W\d])"
)


def _blanks(piece: str, size: int = 0) -> list[str]:
    """The numbers, or formulas if there are `size`, that only blanks separate; else the piece alone."""
    if len(numbers := piece.split()) > 1 and all(map(_NUMBER.fullmatch, numbers)):
        return numbers
    formulas = cut(_JOINED.sub(lambda sign: next(filter(None, sign.groups())), piece), re.compile(r"\s+"))
    return formulas if len(formulas) == size and not re.search("[,;]", piece) else [piece]


_SEVERAL = {
    n: re.compile(
        rf"(?i)\s*[(\[]\s*(?:{n} ?[x×]|[x×] ?{n}|(?:mult(?:iplicity|\.)?|deg\.?) {n}|{said(word)})\s*[)\]]"
        rf"|\s+(?:{said(word)}|with multiplicity {n})\s*\Z"
    )
    for n, word in enumerate(("once", "twice", "thrice"), 1)
}


def _repeated(entry: str) -> list[str]:
    """The entries that one stands for: `b = c = 11`, `11 (twice)`, and `10 ± sqrt(7)`."""
    *names, value = entry.split("=")
    if len(names) > 1 and all(name.strip(" \\").isidentifier() for name in names):
        is_pair = len(_repeated(value)) == len(names)  # `b = c = 10 ± sqrt(7)` are two
        return [each for name in names[: 1 if is_pair else None] for each in _repeated(f"{name}={value}")]
    for count, words in _SEVERAL.items():
        if words.search(entry):
            return [words.sub("", entry)] * count
    before, *behind = re.split(r"±|\+/?-", entry.rpartition("=")[2])
    is_formula = len(behind) == 1 and before.strip() and re.search(r"[√A-Za-z(]", behind[0])
    return [f"{before.strip()} {sign} {behind[0].strip()}" for sign in "-+"] if is_formula else [entry]


def _moved(entry: Tree, factor: str, unit: str) -> Tree:
    """The entries of a list with its factor and its unit, which may be empty."""
    if isinstance(entry, list):
        return [_moved(each, factor, unit) for each in entry]
    if isinstance(entry, dict):
        return {name: _moved(each, factor, unit) for name, each in entry.items()}
    entry = _times(factor, entry) if factor else entry
    is_number = _NUMBER.fullmatch(entry) and not re.match(r"1\s*/\s*\d", unit)
    if unit.startswith(("/", "1")) and not is_number:  # a divisor; behind a number it may be a unit
        return f"({entry}){'*' * (unit[0] == '1')}{unit}"
    return f"{entry} {unit}".rstrip()


# --- other signs than brackets and commas

_BRACKETS = str.maketrans(
    {"⟨": "(", "⟩": ")", "〈": "(", "〉": ")", "≤": "<", **dict.fromkeys("⎡⎢⎣⎤⎥⎦⎛⎜⎝⎞⎟⎠", " ")}
)
_MAPLE = r"(?s)(?<![\w)\]])<((?:[^<>=]|=>)*[,;|][^<>=]*)>"
# One value of two names: lambda_{2,3} = 11.
_SHARED = re.compile(
    r"(?<![A-Za-zλω])(?P<name>\\?[A-Za-zλω]+)_?\{?(?P<one>[1-9₁-₉])\s*,\s*(?P<two>[1-9₁-₉])\}?\s*="
)
_SIGNS = rules(
    (rf"([(\[{{][^()\[\]{{}};\n]*[)\]}}]){_TRANSPOSED}", r"\1"),  # a column is read as a row
    (r"\]\s*\[(?=[-\d])", "];["),
    (_MAPLE, lambda row: f"({row[1].replace('|', ';')})"),  # <1, 2, 3>, a vector or a row of a matrix
    (_MAPLE, r"(\1)"),  # the rows of a matrix
)
_AND = re.compile(rf",?\s+(?:{said('and')}|&)\s+|(?<=[\w)])\s+[ye]\s+(?=\d|√|sqrt)")


def in_brackets(text: str) -> str:
    """The plain text of a list with brackets, commas and lines only. Raises ExpressionError."""
    text = with_hats(_SHARED.sub(r"\g<name>_\g<one> = \g<name>_\g<two> = ", text))
    return _from_table(rewritten(text.translate(_BRACKETS), _SIGNS))


def _from_table(text: str) -> str:
    """A table between bars as lines: `| 8 | -3 |` is `8; -3`."""
    lines = [line.strip() for line in text.strip().splitlines()]
    if text.count("|") < 4 or not all(re.fullmatch(r"\|.*\|", line) for line in lines):
        return text
    rows = [line[1:-1].split("|") for line in lines]
    is_rule = re.compile(r"[\s:-]*-[\s:-]*").fullmatch
    rule = next((place for place, row in enumerate(rows) if all(map(is_rule, row))), -1)
    below = rows[rule + 1 :]  # what stands above a rule are heads
    if (
        rule == 1
        and len(below) + 1 in (1, len(rows[0]))
        and all(re.fullmatch(r"\s*[-+\u2212]?[\d.,/ ]+", cell) for cell in rows[0])
    ):
        below = [rows[0], *below]  # but for a vector, and the first row of a matrix
    return "\n".join("; ".join(cell.strip() for cell in row) for row in below)


def _separated(text: str) -> str:
    """The text with `;` for what else separates entries: `3 and 5`, `3 | 5`, `3 < 5`, `3 -> 5`, `3/5/7`."""
    text = re.sub(r"(?<![,;\s])\s*&", ";", text)  # rows of LaTeX outside of `\\begin{pmatrix}`
    text = _AND.sub("; " if ";" in text or _has_decimal_commas(text) else ", ", text)
    if re.search(r"[;\n]|,(?!\d)|(?<!\d),", text):
        return text
    text = re.sub(r"\||<=?|[-=]?>", ";", text)
    bare = text.rpartition("=")[2].strip("()[] ")
    for sign in (" / ", "/", ":"):
        pieces = bare.split(sign)
        is_pair = len(pieces) == 2 and sign == " / " and not re.search(r"[()\[\]]", bare)
        is_list = all(re.match(r"\s*[-+]?\s*(?:[\d.√(]|sqrt)", piece) for piece in pieces)
        if is_list and (len(pieces) > 2 or is_pair):
            return text.replace(sign, ";")
    return text


def _has_decimal_commas(text: str) -> bool:
    """Whether a word separates entries, and so commas are decimal: `10 und 17,3`, and not `2,11 and 11`.

    People who write `and` have points, but nobody separates entries by commas behind the last such word.
    """
    words = list(_AND.finditer(text))
    if not words or not re.search(r"\d,\d", text) or re.search(r",(?!\d)|(?<!\d),", text):
        return False
    return "," in text[words[-1].end() :] or words[-1][0].strip() not in ("and", "&")


# --- sums of unit vectors

AXES = {"i": 0, "j": 1, "k": 2, "x": 0, "y": 1, "z": 2, "1": 0, "2": 1, "3": 2}
_VECTORS = ("unit_x", "unit_y", "unit_z")  # their names, once they are found
# Unit vectors with hats or as `e_x`, as `i`, and as other bare letters; the first kind found counts.
_UNIT_VECTORS = (
    re.compile(
        rf"([ijkxyz])(?:{HAT}+|\^(?=\s*(?:[-+)]|\Z)))"
        rf"|(?<![A-Za-z_])(?:[eu]{HAT}*_?([xyz])|(?<!\d)[eu]{HAT}*_?([123]))(?![\w(])"
    ),
    re.compile(r"(?<![A-Za-z_])([ijk])(?![\w(])"),
    re.compile(r"(?<![A-Za-z_])(?<!\(\d)([xyz])(?![\w(])"),  # and no count, as in `11 (2x)`
)
_ONE = tree.Number("1", 1.0)
_TREES = numbers(tree.Number, tree.Power, lambda name, arguments: tree.Call(name, tuple(arguments)))


def _in_unit_vectors(text: str) -> Tree:
    """The components of a formula that is linear in unit vectors, such as `2 j + 12 k`; or None."""
    text = text.rpartition("=")[2].strip()
    found = re.sub(r"\*\*([ijkxyz])\*\*", r" \1 ", text)  # bold letters in Markdown
    for pattern in _UNIT_VECTORS:
        if "unit_" not in found:
            found = pattern.sub(_named_unit_vector, found)
    if "unit_" not in found or re.search(r"[;\n]|,(?!\d)|(?<!\d),", without_brackets(found)):
        return None
    with suppress(ExpressionError):
        for root in typed.expressions(found.replace(HAT, ""), None, leading=False):
            if _along(root, "") == tree.ZERO:
                return [_component(_along(root, axis)) for axis in _VECTORS]
    return None


def _named_unit_vector(vector: re.Match[str]) -> str:
    """The name of a unit vector, in brackets, as it is part of no argument and of no divisor before it."""
    return f" ({_VECTORS[AXES[next(filter(None, vector.groups()))]]}) "


def _along(root: tree.Node, axis: str) -> tree.Node:
    """The formula with a one for this unit vector, and zeros for the others."""

    def meant(name: str) -> tree.Node:
        return tree.Name(name) if name not in _VECTORS else _ONE if name == axis else tree.ZERO

    along: tree.Node = fold(root, meant, _TREES)
    return along


def _component(node: tree.Node) -> str:
    """A component as it is typed; a one stays where it stands before a unit."""
    return "0" if node == tree.ZERO else re.sub(r"\*1(?![\w.])", "", reading(node))


def _times(*factors: str) -> str:
    """The product of what is typed; a factor that stands alone, or beside ones, stays as it is."""
    others = [factor for factor in factors if factor not in ("", "1")] or ["1"]
    return others[0] if len(others) == 1 else "*".join(f"({factor})" for factor in others)
