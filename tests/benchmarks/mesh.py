"""A mesh of 1.3 million triangles: the whole command against trimesh's load and mass properties.

    python mesh.py [PAIRS]

Prints the seconds of processor time of each run, in turn, then the medians and their ratio; and the peak of
memory above that of an interpreter with numpy, in units of the file.
"""

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

TURNS = 806
FACET = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
PEER = "import sys, trimesh; m = trimesh.load(sys.argv[1]); print(m.mass, m.moment_inertia)"


def ball() -> np.ndarray:
    """Triangles (n, 3, 3) of a unit ball, from pole to pole, with equal vertices where they meet."""
    theta, phi = np.linspace(0, np.pi, TURNS + 3), 2 * np.pi * np.arange(TURNS) / TURNS
    radius = np.sin(theta)
    radius[[0, -1]] = 0
    x, y = radius[:, None] * np.cos(phi), radius[:, None] * np.sin(phi)
    points = np.stack([x, y, np.cos(theta)[:, None] * np.ones(TURNS)], axis=2)
    a, b = points[:-1], points[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    return np.concatenate([np.stack([a, b, c], 2)[:-1], np.stack([a, c, d], 2)[1:]]).reshape(-1, 3, 3)


def run(*arguments: str) -> tuple[float, int]:
    """Seconds of processor time, and the peak of memory in bytes, of one process."""
    with subprocess.Popen([sys.executable, *arguments], stdout=subprocess.DEVNULL) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0, arguments
    return used.ru_utime + used.ru_stime, 1024 * used.ru_maxrss


def write(path: Path) -> None:
    """Write the ball as binary STL: in a process of its own, as others inherit the peak of this one."""
    facets = np.zeros(len(ball()), FACET)
    facets["vertices"] = ball()
    path.write_bytes(b"ball".ljust(80) + len(facets).to_bytes(4, "little") + facets.tobytes())


if sys.argv[1:2] == ["--write"]:
    write(Path(sys.argv[2]))
    sys.exit()
with tempfile.TemporaryDirectory() as folder:
    path, document = Path(folder) / "ball.stl", Path(folder) / "ball.yaml"
    run(__file__, "--write", str(path))
    document.write_text("body: {mesh: ball.stl, density: 1000}\n")
    size = path.stat().st_size
    print(f"{(size - 84) // FACET.itemsize:,} triangles, {size / 1e6:.1f} MB")
    _, baseline = run("-c", "import numpy")
    ours, theirs, peaks = [], [], []
    for _ in range(int(sys.argv[1]) if len(sys.argv) > 1 else 3):
        seconds, peak = run("-m", "rigidcli", "axes", str(document), "-f", "json")
        ours.append(seconds)
        peaks.append(peak - baseline)
        theirs.append(run("-c", PEER, str(path))[0])
        print(f"rigidcli {ours[-1]:.2f} s, trimesh {theirs[-1]:.2f} s, memory {peaks[-1] / size:.2f} files")
    ratio = statistics.median(ours) / statistics.median(theirs)
    print(
        f"medians: {statistics.median(ours):.2f} s and {statistics.median(theirs):.2f} s, ratio {ratio:.3f}"
    )
