"""What all parts of the document are made of: sections, numbers with a dimension, choices of form."""

# Annotations here are objects, not texts: pydantic reads those of a section for all that are built on it.

import pathlib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from decimal import Decimal
from importlib import import_module
from types import UnionType
from typing import Annotated, Any, ClassVar, Literal, Self, TypeAlias, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ModelWrapValidatorHandler,
    Strict,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, InitErrorDetails, core_schema

from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.errors import UNKNOWN, ValueProblem, nearest, shown
from rigidcli.model import units
from rigidcli.model.environment import Environment, number_of
from rigidcli.model.several import Several
from rigidcli.model.words import keys_called, with_colon

SECTION = "x-section"
"""Key that stands for `$ref` in the JSON Schema of one section, as bodies contain bodies."""

SHARED = "x-shared"
"""Key with the name of the schema that stands under `schema` beside it: written once, and referred to."""


class Section(BaseModel):
    """A mapping of the document: unknown keys and wrong types are refused, and nothing changes later.

    `ONE_OF` and `AT_MOST_ONE_OF` name keys that exclude each other; of the former one must be given. The
    validator is built when the first such section is read: a document uses two or three of thirty.
    """

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", defer_build=True)

    ONE_OF: ClassVar[tuple[str, ...]] = ()
    AT_MOST_ONE_OF: ClassVar[tuple[str, ...]] = ()

    @model_validator(mode="wrap")
    @classmethod
    def _report_keys(cls, raw: object, validate: ModelWrapValidatorHandler[Self]) -> Self:
        """Refuse unknown, missing and contradicting keys here, beside whatever else is wrong."""
        if not isinstance(raw, dict):
            return validate(raw)
        fields = cls.model_fields
        unknown = [key for key in raw if key not in fields]
        problems = [(_slip(key, cls.model_fields) or cls._unknown(key, raw)).below(key) for key in unknown]
        for problem in problems:
            problem.code = UNKNOWN
        problems += cls._contradictions(raw)
        if not problems:
            return validate(raw)
        known = {key: value for key, value in raw.items() if key in cls.model_fields}
        read: Self = refuse(cls.__name__, problems, lambda: validate(known))
        return read

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        for keys, least, expected in ((cls.ONE_OF, 1, "exactly"), (cls.AT_MOST_ONE_OF, 0, "at most")):
            given = [key for key in keys if raw.get(key) is not None]
            if keys and not least <= len(given) <= 1:
                words = " and ".join(f"`{key}`" for key in given or keys)
                which = "both" if given else "neither"
                yield ValueProblem(f"{which} of {words} given, expected {expected} one")

    @classmethod
    def _unknown(cls, key: str, raw: Mapping[str, Any]) -> ValueProblem:
        """The problem of a key that the section does not have."""
        known = list(cls.model_fields)
        called = cls.called(key, raw)
        top = import_module("rigidcli.model.document").Document.model_fields
        if called is None and key in top:
            for name, field in top.items():
                if cls in sections_in(field.annotation):
                    return ValueProblem(f"belongs beside `{name}`, at the top of the document")
        near = called or nearest(key, known)
        if near is not None:
            return ValueProblem(f"unknown key (did you mean {near}?)")
        return ValueProblem("unknown key", hint=f"known keys here: {', '.join(known)}")

    @classmethod
    def called(cls, word: str, raw: Mapping[str, Any]) -> str | None:
        """The key of the section for which `word` stands, if there is one that `raw` does not give."""
        free = (key for key in keys_called(word) if key in cls.model_fields and raw.get(key) is None)
        return next(free, None)


_AS_WRITTEN = "write `{}`: a colon, and a blank after it"
"""What to do about a key and its value that have become one text."""


def _slip(key: str, known: Collection[str]) -> ValueProblem | None:
    """The problem of a key such as `shape:cube`, which is one of the `known` keys with its value."""
    if key[:1].isdigit():
        hint = "a comma begins the next entry; the sign in a decimal is a point"
        return ValueProblem("no key and value", hint=hint, typed=key)
    cure = with_colon(key)
    if cure is None or {cure.partition(":")[0], *keys_called(cure.partition(":")[0])}.isdisjoint(known):
        return None
    return ValueProblem("no key and value", hint=_AS_WRITTEN.format(cure), typed=key)


def refuse(title: str, problems: Sequence[ValueProblem], rest: Callable[[], Any] = lambda: None) -> Any:
    """Raise the problems of one value together, with those that reading the `rest` of it raises.

    Each has the path that leads to it. Without any problem, what the rest is.
    """
    errors = [
        InitErrorDetails(type="value_error", loc=(), input=None, ctx={"error": problem})
        for problem in problems
    ]
    try:
        value = rest()
    except ValidationError as error:
        errors += [
            InitErrorDetails(type=e["type"], loc=e["loc"], input=e["input"], ctx=e.get("ctx", {}))
            for e in error.errors(include_url=False)
        ]
    if errors:
        raise ValidationError.from_exception_data(title, errors)
    return value


def environment(info: ValidationInfo) -> Environment:
    """The environment in which `info` says that a document is read; a plain one outside a document."""
    return info.context if isinstance(info.context, Environment) else Environment()


class Reader:
    """Marks a field with a reader of its own: `read` turns what is written into what the field holds.

    It raises ValueProblem. `json_schema` gives the JSON Schema of what may be written.
    """

    read: Callable[[Any, ValidationInfo], Any]
    json_schema: Callable[[], JsonSchemaValue]

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        # pydantic adds defaults to what it gets, which is not for other fields of the same kind.
        return deepcopy(self.json_schema())


@dataclass(frozen=True, eq=False)
class ReadBy(Reader):
    """Marks a field that a function, `read`, reads; `schema` is its JSON Schema."""

    read: Callable[[Any, ValidationInfo], Any]
    schema: JsonSchemaValue

    def json_schema(self) -> JsonSchemaValue:
        """The schema that was given."""
        return self.schema


def _read_title(raw: object, info: ValidationInfo) -> str:
    """A text; a number is one, too, as `13.2` may name a problem."""
    if isinstance(raw, bool) or not isinstance(raw, str | int | float | Decimal):
        raise ValueProblem(f"read {shown(raw)}, expected a text")
    return str(raw)


Title = Annotated[str, ReadBy(_read_title, {"type": ["string", "number"]})]
"""A text that may look like a number."""

LIMITS: dict[units.Dimension | None, float] = {
    units.LENGTH: 1e50,
    units.MASS: 1e100,
    units.MOMENT_OF_INERTIA: 1e200,
}
"""The largest number of a dimension, in SI units; its inverse is the least. No formula goes beyond floats."""

FULL_TURN = 6.2832
"""A bare number beyond this (rad) is probably an angle in degrees; 2 pi, as it is typed, is not beyond it."""

DEFAULT_LIMIT = 1e160
"""The limit of numbers of other dimensions."""


@dataclass(frozen=True)
class Quantity(Reader):
    """Marks a field as a number with a dimension, which becomes an SI value once, when it is read.

    A dimension of None is any.
    """

    dimension: units.Dimension | None
    sign: Literal["positive", "nonnegative"] | None = None

    def json_schema(self) -> JsonSchemaValue:
        """A number, or a text for one, under a name of its own."""
        number: dict[str, object] = {"type": "number"}
        if self.sign is not None:
            number["exclusiveMinimum" if self.sign == "positive" else "minimum"] = 0
        text = f"{self.words}; or a quantity with a unit, or an expression in the parameters"
        name = " ".join(filter(None, [self.sign, str(self.dimension or "number").partition(" (")[0]]))
        body = {"anyOf": [number, {"type": "string"}], "description": text[0].upper() + text[1:]}
        return {SHARED: name.replace(" ", "-"), "schema": body}

    @property
    def words(self) -> str:
        """What is expected, in words."""
        return number_of(self.dimension, self.sign)

    def read(self, raw: object, info: ValidationInfo) -> Scalar:
        """The SI value, of a size and sign that fit."""
        env = environment(info)
        if isinstance(raw, Several) and (
            raw.unit is None or (self.dimension == units.ANGLE and not raw.unit)
        ):
            many: Scalar = raw.read(lambda one: self.read(one, info), env.notes)
            return many
        value: Scalar = env.read(raw, self.dimension)
        is_bare = self.dimension == units.ANGLE and isinstance(raw, int | float | Decimal)
        if is_bare and abs(float(str(raw))) > FULL_TURN:
            env.notes.append(f"an angle of {raw} rad is beyond a full turn; {raw} deg meant?")
        limit = LIMITS.get(self.dimension, DEFAULT_LIMIT)
        if not env.arithmetic.exact and value and not 1 / limit <= abs(value) <= limit:
            raise ValueProblem(
                f"read {shown(raw)}, expected {self.words} from {1 / limit:.0e} to {limit:.0e}"
            )
        if self.sign is not None:
            sign = env.arithmetic.sign(value)
            if sign == -1 or (sign == 0 and self.sign == "positive"):
                worked = "" if not isinstance(raw, str) else f" (which is {env.arithmetic.size(value):.6g})"
                raise ValueProblem(f"read {shown(raw)}{worked}, expected {self.words}")
            if sign is None:
                env.assume_positive(value)
        return value


def _read_whole(raw: object, info: ValidationInfo) -> int:
    """A whole number, be it written as one, as 3.0 or as an expression."""
    env = environment(info)
    value = env.arithmetic.value(env.read(raw, units.DIMENSIONLESS))
    if value is None or not value.is_integer():
        worked = f" (which is {value:.6g})" if isinstance(raw, str) and value is not None else ""
        raise ValueProblem(f"read {shown(raw)}{worked}, expected a whole number")
    return int(value)


def limited(fits: Callable[[Any, Arithmetic], bool], expected: str, unit: str = "") -> AfterValidator:
    """Marks a number that is refused where it does not fit; `expected` says in words what does."""

    def check(value: Scalar, info: ValidationInfo) -> Scalar:
        n = environment(info).arithmetic
        if not fits(value, n):
            hint = f"{n.size(value):.6g} deg meant?" if unit == " rad" else None
            raise ValueProblem(f"read {n.size(value):.6g}{unit}, expected {expected}", hint=hint)
        return value

    return AfterValidator(check)


Mass = Annotated[Scalar, Quantity(units.MASS, "positive")]
Length = Annotated[Scalar, Quantity(units.LENGTH, "positive")]
OptionalLength = Annotated[Scalar, Quantity(units.LENGTH, "nonnegative")]
Coordinate = Annotated[Scalar, Quantity(units.LENGTH)]
Angle = Annotated[Scalar, Quantity(units.ANGLE)]
PolarAngle = Annotated[
    Angle, limited(lambda x, n: -1 not in (n.sign(x), n.sign(n.pi - x)), "an angle from 0 to 180 deg", " rad")
]
AngularVelocity = Annotated[Scalar, Quantity(units.ANGULAR_VELOCITY)]
MomentOfInertia = Annotated[Scalar, Quantity(units.MOMENT_OF_INERTIA)]
PrincipalMoment = Annotated[Scalar, Quantity(units.MOMENT_OF_INERTIA, "nonnegative")]
PositiveMoment = Annotated[Scalar, Quantity(units.MOMENT_OF_INERTIA, "positive")]
Time = Annotated[Scalar, Quantity(units.TIME)]
Duration = Annotated[Scalar, Quantity(units.TIME, "positive")]
Number = Annotated[Scalar, Quantity(units.DIMENSIONLESS)]
WholeNumber = Annotated[int, ReadBy(_read_whole, {"type": ["integer", "string"]})]

# A YAML list is read as a tuple; everything else stays strict.
AsList = Strict(False)
Vector3 = Annotated[tuple[Coordinate, Coordinate, Coordinate], AsList]
Direction = Annotated[tuple[Number, Number, Number], AsList]
Rates3 = Annotated[tuple[AngularVelocity, AngularVelocity, AngularVelocity], AsList]


def reference(section: type[Section]) -> JsonSchemaValue:
    """JSON Schema of a section, by its name; the schema of the whole document has them all."""
    return {SECTION: section.__name__}


@dataclass(frozen=True)
class Choice(Reader):
    """Marks a field as one of several sections, told apart by `choose` from the mapping as read."""

    choose: Callable[[Mapping[str, Any]], type[Section]]
    options: Callable[[], Sequence[type[Section]]]
    example: str = ""
    """A mapping that may stand there, for messages."""

    def json_schema(self) -> JsonSchemaValue:
        """One of the sections."""
        return {"oneOf": [reference(option) for option in self.options()]}

    def read(self, raw: object, info: ValidationInfo) -> Section:
        """The section that was chosen."""
        if isinstance(raw, Section):
            return raw
        if not isinstance(raw, Mapping):
            message = f"read {shown(raw)}, expected a mapping{self.example and f', such as {self.example}'}"
            if isinstance(raw, str) and (cure := with_colon(raw)) is not None:
                raise ValueProblem(message, hint=_AS_WRITTEN.format(cure), typed=raw)
            raise ValueProblem(message)
        return self.choose(raw).model_validate(raw, context=info.context)


@dataclass(frozen=True, slots=True, eq=False)
class Alternative:
    """Marks a field in which a value of another type (`kind`) may stand for what it otherwise holds.

    `read` makes of that value what the field then holds; `schema` is its JSON Schema.
    """

    kind: type | UnionType
    read: Callable[[Any, Environment], object]
    otherwise: Any
    schema: JsonSchemaValue

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        def read(
            raw: object, otherwise: core_schema.ValidatorFunctionWrapHandler, info: ValidationInfo
        ) -> object:
            return self.read(raw, environment(info)) if isinstance(raw, self.kind) else otherwise(raw)

        return core_schema.with_info_wrap_validator_function(read, handler.generate_schema(self.otherwise))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {"anyOf": [deepcopy(self.schema), handler(schema)]}


def by_key(forms: Mapping[str, type[Section]], example: str = "") -> Choice:
    """Marks a field that takes the section of the one key of `forms` that the mapping has."""

    def choose(raw: Mapping[str, Any]) -> type[Section]:
        present = [key for key in forms if key in raw]
        if len({forms[key] for key in present}) == 1:
            return forms[present[0]]
        read = " and ".join(f"`{key}`" for key in present) or "none of them"
        if slips := [slip.below(key) for key in raw if (slip := _slip(key, forms)) is not None]:
            raise slips[0]
        called = [name for key in raw for name in keys_called(key) if name in forms]
        guess = next((name for name in (*called, *(nearest(key, list(forms)) for key in raw)) if name), None)
        also = f" (did you mean {guess}?)" if guess and not present else ""
        raise ValueProblem(f"expected exactly one of {', '.join(forms)}; read {read}{also}")

    return Choice(choose, lambda: tuple(dict.fromkeys(forms.values())), example)


@dataclass(frozen=True)
class Elsewhere(Reader):
    """Marks a field for a section, or a choice, of another module, loaded when there is one to read."""

    module: str
    name: str

    @property
    def choice(self) -> Choice:
        """The choice; one section is a choice, too."""
        there = getattr(import_module(self.module), self.name)
        return there if isinstance(there, Choice) else Choice(lambda raw: there, lambda: (there,))

    def json_schema(self) -> JsonSchemaValue:
        """That of the choice."""
        return self.choice.json_schema()

    def read(self, raw: object, info: ValidationInfo) -> Section:
        """The section that was chosen."""
        return self.choice.read(raw, info)


def sections_in(annotation: Any) -> list[type[Section]]:
    """The sections that a field of this type may hold, at any depth of its lists and choices."""
    if isinstance(annotation, Alternative):
        return sections_in(annotation.otherwise)
    if isinstance(annotation, Choice | Elsewhere):
        choice = annotation.choice if isinstance(annotation, Elsewhere) else annotation
        return list(choice.options())
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [annotation]
    *types, metadata = (*get_args(annotation), getattr(annotation, "__metadata__", ()))
    marked = [section for mark in metadata for section in sections_in(mark)]
    return marked or list(dict.fromkeys(section for part in types for section in sections_in(part)))


def not_one_of(raw: object, words: Sequence[str]) -> str:
    """The message for a value that is none of the `words`."""
    called = [key for key in keys_called(raw) if key in words] if isinstance(raw, str) else []
    near = called[0] if called else nearest(raw, list(words)) if isinstance(raw, str) else None
    if near is not None:
        return f"read {shown(raw)} (did you mean {near}?)"
    return f"read {shown(raw)}, expected one of {', '.join(words)}"


def _read_file(raw: object, info: ValidationInfo) -> pathlib.Path:
    if not isinstance(raw, str):
        raise ValueProblem(f"read {shown(raw)}, expected the name of a file, such as bracket.stl or arm.urdf")
    return environment(info).file(raw)


FileName: TypeAlias = Annotated[pathlib.Path, ReadBy(_read_file, {"type": "string"})]
"""The path of a file that is named beside the document, which is taken note of."""


def _read_point(raw: str, env: Environment) -> str:
    if raw not in ("origin", "com"):
        raise ValueProblem(not_one_of(raw, ("origin", "com")))
    return raw


Point: TypeAlias = Annotated[
    tuple[Scalar, Scalar, Scalar] | str,
    Alternative(str, _read_point, otherwise=Vector3, schema={"enum": ["origin", "com"]}),
]

ReferencePoint: TypeAlias = Annotated[
    tuple[Scalar, Scalar, Scalar] | str,
    Alternative(str, lambda raw, env: raw, otherwise=Vector3, schema={"type": "string"}),
]
"""A point of the document, which may have a name."""
