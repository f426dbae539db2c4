"""Whose an answer file is: folders, downloads of Canvas and Moodle, lists of students, and files beside."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from rigidcli.errors import DocumentError
from rigidcli.grading.files import DEEPEST, beside, gather, is_contested, read_beside
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.roster import Roster, papers, read_roster, students_of
from tests.grading.asking import cases

MOODLE = "assignsubmission_file"


def students(*names: str) -> list[str]:
    return students_of([Path("/class") / name for name in names])


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        (["ada.yaml", "bob.json", "a.b.c.yml"], ["ada", "bob", "a.b.c"]),
        (["s1042/hw.yaml", "s1043/hw.yaml"], ["s1042", "s1043"]),
        (["s1042/hw.yaml", "s1043/hw.yml", "s1044/HW.json"], ["s1042", "s1043", "s1044"]),
        (["s1042/hw.yaml", "s1043/hw.yaml", "late.yaml"], ["s1042", "s1043", "late"]),
        (["a/s1/hw.yaml", "a/s2/hw.yaml", "b/s3/hw.yaml", "b/s4/hw.yaml"], ["s1", "s2", "s3", "s4"]),
        (["s1/hw/answers.yaml", "s2/hw/answers.yaml", "s3/answers.yaml"], ["s1", "s2", "s3"]),
        (["a/ada.yaml", "b/bob.yaml"], ["ada", "bob"]),
        (["a/ada.yaml", "a/bob.yaml", "b/ada.yaml", "b/eve.yaml"], ["ada", "bob", "ada", "eve"]),
        ([f"Ada L_4711_{MOODLE}_/answers.yaml", f"Bob_12_{MOODLE}/x.yaml"], ["Ada L_4711", "Bob_12"]),
        ([f"Ada L_4711_{MOODLE}_hw.yaml", f"Bob_12_{MOODLE}_hw.yaml"], ["Ada L_4711", "Bob_12"]),
        ([f"Ada_1_{MOODLE}_/deep/in/hw.yaml"], ["Ada_1"]),
        (["doejane_LATE_4711_98765_homework.yaml", "roe_12_98766_hw-1.yaml"], ["doejane_4711", "roe_12"]),
        (["lab_1_2_ada/hw.yaml", "lab_1_2_bob/hw.yaml"], ["lab_1_2_ada", "lab_1_2_bob"]),
        (["hw_10_3_ada.yaml", "hw_10_3_bob.yaml"], ["hw_10_3_ada", "hw_10_3_bob"]),
    ],
)
def test_the_student_is_told_from_the_file_or_else_the_folder(files: list[str], expected: list[str]) -> None:
    assert students(*files) == expected


@pytest.mark.parametrize(
    "name",
    ["s2/hw.yaml", f"Eve_2_{MOODLE}/hw.yaml", "roe_12_98_hw.yaml", "s2.yaml", "a/b/c/s2.yaml", "hw.json"],
)
def test_no_student_takes_the_place_of_another(name: str) -> None:
    """Whatever a student puts into the own folder, or the own name of a file, stays that student's."""
    folders = [f"s{n}/hw.yaml" for n in range(1, 6)]
    found = students(*folders, f"s1/{name}")
    assert found[:5] == ["s1", "s2", "s3", "s4", "s5"]
    assert found[5] == "s1"
    for prefix, own in (
        (f"Ada_1_{MOODLE}_", "Ada_1"),
        (f"Ada_1_{MOODLE}_/", "Ada_1"),
        ("ada_1_77_", "ada_1"),
    ):
        assert students(prefix + name.replace("/", "_"), f"Eve_2_{MOODLE}/hw.yaml")[0] == own


def test_two_files_of_one_student_are_not_judged() -> None:
    files = [
        Path(name) for name in ("x/ada.yaml", "x/bob.yaml", "x/Ada.json", "eve_7_1_a.yaml", "eve_7_2_b.yaml")
    ]
    found, notes = papers(files)
    assert [paper.outcome and paper.outcome.findings[0].code for paper in found] == [
        "duplicate_key",
        None,
        "duplicate_key",
        "duplicate_key",
        "duplicate_key",
    ]
    assert notes == ["more than one answer file, and none of them judged: `Ada`, `ada`, `eve_7`"]


def test_a_file_that_is_given_twice_counts_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "ada.yaml").write_text("answers: {}")
    monkeypatch.chdir(tmp_path)
    given: list[str | Path] = [
        "ada.yaml",
        ".",
        tmp_path,
        f"../{tmp_path.name}/ada.yaml",
        tmp_path / "ada.yaml",
    ]
    assert gather(given).files == [Path("ada.yaml")]
    assert gather(given).problems == []


def test_folders_are_looked_into_as_far_as_is_good(tmp_path: Path) -> None:
    deep = tmp_path.joinpath(*"abcdefghij")
    deep.mkdir(parents=True)
    for folder in (tmp_path, tmp_path / "a", deep, deep.parents[9 - DEEPEST]):
        (folder / f"{len(folder.parts)}.yaml").write_text("answers: {}")
    (tmp_path / "__MACOSX").mkdir()
    (tmp_path / "__MACOSX" / "._x.yaml").write_text("")
    (tmp_path / "a" / "home").symlink_to(tmp_path)
    found = gather([tmp_path])
    assert [len(file.relative_to(tmp_path).parts) for file in found.files] == [1, 2, DEEPEST + 1]
    assert [problem.message for problem in found.problems] == [
        f"not looked into: expected at most {DEEPEST} folders in each other"
    ]
    assert found.others == [tmp_path / "a" / "home"]


LIST = 'Name,Login,ID\n"Doe, Jane",jdoe@x.edu,101\nMax Roe,mroe,102\nZoë O\'Brien,zob,103\nMax Roe,max2,104\n'


@pytest.mark.parametrize(
    ("text", "stems", "expected"),
    [
        (LIST, ["jdoe", "103"], ["Doe, Jane", "Zoë O'Brien"]),
        (LIST, ["doejane_101", "Jane Doe_99"], ["Doe, Jane", "Doe, Jane"]),
        (LIST, ["max2", "stranger", "max_roe"], ["max2", "stranger", "max_roe"]),
        (LIST, ["doejane_103", "lab_101"], ["doejane_103", "lab_101"]),
        (LIST.replace(",", ";").replace("Doe;", "Doe,"), ["jdoe"], ["Doe, Jane"]),
        ("First name\tSurname\tEmail address\nJane\tDoe\tjdoe@x.edu\n", ["jane_doe"], ["Doe, Jane"]),
        ("username\njdoe\n\n", ["JDOE"], ["jdoe"]),
        ('Student,ID,SIS Login ID,HW\n  Points Possible,,,9\n"Doe, Jane",7,jd,\n', ["jd"], ["Doe, Jane"]),
    ],
)
def test_a_list_of_students(tmp_path: Path, text: str, stems: list[str], expected: list[str]) -> None:
    (tmp_path / "class.csv").write_text(f"\ufeff{text}")
    assert read_roster(tmp_path / "class.csv").named(stems)[0] == expected


def test_students_without_a_file_are_missing(tmp_path: Path) -> None:
    (tmp_path / "class.csv").write_text(LIST + '"Student, Test",test,105\n')
    found, notes = papers(
        [Path("jdoe.yaml"), Path("doe_jane.yaml"), Path("x.yaml")], read_roster(tmp_path / "class.csv")
    )
    assert [(paper.student, paper.outcome and paper.outcome.verdict) for paper in found] == [
        ("Doe, Jane", "invalid"),
        ("Doe, Jane", "invalid"),
        ("x", None),
        ("mroe", "missing"),
        ("Zoë O'Brien", "missing"),
        ("max2", "missing"),
    ]
    assert notes == [
        "not found in the roster: `x`",
        "more than one answer file, and none of them judged: `Doe, Jane`",
    ]


@pytest.mark.parametrize("text", ["", "\n", "a,b\n1,2\n", "\0", "answers: {a: 1}"])
def test_what_is_no_list_of_students_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "class.csv").write_text(text)
    with pytest.raises(DocumentError, match="no list of students"):
        read_roster(tmp_path / "class.csv")


def test_nobody_is_in_an_empty_list() -> None:
    assert Roster({}).named(["ada"]) == (["ada"], [], ["not found in the roster: `ada`"])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in [
        *("ada.yaml", "ada_l.yaml", "bob.yaml", "ada_orbit.csv", "ada_l_orbit.csv", "bob.csv", "orbit.csv"),
        *("adages.csv", "ada-orbit.csv", "run_4711_2_orbit.csv"),
        *("doejane_4711_98_hw.yaml", "doejane_4711_99_orbit.csv", "doejane_4711_100_orbit.csv"),
        *("doejane_4711_101_run-1.csv", "doejane_4711_102_run-2.csv", "doejane_LATE_4711_103_my x-3.csv"),
        *("roe_12_90_hw.yaml", "roe_12_91_orbit.csv", "eve_13_92_other.csv"),
        *(f"Max_7_{MOODLE}_hw.yaml", f"Max_7_{MOODLE}_orbit.csv", f"Moe_8_{MOODLE}_orbit.csv"),
    ]:
        (tmp_path / name).write_text(name)
    return tmp_path


@cases(
    """
    answers | read | name
    ada.yaml | ada_orbit.csv | ada_orbit.csv  ./ada_orbit.csv
    ada_l.yaml | ada_l_orbit.csv | ada_l_orbit.csv
    bob.yaml | orbit.csv | orbit.csv
    bob.yaml | adages.csv | adages.csv
    bob.yaml | run_4711_2_orbit.csv | run_4711_2_orbit.csv
    doejane_4711_98_hw.yaml | doejane_4711_99_orbit.csv | doejane_4711_99_orbit.csv
    doejane_4711_98_hw.yaml | doejane_4711_101_run-1.csv | run-1.csv
    doejane_4711_98_hw.yaml | doejane_4711_102_run-2.csv | run.csv
    doejane_4711_98_hw.yaml | doejane_LATE_4711_103_my x-3.csv | my x.csv
    """,
    (f"Max_7_{MOODLE}_hw.yaml", f"Max_7_{MOODLE}_orbit.csv", f"Max_7_{MOODLE}_orbit.csv"),
)
def test_a_file_beside_is_found_by_the_name_that_a_student_gave_it(
    folder: Path, answers: str, name: str, read: str
) -> None:
    assert read_beside(name, folder / answers) == read


def test_a_file_that_was_handed_in_again_is_the_last(folder: Path) -> None:
    (folder / "orbit.csv").unlink()
    assert beside("orbit.csv", folder / "doejane_4711_98_hw.yaml").name == "doejane_4711_100_orbit.csv"
    assert beside("orbit.csv", folder / f"Max_7_{MOODLE}_hw.yaml").name == f"Max_7_{MOODLE}_orbit.csv"


@cases(
    """
    answers | code | name
    bob.yaml | not_allowed | ada_orbit.csv  ADA_orbit.csv  Ada-orbit.csv  ada.yaml
    roe_12_91_orbit.csv
    ada.yaml | not_allowed | ada_l_orbit.csv
    ada_l.yaml | not_allowed | ada_orbit.csv
    doejane_4711_98_hw.yaml | not_allowed | roe_12_91_orbit.csv  eve_13_92_other.csv
    doejane_4711_98_hw.yaml | missing_file | other.csv
    ada.yaml | path_outside | ../x  ..  sub/x.csv  C:x.csv
    ada.yaml | missing_file | nowhere.csv
    """,
    (f"Max_7_{MOODLE}_hw.yaml", "not_allowed", f"Moe_8_{MOODLE}_orbit.csv"),
    ("doejane_4711_98_hw.yaml", "not_allowed", f"Moe_8_{MOODLE}_orbit.csv"),
    ("ada.yaml", "path_outside", "x\0.csv"),
    ("ada.yaml", "wrong_shape", ""),
)
def test_a_file_of_another_student_or_elsewhere_is_refused(
    folder: Path, answers: str, name: str, code: str
) -> None:
    with pytest.raises(Unreadable) as refused:
        read_beside(name, folder / answers)
    assert refused.value.finding.code == code


@pytest.mark.parametrize(
    ("text", "contested"),
    [
        ("answers: {a: {file: orbit.csv}}", True),
        ("answers: {a: {file: 'orbit.csv'}", True),
        ("answers: {a: {file: my_orbit.csv}}", False),
        ("answers: {a: {file: orbit.csv.bak}}", False),
        ("\0", False),
    ],
)
def test_a_file_that_may_be_of_two_students_is_told(folder: Path, text: str, contested: bool) -> None:
    (folder / "bob.yaml").write_text(text)
    assert is_contested(folder / "orbit.csv", folder / "ada.yaml") == contested
    assert not is_contested(folder / "ada_orbit.csv", folder / "ada.yaml")
    (folder / "bob.yaml").unlink()
    os.mkfifo(folder / "bob.yaml")
    assert not is_contested(folder / "orbit.csv", folder / "ada.yaml")


@pytest.mark.skipif(os.name == "nt", reason="there are no such links")
def test_a_link_beside_is_not_followed(folder: Path) -> None:
    (folder / "ada_link.csv").symlink_to(folder / "bob.csv")
    with pytest.raises(Unreadable, match="a link"):
        read_beside("ada_link.csv", folder / "ada.yaml")
