"""`--jobs tcp://host:port`: workers of a cluster give the bytes of one process, also when one is killed."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from importlib import util
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest

from tests.conftest import ROOT, Outcome, Program

TOP = "configs/cone_top.yaml"
SWEEP = ("inertia", "-q", "-f", "json", "--sweep", "body.scale=-1:5:300", "configs/bracket.yaml")
"""A sweep of which some values are refused, and whose rows are several times what a pipe holds.

A mesh is worked value by value, so that there are many tasks.
"""

LIMIT = 60.0
"""Seconds within which every sign must come."""

needs_folders = pytest.mark.skipif(
    any(util.find_spec(name) is None for name in ("distributed", "pyarrow")),
    reason="distributed or pyarrow is not installed",
)
needs_dask = pytest.mark.skipif(util.find_spec("distributed") is None, reason="distributed is not installed")


def environment() -> dict[str, str]:
    """That of processes which load this very package; none waits half a minute for a worker that is gone."""
    here = {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    return {**os.environ, **here, "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "3s"}


class Cluster:
    """A scheduler and its workers, each a process on this machine; what they say goes to files."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self._folder = folder
        self._stack = stack
        said = folder / "scheduler"
        self._found = ("--scheduler-file", str(said), "--no-dashboard")
        address = ("--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0")
        self.scheduler = self._start("dask_scheduler", "scheduler.log", *address, *self._found)
        # It loads while the scheduler does, and waits for its file.
        self.worker("first")
        told = json.loads(said.read_text())
        self.address: str = told["address"]
        self._counts = f"http://127.0.0.1:{told['services']['dashboard']}/json/counts.json"

    def tasks(self) -> int:
        """How many tasks the scheduler knows."""
        with urlopen(self._counts) as answer:
            return int(json.load(answer)["tasks"])

    def worker(self, name: str) -> subprocess.Popen[bytes]:
        """One more worker, which is ready."""
        log = f"{name}.log"
        place = ("--local-directory", str(self._folder / name))
        options = ("--no-nanny", "--nthreads", "1", *place)
        process = self._start("dask_worker", log, *self._found, *options)
        wait_for(lambda: "Registered to" in (self._folder / log).read_text())
        return process

    def _start(self, program: str, log: str, *arguments: str) -> subprocess.Popen[bytes]:
        with (self._folder / log).open("wb") as file:
            process = subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.{program}", *arguments],
                cwd=self._folder,
                env=environment(),
                stdout=file,
                stderr=file,
            )
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process


def wait_for(sign: Callable[[], bool]) -> None:
    """Wait until a function says yes."""
    end = time.monotonic() + LIMIT
    while not sign():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.02)


@contextmanager
def cluster(folder: Path) -> Iterator[Cluster]:
    with ExitStack() as stack:
        yield Cluster(folder, stack)


@pytest.fixture(scope="module")
def one_worker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """A cluster with a worker that stays."""
    with cluster(tmp_path_factory.mktemp("cluster")) as started:
        yield started


@contextmanager
def begin(*arguments: str, start: Sequence[str] = ("-m", "rigidcli")) -> Iterator[subprocess.Popen[bytes]]:
    """The program, on its way; it is ended when the test is."""
    with subprocess.Popen(
        [sys.executable, *start, *arguments],
        cwd=ROOT,
        env=environment(),
        bufsize=0,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as running:
        try:
            yield running
        finally:
            running.kill()


def run(*arguments: str, stdin: str = "") -> Outcome:
    """The program in a process of its own: a client of a cluster leaves threads and warnings behind."""
    done = subprocess.run(
        [sys.executable, "-m", "rigidcli", *arguments],
        cwd=ROOT,
        env=environment(),
        input=stdin.encode(),
        capture_output=True,
        timeout=LIMIT,
        check=False,
    )
    return Outcome(done.returncode, done.stdout.decode(), done.stderr.decode())


@needs_dask
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
def test_no_row_is_lost_or_comes_twice_when_a_worker_is_killed(one_worker: Cluster, program: Program) -> None:
    expected = program(*SWEEP)
    second = one_worker.worker("second")
    with begin(*SWEEP, "--jobs", one_worker.address) as running:
        assert running.stdout is not None
        # The pipe takes no more than some hundred rows before these are read: most are still to come.
        head = running.stdout.read(100)
        second.send_signal(signal.SIGKILL)
        second.wait()
        out, err = running.communicate(timeout=LIMIT)
    assert running.returncode == expected.code
    assert (head + out).decode() == expected.out
    assert err.decode() == expected.err


@needs_dask
def test_files_are_read_here_and_what_they_name_where_it_is_worked(
    one_worker: Cluster, program: Program, tmp_path: Path
) -> None:
    (tmp_path / "cloud.csv").write_text("m,x,y,z\n1,0,0,1\n2,1,0,0\n1,0,1,0\n")
    (tmp_path / "named.yaml").write_text("body: {points: cloud.csv}\n")
    (tmp_path / "broken.yaml").write_text("body: {shape: cub}\n")
    files = [TOP, *(os.path.relpath(path, ROOT) for path in sorted(tmp_path.iterdir()))]
    others = ("-", "nowhere.yaml", "configs/arm.urdf", "configs/bracket.stl", "configs/benzene.xyz")
    arguments = ("inertia", "-f", "json", *files, *others, "-s", "about=[1, 2, 3]")
    stdin = "body: {shape: cube, side: 1, mass: 2}"
    here, afar = program(*arguments, stdin=stdin), run(*arguments, "-j", one_worker.address, stdin=stdin)
    assert here.code == 3
    assert here.out.count("\n") > 5
    assert here == afar


def rows_of(folder: Path) -> list[dict[str, Any]]:
    from pyarrow import parquet

    parts = sorted(folder.glob("*.parquet"), key=lambda path: int(path.name.split(".")[1]))
    return [row for path in parts for row in parquet.read_table(path).to_pylist()]


@needs_folders
def test_workers_write_the_parts_of_a_table(one_worker: Cluster, program: Program, tmp_path: Path) -> None:
    sweep = ("--sweep", "body.side=-1:2:31", "-s", "about=com", "configs/cube_corner.yaml")
    folder, file = tmp_path / "table", tmp_path / "table.parquet"
    here = program("inertia", "-q", "-f", "parquet", "-o", str(file), *sweep)
    afar = run("inertia", "-q", "-f", "parquet", "-o", f"{folder}/", "-j", one_worker.address, *sweep)
    assert (here.code, afar.code, afar.out) == (3, 3, "")
    assert "refused: at body.side=-1" in afar.err
    parquet = pytest.importorskip("pyarrow.parquet")
    rows, good = rows_of(folder), parquet.read_table(file).to_pylist()
    errors = [row.pop("error") for row in rows]
    assert [row for row in rows if row["mass"] is not None] == good
    assert len(rows) == 31
    assert sum(error is not None for error in errors) == 31 - len(good) == 11
    again = run("inertia", "-f", "parquet", "-o", f"{folder}/", "-j", one_worker.address, TOP)
    assert (again.code, "is not empty" in again.err) == (2, True)


@needs_dask
def test_an_interrupt_leaves_nothing_to_do_on_the_cluster(one_worker: Cluster) -> None:
    runner = "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    runner += f"sys.argv = ['rigidcli', *{list(SWEEP)}, '-j', '{one_worker.address}']\n"
    runner += "from rigidcli.__main__ import main; main()"
    with begin(start=("-c", runner)) as running:
        assert running.stdout is not None
        running.stdout.read(100)
        running.send_signal(signal.SIGINT)
        _, err = running.communicate(timeout=LIMIT)
    assert running.returncode == 130
    assert b"Traceback" not in err
    wait_for(lambda: one_worker.tasks() == 0)


@needs_dask
def test_another_version_on_the_cluster_is_refused(one_worker: Cluster) -> None:
    code = "import sys, rigidcli; rigidcli.__version__ = '99.0'\n"
    code += f"sys.argv = ['rigidcli', 'inertia', '-j', '{one_worker.address}', '{TOP}']\n"
    code += "from rigidcli.__main__ import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, env=environment(), capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert "and here is rigidcli 99.0" in done.stderr
    assert "hint: install the same versions" in done.stderr


@needs_dask
def test_a_scheduler_that_is_lost_is_told(tmp_path: Path) -> None:
    with cluster(tmp_path) as started, begin(*SWEEP, "--jobs", started.address) as running:
        assert running.stdout is not None
        running.stdout.read(100)
        started.scheduler.kill()
        _, err = running.communicate(timeout=LIMIT)
    assert running.returncode == 4
    assert b"was lost" in err
    assert b"Traceback" not in err
    assert b"hint: start it and call again" in err


@needs_dask
def test_an_address_where_no_scheduler_answers() -> None:
    with socket.socket() as silent:
        # It is listened to, but nobody speaks.
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        impatient = "from rigidcli import cluster; cluster.ANSWERS_WITHIN = 0.2\n"
        impatient += "from rigidcli.__main__ import main; main()"
        with begin("inertia", "-j", address, TOP, start=("-c", impatient)) as running:
            out, err = running.communicate(timeout=LIMIT)
    assert (running.returncode, out) == (2, b"")
    assert f"no Dask scheduler answers at `{address}`".encode() in err
    assert b"Traceback" not in err


def test_without_the_library_it_is_said_how_to_get_it(
    program: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    find = util.find_spec
    monkeypatch.setattr(util, "find_spec", lambda name: None if name == "distributed" else find(name))
    outcome = program("inertia", "-j", "tcp://127.0.0.1:1", TOP)
    assert (outcome.code, outcome.out) == (2, "")
    assert "pip install 'rigidcli[cluster]'" in outcome.err
