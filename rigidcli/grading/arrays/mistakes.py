"""What is said of wrong answers of many numbers, and examples of such answers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Array, Mask
from rigidcli.grading.arrays.entries import Entry, filled
from rigidcli.grading.arrays.reference import Reference, Typed
from rigidcli.grading.asked import Tree
from rigidcli.grading.outcome import Finding
from rigidcli.symbolic.language.expression import Expression, parse

_SIZES = (2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 1.5, 4 / 3, 2.5, math.sqrt(2), math.pi)
FACTORS = tuple(sign * factor for size in _SIZES for factor in (size, 1 / size) for sign in (1, -1))
"""Constant factors that say something even of a single number."""

SURELY = 10
"""A factor is one if it differs from 1 by more than so many tolerances."""

MOST_PLACES = 6
"""Wrong components that are listed."""

# --- what explains an answer

Explanation: TypeAlias = tuple[Finding, bool]
"""What may be said of an answer, and whether it is so."""


def one_of(*levels: Iterable[Explanation]) -> Finding | None:
    """What alone explains an answer at the first level at which anything does.

    Causes come before descriptions: a tensor about the wrong point may also differ by a constant factor.
    """
    for level in levels:
        found = {finding.code: finding for finding, holds in level if holds}
        if found:
            return next(iter(found.values())) if len(found) == 1 else None
    return None


def power_of_ten(key: Reference, answer: Typed) -> bool:
    """Whether the answer is a power of ten times the right one."""
    ratio = _ratio(key, answer)
    if ratio is None or ratio <= 0:
        return False
    power = round(math.log10(ratio))
    return power != 0 and abs(power) < 300 and key.same(answer.times(10.0**-power), key.values)


def constant_factor(key: Reference, answer: Typed) -> bool:
    """Whether the answer is the right one times a number.

    Any number where the right one has entries of different sizes; else one that often stands for a mistake.
    """
    ratio = _ratio(key, answer)
    if ratio is None or abs(abs(ratio) - 1) <= SURELY * key.slack:
        return False
    sizes = np.abs(key.values[0][key.nonzero])
    if sizes.size and sizes.max() > sizes.min() * (1 + SURELY * key.slack):
        return key.same(answer.times(1 / ratio), key.values)
    return is_factor(key, answer, FACTORS)


def is_factor(key: Reference, answer: Typed, factors: Iterable[float]) -> bool:
    """Whether the answer is the right one times one of these numbers."""
    ratio = _ratio(key, answer)
    if ratio is None:
        return False
    near = (factor for factor in factors if abs(ratio / factor - 1) <= SURELY * key.slack)
    return any(key.same(answer.times(1 / factor), key.values) for factor in near)


def _ratio(key: Reference, answer: Typed) -> float | None:
    """The number by which the right entries must be multiplied, if any; None where there is none."""
    used = answer.counts & key.nonzero & (key.values != 0)
    with np.errstate(all="ignore"):
        ratios = answer.values[used] / key.values[used]
    if not ratios.size or not np.isfinite(ratios).all() or len(set(np.sign(ratios))) > 1 or not ratios[0]:
        return None
    # The middle of the range is as near to all of them as a number can be.
    return float(ratios.min() / 2 + ratios.max() / 2)


def flipped(key: Reference, answer: Typed, right: Mask) -> Mask:
    """Which entries have the wrong sign, where all others are right; none where that is not so."""
    signs: Mask = key.agree(answer.times(-1), key.values) & key.nonzero & ~right
    return signs if bool((right | signs).all()) else np.zeros_like(signs)


def too_few_digits(key: Reference, answer: Typed, right: Mask, places: Callable[[Mask], str]) -> Explanation:
    """That the entries which are not right are so to the digits that were typed, and which they are."""
    short = ~right & key.rounded(answer, key.values)
    others = bool((right & key.nonzero).any())
    finding = Finding("precision_insufficient", places(short) if others else "")
    return finding, bool(short.any()) and bool((right | short).all())


# --- what is said


def listed(places: Iterable[str]) -> str:
    """Places in a message: the first few, and how many more."""
    names = list(places)
    more = len(names) - MOST_PLACES
    text = ("; " if any("," in name for name in names) else ", ").join(names[:MOST_PLACES])
    return text + (f" and {more} more" if more > 0 else "")


def wrong_entries(
    key: Reference, answer: Typed, right: Mask, name: Callable[..., str], share: float
) -> tuple[Finding, ...]:
    """What is said of wrong entries that nothing explains: which they are, if the others earn a share."""
    numbers = ~right & key.varies & (answer.values == answer.values[0]).all(axis=0)
    if numbers.any():
        return (Finding("number_for_symbol", places_in(numbers, name), reference=told(key)),)
    if not share:
        return (Finding("outside_tolerance", reference=told(key)),)
    return (Finding("component_wrong", places_in(~right, name), reference=told(key)),)


def places_in(mask: Mask, name: Callable[..., str]) -> str:
    """The places in a mask, named by their indices."""
    return listed(name(*place) for place in np.argwhere(mask).tolist())


def earned(key: Reference, right: Mask) -> float:
    """The share of right entries; nothing where only zeros are right."""
    return float(right.mean()) if bool((right & key.nonzero).any()) else 0.0


def told(key: Reference) -> str:
    """The right answer, for those who may see it."""
    # Symbols bring units of their own.
    if key.unit is None or key.names:
        return f"expected {_shown(key.entries)}"
    return f"expected {_shown(times(key.entries, 1 / key.unit.scale))} {key.unit.text}"


def _shown(entries: Any) -> str:
    if isinstance(entries, np.ndarray):
        return f"[{', '.join(map(_shown, entries))}]"
    return entries.text if isinstance(entries, Expression) else f"{entries:.6g}"


# --- examples

OTHER_UNITS = {"m": {"cm": 100.0}, "kg m^2": {"g cm^2": 1e7}, "rad/s": {"rpm": 30 / math.pi}}
"""Units for examples: how many there are in one SI unit."""


def times(entries: Array, factors: Any) -> Array:
    """Entries multiplied by numbers (one, or an array that is broadcast), one by one."""
    pairs = np.broadcast(entries, factors)
    return filled([_times(entry, float(factor)) for entry, factor in pairs], entries.shape)


def _times(entry: Entry, factor: float) -> Entry:
    if isinstance(entry, Expression):
        return parse(f"{factor!r}*({entry.text})") if factor else 0.0
    return entry * factor


def as_typed(entries: Any, form: str = ".17g") -> Tree:
    """Entries (arrays of them) as a student types them, numbers with all digits or in another form."""
    if isinstance(entries, np.ndarray):
        return [as_typed(entry, form) for entry in entries]
    return entries.text if isinstance(entries, Expression) else f"{entries:{form}}"


def wrong_forms(
    key: Reference, mistaken: Iterable[tuple[str, str, Array]]
) -> Iterator[tuple[str, str, Tree]]:
    """Mistaken entries as a student types them, after what they are and the code; and too few digits."""
    yield from ((what, code, as_typed(entries)) for what, code, entries in mistaken)
    yield "to two figures", "precision_insufficient", as_typed(key.entries, ".1e")


def forms(key: Reference) -> Iterator[tuple[str, Tree]]:
    """The key in the forms that every entry can have, and what they are."""
    yield "the key", as_typed(key.entries)
    yield "the key, as expressions", _each(as_typed(key.entries), "-(-({}))".format)
    if key.unit is None or key.names:
        return
    units = {key.unit.text: 1 / key.unit.scale} | OTHER_UNITS.get(key.unit.text, {})
    for name, number in units.items():
        yield f"the key in {name}", _each(as_typed(times(key.entries, number)), f"{{}} {name}".format)


def _each(tree: Tree, write: Callable[[str], str]) -> Tree:
    return [_each(entry, write) for entry in tree] if isinstance(tree, list) else write(tree)
