"""The JSON Schema of documents and other files, for editors that complete and check while one types."""

from __future__ import annotations

from typing import Any

from rigidcli.document.document import Document
from rigidcli.fields.section import SECTION_REFERENCE, SHARED_SCHEMA, Section

_DIALECT = "https://json-schema.org/draft/2020-12/schema"  # the edition of JSON Schema, which pydantic writes


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
    """A section and all that are built on it."""
    return [section, *(below for child in section.__subclasses__() for below in _below(child))]


def _of_section(section: type[Section], definitions: dict[str, Any], waiting: list[str]) -> dict[str, Any]:
    """One section's schema, with references as JSON Schema writes them.

    What sections share is put into `definitions`; the sections to which it refers are added to `waiting`.
    """

    def refer(name: str, rest: dict[str, Any]) -> dict[str, Any]:
        return {"$ref": f"#/$defs/{name}", **rest}

    def linked(node: Any) -> Any:
        if isinstance(node, list):
            return [linked(item) for item in node]
        if not isinstance(node, dict):
            return node
        rest = {
            key: value
            for key, value in node.items()
            if key not in ("$ref", SECTION_REFERENCE, SHARED_SCHEMA, "schema")
        }
        if SHARED_SCHEMA in node:
            definitions[node[SHARED_SCHEMA]] = node["schema"]
            return refer(node[SHARED_SCHEMA], rest)
        if SECTION_REFERENCE in node or "$ref" in node:
            waiting.append(node.get(SECTION_REFERENCE) or node["$ref"].rpartition("/")[2])
            return refer(waiting[-1], rest)
        # An optional key is left out in documents, where null says nothing more.
        if isinstance(choices := node.get("anyOf"), list) and {"type": "null"} in choices:
            choices = [choice for choice in choices if choice != {"type": "null"}]
            only = choices[0] if len(choices) == 1 else {"anyOf": choices}
            return linked(only | {key: node[key] for key in node if key not in ("anyOf", "default")})
        return {key: linked(value) for key, value in node.items()}

    schema: dict[str, Any] = section.model_json_schema()
    schema.pop("$defs", None)  # these sections are worked by themselves
    for key, entry in schema["properties"].items():
        entry.setdefault("title", key.title())
    # A hole may lack both mass and density.
    if section.ONE_OF and not {"oneOf", "density"} & {*schema, *section.ONE_OF}:
        schema["oneOf"] = [{"required": [key]} for key in section.ONE_OF]
    whole: dict[str, Any] = linked(schema)
    return whole
