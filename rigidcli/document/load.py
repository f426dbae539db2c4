"""Reading: from the text of a file to a document, or to all of its problems, each with its line."""

from __future__ import annotations

import os
import pathlib
import random
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from decimal import Decimal
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from pydantic import ValidationError

from rigidcli.bodies.robots import is_robot
from rigidcli.core.arithmetic import FLOAT
from rigidcli.document.document import Document, places
from rigidcli.document.draft import SWEEP, Draft, body_form, names_in, of_text, split_setting
from rigidcli.errors import (
    UNSETTLED,
    ComputationError,
    DocumentError,
    Path,
    Problem,
    UsageError,
    ValueProblem,
    at,
    first_few,
    in_yaml,
    shown,
)
from rigidcli.fields.environment import BoundExpression, Environment, arithmetic_for
from rigidcli.fields.quantities import FULL_TURN
from rigidcli.fields.section import Section
from rigidcli.fields.texts import STDIN, read_text
from rigidcli.fields.words import keys_called, with_colon

if TYPE_CHECKING:
    from rigidcli.bodies.shapes import Shape

# A document that was read already, or a description: a mapping, a text in YAML, or the path to a file.
Source: TypeAlias = Document | Mapping[str, Any] | str | os.PathLike[str]
MAPPING = "<mapping>"  # the name of a document that was given as a mapping, in messages
TOP_KEYS = tuple(Document.model_fields)  # the keys at the top of a document
# Keys whose sections are read without the others: if only these are swept, the rest is read once.
SECTIONS_READ_ALONE = frozenset({"name", "description", "body", "axis", "frame", "motion", "top", "tide"})
# The most links of a robot, which take two seconds to read as documents; the largest robots have 200.
MOST_LINKS = 1000
# A mark of the text of a document, which the path to a file does not contain.
_TEXT = re.compile(r"\n|:\s|\{")


class Drafts(NamedTuple):
    """The drafts of all documents in a file, notes on the file, and a hint if it has no document."""

    each: Sequence[Draft]
    notes: Sequence[str]
    cure: str | None = None


def drafts(path: str | os.PathLike[str], settings: Sequence[str] = (), **options: Any) -> Drafts:
    """The drafts of the documents in a file; options as in `load`. Raises as `load`.

    A robot description has a document for each link, any other file is one document.
    """
    name = os.fspath(path)
    # The name of a file may contain bytes that are not text.
    source = os.fsencode(name).decode(errors="backslashreplace")
    folder = "" if name == STDIN else os.path.dirname(name)  # noqa: PTH120 - a Path takes ten times as long
    if (form := body_form(name)) is not None:
        tree = {"body": {form: pathlib.PurePath(name).name}}
        draft = Draft(source, tree, folder=folder, form=form, **options)
        return Drafts([draft.changed_by(settings)], ())
    text = read_text(name, source)
    if not is_robot(name):
        return Drafts([of_text(text, source, folder, settings, **options)], ())
    robot = robot_drafts(text, source, folder, settings, **options)
    if not robot.each:
        message = "; ".join(["no link has a mass that is written", *robot.notes])
        raise DocumentError([Problem(source, message, hint=robot.cure)])
    return robot


def robot_drafts(text: str, source: str, folder: str, settings: Sequence[str] = (), **options: Any) -> Drafts:
    """Drafts of the links that have a mass or a problem. Raises DocumentError where `text` is not a robot."""
    from rigidcli.bodies.composites import weighed
    from rigidcli.bodies.robot_formats import read_robot  # with expat

    robot = read_robot(text, source, pathlib.Path(folder))
    if len(robot.links) > MOST_LINKS:
        raise DocumentError([Problem(source, f"{len(robot.links):,} links, expected at most {MOST_LINKS:,}")])
    links, without = [], dict[str, list[str]]()
    for link in robot.links:
        if link.without:
            without.setdefault(link.without, []).append(f"{link.name} (line {link.line})")
            continue
        lines: dict[Path, int] = {(): link.line, ("body",): link.line_of("inertia")}
        lines |= {("body", key): line for key, line in link.lines.items()}
        tree = {"name": link.name, "body": link.body}
        draft = Draft(link.source, tree, text, lines, folder, link=link, **options)
        links.append(draft.changed_by(settings) if link.problem is None else draft)
    notes = [
        f"{len(names)} link{'s have' if len(names) > 1 else ' has'} {reason}: {first_few(names)}"
        for reason, names in without.items()
    ]
    masses = [link.body["mass"] for link in robot.links if link.body is not None and weighed(link.body)]
    if len(masses) > 1:
        notes.append(f"{len(masses)} links have a mass, {float(sum(masses)):.6g} kg in all")
    return Drafts(links, [*robot.notes, *notes], robot.cure)


def load(path: str | os.PathLike[str], **options: Any) -> Document:
    """Read the document in the file `path`; `-` is standard input.

    A table of points or a mesh is the document with that body, which `settings` complete, such as
    ["body.density=7850"]. A robot must have exactly one link with a mass. With `exact`, or with a parameter
    that has no value, decimals are rationals. A document with a system alone has floats for its numbers.

    Raises DocumentError with all problems, and UsageError for a setting that is not `KEY=VALUE`.
    """
    one, *others = load_all(path, **options)
    if others:
        message = f"there are {len(others) + 1} links with a mass, expected one"
        raise DocumentError([Problem(one.source, message, hint="`rigidcli.load_all` reads all of them")])
    return one


def load_all(path: str | os.PathLike[str], **options: Any) -> list[Document]:
    """The documents of a file: one for each link of a robot that has a mass, else a single one.

    Raises DocumentError with the problems of all links.
    """
    documents, problems = [], list[Problem]()
    for draft in drafts(path, **options).each:
        try:
            documents.append(read(draft))
        except DocumentError as error:
            problems += error.problems
    if problems:
        raise DocumentError(problems)
    return documents


def loads(
    text: str, *, source: str = "<text>", folder: os.PathLike[str] | None = None, **options: Any
) -> Document:
    """Read the document in `text`, as `load` does. Names of files in it are relative to `folder`."""
    return read(of_text(text, source, os.fspath(folder or ""), **options))


def read_source(source: Source, exact: bool, settings: Sequence[str]) -> Document:
    """The document of a source. Raises DocumentError, and UsageError for a document with `settings`."""
    if isinstance(source, Document):
        if exact or settings:
            hint = "give `exact` and `settings` to `load`"
            raise UsageError("the document has been read already", hint=hint)
        return source
    if isinstance(source, Mapping):
        import json

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
    """The value with arrays as lists; exact expressions, fractions and paths become text."""
    if hasattr(value, "tolist"):
        return value.tolist()
    return dict(value) if isinstance(value, Mapping) else str(value)


def is_exact(draft: Draft, swept: Sequence[str]) -> bool:
    """Whether the document with these swept values is computed exactly. Raises as `load`."""
    return draft.exact or draft.changed_by(swept, SWEEP).has_symbols


def read(draft: Draft, swept: Sequence[str] = ()) -> Document:
    """The document with these swept values, which are texts `KEY=VALUE`. Raises as `load`."""
    if draft.link is not None and draft.link.problem is not None:
        raise DocumentError([draft.link.problem])
    given = draft.changed_by(swept, SWEEP)
    if not isinstance(given.tree, dict):
        raise DocumentError([_no_mapping(given)])
    exact = given.exact or given.has_symbols
    if swept and not exact:
        rest = _without(draft, *(text.partition("=")[0] for text in swept))
        if rest is None:
            return _document(given, exact)
        kept = {key: own for key, own in vars(rest).items() if key in given.tree and isinstance(own, Section)}
        return _validated(given, given.tree | kept, rest.environment.copied(), [], rest)
    document = _document(given, exact)
    if not given.has_symbols or (document.body is None and document.top is None):
        return document
    return tried(document, given)


@lru_cache(maxsize=1)
def _without(draft: Draft, *paths: str) -> Document | None:
    """The document without the swept keys at its top, which is the same at all points.

    None where it cannot be read without them. Then each point is read as a whole, and reports its problems.
    """
    keys = {split_setting(f"{path}=")[0][0] for path in paths}
    with suppress(DocumentError):
        if keys <= SECTIONS_READ_ALONE:
            tree = {key: value for key, value in draft.tree.items() if key not in keys}
            return _document(replace(draft, tree=tree), False, is_physical=False)
    return None


def _no_mapping(draft: Draft) -> Problem:
    from rigidcli.document.slips import TO_BEGIN

    tree, hint, cure = draft.tree, TO_BEGIN, None
    if isinstance(tree, list) and all(isinstance(entry, dict) for entry in tree):
        hint = "the keys of a document begin without dashes"
    elif heading := re.search(r"^\[(\w+)\]\s*$", draft.text, re.MULTILINE):  # of TOML or INI
        hint = f"write `{heading[1]}:` for `{heading[0].strip()}`, with `key: value` for `key = value` below"
    elif isinstance(tree, str) and (cure := with_colon(tree)):
        hint = f"write `{cure}`"
    read = "an empty document" if tree is None else shown(tree)
    message = f"read {read}, expected a mapping"
    return draft.problem(ValueProblem(message, hint=hint, typed=str(tree) if cure else None))


def _document(draft: Draft, exact: bool, *, is_physical: bool = True) -> Document:
    """The document of a draft. If `is_physical`, a body or a top that cannot exist is refused.

    Raises DocumentError with all problems.
    """
    tree, parameters, problems = _with_parameters(draft.tree)
    # A system alone keeps its expressions symbolic, and its numbers are floats.
    is_alone = all(tree.get(key) is None for key in ("body", "top", "tide"))
    n = arithmetic_for(exact and not (is_alone and tree.get("system") is not None))
    env = Environment(n, folder=draft.folder, exact_results=exact, places=places)
    if parameters is not None:
        from rigidcli.document.parameters import read_parameters

        torque = isinstance(motion := tree.get("motion"), dict) and motion.get("torque") is not None
        has_time = torque or any(tree.get(key) is not None for key in ("system", "orbit", "transform"))
        problems += read_parameters(env, parameters, has_time=has_time)
    return _validated(draft, tree, env, problems, is_physical=is_physical)


def _with_parameters(tree: Mapping[str, Any]) -> tuple[Mapping[str, Any], Any, list[ValueProblem]]:
    """The tree, and its parameters, also those that are refused where they stand: so their names are known.

    They may stand in a section, or under a word such as `constants`, which the section refuses. Numbers that
    stand at the top, or in the system, are taken out of the tree; with them come their problems.
    """
    above = [tree, *(section for section in tree.values() if isinstance(section, dict))]
    parameters = next((section["parameters"] for section in above if "parameters" in section), None)
    if parameters is None and not tree.keys() <= {*TOP_KEYS}:
        parameters = next((tree[key] for key in tree if "parameters" in keys_called(key)), None)
    problems = list[ValueProblem]()
    for path, section in ((), tree), (("system",), tree.get("system")):
        if not isinstance(section, dict):
            continue
        unknown = section.keys() - TOP_KEYS
        names = names_in(tree) if unknown else set[str]()
        strays = {key for key in unknown & names if re.match(r"[-+.\d]|None$", str(section[key]))}
        if strays and isinstance(parameters, dict | None) and strays.isdisjoint(parameters or ()):
            moved = {key: value for key, value in section.items() if key in strays}
            parameters = {**(parameters or {}), **moved}
            for key, value in moved.items():
                hint = f"write `parameters: {in_yaml({key: value})}`"
                problems.append(ValueProblem("belongs inside `parameters`", path=(*path, key), hint=hint))
            rest = {key: value for key, value in section.items() if key not in strays}
            tree = {**tree, "system": rest} if path else rest
    return tree, parameters, problems


def _validated(
    draft: Draft,
    tree: Mapping[str, Any],
    env: Environment,
    problems: list[ValueProblem],
    rest: Document | None = None,
    *,
    is_physical: bool = True,
) -> Document:
    """The document of a tree. Raises DocumentError with the `problems` so far and all further ones."""
    try:
        document = Document.model_validate(tree, context=env)
        document.keep(draft=draft, environment=env)
        if rest is not None:
            document.keep(physical=rest.physical.of(vars(document)))
        if is_physical and not problems and not env.log.faults:
            document.physical.require()
    except ValidationError as error:
        from rigidcli.document.slips import explain

        problems += explain(error)
    except ValueProblem as problem:
        problems.append(problem)
    problems += [fault.below("parameters", name) for name, fault in sorted(env.log.faults.items())]
    if problems:
        raise _refusal(draft, problems)
    if document.orbit is not None and document.system is not None and document.orbit.ensemble is None:
        for name, value in draft.tree["orbit"]["initial"].items():
            is_bare = name in document.system.angles and isinstance(value, int | float | Decimal)
            if is_bare and abs(value) > FULL_TURN:
                place = f"`orbit.initial.{name}` of {value} rad"
                env.log.note(f"{place} is beyond a full turn; {value} deg meant?")
    env.log.note(*(f"parameter `{name}` is not used" for name in (document.unused if is_physical else ())))
    return document


def _refusal(draft: Draft, problems: Sequence[ValueProblem]) -> DocumentError:
    # Problems come in the order of their lines; those of one key stay together.
    placed = [draft.problem(problem) for problem in problems if problem.code != UNSETTLED]
    first = {problem.key: -place for place, problem in enumerate(reversed(placed))}
    is_file = draft.form is not None  # what is wrong in a file comes before what is not set beside it

    def place(problem: Problem) -> tuple[bool, int, int]:
        return is_file and bool(problem.key), problem.line or 0, first[problem.key]

    return DocumentError(sorted(placed, key=place))


# --- documents with symbols


# Trials with values: a body that exists for one in ten is refused by chance in 0.9^30 = 4 % of cases.
SETS_OF_TRIAL_VALUES = 30
# With more symbols, trials may miss the values that allow a body: then a note replaces the refusal.
MOST_SYMBOLS = 3


def tried(document: Document, draft: Draft) -> Document:
    """The document of a draft, with notes on checks that fail for some positive values of its symbols.

    Raises DocumentError if all values fail. Notes and problems name the check that fails, and no values.
    """
    parameters = draft.tree["parameters"]
    symbols = [name for name, value in parameters.items() if value is None]
    chance = random.Random(" ".join(symbols))  # noqa: S311 - the same trials for the same document
    failed: Counter[tuple[str, str]] = Counter()
    for _ in range(SETS_OF_TRIAL_VALUES):
        values = {name: 10 ** chance.uniform(-2, 2) for name in symbols}
        with_values = replace(draft, tree={**draft.tree, "parameters": {**parameters, **values}})
        try:
            _require_physical(_document(with_values, False, is_physical=False))
        except DocumentError as error:
            failed.update({(problem.key, _check(problem.message)) for problem in error.problems})
        except ValueProblem as problem:
            failed[".".join(map(str, problem.path)), _check(problem.message)] += 1
        except ComputationError:
            continue
    used = [name for name in symbols if name not in document.unused]
    names = f"positive values of {', '.join(f'`{name}`' for name in used)} that were tried"
    never = [place for place, count in failed.items() if count == SETS_OF_TRIAL_VALUES]
    if never and len(used) <= MOST_SYMBOLS:
        raise DocumentError([document.problem(f"for all {names}: {check}", key) for key, check in never])
    # That some numbers of radians are no angle of a tilt says nothing of the letter.
    failed = Counter({each: n for each, n in failed.items() if "expected an angle" not in each[1]})
    checks = [f"{key}: {check}".removeprefix(": ") for key, check in failed]
    if len(checks) > 1:
        document.environment.log.note(f"for {names}: {'; '.join(checks)}")
    for (key, check), count in failed.items() if len(checks) == 1 else ():
        amount = "all" if count == SETS_OF_TRIAL_VALUES else "some"
        document.environment.log.note(f"{key}: for {amount} {names}: {check}".removeprefix(": "))
    return document


def _require_physical(document: Document) -> None:
    # Densities are sampled, and not integrated.
    varying = [shape for shape in _shapes(document.body) if isinstance(shape.density, BoundExpression)]
    for shape in varying:
        from rigidcli.bodies.density_integrals import looked_at

        with at("body"):
            looked_at(shape.density, shape.maps(FLOAT), shape.UNIT, is_searched=False)
    if not varying:
        document.physical.require()


def _shapes(body: object) -> Iterator[Shape]:
    from rigidcli.bodies.composites import Composite
    from rigidcli.bodies.shapes import Shape

    for part in body.parts if isinstance(body, Composite) else ():
        yield from _shapes(part)
    if isinstance(body, Shape):
        yield body


_TRIAL_NUMBER = re.compile(r" = -?\d[^;,]*$")  # the value of a limit at the end of a message, with its unit


def _check(message: str) -> str:
    expected = message.partition("expected ")[2]
    if message.startswith("read ") and expected:
        return f"expected {_TRIAL_NUMBER.sub('', expected)}"
    return re.split(r"[:(]| by up to|,? -?\d", message)[0].strip()
