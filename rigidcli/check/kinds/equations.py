"""Equations of motion: a set is right if each is true of the motion, and together they determine it.

They may be Hamilton's or any others of first order, or of second order; solved for derivatives or not. To
determine the motion is to leave one motion only through every state: `p p' = -k x p` says nothing where
p = 0. Where that cannot be decided, a person has to look.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import ClassVar

from rigidcli.algebra.atoms import Atom
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ZERO, Expr, atomic, factored
from rigidcli.algebra.matrices import determinant
from rigidcli.algebra.trees import to_tree
from rigidcli.check.balls import Ball
from rigidcli.check.base import (
    Asked,
    Finding,
    Kind,
    Outcome,
    Reading,
    Tree,
    Unreadable,
    correct,
    earning,
    review,
)
from rigidcli.check.motions import Motion, of_document, of_functions, of_text, state_of
from rigidcli.check.reading import Sides, plain, read_equations
from rigidcli.check.same import same, values
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.language.text import text
from rigidcli.language.tree import Negative, Node, Sum, bound, names_in

MAX_CHOICES = 50
"""The most ways to choose equations that are tried, for some of them to determine the motion everywhere."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The equations that can be read, and what is wrong with the others."""

    sides: tuple[Sides, ...]
    unread: tuple[Finding, ...] = ()


class Equations(Kind):
    """Equations of motion."""

    name: ClassVar[str] = "equations"
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
        if any(all(v is None for v in values(rate, key.names, asked.name)) for rate in key.rates.values()):
            raise ValueProblem("the equations have no values at most states")
        return replace(
            key,
            first_order=asked.question.form == "first_order",
            relative=asked.question.tolerance.relative,
            numbers=asked.question.numbers == "allowed" and bool(key.names.values),
        )

    def read(self, key: Motion, answer: Tree, folder: Path) -> Reading:
        """The equations of an answer; one that cannot be read costs only itself. Raises Unreadable."""
        unread: list[Unreadable] = []
        sides = read_equations(answer, key.names, of_functions(key), unread)
        shown = "; ".join(f"{plain(left)} = {plain(right)}" for _, left, right in sides)
        findings = tuple(finding for each in unread for finding in each.findings)
        return Reading(Answer(tuple(sides), findings), shown)

    def judge(self, key: Motion, value: Answer) -> Outcome:
        """What is true, what determines the motion, and what is too much."""
        trivial = [
            place for place, left, right in value.sides if same(left, right, key.names, key.name) is True
        ]
        kept = [side for side in value.sides if side[0] not in trivial or not side[0]]
        kept = [side for side in kept if side[0] or not trivial]
        truths = [key.is_true(left, right) for _, left, right in kept]
        remarks = [Finding("trivial_equation", place) for place in trivial] + list(value.unread)
        true = [side for side, truth in zip(kept, truths, strict=True) if truth is True]
        wrong = [side[0] for side, truth in zip(kept, truths, strict=True) if truth is False]
        systems = [_System(key, tops, true) for tops in key.tops]
        best = max(
            systems, key=lambda system: (system.rank == len(system.tops), system.rank / len(system.tops))
        )
        is_complete = best.rank == len(best.tops)
        opened = [truth for truth in truths if isinstance(truth, str)]
        if opened and not wrong:
            return review(f"it is not proved that the equation is true: {opened[0]}", *remarks)
        if not wrong and is_complete:
            return self._complete(key, systems, remarks)
        findings = [Finding("equation_wrong", place) for place in wrong]
        if len(kept) > len(best.tops) and findings:
            findings = findings[:1] if len(findings) == 1 else [Finding("equation_wrong", "one or more")]
        if not is_complete:
            if best.unclear and not wrong:
                return review(best.unclear, *remarks)
            findings.append(Finding("missing_equation", ", ".join(best.missing)))
        surplus = max(0, best.rank + len(wrong) - len(best.tops))
        return earning((best.rank - surplus) / len(best.tops), *findings, *remarks)

    def _complete(self, key: Motion, systems: Sequence[_System], remarks: list[Finding]) -> Outcome:
        """The outcome of true equations that determine the motion in general states."""
        whole = [system for system in systems if system.rank == len(system.tops)]
        is_second = whole[0].tops != tuple(key.rates)
        if is_second and key.first_order:
            return earning(0.0, Finding("second_order_form"), *remarks)
        gaps = [system.gap() for system in whole]
        if all(gaps):
            return review(
                f"the equations say less {gaps[0]}", Finding("extra_solutions", "", gaps[0]), *remarks
            )
        form = [Finding("second_order_form")] if is_second and key.is_hamiltonian else []
        return correct(*form, *remarks)

    def typed(self, key: Motion) -> Tree:
        """The derivatives of the states."""
        return {rate: text(node) for rate, node in key.rates.items()}

    def names(self, key: Motion) -> frozenset[str]:
        """The symbols in the equations."""
        return frozenset().union(*map(names_in, key.rates.values()), map(state_of, key.rates))


class _System:
    """True equations as linear equations for some derivatives, the `tops`."""

    def __init__(self, key: Motion, tops: tuple[str, ...], sides: Sequence[Sides]) -> None:
        self.key, self.tops = key, tops
        self.unclear = ""
        self.rows: list[list[Expr]] = []
        for _, left, right in sides:
            self._add(Sum((left, Negative(right))))
        self.rank, self.chosen, self.missing = 0, list[int](), list(tops)
        table = [[self._values(slope) for slope in row] for row in self.rows]
        for place in range(len(table[0][0]) if table and table[0] else 0):
            matrix = [[entry[place] for entry in row] for row in table]
            if all(ball is not None for row in matrix for ball in row):
                self.chosen, columns = _pivots(matrix)
                self.rank = len(self.chosen)
                self.missing = [top for k, top in enumerate(tops) if k not in columns]
                break

    def _add(self, residual: Node) -> None:
        """The slopes of an equation by the tops; an equation in which they are not linear has none."""
        try:
            e = self.key.exact(bound(residual, self.key.aliases))
            slopes = [expand(derivative(e, top)) if top in e.names else ZERO for top in self.tops]
        except ExpressionError as error:
            self.unclear = f"the equations cannot be solved for the derivatives: {error.message}"
            return
        if any(not slope.names.isdisjoint(self.tops) for slope in slopes):
            self.unclear = "an equation is not linear in the derivatives"
            return
        self.rows.append(slopes)

    def _values(self, slope: Expr) -> list[Ball | None]:
        names = replace(self.key.names, derived={})
        return values(bound(to_tree(slope), self.key.meanings), names, self.key.name)

    def gap(self) -> str:
        """Where equations that determine the motion in general do not; empty where they do everywhere."""
        first = ""
        choices = [tuple(self.chosen), *combinations(range(len(self.rows)), len(self.tops))][:MAX_CHOICES]
        for chosen in choices:
            try:
                found = self._zero(determinant([self.rows[k] for k in chosen]))
            except ExpressionError as error:
                found = f"where it cannot be worked out: {error.message}"
            if not found:
                return ""
            first = first or found
        return first

    def _zero(self, e: Expr) -> str:
        """Where a determinant vanishes, though the motion goes on; empty where it does so nowhere."""
        if not e.terms:
            return "everywhere"
        for atom, _ in factored(expand(e))[1]:
            node = to_tree(atomic(atom))
            signs = {
                ball > 0 for ball in self._values(atomic(atom)) if ball is not None and not ball.contains(0)
            }
            if len(signs) > 1 and atom not in self._poles:
                return f"where `{plain(node)}` is zero"
        return ""

    @cached_property
    def _poles(self) -> set[Atom]:
        """What the rates of the key are divided by: where it is zero, there is no motion."""
        found = set[Atom]()
        for node in self.key.rates.values():
            with suppress(ExpressionError):
                for monomial in self.key.exact(node).terms:
                    found |= {atom for atom, exponent in monomial if exponent < 0}
        return found


def _pivots(matrix: list[list[Ball]]) -> tuple[list[int], list[int]]:
    """The rows and the columns of pivots that are certainly not zero, by elimination."""
    rows = {place: list(row) for place, row in enumerate(matrix)}
    chosen: list[int] = []
    columns: list[int] = []
    for column in range(len(matrix[0]) if matrix else 0):
        usable = [place for place in rows if place not in chosen and not rows[place][column].contains(0)]
        if not usable:
            continue
        pivot = max(usable, key=lambda place: float(rows[place][column].abs_lower()))
        for place, row in rows.items():
            if place != pivot and place not in chosen:
                factor = row[column] / rows[pivot][column]
                rows[place] = [a - factor * b for a, b in zip(row, rows[pivot], strict=True)]
        chosen.append(pivot)
        columns.append(column)
    return sorted(chosen), columns
