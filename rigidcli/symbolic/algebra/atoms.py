"""The atoms of exact expressions: what these are sums of products of powers of."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, TypeAlias, TypeVar, cast
from weakref import WeakValueDictionary

from rigidcli.errors import ExpressionError
from rigidcli.symbolic.algebra.roots import Rational

if TYPE_CHECKING:
    from rigidcli.symbolic.algebra.expressions import Expr

MAX_LENGTH = 200_000
"""Characters of the key of an atom, which is about as long as its text."""

MAX_DEPTH = 120
"""How deep functions and groups may stand inside each other."""

_LEADING = frozenset(["G"])
_TIME = "t"
_FUNCTION_ORDER = {"exp": 0, "sin": 1, "sinh": 1, "cos": 2, "cosh": 2}
_RATE = re.compile(r"p_.*|.*dot")
_MASS = re.compile(r"[mM](ass)?([0-9_].*)?")
_DIGITS = re.compile(r"[0-9]+")


def _is_mass(name: str) -> bool:
    return _MASS.fullmatch(name) is not None


def _is_rate(name: str) -> bool:
    """Whether it is the name of a momentum or velocity."""
    return _RATE.fullmatch(name) is not None


class Atom:
    """What an expression cannot take apart; two atoms that are equal are one object.

    `key` is a text that tells atoms apart and puts them into the order in which people write them:
    numbers, masses, other symbols, groups, momenta and velocities, functions.
    """

    __slots__ = ("__weakref__", "depth", "key", "names")

    def __init__(self, key: str, depth: int = 0, names: frozenset[str] = frozenset()) -> None:
        if depth > MAX_DEPTH:
            raise ExpressionError(f"functions and sums are nested deeper than {MAX_DEPTH} levels")
        if len(key) > MAX_LENGTH:
            raise ExpressionError("the expression is too large")
        self.key = key
        self.depth = depth
        self.names = names

    def __repr__(self) -> str:
        return f"<{self.key}>"


class Surd(Atom):
    """A positive integer, to an exponent between 0 and 1."""

    __slots__ = ("value",)

    def __init__(self, value: int) -> None:
        super().__init__(f"1{value:0>20}")
        self.value = value


class Pi(Atom):
    """The constant pi."""

    __slots__ = ()

    def __init__(self) -> None:
        super().__init__("1pi")


class Symbol(Atom):
    """A name."""

    __slots__ = ("is_rate", "name")

    def __init__(self, name: str) -> None:
        self.is_rate = _is_rate(name)
        place = "6" if self.is_rate else "2" if name in _LEADING else "3" if _is_mass(name) else "4"
        place += "~" if name == _TIME else ""
        counted = _DIGITS.sub(lambda digits: f"{len(digits[0]):03}{digits[0]}", name)
        super().__init__(f"{place}{counted.lower()} {name}", names=frozenset([name]))
        self.name = name


class Applied(Atom):
    """A function of its arguments: one of `tree.FUNCTIONS` but `sqrt`, or `pow`.

    `pow` is a power whose exponent is not a rational number.
    """

    __slots__ = ("arguments", "function")

    def __init__(self, function: str, arguments: tuple[Expr, ...]) -> None:
        super().__init__(
            f"7{_FUNCTION_ORDER.get(function, 3)}{function}({';'.join(e.key for e in arguments)})",
            1 + max(argument.depth for argument in arguments),
            frozenset().union(*(argument.names for argument in arguments)),
        )
        self.function = function
        self.arguments = arguments


class Group(Atom):
    """An expression that stands in a product or under a power.

    A `plain` group is a sum whose leading term is positive and whose terms have no common factor.
    Others come under fractional powers only, where neither a sign nor a symbol can be taken out.
    """

    __slots__ = ("has_rates", "inner", "plain")

    def __init__(self, inner: Expr, plain: bool) -> None:
        self.has_rates = any(map(_is_rate, inner.names))
        place = "3" if all(map(_is_mass, inner.names)) else "5"
        super().__init__(f"{place}({inner.key})", 1 + inner.depth, inner.names)
        self.inner = inner
        self.plain = plain


Monomial: TypeAlias = tuple[tuple[Atom, Rational], ...]
"""Atoms in the order of their keys, each with its exponent."""

A = TypeVar("A", bound=Atom)

_ATOMS: WeakValueDictionary[str, Atom] = WeakValueDictionary()


def interned(atom: A) -> A:
    """The one object that stands for this atom."""
    return cast(A, _ATOMS.setdefault(atom.key, atom))


def key_of_atom(factor: tuple[Atom, Rational]) -> str:
    """By what the factors of a monomial are sorted."""
    return factor[0].key


def is_positive(atom: Atom) -> bool:
    """Whether it is above zero for all real values."""
    return isinstance(atom, (Surd, Pi)) or (isinstance(atom, Applied) and atom.function in ("exp", "cosh"))


def is_nonnegative(atom: Atom) -> bool:
    """Whether it is never below zero."""
    return is_positive(atom) or (isinstance(atom, Applied) and atom.function in ("abs", "acosh"))
