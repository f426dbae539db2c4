"""Linear equations of motion in a report: their matrix, the eigenvalues of it, and the stability."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rigidcli.algebra import matrices
from rigidcli.algebra.expressions import Expr, total
from rigidcli.algebra.matrices import Matrix
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero
from rigidcli.document.document import Document
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.phase_space import TIME
from rigidcli.mechanics.small_oscillations import LinearMotion, Root, spectrum
from rigidcli.report import Field
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.system import known_values
from rigidcli.studies.results import field_of

# The widest matrix that people are shown: a terminal has room for no more.
MOST_COLUMNS = 8
# The keys of the results that follow from the matrix of linear equations.
SPECTRUM = ("eigenvalues", "frequencies", "stability")

STABILITY = {
    "stable": "stable: motion stays bounded",
    "marginal": "marginal: deviations grow like a power of t, slower than an exponential",
    "unstable": "unstable: motion grows exponentially",
}


def fields(document: Document, derivation: Derivation) -> list[Field]:
    """The matrix of linear equations, and what its eigenvalues tell."""
    if derivation.linear is None:
        return [Field(key, None) for key in ("matrix", "offset", *SPECTRUM)]
    (matrix, offset), names = derivation.linear, derivation.phase.names
    shift = " + b" if any(offset) else ""
    title, is_small = f"A of z' = A z{shift}, z = ({', '.join(names)})", len(names) <= MOST_COLUMNS
    a, b = np.array(matrix, dtype=object), np.array(offset, dtype=object)
    shown = [
        field_of("hamilton", "matrix", a, title=title if is_small else ""),
        field_of("hamilton", "offset", b, title="b" if shift and is_small else ""),
    ]
    roots = _roots(matrix, document, derivation)
    if roots is None:
        return shown + [Field(key, None) for key in SPECTRUM]
    pairs = [pair for root in roots for pair in eigenvalues(root)]
    if isinstance(pairs[0][0], float):
        pairs.sort()
    shown.append(Field("eigenvalues", [{"re": re, "im": im} for re, im in pairs]))
    shown.append(_frequencies(roots))
    stability = _stability(roots, matrix, offset)
    # It is a question about an equilibrium.
    stability.diagnostic |= document.equilibrium is None
    shown.append(stability)
    return shown


def _frequencies(roots: Sequence[Root]) -> Field:
    """The angular frequencies of what swings without growing, each once."""
    angular = list(dict.fromkeys(root.angular for root in roots if root.angular and not root.growth))
    numeric = all(isinstance(rate, float) for rate in angular)
    entry = field_of("hamilton", "frequencies", np.array(angular, dtype=float if numeric else object))
    entry.cells = {f"frequencies.{k}": (k,) for k in range(len(angular))}
    entry.unit = "rad/s" if numeric else ""
    return entry if angular else replace(entry, title="")


def _stability(roots: Sequence[Root], matrix: Matrix, offset: Sequence[Expr]) -> Field:
    """Whether motion stays bounded; people see it where anything swings or grows, unlike free fall."""
    stability = stability_of(roots)
    is_shifted = any(not e.is_zero and TIME not in e.names for e in offset)
    if stability == "stable" and is_shifted and _drifts(matrix, offset):
        stability = "marginal"
    driven = ", apart from what b(t) drives" if any(TIME in e.names for e in offset) else ""
    is_still = not any(root.angular or root.growth for root in roots)
    words = STABILITY[stability] + driven
    return field_of("hamilton", "stability", stability, words=words, diagnostic=is_still)


def _roots(matrix: Matrix, document: Document, derivation: Derivation) -> list[Root] | None:
    """The roots; None where the matrix changes with the time, or the signs of symbols decide."""
    if any(TIME in e.names or e.unknown for row in matrix for e in row):
        return None
    known = known_values(document)
    try:
        if not document.exact_results:
            matrix = [[substitute(e, known) for e in row] for row in matrix]
        motion, is_free = LinearMotion.of_matrix(matrix), not derivation.is_forced
        roots = spectrum(motion, known, document.exact_results, is_free, needs_vectors=False)
    except ExpressionError:
        return None
    return None if roots is None or any(root.condition is not None for root in roots) else roots


def eigenvalues(root: Root) -> list[tuple[Any, Any]]:
    """The real and imaginary parts of all eigenvalues that a root stands for."""
    sides = (-1, 1) if root.is_paired and root.growth else (1,)
    return [
        (a * root.growth, b * root.angular) for a in sides for b in ((-1, 1) if root.angular else (1,))
    ] * root.times


def stability_of(roots: Sequence[Root]) -> str:
    """Whether motion stays bounded: no rate grows, and equal ones have as many vectors."""
    if any(root.growth and root.is_stable is False for root in roots):
        return "unstable"
    return "stable" if all(root.is_whole for root in roots) else "marginal"


def _drifts(matrix: Sequence[Sequence[Expr]], offset: Sequence[Expr]) -> bool:
    """Whether z' = A z + b has no point of rest: then b drives a mode of rate zero, and motion grows.

    There is a point of rest if b is orthogonal to all that A^T takes to zero.
    """
    left = matrices.null_vectors([list(column) for column in zip(*matrix, strict=True)])
    return any(not is_zero(total(x * b for x, b in zip(v, offset, strict=True))) for v in left)
