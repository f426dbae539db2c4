"""The key of a trajectory: what is right at any time, and how near an answer must be.

An answer is right where each judged column is within its margin at the answer's own times. The margin is by
the question's tolerance of the column's size, which is its largest value over the span (that of an angle at
most half a period). Two runs of a document show how long its motion can be predicted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.numbers import NOISE, margin, read_number
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import Question
from rigidcli.grading.trajectories.conserved import Conserved, conserved, listed
from rigidcli.grading.trajectories.dense import Formulas, Samples, Trajectory, interpolated, parting
from rigidcli.grading.trajectories.source import TIME, Source
from rigidcli.model.units import parse_unit

QUATERNION = ("q0", "q1", "q2", "q3")

UNIT_LENGTH = 1e-3
"""How far columns with these names may be from length 1 to be taken for a quaternion."""

GRID = 2001
"""Times at which mistakes are looked for."""

OFF = 0.25
"""The part of a margin that the reference itself may be off by."""

PARTED = 0.1
"""The part of a margin by which two runs of a document may differ."""

AMPLIFIED = 2e-7
"""What they may differ by in units of a column's size, too: the errors of their steps are then amplified so
much that an answer that is worked with less care, but well enough, would be beyond its margin."""

LEAST_HORIZON = 0.02
"""The part of the span that must be predictable."""

MOVING = 4
"""The range of a column that changes, in margins."""


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """What is right, from `start` to `stop`; beyond `horizon` the motion cannot be predicted.

    The `reference` has the judged `columns` (m) first, then `further` ones, which an answer must have for
    what it is to conserve. `margins` and `periods` (m) tell how near a column must be, and modulo what:
    infinite for one that is no angle. `grid` (g by m) are the judged columns at `instants` (g) up to the
    horizon, and `ranges` (m) what they change by there, at least their margins; one that moves crosses
    the middle of its range `crossings` times. The columns at `quaternion` have a common sign without meaning.
    """

    columns: tuple[str, ...]
    further: tuple[str, ...]
    reference: Trajectory
    start: float
    stop: float
    horizon: float
    margins: Floats
    periods: Floats
    quaternion: tuple[int, ...]
    conserved: tuple[Conserved, ...]
    instants: Floats
    grid: Floats
    ranges: Floats
    crossings: int

    @property
    def span(self) -> float:
        """How long the motion is."""
        return self.stop - self.start

    @property
    def moving(self) -> Mask:
        """Which of the judged columns change (m)."""
        return self.ranges > MOVING * self.margins

    def all_at(self, times: Floats) -> Floats:
        """The judged and the further columns (k by m and more) at `times` (k)."""
        return self.reference.at(np.clip(times, self.start, self.stop))

    def at(self, times: Floats) -> Floats:
        """The judged columns (k by m) at `times` (k)."""
        return self.all_at(times)[:, : len(self.columns)]

    def roughly_at(self, times: Floats) -> Floats:
        """The same from the grid, for `times` (k) up to the horizon."""
        return np.column_stack([np.interp(times, self.instants, column) for column in self.grid.T])

    def misses(self, values: Floats, expected: Floats) -> Floats:
        """By how much values are off, in units of the margins (all k by m)."""
        if self.quaternion:
            values = values * self._signs(values, expected)
        return np.abs(self.wrapped(values - expected)) / self.margins

    def wrapped(self, differences: Floats) -> Floats:
        """Differences of the columns (... by m), those of angles to the nearest period."""
        periods = np.where(np.isfinite(self.periods), self.periods, 1.0)
        near = differences - periods * np.round(differences / periods)
        return np.where(np.isfinite(self.periods), near, differences)

    def _signs(self, values: Floats, expected: Floats) -> Floats:
        """What makes quaternions those that are nearer to what is expected (k by m)."""
        signs = np.ones_like(values)
        places = list(self.quaternion)
        opposite = np.nansum(values[:, places] * expected[:, places], axis=1) < 0
        signs[np.ix_(opposite, places)] = -1.0
        return signs


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """What an answer has: `times` (k), and the judged columns (k by m), NaN where one is missing.

    `failing` are the places of columns that are not right; None where the times do not cover the span, so
    that only other times can explain the answer.
    """

    times: Floats
    values: Floats
    failing: tuple[int, ...] | None

    @property
    def present(self) -> list[int]:
        """The places of columns that are not missing."""
        return [place for place in range(self.values.shape[1]) if not np.isnan(self.values[0, place])]


@np.errstate(all="ignore")
def key_of(source: Source, question: Question) -> Key:
    """The key of a question. Raises ValueProblem for options that do not fit."""
    names = _judged(source, question)
    laws = listed(source, question)
    further = tuple(sorted({name for law in laws for name in law.names}.difference(names)))
    periods = np.array([_period(name, source, question) for name in names])
    joint = _joint(names, source)
    values = _smooth(np.column_stack([source.columns[name] for name in names]), periods, joint)
    sizes = _sizes(names, source, values, periods)
    margins = np.array([margin(size, question.tolerance) for size in sizes])
    if not (margins < periods / 4).all():
        raise ValueProblem("any angle is within this tolerance", path=("tolerance",))
    everything = np.column_stack([values, *(source.columns[name] for name in further)])
    allowed = np.minimum(PARTED * margins, AMPLIFIED * np.array(sizes))
    horizon = _horizon(names, source, values, allowed, periods, joint)
    reference = _reference((*names, *further), source, everything, margins, horizon)
    instants = np.linspace(source.times[0], horizon, GRID)
    grid = reference.at(instants)[:, : len(names)]
    ranges = np.maximum(np.ptp(grid, axis=0), margins)
    return Key(
        columns=names,
        further=further,
        reference=reference,
        start=float(source.times[0]),
        stop=float(source.times[-1]),
        horizon=horizon,
        margins=margins,
        periods=periods,
        quaternion=joint,
        conserved=conserved(source, question, laws, dict(zip(names, margins.tolist(), strict=True))),
        instants=instants,
        grid=grid,
        ranges=ranges,
        crossings=_crossings(grid[:, ranges > MOVING * margins]),
    )


def _judged(source: Source, question: Question) -> tuple[str, ...]:
    names = question.columns or source.default
    for option, given in (("columns", question.columns), ("angles", question.angles)):
        for name in given:
            if name not in source.columns:
                hint = f"there are {', '.join(source.columns)}"
                raise ValueProblem(f"the key has no column {shown(name)}", path=(option,), hint=hint)
    if not names or len(set(names)) < len(names):
        raise ValueProblem("expected columns to judge, each once", path=("columns",))
    return names


def _period(name: str, source: Source, question: Question) -> float:
    """What a column is judged modulo; a `modulo` without `angles` is that of every column."""
    angles = question.angles or source.angles
    if name not in angles and (angles or question.modulo is None):
        return np.inf
    if question.modulo is None:
        return 2 * np.pi
    try:
        period = read_number(str(question.modulo), parse_unit("rad"))
    except Unreadable:
        period = 0.0
    if period <= 0:
        raise ValueProblem("expected a period, such as `2*pi` or `360 deg`", path=("modulo",))
    return period


def _joint(names: Sequence[str], source: Source) -> tuple[int, ...]:
    """The places of the components of a quaternion."""
    if not all(name in source.columns for name in QUATERNION):
        return ()
    squares = sum(source.columns[name] ** 2 for name in QUATERNION)
    is_unit = bool(np.abs(np.sqrt(squares) - 1).max() < UNIT_LENGTH)
    return tuple(place for place, name in enumerate(names) if name in QUATERNION) if is_unit else ()


def _smooth(values: Floats, periods: Floats, joint: tuple[int, ...]) -> Floats:
    """Columns (n by m) without the jumps of angles by a period, and of quaternions to the opposite sign."""
    values = values.copy()
    for place in np.flatnonzero(np.isfinite(periods)):
        values[:, place] = np.unwrap(values[:, place], period=periods[place])
    if joint:
        places = list(joint)
        turned = (values[1:, places] * values[:-1, places]).sum(axis=1) < 0
        values[1:, places] *= np.cumprod(np.where(turned, -1.0, 1.0))[:, None]
    return values


def _sizes(names: Sequence[str], source: Source, values: Floats, periods: Floats) -> list[float]:
    """The largest value of each column; of one that is zero throughout, that of what is like it."""
    own = np.minimum(np.abs(values).max(axis=0), periods / 2).tolist()
    sizes = []
    for name, size in zip(names, own, strict=True):
        family = next((family for family in source.families if name in family), (name,))
        largest = max(float(np.abs(source.columns[each]).max()) for each in family)
        is_zero = size <= (NOISE * largest if source.vectors else 0.0)
        sizes.append((largest or max(own) or 1.0) if is_zero else size)
    return sizes


def _reference(
    names: Sequence[str], source: Source, values: Floats, margins: Floats, horizon: float
) -> Trajectory:
    """What has the columns (n by m and more) at any time. Raises ValueProblem for too few samples."""
    if source.formulas is not None:
        return Formulas(tuple(source.formulas[name] for name in names))
    anything = np.full(values.shape[1] - len(margins), np.inf)
    samples, off = interpolated(source.times, values, np.append(margins, anything), horizon)
    worst = int(off.argmax())
    if not off[worst] <= OFF:
        raise ValueProblem(
            f"there are too few samples of {shown(names[worst])} for this tolerance", hint=source.remedy
        )
    return samples


def _horizon(
    names: Sequence[str],
    source: Source,
    values: Floats,
    allowed: Floats,
    periods: Floats,
    joint: tuple[int, ...],
) -> float:
    """Until when the motion can be predicted: two runs differ by no more than is `allowed` (m)."""
    times = source.times
    if source.other is None:
        return float(times[-1])
    own = source.other[TIME]
    other = _smooth(np.column_stack([source.other[name] for name in names]), periods, joint)
    if not np.array_equal(own, times):
        other = Samples.through(own, other).at(np.clip(times, own[0], own[-1]))
    until = parting(times, values, other, allowed)
    if until - times[0] < LEAST_HORIZON * (times[-1] - times[0]):
        raise ValueProblem(
            "two runs soon differ: only a small part of this motion can be predicted",
            hint="ask for a shorter time, or lower the tolerance of the orbit itself",
        )
    return until


def _crossings(grid: Floats) -> int:
    """How often one of the columns (g by m) crosses the middle of its range."""
    above = grid > (grid.max(axis=0, initial=-np.inf) + grid.min(axis=0, initial=np.inf)) / 2
    return int((above[1:] != above[:-1]).sum(axis=0).max(initial=0))
