"""A document before validation: the tree of its values with their lines, and the settings of options.

YAML is read by the core schema of YAML 1.2 and nothing beyond it; JSON is YAML, too. The events of PyYAML's
parser are put together here, without its composer and constructor: these recurse in C until the stack is
gone, follow merge keys and aliases without bound, and read YAML 1.1, in which `1:30` is ninety and `no` is
false.
"""

from __future__ import annotations

import json
import pathlib
import re
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from decimal import Decimal, InvalidOperation
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Self

import yaml

from rigidcli.errors import (
    UNKNOWN_KEY,
    DocumentError,
    Excerpt,
    Path,
    Problem,
    UsageError,
    ValueProblem,
    shown,
)
from rigidcli.fields.texts import ending, require_bounded
from rigidcli.language.tokens import NUMERAL

if TYPE_CHECKING:
    from rigidcli.bodies.robots import Link

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
_TRUE, _FALSE = ["true", "True", "TRUE"], ["false", "False", "FALSE"]
_PLAIN = _NULL | dict.fromkeys(_TRUE, True) | dict.fromkeys(_FALSE, False)
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

_COMMENT = re.compile(r"\s(?://|/\*|%(?=\s*[A-Za-z]))|(?<=\d)#")
"""What begins a comment in other languages, within a value."""

# Two escapes of JSON that stand for one character, which YAML does not have, and the backslashes before.
_PAIR = re.compile(r"(?<!\\)((?:\\\\)*)(\\u[dD][89abAB][0-9a-fA-F]{2}\\u[dD][c-fC-F][0-9a-fA-F]{2})")


def read_tree(
    text: str,
    source: str,
    number: Callable[[str], object] = float,
    lines: dict[Path, int] | None = None,
    *,
    typed: bool = False,
) -> Any:
    """The tree of the one document in `text`. Raises DocumentError for bad or unsafe syntax.

    `number` reads plain scalars that are decimals. `lines` is filled with the line (from 1) of every value by
    its path. With `typed`, all scalars stay texts as they were typed, and only an empty one is None.
    """
    text = _of_document(text, source)
    if not text.isascii():
        text = _INDENTATION.sub(lambda blanks: " " * len(blanks[0]), text)
    if "\\u" in text:
        text = _PAIR.sub(lambda pair: pair[1] + json.loads(f'"{pair[2]}"'), text)
    data = text.encode(errors="surrogatepass")
    require_bounded(data, source)
    try:
        events = _LOADER(data).get_event
        return _Builder(events, source, number, {} if lines is None else lines, typed).root()
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
    """The value in a text; a number needs no parser. Raises DocumentError."""
    kind = _NUMBER.fullmatch(text) if len(text) <= MAX_INTEGER_DIGITS else None
    if kind is None or kind.lastgroup not in ("whole", "decimal"):
        return read_tree(text, source, decimal)
    return int(text) if kind.lastgroup == "whole" else decimal(text)


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
    _is_typed: bool

    def root(self) -> Any:
        """The tree of the one document of the stream; None for an empty stream."""
        root, documents, begin = None, 0, None
        while (event := self._next()) is not None:
            if isinstance(event, yaml.NodeEvent):
                read = self._node(event, (), 0, self._is_typed)
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
            return self._mapping(path, depth + 1)
        items: list[Any] = []
        while type(event := self._next()) is not yaml.SequenceEndEvent:
            place = (*path, len(items))
            self._lines[place] = event.start_mark.line + 1
            items.append(self._node(event, place, depth + 1, self._is_typed))
        return items

    def _mapping(self, path: Path, depth: int) -> dict[str, Any]:
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
            mapping[key] = self._node(self._next(), place, depth, self._is_typed or key in TITLES)
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
        if text in _NULL or (text in _PLAIN and not is_text):
            return _PLAIN[text]
        kind = None if is_text else _NUMBER.fullmatch(text)
        if kind is None and not is_text and (comment := _COMMENT.search(text)):
            message = f"read {shown(text)}: `{comment[0].strip()}` begins no comment"
            raise self._refusal(event, message, "a comment begins with a blank and `#`")
        if kind is None and not is_text and text[-1] in ",;" and len(text) > 1:
            return self._plain(event, is_text, text.rstrip(",; "))  # as in JSON, or in a program
        if kind is None:
            return text
        if kind.lastgroup == "decimal":
            return self._number(text)
        if kind.lastgroup == "endless":
            return float(text.replace(".", ""))
        if len(text) > MAX_INTEGER_DIGITS:
            message = f"a number of {len(text)} digits, expected at most {MAX_INTEGER_DIGITS}"
            raise self._refusal(event, message)
        return int(text) if kind.lastgroup == "whole" else int(text, 0)


# --- drafts

LINES_BELOW_KEY = 20  # lines below a key in which its value is searched, to show it in a message

BODY_FILES = dict.fromkeys((".glb", ".obj", ".off", ".ply", ".stl"), "mesh") | dict.fromkeys(
    (".csv", ".npy", ".xyz"), "points"
)
"""The key under which a document names a body that is a file, by the ending of the file's name."""

SWEEP = "--sweep"  # the option under which a key runs over several values
# Keys joined by points, and the value after the first `=`.
_SETTING = re.compile(r"([^=.]+(?:\.[^=.]+)*)=(.*)", re.DOTALL)


def body_form(name: str) -> str | None:
    """The key of `body` under which a document names this file; None where it is no body by itself."""
    return BODY_FILES.get(ending(name))


def split_setting(
    text: str, option: str = "--set", expected: str = "KEY=VALUE", example: str = 'body.mass="3 kg"'
) -> tuple[Path, str]:
    """The path and the text of the value in `a.0.b=value`. Raises UsageError, which names the option."""
    setting = _SETTING.fullmatch(text)
    if setting is None:
        message = f"{option}: read {shown(text)}, expected {expected}"
        raise UsageError(message, hint=f"as in {option} {example}")
    key, value = setting.groups()
    return _steps(key), value


@lru_cache(maxsize=64)
def _steps(key: str) -> Path:
    # A sweep asks for the same path at every value. `size[0]` is `size.0`.
    steps = re.sub(r"\[(\d+)\]", r".\1", key).split(".")
    return tuple(int(step) if step.isdecimal() else step for step in map(str.strip, steps))


def _is_parameter(path: Path, tree: Any) -> bool:
    # The document has such a parameter, or uses one that it does not declare.
    if len(path) > 1 or not isinstance(tree, dict) or path[0] in tree:
        return False
    return path[0] in (tree.get("parameters") or ()) or path[0] in names_in(tree)


def names_in(tree: Any) -> set[str]:
    """The names in the expressions of a tree: in its texts, but for titles and keys."""
    if isinstance(tree, str):
        return {*re.findall(r"[^\W\d]\w*", tree)}
    values = tree if isinstance(tree, list) else ()
    if isinstance(tree, dict):
        values = [value for key, value in tree.items() if key not in TITLES]
    return set[str]().union(*map(names_in, values))


def put(tree: Any, path: Path, value: object, above: Path = ()) -> tuple[Any, Path]:
    """A copy of the tree with another value at `path`, and the path with names of entries as indices.

    The copy shares what does not change. The path `above` leads to the tree. Raises ValueProblem if there is
    no such place.
    """
    if not path:
        return value, ()
    step, rest = path[0], path[1:]
    if isinstance(tree, dict):
        step = str(step)
        inner = tree.get(step, {})
        if step not in tree and rest and isinstance(rest[0], int):
            whole = ".".join(map(str, (*above, step)))
            hint = f"give it whole, as in `--set {whole}=[0, 0, 1]`"
            raise ValueProblem(f"there is no list `{whole}`", hint=hint)
    else:
        entries = tree if isinstance(tree, list) else []
        named = [
            k for k, entry in enumerate(entries) if isinstance(entry, dict) and entry.get("name") == step
        ]
        step = named[0] if len(named) == 1 else step
        if not (isinstance(step, int) and step < len(entries)):
            cure = f"its entries are 0 to {len(entries) - 1}" if entries else None
            if names := [
                str(entry["name"]) for entry in entries if isinstance(entry, dict) and "name" in entry
            ]:
                cure = f"{cure}, by name {', '.join(names)}"
            if len(named) > 1:
                cure = f"the name stands {len(named)} times: say which by its number, such as {named[0]}"
            raise ValueProblem(f"there is no {shown(str(step))} in {shown(tree)}", hint=cure)
        inner = entries[step]
    inner, way = put(inner, rest, value, (*above, step))
    changed = copy(tree)
    changed[step] = inner
    return changed, (step, *way)


@dataclass(frozen=True, eq=False)
class Draft:
    """The tree of mappings, lists and scalars in a document, and the way in which it is to be read.

    `lines`: the line of every key and entry in the `text`. `folder`: names of files are relative to it.
    `exact`: decimals are rationals, and parameters without a value are symbols.
    `settings`: texts `KEY=VALUE` of `--set` that are not yet in the tree.
    `options`: the names of options that set a key, by the key.
    `changed`: the options that have set values in the tree, by their paths; `typed`: these settings.
    `form`: the key of `body` for a file that is a body. `link`: a link of a robot.
    """

    source: str
    tree: Any
    text: str = ""
    lines: Mapping[Path, int] = field(default_factory=dict)
    folder: str = ""
    exact: bool = False
    settings: Sequence[str] = ()
    options: Mapping[str, str] = field(default_factory=dict)
    changed: Mapping[Path, str] = field(default_factory=dict)
    typed: tuple[str, ...] = ()
    form: str | None = None
    link: Link | None = None

    @property
    def whole(self) -> str:
        """The text, and below it, in comments, the values that options have set."""
        return f"{self.text.rstrip()}\n" + "".join(f"# with {setting}\n" for setting in self.typed)

    @property
    def has_symbols(self) -> bool:
        """Whether a parameter has no value."""
        parameters = self.tree.get("parameters") if isinstance(self.tree, dict) else None
        return isinstance(parameters, dict) and None in parameters.values()

    def absolute(self) -> Self:
        """The same draft with an absolute folder, for a process in another folder."""
        return replace(self, folder=str(pathlib.Path(self.folder).absolute()))

    def changed_by(self, settings: Sequence[str], option: str = "--set") -> Self:
        """The draft with these values of `KEY=VALUE` in its tree. Raises DocumentError and UsageError."""
        if not settings:
            return self
        tree, changed = self.tree, dict(self.changed)
        for setting in settings:
            path, text = split_setting(setting)
            key = ".".join(map(str, path))
            if _is_parameter(path, tree):
                path = ("parameters", *path)
            own = self.options.get(key)
            value = read_value(text, own or f"{option} {key}")
            try:
                tree, place = put(tree, path, value)
            except ValueProblem as problem:
                message = f"{option} {key}: {problem.message}"
                refused = Problem(self.source, message, hint=problem.hint, code=UNKNOWN_KEY)
                raise DocumentError([refused]) from None
            changed[place] = own or option
        return replace(self, tree=tree, changed=changed, typed=(*self.typed, *settings))

    def place(self, path: Path) -> tuple[str, int | None]:
        """The source and line of a value, or of the nearest key above; values of options have no line."""
        for changed, option in reversed([*self.changed.items()]):
            if path[: len(changed)] == changed:
                return f"{self.source} with {option}", None
        above = (path[:end] for end in range(len(path), -1, -1))
        return self.source, next((self.lines[path] for path in above if path in self.lines), None)

    def problem(self, problem: ValueProblem) -> Problem:
        """The problem of a value with its source, line and key."""
        source, line = self.place(problem.path)
        key = ".".join(map(str, problem.path))
        if self.form is not None:
            return self._of_file(problem, source, key)
        if source == self.source:
            line = line or 1  # a problem of the whole document
        excerpt, typed = None, (problem.typed or "").partition("\n")[0].strip()
        if typed and line is not None:
            below = enumerate(self.text.splitlines()[line - 1 : line + LINES_BELOW_KEY], start=line)
            line, text = next(((number, text) for number, text in below if typed in text), (line, ""))
            excerpt = Excerpt.of(text, text.index(typed) + 1) if text else None
        if self.link is not None:
            if problem.path[:1] == ("body",) and source == self.source:
                # A robot description has no keys of documents.
                key = str(problem.path[-1]) if problem.path[-1] in ("mass", "position", "rotation") else ""
            key = f"link {self.link.name}: {key}".removesuffix(": ")
        return Problem(source, problem.message, line, key, problem.hint, problem.code, excerpt)

    def _of_file(self, problem: ValueProblem, source: str, key: str) -> Problem:
        """The problem of a file that is a body by itself, at the line with which the message may begin."""
        file = re.escape(str(pathlib.PurePath(self.folder, str(self.tree["body"][self.form]))))
        in_file = re.fullmatch(rf"{file}(?::(\d+))?: (.*)", problem.message, re.DOTALL)
        if in_file is not None:
            return Problem(source, in_file[2], int(in_file[1]) if in_file[1] else None, hint=problem.hint)
        hint = problem.hint
        if source == self.source and hint is None and problem.message.startswith(("missing", "neither")):
            example = "body.density=7850" if key == "body" else f"{key}=VALUE"
            hint = f"the file is the body of a document, which settings complete, as `--set {example}`"
        return Problem(source, problem.message, key=key, hint=hint, code=problem.code)


def of_text(text: str, source: str, folder: str = "", **options: Any) -> Draft:
    """The draft of a text in YAML. Raises DocumentError."""
    lines: dict[Path, int] = {}
    return Draft(source, read_tree(text, source, decimal, lines), text, lines, folder, **options)
