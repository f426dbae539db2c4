"""Surfaces from PLY and GLB, which trimesh reads in a confined process, as the files are untrusted.

The process may read files and do nothing else, and its time and memory are bounded.
trimesh takes some things for others without a word, such as a skin. They are refused here.

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

from rigidcli.bodies.surfaces import require_indices
from rigidcli.core import memory
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, printable, shortened, shown
from rigidcli.sandbox import Limits, confine

# The time that reading may take (s), and so much more a megabyte: trimesh loads in one or two seconds.
SECONDS, PER_MEGABYTE = 30.0, 1.0
TIMES_THE_FILE = 40  # the memory that trimesh may take beyond a gigabyte, in units of the size of the file
# Beginnings of the names of extensions that leave a surface where it is.
APPEARANCE = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_")
# Keys of a scene, at any depth, that move a surface or repeat it, and that trimesh passes over.
PASSED_OVER = ("skin", "weights", "sparse", "EXT_mesh_gpu_instancing")
READ = b"triangles\n"  # the first bytes of the answer of the process, where the file could be read


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
    size = path.stat().st_size
    room = min(2**30 + TIMES_THE_FILE * size, memory.available())
    confine(Limits(memory=int(room)), 1)  # standard output stays open, and nothing else
    try:
        kind = path.suffix[1:].lower()
        for what in _passed_over(path.read_bytes()) if kind == "glb" else ():
            return f"there is {shown(what)}, which trimesh does not read".encode()
        import trimesh  # which takes a second or two

        with path.open("rb") as file:
            scene = trimesh.load_scene(file, file_type=kind, process=False, validate=False)
        shown_as = [scene.graph.get(node)[1] for node in scene.graph.nodes_geometry]
        surfaces = [scene.geometry[name] for name in shown_as if hasattr(scene.geometry[name], "faces")]
        for surface in surfaces:
            require_indices(surface.faces, len(surface.vertices), path)
        faces = scene.to_mesh().triangles if surfaces else np.empty((0, 3, 3))
        return READ + np.asarray(faces, dtype=np.float64).tobytes()
    except ValueProblem as problem:
        return problem.message.removeprefix(f"{path}: ").encode()
    except MemoryError:
        return b""
    except Exception as error:  # noqa: BLE001 - whatever it is, nothing can be made of the file
        return f"trimesh cannot read it: {type(error).__name__}: {error}; is it cut or damaged?".encode()


def _passed_over(data: bytes) -> Iterator[str]:
    """The words in a .glb file for what trimesh passes over, or takes for something else."""
    # Behind a head of 12 bytes stand the length of the scene in JSON, four bytes for its kind, and the scene.
    scene = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    yield from (name for name in scene.get("extensionsRequired", []) if not name.startswith(APPEARANCE))
    if any("camera" in node and node.keys() & {"mesh", "children"} for node in scene.get("nodes", [])):
        yield "camera"
    for key, value in _entries(scene):
        if key in PASSED_OVER:
            yield key
        elif (key, value) == ("mode", 6):
            yield "TRIANGLE_FAN"


def _entries(value: Any) -> Iterator[tuple[str, Any]]:
    for entry in value if isinstance(value, list) else ():
        yield from _entries(entry)
    for key, entry in value.items() if isinstance(value, dict) else ():
        yield key, entry
        yield from _entries(entry)


if __name__ == "__main__":
    sys.stdout.buffer.write(_work(Path(sys.argv[1])))
    sys.stdout.flush()
