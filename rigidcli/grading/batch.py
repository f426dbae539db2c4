"""Many answer files, each judged in a process of its own: one bad file is one bad row, and harms no other."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import TypeAlias

from rigidcli.grading.files import read_file, safe_name
from rigidcli.grading.judge import Item, judge, same_for_all
from rigidcli.grading.judgement import Judgement, from_bytes, to_bytes
from rigidcli.grading.outcome import Outcome, Unreadable
from rigidcli.grading.roster import Paper
from rigidcli.grading.workers import Ended, each, usable_cores
from rigidcli.sandbox import LIMITS, Limits

Progress: TypeAlias = Callable[[float], None]
"""What is told the share that is done."""


def run(
    items: Mapping[str, Item],
    papers: Sequence[Paper],
    jobs: int | None = None,
    progress: Progress = lambda fraction: None,
    limits: Limits = LIMITS,
) -> Iterator[Judgement]:
    """Judge what was handed in, in that order, whatever is done first; `jobs` at a time, or as many as pay.

    `progress` is told the share that is done. Raises ComputationError where no process can be started.
    """
    files = [paper.file for paper in papers if paper.file is not None and paper.outcome is None]
    warm_up(items)
    results = each(partial(judge_file, dict(items)), files, jobs or usable_cores(), limits, progress)
    for paper in papers:
        result = paper.outcome or next(results)
        if isinstance(result, Ended):
            result = Unreadable(result.code, result.detail).outcome
        sheet = same_for_all(items, result) if isinstance(result, Outcome) else from_bytes(result)
        source = "" if paper.file is None else safe_name(os.fspath(paper.file))
        yield Judgement(safe_name(paper.student), source, sheet.questions, sheet.notes, sheet.files)


def judge_file(items: Mapping[str, Item], path: Path) -> bytes:
    """An answer file, judged; it runs in a process of its own."""
    try:
        sheet = judge(read_file(path), path, items)
    except Unreadable as unreadable:
        sheet = same_for_all(items, unreadable.outcome)
    return to_bytes(sheet)


RIGHT, WRONG = 2, 1
"""Answers to a question that are judged beforehand."""


def warm_up(items: Mapping[str, Item]) -> None:
    """Judge some answers to each question: what is loaded or worked out then is there in each fork."""
    for item in items.values():
        # What is wrong with a key is told by its own test.
        with contextlib.suppress(Exception):
            item.kind.prepare(item.key)
            right = (form for _, form in islice(item.kind.right_forms(item.key), RIGHT))
            wrong = (example.answer for example in islice(item.kind.wrong_forms(item.key), WRONG))
            for answer in chain(right, wrong):
                item.kind.judge(item.key, item.kind.read_answer(item.key, answer, Path()))
