"""`new gallery`: a page for each example, and an index of them with small pictures."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import rigidcli
from rigidcli.cli.failures import complain, counted
from rigidcli.cli.output import Folder
from rigidcli.errors import ComputationError
from rigidcli.processes import each

if TYPE_CHECKING:
    from rigidcli.report import Report

INSTALLED = Path(rigidcli.__file__).parent / "configs"
EXAMPLES = INSTALLED if INSTALLED.is_dir() else INSTALLED.parents[1] / "configs"
"""The folder of the examples: a wheel has them inside of the package, a checkout beside it."""

GROUPS = {
    "hamilton": "Lagrangians and Hamiltonians",
    "precess": "Tops and precession",
    "euler": "Bodies in motion",
    "axes": "Inertia and principal axes",
}
"""The studies with their headings; the first one that fits a document shows it."""


class Card(NamedTuple):
    """What the index shows of an example; `about` is the first sentence of its comment."""

    name: str
    group: str
    heading: str
    about: str
    picture: str
    page: str
    document: bytes


def write_gallery(folder: str, jobs: int) -> None:
    """Write the index, the pages and the documents into a folder. Raises RigidError."""
    from rigidcli.render.plots import require_library

    for use in ("drawing", "formulas"):
        require_library(use)
    files = sorted(EXAMPLES.glob("*.yaml"))
    cards = []
    with Folder(folder) as target:
        with counted(len(files)) as done:
            for card in each(_cards, files, jobs, _lost):
                cards.append(card)
                done()
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
    from importlib import import_module

    from rigidcli.commands import COMMANDS
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
    page = "".join(renderer(Format.html)([report], Look(steps=True)))
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
