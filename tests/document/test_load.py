"""Documents as they are refused: every problem with its line and key, all at once, in a student's words."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import pytest
import yaml

from rigidcli.document.document import Document
from rigidcli.document.load import load, loads
from rigidcli.errors import DocumentError, Problem, UsageError
from tests.tables import rows_of

CUBE = "body: {shape: cube, side: 1, mass: 12}\n"


def problems(text: str, settings: Sequence[str] = (), *, exact: bool = False) -> list[Problem]:
    """What is wrong with a text, in the order in which it is told."""
    with pytest.raises(DocumentError) as caught:
        loads(text, source="f.yaml", settings=settings, exact=exact)
    return list(caught.value.problems)


def places(text: str, settings: Sequence[str] = ()) -> list[tuple[int | None, str]]:
    """Line and key path of every problem of a text."""
    return [(problem.line, problem.key) for problem in problems(text, settings)]


def told(text: str, settings: Sequence[str] = ()) -> str:
    """Message and hint of the one problem of a text."""
    (problem,) = problems(text, settings)
    return f"{problem.message} {problem.hint or ''}"


def mass(document: Document) -> object:
    return document.physical.properties.mass


# --- where


EVERYTHING_WRONG = """\
name: [5]
parameters:
  a: 2
  b: zz
bodyy: 1
body:
  parts:
    - shape: box
      size: [1, a,
        -3]
      mass: 5 s
    - {shape: cylinder, radius: 0, hight: 1,
       mass: true}
    - shape: cyl
      radius: 1
    - points:
        - [1, 2, 3, 4]
        - {mass: -2, position: [0, 0]}
        - [1, 2, 3]
about: [1, x, 2]
frame: {axis: [0, 0, 1], angle: 3 cm}
motion:
  omega: [5 Hz, 0, 0]
  basis: space
"""


def test_all_problems_are_told_at_once_each_with_its_line_and_key() -> None:
    assert places(EVERYTHING_WRONG) == [
        (1, "name"),
        (4, "parameters.b"),
        (5, "bodyy"),
        (10, "body.parts.0.size.2"),
        (11, "body.parts.0.mass"),
        (12, "body.parts.1.hight"),
        (12, "body.parts.1.radius"),
        (13, "body.parts.1.mass"),
        (14, "body.parts.2.shape"),
        (18, "body.parts.3.points.1.mass"),
        (18, "body.parts.3.points.1.position"),
        (19, "body.parts.3.points.2"),
        (20, "about.1"),
        (21, "frame.angle"),
        (23, "motion.omega.0"),
        (24, "motion.basis"),
    ]


def test_a_problem_is_one_line_with_file_line_key_what_was_read_and_what_was_expected() -> None:
    with pytest.raises(DocumentError) as caught:
        loads("name: cube\n\nbody:\n  shape: cube\n  sde: 1\n  side: -2\n  mass: 1\n", source="cube.yaml")
    assert str(caught.value).splitlines() == [
        "cube.yaml:5: body.sde: unknown key (did you mean side?)",
        "cube.yaml:6: body.side: read `-2`, expected a positive length (m)",
    ]


def test_problems_found_in_the_whole_body_have_a_place_too() -> None:
    text = (
        "body:\n  parts:\n    - {shape: cube, side: 1, mass: 1}\n"
        "    - {shape: cube, side: 0.1, mass: 0.001, position: [3, 0, 0], hole: true}\n"
    )
    assert places(text) == [(4, "body.parts.1")]
    assert places("\nbody:\n  moments: [1, 1, 3]\n") in ([(2, "body")], [(3, "body.moments")])
    skew = "body:\n  mass: 1\n  inertia: [[1, 0, 0], [0, 1, 0], [0, 1, 1]]\n"
    assert places(skew) == [(3, "body.inertia")]


# --- what: types, lists, forms


@pytest.mark.parametrize("line", ["name: null", "description: null", "frame: null", "motion:", "name: ''"])
def test_an_optional_key_may_be_left_empty(line: str) -> None:
    assert mass(loads(f"{CUBE}{line}\n")) == 12


def test_quoted_numbers_are_numbers_where_numbers_stand() -> None:
    assert mass(loads('body: {shape: cube, side: "1", mass: "1.2e1"}')) == 12


# --- quantities


VALUES = "parameters: {a: 3, m: 2, g: 10, h: 0.5, x_0: 4, b: 1}\n"


@pytest.mark.parametrize(
    ("value", "expected", "note"),
    rows_of(__file__, "a length as people write it"),
)
def test_a_length_as_people_write_it(value: str, expected: float, note: str) -> None:
    """A letter after a number is a unit or a parameter."""
    document = loads(f"{VALUES}body: {{points: [[1, '{value}', 0, 0]]}}")
    assert document.physical.properties.com[0] == expected
    assert "".join(line for line in document.notes if "not used" not in line) == note


# --- parameters


def test_parameters_are_used_in_any_order() -> None:
    text = "parameters: {c: b + 1 , b: 2*a, a: 5 cm}\nbody: {points: [[1, a, b, c]]}"
    assert list(loads(text).physical.properties.com) == [0.05, 0.1, 1.1]


def test_a_circle_is_shown_and_hides_no_other_problem() -> None:
    found = problems(f"parameters: {{a: b, b: a, c: zz, d: 5 parsnips}}\nnamee: x\n{CUBE}")
    keys = [problem.key for problem in found]
    assert {"parameters.c", "parameters.d", "namee"} < {*keys}
    assert found[keys.index("parameters.a")].message == "parameters in a circle: a -> b -> a"


@pytest.mark.parametrize(
    "value", ["zz", "1/0", "5 parsnips", "2*", "5cmm", "''", "true", "[1]", ".inf", "sqrt(-1)", "1e300*1e300"]
)
def test_a_broken_parameter_is_one_problem_however_often_it_is_used(value: str) -> None:
    text = f"parameters: {{a: {value}, b: a + 1, c: 2*b}}\nbody: {{points: [[a, b, c, a], [c, a, a, b]]}}"
    assert places(text) == [(1, "parameters.a")]


@pytest.mark.parametrize(
    "body",
    rows_of(__file__, "what uses a broken parameter is not to blame"),
)
@pytest.mark.parametrize("value", ["1/0", "[1]", "b"])
def test_what_uses_a_broken_parameter_is_not_to_blame(body: str, value: str) -> None:
    text = f"parameters: {{a: {value}, b: a}}\nbody: {body}\ntop: {{spin: 1, tilt: 4*a}}"
    assert {key.partition(".")[0] for _, key in places(text)} == {"parameters"}


def test_a_missing_value_is_not_the_fault_of_what_needs_it() -> None:
    text = """\
parameters: {m: null, T: null}
system: {coordinates: [x], lagrangian: m*xdot**2/2}
orbit: {initial: {x: T - 1, p_x: 0}, duration: T - 1}
"""
    assert places(text) == [(1, "parameters.T")]


def test_a_broken_parameter_is_one_problem_beside_symbols() -> None:
    text = "parameters: {m: null, a: nope}\nbody: {shape: cube, side: a, mass: m*a}"
    assert places(text) == [(1, "parameters.a")]


@pytest.mark.parametrize(
    "name", ["E", "I", "S", "N", "Q", "beta", "gamma", "lambda", "O", "e", "i", "j", "d", "x1_2"]
)
def test_ordinary_names_are_ordinary(name: str) -> None:
    text = f"parameters: {{{name}: 3}}\nbody: {{shape: cube, side: 1, mass: 2*{name}}}"
    assert mass(loads(text)) == 6
    assert str(mass(loads(text, exact=True))) == "6"
    assert str(mass(loads(text, settings=[f"parameters.{name}=null"]))) == f"2*{name}"


def test_an_unused_parameter_is_a_note() -> None:
    assert loads(f"parameters: {{k: 1}}\n{CUBE}").notes == ("parameter `k` is not used",)
    assert loads("parameters: {k: 1, m: k}\nbody: {shape: cube, side: 1, mass: m}").notes == ()


def test_a_parameter_without_a_value_makes_the_document_exact() -> None:
    document = loads("parameters: {m: null, a: 0.1}\nbody: {shape: cube, side: a, mass: m}")
    assert document.arithmetic.exact
    assert str(mass(document)) == "m"
    assert str(document.physical.properties.tensor[0, 0]) == "m/600"


@pytest.mark.parametrize("value", [".inf", "-.inf", ".nan"])
def test_what_is_not_finite_is_refused_alike_in_exact_arithmetic(value: str) -> None:
    text = f"body: {{shape: cube, side: 1, mass: 1, position: [{value}, 0, 0]}}"
    ((inexact,), (exact,)) = problems(text), problems(text, exact=True)
    assert "finite" in inexact.message
    assert inexact == exact


# --- --set


@pytest.mark.parametrize(
    ("setting", "expected"),
    rows_of(__file__, "a setting replaces or adds a value"),
)
def test_a_setting_replaces_or_adds_a_value(setting: str, expected: float) -> None:
    assert mass(loads(CUBE, settings=[setting])) == expected


def test_settings_index_lists_and_the_last_one_wins() -> None:
    text = "body: {points: [[1, 0, 0, 0], {mass: 1, position: [0, 0, 0]}]}"
    changed = loads(
        text, settings=["body.points.0.0=5", "body.points.1.mass=2", "body.points.0=[3, 1, 1, 1]"]
    )
    assert mass(changed) == 5


@pytest.mark.parametrize("setting", ["mass", "=3", "a..b=3", ".a=3", "a.=3", ""])
def test_a_setting_of_another_form_is_wrong_usage(setting: str) -> None:
    with pytest.raises(UsageError, match="KEY=VALUE"):
        loads(CUBE, settings=[setting])


@pytest.mark.parametrize(
    ("text", "setting", "word"),
    rows_of(__file__, "a setting for a place that is not there is refused"),
)
def test_a_setting_for_a_place_that_is_not_there_is_refused(text: str, setting: str, word: str) -> None:
    (problem,) = problems(text, [setting])
    assert word in str(problem)


@pytest.mark.parametrize(
    ("setting", "key"),
    rows_of(__file__, "a problem with a setting says so and names no line"),
)
def test_a_problem_with_a_setting_says_so_and_names_no_line(setting: str, key: str) -> None:
    (problem,) = problems(CUBE, [setting])
    assert problem.key == key
    if key != "body":
        assert problem.line is None
        assert "--set" in problem.source


@pytest.mark.parametrize("value", ["[1", "&x 1", "!!str x", "a: b: c", "\0"])
def test_the_value_of_a_setting_is_read_as_strictly_as_a_document(value: str) -> None:
    (problem,) = problems(CUBE, [f"body.mass={value}"])
    assert "body.mass" in str(problem)
    assert str(problem).isprintable() or problem.hint is not None


# --- files


def test_points_are_looked_for_beside_the_document(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "some folder"
    folder.mkdir()
    (folder / "cloud.csv").write_text("m,x,y,z\n1,2,3,4\n3,2,3,4\n")
    (folder / "cloud.yaml").write_text("body: {points: cloud.csv}\n")
    monkeypatch.chdir(tmp_path)
    assert mass(load("some folder/cloud.yaml")) == 4


@pytest.mark.parametrize("name", ["missing.csv", "missing.npy", "cloud.txt", "''", "folder.csv"])
def test_points_that_cannot_be_read_are_a_problem_of_their_key(name: str, tmp_path: Path) -> None:
    (tmp_path / "folder.csv").mkdir()
    path = tmp_path / "f.yaml"
    path.write_text(f"name: x\nbody:\n  points: {name}\n")
    with pytest.raises(DocumentError) as caught:
        load(path)
    (problem,) = caught.value.problems
    assert (problem.line, problem.key) == (3, "body.points")


def test_a_bad_row_of_a_points_file_is_told_with_both_places(tmp_path: Path) -> None:
    (tmp_path / "cloud.csv").write_text("m,x,y,z\n1,2,3,4\n-3,2,3,4\n")
    path = tmp_path / "f.yaml"
    path.write_text("body:\n  points: cloud.csv\n")
    with pytest.raises(DocumentError) as caught:
        load(path)
    message = str(caught.value)
    assert message.startswith(f"{path}:2: body.points: ")
    assert "cloud.csv:3" in message


# --- time and space to tell problems grow as their number, like the time of PyYAML


def parameters(entries: list[str]) -> str:
    return f"parameters: {{{', '.join(entries)}}}\n"


@pytest.mark.parametrize(
    "text",
    [
        parameters([f"k{i}: z{i}" for i in range(4000)]) + CUBE,
        parameters([f"k{i}: 1" for i in range(4000)]) + f"body: {{points: [{4000 * '[1, 0, 0, x], '}]}}",
        parameters([f"a{i}: b{i}, b{i}: a{i}" for i in range(1500)]) + CUBE,
        f"body: {{points: [{5000 * '0, '}]}}",
        "".join(f"key{i}: 1\n" for i in range(5000)),
    ],
    ids=["undeclared", "used", "circles", "types", "keys"],
)
def test_very_many_problems_are_told_in_linear_time_and_space(text: str) -> None:
    start = time.process_time()
    with pytest.raises(DocumentError) as caught:
        loads(text)
    assert len(str(caught.value)) < 30 * len(text)
    told = time.process_time()
    yaml.safe_load(text)
    assert told - start < 12 * (time.process_time() - told)
