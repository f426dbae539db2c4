"""The links of a robot as documents, each of which knows its place in the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path as FilePath
from typing import Any, NamedTuple

from rigidcli.bodies.robots import links_of, read_robot
from rigidcli.bodies.robots.links import Decimals, Link, listed
from rigidcli.document.document import Document
from rigidcli.document.load import Draft
from rigidcli.document.places import Places
from rigidcli.errors import DocumentError, Path, Problem, ValueProblem

MOST_LINKS = 1000
"""The most links of a file, which take two seconds to read as documents; the largest robots have 200."""


@dataclass
class LinkPlaces(Places):
    """Where the values of a link stand, which is the one at `index` in the file. Problems name the link."""

    folder: FilePath = FilePath()
    link: Link | None = None
    index: int = 0

    def tree(self, decimal: Decimals) -> Any:
        """The document of the link. Raises DocumentError for one that no body is."""
        assert self.link is not None
        if self.link.problem is not None:
            raise DocumentError([self.link.problem])
        read = decimal is not float
        link = links_of(self.text, self.source, self.folder, decimal)[self.index] if read else self.link
        return {"name": link.name, "body": deepcopy(link.body)}

    @cached_property
    def _lines(self) -> dict[Path, int]:
        """The lines of the mass, the tensor and the position, below each of the frames."""
        assert self.link is not None
        body: Path = ("body", *("parts", 0) * sum(map(bool, self.link.frames)))
        known = {(*body, key): line for key, line in self.link.lines.items()}
        return {(): self.link.line, ("body",): self.link.line_of("inertia"), **known}

    def problem(self, problem: ValueProblem) -> Problem:
        """The problem at the place of its value, with the name of the link and what it is about."""
        assert self.link is not None
        placed, key = super().problem(problem), f"link {self.link.name}"
        about = ".".join(map(str, problem.path))
        if problem.path[:1] == ("body",) and placed.source == self.source:
            # What stands in the file has no keys of documents.
            about = problem.path[-1] if problem.path[-1] in ("mass", "position", "rotation") else ""
        return replace(placed, key=f"{key}: {about}" if about else key)


class LinkDocument(NamedTuple):
    """A link, and its document, not yet read: reading raises DocumentError for what no body has."""

    link: Link
    draft: Draft


@dataclass(frozen=True, slots=True)
class LinkDocuments:
    """The links of a file that have a mass or a problem, and notes on the file."""

    links: Sequence[LinkDocument]
    notes: Sequence[str]


def link_documents(
    text: str,
    source: str,
    folder: FilePath,
    *,
    exact: bool = False,
    settings: Sequence[str] = (),
    options: Mapping[str, str] | None = None,
) -> LinkDocuments:
    """The links of the robot in `text`, each a document; the options are those of `load`.

    Raises DocumentError for what is no robot.
    """

    whole = read_robot(text, source, folder)
    if len(whole.links) > MOST_LINKS:
        problem = f"there are {len(whole.links):,} links, expected at most {MOST_LINKS:,}"
        raise DocumentError([Problem(source, problem)])

    def draft(index: int, link: Link) -> Draft:
        places = LinkPlaces(text, link.source, folder=folder, link=link, index=index)
        return Draft(places, folder, exact, settings, options or {})

    told = [
        LinkDocument(link, draft(index, link)) for index, link in enumerate(whole.links) if not link.without
    ]
    return LinkDocuments(told, [*whole.notes, *_without(whole.links)])


def alone(link: Link) -> Document:
    """The document of a link as it would be with other values. Raises DocumentError."""
    return Draft(LinkPlaces("", link.source, link=link), FilePath(), False, (), {}).document()


def _without(links: Sequence[Link]) -> list[str]:
    """For each reason why links have no results, a note that names them."""
    reasons: dict[str, list[Link]] = {}
    for link in links:
        reasons.setdefault(link.without, []).append(link)
    reasons.pop("", None)
    notes = []
    for reason, found in reasons.items():
        names = listed([f"{link.name} (line {link.line})" for link in found])
        notes.append(f"{len(found)} link{'s have' if len(found) > 1 else ' has'} {reason}: {names}")
    return notes
