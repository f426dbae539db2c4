"""Sheets: the questions of an assignment with the values of each student, to hand out."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from rigidcli.errors import printable
from rigidcli.homework.judge import Item
from rigidcli.homework.reports import Style
from rigidcli.homework.reports.formats import csv_rows, points
from rigidcli.homework.reports.pages import file_name, own, written, your_values


class Sheet(NamedTuple):
    """What one student gets: the values of all variants, and the questions with these values."""

    student: str
    values: Mapping[str, str]
    items: Mapping[str, Item]
    about: Sequence[str] = ()
    """What the list of students says of this one, in its own columns."""


def pages(sheets: Sequence[Sheet], title: str) -> Iterator[tuple[str, str]]:
    """Files of a folder, each a name and what stands in it: a page for each student."""
    taken = set[str]()
    for sheet in sheets:
        body = [
            f"<h1>{own(printable(title))}</h1>\n<p><strong>{own(printable(sheet.student))}</strong></p>\n",
            your_values(sheet.values),
        ]
        for id, item in sheet.items.items():
            worth = f"{points(item.points)} point{'s' * (item.points != 1)}"
            body.append(f'<section class="answer">\n<h3>{own(printable(id))} <span>{worth}</span></h3>\n')
            body.append(f'<p class="title">{own(printable(item.title))}</p>\n' if item.title else "")
            body.append("</section>\n")
        yield file_name(sheet.student, taken), written(f"{title}: {sheet.student}", body)


def csv(sheets: Sequence[Sheet], header: Sequence[str], style: Style) -> Iterator[str]:
    """A row for each student, for a mail merge: the columns of the list of students, values, and titles.

    The student is named as in results, in the first column.
    """
    names = [*sheets[0].values, *sheets[0].items] if sheets else []
    rows = (
        [
            sheet.student,
            *(*sheet.about, *[""] * len(header))[: len(header)],
            # A minus sign: no spreadsheet takes it for the beginning of a formula, and all readers know it.
            *(re.sub("^-", "−", value) for value in sheet.values.values()),
            *(item.title for item in sheet.items.values()),
        ]
        for sheet in sheets
    )
    return csv_rows(["student", *header, *names], rows, style)
