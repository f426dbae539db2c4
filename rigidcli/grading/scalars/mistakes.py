"""What explains a wrong number: a factor of the key, a wrong unit, or digits that were rounded away."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rigidcli.grading.numbers import NOISE, Written, margin
from rigidcli.grading.scalars.factors import DEGREES, TURN
from rigidcli.grading.scalars.key import Key
from rigidcli.grading.scalars.near import is_near, is_rounded
from rigidcli.model.units import ANGLE, Unit


def misfit(key: Key, written: Written, unit: Unit) -> str:
    """The code of an answer in a unit that does not fit: a hertz and a radian per second are told apart."""
    given, asked = unit.dimension, key.unit.dimension
    if given.cycle != asked.cycle and given._replace(angle=0, cycle=0) == asked._replace(angle=0, cycle=0):
        if is_near(key, written.value, unit.scale):
            return "wrong_unit_right_number"
        if is_near(key, written.value, unit.scale * (TURN if given.cycle else 1 / TURN)):
            return "frequency_vs_angular_frequency"
    return "unit_incompatible"


def explaining(key: Key, written: Written, scale: float) -> set[str]:
    """The codes of all mistakes that lead from the reference to an answer in a unit of `scale`.

    With the right number in a wrong unit, the factor between the units is no other mistake.
    """
    if written.unit is None:
        if key.unit.dimension != ANGLE and is_near(key, written.value, key.unit.scale):
            return {"unit_missing"}
    elif any(
        abs(scale / own - 1) > NOISE and is_near(key, written.value, own)
        for own in (key.unit.scale, key.plain)
    ):
        return {"wrong_unit_right_number"}
    least = _least_change(key, scale)
    codes = {
        code
        for code, factor in (*key.mistakes, *_wrong_way(key, scale))
        if abs(factor - 1) > least and is_near(key, written.value, scale, factor)
    }
    if is_rounded(key, written, scale):
        too_few = key.figures is not None and written.figures < key.figures
        codes.add("too_few_sig_figs" if too_few else "precision_insufficient")
    return codes


def _least_change(key: Key, scale: float) -> float:
    """The relative change of the reference below which a mistake is not told from any wrong number."""
    reference = key.reference / scale
    if reference == 0 or not math.isfinite(reference):
        return math.inf
    return 2 * margin(reference, key.tolerance, scale / key.plain) / abs(reference)


def _wrong_way(key: Key, scale: float) -> Iterator[tuple[str, float]]:
    """Codes and factors of multiplying by a unit where one divides, unless that is a power of ten."""
    for own in (key.unit.scale, key.plain):
        ratio = scale / own
        squared = ratio * ratio
        tens = math.log10(squared) if 0 < squared < math.inf else 0.0
        if abs(tens - round(tens)) > NOISE:
            angle = any(abs(ratio / degrees - 1) <= NOISE for degrees in (DEGREES, 1 / DEGREES))
            yield ("degrees_radians" if angle else "unit_conversion"), squared
