"""The program of a system: its equations of motion and its orbit, to be run without rigidcli."""

from __future__ import annotations

import numpy as np

from rigidcli.algebra.expressions import total
from rigidcli.algebra.trees import to_tree
from rigidcli.core.solution import Flow, columns
from rigidcli.document.document import Document
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.language import code
from rigidcli.language.code import shared
from rigidcli.mechanics.phase_space import TIME
from rigidcli.report import Program, Run
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equations_of_motion import InitialState, symbolic_equations
from rigidcli.studies.hamilton.orbit import OrbitSolution
from rigidcli.studies.hamilton.system import require_formulas

# A remark in programs of systems with constraints, whose steps do not end with a way back to them.
DRIFTS = "the constraints are differentiated: by the errors of its steps, the orbit drifts away from them"
# The least size of a variable that its errors are measured by, in units of the terms of its rate.
# A variable that stays zero only as large numbers cancel is noise, about 1e-16 of these: no program can
# follow it with errors of 1e-12 of its own size.
LEAST_SIZE = 1e-3
# The relative step of a finite difference that shows the size of the terms of a rate.
NUDGE = 1e-6


def program_of(
    document: Document,
    name: str,
    derivation: Derivation,
    initial: InitialState | None,
    orbit: OrbitSolution | None,
) -> Program:
    """The program of a system with this `name`: its rates, H, and momenta where velocities are followed.

    Raises DocumentError where a function has no formula, and ComputationError where H has steps, which its
    equations do not tell, or a number is too large for floats.
    """
    require_formulas(document, [derivation.generator, *derivation.system.forces], "a program")
    for place in derivation.jumps:
        raise ComputationError(f"H has a step where {place} = 0, which its equations do not tell")
    equations, phase, system = symbolic_equations(derivation), derivation.phase, derivation.system
    asked = {name: [to_tree(e)] for name, e in zip(phase.momenta, equations.momenta, strict=True)}
    asked = {name: trees for name, trees in asked.items() if name not in equations.names}
    asked["H"] = [to_tree(total(equations.energy))]
    asked |= {one.name: [to_tree(one.multiplier)] for one in system.constraints}
    try:
        rates = shared(equations.steps, equations.slopes)
        quantities = {name: shared(equations.steps, trees) for name, trees in asked.items()}
    except ExpressionError as error:
        raise ComputationError(f"there is no program: {error.message}") from error
    used = frozenset[str]().union(rates.names, *(each.names for each in quantities.values()))
    constants = {
        name: None
        if document.values.get(name) is None or name in document.symbols
        else float(document.values[name])
        for name in document.definitions
        if name in used
    }
    about = [name, f"L = {system.lagrangian}" if system.hamiltonian is None else f"H = {system.hamiltonian}"]
    about += [f"{one.name}: {one.expression} = 0" for one in system.constraints]
    about += [DRIFTS] if system.constraints else []
    forces = zip(phase.coordinates, system.forces, strict=True)
    about += [f"the force on {q} is {force}" for q, force in forces if not force.is_zero]
    run = None
    if initial is not None and orbit is not None:
        arguments = [TIME, *equations.names]
        flow = code.function(equations.slopes, arguments, initial.parameters, equations.steps)
        run = Run(equations.start(initial).tolist(), _sizes(orbit, flow), orbit.times)
    shown = (TIME, *phase.names, *list(asked)[-1 - len(system.constraints) :])
    return Program(about, constants, TIME, equations.names, rates, quantities, shown, run)


def _sizes(orbit: OrbitSolution, flow: Flow) -> list[float]:
    """The sizes of the variables of an orbit, in three digits; none is zero."""
    rates, times, states = columns(flow), orbit.times, orbit.states
    # Each variable is changed differently, so that equal ones do not cancel.
    nudged = states * (1 + NUDGE * np.linspace(1.0, 2.0, states.shape[1]))
    changes = np.abs(rates(times, *nudged.T) - rates(times, *states.T)).max(axis=1) / NUDGE
    between = times[-1] / min(len(times), orbit.steps or 1)
    sizes = np.fmax(np.abs(states).max(axis=0), LEAST_SIZE * changes * between)
    return [float(f"{size:.3g}") or 1.0 for size in sizes]
