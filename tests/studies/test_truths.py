"""What documents come to, and why others cannot be worked, by the tables truths.yaml and refused.yaml."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml

from rigidcli.language.evaluation import real
from rigidcli.language.parser import read
from tests.conftest import Program


def table(name: str) -> Any:
    return yaml.safe_load(Path(__file__).with_name(name).read_text(encoding="utf-8"))


def at(result: Any, path: str) -> Any:
    """What stands under a path of keys and indices."""
    for key in path.split("."):
        result = result[int(key) if isinstance(result, list) else key]
    return result


def expected(value: Any) -> Any:
    """A value of the table: `= pi/2` is a number, and numbers agree to 12 digits."""
    if isinstance(value, str):
        return expected(real(read(value[1:])[0], {})) if value.startswith("=") else value
    if isinstance(value, bool) or value is None:
        return value
    if isinstance(value, list):
        return [expected(entry) for entry in value]
    return pytest.approx(value, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("case", [pytest.param(case, id=name) for name, case in table("truths.yaml").items()])
def test_a_document_comes_to_this(case: dict[str, Any], program: Program) -> None:
    outcome = program(*case["run"].split(), "-f", "json", "-", stdin=case["document"])
    assert outcome.code == 0, outcome.err
    found = json.loads(outcome.out)
    for path, value in case["gives"].items():
        assert at(found, path) == expected(value), path
    for words in case.get("notes", []):
        assert words in outcome.err


@pytest.mark.parametrize(
    ("run", "document", "code", "said"),
    [
        pytest.param(
            *(group["run"], group["document"].replace("...", text, 1), group["code"], said),
            id=f"{name}: {text}",
        )
        for name, group in table("refused.yaml").items()
        for text, said in group["wrong"]
    ],
)
def test_a_document_cannot_be_worked(run: str, document: str, code: int, said: str, program: Program) -> None:
    outcome = program(*run.split(), "-f", "json", "-", stdin=document)
    assert (outcome.code, outcome.out) == (code, "")
    assert said in outcome.err
    assert "Traceback" not in outcome.err
