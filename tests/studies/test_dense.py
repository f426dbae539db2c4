"""Kinetic energies that couple up to twenty coordinates, against the inversion of p(v) with many digits.

H, dH/dp = v and -dH/dq = dL/dq are compared at random points of phase space: where H is written, and where it
is not because it would fill pages, but is worked out at every point.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
import pytest

import rigidcli
from rigidcli.document.load import loads
from rigidcli.studies.hamilton.derivation import derive
from rigidcli.studies.hamilton.equations_of_motion import equations_of_motion
from rigidcli.studies.hamilton.initial import initial_state

MANY = mpmath.mp.clone()
MANY.dps = 50


@dataclass(frozen=True)
class System:
    """L = v.M v/2 + a.v - V with M_ij = d_i (on the diagonal) + c_ij cos(q_i - q_j), a_i = b_i q_i+1 and
    V = sum of g_i cos(q_i); c_ij is zero further than `reach` from the diagonal."""

    masses: list[float]
    couplings: list[list[float]]
    magnetic: list[float]
    weights: list[float]

    @classmethod
    def random(cls, size: int, reach: int, magnetic: bool, seed: int) -> System:
        chance = random.Random(seed)
        couplings = [[0.0] * size for _ in range(size)]
        for i in range(size):
            for j in range(max(0, i - reach), i):
                couplings[i][j] = couplings[j][i] = round(chance.uniform(-0.9, 0.9), 3)
        masses = [round(chance.uniform(1, 2) + sum(map(abs, row)), 3) for row in couplings]
        fields = [round(chance.uniform(-1, 1), 3) if magnetic else 0.0 for _ in range(size)]
        return cls(masses, couplings, fields, [round(chance.uniform(-3, 3), 3) for _ in range(size)])

    @property
    def size(self) -> int:
        return len(self.masses)

    def document(self, q: list[float], p: list[float]) -> str:
        n, terms = self.size, []
        for i in range(n):
            terms.append(f"{self.masses[i]}*q{i}dot**2/2")
            terms += [
                f"({self.couplings[i][j]})*cos(q{i} - q{j})*q{i}dot*q{j}dot"
                for j in range(i)
                if self.couplings[i][j]
            ]
            if self.magnetic[i]:
                terms.append(f"({self.magnetic[i]})*q{(i + 1) % n}*q{i}dot")
            terms.append(f"(-({self.weights[i]}))*cos(q{i})")
        start = ", ".join(f"q{i}: {q[i]!r}, p_q{i}: {p[i]!r}" for i in range(n))
        return (
            f"system:\n  coordinates: [{', '.join(f'q{i}' for i in range(n))}]\n"
            f"  lagrangian: {' + '.join(terms)}\n"
            f"orbit: {{initial: {{{start}}}, duration: 1}}\n"
        )

    def truth(self, q: list[float], p: list[float]) -> tuple[Any, Any, Any]:
        """H, v and dL/dq from these formulas, by a linear solver with 50 digits."""
        n, x, many = self.size, [MANY.mpf(each) for each in q], MANY.mpf
        matrix, a = MANY.zeros(n, n), MANY.zeros(n, 1)
        for i in range(n):
            a[i] = many(repr(self.magnetic[i])) * x[(i + 1) % n]
            for j in range(n):
                matrix[i, j] = many(repr(self.couplings[i][j])) * MANY.cos(x[i] - x[j])
            matrix[i, i] += many(repr(self.masses[i]))
        rest = MANY.matrix([many(each) for each in p]) - a
        v = MANY.lu_solve(matrix, rest)
        weights = [many(repr(each)) for each in self.weights]
        energy = MANY.fdot(rest, v) / 2 + MANY.fsum(w * MANY.cos(c) for w, c in zip(weights, x, strict=True))
        forces = []
        for i in range(n):
            pairs = MANY.fsum(
                -many(repr(self.couplings[i][j])) * MANY.sin(x[i] - x[j]) * v[i] * v[j] for j in range(n)
            )
            before = (i - 1) % n
            field = many(repr(self.magnetic[before])) * v[before]
            forces.append(pairs + field + weights[i] * MANY.sin(x[i]))
        return energy, list(v), forces


@pytest.mark.parametrize(
    ("size", "reach", "magnetic"),
    [
        *((size, size, False) for size in (2, 4, 7, 20)),
        (3, 3, True),
        (20, 1, True),
        (20, 3, False),
    ],
)
def test_the_motion_is_that_of_the_inverted_momenta(size: int, reach: int, magnetic: bool) -> None:
    system = System.random(size, reach, magnetic, seed=size + reach)
    chance = random.Random(7)
    states = [
        ([chance.uniform(-4, 4) for _ in range(size)], [chance.uniform(-5, 5) for _ in range(size)])
        for _ in range(4)
    ]
    document = loads(system.document(*states[0]))
    assert document.orbit is not None
    motion = equations_of_motion(*initial_state(document, document.orbit, derive(document)))
    flow = motion.flow(math)
    for q, p in states:
        energy, v, forces = system.truth(q, p)
        state = np.array([q + p])
        slopes = flow(0.0, *state[0])
        _, _, told, _ = motion.observed(np.zeros(1), state)
        speed, force = (max(abs(float(each)) for each in many) for many in (v, forces))
        assert told[0] == pytest.approx(float(energy), rel=1e-12, abs=1e-12 * speed * max(map(abs, p)))
        assert slopes[:size] == pytest.approx([float(each) for each in v], rel=1e-12, abs=1e-12 * speed)
        assert slopes[size:] == pytest.approx([float(each) for each in forces], rel=1e-12, abs=1e-12 * force)


def test_no_parameter_is_taken_for_a_step_of_the_elimination() -> None:
    name = "_d0"
    text = f"""
parameters: {{{name}: 0.3}}
system:
  coordinates: [x]
  lagrangian: xdot^2/2 + {name}*(xdot^4 + xdot^6 - x^2)
  forces: {{x: -{name}*xdot}}
orbit: {{initial: {{x: 1, xdot: 0.2}}, duration: 2, samples: 3}}
"""
    orbit, same = (rigidcli.hamilton(each)["orbit"] for each in (text, text.replace(name, "k")))
    assert orbit["q"]["x"].tolist() == same["q"]["x"].tolist()
