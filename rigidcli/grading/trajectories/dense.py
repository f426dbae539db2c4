"""The right trajectory at any time: by formulas of the time, or between many samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.symbolic.language import evaluation
from rigidcli.symbolic.language.tree import Node

STENCILS = (8, 4, 2)
"""Samples from which a value between them is interpolated: fewer are better where a motion is not smooth."""


@dataclass(frozen=True, slots=True, eq=False)
class Formulas:
    """A trajectory by a tree for each of its columns, in which `t` is the only name."""

    trees: tuple[Node, ...]

    def some(self, places: Sequence[int]) -> Formulas:
        """Some of the columns."""
        return Formulas(tuple(self.trees[place] for place in places))

    def at(self, times: Floats) -> Floats:
        """The columns (k by m) at `times` (k); infinite or NaN where a formula has no value."""
        values = np.empty((len(times), len(self.trees)))
        for place, tree in enumerate(self.trees):
            values[:, place] = evaluation.array(tree, {"t": times})
        return values


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """A trajectory by its `values` (n by m) at ascending `times` (n), interpolated by polynomials.

    That of degree d - 1 through the d samples about a time is Lagrange's (J.-P. Berrut, L. N. Trefethen,
    Barycentric Lagrange interpolation, SIAM Review 46 (2004), section 2), with its constant `weights` (n - d
    + 1 by d) in units of the mean step; not in the barycentric form, which divides by zero at the samples.
    """

    times: Floats
    values: Floats
    weights: Floats

    @classmethod
    def through(cls, times: Floats, values: Floats, stencil: int = STENCILS[0]) -> Self:
        """The trajectory through samples, interpolated from so many of them at a time."""
        knots = _scaled(times, times)
        near = np.lib.stride_tricks.sliding_window_view(knots, min(stencil, len(times)))
        gaps = near[:, :, None] - near[:, None, :]
        return cls(times, values, 1 / np.where(gaps == 0, 1, gaps).prod(axis=2))

    def some(self, places: Sequence[int]) -> Samples:
        """Some of the columns."""
        return replace(self, values=self.values[:, list(places)])

    def at(self, times: Floats) -> Floats:
        """The columns (k by m) at `times` (k) inside the span of the samples."""
        width = self.weights.shape[1]
        knots, asked = _scaled(self.times, self.times), _scaled(self.times, times)
        after = np.searchsorted(knots, asked, side="right")
        first = np.clip(after - width // 2, 0, len(self.weights) - 1)
        away = asked[:, None] - knots[first[:, None] + np.arange(width)]
        ones = np.ones((len(times), 1))
        below = np.cumprod(np.hstack([ones, away[:, :-1]]), axis=1)
        above = np.cumprod(np.hstack([ones, away[:, :0:-1]]), axis=1)[:, ::-1]
        parts = self.weights[first] * below * above
        values = np.zeros((len(times), self.values.shape[1]))
        for place in range(width):
            values += parts[:, place, None] * self.values[first + place]
        return values


Trajectory: TypeAlias = Formulas | Samples


def _scaled(knots: Floats, times: Floats) -> Floats:
    """Times in units of the mean step, so that products of many are within the range of floats."""
    scaled: Floats = (times - knots[0]) * ((len(knots) - 1) / (knots[-1] - knots[0]))
    return scaled


def interpolated(times: Floats, values: Floats, margins: Floats, end: float) -> tuple[Samples, Floats]:
    """The trajectory through samples, and by how much it may be off between them, in units of `margins` (m).

    That is estimated up to the time `end` from every second sample: these miss the others by more.
    """
    best: tuple[Samples, Floats] | None = None
    for stencil in STENCILS:
        off = missed(times, values, end, stencil) / margins
        if best is None or off.max() < best[1].max():
            best = Samples.through(times, values, stencil), off
        if off.max() < 1e-3:  # as good as exact: others need not be tried
            break
    assert best is not None
    return best


def missed(times: Floats, values: Floats, end: float, stencil: int) -> Floats:
    """By how much every second sample misses the others (m), up to the time `end`."""
    half = Samples.through(times[::2], values[::2], stencil)
    left_out = times[1:-1:2][times[1:-1:2] <= end]
    miss: Floats = np.abs(half.at(left_out) - values[1:-1:2][: len(left_out)]).max(axis=0, initial=0.0)
    return miss


def parting(times: Floats, one: Floats, other: Floats, allowed: Floats) -> Floats:
    """The times until which columns of two runs (n by m) differ by no more than is `allowed` (m)."""
    apart = np.abs(one - other) > allowed
    last: Floats = times[np.maximum(0, np.argmax(apart, axis=0) - 1)]
    return np.where(apart.any(axis=0), last, times[-1])
