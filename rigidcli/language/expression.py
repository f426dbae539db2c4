"""The expressions of documents and answers: read once and safely, worth a number in many ways.

    energy = parse("m*v^2/2")
    energy.names                                  # {'m', 'v'}
    energy.evaluate({"m": 2.0, "v": 3.0})         # 9.0

`read` in `parser` holds the grammar, `tree` the nodes, `words` what may be called. Single numbers are
worked out with `math`, arrays with numpy, many expressions at once by the functions that `code` makes.
"""

from __future__ import annotations

import math
import operator
import re
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial, reduce
from typing import TYPE_CHECKING, Any

from rigidcli.errors import ExpressionError, shortened
from rigidcli.language.parser import NO_FUNCTIONS, of_tokens
from rigidcli.language.tokens import GREEK_LETTERS, tokenize
from rigidcli.language.tree import Kind, Node, Parts, UnknownFunction, fold, names_in
from rigidcli.language.words import DOTS, FUNCTIONS, Words, undotted

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Expression:
    """An expression that has been read; two are equal when their texts are."""

    text: str
    """The expression as it was typed."""
    root: Node = field(compare=False, repr=False)
    names: frozenset[str] = field(compare=False)
    """The symbols in it, `t` included, in ASCII spelling."""

    def evaluate(self, values: Mapping[str, float]) -> float:
        """The value where the names have these values. Raises ExpressionError where there is none."""
        return real(self.root, values)


def parse(
    text: str,
    functions: Mapping[str, UnknownFunction] | None = None,
    words: Words | None = None,
    fits: Callable[[Expression], bool] = lambda expression: True,
) -> Expression:
    """Read a text in the expression language, in which there may be `functions` without a formula.

    Of several readings the one that `fits` is taken. Signs of LaTeX, print and phones are read as plain ones.

    Raises ExpressionError: the text is not in the language or beyond its bounds, or several readings fit.
    """
    try:
        source = undotted(text)
        if _RATE.search(source):
            from rigidcli.language.typed import slopes  # as below

            source = slopes(source)
        tokens = tokenize(source, as_typed=source == text)
    except ExpressionError as error:
        # Dots over letters are derivatives; other accents are no decoration of a name.
        bare = (unicodedata.normalize("NFKD", sign).strip(DOTS) for sign in text if sign.isalpha())
        if error.code or not all(letter.isascii() or letter in GREEK_LETTERS for letter in bare):
            raise
        from rigidcli.language.latex import plain  # the patterns of other notations take 10 ms to compile
        from rigidcli.language.typed import POINTS, QUOTES

        try:
            typed = plain(text.strip(QUOTES + "‘’"))
            tokens = tokenize(typed.translate(POINTS) if "\\" in text else typed, as_typed=False)
        except ExpressionError:
            raise error from None
    roots = of_tokens(
        tokens, NO_FUNCTIONS if functions is None else functions, words or Words((), is_open=True)
    )
    several = [Expression(text, root, frozenset(names_in(root))) for root in roots]
    fitting = [each for each in several if fits(each)] if len(roots) > 1 else several
    if len(fitting) < 2:
        return (fitting or several)[0]
    # Only needed here: documents without mistakes are read sooner.
    from rigidcli.language.text import reading

    first, *others = (f"`{shortened(reading(each.root), _SHOWN)}`" for each in fitting)
    count = f"{len(fitting)} ways" if len(fitting) > 2 else "two ways"
    hint = f"write {first} or {', '.join(others)}"
    raise ExpressionError(f"this can be read in {count}", column=1, hint=hint, code="two_readings")


_RATE = re.compile(r"\bd\s*[^\W\d]\w*\s*/\s*d\s*t\b")  # dx/dt for xdot
_SHOWN = 60  # the most characters of a reading that a message proposes


SIGNS = dict(zip("+-*/", (operator.add, operator.sub, operator.mul, operator.truediv), strict=True))


def numbers(
    number: Callable[[str, float], Any],
    power: Callable[[Any, Any], Any],
    call: Callable[[str, list[Any]], Any],
    joined: Callable[[Any, str, Any], Any] = lambda left, sign, right: SIGNS[sign](left, right),
    negative: Callable[[Any], Any] = operator.neg,
) -> Kind:
    """The rules by which `fold` works out numbers: sums and products are joined from left to right."""

    def in_order(start: float, signs: str, parts: Parts) -> Any:
        return reduce(lambda left, part: joined(left, signs[part[0]], part[1]), parts, start)

    return Kind(number, negative, partial(in_order, 0.0, "+-"), partial(in_order, 1.0, "*/"), power, call)


def real(node: Node, values: Mapping[str, float]) -> float:
    """The value of a tree, a finite number.

    Raises ExpressionError: there is no such value, at any step of the way.
    """
    return float(fold(node, lambda name: known(name, values), FLOATS))


def known(name: str, values: Mapping[str, float]) -> float:
    """The value of a name, a finite number; ExpressionError if it has none."""
    if name not in values:
        raise ExpressionError(f"no value for `{name}`")
    try:
        number = float(values[name])
    except OverflowError:  # an integer beyond the range of floats
        number = math.inf
    if not math.isfinite(number):
        raise ExpressionError(f"the value of `{name}` is not a finite number")
    return number


def finite(value: float) -> float:
    """The value; ExpressionError if it is not finite."""
    if not math.isfinite(value):
        raise ExpressionError("the value is too large" if math.isinf(value) else "there is no value")
    return value


def joined(left: float, sign: str, right: float) -> float:
    """The sum, difference, product or quotient; ExpressionError where it is not finite."""
    try:
        return finite(SIGNS[sign](left, right))
    except ZeroDivisionError:
        raise ExpressionError("division by zero") from None


def power(base: float, exponent: float) -> float:
    """The real power; ExpressionError where there is none."""
    try:
        return math.pow(base, exponent)
    except OverflowError:
        raise ExpressionError("the value is too large") from None
    except ValueError:
        if base == 0.0:
            raise ExpressionError("division by zero") from None
        raise ExpressionError(
            f"a negative number ({base:g}) to the power {exponent:g} has no real value"
        ) from None


def call(function: str, arguments: list[float]) -> float:
    """The value of a function; ExpressionError where there is none."""
    require_formula(function)
    try:
        return finite(FUNCTIONS[function].real(*arguments))
    except OverflowError:
        raise ExpressionError(f"the value of `{function}` is too large") from None
    except ValueError:
        shown = ", ".join(f"{argument:g}" for argument in arguments)
        raise ExpressionError(f"`{function}({shown})` has no finite real value") from None


def require_formula(function: str) -> None:
    """Raise ExpressionError for an unknown function."""
    if isinstance(function, UnknownFunction):
        raise ExpressionError(f"`{function.base}` has no formula, and so no value")


FLOATS = numbers(lambda text, number: finite(number), power, call, joined)


def array(node: Node, values: Mapping[str, float | NDArray[np.float64]]) -> NDArray[np.float64]:
    """The values of a tree, element by element; infinite or NaN where there is none."""
    import numpy as np

    def called(function: str, arguments: list[Any]) -> Any:
        require_formula(function)
        return getattr(np, FUNCTIONS[function].numpy)(*arguments)

    arrays = numbers(lambda text, number: np.float64(number), np.power, called)
    with np.errstate(all="ignore"):
        return np.asarray(fold(node, lambda name: np.asarray(values[name], dtype=np.float64), arrays))
