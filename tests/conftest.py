"""What tests of all parts share: the program, run in this process, and figures as they are printed."""

from __future__ import annotations

import gc
import io
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

# Matrices here are small: a second thread only waits for the first. numpy reads this when it loads.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import pytest
from hypothesis import settings

from rigidcli.__main__ import THRESHOLDS, main

ROOT = Path(__file__).parent.parent

# The gate tries the same examples every time, and times none. To search for others:
# `--hypothesis-profile search`.
settings.register_profile("gate", derandomize=True, deadline=None, max_examples=60)
settings.register_profile("search", derandomize=False, deadline=None)
settings.load_profile("gate")


# Garbage is collected as the program does it: what a test measures is the program.
gc.set_threshold(*THRESHOLDS)


def pytest_collection_finish() -> None:
    """Keep the tests themselves, 400,000 objects, out of collections: each would take 0.3 s."""
    gc.freeze()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """A file is worked by one process as far as can be, so that what its tests share is made once."""
    from xdist.scheduler import WorkStealingScheduling

    return WorkStealingScheduling(config, log)


def printed(figure: str) -> Any:
    """What rounds to the figure, in the digits it is printed in."""
    exponent = Decimal(figure).as_tuple().exponent
    assert isinstance(exponent, int)
    return pytest.approx(float(figure), rel=0, abs=0.5 * 10.0**exponent)


@dataclass(frozen=True)
class Outcome:
    """How a run of the program ended."""

    code: int
    out: str
    err: str


Program = Callable[..., Outcome]


@pytest.fixture
def program(monkeypatch: pytest.MonkeyPatch) -> Program:
    """Runs `rigidcli ARGUMENTS` in the project's folder, with `stdin` to read from, so many columns wide."""
    monkeypatch.chdir(ROOT)

    def run(*arguments: str, stdin: str = "", columns: int = 80) -> Outcome:
        monkeypatch.setenv("COLUMNS", str(columns))
        out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2))
        monkeypatch.setattr(sys, "argv", ["rigidcli", *arguments])
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin.encode())))
        monkeypatch.setattr(sys, "stdout", out)
        monkeypatch.setattr(sys, "stderr", err)
        with pytest.raises(SystemExit) as ended:
            main()
        monkeypatch.undo()
        monkeypatch.chdir(ROOT)
        texts = []
        for stream in (out, err):
            stream.flush()
            texts.append(stream.buffer.getvalue().decode())
        return Outcome(int(ended.value.code or 0), *texts)

    return run
