"""The heads of columns: a name, perhaps with a unit, and which of the columns that are asked for it means.

    t   t (s)   t [ms]   theta/rad   θ1   θ_1   px

Names are told from each other as typed, then in ASCII and without the unit, then in the usual spellings, and
at last without regard to case: each time only where one head and one column have the same name.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

from rigidcli.errors import ExpressionError, shown
from rigidcli.grading.expressions.formula import spellings
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.units import read_unit
from rigidcli.model.units import TIME as OF_TIME
from rigidcli.symbolic.language.expression import parse
from rigidcli.symbolic.language.tree import Name

TIME = "t"

MOST_HEADS = 200
"""Heads that may be spelled differently from what is asked for."""

LONGEST = 200
"""Characters of a head that may."""

USUAL = {"time": TIME}
"""Names that mean another."""

_UNIT = re.compile(
    r"(?P<name>[^(\[/]*?)\s*(?:\((?P<round>.*)\)|\[(?P<square>.*)\]|/(?P<below>.*))", re.DOTALL
)
_BRACKETS = re.compile(r"\s{0,9}[(\[][^()\[\]]{0,60}[)\]]")
_OMEGA = re.compile(r"omega(?=[0-9]|$)")


@dataclass(frozen=True, slots=True)
class Head:
    """The `text` over a column, the `name` that it has in ASCII, and its `unit` as typed (empty for none)."""

    text: str
    name: str
    unit: str = ""

    def scale(self, *, any_unit: bool) -> float:
        """What makes SI units of the unit: of `any_unit`, or of one of time; 1 where it is not known."""
        try:
            unit = read_unit(self.unit) if self.unit else None
        except Unreadable:
            unit = None
        return unit.scale if unit is not None and (any_unit or unit.dimension == OF_TIME) else 1.0


def split(line: str, separator: str | None) -> list[str]:
    """The heads in a line, parted by blanks where there is no separator: `t (s)  x (m)` are two."""
    if separator is None:
        line = _BRACKETS.sub(lambda found: "*".join(found[0].split()), line)
    return [head.strip() for head in line.split(separator)]


def read_head(text: str) -> Head:
    """What a head tells."""
    if len(text) > LONGEST:
        return Head(text, text)
    found = _UNIT.fullmatch(text)
    unit = "" if found is None else found["round"] or found["square"] or found["below"] or ""
    name = unicodedata.normalize("NFKC", text if found is None else found["name"])
    try:
        root = parse(name).root
    except ExpressionError:
        root = None
    return Head(text, root.name if isinstance(root, Name) else name, unit.strip())


def places(
    texts: Sequence[str], wanted: Collection[str], further: Collection[str] = ()
) -> Mapping[str, tuple[int, Head]]:
    """Where the columns stand that are `wanted`, and those `further` ones that go by their own name.

    Raises Unreadable where several have the same name.
    """
    heads = [Head(text, text) for text in texts]
    heads[:MOST_HEADS] = [read_head(text) for text in texts[:MOST_HEADS]]
    momenta = [name for name in wanted if name.startswith("p_")]
    other = {**USUAL, **spellings((*wanted, *further), momenta, ())}

    def usual(name: str) -> str:
        return _OMEGA.sub("w", other.get(name, name).replace("_", ""))

    def small(name: str) -> str:
        return usual(name).casefold()

    found: dict[str, int] = {}
    _match(found, [head.text for head in heads], wanted, str, several=True)
    names = [head.name for head in heads]
    _match(found, names, wanted, str, several=True)
    _match(found, names[:MOST_HEADS], wanted, usual)
    _match(found, names[:MOST_HEADS], wanted, small)
    _match(found, names, further, str, several=True)
    return {name: (place, heads[place]) for name, place in found.items()}


def _match(
    found: dict[str, int],
    heads: Sequence[str],
    wanted: Collection[str],
    form: Callable[[str], str],
    *,
    several: bool = False,
) -> None:
    """Adds where the columns stand that are not `found` yet, and have the same `form` as one head alone.

    Raises Unreadable where `several` have it, if that is not to be passed over.
    """
    taken = set(found.values())
    lacking = [name for name in wanted if name not in found]
    meant = Counter(map(form, lacking))
    at: dict[str, list[int]] = {}
    for place, head in enumerate(heads if lacking else ()):
        if place not in taken:
            at.setdefault(form(head), []).append(place)
    for name in lacking:
        own = at.get(form(name), [])
        if several and len(own) > 1:
            raise Unreadable("duplicate_key", "there are several columns of this name", place=shown(name))
        if len(own) == 1 and meant[form(name)] == 1:
            found[name] = own[0]
