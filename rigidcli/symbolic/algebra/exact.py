"""Exact numbers as results: brought into their shortest form, and printed.

Nothing here is decided by the clock: what is tried depends on the size of an expression alone, so
that the same expression always comes out the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import islice
from typing import TYPE_CHECKING, Any

import sympy
from sympy.functions.elementary.hyperbolic import HyperbolicFunction
from sympy.functions.elementary.trigonometric import TrigonometricFunction
from sympy.polys.polyerrors import PolynomialError
from sympy.simplify.fu import TR5, TR6, TR11, TR10i

from rigidcli.symbolic.algebra.conversion import FAILURES
from rigidcli.symbolic.algebra.printing import latex, reading, text
from rigidcli.symbolic.language.latex_names import latex_name

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["common_factor", "latex", "latex_name", "reading", "text", "tidy", "tidy_array"]

MAX_NODES = 400
"""Nodes of an expression that is rearranged at all."""

MAX_TERMS = 200
"""Terms that multiplying out may give."""

MAX_POWER = 24
"""Highest power in an expression that is multiplied out or worked on as a polynomial."""

MAX_DIGITS = 50
"""Of a number in such an expression."""

_TOO_LONG: int = 10**MAX_DIGITS

MAX_TERMS_TO_FACTOR = 30
MAX_SYMBOLS_TO_FACTOR = 8
"""Names and functions together: in many of them factoring takes seconds, cancelling milliseconds."""

MAX_NODES_WITH_ROOTS = 100
"""Of an expression with roots of numbers, which are then taken out of denominators and other roots."""

MAX_NODES_TO_SEARCH = 25
"""Of an expression for which sympy searches through many identities, and not only the common ones."""

MAX_TERMS_OF_AN_ANGLE = 3

_ROUNDS = 3
_STOREY = 5
"""As many operations is a fraction within a fraction worth."""

_Way = Callable[[sympy.Expr], sympy.Expr]


@lru_cache(maxsize=2048, typed=True)
def tidy(expr: sympy.Expr) -> sympy.Expr:
    """The shortest of the forms of an expression that cheap rearrangements find; 0 for a hidden zero."""
    expr = sympy.sympify(expr, strict=True)
    for _ in range(_ROUNDS):
        if expr.is_Atom or expr.has(sympy.Float) or not _has_at_most(MAX_NODES, expr):
            break
        shortest = min(_forms(expr), key=_length)
        if shortest == expr:
            break
        expr = shortest
    return expr


def tidy_array(array: NDArray[Any]) -> NDArray[Any]:
    """An array of expressions, each one tidied; an array of floats is returned as it is."""
    return _map(tidy, array) if array.dtype == object else array


def common_factor(array: NDArray[Any]) -> tuple[sympy.Expr, NDArray[Any]]:
    """The factor that leaves an array of expressions shortest, and what it leaves.

    The numbers that remain are integers without a common divisor where all were rational. The
    factor is 1 and the array as given where nothing gets shorter.
    """
    if array.dtype != object:
        return sympy.S.One, array
    tidied = _map(tidy, array)
    factored = [_factors(entry) for entry in tidied.flat if entry != 0]
    if not factored or not all(_has_at_most(MAX_NODES, entry) for entry in tidied.flat):
        return sympy.S.One, array
    numbers = [number for number, _ in factored]
    content = sympy.Rational(
        math.gcd(*(int(number.p) for number in numbers)), math.lcm(*(int(number.q) for number in numbers))
    )
    shared = dict(factored[0][1])
    for _, powers in factored[1:]:
        shared = {base: _nearer(shared[base], powers[base]) for base in shared if base in powers}
    factor = sympy.Mul(content, *(base**exponent for base, exponent in shared.items()))
    rest = _map(lambda entry: tidy(_quotient(entry, content, shared)), tidied)
    before = sum(len(str(entry)) for entry in tidied.flat)
    after = len(str(factor)) + sum(len(str(entry)) for entry in rest.flat)
    return (factor, rest) if after < before else (sympy.S.One, array)


def _map(function: _Way, array: NDArray[Any]) -> NDArray[Any]:
    import numpy as np

    result = np.empty(array.shape, dtype=object)
    for index, entry in np.ndenumerate(array):
        result[index] = function(entry)
    return result


def _length(expr: sympy.Expr) -> tuple[int, int, str]:
    """What is to be small, in this order: operations, characters, and the alphabet breaks ties."""
    shown = str(expr)
    return int(expr.count_ops()) + _STOREY * _storeys(expr), len(shown), shown


def _storeys(expr: sympy.Expr) -> int:
    """Fractions within sums within products, which nobody writes: `(p^2/m + k x^2)/2`."""
    products = [part for part in sympy.preorder_traversal(expr) if part.is_Mul or part.is_Pow]
    sums = [factor.as_base_exp()[0] for part in products for factor in part.args]
    return sum(any(sympy.fraction(term)[1] != 1 for term in inner.args) for inner in sums if inner.is_Add)


def _forms(expr: sympy.Expr) -> Iterator[sympy.Expr]:
    """The expression itself and others that equal it."""
    yield expr
    for way in _ways(expr):
        try:
            forms = [way(expr)]
            forms.append(sympy.factor_terms(forms[0]))
        except (PolynomialError, *FAILURES):
            continue  # one way less
        yield from (form for form in forms if not form.has(sympy.I))


def _ways(expr: sympy.Expr) -> Iterator[_Way]:
    """The rearrangements that are cheap enough for an expression of this size."""
    yield sympy.factor_terms
    powers = expr.atoms(sympy.Pow, sympy.exp)
    exponents = [number for power in powers for number in power.exp.atoms(sympy.Rational)]
    if not all(map(_is_low, exponents)) or not all(map(_is_short, expr.atoms(sympy.Rational))):
        return
    if _terms(expr) > MAX_TERMS:
        return
    yield sympy.expand
    yield from _polynomial_ways(expr)
    circular = expr.atoms(TrigonometricFunction)
    angles = [function.args[0] for function in circular | expr.atoms(HyperbolicFunction)]
    if angles and all(_is_plain(angle) for angle in angles):
        if circular:
            yield from _TRIGONOMETRY
        if _has_at_most(MAX_NODES_TO_SEARCH, expr):
            yield sympy.trigsimp
    roots = [power for power in powers if power.exp.is_Rational and not power.exp.is_Integer]
    if roots and all(root.base.is_number for root in roots) and _has_at_most(MAX_NODES_WITH_ROOTS, expr):
        yield sympy.sqrtdenest
        yield sympy.radsimp


def _polynomial_ways(expr: sympy.Expr) -> Iterator[_Way]:
    yield sympy.together
    numerator, denominator = sympy.fraction(sympy.together(expr))
    terms = _terms(numerator) + _terms(denominator)
    if terms <= MAX_TERMS:
        yield sympy.cancel
    if (
        terms <= MAX_TERMS_TO_FACTOR
        and len(expr.atoms(sympy.Symbol, sympy.Function)) <= MAX_SYMBOLS_TO_FACTOR
    ):
        yield sympy.factor


_TRIGONOMETRY: tuple[_Way, ...] = (
    lambda expr: sympy.expand(TR5(sympy.expand(expr))),  # sin^2 = 1 - cos^2
    lambda expr: sympy.expand(TR6(sympy.expand(expr))),  # cos^2 = 1 - sin^2
    lambda expr: TR10i(sympy.expand(TR5(sympy.expand(expr)))),  # sin a cos b + cos a sin b = sin(a + b)
    lambda expr: sympy.expand(TR11(expr)),  # sin 2a = 2 sin a cos a
)


def _is_low(exponent: sympy.Rational) -> bool:
    return max(abs(int(exponent.p)), int(exponent.q)) <= MAX_POWER


def _is_short(number: sympy.Rational) -> bool:
    return max(abs(int(number.p)), int(number.q)) < _TOO_LONG


def _is_plain(angle: sympy.Expr) -> bool:
    """Whether addition theorems may be used: they write out sin(1000 x) in powers of sin(x)."""
    terms = sympy.Add.make_args(angle)
    if len(terms) > MAX_TERMS_OF_AN_ANGLE or any(term.is_Rational for term in terms):
        return False
    parts = list(sympy.preorder_traversal(angle))
    return all(map(_is_low, (part for part in parts if part.is_Rational))) and all(
        isinstance(part, (sympy.Symbol, sympy.Add, sympy.Mul, sympy.Rational)) or part is sympy.pi
        for part in parts
    )


def _has_at_most(nodes: int, expr: sympy.Expr) -> bool:
    return sum(1 for _ in islice(sympy.preorder_traversal(expr), nodes + 1)) <= nodes


def _terms(expr: sympy.Expr) -> int:
    """At most so many terms come of multiplying out an expression, or the arguments in it."""
    parts = [_terms(part) for part in expr.args]
    if expr.is_Add:
        count = sum(parts)
    elif expr.is_Mul:
        count = math.prod(parts)
    elif expr.is_Pow and expr.exp.is_Integer:
        power = min(abs(int(expr.exp)), MAX_TERMS)
        count = math.comb(parts[0] + power - 1, power)
    else:
        count = max(parts, default=1)
    return min(count, MAX_TERMS + 1)


_Powers = dict[sympy.Expr, sympy.Rational]


def _factors(expr: sympy.Expr) -> tuple[sympy.Rational, _Powers]:
    """The rational number in front of an expression, and the powers it is multiplied by."""
    number: sympy.Rational = sympy.S.One
    powers: _Powers = {}
    for factor in sympy.Mul.make_args(sympy.factor_terms(expr)):
        if factor.is_Rational:
            number *= factor
            continue
        base, exponent = factor.as_base_exp()
        if not exponent.is_Rational:
            base, exponent = factor, sympy.S.One
        powers[base] = powers.get(base, sympy.S.Zero) + exponent
    return number, powers


def _nearer(first: sympy.Rational, second: sympy.Rational) -> sympy.Rational:
    """The exponent that two powers have in common: the one nearer to zero, 0 if the signs differ."""
    if (first > 0) != (second > 0):
        return sympy.S.Zero
    return min(first, second, key=abs)


def _quotient(expr: sympy.Expr, number: sympy.Rational, powers: _Powers) -> sympy.Expr:
    if expr == 0:
        return sympy.S.Zero
    own, factors = _factors(expr)
    left = (base ** (exponent - powers.get(base, 0)) for base, exponent in factors.items())
    return sympy.Mul(own / number, *left)
