"""A section: a mapping of the document, with given keys and types; and marks that say how a key is read.

The errors of all its keys are reported together, with a cure where there is one.
"""

# Annotations here are objects, not texts: pydantic reads those of a section for all that are built on it.

import pathlib
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property
from importlib import import_module
from types import UnionType
from typing import Annotated, Any, ClassVar, Self, TypeAlias, get_args, get_origin

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ModelWrapValidatorHandler,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, InitErrorDetails, core_schema
from pydantic_core.core_schema import ValidatorFunctionWrapHandler

from rigidcli.errors import LONGEST_SHOWN, UNKNOWN_KEY, Path, ValueProblem, in_yaml, shown
from rigidcli.fields import words
from rigidcli.fields.environment import Environment
from rigidcli.suggestions import did_you_mean, nearest

# A key with a unit behind it: `side_cm`, `side (cm)`.
_WITH_UNIT = re.compile(r"(\w+?)[ _]?[(\[ _]([^\W\d]\w*)[)\]]?")


class Section(BaseModel):
    """A mapping of the document: unknown keys and wrong types are refused, and the fields do not change.

    `ONE_OF` and each of `AT_MOST_ONE_OF` name keys that exclude each other; of the former one must be given.
    A key of `NEEDS` makes sense only beside the other one; one of `INSIDE` is a key of the section there.
    Validators are built for sections that are read.
    """

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", defer_build=True)

    EXAMPLE: ClassVar[str] = ""
    ONE_OF: ClassVar[tuple[str, ...]] = ()
    AT_MOST_ONE_OF: ClassVar[tuple[tuple[str, ...], ...]] = ()
    NEEDS: ClassVar[Mapping[str, str]] = {}
    INSIDE: ClassVar[Mapping[str, str]] = {}

    @model_validator(mode="wrap")
    @classmethod
    def _report_keys(
        cls, raw: object, validate: ModelWrapValidatorHandler[Self], info: ValidationInfo
    ) -> Self:
        if not isinstance(raw, dict):
            return validate(raw)
        fields = cls.__pydantic_fields__  # `model_fields` is the same, and looks it up in a roundabout way
        typed, problems = dict[Path, Path](), list[ValueProblem]()
        if not raw.keys() <= fields.keys():
            raw, problems = cls._meant(raw, environment(info), typed)
        problems += cls._contradictions(raw)
        if not problems:
            return validate(raw)
        read: Self = refuse(cls.__name__, problems, lambda: validate(raw), typed)
        return read

    @classmethod
    def _meant(
        cls, raw: Mapping[str, Any], env: Environment, typed: dict[Path, Path]
    ) -> tuple[dict[str, Any], list[ValueProblem]]:
        """The mapping with the keys that were meant in place of unknown ones, so that all values are read.

        With it come the problems of the keys that the section does not have. `typed` maps the paths of such
        values, as they are read, to their paths in the document.
        """
        fields = cls.model_fields.keys()
        raw, cut = words.bracketed(raw)
        problems = list[ValueProblem]()
        for key, entries, given in list(words.lists_meant(raw, fields)):
            typing = cls.model_fields[key].annotation
            if get_origin(typing) is tuple and len(get_args(typing)) != len(entries):
                continue
            hint = f"write `{key}: {in_yaml(entries)}` for `{'`, `'.join(given)}`"
            problems.append(unknown_key(key, hint).below(given[0]))
            raw = {name: value for name, value in raw.items() if name not in given} | {key: entries}
            typed[key,] = (given[0],)
        meant = {key: value for key, value in raw.items() if key in fields}
        for key in [key for key in raw if key not in fields]:
            problem, value = cls._stranger(key, raw, env).below(key), raw[key]
            if isinstance(value, dict) and value and value.keys() <= fields - meant.keys():
                hint = f"leave out `{key}:`: its keys stand here"
                problem = ValueProblem("unknown key", path=(key,), hint=hint)
                meant |= value
                typed |= {(name,): (key, name) for name in value}
            problems.append(problem)
            if problem.meant and problem.meant[0] in fields and _put(meant, problem.meant, value):
                typed[problem.meant] = (key,)
        for problem in problems:
            problem.code = UNKNOWN_KEY
        return meant, [*cut, *problems]

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        for keys in filter(None, (cls.ONE_OF, *cls.AT_MOST_ONE_OF)):
            given = [key for key in keys if raw.get(key) is not None]
            if len(given) > 1 or (not given and keys is cls.ONE_OF):
                named = " and ".join(f"`{key}`" for key in given or keys)
                expected = "exactly one" if keys is cls.ONE_OF else "at most one"
                which = ("both", "neither") if len(given or keys) == 2 else ("all", "none")
                yield ValueProblem(f"{which[not given]} of {named} given, expected {expected}")
        for key, needed in cls.NEEDS.items():
            if raw.get(key) is not None and raw.get(needed) is None:
                yield ValueProblem(f"there is no `{needed}` beside it", path=(key,))

    @classmethod
    def _stranger(cls, key: str, raw: Mapping[str, Any], env: Environment) -> ValueProblem:
        from rigidcli.fields.units import is_unit

        unit = _WITH_UNIT.fullmatch(key) if len(key) <= LONGEST_SHOWN else None
        name = cls.called(unit[1], raw) if unit and is_unit(unit[2]) else None
        if unit and name:
            hint = f"a unit stands behind the number: write `{name}: {raw[key]} {unit[2]}`"
            return unknown_key(name, hint if isinstance(raw[key], int | Decimal) else None)
        if key in cls.INSIDE:
            return cls._belongs_inside(cls.INSIDE[key], key, raw[key])
        if (slip := words.key_slip(key, cls.model_fields)) is not None:
            return slip
        elsewhere = cls._elsewhere(key, raw, env) if cls.called(key, raw) is None else None
        return elsewhere or cls._unknown(key, raw, env)

    @classmethod
    def _elsewhere(cls, key: str, raw: Mapping[str, Any], env: Environment) -> ValueProblem | None:
        sections = env.places()
        if "" in sections.get(key, ()):
            return ValueProblem("belongs at the top of the document")
        own = set.intersection(*({*sections.get(name, ())} for name in cls.model_fields))
        names = [name for name in sections.get(key, ()) if name != "frame"]  # any rotation has its keys
        if not names or not own.isdisjoint(names):
            return None
        name = names[-1 if "system" in own else 0]
        hint = f"write `{name}: {{{key}: ...}}` at the top of the document"
        return ValueProblem(f"belongs inside `{name}`", hint=hint, meant=(name, key))

    @classmethod
    def _unknown(cls, key: str, raw: Mapping[str, Any], env: Environment) -> ValueProblem:
        keys = list(cls.model_fields)
        near = cls.called(key, raw)
        if near is None and (hint := words.HINTS.get(words.folded(key))) is not None:
            return ValueProblem("unknown key", hint=hint)
        # A section or a list under the guessed key is read, too, so that the guess must be a good one.
        # A key of other sections is hardly a misspelt one of this section.
        alike = 0.75 if isinstance(raw[key], dict | list) else 0.65 if key in words.KEYS_BY_WORD else 0.6
        near = near or nearest(key, keys, alike)
        return unknown_key(near) if near is not None else cls._unguessed(key, raw, env)

    @classmethod
    def _unguessed(cls, key: str, raw: Mapping[str, Any], env: Environment) -> ValueProblem:
        """The problem of a key that is like none of the section."""
        return ValueProblem("unknown key", hint=f"known keys here: {', '.join(cls.model_fields)}")

    @staticmethod
    def _belongs_inside(section: str, key: str, value: object) -> ValueProblem:
        hint = f"write `{section}: {in_yaml({key: value})}`"
        return ValueProblem(f"belongs inside `{section}`", hint=hint, meant=(section, key))

    @classmethod
    def called(cls, word: str, raw: Mapping[str, Any]) -> str | None:
        """The missing key that `word` is a synonym of."""
        free = (key for key in words.keys_called(word) if key in cls.model_fields and raw.get(key) is None)
        return next(free, None)

    def keep(self, **values: object) -> None:
        """Keep values beside the fields, as a cached property does."""
        # A private attribute of pydantic takes ten times as long to look up.
        self.__dict__.update(values)


def _put(tree: dict[Any, Any], path: Path, value: object) -> bool:
    """Put a value into a mapping, or a copy of one in it, unless one stands there; whether that was done."""
    *above, key = path
    for step in above:
        inside = tree.get(step)
        if not isinstance(inside, dict | None):
            return False
        tree[step] = {**(inside or {})}
        tree = tree[step]
    is_free = tree.get(key) is None
    if is_free:
        tree[key] = value
    return is_free


def unknown_key(meant: str, hint: str | None = None) -> ValueProblem:
    """The problem of a key that is written for the key `meant`."""
    return ValueProblem(f"unknown key{did_you_mean(meant)}", hint=hint, meant=(meant,))


def optional(says: str, default: Any = None) -> Any:
    """A key that may be left out; `says` tells what it is."""
    return Field(default=default, description=says)


def environment(info: ValidationInfo) -> Environment:
    """The environment of the document that is read; an empty one outside a document."""
    return info.context if isinstance(info.context, Environment) else Environment()


def refuse(
    title: str,
    problems: Sequence[ValueProblem],
    rest: Callable[[], Any] = lambda: None,
    typed: Mapping[Path, Path] = {},
) -> Any:
    """Raise these problems of a value together with those of its `rest`; without any, return the rest.

    `typed` maps paths in the rest to those in the document, if they differ.
    """
    errors = [
        InitErrorDetails(type="value_error", loc=(), input=None, ctx={"error": problem})
        for problem in problems
    ]
    try:
        value = rest()
    except ValidationError as error:
        for each in details(error):
            loc = each["loc"]
            end = next((end for end in range(len(loc), 0, -1) if loc[:end] in typed), 0)
            errors.append(each | {"loc": (*typed.get(loc[:end], ()), *loc[end:])})
    if errors:
        raise ValidationError.from_exception_data(title, errors)
    return value


def details(error: ValidationError, *path: str | int) -> Iterator[InitErrorDetails]:
    """The errors of pydantic in a value, with their places after the `path` to the value."""
    for e in error.errors(include_url=False):
        yield InitErrorDetails(type=e["type"], loc=(*path, *e["loc"]), input=e["input"], ctx=e.get("ctx", {}))


# --- marks on fields: how an entry becomes the value of a field, and its JSON Schema

# Placeholder for `$ref` in the JSON Schema of one section, because bodies are recursive.
SECTION_REFERENCE = "x-section"
SHARED_SCHEMA = "x-shared"  # key with the name of the schema beside it, which is written once under `$defs`


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


class Alternative:
    """Marks a field of the type `otherwise` that also takes an entry of another type, `kind`.

    `value` makes the value of the field from such an entry; `schema` is the JSON Schema of the entry.
    """

    otherwise: Any

    def __init__(
        self,
        kind: type | UnionType,
        value: Callable[[Any, Environment], object],
        otherwise: Any,
        schema: JsonSchemaValue,
    ) -> None:
        self.kind, self.value, self.otherwise, self.schema = kind, value, otherwise, schema

    def read(self, raw: Any, rest: ValidatorFunctionWrapHandler, info: ValidationInfo) -> object:
        """The value of the field; `rest` is the validator of the type `otherwise`."""
        return self.value(raw, environment(info)) if isinstance(raw, self.kind) else rest(raw)

    def schemas(self, rest: JsonSchemaValue) -> list[JsonSchemaValue]:
        """The JSON Schemas of all entries, from that of the type `otherwise`."""
        return [self.schema, rest]

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_wrap_validator_function(
            self.read, handler.generate_schema(self.otherwise)
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {"anyOf": deepcopy(self.schemas(handler(schema)))}


@dataclass(frozen=True)
class SectionChoice(Reader):
    """Marks a field as one of several sections, which `choose` picks by the mapping in the document."""

    choose: Callable[[Mapping[str, Any]], type[Section]]
    options: Callable[[], Sequence[type[Section]]]
    example: str = ""  # a mapping that may stand there, for messages

    def json_schema(self) -> JsonSchemaValue:
        """The JSON Schema of a mapping that is one of the sections."""
        return {"oneOf": [reference(option) for option in self.options()]}

    def read(self, raw: object, info: ValidationInfo) -> Section:
        """The mapping, read as the section that `choose` picks."""
        if isinstance(raw, Section):
            return raw
        if not isinstance(raw, Mapping):
            message = f"read {shown(raw)}, expected a mapping{self.example and f', such as {self.example}'}"
            cure = words.with_colon(raw) if isinstance(raw, str) else None
            raise ValueProblem(message, hint=cure and words.AS_WRITTEN.format(cure), typed=cure and str(raw))
        return self.choose(raw).model_validate(raw, context=info.context)


def by_key(forms: Mapping[str, type[Section]], example: str = "") -> SectionChoice:
    """Marks a field that takes the section of the one key of `forms` that the mapping has."""

    def choose(raw: Mapping[str, Any]) -> type[Section]:
        present = [key for key in forms if key in raw]
        if len({forms[key] for key in present}) == 1:
            return forms[present[0]]
        read = " and ".join(f"`{key}`" for key in present) or "none of them"
        if len(present) > 1 and (empty := [key for key in present if raw[key] is None]):
            cure = "leave it out, or begin the lines that belong below it with more blanks"
            raise ValueProblem("read nothing", path=(empty[0],), hint=cure)
        if slips := [slip.below(key) for key in raw if (slip := words.key_slip(key, forms)) is not None]:
            raise slips[0]
        for key in raw if not present else ():
            if (hint := words.HINTS.get(words.folded(key))) is not None:
                raise ValueProblem("unknown key", path=(key,), hint=hint)
        called = [name for name, *_ in words.lists_meant(raw, forms)]
        called += [name for key in raw for name in words.keys_called(key) if name in forms]
        guess = next((name for name in (*called, *(nearest(key, forms) for key in raw)) if name), None)
        if guess is not None and not present:
            return forms[guess]  # which tells what is wrong with its keys
        raise ValueProblem(f"expected exactly one of {', '.join(forms)}; read {read}")

    return SectionChoice(choose, lambda: tuple(dict.fromkeys(forms.values())), example)


@dataclass(frozen=True)
class Elsewhere(Reader):
    """Marks a field that a section or a mark of another module reads, which is loaded when it is needed."""

    module: str
    name: str

    @cached_property
    def there(self) -> Reader:
        """The mark in the other module; a single section is a choice, too."""
        there: Any = getattr(import_module(self.module), self.name)
        if isinstance(there, Reader):
            return there
        return SectionChoice(lambda raw: there, lambda: (there,), there.EXAMPLE)

    def json_schema(self) -> JsonSchemaValue:
        """The JSON Schema of what the mark reads."""
        return self.there.json_schema()

    def read(self, raw: object, info: ValidationInfo) -> object:
        """The value that the mark reads."""
        return self.there.read(raw, info)


def reference(section: type[Section]) -> JsonSchemaValue:
    """A reference to the JSON Schema of a section, which stands under `$defs`."""
    return {SECTION_REFERENCE: section.__name__}


def _read_title(raw: object, info: ValidationInfo) -> str:
    # A number is a text, too, as `13.2` may name a problem.
    if isinstance(raw, bool) or not isinstance(raw, str | int | float | Decimal):
        raise ValueProblem(f"read {shown(raw)}, expected a text")
    return str(raw)


# A text that may look like a number.
Title = Annotated[str, ReadBy(_read_title, {"type": ["string", "number"]})]


def _read_file(raw: object, info: ValidationInfo) -> pathlib.Path:
    if not isinstance(raw, str):
        raise ValueProblem(f"read {shown(raw)}, expected the name of a file, such as bracket.stl or arm.urdf")
    return environment(info).file(raw)


# The path of a file that a document names, which is logged.
FileName: TypeAlias = Annotated[pathlib.Path, ReadBy(_read_file, {"type": "string"})]
