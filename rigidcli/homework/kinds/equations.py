"""Equations of motion, and what is conserved: a set is right if each is true, and all determine the motion.

They may be Hamilton's or any others of first order, or of second order; solved for derivatives or not. To
determine the motion is to leave one motion only through every state: `p p' = -k x p` says nothing where
p = 0. Where that cannot be decided, a person has to look.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import TypeAlias

from rigidcli.algebra.atoms import Atom
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ONE, ZERO, Expr, atomic, factored, symbol, total
from rigidcli.algebra.matrices import Matrix, determinant, null_vectors
from rigidcli.algebra.substitution import from_tree
from rigidcli.algebra.trees import to_tree
from rigidcli.document.phase_space import acceleration, momentum, velocity
from rigidcli.errors import ExpressionError, ValueProblem, shown
from rigidcli.homework.base import AnswerKind, Finding, KeySource, Outcome, ReadAnswer, Tree, Unreadable
from rigidcli.homework.entries import chosen
from rigidcli.homework.kinds.arrays import MOST_ENTRIES, numbered
from rigidcli.homework.lists import read_list
from rigidcli.homework.numbers import CONTRADICTION
from rigidcli.homework.question import OF_FORMULAS, Question
from rigidcli.homework.reading import (
    Domain,
    Names,
    Sides,
    in_other_letters,
    names_of,
    read_equations,
    read_expressions,
)
from rigidcli.homework.same import Ball, FormulaComparison, formulas_of
from rigidcli.language.text import reading, text, without_doubt
from rigidcli.language.tree import Name, Negative, Node, Sum, bound, names_in
from rigidcli.language.words import said
from rigidcli.mechanics.phase_space import linear

# The equations that can be read, and what is wrong with the others.
Answer: TypeAlias = tuple[Sequence[Sides], Sequence[Finding]]
_DERIVATIVE = re.compile(r"(.+?)(d?)dot")
# Names of momenta: `p`, `px`, `p1`, `p_theta`.
_MOMENTUM = re.compile(r"[pP](?:[a-zA-Z]?\d*|_\w+|theta|phi|psi)")


class EquationsKind(AnswerKind):
    """Equations of motion."""

    name = "equations"
    has_tolerance = False
    options = OF_FORMULAS | {"form"}

    def key(self, source: KeySource) -> MotionKey:
        try:
            key = of_text(source) if source.report is None else of_document(source)
        except Unreadable as unreadable:
            message = f"the equations of the key cannot be read: {unreadable.findings[0].code}"
            raise ValueProblem(message) from None
        except ExpressionError as error:
            raise ValueProblem(f"the equations of the key cannot be worked with: {error.message}") from None
        if source.question.form == "first_order" and any(rate.endswith("ddot") for rate in key.rates):
            raise ValueProblem("the equations are of second order, and first order is asked for")
        if any(all(v is None for v in key.formulas.values(rate)) for rate in key.rates.values()):
            raise ValueProblem("the equations have no values at most states")
        return replace(key, first_order=source.question.form == "first_order")

    def read(self, key: MotionKey, answer: Tree) -> ReadAnswer:
        """The equations of an answer; one that cannot be read costs only itself. Raises Unreadable."""
        # In `{x: ...}` the key x means xdot (or xddot).
        tops_of = {re.sub(r"d?dot\Z", "", rate): rate for rate in key.rates}
        found = read_equations(answer, key.formulas.names, tops_of, key.is_true)
        differ = any(key.is_true(member, last) is False for _, member, last in found.between)
        findings = [finding for each in found.unread for finding in each.findings]
        return ReadAnswer((found.sides, findings), found.read_as, CONTRADICTION if differ else "")

    def judge(self, key: MotionKey, value: Answer) -> Outcome:
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
        # Equations of second order may be meant for coordinates whose accelerations stand there, or for all.
        used = _names_in_all(true)
        second = frozenset(name for name in key.coordinates if acceleration(name) in used)
        orders = dict.fromkeys([frozenset(), second, frozenset(key.coordinates if second else ())])
        systems = [_system_of(key, order, true) for order in orders]
        best = max(systems, key=lambda system: (system.share, not system.unclear))
        if not best.missing and not false:
            return self._complete(key, systems, remarks)
        if best.unclear and not false:
            return Outcome.review(best.unclear, *remarks)
        findings, with_values = list[Finding](), replace(key, formulas=replace(key.formulas, numbers=True))
        for place, left, right in false:
            is_number = with_values.is_true(left, right) is True
            findings.append(Finding("number_for_symbol" if is_number else "equation_wrong", place))
        if len(findings) > 1 and len(kept) > len(best.tops):  # of many guesses, none is pointed out
            findings = [Finding("equation_wrong", "one or more")]
        # A wrong equation stands in the place of a missing one.
        if len(best.missing) > len(false):
            lacking = ", ".join(name for name in best.missing if name not in {side[0] for side in false})
            findings.append(Finding("missing_equation", lacking))
        surplus = max(0, len(false) - len(best.missing)) / len(best.tops)
        return Outcome.earning(best.share - surplus, *findings, *remarks)

    def is_right(self, key: MotionKey, value: Answer) -> bool:
        """Whether all equations are true, and determine the motion: most mistakes make one false."""
        are_true = (key.is_true(left, right) is True for _, left, right in value[0])
        return all(are_true) and super().is_right(key, value)

    def _complete(self, key: MotionKey, systems: Sequence[_System], remarks: list[Finding]) -> Outcome:
        whole = [system for system in systems if not system.missing]
        if key.first_order and not any(system.tops == tuple(key.rates) for system in whole):
            return Outcome.earning(0.0, Finding("second_order_form"), *remarks)
        gaps = [system.gap(key) for system in whole]
        if all(gaps):
            lost = Finding("extra_solutions", "", gaps[0])
            return Outcome.review(f"the equations say less {gaps[0]}", lost, *remarks)
        is_second = all(len(system.tops) == len(key.coordinates) for system in whole)
        form = [Finding("second_order_form")] if is_second and key.is_hamiltonian else []
        return Outcome.correct(*form, *remarks)

    def mistaken(self, source: KeySource, key: MotionKey) -> Iterator[tuple[str, MotionKey]]:
        for code, rates in of_motion(key):
            yield code, replace(key, rates={**key.rates, **rates})

    def typed(self, key: MotionKey) -> Tree:
        return {rate: text(node) for rate, node in key.rates.items()}


def _names_in_all(sides: Sequence[Sides]) -> set[str]:
    return {name for _, left, right in sides for side in (left, right) for name in names_in(side)}


@dataclass(frozen=True, slots=True)
class _System:
    """True equations as a linear system for the derivatives `tops`; some of these may be `missing`.

    Each of the `blocks` determines some unknowns. It has one or more matrices of slopes, of which one whose
    determinant never vanishes is enough. `unclear` says why an equation could not be used.
    """

    tops: tuple[str, ...]
    missing: list[str]
    blocks: Sequence[Sequence[Matrix]]
    unclear: str

    @property
    def share(self) -> float:
        """The share of the derivatives that are determined in general states."""
        return 1 - len(self.missing) / len(self.tops)

    def gap(self, key: MotionKey) -> str:
        """The states at which the system becomes singular; empty if none."""
        for matrices in self.blocks:
            try:
                gaps = [_zeros(key, determinant(matrix)) for matrix in matrices]
            except ExpressionError as error:
                return f"where it cannot be worked out: {error.message}"
            if all(gaps):
                return gaps[0]
        return ""


def _system_of(key: MotionKey, second: frozenset[str], sides: Sequence[Sides]) -> _System:
    """The system of true equations, for the accelerations of the coordinates `second`.

    The momenta of these, and the derivatives of the momenta, are further unknowns where they are used. An
    equation counts as soon as it is linear in the unknowns that no other equations determine.
    """
    partners = {p: q for q, p in zip(key.coordinates, key.momenta, strict=False) if q in second}
    gone = {velocity(name) for name in (*second, *partners)}
    used = _names_in_all(sides)
    # Who has an equation for p'' has a p of its own, until another equation ties it to the velocity.
    loose = [p for p in partners if acceleration(p) in used]
    tops = (*(rate for rate in key.rates if rate not in gone), *map(acceleration, sorted(second)), *loose)
    further = [name for p in partners for name in (p, velocity(p)) if name in used]
    excluded = key.meanings.keys() - {*tops, *further, *map(velocity, second)}
    residuals = [Sum((left, Negative(right))) for _, left, right in sides]
    residuals = [node for node in residuals if names_in(node).isdisjoint(excluded)]
    # A derivative is determined where it is so whatever the further unknowns are: these come first.
    unknowns, blocks = list(dict.fromkeys([*further, *tops])), list[list[Matrix]]()
    while True:
        rows, unclear = _rows(key, residuals, unknowns)
        given = set[str]()
        # Equations with the same unknowns may determine these by themselves, or else all equations together.
        for together in sorted([*map(set, rows), set(unknowns)], key=len):
            names = [name for name in unknowns if name in together - given]
            usable = [row for row in rows if row.keys() <= together | given]
            within = [_of(row, names) for row in usable if not row.keys().isdisjoint(names)]
            chosen, columns = key.pivots(within)
            if names and len(columns) == len(names):
                several = [chosen] if len(names) > 1 else [[place] for place in range(len(within))]
                blocks.append([[within[place] for place in places] for places in several])
                given.update(names)
        unknowns = [name for name in unknowns if name not in given]
        if not given or not unclear:
            break
    columns = key.pivots([_of(row, unknowns) for row in rows])[1]
    undetermined = {name for k, name in enumerate(unknowns) if k not in columns}
    return _System(tops, [name for name in tops if name in undetermined], blocks, unclear)


def _of(row: Mapping[str, Expr], names: Sequence[str]) -> list[Expr]:
    return [row.get(name, ZERO) for name in names]


def _rows(
    key: MotionKey, residuals: Sequence[Node], unknowns: Sequence[str]
) -> tuple[list[dict[str, Expr]], str]:
    """The slopes of linear equations by their unknowns, and why other equations are left out."""
    rows, unclear = list[dict[str, Expr]](), ""
    for residual in residuals:
        try:
            e = key.formulas.exact(residual)
            slopes = {name: expand(derivative(e, name)) for name in unknowns if name in e.names}
        except ExpressionError as error:
            unclear = f"the equations cannot be solved for the derivatives: {error.message}"
            continue
        if any(not slope.names.isdisjoint(unknowns) for slope in slopes.values()):
            unclear = "an equation is not linear in the derivatives"
            continue
        # What is zero for the motion but for rounding is no slope to solve by.
        values = {name: key.values(slope) for name, slope in slopes.items()}
        zero = {n for n, balls in values.items() if all(ball is None or ball.contains(0) for ball in balls)}
        rows.append({name: slope for name, slope in slopes.items() if name not in zero})
    return rows, unclear


def _zeros(key: MotionKey, e: Expr) -> str:
    """The states at which a determinant vanishes, though the motion goes on; empty if none."""
    # Where what the rates of the key are divided by is zero, there is no motion.
    poles = set[Atom]()
    for node in key.rates.values():
        with suppress(ExpressionError):
            terms = key.formulas.exact(node).terms
            poles |= {atom for monomial in terms for atom, exponent in monomial if exponent < 0}
    for atom, _ in factored(expand(e))[1]:
        factor = atomic(atom)
        balls = [ball for ball in key.values(factor) if ball is not None]
        changes = len({ball > 0 for ball in balls}) > 1 or any(ball.contains(0) for ball in balls)
        if changes and atom not in poles:
            return f"where `{reading(to_tree(factor))}` is zero"
    return ""


# --- the key: how the states change, from a document or as it is typed


@dataclass(frozen=True, eq=False)
class MotionKey:
    """The motion: how the states change, and which second derivatives an answer may have.

    `rates` has the derivatives of the states: `xdot` and `p_xdot`, or `xddot` where `xdot` is a state itself.
    Equations of second order may be for `coordinates`, whose `momenta` (or velocities) are states, too.
    """

    formulas: FormulaComparison
    rates: Mapping[str, Node]
    coordinates: tuple[str, ...] = ()
    momenta: tuple[str, ...] = ()
    is_hamiltonian: bool = False
    first_order: bool = False

    @cached_property
    def meanings(self) -> dict[str, Node]:
        """The derivatives of all kinds as formulas in the states."""
        rates = dict(self.rates)
        with suppress(ExpressionError):
            for name in (*self.coordinates, *self.momenta):
                rates.setdefault(acceleration(name), self.change(rates[velocity(name)]))
        return rates

    def change(self, node: Node) -> Node:
        """The time derivative of a formula in the states, by the chain rule."""
        e = self.formulas.exact(node)
        parts = [derivative(e, "t")]
        for rate, of_state in self.rates.items():
            state = state_of(rate)
            if state in e.names:
                parts.append(derivative(e, state) * self.formulas.exact(of_state))
        return to_tree(total(parts))

    def values(self, e: Expr) -> list[Ball | None]:
        """The values of an expression, which may hold derivatives, at the test points."""
        return self.formulas.values(bound(to_tree(e), self.meanings))

    def pivots(self, rows: Sequence[Sequence[Expr]]) -> tuple[list[int], list[int]]:
        """The rows and columns of the pivots of a matrix, which may hold derivatives."""
        return self.formulas.pivots([[bound(to_tree(e), self.meanings) for e in row] for row in rows])

    def is_true(self, left: Node, right: Node) -> bool | str:
        """Whether an equation holds for the motion in all states."""
        both = [bound(self.formulas.names.without_derived(side), self.meanings) for side in (left, right)]
        if self.formulas.relative is None:
            rates = list(self.rates.values())
            outcome = self.formulas.same(both[0], both[1], beside=rates)
            return outcome if outcome is not True else self.formulas.same(both[1], both[0], beside=rates)
        with suppress(ExpressionError):  # a tolerance is relative to the terms of the equation
            gap = to_tree(expand(self.formulas.exact(Sum((left, Negative(right))))))
            both = [to_tree(ZERO), bound(gap, self.meanings)]
        return self.formulas.same(both[0], both[1])


def state_of(rate: str) -> str:
    """The state whose derivative this is."""
    return f"{rate.removesuffix('ddot')}dot" if rate.endswith("ddot") else rate.removesuffix("dot")


def of_document(source: KeySource) -> MotionKey:
    """The motion by the equations in a report. Raises ValueProblem."""
    equations = source.value
    if source.path[-1:] != ("equations",) or not isinstance(equations, Mapping) or len(equations) % 2:
        raise ValueProblem("this result has no equations of motion, expected `hamilton.equations`")
    states, half = tuple(equations), len(equations) // 2
    rates = {velocity(name): to_tree(rate) for name, rate in equations.items()}
    names = _with_rates(names_of(source), states, [*rates, *map(acceleration, states)])
    formulas = formulas_of(source, names, source.question.tolerance.relative)
    return MotionKey(formulas, rates, states[:half], states[half:], is_hamiltonian=True)


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


def of_text(source: KeySource) -> MotionKey:
    """The motion by equations as they are typed. Raises ValueProblem."""
    question = source.question
    keys = [key.strip() for key in source.value] if isinstance(source.value, dict) else []
    tops_of = {key: velocity(key) for key in keys if key.isidentifier() and not _DERIVATIVE.fullmatch(key)}
    sides, unread, _ = read_equations(source.value, None, tops_of)
    if unread:
        raise unread[0]
    used = _names_in_all(sides)
    functions = _functions(question, used)
    if not functions:
        raise ValueProblem("the equations hold no derivative, expected names such as `xdot`")
    for name, speed in zip(question.coordinates, question.velocities, strict=False):
        if speed not in (velocity(name), *functions):
            hint = f"write them with `{velocity(name)}: {speed}` and an equation for `{velocity(speed)}`"
            raise ValueProblem(f"the equations do not say what {shown(speed)} is", hint=hint)
    second = tuple(name for name in functions if acceleration(name) in used)
    tops = [acceleration(name) if name in second else velocity(name) for name in functions]
    rates = _solved([(left, right) for _, left, right in sides], tops)
    states = [*functions, *map(velocity, second)]
    names = names_of(source, used - {*tops, *states})
    partners = {} if second else _partners(question, functions, rates)
    second_rates = [acceleration(name) for pair in partners.items() for name in pair]
    names = _with_rates(names, states, [*rates, *second_rates, *map(velocity, functions)])
    formulas = formulas_of(source, names, question.tolerance.relative)
    return MotionKey(formulas, rates, tuple(partners), tuple(partners.values()))


def _functions(question: Question, used: Collection[str]) -> tuple[str, ...]:
    """The functions of the time: coordinates, momenta, and what has a derivative in the equations."""
    functions = [*question.coordinates, *question.momenta]
    fixed = set(question.symbols or ()) - {*functions}
    for name in sorted(used):
        derivative_of = _DERIVATIVE.fullmatch(name)
        if derivative_of and (name not in fixed or derivative_of[1] in used):
            functions.append(derivative_of[1])
    return tuple(dict.fromkeys(functions))


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
    found = linear([from_tree(Sum((left, Negative(right)))) for left, right in sides], tops)
    if found is None:
        raise ValueProblem("the equations are not linear in the derivatives")
    if len(sides) != len(tops):
        raise ValueProblem(f"{len(sides)} equations do not go with {len(tops)} unknown functions of the time")
    vectors = null_vectors([[*slopes, rest] for slopes, rest in zip(*found, strict=True)])
    if len(vectors) != 1 or vectors[0][-1] != ONE:
        raise ValueProblem("the equations do not determine the derivatives")
    return {top: to_tree(rate) for top, rate in zip(tops, vectors[0], strict=False)}


# --- mistakes


def of_motion(key: MotionKey) -> Iterator[tuple[str, dict[str, Node]]]:
    """The rates that mistakes change: signs of Hamilton's equations or of others, Euler's cross terms."""
    turned: dict[str, Node] = {rate: Negative(node) for rate, node in key.rates.items()}
    if key.is_hamiltonian:
        forward = {rate: turned[rate] for rate in map(velocity, key.coordinates)}
        back = {rate: turned[rate] for rate in map(velocity, key.momenta)}
        yield from (("hamilton_sign", rates) for rates in (back, forward, {**forward, **back}))
        return
    yield from (("sign_error", {rate: node}) for rate, node in turned.items())
    yield "sign_error", turned
    crossed = _other_cross_terms(key)
    for count in (1, 2, 3):
        yield from (("euler_sign", dict(some)) for some in combinations(crossed.items(), count))


def _other_cross_terms(key: MotionKey) -> dict[str, Node]:
    """Euler's three rates with the products of the other two of the wrong sign; none for other motions."""
    turned = dict[str, Node]()
    for rate, node in key.rates.items():
        others = {state_of(other) for other in key.rates} - {state_of(rate)}
        ways = (others, [min(others, default="")])
        back = [{name: Negative(Name(name)) for name in names} for names in ways]
        if len(others) != 2 or key.formulas.same(bound(node, back[0]), node) is not True:
            return {}
        turned[rate] = bound(node, back[1])
    return turned


# --- conserved quantities: as many as the key has, none of them a function of H and the others

# A quantity F(q, p, t) is conserved if its time derivative by the chain rule, {F, H} + dF/dt, vanishes.
# Quantities are independent if their gradients are, so that a multiple of the key, a sum or a product of two
# is as right.
# Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, section 9.6.

# What says that a quantity is conserved, around it: `d/dt(F) = 0`, `F = const`, `F is conserved`.
_RATE_IS_ZERO = re.compile(
    r"(?m)^\s*(?:d\s*/\s*dt|\\d?frac\{\s*(?:\\mathrm\{d\}|d)\s*\}\{\s*(?:\\mathrm\{d\}|d)\s*t\s*\})\s*"
    r"(?:\\left)?[(\[](?P<of>[^=\n]*?)(?:\\right)?[)\]]\s*=\s*0\s*$"
)
_IS_CONSERVED = re.compile(
    rf"(?im)\s*(?:=|\b{said('is')})\s*(?:{said('a')}\s)?"
    rf"(?:{said('constant')}|(?:cst|conserved|conservée?|conservad[ao]|erhalten)\b)\.?\s*$"
)
NOTHING_NEW = "it is a function of H, of the momenta that are conserved, or of the other quantities"


@dataclass(frozen=True, eq=False)
class InvariantsKey:
    """The right quantities, and the motion in which others must keep their values.

    None may be a function of the `known` quantities alone: H and the momenta that are conserved anyway.
    """

    quantities: tuple[Node, ...]
    known: tuple[Node, ...]
    motion: MotionKey

    def is_conserved(self, node: Node) -> bool | str:
        """Whether a quantity keeps its value, or why that is open."""
        try:
            return self.motion.formulas.vanish([self.motion.change(bound(node, self.motion.meanings))])
        except ExpressionError as error:
            return f"its rate of change cannot be worked out: {error.message}"

    def rank(self, nodes: Sequence[Node]) -> int:
        """How many quantities are independent: the largest rank of their gradients at the points."""
        exact = [self.motion.formulas.exact(bound(node, self.motion.meanings)) for node in nodes]
        states = list(map(state_of, self.motion.rates))
        return len(self.motion.pivots([[derivative(e, name) for name in states] for e in exact])[0])


class InvariantsKind(AnswerKind):
    """Further conserved quantities of a system, in any independent combination."""

    name = "invariants"
    has_tolerance = False
    options = OF_FORMULAS

    def key(self, source: KeySource) -> InvariantsKey:
        if source.report is None:
            hint = "ask a document for `hamilton.invariants`, or give one formula of kind `expression`"
            raise ValueProblem("what is conserved follows from a document", hint=hint)
        results = source.report.tree
        if source.path[-1] != "invariants" or not source.value:
            hint = "there are `hamilton.cyclic` and `hamilton.conserved`, too"
            raise ValueProblem("this result has no conserved quantities", hint=hint)
        motion = of_document(replace(source, value=results["equations"], path=("hamilton", "equations")))
        motion = replace(motion, formulas=formulas_of(source, names_of(source)))
        known = [results["hamiltonian"] if name == "H" else symbol(name) for name in results["conserved"]]
        return InvariantsKey(tuple(map(to_tree, source.value)), tuple(map(to_tree, known)), motion)

    def read(self, key: InvariantsKey, answer: Tree) -> ReadAnswer:
        """A list of formulas, perhaps named; of several readings one that is conserved. Raises Unreadable."""
        answer = list(map(_quantity, answer)) if isinstance(answer, list) else _quantity(answer)
        table = read_list(answer, is_square=True)  # so that the y of `y p_x` is no unit vector
        cells = list(table.values()) if isinstance(table, dict) else table
        if len(cells) > MOST_ENTRIES:
            raise Unreadable("too_large", f"expected at most {MOST_ENTRIES} formulas")
        places = zip(cells, numbered("quantity", len(cells)), strict=True)
        several = [read_expressions(cell, key.motion.formulas.names, place) for cell, place in places]
        nodes = [chosen(readings, key.is_conserved) for readings in several]
        return ReadAnswer(tuple(nodes), "; ".join(map(without_doubt, nodes)))

    def judge(self, key: InvariantsKey, value: Sequence[Node]) -> Outcome:
        """New conserved quantities earn their share; more formulas than the key has cost as much."""
        kept, findings, count = list(key.known), list[Finding](), len(key.quantities)
        rank = known = key.rank(kept)
        for place, node in zip(numbered("quantity", len(value)), value, strict=True):
            truth = key.is_conserved(node)
            if isinstance(truth, str):
                return Outcome.review(truth)
            if not truth:
                findings.append(Finding("component_wrong", place, "it is not conserved"))
            elif (more := key.rank([*kept, node])) > rank:
                kept, rank = [*kept, node], more
            else:
                findings.append(Finding("component_wrong", place, NOTHING_NEW))
        if len(value) < count:
            findings.append(Finding("wrong_shape", detail=f"read {len(value)}, expected {count}"))
        new = rank - known
        surplus = len(value) - max(new, count)
        return Outcome.earning((min(new, count) - max(surplus, 0)) / count, *findings)

    def typed(self, key: InvariantsKey) -> Tree:
        return list(map(text, key.quantities))


def _quantity(typed: Tree) -> Tree:
    """What is said to be conserved in a text, without the words that say so."""
    if not isinstance(typed, str):
        return typed
    return _IS_CONSERVED.sub("", _RATE_IS_ZERO.sub(r"\g<of>", typed))
