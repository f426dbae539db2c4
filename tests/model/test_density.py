"""Densities that vary over a shape, against quadrature of another kind, closed forms and exact integrals."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import rigidcli
from tests.model.test_shapes import REFERENCES
from tests.shapes import DIMENSIONS

Floats = NDArray[np.float64]

SMOOTH = 1e-12
ROUGH = 1e-6


def found(body: dict[str, Any], **options: Any) -> Any:
    return rigidcli.inertia({"body": body, "about": "com"}, **options)


def by_gauss(shape: str, dimensions: Any, density: Callable[..., Floats]) -> Any:
    """Mass, centre of mass and central tensor by Gauss's rule over a parametrisation of the tests' own."""
    reference = REFERENCES[shape]
    nodes, weights = np.polynomial.legendre.leggauss(36)
    axes, along = [(nodes + 1) / 2] * reference.rank, [weights / 2] * reference.rank
    units = [grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")]
    factor = math.prod(grid.ravel() for grid in np.meshgrid(*along, indexing="ij"))
    units += [np.zeros(1)] * (3 - reference.rank)
    origin = np.array(reference.origin(dimensions), dtype=float)
    masses, places = [], []
    for patch in reference.patches(dimensions):
        *place, jacobian = (np.broadcast_to(part, np.shape(factor)) for part in patch(*units))
        masses.append(factor * jacobian * density(*(x + o for x, o in zip(place, origin, strict=True))))
        places.append(np.array(place))
    m, r = np.concatenate(masses), np.hstack(places)
    centre = r @ m / m.sum()
    second = (r - centre[:, None]) * m @ (r - centre[:, None]).T
    return m.sum(), centre + origin, np.trace(second) * np.eye(3) - second


@pytest.mark.parametrize("shape", DIMENSIONS)
def test_every_shape_against_another_parametrisation(shape: str) -> None:
    dimensions = REFERENCES[shape].samples[0]
    result = found({"shape": shape, **dimensions, "density": "exp((x - 2*y + z)/5) + r^2/9 + s^2/4 + 1"})
    mass, centre, tensor = by_gauss(
        shape,
        dimensions,
        lambda x, y, z: np.exp((x - 2 * y + z) / 5) + (x * x + y * y + z * z) / 9 + (x * x + y * y) / 4 + 1,
    )
    size = math.sqrt(np.trace(tensor) / mass)
    assert result["mass"] == pytest.approx(mass, rel=SMOOTH)
    np.testing.assert_allclose(result["center_of_mass"], centre, atol=SMOOTH * size)
    np.testing.assert_allclose(result["tensor"], tensor, atol=SMOOTH * np.trace(tensor))
    assert 0 < result["integration_error"] <= SMOOTH
