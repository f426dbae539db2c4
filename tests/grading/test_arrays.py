"""What holds for all answers of many numbers: right in every writing, wrong as soon as one entry is off.

Keys have zeros, rounding noise in place of zeros, equal entries, and entries of hugely different sizes.
"""

from __future__ import annotations

import itertools
import pickle
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rigidcli.document.syntax import read_tree
from rigidcli.errors import ValueProblem
from rigidcli.grading.asked import Asked
from rigidcli.grading.kinds import KINDS
from rigidcli.grading.question import Question
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


# --- what is told

CUBE = "[[8, -3, -3], [-3, 8, -3], [-3, -3, 8]]"
MATRIX = "[[1, 2, 0], [-3, 4, 5], [6, 7, 9]]"
EXACT = "[[2/3, -1/4, 0], [-1/4, 2/3, 0], [0, 0, 4/3]]"
KM, KMG = "{symbols: {k: positive, m: positive}}", "{symbols: {m: positive, g: positive, theta: real}}"
KEYS = {"CUBE": CUBE, "MATRIX": MATRIX, "EXACT": EXACT, "KM": KM, "KMG": KMG}


@answers("""
    kind | key | options | share | told | answer
    # Units, and what a unit vector is.
    vector | [1 cm, -2 cm, 0 cm] | {} | 1 | | [1 cm, -20 mm, 0 m]  [1, -2, 0]  [0.00001 km, -2e-2 m, 0]
    [1/100 m, -sqrt(4), sin(0)]  [1e-2 m, −2, -0.0]  [1, -2, 3e-7]  [1, -2, 3e-9 m]
    vector | [1 cm, 2 cm, 0 cm] | {} | 0 | unit_incompatible@component 1 | [1 kg, 2 cm, 0]
    vector | [1, 2] | {} | 0 | unit_incompatible@component 1; unit_incompatible@component 2 | [1 cm, 2 cm]
    vector | [1 cm, -2 cm, 0 cm] | {unit: required} | 1 | | [1 cm, -2 cm, 0]  [0.01 m, -20 mm, 0 km]
    '[1, -2, 0] cm'
    vector | [1 cm, -2 cm, 0 cm] | {unit: required} | 0 | unit_missing | [1, -2, 0]  [1 cm, -2, 0]  [7, 8, 9]
    '[1, -2, 0]'
    # Nothing to require of pure numbers, of angles, or of symbols.
    vector | [1, 2] | {unit: required} | 1 | | [1, 2]
    vector | [1 deg, 2 deg] | {unit: required} | 1 | | [1, 2]
    vector | [2*k, 3 m] | {unit: required, symbols: {k: positive}} | 1 | | [2*k, 3]
    vector | [0, 3, 4] | {direction: sense, normalized: required} | 1 | | [0, 0.6, 0.8]
    vector | [0, 3, 4] | {direction: parallel, normalized: required} | 1 | | [0, 0.6, 0.8]
    vector | [0, 3, 4] | {direction: sense, normalized: required} | 0 | axis_not_normalised | [0, 3, 4]
    vector | [0, 3, 4] | {direction: parallel, normalized: required} | 0 | axis_not_normalised | [0, 3, 4]
    vector | [0, 3, 4] | {direction: sense, normalized: required} | 0 | outside_tolerance | [0, 0.8, 0.7]
    vector | [0, 3, 4] | {direction: sense} | 1 | | [0, 300, 400]
    vector | [0, 3, 4] | {direction: parallel} | 1 | | [0, 300, 400]
    moments | [2 kg m^2, 11, 11] | {} | 1 | | '[2, 11, 11] kg m^2'  '[11, 2, 11]'  {x: 2, y: 11, z: 11}
    {lambda1: 11, lambda2: 2, lambda3: 11 kg m^2}  '{I1: 2e7, I2: 11e7, I3: 11e7} g cm^2'
    moments | [2 kg m^2, 11, 12] | {} | 2/3 | component_wrong@moment 3 | '[2, 11, 11] kg m^2'
    # Mistakes with a name, and those of which several would do.
    vector | [1 m, 2 m, 3 m] | {} | 0 | constant_factor | [180/pi, 360/pi, 540/pi]
    vector | [1, -1, 0] | {} | 0 | outside_tolerance | [-1, 1, 0]
    vector | [0, 0, 4] | {} | 0 | constant_factor | [0, 0, 2]
    vector | [0, 0, 4] | {} | 0 | outside_tolerance | [0, 0, 2.2]  [0, 0, 17]
    moments | [2, 11, 11] | {} | 2/3 | multiplicity | [2, 11]  [11, 2]  [2, 2, 11]
    moments | [2, 11, 11] | {} | 3/4 | multiplicity | [2, 11, 11, 11]
    moments | [2, 11, 11] | {} | 0 | wrong_shape | [2]  [2, 11, 11, 5]
    moments | [2, 11, 11] | {} | 2/3 | not_physical | [-2, 11, 11]
    moments | [2, 11, 11] | {} | 0 | not_physical | [-2, -11, -11]
    moments | [2, 11, 11] | {} | 2/3 | triangle_inequality | [2, 5, 11]
    moments | [2, 11, 11] | {} | 0 | power_of_ten | [0.2, 1.1, 1.1]
    moments | [2, 11, 11] | {} | 0 | constant_factor | [7, 38.5, 38.5]
    moments | [2, 11, 11] | {} | 2/3 | component_wrong@moment 1 | [3, 11, 11]
    moments | [2, 11, 11] | {} | 0 | outside_tolerance | [7, 8, 9]
    # Frequencies may be negative, and need no triangle.
    moments | [1, 2, 30] | {} | 2/3 | sign_error@moment 1 | [-1, 2, 30]
    moments | [1, 2, 30] | {} | 2/3 | component_wrong@moment 3 | [1, 2, 40]
    moments | [1, 2, 30] | {} | 2/3 | component_wrong@moment 1 | [40, 2, 1]
    # At a power of ten, figures allow 9.952 for 10.0 only, and 9.988 for both.
    moments | [9.99, 10.0] | {tolerance: {significant_figures: 3}} | 1 | | [9.952, 9.988]  [9.988, 9.952]
    matrix | MATRIX | {} | 1/3 | transposed | [[1, -3, 6], [2, 4, 7], [0, 5, 9]]
    matrix | MATRIX | {} | 0 | power_of_ten | [[10, 20, 0], [-30, 40, 50], [60, 70, 90]]
    matrix | MATRIX | {} | 0 | constant_factor | [[1.7, 3.4, 0], [-5.1, 6.8, 8.5], [10.2, 11.9, 15.3]]
    matrix | MATRIX | {} | 0 | sign_error | [[-1, -2, 0], [3, -4, -5], [-6, -7, -9]]
    matrix | MATRIX | {} | 7/9 | sign_error@row 2, column 1; row 3, column 2 |
    [[1, 2, 0], [3, 4, 5], [6, -7, 9]]
    matrix | MATRIX | {} | 8/9 | component_wrong@row 3, column 3 | [[1, 2, 0], [-3, 4, 5], [6, 7, 8]]
    matrix | MATRIX | {} | 0 | outside_tolerance | [[2, 3, 0], [-4, 5, 6], [7, 8, 1]]
    matrix | [[1, 2, 3], [4, 5, 6]] | {} | 0 | transposed | [[1, 4], [2, 5], [3, 6]]
    matrix | [[1, 2, 3], [4, 5, 6]] | {} | 0 | wrong_shape |
    [[1, 2], [4, 5]]  [[1, 2], [3, 4], [5, 6]]  [[1, 2, 3]]
    tensor | CUBE | {} | 1/2 | products_of_inertia_sign | [[8, 3, 3], [3, 8, 3], [3, 3, 8]]
    tensor | CUBE | {} | 1/2 | products_of_inertia_missing | [[8, 0, 0], [0, 8, 0], [0, 0, 8]]
    tensor | CUBE | {} | 0 | sign_error | [[-8, 3, 3], [3, -8, 3], [3, 3, -8]]
    tensor | CUBE | {} | 0 | power_of_ten | [[8e-4, -3e-4, -3e-4], [-3e-4, 8e-4, -3e-4], [-3e-4, -3e-4, 8e-4]]
    tensor | CUBE | {} | 0 | other_frame | [[2, 0, 0], [0, 11, 0], [0, 0, 11]]
    tensor | CUBE | {} | 5/6 | not_symmetric@Ixy | [[8, -3, -3], [3, 8, -3], [-3, -3, 8]]
    tensor | CUBE | {} | 2/3 | not_symmetric@Ixy; component_wrong@Izz |
    [[8, -2, -3], [-4, 8, -3], [-3, -3, 9]]
    tensor | CUBE | {} | 5/6 | component_wrong@Iyy | [[8, -3, -3], [-3, 7, -3], [-3, -3, 8]]
    tensor | CUBE | {} | 5/6 | not_physical; component_wrong@Iyy | [[8, -3, -3], [-3, 1, -3], [-3, -3, 8]]
    tensor | CUBE | {} | 0 | triangle_inequality | [[1, 0, 0], [0, 2, 0], [0, 0, 30]]
    tensor | CUBE | {} | 0 | outside_tolerance | [[4, 1, 0], [1, 5, 0], [0, 0, 4]]
    # Where only zeros are right; and a small wrong entry changes the moments by its square only.
    tensor | [[2, 0, 0], [0, 3, 0], [0, 0, 4]] | {} | 0 | outside_tolerance |
    [[2.5, 0, 0], [0, 3.5, 0], [0, 0, 4.7]]
    tensor | [[1, 0, 0], [0, 2, 0], [0, 0, 3]] | {} | 5/6 | component_wrong@Ixy |
    [[1, 0.02, 0], [0.02, 2, 0], [0, 0, 3]]
    # Too few digits.
    vector | [1/6 m, 5/6 m, 0 m] | {} | 0 | precision_insufficient | [0.17, 0.83, 0]
    vector | [1/6 m, 5/6 m, 0 m] | {} | 2/3 | precision_insufficient@component 1 | [16.7 cm, 0.8333, 0]
    vector | [1/6 m, 5/6 m, 0 m] | {} | 0 | outside_tolerance | [0.16, 0.83, 0]  [0.17, 0.83, 0.01]
    [17/100, 83/100, 0]
    vector | [1/6, 5/6] | {direction: sign_free} | 0 | precision_insufficient | [-0.17, -0.83]
    # To one digit it may as well be a factor of 4/3.
    vector | [0, 0.75] | {} | 0 | outside_tolerance | [0, 1]
    # 0.42 is more than 0.08 + 0.33, but by no more than was rounded away.
    moments | [1/12, 1/3, 5/12] | {} | 0 | precision_insufficient | [0.08, 0.33, 0.42]  [0.42, 0.08, 0.33]
    moments | [1/12, 1/3, 5/12] | {} | 2/3 | precision_insufficient@moment 1 | [0.33, 0.0833, 0.4167]
    moments | [1/12, 1/3, 5/12] | {} | 0 | outside_tolerance | [0.08, 0.34, 0.42]  [0.33, 0.33, 0.42]
    moments | [1/12, 1/3, 5/12] | {} | 0 | triangle_inequality | [8/100, 0.33, 0.42]
    moments | [1/12, 1/3, 5/12] | {order: ascending} | 0 | precision_insufficient | [0.08, 0.33, 0.42]
    moments | [1/12, 1/3, 5/12] | {order: ascending} | 0 | triangle_inequality | [0.33, 0.08, 0.42]
    matrix | [[1/6, 2], [-1/3, 0]] | {} | 1/2 | precision_insufficient@row 1, column 1; row 2, column 1 |
    [[0.17, 2], [-0.33, 0]]
    tensor | EXACT | {} | 1/2 | precision_insufficient@Ixx, Iyy, Izz |
    {Ixx: 0.67, Iyy: 0.67, Izz: 1.33, Ixy: -0.25, Ixz: 0, Iyz: 0}
    tensor | EXACT | {} | 0 | precision_insufficient |
    {Ixx: 0.67, Iyy: 0.67, Izz: 1.33, Ixy: -0.3, Ixz: 0, Iyz: 0}
    # Symbols.
    vector | [sqrt(k/m), 0, -2*k] | KM | 0 | number_for_symbol@component 1, component 3 | [2, 0, -3]
    vector | [sqrt(k/m), 0, -2*k] | KM | 2/3 | number_for_symbol@component 1 | [2, 0, -2*k]
    vector | [sqrt(k/m), 0, -2*k] | KM | 0 | not_a_number@component 1 | [20 +- 1, 0, -2*k]
    vector | [m*g*sin(theta), 0, -m*g] | KMG | 1 | | [g*m*sin(-theta)*(-1), m - m, -g/(1/m)]
    vector | [m*g*sin(theta), 0, -m*g] | KMG | 2/3 | component_wrong@component 1 |
    [g*m*abs(sin(theta)), 0, -m*g]
    [m*g*theta, 0, -m*g]
    moments | [sqrt(k/m), k] | KM | 0 | number_for_symbol@moment 1, moment 2 | [2, 3]
    moments | [sqrt(k/m), k] | KM | 1/2 | number_for_symbol@moment 1 | [2, k]
    matrix | [[0, 1/m], [-k, 0]] | KM | 0 | number_for_symbol@row 1, column 2; row 2, column 1 |
    [[0, 1], [-4, 0]]
    matrix | [[0, 1/m], [-k, 0]] | KM | 3/4 | number_for_symbol@row 1, column 2 | [[0, 0.5], [-k, 0]]
    """)
def test_what_is_told_of_an_array(
    kind: str, key: str, options: str, share: str, told: str, answer: Any
) -> None:
    tree = read_tree(KEYS.get(key, key), "", typed=True)
    made = Asking(kind).literal(tree, **read_tree(KEYS.get(options, options), ""))
    outcome = Asking(kind).judged(made, answer)
    found = "; ".join(f"{each.code}@{each.place}".rstrip("@") for each in outcome.findings)
    assert found == told
    assert outcome.share == pytest.approx(float(Fraction(share)))


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
