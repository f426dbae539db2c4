"""Equations of motion: a set is right if each is true of the motion, and together they determine it.

They may be Hamilton's or any others of first order, or of second order; solved for derivatives or not. To
determine the motion is to leave one motion only through every state: `p p' = -k x p` says nothing where
p = 0. Where that cannot be decided, a person has to look.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import ClassVar, TypeAlias

from rigidcli.algebra.atoms import Atom
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients, expand
from rigidcli.algebra.expressions import ONE, ZERO, Expr, atomic, factored, symbol, total
from rigidcli.algebra.matrices import determinant, null_vectors
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.trees import to_tree
from rigidcli.document.variables import acceleration, momentum, velocity
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.homework.base import Asked, Finding, Kind, Outcome, Reading, Tree, Unreadable
from rigidcli.homework.numbers import CONTRADICTION
from rigidcli.homework.question import Question
from rigidcli.homework.reading import (
    Domain,
    Names,
    Sides,
    in_other_letters,
    names_in_all,
    names_of,
    read_equations,
)
from rigidcli.homework.same import Ball, Formulas, formulas_of, pivots
from rigidcli.language.text import reading, text, without_doubt
from rigidcli.language.tree import Name, Negative, Node, Sum, bound, names_in

Answer: TypeAlias = tuple[Sequence[Sides], Sequence[Finding]]
"""The equations that can be read, and what is wrong with the others."""

_DERIVATIVE = re.compile(r"(.+?)(d?)dot")

_MOMENTUM = re.compile(r"[pP](?:[a-zA-Z]?\d*|_\w+|theta|phi|psi)")
"""Names of momenta: `p`, `px`, `p1`, `p_theta`."""


class Equations(Kind):
    """Equations of motion."""

    name: ClassVar[str] = "equations"
    has_tolerance: ClassVar[bool] = False
    options: ClassVar[frozenset[str]] = frozenset(
        {"symbols", "coordinates", "momenta", "velocities", "form", "numbers"}
    )

    def key(self, asked: Asked) -> Motion:
        """The motion of a question. Raises ValueProblem."""
        try:
            key = of_text(asked) if asked.report is None else of_document(asked)
        except Unreadable as unreadable:
            code = unreadable.findings[0].code
            raise ValueProblem(f"the equations of the key cannot be read: {code}") from None
        except ExpressionError as error:
            raise ValueProblem(f"the equations of the key cannot be worked with: {error.message}") from None
        if asked.question.form == "first_order" and any(rate.endswith("ddot") for rate in key.rates):
            raise ValueProblem("the equations are of second order, and first order is asked for")
        if any(all(v is None for v in key.formulas.values(rate)) for rate in key.rates.values()):
            raise ValueProblem("the equations have no values at most states")
        return replace(key, first_order=asked.question.form == "first_order")

    def read(self, key: Motion, answer: Tree) -> Reading:
        """The equations of an answer; one that cannot be read costs only itself. Raises Unreadable."""
        unread: list[Unreadable] = []
        chained: list[Sides] = []
        sides = read_equations(answer, key.names, of_functions(key), unread, chained, key.is_true)
        shown = "; ".join(f"{without_doubt(left)} = {without_doubt(right)}" for _, left, right in sides)
        differ = any(key.is_true(member, last) is False for _, member, last in chained)
        findings = [finding for each in unread for finding in each.findings]
        return Reading((sides, findings), shown, CONTRADICTION if differ else "")

    def judge(self, key: Motion, value: Answer) -> Outcome:
        """What is true, what determines the motion, and what is too much."""
        sides, unread = value
        exactly = replace(key.formulas, relative=None)
        kept = [side for side in sides if exactly.same(*side[1:]) is not True]
        remarks = [*(Finding("trivial_equation", side[0]) for side in sides if side not in kept), *unread]
        truths = [(side, key.is_true(*side[1:])) for side in kept]
        true = [side for side, truth in truths if truth is True]
        false = [side for side, truth in truths if truth is False]
        open_ = next((truth for _, truth in truths if isinstance(truth, str)), "")
        if open_ and not false:
            return Outcome.review(f"it is not proved that the equation is true: {open_}", *remarks)
        systems = [_System(key, second, true) for second in _readings(key, true)]
        best = max(
            systems,
            key=lambda system: (system.is_complete, system.right / len(system.tops), not system.unclear),
        )
        if best.is_complete and not false:
            return self._complete(key, systems, remarks)
        if best.unclear and not false:
            return Outcome.review(best.unclear, *remarks)
        findings = [Finding(self._slip(key, side), side[0]) for side in false]
        if len(findings) > 1 and len(kept) > len(best.tops):  # of many guesses, none is pointed out
            findings = [Finding("equation_wrong", "one or more")]
        # A wrong equation stands in the place of a missing one.
        if len(best.missing) > len(false):
            lacking = ", ".join(name for name in best.missing if name not in {side[0] for side in false})
            findings.append(Finding("missing_equation", lacking))
        surplus = max(0, best.right + len(false) - len(best.tops))
        return Outcome.earning((best.right - surplus) / len(best.tops), *findings, *remarks)

    def _slip(self, key: Motion, side: Sides) -> str:
        given = replace(key, formulas=key.formulas.with_values())
        has_numbers = bool(key.names.values) and given.is_true(*side[1:]) is True
        return "number_for_symbol" if has_numbers else "equation_wrong"

    def is_right(self, key: Motion, value: Answer) -> bool:
        """Whether all equations are true, and determine the motion: most mistakes make one false."""
        are_true = (key.is_true(left, right) is True for _, left, right in value[0])
        return all(are_true) and super().is_right(key, value)

    def _complete(self, key: Motion, systems: Sequence[_System], remarks: list[Finding]) -> Outcome:
        whole = [system for system in systems if system.is_complete]
        if key.first_order and not any(system.tops == tuple(key.rates) for system in whole):
            return Outcome.earning(0.0, Finding("second_order_form"), *remarks)
        gaps = [system.gap() for system in whole]
        if all(gaps):
            return Outcome.review(
                f"the equations say less {gaps[0]}", Finding("extra_solutions", "", gaps[0]), *remarks
            )
        is_second = all(len(system.tops) == len(key.coordinates) for system in whole)
        form = [Finding("second_order_form")] if is_second and key.is_hamiltonian else []
        return Outcome.correct(*form, *remarks)

    def mistaken(self, asked: Asked, key: Motion) -> Iterator[tuple[str, Motion]]:
        """The motions that mistakes lead to."""
        for code, rates in of_motion(key):
            yield code, replace(key, rates={**key.rates, **rates})

    def typed(self, key: Motion) -> Tree:
        """The derivatives of the states."""
        return {rate: text(node) for rate, node in key.rates.items()}


def _readings(key: Motion, sides: Sequence[Sides]) -> list[frozenset[str]]:
    """Sets of coordinates that may be meant to have equations of second order."""
    used = names_in_all(sides)
    second = frozenset(name for name in key.coordinates if acceleration(name) in used)
    return list(dict.fromkeys([frozenset(), second, frozenset(key.coordinates if second else ())]))


class _System:
    """The true equations as a linear system for the derivatives.

    For the coordinates `second`, it is one for the accelerations; their momenta, and the derivatives of
    these, are further unknowns where they are used. An equation counts as soon as it is linear in the
    unknowns that no other equation gives.
    """

    def __init__(self, key: Motion, second: frozenset[str], sides: Sequence[Sides]) -> None:
        self.key = key
        partners = {p: q for q, p in zip(key.coordinates, key.momenta, strict=False) if q in second}
        gone = {velocity(name) for name in (*second, *partners)}
        used = names_in_all(sides)
        # Who has an equation for p'' has a p of its own, until another equation ties it to the velocity.
        loose = [p for p in partners if acceleration(p) in used]
        rates = (rate for rate in key.rates if rate not in gone)
        self.tops = (*rates, *map(acceleration, sorted(second)), *loose)
        further = [name for p in partners for name in (p, velocity(p)) if name in used]
        excluded = key.meanings.keys() - {*self.tops, *further, *map(velocity, second), *key.aliases}
        residuals = [bound(Sum((left, Negative(right))), key.aliases) for _, left, right in sides]
        self.residuals = [node for node in residuals if names_in(node).isdisjoint(excluded)]
        # A derivative is determined where it is so whatever the further unknowns are: these come first.
        self.unknowns = list(dict.fromkeys([*further, *self.tops]))
        self.slopes = list[list[Expr]]()
        """Coefficients of each solved unknown; one that never vanishes is enough."""
        while given := self._given():
            self.slopes += given.values()
            self.unknowns = [name for name in self.unknowns if name not in given]
        self.chosen, self.columns = self._rank(self.rows)
        undetermined = {name for k, name in enumerate(self.unknowns) if k not in self.columns}
        self.missing = [name for name in self.tops if name in undetermined]
        self.right = len(self.tops) - len(self.missing)
        self.is_complete = not self.missing

    def _given(self) -> dict[str, list[Expr]]:
        """The unknowns that single equations determine, or some equations together, with their slopes."""
        self.unclear = ""
        self.rows = [row for node in self.residuals if (row := self._row(node)) is not None]
        given: dict[str, list[Expr]] = {}
        for row in self.rows:
            columns = [k for k, slope in enumerate(row) if slope.terms]
            if len(columns) == 1:
                given.setdefault(self.unknowns[columns[0]], []).append(row[columns[0]])
        for row in self.rows if self.unclear and not given else ():
            block = [k for k, slope in enumerate(row) if slope.terms]
            rows = [r for r in self.rows if not any(e.terms for k, e in enumerate(r) if k not in block)]
            chosen, columns = self._rank(rows)
            if block and columns == block:
                with suppress(ExpressionError):
                    whole = determinant([[rows[i][k] for k in block] for i in chosen])
                    return {self.unknowns[k]: [whole] for k in block}
        return given

    def _row(self, residual: Node) -> list[Expr] | None:
        """The derivatives of an equation by the unknowns; None where it is not linear in them."""
        try:
            e = self.key.exact(residual)
            slopes = [expand(derivative(e, name)) if name in e.names else ZERO for name in self.unknowns]
        except ExpressionError as error:
            self.unclear = f"the equations cannot be solved for the derivatives: {error.message}"
            return None
        if any(not slope.names.isdisjoint(self.unknowns) for slope in slopes):
            self.unclear = "an equation is not linear in the derivatives"
            return None
        # What is zero for the motion but for rounding is no slope to solve by.
        return [
            slope
            if slope.terms and any(ball is not None and not ball.contains(0) for ball in self._values(slope))
            else ZERO
            for slope in slopes
        ]

    def _rank(self, rows: list[list[Expr]]) -> tuple[list[int], list[int]]:
        """The rows and columns of the pivots at the first point where all slopes have values."""
        if not rows or not self.unknowns:
            return [], []
        table = [[self._values(slope) for slope in row] for row in rows]
        for place in range(len(table[0][0])):
            matrix = [[entry[place] for entry in row] for row in table]
            if all(ball is not None for row in matrix for ball in row):
                return pivots(matrix)
        return [], []

    def _values(self, slope: Expr) -> list[Ball | None]:
        return self.key.formulas.values(bound(to_tree(slope), self.key.meanings))

    def gap(self) -> str:
        """The states at which the system becomes singular; empty if none."""
        for several in self.slopes:
            gaps = [self._zero(slope) for slope in several]
            if all(gaps):
                return gaps[0]
        if not self.unknowns:
            return ""
        try:
            return self._zero(determinant([[self.rows[i][k] for k in self.columns] for i in self.chosen]))
        except ExpressionError as error:
            return f"where it cannot be worked out: {error.message}"

    def _zero(self, e: Expr) -> str:
        """The states at which a determinant vanishes, though the motion goes on; empty if none."""
        if not e.terms:
            return "everywhere"
        # Where what the rates of the key are divided by is zero, there is no motion.
        poles = set[Atom]()
        for node in self.key.rates.values():
            with suppress(ExpressionError):
                terms = self.key.exact(node).terms
                poles |= {atom for monomial in terms for atom, exponent in monomial if exponent < 0}
        for atom, _ in factored(expand(e))[1]:
            factor = atomic(atom)
            balls = [ball for ball in self._values(factor) if ball is not None]
            changes = len({ball > 0 for ball in balls}) > 1 or any(ball.contains(0) for ball in balls)
            if changes and atom not in poles:
                return f"where `{reading(to_tree(factor))}` is zero"
        return ""


# --- the key: how the states change, from a document or as it is typed


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
    """Names with the derivatives of a motion, in all spellings that the states have."""
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
    """In `{x: ...}` the key x means xdot (or xddot)."""
    return {re.sub("d?dot\\Z", "", rate): rate for rate in key.rates}


def _partners(question: Question, functions: Sequence[str], rates: Mapping[str, Node]) -> dict[str, str]:
    """Pairs (q, p) or (q, v) for which one equation of second order replaces two."""
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
    """The derivatives `tops` that linear equations determine. Raises ValueProblem."""
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


# --- mistakes


def of_motion(key: Motion) -> Iterator[tuple[str, dict[str, Node]]]:
    """The rates that mistakes change.

    Of Hamilton's equations, q' = -dH/dp or p' = dH/dq. Of others, one equation of the wrong sign or all of
    them, and cross terms of Euler's equations.
    """
    turned: dict[str, Node] = {rate: Negative(node) for rate, node in key.rates.items()}
    if key.is_hamiltonian:
        forward, back = (
            {velocity(name): turned[velocity(name)] for name in names}
            for names in (key.coordinates, key.momenta)
        )
        yield from (("hamilton_sign", rates) for rates in (back, forward, {**forward, **back}))
        return
    yield from (("sign_error", {rate: node}) for rate, node in turned.items())
    yield "sign_error", turned
    crossed = _other_cross_terms(key)
    for count in (1, 2, 3):
        yield from (("euler_sign", dict(some)) for some in combinations(crossed.items(), count))


def _other_cross_terms(key: Motion) -> dict[str, Node]:
    """Euler's three rates with the products of the other two of the wrong sign; none for other motions."""
    functions = {state_of(rate) for rate in key.rates}
    turned: dict[str, Node] = {}
    for rate, node in key.rates.items():
        e = expand(key.exact(node))
        others = functions - {state_of(rate)}
        crossed = [Expr({m: c}) for m, c in e.terms.items() if others <= Expr({m: c}).names]
        if len(functions) != 3 or not crossed:
            return {}
        turned[rate] = to_tree(e - total(crossed) - total(crossed))
    return turned
