"""The replay as a fragment of HTML: what is sent to the browser, how large it is, and what stays text."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rigidcli
from rigidcli.core import rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.document.load import load
from rigidcli.picture import Mark
from rigidcli.render import Look
from rigidcli.render.html import PAGE
from rigidcli.render.units import in_units, read_units
from rigidcli.render.web.replay import MOST_TRIANGLES, player, replay, triangles
from rigidcli.report import Column, Table
from rigidcli.scene import Part, Scene, Stage
from tests.conftest import ROOT, Program
from tests.scenes import report_of, scene_of

LIMIT = 3_000_000
"""The most characters of a replay of 1,001 samples."""

HOSTILE = "</script><script>alert(1)</script><b onclick='x'>\"&{{0}}"


def fragment_of(study: str, document: Path | dict[str, Any], *settings: str) -> str:
    return replay(scene_of(study, document, settings), Look(), PAGE)


def sent(fragment: str) -> dict[str, Any]:
    """The data in a fragment, its numbers as arrays."""
    found = re.search(r"<script type=application/json>(.*?)</script>", fragment, re.DOTALL)
    assert found is not None
    data: dict[str, Any] = json.loads(found[1])
    data["times"] = numbers(data["times"], "<f8")
    for reading in data["readings"]:
        reading["values"] = numbers(reading["values"], "<f8")
    data["arrays"] = [numbers(text, "<f4") for text in data["arrays"]]
    for key in ("orientation", "turns"):
        data[key] = numbers(data[key], "<f4") if key in data else None
    return data


def numbers(text: str, kind: str) -> Floats:
    return np.frombuffer(base64.b64decode(text), kind).astype(float)


def between(data: dict[str, Any], share: float) -> Floats:
    """The orientations (n - 1, 4) so far on the way from each sample to the next, as the page has them."""
    q, turns = data["orientation"].reshape(-1, 4)[:-1], share * data["turns"].reshape(-1, 3)
    angle = np.linalg.norm(turns, axis=1, keepdims=True)
    axis = turns / np.where(angle > 0, angle, 1)
    return rotation.compose(q, np.hstack([np.cos(angle / 2), np.sin(angle / 2) * axis]))


# --- The motion between the samples


@pytest.mark.parametrize("config", ["t_handle", "top_looping"])
def test_between_samples_the_body_is_where_more_samples_put_it(config: str) -> None:
    document = ROOT / "configs" / f"{config}.yaml"
    data = sent(fragment_of("euler", document))
    count = len(data["times"])
    fine = rigidcli.euler(document, settings=[f"motion.samples={2 * count - 1}"])["trajectory"]
    assert fine["t"][::2] == pytest.approx(data["times"])
    apart = rotation.angles_between(between(data, 0.5), fine["orientation"][1::2])
    assert apart.max() < 2e-3
    ends = rotation.angles_between(between(data, 1.0), fine["orientation"][2::2])
    assert ends.max() < 1e-5


def test_whole_turns_between_two_samples_are_not_lost() -> None:
    """The Earth is sampled once a day, and turns a little more than once."""
    data = sent(fragment_of("euler", ROOT / "configs/earth.yaml"))
    turns = data["turns"].reshape(-1, 3)
    assert turns[:, 2] == pytest.approx(np.full(len(turns), 7.292115e-5 * 86400), rel=1e-5)
    backwards = {
        "body": {"moments": [1, 1, 2]},
        "motion": {"omega": [0, 0, -25], "duration": 10, "samples": 11},
    }
    turns = sent(fragment_of("euler", backwards))["turns"].reshape(-1, 3)
    assert turns == pytest.approx(np.tile([0, 0, -25.0], (10, 1)), rel=1e-6, abs=1e-6)


# --- Size


@pytest.mark.parametrize(("study", "config"), [("euler", "top_looping"), ("hamilton", "henon_heiles")])
def test_a_thousand_samples_are_at_most_three_megabytes(study: str, config: str) -> None:
    section = "motion" if study == "euler" else "orbit"
    fragment = fragment_of(study, ROOT / "configs" / f"{config}.yaml", f"{section}.samples=1001")
    assert len(sent(fragment)["times"]) >= 1001
    assert len(fragment) < LIMIT


# --- A body at rest


def test_a_page_shows_the_body_with_its_axes_in_three_dimensions(program: Program) -> None:
    page = program("axes", "configs/t_handle.yaml", "-q", "-f", "html").out
    data = sent(page)
    assert len(page) < 150_000
    assert (len(data["times"]), data["readings"]) == (1, [])
    (stage,) = data["stages"]
    assert {part["motion"] for part in stage["parts"]} == {"still"}
    arrows = {
        part["label"]: data["arrays"][part["points"]] for part in stage["parts"] if part["form"] == "arrow"
    }
    axes = rigidcli.axes(ROOT / "configs/t_handle.yaml")["axes"]
    for name, axis in zip(("e₁", "e₂", "e₃"), axes, strict=True):
        way = arrows[name][3:] - arrows[name][:3]
        assert way / np.linalg.norm(way) == pytest.approx(axis, abs=1e-6)


# --- Texts


def hostile_scene() -> Scene:
    times = np.linspace(0, 1, 11)
    readings = Table("", HOSTILE, (Column("t", times, (HOSTILE,), "s"), Column("x", times, ("x",), HOSTILE)))
    arrow = Part(Mark("arrow", np.array([[0, 0, 0], [0, 0, 1.0]]), HOSTILE))
    path = Part(Mark("line", np.column_stack([times, times, times]), HOSTILE), "traced", group=HOSTILE)
    return Scene(HOSTILE, times, readings, (Stage(HOSTILE, (arrow, path)), Stage("another", (arrow, path))))


def test_hostile_texts_stay_texts() -> None:
    fragment = replay(hostile_scene(), Look(), PAGE)
    assert fragment.count("<script") == fragment.count("</script>") == 1
    assert "<b onclick" not in fragment
    stage = sent(fragment)["stages"][0]
    assert [part["label"] for part in stage["parts"]] == [HOSTILE, HOSTILE]


def test_the_script_uses_nothing_that_a_page_forbids_and_no_html_from_texts() -> None:
    _, script = player()
    for word in (
        "innerHTML",
        "outerHTML",
        "insertAdjacent",
        "document.write",
        "eval(",
        "Function(",
        "fetch(",
        "import",
    ):
        assert word not in script, word
    assert not re.search(r"https?:", script)


def test_readings_are_in_the_units_of_the_reader_and_the_motion_in_seconds() -> None:
    result = report_of("euler", ROOT / "configs/earth.yaml")
    scene = in_units(result, read_units("day,deg")).scene
    assert scene is not None
    fragment = replay(scene, Look(), PAGE)
    data = sent(fragment)
    assert [reading["unit"] for reading in data["readings"][:2]] == ["day", "deg/day"]
    assert data["readings"][0]["values"][-1] == pytest.approx(305)
    assert data["times"][-1] == pytest.approx(305 * 86400)
    assert "<mi>t</mi>" in fragment


# --- Triangles


def area(found: Floats) -> float:
    return float(
        np.linalg.norm(np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0]), axis=1).sum() / 2
    )


def test_a_polygon_that_is_bent_inwards_is_cut_without_overlaps() -> None:
    corner = np.array([[0, 0, 0], [3, 0, 0], [3, 1, 0], [1, 1, 0], [1, 3, 0], [0, 3, 0]], dtype=float)
    angle = np.arange(14) * np.pi / 7
    star = (
        np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
        * np.where(np.arange(14) % 2, 1, 3)[:, None]
    )
    turn = rotation.from_quaternion([1, 2, -3, 4], load(ROOT / "configs/t_handle.yaml").arithmetic)
    for face in (corner, star):
        x, y = face[:, 0], face[:, 1]
        exact = abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2
        for first in range(len(face)):
            for way in (1, -1):
                cut = triangles([np.roll(face, first, axis=0)[::way] @ turn.T], MOST_TRIANGLES)
                assert len(cut) == len(face) - 2
                assert area(cut) == pytest.approx(exact)


def test_a_surface_of_very_many_triangles_becomes_coarser_and_keeps_its_extent() -> None:
    u, v = np.meshgrid(np.linspace(0, np.pi, 81), np.linspace(0, 2 * np.pi, 161))
    grid = np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], axis=-1)
    faces = list(
        np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2).reshape(-1, 4, 3)
    )
    coarse = triangles(faces, 5_000)
    assert 1_000 < len(coarse) <= 5_000
    assert area(coarse) == pytest.approx(4 * np.pi, rel=0.05)
