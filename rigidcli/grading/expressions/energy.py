"""Energies under the mistakes that students make: worked out again from the right one.

H(q, p) is V = H(q, 0), and T for the rest, if it is the same for -p: so it is for a particle in a potential,
and at any speed, but not in a magnetic field. In the same way L is T - V.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction

from rigidcli.errors import ExpressionError
from rigidcli.symbolic.algebra.atoms import Monomial, Symbol
from rigidcli.symbolic.algebra.calculus import expand, substitute
from rigidcli.symbolic.algebra.expressions import ZERO, Expr, symbol
from rigidcli.symbolic.algebra.reading import from_tree
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.algebra.values import is_zero
from rigidcli.symbolic.language.tree import Node, Sum

MOST_TERMS = 60
"""Of an expression of which each may be the one that is wrong."""


@dataclass(frozen=True, slots=True)
class Parts:
    """An energy as the sum of what moves and of what is left at rest."""

    moving: Expr
    resting: Expr


def split(energy: Expr, rates: Sequence[str]) -> Parts | None:
    """The parts of an energy in these momenta or velocities; None where it cannot be told apart."""
    rates = [name for name in rates if name in energy.names]
    if not rates:
        return None
    with suppress(ExpressionError):
        resting = substitute(energy, dict.fromkeys(rates, ZERO))
        back = substitute(energy, {name: -symbol(name) for name in rates})
        if is_zero(energy - back):
            return Parts(energy - resting, resting)
    return None


def mistaken(
    tree: Node, coordinates: Sequence[str], rates: Sequence[str], *, is_energy: bool, is_lagrangian: bool
) -> Iterator[tuple[str, Node]]:
    """Codes, and what comes out under them; an energy is taken apart into T and V."""
    try:
        e = from_tree(tree)
    except ExpressionError:
        return
    yield "sign_error", to_tree(-e)
    found = split(e, rates) if is_energy else None
    if found is not None:
        moving, resting = found.moving, found.resting
        yield (
            ("potential_sign" if is_lagrangian else "lagrangian_or_potential_sign"),
            to_tree(moving - resting),
        )
        for factor in (Fraction(2), Fraction(1, 2)):
            yield "kinetic_factor", to_tree(factor * moving + resting)
    for uncoupled in _uncoupled(e, coordinates, rates):
        yield "coupling_term_missing", to_tree(uncoupled)


def _uncoupled(e: Expr, coordinates: Sequence[str], rates: Sequence[str]) -> Iterator[Expr]:
    """The expression without products of several coordinates, of several momenta, or of either."""
    with suppress(ExpressionError):
        e = expand(e)
        for names in (coordinates, rates):
            kept = {term: factor for term, factor in e.terms.items() if not _couples(term, names)}
            if len(kept) < len(e.terms):
                yield Expr(kept)
        kept = {
            term: factor
            for term, factor in e.terms.items()
            if not (_couples(term, coordinates) or _couples(term, rates))
        }
        if len(kept) < len(e.terms):
            yield Expr(kept)


def _couples(term: Monomial, names: Sequence[str]) -> bool:
    """Whether several of the names are multiplied in a term."""
    return sum(isinstance(atom, Symbol) and atom.name in names for atom, _ in term) > 1


def additive_terms(tree: Node) -> tuple[Node, ...]:
    """The terms of a sum, as it is written and multiplied out."""
    written = tree.terms if isinstance(tree, Sum) else ()
    out: tuple[Node, ...] = ()
    with suppress(ExpressionError):
        e = expand(from_tree(tree))
        if 1 < len(e.terms) <= MOST_TERMS:
            out = tuple(to_tree(Expr({term: factor})) for term, factor in e.terms.items())
    return (*written[:MOST_TERMS], *out)
