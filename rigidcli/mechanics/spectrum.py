"""Linear equations of motion z' = A z + b: eigenvalues of A, frequencies, and whether motion stays bounded.

Motion stays bounded if no eigenvalue has a positive real part, and those without a real part are simple
roots of the minimal polynomial. Of Hamilton's equations A = J S, with the matrix S of the second derivatives
of H, the eigenvalues come in pairs lambda, -lambda; where S is definite, they are +-i omega. Source:
H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, chapter 6; V. I. Arnold, Mathematical
Methods of Classical Mechanics, appendix 6.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from rigidcli.algebra import matrices
from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.matrices import Matrix

Stability: TypeAlias = Literal["stable", "unstable", "marginal"]

WORSE: tuple[Stability, ...] = ("stable", "marginal", "unstable")


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Eigenvalues as pairs (re, im), frequencies (rad/s, each once, ascending), and stability.

    Symbols without values leave expressions; these hold where parameters are positive.
    """

    eigenvalues: tuple[tuple[float | Expr, float | Expr], ...]
    frequencies: tuple[float | Expr, ...]
    stability: Stability


def blocks(matrix: Matrix) -> list[list[int]]:
    """The places of coordinates and momenta of freedoms that act on each other."""
    size = len(matrix) // 2
    pairs = [(0, 0), (0, size), (size, 0), (size, size)]

    def linked(i: int, j: int) -> bool:
        return any(not (matrix[i + a][j + b].is_zero and matrix[j + a][i + b].is_zero) for a, b in pairs)

    groups = matrices.connected(size, linked)
    return [[*group, *(i + size for i in group)] for group in groups]
