"""`hamilton`: from a Lagrangian to momenta, the Hamiltonian, Hamilton's equations and what they conserve."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.core.second_run import unshared
from rigidcli.document.document import Document
from rigidcli.document.phase_space import acceleration
from rigidcli.language.text import latex_name, reading
from rigidcli.mechanics.phase_space import TIME
from rigidcli.report import NOISE, Column, Field, Report, Step, Table, yes_or_no
from rigidcli.studies.common import celled, field_of, if_known, noise, report, trusted
from rigidcli.studies.hamilton import linear_equations
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.findings import Findings, find
from rigidcli.studies.hamilton.system import as_typed
from rigidcli.studies.pictures import drawn

if TYPE_CHECKING:
    from rigidcli.core.libration import Libration
    from rigidcli.mechanics.canonical import Generated
    from rigidcli.picture import Picture
    from rigidcli.studies.hamilton.orbit import OrbitSolution
    from rigidcli.studies.hamilton.transform import TransformedSystem


# The longest expression that people see, in characters: it fills a screen.
LONGEST_SHOWN = 2_000


def run(
    document: Document,
    *,
    progress: Callable[[float], None] | None = None,
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
    if findings.derivation.system.constraints:
        from rigidcli.studies.hamilton import constraints

        tables.append(constraints.table(findings.derivation, document))
    if findings.oscillations is not None:
        tables += findings.oscillations.tables()
    if findings.driven is not None:
        tables += findings.driven.tables()
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

        equations = program_of(document, result.name, findings.derivation, findings.initial, findings.orbit)
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
    if findings.derivation.system.constraints:
        from rigidcli.studies.hamilton import constraints

        fields += constraints.fields(findings.derivation)
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
        fields += _transform(findings.transform)
    if findings.orbit is not None:
        fields += _orbit_quality(findings.orbit)
    is_beside_cyclic = findings.derivation.moves_alone and bool(findings.derivation.cyclic)
    if findings.libration is not None or (findings.orbit and is_beside_cyclic):
        fields += _libration(findings.libration, findings.derivation)
    return fields


def _first_order(derivation: Derivation) -> list[Field]:
    phase, system, momenta = derivation.phase, derivation.system, derivation.momenta
    velocities = derivation.velocity_names
    definitions = None if momenta is None else momenta.definitions
    masses = None if momenta is None else [list(row) for row in momenta.mass_matrix]
    fields = [
        Field("coordinates", list(phase.coordinates)),
        Field("velocities", list(velocities)),
        Field("momenta", list(phase.momenta)),
        _expression("lagrangian", system.lagrangian),
    ]
    fields += _by_name("momentum_definitions", phase.momenta, definitions, _own)
    fields += _by_name("velocity_solutions", velocities, derivation.velocities)
    fields.append(_expression("hamiltonian", derivation.hamiltonian))
    fields.append(Field("conditions", [f"{e} > 0" for e in derivation.conditions]))
    fields.append(Field("mass_matrix", masses))
    # Where each momentum is its own velocity times a factor, anybody sees the way back.
    hidden = phase.coordinates if _is_diagonal(definitions or (), velocities) else ()
    return fields + _by_name("equations", phase.names, derivation.equations, _rate, hidden)


def _conservation(derivation: Derivation) -> list[Field]:
    """What is cyclic, what is conserved, and whether H and the coordinates depend on the time."""
    cyclic, system, rate = list(derivation.cyclic), derivation.system, derivation.energy_rate
    is_energy = derivation.energy_excess is not None and derivation.energy_excess.is_zero
    words = ("H = T + V" if name == "H" and is_energy else name for name in derivation.conserved)
    natural = f"{yes_or_no(system.natural, 'not known')}: {system.reason}"
    # That L alone does not tell T from V, or that H is T + V, stands in other rows.
    repeats = system.natural is None or (system.natural and is_energy)
    return [
        _row("cyclic", cyclic, words=", ".join(cyclic) or "none", diagnostic=not cyclic),
        _row("conserved", derivation.conserved, words=", ".join(words) or "nothing found"),
        _row("explicit_time", derivation.explicit_time),
        # Where H does not change, it is among what is conserved.
        replace(_expression("dH_dt", rate), diagnostic=rate is not None and rate.is_zero),
        _row("natural", system.natural, words=natural, diagnostic=repeats),
        Field("natural_reason", system.reason),
    ]


def _second_order(derivation: Derivation) -> list[Field]:
    """Lagrange's equations and accelerations; people see the shorter ones, or accelerations if constant."""
    coordinates, lagrange = derivation.phase.coordinates, derivation.lagrange
    second = [*map(acceleration, coordinates)]
    vanishing = None if lagrange is None else lagrange.equations
    solved = None if lagrange is None else derivation.accelerations
    moving = (*coordinates, *derivation.velocity_names, TIME)
    is_solved = solved is not None and all(e.names.isdisjoint(moving) for e in solved)
    if vanishing and solved:
        is_solved |= sum(len(str(e)) for e in solved) <= sum(len(str(e)) for e in vanishing)
    equations = _by_name(
        "lagrange_equations", coordinates, vanishing, _lagrange, coordinates if is_solved else ()
    )
    return equations + _by_name("accelerations", second, solved, _own, () if is_solved else second)


def _energy(derivation: Derivation) -> list[Field]:
    """T + V, whether it is H, or else by how much they differ, and how well the equations are verified."""
    excess = derivation.energy_excess
    same = None if excess is None else excess.is_zero
    differ = f": T + V - H = {reading(to_tree(excess))}" if excess is not None and not same else ""
    entry = _row("h_equals_energy", same, words=f"{yes_or_no(same, 'not known')}{differ}")
    entry.title = "" if same is None else entry.title
    entry.diagnostic = bool(same) and "H" in derivation.conserved
    return [_expression("energy", derivation.energy), entry, if_known(_row("verified", derivation.residual))]


_row = partial(field_of, "hamilton")


def _expression(key: str, e: Expr | None) -> Field:
    """A result that is an expression; people do not see one that is missing, or longer than LONGEST_SHOWN."""
    entry = if_known(_row(key, e, cells={key: ()}))
    return replace(entry, title="") if e is not None and _is_long(e) else entry


def _is_long(e: Expr) -> bool:
    return len(e.key) > LONGEST_SHOWN and len(str(e)) > LONGEST_SHOWN


def _by_name(
    key: str,
    names: Sequence[str],
    values: Sequence[Expr] | None,
    titled: Callable[[str], tuple[str, str]] = lambda name: ("", ""),
    hidden: Sequence[str] = (),
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


def _is_diagonal(definitions: Sequence[Expr], velocities: Sequence[str]) -> bool:
    pairs = zip(definitions, velocities, strict=False)
    return all((e / symbol(v)).names.isdisjoint(velocities) for e, v in pairs) and len(definitions) > 0


def _own(name: str) -> tuple[str, str]:
    return name, latex_name(name)


def _rate(name: str) -> tuple[str, str]:
    return f"d{name}/dt" if "_" in name else f"{name}dot", latex_name(f"{name}dot")


def _lagrange(name: str) -> tuple[str, str]:
    """The title of one of Lagrange's equations, and its left side."""
    return f"Lagrange, {name}: 0 =", "0"


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
    found = findings.invariants
    fields = [Field("invariants", None if found is None else list(found))]
    if not found:
        return fields
    from rigidcli.studies.hamilton.observables import names_of

    names, title = names_of(found, findings.derivation), _row("invariants", None).title
    fields.append(Field("invariant_names", names))
    for name, e in zip(names, found, strict=True):
        words = f"{name}, conserved" if name else title
        fields.append(_row("invariants", e, key="", title=words))
        title = title if name else " "
    return fields


def _transform(transform: TransformedSystem) -> list[Field]:
    """Say whether a change of variables is canonical, and report H and its equations in the new ones."""
    wrong, where = transform.wrong, ", ".join(transform.conditions)
    words = f"yes, where {where}" if where else "yes"
    if wrong:
        only = ", ".join(f"{reading(to_tree(e))} = 1" for e in transform.open_brackets)
        shown = {name: reading(to_tree(transform.brackets[name])) for name in wrong}
        listed = ", ".join(f"{name} is {e}, not {transform.canonical[name]}" for name, e in shown.items())
        words = f"only if {only}" if only else f"no: {listed}"
    brackets = transform.brackets.items()
    return [
        _row("transform.canonical", not wrong, words=words),
        _row("transform.conditions", list(transform.conditions)),
        *_generated(transform.generated),
        *(Field(f"transform.brackets.{name}", e, name, rf"\{name[:-1]}\}}") for name, e in brackets),
        if_known(_row("transform.hamiltonian", transform.hamiltonian)),
        *_by_name("transform.equations", transform.names, transform.equations, _rate),
    ]


def _generated(generated: Generated | None) -> list[Field]:
    if generated is None:
        return []
    relations = generated.relations
    fields = _by_name("transform.change", tuple(relations), tuple(relations.values()), _as_named)
    shown = [side for side in (generated.old, generated.new) if side is not None][:1]
    for key, side in (("transform.old", generated.old), ("transform.new", generated.new)):
        values = None if side is None else tuple(side.values())
        repeated = [name for name, e in (side or {}).items() if relations.get(name) == e]
        titled = partial(_as_named, hidden=repeated if side in shown else tuple(side or ()))
        fields += _by_name(key, tuple(side or ()), values, titled)
    return fields


def _as_named(name: str, hidden: Sequence[str] = ()) -> tuple[str, str]:
    return ("", "") if name in hidden else (name, latex_name(name))


def _orbit_quality(orbit: OrbitSolution) -> list[Field]:
    drifts = []
    for name, drift in orbit.drift.items():
        if name not in orbit.invariants:
            cells = {f"orbit.drift.{name}": ()}
            symbol = rf"\text{{drift of }}{latex_name(name)}"
            drifts.append(Field("", drift, f"drift of {name}", symbol, "", cells, diagnostic=True))
    further = [orbit.drift[name] for name in orbit.invariants]
    end = []
    if orbit.end is not None:
        time, reason = orbit.end
        end = [_row("orbit.end.t", time), _row("orbit.end.reason", reason, words=reason)]
    return [
        _row("orbit.method", orbit.method, words=orbit.method),
        _row("orbit.steps", orbit.steps),
        trusted("hamilton", "orbit.trusted_digits", orbit.trusted_digits),
        Field("orbit.drift", orbit.drift),
        *end,
        *drifts,
        *([Field("", max(further), "largest drift of the others", diagnostic=True)] if further else []),
    ]


def _libration(found: Libration | None, derivation: Derivation) -> list[Field]:
    """The period, action and turning points; null where the coordinate does not move to and fro."""
    rows = [
        _row("orbit.period", found and found.period),
        _row("orbit.action", found and found.action),
        _row("orbit.turning_points", found and np.array(found.turning_points)),
    ]
    if derivation.cyclic:  # the orbit itself need not close
        (name,) = {*derivation.phase.coordinates} - {*derivation.cyclic}
        rows = [replace(row, title=f"{row.title.removesuffix(' of the orbit')} of {name}") for row in rows]
    return list(map(if_known, rows))


def _branch_table(findings: Findings) -> list[Table]:
    branches, names = findings.branches, findings.derivation.velocity_names
    if len(branches) < 2:
        return []
    values = {name: [branch.velocities[place] for branch in branches] for place, name in enumerate(names)}
    columns = [Column(name, column, (name,)) for name, column in values.items()]
    columns.append(Column("hamiltonian", [branch.hamiltonian for branch in branches], ("H",)))
    columns.append(Column("range", [branch.validity for branch in branches], ("where",)))
    return [Table("branches", "several velocities have the same momenta", tuple(columns), records=True)]


def orbit_table(findings: Findings) -> list[Table]:
    """Make a table of the samples of the orbit."""
    orbit, phase = findings.orbit, findings.derivation.phase
    if orbit is None:
        return []
    error, size = noise(orbit.trusted_digits), np.abs(orbit.energy).max()
    constant = "H" in findings.derivation.conserved
    keys = [*(f"q.{name}" for name in phase.coordinates), *(f"p.{name}" for name in phase.momenta)]
    variables = zip(keys, (*orbit.coordinates.T, *orbit.momenta.T), strict=True)
    columns = (
        Column(TIME, orbit.times, (TIME,), "s", (TIME,)),
        *(_sampled(orbit, key, x, error) for key, x in variables),
        # What changes in a constant is rounding.
        Column("H", orbit.energy, ("H",), noise=np.ptp(orbit.energy) / size if constant and size else NOISE),
        *(_sampled(orbit, key, x, error) for key, x in orbit.further.items()),
    )
    return [Table("orbit", "the orbit", columns, data=True)]


def _sampled(orbit: OrbitSolution, key: str, samples: Floats, error: float) -> Column:
    """A column of samples with their noise.

    The error is a share of the largest value on the way: a section may hold small ones only.
    """
    name, largest = key.partition(".")[2], float(np.abs(samples).max())
    share = max(1.0, orbit.scales.get(key, 0.0) / largest) if largest else 1.0
    return Column(key, samples, (name,), symbols=(latex_name(name),), noise=error * share)


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
        notes += [*([] if orbit.note is None else [orbit.note]), *orbit.remarks]
    if findings.libration is not None and findings.libration.error > 1e-9:
        digits = int(-math.log10(findings.libration.error))
        notes.append(f"near the separatrix the period and the action have {digits} digits")
    if orbit is not None and orbit.lost is not None:
        may_be_chaotic = len(derivation.phase.coordinates) > 1 or derivation.explicit_time
        notes.append(unshared("orbit", orbit.lost, may_be_chaotic))
    transform = findings.transform
    generated = None if transform is None else transform.generated
    if generated is not None and generated.old is None and generated.new is None:
        notes.append(
            "the relations of the generating function are not solved for the old variables or the new ones: "
            "the change stays implicit, and so does K = H + dF/dt"
        )
    elif transform is not None and not transform.wrong and transform.hamiltonian is None:
        notes.append(
            "H in the new variables is not found: H has not one form, or the old variables do not follow "
            "from the new ones by equations that are solved one by one"
        )
    if transform is not None and transform.conditions:
        notes.append(f"H in the new variables is written for {' and '.join(transform.conditions)}")
    return notes
