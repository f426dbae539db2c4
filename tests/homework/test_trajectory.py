"""Trajectories: closed forms and other people's integrators are right, what differs from them is not."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from rigidcli.errors import DocumentError
from rigidcli.homework.base import Outcome
from rigidcli.homework.judge import Item
from tests.homework.asking import asked, cases, codes, judged, told, typed

Floats = NDArray[np.float64]
Columns = Mapping[str, Floats]


def formulas(stop: float, texts: Mapping[str, str], **options: Any) -> Item:
    answer = {"t": [0, stop, 0.1], "columns": dict(texts)}
    return asked(json.dumps({"kind": "trajectory", "answer": answer, **options}))


def written(columns: Columns, separator: str = ",", form: Callable[[float], str] = repr) -> dict[str, str]:
    """An answer with these columns, the time among them."""
    rows = np.column_stack(list(columns.values())).tolist()
    return {"csv": "\n".join([separator.join(columns), *(separator.join(map(form, row)) for row in rows)])}


def given_rows(item: Item, columns: Columns) -> Outcome:
    return judged(item, written(columns))


T = np.linspace(0, 10, 301)


def oscillator(t: Floats = T, rate: float = 2.0, size: float = 1.5, phase: float = 0.3) -> dict[str, Floats]:
    return {"t": t, "x": size * np.cos(rate * t + phase), "p": -rate * size * np.sin(rate * t + phase)}


@pytest.fixture(scope="module")
def spring() -> Item:
    return formulas(10, {"x": "1.5*cos(2*t + 0.3)", "p": "-3*sin(2*t + 0.3)"})


# --- right in any form


def comma(x: float) -> str:
    return repr(x).replace(".", ",")


@pytest.mark.parametrize(
    ("separator", "form"),
    [
        (",", repr),
        (",", "{:.5f}".format),
        (",", "{:+.6e}".format),
        (",", lambda x: f'"{x!r}"'),
        (";", repr),
        (";", comma),
        ("\t", comma),
        (" ", repr),
        ("\t", lambda x: f" {x!r} "),
    ],
)
def test_separators_and_numbers(spring: Item, separator: str, form: Callable[[float], str]) -> None:
    assert judged(spring, written(oscillator(), separator, form)).verdict == "correct"


def test_line_ends_comments_and_heads(spring: Item) -> None:
    text = written(oscillator())["csv"]
    head, body = text.split("\n", 1)
    for other in (
        text.replace("\n", "\r\n") + "\r\n",
        "\ufeff" + text,
        "# by me\n#\n\n" + text + "\n\n\n",
        text.replace("-", "\N{MINUS SIGN}"),
        f"# {head}\n{body}",
        f"Time (s),X,P\n{body}",
        f"t [s], x/m ,p (kg m/s)\n{body}",
        text.replace("0.0,", "0/3,", 1),
    ):
        assert judged(spring, {"csv": other}).verdict == "correct", other[:40]
        assert judged(spring, other).verdict == "correct"


def test_rows_at_any_times(spring: Item) -> None:
    chance = np.random.default_rng(3)
    for t in (np.linspace(-1, 12, 600), np.arange(0, 10, 0.25), np.sort(chance.uniform(0, 10, 90))):
        t = np.concatenate([[0.0], t, [10.0]]) if t[0] > 0 else t
        assert given_rows(spring, oscillator(t)).verdict == "correct"


def test_units_in_heads_are_converted(spring: Item) -> None:
    t, x, p = oscillator().values()
    assert given_rows(spring, {"t (ms)": 1000 * t, "x (cm)": 100 * x, "p": p}).verdict == "correct"
    assert given_rows(spring, {"t (min)": t / 60, "x": x, "p": p}).verdict == "correct"
    assert given_rows(spring, {"t": t, "x (cm)": x, "p": p}).share == 0.5
    key = asked(json.dumps({"kind": "trajectory", "answer": written({"t": t, "x (cm)": 100 * x})}))
    for columns in ({"t": t, "x": 100 * x}, {"t": t, "x (m)": x}):
        assert given_rows(key, columns).verdict == "correct"


def test_angles_are_judged_modulo_a_turn() -> None:
    motion = {"phi": "1.3*t + 0.2*sin(t)", "u": "1.3*t", "r": "1 + 0.3*cos(t)"}
    item = formulas(20, motion, angles=["u"])
    t = np.linspace(0, 20, 200)
    right = {"t": t, "phi": 1.3 * t + 0.2 * np.sin(t), "u": 1.3 * t, "r": 1 + 0.3 * np.cos(t)}
    jumps = 2 * math.pi * np.random.default_rng(1).integers(-2, 3, 200)
    assert given_rows(item, right).verdict == "correct"
    assert given_rows(item, right | {"phi": right["phi"] % (2 * math.pi)}).verdict == "correct"
    assert given_rows(item, right | {"u": right["u"] + jumps}).verdict == "correct"
    assert given_rows(item, right | {"r": right["r"] + 2 * math.pi}).share == pytest.approx(2 / 3)
    assert given_rows(item, right | {"phi": right["phi"] + 0.1}).share == pytest.approx(2 / 3)
    assert codes(given_rows(item, right | {"phi": np.degrees(right["phi"])})) == ["degrees_radians"]
    degrees = {name: values for name, values in right.items() if name != "phi"}
    assert given_rows(item, degrees | {"phi (deg)": np.degrees(right["phi"])}).verdict == "correct"


# --- what is wrong, and what it earns


def changed(**columns: Any) -> dict[str, Floats]:
    return {**oscillator(), **columns}


X, P = oscillator()["x"], oscillator()["p"]


@pytest.mark.parametrize(
    ("said", "share", "columns"),
    [
        ("time_range_short", 0.985, oscillator(T * 0.985)),
        ("time_range_short", 0.5, oscillator(T / 2)),
        ("time_range_short", 0.7, oscillator(np.append(np.linspace(0, 7, 200), 10.0))),
        ("time_range_short", 0, oscillator(np.linspace(2, 10, 200))),
        ("missing_column@`p`", 0.5, {"t": T, "x": X}),
        ("sign_error@`x`", 0.5, changed(x=-X)),
        ("sign_error@`x`,-`p`", 0, changed(x=-X, p=-P)),
        ("power_of_ten@`p`", 0.5, changed(p=100 * P)),
        ("constant_factor@`p`", 0.5, changed(p=2 * P)),
        ("wrong_initial_condition@`x` wrong_initial_condition@`p`", 0, changed(x=P, p=X)),
        ("wrong_initial_condition@`x` wrong_initial_condition@`p`", 0, oscillator(phase=0.5)),
        ("outside_tolerance@`x`", 0.7, changed(x=np.where(T > 4, 0, X))),
        ("wrong_order@`t`", 0, {name: values[::-1] for name, values in oscillator().items()}),
        ("wrong_order@`t`", 0, oscillator(np.append(T[:-1], T[-2:]))),
    ],
)
def test_wrong_trajectories(spring: Item, said: str, share: float, columns: Columns) -> None:
    outcome = given_rows(spring, columns)
    assert told(outcome).split()[: len(said.split())] == said.split()
    assert outcome.share == pytest.approx(share, abs=0.01)
    assert outcome.verdict == ("partial" if share else "incorrect")


def test_the_time_until_which_a_column_is_right_is_told(spring: Item) -> None:
    (finding,) = given_rows(spring, changed(x=np.where(T > 4, 0, X))).findings
    assert finding.detail == "it is right until t = 4"
    assert finding.reference.startswith("expected x = ")


def test_a_column_that_does_not_move_earns_nothing_by_itself() -> None:
    item = formulas(10, {"x": "t^2", "p": "3"})
    assert given_rows(item, {"t": T, "x": -(T**2), "p": np.full_like(T, 3)}).share < 0.15
    assert given_rows(item, {"t": T, "x": T**2, "p": T}).share == pytest.approx(0.5, abs=0.16)


def test_rows_that_only_show_the_returns_of_a_motion_are_too_few() -> None:
    t = np.arange(0, 41, 2.0)
    assert given_rows(formulas(40, {"x": "cos(pi*t)"}), {"t": t, "x": np.ones_like(t)}).verdict == "review"


def test_a_key_of_few_rows_is_compared_at_its_own_times() -> None:
    def motion(t: Floats) -> dict[str, Floats]:
        return {"t": t, "x": np.cos(4 * t), "phi": 3 * t % (2 * math.pi)}

    t = np.linspace(0, 20, 41)
    item = asked(json.dumps({"kind": "trajectory", "answer": written(motion(t), ",", "{:.8g}".format)}))
    for own in (t, np.linspace(0, 20, 2001), np.union1d(t, t + 0.03)[:-1]):
        assert given_rows(item, motion(own)).verdict == "correct"
        assert given_rows(item, motion(own) | {"x": np.cos(4 * own) + 0.02}).share < 1
    for count in (38, 1777):
        assert given_rows(item, motion(np.linspace(0, 20, count))).verdict == "review"


# --- keys of documents

SPRING = """
parameters: {m: 2, k: 18, a: 0.4}
system: {coordinates: [x], lagrangian: m*xdot^2/2 - k*x^2/2}
orbit: {initial: {x: a, p_x: 0}, duration: 7}
"""
TOP = "body: {moments: [2, 2, 3]}\nmotion: {omega: [0.6, 0, 2], duration: 12}\n"


@cases(
    """
    ask | heads
    hamilton.orbit | t,x,p_x,H  Time,X,px  t,x,p  T/s,x/m,P_X
    hamilton.orbit.q | t,x,p_x,H  t,x
    hamilton.orbit.H | t,x,p_x,H
    'hamilton.orbit, columns: [p_x]' | t,x,p_x,H  t,x,p
    """,
    read=str,
)
def test_orbits(ask: str, heads: str) -> None:
    t = np.linspace(0, 7, 123)
    x, p = 0.4 * np.cos(3 * t), -2.4 * np.sin(3 * t)
    columns = dict(zip(heads.split(","), (t, x, p, p**2 / 4 + 9 * x**2), strict=False))
    item = asked(f"{{ask: {typed(ask)}}}", SPRING)
    assert given_rows(item, columns).verdict == "correct"
    wrong = {
        name: values if name in ("t", "T/s", "Time") else 1.1 * values for name, values in columns.items()
    }
    assert given_rows(item, wrong).share == 0


def free_top(t: Floats) -> tuple[Floats, list[Rotation]]:
    """omega along the body's axes and orientations of a free symmetric top, lambda = 2, 2, 3.

    L. D. Landau, E. M. Lifshitz, Mechanics, section 35: omega turns about e3 at (lambda3 - lambda1) omega3 /
    lambda1; the body turns about L at L/lambda1, and about e3 at minus the former.
    """
    omega = np.column_stack([0.6 * np.cos(t), 0.6 * np.sin(t), np.full_like(t, 2.0)])
    momentum = np.array([2 * 0.6, 0, 3 * 2.0]) / 2
    return omega, [Rotation.from_rotvec(momentum * at) * Rotation.from_rotvec([0, 0, -at]) for at in t]


@pytest.mark.parametrize("head", ["w{}", "omega{}", "omega_{}", "ω{}", "ω_{}", "W{}", "w{} (rad/s)"])
def test_a_free_top(head: str) -> None:
    item, t = asked("{ask: euler.trajectory}", TOP), np.linspace(0, 12, 211)
    omega = free_top(t)[0]

    def turning(factor: float, name: str = head) -> dict[str, Floats]:
        return {"t": t} | {name.format(k + 1): factor * omega[:, k] for k in range(3)}

    assert given_rows(item, turning(1)).verdict == "correct"
    assert codes(given_rows(item, turning(1 / (2 * math.pi)))) == ["frequency_vs_angular_frequency"]
    assert given_rows(item, turning(1 / (2 * math.pi), "w{} (rev/s)")).verdict == "correct"


def test_quaternions_have_no_sign() -> None:
    item, t = asked("{ask: euler.trajectory.orientation}", TOP), np.linspace(0, 12, 211)
    own = np.array([turn.as_quat(canonical=True) for turn in free_top(t)[1]])
    for signs in (1, -1, np.random.default_rng(3).choice([-1, 1], len(t))):
        columns = {"t": t} | {f"q{k}": own[:, k - 1] * signs for k in range(4)}
        assert given_rows(item, columns).verdict == "correct"
        assert given_rows(item, columns | {"q1": -columns["q1"]}).verdict != "correct"


PENDULUM = """
parameters: {g: 9.81}
system:
  coordinates: [theta1, theta2]
  particles:
    - {mass: 1, position: [sin(theta1), -cos(theta1)], potential: -g*cos(theta1)}
    - mass: 1
      position: [sin(theta1) + sin(theta2), -cos(theta1) - cos(theta2)]
      potential: -g*(cos(theta1) + cos(theta2))
orbit: {initial: {theta1: pi/2, theta2: pi/2, theta1dot: 0, theta2dot: 0}, duration: 25}
"""


def double_pendulum(duration: float, tolerance: float, g: float = 9.81) -> dict[str, Floats]:
    """By Lagrange's equations for the angles' momenta, with masses and lengths 1."""

    def slopes(_: float, y: Floats) -> list[float]:
        a, b, p, q = y
        sine, cosine = math.sin(a - b), math.cos(a - b)
        u, v = (p - q * cosine) / (1 + sine**2), (2 * q - p * cosine) / (1 + sine**2)
        return [u, v, -u * v * sine - 2 * g * math.sin(a), u * v * sine - g * math.sin(b)]

    t, start = np.linspace(0, duration, 500), [math.pi / 2, math.pi / 2, 0, 0]
    y = solve_ivp(slopes, (0, duration), start, t_eval=t, method="DOP853", rtol=tolerance, atol=tolerance).y
    return {"t": t} | dict(zip(("theta1", "theta2", "p_theta1", "p_theta2"), y, strict=True))


def test_chaotic_motion_is_judged_where_it_can_be_predicted() -> None:
    item = asked("{ask: hamilton.orbit}", PENDULUM.replace("25}", "6}"))
    for tolerance in (1e-6, 1e-10):
        right = double_pendulum(6, tolerance)
        assert given_rows(item, right).verdict == "correct"
        wound = right["theta2"] % (2 * math.pi)
        assert given_rows(item, right | {"theta2": wound}).verdict == "correct"
    assert given_rows(item, double_pendulum(6, 1e-9, g=9.6)).verdict == "partial"
    with pytest.raises(DocumentError, match="only a part of this motion"):
        asked("{ask: hamilton.orbit}", PENDULUM)


# --- what is none


@cases(
    """
    options | answer
    {} | orbit.csv  {csv: "t,x\\n0,1"}  {t: [0, 1], columns: {x: t}}  {t: [1, 0, 0.1], columns: {x: t}}
    {t: [0, 1, 0], columns: {x: t}}  {t: [0, 1, 1e-9], columns: {x: t}}
    {t: [0, 1, 0.1], columns: {x: 17.25*z}}
    {t: [0, 1, 0.1], columns: {x: 1/(t-t)}}  {t: [0, 1, 0.1], columns: {}}  {t: [0, 1, 0.1], columns: {t: t}}
    {columns: [y]} | {t: [0, 1, 0.1], columns: {x: t}}
    {columns: [x, x]} | {t: [0, 1, 0.1], columns: {x: t}}
    {angles: [y]} | {t: [0, 1, 0.1], columns: {x: t}}
    {angles: [x], tolerance: {absolute: 3}} | {t: [0, 9, 0.1], columns: {x: t}}
    """,
    read=typed,
)
def test_keys_that_cannot_be_judged_by(options: str, answer: Any) -> None:
    with pytest.raises(DocumentError) as refused:
        asked(json.dumps({"kind": "trajectory", "answer": answer, **typed(options)}))
    assert "17.25" not in str(refused.value)


@cases(
    """
    code | text
    wrong_shape | t,x,p  # t,x,p  t,x,p/0,1/  t,x,p/0,1,2,3/
    missing_column | 0,1,2/1,2,3/  x,p/1,2/
    duplicate_key | t,x,x,p/0,1,2,3/
    not_a_number | t,x,p/0,1,/  t,x,p/0,1,many/  t,x,p/0,1,1_000/  t,x,p/0,1,nan/
    t,x,p/0,1,__import__('os').system('true')/  t,x,p/0,1,1e999/
    unit_incompatible | t,x,p/0,1,5 cm/  t,x,p/0,1,0x10/  t,x,p/0,1,1e/
    """,
    read=str,
)
def test_tables_that_cannot_be_read(spring: Item, code: str, text: str) -> None:
    outcome = judged(spring, {"csv": text.replace("/", "\n")})
    assert (outcome.verdict, codes(outcome)[0]) == ("invalid", code)


def test_what_is_no_table(spring: Item) -> None:
    for answer in ("orbit.csv", ["orbit.csv"], {"path": "a.csv"}, {"csv": ["t,x"]}, {"csv": None}, "t,x,p"):
        assert judged(spring, answer).verdict == "invalid"
    detail = judged(spring, {"csv": "t,x,p\n0,0,1,5,0,2\n"}).findings[0].detail
    assert "separate cells with `;`" in detail


ATTACKS = ("frozen", "replay", "warp", "late", "one", "size", "slope", "still", "noise")


@settings(max_examples=40)
@given(st.integers(0, 10**9), st.sampled_from(ATTACKS))
def test_wrong_answers_are_never_right(seed: int, attack: str) -> None:
    chance = np.random.default_rng(seed)
    item = formulas(10, {"x": "1.5*cos(2*t + 0.3)", "p": "-3*sin(2*t + 0.3)"})
    t = np.linspace(0, 10, int(chance.integers(61, 300)))
    right, off = oscillator(t), chance.choice([-1, 1]) * chance.uniform(0.03, 0.5)
    cut = chance.uniform(0.5, 8.5)
    match attack:
        case "warp":
            other = oscillator(t + 0.5 * np.sin(np.pi * t / 10))
        case "late":
            other = oscillator(t - 0.2)
        case "one":
            other = right | {"x": right["x"] + off * (np.arange(len(t)) == chance.integers(len(t)))}
        case "size":
            other = right | {"x": right["x"] * (1 + off)}
        case "slope":
            other = right | {"x": right["x"] + off * t / 10}
        case "still":
            other = right | {"x": np.full_like(t, right["x"][0])}
        case "noise":
            other = right | {"x": right["x"] + off * chance.normal(1, 0.5, len(t))}
        case _:
            order = np.arange(len(t))
            last = int((t <= cut).sum()) - 1
            after = np.full(len(t), last) if attack == "frozen" else order % (last + 1)
            order = np.where(order <= last, order, after)
            other = {name: values[order] for name, values in right.items()}
    columns = other | {"t": t}
    truth = oscillator(t)
    assume(
        any(
            (np.abs(columns[name] - truth[name]) > 0.0105 * size).any()
            for name, size in (("x", 1.5), ("p", 3))
        )
    )
    outcome = given_rows(item, columns)
    assert outcome.verdict in ("incorrect", "partial")
    assert outcome.findings


@settings(max_examples=40)
@given(
    st.lists(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 3), min_size=1, max_size=40),
    st.booleans(),
)
def test_tables_of_any_numbers_have_an_outcome(rows: list[tuple[float, ...]], in_order: bool) -> None:
    item = formulas(10, {"x": "1.5*cos(2*t + 0.3)", "p": "-3*sin(2*t + 0.3)"})
    lines = [",".join(map(repr, row)) for row in (sorted(rows) if in_order else rows)]
    assert judged(item, {"csv": "\n".join(["t,x,p", *lines])}).verdict == "incorrect"
