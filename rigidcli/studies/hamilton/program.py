"""The equations of motion as a program that runs by itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rigidcli.algebra.trees import to_tree
from rigidcli.core.solution import columns
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.language.code import shared
from rigidcli.mechanics.phase_space import TIME
from rigidcli.report import Program, Run
from rigidcli.studies.hamilton.equations_of_motion import (
    EquationsOfMotion,
    Samples,
    equations_of_motion,
    symbolic_equations,
)
from rigidcli.studies.hamilton.system import known_values, require_formulas

if TYPE_CHECKING:
    from rigidcli.studies.hamilton import Findings

# A remark in programs of systems with constraints, whose steps do not end with a way back to them.
DRIFTS = "the constraints are differentiated: by the errors of its steps, the orbit drifts away from them"
# The least size of a variable that its errors are measured by, in units of the terms of its rate.
# A variable that stays zero only as large numbers cancel is noise, about 1e-16 of these: no program can
# follow it with errors of 1e-12 of its own size.
LEAST_SIZE = 1e-3
# The relative step of a finite difference that shows the size of the terms of a rate.
NUDGE = 1e-6


def program_of(findings: Findings, name: str) -> Program:
    """The program of a system with this `name`: its rates, H, and momenta where velocities are followed.

    Raises DocumentError where a function has no formula, and ComputationError where H has steps, which its
    equations do not tell, or a number is too large for floats.
    """
    document, derivation, initial = findings.document, findings.derivation, findings.initial
    require_formulas(document, [derivation.generator, *derivation.system.forces], "a program")
    for place in derivation.jumps:
        raise ComputationError(f"H has a step where {place} = 0, which its equations do not tell")
    equations, phase, system = symbolic_equations(derivation), derivation.phase, derivation.system
    asked = {name: [to_tree(e)] for name, e in equations.momenta.items() if name not in equations.names}
    asked["H"] = [to_tree(equations.energy)]
    asked |= {one.name: [to_tree(one.multiplier)] for one in system.constraints}
    try:
        rates = shared(equations.steps, equations.slopes)
        quantities = {name: shared(equations.steps, trees) for name, trees in asked.items()}
    except ExpressionError as error:
        raise ComputationError(f"there is no program: {error.message}") from error
    used = frozenset[str]().union(rates.names, *(each.names for each in quantities.values()))
    known, declared = known_values(document), [name for name in document.definitions if name in used]
    constants = {name: float(known[name]) if name in known else None for name in declared}
    about = [name, f"L = {system.lagrangian}" if system.hamiltonian is None else f"H = {system.hamiltonian}"]
    about += [f"{one.name}: {one.expression} = 0" for one in system.constraints]
    about += [DRIFTS] if system.constraints else []
    forces = zip(phase.coordinates, system.forces, strict=True)
    about += [f"the force on {q} is {force}" for q, force in forces if not force.is_zero]
    observables = ", ".join(one.name for one in findings.observed.observables) if findings.observed else ""
    about += [f"without the observables of the document: {observables}"] if observables else []
    run = None
    if initial is not None and findings.orbit is not None:
        motion = equations_of_motion(derivation, tuple(initial.parameters.items()))
        samples, steps = findings.orbit.samples, findings.orbit.steps
        run = Run(equations.start(initial).tolist(), _sizes(samples, steps, motion), samples.times)
    shown = (TIME, *phase.names, *list(asked)[-1 - len(system.constraints) :])
    return Program(about, constants, TIME, equations.names, rates, quantities, shown, run)


def _sizes(samples: Samples, steps: int, motion: EquationsOfMotion) -> list[float]:
    """The sizes of the variables of an orbit in so many steps, in three digits; none is zero."""
    rates, times, states = columns(motion.flow), samples.times, samples.states
    # Each variable is changed differently, so that equal ones do not cancel.
    nudged = states * (1 + NUDGE * np.linspace(1.0, 2.0, states.shape[1]))
    changes = np.abs(rates(times, *nudged.T) - rates(times, *states.T)).max(axis=1) / NUDGE
    between = times[-1] / min(len(times), steps or 1)
    sizes = np.fmax(np.abs(states).max(axis=0), LEAST_SIZE * changes * between)
    return [float(f"{size:.3g}") or 1.0 for size in sizes[: len(motion.symbols.names)]]
