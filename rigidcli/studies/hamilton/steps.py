"""The working of `hamilton`: from L to momenta, velocities, H and its equations, and what they conserve."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import combinations, islice
from typing import Any, NamedTuple, cast

import numpy as np

from rigidcli.algebra.arithmetic import EXACT
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ZERO, Expr, symbol, total
from rigidcli.algebra.matrices import Matrix, short_determinant
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.core.arithmetic import FLOAT
from rigidcli.document.document import Document
from rigidcli.document.phase_space import Transform
from rigidcli.errors import ExpressionError
from rigidcli.language.text import latex_name, reading
from rigidcli.language.tree import Formula, Name, Negative, Node, Product, Sum, bound
from rigidcli.mechanics.canonical import Generated
from rigidcli.mechanics.particles import turning, velocity
from rigidcli.mechanics.phase_space import TIME, Phase
from rigidcli.report import Field, Step, Table
from rigidcli.studies import writing
from rigidcli.studies.axes.steps import reduced, solution
from rigidcli.studies.hamilton import constraints, sections
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.findings import Findings
from rigidcli.studies.hamilton.linear_equations import MOST_COLUMNS
from rigidcli.studies.hamilton.oscillations import Oscillations
from rigidcli.studies.hamilton.system import as_typed, known_values
from rigidcli.studies.hamilton.transform import TransformedSystem, given_side

# The longest formula that is shown, in characters: a longer one teaches nothing.
LONGEST_FORMULA = 300
# Brackets that are worked out: all of two pairs of variables, of which further ones follow the same rule.
MOST_BRACKETS = 6
# Particles whose positions are shown: those of further ones follow the same rule.
MOST_PARTICLES = 3
# How the keys of results begin that come after the multipliers of constraints.
OF_CONSTRAINTS = ("degrees_of_freedom", "multipliers.", "constraint_forces.", "accelerations.")


def hamilton_steps(findings: Findings, fields: Sequence[Field], tables: Sequence[Table]) -> Iterator[Step]:
    """Lead to the results step by step; brackets with H show that quantities are conserved."""
    derivation, system = findings.derivation, findings.derivation.system
    # T + V is no step where it is H, nor is a matrix that leads to no rates, or whose rates modes have.
    repeated = {"energy"} if derivation.energy_excess == ZERO else set()
    pairs = next((entry.value for entry in fields if entry.key == "eigenvalues"), None)
    is_still = pairs is not None and not any(part for pair in pairs for part in pair.values())
    if findings.oscillations is not None or is_still:
        repeated |= {"matrix", "offset", "frequencies", "stability"}
    if system.kinetic is not None:
        shown = [_titled(entry) for entry in fields if entry.key == "lagrangian"]
        bodies = any(particle.moments for particle in system.particles)
        turns = " and, of a body in space, of I omega^2/2 over its principal axes" * bodies
        way = f"The velocities are the rates of the positions, T is the sum of m v^2/2{turns}, and "
        sentence = f"{way if system.particles else ''}L = T - V."
        yield Step("Lagrangian", sentence, (*_energies(derivation), *shown))
    of_constraints = OF_CONSTRAINTS if system.constraints else ()
    constrained = [entry for entry in fields if entry.key.startswith(of_constraints)]
    for part in PARTS if derivation.momenta is not None else PARTS[3:]:
        if part.title == "Matrix form" and constrained:
            yield from constraints.steps(derivation, list(map(_titled, constrained)))
        shown = [entry for entry in fields if _belongs(entry, part) and entry.key not in repeated]
        shown = [entry for entry in shown if entry not in constrained]
        listed = tuple(table for table in tables if table.key in part.keys)
        if not (shown or listed) or [(entry.key, entry.value) for entry in shown] == [("dH_dt", 0)]:
            continue
        sentence = part.sentence.format(part.forces[derivation.is_forced])
        shown = list(part.arranged(findings, shown)) if shown else []
        yield Step(part.title, sentence, tuple(map(_titled, shown)), listed)
    if findings.driven is not None:
        yield from findings.driven.steps()
    if findings.observed is not None:
        yield from findings.observed.steps(derivation)
    if findings.transform is not None:
        yield from _of_transform(findings.document, findings.transform, derivation.phase, fields)
    if findings.oscillations is not None:
        if findings.oscillations.steady:
            kinds = ("routhian", "effective_potential", "steady")
            shown = [e for kind in kinds for e in fields if e.key.partition(".")[0] == kind]
            sentence = (
                "The momenta of the cyclic coordinates are constants. R = L - sum p v over these coordinates "
                "depends on the others alone, V_eff = -R at rest, and motion is steady where all slopes of "
                "V_eff vanish."
            )
            yield Step("Steady motion", sentence, tuple(map(_titled, shown)))
        place = [_titled(entry) for entry in fields if entry.key.startswith("equilibrium.")]
        yield from _of_oscillations(findings.oscillations, findings.document, place)
    asked, orbit = findings.document.orbit, findings.orbit
    if asked is not None and orbit is not None and asked.events:
        yield from sections.steps(asked, orbit.end, len(orbit.times))
    if derivation.hamiltonian is None:
        return
    named = [entry.value for entry in fields if entry.key == "invariant_names"]
    for name, e in zip(*named, findings.invariants or (), strict=True):
        title = reading(e.tree()) if name is None else f"{name[0].upper()}{name[1:]}"
        yield _bracket(title, e, derivation.hamiltonian, derivation.phase)


def _energies(derivation: Derivation) -> Iterator[Field]:
    system, phase = derivation.system, derivation.phase
    rates = dict(zip(phase.coordinates, derivation.velocity_names, strict=True))
    several = len(system.particles) > 1
    for number, particle in enumerate(system.particles[:MOST_PARTICLES], 1):
        paths = dict(zip("xyz", particle.position, strict=False))
        if particle.angle is not None:
            paths["angle"] = particle.angle
        for axis, path in paths.items():
            name = f"{axis}{number}" if several else axis
            rate = velocity(path, rates)
            if path != symbol(name) and not (path.is_zero and rate.is_zero):
                yield Field("", path, name, latex_name(name))
                yield Field("", rate, f"d{name}/dt", rf"\dot {{{latex_name(name)}}}")
        if particle.moments:
            turned = turning(particle, [velocity(angle, rates) for angle in particle.euler])
            for k, e in enumerate(turned, 1):
                name = f"omega{k}" + (f" of body {number}" if several else "")
                yield Field("", tidy(e), name, rf"\omega_{k}")
    yield Field("", system.kinetic, "T", "T")
    yield Field("", system.potential, "V", "V")


def _slopes(findings: Findings, shown: list[Field]) -> Iterator[Field]:
    """Show dL/dqdot, its rate, and dL/dq, of which Lagrange's equations are made, and then the equations."""
    derivation = findings.derivation
    lagrangian, phase, names = derivation.system.lagrangian, derivation.phase, derivation.velocity_names
    assert lagrangian is not None
    assert derivation.lagrange is not None
    rates = (*names, *derivation.lagrange.names)
    moving = dict(zip((*phase.coordinates, *names), rates, strict=True))
    for q, v in zip(phase.coordinates, names, strict=True):
        momentum = tidy(derivative(lagrangian, v))
        parts = {f"dL/d{v}": momentum, f"d/dt dL/d{v}": velocity(momentum, moving)}
        parts[f"dL/d{q}"] = tidy(derivative(lagrangian, q))
        signs = (rf"\partial L/\partial {latex_name(x)}" for x in (v, v, q))
        for (title, e), sign in zip(parts.items(), signs, strict=True):
            if len(str(e)) <= LONGEST_FORMULA:
                rate = r"\frac{\mathrm{d}}{\mathrm{d}t}\," if title.startswith("d/dt") else ""
                yield Field("", e, title, rate + sign)
    yield from shown


def _substituted(findings: Findings, shown: list[Field]) -> Iterator[Field]:
    """Show the sum of p_q qdot, less L, with the velocities put in, and then the H that it comes to."""
    derivation, lagrangian = findings.derivation, findings.derivation.system.lagrangian
    if lagrangian is not None and derivation.velocities is not None:
        trees = [velocity.tree() for velocity in derivation.velocities]
        terms = [Product((Name(p), tree)) for p, tree in zip(derivation.phase.momenta, trees, strict=True)]
        inner = bound(lagrangian.tree(), dict(zip(derivation.velocity_names, trees, strict=True)))
        whole = Sum((*terms, Negative(inner)))
        if len(reading(whole)) <= LONGEST_FORMULA:
            yield Field("", Formula(whole, exact=True), "p_q qdot - L", r"\sum p_q\dot q - L")
    yield from shown


def _with_polynomial(findings: Findings, shown: list[Field]) -> Iterator[Field]:
    """Show the matrix and the offset of linear equations, the characteristic polynomial, and its roots."""
    given = [entry for entry in shown if entry.key in ("matrix", "offset")]
    yield from given
    yield from _of_matrix(given[0].value, findings.document)
    yield from shown[len(given) :]


class _Part(NamedTuple):
    """A step shows the results and tables that have its `keys`, `arranged` with what leads to these.

    The sentence has a place for words that depend on whether there are no `forces` beside L, or some.
    """

    title: str
    sentence: str
    keys: tuple[str, ...]
    arranged: Callable[[Findings, list[Field]], Iterable[Field]] = lambda findings, shown: shown
    forces: tuple[str, str] = ("", "")


# The steps that show results; the first three lead to H. One without results is left out.
PARTS = (
    _Part(
        "Momenta",
        "The momentum of a coordinate q is the derivative of L by its velocity.",
        ("momentum_definitions",),
    ),
    _Part("Velocities", "These equations are solved for the velocities.", ("velocity_solutions",)),
    _Part(
        "Hamiltonian",
        "H is the sum of p_q qdot, less L, with the velocities as functions of the momenta.",
        ("hamiltonian", "branches"),
        _substituted,
    ),
    _Part(
        "Hamilton's equations",
        "The rate of a coordinate is the derivative of H by its momentum, that of a momentum minus the "
        "derivative of H by its coordinate{}.",
        ("equations",),
        forces=("", ", plus the force"),
    ),
    _Part(
        "Lagrange's equations",
        "The same motion in one equation of second order a coordinate: d/dt (dL/dqdot) - dL/dq {}.",
        ("lagrange_equations", "accelerations"),
        _slopes,
        ("vanishes", "is the force"),
    ),
    _Part(
        "Matrix form",
        "The equations are linear in the coordinates and momenta, which are the entries of z. A root i w of "
        "the polynomial is an oscillation at the rate w; motion grows at one with a positive real part.",
        ("matrix", "offset", "frequencies", "stability"),
        _with_polynomial,
    ),
    _Part(
        "Energy",
        "Along the motion, dH/dt is the partial derivative of H by the time{}. T + V is the energy.",
        ("dH_dt", "energy", "h_equals_energy", "natural"),
        forces=("", ", plus the power of the forces"),
    ),
)


def _bracket(name: str, e: Expr, h: Expr, phase: Phase) -> Step:
    pairs = [*zip(phase.coordinates, phase.momenta, strict=True)]
    first = tidy(total(derivative(e, q) * derivative(h, p) for q, p in pairs))
    second = tidy(total(derivative(e, p) * derivative(h, q) for q, p in pairs))
    sentence = "Its bracket with H, the sum of df/dq dH/dp - df/dp dH/dq, vanishes, as both sums are equal."
    sums = Field("", first, "sum of df/dq dH/dp"), Field("", second, "sum of df/dp dH/dq")
    return Step(f"{name} is conserved", sentence, (Field("", e, "f", "f"), *sums))


def _belongs(entry: Field, part: _Part) -> bool:
    """Whether the result belongs to this part, and has something to show."""
    if entry.key.partition(".")[0] not in part.keys:
        return False
    if entry.key == "offset" and isinstance(entry.value, np.ndarray) and not any(entry.value.flat):
        return False
    if entry.value is None:
        return False
    return bool(entry.words) or not (isinstance(entry.value, bool | list) or np.size(entry.value) == 0)


def _titled(entry: Field) -> Field:
    """The result with a title: its own, or else the last part of its key."""
    if entry.title.strip():
        return replace(entry, key="", cells={})
    name = entry.key.rpartition(".")[2]
    return replace(entry, key="", cells={}, title=name, symbol=latex_name(name))


def _of_transform(
    document: Document, transform: TransformedSystem, old: Phase, fields: Sequence[Field]
) -> Iterator[Step]:
    assert document.transform is not None
    asked = document.transform.model_copy(update={"new_variables": transform.names})
    values, pairs, phase = given_side(document, asked, old, transform.generated)
    if transform.generated is not None:
        yield _of_generating(document.transform, transform.generated, fields)
    for (a, b), (name, result) in islice(
        zip(combinations(pairs.names, 2), transform.brackets.items(), strict=True), MOST_BRACKETS
    ):
        slopes = {(x, y): tidy(derivative(values[x], y)) for x in (a, b) for y in phase.names}
        shown = [
            Field("", e, f"d{x}/d{y}", rf"\partial {latex_name(x)}/\partial {latex_name(y)}")
            for (x, y), e in slopes.items()
            if not e.is_zero
        ]
        terms = list[Node]()
        for q, p in zip(phase.coordinates, phase.momenta, strict=True):
            # dA/dq dB/dp - dA/dp dB/dq, before it is worked out
            first, second = ([slopes[a, x], slopes[b, y]] for x, y in ((q, p), (p, q)))
            terms += [Product((first[0].tree(), first[1].tree()))] if all(first) else []
            terms += [Negative(Product((second[0].tree(), second[1].tree())))] if all(second) else []
        whole = writing.total(terms)
        sign = rf"\{name[:-1]}\}}"
        if len(reading(whole)) <= LONGEST_FORMULA:
            shown.append(Field("", Formula(whole, exact=True), name, sign))
        if reading(whole) != reading(result.tree()):
            shown.append(Field("", result, name, sign))
        yield Step(
            f"Bracket {name}",
            f"The bracket of A and B is the sum of dA/dq dB/dp - dA/dp dB/dq, here over the pairs of "
            f"{' and '.join(phase.names)}. The change is canonical only if this one is "
            f"{transform.canonical[name]}.",
            tuple(shown),
        )
    if transform.hamiltonian is not None:
        timed = (
            " The change depends on the time: what makes the new variables move at fixed old ones is added."
        )
        sentence = "The old variables are put into H as functions of the new ones."
        sentence += timed if any(TIME in e.names for e in values.values()) else ""
        sentence += " The derivatives of the new H are the new equations."
        keys = ("transform.hamiltonian", "transform.equations.")
        shown = [_titled(entry) for entry in fields if entry.key.startswith(keys)]
        yield Step("Hamiltonian in the new variables", sentence, tuple(shown))


# What follows from each type of generating function.
_RELATIONS = {
    "F1": "p = dF/dq and P = -dF/dQ",
    "F2": "p = dF/dq and Q = dF/dP",
    "F3": "q = -dF/dp and P = -dF/dQ",
    "F4": "q = -dF/dp and Q = dF/dP",
}


def _of_generating(transform: Transform, generated: Generated, fields: Sequence[Field]) -> Step:
    assert transform.generating is not None
    kind, function = transform.generating
    sentence = f"A generating function of type {kind} gives {_RELATIONS[kind]}."
    solved = next((side for side in ("old", "new") if getattr(generated, side) is not None), None)
    sentence += f" These relations are solved for the {solved} variables." if solved else ""
    keys = ("transform.change.", *([f"transform.{solved}."] if solved else []))
    relations = [
        replace(_titled(entry), title=name, symbol=latex_name(name))
        for entry in fields
        for key in keys
        if entry.key.startswith(key) and (name := entry.key.removeprefix(key))
    ]
    shown = Field("", Formula(function.root, exact=True), kind, f"{kind[0]}_{kind[1]}")
    return Step("Generating function", sentence, (shown, *relations))


def _of_matrix(matrix: Sequence[Sequence[Expr]], document: Document) -> list[Field]:
    """Show det(A - lambda 1), where people are shown the matrix A and it does not change with the time."""
    names = {name for row in matrix for e in row for name in e.names}
    if len(matrix) > MOST_COLUMNS or TIME in names:
        return []
    unknown = writing.free_name(("lambda", "Lambda"), frozenset(names))
    x = symbol(unknown)
    shifted = [[e - x if i == j else e for j, e in enumerate(row)] for i, row in enumerate(matrix)]
    head = rf"\det(\mathbf{{A}} - \{unknown}\mathbf{{1}})"
    return list(_polynomial(shifted, unknown, document, f"det(A - {unknown} 1)", head))


def _of_oscillations(
    oscillations: Oscillations, document: Document, place: Sequence[Field]
) -> Iterator[Step]:
    """Show the linear equations about an equilibrium, the polynomial of the rates, and the mode vectors."""
    motion = oscillations.motion
    names = frozenset(name for e in motion.entries for name in e.names)
    is_free, is_small = not any(e for row in motion.rates for e in row), len(motion.masses) <= MOST_COLUMNS
    unknown = writing.free_name(("omega", "Omega") if is_free else ("s", "S", "sigma"), names)
    x, named = symbol(unknown), dict(zip("MCK", motion.parts, strict=True))
    if is_free:
        named.pop("C")
        equations, matrix = "M y'' + K y = 0", motion.pencil(ZERO, -(x**2))
        way = "At the rate of a mode this determinant vanishes; where its square is negative, motion grows."
        title = f"det(K - {unknown}^2 M)"
        head = rf"\det(\mathbf{{K}} - \{unknown}^2\,\mathbf{{M}})"
    else:
        equations, matrix = "M y'' + C y' + K y = 0", motion.pencil(x, x**2)
        way = f"For y = Re(v exp({unknown} t)) this determinant vanishes; a root with Re {unknown} > 0 grows."
        title = f"det(M {unknown}^2 + C {unknown} + K)"
        head = rf"\det(\mathbf{{M}} {unknown}^2 + \mathbf{{C}} {unknown} + \mathbf{{K}})"
    fields = [_matrix(name, part, document) for name, part in named.items()] if is_small else []
    fields += _polynomial(matrix, unknown, document, title, head)
    yield Step(
        "Small oscillations",
        f"To first order in the displacement y from the equilibrium, {equations}. {way}",
        (*place, *fields),
    )
    if is_free and is_small:
        yield from _vectors(oscillations, document, unknown)


def _vectors(oscillations: Oscillations, document: Document, unknown: str) -> Iterator[Step]:
    """Show the equations (K - omega^2 M) v = 0 at each rate, and the vectors that solve them."""
    motion, names, number = oscillations.motion, list(oscillations.place), 1
    known = known_values(document)
    for root in oscillations.roots or ():
        n = EXACT if isinstance(root.rate, Expr) else FLOAT
        if isinstance(root.rate, Expr) and root.rate.style.decimal:
            number += len(root.vectors)  # a rounded rate solves no equations
            continue
        motion = motion if n.exact else motion.changed(lambda e: substitute(e, known))
        masses, stiffness = (n.array(part) for part in (motion.masses, motion.stiffness))
        square = cast(Any, root.angular) ** 2 - cast(Any, root.growth) ** 2
        matrix = n.tidy(stiffness - square * masses)
        head = f"K - {unknown}^2 M"
        fields = [
            Field("", square, f"{unknown}^2", rf"\{unknown}^2"),
            Field("", matrix, head, rf"\mathbf{{K}} - \{unknown}^2\,\mathbf{{M}}"),
        ]
        is_solved = not n.exact or all(isinstance(x, Expr) for vector in root.vectors for x, _ in vector)
        echelon = reduced(matrix, len(matrix) - len(root.vectors), n) if is_solved else None
        fields += [] if echelon is None else solution(*echelon, names, n)
        vectors = [(n if is_solved else FLOAT).array([x for x, _ in vector]) for vector in root.vectors]
        fields += [Field("", vector, "v", r"\mathbf{v}") for vector in vectors]
        last = number + len(vectors) - 1
        title = f"Vector of mode {number}" if last == number else f"Vectors of modes {number} to {last}"
        several = "" if last == number else "; any independent solutions serve"
        sentence = f"At this rate ({head}) v = 0 tells the ratios of the components of v{several}."
        yield Step(title, sentence, tuple(fields))
        number = last + 1


def _is_numeric(entries: Sequence[Expr], document: Document) -> bool:
    return not document.exact_results and not any(e.names or e.unknown for e in entries)


def _matrix(name: str, matrix: Matrix, document: Document) -> Field:
    kind = float if _is_numeric([e for row in matrix for e in row], document) else object
    return as_typed([Field("", np.array(matrix, dtype=kind), name, rf"\mathbf{{{name}}}")], document)[0]


def _polynomial(matrix: Matrix, unknown: str, document: Document, title: str, head: str) -> Iterator[Field]:
    """Write the determinant as a polynomial in one name."""
    by_degree = None
    with suppress(ExpressionError):
        determinant = tidy(short_determinant(matrix))
        by_degree = coefficients(determinant, [unknown])
    if by_degree is None:
        return
    x, values = Name(unknown), {k: tidy(e) for (k,), e in sorted(by_degree.items(), reverse=True)}
    n = FLOAT if _is_numeric(list(values.values()), document) else EXACT
    if n.exact and len(str(determinant)) > LONGEST_FORMULA:
        return
    (styled,) = as_typed([Field("", list(values.values()))], document)
    by_power = zip(values, styled.value if n.exact else map(float, styled.value), strict=True)
    polynomial = writing.total(writing.product(n, e, writing.power(x, k)) for k, e in by_power)
    yield Field("", writing.formula(polynomial, n), title, head)
