"""The key of a trajectory: what is right at any time, and how near an answer must be.

An answer is right where each judged column is within its margin at the answer's own times. The margin is by
the question's tolerance of the column's size, which is its largest value over the span (that of an angle at
most half a period). A table whose rows are too far apart to tell what is between them is compared at its own
times instead. Two runs of a document show how long its motion can be predicted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.factors import TURN
from rigidcli.grading.numbers import NOISE, margin, read_number
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import Question
from rigidcli.grading.trajectories.conserved import Conserved, conserved, laws_of
from rigidcli.grading.trajectories.source import Source
from rigidcli.grading.trajectories.tables import TIME
from rigidcli.model.units import parse_unit
from rigidcli.symbolic.language import evaluation
from rigidcli.symbolic.language.tree import Node

QUATERNION = ("q0", "q1", "q2", "q3")

UNIT_LENGTH = 1e-3
"""How far columns with these names may be from length 1 to be taken for a quaternion."""

GRID = 2001
"""Times at which mistakes are looked for."""

ORDERS = (7, 5, 3, 1)
"""Degrees of the splines through samples: low ones are better where a motion is not smooth."""

EXACT = 1e-3
"""The part of a margin that is as good as nothing: no further degree is tried."""

OFF = 0.25
"""The part of a margin that a spline, or rounding, may be off by."""

PARTED = 0.1
"""The part of a margin by which two runs of a document may differ."""

AMPLIFIED = 1e-7
"""What they may differ by in units of a column's size, too: the errors of their steps are then amplified so
much that an answer that is worked with less care, but well enough, would be beyond its margin."""

LEAST_HORIZON = 0.02
"""The part of the span that must be predictable."""

MOVING = 4
"""The range of a column that changes, in margins."""

COVERED = 0.99
"""The part of the span that an answer must cover."""

LONGEST_GAP = 0.1
"""Between two rows of an answer, in units of the span; more where the key itself has longer ones."""

SHOWN = 0.5
"""The part of a column's range that must be seen in the rows: of a swing, not just the returns."""

SLACK = 1e-9
"""How far beyond the span, in units of it, a time still belongs to it."""

SAME_TIME = 1e-6
"""How far times that are the same may be apart, in units of the span: they may be typed with few digits."""

Trajectory: TypeAlias = Callable[[Floats], Floats]
"""The columns (k by m) at times (k)."""


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """What an answer has: `times` (k), and the columns of the key (k by m), NaN where one is missing."""

    times: Floats
    values: Floats

    @property
    def present(self) -> Mask:
        """Which columns are not missing (m)."""
        return np.asarray(~np.isnan(self.values).all(axis=0))


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """What is right, from `start` to `stop`; beyond `horizon` the motion cannot be predicted.

    An answer must have the first `required` of the `columns` (m), and all `needed` ones; others are judged
    where they are handed in. `margins` and `periods` (m) tell how near a column must be, and modulo what:
    infinite for one that is not judged, or is no angle. Rows may be `gap` apart, in units of the span. `grid`
    (g by m) are the columns at `instants` (g) up to the horizon, and `ranges` (m) what they change by there,
    at least their margins. The columns at `quaternion` have a common sign without meaning, those at `rates`
    are angular velocities. With `in_si`, all are in SI units. Of a key that is compared at its own `times`
    (n), these are such.

    A mistake reads an answer in another way: its time t is `rate` t + `shift` of the reference, its columns
    are divided by the `factors` (m), and stand in another `order`.
    """

    columns: tuple[str, ...]
    required: int
    needed: frozenset[str]
    reference: Trajectory
    start: float
    stop: float
    horizon: float
    gap: float
    margins: Floats
    periods: Floats
    quaternion: tuple[int, ...]
    rates: tuple[int, ...]
    in_si: bool
    conserved: tuple[Conserved, ...]
    instants: Floats
    grid: Floats
    ranges: Floats
    times: Floats | None = None
    rate: float = 1.0
    shift: float = 0.0
    factors: Floats | float = 1.0
    order: tuple[int, ...] = ()

    @property
    def span(self) -> float:
        """How long the motion is."""
        return self.stop - self.start

    @property
    def moving(self) -> Mask:
        """Which of the judged columns change (m)."""
        return self.ranges > MOVING * self.margins

    @property
    def crossings(self) -> int:
        """How often one of the columns that change crosses the middle of its range."""
        grid = self.grid[:, self.moving]
        above = grid > (grid.max(axis=0, initial=-np.inf) + grid.min(axis=0, initial=np.inf)) / 2
        return int((above[1:] != above[:-1]).sum(axis=0).max(initial=0))

    def at(self, times: Floats) -> Floats:
        """The columns (k by m) at `times` (k)."""
        return self.reference(np.clip(times, self.start, self.stop))

    def roughly_at(self, times: Floats) -> Floats:
        """The same from the grid, for `times` (k) up to the horizon."""
        return np.column_stack([np.interp(times, self.instants, column) for column in self.grid.T])

    def read_with(
        self,
        *,
        rate: float = 1.0,
        shift: float = 0.0,
        factors: Floats | float = 1.0,
        order: tuple[int, ...] = (),
        more: Floats | float = 0.0,
        whole: bool = False,
    ) -> Key:
        """The key by which an answer is right that is read in this way, with margins that are `more`.

        The span is the part of which an answer from start to stop tells, or the `whole` of it.
        """
        ends = (-np.inf, np.inf) if whole else sorted(rate * end + shift for end in (self.start, self.stop))
        start, stop = max(self.start, ends[0]), min(self.stop, ends[1])
        part = self.grid[(self.instants >= start) & (self.instants <= stop)]
        return replace(
            self,
            needed=frozenset(),
            conserved=(),
            start=start,
            stop=stop,
            horizon=min(self.horizon, stop),
            margins=self.margins + more,
            ranges=np.maximum(np.ptp(part, axis=0) if len(part) else 0.0, self.margins),
            rate=rate,
            shift=shift,
            factors=factors,
            order=order,
        )

    def read(self, rows: Rows) -> Rows:
        """The rows of an answer as the key reads them."""
        values = rows.values[:, self.order] if self.order else rows.values
        forwards = slice(None, None, 1 if self.rate > 0 else -1)
        times = self.rate * rows.times + self.shift
        return Rows(times[forwards], (values / self.factors)[forwards])

    def written(self, times: Floats) -> Rows:
        """An answer that reads as the reference at these times."""
        values = self.at(times) * self.factors
        if self.order:
            values = values[:, np.argsort(self.order)]
        forwards = slice(None, None, 1 if self.rate > 0 else -1)
        return Rows(((times - self.shift) / self.rate)[forwards], values[forwards])

    def inside(self, times: Floats, until: float) -> Mask:
        """Which times belong to the span, or the part of it until a time."""
        slack = SLACK * self.span
        return np.asarray((times >= self.start - slack) & (times <= until + slack))

    def lacks(self, rows: Rows) -> str:
        """What is wrong with the times of an answer; empty where nothing is."""
        return self._lacks(self.read(rows).times)

    def _lacks(self, times: Floats) -> str:
        longest = (self.gap + SAME_TIME) * self.span
        near = times[(times >= self.start - longest) & (times <= self.stop + longest)]
        own = np.clip(near, self.start, self.stop)
        if not len(own) or np.ptp(own) < COVERED * self.span:
            return f"read times from {times[0]:g} to {times[-1]:g}" if len(times) else "there are none"
        if np.diff(own).max() > longest:
            return "the gaps between its rows are too long"
        own = times[self.inside(times, self.horizon)]
        seen = np.ptp(self.roughly_at(own), axis=0) if len(own) else 0.0
        unseen = self.moving & (seen < SHOWN * self.ranges)
        if not len(own) or unseen[: self.required].any():
            return "it has too few rows to show the motion"
        return ""

    def compared(self, rows: Rows, until: float | None = None) -> tuple[Floats, Floats, Floats]:
        """Times (k), values and what is expected (both k by m), up to the horizon or another time.

        Values are NaN that cannot be told: at a time of the key to which the answer has no row, where its
        rows are too far apart to tell what is between them.
        """
        rows = self.read(rows)
        if self.times is not None:
            rows = self._sampled(rows, self.times)
        own = self.inside(rows.times, self.horizon if until is None else until)
        return rows.times[own], rows.values[own], self.at(rows.times[own])

    def _sampled(self, rows: Rows, times: Floats) -> Rows:
        """The rows of an answer at these times, of which it has a row, or from its rows about them."""
        slack, apart = SAME_TIME * self.span, np.diff(rows.times, prepend=-np.inf) > 0
        rows = Rows(rows.times[apart], rows.values[apart])
        times = times[(times >= rows.times[0] - slack) & (times <= rows.times[-1] + slack)]
        after = np.searchsorted(rows.times, times).clip(1, len(rows.times) - 1)
        near = after - (times - rows.times[after - 1] < rows.times[after] - times)
        values = smooth(np.nan_to_num(rows.values), self.periods, self.quaternion)
        between, off = interpolated(rows.times, values, self.margins, self.horizon)
        told = np.where(rows.present & (off <= OFF * self.margins), between(times), np.nan)
        has_row = np.abs(rows.times[near] - times) <= slack
        values = np.where(has_row[:, None], rows.values[near], told)
        # Where the rows that it has at these times would do alone, others are needless.
        own = has_row | bool(self._lacks(times[has_row])) | ~np.isnan(told[:, rows.present]).any(axis=1)
        return Rows(times[own], values[own])

    def misses(self, values: Floats, expected: Floats) -> Floats:
        """By how much values are off, in units of the margins (all k by m)."""
        places = list(self.quaternion)
        if places:
            values = values.copy()
            opposite = np.nansum(values[:, places] * expected[:, places], axis=1) < 0
            values[np.ix_(opposite, places)] *= -1.0
        return np.abs(self.wrapped(values - expected)) / self.margins

    def wrapped(self, differences: Floats) -> Floats:
        """Differences of the columns (... by m), those of angles to the nearest of their periods.

        Those that are so large that their digits do not tell the rest stay as they are.
        """
        own = np.where(np.isfinite(self.periods), self.periods, 1.0)
        told = np.isfinite(self.periods) & (np.spacing(np.abs(differences)) <= OFF * self.margins)
        return np.where(told, differences - own * np.round(differences / own), differences)


def smooth(values: Floats, periods: Floats, quaternion: Sequence[int]) -> Floats:
    """Columns (n by m) without the jumps of angles by a period, and of quaternions to the opposite sign."""
    values, places = values.copy(), list(quaternion)
    for place in np.flatnonzero(np.isfinite(periods)):
        values[:, place] = np.unwrap(values[:, place], period=periods[place])
    turned = (values[1:, places] * values[:-1, places]).sum(axis=1) < 0
    values[1:, places] *= np.cumprod(np.where(turned, -1.0, 1.0))[:, None]
    return values


@dataclass(frozen=True, slots=True, eq=False)
class Formulas:
    """A trajectory by a tree for each of its columns, in which `t` is the only name."""

    trees: tuple[Node, ...]

    def __call__(self, times: Floats) -> Floats:
        """The columns (k by m) at `times` (k); infinite or NaN where a formula has no value."""
        columns = [evaluation.array(tree, {TIME: times}) for tree in self.trees]
        return np.column_stack([np.broadcast_to(column, times.shape) for column in columns])


def interpolated(times: Floats, values: Floats, margins: Floats, end: float) -> tuple[Trajectory, Floats]:
    """The spline through samples (n by m), and by how much it may be off between them (m).

    That is estimated up to the time `end` from every second sample, by which the others are missed by more.
    """
    from scipy.interpolate import make_interp_spline

    found: list[tuple[float, Trajectory, Floats]] = []
    rows = slice(1, 2 * int((times[1:-1:2] <= end).sum()), 2)
    for degree in ORDERS:
        # A spline of high degree may not be told from samples that are very near to each other.
        with suppress(np.linalg.LinAlgError):
            if degree < len(times[::2]):
                half = make_interp_spline(times[::2], values[::2], degree)
                off = np.abs(half(times[rows]) - values[rows]).max(axis=0, initial=0.0)
                worst = float(np.nan_to_num(off / margins, nan=np.inf).max())
                found.append((worst, make_interp_spline(times, values, degree), off))
                if worst < EXACT:
                    break
    return min(found, key=lambda each: each[0])[1:]


# --- the making of a key


@np.errstate(all="ignore")
def key_of(source: Source, question: Question) -> Key:
    """The key of a question. Raises ValueProblem for options that do not fit."""
    import scipy.optimize  # noqa: F401 - loaded here, before the processes start that need it
    from scipy.interpolate import make_interp_spline

    times, required = source.times, _required(source, question)
    laws = laws_of(source, question)
    known = () if question.columns else tuple(name for name in source.known if name not in required)
    needed = frozenset(required).union(*(law.names for law in laws if law.required))
    names = (*required, *known, *sorted(needed.difference(required, known)))
    first = slice(len(required))
    listed_angles = question.angles or (source.modular if question.modulo is not None else ())
    periods = np.array([_period(name, name in listed_angles, source, question) for name in names])
    # Of a coordinate that only turns out to be an angle, errors are in proportion to all of its turns.
    unlisted = np.isin(names, source.turning) & ~np.isin(names, listed_angles)
    joint = _joint(names, source)
    values = smooth(np.column_stack([source.columns[name] for name in names]), periods, joint)
    sizes = _sizes(names, source, values, np.where(unlisted, np.inf, periods / 2))
    margins = np.array([margin(size, question.tolerance) for size in sizes])
    periods[unlisted & (margins >= periods / 4)] = np.inf
    if not (margins < periods / 4)[first].all():
        raise ValueProblem("any angle is within this tolerance", path=("tolerance",))
    allowed = np.minimum(PARTED * margins, AMPLIFIED * np.array(sizes))
    # Until when the columns can be predicted: two runs differ by no more than is allowed.
    other = smooth(
        np.column_stack([(source.other or source.columns)[name] for name in names]), periods, joint
    )
    apart = np.abs(values - other) > allowed
    horizons = np.where(apart.any(axis=0), times[np.maximum(0, np.argmax(apart, axis=0) - 1)], times[-1])
    horizon = float(horizons[first].min())
    if horizon - times[0] < LEAST_HORIZON * (times[-1] - times[0]):
        problem = "two runs soon differ: only a small part of this motion can be predicted"
        raise ValueProblem(problem, hint="ask for a shorter time, or lower the tolerance of the orbit itself")
    important = np.where(np.arange(len(names)) < len(required), margins, np.inf)
    reference, off = _reference(source, names, values, important, horizon)
    sparse = reference is None
    sure = (margins < periods / 4) & (horizons >= horizon) & ((off <= OFF * margins) | sparse)
    margins[~sure | ~np.isin(names, (*required, *known))] = np.inf
    instants = times if reference is None else np.linspace(times[0], horizon, GRID)
    grid = values if reference is None else reference(instants)
    longest = float(np.diff(times).max() / (times[-1] - times[0]))
    return Key(
        columns=names,
        required=len(required),
        needed=needed,
        reference=reference or make_interp_spline(times, values, 1),
        start=float(times[0]),
        stop=float(times[-1]),
        horizon=horizon,
        gap=max(LONGEST_GAP, longest),
        margins=margins,
        periods=periods,
        quaternion=joint,
        rates=tuple(place for place, name in enumerate(names) if name in source.rates),
        in_si=source.in_si,
        conserved=conserved(
            laws, source, question.tolerance, dict(zip(required, margins.tolist(), strict=False))
        ),
        instants=instants,
        grid=grid,
        ranges=np.maximum(np.ptp(grid, axis=0), margins),
        times=times if sparse else None,
    )


def _reference(
    source: Source, names: Sequence[str], values: Floats, margins: Floats, horizon: float
) -> tuple[Trajectory | None, Floats]:
    """What has the columns (n by m) at any time, and by how much it may be off (m).

    It is None for a table of too few rows. Raises ValueProblem where there can be more samples.
    """
    if source.formulas is not None:
        return Formulas(tuple(source.formulas[name] for name in names)), np.zeros(len(names))
    reference, off = interpolated(source.times, values, margins, horizon)
    worst = int((off / margins).argmax())
    if off[worst] <= OFF * margins[worst]:
        return reference, off
    if source.remedy:
        problem = f"there are too few samples of {shown(names[worst])} for this tolerance"
        raise ValueProblem(problem, hint=source.remedy)
    return None, off


def _required(source: Source, question: Question) -> tuple[str, ...]:
    names = question.columns or source.default
    for option, given in (("columns", question.columns), ("angles", question.angles)):
        for name in given:
            if name not in source.columns:
                hint = f"there are {', '.join(source.columns)}"
                raise ValueProblem(f"the key has no column {shown(name)}", path=(option,), hint=hint)
    if not names or len(set(names)) < len(names):
        raise ValueProblem("expected columns to judge, each once", path=("columns",))
    return names


def _period(name: str, is_listed: bool, source: Source, question: Question) -> float:
    """What a column is judged modulo: the question's `modulo` if it is listed, a turn for known angles."""
    if not is_listed:
        return TURN if name in (*source.angles, *source.turning) else np.inf
    if question.modulo is None:
        return TURN
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


def _sizes(names: Sequence[str], source: Source, values: Floats, most: Floats) -> list[float]:
    """The largest value of each column, or the `most` (m); of one that is always zero, that of its like."""
    own = np.minimum(np.abs(values).max(axis=0), most).tolist()
    sizes = []
    for name, size in zip(names, own, strict=True):
        size = max(size, source.sizes.get(name, 0.0))
        family = next((family for family in source.families if name in family), (name,))
        largest = max(float(np.abs(source.columns[each]).max()) for each in family)
        is_zero = size <= (NOISE * largest if source.vectors else 0.0)
        sizes.append((largest or max(own) or 1.0) if is_zero else size)
    return sizes
