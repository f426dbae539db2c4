"""Linear equations of motion in a report: their matrix, the eigenvalues of it, and the stability."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rigidcli.algebra import matrices
from rigidcli.algebra.expressions import Expr, total
from rigidcli.algebra.matrices import Matrix
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero
from rigidcli.document.document import Document
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.hamilton_equations import TIME
from rigidcli.mechanics.linear_motion import LinearMotion, Root
from rigidcli.mechanics.spectrum import spectrum
from rigidcli.report import Field
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.system import known_values
from rigidcli.studies.results import field_of

MOST_COLUMNS = 8
"""The widest matrix that people are shown: a terminal has room for no more."""

SPECTRUM = ("eigenvalues", "frequencies", "stability")
"""The keys of the results that follow from the matrix of linear equations."""

STABILITY = {
    "stable": "stable: motion stays bounded",
    "marginal": "marginal: deviations grow like a power of t, slower than an exponential",
    "unstable": "unstable: motion grows exponentially",
}


def fields(document: Document, derivation: Derivation) -> list[Field]:
    """The matrix of linear equations, and its eigenvalues."""
    if derivation.linear is None:
        return [Field(key, None) for key in ("matrix", "offset", *SPECTRUM)]
    (matrix, offset), names = derivation.linear, derivation.phase.names
    shift = " + b" if any(not e.is_zero for e in offset) else ""
    title = f"A of z' = A z{shift}, z = ({', '.join(names)})"
    is_small = len(names) <= MOST_COLUMNS
    a, b = np.array(matrix, dtype=object), np.array(offset, dtype=object)
    shown_anyway = [
        field_of("hamilton", "matrix", a, title=title if is_small else ""),
        field_of("hamilton", "offset", b, title="b" if shift and is_small else ""),
    ]
    roots = _roots(matrix, document, derivation)
    if roots is None:
        return [*shown_anyway, *(Field(key, None) for key in SPECTRUM)]
    pairs = [pair for root in roots for pair in eigenvalues(root)]
    if isinstance(pairs[0][0], float):
        pairs.sort()
    angular = [root.angular for root in roots if root.angular and not root.growth]
    numeric = all(isinstance(rate, float) for rate in angular)
    frequencies = np.array(list(dict.fromkeys(angular)), dtype=float if numeric else object)
    changes: dict[str, Any] = {"cells": {f"frequencies.{k}": (k,) for k in range(len(frequencies))}}
    changes |= {} if len(frequencies) else {"title": ""}
    driven = ", apart from what b(t) drives" if any(TIME in e.names for e in offset) else ""
    stability = stability_of(roots)
    is_shifted = any(not e.is_zero and TIME not in e.names for e in offset)
    if stability == "stable" and is_shifted and _drifts(matrix, offset):
        stability = "marginal"
    words = STABILITY[stability] + driven
    # It is a question about an equilibrium, and none where nothing swings, as in free fall.
    is_quiet = document.equilibrium is None or not any(root.angular or root.growth for root in roots)
    return [
        *shown_anyway,
        Field("eigenvalues", [{"re": re, "im": im} for re, im in pairs]),
        field_of("hamilton", "frequencies", frequencies, unit="rad/s" if numeric else "", **changes),
        field_of("hamilton", "stability", stability, words=words, diagnostic=is_quiet),
    ]


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
