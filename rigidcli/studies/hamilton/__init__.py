"""`hamilton`: from a Lagrangian to momenta, the Hamiltonian, Hamilton's equations and what they conserve."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.core.second_run import unshared
from rigidcli.document.document import Document
from rigidcli.document.phase_space import acceleration
from rigidcli.language.text import latex_name, reading
from rigidcli.mechanics.inversion import Branch
from rigidcli.mechanics.lagrange_equations import reactions
from rigidcli.mechanics.phase_space import TIME
from rigidcli.report import NOISE, Column, Field, Report, Step, Table, yes_or_no
from rigidcli.studies.common import celled, if_known, noise, report, require_values, trusted
from rigidcli.studies.hamilton import linear_equations
from rigidcli.studies.hamilton.derivation import Derivation, derive
from rigidcli.studies.hamilton.linear_equations import Driven, driven
from rigidcli.studies.hamilton.system import as_typed, require_formulas, row_of
from rigidcli.studies.pictures import drawn

if TYPE_CHECKING:
    from rigidcli.core.libration import Libration
    from rigidcli.picture import Picture
    from rigidcli.studies.hamilton.equations_of_motion import InitialState
    from rigidcli.studies.hamilton.observables import Observed
    from rigidcli.studies.hamilton.orbit import OrbitSolution
    from rigidcli.studies.hamilton.oscillations import Oscillations
    from rigidcli.studies.hamilton.transform import TransformedSystem

Progress: TypeAlias = Callable[[float], None] | None  # gets the share done

# The longest expression that people see, in characters: it fills a screen.
LONGEST_SHOWN = 2_000


@dataclass
class Findings:
    """What was found on the system of a document; None for what it does not ask.

    The derivation is on the branch of the velocities that the orbit is on, if there is one.
    """

    document: Document
    derivation: Derivation
    branches: Sequence[Branch] = ()
    initial: InitialState | None = None
    oscillations: Oscillations | None = None
    driven: Driven | None = None
    orbit: OrbitSolution | None = None
    libration: Libration | None = None
    transform: TransformedSystem | None = None

    @cached_property
    def observed(self) -> Observed | None:
        """The observables, brackets and events of the orbit, which are imported where there are any."""
        has_events = self.document.orbit is not None and self.document.orbit.events
        if self.document.observables is None and self.document.brackets is None and not has_events:
            return None
        from rigidcli.studies.hamilton.observables import observed

        return observed(self.document, self.derivation)

    @property
    def functions(self) -> dict[str, Expr]:
        """The observables as functions of the state, by their keys."""
        observables = () if self.observed is None else self.observed.observables
        return {f"observables.{one.name}": one.function for one in observables}


def find(document: Document, progress: Progress, followed: OrbitSolution | None) -> Findings:
    """Derive and follow what a document asks for; modules for the rest are not imported.

    Its orbit may have been `followed` already.
    """
    derivation = derive(document)
    found = Findings(document, derivation, derivation.branches)
    if document.equilibrium is not None:
        from rigidcli.studies.hamilton.oscillations import oscillations

        found.oscillations = oscillations(document, document.equilibrium, derivation)
    if document.orbit is not None:
        from rigidcli.studies.hamilton.orbit import period, solve_orbit
        from rigidcli.studies.hamilton.start import initial_state

        require_values(document, "an orbit")
        require_formulas(document, [derivation.generator, *derivation.system.forces], "an orbit")
        derivation, found.initial = initial_state(document, derivation)
        found.derivation = derivation
        found.orbit = followed or solve_orbit(found, progress)
        if derivation.moves_alone:
            found.libration = period(derivation, found.initial, found.orbit)
    if document.transform is not None:
        from rigidcli.studies.hamilton.transform import transformed

        found.transform = transformed(document, document.transform, derivation)
    found.driven = driven(document, derivation)
    return found


def run(
    document: Document,
    *,
    progress: Progress = None,
    steps: bool = False,
    program: bool = False,
    picture: str | None = None,
    scene: bool = False,
    followed: OrbitSolution | None = None,
) -> Report:
    """Derive the equations of the document's system, and follow its orbit; `progress` gets the share done.

    The orbit may have been `followed` already, with others.
    """
    if document.ensemble is not None:
        from rigidcli.studies.ensembles import require_one_start, whole
        from rigidcli.studies.hamilton.many_orbits import together as several

        require_one_start(document, {"picture": picture, "program": program})
        return whole(document, run, several)
    findings = find(document, progress, followed)
    tables = _branch_table(findings)
    tables += _constraint_table(findings)
    if findings.oscillations is not None:
        tables += findings.oscillations.tables()
    tables += orbit_table(findings)
    fields = as_typed(_results(findings), document)
    working: list[Step] = []
    if steps:
        from rigidcli.studies.hamilton.steps import hamilton_steps

        written = hamilton_steps(findings, fields, tables)
        working += [replace(step, fields=tuple(as_typed(step.fields, document))) for step in written]
    pictures: tuple[Picture, ...] = ()
    if picture is not None:
        pictures = drawn("hamilton", picture, findings)
    result = report(document, "hamilton", fields, notes_on(findings), tables, working, pictures)
    if scene:
        from rigidcli.studies.hamilton.pictures import scene_of

        result = replace(result, scene=scene_of(findings))
    if program:
        from rigidcli.studies.hamilton.program import DRIFTS, program_of

        equations = program_of(findings, result.name)
        drifts = [f"in the program {DRIFTS}"] if findings.derivation.system.constraints else []
        result = replace(result, program=equations, notes=(*result.notes, *drifts))
    return result


def _results(findings: Findings) -> list[Field]:
    fields = _first_order(findings.derivation)
    for entry in linear_equations.fields(findings.document, findings.derivation):
        # The modes of small oscillations have the same frequencies.
        entry.diagnostic |= findings.oscillations is not None
        fields.append(entry)
    if findings.driven is not None:
        fields += findings.driven.fields()
    fields += _conservation(findings.derivation)
    fields += _second_order(findings.derivation)
    fields += _constraint_forces(findings.derivation)
    if findings.observed is not None:
        fields += findings.observed.fields(findings.orbit)
    small = findings.oscillations
    fields += [Field("equilibrium", None), Field("modes", None)] if small is None else small.fields()
    fields += _routhian(findings)
    fields += _energy(findings.derivation)
    fields += _invariants(findings)
    if len(findings.branches) < 2:
        fields.append(Field("branches", []))
    if findings.transform is not None:
        fields += findings.transform.fields()
    if findings.orbit is not None:
        fields += _orbit_quality(findings.orbit, findings.derivation.invariants or ())
    is_beside_cyclic = findings.derivation.moves_alone and bool(findings.derivation.cyclic)
    if findings.libration is not None or (findings.orbit and is_beside_cyclic):
        fields += _libration(findings.libration, findings.derivation)
    return fields


def _first_order(derivation: Derivation) -> list[Field]:
    phase, momenta = derivation.phase, derivation.momenta
    velocities = derivation.velocity_names
    fields = [
        Field("coordinates", list(phase.coordinates)),
        Field("velocities", list(velocities)),
        Field("momenta", list(phase.momenta)),
        _expression("lagrangian", derivation.system.lagrangian),
    ]
    fields += by_name("momentum_definitions", phase.momenta, momenta.definitions or None, named)
    fields += by_name("velocity_solutions", velocities, derivation.rates.values() or None)
    fields.append(_expression("hamiltonian", derivation.hamiltonian))
    fields.append(Field("conditions", [f"{e} > 0" for e in derivation.conditions]))
    fields.append(Field("mass_matrix", [list(row) for row in momenta.mass_matrix] or None))
    # Where each momentum is its own velocity times a factor, anybody sees the way back.
    factors = [e / symbol(v) for e, v in zip(momenta.definitions, velocities, strict=False)]
    is_clear = bool(factors) and all(factor.names.isdisjoint(velocities) for factor in factors)
    hidden = phase.coordinates if is_clear else ()
    return fields + by_name("equations", phase.names, derivation.equations, rate_named, hidden)


def _conservation(derivation: Derivation) -> list[Field]:
    """What is cyclic, what is conserved, and whether H and the coordinates depend on the time."""
    cyclic, system = list(derivation.cyclic), derivation.system
    rate = tidy(derivation.power) if derivation.is_short else None
    is_energy = derivation.energy_excess is not None and derivation.energy_excess.is_zero
    words = ("H = T + V" if name == "H" and is_energy else name for name in derivation.conserved)
    natural = f"{yes_or_no(system.natural, 'not known')}: {system.reason}"
    # That L alone does not tell T from V, or that H is T + V, stands in other rows.
    repeats = system.natural is None or (system.natural and is_energy)
    changed = [f"p_{q}" for q in cyclic if q not in derivation.conserved_momenta and system.constraints]
    but = f" in L; forces of constraint change {', '.join(changed)}" if changed else ""
    return [
        row_of("cyclic", cyclic, words=", ".join(cyclic) + but or "none", diagnostic=not cyclic),
        row_of("conserved", derivation.conserved, words=", ".join(words) or "nothing found"),
        row_of("explicit_time", derivation.explicit_time),
        # Where H does not change, it is among what is conserved.
        replace(_expression("dH_dt", rate), diagnostic=rate is not None and rate.is_zero),
        row_of("natural", system.natural, words=natural, diagnostic=repeats),
        Field("natural_reason", system.reason),
    ]


def _second_order(derivation: Derivation) -> list[Field]:
    """Lagrange's equations and accelerations; people see the shorter ones, or accelerations if constant."""
    coordinates, lagrange = derivation.phase.coordinates, derivation.lagrange
    second = tuple(map(acceleration, coordinates))
    vanishing, solved = None if lagrange is None else lagrange.equations, derivation.accelerations
    moving = (*coordinates, *derivation.velocity_names, TIME)
    is_solved = solved is not None and all(e.names.isdisjoint(moving) for e in solved)
    if vanishing and solved:
        is_solved |= sum(len(str(e)) for e in solved) <= sum(len(str(e)) for e in vanishing)
    hidden = coordinates if is_solved else second
    equations = by_name(
        "lagrange_equations", coordinates, vanishing, lambda q: (f"Lagrange, {q}: 0 =", "0"), hidden
    )
    return equations + by_name("accelerations", second, solved, named, hidden)


def _constraint_forces(derivation: Derivation) -> list[Field]:
    """The multipliers, the forces of the constraints, and how many ways are left to move."""
    limits, coordinates = derivation.system.constraints, derivation.phase.coordinates
    if not limits:
        return []
    multipliers = derivation.multipliers
    forces = derivation.with_multipliers(reactions(limits, len(coordinates)))
    # A force that is a multiplier is shown already.
    pairs = zip(coordinates, forces or (), strict=False)
    hidden = [q for q, e in pairs if e.is_zero or e in (multipliers or ())]
    return [
        row_of("degrees_of_freedom", len(coordinates) - len(limits)),
        *by_name("multipliers", [one.name for one in limits], multipliers, named),
        *by_name("constraint_forces", coordinates, forces, _reaction_named, hidden),
    ]


def _reaction_named(name: str) -> tuple[str, str]:
    return f"force of constraint, {name}", f"R_{{{latex_name(name)}}}"


def _energy(derivation: Derivation) -> list[Field]:
    """T + V, whether it is H, or else by how much they differ, and how well the equations are verified."""
    excess, hamiltonian = derivation.energy_excess, derivation.hamiltonian
    same = None if excess is None else excess.is_zero
    energy = None if excess is None else hamiltonian
    if excess and hamiltonian is not None and derivation.rates:
        energy = tidy(hamiltonian + substitute(excess, derivation.rates))
    differ = f": T + V - H = {reading(to_tree(excess))}" if excess else ""
    words, repeats = f"{yes_or_no(same, 'not known')}{differ}", bool(same) and "H" in derivation.conserved
    return [
        _expression("energy", energy),
        if_known(row_of("h_equals_energy", same, words, diagnostic=repeats)),
        if_known(row_of("verified", derivation.residual)),
    ]


def _expression(key: str, e: Expr | None) -> Field:
    """A result that is an expression; people do not see one that is missing, or longer than LONGEST_SHOWN."""
    entry = if_known(row_of(key, e, cells={key: ()}))
    return replace(entry, title="") if e is not None and _is_long(e) else entry


def _is_long(e: Expr) -> bool:
    return len(e.key) > LONGEST_SHOWN and len(str(e)) > LONGEST_SHOWN


def by_name(
    key: str,
    names: Iterable[str],
    values: Iterable[Expr] | None,
    titled: Callable[[str], tuple[str, str]] = lambda name: ("", ""),
    hidden: Collection[str] = (),
) -> list[Field]:
    """Results that are expressions by name; `titled` gives the title and the symbol for people.

    People see those in `hidden` with `-v` only, and none that is longer than LONGEST_SHOWN.
    """
    if values is None:
        return [Field(key, None)]
    fields = []
    for name, e in zip(names, values, strict=True):
        title, sign = titled(name)
        title = "" if _is_long(e) else title
        fields.append(celled(f"{key}.{name}", e, title, sign, diagnostic=name in hidden))
    return fields


def named(name: str) -> tuple[str, str]:
    """The title and the symbol of a result that has the name of a variable."""
    return name, latex_name(name)


def rate_named(name: str) -> tuple[str, str]:
    """The title and the symbol of the rate of a variable."""
    return f"d{name}/dt" if "_" in name else f"{name}dot", latex_name(f"{name}dot")


def _routhian(findings: Findings) -> list[Field]:
    """Report the Routhian where there are cyclic coordinates and others, if no steady motion has it."""
    derivation, small = findings.derivation, findings.oscillations
    is_partly_cyclic = 0 < len(derivation.conserved_momenta) < len(derivation.phase.coordinates)
    has_steady = small is not None and bool(small.steady)
    if has_steady or not is_partly_cyclic or derivation.system.constraints or not derivation.is_short:
        return []
    from rigidcli.studies.hamilton.oscillations import routhian_fields

    shown = routhian_fields(findings.document, derivation, derivation.conserved_momenta)
    return [replace(entry, diagnostic=True) for entry in shown]


def _invariants(findings: Findings) -> list[Field]:
    """Show further conserved quantities by their names; others share one title, at the first of them."""
    found = findings.derivation.named_invariants
    fields = [Field("invariants", None if found is None else [e for e, _ in found])]
    if not found:
        return fields
    title = row_of("invariants", None).title
    fields.append(Field("invariant_names", [name for _, name in found]))
    for e, name in found:
        words = f"{name}, conserved" if name else title
        fields.append(row_of("invariants", e, key="", title=words))
        title = title if name else " "
    return fields


def _orbit_quality(orbit: OrbitSolution, invariants: Sequence[Expr]) -> list[Field]:
    further, drifts = set(map(str, invariants)), list[Field]()
    for name, drift in orbit.drift.items():
        if name not in further:
            cells = {f"orbit.drift.{name}": ()}
            symbol = rf"\text{{drift of }}{latex_name(name)}"
            drifts.append(Field("", drift, f"drift of {name}", symbol, "", cells, diagnostic=True))
    if further:
        largest = max(orbit.drift[name] for name in further)
        drifts.append(Field("", largest, "largest drift of the others", diagnostic=True))
    time, reason = orbit.end or (None, "")
    end = [row_of("orbit.end.t", time), row_of("orbit.end.reason", reason, words=reason)]
    return [
        row_of("orbit.method", orbit.method, words=orbit.method),
        row_of("orbit.steps", orbit.steps),
        trusted("hamilton", "orbit.trusted_digits", orbit.trusted_digits),
        Field("orbit.drift", orbit.drift),
        *(end if orbit.end else ()),
        *drifts,
    ]


def _libration(found: Libration | None, derivation: Derivation) -> list[Field]:
    """The period, action and turning points; null where the coordinate does not move to and fro."""
    rows = [
        row_of("orbit.period", found and found.period),
        row_of("orbit.action", found and found.action),
        row_of("orbit.turning_points", found and np.array(found.turning_points)),
    ]
    if derivation.cyclic:  # the orbit itself need not close
        (name,) = {*derivation.phase.coordinates} - {*derivation.cyclic}
        rows = [replace(row, title=f"{row.title.removesuffix(' of the orbit')} of {name}") for row in rows]
    return list(map(if_known, rows))


def _constraint_table(findings: Findings) -> list[Table]:
    limits = findings.derivation.system.constraints
    if not limits:
        return []
    (typed,) = as_typed([Field("", [one.expression for one in limits])], findings.document)
    kinds = [one.holonomic for one in limits]
    columns = (
        Column("name", [one.name for one in limits], ("multiplier",)),
        Column("expression", typed.value, ("what vanishes",)),
        Column("holonomic", kinds, ("holonomic",), words=tuple(map(yes_or_no, kinds))),
    )
    return [Table("constraints", "constraints", columns, records=True)]


def _branch_table(findings: Findings) -> list[Table]:
    branches, names = findings.branches, findings.derivation.velocity_names
    if len(branches) < 2:
        return []
    columns = [Column(name, [one.velocities[k] for one in branches], (name,)) for k, name in enumerate(names)]
    columns.append(Column("hamiltonian", [branch.hamiltonian for branch in branches], ("H",)))
    columns.append(Column("range", [branch.validity for branch in branches], ("where",)))
    return [Table("branches", "several velocities have the same momenta", tuple(columns), records=True)]


def orbit_table(findings: Findings) -> list[Table]:
    """Make a table of the samples of the orbit."""
    orbit = findings.orbit
    if orbit is None:
        return []
    samples, error = orbit.samples, noise(orbit.trusted_digits)
    columns = [Column(TIME, samples.times, (TIME,), "s", (TIME,))]
    for key, values in samples.values.items():
        name, largest = key.partition(".")[2], float(np.abs(values).max())
        if key == "H":
            # What changes in a constant is rounding.
            is_constant = largest and "H" in findings.derivation.conserved
            columns.append(
                Column(key, values, (key,), noise=np.ptp(values) / largest if is_constant else NOISE)
            )
            continue
        # The error is a share of the largest value on the way: a section may hold small ones only.
        share = max(1.0, orbit.scales[key] / largest) if largest else 1.0
        columns.append(Column(key, values, (name,), symbols=(latex_name(name),), noise=error * share))
    return [Table("orbit", "the orbit", tuple(columns), data=True)]


def notes_on(findings: Findings) -> list[str]:
    """The notes of a report: conditions, what is too long, and how far the orbit can be trusted."""
    derivation = findings.derivation
    notes = [*derivation.notes, *(findings.oscillations.notes if findings.oscillations else ())]
    notes += [] if findings.driven is None else findings.driven.notes()
    notes += [
        f"H has a step where {place} = 0, which its equations do not tell" for place in derivation.jumps
    ]
    known = {"the Hamiltonian": derivation.hamiltonian} | {
        f"{name}dot": e for name, e in zip(derivation.phase.names, derivation.equations or (), strict=False)
    }
    long = [f"{name} ({len(str(e)):,} characters)" for name, e in known.items() if e and _is_long(e)]
    if long:
        notes.append(f"too long for people to read: {', '.join(long)}; `-f json` prints all of it")
    if derivation.system.constraints and derivation.multipliers is None:
        notes.append(
            "the multipliers are too long to be worked out in symbols; orbits solve for them in numbers"
        )
    orbit = findings.orbit
    if orbit is not None:
        notes += ["the orbit is followed in floating-point numbers"] * findings.document.exact_results
        notes += orbit.remarks
    if orbit is not None and findings.libration is None and derivation.moves_alone:
        from rigidcli.studies.hamilton.orbit import why_no_period

        notes += why_no_period(derivation, orbit)
    if findings.libration is not None and findings.libration.error > 1e-9:
        digits = int(-math.log10(findings.libration.error))
        notes.append(f"near the separatrix the period and the action have {digits} digits")
    if orbit is not None and orbit.lost is not None:
        may_be_chaotic = len(derivation.phase.coordinates) > 1 or derivation.explicit_time
        notes.append(unshared("orbit", orbit.lost, may_be_chaotic))
    if findings.transform is not None:
        notes += findings.transform.notes()
    return notes
