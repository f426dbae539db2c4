"""Conserved quantities by their names: total momentum, angular momentum, and the vector of Runge and Lenz."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np

from rigidcli.algebra.expressions import Expr, number, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero, sampled
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.hamilton_equations import TIME, velocity
from rigidcli.studies.hamilton.derivation import Derivation

POINTS = 5
"""Points at which functions are compared."""

SAME = 1e-9
"""Ratios that differ by less, in units of themselves, are the same where only values can tell."""

_CARTESIAN = re.compile(r"([xyz])_?(\d*)")
"""The name of a Cartesian coordinate: its axis, and the number of the particle."""


def factor_of(value: Expr, e: Expr, moving: Sequence[str]) -> Expr | None:
    """What a function is multiplied by to be the value, if that holds none of the `moving` names."""
    letters = sorted((value.names | e.names).difference(moving))
    rows = sampled([value, e], {name: 0.6 + 0.13 * k for k, name in enumerate(letters)})
    if rows is None or not e:
        return None
    ratios = rows[:, 0] / np.where(rows[:, 1], rows[:, 1], np.nan)
    if not np.ptp(ratios) <= SAME * np.abs(ratios).max():
        return None
    with suppress(ExpressionError, ZeroDivisionError):
        point = {name: number(2 * k + 3) / number(k + 2) for k, name in enumerate(moving)}
        factor = tidy(substitute(value, point) / substitute(e, point))
        return factor if is_zero(value - factor * e) else None
    return None


def names_of(invariants: Sequence[Expr], derivation: Derivation) -> list[str | None]:
    """The names of conserved quantities, found by their values at some points; None for one that has none."""
    moving, paths = [*derivation.phase.names, TIME], list(_paths(derivation))
    known, vectors = dict(_momenta(paths)), list(_runge_lenz(paths))
    sides = [e for _, *pair in vectors for e in pair]
    letters = {name for e in invariants for name in e.names}.difference(moving)
    fixed = {name: 0.6 + 0.13 * k for k, name in enumerate(sorted(letters))}
    rows = sampled([*invariants, *known.values(), *sides], fixed, POINTS, moving)
    if rows is None:
        return [None] * len(invariants)
    columns = [*rows.T]
    values, momenta, sides_at = np.split(rows.T, [len(invariants), len(columns) - len(sides)])
    # A = p x L - c r/|r| with any c: what is left beside p x L is along r/|r|.
    pairs = [*zip([words for words, *_ in vectors], sides_at[::2], sides_at[1::2], strict=True)]

    def name(value: Floats) -> str | None:
        for words, other in zip(known, momenta, strict=True):
            if _is_multiple(value, other):
                return words
        for words, crossed, direction in pairs:
            if any(_is_multiple(sign * value - crossed, direction) for sign in (1, -1)):
                return words
        return None

    return list(map(name, values))


def _is_multiple(values: Floats, of: Floats) -> bool:
    """Whether values (k) are others times one number, which is not zero."""
    with np.errstate(all="ignore"):
        ratios = values / of
    return bool(np.ptp(ratios) <= SAME * np.abs(ratios).max()) and bool(ratios.any())


def _paths(derivation: Derivation) -> Iterator[dict[str, tuple[Expr, Expr]]]:
    """The Cartesian coordinates of each particle with their momenta, by the names of the axes."""
    system, phase = derivation.system, derivation.phase
    if system.particles and derivation.velocities is not None:
        rates = dict(zip(phase.coordinates, derivation.velocity_names, strict=True))
        solved = dict(zip(derivation.velocity_names, derivation.velocities, strict=True))
        for one in system.particles:
            if one.mass is not None:
                moved = [one.mass * substitute(velocity(path, rates), solved) for path in one.position]
                yield dict(zip("xyz", zip(one.position, moved, strict=True), strict=False))
        return
    found: dict[str, dict[str, tuple[Expr, Expr]]] = {}
    for q, p in zip(phase.coordinates, phase.momenta, strict=True):
        if (axis := _CARTESIAN.fullmatch(q)) is not None:
            found.setdefault(axis[2], {})[axis[1]] = symbol(q), symbol(p)
    yield from found.values()


def _momenta(paths: Sequence[dict[str, tuple[Expr, Expr]]]) -> Iterator[tuple[str, Expr]]:
    """Total momenta, and angular momenta about the axes."""
    whole = "total " if len(paths) > 1 else ""
    for axis in "xyz":
        parts = [one[axis][1] for one in paths if axis in one]
        if parts:
            yield f"{whole}momentum along {axis}", total(parts)
    for axis, a, b in (("x", "y", "z"), ("y", "z", "x"), ("z", "x", "y")):
        turns = [_turn(one, a, b) for one in paths if a in one and b in one]
        if turns:
            yield f"{whole}angular momentum about {axis}", total(turns)


def _turn(one: dict[str, tuple[Expr, Expr]], a: str, b: str) -> Expr:
    return one[a][0] * one[b][1] - one[b][0] * one[a][1]


def _runge_lenz(paths: Sequence[dict[str, tuple[Expr, Expr]]]) -> Iterator[tuple[str, Expr, Expr]]:
    """For each axis p x L = r p^2 - p (r.p) and r/|r| of a single particle, along that axis."""
    if len(paths) != 1 or len(paths[0]) < 2:
        return
    (one,) = paths
    squared = total(p * p for _, p in one.values())
    along = total(q * p for q, p in one.values())
    distance = apply("sqrt", total(q * q for q, _ in one.values()))
    for axis, (q, p) in one.items():
        yield f"Runge-Lenz vector along {axis}", q * squared - p * along, q / distance
