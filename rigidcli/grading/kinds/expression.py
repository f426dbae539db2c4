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

from rigidcli.errors import ExpressionError
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.expressions import key as expression_key
from rigidcli.grading.expressions.dimensions import mismatch
from rigidcli.grading.expressions.findings import findings
from rigidcli.grading.expressions.formula import names_in, read, replaced
from rigidcli.grading.expressions.key import Key
from rigidcli.grading.expressions.rounding import rounded
from rigidcli.grading.kinds.base import Example
from rigidcli.grading.outcome import Finding, Outcome, correct, wrong
from rigidcli.symbolic.algebra.calculus import expand
from rigidcli.symbolic.algebra.reading import from_tree
from rigidcli.symbolic.algebra.simplification import tidy
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language.text import text
from rigidcli.symbolic.language.tree import Constant, Name, Negative, Node, Number, Product, Sum


def read_key(asked: Asked) -> Key:
    """The key of a question. Raises ValueProblem."""
    return expression_key.read_key(asked)


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of an expression as it was typed. Raises Unreadable."""
    return _judged(key, read(answer, key.names.vocabulary))


def _judged(key: Key, tree: Node) -> Outcome:
    reference = key.reference
    found = reference.floats.at(tree)
    if reference.holds(tree, found):
        return correct()
    if key.constant and reference.holds(tree, found, constant=True):
        return correct(*_of_constant(key, tree))
    meant = rounded(reference, tree, found, constant=key.constant)
    if meant is not None and meant.enough and reference.relative is None:
        return correct(*(() if reference.holds(meant.tree) else _of_constant(key, tree)))
    if meant is not None:
        return wrong(Finding("precision_insufficient", reference=key.told))
    return wrong(*(replace(finding, reference=key.told) for finding in findings(key, tree, found)))


def _of_constant(key: Key, tree: Node) -> Iterator[Finding]:
    """Remarks on an answer with a constant that is allowed."""
    yield Finding("additive_constant", detail="that does not change the motion")
    wrong_sum = mismatch(tree, key.names.dimensions)
    if wrong_sum is not None:
        yield Finding("dimension_mismatch", detail=wrong_sum)


# --- examples


def examples(key: Key) -> Iterator[Example]:
    """The key as it is, in other forms, and under each mistake that another does not look like."""
    for what, form in _right(key):
        yield Example(what, form)
    for what, tree, code in _wrong(key):
        if [finding.code for finding in _judged(key, tree).findings] == [code]:
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
    if key.periodic:
        turn = (Number("2", 2.0), Constant("pi"))
        yield "with another measure of angles", Product((*turn, tree)), "frequency_vs_angular_frequency"
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
