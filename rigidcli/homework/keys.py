"""Keys: what each question asks of a document, or gives as a literal, as an item that is ready to judge."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidcli.document.draft import Draft, put
from rigidcli.document.load import load, read
from rigidcli.document.parameters import read_name, read_names
from rigidcli.errors import DocumentError, Problem, RigidError, ValueProblem, nearest, shown
from rigidcli.errors import Path as Keys
from rigidcli.homework.answers import as_typed
from rigidcli.homework.base import Asked, Kind, Unreadable, sentence
from rigidcli.homework.judge import Accepted, Item, text_beside
from rigidcli.homework.kinds import KINDS, OF_SYMBOLS, kind_of
from rigidcli.homework.question import Question
from rigidcli.homework.variants import Values, raw_value, words

if TYPE_CHECKING:
    from rigidcli.document.document import Document
    from rigidcli.report import Report

    Study = Callable[[Document], Report]

DECIMALS = re.compile(r"[0-9]*\.(?:[0-9]{7,}|0(?![0-9]))(?:e[-+]?[0-9]+)?")
"""Numbers in a key that are shown in fewer digits, or without a decimal point."""


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
    short = DECIMALS.sub(lambda number: f"{float(number[0]):.6g}", as_typed(typed))
    reference = short if len(short) <= 500 else ""  # a longer key tells nobody anything
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
        text_of = partial(text_beside, folder / "assignment", None)
        value = asked.value if asked.path else kind.loaded(asked.value, text_of)
        return kind.key(replace(asked, value=value))
    except ValueProblem as problem:
        raise problem if problem.path else problem.below(*place) from None
    except Unreadable as unreadable:
        first = unreadable.findings[0]
        said = sentence(first)
        raise ValueProblem(said if first.place else f"the key: {said}", path=place) from None


# --- documents


@dataclass(frozen=True, slots=True)
class Library:
    """The documents of an assignment and the reports on them, which several questions may share.

    `places` has the lines of the assignment, and `first` are the first values of its variants. Documents in
    `documents` are as they stand in their files.
    """

    folder: Path
    studies: Mapping[str, Study]
    places: Draft
    first: Values = field(default_factory=dict)
    documents: dict[str, Document] = field(default_factory=dict)
    reports: dict[tuple[str, str, str], tuple[Document, Report]] = field(default_factory=dict)

    def keyed(self, id: str, question: Question, values: Values) -> tuple[Item, str, Report | None]:
        """A question with its key for these values of variants, the name of its kind, and its report.

        Raises DocumentError with what is wrong, and where in the assignment.
        """
        own: Values = {}
        try:
            own = self.own(question.document, values)
            asked, name = self._asked(id, question, own)
            return _item(KINDS[name], asked, self.folder), name, asked.report
        except DocumentError as error:
            if own:  # it is right as it stands in its file
                raise DocumentError([self.refusal(str(question.document), own, error)]) from None
            problem = self.placed(("questions", id, "document"), f"{shown(question.document)} is refused")
            raise DocumentError([problem, *error.problems]) from None
        except RigidError as error:
            message = f"{error.message}, with {words(own)}" if own else error.message
            keys: Keys = ("questions", id, *getattr(error, "path", ()))
            raise DocumentError([self.placed(keys, message, error.hint)]) from None

    def placed(self, keys: Keys, message: str, hint: str | None = None) -> Problem:
        """A problem at these keys of the assignment."""
        return self.places.problem(ValueProblem(message, path=keys, hint=hint))

    def refusal(self, name: str, values: Values, error: DocumentError, more: int = 0) -> Problem:
        """The problem of values that a document refuses; `more` values are refused beside these."""
        others = [parameter for parameter, value in values.items() if value != self.first[parameter]]
        problem = error.problems[0]
        reason = f"{problem.key}: {problem.message}" if problem.key else problem.message
        also = f", and {more} more of its values are refused" if more else ""
        message = f"{shown(name)} does not allow {words(values)}: {reason}{also}"
        hint = problem.hint or "leave this value out, or change the document"
        return self.placed(("variants", *others) if len(others) == 1 else ("variants",), message, hint)

    def own(self, document: str | None, values: Values) -> dict[str, str]:
        """Those of the values that a document has parameters for. Raises DocumentError."""
        declared = self.parameters(document) if document is not None and values else {}
        return {name: value for name, value in values.items() if _plain(name) in declared}

    def parameters(self, name: str) -> dict[str, str]:
        """The parameters of a document, each with its key as it is typed. Raises DocumentError."""
        tree = self.document(name, {}).reading.draft.tree
        return read_names(tree.get("parameters") or {}, has_time=False)[0]

    def uses(self, name: str, parameter: str) -> bool:
        """Whether something in a document uses a parameter."""
        return _plain(parameter) not in self.document(name, {}).unused

    def document(self, name: str, values: Values) -> Document:
        """A document with these values of its parameters. Raises DocumentError."""
        if name not in self.documents:
            self.documents[name] = load(self.folder / name)
        if not values:
            return self.documents[name]
        draft, spelling = self.documents[name].reading.draft, self.parameters(name)
        tree, changed = draft.tree, dict(draft.changed)
        for parameter, value in values.items():
            path = ("parameters", spelling[_plain(parameter)])
            tree, changed[path] = put(tree, path, raw_value(value))[0], "variants"
        return read(replace(draft, tree=tree, settings=(), changed=changed))

    def _report(self, name: str, study: str, values: Values) -> tuple[Document, Report]:
        """A document with these values, and what a study finds of it. Raises DocumentError."""
        key = name, study, words(values)
        if key not in self.reports:
            document = self.document(name, values)
            self.reports[key] = document, self.studies[study](document)
        return self.reports[key]

    def _asked(self, id: str, question: Question, values: Values) -> tuple[Asked, str]:
        """What a question asks for, and the name of its kind. Raises ValueProblem."""
        if question.ask is not None:
            return self._computed(id, question, question.ask, values)
        if question.kind is None:
            hint = f"a literal answer has one of {', '.join(KINDS)}"
            raise ValueProblem("missing, expected the kind of the `answer`", path=("kind",), hint=hint)
        return Asked(id, question, question.answer), question.kind

    def _computed(self, id: str, question: Question, ask: str, values: Values) -> tuple[Asked, str]:
        """What a document answers, and the name of its kind. Raises ValueProblem."""
        path = tuple(ask.split("."))
        study, way = path[0], path[1:]
        if study not in self.studies:
            hint = _known(study, self.studies)
            raise ValueProblem(f"there is no command {shown(study)}", path=("ask",), hint=hint)
        if question.document is None:
            raise ValueProblem("missing, expected the document that is asked", path=("document",))
        document, report = self._report(question.document, study, values)
        tree = report.tree
        value = _value_at(study, tree, way)
        names = ".".join(step for step in way if not step.isdecimal())  # a unit is that of all rows
        unit = next((unit for key, unit in report.units.items() if f"{names}.".startswith(f"{key}.")), "")
        name = question.kind or kind_of(path, value, unit)
        if name is None:
            hint = f"ask for one of {', '.join(_paths(ask, value))}"
            raise ValueProblem("this result is no single answer of any kind", path=("ask",), hint=hint)
        if document.system is not None and document.system.functions and name in OF_SYMBOLS:
            hint = "write a formula for each of `system.functions` into the document of the key"
            raise ValueProblem("answers with unknown functions cannot be judged", path=("ask",), hint=hint)
        return Asked(id, question, value, unit, path, document, report), name


def _plain(name: str) -> str:
    """The name of a variant in ASCII letters, as parameters of documents have it."""
    return read_name(name, has_time=False)


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
