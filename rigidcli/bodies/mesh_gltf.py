"""Surfaces from glTF, which trimesh reads in a process of its own, as the files are untrusted.

A scene of glTF is a tree of things in frames, each of which refers to pieces of data, also in other files.
The process is confined to a few seconds, a bound of memory, to reading, and to the folder of the file.
What trimesh passes over in a scene without a word, such as skins, is looked for first, and refused.

3MF and COLLADA are not read, though trimesh has readers for them: of an object that is repeated within
others (3MF), that reader leaves copies out without a word, and numbers that are none become zeros (COLLADA).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from rigidcli.bodies.mesh_formats import MOST_TRIANGLES
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, printable, shortened, shown
from rigidcli.sandbox import Limits, confine

LIMITS = Limits(seconds=6.0)
"""What reading may take, of which it takes one or two seconds to load trimesh."""

LATEST = 60.0
"""Seconds after which a process is late that has not ended by itself: others may need the processor."""

LARGEST = 32_000_000
"""The largest file (bytes) that belongs to a scene."""

APPEARANCE = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_mesh_quantization")
"""Beginnings of the names of extensions that leave a surface where it is, or that trimesh reads."""

COPIES = "EXT_mesh_gpu_instancing"
"""The extension by which a node shows its mesh several times."""

NATURAL = ("POSITION", "buffer", "bufferView", "byteOffset", "children", "indices", "mesh", "nodes", "scene")
"""Keys of numbers that are not negative: Python counts such ones from the end."""

FRAME = {"translation", "rotation", "scale"}
"""Keys of a node that has a frame and no matrix."""

LONG = 5125
"""The type of whole numbers without a sign, of 4 bytes."""

INDICES = (5121, 5123, LONG)
"""The types of indices: whole numbers without a sign, of 1, 2 and 4 bytes."""

JSON_AT = 20
"""Where the JSON begins in a .glb file: after a head of 12 bytes, and its length and kind."""

UNMOVED = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
"""The matrix of a frame that is not turned or moved."""

READ = b"triangles\n"
"""What stands before the triangles, where the file could be read."""


def gltf(path: Path) -> Floats:
    """The triangles (n, 3, 3) of all that a .glb or .gltf file shows, where it does. Raises ValueProblem."""
    if find_spec("trimesh") is None:
        hint = "python -m pip install 'rigidcli[mesh]', or save it as STL"
        raise ValueProblem(f"{path}: trimesh, which reads {path.suffix.lower()}, is not installed", hint=hint)
    try:
        done = subprocess.run(  # noqa: S603 - this very program, by its absolute name
            [sys.executable, "-P", "-m", __name__, str(path.absolute())],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=LATEST,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        reason = error.strerror if isinstance(error, OSError) else f"not done within {LATEST:g} s"
        raise ValueProblem(f"{path}: cannot be read: {reason}") from None
    if done.returncode == 0 and done.stdout.startswith(READ):
        return np.frombuffer(done.stdout, offset=len(READ)).reshape(-1, 3, 3)
    told = printable(shortened(done.stdout.decode("utf-8", "replace")))
    bounds = f"{LIMITS.seconds:g} s or {LIMITS.memory / 2**30:g} GiB"
    raise ValueProblem(f"{path}: {told or f'it takes more than {bounds} to read'}", hint="save it as STL")


def _scene(path: Path) -> Any:
    """What the JSON of a file holds. Raises ValueProblem."""
    data = path.read_bytes()
    if path.suffix.lower() == ".glb":
        if data[:4] != b"glTF" or data[4:8] != b"\2\0\0\0" or data[16:JSON_AT] != b"JSON":
            raise ValueProblem("expected a head with `glTF`, the version 2, and `JSON`")
        data = data[JSON_AT : JSON_AT + int.from_bytes(data[12:16], "little")]
    try:
        return json.loads(data.decode())
    except json.JSONDecodeError as error:
        raise ValueProblem(f"not JSON in line {error.lineno}: {error.msg}") from None
    except UnicodeDecodeError:
        raise ValueProblem("not JSON: there are bytes that are no UTF-8") from None


def _passed_over(scene: Any) -> Iterator[str]:
    """What trimesh passes over in a scene, or takes for something else, and what is not in the format."""
    nodes, accessors = scene.get("nodes", []), scene.get("accessors", [])
    yield from _below_zero(scene, "")
    for name in scene.get("extensionsRequired", []):
        if not name.startswith(APPEARANCE):
            yield f"the extension {shown(name)}"
    roots = scene.get("scenes", [{}])[scene.get("scene", 0)].get("nodes", [])
    parents = Counter([*roots, *(child for node in nodes for child in node.get("children", []))])
    for number, node in enumerate(nodes):
        found = {
            "a skin": "skin" in node,
            "weights of shapes": any(node.get("weights", [])),
            "a mesh in several places": COPIES in node.get("extensions", {}),
            "a camera beside other things": "camera" in node and bool(node.keys() & {"mesh", "children"}),
            "several parents": parents[number] > 1,
            "a matrix of no frame": node.get("matrix", UNMOVED)[3::4] != UNMOVED[3::4],
            "a rotation of zero": not any(node.get("rotation", [1])),
            "a frame without numbers": not _are_numbers(node, "matrix", *FRAME),
            "a matrix beside a frame": "matrix" in node and bool(node.keys() & FRAME),
        }
        yield from (f"{what} of node {number}" for what, is_there in found.items() if is_there)
    for number, mesh in enumerate(scene.get("meshes", [])):
        if any(mesh.get("weights", [])):
            yield f"weights of shapes of mesh {number}"
        for part in mesh["primitives"]:
            places, indices = accessors[part["attributes"]["POSITION"]], part.get("indices")
            data = [places] if indices is None else [places, accessors[indices]]
            found = {
                "triangles that are a fan": part.get("mode", 4) not in range(6),
                "sparse data": any("sparse" in each or "bufferView" not in each for each in data),
                "places in units of a type": places.get("normalized", False),
                "places of another type": places["type"] != "VEC3" or places["componentType"] == LONG,
                "indices with a sign": indices is not None and data[1]["componentType"] not in INDICES,
            }
            yield from (f"{what} of mesh {number}" for what, is_there in found.items() if is_there)


def _are_numbers(node: Any, *keys: str) -> bool:
    """Whether the lists under these keys hold finite numbers only."""
    values = [each for key in keys for each in node.get(key, [])]
    return bool(np.isfinite(np.array(values, dtype=np.float64)).all())


def _below_zero(value: Any, key: str) -> Iterator[str]:
    """Numbers below zero, in a value and in all that it holds, where the format has none."""
    if isinstance(value, dict):
        for inner, each in value.items():
            yield from _below_zero(each, inner)
    elif isinstance(value, list):
        for each in value:
            yield from _below_zero(each, key)
    elif key in NATURAL and isinstance(value, int | float) and value < 0:
        yield f"{shown(value)} as `{key}`"


def _work(path: Path) -> bytes:
    """What the process writes: the triangles, or what is wrong."""

    class Beside(dict[str, bytes]):
        """The files in the folder of a scene, by the names that the scene has for them."""

        def __missing__(self, name: str) -> bytes:
            found = (path.parent / unquote(name)).resolve()
            if not found.is_relative_to(path.parent.resolve()):
                raise ValueProblem(f"{shown(name)} is not in its folder, and is not read")
            if not found.is_file() or found.stat().st_size > LARGEST:
                raise ValueProblem(f"{shown(name)}, expected a file of at most {LARGEST / 1e6:g} MB")
            return found.read_bytes()

    # Standard output stays open, and nothing else.
    confine(LIMITS, 1)
    try:
        for what in _passed_over(_scene(path)):
            return f"there is {what}, which trimesh does not read".encode()
        import trimesh  # which takes a second or two

        with path.open("rb") as file:
            kind = path.suffix[1:].lower()
            scene = trimesh.load_scene(file, file_type=kind, resolver=Beside(), process=False, validate=False)
        shown_as = [scene.graph.get(node)[1] for node in scene.graph.nodes_geometry]
        surfaces = [scene.geometry[name] for name in shown_as if hasattr(scene.geometry[name], "faces")]
        for surface in surfaces:
            last = surface.faces.max(initial=-1)
            if last >= len(surface.vertices):
                known = f"there are {len(surface.vertices):,}"
                raise ValueProblem(f"a face has the vertex {last:,} (counted from 0), and {known}")
        count = sum(len(surface.faces) for surface in surfaces)
        if count > MOST_TRIANGLES:
            return f"{count:,} triangles, expected at most {MOST_TRIANGLES:,}".encode()
        triangles = scene.to_mesh().triangles if surfaces else np.empty((0, 3, 3))
        return READ + np.asarray(triangles, dtype=np.float64).tobytes()
    except ValueProblem as problem:
        return problem.message.encode()
    except Exception as error:  # noqa: BLE001 - whatever it is, nothing can be made of the file
        return f"trimesh cannot read it: {type(error).__name__}: {error}".encode()


if __name__ == "__main__":
    sys.stdout.buffer.write(_work(Path(sys.argv[1])))
    sys.stdout.flush()
