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
from rigidcli.reference.entries import entries
from tests.conftest import Program
from tests.tables import rows_of

LOOSE = yaml.safe_load(Path(__file__).with_name("loose.yaml").read_text(encoding="utf-8"))

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
        if listed := re.search(r"write `(\w+): (\[.*\])` for (.*)", hint):
            place[listed[1]] = yaml.safe_load(listed[2])
            for each in re.findall(r"`(.*?)`", listed[3]):
                del place[each]
        elif says.startswith("unknown key") and wanted and ": " in wanted:
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


@pytest.mark.parametrize(
    "text", [*(f"{{body: {{{body}}}}}" for body in LOOSE["bodies"]), *LOOSE["documents"]]
)
def test_the_word_of_a_shape_or_a_key_leads_to_a_valid_document(text: str, program: Program) -> None:
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
        (f"name: 1e3\ndescription: 7\n{CUBE}", f'name: "1e3"\n{CUBE}'),
        (f"about: base\nbody: {TURNED}", f"about: [0, 0, 0]\nbody: {TURNED}"),
    ],
)
def test_what_is_clear_is_read(loose: str, strict: str, program: Program) -> None:
    first, second = (program("axes", "-f", "json", "-", stdin=text) for text in (loose, strict))
    assert first.code == 0, first.err
    loosely, strictly = (json.loads(outcome.out) for outcome in (first, second))
    assert loosely["name"] == strictly["name"]
    for key in ("tensor", "about", "center_of_mass"):
        np.testing.assert_allclose(loosely[key], strictly[key], rtol=1e-14, atol=1e-14)


def test_a_lagrangian_as_the_tool_prints_it_is_read(program: Program) -> None:
    printed = program("hamilton", "-", stdin=SPRING).out
    (shown,) = re.findall(r"^Lagrangian +(.*)$", printed, re.MULTILINE)
    again = SPRING.replace("m*xdot**2/2 - k*x**2/2", shown)
    assert again != SPRING
    first, second = (program("hamilton", "-f", "json", "-", stdin=text).out for text in (SPRING, again))
    assert first == second


UNDERSTOOD = yaml.safe_load(Path(__file__).with_name("understood.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("command", "typed", "meant"), UNDERSTOOD)
def test_what_has_one_meaning_is_read_at_once(command: str, typed: str, meant: str, program: Program) -> None:
    first, second = (program(command, "-f", "json", "-", stdin=text) for text in (typed, meant))
    assert (first.code, first.err) == (0, "")
    assert first.out == second.out


@pytest.mark.parametrize(
    ("begin", "told"),
    rows_of(__file__, "a file of another kind is told what it is"),
)
def test_a_file_of_another_kind_is_told_what_it_is(
    begin: bytes, told: str, tmp_path: Path, program: Program
) -> None:
    path = tmp_path / "f.yaml"
    path.write_bytes(begin)
    for command in ("axes", "validate"):
        outcome = program(command, str(path))
        assert (outcome.code, outcome.out) == (3, "")
        assert told in outcome.err


@pytest.mark.parametrize(
    ("arguments", "told"),
    rows_of(__file__, "a word on the command line is told what is meant"),
)
def test_a_word_on_the_command_line_is_told_what_is_meant(
    arguments: str, told: str, program: Program
) -> None:
    outcome = program(*arguments.split(), stdin=CUBE, columns=1000)
    assert (outcome.code, outcome.out) == (2, "")
    assert told in outcome.err


SLIPS = yaml.safe_load(Path(__file__).with_name("slips.yaml").read_text(encoding="utf-8"))


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
    rows_of(__file__, "a slip is told once"),
)
def test_a_slip_is_told_once(body: str, lines: list[str], program: Program) -> None:
    told = program("validate", "-", stdin=f"body: {{{body}}}").err.splitlines()
    assert [line in text for line, text in zip(lines, told, strict=True)] == [True] * len(lines)


def test_thousands_of_lists_without_brackets_are_told_in_seconds(program: Program) -> None:
    lists = ", ".join(f"a{2 * k}: 1, {2 * k + 10}, {2 * k + 11}" for k in range(2500))
    start = time.process_time()
    outcome = program("validate", "-", stdin=f"body: {{shape: box, {lists}}}")
    assert (outcome.code, "write `a0: [1, 10, 11]`" in outcome.err) == (3, True)
    assert time.process_time() - start < 15  # 0.7 s; minutes, if each list went through all of them


CURES = yaml.safe_load(Path(__file__).with_name("cures.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("text", "told", "cure", "cured_text"), CURES)
def test_a_message_has_the_cure(text: str, told: str, cure: str, cured_text: str, program: Program) -> None:
    outcome = program("validate", "-", stdin=text)
    assert (outcome.code, outcome.out) == (3, "")
    assert told in outcome.err
    assert cure in outcome.err
    assert program("validate", "-q", "-", stdin=cured_text).code == 0


def test_the_tables_of_words_lead_to_what_there_is(program: Program) -> None:
    known = {entry.path[-1] for entry in entries()} | {"Ixy", "Ixz", "Iyz"}
    known |= {key for each in SHAPES.values() for key in each.model_fields}
    for called in (*words.KEYS_BY_WORD.values(), *words.HALVED.values()):
        assert set(called) <= known
    shapes = {shape for called in words.SHAPES_BY_WORD.values() for shape in called}
    assert shapes | set(words.RELATIVES) | set(" ".join(words.RELATIVES.values()).split()) <= set(SHAPES)
    assert not set(words.SHAPES_BY_WORD) & set(SHAPES)
    for form in words.OTHER_FORMS:
        assert program("validate", "-q", "-", stdin=f"body: {{{form}}}").code == 0
