"""Equations of motion: a set is right if each is true of the motion, and together they determine it.

They may be Hamilton's or any others of first order, or of second order; solved for derivatives or not. To
determine the motion is to leave one motion only through every state: `p p' = -k x p` says nothing where
p = 0. Where that cannot be decided, a person has to look.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import ClassVar, TypeAlias

from rigidcli.algebra.atoms import Atom
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ZERO, Expr, atomic, factored
from rigidcli.algebra.matrices import determinant
from rigidcli.algebra.trees import to_tree
from rigidcli.document.variables import acceleration, velocity
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.homework.balls import Ball, pivots
from rigidcli.homework.base import Asked, Finding, Kind, Outcome, Reading, Tree, Unreadable
from rigidcli.homework.mistakes import of_motion
from rigidcli.homework.motions import Motion, of_document, of_functions, of_text
from rigidcli.homework.numbers import CONTRADICTION
from rigidcli.homework.reading import Sides, names_in_all, read_equations
from rigidcli.language.text import reading, text, without_doubt
from rigidcli.language.tree import Negative, Node, Sum, bound, names_in

Answer: TypeAlias = tuple[Sequence[Sides], Sequence[Finding]]
"""The equations that can be read, and what is wrong with the others."""


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
        """The code of an equation that is not true."""
        given = replace(key, formulas=key.formulas.with_values())
        has_numbers = bool(key.names.values) and given.is_true(*side[1:]) is True
        return "number_for_symbol" if has_numbers else "equation_wrong"

    def is_right(self, key: Motion, value: Answer) -> bool:
        """Whether all equations are true, and determine the motion: most mistakes make one false."""
        are_true = (key.is_true(left, right) is True for _, left, right in value[0])
        return all(are_true) and super().is_right(key, value)

    def _complete(self, key: Motion, systems: Sequence[_System], remarks: list[Finding]) -> Outcome:
        """The outcome of true equations that determine the motion in general states."""
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
    """The coordinates that may be meant to have equations of second order: none, those that do, or all."""
    used = names_in_all(sides)
    second = frozenset(name for name in key.coordinates if acceleration(name) in used)
    return list(dict.fromkeys([frozenset(), second, frozenset(key.coordinates if second else ())]))


class _System:
    """True equations as linear equations for derivatives: for some coordinates for the `second` ones.

    The momenta of such coordinates, and their derivatives, are further unknowns where they are used.
    An equation counts as soon as it is linear in the unknowns that others do not give.
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
        """Factors of unknowns that are given: it is enough if one of a list vanishes nowhere."""
        while given := self._given():
            self.slopes += given.values()
            self.unknowns = [name for name in self.unknowns if name not in given]
        self.chosen, self.columns = self._rank(self.rows)
        undetermined = {name for k, name in enumerate(self.unknowns) if k not in self.columns}
        self.missing = [name for name in self.tops if name in undetermined]
        self.right = len(self.tops) - len(self.missing)
        self.is_complete = not self.missing

    def _given(self) -> dict[str, list[Expr]]:
        """The unknowns that single equations give, or that some equations give together."""
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
        """The slopes of an equation by the unknowns; None for an equation in which they are not linear."""
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
        """The rows and the columns that hold pivots at the first point where all slopes have values."""
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
        """Where equations that determine the motion in general do not; empty where they do everywhere."""
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
        """Where a determinant vanishes, though the motion goes on; empty where it does so nowhere."""
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
