"""The columns of `euler`: the samples of a trajectory, as csv and json have them."""

from __future__ import annotations

from typing import NamedTuple

from rigidcli.core import rotation
from rigidcli.report import Column, Table
from rigidcli.studies.euler.trajectory import Trajectory


class Quantity(NamedTuple):
    """The names of a quantity's components in csv, the unit of the quantity, and the components in LaTeX.

    A table for people leaves out a quantity whose `unit` is None.
    """

    names: tuple[str, ...]
    unit: str | None
    symbols: tuple[str, ...]


QUANTITIES = {
    "t": Quantity(("t",), "s", ("t",)),
    "omega": Quantity(("w1", "w2", "w3"), "rad/s", (r"\omega_{1}", r"\omega_{2}", r"\omega_{3}")),
    "angular_momentum": Quantity(("L1", "L2", "L3"), None, (r"L_{1}", r"L_{2}", r"L_{3}")),
    "kinetic_energy": Quantity(("T",), "J", ("T",)),
    "orientation": Quantity(("q0", "q1", "q2", "q3"), "", (r"q_{0}", r"q_{1}", r"q_{2}", r"q_{3}")),
    "angular_momentum_space": Quantity(("Lx", "Ly", "Lz"), None, (r"L_{x}", r"L_{y}", r"L_{z}")),
    "angles": Quantity(("phi", "theta", "psi"), "rad", (r"\phi", r"\theta", r"\psi")),
}
"""The quantities in the order of their columns, by their keys in json; only a top has `angles`."""

COLUMNS = tuple(name for quantity in QUANTITIES.values() for name in quantity.names)
"""The names of all columns, those of a top included."""


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
    quantities = dict(QUANTITIES)
    if problem.symmetry is not None:
        local = rotation.compose(motion.orientation, rotation.as_quaternion(problem.symmetry))
        values["angles"] = rotation.zxz_angles(local)
        # People see the angles instead.
        quantities["orientation"] = quantities["orientation"]._replace(unit=None)
    columns = tuple(Column(key, value, *quantities[key]) for key, value in values.items())
    return Table("trajectory", "the motion", columns, data=True)
