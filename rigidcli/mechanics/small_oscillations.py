"""Small oscillations M y'' + C y' + K y = 0: the matrices, the rates s of exp(s t), and their vectors.

To first order in the displacement y from an equilibrium, M is the mass matrix there, and K has the second
derivatives of the potential, with centrifugal terms. Without forces beside L or H, C is antisymmetric, as
from magnetic fields and rotating frames. Hamilton's linear equations z' = A z are the case M = 0, C = 1,
K = -A. Coordinates that do not act on each other are solved apart.

Rates are the roots of det(M s^2 + C s + K), without forces beside L or H a polynomial in s^2. Its factors of
degree 1 and 2 have roots in closed form. Numbers are eigenvalues to some 70 digits, so that a zero mode
differs from a slow one, and what neither grows nor decays from what does.

Motion stays bounded if no rate has a positive real part, and a rate without a real part has as many vectors
as its multiplicity. Where M and K are positive definite, and C is antisymmetric, all rates are imaginary.
Signs, and which mode is the slower one, are those for the given parameters and positive values of others.

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
from rigidcli.algebra.arithmetic import polynomial_factors, root_of_either_sign, tidy, tidy_array, weak_sign
from rigidcli.algebra.atoms import Atom, Group
from rigidcli.algebra.bounds import content
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients, expand
from rigidcli.algebra.expressions import PI, ZERO, Expr, number, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.simplification import shortest
from rigidcli.algebra.simplification import tidy as short_form
from rigidcli.algebra.substitution import mapped, rebuilt, substitute
from rigidcli.algebra.trees import Style
from rigidcli.algebra.values import enclosed, is_zero, sampled
from rigidcli.core.arithmetic import Array, Floats, echelon
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.lagrange_equations import LagrangeEquations
from rigidcli.mechanics.phase_space import Phase, linear

Vector: TypeAlias = Array  # the real and the imaginary part of each entry (n by 2)


def _array(rows: Sequence[Any]) -> Array:
    return np.array(rows, dtype=object)


class LinearMotion(NamedTuple):
    """The matrices M, C and K (n by n each)."""

    masses: Array
    rates: Array
    stiffness: Array

    @classmethod
    def of_matrix(cls, matrix: Array) -> LinearMotion:
        """The motion z' = A z of coordinates q and their momenta p, without the momenta where that can be.

        With q' = A q + B p, p' = D q + E p they are p = M (q' - A q), where M = B^-1. Where B has no inverse,
        the motion stays one of first order, with M = 0, C = 1 and K = -A.
        """
        halves = (part for rows in np.split(matrix, 2) for part in np.split(rows, 2, axis=1))
        a, b, d, e = (part.tolist() for part in halves)
        masses = matrices.inverse(b)
        if masses is None:
            zero = 0 * matrix
            return cls(zero, zero + np.eye(len(matrix), dtype=int).astype(object), -matrix)
        back = matrices.product(e, masses)
        rates = -_array(matrices.product(masses, a)) - _array(back)
        return cls(_array(masses), rates, _array(matrices.product(back, a)) - _array(d)).changed(short_form)

    @property
    def entries(self) -> list[Expr]:
        """All entries of the matrices."""
        return [e for part in self for e in part.flat]

    @property
    def is_of_first_order(self) -> bool:
        """Whether there are no second derivatives."""
        return not self.masses.any()

    def pencil(self, s: Expr, square: Expr) -> Array:
        """M s^2 + C s + K, which takes the vector of a motion y = Re(v exp(s t)) to zero."""
        sums: Array = self.masses * square + self.rates * s + self.stiffness
        return sums

    def changed(self, change: Callable[[Expr], Expr]) -> LinearMotion:
        """This motion with every entry of its matrices changed."""
        of_each: Any = np.frompyfunc(change, 1, 1)
        return LinearMotion(*map(of_each, self))

    def blocks(self) -> list[tuple[list[int], LinearMotion]]:
        """The places that act on each other, with their motion."""
        found = matrices.connected(len(self.masses), lambda i, j: any(e[i, j] or e[j, i] for e in self))
        return [(block, LinearMotion(*(part[np.ix_(block, block)] for part in self))) for block in found]


class Root(NamedTuple):
    """A root s = `growth` + i `angular` of the determinant (1/s), negative growth being decay.

    `is_stable` is None of a zero mode, which drifts to another equilibrium, and where the signs of symbols
    decide: the root is that for a positive `condition`. A root that counts several `times` has as many
    vectors if it `is_whole`. Two conjugate roots are given once, with `angular` >= 0, and where -s is a root
    with s (`is_paired`), so are these, with the growth.
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


def _over_first(vector: Vector) -> Vector:
    """A vector over its first entry that is not zero, in a short form."""
    x, y = vector.T
    re, im = next(entry for entry in vector if entry.any())
    quotient = np.column_stack([x * re + y * im, y * re - x * im]) / (re**2 + im**2)
    return tidy_array(quotient) if vector.dtype == object else quotient


def of_lagrange(
    lagrange: LagrangeEquations, phase: Phase, velocities: Sequence[str], place: Mapping[str, Expr]
) -> LinearMotion:
    """Lagrange's equations near the equilibrium at the coordinates `place`."""
    there = {**place, **dict.fromkeys(velocities, ZERO)}
    rates, stiffness = (
        [[derivative(r, name) for name in names] for r in lagrange.rest]
        for names in (velocities, phase.coordinates)
    )
    motion = LinearMotion(_array(lagrange.matrix), _array(rates), _array(stiffness))
    return motion.changed(lambda e: short_form(substitute(e, there)))


def momenta_at_rest(velocities: Sequence[Expr], phase: Phase) -> dict[str, Expr] | None:
    """The momenta of a system at rest, as functions of the coordinates; `velocities` are dH/dp.

    None where the velocities are not linear in the momenta, and no momenta are not it, either.
    """
    parts = linear(velocities, phase.momenta)
    if parts is None:
        still = dict.fromkeys(phase.momenta, ZERO)
        return still if all(is_zero(substitute(v, still)) for v in velocities) else None
    inverse = matrices.inverse(parts[0])
    if inverse is None:
        return None
    values = (short_form(-e) for e in matrices.times(inverse, parts[1]))
    return dict(zip(phase.momenta, values, strict=True))


# --- the roots

S = symbol("rate s")  # the variable of characteristic polynomials: no name in a document has a blank
SIGNS = 12  # random points at which a root must have one sign
BITS = 256  # bits of numbers: 77 digits; a defective double eigenvalue keeps half of them
ROUNDING = 1e-22  # rates of numbers below this share of the largest are zero
ROUNDING_OF_FLOATS = 1e-6  # the same where the place is known in floats: squares of rates are right to 1e-14
NOISE = 1e-12  # relative tolerance for equal rates, and for entries of a vector that are zero, in floats
INDEPENDENT = 1e-8  # unit vectors are dependent if their matrix has a singular value below this
DIGITS_OF_RATES = 10  # significant digits of a rate that is a decimal times an expression
MOST_PARTS_OF_TURN = 50  # the largest denominator of an angle in units of pi, for chains of up to 24 masses
Values: TypeAlias = Mapping[str, Expr]  # the parameters that have values, with these


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
    `is_free` if there are no forces beside L or H. Exact simple roots have vectors if these are needed.

    Raises ExpressionError where an entry has no value for the given parameters, and ZeroDivisionError for a
    singular mass matrix.
    """
    if is_exact or _has_symbols(motion):
        try:
            roots = list(_exact_roots(motion, given, is_free, needs_vectors))
            sizes = _samples([cast(Expr, root.rate) for root in roots], given, 1)
            return roots if sizes is None else [roots[k] for k in sizes[0].argsort(kind="stable")]
        except ExpressionError:
            motion = motion.changed(lambda e: substitute(e, given))
    return None if _has_symbols(motion) else _numeric_roots(motion, is_free, rounding)


def _has_symbols(motion: LinearMotion) -> bool:
    return any(e.names or e.unknown for e in motion.entries)


def _samples(expressions: Sequence[Expr], given: Values, count: int) -> Floats | None:
    """Values of expressions at some points (count by n), with the given parameters, and positive others."""
    return sampled(expressions, {name: float(value) for name, value in given.items()}, count)


def sign_of(e: Expr, given: Values) -> int | None:
    """The sign that an expression has for given values, and any positive ones of other names."""
    try:
        positive = {name: symbol(name, positive=True) for name in e.names}
        sign = weak_sign(substitute(e, {**positive, **given}))
    except ExpressionError:
        return None
    return None if sign is None else sign[0]


def _is_positive_definite(matrix: Array, given: Values) -> bool:
    """Whether a symmetric matrix is known to be positive definite, by its leading minors."""
    sizes = range(1, len(matrix) + 1)
    minors = (matrices.short_determinant(matrix[:size, :size].tolist()) for size in sizes)
    try:
        return all(sign_of(minor, given) == 1 for minor in minors)
    except ExpressionError:  # they are too large
        return False


def _exact_roots(motion: LinearMotion, given: Values, is_free: bool, needs_vectors: bool) -> Iterator[Root]:
    """The roots in closed form. Raises ExpressionError where one has none, or is too long."""
    size = len(motion.masses)
    for block, own in motion.blocks():
        # Motion without forces is bounded by its energy, where that is positive definite. Where only M is,
        # and nothing depends on velocities, all s^2 are real.
        is_definite = is_free and _is_positive_definite(own.masses, given)
        bounded = is_definite and _is_positive_definite(own.stiffness, given)
        are_real = is_definite and not own.rates.any()
        try:
            roots = list(_determinant_roots(own, given, bounded, are_real))
        except ExpressionError:
            if not are_real:
                raise
            roots = list(_numbers_by_one_unit(own, given))
        else:
            roots = [
                _with_vectors(own, root) if needs_vectors or (root.times > 1 and not root.growth) else root
                for root in roots
            ]
        for root in roots:
            yield root._replace(vectors=tuple(_placed(vector, block, size) for vector in root.vectors))


def _placed(vector: Vector, block: Sequence[int], size: int) -> Vector:
    """A vector of so many entries, with zeros outside of a block."""
    whole = np.full((size, 2), ZERO if vector.dtype == object else 0.0)
    whole[block] = vector
    return whole


def _numbers_by_one_unit(motion: LinearMotion, given: Values) -> Iterator[Root]:
    """The roots of M y'' + K y = 0 whose matrices are numbers times one expression each, where none grows.

    Rates are sqrt(k/m) times numbers: 2 sin(pi p/q), as those of a chain of equal masses, or decimals.
    Raises ExpressionError for other matrices.
    """
    (mass, masses), (spring, stiffness) = map(_by_unit, (motion.masses, motion.stiffness))
    unit = positive_root(tidy(spring / mass), given)
    if not unit.names:
        raise ExpressionError("there are no symbols")
    plain = LinearMotion(masses, motion.rates, stiffness)
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


def _by_unit(matrix: Array) -> tuple[Expr, Array]:
    """A matrix as an expression times integers without a common divisor; ExpressionError if it is none."""
    first = next(filter(None, matrix.flat))
    ratios = [tidy(e / first).as_number for e in matrix.flat]
    known = [ratio for ratio in ratios if ratio is not None]
    if len(known) < len(ratios):
        raise ExpressionError("the entries depend on more than one unit")
    size = content(list(filter(None, known)))
    return first * size, _array([number(ratio / size) for ratio in known]).reshape(matrix.shape)


def _as_sine(angular: float, motion: LinearMotion) -> Expr | None:
    """The rate 2 sin(pi p/q) that is near, where its square is an eigenvalue of numbers M and K; or None."""
    if angular > 2:
        return None
    turn = Fraction(math.asin(angular / 2) / math.pi).limit_denominator(MOST_PARTS_OF_TURN)
    sine = 2 * apply("sin", PI * turn)
    if abs(float(sine) - angular) > NOISE:
        return None
    value = total(c * sine ** (2 * k) for k, c in enumerate(_characteristic(motion)))
    return sine if is_zero(value) else None


def _characteristic(motion: LinearMotion) -> list[Fraction]:
    """The coefficients of det(M^-1 K - x), by ascending powers of x, where M and K are numbers."""
    from flint import fmpq, fmpq_mat

    def rational(matrix: Array) -> Any:
        entries = [Fraction(e.as_number or 0) for e in matrix.flat]
        return fmpq_mat(len(matrix), len(matrix), [fmpq(x.numerator, x.denominator) for x in entries])

    powers = (rational(motion.masses).inv() * rational(motion.stiffness)).charpoly().coeffs()
    return [Fraction(int(c.p), int(c.q)) for c in powers]


def _determinant_roots(motion: LinearMotion, given: Values, bounded: bool, are_real: bool) -> Iterator[Root]:
    """The roots of det(M s^2 + C s + K).

    That all of them are imaginary says `bounded`, and that their squares `are_real` where M is definite.
    """
    determinant = matrices.short_determinant(motion.pencil(S, S**2).tolist())
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
    free, root = root_of_either_sign(square), square ** Fraction(1, 2)
    sizes = _samples([free], given, SIGNS)
    if sizes is None or sizes.min() < 0 < sizes.max():
        return root
    return shortest([root, tidy(free if sizes.min() >= 0 else -free)])


def _of_square(square: Expr, given: Values, sign: int | None = None) -> Root:
    """The root of s^2 = `square`, taken to oscillate where the sign of that is open."""
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
    # s^2 = mean -+ sqrt(rest)/(2 a); the product of both is c/a. Signs are 1, -1, 0, or None where open.
    a, b, c = map(tidy, (a, b, c))
    mean, rest, product = tidy(-b / (2 * a)), tidy(b**2 - 4 * a * c), tidy(c / a)
    of_product, of_mean = (1, -1) if bounded else (sign_of(product, given), sign_of(mean, given))
    of_rest = 1 if bounded or definite or of_product == -1 else sign_of(rest, given)
    if of_rest == 0:
        raise ExpressionError("it depends on symbols whether roots are equal")
    if of_rest == -1:
        # s = growth -+ i angular, with growth^2 - angular^2 = mean and growth^2 + angular^2 = sqrt(c/a)
        size = positive_root(product, given)
        growth, angular = (positive_root(tidy((size + side * mean) / 2), given) for side in (1, -1))
        return [Root(growth, angular, False)]
    width = positive_root(rest, given)
    squares = [(-b + side * width) / (2 * a) for side in (1, -1)]
    signs: Sequence[int | None] = (None, None)
    if of_product == -1:
        signs = (1, -1)
    elif of_product == 1 and of_rest:
        signs = (of_mean, of_mean)
    elif definite and of_product is None:
        # One s^2 has the sign of the mean; the other one is negative where the product has the other sign.
        signs = [of_mean if of_mean == side else None for side in (1, -1)]
    pair = [_of_square(shortest([e, tidy(e)]), given, sign) for e, sign in zip(squares, signs, strict=True)]
    if definite and of_product is None and of_mean:
        condition = tidy(-of_mean * product)
        pair = [r if r.is_stable is not None else r._replace(condition=condition) for r in pair]
    if not of_rest:
        condition = tidy(rest / (4 * a**2))
        pair = [r._replace(is_stable=None, condition=condition) if r.is_stable else r for r in pair]
    both_oscillate = of_product == 1 and not any(root.growth for root in pair)
    return _in_shorter_form(pair, mean, product, given) if both_oscillate else pair


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
    values = dict.fromkeys(tidy(middle + side * width) for side in (1, -1))
    signs = {value: sign_of(value, given) for value in values}
    if decay is None or None in signs.values():
        raise ExpressionError("it depends on symbols whether motion decays")
    return [Root(value, ZERO, sign < 0 if sign else None) for value, sign in signs.items()]


def _with_vectors(motion: LinearMotion, root: Root) -> Root:
    """The root with its vectors, each over its first entry that is not zero.

    Raises ExpressionError where they have no closed form.
    """
    growth, angular = cast(Expr, root.growth), cast(Expr, root.angular)
    square, double = tidy(growth**2 - angular**2), tidy(2 * growth * angular)
    real = tidy_array(motion.pencil(growth, square))
    imaginary = tidy_array(motion.masses * double + motion.rates * angular)
    size, is_real = len(real), not imaginary.any()
    # For x + i y it is A x - B y = 0 and B x + A y = 0, which has each solution a second time, times i.
    matrix = real if is_real else np.block([[real, -imaginary], [imaginary, real]])
    found = matrices.null_vectors(matrix.tolist())
    count = len(found) if is_real else len(found) // 2
    if not found or 1 < count < len(found):
        # Of several complex vectors it is open which are multiples of others.
        raise ExpressionError("the vectors have no closed form")
    atoms = (growth + angular).everywhere()
    written = {expand(atom.inner): atom.inner for atom in atoms if isinstance(atom, Group)}
    vectors = []
    for vector in found[:count]:
        parts = _over_first(_array([vector[:size], vector[size:] or [ZERO] * size]).T)
        parts[:, 0] = [_with_radicands(x, written) for x in parts[:, 0]]
        vectors.append(parts)
    is_whole = count == root.times or bool(root.growth)
    return root._replace(is_stable=root.is_stable and is_whole, is_whole=is_whole, vectors=tuple(vectors))


def _with_radicands(e: Expr, written: Mapping[Expr, Expr]) -> Expr:
    """An expression with its sums as they are `written`, by the sums multiplied out: those of its root."""

    def change(atom: Atom) -> Expr | None:
        if not isinstance(atom, Group):
            return None
        return written.get(expand(atom.inner)) or rebuilt(atom, lambda e: _with_radicands(e, written))

    return mapped(e, change) if written else e


def _numeric_roots(motion: LinearMotion, is_free: bool, rounding: float) -> list[Root]:
    """The roots of exact numbers, by ascending rates. Raises ZeroDivisionError for a singular mass matrix."""
    from flint import acb, acb_mat, ctx

    with ctx.workprec(BITS):
        matrix, is_square = _companion(motion, is_free)
        values, vectors = acb_mat(matrix).eig(right=True, algorithm="approx")
        if is_square:
            # What is left beside a negative square is rounding; the root of it would be of either sign.
            real = [abs(value.imag) <= rounding * abs(value) for value in values]
            values = [acb(v.real if is_real else v).sqrt() for v, is_real in zip(values, real, strict=True)]
    rates = np.array(list(map(complex, values)))
    rates[np.abs(rates) <= rounding * np.abs(rates).max()] = 0
    for part in (rates.real, rates.imag):
        part[np.abs(part) <= rounding * np.abs(rates)] = 0
    # Of coordinates in different units, entries are compared in units of 1/sqrt(M_ii).
    weights = np.sqrt([abs(float(row[i])) or 1.0 for i, row in enumerate(motion.masses)])
    rows = [[vectors[i, j] for i in range(len(weights))] for j in range(len(rates))]
    columns = weights * np.array([[complex(e / max(map(abs, row))) for e in row] for row in rows])
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
        shown = tuple(_independent(units, rank, weights))
        roots.append(Root(rate.real, rate.imag, stable, None, times, whole, is_free or is_square, shown))
    return sorted(roots, key=lambda root: (root.rate, root.angular))


def _companion(motion: LinearMotion, is_free: bool) -> tuple[Any, bool]:
    """A matrix whose eigenvalues are the roots; or their squares, where nothing depends on velocities."""
    from flint import arb_mat

    def balls(matrix: Array) -> Any:
        known = {e: enclosed(e, {}, BITS).mid() for e in {*matrix.flat}}
        return arb_mat([[known[e] for e in row] for row in matrix])

    masses, rates, stiffness = map(balls, motion)
    if motion.is_of_first_order:
        return -stiffness, False
    back, damping, size = masses.solve(stiffness), masses.solve(rates), len(motion.masses)
    if is_free and not motion.rates.any():
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
        yield np.column_stack([row.real, row.imag])
