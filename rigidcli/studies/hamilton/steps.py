"""The working of `hamilton`: from L to momenta, velocities, H and its equations, and what they conserve."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, cast

import numpy as np

from rigidcli.algebra.arithmetic import EXACT
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ZERO, Expr, symbol, total
from rigidcli.algebra.matrices import short_determinant
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.core.arithmetic import FLOAT, Array
from rigidcli.document.document import Document
from rigidcli.document.phase_space import acceleration
from rigidcli.errors import ExpressionError
from rigidcli.language.text import latex_name, reading
from rigidcli.language.tree import Formula, Name, Negative, Product, Sum, bound
from rigidcli.mechanics.particles import turning, velocity
from rigidcli.mechanics.phase_space import TIME
from rigidcli.report import Field, Step, Table
from rigidcli.studies import writing
from rigidcli.studies.axes.steps import reduced, solution
from rigidcli.studies.hamilton import Findings
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.linear_equations import MOST_COLUMNS
from rigidcli.studies.hamilton.oscillations import Oscillations
from rigidcli.studies.hamilton.system import LONGEST_FORMULA, as_typed, known_values, step, step_texts, titled

# Particles whose positions are shown: those of further ones follow the same rule.
MOST_PARTICLES = 3
# Steps that lead from L to H.
LEADS_TO_H = ("momenta", "velocities", "hamiltonian")
# How the keys of results begin that come after the multipliers of constraints.
OF_CONSTRAINTS = ("degrees_of_freedom", "multipliers.", "constraint_forces.", "accelerations.")


def hamilton_steps(findings: Findings, fields: Sequence[Field], tables: Sequence[Table]) -> Iterator[Step]:
    """Lead to the results step by step; brackets with H show that quantities are conserved."""
    derivation, system, phase = findings.derivation, findings.derivation.system, findings.derivation.phase
    # T + V is no step where it is H, nor is a matrix that leads to no rates, or whose rates modes have.
    repeated = {"energy"} if derivation.energy_excess == ZERO else set()
    pairs = next((entry.value for entry in fields if entry.key == "eigenvalues"), None)
    is_still = pairs is not None and not any(part for pair in pairs for part in pair.values())
    if findings.oscillations is not None or is_still:
        repeated |= {"matrix", "offset", "frequencies", "stability"}
    if system.kinetic is not None:
        has_bodies = any(particle.moments for particle in system.particles)
        kind = "bodies" if has_bodies else "particles" if system.particles else "energies"
        yield step(kind, (*_energies(derivation), *_under(fields, "lagrangian")))
    of_constraints = OF_CONSTRAINTS if system.constraints else ()
    constrained = [entry for entry in fields if entry.key.startswith(of_constraints)]
    for part, texts in step_texts().items():
        results = texts["results"].split()
        if part in LEADS_TO_H and not derivation.definitions:
            continue
        if part == "matrix" and constrained:
            yield from _of_constraints(derivation, list(map(titled, constrained)))
        shown = [entry for entry in fields if _belongs(entry, results) and entry.key not in repeated]
        shown = [entry for entry in shown if entry not in constrained]
        listed = tuple(table for table in tables if table.key in results)
        if not (shown or listed) or [(entry.key, entry.value) for entry in shown] == [("dH_dt", 0)]:
            continue
        # What leads to the roots of a matrix stands behind it.
        given = [entry for entry in shown if entry.key in ("matrix", "offset")]
        leads = LEADS[part](findings) if shown and part in LEADS else ()
        shown = [*given, *leads, *shown[len(given) :]]
        yield step(part, map(titled, shown), listed, texts["forced" if derivation.is_forced else "unforced"])
    if findings.driven is not None:
        yield from findings.driven.steps()
    if findings.observed is not None:
        yield from findings.observed.steps(derivation)
    if findings.transform is not None:
        yield from findings.transform.steps(fields)
    if findings.oscillations is not None:
        if findings.oscillations.steady:
            yield step("steady", _under(fields, "routhian", "effective_potential", "steady"))
        place = _under(fields, "equilibrium")
        yield from _of_oscillations(findings.oscillations, findings.document, place)
    if derivation.hamiltonian is None:
        return
    for e, name in derivation.named_invariants or ():
        title = reading(e.tree()) if name is None else f"{name[0].upper()}{name[1:]}"
        h, pairs = derivation.hamiltonian, [*zip(phase.coordinates, phase.momenta, strict=True)]
        first = tidy(total(derivative(e, q) * derivative(h, p) for q, p in pairs))
        second = tidy(total(derivative(e, p) * derivative(h, q) for q, p in pairs))
        sums = Field("", first, "sum of df/dq dH/dp"), Field("", second, "sum of df/dp dH/dq")
        yield step("conserved", (Field("", e, "f", "f"), *sums), name=title)


def _under(fields: Sequence[Field], *keys: str) -> list[Field]:
    """The results under these keys, as lines of the working."""
    return [titled(entry) for key in keys for entry in fields if entry.key.partition(".")[0] == key]


def _energies(derivation: Derivation) -> Iterator[Field]:
    system, rates = derivation.system, derivation.velocity_of
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


def _slopes(findings: Findings) -> Iterator[Field]:
    """The derivatives dL/dqdot, their rates, and dL/dq, of which Lagrange's equations are made."""
    derivation, names = findings.derivation, findings.derivation.velocity_names
    lagrangian = derivation.system.lagrangian
    assert lagrangian is not None
    assert derivation.lagrange is not None
    moving = derivation.velocity_of | dict(zip(names, derivation.lagrange.names, strict=True))
    for q, v in derivation.velocity_of.items():
        momentum, slope = tidy(derivative(lagrangian, v)), rf"\partial L/\partial {latex_name(v)}"
        rate = rf"\frac{{\mathrm{{d}}}}{{\mathrm{{d}}t}}\,{slope}"
        parts = (
            (f"dL/d{v}", momentum, slope),
            (f"d/dt dL/d{v}", velocity(momentum, moving), rate),
            (f"dL/d{q}", tidy(derivative(lagrangian, q)), rf"\partial L/\partial {latex_name(q)}"),
        )
        for title, e, sign in parts:
            if len(str(e)) <= LONGEST_FORMULA:
                yield Field("", e, title, sign)


def _substituted(findings: Findings) -> Iterator[Field]:
    """The sum of p_q qdot, less L, with the velocities put in."""
    derivation, lagrangian = findings.derivation, findings.derivation.system.lagrangian
    if lagrangian is not None and derivation.rates:
        trees = {name: rate.tree() for name, rate in derivation.rates.items()}
        pairs = zip(derivation.phase.momenta, trees.values(), strict=True)
        terms = [Product((Name(p), tree)) for p, tree in pairs]
        whole = Sum((*terms, Negative(bound(lagrangian.tree(), trees))))
        if len(reading(whole)) <= LONGEST_FORMULA:
            yield Field("", Formula(whole, exact=True), "p_q qdot - L", r"\sum p_q\dot q - L")


def _characteristic(findings: Findings) -> Iterator[Field]:
    """The polynomial det(A - lambda 1), where people are shown A and it does not change with the time."""
    if findings.derivation.linear is None:
        return
    matrix, _ = findings.derivation.linear
    names = {name for e in matrix.flat for name in e.names}
    if len(matrix) <= MOST_COLUMNS and TIME not in names:
        unknown = writing.free_name(("lambda", "Lambda"), frozenset(names))
        shifted = matrix - symbol(unknown) * np.eye(len(matrix), dtype=int).astype(object)
        head = rf"\det(\mathbf{{A}} - \{unknown}\mathbf{{1}})"
        yield from _polynomial(shifted, unknown, findings.document, f"det(A - {unknown} 1)", head)


# What is shown before the results of a step.
LEADS: Mapping[str, Callable[[Findings], Iterable[Field]]] = {
    "hamiltonian": _substituted,
    "lagrange": _slopes,
    "matrix": _characteristic,
}


def _of_constraints(derivation: Derivation, shown: list[Field]) -> Iterator[Step]:
    """Lead from the constraints to their multipliers; `shown` are the results on them."""
    limits, phase = derivation.system.constraints, derivation.phase
    matrix = np.array([one.slopes for one in limits], dtype=object)
    rates = [Field("", one.expression, one.name, latex_name(one.name)) for one in limits]
    yield step("constraints", (*rates, Field("", matrix, "A", r"\mathbf{A}")))
    second = []
    for one in limits:
        moved = total(a * symbol(acceleration(q)) for a, q in zip(one.slopes, phase.coordinates, strict=True))
        if not one.has_velocities:
            second.append(Field("", one.rate, f"{one.name}, once: 0 =", "0"))
        times = "once" if one.has_velocities else "twice"
        second.append(Field("", moved + one.turning, f"{one.name}, {times}: 0 =", "0"))
    yield step("differentiated", second)
    yield step("multipliers", shown)


def _belongs(entry: Field, results: Sequence[str]) -> bool:
    """Whether an entry is one of these results, and has something to show."""
    value = entry.value
    if entry.key.partition(".")[0] not in results or value is None:
        return False
    if entry.key == "offset" and not any(value.flat):
        return False
    return bool(entry.words) or not (isinstance(value, bool | list) or np.size(value) == 0)


def _of_oscillations(small: Oscillations, document: Document, place: Sequence[Field]) -> Iterator[Step]:
    """Show the linear equations about an equilibrium, the polynomial of the rates, and the mode vectors."""
    motion = small.motion
    names = frozenset(name for e in motion.entries for name in e.names)
    is_free, is_small = not motion.rates.any(), len(motion.masses) <= MOST_COLUMNS
    unknown = writing.free_name(("omega", "Omega") if is_free else ("s", "S", "sigma"), names)
    x, named = symbol(unknown), dict(zip("MCK", motion, strict=True))
    if is_free:
        named.pop("C")
        matrix = motion.pencil(ZERO, -(x**2))
        title = f"det(K - {unknown}^2 M)"
        head = rf"\det(\mathbf{{K}} - \{unknown}^2\,\mathbf{{M}})"
    else:
        matrix = motion.pencil(x, x**2)
        title = f"det(M {unknown}^2 + C {unknown} + K)"
        head = rf"\det(\mathbf{{M}} {unknown}^2 + \mathbf{{C}} {unknown} + \mathbf{{K}})"
    fields = list[Field]()
    for name, part in named.items() if is_small else ():
        kind = float if _is_numeric(part.flat, document) else object
        fields.append(Field("", part.astype(kind), name, rf"\mathbf{{{name}}}"))
    fields += _polynomial(matrix, unknown, document, title, head)
    yield step("free" if is_free else "damped", (*place, *fields), s=unknown)
    if is_free and is_small:
        yield from _vectors(small, document, unknown)


def _vectors(small: Oscillations, document: Document, unknown: str) -> Iterator[Step]:
    """Show the equations (K - omega^2 M) v = 0 at each rate, and the vectors that solve them."""
    motion, names, number = small.motion, list(small.place), 1
    known = known_values(document)
    for root in small.roots or ():
        n = EXACT if isinstance(root.rate, Expr) else FLOAT
        if isinstance(root.rate, Expr) and root.rate.style.decimal:
            number += len(root.vectors)  # a rounded rate solves no equations
            continue
        motion = motion if n.exact else motion.changed(lambda e: substitute(e, known))
        square = cast(Any, root.angular) ** 2 - cast(Any, root.growth) ** 2
        matrix = n.tidy(n.array(motion.stiffness) - square * n.array(motion.masses))
        head = f"K - {unknown}^2 M"
        fields = [
            Field("", square, f"{unknown}^2", rf"\{unknown}^2"),
            Field("", matrix, head, rf"\mathbf{{K}} - \{unknown}^2\,\mathbf{{M}}"),
        ]
        is_solved = not n.exact or all(vector.dtype == object for vector in root.vectors)
        echelon = reduced(matrix, len(matrix) - len(root.vectors), n) if is_solved else None
        fields += [] if echelon is None else solution(*echelon, names, n)
        fields += [Field("", vector[:, 0], "v", r"\mathbf{v}") for vector in root.vectors]
        last = number + len(root.vectors) - 1
        kind = "mode" if last == number else "modes"
        yield step(kind, fields, first=str(number), last=str(last), matrix=head)
        number = last + 1


def _is_numeric(entries: Iterable[Expr], document: Document) -> bool:
    return not document.exact_results and not any(e.names or e.unknown for e in entries)


def _polynomial(matrix: Array, unknown: str, document: Document, title: str, head: str) -> Iterator[Field]:
    by_degree = None
    with suppress(ExpressionError):
        determinant = tidy(short_determinant(matrix.tolist()))
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
