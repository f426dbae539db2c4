"""The wheel, as it is installed: by pip, in an environment of its own."""

from __future__ import annotations

import subprocess
import sys
import tomllib
import venv
from pathlib import Path

import numpy as np
import pytest
import yaml

import rigidcli
from tests.conftest import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the programs of an environment with the wheel; its libraries are those of the tests."""
    for tool in ("hatchling", "pip"):
        pytest.importorskip(tool, reason="pip builds the wheel with hatchling")
    folder = tmp_path_factory.mktemp("wheel")
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "-q")
    build = ("wheel", "--no-deps", "--no-build-isolation", "-w", str(folder), str(ROOT))
    subprocess.run([*pip, *build], check=True)
    (wheel,) = folder.glob("rigidcli-*.whl")
    venv.create(folder / "bare", symlinks=True)
    packages = next((folder / "bare").glob("[Ll]ib/**/site-packages"))
    scripts = folder / "bare" / ("Scripts" if sys.platform == "win32" else "bin")
    python = str(next(scripts.glob("python*")))
    subprocess.run([*pip, "--python", python, "install", "--no-deps", "--no-index", str(wheel)], check=True)
    # Only now: among the libraries may be a rigidcli, which pip would take for the one that is asked for.
    (packages / "libraries.pth").write_text(f"{Path(np.__file__).parents[1]}\n")
    return scripts


def run(programs: Path, folder: Path, *arguments: str) -> str:
    command = [str(next(programs.glob("rigidcli*"))), *arguments]
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, encoding="utf-8").stdout


def test_the_wheel_has_starters_tables_and_replays(programs: Path, tmp_path: Path) -> None:
    where = [str(next(programs.glob("python*"))), "-c", "import rigidcli; print(rigidcli.__file__)"]
    place = subprocess.run(where, cwd=tmp_path, check=True, capture_output=True, encoding="utf-8").stdout
    package = Path(place.strip()).parent
    assert package.is_relative_to(programs.parent)
    assert {"py.typed", "CITATION.cff"} <= {file.name for file in package.iterdir()}
    assert {file.name for file in (package / "configs").glob("*.yaml")} == {
        file.name for file in (ROOT / "configs").glob("*.yaml")
    }
    run(programs, tmp_path, "new", "motion", "-o", "motion.yaml")
    assert "principal moments" in run(programs, tmp_path, "axes", "motion.yaml")
    shown = run(programs, tmp_path, "euler", "motion.yaml", "-f", "html")
    assert "<canvas" in shown
    assert "new Replay(" in shown
    for example in (package / "configs").glob("*.yaml"):
        if example.stem not in ("cone_top", "cube_symbolic"):  # all of them take 16 s
            example.unlink()
    run(programs, tmp_path, "new", "gallery", "-o", "pages/")
    assert {"index.html", "cone_top.html"} <= {page.name for page in (tmp_path / "pages").iterdir()}


def test_the_citation_is_that_of_the_package() -> None:
    citation = yaml.safe_load((ROOT / "rigidcli/CITATION.cff").read_text("utf-8"))
    assert citation["version"] == rigidcli.__version__
    assert citation["license"] == PROJECT["license"]
    assert citation["authors"] == PROJECT["authors"]


def test_the_classifiers_name_the_versions_of_python() -> None:
    named = {line.rpartition(" ")[2] for line in PROJECT["classifiers"] if ":: 3." in line}
    assert {"3.11", "3.12", "3.13", "3.14"} == named
    assert PROJECT["requires-python"] == ">=3.11"
