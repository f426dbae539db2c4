"""Point masses from files: what is read, how it is blocked, and what is refused where."""

from __future__ import annotations

import io
import os
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from rigidcli.bodies import points
from rigidcli.bodies.points import BLOCK_ROWS, Block, blocks
from rigidcli.errors import ValueProblem

FOUR = np.array([[1.0, 2.0, 3.0, 4.0], [0.5, -1.0, 0.0, 1e-3]])


def read(path: Path) -> Block:
    return np.concatenate([block.copy() for block in blocks(path)])


def refusal(path: Path) -> str:
    """The message without the path at its start, and the hint."""
    with pytest.raises(ValueProblem) as caught:
        read(path)
    message, hint = caught.value.message, caught.value.hint
    assert message.startswith(str(path))
    return message.removeprefix(str(path)) + (f"; {hint}" if hint else "")


def saved(directory: Path, array: NDArray[np.generic], version: tuple[int, int] | None = None) -> Path:
    path = directory / "cloud.npy"
    with path.open("wb") as file:
        np.lib.format.write_array(file, array, version=version)
    return path


def written(directory: Path, text: str | bytes) -> Path:
    path = directory / "cloud.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def cloud(rows: int) -> Block:
    generator = np.random.default_rng(7)
    array = generator.normal(size=(rows, 4))
    array[:, 0] = generator.uniform(0.5, 2.0, rows)
    return array


# --- .npy


@pytest.mark.parametrize("rows", [1, BLOCK_ROWS - 1, BLOCK_ROWS, BLOCK_ROWS + 1, 2 * BLOCK_ROWS + 5])
@pytest.mark.parametrize("order", ["C", "F"])
def test_blocks_make_up_the_whole_array(tmp_path: Path, rows: int, order: str) -> None:
    array = cloud(rows)
    path = saved(tmp_path, np.asfortranarray(array) if order == "F" else array)
    sizes = []
    for block in blocks(path):
        assert block.dtype == np.float64
        assert block.flags.c_contiguous
        assert block.flags.writeable
        assert block.shape[1] == 4
        sizes.append(len(block))
    assert max(sizes) <= BLOCK_ROWS
    assert sum(sizes) == rows
    assert np.array_equal(read(path), array)


@pytest.mark.parametrize("dtype", ["<f8", ">f8", "<f4", ">f4", "<f2", "g", "i1", "<i4", ">i8", "u1", "<u8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_every_real_type_is_read(tmp_path: Path, dtype: str, order: str) -> None:
    array = np.array([[1, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 12]]).astype(dtype)
    path = saved(tmp_path, np.asfortranarray(array) if order == "F" else array)
    assert np.array_equal(read(path), array.astype(np.float64))


def test_every_version_is_read(tmp_path: Path) -> None:
    for version in ((1, 0), (2, 0), (3, 0)):
        assert np.array_equal(read(saved(tmp_path, FOUR, version)), FOUR)
    (tmp_path / "link.NPY").symlink_to(tmp_path / "cloud.npy")
    assert np.array_equal(read(tmp_path / "link.NPY"), FOUR)


def test_a_header_by_python_2_is_read(tmp_path: Path) -> None:
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (2L, 4L), }\n"
    path = tmp_path / "cloud.npy"
    path.write_bytes(b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + FOUR.tobytes())
    assert np.array_equal(read(path), FOUR)


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.empty((0, 4)), ": no points"),
        (np.ones(4), ": shape `(4,)`, expected (n, 4) for m, x, y, z"),
        (np.ones((4, 7)), ": shape `(4, 7)`, expected (n, 4) for m, x, y, z; save the transposed array"),
        (np.ones((1, 2, 4)), ": shape `(1, 2, 4)`, expected (n, 4) for m, x, y, z"),
        (np.ones((2, 4), complex), ": an array of `complex128`, expected real numbers"),
        (np.full((2, 4), None), ": an array of `object`, expected real numbers"),
        (np.ones(2, [("m", "f8")]), ": an array of `[('m', '<f8')]`, expected real numbers"),
    ],
)
def test_other_arrays_are_refused(tmp_path: Path, array: NDArray[np.generic], message: str) -> None:
    assert refusal(saved(tmp_path, array)) == message


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
    array = cloud(BLOCK_ROWS + 10)
    array[row, column] = value
    path = saved(tmp_path, np.asfortranarray(array) if order == "F" else array)
    assert refusal(path) == f": row {row} (counted from 0): {fault}"


def test_an_extended_number_beyond_a_double_is_refused(tmp_path: Path) -> None:
    if np.finfo(np.longdouble).max == np.finfo(np.float64).max:
        pytest.skip("no extended numbers here")
    array = np.ones((2, 4), np.longdouble)
    array[1, 1] = np.longdouble("1e400")
    assert "row 1 (counted from 0): column x: read `inf`" in refusal(saved(tmp_path, array))


@pytest.mark.parametrize("change", [-1, -64, 1])
def test_a_truncated_or_longer_file_is_refused(tmp_path: Path, change: int) -> None:
    path = saved(tmp_path, FOUR)
    content = path.read_bytes()
    path.write_bytes(content[:change] if change < 0 else content + b"x")
    assert refusal(path) == f": {64 + change} bytes of data, expected 64 for 2 rows of `float64`"


def test_a_file_that_shrinks_while_it_is_read_is_refused(tmp_path: Path) -> None:
    path = saved(tmp_path, cloud(2 * BLOCK_ROWS))
    reader = blocks(path)
    next(reader)
    os.truncate(path, 32 * BLOCK_ROWS)
    with pytest.raises(ValueProblem, match="the data end early"):
        next(reader)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x93NUMPY",
        b"not numpy at all",
        b"\x93NUMPY\x09\x00" + b"x" * 100,
        b"\x93NUMPY\x02\x00\xff\xff\xff\xff" + b"(" * 9000,
        b"\x93NUMPY\x01\x00\x10\x27" + b"-" * 9_999 + b"1",
        b"\x93NUMPY\x01\x00\x0a\x00{1:2,'a':3}",
        b"\x93NUMPY\x01\x00\x08\x00{'\\d':1}",
    ],
)
def test_a_broken_header_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "cloud.npy"
    path.write_bytes(content)
    assert refusal(path) == ": not a .npy file of numpy, or a broken one"


@pytest.mark.parametrize("shape", ["(-1, 4)", "(10**9, 4)", "(99999999999999999999, 4)", "(2, 4, 0)"])
def test_a_hostile_shape_is_refused(tmp_path: Path, shape: str) -> None:
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}".encode()
    path = tmp_path / "cloud.npy"
    path.write_bytes(b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + FOUR.tobytes())
    refusal(path)


@given(st.binary(max_size=200), st.sampled_from([b"", b"\x93NUMPY\x01\x00\x76\x00", b"m,x,y,z\n1,2,3,4\n"]))
def test_any_bytes_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, content: bytes, start: bytes
) -> None:
    directory = tmp_path_factory.getbasetemp()
    for suffix in (".csv", ".npy"):
        path = directory / f"any{suffix}"
        path.write_bytes(start + content)
        try:
            block = read(path)
        except ValueProblem:
            continue
        assert np.isfinite(block).all()
        assert (block[:, 0] > 0).all()


# --- .csv


@pytest.mark.parametrize(
    "text",
    [
        "m,x,y,z\n1,2,3,4\n0.5,-1,0,1e-3\n",
        "m,x,y,z\r\n1,2,3,4\r\n0.5,-1,0,1e-3\r\n",
        "\ufeffm,x,y,z\n1,2,3,4\n0.5,-1,0,1e-3\n",
        " m , x,\ty ,z \n 1 , 2,\t3 ,4 \n 0.5 , -1,0 , 1e-3\n",
        "m,x,y,z\n1,2,3,4\n0.5,-1,0,1e-3\n\n  \n\r\n",
        "m,x,y,z\n1,2,3,4\n\n0.5,-1,0,1e-3\n",
        "z,x,m,y\n4,2,1,3\n1e-3,-1,0.5,0\n",
        "m,x,y,z\n+1.,2.0,03,4e0\n.5,-1.E+0,-0,+1.e-03\n",
    ],
)
def test_csv_is_read(tmp_path: Path, text: str) -> None:
    array = read(written(tmp_path, text))
    assert array.flags.c_contiguous
    assert np.array_equal(array, FOUR)


@given(
    st.lists(st.tuples(*[st.floats(1e-300, 1e300)] * 4), min_size=1),
    st.permutations(points.COLUMNS),
    st.booleans(),
)
def test_csv_gives_back_what_was_written(
    tmp_path_factory: pytest.TempPathFactory, rows: list[tuple[float, ...]], columns: list[str], plus: bool
) -> None:
    lines = [",".join(columns)]
    for row in rows:
        values = dict(zip(points.COLUMNS, row, strict=True))
        lines.append(",".join(f"{values[column]:{'+' if plus else ''}.17g}" for column in columns))
    path = written(tmp_path_factory.getbasetemp(), "\n".join(lines) + "\n")
    assert np.array_equal(read(path), np.array(rows))


@pytest.mark.parametrize("end", ["\n", ""])
@pytest.mark.parametrize("rows", [BLOCK_ROWS - 2, BLOCK_ROWS - 1, BLOCK_ROWS, BLOCK_ROWS + 1])
def test_csv_blocks_of_the_shortest_lines_are_no_longer_than_a_block(
    tmp_path: Path, rows: int, end: str
) -> None:
    path = written(tmp_path, "m,x,y,z\n" + "\n".join(["1,2,3,4"] * rows) + end)
    sizes = [len(block) for block in blocks(path)]
    assert max(sizes) <= BLOCK_ROWS
    assert sum(sizes) == rows


def test_csv_of_many_chunks_keeps_its_lines_whole_and_counts_them(tmp_path: Path) -> None:
    array = cloud(20_000)
    buffer = io.StringIO("m,x,y,z\n")
    buffer.seek(0, os.SEEK_END)
    np.savetxt(buffer, array, delimiter=",", fmt="%.17g")
    path = written(tmp_path, buffer.getvalue())
    assert path.stat().st_size > 3 * points.CHUNK_BYTES
    assert np.array_equal(read(path), array)

    lines = buffer.getvalue().splitlines()
    lines[18_000] = "1,2,oops,4"
    assert refusal(written(tmp_path, "\n".join(lines))) == ":18001: column y: read `oops`, expected a number"


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        ("1,2,abc,4", "column y: read `abc`, expected a number"),
        ("1,2,,4", "column y: read ``, expected a number"),
        ("1,2,3", "read 3 values, expected 4"),
        ("1,2,3,4,", "read 5 values, expected 4"),
        ("-1,2,3,4", "column m: read `-1`, expected a positive mass"),
        ("0,2,3,4", "column m: read `0`, expected a positive mass"),
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
    path = written(tmp_path, f"m,x,y,z\n1,2,3,4\n\n{line}\n1,2,3,4\n")
    assert refusal(path) == f":4: {fault}"


@pytest.mark.parametrize(
    "header",
    ["", "m,x,y", "m,x,y,z,w", "m,x,y,y", "M,X,Y,Z", "m;x;y;z", "1,2,3,4", "mass,x,y,z"],
)
def test_a_wrong_header_is_refused(tmp_path: Path, header: str) -> None:
    path = written(tmp_path, f"{header}\n1,2,3,4\n")
    assert refusal(path) == f":1: header `{header}`, expected `m,x,y,z` in any order"


def test_an_endless_line_is_refused_in_little_memory(tmp_path: Path) -> None:
    path = written(tmp_path, "m,x,y,z\n" + "1" * 20_000_000)
    tracemalloc.start()
    message = refusal(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert message == ":2: a line of more than 10000 bytes"
    assert peak < 5_000_000


# --- both


def test_what_is_no_file_of_points_is_refused_without_waiting(tmp_path: Path) -> None:
    for name in ("cloud.csv", "clo\0ud.csv"):
        assert refusal(tmp_path / name) == ": no such file"
    assert refusal(written(tmp_path, "m,x,y,z\r\n\r\n \n")) == ": no points"
    for name in ("cloud.txt", "cloud", "cloud.csv.gz"):
        assert refusal(tmp_path / name) == ": expected a file name that ends in `.csv`, `.npy` or `.xyz`"
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "directory.npy").mkdir()
    (tmp_path / "device.csv").symlink_to("/dev/zero")
    for name in ("pipe.csv", "directory.npy", "device.csv"):
        assert refusal(tmp_path / name) == ": not a regular file"


def test_an_unreadable_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def denied(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    path = written(tmp_path, "m,x,y,z\n")
    monkeypatch.setattr(Path, "open", denied)
    assert refusal(path) == ": cannot be read: Permission denied"


def test_memory_does_not_grow_with_the_file(tmp_path: Path) -> None:
    path = saved(tmp_path, cloud(12 * BLOCK_ROWS))
    tracemalloc.start()
    for _ in blocks(path):
        pass
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 4 * 32 * BLOCK_ROWS
