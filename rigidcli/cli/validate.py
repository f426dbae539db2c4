"""The command `validate`: is a file a valid document, robot, mesh, assignment or answer file?"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

from rigidcli.cli.check import studies
from rigidcli.cli.options import Exact, Files, Quiet, Settings, listed
from rigidcli.cli.output import Failures, Output, complain, tell_notes
from rigidcli.errors import DocumentError, Problem, printable, shortened

# A key at the top of an assignment or an answer file, which no document has.
HOMEWORK = re.compile(r"^[ {]*[\"']?(questions|answers|student)[\"']?\s*:", re.MULTILINE | re.IGNORECASE)

# The beginning of an answer file whose first key is the name of a question, such as 10.35a.
NUMBERED = re.compile(r"(\s*(#.*|---)?\n)*[ {\"']*\d")


def validate(files: Files, settings: Settings = None, exact: Exact = False, quiet: Quiet = False) -> None:
    """Check documents, robots, assignments and answers.

    Prints the names of the valid files, with the questions or answers in them; answer files are read without
    their key. Links of a robot (URDF, SDF, MJCF) are reported where no body has their mass and inertia, and
    where these are suspicious; a mesh, with the reason and the place, where it is not the surface of a body.

    Example: rigidcli validate cube.yaml homework.yaml arm.urdf
    """
    from rigidcli.bodies.robots import is_robot
    from rigidcli.document.draft import body_form
    from rigidcli.document.load import load, loads
    from rigidcli.fields.texts import read_text, safe_name

    failures, settings = Failures(), settings or []
    files, _ = listed(files)
    with Output(None) as target:
        for file in files:
            with failures.of(file):
                source, form = safe_name(file), body_form(file)
                text = "" if form else read_text(file, source)
                folder = Path() if file == "-" else Path(file).parent
                options: dict[str, Any] = {"exact": exact, "settings": settings}
                kind = "links" if is_robot(file) else _kind(text)
                if kind == "links":
                    lines = _robot(text, source, folder, failures, quiet, options)
                elif kind == "questions":
                    lines = _assignment(file, text, quiet)
                elif kind == "answers":
                    lines = _answers(text, folder / Path(file).name, failures)
                else:
                    weighed = any(text.startswith(("body.mass=", "body.density=")) for text in settings)
                    if form == "mesh" and not weighed:  # only the surface is judged
                        options["settings"] = [*settings, "body.density=1"]
                    if form:
                        document = load(file, **options)
                    else:
                        document = loads(text, source=source, folder=folder, **options)
                    tell_notes(document.source, document.notes, quiet)
                    lines = ["valid"]
                if lines:
                    target.write(f"{printable(source)}: " + "".join(f"{line}\n" for line in lines))
    raise typer.Exit(failures.code)


def _kind(text: str) -> str | None:
    """The kind of a file by its keys: `questions`, `answers`, or None for a document."""
    from rigidcli.document.yaml_reader import read_tree

    key = HOMEWORK.search(text)
    if key is None:
        return "answers" if NUMBERED.match(text) else None
    try:
        tree = read_tree(text, "")
    except DocumentError:
        tree = {key[1]: None}
    keys = {str(key).casefold() for key in tree} if isinstance(tree, dict) else set()
    return "questions" if "questions" in keys else "answers" if keys & {"answers", "student"} else None


def _robot(
    text: str, source: str, folder: Path, failures: Failures, quiet: bool, options: dict[str, Any]
) -> list[str]:
    """Lines with the number of valid links of a robot; problems of other links are printed as errors."""
    from rigidcli.document.load import read, robot_drafts
    from rigidcli.studies.robots import remarks, repair

    robot = robot_drafts(text, source, str(folder), **options)
    links = [draft.link for draft in robot.each if draft.link is not None]
    tell_notes(source, robot.notes, quiet)
    valid = 0
    for link, draft in zip(links, robot.each, strict=True):
        with failures.of(source):
            try:
                document = read(draft)
            except DocumentError as error:
                hint = repair(link) if len(error.problems) == 1 else None
                raise DocumentError([replace(p, hint=hint or p.hint) for p in error.problems]) from None
            valid += 1
            for note in () if quiet else remarks(link, document.notes):
                complain(str(note))
    if valid < len(links):
        return [f"{valid} valid of {len(links)} links with a mass"]
    return ["valid", f"  links: {len(links)} with a mass"]


def _assignment(file: str, text: str, quiet: bool) -> list[str]:
    """Lines with the questions of an assignment, their kinds and their points, and with its variants."""
    from rigidcli.homework.assignment import prepare

    prepared = prepare(file, studies(), text)
    for note in () if quiet else prepared.notes:
        complain(str(note))
    asked = [
        f"  {printable(id)}: {item.kind.name}, {item.points:.12g} point{'s' * (item.points != 1)}"
        for id, item in prepared.items.items()
    ]
    values = prepared.variants.values if prepared.variants else {}
    drawn = [f"    {printable(name)}: {printable(shortened(', '.join(all)))}" for name, all in values.items()]
    return ["valid", *asked, *["  variants:"] * bool(drawn), *drawn]


def _answers(text: str, path: Path, failures: Failures) -> list[str]:
    """Lines with each answer as it is read without the key; unreadable answers are printed as errors."""
    from rigidcli.fields.texts import safe_name
    from rigidcli.homework.answers import read_answers
    from rigidcli.homework.base import Unreadable, sentence
    from rigidcli.homework.reading import described

    source, readings = safe_name(str(path)), list[str]()

    def refused(unreadable: Unreadable, key: str) -> None:
        failures.code = max(failures.code, DocumentError.exit_code)
        for finding in unreadable.findings:
            complain(str(Problem(source, sentence(finding), key=key)))

    try:
        answers, notes = read_answers(text)
    except Unreadable as unreadable:
        refused(unreadable, "")
        return []
    for note in notes:
        failures.code = max(failures.code, DocumentError.exit_code)
        complain(str(Problem(source, note)))
    for id, answer in answers.items():
        try:
            readings.append(f"  {printable(id)}: {printable(described(answer, path))}")
        except Unreadable as unreadable:
            refused(unreadable, f"answers.{id}")
    count = f"{len(readings)} of {len(answers)} answers can be read"
    return ["valid" if len(readings) == len(answers) else count, *readings]
