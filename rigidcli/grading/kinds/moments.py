"""Principal moments, and other numbers whose order may be free: each stands as often as it occurs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from rigidcli.core.arithmetic import Array
from rigidcli.errors import ValueProblem
from rigidcli.grading.arrays.entries import times, worked
from rigidcli.grading.arrays.keys import computed
from rigidcli.grading.arrays.reference import Reference, Symmetry, Typed, told
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds.arrays import Arrays, Findings
from rigidcli.grading.kinds.base import Example
from rigidcli.grading.matching import assigned
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, wrong
from rigidcli.grading.tensors import impossible, mistaken_tensors, moments_of

ANY_ORDER: Symmetry = frozenset({"order"})

MOST = 100
"""Moments in one list."""

ELSEWHERE = 8
"""How many times other points are tried to see that symbols do not change the order of the moments."""


class Moments(Arrays):
    """Numbers of which each stands as often as it occurs, in any order or in ascending order."""

    name: ClassVar[str] = "moments"
    options: ClassVar[frozenset[str]] = Arrays.options | {"order"}
    word: ClassVar[str] = "moment"

    def read_key(self, asked: Asked) -> Reference:
        """The key of a question for moments, ascending. Raises ValueProblem."""
        found = super().read_key(asked)
        if len(found.shape) != 1 or not 0 < found.shape[0] <= MOST:
            raise ValueProblem("this is not a list of moments")
        order = _order(found)[0]
        ordered = asked.question.order == "ascending"
        others = (replace(asked, name=f"{asked.name} {k}") for k in range(ELSEWHERE))
        if ordered and any((_order(super(Moments, self).read_key(o)) != order).any() for o in others):
            raise ValueProblem("the order of the moments depends on the symbols", path=("order",))
        tensor = None if asked.report is None or asked.path[-1] != "moments" else asked.report.get("tensor")
        tensors = (
            iter(())
            if tensor is None
            else mistaken_tensors(asked, worked(computed(tensor), found.points), found)
        )
        causes = ((code, np.array(list(map(moments_of, each)))) for code, each in tensors)
        return replace(
            found.arranged(lambda array: array[:, order]),
            symmetry=frozenset() if ordered else ANY_ORDER,
            mistaken=tuple(causes),
        )

    def read_answer(self, key: Reference, answer: Tree, folder: Path) -> Typed:
        """An answer, worked out. Raises Unreadable."""
        typed = super().read_answer(key, answer, folder)
        if len(typed.shape) != 1 or typed.shape[0] > MOST:
            raise Unreadable("wrong_shape", f"expected at most {MOST} numbers")
        return typed

    def judge(self, key: Reference, answer: Typed) -> Outcome:
        """The outcome of a list of moments: first how often each stands, and their order."""
        fits = key.fits(answer)
        columns = assigned(fits)
        rows = np.flatnonzero(columns >= 0)
        columns = columns[rows]
        right = fits[rows, columns]
        if fits.any(axis=0).all() and fits.any(axis=1).all() and right.sum() < max(fits.shape):
            share = right.sum() / max(fits.shape) if key.nonzero[columns[right]].any() else 0.0
            return wrong(Finding("multiplicity", reference=told(key)), share=float(share))
        if right.all() and answer.shape == key.shape and not self.is_right(key, answer):
            share = self.share(key, key.agree(answer))
            return wrong(Finding("wrong_order", reference=told(key)), share=share)
        return super().judge(key, answer)

    def findings(self, key: Reference, answer: Typed, facing: Reference, share: float) -> Findings:
        """What is said of wrong moments; what is rounded away may cost a triangle its inequality."""
        found = self.explained(key, answer)
        if not found or found[0].code in ("sign_error", "constant_factor"):
            code = impossible(answer.values[0], key) if key.shape == (3,) and not key.names else None
            found = found if code is None else (Finding(code),)
        return found or self.wrong_entries(answer, facing, share)

    def right_forms(self, key: Reference) -> Iterator[tuple[str, Tree]]:
        """The moments in several forms, and the other way round."""
        for what, form in super().right_forms(key):
            yield what, form
            if key.symmetry and isinstance(form, list):
                yield f"{what}, the other way round", form[::-1]

    def wrong_forms(self, key: Reference) -> Iterator[Example]:
        """The moments in another order, without an equal one, and such as no body has."""
        yield from super().wrong_forms(key)
        entries, last = times(key.entries, key.numbers), np.eye(key.shape[0])[-1]
        forms = [
            ("the other way round", entries[::-1], "wrong_order"),
            ("the last moment left out", entries[:-1], "multiplicity"),
            ("the first moment left out", entries[1:], "multiplicity"),
            ("the first moment negative", times(entries, 1 - 2 * last[::-1]), "not_physical"),
            ("the last moment too large", times(entries, 1 + 3 * last), "triangle_inequality"),
        ]
        for what, entries, code in forms:
            yield from self.example(key, what, entries, code)


def _order(key: Reference) -> Array:
    """The places of the moments (k, n) in ascending order at each point."""
    return np.argsort(key.values, axis=1, kind="stable")
