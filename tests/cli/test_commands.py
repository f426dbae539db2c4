"""The program as a student, a grader and a shell script meet it: output, errors, exit codes, pipes."""

from __future__ import annotations

import csv
import fcntl
import io
import json
import os
import pty
import re
import shlex
import stat
import struct
import subprocess
import sys
import termios
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from typer.testing import CliRunner

import rigidcli
from rigidcli.cli.app import app
from rigidcli.cli.printing import ENDINGS, Kind, SchemaKind
from rigidcli.commands import COMMANDS
from rigidcli.document.load import loads
from rigidcli.document.yaml_reader import read_tree
from rigidcli.errors import DocumentError
from tests.conftest import ROOT, Program
from tests.shapes import DIMENSIONS
from tests.tables import words_of

CUBE = "body: {shape: cube, side: 1, mass: 12}\n"
BAD = "body: {shape: cube, side: -1, mass: 12}\n"
NOTED = f"parameters: {{k: 1}}\n{CUBE}"
FORMATS = ["table", "json", "csv", "latex"]
# That of a mesh needs a file beside it.
STARTERS = [path for path in ROOT.glob("rigidcli/starters/*.yaml") if path.stem not in [*SchemaKind, "mesh"]]
DOCUMENTS = sorted([*ROOT.glob("configs/*.yaml"), *STARTERS])
INERTIA = ["schema", "name", "source", "mass", "center_of_mass", "about", "tensor", "tensor_com"]
AXES = [*INERTIA, "moments", "axes", "groups", "class", "orientation", "residual"]
MOTION = ["omega", "angular_momentum", "kinetic_energy", "angle", "wobbles", "holding_torque"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a good document, a bad one, and one with a note."""
    for name, text in {"good.yaml": CUBE, "bad.yaml": BAD, "noted.yaml": NOTED}.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def process(
    *arguments: str | bytes, stdin: bytes = b"", environment: Mapping[str, str] | None = None, **options: Any
) -> subprocess.CompletedProcess[bytes]:
    """The program in a process of its own, whose output is kept unless the `options` say where it goes."""
    return subprocess.run(
        [sys.executable, "-m", "rigidcli", *arguments],
        cwd=ROOT,
        input=stdin,
        timeout=30,
        env={**os.environ, **(environment or {})},
        check=False,
        **({"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options),
    )


def shell(command: str) -> subprocess.CompletedProcess[bytes]:
    """A line of shell in which `rigidcli` is the program."""
    script = f'rigidcli() {{ "{sys.executable}" -m rigidcli "$@"; }}\n{command}'
    return subprocess.run(["sh", "-c", script], cwd=ROOT, capture_output=True, timeout=30, check=False)


def rows(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text, newline="")))


def numbers_of(text: str) -> list[str]:
    return re.findall(r"-?\d+\.?\d*(?:e[-+]\d+)?", text)


# --- json


@pytest.mark.parametrize(
    ("study", "config", "fields"),
    [
        ("inertia", "known_tensor", INERTIA),
        ("axes", "cube_corner", AXES),
        ("axes", "known_tensor", [*AXES, *MOTION]),
    ],
)
def test_json_has_the_fields_of_the_contract(
    study: str, config: str, fields: list[str], program: Program
) -> None:
    source = f"configs/{config}.yaml"
    result = json.loads(program(study, "-f", "json", source).out)
    assert list(result) == [*fields, "units"]
    assert (result["schema"], result["source"]) == (f"rigidcli.{study}/1", source)
    shapes = {"center_of_mass": (3,), "about": (3,), "tensor": (3, 3), "tensor_com": (3, 3)}
    for key, shape in (shapes | {"mass": (), "angle": (), "kinetic_energy": ()}).items():
        if key in result:
            assert np.array(result[key]).shape == shape
            assert all(type(number) is float for number in np.ravel(np.array(result[key], object)))
    if study == "axes":
        still = config == "cube_corner"
        assert result["groups"] == ([[0], [1, 2]] if still else [[0], [1], [2]])
        assert result["class"] == ("prolate" if still else "asymmetric")
        assert 0 <= result["residual"] < 1e-14
        assert result.get("wobbles") is (None if still else True)


def test_json_is_one_compact_object_a_line(folder: Path, program: Program) -> None:
    outcome = program("axes", "-f", "json", str(folder / "good.yaml"), "configs/water.yaml")
    lines = outcome.out.split("\n")
    assert lines.pop() == ""
    assert [json.loads(line)["name"] for line in lines] == ["good", "water molecule"]
    for line in lines:
        assert not re.search(r"\s", re.sub(r'"(\\.|[^"\\])*"', "", line))


# --- csv


NAMES = {
    "comma": "a, b",
    "quotes": 'the "big" one""',
    "newline": "two\nlines\r\nmore",
    "empty": "",
    "escape": "\x1b[31mred\x1b[0m\x1b]0;pwned\x07\x9b31m\b\x7f\0",
    "markup": "[red]x[/red][/][link=http://x]y",
    "bidi": "\u202etxt.exe\u2066\u200b\ufeff",
    "line separators": "a\u2028b\u2029c\x85d",
    "latex": r"\end{align*}\input{/etc/passwd} 50% & $x_1^2# {~}",
    "long": "x" * 500,
}


@pytest.fixture(params=list(NAMES.values()), ids=list(NAMES))
def named(request: pytest.FixtureRequest) -> tuple[str, str]:
    """A name, and a document that bears it."""
    name: str = request.param
    astral = any(ord(character) > 0xFFFF for character in name)
    body = {"shape": "cube", "side": 1, "mass": 12}
    return name, json.dumps({"name": name, "body": body}, ensure_ascii=not astral)


def test_a_hostile_name_is_harmless_in_every_format(named: tuple[str, str], program: Program) -> None:
    name, document = named
    for form in ("table", "latex"):
        outcome = program("axes", "-f", form, "-", stdin=document)
        assert (outcome.code, outcome.err) == (0, "")
        lines = outcome.out.split("\n")
        assert all(line.isprintable() for line in lines)
        assert lines[1:] == program("axes", "-f", form, "-", stdin=CUBE).out.split("\n")[1:]
        assert form == "table" or lines[0].startswith("% ")
    result = json.loads(program("axes", "-f", "json", "-", stdin=document).out)
    assert result["name"] == (name or "stdin")
    header, row = rows(program("axes", "-f", "csv", "-", stdin=document).out)
    assert (row[0], len(row)) == (name or "stdin", len(header))


HOSTILE = "\x1b[31m\x9b1m\u202e\nevil.yaml:1: name: fine"


SOLID = {"shape": "cube", "side": 1, "mass": 1}
HOSTILE_TREES: list[dict[str, Any]] = [
    {HOSTILE: 1},
    {"name": {HOSTILE: 1}},
    *({"body": SOLID | {"side": f"{start}{HOSTILE}"}} for start in ("", "5 ", "5 cm", "sin(")),
    *({"body": SOLID | more} for more in ({"shape": HOSTILE}, {HOSTILE: 1}, {"anchor": HOSTILE})),
    *({"body": {"points": name}} for name in (HOSTILE, f"{HOSTILE}.csv", "a\0b.npy")),
    {"body": {HOSTILE: 1}},
    {"body": SOLID, "about": HOSTILE},
    {"body": SOLID, "frame": {"euler": [1, 2, 3], "sequence": HOSTILE}},
    {"body": SOLID, "motion": {"omega": [1, 2, 3], "basis": HOSTILE}},
    {"parameters": {HOSTILE: 1}},
    {"parameters": {"a": HOSTILE}},
    {"parameters": {"a": f"b + {'x' * 5000}"}, "body": SOLID | {"side": "y" * 5000}},
]
HOSTILE_SYNTAX = [f'{{"a{HOSTILE[:5]}": 1}}', "a: !%1B%5B31m x", '{"a\\u001b": 1, "a\\u001b": 2}']


@pytest.mark.parametrize("text", [*map(json.dumps, HOSTILE_TREES), *HOSTILE_SYNTAX], ids=range(22))
def test_a_hostile_document_is_harmless_in_error_messages(text: str, program: Program) -> None:
    outcome = program("inertia", "-", stdin=text)
    assert (outcome.code, outcome.out) == (3, "")
    assert all(line.isprintable() for line in outcome.err.split("\n"))
    assert "\nevil.yaml" not in outcome.err
    assert len(outcome.err) < 2500


def test_a_hostile_file_name_is_harmless(tmp_path: Path, program: Program) -> None:
    path = tmp_path / "a\x1b[31m\nb.yaml"
    path.write_text(f"parameters: {{k: 1}}\n{CUBE}")
    for arguments in (["validate"], ["axes"], ["axes", "-f", "latex"]):
        outcome = program(*arguments, str(path))
        assert outcome.code == 0
        assert all(line.isprintable() for line in f"{outcome.out}{outcome.err}".split("\n"))
    path.write_text(BAD)
    for name in (str(path), f"{path}.missing"):
        outcome = program("axes", name)
        assert outcome.code == 3
        assert all(line.isprintable() for line in outcome.err.split("\n"))


def test_hostile_settings_are_harmless(program: Program) -> None:
    for setting in ("\x1b[31m=1", "body.\x1b[31m=1", "name=\x1b[31m", "body.mass=\x1b[31m"):
        outcome = program("axes", "-s", setting, "-", stdin=CUBE)
        assert outcome.code in (2, 3)
        assert all(line.isprintable() for line in outcome.err.split("\n"))


def test_what_is_no_text_is_no_trouble(tmp_path: Path) -> None:
    path = os.fsencode(tmp_path) + b"/caf\xe9.yaml"
    Path(os.fsdecode(path)).write_text(CUBE)
    done = process("inertia", "-f", "json", path)
    assert (done.returncode, done.stderr) == (0, b"")
    assert json.loads(done.stdout)["mass"] == 12
    refused = process("axes", "-s", b"name=caf\xe9", "-", stdin=CUBE.encode())
    assert refused.returncode in (2, 3)
    assert b"Traceback" not in refused.stderr


# --- several files, standard input, notes


def test_standard_input_is_read_to_its_bound_only(program: Program) -> None:
    outcome = program("axes", "-", stdin="#" * 3_000_000)
    assert (outcome.code, outcome.out) == (3, "")
    assert "2,000,000" in outcome.err


def test_same_input_same_bytes() -> None:
    """Exact results too, whatever order Python's hashes give to symbols."""
    files = [f"configs/{name}.yaml" for name in ("three_equal_masses", "known_tensor", "water")]
    one, two = (process("axes", "-f", "json", *files, environment={"PYTHONHASHSEED": s}) for s in "12")
    assert one.stdout == two.stdout != b""


# --- files that cannot be read


def test_what_is_no_regular_file_is_refused_and_not_waited_for(folder: Path) -> None:
    os.mkfifo(folder / "pipe.yaml")
    inside = [str(folder / name) for name in ("pipe.yaml", "missing.yaml")]
    names = [str(folder), *inside, "/dev/zero", "/dev/null", ""]
    done = process("inertia", "-f", "json", *names, str(folder / "good.yaml"))
    assert done.returncode == 3
    assert json.loads(done.stdout)["name"] == "good"
    told = done.stderr.decode().splitlines()
    assert len(told) == len(names)
    assert all("cannot be read" in line for line in told)
    assert all(line.startswith(name) for line, name in zip(told, names, strict=True))


def test_a_file_without_permission_is_refused(
    folder: Path, program: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    def deny(*arguments: object) -> int:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "open", deny)
    outcome = program("inertia", str(folder / "good.yaml"))
    assert (outcome.code, outcome.out) == (3, "")
    assert outcome.err.endswith("good.yaml: cannot be read: Permission denied\n")


def test_points_are_not_read_from_a_device_or_a_pipe(folder: Path) -> None:
    os.mkfifo(folder / "pipe.csv")
    (folder / "zero.npy").symlink_to("/dev/zero")
    (folder / "first.yaml").write_text("body: {points: pipe.csv}")
    (folder / "second.yaml").write_text("body: {points: zero.npy}")
    done = process("inertia", str(folder / "first.yaml"), str(folder / "second.yaml"))
    assert (done.returncode, done.stdout) == (3, b"")
    assert done.stderr.count(b".yaml:1: body.points: ") == 2


# --- wrong usage


USAGE = """
axis   axes   inertia   validate   axes -f   axes -f xml x   axes -f jason x   axes --format= x
axes --digits 0 x   axes --digits 18 x   axes --digits six x   axes -s mass x   axes --set   axes -s =3 x
axes -x x   axes --units g,kg x   axes --units 1 x   axes --units furlongs_a x   validate -f json x
schema x   schema answers assignment   new shapes   new shape points   --digits 3
"""


@pytest.mark.parametrize("arguments", [*words_of(USAGE), "", "axes --units '' x"])
def test_wrong_usage(arguments: str, program: Program) -> None:
    outcome = program(*shlex.split(arguments))
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err
    assert "Traceback" not in outcome.err


@pytest.mark.parametrize("command", [[], *([name] for name in COMMANDS)], ids=str)
def test_help_everywhere(command: list[str], program: Program) -> None:
    outcome = program(*command, "--help")
    assert (outcome.code, outcome.err) == (0, "")
    assert program(*command, "-h") == outcome
    assert outcome.out.startswith("Usage: ")
    lines = outcome.out.splitlines()
    assert max(map(len, lines)) <= 80
    assert not any(line.endswith("...") for line in lines if not line.startswith("Usage"))
    assert not any(word in outcome.out for word in ("list[", "{FILE}", "<="))
    assert f"rigidcli {' '.join(command)}" in outcome.out.partition("Options:")[0].partition("\n")[2]
    narrow = program(*command, "-h", columns=60).out.splitlines()
    assert max(map(len, narrow)) <= 60
    if command and command[0] in rigidcli.STUDIES:
        for option in ["--format", "--output", "--set", "--digits", "--exact", "--no-header", "--quiet"]:
            assert option in outcome.out
        everyday, more = outcome.out.split("More options:")
        assert "--set" in everyday
        assert "--no-header" in more
        assert all(kind in more for kind in COMMANDS[command[0]].pictures)


@pytest.mark.parametrize(("words", "expected"), [("rigidcli ax", b"axes"), ("rigidcli axes -f js", b"json")])
def test_shell_completion(words: str, expected: bytes, tmp_path: Path) -> None:
    script = tmp_path / "rigidcli"  # as pip installs it: completion goes by the name of the program
    script.write_text("from rigidcli.__main__ import main\n\nmain()\n")
    asked = {"_RIGIDCLI_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
    environment = {**os.environ, **asked, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, str(script)], env=environment, capture_output=True, check=False)
    assert (done.stdout.split(), done.stderr) == ([expected], b"")


# --- output to a file


def test_output_is_what_standard_output_would_be(folder: Path, program: Program) -> None:
    for form in FORMATS:
        target = folder / f"out.{form}"
        outcome = program(
            "axes", "-f", form, "-o", str(target), "configs/cube_corner.yaml", "configs/water.yaml"
        )
        assert (outcome.code, outcome.out, outcome.err) == (0, "", "")
        printed = program("axes", "-f", form, "configs/cube_corner.yaml", "configs/water.yaml").out
        assert target.read_text() == printed


def test_an_existing_file_keeps_its_mode_and_a_new_one_has_the_usual_one(
    folder: Path, program: Program
) -> None:
    old, new = folder / "old", folder / "new"
    old.write_text("before")
    old.chmod(0o640)
    umask = os.umask(0o027)
    try:
        for path in (old, new):
            assert program("inertia", "-o", str(path), str(folder / "good.yaml")).code == 0
    finally:
        os.umask(umask)
    assert stat.S_IMODE(old.stat().st_mode) == stat.S_IMODE(new.stat().st_mode) == 0o640
    assert old.read_text() == new.read_text()


def test_a_write_that_fails_halfway_leaves_the_old_file(
    folder: Path, program: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = folder / "out"
    target.write_text("before")

    def full(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    outcome = program("inertia", "-o", str(target), str(folder / "good.yaml"))
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err == f"{target}: cannot be written: No space left on device\n"
    assert target.read_text() == "before"
    assert {path.name for path in folder.iterdir()} == {"out", "good.yaml", "bad.yaml", "noted.yaml"}


def test_output_may_be_a_pipe() -> None:
    done = process("new", "points", "-o", "/dev/stdout")
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout == (ROOT / "rigidcli/starters/points.yaml").read_bytes()


# --- terminals, pipes, signals


def in_terminal(
    *arguments: str, columns: int, environment: Mapping[str, str] | None = None
) -> tuple[int, str]:
    """Exit code and output of the program in a pseudo terminal of so many columns."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
    clean = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR")}
    child = subprocess.Popen(
        [sys.executable, "-m", "rigidcli", *arguments],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        stderr=theirs,
        env={**clean, "TERM": "xterm-256color", **(environment or {})},
    )
    os.close(theirs)
    data = b""
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError:  # Linux says EIO when the last writer has gone
            piece = b""
        if not piece:
            break
        data += piece
    os.close(ours)
    return child.wait(30), data.decode().replace("\r\n", "\n")


def bare(shown: str) -> str:
    """What a terminal shows, without its colours."""
    return re.sub(r"\x1b\[[0-9;]*m", "", shown)


def test_a_narrow_terminal_cuts_no_number(program: Program, tmp_path: Path) -> None:
    """A number without its last digits looks like another number."""
    path = tmp_path / "long.yaml"
    document = (ROOT / "configs/known_tensor.yaml").read_text()
    path.write_text(document.replace("name: gearbox", f"name: {'a long name ' * 20}"))
    code, shown = in_terminal("axes", str(path), columns=60)
    assert code == 0
    plain = bare(shown)
    assert "\x1b" not in plain
    assert "…" not in plain
    assert max(map(len, plain.split("\n"))) <= 60
    wide = program("axes", "configs/known_tensor.yaml").out
    assert sorted(numbers_of(plain)) == sorted(numbers_of(wide))


def test_a_terminal_as_wide_as_the_table_shows_the_same_as_a_pipe(program: Program) -> None:
    code, shown = in_terminal("axes", "configs/water.yaml", columns=120)
    assert code == 0
    assert "\x1b[1m" in shown
    lines = [line.rstrip() for line in bare(shown).split("\n")]
    assert lines == program("axes", "configs/water.yaml").out.split("\n")


def test_no_colour_where_it_is_not_wanted() -> None:
    code, shown = in_terminal("inertia", "configs/water.yaml", columns=100, environment={"NO_COLOR": "1"})
    assert code == 0
    assert "\x1b" not in shown


@pytest.mark.parametrize(
    "arguments",
    [["validate", "configs/water.yaml"], ["-h"]],
    ids=lambda arguments: arguments[0],
)
def test_a_closed_pipe_ends_quietly(arguments: list[str]) -> None:
    """As in `rigidcli ... | head -1`, when head has gone before the first byte comes."""
    reader, writer = os.pipe()
    os.close(reader)
    done = process(*arguments, stdout=writer)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, b"")


def test_head(folder: Path) -> None:
    files = " ".join(500 * [str(folder / "good.yaml")])
    done = shell(f"{{ rigidcli inertia -f json {files}; echo $? >&2; }} | head -1")
    assert json.loads(done.stdout)["mass"] == 12
    assert done.stderr == b"0\n"


@pytest.mark.parametrize("where", [">&-", "> /dev/full"])
def test_standard_output_that_takes_nothing_is_told_without_a_traceback(where: str) -> None:
    done = shell(f"rigidcli inertia configs/water.yaml {where}")
    assert b"Traceback" not in done.stderr
    assert len(done.stderr.splitlines()) <= 1
    if where == "> /dev/full":
        assert done.returncode == 2
        assert b"No space left on device" in done.stderr


def test_closed_standard_error_does_not_send_errors_to_standard_output(folder: Path) -> None:
    done = shell(f"rigidcli inertia -f json {folder}/bad.yaml {folder}/good.yaml 2>&-")
    assert done.returncode == 3
    assert json.loads(done.stdout)["mass"] == 12


def test_a_narrow_encoding_is_no_trouble(folder: Path) -> None:
    (folder / "named.yaml").write_text(f"name: é日\n{CUBE}", encoding="utf-8")
    ascii_only = {"PYTHONIOENCODING": "ascii"}
    done = process("inertia", "-f", "json", str(folder / "named.yaml"), environment=ascii_only)
    assert (done.returncode, done.stderr) == (0, b"")
    assert json.loads(done.stdout.decode())["name"] == "é日"


# --- schema and starters


@pytest.fixture(scope="module")
def schema() -> Any:
    from rigidcli.reference.schema import json_schema

    return json.loads(json.dumps(json_schema()))


@cache
def validator_of(kind: SchemaKind) -> jsonschema.Draft202012Validator:
    """The schema that the command prints."""
    found = json.loads(CliRunner().invoke(app, ["schema", kind]).output)
    jsonschema.Draft202012Validator.check_schema(found)
    return jsonschema.Draft202012Validator(found)


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft202012Validator:
    return validator_of(SchemaKind.document)


def test_the_command_prints_the_schema(schema: Any, program: Program) -> None:
    outcome = program("schema")
    assert (outcome.code, outcome.err) == (0, "")
    assert json.loads(outcome.out) == schema
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert {f"#/$defs/{name}" for name in schema["$defs"]} >= set(re.findall(r'#/\$defs/[^"]+', outcome.out))


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_the_schema_accepts_every_document_we_give(path: Path, validator: Any) -> None:
    validator.validate(read_tree(path.read_text(), path.name))


def misspelt(tree: Any) -> Iterator[Any]:
    """The tree with one key, anywhere in it, misspelt."""
    if isinstance(tree, dict):
        for key, value in tree.items():
            others = {k: v for k, v in tree.items() if k != key}
            yield {**others, f"{key}x": value}
            if key != "parameters":
                yield from ({**others, key: changed} for changed in misspelt(value))
    elif isinstance(tree, list):
        for index, value in enumerate(tree):
            yield from ([*tree[:index], changed, *tree[index + 1 :]] for changed in misspelt(value))


@pytest.mark.parametrize("name", ["three_equal_masses", "cone_top"])
def test_schema_and_program_reject_every_misspelt_key(name: str, validator: Any, program: Program) -> None:
    changed = list(misspelt(read_tree((ROOT / "configs" / f"{name}.yaml").read_text(), name)))
    assert changed
    for tree in changed:
        assert not validator.is_valid(tree), tree
        assert program("validate", "-", stdin=json.dumps(tree)).code == 3, tree


@pytest.mark.parametrize("shape", DIMENSIONS)
def test_schema_and_program_agree_on_every_shape(shape: str, validator: Any) -> None:
    whole = {"shape": shape, "mass": 1, **read_tree(f"{{{DIMENSIONS[shape]}}}", shape)}
    placed = {**whole, "name": "x", "position": [1, "2 cm", "a"], "axis": [0, 1, 1], "anchor": "com"}
    good = {"parameters": {"a": 1}, "body": {"parts": [whole, placed]}}
    validator.validate(good)
    loads(json.dumps(good))
    wrong = [{k: v for k, v in whole.items() if k != key} for key in whole]
    wrong += [{**whole, "density": 1}, {**whole, "anchor": "middle"}, {**whole, "mass": -1}]
    for bad in wrong:
        assert not validator.is_valid({"body": bad}), bad
        with pytest.raises(DocumentError):
            loads(json.dumps({"body": bad}))


FORMS_OF_DOCUMENTS = """
{body: {points: [[1, 0, 0, 0], {mass: 2 kg, position: [0, a, 1]}]}, parameters: {a: 2 m}}
{body: {moments: [1, 2, 3]}, about: com}
body: {inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], mass: 1, com: [0, 0, 0], given_about: origin}
{body: {moments: [1, 2, 3], given_about: [1, 0, 0]}, about: [1, 0, 0]}
{name: x, description: y, parameters: {a: null, b: 2*a, c: 3}, body: {shape: cube, side: a, mass: 1}}
{body: {shape: cube, side: 1, mass: 12}, frame: {axis: [0, 0, 1], angle: 30 deg}}
{body: {shape: cube, side: 1, mass: 12}, frame: {euler: [1, 2, 3], sequence: zyx}}
{body: {shape: cube, side: 1, mass: 12}, frame: {quaternion: [1, 0, 0, 0]}}
{body: {shape: cube, side: 1, mass: 12}, frame: {matrix: [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]}}
{body: {shape: cube, side: 1, mass: 12}, motion: {omega: [0, 0, 5 rpm], basis: principal}}
"""


@pytest.mark.parametrize(
    "text",
    words_of(FORMS_OF_DOCUMENTS),
)
def test_schema_and_program_agree_on_every_form(text: str, validator: Any, program: Program) -> None:
    validator.validate(read_tree(text, "form"))
    assert program("axes", "-q", "-", stdin=text).code == 0


def nodes(tree: Any) -> Iterator[dict[str, Any]]:
    if isinstance(tree, dict):
        yield tree
        for value in tree.values():
            yield from nodes(value)
    elif isinstance(tree, list):
        for value in tree:
            yield from nodes(value)


HOMEWORK = sorted((ROOT / "configs/homework").rglob("*.[yj]*"))


@pytest.mark.parametrize(
    "path", [path for path in HOMEWORK if path.stem != "eve"], ids=lambda path: path.stem
)
def test_schema_and_program_accept_the_homework(path: Path, program: Program) -> None:
    kind = "assignment" if path.stem == "assignment" else "answers"
    validator_of(SchemaKind(kind)).validate(read_tree(path.read_text(), path.name))
    assert program("validate", str(path)).code == (3 if path.stem == "dave" else 0)


WRONG_QUESTIONS = """
{}   {ask: axes}   {answer: 1}   {document: x.yaml, ask: axes, answer: 1, kind: number}
{answer: 1, kind: numbr}   {answer: 1, kind: number, pionts: 1}   {answer: 1, kind: number, points: -1}
{answer: 1, kind: number, tolerance: {relativ: 1}}   {answer: 1, kind: number, symbols: {x: negative}}
{answer: 1, kind: number, credit: half}   {answer: 1, kind: number, credit: {unit_missing: 1.5}}
{answer: 1, kind: number, accept: [{credit: 1}]}
{answer: 1, kind: number, accept: [{answer: 2, credit: 2}]}
"""


@pytest.mark.parametrize(
    "question",
    words_of(WRONG_QUESTIONS),
)
def test_schema_and_program_refuse_the_same_questions(question: str, program: Program) -> None:
    good = "questions: {a: {answer: 1, kind: number, credit: {unit_missing: 1}, accept: [{answer: 2}]}}"
    validator = validator_of(SchemaKind.assignment)
    validator.validate(read_tree(good, "hw"))
    assert program("validate", "-", stdin=good).code == 0
    bad = f"questions: {{a: {question}}}"
    assert not validator.is_valid(read_tree(bad, "hw"))
    assert program("validate", "-", stdin=bad).code == 3


def test_the_schema_helps_whoever_types(schema: Any) -> None:
    for section in [schema, *schema["$defs"].values()]:
        assert section.get("description"), section
    for node in nodes(schema):
        for key, value in node.get("properties", {}).items():
            if isinstance(value, dict) and isinstance(node["properties"], dict):
                assert value.get("title"), key
    text = json.dumps(schema)
    for unit in ("(m)", "(kg)", "(kg/m^3)", "(kg/m^2)", "(kg/m)", "(rad)", "(rad/s)", "(kg m^2)"):
        assert unit in text


# Those of files, and that which names one, are tried in test_body_files.
@pytest.mark.parametrize("kind", sorted({*Kind} - {Kind.mesh, *ENDINGS}))
def test_a_starter_is_commented_and_valid(kind: str, program: Program) -> None:
    starter = program("new", kind).out
    assert starter.startswith("# ")
    assert starter.count("#") >= 3
    assert "\t" not in starter
    assert max(map(len, starter.splitlines())) <= 120
    validator_of(SchemaKind(kind if kind in [*SchemaKind] else "document")).validate(read_tree(starter, kind))
    outcome = program("validate", "-", stdin=starter)
    assert (outcome.code, outcome.err) == (0, "")
    assert set(re.findall(r"rigidcli (\w+)", starter)) <= set(COMMANDS)
    assert kind != "shape" or program("new").out == starter


@pytest.mark.parametrize("kind", sorted({*Kind} - {Kind.mesh, Kind.gradescope}))  # they need other files
def test_a_written_starter_names_a_command_that_works(kind: str, program: Program, tmp_path: Path) -> None:
    target = tmp_path / f"my {kind}{ENDINGS.get(Kind(kind), '.yaml')}"
    wrote = program("new", kind, "-o", str(target))
    assert (wrote.code, wrote.out) == (0, "")
    told, _, command = wrote.err.rstrip("\n").partition("; next: rigidcli ")
    assert told == f"wrote {target}"
    assert program(*shlex.split(command)).code == 0
