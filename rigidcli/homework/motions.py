"""The motion that equations are held against: how its states change, from a document or as it is typed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients, expand
from rigidcli.algebra.expressions import ONE, ZERO, Expr, symbol, total
from rigidcli.algebra.matrices import null_vectors
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.trees import to_tree
from rigidcli.document.variables import acceleration, momentum, velocity
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.homework.base import Asked
from rigidcli.homework.question import Question
from rigidcli.homework.reading import Domain, Names, in_other_letters, names_in_all, names_of, read_equations
from rigidcli.homework.same import Formulas, formulas_of
from rigidcli.language.tree import Name, Negative, Node, Sum, bound, names_in

_DERIVATIVE = re.compile(r"(.+?)(d?)dot")

_MOMENTUM = re.compile(r"[pP](?:[a-zA-Z]?\d*|_\w+|theta|phi|psi)")
"""Names of momenta: `p`, `px`, `p1`, `p_theta`."""


@dataclass(frozen=True, eq=False)
class Motion:
    """The motion: how the states change, and which second derivatives an answer may have.

    `rates` has the derivatives of the states: `xdot` and `p_xdot`, or `xddot` where `xdot` is a state itself.
    Equations of second order may be for `coordinates`, whose `momenta` (or velocities) are states, too.
    """

    formulas: Formulas
    rates: Mapping[str, Node]
    coordinates: tuple[str, ...] = ()
    momenta: tuple[str, ...] = ()
    aliases: Mapping[str, Node] = field(default_factory=dict)
    is_hamiltonian: bool = False
    first_order: bool = False

    @property
    def names(self) -> Names:
        """The names that an answer may hold."""
        return self.formulas.names

    @cached_property
    def meanings(self) -> dict[str, Node]:
        """The derivatives of all kinds as formulas in the states."""
        rates = dict(self.rates)
        with suppress(ExpressionError):
            for name in (*self.coordinates, *self.momenta):
                rates.setdefault(acceleration(name), self._change(rates[velocity(name)]))
        return {**{alias: bound(node, rates) for alias, node in self.aliases.items()}, **rates}

    def _change(self, node: Node) -> Node:
        """The time derivative of a formula in the states, by the chain rule."""
        e = self.exact(node)
        parts = [derivative(e, "t")]
        for rate, of_state in self.rates.items():
            state = state_of(rate)
            if state in e.names:
                parts.append(derivative(e, state) * self.exact(of_state))
        return to_tree(total(parts))

    def exact(self, node: Node) -> Expr:
        """A formula as an exact expression. Raises ExpressionError."""
        positive = (name for name, domain in self.names.domains.items() if domain == "positive")
        return from_tree(self.names.without_derived(node), {name: symbol(name, True) for name in positive})

    def is_true(self, left: Node, right: Node) -> bool | str:
        """Whether an equation holds for the motion in all states."""
        both = [bound(self.names.without_derived(side), self.meanings) for side in (left, right)]
        if self.formulas.relative is None:
            rates = list(self.rates.values())
            outcome = self.formulas.same(both[0], both[1], beside=rates)
            return outcome if outcome is not True else self.formulas.same(both[1], both[0], beside=rates)
        with suppress(ExpressionError):  # a tolerance is relative to the terms of the equation
            gap = to_tree(expand(self.exact(Sum((left, Negative(right))))))
            both = [to_tree(ZERO), bound(gap, self.meanings)]
        return self.formulas.same(both[0], both[1])


def state_of(rate: str) -> str:
    """The state whose derivative this is."""
    return f"{rate.removesuffix('ddot')}dot" if rate.endswith("ddot") else rate.removesuffix("dot")


def of_document(asked: Asked) -> Motion:
    """The motion by the equations in a report. Raises ValueProblem."""
    equations = asked.value
    if asked.path[-1:] != ("equations",) or not isinstance(equations, Mapping) or len(equations) % 2:
        raise ValueProblem("this result has no equations of motion, expected `hamilton.equations`")
    states = tuple(equations)
    half = len(states) // 2
    rates = {velocity(name): to_tree(rate) for name, rate in equations.items()}
    names = names_of(asked)
    coordinates, tolerance = states[:half], asked.question.tolerance
    names = _with_rates(names, states, [*rates, *map(acceleration, states)])
    return Motion(
        formulas_of(asked, names, tolerance.relative),
        rates,
        coordinates,
        states[half:],
        is_hamiltonian=True,
    )


def _with_rates(names: Names, states: Sequence[str], rates: Sequence[str]) -> Names:
    """The names of a motion with its derivatives, in the spellings of the states."""
    spelled = {**dict(in_other_letters(states)), **names.spellings}
    for other, name in [*spelled.items(), *zip(states, states, strict=True)]:
        parts = re.fullmatch(r"([A-Za-z]+?)(?:_(\w+)|(\d+))", other)
        for dots in ("dot", "ddot"):  # `pdot_x` for p_xdot, `xdot_1` for x_1dot and x1dot
            spelled[f"{other}{dots}"] = f"{name}{dots}"
            if parts:
                spelled[f"{parts[1]}{dots}_{parts[2] or parts[3]}"] = f"{name}{dots}"
    spelled = {other: name for other, name in spelled.items() if name in {*names.domains, *states, *rates}}
    domains: dict[str, Domain] = dict.fromkeys((*states, *rates), "real")
    domains |= names.domains
    further = tuple(name for name in (*names.further, *states, *rates) if name not in names.states)
    return replace(names, domains=domains, spellings=spelled, further=further)


def of_text(asked: Asked) -> Motion:
    """The motion by equations as they are typed. Raises ValueProblem."""
    question = asked.question
    keys = [key.strip() for key in asked.value] if isinstance(asked.value, dict) else []
    tops_of = {key: velocity(key) for key in keys if key.isidentifier() and not _DERIVATIVE.fullmatch(key)}
    sides = read_equations(asked.value, None, tops_of)
    used = names_in_all(sides)
    fixed = set(question.symbols or ()) - {*question.coordinates, *question.momenta}
    moving = [*question.coordinates, *question.momenta]
    for name in sorted(used):
        base = _DERIVATIVE.fullmatch(name)
        if base is not None and (name not in fixed or base[1] in used):
            moving.append(base[1])
    functions = tuple(dict.fromkeys(moving))
    second = tuple(name for name in functions if acceleration(name) in used)
    speeds = dict(zip(question.coordinates, question.velocities, strict=False))
    aliases: dict[str, Node] = {v: Name(velocity(q)) for q, v in speeds.items() if v != velocity(q)}
    aliases = {} if set(aliases) <= set(functions) else aliases
    aliases |= {velocity(v): Name(acceleration(q)) for q, v in speeds.items() if v in aliases}
    functions = tuple(name for name in functions if name not in aliases)
    if not functions:
        raise ValueProblem("the equations hold no derivative, expected names such as `xdot`")
    tops = [acceleration(name) if name in second else velocity(name) for name in functions]
    rates = _solved([(bound(left, aliases), bound(right, aliases)) for _, left, right in sides], tops)
    states = [*functions, *map(velocity, second)]
    names = names_of(asked, used - {*tops, *states, *aliases})
    names = replace(names, domains={n: d for n, d in names.domains.items() if n not in aliases or n in used})
    partners = {} if second else _partners(question, functions, rates)
    second_rates = [acceleration(name) for pair in partners.items() for name in pair]
    derivatives = [*rates, *second_rates, *aliases, *map(velocity, functions)]
    return Motion(
        formulas_of(asked, _with_rates(names, states, derivatives), question.tolerance.relative),
        rates,
        tuple(partners),
        tuple(partners.values()),
        aliases,
    )


def of_functions(key: Motion) -> dict[str, str]:
    """The derivative for which a function stands as the key of a mapping."""
    return {re.sub("d?dot\\Z", "", rate): rate for rate in key.rates}


def _partners(question: Question, functions: Sequence[str], rates: Mapping[str, Node]) -> dict[str, str]:
    """The momentum or velocity of each coordinate for which equations of second order say the same."""
    listed = dict(zip(question.coordinates, question.momenta or question.velocities, strict=False))
    partners = {q: p for q, p in listed.items() if {q, p} <= {*functions}}
    for name in () if partners else functions:
        rate = rates[velocity(name)]
        others = names_in(rate) & {*functions} - {name}
        is_pair = len(others) == 1 and _MOMENTUM.fullmatch(min(others)) and not _MOMENTUM.fullmatch(name)
        if is_pair or others == {momentum(name)} or (len(others) == 1 and rate == Name(*others)):
            partners[name] = others.pop()
    return partners if 2 * len(partners) == len(functions) and not {*partners} & {*partners.values()} else {}


def _solved(sides: Sequence[tuple[Node, Node]], tops: Sequence[str]) -> dict[str, Node]:
    """The derivatives for which linear equations can be solved. Raises ValueProblem."""
    rows: list[list[Expr]] = []
    for left, right in sides:
        parts = coefficients(from_tree(Sum((left, Negative(right)))), tops)
        if parts is None or any(sum(powers) > 1 for powers in parts):
            raise ValueProblem("the equations are not linear in the derivatives")
        units = [tuple(int(i == place) for i in range(len(tops))) for place in range(len(tops))]
        rows.append([parts.get(powers, ZERO) for powers in (*units, (0,) * len(tops))])
    if len(rows) != len(tops):
        raise ValueProblem(f"{len(rows)} equations do not go with {len(tops)} unknown functions of the time")
    vectors = null_vectors([*rows, [ZERO] * (len(tops) + 1)])
    if len(vectors) != 1 or vectors[0][-1] != ONE:
        raise ValueProblem("the equations do not determine the derivatives")
    return {top: to_tree(rate) for top, rate in zip(tops, vectors[0], strict=False)}
