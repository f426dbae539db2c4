"""A Lagrangian sorted by how it depends on the velocities, in whatever form it was typed.

    L = polynomial in the velocities + sum of A f(u)^n

Here u is a polynomial in the velocities, f one of the functions of the expression language or nothing, and
n a number that is not natural unless there is an f. Sums that hold velocities are multiplied out, roots in
one product become one root, and a factor that is a multiple of what stands under its root goes under it:
(1 - v^2)/sqrt(1 - v^2) is sqrt(1 - v^2).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import combinations

from rigidcli.algebra.atoms import Applied, Group, Monomial, Symbol
from rigidcli.algebra.expansion import Polynomial, coefficients
from rigidcli.algebra.expressions import Expr, atomic, gathered, power, product, symbol, total
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.values import is_zero


@dataclass(frozen=True, slots=True)
class Kernel:
    """The term `factor` f(u)^n of a Lagrangian: `function` is f, or empty for a power of u itself.

    `argument` is u, a polynomial in the velocities, and `exponent` is n.
    """

    factor: Expr
    function: str
    argument: Polynomial
    exponent: Fraction

    @property
    def places(self) -> set[int]:
        """The places of the velocities that it depends on."""
        return {place for powers in self.argument for place in places_in(powers)}

    def restricted(self, places: Sequence[int]) -> Kernel:
        """The same with the velocities at these places alone, in this order."""
        return replace(self, argument=restricted(self.argument, places))


def places_in(powers: Sequence[int]) -> set[int]:
    """The places of the velocities in a product of powers."""
    return {place for place, n in enumerate(powers) if n}


def restricted(found: Polynomial, places: Sequence[int]) -> Polynomial:
    """A polynomial in some of the velocities only, those at these places."""
    return {tuple(powers[place] for place in places): e for powers, e in found.items()}


def sorted_terms(e: Expr, velocities: Sequence[str]) -> tuple[Polynomial, list[Kernel]] | None:
    """The polynomial and the further terms of a Lagrangian; None if it has a term of another kind.

    Raises ExpressionError where there are too many terms.
    """
    known = _Factors(velocities)
    known.replaced(e)  # From all terms together the lowest exponents are known.
    replaced = known.replaced(e)
    names = [factor.name for factor in known.found]
    found = None if known.failed else coefficients(replaced, [*velocities, *names])
    if found is None:
        return None
    size = len(velocities)
    parts: list[Polynomial] = [{} for _ in names]
    polynomial: Polynomial = {}
    for powers, value in found.items():
        own, others = powers[:size], powers[size:]
        if sum(others) > 1:
            return None
        (parts[others.index(1)] if any(others) else polynomial)[own] = value
    kernels = []
    for factor, part in zip(known.found, parts, strict=True):
        exponent = factor.exponent
        while not factor.function and (ratio := ratio_of(part, factor.argument)) is not None:
            part, exponent = {(0,) * size: ratio}, exponent + 1
        if exponent == 0:
            polynomial = _sum(polynomial, part)
        elif set(part) == {(0,) * size}:
            argument = factor.argument
            if factor.function == "exp":
                argument, exponent = {powers: exponent * e for powers, e in argument.items()}, Fraction(1)
            kernels.append(Kernel(part[(0,) * size], factor.function, argument, exponent))
        elif part:
            return None
    return (
        {powers: e for powers, e in polynomial.items() if sum(powers) <= 2 or not is_zero(e)},
        _hyperbolic([kernel for kernel in kernels if not is_zero(kernel.factor)]),
    )


def _hyperbolic(kernels: list[Kernel]) -> list[Kernel]:
    """The same with cosh or sinh for two exponentials that make one."""
    exponentials = [kernel for kernel in kernels if kernel.function == "exp"]
    for first, second in combinations(exponentials, 2):
        opposite = {powers: -e for powers, e in second.argument.items()}
        for function, sign in (("cosh", 1), ("sinh", -1)):
            if _are_equal(first.argument, opposite) and is_zero(first.factor - sign * second.factor):
                others = [kernel for kernel in kernels if kernel not in (first, second)]
                return [*others, replace(first, factor=2 * first.factor, function=function)]
    return kernels


def _sum(left: Polynomial, right: Polynomial) -> Polynomial:
    zero = total([])
    return {powers: left.get(powers, zero) + right.get(powers, zero) for powers in {**left, **right}}


def ratio_of(left: Polynomial, right: Polynomial) -> Expr | None:
    """What one polynomial is times another; None if they are not proportional."""
    if left.keys() != right.keys() or len(left) < 2:
        return None
    first = next(iter(right))
    ratio = tidy(left[first] / right[first])
    return ratio if _are_equal(left, {powers: ratio * e for powers, e in right.items()}) else None


def _are_equal(left: Polynomial, right: Polynomial) -> bool:
    return left.keys() == right.keys() and all(is_zero(left[powers] - right[powers]) for powers in left)


@dataclass(slots=True)
class _Factor:
    """A function or power of a polynomial in the velocities, for which a symbol of this name stands."""

    name: str
    function: str
    argument: Polynomial
    exponent: Fraction


class _Factors:
    """All functions and powers of polynomials in the velocities; `failed` if others were met."""

    def __init__(self, velocities: Sequence[str]) -> None:
        self.velocities = velocities
        self.found: list[_Factor] = []
        self.failed = False

    def replaced(self, e: Expr) -> Expr:
        """An expression that is a polynomial in the velocities and the names of such factors."""
        if e.names.isdisjoint(self.velocities):
            return e
        return total(
            product([Expr({(): coefficient}), *self._of_term(monomial)])
            for monomial, coefficient in e.terms.items()
        )

    def _of_term(self, monomial: Monomial) -> Iterator[Expr]:
        roots: dict[Fraction, list[Expr]] = {}
        for atom, n in monomial:
            natural = n.denominator == 1 and n > 0
            if atom.names.isdisjoint(self.velocities) or (natural and isinstance(atom, Symbol)):
                yield gathered(1, {atom: n})
            elif isinstance(atom, Group) and natural:
                yield power(self.replaced(atom.inner), n)
            elif isinstance(atom, Applied) and len(atom.arguments) == 1:
                yield self._factor(atom.function, atom.arguments[0], Fraction(n))
            else:
                inner = atom.inner if isinstance(atom, Group) else atomic(atom)
                roots.setdefault(Fraction(n), []).append(inner)
        for n, inners in roots.items():
            yield self._factor("", product(inners), n)

    def _factor(self, function: str, inner: Expr, exponent: Fraction) -> Expr:
        """A power of a function of a polynomial, by the symbol of one that is known if there is one."""
        found = coefficients(inner, self.velocities)
        if found is None:
            self.failed = True
            return inner
        argument = {powers: e for powers, value in found.items() if not (e := tidy(value)).is_zero}
        for known in self.found:
            step = exponent - known.exponent
            same = known.function == function and step.denominator == 1 and (step == 0 or not function)
            if same and _are_equal(known.argument, argument):
                known.exponent = min(known.exponent, exponent)
                return product([power(inner, max(step, Fraction(0))), symbol(known.name)])
        # No name of a document has a blank.
        name = f"factor {len(self.found)}"
        self.found.append(_Factor(name, function, argument, exponent))
        return symbol(name)
