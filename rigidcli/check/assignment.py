"""An assignment file -> items that are ready to judge answers, or everything that is wrong with it."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from rigidcli.check.answers import as_typed
from rigidcli.check.base import Asked, Kind, Unreadable, sentence
from rigidcli.check.judge import Accepted, Item, with_table
from rigidcli.check.kinds import KINDS
from rigidcli.check.question import EVERYWHERE, Assignment, Question
from rigidcli.document.complaints import explain
from rigidcli.document.draft import of_text
from rigidcli.document.load import load
from rigidcli.document.syntax import read_tree
from rigidcli.errors import DocumentError, Problem, RigidError, ValueProblem, nearest, shown
from rigidcli.errors import Path as Keys
from rigidcli.fields.texts import STDIN, read_text

if TYPE_CHECKING:
    from rigidcli.document.document import Document
    from rigidcli.report import Report

    Study = Callable[[Document], Report]

DECIMALS = re.compile(r"[0-9]*\.(?:[0-9]{7,}|0(?![0-9]))(?:e[-+]?[0-9]+)?")
"""Numbers in a key that are shown in fewer digits, or without a decimal point."""

KIND_BY_NAME = {
    "axes": "axes",
    "moments": "moments",
    "tensor": "tensor",
    "tensor_com": "tensor",
    "cyclic": "choice",
    "conserved": "choice",
    "equations": "equations",
}
"""Kinds of results by the last name of their path."""

MOTIONS = ("orbit", "trajectory")
"""Results that are tables in time."""

OF_SYMBOLS = ("expression", "equations", "matrix")
"""Kinds of answers with symbols, which are compared by values: unknown functions have none."""


@dataclass(frozen=True, slots=True)
class Prepared:
    """An assignment with its keys: `notes` on what in it does nothing, `files` that it reads.

    `solutions` are the reports, with their steps, that keys come from, by the names of the questions.
    """

    title: str
    source: str
    questions: dict[str, Question]
    items: dict[str, Item]
    notes: tuple[Problem, ...] = ()
    files: tuple[Path, ...] = ()
    solutions: Mapping[str, Report] = field(default_factory=dict)

    @property
    def worth(self) -> dict[str, float]:
        """The points of each question."""
        return {id: item.points for id, item in self.items.items()}


def prepare(path: str, studies: Mapping[str, Study], text: str | None = None) -> Prepared:
    """Read an assignment, if its `text` is not read yet, and work out its keys by the `studies`.

    Raises DocumentError with all that is wrong with it, or with the documents that it names.
    """
    source = os.fsencode(path).decode(errors="backslashreplace")
    text = read_text(path, source) if text is None else text
    tree, places = _tree(text, source), of_text(text, source)
    items, problems, notes = dict[str, Item](), list[Problem](), list[Problem]()
    solutions: dict[str, Report] = {}

    def placed(keys: Keys, message: str, hint: str | None = None) -> Problem:
        return places.problem(ValueProblem(message, path=keys, hint=hint))

    try:
        assignment = Assignment.model_validate(tree)
        title, questions = assignment.assignment, assignment.questions
    except ValidationError as error:
        problems += [placed(each.path, each.message, each.hint) for each in explain(error)]
        title, questions = "", _sound(tree.get("questions"))
    library = _Library(Path() if path == STDIN else Path(path).parent, studies)
    for id, question in questions.items():
        try:
            asked, name = library.asked(id, question)
            items[id] = _item(KINDS[name], asked, library.folder)
            if asked.report is not None:
                solutions[id] = asked.report
            notes += [
                placed(("questions", id, *keys), f"note: {what}")
                for keys, what in _notes(question, items[id], name)
            ]
        except DocumentError as error:
            problems.append(placed(("questions", id, "document"), f"{shown(question.document)} is refused"))
            problems += [each for each in error.problems if each not in problems]
        except RigidError as error:
            keys: Keys = ("questions", id, *getattr(error, "path", ()))
            problems.append(placed(keys, error.message, error.hint))
    if problems:
        raise DocumentError(problems)
    read = [Path(path), *(library.folder / name for name in library.documents)]
    read += [file for document in library.documents.values() for file in document.files]
    title = title or Path(path).stem
    return Prepared(title, source, questions, items, tuple(notes), tuple(read), solutions)


def _tree(text: str, source: str) -> dict[str, Any]:
    """The assignment as it is written; answers in it are texts, as they are in answer files."""
    tree, typed = read_tree(text, source), read_tree(text, source, typed=True)
    if not isinstance(tree, dict):
        read = "an empty file" if tree is None else shown(tree)
        hint = "`rigidcli new assignment` prints one to start from"
        raise DocumentError(
            [Problem(source, f"read {read}, expected an assignment: a mapping", 1, hint=hint)]
        )
    questions = tree.get("questions")
    for id, question in questions.items() if isinstance(questions, dict) else ():
        _keep_typed(question, typed["questions"][id])
    return tree


def _keep_typed(question: Any, typed: Any) -> None:
    """Put the answers of a question, and those that it accepts, as they are typed."""
    if isinstance(question, dict):
        if "answer" in question:
            question["answer"] = typed["answer"]
        if isinstance(accepted := question.get("accept"), list):
            for other, as_it_is in zip(accepted, typed["accept"], strict=True):
                _keep_typed(other, as_it_is)


def _sound(questions: object) -> dict[str, Question]:
    """The questions that are well-formed, where others are not, so that all problems are listed at once."""
    sound = {}
    for id, question in questions.items() if isinstance(questions, dict) else ():
        with contextlib.suppress(ValidationError):
            sound[id] = Question.model_validate(question)
    return sound


def _notes(question: Question, item: Item, name: str) -> Iterator[tuple[Keys, str]]:
    """What in a question does nothing, or is probably not meant, with its place."""
    for option in sorted(question.model_fields_set - EVERYWHERE - item.kind.options):
        yield (option,), f"this means nothing to the kind `{name}`"
    if (question.tolerance.relative or 0.0) > 0.2:  # it may be meant in per cent
        share = f"{question.tolerance.relative:.0%}"
        yield ("tolerance", "relative"), f"it is {share} of the value: per cent meant?"


# --- keys


def _item(kind: Kind, asked: Asked, folder: Path) -> Item:
    """A question with its keys. Raises ValueProblem."""
    question = asked.question
    key = _key(kind, asked, folder, "ask" if asked.path else "answer")
    accepted = []
    for place, other in enumerate(question.accept):
        also = replace(asked, value=other.answer, unit="", path=(), document=None, report=None)
        key_of_it = _key(kind, also, folder, "accept", place, "answer")
        accepted.append(Accepted(key_of_it, other.credit, other.message))
    typed = kind.typed(key)
    words = DECIMALS.sub(lambda number: f"{float(number[0]):.6g}", as_typed(typed))
    reference = words if len(words) <= 500 else ""  # a longer key tells nobody anything
    changes = tuple(_changes(kind, asked, key, typed))
    return Item(
        kind, key, question.points, question.title, reference, question.credit, tuple(accepted), changes
    )


def _changes(kind: Kind, asked: Asked, key: Any, typed: Any) -> Iterator[tuple[str, Any]]:
    """The keys of mistaken problems, without those by which the right answer is right as well."""
    right = kind.read(key, typed).value
    for code, changed in kind.mistaken(asked, key):
        with contextlib.suppress(Unreadable, ArithmeticError, ValueError):
            if not kind.is_right(changed, right):
                yield code, changed


def _key(kind: Kind, asked: Asked, folder: Path, *place: str | int) -> Any:
    """A key. Raises ValueProblem."""
    try:
        value = asked.value if asked.path else with_table(kind, asked.value, folder / "assignment")
        return kind.key(replace(asked, value=value))
    except ValueProblem as problem:
        raise problem if problem.path else problem.below(*place) from None
    except Unreadable as unreadable:
        first = unreadable.findings[0]
        words = sentence(first)
        raise ValueProblem(words if first.place else f"the key: {words}", path=place) from None


# --- documents


@dataclass(frozen=True, slots=True)
class _Library:
    """The documents of an assignment and the reports on them, which several questions may share."""

    folder: Path
    studies: Mapping[str, Study]
    documents: dict[str, Document] = field(default_factory=dict)
    reports: dict[tuple[str, str], Report] = field(default_factory=dict)

    def _report(self, name: str, study: str) -> tuple[Document, Report]:
        """A document, and what a study finds of it. Raises DocumentError."""
        if name not in self.documents:
            self.documents[name] = load(self.folder / name)
        document = self.documents[name]
        if (name, study) not in self.reports:
            self.reports[name, study] = self.studies[study](document)
        return document, self.reports[name, study]

    def asked(self, id: str, question: Question) -> tuple[Asked, str]:
        """What a question asks for, and the name of its kind. Raises ValueProblem."""
        if question.ask is not None:
            return self._computed(id, question, question.ask)
        if question.kind is None:
            hint = f"a literal answer has one of {', '.join(KINDS)}"
            raise ValueProblem("missing, expected the kind of the `answer`", path=("kind",), hint=hint)
        return Asked(id, question, question.answer), question.kind

    def _computed(self, id: str, question: Question, ask: str) -> tuple[Asked, str]:
        """What a document answers, and the name of its kind. Raises ValueProblem."""
        path = tuple(ask.split("."))
        study, way = path[0], path[1:]
        if study not in self.studies:
            hint = _known(study, self.studies)
            raise ValueProblem(f"there is no command {shown(study)}", path=("ask",), hint=hint)
        if question.document is None:
            raise ValueProblem("missing, expected the document that is asked", path=("document",))
        document, report = self._report(question.document, study)
        tree = report.tree()
        value = _value_at(study, tree, way)
        names = ".".join(step for step in way if not step.isdecimal())  # a unit is that of all rows
        unit = next((unit for key, unit in report.units.items() if f"{names}.".startswith(f"{key}.")), "")
        name = question.kind or _kind_of(path, value, unit)
        if name is None:
            hint = f"ask for one of {', '.join(_paths(ask, value))}"
            raise ValueProblem("this result is no single answer of any kind", path=("ask",), hint=hint)
        if document.system is not None and document.system.functions and name in OF_SYMBOLS:
            hint = "write a formula for each of `system.functions` into the document of the key"
            raise ValueProblem("answers with unknown functions cannot be judged", path=("ask",), hint=hint)
        return Asked(id, question, value, unit, path, document, report), name


def _kind_of(path: tuple[str, ...], value: Any, unit: str) -> str | None:
    """The kind of a result; None where it is no single answer."""
    from rigidcli.algebra.expressions import Expr

    is_scalar = isinstance(value, bool | int | float | str | np.generic)
    if path[1:2] and path[1] in MOTIONS and not is_scalar:
        return "trajectory"
    if path[-1] in KIND_BY_NAME:
        return KIND_BY_NAME[path[-1]]
    if isinstance(value, bool | np.bool_ | str):
        return "choice"
    if is_scalar:
        return "quantity" if unit else "number"
    if isinstance(value, Expr):
        return "expression"
    if isinstance(value, Mapping):
        return None
    return {1: "vector", 2: "matrix"}.get(np.ndim(np.array(value, dtype=object)))


def _value_at(ask: str, tree: Any, way: Sequence[str]) -> Any:
    """The value at the end of a way in a tree of results. Raises ValueProblem, which lists the ways."""
    for step in way:
        if isinstance(tree, Mapping) and step in tree:
            tree = tree[step]
        elif isinstance(tree, Sequence | np.ndarray) and step.isdecimal() and int(step) < len(tree):
            tree = tree[int(step)]
        else:
            paths = _paths(ask, tree)
            hint = _known(f"{ask}.{step}", paths) if paths else f"`{ask}` is a result, and has no parts"
            raise ValueProblem(f"there is no {shown(step)} in this result", path=("ask",), hint=hint)
        ask = f"{ask}.{step}"
    if tree is None:
        raise ValueProblem("this document has no such result: it is null", path=("ask",))
    return tree


def _paths(ask: str, tree: Any) -> list[str]:
    """The paths of the results one step below a path."""
    if isinstance(tree, Mapping):
        return [f"{ask}.{key}" for key, value in tree.items() if value is not None and key != "schema"]
    if isinstance(tree, Sequence | np.ndarray) and not isinstance(tree, str):
        return [f"{ask}.{place}" for place in range(len(tree))]
    return []


def _known(name: str, names: Iterable[str]) -> str:
    """A hint for a name that is none of these: the one that is near, and all of them."""
    near = nearest(name, list(names))
    return f"did you mean `{near}`? " * bool(near) + f"there are {', '.join(names)}"
