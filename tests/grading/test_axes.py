"""Pairs of a moment and an axis, beside tensors that are made of moments and axes chosen here.

A right answer may be in any order, with any signs and lengths, with any basis where moments are equal,
rounded as the tolerance allows, and in other units; what is turned, scaled or paired otherwise is wrong.
"""

from __future__ import annotations

import math
import pickle
import random
import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rigidcli.document.document import Document
from rigidcli.document.load import load
from rigidcli.errors import ValueProblem
from rigidcli.grading.asked import Asked
from rigidcli.grading.feedback import sentence, sentences
from rigidcli.grading.kinds import KINDS
from rigidcli.grading.outcome import Outcome, Unreadable
from rigidcli.grading.principal import eigen
from rigidcli.grading.principal.key import Key
from rigidcli.grading.question import Question, Tolerance
from rigidcli.report import Report
from rigidcli.studies import axes as study
from tests.grading.asking import Asking, answers, cases, judged_alone, require_examples
from tests.grading.asking import rows as typed_rows

Floats = NDArray[np.float64]
Tree = Any

AXES = KINDS["axes"]
CONFIGS = Path(__file__).parents[2] / "configs"

many = settings(max_examples=100, deadline=None)
some = settings(max_examples=50, deadline=None)
few = settings(max_examples=25, deadline=None)

SCALES = st.sampled_from([1e-47, 1e-30, 1e-3, 1.0, 7.3, 1e20, 1e59])
QUATERNIONS = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: math.hypot(*q) > 0.1)
SEEDS = st.integers(0, 2**32)


def key_of(answer: Tree, **options: Any) -> Key:
    key: Key = Asking("axes").literal(answer, **options)
    return key


@cache
def worked(path: Path, settings: tuple[str, ...]) -> tuple[Document, Report]:
    document = load(str(path), settings=settings)
    return document, study.run(document)


def key_from(
    name: str, *, ask: str = "axes", settings: tuple[str, ...] = (), folder: Path = CONFIGS, **options: Any
) -> Key:
    document, report = worked(folder / f"{name}.yaml", settings)
    value: Any = report.tree()
    for step in ask.split(".")[1:]:
        value = value[step]
    question = Question.model_validate({"document": f"{name}.yaml", "ask": ask, **options})
    key: Key = AXES.read_key(Asked(question, value, "", tuple(ask.split(".")), document, report))
    return key


def outcome(key: Key, answer: Tree) -> Outcome:
    return judged_alone("axes", key, answer)


def codes(of: Outcome) -> set[str]:
    return {finding.code for finding in of.findings}


def texts(tensor: Floats) -> Tree:
    return {"tensor": typed_rows(tensor)}


def pairs(moments: Sequence[float] | Floats, rows: Any) -> Tree:
    moments = np.asarray(moments, dtype=float)
    return [
        {"moment": repr(float(m)), "axis": axis} for m, axis in zip(moments, typed_rows(rows), strict=True)
    ]


def symbolic(moments: Sequence[str], rows: Sequence[Sequence[str]]) -> Tree:
    return [{"moment": moment, "axis": list(row)} for moment, row in zip(moments, rows, strict=True)]


ROOTS = {"h": "sqrt(1/2)", "t": "sqrt(1/3)", "s": "sqrt(1/6)"}


def typed(text: str) -> Tree:
    """Pairs in short, as in `1: h h 0; 4: 0 0 1`: a moment, and the components of its axis, with ROOTS."""
    text = re.sub(r"\b[hts]\b", lambda found: ROOTS[found[0]], text)
    told = [pair.split(":") for pair in text.split(";") if pair.strip()]
    return [{"moment": moment.strip(), "axis": axis.split()} for moment, axis in told]


def turned(row: Floats, towards: Floats, angle: float) -> Floats:
    """A unit vector turned by an angle (rad) towards another at right angles to it."""
    turned: Floats = math.cos(angle) * row + math.sin(angle) * towards
    return turned


# --- bodies whose moments and axes are chosen


@dataclass(frozen=True)
class Body:
    """Moments, axes (rows), and indices of those that the tolerance is not to tell apart."""

    moments: Floats
    rows: Floats
    groups: tuple[tuple[int, ...], ...]

    @property
    def tensor(self) -> Floats:
        tensor = self.rows.T * self.moments @ self.rows
        half: Floats = (tensor + tensor.T) / 2
        return half

    def group(self, index: int) -> tuple[int, ...]:
        return next(group for group in self.groups if index in group)


@st.composite
def bodies(draw: st.DrawFn, split: float = 0.0) -> Body:
    """Moments that differ by 4 % or more, or by `split`; linear, flat and round bodies among them."""
    shape = draw(st.sampled_from(["asymmetric", "prolate", "oblate", "spherical", "linear"]))
    rows = np.array(Rotation.from_quat(draw(QUATERNIONS)).as_matrix())
    low, high = draw(st.floats(0.05, 0.95)), draw(st.floats(1.04, 1.96))
    moments, groups = {
        "asymmetric": ([max(low, high - 1 + 1e-9), 1.0, high], ((0,), (1,), (2,))),
        "prolate": ([low, 1.0, 1.0 + split], ((0,), (1, 2))),
        "oblate": ([1.0 - split, 1.0, high], ((0, 1), (2,))),
        "spherical": ([1.0, 1.0, 1.0 + split], ((0, 1, 2),)),
        "linear": ([0.0, 1.0, 1.0], ((0,), (1, 2))),
    }[shape]
    assume(shape != "asymmetric" or moments[0] < 0.96)
    return Body(np.array(moments) * draw(SCALES), rows, groups)


def basis(body: Body, chance: random.Random) -> Floats:
    """Other axes of a body: any orthonormal basis in each group."""
    rows = body.rows.copy()
    for group in body.groups:
        turn = np.array(Rotation.random(random_state=chance.randrange(2**32)).as_matrix())
        if len(group) == 2:
            angle = chance.uniform(0, 2 * math.pi)
            turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        if len(group) > 1:
            rows[list(group)] = turn @ rows[list(group)]
    return rows


def in_any_order(moments: Floats, rows: Floats, chance: random.Random) -> tuple[Floats, Floats]:
    """Pairs in any order, with axes of any sign and length."""
    order = chance.sample(range(3), 3)
    factors = [
        [chance.choice([-1, 1]) * chance.choice([1, 1, 2, 10 ** chance.uniform(-5, 5)])] for _ in order
    ]
    return moments[order], rows[order] * factors


def rewritten(moments: Floats, rows: Floats, chance: random.Random, places: int = 17) -> Tree:
    """Pairs as one of many students types them: in any unit and form, rounded to so many places."""
    unit, scale = chance.choice([("", 1.0), (" kg m^2", 1.0), (" g cm^2", 1e-7), (" kg km^2", 1e6)])
    answer: list[Any] = []
    for moment, row in zip(moments, rows, strict=True):
        text = f"{moment / scale:.{places + 2}e}" if places < 17 else repr(float(moment / scale))
        axis = [f"{c:.{places}f}" if places < 17 else repr(c) for c in row.tolist()]
        if chance.random() < 0.3:
            axis = [f"({c}) * 1" if chance.random() < 0.5 else f"-(-({c}))" for c in axis]
        names = chance.choice(["xyz", "XYZ"])
        named: Any = (
            axis if chance.random() < 0.7 else dict(sorted(zip(names, axis, strict=True), reverse=True))
        )
        answer.append({"moment": text + unit, "axis": named})
    if chance.random() < 0.3:
        return {"moments": [p["moment"] for p in answer], "axes": [p["axis"] for p in answer]}
    return answer


# --- right answers in other forms


@some
@given(bodies(), SEEDS)
def test_every_right_answer_is_right(body: Body, seed: int) -> None:
    chance = random.Random(seed)
    key = key_of(texts(body.tensor))
    for _ in range(3):
        answer = in_any_order(body.moments, basis(body, chance), chance)
        assert outcome(key, rewritten(*answer, chance)).verdict == "correct"


@some
@given(bodies(), SEEDS, st.integers(3, 6))
def test_rounding_to_the_tolerance_is_right(body: Body, seed: int, places: int) -> None:
    chance = random.Random(seed)
    key = key_of(texts(body.tensor), tolerance={"relative": 10.0**-places}, normalized="required")
    for _ in range(3):
        answer = rewritten(body.moments, basis(body, chance), chance, places)
        assert outcome(key, answer).verdict == "correct"


@some
@given(bodies(split=1e-4), SEEDS)
def test_any_basis_of_nearly_equal_moments(body: Body, seed: int) -> None:
    chance = random.Random(seed)
    key = key_of(texts(body.tensor))
    for alike in (False, True):
        # Moments that are told alike, or for each other, as they are within the tolerance.
        moments = body.moments.copy()
        for group in map(list, body.groups):
            moments[group] = moments[group].mean() if alike else moments[chance.sample(group, len(group))]
        answer = in_any_order(moments, basis(body, chance), chance)
        assert outcome(key, rewritten(*answer, chance)).verdict == "correct"


@some
@given(bodies(), SEEDS)
def test_what_keeps_the_rules_is_right(body: Body, seed: int) -> None:
    chance = random.Random(seed)
    rules = {"order": "ascending", "handed": "right", "normalized": "required", "unit": "required"}
    rows = basis(body, chance) * [[chance.choice([-1, 1])] for _ in range(3)]
    rows *= np.sign(np.linalg.det(rows))
    answer = [dict(p, moment=f"{p['moment']} kg m^2") for p in pairs(body.moments, rows)]
    assert outcome(key_of(texts(body.tensor), **rules), answer).verdict == "correct"


@some
@given(st.lists(st.lists(st.integers(-9, 9), min_size=3, max_size=3), min_size=2, max_size=6), SCALES, SEEDS)
def test_point_masses_beside_fifty_digits(positions: list[list[int]], scale: float, seed: int) -> None:
    r = np.array(positions, dtype=np.float64)
    tensor = (r * r).sum() * np.eye(3) - r.T @ r
    assume(tensor.any())
    with mpmath.workdps(50):
        values, vectors = mpmath.eigsy(mpmath.matrix(tensor.tolist()))
        moments = np.array([float(value) for value in values]) * scale
        rows = np.array([[float(vectors[j, k]) for j in range(3)] for k in range(3)])
    moments[np.abs(moments) < 1e-30 * np.abs(moments).max()] = 0.0
    key = key_of(texts(tensor * scale), tolerance={"relative": 1e-6})
    chance = random.Random(seed)
    assert outcome(key, rewritten(*in_any_order(moments, rows, chance), chance)).verdict == "correct"
    # One axis in the plane of two others is none, unless their moments are equal.
    low, high = chance.choice([(0, 1), (1, 2), (0, 2)])
    if moments[high] - moments[low] > 1e-5 * moments[2]:
        rows[low] = turned(rows[low], rows[high], chance.uniform(0.01, 1.5))
        assert outcome(key, rewritten(moments, rows, chance)).verdict != "correct"


# --- wrong answers


def wronged(body: Body, chance: random.Random, least: float) -> tuple[str, Tree, dict[str, str]]:
    """An answer, what was done to it so that it is wrong by more than `least` allows, and a rule for that."""
    moments, rows = body.moments.copy(), basis(body, chance)
    k, rule = chance.randrange(3), {}
    apart = [j for j in range(3) if j not in body.group(k)]
    ways = ["moment", "length", "missing", "zero", "left-handed"]
    if apart:
        ways += ["turned", "pairing", "both turned", "just turned"]
    if any(len(group) > 1 for group in body.groups):
        ways += ["oblique", "just oblique", "double"]
    way = chance.choice(ways)
    if way == "moment":
        size = moments[k] or moments.max()
        moments[k] += size * chance.choice([-1, 1]) * 10 ** chance.uniform(math.log10(1.1 * least), 2)
    elif way == "length":
        rule = {"normalized": "required"}
        rows[k] *= chance.choice([1 / (1 + 3 * least), 1 + 3 * least, 0.5, 2.0, 1e-200, 1e300])
    elif way == "zero":
        rows[k] = 0
    elif way == "left-handed":
        rule = {"handed": "right"}
        rows[k] *= -np.sign(np.linalg.det(rows))
    elif way == "missing":
        moments, rows = np.delete(moments, k), np.delete(rows, k, axis=0)
    elif "turned" in way:
        j, angle = chance.choice(apart), 10 ** chance.uniform(math.log10(3 * least), math.log10(1.5))
        angle = 1.05 * least if way == "just turned" else angle
        one, other = turned(rows[k], rows[j], angle), turned(rows[j], -rows[k], angle)
        rows[k] = one
        if way != "turned":
            rows[j] = other
    elif way == "pairing":
        j = chance.choice(apart)
        rows[[k, j]] = rows[[j, k]]
    else:
        group = next(group for group in body.groups if len(group) > 1)
        i, j = chance.sample(group, 2)
        away = 0.0 if way == "double" else chance.uniform(0.0, math.pi / 2 - 3 * least)
        rows[j] = turned(rows[i], rows[j], math.pi / 2 - 2.1 * least if way == "just oblique" else away)
    if way not in ("length", "left-handed", "missing"):
        moments, rows = in_any_order(moments, rows, chance)
    return way, rewritten(moments, rows, chance), rule


@many
@given(st.one_of(bodies(), bodies(split=2e-2)), SEEDS, st.sampled_from([1e-2, 1e-3, 1e-5]))
def test_no_wrong_answer_is_right(body: Body, seed: int, tolerance: float) -> None:
    chance = random.Random(seed)
    # Moments that differ by more than the tolerance have axes of their own.
    same = [tuple(np.flatnonzero(body.moments == moment).tolist()) for moment in body.moments]
    body = Body(body.moments, body.rows, tuple(dict.fromkeys(same)))
    for _ in range(4):
        way, answer, rule = wronged(body, chance, tolerance)
        judged = outcome(key_of(texts(body.tensor), tolerance={"relative": tolerance}, **rule), answer)
        assert judged.verdict in ("partial", "incorrect"), way
        assert 0 <= judged.share < 1
        assert judged.findings
        # Nor does what is told measure how far off an answer is.
        assert not any(finding.detail for finding in judged.findings)


@many
@given(bodies(split=1e-4), SEEDS, st.floats(0.02, math.pi / 2 - 0.02))
def test_moments_that_a_tolerance_tells_apart_have_their_own_axes(
    body: Body, seed: int, angle: float
) -> None:
    chance, group = random.Random(seed), max(body.groups, key=len)
    i, j = group[0], group[-1]
    assume(body.moments[i] < body.moments[j])
    key = key_of(texts(body.tensor), tolerance={"relative": 1e-6})
    other, exchanged = body.rows.copy(), body.moments.copy()
    other[[i, j]] = turned(other[i], other[j], angle), turned(other[j], -other[i], angle)
    exchanged[[i, j]] = exchanged[[j, i]]
    for moments, rows, verdict in (
        (body.moments, body.rows, "correct"),
        (body.moments, other, "partial"),
        (exchanged, body.rows, "partial"),
    ):
        answer = in_any_order(moments, rows, chance)
        assert outcome(key, rewritten(*answer, chance)).verdict == verdict
    assert outcome(key_of(texts(body.tensor)), pairs(exchanged, other)).verdict == "correct"


@some
@given(bodies(), st.lists(st.floats(-1e3, 1e3), min_size=12, max_size=12))
def test_random_numbers_are_not_right(body: Body, numbers: list[float]) -> None:
    rows = [numbers[3 * k : 3 * k + 3] for k in range(3)]
    judged = outcome(key_of(texts(body.tensor)), pairs(numbers[9:], rows))
    assert judged.verdict != "correct"
    assert not {"sign_error", "power_of_ten", "other_frame"} & codes(judged)


# --- what is said of them

PLATE = {"tensor": [["2", "-1", "0"], ["-1", "2", "0"], ["0", "0", "4"]]}
RIGHT = typed("1: h h 0; 3: h -h 0; 4: 0 0 1")
CUBE = {"Ixx": "8", "Iyy": "8", "Izz": "8", "Ixy": "-3", "Ixz": "-3", "Iyz": "-3"}
BALL = {"tensor": [["3", "0", "0"], ["0", "3", "0"], ["0", "0", "3"]]}
DIAGONAL, ACROSS, THIRD = np.array([[1, 1, 1], [1, -1, 0], [1, 1, -2]]) / np.sqrt([[3], [2], [6]])
SKEW = np.array(Rotation.from_rotvec([0.4, -0.7, 0.3]).as_matrix())
KEYS = {"plate": PLATE, "cube": CUBE, "ball": BALL}

TOLD = """
plate                     | 1: h h 0; 3: h -h 0; 4: 0 0 1        |                            | 1
plate                     | 3: h h 0; 1: h -h 0; 4: 0 0 1        | moment_axis_pairing        | 2/3
plate | 1: 0 0 1; 3: h -h 0; 4: .6 0 .8 \
    | moment_axis_pairing@pair-1 not_an_eigenvector@axis-3 axes_not_orthogonal | 4/6
plate | 1: h h 0; 3: h -h 0; 4: .6 0 .8 | not_an_eigenvector@axis-3 axes_not_orthogonal | 5/6
plate orthogonal=optional | 1: h h 0; 3: h -h 0; 4: .6 0 .8      | not_an_eigenvector@axis-3  | 5/6
plate                     | 1: h h 0; 3.01: h -h 0; 4: 0 0 1     | outside_tolerance@moment-2 | 5/6
plate                     | 1: h h 0; 3.002: h -h 0; 4: 0 0 1    |                            | 1
plate                     | 1: 1 1 0; 3: h -h 0; 4: 0 0 -2       |                            | 1
plate normalized=required | 1: h h 0; 3: h -h 0; 4: 0 0 -2       | axis_not_normalised@axis-3 | 5/6
plate normalized=required | 1: h h 0; 3: h -h 0; 4: 0 0 1.0009   |                            | 1
cube normalized=required | 2.00: .577 .577 .577; 11.0: .816 -.408 -.408; 11: 0 .707 -.707 |  | 1
cube normalized=required | 2: .58 .58 .58; 11: .816 -.408 -.408; 11: 0 .707 -.707 \
    | axis_not_normalised@axis-1 | 5/6
plate                     | 1: 0 0 0; 3: h -h 0; 4: 0 0 1        | zero_vector@axis-1         | 5/6
ball                      | 3: 0 0 0; 3: 0 1 0; 3: 0 0 1         | zero_vector@axis-1         | 5/6
plate                     | 1: h h 0; 3: -h h 0; 4: 0 0 -1       |                            | 1
plate handed=right        | 1: h h 0; 3: h -h 0; 4: 0 0 1        | left_handed                | 5/6
plate handed=right        | 3: h -h 0; 1: h h 0; 4: 0 0 1        |                            | 1
plate handed=right        | 1: h h 0; 3: h -h 0                  | missing_axis               | 2/3
plate order=ascending     | 1: h h 0; 3: h -h 0; 4: 0 0 1        |                            | 1
plate order=ascending     | 4: 0 0 1; 3: h -h 0; 1: h h 0        | wrong_order                | 1/3
plate order=ascending | 4: 0 0 1; 3: h -h 0; 1.1: h h 0 | outside_tolerance@moment-3 wrong_order | 1/3
plate                     | 4: 0 0 1; 3: h -h 0; 1: h h 0        |                            | 1
plate                     |                                      | missing_axis               | 0
plate                     | 1: h h 0; 3: h -h 0                  | missing_axis               | 2/3
plate                     | 3: h h 0                             | missing_axis moment_axis_pairing | 1/6
cube                      | 2: t t t; 11: h -h 0; 11: s s -2*s   |                            | 1
cube                      | 2: t t t; 2: h -h 0; 11: s s -2*s    | multiplicity               | 5/6
cube                      | 2: t t t; 11: h -h 0                 | missing_axis multiplicity  | 2/3
cube                      | 2: t t t; 11: h -h 0; 11: s s -2*s; 11: 0 h -h | multiplicity               | 3/4
cube                      | 2: t t t; 11: h -h 0; 11: s s -2*s; 5: t t t | outside_tolerance@moment-4 | 3/4
cube                      | 2: t t t; 11: h -h 0; 11: -h h 0     | axes_dependent             | 5/6
cube                      | 2: t t t; 11: h -h 0; 11: h 0 -h     | axes_not_orthogonal        | 5/6
cube orthogonal=optional  | 2: t t t; 11: h -h 0; 11: h 0 -h     |                            | 1
ball orthogonal=optional  | 3: 1 0 0; 3: 0 1 0; 3: .6 .8 0       | axes_dependent             | 5/6
ball                      | 3: .6 .8 0; 3: .8 -.6 0; 3: 0 0 1    |                            | 1
ball | 3: .6 .8 0; 7: .8 -.6 0; 8: 0 0 1 | outside_tolerance@moment-2 outside_tolerance@moment-3 | 1/3
cube                      | 4: t t t; 22: h -h 0; 22: s s -2*s   | constant_factor            | 1/2
cube                      | 1/6: t t t; 11/12: h -h 0; 11/12: s s -2*s | constant_factor            | 1/2
cube                      | -2: t t t; -11: h -h 0; -11: s s -2*s | sign_error                 | 1/2
cube                      | 2e4: t t t; 11e4: h -h 0; 11e4: s s -2*s | power_of_ten               | 1/2
cube                      | 2e-7: t t t; 11e-7: h -h 0; 11e-7: s s -2*s | power_of_ten               | 1/2
cube                      | 4: t t t; 11: h -h 0; 11: s s -2*s   | outside_tolerance@moment-1 | 5/6
ball                      | 6: 1 0 0; 6: 0 1 0; 6: 0 0 1         | constant_factor            | 0
plate unit=required | 1 kg m^2: h h 0; 3 kg m^2: h -h 0; 4 kg m^2: 0 0 1 |  | 1
plate unit=required       | 1 kg m^2: h h 0; 3: h -h 0; 4: 0 0 1 | unit_missing@moment-2,-moment-3 | 4/6
plate unit=required | 2: h h 0; 6: h -h 0; 8: 0 0 1 \
    | constant_factor unit_missing@moment-1,-moment-2,-moment-3 | 1/2
"""
"""A key with options, an answer, what is told (a code with its place), and the share of the points."""


def changed(index: int, **parts: Any) -> Tree:
    return [pair | parts if k == index else pair for k, pair in enumerate(RIGHT)]


@pytest.mark.parametrize("case", TOLD.strip().splitlines())
def test_what_is_told(case: str) -> None:
    asked, answer, told, share = map(str.strip, case.split("|"))
    name, *options = asked.split()
    judged = outcome(key_of(KEYS[name], **dict(each.split("=") for each in options)), typed(answer))
    found = [f"{each.code}@{each.place}".rstrip("@").replace(" ", "-") for each in judged.findings]
    assert found == told.split()
    assert judged.share == pytest.approx(float(Fraction(share)))
    assert not any(each.detail for each in judged.findings)


@pytest.mark.parametrize("angle", [30, 4.3, 0.1, 12.345])
def test_how_far_an_axis_is_off_is_not_told(angle: float) -> None:
    rows = np.eye(3)
    rows[:2] = Rotation.from_rotvec([0, 0, math.radians(angle)]).as_matrix()[:2]
    judged = outcome(key_of(texts(np.diag([1.0, 1.5, 2.25]))), pairs([1, 1.5, 2.25], rows))
    told = "is not along a principal axis"
    assert [sentence(found) for found in judged.findings] == [f"axis 1: {told}", f"axis 2: {told}"]
    assert judged.share == pytest.approx(4 / 6)


@pytest.mark.parametrize("size", ["1e-320", "1e-200", "1e200", "1.7e308"])
def test_any_length_where_it_is_free(size: str) -> None:
    answer = changed(0, axis=[size, size, "0"])
    assert outcome(key_of(PLATE), answer).verdict == "correct"
    assert outcome(key_of(PLATE, normalized="required"), answer).verdict == "partial"


def test_what_is_not_told_apart_has_no_order() -> None:
    rows = np.array([DIAGONAL, ACROSS, THIRD])
    close = key_of(texts(rows.T * [2, 11.0001, 11.0003] @ rows), order="ascending")
    assert outcome(close, pairs([2, 11.0003, 11.0001], rows[[0, 2, 1]])).verdict == "correct"


def test_a_factor_is_none_where_axes_are_wrong() -> None:
    judged = outcome(key_of(CUBE), pairs([4, 22, 22], SKEW))
    assert codes(judged) >= {"not_an_eigenvector", "outside_tolerance"}


def test_axes_written_otherwise() -> None:
    body = Body(np.array([2.0, 3.0, 4.0]), SKEW, ((0,), (1,), (2,)))
    key = key_of(texts(body.tensor))
    assert codes(outcome(key, pairs(body.moments, SKEW))) == set()
    assert codes(outcome(key, pairs(body.moments, SKEW.T))) == {"transposed"}
    for order in ([1, 2, 0], [0, 2, 1], [2, 1, 0]):
        assert codes(outcome(key, pairs(body.moments, SKEW[:, order]))) == {"axes_permuted"}
    # In a plane, the other sign of Ixy and rows for columns come to the same.
    rows = np.array([[0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1]])
    judged = outcome(key_of(texts(rows.T * [2, 3, 4] @ rows)), pairs([2, 3, 4], rows.T))
    assert codes(judged) == {"not_an_eigenvector"}


# --- keys from documents


def solutions(tensor: Floats) -> Tree:
    values, vectors = np.linalg.eigh(tensor)
    return pairs(values, vectors.T)


def test_the_worked_examples() -> None:
    answers = {
        "cube_corner": typed("2: t t t; 11: h -h 0; 11: s s -2*s"),
        "three_masses": typed("10: 1 0 0; 7: 0 h h; 5: 0 h -h"),
        "triangular_plate": RIGHT,
    }
    for name in answers:
        right = [other for other, answer in answers.items() if outcome(key_from(name), answer).share == 1]
        assert right == [name]


def test_a_molecule() -> None:
    # e1 joins the hydrogens, and e3 is normal to the plane; the moments are those of the file's source.
    key, moments = key_from("water"), np.array([1.020e-47, 1.918e-47, 2.938e-47])
    assert outcome(key, pairs(moments, np.eye(3))).verdict == "correct"
    assert codes(outcome(key, pairs(1e7 * moments, np.eye(3)))) == {"power_of_ten"}


def test_mistakes_on_the_way_to_the_tensor() -> None:
    # The file's own numbers: a known tensor about the centre of mass, shifted and turned.
    central = np.array([[0.42, 0.03, -0.01], [0.03, 0.36, 0.02], [-0.01, 0.02, 0.51]])
    d, turn = np.array([0.1, 0, 0.15]), math.radians(30)
    frame = np.array([[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]])
    shift = 12.5 * (d @ d * np.eye(3) - np.outer(d, d))
    key = key_from("known_tensor")

    def in_frame(tensor: Floats) -> Floats:
        turned: Floats = frame.T @ tensor @ frame
        return turned

    right = in_frame(central + shift)
    flipped = 2 * np.diag(right.diagonal()) - right
    e = in_frame(shift)
    assert outcome(key, solutions(right)).verdict == "correct"
    for tensor, code in (
        (central + shift, "other_frame"),
        (frame @ (central + shift) @ frame.T, "other_frame"),
        (in_frame(central), "parallel_axis_missing"),
        (in_frame(central - shift), "parallel_axis_sign"),
        (in_frame(central) + np.diag(e.diagonal()), "parallel_axis_off_diagonal_missing"),
        (flipped, "products_of_inertia_sign"),
        (np.diag(right.diagonal()), "products_of_inertia_missing"),
    ):
        assert codes(outcome(key, solutions(tensor))) == {code}


# --- symbols

NO_VALUES = ("parameters.m=null", "parameters.a=null")
HALF = "0.70710678118654752"
MASSES_ROWS = [["0", HALF, f"-{HALF}"], ["0", HALF, HALF], ["1", "0", "0"]]
ABC = dict.fromkeys("abc", "positive")


@pytest.fixture(scope="module")
def masses() -> Key:
    """J. R. Taylor, Classical Mechanics, problem 10.35 as printed: 5, 7 and 10 m a^2."""
    return key_from("three_masses", settings=NO_VALUES)


@pytest.mark.parametrize(
    "moments",
    [
        "5*m*a^2 7*m*a^2 10*m*a^2",
        "5*a**2*m (6+1)*m*a*a (3*a)^2*m+m*a^2",
        "5.00*m*a^2 sqrt(49)*m*a^2 10*m*abs(a)^2",
        "4.998*m*a^2 7.003*m*a^2 10.005*m*a^2",
    ],
)
def test_moments_in_symbols(masses: Key, moments: str) -> None:
    answer = symbolic(moments.split(), MASSES_ROWS)
    for order in ((0, 1, 2), (2, 0, 1), (1, 0, 2)):
        assert outcome(masses, [answer[k] for k in order]).verdict == "correct"
    assert outcome(pickle.loads(pickle.dumps(masses)), answer).verdict == "correct"


@cases("""
    expected | share | moments
    number_for_symbol | 1/2 | 5 7 10
    number_for_symbol | 5/6 | 5 7*m*a^2 10*m*a^2
    outside_tolerance | 1/2 | 5*m*a 7*m*a 10*m*a
    outside_tolerance | 5/6 | 5*m*a^2 7*m*a^2 10*m*a^3  5*m*a^2 7*m*a^2 10*sqrt(-m)*a^2
    5*m*a^2 7*m*a^2 10.02*m*a^2  5*m*a^2+abs(a-1)+a-1 7*m*a^2 10*m*a^2
    moment_axis_pairing | 2/3 | 7*m*a^2 5*m*a^2 10*m*a^2
    constant_factor | 1/2 | 10*m*a^2 14*m*a^2 20*m*a^2
    sign_error | 1/2 | -5*m*a^2 -7*m*a^2 -10*m*a^2
    """)
def test_wrong_moments_in_symbols(masses: Key, expected: str, share: str, moments: str) -> None:
    judged = outcome(masses, symbolic(moments.split(), MASSES_ROWS))
    assert codes(judged) == {expected}
    assert judged.share == pytest.approx(float(Fraction(share)))
    units = symbolic(["5 kg m^2", "7*m*a^2", "10*m*a^2"], MASSES_ROWS)
    assert codes(outcome(masses, units)) == {"number_for_symbol"}


@cases("""
    nothing
    abs(a-3)+a-3  abs(a-1/1000)-a+1/1000  exp(-1e6*(a-0.123)^2)  log(1+exp(1000*(a-20)))  (a/9)^200*m
      1e-12/((a-0.9)^2+1e-12)  1e-9*a^9
    """)
def test_what_vanishes_for_some_values_only_is_not_right(masses: Key, nothing: str) -> None:
    answer = symbolic([f"5*m*a^2 + {nothing}", "7*m*a^2", "10*m*a^2"], MASSES_ROWS)
    judged = outcome(masses, answer)
    assert (judged.verdict, judged.share, codes(judged)) == ("review", 0, {"undecided"})
    rows = [["0", "m", f"-m-({nothing})"], *MASSES_ROWS[1:]]
    judged = outcome(key_from("three_masses", ask="axes.axes", settings=NO_VALUES), rows)
    assert (judged.verdict, codes(judged)) == ("review", {"undecided"})
    unit = [["0", HALF, f"-{HALF}-({nothing})"], *MASSES_ROWS[1:]]
    strict = key_from("three_masses", settings=NO_VALUES, normalized="required")
    answer = symbolic(["5*m*a^2", "7*m*a^2", "10*m*a^2"], unit)
    assert codes(outcome(strict, answer)) == {"undecided"}


@pytest.mark.parametrize(
    "moment",
    ["5*m*a^3/a", "5*sqrt(m^2*a^4)", "5*m*a*abs(a)", "m*a^2*(4.001+sin(a)^2+cos(a)^2)", "sqrt(24.99)*m*a^2"],
)
def test_what_is_proved_needs_no_review(masses: Key, moment: str) -> None:
    answer = symbolic([moment, "7*m*a^2", "10*m*a^2"], [["0", "a/m", "-a/m"], *MASSES_ROWS[1:]])
    assert outcome(masses, answer).verdict == "correct"


@pytest.mark.parametrize(
    ("axes", "told"),
    [
        ("0 1 -1; 0 h h; 1 0 0", ""),
        ("0 cos(pi/3) -sin(pi/3); 0 sin(pi/3) cos(pi/3); 1 0 0", "not_an_eigenvector"),
        ("0 h -h; 0 h h", "missing_axis"),
        ("0 h -h; 0 h h; sqrt(-a) 0 0", "not_an_eigenvector"),
    ],
)
def test_axes_to_moments_in_symbols(masses: Key, axes: str, told: str) -> None:
    pairs = zip(("5*m*a^2", "7*m*a^2", "10*m*a^2"), axes.split(";"), strict=False)
    answer = typed("; ".join(f"{moment}: {axis}" for moment, axis in pairs))
    assert codes(outcome(masses, answer)) == set(told.split())
    assert not any(each.detail for each in outcome(masses, answer).findings)


@pytest.mark.parametrize(
    ("moment", "code"),
    [("5*M*a^2", "unknown_symbol"), ("5*m*", "parse_error"), ("5 kg", "unit_incompatible")],
)
def test_symbols_that_cannot_be_read(masses: Key, moment: str, code: str) -> None:
    with pytest.raises(Unreadable) as refused:
        outcome(masses, symbolic([moment, "7*m*a^2", "10*m*a^2"], MASSES_ROWS))
    assert (refused.value.finding.code, refused.value.finding.place) == (code, "moment 1")


def test_any_basis_of_equal_moments_in_symbols() -> None:
    key = key_from("cube_symbolic")
    moments = ["M*a^2/6", "11*M*a^2/12", "11*M*a^2/12"]
    for angle in (0.0, 0.7, 2.0):
        rows = np.array([DIAGONAL, turned(ACROSS, THIRD, angle), turned(THIRD, -ACROSS, angle)]).astype(str)
        assert outcome(key, symbolic(moments, rows.tolist())).verdict == "correct"
        assert codes(outcome(key, symbolic(moments[:1] * 2 + moments[2:], rows.tolist()))) == {"multiplicity"}
        # About the centre of mass every direction is an axis.
        central = outcome(key, symbolic(moments[:1] * 3, rows.tolist()))
        assert codes(central) == {"parallel_axis_missing"}


def test_a_frame_turned_by_an_angle_without_a_value(tmp_path: Path) -> None:
    points = "points: [[1, 1, 0, 0], [1, -1, 0, 0], [1, 0, 2, 0], [1, 0, -2, 0]]"
    text = f"parameters: {{beta: null}}\nbody: {{{points}}}\nframe: {{axis: [0, 0, 1], angle: beta}}\n"
    (tmp_path / "turned.yaml").write_text(text)
    key = key_from("turned", folder=tmp_path)
    for answer, told in (
        ("8: cos(beta) -sin(beta) 0; 2: sin(beta) cos(beta) 0; 10: 0 0 1", ""),
        ("2: cos(beta) -sin(beta) 0; 8: sin(beta) cos(beta) 0; 10: 0 0 1", "moment_axis_pairing"),
        ("8: 1 0 0; 2: 0 1 0; 10: 0 0 1", "other_frame"),
        # Turned the other way, which the other sign of Ixy explains as well.
        ("8: cos(beta) sin(beta) 0; 2: -sin(beta) cos(beta) 0; 10: 0 0 1", "not_an_eigenvector"),
        ("8: 0.6 0.8 0; 2: 0.8 -0.6 0; 10: 0 0 1", "number_for_symbol"),
    ):
        assert codes(outcome(key, typed(answer))) == set(told.split())


@cache
def between_x_and_y() -> Key:
    return key_of({"tensor": [["a", "b", "0"], ["b", "a", "0"], ["0", "0", "c"]]}, symbols=ABC)


@some
@given(SEEDS)
def test_a_literal_tensor_in_symbols(seed: int) -> None:
    # The axes of [[a, b], [b, a]] lie between x and y, whatever a and b are; a + b and a - b may cross c.
    chance = random.Random(seed)
    key = between_x_and_y()
    moments = [
        chance.choice(["a+b", "b+a", "(a^2-b^2)/(a-b)"]),
        chance.choice(["a-b", "-(b-a)"]),
        chance.choice(["c", "sqrt(c^2)"]),
    ]
    rows = [["1/sqrt(2)", HALF, "0"], [HALF, "-sqrt(2)/2", "0"], ["0", "0", "-1"]]
    answer = symbolic(moments, rows)
    chance.shuffle(answer)
    assert outcome(key, answer).verdict == "correct"
    k = chance.randrange(3)
    wrong = [dict(pair) for pair in answer]
    wrong[k]["moment"] = chance.choice(["a", "2*b", "1", f"1.01*({wrong[k]['moment']})", "a+b+c"])
    assert outcome(key, wrong).share == pytest.approx(5 / 6)
    wrong = [dict(pair) for pair in answer]
    wrong[k]["axis"] = [["0.6", "0.8", "0"], ["0.6", "0", "0.8"], ["a", "b", "c"]][chance.randrange(3)]
    assert outcome(key, wrong).verdict == "partial"


def test_axes_that_depend_on_symbols() -> None:
    # [[3, 4], [4, -3]] over 5, with 3 = u^2 - v^2 and 4 = 2 u v, has the axes (u, v) and (-v, u).
    tensor = {"tensor": [["a^2-b^2", "2*a*b", "0"], ["2*a*b", "b^2-a^2", "0"], ["0", "0", "c"]]}
    key, strict = key_of(tensor, symbols=ABC), key_of(tensor, symbols=ABC, normalized="required")
    right = typed("a^2+b^2: a b 0; -(a^2+b^2): -b a 0; c: 0 0 1")
    assert outcome(key, right).verdict == "correct"
    assert codes(outcome(strict, right)) == {"axis_not_normalised"}
    crossed = typed("-(a^2+b^2): a b 0; a^2+b^2: -b a 0; c: 0 0 1")
    assert codes(outcome(key, crossed)) == {"moment_axis_pairing"}
    judged = outcome(key, typed("a^2+b^2: 1 2 0; -(a^2+b^2): -2 1 0; c: 0 0 1"))
    assert codes(judged) == {"number_for_symbol"}
    assert "a**2 + b**2 along (a/sqrt(a**2 + b**2)," in sentence(judged.findings[0], full=True)


@pytest.mark.parametrize("one", ["1 0 0", ".6 .8 0"])
def test_pairs_in_symbols_are_a_key_too(one: str) -> None:
    other = "0 1 0" if one == "1 0 0" else ".8 -.6 0"
    key = f"a: {one}; b: {other}; a+b: 0 0 1"
    assert outcome(key_of(typed(key), symbols=ABC), typed(f"b: {other}; a+b: 0 0 1; a: {one}")).share == 1
    crossed = typed(f"b: {one}; a: {other}; a+b: 0 0 1")
    assert codes(outcome(key_of(typed(key), symbols=ABC), crossed)) == {"moment_axis_pairing"}
    with pytest.raises(ValueProblem, match="the order of the moments depends on the symbols"):
        key_of(typed(key), symbols=ABC, order="ascending")
    ordered = key_of(typed(f"a: {one}; 2*a: {other}; 2.5*a: 0 0 1"), symbols=ABC, order="ascending")
    answer = typed(f"a: {one}; 2*a: {other}; 5*a/2: 0 0 1")
    assert outcome(ordered, answer).verdict == "correct"
    assert codes(outcome(ordered, answer[::-1])) == {"wrong_order"}


@pytest.mark.parametrize(
    "key",
    [
        {"tensor": [["a", "b", "0"], ["c", "a", "0"], ["0", "0", "c"]]},
        {"tensor": [["a", "0", "0"], ["0", "q", "0"], ["0", "0", "c"]]},
        {"tensor": [["a-a", "0", "0"], ["0", "0", "0"], ["0", "0", "0"]]},
        symbolic(["a", "b", "c"], [["1", "0", "0"], ["0", "1", "0"], ["0", "1", "0"]]),
    ],
)
def test_a_bad_key_in_symbols_is_refused(key: Tree) -> None:
    with pytest.raises(ValueProblem):
        key_of(key, symbols=ABC)


# --- axes alone


@cases("""
    code | share | answer
    none | 1 | 0 h -h; 0 h h; 1 0 0  -1 0 0; 0 h h; 0 h -h
    missing_axis | 2/3 | 0 h -h; 0 h h
    axes_dependent | 2/3 | 0 h -h; 0 h -h; 0 h h
    axis_not_normalised | 2/3 | 0 2 2; 0 h -h; 1 0 0
    zero_vector | 2/3 | 0 0 0; 0 h h; 1 0 0
    not_an_eigenvector | 1/3 | 1 0 0; 0 .8 .6; 0 .6 -.8
    """)
def test_axes_alone_where_they_are_asked(code: str, share: str, answer: str) -> None:
    rows = [pair["axis"] for pair in typed(";".join(f":{axis}" for axis in answer.split(";")))]
    judged = outcome(key_from("three_masses", ask="axes.axes", normalized="required"), rows)
    assert codes(judged) == {code} - {"none"}
    assert judged.share == pytest.approx(float(Fraction(share)))
    assert all("along (0, 0.707107, -0.707107)" in sentence(f, full=True) for f in judged.findings[:1])
    assert not any("707" in sentence(found) for found in judged.findings)


def test_axes_alone_or_with_moments() -> None:
    key = key_from("three_masses", ask="axes.axes")
    assert outcome(key, symbolic(["5", "7", "10"], MASSES_ROWS)).verdict == "correct"
    assert codes(outcome(key, symbolic(["5", "7", "11"], MASSES_ROWS))) == {"outside_tolerance"}
    for other, rows in ((key, [*MASSES_ROWS, MASSES_ROWS[0]]), (key_from("three_masses"), MASSES_ROWS)):
        with pytest.raises(Unreadable):
            outcome(other, rows)


def test_axes_alone_of_equal_moments() -> None:
    key = key_from("cube_symbolic", ask="axes.axes")
    rows = np.array([turned(ACROSS, THIRD, 0.4), DIAGONAL, turned(THIRD, -ACROSS, 0.4)])
    assert outcome(key, rows.astype(str).tolist()).verdict == "correct"
    rows[2] = rows[0]
    assert codes(outcome(key, rows.astype(str).tolist())) == {"axes_dependent"}
    rows[2] = turned(ACROSS, THIRD, 1.4)
    assert codes(outcome(key, rows.astype(str).tolist())) == {"axes_not_orthogonal"}
    # Without products of inertia every direction would be an axis: this explains nothing.
    assert codes(outcome(key, np.eye(3).astype(str).tolist())) == {"not_an_eigenvector"}


def test_axes_alone_in_order() -> None:
    key = key_from("three_masses", ask="axes.axes", settings=NO_VALUES, order="ascending", handed="right")
    assert outcome(key, MASSES_ROWS).verdict == "correct"
    assert "wrong_order" in codes(outcome(key, MASSES_ROWS[::-1]))
    assert codes(outcome(key, [["0", f"-{HALF}", HALF], *MASSES_ROWS[1:]])) == {"left_handed"}


def test_a_tensor_that_is_asked_for_is_the_one_that_is_judged() -> None:
    # The cube about its centre has any axes, and moments 2; about its corner 2, 11, 11.
    key = key_from("cube_corner", ask="axes.tensor_com", kind="axes")
    assert outcome(key, pairs([2, 2, 2], SKEW)).verdict == "correct"
    assert outcome(key, pairs([2, 11, 11], [DIAGONAL, ACROSS, THIRD])).verdict != "correct"


# --- literal keys


@pytest.mark.parametrize(
    ("key", "answer"),
    [
        ("1: h h 0; 3: h -h 0; 4: 0 0 1", "4: 0 0 1; 1: h h 0; 3: h -h 0"),
        ("1: 1 1 0; 3: 1 -1 0; 4: 0 0 1", "1: h h 0; 3: h -h 0; 4: 0 0 1"),
        # Rounded, and where moments are equal, not at right angles.
        ("2: .577 .577 .577; 11: .816 -.408 -.408; 11: 0 .707 -.707", "11: h -h 0; 2: t t t; 11: s s -2*s"),
        ("2: 1 1 1; 11: 1 -1 0; 11: 1 0 -1", "11: h -h 0; 2: t t t; 11: s s -2*s"),
    ],
)
def test_pairs_are_a_key_too(key: str, answer: str) -> None:
    apart = {"moments": [p["moment"] for p in typed(key)], "axes": [p["axis"] for p in typed(key)]}
    for form in (typed(key), apart):
        assert outcome(key_of(form), typed(answer)).verdict == "correct"


@answers(
    """
    key
    12345  {}  {tensor: 12345}  {tensor: [[12345, 0], [0, 12345]]}
      {tensor: [[12345, 1, 0], [0, 12345, 0], [0, 0, 12345]]}
      {tensor: [[12345, 0, 0], [0, 1, 0], [0, 0, 1]]}  {tensor: [[0, 0, 0], [0, 0, 0], [0, 0, 0]]}
      {tensor: [[1e300, 0, 0], [0, 1e300, 0], [0, 0, 1e300]]}
      {tensor: [[12345x, 0, 0], [0, 1, 0], [0, 0, 1]]}  {Ixx: 12345, Iyy: 12345}
    """,
    RIGHT[:2],
    [*RIGHT[:2], dict(RIGHT[0], moment="12345")],
    [*RIGHT[:2], {"moment": "12345", "axis": ["0.5", "0.5", "0.7"]}],
    [*RIGHT[:2], {"moment": "12345", "axis": ["0", "0.01", "1"]}],
    [*RIGHT[:2], {"moment": "12345", "axis": ["0", "0", "0"]}],
    [*RIGHT[:2], {"moment": "12345 m", "axis": ["0", "0", "1"]}],
)
def test_a_bad_key_is_refused_without_being_told(key: Tree) -> None:
    with pytest.raises(ValueProblem) as refused:
        key_of(key)
    assert "12345" not in refused.value.message


@pytest.mark.parametrize("tolerance", [{"angle": 1.0}, {"figures": "strict", "significant_figures": 3}])
def test_a_tolerance_that_cannot_be_meant(tolerance: dict[str, Any]) -> None:
    with pytest.raises(ValueProblem):
        key_of(PLATE, tolerance=tolerance)


# --- units, forms, and conventions of keys and answers

GRAMS = {"tensor": [["2 g cm^2", "-1 g cm^2", "0"], ["-1 g cm^2", "2 g cm^2", "0"], ["0", "0", "4 g cm^2"]]}
IN_GRAMS = [dict(pair, moment=f"{pair['moment']} g cm^2") for pair in RIGHT]


@pytest.mark.parametrize("key", [GRAMS, IN_GRAMS])
def test_a_number_without_a_unit_is_in_that_of_the_key(key: Tree) -> None:
    small = key_of(key)
    for right in (RIGHT, IN_GRAMS, [dict(p, moment=f"{p['moment']}e-7 kg m^2") for p in RIGHT]):
        assert outcome(small, right).verdict == "correct"
    for wrong in ([dict(p, moment=f"{p['moment']}e-7") for p in RIGHT], RIGHT[:2]):
        judged = outcome(small, wrong)
        assert judged.verdict == "partial"
        assert "expected 1 g cm^2 along (" in sentence(judged.findings[0], full=True)
    require_examples("axes", small)


def test_a_zero_needs_no_unit_nor_do_symbols() -> None:
    rod = key_of({"tensor": [["0", "0", "0"], ["0", "1", "0"], ["0", "0", "1"]]}, unit="required")
    answer = symbolic(["0", "1 kg m^2", "1 kg m^2"], np.eye(3).astype(str).tolist())
    assert outcome(rod, answer).verdict == "correct"
    assert require_examples("axes", rod) >= {"unit_missing", "missing_axis"}
    symbols = key_from("three_masses", settings=NO_VALUES, unit="required")
    assert outcome(symbols, symbolic(["5*m*a^2", "7*m*a^2", "10*m*a^2"], MASSES_ROWS)).verdict == "correct"


def test_components_by_their_names() -> None:
    named = [dict(p, axis=dict(zip("xyz", p["axis"], strict=True))) for p in RIGHT]
    mixed = [named[0], {"moment": "3", "axis": {"Z": "0", "X": "1", " y": "-1"}}, RIGHT[2]]
    for answer in (named, mixed, {"moments": ["1", "3", "4"], "axes": [p["axis"] for p in named]}):
        assert outcome(key_of(PLATE), answer).verdict == "correct"
        assert outcome(key_of(answer), RIGHT).verdict == "correct"
    for names in ("xy", "xyw", "xyzw", ("x", "X", "y"), ("x", "y", "z", "Z")):
        with pytest.raises(Unreadable, match="expected a list of three numbers"):
            outcome(key_of(PLATE), changed(0, axis=dict.fromkeys(names, "1")))
    alone = key_from("three_masses", ask="axes.axes")
    rows = [
        dict(zip("xyz", row, strict=True)) for row in (["0", "1", "1"], ["0", "1", "-1"], ["5", "0", "0"])
    ]
    assert outcome(alone, rows).verdict == "correct"
    assert codes(outcome(alone, [rows[0], rows[1], dict.fromkeys("xyz", "1")])) >= {"not_an_eigenvector"}


def test_the_sign_convention_of_products_is_that_of_the_tensor_alone() -> None:
    # With Ixy = +sum m x y typed, the axes are those of the body all the same.
    plus = {"tensor": [["2", "1", "0"], ["1", "2", "0"], ["0", "0", "4"]]}
    assert outcome(key_of(plus, products="plus"), RIGHT).verdict == "correct"
    assert codes(outcome(key_of(plus), RIGHT)) == {"moment_axis_pairing"}
    assert outcome(key_of(RIGHT, products="plus"), RIGHT).verdict == "correct"
    body = Body(np.array([2.0, 3.0, 4.0]), SKEW, ((0,), (1,), (2,)))
    other = body.tensor * (2 * np.eye(3) - 1)
    key = key_of(texts(other), products="plus")
    assert outcome(key, pairs(body.moments, SKEW)).verdict == "correct"
    assert codes(outcome(key, solutions(other))) == {"products_of_inertia_sign"}
    letters = {"tensor": [["a", "b", "0"], ["b", "a", "0"], ["0", "0", "2*a"]]}
    right = symbolic(["a-b", "a+b", "2*a"], [["1", "1", "0"], ["1", "-1", "0"], ["0", "0", "1"]])
    assert outcome(key_of(letters, symbols=ABC, products="plus"), right).verdict == "correct"
    water, plain = key_from("water", products="plus"), key_from("water")
    assert np.array_equal(water.eigen.tensors, plain.eigen.tensors)


def test_rounding_noise_of_a_key_is_zero() -> None:
    turn = 2 * np.pi * np.arange(7) / 7
    ring = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    tensor = (ring * ring).sum() * np.eye(3) - ring.T @ ring
    assert 0 < np.abs(tensor - np.diag(tensor.diagonal())).max() < 1e-14
    assert outcome(key_of(texts(tensor)), pairs([3.5, 3.5, 7], np.eye(3))).verdict == "correct"
    noise = str(math.cos(math.pi / 2))
    key = key_of(
        symbolic([noise, "1", "1"], [["1", noise, "0"], [noise, "-1", noise], ["0", "0", "1"]]),
        normalized="required",
    )
    assert outcome(key, pairs([0, 1, 1], np.eye(3))).verdict == "correct"
    assert outcome(key, pairs([0, 1, 1], [[1, 0, 0], [0, 0.6, 0.8], [0, -0.8, 0.6]])).verdict == "correct"
    assert outcome(key, pairs([0, 1, 1], [[0, 1, 0], [1, 0, 0], [0, 0, 1]])).verdict == "partial"


def test_an_absolute_tolerance_does_not_explain_whatever_is_small() -> None:
    key = key_of(PLATE, tolerance={"absolute": 0.5})
    small = [dict(pair, moment=moment) for pair, moment in zip(RIGHT, ("3e-3", "1e-3", "2e-3"), strict=True)]
    assert "constant_factor" not in codes(outcome(key, small))
    assert codes(outcome(key, [dict(p, moment=f"{p['moment']}e-3") for p in RIGHT])) == {"power_of_ten"}


# --- tolerances


def test_an_angle_of_its_own() -> None:
    rows = np.eye(3)
    rows[0], rows[1] = turned(rows[0], rows[1], 0.02), turned(rows[1], -rows[0], 0.02)
    tensor = {"tensor": np.diag([1.0, 1.5, 2.25]).astype(str).tolist()}
    answer = pairs([1, 1.5, 2.25], rows)
    assert outcome(key_of(tensor, tolerance={"angle": 0.021}), answer).verdict == "correct"
    assert outcome(key_of(tensor, tolerance={"angle": 0.019}), answer).verdict == "partial"
    assert outcome(key_of(tensor), answer).verdict == "partial"
    assert outcome(key_of(tensor, tolerance={"angle": 0.021, "relative": 1e-9}), answer).verdict == "correct"


@pytest.mark.parametrize(
    ("tolerance", "angle"),
    [
        ({}, 1e-3),
        ({"relative": 1e-5}, 1e-5),
        ({"relative": 0.2}, 0.05),
        ({"relative": 0}, 1e-9),
        ({"absolute": 0.3}, 1e-3),
        ({"significant_figures": 3}, 5e-3),
    ],
)
def test_the_angle_that_a_tolerance_leaves(tolerance: dict[str, Any], angle: float) -> None:
    assert eigen.default_angle(Tolerance.model_validate(tolerance)) == pytest.approx(angle)


def test_a_wide_tolerance_does_not_make_moments_equal() -> None:
    rows = np.array([SKEW[0], turned(SKEW[1], SKEW[2], 0.7), turned(SKEW[2], -SKEW[1], 0.7)])
    body = Body(np.array([1.0, 1.5, 1.6]), SKEW, ((0,), (1,), (2,)))
    for tolerance in ({"relative": 0.1}, {"absolute": 0.5}, {"significant_figures": 1}):
        key = key_of(texts(body.tensor), tolerance=tolerance)
        assert outcome(key, pairs(body.moments, SKEW)).verdict == "correct"
        assert outcome(key, pairs(body.moments, rows)).verdict == "partial"


def test_moments_that_are_near_in_a_chain() -> None:
    # Each is told from the next but one: an axis may lie in the plane of two, not of three.
    body = Body(np.array([1.0, 1.0008, 1.0016]), SKEW, ((0, 1), (1, 2)))
    key = key_of(texts(body.tensor))
    low = np.array([turned(SKEW[0], SKEW[1], 0.7), turned(SKEW[1], -SKEW[0], 0.7), SKEW[2]])
    high = np.array([SKEW[0], turned(SKEW[1], SKEW[2], 0.7), turned(SKEW[2], -SKEW[1], 0.7)])
    far = np.array([turned(SKEW[0], SKEW[2], 0.7), SKEW[1], turned(SKEW[2], -SKEW[0], 0.7)])
    assert outcome(key, pairs(body.moments, low)).verdict == "correct"
    assert outcome(key, pairs(body.moments, high)).verdict == "correct"
    assert outcome(key, pairs(body.moments, far)).verdict != "correct"


# --- what is no answer


@answers(
    """
    code | answer
    wrong_shape | 5  {moments: [1]}  {moments: [1, 3], axes: [[1, 0, 0]]}  [[1, 0, 0]]  [{moment: 1}]
      [{moment: 1, axis: [1, 0, 0], more: 1}]
    """,
    ("wrong_shape", changed(0, axis=["1", "0"])),
    ("wrong_shape", changed(0, axis="x")),
    ("wrong_shape", changed(0, axis=None)),
    ("wrong_shape", RIGHT * 3),
    ("not_a_number", changed(0, moment=None)),
    ("not_a_number", changed(0, moment="a")),
    ("not_a_finite_number", changed(0, moment=".inf")),
    ("not_a_finite_number", changed(0, axis=["1", "nan", "0"])),
    ("unit_incompatible", changed(0, moment="1 kg m")),
    ("unit_incompatible", changed(0, axis=["1 m", "0", "0"])),
)
def test_what_is_no_list_of_pairs(answer: Tree, code: str) -> None:
    assert codes(Asking("axes").judged(key_of(PLATE), answer)) == {code}


@pytest.mark.parametrize("size", ["1.7e308", "-1.7e308", "5e-324", "0"])
def test_numbers_at_the_ends_of_floats(size: str) -> None:
    answer = [{"moment": size, "axis": [size, size, size]}, *RIGHT[1:]]
    assert outcome(key_of(PLATE), answer).verdict == "partial"
    same = [{"moment": size, "axis": [size, "0", "1"]} for _ in range(3)]
    assert outcome(key_of(PLATE), same).verdict in ("partial", "incorrect")


# --- what a student is told


@few
@given(SEEDS)
def test_no_reference_value_is_told_below_full(seed: int) -> None:
    chance = random.Random(seed)
    body = Body(np.array([1.2345678, 2.3456789, 2.9876543]), SKEW, ((0,), (1,), (2,)))
    key = key_of(texts(body.tensor))
    _, answer, _ = wronged(body, chance, 1e-3)
    right = [*(f"{m:.4g}" for m in body.moments), *(f"{abs(c):.3g}" for c in SKEW.flat)]
    for finding in outcome(key, answer).findings:
        assert not any(text in sentence(finding) for text in right if text not in str(answer))


@pytest.mark.parametrize(
    ("key", "answer"),
    [
        (PLATE, "2: 1 0 0; 3: h -h 0; 4: 0 0 1"),
        (PLATE, "1: h h 0; 3: h -h 0"),
        (PLATE, "3: h h 0; 1: h -h 0; 4: 0 0 1"),
        (CUBE, "2: t t t; 11: h -h 0; 11: 0 .6 -.8"),
        (CUBE, "4: t t t; 22: h -h 0; 22: s s -2*s"),
        (CUBE, "20: t t t; 110: h -h 0; 110: s s -2*s"),
        (CUBE, "-2: t t t; -11: h -h 0; -11: s s -2*s"),
    ],
)
def test_the_first_finding_tells_all_at_full(key: Tree, answer: str) -> None:
    first, *others = outcome(key_of(key), typed(answer)).findings
    told = sentence(first, full=True)
    if key is PLATE:
        assert all(f"{moment} kg m^2 along (" in told for moment in ("1", "3", "4"))
    else:
        assert "2 kg m^2 along (" in told
        assert "11 kg m^2 at right angles to (" in told
    assert not any("kg" in sentence(found) for found in (first, *others))


def test_the_reference_in_symbols_is_told_at_full(masses: Key) -> None:
    doubled = outcome(masses, symbolic(["10*m*a^2", "14*m*a^2", "20*m*a^2"], MASSES_ROWS))
    assert "10*m*a**2 along (1, 0, 0)" in sentence(doubled.findings[0], full=True)


# --- examples

OPTIONS = st.fixed_dictionaries(
    {
        "order": st.sampled_from(["free", "ascending"]),
        "normalized": st.sampled_from(["required", "optional"]),
        "orthogonal": st.sampled_from(["required", "optional"]),
        "handed": st.sampled_from(["any", "right"]),
        "tolerance": st.sampled_from(
            [
                {},
                {"relative": 1e-6},
                {"relative": 0.02},
                {"significant_figures": 3},
                {"angle": 0.01},
                {"relative": 0},
            ]
        ),
    }
)


@few
@given(bodies(), OPTIONS)
def test_examples_of_any_body(body: Body, options: dict[str, Any]) -> None:
    seen = require_examples("axes", key_of(texts(body.tensor), **options))
    assert seen <= {None, *sentences()}
    assert "power_of_ten" in seen


RULES = [{}, {"order": "ascending", "handed": "right"}, {"normalized": "required", "orthogonal": "optional"}]


@pytest.mark.parametrize("name", ["cube_corner", "three_masses", "triangular_plate", "water", "known_tensor"])
@pytest.mark.parametrize("options", RULES)
def test_examples_of_documents(name: str, options: dict[str, Any]) -> None:
    seen = require_examples("axes", key_from(name, **options))
    assert seen >= {"missing_axis", "moment_axis_pairing", "not_an_eigenvector", "constant_factor"}
    if name == "known_tensor":
        assert seen >= {"other_frame", "parallel_axis_missing", "products_of_inertia_sign", "axes_permuted"}
    alone = require_examples("axes", key_from(name, ask="axes.axes", normalized="required"))
    assert alone >= {"missing_axis", "axis_not_normalised"}


@pytest.mark.parametrize("ask", ["axes", "axes.axes"])
@pytest.mark.parametrize("options", RULES)
@pytest.mark.parametrize(("name", "settings"), [("three_masses", NO_VALUES), ("cube_symbolic", ())])
def test_examples_in_symbols(ask: str, options: dict[str, Any], name: str, settings: tuple[str, ...]) -> None:
    seen = require_examples("axes", key_from(name, ask=ask, settings=settings, **options))
    assert seen >= {"missing_axis", "not_an_eigenvector"}
    assert ("constant_factor" in seen) == (ask == "axes")


@pytest.mark.parametrize(
    "key",
    [
        {"tensor": [["a", "0", "0"], ["0", "b", "0"], ["0", "0", "c"]]},
        {"tensor": [["a", "b", "0"], ["b", "a", "0"], ["0", "0", "2*a"]]},
        typed("c: 1 1 0; b: 1 -1 0; a: 0 0 1"),
    ],
)
@pytest.mark.parametrize("options", [RULES[0], RULES[2], {"handed": "right"}])
def test_examples_of_literal_keys_in_symbols(key: Tree, options: dict[str, Any]) -> None:
    assert require_examples("axes", key_of(key, symbols=ABC, **options)) >= {
        "missing_axis",
        "constant_factor",
    }
