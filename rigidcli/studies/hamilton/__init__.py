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
from rigidcli.core.estimate import unshared
from rigidcli.document.document import Document
from rigidcli.document.variables import acceleration
from rigidcli.language.text import latex_name, reading
from rigidcli.mechanics.hamilton_equations import TIME
from rigidcli.report import NOISE, Column, Field, Report, Step, Table, yes_or_no
from rigidcli.studies.common import if_known, noise, report, trusted
from rigidcli.studies.hamilton import linear_equations
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.findings import Findings, as_typed, find
from rigidcli.studies.pictures import drawn
from rigidcli.studies.results import field_of

if TYPE_CHECKING:
    from rigidcli.core.libration import Libration
    from rigidcli.mechanics.generating import Generated
    from rigidcli.picture import Picture
    from rigidcli.studies.hamilton.orbit import OrbitSolution
    from rigidcli.studies.hamilton.transform import TransformedSystem

SCHEMA = "rigidcli.hamilton/1"


LONGEST_SHOWN = 2_000
"""The longest text of an expression, in characters, that people are shown: a screen full."""


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
    limits = _constraints(findings)[1]
    tables = [
        *_branch_table(findings),
        *limits,
        *_modes(findings)[1],
        *orbit_table(findings),
    ]
    fields = as_typed(_results(findings), document)
    working: list[Step] = []
    if steps:
        from rigidcli.studies.hamilton.steps import hamilton_steps

        written = hamilton_steps(findings, fields, tables)
        working += [replace(step, fields=tuple(as_typed(step.fields, document))) for step in written]
    pictures: tuple[Picture, ...] = ()
    if picture is not None:
        pictures = drawn("hamilton", picture, findings)
    title = "Hamilton's equations"
    result = report(document, SCHEMA, title, fields, notes_on(findings), tables, working, pictures)
    if scene and findings.orbit is not None and not findings.orbit.is_section:
        from rigidcli.studies.hamilton.scene import scene_of

        result = replace(result, scene=scene_of(document, findings.orbit, tables[-1]))
    if program:
        from rigidcli.studies.hamilton.orbit import program_of

        equations = program_of(document, result.name, findings.derivation, findings.initial, findings.orbit)
        result = replace(result, program=equations)
    return result


def _results(findings: Findings) -> list[Field]:
    """List the results in the order in which people see them."""
    derivation, system, phase = findings.derivation, findings.derivation.system, findings.derivation.phase
    momenta, lagrange, rate = derivation.momenta, derivation.lagrange, derivation.energy_rate
    cyclic, conserved, invariants = list(derivation.cyclic), derivation.conserved, findings.invariants
    natural = f"{yes_or_no(system.natural, 'not known')}: {system.reason}"
    is_energy = derivation.energy_excess is not None and derivation.energy_excess.is_zero
    words = ", ".join("H = T + V" if name == "H" and is_energy else name for name in conserved)
    definitions, velocities = None if momenta is None else momenta.definitions, derivation.velocity_names
    vanishing, solved = (None, None) if lagrange is None else (lagrange.equations, derivation.accelerations)
    is_diagonal = _is_diagonal(definitions or (), velocities)
    inverse = phase.coordinates if is_diagonal else ()
    second = [*map(acceleration, phase.coordinates)]
    # That L alone does not tell T from V, or that H is T + V, stands in other rows.
    repeats = system.natural is None or (system.natural and is_energy)
    # People are shown the shorter form of the equations of motion, or accelerations that are constant.
    moving = (*phase.coordinates, *velocities, TIME)
    is_solved = solved is not None and all(e.names.isdisjoint(moving) for e in solved)
    is_solved |= bool(vanishing and solved and _length(solved) <= _length(vanishing))
    return [
        Field("coordinates", list(phase.coordinates)),
        Field("velocities", list(velocities)),
        Field("momenta", list(phase.momenta)),
        _expression("lagrangian", system.lagrangian),
        *_by_name("momentum_definitions", phase.momenta, definitions, _own),
        *_by_name("velocity_solutions", velocities, derivation.velocities),
        _expression("hamiltonian", derivation.hamiltonian),
        Field("conditions", [f"{e} > 0" for e in derivation.conditions]),
        Field("mass_matrix", None if momenta is None else [list(row) for row in momenta.mass_matrix]),
        *_by_name("equations", phase.names, derivation.equations, _rate, hidden=inverse),
        *(
            # The modes of small oscillations have the same frequencies.
            replace(entry, diagnostic=entry.diagnostic or findings.oscillations is not None)
            for entry in linear_equations.fields(findings.document, derivation)
        ),
        _row("cyclic", cyclic, words=", ".join(cyclic) or "none", diagnostic=not cyclic),
        _row("conserved", conserved, words=words or "nothing found"),
        _row("explicit_time", derivation.explicit_time),
        # Where H does not change, it is among what is conserved.
        replace(_expression("dH_dt", rate), diagnostic=rate is not None and rate.is_zero),
        _row("natural", system.natural, words=natural, diagnostic=repeats),
        Field("natural_reason", system.reason),
        *_by_name(
            "lagrange_equations",
            phase.coordinates,
            vanishing,
            _lagrange,
            hidden=phase.coordinates if is_solved else (),
        ),
        *_by_name("accelerations", second, solved, _own, hidden=() if is_solved else second),
        *_constraints(findings)[0],
        *_observed(findings),
        *_modes(findings)[0],
        _expression("energy", derivation.energy),
        replace(_is_energy(derivation), diagnostic=is_energy and "H" in conserved),
        if_known(_row("verified", derivation.residual)),
        Field("invariants", None if invariants is None else list(invariants)),
        *_invariants(findings),
        *([] if len(findings.branches) > 1 else [Field("branches", [])]),
        *([] if findings.transform is None else _transform(findings.transform)),
        *([] if findings.orbit is None else _orbit_quality(findings.orbit)),
        *([] if findings.libration is None else _libration(findings.libration)),
    ]


_row = partial(field_of, "hamilton")


def _expression(key: str, e: Expr | None) -> Field:
    """An expression; people are not shown one without a value, or one that fills more than a screen."""
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
    """An object of expressions, which people are shown if they have a title and do not fill a screen.

    Of `hidden` names only a verbose look shows them.
    """
    if values is None:
        return [Field(key, None)]
    fields = []
    for name, e in zip(names, values, strict=True):
        title, sign = titled(name)
        path, title = f"{key}.{name}", "" if _is_long(e) else title
        fields.append(Field(path, e, title, sign, cells={path: ()}, diagnostic=name in hidden))
    return fields


def _is_diagonal(definitions: Sequence[Expr], velocities: Sequence[str]) -> bool:
    """Whether each momentum is its own velocity times a factor, so that anybody sees the way back."""
    pairs = zip(definitions, velocities, strict=False)
    return all((e / symbol(v)).names.isdisjoint(velocities) for e, v in pairs) and len(definitions) > 0


def _length(expressions: Sequence[Expr]) -> int:
    return sum(len(str(e)) for e in expressions)


def _own(name: str) -> tuple[str, str]:
    """A variable itself has its name as the title, and the symbol of the name."""
    return name, latex_name(name)


def _rate(name: str) -> tuple[str, str]:
    """The derivative of a variable by the time has this title and symbol."""
    return f"d{name}/dt" if "_" in name else f"{name}dot", latex_name(f"{name}dot")


def _lagrange(name: str) -> tuple[str, str]:
    """One of Lagrange's equations has this title and, as its left side, this symbol."""
    return f"Lagrange, {name}: 0 =", "0"


def _modes(findings: Findings) -> tuple[list[Field], list[Table]]:
    """Report the equilibrium and the modes about it, and make a table of the modes."""
    if findings.oscillations is None:
        return [Field("equilibrium", None), Field("modes", None)], []
    from rigidcli.studies.hamilton import oscillations

    return oscillations.fields(findings.oscillations), oscillations.tables(findings.oscillations)


def _invariants(findings: Findings) -> list[Field]:
    """Show further conserved quantities by their names; others share one title, at the first of them."""
    if not findings.invariants:
        return []
    from rigidcli.studies.hamilton.named import names_of

    names = names_of(findings.invariants, findings.derivation)
    fields, title = [Field("invariant_names", names)], _row("invariants", None).title
    for name, e in zip(names, findings.invariants, strict=True):
        words = f"{name}, conserved" if name else title
        fields.append(_row("invariants", e, key="", title=words))
        title = title if name else " "
    return fields


def _constraints(findings: Findings) -> tuple[list[Field], list[Table]]:
    """Report the forces of constraints, and make a table of the constraints."""
    if not findings.derivation.system.constraints:
        return [], []
    from rigidcli.studies.hamilton import multipliers

    return multipliers.fields(findings.derivation), multipliers.tables(findings.derivation, findings.document)


def _observed(findings: Findings) -> list[Field]:
    """Report the observables and brackets."""
    if findings.observed is None:
        return []
    from rigidcli.studies.hamilton import observables

    return observables.fields(findings.observed, findings.orbit)


def _is_energy(derivation: Derivation) -> Field:
    """Say whether H is T + V, or else by how much they differ."""
    excess = derivation.energy_excess
    same = None if excess is None else excess.is_zero
    differ = f": T + V - H = {reading(to_tree(excess))}" if excess is not None and not same else ""
    entry = _row("h_equals_energy", same, words=f"{yes_or_no(same, 'not known')}{differ}")
    return replace(entry, title="") if same is None else entry


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
    """Show the relations that follow from a generating function, and one side for which they are solved."""
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
    """Say how well the orbit was followed."""
    drifts = []
    for name, drift in orbit.drift.items():
        if name not in orbit.invariants:
            cells = {f"orbit.drift.{name}": ()}
            symbol = rf"\text{{drift of }}{latex_name(name)}"
            drifts.append(Field("", drift, f"drift of {name}", symbol, "", cells, diagnostic=True))
    further = [orbit.drift[name] for name in orbit.invariants]
    return [
        _row("orbit.method", orbit.method, words=orbit.method),
        _row("orbit.steps", orbit.steps),
        trusted("hamilton", "orbit.trusted_digits", orbit.trusted_digits),
        Field("orbit.drift", orbit.drift),
        *_end(orbit),
        *drifts,
        *([Field("", max(further), "largest drift of the others", diagnostic=True)] if further else []),
    ]


def _end(orbit: OrbitSolution) -> list[Field]:
    """Say when an orbit with `until` ends, and why."""
    if orbit.end is None:
        return []
    time, reason = orbit.end
    return [_row("orbit.end.t", time), _row("orbit.end.reason", reason, words=reason)]


def _libration(found: Libration) -> list[Field]:
    """Report the period, the action and the turning points of a motion to and fro."""
    return [
        _row("orbit.period", found.period),
        _row("orbit.action", found.action),
        _row("orbit.turning_points", np.array(found.turning_points)),
    ]


def _branch_table(findings: Findings) -> list[Table]:
    """Make a table of the velocities that belong to the same momenta, where there are several."""
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
    samples = [
        (key, name, x, error * _share(orbit, key, x))
        for key, name, x in zip(keys, phase.names, (*orbit.coordinates.T, *orbit.momenta.T), strict=True)
    ]
    columns = (
        Column(TIME, orbit.times, (TIME,), "s", (TIME,)),
        *(Column(key, x, (name,), symbols=(latex_name(name),), noise=off) for key, name, x, off in samples),
        # What changes in a constant is rounding.
        Column("H", orbit.energy, ("H",), noise=np.ptp(orbit.energy) / size if constant and size else NOISE),
        *(
            Column(key, x, (name,), symbols=(latex_name(name),), noise=error * orbit.scales[key] / largest)
            for key, x in orbit.further.items()
            if (largest := np.abs(x).max() or 1.0)
            for name in (key.partition(".")[2],)
        ),
    )
    return [Table("orbit", "the orbit", columns, data=True)]


def _share(orbit: OrbitSolution, key: str, samples: Floats) -> float:
    """The largest value on the way in units of the largest sample: a section may hold small ones only."""
    largest = float(np.abs(samples).max())
    return max(1.0, orbit.scales.get(key, 0.0) / largest) if largest else 1.0


def notes_on(findings: Findings) -> list[str]:
    """Write remarks on the results."""
    derivation = findings.derivation
    notes = [*derivation.notes, *(findings.oscillations.notes if findings.oscillations else ())]
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
    if findings.orbit is not None and findings.document.exact_results:
        notes.append("the orbit is followed in floating-point numbers")
    if findings.orbit is not None and findings.orbit.note is not None:
        notes.append(findings.orbit.note)
    notes += findings.orbit.remarks if findings.orbit is not None else ()
    if findings.libration is not None and findings.libration.error > 1e-9:
        digits = int(-math.log10(findings.libration.error))
        notes.append(f"near the separatrix the period and the action have {digits} digits")
    if findings.orbit is not None and findings.orbit.lost is not None:
        may_be_chaotic = len(derivation.phase.coordinates) > 1 or derivation.explicit_time
        notes.append(unshared("orbit", findings.orbit.lost, may_be_chaotic))
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
