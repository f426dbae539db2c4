"""The command `schema`."""

from __future__ import annotations

from rigidcli.cli.computing import OutputPath
from rigidcli.cli.output import Output


def schema(output: OutputPath = None) -> None:
    """Print the JSON Schema of a document, for editors."""
    import orjson

    from rigidcli.model.schema import json_schema

    with Output(output) as target:
        target.write(orjson.dumps(json_schema(), option=orjson.OPT_INDENT_2).decode() + "\n")
