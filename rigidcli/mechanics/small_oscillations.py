"""Small oscillations M y'' + C y' + K y = 0: the matrices, the rates s of exp(s t), and their vectors.

To first order in the displacement y from an equilibrium, M is the mass matrix there. Without forces beside L
or H, C is antisymmetric: it comes from terms linear in the velocities, as of magnetic fields and rotating
frames. K is the matrix of the second derivatives of the potential, with centrifugal terms. Hamilton's linear
equations z' = A z are the case M = 0, C = 1, K = -A.

Rates are the roots of det(M s^2 + C s + K). Without forces beside L or H it is a polynomial in s^2.
It is factored: factors of degree 1 and 2 have roots in closed form. Numbers are eigenvalues to some 70
digits, so that a zero mode differs from a slow one, and what neither grows nor decays from what does.

Motion stays bounded if no rate has a positive real part, and a rate without a real part has as many vectors
as its multiplicity. Where M and K are positive definite, and C is antisymmetric, all rates are imaginary.
Coordinates that do not act on each other are solved apart. Signs, and which mode is the slower one, are
those for the given values of parameters and positive ones of others.

Sources: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, sections 6.1 to 6.3, where C and
forces are missing; V. I. Arnold, Mathematical Methods of Classical Mechanics, appendix 6.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias, cast

import numpy as np

from rigidcli.algebra import matrices
from rigidcli.algebra.arithmetic import polynomial_factors, root_of_either_sign, tidy, weak_sign
from rigidcli.algebra.atoms import Atom, Group
from rigidcli.algebra.bounds import content
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients, expand
from rigidcli.algebra.expressions import ONE, PI, ZERO, Expr, number, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.matrices import Matrix
from rigidcli.algebra.simplification import shortest
from rigidcli.algebra.simplification import tidy as short_form
from rigidcli.algebra.substitution import mapped, rebuilt, substitute
from rigidcli.algebra.trees import Style
from rigidcli.algebra.values import enclosed, is_zero, sampled
from rigidcli.core.arithmetic import Array, echelon
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.lagrange_equations import LagrangeEquations
from rigidcli.mechanics.phase_space import Phase, linear

Vector: TypeAlias = "tuple[tuple[float | Expr, float | Expr], ...]"
"""The real and imaginary parts of the components."""


class LinearMotion(NamedTuple):
    """The matrices M, C and K (n by n each)."""

    masses: Matrix
    rates: Matrix
    stiffness: Matrix

    @classmethod
    def of_matrix(cls, matrix: Matrix) -> LinearMotion:
        """The motion z' = A z of coordinates q and their momenta p, without the momenta where that can be.

        With q' = A q + B p, p' = D q + E p they are p = M (q' - A q), where M = B^-1. Where B has no inverse,
        the motion stays one of first order, with M = 0, C = 1 and K = -A.
        """
        size, whole = len(matrix) // 2, _array(matrix)
        (a, b), (d, e) = (np.hsplit(rows, [size]) for rows in np.vsplit(whole, [size]))
        masses = inverse_of(b.tolist())
        if masses is None:
            one = [[ONE if i == j else ZERO for j in range(2 * size)] for i in range(2 * size)]
            return cls((0 * whole).tolist(), one, (-whole).tolist())
        back = matrices.product(e.tolist(), masses)
        rates = -_array(matrices.product(masses, a.tolist())) - _array(back)
        stiffness = _array(matrices.product(back, a.tolist())) - d
        return cls(masses, rates.tolist(), stiffness.tolist()).changed(short_form)

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

    def pencil(self, s: Expr, square: Expr) -> list[list[Expr]]:
        """M s^2 + C s + K, which takes the vector of a motion y = Re(v exp(s t)) to zero."""
        rows = zip(*self.parts, strict=True)
        return [[m * square + c * s + k for m, c, k in zip(*row, strict=True)] for row in rows]

    def changed(self, change: Callable[[Expr], Expr]) -> LinearMotion:
        """This motion with every entry of its matrices changed."""
        return LinearMotion(*([[change(e) for e in row] for row in part] for part in self.parts))

    def blocks(self) -> list[tuple[list[int], LinearMotion]]:
        """The places that act on each other, with their motion."""
        blocks = matrices.connected(
            len(self.masses), lambda i, j: any(part[i][j] or part[j][i] for part in self.parts)
        )
        return [(b, LinearMotion(*(matrices.part(part, b, b) for part in self.parts))) for b in blocks]


class Root(NamedTuple):
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


def of_lagrange(
    lagrange: LagrangeEquations, phase: Phase, velocities: Sequence[str], place: Mapping[str, Expr]
) -> LinearMotion:
    """Lagrange's equations near the equilibrium at the coordinates `place`."""
    there = {**place, **dict.fromkeys(velocities, ZERO)}

    def slopes(names: Sequence[str]) -> list[list[Expr]]:
        return [[short_form(substitute(derivative(r, name), there)) for name in names] for r in lagrange.rest]

    masses = [[short_form(substitute(entry, there)) for entry in row] for row in lagrange.matrix]
    return LinearMotion(masses, slopes(velocities), slopes(phase.coordinates))


def momenta_at_rest(velocities: Sequence[Expr], phase: Phase) -> dict[str, Expr] | None:
    """The momenta of a system at rest, as functions of the coordinates; `velocities` are dH/dp.

    None where the velocities are not linear in the momenta, and no momenta are not it, either.
    """
    parts = linear(velocities, phase.momenta)
    if parts is not None:
        inverse = inverse_of(parts[0])
        if inverse is None:
            return None
        values = [short_form(total(-a * b for a, b in zip(row, parts[1], strict=True))) for row in inverse]
        return dict(zip(phase.momenta, values, strict=True))
    still = dict.fromkeys(phase.momenta, ZERO)
    return still if all(is_zero(substitute(v, still)) for v in velocities) else None


def _array(matrix: Matrix) -> Any:
    return np.array(matrix, dtype=object)


def inverse_of(matrix: Matrix) -> Matrix | None:
    """The inverse; None where there is none, or it is too large."""
    try:
        return matrices.inverse(matrix)
    except (ExpressionError, ZeroDivisionError):
        return None


# --- the roots

S = symbol("rate s")
"""The variable of characteristic polynomials, or its square; with a blank in it, it is no document's name."""

SIGNS = 12
"""Random points at which a root must have one sign, so that few of another sign are missed."""

BITS = 256
"""Bits of numbers: 77 digits; a defective double eigenvalue keeps half of them."""

ROUNDING = 1e-22
"""Rates below this share of the largest are zero: rates of a system do not differ by so much."""

ROUNDING_OF_FLOATS = 1e-6
"""The same share where the equilibrium is known in floats: squares of rates have errors of some 1e-14."""

NOISE = 1e-12
"""Relative tolerance for equal rates, and for entries of a vector that are zero, in floats."""

INDEPENDENT = 1e-8
"""Unit vectors are dependent if their matrix has a singular value below this."""

DIGITS_OF_RATES = 10
"""Significant digits of a rate that is a decimal times an expression."""

MOST_PARTS_OF_TURN = 50
"""The largest denominator of an angle, in units of pi: chains of up to 24 equal masses have those."""

Values: TypeAlias = Mapping[str, Expr]
"""The parameters that have values, with these."""


def spectrum(
    motion: LinearMotion,
    given: Values,
    is_exact: bool,
    is_free: bool,
    rounding: float = ROUNDING,
    needs_vectors: bool = True,
) -> list[Root] | None:
    """The roots by ascending rates, with their vectors.

    They are exact where that is asked for, or there are symbols, as far as they have a closed form; else
    numbers, with this relative error of the matrices. None where symbols are without a closed form. Motion is
    `is_free` if there are no forces beside L or H. Exact roots that are simple have vectors if these are
    needed.

    Raises:
        ExpressionError: an entry has no value for the given parameters.
        ZeroDivisionError: the mass matrix is singular.
    """
    if is_exact or _has_symbols(motion):
        try:
            return _ascending(_exact_roots(motion, given, is_free, needs_vectors), given)
        except ExpressionError:
            motion = motion.changed(lambda e: substitute(e, given))
    return None if _has_symbols(motion) else _numeric_roots(motion, is_free, rounding)


def _has_symbols(motion: LinearMotion) -> bool:
    return any(e.names or e.unknown for e in motion.entries)


def sign_of(e: Expr, given: Values) -> int | None:
    """The sign that an expression has for given values, and any positive ones of other names."""
    try:
        positive = {name: symbol(name, positive=True) for name in e.names}
        sign = weak_sign(substitute(e, {**positive, **given}))
    except ExpressionError:
        return None
    return None if sign is None else sign[0]


def is_positive_definite(matrix: Matrix, given: Values) -> bool:
    """Whether a symmetric matrix is positive definite, by its leading minors."""
    sizes = range(1, len(matrix) + 1)
    minors = (matrices.short_determinant(matrices.part(matrix, range(k), range(k))) for k in sizes)
    return all(sign_of(minor, given) == 1 for minor in minors)


def _exact_roots(motion: LinearMotion, given: Values, is_free: bool, needs_vectors: bool) -> Iterator[Root]:
    """The roots in closed form. Raises ExpressionError where one has none, or is too long."""
    size = len(motion.masses)
    for block, own in motion.blocks():
        # Motion without forces is bounded by its energy, where that is positive definite. Where only M is,
        # and nothing depends on velocities, all s^2 are real.
        is_definite = is_free and is_positive_definite(own.masses, given)
        bounded = is_definite and is_positive_definite(own.stiffness, given)
        are_real = is_definite and not any(e for row in own.rates for e in row)
        try:
            roots = list(_determinant_roots(own, given, bounded, are_real))
        except ExpressionError:
            if not are_real:
                raise
            for root in _numbers_by_one_unit(own, given):
                known = [dict(zip(block, vector, strict=True)) for vector in root.vectors]
                placed = [tuple(vector.get(k, (ZERO, ZERO)) for k in range(size)) for vector in known]
                yield root._replace(vectors=tuple(placed))
            continue
        for root in roots:
            if not needs_vectors and (root.times == 1 or root.growth):
                yield root
                continue
            vectors, count = _null_vectors(own, root)
            if not vectors or 1 < count < len(vectors):
                # Of several complex vectors it is open which are multiples of others.
                raise ExpressionError("the vectors have no closed form")
            is_whole = count == root.times or bool(root.growth)
            inside = (cast(Expr, root.growth) + cast(Expr, root.angular)).everywhere()
            written = {expand(atom.inner): atom.inner for atom in inside if isinstance(atom, Group)}
            placed = []
            for vector in vectors[:count]:
                pairs = dict(zip(block, _from_first(vector, len(block)), strict=True))
                shown = {k: (_with_radicands(re, written), im) for k, (re, im) in pairs.items()}
                placed.append(tuple(shown.get(k, (ZERO, ZERO)) for k in range(size)))
            stable = root.is_stable and is_whole
            yield root._replace(is_stable=stable, is_whole=is_whole, vectors=tuple(placed))


def _numbers_by_one_unit(motion: LinearMotion, given: Values) -> Iterator[Root]:
    """The roots of M y'' + K y = 0 whose matrices are numbers times one expression each, where none grows.

    Rates are sqrt(k/m) times numbers: 2 sin(pi p/q), as those of a chain of equal masses, or decimals.

    Raises:
        ExpressionError: the matrices are others.
    """
    units, numbers = zip(*(_by_unit(matrix) for matrix in (motion.masses, motion.stiffness)), strict=True)
    unit = positive_root(tidy(units[1] / units[0]), given)
    if not unit.names:
        raise ExpressionError("there are no symbols")
    plain = LinearMotion(numbers[0], motion.rates, numbers[1])
    for root in _numeric_roots(plain, is_free=True, rounding=ROUNDING):
        if root.growth:
            raise ExpressionError("motion grows")
        factor = _as_sine(cast(float, root.angular), plain)
        if factor is None:
            decimal = Fraction(f"{root.angular:.{DIGITS_OF_RATES}g}")
            rate = (decimal * unit).styled(Style(decimal=True))
        else:
            rate = factor * unit
        yield root._replace(growth=ZERO, angular=rate)


def _by_unit(matrix: Matrix) -> tuple[Expr, Matrix]:
    """A matrix as an expression times integers without a common divisor.

    Raises ExpressionError where it is none.
    """
    first = next(e for row in matrix for e in row if e)
    ratios = [[tidy(e / first).as_number for e in row] for row in matrix]
    known = [ratio for row in ratios for ratio in row if ratio is not None]
    if len(known) < len(matrix) ** 2:
        raise ExpressionError("the entries depend on more than one unit")
    size = content([ratio for ratio in known if ratio])
    return first * size, [[number((ratio or 0) / size) for ratio in row] for row in ratios]


def _as_sine(angular: float, motion: LinearMotion) -> Expr | None:
    """The rate 2 sin(pi p/q) that is near, where its square is an eigenvalue of numbers M and K; or None."""
    if angular > 2:
        return None
    turn = Fraction(math.asin(angular / 2) / math.pi).limit_denominator(MOST_PARTS_OF_TURN)
    sine = 2 * apply("sin", PI * turn)
    if abs(float(sine) - angular) > NOISE:
        return None
    return sine if is_zero(matrices.short_determinant(motion.pencil(ZERO, -(sine**2)))) else None


def _ascending(roots: Iterator[Root], given: Values) -> list[Root]:
    unordered = list(roots)
    rates = [rate for root in unordered if isinstance(rate := root.rate, Expr)]
    sizes = sampled(rates, {name: float(value) for name, value in given.items()}, count=1)
    order = range(len(unordered)) if sizes is None else sizes[0].argsort(kind="stable")
    return [unordered[place] for place in order]


def _determinant_roots(motion: LinearMotion, given: Values, bounded: bool, are_real: bool) -> Iterator[Root]:
    """The roots of det(M s^2 + C s + K).

    That all of them are imaginary says `bounded`, and that their squares `are_real` where M is definite.
    """
    determinant = matrices.short_determinant(motion.pencil(S, S**2))
    powers = coefficients(determinant, [str(S)]) or {}
    if not motion.is_of_first_order and is_zero(powers.get((2 * len(motion.masses),), ZERO)):
        raise ZeroDivisionError
    is_even = all(k % 2 == 0 for (k,) in powers)
    if is_even:
        determinant = total(e * S ** (k // 2) for (k,), e in powers.items())
    for factor, times in polynomial_factors(determinant, str(S)):
        is_square = is_even or all(k % 2 == 0 for k in factor)
        step = 2 if is_square and not is_even else 1
        if max(factor) > 2 * step:
            raise ExpressionError("a factor of high degree has no closed form")
        c, b, a = (factor.get(k * step, ZERO) for k in range(3))
        roots = _of_squares(a, b, c, given, bounded, are_real) if is_square else _damped(a, b, c, given)
        for root in roots:
            is_twice = is_square and not root.growth and not root.angular
            yield root._replace(times=2 * times if is_twice else times, is_paired=is_square)


def positive_root(square: Expr, given: Values) -> Expr:
    """The root of a square that no positive parameters make zero, in its shortest form."""
    free = root_of_either_sign(square)
    sizes = sampled([free], {name: float(value) for name, value in given.items()}, count=SIGNS)
    root = square ** Fraction(1, 2)
    if sizes is None or sizes.min() < 0 < sizes.max():
        return root
    return shortest([root, tidy(free if sizes.min() >= 0 else -free)])


def _of_square(square: Expr, given: Values, sign: int | None = None) -> Root:
    """The root of s^2 = `square`; where the sign of that is open, it is taken to oscillate."""
    if not square:
        return Root(ZERO, ZERO, None)
    sign = sign_of(square, given) if sign is None else sign
    if sign == 0:
        raise ExpressionError("for the given values it vanishes, and not for others")
    if sign == 1:
        return Root(positive_root(square, given), ZERO, False)
    angular = positive_root(-square, given)
    return Root(ZERO, angular, True) if sign else Root(ZERO, angular, None, tidy(-square))


def _of_squares(a: Expr, b: Expr, c: Expr, given: Values, bounded: bool, definite: bool) -> list[Root]:
    """The roots of a s^4 + b s^2 + c = 0; both s^2 are taken to be real where that is open.

    They are real, and a is positive, where M is `definite` and the energy is that of coordinates at rest.
    """
    if not a:
        return [_of_square(tidy(-c / b), given, -1 if bounded else None)]
    a, b, c = map(tidy, (a, b, c))
    # s^2 = mean -+ sqrt(rest)/(2 a); the product of both is c/a. Signs are 1, -1, 0, or None where open.
    mean, rest = tidy(-b / (2 * a)), tidy(b**2 - 4 * a * c)
    of_product, of_mean = (1, -1) if bounded else (sign_of(c / a, given), sign_of(mean, given))
    of_rest = 1 if bounded or definite or of_product == -1 else sign_of(rest, given)
    if of_rest == 0:
        raise ExpressionError("it depends on symbols whether roots are equal")
    if of_rest == -1:
        # s = growth -+ i angular, with growth^2 - angular^2 = mean and growth^2 + angular^2 = sqrt(c/a)
        size = positive_root(tidy(c / a), given)
        growth, angular = (positive_root(tidy((size + side * mean) / 2), given) for side in (1, -1))
        return [Root(growth, angular, False)]
    width = positive_root(rest, given)
    larger, smaller = (
        shortest([(-b + side * width) / (2 * a), tidy((-b + side * width) / (2 * a))]) for side in (1, -1)
    )
    if definite and of_product is None and of_mean:
        # One s^2 has the sign of the mean; the other one is negative where the product has the other sign.
        sure, open_ = (smaller, larger) if of_mean < 0 else (larger, smaller)
        known = _of_square(sure, given, of_mean)
        other = Root(ZERO, positive_root(-open_, given), None, tidy(-of_mean * c / a))
        pair = [other, known] if of_mean < 0 else [known, other]
    elif of_product == -1:
        pair = [_of_square(larger, given, 1), _of_square(smaller, given, -1)]
    else:
        sign = of_mean if of_rest and of_product == 1 else None
        pair = [_of_square(square, given, sign) for square in (larger, smaller)]
    if not of_rest:
        condition = tidy(rest / (4 * a**2))
        pair = [r._replace(is_stable=None, condition=condition) if r.is_stable else r for r in pair]
    both_oscillate = of_product == 1 and not any(root.growth for root in pair)
    return _in_shorter_form(pair, mean, tidy(c / a), given) if both_oscillate else pair


def _in_shorter_form(pair: Sequence[Root], mean: Expr, product: Expr, given: Values) -> list[Root]:
    """Two roots that oscillate, whose squares have this mean and product, in the shorter one of two forms.

    With m = -mean and r^2 = product, sqrt(m - d) = sqrt((m + r)/2) - sqrt((m - r)/2) where r^2 = m^2 - d^2.
    Both oscillate for m > r.
    """
    size = positive_root(product, given)
    limit = None if pair[0].is_stable else tidy(-mean - size)
    first, second = (positive_root(tidy((side * size - mean) / 2), given) for side in (1, -1))
    forms = tidy(first - second), tidy(first + second)
    return [
        root._replace(angular=shortest([cast(Expr, root.angular), form]), condition=limit)
        for root, form in zip(pair, forms, strict=True)
    ]


def _damped(a: Expr, b: Expr, c: Expr, given: Values) -> list[Root]:
    """The roots of a s^2 + b s + c: real ones, or one of two that are complex."""
    if not a:
        middle, discriminant = tidy(-c / b), ZERO
    else:
        middle, discriminant = tidy(-b / (2 * a)), tidy((b**2 - 4 * a * c) / (4 * a**2))
    sign, decay = sign_of(discriminant, given), sign_of(middle, given)
    if decay is not None and (sign is None or sign < 0):
        condition = None if sign else -discriminant
        return [Root(middle, positive_root(-discriminant, given), decay <= 0, condition)]
    width = positive_root(discriminant, given) if sign else ZERO
    values = [tidy(middle + side * width) for side in ((1, -1) if sign else (1,))]
    signs = [sign_of(value, given) for value in values]
    if decay is None or None in signs:
        raise ExpressionError("it depends on symbols whether motion decays")
    return [Root(value, ZERO, sign < 0 if sign else None) for value, sign in zip(values, signs, strict=True)]


def _null_vectors(motion: LinearMotion, root: Root) -> tuple[list[list[Expr]], int]:
    """What M s^2 + C s + K takes to zero, as real vectors, or real parts before imaginary ones; how many."""
    growth: Any = root.growth
    angular: Any = root.angular
    square, double = tidy(growth**2 - angular**2), tidy(2 * growth * angular)
    rows = list(zip(*motion.parts, strict=True))
    real = [[tidy(m * square + c * growth + k) for m, c, k in zip(*row, strict=True)] for row in rows]
    imaginary = [[tidy(m * double + c * angular) for m, c, _ in zip(*row, strict=True)] for row in rows]
    if not any(e for row in imaginary for e in row):
        vectors = matrices.null_vectors(real)
        return vectors, len(vectors)
    # For x + i y it is A x - B y = 0 and B x + A y = 0, which has each solution a second time, times i.
    both = [[*x, *(-e for e in y)] for x, y in zip(real, imaginary, strict=True)]
    both += [[*y, *x] for x, y in zip(real, imaginary, strict=True)]
    vectors = matrices.null_vectors(both)
    return vectors, len(vectors) // 2


def _from_first(vector: Sequence[Expr], size: int) -> list[tuple[Expr, Expr]]:
    """A vector of this size over its first entry that is not zero."""
    if len(vector) == size:
        first = next(e for e in vector if e)
        return [(tidy(e / first), ZERO) for e in vector]
    pairs = list(zip(vector[:size], vector[size:], strict=True))
    re, im = next((re, im) for re, im in pairs if re or im)
    square = re**2 + im**2
    return [(tidy((x * re + y * im) / square), tidy((y * re - x * im) / square)) for x, y in pairs]


def _with_radicands(e: Expr, written: Mapping[Expr, Expr]) -> Expr:
    """An expression with its sums as they are `written`, so that vectors have the roots of their rate.

    The keys are the sums multiplied out.
    """

    def change(atom: Atom) -> Expr | None:
        if not isinstance(atom, Group):
            return None
        return written.get(expand(atom.inner)) or rebuilt(atom, lambda e: _with_radicands(e, written))

    return mapped(e, change) if written else e


def _numeric_roots(motion: LinearMotion, is_free: bool, rounding: float) -> list[Root]:
    """The roots of motion whose matrices are exact numbers, by ascending rates.

    Raises:
        ZeroDivisionError: the mass matrix is singular.
    """
    from flint import acb, acb_mat, ctx

    with ctx.workprec(BITS):
        matrix, is_square = _companion(motion, is_free)
        values, vectors = acb_mat(matrix).eig(right=True, algorithm="approx")
        if is_square:
            # What is left beside a negative square is rounding; the root of it would be of either sign.
            real = [abs(value.imag) <= rounding * abs(value) for value in values]
            values = [acb(v.real if is_real else v).sqrt() for v, is_real in zip(values, real, strict=True)]
        # Of coordinates in different units, entries are compared in units of 1/sqrt(M_ii).
        sizes = [abs(enclosed(row[i], {}, BITS)) for i, row in enumerate(motion.masses)]
        weights = [size.sqrt() if size != 0 else size + 1 for size in sizes]
        rows = [[vectors[i, j] * w for i, w in enumerate(weights)] for j in range(len(values))]
        columns = np.array([[complex(e / max(map(abs, row))) for e in row] for row in rows])
        rates = np.array(list(map(complex, values)))
    rates[np.abs(rates) <= rounding * np.abs(rates).max()] = 0
    for part in (rates.real, rates.imag):
        part[np.abs(part) <= rounding * np.abs(rates)] = 0
    roots, left = list[Root](), list(range(len(rates)))
    while left:
        rate = complex(rates[left[0]])
        group = [k for k in left if abs(rates[k] - rate) <= max(rounding, NOISE) * abs(rate)]
        left = [k for k in left if k not in group]
        if rate.imag < 0 or ((is_free or is_square) and rate.real < 0):
            continue
        units = columns[group] / np.linalg.norm(columns[group], axis=1, keepdims=True)
        rank = int((np.linalg.svd(units, compute_uv=False) > INDEPENDENT).sum())
        times = 2 * len(group) if is_square and not rate else len(group)
        # With fewer vectors than there are equal roots, motion grows by powers of the time.
        whole = bool(rate.real) or rank == times
        stable = None if not rate else rate.real < 0 or (not rate.real and whole)
        shown = tuple(_independent(units, rank, np.array(list(map(float, weights)))))
        roots.append(Root(rate.real, rate.imag, stable, None, times, whole, is_free or is_square, shown))
    return sorted(roots, key=lambda root: (root.rate, root.angular))


def _companion(motion: LinearMotion, is_free: bool) -> tuple[Any, bool]:
    """A matrix whose eigenvalues are the roots; or their squares, where nothing depends on velocities."""
    from flint import arb_mat

    def balls(matrix: Matrix) -> Any:
        known = {e: enclosed(e, {}, BITS).mid() for row in matrix for e in {*row}}
        return arb_mat([[known[e] for e in row] for row in matrix])

    masses, rates, stiffness = map(balls, motion.parts)
    if motion.is_of_first_order:
        return -stiffness, False
    back, damping, size = masses.solve(stiffness), masses.solve(rates), len(motion.masses)
    if is_free and not any(e for row in motion.rates for e in row):
        return -back, True
    rows = [[int(j == i + size) for j in range(2 * size)] for i in range(size)]
    rows += [[-part[i, j] for part in (back, damping) for j in range(size)] for i in range(size)]
    return arb_mat(rows), False


def _independent(rows: Array, rank: int, weights: Array) -> Iterator[Vector]:
    reduced = echelon(rows, rank, INDEPENDENT)[0][:rank]
    for part in (reduced.real, reduced.imag):
        part[np.abs(part) <= NOISE * np.abs(reduced).max(axis=1, keepdims=True)] = 0.0
    for row in reduced / weights:
        first = np.flatnonzero(row)[0]
        row /= row[first]
        row[first] = 1.0
        yield tuple((float(e.real), float(e.imag)) for e in row)
