"""Numbers and quantities: the value, the unit, and the figures that are written.

An answer is held against the key in the unit in which it was typed. Where its value is right, its figures
are counted; where it is not, a mistake that alone explains it is named.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rigidcli.errors import ValueProblem
from rigidcli.grading.asked import Tree
from rigidcli.grading.numbers import Written, read_written
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong
from rigidcli.grading.scalars.examples import examples
from rigidcli.grading.scalars.key import Key, read_key
from rigidcli.grading.scalars.mistakes import explaining, misfit
from rigidcli.grading.scalars.near import is_near
from rigidcli.grading.units import read_unit, scale_in

__all__ = ["examples", "judge", "read_key"]


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of a number as it was typed. Raises Unreadable."""
    written = read_written(answer)
    if key.tolerance.significant_figures is not None and not written.mantissa:
        raise Unreadable("not_a_number", "significant figures are asked for: write a decimal number")
    finding = _finding(key, written)
    return correct() if finding is None else wrong(replace(finding, reference=key.told))


def _finding(key: Key, written: Written) -> Finding | None:
    """What is wrong with an answer. Raises Unreadable for a unit that is none."""
    if written.unit is None:
        if key.required and (written.value or key.reference):
            return Finding("unit_missing")
        scale = key.plain
    else:
        unit = read_unit(written.unit, key.unit)
        try:
            scale = scale_in(unit, key.unit.dimension)
        except ValueProblem as problem:
            return Finding(misfit(key, written, unit), detail=problem.message)
    return _figures(key, written) if is_near(key, written.value, scale) else _mistake(key, written, scale)


def _figures(key: Key, written: Written) -> Finding | None:
    """What is wrong with the figures of an answer that has the right value."""
    asked, counting = key.figures, key.tolerance.figures
    if asked is None or key.reference == 0:
        return None
    if written.figures < asked:
        return Finding("too_few_sig_figs")
    if counting != "at_least" and written.least_figures > asked:
        detail = f"{written.figures} significant figures are written, expected {asked}"
        return Finding("wrong_shape", detail=detail)
    return Finding("sig_figs_ambiguous") if counting == "strict" and written.ambiguous else None


def _mistake(key: Key, written: Written, scale: float) -> Finding:
    """What is wrong with an answer that has not the right value."""
    codes = explaining(key, written, scale)
    if codes == {"unit_missing"}:
        return Finding("unit_missing", detail="without a unit, a number is in SI units")
    return Finding(codes.pop() if len(codes) == 1 else "outside_tolerance")
