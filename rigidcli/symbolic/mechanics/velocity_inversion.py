"""Velocities from momenta in closed form, where a Lagrangian is not quadratic in them.

Each of the forms below is one term K of the Lagrangian, in velocities v; A, B, Q, c and d are free of
velocities. With P = dK/dv,

    K = A sqrt(B + v.Q.v)    v = S Q^-1 P/A,  H = -A S R^2,  R^2 = 1 - P.Q^-1 P/A^2,  S^2 = B/R^2
    K = A (v.Q.v)^k          v = Q^-1 P/(2 k A s^(k-1)),  H = (2 k - 1) A s^k,
                             s^(2k-1) = P.Q^-1 P/(2 k A)^2
    K = A v^n                v = (P/(n A))^(1/(n-1)),  H = (1 - 1/n) P v
    K = A exp(c v + d)       v = (log(P/(A c)) - d)/c,  H = P v - P/c
    K = A cosh(c v + d)      v = (asinh(P/(A c)) - d)/c,  H = P v - A sqrt(1 + P^2/(A c)^2)
    K = A sinh(c v + d)      v = (+-acosh(P/(A c)) - d)/c,  H = P v -+ A sqrt(P^2/(A c)^2 - 1)
    K = A log(c v + d)       v = A/P - d/c,  H = P v - A log(A c/P)

The roots are real, and positive where they are square roots: signs are carried outside. The formulas are
derived here from dK/dv = P and H = P v - K.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

from rigidcli.symbolic.algebra.atoms import Applied, Group, Symbol
from rigidcli.symbolic.algebra.calculus import Polynomial, coefficients
from rigidcli.symbolic.algebra.expressions import ONE, Expr, number, total
from rigidcli.symbolic.algebra.functions import apply
from rigidcli.symbolic.algebra.simplification import tidy
from rigidcli.symbolic.mechanics import mass_matrix
from rigidcli.symbolic.mechanics.hamilton_equations import coefficient, has_degrees


@dataclass(frozen=True, slots=True)
class Branch:
    """One way back from momenta: velocities, H = P v - K, and expressions that must be positive for that."""

    velocities: tuple[Expr, ...]
    hamiltonian: Expr
    conditions: tuple[Expr, ...] = ()

    @property
    def validity(self) -> str:
        """The conditions in words."""
        return " and ".join(f"{e} > 0" for e in self.conditions)


def inverted_velocities(kernel: Expr, names: Sequence[str], momenta: Sequence[Expr]) -> list[Branch]:
    """All real inverses of one term of a Lagrangian; none if it has no form that is known here."""
    if len(kernel.terms) != 1:
        return []
    ((monomial, coefficient),) = kernel.terms.items()
    moving = [(atom, exponent) for atom, exponent in monomial if not atom.names.isdisjoint(names)]
    if len(moving) != 1:
        return []
    ((atom, power),) = moving
    exponent = Fraction(power)
    A = Expr({tuple(pair for pair in monomial if pair[0] is not atom): coefficient})
    if isinstance(atom, Symbol):
        return _of_power(A, exponent, momenta[0])
    if isinstance(atom, Group):
        return _of_quadratic(A, exponent, atom.inner, names, momenta)
    if isinstance(atom, Applied) and len(names) == 1:
        return _of_function(A, exponent, atom, names[0], momenta[0])
    return []


def _of_quadratic(
    A: Expr, k: Fraction, inner: Expr, names: Sequence[str], momenta: Sequence[Expr]
) -> list[Branch]:
    """K = A (B + v.Q.v)^k, with a B where k is 1/2, and without one where it is not."""
    found = coefficients(inner, names)
    if not has_degrees(found, 0, 2):
        return []
    form = quadratic_form(found, len(names))
    inverse = mass_matrix.inverse(form)
    if inverse is None or mass_matrix.determinant(form).is_zero:
        return []
    constant = coefficient(found, len(names))
    raised = [total(a * P for a, P in zip(row, momenta, strict=True)) for row in inverse]
    square = tidy(total(w * P for w, P in zip(raised, momenta, strict=True)))
    if (k == Fraction(1, 2)) is constant.is_zero:
        return []
    if not constant.is_zero:
        return [_of_root(A, constant, raised, square)]
    if len(names) == 1:
        # v^2 under a power is |v|, and Q may stand outside if it is positive.
        return _of_absolute(A * form[0][0] ** k, 2 * k, momenta[0]) if k.denominator == 1 else []
    s = square / (2 * k * A) ** 2
    down, up = ((k - 1) / (2 * k - 1), k / (2 * k - 1))
    velocities = tuple(tidy(w / (2 * k * A * s**down)) for w in raised)
    return [Branch(velocities, (2 * k - 1) * A * s**up)]


def quadratic_form(found: Polynomial, size: int) -> list[list[Expr]]:
    """The symmetric matrix Q of the terms v.Q.v among the coefficients of a polynomial in v."""
    places, half = range(size), Fraction(1, 2)
    return [[coefficient(found, size, i, j) * (1 if i == j else half) for j in places] for i in places]


def _of_root(A: Expr, B: Expr, raised: Sequence[Expr], square: Expr) -> Branch:
    """K = A sqrt(B + v.Q.v)."""
    if len(B.terms) == 1 and B.sign() == 1:
        root = _root(tidy(B * (1 - square / A**2)))
        return Branch(tuple(w * B / (A * root) for w in raised), -A * root)
    R2 = tidy(1 - square / A**2)
    S = _root(B / R2)
    return Branch(tuple(w * S / A for w in raised), -A * S * R2)


def _of_power(A: Expr, n: Fraction, P: Expr) -> list[Branch]:
    """K = A v^n."""
    if n.denominator == 1 and n % 2 == 0:
        return _of_absolute(A, n, P)
    base = P / (n * A)
    v = base ** (1 / (n - 1))
    roots = (v, -v) if n.denominator == 1 else (v,)
    return [Branch((root,), (1 - 1 / n) * P * root, (tidy(base),)) for root in roots]


def _of_absolute(A: Expr, n: Fraction, P: Expr) -> list[Branch]:
    """K = A |v|^n: v has the sign of P/(n A)."""
    base = tidy(P / (n * A))
    size = apply("abs", base)
    v = apply("sign", base) * size ** (1 / (n - 1))
    return [Branch((v,), (n - 1) * A * size ** (n / (n - 1)))]


def _of_function(A: Expr, exponent: Fraction, atom: Applied[Expr], name: str, P: Expr) -> list[Branch]:
    """K = A f(c v + d), where f is one of `INVERSE_SLOPES`, or A |v|^n."""
    found = coefficients(atom.arguments[0], [name])
    if not has_degrees(found, 0, 1):
        return []
    d, c = coefficient(found, 1), coefficient(found, 1, 0)
    if atom.function == "abs":
        straight = d.is_zero and c == ONE and exponent != 1
        return _of_absolute(A, exponent, P) if straight else []
    if exponent != 1 or atom.function not in INVERSE_SLOPES:
        return []
    branches = []
    for u, f, positive in INVERSE_SLOPES[atom.function](tidy(P / (A * c))):
        v = (u - d) / c
        branches.append(Branch((v,), P * v - A * f, positive))
    return branches


def _root(e: Expr) -> Expr:
    return e ** Fraction(1, 2)


INVERSE_SLOPES: dict[str, Callable[[Expr], list[tuple[Expr, Expr, tuple[Expr, ...]]]]] = {
    "exp": lambda r: [(apply("log", r), r, (r,))],
    "cosh": lambda r: [(apply("asinh", r), _root(1 + r**2), ())],
    "sinh": lambda r: [
        (sign * apply("acosh", r), sign * _root(r**2 - 1), (r - 1,)) for sign in (number(1), number(-1))
    ],
    "log": lambda r: [(1 / r, apply("log", 1 / r), (1 / r,))],
}
"""For each function f all u with f'(u) = r, each with f(u) and with what must be positive."""
