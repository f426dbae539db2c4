"""Where lines in boxes are cut, so that integrals along the lines that follow are smooth on each panel.

The integral along the last coordinate is cut where narrow functions are zero, or turn back. As a function of
the coordinates before, it is smooth until one of these places comes to an end of the line, or two of them
meet. So the lines before are cut where narrow functions are zero, or turn back, on courses: ways along which
the coordinates that are still to come are at faces of the box, or where the function is lowest or highest in
these; and where the surfaces of two functions meet on a face.

Sources: R. I. Saye, SIAM J. Sci. Comput. 37 (2015) A993, and J. Comput. Phys. 448 (2022) 110720. There, the
cuts are zeros of discriminants and resultants of polynomials. Here the functions are followed by a search.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np

from rigidcli.core import line_search
from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.core.boxes import replaced
from rigidcli.core.cuts import NO_DISTANCE, Cuts, signed
from rigidcli.core.kinks import Course, Function

MERGED = 1e-11
"""Cuts that are closer to each other, in units of the box, are one."""


class Panels(NamedTuple):
    """Parts of lines: the line on which each lies (n), its beginning and its end (n), from 0 to 1.

    `graded` (n) tells where there may be roots of the distance from an end.
    """

    line: Array
    low: Floats
    high: Floats
    graded: Mask


class Places(NamedTuple):
    """Where lines are cut: which of them (n), and where (n); and whether roots may begin there (n)."""

    line: Array
    place: Floats
    rooted: Mask


def panels(cuts: Cuts, level: int, fixed: Floats) -> Panels:
    """The panels of lines along the coordinate of a level, through points (1 + d by n)."""
    count, box = fixed.shape[1], fixed[0].astype(int)
    found = [
        Places(np.tile(np.arange(count), 2), np.repeat([0.0, 1.0], count), np.zeros(2 * count, dtype=bool))
    ]
    for k in range(len(cuts.narrow)):
        those = np.flatnonzero(cuts.active[k, box])
        for some, course in _courses(cuts, k, level, fixed[:, those]) if those.size else ():
            own = _cut(cuts, k, level, course, some.size)
            found.append(own._replace(line=those[some[own.line]]))
    found.extend(_meetings(cuts, level, fixed))
    line, place, rooted = (np.concatenate(parts) for parts in zip(*found, strict=True))
    graded = np.zeros(count, dtype=bool)
    graded[line[rooted]] = True
    inside = (place > MERGED) & (place < 1 - MERGED)
    line, place = line[inside | (place == 0) | (place == 1)], place[inside | (place == 0) | (place == 1)]
    order = np.lexsort((place, line))
    line, place = line[order], place[order]
    kept = np.append(True, (np.diff(line) > 0) | (np.diff(place) > MERGED))
    line, place = line[kept], place[kept]
    same = line[1:] == line[:-1]
    line = line[1:][same]
    return Panels(line, place[:-1][same], place[1:][same], graded[line])


def _cut(cuts: Cuts, k: int, level: int, course: Course, count: int) -> Places:
    """Where one narrow function cuts so many courses."""
    narrow, is_last = cuts.narrow[k], level == cuts.depth - 1
    core = partial(_along, narrow.core, course)
    samples = line_search.samples(core, count)
    zeros, passed = line_search.crossings(core, samples)
    if narrow.breaks:
        return Places(zeros, passed, np.full(zeros.size, not is_last))
    is_rooted = bool(cuts.rough[k]) or not is_last
    line, place = line_search.turns(core, samples)
    line = np.concatenate([line, np.tile(np.arange(count), 2), zeros[: zeros.size * is_last]])
    place = np.concatenate([place, np.repeat([0.0, 1.0], count), passed[: zeros.size * is_last]])
    arguments = narrow.argument(course(line, place))
    cuts.note(k, arguments)
    matters = narrow.matters(arguments, cuts.largest[k])
    if cuts.rough[k]:
        matters &= np.abs(arguments) > NO_DISTANCE * cuts.largest[k]
    line, place = line[matters], place[matters]
    beside, further = narrow.widths(course, line, place, arguments[matters], cuts.largest[k])
    rooted = is_rooted & (place > 0) & (place < 1)
    return Places(
        np.concatenate([zeros, line, beside]),
        np.concatenate([passed, place, further]),
        np.concatenate([np.full(zeros.size, is_rooted), rooted, np.zeros(beside.size, dtype=bool)]),
    )


def _courses(cuts: Cuts, k: int, level: int, fixed: Floats) -> Iterator[tuple[Array, Course]]:
    """Courses for a narrow function along the coordinate of a level, from points (1 + d by n).

    With each comes from which of the points it goes. Where the function is lowest or highest, its surfaces
    begin or end to cross the lines along the coordinates that are free.
    """
    box = fixed[0].astype(int)
    axes = cuts.order[level:, box]
    if level == cuts.depth - 1:
        yield np.arange(box.size), cuts.boxes.lines(fixed, axes[0]).at
        return
    for sides in product((0.0, 1.0, None), repeat=cuts.depth - 1 - level):
        free = [side is None for side in sides]
        for which, sign in enumerate((1, -1)[: 1 + any(free)]):
            turned = cuts.turned[which, k, axes[1:][free], box]
            those = np.flatnonzero(turned.all(axis=0))
            if those.size:
                guide = partial(signed, partial(cuts.at, cuts.narrow[k].guide), sign)
                yield those, partial(_followed, cuts, guide, fixed[:, those], axes[:, those], sides)


def _followed(
    cuts: Cuts,
    guide: Function,
    fixed: Floats,
    axes: Array,
    sides: Sequence[float | None],
    on: Array,
    t: Floats,
) -> Floats:
    """Images of points on courses. The guide is lowest in the coordinates that are at no side."""
    points = replaced(fixed[:, on], axes[0, on], t)
    for axis, side in zip(axes[1:, on], sides, strict=True):
        if side is not None:
            points = replaced(points, axis, side)
    free = axes[1:, on][[side is None for side in sides]]
    return cuts.boxes.at(line_search.lowest_within(guide, points, free) if len(free) else points)[0]


def _meetings(cuts: Cuts, level: int, fixed: Floats) -> Iterator[Places]:
    """Where the surfaces of two narrow functions meet, all coordinates to come but one being at faces."""
    box, left = fixed[0].astype(int), cuts.depth - 1 - level
    for k in range(len(cuts.narrow) if left else 0):
        for other in range(k):
            those = np.flatnonzero(cuts.active[k, box] & cuts.active[other, box])
            for free, sides in (
                product(range(left), product((0.0, 1.0), repeat=left - 1)) if those.size else ()
            ):
                axes = np.roll(cuts.order[level:, box[those]][1:], -free, axis=0)
                first = cuts.order[level, box[those]]
                met = partial(_met, cuts, k, other, fixed[:, those], first, axes, sides)
                line, place = line_search.crossings(met, line_search.samples(met, those.size))
                yield Places(those[line], place, np.full(line.size, left > 1))


def _met(
    cuts: Cuts,
    k: int,
    other: int,
    fixed: Floats,
    first: Array,
    axes: Array,
    sides: Sequence[float],
    on: Array,
    t: Floats,
) -> Floats:
    """The product of what one function is where the other is zero, at places along the `first` coordinate.

    This is on lines along the first of the coordinates to come, `axes`; the others are at these sides.
    """
    points = replaced(fixed[:, on], first[on], t)
    for axis, side in zip(axes[1:, on], sides, strict=True):
        points = replaced(points, axis, side)
    course = cuts.boxes.lines(points, axes[0, on]).at
    core = partial(_along, cuts.narrow[k].core, course)
    zeros, found = line_search.crossings(core, line_search.samples(core, on.size))
    values = np.ones(on.size)
    np.multiply.at(values, zeros, cuts.narrow[other].core(course(zeros, found)))
    return values


def _along(function: Function, course: Course, on: Array, t: Floats) -> Floats:
    """A function on courses: on which of them, and at which places."""
    return function(course(on, t))
