"""`inertia`: mass, centre of mass, and the inertia tensor about a point."""

from __future__ import annotations

from rigidcli.model.document import Document
from rigidcli.report import Report
from rigidcli.studies.body import axis_fields, inertia_fields
from rigidcli.studies.common import report

SCHEMA = "rigidcli.inertia/1"


def run(document: Document) -> Report:
    """Find the mass properties of the document's body."""
    known, (about_axis, notes) = inertia_fields(document), axis_fields(document)
    return report(document, SCHEMA, "inertia tensor", [*known, *about_axis], notes)
