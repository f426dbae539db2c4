"""Velocities from momenta in closed form, where a Lagrangian is not quadratic in them.

K is a part of the Lagrangian that shares its velocities v with no other, and P = dK/dv. Three ways are tried:

    K^2 = a + v.C.v             a root: with S the sign of K at rest and D^2 = a (1 - P.C^-1.P)
                                v = S a C^-1.P/D,  H = -S D
    K = A v^n for one v         an even power: |v| = |P/(n A)|^(1/(n - 1)),  H = (n - 1) A |v|^n
    dK/dv = P for one v         what is done to v is undone step by step, and H = P v - K

Terms linear in v are part of the root when the square is completed: K as a function of v + s
has v less by s, and H less by P.s. The roots are real, and positive where they are square roots. The formulas
are derived here from dK/dv = P and H = P.v - K. Each way back is put to the test at sample points.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction

from rigidcli.algebra import arithmetic, matrices
from rigidcli.algebra.atoms import Group, is_positive
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import Polynomial, coefficients, expand
from rigidcli.algebra.expressions import Expr, factored, gathered, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.simplification import shortest, tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import sample_points
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.mechanics.hamilton_equations import coefficient, has_degrees
from rigidcli.mechanics.undoing import solutions

HALF = Fraction(1, 2)

SAME = 1e-9
"""Two values of a velocity are one if they differ by less than this share: floats are right to 1e-16."""


@dataclass(frozen=True, slots=True)
class Branch:
    """One way back from momenta: velocities, H = P v - K, and expressions that must be positive for that.

    These are `conditions` on the momenta, and the `region` of coordinates and parameters: elsewhere the
    same velocities have another form.
    """

    velocities: tuple[Expr, ...]
    hamiltonian: Expr
    conditions: tuple[Expr, ...] = ()
    region: tuple[Expr, ...] = ()

    @property
    def validity(self) -> str:
        """The conditions in words."""
        return " and ".join(f"{e} > 0" for e in self.conditions)

    def shifted(self, shift: Sequence[Expr], momenta: Sequence[Expr]) -> Branch:
        """The inverse of K(v + `shift`) from that of K(v)."""
        velocities = tuple(v - s for v, s in zip(self.velocities, shift, strict=True))
        turned = total(P * s for P, s in zip(momenta, shift, strict=True))
        return replace(self, velocities=velocities, hamiltonian=self.hamiltonian - turned)


def inverted(K: Expr, velocities: Sequence[str], momenta: Sequence[Expr]) -> list[Branch]:
    """All real inverses of dK/dv = P; none if no way leads to a closed form."""
    with suppress(ExpressionError, ComputationError):
        found = _of_root(K, velocities, momenta)
        if found:
            return found
        if len(velocities) == 1:
            return _of_even_power(K, velocities[0], momenta[0]) or _undone(K, velocities[0], momenta[0])
    return []


def _form(found: Polynomial, size: int) -> list[list[Expr]]:
    """The symmetric matrix Q of the terms v.Q.v among the coefficients of a polynomial in v."""
    places = range(size)
    return [[coefficient(found, size, i, j) * (1 if i == j else HALF) for j in places] for i in places]


def _value(matrix: matrices.Matrix, momenta: Sequence[Expr]) -> Expr:
    """P.M.P, each momentum left whole."""
    size = range(len(momenta))
    pairs = [(i, j) for i in size for j in size[i:]]
    return total(matrix[i][j] * (1 if i == j else 2) * momenta[i] * momenta[j] for i, j in pairs)


def _times(matrix: matrices.Matrix, vector: Sequence[Expr]) -> list[Expr]:
    return [total(a * b for a, b in zip(row, vector, strict=True)) for row in matrix]


def _of_root(K: Expr, velocities: Sequence[str], momenta: Sequence[Expr]) -> list[Branch]:
    """The inverse where K^2 is a quadratic polynomial: first the form where the system may be at rest."""
    size = len(velocities)
    is_root = any(n.denominator == 2 for monomial in K.terms for _, n in monomial)
    found = coefficients(arithmetic.tidy(expand(K**2)), velocities) if is_root else None
    if not has_degrees(found, 0, 1, 2):
        return []
    form = _form(found, size)
    inverse = matrices.inverse(form) if matrices.is_regular(form) else None
    if inverse is None:
        return []
    linear = [coefficient(found, size, place) for place in range(size)]
    shift = [tidy(e / 2) for e in _times(inverse, linear)]
    a = tidy(coefficient(found, size) - total(c * s for c, s in zip(linear, shift, strict=True)) / 2)
    if a.is_zero:
        return []
    raised = _times(inverse, momenta)
    square = _value([[tidy(-a * entry) for entry in row] for row in inverse], momenta) + a
    D = shortest([square, tidy(square)]) ** HALF
    outside = K
    if len(K.terms) == 1:
        ((monomial, number),) = K.terms.items()
        outside = gathered(number, {b: n for b, n in monomial if b.names.isdisjoint(velocities)})
    else:
        outside = substitute(K, {v: -s for v, s in zip(velocities, shift, strict=True)})
    (sign, odd), (side, other) = _odd_part(outside), _odd_part(a)
    region = side * odd * other
    if region.sign() == -1:
        sign, region = -sign, -region
    ways = [(sign, ())] if region.sign() == 1 else [(sign, (tidy(region),)), (-sign, (tidy(-region),))]
    return [
        Branch(tuple(s * a * w / D for w in raised), -s * D, region=where).shifted(shift, momenta)
        for s, where in ways
    ]


def _odd_part(e: Expr) -> tuple[int, Expr]:
    """The sign of a number, and a product without squares, which together have the sign of an expression."""
    size, monomial = factored(e)
    odd = {a: 1 for a, n in monomial if n.numerator * n.denominator % 2 and not is_positive(a)}
    return 1 if size > 0 else -1, gathered(1, odd)


def _of_even_power(K: Expr, v: str, P: Expr) -> list[Branch]:
    """K = A v^n with an even n."""
    found = coefficients(K, [v])
    ((n,), A) = next(iter(found.items())) if found is not None and len(found) == 1 else ((1,), K)
    if n % 2:
        return []
    base = tidy(P / (n * A))
    size = apply("abs", base)
    u = apply("sign", base) * size ** Fraction(1, n - 1)
    return [Branch((u,), (n - 1) * A * size ** Fraction(n, n - 1))]


def _undone(K: Expr, v: str, P: Expr) -> list[Branch]:
    """The inverses of one velocity that come from undoing what is done to it, and hold at sample points."""
    momentum = symbol("momentum P")
    slope = tidy(derivative(K, v))
    found: dict[Expr, Branch] = {}
    for u, conditions, is_periodic in solutions(slope, v, momentum):
        if is_periodic:
            return []  # nobody lists endless branches
        with suppress(ExpressionError):
            velocity, positive = tidy(u), _positive(conditions)
            if velocity in found or not _holds(K, velocity, positive, slope, v, momentum):
                continue
            energy = tidy(momentum * velocity - substitute(K, {v: velocity}))
            put = {str(momentum): P}
            e, h = substitute(velocity, put), substitute(energy, put)
            limits = tuple(tidy(substitute(c, put)) for c in positive)
            found[velocity] = Branch((e,), h, limits)
    return list(found.values())


def _holds(K: Expr, u: Expr, conditions: Sequence[Expr], slope: Expr, v: str, momentum: Expr) -> bool:
    """Whether a velocity is that of its momentum at one of some points, within the conditions."""
    for place, point in enumerate(sample_points(sorted(K.names), {}, signed=[v])):
        here = point | {v: point[v] * (1 + place % 4)}
        with suppress(ExpressionError):
            K.evaluate(**here)
            here[str(momentum)] = slope.evaluate(**here)
            values = [e.evaluate(**here) for e in (u, *conditions)]
            if min(values[1:], default=1.0) > 0 and abs(values[0] - here[v]) <= SAME * abs(here[v]):
                return True
    return False


def _positive(conditions: Sequence[Expr]) -> tuple[Expr, ...]:
    """Conditions without the factors that do not change their sign, and without what always holds."""
    found = {}
    for e in conditions:
        size, monomial = factored(tidy(e))
        odd = {
            a: 1 if n > 0 or isinstance(a, Group) else -1
            for a, n in monomial
            if n.numerator * n.denominator % 2
        }
        kept = gathered(1 if size > 0 else -1, {a: n for a, n in odd.items() if not is_positive(a)})
        found[tidy(kept)] = True
    return tuple(e for e in found if not (e.sign() == 1 and e.is_strict()))
