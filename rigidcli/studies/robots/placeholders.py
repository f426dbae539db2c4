"""Tensors that somebody typed so that a file would load."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidcli.studies.robots.geometry import Remark, Solid, Weighed, moments_agree

ALIKE = 1.2
"""Moments that agree with the geometry to within this factor are no placeholder, however round."""

EQUAL = 1e-9
"""Moments that differ by less than this, relative to their size, are equal: turned axes round them."""


def placeholder(body: Weighed, forms: Sequence[Solid]) -> Remark | None:
    """The remark on a tensor that looks like a placeholder: zero, or three equal moments that are round.

    Those of a ball or a cube are equal, too: a tensor that agrees with the geometry is none.
    """
    moments = np.diag(body.tensor)
    if not body.tensor.any():
        return Remark(
            "inertia", "the tensor is zero: this is a point, which most simulators refuse or change"
        )
    moment = float(moments[0])
    if np.abs(body.tensor - moment * np.eye(3)).max() > EQUAL * abs(moment):
        return None
    if any(moments_agree(body, form, ALIKE) for form in forms):
        return None
    if moment == 1:
        return Remark("inertia", "the identity tensor looks like a placeholder")
    if f"{moment:e}".startswith("1.000000e"):
        return Remark("inertia", f"{moment:g} kg m^2 for each moment looks like a placeholder")
    if body.mass == 1:
        return Remark(
            "inertia", f"equal moments ({moment:g} kg m^2) and a mass of 1 kg look like placeholders"
        )
    return None
