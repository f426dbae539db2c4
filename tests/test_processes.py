"""`each`: the same results for any number of processes, also when one of them ends early."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from rigidcli.document.document import Document
from rigidcli.processes import each
from rigidcli.report import Report
from rigidcli.studies import axes
from tests.conftest import Program

NUMBERS = range(100)


def lost(task: Any) -> int:
    return -1


def squares(number: int) -> Iterator[int]:
    """A result, or two for a number that ends in 7, or none for one that ends in 3."""
    last = number % 10
    yield from [number**2] * (2 if last == 7 else 0 if last == 3 else 1)


def deadly(number: int) -> Iterator[int]:
    if number == 42:
        os.kill(os.getpid(), signal.SIGKILL)
    yield number


def deadly_once(task: tuple[int, Path]) -> Iterator[int]:
    number, mark = task
    if number == 42 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    yield number


def broken(number: int) -> Iterator[int]:
    yield 1 // (50 - number)


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_results_come_in_the_order_of_the_tasks(jobs: int) -> None:
    assert list(each(squares, NUMBERS, jobs, lost)) == [
        result for task in NUMBERS for result in squares(task)
    ]


def test_a_task_that_ends_processes_is_lost_alone() -> None:
    found = list(each(deadly, NUMBERS, 2, lost))
    assert found == [-1 if number == 42 else number for number in NUMBERS]


def test_a_process_that_ends_once_loses_nothing(tmp_path: Path) -> None:
    tasks = [(number, tmp_path / "mark") for number in NUMBERS]
    assert list(each(deadly_once, tasks, 2, lost)) == list(NUMBERS)


def test_tasks_are_taken_when_there_is_room_for_them() -> None:
    taken = []

    def endless() -> Iterator[int]:
        number = 0
        while True:
            taken.append(number)
            yield number
            number += 1

    results = each(squares, endless(), 2, lost)
    assert next(results) == 0
    results.close()  # type: ignore[attr-defined]  # it is a generator
    assert len(taken) < 10_000


@dataclass
class Caller:
    """A task that knows the thread by which it was pickled."""

    pickled_by: int = 0

    def __reduce__(self) -> tuple[type[Caller], tuple[int]]:
        return Caller, (threading.get_ident(),)


def caller(task: Caller) -> Iterator[int]:
    yield task.pickled_by


def test_tasks_are_pickled_before_the_caller_goes_on() -> None:
    """Another thread would pickle what the caller changes, as when it keeps a property: that is an error."""
    assert set(each(caller, [Caller()] * 9, 2, lost)) == {threading.get_ident()}


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_of_the_work_is_that_of_the_call(jobs: int) -> None:
    with pytest.raises(ZeroDivisionError):
        list(each(broken, NUMBERS, jobs, lost))


def test_a_document_that_ends_its_process_is_a_failure_and_the_others_stay(
    program: Program, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    run = axes.run

    def deadly(document: Document, **options: Any) -> Report:
        if document.name == "bad":
            os.kill(os.getpid(), signal.SIGKILL)
        return run(document, **options)

    files = []
    for name in ("a", "b", "bad", "c", "d"):
        files.append(str(tmp_path / f"{name}.yaml"))
        Path(files[-1]).write_text(f"name: {name}\nbody: {{shape: cube, side: 1, mass: 1}}")
    monkeypatch.setattr(axes, "run", deadly)
    outcome = program("axes", "-f", "csv", "--columns", "name,mass", "-j", "2", *files)
    assert (outcome.code, outcome.out) == (4, "name,mass\na,1.0\nb,1.0\nc,1.0\nd,1.0\n")
    assert outcome.err.startswith(f"{files[2]}: its process was killed twice, probably for memory\n  hint: ")
