"""Bodies whose surface is a mesh in a file: what is read, what comes out of it, and what is refused where."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rigidcli
from rigidcli import RigidError
from tests.conftest import Program
from tests.meshes import Triangles, box, indexed, inside_out, prism, revolved, saved, text
from tests.tables import rows_of

BOX = box((0, 0, 0), (1, 2, 3))
VERTICES, FACES = indexed(BOX)
POINTS = "".join(f"{x} {y} {z}\n" for x, y, z in VERTICES)
FILES = {
    "box.obj": "mtllib no.mtl\nusemtl red\n"
    + re.sub("(?m)^(?=.)", "v ", POINTS)
    + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES),
    "box.off": f"OFF\n8 12 0\n{POINTS}" + "".join(f"3 {a} {b} {c}\n" for a, b, c in FACES),
    "text.stl": text(BOX),
}
"""The box in formats of text."""

CUBE = box((0, 0, 0), (1, 1, 1))
INNER = box((0.25, 0.25, 0.25), (0.5, 0.5, 0.5))
CROSSED = np.where((BOX == 0).all(axis=2, keepdims=True), [0.5, 1, 3.5], BOX)  # a corner beyond the face
APART = box((2, 0, 0), (2.5, 0.5, 0.5))


def body(path: Path, rest: str = "density: 1000", **more: Any) -> Any:
    return rigidcli.inertia(f"body: {{mesh: '{path}', {rest}}}", **more)


def refusal(path: Path, rest: str = "density: 1000") -> str:
    """The message after the name of the file, and the hint."""
    with pytest.raises(RigidError) as caught:
        body(path, rest)
    return str(caught.value).split(f"{path.name}")[-1].replace("\n  hint:", ";")


# --- what comes out


@pytest.mark.parametrize("rest", ["density: 1000", "mass: 6000"])
def test_a_box_is_what_the_shape_is(rest: str, tmp_path: Path) -> None:
    found = body(saved(tmp_path / "a.stl", BOX), rest)
    shape = rigidcli.inertia("body: {shape: box, size: [1, 2, 3], anchor: corner, mass: 6000}")
    for key in ("mass", "center_of_mass", "tensor", "tensor_com"):
        np.testing.assert_allclose(found[key], shape[key], rtol=1e-15, atol=1e-12, err_msg=key)


def test_the_report_tells_what_the_mesh_is(program: Program, tmp_path: Path) -> None:
    path = saved(tmp_path / "a.stl", np.concatenate([BOX, APART]))
    document = f"body: {{mesh: '{path}', density: 1, scale: 10 mm}}"
    found = json.loads(program("axes", "-", "-f", "json", stdin=document).out)
    mesh = found["mesh"]
    np.testing.assert_allclose(mesh["volume"], 6.125e-6, rtol=1e-14)
    np.testing.assert_allclose(mesh["area"], 23.5e-4, rtol=1e-14)
    np.testing.assert_allclose(mesh["bounding_box"], np.array([[0, 0, 0], [0.025, 0.02, 0.03]]), rtol=1e-14)
    assert found["units"]["mesh.volume"] == "m^3"
    table = program("inertia", "-", stdin=document).out
    assert "6.125e-06" in table


@pytest.mark.parametrize(
    ("triangles", "mass", "first"),
    [
        (np.concatenate([BOX, APART]), 6.125, [3 + 0.125 * 2.25, 6 + 0.125 * 0.25, 9 + 0.125 * 0.25]),
        (
            np.concatenate([BOX, inside_out(INNER)]),
            6 - 1 / 64,
            [3 - 0.375 / 64, 6 - 0.375 / 64, 9 - 0.375 / 64],
        ),
    ],
)
def test_parts_add_up_and_cavities_are_taken_away(
    triangles: Triangles, mass: float, first: list[float], tmp_path: Path
) -> None:
    found = body(saved(tmp_path / "a.stl", triangles), "density: 1")
    assert found["mass"] == pytest.approx(mass, rel=1e-15)
    np.testing.assert_allclose(found["center_of_mass"], np.array(first) / mass, rtol=1e-14)


def _arc(radius: float, start: float, end: float, count: int, r: float = 0.0, z: float = 0.0) -> list[Any]:
    angles = np.linspace(start, end, count + 1)
    points = np.column_stack([r + radius * np.sin(angles), z + radius * np.cos(angles)])
    points[np.abs(points) < 1e-12] = 0.0
    return list(points)


def _half_disk(n: int) -> Triangles:
    angle = np.linspace(0, np.pi, n + 1)
    return 2 * np.column_stack([np.cos(angle), np.sin(angle)])


FULL = np.pi
ROUND: dict[str, Callable[[int], list[Any]]] = {
    "sphere, radius: 2": lambda n: _arc(2, 0, FULL, n),
    "ellipsoid, semi_axes: [1, 2, 0.3]": lambda n: _arc(1, 0, FULL, n),
    "cylinder, radius: 2, height: 3": lambda n: [(0, 1.5), (2, 1.5), (2, -1.5), (0, -1.5)],
    "tube, outer_radius: 2, inner_radius: 1, height: 3": lambda n: [(1, 1.5), (2, 1.5), (2, -1.5), (1, -1.5)],
    "elliptic_cylinder, semi_axes: [1, 2], height: 1": lambda n: [(0, 0.5), (1, 0.5), (1, -0.5), (0, -0.5)],
    "cone, radius: 1, height: 3": lambda n: [(0, 3), (1, 3), (0, 0)],
    "frustum, bottom_radius: 2, top_radius: 1, height: 3": lambda n: [(0, 3), (1, 3), (2, 0), (0, 0)],
    "hemisphere, radius: 2": lambda n: [*_arc(2, 0, FULL / 2, n), (0, 0)],
    "spherical_cap, radius: 2, cap_height: 0.5": lambda n: [*_arc(2, 0, np.arccos(0.75), n), (0, 1.5)],
    "capsule, radius: 1, height: 2": lambda n: [
        *_arc(1, 0, FULL / 2, n, z=1),
        *_arc(1, FULL / 2, FULL, n, z=-1),
    ],
    "torus, major_radius: 3, minor_radius: 1": lambda n: _arc(1, 0, 2 * FULL, n, r=3)[:-1],
}
"""Profiles of shapes that are round about z."""

STRETCHED = {"ellipsoid": [1, 2, 0.3], "elliptic_cylinder": [1, 2, 1]}


@pytest.mark.parametrize("name", ROUND)
def test_finer_and_finer_meshes_of_a_round_shape_tend_to_it(name: str, tmp_path: Path) -> None:
    """The error of flat faces falls as the square of their size, so that two meshes tell the limit."""
    profile, factors = ROUND[name], STRETCHED.get(name.partition(",")[0], [1, 1, 1])
    found = []
    for n in (24, 48):
        triangles = revolved(np.array(profile(n), dtype=float), n) * np.array(factors)
        (tmp_path / "a.stl").write_text(text(triangles))
        result = body(tmp_path / "a.stl", "density: 1")
        found.append(np.array([result["mass"], *result["center_of_mass"], *result["tensor_com"].flat]))
    shape = rigidcli.inertia(f"body: {{shape: {name}, density: 1}}")
    exact = np.array([shape["mass"], *shape["center_of_mass"], *shape["tensor_com"].flat])
    np.testing.assert_allclose((4 * found[1] - found[0]) / 3, exact, atol=2e-4 * np.abs(exact).max())
    assert np.abs(found[1] - exact).max() < 0.3 * np.abs(found[0] - exact).max()


def test_a_half_cylinder_is_a_prism_over_a_half_disk(tmp_path: Path) -> None:
    found = [body(saved(tmp_path / "a.stl", prism(_half_disk(n), -1, 1)), "density: 1") for n in (64, 128)]
    shape = rigidcli.inertia("body: {shape: half_cylinder, radius: 2, height: 2, density: 1}")
    for key in ("mass", "center_of_mass", "tensor"):
        np.testing.assert_allclose((4 * found[1][key] - found[0][key]) / 3, shape[key], atol=1e-4)


@pytest.mark.parametrize(
    ("shape", "triangles"),
    [
        (
            "pyramid, base: [2, 4], height: 3",
            np.array(
                [
                    [[-1, -2, 0], [1, -2, 0], [0, 0, 3]],
                    [[1, -2, 0], [1, 2, 0], [0, 0, 3]],
                    [[1, 2, 0], [-1, 2, 0], [0, 0, 3]],
                    [[-1, 2, 0], [-1, -2, 0], [0, 0, 3]],
                    [[-1, -2, 0], [-1, 2, 0], [1, 2, 0]],
                    [[-1, -2, 0], [1, 2, 0], [1, -2, 0]],
                ]
            ),
        ),
        (
            "tetrahedron, vertices: [[1, 2, 3], [4, -1, 2], [-2, 0.5, 1], [0, 3, -2]]",
            np.array([[1, 2, 3], [4, -1, 2], [-2, 0.5, 1], [0, 3, -2]])[
                [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
            ],
        ),
        ("cube, side: 0.5", box((-0.25, -0.25, -0.25), (0.25, 0.25, 0.25))),
    ],
)
def test_polyhedra_come_out_to_the_last_digits(shape: str, triangles: Triangles, tmp_path: Path) -> None:
    found = body(saved(tmp_path / "a.stl", triangles), "density: 1")
    exact = rigidcli.inertia(f"body: {{shape: {shape}, density: 1}}")
    for key in ("mass", "center_of_mass", "tensor", "tensor_com"):
        size = np.abs(exact[key]).max() or 1
        np.testing.assert_allclose(found[key], exact[key], rtol=2e-15, atol=4e-15 * size, err_msg=key)


@pytest.mark.parametrize("inertia", ["mass: 1", "density: 1"])
def test_agrees_with_mujoco_and_trimesh(inertia: str, tmp_path: Path) -> None:
    mujoco, trimesh = pytest.importorskip("mujoco"), pytest.importorskip("trimesh")
    outline = np.array([[5, 5], [5, 40], [0, 40], [0, 0], [60, 0], [60, 5]]) / 100
    path = saved(tmp_path / "a.stl", prism(outline, 0, 0.3))
    found = rigidcli.axes(f"body: {{mesh: '{path}', {inertia}}}\nabout: com")
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><asset><mesh name="a" file="{path}" inertia="exact"/></asset>'
        f'<worldbody><body><freejoint/><geom type="mesh" mesh="a" {inertia.replace(": ", "=")}"/></body>'
        "</worldbody></mujoco>".replace("=1", '="1')
    )
    np.testing.assert_allclose(model.body_mass[1], found["mass"], rtol=1e-6)
    np.testing.assert_allclose(sorted(model.body_inertia[1]), found["moments"], rtol=1e-6)
    peer = trimesh.load(path)
    peer.density = found["mass"] / peer.volume
    np.testing.assert_allclose(peer.moment_inertia, found["tensor"], rtol=1e-9, atol=1e-12)


def test_placed_turned_and_scaled_as_any_form(tmp_path: Path) -> None:
    path = saved(tmp_path / "a.stl", BOX)
    place = "position: [3, 1, -2], rotation: {axis: [1, 1, 0], angle: 40 deg}"
    one = body(path, f"scale: 0.5, density: 8, {place}")
    two = rigidcli.inertia(f"body: {{shape: box, size: [0.5, 1, 1.5], anchor: corner, density: 8, {place}}}")
    np.testing.assert_allclose(one["tensor"], two["tensor"], rtol=1e-13, atol=1e-13)
    about_com = body(path, "density: 1, anchor: com, position: [7, 0, 0]")
    np.testing.assert_array_equal(about_com["center_of_mass"], [7, 0, 0])


# --- files


def test_text_and_binary_files_are_the_same(tmp_path: Path) -> None:
    one = body(saved(tmp_path / "a.stl", BOX, b"solid but binary"))
    (tmp_path / "b.stl").write_text(text(BOX).upper().replace("\n", "\r\n"))
    (tmp_path / "c.STL").write_text(text(BOX[:6]) + "\n" + text(BOX[6:]))
    for name in ("b.stl", "c.STL"):
        np.testing.assert_array_equal(body(tmp_path / name)["tensor"], one["tensor"])


@pytest.mark.parametrize("name", ["box.obj", "box.off"])
def test_other_formats_are_read(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(FILES[name])
    np.testing.assert_allclose(
        body(tmp_path / name)["tensor"], body(saved(tmp_path / "a.stl", BOX))["tensor"], rtol=1e-15
    )


def test_a_file_is_read_again_when_it_has_changed(tmp_path: Path) -> None:
    path = saved(tmp_path / "a.stl", BOX)
    assert body(path)["mass"] == 6000
    saved(path, np.concatenate([BOX, APART]))
    assert body(path)["mass"] == pytest.approx(6125, rel=1e-15)
    saved(path, 2 * np.concatenate([BOX, APART]))
    os.utime(path, ns=(1, 1))
    assert body(path)["mass"] == pytest.approx(8 * 6125, rel=1e-15)


# --- what is refused


@pytest.mark.parametrize(
    ("triangles", "reason"),
    [
        (BOX[1:], ": open: 3 edges belong to one triangle only, such as that from ("),
        (BOX[:0], ": no triangles"),
        (
            np.concatenate([BOX[:1, ::-1], BOX[1:]]),
            ": wound inconsistently: 3 edges belong to",
        ),
        (np.concatenate([BOX, BOX[:1]]), ": not the surface of a body: 3 triangles meet in an edge, such as"),
        (np.concatenate([BOX, inside_out(APART)]), ": a part is wound the other way, and is no cavity"),
        (
            np.concatenate([BOX, inside_out(INNER + np.array([0.6, 0, 0]))]),
            ": a part is wound the other way, and is no",
        ),
        (BOX * [1, 1, 0], ": flat: it encloses 0 cubic units, and has an area of 4 square units"),
        (BOX * 0, ": the triangles have no area"),
        (np.where(BOX == 3, np.nan, BOX), ": triangle "),
    ],
)
def test_what_encloses_no_body_is_refused(triangles: Triangles, reason: str, tmp_path: Path) -> None:
    message = refusal(saved(tmp_path / "a.stl", triangles))
    assert message.startswith(reason)


@pytest.mark.parametrize(
    ("triangles", "mass", "note"),
    [
        (np.concatenate([BOX, BOX]), 12, "parts overlap: ("),
        (np.concatenate([BOX, INNER]), 6 + 1 / 64, ") is inside 2 times, and counts as often"),
        (
            np.concatenate([BOX, INNER + np.array([0.749, 0, 0])]),
            6 + 1 / 64,
            ") is inside 2 times, and counts as often",
        ),
        (np.concatenate([BOX, BOX + 0.5]), 12, ") is inside 2 times, and counts as often"),
        (np.concatenate([CUBE, CUBE + 0.5]), 2, ") is inside 2 times"),
        (np.concatenate([CUBE, CUBE + 0.9]), 2, ") is inside 2 times"),
        (np.concatenate([CUBE, box((0.4, 0.4, -3), (0.6, 0.6, 2))]), 1.2, ") is inside 2 times"),
        (np.concatenate([10 * CUBE, box((5, 5, 5), (5.01, 5.01, 12))]), 1000, ") is inside 2 times"),
        (CROSSED, np.linalg.det(CROSSED).sum() / 6, "the surface crosses itself: ("),
        (BOX + 1e-6 * np.random.default_rng(1).uniform(-1, 1, BOX.shape), 6, "vertices were nearer than 3.7"),
        (np.concatenate([BOX[:1] + 1e-6, BOX[1:]]), 6, "3 vertices were nearer than 3.7"),
    ],
)
def test_meshes_as_they_come_are_computed_with_a_note(
    triangles: Triangles, mass: float, note: str, program: Program, tmp_path: Path
) -> None:
    path = saved(tmp_path / "a.stl", triangles)
    outcome = program("inertia", "-", "-f", "json", stdin=f"body: {{mesh: '{path}', density: 1}}")
    assert json.loads(outcome.out)["mass"] == pytest.approx(mass, rel=1e-5)
    assert note in outcome.err


@pytest.mark.parametrize("shift", [(1, 0, 0), (1, 0.5, 0.3), (1, 1, 1), (0.5, 1, 0), (3, 0, 0)])
def test_cubes_that_touch_or_are_apart_do_not_overlap(
    shift: tuple[float, float, float], program: Program, tmp_path: Path
) -> None:
    path = saved(tmp_path / "a.stl", np.concatenate([CUBE, CUBE + np.array(shift)]) * 0.1)
    outcome = program("inertia", "-", stdin=f"body: {{mesh: '{path}', scale: 1, density: 1}}")
    assert (outcome.code, "note" in outcome.err) == (0, False)


@pytest.mark.parametrize("gap", [1e-5, 3e-5, 1e-3])
def test_vertices_farther_apart_than_a_millionth_of_the_size_are_two(gap: float, tmp_path: Path) -> None:
    moved = BOX.copy()
    moved[3, 0] += gap
    assert refusal(saved(tmp_path / "a.stl", moved)).startswith(": open: ")


def test_validate_judges_the_surface_of_a_mesh(program: Program, tmp_path: Path) -> None:
    closed, opened = saved(tmp_path / "closed.stl", BOX), saved(tmp_path / "open.stl", BOX[1:])
    told = program("validate", str(closed), str(opened), "--set", "body.scale=0.001")
    assert (told.code, told.out) == (3, f"{closed}: valid\n")
    assert "open.stl: open: 3 edges belong to one triangle only" in told.err


def test_an_inside_out_mesh_is_turned_with_a_note(program: Program, tmp_path: Path) -> None:
    path = saved(tmp_path / "a.stl", inside_out(BOX))
    outcome = program("inertia", "-", "-f", "json", stdin=f"body: {{mesh: '{path}', density: 1000}}")
    assert json.loads(outcome.out)["mass"] == 6000
    assert "note: " in outcome.err
    assert "wound inside out, and was turned" in outcome.err


def test_a_mesh_of_a_hundred_metres_is_probably_in_millimetres(program: Program, tmp_path: Path) -> None:
    path = saved(tmp_path / "a.stl", 50 * BOX)
    for scale, noted in (("", True), (", scale: 1", False), (", scale: 1 mm", False)):
        outcome = program("inertia", "-", stdin=f"body: {{mesh: '{path}', density: 1000{scale}}}")
        assert ("are its coordinates millimetres?" in outcome.err) is noted


@pytest.mark.parametrize(
    ("rest", "message"),
    rows_of(__file__, "keys that do not fit are told"),
)
def test_keys_that_do_not_fit_are_told(rest: str, message: str, program: Program, tmp_path: Path) -> None:
    path = saved(tmp_path / "a.stl", BOX)
    outcome = program("inertia", "-", stdin=f"body: {{mesh: '{path}', {rest}}}")
    assert (outcome.code, outcome.out) == (3, "")
    assert message in outcome.err


def test_a_file_by_itself_is_named_once_and_has_a_name(program: Program, tmp_path: Path) -> None:
    path = saved(tmp_path / "a.stl", 100 * BOX)
    outcome = program("axes", str(path), "-s", "body.density=1")
    assert outcome.code == 0
    assert outcome.err.startswith(f"{path}: note: the mesh is 300 m long; are its coordinates millimetres?")
    outcome = program("axes", "-", "-s", "body.density=1", stdin="solid a\nendsolid a\n")
    assert outcome.code == 3


def test_no_exact_results_and_no_such_file(program: Program, tmp_path: Path) -> None:
    path = saved(tmp_path / "a.stl", BOX)
    hole = "{shape: cube, side: 0.1, hole: true}"
    for body in (f"{{mesh: '{path}', density: 1}}", f"{{parts: [{{mesh: '{path}', mass: 1}}, {hole}]}}"):
        outcome = program("inertia", "--exact", "-", stdin=f"body: {body}")
        assert (outcome.code, outcome.out) == (4, "")
        assert "a mesh has no exact results" in outcome.err
    assert refusal(tmp_path / "b.stl") == ": no such file"
    assert "ends in one of `.stl`, `.obj`, `.off`, `.ply`" in refusal(tmp_path / "b.step")
    os.mkfifo(tmp_path / "pipe.stl")
    assert refusal(tmp_path / "pipe.stl") == ": not a regular file"


# --- holes and composites


@pytest.mark.parametrize(
    ("hole", "fits"),
    rows_of(__file__, "holes are where something is"),
)
@pytest.mark.parametrize(
    "whole", ["{mesh: MESH, density: 1}", "{shape: box, size: [1, 2, 3], anchor: corner, density: 1}"]
)
def test_holes_are_where_something_is(whole: str, hole: str, fits: bool, tmp_path: Path) -> None:
    path = saved(tmp_path / "a.stl", BOX)
    document = f"body: {{parts: [{whole}, {hole}]}}".replace("MESH", f"'{path}'")
    if not fits:
        with pytest.raises(RigidError, match=r"parts\.1"):
            rigidcli.inertia(document)
        return
    same = document.replace(f"mesh: '{path}', scale: 0.5", "shape: box, size: [0.5, 1, 1.5], anchor: corner")
    same = same.replace(f"mesh: '{path}'", "shape: box, size: [1, 2, 3], anchor: corner")
    np.testing.assert_allclose(
        rigidcli.inertia(document)["tensor"], rigidcli.inertia(same)["tensor"], atol=1e-13
    )


# --- hostile files


@settings(max_examples=200, deadline=5000)
@given(data=st.data())
def test_a_damaged_file_is_read_or_refused(data: st.DataObject, tmp_path_factory: Any) -> None:
    """Bytes changed, cut out, doubled: an answer with finite numbers, or a refusal that names the file."""
    name = data.draw(st.sampled_from(["binary.stl", *FILES]))
    path = saved(tmp_path_factory.getbasetemp() / name, BOX)
    content = bytearray(FILES[name].encode() if name in FILES else path.read_bytes())
    for _ in range(data.draw(st.integers(0, 4))):
        start = data.draw(st.integers(0, len(content)))
        end = min(len(content), start + data.draw(st.integers(0, 60)))
        content[start:end] = data.draw(st.binary(max_size=60))
    path.write_bytes(content)
    try:
        found = body(path)
    except RigidError as error:
        assert name in str(error)  # noqa: PT017 - both ends are right
    else:
        assert np.isfinite(found["tensor"]).all()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"solid", "no triangles"),
        (b"x" * 50, "50 bytes, which is shorter than the header of an STL file"),
        (b"x" * 80 + b"\xff\xff\xff\xff" + b"y" * 100, "for 4,294,967,295 triangles"),
        (b"solid a\n" + b" " * 3_000_000, "no triangles"),
        (b"solid a\nfacet normal 0 0 0\nouter loop\nvertex " + b"9" * 3_000_000, ":4: read `vertex 999"),
        (b"solid a\nfacet normal 0 0 0 outer loop vertex 1_0 0 0 endfacet", ":2: read `facet normal 0 0 0 o"),
        (text(BOX).replace("3.0", "nan", 1).encode(), ":11: read `vertex 0.0 0.0 nan`, expected a line of a"),
        (
            text(BOX).replace("vertex 1.0 2.0 3.0", "vertex 1.0 2,0 3.0", 1).encode(),
            "read `vertex 1.0 2,0 3.0`",
        ),
        (text(BOX).replace("  vertex 1.0 2.0 3.0\n", "", 1).encode(), ": a facet has not three vertices"),
        (text(BOX).replace("3.0", "1e999").encode(), "has a coordinate that is no finite number"),
        (text(BOX).replace("3.0", "1e90").encode(), "a coordinate of 1e+90, expected at most 1e+50"),
        (text(BOX)[:-200].encode(), ":74: read `vertex"),
    ],
)
def test_hostile_headers_and_texts(content: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_bytes(content)
    assert message in refusal(tmp_path / "a.stl")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 99999999999\n", "has the vertex 99,999,999,999"),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n", ":6: read 2 vertices of a face, expected 3"),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 x\n0 1 0\n3 0 1 2\n", ":4: read `x`, expected a number"),
        (
            "a.off",
            "OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n",
            ":4: read 2 numbers, expected the 3 of a vertex",
        ),
        ("a.off", "OFF\n99999999999 1 0\n0 0 0\n", "expected 99,999,999,999 of vertices"),
        ("a.off", "OFF", "the numbers of vertices and faces are missing"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 77777777\n", ":4: a face has the vertex 77,777,777, "),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", ":4: a face has the vertex -4, expected 1 to 3"),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", ":6: a face has the vertex 3, expected 0 to"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0.5\n", "read 0.5, expected the number of a vertex"),
        ("a.obj", "v 0 0 0\nv 1-2 0 0\n", ":2: read `1-2`, expected a number"),
        ("a.obj", "v 0 0 0\n" * 3 + "f 1 2\n", "face 0 (counted from 0) has 2 vertices"),
        ("a.obj", "v 0 0 0\n" * 3 + "f " + "1 " * 100_000, "the triangles have no area"),
        ("a.obj", "nothing", "no triangles"),
        ("a.obj", "\n" * 2_000_000, "no triangles"),
        ("a.obj", "v 0 0 0\n" * 3 + "f" + " 1" * 600_000, "the triangles have no area"),
        ("a.off", "OFF\n1 1 0\n" + "0 " * 4_100_000 + "\n3 0 0 0\n", "the triangles have no area"),
    ],
)
def test_hostile_files_of_other_formats(name: str, content: str, message: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(content, encoding="latin-1")
    assert message in refusal(tmp_path / name)


def test_faces_with_many_vertices_other_keys_and_all_orders_of_bytes(tmp_path: Path) -> None:
    """A box of quadrangles, in OBJ some cut in two: relative indices, and PLY with colours on both sides."""
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [quads[0], [4, 6, 7], [4, 7, 5], *quads[2:4], [0, 2, 6], [0, 6, 4], quads[5]]
    lines = "".join(f"v {x} {y} {z} 0.5 0.5 0.5 # a colour\n" for x, y, z in VERTICES)
    corners = [" ".join(f"{k - 8}/1/1" for k in face) for face in faces]
    (tmp_path / "a.obj").write_text(f"g a\n{lines}vt 0 0\nvn 0 0 1\n" + "".join(f"f {c}\n" for c in corners))
    header = (
        "element vertex 8\nproperty uchar red\nproperty double x\nproperty float y\nproperty double z\n"
        "element part 1\nproperty short a\nelement face 6\nproperty uchar red\n"
        "property list {} uint vertex_indices\nproperty uchar green\nend_header\n"
    )
    for name, order, code, length in (("b", "<", "little", "uchar"), ("c", ">", "big", "ushort")):
        vertex = np.array(
            [(7, *point) for point in VERTICES],
            [("r", "u1"), ("x", order + "f8"), ("y", order + "f4"), ("z", order + "f8")],
        )
        data = vertex.tobytes() + b"ab"
        for face in quads:
            size = np.array([len(face)], order + ("u1" if length == "uchar" else "u2")).tobytes()
            data += b"r" + size + np.array(face, order + "u4").tobytes() + b"g"
        start = (
            f"ply\nformat binary_{code}_endian 1.0\ncomment TextureFile /etc/passwd\n{header.format(length)}"
        )
        (tmp_path / f"{name}.ply").write_bytes(start.encode() + data)
    for name in ("a.obj", "b.ply", "c.ply"):
        np.testing.assert_allclose(body(tmp_path / name)["mass"], 6000, rtol=1e-15, err_msg=name)


def test_the_density_of_a_mesh_does_not_vary(tmp_path: Path) -> None:
    said = refusal(saved(tmp_path / "a.stl", box((0, 0, 0), (1, 1, 1))), "density: 1 + x")
    assert "body.density: the density of a mesh is a number" in said
