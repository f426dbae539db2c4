"""The JSON Schema of a document, for editors that complete and check while one types."""

from __future__ import annotations

from typing import Any

from rigidcli.model.base import SECTION, SHARED, Section
from rigidcli.model.document import Document

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema() -> dict[str, Any]:
    """The schema, with every section that a document may contain under `$defs`."""
    root = _of(Document)
    definitions: dict[str, Any] = {}
    sections = {section.__name__: section for section in _sections(Section)}
    waiting = _references(root)
    while waiting:
        name = waiting.pop()
        if name not in definitions:
            definitions[name] = _of(sections[name])
            waiting |= _references(definitions[name])
    shared: dict[str, Any] = {}
    linked = {name: _link(schema, shared) for name, schema in definitions.items()}
    document = {"$schema": DIALECT, "title": "rigidcli document", **_link(root, shared)}
    return document | {"$defs": dict(sorted((linked | shared).items()))}


def _of(section: type[Section]) -> dict[str, Any]:
    """Schema of one section; those that it contains directly stand in it."""
    schema = section.model_json_schema()
    inner = schema.pop("$defs", {})
    result: dict[str, Any] = _inline(schema, inner)
    return result


def _inline(node: Any, definitions: dict[str, Any]) -> Any:
    if isinstance(node, list):
        return [_inline(item, definitions) for item in node]
    if not isinstance(node, dict):
        return node
    if "$ref" in node:
        target = _inline(definitions[node["$ref"].rpartition("/")[2]], definitions)
        return target | {key: value for key, value in node.items() if key != "$ref"}
    return {key: _inline(value, definitions) for key, value in node.items()}


def _references(node: Any) -> set[str]:
    """Names of the sections to which a schema refers."""
    if isinstance(node, list):
        return set().union(*map(_references, node))
    if not isinstance(node, dict):
        return set()
    here = {node[SECTION]} if SECTION in node else set()
    return here.union(*map(_references, node.values()))


def _link(node: Any, shared: dict[str, Any]) -> Any:
    """The schema with its references as JSON Schema writes them; what is shared is put aside."""
    if isinstance(node, list):
        return [_link(item, shared) for item in node]
    if not isinstance(node, dict):
        return node
    if SHARED in node:
        shared[node[SHARED]] = node["schema"]
        rest = {key: value for key, value in node.items() if key not in (SHARED, "schema")}
        return {"$ref": f"#/$defs/{node[SHARED]}", **rest}
    if SECTION in node:
        return {"$ref": f"#/$defs/{node[SECTION]}"}
    # An optional key is left out in documents, where null says nothing more.
    if isinstance(node.get("anyOf"), list) and {"type": "null"} in node["anyOf"]:
        choices = [choice for choice in node["anyOf"] if choice != {"type": "null"}]
        rest = {key: value for key, value in node.items() if key not in ("anyOf", "default")}
        only = choices[0] if len(choices) == 1 else {"anyOf": choices}
        return _link(only | rest, shared)
    return {key: _link(value, shared) for key, value in node.items()}


def _sections(section: type[Section]) -> list[type[Section]]:
    return [section, *(found for child in section.__subclasses__() for found in _sections(child))]
