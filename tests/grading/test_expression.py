"""Expressions as answers: right in any form, wrong by any change, with the mistake named where it is sure."""

from __future__ import annotations

import json
import pickle
from collections.abc import Mapping
from fractions import Fraction
from functools import cache
from itertools import product
from typing import Any

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from rigidcli.algebra.reading import from_tree
from rigidcli.document.document import Document
from rigidcli.document.load import load, loads
from rigidcli.errors import ValueProblem
from rigidcli.grading.asked import Asked
from rigidcli.grading.expressions.formula import names_in
from rigidcli.grading.expressions.key import Key
from rigidcli.grading.feedback import sentence
from rigidcli.grading.kinds import KINDS
from rigidcli.grading.outcome import Outcome
from rigidcli.grading.question import Question
from rigidcli.language.parser import read as parse
from rigidcli.language.text import text
from rigidcli.language.tree import Node
from rigidcli.report import Report
from rigidcli.studies import axes, hamilton, inertia
from tests.conftest import ROOT
from tests.grading.asking import Asking, cases, require_examples
from tests.grading.rewriting import EXPRESSIONS, POSITIVE, REAL, attacked, in_fractions, mistaken, rewritten
from tests.trees import NoValueError, value

generated = settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large],
)
fewer = settings(generated, max_examples=25)

LONGEST = 15_000
"""Characters of a generated answer: the language has a bound."""

SYMBOLS = dict.fromkeys(POSITIVE, "positive") | dict.fromkeys(REAL, "real")
STUDIES: Mapping[str, Any] = {"hamilton": hamilton.run, "inertia": inertia.run, "axes": axes.run}


def literal(answer: str, **options: Any) -> Key:
    question = Question.model_validate({"answer": answer, "kind": "expression", **options})
    return read_key(Asked(question, answer))


def asked_of(document: Document, report: Report, ask: str, **options: Any) -> Asked:
    study, *way = ask.split(".")
    found: Any = report.tree()
    for step in way:
        found = found[int(step)] if step.isdecimal() else found[step]
    question = Question.model_validate({"document": "it", "ask": ask, **options})
    return Asked(question, found, "", (study, *way), document, report)


def of(source: str, ask: str, **options: Any) -> Key:
    document = loads(source)
    return read_key(asked_of(document, STUDIES[ask.split(".")[0]](document), ask, **options))


@cache
def worked(name: str) -> tuple[Document, Report]:
    document = load(ROOT / "configs" / f"{name}.yaml")
    return document, hamilton.run(document)


@cache
def of_config(name: str, ask: str = "hamilton.hamiltonian", constant: str = "allowed") -> Key:
    return read_key(asked_of(*worked(name), ask, constant=constant))


def outcome(key: Key, answer: object) -> Outcome:
    return Asking("expression").judged(key, answer)


def read_key(asked: Asked) -> Key:
    key: Key = KINDS["expression"].read_key(asked)
    return key


def codes(key: Key, answer: object) -> list[str]:
    return [finding.code for finding in outcome(key, answer).findings]


def is_right(key: Key, answer: object) -> bool:
    return outcome(key, answer).verdict == "correct"


# --- generated answers, to generated keys and to those of documents


@generated
@given(EXPRESSIONS.flatmap(lambda node: st.tuples(st.just(node), rewritten(node))))
def test_another_form_is_right(pair: tuple[Node, Node]) -> None:
    key, answer = map(text, pair)
    assume(len(answer) < LONGEST)
    try:
        made = literal(key, symbols=SYMBOLS)
    except ValueProblem:
        assume(False)
    assert is_right(made, answer), (key, answer)


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


@generated
@given(EXPRESSIONS.flatmap(lambda node: st.tuples(st.just(node), mistaken(node))))
def test_another_function_is_wrong(pair: tuple[Node, Node]) -> None:
    key, answer = pair
    assume(differ(key, answer, POINTS))
    try:
        made = literal(text(key), symbols=SYMBOLS)
    except ValueProblem:
        assume(False)
    assert not is_right(made, in_fractions(text(answer))), (text(key), text(answer))
    if differ(key, answer, POINTS, 1e-2):
        assert not is_right(made, text(answer)), (text(key), text(answer))


@generated
@given(
    EXPRESSIONS.flatmap(lambda node: st.tuples(st.just(node), mistaken(node))).flatmap(
        lambda pair: st.tuples(st.just(pair[0]), st.just(pair[1]), rewritten(pair[1], 4))
    )
)
def test_so_it_is_in_another_form(three: tuple[Node, Node, Node]) -> None:
    key, wrong, answer = three
    assume(differ(key, wrong, POINTS) and len(text(answer)) < LONGEST)
    try:
        made = literal(text(key), symbols=SYMBOLS)
    except ValueProblem:
        assume(False)
    assert not is_right(made, in_fractions(text(answer))), (text(key), text(answer))


CONFIGS = [
    "notes_spring", "double_pendulum", "top_euler_angles", "relativistic_oscillator", "magnetic_particle",
    "elevator_pendulum", "kepler_polar", "caldirola_kanai",
]  # fmt: skip


def in_names_of(key: Key, node: Node) -> bool:
    """Whether a rewriting that puts in x, k or m has left the names of the document."""
    return all(name in key.names.vocabulary.names for name in names_in(node))


@fewer
@given(st.sampled_from(CONFIGS), st.data())
def test_a_hamiltonian_is_right_in_another_form(name: str, data: st.DataObject) -> None:
    key = of_config(name)
    answer = data.draw(rewritten(key.tree))
    assume(in_names_of(key, answer) and len(text(answer)) < LONGEST)
    assert is_right(key, f"{text(answer)}{data.draw(st.sampled_from(['', ' - 5/3']))}")


@fewer
@given(st.sampled_from(CONFIGS), st.data())
def test_a_hamiltonian_with_a_mistake_is_wrong(name: str, data: st.DataObject) -> None:
    key = of_config(name, constant="forbidden")
    tree = key.tree
    answer = data.draw(mistaken(tree))
    names = sorted(names_in(tree) | names_in(answer))
    points = [
        {name: Fraction(3 * place + 2 + 5 * shift, 7 + shift + place) for place, name in enumerate(names)}
        for shift in range(2)
    ]
    assume(in_names_of(key, answer) and differ(tree, answer, points))
    assert not is_right(key, text(answer))


@generated
@given(st.sampled_from([*CONFIGS, "henon_heiles"]), st.sampled_from(["allowed", "forbidden"]), st.data())
def test_what_is_nearly_nothing_is_not_overlooked(name: str, constant: str, data: st.DataObject) -> None:
    key = of_config(name, constant=constant)
    answer = data.draw(attacked(text(key.tree), sorted(key.names.states & names_in(key.tree))))
    assert not is_right(key, answer), answer


PENDULUM = "p_theta^2/(2*m*l^2) - m*g*l*cos(theta)"
OF_PENDULUM = {"coordinates": ["theta"], "momenta": ["p_theta"], "symbols": dict.fromkeys("mgl", "positive")}


@cases("""
    verdict | nothing
    incorrect | m*g*l*log(1 + exp(1e5*theta))  abs(theta - 60) + theta - 60  exp(-1e6*(theta - 0.123)^2)
      m*g*l*sin(1e8*theta)*1e-12  1e-30*theta  1.00e-12*theta  theta - atan(tan(theta))
      theta - exp(log(theta))  m*g*(theta - sqrt(theta)^2)
    invalid | m*g*l*(theta + exp(1e300))/exp(1e300) - m*g*l
    review | abs(theta - 1e9) + theta - 1e9  0*log(1e9 - theta)
    correct | 0  l - sqrt(l)^2
    """)
@pytest.mark.parametrize("constant", ["allowed", "forbidden"])
def test_nothing_may_be_added_to_a_pendulum(nothing: str, verdict: str, constant: str) -> None:
    key = literal(PENDULUM, constant=constant, **OF_PENDULUM)
    assert outcome(key, f"{PENDULUM} + {nothing}").verdict == verdict


def test_what_cannot_be_told_is_left_to_a_person() -> None:
    found = outcome(literal(PENDULUM, **OF_PENDULUM), f"{PENDULUM} + abs(theta - 1e9) + theta - 1e9")
    assert (found.verdict, found.share) == ("review", 0.0)
    assert [finding.code for finding in found.findings] == ["undecided"]
    assert "`theta - 1000000000`" in found.findings[0].detail


def test_a_relativistic_energy_is_no_newtonian_one_whatever_the_speed_of_light() -> None:
    for c in ("c", "299792458", "3e8"):
        key = literal(f"sqrt(p^2*{c}^2 + m^2*{c}^4)", symbols={"m": "positive", "c": "positive"})
        assert is_right(key, f"{c}*sqrt(p^2 + (m*{c})^2)")
        for speed in (c, "299792458", "3e8"):
            assert not is_right(key, f"m*{speed}^2 + p^2/(2*m)")


ASKED = set(product(CONFIGS, ["hamiltonian", "lagrangian", "energy", "dH_dt"]))
"""Results of documents; L alone does not tell T from V where the speed is bounded."""


@pytest.mark.parametrize(("name", "ask"), sorted(ASKED - {("relativistic_oscillator", "energy")}))
def test_a_key_proves_itself(name: str, ask: str) -> None:
    key = pickle.loads(pickle.dumps(of_config(name, f"hamilton.{ask}")))
    seen = require_examples("expression", key)
    assert ask == "dH_dt" or seen >= {None, "sign_error", "constant_factor"}


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
]


@pytest.mark.parametrize(("name", "answer"), TEXTBOOK)
def test_the_forms_of_textbooks(name: str, answer: str) -> None:
    key = of_config(name)
    assert is_right(key, answer)
    for near, far in [("2", "3"), ("cos", "sin"), ("^2", ""), ("-", "+"), ("+", "-"), ("p_", "2*p_")]:
        if near in answer:
            assert not is_right(key, answer.replace(near, far, 1))


def test_the_rest_energy_is_a_constant() -> None:
    kinetic = "sqrt((p_x*c)^2 + (m*c^2)^2) - m*c^2 + k*x^2/2"
    assert is_right(of_config("relativistic_oscillator"), kinetic)
    assert codes(of_config("relativistic_oscillator", constant="forbidden"), kinetic) == ["additive_constant"]


# --- named mistakes, worked by hand

SPRING = """
parameters: {m: 2 kg, k: 8 N/m, w: sqrt(k/m)}
system: {coordinates: [x], kinetic: m*xdot^2/2, potential: k*x^2/2}
"""

H = "p_x^2/(2*m) + k*x^2/2"


@cases("""
    answer
    p_x^2/(2*m) + k*x^2/2  H = p_x^2/(2*m) + k*x^2/2  p_x^2/(2*m) + m*w^2*x^2/2  (px^2 + (m*w*x)^2)/2/m
    w*(p^2/(m*w) + m*w*x^2)/2  0.5*p_x*p_x/m + 0.5*k*x*x  p_x^2/(2*m) + k*x^2/2 + 3
    p_x^2/(2*m) + k*x^2/2 - k/m  p_x^2/(2*m) + k*x^2/2 + w  p_x^2/(2*m) + k*x^2/2 + xdot - xdot
    """)
def test_the_hamiltonian_of_a_spring(answer: str) -> None:
    assert is_right(of(SPRING, "hamilton.hamiltonian"), answer)


@cases("""
    code | answer
    sign_error | -p_x^2/(2*m) - k*x^2/2
    lagrangian_or_potential_sign | p_x^2/(2*m) - k*x^2/2
    kinetic_factor | p_x^2/m + k*x^2/2  p_x^2/(4*m) + k*x^2/2
    potential_wrong | p_x^2/(2*m) + k*x^2  p_x^2/(2*m)
    dimension_mismatch | p_x^2/(2*m) + k*x/2  p_x^2/(2*m) + m*w*x^2/2  m*p_x^2/2 + k*x^2/2
      p_x/(2*m) + k*x^2/2  p_x^2/(2*m) + k*x^2/2 + x*p_x  p_x^2/(2*k) + m*x^3  p_x^2/m + k*x^3
      p_x^2*(m + k) + k/m
    kinetic_term_wrong | k*x^2/2  3*p_x^2/m + k*x^2/2  p_x^2/(2*m) + k*x^2/2 + w*x*p_x
    constant_factor | p_x^2/m + k*x^2
    number_for_symbol | p_x^2/4 + k*x^2/2  p_x^2/4 + 4*x^2
    velocity_in_hamiltonian | m*xdot^2/2 + k*x^2/2  p_x*xdot - m*xdot^2/2 + k*x^2/2
    outside_tolerance | x^2*p_x^2  0  1/0
    """)
def test_mistakes_in_the_hamiltonian_of_a_spring(answer: str, code: str) -> None:
    found = outcome(of(SPRING, "hamilton.hamiltonian"), answer)
    assert found.verdict == "incorrect"
    assert found.share == 0
    assert [finding.code for finding in found.findings] == [code]


def test_a_lagrangian_in_place_of_a_hamiltonian_is_seen() -> None:
    assert codes(of(SPRING, "hamilton.hamiltonian"), "m*xdot^2/2 - k*x^2/2") == [
        "velocity_in_hamiltonian",
        "lagrangian_or_potential_sign",
    ]


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        ("m*xdot^2/2 + k*x^2/2", "potential_sign"),
        ("k*x^2/2 - m*xdot^2/2", "sign_error"),
        ("m*xdot^2 - k*x^2/2", "kinetic_factor"),
        ("m*xdot^2/2 - k*x^2", "potential_wrong"),
        ("3*m*xdot^2 - k*x^2/2", "kinetic_term_wrong"),
        ("m*xdot/2 - k*x^2/2", "dimension_mismatch"),
    ],
)
def test_mistakes_in_the_lagrangian_of_a_spring(answer: str, code: str) -> None:
    assert codes(of(SPRING, "hamilton.lagrangian"), answer) == [code]


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
    key = of(SPRING, f"hamilton.{ask}")
    assert is_right(key, right)
    assert not is_right(key, wrong)
    if ask != "energy":
        assert not is_right(key, f"{right.removeprefix('p_x =')} + 1")


COUPLED = """
parameters: {m: null, k: null, kappa: null}
system:
  coordinates: [x, y]
  kinetic: m*(xdot^2 + ydot^2)/2
  potential: k*x^2/2 + kappa*(x - y)^2/2 + k*y^2/2
"""


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        ("(p_x^2 + p_y^2)/(2*m) + (k + kappa)*(x^2 + y^2)/2", "coupling_term_missing"),
        ("(p_x^2 + p_y^2)/(2*m) + k*(x^2 + y^2)/2 + kappa*(x + y)^2/2", "potential_wrong"),
        ("(p_x^2 + p_y^2)/(2*m) + k*(x^2 + y^2)/2 + kappa*(x - y)^2/2 + 0*t", None),
        ("(p_x^2 + p_y^2)/(2*m) + k*(x^2 + y^2)/2 + kappa*(x - y)^2/2 + t", "potential_wrong"),
    ],
)
def test_coupled_oscillators(answer: str, code: str | None) -> None:
    assert codes(of(COUPLED, "hamilton.hamiltonian"), answer) == ([] if code is None else [code])


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        ("((p_x + B*q*y/2)^2 + (p_y - B*q*x/2)^2 + p_z^2)/(2*m)", None),
        ("((p_x + B*q*y/2)^2 + (p_y - B*q*x/2)^2)/(2*m)", "term_wrong"),
        ("((p_x + B*q*y/2)^2 + (p_y - B*q*x/2)^2)/(2*m) - p_z^2/(2*m)", "term_wrong"),
        ("((p_x - B*q*y/2)^2 + (p_y + B*q*x/2)^2 + p_z^2)/(2*m)", "outside_tolerance"),
        ("(p_x^2 + p_y^2 + p_z^2)/(2*m)", "outside_tolerance"),
    ],
)
def test_a_magnetic_hamiltonian_is_not_taken_apart(answer: str, code: str | None) -> None:
    assert codes(of_config("magnetic_particle"), answer) == ([] if code is None else [code])


def test_numbers_for_symbols_without_values() -> None:
    key = of(
        "parameters: {m: null, k: null}\n" + SPRING.partition("\n")[2].partition("\n")[2],
        "hamilton.hamiltonian",
    )
    assert is_right(key, H)
    for answer, names in [("p_x^2/4 + k*x^2/2", "`m`"), ("p_x^2/4 + 4*x^2 + 1", "`m`, `k`")]:
        found = outcome(key, answer).findings
        assert [(each.code, each.detail) for each in found] == [("number_for_symbol", f"without {names}")]
    for answer in [
        "p_x^2/(2*m)",
        "p_x^2/(2*m) - 3*x^2",
        "p_x^2/(2*m) + 4*x^3",
        "k*x^2/2",
        "5",
        "p_x^2/4 + k*x",
    ]:
        assert "number_for_symbol" not in codes(key, answer), answer


@cases("""
    key | code | answer
    sqrt(k/m) | number_for_symbol | 2  sqrt(4/m)
    sqrt(k/m) | frequency_vs_angular_frequency | 2*pi*sqrt(k/m)  sqrt(k/m)/(2*pi)
    sqrt(k/m) | constant_factor | pi*sqrt(k/m)  6.283*sqrt(k/m)
    sqrt(k/m) | outside_tolerance | -2  k
    m*k | outside_tolerance | 3*k^2
    sqrt(c^2 + m^2) | outside_tolerance | c
    c*sqrt(m^2 + k^2/c^2) - c*m | outside_tolerance | 0.5*k^2/m
    """)
def test_a_lone_expression(key: str, answer: str, code: str) -> None:
    symbols = dict.fromkeys(["k", "m", "c"], "positive")
    assert codes(literal(key, symbols=symbols), answer) == [code]


def test_a_factor_of_a_turn_is_one_of_frequencies_only_where_it_may_be() -> None:
    assert codes(literal("k*x/m", coordinates=["x"]), "2*pi*k*x/m") == ["constant_factor"]
    source = "parameters: {m: 2 kg, k: 8 N/m}\nbody: {shape: cube, side: 2 m, mass: m, anchor: corner}"
    document = loads(source)
    report = inertia.run(document)
    for name, form, code in [
        ("stiffness", "3*k", "constant_factor"),
        ("rate", "sqrt(3*k/m)", "frequency_vs_angular_frequency"),
    ]:
        question = Question.model_validate({"document": "it", "ask": f"inertia.{name}"})
        key = read_key(Asked(question, from_tree(parse(form)[0]), "", ("inertia", name), document, report))
        assert codes(key, f"2*pi*{form}") == [code]


# --- dimensions


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("p_x^2/(2*m) + k*x", "a torque or energy (N m) and a force (N) cannot be added"),
        ("p_x^2/(m + k)", "a mass (kg) and a stiffness (N/m) cannot be added"),
        ("p_x^2/(2*m) + k*x^2/2 + x*sin(x)", "sin of a length (m)"),
        ("p_x^2/(2*m) + k*x^2/2*exp(t)", "exp of a time (s)"),
        ("p_x^2/(2*m)*(1 + x)^t + k*x^2/2", ""),
        ("p_x^2/m + k*x^2 + 3*x", "cannot be added"),
    ],
)
def test_a_sum_of_different_dimensions_is_told_first(answer: str, words: str) -> None:
    found = outcome(of(SPRING, "hamilton.hamiltonian"), answer).findings
    if words:
        assert [finding.code for finding in found] == ["dimension_mismatch"]
        assert words in found[0].detail
    else:
        assert [finding.code for finding in found] != ["dimension_mismatch"]


def test_a_constant_of_another_dimension_is_remarked_on() -> None:
    key = of(SPRING, "hamilton.hamiltonian")
    for constant, remarks in [("3", []), ("m*k^2*0", []), ("m", ["dimension_mismatch"])]:
        found = outcome(key, f"{H} + {constant}")
        assert found.verdict == "correct"
        assert [each.code for each in found.findings if each.code != "additive_constant"] == remarks
    assert codes(key, f"{H} + m") == ["additive_constant", "dimension_mismatch"]


@pytest.mark.parametrize(
    ("name", "right"),
    [
        ("spherical_pendulum", {"theta": "pure number", "phi": "pure number", "p_phi": "angular momentum"}),
        ("kepler_polar", {"r": "length", "phi": "pure number", "p_r": "momentum", "p_phi": "angular"}),
        ("magnetic_particle", {"x": "length", "p_z": "momentum", "ydot": "velocity"}),
        ("henon_heiles", {}),
        ("taylor_13_04", {}),
    ],
)
def test_the_dimensions_of_what_moves_follow_from_the_energies(name: str, right: dict[str, str]) -> None:
    found = of_config(name).names.dimensions
    assert set(found) >= set(right)
    assert right or not found
    for each, words in right.items():
        assert str(found[each]).startswith(words)


@pytest.mark.parametrize(
    "system",
    [
        "{coordinates: [x], kinetic: xdot^2/2, potential: k*x^2/2}",
        "{coordinates: [x], kinetic: m*xdot^2/2, potential: m*x}",
    ],
)
def test_numbers_may_have_dimensions(system: str) -> None:
    key = of(f"parameters: {{m: 2 kg, k: 8 N/m}}\nsystem: {system}", "hamilton.hamiltonian")
    assert "x" not in key.names.dimensions
    assert is_right(key, text(key.tree))


# --- names


TRANSFORM = """
system: {coordinates: [q], kinetic: qdot^2/2, potential: q^2/2}
transform: {old: {q: sqrt(2*P)*sin(Q), p_q: sqrt(2*P)*cos(Q)}, new_variables: [Q, P]}
"""


def test_new_variables_are_known_whether_the_key_holds_them_or_not() -> None:
    key = of(TRANSFORM, "hamilton.transform.hamiltonian")
    for answer in ["P", "P*sin(Q)^2 + P*cos(Q)^2", "(sqrt(2*P)*sin(Q))^2/2 + (sqrt(2*P)*cos(Q))^2/2"]:
        assert is_right(key, answer)
    for answer in ["Q", "P*sin(Q)^2", "sqrt(2*P)", "P^2", "P + Q - 2", "(q^2 + p_q^2)/2"]:
        assert outcome(key, answer).verdict == "incorrect"


@pytest.mark.parametrize("name", ["Q", "P"])
def test_the_names_that_are_told_do_not_depend_on_the_key(name: str) -> None:
    listed = {
        outcome(of(TRANSFORM, f"hamilton.transform.{ask}"), "z").findings[0].detail
        for ask in ("hamiltonian", f"equations.{name}")
    }
    assert all(f"`{each}`" in detail for detail in listed for each in ("Q", "P", "q", "p_q", "t"))
    listed = {
        outcome(of(SPRING, f"hamilton.{ask}"), "z").findings[0].detail
        for ask in (
            "equations.x",
            "equations.p_x",
            "velocity_solutions.xdot",
            "dH_dt",
            "energy",
            "lagrangian",
        )
    }
    assert len(listed) == 1


@pytest.mark.parametrize(
    ("name", "answer"),
    [
        ("double_pendulum", DOUBLE_PENDULUM.replace("p_theta", "p")),
        ("double_pendulum", DOUBLE_PENDULUM.replace("p_theta", "p_")),
        ("double_pendulum", DOUBLE_PENDULUM.replace("theta1", "theta_1").replace("m2", "m_2")),
        ("double_pendulum", DOUBLE_PENDULUM.replace("p_theta", "pθ")),
        ("top_euler_angles", TEXTBOOK[1][1].replace("λ", "λ_")),
    ],
)
def test_names_with_numbers(name: str, answer: str) -> None:
    assert is_right(of_config(name), answer)
    assert not is_right(of_config(name), answer.replace("1", "3", 1))


@pytest.mark.parametrize(
    ("ask", "answer", "code", "detail"),
    [
        ("velocity_solutions.phidot", "phidot", "trivial_equation", "this is what is asked for"),
        ("velocity_solutions.phidot", "p_r*rdot", "outside_tolerance", "read `rdot`"),
        ("equations.phi", "phidot", "trivial_equation", "this is what is asked for"),
        ("equations.p_r", "m*r*phidot^2 - gm*m/r^2", "outside_tolerance", "read `phidot`"),
        ("hamiltonian", "phidot", "velocity_in_hamiltonian", "read `phidot`"),
    ],
)
def test_a_velocity_where_momenta_are_asked(ask: str, answer: str, code: str, detail: str) -> None:
    found = outcome(of_config("kepler_polar", f"hamilton.{ask}"), answer).findings
    assert [finding.code for finding in found] == [code]
    assert detail in found[0].detail


# --- options


def test_a_constant_may_be_forbidden() -> None:
    key = of(SPRING, "hamilton.hamiltonian", constant="forbidden")
    assert is_right(key, H)
    assert codes(key, f"{H} + 3") == ["additive_constant"]
    assert codes(key, f"{H} + k/w") == ["additive_constant"]
    assert codes(of(SPRING, "hamilton.hamiltonian"), f"{H} + 3") == ["additive_constant"]
    assert is_right(of(SPRING, "hamilton.hamiltonian"), f"{H} + 3")


@pytest.mark.parametrize(
    ("options", "right"),
    [
        ({}, False),
        ({"symbols": SYMBOLS}, False),
        ({"momenta": ["p_x"], "coordinates": ["x"]}, True),
        ({"coordinates": ["x"]}, True),
        ({"momenta": ["p_x"], "coordinates": ["x"], "constant": "forbidden"}, False),
    ],
)
def test_a_literal_energy_needs_its_momenta_listed(options: dict[str, Any], right: bool) -> None:
    key = literal(H, **options)
    assert is_right(key, H)
    assert is_right(key, f"{H} + m") == right
    assert not is_right(key, f"{H} + x")
    assert "additive_constant" in codes(key, f"{H} + 2")


def test_domains_decide() -> None:
    real, positive = ({"x": "real"}, {"x": "positive"})
    for key, answer in [("log(x^2)", "2*log(x)"), ("sqrt(x^2)", "x"), ("abs(x)", "x"), ("x", "exp(log(x))")]:
        assert not is_right(literal(key, symbols=real), answer)
        assert is_right(literal(key, symbols=positive), answer)
        assert not is_right(literal(key), answer)
    assert is_right(literal("sin(θ)*cos(θ)", symbols={"θ": "real"}), "sin(2*theta)/2")


@cases("""
    key | verdict | answer
    k*x**2/2 | incorrect | k*x*abs(x)/2
    k*x**2/2 | review | abs(k)*x**2/2
    k*r**2/2 | review | k*r*abs(r)/2
    x_1*q2 | incorrect | sqrt(x_1^2*q2^2)
    p*thetadot | incorrect | abs(p)*thetadot
    sqrt(k/m) | correct | sqrt(k)/sqrt(m)  k/sqrt(k*m)
    log(a/b) | correct | log(a) - log(b)
    m*sqrt(a) | review | sqrt(m^2*a)
    sqrt(p^2 + m^2) | review | m*sqrt(1 + p^2/m^2)
    """)
def test_a_name_that_is_not_listed_may_be_negative(key: str, answer: str, verdict: str) -> None:
    found = outcome(literal(key), answer)
    assert found.verdict == verdict
    if verdict == "review":
        assert "list" in found.findings[0].detail
        assert "`symbols`" in found.findings[0].detail


@cases(
    """
    verdict | answer
    correct | p_x^2/4 + 4*x^2  p_x^2/(2*m) + 4*x^2  p_x^2/4 + k*x^2/2  p_x^2/4 + m*w^2*x^2/2 + 3
      p_x^2/4.00 + 4*x^2  H(x, p) = (p/2)^2 + (w*x)^2
    incorrect | p_x^2/4 + 5*x^2  p_x^2/4 + 4.2*x^2  p_x^2/4 + 4*x^2 + 1e-9*x  p_x^2/4 - 4*x^2
    """,
    ("correct", H),
)
def test_numbers_may_be_allowed_for_symbols(answer: str, verdict: str) -> None:
    key = of(SPRING, "hamilton.hamiltonian", numbers="allowed")
    assert outcome(key, answer).verdict == verdict
    if "4" in answer and verdict == "correct" and "w" not in answer:
        assert not is_right(of(SPRING, "hamilton.hamiltonian"), answer)
    require_examples("expression", key)


def test_points_follow_from_the_name_of_the_question() -> None:
    question = Question.model_validate({"answer": PENDULUM, "kind": "expression", **OF_PENDULUM})
    first, second = (read_key(Asked(question, PENDULUM, name=name)) for name in ("1a", "1b"))
    zeros = "*".join(f"(theta - ({x!r}))" for x in first.function.ground.points.values["theta"].tolist())
    for key in (first, second):
        assert not is_right(key, f"{PENDULUM} + {zeros}")


def test_the_sign_of_a_parameter_follows_from_its_value() -> None:
    source = "parameters: {h: -2, k: 3}\nsystem: {coordinates: [x], hamiltonian: p_x^2/2 + sqrt(h^2*k^2)*x}"
    key = of(source, "hamilton.hamiltonian")
    assert is_right(key, "p_x^2/2 + abs(h)*k*x")
    assert not is_right(key, "p_x^2/2 + h*k*x")


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
    key = literal("m*x^2/3", tolerance=tolerance)
    assert is_right(key, "0.333333333333*m*x^2")
    assert is_right(key, "0.333*m*x^2") == right
    assert not is_right(key, "0.3*m*x^2")


ROUNDED = [
    ("M/3", "0.333*M", None),
    ("M/3", "0.3333*M", None),
    ("M/3", "M/3.00", None),
    ("4*M/3", "1.333*M", None),
    ("M/3", "0.33*M", "precision_insufficient"),
    ("M/3", "0.3*M", "precision_insufficient"),
    ("M/3", "0.334*M", "constant_factor"),
    ("M/3", "0.3334*M", "constant_factor"),
    ("M", "1.001*M", "constant_factor"),
    ("pi*M", "3.14*M", None),
    ("pi*M", "22/7*M", "constant_factor"),
    ("pi*M", "3.15*M", "constant_factor"),
    ("p^2/(2*(m + M/3))", "p^2/(2*(m + 0.333*M))", None),
    ("p^2/(2*(m + M/3))", "0.500*p^2/(m + 0.33*M)", "precision_insufficient"),
    ("p^2/(2*(m + M/3))", "p^2/(2*(m + 0.334*M))", "outside_tolerance"),
    ("cos(2*p/3)*M", "M*cos(0.667*p)", None),
    ("cos(2*p/3)*M", "M*cos(0.668*p)", "outside_tolerance"),
    ("M*(a^2/3 + b^2/12)", "0.333*M*a^2 + 0.0833*M*b^2", None),
    ("M*(a^2/3 + b^2/12)", "0.333*M*a^2 + 0.083*M*b^2", "precision_insufficient"),
    ("M*(a^2/3 + b^2/12)", "0.333*M*a^2 + 0.0833*M*b", "outside_tolerance"),
    ("M*(a^2/3 + b^2/12)", "0.333*M*a^2 + 0.0833*M*b^2 + 1e-6*M", "outside_tolerance"),
    ("cos(M)", "cos(M + 9.81^9)", "outside_tolerance"),
    ("sqrt(1 + cos(9.81^3)^2)*M", "sqrt(1 + cos(9.81^3.003)^2)*M", "precision_insufficient"),
    ("cos((9.81/2)^3)", "cos((9.81/2)^6)", "outside_tolerance"),
    # Exponents and whole numbers are exact, and a decimal cannot stand for a symbol.
    ("M*a^(1/3)", "M*a^0.333", "outside_tolerance"),
    ("333*M/1000", "M/3", "constant_factor"),
    ("M*g", "9.81*M", "number_for_symbol"),
]


@pytest.mark.parametrize(("key", "answer", "code"), ROUNDED)
def test_decimals_are_judged_by_the_digits_that_are_written(key: str, answer: str, code: str | None) -> None:
    assert codes(literal(key), answer) == ([] if code is None else [code])


@fewer
@given(
    st.fractions(Fraction(1, 40), 40, max_denominator=40),
    st.integers(1, 6),
    st.floats(-9.9, 9.9),
    st.sampled_from(["{}*m*x^2 + k*y", "m*(x + {}*y)^2/2", "k*sin({}*x)/m", "m*x^2/({}*k) + 1.00*y"]),
)
def test_a_decimal_is_right_where_it_is_the_nearest(
    number: Fraction, figures: int, off: float, form: str
) -> None:
    """The last digit may be off by half of one, and that must be a thousandth at most."""
    key = literal(form.format(f"({number})"), symbols=SYMBOLS)
    magnitude = len(str(int(number))) if number >= 1 else 0 if number >= Fraction(1, 10) else -1
    decimals = figures - magnitude
    assume(decimals > 0)
    unit = Fraction(1, 10**decimals)
    typed = round((number + unit * Fraction(off)) / unit) * unit
    distance = abs(typed - number)
    assume(typed > 0 and distance)
    limits = (unit / 2, number / 1000)
    assume(all(abs(distance / limit - 1) > Fraction(1, 1000) for limit in limits))
    text_of = f"{float(typed):.{decimals}f}"
    written = len(text_of.replace(".", "").lstrip("0"))
    found = outcome(key, form.format(text_of))
    if distance < unit / 2:
        enough = distance < number / 1000 and written >= 3
        assert found.verdict == ("correct" if enough else "incorrect"), text_of
        assert [finding.code for finding in found.findings] == ([] if enough else ["precision_insufficient"])
    else:
        assert found.verdict == "incorrect", text_of
        assert "precision_insufficient" not in [finding.code for finding in found.findings]


def test_rounded_decimals_with_a_constant() -> None:
    key = of(SPRING, "hamilton.hamiltonian")
    assert codes(key, "0.500*p_x^2/m + 0.500*k*x^2 + 1.25") == ["additive_constant"]
    assert codes(literal(H, coordinates=["x"]), "0.333*1.50*p_x^2/m + k*x^2/2 + 3") == ["additive_constant"]
    assert not is_right(literal(H, coordinates=["x"]), "0.333*p_x^2/m + k*x^2/2")


def test_a_plain_number() -> None:
    assert is_right(literal("2*pi/3"), "pi/1.5")
    assert is_right(literal("2*pi/3"), "2.094")
    assert codes(literal("2*pi/3"), "2.09") == ["precision_insufficient"]
    assert codes(literal("2*pi/3"), "2.095") == ["outside_tolerance"]
    assert is_right(literal("2*pi/3", tolerance={"relative": 1e-3}), "2.094")
    assert is_right(literal("2*pi/3", tolerance={"absolute": 1e-3}), "2.094")
    assert not is_right(literal("2*pi/3", tolerance={"absolute": 1e-4}), "2.094")
    assert codes(literal("2*pi/3"), "-2*pi/3") == ["sign_error"]
    assert codes(literal("2*pi/3"), "2*pi/3 + 1") == ["outside_tolerance"]
    assert is_right(literal("0"), "1 - 1")


def test_exact_and_plain_results_of_other_commands() -> None:
    cube = "parameters: {M: null, a: null}\nbody: {shape: cube, side: a, mass: M, anchor: corner}"
    key = of(cube, "axes.moments.0", kind="expression")
    assert is_right(key, "M*a^2/6")
    assert codes(key, "M*a^2/3") == ["constant_factor"]
    known = of("body: {shape: cube, side: 2, mass: 3, anchor: corner}", "inertia.mass", kind="expression")
    assert is_right(known, "3")
    assert is_right(known, "6/2")
    assert not is_right(known, "3.01")


@pytest.mark.parametrize(
    ("answer", "options", "words"),
    [
        ("m*", {}, "cannot be read"),
        ("log(-m)", {"symbols": {"m": "positive"}}, "value"),
        ("m*x", {"tolerance": {"absolute": 0.1}}, "relative"),
        ("m*x", {"tolerance": {"significant_figures": 3, "figures": "strict"}}, "figures"),
        ("m*x", {"symbols": {"2m": "real"}}, "expected a name"),
    ],
)
def test_a_bad_key_is_refused_without_telling_it(answer: str, options: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueProblem, match=words) as refused:
        literal(answer, **options)
    assert answer not in str(refused.value)


@pytest.mark.parametrize("found", [True, "two, words", [1, 2], {"a": 1}, float("nan")])
def test_what_is_no_expression_cannot_be_asked(found: object) -> None:
    document = loads(SPRING)
    asked = asked_of(document, hamilton.run(document), "hamilton.hamiltonian")
    with pytest.raises(ValueProblem, match="not one expression"):
        read_key(Asked(asked.question, found, "", asked.path, asked.document, asked.report))


# --- what is said


def test_nothing_of_the_key_is_told_below_full() -> None:
    key = of(SPRING, "hamilton.hamiltonian")
    for answer in ["0", "p_x^2", "z", "2x", "p_x^2/4 + 4*x^2", f"-({H})", "m + k", "xdot", f"{H} + 1"]:
        found = outcome(key, answer)
        for finding in found.findings:
            assert "p_x**2" not in json.dumps(sentence(finding))
            if found.verdict == "incorrect":
                assert "expected p_x**2/(2*m) + k*x**2/2" in sentence(finding, full=True)


def test_symbols_are_told_unless_they_give_the_key_away() -> None:
    detail = outcome(of(SPRING, "hamilton.hamiltonian"), "q").findings[0].detail
    assert detail == "read `q`, the symbols are `m`, `k`, `x`, `p_x`, `t`, `w`"
    assert outcome(literal("m*g*h"), "q").findings[0].detail == "read `q`"
    assert (
        "`h`"
        in outcome(literal("m*g", symbols={"m": "positive", "g": "real", "h": "real"}), "q")
        .findings[0]
        .detail
    )


@pytest.mark.parametrize(
    ("answer", "code"),
    [("q", "unknown_symbol"), ("x 2", "parse_error"), (["x"], "wrong_shape"), ("(" * 200, "too_deep"),
     ("x" * 30_000, "too_large"), ("__import__('os').system('id')", "parse_error")],
)  # fmt: skip
def test_what_cannot_be_read_is_invalid(answer: object, code: str) -> None:
    found = outcome(of(SPRING, "hamilton.hamiltonian"), answer)
    assert found.verdict == "invalid"
    assert [finding.code for finding in found.findings] == [code]
