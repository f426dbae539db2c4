"""The making of a key of principal axes: from the tensor of a report, a literal one, or literal pairs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.tensor import rotate, shortfall
from rigidcli.errors import ValueProblem
from rigidcli.fields.units import parse_unit
from rigidcli.grading.arrays.entries import times, worked
from rigidcli.grading.arrays.keys import computed, reference
from rigidcli.grading.arrays.reference import Reference
from rigidcli.grading.asked import Asked
from rigidcli.grading.codes import CODES
from rigidcli.grading.infer import BY_NAME
from rigidcli.grading.numbers import ROUNDING
from rigidcli.grading.principal.eigen import Answer, default_angle, match, solve
from rigidcli.grading.principal.key import LARGEST, SMALLEST, Key
from rigidcli.grading.principal.reading import pair_cells, tensor_cells
from rigidcli.grading.tensors import OTHER_PRODUCTS, mistaken_tensors

LARGEST_ANGLE = 0.5
"""An angle (rad) that a question may allow to an axis; what is more was hardly meant in radians."""

KEY_SLACK = 1e-2
"""How far a key that is typed with few digits may miss the laws, in units of its largest entry."""


def key_of(asked: Asked) -> Key:
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


def _reported(asked: Asked) -> Reference:
    """The tensor that is asked for, or the moments and axes of the report, or its tensor."""
    assert asked.report is not None
    value = asked.value if BY_NAME.get(asked.path[-1]) == "tensor" else asked.report.get("tensor")
    moments, axes = (asked.report.get(name) for name in ("moments", "axes"))
    if moments is not None and axes is not None and value is not asked.value:
        value = np.column_stack([np.asarray(moments, dtype=object), np.asarray(axes, dtype=object)])
    if value is None:
        raise ValueProblem("this document has no principal axes")
    return reference(replace(asked, value=value, unit="kg m^2"), tensor_cells)


def _literal(asked: Asked) -> Reference:
    """A key `{tensor: ...}`, whose products of inertia have the sign that is asked, or one with pairs."""
    value = asked.value
    if isinstance(value, list) or (isinstance(value, dict) and "moments" in value):
        ours = reference(asked, pair_cells)
    else:
        whole = isinstance(value, dict) and set(value) == {"tensor"}
        ours = reference(replace(asked, value=value["tensor"] if whole else value), tensor_cells)
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


def _mistaken(asked: Asked, tensors: Floats, key: Reference) -> Iterator[tuple[str, Floats]]:
    """Codes with the tensors (k by 3 by 3) whose moments and axes come out under them."""
    every = [*mistaken_tensors(asked, tensors, key)]
    if asked.document is not None and asked.document.frame is not None:
        frames = worked(computed(asked.document.physical.axes), key.points)
        # Turned the other way.
        turned = [rotate(tensor, frame @ frame) for tensor, frame in zip(tensors, frames, strict=True)]
        every.append(("other_frame", np.array(turned)))
    yield from ((code, each) for code, each in every if np.isfinite(each).all() and each.any((1, 2)).all())
