"""Meshes in PLY and GLB, which trimesh reads in a process of its own; and those that nothing reads."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rigidcli
from rigidcli import RigidError
from rigidcli.bodies import mesh_files
from tests.conftest import Program
from tests.meshes import box, indexed

VERTICES, FACES = indexed(box((0, 0, 0), (1, 2, 3)))
DATA = VERTICES.astype("<f4").tobytes() + FACES.astype("<u4").tobytes()
SCENE: dict[str, Any] = {
    "asset": {"version": "2.0"},
    "buffers": [{"byteLength": len(DATA)}],
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


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reads files without a process of its own, in which trimesh would take a second to load each time."""

    def run(command: list[str], **_: Any) -> subprocess.CompletedProcess[bytes]:
        return subprocess.CompletedProcess(command, 0, mesh_files._work(Path(command[-1])))

    monkeypatch.setattr("rigidcli.sandbox.confine", lambda *_: None)
    monkeypatch.setattr(subprocess, "run", run)


def written(folder: Path, **changes: Any) -> Path:
    scene = json.dumps(SCENE | changes).encode()
    chunks = b""
    for kind, data in ((b"JSON", scene + b" " * (-len(scene) % 4)), (b"BIN\0", DATA)):
        chunks += len(data).to_bytes(4, "little") + kind + data
    path = folder / "scene.glb"
    path.write_bytes(b"glTF\2\0\0\0" + (12 + len(chunks)).to_bytes(4, "little") + chunks)
    return path


def test_what_a_scene_shows_is_the_body(program: Program, tmp_path: Path) -> None:
    found = json.loads(
        program("axes", str(written(tmp_path)), "-f", "json", "--set", "body.density=7850").out
    )
    parts = rigidcli.axes(PARTS)
    for key in ("mass", "center_of_mass", "tensor"):
        np.testing.assert_allclose(found[key], parts[key], rtol=1e-6, atol=1e-6 * parts["mass"])


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"buffers": [{"byteLength": 9, "uri": "none.bin"}]}, "trimesh cannot read it"),
        (
            {"accessors": [{**SCENE["accessors"][0], "count": 10**9}, SCENE["accessors"][1]]},
            "trimesh cannot read it",
        ),
        (
            {"accessors": [{**SCENE["accessors"][0], "count": 7}, SCENE["accessors"][1]]},
            r"a face has the vertex 7 \(counted from 0\), and there are 7",
        ),
    ],
)
def test_hostile_scenes_are_refused(changes: dict[str, Any], reason: str, tmp_path: Path) -> None:
    with pytest.raises(RigidError, match=reason) as caught:
        rigidcli.inertia(written(tmp_path, **changes), settings=["body.density=1"])
    assert "Traceback" not in str(caught.value)


def changed(key: str, number: int, **changes: Any) -> dict[str, Any]:
    """The scene with some changes in one of its nodes, meshes or accessors."""
    found = [dict(each) for each in SCENE[key]]
    found[number] |= changes
    return {key: found}


PART = SCENE["meshes"][0]["primitives"][0]


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(
    ("changes", "what"),
    [
        (changed("nodes", 1, skin=0), "skin"),
        (changed("nodes", 1, weights=[0, 0.5]), "weights"),
        (changed("nodes", 1, extensions={"EXT_mesh_gpu_instancing": {}}), "EXT_mesh_gpu_instancing"),
        (changed("nodes", 1, camera=0), "camera"),
        (changed("meshes", 0, weights=[1]), "weights"),
        (changed("meshes", 0, primitives=[PART, PART | {"mode": 6}]), "TRIANGLE_FAN"),
        (changed("accessors", 0, sparse={}), "sparse"),
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "KHR_draco_mesh_compression"),
    ],
)
def test_what_trimesh_passes_over_is_refused(changes: dict[str, Any], what: str, tmp_path: Path) -> None:
    path = written(tmp_path, **changes)
    with pytest.raises(RigidError, match=f"scene.glb: there is `{what}`, which trimesh does not read"):
        rigidcli.inertia(path, settings=["body.density=1"])


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"glTF\2\0\0\0", "trimesh cannot read it"),
        (b'glTF\2\0\0\0\0\0\0\0\7\0\0\0JSON{\n"a":}', "trimesh cannot read it: JSONDecodeError.*line 2"),
        (b"glTF\2\0\0\0\0\0\0\0\1\0\0\0JSON\xff", "trimesh cannot read it"),
    ],
)
def test_what_is_no_scene_is_told(content: bytes, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "scene.glb"
    path.write_bytes(content)
    with pytest.raises(RigidError, match=reason):
        rigidcli.inertia(path, settings=["body.density=1"])


VERTEX = "property float x\nproperty float y\nproperty float z\n"
TEXT, BINARY = "ply\nformat ascii 1.0\n", "ply\nformat binary_little_endian 1.0\n"
HEADER = f"element vertex 8\n{VERTEX}element face 12\nproperty list uchar int vertex_indices\nend_header\n"
ROWS = "".join(f"{x} {y} {z}\n" for x, y, z in VERTICES)
ROWS += "".join(f"3 {a} {b} {c}\n" for a, b, c in FACES)
RECORDS = VERTICES.astype("<f4").tobytes()
RECORDS += b"".join(b"\3" + face.astype("<i4").tobytes() for face in FACES)


@pytest.mark.parametrize(
    "content", [f"{TEXT}{HEADER}{ROWS}".encode(), f"{BINARY}{HEADER}".encode() + RECORDS]
)
def test_a_ply_file_is_what_the_shape_is(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_bytes(content)
    found = rigidcli.inertia(tmp_path / "a.ply", settings=["body.density=1000"])
    shape = rigidcli.inertia("body: {shape: box, size: [1, 2, 3], anchor: corner, density: 1000}")
    np.testing.assert_allclose(found["tensor"], shape["tensor"], rtol=1e-15)


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "the file is empty"),
        ("ply\n" * 1000, "trimesh cannot read it"),
        (f"{TEXT}end_header\n", "a.ply: "),
        (f"{TEXT}{HEADER}{ROWS[:-40]}", "open: "),
        (f"{TEXT}{HEADER}{ROWS[:-3]}", "open: "),
        (f"{TEXT}{HEADER}{ROWS}".replace("3 0", "3 77", 1), "a face has the vertex 77"),
        (f"{TEXT}{HEADER}{ROWS}".replace("3.0", "x3", 1), "trimesh cannot read it"),
        (f"{TEXT}{HEADER}{ROWS}".replace("3.0", "nan", 1), "has a coordinate that is no finite number"),
        (f"{BINARY}{HEADER}" + RECORDS[:-9].decode("latin-1"), "is it cut or damaged"),
        (f"{BINARY}{HEADER}" + (RECORDS[:-4] + b"\xff" * 4).decode("latin-1"), "the vertex -1 (counted from"),
        (f"{TEXT}{HEADER.replace('12', '-1')}{ROWS}", "no triangles"),
    ],
)
def test_hostile_ply_files_are_refused(content: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    path.write_text(content, encoding="latin-1")
    with pytest.raises(RigidError) as caught:
        rigidcli.inertia(path, settings=["body.density=1"])
    assert message in str(caught.value)
    assert "Traceback" not in str(caught.value)


def test_a_ply_file_that_asks_for_all_memory_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_text(f"{BINARY}{HEADER.replace('vertex 8', 'vertex 99999999999')}0\n")
    with pytest.raises(RigidError, match="trimesh cannot read it"):
        rigidcli.inertia(tmp_path / "a.ply", settings=["body.density=1"])


def test_without_trimesh_the_message_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(mesh_files, "find_spec", lambda name: None)
    with pytest.raises(RigidError, match=r"scene.glb: trimesh.* is not installed.*\n.*rigidcli\[mesh\]"):
        rigidcli.inertia(written(tmp_path), settings=["body.density=1"])


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
