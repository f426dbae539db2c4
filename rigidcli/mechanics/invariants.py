"""Conserved quantities: sums of given terms whose Poisson bracket with H vanishes, by linear algebra.

Those linear in the momenta, F = sum_i X_i(q) p_i + f(q), are always looked for: by Noether's theorem X
generates a symmetry, as of total and angular momentum. Those of degree 2 are looked for in Cartesian
coordinates alone, where T = p.A.p/2 has constant coefficients. There the X that keep T are known:
translations p_i and rotations y_i p_j - y_j p_i with y = A^-1 q; and the terms of degree 2 are products of
two of these. Elsewhere X is a sum of powers of the coordinates, and of sines and cosines of angles.

The values of the brackets {F, H} at random points, with random values of the parameters, make a matrix whose
null space tells which terms belong together. Their coefficients are then worked out as functions of the
parameters, and the bracket of the whole is shown to vanish.

Sources: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, section 13.7; J. Hietarinta,
Direct methods for the search of the second invariant, Physics Reports 147 (1987) 87. There the functions of
the coordinates are free and solve differential equations; here they come from a list, so that there may be
others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from fractions import Fraction
from itertools import combinations, combinations_with_replacement, permutations, product
from random import Random
from typing import TypeAlias

import numpy as np

from rigidcli.algebra import matrices
from rigidcli.algebra.atoms import Applied, Atom, Group
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficient, coefficients, expand, has_degrees
from rigidcli.algebra.expressions import ONE, Expr, factored, gathered, number, symbol, total
from rigidcli.algebra.fractions import independent_rows
from rigidcli.algebra.functions import apply
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import plain_tree
from rigidcli.algebra.values import HIGH, LOW, is_zero, sampled
from rigidcli.core.arithmetic import Floats, echelon
from rigidcli.errors import ExpressionError
from rigidcli.language import code
from rigidcli.mechanics.phase_space import TIME, Phase, bracket

MOST_COORDINATES = 9  # with more, sums of momenta alone are tried: there are n^2 products of q and p
FEW_COORDINATES = 3  # the most coordinates with terms of degree 2 in momenta, or coordinates times p
MOST_TERMS = 200  # the most terms of one sum: the null space of their brackets takes a hundredth of a second
SPARE = 20  # random points beyond the number of terms at which sums of brackets have to vanish
TRIES = 4  # random points for each one that is needed, as H has no value at some
SCALES = (1.0, 0.1)  # sizes of the momenta: a relativistic or optical H has no value where they are large
LEAST = 1e-6  # a coefficient below this share of the largest is rounding: parameters are of order 1
ROUNDING = 1e-10  # a sum below this share of its terms is zero, as floats are right to 1e-16
MOST_DENOMINATOR = 60  # the largest denominator of a coefficient that is taken for a number
MOST_INNER = 10  # the most functions, the simplest ones, by which the sine of a free angle is multiplied
POINTS = 12  # random points at which gradients are compared: dependent ones are combinations at all
DEPENDENT = 1e-6  # singular values of unit gradients below this are rounding: they are combinations


def conserved_quantities(hamiltonian: Expr, phase: Phase, known: Sequence[Expr]) -> tuple[Expr, ...]:
    """Quantities with {F, H} = 0 that are no functions of H, of the `known` ones and of one another.

    Where H holds the time, they are linear in the momenta. The search ends where expressions are too large.
    """
    if len(phase.coordinates) < 2 or hamiltonian.names.isdisjoint(phase.names):
        return ()
    quantities: list[Expr] = []
    with suppress(ExpressionError):
        for terms in _trial_sums(hamiltonian, phase):
            quantities += _new_sums(terms[:MOST_TERMS], [hamiltonian, *known, *quantities], phase)
    return tuple(quantities)


def _trial_sums(hamiltonian: Expr, phase: Phase) -> Iterator[list[Expr]]:
    """The terms of the sums that are looked for, list by list: linear in the momenta, then of degree 2."""
    momenta = [symbol(p) for p in phase.momenta]
    straight, angles = _kinds(hamiltonian, phase)
    lines = [symbol(q) for q in straight]
    waves = [apply(function, symbol(q)) for q in angles for function in ("sin", "cos")]
    squares = [a * b for a, b in combinations_with_replacement(lines, 2)]
    is_even = substitute(hamiltonian, {p: -symbol(p) for p in phase.momenta}) == hamiltonian
    is_small = len(momenta) <= FEW_COORDINATES
    generators = _motions(hamiltonian, phase, straight)
    if generators:
        linear = generators
    elif len(momenta) > MOST_COORDINATES:
        linear = momenta
    else:
        turning = [*_turning(hamiltonian, phase, angles), *squares] if is_small else []
        linear = _products([ONE, *lines, *waves, *turning], momenta)
    if not is_even:
        linear = [*linear, *lines, *waves, *squares]
    yield linear
    if generators and is_small and TIME not in hamiltonian.names:
        pieces = list(_pieces(hamiltonian, phase))
        alone = [*lines, *squares, *waves, *pieces, *_products(pieces, lines)]
        pairs = [a * b for a, b in combinations_with_replacement(generators, 2)]
        yield list(dict.fromkeys([*pairs, *_simplest(alone), *([] if is_even else linear)]))


def _motions(hamiltonian: Expr, phase: Phase, straight: Sequence[str]) -> list[Expr]:
    """The momenta, and the angular momenta of pairs of coordinates that are `straight`, in Cartesian ones.

    There the energy of the momenta is p.A.p/2 with a constant matrix A. Elsewhere there are none.
    """
    polynomial = coefficients(hamiltonian, phase.momenta)
    size, momenta = len(phase.momenta), [symbol(p) for p in phase.momenta]
    if not has_degrees(polynomial, 0, 1, 2):
        return []
    A = [
        [coefficient(polynomial, size, i, j) * (2 if i == j else 1) for j in range(size)] for i in range(size)
    ]
    fixed = not any(e.names.intersection((*phase.coordinates, TIME)) for row in A for e in row)
    masses = matrices.inverse(A) if fixed else None
    if masses is None:
        return []
    y = [total(m * symbol(q) for m, q in zip(row, phase.coordinates, strict=True)) for row in masses]
    places = [k for k, q in enumerate(phase.coordinates) if q in straight and size <= MOST_COORDINATES]
    turns = [y[i] * momenta[j] - y[j] * momenta[i] for i, j in combinations(places, 2)]
    return [*momenta, *(_primitive(turn, phase) for turn in turns)]


def _turning(hamiltonian: Expr, phase: Phase, angles: Sequence[str]) -> list[Expr]:
    """Functions with the sine or cosine of an angle that is not in H, as angular momenta across its axis."""
    free = [apply(f, symbol(q)) for q in angles if q not in hamiltonian.names for f in ("sin", "cos")]
    others = [apply(f, symbol(q)) for q in angles if q in hamiltonian.names for f in ("sin", "cos")]
    pieces = _pieces(hamiltonian, phase) if free else ()
    inner = [ONE, *pieces, *(a / b for a, b in permutations(others, 2)), *(1 / a for a in others)]
    return _products(free, _simplest(inner)[:MOST_INNER])


def _pieces(hamiltonian: Expr, phase: Phase) -> Iterator[Expr]:
    """Functions of the coordinates alone that are factors of terms of H, and the roots of squares."""
    own = frozenset(phase.coordinates)
    for monomial in expand(hamiltonian).terms:
        factors = ((a, n) for a, n in monomial if a.names.isdisjoint(phase.momenta))
        still = {a: n for a, n in factors if not own.isdisjoint(a.names)}
        if still:
            yield gathered(1, still)
            if all(n % 2 == 0 for n in still.values()):
                yield gathered(1, {a: n / Fraction(2) for a, n in still.items()})


def _kinds(hamiltonian: Expr, phase: Phase) -> tuple[list[str], list[str]]:
    """The coordinates that are taken by themselves, and the angles, which stand in sines or nowhere."""
    waves = filter(_is_wave, hamiltonian.everywhere())
    inside = {name for atom in waves for name in atom.names}.intersection(phase.coordinates)
    outside = {*_outside(hamiltonian)}
    straight = [q for q in phase.coordinates if q in outside or q not in inside]
    angles = [q for q in phase.coordinates if q in inside or (inside and q not in outside)]
    return straight, angles if len(phase.coordinates) <= FEW_COORDINATES else []


def _is_wave(atom: Atom) -> bool:
    return isinstance(atom, Applied) and str(atom.function)[:3] in ("sin", "cos", "tan", "ata")


def _outside(e: Expr) -> Iterator[str]:
    """The names that stand outside of sines, arc tangents and the like."""
    for atom in e.atoms:
        if not _is_wave(atom):
            yield from _outside(atom.inner) if isinstance(atom, Group) else atom.names


def _new_sums(terms: Sequence[Expr], known: Sequence[Expr], phase: Phase) -> list[Expr]:
    """The sums of terms that are conserved, and no functions of what is `known`, of which H is the first."""
    sample = _gradients([*known, *terms], phase, len(terms) + SPARE)
    if sample is None:
        return []
    slopes, constants = sample
    found, there, own = list[Expr](), slopes[:, : len(known)], slopes[:, len(known) :]
    vectors = [(np.flatnonzero(row).tolist(), row[row != 0]) for row in _null_rows(own, slopes[:, :1])]
    for places, values in sorted(vectors, key=lambda v: (len(v[0]), sum(terms[k].nodes for k in v[0]), v[0])):
        part = own[:, places]
        if _is_new(_combined(values, part), there):
            for vector in _exact([terms[k] for k in places], values.tolist(), known[0], phase):
                numbers = [x.evaluate(**{name: constants[name] for name in x.names}) for x in vector]
                slope = _combined(np.array(numbers), part)
                if _is_new(slope, there):
                    there = np.concatenate([there, slope[:, np.newaxis]], axis=1)
                    e = total(x * terms[k] for x, k in zip(vector, places, strict=True))
                    found.append(_primitive(e, phase))
    return found


def _null_rows(slopes: Floats, of_h: Floats) -> Iterator[Floats]:
    """Two bases of the sums of terms that commute with H, by their slopes (points by terms by names)."""
    (by_q, by_p), (h_by_q, h_by_p) = np.split(slopes, 2, axis=2), np.split(of_h, 2, axis=2)
    parts = np.concatenate([by_q * h_by_p, -by_p * h_by_q], axis=2)
    # Rows and columns are divided by the sizes of what is added up in them, so that rounding stays small.
    sizes = np.abs(parts).sum(axis=2)
    rows = np.maximum(sizes.max(axis=1, keepdims=True), np.finfo(float).tiny)
    columns = np.linalg.norm(sizes / rows, axis=0)
    columns[columns == 0] = 1.0
    # Elimination takes less time than singular values, which keep other processors busy.
    reduced, pivots = echelon(parts.sum(axis=2) / rows / columns, parts.shape[1], ROUNDING)
    free = sorted({*range(parts.shape[1])}.difference(pivots))
    null = np.zeros((len(free), parts.shape[1]))
    null[range(len(free)), free] = 1.0
    null[:, pivots] = -reduced[: len(pivots), free].T
    null /= columns
    for row in (*null, *echelon(null, len(free), ROUNDING)[0]):
        kept = np.where(np.abs(row) > LEAST * np.abs(row).max(), row, 0.0)
        yield kept / kept[kept != 0][0]


def _gradients(functions: Sequence[Expr], phase: Phase, count: int) -> tuple[Floats, dict[str, float]] | None:
    """The slopes of functions at random points (points by functions by names), and the parameters there.

    None where there are not so many points with values.
    """
    chance = Random(1)  # noqa: S311 - no secret; numpy's generators take 12 ms to load

    def chosen(rows: int, among: Callable[[], float]) -> Floats:
        return np.array([[among() for _ in range(TRIES * count)] for _ in range(rows)])

    slopes = [derivative(e, name) for e in functions for name in phase.names]
    distinct = {e: place for place, e in enumerate(dict.fromkeys(slopes))}
    moving = [TIME, *phase.names]
    parameters = sorted(frozenset().union(*(e.names for e in distinct)).difference(moving))
    constants = {name: chance.uniform(LOW, HIGH) for name in parameters}
    points = chosen(len(moving), lambda: chance.choice((1.0, -1.0)) * chance.uniform(LOW, HIGH))
    points[1 + len(phase.coordinates) :] *= chosen(1, lambda: chance.choice(SCALES))
    f = code.function([plain_tree(e) for e in distinct], moving, constants)(np)
    with np.errstate(all="ignore"):
        found = np.array([np.broadcast_to(row, TRIES * count) for row in f(*points)])
    known: Floats = found[:, np.isfinite(found).all(axis=0)][:, :count]
    if known.shape[1] < count:
        return None
    return known[[distinct[e] for e in slopes]].T.reshape(count, len(functions), -1), constants


def _combined(values: Floats, slopes: Floats) -> Floats:
    """The slope of a sum of terms with coefficients; what is left of terms that cancel is zero."""
    slope, size = values @ slopes, np.abs(values) @ np.abs(slopes)
    return np.where(np.abs(slope) > ROUNDING * size, slope, 0.0)


def _is_new(slope: Floats, known: Floats) -> bool:
    """Whether a gradient (points by names) is no combination of others (points by functions by names)."""
    both = np.concatenate([known, slope[:, np.newaxis]], axis=1)[:POINTS]
    sizes = np.linalg.norm(both, axis=2, keepdims=True)
    units = both / np.where(sizes == 0, 1.0, sizes)
    whole, others = (np.linalg.matrix_rank(rows, tol=DEPENDENT) for rows in (units, units[:, :-1]))
    return bool((whole > others).any())


def _exact(
    terms: Sequence[Expr], values: Sequence[float], hamiltonian: Expr, phase: Phase
) -> list[Sequence[Expr]]:
    """Coefficients with which the sum is conserved; for one choice of the parameters they are `values`."""
    near = [Fraction(value).limit_denominator(MOST_DENOMINATOR) for value in values]
    brackets = [bracket(e, hamiltonian, phase) for e in terms]

    def vanishes(vector: Sequence[Expr]) -> bool:
        return is_zero(total(x * e for x, e in zip(vector, brackets, strict=True)))

    numbers = list(map(number, near))
    if all(abs(x - value) < LEAST for x, value in zip(near, values, strict=True)) and vanishes(numbers):
        return [numbers]
    try:
        rows = independent_rows(brackets, {*phase.names, TIME})
    except ExpressionError:
        return []
    # The coefficients are functions of the parameters.
    firsts = [next(filter(None, row)) for row in rows]
    kept = {tuple(tidy(e / first) for e in row): None for row, first in zip(rows, firsts, strict=True)}
    return list(filter(vanishes, matrices.null_vectors(list(kept)))) if kept else []


def _primitive(e: Expr, phase: Phase) -> Expr:
    """A short form, without numbers and parameters that all of its terms have in common."""
    for _ in range(2):
        size, monomial = factored(e)
        kept = {atom: n for atom, n in monomial if not atom.names.isdisjoint(phase.names)}
        e = tidy(e if size == 1 and len(kept) == len(monomial) else gathered(1, kept))
    return e


def _products(left: Iterable[Expr], right: Iterable[Expr]) -> list[Expr]:
    return list(dict.fromkeys(a * b for a, b in product(left, list(right))))


def _simplest(functions: Iterable[Expr]) -> list[Expr]:
    return sorted(dict.fromkeys(functions), key=lambda e: (e != ONE, e.nodes, e.key))


# --- names

# The Cartesian coordinates of a particle with their momenta, by the names of the axes.
CartesianPath: TypeAlias = dict[str, tuple[Expr, Expr]]
# Points at which functions are compared, and by how much their ratios may differ in units of themselves.
COMPARED_POINTS, SAME_RATIO = 5, 1e-9


def with_names(
    found: Sequence[Expr], phase: Phase, paths: Sequence[CartesianPath]
) -> tuple[tuple[Expr, str | None], ...]:
    """Conserved quantities with the names that their values at some points tell; None for one without.

    `paths` are those of the particles. What has a name has its sign: that of L = r x p, and of
    A = p x L - m k r/r (H. Goldstein and others, section 3.9).
    """
    moving, known = [*phase.names, TIME], dict(_named_quantities(paths))
    letters = {name for e in found for name in e.names}.difference(moving)
    fixed = {name: 0.6 + 0.13 * k for k, name in enumerate(sorted(letters))}
    functions = [*found, *(e for parts in known.values() for e in parts)]
    rows = sampled(functions, fixed, COMPARED_POINTS, moving)
    if rows is None:
        return tuple((e, None) for e in found)
    values = dict(zip(functions, rows.T, strict=True))

    def with_name(e: Expr) -> tuple[Expr, str | None]:
        """The function with the name of others of which it is a sum with constant factors."""
        for name, parts in known.items():
            columns, value = np.column_stack([values[part] for part in parts]), values[e]
            factors = np.linalg.lstsq(columns, value, rcond=None)[0]
            if np.abs(columns @ factors - value).max() <= SAME_RATIO * np.abs(value).max():
                return -e if factors[0] < 0 else e, name
        return e, None

    return tuple(map(with_name, found))


def _named_quantities(paths: Sequence[CartesianPath]) -> Iterator[tuple[str, list[Expr]]]:
    """Names of quantities, and functions of which each is a sum with constant factors."""
    whole = "total " if len(paths) > 1 else ""
    for axis in "xyz":
        parts = [one[axis][1] for one in paths if axis in one]
        if parts:
            yield f"{whole}momentum along {axis}", [total(parts)]
    for axis, a, b in (("x", "y", "z"), ("y", "z", "x"), ("z", "x", "y")):
        turns = [one[a][0] * one[b][1] - one[b][0] * one[a][1] for one in paths if a in one and b in one]
        if turns:
            yield f"{whole}angular momentum about {axis}", [total(turns)]
    if len(paths) != 1 or len(paths[0]) < 2:
        return
    # Of a single particle A = p x L - c r/|r|, where p x L = r p^2 - p (r.p).
    (one,) = paths
    squared = total(p * p for _, p in one.values())
    along = total(q * p for q, p in one.values())
    distance = apply("sqrt", total(q * q for q, _ in one.values()))
    for axis, (q, p) in one.items():
        yield f"Runge-Lenz vector along {axis}", [q * squared - p * along, q / distance]
