"""Expressions: right where they are the same function, in whatever form they are written.

Where the key is an energy, H or L, a constant may be added: it does not change the motion. Unless the
question gives a tolerance, decimals in an answer must be right to some nine digits: a factor of 1.001 in a
formula is no rounding.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast, get_args

import numpy as np

from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.codes import CODES
from rigidcli.grading.functions.agreement import Reference, factor, refer
from rigidcli.grading.functions.energy import additive_terms, mistaken, split
from rigidcli.grading.functions.estimate import Estimate
from rigidcli.grading.functions.formula import Points, names_in, read, replaced
from rigidcli.grading.functions.vocabulary import TIME, Names, mismatch, names_of
from rigidcli.grading.kinds import Example
from rigidcli.grading.numbers import margin
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong
from rigidcli.grading.question import Tolerance
from rigidcli.symbolic import evaluation
from rigidcli.symbolic.calculus import expand
from rigidcli.symbolic.growth import from_tree, to_tree
from rigidcli.symbolic.simplify import tidy
from rigidcli.symbolic.tree import Name, Negative, Node, Number, Product, Sum
from rigidcli.symbolic.writing import text

ENERGIES = ("hamiltonian", "lagrangian", "energy")
"""Last names of results to which a constant may be added."""


@dataclass(frozen=True, slots=True, eq=False)
class Mistake:
    """What comes out under a mistake, and its values at the points of the reference."""

    code: str
    tree: Node
    found: Estimate


@dataclass(frozen=True, slots=True, eq=False)
class Rest:
    """The points of the reference, but with no momentum or velocity, and its values there."""

    points: Points
    found: Estimate


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The right expression, and what a wrong answer is compared with.

    A `constant` may be added where that is allowed. `misplaced` are the velocities, where H is asked for;
    `lagrangian` has the values of L then. `terms` are those of a sum, with their values. What an energy is
    at `rest` tells T from V. The reference is `told` to those who may read it.
    """

    reference: Reference
    names: Names
    constant: bool
    misplaced: frozenset[str]
    lagrangian: Estimate | None
    mistakes: tuple[Mistake, ...]
    terms: tuple[Mistake, ...]
    rest: Rest | None
    told: str

    def is_same(self, answer: Estimate, other: Estimate) -> bool:
        """Whether an answer is another expression than the reference, by the same tolerance."""
        floats, relative = self.reference.floats, self.reference.relative
        return floats.verdict(answer, other, constant=self.constant, relative=relative) is True


# --- the key

_TREES = get_args(Node)


def read_key(asked: Asked) -> Key:
    """The expression that is asked for. Raises ValueProblem where there is none, or an option is unfit."""
    tree = _tree(asked)
    used = names_in(tree)
    names = names_of(asked, used)
    last = asked.path[-1] if asked.path else ""
    moving = names.states | {TIME} if used & names.states else frozenset()
    rates = names.velocities if used & set(names.velocities) else names.momenta
    is_energy = not used.isdisjoint(rates) if asked.report is None else last in ENERGIES
    reference = refer(tree, names.vocabulary, moving, _relative(asked.question.tolerance, tree))
    points = reference.floats.points

    def mistake(code: str, node: Node) -> Mistake:
        return Mistake(code, node, points.at(node))

    has_momenta = last == "hamiltonian" or not used.isdisjoint(names.momenta)
    misplaced = frozenset(names.velocities) - used if has_momenta and rates == names.momenta else frozenset()
    is_lagrangian = last == "lagrangian" or rates == names.velocities
    found = mistaken(tree, names.coordinates, rates, is_energy=is_energy, is_lagrangian=is_lagrangian)
    lagrangian = None if asked.report is None or not misplaced else asked.report.get("lagrangian")
    vocabulary = replace(names.vocabulary, unlisted=misplaced)
    key = Key(
        reference,
        replace(names, vocabulary=vocabulary),
        is_energy and bool(moving) and asked.question.constant == "allowed",
        misplaced,
        points.at(lagrangian) if isinstance(lagrangian, _TREES) else None,
        tuple(mistake(code, node) for code, node in found),
        tuple(mistake("term_wrong", node) for node in additive_terms(tree)),
        _rest(tree, points, [name for name in rates if name in used]) if is_energy else None,
        f"expected {text(tree)}",
    )
    real = [mistake for mistake in key.mistakes if not key.is_same(mistake.found, reference.floats.found)]
    return replace(key, mistakes=tuple(real))


def _tree(asked: Asked) -> Node:
    """The expression that is the key. Raises ValueProblem."""
    value = asked.value
    if asked.report is None:
        try:
            return read(value, None)
        except Unreadable as unreadable:
            raise ValueProblem(f"the key {CODES[unreadable.finding.code]}") from None
    if isinstance(value, _TREES):
        return cast(Node, value)
    if hasattr(type(value), "free_symbols"):
        from rigidcli.symbolic import exact

        value = exact.text(value)
    elif isinstance(value, int | float | np.number) and not isinstance(value, bool):
        value = repr(float(value)) if np.isfinite(value) else None
    try:
        return read(value, None, label=False)
    except Unreadable:
        raise ValueProblem("what is asked for is not one expression") from None


def _relative(tolerance: Tolerance, tree: Node) -> float | None:
    """The tolerance relative to the sizes of terms, if any is given. Raises ValueProblem for an unfit one."""
    if tolerance.figures != "value":
        raise ValueProblem("an expression has no figures to count", path=("tolerance", "figures"))
    if tolerance == Tolerance():
        return None
    if not names_in(tree):
        value = _value(tree)
        return margin(value, tolerance) / value if value else None
    if tolerance.absolute is not None:
        raise ValueProblem(
            "an expression has a tolerance `relative` to its terms", path=("tolerance", "absolute")
        )
    figures = tolerance.significant_figures
    rounded = 0.0 if figures is None else 0.5 * 10.0 ** (1 - figures)
    return max(tolerance.relative or 0.0, rounded)


def _value(tree: Node) -> float:
    """The size of a number. Raises ValueProblem where there is none."""
    try:
        return abs(evaluation.real(tree, {}))
    except ExpressionError:
        raise ValueProblem("the key has no value") from None


def _rest(tree: Node, points: Points, rates: Sequence[str]) -> Rest | None:
    """What tells T from V, where they can be told apart."""
    try:
        if split(from_tree(tree), rates) is None:
            return None
    except ExpressionError:
        return None
    still = points.but(dict.fromkeys(rates, 0.0))
    return Rest(still, still.at(tree))


# --- judging


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of an expression as it was typed. Raises Unreadable."""
    tree = read(answer, key.names.vocabulary)
    reference = key.reference
    found = reference.floats.at(tree)
    if reference.holds(tree, found):
        return correct()
    if key.constant and reference.holds(tree, found, constant=True):
        return correct(Finding("additive_constant", detail="that does not change the motion"))
    return wrong(*(replace(finding, reference=key.told) for finding in _findings(key, tree, found)))


def _findings(key: Key, tree: Node, found: Estimate) -> Iterator[Finding]:
    """What is wrong with an answer that is not right."""
    velocities = sorted(key.misplaced & names_in(tree))
    if velocities:
        yield Finding("velocity_in_hamiltonian", detail=f"read `{velocities[0]}`")
        if key.lagrangian is not None and key.is_same(found, key.lagrangian):
            yield Finding("lagrangian_or_potential_sign")
        return
    for look in (_recomputed, _proportional, _part, _term):
        named = {finding.code: finding for finding in look(key, tree, found)}
        if named:
            break
    if len(named) == 1:
        yield from named.values()
        return
    wrong_sum = mismatch(tree, key.names)
    yield (
        Finding("outside_tolerance") if wrong_sum is None else Finding("dimension_mismatch", detail=wrong_sum)
    )


def _recomputed(key: Key, tree: Node, found: Estimate) -> Iterator[Finding]:
    """Mistakes under each of which the reference was worked out again."""
    for mistake in key.mistakes:
        if key.is_same(found, mistake.found):
            yield Finding(mistake.code)
    if names_in(key.reference.tree) and not key.constant and key.reference.holds(tree, found, constant=True):
        yield Finding("additive_constant")
    yield from _numbers(key, tree, found)


def _numbers(key: Key, tree: Node, found: Estimate) -> Iterator[Finding]:
    """Values of the document in place of symbols: the answer is right where these have the values."""
    points = key.reference.floats.points
    mine, own = (points.independent(names_in(each)) for each in (tree, key.reference.tree))
    missing = {name: value for name, value in key.names.values.items() if name in own - mine}
    if missing and key.reference.holds_where(missing, found, constant=key.constant):
        yield Finding("number_for_symbol", detail=f"without {', '.join(f'`{name}`' for name in missing)}")


def _proportional(key: Key, tree: Node, found: Estimate) -> Iterator[Finding]:
    """A constant factor."""
    if factor(found, key.reference.floats.found) is not None and names_in(key.reference.tree):
        yield Finding("constant_factor")


def _part(key: Key, tree: Node, found: Estimate) -> Iterator[Finding]:
    """Only one of T and V is right."""
    if key.rest is None:
        return
    still = key.rest.points.at(tree)
    if key.is_same(still, key.rest.found):
        yield Finding("kinetic_term_wrong")
    if key.is_same(found.minus(still), key.reference.floats.found.minus(key.rest.found)):
        yield Finding("potential_wrong")


def _term(key: Key, tree: Node, found: Estimate) -> Iterator[Finding]:
    """One term of the sum is missing, or has another factor."""
    excess = found.minus(key.reference.floats.found)
    if any(factor(excess, term.found) is not None for term in key.terms):
        yield Finding("term_wrong")


# --- examples


def examples(key: Key) -> Iterator[Example]:
    """The key as it is, in other forms, and under each mistake that another does not look like."""
    for what, form in _right(key):
        yield Example(what, form)
    for what, tree, code in _wrong(key):
        if [finding.code for finding in _findings(key, tree, key.reference.floats.at(tree))] == [code]:
            yield Example(what, text(tree), code)


def _right(key: Key) -> Iterator[tuple[str, str]]:
    tree = key.reference.tree
    form = text(tree)
    yield "the key", form
    yield "with another sign of powers", form.replace("**", "^")
    yield "with a name before it", f"H = {form}"
    yield "as a fraction", f"3*({form})/4 + ({form})/4"
    for name in sorted(names_in(tree))[:1]:
        yield "with a square of sine and cosine", f"({form})*(sin({name})^2 + cos({name})^2)"
    for what, change in (("multiplied out", expand), ("tidied", tidy)):
        with suppress(ExpressionError):
            yield what, text(to_tree(change(from_tree(tree))))
    if key.constant:
        yield "with a constant", f"{form} + 17/4"


def _wrong(key: Key) -> Iterator[tuple[str, Node, str]]:
    tree, three = key.reference.tree, Number("3", 3.0)
    for mistake in key.mistakes:
        yield "with a mistake", mistake.tree, mistake.code
    yield "three times as large", Product((three, tree)), "constant_factor"
    for term in key.terms:
        yield "with a term too many", Sum((tree, term.tree)), term.code
    if not key.constant:
        yield "with a constant", Sum((tree, three)), "additive_constant"
    if key.misplaced:
        yield "with a velocity", Sum((tree, Name(min(key.misplaced)))), "velocity_in_hamiltonian"
    values = {name: _number(value) for name, value in key.names.values.items() if name in names_in(tree)}
    if values:
        yield "with numbers", replaced(tree, values), "number_for_symbol"


def _number(value: float) -> Node:
    size = Number(repr(abs(value)), abs(value))
    return Negative(size) if value < 0 else size
