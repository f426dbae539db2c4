"""The house rules: what must be named in one place, and what fails when it is forgotten."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import subprocess
from importlib import resources, util
from pathlib import Path
from typing import get_args

import pytest
import typer

import rigidcli
from rigidcli import STUDIES
from rigidcli.bodies import primitives, shapes
from rigidcli.cli import app, options
from rigidcli.cli.check import CheckFormat
from rigidcli.cli.printing import Kind
from rigidcli.commands import COMMANDS
from rigidcli.core import free_body, nutation, precession, principal
from rigidcli.homework.base import CODES
from rigidcli.homework.base import AnswerKind as KindOfAnswer
from rigidcli.homework.kinds import KINDS
from rigidcli.homework.question import Credited, KindName
from rigidcli.homework.reports.formats import FORMATS
from rigidcli.render import TRAITS, Format, renderer
from rigidcli.render.plots import LIBRARIES
from rigidcli.studies.common import RESULTS, WORDS

MOST_LINES = {
    "algebra": 2972,  # sizes count nodes; conserved quantities have parameters as coefficients
    "bodies": 5088,  # digits that were typed, silences that are told, prisms, files as others write them
    "cli": 2076,  # a gallery of the examples; orbits of a sweep together; sheets and gradebooks
    "core": 4652,  # orbits from many starts in arrays, stiff systems, jumps at stops, motion to and fro
    "document": 3344,  # cures for people who know other tools; constraints, observables
    "fields": 2049,  # a section reads on with the key that is meant
    "homework": 9264,  # doubts of what stands around a value; variants; one rule for whose a hand-in is
    "language": 2620,  # sentences around formulas; one reader, with readings; one pattern of numbers
    "mechanics": 2951,  # generating functions and their inverses, conserved quantities by Noether
    "reference": 572,  # examples of keys, the words of a course, and sentences on the value of each key
    "render": 2757,  # formulas within sentences are typeset; a slider over the values of a sweep
    "studies": 7866,  # constraints, observables, many orbits, periods; the response to driving forces
    "": 1625,  # fields of a result are attributes; settings that nothing uses are refused in Python
}
"""The most lines of Python that each room may have; "" is what stands at the top.

A room that shrinks lowers its number in the same commit. None is raised without a reason beside it.
"""

ROOT = Path(__file__).resolve().parents[1]

TOP_LEVEL = {"CHANGELOG.md", "LICENSE", "README.md", "configs", "pyproject.toml", "rigidcli", "tests"}

DRAWING = {f"rigidcli.render.plots.{module}" for module in LIBRARIES}
"""Modules that need the extra `show`."""


def _names(package: str) -> set[str]:
    module = importlib.import_module(package)
    return {found.name for found in pkgutil.iter_modules(module.__path__)}


def test_no_room_is_larger_than_it_may_be() -> None:
    lines = dict.fromkeys(MOST_LINES, 0)
    top = Path(rigidcli.__file__).parent
    for path in top.rglob("*.py"):
        room, *inside = path.relative_to(top).parts
        room = room if inside else ""
        assert room in lines, f"rigidcli/{room} is a room without a number of lines"
        lines[room] += len(path.read_text(encoding="utf-8").splitlines())
    assert {room: count for room, count in lines.items() if count > MOST_LINES[room]} == {}


def test_every_primitive_is_in_the_table() -> None:
    functions = {
        value
        for name, value in vars(primitives).items()
        if inspect.isfunction(value) and value.__module__ == primitives.__name__ and name[0] != "_"
    }
    assert functions == set(shapes.PRIMITIVES)


@pytest.mark.parametrize("name", shapes.SHAPES)
def test_a_shape_has_the_name_under_which_it_is_listed(name: str) -> None:
    assert shapes.SHAPES[name].model_json_schema()["properties"]["shape"]["const"] == name


def test_every_format_is_a_module_and_every_module_a_format() -> None:
    assert {*FORMATS, "html"} == set(CheckFormat)
    helpers = {"prose", "terminal", "values", "plots", "programs", "several", "units", "web"}
    modules = {traits.module or format.value for format, traits in TRAITS.items()}
    assert _names("rigidcli.render") - helpers == modules
    assert all(callable(renderer(name)) for name in Format)
    assert set(TRAITS) == set(Format)


def test_every_study_and_command_is_listed_and_has_its_modules() -> None:
    helpers = {"body", "common", "ensembles", "pictures", "results", "robots", "writing"}
    assert _names("rigidcli.studies") - helpers == set(STUDIES)
    parts = {"app", "computing", "folder", "options", "output", "work"}
    others = {row.module for row in COMMANDS.values() if not row.needs}
    assert _names("rigidcli.cli") - parts == others
    program = typer.main.get_command(app.app)
    assert isinstance(program, app.Commands)
    assert all(program.get_command(typer.Context(program), name) for name in COMMANDS)
    offered = {name for name in rigidcli.__all__ if callable(getattr(rigidcli, name)) and name in COMMANDS}
    assert offered == {*STUDIES, "check", "validate"}
    assert set(RESULTS) == set(STUDIES)


def test_every_option_of_the_table_belongs_to_a_command() -> None:
    code = "".join(path.read_text("utf-8") for path in Path(options.__file__).parent.glob("*.py"))
    assert [key for key in options.OPTIONS if f'option("{key}"' not in code] == []


def test_every_study_has_pictures() -> None:
    for kinds in (COMMANDS[study].pictures for study in STUDIES):
        assert kinds
        for kind, module in kinds.items():
            assert callable(getattr(importlib.import_module(f"rigidcli.studies.{module}"), kind)), kind


def test_every_word_of_a_result_is_told_to_people() -> None:
    regimes = {word for words in get_args(free_body.Regime) for word in get_args(words)}
    told = {
        "class": {
            *get_args(principal.BodyClass),
            "",
        },  # "" is a symmetric body whose order depends on letters
        "rotor": {*get_args(principal.BodyClass)},
        "wobbles": {"yes", "no"},
        "top.sleeping": {*get_args(precession.Stability)},
        "top.nutation_kind": {*get_args(nutation.NutationKind)},
        "motion": {*regimes, "driven"},
    }
    assert {(key, word) for key, words in told.items() for word in words} == {*WORDS}
    assert told.keys() <= {entry.key for fields in RESULTS.values() for entry in fields}


def test_every_kind_of_answer_is_listed() -> None:
    assert set(KINDS) == set(get_args(KindName))
    assert all(isinstance(kind, KindOfAnswer) for kind in KINDS.values())
    assert all(kind.name == name for name, kind in KINDS.items())
    assert set(get_args(Credited)) <= set(CODES)


def test_every_starter_is_a_kind() -> None:
    files = {Path(entry.name).stem for entry in resources.files("rigidcli").joinpath("starters").iterdir()}
    assert files == set(Kind)


def test_every_module_says_what_it_is() -> None:
    for found in pkgutil.walk_packages(rigidcli.__path__, "rigidcli."):
        if found.name in DRAWING and any(util.find_spec(library) is None for library in LIBRARIES.values()):
            continue  # they need the extra `show`
        assert importlib.import_module(found.name).__doc__, found.name


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="only a checkout knows which files are kept")
def test_the_top_level_holds_only_what_belongs_there() -> None:
    kept = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    top = {name.split("/")[0] for name in kept.stdout.splitlines()}
    assert {name for name in top if not name.startswith(".")} == TOP_LEVEL
