"""Exact rates s of linear motion exp(s t), with their vectors, and whether motion stays bounded.

Small oscillations obey M y'' + C y' + K y = 0. Hamilton's linear equations z' = A z are the case M = 0,
C = 1, K = -A. Rates are the roots of det(M s^2 + C s + K), which is factored: factors of degree 1 and 2 in s,
and of degree 1 and 2 in s^2, have roots in closed form. `numeric_spectrum` is for numbers.

Motion stays bounded if no rate has a positive real part, and a rate without a real part has as many vectors
as its multiplicity. Where M and K are positive definite, and C is antisymmetric, all rates are imaginary.
Freedoms that do not act on each other are worked apart. Signs, and which mode is the slower one, are those
for the given values of parameters and positive ones of others.
Sources: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, chapter 6; V. I. Arnold,
Mathematical Methods of Classical Mechanics, appendix 6.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, NamedTuple, TypeAlias

from rigidcli.algebra import matrices
from rigidcli.algebra.arithmetic import polynomial_factors, root_of_either_sign, tidy, weak_sign
from rigidcli.algebra.atoms import Atom, Group
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ONE, ZERO, Expr, power, symbol
from rigidcli.algebra.matrices import Matrix
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.simplification import shortest
from rigidcli.algebra.substitution import rebuilt, substitute, with_powers
from rigidcli.algebra.values import is_zero, sampled
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.small_oscillations import LinearMotion

S = symbol("rate s")
"""The variable of characteristic polynomials; with a blank in it, it is no name of a document."""

SIGNS = 12
"""Random points at which a root must have one sign, so that few of another sign are missed."""

Known: TypeAlias = Mapping[str, Expr]
"""The parameters that have values, with these."""

Pair: TypeAlias = "tuple[float | Expr, float | Expr]"
"""The real and the imaginary part of a number."""

Stability: TypeAlias = Literal["stable", "marginal", "unstable"]


class Root(NamedTuple):
    """The real and imaginary part of s, and whether motion is bounded.

    Where that is open, the root is that for a positive `condition`.
    """

    growth: Expr
    angular: Expr
    is_stable: bool | None
    condition: Expr | None = None


@dataclass(frozen=True, slots=True)
class Mode:
    """A mode y = Re(v exp(s t)): s = `growth` + i `angular`, and v, real and imaginary parts apart (n each).

    `growth` (1/s) is negative where it decays. `is_stable` is None of a zero mode, which is displaced to
    another equilibrium and drifts there, and where the signs of symbols decide: the mode is that for a
    positive `condition`.
    """

    growth: float | Expr
    angular: float | Expr
    vector: tuple[Pair, ...]
    is_stable: bool | None
    condition: Expr | None = None

    @property
    def rate(self) -> float | Expr:
        """The growth of an unstable mode; else the angular frequency, or the decay where it has none."""
        if self.is_stable is False and self.growth:
            return self.growth
        return -self.growth if self.growth and not self.angular else self.angular


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Eigenvalues as pairs (re, im), frequencies (rad/s, each once, ascending), and stability."""

    eigenvalues: tuple[Pair, ...]
    frequencies: tuple[float | Expr, ...]
    stability: Stability


def sign_of(e: Expr, known: Known) -> int | None:
    """The sign that an expression has for known values, and any positive ones of other names."""
    try:
        positive = {name: symbol(name, positive=True) for name in e.names}
        sign = weak_sign(substitute(e, {**positive, **known}))
    except ExpressionError:
        return None
    return None if sign is None else sign[0]


def is_positive_definite(matrix: Matrix, known: Known) -> bool:
    """Whether a symmetric matrix is positive definite, by its leading minors."""
    sizes = range(1, len(matrix) + 1)
    minors = (matrices.short_determinant(matrices.part(matrix, range(k), range(k))) for k in sizes)
    return all(sign_of(minor, known) == 1 for minor in minors)


def positive_root(square: Expr, known: Known) -> Expr:
    """The root of a square that no positive parameters make zero, in its shortest form."""
    free = root_of_either_sign(square)
    sizes = sampled([free], {name: float(value) for name, value in known.items()}, count=SIGNS)
    root = square ** Fraction(1, 2)
    if sizes is None or sizes.min() < 0 < sizes.max():
        return root
    return shortest([root, tidy(free if sizes.min() >= 0 else -free)])


def roots(polynomial: Mapping[int, Expr], known: Known, bounded: bool) -> list[Root] | None:
    """The roots of a factor with Im s >= 0, and of s and -s the one that grows; None without a closed form.

    `bounded` says that all roots are imaginary.
    """
    highest = max(polynomial)
    a, b, c = (polynomial.get(highest * k // 2, ZERO) for k in (2, 1, 0))
    if highest == 1:
        return _real([tidy(-polynomial.get(0, ZERO) / polynomial[1])], known)
    if highest not in (2, 4) or not polynomial.keys() <= {0, highest // 2, highest}:
        return None
    if highest == 2:
        return _damped(a, b, c, known) if b else [_of_square(tidy(-c / a), known, -1 if bounded else None)]
    return _biquadratic(a, b, c, known, bounded)


def _of_square(square: Expr, known: Known, sign: int | None = None) -> Root:
    """The root of s^2 = `square`; where the sign of that is open, it is taken to oscillate."""
    sign = sign_of(square, known) if sign is None else sign
    if sign == 1:
        return Root(positive_root(square, known), ZERO, False)
    angular = positive_root(-square, known)
    return Root(ZERO, angular, True) if sign else Root(ZERO, angular, None, tidy(-square))


def _biquadratic(a: Expr, b: Expr, c: Expr, known: Known, bounded: bool) -> list[Root] | None:
    """The roots of a s^4 + b s^2 + c; both s^2 are taken to be real where that is open."""
    middle, rest = tidy(-b / (2 * a)), tidy(b**2 - 4 * a * c)
    # Of two squares with a positive product both have the sign of their mean, else one has either.
    product, mean = sign_of(c / a, known), sign_of(middle, known)
    are_real = 1 if bounded or product == -1 else sign_of(rest, known)
    if are_real == 0:
        return None
    if are_real == -1:
        size = positive_root(tidy(c / a), known)
        growth, angular = (positive_root(tidy((size + side * middle) / 2), known) for side in (1, -1))
        return [Root(growth, angular, False)]
    signs = (mean, mean) if are_real and product == 1 else (1, -1) if product == -1 else (None, None)
    signs = (-1, -1) if bounded else signs
    width = positive_root(rest, known)
    squares = [
        shortest([(-b + side * width) / (2 * a), tidy((-b + side * width) / (2 * a))]) for side in (1, -1)
    ]
    pair = [_of_square(square, known, sign) for square, sign in zip(squares, signs, strict=True)]
    if not are_real:
        condition = tidy(rest / (4 * a**2))
        pair = [r._replace(is_stable=None, condition=condition) if r.is_stable else r for r in pair]
    if product != 1 or any(root.growth for root in pair):
        return pair
    # sqrt(m - d) = sqrt((m + r)/2) - sqrt((m - r)/2), where r^2 = m^2 - d^2, may be shorter, and m > r is
    # what both oscillate for.
    size = positive_root(tidy(c / a), known)
    limit = None if pair[0].is_stable else tidy(-middle - size)
    first, second = (positive_root(tidy((side * size - middle) / 2), known) for side in (1, -1))
    forms = tidy(first - second), tidy(first + second)
    return [
        root._replace(angular=shortest([root.angular, form]), condition=limit)
        for root, form in zip(pair, forms, strict=True)
    ]


def _damped(a: Expr, b: Expr, c: Expr, known: Known) -> list[Root] | None:
    """The roots of a s^2 + b s + c: two real ones, or one of two that are complex."""
    middle, discriminant = tidy(-b / (2 * a)), tidy((b**2 - 4 * a * c) / (4 * a**2))
    sign, decay = sign_of(discriminant, known), sign_of(middle, known)
    if decay is None:
        return None
    if sign is None or sign < 0:
        condition = None if sign else -discriminant
        return [Root(middle, positive_root(-discriminant, known), decay <= 0, condition)]
    width = positive_root(discriminant, known) if sign else ZERO
    return _real([tidy(middle + side * width) for side in ((1, -1) if sign else (1,))], known)


def _real(values: Sequence[Expr], known: Known) -> list[Root] | None:
    """Real roots with these values; None where the sign of one is open."""
    signs = [(value, sign) for value in values if (sign := sign_of(value, known)) is not None]
    found = [Root(value, ZERO, sign < 0 if sign else None) for value, sign in signs]
    return found if len(found) == len(values) else None


def _blocks(motion: LinearMotion, freedoms: int) -> list[tuple[list[int], LinearMotion]]:
    """The places that act on each other with their motion; place k belongs to freedom k modulo `freedoms`."""

    def linked(i: int, j: int) -> bool:
        return (i - j) % freedoms == 0 or any(part[i][j] or part[j][i] for part in motion.parts)

    blocks = matrices.connected(len(motion.masses), linked)
    return [(b, LinearMotion(*(matrices.part(part, b, b) for part in motion.parts))) for b in blocks]


def _solved(motion: LinearMotion, known: Known, bounded: bool) -> list[tuple[Root, int, bool]] | None:
    """The roots of the determinant, how often each is one, and whether they are those of an even factor."""
    solved = []
    for polynomial, times in polynomial_factors(matrices.short_determinant(motion.pencil(S)), str(S)):
        found = roots(polynomial, known, bounded)
        if found is None:
            return None
        is_even = all(power % 2 == 0 for power in polynomial)
        solved += [(root, times, is_even) for root in found]
    return solved


def _null_vectors(motion: LinearMotion, root: Root) -> tuple[list[list[Expr]], int]:
    """What M s^2 + C s + K takes to zero, as real vectors, or real parts before imaginary ones; how many."""
    square = tidy(root.growth**2 - root.angular**2)
    double = tidy(2 * root.growth * root.angular)
    rows = list(zip(*motion.parts, strict=True))
    real = [[tidy(m * square + c * root.growth + k) for m, c, k in zip(*row, strict=True)] for row in rows]
    imaginary = [[tidy(m * double + c * root.angular) for m, c, _ in zip(*row, strict=True)] for row in rows]
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


def _radicands(e: Expr) -> dict[Expr, Expr]:
    """The sums under roots as they are written, by what they are multiplied out."""
    groups = [(atom.inner, n) for m in e.terms for atom, n in m if isinstance(atom, Group)]
    own = {expand(inner): inner for inner, n in groups if n.denominator > 1}
    return own | {key: inner for group, _ in groups for key, inner in _radicands(group).items()}


def _with_radicands(e: Expr, written: Mapping[Expr, Expr]) -> Expr:
    """An expression with these sums under its roots, so that vectors have the roots of their rate."""

    def change(atom: Atom, n: Rational) -> Expr | None:
        inner = written.get(expand(atom.inner)) if isinstance(atom, Group) and n.denominator > 1 else None
        return power(rebuilt(atom, lambda e: _with_radicands(e, written)) if inner is None else inner, n)

    return with_powers(e, change) if written else e


def exact_modes(motion: LinearMotion, known: Known, is_free: bool) -> list[Mode] | None:
    """The modes, by ascending rates; None where the polynomial does not factor, or is too large."""
    size, modes = len(motion.masses), []
    for block, own in _blocks(motion, size):
        try:
            bounded = is_free and all(is_positive_definite(e, known) for e in (own.masses, own.stiffness))
            solved = _solved(own, known, bounded)
            if solved is None:
                return None
            for root, times, _ in solved:
                vectors, count = _null_vectors(own, root)
                if not vectors or 1 < count < len(vectors):
                    return None  # of several complex vectors it is open which are multiples of others
                stable = root.is_stable and (count == times or bool(root.growth))
                written = _radicands(root.growth + root.angular)
                for vector in vectors[:count]:
                    whole: list[Pair] = [(ZERO, ZERO)] * size
                    for place, entry in zip(block, _from_first(vector, len(block)), strict=True):
                        whole[place] = (_with_radicands(entry[0], written), entry[1])
                    modes.append(Mode(root.growth, root.angular, tuple(whole), stable, root.condition))
        except ExpressionError:
            return None
    rates = [rate for mode in modes if isinstance(rate := mode.rate, Expr)]
    sizes = sampled(rates, {name: float(value) for name, value in known.items()}, count=1)
    order = range(len(modes)) if sizes is None else sizes[0].argsort(kind="stable")
    return [modes[place] for place in order]


def exact_spectrum(matrix: Matrix, known: Known) -> Spectrum | None:
    """The spectrum of A (2n by 2n, coordinates first) in symbols; None where it has no short form."""
    size = len(matrix) // 2
    units = range(2 * size)
    zero = [[ZERO for _ in units] for _ in units]
    one = [[ONE if i == j else ZERO for j in units] for i in units]
    pairs: list[tuple[Expr, Expr]] = []
    grows, whole = False, True
    for block, own in _blocks(LinearMotion(zero, one, [[-e for e in row] for row in matrix]), size):
        # A = J S, with S the second derivatives of H: where these are definite, motion is bounded.
        half = len(block) // 2
        rows = [*own.stiffness[half:], *([-e for e in row] for row in own.stiffness[:half])]
        is_hamiltonian = all(is_zero(rows[i][j] - rows[j][i]) for i in range(2 * half) for j in range(i))
        try:
            solved = _solved(own, known, is_hamiltonian and is_positive_definite(rows, known))
            if solved is None:
                return None
            for root, times, is_even in solved:
                if root.condition is not None:
                    return None
                grows |= root.is_stable is False
                whole &= times == 1 or grows or _null_vectors(own, root)[1] == times
                pairs += [(a * root.growth, b * root.angular) for a, b in _sides(root, is_even)] * times
        except ExpressionError:
            return None
    frequencies = dict.fromkeys(im for re, im in pairs if not re and im and sign_of(im, known) == 1)
    return Spectrum(tuple(pairs), tuple(frequencies), verdict(grows, whole))


def _sides(root: Root, is_even: bool) -> list[tuple[int, int]]:
    """The signs of the real and imaginary parts of all roots that one stands for."""
    first = (-1, 1) if is_even and root.growth else (1,)
    if is_even and root.growth and root.angular:
        return [(a, b) for a in first for b in (-1, 1)]
    if root.angular:
        return [(1, -1), (1, 1)]
    return [(a, a) for a in first]


def verdict(grows: bool, whole: bool) -> Stability:
    """The stability of motion in which a rate grows, or else all rates have as many vectors as they need."""
    return "unstable" if grows else "stable" if whole else "marginal"
