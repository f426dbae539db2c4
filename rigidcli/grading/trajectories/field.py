"""The equations of motion of a document: the rates at any state, and one step from a row to the next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.grading.expressions.formula import names_in
from rigidcli.grading.trajectories.heads import TIME
from rigidcli.symbolic.algebra.expressions import Expr
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language import evaluation
from rigidcli.symbolic.language.tree import Node, Sum

SHIFTS = (0.5, 1.7, 2.9, 4.1, 5.3)
"""By which an angle is changed to see that a function depends on it at all (rad)."""

NOTHING, SOMETHING = 1e-6, 1e-9
"""A turn changes nothing below the first part of what these do, and they nothing below that of all terms."""

MOST_STATES = 50
"""States at which this is tried."""


@dataclass(frozen=True, slots=True, eq=False)
class Equations:
    """The rates of all `names` (m) of a state, trees in these, the time and `constants`."""

    names: tuple[str, ...]
    trees: tuple[Node, ...]
    constants: Mapping[str, float]

    def at(self, times: Floats, states: Floats) -> Floats:
        """The rates (k by m) at `times` (k) in `states` (k by m); infinite or NaN where there is none."""
        known = {**self.constants, TIME: times, **dict(zip(self.names, states.T, strict=True))}
        return np.column_stack(
            [np.broadcast_to(evaluation.array(tree, known), times.shape) for tree in self.trees]
        )

    def middle(
        self, times: Floats, width: Floats, states: Floats, moves: Floats, before: Floats, behind: Floats
    ) -> Floats:
        """The rates half-way of steps that take `width` (k) and change the states by `moves` (k by m).

        The rates `before` and `behind` them (k by m) tell the state there, by Hermite's interpolation.
        """
        half = states + moves / 2 + width[:, None] / 8 * (before - behind)
        return self.at(times + width / 2, half)

    def spread(self, times: Floats, states: Floats, rates: Floats, margins: Floats) -> Floats:
        """What the rates may be off by (k by m) where each column of the states is by its margin (m)."""
        total = np.zeros_like(rates)
        for place, margin in enumerate(margins):
            moved = states.copy()
            moved[:, place] += margin
            total += np.abs(self.at(times, moved) - rates)
        return total


def equations_of(
    rates: Mapping[str, Expr] | None, names: tuple[str, ...], constants: Mapping[str, float]
) -> Equations | None:
    """The equations of a study; None where some rate has no formula in what is known."""
    known = {*names, *constants, TIME}
    if rates is None or any(not rate.names <= known for rate in rates.values()):
        return None
    return Equations(names, tuple(to_tree(rates[name]) for name in names), constants)


def size_of_terms(root: Node, values: Mapping[str, float | Floats]) -> float:
    """The largest sum of the sizes of the terms of a function."""
    terms = root.terms if isinstance(root, Sum) else (root,)
    return float(np.max(sum(np.abs(evaluation.array(term, values)) for term in terms)))


def angles_in(
    root: Node, coordinates: tuple[str, ...], times: Floats, values: Mapping[str, float | Floats]
) -> tuple[str, ...]:
    """The coordinates on which a function depends, and which it does not tell from those a turn further.

    It is tried along a trajectory, in which names have one value, or one for each of the times (n).
    """
    names = names_in(root)
    some = np.linspace(0, len(times) - 1, MOST_STATES).astype(int)
    known = {name: np.broadcast_to(values[name], times.shape)[some] for name in names}
    size = size_of_terms(root, known)
    middle = evaluation.array(root, known)

    def change(name: str, shift: float) -> float:
        return float(np.abs(evaluation.array(root, {**known, name: known[name] + shift}) - middle).max())

    found = []
    for name in coordinates:
        if name in names:
            most = np.max([change(name, shift) for shift in SHIFTS])
            turned = np.max([change(name, turn) for turn in (2 * np.pi, -2 * np.pi)])
            if SOMETHING * size < most < np.inf and turned <= NOTHING * most:
                found.append(name)
    return tuple(found)
