"""Answers that are many numbers, and what their kinds share: how they are read, right, wrong and written.

Here are vectors, which may be directions alone, and matrices of any shape; others are derived.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import ClassVar, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.arrays.entries import Cell, as_typed, filled, rewritten, times, worked
from rigidcli.grading.arrays.keys import TENSORS, computed, labelled, reference
from rigidcli.grading.arrays.reference import Reference, Symmetry, Typed, exactly, length, listed, told
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds.base import Example, Kind
from rigidcli.grading.mistakes import variants
from rigidcli.grading.numbers import MOST_ENTRIES, margin
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, review, wrong
from rigidcli.grading.proofs import are_proved
from rigidcli.grading.tensors import OTHER_PRODUCTS
from rigidcli.grading.units import other_units

AXES = {name: k for names in ("xyz", "123456789") for k, name in enumerate(names)}
"""The ends of the names of components, in their order: `x`, `L_x`, `omega1`."""

OTHER_UNITS = 2
"""Units besides its own in which examples of a key are written."""

LARGEST = 1e300
"""In another unit, an example has no larger number than this: what is larger may not be a float."""

SYMMETRIES: dict[str, Symmetry] = {
    "exact": frozenset(),
    "sense": frozenset({"length"}),
    "sign_free": frozenset({"sign"}),
    "parallel": frozenset({"length", "sign"}),
}
"""What may be different in a right vector, by how its direction is judged."""

Findings: TypeAlias = tuple[Finding, ...]

LENGTHS = {"exact": (), "sense": (2.5,), "sign_free": (-1.0,), "parallel": (2.5, -0.4)}
"""By what a right vector may be multiplied."""


class Arrays(Kind):
    """A kind of many numbers. `word` names an entry in a message."""

    options: ClassVar[frozenset[str]] = frozenset({"symbols", "unit"})
    word: ClassVar[str] = "entry"

    def layout(self, answer: Tree) -> Array:
        """The cells of an answer, in its own shape. Raises Unreadable."""
        return _listed_cells(answer, self.word)

    def read_key(self, asked: Asked) -> Reference:
        """The key of a question. Raises ValueProblem."""
        found = reference(asked, self.layout)
        return replace(found, labels=labelled(self.word, found.shape))

    def read_answer(self, key: Reference, answer: Tree, folder: Path) -> Typed:
        """An answer, worked out. Raises Unreadable."""
        return key.read(answer, self.layout)

    def prepare(self, key: Reference) -> None:
        """Work out what judging needs, and load it."""
        for _, variant in variants(self.name, key):
            variant.key.holds(exactly(variant.key.values))
        self.explanation(key, exactly(key.values))

    def judge(self, key: Reference, answer: Typed) -> Outcome:
        """The outcome of an answer: a mistake that explains it, or which of its entries are wrong."""
        if key.needs_unit and answer.bare:
            return wrong(Finding("unit_missing", reference=told(key)))
        if self.is_right(key, answer):
            if not are_proved(key, answer):
                return review("it is right for some values of the symbols, and not proved to be so for all")
            return self.remarked(key, answer)
        share = 0.0
        if answer.shape == key.shape:
            facing = key.facing(answer)
            share = self.share(facing, self.right(facing, answer))
            findings = self.findings(key, answer, facing, share)
        elif not (findings := self.explained(key, answer)):
            raise Unreadable("wrong_shape", f"read {_size(answer.shape)}, expected {_size(key.shape)}")
        return wrong(*(replace(found, reference=told(key)) for found in findings), share=share)

    def is_right(self, key: Reference, answer: Typed) -> bool:
        """Whether all entries are right."""
        return key.holds(answer)

    def remarked(self, key: Reference, answer: Typed) -> Outcome:
        """The outcome of entries that are all right."""
        return correct()

    def right(self, facing: Reference, answer: Typed) -> Mask:
        """Which entries of an answer are right, beside the key that faces it."""
        return facing.agree(answer)

    def share(self, facing: Reference, right: Mask) -> float:
        """The share of right entries; nothing where only zeros are right."""
        return float(right.mean()) if bool((right & facing.nonzero).any()) else 0.0

    def findings(self, key: Reference, answer: Typed, facing: Reference, share: float) -> Findings:
        """What is said of a wrong answer of the right shape, beside the key that `facing` it is."""
        return self.explained(key, answer) or self.wrong_entries(answer, facing, share)

    def explained(self, key: Reference, answer: Typed) -> Findings:
        """The mistake that explains an answer, if one does."""
        found = self.explanation(key, answer)
        return () if found is None else (found,)

    def wrong_entries(
        self, answer: Typed, facing: Reference, share: float, odd: Mask | bool = False
    ) -> Findings:
        """Which entries are wrong, besides those that are told as `odd`, if others earn a share."""
        off = ~(self.right(facing, answer) | odd)
        numbers = off & facing.varies & (answer.values == answer.values[0]).all(axis=0)
        if numbers.any():
            return (Finding("number_for_symbol", listed(numbers, facing.labels)),)
        if not share:
            return (Finding("outside_tolerance"),)
        return (Finding("component_wrong", listed(off, facing.labels)),) if off.any() else ()

    def right_forms(self, key: Reference) -> Iterator[tuple[str, Tree]]:
        """The key as it would be typed, as expressions, and in other units."""
        if key.written is None:
            return
        for name, scale in _units_of(key).items():
            form = as_typed(times(key.written, 1 / scale))
            what = f"the key in {name}" if name else "the key"
            yield what, rewritten(form, f"{{}} {name}".rstrip().format)
            yield f"{what}, as expressions", rewritten(form, f"-(-({{}})) {name}".rstrip().format)
            if name:
                yield f"{what}, which stands behind all", f"{form} {name}".replace("'", "")

    def wrong_forms(self, key: Reference) -> Iterator[Example]:
        """The key to two figures, and without its unit."""
        yield from self.example(key, "to two figures", key.entries, "precision_insufficient", ".1e")
        if key.needs_unit and key.unit is not None and key.nonzero.any():
            yield Example(
                "without its unit", as_typed(times(key.entries, 1 / key.unit.scale)), "unit_missing"
            )

    def example(
        self, key: Reference, what: str, entries: Array, code: str, form: str = ".17g"
    ) -> Iterator[Example]:
        """An answer of such entries, if this code is what is said of it."""
        name, scale = next(iter(_units_of(key).items()))
        answer = rewritten(as_typed(times(entries, 1 / scale), form), f"{{}} {name}".rstrip().format)
        with suppress(Unreadable):
            first = self.judge(key, self.read_answer(key, answer, Path())).findings[:1]
            if [found.code for found in first] == [code]:
                yield Example(what, answer, code)


def _units_of(key: Reference) -> dict[str, float]:
    """Units in which a key may be typed, and how much of the SI unit each is; symbols bring their own."""
    if key.unit is None or key.names:
        return {"": 1.0}
    bare = {} if key.needs_unit else {"": key.unit.scale}
    largest = float(np.abs(key.values).max())
    typable = (each for each in other_units(key.unit.dimension).items() if largest / each[1] < LARGEST)
    return bare | {key.unit.text: key.unit.scale} | dict(islice(typable, OTHER_UNITS))


def _size(shape: tuple[int, ...]) -> str:
    return f"{shape[0]} rows of {shape[1]}" if len(shape) == 2 else f"{shape[0]} numbers"


def _listed_cells(answer: Tree, word: str) -> Array:
    """The cells of a list, or of a mapping from the names of components."""
    if isinstance(answer, dict):
        return _by_names(answer)
    if not isinstance(answer, list) or not answer or len(answer) > MOST_ENTRIES:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list of numbers")
    return filled([Cell(entry, f"{word} {k + 1}") for k, entry in enumerate(answer)], (len(answer),))


def _by_names(answer: dict[str, Tree]) -> Array:
    """The cells of `{x: 0, y: 2, z: 12}`, or with other names that end so."""
    names = {name: name.strip().lower().replace("_", "") for name in answer}
    places = [AXES.get(name[-1:]) for name in names.values()]
    if len({name[:-1] for name in names.values()}) != 1 or None in places:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list, or `{{x, y, z}}`")
    if len(set(places)) < len(places):
        raise Unreadable("duplicate_key", f"read {shown(answer)}")
    if set(places) != set(range(len(places))):
        raise Unreadable("wrong_shape", f"read {shown(answer)}: a component is missing")
    cells = [Cell(entry, shown(name)) for name, entry in answer.items()]
    return filled([cells[places.index(k)] for k in range(len(cells))], (len(cells),))


class Vector(Arrays):
    """The components of a vector, or a direction alone."""

    name: ClassVar[str] = "vector"
    options: ClassVar[frozenset[str]] = Arrays.options | {"direction", "normalized"}
    word: ClassVar[str] = "component"

    def read_key(self, asked: Asked) -> Reference:
        """The key of a question for a vector. Raises ValueProblem."""
        found = super().read_key(asked)
        if len(found.shape) != 1 or not found.shape[0]:
            raise ValueProblem("this is not a list of numbers", hint="a matrix has a kind of its own")
        symmetry = SYMMETRIES[asked.question.direction]
        if "length" in symmetry and not np.abs(found.values).max(axis=1).all():
            raise ValueProblem("a vector of length zero has no direction", path=("direction",))
        frames = (("other_frame", values) for values in _in_other_frames(found, asked))
        return replace(found, symmetry=symmetry, mistaken=tuple(frames))

    def remarked(self, key: Reference, answer: Typed) -> Outcome:
        """A direction may have to be a unit vector."""
        if "length" in key.symmetry and key.question.normalized == "required":
            off = max(abs(length(answer.values[k]) - 1) for k in answer.rows)
            if not off <= margin(1.0, key.tolerance):
                return wrong(Finding("axis_not_normalised", reference=told(key)))
        return correct()

    def share(self, facing: Reference, right: Mask) -> float:
        """A direction is right as a whole."""
        return 0.0 if "length" in facing.symmetry else super().share(facing, right)

    def findings(self, key: Reference, answer: Typed, facing: Reference, share: float) -> Findings:
        """What is said of a wrong vector."""
        if not answer.values.any() and key.nonzero.any():
            return (Finding("zero_vector"),)
        if "length" in key.symmetry:
            return self.explained(key, answer) or (Finding("outside_tolerance"),)
        return super().findings(key, answer, facing, share)

    def right_forms(self, key: Reference) -> Iterator[tuple[str, Tree]]:
        """The vector in several forms, as a mapping, and in other lengths that are allowed."""
        for what, form in super().right_forms(key):
            yield what, form
            if isinstance(form, list) and len(form) <= 3:
                yield f"{what}, by the names of its components", dict(zip("xyz", form, strict=False))
        if key.written is not None and not key.needs_unit and key.question.normalized == "optional":
            for factor in LENGTHS[key.question.direction]:
                scale = 1.0 if key.unit is None or key.names else key.unit.scale
                form = as_typed(times(key.written, factor / scale))
                yield f"the key, {factor:g} times as long", form


def _in_other_frames(key: Reference, asked: Asked) -> Iterator[Floats]:
    """The same vector along the axes of the document, and along the principal axes."""
    if asked.document is None or key.shape != (3,):
        return
    frames = [asked.document.physical.axes] if asked.document.frame is not None else []
    principal = asked.report.get("axes") if asked.report is not None else None
    if isinstance(principal, np.ndarray):
        frames.append(principal)
    for frame in frames:
        yield np.einsum("kij,kj->ki", worked(computed(frame), key.points), key.values)


def rows(answer: Tree) -> Array:
    """The cells of a list of rows, all of one length. Raises Unreadable."""
    expected = "expected a list of rows, each a list of numbers"
    if not isinstance(answer, list) or not answer or len(answer) > MOST_ENTRIES:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, {expected}")
    for k, row in enumerate(answer):
        if not isinstance(row, list):
            raise Unreadable("wrong_shape", f"read {shown(row)}, {expected}", place=f"row {k + 1}")
        if len(row) != len(answer[0]):
            detail = f"read {len(row)} numbers, but {len(answer[0])} in the first row"
            raise Unreadable("wrong_shape", detail, place=f"row {k + 1}")
    shape = len(answer), len(answer[0])
    if shape[0] * shape[1] > MOST_ENTRIES:
        raise Unreadable("too_large", f"{shape[0] * shape[1]} numbers")
    labels = labelled("", shape)
    return filled([Cell(answer[i][j], str(labels[i, j])) for i, j in np.ndindex(*shape)], shape)


class Matrix(Arrays):
    """A matrix of any shape, row by row."""

    name: ClassVar[str] = "matrix"
    options: ClassVar[frozenset[str]] = Arrays.options | {"products"}

    def layout(self, answer: Tree) -> Array:
        """The cells of a list of rows. Raises Unreadable."""
        return rows(answer)

    def read_key(self, asked: Asked) -> Reference:
        """The key of a question for a matrix; products of a tensor have the sign that is asked.

        Raises ValueProblem.
        """
        found = super().read_key(asked)
        if len(found.shape) != 2 or 0 in found.shape:
            raise ValueProblem("this is not a list of rows of equal length")
        if found.path[-1:] in TENSORS and found.question.products == "plus":
            entries = times(found.entries, OTHER_PRODUCTS)
            found = replace(found.times(OTHER_PRODUCTS), entries=entries, numbers=1.0)
        return found
