"""The kinds of answers: how a key and an answer of each are read and compared."""

from __future__ import annotations

from rigidcli.check.base import Kind
from rigidcli.check.kinds.arrays import Matrix, Vector
from rigidcli.check.kinds.axes import Axes
from rigidcli.check.kinds.equations import Equations
from rigidcli.check.kinds.expression import Expression
from rigidcli.check.kinds.single import Choice, Quantity
from rigidcli.check.kinds.tensors import Moments, Tensor
from rigidcli.check.kinds.trajectory import Trajectory

KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        *(Quantity("number"), Quantity("quantity"), Vector(), Moments(), Matrix(), Tensor(), Axes()),
        *(Expression(), Equations(), Trajectory(), Choice()),
    )
}
"""The kinds of answers by the names that questions have for them."""
