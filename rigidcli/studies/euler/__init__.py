"""`euler`: the motion of a body in time, by Euler's equations, and the stability of its axes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rigidcli.core import memory, stability
from rigidcli.core.arithmetic import FLOAT
from rigidcli.document.document import Document
from rigidcli.errors import ValueProblem
from rigidcli.report import Column, Field, Report, Step, Table
from rigidcli.studies.common import if_known, report, trusted
from rigidcli.studies.euler.columns import COLUMNS, trajectory_table
from rigidcli.studies.euler.initial import initial_value_problem
from rigidcli.studies.euler.trajectory import CLOSED_FORM, Trajectory, free_trajectory
from rigidcli.studies.pictures import drawn
from rigidcli.studies.results import told

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
"""The kinds of motion, in words."""

AXES = {"e1": "e1, least moment", "e2": "e2, middle moment", "e3": "e3, greatest moment"}
"""The principal axes, which are others than the axes 1, 2, 3 of the components of omega and L, in words."""


@np.errstate(over="ignore", invalid="ignore")
def run(
    document: Document,
    *,
    progress: Callable[[float], None] | None = None,
    steps: bool = False,
    picture: str | None = None,
    scene: bool = False,
) -> Report:
    """Follow the motion that the document describes; `progress` is called with the fraction that is done."""
    if document.ensemble is not None:
        from rigidcli.studies.ensembles import require_one_start, whole
        from rigidcli.studies.euler.ensemble import together

        require_one_start(document, {"picture": picture})
        return whole(document, run, together)
    motion = follow(document, progress)
    fields, stable = (*_body(motion), *_kind(motion), *_quality(motion)), _stability(motion)
    working: list[Step] = []
    if steps:
        from rigidcli.studies.euler.steps import euler_steps

        working += euler_steps(motion, fields, stable)
    rates = next(column for column in stable.columns if column.key == "rate")
    fields += tuple(
        Field("", rate, unit=rates.unit, cells={f"stability.{place}.rate": ()})
        for place, rate in enumerate(rates.values)
    )
    samples, title = trajectory_table(motion), "motion by Euler's equations"
    pictures = drawn("euler", picture, motion, samples)
    notes, tables = motion.problem.notes, (stable, samples)
    result = report(document, SCHEMA, title, fields, notes, tables, working, pictures)
    if not scene:
        return result
    from rigidcli.studies.euler.scene import scene_of

    return replace(result, scene=scene_of(document, motion, samples))


def follow(
    document: Document,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """The trajectory of the document's body: in closed form without torque and for a top, else integrated.

    Raises DocumentError where the document describes no motion, or one that a body cannot have, and
    ComputationError where the motion cannot be followed to its end.
    """
    problem = initial_value_problem(document)
    memory.require(len(problem.times), len(COLUMNS))
    if problem.torque is None and not problem.weight.any():
        return free_trajectory(problem)
    motion = document.motion
    if problem.torque is None and (motion is None or motion.method == "auto"):
        from rigidcli.studies.euler.heavy_top import heavy_top_trajectory

        closed = heavy_top_trajectory(problem)
        if closed is not None:
            return closed
    from rigidcli.studies.euler.driven import driven_trajectory

    try:
        method, max_step = ("auto", None) if motion is None else (motion.method, motion.max_step)
        return driven_trajectory(problem, method, max_step or math.inf, progress, document.shared.starts)
    except ValueProblem as wrong:
        raise document.refusal(
            wrong.message, ".".join(map(str, ("motion", *wrong.path))), hint=wrong.hint
        ) from None


def _body(motion: Trajectory) -> tuple[Field, ...]:
    problem = motion.problem
    frame, momentum = problem.frame, problem.inertia.momentum(problem.omega)
    energy = float(problem.omega @ momentum) / 2
    # So small an energy has lost its digits, while omega has not.
    is_lost = 0 < abs(energy) < np.finfo(np.float64).tiny
    return (
        told("euler", "moments", frame.moments),
        told("euler", "axes", frame.axes),
        told("euler", "angular_momentum", FLOAT.hypot(*momentum)),
        told("euler", "kinetic_energy", None if is_lost else energy),
    )


def _kind(motion: Trajectory) -> tuple[Field, ...]:
    """What kind of motion it is, and its periods where it is free."""
    free = motion.free
    kind = "driven" if free is None else free.regime
    words = MOTIONS["top" if kind == "driven" and motion.method == CLOSED_FORM else kind]
    period, flip, rate = (free.period, free.flip_interval, free.mean_space_rate) if free else (None,) * 3
    turns = None if flip is None or rate is None else flip * rate / (2 * math.pi)
    return (
        told("euler", "motion", kind, words=words),
        if_known(told("euler", "period", period)),
        if_known(told("euler", "flip_interval", flip)),
        if_known(told("euler", "turns_per_flip", turns)),
        if_known(told("euler", "mean_space_rate", rate)),
    )


def _quality(motion: Trajectory) -> tuple[Field, ...]:
    """How the motion was followed, and how many digits can be trusted."""
    drift = motion.drift
    return (
        told("euler", "method", motion.method, words=motion.method),
        told("euler", "steps", motion.steps),
        trusted("euler", "trusted_digits", motion.trusted_digits),
        told("euler", "drift.energy", drift["energy"]),
        told("euler", "drift.angular_momentum", drift["angular_momentum"]),
        told("euler", "drift.quaternion", drift["quaternion"]),
    )


def _stability(motion: Trajectory) -> Table:
    """The three axes, and what becomes of a rotation about each with the initial |omega|."""
    frame = motion.problem.frame
    found = stability.about_axes(frame.moments, frame.groups)
    speed = FLOAT.hypot(*motion.problem.omega)
    rates = [None if one.rate_per_spin is None else one.rate_per_spin * speed for one in found]
    return Table(
        "stability",
        "rotation about the principal axes, when left alone",
        (
            Column("axis", list(AXES), ("axis",), words=tuple(AXES.values())),
            Column("moment", [float(moment) for moment in frame.moments], ("moment",), "kg m^2"),
            Column("stable", [one.stable for one in found], ("stable",)),
            Column("rate_per_spin", [one.rate_per_spin for one in found], ("rate/spin",)),
            Column("rate", rates, ("rate",), "1/s"),
        ),
        records=True,
    )
