"""The model of a document, and the numbers that its sections describe: masses, tensors, axes and tops."""

from __future__ import annotations

import pathlib
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache, cached_property, partial
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, get_args

import numpy as np
from pydantic import Field, model_validator

from rigidcli.core import rotation
from rigidcli.core.arithmetic import Arithmetic, Array, Scalar
from rigidcli.core.mass_properties import MassProperties
from rigidcli.core.tensor import IDENTITY, rotate, without_rounding
from rigidcli.document.draft import Draft
from rigidcli.errors import DocumentError, Problem, ValueProblem, at
from rigidcli.fields.dimensions import ACCELERATION
from rigidcli.fields.environment import Environment
from rigidcli.fields.quantities import Direction, Quantity, ReferencePoint
from rigidcli.fields.section import Elsewhere, Section, SectionChoice, Title, optional
from rigidcli.fields.words import HINTS, folded, keys_called, list_meant, not_one_of

if TYPE_CHECKING:
    from rigidcli.bodies.bodies import Body
    from rigidcli.bodies.form import Rotation
    from rigidcli.bodies.tops import HeavyTop
    from rigidcli.core.principal import PrincipalFrame
    from rigidcli.document.motion import Motion, Tide, Top
    from rigidcli.document.phase_space import Brackets, Equilibrium, Observables, Transform
    from rigidcli.document.sampling import Ensemble
    from rigidcli.document.system import Orbit, System
    from rigidcli.language.expression import Expression
else:
    # Loaded when a document has the section, as no document has all of them.
    Body = Annotated[Section, Elsewhere("rigidcli.bodies.bodies", "BODY")]
    Rotation = Annotated[Section, Elsewhere("rigidcli.bodies.form", "TURN")]
    Orbit = Annotated[Section, Elsewhere("rigidcli.document.system", "Orbit")]
    System = Annotated[Section, Elsewhere("rigidcli.document.system", "System")]
    Motion, Tide, Top = (
        Annotated[Section, Elsewhere("rigidcli.document.motion", name)] for name in ("Motion", "Tide", "Top")
    )
    Observables, Brackets, Equilibrium, Transform = (
        Annotated[Any, Elsewhere("rigidcli.document.phase_space", name)]
        for name in ("OBSERVABLES", "BRACKETS", "EQUILIBRIUM", "Transform")
    )


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
    brackets: Brackets | None = optional("Pairs whose Poisson brackets are asked for: [[Lx, Ly], [Lx, H]]")
    orbit: Orbit | None = None
    equilibrium: Equilibrium | None = optional(
        "Coordinates of an equilibrium, for small oscillations; or values near it, under `find`. In a steady "
        "motion a cyclic coordinate is `steady`, or its momentum has a value"
    )
    transform: Transform | None = None

    NEEDS: ClassVar = dict.fromkeys(
        ["orbit", "equilibrium", "transform", "observables", "brackets"], "system"
    )

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        yield from super()._contradictions(raw)
        if raw.get("gravity") is not None and raw.get("axis") is None:
            hint = "a top and a weight have their own: `top.gravity`, `motion.torque.gravity`"
            yield ValueProblem("nothing uses it without an `axis`", path=("gravity",), hint=hint)
        about, body = raw.get("about"), raw.get("body")
        if isinstance(about, str) and about not in (names := ["origin", "com"]):
            name = body.get("shape") if isinstance(body, dict) else getattr(body, "shape", None)
            shape = import_module("rigidcli.bodies.shapes").SHAPES.get(str(name))
            names += () if shape is None else shape.ANCHORS
            if about not in names:
                cure = list_meant(about)
                yield ValueProblem(not_one_of(about, names), path=("about",), hint=cure and f"write `{cure}`")

    @classmethod
    def _unknown(cls, key: str, raw: Mapping[str, Any], env: Environment) -> ValueProblem:
        if key in ("questions", "answers"):
            what = "an assignment" if key == "questions" else "an answer file"
            hint = f"this is {what}: `rigidcli check ASSIGNMENT ANSWERS`"
            return ValueProblem("belongs to no document", hint=hint)
        if isinstance(raw.get("parameters"), dict) and key in raw["parameters"]:
            return ValueProblem("is a parameter", hint=f"its path is `parameters.{key}`")
        return super()._unknown(key, raw, env)

    @classmethod
    def _place_of(cls, key: str, raw: Mapping[str, Any]) -> tuple[str, ...]:
        """Where a key at the top belongs: the section, and the way from there; empty for any other key."""
        section, *inner = map(str.strip, re.split(r"\.|->|/", key))
        if inner and section in cls.model_fields:
            return section, *inner
        for word in (key, *keys_called(key)) if key not in cls.model_fields else ():
            if names := [name for name in places().get(word, ()) if name]:
                # Beside a system, a duration is that of the orbit, not of a motion.
                own = [name for name in names if name in ("system", *cls.NEEDS)]
                return (own if own and raw.get("system") is not None else names)[0], word
        return ()

    @classmethod
    def _elsewhere(cls, key: str, raw: Mapping[str, Any], env: Environment) -> ValueProblem | None:
        place = cls._place_of(key, raw)
        is_told = key not in places() and folded(key) in HINTS
        if not place or is_told or (isinstance(raw.get("parameters"), dict) and key in raw["parameters"]):
            return None
        name, *inner = place
        value = "..."
        for step in reversed(inner):
            value = f"[{value}]" if step.isdecimal() else f"{{{step}: {value}}}"
        hint = f"write `{name}: {value}`; its path is `{'.'.join(place)}`"
        if name in raw and raw[name] is None:
            hint = f"begin this line with two blanks, so that it is below `{name}:`"
        has_list = any(step.isdecimal() for step in inner)
        return ValueProblem(f"belongs inside `{name}`", hint=hint, meant=() if has_list else place)

    @model_validator(mode="after")
    def _check_body(self) -> Self:
        if self.body is not None and self.body.hole:
            raise ValueProblem("a hole stands in `parts`, beside what it is cut from", path=("body", "hole"))
        if self.body is not None and self.body.rounding is not None and "about" not in self.model_fields_set:
            return self.model_copy(update={"about": "com"})  # of a molecule, whose origin means nothing
        return self

    # --- what the document was read from, and with

    @cached_property
    def draft(self) -> Draft:
        """The tree and the text that the document was read from; empty for a document that was not read."""
        return Draft("", {})

    @cached_property
    def environment(self) -> Environment:
        """The parameters and the arithmetic with which the document was read."""
        return Environment()

    @cached_property
    def starts(self) -> int:
        """The number of starts in the document; that of the whole ensemble for the document of one start."""
        return 1 if self.ensemble is None else len(self.ensemble)

    @property
    def arithmetic(self) -> Arithmetic:
        """The arithmetic of the numbers in the document: floats or exact expressions."""
        return self.environment.arithmetic

    @property
    def exact_results(self) -> bool:
        """Whether results are exact: the user asks for it, or a parameter has no value."""
        return self.environment.exact_results

    @property
    def values(self) -> Mapping[str, Scalar]:
        """The parameters that have a value, in SI units."""
        declared = self.environment.declared
        return {name: each.value for name, each in declared.items() if each.value is not None}

    @property
    def symbols(self) -> tuple[str, ...]:
        """The parameters without a value that something uses."""
        env = self.environment
        return tuple(name for name, each in env.declared.items() if each.typed is None and name in env.used)

    @property
    def unused(self) -> list[str]:
        """The parameters that nothing uses."""
        return sorted(self.environment.declared.keys() - self.environment.used)

    @cached_property
    def definitions(self) -> Mapping[str, Expression | None]:
        """The exact expressions of the parameters, each after those that it uses; None for a symbol."""
        env = self.environment
        typed = ((name, parameter.typed) for name, parameter in env.declared.items())
        return {name: None if each is None else env.written(each) for name, each in typed}

    @property
    def files(self) -> Sequence[pathlib.Path]:
        """The files that the document names."""
        return self.environment.log.files

    @property
    def source(self) -> str:
        """Where the document was read from, as the user named it."""
        return self.draft.source

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks for the user on the document, each once."""
        return tuple(dict.fromkeys(self.environment.log.notes))

    def problem(self, message: str, key: str, *, hint: str | None = None) -> Problem:
        """A problem of a document that was read, at the line of the key, or of the nearest key above it."""
        path = tuple(int(step) if step.isdecimal() else step for step in key.split("."))
        source, line = self.draft.place(path)
        return Problem(source, message, line, key, hint)

    def refusal(self, message: str, key: str, *, hint: str | None = None) -> DocumentError:
        """The error that refuses the document for one such problem."""
        return DocumentError([self.problem(message, key, hint=hint)])

    # --- starts and numbers

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
        document.keep(starts=self.starts, physical=self.physical.of(vars(document)))
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
        marks = (mark for part in get_args(entry.annotation) for mark in getattr(part, "__metadata__", ()))
        choices = [mark.there if isinstance(mark, Elsewhere) else mark for mark in marks]
        options = (mark.options() for mark in choices if isinstance(mark, SectionChoice))
        sections = [section for several in options for section in several]
        for key in dict.fromkeys(key for section in sections for key in section.model_fields):
            names.setdefault(key, []).append(name)
    return names


SAME_POINT = 1e-12  # relative to their distance from the origin: points so close differ by rounding only


class Physical:
    """Masses, tensors, axes and tops of a document, each computed when it is first used.

    `require` uses all of them when a document is read, so that an impossible body or top is refused at once.
    Vectors and tensors are along the document's axes. Every property raises ValueProblem, with the path in
    the document, for a body, a top or an axis that cannot exist.
    """

    def __init__(self, sections: Mapping[str, Any], arithmetic: Arithmetic) -> None:
        self.sections, self.arithmetic = sections, arithmetic
        self.body: Body | None = sections["body"]

    @np.errstate(over="ignore", invalid="ignore")
    def of(self, sections: Mapping[str, Any]) -> Physical:
        """The numbers of other sections; results for the same body are taken over from here."""
        other = Physical(sections, self.arithmetic)
        if self.body is not None and other.body is self.body:
            for name in ("properties", "tensor", *(("body_top",) if sections["top"] else ())):
                setattr(other, name, getattr(self, name))
        return other

    @np.errstate(over="ignore", invalid="ignore")
    def require(self) -> None:
        """Raise ValueProblem where the document describes something impossible."""
        _ = self.axes, self.direction, self.orientation
        _ = self.body and self.tensor, self.sections["top"] and self.heavy_top

    @cached_property
    def properties(self) -> MassProperties:
        """Mass, centre of mass (3, m) and the tensor of the body."""
        if self.body is None:
            raise ValueProblem("missing, expected a body", path=("body",))
        with at("body"):
            return self.body.properties(self.arithmetic)

    @property
    def point(self) -> Array:
        """The point O about which the tensor is taken (3, m)."""
        about = self.sections["about"]
        if about == "com":
            return self.properties.com
        if isinstance(about, str) and about != "origin":
            from rigidcli.bodies.shapes import Shape

            assert isinstance(self.body, Shape)
            return self.body.point_named(about, self.arithmetic)
        return self.arithmetic.array([0, 0, 0] if about == "origin" else about)

    def _require_known(self) -> None:
        # A tensor without a mass cannot be shifted.
        size, properties = self.arithmetic.size, self.properties
        off = max(abs(size(component)) for component in self.point - properties.com)
        far = max(abs(size(component)) for component in (*self.point, *properties.com))
        if off > SAME_POINT * far or (self.sections["about"] == "com" and not properties.at_com):
            hint = "give `mass`, or the tensor about the point asked for in `about`"
            message = "missing: without it the tensor cannot be shifted"
            raise ValueProblem(message, path=("body", "mass"), hint=hint)

    @cached_property
    def tensor(self) -> Array:
        """The inertia tensor about the point O (3 by 3, kg m^2)."""
        body = self.properties
        if body.mass is None:
            self._require_known()
            return without_rounding(body.tensor)
        return self.arithmetic.tidy(without_rounding(body.tensor_about(self.point)))

    def frame_along(self, axes: Array) -> PrincipalFrame:
        """The principal frame about the point O, in components along these axes (columns, 3 by 3)."""
        assert self.body is not None
        return self.body.principal_frame(self.tensor, self.point, axes, self.arithmetic)

    @cached_property
    def frame(self) -> PrincipalFrame:
        """The principal frame about O, along the axes of the results. Raises ComputationError if too long."""
        return self.frame_along(self.axes)

    @cached_property
    def direction(self) -> Array | None:
        """The unit vector (3) along the `axis` through O; None where the document has no axis."""
        if self.sections["axis"] is None:
            return None
        with at("axis"):
            return rotation.direction(self.sections["axis"], self.arithmetic)

    @cached_property
    def heavy_top(self) -> HeavyTop:
        """The top of the section `top`, from its own numbers or from the body held at the point O."""
        top = self.sections["top"]
        if top is None:
            raise ValueProblem("missing, expected a top", path=("top",))
        if self.body is None:
            from rigidcli.bodies.tops import described

            with at("top"):
                return described(self.arithmetic, **top.numbers)
        if given := [key for key, number in top.numbers.items() if number is not None]:
            raise ValueProblem("the `body` determines this; give one or the other", path=("top", given[0]))
        return self.body_top

    @cached_property
    def body_top(self) -> HeavyTop:
        """The top that the body makes when it is held at the point O."""
        from rigidcli.bodies.tops import of_body

        try:
            frame = partial(self.frame_along, self.arithmetic.array(IDENTITY))
            return of_body(self.properties, self.point, self.tensor, frame, self.arithmetic)
        except ValueProblem as problem:
            if problem.path[:1] != ("body",):
                problem.below("top")
            raise

    @cached_property
    def axes(self) -> Array:
        """The axes of the results, as columns (3 by 3)."""
        return self._matrix(self.sections["frame"], "frame")

    def along_axes(self, tensor: Array) -> Array:
        """A tensor (3 by 3, along the document's axes) along the axes of the results."""
        return without_rounding(rotate(tensor, self.axes.T))

    @cached_property
    def orientation(self) -> Array:
        """The rotation from the document's axes to those of space at t = 0 (3 by 3)."""
        motion = self.sections["motion"]
        return self._matrix(None if motion is None else motion.orientation, "motion", "orientation")

    def _matrix(self, rotation: Rotation | None, *path: str) -> Array:
        if rotation is None:
            return self.arithmetic.array(IDENTITY)
        with at(*path):
            return rotation.as_matrix(self.arithmetic)
