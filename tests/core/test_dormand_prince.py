"""The method of Dormand and Prince: its published coefficients, its order, and its estimate of errors."""

from __future__ import annotations

import math
import re
from types import ModuleType

import numpy as np
import pytest
from scipy.integrate._ivp import dop853_coefficients as published

from rigidcli.core import dormand_prince, symplectic
from tests.conftest import ROOT
from tests.core.flows import oscillator


def test_the_coefficients_are_the_published_ones() -> None:
    full = [np.pad(row, (0, 12 - len(row))) for row in dormand_prince.STAGES]
    assert np.array(dormand_prince.NODES) == pytest.approx(published.C[:12], rel=1e-15)
    assert np.array(full) == pytest.approx(published.A[:12, :12], rel=1e-15, abs=0)
    assert dormand_prince.WEIGHTS.tolist() == published.B.tolist()
    assert dormand_prince.ERROR_5.tolist() == published.E5[:12].tolist()
    assert pytest.approx(published.E3[:12], abs=1e-16) == dormand_prince.ERROR_3


def step_error(h: float) -> tuple[float, float]:
    """The error of one step on the circle, true and as it is estimated."""
    step = dormand_prince.stepper((1, 1))
    start = ((1.0, 0.0), (0.0, -1.0), (0.0, 0.0))
    _, after, _ = step(oscillator, 0.0, h, *start, (0.0, 0.0), 1.0)
    # With the finest of tolerances the bound on the error of order 3 plays no part.
    estimate, _, _ = step(oscillator, 0.0, h, *start, (0.0, 0.0), 1e-60)
    return math.hypot(after[0] - math.cos(h), after[1] + math.sin(h)), 1e-60 * estimate


@pytest.mark.parametrize("h", [0.5, 0.7, -0.6])
def test_one_step_is_of_order_eight(h: float) -> None:
    error, _ = step_error(h)
    half, _ = step_error(h / 2)
    assert math.log2(error / half) == pytest.approx(9, abs=0.3)


def test_the_estimate_is_no_smaller_than_the_error() -> None:
    for h in np.linspace(0.3, 1.0, 15):
        error, estimate = step_error(float(h))
        assert error < estimate < 1e4 * error


def test_a_step_in_arrays_has_no_error_where_order_five_sees_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Both estimates are sums over the stages, whose rounding would hide that one of them is zero.
    arrays = dormand_prince.ArraySteps(lambda t, y: (np.cos(5 * t),), (1, 16), 1e-6, [slice(0, 1)])
    none, total = arrays.errors[0], arrays.total
    monkeypatch.setattr(arrays, "total", lambda part: total(part) * (part is not none))
    t, y = np.zeros((2, 16)), np.ones((1, 16))
    with np.errstate(all="ignore"):  # as `many` has it around all steps
        error, _, _ = arrays.with_error(t[0], np.ones(16), y, y, np.ones((1, 16)))
    assert error.tolist() == [0.0] * 16


@pytest.mark.parametrize("method", [dormand_prince, symplectic])
def test_the_text_of_a_step_is_kept_to_be_read(method: ModuleType) -> None:
    """With numbers in 12 digits, as those of Gauss's points may differ in the last one."""
    text = method.source((1,) if method is dormand_prince else 1)
    kept = ROOT / "tests" / "golden" / f"step_{method.__name__.rpartition('.')[2]}.txt"
    assert (
        re.sub(r"\d+\.\d+(e-\d+)?", lambda number: f"{float(number[0]):.12g}", text) + "\n"
        == kept.read_text()
    )
