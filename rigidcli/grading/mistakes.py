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

from rigidcli.grading import scalars, tensors
from rigidcli.grading.arrays import mistakes as arrays
from rigidcli.grading.equations import mistakes as equations
from rigidcli.grading.expressions import mistakes as formulas
from rigidcli.grading.factors import times
from rigidcli.grading.principal import mistakes as principal
from rigidcli.grading.trajectories import mistakes as trajectories

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
"""The keys that a mistake makes of a key, worked once for each; or tuples with what a Variant has."""

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


VECTOR, MOMENTS, MATRIX, TENSOR = ARRAYS = ("vector", "moments", "matrix", "tensor")
"""The kinds of many numbers."""


def _of_tensor(code: str, says: str) -> Mistake:
    """A mistake on the way to an inertia tensor, which is seen in its moments and axes as well."""
    entries = dict.fromkeys((TENSOR, MOMENTS), arrays.worked_out(code))
    return Mistake(code, says, {"axes": principal.worked_out(code), **entries}, level=DECISIVE)


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
        {
            "number": times("sign_error"),
            "expression": formulas.negative,
            "equations": equations.made("sign_error"),
            **dict.fromkeys(ARRAYS, arrays.one_sign),
        },
        {
            "trajectory": trajectories.fitting("sign_error"),
            "axes": principal.by_factor("sign_error"),
            **dict.fromkeys(ARRAYS, arrays.signs),
        },
    ),
    Mistake(
        "precession_sense", "the precession goes the other way round", {"number": times("precession_sense")}
    ),
    Mistake(
        "power_of_ten",
        "is wrong by a power of ten",
        dict.fromkeys(("number", *ARRAYS), times("power_of_ten")),
        {"trajectory": trajectories.fitting("power_of_ten"), "axes": principal.by_factor("power_of_ten")},
    ),
    Mistake(
        "constant_factor",
        "differs from the expected answer by a constant factor",
        {
            "expression": formulas.three_times,
            "equations": equations.made("constant_factor"),
            **dict.fromkeys(("number", *ARRAYS), times("constant_factor")),
        },
        {
            "trajectory": trajectories.fitting("constant_factor"),
            "axes": principal.by_factor("constant_factor"),
            "expression": formulas.proportional(to_turn=False),
            **dict.fromkeys(ARRAYS, arrays.any_factor),
        },
    ),
    Mistake(
        "degrees_radians",
        "degrees and radians are confused",
        dict.fromkeys(("number", *ARRAYS), times("degrees_radians")),
        {
            "number": scalars.converted_twice("degrees_radians"),
            "trajectory": trajectories.fitting("degrees_radians"),
        },
    ),
    Mistake(
        "frequency_vs_angular_frequency",
        "a frequency and an angular frequency are confused",
        {
            "expression": formulas.of_a_turn,
            **dict.fromkeys(("number", *ARRAYS), times("frequency_vs_angular_frequency")),
        },
        {
            "trajectory": trajectories.fitting("frequency_vs_angular_frequency"),
            "expression": formulas.proportional(to_turn=True),
        },
    ),
    Mistake(
        "unit_conversion",
        "a unit is not converted right",
        dict.fromkeys(("number", *ARRAYS), times("unit_conversion")),
        {"number": scalars.converted_twice("unit_conversion")},
    ),
    Mistake(
        "too_few_sig_figs", "has too few significant figures", fits={"number": scalars.rounded(too_few=True)}
    ),
    Mistake(
        "precision_insufficient",
        "agrees with the expected answer, but has too few digits",
        fits={
            "number": scalars.rounded(too_few=False),
            "trajectory": trajectories.rounded,
            **dict.fromkeys(ARRAYS, arrays.rounded),
        },
    ),
    Mistake(
        "components_permuted",
        "the components are right, but in another order",
        {VECTOR: arrays.moved_on},
        {"trajectory": trajectories.permuted, VECTOR: arrays.permuted},
        level=DECISIVE,
    ),
    Mistake("time_unit", "the time is in another unit", {"trajectory": trajectories.in_other_units}),
    Mistake("time_shift", "is right, but shifted in time", fits={"trajectory": trajectories.shifted}),
    Mistake("time_reversed", "runs backwards in time", fits={"trajectory": trajectories.backwards}),
    Mistake(
        "frequency_wrong",
        "the motion has the right form, but the wrong frequency",
        fits={"trajectory": trajectories.at_other_frequency},
    ),
    Mistake(
        "transposed",
        "rows and columns are exchanged",
        {MATRIX: arrays.transposed, "axes": principal.in_columns},
        level=DECISIVE,
    ),
    Mistake("opposite_direction", "points the opposite way", {VECTOR: arrays.opposite}, level=DECISIVE),
    _of_tensor("axes_permuted", "the coordinate axes are in another order"),
    _of_tensor("products_of_inertia_sign", "the products of inertia have the wrong sign"),
    _of_tensor("products_of_inertia_missing", "the products of inertia are missing"),
    _of_tensor(
        "parallel_axis_missing", "this is about the centre of mass: the parallel-axis theorem is not applied"
    ),
    _of_tensor("parallel_axis_sign", "the parallel-axis theorem is applied with the wrong sign"),
    _of_tensor(
        "parallel_axis_off_diagonal_missing", "the parallel-axis theorem is applied to the diagonal only"
    ),
    Mistake(
        "other_frame",
        "is right, but along other axes than those asked for",
        {
            "axes": principal.worked_out("other_frame"),
            **dict.fromkeys((VECTOR, TENSOR, MOMENTS), arrays.worked_out("other_frame")),
        },
        {TENSOR: tensors.turned},
    ),
    Mistake(
        "potential_sign",
        "the potential energy has the wrong sign",
        {
            "expression": formulas.difference(of_lagrangian=True),
            "equations": equations.made("potential_sign"),
        },
    ),
    Mistake(
        "lagrangian_or_potential_sign",
        "this is T - V instead of T + V, or the potential energy has the wrong sign",
        {"expression": formulas.difference(of_lagrangian=False)},
    ),
    Mistake(
        "kinetic_factor", "the kinetic energy has a wrong factor", {"expression": formulas.of_another_mass}
    ),
    Mistake(
        "coupling_term_missing",
        "a term that couples the coordinates is missing",
        {"expression": formulas.uncoupled, "equations": equations.made("coupling_term_missing")},
    ),
    Mistake(
        "additive_constant",
        "differs from the expected answer by a constant",
        {"expression": formulas.but_for_a_constant},
    ),
    Mistake(
        "number_for_symbol",
        "a number stands in place of a symbol",
        fits={"expression": formulas.with_numbers, "equations": equations.with_numbers},
    ),
    Mistake(
        "hamilton_sign",
        "a sign in Hamilton's equations is wrong: q' = dH/dp, p' = -dH/dq",
        {"equations": equations.made("hamilton_sign")},
    ),
    Mistake(
        "euler_sign",
        "a cross term of Euler's equations has the wrong sign",
        {"equations": equations.made("euler_sign")},
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
    return Variant(*changed) if isinstance(changed, tuple) else Variant(changed)
