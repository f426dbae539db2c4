"""`-f parquet`: the cells of csv, with types and units, in one file, the same for any `-j`."""

from __future__ import annotations

import csv
import io
from importlib import util
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import Program

TOP = "configs/cone_top.yaml"

needs_arrow = pytest.mark.skipif(util.find_spec("pyarrow") is None, reason="pyarrow is not installed")


def rows_of(path: Path) -> list[dict[str, Any]]:
    from pyarrow import parquet

    rows: list[dict[str, Any]] = parquet.read_table(path).to_pylist()
    return rows


def cells(text: str) -> list[dict[str, Any]]:
    """The rows of csv, where an empty cell is nothing."""
    return [{head: value or None for head, value in row.items()} for row in csv.DictReader(io.StringIO(text))]


def same(value: Any, cell: str | None) -> bool:
    """Whether a value is what a cell of csv says."""
    return float(cell or "nan") == value if isinstance(value, float) else value == cell


CASES = [
    ["precess", "--sweep", "top.spin=0:800:70", TOP],
    ["inertia", "--sweep", "about=com,origin", "configs/cube_corner.yaml"],
    ["euler", "--samples", "5", "--columns", "t,w1", "configs/t_handle.yaml", "configs/tennis_racket.yaml"],
    ["axes", "configs/water.yaml", "configs/cube_corner.yaml"],
    ["inertia", "configs/cube_symbolic.yaml"],
]


@needs_arrow
@pytest.mark.parametrize("arguments", CASES, ids=lambda arguments: " ".join(arguments[:3]))
def test_cells_are_those_of_csv(program: Program, tmp_path: Path, arguments: list[str]) -> None:
    expected = cells(program(*arguments, "-q", "-f", "csv").out)
    path = tmp_path / "table.parquet"
    outcome = program(*arguments, "-q", "-f", "parquet", "-o", str(path))
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")
    rows = rows_of(path)
    assert len(rows) == len(expected) > 0
    for row, other in zip(rows, expected, strict=True):
        assert list(row) == list(other)
        assert all(same(row[head], other[head]) for head in row)


@needs_arrow
def test_types_and_units(program: Program, tmp_path: Path) -> None:
    from pyarrow import parquet

    path = tmp_path / "top.parquet"
    program("precess", "-q", "-f", "parquet", "-o", str(path), TOP)
    schema = parquet.read_schema(path)
    assert str(schema.field("top.spin").type) == "double"
    assert schema.field("top.spin").metadata == {b"unit": b"rad/s"}
    assert str(schema.field("top.nutation_kind").type) == "string"


@needs_arrow
@pytest.mark.parametrize("values", ["1:9:40", "1,2,null"])
def test_the_table_does_not_depend_on_the_number_of_processes(
    program: Program, tmp_path: Path, values: str
) -> None:
    arguments = ("hamilton", "-q", "-f", "parquet", "--sweep", f"parameters.k={values}")
    for jobs in ("1", "2"):
        program(*arguments, "-o", f"{tmp_path}/{jobs}", "-j", jobs, "configs/coupled_pendulums.yaml")
    assert (tmp_path / "1").read_bytes() == (tmp_path / "2").read_bytes()


@needs_arrow
def test_a_column_that_changes_its_type_is_one_of_texts(
    program: Program, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first groups of rows hold numbers, which a symbol in a later one turns into texts."""
    monkeypatch.setattr("rigidcli.render.parquet.ROWS_OF_PART", 3)
    sweep = ("--sweep", "parameters.k=1,2.5,3e20,4,null,6", "configs/coupled_pendulums.yaml")
    text = cells(program("hamilton", "-q", "-f", "csv", *sweep).out)
    assert program("hamilton", "-q", "-f", "parquet", "-o", f"{tmp_path}/t.parquet", *sweep).code == 0
    rows = rows_of(tmp_path / "t.parquet")
    assert [row["parameters.k"] for row in rows] == [row["parameters.k"] for row in text]


def test_without_the_library_it_is_said_how_to_get_it(
    program: Program, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    find = util.find_spec
    monkeypatch.setattr(util, "find_spec", lambda name: None if name == "pyarrow" else find(name))
    outcome = program("precess", "-f", "parquet", "-o", f"{tmp_path}/table.parquet", TOP)
    assert (outcome.code, outcome.out) == (2, "")
    assert "pip install 'rigidcli[parquet]'" in outcome.err
