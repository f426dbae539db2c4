"""Normal modes in symbols, where the characteristic polynomial det(M s^2 + C s + K) factors.

Freedoms that do not act on each other are worked apart. Of each factor of the polynomial, quadratic and
biquadratic ones have roots in closed form. Signs, and which mode is the slower one, are those for the given
values of parameters and random positive ones of others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

from rigidcli.algebra import matrices, samples
from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.arithmetic import MAX_STEPS, root_of_either_sign, tidy
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ZERO, Expr, total
from rigidcli.algebra.fractions import factors
from rigidcli.algebra.simplification import shortest
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.normal_modes import Mode, Pair
from rigidcli.mechanics.small_oscillations import LinearMotion, S, pencil
from rigidcli.mechanics.symbolic_spectrum import sign_of

LARGEST = 6
"""The most freedoms that act on each other and are worked in symbols: more have no factors as a rule."""

SIGNS = 12
"""Random points at which a root must have one sign, so that few of another sign are missed."""


class Root(NamedTuple):
    """The real and the imaginary part of s, whether motion is bounded, and where it is so, as in `Mode`."""

    growth: Expr
    angular: Expr
    is_stable: bool | None
    condition: Expr | None = None


def symbolic_modes(motion: LinearMotion, fixed: Mapping[str, Expr]) -> list[Mode] | None:
    """The modes, by ascending rates; None where the polynomial does not factor."""
    size = len(motion.masses)
    parts = motion.parts
    blocks = matrices.connected(
        size, lambda i, j: any(not (part[i][j].is_zero and part[j][i].is_zero) for part in parts)
    )
    modes: list[Mode] = []
    for block in blocks:
        own = LinearMotion(*(matrices.part(part, block, block) for part in parts))
        try:
            found = _of_block(own, fixed)
        except ExpressionError:
            return None
        if found is None:
            return None
        for mode in found:
            whole: list[Pair] = [(ZERO, ZERO)] * size
            for place, entry in zip(block, mode.vector, strict=True):
                whole[place] = entry
            modes.append(replace(mode, vector=tuple(whole)))
    rates = [rate for mode in modes if isinstance(rate := mode.rate, Expr)]
    known = {name: float(value) for name, value in fixed.items()}
    sizes = samples.values(rates, known, count=1)
    order = range(len(modes)) if sizes is None else sizes[0].argsort(kind="stable")
    return [modes[place] for place in order]


def _of_block(motion: LinearMotion, fixed: Mapping[str, Expr]) -> list[Mode] | None:
    if len(motion.masses) > LARGEST:
        return None
    matrix = pencil(motion, S)
    determinant = matrices.determinant(matrix)
    modes = []
    for factor, power in factors(determinant, Allowance(MAX_STEPS)):
        if not S.names <= factor.names or power < 1:
            continue
        roots = _roots(factor, fixed)
        if roots is None:
            return None
        for root in roots:
            found = list(_modes(motion, root, power))
            if not found:
                return None
            modes += found
    return modes


def _roots(factor: Expr, fixed: Mapping[str, Expr]) -> list[Root] | None:
    """The roots of a factor of the polynomial with Im s >= 0, of s and -s one; None without a closed form."""
    found = coefficients(factor, sorted(S.names))
    if found is None:
        return None
    by_power = {powers[0]: value for powers, value in found.items()}
    highest = max(by_power)
    a, b, c = (by_power.get(highest * k // 2, ZERO) for k in (2, 1, 0))
    if highest == 1:
        s = tidy(-by_power.get(0, ZERO) / by_power[1])
        sign = sign_of(s, fixed)
        return None if sign is None else [Root(s, ZERO, sign < 0 if sign else None)]
    if highest not in (2, 4) or not by_power.keys() <= {0, highest // 2, highest}:
        return None
    if highest == 2 and not b.is_zero:
        return _damped(a, b, c, fixed)
    if highest == 2:
        return [_of_square(tidy(-c / a), fixed)]
    return _biquadratic(a, b, c, fixed)


def _of_square(square: Expr, fixed: Mapping[str, Expr], sign: int | None = None) -> Root:
    """The root of s^2 = `square`; where the sign of that is open, it is taken to oscillate."""
    sign = sign_of(square, fixed) if sign is None else sign
    if sign == 1:
        return Root(_shortest_root(square, fixed), ZERO, False)
    angular = _shortest_root(-square, fixed)
    return Root(ZERO, angular, True) if sign else Root(ZERO, angular, None, tidy(-square))


def _biquadratic(a: Expr, b: Expr, c: Expr, fixed: Mapping[str, Expr]) -> list[Root] | None:
    """The roots of a s^4 + b s^2 + c, of which both s^2 are real, or taken to be so where that is open."""
    middle, discriminant = tidy(-b / (2 * a)), tidy((b**2 - 4 * a * c) / (4 * a**2))
    are_real = sign_of(discriminant, fixed)
    if are_real in (0, -1):
        return None
    width = _positive_root(discriminant, fixed)
    # Of two squares with a positive product both have the sign of their mean, else one has either.
    product, mean = sign_of(c / a, fixed), sign_of(middle, fixed)
    signs = (mean, mean) if are_real and product == 1 else (1, -1) if product == -1 else (None, None)
    roots = [
        _of_square(tidy(middle + side * width), fixed, sign)
        for side, sign in zip((1, -1), signs, strict=True)
    ]
    if not are_real:
        open_ones = [root._replace(is_stable=None, condition=discriminant) for root in roots]
        roots = [open_ if root.is_stable else root for root, open_ in zip(roots, open_ones, strict=True)]
    if product != 1 or any(root.growth for root in roots):
        return roots
    # sqrt(m - d) = sqrt((m + r)/2) - sqrt((m - r)/2), where r^2 = m^2 - d^2, may be shorter, and m > r is
    # what both oscillate for.
    size = _positive_root(tidy(c / a), fixed)
    condition = None if roots[0].is_stable else tidy(-middle - size)
    first, second = (_positive_root(tidy((side * size - middle) / 2), fixed) for side in (1, -1))
    forms = tidy(first - second), tidy(first + second)
    return [
        root._replace(angular=shortest([root.angular, form]), condition=condition)
        for root, form in zip(roots, forms, strict=True)
    ]


def _damped(a: Expr, b: Expr, c: Expr, fixed: Mapping[str, Expr]) -> list[Root] | None:
    """The roots of a s^2 + b s + c: two real ones, or one of two that are complex."""
    middle, discriminant = tidy(-b / (2 * a)), tidy((b**2 - 4 * a * c) / (4 * a**2))
    sign, decay = sign_of(discriminant, fixed), sign_of(middle, fixed)
    if decay is None:
        return None
    if sign is None or sign < 0:
        condition = None if sign else -discriminant
        return [Root(middle, _shortest_root(-discriminant, fixed), decay <= 0, condition)]
    width = _positive_root(discriminant, fixed) if sign else ZERO
    values = [tidy(middle + side * width) for side in ((1, -1) if sign else (1,))]
    signs = [sign_of(value, fixed) for value in values]
    if None in signs:
        return None
    pairs = zip(values, signs, strict=True)
    return [Root(value, ZERO, own < 0 if own else None) for value, own in pairs if own is not None]


def _positive_root(square: Expr, fixed: Mapping[str, Expr]) -> Expr:
    """The root of a square that no positive parameters make zero: its sign at one point is that at all."""
    free = root_of_either_sign(square)
    sizes = samples.values([free], {name: float(value) for name, value in fixed.items()}, count=SIGNS)
    if sizes is None or sizes.min() < 0 < sizes.max():
        return square ** Fraction(1, 2)
    return tidy(free if sizes.min() >= 0 else -free)


def _shortest_root(square: Expr, fixed: Mapping[str, Expr]) -> Expr:
    """The same in its shortest form."""
    return shortest([square ** Fraction(1, 2), _positive_root(square, fixed)])


def _modes(motion: LinearMotion, root: Root, power: int) -> Iterator[Mode]:
    """The modes of one root, that many times of the polynomial, with their vectors."""
    growth, angular, is_stable, condition = root
    if not angular or (not growth and all(e.is_zero for row in motion.rates for e in row)):
        # M s^2 + C s + K is real.
        s2, s = (growth**2, growth) if not angular else (-(angular**2), ZERO)
        matrix = [
            [tidy(m * s2 + c * s + k) for m, c, k in zip(*row, strict=True)]
            for row in zip(*motion.parts, strict=True)
        ]
        vectors = [[(e, ZERO) for e in vector] for vector in matrices.null_vectors(matrix)]
    else:
        vectors = _complex_vectors(motion, growth, angular)
    is_whole = len(vectors) == power
    for vector in vectors:
        bounded = is_stable and (is_whole or bool(growth))
        yield Mode(growth, angular, tuple(_from_first(vector)), bounded, condition)


def _complex_vectors(motion: LinearMotion, growth: Expr, angular: Expr) -> list[list[tuple[Expr, Expr]]]:
    """Vectors x + i y that A + i B takes to zero: A x - B y = 0 and B x + A y = 0."""
    real, imaginary = tidy(growth**2 - angular**2), tidy(2 * growth * angular)
    rows = list(zip(*motion.parts, strict=True))
    a = [[tidy(m * real + c * growth + k) for m, c, k in zip(*row, strict=True)] for row in rows]
    b = [[tidy(m * imaginary + c * angular) for m, c, _ in zip(*row, strict=True)] for row in rows]
    both = [[*x, *(-e for e in y)] for x, y in zip(a, b, strict=True)]
    both += [[*y, *x] for x, y in zip(a, b, strict=True)]
    found = matrices.null_vectors(both)
    size = len(rows)
    # Each vector is found twice, the second time times i.
    return [list(zip(v[:size], v[size:], strict=True)) for v in found[:1]] if len(found) == 2 else []


def _from_first(vector: Sequence[tuple[Expr, Expr]]) -> Iterator[tuple[Expr, Expr]]:
    """The vector over its first entry that is not zero."""
    re, im = next((re, im) for re, im in vector if re or im)
    size = re**2 + im**2
    for x, y in vector:
        yield tidy(total([x * re, y * im]) / size), tidy(total([y * re, -(x * im)]) / size)
