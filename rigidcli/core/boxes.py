"""Boxes in the coordinates of a shape, and cones in them: where integrals of densities are taken.

A cone fills the way from a point of a box, its apex, to one of the faces. Surfaces round the apex pass
through its rays once: along each ray something grows with the distance, and no ray touches such a surface.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from rigidcli.core.arithmetic import Array, Floats

FLAT = 1e-9
"""A cone is left out if its apex is nearer to its face than this, in units of the box: it is empty."""


class Boxes(NamedTuple):
    """Boxes and cones in them, as images of unit boxes (d coordinates, n of them).

    `piece` (n) is the part of the shape in which each lies, `low` and `high` (d by n) are its ends. A cone
    goes from its `apex` (d by n) to the face at the `end` (n) of the coordinate `ray` (n), which is from 0 to
    1 along its rays in the unit box. It is -1 in a box that is no cone.
    """

    piece: Floats
    low: Floats
    high: Floats
    apex: Floats
    end: Floats
    ray: Array

    @classmethod
    def between(cls, piece: int, cuts: Sequence[Floats]) -> Boxes:
        """All the boxes between cuts on each coordinate."""
        low = np.array(list(product(*(cut[:-1] for cut in cuts)))).T
        high = np.array(list(product(*(cut[1:] for cut in cuts)))).T
        count = low.shape[1]
        return cls(np.full(count, float(piece)), low, high, low, np.zeros(count), np.full(count, -1))

    def taken(self, those: Array) -> Boxes:
        """Some of them."""
        return Boxes(*(part[..., those] for part in self))

    def cones(self, apex: Floats) -> tuple[Boxes, Array]:
        """The cones from an apex in each (d by n) to all its faces, and which of the boxes each is in."""
        found, sources = [], []
        for ray in range(len(self.low)):
            for ends in (self.low, self.high):
                far = np.abs(ends[ray] - apex[ray]) > FLAT * (self.high - self.low)[ray]
                those = np.flatnonzero(far)
                filled = np.full(those.size, ray)
                found.append(
                    self.taken(those)._replace(apex=apex[:, those], end=ends[ray, those], ray=filled)
                )
                sources.append(those)
        return joined(found), np.concatenate(sources)

    def at(self, points: Floats) -> tuple[Floats, Floats]:
        """The images of points (1 + d by m), whose first row is the index of the box; and the measure (m).

        The first row of an image is the piece. Along rays, the measure is that of their ends.
        """
        which = points[0].astype(int)
        low = self.low[:, which]
        sides = self.high[:, which] - low
        places = low + sides * points[1:]
        those = np.flatnonzero(self.ray[which] >= 0)
        if those.size:
            own, each = which[those], np.arange(those.size)
            axis, apex, end = self.ray[own], self.apex[:, own], self.end[own]
            face = places[:, those]
            face[axis, each] = end
            places[:, those] = apex + points[1 + axis, those] * (face - apex)
            sides[axis, those] = np.abs(end - apex[axis, each])
        return np.vstack([self.piece[which], places]), np.asarray(sides.prod(axis=0))

    def lines(self, points: Floats, axis: Array) -> Lines:
        """The lines through points (1 + d by m) along a coordinate of each, from 0 to 1 in it.

        The coordinates of rays come last, or are 0 or 1: lines are straight then.
        """
        start, _ = self.at(replaced(points, axis, 0.0))
        end, measure = self.at(replaced(points, axis, 1.0))
        rays = self.ray[points[0].astype(int)] == axis
        return Lines(start, end - start, measure, rays * (len(self.low) - 1))


class Lines(NamedTuple):
    """Straight lines in boxes: where they begin, and the way to their ends (1 + d by n).

    The measure along them is `measure` (n) times this power of the coordinate.
    """

    start: Floats
    way: Floats
    measure: Floats
    power: Array

    def at(self, on: Array, t: Floats) -> Floats:
        """Points (1 + d by m): on which of the lines, and where from 0 to 1."""
        places: Floats = self.start[:, on] + t * self.way[:, on]
        return places

    def along(self, on: Array, t: Floats) -> tuple[Floats, Floats]:
        """Points (1 + d by m p) and the measure there, for p places on each of m lines."""
        places = self.start[:, on, None] + t * self.way[:, on, None]
        measure = self.measure[on, None] * t ** self.power[on, None]
        return places.reshape(len(places), -1), measure.ravel()


def replaced(points: Floats, axis: Array, places: Floats | float) -> Floats:
    """Points (1 + d by n) with other places on a coordinate of each, counted from 0."""
    changed = points.copy()
    changed[axis + 1, np.arange(points.shape[1])] = places
    return changed


def joined(parts: Iterable[Boxes]) -> Boxes:
    """Boxes one after the other."""
    return Boxes(*(np.concatenate(rows, axis=-1) for rows in zip(*parts, strict=True)))
