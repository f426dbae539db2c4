"""The whole document: a body, how it turns and what makes it precess; a system of any kind, and its orbit."""

from __future__ import annotations

import pathlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from rigidcli.bodies.rotations import Rotation
from rigidcli.core import rotation
from rigidcli.core.arithmetic import Arithmetic, Array, Scalar
from rigidcli.core.mass_properties import MassProperties
from rigidcli.core.tensor import IDENTITY, Inertia
from rigidcli.document.origins import Origin
from rigidcli.document.parameters import definitions
from rigidcli.errors import DocumentError, Problem, ValueProblem, at
from rigidcli.fields.environment import Environment
from rigidcli.fields.quantities import Direction, ReferencePoint
from rigidcli.fields.readers import Elsewhere, ReadBy, Title
from rigidcli.fields.section import Section, environment, optional, sections_in
from rigidcli.fields.words import keys_called, not_one_of
from rigidcli.language.expression import Expression

if TYPE_CHECKING:
    from rigidcli.bodies.bodies import Body
    from rigidcli.bodies.tops import HeavyTop
    from rigidcli.document.ensembles import Ensemble, Shared
    from rigidcli.document.motion import Motion
    from rigidcli.document.orbit import Orbit
    from rigidcli.document.precession import Tide, Top
    from rigidcli.document.system import System
    from rigidcli.document.transform import Transform
    from rigidcli.document.variables import Equilibrium
else:
    # Loaded when a document has the section, as no document has all of them.
    Equilibrium = Any
    Body = Annotated[Section, Elsewhere("rigidcli.bodies.bodies", "BODY")]
    Tide, Top = (
        Annotated[Section, Elsewhere("rigidcli.document.precession", name)] for name in ("Tide", "Top")
    )
    Motion, Orbit, System, Transform = (
        Annotated[Section, Elsewhere(f"rigidcli.document.{name.lower()}", name)]
        for name in ("Motion", "Orbit", "System", "Transform")
    )

_COORDINATES = {"type": "object", "additionalProperties": {"type": ["number", "string"]}}
_EQUILIBRIUM = ReadBy(
    lambda raw, info: import_module("rigidcli.document.variables").read_equilibrium(raw, info),
    {"anyOf": [_COORDINATES, {"type": "object", "properties": {"find": {"title": "Find", **_COORDINATES}}}]},
)

NOWHERE = Origin("", pathlib.Path(), {})
"""The origin of a document that was made, and not read."""


SAME_POINT = 1e-12
"""Two points closer than this, in units of their distance from the origin, differ by rounding only."""


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
            name = body.get("shape") if isinstance(body, dict) else getattr(body, "shape", None)
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
        if self.body is not None and self.body.hole:
            raise ValueProblem("a hole stands in `parts`, beside what it is cut from", path=("body", "hole"))
        return self

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

        def placed(problem: Problem) -> Problem:
            has_place = problem.line is not None or not problem.key or problem.source != self.source
            return problem if has_place else self.problem(problem.message, problem.key, hint=problem.hint)

        try:
            yield
        except DocumentError as error:
            raise DocumentError(list(map(placed, error.problems))) from error

    @property
    def ensemble(self) -> Ensemble | None:
        """The starts of the motion or of the orbit, where there is not one."""
        found = (section.ensemble for section in (self.motion, self.orbit) if section is not None)
        return next((ensemble for ensemble in found if ensemble is not None), None)

    def start(self, place: int, **sampling: Any) -> Self:
        """The document with one start of its ensemble, and its times changed to what is given."""
        key = "motion" if self.motion is not None and self.motion.ensemble is not None else "orbit"
        section = getattr(self, key).at_start(place).model_copy(update=sampling)
        found = self.model_copy(update={key: section})
        found.__dict__ |= {"shared": self.shared, "physical": self.physical.of(found)}
        return found

    def environment_again(self) -> Environment:
        """The environment of the document, in which more of it may be read without a trace in this one."""
        env = self._environment
        return replace(env, used={*env.used}, faults={**env.faults}, notes=[*env.notes], files=[*env.files])

    @cached_property
    def shared(self) -> Shared:
        """What this document has in common with those of all starts, where it is an ensemble or one of it."""
        from rigidcli.document.ensembles import Shared

        return Shared(1 if self.ensemble is None else len(self.ensemble))

    @cached_property
    def physical(self) -> Physical:
        """The numbers that the sections describe."""
        return Physical(self)


class Physical:
    """The numbers that the sections of a document describe, worked out when they are first asked for.

    They are asked for when a document is read, so that a body or a top that cannot exist is refused at once.

    Vectors and tensors are along the document's axes. Every property raises ValueProblem, with the path in
    the document, for what cannot exist.
    """

    def __init__(self, document: Document) -> None:
        self.document, self.arithmetic, self.body = document, document.arithmetic, document.body

    @np.errstate(over="ignore", invalid="ignore")
    def of(self, document: Document) -> Physical:
        """The numbers of a document that may have the same body, which is then worked out once, here."""
        found = Physical(document)
        if self.body is not None and found.body is self.body:
            for name in ("properties", "inertia", *(("body_top",) if document.top else ())):
                found.__dict__[name] = getattr(self, name)
        return found

    @np.errstate(over="ignore", invalid="ignore")
    def require(self) -> None:
        """Raise ValueProblem unless all that the document describes can exist."""
        _ = self.axes, self.direction, self.orientation
        _ = self.body and self.properties, self.document.top and self.heavy_top

    @cached_property
    def properties(self) -> MassProperties:
        """Mass, centre of mass (3, m) and the tensor of the body."""
        if self.body is None:
            raise ValueProblem("missing, expected a body", path=("body",))
        with at("body"):
            properties = self.body.properties(self.arithmetic)
        if properties.mass is None:
            self._require_known(properties)
        return properties

    def _require_known(self, properties: MassProperties) -> None:
        """Raise ValueProblem unless a tensor without a mass is given about the point that is asked for."""
        n = self.arithmetic
        if self.document.about == "com" and not properties.at_com:
            raise ValueProblem("missing: without it the tensor cannot be shifted", path=("body", "mass"))
        asked = self._point(properties)
        off = max(abs(n.size(component)) for component in asked - properties.com)
        far = max(abs(n.size(component)) for component in (*asked, *properties.com))
        if off > SAME_POINT * far:
            point = ", ".join(f"{n.size(component):.6g}" for component in properties.com)
            raise ValueProblem(
                f"missing: without it the tensor is known about ({point}) only",
                path=("body", "mass"),
                hint="give `mass`, or the tensor about the point asked for in `about`",
            )

    @property
    def point(self) -> Array:
        """The point O about which the tensor is asked (3, m)."""
        return self._point(self.properties)

    def _point(self, properties: MassProperties) -> Array:
        about = self.document.about
        if about == "com":
            return properties.com
        if isinstance(about, str) and about != "origin":
            from rigidcli.bodies.shape import Shape

            assert isinstance(self.body, Shape)
            return self.body.point_named(about, self.arithmetic)
        return self.arithmetic.array([0, 0, 0] if about == "origin" else about)

    @cached_property
    def inertia(self) -> Inertia:
        """The inertia about the point O, along axes in which it was worked out."""
        # A centre of mass is rounded, and the inertia about it known better; exact sums have axes in common.
        body, n = self.properties, self.arithmetic
        if body.mass is None or (self.document.about == "com" and not n.exact):
            return body.inertia
        found = body.inertia_about(self.point)
        return Inertia(n.tidy(found.entries), found.noise, n.tidy(found.axes))

    @cached_property
    def tensor(self) -> Array:
        """The inertia tensor about the point O (3 by 3, kg m^2)."""
        return self.arithmetic.tidy(self.inertia.tensor)

    @cached_property
    def direction(self) -> Array | None:
        """The unit vector (3) along the axis through O about which the moment is asked, if one is."""
        if self.document.axis is None:
            return None
        with at("axis"):
            return rotation.direction(self.document.axis, self.arithmetic)

    @cached_property
    def heavy_top(self) -> HeavyTop:
        """The top that the section `top` describes by itself or by the body, held at the point O."""
        top = self.document.top
        if top is None:
            raise ValueProblem("missing, expected a top", path=("top",))
        if self.body is None:
            from rigidcli.bodies.tops import described

            with at("top"):
                return described(self.arithmetic, **top.numbers)
        if given := [key for key, number in top.numbers.items() if number is not None]:
            raise ValueProblem("the `body` tells this; give one or the other", path=("top", given[0]))
        return self.body_top

    @cached_property
    def body_top(self) -> HeavyTop:
        """The top that the body makes when it is held at the point O."""
        from rigidcli.bodies.tops import of_body

        try:
            return of_body(self.properties, self.point, self.inertia, self.arithmetic)
        except ValueProblem as problem:
            if problem.path[:1] != ("body",):
                problem.below("top")
            raise

    @cached_property
    def axes(self) -> Array:
        """The axes of the results, as columns (3 by 3)."""
        return self._matrix(self.document.frame, "frame")

    def along_axes(self, inertia: Inertia) -> Inertia:
        """The same inertia along the axes of the results."""
        return inertia if self.document.frame is None else inertia.turned(self.axes.T)

    @cached_property
    def orientation(self) -> Array:
        """The rotation from the document's axes to those of space at t = 0 (3 by 3)."""
        motion = self.document.motion
        return self._matrix(None if motion is None else motion.orientation, "motion", "orientation")

    def _matrix(self, rotation: Rotation | None, *path: str) -> Array:
        if rotation is None:
            return self.arithmetic.array(IDENTITY)
        with at(*path):
            return rotation.as_matrix(self.arithmetic)


@cache
def _sections_with() -> dict[str, list[str]]:
    """For each key below the sections at the top of a document, the names of those that have it."""
    found: dict[str, list[str]] = {}
    for name, field in Document.model_fields.items():
        for key in dict.fromkeys(key for each in sections_in(field.annotation) for key in each.model_fields):
            found.setdefault(key, []).append(name)
    return found
