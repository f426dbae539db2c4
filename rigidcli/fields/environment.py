"""The environment in which numbers are read: parameters, and the kind of arithmetic to use."""

from __future__ import annotations

import pathlib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any

from rigidcli.core.arithmetic import FLOAT, Arithmetic, Scalar
from rigidcli.errors import LONGEST_SHOWN, UNSETTLED, ExpressionError, ValueProblem, nearest, shown
from rigidcli.fields.dimensional_analysis import dimension_of
from rigidcli.fields.dimensions import Dimension, check_dimension
from rigidcli.fields.typed_numbers import (
    exact_text,
    finite,
    number_of,
    number_or_text,
    quantity_meant,
    split_quantity,
)
from rigidcli.fields.units import Unit, is_unit, parse_unit
from rigidcli.fields.words import variable_called
from rigidcli.language.expression import Expression, parse
from rigidcli.language.tree import UnknownFunction

LONGEST_LIST = 20
"""The most names that a message lists: two lines of them."""


@dataclass(frozen=True, slots=True)
class Formula:
    """An expression in variables, and the values of the parameters that it uses."""

    expression: Expression
    constants: Mapping[str, Scalar]


@dataclass
class Environment:
    """Parameters by name, the arithmetic to use, and what was noticed while numbers were read.

    `definitions` has the values of parameters as they are written, after the parameters that they use;
    `dimensions` the dimensions of parameters with units; `declared` the names of all parameters, also
    before they have their values; `broken` the parameters that have a problem of their own, so that an
    expression in them is not reported again; `refused` the keys of parameters that are no names;
    `positive` the symbols in places where only a positive number makes sense.

    `open` has the parameters without a value, with the symbols on which they depend. `faults` has the errors
    in parameters that show in other parts of the document. `exact_results` says whether exact results are
    wanted, be numbers read as floats or not; `top_keys` are the keys at the top of the document. `files` are
    the files that the document names. `coordinates` are the coordinates of the system, once they are read
    without a problem, and `functions` its unknown functions and their derivatives by name.
    """

    arithmetic: Arithmetic = FLOAT
    parameters: dict[str, Scalar] = field(default_factory=dict)
    definitions: dict[str, Any] = field(default_factory=dict)
    dimensions: dict[str, Dimension] = field(default_factory=dict)
    folder: str = ""
    used: set[str] = field(default_factory=set)
    declared: set[str] = field(default_factory=set)
    broken: set[str] = field(default_factory=set)
    refused: set[str] = field(default_factory=set)
    positive: set[str] = field(default_factory=set)
    open: dict[str, frozenset[str]] = field(default_factory=dict)
    faults: dict[str, ValueProblem] = field(default_factory=dict)
    exact_results: bool = False
    top_keys: Sequence[str] = ()
    coordinates: tuple[str, ...] | None = None
    functions: Mapping[str, UnknownFunction] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    files: list[pathlib.Path] = field(default_factory=list)

    def copied(self) -> Environment:
        """The same environment, in which more of a document may be read without a trace in this one."""
        return replace(
            self, used={*self.used}, faults={**self.faults}, notes=[*self.notes], files=[*self.files]
        )

    def file(self, name: str) -> pathlib.Path:
        """The path of a file that the document names, which is taken note of."""
        path = pathlib.Path(self.folder, name)
        self.files.append(path)
        return path

    def read(self, raw: object, dimension: Dimension | None) -> Any:
        """The SI value of a number, a quantity such as `5 cm`, or an expression in the parameters.

        A unit must fit `dimension`; any unit fits if that is None. Raises ValueProblem.
        """
        scalar = number_or_text(raw, number_of(dimension))
        if not isinstance(scalar, str):
            return _exact(parse(str(scalar)), {}) if self.arithmetic.exact else finite(scalar)
        quantity = self._quantity(scalar, dimension)
        if quantity is None:
            try:
                return self._value(parse(scalar), dimension)
            except ExpressionError as error:
                cure = quantity_meant(scalar)
                if cure is not None and self.declared.isdisjoint(cure.partition(" ")[2].split("^")):
                    error.hint = f"write `{cure}`"
                raise
        digits, unit = quantity
        if self.arithmetic.exact:
            return _exact(parse(digits), {}) * unit.factor * self.arithmetic.pi**unit.pi_power
        return _in_si(digits, unit)

    def _quantity(
        self, text: str, dimension: Dimension | None, variables: tuple[str, ...] = ()
    ) -> tuple[str, Unit] | None:
        """The number and the unit of a text such as `5 cm`; None for an expression.

        In `2 a` and `2a` the letter may be a unit and a parameter. The dimension decides which. If both
        fit, it is a unit after a blank, and else a parameter, which is noted. A variable is no unit.
        Raises ValueProblem for other texts, and for a unit of another dimension.
        """
        if any(re.search(rf"(?<!\w){re.escape(key)}(?!\w)", text) for key in self.refused):
            raise ValueProblem("it uses a parameter that is no name", code=UNSETTLED)
        written = split_quantity(text)
        if written is None:
            return None
        names = _names_in(written.unit, tuple(self.functions.values()))
        is_declared = names is not None and names.difference(variables) <= self.declared
        # A name that is neither declared nor a unit is misspelt; the others say which one is meant.
        is_meant = is_declared or (names is not None and not names.isdisjoint(self.declared.union(variables)))
        if is_meant and not (names and all(map(is_unit, names))):
            return None
        try:
            unit = _unit(written.unit, dimension)
        except ValueProblem:
            if is_declared:
                return None
            raise
        if names is None or not is_declared:
            return written.digits, unit
        if not names.isdisjoint(variables):
            return None
        digits, letters, touches = written
        note = f"{shown(f'{digits} {letters}')} has a unit; for the parameter write `{digits}*{letters}`"
        if touches:
            note = f"{shown(digits + letters)} is a product; for the unit write `{digits} {letters}`"
        if note not in self.notes:
            self.notes.append(note)
        return None if touches else (digits, unit)

    def symbolic(
        self, raw: object, dimension: Dimension | None = None, variables: tuple[str, ...] = ()
    ) -> Expression:
        """A number, a quantity or an expression as an expression, in which names stay names.

        A quantity, whose unit must fit `dimension`, becomes the SI number that it is, digit by digit.
        Names of `variables` are no units. `admit` says whether the names in the expression are allowed.
        Raises ValueProblem.
        """
        scalar = number_or_text(raw, "a number or an expression")
        if not isinstance(scalar, str):
            finite(scalar)
            return parse(str(scalar))
        quantity = self._quantity(scalar, dimension, variables)
        if quantity is None:
            return parse(scalar, self.functions)
        digits, unit = quantity
        number = Fraction(repr(finite(digits)))
        unit.si(number)
        return parse(exact_text(number * unit.factor, unit.pi_power))

    def admit(
        self, expression: Expression, variables: tuple[str, ...], dimension: Dimension | None = None
    ) -> None:
        """Note that the parameters in a symbolic expression, which may use `variables`, are used.

        Raises ValueProblem for a name that is not declared, and for dimensions that cannot be.
        """
        names = expression.names.difference(variables)
        self._use(names, variables)
        if not names & self.broken:
            self._check_dimension(expression, dimension)

    def _check_dimension(self, expression: Expression, dimension: Dimension | None) -> None:
        if expression.names & self.dimensions.keys():
            given = dimension_of(expression.root, self.dimensions)
            if dimension is not None and given is not None and any(given):
                check_dimension(expression.text, given, dimension)

    def value(self, expression: Expression) -> float | None:
        """The value of a symbolic expression, if it follows from the parameters. Raises ValueProblem."""
        settled = self.parameters.keys() - self.broken - self.open.keys()
        return self.arithmetic.value(self._value(expression, None)) if expression.names <= settled else None

    def formula(self, raw: object, dimension: Dimension, variables: tuple[str, ...]) -> Formula:
        """A number, a quantity, or an expression in `variables` and the parameters. Raises ValueProblem."""
        if not isinstance(raw, str) or self._quantity(raw, dimension, variables) is not None:
            return Formula(parse("value"), {"value": self.read(raw, dimension)})
        expression = parse(raw)
        inside = expression.names & set(variables)
        for name in sorted(inside & self.declared):
            raise ExpressionError(
                f"`{name}` is a parameter, and a variable of the motion", hint="rename the parameter"
            )
        self._use(expression.names - inside, variables)
        if not inside:
            return Formula(parse("value"), {"value": self._value(expression, dimension)})
        constants = expression.names - inside - self.broken - self._without_value(expression.names)
        return Formula(expression, {name: self.parameters[name] for name in sorted(constants)})

    def names_in(self, raw: object, variables: tuple[str, ...] = ()) -> frozenset[str]:
        """The names that a value uses as it is written; `variables` are no units. Raises ValueProblem."""
        is_expression = isinstance(raw, str) and self._quantity(raw, None, variables) is None
        return parse(str(raw)).names if is_expression else frozenset()

    def dimension(self, raw: object) -> Dimension | None:
        """The dimension of a value as it is written; None where it may be any."""
        if not isinstance(raw, str):
            return None
        quantity = self._quantity(raw, None)
        return quantity[1].dimension if quantity else dimension_of(parse(raw).root, self.dimensions)

    def _value(self, expression: Expression, dimension: Dimension | None) -> Any:
        self._use(expression.names)
        if expression.names & self.broken or self._without_value(expression.names):
            raise ValueProblem("a parameter in it has a problem", code=UNSETTLED)
        self._check_dimension(expression, dimension)
        if self.arithmetic.exact:
            return _exact(expression, self.parameters)
        used = {name: value for name, value in self.parameters.items() if name in expression.names}
        return expression.evaluate(used)

    def _without_value(self, names: frozenset[str]) -> frozenset[str]:
        """The parameters among `names` that lack the value that a number needs; they are noted as faults."""
        if self.arithmetic.exact:
            return frozenset()
        missing = names & self.open.keys()
        for symbol in frozenset[str]().union(*(self.open[name] for name in missing)):
            self.faults[symbol] = ValueProblem("missing: a number in the document needs its value")
        return missing

    def _use(self, names: Iterable[str], variables: tuple[str, ...] = ()) -> None:
        """Note that parameters are used. Raises ExpressionError, which lists `variables`, for other names."""
        unknown = sorted(set(names) - self.declared)
        if unknown:
            raise self._undeclared(unknown, variables)
        self.used |= set(names)

    def assume_positive(self, value: Any) -> None:
        """Note that the document makes sense only if `value`, whose sign is open, is positive."""
        name = str(value)
        if name in value.names:
            self.positive.add(name)

    @cached_property
    def _declared_in_order(self) -> list[str]:
        return sorted(self.declared)

    def _undeclared(self, names: list[str], variables: tuple[str, ...]) -> ValueProblem:
        spelled = {name: meant for name in names if (meant := variable_called(name, variables))}
        near = spelled.get(names[0])
        if not spelled:
            near = nearest(names[0], [*variables, *self._declared_in_order])
        also = f"; variables here: {_listed(variables, str)}" if variables else ""
        if len(names) > 1:
            also += "".join(f"; `{name}` is spelled `{meant}`" for name, meant in spelled.items())
        new = [name for name in names if name not in (*spelled, "dt") and len(name) <= LONGEST_SHOWN]
        values = ", ".join(f"{name}: null" for name in new[:LONGEST_LIST])
        if values and near is None:
            also += f"; a symbol, or a name for a value, is declared by `parameters: {{{values}}}`"
        if is_unit(names[0]):
            also += f"; a quantity in {shown(names[0])} stands alone, or is a parameter"
        return ExpressionError(
            f"undeclared name{'s' if len(names) > 1 else ''} {_listed(names)}"
            f"{f' (did you mean {near}?)' if near else ''}",
            hint=f"declared parameters: {_listed(self._declared_in_order)}{also}",
        )


def arithmetic_for(exact: bool) -> Arithmetic:
    """Exact arithmetic, which is loaded where it is needed, or that of floats."""
    if not exact:
        return FLOAT
    from rigidcli.algebra.arithmetic import EXACT

    return EXACT


@lru_cache(maxsize=4096)
def _in_si(digits: str, unit: Unit) -> float:
    """The float nearest to a quantity: through the shortest decimal, so that 120 g cm^2 is 1.2e-5 kg m^2."""
    return unit.si(Fraction(repr(finite(digits))))


@lru_cache(maxsize=1024)
def _unit(text: str, dimension: Dimension | None) -> Unit:
    """The unit of this text, which must fit the dimension. Raises ValueProblem."""
    unit = parse_unit(text)
    if dimension is not None:
        check_dimension(unit.text, unit.dimension, dimension)
    return unit


@lru_cache(maxsize=1024)
def _names_in(text: str, functions: tuple[UnknownFunction, ...]) -> frozenset[str] | None:
    """The names in a text that may be a unit, read as an expression; None where it is no expression."""
    try:
        return parse(text, {str(function): function for function in functions}).names
    except ExpressionError:
        return None


def _exact(expression: Expression, values: Mapping[str, Any]) -> Any:
    """The exact value of an expression, from the exact `values` of its names."""
    from rigidcli.algebra.arithmetic import worked_out

    return worked_out(expression.root, values)


def _listed(names: Sequence[str], show: Callable[[str], str] = shown) -> str:
    """At most LONGEST_LIST names, for a message."""
    more = f" and {len(names) - LONGEST_LIST} more" if len(names) > LONGEST_LIST else ""
    return (", ".join(map(show, names[:LONGEST_LIST])) or "none") + more
