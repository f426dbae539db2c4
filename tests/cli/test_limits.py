"""What would take too long, or too much memory: a refusal that says so and how far it came, and progress."""

from __future__ import annotations

import io
import re
import resource
import subprocess
import sys
import time
import timeit
from functools import partial
from importlib.util import find_spec

import pytest

from rigidcli.cli.output import counted, progress
from rigidcli.core import memory
from tests.conftest import ROOT, Outcome, Program

BOX = "body: {shape: box, size: [1, 2, 3], mass: 1}\n"
PENDULUM = "system: {coordinates: [a], lagrangian: 'adot**2/2 + cos(a)'}\n"
SWING = PENDULUM + "orbit: {initial: {a: 1, p_a: 0}, duration: 100}"
FREE = BOX + "motion: {omega: [1, 0.1, 0.2], duration: 100}"


def driven(torque: str) -> str:
    return BOX + f"motion: {{omega: [1, 0.1, 0.2], torque: {torque}, duration: 1000}}"


PUMPED = {
    "a torque along space": ("euler", driven('{space: ["-2*w1", 0, 0]}')),
    "a stiff spring": (
        "hamilton",
        """
system: {coordinates: [x], lagrangian: "xdot**2/2 - 1e12*x**2/2 - x**4"}
orbit: {initial: {x: 1, p_x: 0}, duration: 60}
""",
    ),
    "a mass that vanishes": (
        "hamilton",
        """
system: {coordinates: [x], lagrangian: "exp(-t/2)*xdot**2/2 - exp(t/2)*x**2/2"}
orbit: {initial: {x: 1, p_x: 0}, duration: 60}
""",
    ),
}


@pytest.mark.parametrize("case", PUMPED.values(), ids=PUMPED.keys())
def test_what_needs_too_many_steps_is_refused_in_seconds(case: tuple[str, str], program: Program) -> None:
    command, document = case
    pace = timeit.timeit("for i in range(10**6): i * 1.5", number=1, timer=time.process_time)
    begin = time.process_time()
    outcome = program(command, "-f", "csv", "-", stdin=document)
    assert time.process_time() - begin < 300 * pace  # some 10 s
    assert (outcome.code, outcome.out) == (4, "")
    assert "needs more than 1,000,000 steps" in outcome.err
    assert "have come to t = " in outcome.err
    assert "shorter span or a larger `tolerance`" in outcome.err
    assert "rigidcli[taylor]" in outcome.err or find_spec("heyoka")


def bounded(*arguments: str, stdin: str, megabytes: int) -> Outcome:
    """The program in a process that may have so much memory."""
    limit = megabytes * 2**20
    done = subprocess.run(
        [sys.executable, "-m", "rigidcli", *arguments],
        input=stdin,
        cwd=ROOT,
        capture_output=True,
        text=True,
        preexec_fn=partial(resource.setrlimit, resource.RLIMIT_AS, (limit, limit)),
        check=False,
    )
    return Outcome(done.returncode, done.stdout, done.stderr)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells how much a process has")
@pytest.mark.parametrize(
    ("command", "document", "key"), [("euler", FREE, "motion"), ("hamilton", SWING, "orbit")]
)
def test_samples_need_memory_which_is_told_before_it_is_asked_for(
    command: str, document: str, key: str
) -> None:
    many, few = (
        bounded(command, "-f", "csv", "-s", f"{key}.samples={count}", "-", stdin=document, megabytes=600)
        for count in (9_000_000, 1000)
    )
    assert (many.code, few.code) == (4, 0), few.err
    assert "9,000,000 samples need about " in many.err
    assert " GB of memory, and " in many.err
    assert "hint: ask for fewer samples" in many.err


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells how much a process has")
def test_the_estimate_is_no_less_than_what_is_taken() -> None:
    """Where the estimate just allows the samples, they are written."""
    samples = 150_000
    for command, document, key, columns in (("euler", FREE, "motion", 18), ("hamilton", SWING, "orbit", 4)):
        needed = samples * columns * memory.BYTES_OF_A_NUMBER / 2**20
        limit = int(250 + needed)
        words = (command, "-f", "csv", "-s", f"{key}.samples={samples}", "-")
        outcome = bounded(*words, stdin=document, megabytes=limit)
        assert outcome.code == 0, outcome.err
        assert outcome.out.count("\n") == samples + 1


@pytest.mark.parametrize("place", ["rigidcli.studies.axes.run", "rigidcli.render.csv.render"])
def test_too_little_memory_anywhere_is_no_internal_error(
    place: str, program: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*arguments: object, **options: object) -> None:
        raise MemoryError

    module, _, name = place.rpartition(".")
    __import__(module)
    monkeypatch.setattr(sys.modules[module], name, full)
    outcome = program("axes", "-f", "csv", "-", stdin=BOX)
    assert (outcome.code, outcome.out) == (4, "")
    assert "there is too little memory" in outcome.err
    assert "hint:" in outcome.err


class Terminal(io.StringIO):
    """A stand-in for a terminal."""

    def isatty(self) -> bool:
        return True


def test_a_terminal_is_told_that_the_work_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    with progress(pulse=0.01) as show:
        time.sleep(0.1)
        assert " 0 s\r" in terminal.getvalue()
        show(0.5)
        time.sleep(0.1)
    shown = terminal.getvalue()
    assert " 50% 0 s of about 0 s\r" in shown
    assert shown.endswith(" \r")
    time.sleep(0.05)
    assert terminal.getvalue() == shown


def test_nothing_else_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", file := io.StringIO())
    with progress(pulse=0.01) as show:
        show(0.5)
        time.sleep(0.05)
    assert file.getvalue() == ""


@pytest.mark.parametrize(
    ("total", "shares", "told"),
    [
        (2, [0.25, 0.25, 0.5, 1], ["12%", "25%", "50%"]),  # four blocks of an ensemble, and another file
        (1, [0.004, 0.004, 0.004], ["1%"]),  # less than a percent each
        (1, [1], []),
    ],
)
def test_each_further_percent_is_told(
    monkeypatch: pytest.MonkeyPatch, total: int, shares: list[float], told: list[str]
) -> None:
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    with counted(total) as done:
        for share in shares:
            done(share)
    assert re.findall(r"\d+%", terminal.getvalue()) == told


def test_a_terminal_is_told_how_long_all_of_it_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    clock = iter([100.0, 110.0, 118.0, 120.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    with progress() as show:
        for share in (0.25, 0.5, 0.5):
            show(share)
    assert [line.strip() for line in terminal.getvalue().split("\r") if line.strip()] == [
        "25% 10 s of about 40 s",
        "50% 18 s of about 36 s",
        "50% 20 s of about 40 s",
    ]
