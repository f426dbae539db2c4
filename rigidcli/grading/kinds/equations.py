"""Equations of motion, in any form: a set is right if each is true, and together they determine the motion.

They may be of first order, Hamilton's or others, or of second order; solved for derivatives or not,
multiplied, added to each other, and mixed. To determine the motion is to leave one motion only through almost
every state. So x' (x' - p/m) = 0 is wrong, as x may stay where it is in every state (x, p); and
m x' x'' + k x x' = 0 is right, which the conservation of energy gives, as it tells x'' in every state (x, x')
but those of rest. That rest solves it as well is remarked.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from rigidcli.errors import ExpressionError
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.equations import key as equation_key
from rigidcli.grading.equations.determinacy import is_trivial, is_true, tried
from rigidcli.grading.equations.findings import EquationSet
from rigidcli.grading.equations.key import Key
from rigidcli.grading.equations.text import equations
from rigidcli.grading.kinds.base import Example
from rigidcli.grading.outcome import Finding, Outcome, correct, wrong
from rigidcli.model.variables import acceleration, velocity
from rigidcli.symbolic.algebra.calculus import derivative, substitute
from rigidcli.symbolic.algebra.expressions import symbol
from rigidcli.symbolic.algebra.simplification import tidy
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language.text import text
from rigidcli.symbolic.mechanics.energies import TIME

LONGEST_EXAMPLE = 4000
"""Characters of an equation of an example."""


def read_key(asked: Asked) -> Key:
    """The key of a question. Raises ValueProblem."""
    return equation_key.read(asked)


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of an answer; raises Unreadable."""
    found = equations(answer, key.vocabulary, key.motion.told)
    tries = [tried(equation.residual, key.stencil) for equation in found]
    true = [is_true(each, key.points, key.tolerance) for each in tries]
    says = [not (ok and is_trivial(each, key.elsewhere)) for each, ok in zip(tries, true, strict=True)]
    places = [equation.place for equation in found]
    remarks = [Finding("trivial_equation", place) for place, ok in zip(places, says, strict=True) if not ok]
    whole = EquationSet(key, places, tries, true).only(says)
    problems = whole.problems()
    if problems:
        return wrong(*_with_reference(key, problems), *remarks, share=whole.share())
    remarks += whole.remarks()
    if key.hamiltonian and whole.is_of_second_order:
        remarks.insert(0, Finding("second_order_form"))
    return correct(*remarks)


def _with_reference(key: Key, problems: Sequence[Finding]) -> Iterator[Finding]:
    """The findings, the first with a set that is right."""
    told = ", ".join(f"{name} = {text(to_tree(e))}" for name, e in key.motion.rates.items())
    first, *rest = problems
    yield Finding(first.code, first.place, first.detail, f"right is, for example, {told}")
    yield from rest


def examples(key: Key) -> Iterator[Example]:
    """The key, the same rearranged, and under each mistake."""
    rates = {name: text(to_tree(e)) for name, e in key.motion.rates.items()}
    names = list(rates)
    yield Example("the key", rates)
    yield Example("a list of texts", [f"{name} = {e}" for name, e in rates.items()])
    yield Example("all on one side", [f"2*{name} - 2*({e}) = 0" for name, e in rates.items()])
    if len(names) > 1:
        first, second, *rest = names
        yield Example(
            "equations added",
            [
                f"{first} + {second} = {rates[first]} + ({rates[second]})",
                f"{first} - {second} = {rates[first]} - ({rates[second]})",
                *(f"{name} = {rates[name]}" for name in rest),
            ],
        )
        yield Example("an equation left out", {first: rates[first]}, "missing_equation")
    yield Example(
        "a trivial equation",
        [f"{names[0]} = {names[0]}", *(f"{name} = {rates[name]}" for name in names[1:])],
        "trivial_equation",
    )
    yield from _of_second_order(key)
    seen = set[str]()
    for mistake in key.mistakes:
        if mistake.rates is None or mistake.code in seen:
            continue
        seen.add(mistake.code)
        mistaken = {**rates, **{name: text(to_tree(e)) for name, e in mistake.rates.items()}}
        if max(map(len, mistaken.values())) <= LONGEST_EXAMPLE:
            yield Example(mistake.code.replace("_", " "), mistaken, mistake.code)


def _of_second_order(key: Key) -> Iterator[Example]:
    """Equations of second order, without momenta."""
    motion = key.motion
    if not motion.second or not key.definitions:
        return
    try:
        answer = {}
        for name in motion.functions:
            e = motion.rates[velocity(name)]
            rates = {each: motion.rates.get(velocity(each)) for each in motion.auxiliary}
            slope = derivative(e, TIME)
            for each in motion.functions:
                slope = slope + derivative(e, each) * symbol(velocity(each))
            for each, rate in rates.items():
                assert rate is not None
                slope = slope + derivative(e, each) * rate
            answer[acceleration(name)] = text(to_tree(tidy(substitute(slope, dict(key.definitions)))))
    except ExpressionError:
        return
    if max(map(len, answer.values())) <= LONGEST_EXAMPLE:
        yield Example("equations of second order", answer, "second_order_form")
