"""What the program says, by the table told.yaml: pages of `explain`, notes and refusals."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
import yaml

from tests.conftest import Program

GROUPS = yaml.safe_load(Path(__file__).with_name("told.yaml").read_text(encoding="utf-8"))

ROWS = [
    pytest.param(
        *(group["run"].replace("...", text), group.get("stdin", "").replace("...", text)),
        *(group["code"], words, group.get("notes", False)),
        id=f"{name}: {text}",
    )
    for name, group in GROUPS.items()
    for text, words in group["rows"]
]


@pytest.mark.parametrize(("run", "stdin", "code", "words", "notes"), ROWS)
def test_the_program_says(
    run: str, stdin: str, code: int, words: list[str], notes: bool, program: Program
) -> None:
    outcome = program(*shlex.split(run), stdin=stdin)
    assert outcome.code == code
    if code:
        assert outcome.out == ""
        assert "Traceback" not in outcome.err
    said = outcome.err if code or notes else outcome.out
    missing = [each for each in words if each not in said and each not in " ".join(said.split())]
    assert not missing, said
    assert notes or code or outcome.err == ""
