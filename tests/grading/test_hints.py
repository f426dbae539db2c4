"""At the level of hints nothing tells a number of the key, or how far an answer is from it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import rigidcli
from rigidcli.grading import Feedback
from rigidcli.grading.assignment import prepare
from rigidcli.grading.feedback import told
from rigidcli.grading.judge import Item, outcome
from rigidcli.grading.judgement import Judgement, judged
from tests.conftest import ROOT

CONFIGS = ROOT / "configs"

AXES = [
    {"moment": 5.3579, "axis": [0.6, 0.8, 0]},
    {"moment": 7.2468, "axis": [-0.8, 0.6, 0]},
    {"moment": 10.159, "axis": [0, 0, 1]},
]

RATES = {"xdot": "2.4683*p_x", "p_xdot": "-1.3579*x"}

QUESTIONS: dict[str, dict[str, Any]] = {
    "quantity": {"answer": "20.879 rad/s"},
    "figures": {
        "answer": 20.879,
        "kind": "number",
        "tolerance": {"significant_figures": 4, "figures": "strict"},
    },
    "vector": {"answer": [0.3579, 8.7654, -2.4683]},
    "sense": {"answer": [0.3579, 8.7654, -2.4683], "kind": "vector", "direction": "sense"},
    "moments": {"answer": [3.1357, 5.2468, 7.1593]},
    "matrix": {"answer": [[0.3579, 8.7654], [-2.4683, 1.1359]]},
    "tensor": {"answer": [[10.357, -0.8642, 0.1235], [-0.8642, 6.2468, 1.3579], [0.1235, 1.3579, 8.1473]]},
    "axes": {"answer": AXES},
    "expression": {"answer": "1.3579*m*x**2 + 8.6423*x", "symbols": {"m": "positive", "x": "real"}},
    "equations": {"answer": RATES, "coordinates": ["x"], "momenta": ["p_x"]},
    "choice": {"answer": "oblate"},
    "inertia": {"document": f"{CONFIGS}/water.yaml", "ask": "inertia.tensor"},
    "principal": {"document": f"{CONFIGS}/water.yaml", "ask": "axes"},
    "rate": {"document": f"{CONFIGS}/cone_top.yaml", "ask": "precess.top.gyroscopic_rate"},
    "energy": {"document": f"{CONFIGS}/taylor_13_02.yaml", "ask": "hamilton.hamiltonian"},
    "orbit": {"document": f"{CONFIGS}/notes_spring.yaml", "ask": "hamilton.orbit", "columns": ["x", "p_x"]},
}
"""Questions of every kind, whose keys have decimals that are in no sentence."""

FACTORS = (1.0023, 1.0071, 1.0191, 1.0567, 1.2937)
"""What numbers of a right answer are multiplied by: from hardly wrong to far away."""

CHANGED = 3
"""Numbers of a text that are changed: the first ones."""

NUMBER = re.compile(r"(?<![A-Za-z_0-9.])-?[0-9]+(?:\.[0-9]+)?(?:e[-+]?[0-9]+)?(?![A-Za-z_0-9])")

DECIMAL = re.compile(r"[0-9](\.|e-?)[0-9]")


@pytest.mark.parametrize("name", QUESTIONS)
def test_hints_tell_neither_the_key_nor_the_distance_from_it(name: str, tmp_path: Path) -> None:
    question = {"kind": name} | QUESTIONS[name] if "answer" in QUESTIONS[name] else QUESTIONS[name]
    file = tmp_path / "hw.yaml"
    file.write_text(json.dumps({"questions": {"q": question}}))
    studies = {study: getattr(rigidcli, study) for study in rigidcli.STUDIES}
    (item,) = prepare(file, studies).items.values()
    for example in item.kind.examples(item.key):
        assert not any(map(DECIMAL.search, hints(item, example.answer).values())), example.what
    right = item.kind.typed(item.key)
    for path, _ in leaves(right):
        told_of = [hints(item, changed(right, path, factor)) for factor in FACTORS]
        for near, far in pairwise(told_of):
            assert near.keys() != far.keys() or near == far
        assert not any(DECIMAL.search(text) for said in told_of for text in said.values())


def hints(item: Item, answer: Any) -> dict[str, str]:
    """What is told of an answer, by code, without the numbers that are in the answer itself."""
    own = {rounded(number) for _, text in leaves(answer) for number in NUMBER.findall(text)}
    found = Judgement("x", "x", (judged("q", 1.0, outcome(item, answer, Path())),))
    (question,) = told(found, Feedback.hint).questions
    return {
        remark.code: NUMBER.sub(lambda each: "" if rounded(each[0]) in own else each[0], remark.message)
        for remark in question.feedback
    }


def rounded(number: str) -> str:
    """A number as messages may repeat it."""
    return f"{float(number):.5g}"


def leaves(answer: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], str]]:
    """The texts in an answer, each with the way to it."""
    if not isinstance(answer, dict | list):
        yield path, str(answer)
        return
    for key, value in answer.items() if isinstance(answer, dict) else enumerate(answer):
        yield from leaves(value, (*path, key))


def changed(answer: Any, path: tuple[Any, ...], factor: float) -> Any:
    """The answer with other numbers in one of its texts."""
    if not path:
        return NUMBER.sub(lambda each: f"{float(each[0]) * factor + factor - 1:.7g}", str(answer), CHANGED)
    copy = dict(answer) if isinstance(answer, dict) else list(answer)
    copy[path[0]] = changed(answer[path[0]], path[1:], factor)
    return copy
