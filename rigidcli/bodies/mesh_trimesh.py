"""Surfaces from PLY and GLB, which trimesh reads in a confined process, as the files are untrusted.

The process may read files and do nothing else, and its time and memory are bounded.
trimesh takes some things for others without a word, such as a cut text or a skin. They are refused here.

3MF and COLLADA are not read, though trimesh has readers for them: of an object that is repeated within
others (3MF), that reader leaves copies out without a word, and text that is no number becomes zero (COLLADA).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from rigidcli.bodies.edges import require_indices
from rigidcli.core import memory
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, printable, shortened, shown
from rigidcli.sandbox import Limits, confine

SECONDS, PER_MEGABYTE = 30.0, 1.0
"""The time that reading may take (s), and so much more a megabyte: trimesh loads in one or two seconds."""

TIMES_THE_FILE = 40
"""The memory that trimesh may take beyond a gigabyte, in units of the size of the file."""

APPEARANCE = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_mesh_quantization")
"""Beginnings of the names of extensions that leave a surface where it is, or that trimesh reads."""

JSON_AT = 20
"""Where the JSON begins in a .glb file: after a head of 12 bytes, and its length and kind."""

READ = b"triangles\n"
"""The first bytes of the answer of the process, where the file could be read."""


def triangles(path: Path) -> Floats:
    """The triangles (n, 3, 3) of a PLY file, or of all that a GLB file shows. Raises ValueProblem."""
    if find_spec("trimesh") is None:
        hint = "python -m pip install 'rigidcli[mesh]', or save it as STL"
        raise ValueProblem(f"{path}: trimesh, which reads {path.suffix.lower()}, is not installed", hint=hint)
    most = SECONDS + PER_MEGABYTE * path.stat().st_size / 1e6
    try:
        done = subprocess.run(  # noqa: S603 - this very program, by its absolute name
            [sys.executable, "-P", "-m", __name__, str(path.absolute())],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=most,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        reason = error.strerror if isinstance(error, OSError) else f"not done within {most:.0f} s"
        raise ValueProblem(f"{path}: cannot be read: {reason}", hint="save it as STL") from None
    if done.returncode == 0 and done.stdout.startswith(READ):
        return np.frombuffer(done.stdout, offset=len(READ)).reshape(-1, 3, 3)
    message = printable(shortened(done.stdout.decode("utf-8", "replace")))
    raise ValueProblem(f"{path}: {message or 'it takes too much memory to read'}", hint="save it as STL")


def _work(path: Path) -> bytes:
    """The answer of the process: the triangles, or a message."""
    size = path.stat().st_size
    room = min(2**30 + TIMES_THE_FILE * size, memory.available())
    confine(Limits(memory=int(room)), 1)  # standard output stays open, and nothing else
    try:
        kind = path.suffix[1:].lower()
        declared = _faces_of_ply(path.read_bytes()) if kind == "ply" else 0
        for what in () if kind == "ply" else _passed_over(_scene(path)):
            return f"there is {what}, which trimesh does not read".encode()
        import trimesh  # which takes a second or two

        with path.open("rb") as file:
            scene = trimesh.load_scene(file, file_type=kind, process=False, validate=False)
        shown_as = [scene.graph.get(node)[1] for node in scene.graph.nodes_geometry]
        surfaces = [scene.geometry[name] for name in shown_as if hasattr(scene.geometry[name], "faces")]
        for surface in surfaces:
            require_indices(surface.faces, len(surface.vertices), path)
        if sum(len(surface.faces) for surface in surfaces) < declared:
            raise ValueProblem(f"{path}: the data end before all {declared:,} faces")
        faces = scene.to_mesh().triangles if surfaces else np.empty((0, 3, 3))
        return READ + np.asarray(faces, dtype=np.float64).tobytes()
    except ValueProblem as problem:
        return problem.message.removeprefix(f"{path}: ").encode()
    except MemoryError:
        return b""
    except Exception as error:  # noqa: BLE001 - whatever it is, nothing can be made of the file
        return f"trimesh cannot read it: {type(error).__name__}: {error}; is it cut or damaged?".encode()


def _faces_of_ply(data: bytes) -> int:
    """The number of faces in the header of a PLY file; trimesh stops without a word where a text is cut."""
    header, end, rest = data.partition(b"end_header")
    if not data.startswith(b"ply") or not end:
        raise ValueProblem("not a PLY file: it begins with `ply`, and its header ends with `end_header`")
    words = [line.split() for line in header.split(b"\n")]
    counts = {line[1]: int(line[2]) for line in words if line[:1] == [b"element"] and len(line) == 3}
    if not counts.keys() >= {b"vertex", b"face"}:
        raise ValueProblem("expected elements `vertex` and `face` in the header")
    if [b"format", b"ascii", b"1.0"] in words:
        lines, expected = sum(1 for line in rest.split(b"\n") if line.strip()), sum(counts.values())
        if lines < expected:
            raise ValueProblem(f"{lines:,} lines after the header, expected {expected:,}: it is truncated")
    return counts[b"face"]


def _scene(path: Path) -> Any:
    """The JSON in a .glb file. Raises ValueProblem."""
    data = path.read_bytes()
    if data[:4] != b"glTF" or data[4:8] != b"\2\0\0\0" or data[16:JSON_AT] != b"JSON":
        raise ValueProblem("expected a head with `glTF`, the version 2, and `JSON`")
    try:
        return json.loads(data[JSON_AT : JSON_AT + int.from_bytes(data[12:16], "little")].decode())
    except json.JSONDecodeError as error:
        raise ValueProblem(f"not JSON in line {error.lineno}: {error.msg}") from None
    except UnicodeDecodeError:
        raise ValueProblem("not JSON: there are bytes that are no UTF-8") from None


def _passed_over(scene: Any) -> Iterator[str]:
    """The features of a scene that trimesh passes over, or takes for something else."""
    for name in scene.get("extensionsRequired", []):
        if not name.startswith(APPEARANCE):
            yield f"the extension {shown(name)}"
    for number, node in enumerate(scene.get("nodes", [])):
        features = {
            "a skin": "skin" in node,
            "weights of shapes": any(node.get("weights", [])),
            "a mesh in several places": "EXT_mesh_gpu_instancing" in node.get("extensions", {}),
            "a camera beside other things": "camera" in node and bool(node.keys() & {"mesh", "children"}),
            "an index below zero": min([0, *node.get("children", []), node.get("mesh", 0)]) < 0,
        }
        yield from (f"{what} of node {number}" for what, is_there in features.items() if is_there)
    accessors = scene.get("accessors", [])
    for number, mesh in enumerate(scene.get("meshes", [])):
        for part in mesh["primitives"]:
            indices = [part["indices"]] if "indices" in part else []
            used = [part["attributes"]["POSITION"], *indices]
            features = {
                "weights of shapes": any(mesh.get("weights", [])),
                "triangles that are a fan": part.get("mode", 4) == 6,
                "an index below zero": min(used) < 0,
                "sparse data": any("sparse" in accessors[place] for place in used),
                "places in units of a type": accessors[used[0]].get("normalized", False),
            }
            yield from (f"{what} of mesh {number}" for what, is_there in features.items() if is_there)


if __name__ == "__main__":
    sys.stdout.buffer.write(_work(Path(sys.argv[1])))
    sys.stdout.flush()
