"""YAML text -> plain mappings, lists and scalars, by YAML 1.2's core schema and nothing beyond it.

The events of PyYAML's parser are put together here, without its composer and constructor: these
recurse in C until the stack is gone, follow merge keys and aliases without bound, and read YAML 1.1,
in which `1:30` is ninety and `no` is false. JSON is read by the same road, being YAML.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import Any

import yaml

from rigidcli.errors import DocumentError, Excerpt, Path, Problem, shown
from rigidcli.fields.texts import require_bounded

MAX_DEPTH = 50
"""The deepest nesting of lists and mappings: documents have ten levels, and Python's stack has a thousand."""

MAX_INTEGER_DIGITS = 400
"""The most digits of a whole number: more than any float has, fewer than are slow to read."""

TITLES = frozenset(["name", "description", "assignment"])
"""Keys whose values are texts, however they look: the problem 10.10 is not 10.1."""

_LOADER: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
"""The parser in C, which is ten times faster, where there is one; both give the same events."""

_NULL = dict.fromkeys(["", "~", "null", "Null", "NULL"])
_TRUE, _FALSE = ["true", "True", "TRUE"], ["false", "False", "FALSE"]
_PLAIN = _NULL | dict.fromkeys(_TRUE, True) | dict.fromkeys(_FALSE, False)
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_INT = re.compile(r"[-+]?[0-9]+")
_BASED_INT = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
"""What a plain scalar is, by the core schema of YAML 1.2; any other is a text."""

_SURROGATES = re.compile(r"(?<!\\)((?:\\\\)*)\\u([dD][89abAB][0-9a-fA-F]{2})\\u([dD][c-fC-F][0-9a-fA-F]{2})")
"""Two escapes of JSON that stand for one character, and the backslashes before them."""


def read_tree(
    text: str,
    source: str,
    number: Callable[[str], object] = float,
    lines: dict[Path, int] | None = None,
    *,
    typed: bool = False,
) -> Any:
    """The one document in `text`. Raises DocumentError for bad syntax and for what is not safe to read.

    `number` makes numbers of plain scalars that are not integers. `lines` is filled with the line (from 1) of
    every value by its path. Scalars stay the texts that were `typed`, where that is asked, and only nothing
    at all is None.
    """
    if "\\u" in text:
        text = _SURROGATES.sub(_joined, text)
    data = text.encode(errors="surrogatepass")
    require_bounded(data, source)
    try:
        return _Builder(
            yaml.parse(data, Loader=_LOADER), source, number, {} if lines is None else lines, typed
        ).root()
    except yaml.MarkedYAMLError as error:
        from rigidcli.document.slips import find_slip

        slip = find_slip(text, error)
        problem = Problem(source, f"not YAML: {error.problem}", code="parse_error")
        if slip is not None:
            excerpt = Excerpt.of("".join(text.splitlines()[slip.line - 1 : slip.line]), slip.column)
            message = f"not YAML: {slip.message}"
            problem = Problem(source, message, slip.line, "", slip.hint, "parse_error", excerpt)
        raise DocumentError([problem]) from None
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1 if isinstance(error.position, int) else None
        problem = Problem(source, f"not YAML: {error.reason}", line, code="parse_error")
        raise DocumentError([problem]) from None


def read_value(text: str, source: str) -> Any:
    """The value in a text, which is mostly a number and then needs no parser. Raises DocumentError."""
    if len(text) <= MAX_INTEGER_DIGITS and _FLOAT.fullmatch(text):
        return int(text) if _INT.fullmatch(text) else decimal(text)
    return read_tree(text, source, decimal)


def decimal(text: str) -> Decimal | float:
    """A number as it is typed, digit by digit; infinity or zero for an exponent that no number has."""
    try:
        return Decimal(text)
    except InvalidOperation:
        return float(text)


def _joined(pair: re.Match[str]) -> str:
    """The character, such as U+1F600, for which JSON writes a pair of escapes that YAML does not have."""
    high, low = (int(pair[group], 16) for group in (2, 3))
    return pair[1] + chr(0x10000 + ((high - 0xD800) << 10) + (low - 0xDC00))


@dataclass(slots=True)
class _Builder:
    """Puts events together. Containers within containers are worked by recursion, to MAX_DEPTH."""

    _events: Iterator[yaml.Event]
    _source: str
    _number: Callable[[str], object]
    _lines: dict[Path, int]
    _typed: bool

    def root(self) -> Any:
        """The one document of the stream; None where there is nothing."""
        root, documents = None, 0
        for event in self._events:
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    raise self._refusal(event, "a second document begins here, expected one in a file")
            elif isinstance(event, yaml.NodeEvent):
                root = self._node(event, (), 0)
        return root

    def _node(self, event: yaml.Event, path: Path, depth: int, is_text: bool = False) -> Any:
        """The value that begins with `event`; lists and mappings around it are `depth` deep."""
        self._refuse_unsafe(event)
        if isinstance(event, yaml.ScalarEvent):
            return self._scalar(event, is_text or self._typed)
        if depth == MAX_DEPTH:
            raise self._refusal(event, f"nested more than {MAX_DEPTH} deep", code="too_deep")
        if isinstance(event, yaml.MappingStartEvent):
            return self._mapping(path, depth + 1)
        items: list[Any] = []
        while not isinstance(event := next(self._events), yaml.CollectionEndEvent):
            items.append(self._node(event, self._placed(path, len(items), event), depth + 1))
        return items

    def _mapping(self, path: Path, depth: int) -> dict[str, Any]:
        mapping: dict[str, Any] = {}
        while not isinstance(event := next(self._events), yaml.CollectionEndEvent):
            self._refuse_unsafe(event)
            if not isinstance(event, yaml.ScalarEvent):
                raise self._refusal(event, "a key is a list or a mapping, expected a text")
            key = event.value
            if key == "<<" and not event.style:
                message = "merge keys (`<<`) are not read"
                raise self._refusal(event, message, "write the keys out", code="not_allowed")
            if key in mapping:
                message = f"the key {shown(key)} stands twice in this mapping"
                raise self._refusal(event, message, code="duplicate_key")
            value = next(self._events)
            place = self._placed(path, key, event)
            mapping[key] = self._node(value, place, depth, is_text=key in TITLES)
        return mapping

    def _placed(self, path: Path, step: str | int, event: yaml.Event) -> Path:
        """The path to an entry, after taking note of its line."""
        mark: Any = event.start_mark
        self._lines[*path, step] = mark.line + 1
        return (*path, step)

    def _refusal(
        self, event: Any, message: str, hint: str | None = None, code: str = "parse_error"
    ) -> DocumentError:
        return DocumentError([Problem(self._source, message, event.start_mark.line + 1, "", hint, code)])

    def _refuse_unsafe(self, event: yaml.Event) -> None:
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None) is not None:
            hint = "write the value out, or quote the text"
            message = "anchors and aliases (`&`, `*`) are not read"
            raise self._refusal(event, message, hint, code="not_allowed")
        tag = getattr(event, "tag", None)
        if tag is not None:
            hint = "leave out tags: the schema knows the types"
            raise self._refusal(event, f"the tag {shown(tag)} is not read", hint, code="not_allowed")

    def _scalar(self, event: yaml.ScalarEvent, is_text: bool) -> object:
        text: str = event.value
        if event.style or (is_text and text not in _NULL):
            return text
        if text in _PLAIN:
            return _PLAIN[text]
        if _INT.fullmatch(text):
            if len(text) > MAX_INTEGER_DIGITS:
                message = f"a number of {len(text)} digits, expected at most {MAX_INTEGER_DIGITS}"
                raise self._refusal(event, message)
            return int(text)
        if _FLOAT.fullmatch(text):
            return self._number(text)
        if _BASED_INT.fullmatch(text) and len(text) <= MAX_INTEGER_DIGITS:
            return int(text, 0)
        if _NOT_FINITE.fullmatch(text):
            return float(text.replace(".", ""))
        return text
