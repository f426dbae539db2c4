"""Pictures of results: what is drawn in them, and the files that they are written to."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import rigidcli
from rigidcli.bodies.shapes import SHAPES, Region, Shape, Solid
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.document.load import loads
from rigidcli.picture import Mark, Panel
from tests.conftest import ROOT, Program
from tests.shapes import DIMENSIONS
from tests.tables import rows_of

MODES = """
system:
  coordinates: [x1, x2]
  kinetic: m*(x1dot**2 + x2dot**2)/2
  potential: k*(x1**2 + (x2 - x1)**2 + x2**2)/2
parameters: {m: 1, k: 4}
equilibrium: {x1: 0, x2: 0}
"""


def drawn(command: str, config: str, kind: str = "best") -> tuple[rigidcli.Result, Panel]:
    """The result of a command for an example, and the first panel of its picture."""
    result = getattr(rigidcli, command)(ROOT / "configs" / f"{config}.yaml", picture=kind)
    return result, result.pictures[0].panels[0]


def labelled(panel: Panel, label: str) -> Mark:
    return next(mark for mark in panel.marks if mark.label == label)


# --- What is drawn


def test_nothing_is_drawn_unless_it_is_asked_for() -> None:
    assert rigidcli.axes(ROOT / "configs/cube_corner.yaml").pictures == ()


@pytest.mark.parametrize(
    "shape",
    ["{shape: disk, radius: 1, mass: 1}", "{shape: half_disk, radius: 1, mass: 1, axis: [1, 1, 0]}"],
)
def test_flat_bodies_whose_faces_meet_in_the_middle_are_drawn(shape: str, tmp_path: Path) -> None:
    rigidcli.axes(f"body: {shape}").save_picture(tmp_path / "body.png")
    assert (tmp_path / "body.png").stat().st_size > 10_000


@pytest.mark.parametrize("path", ["-", "body", "body.gif"])
def test_a_picture_is_saved_to_files_of_pictures_only(path: str) -> None:
    with pytest.raises(rigidcli.RigidError, match="is no picture: expected a file"):
        rigidcli.axes("body: {shape: disk, radius: 1, mass: 1}").save_picture(path)


def test_omega_in_time_is_that_of_the_samples_and_a_fast_spin_has_a_panel_of_its_own() -> None:
    result, panel = drawn("euler", "t_handle")
    for place, mark in enumerate(panel.marks):
        assert np.array_equal(mark.points[:, 0], result["trajectory"]["t"])
        assert np.array_equal(mark.points[:, 1], result["trajectory"]["omega"][:, place])
    assert [ruler.unit for ruler in panel.rulers] == ["s", "rad/s"]
    panels = drawn("euler", "top_looping")[0].pictures[0].panels
    assert [[mark.label for mark in each.marks] for each in panels] == [["ω₁", "ω₂"], ["ω₃"]]


def test_a_polhode_keeps_energy_and_momentum_and_the_separatrix_has_its_own_momentum() -> None:
    result, panel = drawn("euler", "t_handle", "polhode")
    moments, twice = result["moments"], 2 * result["kinetic_energy"]
    path, limit = labelled(panel, "polhode").points, labelled(panel, "separatrix").points
    for curve in (path, limit):
        assert curve**2 @ moments == pytest.approx(np.full(len(curve), twice), rel=1e-9)
    assert path**2 @ moments**2 == pytest.approx(
        np.full(len(path), result["angular_momentum"] ** 2), rel=1e-9
    )
    assert limit**2 @ moments**2 == pytest.approx(np.full(len(limit), twice * moments[1]), rel=1e-9)


def test_the_trace_is_the_symmetry_axis_in_space() -> None:
    result, panel = drawn("euler", "top_cuspidal", "trace")
    axis = labelled(panel, "the axis of the top").points
    assert np.linalg.norm(axis, axis=1) == pytest.approx(np.ones(len(axis)))
    theta = result["trajectory"]["angles"][:, 1]
    assert axis[:, 2] == pytest.approx(np.cos(theta), abs=1e-12)


@pytest.mark.parametrize("config", ["top_looping", "cone_top"])
def test_the_trace_of_a_top_turns_at_the_limits_of_its_nutation(config: str) -> None:
    result, panel = drawn("precess", config)
    theta = np.arccos(labelled(panel, "the axis of the top").points[:, 2])
    ends = [result["top"]["theta_min"], result["top"]["theta_max"]]
    assert [theta.min(), theta.max()] == pytest.approx(ends, abs=1e-3)


def test_a_phase_portrait_has_the_orbit_and_its_energy_among_the_contours() -> None:
    result, panel = drawn("hamilton", "relativistic_oscillator")
    orbit = result["orbit"]
    path = labelled(panel, "orbit").points.tolist()
    samples = zip(orbit["q"]["x"], orbit["p"]["p_x"], strict=True)
    assert {*samples} <= {*map(tuple, path)}, "more states are drawn where a straight line would be seen"
    contours = labelled(panel, "H of the orbit")
    assert contours.levels == (orbit["H"][0],)
    x, y, heights = contours.points
    values = rigidcli.load(ROOT / "configs/relativistic_oscillator.yaml").values
    at_corner = result["hamiltonian"].evaluate(**{**values, "x": x[3], "p_x": y[7]})
    assert heights[7, 3] == pytest.approx(at_corner)


def test_a_body_is_drawn_about_o_with_its_principal_axes_and_ellipsoid() -> None:
    result, panel = drawn("axes", "cube_corner")
    arrows = [mark.points for mark in panel.marks if mark.form == "arrow"]
    for (start, end), axis in zip(arrows, result["axes"], strict=True):
        assert start == pytest.approx(np.zeros(3))
        assert end / np.linalg.norm(end) == pytest.approx(axis)
    corners = np.vstack(labelled(panel, "the body").points)
    assert (corners.min(axis=0), corners.max(axis=0)) == (
        pytest.approx(np.zeros(3)),
        pytest.approx(np.ones(3)),
    )
    line = labelled(panel, "ellipsoid of inertia (scaled)").points
    heights = np.einsum("ni,ij,nj->n", line, result["tensor"], line)
    assert heights == pytest.approx(np.full(len(line), heights[0]))
    of_parts = np.vstack(labelled(drawn("inertia", "t_handle")[1], "the body").points)
    assert of_parts.min(axis=0) == pytest.approx([-6e-3, -50e-3, -6e-3])  # the bar lies along y
    assert of_parts.max(axis=0) == pytest.approx([56e-3, 50e-3, 6e-3])  # the stem along x, from the bar on
    of_holes = drawn("inertia", "flywheel")[1]
    assert labelled(of_holes, "hole").quiet


def shape_of(name: str) -> Shape:
    form = loads(f"body: {{shape: {name}, {DIMENSIONS[name]}, mass: 1}}").body
    assert isinstance(form, Shape)
    return form


def area(face: Floats) -> float:
    """The area of a plane face (k, 3)."""
    return float(np.linalg.norm(np.cross(face[1:-1] - face[0], face[2:] - face[0]).sum(axis=0))) / 2


@pytest.mark.parametrize("name", SHAPES)
def test_the_surface_of_a_shape_has_its_extent_and_of_a_thin_one_its_measure(name: str) -> None:
    shape = shape_of(name)
    faces = shape.faces()
    points = np.vstack(faces)
    if isinstance(shape, Solid):
        assert isinstance(shape, Region)
        low, high = shape.net().min(axis=1), shape.net().max(axis=1)
        assert points.min(axis=0) == pytest.approx(low, abs=0.01)
        assert points.max(axis=0) == pytest.approx(high, abs=0.01)
        for grown, inside in ((1e-9, True), (-1e-9, False)):
            # Corners are on the surface: moved inward they are inside, moved outward they are not.
            if name not in ("hollow_sphere", "tube", "torus", "prism"):
                centre = np.array(shape.figure(FLOAT).geometry().centre, dtype=float)
                moved = centre + (points - centre) * (1 - grown)
                on_it = np.linalg.norm(points - centre, axis=1) > 0.2 * np.linalg.norm(high - low) / 2
                surely = shape.contains(*moved.T)
                assert surely.all() if inside else not surely[on_it].all()
    elif len(faces) == 1 and name in ("rod", "ring"):
        length = np.linalg.norm(np.diff(faces[0], axis=0), axis=1).sum()
        assert length == pytest.approx(float(shape.figure(FLOAT).geometry().measure), rel=0.01)
    else:
        assert sum(map(area, faces)) == pytest.approx(float(shape.figure(FLOAT).geometry().measure), rel=0.02)


# --- Files


def plots(program: Program, *arguments: str) -> str:
    """Standard error of a run that is refused."""
    done = program(*arguments)
    assert (done.code, done.out) == (2, "")
    return done.err


@pytest.fixture
def matplotlib() -> object:
    return pytest.importorskip("matplotlib", reason="the extra `show` is not installed")


@pytest.mark.usefixtures("matplotlib")
@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_files_are_the_same_bytes_each_time_and_light(program: Program, tmp_path: Path, ending: str) -> None:
    command, config = ("axes", "flywheel") if ending == "png" else ("euler", "t_handle")
    without = program(command, f"configs/{config}.yaml", "-f", "json", "-q")
    files = [tmp_path / f"{name}.{ending}" for name in "ab"]
    for file in files:
        done = program(command, f"configs/{config}.yaml", "-f", "json", "-q", "--plot", str(file))
        assert (done.code, done.out) == (0, without.out)
    first, second = (file.read_bytes() for file in files)
    assert first == second
    assert 1_000 < len(first) < 400_000
    assert first.startswith({"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[ending])


@pytest.mark.usefixtures("matplotlib")
@pytest.mark.parametrize(
    ("body", "count", "length"),
    [
        (f"{{mesh: {ROOT}/configs/bracket.stl, mass: 1, scale: 0.05}}", 18, 0.05 * (2 * 200 + 6 * 30)),
        ("{shape: box, size: [1, 2, 3], mass: 1}", 12, 24.0),
        ("{shape: cylinder, radius: 1, height: 5, mass: 1}", None, 4 * np.pi),
        ("{shape: sphere, radius: 1, mass: 1}", 0, 0.0),
    ],
)
def test_edges_are_drawn_where_a_surface_bends_and_not_in_its_sides(
    body: str, count: int | None, length: float
) -> None:
    from rigidcli.render.plots.drawing import figure_of

    axes = figure_of(rigidcli.axes(f"body: {body}", picture="body").pictures[0], "").axes[0]
    lines = [
        each for each in axes.collections if np.allclose(each.get_linewidth(), 0.5)
    ]  # arrows are thicker
    edges = [np.array(edge) for each in lines for edge in getattr(each, "_segments3d", ())]
    assert count is None or len(edges) == count
    assert sum(np.linalg.norm(end - start) for start, end in edges) == pytest.approx(length, rel=0.02)


@pytest.mark.usefixtures("matplotlib")
def test_labels_and_units_are_texts_of_an_svg(program: Program, tmp_path: Path) -> None:
    file = tmp_path / "picture.svg"
    assert program("euler", "configs/t_handle.yaml", "--plot", str(file)).code == 0
    text = file.read_text()
    assert all(part in text for part in ("rad/s", "(s)", "ω", "T-handle"))
    assert not re.search(r"<dc:date>", text)


@pytest.mark.usefixtures("matplotlib")
def test_names_of_documents_are_texts_and_no_formulas(program: Program, tmp_path: Path) -> None:
    file = tmp_path / "picture.svg"
    name = "a $x$ & <script> \\frac{"
    done = program(
        "axes", "-", "--plot", str(file), stdin=f"name: '{name}'\nbody: {{shape: cube, side: 1, mass: 1}}"
    )
    assert done.code == 0
    assert "<script>" not in file.read_text()
    assert "a $x$ &amp; &lt;script&gt;" in file.read_text()


def test_a_chart_of_characters_follows_the_table_and_stays_out_of_data(program: Program) -> None:
    pytest.importorskip("plotext", reason="the extra `show` is not installed")
    table = program("euler", "configs/t_handle.yaml")
    chart = program("euler", "configs/t_handle.yaml", "--plot", "-")
    assert chart.out.startswith(table.out)
    assert "* ω₁" in chart.out
    assert "rad/s" in chart.out[len(table.out) :]
    assert "\x1b" not in chart.out
    data = program("euler", "configs/t_handle.yaml", "-f", "csv", "--plot", "-")
    assert data.out == program("euler", "configs/t_handle.yaml", "-f", "csv").out
    assert "* ω₁" in data.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    rows_of(__file__, "what cannot be a picture is refused"),
)
def test_what_cannot_be_a_picture_is_refused(
    program: Program, arguments: tuple[str, ...], message: str
) -> None:
    assert message in " ".join(plots(program, "axes", *arguments).replace("│", " ").split())


@pytest.mark.parametrize("path", ["a.png", "-"])
def test_without_the_extra_the_message_says_how_to_get_it(
    program: Program, monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    monkeypatch.setattr("rigidcli.render.plots.LIBRARIES", {"drawing": "no_such", "characters": "no_such"})
    assert "rigidcli[show]" in plots(program, "axes", "configs/t_handle.yaml", "--plot", path)


def test_symbols_without_a_value_are_named(program: Program) -> None:
    with pytest.raises(rigidcli.DocumentError, match=r"parameters\.M"):
        rigidcli.axes(ROOT / "configs/cube_symbolic.yaml", picture="best")


def test_kinds_that_have_nothing_to_show_say_what_they_need() -> None:
    with pytest.raises(rigidcli.RigidError, match="`orbit`") as refused:
        rigidcli.hamilton(MODES, picture="phase")
    assert refused.value.exit_code == 2


def test_a_picture_and_the_results_are_two_files(program: Program, tmp_path: Path) -> None:
    target = tmp_path / "a.svg"
    outcome = program("axes", "configs/water.yaml", "-o", str(target), "--plot", f"{tmp_path}/./a.svg")
    assert outcome.code == 2
    assert "`-o` writes the results" in outcome.err
    assert not target.exists()
