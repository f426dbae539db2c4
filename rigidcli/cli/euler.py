"""The command `euler`."""

# Annotations here are objects, not texts: `computing` makes options of them.

from enum import StrEnum
from typing import Annotated

import typer

from rigidcli.cli.computing import MaxSteps, computing


class EngineName(StrEnum):
    """The integrators of driven motion."""

    auto = "auto"
    runge_kutta = "runge-kutta"
    taylor = "taylor"


def _split(text: str | None) -> list[str] | None:
    """The names in `t,w1,w2`; refused unless they are columns."""
    if text is None:
        return None
    from rigidcli.studies.euler.columns import COLUMNS

    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in COLUMNS:
            raise typer.BadParameter(f"`{name}` is none of {', '.join(COLUMNS)}")
    return names


@computing
def euler(
    *,
    samples: Annotated[
        int | None, typer.Option(metavar="N", help="Number of samples (motion.samples; default 1001).")
    ] = None,
    duration: Annotated[
        str | None, typer.Option(metavar="TIME", help='End of the motion (motion.duration), as in "5 min".')
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(metavar="NAMES", callback=_split, help="Columns for table, csv and latex: t,w1,w2,w3."),
    ] = None,
    engine: Annotated[
        EngineName, typer.Option(help="What integrates driven motion; taylor needs the extra `taylor`.")
    ] = EngineName.auto,
    max_steps: MaxSteps = None,
) -> None:
    """Motion by Euler's equations: omega, L, T and orientation in time; stability.

    Torque-free motion is in closed form, driven motion is integrated.
    """
