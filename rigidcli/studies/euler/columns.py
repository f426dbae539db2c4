"""The columns of `euler`: the samples of a trajectory, as csv and json have them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rigidcli.core import rotation
from rigidcli.report import NOISE, Column, Table
from rigidcli.studies.common import noise
from rigidcli.studies.euler.trajectory import Trajectory
from rigidcli.studies.results import RESULTS

HIDDEN = ("trajectory.angular_momentum", "trajectory.orientation", "trajectory.angular_momentum_space")
"""The quantities that people are not shown, unless they ask for them."""

QUANTITIES = tuple(
    Column(
        field.key.removeprefix("trajectory."),
        None,
        tuple(field.cells),
        field.unit,
        tuple(field.symbol.split(", ")),
        field.key in HIDDEN,
    )
    for field in RESULTS["euler"]
    if field.key.startswith("trajectory.")
)
"""The quantities, still without values, in the order of their columns; of `angles` see the problem."""

COLUMNS = tuple(name for quantity in QUANTITIES for name in quantity.cells)
"""The names of all columns, the angles included."""


def trajectory_table(motion: Trajectory) -> Table:
    """The samples, with body components along the axes of the results."""
    problem, axes = motion.problem, motion.problem.shown
    values = {
        "t": problem.times,
        "omega": motion.omega @ axes,
        "angular_momentum": motion.momentum @ axes,
        "kinetic_energy": motion.energy,
        "orientation": rotation.compose(motion.orientation, rotation.as_quaternion(axes)),
        "angular_momentum_space": motion.momentum_in_space,
    }
    if problem.angles is not None:
        carried = rotation.compose(motion.orientation, rotation.as_quaternion(problem.carried))
        values["angles"] = rotation.euler_angles(carried, problem.angles)

    error = noise(motion.trusted_digits)

    def filled(column: Column) -> Column:
        return replace(
            column,
            values=values[column.key],
            noise=NOISE if column.key == "t" else error,
        )

    columns = tuple(filled(column) for column in QUANTITIES if column.key in values)
    own = "the body" if np.array_equal(axes, np.eye(3)) else "`frame`"
    title = f"the motion: 1, 2, 3 are the axes x, y, z of {own}, which turn with it"
    return Table("trajectory", title, columns, data=True)
