"""Formulas within sentences and titles."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from rigidcli.render.prose import typeset
from tests.conftest import Program
from tests.markup import markup

CASES = yaml.safe_load((Path(__file__).parent / "prose.yaml").read_text("utf-8"))


@pytest.mark.parametrize(("words", "shown"), CASES, ids=[words for words, _ in CASES])
def test_formulas_among_words_are_found(words: str, shown: str) -> None:
    pieces = list(typeset(words))
    assert "".join(f"«{piece}»" if is_formula else piece for piece, is_formula in pieces) == shown


def test_a_page_typesets_what_is_conserved(program: Program) -> None:
    outcome = program("hamilton", "configs/conical_pendulum.yaml", "-q", "-f", "html")
    rows = {row.children[0].text: row.children[1] for row in markup(outcome.out).all("tr")}
    assert [math.text for math in rows["conserved"].all("math")] == ["pϕ", "H", "=T", "+V"]


@pytest.mark.parametrize("config", ["top_looping", "t_handle"])
def test_a_page_of_precession_replays_the_motion(config: str, program: Program) -> None:
    outcome = program("precess", f"configs/{config}.yaml", "-q", "-f", "html")
    assert outcome.out.count("<canvas") == 1
