"""The command `axes`."""

from rigidcli.cli.computing import computing


@computing
def axes() -> None:
    """Principal moments and axes; motion at a given omega.

    With `motion.omega` also L, T, the angle between omega and L, and whether the body wobbles.

    Example: rigidcli axes cube.yaml --set body.mass=3
    """
