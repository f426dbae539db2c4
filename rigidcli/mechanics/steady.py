"""Steady motions: cyclic coordinates turn at constant rates, and the other coordinates stay where they are.

The momenta p_c of cyclic coordinates are constants. The Routhian depends on the others alone:

    R(q, v; p_c) = L - sum_c p_c v_c = sum_i p_i v_i - H

Its equations are those of Lagrange for the other coordinates, as Hamilton's equations for these are, with p_c
as parameters. The effective potential is V_eff = -R at v = 0. Motion is steady where dV_eff/dq = 0.

Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, section 8.3. Their Routhian
has the other sign; here it has the sign of L, as in L. Landau, E. Lifshitz, Mechanics, section 41.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from rigidcli.algebra.expansion import coefficient, coefficients, has_degrees
from rigidcli.algebra.expressions import ZERO, Expr, symbol
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.legendre import legendre_transform
from rigidcli.mechanics.phase_space import Phase
from rigidcli.mechanics.small_oscillations import Values, positive_root, sign_of

RATE = "rate'"  # the name of the unknown rate, which no parameter can have


def routhian(
    lagrangian: Expr | None,
    hamiltonian: Expr,
    phase: Phase,
    velocities: Sequence[str],
    cyclic: Collection[str],
    values: Values,
) -> Expr | None:
    """The Routhian without the velocities of cyclic coordinates; None where it has not one closed form.

    It is minus the Legendre transform of L by these velocities, or else that of H by the other momenta.
    """
    triples = list(zip(phase.coordinates, velocities, phase.momenta, strict=True))
    if lagrangian is not None:
        function, sign, pairs = lagrangian, -1, [(v, p) for q, v, p in triples if q in cyclic]
    else:
        function, sign, pairs = hamiltonian, 1, [(p, v) for q, v, p in triples if q not in cyclic]
    branches = legendre_transform(function, [a for a, _ in pairs], [b for _, b in pairs], values)
    return sign * branches[0].hamiltonian if len(branches) == 1 else None


class Rates(NamedTuple):
    """The rate of a steady motion, the `other` one of two, and what is positive where they are real.

    The `momentum` is that at the first rate.
    """

    rate: Expr
    other: Expr | None = None
    condition: Expr | None = None
    momentum: Expr = ZERO


def steady_rates(forces: Mapping[str, Expr], momentum: str, velocity: Expr, given: Values) -> Rates:
    """The rate at which a cyclic coordinate keeps the others where they are.

    `forces` act along the other coordinates at their given places, as functions of the cyclic momentum, and
    `velocity` is the rate as such a function. It must be linear, and the forces at most quadratic. Of two
    rates of different sign it is the positive one, of two of the same sign the smaller one.

    Raises ExpressionError with the reason where there is no such rate, or every rate is one.
    """
    line = coefficients(velocity, [momentum])
    slope = None if line is None else tidy(coefficient(line, 1, 0))
    if not has_degrees(line, 0, 1) or not slope:
        hint = f"fix the momentum, and look for the place: `{{{momentum}: J, find: {{...}}}}`"
        raise ExpressionError("the rate is not a linear function of its momentum", hint=hint)
    momenta = {momentum: (symbol(RATE) - coefficient(line, 1)) / slope}
    conditions = {}
    for name, force in forces.items():
        powers = coefficients(substitute(force, momenta), [RATE])
        if not has_degrees(powers, 0, 1, 2):
            raise ExpressionError(f"the force along {name} is not a quadratic function of the rate")
        parts = [tidy(coefficient(powers, 1, *[0] * k)) for k in range(3)]
        if any(not is_zero(part) for part in parts):
            conditions[name] = [ZERO if is_zero(part) else part for part in parts]
    if not conditions:
        raise ExpressionError("no force acts at any rate: every rate is steady", hint=f"give `{momentum}: J`")
    first, (c, b, a) = next(iter(conditions.items()))
    found = _roots(first, a, b, c, given)
    for name, (c, b, a) in conditions.items():
        left = tidy((a * found.rate + b) * found.rate + c)
        if name != first and not is_zero(left):
            raise ExpressionError(
                f"the rate at which no force acts along {first} leaves {written(left)} along {name}"
            )
    return found._replace(momentum=tidy(substitute(momenta[momentum], {RATE: found.rate})))


def _roots(name: str, a: Expr, b: Expr, c: Expr, given: Values) -> Rates:
    """The rates w at which the force a w^2 + b w + c along a coordinate vanishes."""
    nothing = f"the force along {name}"
    if not a and not b:
        raise ExpressionError(f"{nothing} is {written(c)} at every rate")
    if not c and not (a and b):
        raise ExpressionError(f"{nothing} vanishes at rest only")
    if not a or not c:
        return Rates(tidy(-c / b if not a else -b / a))
    # (2 a w + b)^2 = b^2 - 4 a c, where a w^2 = -c without b
    square = tidy(b**2 - 4 * a * c if b else -c / a)
    sign = sign_of(square, given)
    if sign == -1:
        what = "the discriminant is" if b else "its square would be"
        raise ExpressionError(f"{nothing} vanishes at no real rate: {what} {written(square)}")
    root = positive_root(square, given) if square else ZERO
    if not b:
        return Rates(root, None, None if sign else square)
    if not square:
        return Rates(tidy(-b / (2 * a)))
    # Where a becomes small, the slow root becomes -c/b; the other one grows without bound.
    side = 1 if sign_of(b, given) == 1 else -1
    slow, fast = (tidy((-b + way * side * root) / (2 * a)) for way in (1, -1))
    if sign_of(slow, given) == -1 and sign_of(fast, given) == 1:
        slow, fast = fast, slow
    return Rates(slow, fast, None if sign else tidy(square / a**2))


def written(e: Expr) -> str:
    """A formula, or a number with the digits that people read."""
    return str(e) if e.names else f"{float(e):.6g}"
