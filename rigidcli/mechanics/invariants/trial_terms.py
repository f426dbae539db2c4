"""The terms among whose sums conserved quantities are looked for: products of momenta and functions.

The functions of the coordinates are powers, sines and cosines, and what stands in H, alone and multiplied.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from typing import TypeAlias

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Applied, Group, Monomial, Symbol
from rigidcli.algebra.expansion import MAX_STEPS
from rigidcli.algebra.expressions import ONE, Expr, gathered, number, product, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.substitution import substitute
from rigidcli.mechanics.hamilton_equations import Phase

MOST_TERMS = 400
"""The most terms of one sum: n of them make a matrix of about n by n, which takes n^3 steps."""

MOST_WITH_PRODUCTS = 160
"""The most terms of a sum to which products of listed functions are added."""

MOST_TURNING = 360
"""The most terms of a sum with the sine or cosine of an angle that is not in H."""

MOST_PIECES = 60
"""The most products of factors of H that are taken as functions; these are the simplest ones."""

Term: TypeAlias = tuple[Expr, Expr]
"""A function of the coordinates, and the product of momenta by which it is multiplied."""


def parts_of(hamiltonian: Expr, phase: Phase) -> dict[Monomial, Expr]:
    """The terms of H: products of functions of coordinates and momenta, with coefficients of parameters."""
    names = frozenset(phase.names)
    found: dict[Monomial, list[Expr]] = {}
    for monomial, coefficient in _opened(hamiltonian, Allowance(MAX_STEPS)).ordered:
        moving = tuple(factor for factor in monomial if not names.isdisjoint(factor[0].names))
        fixed = {atom: n for atom, n in monomial if names.isdisjoint(atom.names)}
        if moving:
            found.setdefault(moving, []).append(gathered(coefficient, fixed))
    return {moving: total(values) for moving, values in found.items()}


def _opened(e: Expr, allowance: Allowance) -> Expr:
    """Multiplied out, but for what stands in functions, denominators and roots."""
    opened = []
    for monomial, coefficient in e.terms.items():
        part = number(coefficient)
        for atom, n in monomial:
            factor, times = gathered(1, {atom: n}), 1
            if isinstance(atom, Group) and n > 0 and n.denominator == 1:
                factor, times = _opened(atom.inner, allowance), int(n)
            for _ in range(times):
                allowance.spend(len(part.terms) * len(factor.terms))
                part = total(
                    Expr({a: c}) * Expr({b: d})
                    for a, c in part.terms.items()
                    for b, d in factor.terms.items()
                )
        opened.append(part)
    return total(opened)


def trial_sums(hamiltonian: Expr, parts: Iterable[Monomial], phase: Phase) -> list[list[Term]]:
    """The terms of each sum that is looked for; `parts` are those of H.

    If H is even in the momenta, the odd and the even part of a conserved quantity are both conserved, and
    are looked for one after the other.
    """
    parts = list(parts)
    rates = frozenset(phase.momenta)
    kinetic = _pieces((m for m in parts if any(not rates.isdisjoint(atom.names) for atom, _ in m)), rates)
    pieces = _pieces(parts, rates)
    straight, angles = _kinds(parts, phase, curved=len(kinetic) > 1)
    powers = [_powers(straight, degree) for degree in range(3)]
    waves = [apply(function, symbol(q)) for q in angles for function in ("sin", "cos")]
    squares = [a * b for a, b in itertools.combinations_with_replacement(waves, 2)]
    # Functions by themselves, and those that stand with momenta: of these the first list that is short enough
    # is taken. More functions are added where there is room.
    alone = simplest_first([*itertools.chain(*powers), *waves, *products([ONE, *powers[1]], pieces)])[1:]
    more_alone = simplest_first([*products([*powers[2], *waves], pieces), *squares])
    factors = [simplest_first([*itertools.chain(*powers[:most]), *kinetic, *waves]) for most in (3, 2, 1)]
    more_factors = simplest_first(
        [*products([*powers[1], *powers[2]], kinetic), *products([*waves, *squares], [ONE, *kinetic])]
    )
    backwards = substitute(hamiltonian, {p: -symbol(p) for p in phase.momenta})
    sums = []
    for degrees in ((1,), (0, 2)) if backwards == hamiltonian else ((0, 1), (0, 1, 2)):
        momenta = [e for degree in degrees if degree for e in _powers(phase.momenta, degree)]
        resting, more_resting = (alone, more_alone) if 0 in degrees else ([], [])
        most = (MOST_TERMS - len(resting)) // len(momenta)
        moving = next((functions for functions in factors if len(functions) <= most), factors[-1][:most])
        if moving:
            room = max(MOST_WITH_PRODUCTS - len(resting) - len(moving) * len(momenta), 0)
            resting = [*resting, *more_resting[: room // 2]]
            room = max(MOST_WITH_PRODUCTS - len(resting) - len(moving) * len(momenta), 0)
            moving = [*moving, *more_factors[: room // len(momenta)]]
            sums.append([*((e, ONE) for e in resting), *((e, p) for p in momenta for e in moving)])
    used = {name for m in parts for atom, _ in m for name in atom.names}
    sums += [_turning(q, waves, kinetic, phase.momenta) for q in angles if q not in used]
    return [list(dict.fromkeys(terms)) for terms in sums]


def _turning(
    angle: str, waves: Iterable[Expr], kinetic: Iterable[Expr], momenta: Sequence[str]
) -> list[Term]:
    """Terms of degree 1 in the momenta with the sine or cosine of an angle that is not in H.

    H does not mix them with others: the components of an angular momentum across its axis are such sums.
    """
    others = (e for e in waves if angle not in e.names)
    inner = simplest_first(products([ONE, *others], kinetic))[: MOST_TURNING // (2 * len(momenta))]
    functions = products([apply(function, symbol(angle)) for function in ("sin", "cos")], inner)
    return [(e, symbol(p)) for p in momenta for e in functions]


def _powers(names: Iterable[str], degree: int) -> list[Expr]:
    """The products of so many symbols."""
    return [product(map(symbol, some)) for some in itertools.combinations_with_replacement(names, degree)]


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
