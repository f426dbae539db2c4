"""Runs each claim on speed beside its peer, and writes the table beside this file and the rows of the README.

    python tests/benchmarks [--rows NAME,...] [--repeats N] [--quick] [--write]

Both are whole commands, each in a process of its own, and run in turn. Told are medians of processor time,
elapsed time and the peak of memory. What cannot be run is said, and keeps its older figures.
"""

from __future__ import annotations

import argparse
import os
import platform
import shlex
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
TABLE = HERE / "README.md"
"""The file with all rows."""
FRONT = ROOT / "README.md"
"""The project's README, which shows a few of them."""

# Python runs this folder as a program, and knows nothing of the package that it is in.
sys.path.insert(0, str(ROOT))
from tests.benchmarks.claims import CLAIMS, IDLE, Claim  # noqa: E402

HIDING = """
import importlib.util, sys
sys.modules[hidden] = None
assert importlib.util.find_spec(hidden) is None
from rigidcli.__main__ import run
run()
"""
"""Starts rigidcli as if the module named in `hidden` were not installed."""


class Cost(NamedTuple):
    """What a command takes: processor time (s), elapsed time (s), and the peak of memory (MB)."""

    processor: float
    elapsed: float
    memory: float

    def beyond(self, idle: Cost, times: int) -> Cost:
        """The cost where all but that of idling is had so many times."""
        rest, elapsed, _ = idle
        processor = rest + times * max(0.0, self.processor - rest)
        return Cost(processor, elapsed + times * max(0.0, self.elapsed - elapsed), self.memory)


def cost(words: Sequence[str], folder: Path, codes: Sequence[int] = (0,)) -> Cost:
    """What Python takes with these arguments in this folder, its children included.

    Raises ChildProcessError where it ends with another code.
    """
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    begin = time.perf_counter()
    with subprocess.Popen(
        [sys.executable, *words], cwd=folder, env=environment, stdout=subprocess.DEVNULL
    ) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    elapsed = time.perf_counter() - begin
    if process.returncode not in codes:
        raise ChildProcessError(f"this ended with {process.returncode}: python {shlex.join(words)}")
    unit = 1e6 if sys.platform == "darwin" else 1e6 / 1024
    return Cost(used.ru_utime + used.ru_stime, elapsed, used.ru_maxrss / unit)


def words(claim: Claim, size: int) -> tuple[list[str], list[str]]:
    """The arguments of Python for a claim: those of rigidcli, and those of the peer."""
    part = size // claim.parts
    ours, (first, *rest) = (
        shlex.split(text.format(n=size, part=part, samples=10 * part + 1))
        for text in (claim.ours, claim.theirs)
    )
    start = ["-c", f"hidden = {claim.without!r}{HIDING}"] if claim.without else ["-m", "rigidcli"]
    return [*start, *ours], [first if first == "-c" else str(HERE / first), *rest]


def measured(claim: Claim, repeats: int, quick: bool) -> tuple[Cost, Cost]:
    """The medians of both, run in turn."""
    size = claim.quick if quick else claim.size
    ours, theirs = words(claim, size)
    pairs = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if claim.make:
            cost([str(HERE / "make.py"), claim.make, str(size)], folder)
        for _ in range(repeats):
            mine, other = cost(ours, folder, (0, 1)), cost(theirs, folder)
            if claim.parts > 1:
                other = other.beyond(cost(IDLE, folder), claim.parts)
            if claim.each:
                mine = Cost(mine.processor / size, mine.elapsed / size, mine.memory)
            pairs.append((mine, other))
    return median([mine for mine, _ in pairs]), median([other for _, other in pairs])


def median(costs: Sequence[Cost]) -> Cost:
    """The median of each figure."""
    return Cost(*map(statistics.median, zip(*costs, strict=True)))


HEAD = "| job | beside | processor (s) | elapsed (s) | memory (MB) |"
RULE = "|---|---|---|---|---|"
BEGIN, END = "<!-- benchmarks -->", "<!-- end of benchmarks -->"
EARLIER = " (earlier)"
"""What stands after a figure of another run."""


def row(claim: Claim, mine: Cost, other: Cost) -> str:
    """The row of a claim: both figures and their ratio."""
    cells = [f"{a:.3g} / {b:.3g} = {a / b:.2g}" for a, b in zip(mine, other, strict=True)]
    return begun(claim) + f" {' | '.join(cells)} |"


def begun(claim: Claim) -> str:
    """How the row of a claim begins."""
    return f"| {claim.job} | {claim.beside} |"


def table(claims: Sequence[Claim], repeats: int, quick: bool, before: str) -> Iterator[str]:
    """The lines of the table: of the `claims` that can be run, and of all others as they were `before`."""
    yield from (HEAD, RULE)
    for claim in CLAIMS:
        found = (line for line in before.splitlines() if line.startswith(begun(claim)))
        old = next(found, f"{begun(claim)} not run | | |")
        missing = [name for name in claim.needs if find_spec(name) is None]
        if claim not in claims:
            yield old
            continue
        sys.stderr.write(f"{claim.name}: {claim.job}, beside {claim.beside}\n")
        try:
            if missing:
                raise ChildProcessError(f"{' and '.join(missing)} is not installed")
            yield row(claim, *measured(claim, repeats, quick))
        except ChildProcessError as reason:
            sys.stderr.write(f"{claim.name}: not run: {reason}\n")
            yield old if EARLIER in old else f"{old.removesuffix(' |')}{EARLIER} |"


def cut(text: str) -> tuple[str, str, str]:
    """What stands before the table in a text, the table, and what comes after it."""
    first, last = text.index(BEGIN) + len(BEGIN) + 1, text.index(END)
    return text[:first], text[first:last], text[last:]


def front(lines: Sequence[str]) -> list[str]:
    """The lines of the table that stand in the project's README."""
    return [*lines[:2], *(line for line, claim in zip(lines[2:], CLAIMS, strict=True) if claim.front)]


def write(path: Path, lines: Sequence[str]) -> None:
    """Put the lines in the place of the table in a file."""
    before, _, after = cut(path.read_text())
    path.write_text(before + "\n".join(lines) + "\n" + after)


def main() -> None:
    """Run what is asked for, and print the table."""
    parser = argparse.ArgumentParser(prog="python tests/benchmarks", description=__doc__.partition("\n")[0])
    names = ", ".join(claim.name for claim in CLAIMS)
    parser.add_argument("--rows", metavar="NAME,...", help=f"only these: {names}")
    parser.add_argument("--repeats", type=int, default=5, metavar="N", help="runs of each (default 5)")
    parser.add_argument("--quick", action="store_true", help="small jobs, once: do they start?")
    parser.add_argument("--write", action="store_true", help="write the table and the rows of the README")
    given = parser.parse_args()
    chosen = [claim.name for claim in CLAIMS] if given.rows is None else given.rows.split(",")
    if unknown := {*chosen} - {claim.name for claim in CLAIMS}:
        parser.error(f"no rows: {', '.join(sorted(unknown))}; there are {names}")
    if given.repeats < 1 or (given.quick and given.write):
        parser.error("expected at least one repeat, and for --write no --quick")
    claims = [claim for claim in CLAIMS if claim.name in chosen]
    before = cut(TABLE.read_text())[1]
    lines = []
    for line in table(claims, 1 if given.quick else given.repeats, given.quick, before):
        print(line, flush=True)
        lines.append(line)
    if given.write:
        write(TABLE, lines)
        write(FRONT, front(lines))
    sys.stderr.write(f"Python {platform.python_version()}, {os.cpu_count()} cores\n")


if __name__ == "__main__":
    main()
