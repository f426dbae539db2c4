"""What documents come to, and why others cannot be worked, by the tables truths.yaml and refused.yaml."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.conftest import Program
from tests.truths import require, truths

REFUSED = yaml.safe_load(Path(__file__).with_name("refused.yaml").read_text(encoding="utf-8"))


TABLES = [Path(__file__).with_name(name) for name in ("truths.yaml", "events.yaml")]


@pytest.mark.parametrize("case", [case for table in TABLES for case in truths(table)])
def test_a_document_comes_to_this(case: dict[str, Any], program: Program) -> None:
    require(case, program)


@pytest.mark.parametrize(
    ("run", "document", "code", "said"),
    [
        pytest.param(
            *(group["run"], group["document"].replace("...", text, 1), group["code"], said),
            id=f"{name}: {text}",
        )
        for name, group in REFUSED.items()
        for text, said in group["wrong"]
    ],
)
def test_a_document_cannot_be_worked(run: str, document: str, code: int, said: str, program: Program) -> None:
    outcome = program(*run.split(), "-f", "json", "-", stdin=document)
    assert (outcome.code, outcome.out) == (code, "")
    assert said in outcome.err
    assert "Traceback" not in outcome.err
