"""Lagrange's equations in a report, and how far they are from Hamilton's at random points."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import islice

import numpy as np

from rigidcli.algebra import samples
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.trees import plain_tree
from rigidcli.core.solution import NO_VALUE, Function
from rigidcli.errors import ExpressionError
from rigidcli.language import code
from rigidcli.language.latex_names import latex_name
from rigidcli.mechanics.lagrange_equations import LagrangeEquations
from rigidcli.report import Field
from rigidcli.studies.hamilton.derivation import TIME, Derivation
from rigidcli.studies.hamilton.verification import CHECKS


def fields(derivation: Derivation) -> list[Field]:
    """Lagrange's equations as expressions that vanish, and solved for the accelerations."""
    found = derivation.lagrange
    if found is None:
        return [Field("lagrange_equations", None), Field("accelerations", None)]
    written = zip(derivation.phase.coordinates, found.equations, strict=True)
    solved = None if found.accelerations is None else zip(found.names, found.accelerations, strict=True)
    told = [(f"lagrange_equations.{q}", e, f"Lagrange, {q}: 0 =", "0") for q, e in written]
    told += [(f"accelerations.{name}", e, name, latex_name(name)) for name, e in solved or ()]
    return [
        *(Field(key, e, title, sign, cells={key: ()}) for key, e, title, sign in told),
        *([Field("accelerations", None)] if solved is None else []),
    ]


def residual(derivation: Derivation) -> float | None:
    """How far Lagrange's equations are from Hamilton's at random points, in units of their largest terms.

    There the accelerations are d/dt dH/dp along Hamilton's equations. They must obey Lagrange's equations,
    and be what these are solved to. None where one of the two is not known, or has no value at any point.
    """
    lagrange = derivation.lagrange
    if lagrange is None or derivation.equations is None:
        return None
    try:
        return _residual(derivation, lagrange, derivation.equations)
    except ExpressionError:
        return None


@lru_cache(maxsize=1)
def _residual(
    derivation: Derivation, lagrange: LagrangeEquations, equations: tuple[Expr, ...]
) -> float | None:
    phase, size = derivation.phase, len(lagrange.names)
    slopes = [*derivation.velocity_names, *(f"{name} rate" for name in phase.momenta)]
    moving = [*zip(phase.names, map(symbol, slopes), strict=True), (TIME, symbol(TIME) ** 0)]
    parts = [derivative(velocity, name) * rate for velocity in equations[:size] for name, rate in moving]
    masses = [entry for row in lagrange.matrix for entry in row]
    solved = lagrange.accelerations or ()
    conditions = () if derivation.branch is None else derivation.branch.conditions
    groups = (masses, lagrange.rest, parts, solved, conditions)
    outputs = [e for group in groups for e in group]
    names = sorted({name for e in (*outputs, *equations) for name in e.names}.difference(slopes))
    steps = [(name, plain_tree(e)) for name, e in zip(slopes, equations, strict=True)]
    f = code.function([plain_tree(e) for e in outputs], names, {}, steps)(math)
    misses = _misses(f, names, [len(group) for group in groups])
    return max(islice(misses, CHECKS), default=None)


def _misses(f: Function, names: list[str], sizes: Sequence[int]) -> Iterator[float]:
    """The residual at each random point where there is a motion.

    f tells the mass matrix (n by n), the rest (n), the terms of the accelerations along Hamilton's equations
    (n by 2n + 1), what Lagrange's equations are solved to (n, or nothing), and conditions, in these `sizes`.
    """
    for point in samples.points(names, {}):
        try:
            values = np.array(f(*point.values()))
        except NO_VALUE:
            continue
        masses, rest, parts, solved, conditions = np.split(values, np.cumsum(sizes)[:-1])
        if not np.isfinite(values).all() or (conditions <= 0).any():
            continue
        masses, parts = masses.reshape(len(rest), -1), parts.reshape(len(rest), -1)
        a, largest = parts.sum(axis=1), np.abs(parts).max(axis=1)
        scale = np.maximum(np.abs(masses * largest).max(axis=1), np.abs(rest))
        scale[scale == 0] = 1.0
        worst = (np.abs(masses @ a + rest) / scale).max()
        if len(solved):
            worst = max(worst, np.abs(a - solved).max() / (max(largest.max(), np.abs(solved).max()) or 1.0))
        yield float(worst)
