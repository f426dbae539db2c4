"""`--sweep`, `--jobs` and `@files.txt`: a row is what a run at its value prints, whoever works it out."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.document.sweeps import read_sweep
from rigidcli.studies.hamilton import derivation
from tests.cli.test_commands import in_terminal, shell
from tests.conftest import ROOT, Outcome, Program

CUBE = "configs/cube_corner.yaml"
TOP = "configs/cone_top.yaml"


def table(text: str) -> list[dict[str, str]]:
    """The rows of csv, by the heads."""
    return list(csv.DictReader(io.StringIO(text)))


def objects(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines()]


# --- a row is a run


def test_swept_numbers_are_si_and_read_back_as_the_same_row(program: Program) -> None:
    rows = table(program("precess", "-q", "-f", "csv", "--sweep", "top.spin=100 rpm:2000 rpm:7", TOP).out)
    spins = [float(row["top.spin"]) for row in rows]
    assert spins == pytest.approx([2 * math.pi / 60 * (100 + 1900 * k / 6) for k in range(7)], rel=1e-15)
    for row in rows:
        text = program("precess", "-q", "-f", "csv", "-s", f"top.spin={row['top.spin']}", TOP).out
        assert table(text)[0].items() <= row.items()


@pytest.mark.parametrize(("command", "format"), [("precess", "csv"), ("precess", "table"), ("euler", "json")])
def test_bytes_do_not_depend_on_the_number_of_processes(program: Program, command: str, format: str) -> None:
    keys = ("--sweep", "top.spin=-10:800:100", "--sweep", "top.tilt=-1,0.5")
    short = ("--duration", "0.01") if command == "euler" else ()
    one, three = (program(command, "-f", format, *keys, *short, "-j", jobs, TOP) for jobs in ("1", "3"))
    assert one == three
    assert one.code == 3


@pytest.mark.parametrize("sweep", [[], ["--sweep", "body.side=1,2"]])
def test_standard_input_is_read_with_processes_too(sweep: list[str]) -> None:
    done = shell(f"rigidcli inertia -f csv -j 2 {' '.join(sweep)} - {CUBE} < {CUBE}")
    assert done.returncode == 0
    assert len(done.stdout.splitlines()) == 1 + 2 * max(1, len(sweep))


# --- values of which some are refused

SWEEPS = yaml.safe_load(Path(__file__).with_name("sweeps.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("case", SWEEPS["sweeps"], ids=" ".join)
def test_rows_are_those_of_runs_one_by_one(program: Program, tmp_path: Path, case: list[str]) -> None:
    """What a sweep reads once is what a run at its value reads; a value that is refused is refused alone."""
    command, file, *keys = case
    if file in SWEEPS["documents"]:
        (tmp_path / "body.yaml").write_text(SWEEPS["documents"][file])
        file = str(tmp_path / "body.yaml")
    zipped = [key for key in keys if key == "--zip"]
    sweep = read_sweep([key for key in keys if key != "--zip"], bool(zipped))
    options = [option for key in keys for option in ([key] if key == "--zip" else ["--sweep", key])]
    short = ["--duration", "0.1"] if command == "euler" and "duration" not in keys[0] else []

    def run(form: str, *options: str) -> Outcome:
        derivation._LAST.clear()
        return program(command, "-q", "-f", form, *options, *short, file)

    swept, described, codes = run("csv", *options), objects(run("json", *options).out), []
    # Of a motion csv has the samples, and a sweep one row: its objects are compared.
    moving = command in ("euler", "hamilton")
    lines = [] if moving else table(swept.out)
    for index in range(sweep.count):
        settings = sweep.settings(sweep.point(index))
        given = [option for setting in settings for option in ("-s", setting)]
        single = run("csv", *given)
        codes.append(single.code)
        if single.code:
            assert f"at {', '.join(settings)}: " in swept.err or "the same at " in swept.err
            continue
        found = described.pop(0)
        assert list(found.pop("swept")) == [setting.partition("=")[0] for setting in settings]
        if not moving:
            (expected,), row = table(single.out), lines.pop(0)
            assert {head: row[head] for head in expected} == expected
        if moving or index % 5 == 0:
            assert [found] == objects(run("json", *given).out)
    assert (lines, described) == ([], [])
    assert swept.code == max(codes)


# --- which values there are


@settings(max_examples=30)
@given(st.decimals(-1000, 1000, places=3), st.decimals(-1000, 1000, places=3), st.integers(2, 50))
def test_a_range_is_even_and_has_its_ends(start: Any, stop: Any, count: int) -> None:
    sweep = read_sweep([f"a={start}:{stop}:{count}"], False)
    values = [float(sweep.point(index)[0]) for index in range(count)]
    assert [values[0], values[-1]] == [float(start), float(stop)]
    for place, value in enumerate(values):
        assert value == float(start + (stop - start) * place / (count - 1))


def test_logarithmic_steps_have_a_constant_ratio() -> None:
    sweep = read_sweep(["a=log:1e-3:1e3:7"], False)
    assert [sweep.point(k)[0] for k in range(7)] == ["0.001", "0.01", "0.1", "1.0", "10.0", "100.0", "1000.0"]


def test_a_billion_values_take_no_memory() -> None:
    sweep = read_sweep(["a=0:1:1e9", "b=1:2:1e9"], False)
    assert sweep.count == 10**18
    assert sweep.point(10**18 - 1) == ("1.0", "2.0")


def test_values_from_a_table(program: Program, tmp_path: Path) -> None:
    (tmp_path / "spins.csv").write_text('run,"spin, typed"\n1,100 rpm\n\n2,200\n')
    done = program("precess", "-f", "csv", "--sweep", f"top.spin=@{tmp_path}/spins.csv:spin, typed", TOP)
    assert [float(row["top.spin"]) for row in table(done.out)] == pytest.approx([10.47197551, 200])


# --- columns that are asked for


@pytest.mark.parametrize(
    ("command", "key"),
    [
        (("axes", CUBE), ("body.side=1:2:20", "lambda3")),
        (("precess", TOP), ("top.spin=100:200:20", "top.gyroscopic_rate")),
        (("euler", TOP, "--samples", "2"), ("top.spin=100:200:3", "lambda3")),
    ],
)
def test_columns_are_cut_from_all_and_stand_as_asked(
    program: Program, command: tuple[str, ...], key: tuple[str, str]
) -> None:
    values, result = key
    asked = [result, "name", values.partition("=")[0]]
    every = program(*command, "-f", "csv", "--sweep", values)
    some = program(*command, "-f", "csv", "--sweep", values, "--columns", ",".join(asked))
    assert some.code == 0
    assert table(some.out) == [{name: row[name] for name in asked} for row in table(every.out)]
    heads = program(*command, "--sweep", values, "--columns", ",".join(asked)).out.splitlines()[3]
    assert [word for word in heads.split() if word in asked] == asked


def test_rows_of_files_follow_one_header(program: Program) -> None:
    files = ("configs/t_handle.yaml", CUBE, "configs/t_handle.yaml")
    chosen = program("axes", "-q", "-f", "csv", "--columns", "name,lambda1", *files).out.splitlines()
    assert len(chosen) == 4
    every = table(program("axes", "-q", "-f", "csv", *files).out)
    assert [row["name"] for row in every] == ["T-handle", "cube about its corner", "T-handle"]
    assert [row["T"] == "" for row in every] == [False, True, False]


def test_csv_of_a_sweep_has_one_header(program: Program) -> None:
    document = """
    parameters: {w: 1}
    system: {coordinates: [x], lagrangian: xdot**2/2 - w**2*x**2/2}
    equilibrium: {x: 0}
    """
    done = {
        values: program("hamilton", "-f", "csv", "--sweep", f"parameters.w={values}", "-", stdin=document)
        for values in ("0,1,2", "1,2,0")
    }
    assert [result.code for result in done.values()] == [4, 0]
    assert [row["parameters.w"] for row in table(done["0,1,2"].out)] == ["0.0"]
    assert done["0,1,2"].err.count("rows with `frequencies.0` are left out") == 1
    assert [row["frequencies.0"] for row in table(done["1,2,0"].out)] == ["1.0", "2.0", ""]


# --- tables for people


@pytest.mark.parametrize("width", [60, 100])
def test_a_table_is_no_wider_than_the_terminal(width: int) -> None:
    words = ("precess", "-q", "--sweep", "top.spin=100:700:4", TOP)
    _, shown = in_terminal(*words, columns=width, environment={"NO_COLOR": "1"})
    lines = shown.split("\n")
    assert any("top.spin (rad/s)" in line for line in lines)
    assert max(len(line.rpartition("\r")[2]) for line in lines) <= width


# --- streams


def test_rows_stream_into_head() -> None:
    done = shell(f"rigidcli inertia -f csv --sweep body.side=1:2:1e12 {CUBE} | head -n 3")
    assert (done.returncode, done.stderr) == (0, b"")
    assert len(done.stdout.splitlines()) == 3


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_an_interrupt_leaves_whole_rows(jobs: str) -> None:
    arguments = ["inertia", "-f", "csv", "--sweep", "body.side=1:2:1e9", "-j", jobs, CUBE]
    process = subprocess.Popen(
        [sys.executable, "-m", "rigidcli", *arguments],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert process.stdout is not None
    assert process.stderr is not None
    begun = [process.stdout.readline() for _ in range(50)]
    os.kill(process.pid, signal.SIGINT)
    # `communicate` would lose what is buffered already.
    out, err = process.stdout.read(), process.stderr.read()
    assert (process.wait(timeout=30), err) == (130, "")
    process.stdout.close()
    process.stderr.close()
    lines = ("".join(begun) + out).splitlines()
    assert {line.count(",") for line in lines} == {lines[0].count(",")}
    assert (begun[-1] + out).endswith("\n")


def test_a_parameter_that_stays_a_letter_is_told(program: Program) -> None:
    document = "{parameters: {k: 1, m: null}, system: {coordinates: [x], lagrangian: m*xdot^2/2 - k*x^2/2}}"
    for option in (["--sweep", "parameters.k=1,4"], ["--set", "k=4"]):
        found = program("hamilton", "-", *option, stdin=document)
        assert "note: k stays a letter: m has no value" in found.err
