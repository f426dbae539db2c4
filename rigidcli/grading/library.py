"""The documents that questions ask, and what these answer."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidcli.document.load import load
from rigidcli.document.sampling import DEFAULT_TOLERANCE
from rigidcli.errors import ValueProblem, nearest, shown
from rigidcli.grading.asked import Asked
from rigidcli.grading.infer import kind_of
from rigidcli.grading.question import Question

if TYPE_CHECKING:
    from rigidcli.document.document import Document
    from rigidcli.report import Report, Value

    Study = Callable[[Document], Report]

DENSE = 20_001
"""Samples of a trajectory that others are compared with."""

COARSER = 100
"""By how much the tolerance of the second run is larger, which shows how far the first can be trusted."""

OF_SYMBOLS = ("expression", "equations", "matrix")
"""Kinds of answers with symbols. They are compared at points, where unknown functions have no values."""

FORMULA = "write a formula for each of `system.functions` into the document of the key"
"""What to do about unknown functions in a key."""


@dataclass(frozen=True, slots=True)
class Library:
    """The documents of an assignment and the reports on them, each worked out once."""

    folder: Path
    studies: Mapping[str, Study]
    documents: dict[str, Document] = field(default_factory=dict)
    reports: dict[tuple[str, str], Report] = field(default_factory=dict)

    @property
    def files(self) -> Iterator[Path]:
        """The documents, and the files that these name."""
        for name, document in self.documents.items():
            yield from (self.folder / name, *document.files)

    def document(self, name: str) -> Document:
        """The document in the file of this name. Raises DocumentError."""
        if name not in self.documents:
            self.documents[name] = load(self.folder / name)
        return self.documents[name]

    def report(self, name: str, study: str) -> Report:
        """What a study finds of that document."""
        if (name, study) not in self.reports:
            self.reports[name, study] = self._worked(study, self.document(name))
        return self.reports[name, study]

    def dense(self, name: str, study: str) -> tuple[Report, Report]:
        """The report with its trajectory at many instants, and one of a coarser calculation."""
        times = _trajectory(self.report(name, study))["t"]
        section = {"hamilton": "orbit", "euler": "motion"}[study]
        document = self.document(name)
        own = getattr(getattr(document, section), "tolerance", None)
        given = min(own or DEFAULT_TOLERANCE, DEFAULT_TOLERANCE)
        samples = max(DENSE, len(times))
        changes = {"duration": float(times[-1]), "samples": samples, "step": "null", "times": "null"}
        runs = []
        for tolerance in (given, COARSER * given):
            settings = [
                f"{section}.{key}={value}" for key, value in (changes | {"tolerance": tolerance}).items()
            ]
            runs.append(self._worked(study, load(self.folder / name, settings=settings)))
        return runs[0], runs[1]

    def _worked(self, study: str, document: Document) -> Report:
        with document.placing():
            return self.studies[study](document)


def _trajectory(report: Report) -> Mapping[str, Value]:
    tree = report.tree()
    found: Mapping[str, Value] | None = tree.get("orbit") or tree.get("trajectory")
    if found is None:
        raise ValueProblem("the document has no such trajectory", path=("ask",))
    return found


def asked_by(question: Question, library: Library) -> tuple[Asked, str]:
    """What is asked for, and the name of its kind. Raises ValueProblem."""
    if question.ask is not None:
        return _computed(question, question.ask, library)
    if question.document is not None:
        raise ValueProblem("a `document` is for `ask`; an `answer` stands by itself", path=("document",))
    if question.kind is None:
        raise ValueProblem("missing, expected the kind of the `answer`", path=("kind",))
    return Asked(question, question.answer), question.kind


def _computed(question: Question, ask: str, library: Library) -> tuple[Asked, str]:
    """What a document answers, and the name of its kind. Raises ValueProblem."""
    if question.document is None:
        raise ValueProblem("missing, expected the document that is asked", path=("document",))
    path = tuple(ask.split("."))
    study, way = path[0], path[1:]
    if study not in library.studies:
        raise ValueProblem(
            f"there is no command {shown(study)}", path=("ask",), hint=known(study, library.studies)
        )
    document, report = library.document(question.document), library.report(question.document, study)
    value = _found(report.tree(), way)
    keys = [".".join(way[:count]) for count in range(1, len(way) + 1)]
    unit = next((field.unit for field in report.fields if field.key in keys), "")
    name = question.kind or kind_of(path, value, unit)
    if name is None:
        hint = known("", value) if isinstance(value, Mapping) else None
        raise ValueProblem("this result is no single answer of any kind", path=("ask",), hint=hint)
    if document.system is not None and document.system.functions and name in OF_SYMBOLS:
        raise ValueProblem("answers with unknown functions cannot be judged", path=("ask",), hint=FORMULA)
    if name == "trajectory":
        report, second = library.dense(question.document, study)
        return Asked(question, _trajectory(report), unit, path, document, report, second), name
    return Asked(question, value, unit, path, document, report), name


def known(name: str, names: Iterable[str]) -> str:
    """A hint for a name that is none of these: the one that is near, or all of them."""
    near = nearest(name, list(names))
    return f"did you mean `{near}`?" if near else f"there are {', '.join(names)}"


def _found(tree: Any, way: Sequence[str]) -> Any:
    """The value in a tree of results; that of no way is the whole of it. Raises ValueProblem."""
    for step in way:
        if isinstance(tree, Mapping) and step in tree:
            tree = tree[step]
        elif isinstance(tree, Sequence | np.ndarray) and step.isdecimal() and int(step) < len(tree):
            tree = tree[int(step)]
        else:
            hint = known(step, tree) if isinstance(tree, Mapping) else None
            raise ValueProblem(f"there is no {shown(step)} in this result", path=("ask",), hint=hint)
    if tree is None:
        raise ValueProblem("this document has no such result: it is null", path=("ask",))
    return tree
