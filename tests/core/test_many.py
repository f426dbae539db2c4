"""Many numbers at once: the same bits as one by one, and pairs of floats whose errors are bounded."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from dataclasses import asdict
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rigidcli.core import elliptic
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.groups import ALONE, PartedError, UnfitError, grouped
from rigidcli.core.high_precision import CONTEXT
from rigidcli.core.many import Many
from rigidcli.core.many_arithmetic import MANY
from rigidcli.core.nutation import nutation
from rigidcli.core.pairs import LEAST, Pairs, exactly, rounded

few = settings(max_examples=60, deadline=None)

FLOATS = st.floats(-1e6, 1e6).filter(lambda x: x == 0 or abs(x) > 1e-6)
LISTS = st.lists(FLOATS, min_size=1, max_size=5)


def interval(pairs: Pairs, place: int) -> tuple[Fraction, Fraction]:
    """The least and the largest number that a pair may be."""
    high, low, radius = (np.broadcast_to(part, 9) for part in (pairs.high, pairs.low, pairs.radius))
    middle, reach = Fraction(high[place]) + Fraction(low[place]), Fraction(radius[place])
    return middle - reach, middle + reach


def several(*values: float) -> Any:
    """Pairs of which all digits are needed: the quotients by 3."""
    return exactly(Many(np.array([*values] * 9)[:9])) / 3


# --- pairs


@pytest.mark.parametrize("operation", [operator.add, operator.sub, operator.mul, operator.truediv])
@few
@given(one=FLOATS, other=FLOATS)
def test_the_exact_result_lies_within_the_radius(
    operation: Callable[[Any, Any], Any], one: float, other: float
) -> None:
    assume(operation is not operator.truediv or other != 0)
    found = operation(several(one), several(other))
    exact = operation(Fraction(one) / 3, Fraction(other) / 3)
    low, high = interval(found, 0)
    assert low <= exact <= high
    assert high - low <= Fraction(1e-27) * (abs(exact) + abs(Fraction(one)) + abs(Fraction(other)))


@few
@given(st.floats(1e-9, 1e9))
def test_the_root_lies_within_the_radius(number: float) -> None:
    low, high = interval(several(number).sqrt(), 0)
    assert 0 <= low**2 <= Fraction(number) / 3 <= high**2
    assert high - low <= Fraction(1e-29) * high


@few
@given(FLOATS, FLOATS, st.sampled_from(["0.1", "1e-40", "-7", "3.25"]))
def test_decimals_stand_beside_pairs(one: float, other: float, constant: str) -> None:
    number = Decimal(constant)
    found = (number - several(one)) * number + several(other) * 2
    exact = (Fraction(number) - Fraction(one) / 3) * Fraction(number) + Fraction(other) / 3 * 2
    low, high = interval(found, 0)
    assert low <= exact <= high


@few
@given(FLOATS, FLOATS)
def test_a_rounded_pair_is_the_float_nearest_to_the_number(one: float, other: float) -> None:
    found = rounded(several(one) * several(other)).values[0]
    assert found == float(Fraction(one) * Fraction(other) / 9)


def test_what_lies_between_two_floats_is_uncertain() -> None:
    half = exactly(Many(np.array([1.0, 3.0]))) / 3 * 3 + Decimal(2) ** -53
    with pytest.raises(PartedError) as parted:
        rounded(half)
    assert parted.value.labels[0] == ALONE


@few
@given(FLOATS.filter(bool))
def test_comparisons_are_certain_or_not_made(number: float) -> None:
    again = several(number) * 3
    with pytest.raises(PartedError):
        assert again == Decimal(number)
    with localcontext(CONTEXT):
        beside = Decimal(number) + abs(Decimal(number)) * Decimal("1e-20")
        assert again < beside
        assert not again >= beside
        assert again != beside


def test_products_too_small_for_all_their_parts_say_so() -> None:
    tiny = exactly(Many(np.array([1e-100, 1e-120])))
    assert (tiny * tiny).radius.min() >= LEAST
    with pytest.raises(PartedError):
        _ = tiny * tiny > 0


# --- many


@few
@given(LISTS, FLOATS)
def test_operations_have_the_bits_of_floats(values: list[float], other: float) -> None:
    many: Any = Many(np.array(values))
    for operation in (operator.add, operator.sub, operator.mul):
        assert operation(many, other).values.tolist() == [operation(value, other) for value in values]
        assert operation(other, many).values.tolist() == [operation(other, value) for value in values]
    assert (many**2).values.tolist() == [value**2 for value in values]
    for name in ("sin", "cos"):
        found = getattr(MANY, name)(many)
        assert found.values.tolist() == [getattr(math, name)(value) for value in values]
    lengths: Any = MANY.hypot(many, other, 1.0)
    assert lengths.values.tolist() == [math.hypot(x, other, 1.0) for x in values]
    roots: Any = MANY.sqrt(abs(many))
    assert roots.values.tolist() == [math.sqrt(abs(value)) for value in values]


@pytest.mark.parametrize("shape", [(7,), (9,), (300,), (20, 3), (3, 20), (9, 1), (2, 3)])
def test_sums_have_the_bits_of_those_of_single_runs(shape: tuple[int, ...]) -> None:
    runs = np.random.default_rng(1).normal(size=(5, *shape)) ** 9
    many: Any = Many(runs)
    for axis in (None, *range(len(shape))):
        assert (many.sum(axis).values == [run.sum(axis) for run in runs]).all()
        if len(shape) == 2:
            assert (many.T.sum(axis).values == [run.T.sum(axis) for run in runs]).all()


def test_what_needs_one_float_does_not_take_many() -> None:
    many: Any = Many(np.array([1.0, 2.0]))
    uses: list[Callable[[], object]] = [
        lambda: float(many),
        lambda: math.exp(many),
        lambda: np.array([many, 1.0], dtype=float),
        lambda: np.eye(2) @ many,
        lambda: np.sin(many),
        lambda: np.add.reduce(many),
        lambda: Many(np.ones((2, 3, 3))).T.flat,
        lambda: bool(Many(np.ones((2, 3))) > 0),
        lambda: many[0],
        lambda: f"{many:.3g}",
        lambda: many.shape,
    ]
    for use in uses:
        with pytest.raises(UnfitError):
            use()


MATRICES: dict[str, Callable[..., Any]] = {
    "products": lambda a, b, u, v: a @ b.T @ a.T @ u + v @ a,
    "products of sums": lambda a, b, u, v: (a.T * u[0] + 1) @ (a + b.T) @ (v - u) @ (b.T - v).T,
    "a product with itself": lambda a, b, u, v: a @ a.T,
    "a scalar product": lambda a, b, u, v: (u @ v / 3) * a,
    "an outer product": lambda a, b, u, v: np.outer(u, v) - b,
    "an outer sum": lambda a, b, u, v: np.add.outer(u, v),
    "a vector product": lambda a, b, u, v: np.cross(u, v) ** 2,
    "a diagonal matrix": lambda a, b, u, v: np.diag(u) + np.diag(a),
    "sums": lambda a, b, u, v: np.abs(a).sum(axis=0) + u.sum(),
    "norms": lambda a, b, u, v: np.linalg.norm(a.T @ b, axis=0).max(),
    "a choice": lambda a, b, u, v: np.where((a <= b) & np.isfinite(b), 0.0, a) / np.sqrt(abs(v)),
    "entries": lambda a, b, u, v: a[0, 1:] * v[2] - a.diagonal()[1] + a[[1, 2], [2, 0]],
}


@pytest.mark.parametrize("name", MATRICES)
@pytest.mark.parametrize("shared", ["", "a", "bv"])
def test_arrays_have_the_bits_of_single_ones(name: str, shared: str) -> None:
    rng = np.random.default_rng(len(name))
    shapes = {"a": (3, 3), "b": (3, 3), "u": (3,), "v": (3,)}
    values = {key: rng.normal(size=(1 if key in shared else 40, *shape)) for key, shape in shapes.items()}
    found = MATRICES[name](*(one[0] if key in shared else Many(one) for key, one in values.items()))
    for place in range(40):
        single = MATRICES[name](*(one[place % len(one)] for one in values.values()))
        many = found.values[place] if isinstance(found, Many) else found
        assert np.array_equal(many, single)


def test_arrays_change_where_they_are_told() -> None:
    rows = np.arange(6.0).reshape(2, 3)
    many: Any = Many(rows.copy())
    many[abs(many) <= 1] = 7.0
    assert many.values.tolist() == [[7, 7, 2], [3, 4, 5]]
    many[1:] = [many[0], 0.0]
    assert many.values.tolist() == [[7, 7, 0], [3, 3, 0]]


def test_division_by_zero_is_that_of_floats() -> None:
    with pytest.raises(ZeroDivisionError):
        _ = 1.0 / Many(np.zeros(3))
    with pytest.raises(PartedError):
        _ = 1.0 / Many(np.array([0.0, 1.0]))


@few
@given(st.lists(st.integers(-2, 2), min_size=1, max_size=60))
def test_runs_that_part_are_worked_in_groups_and_none_is_lost(values: list[int]) -> None:
    numbers = np.array(values, dtype=float)

    def work(runs: Any) -> float:
        many: Any = Many(numbers[runs])
        if many == 2:
            raise UnfitError
        return float(MANY.sign(many) or 0)

    found = list(grouped(np.arange(len(numbers)), work))
    assert sorted(run for runs, _ in found for run in runs) == list(range(len(numbers)))
    for runs, sign in found:
        assert sign is None or (np.sign(numbers[runs]) == sign).all()


# --- the formulas that take them


@pytest.mark.parametrize("seed", range(4))
def test_nutation_has_the_bits_of_eighty_digits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = 300
    columns: dict[str, Floats] = {
        "lambda1": rng.uniform(1e-4, 1e-3, count),
        "lambda3": np.full(count, 1.875e-5),
        "spin": rng.uniform(-1e4, 1e4, count) if seed % 2 else rng.uniform(0, 700, count),
        "tilt": rng.uniform(0, math.pi, count),
        "precession": rng.normal(0, 30, count) if seed > 1 else np.zeros(count),
        "nutation": np.zeros(count),
        "weight_moment": rng.uniform(0, 0.1, count),
    }

    def work(runs: Any) -> dict[str, Any]:
        with np.errstate(all="ignore"):
            many: Any = {name: Many(values[runs]) for name, values in columns.items()}
            return asdict(nutation(**many))

    together = 0
    for runs, found in grouped(np.arange(count), work):
        together += 0 if found is None else len(runs)
        for place, run in enumerate(runs.tolist() if found else ()):
            single: Any = {name: float(values[run]) for name, values in columns.items()}
            one = asdict(nutation(**single))
            assert found is not None
            for key, value in one.items():
                many = found[key]
                assert (many.values[place] if isinstance(many, Many) else many) == value
    assert together > 0.8 * count


@few
@given(st.floats(1e-6, 1), st.floats(1e-3, 1e3))
def test_complete_integrals_lie_within_the_radius(complement: float, p: float) -> None:
    with localcontext(CONTEXT):
        pairs = exactly(Many(np.full(9, complement))), exactly(Many(np.full(9, p)))
        exact = Decimal(complement), Decimal(p)
        for many, one in (
            (elliptic.complete_first(pairs[0]), elliptic.complete_first(exact[0])),
            (elliptic.complete_third(*pairs), elliptic.complete_third(*exact)),
        ):
            low, high = interval(many, 0)
            assert low <= Fraction(one) <= high
            assert high - low < Fraction(1, 10**20)


def test_many_sums_and_one_float_agree_on_signs() -> None:
    many: Any = Many(np.array([3.0, 0.5, 1e-300]))
    assert MANY.sign(many) == FLOAT.sign(3.0) == 1
    assert MANY.sign(-many) == FLOAT.sign(-3.0) == -1
    assert MANY.sign(0 * many) == FLOAT.sign(0.0) == 0
