"""The one edit that makes a tensor one that a body may have, where exactly one does."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from pydantic import ValidationError

from rigidcli.bodies.bodies import KnownTensor
from rigidcli.bodies.robots.links import COLUMNS, ENTRIES, ROWS, Link, matrix
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.tensor import point_tensor, shortfall
from rigidcli.errors import ValueProblem
from rigidcli.studies.robots.geometry import NEAR, Weighed, forms_of, moments_agree

POWERS = (-3, -2, -1, 1, 2, 3)
"""By how many places a decimal point slips: by a digit or two, or from a unit to the one next to it."""

FARTHEST = 100.0
"""A parallel-axis term of this many times the tensor was not taken from it by mistake."""

PRODUCTS = ROWS != COLUMNS
"""Which of the entries are products of inertia."""


@np.errstate(all="ignore")
def repair(link: Link) -> str | None:
    """What to write instead in the tensor of a link that no body has; None unless exactly one edit helps.

    An edit moves a decimal point, changes a sign or all signs of the products, exchanges two entries, or
    undoes the parallel-axis theorem. It must lead near to the form of the link, where that is known.
    """
    given = None if link.body is None else link.body.get("inertia")
    if given is None:
        return None
    entries = np.array([float(given.get(key, 0)) for key in ENTRIES])
    mass = float(link.body["mass"]) if link.body else 0.0
    if mass <= 0 or shortfall(matrix(entries)) is None:
        return None
    forms = forms_of(link).solids
    found = []
    for words, edited in _edits(entries, mass, _origin(link)):
        tensor = matrix(edited)
        body = Weighed(mass, np.zeros(3), tensor)
        physical = shortfall(tensor) is None and body.moments[0] > 0
        if physical and (not forms or any(moments_agree(body, form, NEAR) for form in forms)):
            found.append(words)
    return f"{found[0]} makes it one that a body has; no other single edit does" if len(found) == 1 else None


def _edits(entries: Floats, mass: float, origin: Floats) -> Iterator[tuple[str, Floats]]:
    """Each edit in words, and the entries (6) that it leaves."""
    for place, (name, entry) in enumerate(zip(ENTRIES, entries, strict=True)):
        if entry == 0:
            continue
        for factor in (-1.0, *(10.0**power for power in POWERS)):
            edited = entries.copy()
            edited[place] = float(f"{entry * factor:.15g}")
            slip = "sign" if factor < 0 else "decimal point"
            yield f"{name} = {edited[place]:g} instead of {entry:g} (a slip of the {slip})", edited
    for one, other in combinations(range(6), 2):
        if entries[one] != entries[other]:
            edited = entries.copy()
            edited[[one, other]] = edited[[other, one]]
            yield f"{ENTRIES[one]} and {ENTRIES[other]} exchanged", edited
    if np.count_nonzero(entries[PRODUCTS]) > 1:
        yield "the other sign for all products of inertia", np.where(PRODUCTS, -entries, entries)
    shift = (mass * point_tensor(origin))[ROWS, COLUMNS]
    if origin.any() and np.abs(shift).max() <= FARTHEST * np.abs(entries).max():
        yield (
            "the parallel-axis term added once (about the wrong point)",
            entries + shift,
        )


def _origin(link: Link) -> Floats:
    """The origin of the link from its centre of mass, along the axes of the tensor (3, m); else zero."""
    body = {**(link.body or {}), "mass": 1, "inertia": {"Ixx": 1, "Iyy": 1, "Izz": 1}}
    try:
        turn, shift = KnownTensor.model_validate(body).motion(FLOAT)
    except (ValidationError, ValueProblem):
        return np.zeros(3)
    origin: Floats = -turn.T.astype(float) @ shift.astype(float)
    return origin
