"""Formulas as answers: right in any form, wrong by any change, with the mistake named where it is sure."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cache
from itertools import product
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

from rigidcli.check.judge import Item
from rigidcli.check.reading import Domain, Names, read_expression
from rigidcli.check.same import Formulas
from rigidcli.errors import DocumentError
from rigidcli.language.text import text
from rigidcli.language.tree import Node, names_in
from tests.check.asking import judged
from tests.check.homework import Asking, cases, details
from tests.check.rewriting import EXPRESSIONS, POSITIVE, REAL, attacked, in_fractions, mistaken, rewritten
from tests.conftest import ROOT
from tests.trees import NoValueError, value

every = settings(
    max_examples=300,
    deadline=None,
    derandomize=True,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)
some = settings(every, max_examples=25)

FORMULA = Asking("expression")
DOMAINS: dict[str, Domain] = {**dict.fromkeys(POSITIVE, "positive"), **dict.fromkeys(REAL, "real")}
NAMES = Names(DOMAINS)
FORMULAS = Formulas("q", NAMES)


def told(item: Item, answer: Any) -> str:
    """`correct`, `review`, or the codes of what is wrong."""
    found = FORMULA.told(item, answer).removeprefix("incorrect ").removeprefix("invalid ")
    return found.removesuffix(" undecided")


def is_right(item: Item, answer: Any) -> bool:
    return judged(item, answer).verdict == "correct"


@cache
def of_config(name: str, ask: str = "hamilton.hamiltonian", **options: str) -> Item:
    return FORMULA.computed((ROOT / "configs" / f"{name}.yaml").read_text(), ask, **options)


# --- generated answers

VALUES = (
    ("1.3", "0.7", "0.9", "-1.4", "0.6"),
    ("0.6", "1.9", "-1.1", "0.8", "-1.7"),
    ("2.1", "1.2", "0.4", "1.6", "-0.3"),
)
POINTS = [dict(zip((*POSITIVE, *REAL), map(Fraction, row), strict=True)) for row in VALUES]


def differ(one: Node, other: Node, points: list[dict[str, Fraction]], least: float = 1e-4) -> bool:
    """Whether two trees have different values at a point, by `least` of them."""
    for point in points:
        try:
            a, b = value(one, point), value(other, point)
        except NoValueError:
            continue
        if abs(a - b) > least * max(abs(a), abs(b)) and max(abs(a), abs(b)) < 1e6:
            return True
    return False


def test_of_other_forms_hardly_any_is_left_to_a_person_and_none_is_wrong() -> None:
    # What is drawn comes in clusters of the same form: each counts once.
    seen: dict[tuple[Node, Node], bool | str] = {}

    @settings(every, max_examples=1200)
    @given(EXPRESSIONS.flatmap(lambda node: st.tuples(st.just(node), rewritten(node))))
    def judge(pair: tuple[Node, Node]) -> None:
        seen[pair] = FORMULAS.same(pair[1], pair[0])

    judge()
    assert False not in seen.values()
    assert sum(isinstance(found, str) for found in seen.values()) <= 0.05 * len(seen)


def exact(node: Node) -> Node:
    """A tree with fractions for its decimals, which stand for all that rounds to them."""
    return read_expression(in_fractions(text(node)), NAMES)


@every
@given(EXPRESSIONS.flatmap(lambda node: st.tuples(st.just(node), mistaken(node))))
def test_another_function_is_wrong(pair: tuple[Node, Node]) -> None:
    key, answer = pair
    assume(differ(key, answer, POINTS))
    assert FORMULAS.same(exact(answer), exact(key)) is not True
    if differ(key, answer, POINTS, 0.03):
        assert FORMULAS.same(answer, key) is not True


@settings(every, max_examples=60)
@given(
    EXPRESSIONS.flatmap(lambda node: st.tuples(st.just(node), mistaken(node))).flatmap(
        lambda pair: st.tuples(st.just(pair[0]), st.just(pair[1]), rewritten(pair[1], 4))
    )
)
def test_so_it_is_in_another_form(three: tuple[Node, Node, Node]) -> None:
    key, wrong, answer = three
    assume(differ(key, wrong, POINTS) and len(text(answer)) < 15_000)
    assert FORMULAS.same(exact(answer), exact(key)) is not True


CONFIGS = [
    "notes_spring", "double_pendulum", "top_euler_angles", "relativistic_oscillator", "magnetic_particle",
    "elevator_pendulum", "kepler_polar", "caldirola_kanai",
]  # fmt: skip


@some
@given(st.sampled_from(CONFIGS), st.data())
def test_a_hamiltonian_is_right_in_another_form(name: str, data: st.DataObject) -> None:
    key = of_config(name).key
    answer = data.draw(rewritten(key.tree))
    assume(
        names_in(answer) <= {*key.formulas.names.domains, *key.formulas.names.derived}
        and len(text(answer)) < 15_000
    )
    found = key.formulas.same(answer, key.tree)
    assert found is not False


@some
@given(st.sampled_from(CONFIGS), st.data())
def test_a_hamiltonian_with_a_mistake_is_wrong(name: str, data: st.DataObject) -> None:
    key = of_config(name, constant="forbidden").key
    answer = data.draw(mistaken(key.tree))
    names = sorted(names_in(key.tree) | names_in(answer))
    points = [
        {name: Fraction(3 * place + 2 + 5 * shift, 7 + shift + place) for place, name in enumerate(names)}
        for shift in range(2)
    ]
    assume(set(names) <= {*key.formulas.names.domains, *key.formulas.names.derived})
    assume(differ(key.tree, answer, points, 0.03))
    assert key.formulas.same(answer, key.tree) is not True


@settings(every, max_examples=40)
@given(st.sampled_from([*CONFIGS, "henon_heiles"]), st.sampled_from(["allowed", "forbidden"]), st.data())
def test_what_is_nearly_nothing_is_not_overlooked(name: str, constant: str, data: st.DataObject) -> None:
    item = of_config(name, constant=constant)
    answer = data.draw(
        attacked(text(item.key.tree), sorted(item.key.formulas.names.states & names_in(item.key.tree)))
    )
    assert not is_right(item, answer), answer


PENDULUM = "p_theta^2/(2*m*l^2) - m*g*l*cos(theta)"
OF_PENDULUM: Mapping[str, Any] = {
    "coordinates": ["theta"],
    "momenta": ["p_theta"],
    "symbols": dict.fromkeys("mgl", "positive"),
}


@cases("""
    verdict | nothing
    incorrect | 1e-30*theta  1.00e-12*theta  theta - atan(tan(theta))  m*g*l*sin(1e8*theta)*1e-200
    review | exp(-1e6*(theta - 0.123)^2)  abs(theta - 1e9) + theta - 1e9  theta - exp(log(theta))
    correct | 0  l - sqrt(l)^2
    """)
@pytest.mark.parametrize("constant", ["allowed", "forbidden"])
def test_nothing_may_be_added_to_a_pendulum(nothing: str, verdict: str, constant: str) -> None:
    item = FORMULA.literal(PENDULUM, constant=constant, **OF_PENDULUM)
    assert judged(item, f"{PENDULUM} + {nothing}").verdict == verdict


@pytest.mark.parametrize(
    ("answer", "verdict"),
    [
        ("m*a^2*exp(-1e6*(a - 0.123)^2)", "review"),
        ("m*exp(-1e6*(a - 0.5)^2)", "review"),
        ("m*exp(-800*a)", "incorrect"),
        ("a*(atan(a) + atan(1/a) - pi/2)", "correct"),
        ("0.5*a - a/2", "correct"),
    ],
)
def test_what_is_small_is_not_zero(answer: str, verdict: str) -> None:
    item = FORMULA.literal("0", symbols={"m": "positive", "a": "positive"})
    assert judged(item, answer).verdict == verdict


def test_a_state_whose_rounding_hides_the_other_shows_nothing() -> None:
    """exp(2 gamma t) makes one of two states so large that a change of the small term is lost beside it."""
    item = of_config("caldirola_kanai")
    for edge in range(50, 70):
        assert not is_right(item, f"{text(item.key.tree)} + 1*(abs(p_x - {edge}) + p_x - {edge})")


def test_why_a_person_must_judge_is_said() -> None:
    found = judged(FORMULA.literal(PENDULUM, **OF_PENDULUM), f"{PENDULUM} + abs(theta - 1e9) + theta - 1e9")
    assert (found.verdict, found.share) == ("review", 0.0)
    assert "shows one sign only" in details(found) or "too small" in details(found)


def test_a_relativistic_energy_is_no_newtonian_one_whatever_the_speed_of_light() -> None:
    for c in ("c", "299792458", "3e8"):
        item = FORMULA.literal(f"sqrt(p^2*{c}^2 + m^2*{c}^4)", symbols={"m": "positive", "c": "positive"})
        assert is_right(item, f"{c}*sqrt(p^2 + (m*{c})^2)")
        for speed in (c, "299792458", "3e8"):
            assert not is_right(item, f"m*{speed}^2 + p^2/(2*m)")


DOUBLE_PENDULUM = (
    "(m2*l2^2*p_theta1^2 + (m1 + m2)*l1^2*p_theta2^2 - 2*m2*l1*l2*p_theta1*p_theta2*cos(theta1 - theta2))"
    "/(2*m2*l1^2*l2^2*(m1 + m2*sin(theta1 - theta2)^2))"
    " - (m1 + m2)*g*l1*cos(theta1) - m2*g*l2*cos(theta2)"
)

TEXTBOOK = [
    ("double_pendulum", DOUBLE_PENDULUM),
    (
        "top_euler_angles",
        "p_theta^2/(2*λ1) + (p_φ - p_ψ*cos(θ))^2/(2*λ1*(1 - cos(θ)^2)) + p_ψ^2/(2*λ3) + MR*g*cos(θ)",
    ),
    ("relativistic_oscillator", "sqrt(p^2*c^2 + m^2*c^4) + k*x^2/2"),
    ("magnetic_particle", "((px + q*B*y/2)^2 + (py - q*B*x/2)^2 + pz^2)/(2*m)"),
    (
        "magnetic_particle",
        "(p_x^2 + p_y^2 + p_z^2)/(2*m) - q*B/(2*m)*(x*p_y - y*p_x) + q^2*B^2*(x^2 + y^2)/(8*m)",
    ),
    ("kepler_polar", "(p_r^2 + p_phi^2/r^2)/(2*m) - gm*m/r"),
    ("caldirola_kanai", "exp(-2*γ*t)*p_x^2/(2*m) + exp(2*γ*t)*k*x^2/2"),
    # the same in LaTeX, in products of letters, and otherwise as people write
    ("kepler_polar", r"H = \frac{1}{2m}\left(p_r^2 + \frac{p_\varphi^2}{r^2}\right) - \frac{gm\,m}{r}"),
    ("caldirola_kanai", r"\frac{e^{-2\gamma t}p^2}{2m} + \tfrac12 k\,e^{2\gamma t} x^2"),
    ("relativistic_oscillator", r"\sqrt{p_x^2c^2+m^2c^4}+\frac{kx^2}{2}"),
    ("magnetic_particle", "[(px + qBy/2)^2 + (py - qBx/2)^2 + pz^2]/(2m)"),
    ("notes_spring", "p²/(2m) + ½kx²"),
    ("notes_spring", "H(x, p) = p^2/(2m) + 0,5*k*x^2"),
    ("notes_spring", "$\\mathcal{H} = \\dfrac{p_{x}^{2}}{2\\,m} + \\dfrac{k\\,x^2}{2}$"),
]


@pytest.mark.parametrize(("name", "answer"), TEXTBOOK)
def test_the_forms_of_textbooks(name: str, answer: str) -> None:
    item = of_config(name)
    assert is_right(item, answer)
    if "\\" in answer:
        return
    for near, far in [("2", "3"), ("cos", "sin"), ("^2", ""), ("-", "+"), ("+", "-"), ("p_", "2*p_")]:
        if near in answer:
            assert not is_right(item, answer.replace(near, far, 1))


def test_the_rest_energy_is_a_constant() -> None:
    kinetic = "sqrt((p_x*c)^2 + (m*c^2)^2) - m*c^2 + k*x^2/2"
    assert is_right(of_config("relativistic_oscillator"), kinetic)
    assert told(of_config("relativistic_oscillator", constant="forbidden"), kinetic) == "additive_constant"


# --- named mistakes, worked by hand

SPRING = """
parameters: {m: 2 kg, k: 8 N/m, w: sqrt(k/m)}
system: {coordinates: [x], kinetic: m*xdot^2/2, potential: k*x^2/2}
"""

H = "p_x^2/(2*m) + k*x^2/2"


@cases("""
    code | answer
    correct | p_x^2/(2*m) + k*x^2/2  H = p_x^2/(2*m) + k*x^2/2  p_x^2/(2*m) + m*w^2*x^2/2
      (px^2 + (m*w*x)^2)/2/m  w*(p^2/(m*w) + m*w*x^2)/2  0.5*p_x*p_x/m + 0.5*k*x*x
      p_x^2/(2*m) + k*x^2/2 + xdot - xdot  p²/(2m) + kx²/2  1/2*(p^2/m + mw^2x^2)
    correct additive_constant | p_x^2/(2*m) + k*x^2/2 + 3  p_x^2/(2*m) + k*x^2/2 - k/m
      p_x^2/(2*m) + k*x^2/2 + w  0.500*p_x^2/m + 0.500*k*x^2 + 1.25
    sign_error | -p_x^2/(2*m) - k*x^2/2
    lagrangian_or_potential_sign | p_x^2/(2*m) - k*x^2/2
    kinetic_factor | p_x^2/m + k*x^2/2  p_x^2/(4*m) + k*x^2/2
    term_wrong | p_x^2/(2*m) + k*x^2  p_x^2/(2*m)  k*x^2/2  3*p_x^2/m + k*x^2/2
    outside_tolerance | p_x^2/(2*m) + k*x/2  m*p_x^2/2 + k*x^2/2  p_x/(2*m) + k*x^2/2
      p_x^2/(2*m) + k*x^2/2 + x*p_x  p_x^2/(2*m) + k*x^2/2 + w*x*p_x  x^2*p_x^2  0  1/0
    constant_factor | p_x^2/m + k*x^2
    number_for_symbol | p_x^2/4 + k*x^2/2  p_x^2/4 + 4*x^2
    velocity_in_hamiltonian | m*xdot^2/2 + k*x^2/2  p_x*xdot - m*xdot^2/2 + k*x^2/2  m*xdot^2/2 - k*x^2/2
    """)
def test_the_hamiltonian_of_a_spring(answer: str, code: str) -> None:
    assert told(FORMULA.computed(SPRING, "hamilton.hamiltonian"), answer) == code


@cases("""
    code | answer
    potential_sign | m*xdot^2/2 + k*x^2/2
    sign_error | k*x^2/2 - m*xdot^2/2
    kinetic_factor | m*xdot^2 - k*x^2/2
    term_wrong | m*xdot^2/2 - k*x^2  3*m*xdot^2 - k*x^2/2
    outside_tolerance | m*xdot/2 - k*x^2/2
    correct | ½mẋ² - ½kx²  \\frac{1}{2}m\\dot{x}^2 - \\frac12 k x^2  m/2*(dx/dt)^2 - k x^2/2  ½m x'^2 - ½kx^2
    """)
def test_the_lagrangian_of_a_spring(answer: str, code: str) -> None:
    assert told(FORMULA.computed(SPRING, "hamilton.lagrangian"), answer) == code


@pytest.mark.parametrize(
    ("ask", "right", "wrong"),
    [
        ("momentum_definitions.p_x", "p_x = m*x_dot", "xdot/m"),
        ("velocity_solutions.xdot", "px/m", "px*m"),
        ("equations.p_x", "-m*w^2*x", "k*x"),
        ("dH_dt", "0", "-k*x*xdot"),
        ("dH_dt", "k*x*p_x/m - p_x*k*x/m", "1e-12"),
        ("energy", H, "p_x^2/(2*m)"),
    ],
)
def test_other_results_of_a_document(ask: str, right: str, wrong: str) -> None:
    item = FORMULA.computed(SPRING, f"hamilton.{ask}", kind="expression")
    assert is_right(item, right)
    assert not is_right(item, wrong)
    if ask != "energy":
        assert not is_right(item, f"{right.removeprefix('p_x =')} + 1")


COUPLED = """
parameters: {m: null, k: null, kappa: null}
system:
  coordinates: [x, y]
  kinetic: m*(xdot^2 + ydot^2)/2
  potential: k*x^2/2 + kappa*(x - y)^2/2 + k*y^2/2
"""


@cases("""
    code | answer
    outside_tolerance | (p_x^2 + p_y^2)/(2*m) + k*(x^2 + y^2)/2 + kappa*(x - y)^2/2 + t
    term_wrong | (p_x^2 + p_y^2)/(2*m) + k*(x^2 + y^2)/2 + kappa*(x + y)^2/2
      (p_x^2 + p_y^2)/(2*m) + (k + kappa)*(x^2 + y^2)/2
    correct | (p_x^2 + p_y^2)/(2*m) + k*(x^2 + y^2)/2 + kappa*(x - y)^2/2 + 0*t
      \\frac{p_x^2+p_y^2}{2m}+\\frac{k}{2}(x^2+y^2)+\\frac{\\kappa}{2}(x-y)^2
    """)
def test_coupled_oscillators(answer: str, code: str) -> None:
    assert told(FORMULA.computed(COUPLED, "hamilton.hamiltonian"), answer) == code


@cases("""
    key | code | answer
    sqrt(k/m) | frequency_vs_angular_frequency | 2*pi*sqrt(k/m)  sqrt(k/m)/(2*pi)
    sqrt(k/m) | constant_factor | pi*sqrt(k/m)  6.283*sqrt(k/m)
    sqrt(k/m) | sign_error | -sqrt(k/m)
    sqrt(k/m) | outside_tolerance | -2  k  2
    sqrt(k/m) | correct | sqrt(k)/sqrt(m)  k/sqrt(k m)  \\sqrt{\\frac{k}{m}}  (k/m)^(1/2)  √(k/m)  [k/m]^{0.5}
    sqrt(c^2 + m^2) | outside_tolerance | c
    c*sqrt(m^2 + k^2/c^2) - c*m | outside_tolerance | 0.5*k^2/m
    m*g*z | correct | mgz  m g z  zgm  m·g·z  \\,m\\,g\\,z\\,  U = mgz
    2*m*(1 + c^2) | correct | 2m(1+c^2)  2 m [1 + c²]  2m + 2mc^2
    m*a^2/6 | correct | ma^2/6  \\frac{ma^2}{6}  0.1667 m a^2  m a²/6
    m*a^2/6 | constant_factor | ma^2/12  0.166 m a^2
    """)
def test_a_lone_formula(key: str, answer: str, code: str) -> None:
    item = FORMULA.literal(key, symbols=dict.fromkeys([*"kmcgza"], "positive"))
    assert told(item, answer) == code


# --- how names are read


@cases(r"""
    code | hint | answer
    parse_error | two ways | sin k m  1/2 m  \cos\theta^2
    parse_error | can be read as | mgl
    unknown_symbol | read `q` | q  m q
    unknown_symbol | read `energy` | energy
    parse_error | `\foo` | \foo{m}
    """)
def test_what_has_two_readings_is_refused(answer: str, hint: str, code: str) -> None:
    symbols = dict.fromkeys(["m", "g", "k", "l", "x", "theta", "gl", "mg"], "positive")
    found = judged(FORMULA.literal("m*g", symbols=symbols), answer)
    assert found.verdict == "invalid"
    assert [finding.code for finding in found.findings] == [code]
    assert hint in details(found)


@pytest.mark.parametrize(
    ("name", "answer"),
    [
        ("double_pendulum", DOUBLE_PENDULUM.replace("p_theta", "p")),
        ("double_pendulum", DOUBLE_PENDULUM.replace("p_theta", "p_")),
        ("double_pendulum", DOUBLE_PENDULUM.replace("theta1", "theta_1").replace("m2", "m_2")),
        ("double_pendulum", DOUBLE_PENDULUM.replace("p_theta", "pθ")),
        ("double_pendulum", DOUBLE_PENDULUM.replace("theta1", "θ₁").replace("theta2", "θ₂")),
        ("double_pendulum", DOUBLE_PENDULUM.replace("p_theta1", r"p_{\theta_1}").replace("*", r"\,")),
        ("top_euler_angles", TEXTBOOK[1][1].replace("λ", "λ_")),
        ("top_euler_angles", TEXTBOOK[1][1].replace("λ", r"\lambda_")),
    ],
)
def test_names_with_numbers(name: str, answer: str) -> None:
    assert is_right(of_config(name), answer)
    assert not is_right(of_config(name), answer.replace("1", "3", 1))


TRANSFORM = """
system: {coordinates: [q], kinetic: qdot^2/2, potential: q^2/2}
transform: {old: {q: sqrt(2*P)*sin(Q), p_q: sqrt(2*P)*cos(Q)}, new_variables: [Q, P]}
"""


def test_new_variables_are_known_whether_the_key_holds_them_or_not() -> None:
    item = FORMULA.computed(TRANSFORM, "hamilton.transform.hamiltonian")
    for answer in ["P", "P*sin(Q)^2 + P*cos(Q)^2"]:
        assert is_right(item, answer)
    for answer in ["Q", "P*sin(Q)^2", "sqrt(2*P)", "P^2", "P + Q - 2", "(q^2 + p_q^2)/2"]:
        assert judged(item, answer).verdict == "incorrect"


# --- options


@pytest.mark.parametrize(
    ("options", "right"),
    [
        ({}, False),
        ({"momenta": ["p_x"], "coordinates": ["x"]}, True),
        ({"coordinates": ["x"]}, True),
        ({"momenta": ["p_x"], "coordinates": ["x"], "constant": "forbidden"}, False),
    ],
)
def test_a_literal_energy_needs_its_momenta_listed(options: dict[str, Any], right: bool) -> None:
    item = FORMULA.literal(H, **options)
    assert is_right(item, H)
    assert is_right(item, f"{H} + m") == right
    assert not is_right(item, f"{H} + x")
    assert "additive_constant" in told(item, f"{H} + 2")


def test_domains_decide() -> None:
    for key, answer in [("log(x^2)", "2*log(x)"), ("sqrt(x^2)", "x"), ("abs(x)", "x"), ("x", "exp(log(x))")]:
        assert not is_right(FORMULA.literal(key, symbols={"x": "real"}), answer)
        assert is_right(FORMULA.literal(key, symbols={"x": "positive"}), answer)
        assert not is_right(FORMULA.literal(key), answer)
    assert is_right(FORMULA.literal("sin(θ)*cos(θ)", symbols={"θ": "real"}), "sin(2*theta)/2")


@cases("""
    verdict | answer
    correct | p_x^2/4 + 4*x^2  p_x^2/(2*m) + 4*x^2  p_x^2/4 + k*x^2/2  p_x^2/4 + m*w^2*x^2/2 + 3
      p_x^2/4.00 + 4*x^2  H(x, p) = (p/2)^2 + (w*x)^2
    incorrect | p_x^2/4 + 5*x^2  p_x^2/4 + 4.2*x^2  p_x^2/4 + 4*x^2 + 1e-9*x  p_x^2/4 - 4*x^2
    """)
def test_numbers_may_be_allowed_for_symbols(answer: str, verdict: str) -> None:
    assert (
        judged(FORMULA.computed(SPRING, "hamilton.hamiltonian", numbers="allowed"), answer).verdict == verdict
    )


def test_points_follow_from_the_name_of_the_question_and_the_answer() -> None:
    from rigidcli.check.balls import points

    item = FORMULA.literal(PENDULUM, **OF_PENDULUM)
    zeros = "*".join(
        f"(theta - ({float(point['theta'].mid())!r}))"
        for point in points(item.key.formulas.names.domains, "q")
    )
    assert not is_right(item, f"{PENDULUM} + {zeros}")


def test_the_sign_of_a_parameter_follows_from_its_value() -> None:
    source = "parameters: {h: -2, k: 3}\nsystem: {coordinates: [x], hamiltonian: p_x^2/2 + sqrt(h^2*k^2)*x}"
    item = FORMULA.computed(source, "hamilton.hamiltonian")
    assert is_right(item, "p_x^2/2 + abs(h)*k*x")
    assert not is_right(item, "p_x^2/2 + h*k*x")


# --- decimals


@cases("""
    key | right | answer
    M/3 | yes | 0.333*M  0.3333*M  M/3.00  0.33*M  0,333 M
    M/3 | no | 0.3*M  0.334*M  0.3334*M
    4*M/3 | yes | 1.333*M
    M | no | 1.001*M  1.000000000001*M
    pi*M | yes | 3.14*M  3.1416 M  πM
    pi*M | no | 22/7*M  3.15*M
    0.5*M | yes | M/2  0.50*M
    0.5*M | no | 0.52*M  13*M/25
    9.81*M | yes | 9.81*M  9.8*M  981*M/100
    9.81*M | no | 9.9*M  10*M
    p^2/(2*(m + M/3)) | yes | p^2/(2*(m + 0.333*M))  0.500*p^2/(m + 0.33*M)
    p^2/(2*(m + M/3)) | no | p^2/(2*(m + 0.334*M))
    cos(2*p/3)*M | yes | M*cos(0.667*p)
    cos(2*p/3)*M | no | M*cos(0.668*p)
    M*(a^2/3 + b^2/12) | yes | 0.333*M*a^2 + 0.0833*M*b^2  0.333*M*a^2 + 0.083*M*b^2
    M*(a^2/3 + b^2/12) | no | 0.333*M*a^2 + 0.0833*M*b
    cos((9.81/2)^3) | no | cos((9.81/2)^6)
    M*a^(1/3) | no | M*a^0.3
    M*g | no | 9.81*M
    """)
def test_decimals_stand_for_what_rounds_to_them(key: str, answer: str, right: str) -> None:
    assert is_right(FORMULA.literal(key), answer) == (right == "yes")


@pytest.mark.parametrize(
    ("tolerance", "right"),
    [
        ({}, True),
        ({"relative": 1e-2}, True),
        ({"relative": 1e-4}, False),
        ({"significant_figures": 2}, True),
        ({"significant_figures": 4}, False),
    ],
)
def test_decimals_in_an_answer(tolerance: dict[str, Any], right: bool) -> None:
    item = FORMULA.literal("m*x^2/3", tolerance=tolerance)
    assert is_right(item, "0.333333333333*m*x^2")
    assert is_right(item, "0.333*m*x^2") == right
    assert not is_right(item, "0.3*m*x^2")


@some
@given(
    st.fractions(Fraction(1, 40), 40, max_denominator=40),
    st.integers(2, 6),
    st.floats(-4.9, 4.9),
    st.sampled_from(["{}*m*x^2 + k*y", "m*(x + {}*y)^2/2", "k*sin({}*x)/m", "m*x^2/({}*k) + 1.00*y"]),
)
def test_a_decimal_is_right_where_it_is_the_nearest(
    number: Fraction, figures: int, off: float, form: str
) -> None:
    magnitude = len(str(int(number))) if number >= 1 else 0 if number >= Fraction(1, 10) else -1
    decimals = figures - magnitude
    assume(decimals > 0)
    unit = Fraction(1, 10**decimals)
    typed = round((number + unit * Fraction(off)) / unit) * unit
    distance = abs(typed - number)
    assume(typed > 0 and distance and abs(2 * distance / unit - 1) > Fraction(1, 1000))
    assume(abs(50 * distance / typed - 1) > Fraction(1, 1000))
    item = FORMULA.literal(form.format(f"({number})"), symbols=dict(NAMES.domains))
    right = distance < unit / 2 and distance < typed / 50
    assert is_right(item, form.format(f"{float(typed):.{decimals}f}")) == right


@cases("""
    code | answer
    correct | 2*pi/3  pi/1.5  2.094  2.09  2,094
    outside_tolerance | 2.095  2*pi/3 + 1  2
    sign_error | -2*pi/3
    """)
def test_a_plain_number(answer: str, code: str) -> None:
    assert told(FORMULA.literal("2*pi/3"), answer).replace("constant_factor", "outside_tolerance") == code


def test_exact_results_of_other_commands() -> None:
    cube = "parameters: {M: null, a: null}\nbody: {shape: cube, side: a, mass: M, anchor: corner}"
    item = FORMULA.computed(cube, "axes.moments.0", kind="expression")
    assert is_right(item, "M*a^2/6")
    assert is_right(item, "Ma^2/6")
    assert told(item, "M*a^2/3") == "constant_factor"


# --- what is said


@pytest.mark.parametrize(
    ("answer", "options", "words"),
    [
        ("m*", {}, "cannot be read"),
        ("log(-m)", {"symbols": {"m": "positive"}}, "value"),
        ("m*x", {"tolerance": {"absolute": 0.1}}, "relative"),
        ("m*x", {"symbols": {"2m": "real"}}, "expected a name"),
    ],
)
def test_a_bad_key_is_refused_without_repeating_it(answer: str, options: dict[str, Any], words: str) -> None:
    with pytest.raises(DocumentError, match=words):
        FORMULA.literal(answer, **options)


@pytest.mark.parametrize(
    ("answer", "code"),
    [("q", "unknown_symbol"), ("x 2", "parse_error"), (["x"], "wrong_shape"), ("(" * 200, "too_large"),
     ("x" * 30_000, "too_large"), ("__import__('os').system('id')", "parse_error"), ("9**9**9**9", "")],
)  # fmt: skip
def test_what_cannot_be_read_is_invalid(answer: object, code: str) -> None:
    found = judged(FORMULA.computed(SPRING, "hamilton.hamiltonian"), answer)
    assert found.verdict == ("invalid" if code else "incorrect") or not code
    assert not code or [finding.code for finding in found.findings] == [code]


def test_symbols_are_listed_for_a_stranger() -> None:
    detail = details(judged(FORMULA.computed(SPRING, "hamilton.hamiltonian"), "q"))
    for name in ("m", "k", "x", "p_x", "t", "w"):
        assert f"`{name}`" in detail


@pytest.mark.parametrize(("ask", "name"), sorted(product(["hamiltonian", "lagrangian", "energy"], CONFIGS)))
def test_a_key_is_right_by_itself(name: str, ask: str) -> None:
    if (name, ask) != ("relativistic_oscillator", "energy"):
        item = of_config(name, f"hamilton.{ask}")
        assert is_right(item, item.kind.typed(item.key))
