"""The command `euler`."""

# Annotations here are objects, not texts: `computing` makes options of them.

from enum import StrEnum
from typing import Annotated

import typer

from rigidcli.cli.computing import computing
from rigidcli.cli.options import Duration, MaxSteps, Samples


class EngineName(StrEnum):
    """The integrators of driven motion."""

    auto = "auto"
    runge_kutta = "runge-kutta"
    taylor = "taylor"


@computing
def euler(
    *,
    samples: Samples = None,
    duration: Duration = None,
    engine: Annotated[
        EngineName, typer.Option(help="What integrates driven motion; taylor needs the extra `taylor`.")
    ] = EngineName.auto,
    max_steps: MaxSteps = None,
) -> None:
    """Motion by Euler's equations in time; stability of the axes.

    Torque-free motion is in closed form, driven motion is integrated.

    Example: rigidcli euler motion.yaml --duration "5 min" -f csv
    """
