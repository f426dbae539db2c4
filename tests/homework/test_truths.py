"""Tables of truths: questions with answers, and what comes of each answer.

The tables are in `answers/`. An entry has a `question`, as an assignment has it, perhaps the name of its
`document`, and answers by what comes of them: a verdict, of a part the share that is right, and the codes of
all that is said, with their places where any has one.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from rigidcli.document.yaml_reader import read_tree
from rigidcli.homework.base import CODES, Outcome, Tree
from tests.conftest import ROOT
from tests.homework.asking import asked, codes, judged, told


def entries() -> Iterator[Any]:
    """The question of each entry, its document, and its answers by what comes of them."""
    for path in sorted(Path(__file__).with_name("answers").glob("*.yaml")):
        text = path.read_text(encoding="utf-8")
        tree, typed = read_tree(text, path.name), read_tree(text, path.name, is_text=lambda path: True)
        documents = tree.get("documents", {})
        for number, (entry, answers) in enumerate(zip(tree["questions"], typed["questions"], strict=True)):
            question, own = entry["question"], answers.pop("question")
            name = answers.pop("document", "")
            yield pytest.param(
                json.dumps(question | {key: own[key] for key in own if key == "answer"}),
                documents.get(name) or document(name),
                answers,
                id=f"{path.stem}{number}",
            )


def document(name: str) -> str:
    """An example without its orbit, which takes long and has no answers here."""
    text = (ROOT / "configs" / name).read_text(encoding="utf-8") if name else ""
    return re.sub(r"(?m)^orbit:\n(?:[ \t]+.*\n|\n)*", "", text)


def in_words(outcome: Outcome, *, places: bool) -> str:
    """The verdict, the share of a partial one, and the codes, the first of an answer that is not read."""
    share = f" {Fraction(outcome.share).limit_denominator(60)}" * (outcome.verdict == "partial")
    said = told(outcome).split() if places else list(dict.fromkeys(codes(outcome)))
    said = [code for code in said[: 1 if outcome.verdict == "invalid" else None] if code != "undecided"]
    return " ".join([f"{outcome.verdict}{share}", *said])


@pytest.mark.parametrize(("question", "document", "answers"), list(entries()))
def test_what_comes_of_an_answer(question: str, document: str, answers: dict[str, list[Tree]]) -> None:
    item = asked(question, document)
    for words, several in answers.items():
        places = "@" in words
        assert [(each, in_words(judged(item, each), places=places)) for each in several] == [
            (each, words) for each in several
        ]


ELSEWHERE = """
    accepted missing_column missing_file not_allowed overridden path_outside time_range_short timeout
    too_large undecided wrong_initial_condition
"""
"""The codes of files, tables, persons and limits, which other tests show."""


def test_every_other_code_stands_in_a_table() -> None:
    words = {word for entry in entries() for label in entry.values[2] for word in label.split()}
    assert set(CODES) - {word.partition("@")[0] for word in words} == set(ELSEWHERE.split())
