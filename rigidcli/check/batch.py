"""Many hand-ins, judged by processes that are confined: one bad file is one bad row, and harms no other."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeAlias

from rigidcli.check.base import Outcome, Unreadable
from rigidcli.check.files import read_file, safe_name
from rigidcli.check.judge import Item, Seen, judge, same_for_all
from rigidcli.check.records import Judgement
from rigidcli.check.roster import Paper
from rigidcli.check.workers import Ended, each
from rigidcli.sandbox import LIMITS, Limits, usable_cores

Progress: TypeAlias = Callable[[float], None]
"""It is called with the share that is done."""


def run(
    items: Mapping[str, Item],
    papers: Sequence[Paper],
    jobs: int | None = None,
    progress: Progress = lambda share: None,
    limits: Limits = LIMITS,
) -> Iterator[Judgement]:
    """Judge what was handed in, in that order, whatever is done first; `jobs` at a time, or one a core.

    Raises ComputationError where no process can be started.
    """
    files = [paper.file for paper in papers if paper.file is not None and paper.outcome is None]
    _warm_up(items)
    results = each(partial(judge_file, dict(items), {}), files, jobs or usable_cores(), limits, progress)
    for paper in papers:
        result = paper.outcome or next(results)
        if isinstance(result, Ended):
            result = Unreadable(result.code, result.detail).outcome
        found = same_for_all(items, result) if isinstance(result, Outcome) else Judgement.from_bytes(result)
        yield replace(found, student=safe_name(paper.student), source=paper.source)


def judge_file(items: Mapping[str, Item], seen: Seen, path: Path) -> bytes:
    """The judgement of the answer file at `path`, whose student is known elsewhere."""
    try:
        return judge(read_file(path), path, items, seen).to_bytes()
    except Unreadable as unreadable:
        return same_for_all(items, unreadable.outcome).to_bytes()


def _warm_up(items: Mapping[str, Item]) -> None:
    """Judge the keys: what is loaded and worked out for that, forks need not load and work out again."""
    for item in items.values():
        with contextlib.suppress(Exception):  # what is wrong with a key, its own test says
            item.kind.judge(item.key, item.kind.read(item.key, item.kind.typed(item.key)).value)
