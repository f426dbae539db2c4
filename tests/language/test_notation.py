"""The table of readings: each of its rows is read as it says, and taken in a document as it says."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import yaml

from rigidcli.errors import ExpressionError
from rigidcli.fields.environment import Environment, Parameter
from rigidcli.language.expression import parse, real
from rigidcli.language.text import without_doubt
from rigidcli.language.typed import expressions
from rigidcli.language.words import NOTATION, Notation, Words

NAMES = [*"mMgzlkxpabcARwtn", "omega", "theta", "phi", "xdot", "thetadot", "phidot"]
MOVING = ("x", "theta")
FORMULAS = [row for row in NOTATION if row.of == "formula"]
TABLE = yaml.safe_load(Path(__file__).with_name("readings.yaml").read_text(encoding="utf-8"))

VALUES = {name: 0.21 + 0.033 * place for place, name in enumerate(NAMES)}
"""Numbers at which two readings that differ have two values."""


def worth(text: str) -> float:
    return real(parse(text, None, Words(NAMES, is_open=True)).root, VALUES)


@pytest.mark.parametrize(
    ("typed", "readings"), [(row.typed, row.readings) for row in FORMULAS] + [tuple(row) for row in TABLE]
)
def test_a_text_has_its_usual_readings_in_their_order(typed: str, readings: list[str]) -> None:
    found = expressions(typed, Words(NAMES, moving=MOVING))
    assert [real(node, VALUES) for node in found] == pytest.approx([worth(each) for each in readings])


@pytest.mark.parametrize("row", FORMULAS, ids=lambda row: row.typed)
def test_what_a_document_takes(row: Notation) -> None:
    known = Environment(declared={name: Parameter(is_broken=False, value=v) for name, v in VALUES.items()})
    if row.document == "fits":
        with pytest.raises(ExpressionError, match="can be read in"):
            known.typed(row.typed)
    elif row.document == "first":
        assert math.isclose(known.read(row.typed, None), worth(row.readings[0]))


@pytest.mark.parametrize("row", [row for row in FORMULAS if len(row.readings) > 1], ids=lambda row: row.typed)
def test_what_is_shown_of_a_reading_has_one_reading(row: Notation) -> None:
    words = Words(NAMES, moving=MOVING)
    for node in expressions(row.typed, words):
        shown = without_doubt(node)
        assert [real(each, VALUES) for each in expressions(shown, words)] == [real(node, VALUES)]
