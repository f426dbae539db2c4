"""What exact expressions are made of: sums of terms, and the atoms that the terms are products of.

This module only holds the data. `expressions.Expr` adds the arithmetic, and is what everybody uses.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Generic, TypeAlias, TypeVar, cast
from weakref import WeakValueDictionary

from rigidcli.algebra.bounds import DEEPEST_NESTING, MOST_NODES_OF_ATOM, Rational
from rigidcli.errors import ExpressionError
from rigidcli.language.tree import UnknownFunction

_GRAVITATION, _TIME = "G", "t"
_FUNCTION_ORDER = {"exp": 0, "sin": 1, "sinh": 1, "cos": 2, "cosh": 2}
_ALWAYS_POSITIVE = frozenset(["exp", "cosh"])
_NEVER_NEGATIVE = frozenset(["abs", "acosh", "acos"])
_ACCELERATION = re.compile(r".+ddot")
_DIGITS = re.compile(r"[0-9]+")

_is_mass = re.compile(r"[mM](ass)?([0-9_].*)?").fullmatch
_is_rate = re.compile(r"p_.*|.*dot").fullmatch


class Terms:
    """A sum: a mapping from monomials to their rational coefficients, in canonical form. Immutable."""

    def __init__(self, terms: Mapping[Monomial, Rational]) -> None:
        """Internal: terms must be canonical; `expressions` makes such sums."""
        self.terms = terms

    @property
    def is_zero(self) -> bool:
        """Whether there are no terms; `values.is_zero` looks deeper."""
        return not self.terms

    @property
    def as_number(self) -> Rational | None:
        """The rational number that it is, or None."""
        if not self.terms:
            return 0
        return self.terms.get(()) if len(self.terms) == 1 else None

    @cached_property
    def names(self) -> frozenset[str]:
        """The symbols in it, at any depth."""
        return frozenset().union(*(atom.names for atom in self.atoms))

    @cached_property
    def unknown(self) -> frozenset[str]:
        """The unknown functions in it, at any depth, by the names under which they are declared."""
        functions = (atom.function for atom in self.everywhere() if isinstance(atom, Applied))
        return frozenset(f.base for f in functions if isinstance(f, UnknownFunction))

    @property
    def atoms(self) -> list[Atom]:
        """The atoms of its terms, each once."""
        return list(dict.fromkeys(atom for monomial in self.terms for atom, _ in monomial))

    def everywhere(self) -> Iterator[Atom]:
        """The atoms of its terms, and of the sums and arguments of these, at any depth."""
        for atom in self.atoms:
            yield atom
            parts = atom.arguments if isinstance(atom, Applied) else ()
            for part in (atom.inner,) if isinstance(atom, Group) else parts:
                yield from part.everywhere()

    @cached_property
    def depth(self) -> int:
        """How deep its atoms are nested."""
        return max((atom.depth for atom in self.atoms), default=0)

    @cached_property
    def nodes(self) -> int:
        """How many numbers, names, powers and functions are in it, whatever the names are: its size."""
        return sum(
            (abs(c) != 1 or not monomial) + sum(atom.nodes + (n != 1) for atom, n in monomial)
            for monomial, c in self.terms.items()
        )

    @cached_property
    def ordered(self) -> tuple[tuple[Monomial, Rational], ...]:
        """The terms in canonical order."""
        return tuple(sorted(self.terms.items(), key=_place))

    @cached_property
    def key(self) -> str:
        """A text that equal expressions share."""
        return ",".join(
            "*".join([str(coefficient), *(f"{atom.key}^{exponent}" for atom, exponent in monomial)])
            for monomial, coefficient in self.ordered
        )

    @cached_property
    def _hash(self) -> int:
        return hash(frozenset(self.terms.items()))

    def __hash__(self) -> int:
        return self._hash

    def sign(self) -> int | None:
        """1 or -1 where every term has that sign, 0 without terms, None where the terms do not tell."""
        signs = {
            (1 if coefficient > 0 else -1) * all(atom.positive or _is_square(n) for atom, n in monomial)
            for monomial, coefficient in self.terms.items()
        }
        if not signs:
            return 0
        return signs.pop() or None if len(signs) == 1 else None

    def is_strict(self) -> bool:
        """Whether a term is positive or negative for all values, and not only where no symbol is zero."""
        return any(all(atom.positive for atom, _ in monomial) for monomial in self.terms)


def _is_square(exponent: Rational) -> bool:
    return exponent.denominator != 1 or exponent.numerator % 2 == 0


def _place(term: tuple[Monomial, Rational]) -> tuple[object, ...]:
    """Where a term stands in a sum: accelerations first, then kinetic energy, and functions last.

    Otherwise it is by falling degree.
    """
    rates: Rational = 0
    degree: Rational = 0
    functions = 0
    for atom, exponent in term[0]:
        if isinstance(atom, Symbol):
            rates += exponent * atom.degree
            degree += max(exponent, 0)
        elif isinstance(atom, Applied):
            functions += 1
        elif isinstance(atom, Group):
            rates += 2 if atom.has_rates and exponent > 0 else 0
            degree += max(exponent, 0)
    return -rates, functions, -degree, [(atom.key, -exponent) for atom, exponent in term[0]]


class Atom:
    """What an expression cannot take apart; two atoms that are equal are one object.

    `key` is a text that tells atoms apart and puts them into the order in which people write them:
    numbers, masses, other symbols, groups, momenta and velocities, functions.
    """

    __slots__ = ("__weakref__", "depth", "key", "names", "nodes", "nonnegative", "positive")

    def __init__(self, key: str, parts: Sequence[Terms] = (), names: frozenset[str] = frozenset()) -> None:
        """An atom with its arguments, or its sum, as `parts`; names are those of the parts and `names`."""
        self.key = key
        self.depth = 1 + max(part.depth for part in parts) if parts else 0
        self.names = names.union(*(part.names for part in parts))
        self.nodes = 1 + sum(part.nodes for part in parts)
        self.positive = self.nonnegative = True  # for all values of its symbols
        if self.depth > DEEPEST_NESTING:
            raise ExpressionError(f"functions and sums are nested deeper than {DEEPEST_NESTING} levels")
        if self.nodes > MOST_NODES_OF_ATOM:
            raise ExpressionError("the expression is too large")

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
    """A name, for a real number or, where that is known, for a positive one."""

    __slots__ = ("degree", "name")

    def __init__(self, name: str, positive: bool = False) -> None:
        # The degree in momenta and velocities, of which no product comes up to an acceleration.
        self.degree = 0 if not _is_rate(name) else 100 if _ACCELERATION.fullmatch(name) else 1
        place = "6" if self.degree else "2" if name == _GRAVITATION else "3" if _is_mass(name) else "4"
        place += "~" if name == _TIME else ""
        counted = _DIGITS.sub(lambda digits: f"{len(digits[0]):03}{digits[0]}", name)
        mark = "+" if positive else ""
        super().__init__(f"{place}{counted.lower()} {name}{mark}", names=frozenset([name]))
        self.name = name
        self.positive = self.nonnegative = positive

    @property
    def is_rate(self) -> bool:
        """Whether it is a momentum or velocity."""
        return self.degree > 0


E = TypeVar("E", bound=Terms)


class Applied(Atom, Generic[E]):
    """A function of its arguments: one of `functions.FUNCTIONS` but `sqrt`, or `pow`, or an unknown one.

    `pow` is a power whose exponent is not a rational number.
    """

    __slots__ = ("arguments", "function")

    def __init__(self, function: str, arguments: tuple[E, ...]) -> None:
        # Two documents may have unknown functions of one name, and of other parameters.
        name = f"{function}{function.parameters}" if isinstance(function, UnknownFunction) else function
        super().__init__(
            f"7{_FUNCTION_ORDER.get(function, 3)}{name}({';'.join(e.key for e in arguments)})", arguments
        )
        self.function = function
        self.arguments = arguments
        self.positive = function in _ALWAYS_POSITIVE
        self.nonnegative = self.positive or function in _NEVER_NEGATIVE


class Group(Atom, Generic[E]):
    """An expression that stands in a product or under a power.

    A `plain` group is a sum whose leading term is positive and whose terms have no common factor.
    Others come under fractional powers only, where neither a sign nor a symbol can be taken out.
    """

    __slots__ = ("has_rates", "inner", "plain")

    def __init__(self, inner: E, plain: bool) -> None:
        self.has_rates = any(map(_is_rate, inner.names))
        place = "3" if all(map(_is_mass, inner.names)) else "5"
        super().__init__(f"{place}({inner.key})", (inner,))
        self.inner = inner
        self.plain = plain
        self.nonnegative = inner.sign() == 1
        self.positive = self.nonnegative and inner.is_strict()


Monomial: TypeAlias = tuple[tuple[Atom, Rational], ...]  # atoms in the order of their keys, with exponents

A = TypeVar("A", bound=Atom)

_ATOMS: WeakValueDictionary[str, Atom] = WeakValueDictionary()


def interned(atom: A) -> A:
    """The one object that stands for this atom."""
    return cast(A, _ATOMS.setdefault(atom.key, atom))


def in_order(factors: Iterable[tuple[Atom, Rational]]) -> Monomial:
    """The monomial with these factors."""
    return tuple(sorted(factors, key=lambda factor: factor[0].key))
