"""The whole document: a body, how it turns and what makes it precess; a system of any kind, and its orbit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Self, TypeAlias

import numpy as np
from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from rigidcli.core.arithmetic import Arithmetic, Array, Scalar
from rigidcli.core.principal import ZERO_MOMENT, PrincipalFrame
from rigidcli.core.tensor import MassProperties
from rigidcli.errors import DocumentError, Problem, ValueProblem
from rigidcli.model.base import Point, Section, elsewhere, environment
from rigidcli.model.environment import Environment
from rigidcli.model.parameters import definitions
from rigidcli.model.principal import principal_frame
from rigidcli.model.rotations import Rotation
from rigidcli.symbolic.language.expression import Expression

if TYPE_CHECKING:
    from rigidcli.model.bodies import Body
    from rigidcli.model.motion import Motion
    from rigidcli.model.orbit import Orbit
    from rigidcli.model.system import System
    from rigidcli.model.tide import Tide
    from rigidcli.model.top import HeavyTop, Top
    from rigidcli.model.transform import Transform
else:
    # No document has all of these: none waits for what it has not.
    Body = Annotated[Section, elsewhere("rigidcli.model.bodies", "BODY")]
    Motion = Annotated[Section, elsewhere("rigidcli.model.motion", "Motion")]
    Orbit = Annotated[Section, elsewhere("rigidcli.model.orbit", "Orbit")]
    System = Annotated[Section, elsewhere("rigidcli.model.system", "System")]
    Tide = Annotated[Section, elsewhere("rigidcli.model.tide", "Tide")]
    Top = Annotated[Section, elsewhere("rigidcli.model.top", "Top")]
    Transform = Annotated[Section, elsewhere("rigidcli.model.transform", "Transform")]

Place: TypeAlias = tuple[str, int | None]
"""The source of a value as people are told it, and its line."""

SAME_POINT = 1e-12
"""Two points closer than this, in units of their distance from the origin, are one but for rounding."""


class Document(Section):
    """A system as a person describes it. Numbers are SI values, or exact; `arithmetic` says which."""

    name: str | None = None
    description: str | None = None
    parameters: dict[str, Any] | None = Field(
        default=None,
        description="Values for names in expressions; null makes a symbol, and the document exact",
        json_schema_extra={"additionalProperties": {"type": ["number", "string", "null"]}},
    )
    body: Body | None = None
    about: Point = Field(default="origin", description="The point about which the tensor is asked")
    frame: Rotation | None = Field(
        default=None, description="Axes for every vector and tensor of the results"
    )
    motion: Motion | None = None
    top: Top | None = None
    tide: Tide | None = None
    # Orbit and transform come after the system, of whose coordinates they are.
    system: System | None = None
    orbit: Orbit | None = None
    transform: Transform | None = None

    _environment: Environment = PrivateAttr()
    _source: str = PrivateAttr(default="")
    _notes: tuple[str, ...] = PrivateAttr(default=())
    _place: Callable[[str], Place] | None = PrivateAttr(default=None)

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        yield from super()._contradictions(raw)
        for key in ("orbit", "transform"):
            if raw.get(key) is not None and raw.get("system") is None:
                yield ValueProblem("there is no `system` for it", path=(key,))

    @model_validator(mode="after")
    def _remember(self, info: ValidationInfo) -> Self:
        self._environment = environment(info)
        if self.body is not None and self.body.hole:
            raise ValueProblem("a hole stands in `parts`, beside what it is cut from", path=("body", "hole"))
        return self

    @property
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

    @cached_property
    def definitions(self) -> Mapping[str, Expression | None]:
        """The parameters as they are given, exactly: each after those it uses, None for a symbol."""
        return definitions(self._environment, self.parameters or {})

    @property
    def source(self) -> str:
        """Where the document was read from, as the user named it."""
        return self._source

    @property
    def notes(self) -> tuple[str, ...]:
        """What the reader of the document should know about it."""
        return self._notes

    def came_from(self, source: str, notes: Sequence[str], place: Callable[[str], Place]) -> Self:
        """The document, knowing its source and notes, and the place of a key such as `body.parts.0`."""
        self._source, self._notes, self._place = source, tuple(notes), place
        return self

    def problem(self, message: str, key: str, *, hint: str | None = None) -> Problem:
        """A problem that was found after reading, at the line of the key path or of the nearest one above."""
        source, line = self._place(key) if self._place is not None else (self._source, None)
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
        known = problem.line is not None or not problem.key or problem.source != self._source
        return problem if known else self.problem(problem.message, problem.key, hint=problem.hint)

    @np.errstate(over="ignore", invalid="ignore")
    def settle(self) -> None:
        """Work out what only the document as a whole tells. Raises ValueProblem for what cannot be."""
        _ = self.axes, self.body and self.properties, self.top and self.heavy_top, self.orientation

    @cached_property
    def properties(self) -> MassProperties:
        """Mass properties of the body in the document's axes. Raises ValueProblem where there are none."""
        if self.body is None:
            raise ValueProblem("missing, expected a body", path=("body",))
        try:
            properties = self.body.properties(self.arithmetic)
        except ValueProblem as problem:
            raise problem.below("body") from None
        if properties.mass is None:
            n = self.arithmetic
            if self.about == "com" and not properties.at_com:
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
        return properties

    @cached_property
    def axes(self) -> Array:
        """The axes of the results, as columns (3 by 3) in the document's components."""
        if self.frame is None:
            return self.arithmetic.array(np.eye(3, dtype=int))
        try:
            return self.frame.as_matrix(self.arithmetic)
        except ValueProblem as problem:
            raise problem.below("frame") from None

    @property
    def point(self) -> Array:
        """The point O about which the tensor is asked (3, m), in the document's axes."""
        return self._point(self.properties)

    @cached_property
    def tensor(self) -> Array:
        """The tensor about the point O (3 by 3, kg m^2), in the document's axes."""
        if self.about == "com" or self.properties.mass is None or self.body is None:
            return self.properties.tensor
        return self.body.tensor_about(self.point, self.arithmetic)

    @cached_property
    def principal(self) -> PrincipalFrame:
        """The principal frame of that tensor, e1, e2 and e3 being along the axes of the results."""
        if not self.arithmetic.exact or self.body is None:
            return principal_frame(self.axes.T @ self.tensor @ self.axes, self.arithmetic)
        from rigidcli.symbolic.mechanics import principal_axes

        turn, own = self.body.in_own_axes(self.point, self.arithmetic)
        return principal_axes.principal_frame(own, self.axes.T @ turn)

    @cached_property
    def turning(self) -> Array:
        """The angular velocity at t = 0 (3, rad/s) along e1, e2, e3 of `principal`.

        Raises DocumentError where there is none, and for one about an axis without a moment of inertia, whose
        angular momentum does not tell it.
        """
        if self.motion is None or self.motion.omega is None:
            raise self.refusal("missing, expected an angular velocity", "motion.omega")
        n, frame = self.arithmetic, self.principal
        along = n.array(self.motion.omega)
        if self.motion.basis == "body":
            along = n.tidy(frame.axes @ self.axes.T @ along)
        noise = 0 if n.exact else ZERO_MOMENT * n.hypot(*along)
        idle = [n.sign(moment) == 0 for moment in frame.moments]
        if any(no and abs(n.size(rate)) > noise for no, rate in zip(idle, along, strict=True)):
            if all(idle):
                problem = "the body is a point, which has no moment of inertia, and cannot turn"
                raise self.refusal(problem, "motion.omega", hint="give the body some extent")
            raise self.refusal(
                "the body is linear: it has no moment about its line, and cannot turn about it",
                "motion.omega",
                hint="make `omega` perpendicular to the line",
            )
        return along

    @cached_property
    def heavy_top(self) -> HeavyTop:
        """The top of the section `top`, which it describes itself or by the body, held at the point O.

        Raises ValueProblem where there is none.
        """
        if self.top is None:
            raise ValueProblem("missing, expected a top", path=("top",))
        from rigidcli.model.top import described, of_body

        try:
            if self.body is None:
                return described(self.top, self.arithmetic)
            return of_body(self.top, self.properties, self.point, self.tensor, self.arithmetic)
        except ValueProblem as problem:
            if problem.path[:1] != ("body",):
                problem.below("top")
            raise

    @cached_property
    def orientation(self) -> Array:
        """The rotation from the document's axes to those of space at t = 0 (3 by 3)."""
        if self.motion is None or self.motion.orientation is None:
            return self.arithmetic.array(np.eye(3, dtype=int))
        try:
            return self.motion.orientation.as_matrix(self.arithmetic)
        except ValueProblem as problem:
            raise problem.below("motion", "orientation") from None

    def _point(self, properties: MassProperties) -> Array:
        if self.about == "com":
            return properties.com
        return self.arithmetic.array([0, 0, 0] if self.about == "origin" else self.about)
