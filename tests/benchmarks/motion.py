"""`rigidcli euler -f csv` beside scripts that integrate the same motion with scipy and with heyoka.

    python tests/benchmarks/motion.py [RUNS]

Prints, for each job, the median of RUNS (default 5) runs of whole commands, start-up and csv included, in
turn, and the ratio of rigidcli to each peer (tests/benchmarks/integrators.py). Where scipy would take minutes
it is run over a part of the span and of the samples, start-up apart, and its time scaled up: marked by *.
"""

import importlib.util
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).parent
DOCUMENTS = {
    "free": "body: {moments: [1, 2, 2.5]}\nabout: com\nmotion: {omega: [0.3, 0.5, 0.9], %s}\n",
    "top": "body: {shape: cone, radius: 2.5 cm, height: 10 cm, mass: 100 g}\n"
    "top: {spin: 1800 rpm, tilt: 30 deg, gravity: 9.8}\nmotion: {%s}\n",
    "box": "body: {moments: [28, 25, 20], mass: 6, com: [0.1, 0.2, 0.3], given_about: origin}\n"
    "motion: {omega: [0.5, 2, -0.3], orientation: {axis: [1, 0, 0], angle: 2}, torque: {gravity: 5}, %s}\n",
}
JOBS = (  # title, system, duration, samples, part of it for scipy, engine
    ("free, 1e4 turns, 1e5 samples", "free", 58_591.6, 100_001, 100, "auto"),
    ("heavy top, 10 s, 1,001 samples", "top", 10.0, 1001, 1, "auto"),
    ("heavy top, 1,000 s, 1,001 samples", "top", 1000.0, 1001, 50, "auto"),
    ("the same, integrated", "top", 10.0, 1001, 1, "runge-kutta"),
    ("hanging box, 100 s, 1,001 samples", "box", 100.0, 1001, 1, "runge-kutta"),
    ("hanging box, 5,000 s, 1,001 samples", "box", 5000.0, 1001, 50, "runge-kutta"),
    ("the same, with heyoka", "box", 5000.0, 1001, 50, "auto"),
)


def seconds(*words: str) -> float:
    """How long a whole command takes."""
    begin = time.perf_counter()
    subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begin


def scipy_seconds(system: str, duration: float, samples: int, part: int) -> float:
    """The time of the scipy script, scaled up from a part of the span."""
    script = str(HERE / "integrators.py")
    if part == 1:
        return seconds(script, "scipy", system, str(duration), str(samples))
    idle = seconds("-c", "import numpy, scipy.integrate")
    few = str(max(2, samples // part))
    return idle + part * (seconds(script, "scipy", system, str(duration / part), few) - idle)


def main() -> None:
    """Run all comparisons."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    heyoka = importlib.util.find_spec("heyoka") is not None
    print(f"{'':38} {'rigidcli':>9} {'scipy':>10} {'ratio':>6} {'heyoka':>10} {'ratio':>6}")
    with tempfile.TemporaryDirectory() as folder:
        for title, system, duration, samples, part, engine in JOBS:
            file = Path(folder) / "motion.yaml"
            file.write_text(DOCUMENTS[system] % f"duration: {duration}, samples: {samples}")
            times: list[list[float]] = [[], [], []]
            for _ in range(runs):
                command = ("-m", "rigidcli", "euler", "-q", "-f", "csv", "--engine", engine, str(file))
                times[0].append(seconds(*command))
                times[1].append(scipy_seconds(system, duration, samples, part))
                if heyoka:
                    words = (str(HERE / "integrators.py"), "heyoka", system, str(duration), str(samples))
                    times[2].append(seconds(*words))
            ours, peer = (statistics.median(column) for column in times[:2])
            scaled = " " if part == 1 else "*"
            line = f"{title:38} {ours:7.2f} s {peer:8.2f} s{scaled}{ours / peer:6.3f}"
            if heyoka:
                other = statistics.median(times[2])
                line += f" {other:8.2f} s {ours / other:6.2f}"
            print(line, flush=True)


if __name__ == "__main__":
    main()
