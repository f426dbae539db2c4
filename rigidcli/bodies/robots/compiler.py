"""What settings of `<compiler>` of MJCF make of the masses and tensors that are written in a file.

The least mass of a body and its least principal moment, equal moments in place of some that no body has, and
a mass of all bodies together, to which all are scaled in the end (MuJoCo, XML reference, `compiler`).
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from pydantic import ValidationError

from rigidcli.bodies.form import Form
from rigidcli.bodies.robots.elements import Element
from rigidcli.bodies.robots.links import (
    COLUMNS,
    ENTRIES,
    NO_MASS,
    ROWS,
    Body,
    Decimals,
    Link,
    listed,
    matrix,
    numbers,
    tensor,
)
from rigidcli.bodies.shapes import SHAPES
from rigidcli.core.arithmetic import FLOAT, Arithmetic, Floats
from rigidcli.core.mass_properties import MassProperties, combine
from rigidcli.core.tensor import shortfall
from rigidcli.errors import RigidError
from rigidcli.fields.environment import Environment

BARE = "no mass but the `boundmass` of `<compiler>`"
"""Why a body without geoms has no mass properties: MuJoCo puts that mass where no place is written."""


@dataclass(frozen=True, slots=True)
class Compiler:
    """The least mass (kg) and moment (kg m^2) of a body, whether moments are balanced, and the whole mass.

    A whole mass that is not positive changes nothing. The names of bodies that were `changed` are kept.
    """

    least_mass: float
    least_moment: float
    balances: bool
    whole: float
    changed: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, element: Element, decimal: Decimals) -> Compiler:
        """The settings that an element has.

        Raises DocumentError where one is no number, and where numbers are read to be exact, and would change.
        """
        mass, moment, whole = (
            numbers(element, key, 1, float, "0")[0] for key in ("boundmass", "boundinertia", "settotalmass")
        )
        found = cls(mass, moment, element.attributes.get("balanceinertia") == "true", whole)
        if decimal is not float and (found.bounds or whole > 0):
            raise element.refusal(
                "what `<compiler>` makes of masses and tensors is not exact", hint="leave out `--exact`"
            )
        return found

    @property
    def bounds(self) -> bool:
        """Whether single bodies may change."""
        return self.least_mass > 0 or self.least_moment > 0 or self.balances

    def bounded(self, found: Body | str, name: str) -> Body | str:
        """The mass properties of a body, or why there are none, of the least mass and moments at least."""
        if isinstance(found, str):
            return BARE if found == NO_MASS and self.least_mass > 0 else found
        if not self.bounds or (body := _as_one(found)) is None:
            return found
        moments, axes = np.linalg.eigh(_matrix(body))
        least = np.maximum(moments, self.least_moment)
        if self.balances and shortfall(np.diag(least)) is not None:
            least[:] = least.mean()
        mass = max(body["mass"], self.least_mass)
        if mass == body["mass"] and (least == moments).all():
            return found
        self.changed.append(name)
        return _written(body, mass, (axes * least) @ axes.T)

    def scaled(self, links: Sequence[Link], others: Sequence[str]) -> tuple[Sequence[Link], list[str]]:
        """The links with the whole mass that is set, and notes of what is not as it is written.

        Nothing is scaled where there are `others`, of which the masses are not known.
        """
        notes = []
        if self.changed:
            notes.append(f"`<compiler>` changes the mass or the tensor of {listed(self.changed)}")
        if self.whole <= 0:
            return links, notes
        key = f"`<compiler>` sets the whole mass to {self.whole:g} kg"
        bodies = [None if link.inertial is None else _as_one(link.inertial) for link in links]
        unknown = [
            *(
                link.name
                for link, body in zip(links, bodies, strict=True)
                if body is None and link.without not in (NO_MASS, BARE)
            ),
            *others,
        ]
        bare = sum(link.without == BARE for link in links) * self.least_mass
        written = bare + sum(body["mass"] for body in bodies if body is not None)
        if unknown or written <= 0:
            reason = f"of {listed(unknown)} it is not known" if unknown else f"{written:g} kg are written"
            return links, [*notes, f"{key}, which is not done: {reason}"]
        scale = self.whole / written
        scaled = [
            link
            if body is None
            else replace(link, inertial=_written(body, scale * body["mass"], scale * _matrix(body)))
            for link, body in zip(links, bodies, strict=True)
        ]
        return scaled, [*notes, f"{key}: masses and tensors are {scale:.9g} times what is written"]


class _Parts(Form):
    """Parts in a frame, as a composite has them, and no holes."""

    parts: list[Any]

    def local(self, arithmetic: Arithmetic) -> MassProperties:
        """The sum of the parts."""
        return combine([_form(part).properties(arithmetic) for part in self.parts], arithmetic)


def _form(body: Body) -> Form:
    """A shape, or parts. Raises ValidationError."""
    kind = SHAPES[body["shape"]] if "shape" in body else _Parts
    return kind.model_validate(body, context=Environment())


def _as_one(body: Body) -> Body | None:
    """A body by its mass and tensor, also one of parts; None where that is no body."""
    if "parts" not in body:
        return body
    with suppress(ValidationError, RigidError):
        whole = _form(body).properties(FLOAT)
        place = {"mass": float(whole.mass or 0), "position": whole.com.tolist()}
        return _written(place, place["mass"], whole.tensor)
    return None


def _matrix(body: Body) -> Floats:
    """The tensor of a body (3 by 3, kg m^2)."""
    return matrix([body["inertia"].get(key, 0) for key in ENTRIES])


def _written(body: Body, mass: float, entries: Floats) -> Body:
    """A body with another mass and another tensor (3 by 3, kg m^2), in its own frame."""
    return body | {"mass": mass, "inertia": tensor(entries[ROWS, COLUMNS].tolist())}
