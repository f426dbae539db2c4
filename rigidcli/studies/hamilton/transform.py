"""The change of variables that a document asks about: is it canonical, and what becomes of H?"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import combinations, islice
from typing import NamedTuple

from rigidcli.algebra.arithmetic import sign
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ONE, ZERO, Expr
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import from_tree, substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.algebra.values import is_zero
from rigidcli.document.document import Document
from rigidcli.document.phase_space import Transform
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.language.text import latex_name, reading
from rigidcli.language.tree import Call, Formula, Negative, Node, Product, nodes
from rigidcli.mechanics import canonical
from rigidcli.mechanics.canonical import Generated
from rigidcli.mechanics.canonical import generated as generated_by
from rigidcli.mechanics.phase_space import TIME, Phase, bracket, equations
from rigidcli.report import Field, Step
from rigidcli.studies import writing
from rigidcli.studies.common import field_of, if_known
from rigidcli.studies.hamilton import by_name, rate_named
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.system import LONGEST_FORMULA, derived_parameters, known_values, step, titled

# Brackets that are worked out: all of two pairs of variables, of which further ones follow the same rule.
MOST_BRACKETS = 6


class TransformedSystem(NamedTuple):
    """New `names` (coordinates, then momenta), and the fundamental brackets of the variables that are given.

    These have `values` on the phase space of the others, `phase`; a canonical change has the brackets
    `canonical`. All holds under the `conditions`. H and its equations in the new variables are None where the
    change is not canonical, or where no way leads to them. `generated` is what a generating function makes.
    """

    transform: Transform
    names: tuple[str, ...]
    values: Mapping[str, Expr]
    phase: Phase
    generated: Generated | None
    brackets: Mapping[tuple[str, str], Expr]
    canonical: Mapping[tuple[str, str], Expr]
    conditions: tuple[str, ...] = ()
    hamiltonian: Expr | None = None
    equations: tuple[Expr, ...] | None = None

    @property
    def wrong(self) -> list[tuple[str, str]]:
        """The pairs whose brackets a canonical change does not have."""
        return [pair for pair, e in self.brackets.items() if e != self.canonical[pair]]

    def fields(self) -> list[Field]:
        """Say whether the change is canonical, and report H and its equations in the new variables."""
        wrong, where = {pair: self.brackets[pair] for pair in self.wrong}, ", ".join(self.conditions)
        words = f"yes, where {where}" if where else "yes"
        if wrong:
            texts = {pair: reading(to_tree(e)) for pair, e in wrong.items()}
            only = (f"{text} = 1" for text in texts.values())
            listed = (f"{_text(pair)} is {text}, not {self.canonical[pair]}" for pair, text in texts.items())
            # Symbols may have values at which all of them are 1.
            may_be_one = all(self.canonical[pair] == 1 and e.names for pair, e in wrong.items())
            words = f"only if {', '.join(only)}" if may_be_one else f"no: {', '.join(listed)}"
        return [
            field_of("hamilton", "transform.canonical", not wrong, words=words),
            field_of("hamilton", "transform.conditions", list(self.conditions)),
            *self._relations(),
            *(
                Field(f"transform.brackets.{_text(pair)}", e, _text(pair), _sign(pair))
                for pair, e in self.brackets.items()
            ),
            if_known(field_of("hamilton", "transform.hamiltonian", self.hamiltonian)),
            *by_name("transform.equations", self.names, self.equations, rate_named),
        ]

    def _relations(self) -> Iterator[Field]:
        """The change that a generating function makes; people see one side, and nothing twice."""
        if self.generated is None or self.transform.generating is None:
            return
        relations, (kind, _) = self.generated.relations, self.transform.generating
        yield from by_name("transform.change", relations, relations.values(), _worded(f"by {kind}"))
        solved = self._solved
        for key, side, others in (("old", self.generated.old, "new"), ("new", self.generated.new, "old")):
            hidden = [name for name, e in (side or {}).items() if key != solved or relations.get(name) == e]
            values = None if side is None else side.values()
            titled = _worded(f"in {others} variables")
            yield from by_name(f"transform.{key}", side or (), values, titled, hidden)

    @property
    def _solved(self) -> str | None:
        """The variables for which the relations of a generating function are solved, at first."""
        return next((side for side in ("old", "new") if getattr(self.generated, side) is not None), None)

    def notes(self) -> Iterator[str]:
        """What is not found, and under which conditions H is written."""
        if self.generated is not None and self._solved is None:
            yield (
                "the relations of the generating function are not solved for the old variables or the new "
                "ones: the change stays implicit, and so does K = H + dF/dt"
            )
        elif self.generated is not None and self.generated.branch is not None:
            near = ", ".join(f"{name} = {value:.2g}" for name, value in self.generated.branch.items())
            yield f"the old and the new variables lead back to each other on one branch alone, as near {near}"
        if self.values and not self.wrong and self.hamiltonian is None:
            yield (
                "H in the new variables is not found: H has not one form, or the old variables do not follow "
                "from the new ones by equations that are solved one by one"
            )
        if self.conditions:
            yield f"H in the new variables is written for {' and '.join(self.conditions)}"
        if self.hamiltonian is not None and self.equations is None:
            yield "forces act beside H: the equations of the new variables are not worked out"
        if self.hamiltonian is not None:
            made, given = _functions([self.hamiltonian]), _functions(self.values.values())
            for function in ("sin", "cos", "tan"):
                if f"a{function}" in made and function in given:
                    yield f"H in the new variables holds where a{function}({function}(u)) is u"

    def steps(self, fields: Sequence[Field]) -> Iterator[Step]:
        """Lead to the brackets and to H in the new variables; `fields` are all results."""
        if self.transform.generating is not None:
            kind, function = self.transform.generating
            solved = f" These relations are solved for the {self._solved} variables." if self._solved else ""
            shown = [Field("", Formula(function.root, exact=True), kind, f"{kind[0]}_{kind[1]}")]
            for entry in fields:
                for key in ("change", self._solved):
                    if entry.key.startswith(f"transform.{key}."):
                        name = entry.key.split(".", 2)[2]
                        shown.append(titled(entry, name))
            yield step(kind, shown, (), solved)
        for pair in islice(self.brackets, MOST_BRACKETS):
            names, expected = " and ".join(self.phase.names), str(self.canonical[pair])
            yield step("bracket", self._worked(pair), pair=_text(pair), names=names, expected=expected)
        if self.hamiltonian is not None:
            is_timed = any(TIME in e.names for e in self.values.values())
            keys = ("transform.hamiltonian", "transform.equations.")
            shown = [titled(entry) for entry in fields if entry.key.startswith(keys)]
            yield step("new_with_time" if is_timed else "new", shown)

    def _worked(self, pair: tuple[str, str]) -> Iterator[Field]:
        """The derivatives of two variables, and their bracket before it is worked out, and after."""
        (a, b), phase, result = pair, self.phase, self.brackets[pair]
        slopes = {(x, y): tidy(derivative(self.values[x], y)) for x in pair for y in phase.names}
        for (x, y), e in slopes.items():
            if e:
                yield Field("", e, f"d{x}/d{y}", rf"\partial {latex_name(x)}/\partial {latex_name(y)}")
        terms = list[Node]()
        for q, p in zip(phase.coordinates, phase.momenta, strict=True):
            for x, y in ((q, p), (p, q)):
                factors = slopes[a, x], slopes[b, y]
                term = Product((factors[0].tree(), factors[1].tree()))
                terms += [term if x == q else Negative(term)] if all(factors) else []
        whole = writing.total(terms)
        if len(reading(whole)) <= LONGEST_FORMULA:
            yield Field("", Formula(whole, exact=True), _text(pair), _sign(pair))
        if reading(whole) != reading(result.tree()):
            yield Field("", result, _text(pair), _sign(pair))


def _worded(words: str) -> Callable[[str], tuple[str, str]]:
    """Titles that are names with these words, so that they are not those of the given system."""
    return lambda name: (f"{name} {words}", latex_name(name))


def _text(pair: tuple[str, str]) -> str:
    return f"{{{pair[0]}, {pair[1]}}}"


def _sign(pair: tuple[str, str]) -> str:
    return rf"\{{{pair[0]}, {pair[1]}\}}"


def transformed(document: Document, transform: Transform, derivation: Derivation) -> TransformedSystem:
    """Judge a change of variables, for all values of the parameters or else for the given ones.

    New variables are in pairs, [Q1, P1, Q2, P2], if only so they are canonical.
    """
    if transform.generating is not None:
        kind, function = transform.generating
        others = transform.momenta if kind in ("F1", "F3") else transform.coordinates
        if not function.names.isdisjoint(others):
            transform = transform.paired
    result = _transformed(document, transform, derivation)
    if not result.wrong or len(transform.new_variables) <= 2:
        return result
    other = _transformed(document, transform.paired, derivation)
    return result if other.wrong else other


def _transformed(document: Document, transform: Transform, derivation: Derivation) -> TransformedSystem:
    old, known, hamiltonian = derivation.phase, known_values(document), derivation.hamiltonian
    new, generated = Phase(transform.coordinates, transform.momenta), None
    derived = derived_parameters(document)
    # Relations that stay implicit have neither side.
    values: Mapping[str, Expr] = {}
    if transform.generating is not None:
        kind, function = transform.generating
        generated = generated_by(kind, from_tree(function.root, derived), old, new)
        is_old, values = generated.old is not None, generated.old or generated.new or {}
    else:
        is_old, given = transform.old is not None, transform.old or transform.new or {}
        values = {name: from_tree(expression.root, derived) for name, expression in given.items()}
    own, phase = (old, new) if is_old else (new, old)
    if not values:  # a change that follows from a function is canonical
        return TransformedSystem(transform, new.names, values, phase, generated, {}, {})
    brackets = {(a, b): bracket(values[a], values[b], phase) for a, b in combinations(own.names, 2)}
    conjugate = [*zip(own.coordinates, own.momenta, strict=True)]
    expected = {pair: ONE if pair in conjugate else ZERO for pair in brackets}
    free = {pair: e - expected[pair] for pair, e in brackets.items()}
    rate, signs = (None, None) if generated is None else (generated.rate, generated.signs)
    new_h, negative = None, {name for name, value in known.items() if sign(value) != 1}
    # For all values of the parameters, or else for the given ones.
    for given_values in ({}, known) if known else ({},):
        misses = {pair: substitute(miss, given_values) for pair, miss in free.items()}
        needed = canonical.positive_names(misses.values(), phase.names)
        needed = None if needed is None or negative.intersection(needed) else needed
        if needed is not None and hamiltonian is not None:
            there = {name: substitute(value, given_values) for name, value in values.items()}
            timed = None if rate is None else substitute(rate, given_values)
            with suppress(ComputationError, ExpressionError):
                h = substitute(hamiltonian, given_values)
                new_h = canonical.new_hamiltonian(h, there, old, new, timed, signs)
        if new_h is not None and negative.isdisjoint(new_h.positive):
            break
        new_h = None
    assumed = dict.fromkeys([*(needed or ()), *(() if new_h is None else new_h.positive)])
    # Forces beside H would have to be transformed, too.
    moved = None if new_h is None or derivation.is_forced else equations(new_h.hamiltonian, new)
    # A change that follows from a function is canonical, however its brackets are written.
    is_canonical = needed is not None or generated is not None
    wrong = [] if is_canonical else [pair for pair, miss in misses.items() if not is_zero(miss)]
    return TransformedSystem(
        transform,
        new.names,
        values,
        phase,
        generated,
        {pair: tidy(e) if pair in wrong else expected[pair] for pair, e in brackets.items()},
        expected,
        tuple(f"{name} > 0" for name in assumed if name not in known),
        None if new_h is None else new_h.hamiltonian,
        moved,
    )


def _functions(expressions: Iterable[Expr]) -> set[str]:
    return {node.function for node in nodes(e.tree() for e in expressions) if isinstance(node, Call)}
