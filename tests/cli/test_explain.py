"""`explain`: everything has a page of at most 80 columns, made of what the program itself is made of."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from rigidcli.bodies.shapes import SHAPES
from rigidcli.commands import COMMANDS
from rigidcli.errors import EXIT_CODES, RigidError
from rigidcli.fields.units import TABLE
from rigidcli.homework.base import CODES
from rigidcli.language.words import FUNCTIONS
from rigidcli.reference.entries import entries, written
from rigidcli.reference.pages import ENTRIES, Entry, explain
from rigidcli.studies.common import RESULTS
from tests.conftest import ROOT, Program
from tests.shapes import DIMENSIONS
from tests.tables import rows_of


@pytest.fixture(scope="module")
def every() -> list[Entry]:
    return entries()


def test_everything_has_a_page_that_fits(every: list[Entry]) -> None:
    typed = {".".join(entry.path[1:] or entry.path) for entry in every if entry.path[0] != "files"}
    typed |= {names.split()[0] for names, *_ in TABLE} | {*CODES, *RESULTS, *FUNCTIONS, *SHAPES, "shapes"}
    for path in sorted(typed)[::3]:
        page = explain(path)
        assert page.count("\n") > 1, path
        assert all(len(line) <= 80 and line == line.rstrip() for line in page.splitlines()), page
    assert all(len(line) <= 80 for line in explain(None).splitlines())


@pytest.mark.parametrize(("terminal", "width"), [(None, 80), (40, 60), (100, 100), (300, 120)])
def test_a_page_is_as_wide_as_the_terminal(terminal: int | None, width: int) -> None:
    pages = [explain(path, terminal) for path in (None, "axes", "notation", "conventions")]
    lengths = [len(line) for page in pages for line in page.splitlines()]
    assert width - 10 < max(lengths) <= width


PAGES = rows_of(__file__, "pages")


@pytest.mark.parametrize("path", PAGES)
def test_pages(program: Program, path: str) -> None:
    page = program("explain", path)
    assert page.code == 0
    assert [words for words in PAGES[path] if words not in page.out] == []


@pytest.mark.parametrize(
    ("path", "meant"), [("body.mas", "body.mass"), ("precess.top.spi", "precess.top.spin"), ("rmp", "")]
)
def test_an_unknown_name_is_refused_with_a_guess(program: Program, path: str, meant: str) -> None:
    done = program("explain", path)
    assert (done.code, done.out) == (2, "")
    assert f"nothing is called `{path}`" + (f" (did you mean {meant}?)" if meant else "") in done.err


def test_an_option_that_is_recommended_exists(every: list[Entry], program: Program) -> None:
    said = {words for entry in every for words in re.findall(r"`rigidcli ([^`]+)`", f"{entry}")}
    recommended = {(words.split()[0], option) for words in said for option in re.findall("--[a-z-]+", words)}
    kinds = {(words.split()[0], kind) for words in said for kind in re.findall(r"--plot-kind (\w+)", words)}
    helps = {command: program(command, "--help").out for command, _ in recommended}
    assert {(command, option) for command, option in recommended if option not in helps[command]} == set()
    assert {(command, kind) for command, kind in kinds if kind not in COMMANDS[command].pictures} == set()
    assert ("axes", "ellipsoid") in kinds


def test_a_result_that_refers_to_another_says_to_which() -> None:
    for command, fields in RESULTS.items():
        for field in fields:
            if field.title.startswith("its ") or field.title.endswith(" besides"):
                assert field.means, f"{command}.{field.key}"


def test_every_column_of_a_motion_is_explained(program: Program) -> None:
    """The heads of the csv file, those of a top included."""
    header = program("euler", "configs/top_looping.yaml", "-f", "csv", "-q").out.partition("\n")[0]
    for column in header.split(","):
        assert "euler.trajectory." in explain(column) or column in "tT"


def test_every_key_is_told_what_it_holds(every: list[Entry]) -> None:
    for entry in every:
        assert entry.text.strip(), entry.path
    for shape in SHAPES.values():
        assert set(shape.dimensions()) == {
            entry.split(":")[0].strip() for entry in _keys(DIMENSIONS[shape.word()])
        }


def _keys(dimensions: str) -> list[str]:
    """`size: [1, 2], height: 3` -> its keys."""
    from rigidcli.document.yaml_reader import read_tree

    return list(read_tree(f"{{{dimensions}}}", ""))


def test_exit_codes_are_those_of_the_errors() -> None:
    kinds, codes = [RigidError], set()
    while kinds:
        kind = kinds.pop()
        kinds += kind.__subclasses__()
        codes.add(kind.exit_code)
    assert codes <= set(EXIT_CODES)


def test_the_entries_stand_ready() -> None:
    assert ENTRIES.read_text("utf-8") == written(), "run `python -m rigidcli.reference.entries`"


def test_every_key_has_an_example_that_runs(
    program: Program, every: list[Entry], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys = [entry for entry in every if entry.path[0] in ("document", "assignment", "answers")]
    assert [entry.path for entry in keys if not entry.example and len(entry.path) > 1] == []
    shutil.copy(ROOT / "configs/bracket.stl", tmp_path)
    for example in dict.fromkeys(entry.example for entry in every if entry.example):
        (tmp_path / "example.yaml").write_text(example, "utf-8")
        *before, last = reversed(re.findall("# rigidcli (.*)", example))
        for command in (*before, last.replace("FILE", "example.yaml")):
            monkeypatch.chdir(tmp_path)
            done = program(*command.split())
            assert done.code == 0, f"{example}\n{done.err}"


def test_words_of_a_course_lead_somewhere(every: list[Entry]) -> None:
    subjects = [name for entry in every if entry.path[0] == "subjects" for name in entry.other_names]
    assert len(subjects) > 200
    for name in subjects:
        assert "  " in explain(name.title()), name
