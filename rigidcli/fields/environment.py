"""The environment in which numbers are read: parameters, and the kind of arithmetic to use.

A document of plain numbers loads neither the units nor the reader of expressions.
"""

from __future__ import annotations

import math
import pathlib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, Union

from rigidcli.core.arithmetic import FLOAT, Arithmetic, Scalar
from rigidcli.errors import (
    LONGEST_SHOWN,
    MOST_LISTED,
    UNSETTLED,
    ExpressionError,
    ValueProblem,
    first_few,
    shown,
)
from rigidcli.fields.dimensions import Dimension, check_dimension, dimension_of, number_of
from rigidcli.fields.words import SYMBOLIC, variable_called
from rigidcli.suggestions import did_you_mean, nearest

if TYPE_CHECKING:
    from rigidcli.fields.units import Unit
    from rigidcli.language.expression import Expression
    from rigidcli.language.tree import UnknownFunction
    from rigidcli.language.words import Words


class Amount(NamedTuple):
    """A number or a quantity: the number as it is typed, and the unit; None for a number alone."""

    number: str | float | Decimal
    unit: Unit | None = None


Typed: TypeAlias = Union[Amount, "Expression"]  # a number, a quantity or an expression in a document


@dataclass(frozen=True, slots=True)
class BoundExpression:
    """An expression in variables, with the values of the parameters in it."""

    expression: Expression
    constants: Mapping[str, Scalar]


@dataclass(slots=True)
class Parameter:
    """A parameter as it is `typed` (None for a symbol), with its value and dimension if they are known.

    `symbols` are the parameters without a value on which it depends. A parameter `is_broken` that has a
    problem, or is not read yet: what uses it is not reported as well.
    """

    typed: Typed | None = None
    value: Any = None
    dimension: Dimension | None = None
    symbols: frozenset[str] = frozenset()
    is_broken: bool = True


@dataclass
class SystemNames:
    """The names of the system in the document: the `coordinates`, once they are read without a problem, what
    each name means in words, and the unknown functions and their derivatives."""

    coordinates: tuple[str, ...] | None = None
    meanings: dict[str, str] = field(default_factory=dict)
    functions: Mapping[str, UnknownFunction] = field(default_factory=dict)


@dataclass
class Log:
    """What was noticed while a document was read: notes for the user, the files that it names, and `faults`,
    the problems of parameters that show in other parts of the document."""

    notes: list[str] = field(default_factory=list)
    faults: dict[str, ValueProblem] = field(default_factory=dict)
    files: list[pathlib.Path] = field(default_factory=list)

    def note(self, *notes: str) -> None:
        """Add notes, each once."""
        self.notes += [note for note in dict.fromkeys(notes) if note not in self.notes]


@dataclass
class Environment:
    """What the numbers of a document are read with: the parameters and the arithmetic; `names` and a `log`.

    `places` returns the sections that have a key, "" being the top of the document. Exact results may be
    wanted while numbers are floats. Names of files are relative to the `folder`.

    `declared` are the parameters, each after those that it uses; `alphabetical` lists their names. `nameless`
    are keys of parameters that are no names. Something uses the parameters in `used`. `words` are the known
    names, by the variables.
    """

    arithmetic: Arithmetic = FLOAT
    folder: str = ""
    exact_results: bool = False
    places: Callable[[], Mapping[str, Sequence[str]]] = dict
    declared: dict[str, Parameter] = field(default_factory=dict)
    alphabetical: Sequence[str] = ()
    nameless: set[str] = field(default_factory=set)
    used: set[str] = field(default_factory=set)
    names: SystemNames = field(default_factory=SystemNames)
    log: Log = field(default_factory=Log)
    words: dict[tuple[str, ...], Words] = field(default_factory=dict)

    def declare(self, names: Iterable[str]) -> None:
        """Begin anew with these parameters, none of which is read yet."""
        self.declared = {name: Parameter() for name in names}
        self.alphabetical = sorted(self.declared)
        self.words = {}

    def copied(self) -> Environment:
        """A copy, so that reading more does not change this one."""
        log = Log([*self.log.notes], {**self.log.faults}, [*self.log.files])
        return replace(self, used={*self.used}, log=log)

    def file(self, name: str) -> pathlib.Path:
        """The path of a file that the document names, which is taken note of."""
        path = pathlib.Path(self.folder, name)
        self.log.files.append(path)
        return path

    # --- what is typed

    def typed(
        self, raw: object, dimension: Dimension | None = None, variables: tuple[str, ...] = ()
    ) -> Typed:
        """A number, a quantity such as `5 cm`, or an expression in the `variables` and parameters.

        A unit must fit `dimension`; any unit fits if that is None. Raises ValueProblem.
        """
        if isinstance(raw, str):
            return self._of_text(raw, dimension, variables)
        if isinstance(raw, bool) or not isinstance(raw, float | int | Decimal):
            expected = "a number or an expression" if variables else number_of(dimension)
            raise ValueProblem(f"read {shown(raw)}, expected {expected}")
        finite(raw)
        return Amount(raw)

    def _of_text(self, text: str, dimension: Dimension | None, variables: tuple[str, ...]) -> Typed:
        from rigidcli.fields.units import quantity_meant, without_separators
        from rigidcli.language.expression import parse

        words = self._words(variables)
        number = text.casefold().lstrip("+-")
        if number in ("nan", "inf", "infinity") and words.meaning(text) is None:
            raise ValueProblem(f"read {shown(text)}, expected a finite number")
        if marked := re.fullmatch(r"\s*([-+]?[\d.]+)\s*(?:(\"|\u201d|'')|['\u2019])\s*", text):
            inches, feet = ("in", "inches", "arcsec", "seconds"), ("ft", "feet", "arcmin", "minutes")
            units = inches if marked[2] else feet
            hint = "write `{0} {1}` for {2}, `{0} {3}` for {4} of arc".format(marked[1], *units)
            raise ValueProblem(f"read {shown(text)}, expected the name of a unit", hint=hint)
        several = without_separators(text)
        text = several[0] if len(several) == 1 else text
        amount = self._amount(text, dimension, variables)
        if amount is not None:
            return amount

        def is_known(reading: Expression) -> bool:
            return all(words.meaning(name) for name in reading.names)

        def fits(reading: Expression) -> bool:
            try:
                if is_known(reading):
                    self._check_dimension(reading, dimension)
                    return True
            except ValueProblem:
                pass
            return False

        functions = None if self.names.coordinates is None else self.names.functions
        expression = parse(text, functions, words, fits)
        cure = None if is_known(expression) else quantity_meant(text)
        if cure is not None and self.declared.keys().isdisjoint(cure.partition(" ")[2].split("^")):
            hint = f"write `{cure}`"
            raise ExpressionError(f"read {shown(text)}, expected a decimal number and a unit", hint=hint)
        return expression

    def _amount(self, text: str, dimension: Dimension | None, variables: tuple[str, ...]) -> Amount | None:
        """The number and the unit of a text such as `5 cm`; None for an expression.

        What stands behind the number may be a unit, or names of the document:

        | behind the number                     | read as                                              |
        |---------------------------------------|------------------------------------------------------|
        | no expression                         | a unit; an expression if it has names of the document |
        | only names that are unknown           | a unit                                               |
        | a name that is known and no unit      | an expression                                        |
        | known names, a unit that does not fit | an expression                                        |
        | known names, a unit that fits         | in `2 a` a unit, in `2a` a product, with a note;     |
        |                                       | an expression if one is a variable                   |

        Raises ValueProblem for what is read as a unit, and is none or does not fit.
        """
        from rigidcli.fields.units import is_unit, split_quantity, unit_of

        keys = (re.escape(key) for key in self.nameless if key in text)
        if any(re.search(rf"(?<!\w){key}(?!\w)", text) for key in keys):
            raise ValueProblem("it uses a parameter whose name is refused", code=UNSETTLED)
        written = split_quantity(text)
        if written is None:
            return None
        digits, letters, touches = written
        names = _names_in(letters, tuple(self.names.functions.values()))
        meaning = self._words(variables).meaning
        unknown = frozenset(name for name in names or () if meaning(name) is None)
        if names is not None and not (names and (unknown == names or all(map(is_unit, names)))):
            return None
        try:
            unit = unit_of(letters, dimension)
        except ValueProblem:
            if unknown or (names is None and not any(map(meaning, re.findall(r"[^\W\d]\w*", letters)))):
                raise
            return None
        if names is None or unknown:
            return Amount(digits, unit)
        if not names.isdisjoint(variables):
            return None
        note = f"{shown(f'{digits} {letters}')} has a unit; for the parameter write `{digits}*{letters}`"
        if touches:
            note = f"{shown(digits + letters)} is a product; for the unit write `{digits} {letters}`"
        self.log.note(note)
        return None if touches else Amount(digits, unit)

    def _words(self, variables: tuple[str, ...]) -> Words:
        """The names of the document for the reader, which takes an unknown name whole."""
        if variables not in self.words:
            from rigidcli.language.words import Words

            self.words[variables] = Words((*self.declared, *variables), is_open=True)
        return self.words[variables]

    # --- its value

    def read(self, raw: object, dimension: Dimension | None) -> Any:
        """The SI value of a number, a quantity, or an expression in the parameters. Raises ValueProblem."""
        if isinstance(raw, Decimal | float | int) and not (isinstance(raw, bool) or self.arithmetic.exact):
            return finite(raw)  # most numbers of a document, which are read anew at each point of a sweep
        return self.worked(self.typed(raw, dimension), dimension)

    def worked(self, typed: Typed, dimension: Dimension | None) -> Any:
        """The SI value of a number, quantity or expression: a float, or exact. Raises ValueProblem."""
        exact = self.arithmetic.exact
        if isinstance(typed, Amount):
            number, unit = typed
            if not exact:
                return float(number) if unit is None else _in_si(str(number), unit)
            from rigidcli.algebra.arithmetic import worked_out
            from rigidcli.language.expression import parse

            value: Any = worked_out(parse(str(number)).root, {})
            return value if unit is None else value * unit.factor * self.arithmetic.pi**unit.pi_power
        names = typed.names
        self._use(names)
        if any(self.declared[name].is_broken for name in names) or self._without_value(names):
            raise ValueProblem("a parameter in it has a problem", code=UNSETTLED)
        self._check_dimension(typed, dimension)
        values = {name: self.declared[name].value for name in names}
        if not exact:
            return typed.evaluate(values)
        from rigidcli.algebra.arithmetic import worked_out

        return worked_out(typed.root, values)

    def symbolic(
        self, raw: object, dimension: Dimension | None = None, variables: tuple[str, ...] | None = ()
    ) -> Expression:
        """A number, a quantity or an expression in `variables` and parameters, in which names stay names.

        With None for the variables, any names may stand in it. Raises ValueProblem.
        """
        typed = self.typed(raw, dimension, variables or ())
        if variables is not None:
            self.admit(typed, dimension, variables)
        return self.written(typed)

    def admit(self, typed: Typed, dimension: Dimension | None, variables: tuple[str, ...] = ()) -> None:
        """Note the parameters that an expression uses, which keeps their names.

        Raises ValueProblem for names that are neither parameters nor `variables`, and for wrong dimensions.
        """
        parameters = names_of(typed).difference(variables)
        self._use(parameters, variables)
        if not any(self.declared[name].is_broken for name in parameters):
            self._check_dimension(typed, dimension)

    def written(self, typed: Typed) -> Expression:
        """A number, quantity or expression as an expression; a quantity becomes its exact SI number."""
        from rigidcli.fields.units import exact_text
        from rigidcli.language.expression import parse

        if not isinstance(typed, Amount):
            return typed
        if typed.unit is None:
            return parse(str(typed.number))
        number = Fraction(repr(finite(typed.number)))
        typed.unit.si(number)  # which may be beyond all floats
        return parse(exact_text(number * typed.unit.factor, typed.unit.pi_power))

    def value(self, expression: Expression) -> float | None:
        """The value of a symbolic expression, if it follows from the parameters. Raises ValueProblem."""
        parameters = [self.declared.get(name) for name in expression.names]
        if any(each is None or each.is_broken or each.symbols for each in parameters):
            return None
        return self.arithmetic.value(self.worked(expression, None))

    def formula(self, raw: object, dimension: Dimension, variables: tuple[str, ...]) -> BoundExpression:
        """A number, a quantity, or an expression in `variables` and the parameters. Raises ValueProblem."""
        typed = self.typed(raw, dimension, variables)
        inside = names_of(typed) & {*variables}
        parameters = names_of(typed) - inside
        for name in sorted(inside & self.declared.keys()):
            message = f"`{name}` is a parameter, and a variable of the motion"
            raise ExpressionError(message, hint="rename the parameter")
        self._use(parameters, variables)
        if not inside:
            from rigidcli.language.expression import parse

            return BoundExpression(parse("value"), {"value": self.worked(typed, dimension)})
        self._without_value(parameters)
        constants = {name: self.declared[name].value for name in sorted(parameters)}
        return BoundExpression(self.written(typed), constants)

    def names_in(self, raw: object, variables: tuple[str, ...] = ()) -> frozenset[str]:
        """The names that a value uses as it is written; `variables` are no units. Raises ValueProblem."""
        return names_of(self.typed(raw, None, variables))

    def dimension(self, typed: Typed) -> Dimension | None:
        """The dimension of a number, quantity or expression; None for any. Raises ValueProblem."""
        if isinstance(typed, Amount):
            return None if typed.unit is None else typed.unit.dimension
        declared = {name: self.declared[name].dimension for name in typed.names & self.declared.keys()}
        dimensions = {name: dimension for name, dimension in declared.items() if dimension is not None}
        return dimension_of(typed.root, dimensions) if dimensions else None

    def _check_dimension(self, typed: Typed, dimension: Dimension | None) -> None:
        if isinstance(typed, Amount):
            return
        given = self.dimension(typed)
        if dimension is not None and given is not None and any(given):
            check_dimension(typed.text, given, dimension)

    def _without_value(self, names: Iterable[str]) -> bool:
        """Whether one of these parameters lacks the value that a number needs, which is then its fault."""
        if self.arithmetic.exact:
            return False
        symbols = frozenset[str]().union(*(self.declared[name].symbols for name in names))
        for symbol in symbols:
            self.log.faults[symbol] = ValueProblem("missing: a number in the document needs its value")
        return bool(symbols)

    def _use(self, names: Iterable[str], variables: tuple[str, ...] = ()) -> None:
        unknown = sorted(set(names).difference(self.declared))
        if unknown:
            raise self._undeclared(unknown, variables)
        self.used.update(names)

    def _undeclared(self, names: list[str], variables: tuple[str, ...]) -> ValueProblem:
        from rigidcli.fields.units import is_unit

        for name in names:
            if name in self.names.functions:
                return ExpressionError(f"`{name}` is a function, and needs its argument: `{name}(...)`")
            if variables and name in self.names.meanings:
                message = f"`{name}` is {self.names.meanings[name]}, which cannot stand here"
                return ExpressionError(message, hint=f"variables here: {', '.join(variables)}")
        spelled = {name: meant for name in names if (meant := variable_called(name, variables))}
        near = spelled.get(names[0]) if spelled else nearest(names[0], chain(variables, self.alphabetical))
        also = [f"variables here: {first_few(variables)}"] if variables else []
        if len(names) > 1:
            also += [f"`{name}` is spelled `{meant}`" for name, meant in spelled.items()]
        no_names = (*spelled, "dt", "e", *SYMBOLIC, "None")
        new = [name for name in names if name not in no_names and len(name) <= LONGEST_SHOWN]
        if new and near is None:
            values = ", ".join(f"{name}: null" for name in new[:MOST_LISTED])
            also.append(f"a symbol, or a name for a value, is declared by `parameters: {{{values}}}`")
        if {"e", "E"} & set(names):
            also.append("e to a power is written `exp(...)`")
        if any(name.casefold() in SYMBOLIC for name in names):
            also.append("a parameter without a value is `null`: `m: null`")
        if is_unit(names[0]):
            also.append(f"a quantity in {shown(names[0])} stands alone, or is a parameter: `b: 2 {names[0]}`")
        return ExpressionError(
            f"undeclared name{'s' if len(names) > 1 else ''} {first_few(names, shown)}{did_you_mean(near)}",
            hint="; ".join([f"declared parameters: {first_few(self.alphabetical, shown) or 'none'}", *also]),
        )


def finite(raw: float | int | str | Decimal) -> float:
    """A number as a float. Raises ValueProblem for a text that is no number, and beyond all floats."""
    try:
        value = float(raw)
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise ValueProblem(f"read {shown(raw)}, expected a finite number")
    return value


def names_of(typed: Typed) -> frozenset[str]:
    """The names in an expression; none in a number or a quantity."""
    return frozenset() if isinstance(typed, Amount) else typed.names


def arithmetic_for(exact: bool) -> Arithmetic:
    """Exact arithmetic, which is loaded where it is needed, or that of floats."""
    if not exact:
        return FLOAT
    from rigidcli.algebra.arithmetic import EXACT

    return EXACT


@lru_cache(maxsize=4096)
def _in_si(digits: str, unit: Unit) -> float:
    # Through the shortest decimal, so that 120 g cm^2 is 1.2e-5 kg m^2.
    return unit.si(Fraction(repr(finite(digits))))


@lru_cache(maxsize=1024)
def _names_in(text: str, functions: tuple[UnknownFunction, ...]) -> frozenset[str] | None:
    """The names in a text that may be a unit, read as an expression; None where it is no expression."""
    from rigidcli.language.expression import parse

    try:
        return parse(text, {str(function): function for function in functions}).names
    except ExpressionError:
        return None
