"""Bodies as people write them: what is read, what is told with its cure, and which settings are refused."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rigidcli
from rigidcli.errors import DocumentError
from tests.conftest import Program
from tests.tables import rows_of

BALL = 4 * math.pi / 3
CUBE = "{shape: cube, side: 1, density: 1000}"
OTHER = "{shape: cube, side: 1, density: 500, position: [1, 0, 0]}"
HOLE = "{shape: sphere, radius: 0.2, hole: true}"


def parts(*bodies: str) -> str:
    return f"body: {{parts: [{', '.join(bodies)}]}}"


def moved(body: str, x: float) -> str:
    return body.replace("}", f", position: [{x}, 0, 0]}}")


ANSWERED: list[tuple[str, str, Any]] = [
    # A polygon that is closed, in whole numbers and decimals: I_zz = M a^2/6 of a square about its centre.
    ("body: {shape: polygon, vertices: [[0, 0], [1, 0], [1, 1], [0, 1], [0.0, 0]], mass: 6}", "mass", 6),
    ("body: {shape: polygon, vertices: [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]], mass: 6}\nabout: com",
     "tensor", np.diag([0.5, 0.5, 1])),
    ("body: {shape: polygon, vertices: [[0, 0], [3, 0], [0, 3], [0, 0]], density: 2}", "mass", 9),
    # Holes with the density of what they are cut from.
    (parts(CUBE, HOLE), "mass", 1000 * (1 - BALL * 0.008)),
    (parts("{shape: cube, side: 2, mass: 8}", HOLE), "mass", 8 - BALL * 0.008),
    (parts(CUBE, OTHER, moved(HOLE, 1)), "mass", 1500 - 500 * BALL * 0.008),
    (parts(CUBE, OTHER.replace("500", "1000"), moved(HOLE, 0.5)), "mass", 2000 - 1000 * BALL * 0.008),
    (parts(moved(CUBE, 5), "{shape: plate, size: [1, 1], density: 3}",
           "{shape: disk, radius: 0.1, hole: true}"), "mass", 1003 - 0.03 * math.pi),
    (parts(f"{{parts: [{CUBE}, {moved(HOLE, 0.25)}]}}", moved(HOLE, -0.25)), "mass",
     1000 * (1 - 2 * BALL * 0.008)),
    # Densities with units of what is hollow, about its axis and per area.
    ("body: {shape: hollow_sphere, outer_radius: 1, inner_radius: 0, density: 1 g/cm^3}", "mass", 1e3 * BALL),
    ("body: {shape: annulus, outer_radius: 3, inner_radius: 1, density: 2 g/m^2}", "mass", 0.016 * math.pi),
    ("body: {shape: tube, outer_radius: 3, inner_radius: 1, height: 2, density: 2*s}", "mass",
     8 * math.pi * 26 / 3),
    # Two spellings.
    ("body: {shape: disc, radius: 2, density: 3}", "mass", 12 * math.pi),
    # A thickness, and the unit of a mesh.
    ("parameters: {t: 6 mm}\nbody: {shape: box, size: [1, 1, t], density: 1000}", "mass", 6),
    ("parameters: {t: 2}\nbody: {shape: cube, side: t, mass: 6}\nmotion: {omega: [0, 0, t]}", "mass", 6),
    ("body: {mesh: corner.obj, density: 6000, scale: mm}", "mass", 1e-6),
    ("parameters: {mm: 2}\nbody: {mesh: corner.obj, density: 6, scale: mm}", "mass", 8),
    # Water about its centre of mass, or the point that is named: the sum of m y^2 + m z^2 by hand.
    ("body: {points: water.xyz}", "about", [0, 0, 5.14179e-12]),
    ("body: {points: water.xyz}\nabout: origin", "about", [0, 0, 0]),
    ("body: {parts: [{points: water.xyz}, {points: water.xyz, position: [3e-10, 0, 0]}]}", "about",
     [1.5e-10, 0, 5.14179e-12]),
]  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a molecule, a mesh of 1/6 cubic units, and two documents; it is the current one."""
    monkeypatch.chdir(tmp_path)
    Path("water.xyz").write_text("3\nwater\nO 0 0 0.117\nH 0 0.757 -0.469\nH 0 -0.757 -0.469\n")
    faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    Path("corner.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n{faces}")
    Path("a.yaml").write_text("parameters: {a: 1}\nbody: {shape: cube, side: a, mass: 6}\n")
    Path("b.yaml").write_text("parameters: {b: 1}\nbody: {shape: cube, side: b, mass: 6}\n")
    return tmp_path


@pytest.mark.parametrize(("text", "field", "value"), ANSWERED)
def test_it_is_read(folder: Path, text: str, field: str, value: Any) -> None:
    found = rigidcli.inertia(text)[field]
    assert np.asarray(found, dtype=float) == pytest.approx(np.asarray(value), rel=2e-6, abs=1e-18)


def test_a_hole_in_symbols_has_the_density_of_all_parts() -> None:
    body = parts("{shape: cube, side: a, density: rho}", "{shape: sphere, radius: a/4, hole: true}")
    found = rigidcli.inertia(f"parameters: {{rho: null, a: null}}\n{body}")
    assert str(found["mass"]) == "(48 - pi)*a**3*rho/48"


TOLD: list[tuple[str, int, str, str, str]] = [
    ("body: {shape: disc, radius: 1, height: 2, mass: 1}", 1, "body.shape", "did you mean cylinder?",
     "a cylinder has `radius`"),
    (parts(CUBE, OTHER, moved(HOLE, 0.5)), 1, "body.parts.2.density", "missing: the hole does not lie in one",
     ""),
    (parts("{shape: cube, side: 1, density: 1 + x}", HOLE), 1, "body.parts.1.density", "missing", ""),
    (parts(CUBE, "{shape: cylinder, radius: 0.2, height: 1.2, hole: true}"), 1, "body.parts.1",
     "the hole reaches outside the body: at (0, 0, -0.6) m", ""),
    ("body: {shape: cylinder, radius: 1, height: 2, density: x}", 1, "body.density",
     "the density is negative (-1 kg/m^3) at x, y, z = (-1, 0, ", ""),
    (parts(HOLE), 1, "body.parts.0.density", "missing", ""),
    ("body: {shape: cube, side: 1, hole: true}", 1, "body.hole", "a hole stands in `parts`", ""),
    ("parameters: {t: 6 mm}\nsystem: {coordinates: [x], lagrangian: xdot^2/t}", 1, "parameters.t",
     "`t` is reserved: it is the time", ""),
    ("parameters: {t: 1}\nmotion: {omega: [0, 0, 1], torque: {body: [0, 0, t]}, duration: 1}", 1,
     "parameters.t", "reserved", ""),
    ("parameters: {sin: 6, b: 2*sin}\nbody: {shape: box, size: [1, b, sin], mass: 1}", 1, "parameters.sin",
     "`sin` is reserved: it is a function", ""),
    ("parameters: {2t: 6}\nbody: {shape: cube, side: 2t, mass: 1}", 1, "parameters.2t", "expected a name",
     ""),
    ("body: {mesh: corner.obj, density: 1, scale: kg}", 1, "body.scale", "is a mass", ""),
    ("body:\n  parts: {a: {shape: cube, side: 1, mass: 1}, b: {shape: cube, side: 1, mass: 1}}", 2,
     "body.parts", "read a mapping, expected a list", "write `parts: [{...}, {...}]`"),
    ("body: {points: [[1, 0, 0]]}", 1, "body.points", "read points of 3 numbers, expected [m, x, y, z]",
     "the mass comes first"),
    ("body: {points: [[1, 0, 0], [0, 1, 0]]}", 1, "body.points", "read points of 3 numbers", ""),
    ("body: {shape: cube, side: 1, mass: 1}\naxis: [0,707, 0.707, 0]", 2, "axis", "read a list of 4",
     "`[0.707, 0.707, 0]`"),
    ("body: {shape: box, size: [0,5, 0,5, 1], mass: 1}", 1, "body.size", "read a list of 5",
     "`[0.5, 0.5, 1]`"),
    ("body:\n  parts:\n    - shape: cube, side: 1", 3, "", "a second colon in one line",
     "in braces: `{shape: cube, side: 1}`"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "line", "key", "message", "hint"), TOLD)
def test_it_is_told_once_with_its_cure(
    folder: Path, text: str, line: int, key: str, message: str, hint: str
) -> None:
    with pytest.raises(DocumentError) as caught:
        rigidcli.loads(text)
    (problem,) = caught.value.problems
    assert (problem.line, problem.key) == (line, key)
    assert message in problem.message
    assert hint in (problem.hint or "")


DENSITIES = [
    ("rho*x^2/a^2", "prolate"),
    ("rho*(1 + x^2/a^2)", "prolate"),
    ("rho*(1 + x/a)", "spherical"),
]


@pytest.mark.parametrize(("density", "kind"), DENSITIES)
def test_a_symbol_is_positive_where_the_rest_of_a_density_is(density: str, kind: str) -> None:
    text = f"parameters: {{rho: null, a: null}}\nbody: {{shape: cube, side: a, density: {density}}}"
    assert rigidcli.axes(text)["class"] == kind


SETTINGS = rows_of(__file__, "settings")


@pytest.mark.parametrize(("arguments", "message"), SETTINGS)
def test_settings_that_no_file_uses_are_refused(
    program: Program, folder: Path, arguments: list[str], message: str
) -> None:
    paths = [str(folder / each) if (folder / each).is_file() else each for each in arguments]
    result = program("inertia", "-f", "json", *paths)
    assert result.code == (2 if message else 0)
    assert message in result.err
    assert bool(result.out) == (not message)
    if "parameters.b=2" in arguments:
        assert "a.yaml: note: parameter `b` is not used" in result.err
        assert [json.loads(line)["tensor"][0][0] for line in result.out.splitlines()] == [1, 4]


MATRICES = [
    ("[1, 1, 1]", ["0.166667         0         0", "0  0.166667         0"]),
    ("[0.02, 0.02, 0.01]", ["[4.16667        0        0]", "1e-05 [      0  4.16667        0]"]),
    ("[1000, 1000, 1000]", ["166667       0       0", "0  166667       0"]),
    ("[9000, 3000, 3000]", ["[1.5    0    0]", "1e+06 [  0  7.5    0]"]),
]


@pytest.mark.parametrize(("size", "shown"), MATRICES)
def test_a_matrix_has_one_power_of_ten(program: Program, folder: Path, size: str, shown: list[str]) -> None:
    path = folder / "m.yaml"
    path.write_text(f"body: {{shape: box, size: {size}, mass: 1}}\n")
    lines = program("inertia", str(path)).out.splitlines()
    assert [line.rpartition("kg m^2")[2].strip() for line in lines[4:6]] == shown
