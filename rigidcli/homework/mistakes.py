"""Common mistakes: a code for each, with the results that a problem has where this mistake is made.

A wrong answer that equals the results of one code alone is explained by that mistake.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import permutations
from typing import TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Array, Floats
from rigidcli.core.tensor import point_tensor, rotate
from rigidcli.fields.dimensions import DIMENSIONLESS
from rigidcli.fields.units import Unit
from rigidcli.homework.base import KeySource
from rigidcli.homework.entries import NOISE_OF_ENTRIES

Arrays: TypeAlias = Iterator[tuple[str, Array]]  # codes of mistakes, each with the entries that come out
EYE = np.eye(3, dtype=int)
# Factors of the entries of a tensor that give its products of inertia the other sign.
OTHER_PRODUCTS = 2 * EYE - 1
TENS = tuple(10.0**power for power in range(1, 13))
# Factors that people forget in a formula.
LOST = (2, 3, 4, 5, 6, 8, 12, 3 / 2, 4 / 3, 5 / 2, math.sqrt(2), math.sqrt(3), math.pi)
TURN = 2 * math.pi


# --- vectors and tensors


def of_vector(source: KeySource, vector: Array) -> Arrays:
    """The vector along the axes of the document, turned the wrong way, and with components exchanged."""
    if source.document is not None and source.document.frame is not None and vector.size == 3:
        axes, own = source.document.physical.axes, np.asarray(source.value)
        yield "other_frame", axes @ own
        yield "other_frame", axes.T @ own
    if vector.size <= 4:
        orders = list(permutations(range(vector.size)))[1:]
        yield from (("components_permuted", vector[list(order)]) for order in orders)


def of_tensor(source: KeySource, tensor: Array) -> Arrays:
    """What mistakes make of a tensor of inertia; the formulas take floats, exact numbers and trees."""
    yield "products_of_inertia_sign", tensor * OTHER_PRODUCTS
    yield "products_of_inertia_missing", tensor * EYE
    orders = [list(order) for order in permutations(range(3))]
    for order in orders[1:]:
        yield "components_permuted", tensor[order, :][:, order]
    if tensor.dtype == float:
        moments = np.linalg.eigvalsh(tensor)
        yield from (("other_frame", np.diag(moments[order])) for order in orders)
    if source.document is None or source.report is None:
        return
    tidy, results = source.document.arithmetic.tidy, source.report.tree
    if source.document.frame is not None:  # along the axes of the document, and turned the wrong way
        axes = source.document.physical.axes
        yield "other_frame", tidy(rotate(tensor, axes))
        yield "other_frame", tidy(rotate(tensor, axes @ axes))
    needed = [results.get(name) for name in ("mass", "center_of_mass", "about", "tensor", "tensor_com")]
    if all(each is not None for each in needed):
        mass, com, about, here, central = map(np.asarray, needed)
        term = mass * point_tensor(about - com)
        about_com = source.path[-1:] == ("tensor_com",)
        yield "parallel_axis_missing", tidy(here if about_com else central)
        yield "parallel_axis_sign", tidy(here + term if about_com else central - term)


# --- factors by which people's numbers are wrong


def common_factor(ratio: float, unit: Unit | None, path: tuple[str, ...], slack: float) -> str | None:
    """The code of the one factor that an answer has, to a relative `slack`; None where it has no name.

    The `unit` and the `path` of the result tell which factors are likely: a 2 pi is one of rates only.
    """
    for code, factor in _factors(unit, path):
        if abs(factor - 1) > 2 * slack and abs(ratio / factor - 1) <= slack:
            return code
    return None


def shared_factor(
    own: Floats, expected: Floats, unit: Unit | None, path: tuple[str, ...], slack: float
) -> str | None:
    """The code of the one factor by which all numbers (n by k) are wrong; None where there is none.

    The slack is relative to the largest number of a column. The factor is the median over entries at least
    half as large as that.
    """
    sizes = np.abs(expected)
    scale = sizes.max(axis=0)
    with np.errstate(all="ignore"):
        middle = float(np.median((own / expected)[sizes >= scale / 2]))
        is_shared = bool((np.abs(own - middle * expected) <= abs(middle) * slack * scale).all())
    if not is_shared or not middle or abs(middle - 1) <= slack:
        return None
    # Of numbers of different sizes any shared factor is one; of one number it may be anything.
    least = np.where(sizes > NOISE_OF_ENTRIES * scale, sizes, np.inf).min(axis=0)
    differ = bool((scale > least * (1 + 2 * slack)).any())
    return common_factor(middle, unit, path, slack) or ("constant_factor" if differ else None)


def _factors(unit: Unit | None, path: tuple[str, ...]) -> Iterator[tuple[str, float]]:
    """Codes and factors, the likely ones first."""
    dimension = DIMENSIONLESS if unit is None else unit.dimension
    is_rate = dimension.time in (1, -1) and not (dimension.mass or dimension.length)
    is_bare = unit is None and not path
    is_turn = is_rate or dimension.cycle or is_bare
    is_angle = dimension.angle or dimension.time or dimension == DIMENSIONLESS
    slips: dict[str, Sequence[float]] = {
        "power_of_ten": TENS,
        "degrees_radians": (180 / math.pi,) if is_angle else (),
        "frequency_vs_angular_frequency": (TURN,) if is_turn else (),
        "constant_factor": LOST,
    }
    yield "sign_error", -1.0
    for code, factors in slips.items():
        for factor in factors:
            yield code, factor
            yield code, 1 / factor
