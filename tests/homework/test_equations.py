"""Equations of motion against textbooks: any equivalent set is right, and no other."""

from __future__ import annotations

import random
import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.errors import DocumentError, ExpressionError
from rigidcli.homework.base import Outcome
from rigidcli.homework.judge import Item
from rigidcli.homework.kinds.equations import state_of
from rigidcli.language.expression import parse
from tests.conftest import ROOT
from tests.homework.asking import Asking, cases, codes, details, judged, typed

EQUATIONS = Asking("equations")

Equation = tuple[str, str]

many = settings(max_examples=25, derandomize=True)


@cache
def of_document(name: str, **options: Any) -> Item:
    """Hamilton's equations of an example."""
    text = (ROOT / "configs" / f"{name}.yaml").read_text()
    return EQUATIONS.computed(
        re.sub(r"(?m)^orbit:\n(?:[ \t]+.*\n|\n)*", "", text), "hamilton.equations", **options
    )


def literal(value: Any, **options: Any) -> Item:
    return EQUATIONS.literal(value, **options)


def texts(equations: Sequence[Equation]) -> list[str]:
    return [f"{left} = {right}" for left, right in equations]


def answers(table: str, *more: Any) -> pytest.MarkDecorator:
    """Tables whose last cells are answers as they stand in a file."""
    return cases(table, *more, read=typed)


EULER: dict[str, Any] = {
    "w1dot": "(I2 - I3)*w2*w3/I1",
    "w2dot": "(I3 - I1)*w3*w1/I2",
    "w3dot": "(I1 - I2)*w1*w2/I3",
}
"""Torque-free rotation: L. D. Landau, E. M. Lifshitz, Mechanics, equation 36.5."""


def of(name: str) -> Item:
    """A question by the name of its motion."""
    return literal(EULER) if name == "euler" else of_document(name)


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
            # The momenta as they are defined, and the derivatives of L, quadratic in the velocities.
            """p_theta1 = (m1 + m2)*l1^2*theta1dot + m2*l1*l2*cos(theta1 - theta2)*theta2dot;
            p_theta2 = m2*l2^2*theta2dot + m2*l1*l2*cos(theta1 - theta2)*theta1dot;
            p_theta1dot = -m2*l1*l2*theta1dot*theta2dot*sin(theta1 - theta2) - (m1 + m2)*g*l1*sin(theta1);
            p_theta2dot = m2*l1*l2*theta1dot*theta2dot*sin(theta1 - theta2) - m2*g*l2*sin(theta2)""",
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


def states(item: Item) -> list[str]:
    """The names on which a motion depends."""
    key = item.key
    given = {*key.formulas.names.derived, *key.meanings}
    return sorted({*key.formulas.names.domains, *map(state_of, key.rates)} - given)


def rearranged(chance: random.Random, item: Item, equations: Sequence[Equation]) -> list[str]:
    """An equivalent set: in another order, added to each other, multiplied, and moved to one side."""
    second = any("ddot" in left for left, _ in equations)
    # Of second order, equations say nothing of momenta.
    names = sorted(set(states(item)) - (set(item.key.momenta) if second else set()))
    names = [name for name in names if not name.endswith("dot") or second]
    factors = ["2", "3/7", "-1", "pi"]
    for name in names:
        factors += [f"exp({name}/3)", f"(1 + {name}^2)", f"cosh({name})", f"1/(2 + cos({name}))"]
    factors += [name for name in names if item.key.formulas.names.domains.get(name) == "positive"]
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
        text = f"({common})*({one}) = ({common})*({two})"
        result.append(text.replace("*", " * ") if chance.random() < 0.3 else text)
    return result


def value_at(text: str, point: Mapping[str, float]) -> float | None:
    try:
        return float(parse(text).evaluate(point))
    except ExpressionError:
        return None


def differs(a: str, b: str, item: Item) -> bool:
    """Whether two expressions are different functions, by single values."""
    chance = random.Random(1)
    names = {*item.key.formulas.names.domains, *item.key.formulas.names.derived}
    for _ in range(20):
        point = {name: chance.uniform(0.3, 1.7) for name in names}
        x, y = value_at(a, point), value_at(b, point)
        if x is not None and y is not None and abs(x - y) > 1e-6 * (abs(x) + abs(y)):
            return True
    return False


def spoiled(chance: random.Random, item: Item, equations: Sequence[Equation]) -> list[Equation]:
    """A set with one thing wrong: a sign, a factor, a symbol, a term, or an equation that says nothing."""
    place = chance.randrange(len(equations))
    left, right = equations[place]
    known = [name for name in states(item) if not name.endswith("dot")]
    names = sorted({*re.findall(r"[A-Za-z_]\w*", right)} & {*known})
    changes = [
        (left, f"-({right})"),
        (left, f"{chance.choice(['2', '1/2', '(1 + 1e-5)', '99/100'])}*({right})"),
        (left, f"{right} + {chance.choice(known)}/1000"),
        (f"{left} + {chance.choice(known)}", right),
    ]
    if names:
        name = chance.choice(names)
        other = chance.choice([*known, "2", "0"])
        changes.append((left, re.sub(rf"\b{name}\b", other, right)))
        changes.append((left, re.sub(rf"\b{name}\b", f"{name}^2", right)))
    changes = [(a, b) for a, b in changes if differs(f"({a}) - ({b})", f"({left}) - ({right})", item)]
    result = list(equations)
    kinds = chance.choice(["change", "change", "change", "drop", "trivial", "repeat"])
    if kinds == "change":
        result[place] = chance.choice(changes)
    elif kinds == "trivial":
        x = known[0]
        result[place] = chance.choice([("0", "0"), (left, left), (f"({left})*{x}", f"{x}*({left})")])
    elif kinds == "repeat" and len(result) > 1:
        a, b = result[place - 1]
        result[place] = (f"2*({a})", f"2*({b})")
    else:
        result[place] = result.pop() if len(result) > place + 1 else ("1", "1")
    return result


@pytest.mark.parametrize(("name", "place"), SETS)
def test_textbook_equations_are_right(name: str, place: int) -> None:
    outcome = judged(of(name), texts(RIGHT[name][place]))
    assert outcome.verdict == "correct", outcome
    second = all("ddot" in left for left, _ in RIGHT[name][place])
    assert codes(outcome) == (["second_order_form"] if second and name != "euler" else [])


SEEDS = st.integers(0, 2**32).map(random.Random)


@many
@given(SEEDS)
def test_rearranged_equations_are_right(chance: random.Random) -> None:
    name, place = chance.choice(SETS)
    answer = rearranged(chance, of(name), RIGHT[name][place])
    outcome = judged(of(name), answer)
    # Of honest forms, hardly one in twenty may go to a person; sums of rows in several factors do.
    assert outcome.verdict in ("correct", "review"), (answer, outcome)


def test_of_rearranged_equations_hardly_any_goes_to_a_person() -> None:
    chance = random.Random(3)
    found = []
    for _ in range(40):
        name, place = chance.choice(SETS)
        answer = rearranged(chance, of(name), RIGHT[name][place])
        found.append((judged(of(name), answer).verdict, name, answer))
    assert all(verdict in ("correct", "review") for verdict, *_ in found), found
    assert sum(verdict == "review" for verdict, *_ in found) <= 2, [f for f in found if f[0] != "correct"]


@many
@given(SEEDS)
def test_spoiled_equations_are_not_right(chance: random.Random) -> None:
    name, place = chance.choice(SETS)
    item = of(name)
    answer = spoiled(chance, item, RIGHT[name][place])
    for form in (texts(answer), rearranged(chance, item, answer)):
        outcome = judged(item, form)
        assert outcome.verdict in ("incorrect", "partial", "review"), (form, outcome)
        assert outcome.share < 1


@settings(many, max_examples=20)
@given(st.data())
def test_what_follows_from_the_equations_may_stand_beside_them(data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(sorted(RIGHT)))
    whole = data.draw(st.sampled_from(RIGHT[name]))
    every = [equation for equations in RIGHT[name] for equation in equations]
    more = data.draw(st.lists(st.sampled_from(every), max_size=4))
    assert judged(of(name), texts([*whole, *more])).verdict == "correct"


def first(outcome: Outcome) -> str:
    return codes(outcome)[0] if outcome.findings else ""


def test_shots_in_the_dark_earn_nothing_and_learn_nothing() -> None:
    guesses = [f"p_xdot = {c}*k*x/{d}" for c in (-2, -1, 1, 2) for d in (1, 2, 3, 4, 5)]
    outcome = judged(of_document("notes_spring"), ["xdot = p_x/m", *guesses])
    assert (outcome.verdict, outcome.share) == ("incorrect", 0.0)
    assert codes(outcome) == ["equation_wrong"]
    assert not any(place in details(outcome) for place in ("equation 2", "equation 9"))


@answers(
    """
    code | words | answer
    unknown_symbol | `y` | [xdot = y]
    parse_error | no `=` | [xdot]
    parse_error | empty | ['xdot = ']  [= p_x/m]
    parse_error | was not opened | [xdot = p_x/m)]
    wrong_shape | expression | {xdot: [p_x/m]}
    wrong_shape | expected equations | []  {}
    """,
    ("too_large", "deeper", ["x = " + "(" * 101 + "x"]),
    ("too_large", "characters", ["x = " + "1+" * 10_000 + "1"]),
    ("too_large", "201 equations", ["0 = 0"] * 201),
)
def test_what_cannot_be_read(answer: Any, code: str, words: str) -> None:
    outcome = judged(of_document("notes_spring"), answer)
    assert (outcome.verdict, codes(outcome)) == ("invalid", [code])
    assert words in details(outcome)


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


@answers("""
    name | factor | answer
    # d/dt of the energy: m x' x'' + k x x' = 0.
    notes_spring | xdot | [m*xdot*xddot + k*x*xdot = 0]  [xdot*(p_xdot + k*x) = 0, xdot = p_x/m]
    notes_spring | x | [x*(p_xdot + k*x) = 0, xdot = p_x/m]  [x*xdot = x*p_x/m, p_xdot = -k*x]
    notes_spring | sin(x) | [sin(x)*p_xdot = -k*x*sin(x), xdot = p_x/m]
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
    outcome = judged(of(name), answer)
    assert outcome.verdict == "review"
    assert f"`{factor}`" in details(outcome) or "linear" in details(outcome)


@pytest.mark.parametrize(
    ("answer", "missing"),
    [
        ({"rdot": "p_r/m", "phidot": "p_phi/(m*r^2)", "p_rdot": "p_phi^2/(m*r^3) - gm*m/r^2"}, "p_phidot"),
        ({"rddot": "r*phidot^2 - gm/r^2"}, "phiddot"),
        # That p_phi is conserved says nothing of phi, as long as p_phi is not given.
        (["rddot = r*phidot^2 - gm/r^2", "p_phidot = 0"], "phiddot"),
    ],
)
def test_the_variable_that_is_not_determined_is_named(answer: Any, missing: str) -> None:
    found = judged(of_document("kepler_polar"), answer).findings
    assert found[0].code == "missing_equation"
    assert missing in found[0].place or "phidot" in found[0].place


def test_mixed_orders_can_leave_a_constant_open() -> None:
    """theta1 in second order, and theta2 by momenta of which one is given by nothing but its rate."""
    first_order, second, _ = RIGHT["double_pendulum"]
    mixed = texts([second[0], first_order[1], first_order[2], first_order[3]])
    assert first(judged(of_document("double_pendulum"), mixed)) == "missing_equation"
    whole = [*mixed, *texts([first_order[0]])]
    assert judged(of_document("double_pendulum"), whole).verdict == "correct"


@answers("""
    value
    [0 = 0]  [xdot^2 = 1]  [xdot = xdot]  [xdot = y, xdot = 2]  [a = b]  [xdot = 1/0]  [xdot = ((]
      {xdot: sqrt(-1 - secret^2)}  []  secret
    """)
def test_bad_keys_are_refused_without_repeating_them(value: Any) -> None:
    with pytest.raises(DocumentError) as refused:
        literal(value)
    assert "secret" not in str(refused.value)


def test_a_key_of_second_order_is_refused_where_first_order_is_asked_for() -> None:
    with pytest.raises(DocumentError, match="second order"):
        literal({"xddot": "-x"}, form="first_order")


def test_a_key_whose_velocity_has_another_name_says_what_it_is() -> None:
    with pytest.raises(DocumentError, match=r"do not say what `v` is\n *hint: write them with `xdot: v`"):
        literal({"xddot": "-x - v"}, coordinates=["x"], velocities=["v"])


def test_results_that_are_no_equations_are_refused() -> None:
    text = (ROOT / "configs/notes_spring.yaml").read_text()
    with pytest.raises(DocumentError, match="no equations of motion"):
        EQUATIONS.computed(text, "hamilton.momentum_definitions", kind="equations")


@pytest.mark.parametrize("name", [*RIGHT, "top_euler_angles", "spherical_pendulum"])
def test_a_key_is_right_by_itself(name: str) -> None:
    item = of(name)
    assert judged(item, item.kind.typed(item.key)).verdict == "correct"


# --- attacks

FLAT = ("({0})^2", "({0})^3", "sin(0.01*({0}))", "sinh(1e3*({0}))", "log(1 + ({0})^2)")
"""Functions that are zero with their argument, some of them elsewhere, too."""

BUMPS = (
    "exp(-1e6*({0} - 0.123)^2)",
    "(abs({0} - 60) + {0} - 60)",
    "log(1 + exp(1e5*{0}))",
    "({0} - 1)*({0} + 1)*{0}/1e30",
)
"""What is zero at many states, and not everywhere."""


def attacked(chance: random.Random, item: Item, equations: Sequence[Equation]) -> list[str]:
    """A set that leaves something open, or is not true everywhere, and looks as if it were right."""
    rows = [f"({left}) - ({right})" for left, right in equations]
    place = chance.randrange(len(rows))
    row, others = rows[place], [other for k, other in enumerate(rows) if k != place]
    real = [
        n
        for n in states(item)
        if item.key.formulas.names.domains.get(n) == "real" and not n.endswith("dot") and n != "t"
    ]
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


@settings(many, max_examples=60)
@given(SEEDS)
def test_attacks_are_never_right(chance: random.Random) -> None:
    name, place = chance.choice(SETS)
    answer = attacked(chance, of(name), RIGHT[name][place])
    outcome = judged(of(name), answer)
    assert outcome.verdict in ("incorrect", "partial", "review", "invalid"), answer
    assert outcome.share < 1
