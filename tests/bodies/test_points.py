"""Tables of point masses: what is read, in which blocks, and what is refused where."""

from __future__ import annotations

import os
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

import rigidcli
from rigidcli.bodies import points
from rigidcli.bodies.points import BLOCK_ROWS, Block, blocks
from rigidcli.errors import ValueProblem
from tests.tables import rows_of

FOUR = np.array([[1.0, 2.0, 3.0, 4.0], [0.5, -1.0, 0.0, 1e-3]])
MAGIC = b"\x93NUMPY\x01\x00"


def read(path: Path) -> Block:
    return np.concatenate([block.copy() for block in blocks(path)])


def refusal(path: Path) -> str:
    """The message without the path at its start, and the hint."""
    with pytest.raises(ValueProblem) as caught:
        read(path)
    message, hint = caught.value.message, caught.value.hint
    assert message.startswith(str(path))
    return message.removeprefix(str(path)) + (f"; {hint}" if hint else "")


def array(directory: Path, values: NDArray[np.generic], order: str = "C", version: int = 1) -> Path:
    path = directory / "cloud.npy"
    with path.open("wb") as file:
        np.lib.format.write_array(file, np.array(values, order=order), version=(version, 0))  # type: ignore[call-overload]  # a text
    return path


def table(directory: Path, text: str | bytes, name: str = "cloud.csv") -> Path:
    path = directory / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def with_header(header: str) -> bytes:
    """A .npy file of FOUR with this header."""
    return MAGIC + len(header).to_bytes(2, "little") + header.encode() + FOUR.tobytes()


def cloud(rows: int) -> Block:
    generator = np.random.default_rng(7)
    values = generator.normal(size=(rows, 4))
    values[:, 0] = generator.uniform(0.5, 2.0, rows)
    return values


# --- blocks


@pytest.mark.parametrize("rows", [1, BLOCK_ROWS - 1, BLOCK_ROWS, 2 * BLOCK_ROWS + 5])
@pytest.mark.parametrize("order", ["C", "F", "csv", "csv without an end"])
def test_blocks_make_up_the_whole(tmp_path: Path, rows: int, order: str) -> None:
    if order in "CF":
        values = cloud(rows)
        path = array(tmp_path, values, order)
    else:  # of the shortest lines, most fit into a chunk
        values = np.tile([1.0, 2.0, 3.0, 4.0], (rows, 1))
        path = table(tmp_path, "m,x,y,z\n" + "\n".join(["1,2,3,4"] * rows) + "\n" * (order == "csv"))
    found = [block.copy() for block in blocks(path)]
    assert all(block.dtype == float and block.flags.c_contiguous for block in found)
    assert max(map(len, found)) <= BLOCK_ROWS
    assert np.array_equal(np.concatenate(found), values)


def test_memory_does_not_grow_with_the_file(tmp_path: Path) -> None:
    long = array(tmp_path, cloud(12 * BLOCK_ROWS))
    endless = table(tmp_path, "m,x,y,z\n" + "1" * 20_000_000)
    tracemalloc.start()
    for _ in blocks(long):
        pass
    assert refusal(endless) == ":2: a line of more than 10000 bytes"
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 5_000_000


# --- .npy


@pytest.mark.parametrize("dtype", ["<f8", ">f8", "<f4", ">f4", "<f2", "g", "i1", "<i4", ">i8", "u1", "<u8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_every_real_type_is_read(tmp_path: Path, dtype: str, order: str) -> None:
    values = np.array([[1, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 12]]).astype(dtype)
    assert np.array_equal(read(array(tmp_path, values, order)), values.astype(float))


def test_every_version_is_read(tmp_path: Path) -> None:
    for version in (1, 2, 3):
        assert np.array_equal(read(array(tmp_path, FOUR, version=version)), FOUR)
    (tmp_path / "link.NPY").symlink_to(tmp_path / "cloud.npy")
    assert np.array_equal(read(tmp_path / "link.NPY"), FOUR)
    by_python_2 = with_header("{'descr': '<f8', 'fortran_order': False, 'shape': (2L, 4L), }\n")
    assert np.array_equal(read(table(tmp_path, by_python_2, "old.npy")), FOUR)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.empty((0, 4)), ": no points"),
        (np.ones(4), ": shape `(4,)`, expected (n, 4) for m, x, y, z"),
        (np.ones((4, 7)), ": shape `(4, 7)`, expected (n, 4) for m, x, y, z; save the transposed array"),
        (np.ones((1, 2, 4)), ": shape `(1, 2, 4)`, expected (n, 4) for m, x, y, z"),
        (np.ones((2, 4), complex), ": an array of `complex128`, expected real numbers"),
        (np.full((2, 4), None), ": no .npy file of numbers as numpy writes it, or a cut one"),
        (np.ones(2, [("m", "f8")]), ": an array of `[('m', '<f8')]`, expected real numbers"),
    ],
)
def test_other_arrays_are_refused(tmp_path: Path, values: NDArray[np.generic], message: str) -> None:
    assert refusal(array(tmp_path, values)) == message


@pytest.mark.parametrize(
    ("row", "column", "value", "fault"),
    [
        (0, 0, 0.0, "column m: read `0`, expected a positive mass"),
        (BLOCK_ROWS + 3, 0, np.nan, "column m: read `nan`, expected a finite number"),
        (BLOCK_ROWS + 3, 0, np.inf, "column m: read `inf`, expected a finite number"),
        (3, 3, np.nan, "column z: read `nan`, expected a finite number"),
    ],
)
@pytest.mark.parametrize("order", ["C", "F"])
def test_a_wrong_value_is_found(
    tmp_path: Path, row: int, column: int, value: float, fault: str, order: str
) -> None:
    values = cloud(BLOCK_ROWS + 10)
    values[row, column] = value
    assert refusal(array(tmp_path, values, order)) == f": row {row} (counted from 0): {fault}"


def test_an_extended_number_beyond_a_double_is_refused(tmp_path: Path) -> None:
    if np.finfo(np.longdouble).max == np.finfo(np.float64).max:
        pytest.skip("no extended numbers here")
    values = np.ones((2, 4), np.longdouble)
    values[1, 1] = np.longdouble("1e400")
    assert "row 1 (counted from 0): column x: read `inf`" in refusal(array(tmp_path, values))


def test_a_cut_file_is_refused(tmp_path: Path) -> None:
    content = array(tmp_path, FOUR).read_bytes()
    for changed in (content[:-1], content[:-64]):
        message = ": no .npy file of numbers as numpy writes it, or a cut one"
        assert refusal(table(tmp_path, changed, "cloud.npy")) == message


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x93NUMPY",
        b"not numpy at all",
        b"\x93NUMPY\x09\x00" + b"x" * 100,
        b"\x93NUMPY\x02\x00\xff\xff\xff\xff" + b"(" * 9000,
        MAGIC + b"\x10\x27" + b"-" * 9_999 + b"1",
        MAGIC + b"\x0a\x00{1:2,'a':3}",
        MAGIC + b"\x08\x00{'\\d':1}",
    ],
)
def test_a_broken_header_is_refused(tmp_path: Path, content: bytes) -> None:
    path = table(tmp_path, content, "cloud.npy")
    assert refusal(path) == ": no .npy file of numbers as numpy writes it, or a cut one"


@pytest.mark.parametrize("shape", ["(-1, 4)", "(10**9, 4)", "(99999999999999999999, 4)", "(2, 4, 0)"])
def test_a_hostile_shape_is_refused(tmp_path: Path, shape: str) -> None:
    content = with_header(f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}")
    refusal(table(tmp_path, content, "cloud.npy"))


@given(st.binary(max_size=200), st.sampled_from([b"", MAGIC + b"\x76\x00", b"m,x,y,z\n1,2,3,4\n"]))
def test_any_bytes_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, content: bytes, start: bytes
) -> None:
    for name in ("any.csv", "any.npy"):
        try:
            block = read(table(tmp_path_factory.getbasetemp(), start + content, name))
        except ValueProblem:
            continue
        assert np.isfinite(block).all()
        assert (block[:, 0] > 0).all()


# --- .csv


@pytest.mark.parametrize(
    "text",
    rows_of(__file__, "csv is read"),
)
def test_csv_is_read(tmp_path: Path, text: str) -> None:
    found = read(table(tmp_path, text))
    assert found.flags.c_contiguous
    if "(cm)" in text:  # once rounded
        assert found == pytest.approx(FOUR, rel=1e-15, abs=0)
    else:
        assert np.array_equal(found, FOUR)


@given(
    st.lists(st.tuples(*[st.floats(1e-300, 1e300)] * 4), min_size=1),
    st.permutations(points.COLUMNS),
    st.booleans(),
    st.sampled_from([(",", "."), (";", ","), (";", "."), ("\t", ".")]),
)
def test_csv_gives_back_what_was_written(
    tmp_path_factory: pytest.TempPathFactory,
    rows: list[tuple[float, ...]],
    columns: list[str],
    plus: bool,
    signs: tuple[str, str],
) -> None:
    separator, point = signs
    lines = [separator.join(columns)]
    for row in rows:
        values = dict(zip(points.COLUMNS, row, strict=True))
        texts = (f"{values[column]:{'+' if plus else ''}.17g}" for column in columns)
        lines.append(separator.join(text.replace(".", point) for text in texts))
    path = table(tmp_path_factory.getbasetemp(), "\n".join(lines) + "\n")
    assert np.array_equal(read(path), np.array(rows))


def test_csv_of_many_chunks_keeps_its_lines_whole_and_counts_them(tmp_path: Path) -> None:
    values = cloud(20_000)
    lines = ["m,x,y,z", *(",".join(f"{value:.17g}" for value in row) for row in values)]
    path = table(tmp_path, "\n".join(lines))
    assert path.stat().st_size > 3 * points.CHUNK_BYTES
    assert np.array_equal(read(path), values)
    lines[18_000] = "1,2,oops,4"
    assert refusal(table(tmp_path, "\n".join(lines))) == ":18001: column y: read `oops`, expected a number"


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        ("1,2,abc,4", "column y: read `abc`, expected a number"),
        ("1,2,,4", "column y: read ``, expected a number"),
        ("1,2,3", "read 3 values, expected 4"),
        ("1,2,3,4,", "read 5 values, expected 4"),
        ("1;2;3;4", "read 1 values, expected 4"),
        ("-1,2,3,4", "column m: read `-1`, expected a positive mass"),
        ("1e-999,2,3,4", "column m: read `1e-999`, expected a positive mass"),
        ("1,1e999,3,4", "column x: read `1e999`, expected a finite number"),
        ("1,2,3,nan", "column z: read `nan`, expected a number"),
        ("1,2,3,1_0", "column z: read `1_0`, expected a number"),
        ("1,2,3,0x10", "column z: read `0x10`, expected a number"),
        ("1,2,3,٣", "column z: read `٣`, expected a number"),
        ("1,2,3,[4]", "column z: read `[4]`, expected a number"),
        ("1,2,3,\x1b[31m4", r'column z: read `"\u001b[31m4"`, expected a number'),
        ("1,2,3," + "a" * 100, "column z: read `" + "a" * 57 + "...`, expected a number"),
        ("1,2,3," + "?" * 500_000, "a line of more than 10000 bytes"),
    ],
)
def test_a_wrong_line_is_found(tmp_path: Path, line: str, fault: str) -> None:
    path = table(tmp_path, f"m,x,y,z\n1,2,3,4\n\n{line}\n1,2,3,4\n")
    assert refusal(path) == f":4: {fault}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        *((header, f"header `{header}`, expected `m,x,y,z` in any order; columns are separated by")
          for header in ("", "m,x,y", "m,x,y,z,w", "m,x,y,y", "mass,m,x,y,z", "1,2,3,4", "m;x,y;z")),
        ("m (cm),x,y,z", "column m: `cm` is a length (m), expected a mass (kg)"),
        ("m,x,y (s),z", "column y: `s` is a time (s), expected a length (m)"),
        ("m,x,y,z (furl)", "column z: unknown unit `furl`; did you mean `furlong`?"),
    ],
)  # fmt: skip
def test_a_wrong_header_is_refused(tmp_path: Path, text: str, message: str) -> None:
    assert refusal(table(tmp_path, f"{text}\n1,2,3,4\n")).startswith(f":1: {message}")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("m;x;y;z\n1.234,5;0;0;0\n", ":2: column m: read `1.234,5`, expected a number"),
        ("m\tx\ty\tz\n1,5\t0\t0\t0\n", ":2: column m: read `1,5`, expected a number"),
        ("m,x,y,z\r\n\r\n \n", ": no points"),
    ],
)
def test_what_may_be_read_in_two_ways_is_refused(tmp_path: Path, text: str, message: str) -> None:
    assert refusal(table(tmp_path, text)) == message


def test_a_decimal_comma_in_quotes_is_one_value(tmp_path: Path) -> None:
    told = refusal(table(tmp_path, 'm,x,y,z\n"1,5",0,0,0\n'))
    assert told.startswith(":2: column m: read `1,5`, expected a number; write decimals with a point")
    assert np.array_equal(read(table(tmp_path, 'name,m,x,y,z\n"a, b",1,2,3,4\n')), [[1, 2, 3, 4]])


def test_what_is_no_file_of_points_is_refused_without_waiting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "directory.npy").mkdir()
    (tmp_path / "device.csv").symlink_to("/dev/zero")
    endings = ": expected a file name that ends in `.csv`, `.npy` or `.xyz`"
    for names, message in (
        (("cloud.csv", "clo\0ud.csv"), ": no such file"),
        (("cloud.txt", "cloud", "cloud.csv.gz"), endings),
        (("pipe.csv", "directory.npy", "device.csv"), ": not a regular file"),
    ):
        assert [refusal(tmp_path / name) for name in names] == [message] * len(names)

    def denied(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    path = table(tmp_path, "m,x,y,z\n")
    monkeypatch.setattr(Path, "open", denied)
    assert refusal(path) == ": cannot be read: Permission denied"


@pytest.mark.parametrize(
    "text",
    [
        "mass,X,Y,Z\n2,1,3,0\n1,-2,0,0\n",
        "part;M (g);x;y;z\na b;2e3;1;3;0\nc;1e3;-2;0;0\n",
        ',"Mass",x,y,z,material\n0,2,1,3,0,steel\n1,1,-2,0,0,\n',
    ],
)
def test_heads_as_others_write_them(tmp_path: Path, text: str) -> None:
    found = rigidcli.inertia({"body": {"points": str(table(tmp_path, text))}})
    assert (found["mass"], found["center_of_mass"].tolist()) == (3, [0, 2, 0])
