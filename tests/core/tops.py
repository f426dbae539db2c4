"""Numbers for heavy symmetric tops."""

from __future__ import annotations

import math

from hypothesis import strategies as st

Start = tuple[float, float, float, float, float, float, float]
"""lambda1, lambda3, spin, tilt, phi-dot, theta-dot, M g R."""

MOMENTS = st.floats(0.05, 20)
WEIGHTS = st.sampled_from([0.0, 1.0, 9.80665]) | st.floats(0.01, 50)
SPINS = st.sampled_from([0.0, 1.0, -3.0, 1e3, -1e5]) | st.floats(-40, 40).map(lambda x: round(x, 6))
TILTS = st.sampled_from([0.1, 1e-6, math.pi / 2, 2.5, 3.1415]) | st.floats(0.01, 3.13)
RATES = st.sampled_from([0.0, 0.0, 0.3, -2.0]) | st.floats(-9, 9).map(lambda x: round(x, 6))
