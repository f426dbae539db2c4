"""Documents that differ in their numbers alone: read once, with their numbers as arrays in the formulas."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.groups import ALONE, UnfitError, common, grouped
from rigidcli.errors import RigidError
from rigidcli.model.document import Document
from rigidcli.model.load import Draft
from rigidcli.model.several import Several
from rigidcli.model.typed_numbers import split_quantity
from rigidcli.model.units import parse_unit
from rigidcli.report import Report, part
from rigidcli.studies.common import called

LONGEST = 10_000
"""The longest text (characters) that is compared with others: a longer one takes its time to be read."""

ABOUT = ("name", "description")
"""Keys at the top of a document on which no number depends."""


def at_once(
    drafts: Sequence[Draft | None], run: Callable[[Document], Report]
) -> Mapping[int, tuple[Report, Sequence[Path]]]:
    """The reports on those of the drafts that are alike, and the files that these name, by their places.

    `run` finds the report on a document some of whose numbers are many. All other drafts are to be worked one
    by one, and so are those that are refused. A place may be without a draft.
    """
    forms: dict[Hashable, list[tuple[int, Draft, Sequence[float | str]]]] = {}
    for place, draft in enumerate(drafts):
        if draft is not None and (read := _read(draft)) is not None:
            form, values = read
            forms.setdefault(form, []).append((place, draft, values))
    return {place: told for alike in forms.values() for place, told in _reports(alike, run)}


def _read(draft: Draft) -> tuple[Hashable, Sequence[float | str]] | None:
    """The form of a document without its numbers and quantities, and these; None for what is alone."""
    if len(draft.places.text) > LONGEST:
        return None
    try:
        tree = draft.tree()
    except RigidError:
        return None
    if not isinstance(tree, dict) or not isinstance(tree.get("name"), str | None):
        return None
    values: list[float | str] = []
    form = _form(_without_names(tree), values)
    return form, values


def _without_names(tree: Any) -> dict[str, Any]:
    return {key: value for key, value in tree.items() if key not in ABOUT}


def _form(tree: Any, values: list[float | str]) -> Hashable:
    """The keys, lists, texts and units of a tree, whose numbers and quantities are added to the `values`."""
    if isinstance(tree, dict):
        return dict, tuple((key, _form(entry, values)) for key, entry in tree.items())
    if isinstance(tree, list):
        return list, tuple(_form(entry, values) for entry in tree)
    unit = _unit(tree)
    if unit is None:
        return type(tree), tree
    values.append(tree)
    return unit


def _unit(value: object) -> str | None:
    """The unit of a quantity, nothing for that of a number; None for anything else."""
    if isinstance(value, str):
        written = split_quantity(value)
        return written and written.unit
    return "" if type(value) in (int, float) else None


def _filled(tree: Any, values: Iterator[object]) -> Any:
    """The tree with other values, which are taken in the order in which `_form` finds them."""
    if isinstance(tree, dict):
        return {key: _filled(entry, values) for key, entry in tree.items()}
    if isinstance(tree, list):
        return [_filled(entry, values) for entry in tree]
    return tree if _unit(tree) is None else next(values)


def _several(column: Sequence[Any]) -> Several:
    """Numbers, or quantities in one unit, as the values of one key."""
    unit = str(_unit(column[0]))
    written, dimension = [*column], ""
    told = written
    if unit:
        typed = parse_unit(unit)
        written = [float(each.digits) for each in map(split_quantity, column) if each is not None]
        told, dimension = [typed.si(Fraction(repr(each))) for each in written], typed.dimension.unit
    numbers = np.array(told, dtype=np.float64)
    return Several("", written, unit, numbers, np.where(np.isfinite(numbers), 0, ALONE), [dimension])


def _reports(
    alike: Sequence[tuple[int, Draft, Sequence[float | str]]], run: Callable[[Document], Report]
) -> Iterator[tuple[int, tuple[Report, Sequence[Path]]]]:
    """What is told of drafts of one form, as far as they are worked together, each with its place."""

    def work(group: NDArray[np.int_]) -> tuple[Report, Sequence[Path]]:
        members = [alike[index] for index in group.tolist()]
        _, first, own = members[0]
        values: list[object] = [*own]
        try:
            for index, column in enumerate(zip(*(each for _, _, each in members), strict=True)):
                if len({*map(repr, column)}) > 1:
                    values[index] = several = _several(column)
                    common(several.labels)
            document = first.with_tree(_filled(_without_names(first.tree()), iter(values)))
            if document.files and len({draft.folder for _, draft, _ in members}) > 1:
                raise UnfitError  # files of the same name, which are others
            with np.errstate(all="ignore"):
                return run(document), document.files
        except (RigidError, AttributeError, AssertionError) as error:
            raise UnfitError from error  # as in `grouped`: if it fails with one document, that one tells

    for group, found in grouped(np.arange(len(alike)), work):
        if found is None:
            continue
        report, files = found
        for index, member in enumerate(group.tolist()):
            place, draft, _ = alike[member]
            tree: Any = draft.tree()
            name = called(tree.get("name"), draft.source)
            told = replace(part(report, index), name=name, source=draft.source, document=draft.text)
            yield place, (told, files)
