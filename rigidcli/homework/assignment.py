"""An assignment file -> items that are ready to judge answers, or everything that is wrong with it."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from rigidcli.document.draft import of_text
from rigidcli.document.slips import explain
from rigidcli.document.syntax import read_tree
from rigidcli.errors import DocumentError, Problem, guess, nearest, shown
from rigidcli.errors import Path as Keys
from rigidcli.fields.texts import STDIN, read_text, safe_name
from rigidcli.homework.answers import as_typed
from rigidcli.homework.base import Judgement, Outcome, Progress, Tell
from rigidcli.homework.hand_ins import HandIns, Paper, unnamed
from rigidcli.homework.judge import Item, run
from rigidcli.homework.keys import Library
from rigidcli.homework.overrides import Overrides
from rigidcli.homework.question import EVERYWHERE, Assignment, Question
from rigidcli.homework.roster import Roster
from rigidcli.homework.variants import Values, Variants, filled, in_braces, named_in, words

if TYPE_CHECKING:
    from rigidcli.homework.keys import Study
    from rigidcli.report import Report

NO_ROSTER = (
    "without a --roster, the name of a folder or file decides which values a student has: give the list of "
    "students with which the sheets were made"
)
NOT_IN_IT = "this student is not in the roster, and so the values of the questions are unknown"


@dataclass(frozen=True, slots=True)
class Prepared:
    """An assignment with its keys: `notes` on what in it does nothing, `files` that it reads.

    `solutions` are the reports, with their steps, that keys come from, by the names of the questions and the
    values of variants in words. With `variants`, the keys of `items` are those of their first values, and
    their titles are as they are written; `for_students` gives every student's own.
    """

    title: str
    source: str
    questions: dict[str, Question]
    items: dict[str, Item]
    library: Library
    notes: tuple[Problem, ...] = ()
    files: tuple[Path, ...] = ()
    solutions: dict[tuple[str, str], Report] = field(default_factory=dict)
    variants: Variants | None = None

    @property
    def worth(self) -> dict[str, float]:
        """The points of each question."""
        return {id: item.points for id, item in self.items.items()}

    def judged(
        self,
        handed_in: HandIns,
        roster: Roster | None,
        overrides: Overrides | None,
        jobs: int | None,
        tell: Tell,
        progress: Progress = lambda share: None,
    ) -> Iterator[Judgement]:
        """Judge what is handed in, in that order, with the scores of a person over those of the program.

        The keys of all students are worked out at once. `tell` gets the notes on files and students. Raises
        DocumentError where there is no key.
        """
        papers, own, notes = self.for_students(handed_in.papers, roster, progress)
        tell(self.source, notes)
        judgements = run(self.items, papers, jobs, progress, own=own)
        judgements = overrides.applied(judgements, tell) if overrides else judgements

        def told() -> Iterator[Judgement]:
            seen = list[Judgement]()
            for judgement in judgements:
                tell(judgement.source, judgement.notes)
                seen.append(replace(judgement, questions=()))
                yield judgement
            tell(self.source, unnamed(handed_in.others, seen))

        return told()

    def for_students(
        self, papers: Sequence[Paper], roster: Roster | None, progress: Progress = lambda share: None
    ) -> tuple[list[Paper], dict[str, Mapping[str, Item]], list[str]]:
        """The papers, the questions of the students who have their own, and notes on whose they are.

        Of a student who is not in the roster nobody knows the values: a person must look.
        Raises DocumentError where there is no key.
        """
        if self.variants is None:
            return [*papers], {}, []
        if roster is None:
            names = {paper.student: paper.student for paper in papers}
            return [*papers], self.own(names, progress), [NO_ROSTER]
        names, lost = roster.students, Outcome.review(NOT_IN_IT)
        known = [
            paper if paper.student in names else replace(paper, outcome=paper.outcome or lost)
            for paper in papers
        ]
        return known, self.own(names, progress), []

    def own(
        self, names: Mapping[str, str], progress: Progress = lambda share: None
    ) -> dict[str, Mapping[str, Item]]:
        """The questions of students with the values that follow from their `names`, by their labels.

        Raises DocumentError where there is no key.
        """
        assert self.variants is not None
        every = [self.variants.of(name) for name in names.values()]
        return dict(zip(names, self._at(every, progress), strict=True))

    def trials(self) -> Iterator[dict[str, Item]]:
        """The questions for a test of keys: as they are, or with three variants those that have any."""
        if self.variants is None:
            yield self.items
            return
        for number, items in enumerate(self._at(self.variants.trials(), lambda share: None)):
            yield {id: item for id, item in items.items() if not number or item.values}

    def _at(self, every: Sequence[Values], progress: Progress) -> list[dict[str, Item]]:
        """The questions for each of these values; keys are worked out once for equal values of a document."""
        sheets: list[dict[str, Item]] = [{} for _ in every]
        problems = dict[Problem, None]()
        ordered = sorted(self.questions.items(), key=lambda entry: entry[1].document or "")
        for done, (id, question) in enumerate(ordered):
            progress(done / len(ordered))
            if question.document != ordered[done - 1][1].document:
                self.library.reports.clear()  # nothing else asks the document before this one
            keyed: dict[str, tuple[Item, str, Report | None]] = {"": (self.items[id], "", None)}
            for values, sheet in zip(every, sheets, strict=True):
                own = self.library.own(question.document, values)
                try:
                    if words(own) not in keyed:
                        keyed[words(own)] = self.library.keyed(id, question, own)
                except DocumentError as error:
                    problems |= dict.fromkeys(error.problems)
                    continue
                item, _, report = keyed[words(own)]
                told = named_in(question.title, values) | own.keys()
                mine = {name: value for name, value in values.items() if name in told}
                # An answer in letters needs no values: who has them may put them in.
                in_letters = item.kind.options >= {"numbers", "momenta"} and question.numbers == "symbols"
                title = filled(question.title, values, {} if in_letters else own)
                sheet[id] = replace(item, title=title, values=mine)
                if report is not None:
                    self.solutions[id, words(mine)] = report
        if problems:
            raise DocumentError(list(problems))
        return [{id: sheet[id] for id in self.questions} for sheet in sheets]


def prepare(path: str, studies: Mapping[str, Study], text: str | None = None) -> Prepared:
    """Read an assignment, if its `text` is not read yet, and work out its keys by the `studies`.

    Raises DocumentError with all that is wrong with it, or with the documents that it names.
    """
    source = safe_name(path)
    text = read_text(path, source) if text is None else text
    tree, places = _tree(text, source), of_text(text, source)
    items, problems, notes = dict[str, Item](), list[Problem](), list[Problem]()
    solutions: dict[tuple[str, str], Report] = {}
    variants = None

    try:
        assignment = Assignment.model_validate(tree)
        title, questions = assignment.assignment, assignment.questions
        if assignment.variants:
            variants = Variants(str(assignment.seed), assignment.variants)
    except ValidationError as error:
        problems += [places.problem(each) for each in explain(error)]
        title, questions = "", _sound(tree.get("questions"))
    folder = Path() if path == STDIN else Path(path).parent
    library = Library(folder, studies, places, {} if variants is None else variants.trials()[0])
    for id, question in questions.items():
        try:
            items[id], name, report = library.keyed(id, question, library.first)
        except DocumentError as error:
            problems += [each for each in error.problems if each not in problems]
            continue
        said = [*_notes(question, items[id], name), *_braces(question, library)]
        notes += [library.placed(("questions", id, *keys), f"note: {what}") for keys, what in said]
        if report is not None:
            solutions[id, ""] = report
    if variants is not None:
        problems += _unfit(variants, questions, library)
    if problems:
        raise DocumentError(problems)
    read = [Path(path), *(library.folder / name for name in library.documents)]
    read += [file for document in library.documents.values() for file in document.files]
    title = title or Path(path).stem
    return Prepared(title, source, questions, items, library, tuple(notes), tuple(read), solutions, variants)


def _tree(text: str, source: str) -> dict[str, Any]:
    """The assignment as it is written; answers in it are texts, as they are in answer files."""
    tree, typed = read_tree(text, source), read_tree(text, source, typed=True)
    if not isinstance(tree, dict):
        read = "an empty file" if tree is None else shown(tree)
        hint = "`rigidcli new assignment` prints one to start from"
        raise DocumentError(
            [Problem(source, f"read {read}, expected an assignment: a mapping", 1, hint=hint)]
        )
    tree |= {key: typed[key] for key in ("seed", "variants") if key in tree}
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


# --- variants


def _braces(question: Question, library: Library) -> Iterator[tuple[Keys, str]]:
    """Names in braces in a title that do not do what one may expect of them, with its place."""
    variants, own = library.first, library.own(question.document, library.first)
    for name in sorted(named_in(question.title, variants) - own.keys()):
        yield ("title",), f"`{{{name}}}` differs from student to student, but the key does not depend on it"
    for name in in_braces(question.title) if variants else ():
        if name not in variants:
            stays = f"and so `{{{name}}}` stays as it is"
            yield ("title",), f"there is no variant `{name}`{guess(name, variants)}, {stays}"


def _unfit(variants: Variants, questions: Mapping[str, Question], library: Library) -> Iterator[Problem]:
    """Variants that no question uses, values that a document refuses, and literal answers with braces."""
    for id, question in questions.items():
        texts = (
            [question.answer, *(other.answer for other in question.accept)] if question.ask is None else []
        )
        for name in sorted(variants.values.keys() & in_braces(" ".join(map(as_typed, texts)))):
            message = f"`{{{name}}}` stands in a literal answer, which is the same for every student"
            hint = f"`ask` a `document` with the parameter `{name}`; the letter stands without braces"
            yield library.placed(("questions", id, "answer"), message, hint)
    asked = {each.document: None for each in questions.values() if each.document}
    there = [name for name in asked if name in library.documents]  # the others are refused by themselves
    for parameter in variants.values:
        documents = [name for name in there if library.own(name, {parameter: ""})]
        used = [name for name in documents if library.uses(name, parameter)]
        for name in used:
            yield from _refused(parameter, variants, name, library)
        if used or len(there) < len(asked):
            continue
        every = list(dict.fromkeys(each for name in there for each in library.parameters(name).values()))
        near = nearest(parameter, every)
        message, hint = f"no document of the questions has the parameter {shown(parameter)}", "leave it out"
        if documents:
            message = f"nothing in {', '.join(map(shown, documents))} uses this parameter"
        elif every:
            hint = f"did you mean `{near}`? " * bool(near) + f"there are {', '.join(every)}"
        yield library.placed(("variants", parameter), message, hint)


def _refused(parameter: str, variants: Variants, document: str, library: Library) -> Iterator[Problem]:
    """The values of a variant that a document refuses, where the others have their first values."""
    refused = list[tuple[Values, DocumentError]]()
    with contextlib.suppress(DocumentError):  # the problems of the first values stand in the list already
        library.document(document, library.own(document, library.first))
        for value in variants.values[parameter][1:]:
            values = library.own(document, {**library.first, parameter: value})
            try:
                library.document(document, values)
            except DocumentError as error:
                refused.append((values, error))
    if refused:
        yield library.refusal(document, *refused[0], more=len(refused) - 1)
