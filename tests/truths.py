"""Tables of truths: documents, the command, and what stands under paths of its JSON."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
import yaml

from rigidcli.language.expression import real
from rigidcli.language.parser import read
from tests.conftest import Program, printed

UNITS = {"deg": math.pi / 180, "rpm": math.pi / 30, "ms": 1e-3, "d": 86400.0}
"""Units in SI units that paths may end with, such as `top.theta_max [deg]`."""


def truths(path: Path) -> list[Any]:
    """The cases of a table by their names, for `parametrize`."""
    cases = yaml.safe_load(path.read_text(encoding="utf-8"))
    return [pytest.param(case, id=name) for name, case in cases.items()]


def at(result: Any, path: str) -> Any:
    """What stands under a path of keys and indices."""
    keys, _, unit = path.partition(" [")
    for key in keys.split("."):
        result = result[int(key) if isinstance(result, list) else key]
    return result / UNITS[unit.rstrip("]")] if unit else result


def expected(value: Any, names: dict[str, float], within: float) -> Any:
    """A value of a table.

    `= pi/2` is worked out, `~ 3.14` is a figure as it is printed, and a text alone is a text.
    """
    if isinstance(value, str):
        if value.startswith("~"):
            return printed(value[1:].strip())
        return expected(real(read(value[1:])[0], names), names, within) if value.startswith("=") else value
    if isinstance(value, bool) or value is None:
        return value
    if isinstance(value, list):
        return [expected(entry, names, within) for entry in value]
    return pytest.approx(value, rel=within, abs=within * abs(value) or 1e-14)


def require(case: dict[str, Any], program: Program) -> None:
    """The document of a case, or the files that its command names, come to what is given.

    Each of the `notes` is told; where these are `[]`, none is.
    """
    source = ["-"] if "document" in case else []
    outcome = program(*case["run"].split(), "-f", "json", *source, stdin=case.get("document", ""))
    assert outcome.code == 0, outcome.err
    found, names = json.loads(outcome.out), dict[str, float]()
    for name, text in case.get("where", {}).items():
        names[name] = real(read(str(text))[0], names)
    for path, value in case["gives"].items():
        assert at(found, path) == expected(value, names, case.get("within", 1e-12)), path
    for words in case.get("notes", []):
        assert words in outcome.err
    assert case.get("notes") != [] or not outcome.err
