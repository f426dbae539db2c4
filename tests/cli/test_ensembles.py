"""Ensembles at the command line: rows, objects and summaries; tables of starts and what is wrong in them."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

import pytest

from tests.conftest import Program

FREE = "body: {moments: [1, 2, 3], mass: 1}\nmotion: {omega: STARTS, duration: 5, samples: 3}\n"
DRIVEN = FREE.replace("samples: 3", "samples: 3, torque: {body: [0, 0, -w3]}")
OSCILLATOR = """\
system: {coordinates: [x], lagrangian: xdot**2/2 - k*x**2/2}
parameters: {k: 4}
orbit: {initial: STARTS, duration: 2, samples: 3}
"""
TABLE = "w3,w1,w2\n2,1,.5\n\n0,0,0\n+1,2,3\n"


def written(folder: Path, text: str, starts: str = "starts.csv", table: str = "") -> str:
    """The path of a document with these starts."""
    (folder / "starts.csv").write_text(table)
    (folder / "e.yaml").write_text(text.replace("STARTS", starts))
    return str(folder / "e.yaml")


def table(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


@pytest.mark.parametrize("text", [FREE, DRIVEN])
def test_rows_of_a_table_begin_with_the_start(text: str, tmp_path: Path, program: Program) -> None:
    found = program("euler", written(tmp_path, text, table=TABLE), "-f", "csv")
    assert (found.code, found.err) == (0, "")
    rows = table(found.out)
    assert next(iter(rows[0])) == "start"
    assert [(row["start"], row["t"]) for row in rows] == [
        (s, t) for s in "012" for t in ("0.0", "2.5", "5.0")
    ]
    for place, omega in enumerate(["[1, 0.5, 2]", "[0, 0, 0]", "[2, 3, 1]"]):
        alone = table(program("euler", written(tmp_path, text, omega), "-f", "csv").out)
        for row, own in zip(rows[3 * place :], alone, strict=False):
            assert all(float(row[key]) == pytest.approx(float(own[key]), rel=1e-14, abs=1e-14) for key in own)


def test_orientations_stand_beside_the_rates(tmp_path: Path, program: Program) -> None:
    given = "w1,w2,w3,q0,q1,q2,q3\n1,2,3,2,0,0,0\n1,2,3,0,3,0,0\n"
    rows = table(program("euler", written(tmp_path, FREE, table=given), "-f", "csv").out)
    first = [[float(row[f"q{k}"]) for k in range(4)] for row in rows if row["t"] == "0.0"]
    assert first == [[1, 0, 0, 0], [0, 1, 0, 0]]
    assert float(rows[3]["Ly"]) == pytest.approx(-4)
    assert float(rows[0]["Ly"]) == pytest.approx(4)


def test_people_read_a_summary(tmp_path: Path, program: Program) -> None:
    starts = "[{x: 1, p_x: 0}, {x: 0.5, p_x: 1}, {x: 0, p_x: -1}]"
    found = program("hamilton", written(tmp_path, OSCILLATOR, starts))
    lines = found.out.splitlines()
    assert lines[1].split() == ["starts", "3"]
    first = lines[lines.index("x over the starts") + 2].split()
    assert [float(cell) for cell in first] == pytest.approx([0, 0.5, math.sqrt(1 / 6), 0, 1], abs=1e-6)


@pytest.mark.parametrize(("format", "text"), [("csv", FREE), ("json", DRIVEN), ("table", FREE)])
def test_the_bytes_do_not_depend_on_the_number_of_processes(
    format: str, text: str, tmp_path: Path, program: Program
) -> None:
    path = written(tmp_path, text, table="w1,w2,w3\n" + "".join(f"{k / 7},1,{k % 3}\n" for k in range(9)))
    assert program("euler", path, "-f", format, "-j", "2") == program("euler", path, "-f", format)
