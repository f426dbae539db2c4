"""`inertia`: mass, centre of mass, and the inertia tensor about a point."""

from __future__ import annotations

from rigidcli.model.document import Document
from rigidcli.report import Report, Step
from rigidcli.studies.body import inertia_fields
from rigidcli.studies.common import field_of, report

SCHEMA = "rigidcli.inertia/1"


def run(document: Document, *, steps: bool = False) -> Report:
    """Find the mass properties of the document's body."""
    fields, working = inertia_fields(document), list[Step]()
    if steps:
        from rigidcli.studies.steps.inertia import inertia_steps

        working += inertia_steps(document, field_of(fields, "tensor"))
    return report(document, SCHEMA, "inertia tensor", fields, steps=working)
