"""Moments: a set in which each stands as often as it is; in order where asked; and what no body has."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rigidcli.errors import ValueProblem
from rigidcli.grading.arrays.reference import Reference as Key
from rigidcli.grading.kinds import KINDS
from tests.grading.asking import Asking, codes, require_examples

Floats = NDArray[np.float64]

many = settings(max_examples=120, deadline=None)

SCALES = st.sampled_from([1e-47, 1.0, 12.5, 1e37])


asking = Asking("moments")
literal, judged = asking.literal, asking.judged


def computed(text: str, **options: Any) -> Key:
    key: Key = asking.computed(text, "axes.moments", "kg m^2", **options)
    return key


def typed(values: Any) -> list[str]:
    return [repr(float(value)) for value in values]


@st.composite
def principal(draw: st.DrawFn) -> Floats:
    """Moments that a body can have, ascending; equal ones, nearly equal ones and zeros among them."""
    second = draw(st.sampled_from([1.0, 1.0 + 1e-4, draw(st.floats(1.0, 2.0))]))
    low = draw(st.sampled_from([0.0, second, 1.0, draw(st.floats(0.1, 1.0))]))
    low = min(low, second)
    high = second + low * draw(st.sampled_from([0.0, 1e-4, 1.0, draw(st.floats(0.0, 1.0))]))
    return np.array(sorted([low, second, high])) * draw(SCALES)


# --- right answers


@many
@given(principal(), st.permutations(range(3)))
def test_order(values: Floats, order: list[int]) -> None:
    key = literal(typed(values[::-1]), order="ascending")
    answer = values[order]
    margins = 1e-3 * np.where(values == 0, values.max(), values) * (1 + 1e-8)
    outcome = judged(key, typed(answer))
    if (np.abs(answer - values) <= margins).all():
        assert outcome.verdict == "correct"
    else:
        assert codes(outcome) == ["wrong_order"]
        assert outcome.verdict != "correct"


# --- wrong answers


@many
@given(
    st.lists(st.integers(1, 6), min_size=1, max_size=5), st.lists(st.integers(1, 6), min_size=1, max_size=5)
)
def test_whole_numbers(values: list[int], answer: list[int]) -> None:
    """Right when they are the same numbers; short of multiplicity when they are but for how often."""
    outcome = judged(literal(typed(values)), typed(answer))
    assert (outcome.verdict == "correct") == (sorted(values) == sorted(answer))
    same = set(values) == set(answer) and sorted(values) != sorted(answer)
    assert (codes(outcome) == ["multiplicity"]) == same
    if len(values) != len(answer) and not same:
        assert (outcome.verdict, codes(outcome)) == ("invalid", ["wrong_shape"])
    elif outcome.verdict != "correct":
        common = sum(min(values.count(n), answer.count(n)) for n in set(values))
        assert outcome.share == pytest.approx(common / max(len(values), len(answer)))


# --- keys from documents

POINTS: list[list[float]] = [[1, 1, 0, 0], [2, 0, 1, 1], [3, 0.5, 1, -1], [1.5, 2, -1, 0.5]]


def of_points(points: Any, origin: Any) -> Floats:
    total = np.zeros((3, 3))
    for mass, *place in points:
        r = np.array(place) - np.array(origin)
        total += mass * (r @ r * np.eye(3) - np.outer(r, r))
    return total


def test_mistakes_of_the_tensor_show_in_the_moments() -> None:
    origin = np.array([0.3, -1, 2])
    key = computed(json.dumps({"body": {"points": POINTS}, "about": origin.tolist()}))
    masses = np.array([point[0] for point in POINTS])
    com = masses @ np.array([point[1:] for point in POINTS]) / masses.sum()
    right, central = of_points(POINTS, origin), of_points(POINTS, com)
    steiner, diagonal = right - central, np.diag(np.diag(right))
    mistaken = {
        "products_of_inertia_sign": 2 * diagonal - right,
        "products_of_inertia_missing": diagonal,
        "parallel_axis_missing": central,
        "parallel_axis_sign": central - steiner,
        "parallel_axis_off_diagonal_missing": central + np.diag(np.diag(steiner)),
    }
    assert judged(key, typed(np.linalg.eigvalsh(right))).verdict == "correct"
    for code, inertia in mistaken.items():
        assert codes(judged(key, typed(np.linalg.eigvalsh(inertia)[::-1]))) == [code]


def test_symbols() -> None:
    text = "parameters: {M: null, a: null}\nbody: {shape: cube, side: a, mass: M, anchor: corner}"
    key = computed(text)
    assert judged(key, ["11*M*a^2/12", "a*a*M/6", "M*a**2*(1 - 1/12)"]).verdict == "correct"
    assert codes(judged(key, ["11*M*a^2/12", "a*a*M/6"])) == ["multiplicity"]
    assert codes(judged(key, ["M*a^2/6", "M*a^2/6", "M*a^2/6"])) == ["parallel_axis_missing"]
    # The products left out of the tensor, or of Steiner's term: the same here.
    assert codes(judged(key, ["2/3*M*a^2", "2*M*a^2/3", "M*a^2*2/3"])) == ["outside_tolerance"]
    assert judged(key, ["11*M*a^2/12", "a*M/6", "M*a**2*(1 - 1/12)"]).share == pytest.approx(2 / 3)
    assert codes(judged(key, ["11/12", "11/12", "1/6"])) == ["number_for_symbol"]


def test_an_order_that_depends_on_symbols_cannot_be_asked() -> None:
    body = "body: {shape: cylinder, radius: a, height: b, mass: 1}"
    text = f"parameters: {{a: null, b: null}}\n{body}"
    assert judged(computed(text), ["a^2/2", "a^2/4 + b^2/12", "b^2/12 + a^2/4"]).verdict == "correct"
    with pytest.raises(ValueProblem, match="order"):
        computed(text, order="ascending")


# --- what cannot be read


def test_a_unit_may_be_required() -> None:
    key = literal(["2 kg m^2", "11", "11"], unit="required")
    assert judged(key, "[11, 11, 2] kg m^2").verdict == "correct"
    assert codes(judged(key, ["2", "11", "11"])) == ["unit_missing"]
    assert None in {example.code for example in KINDS["moments"].examples(key)}


@many
@given(st.lists(st.sampled_from([1e-30, 1e-3, 1.0, 1.0005, 2.0, 1e25]), min_size=1, max_size=6), st.data())
def test_hugely_different_sizes(values: list[float], data: st.DataObject) -> None:
    """A small moment beside a large one is no zero, unless it is below rounding."""
    answer = data.draw(st.permutations(values))
    assert judged(literal(typed(values)), typed(answer)).verdict == "correct"
    place = data.draw(st.integers(0, len(values) - 1))
    wrong = [value * 1.1 if k == place else value for k, value in enumerate(answer)]
    small = answer[place] <= 1e-12 * max(values) or max(values) == 0
    assert small or judged(literal(typed(values)), typed(wrong)).verdict != "correct"


# --- examples


@pytest.mark.parametrize("order", ["free", "ascending"])
@pytest.mark.parametrize(
    ("text", "least"),
    [
        (f"body: {{points: {POINTS}}}", 8),
        ("body: {shape: cube, side: 1, mass: 12, anchor: corner}", 6),
        ("parameters: {M: null}\nbody: {shape: cube, side: 2, mass: M, anchor: corner}", 3),
        ("body: {shape: sphere, radius: 1, mass: 5}", 2),
    ],
)
def test_examples(text: str, least: int, order: str) -> None:
    assert len(require_examples("moments", computed(text, order=order)) - {None}) >= least
