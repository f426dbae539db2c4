"""Meshes in glTF, which trimesh reads in a process of its own; and those that nothing here reads."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rigidcli
from rigidcli import RigidError
from rigidcli.model import mesh_gltf
from tests.conftest import Program
from tests.meshes import box, indexed

VERTICES, FACES = indexed(box((0, 0, 0), (1, 2, 3)))
DATA = VERTICES.astype("<f4").tobytes() + FACES.astype("<u4").tobytes()
SCENE: dict[str, Any] = {
    "asset": {"version": "2.0"},
    "buffers": [{"byteLength": len(DATA), "uri": "box%20data.bin"}],
    "bufferViews": [
        {"buffer": 0, "byteLength": VERTICES.size * 4},
        {"buffer": 0, "byteOffset": VERTICES.size * 4, "byteLength": FACES.size * 4},
    ],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": len(VERTICES), "type": "VEC3"},
        {"bufferView": 1, "componentType": 5125, "count": FACES.size, "type": "SCALAR"},
    ],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "nodes": [
        {"children": [1, 2], "translation": [0, 0, 10]},
        {"mesh": 0, "rotation": [0, 0, 0.5**0.5, 0.5**0.5]},
        {"mesh": 0, "translation": [5, 0, 0], "scale": [-1, 2, 1]},
    ],
    "scenes": [{"nodes": [0]}],
    "scene": 0,
}
PARTS = """
body:
  position: [0, 0, 10]
  parts:
    - {shape: box, size: [1, 2, 3], anchor: corner, density: 7850, rotation: {axis: [0, 0, 1], angle: pi/2}}
    - {shape: box, size: [1, 4, 3], anchor: corner, density: 7850, position: [4, 0, 0]}
"""


def written(folder: Path, name: str = "scene.gltf", **changes: Any) -> Path:
    (folder / "box data.bin").write_bytes(DATA)
    path = folder / name
    path.write_text(json.dumps(SCENE | changes))
    return path


def test_what_a_scene_shows_is_the_body(program: Program, tmp_path: Path) -> None:
    found = json.loads(
        program("axes", str(written(tmp_path)), "-f", "json", "--set", "body.density=7850").out
    )
    parts = rigidcli.axes(PARTS)
    for key in ("mass", "center_of_mass", "tensor"):
        np.testing.assert_allclose(found[key], parts[key], rtol=1e-6, atol=1e-6 * parts["mass"])
    assert (found["mesh"]["triangles"], found["mesh"]["components"]) == (24, 2)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"buffers": [{"byteLength": 9, "uri": "../box%20data.bin"}]}, "is not in its folder"),
        ({"buffers": [{"byteLength": 9, "uri": "none.bin"}]}, "`none.bin`, expected a file"),
        (
            {"accessors": [{**SCENE["accessors"][0], "count": 10**9}, SCENE["accessors"][1]]},
            "trimesh cannot read it",
        ),
    ],
)
def test_hostile_scenes_are_refused(changes: dict[str, Any], reason: str, tmp_path: Path) -> None:
    folder = tmp_path / "inner"
    folder.mkdir()
    (tmp_path / "box data.bin").write_bytes(DATA)
    path = written(folder, **changes)
    with pytest.raises(RigidError, match=reason) as caught:
        rigidcli.inertia(path, settings=["body.density=1"])
    assert "Traceback" not in str(caught.value)


def test_without_trimesh_the_message_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(mesh_gltf, "find_spec", lambda name: None)
    with pytest.raises(RigidError, match=r"scene.glb: trimesh.* is not installed.*\n.*rigidcli\[mesh\]"):
        rigidcli.inertia(written(tmp_path, "scene.glb"), settings=["body.density=1"])


@pytest.mark.parametrize("name", ["part.3mf", "part.STEP", "part.dae"])
def test_other_formats_are_refused_as_meshes(name: str, program: Program, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(b"\0")
    for command in ("axes", "validate"):
        outcome = program(command, str(path))
        assert (outcome.code, outcome.out) == (3, "")
        assert f"{name}: {path.suffix.lower()} is not read, expected a mesh such as .stl" in outcome.err
        assert "hint: save it as STL" in outcome.err
    outcome = program("axes", "-", stdin=f"body: {{mesh: '{path}', density: 1}}")
    assert f"{name}: expected the name of a mesh" in outcome.err
