"""The old variables of a canonical change as functions of the new ones.

What is found is a candidate: where roots are taken, or an angle is told by its tangent, another one may be
meant, so that the caller checks what follows from it. A matrix M of derivatives of a canonical change is
symplectic, so that its inverse is -J M^T J: no equations are solved for what is linear. Source: V. I. Arnold,
Mathematical Methods of Classical Mechanics, section 41.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction

from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.symbolic.algebra.arithmetic import root_of_either_sign, tidy
from rigidcli.symbolic.algebra.atoms import Applied, Group, Symbol
from rigidcli.symbolic.algebra.calculus import coefficients, derivative, rebuilt, substitute
from rigidcli.symbolic.algebra.expressions import (
    ZERO,
    Expr,
    factored,
    gathered,
    power,
    product,
    symbol,
    total,
)
from rigidcli.symbolic.algebra.functions import apply
from rigidcli.symbolic.mechanics.hamilton_equations import Phase, linear

MOST_TRIALS = 60
"""Unknowns that are put into the other equations at most, in the search for a way through them."""

_PAIRS = (
    *(("sin", "asin"), ("cos", "acos"), ("tan", "atan"), ("exp", "log")),
    *(("sinh", "asinh"), ("cosh", "acosh"), ("tanh", "atanh")),
)
_INVERSES = dict(_PAIRS) | {b: a for a, b in _PAIRS}
"""The function that undoes another one, where that is on its main branch."""


def inverses(values: Mapping[str, Expr], new: Phase, old: Phase) -> Iterator[dict[str, Expr]]:
    """Candidates for the `old` variables as functions of the `new` ones, whose `values` are canonical."""
    with suppress(ExpressionError, ComputationError):
        parts = linear([values[name] for name in new.names], old.names)
        if parts is not None:
            shifted = [symbol(name) - b for name, b in zip(new.names, parts[1], strict=True)]
            yield _of_linear(parts[0], shifted, old)
            return
        half = _half(values, new, old)
        if half is not None:
            yield from half
        else:
            yield from _solutions([symbol(n) - values[n] for n in new.names], old.names, _Trials(MOST_TRIALS))


def _of_linear(matrix: Sequence[Sequence[Expr]], values: Sequence[Expr], old: Phase) -> dict[str, Expr]:
    """M^-1 times values, with M^-1 = -J M^T J."""
    size = len(old.coordinates)
    found = {}
    for place, name in enumerate(old.names):
        other = (place + size) % (2 * size)
        sign = 1 if place < size else -1
        found[name] = sign * total(
            matrix[k + size][other] * values[k] - matrix[k][other] * values[k + size] for k in range(size)
        )
    return found


def _half(values: Mapping[str, Expr], new: Phase, old: Phase) -> Iterator[dict[str, Expr]] | None:
    """Where half of the new variables hold half of the old ones only: the others are linear in the rest."""
    for ours, theirs in ((new.coordinates, new.momenta), (new.momenta, new.coordinates)):
        for alone, rest in ((old.coordinates, old.momenta), (old.momenta, old.coordinates)):
            if all(values[name].names.isdisjoint(rest) for name in ours):
                sign = 1 if (ours == new.coordinates) == (alone == old.coordinates) else -1
                return _of_half(values, (ours, theirs), (alone, rest), sign)
    return None


def _of_half(
    values: Mapping[str, Expr],
    new: tuple[Sequence[str], Sequence[str]],
    old: tuple[Sequence[str], Sequence[str]],
    sign: int,
) -> Iterator[dict[str, Expr]]:
    """Half of the old variables by solving equations, and the others by the derivatives of these."""
    (ours, theirs), (alone, rest) = new, old
    at_rest = dict.fromkeys(rest, ZERO)
    shifted = [symbol(name) - substitute(values[name], at_rest) for name in theirs]
    for found in _solutions([symbol(name) - values[name] for name in ours], alone, _Trials(MOST_TRIALS)):
        others = {
            name: sign * total(derivative(values[a], u) * b for a, b in zip(ours, shifted, strict=True))
            for u, name in zip(alone, rest, strict=True)
        }
        yield found | {name: put(e, found) for name, e in others.items()}


def put(e: Expr, values: Mapping[str, Expr]) -> Expr:
    """The same as `with_roots`, in a short form."""
    return tidy(with_roots(e, values))


def with_roots(e: Expr, values: Mapping[str, Expr]) -> Expr:
    """An expression with names replaced, where a square root of a square may have either sign.

    Tangents are written in sines and cosines.
    """
    return _rooted(substitute(e, values))


def _rooted(e: Expr) -> Expr:
    parts = []
    for monomial, coefficient in e.ordered:
        factors = [gathered(coefficient, {})]
        for atom, n in monomial:
            inner = rebuilt(atom, _rooted)
            if isinstance(atom, Applied) and atom.function == "tan":
                inner = apply("sin", *atom.arguments) / apply("cos", *atom.arguments)
            half = isinstance(atom, Group) and n.denominator == 2
            factors.append(power(root_of_either_sign(inner), 2 * n) if half else power(inner, n))
        parts.append(product(factors))
    return total(parts)


class _Trials:
    """How many more trials there are in a search."""

    def __init__(self, left: int) -> None:
        self.left = left


def _solutions(
    equations: Sequence[Expr], unknowns: Sequence[str], trials: _Trials
) -> Iterator[dict[str, Expr]]:
    """Values of the unknowns for which the equations (expressions that vanish) hold, one after the other.

    One unknown is isolated in one equation and put into the others, the shortest first.
    """
    if not unknowns:
        yield {}
        return
    for equation in sorted(equations, key=lambda e: (len(e.names.intersection(unknowns)), len(e.key))):
        for unknown in unknowns:
            for value in isolated(equation, unknown) if unknown in equation.names else ():
                trials.left -= 1
                if trials.left < 0:
                    return
                with suppress(ExpressionError, ComputationError):
                    here = {unknown: put(value, {})}
                    others = [
                        put(e, here) if unknown in e.names else e for e in equations if e is not equation
                    ]
                    left = [name for name in unknowns if name != unknown]
                    for rest in _solutions(others, left, trials):
                        yield rest | {unknown: put(here[unknown], rest)}


def isolated(e: Expr, name: str) -> Iterator[Expr]:
    """Values of a name for which an expression vanishes, from its operations undone one by one."""
    with suppress(ExpressionError, ComputationError):
        e = put(e, {})
        factors = [atom.inner for atom, n in factored(e)[1] if isinstance(atom, Group) and n > 0]
        for inner in factors if factors != [e] else ():
            yield from isolated(inner, name)
        polynomial = coefficients(e, [name])
        if polynomial is not None:
            yield from _roots({powers[0]: tidy(value) for powers, value in polynomial.items()})
            return
        moving = {factor for monomial in e.terms for factor in monomial if name in factor[0].names}
        for atom, n in sorted(moving, key=lambda factor: factor[0].key):
            holding = [monomial for monomial in e.terms if (atom, n) in monomial]
            factor = gathered(1, {atom: n})
            above = total(Expr({m: e.terms[m]}) for m in holding) / factor
            rest = e - above * factor
            # above atom^n + rest = 0
            if name in above.names or name in rest.names:
                if isinstance(atom, Group) and n.denominator == 2:
                    yield from isolated(above**2 * power(atom.inner, 2 * n) - rest**2, name)
                elif isinstance(atom, Applied) and atom.function == "sin" and n == 1:
                    angle = atom.arguments[0]
                    slope = put(-rest / (above * apply("cos", angle)), {})
                    if name not in slope.names:
                        yield from isolated(angle - apply("atan", slope), name)
                continue
            value = put(-rest / above, {})
            for root in _powers(value, 1 / Fraction(n)):
                if isinstance(atom, Group):
                    yield from isolated(atom.inner - root, name)
                elif isinstance(atom, Symbol):
                    yield root
                elif isinstance(atom, Applied):
                    yield from _undone(atom, root, name)


def _undone(atom: Applied[Expr], value: Expr, name: str) -> Iterator[Expr]:
    """Values of a name for which a function has a value."""
    match atom.function, atom.arguments:
        case "atan2", (y, x):
            yield from isolated(y * apply("cos", value) - x * apply("sin", value), name)
        case "abs", (argument,):
            for sign in 1, -1:
                yield from isolated(argument - sign * value, name)
        case "pow", (base, exponent) if name not in exponent.names:
            yield from isolated(base - value ** (1 / exponent), name)
        case function, (argument,) if function in _INVERSES:
            yield from isolated(argument - apply(_INVERSES[function], value), name)


def _roots(polynomial: Mapping[int, Expr]) -> Iterator[Expr]:
    """The roots of a polynomial with one power, or with one and its square."""
    first, *others = sorted(n for n, value in polynomial.items() if n and not value.is_zero)
    rest = polynomial.get(0, ZERO)
    if not others:
        yield from _powers(tidy(-rest / polynomial[first]), Fraction(1, first))
    elif others == [2 * first]:
        a, b = polynomial[2 * first], polynomial[first]
        root = root_of_either_sign(b**2 - 4 * a * rest)
        for square in (-b + root) / (2 * a), (-b - root) / (2 * a):
            yield from _powers(square, Fraction(1, first))


def _powers(value: Expr, exponent: Fraction) -> Iterator[Expr]:
    """A power, and its negative where that has the same inverse."""
    root: Callable[[Expr], Expr] = (
        root_of_either_sign if exponent == Fraction(1, 2) else lambda x: power(x, exponent)
    )
    found = root(value)
    yield found
    if exponent.denominator % 2 == 0:
        yield -found
