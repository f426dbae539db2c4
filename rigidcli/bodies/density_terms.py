"""The terms of a density, by what each of them may do in a narrow part of a shape."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from rigidcli.bodies.density import VARIABLES
from rigidcli.language import functions, tree

STEEP = {"exp": 8.0, "sinh": 8.0, "cosh": 8.0, "tanh": 2.0, "atan": 2.0, "asinh": 2.0}
"""By how much the argument of a function varies before the function is narrow in a shape.

Others have kinks or poles where their argument is zero."""

MOST_TERMS = 24
"""The most terms that are integrated one by one; more are taken together."""

LOW_POWERS = range(17)
"""Exponents of powers that have nothing narrow of their own."""


class Narrow(NamedTuple):
    """What a function does is narrow where its `core` passes zero or turns back; see `kinks.Narrow`."""

    core: tree.Node
    argument: tree.Node
    function: Callable[[Any], Any] | None = None
    steep: float = math.inf

    @property
    def guide(self) -> tree.Node:
        """What is lowest or highest where surfaces begin or end: the core, but the phase of a wave."""
        match self.core:
            case tree.Call("sin" | "cos" | "tan", (phase,)):
                return phase
            case _:
                return self.core


class Term(NamedTuple):
    """A part of the density, and where it may have kinks, jumps and peaks."""

    node: tree.Node
    narrow: tuple[Narrow, ...]


def terms(root: tree.Node) -> list[Term]:
    """The terms of a density; those that hang on the same narrow things, or on none, are one."""
    groups: dict[frozenset[Narrow], list[tree.Node]] = {}
    for node in root.terms if isinstance(root, tree.Sum) else (root,):
        groups.setdefault(frozenset(_narrow(node)), []).append(node)
    if len(groups) > MOST_TERMS:
        groups = {frozenset(_narrow(root)): [root]}
    return [
        Term(nodes[0] if len(nodes) == 1 else tree.Sum(tuple(nodes)), tuple(sorted(narrow, key=repr)))
        for narrow, nodes in groups.items()
    ]


def _narrow(root: tree.Node) -> Iterator[Narrow]:
    """What may be narrow in a tree: functions, divisors and high powers of what varies; and distances."""
    found: list[Narrow] = []

    def walk(node: tree.Node) -> tree.Node:
        match node:
            case tree.Power(tree.Name("r" | "s"), tree.Number(_, exponent)) if (
                exponent in LOW_POWERS and exponent % 2 == 0
            ):
                return node  # a polynomial in the places
            case tree.Call(function, arguments) if function not in ("sin", "cos"):
                smooth: tuple[Any, ...] = ()
                if function in ("abs", "sign"):
                    smooth = None, 0.0
                elif function in STEEP:
                    smooth = getattr(np, functions.FUNCTIONS[function].numpy), STEEP[function]
                for argument in arguments:
                    found.extend(_of(argument, function != "exp", *smooth))
            case tree.Reciprocal(tree.Product(factors)):
                for factor in factors:
                    found.extend(_of(factor, False))
            case tree.Reciprocal(divisor):
                found.extend(_of(divisor, False))
            case tree.Power(base, exponent) if not (
                isinstance(exponent, tree.Number) and exponent.value in LOW_POWERS
            ):
                power = tree.Product((exponent, tree.Call("log", (tree.Call("abs", (base,)),))))
                found.extend(_of(base, True))
                found.extend(
                    Narrow(core, power, np.exp, STEEP["exp"])
                    for core in cores(base if varies(base) else exponent, True)
                    if varies(power)
                )
            case tree.Name("r" | "s"):
                found.append(Narrow(node, node))
        return tree.rebuilt(node, walk)

    walk(root)
    roots = {each.core for each in found if each.function is None and each.steep}
    return iter([each for each in found if each.steep or each.core not in roots])


def _of(argument: tree.Node, crosses: bool, *smooth: Any) -> Iterator[Narrow]:
    """What is narrow for this argument; `crosses` if it may pass zero where it does not turn back."""
    if not varies(argument):
        return
    for core in cores(argument, crosses):
        yield Narrow(core, argument, *smooth)


def varies(node: tree.Node) -> bool:
    """Whether a part of a density hangs on the place."""
    return not tree.names_in(node).isdisjoint(VARIABLES)


def cores(node: tree.Node, crosses: bool) -> Iterator[tree.Node]:
    """What passes zero where a part of a density passes zero or turns back, where that is simpler."""
    match node:
        case tree.Negative(operand):
            yield from cores(operand, crosses)
        case tree.Power(base, tree.Number(_, exponent)) if exponent in LOW_POWERS:
            yield from cores(base, crosses)
        case tree.Product(factors):
            moving = [factor for factor in factors if varies(factor)]
            for factor in moving:
                yield from cores(factor, crosses)
            if len(moving) > 1 and not crosses:
                yield node
        case tree.Sum(summands):
            moving = [summand for summand in summands if varies(summand)]
            inner = _base(moving[0])
            if len(moving) > 1 or inner is None:
                yield node
            else:
                yield from cores(inner, crosses)
                if crosses and len(moving) < len(summands):
                    yield node
        case tree.Reciprocal(operand) | tree.Call("abs", (operand,)):
            yield from cores(operand, crosses)
        case _:
            yield node


def _base(node: tree.Node) -> tree.Node | None:
    """What is raised to an even power in a term, apart from its constant factors."""
    match node:
        case tree.Negative(operand):
            return _base(operand)
        case tree.Power(base, tree.Number(_, exponent)) if exponent in LOW_POWERS and exponent % 2 == 0:
            return base
        case tree.Product(factors):
            moving = [factor for factor in factors if varies(factor)]
            return _base(moving[0]) if len(moving) == 1 else None
        case _:
            return None
