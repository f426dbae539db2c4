"""Reading: what is written -> a document, or all that is wrong with it, each problem with its line."""

from __future__ import annotations

import json
import math
import os
import pathlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from pydantic import ValidationError

from rigidcli.bodies.robots import is_robot
from rigidcli.core.arithmetic import FLOAT, Arithmetic
from rigidcli.document.complaints import explain
from rigidcli.document.document import Document
from rigidcli.document.origins import BodyFile, LinkOrigin, Origin, body_form, links, of_text
from rigidcli.document.parameters import read_parameters
from rigidcli.document.settings import SWEEP
from rigidcli.errors import UNSETTLED, DocumentError, Problem, UsageError, ValueProblem, shown
from rigidcli.fields.environment import Environment
from rigidcli.fields.texts import STDIN, read_text
from rigidcli.fields.words import with_colon

if TYPE_CHECKING:
    from rigidcli.bodies.robots.links import Link

Source: TypeAlias = Document | Mapping[str, Any] | str | os.PathLike[str]
"""A document, read already or not: what it says as a mapping, its text in YAML, or the path to its file."""

MAPPING = "<mapping>"
"""What messages call a document that was given as a mapping, which has no lines."""

KEYS = tuple(Document.model_fields)
"""The keys at the top of a document."""

_TEXT = re.compile(r"\n|:\s|\{")
"""What the text of a document has, and the path to a file has not."""


@dataclass(frozen=True)
class Draft:
    """What is written, and how it is to be read; some of its values may still change.

    `settings` are texts `KEY=VALUE`, as after `--set`; `options` has the keys of those that an option of its
    own has given, with its name. `exact` makes decimals rationals and parameters without a value symbols.
    """

    origin: Origin
    exact: bool = False
    settings: Sequence[str] = ()
    options: Mapping[str, str] = field(default_factory=dict)

    @property
    def source(self) -> str:
        """The name of the file."""
        return self.origin.source

    @property
    def link(self) -> Link:
        """The link of a robot that the document is about."""
        assert isinstance(self.origin, LinkOrigin)
        return self.origin.link

    @cached_property
    def _set(self) -> Origin:
        """What is written, with the values that are set."""
        return self.origin.changed_by(self.settings, self.options)

    def absolute(self) -> Draft:
        """The same draft for a process in another folder, which reads the files that the document names."""
        return replace(self, origin=replace(self.origin, folder=self.origin.folder.absolute()))

    def is_exact(self, swept: Sequence[str]) -> bool:
        """Whether the document is worked exactly with these values swept. Raises as `load`."""
        return self.exact or _has_symbols(self._set.changed_by(swept, option=SWEEP).tree)

    def document(self, swept: Sequence[str] = ()) -> Document:
        """The document with these values swept, texts `KEY=VALUE` of `--sweep`. Raises as `load`."""
        if isinstance(self.origin, LinkOrigin) and self.link.problem is not None:
            raise DocumentError([self.link.problem])
        origin = self._set.changed_by(swept, option=SWEEP)
        if not isinstance(origin.tree, dict):
            raise DocumentError([origin.problem(_no_mapping(origin.tree))])
        exact = self.exact or _has_symbols(origin.tree)
        positive: frozenset[str] = frozenset()
        while True:
            document, found = _read(origin, exact, positive)
            if found <= positive:
                return _tried(origin, document) if _has_symbols(origin.tree) else document
            # Symbols that stand for masses and lengths are positive; knowing that, read once more.
            positive |= found


class Drafts(NamedTuple):
    """The documents of a file, not yet read, and notes on the file as a whole."""

    each: Sequence[Draft]
    notes: Sequence[str]


def draft(path: str | os.PathLike[str], **options: Any) -> Draft:
    """The one document in a file, `-` being standard input; options as in `load`. Raises DocumentError."""
    name = os.fspath(path)
    folder = pathlib.Path() if name == STDIN else pathlib.Path(name).parent
    # A file name may have bytes that are no text.
    source = os.fsencode(name).decode(errors="backslashreplace")
    form = body_form(name)
    if form is not None:
        return _draft(BodyFile(source, folder, {"body": {form: pathlib.PurePath(name).name}}), **options)
    return _draft(of_text(read_text(name, source), source, folder), **options)


def drafts(path: str | os.PathLike[str], **options: Any) -> Drafts:
    """The documents of a file: a robot description has one a link, all else is one. Raises DocumentError."""
    name = os.fspath(path)
    if not is_robot(name):
        return Drafts([draft(path, **options)], ())
    source = os.fsencode(name).decode(errors="backslashreplace")
    found = robot_drafts(read_text(name, source), source, pathlib.Path(name).parent, **options)
    if not found.each:
        raise DocumentError(
            [Problem(source, "; ".join(["no link has a mass that is written", *found.notes]))]
        )
    return found


def robot_drafts(text: str, source: str, folder: pathlib.Path, **options: Any) -> Drafts:
    """The links of the robot in `text` that have a mass, or a problem. Raises DocumentError for no robot."""
    origins, notes = links(text, source, folder)
    return Drafts([_draft(origin, **options) for origin in origins], notes)


def _draft(
    origin: Origin,
    *,
    exact: bool = False,
    settings: Sequence[str] = (),
    options: Mapping[str, str] | None = None,
) -> Draft:
    return Draft(origin, exact, settings, options or {})


def load(path: str | os.PathLike[str], **options: Any) -> Document:
    """Read the document in the file `path`; `-` is standard input.

    A file that is a body by itself, such as a table of points, stands for the document that has it as its
    body, and `settings` complete that; of a robot one link has a mass. The options are `exact`, `settings`
    and `options`: the fields of a `Draft`. A document with a parameter that has no value is exact in any
    case. One of a system keeps its expressions as they are, and has floats for the numbers that it needs.
    Raises DocumentError with all problems, or UsageError for a setting that is not of its form.
    """
    one, *others = load_all(path, **options)
    if others:
        message = f"there are {len(others) + 1} links with a mass, expected one"
        raise DocumentError([Problem(one.source, message, hint="`rigidcli.load_all` reads all of them")])
    return one


def load_all(path: str | os.PathLike[str], **options: Any) -> list[Document]:
    """The documents of a file, as `load` reads one: of a robot description one a link that has a mass.

    Raises DocumentError with the problems of all links.
    """
    found, problems = [], list[Problem]()
    for each in drafts(path, **options).each:
        try:
            found.append(each.document())
        except DocumentError as error:
            problems += error.problems
    if problems:
        raise DocumentError(problems)
    return found


def loads(
    text: str, *, source: str = "<text>", folder: pathlib.Path | None = None, **options: Any
) -> Document:
    """Read the document in `text`, as `load` does; files that it names are looked for in `folder`."""
    return _draft(of_text(text, source, folder), **options).document()


def read(source: Source, exact: bool, settings: Sequence[str]) -> Document:
    """The document of a source. Raises DocumentError, and UsageError for a document with `settings`."""
    if isinstance(source, Document):
        if exact or settings:
            raise UsageError(
                "the document has been read already", hint="give `exact` and `settings` to `load`"
            )
        return source
    if isinstance(source, Mapping):
        try:
            text = json.dumps(source, default=_plain)
        except (TypeError, ValueError, RecursionError) as error:
            raise DocumentError([Problem(MAPPING, f"cannot be read: {error}")]) from None
        if problems := list(_not_finite(json.loads(text))) if "NaN" in text or "Infinity" in text else ():
            raise DocumentError(problems)
        return loads(text, source=MAPPING, exact=exact, settings=settings)
    if isinstance(source, str) and _TEXT.search(source):
        return loads(source, exact=exact, settings=settings)
    return load(source, exact=exact, settings=settings)


def _not_finite(value: Any, path: str = "") -> Iterator[Problem]:
    """The problems of numbers that are none, in a value at the `path` of a mapping."""
    if isinstance(value, float) and not math.isfinite(value):
        yield Problem(MAPPING, f"read `{value}`, expected a finite number", key=path)
    entries = dict(enumerate(value)) if isinstance(value, list) else value
    for step, entry in entries.items() if isinstance(entries, dict) else ():
        yield from _not_finite(entry, f"{path}.{step}" if path else str(step))


def _plain(value: Any) -> Any:
    """Arrays and other numbers as json has them; exact expressions, fractions and paths as text."""
    if hasattr(value, "tolist"):
        return value.tolist()
    return dict(value) if isinstance(value, Mapping) else str(value)


def _has_time(tree: Mapping[str, Any]) -> bool:
    """Whether expressions of the document may be in the time: in those, `t` is no parameter."""
    motion = tree.get("motion")
    torque = isinstance(motion, dict) and motion.get("torque") is not None
    return torque or any(tree.get(key) is not None for key in ("system", "orbit", "transform"))


def _has_symbols(tree: object) -> bool:
    """Whether a parameter stands without a value."""
    parameters = tree.get("parameters") if isinstance(tree, dict) else None
    return isinstance(parameters, dict) and None in parameters.values()


def _no_mapping(tree: object) -> ValueProblem:
    """The problem of what is no document at all."""
    if tree is None:
        hint: str | None = "`rigidcli new` prints a document to start from"
        return ValueProblem("read an empty document, expected a mapping", hint=hint)
    cure = with_colon(tree) if isinstance(tree, str) else None
    hint = cure and f"write `{cure}`"
    return ValueProblem(f"read {shown(tree)}, expected a mapping", hint=hint, typed=cure and str(tree))


def _tried(origin: Origin, document: Document) -> Document:
    """The document, with notes on values of its symbols that it cannot have.

    Raises DocumentError where it can have none.
    """
    if document.body is None and document.top is None:
        return document
    from rigidcli.document.trials import tried

    def with_numbers(tree: Mapping[str, Any]) -> Document:
        found, _ = _read(replace(origin, tree=tree), False, frozenset(), is_physical=False)
        return found

    refused, notes = [], []
    for problem, sentence, always in tried(origin.tree, with_numbers):
        if always:
            line = origin.place(tuple(problem.key.split(".")))[1]
            refused.append(Problem(origin.source, sentence, line, problem.key))
        else:
            notes.append(f"{problem.key}: {sentence}" if problem.key else sentence)
    if refused:
        raise DocumentError(refused)
    return document.came_from(origin, [*document.notes, *notes]) if notes else document


def _read(
    origin: Origin, exact: bool, positive: frozenset[str], *, is_physical: bool = True
) -> tuple[Document, set[str]]:
    """The document of a tree, and the symbols that make sense only as positive numbers.

    Those in `positive` are taken to be positive. It is looked at whether what is described can exist, if
    `is_physical`. Raises DocumentError with all problems.
    """
    tree = origin.tree
    # A system alone keeps its expressions symbolic, and its numbers are floats.
    alone = tree.get("system") is not None and all(tree.get(key) is None for key in ("body", "top", "tide"))
    env = Environment(
        _arithmetic(exact and not alone),
        folder=origin.folder,
        exact_results=exact,
        top_keys=KEYS,
    )
    parameters = tree.get("parameters")
    problems = []
    if isinstance(parameters, dict):
        problems = read_parameters(env, parameters, positive, has_time=_has_time(tree))
    try:
        document = Document.model_validate(tree, context=env)
        if is_physical and not problems and not env.faults:
            document.physical.require()
    except ValidationError as error:
        problems += explain(error)
    except ValueProblem as problem:
        problems.append(problem)
    problems += [fault.below("parameters", name) for name, fault in sorted(env.faults.items())]
    if problems:
        told = [origin.problem(problem) for problem in problems if problem.code != UNSETTLED]
        raise DocumentError(sorted(told, key=lambda placed: placed.line or 0))
    notes = list(dict.fromkeys(env.notes))
    if document.orbit is not None and document.system is not None and document.orbit.ensemble is None:
        notes += document.orbit.degrees_meant(document.system, tree["orbit"]["initial"])
    notes += [f"parameter `{name}` is not used" for name in document.unused]
    return document.came_from(origin, notes), env.positive


def _arithmetic(exact: bool) -> Arithmetic:
    if not exact:
        return FLOAT
    from rigidcli.algebra.arithmetic import EXACT

    return EXACT
