"""The dimensions of what a question names, and whether an expression adds what cannot be added.

Parameters have those of their units. Those of coordinates, and of parameters without a unit, often follow:
H and L are energies, the terms of a sum are alike, and what a sine is taken of is a pure number. So every
rule is a linear equation for the exponents of the base units. What has no single solution has no dimension.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.document.parameters import read_name
from rigidcli.errors import ValueProblem
from rigidcli.fields.dimensional_analysis import dimension_of
from rigidcli.fields.dimensions import DIMENSIONLESS, ENERGY, TIME, Dimension
from rigidcli.fields.typed_numbers import split_quantity
from rigidcli.fields.units import parse_unit
from rigidcli.grading.expressions.formula import names_in, parts_of, size_of
from rigidcli.language.tree import (
    Call,
    Constant,
    Name,
    Negative,
    Node,
    Number,
    Power,
    Product,
    Reciprocal,
    Sum,
)

if TYPE_CHECKING:
    from rigidcli.document.document import Document

MOST_NODES = 400
"""Of an expression whose dimensions are looked at."""

ROUNDING = 1e-9
"""Of exponents, which are small whole numbers."""


def mismatch(node: Node, known: Mapping[str, Dimension]) -> str | None:
    """What is wrong with the dimensions in an expression, as far as they are known."""
    if not known or size_of(node) > MOST_NODES:
        return None
    solver = _Solver([], known)
    solver.of(node)
    if not np.any(solver.rows):
        return None
    try:
        _require_dimensions(node, known)
    except ValueProblem as problem:
        return problem.message
    return None


def _require_dimensions(node: Node, known: Mapping[str, Dimension]) -> None:
    """Raise ValueProblem for different dimensions in any part of an expression."""
    dimension_of(node, known)
    for part in parts_of(node):
        _require_dimensions(part, known)


def declared(document: Document) -> dict[str, Dimension]:
    """The parameters that have a unit, or follow from such."""
    raw = {read_name(name): value for name, value in (document.parameters or {}).items()}
    known: dict[str, Dimension] = {}
    for name, definition in document.definitions.items():
        value = raw.get(name)
        quantity = split_quantity(value) if isinstance(value, str) else None
        with suppress(ValueProblem):  # also of what follows a number and is no unit
            if definition is not None and definition.names:
                dimension = dimension_of(definition.root, known)
            else:
                dimension = None if quantity is None else parse_unit(quantity.unit).dimension
            known |= {} if dimension is None else {name: dimension}
    return known


def followed(
    known: Mapping[str, Dimension],
    energies: Iterable[Node],
    time: str,
    motion: Sequence[tuple[str, str, str]],
) -> dict[str, Dimension]:
    """The `known` dimensions, and those that follow from expressions of energies.

    `motion` has triples of a coordinate, its momentum and its velocity. The known ones alone are left where
    the energies contradict them: numbers without a unit may stand in them.
    """
    energies = [node for node in energies if size_of(node) <= MOST_NODES]
    if not known or not energies:
        return dict(known)
    moving = {name for names in motion for name in names}
    used = frozenset().union(*map(names_in, energies)) - known.keys() - moving - {time}
    unknown = [*(coordinate for coordinate, _, _ in motion), *sorted(used)]
    solver = _Solver(unknown, {**known, time: TIME})
    for coordinate, momentum, velocity in motion:
        solver.forms[velocity] = solver.forms[coordinate] - solver.forms[time]
        solver.forms[momentum] = solver.pure(ENERGY) - solver.forms[velocity]
    for node in energies:
        solver.require(solver.of(node), solver.pure(ENERGY))
    return {**solver.solved(), **known}


class _Solver:
    """Dimensions as linear forms in those that are not known: their exponents, then those of base units."""

    def __init__(self, unknown: Sequence[str], known: Mapping[str, Dimension]) -> None:
        self.n = len(unknown)
        self.zero = np.zeros(self.n + len(DIMENSIONLESS))
        self.forms = {name: self.pure(dimension) for name, dimension in known.items()}
        self.forms |= dict(zip(unknown, np.eye(self.n, len(self.zero)), strict=True))
        self.rows: list[Floats] = [self.zero]

    def pure(self, dimension: Dimension) -> Floats:
        """A dimension that is known; angles and cycles count as numbers here."""
        return np.append(np.zeros(self.n), dimension._replace(angle=0, cycle=0))

    def require(self, one: Floats | None, other: Floats | None) -> None:
        """Let two dimensions be the same; None may be any."""
        if one is not None and other is not None:
            self.rows.append(one - other)

    def of(self, node: Node) -> Floats | None:
        """The dimension of an expression; None where it may be any, as that of a plain number."""
        match node:
            case Name(name):
                return self.forms.get(name)
            case Negative(operand) | Call("abs", (operand,)):
                return self.of(operand)
            case Reciprocal(operand):
                return self.power(operand, -1.0)
            case Power(base, Number(_, exponent)):
                return self.power(base, exponent)
            case Power(base, Negative(Number(_, exponent))):
                return self.power(base, -exponent)
            case Power(base, exponent):
                self.of(base)
                self.require(self.of(exponent), self.zero)
            case Call("sqrt", (operand,)):
                return self.power(operand, 0.5)
            case Sum(terms) | Call("atan2", terms):
                alike = [form for form in map(self.of, terms) if form is not None]
                for form in alike[1:]:
                    self.require(form, alike[0])
                return alike[0] if alike and isinstance(node, Sum) else None
            case Product(factors):
                return self.product(factors)
            case Call(function, (operand,)):
                argument = self.of(operand)
                self.require(argument, None if function == "sign" else self.zero)
        return None

    def power(self, base: Node, exponent: float) -> Floats | None:
        form = self.of(base)
        return None if form is None else exponent * form

    def product(self, factors: Sequence[Node]) -> Floats | None:
        forms = [self.of(factor) for factor in factors]
        if any(form is None and not _is_number(each) for form, each in zip(forms, factors, strict=True)):
            return None
        found = [form for form in forms if form is not None]
        return np.sum(found, axis=0) if found else None

    def solved(self) -> dict[str, Dimension]:
        """What follows for the forms; nothing where there is a contradiction."""
        rows = np.array(self.rows)
        left, right = rows[:, : self.n], -rows[:, self.n :]
        found, *_ = np.linalg.lstsq(left, right, rcond=None)
        if not np.allclose(left @ found, right, rtol=0, atol=ROUNDING):
            return {}
        free = np.eye(self.n) - np.linalg.pinv(left) @ left
        dimensions: dict[str, Dimension] = {}
        for name, form in self.forms.items():
            exponents = form[: self.n] @ found + form[self.n :]
            whole = np.rint(exponents)
            determined = np.allclose(form[: self.n] @ free, 0, rtol=0, atol=ROUNDING)
            if determined and np.allclose(exponents, whole, rtol=0, atol=ROUNDING):
                dimensions[name] = Dimension(*map(int, whole))
        return dimensions


def _is_number(node: Node) -> bool:
    """Whether a factor is a pure number in any case, such as the 2 of 2*a and the sine of R*sin(theta)."""
    match node:
        case Number() | Constant():
            return True
        case Call(function, _):
            return function not in ("sqrt", "abs") or all(map(_is_number, parts_of(node)))
    parts = parts_of(node)
    return bool(parts) and all(map(_is_number, parts))
