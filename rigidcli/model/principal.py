"""The principal frame of a tensor, in whichever kind of number it is written."""

from __future__ import annotations

from rigidcli.core import principal
from rigidcli.core.arithmetic import Arithmetic, Array


def principal_frame(tensor: Array, n: Arithmetic) -> principal.PrincipalFrame:
    """The principal frame of a symmetric tensor (3 by 3), floating or exact."""
    if not n.exact:
        return principal.principal_frame(tensor)
    from rigidcli.symbolic.mechanics.principal_axes import principal_frame as exact_frame

    frame: principal.PrincipalFrame = exact_frame(tensor)
    return frame
