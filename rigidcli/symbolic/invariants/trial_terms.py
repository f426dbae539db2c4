"""The terms among whose sums conserved quantities are looked for: products of momenta and functions.

The functions of the coordinates are powers, sines and cosines, and what stands in H, alone and multiplied.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeAlias

from rigidcli.symbolic.algebra.atoms import Applied, Atom, Group, Monomial, Symbol
from rigidcli.symbolic.algebra.calculus import expand, substitute
from rigidcli.symbolic.algebra.expressions import ONE, Expr, gathered, number, power, product, symbol, total
from rigidcli.symbolic.algebra.functions import apply
from rigidcli.symbolic.algebra.roots import Rational
from rigidcli.symbolic.mechanics.hamilton_equations import Phase

MOST_TERMS = 400
"""Of one sum; longer lists are cut."""

MOST_WITH_PRODUCTS = 160
"""Terms of one sum, up to which products of listed functions are added to the list."""

MOST_PIECES = 60
"""Parts of H that are taken as functions."""

Term: TypeAlias = tuple[Expr, tuple[int, ...]]
"""A function of the coordinates, and the places of the momenta by which it is multiplied: (0, 0) is p^2."""


@dataclass(frozen=True, slots=True)
class Sector:
    """The terms of one sum; complete if none of the list had to be left out."""

    terms: tuple[Term, ...]
    complete: bool


def parts_of(hamiltonian: Expr, phase: Phase) -> dict[Monomial, Expr]:
    """The terms of H: products of functions of coordinates and momenta, with coefficients of parameters."""
    names = frozenset(phase.names)
    found: dict[Monomial, list[Expr]] = {}
    for monomial, coefficient in _opened(hamiltonian).ordered:
        moving = tuple(factor for factor in monomial if not names.isdisjoint(factor[0].names))
        fixed = {atom: n for atom, n in monomial if names.isdisjoint(atom.names)}
        if moving:
            found.setdefault(moving, []).append(gathered(coefficient, fixed))
    return {moving: total(values) for moving, values in found.items()}


def _opened(e: Expr) -> Expr:
    """Multiplied out, but for what stands in functions, denominators and roots."""
    hidden: dict[str, Expr] = {}

    def hide(inner: Expr) -> Expr:
        return total(
            product([number(coefficient), *(hide_power(atom, n) for atom, n in monomial)])
            for monomial, coefficient in inner.terms.items()
        )

    def hide_power(atom: Atom, n: Rational) -> Expr:
        if isinstance(atom, Group) and n > 0 and n.denominator == 1:
            return power(hide(atom.inner), n)
        if not isinstance(atom, (Group, Applied)):
            return gathered(1, {atom: n})
        name = f"({atom.key})"
        hidden[name] = gathered(1, {atom: 1})
        return power(symbol(name), n)

    return substitute(expand(hide(e)), hidden)


def sectors(hamiltonian: Expr, parts: Iterable[Monomial], phase: Phase) -> list[Sector]:
    """The terms of each sum that is looked for; `parts` are those of H."""
    parts = list(parts)
    rates = frozenset(phase.momenta)
    kinetic = _pieces((m for m in parts if any(not rates.isdisjoint(atom.names) for atom, _ in m)), rates)
    pieces = _pieces(parts, rates)
    straight, angles = _kinds(parts, phase, curved=len(kinetic) > 1)
    powers = [
        [product(map(symbol, names)) for names in itertools.combinations_with_replacement(straight, degree)]
        for degree in range(3)
    ]
    waves = [apply(function, symbol(q)) for q in angles for function in ("sin", "cos")]
    squares = [a * b for a, b in itertools.combinations_with_replacement(waves, 2)]
    resting = simplest_first([*itertools.chain(*powers), *waves, *products([ONE, *powers[1]], pieces)])
    more_resting = simplest_first([*products([*powers[2], *waves], pieces), *squares])
    moving = [
        simplest_first([*itertools.chain(*powers[:most]), *kinetic, *waves])
        for most in range(len(powers), 0, -1)
    ]
    more_moving = simplest_first(
        [*products([*powers[1], *powers[2]], kinetic), *products([*waves, *squares], [ONE, *kinetic])]
    )
    return [
        _chosen(len(phase.momenta), degrees, moving, more_moving, resting, more_resting)
        for degrees in _degrees(hamiltonian, phase)
    ]


def _degrees(hamiltonian: Expr, phase: Phase) -> tuple[tuple[int, ...], ...]:
    """The degrees in the momenta that stand together in one sum.

    If H is even in the momenta, the odd and the even part of a conserved quantity are both conserved.
    """
    backwards = substitute(hamiltonian, {p: -symbol(p) for p in phase.momenta})
    return ((1,), (0, 2)) if backwards == hamiltonian else ((0, 1), (0, 1, 2))


def _chosen(
    size: int,
    degrees: Sequence[int],
    moving: Sequence[Sequence[Expr]],
    more_moving: Sequence[Expr],
    resting: Sequence[Expr],
    more_resting: Sequence[Expr],
) -> Sector:
    """Functions times products of momenta, and by themselves if degree 0 is among the `degrees`.

    Of the lists that are `moving` the first is taken that is not too long, and more if there is room.
    """
    momenta = [
        places
        for degree in degrees
        if degree
        for places in itertools.combinations_with_replacement(range(size), degree)
    ]
    alone = dict.fromkeys(e for e in resting if 0 in degrees and e != ONE)
    most = (MOST_TERMS - len(alone)) // len(momenta)
    fitting = [functions for functions in moving if len(functions) <= most]
    if not fitting:
        return Sector((), complete=False)
    room = max(MOST_WITH_PRODUCTS - len(alone) - len(fitting[0]) * len(momenta), 0)
    if 0 in degrees:
        alone |= dict.fromkeys(e for e in more_resting[: room // 2] if e != ONE)
    room = max(MOST_WITH_PRODUCTS - len(alone) - len(fitting[0]) * len(momenta), 0)
    factors = dict.fromkeys([*fitting[0], *more_moving[: room // len(momenta)]])
    terms = (*((e, ()) for e in alone), *((e, places) for places in momenta for e in factors))
    return Sector(terms, complete=len(fitting) == len(moving))


def _pieces(parts: Iterable[Monomial], momenta: frozenset[str]) -> list[Expr]:
    """Products of factors of H that hold no momenta; also roots of squares, and the next power of sums."""
    found = [ONE]
    for monomial in parts:
        factors = [(atom, n) for atom, n in monomial if atom.names.isdisjoint(momenta)]
        choices = [
            [0, n, *([n / Fraction(2)] if n % 2 == 0 else []), *([n + 1] if isinstance(atom, Group) else [])]
            for atom, n in factors
        ]
        found.extend(
            gathered(1, {atom: n for (atom, _), n in zip(factors, powers, strict=True)})
            for powers in itertools.islice(itertools.product(*choices), MOST_PIECES)
        )
    return simplest_first(found)[:MOST_PIECES]


def _kinds(parts: Iterable[Monomial], phase: Phase, curved: bool) -> tuple[list[str], list[str]]:
    """The coordinates that are taken by themselves, and those of which sines and cosines are taken.

    They are used as in H. One that is not in H can be an angle if momenta stand there with functions.
    """
    found = set(itertools.chain.from_iterable(_uses(Expr({m: 1})) for m in parts))
    straight = [q for q in phase.coordinates if (q, False) in found or (q, True) not in found]
    angles = [q for q in phase.coordinates if (q, True) in found or (curved and (q, False) not in found)]
    return straight, angles


def _uses(e: Expr, angle: bool = False) -> Iterator[tuple[str, bool]]:
    """The symbols in an expression, each with whether it stands in an angle."""
    for atom in e.atoms:
        if isinstance(atom, Symbol):
            yield atom.name, angle
        elif isinstance(atom, Group):
            yield from _uses(atom.inner, angle)
        elif isinstance(atom, Applied):
            for argument in atom.arguments:
                yield from _uses(argument, angle or atom.function in ("sin", "cos", "tan"))


def simplest_first(functions: Iterable[Expr]) -> list[Expr]:
    """Each once, the simplest first."""
    return sorted(dict.fromkeys(functions), key=lambda e: (e != ONE, len(e.key), e.key))


def products(left: Iterable[Expr], right: Iterable[Expr]) -> list[Expr]:
    """Each on the left times each on the right."""
    return [a * b for a, b in itertools.product(left, right)]
