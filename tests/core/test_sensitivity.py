"""The effect of rounding against turns whose derivatives are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from rigidcli.core.sensitivity import LEAST, SAMPLES, representative, to_rounding

Floats = NDArray[np.float64]

EPS = 2.0**-52


def about_z(angles: Floats) -> Floats:
    zeros = np.zeros_like(angles)
    return np.column_stack([np.cos(angles / 2), zeros, zeros, np.sin(angles / 2)])


def turning(times: Floats, *factors: float) -> tuple[Floats, Floats, float]:
    """Inputs of 1.5, orientations, and their sensitivity, where the angle is factors . inputs t."""
    inputs = np.full(len(factors), 1.5)

    def orientations(values: Floats) -> Floats:
        return about_z(float(np.dot(factors, values)) * times)

    reference = orientations(inputs)
    return inputs, reference, to_rounding(orientations, inputs, reference)


def test_one_input() -> None:
    # The unit in the last place of 1.5 is 2^-52, and that turns by 2^20 times as much after 2^20 s.
    assert turning(np.array([0.0, 1e3, 2.0**20]), 1.0)[2] == pytest.approx(2.0**-32, rel=1e-5)
    assert turning(np.array([-(2.0**20), 1e3]), 1.0)[2] == pytest.approx(2.0**-32, rel=1e-5)


def test_inputs_add_as_squares() -> None:
    assert turning(np.array([2.0**20]), 4.0, -4.0)[2] == pytest.approx(2.0**-30 * math.sqrt(2), rel=1e-5)


def test_it_is_an_angle() -> None:
    assert turning(np.array([1e17]), 1.0, 2.0, 3.0, 4.0)[2] <= math.pi
    assert turning(np.array([0.0]), 1.0)[2] == LEAST
    assert turning(np.array([]), 1.0)[2] == LEAST


def test_the_sign_of_a_quaternion_means_nothing() -> None:
    times = np.array([1e6])
    inputs, reference, expected = turning(times, 1.0)
    assert to_rounding(lambda values: -about_z(values[0] * times), inputs, reference) == expected


def test_a_negative_input_grows_too() -> None:
    seen = []

    def orientations(values: Floats) -> Floats:
        seen.append(values.tolist())
        return about_z(np.zeros(1))

    to_rounding(orientations, np.array([-1.0, 0.0, 2.0]), about_z(np.zeros(1)))
    # What is zero is so exactly, and one is changed at a time.
    assert seen == [[-1 - EPS, 0, 2], [-1, 0, 2 + 2 * EPS]]


def test_what_is_not_a_number_is_not_trusted() -> None:
    def orientations(values: Floats) -> Floats:
        return np.full((1, 4), math.nan)

    assert to_rounding(orientations, np.ones(2), about_z(np.zeros(1))) == math.pi


@pytest.mark.parametrize("count", [0, 1, 2, 63, 64, 65, 127, 128, 1000, 8191, 100_000])
def test_some_of_the_times(count: int) -> None:
    times = np.linspace(0.0, 7.0, count)
    chosen = representative(times)
    assert set(chosen) <= set(times)
    assert min(count, SAMPLES // 2) <= len(chosen) <= SAMPLES + 1
    if count:
        assert (chosen[0], chosen[-1]) == (times[0], times[-1])
