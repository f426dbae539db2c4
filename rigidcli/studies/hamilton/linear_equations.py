"""Linear equations of motion in a report: their matrix, the eigenvalues of it, and the stability."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidcli.algebra import matrices
from rigidcli.algebra.expressions import Expr, total
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero
from rigidcli.document.document import Document
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.hamilton_equations import TIME
from rigidcli.report import Field
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.system import known_values
from rigidcli.studies.results import told

if TYPE_CHECKING:
    from rigidcli.mechanics.spectrum import Spectrum

MOST_COLUMNS = 8
"""The widest matrix that people are shown: a terminal has room for no more."""

SPECTRUM = ("eigenvalues", "frequencies", "stability")
"""The keys of the results that follow from the matrix of linear equations."""

STABILITY = {
    "stable": "stable: motion stays bounded",
    "marginal": "marginal: motion grows by powers of the time",
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
    shown_anyway = [
        told("hamilton", "matrix", np.array(matrix, dtype=object), title=title if is_small else ""),
        told("hamilton", "offset", np.array(offset, dtype=object), title="b" if shift and is_small else ""),
    ]
    spectrum = _spectrum(matrix, offset, document)
    if spectrum is None:
        return [*shown_anyway, *(Field(key, None) for key in SPECTRUM)]
    numeric = all(isinstance(f, float) for f in spectrum.frequencies)
    frequencies = np.array(spectrum.frequencies, dtype=float if numeric else object)
    changes: dict[str, Any] = {"cells": {f"frequencies.{k}": (k,) for k in range(len(frequencies))}}
    changes |= {} if len(frequencies) else {"title": ""}
    driven = ", apart from what b(t) drives" if any(TIME in e.names for e in offset) else ""
    words = STABILITY[spectrum.stability] + driven
    return [
        *shown_anyway,
        Field("eigenvalues", [{"re": re, "im": im} for re, im in spectrum.eigenvalues]),
        told("hamilton", "frequencies", frequencies, unit="rad/s" if numeric else "", **changes),
        told("hamilton", "stability", spectrum.stability, words=words),
    ]


def _spectrum(
    matrix: Sequence[Sequence[Expr]], offset: Sequence[Expr], document: Document
) -> Spectrum | None:
    """The spectrum in numbers where all parameters have values, else as far as symbols allow."""
    from rigidcli.mechanics.numeric_spectrum import numeric_spectrum
    from rigidcli.mechanics.spectrum import exact_spectrum

    known = known_values(document)
    used = {name for row in matrix for e in row for name in e.names}
    if TIME in used:
        return None
    if any(e.unknown for row in matrix for e in row):
        return None
    if used <= known.keys() and not document.exact_results:
        try:
            matrix = [[substitute(e, known) for e in row] for row in matrix]
            found: Spectrum | None = numeric_spectrum(matrix)
        except ExpressionError:
            return None
    else:
        found = exact_spectrum(matrix, known)
    is_shifted = any(not e.is_zero and TIME not in e.names for e in offset)
    if found is None or found.stability != "stable" or not is_shifted or not _drifts(matrix, offset):
        return found
    return replace(found, stability="marginal")


def _drifts(matrix: Sequence[Sequence[Expr]], offset: Sequence[Expr]) -> bool:
    """Whether z' = A z + b has no point of rest: then b drives a mode of rate zero, and motion grows.

    There is a point of rest if b is orthogonal to all that A^T takes to zero.
    """
    left = matrices.null_vectors([list(column) for column in zip(*matrix, strict=True)])
    return any(not is_zero(total(x * b for x, b in zip(v, offset, strict=True))) for v in left)
