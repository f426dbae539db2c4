"""Inertia tensors against sums over point masses: right ones, wrong ones, and mistakes worked out by hand."""

from __future__ import annotations

import itertools
import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rigidcli.grading.arrays.reference import Reference as Key
from rigidcli.grading.mistakes import DECISIVE, variants
from tests.grading.asking import Asking, codes, require_examples, rows

Floats = NDArray[np.float64]


NAMES = {"Ixx": (0, 0), "Iyy": (1, 1), "Izz": (2, 2), "Ixy": (0, 1), "Ixz": (0, 2), "Iyz": (1, 2)}
COORDINATES = st.integers(-4, 4).map(float)
POINTS = st.lists(st.tuples(st.integers(1, 5).map(float), *[COORDINATES] * 3), min_size=2, max_size=6)


MASSES: list[tuple[float, ...]] = [(1, 1, 0, 0), (2, 0, 1, 1), (3, 0.5, 1, -1)]

asking = Asking("tensor")
literal, judged = asking.literal, asking.judged


def computed(text: str, ask: str = "inertia.tensor", **options: Any) -> Key:
    key: Key = asking.computed(text, ask, "kg m^2", **options)
    return key


def named(values: Any, names: list[str] | None = None) -> dict[str, str]:
    return {name: repr(float(values[NAMES[name]])) for name in names or list(NAMES)}


def about(points: list[tuple[float, ...]], origin: Any) -> Floats:
    """Sum m (r^2 1 - r r^T), r taken from the origin given."""
    total = np.zeros((3, 3))
    for mass, *place in points:
        r = np.array(place) - np.array(origin)
        total += mass * (r @ r * np.eye(3) - np.outer(r, r))
    return total


def centre(points: list[tuple[float, ...]]) -> Floats:
    masses = np.array([point[0] for point in points])
    return np.array(masses @ np.array([point[1:] for point in points]) / masses.sum())


# --- right answers


@pytest.mark.parametrize(
    "answer",
    [
        {"Ixx": "10", "Iyy": "6", "Izz": "6", "Ixy": "0", "Ixz": "0", "Iyz": "1"},
        {"ixx": "10", "IYY": "6", "I_zz": "6", "Iyx": "0", "Izx": "0", "Izy": "1"},
        {"I11": "10", "I22": "6", "I33": "6", "I12": "0", "I13": "0", "I23": "1", "I32": "1"},
        {"Ixx": "20/2", "Iyy": "6.0 kg m^2", "Izz": "6e4 kg cm^2", "Ixy": "1e-9", "Ixz": "-0", "Iyz": "1"},
    ],
)
def test_six_names(answer: dict[str, str]) -> None:
    key = computed("body: {points: [[1, 1, 0, 0], [2, 0, 1, 1], [3, 0, 1, -1]]}")
    assert judged(key, answer).verdict == "correct"


def test_a_key_by_names() -> None:
    key = literal({"Ixx": "10", "Iyy": "6", "Izz": "6", "Ixy": "0", "Ixz": "0", "Iyz": "1"})
    assert judged(key, rows([[10, 0, 0], [0, 6, 1], [0, 1, 6]])).verdict == "correct"


# --- wrong answers


# --- mistakes, worked out by hand


def candidates(points: list[tuple[float, ...]], origin: Floats, turn: Floats) -> dict[str, Floats]:
    """The tensor about the origin along the columns of `turn`, and what comes out under mistakes."""
    mass, com = sum(point[0] for point in points), centre(points)
    d = turn.T @ (origin - com)
    central = turn.T @ about(points, com) @ turn
    steiner = mass * (d @ d * np.eye(3) - np.outer(d, d))
    right = central + steiner
    found = {
        "": right,
        "products_of_inertia_sign": 2 * np.diag(np.diag(right)) - right,
        "products_of_inertia_missing": np.diag(np.diag(right)),
        "parallel_axis_missing": central,
        "parallel_axis_sign": central - steiner,
        "parallel_axis_off_diagonal_missing": central + np.diag(np.diag(steiner)),
        "power_of_ten": right / 100,
        "constant_factor": right * 2.7,
    }
    for order in itertools.permutations(range(3)):
        if order != (0, 1, 2):
            found[f"axes_permuted {order}"] = np.array([[right[i, j] for j in order] for i in order])
    if not np.allclose(turn, np.eye(3)):
        found["other_frame"] = turn @ right @ turn.T
    return found


def apart(tensors: dict[str, Floats]) -> bool:
    scale = np.abs(tensors[""]).max()
    values = list(tensors.values())
    return all(np.abs(a - b).max() > 0.02 * scale for k, a in enumerate(values) for b in values[:k])


@settings(max_examples=40, deadline=None)
@given(POINTS, st.tuples(*[COORDINATES] * 3), st.sampled_from([None, (0, 0, 1), (1, 2, 3)]), st.booleans())
def test_named_mistakes(
    points: list[tuple[float, ...]],
    origin: tuple[float, ...],
    axis: tuple[float, ...] | None,
    about_com: bool,
) -> None:
    frame: dict[str, Any] = {} if axis is None else {"frame": {"axis": axis, "angle": "50 deg"}}
    turn = np.eye(3)
    if axis is not None:
        turn = Rotation.from_rotvec(math.radians(50) * np.array(axis) / np.linalg.norm(axis)).as_matrix()
    text = json.dumps({"body": {"points": points}, "about": origin, **frame})
    if not about_com:
        key, tensors = computed(text), candidates(points, np.array(origin), turn)
    else:
        key = computed(text, "inertia.tensor_com")
        away = candidates(points, np.array(origin), turn)
        central, steiner = away["parallel_axis_missing"], away[""] - away["parallel_axis_missing"]
        tensors = {
            "": central,
            "parallel_axis_sign": away[""] + steiner,
            "parallel_axis_off_diagonal_missing": away[""] - np.diag(np.diag(steiner)),
            "products_of_inertia_missing": np.diag(np.diag(central)),
            "products_of_inertia_sign": 2 * np.diag(np.diag(central)) - central,
            "axes_permuted (2, 0, 1)": np.roll(central, (1, 1), (0, 1)),
        }
    assert judged(key, rows(tensors[""])).verdict == "correct"
    assume(apart(tensors))
    for code, mistaken in tensors.items():
        outcome = judged(key, rows(mistaken))
        assert codes(outcome) == code.split()[:1]
        assert judged(key, named(mistaken)) == outcome


def decisive(key: Key) -> set[str]:
    """The codes of what may be asked first of a tensor that is wrong."""
    return {mistake.code for mistake, _ in variants("tensor", key) if mistake.level == DECISIVE}


def test_a_mistake_that_changes_nothing_is_not_named() -> None:
    """About the centre of mass, and with no products, there is nothing to get wrong."""
    key = computed("{body: {shape: box, size: [1, 2, 3], mass: 12}}")
    assert decisive(key) == {"axes_permuted"}
    key = computed("{body: {shape: cube, side: 1, mass: 12}}")
    assert decisive(key) == set()
    key = computed("{body: {shape: box, size: [1, 2, 3], mass: 12}, about: [0, 0, 5]}")
    assert decisive(key) == {*("axes_permuted", "parallel_axis_missing", "parallel_axis_sign")}


def test_two_mistakes_that_explain_an_answer_are_not_named() -> None:
    """Of a plate, leaving out what Steiner's term adds off the diagonal leaves out all products."""
    key = computed("{body: {shape: plate, size: [1, 2], mass: 12}, about: [1, 1, 0]}")
    diagonal = np.diag(np.diag(about([(12, 0, 0, 0)], (1, 1, 0)))) + np.diag([4.0, 1.0, 5.0])
    outcome = judged(key, rows(diagonal))
    assert codes(outcome) == ["component_wrong"]
    assert outcome.findings[0].place == "Ixy"
    assert outcome.share == pytest.approx(5 / 6)


def test_axes_that_change_places() -> None:
    key = computed("body: {points: [[1, 1, 0, 0], [2, 0, 1, 1], [3, 0, 1, -1]]}")
    for swapped in ([[6, 1, 0], [1, 6, 0], [0, 0, 10]], [[6, 0, 1], [0, 10, 0], [1, 0, 6]]):
        outcome = judged(key, rows(swapped))
        assert codes(outcome) == ["axes_permuted"]
        assert outcome.share == pytest.approx(1 / 3)
    # A frame that does no more than this is no other mistake.
    box = "body: {shape: box, size: [1, 2, 3], mass: 12}"
    key = computed(f"{{{box}, frame: {{axis: [0, 0, 1], angle: 90 deg}}}}")
    assert judged(key, rows(np.diag([10.0, 13, 5]))).verdict == "correct"
    assert codes(judged(key, rows(np.diag([13.0, 10, 5])))) == ["axes_permuted"]


CUBE = rows([[8, -3, -3], [-3, 8, -3], [-3, -3, 8]])


# --- the other sign of products

PLUS = [("tensor", "inertia.tensor"), ("matrix", "inertia.tensor"), ("tensor", "inertia.tensor_com")]


@pytest.mark.parametrize(("kind", "ask"), PLUS)
def test_products_of_inertia_with_a_plus_sign(kind: str, ask: str) -> None:
    text, names = json.dumps({"body": {"points": MASSES}, "about": [1, 2, 3]}), {"products": "plus"}
    plus = Asking(kind).computed(text, ask, "kg m^2", **names)
    minus = Asking(kind).computed(text, ask, "kg m^2")
    usual = about(MASSES, centre(MASSES) if ask.endswith("com") else (1, 2, 3))
    other = 2 * np.diag(np.diag(usual)) - usual
    assert Asking(kind).judged(plus, rows(other)).verdict == "correct"
    assert Asking(kind).judged(minus, rows(usual)).verdict == "correct"
    code = ["products_of_inertia_sign"] if kind == "tensor" else ["sign_error"]
    assert codes(Asking(kind).judged(plus, rows(usual))) == code
    assert codes(Asking(kind).judged(minus, rows(other))) == code
    assert "expected" in Asking(kind).judged(plus, rows(usual)).findings[0].reference


@settings(max_examples=20, deadline=None)
@given(POINTS, st.tuples(*[COORDINATES] * 3))
def test_mistakes_with_a_plus_sign(points: list[tuple[float, ...]], origin: tuple[float, ...]) -> None:
    """Every mistake keeps its name when all signs of products are the other way round."""
    turn = Rotation.from_rotvec([0.3, -0.5, 0.4]).as_matrix()
    frame = {"matrix": turn.tolist()}
    text = json.dumps({"body": {"points": points}, "about": origin, "frame": frame})
    tensors = candidates(points, np.array(origin), turn)
    assume(apart(tensors))
    signs = 2 * np.eye(3) - 1
    for sign, factor in (("minus", np.ones((3, 3))), ("plus", signs)):
        key = computed(text, products=sign)
        for code, mistaken in tensors.items():
            assert codes(judged(key, rows(mistaken * factor))) == code.split()[:1]
            assert judged(key, named(mistaken * factor)) == judged(key, rows(mistaken * factor))


def test_a_literal_key_has_the_signs_of_the_question() -> None:
    """Of the signs that are asked it depends whether a body has a tensor."""
    entries = rows([[8, 3, 3], [3, 8, 3], [3, 3, 8]])
    for sign, code in (("plus", "component_wrong"), ("minus", "component_wrong")):
        key = literal(entries, products=sign)
        assert judged(key, entries).verdict == "correct"
        assert codes(judged(key, CUBE)) == ["products_of_inertia_sign"]
        assert codes(judged(key, rows([[8, 3, 3], [3, 8, 3], [3, 3, 9]]))) == [code]


@pytest.mark.parametrize(
    "answer",
    [
        "[[8, -3, -3], [-3, 8, -3], [-3, -3, 8]] kg m^2",
        "I = [[8, -3, -3], [-3, 8, -3], [-3, -3, 8]]",
        "{Ixx: 8, Iyy: 8, Izz: 8, Ixy: -3, Ixz: -3, Iyz: -3} kg m^2",
        "[[80000, -30000, -30000], [-30000, 80000, -30000], [-30000, -30000, 80000]] kg cm^2",
    ],
)
def test_one_unit_behind_all(answer: str) -> None:
    key = literal("[[8, -3, -3], [-3, 8, -3], [-3, -3, 8]] kg m^2", unit="optional")
    assert judged(key, answer).verdict == "correct"
    required = literal("[[8, -3, -3], [-3, 8, -3], [-3, -3, 8]] kg m^2", unit="required")
    assert (judged(required, answer).verdict == "correct") == answer.endswith("m^2")


def test_all_that_cannot_be_read_is_told_at_once() -> None:
    six = {"Ixx": "eight", "Iyy": "8", "Izz": "8", "Ixy": "-3 m", "Ixz": "-3", "Iyz": "-3"}
    outcome = judged(literal(CUBE), six)
    assert codes(outcome) == ["not_a_number", "unit_incompatible"]
    assert [finding.place for finding in outcome.findings] == ["`Ixx`", "`Ixy`"]


# --- symbols

SYMBOLIC = "parameters: {M: null, a: null}\nbody: {shape: cube, side: a, mass: M, anchor: corner}"


def test_a_tensor_with_symbols() -> None:
    key = computed(SYMBOLIC)
    diagonal, product = "2*M*a^2/3", "-(a**2)*M*0.25"
    right = [[diagonal if i == j else product for j in range(3)] for i in range(3)]
    assert judged(key, right).verdict == "correct"
    others = {name: diagonal if i == j else product for name, (i, j) in NAMES.items()}
    assert judged(key, others).verdict == "correct"
    assert judged(key, others | {"Izz": "(M*a^2 + M*a^2)/3 + M - M"}).verdict == "correct"
    flipped = [[entry.replace("-", "") for entry in row] for row in right]
    assert codes(judged(key, flipped)) == ["products_of_inertia_sign"]
    central = [["M*a^2/6" if i == j else "0" for j in range(3)] for i in range(3)]
    assert codes(judged(key, central)) == ["parallel_axis_missing"]
    for wrong in ("2*M*a/3", "2*M*a^2/3.01", "2*M*a^3/3", "M*a^2*(2/3 + a/1000)", "2*a^2/3", "M/a"):
        assert judged(key, others | {"Ixx": wrong}).verdict == "partial"
    assert codes(judged(key, others | {"Ixx": "0.667"})) == ["number_for_symbol"]
    assert codes(judged(key, others | {"Ixx": "2*m*a^2/3"})) == ["unknown_symbol"]


def test_numbers_for_symbols_of_a_question() -> None:
    key = literal(
        [["2*m", "sqrt(k)", "0"], ["sqrt(k)", "3*m", "0"], ["0", "0", "5*m"]],
        symbols={"m": "positive", "k": "positive"},
    )
    outcome = judged(key, rows([[2, 1, 0], [1, 3, 0], [0, 0, 5]]))
    assert (codes(outcome), outcome.share) == (["number_for_symbol"], 0.0)
    assert outcome.findings[0].place == "Ixx, Ixy, Iyy, Izz"
    swapped = [["3*m", "sqrt(k)", "0"], ["sqrt(k)", "2*m", "0"], ["0", "0", "5*m"]]
    assert codes(judged(key, swapped)) == ["axes_permuted"]


# --- what cannot be read


def test_missing_names_are_told() -> None:
    outcome = judged(literal(CUBE), {"Ixx": "8", "Iyy": "8", "Izz": "8", "Iyx": "3"})
    assert outcome.findings[0].detail == "Ixz, Iyz missing"


# --- examples

GENERAL = """
body: {points: [[1, 1, 0, 0], [2, 0, 1, 1], [3, 0.5, 1, -1]]}
about: [0.3, -1, 2]
frame: {axis: [1, 2, 3], angle: 40 deg}
"""


@pytest.mark.parametrize(
    ("text", "ask", "least"),
    [(GENERAL, "inertia.tensor", 9), (GENERAL, "inertia.tensor_com", 8), (SYMBOLIC, "axes.tensor", 4)],
)
def test_examples(text: str, ask: str, least: int) -> None:
    assert len(require_examples("tensor", computed(text, ask), alone=False) - {None}) >= least
