"""The period of a motion to and fro in one degree of freedom, its action and its turning points."""

from __future__ import annotations

import numpy as np

from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ZERO, Expr
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.core.libration import Libration, libration
from rigidcli.core.solution import columns
from rigidcli.errors import ExpressionError
from rigidcli.language import code
from rigidcli.mechanics.phase_space import TIME
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equations_of_motion import InitialState
from rigidcli.studies.hamilton.orbit import OrbitSolution

BEYOND_TURNING = 1e-6
"""The orbit may pass a turning point by this share of their distance, or it does not turn there."""


def period(derivation: Derivation, initial: InitialState, orbit: OrbitSolution) -> Libration | None:
    """The motion to and fro on which the orbit is; None where it is none, or H is not quadratic in p."""
    parts = None if derivation.is_forced or derivation.explicit_time else _quadratic(derivation)
    if parts is None or len(initial.q) != 1:
        return None
    values = columns(
        code.function([to_tree(e) for e in parts], [TIME, *derivation.phase.coordinates], initial.parameters)
    )
    q, p = float(initial.q[0]), float(initial.p[0])
    a, b, c = values(np.zeros(1), np.array([q]))[:, 0]
    energy = float((a * p + b) * p + c)

    def function(places: Floats) -> tuple[Floats, Floats, Floats]:
        a, b, c = values(np.zeros(len(places)), places)
        return b**2 - 4 * a * (c - energy), a, b**2 + 4 * np.abs(a) * (np.abs(c) + abs(energy))

    path = orbit.coordinates[:, 0]
    spread = float(np.ptp(path))
    found = libration(function, q, max(spread, abs(q) / 100) / 8 or 1.0)
    if found is None:
        return None
    first, last = found.turning_points
    slack = BEYOND_TURNING * (last - first)
    return found if first - slack <= path.min() and path.max() <= last + slack else None


def _quadratic(derivation: Derivation) -> tuple[Expr, Expr, Expr] | None:
    """The coefficients of p^2, p and 1 in H; None where H has another form."""
    if derivation.hamiltonian is None or len(derivation.phase.momenta) != 1:
        return None
    try:
        polynomial = coefficients(derivation.hamiltonian, derivation.phase.momenta)
    except ExpressionError:
        return None
    if polynomial is None or not polynomial.keys() <= {(0,), (1,), (2,)} or (2,) not in polynomial:
        return None
    return polynomial[2,], polynomial.get((1,), ZERO), polynomial.get((0,), ZERO)
