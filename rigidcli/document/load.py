"""Reading: what is written -> a document, or all that is wrong with it, each problem with its line."""

from __future__ import annotations

import json
import os
import pathlib
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple, TypeAlias

from pydantic import ValidationError

from rigidcli.bodies.robots import is_robot
from rigidcli.document.document import Document, Reading
from rigidcli.document.draft import SWEEP, Draft, body_form, of_text, split_setting
from rigidcli.document.parameters import read_parameters
from rigidcli.errors import UNSETTLED, DocumentError, Path, Problem, UsageError, ValueProblem, shown
from rigidcli.fields.environment import Environment, arithmetic_for
from rigidcli.fields.section import Section
from rigidcli.fields.texts import STDIN, read_text
from rigidcli.fields.words import with_colon

Source: TypeAlias = Document | Mapping[str, Any] | str | os.PathLike[str]
"""A document, read already or not: what it says as a mapping, its text in YAML, or the path to its file."""

MAPPING = "<mapping>"
"""What messages call a document that was given as a mapping, which has no lines."""

KEYS = tuple(Document.model_fields)
"""The keys at the top of a document."""

APART = frozenset({"name", "description", "body", "axis", "frame", "motion", "top", "tide"})
"""Keys at the top that are read without another. Where only such keys are swept, all else is read once."""

MOST_LINKS = 1000
"""The most links of a robot, which take two seconds to read as documents; the largest robots have 200."""

_TEXT = re.compile(r"\n|:\s|\{")
"""What the text of a document has, and the path to a file has not."""


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
    folder = "" if name == STDIN else os.path.dirname(name)  # noqa: PTH120 - a Path takes ten times as long
    form = body_form(name)
    if form is not None:
        tree = {"body": {form: pathlib.PurePath(name).name}}
        return Drafts([Draft(source, tree, folder=folder, form=form, **options)], ())
    text = read_text(name, source)
    if not is_robot(name):
        return Drafts([of_text(text, source, folder, **options)], ())
    found = robot_drafts(text, source, folder, **options)
    if not found.each:
        message = "; ".join(["no link has a mass that is written", *found.notes])
        raise DocumentError([Problem(source, message)])
    return found


def robot_drafts(text: str, source: str, folder: str, **options: Any) -> Drafts:
    """The links of the robot in `text` that have a mass, or a problem. Raises DocumentError for no robot."""
    from rigidcli.bodies.robots import read_robot
    from rigidcli.bodies.robots.links import listed

    robot = read_robot(text, source, pathlib.Path(folder))
    if len(robot.links) > MOST_LINKS:
        problem = f"there are {len(robot.links):,} links, expected at most {MOST_LINKS:,}"
        raise DocumentError([Problem(source, problem)])
    found, without = [], dict[str, list[str]]()
    for link in robot.links:
        if link.without:
            without.setdefault(link.without, []).append(f"{link.name} (line {link.line})")
            continue
        lines: dict[Path, int] = {(): link.line, ("body",): link.line_of("inertia")}
        lines |= {("body", key): line for key, line in link.lines.items()}
        tree = {"name": link.name, "body": link.body}
        found.append(Draft(link.source, tree, text, lines, folder, link=link, **options))
    notes = [
        f"{len(names)} link{'s have' if len(names) > 1 else ' has'} {reason}: {listed(names)}"
        for reason, names in without.items()
    ]
    return Drafts(found, [*robot.notes, *notes])


def load(path: str | os.PathLike[str], **options: Any) -> Document:
    """Read the document in the file `path`; `-` is standard input.

    A file that is a body by itself, such as a table of points, stands for the document that has it as its
    body, and `settings` complete that; of a robot one link has a mass. The options are `exact`, `settings`
    and `options`: fields of a `Draft`. A document with a parameter that has no value is exact in any
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
    for draft in drafts(path, **options).each:
        try:
            found.append(read(draft))
        except DocumentError as error:
            problems += error.problems
    if problems:
        raise DocumentError(problems)
    return found


def loads(
    text: str, *, source: str = "<text>", folder: os.PathLike[str] | None = None, **options: Any
) -> Document:
    """Read the document in `text`, as `load` does; files that it names are looked for in `folder`."""
    return read(of_text(text, source, os.fspath(folder or ""), **options))


def read_source(source: Source, exact: bool, settings: Sequence[str]) -> Document:
    """The document of a source. Raises DocumentError, and UsageError for a document with `settings`."""
    if isinstance(source, Document):
        if exact or settings:
            hint = "give `exact` and `settings` to `load`"
            raise UsageError("the document has been read already", hint=hint)
        return source
    if isinstance(source, Mapping):
        try:
            # JSON is YAML; numbers that are not finite become texts, which are refused where they stand.
            text = json.dumps(source, default=plain, ensure_ascii=False)
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


def is_exact(draft: Draft, swept: Sequence[str]) -> bool:
    """Whether the document is worked exactly with these values swept. Raises as `load`."""
    return draft.exact or _settled(draft).changed_by(swept, SWEEP).has_symbols


def read(draft: Draft, swept: Sequence[str] = ()) -> Document:
    """The document with these values swept, texts `KEY=VALUE` of `--sweep`. Raises as `load`."""
    if draft.link is not None and draft.link.problem is not None:
        raise DocumentError([draft.link.problem])
    given = _settled(draft).changed_by(swept, SWEEP)
    if not isinstance(given.tree, dict):
        raise DocumentError([given.problem(_no_mapping(given.tree))])
    exact = given.exact or given.has_symbols
    if swept and not exact:
        return _document(given, exact, rest=_without(draft, *(text.partition("=")[0] for text in swept)))
    positive: frozenset[str] = frozenset()
    while True:
        document = _document(given, exact, positive)
        found = document.reading.environment.positive
        if found <= positive:
            break
        # Symbols that stand for masses and lengths are positive; knowing that, read once more.
        positive |= found
    if not given.has_symbols or (document.body is None and document.top is None):
        return document
    from rigidcli.document.trials import tried

    return tried(document, given, lambda tree: _document(replace(given, tree=tree), False, is_physical=False))


@lru_cache(maxsize=1)
def _settled(draft: Draft) -> Draft:
    """The draft with the values that are set, which all points of a sweep have in common."""
    return draft.changed_by(draft.settings)


@lru_cache(maxsize=1)
def _without(draft: Draft, *paths: str) -> Document | None:
    """The document without the keys at its top to which paths lead: what is the same at all points.

    None where it cannot be read without them; then each point is read whole, and tells what is wrong.
    """
    keys = {split_setting(f"{path}=")[0][0] for path in paths}
    with suppress(DocumentError):
        if keys <= APART:
            given = _settled(draft)
            tree = {key: value for key, value in given.tree.items() if key not in keys}
            return _document(replace(given, tree=tree), False, is_physical=False)
    return None


def _no_mapping(tree: object) -> ValueProblem:
    """The problem of what is no document at all."""
    if tree is None:
        hint: str | None = "`rigidcli new` prints a document to start from"
        return ValueProblem("read an empty document, expected a mapping", hint=hint)
    cure = with_colon(tree) if isinstance(tree, str) else None
    hint = cure and f"write `{cure}`"
    return ValueProblem(f"read {shown(tree)}, expected a mapping", hint=hint, typed=cure and str(tree))


def _document(
    draft: Draft,
    exact: bool,
    positive: frozenset[str] = frozenset(),
    *,
    is_physical: bool = True,
    rest: Document | None = None,
) -> Document:
    """The document of a draft, in which the symbols in `positive` are taken to be positive.

    It is looked at whether what is described can exist, if `is_physical`. The sections of the `rest` have
    been read. Raises DocumentError with all problems.
    """
    tree = draft.tree
    problems: list[ValueProblem] = []
    if rest is None:
        # A system alone keeps its expressions symbolic, and its numbers are floats.
        others = all(tree.get(key) is None for key in ("body", "top", "tide"))
        n = arithmetic_for(exact and not (others and tree.get("system") is not None))
        env = Environment(n, folder=draft.folder, exact_results=exact, top_keys=KEYS, positive={*positive})
        if isinstance(parameters := tree.get("parameters"), dict):
            torque = isinstance(motion := tree.get("motion"), dict) and motion.get("torque") is not None
            has_time = torque or any(tree.get(key) is not None for key in ("system", "orbit", "transform"))
            problems += read_parameters(env, parameters, has_time=has_time)
    else:
        env = rest.reading.environment.copied()
        tree = tree | {key: section for key, section in vars(rest).items() if isinstance(section, Section)}
    try:
        document = Document.model_validate(tree, context=env)
        document.came_from(Reading(draft, env), rest)
        if is_physical and not problems and not env.faults:
            document.physical.require()
    except ValidationError as error:
        from rigidcli.document.complaints import explain

        problems += explain(error)
    except ValueProblem as problem:
        problems.append(problem)
    problems += [fault.below("parameters", name) for name, fault in sorted(env.faults.items())]
    if problems:
        placed = [draft.problem(problem) for problem in problems if problem.code != UNSETTLED]
        raise DocumentError(sorted(placed, key=lambda problem: problem.line or 0))
    if document.orbit is not None and document.system is not None and document.orbit.ensemble is None:
        env.notes += document.orbit.degrees_meant(document.system, draft.tree["orbit"]["initial"])
    env.notes += [f"parameter `{name}` is not used" for name in document.unused]
    return document
