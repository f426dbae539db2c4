"""`inertia`: mass, centre of mass, and the inertia tensor about a point."""

from __future__ import annotations

from rigidcli.document.document import Document
from rigidcli.report import Report
from rigidcli.studies.body import axis_fields, inertia_fields, mesh_fields
from rigidcli.studies.common import report, worked
from rigidcli.studies.pictures import drawn


def run(document: Document, *, steps: bool = False, picture: str | None = None) -> Report:
    """Find the mass properties of the document's body. Raises DocumentError for a document without a body."""
    fields, (about_axis, notes) = inertia_fields(document), axis_fields(document)
    working = worked("inertia", steps, document, fields["tensor"].value)
    pictures = drawn("inertia", picture, document)
    shown = (*fields.values(), *about_axis, *mesh_fields(document))
    return report(document, "inertia", shown, notes, steps=working, pictures=pictures)
