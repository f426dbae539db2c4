"""Marks on fields: how an entry of the document becomes the value of a field, and its JSON Schema."""

from __future__ import annotations

import pathlib
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property
from importlib import import_module
from types import UnionType
from typing import Annotated, Any, TypeAlias

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema
from pydantic_core.core_schema import ValidatorFunctionWrapHandler

from rigidcli.errors import ValueProblem, nearest, shown
from rigidcli.fields.environment import Environment
from rigidcli.fields.section import Section, environment
from rigidcli.fields.words import AS_WRITTEN, HINTS, folded, key_slip, keys_called, lists_meant, with_colon

SECTION = "x-section"
"""Key that stands for `$ref` in the JSON Schema of one section, as bodies contain bodies."""

SHARED = "x-shared"
"""Key with the name of the schema that stands under `schema` beside it: written once, and referred to."""


class Reader:
    """Marks a field with a reader of its own: `read` turns an entry of the document into its value.

    `read` raises ValueProblem. `json_schema` gives the JSON Schema of the entry.
    """

    read: Callable[[Any, ValidationInfo], Any]
    json_schema: Callable[[], JsonSchemaValue]

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        # pydantic adds defaults to the schema that it gets; other fields of the same kind have others.
        return deepcopy(self.json_schema())


class ReadBy(Reader):
    """Marks a field that a function, `read`, reads; `schema` is its JSON Schema."""

    def __init__(self, read: Callable[[Any, ValidationInfo], Any], schema: JsonSchemaValue) -> None:
        self.read, self.json_schema = read, lambda: schema


@dataclass(frozen=True, eq=False)
class Alternative:
    """Marks a field of the type `otherwise` that also takes an entry of another type, `kind`.

    `read` makes the value of the field from such an entry, of which `schema` is the JSON Schema.
    """

    kind: type | UnionType
    read: Callable[[Any, Environment], object]
    otherwise: Any
    schema: JsonSchemaValue

    def wrapped(self, raw: Any, otherwise: ValidatorFunctionWrapHandler, info: ValidationInfo) -> object:
        """The value of the field, which `read` makes from an entry of the other type."""
        return self.read(raw, environment(info)) if isinstance(raw, self.kind) else otherwise(raw)

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        schema = handler.generate_schema(self.otherwise)
        return core_schema.with_info_wrap_validator_function(self.wrapped, schema)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {"anyOf": [deepcopy(self.schema), handler(schema)]}


@dataclass(frozen=True)
class Choice(Reader):
    """Marks a field as one of several sections, which `choose` picks by the mapping in the document."""

    choose: Callable[[Mapping[str, Any]], type[Section]]
    options: Callable[[], Sequence[type[Section]]]
    example: str = ""
    """A mapping that may stand there, for messages."""

    def json_schema(self) -> JsonSchemaValue:
        """The JSON Schema of a mapping that is one of the sections."""
        return {"oneOf": [reference(option) for option in self.options()]}

    def read(self, raw: object, info: ValidationInfo) -> Section:
        """The mapping, read as the section that `choose` picks."""
        if isinstance(raw, Section):
            return raw
        if not isinstance(raw, Mapping):
            message = f"read {shown(raw)}, expected a mapping{self.example and f', such as {self.example}'}"
            cure = with_colon(raw) if isinstance(raw, str) else None
            raise ValueProblem(message, hint=cure and AS_WRITTEN.format(cure), typed=cure and str(raw))
        return self.choose(raw).model_validate(raw, context=info.context)


def by_key(forms: Mapping[str, type[Section]], example: str = "") -> Choice:
    """Marks a field that takes the section of the one key of `forms` that the mapping has."""

    def choose(raw: Mapping[str, Any]) -> type[Section]:
        present = [key for key in forms if key in raw]
        if len({forms[key] for key in present}) == 1:
            return forms[present[0]]
        read = " and ".join(f"`{key}`" for key in present) or "none of them"
        if slips := [slip.below(key) for key in raw if (slip := key_slip(key, forms)) is not None]:
            raise slips[0]
        for key in raw if not present else ():
            if (hint := HINTS.get(folded(key))) is not None:
                raise ValueProblem("unknown key", path=(key,), hint=hint)
        called = [name for name, *_ in lists_meant(raw, forms)]
        called += [name for key in raw for name in keys_called(key) if name in forms]
        guess = next((name for name in (*called, *(nearest(key, list(forms)) for key in raw)) if name), None)
        if guess is not None and not present:
            return forms[guess]  # which tells what is wrong with its keys
        raise ValueProblem(f"expected exactly one of {', '.join(forms)}; read {read}")

    return Choice(choose, lambda: tuple(dict.fromkeys(forms.values())), example)


@dataclass(frozen=True)
class Elsewhere(Reader):
    """Marks a field for a section, or a choice, of a module that is loaded when there is one to read."""

    module: str
    name: str

    @cached_property
    def choice(self) -> Choice:
        """The choice in the other module; a single section is a choice, too."""
        there = getattr(import_module(self.module), self.name)
        return (
            there if isinstance(there, Choice) else Choice(lambda raw: there, lambda: (there,), there.EXAMPLE)
        )

    def json_schema(self) -> JsonSchemaValue:
        """The JSON Schema of the choice."""
        return self.choice.json_schema()

    def read(self, raw: object, info: ValidationInfo) -> Section:
        """The mapping, read as the section that `choose` picks."""
        return self.choice.read(raw, info)


def reference(section: type[Section]) -> JsonSchemaValue:
    """A reference to the JSON Schema of a section, which the schema of the whole document has by name."""
    return {SECTION: section.__name__}


def _read_title(raw: object, info: ValidationInfo) -> str:
    """A text; a number is one, too, as `13.2` may name a problem."""
    if isinstance(raw, bool) or not isinstance(raw, str | int | float | Decimal):
        raise ValueProblem(f"read {shown(raw)}, expected a text")
    return str(raw)


Title = Annotated[str, ReadBy(_read_title, {"type": ["string", "number"]})]
"""A text that may look like a number."""


def _read_file(raw: object, info: ValidationInfo) -> pathlib.Path:
    if not isinstance(raw, str):
        raise ValueProblem(f"read {shown(raw)}, expected the name of a file, such as bracket.stl or arm.urdf")
    return environment(info).file(raw)


FileName: TypeAlias = Annotated[pathlib.Path, ReadBy(_read_file, {"type": "string"})]
"""The path of a file that is named beside the document, which is taken note of."""
