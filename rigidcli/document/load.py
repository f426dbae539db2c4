"""Reading: what is written -> a document, or all that is wrong with it, each problem with its line."""

from __future__ import annotations

import json
import os
import pathlib
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from pydantic import ValidationError

from rigidcli.bodies.robots import is_robot
from rigidcli.document.complaints import explain
from rigidcli.document.document import Document
from rigidcli.document.origins import (
    SWEEP,
    BodyFile,
    LinkOrigin,
    Origin,
    body_form,
    links,
    of_text,
    split_setting,
)
from rigidcli.document.parameters import read_parameters
from rigidcli.errors import UNSETTLED, DocumentError, Problem, UsageError, ValueProblem, shown
from rigidcli.fields.environment import Environment, arithmetic_for
from rigidcli.fields.section import Section
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

APART = frozenset({"name", "description", "body", "axis", "frame", "motion", "top", "tide"})
"""Keys at the top that are read without another. Where only such keys are swept, all else is read once."""

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
        if swept and not exact:
            rest = self._without(tuple(text.partition("=")[0] for text in swept))
            return _read(origin, exact, rest=rest)[0]
        positive: frozenset[str] = frozenset()
        while True:
            document, found = _read(origin, exact, positive)
            if found <= positive:
                break
            # Symbols that stand for masses and lengths are positive; knowing that, read once more.
            positive |= found
        if not _has_symbols(origin.tree) or (document.body is None and document.top is None):
            return document
        from rigidcli.document.trials import tried

        def with_numbers(tree: Mapping[str, Any]) -> Document:
            return _read(replace(origin, tree=tree), False, is_physical=False)[0]

        return tried(document, origin, with_numbers)

    @cached_property
    def _rests(self) -> dict[tuple[str, ...], Document | None]:
        """What `_without` has made, by the paths that are swept."""
        return {}

    def _without(self, paths: tuple[str, ...]) -> Document | None:
        """The document without the keys at its top to which paths lead: what is the same at all points.

        None where it cannot be read without them; then each point is read whole, and tells what is wrong.
        """
        if paths not in self._rests:
            self._rests[paths], keys = None, {split_setting(f"{path}=")[0][0] for path in paths}
            tree = {key: value for key, value in self._set.tree.items() if key not in keys}
            with suppress(DocumentError):
                if keys <= APART:
                    rest, _ = _read(replace(self._set, tree=tree), False, is_physical=False)
                    self._rests[paths] = rest
        return self._rests[paths]

    def __getstate__(self) -> dict[str, Any]:
        """What another process needs: not what was worked out here, which may be large."""
        return {part.name: getattr(self, part.name) for part in fields(self)}


class Drafts(NamedTuple):
    """The documents of a file, not yet read, and notes on the file as a whole."""

    each: Sequence[Draft]
    notes: Sequence[str]


def drafts(path: str | os.PathLike[str], **options: Any) -> Drafts:
    """The documents of a file, `-` being standard input; options as in `load`. Raises DocumentError.

    A robot description has one a link, all else is one.
    """
    name = os.fspath(path)
    # A file name may have bytes that are no text.
    source = os.fsencode(name).decode(errors="backslashreplace")
    folder = pathlib.Path() if name == STDIN else pathlib.Path(name).parent
    form = body_form(name)
    if form is not None:
        origin: Origin = BodyFile(source, folder, {"body": {form: pathlib.PurePath(name).name}})
        return Drafts([Draft(origin, **options)], ())
    text = read_text(name, source)
    if not is_robot(name):
        return Drafts([Draft(of_text(text, source, folder), **options)], ())
    found = robot_drafts(text, source, folder, **options)
    if not found.each:
        message = "; ".join(["no link has a mass that is written", *found.notes])
        raise DocumentError([Problem(source, message)])
    return found


def robot_drafts(text: str, source: str, folder: pathlib.Path, **options: Any) -> Drafts:
    """The links of the robot in `text` that have a mass, or a problem. Raises DocumentError for no robot."""
    origins, notes = links(text, source, folder)
    return Drafts([Draft(origin, **options) for origin in origins], notes)


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
    return Draft(of_text(text, source, folder), **options).document()


def read(source: Source, exact: bool, settings: Sequence[str]) -> Document:
    """The document of a source. Raises DocumentError, and UsageError for a document with `settings`."""
    if isinstance(source, Document):
        if exact or settings:
            hint = "give `exact` and `settings` to `load`"
            raise UsageError("the document has been read already", hint=hint)
        return source
    if isinstance(source, Mapping):
        try:
            # JSON is YAML; numbers that are not finite become texts, which are refused where they stand.
            text = json.dumps(source, default=plain)
        except (TypeError, ValueError, RecursionError) as error:
            raise DocumentError([Problem(MAPPING, f"cannot be read: {error}")]) from None
        return loads(text, source=MAPPING, exact=exact, settings=settings)
    if isinstance(source, str) and _TEXT.search(source):
        return loads(source, exact=exact, settings=settings)
    return load(source, exact=exact, settings=settings)


def plain(value: Any) -> Any:
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


def _read(
    origin: Origin,
    exact: bool,
    positive: frozenset[str] = frozenset(),
    *,
    is_physical: bool = True,
    rest: Document | None = None,
) -> tuple[Document, set[str]]:
    """The document of a tree, and the symbols that make sense only as positive numbers.

    Those in `positive` are taken to be positive. It is looked at whether what is described can exist, if
    `is_physical`. The sections of the `rest` have been read. Raises DocumentError with all problems.
    """
    tree = origin.tree
    problems: list[ValueProblem] = []
    if rest is None:
        # A system alone keeps its expressions symbolic, and its numbers are floats.
        others = all(tree.get(key) is None for key in ("body", "top", "tide"))
        alone = tree.get("system") is not None and others
        n = arithmetic_for(exact and not alone)
        env = Environment(n, folder=origin.folder, exact_results=exact, top_keys=KEYS)
        parameters = tree.get("parameters")
        if isinstance(parameters, dict):
            problems += read_parameters(env, parameters, positive, has_time=_has_time(tree))
    else:
        env = rest.environment_again()
        tree = tree | {key: section for key, section in vars(rest).items() if isinstance(section, Section)}
    try:
        document = Document.model_validate(tree, context=env)
        if rest is not None:
            document.__dict__["physical"] = rest.physical.of(document)
        if is_physical and not problems and not env.faults:
            document.physical.require()
    except ValidationError as error:
        problems += explain(error)
    except ValueProblem as problem:
        problems.append(problem)
    problems += [fault.below("parameters", name) for name, fault in sorted(env.faults.items())]
    if problems:
        placed = [origin.problem(problem) for problem in problems if problem.code != UNSETTLED]
        raise DocumentError(sorted(placed, key=lambda problem: problem.line or 0))
    notes = list(dict.fromkeys(env.notes))
    if document.orbit is not None and document.system is not None and document.orbit.ensemble is None:
        notes += document.orbit.degrees_meant(document.system, origin.tree["orbit"]["initial"])
    notes += [f"parameter `{name}` is not used" for name in document.unused]
    return document.came_from(origin, notes), env.positive
