"""Points of a sweep that are worked at once: their numbers pass through the formulas as arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from rigidcli.errors import RigidError
from rigidcli.report import Field, Report, part

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rigidcli.model.document import Document
    from rigidcli.model.load import Draft
    from rigidcli.model.sweeps import Sweep

STUDIES = ("precess", "inertia", "axes")
"""The studies whose formulas take arrays for numbers."""

AT_ONCE = 4096
"""Points that are worked at once: their arrays stay in the cache of a processor."""

TRIED = 16
"""Points of a sweep at which it is tried, before it begins, whether values go together."""

SPREAD = (5**0.5 - 1) / 2
"""Multiples of this, but for their whole parts, lie evenly between 0 and 1, and in step with no key."""


def go_together(draft: Draft, sweep: Sweep, study: str, run: Callable[[Document], Report]) -> bool:
    """Whether formulas take the values of several points at once, as far as some that lie apart tell."""
    count = sweep.count
    if study not in STUDIES or count <= TRIED or draft.is_exact(sweep.settings(sweep.point(0))):
        return False
    places = sorted({int(count * (k * SPREAD % 1)) for k in range(TRIED)})
    return any(report is not None for _, report in _groups(draft, sweep, places, run, 1))


def together(
    draft: Draft, sweep: Sweep, places: Sequence[int], run: Callable[[Document], Report]
) -> Iterator[tuple[Sequence[int], Report | None]]:
    """Some `places` of a sweep after the others, in their order, each time with one report on all of them.

    It is None where points are to be worked one by one, as those whose values are refused.
    """
    import numpy as np

    from rigidcli.core.groups import FEW

    groups = list(_groups(draft, sweep, places, run, FEW))
    owner, rank = np.empty(len(places), dtype=int), np.empty(len(places), dtype=int)
    for index, (group, report) in enumerate(groups):
        owner[group] = -1 if report is None else index
        rank[group] = np.arange(len(group))
    ends = [*(np.flatnonzero(np.diff(owner)) + 1).tolist(), len(places)]
    begin = 0
    for end in ends:
        found = None if owner[begin] < 0 else groups[owner[begin]][1]
        first = int(rank[begin])
        yield places[begin:end], found and part(found, slice(first, first + end - begin))
        begin = end


def _groups(
    draft: Draft, sweep: Sweep, places: Sequence[int], run: Callable[[Document], Report], least: int
) -> Iterator[tuple[NDArray[np.int_], Report | None]]:
    """Groups of at least so many of the `places`, by their numbers in these, each with a report on it.

    It is None for those to be worked one by one.
    """
    import numpy as np

    from rigidcli.core.groups import UnfitError, grouped

    every = np.arange(len(places))
    try:
        values = sweep.together(places)
    except RigidError:
        yield every, None
        return

    def work(group: NDArray[np.int_]) -> Report:
        several = [each.take(group) for each in values]
        told = [(each.key, *each.results()) for each in several]
        try:
            document = draft.documents(sweep.settings(sweep.point(places[int(group[0])])), several)
            with np.errstate(all="ignore"):
                report = run(document)
        except RigidError as error:
            raise UnfitError from error
        units = {entry.key: entry.unit for entry in report.fields}
        swept = [
            Field(name, many, unit=unit or units.get(name, ""), cells={name: ()}) for name, many, unit in told
        ]
        return replace(report, swept=tuple(swept))

    yield from grouped(every, work, least)
