"""YAML and JSON as trees, by the core schema of YAML 1.2 and nothing beyond it.

The events of PyYAML's parser are put together here, without its composer and constructor: these recurse in C
until the stack is gone, follow merge keys and aliases without bound, and read YAML 1.1, in which `1:30` is
ninety and `no` is false.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import Any

import yaml

from rigidcli.errors import DocumentError, Excerpt, Path, Problem, shown
from rigidcli.fields.texts import require_bounded
from rigidcli.language.numerals import NUMERAL

# The deepest nesting of lists and mappings: documents have ten levels, and Python's stack has a thousand.
DEEPEST_NESTING = 50

_TOO_DEEP = f"nested more than {DEEPEST_NESTING} deep"

# The most digits of a whole number: more than any float has, fewer than are slow to read.
MAX_INTEGER_DIGITS = 400
# Keys whose values are texts, however they look: the problem 10.10 is not 10.1.
TITLES = frozenset(["name", "description", "assignment"])
# The parser in C is ten times faster, and not installed everywhere; both give the same events.
_LOADER: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)

_NULL = dict.fromkeys(["", "~", "null", "Null", "NULL"])
_TRUTHS = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
_NUMBER = re.compile(
    r"(?P<whole>[-+]?[0-9]+)"
    rf"|(?P<decimal>{NUMERAL})"
    r"|(?P<based>0o[0-7]+|0x[0-9a-fA-F]+)"
    r"|(?P<endless>[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))"
)
"""Plain scalars that are numbers, by the core schema of YAML 1.2; any other is a text."""

# Blanks at the beginning of a line, those of web pages and word processors among them.
_INDENTATION = re.compile("^[ \u00a0\u2002\u2003\u2007\u202f\u3000]+", re.MULTILINE)
_MARKUP = re.compile(r"\s*<[!?A-Za-z]")  # the beginning of XML or HTML

# What begins a comment in other languages, within a value.
_COMMENT = re.compile(r"\s(?://|/\*|%(?=\s*[A-Za-z]))|(?<=\d)#")

# Two escapes of JSON that stand for one character, which YAML does not have, and the backslashes before.
_PAIR = re.compile(r"(?<!\\)((?:\\\\)*)(\\u[dD][89abAB][0-9a-fA-F]{2}\\u[dD][c-fC-F][0-9a-fA-F]{2})")


def is_title(path: Path) -> bool:
    """Whether the value at a path is a title, which is a text however it looks."""
    return bool(path) and path[-1] in TITLES


def read_tree(
    text: str,
    source: str,
    number: Callable[[str], object] = float,
    lines: dict[Path, int] | None = None,
    *,
    is_text: Callable[[Path], bool] = is_title,
) -> Any:
    """The tree of the one document in `text`. Raises DocumentError for bad or unsafe syntax.

    `number` reads plain scalars that are decimals. `lines` is filled with the line (from 1) of every value by
    its path. The values at a path for which `is_text` is true, and all below them, stay texts as they were
    typed; only an empty one is None.
    """
    text = _of_document(text, source)
    if not text.isascii():
        text = _INDENTATION.sub(lambda blanks: " " * len(blanks[0]), text)
    if "\\u" in text:
        import json

        text = _PAIR.sub(lambda pair: pair[1] + json.loads(f'"{pair[2]}"'), text)
    data = text.encode(errors="surrogatepass")
    require_bounded(data, source)
    try:
        events = _LOADER(data).get_event
        return _Builder(events, source, number, {} if lines is None else lines, is_text).root()
    except yaml.MarkedYAMLError as error:
        if "maximum nesting depth" in (error.problem or ""):  # newer libyaml refuses it by itself
            line = None if error.problem_mark is None else error.problem_mark.line + 1
            raise DocumentError([Problem(source, _TOO_DEEP, line, code="too_deep")]) from None
        from rigidcli.document.slips import find_slip

        slip = find_slip(text, error)
        problem = Problem(source, f"not YAML: {error.problem}", code="parse_error")
        if slip is not None:
            excerpt = Excerpt.of("".join(text.splitlines()[slip.line - 1 : slip.line]), slip.column)
            message = f"not YAML: {slip.message}"
            problem = Problem(source, message, slip.line, "", slip.hint, "parse_error", excerpt)
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1 if isinstance(error.position, int) else None
        problem = Problem(source, f"not YAML: {error.reason}", line, code="parse_error")
    raise DocumentError([problem])


def _of_document(text: str, source: str) -> str:
    """The text without a fence of Markdown round it. Raises DocumentError for text outside of it."""
    if _MARKUP.match(text):
        from rigidcli.document.slips import markup

        raise DocumentError([markup(text, source)])
    if "```" not in text:
        return text
    lines = text.split("\n")
    fences = [number for number, line in enumerate(lines) if line.lstrip().startswith("```")]
    written = [number for number, line in enumerate(lines) if line.strip()]
    if len(fences) == 1 and fences[0] in (written[0], written[-1]):
        lines[fences[0]] = ""
    if len(fences) == 2:
        first, last = fences
        others = [number for number in (*range(first), *range(last + 1, len(lines))) if lines[number].strip()]
        if others:
            before = f"lines 1 to {first + 1}" if first else "line 1"
            hint = f"leave out {before}, and all from line {last + 1} on"
            message = "there is text round the document, which stands between ``` and ```"
            raise DocumentError([Problem(source, message, others[0] + 1, hint=hint, code="parse_error")])
        lines[first] = lines[last] = ""
    return "\n".join(lines)


def read_value(text: str, source: str) -> Any:
    """The value in a text. Raises DocumentError."""
    return read_tree(text, source, decimal)


def decimal(text: str) -> Decimal | float:
    """A number as it is typed, digit by digit; infinity or zero for an exponent that no number has."""
    try:
        return Decimal(text)
    except InvalidOperation:
        return float(text)


@dataclass(slots=True)
class _Builder:
    """Builds the tree from events of the parser, by recursion down to DEEPEST_NESTING."""

    _next: Callable[[], Any]
    _source: str
    _number: Callable[[str], object]
    _lines: dict[Path, int]
    _is_text: Callable[[Path], bool]

    def root(self) -> Any:
        """The tree of the one document of the stream; None for an empty stream."""
        root, documents, begin = None, 0, None
        while (event := self._next()) is not None:
            if isinstance(event, yaml.NodeEvent):
                read = self._node(event, (), 0, self._is_text(()))
                if documents > 1 and (read is not None or root is None):
                    hint = "put it into a file of its own, or leave it out"
                    raise self._refusal(begin, "a second document begins here, expected one in a file", hint)
                root = read if documents <= 1 else root
            elif isinstance(event, yaml.DocumentStartEvent):
                documents, begin = documents + 1, event
        return root

    def _node(self, event: Any, path: Path, depth: int, is_text: bool) -> Any:
        """The value that begins with `event`; lists and mappings around it are `depth` deep."""
        if event.anchor is not None or event.tag is not None:
            raise self._unsafe(event)
        if type(event) is yaml.ScalarEvent:
            return event.value if event.style else self._plain(event, is_text)
        if depth == DEEPEST_NESTING:
            raise self._refusal(event, _TOO_DEEP, code="too_deep")
        if type(event) is yaml.MappingStartEvent:
            return self._mapping(path, depth + 1, is_text)
        items: list[Any] = []
        while type(event := self._next()) is not yaml.SequenceEndEvent:
            place = (*path, len(items))
            self._lines[place] = event.start_mark.line + 1
            items.append(self._node(event, place, depth + 1, is_text))
        return items

    def _mapping(self, path: Path, depth: int, is_text: bool) -> dict[str, Any]:
        mapping: dict[str, Any] = {}
        while type(event := self._next()) is not yaml.MappingEndEvent:
            line = event.start_mark.line + 1
            if event.anchor is not None or event.tag is not None:
                raise self._unsafe(event)
            if type(event) is not yaml.ScalarEvent:
                raise self._refusal(event, "a key is a list or a mapping, expected a text")
            key = event.value
            if key == "<<" and not event.style:
                message = "merge keys (`<<`) are not read"
                raise self._refusal(event, message, "write the keys out", code="not_allowed")
            if key in mapping:
                message = f"the key {shown(key)} stands twice in this mapping"
                hint = "leave out one of them"
                if key[:1].isdigit():
                    hint = "a list stands in brackets: `[1, 2, 3]`"
                elif type(self._next()) is yaml.MappingStartEvent:
                    hint = "put what is in both below one of them"
                if key == "body":
                    hint = "bodies that are taken as one are its `parts`: `body: {parts: [{...}, {...}]}`"
                raise self._refusal(event, message, hint, code="duplicate_key")
            place = (*path, key)
            self._lines[place] = line
            mapping[key] = self._node(self._next(), place, depth, is_text or self._is_text(place))
        return mapping

    def _refusal(
        self, event: Any, message: str, hint: str | None = None, code: str = "parse_error"
    ) -> DocumentError:
        return DocumentError([Problem(self._source, message, event.start_mark.line + 1, "", hint, code)])

    def _unsafe(self, event: Any) -> DocumentError:
        if event.anchor is not None:
            hint = "write the value out, or quote the text"
            return self._refusal(event, "anchors and aliases (`&`, `*`) are not read", hint, "not_allowed")
        hint = "leave out tags: the schema knows the types"
        return self._refusal(event, f"the tag {shown(event.tag)} is not read", hint, "not_allowed")

    def _plain(self, event: Any, is_text: bool, text: str | None = None) -> object:
        text = event.value if text is None else text
        assert isinstance(text, str)
        if text in _NULL:
            return None
        if is_text or text in _TRUTHS:
            return text if is_text else _TRUTHS[text]
        kind = _NUMBER.fullmatch(text)
        if kind is None:
            if comment := _COMMENT.search(text):
                message = f"read {shown(text)}: `{comment[0].strip()}` begins no comment"
                raise self._refusal(event, message, "a comment begins with a blank and `#`")
            is_ended = text[-1] in ",;" and len(text) > 1  # as in JSON, or in a program
            return self._plain(event, is_text, text.rstrip(",; ")) if is_ended else text
        if kind.lastgroup == "decimal":
            return self._number(text)
        if kind.lastgroup == "endless":
            return float(text.replace(".", ""))
        if len(text) > MAX_INTEGER_DIGITS:
            message = f"a number of {len(text)} digits, expected at most {MAX_INTEGER_DIGITS}"
            raise self._refusal(event, message)
        return int(text) if kind.lastgroup == "whole" else int(text, 0)
