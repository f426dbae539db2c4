"""The benchmarks: each job and each peer start and do the same, and the table has a row for each claim."""

from __future__ import annotations

import os
import runpy
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.benchmarks.__main__ import EARLIER, FRONT, HEAD, RULE, TABLE, begun, cut, front, table, words
from tests.benchmarks.claims import CLAIMS, Claim
from tests.benchmarks.make import KINDS
from tests.conftest import ROOT, Program

ROWS = cut(TABLE.read_text())[1].splitlines()


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.name)
def test_both_start(
    claim: Claim,
    tmp_path: Path,
    program: Program,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (_, _, *ours), theirs = words(claim, claim.quick)
    monkeypatch.chdir(tmp_path)
    if claim.make:
        KINDS[claim.make](claim.quick)
    if claim.without:
        monkeypatch.setitem(sys.modules, claim.without, None)
    outcome = program(*ours)
    assert (outcome.code, outcome.err) in ((0, ""), (1, "")), outcome.err
    if not all(map(find_spec, claim.needs)):
        return
    monkeypatch.chdir(tmp_path)
    if theirs[0] == "-c":
        exec(theirs[1], {})
        return
    monkeypatch.setattr(sys, "argv", theirs)
    runpy.run_path(theirs[0], run_name="__main__")
    if "csv" in claim.ours:
        rows = outcome.out.count("\n") - 1
        peers = capsys.readouterr().out.count("\n")  # some have heads, too
        assert peers - ((rows - 1) // claim.parts + 1) in (0, 1)


def test_the_table_has_a_row_for_each_claim_and_the_readme_shows_a_few() -> None:
    assert ROWS[:2] == [HEAD, RULE]
    assert len(ROWS) == 2 + len(CLAIMS)
    assert all(line.startswith(begun(claim)) for line, claim in zip(ROWS[2:], CLAIMS, strict=True))
    assert cut(FRONT.read_text())[1].splitlines() == front(ROWS)
    assert len(front(ROWS)) == 5


def test_what_cannot_be_run_keeps_its_figures(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("tests.benchmarks.__main__.find_spec", lambda name: None)
    first = list(table([claim for claim in CLAIMS if claim.needs], 1, True, "\n".join(ROWS)))
    assert "mesh: not run: trimesh is not installed" in capsys.readouterr().err
    for new, old, claim in zip(first[2:], ROWS[2:], CLAIMS, strict=True):
        assert new.replace(EARLIER, "") == old.replace(EARLIER, "")
        assert (EARLIER in new) == bool(claim.needs)


def test_the_program_prints_the_row_that_is_asked_for() -> None:
    words = [sys.executable, "tests/benchmarks", "--quick", "--rows", "sweep"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, env=os.environ, check=True)
    (line,) = (line for line in done.stdout.splitlines() if "spins" in line)
    assert line.count(" / ") == line.count(" = ") == 3
