"""What a document says of a system, and results in its style: its decimals, and the order of its sums."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ZERO, Expr, symbol, total
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import from_tree
from rigidcli.algebra.trees import Style, is_even, to_tree
from rigidcli.algebra.values import is_zero
from rigidcli.document.document import Document
from rigidcli.document.system import Particle, System
from rigidcli.errors import DocumentError, ExpressionError, Problem, shown
from rigidcli.language.expression import Expression
from rigidcli.language.text import latex_name
from rigidcli.language.tree import Formula, Negative, Power, Product, Sum, nodes
from rigidcli.mechanics.lagrange_equations import Constraint, constraint, first_dependent, reactions
from rigidcli.mechanics.particles import MovingBody, unnatural
from rigidcli.mechanics.particles import kinetic as kinetic_energy
from rigidcli.mechanics.phase_space import TIME, linear
from rigidcli.report import Field, Step, Table
from rigidcli.studies.common import field_of

# The row of results.csv with this key as a field, with its value, words for it, and changes.
row_of = partial(field_of, "hamilton")
# Makes an expression under a key of the system exact; None for None.
_Read: TypeAlias = Callable[[Expression | None, str], Expr | None]
# The longest formula of the working, in characters: a longer one teaches nothing.
LONGEST_FORMULA = 300


class SystemFunctions(NamedTuple):
    """The functions of a system that a document gives; None for what it does not say.

    `natural` says whether the coordinates are natural, None where that is open, and `reason` why. `forces`
    are generalized ones beside L or H, one for every coordinate; they may hold velocities and momenta, and
    the multipliers of the `constraints`, whose forces are among them. `sums` are those that are factors in L
    as it is typed.
    """

    lagrangian: Expr | None
    hamiltonian: Expr | None = None
    kinetic: Expr | None = None
    potential: Expr | None = None
    natural: bool | None = None
    reason: str = ""
    forces: tuple[Expr, ...] = ()
    particles: tuple[MovingBody, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    sums: tuple[Expr, ...] = ()


def system_functions(document: Document) -> SystemFunctions:
    """The functions of the system of a document.

    Raises DocumentError where there is none, or an expression cannot be worked with exactly.
    """
    system = document.system
    if system is None:
        hint = "`hamilton` needs `coordinates`, and a `lagrangian`, energies, particles or a `hamiltonian`"
        raise document.refusal("missing", "system", hint=hint)
    derived = derived_parameters(document)

    def read(expression: Expression | None, key: str) -> Expr | None:
        try:
            return None if expression is None else from_tree(expression.root, derived)
        except ExpressionError as error:
            raise document.refusal(error.message, f"system.{key}") from error

    given, lost = system.forces or {}, read(system.dissipation, "dissipation") or ZERO
    forces = [read(given.get(q), f"forces.{q}") or ZERO for q in system.coordinates]
    if lost:
        if lost.names.isdisjoint(system.velocities):
            v = system.velocities[0]
            hint = f"Rayleigh's function F gives the force -dF/d{v}, such as -c*{v} for c*{v}**2/2"
            message = f"read {shown(str(lost))}: there is no velocity in it"
            raise document.refusal(message, "system.dissipation", hint=hint)
        pairs = zip(forces, system.velocities, strict=True)
        forces = [force - tidy(derivative(lost, v)) for force, v in pairs]
    limits = _constraints(document, system, read) if system.constraints else ()
    if limits:
        forces = [a + b for a, b in zip(forces, reactions(limits, len(forces)), strict=True)]
    written = [e.root for e in (system.lagrangian, system.kinetic, system.potential) if e is not None]
    products = [part for part in nodes(written) if isinstance(part, Product)]
    typed = tuple(from_tree(part, derived) for e in products for part in e.factors if isinstance(part, Sum))
    return _energies(system, read)._replace(forces=tuple(forces), constraints=limits, sums=typed)


def _constraints(document: Document, system: System, read: _Read) -> tuple[Constraint, ...]:
    """The constraints of a system. Raises DocumentError with all that are none, depend, or are too many."""
    rates, problems = dict(zip(system.coordinates, system.velocities, strict=True)), list[Problem]()
    found: list[Constraint] = []
    equations = system.constraints or {}
    for name, equation in equations.items():
        key = f"system.constraints.{equation.place}"
        e = read(equation.expression, f"constraints.{equation.place}")
        try:
            assert e is not None
            found.append(constraint(name, e, rates))
        except ExpressionError as error:
            message = f"read {shown(equation.expression.text)}: {error.message}"
            problems.append(document.problem(message, key, hint=error.hint))
    if len(equations) > len(rates):
        message = f"{len(equations)} constraints, expected at most {len(rates)}: one for each coordinate"
        hint = "leave out what follows from others"
        problems.append(document.problem(message, "system.constraints", hint=hint))
    elif not problems and (place := first_dependent(found)) is not None:
        equation = equations[found[place].name]
        before = f"the {place} before it" if place > 1 else "the one before it"
        message = f"read {shown(equation.expression.text)}: it follows from {before}, or contradicts it"
        hint = f"the slopes of these {place + 1} constraints have rank {place}; leave out one of them"
        problems.append(document.problem(message, f"system.constraints.{equation.place}", hint=hint))
    if problems:
        raise DocumentError(problems)
    return tuple(found)


def _energies(system: System, read: _Read) -> SystemFunctions:
    """The functions of a system without its forces."""
    hamiltonian = read(system.hamiltonian, "hamiltonian")
    if hamiltonian is not None:
        return SystemFunctions(None, hamiltonian, reason="H alone does not tell what its coordinates are")
    lagrangian, kinetic = read(system.lagrangian, "lagrangian"), read(system.kinetic, "kinetic")
    potential, bodies = read(system.potential, "potential") or ZERO, tuple[MovingBody, ...]()
    if system.particles is not None:
        places = [(particle, f"particles.{k}") for k, particle in enumerate(system.particles)]
        bodies = tuple(_body(particle, where, read) for particle, where in places)
        kinetic = kinetic_energy(bodies, dict(zip(system.coordinates, system.velocities, strict=True)))
        added = (read(particle.potential, f"{where}.potential") or ZERO for particle, where in places)
        potential = total([potential, *added])
        driven = next(_driven(system.particles, bodies), None)
        natural, reason = driven is None, "the positions follow from the coordinates without the time"
        reason = reason if driven is None else f"the time is in the position {driven}"
    elif kinetic is not None:
        wrong = unnatural(kinetic, system.velocities)
        natural, reason = wrong is None, "T is homogeneous of degree 2 in the velocities, without the time"
        reason = reason if wrong is None else f"T has {wrong}, as it has not in natural coordinates"
    else:
        reason = "L alone does not tell T from V: give `kinetic` and `potential`, or `particles`"
        return SystemFunctions(lagrangian, reason=reason)
    # A magnetic field, in terms linear in the velocities, does no work, and is no energy.
    parts = linear([potential], system.velocities)
    at_rest = potential if parts is None else parts[1][0]
    lagrangian = kinetic - potential if lagrangian is None else lagrangian
    return SystemFunctions(lagrangian, None, kinetic, at_rest, natural, reason, particles=bodies)


def _body(particle: Particle, where: str, read: _Read) -> MovingBody:
    """A particle or a body of a document, which stands under the key `where`."""

    def one(key: str) -> Expr | None:
        return read(getattr(particle, key), f"{where}.{key}")

    def each(key: str) -> tuple[Expr, ...]:
        entries = enumerate(getattr(particle, key) or ())
        return tuple(read(e, f"{where}.{key}.{place}") or ZERO for place, e in entries)

    mass, moment, angle = map(one, ("mass", "moment_of_inertia", "angle"))
    return MovingBody(mass, each("position"), moment, angle, each("moments"), each("euler"))


def _driven(particles: Sequence[Particle], bodies: Sequence[MovingBody]) -> Iterator[str]:
    """The positions and angles that depend on the time, as they are typed."""
    for particle, body in zip(particles, bodies, strict=True):
        typed = *(particle.position or ()), particle.angle, *(particle.euler or ())
        paths = *body.position, body.angle, *body.euler
        for given, path in zip(typed, paths, strict=True):
            if given is not None and path is not None and not is_zero(derivative(path, TIME)):
                yield given.text


def require_formulas(document: Document, expressions: Iterable[Expr], what: str) -> None:
    """Raise DocumentError where there is an unknown function in expressions; `what` needs its formula."""
    names = sorted(frozenset[str]().union(*(e.unknown for e in expressions)))
    missing = ((f"{what} needs a formula for `{name}`", f"system.functions.{name}") for name in names)
    if names:
        raise DocumentError([document.problem(message, key) for message, key in missing])


def derived_parameters(document: Document) -> dict[str, Expr]:
    """The parameters as they stand in expressions.

    Those that are given by others are functions of these, so that no law is missed. A letter without a value
    is positive, and so is one with a positive value: sqrt(d**2) is d.
    """
    known, derived = known_values(document), dict[str, Expr]()
    for name, definition in document.definitions.items():
        if definition is not None and definition.names:
            derived[name] = from_tree(definition.root, derived)
        elif name not in known or float(known[name]) > 0:
            derived[name] = symbol(name, positive=True)
    return derived


def known_values(document: Document) -> dict[str, Expr]:
    """The parameters that have values, exactly as they are given."""
    known: dict[str, Expr] = {}
    for name, definition in document.definitions.items():
        if definition is not None and definition.names <= known.keys():
            known[name] = from_tree(definition.root, known)
    return known


# What the text of a decimal has, and no other part of an expression.
DECIMAL = re.compile(r"\.\d|\de-")


def style_of(document: Document) -> Style:
    """How a document is typed: decimals (unless results are exact), sums, and the order of coordinates."""
    decimal = not document.exact_results and DECIMAL.search(repr(document.system)) is not None
    coordinates = () if document.system is None else document.system.coordinates
    return Style(decimal, tuple(_typed_sums(document).items()), coordinates)


def as_typed(fields: Iterable[Field], document: Document) -> list[Field]:
    """Write results in the style of the document, also those inside lists, objects and arrays."""
    style = style_of(document)

    def changed(value: Any) -> Any:
        match value:
            case Expr():
                return value.styled(replace(style, decimal=style.decimal or value.style.decimal))
            case Formula(exact=True):
                return replace(value, root=replace(style, coordinates=()).of(value.root))
            case list():
                return list(map(changed, value))
            case dict():
                return {key: changed(inner) for key, inner in value.items()}
            case np.ndarray() if value.dtype == object:
                return np.array([*map(changed, value.flat)], dtype=object).reshape(value.shape)
            case _:
                return value

    return [replace(entry, value=changed(entry.value)) for entry in fields]


def _typed_sums(document: Document) -> dict[Sum, Sum]:
    """Sums under even powers, as the algebra orders their terms, by the order in which they are typed."""
    system, sums = document.system, dict[Sum, Sum]()
    assert system is not None
    values = derived_parameters(document)
    written = [system.lagrangian, system.kinetic, system.potential, system.hamiltonian]
    written += [particle.potential for particle in system.particles or ()]
    for part in nodes(e.root for e in written if e is not None):
        if isinstance(part, Power) and isinstance(part.base, Sum) and is_even(part.exponent):
            terms = [from_tree(term, values) for term in part.base.terms]
            typed, square = Sum(tuple(map(to_tree, terms))), to_tree(total(terms) ** 2)
            if isinstance(typed.terms[0], Negative) or not isinstance(square, Power):
                continue
            # The square may have the negatives of the terms.
            both = {*typed.terms}, {-term for term in typed.terms}
            if isinstance(square.base, Sum) and {*square.base.terms} in both:
                sums.setdefault(square.base, typed)
    return sums


@cache
def step_texts() -> dict[str, dict[str, str]]:
    """The rows of steps.csv by their keys: titles, sentences, and the results that a step shows.

    The words for `{}` in a sentence depend on whether forces act besides those of L.
    """
    with Path(__file__).with_name("steps.csv").open(encoding="utf-8") as table:
        return {row["key"]: row for row in csv.DictReader(table)}


def step(key: str, shown: Iterable[Field], tables: Iterable[Table] = (), *words: str, **named: str) -> Step:
    """A step of the working by steps.csv, with words in its text, and with what is `shown` in it."""
    texts = step_texts()[key]
    title, sentence = (texts[part].format(*words, **named) for part in ("title", "sentence"))
    return Step(title, sentence, tuple(shown), tuple(tables))


def titled(entry: Field, title: str = "") -> Field:
    """A result as a line of the working: with a `title`, its own one, or the last part of its key."""
    if not title and entry.title.strip():
        return replace(entry, key="", cells={})
    name = title or entry.key.rpartition(".")[2]
    return replace(entry, key="", cells={}, title=name, symbol=latex_name(name))
