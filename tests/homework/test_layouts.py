"""No mark goes to another, none is doubled or lost, in whatever layout the hand-ins of a class come."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import pytest

from rigidcli.homework.files import gather, read_file
from rigidcli.homework.hand_ins import Paper, papers
from rigidcli.homework.roster import read_roster
from tests.homework.classroom import LAYOUTS, SIZE, STUDENTS, answers, handed_in, roster, write


def points(paper: Paper) -> int:
    """The points of a hand-in, which are those of its student; 0 where nothing is judged."""
    if paper.file is None or paper.outcome is not None:
        return 0
    text = read_file(paper.file)
    return next(number for number in range(1, SIZE + 1) if answers(number) == text)


@pytest.mark.parametrize("form", ["NFC", "NFD"])
@pytest.mark.parametrize("kind", ["in", "in.zip"])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_student_of_a_list_has_the_own_mark(
    layout: str, kind: str, form: Literal["NFC", "NFD"], tmp_path: Path
) -> None:
    (tmp_path / "class.csv").write_text(roster(layout), encoding="utf-8")
    given = write(tmp_path / kind, handed_in(layout, form))
    people = read_roster(tmp_path / "class.csv")
    assert len({*people.labels.values()}) == len(STUDENTS)
    batch = gather([str(given)], None, tmp_path / "scratch")
    rows = {paper.student: paper for paper in papers(batch, people, [f"q{k}" for k in range(7)], 2).papers}
    marks = {s.number: points(rows.pop(people.labels[place])) for place, s in enumerate(STUDENTS, 1)}
    assert batch.problems == []
    assert {number for number, mark in marks.items() if mark not in (number, 0)} == set()
    assert sum(number == mark for number, mark in marks.items()) >= 117
    # Those who are not found are told.
    assert bool(rows) == (0 in marks.values())


@pytest.mark.parametrize("listing", ["canvas, other numbers", "number", "short numbers", "login first"])
def test_numbers_of_a_platform_that_others_have_in_the_list_take_no_mark(
    listing: str, tmp_path: Path
) -> None:
    (tmp_path / "class.csv").write_text(roster(listing), encoding="utf-8")
    people = read_roster(tmp_path / "class.csv")
    batch = gather([str(write(tmp_path / "in", handed_in("ilias", "NFC")))], None, tmp_path / "scratch")
    rows = {
        paper.student: points(paper) for paper in papers(batch, people, [f"q{k}" for k in range(7)]).papers
    }
    marks = {s.number: rows[people.labels[place]] for place, s in enumerate(STUDENTS, 1)}
    assert {number for number, mark in marks.items() if mark not in (number, 0)} == set()


@pytest.mark.parametrize("layout", LAYOUTS)
def test_without_a_list_no_two_hand_ins_are_one(layout: str, tmp_path: Path) -> None:
    files = handed_in(layout, "NFC")
    batch = gather([str(write(tmp_path / "in", files))], None, tmp_path / "scratch")
    rows = [points(paper) for paper in papers(batch, None, [f"q{k}" for k in range(7)], 2).papers]
    expected = {s.number for s in STUDENTS} - ({12} if len(files) < len(STUDENTS) else set())
    assert {*rows} >= expected
    assert len(rows) == len(expected)
