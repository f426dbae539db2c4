"""The commands that print starters, schemas and explanations, and the gallery that `new` writes."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

import rigidcli
from rigidcli.cli.options import OutputPath, option
from rigidcli.cli.output import Failures, Folder, Output, complain, counted, is_file
from rigidcli.commands import COMMANDS
from rigidcli.errors import ComputationError, UsageError, shown
from rigidcli.fields.texts import ending

if TYPE_CHECKING:
    from rigidcli.report import Report

PACKAGE = Path(rigidcli.__file__).parent
# The starters: files of that name in `rigidcli/starters`, mostly with the ending `.yaml`.
Kind = StrEnum(
    "Kind",
    "shape points parts section tensor density mesh molecule robot symbols motion free driven top planet "
    "system oscillations assignment answers gradescope",
)
NAMES = (*Kind, "gallery")  # the words for `new`: the starters, and pages of all examples
ONE_OF = f"One of {', '.join(NAMES)}."
# The endings of the starters that are no YAML.
ENDINGS = {Kind.molecule: ".xyz", Kind.robot: ".urdf", Kind.gradescope: ".sh"}


def _kind(typed: str) -> str:
    """The kind of this name. Raises BadParameter for another word, with the kind that is meant."""
    if typed in NAMES:
        return typed
    from rigidcli.bodies.shapes import SHAPES
    from rigidcli.fields.words import SHAPES_BY_WORD, STARTERS, folded
    from rigidcli.suggestions import did_you_mean, nearest

    word = folded(typed)
    shape = word if word in SHAPES else SHAPES_BY_WORD.get(word, (None,))[0]
    near = STARTERS.get(word, ("shape" if shape else nearest(word, Kind),))[0]
    message = f"read {shown(typed)}, expected one of {', '.join(NAMES)}{did_you_mean(near)}"
    if shape is not None and near == "shape":
        message += f"; write `rigidcli new shape`, and in it `shape: {shape}`"
    if ending(typed) in (".yaml", ".yml", ".urdf", ".xyz"):
        message += f"; the name of a file stands after `-o`: `rigidcli new -o {typed}`"
    raise typer.BadParameter(message)


def new(
    kind: Annotated[
        str,
        typer.Argument(metavar="KIND", help=ONE_OF, callback=_kind, autocompletion=lambda: [*NAMES]),
    ] = Kind.shape,
    output: OutputPath = None,
    force: Annotated[bool, option("force")] = False,
) -> None:
    """Print a commented file to start from.

    A document of some kind, a robot, a molecule, an assignment, an answer file, or Gradescope's autograder.
    `gallery -o FOLDER/` writes a page for each example, and an index with pictures.

    Example: rigidcli new top -o top.yaml
    """
    failures = Failures()
    with failures.of("new gallery" if kind == "gallery" else output or "new"):
        if kind != "gallery":
            write_starter(Kind(kind), output, force)
        elif output is None:
            raise UsageError("it writes many pages", hint="`rigidcli new gallery -o FOLDER/`")
        else:
            write_gallery(output)
    raise typer.Exit(failures.code)


# The first command that a starter names for itself.
_COMMAND = re.compile(r"rigidcli [a-z]+(?: -[-a-z]+)* FILE[.a-z]*")
_FILE = re.compile("FILE[.a-z]*")  # the name of the starter's own file in that command


def write_starter(kind: Kind, output: str | None, force: bool) -> None:
    """Write a starter, and say what to do with it. Raises UsageError for a file that is there already."""
    if output is not None and is_file(output) and not force:
        raise UsageError("the file exists, and is not overwritten", hint="`--force` overwrites it")
    text = (PACKAGE / "starters" / f"{kind}{ENDINGS.get(kind, '.yaml')}").read_text(encoding="utf-8")
    with Output(output) as target:
        target.write(text)
    if output is not None and is_file(output):
        command = _COMMAND.search(text)
        following = f"; next: {_FILE.sub(lambda _: shlex.quote(output), command[0])}" if command else ""
        complain(f"wrote {output}{following}")


SchemaKind = StrEnum("SchemaKind", "document assignment answers")  # the kinds of files that have a schema
_SchemaKind = Annotated[SchemaKind, typer.Argument(metavar="KIND", help=f"One of {', '.join(SchemaKind)}.")]
ABOUT = "A key, shape, unit, function, result or mistake."
_Path = Annotated[str | None, typer.Argument(metavar="PATH", help=ABOUT, show_default=False)]


def schema(kind: _SchemaKind = SchemaKind.document, output: OutputPath = None) -> None:
    """Print the JSON Schema of a kind of file, for editors.

    Example: rigidcli schema -o .rigidcli.schema.json
    """
    import orjson

    from rigidcli.reference.entries import WRITTEN_FILES
    from rigidcli.reference.schema import json_schema

    _, root = WRITTEN_FILES[kind]
    with Output(output) as target:
        target.write(orjson.dumps(json_schema(root), option=orjson.OPT_INDENT_2).decode() + "\n")


def explain(path: _Path = None) -> None:
    """Explain a key, shape, unit, function, result or mistake.

    Example: rigidcli explain body.shape.cone
    """
    from rigidcli.reference.pages import explain as page

    failures = Failures()
    with failures.of("explain"), Output(None) as target:
        columns, _ = target.terminal()
        target.write(page(path, columns))
    raise typer.Exit(failures.code)


# --- the gallery: a page for each example, and an index of them with small pictures

INSTALLED = PACKAGE / "configs"
# The folder of the examples: a wheel has them inside of the package, a checkout beside it.
EXAMPLES = INSTALLED if INSTALLED.is_dir() else INSTALLED.parents[1] / "configs"
# The studies with their headings; the first one that fits a document shows it.
GROUPS = {
    "hamilton": "Lagrangians and Hamiltonians",
    "precess": "Tops and precession",
    "euler": "Bodies in motion",
    "axes": "Inertia and principal axes",
}


class Card(NamedTuple):
    """What the index shows of an example; `about` is the first sentence of its comment."""

    name: str
    group: str
    heading: str
    about: str
    picture: str
    page: str
    document: bytes


def write_gallery(folder: str) -> None:
    """Write the index, the pages and the documents into a folder. Raises RigidError."""
    from rigidcli.processes import each
    from rigidcli.render.plots import require_library
    from rigidcli.sandbox import usable_cores

    for use in ("drawing", "formulas"):
        require_library(use)
    files = sorted(EXAMPLES.glob("*.yaml"))
    cards = []
    with Folder(folder) as target:
        with counted(len(files)) as done:
            for card in each(_cards, files, usable_cores(), _lost):
                cards.append(card)
                done(1)
        for card in cards:
            target.begin(f"{card.name}.html")
            target.write(card.page)
            target.begin(f"{card.name}.yaml")
            target.write(card.document)
        target.begin("index.html")
        for piece in _index(cards):
            target.write(piece)
    complain(f"wrote {len(cards)} pages; open {Path(folder, 'index.html')}")


def _cards(file: Path) -> Iterator[Card]:
    """The card of an example; none of a motion with many starts, which has no page of its own."""
    from rigidcli.document.load import load
    from rigidcli.render import Format, Look, renderer
    from rigidcli.render.plots import inline_picture
    from rigidcli.studies.pictures import ANY

    document = load(file)
    if document.ensemble is not None:
        return
    sections = ("system", "top tide", "motion", "body")
    (study, *_) = (
        study
        for study, names in zip(GROUPS, sections, strict=True)
        if any(getattr(document, name) is not None for name in names.split())
    )
    scene = {"scene": True} if COMMANDS[study].has_replay else {}
    report = import_module(f"rigidcli.studies.{study}").run(document, steps=True, picture=ANY, **scene)
    page = "".join(renderer(Format.html)([report], Look()))
    data = file.read_bytes()
    comment = " ".join(line[1:].strip() for line in data.decode().splitlines() if line.startswith("# "))
    comment = re.sub(r"^yaml-language-server: \S+ ", "", comment)
    (sentence, *_) = re.split(r"(?<=[.;]) (?=[A-Z])", comment)
    picture = inline_picture(report) if report.pictures else _formula(report)
    yield Card(file.stem, study, report.heading.rpartition(":")[0], sentence, picture, page, data)


def _formula(report: Report) -> str:
    """The Hamiltonian or the tensor of an example with letters, in place of a picture."""
    from rigidcli.render.latex import value
    from rigidcli.render.web.mathml import formula

    shown = next((each for each in report.fields if each.key in ("hamiltonian", "tensor")), None)
    if shown is None or shown.value is None:
        return ""
    return f"<span class=formula>{formula(f'{shown.symbol} = {value(shown, 4)}')}</span>"


def _lost(file: Path) -> Card:
    raise ComputationError(f"the process that drew {file.name} was killed twice, probably for memory")


def _index(cards: list[Card]) -> Iterator[str]:
    from rigidcli.render.web.mathml import prose
    from rigidcli.render.web.page import page, resource, text

    body = ["<main>\n<h1>Examples of rigidcli</h1>\n"]
    for study, title in GROUPS.items():
        body.append(f"<h2>{title}</h2>\n<ul class=gallery>\n")
        body += [
            f'<li><a href="{card.name}.html">{card.picture}<strong>{text(card.heading)}</strong></a>'
            f'<p>{prose(card.about)}</p><a href="{card.name}.yaml">document</a></li>\n'
            for card in cards
            if card.group == study
        ]
        body.append("</ul>\n")
    yield from page("Examples of rigidcli", [*body, "</main>\n"], styles=[resource("gallery.css")])
