"""How long `rigidcli check` takes for a class: 300 answer files of 6 questions, with all that it costs.

    python tests/benchmarks/check.py [RUNS]

Prints the median of RUNS (default 3) whole commands in milliseconds a file, with one file judged at a time
and two; and, beside them, what Python needs to start and load numpy, which is the least that a process of its
own for each file would cost if it were not a fork.
"""

import random
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
FILES = 300

ASSIGNMENT = f"""
questions:
  tensor: {{document: {ROOT}/configs/three_masses.yaml, ask: inertia.tensor, points: 3}}
  axes: {{document: {ROOT}/configs/three_masses.yaml, ask: axes, points: 4, normalized: optional}}
  rate: {{document: {ROOT}/configs/cone_top.yaml, ask: precess.top.gyroscopic_rate}}
  fall: {{document: {ROOT}/configs/taylor_13_02.yaml, ask: hamilton.hamiltonian}}
  pendulums: {{document: {ROOT}/configs/double_pendulum.yaml, ask: hamilton.hamiltonian}}
  spring: {{document: {ROOT}/configs/notes_spring.yaml, ask: hamilton.equations}}
"""

PENDULUMS = (
    "((m1 + m2)*l1**2*p_theta2**2 + m2*l2**2*p_theta1**2"
    " - 2*m2*l1*l2*p_theta1*p_theta2*cos(theta1 - theta2))"
    "/(2*m2*l1**2*l2**2*(m1 + m2*sin(theta1 - theta2)**2))"
    " - (m1 + m2)*g*l1*cos(theta1) - m2*g*l2*cos(theta2)"
)

ANSWERS = {
    "tensor": ["[[10, 0, 0], [0, 6, 1], [0, 1, 6]]", "[[10, 0, 0], [0, 6, -1], [0, -1, 6]]"],
    "axes": [
        "[{moment: 5, axis: [0, 1, -1]}, {moment: 7, axis: [0, 1, 1]}, {moment: 10, axis: [1, 0, 0]}]",
        "[{moment: 7, axis: [0, 1, -1]}, {moment: 5, axis: [0, 1, 1]}, {moment: 10, axis: [1, 0, 0]}]",
    ],
    "rate": ["20.8 rad/s", "20.8 rpm"],
    "fall": ["p_x**2/(2*m) - m*g*x", "p_x**2/(2*m) + m*g*x"],
    "pendulums": [
        PENDULUMS,
        "p_theta1**2/(2*m1*l1**2) - m1*g*l1*cos(theta1)",
    ],
    "spring": ["{xdot: p_x/m, p_xdot: -k*x}", "[m*xddot = k*x]"],
}


def write_class(folder: Path) -> None:
    """An assignment, and the answers of a class that has about a fifth wrong."""
    chance = random.Random(1)
    (folder / "assignment.yaml").write_text(ASSIGNMENT)
    (folder / "answers").mkdir()
    for number in range(FILES):
        lines = [f"  {id}: {texts[chance.random() < 0.2]}\n" for id, texts in ANSWERS.items()]
        (folder / "answers" / f"student{number:03}.yaml").write_text("answers:\n" + "".join(lines))


def seconds(*words: str, code: int = 0) -> float:
    """How long a whole command takes."""
    begin = time.perf_counter()
    done = subprocess.run([sys.executable, *words], stdout=subprocess.DEVNULL, check=False)
    assert done.returncode == code, done
    return time.perf_counter() - begin


def main() -> None:
    """Measure, in turn."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_class(folder)
        command = ["-m", "rigidcli", "check", f"{folder}/assignment.yaml", f"{folder}/answers", "-f", "json"]
        times: dict[str, list[float]] = {"-j 2": [], "-j 1": [], "python -c 'import numpy'": []}
        for _ in range(runs):
            for jobs in (1, 2):
                times[f"-j {jobs}"].append(seconds(*command, "-j", str(jobs), code=1) / FILES)
            times["python -c 'import numpy'"].append(seconds("-c", "import numpy"))
        for what, each in times.items():
            print(f"{what:26} {1000 * statistics.median(each):6.1f} ms a file")


if __name__ == "__main__":
    main()
