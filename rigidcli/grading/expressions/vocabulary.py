"""The names that a question has: parameters, coordinates, momenta, velocities, and what is known of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.algebra.trees import to_tree
from rigidcli.document.parameters import read_name
from rigidcli.document.variables import momentum, velocity
from rigidcli.fields.dimensions import Dimension
from rigidcli.grading.asked import Asked
from rigidcli.grading.expressions.dimensions import declared, followed
from rigidcli.grading.expressions.formula import Domain, Vocabulary, draw, names_in, spellings
from rigidcli.language.tree import Node, bound, number

if TYPE_CHECKING:
    from rigidcli.document.document import Document
    from rigidcli.document.transform import Transform

TIME = "t"

POSITIVE: Domain = "positive"

ENERGIES = ("hamiltonian", "lagrangian")
"""Results that tell the dimensions of what they hold."""

TRIED = 100
"""Random points that tell what a change of variables leaves out, and where a key needs positive names."""

COORDINATE = re.compile(r"(x|y|z|q|theta|phi|psi|alpha)(_?\d+)?|p([a-z]?\d*|_\w+)|\w+dot")
"""Names that are usually coordinates, momenta and velocities, and as such of either sign."""


@dataclass(frozen=True, eq=False)
class Names:
    """The names of a question, and the values and dimensions of some of them, as far as they are known.

    `further` are new variables of a transformation, and names of the key that a document does not tell.
    Whether those that are `open` may be negative is told nowhere: they count as real. `meant` has what a
    document has for its parameters.
    """

    vocabulary: Vocabulary
    coordinates: tuple[str, ...] = ()
    momenta: tuple[str, ...] = ()
    velocities: tuple[str, ...] = ()
    further: tuple[str, ...] = ()
    values: Mapping[str, float] = field(default_factory=dict)
    dimensions: Mapping[str, Dimension] = field(default_factory=dict)
    open: frozenset[str] = frozenset()
    meant: Mapping[str, Node] = field(default_factory=dict)

    @cached_property
    def states(self) -> frozenset[str]:
        """All that changes while a system moves, but the time."""
        return frozenset((*self.coordinates, *self.momenta, *self.velocities, *self.further))


def names_of(asked: Asked, tree: Node) -> Names:
    """The names that an answer may have where this is the key.

    Parameters of a document are positive, unless they have another value; coordinates, momenta, velocities
    and the time are real. Of a literal key, what is not listed is real, unless the key needs it to be
    positive. What the `symbols` of the question say goes first. Which names a student is told does not
    depend on what the key holds.

    Raises ValueProblem for a name in the question that is none.
    """
    question, document = asked.question, asked.document
    used = sorted(names_in(tree))
    symbols = question.symbols or {}
    listed = {TIME if name == TIME else read_name(name): domain for name, domain in symbols.items()}
    coordinates, momenta, velocities = (
        tuple(map(read_name, names))
        for names in (question.coordinates, question.momenta, question.velocities)
    )
    values: dict[str, float] = {}
    domains: dict[str, Domain] = {}
    if document is not None:
        known = {name: document.arithmetic.value(value) for name, value in document.values.items()}
        values = {name: float(value) for name, value in known.items() if value is not None}
        domains |= {name: "positive" if values.get(name, 1) > 0 else "real" for name in document.definitions}
        if document.system is not None:
            coordinates = coordinates or document.system.coordinates
    of_momenta = asked.path[-1:] == ("hamiltonian",) or (bool(momenta) and not velocities)
    momenta = momenta or tuple(map(momentum, coordinates))
    velocities = velocities or tuple(map(velocity, coordinates))
    derived = {
        name: definition.root
        for name, definition in ({} if document is None else document.definitions).items()
        if definition is not None and definition.names and name not in listed
    }
    # Those of the transformation of a document, where its results are asked for.
    transform = None if document is None or "transform" not in asked.path else document.transform
    further = () if transform is None else transform.new_variables
    moving = (*coordinates, *momenta, *velocities, *further)
    told = document is not None or all(name in listed or name in moving for name in used)
    new = tuple(name for name in used if name not in (*domains, *listed, *moving, TIME))
    domains |= dict.fromkeys(new, "real")
    domains |= dict.fromkeys((*moving, TIME), "real")
    domains |= listed
    vocabulary = Vocabulary(
        {name: domain for name, domain in domains.items() if name not in derived},
        derived,
        spellings(domains, momenta, velocities),
        told,
        frozenset((*new, *(velocities if of_momenta else ()))),
    )
    positive = frozenset[str]() if transform is None else _never_negative(transform, vocabulary)
    unlisted = frozenset(name for name in new if document is None and not COORDINATE.fullmatch(name))
    positive |= _needed(tree, vocabulary, unlisted)
    return Names(
        replace(
            vocabulary, domains={**vocabulary.domains, **dict.fromkeys(positive - listed.keys(), POSITIVE)}
        ),
        coordinates,
        momenta,
        velocities,
        (*further, *(() if document is None else new)),
        values,
        _dimensions(asked, tuple(zip(coordinates, momenta, velocities, strict=False))),
        unlisted - positive,
        {} if document is None else _meant(document, values),
    )


def _needed(tree: Node, vocabulary: Vocabulary, names: frozenset[str]) -> frozenset[str]:
    """Names without whose being positive an expression has no value where it has one."""
    domains: dict[str, Domain] = {**vocabulary.domains, **dict.fromkeys(names, POSITIVE)}
    points = draw(replace(vocabulary, domains=domains), TRIED)
    has_value = points.roughly_at(tree).known
    turned = {name: points.but({name: -points.values[name]}).roughly_at(tree) for name in names}
    return frozenset(name for name, found in turned.items() if np.any(found.undefined & has_value))


def _meant(document: Document, values: Mapping[str, float]) -> dict[str, Node]:
    """What the parameters of a document stand for, without names."""
    meant: dict[str, Node] = {}
    for name, definition in document.definitions.items():
        if name in values:
            meant[name] = number(values[name]) if definition is None else bound(definition.root, meant)
    return meant


def _never_negative(transform: Transform, vocabulary: Vocabulary) -> frozenset[str]:
    """New variables that are not negative wherever the old and the new ones belong together, as an action."""
    points = draw(vocabulary, TRIED)
    known = {**(transform.old or {}), **(transform.new or {})}
    found = {name: points.at(expression.root) for name, expression in known.items()}
    has_values = np.all([each.known for each in found.values()], axis=0)
    if not has_values.any():
        return frozenset()
    new = {
        name: found[name].value if transform.old is None else points.values[name]
        for name in transform.new_variables
    }
    return frozenset(name for name, value in new.items() if np.all(value[has_values] >= 0))


def _dimensions(asked: Asked, motion: tuple[tuple[str, str, str], ...]) -> dict[str, Dimension]:
    """The dimensions of parameters, and of what moves where these follow from the energies of a system."""
    if asked.document is None or asked.report is None:
        return {}
    energies = (asked.report.get(name) for name in ENERGIES)
    return followed(
        declared(asked.document), [to_tree(energy) for energy in energies if energy is not None], TIME, motion
    )
