"""Equations of motion against textbooks: any equivalent set is right, and no other."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.algebra.substitution import substitute
from rigidcli.document.load import load, loads
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.grading.asked import Asked
from rigidcli.grading.equations.key import Key
from rigidcli.grading.equations.truth import state
from rigidcli.grading.feedback import sentence
from rigidcli.grading.kinds import KINDS
from rigidcli.grading.question import Question
from rigidcli.language.expression import parse
from rigidcli.studies import hamilton
from tests.grading.asking import Asking, answers, cases, codes, require_examples

kind = KINDS["equations"]

CONFIGS = Path(__file__).parents[2] / "configs"

judged = Asking("equations").judged

Equation = tuple[str, str]

many = settings(max_examples=150, deadline=None)
some = settings(max_examples=60, deadline=None)


@cache
def of_document(name: str, **options: Any) -> Key:
    """The key of Hamilton's equations of an example, whose orbit need not be followed."""
    document = load(CONFIGS / f"{name}.yaml")
    report = hamilton.run(document.model_copy(update={"orbit": None}))
    question = Question.model_validate({"document": f"{name}.yaml", "ask": "hamilton.equations", **options})
    asked = Asked(question, report["equations"], "", ("hamilton", "equations"), document, report)
    key: Key = kind.read_key(asked)
    return key


def literal(value: Any, name: str = "", **options: Any) -> Key:
    question = Question.model_validate({"answer": value, "kind": "equations", **options})
    key: Key = kind.read_key(Asked(question, value, name=name))
    return key


def texts(equations: Sequence[Equation]) -> list[str]:
    return [f"{left} = {right}" for left, right in equations]


EULER: dict[str, Any] = {
    "w1dot": "(I2 - I3)*w2*w3/I1",
    "w2dot": "(I3 - I1)*w3*w1/I2",
    "w3dot": "(I1 - I2)*w1*w2/I3",
}
"""Torque-free rotation: L. D. Landau, E. M. Lifshitz, Mechanics, equation 36.5."""

KEYS: Mapping[str, Callable[[], Key]] = {
    name: (lambda name=name: of_document(name))
    for name in (
        "notes_spring",
        "double_pendulum",
        "kepler_polar",
        "henon_heiles",
        "taylor_13_03",
        "taylor_13_12",
        "driven_oscillator",
        "magnetic_particle",
        "relativistic_oscillator",
    )
} | {"euler": cache(lambda: literal(EULER))}

_MASS = "(m1 + m2*sin(theta1 - theta2)^2)"
_C1 = f"p_theta1*p_theta2*sin(theta1 - theta2)/(l1*l2*{_MASS})"
_C2 = (
    "(m2*l2^2*p_theta1^2 + (m1 + m2)*l1^2*p_theta2^2 - 2*m2*l1*l2*p_theta1*p_theta2*cos(theta1 - theta2))"
    f"*sin(2*(theta1 - theta2))/(2*l1^2*l2^2*{_MASS}^2)"
)

RIGHT: Mapping[str, Sequence[Sequence[Equation]]] = {
    name: [[(left.strip(), right.strip()) for left, _, right in (e.partition("=") for e in each.split(";"))]
           for each in sets]
    for name, sets in {
        "notes_spring": [
            "xdot = p_x/m; p_xdot = -k*x",
            "p_x = m*xdot; p_xdot = -k*x",
            "m*xddot = -k*x",
        ],
        # Hamilton's equations of en.wikipedia.org/wiki/Double_pendulum; then those of Lagrange, which for
        # small angles are equations 11.37 and 11.38 of J. R. Taylor, Classical Mechanics.
        "double_pendulum": [
            f"""theta1dot = (l2*p_theta1 - l1*p_theta2*cos(theta1 - theta2))/(l1^2*l2*{_MASS});
            theta2dot = (l1*(m1 + m2)*p_theta2 - l2*m2*p_theta1*cos(theta1 - theta2))/(m2*l1*l2^2*{_MASS});
            p_theta1dot = -(m1 + m2)*g*l1*sin(theta1) - {_C1} + {_C2};
            p_theta2dot = -m2*g*l2*sin(theta2) + {_C1} - {_C2}""",
            """(m1 + m2)*l1*theta1ddot + m2*l2*cos(theta1 - theta2)*theta2ddot
            = -m2*l2*theta2dot^2*sin(theta1 - theta2) - (m1 + m2)*g*sin(theta1);
            l2*theta2ddot + l1*cos(theta1 - theta2)*theta1ddot
            = l1*theta1dot^2*sin(theta1 - theta2) - g*sin(theta2)""",
        ],
        "kepler_polar": [
            "rdot = p_r/m; phidot = p_phi/(m*r^2); p_rdot = p_phi^2/(m*r^3) - gm*m/r^2; p_phidot = 0",
            "rddot = r*phidot^2 - gm/r^2; r*phiddot = -2*rdot*phidot",
            "m*rddot = p_phi^2/(m*r^3) - gm*m/r^2; phidot = p_phi/(m*r^2); p_phidot = 0",
        ],
        "henon_heiles": [
            "xdot = p_x; ydot = p_y; p_xdot = -x - 2*x*y; p_ydot = -y - x^2 + y^2",
            "xddot = -x - 2*x*y; yddot = -y - x^2 + y^2",
            "xddot = -x - 2*x*y; ydot = p_y; p_ydot = -y - x^2 + y^2",
        ],
        "taylor_13_03": [
            "(m1 + m2 + M/2)*xdot = p_x; p_xdot = (m1 - m2)*g",
            "(m1 + m2 + M/2)*xddot = (m1 - m2)*g",
        ],
        "taylor_13_12": ["rdot = p_r/m; p_rdot = m*w^2*r", "rddot = w^2*r"],
        "driven_oscillator": ["xdot = p_x/m; p_xdot = -k*x + F*cos(w*t)", "m*xddot + k*x = F*cos(w*t)"],
        # With v = (p - q A)/m and A = (-B y/2, B x/2, 0); then the Lorentz force m dv/dt = q v x B.
        "magnetic_particle": [
            """m*xdot = p_x + q*B*y/2; m*ydot = p_y - q*B*x/2; m*zdot = p_z;
            p_xdot = q*B/2*(p_y - q*B*x/2)/m; p_ydot = -q*B/2*(p_x + q*B*y/2)/m; p_zdot = 0""",
            "m*xddot = q*B*ydot; m*yddot = -q*B*xdot; zddot = 0",
            """p_x = m*xdot - q*B*y/2; p_y = m*ydot + q*B*x/2; p_z = m*zdot;
            p_xdot = q*B*ydot/2; p_ydot = -q*B*xdot/2; p_zdot = 0""",
        ],
        "relativistic_oscillator": [
            "xdot = p_x/sqrt(m^2 + p_x^2/c^2); p_xdot = -k*x",
            "m*xddot = -k*x*(1 - xdot^2/c^2)^(3/2)",
        ],
        "euler": ["I1*w1dot = (I2 - I3)*w2*w3; I2*w2dot = (I3 - I1)*w3*w1; I3*w3dot = (I1 - I2)*w1*w2"],
    }.items()
}  # fmt: skip
"""Sets that textbooks have, none with an equation that follows from the others."""

SETS = [(name, place) for name, sets in RIGHT.items() for place in range(len(sets))]


def rearranged(chance: random.Random, key: Key, equations: Sequence[Equation]) -> list[str]:
    """An equivalent set: in another order, added to each other, multiplied, and moved to one side."""
    second = any("ddot" in left for left, _ in equations)
    # Of second order, equations say nothing of momenta.
    names = sorted(key.motion.domains.keys() - (key.motion.auxiliary if second else ()))
    factors = ["2", "3/7", "-1", "pi"]
    for name in names:
        factors += [f"exp({name}/3)", f"(1 + {name}^2)", f"cosh({name})", f"1/(2 + cos({name}))"]
    factors += [name for name in names if key.motion.domains[name] == "positive"]
    order = chance.sample(range(len(equations)), len(equations))
    rows = [{place: "1"} for place in order]
    for _ in range(chance.randrange(4)):
        # One row times something, added to another, can be taken back: the set says the same.
        i, j = chance.randrange(len(rows)), chance.randrange(len(rows))
        if i != j:
            c = chance.choice([*factors, *names])
            for place, other in rows[j].items():
                rows[i][place] = f"{rows[i].get(place, '0')} + {c}*({other})"
    result = []
    for row in rows:
        common = chance.choice(["1", *factors])
        left: list[tuple[str, int]] = []
        right: list[tuple[str, int]] = []
        for place, coefficient in row.items():
            a, b = equations[place]
            (left if chance.random() < 0.7 else right).append((f"({coefficient})*({a})", 1))
            (right if chance.random() < 0.7 else left).append((f"({coefficient})*({b})", -1))
        # What is on the left counts +a - b = 0; what was moved to the right turns its sign.
        one = " + ".join(f"{sign}*{text}" for text, sign in left) or "0"
        two = " + ".join(f"{-sign}*{text}" for text, sign in right) or "0"
        sign = chance.choice(["=", "=="])
        text = f"({common})*({one}) {sign} ({common})*({two})"
        result.append(text.replace("*", " * ") if chance.random() < 0.3 else text)
    return result


def value_at(text: str, point: Mapping[str, float]) -> float | None:
    try:
        return float(parse(text).evaluate(point))
    except ExpressionError:
        return None


def differs(a: str, b: str, key: Key, seed: int) -> bool:
    """Whether two expressions are different functions, by single values."""
    chance = random.Random(seed)
    names = {*key.motion.domains, *key.motion.known}
    for _ in range(20):
        point = {name: chance.uniform(0.3, 1.7) for name in names}
        x, y = value_at(a, point), value_at(b, point)
        if x is not None and y is not None and abs(x - y) > 1e-6 * (abs(x) + abs(y)):
            return True
    return False


def spoiled(chance: random.Random, key: Key, equations: Sequence[Equation]) -> list[Equation]:
    """A set with one thing wrong: a sign, a factor, a symbol, a term, or an equation that says nothing."""
    place = chance.randrange(len(equations))
    left, right = equations[place]
    names = sorted({*re.findall(r"[A-Za-z_]\w*", right)} & {*key.motion.domains, *key.motion.known})
    changes = [
        (left, f"-({right})"),
        (left, f"{chance.choice(['2', '1/2', '(1 + 1e-5)', '0.99'])}*({right})"),
        (left, f"{right} + {chance.choice(sorted(key.motion.domains))}/1000"),
        (f"{left} + {chance.choice(key.motion.names)}", right),
    ]
    if names:
        name = chance.choice(names)
        other = chance.choice([*key.motion.domains, "2", "0"])
        changes.append((left, re.sub(rf"\b{name}\b", other, right)))
        changes.append((left, re.sub(rf"\b{name}\b", f"{name}^2", right)))
    changes = [(a, b) for a, b in changes if differs(f"({a}) - ({b})", f"({left}) - ({right})", key, 1)]
    result = list(equations)
    kinds = chance.choice(["change", "change", "change", "drop", "trivial", "repeat"])
    if kinds == "change":
        result[place] = chance.choice(changes)
    elif kinds == "trivial":
        x = key.motion.names[0]
        result[place] = chance.choice([("0", "0"), (left, left), (f"({left})*{x}", f"{x}*({left})")])
    elif kinds == "repeat" and len(result) > 1:
        a, b = result[place - 1]
        result[place] = (f"2*({a})", f"2*({b})")
    else:
        result[place] = result.pop() if len(result) > place + 1 else ("1", "1")
    return result


@pytest.mark.parametrize(("name", "place"), SETS)
def test_textbook_equations_are_right(name: str, place: int) -> None:
    outcome = judged(KEYS[name](), texts(RIGHT[name][place]))
    assert outcome.verdict == "correct", outcome
    second = all("ddot" in left for left, _ in RIGHT[name][place])
    assert codes(outcome) == (["second_order_form"] if second and name != "euler" else [])


SEEDS = st.integers(0, 2**32).map(random.Random)


def chosen(chance: random.Random) -> tuple[Key, Sequence[Equation]]:
    """A key and equations that are right."""
    name, place = chance.choice(SETS)
    return KEYS[name](), RIGHT[name][place]


@many
@given(SEEDS)
def test_rearranged_equations_are_right(chance: random.Random) -> None:
    key, equations = chosen(chance)
    answer = rearranged(chance, key, equations)
    assert judged(key, answer).verdict == "correct", answer


@many
@given(SEEDS)
def test_spoiled_equations_are_not_right(chance: random.Random) -> None:
    key, equations = chosen(chance)
    answer = spoiled(chance, key, equations)
    for form in (texts(answer), rearranged(chance, key, answer)):
        outcome = judged(key, form)
        assert outcome.verdict in ("incorrect", "partial"), (form, outcome)
        assert outcome.share < 1


@some
@given(st.data())
def test_sets_of_equations_of_several_kinds_are_right_together(data: st.DataObject) -> None:
    """What follows from the equations may stand beside them."""
    name = data.draw(st.sampled_from(sorted(RIGHT)))
    key = KEYS[name]()
    whole = data.draw(st.sampled_from(RIGHT[name]))
    every = [equation for equations in RIGHT[name] for equation in equations]
    more = data.draw(st.lists(st.sampled_from(every), max_size=4))
    outcome = judged(key, texts([*whole, *more]))
    assert outcome.verdict == "correct", outcome


SPRING = ("xdot = p_x/m", "p_xdot = -k*x")


@answers(
    """
    answer
    {x: p_x/m, p_x: -k*x}  {xdot: p_x/m, p_xdot: -k*x}  {p_x: m*xdot, p_xdot: -k*x}
    {m*xdot: p_x, p_xdot: -k*x}  [{xdot: p_x/m}, {p_xdot: -k*x}]  {p: m*x_dot, pdot: -k*x}
    {first: xdot = p_x/m, second: p_xdot = -k*x}
    'xdot = p_x/m; p_xdot = -k*x'  'xdot = p_x/m, p_xdot = -k*x'  ['xdot = p_x/m, p_xdot = -k*x']
    ['xdot = p_x/m; p_xdot = -k*x']  {Hamilton: 'xdot = p_x/m, p_xdot = -k*x'}  m*xddot = -k*x;
    "xdot = p_x/m\\npdot_x = -k*x\\n"  "xdot = p_x/m,\\np_xdot = -k*x,\\n"  ["m*xddot\\n = -k*x"]
    xdot = atan2(0, 1) + p_x/m, p_xdot + k*(x + atan2(0, 1)) == 0
    [m*xdot = p_x, m*xddot = -k*x]  [p_xdot = -k*x, m*xddot = -k*x]  [p_xdot = m*xddot, p_xdot = -k*x]
    [xdotdot = -k*x/m]  [x_ddot = -k*x/m]  [xdot = p_x/(2*m) + xdot/2, p_xdot = -k*x]
    [1e-200*xdot = 1e-200*p_x/m, 1e200*p_xdot = -1e200*k*x]
    [xdot + 1e16 = p_x/m + 1e16, p_xdot = -k*x]  [xdot = (p_x + 1e16)/m - 1e16/m, p_xdot = -k*x]
    [exp(p_xdot)*(xdot - p_x/m) = 0, (1 + p_xdot^2)*p_xdot = -k*x*(1 + p_xdot^2)]
    [xdot/(1 + xdot^2) = p_x/m/(1 + xdot^2), p_xdot = -k*x]
    [x' = p_x/m, p_x' = -k*x]  [m*x'' = -k*x]  [xdot = p_x/m, xdot = p_x/m, p_xdot = -k*x]
    [xdot = p_x/m, p_xdot = -k*x, xdot^2 = (p_x/m)^2]
    """,
    {"x_dot": "p_x/m", "p_x_dot": "\N{MINUS SIGN}k*x"},
    [
        "cos(t)*xdot - sin(t)*p_xdot = cos(t)*p_x/m + sin(t)*k*x",
        "sin(t)*xdot + cos(t)*p_xdot = sin(t)*p_x/m - cos(t)*k*x",
    ],
    {"x'": "p/m", "p\N{PRIME}": "-k*x"},
    {"x\N{DOUBLE PRIME}": "-k*x/m"},
)
def test_every_way_to_write_the_equations_of_a_spring(answer: Any) -> None:
    outcome = judged(of_document("notes_spring"), answer)
    assert (outcome.verdict, outcome.share) == ("correct", 1.0), outcome


@answers("""
    code | share | answer
    hamilton_sign | 0.5 | [xdot = p_x/m, p_xdot = k*x]
    hamilton_sign | 0 | [xdot = -p_x/m, p_xdot = k*x]
    sign_error | 0 | [xddot = k*x/m]
    constant_factor | 0.5 | [xdot = p_x/m, p_xdot = -2*k*x]
    constant_factor | 0 | [xddot = -k*x/(2*m)]
    number_for_symbol | 0.5 | [xdot = p_x/m, p_xdot = -4*x]
    number_for_symbol | 0 | [xddot = -4*x]
    equation_wrong | 0.5 | [xdot = p_x/m, p_xdot = -k*x^2]  [xdot = p_x/m, p_xdot = -k*x + 1e-5*x]
    [xdot = p_x/m, p_xdot = -k*x, 1 = 2]  [xdot = p_x/m, p_xdot = -k*x, xdot = 2*p_x/m]
    # What the key has values for, the answer must have.
    [m/p_x = 1/xdot, p_xdot = -k*x]  [xdot = p_x/m, p_xdot = -k*exp(log(x))]
    [xdot = p_x/m, p_xdot = -k*x^2/x]  [xdot = p_x/m, p_xdot = -k*x + 0*log(x + 100)]
    [xdot = p_x/m, p_xdot = -k*sqrt(x)^2]
    # Beyond floats, and between points that one would try.
    [xdot = p_x/m, p_xdot = -k*x + k*log(1 + exp(1e5*x))]
    [xdot = p_x/m, p_xdot = -k*x + abs(x - 60) + x - 60]
    [xdot = p_x/m, p_xdot = -k*x + exp(-1e6*(x - 0.123)^2)]
    [xdot = p_x/m, p_xdot = -k*x + (x - 0.5)*(x - 1)*(x + 1)*x/1e30]
    missing_equation | 0.5 | [xdot = p_x/m]  [p_x = m*xdot]  [xdot = p_x/m, p_xdot = m*xddot]
    # Where one equation is true, the other says nothing more.
    [xdot = p_x/m, p_xdot*(xdot - p_x/m)^3 = 0]  [xdot = p_x/m, exp(p_xdot)*(xdot - p_x/m)^3 = 0]
    [xdot = p_x/m, (p_xdot + k*x)*(xdot - p_x/m) = 0]
    missing_equation | 0 | [0 = 0]  [(xdot - p_x/m)^2 = 0]  [(p_xdot + k*x)^2 = 0]
    trivial_equation | 0 | [0 = 0]
    trivial_equation | 0.5 | [xdot = xdot, p_xdot = -k*x]  [x*xdot = xdot*x, p_xdot = -k*x]
    [p_xdot = -k*x, xdot*(sin(x)^2 + cos(x)^2 - 1) = 0]
    [p_xdot = -k*x, (xdot - p_x/m)*(sin(x)^2 + cos(x)^2 - 1) = 0]
    """)
def test_wrong_equations_of_a_spring(code: str, share: str, answer: Any) -> None:
    outcome = judged(of_document("notes_spring"), answer)
    assert code in codes(outcome), outcome
    assert outcome.share == pytest.approx(float(share))
    assert outcome.verdict == ("partial" if float(share) else "incorrect")


@answers("""
    answer
    [(p_xdot + k*x)*(xdot - p_x/m) = 0]  [xdot = p_x/m, sin(0.01*(p_xdot + k*x)) = 0]
    [xdot = p_x/m, (p_xdot + k*x)*(p_xdot + 1.0001*k*x) = 0]  [xdot^2 = (p_x/m)^2, p_xdot = -k*x]
    [(xdot - p_x/m)*(xdot - 2*p_x/m) = 0, p_xdot = -k*x]  [abs(xdot) = abs(p_x)/m, p_xdot = -k*x]
    [sin(xdot) = sin(p_x/m), p_xdot = -k*x]  [m*xddot^2 = -k*x*xddot]  [m*xddot^2 = -k*x*xddot + 0*p_xdot]
    [(xdot - p_x/m)^2 = 0, (xdot - p_x/m)*(p_xdot + k*x) = 0]
    # These are right, but a proof is not within reach.
    [(xdot - p_x/m)^2 + (p_xdot + k*x)^2 = 0]  [exp(xdot) = exp(p_x/m), p_xdot = -k*x]
    [xdot = p_x/m, tanh(p_xdot + k*x) = 0]
    [xdot = p_x/m, p_xdot = -k*x + exp(exp(exp(9))) - exp(exp(exp(9) + 1e-40))]
    """)
def test_what_is_not_linear_or_cannot_be_decided_is_for_a_person(answer: list[str]) -> None:
    outcome = judged(of_document("notes_spring"), answer)
    assert (outcome.verdict, outcome.share) == ("review", 0.0)
    assert codes(outcome) == ["undecided"]


@pytest.mark.parametrize("noise", ["1e12", "1e9", "1e6", "1e3"])
def test_noise_makes_no_equation(noise: str) -> None:
    """Terms that are zero but for rounding give no slope to solve by."""
    answer = [
        f"p_xdot + k*x + {noise}*(sin(x)^2 + cos(x)^2 - 1)*xdot = 0",
        f"p_xdot + k*x + {noise}*(sin(t)^2 + cos(t)^2 - 1)*(xdot - p_x/m) = 0",
    ]
    assert codes(judged(of_document("notes_spring"), answer)) == ["missing_equation"]


def test_a_trivial_equation_beside_a_right_set_does_no_harm() -> None:
    outcome = judged(of_document("notes_spring"), [*SPRING, "0 = 0"])
    assert (outcome.verdict, codes(outcome)) == ("correct", ["trivial_equation"])


@answers(
    """
    code | words | answer
    unknown_symbol | a second one `xddot` | [d^2x/dt^2 = -k*x/m]  [d²x/dt² = -k*x/m]
    parse_error | is spelled `xdot` | [ẋ = p_x/m]  [ṗ = -k*x]
    parse_error | a second one `xddot` | [ẍ = -k*x/m]
    parse_error | the decimal sign is a point | xdot = 0,5*p_x, p_xdot = -k*x
    parse_error | `,` | xdot = p_x/m, p_xdot
    parse_error | no `=` | [xdot]
    parse_error | more than one | [xdot = p_x/m = 3]
    parse_error | empty | ['xdot = ']  [= p_x/m]
    parse_error | column 13 | [xdot = p_x/m)]
    wrong_shape | a list of 1 | {xdot: [p_x/m]}  [[xdot = p_x/m]]
    wrong_shape | expected equations | []  {}
    """,
    ("unknown_symbol", "a time derivative is spelled `xdot`", ["dx/dt = p_x/m", SPRING[1]]),
    ("parse_error", "a second one `xddot`", ["\\ddot{x} = -k*x/m"]),
    ("unknown_symbol", "`M`", ["xdot = p_x/M", SPRING[1]]),
    ("wrong_shape", "nothing", {"xdot": None}),
    ("wrong_shape", "nothing", [None]),
    ("wrong_shape", "nothing", None),
    ("too_deep", "deeper", ["x = " + "(" * 101 + "x"]),
    ("too_large", "characters", ["x = " + "1+" * 10_000 + "1"]),
    ("too_large", "201 equations", ["0 = 0"] * 201),
)
def test_what_cannot_be_read(answer: Any, code: str, words: str) -> None:
    outcome = judged(of_document("notes_spring"), answer)
    assert (outcome.verdict, codes(outcome)) == ("invalid", [code])
    assert words in sentence(outcome.findings[0])


@cases("""
    right
    10**10**10  1/0  0^-1  log(-1)  sqrt(-x^2 - 1)  sin(1e300)  (x + 1e16) - 1e16
    """)
def test_hostile_numbers_are_wrong_and_no_more(right: str) -> None:
    outcome = judged(of_document("notes_spring"), {"xdot": "p_x/m", "p_xdot": right})
    assert (outcome.verdict, outcome.share) == ("partial", 0.5)


WORDS = re.findall(
    r"\S+| $", "xdot p_xdot xddot x p_x m k t 0 1 1e999 = == + - * / ^ ( ) sin( sqrt( log( abs( ; y "
)


@many
@given(st.lists(st.lists(st.sampled_from(WORDS), max_size=9).map("".join), max_size=4))
def test_any_text_has_an_outcome(answer: list[str]) -> None:
    outcome = judged(of_document("notes_spring"), answer)
    if outcome.verdict == "correct":
        # By chance one of the few short ways to write the motion.
        assert all(name in "".join(answer) for name in ("m", "k", "x"))


@pytest.mark.parametrize(
    ("changes", "share"), [({0}, 2 / 3), ({1}, 2 / 3), ({0, 2}, 1 / 3), ({0, 1, 2}, 0.0)]
)
def test_signs_of_eulers_equations(changes: set[int], share: float) -> None:
    answer = {
        name: f"-({right})" if place in changes else right
        for place, (name, right) in enumerate(EULER.items())
    }
    outcome = judged(KEYS["euler"](), answer)
    assert set(codes(outcome)) == {"euler_sign"}
    assert outcome.share == pytest.approx(share)


def test_a_torque_keeps_its_sign_in_a_wrong_equation_of_euler() -> None:
    torque = {f"w{i}dot": f"{EULER[f'w{i}dot']} + N{i}/I{i}" for i in (1, 2, 3)}
    key = literal(torque)
    answer = ["I1*w1dot - (I2 - I3)*w2*w3 = N1", "I2*w2dot - (I3 - I1)*w3*w1 = N2"]
    assert judged(key, [*answer, "I3*w3dot - (I1 - I2)*w1*w2 = N3"]).verdict == "correct"
    assert codes(judged(key, [*answer, "I3*w3dot + (I1 - I2)*w1*w2 = N3"])) == ["euler_sign"]


POLAR = {"rdot": "p_r/m", "phidot": "p_phi/(m*r^2)", "p_rdot": "p_phi^2/(m*r^3) - gm*m/r^2", "p_phidot": "0"}
LAGRANGE = {"rddot": "r*phidot^2 - gm/r^2", "phiddot": "-2*rdot*phidot/r"}


@answers("""
    code | answer
    coupling_term_missing | {p_rdot: -gm*m/r^2}  {rddot: -gm/r^2}
    sign_error | {phiddot: 2*rdot*phidot/r}  {rddot: -r*phidot^2 - gm/r^2}  {phidot: -p_phi/(m*r^2)}
    {rddot: gm/r^2 - r*phidot^2, phiddot: 2*rdot*phidot/r}
    hamilton_sign | {p_rdot: gm*m/r^2 - p_phi^2/(m*r^3)}
    # To turn the sign of gravity, one term of two, is to turn that of the potential.
    potential_sign | {p_rdot: p_phi^2/(m*r^3) + gm*m/r^2}  {rddot: r*phidot^2 + gm/r^2}
    constant_factor | {phidot: 2*p_phi/(m*r^2)}
    equation_wrong | {phidot: p_phi/m}
    """)
def test_mistakes_in_polar_coordinates(code: str, answer: dict[str, str]) -> None:
    right = LAGRANGE if any(name.endswith("ddot") for name in answer) else POLAR
    assert codes(judged(of_document("kepler_polar"), right | answer)) == [code]


@pytest.mark.parametrize(
    "answer",
    [
        {
            "thetaddot": "sin(theta)*cos(theta)*phidot^2 + g/l*sin(theta)",
            "phiddot": "-2*cos(theta)*thetadot*phidot/sin(theta)",
        },
        {
            "thetadot": "p_theta/(m*l^2)",
            "phidot": "p_phi/(m*l^2*sin(theta)^2)",
            "p_thetadot": "p_phi^2*cos(theta)/(m*l^2*sin(theta)^3) + m*g*l*sin(theta)",
            "p_phidot": "0",
        },
    ],
)
def test_a_pendulum_on_a_sphere_that_falls_upwards(answer: dict[str, str]) -> None:
    assert codes(judged(of_document("spherical_pendulum"), answer)) == ["potential_sign"]


def test_a_wrong_sign_says_whether_it_is_that_of_one_term() -> None:
    key = of_document("kepler_polar")
    for answer, one_term in (
        (POLAR | {"p_rdot": "-p_phi^2/(m*r^3) - gm*m/r^2"}, True),
        (LAGRANGE | {"rddot": "-r*phidot^2 - gm/r^2"}, True),
        (POLAR | {"phidot": "-p_phi/(m*r^2)"}, False),
        (LAGRANGE | {"phiddot": "2*rdot*phidot/r"}, False),
    ):
        (finding,) = judged(key, answer).findings
        assert finding.code == "sign_error"
        assert ("of one term" in sentence(finding)) == one_term


@pytest.mark.parametrize(
    "answer",
    [
        ["m*xddot = -q*B*ydot", "m*yddot = q*B*xdot", "m*zddot = 0"],
        ["m*xddot = q*B*ydot", "m*yddot = q*B*xdot", "m*zddot = 0"],
    ],
)
def test_a_wrong_sign_of_the_lorentz_force_is_none_of_hamiltons_equations(answer: list[str]) -> None:
    assert codes(judged(of_document("magnetic_particle"), answer)) == ["sign_error"]


@answers("""
    name | missing | answer
    notes_spring | without `m` | [xddot = -k*x]  [xdot = p_x, p_xdot = -k*x]
    notes_spring | without `k` | [xdot = p_x/m, p_xdot = -4*x]
    notes_spring | without `m`, `k` | [xddot = -4*x]
    # The mass is not there, nor is it in the right equations.
    spherical_pendulum | without `g` |
    {thetaddot: sin(2*theta)/2*phidot^2-9.81/l*sin(theta), sin(theta)*phiddot: -2*cos(theta)*thetadot*phidot}
    """)
def test_a_number_tells_the_symbol_in_whose_place_it_stands(name: str, missing: str, answer: Any) -> None:
    (finding,) = judged(of_document(name), answer).findings
    assert finding.code == "number_for_symbol"
    assert sentence(finding).endswith(f"; {missing}")


def test_a_term_that_the_values_of_the_document_hide_is_no_number() -> None:
    """A comet is so heavy that, for momenta of about 1, nothing is left of p_phi^2/(m^2 r^3)."""
    answer = ["rddot = -2*r*phidot^2 - gm/r^2", "r*phiddot + 2*rdot*phidot = 0"]
    assert codes(judged(of_document("kepler_polar"), answer)) == ["equation_wrong"]


@answers("""
    name | factor | answer
    # d/dt of the energy: m x' x'' + k x x' = 0.
    notes_spring | xdot | [m*xdot*xddot + k*x*xdot = 0]  [xdot*(p_xdot + k*x) = 0, xdot = p_x/m]
    notes_spring | x | [x*(p_xdot + k*x) = 0, xdot = p_x/m]  [x*xdot = x*p_x/m, p_xdot = -k*x]
    notes_spring | sin(x) | [sin(x)*p_xdot = -k*x*sin(x), xdot = p_x/m]
    notes_spring | x + abs(x) | [(x + abs(x))*(xdot - p_x/m) = 0, p_xdot = -k*x]
    notes_spring | p_x | [xdot = p_x/m, p_x*p_xdot = -k*x*p_x]
    kepler_polar | phidot | [rddot = r*phidot^2 - gm/r^2, phidot*(r*phiddot + 2*rdot*phidot) = 0]
    kepler_polar | p_phi |
    [rdot = p_r/m, phidot = p_phi/(m*r^2), p_rdot = p_phi^2/(m*r^3) - gm*m/r^2, p_phi*p_phidot = 0]
    kepler_polar | rdot | [rdot*(rddot - (r*phidot^2 - gm/r^2)) = 0, r*phiddot = -2*rdot*phidot]
    euler | w1 |
    [I1*w1dot*w1 = (I2 - I3)*w1*w2*w3, I2*w2dot = (I3 - I1)*w3*w1, I3*w3dot = (I1 - I2)*w1*w2]
    """)
def test_equations_that_say_nothing_at_some_state_are_for_a_person(
    name: str, answer: list[str], factor: str
) -> None:
    """A motion that stays there may not be one of the system."""
    outcome = judged(KEYS[name](), answer)
    assert (outcome.verdict, outcome.share) == ("review", 0.0)
    assert codes(outcome) == ["undecided", "extra_solutions"]
    assert f"`{factor}`" in outcome.findings[1].detail


@pytest.mark.parametrize(
    ("name", "answer"),
    [
        # The second equation tells what the first does not.
        ("notes_spring", ["m*xdot*xddot + k*x*xdot = 0", "m*xddot = -k*x"]),
        ("notes_spring", ["(1 + x^2)*xdot = (1 + x^2)*p_x/m", SPRING[1]]),
        ("kepler_polar", ["r^3*rddot = r^4*phidot^2 - gm*r", "r^2*phiddot + 2*r*rdot*phidot = 0"]),
    ],
)
def test_a_factor_that_is_never_zero_does_no_harm(name: str, answer: list[str]) -> None:
    outcome = judged(KEYS[name](), answer)
    assert outcome.verdict == "correct"
    assert "extra_solutions" not in codes(outcome)


def test_a_mistake_is_named_only_where_it_explains_all() -> None:
    key = of_document("henon_heiles")
    answer = ["xdot = p_x", "ydot = p_y", "p_xdot = x + 2*x*y", "p_ydot = -2*y - x^2 + y^2"]
    outcome = judged(key, answer)
    assert codes(outcome) == ["equation_wrong", "equation_wrong"]
    assert [finding.place for finding in outcome.findings] == ["equation 3", "equation 4"]
    assert outcome.share == pytest.approx(1 / 2)


@pytest.mark.parametrize(
    ("answer", "missing"),
    [
        ({"rdot": "p_r/m", "phidot": "p_phi/(m*r^2)", "p_rdot": "p_phi^2/(m*r^3) - gm*m/r^2"}, "p_phidot"),
        ({"rddot": "r*phidot^2 - gm/r^2"}, "phiddot"),
        (["m*rddot = p_phi^2/(m*r^3) - gm*m/r^2", "p_phi = m*r^2*phidot"], "phiddot"),
        # That p_phi is conserved says nothing of phi, as long as p_phi is not told.
        (["rddot = r*phidot^2 - gm/r^2", "p_phidot = 0"], "phiddot"),
    ],
)
def test_the_variable_that_is_not_determined_is_named(answer: Any, missing: str) -> None:
    outcome = judged(of_document("kepler_polar"), answer)
    assert [(finding.code, finding.place) for finding in outcome.findings] == [("missing_equation", missing)]


def test_mixed_orders_can_leave_a_constant_open() -> None:
    """theta1 in second order, and theta2 by momenta of which one is told by nothing but its rate."""
    first, second = RIGHT["double_pendulum"]
    key = of_document("double_pendulum")
    mixed = texts([second[0], first[1], first[2], first[3]])
    assert codes(judged(key, mixed)) == ["missing_equation"]
    assert judged(key, [*mixed, *texts([first[0]])]).verdict == "correct"


def test_equations_of_first_and_second_order_may_not_be_traded_for_each_other() -> None:
    """m x'' - p' with e = p' + k x left open: e' = -(1 - 1/m) e has solutions besides 0."""
    answer = ["m*xdot - p_x + m*(p_xdot + k*x) = 0", "xddot + k*x/m - (p_xdot + k*x) = 0"]
    assert codes(judged(of_document("notes_spring"), answer)) == ["missing_equation"]


def test_a_literal_key_of_second_order() -> None:
    key = literal({"xddot": "-k*x/m - b*xdot/m"})
    for right in (
        ["m*xddot + b*xdot + k*x = 0"],
        {"xddot": "-(k*x + b*xdot)/m"},
        {"m*xddot": "-k*x - b*xdot"},
    ):
        assert judged(key, right).verdict == "correct"
    assert codes(judged(key, ["m*xddot + b*xdot - k*x = 0"])) == ["sign_error"]
    assert codes(judged(key, ["m*xddot - b*xdot - k*x = 0"])) == ["sign_error"]
    assert codes(judged(key, ["m*xddot + k*x = 0"])) == ["equation_wrong"]
    assert codes(judged(key, ["xdot = xdot"])) == ["missing_equation", "trivial_equation"]


def test_velocities_with_names_of_their_own() -> None:
    options: dict[str, Any] = {"coordinates": ["x"], "velocities": ["v"]}
    for key in (
        literal({"xddot": "-k*x/m - b*v/m"}, **options),
        literal({"xdot": "v", "vdot": "-(k*x + b*v)/m"}, **options),
        literal({"xdot": "v", "vdot": "-(k*x + b*v)/m"}),
    ):
        assert judged(key, ["xdot = v", "m*vdot = -k*x - b*v"]).verdict == "correct"
        assert judged(key, ["m*xddot = -k*x - b*xdot"]).verdict == "correct"
        assert judged(key, ["xdot = v"]).verdict == "partial"
        assert judged(key, ["xdot = -v", "m*vdot = -k*x - b*v"]).verdict == "partial"
        assert judged(key, ["xdot = 2*v", "m*vdot = -k*x - b*xdot"]).verdict != "correct"


def test_a_cotangent_may_be_one_over_a_tangent() -> None:
    first = "thetaddot = sin(2*theta)/2*phidot^2 - g/l*sin(theta)"
    answer = [first, "phiddot = -2*thetadot*phidot/tan(theta)"]
    assert judged(of_document("spherical_pendulum"), answer).verdict == "correct"
    assert (
        judged(of_document("spherical_pendulum"), [first, "tan(theta)*phiddot = -2*thetadot*phidot"]).verdict
        != "correct"
    )


def test_a_literal_key_of_mixed_order() -> None:
    """The radius by its second derivative, the angle by the angular momentum."""
    key = literal({"rddot": "L^2/(m^2*r^3) - k/(m*r^2)", "phidot": "L/(m*r^2)"})
    assert judged(key, ["m*r^2*phidot = L", "m*rddot = m*r*phidot^2 - k/r^2"]).verdict == "correct"
    assert codes(judged(key, ["m*r^2*phidot = L"])) == ["missing_equation"]
    assert judged(key, ["m*r^2*phidot = L", "m*rddot = -m*r*phidot^2 - k/r^2"]).verdict == "partial"


def test_a_literal_key_in_any_form() -> None:
    key = literal(["p_x = m*xdot", "p_xdot + k*x = 0"], symbols={"m": "positive", "k": "positive"})
    assert judged(key, ["m*xddot = -k*x"]).verdict == "correct"
    assert codes(judged(key, ["xdot = p_x/m", "p_xdot = k*x"])) == ["hamilton_sign"]
    assert "`m`" in sentence(judged(key, ["xdot = y"]).findings[0])
    assert "`m`" not in sentence(judged(literal({"xdot": "v/m"}), ["xdot = y"]).findings[0])


def test_a_domain_decides_what_is_equal() -> None:
    answer = ["xdot = sqrt(x^2)"]
    assert judged(literal({"xdot": "x"}), answer).verdict == "incorrect"
    assert judged(literal({"xdot": "x"}, symbols={"x": "positive"}), answer).verdict == "correct"


def test_derived_parameters_may_be_used() -> None:
    document = loads(
        "parameters: {m: 1 kg, k: 4 N/m, w: sqrt(k/m)}\n"
        "system: {coordinates: [x], kinetic: m*xdot**2/2, potential: m*w**2*x**2/2}\n"
    )
    report = hamilton.run(document)
    question = Question.model_validate({"document": "x.yaml", "ask": "hamilton.equations"})
    key = kind.read_key(Asked(question, report["equations"], "", ("hamilton", "equations"), document, report))
    for right in (["xddot = -w^2*x"], ["m*xddot = -k*x"], ["xdot = p_x/m", "p_xdot = -m*w^2*x"]):
        assert judged(key, right).verdict == "correct"
    assert codes(judged(key, ["xddot = -w*x"])) == ["equation_wrong"]


@answers("""
    value
    [0 = 0]  [xdot^2 = 1]  [xdot = xdot]  [xdot = y, xdot = 2]  [a = b]  [xdot = 1/0]  [xdot = ((]
      [xdot = secret(x)]  {xdot: sqrt(-1 - secret^2)}  []  secret
    """)
def test_bad_keys_are_refused(value: Any) -> None:
    with pytest.raises(ValueProblem) as refused:
        literal(value)
    assert "secret" not in refused.value.message
    assert refused.value.message[-1] != "."


def test_a_key_with_a_symbol_that_is_not_declared_is_refused() -> None:
    with pytest.raises(ValueProblem, match="not among the `symbols`") as refused:
        literal({"xdot": "secret*x"}, symbols={"m": "positive"})
    assert "secret" not in refused.value.message


def test_results_that_are_no_equations_are_refused() -> None:
    document = load(CONFIGS / "notes_spring.yaml")
    report = hamilton.run(document)
    question = Question.model_validate({"document": "x.yaml", "ask": "hamilton.momentum_definitions"})
    path = ("hamilton", "momentum_definitions")
    for value in (report["momentum_definitions"], None):
        with pytest.raises(ValueProblem):
            kind.read_key(Asked(question, value, "", path, document, report))


def test_no_reference_is_told_below_full() -> None:
    key = literal({"xdot": "secret*x", "ydot": "hidden*y"})
    first = ["xdot = x", "ydot = y"]
    for answer in (first, ["xdot = z"], ["xdot = 2*t"], ["ydot = x", "xdot = y", "0 = 1"], ["xdot"]):
        outcome = judged(key, answer)
        told = " ".join(sentence(finding) for finding in outcome.findings)
        assert "secret" not in told
        assert "hidden" not in told
    full = sentence(judged(key, first).findings[0], full=True)
    assert "secret*x" in full


@pytest.mark.parametrize("name", [*sorted(KEYS), "top_euler_angles", "chain_20"])
def test_examples_are_judged_as_they_were_made(name: str) -> None:
    key = KEYS[name]() if name in KEYS else of_document(name)
    seen = require_examples("equations", key, alone=False)
    assert {None, "trivial_equation", "constant_factor"} <= seen
    assert ("euler_sign" if name == "euler" else "hamilton_sign") in seen


# --- attacks

FLAT = ("({0})^2", "({0})^3", "sin(0.01*({0}))", "sinh(1e3*({0}))", "log(1 + ({0})^2)")
"""Functions that are zero with their argument, some of them elsewhere, too."""

BUMPS = (
    "exp(-1e6*({0} - 0.123)^2)",
    "(abs({0} - 60) + {0} - 60)",
    "log(1 + exp(1e5*{0}))",
    "({0} - 1)*({0} + 1)*{0}/1e30",
    "0*log({0} + 100)",
    "0/({0} - 1/3)",
    "0*sqrt({0} + 1e3)",
    "0*asin({0}/1e4)",
)
"""What is zero at many states, or has no value at some."""


def attacked(chance: random.Random, key: Key, equations: Sequence[Equation]) -> list[str]:
    """A set that leaves something open, or is not true everywhere, and looks as if it were right."""
    rows = [f"({left}) - ({right})" for left, right in equations]
    place = chance.randrange(len(rows))
    row, others = rows[place], [other for k, other in enumerate(rows) if k != place]
    real = [name for name, domain in key.motion.domains.items() if domain == "real"]
    name, second = chance.choice(real), chance.choice(real)
    vanishing = (f"({name} - 1/3)", f"sin({name} + 1/7)", f"({name} - {second}/2 + 1)", f"(1 + sign({name}))")
    left, right = equations[place]
    rows[place] = chance.choice(
        [
            f"{chance.choice(vanishing)}*({row}) = 0",
            f"{chance.choice(FLAT).format(row)} = 0",
            f"exp({row}) = 1",
            f"({row})*({chance.choice(rows)}) = 0",
            f"({row})*(({left}) - 2*({right})) = 0",
            f"({row})*(({left}) - 1.0001*({right}) - 1e-5) = 0",
            f"{row} + {chance.choice(BUMPS).format(name)} = 0",
            " + ".join(f"{chance.choice(['2', name, 'exp(t)'])}*({other})" for other in others or ["0"])
            + " = 0",
            f"({chance.choice(others or ['0'])})*({row}) = {name}*({chance.choice(others or ['0'])})",
        ]
    )
    return [text if "=" in text else f"{text} = 0" for text in rows]


@many
@given(SEEDS)
def test_attacks_are_never_right(chance: random.Random) -> None:
    key, equations = chosen(chance)
    answer = attacked(chance, key, equations)
    outcome = judged(key, answer)
    assert outcome.verdict in ("incorrect", "partial", "review"), answer
    assert outcome.share < 1


def test_first_order_may_be_asked_for() -> None:
    key = of_document("notes_spring", form="first_order")
    for right in ([*SPRING], ["p_x = m*xdot", "p_xdot = -k*x"], [*SPRING, "m*xddot = -k*x"]):
        assert judged(key, right).verdict == "correct"
    for second in (["m*xddot = -k*x"], ["xdot = p_x/m", "m*xddot = -k*x"]):
        outcome = judged(key, second)
        assert (outcome.verdict, outcome.share, codes(outcome)) == ("incorrect", 0.0, ["second_order_form"])
    assert codes(judged(key, ["m*xddot = k*x"]))[0] == "equation_wrong"
    with pytest.raises(ValueProblem, match="second order"):
        literal({"xddot": "-x"}, form="first_order")


@pytest.mark.parametrize(
    "answer",
    [
        ["xddot = -4*x"],
        ["m*xddot = -4*x"],
        ["xdot = p_x", "p_xdot = -k*x"],
        ["xdot = p_x/m", "p_xdot = -4*x"],
        [*SPRING],
    ],
)
def test_numbers_may_stand_for_parameters(answer: list[str]) -> None:
    assert judged(of_document("notes_spring", numbers="allowed"), answer).verdict == "correct"
    expected = "correct" if answer == [*SPRING] else "number_for_symbol"
    outcome = judged(of_document("notes_spring"), answer)
    assert expected in (outcome.verdict, *codes(outcome))


def test_numbers_are_right_within_the_tolerance() -> None:
    key = of_document("spherical_pendulum", numbers="allowed")
    rest = "sin(theta)*phiddot + 2*cos(theta)*thetadot*phidot = 0"
    for g, verdict in (("9.81", "correct"), ("9.814", "correct"), ("9.9", "partial"), ("-9.81", "partial")):
        first = f"thetaddot = sin(theta)*cos(theta)*phidot^2 - {g}*sin(theta)"
        assert judged(key, [first, rest]).verdict == verdict
    typed = literal({"xddot": "-9.81"}, tolerance={"relative": 1e-2})
    assert judged(typed, ["xddot + 9.8 = 0"]).verdict == "correct"
    assert judged(typed, ["xddot + 9.5 = 0"]).verdict == "incorrect"
    assert judged(typed, ["xddot + 9.81 + exp(-1e6*(x - 0.123)^2) = 0"]).verdict != "correct"


def test_kepler_without_its_radial_equation_is_not_right() -> None:
    key = of_document("kepler_polar")
    rest = [f"{name} = {e}" for name, e in POLAR.items() if name != "p_rdot"]
    for answer in (rest, [*rest, "r*phiddot = -2*rdot*phidot"], [*rest, "p_phi = m*r^2*phidot"]):
        outcome = judged(key, answer)
        assert outcome.verdict == "partial"
        assert codes(outcome) == ["missing_equation"]


@pytest.mark.parametrize(
    "name", ["spherical_pendulum", "relativistic_oscillator", "double_pendulum", "kepler_polar"]
)
def test_momenta_by_their_definitions(name: str) -> None:
    """Momenta as functions of the velocities, and their rates as dL/dq."""
    key = of_document(name)
    rates = {n: e for n, e in key.motion.rates.items() if n in key.motion.auxiliary_rates}
    answer = [f"{p} = {e}" for p, e in key.definitions.items()]
    answer += [f"{n} = {substitute(e, dict(key.definitions))}" for n, e in rates.items()]
    assert judged(key, answer).verdict == "correct"


def test_points_follow_from_the_name_of_the_question() -> None:
    keys = [literal({"xdot": "x"}, name=name) for name in ("a", "b", "a")]
    points = [key.motion.free_point(0).values["x"] for key in keys]
    states = [state(key.motion, 0)["x"] for key in keys]
    assert points[0] == points[2] != points[1]
    assert states[0] == states[2] != states[1]
