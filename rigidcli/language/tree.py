"""The tree of an expression.

The parser builds these nodes. Floats, arrays, exact expressions, code and texts are made of them by one walk,
`fold`, with a table of functions for each kind of value. Sums and products hold all their members side by
side, so that a tree is only as deep as the parentheses of its text.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Self, TypeAlias

from rigidcli.language.words import CONSTANTS


class _Arithmetic:
    """The operators of trees, among each other and with numbers: zeros, ones and double signs are left out.

    By these, formulas that take floats or arrays of them take trees, too, in arrays of objects.
    """

    __slots__ = ()

    def __neg__(self: Any) -> Node:
        return self.operand if isinstance(self, Negative) else self if self == ZERO else Negative(self)

    def __add__(self: Any, other: Node | float) -> Node:
        terms = self, _tree(other)
        left = tuple(term for term in terms if term != ZERO)
        return Sum(left) if len(left) == 2 else left[0] if left else ZERO

    def __sub__(self, other: Node | float) -> Node:
        return self + -_tree(other)

    def __mul__(self: Any, other: Node | float) -> Node:
        factors = self, _tree(other)
        if ZERO in factors:
            return ZERO
        for factor, rest in (factors, factors[::-1]):
            if factor in (ONE, -ONE):
                return rest if factor == ONE else -rest
        return Product(factors)

    def __truediv__(self, other: Node | float) -> Node:
        return self * Reciprocal(_tree(other))

    __radd__ = __add__
    __rmul__ = __mul__


@dataclass(frozen=True, slots=True)
class Number(_Arithmetic):
    """A decimal number: the digits as typed, and the nearest float (infinite beyond the range of floats)."""

    text: str
    value: float


@dataclass(frozen=True, slots=True)
class Constant(_Arithmetic):
    """A number with a name of its own, one of `words.CONSTANTS`."""

    name: str


@dataclass(frozen=True, slots=True)
class Name(_Arithmetic):
    """A symbol, in its ASCII spelling."""

    name: str


@dataclass(frozen=True, slots=True)
class Negative(_Arithmetic):
    """The operand with its sign turned: `-x`, and the second term of `a - x`."""

    operand: Node


@dataclass(frozen=True, slots=True)
class Reciprocal(_Arithmetic):
    """One over the operand: the second factor of `a/x`."""

    operand: Node


@dataclass(frozen=True, slots=True)
class Sum(_Arithmetic):
    """Two or more terms, to be added from left to right."""

    terms: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class Product(_Arithmetic):
    """Two or more factors, to be multiplied (by a `Reciprocal`: divided) from left to right."""

    factors: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class Power(_Arithmetic):
    """`base ** exponent`."""

    base: Node
    exponent: Node


class UnknownFunction(str):
    """The name of a function without a formula, or of a derivative of one; it knows its `parameters`.

    The derivative of V(x) by x is called dV_dx, and that of this one dV_dx_dx. The order of the derivatives
    does not matter: they are sorted by the parameters.
    """

    base: str
    parameters: tuple[str, ...]
    by: tuple[int, ...]

    def __new__(cls, base: str, parameters: Sequence[str], by: Sequence[int] = ()) -> Self:
        """The derivative of the function `base` by the parameters at the places `by`."""
        places = tuple(sorted(by))
        slopes = "".join(f"_d{parameters[place]}" for place in places)
        self = super().__new__(cls, f"d{base}{slopes}" if places else base)
        self.base, self.parameters, self.by = base, tuple(parameters), places
        return self

    def __getnewargs__(self) -> tuple[str, tuple[str, ...], tuple[int, ...]]:  # type: ignore[override]
        """What a copy in another process is made of."""
        return self.base, self.parameters, self.by

    @property
    def derivatives(self) -> list[Self]:
        """The first derivatives by each parameter."""
        return [type(self)(self.base, self.parameters, (*self.by, k)) for k in range(len(self.parameters))]

    @property
    def trial(self) -> list[float]:
        """Numbers c_0, c_k of a formula c_0 + sum_k c_k (x_k + x_k^3), which stands in for this function.

        Derivatives have formulas of their own, as the values of V, V', V'' at one point can be any. What
        vanishes for these formulas at random points vanishes, but by chance, for all functions.
        """
        names = ["", *self.parameters]
        return [1 + zlib.crc32(f"{self} {name}".encode()) % 1024 / 1024 for name in names]


@dataclass(frozen=True, slots=True)
class Call(_Arithmetic):
    """One of `words.FUNCTIONS`, with as many arguments as its arity; or an unknown function."""

    function: str
    arguments: tuple[Node, ...]


Node = Number | Constant | Name | Negative | Reciprocal | Sum | Product | Power | Call


def rebuilt(node: Node, change: Callable[[Node], Node]) -> Node:
    """The same operation on changed operands."""
    match node:
        case Negative() | Reciprocal() | Power():
            return type(node)(*map(change, operands(node)))
        case Sum(several) | Product(several):
            return type(node)(tuple(map(change, several)))
        case Call(function, arguments):
            return Call(function, tuple(map(change, arguments)))
        case _:
            return node


def operands(node: Node) -> tuple[Node, ...]:
    """The trees that a tree is made of."""
    match node:
        case Negative(operand) | Reciprocal(operand):
            return (operand,)
        case Sum(several) | Product(several) | Call(_, several):
            return several
        case Power(base, exponent):
            return (base, exponent)
        case Name() | Number() | Constant():
            return ()


def nodes(trees: Iterable[Node]) -> Iterator[Node]:
    """The trees, and all parts of them."""
    pending = list(trees)
    while pending:
        node = pending.pop()
        yield node
        pending += operands(node)


# The values of terms or factors, from left to right: with True what is subtracted, or divides.
Parts: TypeAlias = Sequence[tuple[bool, Any]]


class Kind(NamedTuple):
    """What numbers and operations are in one kind of values."""

    number: Callable[[str, float], Any]
    """A number by its text and the nearest float; the text of a constant is its name."""
    negative: Callable[[Any], Any]
    sum: Callable[[Parts], Any]
    product: Callable[[Parts], Any]
    power: Callable[[Any, Any], Any]
    call: Callable[[str, list[Any]], Any]


def fold(root: Node, name: Callable[[str], Any], kind: Kind) -> Any:
    """The value of a tree from those of its names."""

    def of(node: Node) -> Any:
        if isinstance(node, Name):
            return name(node.name)
        if isinstance(node, Number):
            return kind.number(node.text, node.value)
        if isinstance(node, Product):
            factors = node.factors
            return kind.product(
                [(True, of(e.operand)) if isinstance(e, Reciprocal) else (False, of(e)) for e in factors]
            )
        if isinstance(node, Sum):
            terms = node.terms
            return kind.sum(
                [(True, of(e.operand)) if isinstance(e, Negative) else (False, of(e)) for e in terms]
            )
        if isinstance(node, Power):
            return kind.power(of(node.base), of(node.exponent))
        if isinstance(node, Call):
            return kind.call(node.function, [of(argument) for argument in node.arguments])
        if isinstance(node, Negative):
            return kind.negative(of(node.operand))
        if isinstance(node, Reciprocal):
            return kind.product([(True, of(node.operand))])
        return kind.number(node.name, CONSTANTS[node.name])

    return of(root)


def names_in(node: Node) -> set[str]:
    """The names in a tree."""
    return {part.name for part in nodes([node]) if isinstance(part, Name)}


def insides(trees: Iterable[Node]) -> set[Node]:
    """The arguments of functions in trees, what these divide by, and the bases of powers above 16.

    Where one of them passes zero, or is largest or smallest, something narrow may be: a peak, a kink, a wall.
    Sines, cosines and low powers have nothing narrow of their own.
    """
    inner: set[Node] = set()
    for part in nodes(trees):
        match part:
            case Call(function, arguments) if function not in ("sin", "cos"):
                inner.update(arguments)
            case Reciprocal(divisor):
                factors = divisor.factors if isinstance(divisor, Product) else (divisor,)
                inner.update(each.base if isinstance(each, Power) else each for each in factors)
            case Power(base, exponent) if not (isinstance(exponent, Number) and exponent.value in range(17)):
                inner.add(base)
    return inner


def number(value: float) -> Node:
    """A number as a tree."""
    positive = Number(repr(abs(float(value))), abs(float(value)))
    return Negative(positive) if value < 0 else positive


ZERO, ONE = number(0.0), number(1.0)


def _tree(value: Node | float) -> Node:
    return value if isinstance(value, _Arithmetic) else number(value)


def bound(node: Node, values: Mapping[str, Node]) -> Node:
    """The tree with trees in the place of names."""
    if isinstance(node, Name):
        return values.get(node.name, node)
    return rebuilt(node, lambda operand: bound(operand, values))


def rounding(node: Node) -> Node:
    """The rounding error of a tree to first order, in units of that of one operation.

    What is to be added is rounded before, and each product, quotient and power when it is made. So the error
    is large beside a sum whose terms nearly cancel, and is passed on by what is made of that sum.
    """
    match node:
        case Negative(operand):
            return rounding(operand)
        case Sum(terms):
            return sum((rounding(term) + size(term) for term in terms), ZERO)
        case Product(factors):
            sizes = [size(factor) for factor in factors]
            passed_on = (
                math.prod([*sizes[:i], *sizes[i + 1 :]], start=rounding(factor))
                for i, factor in enumerate(factors)
            )
            return sum(passed_on, size(node))
        case Reciprocal(operand):
            return rounding(operand) * size(node) * size(node) + size(node)
        case Power(base, Number(_, value) as exponent):
            return rounding(base) * size(exponent) * size(Power(base, number(value - 1))) + size(node)
        case Call() | Power():
            return size(node)
        case _:
            return ZERO


def size(node: Node) -> Node:
    """The absolute value of a tree."""
    return node if isinstance(node, Constant) else Call("abs", (node,))


@dataclass(frozen=True, slots=True)
class Formula:
    """A tree as it is to be written; renderers round its numbers to the digits that people ask for.

    The numbers of one that is `exact` stay as they are.
    """

    root: Node
    exact: bool = False

    names: ClassVar[frozenset[str]] = frozenset(("units",))
    """Something, as the numbers in a formula have units of their own."""

    def tree(self, digits: int | None = None) -> Node:
        """The tree, its numbers rounded to so many significant digits."""
        return self.root if digits is None or self.exact else _rounded(self.root, digits)


def _rounded(node: Node, digits: int) -> Node:
    if isinstance(node, Number):
        return Number(f"{node.value:.{digits}g}", node.value)
    return rebuilt(node, lambda operand: _rounded(operand, digits))
