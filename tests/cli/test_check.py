"""`rigidcli check` as graders run it: formats, views, exit codes, and what it refuses."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import zipfile
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.conftest import ROOT, Outcome, Program

ASSIGNMENT = "configs/homework/assignment.yaml"
ANSWERS = "configs/homework/answers"
HOMEWORK = yaml.safe_load(Path(__file__).with_name("homework.yaml").read_text(encoding="utf-8"))

VERDICTS = {
    "ada": ["correct"] * 7,
    "bob": ["partial", "partial", "incorrect", "incorrect", "partial", "incorrect", "incorrect"],
    "carol": ["correct", "partial", "correct", "incorrect", "partial", "missing", "missing"],
    "dave": ["invalid", "missing", "invalid", "invalid", "missing", "invalid", "incorrect"],
    "eve": ["invalid"] * 7,
}

CODES = {
    ("bob", "10.35a"): "products_of_inertia_sign",
    ("bob", "10.35b"): "moment_axis_pairing",
    ("bob", "10.39"): "wrong_unit_right_number",
    ("bob", "13.2"): "lagrangian_or_potential_sign",
    ("bob", "spring"): "hamilton_sign",
    ("bob", "orbit"): "time_range_short",
    ("carol", "10.35b"): "missing_axis",
    ("carol", "13.2"): "kinetic_factor",
    ("carol", "spring"): "missing_equation",
    ("dave", "10.39"): "not_a_number",
    ("dave", "13.2"): "parse_error",
    ("dave", "orbit"): "path_outside",
    ("eve", "13.2"): "not_allowed",
}


def asked(folder: Path, program: Program, questions: str, answers: str, *options: str) -> Outcome:
    """The outcome for an assignment of these questions and one file of answers."""
    (folder / "hw.yaml").write_text(questions)
    (folder / "x.yaml").write_text(f"answers: {{{answers}}}")
    return program("check", f"{folder}/hw.yaml", f"{folder}/x.yaml", *options)


def objects(text: str) -> dict[str, Any]:
    return {entry["student"]: entry for entry in map(json.loads, text.splitlines())}


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """An assignment of one question, and two answer files: 2 m is right."""
    (tmp_path / "hw.yaml").write_text(
        "assignment: Short\nquestions: {a: {answer: 2.000 m, kind: quantity, points: 4}}\n"
    )
    (tmp_path / "answers").mkdir()
    (tmp_path / "answers" / "one.yaml").write_text("answers: {a: 200 cm}\n")
    (tmp_path / "answers" / "two.yaml").write_text("answers: {a: 2 cm}\n")
    return tmp_path


def test_the_homework_of_the_readme(program: Program) -> None:
    before = sorted((ROOT / "configs").rglob("*"))
    done = program("check", ASSIGNMENT, ANSWERS, "-f", "json")
    assert (done.code, done.err) == (1, "")
    assert sorted((ROOT / "configs").rglob("*")) == before
    found = objects(done.out)
    verdicts = {name: [each["verdict"] for each in entry["questions"]] for name, entry in found.items()}
    assert verdicts == VERDICTS
    for (student, question), code in CODES.items():
        told = {each["id"]: each["feedback"] for each in found[student]["questions"]}[question]
        assert {remark["code"] for remark in told} == {code}, (student, question)
    assert (found["ada"]["score"], found["ada"]["max_score"]) == (17, 17)
    assert {tuple(entry) for entry in found.values()} == {
        ("schema", "student", "source", "score", "max_score", "questions")
    }


@pytest.mark.parametrize("format", ["table", "json", "html"])
def test_any_number_of_jobs_gives_the_same_bytes(format: str, program: Program) -> None:
    alone, *others = (program("check", ASSIGNMENT, ANSWERS, "-f", format, "-j", str(n)) for n in (1, 3))
    assert alone.code == 1
    assert all(other == alone for other in others)


def test_the_keys_pass_their_own_test(program: Program) -> None:
    done = program("check", "--selftest", ASSIGNMENT)
    assert (done.code, done.err) == (0, "")
    assert done.out.count("  judged     correct") == 7
    for said in (
        "10.39: quantity, 2 points\n  key        20.7962 rad/s\n",
        "  tolerance  significant_figures 3\n",
        "  tolerance  relative 0.01\n",
        "products_of_inertia_sign",
        "lagrangian_or_potential_sign",
    ):
        assert said in done.out


def test_an_answer_does_not_count_the_file_of_another_student(tmp_path: Path, program: Program) -> None:
    (tmp_path / "hw.yaml").write_text(
        "questions: {o: {answer: {t: [0, 10, 0.1], columns: {x: cos(t)}}, kind: trajectory}}"
    )
    folder = tmp_path / "in"
    folder.mkdir()
    rows = "".join(f"{n / 10},{math.cos(n / 10)!r}\n" for n in range(101))
    for name in ("ada_orbit.csv", "orbit.csv", "unused.csv"):
        (folder / name).write_text(f"t,x\n{rows}")
    for name, file in (("ada", "ada_orbit"), ("bob", "ada_orbit"), ("eve", "orbit"), ("zoe", "orbit")):
        (folder / f"{name}.yaml").write_text(f"answers: {{o: {{file: {file}.csv}}}}")
    done = program("check", f"{tmp_path}/hw.yaml", str(folder), "-f", "json")
    found = {name: entry["questions"][0] for name, entry in objects(done.out).items()}
    assert [found[name]["verdict"] for name in ("ada", "bob")] == ["correct", "invalid"]
    assert "this file is another student's" in found["bob"]["feedback"][0]["message"]
    assert [found[name]["verdict"] for name in ("eve", "zoe")] == ["review", "review"]
    assert "another student's answer names this file, too" in found["eve"]["feedback"][0]["message"]
    assert "note: no answer files, and left out: `in/unused.csv`\n" in done.err


def test_a_folder_of_pages_is_the_same_for_any_number_of_jobs(tmp_path: Path, program: Program) -> None:
    found = []
    for jobs in "14":
        folder = tmp_path / jobs
        options = ("-f", "html", "--feedback", "full", "-j", jobs, "-o", f"{folder}/")
        assert program("check", ASSIGNMENT, ANSWERS, *options) == Outcome(1, "", "")
        found.append({file.name: file.read_bytes() for file in folder.iterdir()})
        assert [file.name for file in tmp_path.iterdir() if file.name.startswith(".")] == []
    assert found[0] == found[1]
    assert set(found[0]) == {"index.html", *(f"{name}.html" for name in VERDICTS)}
    told = found[0]["ada.html"].decode()
    assert "17/17 (100%)" in told


def test_a_folder_of_pages_keeps_what_is_in_it_and_is_filled_whole_or_not_at_all(
    small: Path, program: Program
) -> None:
    words = ("check", f"{small}/hw.yaml", f"{small}/answers", "-f", "html", "-o")
    folder = small / "pages"
    folder.mkdir()
    (folder / "mine.txt").write_text("kept")
    (folder / "one.html").write_text("old")
    (small / "elsewhere").write_text("kept")
    (folder / "index.html").symlink_to(small / "elsewhere")
    (folder / "two.html").mkdir()
    before = {file: file.is_dir() or file.read_text() for file in small.rglob("*")}
    done = program(*words, str(folder))
    assert (done.code, done.out) == (2, "")
    assert "`two.html` in it is a folder" in done.err
    assert {file: file.is_dir() or file.read_text() for file in small.rglob("*")} == before
    (folder / "two.html").rmdir()
    assert program(*words, str(folder)) == Outcome(1, "", "")
    assert {file.name for file in folder.iterdir()} == {"index.html", "mine.txt", "one.html", "two.html"}
    assert (folder / "mine.txt").read_text() == (small / "elsewhere").read_text() == "kept"
    assert "4/4 (100%)" in (folder / "one.html").read_text()
    assert "0/4 (0%)" in (folder / "two.html").read_text()


def test_no_page_takes_the_place_of_a_file_that_is_read(tmp_path: Path, program: Program) -> None:
    answers = tmp_path / "index.html"
    answers.write_text("answers: {a: 1}")
    (tmp_path / "hw.yaml").write_text("questions: {a: {answer: 1, kind: number}}")
    for place in (tmp_path, answers):
        done = program("check", f"{tmp_path}/hw.yaml", str(answers), "-f", "html", "-o", str(place))
        assert (done.code, done.out) == (2, "")
        assert "would overwrite" in done.err
    assert [file.name for file in sorted(tmp_path.iterdir())] == ["hw.yaml", "index.html"]
    assert answers.read_text() == "answers: {a: 1}"


@pytest.mark.parametrize(("text", "said"), HOMEWORK["refused"])
def test_a_bad_assignment_is_refused(text: str, said: str, tmp_path: Path, program: Program) -> None:
    done = asked(tmp_path, program, text.replace("ROOT", str(ROOT)), "")
    assert (done.code, done.out) == (3, "")
    assert said in done.err
    assert "Traceback" not in done.err


# --- how people hand in, and what they see of it


def judged(folder: Path, program: Program, question: str, answer: str, *options: str) -> Any:
    """The only question of an assignment, judged, as json has it."""
    (folder / "hw.yaml").write_text(f"questions:\n  q: {question}\n")
    (folder / "x.yaml").write_text(f"answers:\n  q: {answer}\n")
    done = program("check", f"{folder}/hw.yaml", f"{folder}/x.yaml", "-f", "json", *options)
    return json.loads(done.out)["questions"][0]


@pytest.mark.parametrize(("question", "answer", "verdict", "score", "codes"), HOMEWORK["judged"])
def test_credit_is_for_what_is_right_but_for_one_thing(
    question: str, answer: str, verdict: str, score: float, codes: list[str] | None,
    tmp_path: Path, program: Program,
) -> None:  # fmt: skip
    found = judged(tmp_path, program, question, answer)
    assert (found["verdict"], found["score"]) == (verdict, pytest.approx(score, abs=1e-6))
    assert codes is None or sorted(each["code"] for each in found["feedback"]) == codes


def test_feedback_shows_the_title_the_answer_as_typed_and_as_read(tmp_path: Path, program: Program) -> None:
    question = '{answer: p**2/(2*m) + m*g*z, kind: expression, title: "Taylor 7.1 <b>"}'
    answer = r"\frac{p^2}{2m} - mgz"
    found = judged(tmp_path, program, question, answer)
    assert (found["title"], found["answer"]) == ("Taylor 7.1 <b>", answer)
    assert found["read_as"] == "p^2/(2 m) - m g z"
    words = ("check", f"{tmp_path}/hw.yaml", f"{tmp_path}/x.yaml", "-f")
    page = program(*words, "html").out
    # Formulas are set by a library of the extra `show`; without it they are text.
    typeset = "<mfrac>" if find_spec("latex2mathml") else "Read as: <bdi>p^2/(2 m) - m g z</bdi>"
    for said in ("Taylor 7.1 &lt;b&gt;", "\\frac{p^2}{2m} - mgz", typeset):
        assert said in page
    output = json.loads(program(*words, "gradescope").out)["tests"][0]["output"]
    assert output.startswith(
        f"incorrect (0/1)\nTaylor 7.1 <b>\nyour answer: {answer}\nread as: p^2/(2 m) - m g z\n"
    )


def test_the_homework_of_a_class_as_it_comes(tmp_path: Path, program: Program) -> None:
    """The folder of a student counts; what the tool cannot read comes first; nobody is left out."""
    (tmp_path / "hw.yaml").write_text("questions:\n  3: {answer: 2.34 rad/s, kind: quantity}\n")
    hands = {
        "ada/bob.yaml": "answers:\n  3: 99 rad/s\n",
        "bob/solution.yaml": "ANSWERS:\n3:2.34 rad/s\n",
        "carl/hw.yaml": "3. 2,34 rad/s\n",
        "dan/hw.yaml": "",
        "eve/scan.pdf": "%PDF",
        "fay/hw.yaml": "answers:\n  3: [[[\n",
    }
    with zipfile.ZipFile(tmp_path / "class.zip", "w") as archive:
        for name, text in hands.items():
            (tmp_path / "in" / name).parent.mkdir(parents=True)
            (tmp_path / "in" / name).write_text(text)
            archive.writestr(name, text)
    (tmp_path / "class.csv").write_text("name\nada\nbob\ncarl\ndan\neve\nfay\ngus\n")
    words = ("check", f"{tmp_path}/hw.yaml")
    done = program(*words, f"{tmp_path}/in", "-f", "json")
    expected = {"ada": "incorrect", "bob": "correct", "carl": "correct", "dan": "missing"}
    expected |= {"eve": "review", "fay": "invalid"}
    assert {name: each["questions"][0]["verdict"] for name, each in objects(done.out).items()} == expected
    assert "dan/hw.yaml: note: there are no answers in it" in done.err
    assert "note: no answer files, and left out: `eve/scan.pdf`" in done.err
    again = program(*words, f"{tmp_path}/class.zip", "-f", "json", "--roster", f"{tmp_path}/class.csv")
    expected |= {"gus": "missing"}
    assert {name: each["questions"][0]["verdict"] for name, each in objects(again.out).items()} == expected
    assert objects(again.out)["bob"]["source"] == f"{tmp_path}/class.zip/bob/solution.yaml"
    table = program(*words, f"{tmp_path}/in").out
    assert table.startswith("2 answers need a person")
    assert table.index("  eve ") < table.index("  fay ") < table.index("ada  ")


@pytest.mark.skipif(sys.platform == "win32", reason="Gradescope runs Ubuntu")
def test_the_autograder_of_gradescope_works_in_its_folders(small: Path, program: Program) -> None:
    """Its folders are source/, submission/ and results/; what would install the program does so by name."""
    source, submission = small / "source", small / "answers"
    submission.rename(small / "submission")
    source.mkdir()
    (small / "hw.yaml").rename(source / "homework.yaml")
    run = partial(subprocess.run, check=True, capture_output=True, text=True)
    run(["sh"], input=program("new", "gradescope").out, cwd=source)
    assert (source / "requirements.txt").read_text() == "rigidcli\n"
    fake = f"""#!/bin/sh
case "$*" in *venv*) mkdir -p "$3/bin"; cp "$0" "$3/bin/pip";; *requirements.txt)
printf '#!/bin/sh\nPYTHONPATH={ROOT} exec {sys.executable} -m rigidcli "$@"\n' > "${{0%pip}}rigidcli"
chmod +x "${{0%pip}}rigidcli";; esac
"""
    (small / "python3").write_text(fake)
    (small / "python3").chmod(0o755)
    path = {"PATH": f"{small}:{os.environ['PATH']}"}
    run([source / "setup.sh"], env=path)
    (source / "run_autograder").rename(small / "run_autograder")
    (small / "submission" / "two.yaml").unlink()
    for name, text, score in (("package.json", '{"name": "x"}', 4), ("b.json", '{"a": "2.1 m"}', 0)):
        (small / "submission" / name).write_text(text)
        run([small / "run_autograder"], env=path, cwd="/")
        assert json.loads((small / "results" / "results.json").read_text())["score"] == score


@pytest.mark.parametrize("kind", ["assignment", "answers"])
def test_a_starter_is_a_good_start(kind: str, tmp_path: Path, program: Program) -> None:
    for each in ("assignment", "answers"):
        (tmp_path / f"{each}.yaml").write_text(program("new", each).out)
    done = program("check", f"{tmp_path}/assignment.yaml", f"{tmp_path}/answers.yaml")
    assert (done.code, done.err) == (0, "")
    assert done.out.endswith("all correct\n")
    done = program("validate", f"{tmp_path}/{kind}.yaml")
    assert (done.code, done.err) == (0, "")
    assert ": valid\n" in done.out
