"""The columns of `euler`: the samples of a trajectory, as csv and json have them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rigidcli.core import rotation
from rigidcli.report import NOISE, Column, Table
from rigidcli.studies.common import noise
from rigidcli.studies.euler.trajectory import Trajectory

QUANTITIES = (
    Column("t", None, ("t",), "s", ("t",)),
    Column("omega", None, ("w1", "w2", "w3"), "rad/s", (r"\omega_{1}", r"\omega_{2}", r"\omega_{3}")),
    Column("angular_momentum", None, ("L1", "L2", "L3"), "kg m^2/s", (r"L_{1}", r"L_{2}", r"L_{3}"), True),
    Column("kinetic_energy", None, ("T",), "J", ("T",)),
    Column("orientation", None, ("q0", "q1", "q2", "q3"), symbols=(r"q_{0}", r"q_{1}", r"q_{2}", r"q_{3}")),
    Column(
        "angular_momentum_space", None, ("Lx", "Ly", "Lz"), "kg m^2/s", (r"L_{x}", r"L_{y}", r"L_{z}"), True
    ),
    Column("angles", None, ("phi", "theta", "psi"), "rad", (r"\phi", r"\theta", r"\psi")),
)
"""The quantities, still without values, in the order of their columns; of `angles` see the problem.

People are not shown the angular momentum, unless they ask for it.
"""

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
        # People see the angles instead of the quaternion.
        is_hidden = column.key == "orientation" and "angles" in values
        return replace(
            column,
            values=values[column.key],
            hidden=column.hidden or is_hidden,
            noise=NOISE if column.key == "t" else error,
        )

    columns = tuple(filled(column) for column in QUANTITIES if column.key in values)
    own = "the body" if np.array_equal(axes, np.eye(3)) else "`frame`"
    title = f"the motion: 1, 2, 3 are the axes x, y, z of {own}, which turn with it"
    return Table("trajectory", title, columns, data=True)
