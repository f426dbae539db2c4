"""The command `hamilton`."""

# Annotations here are objects, not texts: `computing` makes options of them.

from typing import Annotated

import typer

from rigidcli.cli.computing import MaxSteps, computing


@computing
def hamilton(
    *,
    invariants: Annotated[
        bool,
        typer.Option("--invariants", help="Search for conserved quantities also where that takes longer."),
    ] = False,
    max_steps: MaxSteps = None,
) -> None:
    """From a Lagrangian to momenta, the Hamiltonian, Hamilton's equations and orbits in phase space."""
