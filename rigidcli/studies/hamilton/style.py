"""Results in the style of the document: decimals where it has some, and sums in the order that it has."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from rigidcli.algebra.expressions import Expr, total
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.trees import Style, is_even, to_tree
from rigidcli.document.document import Document
from rigidcli.language.tree import Formula, Negative, Power, Sum, nodes
from rigidcli.report import Field
from rigidcli.studies.hamilton.system import derived_parameters

DECIMAL = re.compile(r"\.\d|\de-")
"""What the text of a decimal has, and no other part of an expression."""


def style_of(document: Document) -> Style:
    """How a document is typed: decimals (unless results are exact), sums, and the order of coordinates."""
    decimal = not document.exact_results and DECIMAL.search(repr(document.system)) is not None
    coordinates = () if document.system is None else document.system.coordinates
    return Style(decimal, tuple(_typed_sums(document).items()), coordinates)


def as_typed(fields: Iterable[Field], document: Document) -> list[Field]:
    """Write results in the style of the document."""
    style = style_of(document)
    return [_styled(entry, style) for entry in fields]


def _typed_sums(document: Document) -> dict[Sum, Sum]:
    """Sums under even powers, as the algebra orders their terms, by the order in which they are typed."""
    system, sums = document.system, dict[Sum, Sum]()
    assert system is not None
    values = derived_parameters(document)
    written = [system.lagrangian, system.kinetic, system.potential, system.hamiltonian]
    written += [particle.potential for particle in system.particles or ()]
    for part in nodes(e.root for e in written if e is not None):
        if isinstance(part, Power) and isinstance(part.base, Sum) and is_even(part.exponent):
            terms = [from_tree(term, values) for term in part.base.terms]
            typed, square = Sum(tuple(map(to_tree, terms))), to_tree(total(terms) ** 2)
            if isinstance(square, Power) and isinstance(square.base, Sum) and _has_terms(square.base, typed):
                sums.setdefault(square.base, typed)
    for root in (equation.expression.root for equation in (system.constraints or {}).values()):
        if isinstance(root, Sum):
            terms = [from_tree(term, values) for term in root.terms]
            whole, typed = to_tree(total(terms)), Sum(tuple(map(to_tree, terms)))
            if isinstance(whole, Sum) and {*whole.terms} == {*typed.terms}:
                sums.setdefault(whole, typed)
    return sums


def _has_terms(written: Sum, typed: Sum) -> bool:
    """Whether one sum has the terms of the other in another order, or their negatives, the first positive."""
    if isinstance(typed.terms[0], Negative):
        return False
    return {*written.terms} in ({*typed.terms}, {-term for term in typed.terms})


def _styled(entry: Field, style: Style) -> Field:
    """A result in a style, which reaches the expressions inside its lists, objects and arrays."""

    def changed(value: Any) -> Any:
        match value:
            case Expr():
                return value.styled(replace(style, decimal=style.decimal or value.style.decimal))
            case Formula(exact=True):
                return replace(value, root=replace(style, coordinates=()).of(value.root))
            case list():
                return list(map(changed, value))
            case dict():
                return {key: changed(inner) for key, inner in value.items()}
            case np.ndarray() if value.dtype == object:
                return np.array([*map(changed, value.flat)], dtype=object).reshape(value.shape)
            case _:
                return value

    return replace(entry, value=changed(entry.value))
