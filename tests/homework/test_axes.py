"""Principal axes beside tensors that are made of moments and axes chosen here.

A right answer may be in any order, with any signs and lengths, with any basis where moments are equal,
rounded as the tolerance allows, and in other units; what is turned, scaled or paired otherwise is wrong.
"""

from __future__ import annotations

import json
import math
import random
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rigidcli.errors import DocumentError
from tests.conftest import ROOT
from tests.homework.asking import asked, cases, codes, judged, typed

Floats = NDArray[np.float64]


@cases(
    """
    key
    12345  {}  {tensor: 12345}  {tensor: [[12345, 0], [0, 12345]]}
    {tensor: [[0, 0, 0], [0, 0, 0], [0, 0, 0]]}
    {tensor: [[12345, 1, 0], [0, 12345, 0], [0, 0, 12345]]}  {tensor: [[12345x, 0, 0], [0, 1, 0], [0, 0, 1]]}
    [[1, [1, 0, 0]], [2, [0, 1, 0]], [12345, [0, 1, 0.001]]]
    [[1, [1, 0, 0]], [2, [0, 1, 0]], [12345, [0.5, 0, 1]]]
    [[1, [1, 0, 0]], [2, [0, 1, 0]], [12345 m, [0, 0, 1]]]
    """,
    read=typed,
)
def test_a_bad_key_is_refused(key: Any) -> None:
    with pytest.raises(DocumentError):
        asked({"kind": "axes", "answer": key})


# --- a document


def solutions(tensor: Floats) -> Any:
    values, vectors = np.linalg.eigh(tensor)
    return [
        [repr(float(m)), [repr(float(x)) for x in axis]] for m, axis in zip(values, vectors.T, strict=True)
    ]


def test_mistakes_on_the_way_to_the_tensor() -> None:
    # The file's own numbers: a tensor about the centre of mass, shifted and turned.
    central = np.array([[0.42, 0.03, -0.01], [0.03, 0.36, 0.02], [-0.01, 0.02, 0.51]])
    d, turn = np.array([0.1, 0, 0.15]), math.radians(30)
    frame = np.array([[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]])
    shift = 12.5 * (d @ d * np.eye(3) - np.outer(d, d))
    item = asked("{ask: axes}", (ROOT / "configs/known_tensor.yaml").read_text(encoding="utf-8"))
    right = frame.T @ (central + shift) @ frame
    for tensor, code in (
        (right, ""),
        (central + shift, "other_frame"),
        (frame.T @ central @ frame, "parallel_axis_missing"),
        (frame.T @ (central - shift) @ frame, "parallel_axis_sign"),
        (2 * np.diag(right.diagonal()) - right, "products_of_inertia_sign"),
        (np.diag(right.diagonal()), "products_of_inertia_missing"),
    ):
        assert codes(judged(item, solutions(tensor)))[:1] == code.split()
    skew = [[moment, axis] for moment, axis in solutions(right)]
    columns = np.array([axis for _, axis in skew]).T.tolist()
    transposed = [[moment, axis] for (moment, _), axis in zip(skew, columns, strict=True)]
    assert codes(judged(item, transposed)) == ["transposed"]


# --- bodies whose moments and axes are chosen


@dataclass(frozen=True)
class Body:
    """Moments, axes (rows), and the places of equal moments."""

    moments: Floats
    rows: Floats
    groups: tuple[tuple[int, ...], ...]

    @property
    def tensor(self) -> list[list[str]]:
        tensor = self.rows.T * self.moments @ self.rows
        return [[repr(float(each)) for each in line] for line in (tensor + tensor.T) / 2]


QUATERNIONS = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: math.hypot(*q) > 0.1)


@st.composite
def bodies(draw: st.DrawFn) -> Body:
    """Bodies with moments that differ by 4 % or more, or are equal; linear and round ones among them."""
    rows = np.array(Rotation.from_quat(draw(QUATERNIONS)).as_matrix())
    low, high = draw(st.floats(0.05, 0.95)), draw(st.floats(1.04, 1.9))
    moments, groups = draw(
        st.sampled_from(
            [
                ([low, 1.0, high], ((0,), (1,), (2,))),
                ([low, 1.0, 1.0], ((0,), (1, 2))),
                ([1.0, 1.0, high], ((0, 1), (2,))),
                ([1.0, 1.0, 1.0], ((0, 1, 2),)),
                ([0.0, 1.0, 1.0], ((0,), (1, 2))),
            ]
        )
    )
    return Body(np.array(moments) * draw(st.sampled_from([1e-47, 1.0, 7.3, 1e59])), rows, groups)


def written(body: Body, rows: Floats, chance: random.Random) -> Any:
    """Pairs in any order, with axes of any sign and length, in any unit, to four figures."""
    unit, scale = chance.choice([("", 1.0), (" kg m^2", 1.0), (" g cm^2", 1e-7)])
    answer = []
    for k in chance.sample(range(3), 3):
        row = rows[k] * chance.choice([-1, 1]) * 10 ** chance.uniform(-5, 5)
        answer.append([f"{body.moments[k] / scale:.3e}{unit}", [f"{each:.4e}" for each in row]])
    return answer


def basis(body: Body, chance: random.Random) -> Floats:
    """Other axes of a body: any orthonormal basis in each group."""
    rows = body.rows.copy()
    for group in map(list, body.groups):
        angle = chance.uniform(0, 2 * math.pi)
        turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        if len(group) > 1:
            rows[group[:2]] = turn @ rows[group[:2]]
    return rows


@settings(max_examples=30)
@given(bodies(), st.integers(0, 2**32))
def test_every_right_answer_is_right(body: Body, seed: int) -> None:
    chance = random.Random(seed)
    item = asked(json.dumps({"kind": "axes", "answer": {"tensor": body.tensor}}))
    for _ in range(2):
        assert judged(item, written(body, basis(body, chance), chance)).verdict == "correct"


@settings(max_examples=40)
@given(bodies(), st.integers(0, 2**32), st.sampled_from(["moment", "turned", "oblique", "double", "pairing"]))
def test_no_wrong_answer_is_right(body: Body, seed: int, way: str) -> None:
    chance = random.Random(seed)
    rows, moments = basis(body, chance), body.moments.copy()
    group = next((group for group in body.groups if len(group) > 1), (0, 0))
    i, j = chance.sample(group, 2) if way in ("oblique", "double") else chance.sample(range(3), 2)
    apart = not any(i in each and j in each for each in body.groups)
    angle = chance.uniform(0.03, 1.5)
    if way == "moment":
        moments[i] += chance.choice([-1, 1]) * chance.uniform(0.011, 3) * (moments[i] or moments.max())
    elif (way == "turned" and apart) or (way == "oblique" and i != j):
        rows[i] = math.cos(angle) * rows[i] + math.sin(angle) * rows[j]
    elif way == "double" and i != j:
        rows[i] = rows[j]
    elif way == "pairing" and apart:
        rows[[i, j]] = rows[[j, i]]
    else:
        return
    item = asked(json.dumps({"kind": "axes", "answer": {"tensor": body.tensor}}))
    outcome = judged(item, written(Body(moments, rows, body.groups), rows, chance))
    assert outcome.verdict in ("partial", "incorrect"), way
    assert outcome.share < 1
    assert outcome.findings
    assert not any(finding.detail for finding in outcome.findings)
