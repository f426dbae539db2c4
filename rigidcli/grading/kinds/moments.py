"""Principal moments, and other numbers whose order may be free: each stands as often as it occurs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.arrays.entries import Cell, filled, worked
from rigidcli.grading.arrays.keys import computed, reference
from rigidcli.grading.arrays.mistakes import (
    Explanation,
    as_typed,
    constant_factor,
    forms,
    listed,
    one_of,
    places_in,
    power_of_ten,
    times,
    told,
    wrong_entries,
    wrong_forms,
)
from rigidcli.grading.arrays.reference import Reference, Typed, exactly
from rigidcli.grading.arrays.tensors import impossible, mistaken_tensors, moments_of
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds.base import Example
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong

MOST = 100
"""Moments in one list."""


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The moments, ascending where they are `ordered`, and what they would be under named mistakes.

    `in_order` says whether they must stand in their order.
    """

    reference: Reference
    in_order: bool
    causes: tuple[tuple[str, Floats], ...]


def read_key(asked: Asked) -> Key:
    """The key of a question for moments. Raises ValueProblem."""
    found = reference(asked, _listed)
    if len(found.shape) != 1 or not 0 < found.shape[0] <= MOST:
        raise ValueProblem("this is not a list of moments")
    order = np.argsort(found.values, axis=1, kind="stable")
    in_order = asked.question.order == "ascending"
    if in_order and (order != order[0]).any():
        raise ValueProblem("the order of the moments depends on the symbols", path=("order",))
    found = replace(found, entries=found.entries[order[0]], values=found.values[:, order[0]])
    causes = ((code, np.array(list(map(moments_of, each)))) for code, each in _mistaken_tensors(asked, found))
    key = Key(found, in_order, ())
    return replace(key, causes=tuple(each for each in causes if not _is_right(key, exactly(each[1]))))


def _mistaken_tensors(asked: Asked, key: Reference) -> Iterator[tuple[str, Floats]]:
    """Codes with the tensors (k by 3 by 3) of which the moments are taken under them."""
    if asked.report is None or asked.path[-1] != "moments" or asked.report.get("tensor") is None:
        return
    tensor = worked(computed(asked.report["tensor"]), key.points)
    yield from mistaken_tensors(asked, tensor, key)


def _listed(answer: Tree) -> Array:
    """The cells of a list."""
    if not isinstance(answer, list) or not 0 < len(answer) <= MOST:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list of moments")
    return filled([Cell(entry, _place(k)) for k, entry in enumerate(answer)], (len(answer),))


def _place(index: int) -> str:
    return f"moment {index + 1}"


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of a list of moments. Raises Unreadable."""
    ours = key.reference
    typed = ours.read(answer, _listed)
    fits = _fits(ours, typed, ours.values)
    count, expected = fits.shape
    pairs = matched(fits)
    share = _share(ours, pairs, max(count, expected))
    if count != expected or len(pairs) < expected:
        if fits.any(axis=0).all() and fits.any(axis=1).all():
            return wrong(Finding("multiplicity", reference=told(ours)), share=share)
        if count != expected:
            raise Unreadable("wrong_shape", f"read {count} moments, expected {expected}")
    elif key.in_order and not np.diag(fits).all():
        share = _share(ours, {k: k for k in np.flatnonzero(np.diag(fits)).tolist()}, expected)
        return wrong(Finding("wrong_order", reference=told(ours)), share=share)
    else:
        return correct()
    return wrong(*_findings(key, typed, fits, share), share=share)


def _fits(key: Reference, answer: Typed, values: Floats) -> Mask:
    """Which moments of the answer (rows) are which of these (k by n; columns)."""
    table, own = _table(answer, values)
    return key.agree(table, own)


def _table(answer: Typed, values: Floats) -> tuple[Typed, Floats]:
    """Every moment of the answer (rows) against each of these (k by n; columns)."""
    size = (*answer.values.shape, values.shape[1])
    own = np.broadcast_to(values[:, np.newaxis], size)
    return answer.each(lambda array: np.broadcast_to(array[:, :, np.newaxis], size)), own


def matched(fits: Mask) -> dict[int, int]:
    """As many pairs (row: column) that fit as there can be, each row and column in one: Kuhn's algorithm."""
    row_of: dict[int, int] = {}

    def settle(row: int, tried: set[int]) -> bool:
        for column in np.flatnonzero(fits[row]).tolist():
            if column not in tried:
                tried.add(column)
                if column not in row_of or settle(row_of[column], tried):
                    row_of[column] = row
                    return True
        return False

    for row in range(len(fits)):
        settle(row, set())
    return {row: column for column, row in row_of.items()}


def _share(key: Reference, pairs: dict[int, int], count: int) -> float:
    """The share of moments that are right; nothing where only zeros are."""
    return len(pairs) / count if key.nonzero[list(pairs.values())].any() else 0.0


def _is_right(key: Key, answer: Typed) -> bool:
    return _is(key.reference, answer, key.reference.values)


def _is(key: Reference, answer: Typed, values: Floats) -> bool:
    """Whether the answer is these moments (k by n), in any order."""
    return len(matched(_fits(key, answer, values))) == len(values[0])


# --- what is said


def _findings(key: Key, answer: Typed, fits: Mask, share: float) -> Sequence[Finding]:
    ours, right = key.reference, np.isin(np.arange(len(fits)), list(matched(fits)))
    short = _too_few_digits(key, answer, fits, right)
    # What is rounded away may cost a triangle its inequality.
    laws = () if short[1] else _impossible(ours, answer)
    found = one_of(_causes(key, answer), laws, [short, *_descriptions(ours, answer)])
    if found is not None:
        return (replace(found, reference=told(ours)),)
    return wrong_entries(ours, answer, right, _place, share)


def _impossible(key: Reference, answer: Typed) -> Iterator[Explanation]:
    """That no body has such moments; of moments that depend on symbols nothing is said."""
    code = impossible(answer.values[0], key) if key.shape == (3,) and not key.names else None
    if code is not None:
        yield Finding(code), True


def _causes(key: Key, answer: Typed) -> Iterator[Explanation]:
    ours = key.reference
    yield from ((Finding(code), _is(ours, answer, values)) for code, values in key.causes)
    yield Finding("power_of_ten"), power_of_ten(*_sorted(ours, answer))


def _descriptions(key: Reference, answer: Typed) -> Iterator[Explanation]:
    yield Finding("constant_factor"), constant_factor(*_sorted(key, answer))
    sizes = matched(_fits(key, replace(answer, values=np.abs(answer.values)), np.abs(key.values)))
    if len(sizes) == key.shape[0]:
        right = matched(_fits(key, answer, key.values))
        yield Finding("sign_error", listed(_place(k) for k in sorted(sizes) if k not in right)), True


def _too_few_digits(key: Key, answer: Typed, fits: Mask, right: Mask) -> Explanation:
    """That the moments which are not right are so to the digits that were typed, and which they are."""
    fits = fits | key.reference.rounded(*_table(answer, key.reference.values))
    holds = np.diag(fits).all() if key.in_order else len(matched(fits)) == len(fits)
    places = places_in(~right, _place) if right.any() else ""
    return Finding("precision_insufficient", places), bool(holds)


def _sorted(key: Reference, answer: Typed) -> tuple[Reference, Typed]:
    """The moments of both in ascending order at each point."""
    order = np.argsort(answer.values, axis=1)
    typed = answer.each(lambda array: np.take_along_axis(array, order, axis=1))
    return replace(key, values=np.sort(key.values, axis=1)), typed


# --- examples


def examples(key: Key) -> Iterator[Example]:
    """The moments in several forms, and under each mistake."""
    ours = key.reference
    for what, answer in forms(ours):
        yield Example(what, answer)
        if not key.in_order:
            yield Example(f"{what}, the other way round", answer[::-1])
    fits = _fits(ours, exactly(ours.values), ours.values)
    if key.in_order and not np.diag(fits[::-1]).all():
        yield Example("the other way round", as_typed(ours.entries[::-1]), "wrong_order")
    for k in np.flatnonzero(fits.sum(axis=1) > 1)[:1]:
        yield Example("an equal moment left out", as_typed(np.delete(ours.entries, k)), "multiplicity")
    for what, code, wrong_answer in wrong_forms(ours, _mistaken(key)):
        typed = ours.read(wrong_answer, _listed)
        if not _is_right(key, typed):
            findings = _findings(key, typed, _fits(ours, typed, ours.values), 0.0)
            if [finding.code for finding in findings] == [code]:
                yield Example(what, wrong_answer, code)


def _mistaken(key: Key) -> Iterator[tuple[str, str, Array]]:
    entries = key.reference.entries
    if not key.reference.names:
        for code, values in key.causes:
            yield code.replace("_", " "), code, values[0].astype(object)
    yield "a thousand times the moments", "power_of_ten", times(entries, 1000)
    yield "three times the moments", "constant_factor", times(entries, 3)
    first, last = np.eye(len(entries))[[0, -1]]
    yield "the first moment negative", "not_physical", times(entries, 1 - 2 * first)
    yield "the last moment too large", "triangle_inequality", times(entries, 1 + 3 * last)
