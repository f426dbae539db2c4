"""Densities that vary over a shape, against quadrature of another kind, closed forms and exact integrals."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from scipy import integrate

import rigidcli
from rigidcli.errors import ComputationError, DocumentError
from tests.bodies.test_shapes import REFERENCES
from tests.conftest import Program
from tests.shapes import DIMENSIONS
from tests.tables import rows_of

Floats = NDArray[np.float64]

SMOOTH = 1e-12
ROUGH = 1e-4
"""The largest relative error of an answer."""


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


def test_a_rod_whose_density_grows_has_the_moments_of_the_integrals_by_hand() -> None:
    a, b, length = 2.0, 3.0, 1.5
    result = found(
        {"shape": "rod", "length": length, "density": f"{a} + {b}*(z + {length}/2)", "anchor": "end"}
    )
    mass = a * length + b * length**2 / 2
    centre = (a * length**2 / 2 + b * length**3 / 3) / mass
    second = a * length**3 / 3 + b * length**4 / 4
    assert result["mass"] == pytest.approx(mass, rel=SMOOTH)
    assert result["center_of_mass"] == pytest.approx([0, 0, centre], rel=SMOOTH)
    assert result["tensor"][0][0] == pytest.approx(second - mass * centre**2, rel=SMOOTH)


def test_a_ball_that_thins_out_to_its_surface() -> None:
    result = found({"shape": "sphere", "radius": 2, "density": "3*(1 - r/2)"})
    assert result["mass"] == pytest.approx(math.pi * 3 * 8 / 3, rel=SMOOTH)
    # 8 pi/3 rho0 (R^5/5 - R^5/6)
    assert result["tensor"][2][2] == pytest.approx(8 * math.pi / 3 * 3 * 32 / 30, rel=SMOOTH)


def test_the_earth_in_layers_by_jumps_is_the_earth_in_parts() -> None:
    jumps = {"shape": "sphere", "radius": 6.4e6, "density": "8000 - 4000*sign(r - 3.5e6)"}
    parts = {
        "parts": [
            {"shape": "sphere", "radius": 3.5e6, "density": 12000},
            {"shape": "hollow_sphere", "inner_radius": 3.5e6, "outer_radius": 6.4e6, "density": 4000},
        ]
    }
    one, two = found(jumps), found(parts)
    assert one["mass"] == pytest.approx(two["mass"], rel=SMOOTH)
    assert one["tensor"][0][0] == pytest.approx(two["tensor"][0][0], rel=SMOOTH)


SHELL = 4 * math.pi**1.5 * 1e-3 * (0.25 + 0.5e-6)
"""The integral of exp(-((r - 1/2)/w)^2) over all space, w = 10^-3: 4 pi^(3/2) w (1/4 + w^2/2)."""

CAP = math.pi * 0.7**2 * (3 - 0.7) / 3
# Of a cap, the ball of 0.9 fills another cap.
WHOLE, INNER = (math.pi * h**2 * (3 * R - h) / 3 for R, h in ((1.1, 0.5), (0.9, 0.3)))
KINKS: list[tuple[str, dict[str, Any], float]] = [
    ("2 - sign(r - 0.9)", {"shape": "spherical_cap", "radius": 1.1, "cap_height": 0.5}, WHOLE + 2 * INNER),
    ("2 + sign(z - 0.3)", {"shape": "sphere", "radius": 1}, 4 * math.pi / 3 + 2 * CAP),
    ("sqrt(1 - r)", {"shape": "sphere", "radius": 1}, 4 * math.pi * 16 / 105),
    ("sqrt(abs(x - 0.1))", {"shape": "cube", "side": 2}, 8 / 3 * (1.1**1.5 + 0.9**1.5)),
    ("abs(x)*abs(y)", {"shape": "plate", "size": [2, 2]}, 1),
    ("2 + sign(s - 0.7)", {"shape": "cube", "side": 2}, 24 - 4 * math.pi * 0.49),
    ("2 + sign(x - 0.5)", {"shape": "disk", "radius": 1}, math.pi + 2 * (math.pi / 3 - math.sqrt(3) / 4)),
    ("2 + sign(r - 0.3)", {"shape": "cylinder", "radius": 1, "height": 2}, 6 * math.pi - 8 * math.pi * 0.009),
    ("2 + sign(x + y - z)", {"shape": "sphere", "radius": 1}, 8 * math.pi / 3),
    ("2 + sign(x + y - z)", {"shape": "torus", "major_radius": 2, "minor_radius": 0.5}, 2 * math.pi**2),
    ("exp(-((z - 0.3)/1e-5)^2)", {"shape": "rod", "length": 1}, 1e-5 * math.sqrt(math.pi)),
    ("exp(-((x - 0.1)/1e-3)^2)", {"shape": "cube", "side": 1}, 1e-3 * math.sqrt(math.pi)),
    ("exp(-((x - 0.3)^2 + y^2)/1e-4)", {"shape": "disk", "radius": 1}, 1e-4 * math.pi),
    ("2 + tanh((x - 0.1)/1e-4)", {"shape": "cube", "side": 1}, 1.8),
    ("exp(-((x-0.1)^2 + (y-0.2)^2)/1e-6)", {"shape": "cube", "side": 1}, 1e-6 * math.pi),
    ("1/(1 + (x/1e-3)^2)", {"shape": "cube", "side": 1}, 2e-3 * math.atan(500)),
    ("exp(-(r - 0.5)^2/1e-6)", {"shape": "sphere", "radius": 1}, SHELL),
    ("2 + tanh(x/1e-4)", {"shape": "cone", "radius": 1, "height": 2}, 4 * math.pi / 3),
    ("1 + 1e3*exp(-((x - 0.25)/1e-4)^2)", {"shape": "cube", "side": 1}, 1 + 0.1 * math.sqrt(math.pi)),
    ("2 + tanh(y/1e-4)", {"shape": "disk", "radius": 1}, 2 * math.pi),
    # Round a tenth of a body, a fiftieth, and a ring along which the density changes.
    (
        "exp(-((x - 2)^2 + y^2 + z^2)/0.01)",
        {"shape": "torus", "major_radius": 2, "minor_radius": 1},
        (0.1 * math.sqrt(math.pi)) ** 3,
    ),
    (
        "exp(-((x - 0.1)^2 + (y - 0.2)^2 + z^2)/4e-4)",
        {"shape": "cube", "side": 1},
        (0.02 * math.sqrt(math.pi)) ** 3,
    ),
    (
        "exp(-((s - 0.5)^2 + z^2)/0.001)*(1 + x/2)",
        {"shape": "cylinder", "radius": 1, "height": 2},
        1e-3 * math.pi**2,
    ),
]


@pytest.mark.parametrize(
    ("density", "shape", "mass"), KINKS, ids=[f"{density} in {shape['shape']}" for density, shape, _ in KINKS]
)
def test_across_kinks_and_jumps_the_error_is_small_and_told(
    density: str, shape: dict[str, Any], mass: float
) -> None:
    result = found({**shape, "density": density})
    assert result["mass"] == pytest.approx(mass, rel=max(5 * result["integration_error"], SMOOTH))
    assert result["integration_error"] <= ROUGH


POLYNOMIAL = "60 + x^2*y + y*z + z^3/3 + r^2*s^2/4"


@pytest.mark.parametrize("shape", DIMENSIONS)
def test_exact_integrals_of_polynomials_are_those_of_quadrature(shape: str) -> None:
    body = yaml.safe_load(f"{{shape: {shape}, {DIMENSIONS[shape]}, density: '{POLYNOMIAL}'}}")
    exact, floats = found(body, exact=True), found(body)
    assert float(exact["mass"]) == pytest.approx(floats["mass"], rel=SMOOTH)
    tensor = [[float(entry) for entry in row] for row in exact["tensor"]]
    np.testing.assert_allclose(tensor, floats["tensor"], atol=1e-11 * np.trace(floats["tensor"]))


@pytest.mark.parametrize(
    ("body", "mass"),
    rows_of(__file__, "symbols stay in closed forms"),
)
def test_symbols_stay_in_closed_forms(body: str, mass: str) -> None:
    text = f"parameters: {{R: null, h: null, k: null}}\nbody: {body}"
    values = {"R": 1.3, "h": 0.7, "k": 2.1}
    found_mass = rigidcli.inertia(text)["mass"]
    used = {name: value for name, value in values.items() if name in found_mass.names}
    expected = eval(mass, {"pi": math.pi, "exp": math.exp, **values})
    assert found_mass.evaluate(**used) == pytest.approx(expected, rel=1e-14)


def test_high_powers_in_a_tetrahedron_have_closed_forms() -> None:
    """By Dirichlet, x^a y^b z^c over the unit tetrahedron is a! b! c!/(a + b + c + 3)!."""
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    body = {"shape": "tetrahedron", "vertices": corners, "density": "x^4*y^3*z^2"}
    exact, floats = (found(body, exact=exact) for exact in (True, False))
    assert float(exact["mass"]) == pytest.approx(288 / 479001600, rel=SMOOTH)
    tensor = [[float(entry) for entry in row] for row in exact["tensor"]]
    np.testing.assert_allclose(tensor, floats["tensor"], atol=1e-11 * np.trace(floats["tensor"]))


@pytest.mark.parametrize("density", ["1 + r", "2 + sign(z - x*x)", "3 + sign(z)*sign(z - 1/9)", "abs(z)^3"])
def test_signs_and_roots_are_no_closed_form(density: str) -> None:
    with pytest.raises(ComputationError, match="no closed form"):
        found({"shape": "box", "size": [1, 1, 1], "density": density}, exact=True)


def test_the_working_shows_the_integrals_of_the_density() -> None:
    rod = {"shape": "rod", "length": 2, "density": "1 + 3*z^2"}
    exact = rigidcli.inertia({"body": rod}, exact=True, steps=True)
    floats = rigidcli.inertia({"body": rod}, steps=True)
    titles = [[step.title for step in result.steps] for result in (exact, floats)]
    assert titles[0][:2] == ["Element of mass", "Integrals of the density"]
    assert titles[1][0] == "Integrals of the density"
    assert [str(field.value) for field in exact.steps[1].fields] == ["4", "0", "0", "0"]
    assert floats.steps[0].fields[1].value == floats["integration_error"]
    cone = rigidcli.inertia(
        {"body": {"shape": "cone", "radius": 1, "height": 2, "density": "3*z/2"}}, steps=True
    )
    (offset, *_), term = (
        next(field.value for step in cone.steps for field in step.fields if field.title.startswith(start))
        for start in ("d, from O", "M (d^2")
    )
    assert offset == term[2][2] == 0


@pytest.mark.parametrize(
    ("density", "reason"),
    [
        ("0.499 + x", "negative (-0.001 kg/m^3) at x, y, z = (-0.5, "),
        ("1 - 2*exp(-((x - 0.3)^2 + (y - 0.1)^2 + (z + 0.2)^2)/1e-6)", "at x, y, z = (0.3, 0.1, -0.2) m"),
        ("sqrt(x)", "without a value at"),
        ("0*x", "no mass"),
    ],
)
def test_a_density_that_no_body_has_is_refused_with_the_point(density: str, reason: str) -> None:
    with pytest.raises(DocumentError) as refusal:
        found({"shape": "cube", "side": 1, "density": density})
    assert reason in str(refusal.value)
    assert "density" in str(refusal.value)


INFINITE: list[tuple[str, dict[str, Any], float]] = [
    ("1/r", {"shape": "cube", "side": 1}, 3 * math.log(2 + math.sqrt(3)) - math.pi / 2),
    ("1/r", {"shape": "sphere", "radius": 1}, 2 * math.pi),
    ("1/r^2", {"shape": "sphere", "radius": 1}, 4 * math.pi),
    ("1/sqrt(r)", {"shape": "sphere", "radius": 1}, 4 * math.pi / 2.5),
    ("1/s", {"shape": "cylinder", "radius": 1, "height": 2}, 4 * math.pi),
    ("-log(r)", {"shape": "sphere", "radius": 1}, 4 * math.pi / 9),
    # The potential in a ball, at a point where an angle of the sphere begins: 2 pi (R^2 - a^2/3).
    ("1/sqrt((x - 0.2)^2 + y^2 + z^2)", {"shape": "sphere", "radius": 1}, 2 * math.pi * (1 - 0.04 / 3)),
]
"""Densities that are infinite at a point or on a line, with the masses of integrals by hand."""


@pytest.mark.parametrize(("density", "shape", "mass"), INFINITE)
def test_a_density_may_be_infinite_where_its_integral_is_not(
    density: str, shape: dict[str, Any], mass: float
) -> None:
    result = found({**shape, "density": density})
    assert result["mass"] == pytest.approx(mass, rel=max(5 * result["integration_error"], SMOOTH))
    assert result["integration_error"] <= ROUGH


BALL, CUBE = {"shape": "sphere", "radius": 1}, {"shape": "cube", "side": 1}


@pytest.mark.parametrize(
    ("density", "shape"),
    [
        ("1/(x - 0.3)^2", CUBE),
        ("1/s^2", CUBE),
        ("1/x^2", CUBE),
        ("1 + 1e3*exp(-((x + y + z - 0.1)/1e-4)^2)", CUBE),
        ("2 + sign(x - 0.12)", BALL),
        ("2 + sign(x + y - 0.1)", {"shape": "plate", "size": [1, 1]}),
        ("1 + 5*exp(-((sqrt((x + 0.07)^2 + (y - 0.11)^2 + (z - 0.13)^2) - 0.24)/1e-3)^2)", BALL),
    ],
)
def test_an_infinite_integral_a_ridge_or_a_jump_askew_is_refused(density: str, shape: dict[str, Any]) -> None:
    with pytest.raises(ComputationError, match="changes too much"):
        found({**shape, "density": density})


STEEP = rows_of(__file__, "steep")
"""Densities that are steep or have kinks; scipy's nested quadrature finds their masses below."""


def mass_of_steep(density: str) -> float:
    """The mass by one-dimensional integrals in coordinates of the test's own."""
    quad = integrate.quad
    if density.startswith("2+tanh(z"):
        return 4 * math.pi * 0.25 * 2  # odd about the equator
    if density.startswith("2+tanh(x"):
        return 2 * math.pi * (1 - 0.25)  # odd about x = 0
    if density.startswith("1+sin"):

        def ring(z: float) -> float:
            return math.sin(38.58 * z) ** 2 * (max(1 - z * z, 0) - max(0.16 - z * z, 0))

        waves = 2 * math.pi * quad(ring, 0, 1, points=[0.4], limit=400)[0]
        return 4 * math.pi * (1 - 0.064) / 3 + waves
    if density.startswith("sqrt"):
        return 2 * quad(lambda x: math.sqrt(abs(x - 0.25) * (1 - x * x)), -1, 1, points=[0.25], limit=200)[0]
    if density.startswith("2+tanh((z"):
        slope = quad(lambda z: math.tanh((z - 0.13) / 0.0237) * (1 - 4 * z * z), -0.5, 0.5, points=[0.13])[0]
        return 2 * 4 * math.pi * 0.35 / 3 + math.pi * 0.7 * slope

    # Rays from the corner to the face x + y + z = 1, which is at 1/sqrt(3): the integral of
    # r^2/(1 + r/a)^2 along each is elementary, and those of rays a sum over the face.
    def ray(R: float, a: float = 0.2) -> float:
        return a**3 * (R / a - 2 * math.log(1 + R / a) + (R / a) / (1 + R / a))

    def on_face(u: float, v: float) -> float:
        r = math.sqrt(u * u + v * v + (1 - u - v) ** 2)
        return ray(r) / r**3

    return float(integrate.dblquad(lambda v, u: on_face(u, v), 0, 1, 0, lambda u: 1 - u, epsabs=1e-12)[0])


@pytest.mark.parametrize(("density", "shape"), STEEP, ids=[density for density, _ in STEEP])
def test_steep_densities_are_answered(density: str, shape: dict[str, Any]) -> None:
    result = found({**shape, "density": density})
    error = 5 * result["integration_error"]
    assert result["mass"] == pytest.approx(mass_of_steep(density), rel=max(error, 1e-9))
    assert error <= ROUGH


def test_densities_against_high_precision() -> None:
    """Integrals by mpmath with 30 digits, in coordinates of the test's own."""
    ball = 25.74044586109408  # 4 pi r^2 sqrt(1 + 50 r) from 0 to 1
    lorentz = 0.09744923466679443  # pi (1 - x^2)/(1 + (100 x)^2) from -1 to 1
    wave = 2.554485456587152  # exp(sin(9 z)) from -1 to 1
    spike = 4 * math.pi / 3 + 1e6 * (1e-3 * math.sqrt(math.pi)) ** 3  # a Gaussian in three coordinates
    for shape, density, mass in (
        ({"shape": "sphere", "radius": 1}, "sqrt(1 + 50*r)", ball),
        ({"shape": "sphere", "radius": 1}, "1/(1 + (100*x)^2)", lorentz),
        ({"shape": "rod", "length": 2}, "exp(sin(9*z))", wave),
        ({"shape": "sphere", "radius": 1}, "1 + 1e6*exp(-(x^2 + y^2 + (z - 0.3)^2)/1e-6)", spike),
        ({"shape": "sphere", "radius": 1}, "1 + 1e6*exp(-r^2/1e-6)", spike),
    ):
        assert found({**shape, "density": density})["mass"] == pytest.approx(mass, rel=SMOOTH)


def test_a_density_without_symmetry_against_scipy() -> None:
    def density(x: float, y: float) -> float:
        return math.exp(x * y) / (2 + math.sin(3 * x + y))

    mass, _ = integrate.nquad(density, [(-0.5, 0.5), (-1, 1)], opts={"epsabs": 0, "epsrel": 1e-12})
    moment, _ = integrate.nquad(
        lambda x, y: x * density(x, y), [(-0.5, 0.5), (-1, 1)], opts={"epsabs": 1e-13, "epsrel": 0}
    )
    plate = {"shape": "plate", "size": [1, 2], "density": "exp(x*y)/(2 + sin(3*x + y))"}
    result = found(plate)
    assert result["mass"] == pytest.approx(mass, rel=SMOOTH)
    assert result["center_of_mass"][0] == pytest.approx(moment / mass, rel=1e-11)


def test_an_answer_about_a_body_of_varying_density_is_judged(tmp_path: Path, program: Program) -> None:
    body = "body: {shape: rod, length: 3, density: 2*(1 + (z + 3/2)/3), anchor: end}"
    (tmp_path / "rod.yaml").write_text(body)
    (tmp_path / "key.yaml").write_text(
        "assignment: Rods\nquestions:\n  1: {document: rod.yaml, ask: inertia.mass, points: 1}\n"
    )
    (tmp_path / "ada.yaml").write_text("student: ada\nanswers: {1: 9}\n")
    (tmp_path / "bob.yaml").write_text("student: bob\nanswers: {1: 6}\n")
    right, wrong = (
        program("check", str(tmp_path / "key.yaml"), str(tmp_path / f"{name}.yaml"))
        for name in ("ada", "bob")
    )
    assert (right.code, wrong.code) == (0, 1)


def test_what_cannot_be_integrated_is_refused_in_bounded_time() -> None:
    start = time.process_time()
    with pytest.raises(ComputationError, match="changes too much"):
        found({"shape": "cube", "side": 1, "density": "2 + sign(sin(1e3*x*y*z + 1))"})
    assert time.process_time() - start < 10


def test_no_closed_form_is_refused_and_says_what_can_be_done() -> None:
    with pytest.raises(ComputationError) as refusal:
        found({"shape": "sphere", "radius": 1, "density": "exp(x)"}, exact=True)
    assert "no closed form" in str(refusal.value)
    assert "--exact" in str(refusal.value.hint)


def test_exact_densities_are_looked_at_in_the_same_way() -> None:
    with pytest.raises(DocumentError, match="negative"):
        found({"shape": "cube", "side": 1, "density": "0.1 + x"}, exact=True)


def test_a_parameter_hides_a_variable_and_is_noted(tmp_path: Path) -> None:
    path = tmp_path / "hidden.yaml"
    path.write_text("parameters: {r: 3}\nbody: {shape: cube, side: 1, density: 2*r}")
    document = rigidcli.load(path)
    assert rigidcli.inertia(document)["mass"] == pytest.approx(6)
    assert any("`r` in a density is the parameter" in note for note in document.notes)


def test_mass_and_a_varying_density_exclude_each_other() -> None:
    with pytest.raises(DocumentError, match="exactly one"):
        found({"shape": "rod", "length": 1, "mass": 2, "density": "1 + z"})


def test_the_true_centre_of_mass_is_put_where_com_is_anchored() -> None:
    body = {"shape": "rod", "length": 2, "density": "2 + z", "anchor": "com", "position": [1, 2, 3]}
    assert rigidcli.inertia({"body": body})["center_of_mass"] == pytest.approx([1, 2, 3], abs=1e-12)


def test_a_hole_takes_the_density_that_it_has() -> None:
    ball = {"shape": "sphere", "radius": 2, "density": "5 - r"}
    hole = {"shape": "sphere", "radius": 1, "density": "5 - r", "hole": True}
    shell = {"shape": "hollow_sphere", "outer_radius": 2, "inner_radius": 1, "density": "5 - r"}
    cut, whole = found({"parts": [ball, hole]}), found(shell)
    assert cut["mass"] == pytest.approx(whole["mass"], rel=SMOOTH)
    assert cut["tensor"][1][1] == pytest.approx(whole["tensor"][1][1], rel=SMOOTH)
    with pytest.raises(DocumentError, match="more is taken away than is there"):
        found({"parts": [ball, hole | {"density": "7 - r"}]})


def test_scale_turn_and_a_far_place_change_the_tensor_by_their_laws() -> None:
    body = {"shape": "cone", "radius": 1, "height": 2, "density": "1 + x^2 + z"}
    one = found(body)
    large = found({"shape": "cone", "radius": 10, "height": 20, "density": "1 + (x/10)^2 + z/10"})
    assert large["mass"] == pytest.approx(1e3 * one["mass"], rel=SMOOTH)
    np.testing.assert_allclose(large["tensor"], 1e5 * one["tensor"], rtol=1e-11, atol=1e-7)
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    placed = found({**body, "rotation": {"matrix": turn.tolist()}, "position": [1e6, -2e6, 3e6]})
    np.testing.assert_allclose(placed["tensor"], turn @ one["tensor"] @ turn.T, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize(
    ("shape", "density", "value"),
    [
        ("ring", "1/sqrt(s)", 1 / math.sqrt(2)),
        ("spherical_shell", "abs(r - 3)", 1.0),
        ("disk", "3 + tanh((z + 1)/0.1)", 3 + math.tanh(10)),
    ],
)
def test_what_is_narrow_elsewhere_may_be_constant_on_a_shape(shape: str, density: str, value: float) -> None:
    result = found({"shape": shape, "radius": 2, "density": density})
    constant = found({"shape": shape, "radius": 2, "density": value})
    np.testing.assert_allclose(result["tensor"], constant["tensor"], rtol=SMOOTH, atol=SMOOTH)


def test_a_peak_of_a_moderate_width_is_as_exact_as_what_is_smooth() -> None:
    width, centre, size = 0.3, (0.1, 0.6, 0.29), (1, 2, 1.5)
    away = "+".join(f"({name} - {place})^2" for name, place in zip("xyz", centre, strict=True))
    result = found({"shape": "box", "size": size, "density": f"exp(-({away})/{width}^2)"})
    ends = [
        ((side / 2 - place) / width, (-side / 2 - place) / width)
        for side, place in zip(size, centre, strict=True)
    ]
    mass = math.prod(width * math.sqrt(math.pi) / 2 * (math.erf(high) - math.erf(low)) for high, low in ends)
    assert result["mass"] == pytest.approx(mass, rel=1e-9)
    assert result["integration_error"] <= 1e-9


ASKEW = rows_of(__file__, "askew")
"""Bodies of revolution with kinks and jumps askew to their axis; X and Y turn about it."""


@pytest.mark.parametrize(("body", "density"), ASKEW.values(), ids=ASKEW)
def test_a_density_that_is_turned_about_an_axis_turns_the_tensor(body: dict[str, Any], density: str) -> None:
    angle = 0.7
    c, s = math.cos(angle), math.sin(angle)
    turned = density.replace("X", f"({c}*x+{s}*y)").replace("Y", f"({c}*y-{s}*x)")
    one, other = found({**body, "density": density.lower()}), found({**body, "density": turned})
    errors = [result["integration_error"] for result in (one, other)]
    assert max(errors) <= ROUGH
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    assert one["mass"] == pytest.approx(other["mass"], rel=sum(errors))
    expected = turn @ one["tensor"] @ turn.T
    np.testing.assert_allclose(other["tensor"], expected, rtol=0, atol=sum(errors) * np.trace(expected))
