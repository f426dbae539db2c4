"""The whole document: a body, how it turns and what makes it precess; a system of any kind, and its orbit."""

from __future__ import annotations

import pathlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import copy
from functools import cache, cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from pydantic import Field, PrivateAttr, TypeAdapter, ValidationError, ValidationInfo, model_validator
from pydantic_core import InitErrorDetails

from rigidcli.bodies.rotations import Rotation
from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.document.origins import Origin
from rigidcli.document.parameters import definitions
from rigidcli.document.physical import Physical
from rigidcli.errors import DocumentError, Problem, ValueProblem
from rigidcli.fields.environment import Environment
from rigidcli.fields.quantities import Direction, ReferencePoint
from rigidcli.fields.readers import Elsewhere, ReadBy, Title
from rigidcli.fields.section import Section, details, environment, optional, sections_in
from rigidcli.fields.words import keys_called, not_one_of
from rigidcli.language.expression import Expression

if TYPE_CHECKING:
    from rigidcli.bodies.bodies import Body
    from rigidcli.document.ensembles import Ensemble, Shared
    from rigidcli.document.equilibrium import Equilibrium
    from rigidcli.document.motion import Motion
    from rigidcli.document.orbit import Orbit
    from rigidcli.document.system import System
    from rigidcli.document.tide import Tide
    from rigidcli.document.top import Top
    from rigidcli.document.transform import Transform
else:
    # Loaded when a document has the section, as no document has all of them.
    Equilibrium = Any
    Body = Annotated[Section, Elsewhere("rigidcli.bodies.bodies", "BODY")]
    Motion, Orbit, System, Tide, Top, Transform = (
        Annotated[Section, Elsewhere(f"rigidcli.document.{name.lower()}", name)]
        for name in ("Motion", "Orbit", "System", "Tide", "Top", "Transform")
    )

_COORDINATES = {"type": "object", "additionalProperties": {"type": ["number", "string"]}}
_EQUILIBRIUM = ReadBy(
    lambda raw, info: import_module("rigidcli.document.equilibrium").read_equilibrium(raw, info),
    {"anyOf": [_COORDINATES, {"type": "object", "properties": {"find": {"title": "Find", **_COORDINATES}}}]},
)

NOWHERE = Origin("", pathlib.Path(), {})
"""The origin of a document that was made, and not read."""


class Document(Section):
    """A system as a person describes it. Numbers are SI values, or exact; `arithmetic` says which."""

    name: Title | None = optional("What results call it; else the name of the file")
    description: Title | None = optional("What people should know; nothing reads it")
    parameters: dict[str, Any] | None = Field(
        default=None,
        description="Values for names in expressions; null makes a symbol, and the document exact",
        json_schema_extra={"additionalProperties": {"type": ["number", "string", "null"]}},
    )
    body: Body | None = optional("A rigid body, in one of several forms")
    about: ReferencePoint = Field(
        default="origin",
        description="The point O of the tensor: `origin`, `com`, an anchor of the shape, or [x, y, z] (m); "
        "a molecule has its centre of mass by default",
    )
    axis: Direction | None = optional(
        "Direction of the axis through that point about which the moment is asked"
    )
    frame: Rotation | None = optional("Axes for every vector and tensor of the results")
    motion: Motion | None = None
    top: Top | None = None
    tide: Tide | None = None
    # Orbit, equilibrium and transform come after the system, because they use its coordinates.
    system: System | None = None
    orbit: Orbit | None = None
    equilibrium: Annotated[Equilibrium, _EQUILIBRIUM] | None = optional(
        "Coordinates of an equilibrium, for small oscillations; or values near it, under `find`"
    )
    transform: Transform | None = None

    NEEDS: ClassVar = dict.fromkeys(("orbit", "equilibrium", "transform"), "system")

    _environment: Environment = PrivateAttr()
    _origin: Origin = PrivateAttr(default_factory=lambda: NOWHERE)
    _notes: tuple[str, ...] = PrivateAttr(default=())

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        yield from super()._contradictions(raw)
        about, body = raw.get("about"), raw.get("body")
        if isinstance(about, str) and about not in (points := ["origin", "com"]):
            shapes = import_module("rigidcli.bodies.shapes").SHAPES
            name = body.get("shape") if isinstance(body, dict) else None
            points += shapes[name].ANCHORS if isinstance(name, str) and name in shapes else ()
            if about not in points:
                yield ValueProblem(not_one_of(about, points), path=("about",))

    @classmethod
    def _unknown(cls, key: str, raw: Mapping[str, Any]) -> ValueProblem:
        if key in ("questions", "answers"):
            what = "an assignment" if key == "questions" else "an answer file"
            hint = f"this is {what}: `rigidcli check ASSIGNMENT ANSWERS`"
            return ValueProblem("belongs to no document", hint=hint)
        for word in (key, *keys_called(key)) if cls.called(key, raw) is None else ():
            if sections := _sections_with().get(word):
                # Beside a system, a duration is that of the orbit, not of a motion.
                name = sections[-1 if raw.get("system") is not None else 0]
                hint = f"write `{name}: {{{word}: ...}}`; its path is `{name}.{word}`"
                if name in raw and raw[name] is None:
                    hint = f"begin this line with two blanks, so that it is below `{name}:`"
                return ValueProblem(f"belongs inside `{name}`", hint=hint)
        return super()._unknown(key, raw)

    @model_validator(mode="after")
    def _remember(self, info: ValidationInfo) -> Self:
        self._environment = environment(info)
        if self.body is not None and self.body.rounding is not None and "about" not in self.model_fields_set:
            self.__dict__["about"] = "com"  # of a molecule, whose origin means nothing
        self._require_whole()
        return self

    def _require_whole(self) -> None:
        if self.body is not None and self.body.hole:
            raise ValueProblem("a hole stands in `parts`, beside what it is cut from", path=("body", "hole"))

    @cached_property
    def arithmetic(self) -> Arithmetic:
        """The kind of number in which the document is worked."""
        return self._environment.arithmetic

    @property
    def exact_results(self) -> bool:
        """Whether exact results are wanted: by the user, or because a parameter has no value."""
        return self._environment.exact_results

    @property
    def values(self) -> Mapping[str, Scalar]:
        """The parameters that have a value, in SI units."""
        return self._environment.parameters

    @property
    def symbols(self) -> tuple[str, ...]:
        """The parameters without a value that something uses."""
        env = self._environment
        return tuple(name for name, on in env.open.items() if name in on and name in env.used)

    @property
    def unused(self) -> list[str]:
        """The parameters that nothing uses."""
        env = self._environment
        return sorted((env.parameters.keys() | env.open.keys()) - env.used)

    @cached_property
    def definitions(self) -> Mapping[str, Expression | None]:
        """The parameters as they are given, exactly: each after those it uses, None for a symbol."""
        return definitions(self._environment, self.parameters or {})

    @property
    def files(self) -> Sequence[pathlib.Path]:
        """The files that the document names."""
        return self._environment.files

    @property
    def source(self) -> str:
        """Where the document was read from, as the user named it."""
        return self._origin.source

    @property
    def notes(self) -> tuple[str, ...]:
        """What the reader of the document should know about it."""
        return self._notes

    @property
    def text(self) -> str:
        """What was typed; below it, in comments, what was set from outside."""
        return self._origin.whole

    def came_from(self, origin: Origin, notes: Sequence[str]) -> Self:
        """The document with what it was read from, and notes on that."""
        self._origin, self._notes = origin, tuple(notes)
        return self

    def problem(self, message: str, key: str, *, hint: str | None = None) -> Problem:
        """A problem that was found after reading, at the line of the key path or of the nearest one above."""
        path = tuple(int(step) if step.isdecimal() else step for step in key.split("."))
        source, line = self._origin.place(path)
        return Problem(source, message, line, key, hint)

    def refusal(self, message: str, key: str, *, hint: str | None = None) -> DocumentError:
        """The refusal of the document for one such problem."""
        return DocumentError([self.problem(message, key, hint=hint)])

    @contextmanager
    def placing(self) -> Iterator[None]:
        """A context in which problems of this document that have a key, and no line, get theirs."""
        try:
            yield
        except DocumentError as error:
            raise DocumentError([self._placed(problem) for problem in error.problems]) from error

    def _placed(self, problem: Problem) -> Problem:
        known = problem.line is not None or not problem.key or problem.source != self.source
        return problem if known else self.problem(problem.message, problem.key, hint=problem.hint)

    @property
    def ensemble(self) -> Ensemble | None:
        """The starts of the motion or of the orbit, where there is not one."""
        found = (section.ensemble for section in (self.motion, self.orbit) if section is not None)
        return next((ensemble for ensemble in found if ensemble is not None), None)

    def start(self, place: int, **sampling: Any) -> Self:
        """The document with one start of its ensemble, and its times changed to what is given."""
        if self.motion is not None and self.motion.ensemble is not None:
            motion = self.motion.start(place)
            found = self.model_copy(update={"motion": motion.model_copy(update=sampling)})
            if motion.orientation is not self.motion.orientation:
                found.__dict__.pop("physical", None)
        else:
            assert self.orbit is not None
            orbit = self.orbit.at_start(place).model_copy(update=sampling)
            found = self.model_copy(update={"orbit": orbit})
        found.__dict__["shared"] = self.shared
        return found

    def environment_again(self) -> Environment:
        """The environment of the document, in which more of it may be read without a trace in this one."""
        env, known = object.__new__(Environment), vars(self._environment)
        own = {name: copy(known[name]) for name in ("used", "faults", "notes", "files")}
        env.__dict__.update(known, **own)  # `copy` of all of it takes three times as long
        return env

    def completed(self, raw: Mapping[str, Any], env: Environment) -> Self:
        """The document with these keys, which are read; what hangs on none of them is worked out once.

        Raises ValidationError with all problems of the keys.
        """
        update, errors = {}, list[InitErrorDetails]()
        for key, value in raw.items():
            try:
                update[key] = _reader(key).validate_python(value, context=env)
            except ValidationError as error:
                errors += details(error, key)
        if errors:
            raise ValidationError.from_exception_data("Document", errors)
        found = self.model_copy(update=update)
        found._environment = env
        found._require_whole()
        found.__dict__.pop("physical", None)
        found.physical.share(self.physical)
        return found

    @cached_property
    def shared(self) -> Shared:
        """What this document has in common with those of all starts, where it is an ensemble or one of it."""
        from rigidcli.document.ensembles import Shared

        return Shared(1 if self.ensemble is None else len(self.ensemble))

    @cached_property
    def physical(self) -> Physical:
        """The numbers that the sections describe."""
        turned = None if self.motion is None else self.motion.orientation
        return Physical(self.arithmetic, self.body, self.about, self.axis, self.frame, self.top, turned)


@cache
def _reader(key: str) -> TypeAdapter[Any]:
    """What reads the value of a key at the top by itself."""
    annotation: Any = Document.model_fields[key].annotation
    return TypeAdapter(annotation)


@cache
def _sections_with() -> dict[str, list[str]]:
    """For each key below the sections at the top of a document, the names of those that have it."""
    found: dict[str, list[str]] = {}
    for name, field in Document.model_fields.items():
        for key in dict.fromkeys(key for each in sections_in(field.annotation) for key in each.model_fields):
            found.setdefault(key, []).append(name)
    return found
