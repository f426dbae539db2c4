"""The JSON Schema of documents and other files, for editors that complete and check while one types."""

from __future__ import annotations

from typing import Any

from rigidcli.document.document import Document
from rigidcli.fields.readers import SECTION, SHARED
from rigidcli.fields.section import Section

_DIALECT = "https://json-schema.org/draft/2020-12/schema"
"""The edition of JSON Schema, which pydantic writes."""


def json_schema(root: type[Section] = Document) -> dict[str, Any]:
    """The schema of a file that is a section, with every other that it may contain under `$defs`."""
    definitions: dict[str, Any] = {}
    waiting: list[str] = []
    schema = _of_section(root, definitions, waiting)
    sections = {section.__name__: section for section in _below(Section)}  # all are loaded by now
    while waiting:
        name = waiting.pop()
        if name not in definitions:
            definitions[name] = _of_section(sections[name], definitions, waiting)
    return {"$schema": _DIALECT, **schema, "$defs": dict(sorted(definitions.items()))}


def _below(section: type[Section]) -> list[type[Section]]:
    return [section, *(found for child in section.__subclasses__() for found in _below(child))]


def _of_section(section: type[Section], definitions: dict[str, Any], waiting: list[str]) -> dict[str, Any]:
    """One section's schema, with references as JSON Schema writes them.

    What sections share is put into `definitions`; the sections to which it refers are added to `waiting`.
    """
    schema = section.model_json_schema()
    inner = schema.pop("$defs", {})  # what pydantic puts aside stands where it belongs

    def linked(node: Any) -> Any:
        if isinstance(node, list):
            return [linked(item) for item in node]
        if not isinstance(node, dict):
            return node
        rest = {key: value for key, value in node.items() if key not in ("$ref", SHARED, "schema")}
        if "$ref" in node:
            return linked(inner[node["$ref"].rpartition("/")[2]] | rest)
        if SHARED in node:
            definitions[node[SHARED]] = node["schema"]
            return {"$ref": f"#/$defs/{node[SHARED]}", **rest}
        if SECTION in node:
            waiting.append(node[SECTION])
            return {"$ref": f"#/$defs/{node[SECTION]}"}
        # An optional key is left out in documents, where null says nothing more.
        if isinstance(choices := node.get("anyOf"), list) and {"type": "null"} in choices:
            choices = [choice for choice in choices if choice != {"type": "null"}]
            only = choices[0] if len(choices) == 1 else {"anyOf": choices}
            return linked(only | {key: node[key] for key in node if key not in ("anyOf", "default")})
        return {key: linked(value) for key, value in node.items()}

    whole: dict[str, Any] = linked(schema)
    return whole
