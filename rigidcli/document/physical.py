"""The numbers that the sections of a document describe: masses, tensors, axes and tops."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidcli.core import rotation
from rigidcli.core.arithmetic import Arithmetic, Array
from rigidcli.core.mass_properties import MassProperties
from rigidcli.core.tensor import IDENTITY, rotate, without_rounding
from rigidcli.errors import ValueProblem, at

if TYPE_CHECKING:
    from rigidcli.bodies.bodies import Body
    from rigidcli.bodies.form import Rotation
    from rigidcli.bodies.tops import HeavyTop
    from rigidcli.core.principal import PrincipalFrame

SAME_POINT = 1e-12
"""Relative to their distance from the origin: two points so close differ by rounding only."""


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
            from rigidcli.bodies.shape import Shape

            assert isinstance(self.body, Shape)
            return self.body.point_named(about, self.arithmetic)
        return self.arithmetic.array([0, 0, 0] if about == "origin" else about)

    def _require_known(self) -> None:
        """Raise ValueProblem where a tensor without a mass would have to be shifted."""
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
