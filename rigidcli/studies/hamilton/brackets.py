"""The working of a change of variables: its fundamental brackets, each worked out, and H in new variables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations, islice

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.simplification import tidy
from rigidcli.document.document import Document
from rigidcli.language.formula import Formula
from rigidcli.language.text import latex_name, reading
from rigidcli.language.tree import Negative, Node, Product
from rigidcli.mechanics.hamilton_equations import Phase
from rigidcli.report import Field, Step
from rigidcli.studies.hamilton.transform import TransformedSystem, given_side
from rigidcli.studies.steps.writing import total

MOST_BRACKETS = 6
"""Brackets that are worked out: all of two pairs of variables, of which further ones follow the same rule."""

LONGEST = 300
"""The longest sum of products that is shown, in characters: a longer one teaches nothing."""


def transform_steps(
    document: Document, found: TransformedSystem, old: Phase, fields: Sequence[Field]
) -> Iterator[Step]:
    """The way to the verdict on a change of variables, and to H in the new ones."""
    assert document.transform is not None
    values, pairs, phase = given_side(document, document.transform, old)
    for (a, b), (name, result) in islice(
        zip(combinations(pairs.names, 2), found.brackets.items(), strict=True), MOST_BRACKETS
    ):
        slopes = {(x, y): tidy(derivative(values[x], y)) for x in (a, b) for y in phase.names}
        shown = [
            Field("", e, f"d{x}/d{y}", rf"\partial {latex_name(x)}/\partial {latex_name(y)}")
            for (x, y), e in slopes.items()
            if not e.is_zero
        ]
        terms = list[Node]()
        for q, p in zip(phase.coordinates, phase.momenta, strict=True):
            terms += _product(slopes[a, q], slopes[b, p])
            terms += map(Negative, _product(slopes[a, p], slopes[b, q]))
        whole = total(terms)
        sign = rf"\{name[:-1]}\}}"
        if len(reading(whole)) <= LONGEST:
            shown.append(Field("", Formula(whole, exact=True), name, sign))
        if reading(whole) != reading(result.tree()):
            shown.append(Field("", result, name, sign))
        yield Step(
            f"Bracket {name}",
            f"The bracket of A and B is the sum of dA/dq dB/dp - dA/dp dB/dq, here over the pairs of "
            f"{' and '.join(phase.names)}. The change is canonical only if this one is "
            f"{found.canonical[name]}.",
            tuple(shown),
        )
    shown = [
        replace(entry, key="", title=entry.title.strip() or entry.key.rpartition(".")[2], cells={})
        for entry in fields
        if entry.key == "transform.hamiltonian" or entry.key.startswith("transform.equations.")
    ]
    if found.hamiltonian is not None:
        yield Step(
            "Hamiltonian in the new variables",
            "The old variables are put into H as functions of the new ones; where the change holds the time, "
            "the function that makes the new variables move at fixed old ones is added. Its derivatives are "
            "the new equations.",
            tuple(shown),
        )


def _product(first: Expr, second: Expr) -> list[Node]:
    """The product of two derivatives as it is before it is worked out; nothing where one is zero."""
    if first.is_zero or second.is_zero:
        return []
    return [Product((first.tree(), second.tree()))]
