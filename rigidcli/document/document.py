"""The model of a document: a body, its motion and precession; a system with an orbit and transformations."""

from __future__ import annotations

import pathlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, get_args

from pydantic import Field, model_validator

from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.document.draft import Draft
from rigidcli.document.physical import Physical
from rigidcli.document.variables import EQUILIBRIUM, Brackets, Equilibrium, Observables, Transform
from rigidcli.errors import DocumentError, Problem, ValueProblem
from rigidcli.fields.dimensions import ACCELERATION
from rigidcli.fields.environment import Environment
from rigidcli.fields.quantities import Direction, Quantity, ReferencePoint
from rigidcli.fields.section import Elsewhere, Section, SectionChoice, Title, optional
from rigidcli.fields.words import keys_called, list_meant, not_one_of
from rigidcli.language.expression import Expression

if TYPE_CHECKING:
    from rigidcli.bodies.bodies import Body
    from rigidcli.bodies.form import Rotation
    from rigidcli.document.motion import Motion, Tide, Top
    from rigidcli.document.orbit import Orbit
    from rigidcli.document.sampling import Ensemble
    from rigidcli.document.system import System
else:
    # Loaded when a document has the section, as no document has all of them.
    Body = Annotated[Section, Elsewhere("rigidcli.bodies.bodies", "BODY")]
    Rotation = Annotated[Section, Elsewhere("rigidcli.bodies.form", "TURN")]
    Orbit = Annotated[Section, Elsewhere("rigidcli.document.orbit", "Orbit")]
    System = Annotated[Section, Elsewhere("rigidcli.document.system", "System")]
    Motion, Tide, Top = (
        Annotated[Section, Elsewhere("rigidcli.document.motion", name)] for name in ("Motion", "Tide", "Top")
    )


@dataclass(slots=True)
class ReadFrom:
    """The draft and the environment from which a document was read; all starts of an ensemble share them."""

    draft: Draft = field(default_factory=lambda: Draft("", {}))
    environment: Environment = field(default_factory=Environment)
    starts: int = 1


class Document(Section):
    """A system as a person describes it. Numbers are SI values, or exact; `arithmetic` says which."""

    name: Title | None = optional("The name in results; by default that of the file")
    description: Title | None = optional("Remarks for people; the program does not use them")
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
    axis: Direction | None = optional("Direction of an axis through that point, for the moment about it")
    gravity: Annotated[Scalar, Quantity(ACCELERATION, "positive")] = Field(
        default=9.80665,
        validate_default=True,
        description="Acceleration of free fall (m/s^2), for swings about the `axis`",
    )
    frame: Rotation | None = optional("Axes for every vector and tensor of the results")
    motion: Motion | None = None
    top: Top | None = None
    tide: Tide | None = None
    # Orbit, equilibrium and transform come after the system, because they use its coordinates.
    system: System | None = None
    observables: Observables | None = optional(
        "Functions of coordinates, momenta, velocities, t, of H, T, V and of each other, by their names"
    )
    brackets: Brackets | None = optional(
        "Pairs of which the Poisson bracket is asked for: [[Lx, Ly], [Lx, H]]"
    )
    orbit: Orbit | None = None
    equilibrium: Annotated[Equilibrium, EQUILIBRIUM] | None = optional(
        "Coordinates of an equilibrium, for small oscillations; or values near it, under `find`. In a steady "
        "motion a cyclic coordinate is `steady`, or its momentum has a value"
    )
    transform: Transform | None = None

    NEEDS: ClassVar = dict.fromkeys(
        ("orbit", "equilibrium", "transform", "observables", "brackets"), "system"
    )

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        yield from super()._contradictions(raw)
        if raw.get("gravity") is not None and raw.get("axis") is None:
            hint = "a top and a weight have their own: `top.gravity`, `motion.torque.gravity`"
            yield ValueProblem("nothing uses it without an `axis`", path=("gravity",), hint=hint)
        about, body = raw.get("about"), raw.get("body")
        if isinstance(about, str) and about not in (points := ["origin", "com"]):
            name = body.get("shape") if isinstance(body, dict) else getattr(body, "shape", None)
            shape = import_module("rigidcli.bodies.shapes").SHAPES.get(str(name))
            points += () if shape is None else shape.ANCHORS
            if about not in points:
                cure = list_meant(about)
                yield ValueProblem(
                    not_one_of(about, points), path=("about",), hint=cure and f"write `{cure}`"
                )

    @classmethod
    def _unknown(cls, key: str, raw: Mapping[str, Any]) -> ValueProblem:
        if key in ("questions", "answers"):
            what = "an assignment" if key == "questions" else "an answer file"
            hint = f"this is {what}: `rigidcli check ASSIGNMENT ANSWERS`"
            return ValueProblem("belongs to no document", hint=hint)
        if isinstance(raw.get("parameters"), dict) and key in raw["parameters"]:
            return ValueProblem("is a parameter", hint=f"its path is `parameters.{key}`")
        return super()._unknown(key, raw)

    @classmethod
    def _section_of(cls, key: str, raw: Mapping[str, Any]) -> tuple[str, str] | None:
        """The section to which a key at the top belongs, and its name there."""
        section, *inner = map(str.strip, re.split(r"\.|->|/", key, maxsplit=1))
        if inner and section in cls.model_fields:
            return section, inner[0]
        for word in (key, *keys_called(key)) if key not in cls.model_fields else ():
            if names := [name for name in places().get(word, ()) if name]:
                # Beside a system, a duration is that of the orbit, not of a motion.
                own = [name for name in names if name in ("system", *cls.NEEDS)]
                return (own if own and raw.get("system") is not None else names)[0], word
        return None

    @classmethod
    def _elsewhere(cls, key: str, raw: Mapping[str, Any], env: Environment) -> ValueProblem | None:
        place = cls._section_of(key, raw)
        if place is None or (isinstance(raw.get("parameters"), dict) and key in raw["parameters"]):
            return None
        name, word = place
        hint = f"write `{name}: {{{word}: ...}}`; its path is `{name}.{word}`"
        if name in raw and raw[name] is None:
            hint = f"begin this line with two blanks, so that it is below `{name}:`"
        return ValueProblem(f"belongs inside `{name}`", hint=hint)

    @model_validator(mode="after")
    def _check_body(self) -> Self:
        if self.body is not None and self.body.hole:
            raise ValueProblem("a hole stands in `parts`, beside what it is cut from", path=("body", "hole"))
        if self.body is not None and self.body.rounding is not None and "about" not in self.model_fields_set:
            return self.model_copy(update={"about": "com"})  # of a molecule, whose origin means nothing
        return self

    @cached_property
    def reading(self) -> ReadFrom:
        """The draft and the environment of the document; empty ones where it was not read from a text."""
        return ReadFrom()

    def came_from(self, reading: ReadFrom, rest: Document | None) -> None:
        """Remember the draft and the environment; the body may be that of the `rest` of a sweep."""
        reading.starts = 1 if self.ensemble is None else len(self.ensemble)
        self.keep(reading=reading)
        if rest is not None:
            self.keep(physical=rest.physical.of(vars(self)))

    @property
    def arithmetic(self) -> Arithmetic:
        """The arithmetic of the numbers in the document: floats or exact expressions."""
        return self.reading.environment.arithmetic

    @property
    def exact_results(self) -> bool:
        """Whether results are exact: the user asks for it, or a parameter has no value."""
        return self.reading.environment.exact_results

    @property
    def values(self) -> Mapping[str, Scalar]:
        """The parameters that have a value, in SI units."""
        declared = self.reading.environment.declared
        return {name: each.value for name, each in declared.items() if each.value is not None}

    @property
    def symbols(self) -> tuple[str, ...]:
        """The parameters without a value that something uses."""
        env = self.reading.environment
        return tuple(name for name, each in env.declared.items() if each.typed is None and name in env.used)

    @property
    def unused(self) -> list[str]:
        """The parameters that nothing uses."""
        env = self.reading.environment
        return sorted(env.declared.keys() - env.used)

    @cached_property
    def definitions(self) -> Mapping[str, Expression | None]:
        """The exact expressions of the parameters, each after those that it uses; None for a symbol."""
        env = self.reading.environment
        typed = ((name, parameter.typed) for name, parameter in env.declared.items())
        return {name: None if each is None else env.written(each) for name, each in typed}

    @property
    def files(self) -> Sequence[pathlib.Path]:
        """The files that the document names."""
        return self.reading.environment.log.files

    @property
    def source(self) -> str:
        """Where the document was read from, as the user named it."""
        return self.reading.draft.source

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks for the user on the document, each once."""
        return tuple(dict.fromkeys(self.reading.environment.log.notes))

    @property
    def text(self) -> str:
        """The text of the document, and below it, in comments, the values that were set by options."""
        return self.reading.draft.whole

    def problem(self, message: str, key: str, *, hint: str | None = None) -> Problem:
        """A problem of a document that was read, at the line of the key, or of the nearest key above it."""
        path = tuple(int(step) if step.isdecimal() else step for step in key.split("."))
        source, line = self.reading.draft.place(path)
        return Problem(source, message, line, key, hint)

    def refusal(self, message: str, key: str, *, hint: str | None = None) -> DocumentError:
        """The error that refuses the document for one such problem."""
        return DocumentError([self.problem(message, key, hint=hint)])

    @property
    def ensemble(self) -> Ensemble | None:
        """The starts of the motion or of the orbit; None where there is a single start."""
        ensembles = (section.ensemble for section in (self.motion, self.orbit) if section is not None)
        return next((ensemble for ensemble in ensembles if ensemble is not None), None)

    def start(self, place: int, **sampling: Any) -> Self:
        """The document with one start of the ensemble, and with these keys of its sampling replaced."""
        key = "motion" if self.motion is not None and self.motion.ensemble is not None else "orbit"
        section = getattr(self, key).at_start(place).model_copy(update=sampling)
        document = self.model_copy(update={key: section})
        document.keep(physical=self.physical.of(vars(document)))
        return document

    @cached_property
    def physical(self) -> Physical:
        """The numbers that the sections describe."""
        return Physical(vars(self), self.arithmetic)


@cache
def places() -> dict[str, list[str]]:
    """The sections at the top of a document, by the keys that they have; "" has the keys at the top."""
    names = {name: [""] for name in Document.model_fields}
    for name, entry in Document.model_fields.items():
        sections: list[type[Section]] = []
        for part in get_args(entry.annotation):
            for mark in getattr(part, "__metadata__", (part,)):
                choice = mark.choice if isinstance(mark, Elsewhere) else mark
                sections += choice.options() if isinstance(choice, SectionChoice) else ()
                sections += [mark] if isinstance(mark, type) and issubclass(mark, Section) else ()
        for key in dict.fromkeys(key for section in sections for key in section.model_fields):
            names.setdefault(key, []).append(name)
    return names
