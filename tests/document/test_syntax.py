"""YAML 1.2 and JSON as they are read: scalars, bounds, what is refused and where, speed on hostile text."""

from __future__ import annotations

import json
import math
import time
from contextlib import suppress
from decimal import Decimal
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rigidcli.document.load import load
from rigidcli.document.yaml_reader import DEEPEST_NESTING, MAX_INTEGER_DIGITS, read_tree
from rigidcli.errors import DocumentError
from rigidcli.errors import Path as Keys
from rigidcli.fields.texts import MAX_BYTES
from tests.tables import rows_of


def refusal(text: str) -> tuple[int | None, str]:
    """Line and message with which a text is refused."""
    with pytest.raises(DocumentError) as caught:
        read_tree(text, "file.yaml")
    (problem,) = caught.value.problems
    assert problem.source == "file.yaml"
    return problem.line, f"{problem.message} {problem.hint or ''}"


# --- scalars


@pytest.mark.parametrize(
    ("text", "value"),
    rows_of(__file__, "a plain scalar is what yaml 1 2 says"),
)
def test_a_plain_scalar_is_what_yaml_1_2_says(text: str, value: object) -> None:
    for document in (f"a: {text}", f"a: {text}  # comment\n", f"[{text}]", f"%YAML 1.1\n---\na: {text}"):
        tree = read_tree(document, "f")
        (read,) = tree.values() if isinstance(tree, dict) else tree
        assert (type(read), read) == (type(value), value)


NO_NUMBERS = """
    1:30 12:30:45 08:00 2001-12-14 yes no on off y n tRue nULL 1_000 0b11 -0x1F 0o8 0o 0x 1e 1e+ e3 .e3 . + -
    =1 1.2.3 1e3.5 inf nan Infinity NaN .iNF ٣ ½ 5cm 1,5
"""


@pytest.mark.parametrize("text", NO_NUMBERS.split())
def test_what_yaml_1_2_does_not_call_a_number_or_boolean_is_a_text(text: str) -> None:
    assert read_tree(f"a: '{text}'", "f") == {"a": text}
    if text not in ("-", "=1"):  # a lone dash begins a list
        assert read_tree(f"a: {text}", "f") == {"a": text}


@pytest.mark.parametrize(
    ("text", "tree"),
    [
        *((text, None) for text in ("", "\n\n", "# a comment\n# another", "---\n", "~", "null")),
        ("- 1\n- a", [1, "a"]),
        ("hello", "hello"),
        ("a: |\n  1\n  2\nb: >-\n  3\n", {"a": "1\n2\n", "b": "3"}),
        ("a:\t1\nb: [1,\t2]\t# comment\n", {"a": 1, "b": [1, 2]}),
        ("---\na: 1\n...\n", {"a": 1}),
        ("%YAML 1.2\n---\na: 1\n", {"a": 1}),
        ("[1e999, -1e999, 1e-999, 1e99999999999999999999]", [math.inf, -math.inf, 0.0, math.inf]),
        ("[0.1, .nan]", [0.1, pytest.approx(math.nan, nan_ok=True)]),
    ],
)
def test_what_is_read(text: str, tree: object) -> None:
    assert read_tree(text, "f") == tree


def test_decimals_are_kept_digit_by_digit_when_asked() -> None:
    assert read_tree("[0.1, 1e999, 3]", "f", Decimal) == [Decimal("0.1"), Decimal("1e999"), 3]


def test_integers_have_a_bound_on_their_digits() -> None:
    assert read_tree("9" * MAX_INTEGER_DIGITS, "f") == 10**MAX_INTEGER_DIGITS - 1
    assert refusal("a:\n  " + "9" * (MAX_INTEGER_DIGITS + 1))[0] == 2
    assert f"{MAX_INTEGER_DIGITS + 1} digits" in refusal("9" * (MAX_INTEGER_DIGITS + 1))[1]
    assert "digits" in refusal("9" * 1_000_000)[1]


# --- keys


def test_keys_are_texts_as_they_are_written() -> None:
    assert read_tree("1: a\n1.0: b\ntrue: c\n~: d\n'': e", "f") == {
        "1": "a",
        "1.0": "b",
        "true": "c",
        "~": "d",
        "": "e",
    }


@pytest.mark.parametrize(
    ("text", "line"),
    rows_of(__file__, "a repeated key is refused"),
)
def test_a_repeated_key_is_refused(text: str, line: int) -> None:
    found, message = refusal(text)
    assert found == line
    assert "twice" in message


@pytest.mark.parametrize("text", ["? [1, 2]\n: 3", "? {a: 1}\n: 3", "{[1]: 2}", "{{a: 1}: 2}"])
def test_a_key_that_is_no_text_is_refused(text: str) -> None:
    assert "key" in refusal(text)[1]


# --- what is not safe


@pytest.mark.parametrize(
    ("text", "line", "word"),
    rows_of(__file__, "what goes beyond plain data is refused"),
)
def test_what_goes_beyond_plain_data_is_refused(text: str, line: int, word: str) -> None:
    found, message = refusal(text)
    assert found == line
    assert word in message


# --- bounds


def test_nesting_has_a_bound_that_counts_lists_and_mappings_alike() -> None:
    for opened, closed in (("[", "]"), ('{"a": ', "}"), ('[{"a": ', "}]")):
        unit = opened.count("[") + opened.count("{")
        most = DEEPEST_NESTING // unit
        read_tree(opened * most + "1" + closed * most, "f")
        assert "nested" in refusal(opened * (most + 1) + "1" + closed * (most + 1))[1]
    read_tree("- " * DEEPEST_NESTING + "1", "f")
    assert "nested" in refusal("- " * (DEEPEST_NESTING + 1) + "1")[1]


def test_text_has_a_bound_on_its_size() -> None:
    read_tree("a: 1\n#" + "x" * (MAX_BYTES - 6), "f")
    assert f"{MAX_BYTES:,}" in refusal("a: 1\n#" + "x" * (MAX_BYTES - 5))[1]


@pytest.mark.parametrize("mark", ["", "\ufeff"])
@pytest.mark.parametrize("letter", ["x", "é", "日"])
def test_a_file_beyond_the_bound_is_refused_whole(tmp_path: Path, letter: str, mark: str) -> None:
    """Never cut short and read as if it ended there: the last key would be lost without a word."""
    comment = letter * (MAX_BYTES // len(letter.encode()))
    path = tmp_path / "large.yaml"
    path.write_text(
        f"{mark}body: {{shape: cube, side: 1, mass: 1}}\n#{comment}\nunknown: 1\n", encoding="utf-8"
    )
    with pytest.raises(DocumentError) as caught:
        load(path)
    assert f"{MAX_BYTES:,}" in str(caught.value)


def bomb(levels: int) -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join(10 * [f'*a{k - 1}'])}]" for k in range(1, levels)]
    return "\n".join(lines)


@pytest.mark.parametrize(
    "text",
    [
        "[" * 50_000,
        "[" * 50_000 + "]" * 50_000,
        '{"a":' * 50_000,
        "- " * 500_000,
        "a:\n" + "".join(" " * k + "a:\n" for k in range(1, 1500)),
        bomb(10),
        "&" * 100_000,
        "!" * 100_000,
        "'" * 99_999,
        '"' + "\\" * 100_000,
        "a: |" + "\n" * 500_000 + "  b\n c",
        "{" + "a, " * 200_000,
        "- " + "-" * 1_000_000,
    ],
    ids=lambda text: text[:12].encode("unicode_escape").decode(),
)
def test_hostile_text_is_refused_or_read_in_no_time(text: str) -> None:
    start = time.process_time()
    with suppress(DocumentError):
        read_tree(text, "f")
    assert time.process_time() - start < 1.5


@pytest.mark.parametrize("text", ["!" * 100_000, "a: !" + "x" * 10_000, "a: 1\n? " + "a" * 10_000 + "\n? a"])
def test_a_refusal_is_short_however_long_the_text(text: str) -> None:
    assert len(refusal(text)[1]) < 500


# --- the raw text


@pytest.mark.parametrize("ends", ["\n", "\r\n", "\r"])
def test_line_ends_of_every_system_count(ends: str) -> None:
    assert read_tree(ends.join(["a: 1", "b:", "  - c", ""]), "f") == {"a": 1, "b": ["c"]}
    assert refusal(ends.join(["a: 1", "b: 2", "a: 3"]))[0] == 3


@pytest.mark.parametrize("character", ["\0", "\a", "\b", "\x1b", "\x7f", "\x9b", "\ufffe", "\uffff"])
def test_control_characters_are_refused_with_their_line(character: str) -> None:
    line, message = refusal(f"a: 1\nb: x{character}y\n")
    assert line == 2
    assert message.isprintable()


def test_a_lone_surrogate_is_refused() -> None:
    """It comes from bytes that are no text in a command line: `--set name=$'\\xff'`."""
    assert refusal("a: \udcff")[0] in (1, None)


def test_lines_of_all_values_are_found() -> None:
    lines: dict[Keys, int] = {}
    read_tree("a: 1\nb:\n  - x\n  - {c: 1,\n     d: 2}\n  -\n    e:\n      3\n", "f", lines=lines)
    assert lines == {
        ("a",): 1,
        ("b",): 2,
        ("b", 0): 3,
        ("b", 1): 4,
        ("b", 1, "c"): 4,
        ("b", 1, "d"): 5,
        ("b", 2): 7,
        ("b", 2, "e"): 7,
    }


# --- files that are no UTF-8 text


DOCUMENT = "body: {shape: cube, side: 1, mass: 1}"


@pytest.mark.parametrize(
    "data",
    [
        *(b"a: \xff\n", b"\x80", b"a: \xc3", b"\xed\xa0\x80", b"\xc0\x80"),
        *(DOCUMENT.encode(encoding) for encoding in ("utf-16-le", "utf-16-be", "utf-32")),
    ],
)
def test_what_is_no_utf_8_is_refused(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "f.yaml"
    path.write_bytes(data)
    with pytest.raises(DocumentError, match=r"UTF-8|not YAML"):
        load(path)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_byte_order_mark_tells_the_encoding(encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "f.yaml"
    path.write_bytes("name: ü\nbody: {shape: cube, side: 1, mass: 1}\n".encode(encoding))
    assert load(path).name == "ü"


# --- JSON is read by the same road


@pytest.mark.parametrize(
    ("text", "tree"),
    rows_of(__file__, "json"),
)
def test_json(text: str, tree: object) -> None:
    assert json.loads(text) == tree
    assert read_tree(text, "f") == tree


PLAIN = st.characters(max_codepoint=0xFFFF, exclude_categories=["Cs", "Cc", "Cn", "Co", "Zl", "Zp"])
TEXT = st.text(PLAIN.filter(lambda c: c != "\ufeff"), max_size=12)
NUMBER = st.integers(-(10**40), 10**40) | st.floats(allow_nan=False, allow_infinity=False)
TREE = st.recursive(
    TEXT | NUMBER | st.booleans() | st.none(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXT, inner, max_size=4),
    max_leaves=12,
)
BOUNDED = settings(derandomize=True, max_examples=100)


@BOUNDED
@given(TREE, st.sampled_from([None, 2, "\t"]), st.booleans())
def test_json_of_plain_data_is_read_as_that_data(tree: object, indent: int | str | None, plain: bool) -> None:
    assert read_tree(json.dumps(tree, indent=indent, ensure_ascii=plain), "f") == tree


def looks_like_a_number(text: str) -> bool:
    """PyYAML leaves bare what YAML 1.2 reads as a number and YAML 1.1 does not: `1e3`, `0o7`."""
    try:
        float(text)
    except ValueError:
        return text.startswith("0o")
    return True


def texts(tree: Any) -> list[str]:
    if isinstance(tree, dict):
        return [*tree, *(text for value in tree.values() for text in texts(value))]
    if isinstance(tree, list):
        return [text for value in tree for text in texts(value)]
    return [tree] if isinstance(tree, str) else []


@BOUNDED
@given(TREE, st.sampled_from([True, False, None]), st.sampled_from([20, 80, 1000]), st.booleans())
def test_yaml_of_plain_data_is_read_as_that_data(
    tree: object, flow: bool | None, width: int, unicode: bool
) -> None:
    assume(not any(looks_like_a_number(text) for text in texts(tree)))
    dumped = yaml.safe_dump(tree, default_flow_style=flow, width=width, allow_unicode=unicode)
    assert read_tree(dumped, "f") == tree


YAMLISH = st.text(st.sampled_from("ab01 \n\t:-,[]{}'\"#&*!|>%@`?~.<\\\0\x85\u2028\ufeff"), max_size=60)


@settings(BOUNDED, max_examples=300)
@given(st.text(max_size=80) | YAMLISH)
def test_any_text_is_read_or_refused(text: str) -> None:
    with suppress(DocumentError):
        read_tree(text, "f")
