"""Whose a hand-in is: by folders, downloads of platforms, lists of students; and files beside it."""

from __future__ import annotations

import io
import os
import stat
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
import yaml

from rigidcli.errors import DocumentError
from rigidcli.homework.base import Unreadable
from rigidcli.homework.files import MOST_BYTES, Batch, beside, gather, read_file, whose_else
from rigidcli.homework.hand_ins import Paper, papers
from rigidcli.homework.owner import is_answer
from rigidcli.homework.roster import Roster, read_roster
from tests.tables import rows_of

MOODLE = "assignsubmission_file"
TABLE = yaml.safe_load(Path(__file__).with_name("hand_ins.yaml").read_text(encoding="utf-8"))


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
    return {row.student: _told(row) for row in papers(found(folder, *given), roster, ["a"]).papers}


def answers(batch: Batch) -> list[str]:
    """The names of files that have the name of an answer file."""
    return [place.file.name for place in batch.places if is_answer(place.file.name)]


def _told(row: Paper) -> str:
    if row.outcome is None:
        return "" if row.file is None else row.file.name
    return row.outcome.findings[0].code if row.outcome.findings else row.outcome.verdict


@pytest.mark.parametrize(("files", "expected"), TABLE["students"])
def test_a_folder_tells_the_student_before_the_name_of_a_file(
    tmp_path: Path, files: list[str], expected: list[str]
) -> None:
    files = [name.replace("MOODLE", MOODLE) for name in files]
    assert sorted(owners(made(tmp_path, *files))) == sorted(expected)


@pytest.mark.parametrize(("files", "expected"), TABLE["judged"])
def test_of_several_files_the_one_that_answers_is_judged_or_none(
    tmp_path: Path, files: Any, expected: dict[str, str]
) -> None:
    made(tmp_path, *files)
    for name in files if isinstance(files, dict) else ():
        (tmp_path / name).write_bytes(dict(files)[name].encode("latin-1"))
    assert {name.casefold(): told for name, told in owners(tmp_path).items()} == {
        name.casefold(): told for name, told in expected.items()
    }


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


@pytest.mark.parametrize("given", ["ada.zip bob.zip", "ada bob", "ada.zip bob", "ada.zip bob class"])
def test_folders_within_an_archive_or_a_folder_that_is_given_are_the_students(
    tmp_path: Path, given: str
) -> None:
    made(tmp_path, "class/cleo.yaml", "class/dan.yaml")
    for name in ("ada", "bob"):
        packed(tmp_path / f"{name}.zip", {"hw3/hw.txt": "a: 1", "hw3/scan.pdf": "%PDF"})
        (tmp_path / name).mkdir()
        packed(tmp_path / name / "hw3.zip", {"hw3/hw.yaml": "a: 1"})
    found = owners(tmp_path, *given.split())
    assert {*found} == {"ada", "bob"} | ({"cleo", "dan"} if "class" in given else set())
    assert {*found.values()} <= {"hw.txt", "hw.yaml", "cleo.yaml", "dan.yaml"}


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


def entry(archive: zipfile.ZipFile, name: str, value: Any) -> None:
    """Add a file of the table: a mark, a text, or the files of an archive within."""
    plain = name.lstrip("->!~#").replace("LONG", "n" * 300)
    info = zipfile.ZipInfo(plain)
    if name.startswith("->"):
        info.external_attr = (stat.S_IFLNK | 0o777) << 16
    if isinstance(value, dict):
        inner = io.BytesIO()
        with zipfile.ZipFile(inner, "w") as within:
            for key, each in value.items():
                entry(within, key, each)
        archive.writestr(info, inner.getvalue())
    else:
        archive.writestr(info, f"answers: {{a: {value}}}" if isinstance(value, int) else value)
    info.flag_bits |= name.startswith("!")  # as the list at the end says it
    info.CRC ^= name.startswith("~")


@pytest.mark.parametrize(("files", "mark"), TABLE["archives"].values(), ids=list(TABLE["archives"]))
@pytest.mark.parametrize("has_list", [True, False])
def test_an_archive_writes_nothing_outside_and_costs_no_other(
    tmp_path: Path, files: dict[str, Any], mark: str, has_list: bool
) -> None:
    with zipfile.ZipFile(tmp_path / "class.zip", "w") as archive:
        for name, value in {"ada/hw.yaml": 1, **files, "bob/hw.yaml": 1}.items():
            entry(archive, name, value)
    roster = listed(tmp_path, "name\nada\nbob\nx\n") if has_list else None
    batch = gather([str(tmp_path / "class.zip")], None, tmp_path / "s" / "cratch")
    rows = {row.student: row for row in papers(batch, roster, ["a"]).papers}
    marks = {name: row.file.read_text()[13] for name, row in rows.items() if row.file and not row.outcome}
    assert marks == {"ada": "1", "bob": "1"} | ({"x": mark} if mark != "-" else {})
    assert {path.name for path in tmp_path.iterdir()} <= {"class.zip", "class.csv", "s"}
    assert {path.name for path in (tmp_path / "s").iterdir()} == {"cratch"}
    assert not Path("/tmp/evil.yaml").exists()
    assert all(str(problem).isprintable() for problem in batch.problems)
    assert batch.is_whole


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


@pytest.mark.parametrize(
    "text", ["[]", "x", "a: {':submitters': [ada]}", "a: {':submitters': 3}", "a: 1", "[["]
)
def test_a_list_of_gradescope_that_is_broken_names_nobody(tmp_path: Path, text: str) -> None:
    made(tmp_path, "export/a/hw.yaml", "export/b/hw.yaml")
    (tmp_path / "export/submission_metadata.yml").write_text(text)
    assert owners(tmp_path) == {"a": "hw.yaml", "b": "hw.yaml"}


# --- lists of students

LIST = 'Name,Login,ID\n"Doe, Jane",jdoe@x.edu,101\nMax Roe,mroe,102\nZoë O\'Brien,zob,103\nMax Roe,max2,104\n'


def listed(folder: Path, text: str = LIST) -> Roster:
    (folder / "class.csv").write_text(f"\ufeff{text}")
    return read_roster(folder / "class.csv")


@pytest.mark.parametrize(
    ("name", "student"),
    rows_of(__file__, "a name of the list"),
)
def test_a_name_of_the_list(tmp_path: Path, name: str, student: str) -> None:
    roster = listed(tmp_path)
    keys = roster.find(name)
    assert (roster.labels[min(keys)] if len(keys) == 1 else "") == student


@pytest.mark.parametrize(("text", "name", "student"), TABLE["heads"])
def test_lists_of_several_forms(tmp_path: Path, text: str, name: str, student: str) -> None:
    roster = listed(tmp_path, text)
    keys = roster.find(name)
    assert (roster.labels[min(keys)] if len(keys) == 1 else "") == student


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


@pytest.mark.parametrize(("files", "expected"), TABLE["lone"])
def test_a_table_alone_is_a_hand_in_of_a_student_on_the_list(
    tmp_path: Path, files: list[str], expected: dict[str, str]
) -> None:
    roster = listed(tmp_path, "name,login\nJ Doe,jdoe\nMax Moe,max\n")
    assert owners(made(tmp_path / "in", *files), roster=roster) == expected


@pytest.mark.parametrize("text", ["", "\n", "a,b\n1,2\n", "\0", "answers: {a: 1}"])
def test_what_is_no_list_of_students_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "class.csv").write_text(text)
    with pytest.raises(DocumentError, match="no list of students"):
        read_roster(tmp_path / "class.csv")


# --- files beside an answer file


FILES = {"": TABLE["files"], "_canvas": TABLE["files_canvas"]}
"""Files in a folder, and in one of Canvas."""

CASES = [(FILES[kind], *case) for kind in FILES for case in TABLE[f"beside{kind}"]]
OTHERS = [(FILES[kind], *case) for kind in FILES for case in TABLE[f"other_students{kind}"]]


def filled(folder: Path, names: Sequence[str]) -> Path:
    for name in names:
        (folder / name).write_text(name)
    return folder


@pytest.mark.parametrize(("files", "answers", "name", "expected"), CASES)
def test_a_file_beside_is_found_by_the_name_that_a_student_gave_it(
    tmp_path: Path, files: list[str], answers: str, name: str, expected: str
) -> None:
    assert read_file(beside(name, filled(tmp_path, files) / answers)) == expected


def test_a_text_beside_the_only_answer_file_is_a_table(tmp_path: Path) -> None:
    folder = filled(tmp_path, ["hw.yaml", "orbit.txt", "README.md"])
    assert read_file(beside("orbit.txt", folder / "hw.yaml")) == "orbit.txt"
    (folder / "bob.yaml").write_text("answers: {}")
    with pytest.raises(Unreadable):
        beside("orbit.txt", folder / "hw.yaml")


@pytest.mark.parametrize(("files", "answers", "name", "code"), OTHERS)
def test_a_file_of_another_student_or_elsewhere_is_refused(
    tmp_path: Path, files: list[str], answers: str, name: object, code: str
) -> None:
    with pytest.raises(Unreadable) as refused:
        read_file(beside(name, filled(tmp_path, files) / answers))
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
def test_a_file_that_may_be_of_two_students_is_told(tmp_path: Path, text: str, contested: bool) -> None:
    folder = filled(tmp_path, FILES[""])
    (folder / "bob.yaml").write_text(text)
    assert whose_else(folder / "orbit.csv", folder / "ada.yaml").startswith("another") == contested
    assert not whose_else(folder / "ada_orbit.csv", folder / "ada.yaml")


@pytest.mark.parametrize(("answers", "name", "contested"), TABLE["contested"])
def test_a_file_that_several_answers_name_is_contested(
    tmp_path: Path, answers: str, name: str, contested: bool
) -> None:
    folder = filled(tmp_path, FILES[""])
    for each in ("hw3_zoe.yaml", "hw3_max.yaml", "bob.yaml"):
        (folder / each).write_text("answers: {a: {file: zoe_motion.csv}}")
    assert bool(whose_else(folder / name, folder / answers)) == contested


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
