"""The motion that equations are held against: its states, and how every derivative follows from them.

A state has values of `functions` of the time: coordinates, or whatever the equations are for. With momenta
or velocities of their own name beside them, which are `auxiliary`, first-order equations for both, and
equations of second order for the functions alone, say the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.grading.expressions.formula import Domain, Vocabulary, draw, spellings
from rigidcli.grading.values import Points
from rigidcli.model.variables import acceleration, momentum, velocity
from rigidcli.symbolic.algebra.calculus import derivative
from rigidcli.symbolic.algebra.expressions import Expr, symbol
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language.tree import Name, Node, Product, Sum
from rigidcli.symbolic.mechanics.energies import TIME

STATES = 12
"""At which equations are tried."""

DRAWN = 60
"""Random states among which those are looked for."""

REAL: Domain = "real"
"""Of coordinates, momenta and rates."""

POSITIVE: Domain = "positive"
"""Of parameters and the time."""

WIDE = (1, 4)
"""Of the scales of `formula.SCALES`, by their places, those too wide to tell ranks by."""

SINGULAR = 1e-6
"""A singular value below this, in units of the largest, is rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """What moves, and how.

    `second` has the functions whose second derivatives are known, `rates` the derivatives that the key tells.
    `domains` has all that is independent: states, parameters and the time; `parameters` those derived
    from others. `known` has the trees of all further names, derivatives above all, each from those before.
    """

    functions: tuple[str, ...]
    second: tuple[str, ...]
    auxiliary: tuple[str, ...]
    rates: Mapping[str, Expr]
    domains: Mapping[str, Domain]
    parameters: Mapping[str, Node] = field(default_factory=dict)
    known: Mapping[str, Node] = field(default_factory=dict)
    momenta: tuple[str, ...] = ()

    @property
    def tops(self) -> tuple[str, ...]:
        """The highest derivative of each function."""
        return tuple(acceleration(f) if f in self.second else velocity(f) for f in self.functions)

    @property
    def middles(self) -> tuple[str, ...]:
        """First derivatives of functions that have second ones."""
        return tuple(map(velocity, self.second))

    @property
    def auxiliary_rates(self) -> tuple[str, ...]:
        """Derivatives of what is auxiliary."""
        return tuple(map(velocity, self.auxiliary))

    @property
    def jets(self) -> tuple[str, ...]:
        """All that equations may be solved for: derivatives, and what is auxiliary."""
        return (*self.tops, *self.auxiliary_rates, *self.auxiliary, *self.middles)

    @property
    def first_order(self) -> bool:
        """Whether the key has no second derivatives."""
        return all(name not in self.rates for name in map(acceleration, self.functions))

    @property
    def told(self) -> dict[str, str]:
        """The derivative that the key tells, of each function and of what is auxiliary."""
        return {
            name: next(rate for rate in (acceleration(name), velocity(name)) if rate in self.rates)
            for name in self.names
            if velocity(name) in self.rates or acceleration(name) in self.rates
        }

    @property
    def names(self) -> tuple[str, ...]:
        """All functions, with what is auxiliary."""
        return self.functions + self.auxiliary

    def vocabulary(self, told: bool) -> Vocabulary:
        """The names that an answer may use."""
        every = (*self.names, *self.middles, *self.auxiliary_rates, *self.tops)
        names = {**dict.fromkeys(every, REAL), **self.domains}
        other = spellings(names, self.momenta, self.middles or self.tops)
        short = [(spelling, meant) for spelling, meant in other.items() if meant in self.names]
        for name, meant in [*((name, name) for name in self.names), *short]:
            for spelling, rate in _respelled(name, meant):
                if rate in names and spelling not in names:
                    other.setdefault(spelling, rate)
        return Vocabulary(names, self.parameters, other, told)

    def states(self) -> Points:
        """Random states with all derivatives. Raises ValueProblem where there are too few."""
        vocabulary = Vocabulary(self.domains, {**self.parameters, **self.known})
        points = draw(vocabulary, DRAWN)
        bad = np.zeros(DRAWN, dtype=bool)
        for name in (*self.parameters, *self.known):
            bad |= ~np.isfinite(points.floats[name])
        narrow = np.array([place % 5 not in WIDE for place in range(DRAWN)])
        good = [*np.flatnonzero(~bad & narrow)[: STATES - 3], *np.flatnonzero(~bad & ~narrow)[:3]]
        if len(good) < STATES:
            raise ValueProblem("the equations have no values at most random states")
        return points.some(good)


def _respelled(name: str, meant: str) -> list[tuple[str, str]]:
    """Other spellings of derivatives: `x_dot`, `xdotdot`, of a momentum `pdot_x` and `pdot`."""
    first, second = velocity(meant), acceleration(meant)
    pairs = [
        (velocity(name), first),
        (f"{name}_dot", first),
        (acceleration(name), second),
        (f"{name}_ddot", second),
        (f"{name}dotdot", second),
    ]
    head, _, tail = name.partition("_")
    if tail:
        pairs += [(f"{head}dot_{tail}", first), (f"{head}_dot_{tail}", first), (f"{head}ddot_{tail}", second)]
    return pairs


def paired(names: Sequence[str], rates: Mapping[str, Expr]) -> tuple[str, ...]:
    """The functions among `names` that are momenta, or else velocities, of the others; () for neither."""
    momenta = tuple(momentum(name) for name in names if momentum(name) in names)
    if len(momenta) * 2 == len(names):
        return momenta
    singles = {name: _single(rates[velocity(name)]) for name in names}
    moved = {name: single for name, single in singles.items() if single in names}
    velocities = tuple(dict.fromkeys(single for single in moved.values() if single not in moved))
    return velocities if len(velocities) * 2 == len(names) == 2 * len(moved) else ()


def _single(e: Expr) -> str:
    """The symbol that an expression is."""
    name = next(iter(e.names), "")
    return name if e == symbol(name) else ""


def with_derivatives(motion: Motion) -> Motion:
    """The motion with the trees of all its derivatives.

    Where first-order rates of auxiliary functions determine the state, second derivatives follow by
    d/dt f(q, a, t) = sum_z df/dz zdot + df/dt.
    """
    known: dict[str, Node] = {name: to_tree(e) for name, e in motion.rates.items()}
    plain = _changed(motion, motion.names, (), (), known)
    if not motion.first_order or not motion.auxiliary:
        return _changed(motion, motion.functions, motion.second, motion.auxiliary, {**known, **motion.known})
    try:
        chains = {acceleration(f): _chain(motion.rates[velocity(f)], motion.names) for f in motion.functions}
        slopes = [
            [derivative(motion.rates[velocity(f)], a) for a in motion.auxiliary] for f in motion.functions
        ]
    except ExpressionError:
        return plain
    if not _is_regular(slopes, plain):
        return plain
    return _changed(motion, motion.functions, motion.functions, motion.auxiliary, known | chains)


def _changed(
    motion: Motion,
    functions: tuple[str, ...],
    second: tuple[str, ...],
    auxiliary: tuple[str, ...],
    known: Mapping[str, Node],
) -> Motion:
    return Motion(
        functions, second, auxiliary, motion.rates, motion.domains, motion.parameters, known, motion.momenta
    )


def _chain(e: Expr, names: Sequence[str]) -> Node:
    """The derivative by time, in which the rates of the names stay names."""
    terms: list[Node] = [
        Product((to_tree(slope), Name(velocity(name))))
        for name in names
        if not (slope := derivative(e, name)).is_zero
    ]
    terms.append(to_tree(derivative(e, TIME)))
    return terms[0] if len(terms) == 1 else Sum(tuple(terms))


def _is_regular(matrix: Sequence[Sequence[Expr]], motion: Motion) -> bool:
    """Whether the determinant of a square matrix is not zero almost everywhere."""
    points = motion.states()
    rows = [[points.at(to_tree(entry)).value for entry in row] for row in matrix]
    found = np.moveaxis(np.array(rows, dtype=np.float64), -1, 0)
    found = found[np.isfinite(found).all(axis=(1, 2))]
    if not len(found) or found.shape[1] != found.shape[2]:
        return False
    sizes = np.linalg.svd(found, compute_uv=False)
    return bool(np.median(sizes[:, -1] / np.maximum(sizes[:, 0], 1e-300)) > SINGULAR)
