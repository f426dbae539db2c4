"""An assignment file -> items that are ready to judge answers, or everything that is wrong with it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from pydantic import ValidationError

from rigidcli.document.document import Document
from rigidcli.document.draft import Draft
from rigidcli.document.load import load, read
from rigidcli.document.parameters import read_name, read_names
from rigidcli.document.slips import explain
from rigidcli.document.yaml_reader import is_title, read_tree
from rigidcli.errors import DocumentError, Problem, RigidError, ValueProblem, shown
from rigidcli.errors import Path as Keys
from rigidcli.fields.texts import STDIN, read_text, safe_name
from rigidcli.homework.answers import as_typed
from rigidcli.homework.base import AnswerKind, Judgement, KeySource, Progress, Tell, Unreadable, sentence
from rigidcli.homework.hand_ins import HandIns
from rigidcli.homework.judge import Item, run, text_beside
from rigidcli.homework.kinds import KINDS, OF_SYMBOLS, kind_of
from rigidcli.homework.overrides import Overrides
from rigidcli.homework.owner import noted
from rigidcli.homework.question import EVERYWHERE, Assignment, Question
from rigidcli.homework.roster import Roster
from rigidcli.homework.variants import NAME_IN_BRACES, Values, Variants, filled, named_in, words
from rigidcli.report import Report
from rigidcli.suggestions import did_you_mean, guess

Study: TypeAlias = Callable[[Document], Report]

# Decimals in a key that feedback rounds to six figures: 0.04166666667, 2.0.
DECIMALS = re.compile(r"[0-9]*\.(?:[0-9]{7,}|0(?![0-9]))(?:e[-+]?[0-9]+)?")

LONGEST_REFERENCE = 500  # characters of a key in feedback: a longer one tells nobody anything

NO_ROSTER = (
    "without a --roster, the name of a folder or file decides which values a student has: give the list of "
    "students with which the sheets were made"
)


@dataclass(frozen=True, slots=True)
class Prepared:
    """An assignment with its keys: `notes` on what in it does nothing, `files` that it reads.

    With `variants`, the keys of `items` are those of their first values, and their titles are as they are
    written; `own` gives every student's.
    """

    title: str
    source: str
    questions: dict[str, Question]
    items: dict[str, Item]
    library: Library
    notes: tuple[Problem, ...] = ()
    files: tuple[Path, ...] = ()
    variants: Variants | None = None

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
        own = None
        if self.variants is not None:
            if roster is None:
                tell(self.source, [NO_ROSTER])
            named = {paper.student: paper.student for paper in handed_in.papers}
            own = self.own(named if roster is None else roster.students, progress)
        judgements = run(self.items, handed_in.papers, jobs, progress, own=own)
        judgements = overrides.applied(judgements, tell) if overrides else judgements

        def told() -> Iterator[Judgement]:
            named = set[str]()
            for judgement in judgements:
                tell(judgement.source, judgement.notes)
                named.update(judgement.beside)
                yield judgement
            others = [each.short for each in handed_in.others if each.source not in named]
            tell(self.source, noted("no answer files, and left out", others))

        return told()

    def own(self, names: Mapping[str, str], progress: Progress) -> dict[str, Mapping[str, Item]]:
        """The questions of students with the values that follow from their `names`, by their labels.

        Raises DocumentError where there is no key.
        """
        assert self.variants is not None
        every = [self.variants.of(name) for name in names.values()]
        return dict(zip(names, self._at(every, progress), strict=True))

    def trials(self) -> Iterator[dict[str, Item]]:
        """The questions for a test of keys: as they are, or with three variants those that have any."""
        sheets = self._at(self.variants.trials()) if self.variants else [self.items]
        for number, items in enumerate(sheets):
            yield {id: item for id, item in items.items() if not number or item.values}

    def _at(self, every: Sequence[Values], progress: Progress = lambda share: None) -> list[dict[str, Item]]:
        """The questions for each of these values."""
        sheets: list[dict[str, Item]] = [{} for _ in every]
        problems = dict[Problem, None]()
        for done, (id, question) in enumerate(self.questions.items()):
            progress(done / len(self.questions))
            for values, sheet in zip(every, sheets, strict=True):
                try:
                    item, own = self.library.keyed(id, question, values)
                except DocumentError as error:
                    problems |= dict.fromkeys(error.problems)
                    continue
                told = named_in(question.title, values) | own.keys()
                mine = {name: value for name, value in values.items() if name in told}
                # An answer in letters needs no values: who has them may put them in.
                in_letters = item.kind.options >= {"numbers", "momenta"} and question.numbers == "symbols"
                title = filled(question.title, values, {} if in_letters else own)
                sheet[id] = replace(item, title=title, values=mine)
        if problems:
            raise DocumentError(list(problems))
        return sheets


def prepare(path: str, studies: Mapping[str, Study], text: str | None = None) -> Prepared:
    """Read an assignment, if its `text` is not read yet, and work out its keys by the `studies`.

    Raises DocumentError with all that is wrong with it, or with the documents that it names.
    """
    source = safe_name(path)
    text = read_text(path, source) if text is None else text
    tree, places = _tree(text, source)
    items, problems, notes = dict[str, Item](), list[Problem](), list[Problem]()
    title, variants = "", None
    try:
        assignment = Assignment.model_validate(tree)
        title, questions = assignment.assignment, assignment.questions
        if assignment.variants:
            variants = Variants(str(assignment.seed), assignment.variants)
    except ValidationError as error:
        problems += [places.problem(each) for each in explain(error)]
        # The well-formed questions are read all the same, so that all problems are listed at once.
        questions, typed = {}, tree.get("questions")
        for id, question in typed.items() if isinstance(typed, dict) else ():
            with suppress(ValidationError):
                questions[id] = Question.model_validate(question)
    folder = Path() if path == STDIN else Path(path).parent
    library = Library(folder, studies, places, {} if variants is None else variants.trials()[0])
    for id, question in questions.items():
        try:
            items[id], _ = library.keyed(id, question, library.first)
        except DocumentError as error:
            problems += [each for each in error.problems if each not in problems]
            continue
        said = _remarks(question, items[id].kind)
        notes += [library.placed(("questions", id, *keys), f"note: {what}") for keys, what in said]
    if variants is not None:
        problems += _unfit(variants, questions, library)
    if problems:
        raise DocumentError(problems)
    files = [Path(path), *(folder / name for name in library.documents)]
    files += [file for document in library.documents.values() for file in document.files]
    title = title or Path(path).stem
    return Prepared(title, source, questions, items, library, tuple(notes), tuple(files), variants)


def _tree(text: str, source: str) -> tuple[dict[str, Any], Draft]:
    """The assignment as it is written, in which answers are texts as in answer files, and its lines."""
    lines: dict[Keys, int] = {}
    tree = read_tree(text, source, lines=lines, is_text=_is_as_typed)
    if not isinstance(tree, dict):
        read = "an empty file" if tree is None else shown(tree)
        hint = "`rigidcli new assignment` prints one to start from"
        message = f"read {read}, expected an assignment: a mapping"
        raise DocumentError([Problem(source, message, 1, hint=hint)])
    return tree, Draft(source, tree, text, lines)


def _is_as_typed(path: Keys) -> bool:
    """Whether a value is a text as it was typed: a title, an answer, the seed, or a variant."""
    is_answer = len(path) > 2 and path[-1] == "answer"  # a question may have this name, too
    return is_title(path) or is_answer or path in (("seed",), ("variants",))


def _remarks(question: Question, kind: AnswerKind) -> Iterator[tuple[Keys, str]]:
    """What in a question does nothing, or may be meant otherwise, with its place."""
    for option in sorted(question.model_fields_set - EVERYWHERE - kind.options):
        yield (option,), f"this means nothing to the kind `{kind.name}`"
    if (question.tolerance.relative or 0.0) > 0.2:  # it may be meant in per cent
        share = f"{question.tolerance.relative:.0%}"
        yield ("tolerance", "relative"), f"it is {share} of the value: per cent meant?"


# --- variants


def _unfit(variants: Variants, questions: Mapping[str, Question], library: Library) -> Iterator[Problem]:
    """Variants that no question uses, values that a document refuses, and literal answers with braces."""
    for id, question in questions.items():
        answers = [question.answer, *(other.answer for other in question.accept)]
        texts = map(as_typed, answers if question.ask is None else ())
        for name in sorted(variants.values.keys() & NAME_IN_BRACES.findall(" ".join(texts))):
            message = f"`{{{name}}}` stands in a literal answer, which is the same for every student"
            hint = f"`ask` a `document` with the parameter `{name}`; the letter stands without braces"
            yield library.placed(("questions", id, "answer"), message, hint)
    named = {each.document: None for each in questions.values() if each.document}
    there = [name for name in named if name in library.documents]  # the others are refused by themselves
    for parameter in variants.values:
        documents = [name for name in there if library.own(name, {parameter: ""})]
        used = [name for name in documents if _plain(parameter) not in library.document(name, {}).unused]
        for name in used:
            yield from _refused(parameter, variants, name, library)
        if used or len(there) < len(named):
            continue
        keys = list(dict.fromkeys(each for name in there for each in library.parameters(name).values()))
        message = f"no document of the questions has the parameter {shown(parameter)}{guess(parameter, keys)}"
        if documents:
            message = f"nothing in {', '.join(map(shown, documents))} uses this parameter"
        hint = "leave it out" if documents or not keys else f"there are {', '.join(keys)}"
        yield library.placed(("variants", parameter), message, hint)


def _refused(parameter: str, variants: Variants, document: str, library: Library) -> Iterator[Problem]:
    """The first value of a variant that a document refuses, where the others have their first values."""
    with suppress(DocumentError):  # the problems of the first values stand in the list already
        library.document(document, library.own(document, library.first))
        for value in variants.values[parameter][1:]:
            values = library.own(document, {**library.first, parameter: value})
            try:
                library.document(document, values)
            except DocumentError as error:
                yield library.refusal(document, values, error)
                return


# --- keys


def _item(kind: AnswerKind, source: KeySource, folder: Path) -> Item:
    question = source.question
    key = _key(kind, source, folder, "ask" if source.path else "answer")
    accepted, changes = list[tuple[Any, float, str]](), list[tuple[str, Any]]()
    for place, other in enumerate(question.accept):
        literal = KeySource(source.name, question, other.answer)
        other_key = _key(kind, literal, folder, "accept", place, "answer")
        accepted.append((other_key, other.credit, other.message))
    typed = kind.typed(key)
    right = kind.read(key, typed).value
    for code, changed in kind.mistaken(source, key):
        with suppress(Unreadable, ArithmeticError, ValueError):
            if not kind.is_right(changed, right):  # else this mistake changes nothing here
                changes.append((code, changed))
    reference = DECIMALS.sub(lambda number: f"{float(number[0]):.6g}", as_typed(typed))
    told = question.title, reference if len(reference) <= LONGEST_REFERENCE else ""
    return Item(kind, key, question.points, *told, question.credit, tuple(accepted), tuple(changes))


def _key(kind: AnswerKind, source: KeySource, folder: Path, *place: str | int) -> Any:
    try:
        text_of = partial(text_beside, folder / "assignment", [])
        value = source.value if source.path else kind.loaded(source.value, text_of)
        return kind.key(replace(source, value=value))
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
    `documents` have the texts of their files. A document that is `refused` is reported once.
    """

    folder: Path
    studies: Mapping[str, Study]
    places: Draft
    first: Values = field(default_factory=dict)
    documents: dict[str, Document] = field(default_factory=dict)
    reports: dict[tuple[str, str, str], tuple[Document, Report]] = field(default_factory=dict)
    keys: dict[tuple[str, str], tuple[Item, Values]] = field(default_factory=dict)
    refused: set[str] = field(default_factory=set)

    def keyed(self, id: str, question: Question, values: Values) -> tuple[Item, Values]:
        """A question with its key, and those of the values that it depends on.

        A key is worked out once for equal values. Raises DocumentError with what is wrong, and where in the
        assignment.
        """
        own: Values = {}
        try:
            own = self.own(question.document, values)
            if (id, words(own)) not in self.keys:
                kind, source = self._source(id, question, own)
                self.keys[id, words(own)] = _item(kind, source, self.folder), own
            return self.keys[id, words(own)]
        except DocumentError as error:
            if own:  # it is right as it stands in its file
                raise DocumentError([self.refusal(str(question.document), own, error)]) from None
            problem = self.placed(("questions", id, "document"), f"{shown(question.document)} is refused")
            is_new = question.document not in self.refused
            self.refused.add(str(question.document))
            raise DocumentError([problem, *error.problems] if is_new else error.problems) from None
        except RigidError as error:
            message = f"{error.message}, with {words(own)}" if own else error.message
            keys: Keys = ("questions", id, *getattr(error, "path", ()))
            raise DocumentError([self.placed(keys, message, error.hint)]) from None

    def placed(self, keys: Keys, message: str, hint: str | None = None) -> Problem:
        """A problem at these keys of the assignment."""
        return self.places.problem(ValueProblem(message, path=keys, hint=hint))

    def refusal(self, name: str, values: Values, error: DocumentError) -> Problem:
        """The problem of values that a document refuses."""
        others = [parameter for parameter, value in values.items() if value != self.first[parameter]]
        problem = error.problems[0]
        reason = f"{problem.key}: {problem.message}" if problem.key else problem.message
        message = f"{shown(name)} does not allow {words(values)}: {reason}"
        hint = problem.hint or "leave this value out, or change the document"
        return self.placed(("variants", *others) if len(others) == 1 else ("variants",), message, hint)

    def own(self, document: str | None, values: Values) -> dict[str, str]:
        """Those of the values that a document has parameters for. Raises DocumentError."""
        declared = self.parameters(document) if document is not None and values else {}
        return {name: value for name, value in values.items() if _plain(name) in declared}

    def parameters(self, name: str) -> dict[str, str]:
        """The parameters of a document, each with its key as it is typed. Raises DocumentError."""
        tree = self.document(name, {}).draft.tree
        return read_names(tree.get("parameters") or {}, has_time=False)[0]

    def document(self, name: str, values: Values) -> Document:
        """A document with these values of its parameters. Raises DocumentError."""
        if name not in self.documents:
            self.documents[name] = load(self.folder / name)
        if not values:
            return self.documents[name]
        spelling = self.parameters(name)
        settings = [f"parameters.{spelling[_plain(key)]}={value}" for key, value in values.items()]
        return read(self.documents[name].draft.changed_by(settings, "variants"))

    def _with_result(self, document: str | None, word: str, values: Values) -> str | None:
        """The way to the first result of a document that has this key or symbol."""
        for study, report_on in self.studies.items() if document else ():
            with suppress(RigidError):
                report = report_on(self.document(str(document), values))
                keys = {each.symbol: each.key for each in report.fields} | {key: key for key in report.tree}
                if word in keys:
                    return f"{study}.{keys[word]}"
        return None

    def _source(self, id: str, question: Question, values: Values) -> tuple[AnswerKind, KeySource]:
        """The kind of a question, and where its key comes from. Raises ValueProblem, DocumentError."""
        if question.ask is None and question.kind is None:
            hint = f"a literal answer has one of {', '.join(KINDS)}"
            raise ValueProblem("missing, expected the kind of the `answer`", path=("kind",), hint=hint)
        if question.ask is None:
            return KINDS[str(question.kind)], KeySource(id, question, question.answer)
        study, *way = path = tuple(question.ask.split("."))
        if study not in self.studies:
            near = did_you_mean(self._with_result(question.document, study, values))
            message = f"there is no command {shown(study)}{near or guess(study, self.studies)}"
            raise ValueProblem(message, path=("ask",), hint=f"there are {', '.join(self.studies)}")
        if question.document is None:
            raise ValueProblem("missing, expected the document that is asked", path=("document",))
        same = question.document, study, words(values)
        if same not in self.reports:
            document = self.document(question.document, values)
            self.reports[same] = document, self.studies[study](document)
        document, report = self.reports[same]
        value = _value_at(study, report, way)
        names = ".".join(step for step in way if not step.isdecimal())  # a unit is that of all rows
        unit = next((unit for key, unit in report.units.items() if f"{names}.".startswith(f"{key}.")), "")
        name = question.kind or kind_of(path, value, unit)
        if name is None:
            hint = f"ask for one of {', '.join(_paths(question.ask, value))}"
            raise ValueProblem("this result is no single answer of any kind", path=("ask",), hint=hint)
        if document.system is not None and document.system.functions and name in OF_SYMBOLS:
            hint = "write a formula for each of `system.functions` into the document of the key"
            raise ValueProblem("answers with unknown functions cannot be judged", path=("ask",), hint=hint)
        return KINDS[name], KeySource(id, question, value, unit, path, document, report)


# The name of a variant in ASCII letters, as parameters of documents have it.
_plain = partial(read_name, has_time=False)


def _value_at(study: str, report: Report, way: Sequence[str]) -> Any:
    """The value at the end of a way in the results of a study. Raises ValueProblem, which lists the ways."""
    ask, tree = study, report.tree
    symbols = {each.symbol: f"{study}.{each.key}" for each in report.fields if each.symbol}  # such as H
    for step in way:
        if isinstance(tree, Mapping) and step in tree:
            tree = tree[step]
        elif isinstance(tree, Sequence | np.ndarray) and step.isdecimal() and int(step) < len(tree):
            tree = tree[int(step)]
        else:
            paths = _paths(ask, tree)
            near = did_you_mean(symbols.get(step)) or guess(f"{ask}.{step}", paths)
            message = f"there is no {shown(step)} in this result{near}"
            hint = f"there are {', '.join(paths)}" if paths else f"`{ask}` is a result, and has no parts"
            raise ValueProblem(message, path=("ask",), hint=hint)
        ask = f"{ask}.{step}"
    if tree is None:
        raise ValueProblem("this document has no such result: it is null", path=("ask",))
    return tree


def _paths(ask: str, tree: Any) -> list[str]:
    if isinstance(tree, Mapping):
        return [f"{ask}.{key}" for key, value in tree.items() if value is not None and key != "schema"]
    if isinstance(tree, Sequence | np.ndarray) and not isinstance(tree, str):
        return [f"{ask}.{place}" for place in range(len(tree))]
    return []
