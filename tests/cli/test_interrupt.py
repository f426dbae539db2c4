"""Ctrl-C while the program loads or works: exit code 130, no traceback.

Stand-ins for libraries interrupt their own loading.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT

# A process that was started in the background may ignore interrupts; this one is to feel them.
RUNNER = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.argv = ["rigidcli", *sys.argv[1:]]
from rigidcli.__main__ import main
main()
"""

INTERRUPTED = """
import signal
signal.raise_signal(signal.SIGINT)
"""

INTERRUPTED_IN_COMPILED_CODE = """
import signal
try:
    signal.raise_signal(signal.SIGINT)
except KeyboardInterrupt:
    raise ImportError("initialization failed")
"""

INTERRUPTED_IN_A_DESTRUCTOR = """
import signal, time
class Future:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)
Future()
for _ in range(600):
    time.sleep(0.1)
"""


def run(folder: Path, name: str, source: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The program where the module `name` is replaced."""
    (folder / f"{name}.py").write_text(source)
    return subprocess.run(
        [sys.executable, "-c", RUNNER, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "PYTHONPATH": str(folder)},
        check=False,
    )


@pytest.mark.parametrize(
    ("name", "source", "arguments"),
    [
        ("typer", INTERRUPTED, "axes configs/cube_corner.yaml"),
        ("yaml", INTERRUPTED, "axes configs/cube_corner.yaml"),
        ("yaml", INTERRUPTED_IN_A_DESTRUCTOR, "axes configs/cube_corner.yaml"),
        ("heyoka", INTERRUPTED_IN_COMPILED_CODE, "euler -s motion.method=taylor configs/driven_gyro.yaml"),
    ],
)
def test_an_interrupt_while_a_library_loads(name: str, source: str, arguments: str, tmp_path: Path) -> None:
    done = run(tmp_path, name, source, *arguments.split())
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_a_heyoka_that_does_not_load(tmp_path: Path) -> None:
    arguments = ("euler", "-s", "motion.method=taylor", "configs/driven_gyro.yaml")
    done = run(tmp_path, "heyoka", "raise ImportError('libboost.so: no such file')\n", *arguments)
    assert (done.returncode, done.stdout) == (4, "")
    assert "heyoka cannot be loaded: libboost.so: no such file" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("sent", "ended"),
    [(b"#" * 300_000, False), (b"body: {points: [" + b"[1,2,3,4]," * 190_000 + b"]}", True)],
    ids=["while it waits for standard input", "while it works"],
)
def test_ctrl_c(sent: bytes, ended: bool) -> None:
    """The program is at its second document when the first is told, and more is taken than a pipe holds."""
    with subprocess.Popen(
        [sys.executable, "-c", RUNNER, "inertia", "-f", "json", "configs/cube_corner.yaml", "-"],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as child:
        assert child.stdin is not None
        assert child.stdout is not None
        assert child.stdout.readline().startswith(b'{"schema":"rigidcli.inertia/1"')
        child.stdin.write(sent)
        child.stdin.flush()
        if ended:
            child.stdin.close()
            child.stdin = None
        child.send_signal(signal.SIGINT)
        out, err = child.communicate(timeout=120)
    assert (child.returncode, out, err) == (130, b"", b"")
