"""Named mistakes of trajectories: other times, factors, digits, or columns exchanged."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.grading.kinds.modules import explained
from rigidcli.grading.trajectories.key import Key, Rows
from rigidcli.grading.trajectories.retiming import (
    OSCILLATING,
    RATIOS,
    at_other_frequency,
    backwards,
    by_ratio,
    in_other_unit,
    probed,
    shifted,
    with_inverses,
)

FACTORS = (2.0, 3.0, 4.0, 1.5, math.sqrt(2))
"""Factors, and their inverses, that are told from other wrong numbers."""

DEGREES = 180 / math.pi

TURN = 2 * math.pi

POWERS = range(1, 10)
"""Of ten."""

DECIMALS = tuple(10.0**-n for n in range(-6, 10))
"""Units of the last place that a column may be rounded to."""

WHOLE = 1e-6
"""How far from whole numbers rounded values are, in these units."""

COARSEST = 0.1
"""The largest such unit that still shows how a column moves, in units of its range."""

QUARTERS = 4
GROWING = 2.0
"""How much larger an error must be in the last of so many parts of the time than it is in the first."""

SMALL = 0.05
"""How large it may become, in units of a column's range."""

BARELY = 0.1
"""The least that it must become, in margins."""

LEAST_SEEN = 10.0
"""How large a column must be, in margins, to show a factor."""


def code_of(key: Key, rows: Rows, otherwise: str) -> str:
    """The code of the one mistake that explains the answer, or the other."""
    return explained(_checks(key, rows), lambda check: check(), otherwise).code


def explaining(key: Key, rows: Rows) -> set[str]:
    """The codes of all mistakes that explain the answer."""
    return {code for code, check in _checks(key, rows) if check()}


def _checks(key: Key, rows: Rows) -> Iterator[tuple[str, Callable[[], bool]]]:
    yield "time_unit", partial(in_other_unit, key, rows)
    yield "time_shift", partial(shifted, key, rows)
    if not rows.failing:
        return
    yield "time_reversed", partial(backwards, key, rows)
    if key.crossings >= OSCILLATING:
        yield "frequency_wrong", partial(at_other_frequency, key, rows)
        for code, ratios in RATIOS.items():
            yield code, partial(by_ratio, key, rows, ratios)
    if key.rates:
        yield "frequency_vs_angular_frequency", partial(_in_turns, key, rows)
    yield "sign_error", partial(_by_factors, key, rows, (-1.0,))
    yield "degrees_radians", partial(_by_factors, key, rows, (DEGREES, 1 / DEGREES))
    yield "constant_factor", partial(_by_factors, key, rows, with_inverses(FACTORS))
    yield "power_of_ten", partial(_by_factors, key, rows, with_inverses([10.0**n for n in POWERS]))
    yield "precision_insufficient", partial(_rounded, key, rows)
    yield "components_permuted", partial(_exchanged, key, rows)


def _predicted(key: Key, rows: Rows) -> tuple[Floats, Floats]:
    """The values up to the horizon, and what they should be."""
    inside = (rows.times >= key.start) & (rows.times <= key.horizon)
    return rows.values[inside], key.at(rows.times[inside])


def grows(key: Key, rows: Rows) -> bool:
    """Whether the error of every column that moves grows from nothing and stays small.

    That is what too coarse an integration does; so does a constant that is not quite right.
    """
    moving = [place for place in rows.present if key.moving[place]]
    values, expected = _predicted(key, rows)
    off = key.misses(values, expected)
    times = rows.times[(rows.times >= key.start) & (rows.times <= key.horizon)]
    part = (QUARTERS * (times - key.start) / (key.horizon - key.start)).astype(int).clip(0, QUARTERS - 1)
    if not moving or not np.isin(np.arange(QUARTERS), part).all():
        return False
    worst = np.array([off[part == quarter].max(axis=0) for quarter in range(QUARTERS)])[:, moving]
    is_growing = (worst[-1] > np.maximum(GROWING * worst[0], BARELY)) & (worst[-1] >= worst[1])
    is_small = (worst * key.margins[moving] <= SMALL * key.ranges[moving]).all(axis=0)
    return bool((is_growing & is_small & (off[0, moving] <= 1)).all())


def _by_factors(key: Key, rows: Rows, factors: Sequence[float], among: Sequence[int] | None = None) -> bool:
    """Whether each wrong column is right but for one of the factors, which is then seen in it.

    Wrong columns must be `among` these places, if any are given.
    """
    failing = list(rows.failing or ())
    values, expected = _predicted(key, rows)
    found = np.zeros(values.shape[1], dtype=bool)
    for factor in factors:
        scaled = values.copy()
        scaled[:, failing] /= factor
        found |= (key.misses(scaled, expected) <= 1).all(axis=0)
    seen = np.abs(expected).max(axis=0) > LEAST_SEEN * key.margins
    fit = among is None or set(failing) <= set(among)
    return fit and bool((found & seen)[failing].all())


def _in_turns(key: Key, rows: Rows) -> bool:
    """Whether angular velocities are in turns instead of radians, or the other way round."""
    return _by_factors(key, rows, (TURN, 1 / TURN), key.rates)


def _rounded(key: Key, rows: Rows) -> bool:
    """Whether each wrong column is right to the decimal places that it has."""
    values, expected = _predicted(key, rows)
    for place in rows.failing or ():
        for unit in DECIMALS:
            written = values[:, place] / unit
            if (np.abs(written - np.round(written)) < WHOLE).all():
                break
        else:
            return False
        off = np.abs(key.wrapped(values - expected))[:, place]
        if unit > COARSEST * key.ranges[place] or (off > unit / 2 + key.margins[place]).any():
            return False
    return True


def _exchanged(key: Key, rows: Rows) -> bool:
    """Whether the wrong columns are right in another order."""
    failing = list(rows.failing or ())
    values, expected = _predicted(key, rows)
    some = probed(len(values))
    order = _order(key, values[some], expected[some], failing)
    if order is None:
        return False
    exchanged = expected.copy()
    exchanged[:, order] = values[:, failing]
    return bool((key.misses(exchanged, expected) <= 1).all())


def _order(key: Key, values: Floats, expected: Floats, failing: list[int]) -> list[int] | None:
    """Other places for the failing columns (k by m), at which each is right; None where there are none."""
    taken: dict[int, int] = {}  # by the place, the column that has it
    fitting = {
        column: [
            place
            for place in failing
            if (np.abs(values[:, column] - expected[:, place]) <= key.margins[place]).all()
        ]
        for column in failing
    }

    def placed(column: int, tried: set[int]) -> bool:
        """Whether the column finds a place, moving others on (H. W. Kuhn's augmenting paths)."""
        for place in fitting[column]:
            if place not in tried:
                tried.add(place)
                if place not in taken or placed(taken[place], tried):
                    taken[place] = column
                    return True
        return False

    if not all(placed(column, set()) for column in failing):
        return None
    place_of = {column: place for place, column in taken.items()}
    return [place_of[column] for column in failing]
