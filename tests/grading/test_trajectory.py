"""Trajectories: closed forms and other people's integrators are right, what differs from them is not."""

from __future__ import annotations

import math
import os
import socket
import string
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from rigidcli.document.load import loads
from rigidcli.document.syntax import read_tree
from rigidcli.errors import ValueProblem
from rigidcli.grading.asked import Asked
from rigidcli.grading.feedback import sentence
from rigidcli.grading.kinds import KINDS
from rigidcli.grading.outcome import Outcome, Unreadable
from rigidcli.grading.question import Question
from rigidcli.grading.trajectories.key import Key
from rigidcli.grading.trajectories.tables import MOST_CHARACTERS, read_columns
from rigidcli.studies import euler, hamilton
from tests.conftest import ROOT
from tests.grading.asking import answers, cases, codes, judged_alone, require_examples

Floats = NDArray[np.float64]
Columns = Mapping[str, Floats]

few = settings(max_examples=15, deadline=None)
many = settings(max_examples=30, deadline=None)

HERE = Path()

KIND = KINDS["trajectory"]


def answered(key: Key, answer: object, folder: Path) -> Outcome:
    return judged_alone("trajectory", key, answer, folder)


def literal(answer: object, **options: Any) -> Key:
    question = Question.model_validate({"answer": answer, "kind": "trajectory", **options})
    key: Key = KIND.read_key(Asked(question, question.answer))
    return key


def formulas(stop: float, texts: Mapping[str, str], **options: Any) -> Key:
    return literal({"t": ["0", repr(stop), "0.1"], "columns": dict(texts)}, **options)


def computed(text: str, ask: str, samples: int = 4001, **options: Any) -> Key:
    """The key of a document, of which two runs are made as for an assignment."""
    question = Question.model_validate({"document": "x.yaml", "ask": ask, **options})
    study, section = {"hamilton": (hamilton, "orbit"), "euler": (euler, "motion")}[ask.split(".")[0]]
    runs = [
        study.run(loads(text, settings=[f"{section}.samples={samples}", f"{section}.tolerance={tolerance}"]))
        for tolerance in ("1e-12", "1e-10")
    ]
    asked = Asked(question, None, "", tuple(ask.split(".")), loads(text), runs[0], runs[1])
    key: Key = KIND.read_key(asked)
    return key


def table(columns: Columns, separator: str = ",", form: Callable[[float], str] = repr) -> dict[str, str]:
    """An answer with these columns, the time among them."""
    rows = np.column_stack(list(columns.values())).tolist()
    lines = [separator.join(columns), *(separator.join(map(form, row)) for row in rows)]
    return {"csv": "\n".join(lines)}


def judged(key: Key, columns: Columns) -> Outcome:
    return answered(key, table(columns), HERE)


def refused(key: Key, answer: object, folder: Path = HERE) -> str:
    with pytest.raises(Unreadable) as refusal:
        answered(key, answer, folder)
    assert refusal.value.outcome.verdict == "invalid"
    return refusal.value.finding.code


T = np.linspace(0, 10, 301)

OSCILLATOR = formulas(10, {"x": "1.5*cos(2*t + 0.3)", "p": "-3*sin(2*t + 0.3)"})


def oscillator(t: Floats = T, rate: float = 2.0, size: float = 1.5, phase: float = 0.3) -> dict[str, Floats]:
    return {"t": t, "x": size * np.cos(rate * t + phase), "p": -rate * size * np.sin(rate * t + phase)}


DAMPED = formulas(10, {"x": "exp(-t/5)*cos(3*t)", "v": "-exp(-t/5)*(cos(3*t)/5 + 3*sin(3*t))"})


def damped(t: Floats = T, rate: float = 3.0) -> dict[str, Floats]:
    fall, wave, turn = np.exp(-t / 5), np.cos(rate * t), np.sin(rate * t)
    return {"t": t, "x": fall * wave, "v": -fall * (wave / 5 + rate * turn)}


# --- right in any form


def test_extra_rows_before_and_after_are_not_looked_at() -> None:
    t = np.linspace(-1, 12, 600)
    assert judged(OSCILLATOR, oscillator(t)).verdict == "correct"
    far = np.concatenate([[-90.0], T[T < 9.2], [90.0]])
    assert codes(judged(OSCILLATOR, oscillator(far))) == ["time_range_short"]


@pytest.mark.parametrize(
    "form",
    [repr, "{:.5f}".format, "{:+.6e}".format, "{:.4E}".format, lambda x: f'"{x!r}"', lambda x: f" {x!r}\t"],
)
def test_numbers_in_any_form(form: Callable[[float], str]) -> None:
    assert answered(OSCILLATOR, table(oscillator(), ",", form), HERE).verdict == "correct"


def test_the_text_may_have_any_line_ends_blanks_comments_and_minus_signs() -> None:
    text = table(oscillator())["csv"]
    head, body = text.split("\n", 1)
    others = [
        text.replace("\n", "\r\n") + "\r\n",
        text.replace("\n", "\r"),
        "\ufeff" + text,
        "# by me\n#\n\n" + text + "\n\n\n",
        text.replace("-", "\N{MINUS SIGN}"),
        "# " + head + "\n" + body,
        head.replace(",", " , ").upper() + "\n" + body,
        ('"' + head.replace(",", '","') + '"') + "\n" + body,
    ]
    for other in others:
        assert answered(OSCILLATOR, {"csv": other}, HERE).verdict == "correct", other[:60]


def test_a_file_of_numpy_is_read(tmp_path: Path) -> None:
    columns = oscillator()
    values = np.column_stack(list(columns.values()))
    np.savetxt(tmp_path / "blanks.csv", values, header=" ".join(columns))
    np.savetxt(tmp_path / "commas.csv", values, delimiter=",", header=",".join(columns), comments="")
    for name in ("blanks.csv", "commas.csv"):
        assert answered(OSCILLATOR, {"file": name}, tmp_path).verdict == "correct"


def test_a_key_may_be_a_table() -> None:
    t = np.linspace(0, 10, 201)
    key = literal(table(oscillator(t)))
    assert judged(key, oscillator(np.linspace(0, 10, 333))).verdict == "correct"
    assert judged(key, oscillator(np.linspace(0, 10, 333), phase=0.31)).verdict == "incorrect"


@pytest.mark.parametrize(
    "heads", [("Time", "x", "p"), ("TIME", "X", "P"), ("Time (s)", "x (m)", "p (kg m/s)")]
)
def test_a_key_and_an_answer_may_spell_their_heads_differently(heads: tuple[str, str, str]) -> None:
    spelled = dict(zip(heads, oscillator().values(), strict=True))
    assert judged(OSCILLATOR, spelled).verdict == "correct"
    assert judged(literal(table(spelled)), oscillator()).verdict == "correct"


def fast(t: Floats, off: float = 0.0) -> dict[str, Floats]:
    """A motion of which 41 rows do not tell what is between them."""
    return {"t": t, "x": np.cos(4 * t) + off * t, "phi": 3 * t % (2 * math.pi)}


def test_a_key_of_few_rows_is_compared_at_its_own_times() -> None:
    t = np.linspace(0, 20, 41)
    key = literal(table(fast(t), ",", "{:.8g}".format), angles=["phi"])
    assert key.times is not None
    assert judged(key, fast(t)).verdict == "correct"
    dense = np.linspace(0, 20, 2001)
    for own in (dense, np.linspace(0, 20, 1777), np.union1d(t, dense + 0.003)[:-1], np.round(dense, 5)):
        assert judged(key, fast(own)).verdict == "correct"
        assert judged(key, fast(own, 1e-3)).verdict == "partial"
    for wrong, code in (
        (fast(t) | {"x": -fast(t)["x"]}, "sign_error"),
        (fast(1000 * t) | fast(t) | {"t": 1000 * t}, "time_unit"),
        (fast(dense) | {"x": 2 * fast(dense)["x"]}, "constant_factor"),
        (fast(t[:-4]), "time_range_short"),
        (fast(t) | {"x": np.where(np.arange(41) == 20, 0, fast(t)["x"])}, "outside_tolerance"),
    ):
        assert codes(judged(key, wrong)) == [code]
    # Rows that are neither at its times, nor near enough to each other to tell.
    other = judged(key, fast(np.linspace(0, 20, 38)))
    assert (other.verdict, codes(other), other.share) == ("review", ["undecided"], 0)
    assert judged(key, fast(np.linspace(0, 20, 38)) | {"x": np.zeros(38)}).share == 0.5
    # Every second of its rows is dense enough.
    assert judged(key, fast(t[::2])).verdict == "correct"
    assert judged(key, fast(t[::2], 1e-3)).verdict == "partial"


def test_a_table_with_corners_is_interpolated_by_lines() -> None:
    t = np.linspace(0, 10, 501)
    key = literal(table({"t": t, "x": np.abs(t - 5.0)}))
    other = np.linspace(0, 10, 237)
    assert judged(key, {"t": other, "x": np.abs(other - 5)}).verdict == "correct"


@few
@given(st.integers(-3, 3), st.integers(0, 10**6))
def test_angles_are_equal_modulo_their_period(turns: int, seed: int) -> None:
    key = formulas(20, {"phi": "1.3*t + 0.2*sin(t)", "r": "1 + 0.3*cos(t)"}, angles=["phi"])
    t = np.linspace(0, 20, 200)
    phi, r = 1.3 * t + 0.2 * np.sin(t), 1 + 0.3 * np.cos(t)
    jumps = np.random.default_rng(seed).integers(-2, 3, len(t))
    for shown in (phi + 2 * math.pi * turns, phi % (2 * math.pi), phi + 2 * math.pi * jumps):
        assert judged(key, {"t": t, "phi": shown, "r": r}).verdict == "correct"
        assert judged(key, {"t": t, "phi": shown + 0.01, "r": r}).verdict == "partial"
        assert judged(key, {"t": t, "phi": phi, "r": r + 2 * math.pi}).verdict == "partial"
    for huge in (1e15, 1e17, 1e300):  # whose digits do not tell what is left of it modulo 2 pi
        assert judged(key, {"t": t, "phi": np.full(200, huge), "r": r}).share == 0.5


def test_the_period_may_be_in_degrees() -> None:
    key = formulas(20, {"phi": "40*t"}, angles=["phi"], modulo="360")
    t = np.linspace(0, 20, 200)
    assert judged(key, {"t": t, "phi": (40 * t + 180) % 360 - 180}).verdict == "correct"
    assert judged(key, {"t": t, "phi": np.radians(40 * t)}).verdict == "incorrect"


# --- names of columns


@cases("""
    heads
    time, x, px  t (s), x (m), p (kg m/s)  T, X, P_X  t/s, x/m, p_x/(kg m/s)  t [s], x [m], px [N s]
    Time, x, p_x  TIME, X, P X  Time (s), x (m), p_x  tIME [s], X , p_X (kg m/s)  Time/s, x(t), px(t)
    """)
def test_names_may_be_spelled_in_the_usual_ways(heads: str) -> None:
    key = computed(SPRING, "hamilton.orbit")
    values = spring(np.linspace(0, 7, 123)).values()
    for separator in (";", "\t"):
        answer = table(dict(zip(heads.split(","), values, strict=True)), separator)
        assert answered(key, answer, HERE).verdict == "correct"


def test_units_may_stand_in_heads_that_are_parted_by_blanks() -> None:
    key = computed(SPRING, "hamilton.orbit")
    heads = ("t (s)", "x [m]", "p (kg m/s)")
    answer = table(dict(zip(heads, spring(np.linspace(0, 7, 123)).values(), strict=True)), " ")
    assert answered(key, answer, HERE).verdict == "correct"


def test_units_in_heads_are_converted() -> None:
    key = computed(SPRING, "hamilton.orbit")
    t, x, p = spring(np.linspace(0, 7, 123)).values()
    assert judged(key, {"t (ms)": 1000 * t, "x (cm)": 100 * x, "p_x": p}).verdict == "correct"
    assert judged(key, {"t (ms)": t, "x": x, "p_x": p}).verdict == "incorrect"
    assert judged(key, {"t": t, "x (cm)": x, "p_x": p}).verdict == "partial"
    assert judged(key, {"t": t, "x (parsecs of mine)": x, "p_x": p}).verdict == "correct"


def test_spellings_that_could_mean_two_columns_mean_none() -> None:
    key = formulas(10, {"x": "cos(t)", "p_x": "sin(t)", "p_y": "cos(2*t)", "y": "sin(3*t)"})
    right = {"t": T, "x": np.cos(T), "y": np.sin(3 * T)}
    assert judged(key, right | {"px": np.sin(T), "py": np.cos(2 * T)}).verdict == "correct"
    assert codes(judged(key, right | {"p": np.sin(T), "py": np.cos(2 * T)})) == ["missing_column"]
    two = right | {"px": np.sin(T), "P_X": np.sin(T), "py": np.cos(2 * T)}
    assert judged(key, two).verdict == "correct"  # `px` is nearer than `P_X`
    two = right | {"PX": np.sin(T), "P_X": np.sin(T), "py": np.cos(2 * T)}
    assert codes(judged(key, two)) == ["missing_column"]


@pytest.mark.parametrize("head", ["w_{}", "omega{}", "omega_{}", "ω{}", "ω_{}", "W{}", "w{} (rad/s)"])
def test_angular_velocities_have_many_names(head: str) -> None:
    key = computed(TOP, "euler.trajectory")
    for time_ in ("time", "T", "t"):
        columns = turning(TOP_TIMES, head=head)
        assert judged(key, {time_: columns.pop("t")} | columns).verdict == "correct"


# --- named mistakes


def times_of(columns: Columns, change: Callable[[Floats], Floats]) -> dict[str, Floats]:
    return {**columns, "t": change(columns["t"])}


def scaled(columns: Columns, **factors: float) -> dict[str, Floats]:
    return {name: values * factors.get(name, 1.0) for name, values in columns.items()}


MISTAKES: list[tuple[str, dict[str, Floats]]] = [
    ("time_unit", times_of(damped(), lambda t: 1000 * t)),
    ("time_unit", times_of(damped(), lambda t: t / 60)),
    ("time_shift", times_of(damped(), lambda t: t + 3)),
    ("time_shift", times_of(damped(), lambda t: t + 1e6)),
    ("time_shift", damped(T + 0.7) | {"t": T}),
    ("time_shift", damped(T - 0.4) | {"t": T}),
    ("time_reversed", damped(10 - T) | {"t": T}),
    ("time_reversed", scaled(damped(10 - T), v=-1) | {"t": T}),
    ("frequency_wrong", damped(1.1 * T) | {"t": T}),
    ("frequency_wrong", scaled(damped(0.5 * T), v=0.5) | {"t": T}),
    ("sign_error", scaled(damped(), v=-1)),
    ("sign_error", scaled(damped(), x=-1, v=-1)),
    ("constant_factor", scaled(damped(), v=2)),
    ("constant_factor", scaled(damped(), x=0.5, v=1.5)),
    ("power_of_ten", scaled(damped(), x=100, v=100)),
    ("degrees_radians", scaled(damped(), x=180 / math.pi)),
    ("components_permuted", {"t": T, "x": damped()["v"], "v": damped()["x"]}),
    ("precision_insufficient", {"t": T, "x": np.round(damped()["x"], 2), "v": damped()["v"]}),
    ("wrong_order", {name: values[::-1] for name, values in damped().items()}),
    ("wrong_order", damped(np.append(T[:-1], T[-2:]))),
    ("time_range_short", damped(np.linspace(0, 9.5, 300))),
    ("time_range_short", damped(np.linspace(0, 10, 9))),
    ("time_range_short", damped(np.append(np.linspace(0, 7, 300), 10.0))),
    ("missing_column", {"t": T, "x": damped()["x"]}),
    ("frequency_wrong", damped(2 * T) | {"t": T}),
    ("frequency_wrong", scaled(damped(T / 3), v=1 / 3) | {"t": T}),
    ("frequency_vs_angular_frequency", damped(2 * math.pi * T) | {"t": T}),
    ("frequency_vs_angular_frequency", scaled(damped(T / (2 * math.pi)), v=1 / (2 * math.pi)) | {"t": T}),
    ("degrees_radians", damped(T * math.pi / 180) | {"t": T}),
    ("wrong_initial_condition", scaled(damped(), x=1.07, v=1.07)),
    ("outside_tolerance", {**damped(), "x": damped()["x"] + 0.01 * T}),
]


@pytest.mark.parametrize(("code", "columns"), MISTAKES)
def test_mistakes_are_named(code: str, columns: dict[str, Floats]) -> None:
    outcome = judged(DAMPED, columns)
    assert codes(outcome)[0] == code
    assert outcome.verdict in ("incorrect", "partial")
    assert outcome.share in (0, 0.5)


@pytest.mark.parametrize("rows", [None, 201])
@pytest.mark.parametrize("tolerance", [1e-2, 3e-3, 1e-3])
def test_a_coarse_integration_lacks_precision(tolerance: float, rows: int | None) -> None:
    key = formulas(10, {"x": "cos(2*t)", "p": "-2*sin(2*t)"})
    t = None if rows is None else np.linspace(0, 10, rows)
    solved = solve_ivp(lambda _, y: [y[1], -4 * y[0]], (0, 10), [1, 0], rtol=tolerance, t_eval=t)
    outcome = judged(key, {"t": solved.t, "x": solved.y[0], "p": solved.y[1]})
    assert (codes(outcome), outcome.share) == (["precision_insufficient"], 0)
    assert "finer tolerance" in outcome.findings[0].detail


def test_friction_is_no_lack_of_precision() -> None:
    key = formulas(10, {"x": "cos(2*t)", "p": "-2*sin(2*t)"})
    fall = np.exp(-T / 20)
    outcome = judged(key, {"t": T, "x": fall * np.cos(2 * T), "p": -2 * fall * np.sin(2 * T)})
    assert codes(outcome) == ["outside_tolerance"]


def test_columns_that_are_right_earn_their_share() -> None:
    outcome = judged(DAMPED, scaled(damped(), v=1.07))
    assert (outcome.verdict, outcome.share) == ("partial", 0.5)
    assert outcome.findings[0].place == "`v`"
    assert judged(DAMPED, {"t": T, "x": damped()["x"]}).share == 0.5


def test_a_column_that_does_not_move_earns_nothing_by_itself() -> None:
    key = formulas(10, {"x": "t^2", "p": "3"})
    assert judged(key, {"t": T, "x": T, "p": np.full_like(T, 3)}).share == 0
    assert judged(key, {"t": T, "x": T**2, "p": T}).share == 0.5


def test_a_mistake_that_is_one_of_two_is_not_named() -> None:
    # Half a period later, an oscillation has the other sign.
    key = formulas(20, {"x": "cos(2*t)"})
    t = np.linspace(0, 20, 200)
    assert codes(judged(key, {"t": t, "x": -np.cos(2 * t)})) == ["wrong_initial_condition"]


def test_rows_that_only_show_the_returns_of_a_motion_are_too_few() -> None:
    key = formulas(40, {"x": "cos(pi*t)"})
    t = np.arange(0, 41, 2.0)
    assert codes(judged(key, {"t": t, "x": np.ones_like(t)})) == ["time_range_short"]


@few
@given(st.floats(-0.4, 0.4), st.floats(0.45, 2.0))
def test_shifts_and_frequencies_are_found(shift: float, ratio: float) -> None:
    assume(abs(shift) > 0.01 and abs(ratio - 1) > 0.01)
    assert codes(judged(DAMPED, damped(T + 10 * shift) | {"t": T})) == ["time_shift"]
    assert codes(judged(DAMPED, damped(ratio * T) | {"t": T})) == ["frequency_wrong"]


@few
@given(st.permutations(range(12)))
def test_columns_exchanged_in_any_way(order: list[int]) -> None:
    names = [f"x{k}" for k in range(12)]
    key = formulas(10, {name: f"exp(-t/{k + 2})*sin({k + 1}*t)" for k, name in enumerate(names)})
    right = [np.exp(-T / (k + 2)) * np.sin((k + 1) * T) for k in range(12)]
    outcome = judged(key, {"t": T} | {name: right[k] for name, k in zip(names, order, strict=True)})
    moved = sum(place != k for place, k in enumerate(order))
    if moved:
        assert codes(outcome) == ["components_permuted"]
        assert outcome.share == pytest.approx((12 - moved) / 12)
    else:
        assert outcome.verdict == "correct"


def test_messages_below_full_do_not_tell_the_reference() -> None:
    key = formulas(10, {"x": "0.7654321*cos(2.3456789*t) + 0.2*sin(5*t)", "y": "0.87654321 + 0.345678*t"})
    wrong = [{"t": T, "x": np.sin(k * T), "y": k + T} for k in range(4)]
    wrong += [{"t": T, "x": np.zeros_like(T)}, {"t": T / 2, "x": T, "y": T}]
    for columns in wrong:
        for finding in judged(key, columns).findings:
            assert "at t =" not in sentence(finding)  # which would tell how much of an answer is right
            for digits in ("765", "345", "876", "966", "2.3"):
                assert digits not in sentence(finding)
            assert finding.reference not in sentence(finding) or not finding.reference
    told = sentence(judged(key, wrong[0]).findings[0], full=True)
    assert "0.765432" in told


# --- what is conserved


def test_conserved_quantities_of_the_question() -> None:
    key = formulas(
        10,
        {"x": "cos(2*t)", "p": "-2*sin(2*t)"},
        columns=["x"],
        conserved={"E": "p^2/2 + 2*x^2"},
        tolerance={"relative": 1e-3, "conserved": 1e-4},
    )
    x, p = np.cos(2 * T), -2 * np.sin(2 * T)
    assert judged(key, {"t": T, "x": x, "p": p}).verdict == "correct"
    outcome = judged(key, {"t": T, "x": x, "p": p * (1 + 0.001 * T)})
    assert (codes(outcome), outcome.share) == (["conserved_quantity_drift"], 0.5)
    assert codes(judged(key, {"t": T, "x": x})) == ["missing_column"]


def test_the_hamiltonian_is_known_by_its_name() -> None:
    text = PENDULUM.replace("DURATION", "5")  # of which H is zero
    key = computed(text, "hamilton.orbit", columns=["theta1", "theta2"], conserved={"energy": "H"})
    columns = double_pendulum(5, 1e-9)
    assert judged(key, columns).verdict == "correct"
    assert codes(judged(key, scaled(columns, p_theta1=1.2))) == ["conserved_quantity_drift"]
    without = {name: values for name, values in columns.items() if name != "p_theta2"}
    assert codes(judged(key, without)) == ["missing_column"]


def test_answers_that_are_just_right_keep_what_is_conserved_by_default() -> None:
    key = formulas(10, {"x": "cos(2*t)", "p": "-2*sin(2*t)"}, conserved={"E": "p^2/2 + 2*x^2"})
    chance = np.random.default_rng(5)
    for _ in range(20):
        off = 0.99e-3 * chance.choice([-1, 1], (2, len(T)))
        columns = {"t": T, "x": np.cos(2 * T) + off[0], "p": -2 * np.sin(2 * T) + 2 * off[1]}
        assert judged(key, columns).verdict == "correct"


PENDULUM = """
parameters: {g: 9.81}
system:
  coordinates: [theta1, theta2]
  particles:
    - {mass: 1, position: [sin(theta1), -cos(theta1)], potential: -g*cos(theta1)}
    - mass: 1
      position: [sin(theta1) + sin(theta2), -cos(theta1) - cos(theta2)]
      potential: -g*(cos(theta1) + cos(theta2))
orbit: {initial: {theta1: pi/2, theta2: pi/2, theta1dot: 0, theta2dot: 0}, duration: DURATION}
"""


def double_pendulum(duration: float, tolerance: float, rows: int = 500, g: float = 9.81) -> dict[str, Floats]:
    """By Lagrange's equations for the angles' momenta, with masses and lengths 1."""

    def slopes(_: float, y: Floats) -> list[float]:
        a, b, p, q = y
        sine, cosine = math.sin(a - b), math.cos(a - b)
        u, v = (p - q * cosine) / (1 + sine**2), (2 * q - p * cosine) / (1 + sine**2)
        return [u, v, -u * v * sine - 2 * g * math.sin(a), u * v * sine - g * math.sin(b)]

    t = np.linspace(0, duration, rows)
    start = [math.pi / 2, math.pi / 2, 0, 0]
    solved = solve_ivp(
        slopes, (0, duration), start, t_eval=t, method="DOP853", rtol=tolerance, atol=tolerance
    )
    names = ("theta1", "theta2", "p_theta1", "p_theta2")
    return {"t": t} | dict(zip(names, solved.y, strict=True))


@pytest.fixture(scope="module")
def chaotic() -> Key:
    return computed(PENDULUM.replace("DURATION", "25"), "hamilton.orbit")


def test_a_double_pendulum_by_another_integrator_is_right() -> None:
    key = computed(PENDULUM.replace("DURATION", "10"), "hamilton.orbit")
    assert key.horizon == 10
    assert judged(key, double_pendulum(10, 1e-8)).verdict == "correct"
    assert judged(key, double_pendulum(10, 1e-8)).findings == ()
    assert judged(key, double_pendulum(10, 1e-8, g=9.8)).verdict == "incorrect"


@pytest.mark.parametrize("tolerance", [1e-7, 1e-8, 1e-9, 1e-11, 1e-13])
def test_chaotic_motion_is_judged_to_its_horizon(chaotic: Key, tolerance: float) -> None:
    assert 10 < chaotic.horizon < 20
    outcome = judged(chaotic, double_pendulum(25, tolerance))
    assert outcome.verdict == "correct"
    assert set(codes(outcome)) <= {"chaotic_divergence_after_horizon"}
    assert outcome.findings or tolerance < 1e-10


def test_chaotic_motion_keeps_its_energy_after_the_horizon(chaotic: Key) -> None:
    columns = double_pendulum(25, 1e-9)
    late = columns["t"] > chaotic.horizon
    for name in ("p_theta1", "p_theta2"):
        columns[name] = np.where(late, 1.1 * columns[name], columns[name])
    outcome = judged(chaotic, columns)
    assert codes(outcome) == ["conserved_quantity_drift"]
    assert 0.5 < outcome.share < 1


def test_chaotic_motion_must_be_right_before_the_horizon(chaotic: Key) -> None:
    columns = double_pendulum(25, 1e-9)
    early = (columns["t"] > 5) & (columns["t"] < 5.2)
    columns["theta1"] = np.where(early, columns["theta1"] + 0.05, columns["theta1"])
    outcome = judged(chaotic, columns)
    assert codes(outcome) == ["outside_tolerance"]
    assert outcome.findings[0].place == "`theta1`"
    assert judged(chaotic, double_pendulum(25, 1e-9, g=9.8)).verdict == "incorrect"


@pytest.fixture(scope="module")
def forty() -> Key:
    return computed(PENDULUM.replace("DURATION", "40"), "hamilton.orbit", samples=8001)


def gone_on(right: Columns, cut: float, how: str) -> dict[str, Floats]:
    """A motion that is right until `cut`, and then anything of the same energy, or nothing."""
    t = right["t"]
    last, rows = int((t <= cut).sum()) - 1, np.arange(len(t))
    since = rows[last + 1 :] - last
    after = {
        "frozen": np.full(len(since), last),
        "replay": since % (last + 1),
        "back": np.abs((since - 1) % (2 * last) - last),
        "chance": np.random.default_rng(7).integers(0, last, len(since)),
        "four": np.full(4, last),
    }[how]
    if how == "four":
        t = np.append(t[: last + 1], np.linspace(cut, t[-1], 5)[1:])
    order = np.append(rows[: last + 1], after)
    return {name: t if name == "t" else values[order] for name, values in right.items()}


@pytest.mark.parametrize("how", ["frozen", "replay", "back", "chance", "four"])
def test_chaotic_motion_earns_and_costs_nothing_after_its_horizon(forty: Key, how: str) -> None:
    right = double_pendulum(40, 1e-10, 1201)
    assert 10 < forty.horizon < 25
    early = judged(forty, gone_on(right, 5, how))
    assert early.share == 0 or early.verdict == "partial"
    late = judged(forty, gone_on(right, forty.horizon + 0.1, how))
    if how == "four":
        assert codes(early) == codes(late) == ["time_range_short"]
        return
    assert codes(early) != []
    assert (late.verdict, codes(late)) == ("correct", ["chaotic_divergence_after_horizon"])
    assert late.findings[0].detail == f"what comes after t = {forty.horizon:.4g} is not judged"


@pytest.mark.parametrize(("rows", "code"), [(11, None), (21, None), (10, "time_range_short")])
def test_rows_are_at_most_a_tenth_of_the_span_apart(rows: int, code: str | None) -> None:
    t = np.linspace(0, 10, rows)
    fall = judged(formulas(10, {"y": "3*t - t^2"}), {"t": t, "y": 3 * t - t**2})
    assert codes(fall) == ([] if code is None else [code])
    gap = np.append(np.linspace(0, 5, 100), np.linspace(6.1, 10, 100))
    assert codes(judged(DAMPED, damped(gap))) == ["time_range_short"]


@pytest.mark.parametrize("method", ["RK45", "DOP853", "Radau"])
def test_chaotic_motion_driven_from_outside_is_right_by_any_integrator(driven: Key, method: Any) -> None:
    solved = solve_ivp(
        lambda t, y: [y[1], -(1 + 0.9 * math.cos(1.7 * t)) * math.sin(y[0])],
        (0, 80),
        [1.5, 0.2],
        method=method,
        dense_output=True,
        rtol=1e-8,
        atol=1e-10,
    )
    assert solved.sol is not None
    for rows in (100, 300, 1000, 3000):
        t = np.linspace(0, 80, rows)
        phi, p = solved.sol(t)
        for shown in (phi, (phi + math.pi) % (2 * math.pi) - math.pi):
            answer = table({"t": t, "phi": shown, "p": p}, ",", "{:.7g}".format)
            assert answered(driven, answer, HERE).verdict == "correct"


@pytest.fixture(scope="module")
def driven() -> Key:
    text = """
    system: {coordinates: [phi], lagrangian: phidot^2/2 + (1 + 0.9*cos(1.7*t))*cos(phi)}
    orbit: {initial: {phi: 1.5, p_phi: 0.2}, duration: 80}
    """
    key = computed(text, "hamilton.orbit", samples=20001)
    assert key.horizon < 70
    return key


def test_motion_that_parts_too_soon_is_no_question() -> None:
    with pytest.raises(ValueProblem, match="only a small part"):
        computed(PENDULUM.replace("DURATION", "1000"), "hamilton.orbit", samples=20001)


# --- keys of documents

SPRING = """
parameters: {m: 2, k: 18, a: 0.4}
system: {coordinates: [x], lagrangian: m*xdot^2/2 - k*x^2/2}
orbit: {initial: {x: a, p_x: 0}, duration: 7}
"""


def spring(t: Floats) -> dict[str, Floats]:
    return {"t": t, "x": 0.4 * np.cos(3 * t), "p_x": -2.4 * np.sin(3 * t)}


@pytest.mark.parametrize(
    ("ask", "columns"),
    [
        ("hamilton.orbit", ("x", "p_x")),
        ("hamilton.orbit.q", ("x",)),
        ("hamilton.orbit.p.x", ("p_x",)),
        ("hamilton.orbit.p.p_x", ("p_x",)),
        ("hamilton.orbit.H", ("H",)),
    ],
)
def test_what_is_asked_of_an_orbit(ask: str, columns: Sequence[str]) -> None:
    if ask == "hamilton.orbit.p.x":
        with pytest.raises(ValueProblem, match="expected columns"):
            computed(SPRING, ask)
        return
    key = computed(SPRING, ask)
    assert key.columns[: key.required] == columns
    t, x, p = spring(np.linspace(0, 7, 123)).values()
    answer = {"t": t, "x": x, "p_x": p, "H": p**2 / 4 + 9 * x**2}
    assert judged(key, answer).verdict == "correct"


def test_an_orbit_with_listed_columns_and_laws_in_parameters() -> None:
    laws = {"E": "p_x^2/(2*m) + k*x^2/2"}
    key = computed(SPRING, "hamilton.orbit", columns=["x"], conserved=laws, tolerance={"relative": 1e-4})
    right = spring(np.linspace(0, 7, 123))
    assert judged(key, right).verdict == "correct"
    assert codes(judged(key, scaled(right, x=1.0, p_x=0.5))) == ["conserved_quantity_drift"]
    with pytest.raises(ValueProblem, match="does not conserve"):
        computed(SPRING, "hamilton.orbit", conserved={"E": "p_x^2/(2*m) - k*x^2/2"})
    with pytest.raises(ValueProblem, match="unknown name `z`"):
        computed(SPRING, "hamilton.orbit", conserved={"E": "z"})
    with pytest.raises(ValueProblem, match="no column `y`"):
        computed(SPRING, "hamilton.orbit", columns=["y"])


TOP = """
body: {moments: [2, 2, 3]}
motion: {omega: [0.6, 0, 2], duration: 12}
"""

TOP_TIMES = np.linspace(0, 12, 211)


def free_top(t: Floats) -> tuple[Floats, list[Rotation]]:
    """omega along the body's axes and orientations of a free symmetric top, lambda = 2, 2, 3.

    L. D. Landau, E. M. Lifshitz, Mechanics, section 35: omega turns about e3 at (lambda3 - lambda1) omega3 /
    lambda1; the body turns about L at L/lambda1, and about e3 at minus the former.
    """
    rate = (3 - 2) * 2.0 / 2
    omega = np.column_stack([0.6 * np.cos(rate * t), 0.6 * np.sin(rate * t), np.full_like(t, 2.0)])
    momentum = np.array([2 * 0.6, 0, 3 * 2.0]) / 2
    turns = [Rotation.from_rotvec(momentum * at) * Rotation.from_rotvec([0, 0, -rate * at]) for at in t]
    return omega, turns


def turning(t: Floats, factor: float = 1.0, head: str = "w{}") -> dict[str, Floats]:
    """The angular velocities of the top."""
    omega = free_top(t)[0]
    return {"t": t} | {head.format(k + 1): factor * omega[:, k] for k in range(3)}


def spinning(t: Floats) -> dict[str, Floats]:
    """Its orientations."""
    quaternions = np.array([turn.as_quat(canonical=True) for turn in free_top(t)[1]])
    return {"t": t} | {f"q{k}": quaternions[:, k - 1] for k in range(4)}


def test_a_free_top_by_closed_form() -> None:
    key = computed(TOP, "euler.trajectory")
    assert key.columns[: key.required] == ("w1", "w2", "w3")
    assert judged(key, turning(TOP_TIMES)).verdict == "correct"
    assert judged(key, scaled(turning(TOP_TIMES), w2=-1)).verdict == "partial"


def test_what_is_handed_in_besides_must_be_right() -> None:
    key = computed(TOP, "euler.trajectory")
    t = TOP_TIMES
    omega = free_top(t)[0]
    moment, space = omega * [2, 2, 3], np.array([2 * 0.6, 0, 6.0])
    right = turning(t) | spinning(t)
    right |= {f"L{k + 1}": moment[:, k] for k in range(3)}
    right |= {f"L{axis}": np.full_like(t, space[k]) for k, axis in enumerate("xyz")}
    right |= {"T": (moment * omega).sum(axis=1) / 2, "by me": t**2}
    assert judged(key, right).verdict == "correct"
    conjugate = scaled(right, q1=-1, q2=-1, q3=-1)
    doubled = scaled(right, q0=2, q1=2, q2=2, q3=2)
    rolled = right | {f"q{k}": right[f"q{(k + 1) % 4}"] for k in range(4)}
    exchanged = right | {"L1": right["Lx"], "Lx": right["L1"]}
    for columns, wrong in ((conjugate, 3), (doubled, 4), (rolled, 4), (exchanged, 2)):
        outcome = judged(key, columns)
        assert outcome.verdict == "partial"
        assert 3 / 7 <= outcome.share <= 3 / (3 + wrong)
    assert codes(judged(key, doubled)) == ["constant_factor"]
    assert codes(judged(key, exchanged)) == ["components_permuted"]
    # What is not asked for earns nothing.
    assert judged(key, scaled(right, w1=1.1, w2=1.1, w3=1.1)).share == 0
    assert codes(judged(key, {name: right[name] for name in right if name != "w1"})) == ["missing_column"]
    only = computed(TOP, "euler.trajectory", columns=["w1", "w2", "w3"])
    assert judged(only, doubled).verdict == "correct"


def test_turns_in_a_second_are_not_radians() -> None:
    key = computed(TOP, "euler.trajectory")
    for factor in (2 * math.pi, 1 / (2 * math.pi)):
        outcome = judged(key, turning(TOP_TIMES, factor))
        assert (codes(outcome), outcome.share) == (["frequency_vs_angular_frequency"], 0)
    assert judged(key, turning(TOP_TIMES, 1 / (2 * math.pi), "w{} (rev/s)")).verdict == "correct"


def test_the_energy_that_is_handed_in_is_judged() -> None:
    key = computed(SPRING, "hamilton.orbit")
    right = spring(np.linspace(0, 7, 123))
    assert judged(key, right | {"H": np.full(123, 1.44)}).verdict == "correct"
    assert judged(key, right | {"H": np.full(123, 1.5)}).verdict == "partial"
    # Of an energy that is zero, an error is told by the sizes of its terms.
    key = computed(PENDULUM.replace("DURATION", "5"), "hamilton.orbit")
    columns = double_pendulum(5, 1e-9)
    assert judged(key, columns | {"H": np.full(500, 1e-7)}).verdict == "correct"
    assert judged(key, columns | {"H": np.full(500, 0.5)}).verdict == "partial"


def test_coordinates_that_only_turn_are_angles(chaotic: Key) -> None:
    key, right = chaotic, double_pendulum(25, 1e-10)
    assert np.ptp(right["theta2"]) > 2 * math.pi
    for turns in (np.rint(right["theta2"] / (2 * math.pi)), 3, np.arange(500) % 4):
        wound = right["theta2"] - 2 * math.pi * turns
        assert judged(key, right | {"theta2": wound}).verdict == "correct"
        assert judged(key, right | {"theta2": wound + 0.05}).verdict == "partial"
    assert judged(key, right | {"p_theta2": right["p_theta2"] + 2 * math.pi}).verdict == "partial"


@pytest.mark.parametrize("potential", ["0", "9.81*x", "cos(2*sqrt(2)*x)", "x^2/1000 - cos(x)", "1/(4 + x^2)"])
def test_coordinates_that_are_no_angles_are_not_judged_modulo_turns(potential: str) -> None:
    text = f"""
    system: {{coordinates: [x], lagrangian: xdot^2/2 - ({potential})}}
    orbit: {{initial: {{x: 1, p_x: 0.7}}, duration: 5}}
    """
    t = np.linspace(0, 5, 101)
    key = computed(text, "hamilton.orbit")
    x, p = key.at(t)[:, :2].T
    assert judged(key, {"t": t, "x": x, "p_x": p}).verdict == "correct"
    turned = {"t": t, "x": x + 2 * math.pi, "p_x": p}
    assert judged(key, turned).verdict != "correct"
    if potential == "0":  # so that it may be an angle, if the question says so
        assert judged(computed(text, "hamilton.orbit", angles=["x"]), turned).verdict == "correct"


def test_quaternions_have_no_sign() -> None:
    key = computed(TOP, "euler.trajectory.orientation")
    assert key.columns == ("q0", "q1", "q2", "q3")
    for signs in (1, -1, np.random.default_rng(3).choice([-1, 1], len(TOP_TIMES))):
        named = {name: values * signs for name, values in spinning(TOP_TIMES).items()} | {"t": TOP_TIMES}
        assert judged(key, named).verdict == "correct"
        assert judged(key, scaled(named, q1=-1)).verdict != "correct"
        # Scalar last, as other programs have it.
        rolled = {f"q{k}": named[f"q{(k + 1) % 4}"] for k in range(4)}
        assert judged(key, named | rolled).verdict != "correct"


def test_the_angles_of_a_top_are_angles() -> None:
    text = "top: {mass: 0.2, lambda1: 0.002, lambda3: 0.001, distance: 0.1, gravity: 9.81, tilt: 30 deg,"
    text += " spin: 150, precession: 3}\nmotion: {duration: 2}"
    key = computed(text, "euler.trajectory.angles", columns=["phi", "theta"])
    t = np.linspace(0, 2, 400)
    lambda1, lambda3, spin, fall = 0.002, 0.001, 150.0, 0.2 * 9.81 * 0.1

    def slopes(_: float, y: Floats) -> list[float]:
        theta, rate, _phi = y
        precession = (vertical - lambda3 * spin * math.cos(theta)) / (lambda1 * math.sin(theta) ** 2)
        gyro = lambda3 * spin - lambda1 * precession * math.cos(theta)
        return [rate, math.sin(theta) * (fall - precession * gyro) / lambda1, precession]

    tilt = math.pi / 6
    vertical = lambda1 * 3 * math.sin(tilt) ** 2 + lambda3 * spin * math.cos(tilt)
    solved = solve_ivp(slopes, (0, 2), [tilt, 0, 0], t_eval=t, method="DOP853", rtol=1e-10, atol=1e-12)
    theta, _, phi = solved.y
    for shown in (phi, (phi + math.pi) % (2 * math.pi) - math.pi):
        assert judged(key, {"t": t, "phi": shown, "theta": theta}).verdict == "correct"
    degrees = judged(key, {"t": t, "phi": np.degrees(phi), "theta": np.degrees(theta)})
    assert codes(degrees) == ["degrees_radians"]


def test_too_few_samples_are_not_enough_for_a_key() -> None:
    with pytest.raises(ValueProblem, match="too few samples of `x`") as problem:
        computed(SPRING, "hamilton.orbit", samples=25, tolerance={"relative": 1e-6})
    assert "orbit.samples" in (problem.value.hint or "")


# --- keys that are none


@answers(
    """
    options | answer
    {} | orbit.csv  {file: orbit.csv}  {csv: "t,x\\n0,1"}  {t: [0, 1], columns: {x: t}}
    {t: [1, 0, 0.1], columns: {x: t}}  {t: [0, 1, 0], columns: {x: t}}  {t: [0, 1, 1e-9], columns: {x: t}}
    {t: [0, 1, 0.1], columns: {x: secret*t}}  {t: [0, 1, 0.1], columns: {x: 1/(t-t)}}
    {t: [0, 1, 0.1], columns: {}}  {t: [0, 1, 0.1], columns: {t: t}}
    {columns: [y]} | {t: [0, 1, 0.1], columns: {x: t}}
    {columns: [x, x]} | {t: [0, 1, 0.1], columns: {x: t}}
    {angles: [y]} | {t: [0, 1, 0.1], columns: {x: t}}
    {angles: [x], modulo: secret} | {t: [0, 1, 0.1], columns: {x: t}}
    {angles: [x], modulo: "-1"} | {t: [0, 1, 0.1], columns: {x: t}}
    {conserved: {E: x}} | {t: [0, 1, 0.1], columns: {x: t}}
    {angles: [x], tolerance: {absolute: 3}} | {t: [0, 9, 0.1], columns: {x: t}}
    """,
    ("{}", {"csv": "t,x\n" + "\n".join(f"{k},secret" for k in range(50))}),
    ("{}", {"csv": "x,y\n" + "1,2\n" * 50}),
)
def test_keys_that_cannot_be_judged_by(options: str, answer: object) -> None:
    with pytest.raises(ValueProblem) as problem:
        literal(answer, **read_tree(options, ""))
    assert "secret" not in problem.value.message


# --- examples


@pytest.mark.parametrize(
    "key",
    [
        OSCILLATOR,
        DAMPED,
        formulas(3, {"x": "4*t", "y": "12*t - 4.9*t^2"}),
        formulas(20, {"phi": "1.3*t + 0.2*sin(t)", "r": "1 + 0.3*cos(t)"}, angles=["phi"]),
        formulas(20, {"x": "2", "y": "3"}),
        formulas(20, {"x": "0"}),
        formulas(9, {"x": "cos(t)", "p": "-sin(t)"}, columns=["x"], conserved={"E": "x^2 + p^2"}),
    ],
)
def test_examples_are_judged_as_they_say(key: Key) -> None:
    assert len(require_examples("trajectory", key)) >= 3


def test_examples_of_documents(chaotic: Key) -> None:
    for key in (chaotic, computed(TOP, "euler.trajectory.orientation"), computed(SPRING, "hamilton.orbit")):
        require_examples("trajectory", key)


# --- what is no answer


@cases(
    """
    code | text
    wrong_shape | t,x,p  # t,x,p  t,x,p/0,1/  t,x,p/0,1,2,3/
    missing_column | 0,1,2/1,2,3/  x,p/1,2/
    duplicate_key | t,x,x,p/0,1,2,3/
    not_a_number | t,x,p/0,1,/  t,x,p/0,1,one/  t,x,p/0,1,1_000/  t,x,p/0,1,0x10/  t,x,p/0,1,1e/
    t,x,p/0,1,1 2/  t,x,p/0,1,5 cm/  t,x,p/0,1,٣/  t,x,p/0,1,__import__('os').system('true')/
    not_a_finite_number | t,x,p/0,1,nan/  t,x,p/0,1,-inf/  t,x,p/0,1,1e999/
    """,
    ("wrong_shape", ""),
    ("too_large", "t,x,p/" + "0,1,pi/" * 1001),
    ("too_large", "t,x,p/" + "0" * MOST_CHARACTERS),
)
def test_tables_that_cannot_be_read(code: str, text: str) -> None:
    assert refused(OSCILLATOR, {"csv": text.replace("/", "\n")}) == code


@answers(
    """
    answer
    orbit.csv  [orbit.csv]  {}  {file: a.csv, csv: 't,x'}  {path: a.csv}  {csv: ['t,x']}  {csv: {t: 0}}
      {file: [a.csv]}  {file: ''}
    """,
    {"csv": None},
    {"file": None},
    {"file": "  "},
)
def test_answers_of_another_form(answer: object) -> None:
    assert refused(OSCILLATOR, answer) == "wrong_shape"


def test_numbers_may_be_written_as_expressions() -> None:
    lines = table(oscillator())["csv"].split("\n")
    lines[1] = "0/3,1.5*cos(3/10),-3*sin(0.3)"
    assert answered(OSCILLATOR, {"csv": "\n".join(lines)}, HERE).verdict == "correct"


@settings(max_examples=80, deadline=None)
@given(
    st.recursive(
        st.one_of(st.none(), st.text(), st.text("0123456789.,-+eE\n tx")),
        lambda inner: st.one_of(
            st.lists(inner, max_size=3),
            st.dictionaries(st.sampled_from(["csv", "file", "x"]), inner, max_size=2),
        ),
        max_leaves=5,
    )
)
def test_nothing_else_is_ever_raised(answer: object) -> None:
    for each in (answer, {"csv": answer}, {"file": answer}):
        try:
            outcome = answered(OSCILLATOR, each, HERE / "tests")
        except Unreadable as unreadable:
            outcome = unreadable.outcome
        assert outcome.verdict in ("incorrect", "invalid")
        assert sentence(outcome.findings[0])


@settings(max_examples=50, deadline=None)
@given(
    st.lists(
        st.tuples(*[st.one_of(st.floats(-20, 20), st.floats(allow_nan=False, allow_infinity=False))] * 3),
        min_size=1,
        max_size=40,
    ),
    st.booleans(),
)
def test_tables_of_any_numbers_have_an_outcome(rows: list[tuple[float, ...]], in_order: bool) -> None:
    rows = sorted(rows) if in_order else rows
    text = "\n".join(["t,x,p", *(",".join(map(repr, row)) for row in rows)])
    assert answered(OSCILLATOR, {"csv": text}, HERE).verdict == "incorrect"


def test_large_tables_take_little_time() -> None:
    """A million characters, in the forms that take longest."""
    rows = MOST_CHARACTERS // 20
    texts = [
        "t,x,p\n" + "\n".join(f"{k},1,1.2345678" for k in range(rows)),
        "t,x,p\n" + "\n".join(f"{k},1,1e" for k in range(rows)),
        "t,x,p" + ",a" * 400_000 + "\n0,1,2",
        "t,x,p\n" + "\n" * 900_000,
        "t,x,p\n" + "0,1,2\n" * 160_000,
        "θ," * 300_000 + "\n",
        "t,x,p\n0,1," + "(" * 900_000,
        "#\n" * 400_000,
    ]
    for text in texts:
        begin = time.process_time()
        with suppress(Unreadable):
            read_columns(text[:MOST_CHARACTERS], ("t", "x", "p"))
        assert time.process_time() - begin < 2.0, text[:30]


# --- files beside an answer


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    beside = tmp_path / "answers"
    beside.mkdir()
    (beside / "orbit.csv").write_text(table(oscillator())["csv"], encoding="utf-8")
    (tmp_path / "orbit.csv").write_text(table(oscillator())["csv"], encoding="utf-8")
    return beside


def test_a_file_beside_the_answer(folder: Path) -> None:
    for name in ("orbit.csv", "ö r b i t", "..csv", "a..b", "-rf"):
        (folder / name).write_text(table(oscillator())["csv"], encoding="utf-8-sig")
        assert answered(OSCILLATOR, {"file": name}, folder).verdict == "correct"


@cases("""
    answer | outcome | there
    # As Canvas, or Moodle, names what is handed in.
    doejane_4711_98764_answers.yaml | correct | doejane_4711_98765_orbit.csv
    doejane_LATE_4711_98765_orbit.csv  orbit.csv
    doejane_LATE_4711_98764_answers.yaml | correct | doejane_LATE_4711_98765_orbit.csv
    doejane_4711_98764_answers-1.yaml | correct | doejane_4711_98765_orbit-1.csv
    doejane_4711_8_answers.yaml | correct | doejane_4711_9_orbit.csv + doejane_4711_7_orbit-1.csv
    doejane_4711_9_orbit.csv + doejane_4711_7_orbit.csv
    Jane Doe_4711_assignsubmission_file_a.yaml | correct | Jane Doe_4711_assignsubmission_file_orbit.csv
    answers.yaml | correct | orbit.csv + orbit_b.csv + notes.txt
    # Those of others are not seen.
    doejane_4711_98764_answers.yaml | missing_file | roerick_12_98765_orbit.csv  doejane_4712_98765_orbit.csv
    doejane_4711_8_answers.yaml | missing_file | doejane_4711_9_my_orbit.csv + doejane_4711_7_orbitXcsv
    Jane Doe_4711_assignsubmission_file_a.yaml | missing_file | Jane Roe_1_assignsubmission_file_orbit.csv
    answers.yaml | missing_file | doejane_4711_98765_orbit.csv
    """)
def test_a_file_is_found_as_canvas_and_moodle_name_it(
    tmp_path: Path, answer: str, outcome: str, there: str
) -> None:
    for name in (answer, *there.split(" + ")):
        (tmp_path / name).write_text(table(oscillator())["csv"], encoding="utf-8")
    with suppress(Unreadable):
        assert answered(OSCILLATOR, {"file": "orbit.csv"}, tmp_path / answer).verdict == outcome
        return
    assert refused(OSCILLATOR, {"file": "orbit.csv"}, tmp_path / answer) == outcome


ELSEWHERE = (
    r"../orbit.csv /etc/passwd sub/orbit.csv .. . ..\orbit.csv C:orbit.csv C:\orbit.csv orbit.csv:stream"
)


@pytest.mark.parametrize("name", [*ELSEWHERE.split(), "orbit.csv\0", "file:///etc/passwd"])
def test_names_that_lead_elsewhere(folder: Path, name: str) -> None:
    assert refused(OSCILLATOR, {"file": name}, folder) == "path_outside"


@pytest.mark.parametrize("name", ["none.csv", "x" * 5000, "\ud800.csv", "orbit.csv ", "\n", "~", "*.csv"])
def test_files_that_are_not_there(folder: Path, name: str) -> None:
    assert refused(OSCILLATOR, {"file": name}, folder) in ("missing_file", "wrong_shape")


def test_links_folders_fifos_sockets_and_devices_are_not_opened(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "link.csv").symlink_to(folder / "orbit.csv")
    (folder / "passwd.csv").symlink_to("/etc/passwd")
    (folder / "loop.csv").symlink_to("loop.csv")
    (folder / "zero.csv").symlink_to("/dev/zero")
    (folder / "folder.csv").mkdir()
    os.mkfifo(folder / "fifo.csv")
    monkeypatch.chdir(folder)  # names of sockets are short
    with socket.socket(socket.AF_UNIX) as server:
        server.bind("socket.csv")
        names = {entry.name for entry in folder.iterdir()} - {"orbit.csv"}
        assert len(names) == 7
        for name in names:
            assert refused(OSCILLATOR, {"file": name}, folder) == "not_allowed"
    assert refused(OSCILLATOR, {"file": "null"}, Path("/dev")) == "not_allowed"


def test_files_that_are_too_large_or_no_text(folder: Path) -> None:
    with (folder / "huge.csv").open("wb") as file:
        file.truncate(10**12)
    (folder / "binary.csv").write_bytes(bytes(range(256)))
    (folder / "wide.csv").write_bytes(table(oscillator())["csv"].encode("utf-16"))
    (folder / "zeros.csv").write_bytes(bytes(1000))
    (folder / "empty.csv").write_bytes(b"")
    names = ("huge.csv", "binary.csv", "wide.csv", "zeros.csv", "empty.csv")
    found = {name: refused(OSCILLATOR, {"file": name}, folder) for name in names}
    assert found["huge.csv"] == "too_large"
    assert found["binary.csv"] == found["wide.csv"] == "parse_error"
    assert found["empty.csv"] == "wrong_shape"


def test_an_honest_file_does_not_mind_its_neighbours(folder: Path) -> None:
    alone = answered(OSCILLATOR, {"file": "orbit.csv"}, folder)
    os.mkfifo(folder / "orbit.csv.bak")
    (folder / "t,x,p").mkdir()
    (folder / "ORBIT.CSV").write_text("t\n0\n", encoding="utf-8")
    assert answered(OSCILLATOR, {"file": "orbit.csv"}, folder) == alone


def test_messages_on_files_are_harmless(folder: Path) -> None:
    for name in ("\x1b[31m", "\u202egpj.csv", "a" * 200, *string.punctuation):
        with pytest.raises(Unreadable) as refusal:
            answered(OSCILLATOR, {"file": name}, folder)
        assert sentence(refusal.value.finding).isprintable()
        assert len(sentence(refusal.value.finding)) < 200


def test_energy_that_grows_is_told() -> None:
    columns = {"x": "1.5*cos(2*t + 0.3)", "p": "-3*sin(2*t + 0.3)"}
    key = formulas(10, columns, conserved={"E": "p**2/2 + 2*x**2"})
    x, p, step, rows = 1.5 * math.cos(0.3), -3 * math.sin(0.3), 0.02, []
    for index in range(501):
        rows.append((index * step, x, p))
        x, p = x + step * p, p - step * 4 * x  # Euler's method, by which the energy grows
    t, xs, ps = np.array(rows).T
    assert codes(judged(key, {"t": t, "x": xs, "p": ps})) == ["outside_tolerance", "conserved_quantity_drift"]


def test_the_times_themselves_cannot_be_asked() -> None:
    text = (ROOT / "configs/notes_spring.yaml").read_text()
    with pytest.raises(ValueProblem, match="the student's own"):
        computed(text, "hamilton.orbit.t")


# --- right answers are never wrong, and wrong ones never right

Motion = tuple[Key, Callable[[Floats], dict[str, Floats]]]
"""A key, and the same motion at any times by a closed form or another integrator."""


def pendulum_swing(t: Floats) -> dict[str, Floats]:
    def slopes(_: float, y: Floats) -> list[float]:
        return [y[1], -9.81 * math.sin(y[0])]

    # A step of its own for every answer, as other programs have.
    solved = solve_ivp(slopes, (0, 6), [2.5, 0], method="DOP853", rtol=1e-9, atol=1e-9, dense_output=True)
    assert solved.sol is not None
    return {"t": t, "theta": solved.sol(t)[0], "p_theta": solved.sol(t)[1]}


@pytest.fixture(scope="module")
def motions(forty: Key) -> list[Motion]:
    many_rows = double_pendulum(40, 1e-10, 8001)
    chaos = make_interp_spline(many_rows["t"], np.column_stack(list(many_rows.values())), 7)
    swing = "system: {coordinates: [theta], lagrangian: thetadot^2/2 + 9.81*cos(theta)}\n"
    swing += "orbit: {initial: {theta: 2.5, p_theta: 0}, duration: 6}"
    angle = formulas(20, {"phi": "1.3*t + 0.2*sin(t)", "r": "1 + 0.3*cos(t)"}, angles=["phi"])
    small = formulas(10, {"x": "3*cos(2*t)", "y": "1e-7*sin(3*t)"})
    few = literal(table(fast(np.linspace(0, 20, 41))), angles=["phi"])
    return [
        (OSCILLATOR, oscillator),
        (DAMPED, damped),
        (angle, lambda t: {"t": t, "phi": 1.3 * t + 0.2 * np.sin(t), "r": 1 + 0.3 * np.cos(t)}),
        (small, lambda t: {"t": t, "x": 3 * np.cos(2 * t), "y": 1e-7 * np.sin(3 * t)}),
        (few, fast),
        (computed(swing, "hamilton.orbit"), pendulum_swing),
        (computed(TOP, "euler.trajectory.orientation"), spinning),
        (forty, lambda t: dict(zip(many_rows, (t, *chaos(t).T[1:]), strict=True))),
    ]


def a_right_answer(motion: Motion, chance: np.random.Generator) -> dict[str, str]:
    """The motion at times, with heads and in a form, that a student may choose."""
    key, truth = motion
    steps = chance.uniform(0.3, 1, chance.integers(150, 400))
    t = key.start + np.append(0, np.cumsum(steps)) / steps.sum() * key.span
    if key.times is not None:
        t = key.times[:: chance.choice([1, 2, 4])] if chance.random() < 0.5 else np.union1d(key.times, t[:-1])
    elif chance.random() < 0.3:
        t = np.linspace(key.start, key.stop, chance.integers(60, 500))
    columns = truth(t)
    for place, name in enumerate(key.columns[: key.required]):
        columns[name] = columns[name] + 0.95 * key.margins[place] * chance.uniform(-1, 1, len(t))
        if np.isfinite(key.periods[place]):
            columns[name] += key.periods[place] * chance.integers(-2, 3, len(t))
    if key.quaternion:
        signs = chance.choice([-1, 1], len(t))
        columns = {name: values if name == "t" else values * signs for name, values in columns.items()}
    heads = {"t": chance.choice(["t", "T", "Time", "TIME (s)", "time [s]", " t / s "])}
    named = {heads.get(name, name.upper()): columns[name] for name in chance.permutation(list(columns))}
    return table(named, chance.choice([",", ";", "\t"]), repr if chance.random() < 0.5 else "{:.12g}".format)


ATTACKS = (
    "frozen", "replay", "back", "chance", "four", "warp", "swap", "one", "still", "zeros", "noise", "late",
    "size", "slope", "tiny",
)  # fmt: skip


def a_wrong_answer(motion: Motion, chance: np.random.Generator, attack: str) -> dict[str, Floats]:
    """The motion with something that must not be right."""
    key, truth = motion
    t = np.linspace(key.start, key.stop, chance.integers(61, 300))
    if key.times is not None:
        t = np.union1d(t, key.times)
    right = truth(t)
    place = int(chance.choice(np.flatnonzero(key.moving[: key.required])))
    name, margin = key.columns[place], key.margins[place]
    row = int(np.argmin(np.abs(t - chance.choice(t if key.times is None else key.times))))
    off = float(chance.choice([-1, 1]) * margin * chance.uniform(1.1, 20))
    match attack:
        case "warp":  # on time at both ends
            other = truth(t + 0.05 * key.span * np.sin(np.pi * (t - key.start) / key.span))
        case "late":
            other = truth(t - 0.02 * key.span)
        case "swap":
            other = {"t": t} | dict(
                zip(list(right)[1:], np.roll(list(right.values())[1:], 1, axis=0), strict=True)
            )
        case "one":
            other = right | {name: right[name] + off * (np.arange(len(t)) == row)}
        case "size":
            other = right | {name: right[name] * (1 + off)}
        case "slope":
            other = right | {name: right[name] + off * (t - key.start) / key.span}
        case "tiny":  # so that no column is so small that it need not be right
            small = min(key.columns[: key.required], key=lambda each: np.ptp(right[each]))
            other = right | {small: np.zeros_like(t)}
        case "still":
            other = right | {name: np.full_like(t, right[name][row])}
        case "zeros":  # at times at which the column is near nothing, as often as it likes
            crossing = np.flatnonzero(np.diff(np.sign(right[name] - right[name].mean())))
            t = np.linspace(t[crossing[0]], t[crossing[-1]], 2 * len(crossing) - 1)
            other = {each: np.zeros_like(t) for each in right}
        case "noise":
            other = right | {name: right[name] + off * chance.normal(1, 0.5, len(t))}
        case _:
            other = gone_on(right, key.start + chance.uniform(0.05, 0.85) * key.span, attack)
    return other | {"t": t} if attack != "four" else other


def error(motion: Motion, columns: Columns) -> float:
    """The most that a judged column is off by where it can be judged, in margins."""
    key, truth = motion
    seen = (columns["t"] <= key.horizon) & (key.times is None or np.isin(columns["t"], key.times))
    right, worst = truth(columns["t"]), 0.0
    for place, name in enumerate(key.columns[: key.required]):
        off, period = columns[name] - right[name], key.periods[place]
        off = off - period * np.round(off / period) if np.isfinite(period) else off
        worst = max(worst, float(np.abs(off[seen]).max(initial=0) / key.margins[place]))
    return worst


@many
@given(st.integers(0, 10**9))
def test_right_answers_are_never_wrong(motions: list[Motion], seed: int) -> None:
    chance = np.random.default_rng(seed)
    motion = motions[chance.integers(len(motions))]
    assert answered(motion[0], a_right_answer(motion, chance), HERE).verdict == "correct"


@many
@given(st.integers(0, 10**9), st.sampled_from(ATTACKS))
def test_wrong_answers_are_never_right(motions: list[Motion], seed: int, attack: str) -> None:
    chance = np.random.default_rng(seed)
    motion = motions[chance.integers(len(motions))]
    columns = a_wrong_answer(motion, chance, attack)
    assume(error(motion, columns) > 1.05)
    outcome = judged(motion[0], columns)
    assert outcome.verdict in ("incorrect", "partial")
    assert outcome.findings
