"""Sums of terms that are conserved for one set of parameters, in floats.

The rates {f, H} of the terms f at random points of phase space make a matrix whose null space they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import chain
from typing import TypeAlias

import numpy as np

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ComputationError
from rigidcli.language import code
from rigidcli.mechanics.hamilton_equations import Phase
from rigidcli.mechanics.invariants.trial_terms import Term

SPARE = 12
"""Points beyond the number of terms, so that a sum that vanishes at all of them vanishes everywhere."""

BATCH = 16
"""Points are made in multiples of this number, so that sums of few terms share a sample."""

DEPENDENT = 1e-11
"""What is left of a column of unit length that is a combination of others is rounding, below this."""

ABSENT = 1e-6
"""Entries below this, beside the largest of a vector, are taken for rounding."""

SAME = 1e-8
"""The relative difference up to which coefficients are taken for equal."""

LARGE = 1e100
"""Points with values beyond this are passed over, so that products of three are within floats."""

RANGES = [(-2.0, 2.0), (0.3, 1.7), (0.02, 0.5)]
"""Ranges of coordinates and momenta; the next is taken where H has too few values in one."""

TRIES = 6
"""How often each range is tried with other values of the parameters, until H has values."""

STRETCH = 1.2
"""Parameters are between exp(-STRETCH) and exp(STRETCH), of the order of 1."""

COEFFICIENT_LENGTH = 6
"""Characters by which a coefficient that is not 1 or -1, or a further term, makes a text longer."""


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """Functions at random points of phase space, for one random set of parameters.

    `given` are the gradients of H and of known quantities (points by these by 2n). The factors of terms, at
    their `places`, have `values` (points by factors) and `slopes` (points by factors by 2n).
    """

    parameters: Mapping[str, float]
    given: Floats
    places: Mapping[Expr, int]
    values: Floats
    slopes: Floats

    def gradients(self, terms: Sequence[Term]) -> Floats:
        """The gradients of terms (points by terms by 2n)."""
        a, b = ([self.places[term[factor]] for term in terms] for factor in (0, 1))
        values, slopes = self.values[:, :, None], self.slopes
        product: Floats = values[:, a] * slopes[:, b] + slopes[:, a] * values[:, b]
        return product

    def rates(self, terms: Sequence[Term]) -> tuple[Floats, Floats]:
        """The rates {f, H} of terms (points by terms), and the unit of each term."""
        gradients = self.gradients(terms)
        size = gradients.shape[2] // 2
        flow = np.concatenate([self.given[:, 0, size:], -self.given[:, 0, :size]], axis=1)
        rates = np.einsum("pti,pi->pt", gradients, flow)
        sizes = np.einsum("pti,pi->pt", np.abs(gradients), np.abs(flow))
        rows = _units(sizes.max(axis=1, keepdims=True))
        units = _units(np.linalg.norm(sizes / rows, axis=0))
        return rates / rows / units, units


Sampler: TypeAlias = Callable[[int, int], Sample]
"""Makes a sample with a numbered set of parameters, which has enough points for so many terms."""


def sampler(hamiltonian: Expr, phase: Phase, known: Sequence[Expr], terms: Iterable[Term]) -> Sampler:
    """Where to take samples of terms from; it raises ComputationError where H has too few values."""
    factors = list(dict.fromkeys(chain.from_iterable(terms)))
    places = {e: place for place, e in enumerate(factors)}
    slopes = [derivative(e, name) for e in (*factors, hamiltonian, *known) for name in phase.names]
    names = sorted({name for e in (*factors, *slopes) for name in e.names}.difference(phase.names))
    flow = code.function([to_tree(e) for e in (*factors, *slopes)], [*phase.names, *names], {})(np)
    size, count = len(phase.names), len(factors)

    @cache
    def sample(which: int, needed: int) -> Sample:
        chance = np.random.default_rng([1, which])
        for low, high in RANGES * TRIES:
            parameters = np.exp(chance.uniform(-STRETCH, STRETCH, len(names))).tolist()
            points = np.random.default_rng(2).uniform(low, high, (size, 2 * needed))
            with np.errstate(all="ignore"):
                rows = [np.broadcast_to(row, 2 * needed) for row in flow(*points, *parameters)]
            values = np.array(rows).T
            values = values[(np.abs(values) < LARGE).all(axis=1)][:needed]
            if len(values) == needed:
                slopes = values[:, count:].reshape(needed, -1, size)
                known_values = dict(zip(names, parameters, strict=True))
                return Sample(known_values, slopes[:, count:], places, values[:, :count], slopes[:, :count])
        raise ComputationError("H has a real value of moderate size at too few points")

    return lambda which, terms: sample(which, -(-(terms + SPARE) // BATCH) * BATCH)


def _units(sizes: Floats) -> Floats:
    """By what to divide for sizes of 1, where they are not 0."""
    return np.where(sizes == 0.0, 1.0, sizes)


def split_columns(matrix: Floats) -> tuple[list[int], list[int]]:
    """The columns that are no combinations of columns before them, and those that are."""
    left = np.abs(np.diag(np.linalg.qr(matrix, mode="r")))
    return np.flatnonzero(left > DEPENDENT).tolist(), np.flatnonzero(left <= DEPENDENT).tolist()


def null_sums(sample: Sample, terms: Sequence[Term]) -> list[tuple[list[Term], Floats]]:
    """Terms and coefficients of sums that are conserved for one set of parameters, the simplest first."""
    gradients = sample.gradients(terms)
    directions = np.random.default_rng(3).uniform(-1.0, 1.0, gradients.shape[::2])
    slopes = np.einsum("pti,pi->pt", gradients, directions)
    slopes /= _units(np.abs(slopes).max(axis=1, keepdims=True))
    kept, _ = split_columns(slopes / _units(np.linalg.norm(slopes, axis=0)))
    rates, units = sample.rates([terms[place] for place in kept])
    sums = []
    for vector in _sparse_null_vectors(rates):
        places = np.flatnonzero(vector).tolist()
        coefficients = vector[places] / units[places]
        plain = np.abs(np.abs(coefficients / coefficients[0]) - 1.0) < SAME
        chosen = [terms[kept[place]] for place in places]
        length = sum(len(str(function * momenta)) for function, momenta in chosen)
        length += COEFFICIENT_LENGTH * int(len(chosen) + (~plain).sum())
        sums.append(((length, -int(plain.sum()), places), chosen, coefficients))
    sums.sort(key=lambda entry: entry[0])
    return [(chosen, coefficients) for _, chosen, coefficients in sums]


def _sparse_null_vectors(matrix: Floats) -> list[Floats]:
    """Vectors of the null space with few entries, from several orders of the columns.

    In each order, every column that is a combination of columns before it gives one.
    """
    size = matrix.shape[1]
    chance = np.random.default_rng(4)
    orders = [np.arange(size)[::-1], np.arange(size), *(chance.permutation(size)[::-1] for _ in range(3))]
    found: dict[tuple[int, ...], Floats] = {}
    for order in orders:
        free, bound = (order[part] for part in split_columns(matrix[:, order]))
        if not len(bound):
            break
        q, r = np.linalg.qr(matrix[:, free])
        vectors = np.zeros((len(bound), size))
        vectors[:, free] = -np.linalg.solve(r, q.T @ matrix[:, bound]).T
        vectors[:, bound] = np.eye(len(bound))
        vectors /= np.abs(vectors).max(axis=1, keepdims=True)
        vectors[np.abs(vectors) < ABSENT] = 0.0
        for vector in vectors:
            found.setdefault(tuple(np.flatnonzero(vector)), vector)
    return list(found.values())


def is_combination(vectors: Floats, others: Floats) -> bool:
    """Whether at every point the vector (points by 2n) is a combination of others (points by any by 2n)."""
    units = others / _units(np.linalg.norm(others, axis=2, keepdims=True))
    projections = np.linalg.pinv(units, rcond=ABSENT) @ units
    rest = vectors - np.einsum("pi,pij->pj", vectors, projections)
    return bool((np.linalg.norm(rest, axis=1) <= ABSENT * np.linalg.norm(vectors, axis=1)).all())
