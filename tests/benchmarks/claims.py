"""What the README claims on speed: each job with its peer, and how to run both."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

CONFIGS = Path(__file__).resolve().parents[2] / "configs"

IDLE = ("-c", "import numpy, scipy.integrate")
"""What a peer takes that has nothing to do."""


@dataclass(frozen=True, slots=True)
class Claim:
    """A job beside a peer: the arguments of `rigidcli` and those of Python, with {n} for its `size`.

    `make` is what make.py makes of the size, and `quick` a size that takes no time. Where all of the job
    would take minutes, the peer does {part} of it, one of `parts`, and its time beyond IDLE is multiplied.
    `each` tells what one of many in a job takes. `needs` are modules of the peer.
    `without` is a module that `rigidcli` does not find in this job, as if it were not installed.
    """

    name: str
    job: str
    beside: str
    ours: str
    theirs: str
    size: int = 1
    quick: int = 1
    make: str = ""
    needs: tuple[str, ...] = ()
    parts: int = 1
    each: bool = False
    without: str = ""


FREE = "`euler -f csv`, free body, 10^4 turns, 10^5 samples"

CLAIMS = (
    Claim(
        "document",
        "`axes -f json`, a document",
        "a bare script with numpy, yaml and pydantic",
        "axes -f json @files.txt",
        "peers/axes.py files.txt",
        make="documents",
    ),
    Claim(
        "documents",
        "`axes -f json`, 2,000 documents in a call",
        "the same script",
        "axes -f json @files.txt",
        "peers/axes.py files.txt",
        size=2000,
        quick=2,
        make="documents",
    ),
    Claim(
        "sweep",
        "`precess -f csv`, 10^4 spins of a top by `--sweep`",
        "a script with numpy and scipy.special",
        f"precess -q -f csv --sweep top.spin=10:700:{{n}} {CONFIGS}/cone_top.yaml",
        "peers/sweep.py 10 700 {n}",
        size=10_000,
        quick=3,
    ),
    Claim(
        "points",
        "`inertia`, 10^7 point masses (.npy, 320 MB)",
        "one blocked matrix product over the file",
        "inertia -f json cloud.yaml",
        "peers/points.py cloud.npy",
        size=10_000_000,
        quick=10,
        make="points",
    ),
    Claim(
        "mesh",
        "`inertia`, mesh of 1.3 million triangles (STL, 65 MB)",
        "trimesh: load, mass, moments",
        "inertia -f json ball.yaml",
        "-c 'import trimesh; m = trimesh.load(\"ball.stl\"); print(m.mass, m.moment_inertia)'",
        size=806,
        quick=8,
        make="ball",
        needs=("trimesh",),
    ),
    Claim(
        "free",
        FREE,
        "a script with heyoka",
        "euler -q -f csv motion.yaml",
        "peers/motion.py heyoka {part} {samples}",
        size=10_000,
        quick=10,
        make="free",
        needs=("heyoka",),
    ),
    Claim(
        "free-scipy",
        FREE,
        "a script with `solve_ivp` (DOP853, 1e-12), from a hundredth",
        "euler -q -f csv motion.yaml",
        "peers/motion.py scipy {part} {samples}",
        size=10_000,
        quick=100,
        make="free",
        parts=100,
    ),
    Claim(
        "top",
        "`euler -f csv`, heavy symmetric top, 1,000 s, 10^4 samples",
        "a script with heyoka",
        "euler -q -f csv top.yaml",
        "peers/heyoka_top.py {part} {samples}",
        size=1000,
        quick=1,
        make="heavy",
        needs=("heyoka",),
    ),
    Claim(
        "ensemble",
        "`euler -f csv`, 10^4 free bodies, 100 s, 100 samples",
        "heyoka's batch integration, and csv",
        "euler -q -f csv -j 1 ensemble.yaml",
        "peers/ensemble.py starts.csv",
        size=10_000,
        quick=4,
        make="starts",
        needs=("heyoka",),
    ),
    Claim(
        "hamilton",
        "`hamilton`, double pendulum",
        "`import sympy` alone",
        "hamilton -q pendulum.yaml",
        "-c 'import sympy'",
        make="pendulum",
        needs=("sympy",),
    ),
    Claim(
        "orbit",
        "`hamilton -f csv`, its orbit of 1,000 s, 10^4 samples",
        "a script with heyoka, H by hand",
        "hamilton -q -f csv orbit.yaml",
        "peers/heyoka_pendulum.py {part} {samples}",
        size=1000,
        quick=1,
        make="pendulum",
        needs=("heyoka",),
    ),
    Claim(
        "orbit-alone",
        "`hamilton -f csv`, the same orbit without heyoka",
        "a script with sympy and `solve_ivp` (DOP853, 1e-12)",
        "hamilton -q -f csv orbit.yaml",
        "peers/sympy_pendulum.py {part} {samples}",
        size=1000,
        quick=1,
        make="pendulum",
        needs=("sympy",),
        without="heyoka",
    ),
    Claim(
        "check",
        "`check`, an answer file of 6 questions, of 300",
        "starting Python and `import numpy`",
        "check -f json assignment.yaml answers",
        "-c 'import numpy'",
        size=300,
        quick=2,
        make="classroom",
        each=True,
    ),
)
"""What the README claims, in its order."""
