"""Named mistakes: one table of what each makes of a key.

Forwards, a changed key gives the selftest a wrong answer; backwards, an answer that is right by a changed key
is explained by its mistake. To add a mistake, add an entry to MISTAKES: its code, the sentence that a student
reads, and for each kind of answers that it concerns a function that changes a key.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, TypeAlias

from rigidcli.grading import scalars
from rigidcli.grading.equations import mistakes as equations

DECISIVE, CAUSE, DESCRIPTION = LEVELS = (0, 1, 2)
"""What is asked first: a tensor about the wrong point may also differ by a constant factor."""

KEYS = 1024
"""Keys of which the changed ones are kept."""


@dataclass(frozen=True, slots=True)
class Variant:
    """A key as a mistake makes it. `place` names the part that it changes, `detail` says more of it."""

    key: Any
    place: str = ""
    detail: str = ""


Change: TypeAlias = Callable[[Any], Iterable[Any]]
"""The keys (or Variants of one) that a mistake makes of a key: worked once for each key."""

Fit: TypeAlias = Callable[[Any, Any], Iterable[Any]]
"""The same where a number in the mistake, as a factor, is told from the answer: of a key and an answer."""


@dataclass(frozen=True, slots=True)
class Mistake:
    """A mistake with its code, and the sentence for a student, which holds no number.

    `changes` and `fits` have what it makes of a key, by the names of the kinds that it concerns.
    """

    code: str
    says: str
    changes: Mapping[str, Change] = field(default_factory=dict)
    fits: Mapping[str, Fit] = field(default_factory=dict)
    level: int = CAUSE


MISTAKES = (
    Mistake(
        "wrong_unit_right_number",
        "the number is right, the unit is not",
        fits={"number": scalars.in_other_unit},
        level=DECISIVE,
    ),
    Mistake(
        "sign_error",
        "has the wrong sign",
        {"number": scalars.times("sign_error"), "equations": equations.made("sign_error")},
    ),
    Mistake(
        "hamilton_sign",
        "Hamilton's equations have a sign: p' = -dH/dq, q' = +dH/dp",
        {"equations": equations.made("hamilton_sign")},
    ),
    Mistake(
        "euler_sign",
        "a cross term of Euler's equations has the wrong sign",
        {"equations": equations.made("euler_sign")},
    ),
    Mistake(
        "potential_sign",
        "the potential energy has the wrong sign",
        {"equations": equations.made("potential_sign")},
    ),
    Mistake(
        "coupling_term_missing",
        "a term that couples the coordinates is missing",
        {"equations": equations.made("coupling_term_missing")},
    ),
    Mistake(
        "number_for_symbol",
        "a number stands where a symbol is asked",
        fits={"equations": equations.with_numbers},
    ),
    Mistake(
        "precession_sense",
        "the precession goes the other way round",
        {"number": scalars.times("precession_sense")},
    ),
    Mistake("power_of_ten", "is wrong by a power of ten", {"number": scalars.times("power_of_ten")}),
    Mistake(
        "constant_factor",
        "differs from what was expected by a constant factor",
        {"number": scalars.times("constant_factor"), "equations": equations.made("constant_factor")},
    ),
    Mistake(
        "degrees_radians",
        "degrees and radians are confused",
        {"number": scalars.times("degrees_radians")},
        {"number": scalars.converted_twice("degrees_radians")},
    ),
    Mistake(
        "frequency_vs_angular_frequency",
        "a frequency and an angular frequency are confused (a factor of 2 pi)",
        {"number": scalars.times("frequency_vs_angular_frequency")},
    ),
    Mistake(
        "unit_conversion",
        "a unit is not converted right",
        {"number": scalars.times("unit_conversion")},
        {"number": scalars.converted_twice("unit_conversion")},
    ),
    Mistake("too_few_sig_figs", "has too few significant figures", fits={"number": scalars.with_few_figures}),
    Mistake(
        "precision_insufficient",
        "is right as far as it goes, but has too few digits",
        fits={"number": scalars.rounded},
    ),
)
"""All named mistakes. One that changes nothing in a key is none there."""


@lru_cache(KEYS)
def variants(kind: str, key: Any) -> tuple[tuple[Mistake, Variant], ...]:
    """What every mistake makes of a key of this kind, as far as that does not depend on an answer."""
    return tuple(
        (mistake, _variant(changed))
        for mistake in MISTAKES
        if kind in mistake.changes
        for changed in mistake.changes[kind](key)
    )


def explaining(kind: str, key: Any, answer: Any, level: int) -> Iterator[tuple[Mistake, Variant]]:
    """What may explain an answer at this level."""
    yield from (each for each in variants(kind, key) if each[0].level == level)
    for mistake in MISTAKES:
        if mistake.level == level and kind in mistake.fits:
            yield from ((mistake, _variant(changed)) for changed in mistake.fits[kind](key, answer))


def _variant(changed: Any) -> Variant:
    """A key may tell by itself what to say more of its mistake."""
    return (
        changed if isinstance(changed, Variant) else Variant(changed, detail=getattr(changed, "detail", ""))
    )
