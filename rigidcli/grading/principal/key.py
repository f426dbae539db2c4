"""Keys and answers of principal axes: how they are read, and what mistakes make of a key.

Entries are numbers, or expressions in symbols where the question has any: a row of them is a moment with its
axis (4), or an axis (3). A tensor of numbers is one point; one with symbols is worked out at several.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import log10

import numpy as np

from rigidcli.core.arithmetic import Array, Floats
from rigidcli.core.tensor import rotate, shortfall
from rigidcli.errors import ExpressionError, RigidError, ValueProblem, shown
from rigidcli.grading.arrays.entries import Cell, filled, read_entry, times, worked
from rigidcli.grading.arrays.keys import computed, reference
from rigidcli.grading.arrays.reference import Reference
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.codes import CODES
from rigidcli.grading.factors import CONSTANTS
from rigidcli.grading.infer import BY_NAME
from rigidcli.grading.numbers import ROUNDING
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.principal.eigen import Answer, Eigen, default_angle, match, solve
from rigidcli.grading.proofs import agree, are_numbers, exact, simple
from rigidcli.grading.question import Question, Tolerance
from rigidcli.grading.tensors import OTHER_PRODUCTS, mistaken_tensors
from rigidcli.model.units import Unit, parse_unit

LARGEST_ANGLE = 0.5
"""An angle (rad) that a question may allow to an axis; what is more was hardly meant in radians."""

SMALLEST, LARGEST = 1e-290, 1e290
"""The range (kg m^2) in which the largest entry of a tensor must be."""

KEY_SLACK = 1e-2
"""How far a key that is typed with few digits may miss the laws, in units of its largest entry."""

NO_FACTOR = 0.1
"""A common factor as near to 1 as this is no mistake with a name."""

FACTOR_SLACK = 1e-2
"""How near a factor must be to a power of ten, or to a constant, to be tried as one."""

MOST = 6
"""Pairs of an answer; there are three, but an equal moment may be told too often."""

NAMES = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
"""The components of a symmetric tensor."""

LAX = {
    "order": "free",
    "normalized": "optional",
    "orthogonal": "optional",
    "handed": "any",
    "unit": "optional",
}
"""Options under which a mistake explains an answer; what breaks a rule of the question is told besides."""


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The solutions at each point, and how far off an axis may be in `angle` (rad) and `length`.

    `reference` has the entries of the tensor (3 by 3), or of pairs (3 by 4). Moments without a unit are in
    `unit`. `alone` says that axes need no moments. `solution` (3 by 4) has the moments, which ascend at the
    first point, and right-handed axes in entries, where they are known; `told` has it for those who may read
    it. `mistaken` has codes with the tensors (k by 3 by 3) under them. `columns` says that the axes of an
    answer stand in columns.
    """

    question: Question
    reference: Reference
    eigen: Eigen
    angle: float
    length: float
    unit: Unit
    alone: bool
    mistaken: tuple[tuple[str, Floats], ...]
    solution: Array | None = None
    told: str = ""
    columns: bool = False

    def typed(self, entries: Array, bare: tuple[int, ...] = ()) -> Answer:
        """Entries of an answer (n by 4, or by 3), worked out at each point."""
        values = worked(entries, self.reference.points)
        return Answer(values[..., 0] if values.shape[2] == 4 else None, values[..., -3:], bare, entries)

    def valued(self, tensors: Floats, tolerance: Tolerance | None = None) -> Key:
        """The key for other tensors (k by 3 by 3), and for nothing but their eigen-problem."""
        question = self.question.model_copy(update=LAX)
        eigen = solve(tensors, tolerance or question.tolerance, self.angle)
        solution = None if self.reference.names else _of_first_point(eigen)
        return replace(self, question=question, eigen=eigen, solution=solution, mistaken=())

    def times(self, factor: float) -> Key:
        """The key for moments so many times as large.

        A factor below 1 takes an absolute tolerance with it, which would cover all that is small.
        """
        tolerance = self.question.tolerance
        smaller = tolerance.absolute and tolerance.absolute * min(1.0, abs(factor))
        return self.valued(self.eigen.tensors * factor, tolerance.model_copy(update={"absolute": smaller}))


def make(asked: Asked) -> Key:
    """The key for the tensor of a report, for a literal one, or for the one with literal pairs.

    Raises ValueProblem.
    """
    tolerance = asked.question.tolerance
    if tolerance.angle is not None and tolerance.angle > LARGEST_ANGLE:
        raise ValueProblem(f"is in radians, expected at most {LARGEST_ANGLE}", path=("tolerance", "angle"))
    ours = _literal(asked) if asked.report is None else _reported(asked)
    whole = ours.shape == (3, 3)
    tensors = ours.values if whole else np.array(list(map(_tensor_of_pairs, ours.values)))
    # Nor may ten times as much, or its parts, be beyond floats.
    sizes = np.abs(tensors).max(axis=(1, 2))
    if not (sizes >= SMALLEST).all() or not (sizes <= LARGEST).all():
        raise ValueProblem(f"expected moments of any size from {SMALLEST:g} to {LARGEST:g} kg m^2")
    if (np.abs(tensors - tensors.swapaxes(1, 2)).max(axis=(1, 2)) > ROUNDING * sizes).any():
        raise ValueProblem(CODES["not_symmetric"])
    # Symbols may have values at random that no body has.
    failure = shortfall(tensors[0]) if asked.report is None and whole and not ours.names else None
    if failure is not None and failure[1] > KEY_SLACK * sizes[0]:
        raise ValueProblem("no body has this inertia tensor")
    usual = default_angle(tolerance)
    angle = max(tolerance.angle or usual, ROUNDING)
    alone = len(asked.path) > 1 and BY_NAME.get(asked.path[-1]) == "axes"
    eigen, unit = solve(tensors, tolerance, angle), ours.unit or parse_unit("kg m^2")
    mistaken = tuple(_mistaken(asked, tensors, ours))
    key = Key(asked.question, ours, eigen, angle, max(angle, usual), unit, alone, mistaken)
    if asked.report is None and not whole and not match(eigen, key.typed(ours.entries)).complete:
        raise ValueProblem("the axes are less precise than the tolerance")
    return key


# --- where tensors are from


def _reported(asked: Asked) -> Reference:
    """The tensor that is asked for, or the moments and axes of the report, or its tensor."""
    assert asked.report is not None
    value = asked.value if BY_NAME.get(asked.path[-1]) == "tensor" else asked.report.get("tensor")
    moments, axes = (asked.report.get(name) for name in ("moments", "axes"))
    if moments is not None and axes is not None and value is not asked.value:
        value = np.column_stack([np.asarray(moments, dtype=object), np.asarray(axes, dtype=object)])
    if value is None:
        raise ValueProblem("this document has no principal axes")
    return reference(replace(asked, value=value, unit="kg m^2"), _tensor_cells)


def _literal(asked: Asked) -> Reference:
    """A key `{tensor: ...}`, whose products of inertia have the sign that is asked, or one with pairs."""
    value = asked.value
    if isinstance(value, list) or (isinstance(value, dict) and "moments" in value):
        ours = reference(asked, _pair_cells)
    else:
        whole = isinstance(value, dict) and set(value) == {"tensor"}
        ours = reference(replace(asked, value=value["tensor"] if whole else value), _tensor_cells)
        if asked.question.products == "plus":
            entries = times(ours.entries, OTHER_PRODUCTS)
            ours = replace(ours, entries=entries, values=ours.values * OTHER_PRODUCTS)
    if ours.unit is not None and ours.unit.dimension != parse_unit("kg m^2").dimension:
        raise ValueProblem(CODES["unit_incompatible"])
    return ours


def _tensor_of_pairs(values: Floats) -> Floats:
    """I from I e = lambda e for three axes, which need be at right angles only where the moments differ."""
    if len(values) != 3:
        raise ValueProblem("expected three pairs of a moment and an axis")
    (units,) = Answer(None, values[None, :, 1:]).units
    if np.linalg.svd(units, compute_uv=False)[2] < KEY_SLACK:
        raise ValueProblem(CODES["axes_dependent"])
    tensor = np.array(np.linalg.solve(units, values[:, :1] * units), dtype=np.float64)
    if np.abs(tensor - tensor.T).max() > KEY_SLACK * np.abs(tensor).max():
        raise ValueProblem(CODES["axes_not_orthogonal"])
    half: Floats = (tensor + tensor.T) / 2
    return half


# --- the answer in entries


def solution(key: Key) -> Array | None:
    """The answer (3 by 4), if its form is known: in numbers, or as the key, the report or algebra has it."""
    ours = key.reference
    if not ours.names:
        return _of_first_point(key.eigen)
    if ours.shape == (3, 3):
        return _solved_exactly(key)
    pairs = _arranged(ours.entries, ours)
    if are_numbers(pairs[:, 1:]):
        pairs[:, 1:] = key.typed(pairs).units[0]
    return pairs


def _solved_exactly(key: Key) -> Array | None:
    """The moments and axes of a tensor in symbols, if they are short."""
    from rigidcli.symbolic.mechanics.principal_axes import principal_frame

    try:
        frame = principal_frame(exact(key.reference, key.reference.entries))
        return _arranged(computed(np.column_stack([frame.moments, frame.axes])), key.reference)
    except RigidError:
        return None


def _of_first_point(eigen: Eigen) -> Array:
    return np.column_stack([eigen.moments[0], eigen.axes[0]]).astype(object)


def _arranged(pairs: Array, key: Reference) -> Array:
    """Pairs (3 by 4) with moments that ascend, and right-handed axes, both at the first point."""
    values = worked(pairs, key.points)[0]
    order = values[:, 0].argsort(kind="stable")
    pairs = pairs[order].copy()
    if np.linalg.det(values[order, 1:]) < 0:
        pairs[2, 1:] = times(pairs[2, 1:], -1)
    return pairs


# --- proofs


def is_proved(key: Key, answer: Answer, places: np.ndarray) -> bool:
    """Whether three pairs that solve the problem at all points do so whatever values the symbols have.

    Moments must be those of their solutions (`places`), but for rounded coefficients, and axes in symbols at
    right angles to the axes of other moments.
    """
    if answer.entries is None or are_numbers(answer.entries):
        return True
    if key.solution is None:
        return False
    signs = (1,) if "real" not in (key.question.symbols or {}).values() else ()
    try:
        told, right = exact(key.reference, answer.entries), exact(key.reference, key.solution)
        for row, slot in zip(told, places[0], strict=True):
            others = right[~key.eigen.same[0, slot], 1:]
            axis, moment = row[-3:], row[0] if len(row) == 4 else right[slot, 0]
            zeros = [axis @ other for other in others] if any(entry.names for entry in axis) else []
            if zeros and key.question.normalized == "required":
                zeros.append(axis @ axis - 1)
            same = agree(moment, right[slot, 0], key.question.tolerance, signs=signs)
            if not same or any(simple(each).terms for each in zeros):
                return False
    except ExpressionError:
        return False
    return True


# --- reading


def read(key: Key, answer: Tree) -> Answer:
    """An answer, worked out at each point. Raises Unreadable."""
    cells = _pair_cells(answer, alone=key.alone)
    entries, bare = [], list[int]()
    for (row, column), cell in np.ndenumerate(cells):
        is_moment = cells.shape[1] == 4 and column == 0
        found = read_entry(cell, key.unit if is_moment else None, key.reference.names)
        bare += [row] if is_moment and found.bare and key.question.unit == "required" else []
        entries.append(found.entry)
    return key.typed(filled(entries, cells.shape), tuple(bare))


def _pair_cells(answer: Tree, *, alone: bool = False) -> Array:
    """The cells of pairs (n by 4): a list of `{moment, axis}`, or `{moments, axes}`. Raises Unreadable.

    Axes may stand `alone` (n by 3), each a list or `{x, y, z}`.
    """
    moments, axes = None, answer
    if isinstance(answer, dict) and set(answer) == {"moments", "axes"}:
        moments, axes = answer["moments"], answer["axes"]
    elif isinstance(answer, list) and not (alone and any(map(_is_axis, answer))):
        for k, pair in enumerate(answer, 1):
            if not isinstance(pair, dict) or set(pair) != {"moment", "axis"}:
                detail = f"read {shown(pair)}, expected a mapping with `moment` and `axis`"
                raise Unreadable("wrong_shape", detail, place=f"pair {k}")
        moments, axes = ([pair[name] for pair in answer] for name in ("moment", "axis"))
    told = axes if alone and moments is None else moments
    if not isinstance(axes, list) or not isinstance(told, list) or len(axes) != len(told):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list of `{{moment, axis}}`")
    if len(axes) > (3 if moments is None else MOST):
        raise Unreadable("wrong_shape", f"read {len(axes)} axes, expected 3")
    cells = [_three_cells(axis, f"axis {k}") for k, axis in enumerate(axes, 1)]
    if moments is not None:
        cells = [[Cell(told[k], f"moment {k + 1}"), *axis] for k, axis in enumerate(cells)]
    return filled([cell for row in cells for cell in row], (len(axes), 3 if moments is None else 4))


def _is_axis(answer: Tree) -> bool:
    """Whether this may be an axis without a moment."""
    return isinstance(answer, list) or (isinstance(answer, dict) and not {"moment", "axis"} & set(answer))


def _tensor_cells(answer: Tree) -> Array:
    """The cells of a symmetric tensor, as three rows or by the names of its components. Raises Unreadable."""
    if isinstance(answer, dict) and set(answer) == set(NAMES):
        xx, yy, zz, xy, xz, yz = (Cell(answer[name], name) for name in NAMES)
        return filled([xx, xy, xz, xy, yy, yz, xz, yz, zz], (3, 3))
    if not isinstance(answer, list) or len(answer) != 3:
        raise Unreadable("wrong_shape")
    return filled([cell for k, row in enumerate(answer, 1) for cell in _three_cells(row, f"row {k}")], (3, 3))


def _three_cells(numbers: Tree, place: str) -> list[Cell]:
    """The cells of a list of three, or of a mapping from x, y and z. Raises Unreadable."""
    if isinstance(numbers, dict):
        by_name = {name.strip().lower(): number for name, number in numbers.items()}
        named = len(numbers) == 3 and by_name.keys() == set("xyz")
        numbers = [by_name[name] for name in "xyz"] if named else numbers
    if not isinstance(numbers, list) or len(numbers) != 3:
        detail = f"read {shown(numbers)}, expected a list of three numbers, or `{{x, y, z}}`"
        raise Unreadable("wrong_shape", detail, place=place)
    return [Cell(number, f"{place} entry {k}") for k, number in enumerate(numbers, 1)]


# --- mistakes


def worked_out(code: str) -> Callable[[Key], Iterator[Key]]:
    """What makes the keys whose tensors come out under this mistake."""

    def changes(key: Key) -> Iterator[Key]:
        changed = (key.valued(tensors) for name, tensors in key.mistaken if name == code)
        # Where directions are free, axes by themselves tell little.
        return (each for each in changed if not key.alone or each.eigen.distinct)

    return changes


def in_columns(key: Key) -> Iterator[Key]:
    """The key of axes that stand in columns instead of rows."""
    if not key.alone or key.eigen.distinct:
        yield replace(key, question=key.question.model_copy(update=LAX), mistaken=(), columns=True)


def by_factor(code: str) -> Callable[[Key, Answer], Iterator[Key]]:
    """What makes the key with the common factor that the moments of an answer have, if it is this mistake."""

    def fits(key: Key, answer: Answer) -> Iterator[Key]:
        return (key.times(factor) for name, factor in _factors(key.eigen, answer) if name == code)

    return fits


def _factors(eigen: Eigen, answer: Answer) -> Iterator[tuple[str, float]]:
    """The common factor that moments may have, and the mistake that it is.

    Where moments differ any number may be one; else it is one that often stands for a mistake.
    """
    if answer.moments is None:
        return
    told, right = (max(each[0].tolist(), key=abs) for each in (answer.moments, eigen.moments))
    factor = told / right
    if not all(SMALLEST < abs(size) < LARGEST for size in (told, factor)) or abs(factor - 1) <= NO_FACTOR:
        return
    power = 10.0 ** round(log10(abs(factor)))
    if abs(factor + 1) <= NO_FACTOR:
        yield "sign_error", -1.0
    elif abs(factor / power - 1) <= FACTOR_SLACK:
        yield "power_of_ten", power
    elif not eigen.same[0][:, eigen.moments[0] != 0][eigen.moments[0] != 0].all():
        yield "constant_factor", factor
    else:
        named = (exact for size in CONSTANTS for exact in (size, 1 / size))
        yield from (("constant_factor", each) for each in named if abs(factor / each - 1) <= FACTOR_SLACK)


def _mistaken(asked: Asked, tensors: Floats, key: Reference) -> Iterator[tuple[str, Floats]]:
    """Codes with the tensors (k by 3 by 3) whose moments and axes come out under them."""
    every = [*mistaken_tensors(asked, tensors, key)]
    if asked.document is not None and asked.document.frame is not None:
        frames = worked(computed(asked.document.physical.axes), key.points)
        # Turned the other way.
        turned = [rotate(tensor, frame @ frame) for tensor, frame in zip(tensors, frames, strict=True)]
        every.append(("other_frame", np.array(turned)))
    yield from ((code, each) for code, each in every if np.isfinite(each).all() and each.any((1, 2)).all())
