"""What a question for principal axes is judged by: the eigen-problem of a tensor, at one point or at many.

A tensor of numbers is one point. One with symbols is worked out where they have values, always the same ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.core.tensor import rotate, shortfall
from rigidcli.errors import ValueProblem
from rigidcli.grading.arrays.entries import worked
from rigidcli.grading.arrays.keys import computed, reference
from rigidcli.grading.arrays.reference import Reference
from rigidcli.grading.arrays.tensors import mistaken_tensors
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.codes import CODES
from rigidcli.grading.infer import BY_NAME
from rigidcli.grading.numbers import ROUNDING
from rigidcli.grading.principal import pairs
from rigidcli.grading.principal.eigen import Eigen, default_angle, is_solved, solve, varying
from rigidcli.grading.principal.pairs import UNIT, Pairs
from rigidcli.grading.principal.writing import mixed
from rigidcli.grading.question import Question

LARGEST_ANGLE = 0.5
"""An angle (rad) that a question may allow to an axis; what is more was hardly meant in radians."""

SMALLEST, LARGEST = 1e-290, 1e290
"""The range (kg m^2) in which the largest entry of a tensor must be."""

KEY_SLACK = 1e-2
"""How far a key that is typed with few digits may miss the laws, in units of its largest entry."""


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The solutions at each point, how far off an axis may be in angle (rad) and length, and named mistakes.

    `reference` has the entries of the tensor (3 by 3), or of pairs (3 by 4). `alone` says that axes need no
    moments. `mistaken` has codes with the solutions under them. Of the solutions at the first point, `varies`
    (2 by 3) tells which moments and which axes depend on the symbols, and `solution` (3 by 4) has them in
    entries, where they are known.
    """

    question: Question
    reference: Reference
    eigens: tuple[Eigen, ...]
    angle: float
    length: float
    alone: bool
    mistaken: tuple[tuple[str, tuple[Eigen, ...]], ...]
    varies: Mask
    solution: Array | None = None

    def typed(self, entries: Array) -> tuple[Pairs, ...]:
        """Entries of an answer (n by 4, or by 3), worked out at each point."""
        return tuple(map(pairs.of, worked(entries, self.reference.points)))

    def read(self, answer: Tree) -> tuple[Pairs, ...]:
        """An answer, worked out at each point. Raises Unreadable."""
        return self.typed(pairs.read(answer, self.reference.names, alone=self.alone))


def make(asked: Asked) -> Key:
    """The key for the tensor of a report, for a literal one, or for the one with literal pairs."""
    tolerance = asked.question.tolerance
    if tolerance.angle is not None and tolerance.angle > LARGEST_ANGLE:
        raise ValueProblem(f"is in radians, expected at most {LARGEST_ANGLE}", path=("tolerance", "angle"))
    ours = _literal(asked) if asked.report is None else _reported(asked)
    tensors = ours.values if ours.shape == (3, 3) else np.array(list(map(_tensor_of_pairs, ours.values)))
    # Nor may ten times as much, or its parts, be beyond floats.
    sizes = np.abs(tensors).max(axis=(1, 2))
    if not (sizes >= SMALLEST).all() or not (sizes <= LARGEST).all():
        raise ValueProblem(f"expected moments of any size from {SMALLEST:g} to {LARGEST:g} kg m^2")
    if (np.abs(tensors - tensors.swapaxes(1, 2)).max(axis=(1, 2)) > ROUNDING * sizes).any():
        raise ValueProblem(CODES["not_symmetric"])
    # Symbols may have values at random that no body has.
    failure = (
        shortfall(tensors[0]) if asked.report is None and ours.shape == (3, 3) and not ours.names else None
    )
    if failure is not None and failure[1] > KEY_SLACK * sizes[0]:
        raise ValueProblem("no body has this inertia tensor")
    usual = default_angle(tolerance)
    angle = max(tolerance.angle or usual, ROUNDING)

    def solved(tensors: Floats) -> tuple[Eigen, ...]:
        return tuple(solve(tensor, tolerance, angle) for tensor in tensors)

    wrong = tuple(
        (code, solved(each))
        for code, each in _mistaken(asked, tensors, ours)
        if np.isfinite(each).all() and each.any(axis=(1, 2)).all()
    )
    alone = len(asked.path) > 1 and BY_NAME.get(asked.path[-1]) == "axes"
    eigens = solved(tensors)
    if ours.shape != (3, 3) and not is_solved(eigens, tuple(map(pairs.of, ours.values))):
        raise ValueProblem("the axes are less precise than the tolerance")
    return Key(asked.question, ours, eigens, angle, max(angle, usual), alone, wrong, varying(eigens))


# --- where tensors are from


def _reported(asked: Asked) -> Reference:
    """The tensor that is asked for, the one of the report, or its moments and axes."""
    assert asked.report is not None
    tensor = asked.value if BY_NAME.get(asked.path[-1]) == "tensor" else asked.report.get("tensor")
    if tensor is None:
        tensor = _reported_pairs(asked)
    if tensor is None:
        raise ValueProblem("this document has no principal axes")
    return reference(replace(asked, value=tensor, unit="kg m^2"), pairs.of_tensor)


def _reported_pairs(asked: Asked) -> Array | None:
    """The moments and axes of a report (3 by 4)."""
    moments, axes = (asked.report.get(name) if asked.report else None for name in ("moments", "axes"))
    if moments is None or axes is None:
        return None
    return np.column_stack([np.asarray(moments, dtype=object), np.asarray(axes, dtype=object)])


def _literal(asked: Asked) -> Reference:
    """A key `{tensor: ...}`, or one with pairs."""
    value = asked.value
    if isinstance(value, list) or (isinstance(value, dict) and "moments" in value):
        ours = reference(asked, pairs.of_pairs)
    else:
        whole = isinstance(value, dict) and set(value) == {"tensor"}
        ours = reference(replace(asked, value=value["tensor"] if whole else value), pairs.of_tensor)
    if ours.unit is not None and UNIT is not None and ours.unit.dimension != UNIT.dimension:
        raise ValueProblem(CODES["unit_incompatible"])
    return ours


def _tensor_of_pairs(values: Floats) -> Floats:
    """I from I e = lambda e for three axes, which need be at right angles only where the moments differ."""
    typed = pairs.of(values)
    if len(typed) != 3:
        raise ValueProblem("expected three pairs of a moment and an axis")
    if np.linalg.svd(typed.units, compute_uv=False)[2] < KEY_SLACK:
        raise ValueProblem(CODES["axes_dependent"])
    tensor = np.array(np.linalg.solve(typed.units, values[:, :1] * typed.units), dtype=np.float64)
    if np.abs(tensor - tensor.T).max() > KEY_SLACK * np.abs(tensor).max():
        raise ValueProblem(CODES["axes_not_orthogonal"])
    half: Floats = (tensor + tensor.T) / 2
    return half


# --- the answer in entries


def solutions(asked: Asked, key: Key) -> Iterator[Array]:
    """What may be the answer (3 by 4): numbers, or what the report or the key has, or the axes of a point."""
    ours, eigen = key.reference, key.eigens[0]
    if not ours.names:
        yield np.column_stack([eigen.moments, eigen.axes]).astype(object)
        return
    given = ours.entries if ours.shape == (3, 4) else None
    if asked.report is not None and (reported := _reported_pairs(asked)) is not None:
        given = computed(reported)
    if given is not None:
        given = _arranged(given, ours)
        yield given
        moments = given[:, 0]
    else:
        # lambda = e I e
        squares = np.einsum("ki,kj->kij", eigen.axes, eigen.axes).reshape(3, 9)
        moments = mixed(squares, ours.entries.ravel())
    yield np.column_stack([moments, eigen.axes.astype(object)])


def _arranged(given: Array, key: Reference) -> Array:
    """Pairs (3 by 4) with moments that ascend, and right-handed axes, both at the first point."""
    values = worked(given, key.points)[0]
    order = values[:, 0].argsort(kind="stable")
    given = given[order].copy()
    if np.linalg.det(values[order, 1:]) < 0:
        given[2, 1:] = mixed(-np.eye(3), given[2, 1:])
    return given


def _mistaken(asked: Asked, tensors: Floats, key: Reference) -> Iterator[tuple[str, Floats]]:
    """Codes with the tensors (k by 3 by 3) whose moments and axes come out under them."""
    yield from mistaken_tensors(asked, tensors, key)
    if asked.document is not None and asked.document.frame is not None:
        frames = worked(computed(asked.document.physical.axes), key.points)
        # Turned the other way.
        turned = [rotate(tensor, frame @ frame) for tensor, frame in zip(tensors, frames, strict=True)]
        yield "other_frame", np.array(turned)
