"""Lists, tables, vectors and mappings as people type them, with brackets or without, in YAML or in one text.

read_list("1, 2, 3 kg")                    # ["1 kg", "2 kg", "3 kg"]
read_list("M/12 * [[1, 2], [3, 4]]")       # [["(M/12)*(1)", "(M/12)*(2)"], ...]
read_list("2 j + 12 k")                    # ["0", "2", "12"]
"""

from __future__ import annotations

import re
from itertools import chain
from typing import Any

from rigidcli.errors import ExpressionError, shown
from rigidcli.homework.base import Tree, Unreadable
from rigidcli.homework.numbers import advice
from rigidcli.language import typed
from rigidcli.language.latex import HAT, with_hats
from rigidcli.language.tokens import rewritten, rules
from rigidcli.language.typed import closings_of, cut, is_enclosed, without_brackets
from rigidcli.language.words import CALLED, said

# The most brackets of a text that are looked into for a list, as each look reads all that is inside.
MOST_BRACKETS = 40
_NUMBER = re.compile(rf"[-+]?{typed.DECIMAL}(?:[eE][-+]?\d+)?(?:/\d+)?")
_NAMED = re.compile(r"(?<!\w)[^\W\d]\w*+\s*[=:]")
# What stands between `I1 = 3` and the next name with a digit, or of one letter.
_NEXT_NAME = re.compile(r"(?<=[\w)])\s+(?=(?:[^\W\d]|[^\W\d_]+_?\d)\s*[=:])")
_ARRAY = re.compile(
    r"(?:\b(?:np|numpy|sp|sympy)\.)?\b(?:array|[Mm]atrix|[Vv]ector|vec|[Tt]ranspose)\s*(?=[(\[])"
)
_DIAGONAL = re.compile(r"(?:\b(?:np|numpy|sp|sympy)\.)?\b(?:diag(?:onal)?|Diag(?:onal)?Matrix)\s*(?=[(\[{])")


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
    answer = typed.undecorated(answer)
    if re.fullmatch(r"(?s)(?:[^|]*=)?\s*\|+\s*[(\[{][^|]*[)\]}]\s*\|+[^|]*", answer):
        raise Unreadable("parse_error", "bars mean a length: give the components")
    try:
        answer = in_brackets(answer)
        if not is_square and (components := _in_unit_vectors(answer)) is not None:
            return components
        text = _separated(_ARRAY.sub("", answer.replace(HAT, "")))
        if _DIAGONAL.search(text):
            entries = read_list(_DIAGONAL.sub("", text, count=1))
            if not is_square or not isinstance(entries, list):
                return entries
            flat = list(chain.from_iterable(e if isinstance(e, list) else [e] for e in entries))
            return [
                [e if row == column else "0" for column in range(len(flat))] for row, e in enumerate(flat)
            ]
        is_mapping = len(_NAMED.findall(without_brackets(text))) > 1
        if is_mapping and not re.search(r"[,;\n]", text):
            text = _NEXT_NAME.sub("; ", text)
        factor, inner, unit = _parts(text.strip() if is_mapping else typed.last_member(text)[0].strip())
        entries = _entries(inner, is_square)
    except ExpressionError as error:
        raise Unreadable(error.code or "parse_error", advice(error)) from None
    return _moved(entries, factor, unit) if factor or unit else _with_unit_of_last(entries)


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
        return factor, within, behind.strip().removeprefix("*").lstrip()
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
    """A text cut at its lines, else at semicolons, else at commas, outside of brackets."""
    for sign in ("\n", ";", ","):
        pieces = [piece.strip().rstrip(",;" * (sign == "\n")) for piece in cut(text, re.compile(sign))]
        if not pieces[-1]:
            pieces.pop()
        if len(pieces) > 1:
            return pieces
    return [text.strip()]


_PAIR = re.compile(r"\s*(?P<name>[^\W\d][\w ]*?)\s*[=:]\s*(?P<value>[^=:]+)\Z", re.DOTALL)


def _entries(text: str, is_square: bool = False) -> Any:
    """The entries of a text without outer brackets; rows are lists, and pairs with names a mapping."""
    pieces = [part for piece in split(text) if piece for part in _repeated(piece)]
    pairs = [pair for piece in pieces if (pair := _PAIR.match(piece))]
    if pieces and len(pairs) == len(pieces):
        named = {pair["name"].strip(): pair["value"].strip() for pair in pairs}
        return named if len(named) == len(pairs) else [pair["value"].strip() for pair in pairs]
    if len(pieces) == 1 and pieces[0].startswith(("[[", "[(")):
        return _entries(pieces[0][1:-1])
    if len(pieces) == 1:
        pieces = _blanks(pieces[0])
    elif is_square and all(len(_blanks(piece)) > 1 for piece in pieces):
        return list(map(_blanks, pieces))
    elif "," in text and not re.search(r"[;\n]", without_brackets(text)):
        return [_inner(piece) for piece in pieces]
    elif is_square and not re.search("[,;]", "".join(pieces)):
        bare = (row.strip(" []()") for row in pieces)
        joined = (_JOINED.sub(lambda sign: next(filter(None, sign.groups())), row) for row in bare)
        rows = [cut(row, re.compile(r"\s+")) for row in joined]
        if all(len(row) == len(rows) for row in rows):
            return rows
    return [_row(piece) for piece in pieces]


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
    return inner if len(commas) == 1 or is_decimal else [_inner(comma) for comma in commas]


def _blanks(piece: str) -> list[str]:
    """The numbers of a row that only blanks separate; else the piece alone."""
    numbers = piece.split()
    return numbers if len(numbers) > 1 and all(map(_NUMBER.fullmatch, numbers)) else [piece]


# What joins formulas of a row that only blanks separate: signs, and functions before arguments: `cos phi`.
_JOINED = re.compile(
    rf"\s*([*/^])\s*|(?<=[\w)])\s+([-+])\s+|(?<![^\W\d_])({'|'.join(sorted(CALLED))})\s+(?=[^\W\d])"
)


_SEVERAL = {
    n: re.compile(
        rf"(?i)\s*[(\[]\s*(?:{n} ?[x×]|[x×] ?{n}|(?:mult(?:iplicity|\.)?|deg\.?) {n}|{said(word)})\s*[)\]]"
        rf"|\s+(?:{said(word)}|with multiplicity {n})\s*\Z"
    )
    for n, word in enumerate(("once", "twice", "thrice"), 1)
}
_BOTH_SIGNS = re.compile(
    r"(?:[^=±]*=)?\s*(?P<a>[^=±]+?)\s*(?:±|\+/?-)\s*(?P<b>.*(?:sqrt|√|[A-Za-z(]).*)", re.DOTALL
)


def _repeated(entry: str) -> list[str]:
    """The entries that one stands for: `b = c = 11`, `11 (twice)`, and `10 ± sqrt(7)`."""
    *names, value = entry.split("=")
    if len(names) > 1 and all(name.strip(" \\").isidentifier() for name in names):
        is_pair = len(_repeated(value)) == len(names)  # `b = c = 10 ± sqrt(7)` are two
        return [each for name in names[: 1 if is_pair else None] for each in _repeated(f"{name}={value}")]
    for count, words in _SEVERAL.items():
        if words.search(entry):
            return [words.sub("", entry)] * count
    both = _BOTH_SIGNS.fullmatch(entry)
    return [f"{both['a']} {sign} {both['b']}" for sign in "-+"] if both else [entry]


def _moved(entry: Tree, factor: str, unit: str) -> Tree:
    """The entries of a list with its factor and its unit, which may be empty."""
    if isinstance(entry, list):
        return [_moved(each, factor, unit) for each in entry]
    if isinstance(entry, dict):
        return {name: _moved(each, factor, unit) for name, each in entry.items()}
    entry = f"({factor})*({entry})" if factor else entry
    is_number = _NUMBER.fullmatch(entry) and not re.match(r"1\s*/\s*\d", unit)
    if unit.startswith(("/", "1")) and not is_number:  # a divisor; behind a number it may be a unit
        return f"({entry}){'*' * (unit[0] == '1')}{unit}"
    return f"{entry} {unit}".rstrip()


# An entry with a unit behind it, which is no further factor such as `sqrt(k/m)`.
_UNIT_TAIL = re.compile(
    rf"(?s)(?P<entry>.*[\d)\]])\s++(?P<unit>(?![\d+*/^)\]-]|(?i:{'|'.join(sorted(CALLED))})\b)"
    r"[^()]*(?:\([^()]*\)[^()]*)*)"
)


def _with_unit_of_last(entries: Tree) -> Tree:
    """A list where the unit behind the last entry is that of all, if no other has one: `1, 2, 3 kg m^2`."""
    if not isinstance(entries, list) or not all(isinstance(each, str) for each in entries):
        return entries
    *others, last = entries or [""]
    # Names are units of their own, or those of formulas: of `m a^2, 2 m a^2` the last has no unit.
    names = {*re.findall(r"[^\W\d_]+|[°%]", " ".join(others))} - {"pi", "π", "e", "E"}
    tail = _UNIT_TAIL.fullmatch(last) if others and names <= CALLED else None
    return entries if tail is None else _moved([*others, tail["entry"]], "", tail["unit"])


# --- other signs than brackets and commas

_BRACKETS = str.maketrans(
    {"⟨": "(", "⟩": ")", "〈": "(", "〉": ")", "≤": "<", **dict.fromkeys("⎡⎢⎣⎤⎥⎦⎛⎜⎝⎞⎟⎠", " ")}
)
_TRANSPOSED = r"(?<=[)\]}])\s*(?:\^\s*\(?\s*(?:⊤|T|top|tr?)\s*\)?|[ᵀᵗ]|'|\.T)(?!\w)"
_MAPLE = r"(?s)(?<![\w)\]])<((?:[^<>=]|=>)*[,;|][^<>=]*)>"
# One value of two names: lambda_{2,3} = 11.
_SHARED = re.compile(r"(?P<name>\\?[A-Za-zλω]+)_?\{?(?P<one>[1-9₁-₉])\s*,\s*(?P<two>[1-9₁-₉])\}?\s*=")
_SIGNS = rules(
    (_TRANSPOSED, ""),
    (r"\]\s*\[(?=[-\d])", "];["),
    (_MAPLE, lambda row: f"({row[1].replace('|', ';')})"),  # <1, 2, 3>, a vector or a row of a matrix
    (_MAPLE, r"(\1)"),  # the rows of a matrix
)
_AND = re.compile(rf",?\s+(?:{said('and')}|&)\s+|(?<=[\d)])\s+[ye]\s+(?=[-+]?(?:\d|√|sqrt))")


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
    text = _AND.sub(";" if ";" in text else ",", text)
    if re.search(r"[;\n]|,(?!\d)|(?<!\d),", text):
        return text
    text = re.sub(r"\||<=?|[-=]?>", ";", text)
    pieces = text.rpartition("=")[2].strip("()[] ").split("/")
    is_list = len(pieces) > 2 and all(re.match(r"\s*[-+]?\s*(?:[\d.√(]|sqrt)", piece) for piece in pieces)
    return text.replace("/", ";") if is_list else text


# --- sums of unit vectors

AXES = {"i": 0, "j": 1, "k": 2, "x": 0, "y": 1, "z": 2, "1": 0, "2": 1, "3": 2}
_E = "\ue000"  # the sign that stands before the axis of a unit vector, once it is found
# Unit vectors with hats, as `e_x` and `i`, and as bare letters; the first kind found counts.
_UNIT_VECTORS = (
    re.compile(rf"([ijkxyz]){HAT}+|e{HAT}+_?([xyz123])(?!\w)"),
    re.compile(r"(?<![A-Za-z_])(?:[eu]_?([xyz])|(?<!\d)[eu]_?([123])|([ijk]))(?![\w(\ue000])"),
    re.compile(r"(?<![A-Za-z_])(?<!\(\d)([xyz])(?![\w(])"),  # and no count, as in `11 (2x)`
)
_TERM = re.compile(r"\s*(?P<before>[^\ue000]*?)[\s*·]*\ue000(?P<axis>[012])\s*(?P<behind>[^\ue000]*?)\s*")
_NEXT_TERM = re.compile(r"(?<=[\w)\]])\s*(?=[-+])|(?<=[\ue000][012])\s*(?=[-+])")


def _in_unit_vectors(text: str) -> Tree:
    """The components of a sum such as `2 j + 12 k` or `2 \\hat{y}`, with a unit behind it; or None."""
    text = text.rpartition("=")[2].strip()
    found = re.sub(r"\*\*([ijkxyz])\*\*", r" \1 ", text)  # bold letters in Markdown
    for pattern in _UNIT_VECTORS:
        if _E not in found:
            found = pattern.sub(lambda vector: f" {_E}{AXES[next(filter(None, vector.groups()))]} ", found)
    if _E not in found or re.search(r"[,;\n]", without_brackets(found)):
        return None
    found = _bare(found.replace(HAT, ""))
    factor, unit, ends = "", "", closings_of(found)
    for start, end in sorted(ends.items())[:MOST_BRACKETS]:
        is_sum = re.search(r"\S\s*[-+]", without_brackets(found[:start]))
        if found.count(_E, start, end) == found.count(_E) and not is_sum:
            factor, unit = found[:start].strip(" *·"), found[end + 1 :].strip(" *·")
            found = found[start + 1 : end]
            break
    components = ["", "", ""]
    terms = [term for term in cut(found, _NEXT_TERM) if term.strip()]
    for place, term in enumerate(terms):
        parts = _TERM.fullmatch(term)
        if parts is None:
            return None
        before, behind, axis = parts["before"].strip(), parts["behind"].strip(), int(parts["axis"])
        is_divided = behind.startswith("/")
        if behind and place == len(terms) - 1 and before and not is_divided:
            unit, behind = unit or behind, ""
        value = before if before not in ("", "+", "-") else f"{before}1"
        value = f"{value}*({'1' * is_divided}{behind.lstrip('*· ')})" if behind else value
        components[axis] += f" + ({value})" if components[axis] else value.lstrip("+ ")
    if unit.startswith("*"):
        return None
    return [_moved(component, factor, unit) if component else "0" for component in components]
