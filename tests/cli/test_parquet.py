"""`-f parquet`: the cells of csv, with types and units, in one file or in parts, the same for any `-j`."""

from __future__ import annotations

import csv
import io
import json
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
@pytest.mark.parametrize("name", ["table.parquet", "table/"])
def test_cells_are_those_of_csv(program: Program, tmp_path: Path, arguments: list[str], name: str) -> None:
    expected = cells(program(*arguments, "-q", "-f", "csv").out)
    path = f"{tmp_path}/{name}"
    outcome = program(*arguments, "-q", "-f", "parquet", "-o", path)
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")
    files = [tmp_path / name] if name[-1] != "/" else sorted((tmp_path / name).glob("part-*.parquet"))
    rows = [row for file in files for row in rows_of(file)]
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
def test_a_manifest_tells_what_the_parts_are(program: Program, tmp_path: Path) -> None:
    folder = tmp_path / "table"
    arguments = ("--sweep", "body.height=5 cm:9 cm:100", "-s", "top.tilt=20 deg", TOP)
    outcome = program("precess", "-q", "-f", "parquet", "-o", f"{folder}/", *arguments)
    assert outcome.code == 0
    manifest = json.loads((folder / "manifest.json").read_text())
    assert {path.name for path in folder.iterdir()} == {
        "manifest.json",
        *(part["file"] for part in manifest["parts"]),
    }
    assert [part["rows"] for part in manifest["parts"]] == [32, 32, 32, 4]
    assert manifest["rows"] == 100
    assert manifest["sweep"] == ["body.height=5 cm:9 cm:100"]
    assert manifest["set"] == ["top.tilt=20 deg"]
    assert manifest["results"] == "rigidcli.precess/1"
    assert manifest["documents"][0]["source"] == TOP
    assert "top:" in manifest["documents"][0]["text"]
    assert {"name": "top.spin", "type": "float64", "unit": "rad/s"} in manifest["columns"]


@needs_arrow
@pytest.mark.parametrize("values", ["1:9:40", "1,2,null"])
def test_parts_do_not_depend_on_the_number_of_processes(
    program: Program, tmp_path: Path, values: str
) -> None:
    arguments = ("hamilton", "-q", "-f", "parquet", "--sweep", f"parameters.k={values}")
    found = []
    for jobs in ("1", "2"):
        folder = tmp_path / jobs
        program(*arguments, "-o", f"{folder}/", "-j", jobs, "configs/coupled_pendulums.yaml")
        found.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert found[0] == found[1]


@needs_arrow
def test_all_parts_have_the_same_columns(program: Program, tmp_path: Path) -> None:
    """The values of the first part are numbers, and one of the second is none: all become texts."""
    from pyarrow import parquet

    values = ",".join(map(str, range(1, 33))) + ",null"
    arguments = ("hamilton", "-q", "-f", "parquet", "--sweep", f"parameters.k={values}")
    program(*arguments, "-o", f"{tmp_path}/table/", "configs/coupled_pendulums.yaml")
    first, second = sorted((tmp_path / "table").glob("part-*.parquet"))
    assert parquet.read_schema(first).equals(parquet.read_schema(second), check_metadata=True)
    assert len(rows_of(first)) == 32
    assert not list(tmp_path.rglob(".*"))


@needs_arrow
def test_a_refused_value_is_told_and_the_others_stay(program: Program, tmp_path: Path) -> None:
    sweep = ("--sweep", "body.side=-1:2:40", "configs/cube_corner.yaml")
    text = program("inertia", "-f", "csv", *sweep)
    outcome = program("inertia", "-f", "parquet", "-o", f"{tmp_path}/table/", *sweep)
    assert (outcome.code, outcome.err) == (text.code, text.err)
    assert outcome.code == 3
    rows = [row for path in sorted((tmp_path / "table").glob("*.parquet")) for row in rows_of(path)]
    assert len(rows) == len(cells(text.out))


@needs_arrow
def test_nothing_is_written_where_all_is_refused(program: Program, tmp_path: Path) -> None:
    for name in ("table/", "table.parquet"):
        arguments = ("-f", "parquet", "-o", f"{tmp_path}/{name}", "-s", "body.side=-1")
        assert program("inertia", *arguments, "configs/cube_corner.yaml").code == 3
    assert not list(tmp_path.iterdir())


@needs_arrow
def test_a_folder_with_files_stays_as_it_is(program: Program, tmp_path: Path) -> None:
    (tmp_path / "part-00007.parquet").write_text("mine")
    outcome = program("precess", "-f", "parquet", "-o", str(tmp_path), TOP)
    assert outcome.code == 2
    assert "has files already" in outcome.err
    assert [path.name for path in tmp_path.iterdir()] == ["part-00007.parquet"]


@needs_arrow
@pytest.mark.parametrize("output", [[], ["-o", "-"]])
def test_it_needs_a_place(program: Program, output: list[str]) -> None:
    outcome = program("precess", "-f", "parquet", *output, TOP)
    assert (outcome.code, outcome.out) == (2, "")
    assert "`-o table.parquet` or `-o table/`" in outcome.err


def test_without_the_library_it_is_said_how_to_get_it(
    program: Program, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    find = util.find_spec
    monkeypatch.setattr(util, "find_spec", lambda name: None if name == "pyarrow" else find(name))
    outcome = program("precess", "-f", "parquet", "-o", f"{tmp_path}/table.parquet", TOP)
    assert (outcome.code, outcome.out) == (2, "")
    assert "pip install 'rigidcli[parquet]'" in outcome.err
