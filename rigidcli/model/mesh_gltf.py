"""Surfaces from glTF, which trimesh reads in a process of its own, as the files are untrusted.

A scene of glTF is a tree of things in frames, each of which refers to pieces of data, also in other files.
The process is confined to a few seconds, a bound of memory, to reading, and to the folder of the file.

3MF and COLLADA are not read, though trimesh has readers for them: of an object that is repeated within
others (3MF), that reader leaves copies out without a word, and numbers that are none become zeros (COLLADA).
"""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, printable, shortened, shown
from rigidcli.model.mesh_formats import MOST_TRIANGLES
from rigidcli.sandbox import Limits, confine

LIMITS = Limits(seconds=6.0)
"""What reading may take, of which it takes one or two seconds to load trimesh."""

LATEST = 60.0
"""Seconds after which a process is late that has not ended by itself: others may need the processor."""

LARGEST = 32_000_000
"""The largest file (bytes) that belongs to a scene."""

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


def _work(path: Path) -> bytes:
    """What the process writes: the triangles, or what is wrong."""
    import trimesh

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
        with path.open("rb") as file:
            kind = path.suffix[1:].lower()
            scene = trimesh.load_scene(file, file_type=kind, resolver=Beside(), process=False, validate=False)
        shown_as = [scene.graph.get(node)[1] for node in scene.graph.nodes_geometry]
        surfaces = [scene.geometry[name] for name in shown_as if hasattr(scene.geometry[name], "faces")]
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
