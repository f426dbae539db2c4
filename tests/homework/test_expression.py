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

from rigidcli.errors import DocumentError
from rigidcli.homework.judge import Item
from rigidcli.homework.reading import Domain, Names, read_expression
from rigidcli.homework.same import FormulaComparison
from rigidcli.language.text import text
from rigidcli.language.tree import Node, names_in
from tests.conftest import ROOT
from tests.homework.asking import Asking, cases, details, judged
from tests.homework.rewriting import EXPRESSIONS, POSITIVE, REAL, attacked, in_fractions, mistaken, rewritten
from tests.tables import rows_of
from tests.trees import NoValueError, value

every = settings(
    max_examples=120,
    derandomize=True,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)
some = settings(every, max_examples=25)

FORMULA = Asking("expression")
DOMAINS: dict[str, Domain] = {**dict.fromkeys(POSITIVE, "positive"), **dict.fromkeys(REAL, "real")}
NAMES = Names(DOMAINS)
FORMULAS = FormulaComparison("q", NAMES)


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

    @settings(every, max_examples=400)
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


def test_a_state_whose_rounding_hides_the_other_shows_nothing() -> None:
    """exp(2 gamma t) makes one of two states so large that a change of the small term is lost beside it."""
    item = of_config("caldirola_kanai")
    for edge in range(50, 70):
        assert not is_right(item, f"{text(item.key.tree)} + 1*(abs(p_x - {edge}) + p_x - {edge})")


def test_why_a_person_must_judge_is_said() -> None:
    found = judged(FORMULA.literal(PENDULUM, **OF_PENDULUM), f"{PENDULUM} + abs(theta - 1e9) + theta - 1e9")
    assert (found.verdict, found.share) == ("review", 0.0)
    assert "never changed in the tests" in details(found) or "too small" in details(found)


DOUBLE_PENDULUM = (
    "(m2*l2^2*p_theta1^2 + (m1 + m2)*l1^2*p_theta2^2 - 2*m2*l1*l2*p_theta1*p_theta2*cos(theta1 - theta2))"
    "/(2*m2*l1^2*l2^2*(m1 + m2*sin(theta1 - theta2)^2))"
    " - (m1 + m2)*g*l1*cos(theta1) - m2*g*l2*cos(theta2)"
)

TEXTBOOK = rows_of(__file__, "textbook")


@pytest.mark.parametrize(("name", "answer"), TEXTBOOK)
def test_the_forms_of_textbooks(name: str, answer: str) -> None:
    item = of_config(name)
    assert is_right(item, answer)
    if "\\" in answer:
        return
    for near, far in [("2", "3"), ("cos", "sin"), ("^2", ""), ("-", "+"), ("+", "-"), ("p_", "2*p_")]:
        if near in answer:
            assert not is_right(item, answer.replace(near, far, 1))


SPRING = """
parameters: {m: 2 kg, k: 8 N/m, w: sqrt(k/m)}
system: {coordinates: [x], kinetic: m*xdot^2/2, potential: k*x^2/2}
"""

H = "p_x^2/(2*m) + k*x^2/2"


# --- how names are read


@cases(r"""
    code | hint | answer
    unknown_symbol | read `q` | q  m q
    unknown_symbol | read `energy` | energy
    parse_error | `\foo` | \foo{m}
    """)
def test_what_cannot_be_read_is_refused_with_the_reason(answer: str, hint: str, code: str) -> None:
    symbols = dict.fromkeys(["m", "g", "k", "l", "x", "theta", "gl", "mg"], "positive")
    found = judged(FORMULA.literal("m*g", symbols=symbols), answer)
    assert found.verdict == "invalid"
    assert [finding.code for finding in found.findings] == [code]
    assert hint in details(found)


@pytest.mark.parametrize(
    ("name", "answer"),
    rows_of(__file__, "names with numbers"),
)
def test_names_with_numbers(name: str, answer: str) -> None:
    assert is_right(of_config(name), answer)
    assert not is_right(of_config(name), answer.replace("1", "3", 1))


# --- options


def test_points_follow_from_the_name_of_the_question_and_the_answer() -> None:
    from rigidcli.homework.same import points

    item = FORMULA.literal(PENDULUM, **OF_PENDULUM)
    zeros = "*".join(
        f"(theta - ({float(point['theta'].mid())!r}))"
        for point in points(item.key.formulas.names.domains, "q")
    )
    assert not is_right(item, f"{PENDULUM} + {zeros}")


# --- decimals


@some
@given(
    st.fractions(Fraction(1, 40), 40, max_denominator=40),
    st.integers(2, 6),
    st.floats(-4.9, 4.9),
    # With a second decimal, the last digit of either may make up for an error of the other.
    st.sampled_from(["{}*m*x^2 + k*y", "m*(x + {}*y)^2/2", "k*sin({}*x)/m", "m*x^2/({}*k) + y"]),
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
    # One that is cut instead of rounded is off by less than one unit; near to one, the table holds cases.
    assume(abs(distance / unit - 1) > Fraction(1, 20))
    right = (distance < unit / 2 or 0 < number - typed < unit) and distance < typed / 50
    assert is_right(item, form.format(f"{float(typed):.{decimals}f}")) == right


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


@pytest.mark.parametrize("key", ["momenta", "velocities"])
def test_momenta_need_the_coordinates_to_which_they_belong(key: str) -> None:
    for coordinates in ([], ["x"]):
        listed = {key: ["p", "q"][: len(coordinates) + 1], "coordinates": coordinates}
        with pytest.raises(DocumentError, match="expected as many of both"):
            FORMULA.literal("p^2/(2*m) + k*x^2/2", **listed)
