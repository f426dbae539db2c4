"""The command `euler`."""

# Annotations here are objects, not texts: `computing` makes options of them.

from rigidcli.cli.computing import computing
from rigidcli.cli.options import Duration, Samples


@computing
def euler(
    *,
    samples: Samples = None,
    duration: Duration = None,
) -> None:
    """Motion by Euler's equations in time; stability of the axes.

    Torque-free motion is in closed form, driven motion is integrated.

    Example: rigidcli euler motion.yaml --duration "5 min" -f csv
    """
