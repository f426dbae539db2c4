"""Whose a hand-in is: by folders, downloads of platforms, lists of students; and files beside it."""

from __future__ import annotations

import os
import stat
import zipfile
from collections.abc import Sequence
from pathlib import Path

import pytest

from rigidcli.check.base import Unreadable
from rigidcli.check.files import MOST_BYTES, Batch, beside, gather, is_answer, is_contested, read_file
from rigidcli.check.hand_ins import papers
from rigidcli.check.roster import Paper, Roster, read_roster
from rigidcli.errors import DocumentError

MOODLE = "assignsubmission_file"


def made(folder: Path, *names: str) -> Path:
    """The folder with these files in it."""
    for name in names:
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("%PDF" if name.endswith(".pdf") else f"answers: {{a: '{name}'}}")
    return folder


def found(folder: Path, *given: str) -> Batch:
    """What is found below a folder of ANSWERS, or in what is given in it."""
    scratch = folder / ".scratch" / "-".join(given)
    return gather([str(folder / name) for name in given] or [str(folder)], None, scratch)


def owners(folder: Path, *given: str, roster: Roster | None = None) -> dict[str, str]:
    """Students with what is judged: the name of a file, or the code or verdict of what is not judged."""
    return {row.student: _told(row) for row in papers(found(folder, *given), roster).papers}


def answers(batch: Batch) -> list[str]:
    """The names of files that have the name of an answer file."""
    return [place.file.name for place in batch.places if is_answer(place.file.name)]


def _told(row: Paper) -> str:
    if row.outcome is None:
        return "" if row.file is None else row.file.name
    return row.outcome.findings[0].code if row.outcome.findings else row.outcome.verdict


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        (["ada.yaml", "bob.json", "a.b.c.yml"], {"ada", "bob", "a.b.c"}),
        (["ada/bob.yaml", "bob/solution.yaml"], {"ada", "bob"}),
        (["s1042/hw.yaml"], {"s1042"}),
        (["s1042/hw.yaml", "s1043/hw.yaml", "late.yaml"], {"s1042", "s1043", "late"}),
        (["week3/ada/hw1.yaml", "week3/bob/hw1.yaml"], {"ada", "bob"}),
        (["week3/ada/hw1.yaml"], {"ada"}),
        (["s1/hw/answers.yaml", "s2/hw/answers.yaml", "s3/answers.yaml"], {"s1", "s2", "s3"}),
        (["a/x/hw.yaml", "b/y/hw.yaml"], {"a", "b"}),
        ([f"Ada L_4711_{MOODLE}_/answers.yaml", f"Bob_12_{MOODLE}/x.yaml"], {"Ada L_4711", "Bob_12"}),
        ([f"Ada L_4711_{MOODLE}_hw.yaml", f"Bob_12_{MOODLE}_hw.yaml"], {"Ada L_4711", "Bob_12"}),
        ([f"Ada_1_{MOODLE}_/deep/in/hw.yaml"], {"Ada_1"}),
        (["doejane_LATE_4711_98765_homework.yaml", "roe_12_98766_hw-1.yaml"], {"doejane_4711", "roe_12"}),
        (["lab_1_2_ada/hw.yaml", "lab_1_2_bob/hw.yaml"], {"lab_1_2_ada", "lab_1_2_bob"}),
        (["hw_10_3_ada.yaml", "hw_10_3_bob.yaml"], {"hw_10_3_ada", "hw_10_3_bob"}),
        (["ada.yaml", "bob.pdf", "orbit.csv", "eve/scan.pdf"], {"ada", "bob", "eve"}),
    ],
)
def test_a_folder_tells_the_student_before_the_name_of_a_file(
    tmp_path: Path, files: Sequence[str], expected: set[str]
) -> None:
    assert set(owners(made(tmp_path, *files))) == expected


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        (["ada/hw.yaml", "ada/old.yaml", "bob/hw.yaml"], {"ada": "duplicate_key", "bob": "hw.yaml"}),
        (["ada/hw.yaml", "ada/old/hw.yaml"], {"ada": "duplicate_key"}),
        (["ada.yaml", "Ada.json"], {"Ada": "duplicate_key"}),
        (
            ["doe_1_7_hw.yaml", "doe_LATE_1_9_hw-1.yaml", "doe_1_8_hw.yaml"],
            {"doe_1": "doe_LATE_1_9_hw-1.yaml"},
        ),
        (["doe_1_7_hw.yaml", "doe_1_9_other.yaml"], {"doe_1": "duplicate_key"}),
        (["ada/scan.pdf", "bob/hw.yaml"], {"ada": "undecided", "bob": "hw.yaml"}),
        (["ada.pdf", "bob.yaml", "bob_orbit.csv", "data.csv"], {"ada": "undecided", "bob": "bob.yaml"}),
    ],
)
def test_of_several_files_the_last_copy_or_none_is_judged(
    tmp_path: Path, files: Sequence[str], expected: dict[str, str]
) -> None:
    assert owners(made(tmp_path, *files)) == expected


@pytest.mark.parametrize("name", ["s2/hw.yaml", f"Eve_2_{MOODLE}/hw.yaml", "roe_12_98_hw.yaml", "s2.yaml"])
def test_no_student_takes_the_place_of_another(tmp_path: Path, name: str) -> None:
    """Whatever a student puts into the own folder stays that student's."""
    made(tmp_path, *(f"s{n}/hw.yaml" for n in range(1, 6)), f"s1/{name}")
    assert owners(tmp_path) == {"s1": "duplicate_key", **{f"s{n}": "hw.yaml" for n in range(2, 6)}}


def test_files_and_folders_that_are_given_one_by_one(tmp_path: Path) -> None:
    made(
        tmp_path, "in/ada/hw.yaml", "in/bob/hw.yaml", "monday/eve.yaml", "monday/zoe.yaml", "tuesday/max.yaml"
    )
    assert set(owners(tmp_path, "in/ada/hw.yaml", "in/bob/hw.yaml")) == {"ada", "bob"}
    assert set(owners(tmp_path, "in/ada/hw.yaml")) == {"hw"}
    assert set(owners(tmp_path, "in/ada", "in/bob")) == {"ada", "bob"}
    assert set(owners(tmp_path, "monday", "in")) == {"eve", "zoe", "ada", "bob"}


def test_a_file_that_is_given_twice_counts_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(made(tmp_path, "ada.yaml"))
    given = ["ada.yaml", ".", str(tmp_path), f"../{tmp_path.name}/ada.yaml"]
    gathered = gather(given, None, tmp_path / ".scratch")
    assert answers(gathered) == ["ada.yaml"]
    assert gathered.problems == []


def test_whatever_has_such_a_name_is_listed_and_links_are_not_followed(tmp_path: Path) -> None:
    made(tmp_path, "folder.yaml/inner.yaml", "D.YAML", ".hidden.yaml", "__MACOSX/._x.yaml", "x.yaml.bak")
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "home.yaml").symlink_to(tmp_path)
    (tmp_path / "home").symlink_to(tmp_path)
    gathered = found(tmp_path)
    names = answers(gathered)
    assert names == ["D.YAML", "folder.yaml", "home.yaml", "pipe.yaml"]
    assert [place.file.name for place in gathered.places][-2:] == ["pipe.yaml", "x.yaml.bak"]


@pytest.mark.parametrize("name", ["nothing.yaml", "no/such/folder", "a.yaml/b.yaml", "x" * 5000, "a\0b", ""])
def test_what_is_not_there_is_told_beside_the_others(tmp_path: Path, name: str) -> None:
    made(tmp_path, "a.yaml")
    given = str(tmp_path / name) if name else ""
    gathered = gather([given, str(tmp_path / "a.yaml")], None, tmp_path / ".scratch")
    (problem,) = gathered.problems
    assert "cannot be read" in problem.message
    assert str(problem).isprintable()
    assert answers(gathered) == ["a.yaml"]


def test_a_folder_without_answers_is_named(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (problem,) = found(tmp_path / "empty").problems
    assert "no answer files" in problem.message


# --- archives and exports


def packed(path: Path, files: dict[str, str]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return path


@pytest.mark.parametrize("names", [["ada", "bob"], ["ada", "bob", "cleo"]])
def test_archives_with_one_hand_in_are_the_students(tmp_path: Path, names: list[str]) -> None:
    for name in names:
        packed(tmp_path / f"{name}.zip", {"hw.yaml": "answers: {a: 1}", "orbit.csv": "t"})
    assert owners(tmp_path, *(f"{name}.zip" for name in names)) == dict.fromkeys(names, "hw.yaml")


def test_an_archive_is_read_as_its_folder(tmp_path: Path) -> None:
    files = {
        "ada/hw.yaml": "answers: {a: 1}",
        "bob/hw.yaml": "answers: {}",
        "__MACOSX/x.yaml": "",
        "bob/": "",
    }
    packed(tmp_path / "class.zip", files)
    gathered = found(tmp_path, "class.zip")
    assert gathered.problems == []
    rows = papers(gathered).papers
    assert {row.student: row.source for row in rows} == {
        name: f"{tmp_path}/class.zip/{name}/hw.yaml" for name in ("ada", "bob")
    }
    assert rows[0].file is not None
    assert rows[0].file.read_text() == "answers: {a: 1}"


@pytest.mark.parametrize("name", ["../evil.yaml", "/etc/evil.yaml", "..\\evil.yaml", "a/../../evil.yaml"])
def test_an_archive_writes_nothing_outside(tmp_path: Path, name: str) -> None:
    packed(tmp_path / "class.zip", {name: "x", "ada.yaml": "x"})
    found(tmp_path, "class.zip")
    outside = [*tmp_path.glob("*evil*"), *(tmp_path / ".scratch").glob("*evil*"), Path("/etc/evil.yaml")]
    assert not [path for path in outside if path.exists()]


def test_an_archive_is_bounded(tmp_path: Path) -> None:
    packed(tmp_path / "class.zip", {"ada.yaml": "x" * (50 * MOST_BYTES), "/".join("abcdefghijkl.yaml"): ""})
    gathered = found(tmp_path, "class.zip")
    (place,) = gathered.places
    assert place.file.stat().st_size == MOST_BYTES + 1
    assert "too deep" in gathered.problems[0].message
    with zipfile.ZipFile(tmp_path / "link.zip", "w") as archive:
        link = zipfile.ZipInfo("ada.yaml")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(link, "/etc/passwd")
    gathered = found(tmp_path, "link.zip")
    assert gathered.places == []
    assert "it is a link" in gathered.problems[0].message
    (tmp_path / "no.zip").write_text("no archive")
    assert "cannot be read as a zip" in found(tmp_path, "no.zip").problems[0].message


def class_archive(path: Path) -> Path:
    """An archive of three students, and beside them what cannot be unpacked."""
    files = {f"{name}/hw.yaml": "answers: {a: 1}" for name in ("ada", "Zoë", "bob")}
    bad = dict.fromkeys([f"ada/{'x' * 300}.yaml", "bob", "bob/hw.yaml/x.yaml", "eve/broken.yaml"], "x")
    packed(path, {**dict(list(files.items())[:1]), **bad, **files})
    data = path.read_bytes().replace("Zoë".encode(), b"Zo\xc3\xab")
    place = data.index(b"eve/broken.yaml") + len(b"eve/broken.yaml")
    path.write_bytes(data[:place] + b"\xff\xff\xff" + data[place + 3 :])
    return path


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_an_entry_that_cannot_be_unpacked_costs_no_other(tmp_path: Path) -> None:
    class_archive(tmp_path / "class.zip")
    gathered = found(tmp_path, "class.zip")
    assert {place.source[len(f"{tmp_path}/class.zip/") :] for place in gathered.places} == {
        *("ada/hw.yaml", "bob/hw.yaml", "Zoë/hw.yaml")
    }
    assert all(place.file.is_file() for place in gathered.places)
    assert gathered.is_whole


METADATA = """
---
submission_1:
  :submitters:
  - :name: Ada L
    :sid: '11'
    :email: ada@x.edu
  :created_at: 2024-01-01 00:00:00 Z
submission_2:
  :submitters:
  - :name: Bob
  - :name: Eve
"""


def test_gradescope_says_whose_a_folder_is(tmp_path: Path) -> None:
    made(tmp_path, "export/submission_1/hw.yaml", "export/submission_2/hw.yaml")
    (tmp_path / "export/submission_metadata.yml").write_text(METADATA)
    expected = {"ada@x.edu": "hw.yaml", "Bob": "hw.yaml", "Eve": "hw.yaml"}
    assert owners(tmp_path) == expected
    assert owners(tmp_path / "export") == expected


# --- lists of students

LIST = 'Name,Login,ID\n"Doe, Jane",jdoe@x.edu,101\nMax Roe,mroe,102\nZoë O\'Brien,zob,103\nMax Roe,max2,104\n'


def listed(folder: Path, text: str = LIST) -> Roster:
    (folder / "class.csv").write_text(f"\ufeff{text}")
    return read_roster(folder / "class.csv")


@pytest.mark.parametrize(
    ("name", "student"),
    [
        ("jdoe", "Doe, Jane"),
        ("103", "Zoë O'Brien"),
        ("zoe_obrien", "Zoë O'Brien"),
        ("doejane_101", "Doe, Jane"),
        ("Jane Doe_99", "Doe, Jane"),
        ("max2", "max2"),
        ("stranger", ""),
        ("max_roe", ""),
        ("doejane_103", "Doe, Jane"),
        ("Jane Stranger", ""),
        ("lab_101", ""),
    ],
)
def test_a_name_of_the_list(tmp_path: Path, name: str, student: str) -> None:
    roster = listed(tmp_path)
    keys = roster.find(name)
    assert (roster.labels[min(keys)] if len(keys) == 1 else "") == student


@pytest.mark.parametrize(
    ("text", "name", "student"),
    [
        (LIST.replace(",", ";").replace("Doe;", "Doe,"), "jdoe", "Doe, Jane"),
        ("First name\tSurname\tEmail address\nJane\tDoe\tjdoe@x.edu\n", "jane_doe", "Doe, Jane"),
        ("username\njdoe\n\n", "JDOE", "jdoe"),
        ('Student,ID,SIS Login ID,HW\n  Points Possible,,,9\n"Doe, Jane",7,jd,\n', "jd", "Doe, Jane"),
    ],
)
def test_lists_of_several_forms(tmp_path: Path, text: str, name: str, student: str) -> None:
    roster = listed(tmp_path, text)
    assert [roster.labels[key] for key in roster.find(name)] == [student]


def test_with_a_roster_folders_and_files_are_known_and_all_have_a_row(tmp_path: Path) -> None:
    roster = listed(tmp_path, LIST + '"Student, Test",test,105\n')
    made(tmp_path / "in", "week3/jdoe/mroe.yaml", "week3/mroe/solution.yaml", "week3/x/hw.yaml", "max2.yaml")
    assert owners(tmp_path / "in", roster=roster) == {
        "Doe, Jane": "mroe.yaml",
        "mroe": "solution.yaml",
        "x": "hw.yaml",
        "max2": "max2.yaml",
        "Zoë O'Brien": "missing",
    }
    rows, notes, _ = papers(found(tmp_path / "in"), roster)
    assert notes == ["not found in the roster: `x`"]
    assert len(rows) == 5


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ([f"J Doe_1_{MOODLE}_/Max Moe/hw.yaml", f"Max Moe_2_{MOODLE}_/hw.yaml"], "hw.yaml hw.yaml missing"),
        ([f"J Doe_1_{MOODLE}_/Max Moe/hw.yaml"], "hw.yaml missing missing"),
        (["week/jdoe/max/x/hw.yaml", "week/max/zob/zob.yaml"], "hw.yaml zob.yaml missing"),
        (["jdoe/max/hw.yaml", "jdoe/hw.yaml", "zob.yaml"], "duplicate_key missing zob.yaml"),
    ],
)
def test_what_lies_in_the_folder_of_a_student_is_nobody_elses(
    tmp_path: Path, files: list[str], expected: str
) -> None:
    text = "name,login,email\nJ Doe,jdoe,j@x.edu\nMax Moe,max,m@x.edu\nZoë B,zob,z@x.edu\n"
    roster = listed(tmp_path, text)
    found = owners(made(tmp_path / "in", *files), roster=roster)
    assert [found.pop(name) for name in ("J Doe", "Max Moe", "Zoë B")] == expected.split()
    assert found == {}


@pytest.mark.parametrize("text", ["", "\n", "a,b\n1,2\n", "\0", "answers: {a: 1}"])
def test_what_is_no_list_of_students_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "class.csv").write_text(text)
    with pytest.raises(DocumentError, match="no list of students"):
        read_roster(tmp_path / "class.csv")


# --- files beside an answer file


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


@pytest.mark.parametrize(
    ("answers", "name", "expected"),
    [
        ("ada.yaml", "ada_orbit.csv", "ada_orbit.csv"),
        ("ada.yaml", "./ada_orbit.csv", "ada_orbit.csv"),
        ("ada_l.yaml", "ada_l_orbit.csv", "ada_l_orbit.csv"),
        ("bob.yaml", "orbit.csv", "orbit.csv"),
        ("bob.yaml", "adages.csv", "adages.csv"),
        ("bob.yaml", "run_4711_2_orbit.csv", "run_4711_2_orbit.csv"),
        ("doejane_4711_98_hw.yaml", "doejane_4711_99_orbit.csv", "doejane_4711_99_orbit.csv"),
        ("doejane_4711_98_hw.yaml", "run-1.csv", "doejane_4711_101_run-1.csv"),
        ("doejane_4711_98_hw.yaml", "run.csv", "doejane_4711_102_run-2.csv"),
        ("doejane_4711_98_hw.yaml", "my x.csv", "doejane_LATE_4711_103_my x-3.csv"),
        (f"Max_7_{MOODLE}_hw.yaml", f"Max_7_{MOODLE}_orbit.csv", f"Max_7_{MOODLE}_orbit.csv"),
    ],
)
def test_a_file_beside_is_found_by_the_name_that_a_student_gave_it(
    folder: Path, answers: str, name: str, expected: str
) -> None:
    assert read_file(beside(name, folder / answers)) == expected


@pytest.mark.parametrize(
    ("answers", "name", "code"),
    [
        ("bob.yaml", "ada_orbit.csv", "not_allowed"),
        ("bob.yaml", "ADA_orbit.csv", "not_allowed"),
        ("bob.yaml", "ada.yaml", "not_allowed"),
        ("bob.yaml", "roe_12_91_orbit.csv", "not_allowed"),
        ("ada.yaml", "ada_l_orbit.csv", "not_allowed"),
        ("ada_l.yaml", "ada_orbit.csv", "not_allowed"),
        ("doejane_4711_98_hw.yaml", "eve_13_92_other.csv", "not_allowed"),
        ("doejane_4711_98_hw.yaml", "other.csv", "missing_file"),
        ("ada.yaml", "../x", "path_outside"),
        ("ada.yaml", "..", "path_outside"),
        ("ada.yaml", "sub/x.csv", "path_outside"),
        ("ada.yaml", "C:x.csv", "path_outside"),
        ("ada.yaml", "x\0.csv", "path_outside"),
        ("ada.yaml", "nowhere.csv", "missing_file"),
        ("ada.yaml", "", "wrong_shape"),
        ("ada.yaml", ["x"], "wrong_shape"),
    ],
)
def test_a_file_of_another_student_or_elsewhere_is_refused(
    folder: Path, answers: str, name: object, code: str
) -> None:
    with pytest.raises(Unreadable) as refused:
        read_file(beside(name, folder / answers))
    assert refused.value.findings[0].code == code


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


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ("t,φ\n".encode(), "t,φ\n"),
        ("\ufefft,φ\n".encode(), "t,φ\n"),
        ("t\tφ\n".encode("utf-16"), "t\tφ\n"),
        ("t;µ\n".encode("cp1252"), "t;µ\n"),
        (b"\0\xff", None),
    ],
)
def test_texts_in_the_codes_of_spreadsheets(tmp_path: Path, data: bytes, expected: str | None) -> None:
    (tmp_path / "x.csv").write_bytes(data)
    if expected is None:
        with pytest.raises(Unreadable):
            read_file(tmp_path / "x.csv")
    else:
        assert read_file(tmp_path / "x.csv") == expected
