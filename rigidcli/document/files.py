"""Reading of files of any kind that the program knows: documents, and robots, which hold several."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rigidcli.bodies.robots import is_robot
from rigidcli.document.document import Document
from rigidcli.document.load import Draft, draft
from rigidcli.errors import DocumentError, Problem
from rigidcli.fields.texts import read_text


class Drafts(NamedTuple):
    """The documents of a file, not yet read, and notes on the file as a whole."""

    each: Sequence[Draft]
    notes: Sequence[str]


def drafts(path: str | os.PathLike[str], **options: Any) -> Drafts:
    """The documents of a file: a robot description has one a link, all else is one.

    The options are those of `load`. Raises DocumentError for a file that holds none.
    """
    name = os.fspath(path)
    if not is_robot(name):
        return Drafts([draft(path, **options)], ())
    from rigidcli.document.link_documents import link_documents

    source = os.fsencode(name).decode(errors="backslashreplace")
    robot = link_documents(read_text(name, source), source, Path(name).parent, **options)
    if not robot.links:
        raise DocumentError(
            [Problem(source, "; ".join(["no link has a mass that is written", *robot.notes]))]
        )
    return Drafts([link.draft for link in robot.links], robot.notes)


def load_all(path: str | os.PathLike[str], **options: Any) -> list[Document]:
    """The documents of a file, as `load` reads one: of a robot description one a link that has a mass.

    Raises DocumentError with the problems of all links.
    """
    found, problems = [], list[Problem]()
    for each in drafts(path, **options).each:
        try:
            found.append(each.document())
        except DocumentError as error:
            problems += error.problems
    if problems:
        raise DocumentError(problems)
    return found


def load(path: str | os.PathLike[str], **options: Any) -> Document:
    """The document of a file, also that of a robot description with one heavy link. Raises DocumentError."""
    one, *others = load_all(path, **options)
    if others:
        message = f"there are {len(others) + 1} links with a mass, expected one"
        raise DocumentError([Problem(one.source, message, hint="`rigidcli.load_all` reads all of them")])
    return one
