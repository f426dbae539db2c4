"""The command `schema`."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from rigidcli.cli.options import OutputPath
from rigidcli.cli.output import Output


class SchemaKind(StrEnum):
    """What there are schemas of."""

    document = "document"
    assignment = "assignment"
    answers = "answers"


def schema(
    kind: Annotated[
        SchemaKind, typer.Argument(metavar="KIND", help=f"One of {', '.join(SchemaKind)}.")
    ] = SchemaKind.document,
    output: OutputPath = None,
) -> None:
    """Print the JSON Schema of a kind of file, for editors.

    Example: rigidcli schema -o .rigidcli.schema.json
    """
    import orjson

    from rigidcli.document.document import Document
    from rigidcli.document.schema import json_schema
    from rigidcli.fields.section import Section
    from rigidcli.grading.question import AnswerFile, Assignment

    roots: dict[str, type[Section]] = {
        "document": Document,
        "assignment": Assignment,
        "answers": AnswerFile,
    }
    with Output(output) as target:
        target.write(orjson.dumps(json_schema(roots[kind]), option=orjson.OPT_INDENT_2).decode() + "\n")
