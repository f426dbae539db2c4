"""Linear equations of motion M y'' + C y' + K y = 0, and the roots s of their solutions exp(s t).

Small oscillations obey such equations; Hamilton's linear equations z' = A z are the case M = 0, C = 1,
K = -A.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from rigidcli.algebra import matrices
from rigidcli.algebra.expressions import ONE, ZERO, Expr
from rigidcli.algebra.matrices import Matrix

Vector: TypeAlias = "tuple[tuple[float | Expr, float | Expr], ...]"
"""The real and imaginary parts of the components."""


@dataclass(frozen=True, slots=True)
class LinearMotion:
    """The matrices M, C and K (n by n each)."""

    masses: Matrix
    rates: Matrix
    stiffness: Matrix

    @classmethod
    def of_matrix(cls, matrix: Matrix) -> LinearMotion:
        """The motion z' = A z, with the coordinates before their momenta."""
        units = range(len(matrix))
        zero = [[ZERO for _ in units] for _ in units]
        one = [[ONE if i == j else ZERO for j in units] for i in units]
        return cls(zero, one, [[-e for e in row] for row in matrix])

    @property
    def parts(self) -> tuple[Matrix, Matrix, Matrix]:
        """M, C and K."""
        return self.masses, self.rates, self.stiffness

    @property
    def entries(self) -> list[Expr]:
        """All entries of the matrices."""
        return [e for part in self.parts for row in part for e in row]

    @property
    def is_of_first_order(self) -> bool:
        """Whether there are no second derivatives."""
        return not any(e for row in self.masses for e in row)

    def pencil(self, s: Expr) -> list[list[Expr]]:
        """M s^2 + C s + K, which takes the vector of a motion y = Re(v exp(s t)) to zero."""
        rows = zip(*self.parts, strict=True)
        return [[m * s**2 + c * s + k for m, c, k in zip(*row, strict=True)] for row in rows]

    def changed(self, change: Callable[[Expr], Expr]) -> LinearMotion:
        """This motion with every entry of its matrices changed."""
        return LinearMotion(*([[change(e) for e in row] for row in part] for part in self.parts))

    def blocks(self) -> list[tuple[list[int], LinearMotion]]:
        """The places that act on each other, with their motion; a coordinate goes with its momentum."""
        size = len(self.masses)
        freedoms = size // 2 if self.is_of_first_order else size

        def linked(i: int, j: int) -> bool:
            return (i - j) % freedoms == 0 or any(part[i][j] or part[j][i] for part in self.parts)

        blocks = matrices.connected(size, linked)
        return [(b, LinearMotion(*(matrices.part(part, b, b) for part in self.parts))) for b in blocks]


@dataclass(frozen=True, slots=True)
class Root:
    """A root s = `growth` + i `angular` of the determinant, with what it stands for.

    `growth` (1/s) is negative where motion decays. `is_stable` is None of a zero mode, which is displaced to
    another equilibrium and drifts there, and where the signs of symbols decide: the root is that for a
    positive `condition`. A root that counts several `times` has as many vectors if it `is_whole`. Of two
    conjugate roots that with `angular` >= 0 stands for both, and where -s is a root with s (`is_paired`),
    the one that grows.
    """

    growth: float | Expr
    angular: float | Expr
    is_stable: bool | None
    condition: Expr | None = None
    times: int = 1
    is_whole: bool = True
    is_paired: bool = True
    vectors: tuple[Vector, ...] = ()

    @property
    def rate(self) -> float | Expr:
        """The growth of an unstable mode; else the angular frequency, or the decay where it has none."""
        if self.is_stable is False and self.growth:
            return self.growth
        return -self.growth if self.growth and not self.angular else self.angular
