"""Equations of motion, in any form: a set is right if each is true, and together they determine the motion.

They may be of first order, Hamilton's or others, or of second order; solved for derivatives or not,
multiplied, added to each other, and mixed. To determine the motion is to leave one motion only through every
state. So m x' x'' + k x x' = 0, which the conservation of energy gives, is not enough: it says nothing at
rest, and at x' = 0 the body may stay where it is. What cannot be proved, a person has to look at.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import symbol, total
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.document.variables import velocity
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.equations import key as equation_key
from rigidcli.grading.equations.domain import nonzero
from rigidcli.grading.equations.key import Key
from rigidcli.grading.equations.mistakes import mistakes
from rigidcli.grading.equations.solution import Solution
from rigidcli.grading.equations.system import System
from rigidcli.grading.equations.text import Equation, equations
from rigidcli.grading.equations.truth import STATES, has_zeros, states
from rigidcli.grading.kinds.base import Example, Kind
from rigidcli.grading.mistakes import variants
from rigidcli.grading.outcome import Finding, Outcome, correct, review, wrong
from rigidcli.language.text import text
from rigidcli.mechanics.energies import TIME

LONGEST_EXAMPLE = 4000
"""Characters of an equation of an example."""

FEWEST = STATES // 4
"""States at which a key must have values."""

MOST_NAMED = 8
"""Derivatives that a finding names."""

Answer = tuple[Equation, ...]


class Equations(Kind):
    """Equations of motion."""

    name: ClassVar[str] = "equations"
    options: ClassVar[frozenset[str]] = frozenset(
        {"symbols", "coordinates", "momenta", "velocities", "form", "numbers"}
    )

    def read_key(self, asked: Asked) -> Key:
        """The key of a question. Raises ValueProblem."""
        key = equation_key.read(asked)
        if len(states(key.motion)) < FEWEST:
            raise ValueProblem("the equations have no values at most random states")
        # Once for all answers.
        mistakes(key)
        nonzero(key.motion)
        return key

    def read_answer(self, key: Key, answer: Tree, folder: Path) -> Answer:
        """The equations of an answer. Raises Unreadable."""
        return tuple(_exact(each, key) for each in equations(answer, key.vocabulary, key.motion.told))

    def judge(self, key: Key, answer: Answer) -> Outcome:
        """The outcome of a set of equations."""
        system = System(key, answer)
        wrongs = [each.place for each, truth in zip(answer, system.truths, strict=True) if truth == "wrong"]
        trivial = [each.place for each, is_so in zip(answer, system.trivial, strict=True) if is_so]
        remarks = [Finding("trivial_equation", place) for place in trivial]
        best = min(system.solutions, key=lambda each: (bool(each.missing), len(each.gaps)))
        problems: list[Finding] = []
        if wrongs:
            found = self.explanation(key, answer)
            problems = [Finding("equation_wrong", place) for place in wrongs]
            if found is not None:
                problems = [replace(found, place=wrongs[0] if len(wrongs) == 1 else "")]
        if best.missing and (wrongs or not system.is_open):
            problems.append(_missing(system))
        if problems:
            any_form = System(replace(key, form="any"), answer)
            if not wrongs and key.form == "first_order" and any(not s.missing for s in any_form.solutions):
                return wrong(_with_reference(key, Finding("second_order_form")))
            first, *rest = problems
            return wrong(_with_reference(key, first), *rest, *remarks, share=system.share)
        return _undecided(system, best, remarks) or correct(*_of_form(system), *remarks)

    def is_right(self, key: Key, answer: Answer) -> bool:
        """Whether all is proved."""
        system = System(key, answer)
        return system.are_true and system.is_complete

    def right_forms(self, key: Key) -> Iterator[tuple[str, Tree]]:
        """The key, and the same rearranged; none where equations of second order only have a mistake."""
        if key.form == "second_order":
            return
        rates = _told(key)
        if max(map(len, rates.values())) > LONGEST_EXAMPLE:
            return
        names = list(rates)
        yield "the key", rates
        yield "a list of texts", [f"{name} = {e}" for name, e in rates.items()]
        yield "all on one side", [f"2*{name} - 2*({e}) = 0" for name, e in rates.items()]
        if len(names) > 1:
            first, second, *rest = names
            yield (
                "equations added",
                [
                    f"{first} + {second} = {rates[first]} + ({rates[second]})",
                    f"{first} - {second} = {rates[first]} - ({rates[second]})",
                    *(f"{name} = {rates[name]}" for name in rest),
                ],
            )

    def wrong_forms(self, key: Key) -> Iterator[Example]:
        """Too few equations, one that says nothing, and equations of second order, which may be right."""
        rates = _told(key)
        first, *names = rates
        if names:
            yield Example("an equation left out", {first: rates[first]}, "missing_equation")
        trivial = [f"{first} = {first}", *(f"{name} = {rates[name]}" for name in names)]
        yield Example("a trivial equation", trivial, "trivial_equation")
        answer = _of_second_order(key) if key.definitions and key.form == "any" else []
        if answer and max(map(len, answer)) <= LONGEST_EXAMPLE:
            yield Example("equations of second order", answer, "second_order_form")

    def examples(self, key: Key) -> Iterator[Example]:
        """Right answers, and one wrong one under each mistake."""
        yield from (Example(what, form) for what, form in self.right_forms(key))
        yield from self.wrong_forms(key)
        seen = set[str]()
        for mistake, variant in variants(self.name, key):
            form = None if mistake.code in seen else self.typed(variant.key)
            found = form and self.explanation(key, self.read_answer(key, form, Path()))
            if found and found.code == mistake.code:
                seen.add(mistake.code)
                yield Example(mistake.code.replace("_", " "), form, mistake.code)


def _exact(equation: Equation, key: Key) -> Equation:
    try:
        return replace(equation, exact=key.motion.exact(equation.residual))
    except ExpressionError:
        return equation


def _told(key: Key) -> dict[str, str]:
    """The equations of the key as texts."""
    return {name: text(to_tree(e)) for name, e in key.motion.rates.items()}


def _with_reference(key: Key, finding: Finding) -> Finding:
    """A finding with a set that is right."""
    told = ", ".join(f"{name} = {e}" for name, e in _told(key).items())
    return replace(finding, reference=f"right is, for example, {told}")


def _missing(system: System) -> Finding:
    """That equations are missing, and for what."""
    names = system.solutions[0 if system.is_first_order else -1].missing
    more = ", ..." if len(names) > MOST_NAMED else ""
    return Finding("missing_equation", ", ".join(names[:MOST_NAMED]) + more)


def _undecided(system: System, best: Solution, remarks: Sequence[Finding]) -> Outcome | None:
    """Why it cannot be told whether equations are right, if it cannot."""
    pairs = zip(system.equations, system.truths, strict=True)
    places = [each.place for each, truth in pairs if truth == "open"]
    if places:
        return review("it is not proved that the equation is true", *remarks)
    if best.missing:
        return review("an equation is not linear in the derivatives", *remarks)
    if not best.gaps:
        return None
    factor = next((e for e in best.gaps if has_zeros(e, system.motion)), None)
    if factor is None:
        return review("it is not proved that the equations determine the motion in every state", *remarks)
    detail = f"where `{text(to_tree(factor))}` is zero"
    return review(f"the equations say less {detail}", Finding("extra_solutions", "", detail), *remarks)


def _of_form(system: System) -> list[Finding]:
    """That right equations are of second order, where first order is expected."""
    rates = system.motion.accelerations
    pairs = zip(system.equations, system.trivial, strict=True)
    second = all(each.names & rates for each, trivial in pairs if not trivial)
    return [Finding("second_order_form")] if system.key.hamiltonian and second else []


def _of_second_order(key: Key) -> list[str]:
    """Equations of second order, without momenta: dp/dt where p is a function of coordinates and rates."""
    found = []
    try:
        for momentum, e in key.definitions.items():
            names = e.names & {*key.motion.functions, *key.motion.middles}
            slope = total(derivative(e, name) * symbol(velocity(name)) for name in sorted(names))
            rate = tidy(substitute(key.motion.rates[velocity(momentum)], key.definitions))
            found.append(f"{text(to_tree(slope + derivative(e, TIME)))} = {text(to_tree(rate))}")
    except ExpressionError:
        return []
    return [each.replace("dotdot", "ddot") for each in found]
