"""The making of a key from a source and the options of a question.

An answer is right where each judged column is within its margin at the answer's own times. The margin is by
the question's tolerance of the column's size, which is its largest value over the span (that of an angle at
most half a period). Two runs of a document show how long its motion can be predicted.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.numbers import NOISE, margin, read_number
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import Question
from rigidcli.grading.trajectories.conserved import conserved, listed
from rigidcli.grading.trajectories.dense import Formulas, Samples, Trajectory, interpolated, missed, parting
from rigidcli.grading.trajectories.following import following
from rigidcli.grading.trajectories.heads import TIME
from rigidcli.grading.trajectories.key import Key, without_flips
from rigidcli.grading.trajectories.source import Source
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


@np.errstate(all="ignore")
def key_of(source: Source, question: Question) -> Key:
    """The key of a question. Raises ValueProblem for options that do not fit."""
    required = _required(source, question)
    laws = listed(source, question)
    further = tuple(sorted({name for law in laws for name in law.names}.difference(required)))
    known = () if question.columns else tuple(name for name in source.known if name not in required)
    names = (*required, *known)
    listed_angles = question.angles or (source.modular if question.modulo is not None else ())
    periods = np.array([_period(name, name in listed_angles, source, question) for name in names])
    # Of a coordinate that only turns out to be an angle, errors are in proportion to all of its turns.
    unlisted = np.isin(names, source.turning) & ~np.isin(names, listed_angles)
    joint = _joint(names, source)
    values = _smooth(np.column_stack([source.columns[name] for name in names]), periods, joint)
    sizes = _sizes(names, source, values, np.where(unlisted, np.inf, periods / 2))
    margins = np.array([margin(size, question.tolerance) for size in sizes])
    periods[unlisted & (margins >= periods / 4)] = np.inf
    needed = slice(0, len(required))
    if not (margins < periods / 4)[needed].all():
        raise ValueProblem("any angle is within this tolerance", path=("tolerance",))
    allowed = np.minimum(PARTED * margins, AMPLIFIED * np.array(sizes))
    horizons = _horizons(names, source, values, allowed, periods, joint)
    horizon = _long_enough(source, float(horizons[needed].min()))
    everything = np.column_stack([values, *(source.columns[name] for name in further)])
    needless = np.full(len(known) + len(further), np.inf)
    reference, off = _reference(
        (*names, *further), source, everything, np.append(margins[needed], needless), horizon
    )
    instants = np.linspace(source.times[0], horizon, GRID)
    grid = reference.at(instants)[:, : len(names)]
    key = Key(
        columns=names,
        required=len(required),
        further=further,
        reference=reference,
        start=float(source.times[0]),
        stop=float(source.times[-1]),
        horizon=horizon,
        margins=margins,
        periods=periods,
        quaternion=joint,
        rates=tuple(place for place, name in enumerate(names) if name in source.rates),
        in_si=source.in_si,
        conserved=conserved(source, question, laws, dict(zip(required, margins.tolist(), strict=False))),
        following=following(names, source.times, values, margins, periods, source.equations)
        if horizon < source.times[-1]
        else None,
        instants=instants,
        grid=grid,
        ranges=np.maximum(np.ptp(grid, axis=0), margins),
    )
    sure = (off[: len(names)] <= OFF * margins) & (margins < periods / 4) & (horizons >= horizon)
    return key.of([name for name, fine in zip(names, sure, strict=True) if fine])


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
        return 2 * np.pi if name in (*source.angles, *source.turning) else np.inf
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
    return without_flips(values, joint)


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


def _reference(
    names: Sequence[str], source: Source, values: Floats, margins: Floats, horizon: float
) -> tuple[Trajectory, Floats]:
    """What has the columns (n by m) at any time, and by how much it may be off (m).

    Raises ValueProblem for too few samples of those that have finite margins.
    """
    if source.formulas is not None:
        return Formulas(tuple(source.formulas[name] for name in names)), np.zeros(len(names))
    samples, off = interpolated(source.times, values, margins, horizon)
    worst = int(off.argmax())
    if not off[worst] <= OFF:
        raise ValueProblem(
            f"there are too few samples of {shown(names[worst])} for this tolerance", hint=source.remedy
        )
    return samples, missed(source.times, values, horizon, samples.weights.shape[1])


def _horizons(
    names: Sequence[str],
    source: Source,
    values: Floats,
    allowed: Floats,
    periods: Floats,
    joint: tuple[int, ...],
) -> Floats:
    """Until when the columns can be predicted (m): two runs differ by no more than is `allowed` (m)."""
    times = source.times
    if source.other is None:
        return np.full(len(names), times[-1])
    own = source.other[TIME]
    other = _smooth(np.column_stack([source.other[name] for name in names]), periods, joint)
    if not np.array_equal(own, times):
        other = Samples.through(own, other).at(np.clip(times, own[0], own[-1]))
    return parting(times, values, other, allowed)


def _long_enough(source: Source, horizon: float) -> float:
    """The horizon. Raises ValueProblem where next to nothing can be predicted."""
    if horizon - source.times[0] < LEAST_HORIZON * (source.times[-1] - source.times[0]):
        raise ValueProblem(
            "two runs soon differ: only a small part of this motion can be predicted",
            hint="ask for a shorter time, or lower the tolerance of the orbit itself",
        )
    return horizon
