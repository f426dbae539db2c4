"""Many answer files, each judged in a process of its own: one bad file is one bad row, and harms no other."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import islice
from pathlib import Path

from rigidcli.errors import Problem, printable
from rigidcli.grading.files import SUFFIXES, read_file
from rigidcli.grading.judge import MISSING, Item, judge
from rigidcli.grading.judgement import Judgement, Sheet, from_bytes, same_for_all, to_bytes
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.sandbox import LIMITS, Limits
from rigidcli.grading.workers import Ended, each, usable_cores


def gather(
    paths: Sequence[str | os.PathLike[str]], assignment: str | os.PathLike[str] | None = None
) -> tuple[list[Path], list[Problem]]:
    """The answer files that are meant by files and folders, each once; and what is not there.

    Of a folder, those directly in it, by name; hidden ones, and the `assignment`, are left out. Whatever has
    the name of an answer file is one, and is judged as one: folders and pipes, too, and links, which are
    not followed.
    """
    files: dict[Path, None] = {}
    problems = []
    own = None if assignment is None else Path(assignment).absolute()
    for given in paths:
        path = Path(given)
        try:
            if not os.fspath(given):
                raise ValueError
            found = [path]
            if path.is_dir() and not _is_answer(path.name):
                found = [file for file in sorted(path.iterdir()) if _is_answer_file(file)]
                found = [file for file in found if file.absolute() != own]
                if not found:
                    endings = ", ".join(sorted(SUFFIXES))
                    problems.append(_problem(path, f"no answer files: their names end in {endings}"))
            else:
                path.lstat()
            files.update(dict.fromkeys(found))
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or "no file has such a name"
            problems.append(_problem(path, f"cannot be read: {reason}"))
    return list(files), problems


def _problem(path: Path, message: str) -> Problem:
    return Problem(_name(os.fspath(path)), message)


def _is_answer(name: str) -> bool:
    return Path(name).suffix.lower() in SUFFIXES


def _is_answer_file(path: Path) -> bool:
    return _is_answer(path.name) and not path.name.startswith(".")


def _name(name: str) -> str:
    """A name of a file, which may hold anything, as a text that is safe to print."""
    return printable(os.fsencode(name).decode(errors="backslashreplace"))


def run(
    items: Mapping[str, Item],
    files: Sequence[Path],
    jobs: int | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
    limits: Limits = LIMITS,
) -> Iterator[Judgement]:
    """Judge answer files, in their order, whatever is done first; `jobs` at a time, or as many as pay.

    `progress` is told the share that is done. Raises ComputationError where no process can be started.
    """
    _warm_up(items)
    work = partial(judge_file, dict(items))
    results = each(work, files, jobs or usable_cores(), limits, progress)
    for file, result in zip(files, results, strict=True):
        sheet = _ended(items, result) if isinstance(result, Ended) else from_bytes(result)
        yield Judgement(_name(file.stem), _name(os.fspath(file)), sheet.questions, sheet.notes)


def nothing(items: Mapping[str, Item], source: str) -> Judgement:
    """The judgement of a student of whom there is no answer file at `source`: every question is missing."""
    sheet = same_for_all({id: item.points for id, item in items.items()}, MISSING)
    return Judgement(_name(Path(source).stem), _name(source), sheet.questions)


def judge_file(items: Mapping[str, Item], path: Path) -> bytes:
    """An answer file, judged; it runs in a process of its own."""
    try:
        sheet = judge(read_file(path), _name(os.fspath(path)), path.parent, items)
    except Unreadable as unreadable:
        sheet = _refused(items, unreadable)
    return to_bytes(sheet)


def _ended(items: Mapping[str, Item], ended: Ended) -> Sheet:
    return _refused(items, Unreadable(ended.code, ended.detail))


def _refused(items: Mapping[str, Item], unreadable: Unreadable) -> Sheet:
    return same_for_all({id: item.points for id, item in items.items()}, unreadable.outcome)


EXAMPLES = 2
"""Answers to a question that are judged beforehand."""


def _warm_up(items: Mapping[str, Item]) -> None:
    """Judge an answer or two to each question, so that what loads then does so once, not in each fork."""
    for item in items.values():
        # What is wrong with a key is told by its own test.
        with contextlib.suppress(Exception):
            for example in islice(item.kind.examples(item.key), EXAMPLES):
                item.kind.judge(item.key, item.kind.read_answer(item.key, example.answer, Path()))
