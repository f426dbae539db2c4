"""Values put into expressions: trees worked out, and symbols, atoms or their powers replaced."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from fractions import Fraction

from rigidcli.algebra.atoms import Applied, Atom, Group, Pi, Symbol
from rigidcli.algebra.bounds import MAX_BITS, Rational
from rigidcli.algebra.expressions import ZERO, Expr, atomic, gathered, number, power, product, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.errors import ExpressionError
from rigidcli.language.tree import Kind, Node, fold


def from_tree(node: Node, values: Mapping[str, Expr] | None = None) -> Expr:
    """The expression of a tree; names without a value become symbols, decimals the fractions they spell."""
    known = values or {}
    e: Expr = fold(node, lambda name: known[name] if name in known else symbol(name), _EXPRESSIONS)
    return e


def _number(text: str, value: float) -> Expr:
    if text == "pi":
        return atomic(Pi())
    exponent = text.lower().partition("e")[2]
    if abs(int(exponent or 0)) > MAX_BITS:
        raise ExpressionError("the value is too large")
    return number(Fraction(text))


_EXPRESSIONS = Kind(
    number=_number,
    negative=lambda e: -e,
    sum=lambda terms: total([-e if is_subtracted else e for is_subtracted, e in terms]),
    product=lambda factors: product([power(e, -1) if divides else e for divides, e in factors]),
    power=lambda base, exponent: base**exponent,
    call=lambda function, arguments: apply(function, *arguments),
)


def substitute(e: Expr, values: Mapping[str, Expr]) -> Expr:
    """The expression with symbols replaced, all at once."""
    names = frozenset(values)

    def replaced(atom: Atom) -> Expr | None:
        if names.isdisjoint(atom.names):
            return None
        if isinstance(atom, Symbol):
            return values[atom.name]
        return rebuilt(atom, whole)

    def whole(inner: Expr) -> Expr:
        return inner if names.isdisjoint(inner.names) else mapped(inner, replaced)

    return whole(e)


def without(e: Expr, vanishing: Collection[Atom]) -> Expr:
    """The expression where some of its atoms vanish."""

    def whole(inner: Expr) -> Expr:
        return mapped(inner, lambda atom: ZERO if atom in vanishing else rebuilt(atom, whole))

    return whole(e) if vanishing else e


def rebuilt(atom: Atom, change: Callable[[Expr], Expr]) -> Expr:
    """A function of changed arguments, or a changed group."""
    if isinstance(atom, Applied):
        return apply(atom.function, *[change(argument) for argument in atom.arguments])
    if isinstance(atom, Group):
        return change(atom.inner)
    return atomic(atom)


def mapped(e: Expr, change: Callable[[Atom], Expr | None]) -> Expr:
    """The expression with atoms changed, each worked out once; None leaves one as it is."""
    changes = {atom: change(atom) for atom in e.atoms}

    def raised(atom: Atom, exponent: Rational) -> Expr | None:
        value = changes[atom]
        return None if value is None else power(value, exponent)

    return with_powers(e, raised)


def with_powers(e: Expr, change: Callable[[Atom, Rational], Expr | None]) -> Expr:
    """The expression with powers of atoms changed, each worked out once; None leaves one as it is."""
    changes = {factor: change(*factor) for monomial in e.terms for factor in monomial}
    changed = {factor: value for factor, value in changes.items() if value is not None}
    if not changed:
        return e
    parts = []
    for monomial, coefficient in e.terms.items():
        kept = {atom: n for atom, n in monomial if (atom, n) not in changed}
        values = [changed[factor] for factor in monomial if factor in changed]
        whole = gathered(coefficient, kept) if values else Expr({monomial: coefficient})
        parts.append(product([whole, *values]))
    return total(parts)
