"""Velocities from momenta in closed form, where a Lagrangian is not quadratic in them.

Each of the forms below is a part K of the Lagrangian, in velocities v; A, B, Q, c and d are free of them.
With P = dK/dv,

    K = A sqrt(B + v.Q.v)    v = S B Q^-1 P/D,  H = -S D,  S = sign(A B),  D^2 = B (A^2 - P.Q^-1 P)
    K = A (v.Q.v)^k          v = Q^-1 P/(2 k A s^(k-1)),  H = (2 k - 1) A s^k,
                             s^(2k-1) = P.Q^-1 P/(2 k A)^2
    K = A f(c v + d)         v = (u - d)/c where f'(u) = r = P/(A c),  H = A (r u - f(u)) - P d/c

K as a function of v + s, as where a square is completed, has v less by s, and H less by P.s. The roots are
real, and positive where they are square roots. The formulas are derived here from dK/dv = P and H = P v - K.
Polynomials of a higher degree are a matter of `polynomial_inversion`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TypeAlias

from rigidcli.algebra import matrices
from rigidcli.algebra.atoms import is_positive
from rigidcli.algebra.expansion import Polynomial, coefficients
from rigidcli.algebra.expressions import (
    PI,
    Expr,
    factored,
    gathered,
    number,
    total,
)
from rigidcli.algebra.functions import apply
from rigidcli.algebra.simplification import shortest, tidy
from rigidcli.mechanics.hamilton_equations import coefficient, has_degrees
from rigidcli.mechanics.velocity_terms import Kernel

HALF = Fraction(1, 2)


@dataclass(frozen=True, slots=True)
class Branch:
    """One way back from momenta: velocities, H = P v - K, and expressions that must be positive for that.

    These are `conditions` on the momenta, and the `region` of coordinates and parameters: elsewhere the
    same velocities have another form. Velocities with a `period` may differ by its multiples, too. Those of a
    branch that `is_continued` have another form, too, beyond the conditions.
    """

    velocities: tuple[Expr, ...]
    hamiltonian: Expr
    conditions: tuple[Expr, ...] = ()
    region: tuple[Expr, ...] = ()
    period: Expr | None = None
    is_continued: bool = False

    @property
    def validity(self) -> str:
        """The conditions in words."""
        where = " and ".join(self._limits())
        return where if self.period is None else f"{where}, and all that differ by multiples of {self.period}"

    def _limits(self) -> Iterator[str]:
        """The conditions, solved for a momentum where they are linear in it, with numbers."""
        ends: dict[str, dict[int, Expr]] = {}
        for e in self.conditions:
            name = next(iter(e.names), "")
            found = coefficients(e, [name])
            slope = coefficient(found, 1, 0).as_number if has_degrees(found, 0, 1) else None
            if found is None or not slope or not e.names <= {name}:
                yield f"{e} > 0"
            else:
                ends.setdefault(name, {})[1 if slope > 0 else -1] = -coefficient(found, 1) / slope
        for name, sides in ends.items():
            if len(sides) == 2:
                yield f"{sides[1]} < {name} < {sides[-1]}"
            else:
                ((side, end),) = sides.items()
                yield f"{name} {'>' if side > 0 else '<'} {end}"

    def shifted(self, shift: Sequence[Expr], momenta: Sequence[Expr]) -> Branch:
        """The inverse of K(v + `shift`) from that of K(v)."""
        velocities = tuple(v - s for v, s in zip(self.velocities, shift, strict=True))
        turned = total(P * s for P, s in zip(momenta, shift, strict=True))
        return replace(self, velocities=velocities, hamiltonian=self.hamiltonian - turned)


def inverted_kernel(kernel: Kernel, momenta: Sequence[Expr]) -> list[Branch]:
    """All real inverses of a function or power; none if it has no form that is known here."""
    if len(momenta) == 1 and has_degrees(kernel.argument, 0, 1):
        return of_function(kernel, momenta[0])
    return [] if kernel.function else of_quadratic(kernel, momenta)


def of_quadratic(kernel: Kernel, momenta: Sequence[Expr]) -> list[Branch]:
    """K = A (B + c.v + v.Q.v)^k: the square is completed. A B may be left where k is 1/2."""
    A, k, found, size = kernel.factor, kernel.exponent, kernel.argument, len(momenta)
    if not has_degrees(found, 0, 1, 2):
        return []
    form = quadratic_form(found, size)
    inverse = matrices.inverse(form) if matrices.is_regular(form) else None
    if inverse is None:
        return []
    linear = [coefficient(found, size, place) for place in range(size)]
    shift = [tidy(total(a * c for a, c in zip(row, linear, strict=True)) / 2) for row in inverse]
    B = tidy(coefficient(found, size) - total(c * s for c, s in zip(linear, shift, strict=True)) / 2)
    if (k == HALF) is B.is_zero:
        return []
    raised = [total(a * P for a, P in zip(row, momenta, strict=True)) for row in inverse]
    if k == HALF:
        squares = form_of([[tidy(-B * entry) for entry in row] for row in inverse], momenta)
        branches = _of_root(A, B, raised, squares + tidy(A**2 * B))
    else:
        s = tidy(form_of(inverse, momenta)) / (2 * k * A) ** 2
        down, up = (k - 1) / (2 * k - 1), k / (2 * k - 1)
        velocities = tuple(tidy(w / (2 * k * A * s**down)) for w in raised)
        branches = [Branch(velocities, (2 * k - 1) * A * s**up)]
    return [branch.shifted(shift, momenta) for branch in branches]


def quadratic_form(found: Polynomial, size: int) -> list[list[Expr]]:
    """The symmetric matrix Q of the terms v.Q.v among the coefficients of a polynomial in v."""
    places = range(size)
    return [[coefficient(found, size, i, j) * (1 if i == j else HALF) for j in places] for i in places]


def form_of(matrix: matrices.Matrix, momenta: Sequence[Expr]) -> Expr:
    """P.M.P, each momentum left whole."""
    size = range(len(momenta))
    pairs = [(i, j) for i in size for j in size[i:]]
    return total(matrix[i][j] * (1 if i == j else 2) * momenta[i] * momenta[j] for i, j in pairs)


def _of_root(A: Expr, B: Expr, raised: Sequence[Expr], square: Expr) -> list[Branch]:
    """K = A sqrt(B + v.Q.v), with D^2: first the form for a positive B, where the system may be at rest."""
    D = shortest([square, tidy(square)]) ** HALF
    side, of_constant = _odd_part(B)
    sign, of_factor = _odd_part(A)
    region = side * of_constant * of_factor
    if region.sign() == -1:
        sign, region = -sign, -region
    return [
        Branch(tuple(s * B * w / D for w in raised), -s * D, region=where)
        for s, where in _either_sign(sign, region)
    ]


def _odd_part(e: Expr) -> tuple[int, Expr]:
    """The sign of a number, and a product without squares, which together have the sign of an expression."""
    coefficient, monomial = factored(e)
    odd = {a: 1 for a, n in monomial if n.numerator * n.denominator % 2 and not is_positive(a)}
    return 1 if coefficient > 0 else -1, gathered(1, odd)


def _either_sign(sign: int, region: Expr) -> list[tuple[int, tuple[Expr, ...]]]:
    """The sign where `region` is positive, and the other one where it is not, if that can be."""
    if region.sign() == 1:
        return [(sign, ())]
    return [(sign, (tidy(region),)), (-sign, (tidy(-region),))]


def signs_of(e: Expr) -> list[tuple[int, tuple[Expr, ...]]]:
    """The signs that an expression may have, and where: first that for positive symbols."""
    return _either_sign(*_odd_part(e))


_Solutions: TypeAlias = list[tuple[Expr, Expr, tuple[Expr, ...]]]


def of_function(kernel: Kernel, P: Expr) -> list[Branch]:
    """K = A f(c v + d), where f is a power or one of `INVERSE_SLOPES`."""
    A, n = kernel.factor, kernel.exponent
    c, d = coefficient(kernel.argument, 1, 0), coefficient(kernel.argument, 1)
    r = tidy(P / (A * c))
    if kernel.function in ("", "abs"):
        solutions = [] if n == 1 else _of_power(r, n, kernel.function == "abs")
    elif n == 1 and kernel.function in INVERSE_SLOPES:
        solutions = INVERSE_SLOPES[kernel.function](r)
    else:
        return []
    period = 2 * PI / abs(c) if kernel.function in ("sin", "cos") else None
    return [
        Branch(
            ((u - d) / c,),
            total([*(A * Expr({m: factor}) for m, factor in energy.terms.items()), -P * d / c]),
            tuple(map(tidy, positive)),
            period=period,
        )
        for u, energy, positive in solutions
    ]


def _of_power(r: Expr, n: Fraction, is_absolute: bool) -> _Solutions:
    """All u with f'(u) = r for f(u) = u^n, or |u|^n, with r u - f and with what must be positive."""
    base = tidy(r / n)
    if is_absolute or (n.denominator == 1 and n % 2 == 0):
        size = apply("abs", base)
        u = apply("sign", base) * size ** (1 / (n - 1))
        return [(u, (n - 1) * size ** (n / (n - 1)), ())]
    u = base ** (1 / (n - 1))
    roots = (u, -u) if n.denominator == 1 else (u,)
    return [(root, (1 - 1 / n) * r * root, (base,)) for root in roots]


def _root(e: Expr) -> Expr:
    return e**HALF


_BOTH = (number(1), number(-1))

INVERSE_SLOPES: dict[str, Callable[[Expr], _Solutions]] = {
    "exp": lambda r: [(apply("log", r), r * apply("log", r) - r, (r,))],
    "cosh": lambda r: [(apply("asinh", r), r * apply("asinh", r) - _root(1 + r**2), ())],
    "sinh": lambda r: [
        (s * apply("acosh", r), s * (r * apply("acosh", r) - _root(r**2 - 1)), (r - 1,)) for s in _BOTH
    ],
    "cos": lambda r: [
        (-apply("asin", r), -r * apply("asin", r) - _root(1 - r**2), (1 - r, 1 + r)),
        (PI + apply("asin", r), r * (PI + apply("asin", r)) + _root(1 - r**2), (1 - r, 1 + r)),
    ],
    "sin": lambda r: [
        (s * apply("acos", r), s * (r * apply("acos", r) - _root(1 - r**2)), (1 - r, 1 + r)) for s in _BOTH
    ],
    "log": lambda r: [(1 / r, 1 - apply("log", 1 / r), (1 / r,))],
}
"""For each function f all u with f'(u) = r, each with r u - f(u) and with what must be positive."""
