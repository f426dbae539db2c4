"""The change of variables that a document asks about: is it canonical, and what becomes of H?"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations

from rigidcli.algebra.arithmetic import sign
from rigidcli.algebra.arithmetic import tidy as in_lowest_terms
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ZERO, Expr, product, symbol, total
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.simplification import shortest, tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trigonometry import exponentials_merged
from rigidcli.algebra.values import is_zero, sample_points
from rigidcli.document.document import Document
from rigidcli.document.variables import Transform
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.mechanics import canonical
from rigidcli.mechanics.canonical import Branch, inverse
from rigidcli.mechanics.hamilton_equations import TIME, Phase, equations
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.system import derived_parameters, known_values


@dataclass(frozen=True, slots=True)
class TransformedSystem:
    """New `names` (coordinates, then momenta), the fundamental brackets, and those that are `wrong`.

    All holds under the `conditions`. H and its equations in the new variables are None where the change is
    not canonical, or they are not found.
    """

    names: tuple[str, ...]
    brackets: dict[str, Expr]
    wrong: tuple[str, ...]
    conditions: tuple[str, ...]
    hamiltonian: Expr | None
    equations: tuple[Expr, ...] | None

    @property
    def canonical(self) -> dict[str, int]:
        """What the brackets of a canonical change are."""
        size = len(self.names) // 2
        return dict(
            zip(self.brackets, (int(b - a == size) for a, b in combinations(range(2 * size), 2)), strict=True)
        )

    @property
    def open_brackets(self) -> list[Expr]:
        """The wrong brackets, where each is a function of symbols that is 1 for a canonical change."""
        size = len(self.names) // 2
        conjugate = [_written(pair) for pair in zip(self.names[:size], self.names[size:], strict=True)]
        found = [self.brackets[name] for name in self.wrong if name in conjugate]
        return found if len(found) == len(self.wrong) and all(e.names for e in found) else []


def transformed(document: Document, transform: Transform, derivation: Derivation) -> TransformedSystem:
    """Judge a change of variables, for all values of the parameters or else for the given ones."""
    new, old = Phase(transform.coordinates, transform.momenta), derivation.phase
    values, pairs, phase = given_side(document, transform, old)
    brackets = canonical.brackets(values, pairs, phase)
    wrong, hamiltonian = canonical.wrong_brackets(brackets, pairs), derivation.hamiltonian
    conditions: tuple[str, ...] = ()
    if wrong:
        known = known_values(document)
        misses = {pair: brackets[pair] - canonical.expected(*pair, pairs) for pair in wrong}
        needed = canonical.positive_names(misses.values(), phase.names)
        if needed is None or any(sign(known[name]) != 1 for name in needed if name in known):
            misses = {pair: substitute(miss, known) for pair, miss in misses.items()}
            needed = canonical.positive_names(misses.values(), phase.names)
            values = {name: substitute(value, known) for name, value in values.items()}
            hamiltonian = None if hamiltonian is None else substitute(hamiltonian, known)
        if needed is None:
            wrong = [pair for pair, miss in misses.items() if not is_zero(miss)]
        else:
            wrong, conditions = [], tuple(f"{name} > 0" for name in needed if name not in known)
    found = None
    if not wrong and hamiltonian is not None:
        with suppress(ComputationError, ExpressionError):
            change = _Change(values, old, new, hamiltonian)
            found = change.from_old() if transform.old is not None else change.from_new()
    if found is not None:
        signs = {name: sign(value) for name, value in known_values(document).items()}
        found = found.shorter([name for name in found.hamiltonian.names - {TIME} if signs.get(name, 1) == 1])
        further = (words for words in found.conditions if words.removesuffix(" > 0") not in signs)
        conditions = tuple(dict.fromkeys([*conditions, *further]))
    return TransformedSystem(
        new.names,
        {
            _written(pair): tidy(value) if pair in wrong else canonical.expected(*pair, pairs)
            for pair, value in brackets.items()
        },
        tuple(map(_written, wrong)),
        conditions,
        None if found is None else found.hamiltonian,
        None if found is None else _equations(found, new, derivation),
    )


def given_side(document: Document, transform: Transform, old: Phase) -> tuple[dict[str, Expr], Phase, Phase]:
    """The given variables as functions of the other ones, the names of the given ones, and of the others."""
    new = Phase(transform.coordinates, transform.momenta)
    given = transform.old if transform.old is not None else transform.new
    assert given is not None
    derived = derived_parameters(document)
    values = {name: from_tree(expression.root, derived) for name, expression in given.items()}
    return (values, old, new) if transform.old is not None else (values, new, old)


def _equations(found: _Found, new: Phase, derivation: Derivation) -> tuple[Expr, ...]:
    """Hamilton's equations in the new variables, with forces where there are some."""
    free = equations(found.hamiltonian, new)
    if not derivation.is_forced or derivation.velocities is None:
        return free
    forces = derivation.forces_of(derivation.velocities)
    added = canonical.added_by_forces(forces, found.old, derivation.phase, new)
    return tuple(rate + force for rate, force in zip(free, added, strict=True))


@dataclass(frozen=True, slots=True)
class _Found:
    """K, the R that was added to H in it, the gradient of R, and the conditions under which K holds.

    `old` has the old variables as functions of the new ones.
    """

    hamiltonian: Expr
    old: Mapping[str, Expr]
    added: Expr
    gradient: list[Expr]
    conditions: tuple[str, ...] = ()

    def shorter(self, names: Collection[str]) -> _Found:
        """The same with K in the form for positive values of names, if it is shorter: sqrt(k/m)."""
        e = self.hamiltonian
        positive = tidy(substitute(e, {name: symbol(name, positive=True) for name in names}))
        form = from_tree(substitute(positive, {name: symbol(name) for name in names}).tree())
        needed = None if len(str(form)) >= len(str(e)) else canonical.positive_names([e - form], ())
        if needed is None:
            return self
        conditions = (*self.conditions, *(f"{name} > 0" for name in needed))
        return replace(self, hamiltonian=form, conditions=conditions)


@dataclass(frozen=True, slots=True)
class _Change:
    """A canonical change from `old` to `new` variables, whose `values` are given on one side, and H."""

    values: Mapping[str, Expr]
    old: Phase
    new: Phase
    hamiltonian: Expr

    def from_old(self) -> _Found | None:
        """K from the old variables as functions of the new ones, and the conditions under which it holds."""
        for found in self._hamiltonians(self.values, self._branch()):
            misses = [found.hamiltonian - found.added - substitute(self.hamiltonian, self.values)]
            slopes = zip(self.new.names, found.gradient, strict=True)
            misses += [slope - derivative(found.added, name) for name, slope in slopes]
            positive = canonical.positive_names(misses, (*self.new.names, TIME))
            if positive is not None:
                return replace(found, conditions=tuple(f"{name} > 0" for name in positive))
        return None

    def from_new(self) -> _Found | None:
        """K from the new variables as functions of the old ones, and the conditions under which it holds.

        The way back is found by solving equations, and what follows from it put to the test: K must be
        what it should for all variables, or for positive ones.
        """
        branch = self._branch()
        old = inverse(self.values, self.new, self.old, branch)
        if old is None:
            return None
        limited = None
        for found in self._hamiltonians(old, branch):
            positive = canonical.positive_names([*self._misses(found)], (*self.old.names, TIME))
            if positive == ():
                return found
            if positive is not None and limited is None:
                limited = replace(found, conditions=tuple(f"{name} > 0" for name in positive))
        return limited

    def _branch(self) -> Branch:
        """A point at which all variables have values; those on the right-hand sides are positive."""
        exprs = (self.hamiltonian, *self.values.values())
        names = {name for e in exprs for name in e.names}.difference(self.values)
        for point in sample_points(sorted(names), {}):
            here = Branch(point)
            values = {name: here.value(e) for name, e in self.values.items()}
            if all(map(math.isfinite, values.values())):
                return Branch({**point, **values})
        return Branch({})

    def _hamiltonians(self, old: Mapping[str, Expr], branch: Branch) -> Iterator[_Found]:
        """K = H + R in the new variables: first with the roots of squares that the branch has."""
        gradient = canonical.added_gradient(old, self.old, self.new)
        added = canonical.potential_of(gradient, self.new.names)
        if added is None:
            # Products of roots may only join where what is under them is positive.
            free = {name: symbol(name) for slope in gradient for name in slope.names - {TIME}}
            positive = {name: symbol(name, positive=True) for name in free}
            added = canonical.potential_of([tidy(substitute(e, positive)) for e in gradient], self.new.names)
            added = None if added is None else substitute(added, free)
        if added is not None:
            for way in branch.with_roots, substitute:
                k = _gathered(way(self.hamiltonian, old) + added, self.new)
                yield _Found(k, old, added, gradient)

    def _misses(self, found: _Found) -> Iterator[Expr]:
        """Functions of the old variables that vanish if the old variables are those that were meant."""
        yield substitute(found.hamiltonian - found.added, self.values) - self.hamiltonian
        size = len(self.new.coordinates)
        for place, slope in enumerate(found.gradient):
            turn, moving = (-1, place + size) if place < size else (1, place - size)
            rate = derivative(self.values[self.new.names[moving]], TIME)
            yield substitute(slope, self.values) - turn * rate


def _gathered(e: Expr, phase: Phase) -> Expr:
    """The expression as a polynomial in the momenta, or else in all variables, with tidy coefficients."""
    e = exponentials_merged(e)
    forms = [tidy(e)]
    for names in (phase.names, phase.momenta):
        with suppress(ExpressionError):
            found = coefficients(e, names)
            if found is not None:
                parts = {
                    powers: product(symbol(n) ** k for n, k in zip(names, powers, strict=True))
                    for powers in found
                }
                forms.append(
                    tidy(total(_coefficient(found[powers]) * part for powers, part in parts.items()))
                )
                break
    return shortest(forms)


def _coefficient(e: Expr) -> Expr:
    """A coefficient in a short form, in lowest terms where these are not too long."""
    if is_zero(e):
        return ZERO
    with suppress(ComputationError):
        return in_lowest_terms(e)
    return tidy(e)


def _written(pair: tuple[str, str]) -> str:
    return f"{{{pair[0]}, {pair[1]}}}"
