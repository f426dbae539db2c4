"""The whole document: a body, where its tensor is asked, how it turns, and what makes it precess."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from rigidcli.core.arithmetic import Arithmetic, Array
from rigidcli.core.tensor import MassProperties
from rigidcli.errors import ValueProblem
from rigidcli.model.base import Point, Section, elsewhere, environment
from rigidcli.model.bodies import Body
from rigidcli.model.environment import Environment
from rigidcli.model.motion import Motion
from rigidcli.model.rotations import Rotation

if TYPE_CHECKING:
    from rigidcli.model.tide import Tide
    from rigidcli.model.top import HeavyTop, Top
else:
    # Few documents have these: the others do not wait for them.
    Tide = Annotated[Section, elsewhere("rigidcli.model.tide", "Tide")]
    Top = Annotated[Section, elsewhere("rigidcli.model.top", "Top")]

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

    _environment: Environment = PrivateAttr()
    _source: str = PrivateAttr(default="")
    _notes: tuple[str, ...] = PrivateAttr(default=())

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
    def source(self) -> str:
        """Where the document was read from, as the user named it."""
        return self._source

    @property
    def notes(self) -> tuple[str, ...]:
        """What the reader of the document should know about it."""
        return self._notes

    def came_from(self, source: str, notes: Sequence[str]) -> Self:
        """The document, knowing its source and notes."""
        self._source, self._notes = source, tuple(notes)
        return self

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
