"""The JSON Schema of documents and other files, for editors that complete and check while one types."""

from __future__ import annotations

from dataclasses import dataclass, field
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
    schema = _Linking(definitions, waiting).section(root)
    sections = {section.__name__: section for section in _below(Section)}  # all are loaded by now
    while waiting:
        name = waiting.pop()
        if name not in definitions:
            definitions[name] = _Linking(definitions, waiting).section(sections[name])
    return {"$schema": _DIALECT, **schema, "$defs": dict(sorted(definitions.items()))}


def _below(section: type[Section]) -> list[type[Section]]:
    return [section, *(found for child in section.__subclasses__() for found in _below(child))]


@dataclass
class _Linking:
    """One section's schema, with references as JSON Schema writes them.

    What sections share is put into `definitions`; the sections to which it refers are added to `waiting`.
    """

    definitions: dict[str, Any]
    waiting: list[str]
    inner: dict[str, Any] = field(default_factory=dict)

    def section(self, section: type[Section]) -> dict[str, Any]:
        """The schema; what pydantic puts aside stands where it belongs."""
        schema = section.model_json_schema()
        self.inner = schema.pop("$defs", {})
        linked: dict[str, Any] = self._link(schema)
        return linked

    def _link(self, node: Any) -> Any:
        if isinstance(node, list):
            return [self._link(item) for item in node]
        if not isinstance(node, dict):
            return node
        if "$ref" in node:
            return self._link(self.inner[node["$ref"].rpartition("/")[2]] | _without(node, "$ref"))
        if SHARED in node:
            self.definitions[node[SHARED]] = node["schema"]
            return {"$ref": f"#/$defs/{node[SHARED]}", **_without(node, SHARED, "schema")}
        if SECTION in node:
            self.waiting.append(node[SECTION])
            return {"$ref": f"#/$defs/{node[SECTION]}"}
        # An optional key is left out in documents, where null says nothing more.
        if isinstance(node.get("anyOf"), list) and {"type": "null"} in node["anyOf"]:
            choices = [choice for choice in node["anyOf"] if choice != {"type": "null"}]
            only = choices[0] if len(choices) == 1 else {"anyOf": choices}
            return self._link(only | _without(node, "anyOf", "default"))
        return {key: self._link(value) for key, value in node.items()}


def _without(node: dict[str, Any], *keys: str) -> dict[str, Any]:
    return {key: value for key, value in node.items() if key not in keys}
