"""Densities that vary inside a mesh: against shapes, against sums by hand, and what is refused where."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rigidcli
from rigidcli import RigidError
from tests.conftest import ROOT
from tests.meshes import Triangles, box, inside_out, prism, revolved, saved

CENTRED = box((-0.5, -1, -1.5), (0.5, 1, 1.5))
CORNER = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], dtype=float)
"""The outline of an L, which consists of the rectangles 2 by 1 and 1 by 1."""


def of_mesh(path: Path, density: str, rest: str = "") -> Any:
    return rigidcli.inertia(f"body: {{mesh: '{path}', density: '{density}'{rest}}}")


def refusal(path: Path, density: str, rest: str = "") -> str:
    with pytest.raises(RigidError) as caught:
        of_mesh(path, density, rest)
    return str(caught.value)


def assert_same(found: Any, expected: Any, tolerance: float = 1e-13) -> None:
    for key in ("mass", "center_of_mass", "tensor", "tensor_com"):
        scale = np.abs(expected[key]).max() + 1e-300
        np.testing.assert_allclose(found[key], expected[key], atol=tolerance * max(scale, 1), err_msg=key)


@pytest.mark.parametrize(
    "density",
    ["9 + x", "1 + x*y + z**2", "1 + r**2 + s**4 + x**3*y**5"],
)
@pytest.mark.parametrize("wound", [CENTRED, inside_out(CENTRED)])
def test_a_box_is_what_the_shape_is(density: str, wound: Triangles, tmp_path: Path) -> None:
    found = of_mesh(saved(tmp_path / "a.stl", wound), density)
    assert_same(found, rigidcli.inertia(f"body: {{shape: box, size: [1, 2, 3], density: '{density}'}}"))


def test_a_body_with_a_notch_is_its_two_halves(tmp_path: Path) -> None:
    density = "1 + x + y**2*z**2"
    found = of_mesh(saved(tmp_path / "a.stl", prism(CORNER, 0, 1)), density)
    halves = [((0, 0, 0), (2, 1, 1)), ((0, 1, 0), (1, 2, 1))]
    paths = [saved(tmp_path / f"{k}.stl", box(*corners)) for k, corners in enumerate(halves)]
    parts = ", ".join(f"{{mesh: '{path}', density: '{density}'}}" for path in paths)
    assert_same(found, rigidcli.inertia(f"body: {{parts: [{parts}]}}"))


def test_a_ring_with_a_polynomial_has_the_moments_of_its_sections(tmp_path: Path) -> None:
    """A square section from r = 1 to 2, z = 0 to 1, of a polygon with n sides:
    the mean of s^2 over a sector between radii a r is that of an isosceles triangle, r^2 (2 + cos(w))/6."""
    turns = 60
    section = np.array([(1, 0), (1, 1), (2, 1), (2, 0)], dtype=float)
    path = saved(tmp_path / "a.stl", revolved(section, turns))
    angle = 2 * np.pi / turns
    fourths = turns * np.sin(angle) / 2 * (2**4 - 1**4) * (2 + np.cos(angle)) / 6
    np.testing.assert_allclose(of_mesh(path, "s**2")["mass"], fourths, rtol=1e-7)  # single precision


def test_scale_far_places_and_parameters(tmp_path: Path) -> None:
    """The variables are metres, also in a file of millimetres and 10^5 sizes from the origin."""
    path = saved(tmp_path / "a.stl", box((99_999, 0, 0), (100_001, 1, 1)))
    found = of_mesh(path, "1 + (x - 100)**n", ", scale: 1 mm}\nparameters: {n: 2")
    np.testing.assert_allclose(found["mass"], 2e-9 * (1 + 1e-6 / 3), rtol=1e-14)
    np.testing.assert_allclose(found["center_of_mass"], [100, 0.0005, 0.0005], rtol=1e-14)
    found = of_mesh(ROOT / "configs" / "bracket.stl", "x", ", scale: 0.001")
    limbs = 0.060**2 / 2 * 0.005 + 0.005**2 / 2 * 0.035
    np.testing.assert_allclose(found["mass"], 0.030 * limbs, rtol=1e-7)


@pytest.mark.parametrize(
    ("density", "message"),
    [
        ("x", "negative (-0.5 kg/m^3) at x, y, z = (-0.5, "),
        ("(x - 0.1)**2 + y**2 + z**2 - 0.01", "negative (-0.00972222 kg/m^3) at x, y, z = (0.0833333, 0, 0)"),
    ],
)
def test_no_density_is_negative(density: str, message: str, tmp_path: Path) -> None:
    found = refusal(saved(tmp_path / "a.stl", CENTRED), density)
    assert "body.density: the density is" in found
    assert message in found


def test_a_density_may_be_negative_where_the_body_is_not(tmp_path: Path) -> None:
    apart = np.concatenate([box((0, 0, 0), (1, 1, 1)), box((3, 0, 0), (4, 1, 1))])
    found = of_mesh(saved(tmp_path / "a.stl", apart), "(x - 2)**2 - 0.5")
    np.testing.assert_allclose(found["mass"], 2 * (7 / 3 - 0.5), rtol=1e-14)


def test_what_is_no_polynomial_is_refused(tmp_path: Path) -> None:
    profile = np.array([(0, 1), *((np.sin(t), np.cos(t)) for t in np.linspace(0.1, 3, 20)), (0, -1)])
    ball = revolved(profile, 20)
    path = saved(tmp_path / "a.stl", ball)
    assert "a density inside a mesh is a polynomial" in refusal(path, "exp(x)")
    assert of_mesh(path, "1 + x**2")["mass"] > of_mesh(path, "1")["mass"]


@pytest.mark.parametrize(("density", "fits"), [("1 + x", True), ("1 + 3*x", False)])
def test_a_hole_takes_no_more_than_is_there(density: str, fits: bool, tmp_path: Path) -> None:
    """A cube of density 1.5 + x, with a smaller one of another density taken out of its middle."""
    whole = saved(tmp_path / "a.stl", box((0, 0, 0), (1, 1, 1)))
    hole = saved(tmp_path / "b.stl", box((0.25, 0.25, 0.25), (0.75, 0.75, 0.75)))
    parts = f"{{mesh: '{whole}', density: 1.5 + x}}, {{mesh: '{hole}', density: {density}, hole: true}}"
    document = f"body: {{parts: [{parts}]}}"
    if fits:
        np.testing.assert_allclose(rigidcli.inertia(document)["mass"], 2 - 1.5 / 8, rtol=1e-14)
    else:
        with pytest.raises(RigidError, match="more is taken away than is there"):
            rigidcli.inertia(document)
