"""Documents as people write them at first: they are read, or what is wrong is told with its cure."""

from __future__ import annotations

import json
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rigidcli.bodies.shapes import SHAPES
from rigidcli.fields import words
from rigidcli.reference import keys
from tests.conftest import Program
from tests.tables import words_of

STARTS = """
shape: cuboid   shape: cuboid, side: 2   shape: cuboid, size: 2   shape: cuboid, side: [1, 2, 3]
shape: cuboid, width: 1, height: 2, depth: 3   shape: brick, dimensions: [1, 2, 3]
shape: block, edges: [1, 2, 3]   shape: Cuboid, length: 3, width: 2, height: 1
shape: rectangular prism, size: [1, 2, 3]   shape: box, side: 2   shape: box, side: [1, 2, 3]
shape: cube, size: [1, 2, 3]   shape: cube, size: 2   shape: cube, edge: 2   shape: cube, length: 2
shape: rectangle, size: [1, 2]   shape: rectangle, width: 1, height: 2   shape: square, side: 2
shape: ball, radius: 1   shape: ball, r: 1   shape: solid sphere, R: 1   shape: sphere, diameter: 10 cm
shape: sphere, outer_radius: 2, inner_radius: 1   shape: hollow ball, outer_radius: 2, inner_radius: 1
shape: hoop, radius: 1   shape: hoop, r: 1   shape: ring, inner_radius: 1, outer_radius: 2
shape: hollow_cylinder, inner_radius: 1, outer_radius: 2, height: 3
shape: hollow cylinder, r1: 1, r2: 2, length: 3
shape: pipe, inner_diameter: 1, outer_diameter: 2, length: 3
shape: pipe, inner_radius: 1, outer_radius: 2, length: 3
shape: cylinder, inner_radius: 1, outer_radius: 2, height: 3   shape: cylinder, radius: 1, length: 3
shape: cylinder, r: 1, h: 3   shape: cylinder, diameter: 2, length: 3   shape: stick, length: 2
shape: stick, l: 2   shape: wire, length: 2   shape: bar, length: 2   shape: bar, radius: 0.1, length: 2
shape: pole, length: 2   shape: rod, height: 2   shape: rod, radius: 0.1, length: 2
shape: thin rod, length: 2   shape: washer, inner_radius: 1, outer_radius: 2
shape: washer, inner_radius: 1, outer_radius: 2, thickness: 0.1   shape: dumbbell, length: 2   shape: point
shape: disc, radius: 1   shape: disc, radius: 1, thickness: 0.1   shape: disk, radius: 1, height: 0.1
shape: disk, diameter: 2   shape: plate, size: [1, 2, 0.1]   shape: plate, width: 1, height: 2
shape: plate, vertices: [[0, 0], [1, 0], [0, 1]]   shape: wheel, radius: 1, width: 0.1
shape: donut, major_radius: 3, minor_radius: 1   shape: donut, R: 3, r: 1   shape: egg, semi_axes: [1, 2, 3]
shape: bowl, radius: 1   shape: dome, radius: 1   shape: shell, radius: 1
shape: truncated cone, bottom_radius: 2, top_radius: 1, height: 3
shape: cone, bottom_radius: 2, top_radius: 1, height: 3   shape: cone, base_radius: 2, h: 3
shape: pyramid, side: 2, height: 3   shape: semicircle, radius: 1
shape: hexagon, corners: [[0, 0], [1, 0], [0, 1]]   shape: pill, r: 1, length: 2   type: cube, side: 1
type: ball, radius: 1   kind: cylinder, radius: 1, height: 2   shap: cube, side: 1
shape: cube, side: 1, mas: 1   shape: sphere, radius: 1, centre: [0, 0, 1]
"""
"""Bodies in words of their authors; the masses are added."""

OTHERS = """
{masses: [[1, 0, 0, 0]]}
{particles: [[1, 0, 0, 0], [1, 1, 0, 0]]}
{components: [{shape: cube, side: 1, mass: 1}]}
{tensor: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], mass: 1}
{principal_moments: [1, 2, 3]}
{shape: cube, side: 1, mass: 1, about: com}
{shape: cube, side: 1, m: 1}
{shape: cube, side: 1, rho: 1}
{shape: cube, side: 1, mass: 1, at: [1, 0, 0]}
"""
"""Other bodies."""

DOCUMENTS = [
    "{shape: cube, side: 1, mass: 1}",
    "{omega: [0, 0, 1], body: {shape: cube, side: 1, mass: 1}}",
    "{body: {shape: cube, side: 1, mass: 1}, pivot: [1, 0, 0]}",
    "{body: {shape: cube, side: a, mass: 1}, params: {a: 2}}",
    "{body: {shape: cube, side: a, mass: 1}, constants: {a: 2}}",
    "{body: {shape: cube, side: 1, mass: 1}, motion: {w: [0, 0, 1], tmax: 3, dt: 0.1}}",
    "{top: {spin: 100, theta: 0.3, g: 9.81, mass: 1, R: 0.1, I1: 0.02, I3: 0.001}}",
    "{system: {coordinates: [x], L: xdot**2/2}}",
    "{system: {coords: [x], T: xdot**2/2, V: x**2}}",
    "{system: {coordinates: [x], H: p_x**2/2}}",
    "{lagrangian: xdot**2/2, coordinates: [x]}",
    "{system: {coordinates: [x], lagrangian: xdot**2/2, orbit: {initial: {x: 0, p_x: 1}, duration: 2}}}",
    "{system: {q: [x], kinetic: xdot**2/2}, orbit: {ic: {x: 0, p_x: 1}, t_end: 2}}",
    "{system: {coordinates: [x], lagrangian: xdot**2/2}, initial: {x: 0, p_x: 1}, duration: 2}",
    "{system: {coordinates: [x], hamiltonian: p_x**2/2, parameters: {m: null}}}",
]

TOLD = re.compile(
    r"-:1: (?:(?P<key>[\w.]+): )?(?P<says>.*?)(?:\n  hint: (?P<hint>.*?))?(?=\n-:1|\n$)", re.DOTALL
)


def cured(tree: Any, told: str) -> Any:
    """The document with all cures that the messages name, to the letter."""
    for found in sorted(TOLD.finditer(told), key=lambda found: found["says"] == "missing"):
        *way, key = (found["key"] or "").split(".")
        says, hint = found["says"], found["hint"] or ""
        place = tree
        for step in way:
            place = place[int(step) if step.isdecimal() else step]
        guess = re.search(r"did you mean (.*?)\?", says)
        wanted = guess[1] if guess else None
        if says.startswith("unknown key") and wanted and ": " in wanted:
            place.update(yaml.safe_load(wanted))
        elif says.startswith("unknown key"):
            assert wanted, told
            place.setdefault(wanted, place.pop(key))
        elif "belongs at the top" in says:
            tree[key] = place.pop(key)
        elif written := re.search(r"write `(.*?)(?:: {(\w+): ...})?`(.*)", hint):
            value = place.pop(key)
            if written[2]:
                tree.setdefault(written[1], {})[written[2]] = value
            else:
                given = yaml.safe_load(f"{{{written[1]}}}")
                place = tree.setdefault("body", {}) if written[3].startswith(" instead") else place
                place.clear() if written[3].startswith(" instead") else None
                place.update(given)
        elif "expected exactly one of" in says and wanted:
            for wrong in [name for name in tree[key] if name not in ("mass", "com")][:1]:
                tree[key][wanted] = tree[key].pop(wrong)
        elif wanted:
            place[key] = wanted
        elif (says == "missing" and key not in place) or "expected a list" in says:
            entries = re.search(rf"`{key}: \[(.*?)\]`", told) or re.search(r"such as \[(.*?)\]", says)
            lists = {"size": [1, 2, 3], "vertices": [[0, 0], [1, 0], [0, 1]]}
            samples = [1, 2, 3][: len(entries[1].split(","))] if entries else lists.get(key, 1)
            place[key] = 0.5 if key == "inner_radius" else samples
    return tree


def walked(text: str, program: Program) -> list[str]:
    """What is told of a document, and then again of what it becomes by following that; nothing in the end."""
    tree = yaml.safe_load(text)
    told: list[str] = []
    for _ in range(3):
        outcome = program("validate", "-q", "-", stdin=json.dumps(tree))
        if outcome.code == 0:
            return told
        told.append(outcome.err)
        tree = cured(tree, outcome.err)
    raise AssertionError("\n".join([*told, json.dumps(tree)]))


@pytest.mark.parametrize("start", words_of(STARTS))
def test_the_word_of_a_shape_leads_to_a_valid_body(start: str, program: Program) -> None:
    mass = "" if "mas:" in start else ", mass: 1"
    assert 1 <= len(walked(f"{{body: {{{start}{mass}}}}}", program)) <= 2


@pytest.mark.parametrize("text", [*(f"{{body: {body}}}" for body in OTHERS.strip().splitlines()), *DOCUMENTS])
def test_the_word_of_a_key_leads_to_a_valid_document(text: str, program: Program) -> None:
    assert 1 <= len(walked(text, program)) <= 2


CUBE = "body: {shape: cube, side: 1, mass: 12}\n"
TURNED = (
    "{shape: cylinder, radius: 1, height: 2, mass: 3, position: [1, 0, 0],"
    " rotation: {axis: [0, 1, 0], angle: pi/2}}"
)
SPRING = "parameters: {m: 1, k: 4}\nsystem:\n  coordinates: [x]\n  lagrangian: m*xdot**2/2 - k*x**2/2\n"


@pytest.mark.parametrize(
    ("loose", "strict"),
    [
        (f"name: 13.20\n{CUBE}", f'name: "13.20"\n{CUBE}'),
        (f"name: 1e3\ndescription: 7\n{CUBE}", f'name: "1e3"\n{CUBE}'),
        ("body: {shape: cube, side: 10cm, mass: 6*10^24 kg}", "body: {shape: cube, side: 0.1, mass: 6e24}"),
        (
            "body: {inertia: {Ixx: 2, Iyy: 3, Izz: 4, Ixy: -0.5}, mass: 1}",
            "body: {inertia: [[2, -0.5, 0], [-0.5, 3, 0], [0, 0, 4]], mass: 1}",
        ),
        (f"about: corner\n{CUBE}", f"about: [-1/2, -1/2, -1/2]\n{CUBE}"),
        (f"about: base\nbody: {TURNED}", f"about: [0, 0, 0]\nbody: {TURNED}"),
        (
            "about: end\nbody: {shape: rod, length: 2, mass: 1}",
            "about: [0, 0, -1]\nbody: {shape: rod, length: 2, mass: 1}",
        ),
    ],
)
def test_what_is_clear_is_read(loose: str, strict: str, program: Program) -> None:
    first, second = (program("axes", "-f", "json", "-", stdin=text) for text in (loose, strict))
    assert first.code == 0, first.err
    loosely, strictly = (json.loads(outcome.out) for outcome in (first, second))
    assert loosely["name"] == strictly["name"]
    for key in ("tensor", "about", "center_of_mass"):
        np.testing.assert_allclose(loosely[key], strictly[key], rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("names", ["x", "'x, y'", "x,  y"])
def test_coordinates_may_be_a_text(names: str, program: Program) -> None:
    system = f"system: {{coordinates: {names}, kinetic: xdot**2/2{' + ydot**2/2' * ('y' in names)}}}"
    if names == "x,  y":  # in a flow mapping the comma would end the value
        system = "system:\n  coordinates: x,  y\n  kinetic: xdot**2/2 + ydot**2/2\n"
    result = json.loads(program("hamilton", "-f", "json", "-", stdin=system).out)
    assert result["coordinates"] == (["x", "y"] if "y" in names else ["x"])


def test_a_lagrangian_as_the_tool_prints_it_is_read(program: Program) -> None:
    printed = program("hamilton", "-", stdin=SPRING).out
    (shown,) = re.findall(r"^Lagrangian +(.*)$", printed, re.MULTILINE)
    again = SPRING.replace("m*xdot**2/2 - k*x**2/2", shown)
    assert again != SPRING
    first, second = (program("hamilton", "-f", "json", "-", stdin=text).out for text in (SPRING, again))
    assert first == second


@pytest.mark.parametrize(
    "text", ["inertia: {Ixx: 1, Iyy: 1}, mass: 1", "inertia: {Ixx: 1, Iyy: 1, Izz: 1, Iyx: 2}"]
)
def test_a_tensor_by_its_entries_has_the_three_and_no_others(text: str, program: Program) -> None:
    outcome = program("axes", "-", stdin=f"body: {{{text}}}")
    assert outcome.code == 3
    assert "Izz: missing" in outcome.err or "did you mean Ixy?" in outcome.err


SLIPS = [
    ("body:\n  shape cube\n  side: 1\n  mass: 1\n", 2, "shape cube", "write `shape: cube`"),
    ("body:\n  shape: cube\n  side 1\n  mass: 1\n", 3, "side 1", "write `side: 1`"),
    ("body:\n  shape: cube\n  side: 1\n  mass = 1\n  name: x\n", 4, "mass = 1", "write `mass: 1`"),
    ("body:\n  shape:cube\n  side: 1\n  mass: 1\n", 2, "shape:cube", "write `shape: cube`"),
    ("body:\n  shape: cube\n  side:1\n  mass: 1\n", 3, "side:1", "write `side: 1`"),
    ("body:\n  shape:cube\n", 2, "shape:cube", "write `shape: cube`"),
    ("# a cube\nshape cube\n", 2, "shape cube", "write `shape: cube`"),
    ("body: {shape: cube, side 1, mass: 1}\n", 1, "side 1", "write `side: 1`"),
    ("body: {shape:cube, side:1, mass:1}\n", 1, "shape:cube", "write `shape: cube`"),
    ("body\n  shape: cube\n", 1, "body", "write `body:`"),
    ("name: x\nbody:\n\tshape: cube\n", 3, "\\tshape", "blanks, not tabs"),
    ("body:\n  shape: cube\n  side: 1\n \tmass: 1\n", 4, "\\tmass", "blanks, not tabs"),
    ("body:\n  shape: cube\n   side: 1\n  mass: 1\n", 3, "side: 1", "in the same column"),
    ("body:\n  shape: cube\n side: 1\n  mass: 1\n", 3, "side: 1", "in the same column"),
    ("body:\n    shape: cube\n  side: 1\n", 3, "side: 1", "in the same column"),
    ("body:\n  parts:\n    - shape: cube\n      side: 1\n     mass: 1\n", 5, "mass", "in the same column"),
    ("body:\n  parts:\n    - shape: cube\n    side: 1\n", 4, "side", "in the same column"),
    ("body: {shape: cube, side: 1\nmotion:\n  omega: [0, 0, 1]\n", 1, "{", "close the bracket by `}`"),
    ("body: {shape: box, size: [1, 2, 3, mass: 1}\n", 1, "[1", "close the bracket by `]`"),
    (
        "name: x\nbody:\n  shape: box\n  size: [1, 2, 3\n  mass: 2\nabout: com\n",
        4,
        "[",
        "close the bracket by `]`",
    ),
    (
        "body:\n  parts:\n    - {shape: cube, side: 1, mass: 1\n    - {shape: cube, side: 1, mass: 1}\n",
        3,
        "{",
        "`}`",
    ),
    ("body: {shape: cube side: 1, mass: 1}\n", 1, "side", "commas"),
    ('name: "x\nbody: {shape: cube, side: 1, mass: 1}\n', 1, '"', "quote"),
    ('name: "a \\omega"\nbody: {shape: cube, side: 1, mass: 1}\n', 1, "\\omega", "single quotes"),
    ("name: a: b\nbody: {shape: cube, side: 1, mass: 1}\n", 1, ": b", "in quotes"),
    ("body:\n  shape: box\n  size: 1, 2, 3\n  mass: 1\n", 3, "1, 2, 3", "write `[1, 2, 3]`"),
    ("body: {shape: cube, side: 1, mass: 1}\nname: @x\n", 2, "@", "quotes"),
    ("body: {moments: 1, 2, 3, mass: 2}\n", 1, "1, 2", "write `moments: [1, 2, 3]`"),
    ("body: {shape: cube, side: 1, mass: 1, position: 1, -2, 3}\n", 1, "1, -2", "`position: [1, -2, 3]`"),
]
"""Texts, the line of the slip, what the caret points at (the end of a key, or a beginning), the cure."""


@pytest.mark.parametrize(("text", "line", "place", "cure"), SLIPS)
def test_a_slip_is_shown_where_it_is(text: str, line: int, place: str, cure: str, program: Program) -> None:
    outcome = program("validate", "-", stdin=text)
    first, typed, caret, *rest = outcome.err.splitlines()
    assert outcome.code == 3
    assert first.startswith(f"-:{line}: ")
    assert typed.strip() == text.splitlines()[line - 1].replace("\t", "\\t").strip()
    pointed = caret.index("^")
    assert set(caret.strip()) == {"^"}
    assert typed.index(place) <= pointed <= typed.index(place) + len(place.split(" ")[0].split(":")[0]) + 1
    assert cure in f"{first}{rest[0]}"


@pytest.mark.parametrize(
    ("body", "lines"),
    [
        ("shape: cylinder, r: 1, h: 2, mass: 1", ["(did you mean radius?)", "(did you mean height?)"]),
        ("shape: cylinder, r: 1, mass: 1", ["(did you mean radius?)", "body.height: missing"]),
        (
            "shape: sphere, radius: 1, mass: 1, position: 0, 0, 0",
            ["stands twice", "in brackets: `[1, 2, 3]`"],
        ),
        ("points: [[1 2 3 4]]", ["no operator before `2`", "separate the entries of a list", "expected 4"]),
    ],
)
def test_a_slip_is_told_once(body: str, lines: list[str], program: Program) -> None:
    told = program("validate", "-", stdin=f"body: {{{body}}}").err.splitlines()
    assert [line in text for line, text in zip(lines, told, strict=True)] == [True] * len(lines)


def test_thousands_of_lists_without_brackets_are_told_in_seconds(program: Program) -> None:
    lists = ", ".join(f"a{2 * k}: 1, {2 * k + 10}, {2 * k + 11}" for k in range(5000))
    start = time.process_time()
    outcome = program("validate", "-", stdin=f"body: {{shape: box, {lists}}}")
    assert (outcome.code, "write `a0: [1, 10, 11]`" in outcome.err) == (3, True)
    assert time.process_time() - start < 15  # 1.4 s; minutes, if each list went through all of them


CURES = yaml.safe_load(Path(__file__).with_name("cures.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("text", "told", "cure", "cured_text"), CURES)
def test_a_message_has_the_cure(text: str, told: str, cure: str, cured_text: str, program: Program) -> None:
    outcome = program("validate", "-", stdin=text)
    assert (outcome.code, outcome.out) == (3, "")
    assert told in outcome.err
    assert cure in outcome.err
    assert program("validate", "-q", "-", stdin=cured_text).code == 0


@pytest.mark.parametrize("setting", ["body.size[0]=3 cm", "body.size.0 = 3 cm", " body . size.0=3 cm"])
def test_a_setting_may_have_brackets_and_blanks(setting: str, program: Program) -> None:
    box = "body: {shape: box, size: [1, 2, 3], mass: 1}"
    outcome = program("inertia", "-f", "json", "-", "--set", setting, stdin=box)
    strict = program("inertia", "-f", "json", "-", "--set", "body.size=[0.03, 2, 3]", stdin=box)
    assert outcome.code == 0, outcome.err
    assert outcome.out == strict.out


def test_a_setting_of_a_key_without_its_section_is_told_the_path(program: Program) -> None:
    assert "its path is `body.mass`" in program("inertia", "-", "-s", "mass=3", stdin=CUBE).err


def test_what_is_typed_in_another_way_on_the_command_line(tmp_path: Path, program: Program) -> None:
    (tmp_path / "cube.yaml").write_text(CUBE)
    file = str(tmp_path / "cube.yaml")
    (tmp_path / "wide.yaml").write_bytes(CUBE.encode("utf-16"))
    forgotten = program(file)
    assert forgotten.code == 2
    assert f"`rigidcli axes {file}`" in forgotten.err
    product = program("axes", file, "--units", "g cm")
    assert (product.code, product.out) == (2, "")
    assert "write commas: `g,cm`" in product.err
    assert program("axes", file, "--units", "kg m^2").code == 0
    assert "save the file as UTF-8" in program("axes", str(tmp_path / "wide.yaml")).err


def test_the_tables_of_words_lead_to_what_there_is(program: Program) -> None:
    known = {key.path[-1] for key in keys.every()} | {"Ixy", "Ixz", "Iyz"}
    known |= {key for each in SHAPES.values() for key in each.model_fields}
    for called in (*words.KEYS_BY_WORD.values(), *words.HALVED.values()):
        assert set(called) <= known
    shapes = {shape for called in words.SHAPES_BY_WORD.values() for shape in called}
    assert shapes | set(words.RELATIVES) | set(" ".join(words.RELATIVES.values()).split()) <= set(SHAPES)
    assert not set(words.SHAPES_BY_WORD) & set(SHAPES)
    for form in words.OTHER_FORMS:
        assert program("validate", "-q", "-", stdin=f"body: {{{form}}}").code == 0
