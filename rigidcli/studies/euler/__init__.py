"""`euler`: the motion of a body in time, by Euler's equations, and the stability of its axes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rigidcli.core import memory, stability
from rigidcli.core.arithmetic import FLOAT
from rigidcli.document.document import Document
from rigidcli.errors import ValueProblem
from rigidcli.report import Column, Field, Report, Step, Table
from rigidcli.studies.common import SHOWN_DIGITS, if_known, report, trusted
from rigidcli.studies.euler.closed import CLOSED_FORM, closed_form, together
from rigidcli.studies.euler.columns import COLUMNS, trajectory_table
from rigidcli.studies.euler.initial import initial_value_problem
from rigidcli.studies.euler.trajectory import Trajectory
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

        require_one_start(document, {"picture": picture})
        return whole(document, run, together)
    motion = follow(document, progress)
    fields, (stable, shown) = (*_body(motion), *_kind(motion), *_quality(motion)), _stability(motion)
    working: list[Step] = []
    if steps:
        from rigidcli.studies.euler.steps import euler_steps

        working += euler_steps(motion, fields, shown)
    rates = next(column for column in stable.columns if column.key == "rate")
    fields += tuple(
        Field("", rate, unit=rates.unit, cells={f"stability.{place}.rate": ()})
        for place, rate in enumerate(rates.values)
    )
    samples, title = trajectory_table(motion), "motion by Euler's equations"
    pictures = drawn("euler", picture, motion, samples)
    notes, tables = motion.problem.notes, (stable, shown, samples)
    if motion.method == CLOSED_FORM and motion.trusted_digits < SHOWN_DIGITS:
        notes = (*notes, "few digits can be trusted, because the rounding of the input decides the others")
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
    motion = document.motion
    is_auto = motion is None or motion.method == "auto"
    closed = closed_form(problem) if is_auto or not problem.weight.any() else None
    if closed is not None:
        return closed
    from rigidcli.studies.euler.driven import driven_trajectory

    try:
        method, max_step = ("auto", None) if motion is None else (motion.method, motion.max_step)
        return driven_trajectory(problem, method, max_step or math.inf, progress, document.reading.starts)
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


def _stability(motion: Trajectory) -> tuple[Table, Table]:
    """The axes, and what becomes of a rotation about each with the initial |omega|: for programs, for people.

    People see one row for axes of equal moments.
    """
    frame = motion.problem.frame
    found = stability.about_axes(frame.moments, frame.groups)
    speed = FLOAT.hypot(*motion.problem.omega)
    moments = [float(moment) for moment in frame.moments]
    per_spin = [one.rate_per_spin for one in found]
    rates = [None if rate is None else rate * speed for rate in per_spin]
    shown = [group[0] for group in frame.groups]
    verdicts = {True: "yes", False: "no", None: "neutral"}
    whole = (
        Column("axis", list(AXES), ("axis",), hidden=True),
        Column("moment", moments, ("moment",), "kg m^2", hidden=True),
        Column("stable", [one.stable for one in found], ("stable",), hidden=True),
        Column("rate_per_spin", per_spin, ("rate/spin",), hidden=True),
        Column("rate", rates, ("rate",), "1/s", hidden=True),
    )
    axes = [_axes_in_words(group) for group in frame.groups]
    stable = [verdicts[found[k].stable] if moments[k] else "" for k in shown]
    people = (
        replace(whole[0], values=axes, hidden=False),
        replace(whole[1], values=[moments[k] for k in shown], hidden=False),
        replace(whole[2], values=stable, hidden=False),
        replace(whole[3], values=[per_spin[k] for k in shown]),
        replace(whole[4], values=[rates[k] for k in shown], hidden=False),
    )
    title = "rotation about the principal axes, when left alone"
    return Table("stability", title, whole, records=True), Table("", title, people)


def _axes_in_words(group: Sequence[int]) -> str:
    """The axes of one moment."""
    names = list(AXES)
    if len(group) == 1:
        return AXES[names[group[0]]]
    return (
        "any axis" if len(group) == 3 else f"any axis in the plane of {names[group[0]]} and {names[group[1]]}"
    )
