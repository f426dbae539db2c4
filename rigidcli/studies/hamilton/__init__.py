"""`hamilton`: from a Lagrangian to momenta, the Hamiltonian, Hamilton's equations and what they conserve."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.errors import ExpressionError
from rigidcli.model.document import Document
from rigidcli.report import Column, Field, Report, Table, Value
from rigidcli.studies.common import report, require_values
from rigidcli.studies.hamilton.derivation import TIME, Derivation, derive
from rigidcli.symbolic.algebra.calculus import derivative
from rigidcli.symbolic.algebra.expressions import Expr, symbol
from rigidcli.symbolic.algebra.simplification import tidy
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language.latex_names import latex_name
from rigidcli.symbolic.language.text import reading, text
from rigidcli.symbolic.mechanics.hamilton_equations import linear

if TYPE_CHECKING:
    from rigidcli.studies.hamilton.orbit import Path
    from rigidcli.studies.hamilton.transform import Change
    from rigidcli.symbolic.mechanics.spectrum import Spectrum

SCHEMA = "rigidcli.hamilton/1"

TRUTH = {True: "yes", False: "no", None: "not known"}

QUICK = 160
"""Length of the key of an H whose conserved quantities are searched for unasked: that takes little time."""

MOST_COLUMNS = 8
"""Of a matrix that people are shown."""

STABILITY = {
    "stable": "stable: motion stays bounded",
    "marginal": "marginal: motion grows by powers of the time",
    "unstable": "unstable: motion grows exponentially",
}


def run(
    document: Document, *, invariants: bool = False, progress: Callable[[float], None] | None = None
) -> Report:
    """Derive what the system of the document has, and follow its orbit; `progress` is told how far.

    Further conserved quantities are searched for where that is quick, or `invariants` are asked for.
    """
    found = derive(document)
    notes = list(found.notes)
    tables = [_branches(found)] if len(found.branches) > 1 else []
    fields: list[Field] = []
    if document.orbit is not None:
        from rigidcli.studies.hamilton.initial import begin
        from rigidcli.studies.hamilton.orbit import follow

        require_values(document, "an orbit")
        found, start = begin(document, document.orbit, found)
        if document.exact_results:
            notes.append("the orbit is followed in floating-point numbers")
    kept = _invariants(found, invariants)
    if document.orbit is not None:
        path = follow(document.orbit, found, start, kept or (), progress)
        fields += _quality(path)
        if path.lost is not None:
            notes.append(
                f"chaotic, or too long: errors grow so fast that by t = {path.lost:.4g} little is left of a "
                "somewhat coarser orbit, and beyond this one is only typical"
            )
        tables.append(_orbit(path, found))
    if document.transform is not None:
        from rigidcli.studies.hamilton.transform import changed

        change = changed(document, document.transform, found)
        fields = _change(change) + fields
        if not change.wrong and change.hamiltonian is None:
            notes.append(
                "H in the new variables is told where H has one form, the change does not hold the time, and "
                "the old variables are given, or follow from linear equations"
            )
    fields = [
        Field("coordinates", list(found.phase.coordinates)),
        Field("velocities", list(found.velocity_names)),
        Field("momenta", list(found.phase.momenta)),
        _written("lagrangian", found.given.lagrangian, "Lagrangian", "L"),
        *_momentum_definitions(found),
        *_each("velocity_solutions", found.velocity_names, found.velocities),
        _written("hamiltonian", found.hamiltonian, "Hamiltonian", "H"),
        *_equations(found),
        *_linear(found, document),
        *_verdicts(found),
        *_further(kept),
        *([] if tables and tables[0].key == "branches" else [Field("branches", [])]),
        *fields,
    ]
    return report(document, SCHEMA, "Hamilton's equations", fields, notes, tables)


def _invariants(found: Derivation, asked: bool) -> tuple[Expr, ...] | None:
    """Conserved quantities besides H and the momenta of cyclic coordinates; None if not searched for."""
    hamiltonian = found.hamiltonian
    if len(found.phase.coordinates) == 1:
        return ()
    if hamiltonian is None or not (asked or len(hamiltonian.key) <= QUICK):
        return None
    from rigidcli.symbolic.invariants.search import search

    return search(hamiltonian, found.phase, [symbol(f"p_{name}") for name in found.cyclic]).found


def _further(kept: tuple[Expr, ...] | None) -> list[Field]:
    """The conserved quantities that were found by searching."""
    trees = None if kept is None else [to_tree(e) for e in kept]
    return [
        Field("invariants", trees),
        *(Field("", tree, "conserved, too" if place == 0 else " ") for place, tree in enumerate(trees or ())),
    ]


def _written(key: str, e: Expr | None, title: str, sign: str) -> Field:
    """An expression; people are not shown one that is not known."""
    return Field(key, _tree(e), title if e is not None else "", sign, cells={key: ()})


def _tree(e: Expr | float | None) -> Value:
    return to_tree(e) if isinstance(e, Expr) else e


def _each(
    key: str, names: Sequence[str], values: Sequence[Expr] | None, title: str = "", change: str = ""
) -> list[Field]:
    """An object of expressions; people are shown them under a name each: `title` is what ends it."""
    if values is None:
        return [Field(key, None)]
    return [
        Field(
            f"{key}.{name}",
            to_tree(e),
            name + change if title or change else "",
            latex_name(name + change),
            cells={f"{key}.{name}": ()},
        )
        for name, e in zip(names, values, strict=True)
    ]


def _momentum_definitions(found: Derivation) -> list[Field]:
    definitions = None if found.momenta is None else found.momenta.definitions
    return _each("momentum_definitions", found.phase.momenta, definitions, title="shown")


def _equations(found: Derivation) -> list[Field]:
    return _each("equations", found.phase.names, found.equations, change="dot")


def _linear(found: Derivation, document: Document) -> list[Field]:
    """The matrix of linear equations, and its eigenvalues."""
    names = found.phase.names
    parts = None
    with suppress(ExpressionError):
        parts = None if found.equations is None else linear(found.equations, names)
    if parts is None:
        return [Field(key, None) for key in ("matrix", "offset", "eigenvalues", "frequencies", "stability")]
    matrix, offset = parts
    spectrum = _spectrum(matrix, document)
    z = ", ".join(names)
    shift = " + b" if any(not e.is_zero for e in offset) else ""
    readable = len(names) <= MOST_COLUMNS
    fields = [
        Field("matrix", _array(matrix), f"A of z' = A z{shift}, z = ({z})" if readable else "", "A"),
        Field("offset", _array(offset), "b" if shift and readable else "", r"\mathbf{b}"),
    ]
    if spectrum is None:
        return [*fields, *(Field(key, None) for key in ("eigenvalues", "frequencies", "stability"))]
    numeric = all(isinstance(f, float) for f in spectrum.frequencies)
    frequencies = np.array([_tree(f) for f in spectrum.frequencies], dtype=float if numeric else object)
    return [
        *fields,
        Field("eigenvalues", [{"re": _tree(re), "im": _tree(im)} for re, im in spectrum.eigenvalues]),
        Field(
            "frequencies",
            frequencies,
            "frequencies" if len(frequencies) else "",
            r"\omega",
            "rad/s" if numeric else "",
        ),
        Field("stability", spectrum.stability, "stability", words=STABILITY[spectrum.stability]),
    ]


def _array(entries: Sequence[object]) -> Value:
    """Expressions as an array of trees."""
    array = np.array(entries, dtype=object)
    return np.array([_tree(e) for e in array.flat], dtype=object).reshape(array.shape)


def _spectrum(matrix: Sequence[Sequence[Expr]], document: Document) -> Spectrum | None:
    """Of numbers where all parameters have values, else of what symbols allow."""
    from rigidcli.symbolic.language.expression import Expression
    from rigidcli.symbolic.mechanics import spectrum

    values = {name: float(value) for name, value in document.values.items()}
    used = {name for row in matrix for e in row for name in e.names}
    if used <= values.keys() and not document.exact_results:
        try:
            rows = [[Expression("", to_tree(e), e.names).evaluate(values) for e in row] for row in matrix]
        except ExpressionError:
            return None
        return spectrum.of_numbers(np.array(rows))
    return None if TIME in used else spectrum.of_symbols(matrix, values)


def _verdicts(found: Derivation) -> list[Field]:
    """What is conserved, whether H is T + V, and whether the coordinates are natural; with reasons."""
    conserved = [f"p_{name}" for name in found.cyclic] + ([] if found.explicit_time else ["H"])
    change = None if found.hamiltonian is None else tidy(derivative(found.hamiltonian, TIME))
    same = None if found.excess is None else found.excess.is_zero
    differ = "" if found.excess is None or same else f": T + V - H = {reading(to_tree(found.excess))}"
    given = found.given
    return [
        Field("cyclic", list(found.cyclic), "cyclic coordinates", words=", ".join(found.cyclic) or "none"),
        Field("conserved", conserved, "conserved", words=", ".join(conserved) or "nothing found"),
        Field("explicit_time", found.explicit_time),
        _written("dH_dt", change, "dH/dt", r"\frac{\mathrm{d}H}{\mathrm{d}t}"),
        Field(
            "natural",
            given.natural,
            "natural coordinates",
            words=f"{TRUTH[given.natural]}: {given.reason}",
        ),
        Field("natural_reason", given.reason),
        _written("energy", found.energy, "", "T + V"),
        Field("h_equals_energy", same, "H = T + V", words=f"{TRUTH[same]}{differ}"),
        Field(
            "verified",
            found.residual,
            "residual of the equations of motion" if found.residual is not None else "",
        ),
    ]


def _branches(found: Derivation) -> Table:
    """The ways back from the momenta, where there are several."""
    columns = [
        Column(name, [to_tree(b.velocities[place]) for b in found.branches], (name,), "")
        for place, name in enumerate(found.velocity_names)
    ]
    columns.append(Column("hamiltonian", [to_tree(b.hamiltonian) for b in found.branches], ("H",), ""))
    ranges = [" and ".join(f"{text(to_tree(e))} > 0" for e in b.conditions) for b in found.branches]
    columns.append(Column("range", ranges, ("where",), ""))
    return Table("branches", "several velocities have the same momenta", tuple(columns), records=True)


def _change(change: Change) -> list[Field]:
    """New variables, and what they are good for."""
    wrong = ", ".join(change.wrong)
    return [
        Field(
            "transform.canonical",
            not wrong,
            "canonical change of variables",
            words=f"no: of {wrong} the bracket is wrong" if wrong else "yes",
        ),
        *(
            Field(f"transform.brackets.{name}", to_tree(value), name, rf"\{name[:-1]}\}}")
            for name, value in change.brackets.items()
        ),
        Field(
            "transform.hamiltonian",
            _tree(change.hamiltonian),
            "new Hamiltonian" if change.hamiltonian is not None else "",
            "K",
        ),
        *_each("transform.equations", change.names, change.equations, change="dot"),
    ]


def _quality(path: Path) -> list[Field]:
    """How well the orbit was followed."""
    return [
        Field("orbit.method", path.method, "method", words=path.method),
        Field("orbit.steps", path.steps),
        Field("orbit.trusted_digits", path.trusted_digits, "digits of the orbit to trust"),
        Field("orbit.drift", path.drift),
        *(
            Field("", path.drift[name], f"drift of {name}", rf"\text{{drift of }}{latex_name(name)}")
            for name in path.plain
        ),
        *(
            [Field("", max(further), "largest drift of the others")]
            if (further := [drift for name, drift in path.drift.items() if name not in path.plain])
            else []
        ),
    ]


def _orbit(path: Path, found: Derivation) -> Table:
    """The samples."""
    phase = found.phase
    columns = [Column("t", path.times, ("t",), "s", ("t",))]
    for key, names, values in (
        ("q", phase.coordinates, path.coordinates),
        ("p", phase.momenta, path.momenta),
    ):
        columns += [
            Column(f"{key}.{name}", values[:, place], (name,), "", (latex_name(name),))
            for place, name in enumerate(names)
        ]
    columns.append(Column("H", path.energy, ("H",), "", ("H",)))
    return Table("orbit", "the orbit", tuple(columns), data=True)
