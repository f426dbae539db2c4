"""A way back from momenta to velocities, checked against the Euler-Lagrange equations at random points."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import Expr, symbol, total
from rigidcli.algebra.trees import plain_tree
from rigidcli.algebra.values import sample_points
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE
from rigidcli.language import code
from rigidcli.mechanics.hamilton_equations import TIME, Phase
from rigidcli.mechanics.legendre import Momenta
from rigidcli.mechanics.velocity_inversion import Branch

MOST_RESIDUAL = 1e-6
"""A residual of the equations of motion beyond this, in units of their size, is no rounding error."""

CHECKS = 3
"""The number of random points at which the equations of motion are compared."""

LONGEST_KEY = 30_000
"""The longest keys of H and of the velocities together that are worked with: about ten pages of text."""


def is_short(branch: Branch) -> bool:
    """Whether H can be worked with in symbols."""
    return sum(len(e.key) for e in (branch.hamiltonian, *branch.velocities)) <= LONGEST_KEY


def residual_of(
    lagrangian: Expr,
    momenta: Momenta,
    branch: Branch,
    phase: Phase,
    velocities: tuple[str, ...],
    fixed: Mapping[str, float],
) -> float | None:
    """Measure the error of a branch in the Euler-Lagrange equations at random points; None without any value.

    Names have their `fixed` values, or random ones. There p = dL/dv must lead back to v, and -dH/dq be
    dL/dq, or where H is long, H be p v - L. A point on another branch says nothing.
    """
    if is_short(branch):
        expected = [derivative(lagrangian, q) for q in phase.coordinates]
        from_branch = [-derivative(branch.hamiltonian, q) for q in phase.coordinates]
    else:
        pairs = zip(momenta.definitions, velocities, strict=True)
        expected, from_branch = [total(p * symbol(v) for p, v in pairs) - lagrangian], [branch.hamiltonian]
    expected = [*momenta.definitions, *expected]
    from_branch = [*branch.velocities, *from_branch]
    names = lagrangian.names | branch.hamiltonian.names
    shared = [*sorted(names - {*phase.names, *velocities, TIME}), TIME, *phase.coordinates]
    from_velocities = code.function([plain_tree(e) for e in expected], [*shared, *velocities], {})(math)
    limits = (*branch.conditions, *branch.region)
    trees = [plain_tree(e) for e in (*from_branch, *limits)]
    from_momenta = code.function(trees, [*shared, *phase.momenta], {})(math)
    size, worst, seen = len(velocities), 0.0, 0
    for place, point in enumerate(sample_points([*shared, *velocities], fixed)):
        if place % 2:
            point |= {name: -point[name] for name in velocities}
        v = np.array([point[name] for name in velocities])
        try:
            known = np.array(from_velocities(*point.values()))
            reached = np.array(from_momenta(*(point[name] for name in shared), *known[:size]))
        except NO_VALUE:
            continue
        values, signs = np.split(reached, [len(from_branch)])
        if not np.isfinite([*known, *reached]).all() or (signs <= 0).any():
            continue
        miss = max(_miss(v, values[:size]), _miss(known[size:], values[size:]))
        if not branch.conditions or miss <= MOST_RESIDUAL:
            worst, seen = max(worst, miss), seen + 1
        if seen == CHECKS:
            break
    return worst if seen else None


def _miss(a: Floats, b: Floats) -> float:
    """The largest difference, in units of the largest entry."""
    scale = max(np.abs(a).max(), np.abs(b).max())
    return float(np.abs(a - b).max() / scale) if scale else 0.0
