"""The intermediate axis theorem, against the linearised equations and an independent integration."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rigidcli.core.free_body import about_axes
from tests.core.rigid_motion import principal_frame


def stability(*moments: float) -> list[tuple[bool | None, float | None]]:
    return about_axes(np.array(moments), principal_frame(np.diag(moments)).groups)


@given(st.floats(0.1, 1), st.floats(0.1, 1))
def test_eigenvalues_of_the_linearised_equations(first: float, second: float) -> None:
    """About a spin along axis i, the deviations grow with the eigenvalues of the Jacobian of omega'."""
    moments = np.sort([first, second, 0.9 * (first + second)])
    assume(min(np.diff(moments)) > 1e-2)
    for i, (stable, rate) in enumerate(stability(*moments)):
        spin = np.zeros(3)
        spin[i] = 2.0
        jacobian = np.empty((3, 3))
        for column in range(3):
            step = np.zeros(3)
            step[column] = 1e-6
            rates = [np.cross(moments * w, w) / moments for w in (spin + step, spin - step)]
            jacobian[:, column] = (rates[0] - rates[1]) / 2e-6
        values = np.linalg.eigvals(jacobian)
        assert rate is not None
        assert 2 * rate == pytest.approx(np.abs(values).max(), rel=1e-6)
        assert stable == (np.abs(values.real).max() < 1e-3 * np.abs(values).max())


def test_axes_of_equal_moments_are_neutral() -> None:
    neutral = (None, 0.0)
    assert stability(1, 1, 1.5)[:2] == [neutral, neutral]
    assert stability(1, 3, 3)[1:] == [neutral, neutral]
    assert stability(1, 1, 1.5)[2][0]
    assert stability(1, 3, 3)[0][0]
    assert stability(1, 1, 1.5)[2][1] == pytest.approx(0.5, rel=1e-15)
    assert stability(2, 2, 2) == [neutral] * 3
    assert stability(0, 2, 2) == [(None, None), neutral, neutral]
    assert stability(0, 0, 0) == [(None, None)] * 3
