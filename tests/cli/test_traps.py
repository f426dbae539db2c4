"""What goes wrong in silence elsewhere: likely slips, files that are overwritten, the wrong command."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.conftest import ROOT, Program

CUBE = "body: {shape: cube, side: 1, mass: 12}\n"


# --- files that are kept


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "cube.yaml").write_text(CUBE)
    (tmp_path / "cube.svg").write_text(CUBE)
    (tmp_path / "cloud.csv").write_text("m,x,y,z\n1,0,0,1\n")
    (tmp_path / "link.yaml").symlink_to("cube.yaml")
    (tmp_path / "hard.yaml").hardlink_to(tmp_path / "cube.yaml")
    (tmp_path / "old.json").write_text("{}\n")
    return tmp_path


@pytest.mark.parametrize(
    "arguments",
    [
        "inertia -o link.yaml cube.yaml",
        "inertia -o cube.yaml link.yaml",
        "inertia -o hard.yaml cube.yaml",
        pytest.param(
            "axes --plot cube.svg cube.svg",
            marks=pytest.mark.skipif(find_spec("matplotlib") is None, reason="pictures need `show`"),
        ),
        "new -o link.yaml",
        "new -o hard.yaml",
        "new system -o cloud.csv",
    ],
)
def test_output_takes_the_place_of_no_file_that_is_read(
    arguments: str, folder: Path, program: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "x").mkdir()
    before = {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    words = [str(folder / word) if "." in word else word for word in arguments.split()]
    outcome = program(*words)
    assert (outcome.code, outcome.out) == (2, "")
    assert "overwr" in outcome.err
    assert {path: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before


def test_new_overwrites_by_force_and_other_output_what_is_only_old(folder: Path, program: Program) -> None:
    assert program("new", "system", "--force", "-o", str(folder / "cloud.csv")).code == 0
    assert (folder / "cloud.csv").read_text() == program("new", "system").out
    assert program("axes", "-f", "json", "-o", str(folder / "old.json"), str(folder / "cube.yaml")).code == 0
    assert json.loads((folder / "old.json").read_text())["mass"] == 12


# --- pipes


def piped(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PY": sys.executable}
    return subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )


@pytest.mark.skipif(not Path("/dev/fd").exists(), reason="there is no process substitution")
@pytest.mark.parametrize("source", ["cat cube.yaml", "sleep 0.5; cat cube.yaml"])
def test_a_process_substitution_is_read_like_a_file(source: str, folder: Path) -> None:
    done = piped(f'"$PY" -m rigidcli inertia -f json <({source}) cube.yaml', folder)
    assert done.returncode == 0, done.stderr
    assert [json.loads(line)["mass"] for line in done.stdout.splitlines()] == [12, 12]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
def test_a_named_pipe_is_read_and_one_without_a_writer_refused(folder: Path) -> None:
    os.mkfifo(folder / "pipe")
    done = piped('cat cube.yaml > pipe & "$PY" -m rigidcli inertia -f json pipe', folder)
    assert json.loads(done.stdout)["mass"] == 12
    done = piped('"$PY" -m rigidcli inertia pipe', folder)
    assert (done.returncode, done.stderr) == (3, "pipe: cannot be read: nothing is written to this pipe\n")
