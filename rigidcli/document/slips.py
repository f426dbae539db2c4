"""Where a text that is no YAML goes wrong: the line of the slip itself, and its cure.

A parser notices a slip where the text makes no sense any more, which may be lines later. Here the lines
before that are looked at as a person would: for tabs, missing colons and blanks, brackets and indentation.
"""

from __future__ import annotations

import re
from typing import Any, NamedTuple


class Slip(NamedTuple):
    """A slip: its place (line and column from 1), what is wrong there, and what to do about it."""

    line: int
    column: int
    message: str
    hint: str | None = None


_COMMENT = re.compile(r"(\s*)(//|/\*)")
_TAB = re.compile(r"[ \t]*?\t")
_NO_BLANK = re.compile(r"( *(?:- +)*)([A-Za-z_]\w*):([^\s:/,{\[][^:]*)$")
_NO_COLON = re.compile(r"( *(?:- +)*)([A-Za-z_]\w*)( *[= ] *(\S.*))?$")
_KEY = re.compile(r" *(?:- +)*[^\s:{\[\"'#-][^:{\[\"'#]*:(?= |$)")
"""Lines: with a comment of another language; indented by a tab; with a key and no blank after its colon;
without a colon; with key and colon."""

_NO_BRACES = re.compile(r" *(?:- +)*([A-Za-z_]\w*: [^,{}]+(?:, *[A-Za-z_]\w*: .*?)+) *$")
"""A line with several keys and their values, and commas between them."""

_QUOTED = re.compile(r"\"(?:[^\"\\]|\\.)*\"|'[^']*'|(?<!\S)#.*")
"""What has no brackets that count: quoted texts and comments."""

_PAIRS = {"{": "}", "[": "]"}
"""Brackets, and what closes them."""


def find_slip(text: str, error: Any) -> Slip | None:
    """The slip behind what a parser (an error of PyYAML with marks) complains of; None without a place."""
    mark = error.problem_mark or error.context_mark
    if mark is None:
        return None
    if text.lstrip().startswith("<"):
        return Slip(1, 1, "this is XML", "a robot is a file whose name ends in .urdf, .sdf or .xml")
    lines = text.splitlines() or [""]
    noticed = min(mark.line, len(lines) - 1)
    for line, typed in enumerate(lines[: noticed + 1]):
        if comment := _COMMENT.match(typed):
            return Slip(line + 1, comment.end(1) + 1, "this begins no comment", "comments begin with `#`")
    if "quoted" in str(error.context) and error.context_mark is not None:
        if "escape" in str(error.problem):
            hint = "in single quotes a backslash is only a backslash"
            return Slip(noticed + 1, mark.column + 1, "this backslash begins no escape", hint)
        begin = error.context_mark
        return Slip(begin.line + 1, begin.column + 1, "this quote is not closed", "close it on its own line")
    if "flow" in str(error.context):
        return _in_brackets(lines, noticed, mark.column)
    for line in range(noticed, max(noticed - 2, -1), -1):
        if tab := _TAB.match(lines[line]):
            return Slip(line + 1, tab.end(), "a tab", "YAML indents with blanks, not tabs")
    if "cannot start any token" in str(error.problem):
        hint = f"a text that begins with `{lines[noticed][mark.column : mark.column + 1]}` stands in quotes"
        return Slip(noticed + 1, mark.column + 1, "this sign begins no value", hint)
    slip = _on_a_line(lines, noticed, mark.column)
    return slip or Slip(noticed + 1, mark.column + 1, str(error.problem))


def _in_brackets(lines: list[str], line: int, column: int) -> Slip:
    """The slip within brackets: one that is not closed, or a comma that is missing."""
    unclosed = _unclosed(lines)
    if unclosed is not None:
        number, place = unclosed
        sign = lines[number][place]
        hint = f"close the bracket by `{_PAIRS[sign]}`"
        return Slip(number + 1, place + 1, f"this `{sign}` is not closed", hint)
    before = re.search(r"[\w.]*\W*$", lines[line][:column])
    start = column if before is None or lines[line][column : column + 1] != ":" else before.start()
    hint = "entries are separated by commas, as in `{a: 1, b: 2}`"
    return Slip(line + 1, start + 1, "expected a comma, or the end of this list or mapping", hint)


def _unclosed(lines: list[str]) -> tuple[int, int] | None:
    """Line and column of a bracket that another closing bracket meets, or none at all; None without one."""
    opened: list[tuple[int, int]] = []
    for number, text in enumerate(lines):
        for place, sign in enumerate(_QUOTED.sub(lambda found: " " * len(found[0]), text)):
            if sign in _PAIRS:
                opened.append((number, place))
            elif sign in _PAIRS.values() and opened:
                line, column = opened[-1]
                if _PAIRS[lines[line][column]] != sign:
                    return opened[-1]
                opened.pop()
    return opened[-1] if opened else None


def _on_a_line(lines: list[str], noticed: int, column: int) -> Slip | None:
    """The slip in the line where it is noticed, or in those on which that hangs."""
    written = [bool(line.strip()) and not line.lstrip().startswith("#") for line in lines[:noticed]]
    before = [line for line in range(noticed) if written[line]]
    for line in [*before[:-3:-1], noticed]:
        if typed := _NO_BLANK.match(lines[line]):
            start, key, value = typed.groups()
            hint = f"write `{key}: {value.strip()}`"
            return Slip(line + 1, len(start) + len(key) + 2, "there is no blank after the colon", hint)
        if line != noticed and (typed := _NO_COLON.match(lines[line])):
            start, key, _, value = typed.groups()
            hint = f"write `{key}: {value.strip()}`" if value else f"write `{key}:`"
            return Slip(line + 1, len(start) + len(key) + 1, "there is no colon after the key", hint)
    here, first = _indent(lines[noticed]), _KEY.match(lines[noticed])
    if first is not None and first.end() <= column and lines[noticed][column : column + 1] == ":":
        hint = "a text with a colon and a blank in it stands in quotes"
        if typed := _NO_BRACES.match(lines[noticed]):
            hint = f"several keys in one line stand in braces: `{{{typed[1]}}}`"
        return Slip(noticed + 1, column + 1, "a second colon in one line", hint)
    levels = _levels([lines[line] for line in before])
    if levels and here not in levels:
        told = " or ".join(filter(None, [", ".join(map(str, levels[:-1])), str(levels[-1])]))
        hint = f"the lines above begin after {told} blanks, this one after {here}"
        return Slip(noticed + 1, here + 1, "the indentation fits no line above", hint)
    return None


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def _levels(lines: list[str]) -> list[int]:
    """The indentations at which a line may go on: those of the lines above that are not ended."""
    levels: list[int] = []
    for line in lines:
        here = _indent(line)
        levels = [level for level in levels if level < here or (level == here and line[here] == "-")]
        dashes = re.match(r" *(?:- +)+", line)
        levels += [here if dashes is None else dashes.end()]
    return levels
