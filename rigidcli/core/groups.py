"""Runs of the same formulas that are worked together, as long as they take the same way.

Each branch is taken by all runs or by none. Where they part, a `PartedError` says which of them go together,
and `grouped` begins anew with each of these.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

ALONE = -1
"""The label of a run that has to be worked by itself."""

FEW = 8
"""Groups of fewer runs are worked one by one, which takes no longer."""

_Found = TypeVar("_Found")


class UnfitError(Exception):
    """Something that takes one float, and cannot be done with many at once."""


class PartedError(Exception):
    """The runs take different ways: those with the same of the `labels` (n) go together, ALONE ones alone."""

    def __init__(self, labels: NDArray[np.int_]) -> None:
        super().__init__("runs take different ways")
        self.labels = labels


def agreed(yes: Any, certain: Any = True) -> bool:
    """The truth value that all runs have in common (each n).

    Raises PartedError where they have none, and where some are not `certain`.
    """
    labels = np.where(certain, yes, ALONE)
    return bool(common(labels))


def common(labels: Any) -> int:
    """The label that all runs have in common. Raises PartedError where there is none."""
    first = int(labels.flat[0])
    if first == ALONE or (labels != first).any():
        raise PartedError(labels)
    return first


def grouped(
    runs: NDArray[np.int_], work: Callable[[NDArray[np.int_]], _Found], least: int = FEW
) -> Iterator[tuple[NDArray[np.int_], _Found | None]]:
    """What `work` finds for groups of the `runs` (n), each run in one group; None for those to work alone.

    These are also groups of less than the `least` number.
    Errors of `work`, other than PartedError, are for those runs to tell that have them.
    """
    if len(runs) < least:
        yield runs, None
        return
    try:
        yield runs, work(runs)
    except PartedError as parted:
        for label in np.unique(parted.labels).tolist():
            group = runs[parted.labels == label]
            if label == ALONE:
                yield group, None
            else:
                yield from grouped(group, work, least)
    except (UnfitError, ArithmeticError, TypeError, ValueError, LookupError):
        # What is made for one number may fail in any way with many; if it fails with one, that run tells.
        yield runs, None
