"""What the program does, run by run, by the table transcripts.yaml, which says how it is to be read."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.conftest import ROOT, Program

TRANSCRIPTS = yaml.safe_load(Path(__file__).with_name("transcripts.yaml").read_text(encoding="utf-8"))

BAD_ARM = (ROOT / "configs" / "arm.urdf").read_text().replace('izz="0.0002"', 'izz="0.2"')
"""The arm with a forearm that no body is: 0.2 > 0.0076 + 0.0076."""


def require(said: str, expected: str | list[str] | None) -> None:
    """Hold output against what the table says of it."""
    if isinstance(expected, str):
        assert said == expected.removeprefix("=")
    single = re.sub(" +", " ", said)
    for words in expected if isinstance(expected, list) else ():
        present = words.removeprefix("!") in single or words.removeprefix("!") in said
        assert present is not words.startswith("!"), f"{words!r}: {said}"


@pytest.mark.parametrize("case", TRANSCRIPTS.values(), ids=TRANSCRIPTS)
def test_transcript(case: dict[str, Any], program: Program, tmp_path: Path) -> None:
    files = {
        tmp_path / name: text.replace("TMP", str(tmp_path)) for name, text in case.get("files", {}).items()
    }
    for path, text in files.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text.replace("BAD_ARM", BAD_ARM).encode())
    before = {path: path.read_bytes() for path in files}
    outputs = []
    for command, code, *said in case["runs"]:
        words = [word.replace("TMP", str(tmp_path)) for word in shlex.split(command)]
        outcome = program(*words, stdin=case.get("stdin", ""))
        out, err = (text.replace(str(tmp_path), "TMP") for text in (outcome.out, outcome.err))
        assert outcome.code == code, err
        assert "Traceback" not in err
        for text, expected in zip((out, err), [*said, "", ""], strict=False):
            require(text, expected)
        outputs.append(out)
    assert not case.get("same") or len(set(outputs)) == 1
    assert {path: path.read_bytes() for path in files} == before
