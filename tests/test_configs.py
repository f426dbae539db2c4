"""Every document in configs/ runs in every command and format, and gives what its comment promises."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
import subprocess
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import rigidcli
from rigidcli import STUDIES
from rigidcli.errors import ComputationError
from rigidcli.render import TRAITS, Format, Look, formats_of, renderer
from rigidcli.studies.common import RESULTS

from .conftest import ROOT, Program
from .markup import markup

CONFIGS = sorted((ROOT / "configs").glob("*.yaml"))
STARTERS = sorted(
    set((ROOT / "rigidcli" / "starters").glob("*.yaml")) - {ROOT / "rigidcli/starters/mesh.yaml"}
)
"""The documents that `new` prints; that of a mesh names a file, and is tried beside it in test_body_files."""


def commands(path: Path) -> list[str]:
    """The commands that the keys of a document call for."""
    keys = yaml.safe_load(path.read_text())
    turning = "body" in keys and "omega" in keys.get("motion", {})
    return [
        *(["inertia", "axes"] if "body" in keys else []),
        *(["precess"] if turning or keys.keys() & {"top", "tide"} else []),
        *(["euler"] if turning or "tilt" in keys.get("top", {}) else []),
        *(["hamilton"] if "system" in keys else []),
    ]


RUNS = [(path, command) for path in [*CONFIGS, *STARTERS] for command in commands(path)]

NOTES = {
    "inertia": "masses are those of ",
    "axes": "(masses are those of |A and B count as equal)",
    "hamilton": "(the mass matrix is singular|it is an equilibrium|the mode .* oscillates) where ",
}
"""What notes may say: how a molecule is read, where something holds or fails of a system; all of motions."""


DRAWN = {(path, commands(path)[-1]) for path in CONFIGS}
"""Pages take longest: each document in the command that tells most of it."""


def named(case: Any) -> str:
    return case.stem if isinstance(case, Path) else case


def starts_of(orbit: Any, folder: Path) -> int:
    """How many starts an orbit has: the lines of a table beside the document, but for its heads."""
    table = orbit and orbit["initial"]
    return (folder / table).read_text().count("\n") - 1 if isinstance(table, str) else 1


def is_explained(key: str, value: Any, command: str) -> bool:
    """Whether `explain` knows a result, or all that is in it."""
    known = {"schema", "name", "source", "units", *(field.key for field in RESULTS[command])}
    inner = {f"{key}.{name}" for name in value} if isinstance(value, dict) else {key}
    return key in known or inner <= known


@pytest.mark.parametrize(("path", "command"), RUNS, ids=named)
def test_runs_in_every_command_and_format(path: Path, command: str, program: Program) -> None:
    """Of a motion with many starts, each format has its own reports; of others, one is written in all."""
    document = yaml.safe_load(path.read_text())
    orbit = document.get("orbit")
    starts = starts_of(orbit, path.parent)
    # An object for each of thousands of starts takes too long here.
    few = ["--set", "orbit.initial=[{theta: 1, p_theta: 0}, {theta: 2, p_theta: 0}]"] if starts > 100 else []
    outcome = program(command, "-f", "json", str(path), *few)
    assert outcome.code == 0, outcome.err
    for line in outcome.err.splitlines():
        assert re.match(re.escape(f"{path}: note: ") + NOTES.get(command, ""), line)
    lines = outcome.out.splitlines()
    assert len(lines) == (2 if few else starts)
    found = json.loads(lines[0])
    assert found["schema"] == f"rigidcli.{command}/1"
    assert [key for key in found if not is_explained(key, found[key], command)] == []
    if (path, command) in DRAWN:
        page = markup(program(command, "-f", "html", str(path)).out)
        assert page.all("h1")
        assert not [each for each in page.all("span") if each.attributes.get("class") == "latex"]
    has_formulas = command == "hamilton" and "functions" not in document["system"] and starts == 1
    result = getattr(rigidcli, command)(path, **({"program": True} if has_formulas else {}))

    def written(form: Format) -> str:
        if starts > 1:
            return program(command, "-f", form, str(path)).out
        return "".join(renderer(form)([result], Look()))

    for form in formats_of(command):
        if TRAITS[form].program and not has_formulas:
            assert program(command, "-f", form, str(path)).code == (3 if starts == 1 else 2)
        elif TRAITS[form].studies:
            with suppress(ComputationError) if command == "inertia" else nullcontext():
                assert written(form).endswith("\n")
        elif form is Format.csv:
            header, *rows = csv.reader(io.StringIO(written(form)))
            assert {len(header)} == {len(row) for row in rows}
            samples = orbit.get("samples", 1001) if command == "hamilton" and orbit else 1
            assert len(rows) == starts * samples or command == "euler" or "section" in orbit
        elif form is Format.latex:
            text = written(form)
            assert text.count(r"\begin{") == text.count(r"\end{") > 0
        elif form is Format.table:
            assert written(form).endswith("\n")


@pytest.mark.parametrize("command", STUDIES)
def test_a_format_of_another_command_is_refused(command: str, program: Program) -> None:
    forms = formats_of(command)
    for form in set(Format) - {*forms}:
        outcome = program(command, "-f", form, str(CONFIGS[0]))
        assert (outcome.code, outcome.out) == (2, "")
        named = set(re.findall(r"'(\w+)'", outcome.err.partition("not one of")[2]))
        assert named == {str(each) for each in forms}


@pytest.mark.parametrize("command", STUDIES)
def test_all_documents_go_into_one_table(command: str, program: Program, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="tables in Parquet need the extra `parquet`")
    # Sections and swarms take long, and their rows are like those of other orbits.
    short = [path for path, name in RUNS if name == command and not re.search("section|swarm", path.stem)]
    files = list(map(str, short))
    assert program(command, "-q", "-f", "parquet", "-o", str(tmp_path / "all.parquet"), *files).code == 0
    names = set(parquet.read_table(tmp_path / "all.parquet").column("name").to_pylist())
    assert len(names) == len({rigidcli.load(file).name for file in files})


def compiled(source: str, folder: Path) -> list[str]:
    """What TeX has to say of a document: errors, and what runs off the page by more than a letter."""
    (folder / "all.tex").write_text(source)
    latex = ["pdflatex", "-halt-on-error", "all.tex"]
    done = subprocess.run(latex, cwd=folder, check=False, capture_output=True, text=True, timeout=60)
    complaints = [line for line in done.stdout.splitlines() if line.startswith(("!", "l."))]
    wide = re.findall(r"Overfull \\hbox \((\d+)\..*", done.stdout)
    return [*complaints, *(f"{points} pt too wide" for points in wide if int(points) > 5)]


def latex(command: str, program: Program, *options: str) -> str:
    """The LaTeX of all documents that a command applies to."""
    return program(
        command, "-f", "latex", *options, *(str(path) for path, name in RUNS if name == command)
    ).out


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_latex_compiles_with_amsmath_alone(tmp_path: Path, program: Program) -> None:
    told = "".join(latex(command, program) for command in ("axes", "hamilton"))
    body = f"\\usepackage{{amsmath}}\\begin{{document}}\n{told}\\end{{document}}\n"
    assert not any(line[0] in "!l" for line in compiled(f"\\documentclass{{article}}{body}", tmp_path))


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
@pytest.mark.parametrize("command", STUDIES)
def test_standalone_latex_compiles_and_stays_on_the_page(
    command: str, tmp_path: Path, program: Program
) -> None:
    assert compiled(latex(command, program, "--standalone", "--steps", "-v"), tmp_path) == []


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_any_name_compiles(tmp_path: Path, program: Program) -> None:
    name = r"50 % of $x_1$ & #2 \input{a} ~ ^ {θ} [é] <b>"
    document = f"name: '{name}'\nbody: {{parts: [{{name: '{name}', shape: cube, side: 1, mass: 1}}]}}"
    source = program("inertia", "-f", "latex", "--standalone", "--steps", "-", stdin=document).out
    assert "U+03B8" in source
    assert compiled(source, tmp_path) == []


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_has_the_modeline_and_a_comment(path: Path) -> None:
    lines = path.read_text().splitlines()
    assert lines[0] == "# yaml-language-server: $schema=.rigidcli.schema.json"
    assert any(line.startswith("# Comes out:") for line in lines)


def test_the_schema_for_editors_is_up_to_date(program: Program) -> None:
    """Made anew by: rigidcli schema -o configs/.rigidcli.schema.json."""
    # Others are asked before: no schema may leave anything behind in the next one.
    assert all(program("schema", kind).code == 0 for kind in ("assignment", "answers"))
    assert program("schema").out == (ROOT / "configs" / ".rigidcli.schema.json").read_text()


def axes(name: str, **options: Any) -> Any:
    return rigidcli.axes(rigidcli.load(ROOT / "configs" / f"{name}.yaml", **options))


def test_flywheel() -> None:
    """Discs and rings by hand: M = rho pi (R^2 - r^2) h and I = M (R^2 + r^2)/2, holes by Steiner."""
    rings = [(0.18, 0.02, 0.02), (0.2, 0.18, 0.06), (0.02, 0.01, 0.08)]
    masses = [7850 * np.pi * (R**2 - r**2) * h for R, r, h in rings]
    drilled = 7850 * np.pi * 0.03**2 * 0.02
    moment = sum(m * (R**2 + r**2) / 2 for m, (R, r, _) in zip(masses, rings, strict=True))
    moment -= 4 * drilled * (0.03**2 / 2 + 0.11**2)
    result = axes("flywheel")
    assert result["mass"] == pytest.approx(sum(masses) - 4 * drilled, rel=1e-14)
    assert result["tensor"][2, 2] == pytest.approx(moment, rel=1e-13)
    assert result["kinetic_energy"] == pytest.approx(moment * (50 * np.pi) ** 2 / 2, rel=1e-13)
    assert result["wobbles"] is False
    assert result["class"] == "oblate"


def test_known_tensor() -> None:
    result = axes("known_tensor")
    d = np.array([0.1, 0, 0.15])
    about_origin = np.array([[0.42, 0.03, -0.01], [0.03, 0.36, 0.02], [-0.01, 0.02, 0.51]])
    about_origin += 12.5 * (d @ d * np.eye(3) - np.outer(d, d))
    np.testing.assert_allclose(result["moments"], np.linalg.eigvalsh(about_origin), rtol=1e-13)
    omega = np.array([0, 2 * np.pi, 2 * np.pi])
    momentum = about_origin @ omega
    cosine = omega @ momentum / np.linalg.norm(omega) / np.linalg.norm(momentum)
    assert result["angle"] == pytest.approx(np.arccos(cosine), rel=1e-12)
    assert result["wobbles"] is True
