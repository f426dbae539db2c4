"""Keys of many numbers as the mistakes of people make them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from rigidcli.grading.arrays.reference import MOST_PLACES, Reference, Typed, exactly, listed
from rigidcli.grading.numbers import NOISE, ROUNDING


def worked_out(code: str) -> Callable[[Reference], Iterator[Reference]]:
    """What makes the keys whose values come out under this mistake, as far as they can be told apart."""

    def changes(key: Reference) -> Iterator[Reference]:
        for name, values in key.mistaken:
            if name == code and not key.holds(exactly(values)):
                yield key.valued(values)

    return changes


def opposite(key: Reference) -> Iterator[Reference]:
    """The key that points the other way."""
    yield key.times(-1)


def transposed(key: Reference) -> Iterator[Reference]:
    """The key with rows and columns exchanged."""
    yield key.arranged(lambda array: array.swapaxes(1, 2))


def moved_on(key: Reference) -> Iterator[Reference]:
    """The key with its components moved on by one."""
    yield key.arranged(lambda array: np.roll(array, 1, axis=1))


def permuted(key: Reference, answer: Typed) -> Iterator[Reference]:
    """The key with its components in the order of the answer."""
    if answer.shape == key.shape:
        yield replace(replace(key, symmetry=key.symmetry | {"order"}).facing(answer), symmetry=key.symmetry)


def one_sign(key: Reference) -> Iterator[tuple[Reference, str]]:
    """The keys with one sign wrong, and where that is; entries that mirror each other have one label."""
    for label in dict.fromkeys(key.labels[key.nonzero].tolist()[:MOST_PLACES]):
        yield key.times(np.where(key.labels == label, -1, 1)), label


def signs(key: Reference, answer: Typed) -> Iterator[tuple[Reference, str]]:
    """The key with the wrong signs of an answer that is right but for them, and where they are."""
    if answer.shape != key.shape:
        return
    facing = key.facing(answer, by_size=True)
    right, wrong = facing.agree(answer), facing.times(-1).agree(answer) & facing.nonzero
    wrong &= ~right
    if wrong.any() and (right | wrong).all():
        every = wrong.sum() == facing.nonzero.sum() > 1
        yield facing.times(np.where(wrong, -1, 1)), "" if every else listed(wrong, key.labels)


def any_factor(key: Reference, answer: Typed) -> Iterator[Reference]:
    """The key times the factor that an answer has, where entries of different sizes tell that it is one."""
    if answer.shape != key.shape:
        return
    facing = key.facing(answer, by_size=True)
    used = answer.counts & facing.nonzero & (facing.values != 0)
    with np.errstate(all="ignore"):
        ratios = answer.values[used] / facing.values[used]
        sizes = np.abs(key.values[0][key.nonzero])
    if (
        not ratios.size
        or not np.isfinite(ratios).all()
        or sizes.max() <= sizes.min() * (1 + key.least_change)
    ):
        return
    # The middle of the range is as near to all of them as a number can be.
    ratio, least = float(ratios.min() / 2 + ratios.max() / 2), key.least_change
    others = (factor for code, factor in key.factors if code != "constant_factor")
    if abs(abs(ratio) - 1) > least and not any(abs(ratio / other - 1) <= least for other in others):
        yield facing.times(ratio)


def rounded(key: Reference, answer: Typed) -> Iterator[tuple[Reference, str]]:
    """The key rounded to the digits of an answer, and the places where these are too few."""
    if answer.shape != key.shape:
        return
    facing = key.facing(answer, by_size=True)
    with np.errstate(all="ignore"):
        limits = answer.halves * (1 + ROUNDING) + NOISE * np.abs(facing.values)
        near = (answer.halves > 0) & (np.abs(answer.values - facing.values) <= limits)
    right = facing.agree(answer)
    short = ~right & (near | ~answer.counts).all(axis=0)
    if short.any() and (right | short).all():
        others = bool((right & facing.nonzero).any())
        yield facing.valued(answer.values), listed(short, key.labels) if others else ""
