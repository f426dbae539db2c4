"""The command `inertia`."""

from rigidcli.cli.computing import computing


@computing
def inertia() -> None:
    """Mass, centre of mass, inertia tensor about a point.

    Example: rigidcli inertia -f csv cube.yaml plate.yaml
    """
