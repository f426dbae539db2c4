"""`new gallery`: pages of all examples under an index."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from rigidcli.cli import printing
from tests.conftest import ROOT, Program
from tests.markup import markup

SOME = (
    "cone_top.yaml",
    "cube_symbolic.yaml",
    "taylor_13_02.yaml",
    "pendulum_swarm.yaml",
    "pendulum_swarm.csv",
)
"""A replay, two documents with letters alone, and a motion from many starts, which has no page."""


def test_each_example_has_a_page_and_its_document(
    program: Program, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in SOME:
        shutil.copy(ROOT / "configs" / name, tmp_path)
    monkeypatch.setattr(printing, "EXAMPLES", tmp_path)
    folder = tmp_path / "pages"
    outcome = program("new", "gallery", "-o", f"{folder}/")
    assert (outcome.code, outcome.out) == (0, "")
    assert outcome.err == f"wrote 3 pages; open {folder}/index.html\n"
    index = markup((folder / "index.html").read_text("utf-8"))
    links = [link.attributes["href"] for link in index.all("a")]
    assert sorted({Path(link).stem for link in links}) == ["cone_top", "cube_symbolic", "taylor_13_02"]
    assert all((folder / link).is_file() for link in links)
    assert (folder / "cone_top.yaml").read_bytes() == (ROOT / "configs/cone_top.yaml").read_bytes()
    assert len(index.all("img")) == 2
    assert len(index.all("math")) >= 2
    assert "A solid cone on its tip" in index.text


def test_a_gallery_needs_a_folder(program: Program) -> None:
    outcome = program("new", "gallery")
    assert (outcome.code, outcome.out) == (2, "")
    assert "rigidcli new gallery -o FOLDER/" in outcome.err
