"""Vectors: right in any spelling, unit and allowed direction, wrong in any other way, by the right name."""

from __future__ import annotations

import math
from decimal import Decimal
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rigidcli.grading.feedback import sentence
from tests.grading.asking import Asking, answers, codes, require_examples, tolerance

many = settings(max_examples=120, deadline=None)

DEFAULT = 1e-3
TOLERANCES = st.sampled_from([None, 1e-6, 0.02])
SCALES = st.sampled_from([1e-160, 1e-30, 1.0, 37.0, 1e20])
DIRECTIONS = st.sampled_from(["exact", "sense", "sign_free", "parallel"])
SIZES = st.one_of(st.just(0.0), st.floats(0.1, 10), st.floats(-10, -0.1), st.sampled_from([1.0, -1.0, 1e-4]))
VECTORS = st.lists(SIZES, min_size=1, max_size=5).filter(any)
SPELLINGS = st.sampled_from(
    ["{:r}", "{:e}", "+{:a}", "-(-({:r}))", "({:r})*3/3", "0 + {:r}", "({:r})/pi*pi", "  {:r} "]
)


asking = Asking("vector")
literal, computed, judged = asking.literal, asking.computed, asking.judged


def typed(values: Any) -> list[str]:
    return [repr(float(value)) for value in values]


def spelled(value: float, style: str) -> str:
    """The number in one of several spellings; `:a` is without a sign of its own."""
    if ":a" in style and value < 0:
        style = "{:r}"
    return style.replace(":r", "0!r").replace(":a", "0!r").replace(":e", "0:.17e").format(value)


# --- right answers


@many
@given(VECTORS, SCALES, TOLERANCES, DIRECTIONS, st.data())
def test_right_in_any_spelling(
    sizes: list[float], scale: float, relative: float | None, direction: str, data: st.DataObject
) -> None:
    values = [size * scale for size in sizes]
    key = literal(typed(values), direction=direction, **tolerance(relative))
    within = 0.9 * (relative or DEFAULT) / (1 if direction in ("exact", "sign_free") else 2)
    signs = {"sign_free": (1, -1), "parallel": (1, -1)}.get(direction, (1,))
    length = data.draw(st.sampled_from([1.0, 1e-3, 7.0])) if direction in ("sense", "parallel") else 1.0
    factor = length * data.draw(st.sampled_from(signs))
    off = [data.draw(st.floats(-within, within)) for _ in values]
    answer = [
        spelled(value * factor * (1 + by), data.draw(SPELLINGS))
        for value, by in zip(values, off, strict=True)
    ]
    assert judged(key, answer).verdict == "correct"


FORCE = ["1 cm", "-2 cm", "0 cm"]


@answers("""
    answer
    '[1, -2, 0] cm'  '[1, -2, 0]'  ' [ 0.01, -0.02, 0 ] m '  r = [1, -2, 0] cm  (1, -2, 0) cm
      '{x: 1, y: -2, z: 0} cm'  '[1 cm, -20 mm, 0]'  '[2/2, -sqrt(4), 0] cm'  '[1e-2, -2 x 10^-2, 0] m'
      {x: 1, y: -2, z: 0}  {z: 0, Y: -20 mm, x: 1 cm}  {r_x: 1, r_y: -2, r_z: 0}  {r1: 1, r2: -2, r3: 0}
    """)
def test_one_unit_behind_all_and_names_of_components(answer: Any) -> None:
    for key in (literal(FORCE), literal("[1, -2, 0] cm"), literal({"x": "1 cm", "y": "-2", "z": "0"})):
        assert judged(key, answer).verdict == "correct"


def test_all_that_cannot_be_read_is_told_at_once() -> None:
    outcome = judged(literal(FORCE), ["one", "2 kg", "1e999"])
    assert codes(outcome) == ["not_a_number", "unit_incompatible", "not_a_finite_number"]
    assert [finding.place for finding in outcome.findings] == ["component 1", "component 2", "component 3"]
    assert len(judged(literal(["1"] * 500), ["x"] * 500).findings) == 500


# --- wrong answers


@many
@given(st.lists(st.floats(-5, 5), min_size=3, max_size=3), st.floats(0, 2 * math.pi), st.data())
def test_directions_are_right_within_the_angle(sizes: list[float], roll: float, data: st.DataObject) -> None:
    values = np.array(sizes)
    assume(np.linalg.norm(values) > 0.1)
    limit = data.draw(st.sampled_from([1e-6, 1e-3, 0.1]))
    angle = data.draw(st.one_of(st.floats(0, 0.98), st.floats(1.02, 3 / limit))) * limit
    assume(angle < math.pi - 2 * limit)
    across = np.cross(values, [1, 0, 0] if abs(values[0]) < np.linalg.norm(values) / 2 else [0, 1, 0])
    across = Rotation.from_rotvec(roll * values / np.linalg.norm(values)).apply(across)
    turned = Rotation.from_rotvec(angle * across / np.linalg.norm(across)).apply(values)
    for direction, length in (("sense", 3.0), ("parallel", -0.2)):
        key = literal(typed(values), direction=direction, tolerance={"angle": limit})
        right = judged(key, typed(turned * length)).verdict == "correct"
        assert right == (angle < limit)
        assert (judged(key, typed(-turned * length)).verdict == "correct") == (
            right and direction == "parallel"
        )


@answers("""
    direction | code | answer
    exact | opposite_direction | [-1, -2, -3]
    sense | opposite_direction | [-2, -4, -6]
    exact | components_permuted | [3, 1, 2]
    sense | components_permuted | [9, 3, 6]
    sign_free | components_permuted | [-3, -1, -2]
    parallel | components_permuted | [-6, -2, -4]
    exact | sign_error | [1, 2, -3]  [-1, -2, 3]
    sign_free | sign_error | [1, 2, -3]
    sense | sign_error | [10, 20, -30]
    exact | power_of_ten | [0.01, 0.02, 0.03]
    sign_free | power_of_ten | [-100, -200, -300]
    exact | constant_factor | [1.7, 3.4, 5.1]  [-2, -4, -6]
    exact | degrees_radians | [180/pi, 360/pi, 540/pi]
    exact | frequency_vs_angular_frequency | [2*pi, 4*pi, 6*pi]
    exact | zero_vector | [0, 0, 0]
    parallel | zero_vector | [0, 0, 0]
    exact | component_wrong | [1, 2, 4]
    exact | outside_tolerance | [7, 5, 4]  [1.003, 2.005, 3.009]
    sense | outside_tolerance | [7, 5, 4]
    """)
def test_named_mistakes(direction: str, code: str, answer: list[str]) -> None:
    key = literal(["1 rad/s", "2 rad/s", "3 rad/s"], direction=direction)
    outcome = judged(key, answer)
    assert codes(outcome) == [code]
    assert outcome.verdict != "correct"
    if code == "sign_error":
        assert "component 3" in outcome.findings[0].place or "component 1" in outcome.findings[0].place


@many
@given(VECTORS, st.integers(1, 3), st.data())
def test_rounded_to_few_digits(sizes: list[float], figures: int, data: st.DataObject) -> None:
    """What rounds to the digits typed is never called wrong otherwise; what does not is never called so."""
    key, answer = literal(typed(sizes)), [f"{size:.{figures - 1}e}" for size in sizes]
    assert set(codes(judged(key, answer))) <= {
        *("precision_insufficient", "constant_factor"),
        *("component_wrong", "outside_tolerance"),  # where both explain it
    }
    if all(
        abs(float(text) - size) <= DEFAULT / 2 * abs(size) for text, size in zip(answer, sizes, strict=True)
    ):
        assert judged(key, answer).verdict == "correct"
    place = data.draw(st.sampled_from([k for k, size in enumerate(sizes) if size]))
    unit = Decimal(1).scaleb(Decimal(answer[place]).adjusted() - figures + 1)
    answer[place] = f"{Decimal(answer[place]) + data.draw(st.sampled_from([2, -2, 7])) * unit:e}"
    assert "precision_insufficient" not in codes(judged(key, answer))


# --- keys from documents

SPINNING = """
body: {points: [[1, 1, 0, 0], [2, 0, 1, 1], [3, 0, 1, -1]]}
frame: {axis: [0, 0, 1], angle: 40 deg}
motion: {omega: [1, 2, 3]}
"""
TENSOR = np.array([[10.0, 0, 0], [0, 6, 1], [0, 1, 6]])
MOMENTUM = TENSOR @ np.array([1.0, 2, 3])
"""Sum m (r^2 1 - r r^T) of these points, and L, in the document's axes."""


def test_angular_momentum_in_other_axes() -> None:
    key = computed(SPINNING, "axes.angular_momentum", "kg m^2/s")
    turn = Rotation.from_rotvec([0, 0, math.radians(40)]).as_matrix()
    assert judged(key, typed(turn.T @ MOMENTUM)).verdict == "correct"
    outcome = judged(key, typed(MOMENTUM))
    assert codes(outcome) == ["other_frame"]
    assert outcome.share == pytest.approx(1 / 3)  # the component along the axis of the turn is the same
    along = [f"{value} g m^2/s" for value in (turn.T @ MOMENTUM) * 1000]
    assert judged(key, along).verdict == "correct"
    assert codes(judged(key, typed(np.degrees(turn.T @ MOMENTUM)))) == ["degrees_radians"]


def test_a_centre_of_mass_at_the_origin() -> None:
    """0.1 + 0.2 - 0.3 is not zero in floats, but the centre of mass is."""
    points = [[1, 0.1, 3, 0], [1, 0.2, -3, 0], [1, -0.3, 0, 1], [1, 0, 0, -1]]
    key = computed(f"body: {{points: {points}}}", "inertia.center_of_mass", "m")
    for answer in (["0", "0", "0"], ["1e-16", "0", "-3e-17"]):
        assert judged(key, answer).verdict == "correct"
    assert judged(key, ["0.1", "0", "0"]).verdict == "incorrect"


def test_symbols() -> None:
    text = "parameters: {M: null, a: null}\nbody: {shape: cube, side: a, mass: M, anchor: corner}"
    key = computed(text, "inertia.center_of_mass", "m")
    for answer in (["a/2", "0.5*a", "a - a/2"], ["a*M/(2*M)", "a/2", "sqrt(a^2)/2"]):
        assert judged(key, answer).verdict == "correct"
    assert codes(judged(key, ["0.5", "a/2", "a/2"])) == ["number_for_symbol"]
    assert codes(judged(key, ["b/2", "a/2", "a/2"])) == ["unknown_symbol"]
    assert codes(judged(key, ["a/2", "a/2", "a*/2"])) == ["parse_error"]
    assert codes(judged(key, ["a", "a", "a"])) == ["constant_factor"]
    assert codes(judged(key, ["-a/2", "a/2", "a/2"])) == ["sign_error"]
    assert judged(key, ["a/2", "a/2", "a/3"]).share == pytest.approx(2 / 3)
    assert judged(key, ["log(-a)", "a/2", "a/2"]).verdict == "partial"


# --- what cannot be read


@many
@given(VECTORS, st.data())
def test_nothing_gives_the_key_away(sizes: list[float], data: st.DataObject) -> None:
    """Below the level `full`, what is said is the same for keys that differ in their numbers."""
    values = np.array(sizes)
    answer = data.draw(
        st.sampled_from([list(-values), list(values[::-1]), list(values * 3.1), [5.5] * len(sizes)])
    )
    outcome = judged(literal(typed(values)), typed(answer))
    for finding in outcome.findings:
        assert finding.detail == ""
        assert not set(finding.place) - set("component 12345,;")
        if finding.code != "wrong_shape":
            assert sentence(finding, full=True) != sentence(finding)


# --- examples

KEYS = [
    (SPINNING, "axes.angular_momentum", "kg m^2/s"),
    (SPINNING, "axes.omega", "rad/s"),
    (SPINNING, "inertia.center_of_mass", "m"),
]


@pytest.mark.parametrize("direction", ["exact", "sense", "sign_free", "parallel"])
@pytest.mark.parametrize(("text", "ask", "unit"), KEYS)
def test_examples(text: str, ask: str, unit: str, direction: str) -> None:
    seen = require_examples("vector", computed(text, ask, unit, direction=direction))
    assert seen >= {None, "components_permuted"}
    assert ("opposite_direction" in seen) == (direction in ("exact", "sense"))


@pytest.mark.parametrize("direction", ["exact", "sense", "sign_free", "parallel"])
@pytest.mark.parametrize(
    "answer",
    [["1 cm", "-20 mm", "5"], ["30 rpm", "1 rad/s", "0"], ["-3"], ["0", "0", "7 kg m^2"], ["1/3", "2*pi"]],
)
def test_examples_of_literal_keys(answer: list[str], direction: str) -> None:
    assert None in require_examples("vector", literal(answer, direction=direction))


def test_the_answer_is_told_in_the_unit_of_the_key() -> None:
    finding = judged(literal(["1 cm", "2 cm", "0"]), ["7", "5", "3"]).findings[0]
    assert sentence(finding, full=True).endswith("expected [1, 2, 0] cm")
    assert "[1" not in sentence(finding)
