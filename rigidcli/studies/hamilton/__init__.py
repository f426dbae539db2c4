"""`hamilton`: from a Lagrangian to momenta, the Hamiltonian, Hamilton's equations and what they conserve."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.trees import to_tree
from rigidcli.core.estimate import unshared
from rigidcli.document.document import Document
from rigidcli.language.text import latex_name, reading
from rigidcli.mechanics.hamilton_equations import TIME
from rigidcli.picture import Picture
from rigidcli.report import NOISE, Column, Field, Report, Step, Table
from rigidcli.studies.common import if_known, noise, report, trusted
from rigidcli.studies.hamilton import linear_equations
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.findings import Found, as_typed, find
from rigidcli.studies.pictures import drawn
from rigidcli.studies.results import told

SCHEMA = "rigidcli.hamilton/1"

TRUTH = {True: "yes", False: "no", None: "not known"}

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
) -> Report:
    """Derive the equations of the document's system, and follow its orbit; `progress` gets the share done."""
    if document.ensemble is not None:
        from rigidcli.studies.ensembles import require_one_start, whole

        require_one_start(document, {"picture": picture, "program": program})
        return whole(document, run)
    found = find(document, progress)
    derivation, system = found.derivation, found.derivation.system
    phase = derivation.phase
    definitions = None if derivation.momenta is None else derivation.momenta.definitions
    natural = f"{TRUTH[system.natural]}: {system.reason}"
    cyclic, conserved = derivation.cyclic, derivation.conserved
    equilibrium, modes = [Field("equilibrium", None), Field("modes", None)], list[Table]()
    if found.oscillations is not None:
        from rigidcli.studies.hamilton import oscillations

        equilibrium = oscillations.fields(found.oscillations)
        modes = oscillations.tables(found.oscillations)
    fields = [
        Field("coordinates", list(phase.coordinates)),
        Field("velocities", list(derivation.velocity_names)),
        Field("momenta", list(phase.momenta)),
        _expression("lagrangian", system.lagrangian),
        *_expressions("momentum_definitions", phase.momenta, definitions, phase.momenta),
        *_expressions("velocity_solutions", derivation.velocity_names, derivation.velocities),
        _expression("hamiltonian", derivation.hamiltonian),
        *_rates("equations", phase.names, derivation.equations),
        *(
            # The modes of small oscillations have the same frequencies.
            replace(entry, diagnostic=entry.diagnostic or found.oscillations is not None)
            for entry in linear_equations.fields(document, derivation)
        ),
        told("hamilton", "cyclic", list(cyclic), words=", ".join(cyclic) or "none"),
        told("hamilton", "conserved", conserved, words=", ".join(conserved) or "nothing found"),
        told("hamilton", "explicit_time", derivation.explicit_time),
        _energy_rate(derivation),
        # Where it cannot be decided, the row only repeats that L alone does not tell T from V.
        told("hamilton", "natural", system.natural, words=natural, diagnostic=system.natural is None),
        Field("natural_reason", system.reason),
        *_lagrange(derivation),
        *equilibrium,
        _expression("energy", derivation.energy),
        _is_energy(derivation),
        if_known(told("hamilton", "verified", derivation.residual)),
        *_invariants(found),
        *([] if _branch_table(found) else [Field("branches", [])]),
        *_transform(found),
        *_orbit_quality(found),
    ]
    tables = [*_branch_table(found), *modes, *_orbit_table(found)]
    fields = as_typed(fields, document)
    working: list[Step] = []
    if steps:
        from rigidcli.studies.hamilton.steps import hamilton_steps

        written = hamilton_steps(found, fields, tables)
        working += [replace(step, fields=tuple(as_typed(step.fields, document))) for step in written]
    pictures: tuple[Picture, ...] = ()
    if picture is not None:
        pictures = drawn("hamilton", picture, replace(found, fields=fields))
    title = "Hamilton's equations"
    result = report(document, SCHEMA, title, fields, _notes(found), tables, working, pictures)
    if scene and found.orbit is not None:
        from rigidcli.studies.hamilton.scene import scene_of

        result = replace(result, scene=scene_of(document, found.orbit, tables[-1]))
    if not program:
        return result
    from rigidcli.studies.hamilton.program import program_of

    return replace(result, program=program_of(document, result.name, derivation, found.initial, found.orbit))


def _expression(key: str, e: Expr | None) -> Field:
    """An expression; people are not shown one that is not known, or fills more than a screen."""
    entry = if_known(told("hamilton", key, e, cells={key: ()}))
    return replace(entry, title="") if e is not None and _is_long(e) else entry


def _is_long(e: Expr) -> bool:
    return len(e.key) > LONGEST_SHOWN and len(str(e)) > LONGEST_SHOWN


def _expressions(
    key: str, names: Sequence[str], values: Sequence[Expr] | None, titles: Sequence[str] = ()
) -> list[Field]:
    """An object of expressions, which people are shown under their titles, if they have some."""
    if values is None:
        return [Field(key, None)]
    return [
        Field(
            f"{key}.{name}", e, "" if _is_long(e) else title, latex_name(title), cells={f"{key}.{name}": ()}
        )
        for name, e, title in zip(names, values, titles or [""] * len(names), strict=True)
    ]


def _rates(key: str, names: Sequence[str], values: Sequence[Expr] | None) -> list[Field]:
    """The derivatives by the time, under titles such as xdot, and dp_x/dt where a name has an index."""
    shown = _expressions(key, names, values, [f"{name}dot" for name in names])
    pairs = zip(shown, names, strict=False)
    return [replace(e, title=f"d{name}/dt") if e.title and "_" in name else e for e, name in pairs]


def _lagrange(derivation: Derivation) -> list[Field]:
    """Lagrange's equations as expressions that vanish, and solved for the accelerations."""
    found = derivation.lagrange
    if found is None:
        return [Field("lagrange_equations", None), Field("accelerations", None)]
    titles = [f"Lagrange, {q}: 0 =" for q in derivation.phase.coordinates]
    written = _expressions("lagrange_equations", derivation.phase.coordinates, found.equations, titles)
    written = [replace(entry, symbol="0") for entry in written]
    return [*written, *_expressions("accelerations", found.names, found.accelerations, found.names)]


def _energy_rate(derivation: Derivation) -> Field:
    """dH/dt, which people are not shown where it is zero: H is then among what is conserved."""
    rate = derivation.energy_rate
    return replace(_expression("dH_dt", rate), diagnostic=rate is not None and rate.is_zero)


def _is_energy(derivation: Derivation) -> Field:
    """Whether H is T + V, and else by how much it is not."""
    excess = derivation.energy_excess
    same = None if excess is None else excess.is_zero
    differ = f": T + V - H = {reading(to_tree(excess))}" if excess is not None and not same else ""
    found = told("hamilton", "h_equals_energy", same, words=f"{TRUTH[same]}{differ}")
    return replace(found, title="") if same is None else found


def _invariants(found: Found) -> list[Field]:
    """The conserved quantities that were found by searching."""
    invariants = None if found.invariants is None else list(found.invariants)
    titles = [{}, *len(invariants or ()) * [{"title": " "}]]
    shown = [
        told("hamilton", "invariants", e, key="", **title)
        for e, title in zip(invariants or (), titles, strict=False)
    ]
    return [Field("invariants", invariants), *shown]


def _transform(found: Found) -> list[Field]:
    """Whether a change of variables is canonical, and H and its equations in the new ones."""
    transform = found.transform
    if transform is None:
        return []
    wrong = ", ".join(transform.wrong)
    where = ", ".join(transform.conditions)
    words = f"yes, where {where}" if where else "yes"
    if wrong:
        only = ", ".join(f"{reading(to_tree(e))} = 1" for e in transform.open_brackets)
        words = f"no: only where {only}" if only else f"no: of {wrong} the bracket is wrong"
    brackets = transform.brackets.items()
    return [
        told("hamilton", "transform.canonical", not wrong, words=words),
        told("hamilton", "transform.conditions", list(transform.conditions)),
        *(Field(f"transform.brackets.{name}", e, name, rf"\{name[:-1]}\}}") for name, e in brackets),
        if_known(told("hamilton", "transform.hamiltonian", transform.hamiltonian)),
        *_rates("transform.equations", transform.names, transform.equations),
    ]


def _orbit_quality(found: Found) -> list[Field]:
    """How well the orbit was followed."""
    orbit = found.orbit
    if orbit is None:
        return []
    further = [orbit.drift[name] for name in orbit.invariants]
    return [
        told("hamilton", "orbit.method", orbit.method, words=orbit.method),
        told("hamilton", "orbit.steps", orbit.steps),
        trusted("hamilton", "orbit.trusted_digits", orbit.trusted_digits),
        Field("orbit.drift", orbit.drift),
        *(
            Field(
                "",
                drift,
                f"drift of {name}",
                rf"\text{{drift of }}{latex_name(name)}",
                cells={f"orbit.drift.{name}": ()},
                diagnostic=True,
            )
            for name, drift in orbit.drift.items()
            if name not in orbit.invariants
        ),
        *([Field("", max(further), "largest drift of the others", diagnostic=True)] if further else []),
    ]


def _branch_table(found: Found) -> list[Table]:
    """The ways back from the momenta, where there are several."""
    branches, names = found.branches, found.derivation.velocity_names
    if len(branches) < 2:
        return []
    columns = [
        Column(name, [branch.velocities[place] for branch in branches], (name,))
        for place, name in enumerate(names)
    ]
    columns.append(Column("hamiltonian", [branch.hamiltonian for branch in branches], ("H",)))
    columns.append(Column("range", [branch.validity for branch in branches], ("where",)))
    return [Table("branches", "several velocities have the same momenta", tuple(columns), records=True)]


def _orbit_table(found: Found) -> list[Table]:
    """The samples of the orbit."""
    orbit, phase = found.orbit, found.derivation.phase
    if orbit is None:
        return []
    error = noise(orbit.trusted_digits)
    constant = "H" in found.derivation.conserved
    size = np.abs(orbit.energy).max()
    columns = (
        Column(TIME, orbit.times, (TIME,), "s", (TIME,)),
        *(
            Column(way + name, values, (name,), symbols=(latex_name(name),), noise=error)
            for way, names, samples in (
                ("q.", phase.coordinates, orbit.coordinates),
                ("p.", phase.momenta, orbit.momenta),
            )
            for name, values in zip(names, samples.T, strict=True)
        ),
        # What changes in a constant is rounding.
        Column("H", orbit.energy, ("H",), noise=np.ptp(orbit.energy) / size if constant and size else NOISE),
    )
    return [Table("orbit", "the orbit", columns, data=True)]


def _notes(found: Found) -> list[str]:
    """Remarks on the results."""
    derivation = found.derivation
    notes = [*derivation.notes, *(found.oscillations.notes if found.oscillations else ())]
    notes += [
        f"H has a step where {place} = 0, which its equations do not tell" for place in derivation.jumps
    ]
    known = {"the Hamiltonian": derivation.hamiltonian} | {
        f"{name}dot": e for name, e in zip(derivation.phase.names, derivation.equations or (), strict=False)
    }
    long = [f"{name} ({len(str(e)):,} characters)" for name, e in known.items() if e and _is_long(e)]
    if long:
        notes.append(f"too long for people to read: {', '.join(long)}; `-f json` prints all of it")
    if found.orbit is not None and found.document.exact_results:
        notes.append("the orbit is followed in floating-point numbers")
    if found.orbit is not None and found.orbit.note is not None:
        notes.append(found.orbit.note)
    if found.orbit is not None and found.orbit.lost is not None:
        may_be_chaotic = len(derivation.phase.coordinates) > 1 or derivation.explicit_time
        notes.append(unshared("orbit", found.orbit.lost, may_be_chaotic))
    transform = found.transform
    if transform is not None and not transform.wrong and transform.hamiltonian is None:
        notes.append(
            "H in the new variables is not found: H has not one form, or the old variables do not follow "
            "from the new ones by equations that are solved one by one"
        )
    if transform is not None and transform.conditions:
        notes.append(f"H in the new variables is written for {' and '.join(transform.conditions)}")
    return notes
