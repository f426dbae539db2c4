"""The command `precess`."""

from rigidcli.cli.computing import computing


@computing
def precess() -> None:
    """Precession: tops under gravity, free, tidal.

    Of a `top`, of a `body` with `motion.omega`, of a planet with a `tide`: whichever there are.

    Example: rigidcli precess top.yaml --set top.spin="900 rpm"
    """
