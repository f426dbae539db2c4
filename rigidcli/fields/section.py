"""A section: a mapping of the document, with given keys and types.

The errors of all its keys are reported together, with a cure where there is one.
"""

# Annotations here are objects, not texts: pydantic reads those of a section for all that are built on it.

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any, ClassVar, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic_core import InitErrorDetails

from rigidcli.errors import UNKNOWN, ValueProblem, nearest
from rigidcli.fields.environment import Environment
from rigidcli.fields.words import bracketed, key_slip, keys_called

GUESS = re.compile(r"^unknown (?:key|name) \(did you mean (\w+)")
"""The key that was meant by an unknown key: a further problem that it is missing would say nothing new."""


class Section(BaseModel):
    """A mapping of the document: unknown keys and wrong types are refused, and nothing changes later.

    `ONE_OF` and each of `AT_MOST_ONE_OF` name keys that exclude each other; of the former one must be given.
    A key of `NEEDS` makes sense only beside the other one. Validators are built for sections that are read.
    """

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", defer_build=True)

    ONE_OF: ClassVar[tuple[str, ...]] = ()
    AT_MOST_ONE_OF: ClassVar[tuple[tuple[str, ...], ...]] = ()
    NEEDS: ClassVar[Mapping[str, str]] = {}

    @model_validator(mode="wrap")
    @classmethod
    def _report_keys(
        cls, raw: object, validate: ModelWrapValidatorHandler[Self], info: ValidationInfo
    ) -> Self:
        """Refuse unknown, missing and contradicting keys here, together with all other errors."""
        if not isinstance(raw, dict):
            return validate(raw)
        fields = cls.__pydantic_fields__  # `model_fields` is the same, and looks it up in a roundabout way
        slips = list[ValueProblem]()
        if not raw.keys() <= fields.keys():
            raw, slips = bracketed(raw)
        meant, unknown = dict[str, Any](), list[ValueProblem]()
        for key in raw if not raw.keys() <= fields.keys() else ():
            if key not in fields:
                problem = cls._stranger(key, raw, environment(info).top_keys).below(key)
                problem.code = UNKNOWN
                unknown.append(problem)
                if guess := GUESS.search(problem.message):
                    meant[guess[1]] = raw[key]
        problems = [*unknown, *slips, *cls._contradictions({**meant, **raw})]
        if not problems:
            return validate(raw)
        allowed = {key: value for key, value in raw.items() if key in fields}
        read: Self = refuse(cls.__name__, problems, lambda: validate(allowed))
        return read

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        for keys in filter(None, (cls.ONE_OF, *cls.AT_MOST_ONE_OF)):
            given = [key for key in keys if raw.get(key) is not None]
            if len(given) > 1 or (not given and keys is cls.ONE_OF):
                words = " and ".join(f"`{key}`" for key in given or keys)
                expected = "exactly one" if keys is cls.ONE_OF else "at most one"
                which = ("both", "neither") if len(given or keys) == 2 else ("all", "none")
                yield ValueProblem(f"{which[not given]} of {words} given, expected {expected}")
        for key, needed in cls.NEEDS.items():
            if raw.get(key) is not None and raw.get(needed) is None:
                yield ValueProblem(f"there is no `{needed}` beside it", path=(key,))

    @classmethod
    def _stranger(cls, key: str, raw: Mapping[str, Any], top: Collection[str]) -> ValueProblem:
        """The problem of a key that the section does not have; `top` are the keys of the whole document."""
        if (slip := key_slip(key, cls.model_fields)) is not None:
            return slip
        if key in top and cls.called(key, raw) is None:
            return ValueProblem("belongs at the top of the document")
        return cls._unknown(key, raw)

    @classmethod
    def _unknown(cls, key: str, raw: Mapping[str, Any]) -> ValueProblem:
        """The problem of a key that the section does not have, with the key that may be meant."""
        keys = list(cls.model_fields)
        near = cls.called(key, raw) or nearest(key, keys)
        if near is not None:
            return ValueProblem(f"unknown key (did you mean {near}?)")
        return ValueProblem("unknown key", hint=f"known keys here: {', '.join(keys)}")

    @classmethod
    def called(cls, word: str, raw: Mapping[str, Any]) -> str | None:
        """The key of the section for which `word` stands, if there is one that `raw` does not give."""
        free = (key for key in keys_called(word) if key in cls.model_fields and raw.get(key) is None)
        return next(free, None)


def optional(words: str, default: Any = None) -> Any:
    """A key that may be left out; `words` say what it is."""
    return Field(default=default, description=words)


def environment(info: ValidationInfo) -> Environment:
    """The environment in which `info` says that a document is read; a plain one outside a document."""
    return info.context if isinstance(info.context, Environment) else Environment()


def refuse(title: str, problems: Sequence[ValueProblem], rest: Callable[[], Any] = lambda: None) -> Any:
    """Raise the problems of one value together, with those that reading the `rest` of it raises.

    Every problem has the path that leads to it. Without problems, this returns the value of the rest.
    """
    errors = [
        InitErrorDetails(type="value_error", loc=(), input=None, ctx={"error": problem})
        for problem in problems
    ]
    try:
        value = rest()
    except ValidationError as error:
        errors += details(error)
    if errors:
        raise ValidationError.from_exception_data(title, errors)
    return value


def details(error: ValidationError, *path: str | int) -> Iterator[InitErrorDetails]:
    """The errors of pydantic in a value, with their places after the `path` to the value."""
    for e in error.errors(include_url=False):
        yield InitErrorDetails(type=e["type"], loc=(*path, *e["loc"]), input=e["input"], ctx=e.get("ctx", {}))
