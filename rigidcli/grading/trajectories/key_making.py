"""The making of a key from the trajectory of a document, a table or formulas.

Two runs of a document show how long its motion can be predicted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.units import parse_unit
from rigidcli.grading.factors import TURN
from rigidcli.grading.numbers import NOISE, margin, read_number
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import Question
from rigidcli.grading.trajectories.conserved import conserved, laws_of
from rigidcli.grading.trajectories.key import OFF, Key
from rigidcli.grading.trajectories.source import Source
from rigidcli.grading.trajectories.splines import Trajectory, interpolated, smooth
from rigidcli.grading.trajectories.tables import TIME
from rigidcli.language import evaluation
from rigidcli.language.tree import Node

QUATERNION = ("q0", "q1", "q2", "q3")

UNIT_LENGTH = 1e-3
"""How far columns with these names may be from length 1 to be taken for a quaternion."""

GRID = 2001
"""Times at which mistakes are looked for."""

PARTED = 0.1
"""The part of a margin by which two runs of a document may differ."""

AMPLIFIED = 1e-7
"""What they may differ by in units of a column's size, too: the errors of their steps are then amplified so
much that an answer that is worked with less care, but well enough, would be beyond its margin."""

LEAST_HORIZON = 0.02
"""The part of the span that must be predictable."""

LONGEST_GAP = 0.1
"""Between two rows of an answer, in units of the span; more where the key itself has longer ones."""


@dataclass(frozen=True, slots=True, eq=False)
class Formulas:
    """A trajectory by a tree for each of its columns, in which `t` is the only name."""

    trees: tuple[Node, ...]

    def __call__(self, times: Floats) -> Floats:
        """The columns (k by m) at `times` (k); infinite or NaN where a formula has no value."""
        columns = [evaluation.array(tree, {TIME: times}) for tree in self.trees]
        return np.column_stack([np.broadcast_to(column, times.shape) for column in columns])


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
