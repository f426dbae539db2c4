"""`euler`: the motion of a body in time, by Euler's equations, and the stability of its axes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rigidcli.core import free_body, memory
from rigidcli.core.arithmetic import FLOAT
from rigidcli.document.document import Document
from rigidcli.errors import ValueProblem
from rigidcli.report import Column, Field, Report, Table, yes_or_no
from rigidcli.studies.common import SHOWN_DIGITS, TINY, field_of, if_known, report, trusted, worked
from rigidcli.studies.euler.closed import CLOSED_FORM, closed_form, together
from rigidcli.studies.euler.motion import QUANTITIES, Trajectory, initial_value_problem
from rigidcli.studies.pictures import drawn


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
    fields, samples, stability = _fields(motion), motion.samples(), _stability(motion)
    working = worked("euler", steps, motion, tuple(fields))
    for place, rate in enumerate(stability.columns[-1].values):
        fields.append(Field("", rate, unit="1/s", cells={f"stability.{place}.rate": ()}))
    pictures, notes = drawn("euler", picture, motion, samples), motion.problem.notes
    if motion.method == CLOSED_FORM and motion.trusted_digits < SHOWN_DIGITS:
        notes = (*notes, "few digits can be trusted, because the rounding of the input decides the others")
    result = report(document, "euler", fields, notes, (stability, samples), working, pictures)
    if not scene:
        return result
    from rigidcli.studies.euler.pictures import scene_of

    return replace(result, scene=scene_of(document, motion, samples))


def follow(document: Document, progress: Callable[[float], None] | None = None) -> Trajectory:
    """The trajectory of the document's body: in closed form without torque and for a top, else integrated.

    Raises DocumentError where the document describes no motion, or one that a body cannot have, and
    ComputationError where the motion cannot be followed to its end.
    """
    problem = initial_value_problem(document)
    memory.require(len(problem.times), sum(len(quantity.cells) for quantity in QUANTITIES))
    motion = document.motion
    is_auto = motion is None or motion.method == "auto"
    closed = closed_form(problem) if is_auto or not problem.weight.any() else None
    if closed is not None:
        return closed
    from rigidcli.studies.euler.driven import driven_trajectory

    try:
        method, max_step = ("auto", None) if motion is None else (motion.method, motion.max_step)
        return driven_trajectory(problem, method, max_step or math.inf, progress, document.starts)
    except ValueProblem as wrong:
        raise document.refusal(
            wrong.message, ".".join(map(str, ("motion", *wrong.path))), hint=wrong.hint
        ) from None


def _fields(motion: Trajectory) -> list[Field]:
    frame, omega, free = motion.problem.frame, motion.problem.omega, motion.free
    momentum = motion.problem.tensor @ omega
    energy = float(omega @ momentum) / 2
    is_lost = 0 < abs(energy) < TINY  # so small an energy has lost its digits, while omega has not
    kind = "driven" if free is None else free.regime
    is_top = free is None and motion.method == CLOSED_FORM
    words = "driven: a symmetric top under its weight" if is_top else ""
    period, flip, rate = (free.period, free.flip_interval, free.mean_space_rate) if free else (None,) * 3
    return [
        field_of("euler", "moments", frame.moments),
        field_of("euler", "axes", frame.axes),
        field_of("euler", "angular_momentum", FLOAT.hypot(*momentum)),
        field_of("euler", "kinetic_energy", None if is_lost else energy),
        field_of("euler", "motion", kind, words=words),
        if_known(field_of("euler", "period", period)),
        if_known(field_of("euler", "flip_interval", flip)),
        if_known(field_of("euler", "mean_space_rate", rate)),
        field_of("euler", "method", motion.method),
        field_of("euler", "steps", motion.steps),
        trusted("euler", "trusted_digits", motion.trusted_digits),
        *(field_of("euler", f"drift.{key}", value) for key, value in motion.drift.items()),
    ]


def _stability(motion: Trajectory) -> Table:
    frame, speed = motion.problem.frame, FLOAT.hypot(*motion.problem.omega)
    stable, slopes = zip(*free_body.about_axes(frame.moments, frame.groups), strict=True)
    words = tuple(
        yes_or_no(one, "neutral") if moment else "" for one, moment in zip(stable, frame.moments, strict=True)
    )
    columns = [
        Column("axis", ["e1", "e2", "e3"], ("axis",)),
        Column("moment", frame.moments.tolist(), ("moment",), "kg m^2"),
        Column("stable", stable, ("stable",), words=words),
        Column("rate_per_spin", slopes, ("rate/spin",), hidden=True),
        Column("rate", [slope and slope * speed for slope in slopes], ("rate",), "1/s"),
    ]
    # A torque moves every axis, and of a ball any axis does.
    if motion.free is None or len(frame.groups) == 1:
        columns = [replace(column, hidden=True) for column in columns]
    title = "rotation about the principal axes, without a torque"
    return Table("stability", title, tuple(columns), records=True)
