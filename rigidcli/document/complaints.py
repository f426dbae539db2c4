"""Problems of a text in the words of a document, from complaints of pydantic and of the parser of YAML.

A parser complains where the text stops making sense, which may be lines after the slip. Here the lines
before that place are read as a person would read them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from decimal import Decimal
from typing import Any, NamedTuple

from pydantic import ValidationError

from rigidcli.errors import Path, ValueProblem, shown
from rigidcli.fields.section import GUESS
from rigidcli.fields.words import list_meant

_TYPES = {
    "tuple_type": "a list, such as [0, 0, 1]",
    "dict_type": "a mapping",
    "model_type": "a mapping",
    "string_type": "a text",
    "bool_type": "true or false",
    "int_type": "a whole number",
    "greater_than_equal": "at least {ge}",
    "less_than_equal": "at most {le}",
    "too_short": "at least {min_length}",
    "too_long": "at most {max_length}",
}
"""The type or bound that a complaint of pydantic expects, in the words of a document."""

_FLAT = {
    "inertia": "principal moments are written `moments: [1, 2, 3]`, a tensor by its rows",
    "points": "each point is a list, also a single one: `points: [[m, x, y, z]]`",
}
"""The cure for a list of numbers under these keys, which expect a list of lists."""

_OF_MAPPINGS = ("parts", "perturbers", "particles")
"""Keys that hold lists of mappings."""

_DECIMAL_COMMA = re.compile(r"(?<![\w.])(-?\d+), (\d*[1-9]\d*)(?![\w.])")
"""Two entries of a list, as they are read where somebody has typed the decimal `0,5`."""


def explain(error: ValidationError) -> list[ValueProblem]:
    """The problems that pydantic complains of, in the words of a document."""
    explained: dict[Path, ValueProblem] = {}
    for complaint in error.errors(include_url=False):
        path = tuple(
            key for key in complaint["loc"] if key != "[key]"
        )  # pydantic marks a complaint about the key itself
        kind, read, context = complaint["type"], complaint["input"], complaint.get("ctx", {})
        if isinstance(problem := context.get("error"), ValueProblem):
            problem.below(*path)
        elif kind == "missing" and isinstance(last := path[-1], int):
            # A list that is too short lacks each of its last entries; that is one problem.
            problem = ValueProblem(f"read {shown(read)}, expected {last + 1} entries", path=path[:-1])
        elif kind == "missing":
            problem = ValueProblem("missing", path=path)
        elif kind == "too_short" and len(read) >= context["min_length"]:
            continue  # it is long enough, and some entries have problems of their own
        elif kind == "tuple_type" and path[:-1] in explained:
            continue
        else:
            problem = _of_type(path, kind, read, context, complaint["msg"])
        explained[problem.path] = problem
    guesses = ((path, GUESS.search(problem.message)) for path, problem in explained.items())
    meant = {(*path[:-1], guess[1]) for path, guess in guesses if guess is not None}
    return [
        problem for path, problem in explained.items() if problem.message != "missing" or path not in meant
    ]


def _of_type(path: Path, kind: str, read: Any, context: Mapping[str, Any], message: str) -> ValueProblem:
    """The problem of a value of the wrong type, or beyond a bound."""
    expected = _TYPES.get(kind, str(context.get("expected", message))).format(**context).replace("'", "")
    problem = ValueProblem(f"read {shown(read)}, expected {expected}", path=path)
    if kind == "tuple_type" and path[-1] == 0:
        # A list of numbers where one of lists is expected: one problem for all its entries.
        problem.message, problem.path = f"read entry {shown(read)}, expected {expected}", path[:-1]
        problem.hint = _FLAT.get(str(path[-2]))
    elif kind == "too_long":
        surplus = len(read) - context["max_length"]
        points, mended = _DECIMAL_COMMA.subn(r"\1.\2", ", ".join(map(str, read)), count=surplus)
        if mended == surplus:
            problem.hint = f"a decimal has a point, as in `[{points}]`: a comma begins the next entry"
    elif kind == "string_type" and type(read) in (int, float, Decimal):
        problem.hint = f'write it in quotes: "{read}"'
    elif kind == "tuple_type" and isinstance(read, str) and (meant := list_meant(read)):
        problem.hint, problem.typed = f"write `{meant}`", read
    elif kind == "tuple_type" and isinstance(read, dict) and path[-1] in _OF_MAPPINGS:
        problem.message = "read a mapping, expected a list of mappings"
        problem.hint = f"write `{path[-1]}: [{{...}}, {{...}}]`, where `name` may stand in each of the braces"
    elif kind == "dict_type" and path == ("parameters",):
        names = ", ".join(f"{name}: null" for name in re.findall(r"[^\W\d]\w*", str(read)))
        if isinstance(read, list) and all(isinstance(entry, dict) for entry in read):
            names = ", ".join(f"{name}: {value}" for entry in read for name, value in entry.items())
        problem.hint = f"write `parameters: {{{names}}}`, with values where there are some"
    return problem


class Slip(NamedTuple):
    """A slip: the line and column (from 1) where it stands, a message, and a hint."""

    line: int
    column: int
    message: str
    hint: str | None = None


_KEY = r" *(?:- +)*(?P<key>[A-Za-z_]\w*)"
_RULES = {
    r"\s*(?P<at>//|/\*)": ("this begins no comment", "comments begin with `#`"),
    r"\s*(?P<at><)(?:\?xml|robot|sdf|mujoco)\b": (
        "this is XML",
        "a robot is a file whose name ends in .urdf, .sdf or .xml",
    ),
    r"[ \t]*?(?P<at>\t)": ("a tab", "YAML indents with blanks, not tabs"),
    rf"{_KEY}:(?P<at>)(?P<value>[^\s:/,][^:]*?)\s*$": (
        "there is no blank after the colon",
        "write `{key}: {value}`",
    ),
    rf"{_KEY}(?P<at>) *= *(?P<value>\S.*?)\s*$": (
        "there is no colon after the key",
        "write `{key}: {value}`",
    ),
    rf"{_KEY}(?P<at>)(?: *[= ] *(?P<value>\S.*?))?\s*$": (
        "there is no colon after the key",
        "write `{key}: {value}`",
    ),
    rf"{_KEY}: (?P<value>[A-Za-z_]\w*(?P<at>:) [^,{{}}]+, *[A-Za-z_]\w*: .*?) *$": (
        "a second colon in one line",
        "several keys in one line stand in braces: `{key}: {{{value}}}`",
    ),
    r" *(?:- +)*(?P<value>[A-Za-z_]\w*: [^,{}]+, *[A-Za-z_]\w*(?P<at>:) .*?) *$": (
        "a second colon in one line",
        "several keys in one line stand in braces: `{{{value}}}`",
    ),
    rf"{_KEY}: [^{{\[\"']*?(?P<at>:)(?= |$)": (
        "a second colon in one line",
        "a text with a colon and a blank in it stands in quotes",
    ),
}
"""Patterns of lines with a slip, whose group `at` is its place; each with a message and a hint."""

_COMMENT, _XML, _TAB, _NO_BLANK, _EQUALS, _NO_COLON, *_COLONS = _RULES

_QUOTED = re.compile(r"\"(?:[^\"\\]|\\.)*\"|'[^']*'|(?<!\S)#.*")
"""Quoted texts and comments, in which brackets mean nothing."""

_PAIRS = {"{": "}", "[": "]"}
"""Opening brackets, each with the bracket that closes it."""


def find_slip(text: str, error: Any) -> Slip | None:
    """The slip behind an error of PyYAML; None for an error without a place."""
    mark = error.problem_mark or error.context_mark
    if mark is None:
        return None
    lines = text.splitlines() or [""]
    noticed, context, problem = min(mark.line, len(lines) - 1), str(error.context), str(error.problem)
    here, sign = Slip(noticed + 1, mark.column + 1, problem), lines[noticed][mark.column : mark.column + 1]
    if slip := _by_rules(lines, range(noticed + 1), _COMMENT, _XML):
        return slip
    if "quoted" in context and "escape" in problem:
        hint = "in single quotes a backslash is only a backslash"
        return here._replace(message="this backslash begins no escape", hint=hint)
    if "quoted" in context and (begin := error.context_mark) is not None:
        return Slip(begin.line + 1, begin.column + 1, "this quote is not closed", "close it on its own line")
    if "flow" in context:
        return _in_brackets(lines, noticed, mark.column)
    if "cannot start any token" in problem and sign != "\t":
        hint = f"a text that begins with `{sign}` stands in quotes"
        return here._replace(message="this sign begins no value", hint=hint)
    plain = _QUOTED.sub(lambda match: " " * len(match[0]), lines[noticed])
    for opening, closing in _PAIRS.items():
        if plain.count(closing) > plain.count(opening):
            column = plain.rindex(closing) + 1
            return here._replace(
                column=column, message=f"this `{closing}` closes no bracket", hint="leave it out"
            )
    before = lines[noticed][: mark.column]
    if re.fullmatch(r"\s*\w*", before) and ("block" in context or "mapping values" in problem):
        hint = "the entries of a mapping, or of a list, begin in the same column"
        column = len(before) - len(before.lstrip()) + 1
        here = Slip(noticed + 1, column, "the indentation fits no line above", hint)
    written = [n for n in range(noticed) if lines[n].strip() and not lines[n].lstrip().startswith("#")]
    return (
        _by_rules(lines, {noticed, max(noticed - 1, 0)}, _TAB)
        or _by_rules(lines, written[:-3:-1], _NO_BLANK, _NO_COLON)
        or _by_rules(lines, [noticed], _NO_BLANK, _EQUALS, *_COLONS)
        or here
    )


def _by_rules(lines: list[str], numbers: Iterable[int], *patterns: str) -> Slip | None:
    """The slip in the first of these lines that one of the patterns matches."""
    for number in numbers:
        for pattern in patterns:
            if match := re.match(pattern, lines[number]):
                message, hint = _RULES[pattern]
                hint = re.sub(" `$", "`", hint.format(**match.groupdict(default="")))
                return Slip(number + 1, match.start("at") + 1, message, hint)
    return None


def _in_brackets(lines: list[str], line: int, column: int) -> Slip:
    """The slip within brackets: a bracket that is not closed, or a missing comma."""
    opened: list[tuple[int, int, str]] = []
    plain = (_QUOTED.sub(lambda match: " " * len(match[0]), text) for text in lines)
    for number, place, sign in (
        (n, place, sign) for n, text in enumerate(plain) for place, sign in enumerate(text)
    ):
        if sign in _PAIRS:
            opened.append((number, place, sign))
        elif opened and sign in _PAIRS.values():
            if _PAIRS[opened[-1][2]] != sign:
                break
            opened.pop()
    if opened:
        number, place, sign = opened[-1]
        hint = f"close the bracket by `{_PAIRS[sign]}`"
        return Slip(number + 1, place + 1, f"this `{sign}` is not closed", hint)
    before = re.search(r"[\w.]*\W*$", lines[line][:column])
    start = column if before is None or lines[line][column : column + 1] != ":" else before.start()
    hint = "entries are separated by commas, as in `{a: 1, b: 2}`"
    return Slip(line + 1, start + 1, "expected a comma, or the end of this list or mapping", hint)
