"""Velocities from momenta in closed form, where a part of a Lagrangian is a polynomial of degree above 2.

With P = dK/dv, and A, Q, a and b free of velocities, these are

    K = A (v + s)^n          a power, in several velocities A (v.Q.v)^k, multiplied out
    K = a v^4 + b v^2        v^3 + f v = g where f = b/(2 a), g = P/(4 a),  H = 3 P v/4 - b v^2/2,
                             also for a length v, v^2 = v.Q.v, P^2 = P.Q^-1 P

In one velocity the next lower power is shifted away at first: any polynomial of degree 3 or 4 is of these
forms. The cubic has its real roots by the triple angles of sine, cosine, and their hyperbolic counterparts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

from rigidcli.algebra import matrices
from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.expansion import MAX_STEPS, Polynomial, coefficients
from rigidcli.algebra.expressions import ONE, Expr, product, symbol, total
from rigidcli.algebra.fractions import factors
from rigidcli.algebra.functions import apply
from rigidcli.algebra.simplification import tidy
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.hamilton_equations import coefficient, has_degrees
from rigidcli.mechanics.velocity_inversion import (
    HALF,
    Branch,
    form_of,
    of_function,
    of_quadratic,
    quadratic_form,
    signs_of,
)
from rigidcli.mechanics.velocity_terms import Kernel, ratio_of


def inverted_polynomial(found: Polynomial, momenta: Sequence[Expr]) -> list[Branch]:
    """All real inverses of a polynomial of a degree above 2; none if it has no form that is known here."""
    return (_of_powers if len(momenta) == 1 else _of_power_of_form)(found, momenta)


def _of_powers(found: Polynomial, momenta: Sequence[Expr]) -> list[Branch]:
    """A polynomial in one velocity: a power, or of degree 4, when its next lower power is shifted away."""
    (P,), (degree,) = momenta, max(found)
    lead = coefficient(found, 1, *[0] * degree)
    shift = tidy(coefficient(found, 1, *[0] * (degree - 1)) / (degree * lead))
    moved = [
        tidy(total(e * math.comb(n, k) * (-shift) ** (n - k) for (n,), e in found.items() if n >= k))
        for k in range(degree)
    ]
    P = P - moved[1]
    if all(e.is_zero for e in moved[2:]):
        argument: Polynomial = {(1,): ONE, (0,): shift}
        branches = of_function(Kernel(lead, "", argument, Fraction(degree)), P)
    elif degree == 4 and moved[3].is_zero:
        branches = [branch.shifted([shift], [P]) for branch in _of_quartic(lead, moved[2], P)]
    else:
        return []
    rest = moved[0] + moved[1] * shift
    return [replace(branch, hamiltonian=branch.hamiltonian - rest) for branch in branches]


def _of_quartic(a: Expr, b: Expr, P: Expr) -> list[Branch]:
    """K = a v^4 + b v^2. Where b/a is negative, the slope has three real roots for small P."""
    f, g = tidy(b / (2 * a)), tidy(P / (4 * a))
    found: list[Branch] = []
    for sign, region in signs_of(f):
        size = 2 * (sign * f / 3) ** HALF
        w = tidy(4 * g / size**3)
        roots: list[tuple[Expr, tuple[Expr, ...]]]
        if sign > 0:
            roots = [(apply("sinh", apply("asinh", w) / 3), ())]
        else:
            inside = (1 - w, 1 + w)
            roots = [(-apply("sin", apply("asin", w) / 3), inside)]
            for side in (1, -1):
                roots.append((side * apply("cos", apply("acos", side * w) / 3), inside))
                roots.append((side * apply("cosh", apply("acosh", side * w) / 3), (side * w - 1,)))
        for root, conditions in roots:
            v = size * root
            energy = P * v * Fraction(3, 4) - b * v**2 / 2
            # The outer roots pass from cosine to cosh where the inner one ends.
            outer = bool(conditions) and root is not roots[0][0]
            found.append(Branch((v,), energy, tuple(map(tidy, conditions)), region, is_continued=outer))
    return found


def _of_power_of_form(found: Polynomial, momenta: Sequence[Expr]) -> list[Branch]:
    """A (v.Q.v)^k multiplied out, for k = 2 also with b v.Q.v, and terms that are linear in v."""
    size, degree = len(momenta), max(map(sum, found))
    if {sum(powers) for powers in found} - {1, degree} - ({2} if degree == 4 else set()):
        return []
    names = [f"velocity {place}" for place in range(size)]
    rates = [symbol(name) for name in names]
    top = total(
        product([e, *(v**n for v, n in zip(rates, powers, strict=True))])
        for powers, e in found.items()
        if sum(powers) == degree
    )
    try:
        parts = factors(top, Allowance(MAX_STEPS))
    except ExpressionError:
        return []
    moving = [(e, k) for e, k in parts if not e.names.isdisjoint(names)]
    form = coefficients(moving[0][0], names)
    if len(moving) != 1 or not has_degrees(form, 2):
        return []
    A = product(e**k for e, k in parts if e.names.isdisjoint(names))
    shifted = [P - coefficient(found, size, place) for place, P in enumerate(momenta)]
    square = {powers: e for powers, e in found.items() if sum(powers) == 2}
    if not square:
        return of_quadratic(Kernel(A, "", form, Fraction(moving[0][1])), shifted)
    b = ratio_of(square, form)
    return [] if b is None else _of_length(A, b, quadratic_form(form, size), shifted)


def _of_length(a: Expr, b: Expr, form: matrices.Matrix, momenta: Sequence[Expr]) -> list[Branch]:
    """K = a u^4 + b u^2 of the length u of the velocities, u^2 = v.Q.v, along Q^-1 P."""
    inverse = matrices.inverse(form) if matrices.is_regular(form) else None
    if inverse is None:
        return []
    size = tidy(form_of(inverse, momenta)) ** HALF
    raised = [total(e * P for e, P in zip(row, momenta, strict=True)) for row in inverse]
    return [
        # At rest 0/0 stands for a velocity: orbits follow the velocities themselves.
        replace(branch, velocities=tuple(w * u / size for w in raised), is_continued=True)
        for branch in _of_quartic(a, b, size)
        for u in branch.velocities
    ]
