"""The names that a question has: parameters, coordinates, momenta, velocities, and what is known of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from rigidcli.errors import ValueProblem
from rigidcli.grading.asked import Asked
from rigidcli.grading.functions.formula import Domain, Vocabulary, parts_of, size_of, spellings
from rigidcli.model.dimensions import dimension_of
from rigidcli.model.parameters import read_name
from rigidcli.model.units import Dimension, parse_unit, split_quantity
from rigidcli.model.variables import momentum, velocity
from rigidcli.symbolic.tree import Node

if TYPE_CHECKING:
    from rigidcli.model.document import Document

TIME = "t"

MOST_NODES = 400
"""Of an expression whose dimensions are looked at."""


@dataclass(frozen=True, eq=False)
class Names:
    """The names of a question, and the values and dimensions of parameters, as far as they are known.

    `further` has names of the key that a document does not tell: new variables.
    """

    vocabulary: Vocabulary
    coordinates: tuple[str, ...] = ()
    momenta: tuple[str, ...] = ()
    velocities: tuple[str, ...] = ()
    further: tuple[str, ...] = ()
    values: Mapping[str, float] = field(default_factory=dict)
    dimensions: Mapping[str, Dimension] = field(default_factory=dict)

    @cached_property
    def states(self) -> frozenset[str]:
        """All that changes while a system moves, but the time."""
        return frozenset((*self.coordinates, *self.momenta, *self.velocities, *self.further))


def names_of(asked: Asked, used: Iterable[str]) -> Names:
    """The names that an answer may have where the key uses these.

    Parameters of a document are positive, unless they have another value; coordinates, momenta, velocities
    and the time are real. Of a literal key, what is not listed is positive. What the `symbols` of the
    question say goes first.

    Raises ValueProblem for a name in the question that is none.
    """
    question, document = asked.question, asked.document
    used = sorted(used)
    symbols = question.symbols or {}
    listed = {TIME if name == TIME else read_name(name): domain for name, domain in symbols.items()}
    coordinates, momenta, velocities = (
        tuple(map(read_name, names))
        for names in (question.coordinates, question.momenta, question.velocities)
    )
    values: dict[str, float] = {}
    dimensions: dict[str, Dimension] = {}
    domains: dict[str, Domain] = {}
    if document is not None:
        values, dimensions = _values(document), _dimensions(document)
        domains |= {name: "positive" if values.get(name, 1) > 0 else "real" for name in document.definitions}
        if document.system is not None:
            coordinates = coordinates or document.system.coordinates
    momenta = momenta or tuple(map(momentum, coordinates))
    velocities = velocities or tuple(map(velocity, coordinates))
    derived = {
        name: definition.root
        for name, definition in ({} if document is None else document.definitions).items()
        if definition is not None and definition.names and name not in listed
    }
    moving = (*coordinates, *momenta, *velocities)
    told = document is not None or all(name in listed or name in moving for name in used)
    unlisted: Domain = "positive" if document is None else "real"
    new = [name for name in used if name not in (*domains, *listed, *moving, TIME)]
    domains |= dict.fromkeys(new, unlisted)
    domains |= dict.fromkeys((*moving, TIME), "real")
    domains |= listed
    independent = {name: domain for name, domain in domains.items() if name not in derived}
    other = spellings(domains, momenta, velocities)
    return Names(
        Vocabulary(independent, derived, other, told),
        coordinates,
        momenta,
        velocities,
        () if document is None else tuple(new),
        values,
        dimensions,
    )


def _values(document: Document) -> dict[str, float]:
    """The parameters that have a value, in SI units."""
    found = {name: document.arithmetic.value(value) for name, value in document.values.items()}
    return {name: float(value) for name, value in found.items() if value is not None}


def _dimensions(document: Document) -> dict[str, Dimension]:
    """The parameters that have a unit, or follow from such."""
    raw = {read_name(name): value for name, value in (document.parameters or {}).items()}
    known: dict[str, Dimension] = {}
    for name, definition in document.definitions.items():
        value = raw.get(name)
        quantity = split_quantity(value) if isinstance(value, str) else None
        if quantity is not None:
            known[name] = parse_unit(quantity[1]).dimension
        elif definition is not None and definition.names:
            dimension = dimension_of(definition.root, known)
            if dimension is not None:
                known[name] = dimension
    return known


def mismatch(node: Node, names: Names) -> str | None:
    """What is wrong with the dimensions in an expression, as far as they are known."""
    if not names.dimensions or size_of(node) > MOST_NODES:
        return None
    try:
        _require_dimensions(node, names.dimensions)
    except ValueProblem as problem:
        return problem.message
    return None


def _require_dimensions(node: Node, known: Mapping[str, Dimension]) -> None:
    """Raise ValueProblem for different dimensions in any part of an expression."""
    dimension_of(node, known)
    for part in parts_of(node):
        _require_dimensions(part, known)
