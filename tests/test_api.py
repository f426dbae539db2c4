"""The package as people use it from Python and in notebooks."""

from __future__ import annotations

import copy
import doctest
import json
import pickle
import pydoc
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rigidcli
from rigidcli import api
from tests.conftest import ROOT, Program
from tests.markup import markup

TEXT = "body: {shape: cube, side: 1, mass: 12, anchor: corner}"
BODY = {"shape": "cube", "side": 1, "mass": 12, "anchor": "corner"}


@pytest.mark.parametrize(
    "source",
    [
        TEXT,
        {"body": BODY},
        ROOT / "configs" / "cube_corner.yaml",
        str(ROOT / "configs" / "cube_corner.yaml"),
        rigidcli.loads(TEXT),
    ],
    ids=["text", "mapping", "path", "name", "document"],
)
def test_a_document_in_any_form(source: Any) -> None:
    assert rigidcli.axes(source)["moments"] == pytest.approx([2, 11, 11], rel=1e-14)


def test_a_mapping_may_hold_arrays_and_exact_numbers() -> None:
    points = np.array([[1.0, 1, 0, 0], [2, 0, 1, 1], [3, 0, 1, -1]])
    assert rigidcli.axes({"body": {"points": points}})["moments"] == pytest.approx([5, 7, 10], rel=1e-14)
    exact = rigidcli.inertia({"body": BODY | {"side": Fraction(1, 3), "mass": np.int64(12)}}, exact=True)
    assert str(exact["tensor"][0, 0]) == "8/9"
    moment = rigidcli.axes("parameters: {M: null}\nbody: {shape: cube, side: 1, mass: M}")["moments"][0]
    found = rigidcli.inertia({"body": BODY | {"mass": moment}, "parameters": {"M": None}})
    assert str(found["mass"]) == "M/6"
    found = rigidcli.inertia({"body": BODY | {"side": 0.1}}, exact=True)
    assert found["center_of_mass"][0] == Fraction(1, 20)


def test_what_is_found_when_a_result_is_drawn_names_its_source() -> None:
    body = {"shape": "sphere", "radius": "R", "mass": 1}
    result = rigidcli.axes({"body": body, "parameters": {"R": None}})
    with pytest.raises(rigidcli.DocumentError, match=r"^parameters.R: missing: a picture needs its value"):
        result.save_picture("sphere.png")


def test_settings_and_options() -> None:
    assert rigidcli.inertia(TEXT, settings=["body.mass=6"])["mass"] == 6
    assert rigidcli.inertia(TEXT, settings="body.mass=6")["mass"] == 6
    assert rigidcli.inertia(TEXT, settings={"body.mass": "6 g"})["mass"] == pytest.approx(0.006)
    rod = "parameters: {M: 1, l: 2}\nbody: {shape: rod, mass: M, length: l}"
    assert rigidcli.inertia(rod, settings={"M": 12, "l": 1})["tensor"][0, 0] == pytest.approx(1)
    assert rigidcli.hamilton("system: {coordinates: [x], lagrangian: xdot**2/2}")["conserved"]
    done: list[float] = []
    motion = {"omega": [0, 0.1, 1], "torque": {"body": [0, 0, "-0.1*w3"]}, "duration": 1}
    assert rigidcli.euler({"body": BODY, "motion": motion}, progress=done.append)["motion"] == "driven"
    with pytest.raises(rigidcli.RigidError, match="read already"):
        rigidcli.axes(rigidcli.loads(TEXT), exact=True)
    with pytest.raises(rigidcli.DocumentError, match=r"^with settings: body.mas: unknown key"):
        rigidcli.axes({"body": BODY}, settings={"body.mas": 2})
    for setting in ("mass", "masss", "parameters.z", "orbit"):
        with pytest.raises(rigidcli.RigidError, match=f"settings: (nothing uses `)?{setting}"):
            rigidcli.axes(TEXT, settings={setting: 3})
    with pytest.raises(TypeError, match=r"^axes\(\) got an unexpected keyword argument 'setings'"):
        rigidcli.axes(TEXT, setings={"a": 1})


def test_problems_of_a_mapping_have_keys_and_no_lines() -> None:
    with pytest.raises(rigidcli.DocumentError) as caught:
        rigidcli.inertia({"body": {"shape": "cube", "side": -1, "mas": 12}})
    problems = caught.value.problems
    assert {problem.key for problem in problems} >= {"body.side", "body.mas"}
    assert all(problem.line is None for problem in problems)
    for wrong in ({"body": {"shape": "cube", "side": float("nan"), "mass": 1}}, {"body": print}, {}):
        with pytest.raises(rigidcli.DocumentError):
            rigidcli.inertia(wrong)
    with pytest.raises(rigidcli.DocumentError, match=r"<text>:2: body"):
        rigidcli.inertia("name: x\nbody: {shape: cube, side: 1, mas: 12}")


def test_a_document_is_validated() -> None:
    assert rigidcli.validate(TEXT) == []
    problems = rigidcli.validate("body: {shape: cube,\n mas: 1}")
    assert {problem.key for problem in problems} >= {"body.mas", "body.side"}
    assert all(problem.line for problem in problems)
    problems = rigidcli.validate({"body": {"shape": "cube", "side": -1}})
    assert [problem.line for problem in problems] == [None, None]


def test_homework_is_judged_as_on_the_command_line(tmp_path: Path, program: Program) -> None:
    assignment, answers = "configs/homework/assignment.yaml", "configs/homework/answers"
    judged = rigidcli.check(assignment, answers, jobs=1)
    lines = program("check", assignment, answers, "-f", "json").out.splitlines()
    assert judged == [json.loads(line) for line in lines]
    (bob,) = rigidcli.check(assignment, f"{answers}/bob.yaml", feedback="full", jobs=1)
    assert "expected" in bob["questions"][0]["feedback"][0]["message"]
    (tmp_path / "roster.csv").write_text("name\nbob\nmallory\n")
    (tmp_path / "scores.csv").write_text("student,question,score,reason\nbob,10.35a,3,oral\nzoe,10.35a,1,\n")
    judged = rigidcli.check(
        assignment,
        f"{answers}/bob.yaml",
        roster=tmp_path / "roster.csv",
        overrides=tmp_path / "scores.csv",
        jobs=1,
    )
    assert [student["student"] for student in judged] == ["bob", "mallory"]
    assert judged[0]["score"] == pytest.approx(bob["score"] + 0.75)
    assert "zoe" in "".join(judged.notes)


@pytest.mark.parametrize(
    ("answers", "options", "message"),
    [
        ((), {}, "no answers are named"),
        (("configs/homework/answers/bobby.yaml",), {}, "cannot be read: No such file"),
        (("configs/homework/answers",), {"feedback": "hnt"}, "did you mean hint"),
    ],
)
def test_homework_that_cannot_be_judged_is_refused(answers: Any, options: Any, message: str) -> None:
    with pytest.raises(rigidcli.RigidError, match=message):
        rigidcli.check("configs/homework/assignment.yaml", *answers, **options)


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_an_array_with_a_number_that_is_none_is_told_by_its_place(number: float) -> None:
    points = np.array([[1.0, 0, 0, 0], [1, 0, 0, number]])
    with pytest.raises(rigidcli.DocumentError, match=r"body\.points\.1\.3: .*expected a finite number"):
        rigidcli.axes({"body": {"points": points}})


def test_a_mapping_in_itself_is_refused() -> None:
    body: dict[str, Any] = {}
    body["parts"] = [body]
    for wrong in ({"body": body}, {"body": {("a", "b"): 1}}):
        with pytest.raises(rigidcli.DocumentError, match="cannot be read"):
            rigidcli.axes(wrong)


@pytest.mark.parametrize(("study", "config"), [("axes", "cube_symbolic"), ("euler", "t_handle")])
def test_a_result_shows_itself_as_the_table_of_the_command_line(
    study: str, config: str, program: Program
) -> None:
    path = f"configs/{config}.yaml"
    assert repr(getattr(rigidcli, study)(path)) + "\n" == program(study, path).out


def test_a_field_is_an_attribute_too() -> None:
    result = rigidcli.axes({"body": {"moments": [1, 2, 3], "mass": 1}})
    assert result.moments is not None
    assert list(result.moments) == [1, 2, 3]
    assert "moments" in dir(result)
    assert list(copy.deepcopy(pickle.loads(pickle.dumps(result))).moments) == [1, 2, 3]
    with pytest.raises(AttributeError, match="did you mean moments"):
        result.momnts  # noqa: B018 - the access is what fails


def test_notebooks_show_formulas() -> None:
    result = rigidcli.hamilton(ROOT / "configs" / "taylor_13_02.yaml")
    assert r"H &= \frac{p_{x}^{2}}{2 m} - m g x" in result._repr_latex_()
    page = markup(result._repr_html_())
    assert "H=px22m−mgx" in [cell.text for cell in page.all("td")]
    assert "t (s)" in [head.text for head in page.all("th")]


def test_hostile_names_stay_text_in_notebooks() -> None:
    name = "<script>alert('1')</script>"
    page = rigidcli.axes({"name": name, "body": BODY})._repr_html_()
    assert "<script" not in page
    assert "&lt;script&gt;" in page


def test_data_frames_have_the_columns_of_csv_and_their_units() -> None:
    motion = rigidcli.euler(ROOT / "configs" / "t_handle.yaml")
    frame = motion.to_dataframe()
    assert list(frame.columns[:4]) == ["t", "w1", "w2", "w3"]
    assert np.array_equal(frame[["w1", "w2", "w3"]], motion["trajectory"]["omega"])
    assert frame.attrs["units"]["L1"] == "kg m^2/s"
    row = rigidcli.axes(TEXT).to_dataframe()
    assert (len(row), row["mass"].iloc[0], row.attrs["units"]["lambda1"]) == (1, 12, "kg m^2")


def test_without_pandas_the_message_says_what_helps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(rigidcli.RigidError, match="pandas is not installed"):
        rigidcli.axes(TEXT).to_dataframe()


def test_the_package_lists_what_it_offers() -> None:
    assert {*rigidcli.__all__, "Document", "DocumentError", "Result", "RigidError"} <= {*dir(rigidcli)}
    assert all(getattr(rigidcli, name) is not None for name in dir(rigidcli))
    with pytest.raises(AttributeError):
        rigidcli.nothing  # noqa: B018 - the access is what fails


def test_the_help_of_the_package_is_read_in_a_minute() -> None:
    text = pydoc.plain(pydoc.render_doc(rigidcli))
    assert len(text.splitlines()) <= 150
    assert [name for name in rigidcli.__all__ if name not in text] == []
    assert all(f"rigidcli explain {study}" in text for study in rigidcli.STUDIES)
    assert "moments, axes" in text


def test_the_examples_in_the_help_hold() -> None:
    outcome = doctest.testmod(api, extraglobs={"rigidcli": rigidcli})
    assert (outcome.failed, outcome.attempted > len(rigidcli.STUDIES)) == (0, True)
