"""Vectors, moments, matrices and tensors: keys, mistakes on the way to a tensor, and laws."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rigidcli.errors import DocumentError
from tests.homework.asking import asked, cases, codes, judged, typed

Floats = NDArray[np.float64]


@cases(
    """
    kind | options | answer
    vector | | 17.25 kg, 2 m  [17.25, [2]]  []  [17.25 kg, 2 m]
    vector | direction: parallel | [0, 0]
    moments | order: ascending | [17.25*a, b]
    matrix | | [[17.25], [1, 2]]  [[]]
    tensor | | 17.25  [[17.25, 0], [0, 17.25]]  [[17.25, 1, 0], [0, 2, 0], [0, 0, 3]]
    """,
    read=typed,
)
def test_bad_keys_are_refused_without_being_told(kind: str, options: str, answer: Any) -> None:
    with pytest.raises(DocumentError) as refused:
        asked({"kind": kind, "answer": answer, **typed(f"{{{options}}}")})
    assert "17.25" not in str(refused.value)


# --- keys from documents


def about(points: list[tuple[float, ...]], origin: Any) -> Floats:
    """Sum m (r^2 1 - r r^T), r taken from the origin given."""
    total = np.zeros((3, 3))
    for mass, *place in points:
        r = np.array(place) - np.array(origin)
        total += mass * (r @ r * np.eye(3) - np.outer(r, r))
    return total


def rows(values: Any) -> list[list[str]]:
    return [[repr(float(value)) for value in row] for row in values]


def mistaken(points: list[tuple[float, ...]], origin: Floats, turn: Floats) -> dict[str, Floats]:
    """The tensor about the origin along the columns of `turn`, and what comes out under mistakes."""
    masses, places = np.array(points)[:, 0], np.array(points)[:, 1:]
    com = masses @ places / masses.sum()
    d = turn.T @ (origin - com)
    central = turn.T @ about(points, com) @ turn
    steiner = masses.sum() * (d @ d * np.eye(3) - np.outer(d, d))
    right = central + steiner
    found = {
        "": right,
        "products_of_inertia_sign": 2 * np.diag(np.diag(right)) - right,
        "products_of_inertia_missing": np.diag(np.diag(right)),
        "parallel_axis_missing": central,
        "parallel_axis_sign": central - steiner,
        "power_of_ten": right / 100,
        "constant_factor": right * 2.7,
        "other_frame": turn @ right @ turn.T,
    }
    for order in list(itertools.permutations(range(3)))[1:]:
        found[f"components_permuted {order}"] = right[np.ix_(order, order)]
    return found


def are_apart(tensors: dict[str, Floats]) -> bool:
    scale, values = np.abs(tensors[""]).max(), list(tensors.values())
    return all(np.abs(a - b).max() > 0.05 * scale for k, a in enumerate(values) for b in values[:k])


COORDINATES = st.integers(-4, 4).map(float)
POINTS = st.lists(st.tuples(st.integers(1, 5).map(float), *[COORDINATES] * 3), min_size=2, max_size=6)


@settings(max_examples=15)
@given(POINTS, st.tuples(*[COORDINATES] * 3), st.sampled_from(["minus", "plus"]))
def test_mistakes_on_the_way_to_a_tensor(
    points: list[tuple[float, ...]], origin: tuple[float, ...], products: str
) -> None:
    turn = Rotation.from_rotvec(math.radians(50) * np.array([1, 2, 3]) / math.sqrt(14)).as_matrix()
    frame = {"axis": [1, 2, 3], "angle": "50 deg"}
    tensors = mistaken(points, np.array(origin), turn)
    assume(are_apart(tensors))
    document = json.dumps({"body": {"points": points}, "about": origin, "frame": frame})
    item = asked(f"{{ask: inertia.tensor, products: {products}}}", document)
    signs = 2 * np.eye(3) - 1 if products == "plus" else np.ones((3, 3))
    for code, tensor in tensors.items():
        outcome = judged(item, rows(tensor * signs))
        assert codes(outcome)[:1] == code.split()[:1]
        assert (outcome.verdict == "correct") == (not code)


def test_moments_of_mistaken_tensors() -> None:
    points: list[tuple[float, ...]] = [(1, 1, 0, 0), (2, 0, 1, 1), (3, 0.5, 1, -1)]
    origin = np.array([1.0, -1, 2])
    item = asked("{ask: axes.moments}", json.dumps({"body": {"points": points}, "about": origin.tolist()}))
    tensors = mistaken(points, origin, np.eye(3))
    for code in ("", "products_of_inertia_sign", "products_of_inertia_missing", "parallel_axis_missing"):
        outcome = judged(item, [repr(float(each)) for each in np.linalg.eigvalsh(tensors[code])[::-1]])
        assert codes(outcome) == code.split()


SPINNING = """
body: {points: [[1, 1, 0, 0], [2, 0, 1, 1], [3, 0, 1, -1]]}
frame: {axis: [0, 0, 1], angle: 40 deg}
motion: {omega: [1, 2, 3]}
"""


def test_angular_momentum_in_other_axes() -> None:
    momentum = np.array([[10.0, 0, 0], [0, 6, 1], [0, 1, 6]]) @ [1, 2, 3]
    turn = Rotation.from_rotvec([0, 0, math.radians(40)]).as_matrix()
    item = asked("{ask: axes.angular_momentum}", SPINNING)
    along = turn.T @ momentum
    assert judged(item, [f"{value:.3g}" for value in along]).verdict == "correct"
    assert judged(item, [f"{value * 1000:.4g} g m^2/s" for value in along]).verdict == "correct"
    outcome = judged(item, [repr(float(value)) for value in momentum])
    assert codes(outcome) == ["other_frame"]
    assert outcome.share == pytest.approx(1 / 3)


def test_a_centre_of_mass_at_the_origin() -> None:
    """0.1 + 0.2 - 0.3 is not zero in floats, but the centre of mass is."""
    points = [[1, 0.1, 3, 0], [1, 0.2, -3, 0], [1, -0.3, 0, 1], [1, 0, 0, -1]]
    item = asked("{ask: inertia.center_of_mass}", f"body: {{points: {points}}}")
    assert judged(item, ["0", "1e-16", "-3e-17"]).verdict == "correct"
    assert judged(item, ["0.1", "0", "0"]).share == pytest.approx(2 / 3)


@pytest.mark.parametrize(
    "more", ["abs(a - 3) + a - 3", "exp(-1e6*(a - 0.9)^2)", "log(1 + exp(1e3*(a - 20)))"]
)
@pytest.mark.parametrize(("kind", "key"), [("vector", ["m*a", "2*m*a"]), ("moments", ["m*a^2", "2*m*a^2"])])
def test_what_vanishes_at_most_values_of_a_symbol_is_not_right(kind: str, key: list[str], more: str) -> None:
    item = asked({"kind": kind, "answer": key, "symbols": {"m": "positive", "a": "positive"}})
    assert judged(item, key).verdict == "correct"
    assert judged(item, [f"{key[0]} + m*({more})", key[1]]).verdict != "correct"


# --- right is never wrong, and wrong never right

SHAPES = {"vector": (3,), "moments": (3,), "matrix": (2, 3), "tensor": (3, 3)}
UNITS = {"m": 1.0, "cm": 100.0, "km": 1e-3, "ft": 1 / 0.3048}
SIZES = st.one_of(st.sampled_from([0.0, 1.0, -1.0, 2.0, 1e-9, 1e9]), st.floats(0.1, 10), st.floats(-10, -0.1))
SCALES = st.sampled_from([1e-90, 1e-30, 1.0, 37.0, 1e30, 1e90])
NOISE = st.sampled_from([0.0, 1e-16, -3e-17, 1e-15])


@st.composite
def keys(draw: st.DrawFn) -> tuple[str, Floats]:
    """A kind, and an array with an entry that is not zero."""
    kind = draw(st.sampled_from(sorted(SHAPES)))
    values = np.resize(np.array(draw(st.lists(SIZES, min_size=9, max_size=9))), SHAPES[kind]) * draw(SCALES)
    values = (values + values.T) / 2 if kind == "tensor" else values
    assume(values.any())
    return kind, values


def tree(values: Any, form: str) -> Any:
    return [tree(value, form) for value in values] if np.ndim(values) else form.format(float(values))


@settings(max_examples=60)
@given(keys(), st.sampled_from([None, 1e-6, 0.02]), st.data())
def test_right_is_never_wrong(made: tuple[str, Floats], relative: float | None, data: st.DataObject) -> None:
    kind, values = made
    tolerance = {} if relative is None else {"tolerance": {"relative": relative}}
    item = asked({"kind": kind, "answer": tree(values, "{!r} m"), **tolerance})
    off = np.resize(data.draw(st.lists(st.floats(-0.9, 0.9), min_size=9, max_size=9)), values.shape)
    noise = data.draw(NOISE) * np.abs(values).max()
    near = np.where(
        values == 0, noise, values * (1 + (off + off.T if kind == "tensor" else off) / 2 * (relative or 0.01))
    )
    if kind == "moments":
        near = near[list(data.draw(st.permutations(range(3))))]
    unit, per = data.draw(st.sampled_from(sorted(UNITS.items())))
    style = data.draw(st.sampled_from(["{:.17g}", "-(-({:.17g}))", "({:.17g})*sqrt(4)/2"]))
    behind = f"{tree(near * per, style)} {unit}".replace("'", "")
    answer = data.draw(st.sampled_from([tree(near * per, f"{style} {unit}"), behind, tree(near, style)]))
    assert judged(item, answer).verdict == "correct"


CHANGES: dict[str, Callable[[Floats], Floats]] = {
    "another order": lambda values: np.roll(values, 1, axis=-1),
    "another sign": lambda values: -values,
    "zeros": np.zeros_like,
    "half": lambda values: values / 2,
    "a power of ten": lambda values: values * 10,
}


@settings(max_examples=60)
@given(keys(), st.sampled_from(["one entry off", *CHANGES]), st.data())
def test_wrong_is_never_right(made: tuple[str, Floats], change: str, data: st.DataObject) -> None:
    kind, values = made
    answer = values.copy() if change == "one entry off" else CHANGES[change](values).copy()
    largest = np.abs(values).max()
    if change == "one entry off":
        place = tuple(data.draw(st.integers(0, size - 1)) for size in values.shape)
        answer[place] += data.draw(st.floats(0.011, 100)) * (abs(values[place]) or largest)
    limits = 0.0101 * np.where(values == 0, largest, np.abs(values))
    orders = [list(order) for order in itertools.permutations(range(3))] if kind == "moments" else [...]
    assume(not any((np.abs(answer[order] - values) <= limits).all() for order in orders))
    outcome = judged(asked({"kind": kind, "answer": tree(values, "{!r} m")}), tree(answer, "{:.17g}"))
    assert outcome.verdict in ("partial", "incorrect")
    assert outcome.share < 1
    assert change != "zeros" or outcome.share == 0
    assert not any(finding.detail for finding in outcome.findings)
