"""Documents that are refused, by the table in refused.yaml."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from tests.refusals import told

GROUPS = yaml.safe_load(Path(__file__).with_name("refused.yaml").read_text(encoding="utf-8"))

ROWS = [
    pytest.param(
        group["document"].replace("...", text, 1), f"{group.get('under', '')}.{key}".strip("."), words,
        id=f"{name}: {text}",
    )
    for name, group in GROUPS.items()
    for text, key, words in group["wrong"]
]  # fmt: skip


@pytest.mark.parametrize(("document", "key", "words"), ROWS)
def test_a_wrong_document_has_one_problem_with_its_key_and_its_cure(
    document: str, key: str, words: str
) -> None:
    found, message = told(document)
    assert found == key
    assert words in message
