"""Variants: what is drawn for whom, what is refused, and a class whose questions are each student's own."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path

import pytest
import yaml

from rigidcli.homework.variants import Variants, filled, read_values
from tests.conftest import Program
from tests.tables import rows_of

TABLE = yaml.safe_load(Path(__file__).with_name("variants.yaml").read_text(encoding="utf-8"))

NAMES = [f"Given{number} Family{number % 977}" for number in range(12_000)]


@pytest.fixture
def course(tmp_path: Path) -> Path:
    """A folder with an assignment, its documents, and a list of four students."""
    for name, text in TABLE["documents"].items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "hw.yaml").write_text(TABLE["assignment"], encoding="utf-8")
    (tmp_path / "roster.csv").write_text(
        'name,login\n"Lovelace, Ada",al1\nBob Bär,bb2\nCy Ng,cn3\nDi Ng,dn4\n'
    )
    return tmp_path


# --- drawing


def test_values_are_the_same_on_every_machine() -> None:
    # By `sha256sum`, `["s", "m", "ada"]` is 1b7579b8... and `["s", "a", "ada"]` 2dab10db...;
    # by `bc` these are 2 modulo 3, and 4 modulo 7.
    variants = Variants("s", {"m": ("1", "2", "3"), "a": tuple("abcdefg")})
    assert variants.of("Ada") == {"m": "3", "a": "e"}


def test_every_value_comes_up_equally_often_and_parameters_do_not_go_together() -> None:
    variants = Variants("any", {"m": tuple("abcde"), "n": tuple("abcde"), "o": tuple("abc")})
    drawn = [variants.of(name) for name in NAMES]
    for name, values in variants.values.items():
        counts = Counter(each[name] for each in drawn)
        expected = len(NAMES) / len(values)
        # Chi squared of 2 or 4 degrees of freedom is below 23.5 but for one seed in ten thousand.
        assert sum((counts[value] - expected) ** 2 / expected for value in values) < 23.5
    pairs = Counter((each["m"], each["n"]) for each in drawn)
    assert sum((pairs[m, n] - 480) ** 2 / 480 for m in "abcde" for n in "abcde") < 60  # 24 degrees


def test_another_parameter_changes_nobody_and_another_seed_most() -> None:
    few = Variants("s", {"m": tuple("abcdefghij")})
    more = Variants("s", {"k": ("1", "2"), "m": tuple("abcdefghij"), "z": ("1", "2")})
    other = Variants("t", few.values)
    assert all(few.of(name)["m"] == more.of(name)["m"] for name in NAMES[:200])
    assert 0.05 < sum(few.of(name) == other.of(name) for name in NAMES[:1000]) / 1000 < 0.15


@pytest.mark.parametrize("name", ["Doe, Jane", "jane doe", " JANE  Doe ", "Ｊａｎｅ Doe"])
def test_a_student_is_the_same_however_the_name_is_written(name: str) -> None:
    variants = Variants("s", {letter: tuple("abcdefghij") for letter in "klmnop"})
    assert variants.of(name) == variants.of("Jane Doe")
    assert variants.of(name) != variants.of("John Doe")


def test_a_range_is_exact() -> None:
    assert read_values({"from": "0.1", "to": "0.3", "step": "0.1"}) == ("0.1", "0.2", "0.3")
    assert read_values({"from": "2 cm", "to": "0.3 dm", "step": "5 mm"}) == ("2 cm", "2.5 cm", "3 cm")
    assert read_values({"from": "3", "to": "-1", "step": "-2"}) == ("3", "1", "-1")
    assert len(read_values({"from": "0", "to": "0.999", "step": "0.001"})) == 1000


@pytest.mark.parametrize(("title", "values", "own", "read"), TABLE["titles"])
def test_a_title_has_the_values(title: str, values: dict[str, str], own: dict[str, str], read: str) -> None:
    assert filled(title, values, own) == read


# --- refused


@pytest.mark.parametrize(("line", "text", "said", "cured"), TABLE["refused"])
def test_what_cannot_be_drawn_is_refused_with_a_cure(
    line: int, text: str, said: str, cured: str, course: Path, program: Program
) -> None:
    lines = TABLE["assignment"].splitlines()
    for wanted in (text, cured):
        lines[line - 1] = wanted
        (course / "hw.yaml").write_text("\n".join(lines), encoding="utf-8")
        done = program("validate", f"{course}/hw.yaml")
        if wanted is text:
            assert (done.code, done.out) == (3, "")
            assert said in done.err.replace(f"{course}/", "")
    assert (done.code, done.err) == (0, "")


def test_a_value_without_a_key_is_refused_before_anybody_is_judged(course: Path, program: Program) -> None:
    (course / "top.yaml").write_text(
        "parameters: {w: 900 rpm}\nbody: {shape: cone, radius: 2 cm, height: 10 cm, mass: 1 kg}\n"
        "about: apex\ntop: {spin: w, tilt: 30 deg}\n"
    )
    (course / "hw.yaml").write_text(
        "seed: s\nvariants: {w: [30000 rpm, 1 rpm]}\n"
        "questions:\n  1: {document: top.yaml, ask: precess.top.slow_rate}\n"
    )
    done = program("check", f"{course}/hw.yaml", "--sheets", "-f", "csv", "--roster", f"{course}/roster.csv")
    assert (done.code, done.out) == (3, "")
    assert (
        "hw.yaml:4: questions.1.ask: this document has no such result: it is null, with w = 1 rpm" in done.err
    )


# --- a class


def test_sheets_and_marks_belong_to_the_student(course: Path, program: Program) -> None:
    assignment, roster = f"{course}/hw.yaml", f"{course}/roster.csv"
    done = program("check", assignment, "--sheets", "--roster", roster, "-f", "csv")
    assert (done.code, done.err) == (0, "")
    head, *rows = [line.split(",") for line in done.out.replace('"Lovelace, Ada"', "Ada").splitlines()]
    assert head == ["student", "name", "login", "m", "a", "1", "2", "3"]
    assert program("check", assignment, "--sheets", "--roster", roster, "-o", f"{course}/sheets/").code == 0
    pages = {path.name: path.read_text(encoding="utf-8") for path in (course / "sheets").iterdir()}
    assert sorted(pages) == ["Bob-Bär.html", "Cy-Ng.html", "Di-Ng.html", "Lovelace-Ada.html"]
    assert all("<title>hw: " in page and "<h1><bdi>hw</bdi></h1>" in page for page in pages.values())
    for student, _, login, m, a, *_ in rows:
        page = pages["Lovelace-Ada.html" if student == "Ada" else f"{student.replace(' ', '-')}.html"]
        assert f"m = {m}, a = {a}" in page
        mass, radius = float(m.split()[0]), float(a.split()[0]) / 100
        # A cylinder has m r^2/2 about its axis, and m (3 r^2 + h^2)/12 across it.
        moments = [mass * (3 * radius**2 + 0.04**2) / 12] * 2 + [mass * radius**2 / 2]
        (course / "in" / login).mkdir(parents=True)
        (course / "in" / login / "hw.yaml").write_text(
            f"answers: {{1: {moments}, 2: {(8 / mass) ** 0.5}, 3: x}}"
        )
    one, two = (
        program("check", assignment, f"{course}/in", "--roster", roster, "-f", "json", "-j", jobs)
        for jobs in "12"
    )
    assert (one.code, one.err) == (1, "")
    assert one == two
    for entry, (_, _, _, m, a, *_) in zip(map(json.loads, one.out.splitlines()), rows, strict=True):
        assert [each["verdict"] for each in entry["questions"]] == ["correct", "correct", "incorrect"]
        assert entry["questions"][0]["values"] == {"m": m, "a": a}
        assert [each["title"] for each in entry["questions"]] == [f"m = {m}, a = {a}", f"m = {m}", ""]


def test_another_student_changes_nobody_even_one_of_the_same_name(course: Path, program: Program) -> None:
    def sheets() -> list[str]:
        options = ("--sheets", "--roster", f"{course}/roster.csv", "-f", "csv", "--no-header")
        rows = program("check", f"{course}/hw.yaml", *options).out.splitlines()
        return [
            row.partition(f",{login},")[2]
            for login in ("al1", "bb2", "cn3", "dn4")
            for row in rows
            if login in row
        ]

    before = sheets()
    with (course / "roster.csv").open("a") as file:
        file.write("Cy Ng,cn5\nAda Abel,aa6\n")
    assert len(before) == 4
    assert sheets() == before


def test_nobody_is_judged_by_the_values_of_another(course: Path, program: Program) -> None:
    (course / "in").mkdir()
    (course / "in" / "stranger.yaml").write_text("answers: {1: 1 2 3, 2: 2, 3: prolate}")
    done = program(
        "check", f"{course}/hw.yaml", f"{course}/in", "--roster", f"{course}/roster.csv", "-f", "csv"
    )
    mine = [line for line in done.out.splitlines() if line.startswith("stranger,")]
    assert len(mine) == 3
    assert all(",review,0.0,1.0,undecided," in line and "not in the roster" in line for line in mine)
    done = program("check", f"{course}/hw.yaml", f"{course}/in", "-f", "csv")
    assert "note: without a --roster, the name of a folder or file decides" in done.err


def test_pages_items_and_a_test_of_the_keys_name_the_values(course: Path, program: Program) -> None:
    (course / "in").mkdir()
    (course / "in" / "cn3.yaml").write_text("answers: {1: 1 2 3, 2: 7}")
    options = (f"{course}/hw.yaml", f"{course}/in", "--roster", f"{course}/roster.csv")
    told = program("check", *options, "--items").out
    assert "7  (m = " in told
    assert program("check", *options, "-f", "html", "-o", f"{course}/pages/").code == 1
    assert "m = " in (course / "pages" / "Cy-Ng.html").read_text(encoding="utf-8")
    done = program("check", "--selftest", f"{course}/hw.yaml")
    assert (done.code, done.err) == (0, "")
    assert [done.out.count(f"judged     {word}") for word in ("correct", "")] == [7, 7]
    for values in ("m = 1 kg, a = 2 cm", "m = 3 kg, a = 5 cm", "m = 2 kg, a = 3.5 cm"):
        assert f"  values     {values}\n" in done.out


def test_the_starter_leads_an_instructor_to_sheets_and_marks(course: Path, program: Program) -> None:
    """What the starter says is done as it is said, and nothing else."""
    starter = program("new", "assignment").out
    block = re.findall(r"^#   ((?:parameters|body): .*)$", starter, re.MULTILINE)
    (course / "block.yaml").write_text("\n".join(block))
    (course / "hw.yaml").write_text(re.sub(r"# (?=seed:|variants:|block\d:)", "", starter))
    (course / "in" / "al1").mkdir(parents=True)
    (course / "in" / "al1" / "answers.yaml").write_text(program("new", "answers").out)
    (course / "roster.csv").rename(course / "class.csv")
    commands = re.findall(r"^#   rigidcli (check .*?)(?:  |$)", starter, re.MULTILINE)
    assert len(commands) == 5
    names = {"FILE": f"{course}/hw.yaml", "ANSWERS/": f"{course}/in/", "sheets/": f"{course}/sheets/"}
    for command in commands:
        words = [
            names.get(word, word.replace("class.csv", f"{course}/class.csv")) for word in command.split()
        ]
        done = program(*words)
        assert done.code == ("ANSWERS/" in command)
        assert done.err == "" or "without a --roster" in done.err
    assert "Lovelace, Ada  6/14" in done.out
    assert "  others  0/8  missing" in done.out


def test_an_answer_in_letters_is_not_told_the_values(course: Path, program: Program) -> None:
    question = "{document: spring.yaml, ask: hamilton.hamiltonian, title: H in letters}"
    text = TABLE["assignment"].replace("{answer: prolate, kind: choice}", question)
    for numbers, said in (("symbols", "H in letters"), ("allowed", "H in letters (m = 2 kg)")):
        (course / "hw.yaml").write_text(text.replace("in letters}", f"in letters, numbers: {numbers}}}"))
        options = ("--sheets", "--roster", f"{course}/roster.csv", "-f", "csv", "--no-header")
        rows = program("check", f"{course}/hw.yaml", *options).out
        assert any(row.endswith(f",{said}") for row in rows.splitlines())


@pytest.mark.parametrize(
    ("options", "said"),
    rows_of(__file__, "sheets say what they need"),
)
def test_sheets_say_what_they_need(options: tuple[str, ...], said: str, program: Program) -> None:
    done = program("check", "hw.yaml", *options)
    assert (done.code, done.out) == (2, "")
    assert said in " ".join(done.err.split())
