"""Scenes: what a replay shows of a motion is the motion that the results tell."""

from __future__ import annotations

import json

import numpy as np
import pytest

import rigidcli
from rigidcli.core import rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.report import Report
from rigidcli.scene import Part, Scene, Stage
from rigidcli.studies import hamilton
from tests.conftest import ROOT
from tests.scenes import report_of, scene_of


def both_of(study: str, config: str) -> tuple[Report, Scene]:
    result = report_of(study, ROOT / "configs" / f"{config}.yaml")
    assert result.scene is not None
    return result, result.scene


def part(stage: Stage, label: str) -> Part:
    return next(each for each in stage.parts if each.mark.label == label)


def in_space(scene: Scene, each: Part) -> Floats:
    """The path (n, 3) of the last point of a part that moves."""
    points = np.asarray(each.mark.points)
    path = points if each.motion == "traced" else points[:, -1]
    return rotation.turned(scene.orientation, path) if each.carried else path


def test_no_scene_is_made_unless_it_is_asked_for_and_none_of_a_single_moment() -> None:
    document = ROOT / "configs/t_handle.yaml"
    assert rigidcli.euler(document).scene is None
    once = {"body": {"moments": [1, 2, 3]}, "motion": {"omega": [0, 0, 1], "times": [2]}}
    assert report_of("euler", once).scene is None
    oscillations = ROOT / "configs/coupled_pendulums.yaml"
    assert report_of("hamilton", oscillations).scene is None


@pytest.mark.parametrize("config", ["t_handle", "feynman_plate", "toutatis", "damped_satellite", "cone_top"])
def test_the_body_turns_to_space_as_its_momentum_does(config: str) -> None:
    result, scene = both_of("euler", config)
    motion, stage = result["trajectory"], scene.stages[0]
    momentum = rotation.turned(scene.orientation, motion["angular_momentum"])
    size = np.abs(momentum).max()
    assert momentum == pytest.approx(motion["angular_momentum_space"], abs=1e-9 * size)
    for label, vectors in (("L", momentum), ("ω", rotation.turned(scene.orientation, motion["omega"]))):
        arrow = in_space(scene, part(stage, label))
        scale = np.linalg.norm(arrow[0]) / np.linalg.norm(vectors[0])
        assert arrow == pytest.approx(vectors * scale, abs=1e-9 * np.abs(arrow).max())
    assert in_space(scene, part(stage, "herpolhode")) == pytest.approx(
        in_space(scene, part(stage, "polhode")), abs=1e-9
    )


def test_the_handle_turns_over_while_its_momentum_stays() -> None:
    result, scene = both_of("euler", "t_handle")
    stage = scene.stages[0]
    momentum = in_space(scene, part(stage, "L"))
    assert np.ptp(momentum, axis=0) == pytest.approx(np.zeros(3), abs=1e-9)
    stem = rotation.turned(scene.orientation, np.array([1.0, 0, 0])) @ momentum[0]
    over = np.flatnonzero(np.diff(np.sign(stem)))
    times = result["trajectory"]["t"][over]
    assert np.diff(times) == pytest.approx(np.full(len(over) - 1, result["flip_interval"]), abs=0.02)
    assert len(over) == 5


def test_the_body_is_where_its_parts_are_about_o() -> None:
    _, scene = both_of("euler", "t_handle")
    corners = np.vstack(part(scene.stages[0], "the body").mark.points)
    com = rigidcli.inertia(ROOT / "configs/t_handle.yaml")["center_of_mass"]
    assert corners.min(axis=0) == pytest.approx(np.array([-6e-3, -50e-3, -6e-3]) - com)
    assert corners.max(axis=0) == pytest.approx(np.array([56e-3, 50e-3, 6e-3]) - com)


def test_a_known_tensor_is_shown_as_its_ellipsoid_of_inertia() -> None:
    result, scene = both_of("euler", "tennis_racket")
    faces = np.vstack(part(scene.stages[0], "ellipsoid of inertia").mark.points)
    level = np.einsum("ni,i,ni->n", faces, result["moments"], faces)
    assert level == pytest.approx(np.full(len(faces), level[0]))


@pytest.mark.parametrize("config", ["t_handle", "toutatis", "feynman_plate"])
def test_the_ellipsoid_of_energy_rolls_on_its_plane(config: str) -> None:
    result, scene = both_of("euler", config)
    stage = scene.stages[1]
    plane = part(stage, "plane").mark.points[0]
    across = part(stage, "L").mark.points[1]
    across /= np.linalg.norm(across)
    distance = plane @ across
    touching = in_space(scene, part(stage, "ω")) @ across
    assert distance == pytest.approx(np.full(len(distance), distance[0]))
    assert touching == pytest.approx(np.full(len(touching), distance[0]))
    surface = np.vstack(part(stage, "ellipsoid of energy").mark.points)
    # No point of the ellipsoid, as it lies at any time, is beyond the plane.
    heights = [
        (rotation.turned(q, surface) @ across).max() / distance[0]
        for q in scene.orientation[:: len(scene.orientation) // 7]
    ]
    assert max(heights) <= 1 + 1e-9
    assert result["motion"] != "driven"


def test_particles_are_where_the_coordinates_put_them_with_the_rods_between() -> None:
    result, scene = both_of("hamilton", "double_pendulum")
    stage, q = scene.stages[0], result["orbit"]["q"]
    at = np.searchsorted(scene.times, result["orbit"]["t"])
    first = np.column_stack([np.sin(q["theta1"]), -np.cos(q["theta1"]), 0 * q["theta1"]])
    second = first + np.column_stack([np.sin(q["theta2"]), -np.cos(q["theta2"]), 0 * q["theta2"]])
    assert part(stage, "path of particle 1").mark.points[at] == pytest.approx(first)
    assert part(stage, "path of particle 2").mark.points[at] == pytest.approx(second)
    rods = [np.asarray(each.mark.points)[at] for each in stage.parts if each.group == "rods"]
    ends = [np.zeros_like(first), first], [first, second]
    for rod, (start, end) in zip(rods, ends, strict=True):
        assert rod[:, 0] == pytest.approx(start)
        assert rod[:, 1] == pytest.approx(end)
    assert stage.is_flat
    assert [each.title for each in scene.stages[1:]] == [f"phase portrait of theta{k}" for k in (1, 2)]


def test_a_top_without_a_body_is_shown_as_its_ellipsoid() -> None:
    top = {"mass": 0.3, "distance": 0.05, "lambda1": 1e-3, "lambda3": 3.75e-4, "spin": "20 rps", "tilt": 0.5}
    scene = scene_of("euler", {"top": top})
    assert part(scene.stages[0], "ellipsoid of inertia").carried
    axis = in_space(scene, part(scene.stages[0], "path of the axis of the top"))
    assert axis[0] / np.linalg.norm(axis[0]) == pytest.approx([0, -np.sin(0.5), np.cos(0.5)])


def test_a_system_without_particles_has_its_phase_portraits() -> None:
    result, scene = both_of("hamilton", "henon_heiles")
    assert [stage.title for stage in scene.stages] == [
        "phase portrait of x",
        "phase portrait of y",
        "orbit in x, y",
    ]
    orbit = result["orbit"]
    at = np.searchsorted(scene.times, orbit["t"])
    path = np.asarray(part(scene.stages[0], "orbit so far").mark.points)[at]
    for values, drawn in ((orbit["q"]["x"], path[:, 0]), (orbit["p"]["p_x"], path[:, 1])):
        slope = np.ptp(drawn) / np.ptp(values)
        assert drawn - drawn[0] == pytest.approx((values - values[0]) * slope)
    assert [cell for column in scene.readings.columns for cell in column.cells] == [
        *("t", "x", "p_x", "y", "p_y", "H")
    ]


def test_an_orbit_of_one_moment_is_drawn_as_a_point() -> None:
    system = {"coordinates": ["x"], "lagrangian": "xdot**2/2 - x**2/2"}
    document = {"system": system, "orbit": {"initial": {"x": 1, "xdot": 0}, "times": [0]}}
    report = hamilton.run(rigidcli.loads(json.dumps(document)), picture="phase", scene=True)
    assert report.pictures
    assert report.scene is None


@pytest.mark.parametrize("samples", [2, 3, 400])
def test_orbits_are_drawn_as_smooth_curves_however_few_samples_are_asked_for(samples: int) -> None:
    system = {"coordinates": ["x", "y"], "lagrangian": "(xdot**2 + ydot**2)/2 - (x**2 + y**2)/2"}
    orbit = {"initial": {"x": 1, "y": 0, "xdot": 0, "ydot": 1}, "duration": 40, "samples": samples}
    scene = scene_of("hamilton", {"system": system, "orbit": orbit})
    path = np.asarray(part(scene.stages[0], "orbit so far").mark.points)
    assert len(path) == len(scene.times) < 1000
    # A chord of a unit circle passes it by h^2/8, and the circle turns by one radian a second.
    assert (np.diff(scene.times) ** 2 / 8).max() < 0.0021


def test_the_replay_reads_off_multipliers_and_observables() -> None:
    for config, keys in (("skate_on_slope", ["multipliers.blade"]), ("runge_lenz", ["observables.Lz"])):
        read_off = [
            column.key for column in scene_of("hamilton", ROOT / f"configs/{config}.yaml").readings.columns
        ]
        assert {*keys} <= {*read_off}
