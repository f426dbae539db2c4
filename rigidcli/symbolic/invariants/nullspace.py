"""Sums of terms that are conserved for one set of parameters, in floats.

The rates {f, H} of the terms f at random points of phase space make a matrix whose null space they are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ComputationError
from rigidcli.symbolic.algebra.calculus import derivative
from rigidcli.symbolic.algebra.expressions import Expr, product, symbol
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.invariants.trial_terms import Term
from rigidcli.symbolic.language import code
from rigidcli.symbolic.language.text import text
from rigidcli.symbolic.mechanics.hamilton_equations import Phase

SPARE = 12
"""Points beyond the number of terms."""

BATCH = 16
"""Points are made in multiples of so many, so that tables can be used again."""

DEPENDENT = 1e-11
"""What is left of a column (of unit length) that is a combination of others, at most."""

ABSENT = 1e-6
"""Entries below this, beside the largest of a vector, are zero."""

SAME = 1e-8
"""Relative difference of equal coefficients."""

LARGE = 1e100
"""Points with values beyond this are passed over."""

RANGES = ((-2.0, 2.0), (0.3, 1.7), (0.02, 0.5))
"""Of coordinates and momenta; the next is taken where H has too few values in one."""

TRIES = 12
"""Random values of the parameters among which some with values of H are looked for."""

STRETCH = 1.2
"""Parameters are between exp(-STRETCH) and exp(STRETCH)."""

COEFFICIENT_LENGTH = 6
"""About as much longer is a text by a coefficient that is not 1 or -1, or by a sign."""


class Table:
    """H, known quantities and terms at random points, for any number of sets of parameters.

    `points` are the values of the `parameters` in the sets that were used so far.
    """

    __slots__ = ("_flow", "_functions", "_given", "_phase", "_slopes", "_tables", "parameters", "points")

    def __init__(self, hamiltonian: Expr, phase: Phase, known: Sequence[Expr], terms: Iterable[Term]) -> None:
        self._phase = phase
        functions = list(dict.fromkeys(function for function, _ in terms))
        slopes = {(e, q): derivative(e, q) for e in functions for q in phase.coordinates if q in e.names}
        given = [derivative(e, name) for e in (hamiltonian, *known) for name in phase.names]
        expressions = [*given, *functions, *slopes.values()]
        self._given = len(given)
        self._functions = {e: len(given) + i for i, e in enumerate(functions)}
        self._slopes = {pair: len(given) + len(functions) + i for i, pair in enumerate(slopes)}
        self.points: dict[int, list[float]] = {}
        self._tables: dict[tuple[int, int], tuple[Floats, Floats]] = {}
        names = set().union(*(e.names for e in expressions))
        self.parameters = sorted(names - set(phase.names))
        self._flow = code.function([to_tree(e) for e in expressions], [*phase.names, *self.parameters], {})

    def product(self, term: Term) -> Expr:
        """A term as an expression."""
        function, places = term
        return product([function, *(symbol(self._phase.momenta[place]) for place in places)])

    def gradients(self, which: int, terms: Sequence[Term], count: int) -> tuple[Floats, Floats]:
        """Gradients at `count` points with one set of parameters.

        First those of H and what is known (points by these by 2n), then of the terms (points by terms by 2n).

        Raises:
            ComputationError: H has not so many values.
        """
        points, values = self._values(which, -(-count // BATCH) * BATCH)
        points, values = points[:, :count], values[:, :count]
        size = len(self._phase.coordinates)
        momenta = points[size:]
        result = np.zeros((len(terms), 2 * size, count))
        for row, (function, places) in zip(result, terms, strict=True):
            factor = momenta[list(places)].prod(axis=0)
            for i, q in enumerate(self._phase.coordinates):
                slope = self._slopes.get((function, q))
                if slope is not None:
                    row[i] = values[slope] * factor
            for i, place in enumerate(places):
                others = momenta[[*places[:i], *places[i + 1 :]]].prod(axis=0)
                row[size + place] += values[self._functions[function]] * others
        given = values[: self._given].reshape(-1, 2 * size, count)
        return np.moveaxis(given, 2, 0), np.moveaxis(result, 2, 0)

    def _values(self, which: int, count: int) -> tuple[Floats, Floats]:
        """Points (2n by `count`), and the values of all expressions there (expressions by `count`)."""
        known = self._tables.get((which, count))
        if known is not None:
            return known
        chance = np.random.default_rng([1, which])
        for _ in range(TRIES):
            parameters = np.exp(chance.uniform(-STRETCH, STRETCH, len(self.parameters))).tolist()
            parameters = self.points.get(which, parameters)
            for low, high in RANGES:
                points = np.random.default_rng(2).uniform(low, high, (len(self._phase.names), 2 * count))
                with np.errstate(all="ignore"):
                    found = self._flow(np)(*points, *parameters)
                values = np.array([np.broadcast_to(value, 2 * count) for value in found])
                places = np.flatnonzero((np.abs(values) < LARGE).all(axis=0))[:count]
                if len(places) == count:
                    self.points[which] = parameters
                    self._tables[which, count] = points[:, places], values[:, places]
                    return self._tables[which, count]
        raise ComputationError("H has a real value of moderate size at too few points")


def scaled_rates(known: Floats, gradients: Floats) -> tuple[Floats, Floats]:
    """The rates of terms (points by terms), and the unit of each term."""
    size = known.shape[2] // 2
    flow = np.concatenate([known[:, 0, size:], -known[:, 0, :size]], axis=1)
    rates = np.einsum("pti,pi->pt", gradients, flow)
    sizes = np.einsum("pti,pi->pt", np.abs(gradients), np.abs(flow))
    rows = _units(sizes.max(axis=1, keepdims=True))
    units = _units(np.linalg.norm(sizes / rows, axis=0))
    return rates / rows / units, units


def _units(sizes: Floats) -> Floats:
    """By what to divide for sizes of 1, where they are not 0."""
    return np.where(sizes == 0.0, 1.0, sizes)


def split_columns(matrix: Floats) -> tuple[list[int], list[int]]:
    """The columns that are no combinations of columns before them, and those that are."""
    left = np.abs(np.diag(np.linalg.qr(matrix, mode="r"))).tolist()
    free = [i for i, size in enumerate(left) if size > DEPENDENT]
    return free, [i for i, size in enumerate(left) if size <= DEPENDENT]


def null_sums(table: Table, terms: Sequence[Term]) -> list[tuple[list[Term], Floats]]:
    """Terms and coefficients of sums that are conserved for one set of parameters, the simplest first."""
    if not terms:
        return []
    known, gradients = table.gradients(0, terms, len(terms) + SPARE)
    directions = np.random.default_rng(3).uniform(-1.0, 1.0, gradients.shape[::2])
    slopes = np.einsum("pti,pi->pt", gradients, directions)
    slopes /= _units(np.abs(slopes).max(axis=1, keepdims=True))
    kept, _ = split_columns(slopes / _units(np.linalg.norm(slopes, axis=0)))
    rates, units = scaled_rates(known, gradients[:, kept])
    free, bound = split_columns(rates)
    if not bound:
        return []
    basis = np.zeros((len(bound), len(kept)))
    basis[:, free] = -np.linalg.lstsq(rates[:, free], rates[:, bound], rcond=None)[0].T
    basis[:, bound] = np.eye(len(bound))
    sums = []
    for vector in _sparse(basis):
        places = [int(place) for place in np.flatnonzero(vector)]
        coefficients = vector[places] / units[places]
        plain = np.abs(np.abs(coefficients / coefficients[0]) - 1.0) < SAME
        chosen = [terms[kept[place]] for place in places]
        length = sum(len(text(to_tree(table.product(term)))) for term in chosen)
        length += COEFFICIENT_LENGTH * int(len(chosen) + (~plain).sum())
        sums.append(((length, -int(plain.sum()), places), chosen, coefficients))
    sums.sort(key=lambda entry: entry[0])
    return [(chosen, coefficients) for _, chosen, coefficients in sums]


def _sparse(basis: Floats) -> list[Floats]:
    """Vectors of a space with few entries: of reduced echelon forms, for several orders of the columns."""
    size = basis.shape[1]
    chance = np.random.default_rng(4)
    orders: list[Iterable[int]] = [range(size), range(size)[::-1]]
    orders += [chance.permutation(size).tolist() for _ in range(3)]
    found: dict[tuple[int, ...], Floats] = {}
    for order in orders:
        for vector in _echelon(basis, order):
            found.setdefault(tuple(np.flatnonzero(vector)), vector)
    return list(found.values())


def _echelon(basis: Floats, order: Iterable[int]) -> Floats:
    """The reduced echelon form, with pivots in columns that come early in the order."""
    rows: Floats = basis / np.abs(basis).max(axis=1, keepdims=True)
    free = list(range(len(rows)))
    for column in order:
        if not free:
            break
        pivot = max(free, key=lambda row: float(abs(rows[row, column])))
        if abs(rows[pivot, column]) < ABSENT:
            continue
        free.remove(pivot)
        rows[pivot] /= rows[pivot, column]
        others = np.arange(len(rows)) != pivot
        rows[others] -= np.outer(rows[others, column], rows[pivot])
    rows /= np.abs(rows).max(axis=1, keepdims=True)
    rows[np.abs(rows) < ABSENT] = 0.0
    return rows


class Span:
    """The space that some vectors span, by an orthonormal basis."""

    __slots__ = ("_basis",)

    def __init__(self, vectors: Iterable[Floats]) -> None:
        self._basis: list[Floats] = []
        for vector in vectors:
            self.extend(vector)

    def holds(self, vector: Floats) -> bool:
        """Whether a vector lies in it, but for rounding."""
        return self._rest(vector) is None

    def extend(self, vector: Floats) -> None:
        """Add a vector."""
        rest = self._rest(vector)
        if rest is not None:
            self._basis.append(rest)

    def _rest(self, vector: Floats) -> Floats | None:
        size = float(np.linalg.norm(vector))
        if size == 0.0:
            return None
        rest = vector / size
        for _ in range(2):
            for known in self._basis:
                rest = rest - (rest @ known) * known
        left = float(np.linalg.norm(rest))
        if left <= ABSENT:
            return None
        unit: Floats = rest / left
        return unit


def in_all(spans: Iterable[Span], vectors: Iterable[Floats]) -> bool:
    """Whether each vector lies in its space."""
    return all(span.holds(vector) for span, vector in zip(spans, vectors, strict=True))
