"""`hamilton`: from a Lagrangian to momenta, the Hamiltonian, Hamilton's equations and what they conserve."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.errors import ExpressionError
from rigidcli.model.document import Document
from rigidcli.report import Column, Field, Report, Table
from rigidcli.studies.common import report, require_values
from rigidcli.studies.hamilton.derivation import TIME, Derivation, derive
from rigidcli.symbolic.algebra.expressions import Expr, symbol
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language.latex_names import latex_name
from rigidcli.symbolic.language.text import reading
from rigidcli.symbolic.mechanics.hamilton_equations import linear
from rigidcli.symbolic.mechanics.velocity_inversion import Branch

if TYPE_CHECKING:
    from rigidcli.studies.hamilton.orbit import OrbitSolution
    from rigidcli.studies.hamilton.transform import TransformedSystem
    from rigidcli.symbolic.mechanics.spectrum import Spectrum

SCHEMA = "rigidcli.hamilton/1"

TRUTH = {True: "yes", False: "no", None: "not known"}

QUICK = 160
"""The longest key of an H whose conserved quantities are searched for unasked, as that takes little time."""

MOST_COLUMNS = 8
"""The widest matrix that people are shown: a terminal has room for no more."""

SPECTRUM = ("eigenvalues", "frequencies", "stability")
"""The keys of what the matrix of linear equations tells."""

STABILITY = {
    "stable": "stable: motion stays bounded",
    "marginal": "marginal: motion grows by powers of the time",
    "unstable": "unstable: motion grows exponentially",
}


@dataclass(frozen=True, slots=True)
class _Results:
    """What was found of the system of a document; None for what was not asked, or not searched for.

    The derivation is on the branch of the velocities that the orbit is on, if there is one.
    """

    document: Document
    branches: Sequence[Branch]
    derivation: Derivation
    invariants: tuple[Expr, ...] | None
    orbit: OrbitSolution | None
    transform: TransformedSystem | None


def run(
    document: Document,
    *,
    invariants: bool = False,
    progress: Callable[[float], None] | None = None,
    max_steps: int | None = None,
) -> Report:
    """Derive what the system of the document has, and follow its orbit; `progress` is told how far.

    Further conserved quantities are searched for where that is quick, or `invariants` are asked for. An orbit
    that needs more than `max_steps` is refused.
    """
    found = _results(document, invariants, progress, max_steps)
    derivation, system = found.derivation, found.derivation.system
    phase = derivation.phase
    definitions = None if derivation.momenta is None else derivation.momenta.definitions
    natural, residual = f"{TRUTH[system.natural]}: {system.reason}", derivation.residual
    cyclic, conserved = derivation.cyclic, derivation.conserved
    dots = [f"{name}dot" for name in phase.names]
    fields = [
        Field("coordinates", list(phase.coordinates)),
        Field("velocities", list(derivation.velocity_names)),
        Field("momenta", list(phase.momenta)),
        _expression("lagrangian", system.lagrangian, "Lagrangian", "L"),
        *_expressions("momentum_definitions", phase.momenta, definitions, phase.momenta),
        *_expressions("velocity_solutions", derivation.velocity_names, derivation.velocities),
        _expression("hamiltonian", derivation.hamiltonian, "Hamiltonian", "H"),
        *_expressions("equations", phase.names, derivation.equations, dots),
        *_linear_equations(found),
        Field("cyclic", list(cyclic), "cyclic coordinates", words=", ".join(cyclic) or "none"),
        Field("conserved", conserved, "conserved", words=", ".join(conserved) or "nothing found"),
        Field("explicit_time", derivation.explicit_time),
        _expression("dH_dt", derivation.energy_rate, "dH/dt", r"\frac{\mathrm{d}H}{\mathrm{d}t}"),
        Field("natural", system.natural, "natural coordinates", words=natural),
        Field("natural_reason", system.reason),
        _expression("energy", derivation.energy, "", "T + V"),
        _is_energy(derivation),
        Field("verified", residual, "" if residual is None else "residual of the equations of motion"),
        *_invariants(found),
        *([Field("branches", [])] if len(found.branches) < 2 else []),
        *_transform(found),
        *_orbit_quality(found),
    ]
    tables = [*_branch_table(found), *_orbit_table(found)]
    return report(document, SCHEMA, "Hamilton's equations", fields, _notes(found), tables)


def _results(
    document: Document,
    invariants: bool,
    progress: Callable[[float], None] | None,
    max_steps: int | None,
) -> _Results:
    """Everything that the report tells; what the document does not ask is not imported."""
    derivation = derive(document)
    branches, orbit, transform = derivation.branches, None, None
    if document.orbit is None:
        searched = _searched(derivation, invariants)
    else:
        from rigidcli.studies.hamilton.initial import initial_state
        from rigidcli.studies.hamilton.orbit import solve_orbit

        require_values(document, "an orbit")
        derivation, initial = initial_state(document, document.orbit, derivation)
        searched = _searched(derivation, invariants)
        orbit = solve_orbit(document.orbit, derivation, initial, searched or (), progress, max_steps)
    if document.transform is not None:
        from rigidcli.studies.hamilton.transform import transformed

        transform = transformed(document, document.transform, derivation)
    return _Results(document, branches, derivation, searched, orbit, transform)


def _searched(derivation: Derivation, asked: bool) -> tuple[Expr, ...] | None:
    """Conserved quantities besides H and the momenta of cyclic coordinates; None if not searched for."""
    hamiltonian = derivation.hamiltonian
    if len(derivation.phase.coordinates) == 1:
        return ()
    if hamiltonian is None or not (asked or len(hamiltonian.key) <= QUICK):
        return None
    from rigidcli.symbolic.invariants.search import conserved_quantities

    return conserved_quantities(hamiltonian, derivation.phase, [symbol(f"p_{q}") for q in derivation.cyclic])


def _expression(key: str, e: Expr | None, title: str, sign: str) -> Field:
    """An expression; people are not shown one that is not known."""
    return Field(key, e, title if e is not None else "", sign, cells={key: ()})


def _expressions(
    key: str, names: Sequence[str], values: Sequence[Expr] | None, titles: Sequence[str] = ()
) -> list[Field]:
    """An object of expressions, which people are shown under their titles, if they have some."""
    if values is None:
        return [Field(key, None)]
    return [
        Field(f"{key}.{name}", e, title, latex_name(title), cells={f"{key}.{name}": ()})
        for name, e, title in zip(names, values, titles or [""] * len(names), strict=True)
    ]


def _linear_equations(found: _Results) -> list[Field]:
    """The matrix of linear equations, and its eigenvalues."""
    equations, names = found.derivation.equations, found.derivation.phase.names
    parts = None
    with suppress(ExpressionError):
        parts = None if equations is None else linear(equations, names)
    if parts is None:
        return [Field(key, None) for key in ("matrix", "offset", *SPECTRUM)]
    matrix, offset = parts
    shift = " + b" if any(not e.is_zero for e in offset) else ""
    title = f"A of z' = A z{shift}, z = ({', '.join(names)})"
    is_small = len(names) <= MOST_COLUMNS
    fields = [
        Field("matrix", np.array(matrix, dtype=object), title if is_small else "", "A"),
        Field("offset", np.array(offset, dtype=object), "b" if shift and is_small else "", r"\mathbf{b}"),
    ]
    spectrum = _spectrum(matrix, found.document)
    if spectrum is None:
        return [*fields, *(Field(key, None) for key in SPECTRUM)]
    numeric = all(isinstance(f, float) for f in spectrum.frequencies)
    frequencies = np.array(spectrum.frequencies, dtype=float if numeric else object)
    title, unit = "frequencies" if len(frequencies) else "", "rad/s" if numeric else ""
    return [
        *fields,
        Field("eigenvalues", [{"re": re, "im": im} for re, im in spectrum.eigenvalues]),
        Field("frequencies", frequencies, title, r"\omega", unit),
        Field("stability", spectrum.stability, "stability", words=STABILITY[spectrum.stability]),
    ]


def _spectrum(matrix: Sequence[Sequence[Expr]], document: Document) -> Spectrum | None:
    """Of numbers where all parameters have values, else of what symbols allow."""
    from rigidcli.symbolic.mechanics.spectrum import numeric_spectrum, symbolic_spectrum

    values = {name: float(value) for name, value in document.values.items()}
    used = {name for row in matrix for e in row for name in e.names}
    if used <= values.keys() and not document.exact_results:
        try:
            return numeric_spectrum(np.array([[e.evaluate(**values) for e in row] for row in matrix]))
        except ExpressionError:
            return None
    return None if TIME in used else symbolic_spectrum(matrix, values)


def _is_energy(derivation: Derivation) -> Field:
    """Whether H is T + V, and else by how much it is not."""
    excess = derivation.energy_excess
    same = None if excess is None else excess.is_zero
    differ = f": T + V - H = {reading(to_tree(excess))}" if excess is not None and not same else ""
    return Field("h_equals_energy", same, "H = T + V", words=f"{TRUTH[same]}{differ}")


def _invariants(found: _Results) -> list[Field]:
    """The conserved quantities that were found by searching."""
    invariants = None if found.invariants is None else list(found.invariants)
    lines = enumerate(invariants or ())
    shown = [Field("", e, " " if place else "conserved, too") for place, e in lines]
    return [Field("invariants", invariants), *shown]


def _transform(found: _Results) -> list[Field]:
    """Whether a change of variables is canonical, and H and its equations in the new ones."""
    transform = found.transform
    if transform is None:
        return []
    wrong = ", ".join(transform.wrong)
    words = f"no: of {wrong} the bracket is wrong" if wrong else "yes"
    title = "new Hamiltonian" if transform.hamiltonian is not None else ""
    brackets, dots = transform.brackets.items(), [f"{name}dot" for name in transform.names]
    return [
        Field("transform.canonical", not wrong, "canonical change of variables", words=words),
        *(Field(f"transform.brackets.{name}", e, name, rf"\{name[:-1]}\}}") for name, e in brackets),
        Field("transform.hamiltonian", transform.hamiltonian, title, "K"),
        *_expressions("transform.equations", transform.names, transform.equations, dots),
    ]


def _orbit_quality(found: _Results) -> list[Field]:
    """How well the orbit was followed."""
    orbit = found.orbit
    if orbit is None:
        return []
    further = [orbit.drift[name] for name in orbit.invariants]
    return [
        Field("orbit.method", orbit.method, "method", words=orbit.method),
        Field("orbit.steps", orbit.steps),
        Field("orbit.trusted_digits", orbit.trusted_digits, "digits of the orbit to trust"),
        Field("orbit.drift", orbit.drift),
        *(
            Field("", drift, f"drift of {name}", rf"\text{{drift of }}{latex_name(name)}")
            for name, drift in orbit.drift.items()
            if name not in orbit.invariants
        ),
        *([Field("", max(further), "largest drift of the others")] if further else []),
    ]


def _branch_table(found: _Results) -> list[Table]:
    """The ways back from the momenta, where there are several."""
    branches = found.branches
    if len(branches) < 2:
        return []
    columns = [
        Column(name, [branch.velocities[place] for branch in branches], (name,), "")
        for place, name in enumerate(found.derivation.velocity_names)
    ]
    columns.append(Column("hamiltonian", [branch.hamiltonian for branch in branches], ("H",), ""))
    columns.append(Column("range", [branch.validity for branch in branches], ("where",), ""))
    return [Table("branches", "several velocities have the same momenta", tuple(columns), records=True)]


def _orbit_table(found: _Results) -> list[Table]:
    """The samples of the orbit."""
    orbit, phase = found.orbit, found.derivation.phase
    if orbit is None:
        return []
    quantities = [
        ("", TIME, orbit.times),
        *(("q.", *pair) for pair in zip(phase.coordinates, orbit.coordinates.T, strict=True)),
        *(("p.", *pair) for pair in zip(phase.momenta, orbit.momenta.T, strict=True)),
        ("", "H", orbit.energy),
    ]
    columns = (
        Column(way + name, values, (name,), "s" if name == TIME else "", (latex_name(name),))
        for way, name, values in quantities
    )
    return [Table("orbit", "the orbit", tuple(columns), data=True)]


def _notes(found: _Results) -> list[str]:
    """Remarks on the results."""
    notes = list(found.derivation.notes)
    if found.orbit is not None and found.document.exact_results:
        notes.append("the orbit is followed in floating-point numbers")
    if found.orbit is not None and found.orbit.lost is not None:
        notes.append(
            f"chaotic, or too long: errors grow so fast that by t = {found.orbit.lost:.4g} little is left "
            "of a somewhat coarser orbit, and beyond this one is only typical"
        )
    transform = found.transform
    if transform is not None and not transform.wrong and transform.hamiltonian is None:
        notes.append(
            "H in the new variables is told where H has one form, the change does not hold the time, and "
            "the old variables are given, or follow from linear equations"
        )
    return notes
