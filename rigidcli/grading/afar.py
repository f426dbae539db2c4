"""Answer files that other machines judge, where they lie at the same paths; each in a process of its own.

What takes part in a cluster has threads and connections, and may itself have no children. So it starts a
process that does nothing but judge some files, and that one forks for each of them, as on this machine.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import TypeAlias

from rigidcli.errors import ComputationError
from rigidcli.grading.batch import Progress, judge_file, warm_up
from rigidcli.grading.files import names_in, read_file
from rigidcli.grading.judge import Item
from rigidcli.grading.judgement import from_bytes
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.workers import Result, each
from rigidcli.sandbox import Limits

AT_A_TIME = 64
"""Answer files of one task: they take about a second, and a process that begins to judge half of one."""

_BEGIN = f"from {__name__} import judge_given; judge_given()"
"""What the process does that judges a task."""


@dataclass(frozen=True, slots=True)
class Task:
    """Answer `files`, each with what is seen of it where the task is made, and the `items` to judge them by.

    Paths begin in `folder`, so that what is said of a file is the same wherever it is judged.
    """

    items: Mapping[str, Item]
    files: tuple[tuple[Path, bytes], ...]
    folder: str
    limits: Limits


Seen: TypeAlias = tuple[Result, bytes] | None
"""What comes of a file, and what is seen of those that its answers name; None where it is not seen itself."""

Spread: TypeAlias = Callable[[Callable[[Task], Iterable[Seen]], Iterable[Task]], Iterator[Seen]]
"""What has tasks worked out by others: all results of each, in the order of the tasks."""


def everywhere(
    spread: Spread,
    items: Mapping[str, Item],
    files: Sequence[Path],
    limits: Limits,
    progress: Progress,
) -> Iterator[Result]:
    """What comes of each file, in that order; `progress` is told the share that is done.

    Raises ComputationError where another machine sees other files.
    """
    tasks = (files[begin : begin + AT_A_TIME] for begin in range(0, len(files), AT_A_TIME))
    look, folder = _Look(), os.getcwd()  # noqa: PTH109 - a text goes to the other machine
    made = (Task(dict(items), tuple((file, look(file)) for file in some), folder, limits) for some in tasks)
    for done, (file, found) in enumerate(zip(files, spread(judged, made), strict=True), start=1):
        if found is None or found[1] != look.named(file, found[0]):
            raise ComputationError(
                f"a worker of the cluster sees other files where `{file}` is",
                hint="answers must lie at the same paths on all machines, as in a folder that they share",
            )
        progress(done / len(files))
        yield found[0]


def judged(task: Task) -> list[Seen]:
    """What comes of each file of a task, where that is worked out."""
    path = os.pathsep.join(filter(None, sys.path))
    done = subprocess.run(  # noqa: S603 - this Python, and a constant text
        [sys.executable, "-P", "-c", _BEGIN],
        input=pickle.dumps(task, pickle.HIGHEST_PROTOCOL),
        capture_output=True,
        env={**os.environ, "PYTHONPATH": path},
        check=False,
    )
    if done.returncode:
        told = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        raise ComputationError(f"a worker of the cluster cannot judge: {told or done.returncode}")
    results: list[Seen] = pickle.loads(done.stdout)  # noqa: S301 - from our own code
    return results


def judge_given() -> None:
    """Judge the task that stands on standard input, and write the results to standard output."""
    task: Task = pickle.load(sys.stdin.buffer)  # noqa: S301 - from `judged`
    with suppress(OSError):  # a folder that is not here has none of the files
        os.chdir(task.folder)
    look = _Look()
    files = [file for file, seen in task.files if look(file) == seen]
    warm_up(task.items)
    found = each(partial(judge_file, task.items), files, 1, task.limits, lambda fraction: None)
    by_file = dict(zip(files, found, strict=True))
    results = [
        (by_file[file], look.named(file, by_file[file])) if file in by_file else None
        for file, _ in task.files
    ]
    sys.stdout.buffer.write(pickle.dumps(results, pickle.HIGHEST_PROTOCOL))


class _Look:
    """What a machine sees of answer files: digests of the text, and of the names in the folder.

    These decide whose file it is that an answer names. Each folder is read once.
    """

    def __init__(self) -> None:
        self._folders: dict[Path, bytes] = {}

    def __call__(self, file: Path) -> bytes:
        """What is seen of an answer file before it is judged."""
        if file.parent not in self._folders:
            names = "/".join(sorted(names_in(file.parent)))
            self._folders[file.parent] = sha256(os.fsencode(names)).digest()
        return self._folders[file.parent] + _digest(file)

    def named(self, file: Path, result: Result) -> bytes:
        """What is seen of the files that its answers name, as the result tells."""
        names = from_bytes(result).files if isinstance(result, bytes) else ()
        return b"".join(_digest(file.parent / name) for name in names)


def _digest(file: Path) -> bytes:
    try:
        text = read_file(file)
    except Unreadable as unreadable:
        text = unreadable.finding.code
    return sha256(text.encode()).digest()
