"""Programs of equations of motion: they run by themselves, and give the orbit that rigidcli gives."""

from __future__ import annotations

import csv
import io
import re
import runpy
import shutil
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import pytest
import yaml

import rigidcli
from rigidcli import Result
from rigidcli.core.arithmetic import Floats
from rigidcli.language.words import RESERVED
from rigidcli.render import Format, Look, renderer
from rigidcli.render.program import PYTHON
from rigidcli.report import Report
from tests.conftest import ROOT, Program
from tests.tables import rows_of

GOLDEN = Path(__file__).parent.parent / "golden"

COMPILER = shutil.which("cc") or shutil.which("gcc")


STRICT = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O1"]

SYSTEMS = yaml.safe_load(Path(__file__).with_name("programs.yaml").read_text(encoding="utf-8"))


def _result(system: str | list[str]) -> Result:
    """What `hamilton` finds of a document: of its text, or of its path and settings."""
    document, *settings = [system] if isinstance(system, str) else system
    return rigidcli.hamilton(document, settings=settings, program=True)


def _written(report: Report, form: str) -> str:
    """The report in a format."""
    return "".join(renderer(Format(form))([report], Look()))


def _run_python(source: str, folder: Path) -> str:
    """What the program prints, run in this process, where warnings are errors, too."""
    (folder / "program.py").write_text(source, encoding="utf-8")
    with redirect_stdout(io.StringIO()) as out:
        runpy.run_path(str(folder / "program.py"), run_name="__main__")
    return out.getvalue()


def _compile(source: str, folder: Path, *options: str) -> None:
    (folder / "program.c").write_text(source, encoding="utf-8")
    command = [COMPILER or "cc", *STRICT, "program.c", *options]
    done = subprocess.run(command, cwd=folder, check=False, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")


def _run_c(source: str, folder: Path) -> str:
    _compile(source, folder, "-o", "program", "-lm")
    return subprocess.run(
        ["./program"], cwd=folder, check=True, capture_output=True, text=True, timeout=60
    ).stdout


def _table(text: str) -> tuple[list[str], Floats]:
    header, *rows = csv.reader(io.StringIO(text))
    return header, np.array(rows, dtype=np.float64)


def _assert_same_orbit(printed: str, expected: str) -> None:
    """The tables agree to 1e-8 of the largest number in a column; what is below 1e-12 is zero."""
    header, values = _table(printed)
    columns, orbit = _table(expected)
    assert header == columns
    assert values.shape == orbit.shape
    scale = np.abs(orbit).max(axis=0)
    assert np.all(np.abs(values - orbit) <= 1e-8 * scale + 1e-12)


@pytest.mark.parametrize("name", SYSTEMS)
def test_programs_give_the_orbit(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    found = _result(SYSTEMS[name])
    expected = _written(found, "csv")
    _assert_same_orbit(_run_python(_written(found, "python"), tmp_path), expected)
    if COMPILER is None:
        pytest.skip("the Python is right; no C compiler is installed")
    _assert_same_orbit(_run_c(_written(found, "c"), tmp_path), expected)


SMALL = """
name: driven pendulum with friction
parameters: {m: 0.5, l: 2, g: 9.81, lambda: 0.1, w: 3}
system:
  coordinates: [theta]
  lagrangian: m*l^2*thetadot^2/2 + m*g*l*cos(theta) + m*l*lambda*w^2*sin(theta)*cos(w*t)
  forces: {theta: -lambda*thetadot}
orbit: {initial: {theta: 1, p_theta: 0}, duration: 10, samples: 101}
"""


@pytest.mark.parametrize("form", ["python", "c"])
def test_golden_text(form: str) -> None:
    assert _written(_result(SMALL), form) == (GOLDEN / f"program_{form}.txt").read_text()


def test_a_program_in_python_needs_nothing_of_ours(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text((GOLDEN / "program_python.txt").read_text(), encoding="utf-8")
    command = [sys.executable, "-I", "-W", "error", "program.py"]
    out = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True, timeout=60).stdout
    _assert_same_orbit(out, _written(_result(SMALL), "csv"))


HOSTILE = r"""a\n#error\r\nimport os */ =# /* #= ??/\n\"\"\" \\ $(x) \u2028 coding: utf-7 ??/"""


@pytest.mark.parametrize("form", ["python", "c"])
def test_a_hostile_name_stays_a_comment(form: str, tmp_path: Path) -> None:
    lines = _written(_result(SMALL.replace("driven pendulum with friction", f'"{HOSTILE}"')), form).split(
        "\n"
    )
    kept = _written(_result(SMALL), form).split("\n")
    mark = "//" if form == "c" else "#"
    assert [line for line in lines if line[: len(mark)] != mark] == [
        line for line in kept if line[: len(mark)] != mark
    ]
    assert not any(line.endswith(("\\", "??/")) or not line.isprintable() for line in lines)
    assert "coding" not in "".join(lines[:2])
    if form == "c" and COMPILER is not None:
        _compile("\n".join(lines), tmp_path, "-c")


@pytest.mark.parametrize(
    ("form", "names"),
    [
        ("python", sorted(name for name in PYTHON.words - RESERVED if name[0] != "_")[::7]),
        ("c", ["double", "printf", "M_PI", "state", "fabs", "H", "y0", "linux", "main", "VARIABLES"]),
    ],
)
def test_no_word_of_a_language_is_a_name(form: str, names: list[str]) -> None:
    values = ", ".join(f"{name}: 2" for name in names)
    text = (
        f"parameters: {{{values}}}\n"
        f"system: {{coordinates: [xx], lagrangian: xxdot^2/2 - ({' + '.join(names)})*xx}}\n"
    )
    source = _written(_result(text), form)
    assert re.findall(r"\b(\w+) = 2\.0", source) == [f"{name}_" for name in names]


def test_without_an_orbit_there_are_functions_only(tmp_path: Path) -> None:
    text = "parameters: {m: null, k: 2}\nsystem: {coordinates: [x], lagrangian: m*xdot^2/2 - k*x^2/2}"
    source = _written(_result(text), "python")
    assert "m = nan  # it has no value in the document: give it one here" in source
    names: dict[str, object] = {}
    exec(compile(source.replace("m = nan", "m = 4.0"), "program.py", "exec"), names)
    assert names["f"](0.0, [3.0, 2.0]) == [0.5, -6.0]  # type: ignore[operator]
    assert names["H"](0.0, [3.0, 2.0]) == 9.5  # type: ignore[operator]
    assert "no orbit" in source
    assert "A program of yours has them by" in source
    assert "python program.py" not in source
    if COMPILER is not None:
        _compile(_written(_result(text), "c"), tmp_path, "-c")


def test_a_program_says_that_it_has_no_observables() -> None:
    text = "system: {coordinates: [x], lagrangian: xdot^2/2}\nobservables: {a: x^2, b: p_x}"
    assert "# without the observables of the document: a, b\n" in _written(_result(text), "python")


FREE = "system: {coordinates: [x], lagrangian: m*xdot^2/2}"


@pytest.mark.parametrize(
    ("arguments", "text", "code", "message"),
    rows_of(__file__, "what is refused"),
)
def test_what_is_refused(arguments: list[str], text: str, code: int, message: str, program: Program) -> None:
    outcome = program(arguments[0], "-f", "c", *arguments[1:], stdin=text)
    assert (outcome.code, outcome.out) == (code, "")
    assert message in outcome.err.replace("\n", " ")
