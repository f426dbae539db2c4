"""The command `hamilton`."""

# Annotations here are objects, not texts: `computing` makes options of them.

from typing import Annotated

import typer

from rigidcli.cli.computing import computing
from rigidcli.cli.options import Duration, Samples


@computing
def hamilton(
    *,
    samples: Samples = None,
    duration: Duration = None,
    invariants: Annotated[
        bool,
        typer.Option("--invariants", help="Search for conserved quantities also where that takes longer."),
    ] = False,
) -> None:
    """From a Lagrangian to H, Hamilton's equations and orbits.

    Also from energies, particles or a Hamiltonian; with what is conserved, and changes of variables.

    Example: rigidcli hamilton spring.yaml -f latex
    """
