"""rigidcli beside bare code for the same jobs.

    python tests/benchmarks/compare.py [RUNS]

Prints, for each job, the median of RUNS (default 15) runs of both in turn, and their ratio. Documents are
worked by whole commands, start-up included, beside `bare_axes.py`, a sweep beside `bare_sweep.py`; points
inside this process, beside one matrix product a block. The files (2,000 documents, and 320 MB of points) are
made in a temporary directory.
"""

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rigidcli import loads

HERE = Path(__file__).parent
DOCUMENT = "name: cube {0}\nbody: {{shape: cube, side: 1.{0}, mass: 12, anchor: corner}}\n"


def seconds(job: Callable[[], object]) -> float:
    """How long a job takes."""
    start = time.perf_counter()
    job()
    return time.perf_counter() - start


def command(*words: str) -> Callable[[], object]:
    """A whole command as a job, its output thrown away."""
    return lambda: subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)


def row(title: str, ours: Callable[[], object], bare: Callable[[], object], runs: int) -> None:
    """Print the medians of both jobs, run in turn, and their ratio."""
    ours(), bare()
    pairs = [(seconds(ours), seconds(bare)) for _ in range(runs)]
    mine, other = (statistics.median(column) for column in zip(*pairs, strict=True))
    print(f"{title:36} {mine * 1e3:7.0f} ms {other * 1e3:7.0f} ms  ratio {mine / other:.2f}", flush=True)


def main() -> None:
    """Run all comparisons."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 15
    rigidcli = ("-m", "rigidcli", "axes", "-f", "json")
    bare = str(HERE / "bare_axes.py")
    print(f"{'':36} {'rigidcli':>10} {'bare':>10}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = [folder / f"{number}.yaml" for number in range(1, 2001)]
        for number, file in enumerate(files, start=1):
            file.write_text(DOCUMENT.format(number))
        paths = [str(file) for file in files]
        row("one document", command(*rigidcli, paths[0]), command(bare, paths[0]), runs)
        row("2,000 documents in one call", command(*rigidcli, *paths), command(bare, *paths), runs)

        swept = ("--sweep", "top.spin=10:700:10000", str(HERE.parents[1] / "configs" / "cone_top.yaml"))
        sweep = command("-m", "rigidcli", "precess", "-q", "-f", "csv", *swept)
        row("10,000 spins of a top", sweep, command(str(HERE / "bare_sweep.py"), "10", "700", "10000"), runs)

        cloud = folder / "cloud.npy"
        np.save(cloud, np.random.default_rng(1).random((10**7, 4)))
        text = "body: {points: cloud.npy}"
        row("10^7 points from .npy", lambda: loads(text, folder=folder), lambda: product(cloud), runs)


def product(path: Path) -> NDArray[np.float64]:
    """The sums of m^2, m^2 r and m r r^T over the points of a mapped file: one matrix product a block."""
    points = np.load(path, mmap_mode="r")
    total = np.zeros((4, 4))
    for start in range(0, len(points), 65_536):
        block = points[start : start + 65_536]
        total += block.T @ (block[:, :1] * block)
    return total


if __name__ == "__main__":
    main()
