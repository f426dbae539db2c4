"""Ctrl-C at any moment: exit code 130, no traceback. Stand-ins for libraries interrupt their own loading."""

from __future__ import annotations

import os
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
import os, signal, time
os.kill(os.getpid(), signal.SIGINT)
time.sleep(0.2)
"""

INTERRUPTED_IN_COMPILED_CODE = """
import os, signal, time
try:
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(0.2)
except KeyboardInterrupt:
    raise ImportError("initialization failed")
"""


def run(folder: Path, name: str, source: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The program where the module `name` is replaced."""
    (folder / f"{name}.py").write_text(source)
    return subprocess.run(
        [sys.executable, "-c", RUNNER, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, "PYTHONPATH": str(folder)},
        check=False,
    )


@pytest.mark.parametrize("source", [INTERRUPTED, INTERRUPTED_IN_COMPILED_CODE])
@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("yaml", ["axes", "configs/cube_corner.yaml"]),
        ("numpy", ["axes", "configs/cube_corner.yaml"]),
        ("heyoka", ["euler", "--engine", "taylor", "-s", "motion.duration=0.1", "configs/driven_gyro.yaml"]),
    ],
)
def test_an_interrupt_while_a_library_loads(
    name: str, arguments: list[str], source: str, tmp_path: Path
) -> None:
    done = run(tmp_path, name, source, *arguments)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_an_interrupt_while_the_program_loads(tmp_path: Path) -> None:
    done = run(tmp_path, "typer", INTERRUPTED, "axes", "configs/cube_corner.yaml")
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@pytest.mark.parametrize("error", ["ImportError", "ModuleNotFoundError", "SystemError", "AttributeError"])
def test_a_heyoka_that_does_not_load(error: str, tmp_path: Path) -> None:
    arguments = ("euler", "--engine", "taylor", "configs/driven_gyro.yaml")
    done = run(tmp_path, "heyoka", f"raise {error}('libboost.so: no such file')\n", *arguments)
    assert (done.returncode, done.stdout) == (4, "")
    assert "heyoka cannot be loaded: libboost.so: no such file" in done.stderr
    assert "Traceback" not in done.stderr
