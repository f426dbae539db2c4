"""Expressions at random points: always the same ones, so that a verdict does not change from run to run."""

from __future__ import annotations

import math
import random
from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.trees import plain_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE
from rigidcli.language import code

LOW, HIGH = 0.3, 1.7
"""Random values lie between these: near 1, and positive as masses and lengths are."""

TRIES = 40
"""Most random points that are tried, as expressions may have no value at some."""


def points(
    names: Sequence[str], fixed: Mapping[str, float], seed: int = 1, signed: Collection[str] = ()
) -> Iterator[dict[str, float]]:
    """Random values for the names that are not `fixed`, again and again: positive, but of `signed` names."""
    chance = random.Random(seed)  # noqa: S311 - a probe needs no secrecy
    for _ in range(TRIES):
        point = {name: chance.uniform(LOW, HIGH) for name in names}
        for name in signed:
            if name in point:
                point[name] *= chance.choice((1, -1))
        yield point | dict(fixed)


def values(
    expressions: Sequence[Expr],
    fixed: Mapping[str, float],
    count: int = 3,
    seed: int = 1,
    signed: Collection[str] = (),
) -> Floats | None:
    """The values of the expressions at some points (count by n); None if there are not so many with values.

    Names have their `fixed` values, others random ones: positive, but for those of `signed` names.
    """
    names = sorted(set().union(*(e.names for e in expressions)) | set(fixed))
    f = code.function([plain_tree(e) for e in expressions], names, {})(math)
    rows = []
    for point in points(names, fixed, seed, signed):
        try:
            row = f(*(point[name] for name in names))
        except NO_VALUE:
            continue
        if all(map(math.isfinite, row)):
            rows.append(row)
        if len(rows) == count:
            return np.array(rows, dtype=np.float64).reshape(count, len(expressions))
    return None
