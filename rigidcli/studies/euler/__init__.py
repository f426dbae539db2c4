"""`euler`: the motion of a body in time, by Euler's equations, and the stability of its axes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.core import rotation, stability
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.principal import PrincipalFrame, principal_frame
from rigidcli.model.document import Document
from rigidcli.report import Column, Field, Report, Table
from rigidcli.studies import inertia
from rigidcli.studies.euler.trajectory import CLOSED, Trajectory, follow

if TYPE_CHECKING:
    from rigidcli.core.integrate import Engine

SCHEMA = "rigidcli.euler/1"

MOTIONS = {
    "rest": "rest: omega is zero",
    "sphere": "sphere: all moments are equal, so that omega is constant",
    "principal": "principal: omega is along a principal axis and constant",
    "linear": "linear: no moment about its own axis, so that omega stays across it",
    "oblate": "oblate symmetric top: omega turns about e3 in the body, e3 about L in space",
    "prolate": "prolate symmetric top: omega turns about e1 in the body, e1 about L in space",
    "about_lowest": "omega circulates about e1, the axis of the lowest moment, as L^2 < 2 T lambda2",
    "about_highest": "omega circulates about e3, the axis of the highest moment, as L^2 > 2 T lambda2",
    "separatrix": "separatrix: L^2 = 2 T lambda2, so that omega nears the intermediate axis forever",
    "driven": "driven by a torque",
    "top": "driven: a symmetric top under its weight",
}


def run(
    document: Document, *, engine: Engine = "auto", progress: Callable[[float], None] | None = None
) -> Report:
    """Follow the motion that the document describes; `progress` is told which fraction is done."""
    motion = follow(document, engine, progress)
    axes = document.axes
    frame = principal_frame(axes.T @ motion.start.tensor @ axes)
    return inertia.report(
        document,
        SCHEMA,
        "motion by Euler's equations",
        (*_body(motion, frame), *_kind(motion), *_quality(motion)),
        motion.start.notes,
        (_stability(motion, frame), _trajectory(motion, axes)),
    )


def _body(motion: Trajectory, frame: PrincipalFrame) -> tuple[Field, ...]:
    energy = float(motion.energy[0])
    return (
        Field(
            "moments", frame.moments, "principal moments about O", r"\lambda_{1,2,3}", "kg m^2", counts=True
        ),
        Field("axes", frame.axes, "principal axes (rows)", r"\mathbf{e}_{1,2,3}"),
        Field("angular_momentum", _length(motion.momentum[0]), "angular momentum", "L", "kg m^2/s"),
        Field("kinetic_energy", _representable(energy), "kinetic energy", "T", "J"),
    )


def _kind(motion: Trajectory) -> tuple[Field, ...]:
    """What kind of motion it is, and its periods where it is free."""
    free = motion.free
    regime = "driven" if free is None else free.regime
    period, flip, rate = (
        (None, None, None) if free is None else (free.period, free.flip_interval, free.mean_space_rate)
    )
    turns = None if flip is None or rate is None else flip * rate / (2 * math.pi)
    return (
        Field(
            "motion",
            regime,
            "motion",
            words=MOTIONS["top" if regime == "driven" and motion.method == CLOSED else regime],
        ),
        Field("period", period, "period of omega in the body" if period is not None else "", r"\tau", "s"),
        Field("flip_interval", flip, "time between flips" if flip is not None else "", r"\tau/2", "s"),
        Field("turns_per_flip", turns, "turns about L between flips" if turns is not None else ""),
        Field(
            "mean_space_rate",
            rate,
            "mean rate about L" if rate is not None else "",
            r"\overline{\dot\phi}",
            "rad/s",
        ),
    )


def _quality(motion: Trajectory) -> tuple[Field, ...]:
    """How it was followed, and what can be trusted."""
    drift = motion.drift
    return (
        Field("method", motion.method, "method", words=motion.method),
        Field("steps", motion.steps),
        Field("trusted_digits", motion.trusted_digits, "digits of the orientation to trust"),
        Field("drift.energy", drift["energy"], "drift of the energy balance"),
        Field("drift.angular_momentum", drift["angular_momentum"], "drift of the angular momentum"),
        Field("drift.quaternion", drift["quaternion"]),
    )


def _stability(motion: Trajectory, frame: PrincipalFrame) -> Table:
    """The three axes, and what happens to rotation about each at the speed of the beginning."""
    found = stability.about_axes(frame.moments, frame.groups)
    speed = _length(motion.start.omega)
    rates = [None if one.rate_per_spin is None else one.rate_per_spin * speed for one in found]
    return Table(
        "stability",
        "rotation about the principal axes, when left alone",
        (
            Column("axis", ["e1", "e2", "e3"], ("axis",), ""),
            Column("moment", [float(moment) for moment in frame.moments], ("moment",), "kg m^2"),
            Column("stable", [one.stable for one in found], ("stable",), ""),
            Column("rate_per_spin", [one.rate_per_spin for one in found], ("rate/spin",), ""),
            Column("rate", rates, ("rate",), "1/s"),
        ),
        records=True,
    )


def _trajectory(motion: Trajectory, axes: Floats) -> Table:
    """The samples, with body components along the results' axes (columns, in the document's components)."""
    start = motion.start
    orientation = rotation.compose(motion.orientation, rotation.as_quaternion(axes))
    body, space = (r"\omega_{1}", r"\omega_{2}", r"\omega_{3}"), (r"L_{x}", r"L_{y}", r"L_{z}")
    columns = [
        Column("t", start.times, ("t",), "s", ("t",)),
        Column("omega", motion.omega @ axes, ("w1", "w2", "w3"), "rad/s", body),
        Column(
            "angular_momentum",
            motion.momentum @ axes,
            ("L1", "L2", "L3"),
            None,
            (r"L_{1}", r"L_{2}", r"L_{3}"),
        ),
        Column("kinetic_energy", motion.energy, ("T",), "J", ("T",)),
        Column(
            "orientation",
            orientation,
            ("q0", "q1", "q2", "q3"),
            None if start.symmetry is not None else "",
            (r"q_{0}", r"q_{1}", r"q_{2}", r"q_{3}"),
        ),
        Column("angular_momentum_space", motion.momentum_in_space, ("Lx", "Ly", "Lz"), None, space),
    ]
    if start.symmetry is not None:
        local = rotation.compose(motion.orientation, rotation.as_quaternion(start.symmetry))
        angles = rotation.zxz_angles(local)
        columns.append(
            Column("angles", angles, ("phi", "theta", "psi"), "rad", (r"\phi", r"\theta", r"\psi"))
        )
    return Table("trajectory", "the motion", tuple(columns), data=True)


def _length(vector: Floats) -> float:
    """|v|, also where its square is beyond the range of floats."""
    return FLOAT.hypot(*vector)


def _representable(value: float) -> float | None:
    """A number, or None if it is so small that floats lose its digits."""
    return None if 0 < abs(value) < np.finfo(np.float64).tiny else value
