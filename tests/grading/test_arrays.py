"""What holds for all answers of many numbers: right in every writing, wrong as soon as one entry is off.

Keys have zeros, rounding noise in place of zeros, equal entries, and entries of hugely different sizes.
"""

from __future__ import annotations

import itertools
import pickle
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rigidcli.errors import ValueProblem
from rigidcli.grading.asked import Asked
from rigidcli.grading.kinds import KINDS
from rigidcli.grading.question import Question
from rigidcli.model.syntax import read_tree
from tests.grading.asking import Asking, answers, codes, require_examples, tolerance

Floats = NDArray[np.float64]

many = settings(max_examples=100, deadline=None)

TOLERANCES = st.sampled_from([None, 1e-6, 0.02])
SHAPES = {"vector": (3,), "moments": (3,), "matrix": (2, 3), "tensor": (3, 3)}
UNITS = {"m": 1.0, "cm": 100.0, "km": 1e-3, "ft": 1 / 0.3048}
SIZES = st.one_of(
    st.sampled_from([0.0, 1.0, 1.0, -1.0, 2.0, 1e-9, 1e9, 1.0004]), st.floats(0.1, 10), st.floats(-10, -0.1)
)
SCALES = st.sampled_from([1e-150, 1e-30, 1.0, 37.0, 1e30, 1e150])
NOISE = st.sampled_from([0.0, 1e-16, -3e-17, 2e-15])


def filled(kind: str, sizes: list[float]) -> Floats:
    """An array of the shape of a kind, symmetric where it is a tensor."""
    values = np.resize(np.array(sizes), SHAPES[kind])
    return (values + values.T) / 2 if kind == "tensor" else values


def tree(values: Any, write: Callable[[float], str]) -> Any:
    """Nested lists of numbers, each written."""
    return [tree(value, write) for value in values] if np.ndim(values) else write(float(values))


def same(kind: str, one: Floats, other: Floats, relative: float) -> bool:
    """Whether two arrays are the same within a tolerance, by trying all orders where that is free."""
    largest = np.abs(other).max()
    limits = relative * np.where(np.abs(other) <= 1e-12 * largest, largest, np.abs(other))
    orders = itertools.permutations(range(3)) if kind == "moments" else [slice(None)]
    return any(bool((np.abs(one[order, ...] - other) <= limits).all()) for order in map(_index, orders))


def _index(order: Any) -> Any:
    return list(order) if isinstance(order, tuple) else order


def names(kind: str, values: Any) -> dict[str, str] | None:
    """The same as a mapping, where there are names."""
    if kind == "tensor":
        return {f"I{a}{b}": values[i][j] for i, a in enumerate("xyz") for j, b in enumerate("xyz") if i <= j}
    return dict(zip("xyz", values, strict=True)) if kind != "matrix" else None


@st.composite
def keys(draw: st.DrawFn) -> tuple[str, Floats]:
    """A kind, and an array with an entry that is not zero."""
    kind = draw(st.sampled_from(sorted(SHAPES)))
    values = filled(kind, draw(st.lists(SIZES, min_size=9, max_size=9))) * draw(SCALES)
    noise = filled(kind, draw(st.lists(NOISE, min_size=9, max_size=9)))
    assume(values.any())
    return kind, np.where(values == 0, noise * np.abs(values).max(), values)


@many
@given(keys(), TOLERANCES, st.data())
def test_right_is_never_wrong(made: tuple[str, Floats], relative: float | None, data: st.DataObject) -> None:
    """Within the tolerance, in any unit and writing, with zeros for noise and noise for zeros."""
    kind, values = made
    asking = Asking(kind)
    key = asking.literal(tree(values, "{!r} m".format), **tolerance(relative))
    largest = np.abs(values).max()
    zero = np.abs(values) <= 1e-13 * largest
    off = filled(kind, data.draw(st.lists(st.floats(-0.9, 0.9), min_size=9, max_size=9))) * (relative or 1e-3)
    near = np.where(zero, data.draw(NOISE) * largest, values * (1 + off))
    if kind == "moments":
        near = near[list(data.draw(st.permutations(range(3))))]
    unit, per = data.draw(st.sampled_from(sorted(UNITS.items())))
    style = data.draw(
        st.sampled_from(["{:.17g}", "{:.17e}", "-(-({:.17g}))", "({:.17g})*sqrt(4)/2", "0 + {:.17g}"])
    )
    plain = tree(near * per, style.format)
    each = tree(near * per, lambda value: f"{style.format(value)} {unit}")
    behind = f"{plain} {unit}".replace("'", "")
    answers: list[Any] = [each, behind, f"x = {behind}", tree(near, style.format)]
    answers += [named for named in (names(kind, each), names(kind, tree(near, style.format))) if named]
    answer = data.draw(st.sampled_from(answers))
    assert asking.judged(key, answer).verdict == "correct"
    assert asking.judged(pickle.loads(pickle.dumps(key)), answer).verdict == "correct"


COMPONENTS = {"vector": 3, "matrix": 6, "tensor": 6}
PLACES: dict[str, Callable[..., str]] = {
    "vector": lambda k: f"component {k + 1}",
    "matrix": lambda i, j: f"row {i + 1}, column {j + 1}",
    "tensor": lambda i, j: f"I{'xyz'[min(i, j)]}{'xyz'[max(i, j)]}",
}
CHANGES: dict[str, Callable[[Floats], Floats]] = {
    "one entry off": lambda values: values,
    "another order": lambda values: np.roll(values, 1, axis=-1),
    "another sign": lambda values: -values,
    "zeros": np.zeros_like,
    "half": lambda values: values / 2,
    "a power of ten": lambda values: values * 10,
    "transposed": lambda values: (
        values.T if values.ndim == 2 and values.shape[0] == values.shape[1] else values
    ),
}


@many
@given(keys(), TOLERANCES, st.sampled_from(sorted(CHANGES)), st.data())
def test_wrong_is_never_right(
    made: tuple[str, Floats], relative: float | None, change: str, data: st.DataObject
) -> None:
    """And earns what is right in it: never all, and nothing where only zeros are right."""
    kind, values = made
    asking = Asking(kind)
    answer, zero = CHANGES[change](values).copy(), np.abs(values) <= 1e-12 * np.abs(values).max()
    place = tuple(data.draw(st.integers(0, size - 1)) for size in values.shape)
    if change == "one entry off":
        by = data.draw(st.sampled_from([-1, 1])) * data.draw(st.floats(1.1, 1e4)) * (relative or 1e-3)
        answer[place] += by * (np.abs(values).max() if zero[place] else abs(values[place]))
    assume(not same(kind, answer, values, (relative or 1e-3) * 1.001))
    unit, per = data.draw(st.sampled_from(sorted(UNITS.items())))
    key = asking.literal(tree(values, "{!r} m".format), **tolerance(relative))
    typed = tree(answer * per, f"{{:.17g}} {unit}".format)
    named = names(kind, typed) if kind != "tensor" or (answer == answer.T).all() else None
    outcome = asking.judged(key, data.draw(st.sampled_from([typed, named or typed])))
    assert outcome.verdict in ("partial", "incorrect")
    assert outcome.share < 1
    if change == "zeros":
        assert outcome.share == 0
    if change == "one entry off" and kind != "moments":
        others = ~zero
        others[place] = others[place[::-1] if kind == "tensor" else place] = False
        assert outcome.share == pytest.approx(1 - 1 / COMPONENTS[kind] if others.any() else 0)
        if codes(outcome) == ["component_wrong"]:
            assert outcome.findings[0].place == PLACES[kind](*place)
    for finding in outcome.findings:
        assert finding.detail == ""


@pytest.mark.parametrize("kind", sorted(SHAPES))
@pytest.mark.parametrize(
    ("size", "unit"),
    [(1e-300, ""), (1e-160, " kg m^2"), (1.0, ""), (1.0, " kg m^2"), (1.0, " rad/s"), (1e300, " rad/s")],
)
def test_examples_of_any_size(kind: str, size: float, unit: str) -> None:
    values = filled(kind, [1.0, -2.0, 3.5, 0.5, 4.0, -1.5, 0.25, 6.0, 7.0]) * size
    key = Asking(kind).literal(tree(values, f"{{!r}}{unit}".format))
    assert None in require_examples(kind, key, alone=False)


def test_points_follow_from_the_key_and_the_name_of_the_question() -> None:
    """Who knows the points of one question does not know those of another."""
    symbols = {"k": "real", "m": "real"}
    question = Question.model_validate({"kind": "vector", "answer": ["k*m", "k"], "symbols": symbols})
    asked = Asked(question, ["k*m", "k"], name="a")
    kind = KINDS["vector"]
    points = kind.read_key(asked).points
    assert kind.read_key(asked).points == points
    assert kind.read_key(replace(asked, name="b")).points != points
    assert kind.read_key(replace(asked, value=["k*m", "2*k"])).points != points


@answers("""
    kind | key | answer
    vector | [0, 0, 4] | [0, 0, 17]
    tensor | [[2, 0, 0], [0, 3, 0], [0, 0, 4]] | [[2.5, 0, 0], [0, 3.5, 0], [0, 0, 4.7]]
    """)
def test_zeros_earn_nothing(kind: str, key: str, answer: Any) -> None:
    outcome = Asking(kind).judged(Asking(kind).literal(read_tree(key, "", typed=True)), answer)
    assert (outcome.verdict, outcome.share, codes(outcome)) == ("incorrect", 0.0, ["outside_tolerance"])


# --- what cannot be read

RIGHT = {
    "vector": ["1 cm", "-2 cm", "0 cm"],
    "moments": ["2", "11", "11"],
    "matrix": [["1", "2", "0"], ["-3", "4", "5"], ["6", "7", "9"]],
    "tensor": [["8", "-3", "-3"], ["-3", "8", "-3"], ["-3", "-3", "8"]],
}


@answers(
    """
    kind | code | answer
    vector | unit_incompatible | '[1, -2, 0] kg'  '[1 cm, -2, 0] cm'
    vector | wrong_shape | '[1, -2] cm'  '[1, -2, 0'  '[[1, -2, 0]] cm'  1, -2, 0 cm  [1, 2]  []  [1, 2, [3]]
    {x: 1}  {x: 1, y: -2}  {x: 1, y: -2, w: 0}  {vx: 1, wy: -2, vz: 0}  {'': 1, y: -2, z: 0}  {}
    vector | parse_error | '[1, -2, 0]] cm'  '[[1, -2, 0] cm'  '[&a 1, *a, 0] cm'
    vector | not_a_number | (1, -2, 0) + (0, 0, 0)  [1, 2 +- 0.1, 3]  [1, 2, three]  [1, 2, null]
    [1, 2, __import__('os').system('id')]
    vector | not_a_finite_number | [1, 2, nan]  [1, 2, 1e999]  [1, 2, 9**9**9**9]
    vector | duplicate_key | {x: 1, X: -2, z: 0}  {x: 1, 1: -2, z: 0}
    moments | wrong_shape | 2, 11, 11  []
    moments | not_a_number | [2, 11, null]
    moments | unit_incompatible | [2, 11, 11 m]
    matrix | wrong_shape | 1  []  [[]]  [1]  [[1, 2], 3]  [[1, 2], [3]]  {a: 1}
    tensor | wrong_shape | 8  [[8, 3], [3, 8]]  [8, 8, 8]  [[8, 3, 3], [3, 8], [3, 3, 8]]
    [[8, 3, 3], [3, 8, 3], [3, 3, {}]]  {Ixx: 8, Iyy: 8, Izz: 8}
    {Ixx: 8, Iyy: 8, Izz: 8, Ixy: -3, Ixz: -3, Iyw: -3}
    tensor | duplicate_key | {Ixx: 8, ixx: 8}
    tensor | not_a_finite_number | [[8, 3, 3], [3, 8, 3], [3, 3, inf]]
    """,
    ("vector", "too_large", ["1", "2", "3" * 500]),
    ("moments", "wrong_shape", ["1"] * 101),
    ("matrix", "too_large", [["1"] * 101] * 100),
)
def test_what_cannot_be_read(kind: str, code: str, answer: Any) -> None:
    outcome = Asking(kind).judged(Asking(kind).literal(RIGHT[kind]), answer)
    assert (outcome.verdict, outcome.share, codes(outcome)[0]) == ("invalid", 0.0, code)


@answers("""
    kind | options | answer
    vector | {} | 17.25  [17.25, [2]]  [[17.25]]  []  [17.25 kg, 2 m]  [m*17.25, 2]
    vector | {direction: parallel} | [0, 0]
    vector | {tolerance: {significant_figures: 3, figures: strict}} | [17.25, 2]
    vector | {symbols: {m: real}} | [sqrt(-17.25 - m^2), 2]
    matrix | {} | 17.25  [17.25]  [[17.25], [1, 2]]  [[17.25, x]]  [[]]  []
    tensor | {} | 17.25  [17.25]  [[17.25, 0], [0, 17.25]]  [[17.25, 1, 0], [0, 2, 0], [0, 0, 3]]
    """)
def test_bad_keys_are_refused_without_being_told(kind: str, options: str, answer: Any) -> None:
    with pytest.raises(ValueProblem) as refusal:
        Asking(kind).literal(answer, **read_tree(options, ""))
    assert "17.25" not in str(refusal.value)


# --- symbols

VANISHING = ["abs(a - 3) + a - 3", "exp(-1e6*(a - 0.9)^2)", "log(1 + exp(1e3*(a - 20)))", "sign(a - 1e7) + 1"]
"""What is nothing, or next to it, at most values of a symbol."""


@pytest.mark.parametrize("more", VANISHING)
@pytest.mark.parametrize(
    ("kind", "key"),
    [
        ("vector", ["m*a", "0", "2*m*a"]),
        ("moments", ["m*a^2", "2*m*a^2"]),
        ("matrix", [["m*a", "0"], ["0", "3"]]),
        ("tensor", [["2*m*a^2", "0", "0"], ["0", "2*m*a^2", "0"], ["0", "0", "3*m*a^2"]]),
    ],
)
def test_what_vanishes_at_most_values_of_a_symbol_is_not_right(kind: str, key: Any, more: str) -> None:
    asking = Asking(kind)
    ours = asking.literal(key, symbols={"m": "positive", "a": "positive"})
    answer = [list(row) if isinstance(row, list) else row for row in key]
    row = answer[0] if isinstance(answer[0], list) else answer
    assert asking.judged(ours, answer).verdict == "correct"
    row[0] = f"{row[0]} + m*({more})"
    assert asking.judged(ours, answer).verdict != "correct"
