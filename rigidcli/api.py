"""The studies as functions of documents, for `import rigidcli`, from the table of commands."""

from __future__ import annotations

import inspect
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from importlib import import_module
from pathlib import Path
from textwrap import fill
from typing import Any, TypeAlias

from rigidcli.commands import COMMANDS, STUDIES, Command
from rigidcli.document.document import Document
from rigidcli.document.load import MAPPING, Source, plain, read_source
from rigidcli.errors import DocumentError, Problem, UsageError, shown
from rigidcli.homework import Feedback
from rigidcli.report import Report
from rigidcli.result import Result
from rigidcli.studies.common import RESULTS
from rigidcli.suggestions import guess

# The help of a study. The help of the package tells its options.
HELP = """{about}

Fields of the result, which `rigidcli explain {name}` explains:
{fields}

{example}
"""

# Values by their keys, such as `body.mass` or the name of a parameter; or texts such as `body.mass=3`.
Settings: TypeAlias = Mapping[str, object] | Sequence[str]
# A study as a function. Each takes the options that its help names, and refuses others.
Study: TypeAlias = Callable[..., Result]


def _study(name: str) -> Study:
    row = COMMANDS[name]

    def study(
        document: Source,
        *,
        exact: bool = False,
        settings: Settings = (),
        steps: bool = False,
        picture: str | None = None,
        **options: Any,
    ) -> Result:
        return _run(row, document, exact, settings, {"steps": steps, "picture": picture, **options})

    fields = ", ".join(dict.fromkeys(field.key.partition(".")[0] for field in RESULTS[name]))
    study.__name__ = study.__qualname__ = name
    study.__doc__ = HELP.format(
        about=row.about, name=name, fields=fill(fields, 106), example=inspect.cleandoc(row.python)
    )
    return study


def _run(row: Command, source: Source, exact: bool, settings: Settings, options: Mapping[str, Any]) -> Result:
    """The result of a study, which repeats it for pictures and a replay when these are seen."""
    run: Callable[..., Report] = import_module(f"rigidcli.studies.{row.name}").run
    if unknown := options.keys() - inspect.signature(run).parameters.keys():
        raise TypeError(f"{row.name}() got an unexpected keyword argument {unknown.pop()!r}")
    with _in_python():
        document = _read(source, exact, settings, row.ignored.split())
        report = run(document, **options)

    def again(**seen: Any) -> Report:
        with _in_python():
            return run(document, **seen, **({"scene": True} if row.has_replay else {}))

    parts = {part.name: getattr(report, part.name) for part in fields(report)}
    return Result(**parts, _again=again if document.ensemble is None else None)


def validate(document: Source, *, exact: bool = False, settings: Settings = ()) -> list[Problem]:
    """What is wrong with a document: problems with line, key, message and hint; none where it is valid."""
    try:
        _read(document, exact, settings)
    except DocumentError as error:
        return _placed(error)
    return []


@contextmanager
def _in_python() -> Iterator[None]:
    """A context in which a DocumentError names settings and lines as Python has them, not the command."""
    try:
        yield
    except DocumentError as error:
        raise DocumentError(_placed(error)) from None


def _placed(error: DocumentError) -> list[Problem]:
    """The problems of a document; a mapping has no lines."""
    placed = []
    for problem in error.problems:
        name = problem.source.removeprefix(MAPPING).replace("with --set", "with settings")
        is_own = name == problem.source
        placed.append(problem if is_own else replace(problem, source=name.lstrip(), line=None))
    return placed


def _read(source: Source, exact: bool, settings: Settings, ignored: Sequence[str] = ()) -> Document:
    """The document of a source. Raises UsageError for a setting that nothing uses."""
    if isinstance(settings, Mapping):
        settings = [f"{key}={json.dumps(value, default=plain)}" for key, value in settings.items()]
    document = read_source(source, exact, [settings] if isinstance(settings, str) else settings)
    for path in document.draft.changed if settings else ():
        if path[0] in ignored or (path[0] == "parameters" and path[-1] in document.unused):
            raise UsageError(f"settings: nothing uses `{'.'.join(map(str, path))}`")
    return document


inertia, axes, precess, euler, hamilton = map(_study, ("inertia", "axes", "precess", "euler", "hamilton"))


class Judgements(list[dict[str, Any]]):
    """Judged hand-ins, one mapping a student with the fields of `check -f json`, and the `notes` on them."""

    def __init__(self, records: Sequence[dict[str, Any]], notes: Sequence[str]) -> None:
        super().__init__(records)
        self.notes = tuple(notes)


def check(
    assignment: str | os.PathLike[str],
    *answers: str | os.PathLike[str],
    feedback: str = "hint",
    roster: str | os.PathLike[str] | None = None,
    overrides: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
) -> Judgements:
    """Judge homework: answer files, folders of them, or a zip, as the command `check` does.

    `feedback` is "none", "verdict", "hint" or "full"; only the last shows reference values. `roster` and
    `overrides` are files of csv: the students, and scores of a person. `jobs` files are judged at a time.

    Returns a mapping for each student, with the fields of `check -f json`; `notes` list what was left out.
    Raises DocumentError for an assignment that is refused, and for files that cannot be read.

        for student in rigidcli.check("homework.yaml", "answers/"):
            print(student["student"], student["score"])
    """
    from tempfile import TemporaryDirectory

    from rigidcli.homework.assignment import prepare
    from rigidcli.homework.files import gather
    from rigidcli.homework.hand_ins import papers
    from rigidcli.homework.overrides import read_overrides
    from rigidcli.homework.reports.formats import ReportStyle, render
    from rigidcli.homework.roster import read_roster

    levels = list(Feedback)
    if feedback not in levels:
        expected = f"expected {', '.join(levels)}{guess(feedback, levels)}"
        raise UsageError(f"feedback: read {shown(feedback)}, {expected}")
    if not answers:
        raise UsageError("no answers are named: expected files, folders of them, or a zip")
    prepared = prepare(os.fspath(assignment), {name: globals()[name] for name in STUDIES})
    notes = [*map(str, prepared.notes)]
    people = None if roster is None else read_roster(roster)
    scores = None if overrides is None else read_overrides(overrides, prepared.items, people)
    with TemporaryDirectory(prefix="rigidcli-") as scratch:
        batch = gather([os.fspath(name) for name in answers], os.fspath(assignment), Path(scratch))
        if batch.problems:
            raise DocumentError(batch.problems)
        handed_in = papers(batch, people, prepared.questions, jobs)
        notes += handed_in.notes
        judged = [*prepared.judged(handed_in, people, scores, jobs, lambda _, said: notes.extend(said))]
    style = ReportStyle(Feedback(feedback), late=any(student.late for student in judged))
    return Judgements([json.loads(line) for line in render("json", judged, style)], notes)
