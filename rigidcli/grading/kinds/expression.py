"""Expressions: right where they are the same function, in whatever form they are written.

Where the key is an energy, H or L, a constant may be added: it does not change the motion. Unless the
question gives a tolerance, numbers in an answer must be exact, or decimals that are rounded right: a factor
of 1.001 in a formula is no rounding, 0.333 for 1/3 is.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

from rigidcli.algebra.expansion import expand
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.trees import to_tree
from rigidcli.errors import ExpressionError
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.expressions.agreement import PROVED, Function, seems_same
from rigidcli.grading.expressions.dimensions import mismatch
from rigidcli.grading.expressions.formula import names_in, read, size_of
from rigidcli.grading.expressions.key import Key, read_key
from rigidcli.grading.expressions.mistakes import THREE, additive_terms, factor, parts, still
from rigidcli.grading.expressions.rounding import MOST_NODES
from rigidcli.grading.kinds.base import Example, Kind
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, review, wrong
from rigidcli.language.text import text
from rigidcli.language.tree import Name, Node, Sum, bound


class Expression(Kind):
    """A formula in the symbols of the question."""

    name: ClassVar[str] = "expression"
    options: ClassVar[frozenset[str]] = frozenset(
        {"symbols", "coordinates", "momenta", "velocities", "constant", "numbers"}
    )

    def read_key(self, asked: Asked) -> Key:
        """The expression that is asked for. Raises ValueProblem."""
        return read_key(asked)

    def prepare(self, key: Key) -> None:
        """Work out what mistakes make of the key, and the values of its parts and terms."""
        super().prepare(key)
        for look in _LOOKS:
            list(look(key, key.function))

    def read_answer(self, key: Key, answer: Tree, folder: Path) -> Function:
        """An expression in the symbols of the question. Raises Unreadable."""
        function = key.answer(read(answer, key.names.vocabulary))
        if not (function.rough.known | function.rough.undefined).any():
            raise Unreadable("too_large", "its values cannot be worked out")
        return function

    def judge(self, key: Key, answer: Function) -> Outcome:
        """The outcome of an expression: as a function first, then by its decimals."""
        found = key.told(answer, constant=False)
        if found is True:
            return correct()
        if key.constant:
            found = key.told(answer)
            if found is True:
                return correct(*_of_constant(key, answer))
        if isinstance(found, str):
            return review(found)
        meant = key.rounded(answer)
        if meant is not None and meant.enough and (key.relative is None or key.is_rounded):
            moved = replace(key, relative=PROVED)
            is_exact = moved.told(key.answer(meant.tree), constant=False) is True
            return correct(*([] if is_exact else _of_constant(key, answer)))
        if meant is not None:
            findings = [Finding("precision_insufficient")]
        else:
            positive = key.where_positive()
            if positive is not None and positive.told(positive.answer(answer.tree)) is True:
                listed = ", ".join(f"`{name}`" for name in sorted(key.names.open & names_in(answer.tree)))
                return review(f"right where {listed} are positive: if so, list them in `symbols`")
            findings = self._findings(key, answer)
        return wrong(*(replace(finding, reference=f"expected {text(key.tree)}") for finding in findings))

    def is_right(self, key: Key, answer: Function) -> bool:
        """Whether it is proved to be the same function, by its decimals as they are typed."""
        return key.told(answer) is True

    def _findings(self, key: Key, answer: Function) -> list[Finding]:
        """What is wrong with an answer: the first of these that can be told for sure."""
        velocities = sorted(key.misplaced & names_in(answer.tree))
        if velocities:
            return list(self._of_velocities(key, answer, velocities[0]))
        named = self.explanation(key, answer)
        if named is not None:
            return [named]
        wrong_sum = mismatch(answer.tree, key.names.dimensions)
        if wrong_sum is not None:
            return [Finding("dimension_mismatch", detail=wrong_sum)]
        for look in _LOOKS:
            codes = set(look(key, answer))
            if codes:
                return [Finding(codes.pop() if len(codes) == 1 else "outside_tolerance")]
        return [Finding("outside_tolerance")]

    def _of_velocities(self, key: Key, answer: Function, name: str) -> Iterator[Finding]:
        """What is said of a velocity where momenta are asked."""
        if key.is_hamiltonian:
            yield Finding("velocity_in_hamiltonian", detail=f"read `{name}`")
            if key.lagrangian is not None and key.of(key.lagrangian).told(answer) is True:
                yield Finding("lagrangian_or_potential_sign")
        elif answer.tree == Name(key.asked):
            yield Finding("trivial_equation", detail="this is what is asked for")
        else:
            yield Finding("outside_tolerance", detail=f"read `{name}`, expected no velocity, but momenta")

    def right_forms(self, key: Key) -> Iterator[tuple[str, str]]:
        """The key as it is, and in other forms."""
        form = text(key.tree)
        yield "the key", form
        if key.relative is None and size_of(key.tree) < MOST_NODES // 2 and "." not in form:
            yield "with a rounded number", f"3*0.333*({form})"
        yield "with another sign of powers", form.replace("**", "^")
        yield "with a name before it", f"H = {form}"
        yield "as a fraction", f"3*({form})/4 + ({form})/4"
        for name in sorted(names_in(key.tree))[:1]:
            yield "with a square of sine and cosine", f"({form})*(sin({name})^2 + cos({name})^2)"
        for what, change in (("multiplied out", expand), ("tidied", tidy)):
            with suppress(ExpressionError):
                yield what, text(to_tree(change(from_tree(key.tree))))
        if key.constant:
            yield "with a constant", f"{form} + 17/4"
        if key.numbers:
            yield "with numbers", text(bound(key.tree, key.names.meant))

    def wrong_forms(self, key: Key) -> Iterator[Example]:
        """The key with a term too many, and with what does not belong in it."""
        made: list[tuple[str, Node, str]] = [
            ("with a term too many", Sum((key.tree, term.tree)), "term_wrong") for term in additive_terms(key)
        ]
        if not key.constant:
            made.append(("with a constant", Sum((key.tree, THREE)), "additive_constant"))
        if key.misplaced:
            with_velocity = Sum((key.tree, Name(min(key.misplaced))))
            made.append(("with a velocity", with_velocity, "velocity_in_hamiltonian"))
        if not key.numbers:
            made.append(("with numbers", bound(key.tree, key.names.meant), "number_for_symbol"))
        for what, tree, code in made:
            found = self.judge(key, key.answer(tree))
            if [finding.code for finding in found.findings] == [code] and found.verdict == "incorrect":
                yield Example(what, text(tree), code)


def _of_constant(key: Key, answer: Function) -> Iterator[Finding]:
    """Remarks on an answer with a constant that is allowed."""
    yield Finding("additive_constant", detail="that does not change the motion")
    wrong_sum = mismatch(answer.tree, key.names.dimensions)
    if wrong_sum is not None:
        yield Finding("dimension_mismatch", detail=wrong_sum)


def _of_parts(key: Key, answer: Function) -> Iterator[str]:
    """The code of T or V where only the other one is right."""
    found = parts(key)
    if found is None:
        return
    resting = key.answer(still(key, answer.tree)).rough
    if seems_same(resting, found.at_rest, constant=key.constant):
        yield "kinetic_term_wrong"
    moving, expected = answer.rough.minus(resting), key.function.rough.minus(found.at_rest)
    if seems_same(moving, expected, constant=key.constant):
        yield "potential_wrong"


def _of_terms(key: Key, answer: Function) -> Iterator[str]:
    """A code where one term of the sum is missing, or has another factor."""
    excess = answer.rough.minus(key.function.rough)
    factors = [factor(excess, term.rough) for term in additive_terms(key)]
    if any(found is not None for found in factors):
        yield "term_wrong"


_LOOKS = (_of_parts, _of_terms)
"""What finds what is wrong with an answer that no named mistake explains."""
