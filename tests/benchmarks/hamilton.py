"""`rigidcli hamilton` beside sympy, scipy and heyoka, as whole commands.

    python tests/benchmarks/hamilton.py [RUNS]

Prints the median time of RUNS (default 5) runs in turn, and the ratio of rigidcli to each peer: `import
sympy` alone; the usual way of sympy (solve for the velocities, simplify); lambdify with solve_ivp(DOP853,
1e-10); and a plain heyoka script. The orbit is a regular one of a double pendulum. Beside scipy, rigidcli
has no heyoka, and the line with heyoka is left out where it is not installed. heyoka keeps on disk what it
has compiled, so that its first run is not counted. Times are those of the processor.
"""

import importlib.util
import resource
import statistics
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

PENDULUM = """
system:
  coordinates: [a, b]
  kinetic: (m1 + m2)*l1**2*adot**2/2 + m2*l2**2*bdot**2/2 + m2*l1*l2*adot*bdot*cos(a - b)
  potential: -(m1 + m2)*g*l1*cos(a) - m2*g*l2*cos(b)
parameters: {m1: 1, m2: 0.6, l1: 1, l2: 0.7, g: 9.81}
"""
ORBIT = "orbit: {initial: {a: 0.8, b: 0.4, p_a: 0, p_b: 0}, duration: 1000, samples: 10001}\n"

SYMPY = """
    import sympy as sp
    m1, m2, l1, l2, g, a, b, va, vb, pa, pb = sp.symbols("m1 m2 l1 l2 g a b va vb pa pb")
    L = ((m1 + m2)*l1**2*va**2/2 + m2*l2**2*vb**2/2 + m2*l1*l2*va*vb*sp.cos(a - b)
         + (m1 + m2)*g*l1*sp.cos(a) + m2*g*l2*sp.cos(b))
    solved = sp.solve([pa - sp.diff(L, va), pb - sp.diff(L, vb)], [va, vb], dict=True)[0]
    H = (pa*va + pb*vb - L).subs(solved)
"""
USUAL = (
    SYMPY
    + """
    H = sp.simplify(H)
    print(H, [sp.simplify(e) for e in (sp.diff(H, pa), sp.diff(H, pb), -sp.diff(H, a), -sp.diff(H, b))])
"""
)
SCIPY = (
    SYMPY
    + """
    import sys
    import numpy as np
    from scipy.integrate import solve_ivp
    slopes = [sp.diff(H, pa), sp.diff(H, pb), -sp.diff(H, a), -sp.diff(H, b)]
    values = {m1: 1, m2: 0.6, l1: 1, l2: 0.7, g: 9.81}
    f = sp.lambdify((a, b, pa, pb), [e.subs(values) for e in slopes], cse=True)
    t = np.linspace(0, 1000, 10001)
    found = solve_ivp(lambda t, y: f(*y), (0, 1000), [0.8, 0.4, 0, 0], "DOP853", t, rtol=1e-10, atol=1e-10)
    np.savetxt(sys.stdout, np.column_stack([t, found.y.T]), delimiter=",")
"""
)
HEYOKA = """
    import sys
    import heyoka as hy
    import numpy as np
    a, b, pa, pb = hy.make_vars("a", "b", "pa", "pb")
    m1, m2, l1, l2, g = 1.0, 0.6, 1.0, 0.7, 9.81
    c, s = hy.cos(a - b), hy.sin(a - b)
    T = (m2*l2**2*pa**2 + (m1 + m2)*l1**2*pb**2 - 2*m2*l1*l2*pa*pb*c)/(2*m2*l1**2*l2**2*(m1 + m2*s**2))
    H = T - (m1 + m2)*g*l1*hy.cos(a) - m2*g*l2*hy.cos(b)
    slopes = [(a, hy.diff(H, pa)), (b, hy.diff(H, pb)), (pa, -hy.diff(H, a)), (pb, -hy.diff(H, b))]
    ta = hy.taylor_adaptive(slopes, [0.8, 0.4, 0.0, 0.0], compact_mode=True)
    t = np.linspace(0, 1000, 10001)
    found = ta.propagate_grid(t)[-1]
    np.savetxt(sys.stdout, np.column_stack([t, found]), delimiter=",")
"""


def chain(size: int) -> str:
    """Masses and springs in a row between two walls."""
    names = [f"x{i}" for i in range(1, size + 1)]
    kinetic = " + ".join(f"m*{name}dot**2/2" for name in names)
    ends = ["0", *names, "0"]
    potential = " + ".join(f"k*({a} - {b})**2/2" for a, b in pairwise(ends))
    return (
        f"system:\n  coordinates: [{', '.join(names)}]\n  kinetic: {kinetic}\n  potential: {potential}\n"
        "parameters: {m: 1, k: 1}\n"
    )


WITHOUT_HEYOKA = """
    import sys
    sys.modules["heyoka"] = None
    from rigidcli.__main__ import run
    run()
"""


def seconds(*words: str) -> float:
    """How long a whole command takes of the processor."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def script(text: str, *words: str) -> float:
    """How long a script takes."""
    return seconds("-c", textwrap.dedent(text), *words)


def main() -> None:
    """Run all comparisons."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    with tempfile.TemporaryDirectory() as folder:
        files = {}
        for name, text in (
            ("pendulum", PENDULUM),
            ("chain", chain(20)),
            ("orbit", PENDULUM + ORBIT),
        ):
            files[name] = Path(folder) / f"{name}.yaml"
            files[name].write_text(text)

        def ours(name: str, *options: str) -> float:
            return seconds("-m", "rigidcli", "hamilton", "-q", *options, str(files[name]))

        def alone() -> float:
            return script(WITHOUT_HEYOKA, "hamilton", "-q", "-f", "csv", str(files["orbit"]))

        jobs: list[tuple[str, Callable[[], float], Callable[[], float]]] = [
            ("double pendulum / import sympy", lambda: ours("pendulum"), lambda: script("import sympy")),
            ("chain of 20 / import sympy", lambda: ours("chain"), lambda: script("import sympy")),
            ("double pendulum / solve and simplify", lambda: ours("pendulum"), lambda: script(USUAL)),
            ("orbit of 1,000 s / scipy", alone, lambda: script(SCIPY)),
        ]
        if importlib.util.find_spec("heyoka") is not None:
            jobs.append(
                ("orbit of 1,000 s / heyoka", lambda: ours("orbit", "-f", "csv"), lambda: script(HEYOKA))
            )
            jobs[-1][1](), jobs[-1][2]()
        for title, mine, peer in jobs:
            times = [(mine(), peer()) for _ in range(runs)]
            a, b = (statistics.median(column) for column in zip(*times, strict=True))
            print(f"{title:38} {a:7.2f} s {b:7.2f} s {a / b:6.2f}", flush=True)


if __name__ == "__main__":
    main()
