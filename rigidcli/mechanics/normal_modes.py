"""Normal modes y = Re(v exp(s t)) of M y'' + C y' + K y = 0: rates, mode vectors, stability.

In symbols freedoms that do not act on each other are worked apart. Signs, and which mode is the slower one,
are those for the given values of parameters and random positive ones of others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from rigidcli.algebra import matrices, samples
from rigidcli.algebra.arithmetic import tidy
from rigidcli.algebra.atoms import Atom, Group
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ZERO, Expr, power, total
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.substitution import with_powers
from rigidcli.core.arithmetic import Array
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.small_oscillations import LinearMotion
from rigidcli.mechanics.spectrum import (
    BITS,
    INDEPENDENT,
    ROUNDING,
    Eigenvalue,
    Root,
    S,
    balls,
    determinant,
    eigenvalues,
    factored_polynomial,
    is_positive_definite,
    roots,
)

FOUND = 1e-6
"""What is rounding where the equilibrium was found in floats: squares of rates have errors of some 1e-14."""

NOISE = 1e-12
"""Entries of a vector below this, in units of its largest one, are zero."""

Pair: TypeAlias = "tuple[float | Expr, float | Expr]"
"""The real and the imaginary part of a number."""


@dataclass(frozen=True, slots=True)
class Mode:
    """One mode: s = `growth` + i `angular`, with its vector v, real and imaginary parts apart (n each).

    `growth` (1/s) is negative where it decays. `is_stable` is None of a zero mode, which is displaced to
    another equilibrium and drifts there, and where the signs of symbols decide: the mode is that for a
    positive `condition`.
    """

    growth: float | Expr
    angular: float | Expr
    vector: tuple[Pair, ...]
    is_stable: bool | None
    condition: Expr | None = None

    @property
    def rate(self) -> float | Expr:
        """The growth of an unstable mode; else the angular frequency, or the decay where it has none."""
        if self.is_stable is False and self.growth:
            return self.growth
        return -self.growth if self.growth and not self.angular else self.angular


def numeric_modes(motion: LinearMotion, is_free: bool, rounding: float = ROUNDING) -> list[Mode]:
    """The modes, by ascending rates; the matrices are exact numbers.

    Without forces (`is_free`) s and -s come in pairs, of which the growing one is listed.
    """
    from flint import arb, arb_mat, ctx

    size = len(motion.masses)
    masses, rates, stiffness = map(balls, motion.parts)
    is_natural = is_free and not any(entry for row in motion.rates for entry in row)
    with ctx.workprec(BITS):
        back, damping = masses.solve(stiffness), masses.solve(rates)
        whole = -back
        if not is_natural:
            rows = [[int(j == i + size) for j in range(2 * size)] for i in range(size)]
            rows += [[-part[i, j] for part in (back, damping) for j in range(size)] for i in range(size)]
            whole = arb_mat(rows)
        # Of coordinates in different units, entries are compared in units of 1/sqrt(M_ii).
        weights = [abs(masses[i, i]).sqrt() if masses[i, i] != 0 else arb(1) for i in range(size)]
    scale = np.array([float(weight.mid()) for weight in weights])
    modes = [
        mode
        for value in eigenvalues(whole, rounding, is_natural, weights)
        if value.angular >= 0 and (value.growth >= 0 or not is_free)
        for mode in _of_value(value, scale)
    ]
    return sorted(modes, key=lambda mode: (float(mode.rate), float(mode.angular)))


def _of_value(value: Eigenvalue, weights: Array) -> list[Mode]:
    """The modes of one eigenvalue: as many as there are independent vectors."""
    growth, angular, vectors = value
    # With fewer vectors than there are equal eigenvalues, motion grows by powers of the time.
    whole = value.rank == len(vectors)
    is_stable = None if not growth and not angular else growth < 0 or (not growth and whole)
    rows = _reduced(vectors)[: value.rank] / weights
    for row in rows:
        first = np.flatnonzero(row)[0]
        row /= row[first]
        row[first] = 1.0
    return [
        Mode(growth, angular, tuple((float(e.real), float(e.imag)) for e in row), is_stable) for row in rows
    ]


def _reduced(rows: Array) -> Array:
    """The rows in reduced echelon form, by the first entry of each that is not zero."""
    rows = rows.copy()
    place = 0
    for column in range(rows.shape[1]):
        if place == len(rows):
            break
        best = place + int(np.argmax(np.abs(rows[place:, column])))
        if abs(rows[best, column]) <= INDEPENDENT:
            continue
        rows[[place, best]] = rows[[best, place]]
        rows[place] /= rows[place, column]
        for other in range(len(rows)):
            if other != place:
                rows[other] -= rows[other, column] * rows[place]
        place += 1
    parts = np.array([rows.real, rows.imag])
    parts[np.abs(parts) <= NOISE * np.abs(rows).max(axis=1, keepdims=True)] = 0.0
    return np.asarray(parts[0] + 1j * parts[1])


def symbolic_modes(motion: LinearMotion, known: Mapping[str, Expr], is_free: bool) -> list[Mode] | None:
    """The modes, by ascending rates; None where the polynomial does not factor."""
    size, parts = len(motion.masses), motion.parts
    blocks = matrices.connected(
        size, lambda i, j: any(not (part[i][j].is_zero and part[j][i].is_zero) for part in parts)
    )
    modes: list[Mode] = []
    for block in blocks:
        own = LinearMotion(*(matrices.part(part, block, block) for part in parts))
        try:
            found = _of_block(own, known, is_free)
        except ExpressionError:
            return None
        if found is None:
            return None
        for mode in found:
            whole: list[Pair] = [(ZERO, ZERO)] * size
            for place, entry in zip(block, mode.vector, strict=True):
                whole[place] = entry
            modes.append(replace(mode, vector=tuple(whole)))
    rates = [rate for mode in modes if isinstance(rate := mode.rate, Expr)]
    sizes = samples.values(rates, {name: float(value) for name, value in known.items()}, count=1)
    order = range(len(modes)) if sizes is None else sizes[0].argsort(kind="stable")
    return [modes[place] for place in order]


def _of_block(motion: LinearMotion, known: Mapping[str, Expr], is_free: bool) -> list[Mode] | None:
    """The modes of freedoms that act on each other."""
    bounded = is_free and all(is_positive_definite(part, known) for part in (motion.masses, motion.stiffness))
    modes = []
    for factor, times in factored_polynomial(determinant(motion.pencil(S)), str(S)):
        found = roots(factor, known, bounded)
        if found is None:
            return None
        for root in found:
            written = _roots_within(root.growth + root.angular)
            vectors = [[(_as_in(x, written), y) for x, y in v] for v in _vectors(motion, root)]
            if not vectors:
                return None
            whole = len(vectors) == times
            stable = root.is_stable and (whole or bool(root.growth))
            modes += [Mode(root.growth, root.angular, tuple(v), stable, root.condition) for v in vectors]
    return modes


def _vectors(motion: LinearMotion, root: Root) -> Iterator[Iterator[tuple[Expr, Expr]]]:
    """What M s^2 + C s + K takes to zero, over its first entry."""
    growth, angular, *_ = root
    rows = list(zip(*motion.parts, strict=True))
    square, double = tidy(growth**2 - angular**2), tidy(2 * growth * angular)
    real = [[tidy(m * square + c * growth + k) for m, c, k in zip(*row, strict=True)] for row in rows]
    imaginary = [[tidy(m * double + c * angular) for m, c, _ in zip(*row, strict=True)] for row in rows]
    if not any(e for row in imaginary for e in row):
        for vector in matrices.null_vectors(real):
            yield _from_first([(e, ZERO) for e in vector])
        return
    # For x + i y it is A x - B y = 0 and B x + A y = 0, which has each solution a second time, times i.
    both = [[*x, *(-e for e in y)] for x, y in zip(real, imaginary, strict=True)]
    both += [[*y, *x] for x, y in zip(real, imaginary, strict=True)]
    found = matrices.null_vectors(both)
    if len(found) == 2:
        yield _from_first(list(zip(found[0][: len(rows)], found[0][len(rows) :], strict=True)))


def _roots_within(e: Expr) -> dict[Expr, Expr]:
    """The sums under roots in an expression as they are written there, by what they are multiplied out."""
    found = {}
    for monomial in e.terms:
        for atom, n in monomial:
            if isinstance(atom, Group):
                found.update(_roots_within(atom.inner))
                if n.denominator > 1:
                    found[expand(atom.inner)] = atom.inner
    return found


def _as_in(e: Expr, written: Mapping[Expr, Expr]) -> Expr:
    """An expression with the same roots in the same form."""

    def change(atom: Atom, n: Rational) -> Expr | None:
        if not isinstance(atom, Group):
            return None
        known = written.get(expand(atom.inner)) if n.denominator > 1 else None
        return power(_as_in(atom.inner, written) if known is None else known, n)

    return with_powers(e, change) if written else e


def _from_first(vector: Sequence[tuple[Expr, Expr]]) -> Iterator[tuple[Expr, Expr]]:
    """The vector over its first entry that is not zero."""
    re, im = next((re, im) for re, im in vector if re or im)
    size = re**2 + im**2
    for x, y in vector:
        if im or y:
            yield tidy(total([x * re, y * im]) / size), tidy(total([y * re, -(x * im)]) / size)
        else:
            yield tidy(x / re), ZERO
