"""Formulas of the working, put together from names and numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.language.parser import read
from rigidcli.language.text import latex, reading
from rigidcli.language.tree import Formula, Negative, Node, Number, Power, Product, Sum, bound, number
from rigidcli.report import Field, Value

_ZERO = Number("0", 0.0)


def free_name(candidates: Sequence[str], names: frozenset[str]) -> str:
    """The first of these names that the document does not use."""
    return next(name for name in (*candidates, f"{candidates[0]}_0") if name not in names)


def formula(node: Node, n: Arithmetic) -> Formula:
    """The formula, in which exact numbers are not rounded."""
    return Formula(node, n.exact)


def power(base: Node | None, exponent: int) -> Node | None:
    """A power; None stands for one, which is also the power of None, and of anything raised to zero."""
    if base is None or exponent == 0:
        return None
    return base if exponent == 1 else Power(base, Number(str(exponent), exponent))


def product(n: Arithmetic, coefficient: Scalar | int, *factors: Node | None) -> Node:
    """A number times factors, where None stands for one; a coefficient of one is not written."""
    tree = _number(coefficient, n)
    negative = isinstance(tree, Negative)
    size = tree.operand if isinstance(tree, Negative) else tree
    present = [factor for factor in factors if factor is not None]
    if not (present and isinstance(size, Number) and size.value == 1):
        present.insert(0, size)
    written = present[0] if len(present) == 1 else Product(tuple(present))
    return Negative(written) if negative else written


def total(terms: Iterable[Node]) -> Node:
    """A sum; zero without terms."""
    terms = tuple(terms)
    return Sum(terms) if len(terms) > 1 else terms[0] if terms else _ZERO


def _number(value: Scalar | int, n: Arithmetic) -> Node:
    if n.exact:
        from rigidcli.algebra.expressions import expr

        return expr(value).tree()
    return number(float(value))


def filled(text: str, n: Arithmetic, title: str = "", added: Node = _ZERO, /, **numbers: Scalar) -> Field:
    """A formula such as `M*g*R*sin(theta)` with numbers in place of letters, under a title.

    Another term may be `added`.
    """
    root, _ = read(text)
    numbered = bound(root, {letter: _number(number, n) for letter, number in numbers.items()})
    if added != _ZERO:
        numbered = Sum((numbered, *(added.terms if isinstance(added, Sum) else [added])))
    return Field("", formula(numbered, n), title or reading(root), "" if title else latex(root))


def law(
    text: str, name: str, symbol: str, value: Value, unit: str, n: Arithmetic, **numbers: Scalar
) -> tuple[Field, Field]:
    """A formula with numbers in place of letters, and the `value` of the formula from the results."""
    return filled(text, n, "", **numbers), Field("", value, name, symbol, unit)
