"""Velocities from momenta in closed form, where a Lagrangian is not quadratic in them.

K is a part of the Lagrangian that shares its velocities v with no other, and P = dK/dv. Three ways are tried:

    K^2 = a + v.C.v             a root: with S the sign of K at rest and D^2 = a (1 - P.C^-1.P)
                                v = S a C^-1.P/D,  H = -S D
    K = A (v.Q.v)^(n/2)         a power: with s = P.Q^-1.P/(n A)^2
                                v = Q^-1.P s^((2 - n)/(2 n - 2))/(n A),  H = (n - 1) A s^(n/(2 n - 2))
    dK/dv = P for one v         what is done to v is undone step by step, and H = P v - K

Terms linear in v are part of the root and the power when the square is completed: K as a function of v + s
has v less by s, and H less by P.s. The roots are real, and positive where they are square roots. The formulas
are derived here from dK/dv = P and H = P.v - K. Each way back is put to the test at sample points.

What is done to a name is undone step by step:

    v/sqrt(1 + v^2) = p    ->    v^2/(1 + v^2) = p^2    ->    v = p/sqrt(1 - p^2), v = -p/sqrt(1 - p^2)

Squaring adds solutions, and inverse functions have several branches: the caller puts all of them to the test.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from typing import NamedTuple, TypeAlias

from rigidcli.algebra import arithmetic, matrices
from rigidcli.algebra.atoms import Applied, Atom, Group
from rigidcli.algebra.bounds import Rational
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import Polynomial, coefficient, coefficients, expand, free_of, has_degrees
from rigidcli.algebra.expressions import PI, ZERO, Expr, expr, factored, gathered, product, symbol, total
from rigidcli.algebra.fractions import factors
from rigidcli.algebra.functions import apply, only_power
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import mapped, rebuilt, substitute
from rigidcli.algebra.values import sample_points
from rigidcli.errors import ComputationError, ExpressionError

HALF = Fraction(1, 2)

SAME = 1e-9  # relative tolerance for equal velocities, whose floats are right to 1e-16


class Branch(NamedTuple):
    """One way back from momenta: velocities, H = P v - K, and expressions that must be positive for that.

    These are `conditions` on the momenta, and the `region` of coordinates and parameters: elsewhere the
    same velocities have another form. Velocities with a `period` may differ by its multiples, too.
    """

    velocities: tuple[Expr, ...]
    hamiltonian: Expr
    conditions: tuple[Expr, ...] = ()
    region: tuple[Expr, ...] = ()
    period: Expr | None = None

    @property
    def validity(self) -> str:
        """The conditions in words, solved for a momentum where they are linear in it, with numbers."""
        limits, ends = list[str](), dict[str, dict[bool, Expr]]()
        for e in self.conditions:
            name = next(iter(e.names), "")
            line = coefficients(e, [name])
            slope = coefficient(line, 1, 0).as_number if has_degrees(line, 0, 1) else None
            if line is None or not slope or not e.names <= {name}:
                limits.append(f"{e} > 0")
            else:
                ends.setdefault(name, {})[slope > 0] = -coefficient(line, 1) / slope
        for name, sides in ends.items():
            if len(sides) == 2:
                limits.append(f"{sides[True]} < {name} < {sides[False]}")
            else:
                ((is_above, end),) = sides.items()
                limits.append(f"{name} {'>' if is_above else '<'} {end}")
        others = [] if self.period is None else [f"all that differ by multiples of {self.period}"]
        return ", and ".join([*filter(None, [" and ".join(limits)]), *others])

    def shifted(self, shift: Sequence[Expr], momenta: Sequence[Expr]) -> Branch:
        """The inverse of K(v + `shift`) from that of K(v)."""
        velocities = tuple(v - s for v, s in zip(self.velocities, shift, strict=True))
        turned = total(P * s for P, s in zip(momenta, shift, strict=True))
        return self._replace(velocities=velocities, hamiltonian=self.hamiltonian - turned)


def inverted(K: Expr, velocities: Sequence[str], momenta: Sequence[Expr]) -> list[Branch]:
    """All real inverses of dK/dv = P; none if no way leads to a closed form."""
    for way in (_of_root, _of_length) if len(velocities) > 1 else (_of_root, _of_powers, _undone):
        with suppress(ExpressionError, ComputationError):
            if branches := way(K, velocities, momenta):
                return branches
    return []


_Square: TypeAlias = tuple[list[Expr], Expr, matrices.Matrix]  # s, rest and C^-1 of (v + s).C.(v + s) + rest


def _completed(polynomial: Polynomial | None, size: int) -> _Square | None:
    """The polynomial with its square completed; None where it is another one, or C has no short inverse."""
    if not has_degrees(polynomial, 0, 1, 2):
        return None
    places = range(size)
    form = [[coefficient(polynomial, size, i, j) * (1 if i == j else HALF) for j in places] for i in places]
    inverse = matrices.inverse(form)
    if inverse is None:
        return None
    linear = [coefficient(polynomial, size, place) for place in places]
    shift = [tidy(e / 2) for e in matrices.times(inverse, linear)]
    rest = tidy(coefficient(polynomial, size) - total(c * s for c, s in zip(linear, shift, strict=True)) / 2)
    return shift, rest, inverse


def _of_root(K: Expr, velocities: Sequence[str], momenta: Sequence[Expr]) -> list[Branch]:
    """The inverse where K^2 is a quadratic polynomial: first the form where the system may be at rest."""
    is_root = any(n.denominator == 2 for monomial in K.terms for _, n in monomial)
    polynomial = coefficients(arithmetic.tidy(expand(K**2)), velocities) if is_root else None
    square = _completed(polynomial, len(velocities))
    if square is None or square[1].is_zero:
        return []
    shift, a, inverse = square
    raised = matrices.times(inverse, momenta)
    below = matrices.quadratic_form([[tidy(-a * e) for e in row] for row in inverse], momenta) + a
    D = tidy(below) ** HALF
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
    odd = {a: 1 for a, n in monomial if n.numerator * n.denominator % 2 and not a.positive}
    return 1 if size > 0 else -1, gathered(1, odd)


def _of_length(K: Expr, velocities: Sequence[str], momenta: Sequence[Expr]) -> list[Branch]:
    """K = A (v.Q.v)^(n/2), from the power that it is of one velocity where the others vanish."""
    form, size = _quadratic_form(K, velocities), len(velocities)
    pivot = next((k for k in range(size) if coefficient(form, size, k, k)), None)
    if pivot is None:
        return []
    lead = coefficient(form, size, pivot, pivot)
    square = _completed({powers: tidy(e / lead) for powers, e in form.items()}, size)
    if square is None:
        return []
    shift, _, inverse = square
    length = symbol("length of v", positive=True)  # no name in a document has a blank
    place = {v: -s for v, s in zip(velocities, shift, strict=True)}
    place[velocities[pivot]] += length
    alone = tidy(substitute(K, place))
    if len(alone.terms) != 1:
        return []
    n = next((k for atom, k in next(iter(alone.terms)) if atom.names == length.names), Fraction(0))
    A = alone / length**n
    if n in (0, 1) or not A.names.isdisjoint({*velocities, *length.names}):
        return []
    s = tidy(matrices.quadratic_form(inverse, momenta)) / (n * A) ** 2
    raised = matrices.times(inverse, momenta)
    rates = tuple(tidy(w * s ** ((2 - n) / Fraction(2 * n - 2)) / (n * A)) for w in raised)
    energy = (n - 1) * A * s ** (n / Fraction(2 * n - 2))
    return [Branch(rates, energy).shifted(shift, momenta)]


def _quadratic_form(K: Expr, velocities: Sequence[str]) -> Polynomial:
    """The polynomial in the velocities that is raised to a power in K, or of which K is a power."""
    for atom in K.atoms:
        if isinstance(atom, Group) and not atom.names.isdisjoint(velocities):
            return coefficients(atom.inner, velocities) or {}
    moving = [e for e, _ in factors(K) if not e.names.isdisjoint(velocities)]
    return (coefficients(moving[0], velocities) or {}) if len(moving) == 1 else {}


def _of_powers(K: Expr, velocities: Sequence[str], momenta: Sequence[Expr]) -> list[Branch]:
    """K = A u^n + B u + C with u = v + s, multiplied out or not; or K = A |u|^n.

    The second derivative F = n (n - 1) A u^(n - 2) alone tells the exponent and u = (n - 2) F/F'.
    """

    (v,), (P,) = velocities, momenta

    def inner(atom: Atom) -> Expr | None:
        if isinstance(atom, Applied) and atom.function == "abs" and v in atom.names:
            return expr(atom.arguments[0])
        return None

    positive = mapped(K, inner)  # K where u is positive
    is_absolute, slope = positive != K, derivative(positive, v)
    F = derivative(slope, v)
    first = tidy(derivative(F, v))
    if not first:
        return []
    ratio = arithmetic.tidy(F * derivative(first, v) / first**2).as_number
    if ratio is None or ratio == 1:
        return []
    n = 2 + 1 / (1 - Fraction(ratio))
    shift = tidy(arithmetic.tidy((n - 2) * F / first) - symbol(v))
    if n in (0, 1) or v in shift.names:
        return []
    whole, rate, bend = (tidy(substitute(e, {v: 1 - shift})) for e in (K, slope, F))  # where u = 1
    A = whole if is_absolute else tidy(bend / (n * (n - 1)))
    B = ZERO if is_absolute else tidy(rate - n * A)
    C = tidy(whole - A - B)
    base = tidy((P - B) / (n * A))
    if is_absolute or (n.denominator == 1 and n % 2 == 0):
        size = apply("abs", base)
        u = apply("sign", base) * size ** (1 / (n - 1))
        ways = [Branch((u,), (n - 1) * A * size ** (n / (n - 1)))]
    else:
        u = base ** (1 / (n - 1))
        roots = (u, -u) if n.denominator == 1 else (u,)
        ways = [Branch((root,), (1 - 1 / n) * (P - B) * root, _positive([base])) for root in roots]
    return [way._replace(hamiltonian=way.hamiltonian - C).shifted([shift], [P]) for way in ways]


def _undone(K: Expr, velocities: Sequence[str], momenta: Sequence[Expr]) -> list[Branch]:
    """The inverses of one velocity that come from undoing what is done to it, and hold at sample points."""
    (v,), (P,), momentum = velocities, momenta, symbol("momentum P")
    slope = tidy(derivative(K, v))
    ways: dict[Expr, Branch] = {}
    for u, conditions, period in solutions(slope, v, momentum):
        with suppress(ExpressionError):
            velocity, positive = tidy(u), _positive(conditions)
            if velocity in ways or not _holds(K, velocity, positive, slope, v, momentum):
                continue
            half = None if period is None else period / 2
            twin = next((e for e in ways if half is not None and tidy(velocity - e) in (half, -half)), None)
            if twin is not None:
                ways[twin] = ways[twin]._replace(period=half)
                continue
            energy = tidy(momentum * velocity - on_main_branch(substitute(K, {v: velocity})))
            if momentum in positive:  # the root of its square is itself
                energy = tidy(substitute(energy, {str(momentum): symbol(str(momentum), positive=True)}))
            put = {str(momentum): P}
            e, h = substitute(velocity, put), substitute(energy, put)
            limits = tuple(tidy(substitute(c, put)) for c in positive)
            ways[velocity] = Branch((e,), h, limits, period=period)
    return list(ways.values())


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
    needed = dict.fromkeys(tidy(sign * odd) for sign, odd in map(_odd_part, map(tidy, conditions)))
    return tuple(e for e in needed if not (e.sign() == 1 and e.is_strict()))


_MAIN = {("exp", "log"), ("asin", "sin"), ("acos", "cos"), ("atan", "tan"), ("acosh", "cosh")}


def on_main_branch(e: Expr) -> Expr:
    """An expression with x for atan(tan(x)), as it is where the conditions of the inverses hold."""

    def change(atom: Atom) -> Expr | None:
        if isinstance(atom, Applied):
            inner, n = only_power(atom.arguments[0])
            if n == 1 and isinstance(inner, Applied) and (atom.function, inner.function) in _MAIN:
                return expr(inner.arguments[0])
        return rebuilt(atom, on_main_branch) if isinstance(atom, Applied | Group) else None

    return mapped(e, change)


_Solution = tuple[Expr, tuple[Expr, ...], Expr | None]  # a value, what must be positive for it, and a period


def solutions(e: Expr, v: str, r: Expr = ZERO) -> Iterator[_Solution]:
    """The values of a name at which an expression is r."""
    e = _tangents(e)
    still = free_of([v], e)
    e, r = e - still, tidy(r - still)
    polynomial = coefficients(e, [v])
    if polynomial is not None:
        powers = {n: c for (n,), c in polynomial.items() if n}
        yield from _of_polynomial(powers, tidy(r - polynomial.get((0,), ZERO)))
        return
    moving = {factor for m in e.terms for factor in m if v in factor[0].names}
    if len(moving) == 1:
        ((atom, n),) = moving
        base = atom.inner if isinstance(atom, Group) else gathered(1, {atom: 1})
        for u, conditions in _roots(tidy(r * base**n / e), Fraction(n)):
            yield from ((x, (*conditions, *more), t) for x, more, t in _of_atom(atom, v, u))
    else:
        yield from _of_several(e, v, r, moving)


def _of_polynomial(polynomial: Mapping[int, Expr], r: Expr) -> Iterator[_Solution]:
    """The roots of a polynomial without a constant that has one power, or one and its square."""
    first, *others = sorted(polynomial) or [0]
    if not first:
        return
    if not others:
        for u, conditions in _roots(tidy(r / polynomial[first]), Fraction(first)):
            yield u, conditions, None
    elif others == [2 * first]:
        a, b = polynomial[2 * first], polynomial[first]
        shift = tidy(b / (2 * a))
        square = tidy(r / a + shift**2)
        # Where the sign of a is that of the momentum, one root of b^2 + 4 a r holds for both.
        root = square**HALF if a.names.isdisjoint(r.names) else tidy(4 * a**2 * square) ** HALF / (2 * a)
        for side in (1, -1):
            for u, conditions in _roots(side * root - shift, Fraction(first)):
                yield u, (square, *conditions), None


def _roots(w: Expr, n: Fraction) -> Iterator[tuple[Expr, tuple[Expr, ...]]]:
    """The real u with u^n = w."""
    if n.numerator % 2 and n.denominator % 2:
        yield apply("sign", w) * apply("abs", w) ** (1 / n) if n not in (1, -1) else w**n, ()
    else:
        yield w ** (1 / n), (w,)
        if n.numerator % 2 == 0:
            yield -(w ** (1 / n)), (w,)


def _of_atom(atom: Atom, v: str, u: Expr) -> Iterator[_Solution]:
    """The solutions where an atom, which holds the name, is u."""
    if isinstance(atom, Group):
        yield from solutions(atom.inner, v, u)
    elif not isinstance(atom, Applied):
        yield u, (), None
    elif atom.function == "atan2":
        y, x = atom.arguments
        yield from solutions(y * apply("cos", u) - x * apply("sin", u), v)
    elif atom.function == "pow" and v not in atom.arguments[1].names:
        yield from solutions(atom.arguments[0], v, u ** (1 / atom.arguments[1]))
    elif atom.function in _INVERSES:
        (inner,) = atom.arguments
        for w, conditions in _INVERSES[atom.function](u):
            for x, further, _ in solutions(inner, v, w):
                turns = atom.function in ("sin", "cos", "tan")
                period = tidy(2 * PI / abs(derivative(inner, v))) if turns else None
                yield x, (*conditions, *further), period


def _of_several(e: Expr, v: str, r: Expr, moving: set[tuple[Atom, Rational]]) -> Iterator[_Solution]:
    """The solutions where the name stands in several places: a square root is isolated, and squared."""
    for atom, n in sorted(moving, key=lambda factor: factor[0].key):
        if isinstance(atom, Group) and n.denominator == 2:
            holding = Expr({m: c for m, c in e.terms.items() if (atom, n) in m})
            above, rest = holding / gathered(1, {atom: n}), e - holding - r
            squared = expand(above**2 * atom.inner ** (2 * n) - rest**2)
            fewer = 0 < len(_under_roots(squared, v)) < len(_under_roots(e, v))
            yield from solutions(squared, v) if fewer else _of_fraction(arithmetic.tidy(squared), v)
            return
    yield from _of_fraction(arithmetic.tidy(e - r), v)


def _under_roots(e: Expr, v: str) -> set[Atom]:
    return {atom for m in e.terms for atom, n in m if n.denominator == 2 and v in atom.names}


def _of_fraction(e: Expr, v: str) -> Iterator[_Solution]:
    above = expand(product(f for f, n in factors(e) if n > 0 and v in f.names))
    polynomial = coefficients(above, [v])
    if polynomial is not None and len(polynomial) <= 3:
        yield from solutions(above, v)


def _tangents(e: Expr) -> Expr:
    """The expression with tan and tanh for quotients of a sine and a cosine."""
    parts = []
    for monomial, c in e.terms.items():
        part = Expr({monomial: c})
        for atom, n in monomial:
            if isinstance(atom, Applied) and atom.function in ("sin", "sinh"):
                ending = atom.function.removeprefix("sin")
                sine, cosine, tangent = (apply(f + ending, *atom.arguments) for f in ("sin", "cos", "tan"))
                quotient = (sine / cosine) ** n
                if set(*quotient.terms) <= {*monomial}:
                    part *= tangent**n / quotient
        parts.append(part)
    return total(parts)


def _within(w: Expr) -> tuple[Expr, ...]:
    """Factors that are positive where -1 < w < 1."""
    is_root = any(n.denominator > 1 for m in w.terms for _, n in m)
    return (1 - w**2,) if is_root else (1 - w, 1 + w)


_Inverse = Callable[[Expr], list[tuple[Expr, tuple[Expr, ...]]]]

_INVERSES: Mapping[str, _Inverse] = {
    "exp": lambda w: [(apply("log", w), (w,))],
    "log": lambda w: [(apply("exp", w), ())],
    "sin": lambda w: [(s, _within(w)) for s in (apply("asin", w), PI - apply("asin", w))],
    "cos": lambda w: [(s * apply("acos", w), _within(w)) for s in (1, -1)],
    "tan": lambda w: [(apply("atan", w), ()), (PI + apply("atan", w), ())],
    "sinh": lambda w: [(apply("asinh", w), ())],
    "cosh": lambda w: [(s * apply("acosh", w), (w - 1,)) for s in (1, -1)],
    "tanh": lambda w: [(apply("atanh", w), _within(w))],
    "asin": lambda w: [(apply("sin", w), (PI / 2 - w, PI / 2 + w))],
    "acos": lambda w: [(apply("cos", w), (w, PI - w))],
    "atan": lambda w: [(apply("tan", w), (PI / 2 - w, PI / 2 + w))],
    "asinh": lambda w: [(apply("sinh", w), ())],
    "acosh": lambda w: [(apply("cosh", w), (w,))],
    "atanh": lambda w: [(apply("tanh", w), ())],
    "abs": lambda w: [(s * w, (w,)) for s in (1, -1)],
}
"""For each function f all u with f(u) = w, each with what must be positive."""
