"""The README is true: its console blocks print what stands there, its Python runs, and it is short."""

from __future__ import annotations

import contextlib
import io
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from .conftest import ROOT

README = (ROOT / "README.md").read_text()
CONSOLE = re.findall(r"```console\n(.*?)```", README, re.DOTALL)
PYTHON = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


def _run(command: str, folder: Path) -> str:
    """Standard output and error of a command, with `rigidcli` being this one."""
    path = f"{folder}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
    done = subprocess.run(
        command,
        shell=True,
        cwd=ROOT,
        env=environment,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    return done.stdout


@pytest.mark.parametrize("block", CONSOLE, ids=lambda block: block.splitlines()[0][2:])
def test_console_block(block: str, tmp_path: Path) -> None:
    script = tmp_path / "rigidcli"
    script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m rigidcli "$@"\n')
    script.chmod(0o755)
    commands = re.findall(r"^\$ (.*)$", block, re.MULTILINE)
    printed = "".join(f"$ {command}\n{_run(command, tmp_path)}" for command in commands)
    assert printed == block


@pytest.mark.parametrize("block", PYTHON)
def test_python_block(block: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    promised = re.findall(r"print\(.*\)  # (?:.*: )?(.*)$", block, re.MULTILINE)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(block, "README.md", "exec"), {})
    assert printed.getvalue().splitlines() == promised


def test_the_front_page_has_a_picture_that_is_small() -> None:
    (picture,) = re.findall(r'<img [^>]*src="([^"]+)"', README)
    assert (ROOT / picture).stat().st_size < 200_000


def test_the_front_page_is_read_in_a_sitting() -> None:
    assert len(README.splitlines()) <= 140
