"""The command `hamilton`."""

# Annotations here are objects, not texts: `computing` makes options of them.

from typing import TYPE_CHECKING, Annotated

import typer

import rigidcli
from rigidcli.cli.computing import computing
from rigidcli.cli.output import progress

if TYPE_CHECKING:
    from rigidcli.model.document import Document
    from rigidcli.report import Report


@computing
def hamilton(
    document: "Document",
    *,
    invariants: Annotated[
        bool,
        typer.Option("--invariants", help="Search for conserved quantities also where that takes longer."),
    ] = False,
) -> "Report":
    """From a Lagrangian to momenta, the Hamiltonian, Hamilton's equations and orbits in phase space."""
    with progress() as show:
        return rigidcli.hamilton(document, invariants=invariants, progress=show)
