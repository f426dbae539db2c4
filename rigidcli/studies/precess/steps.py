"""The working of `precess`: the laws of tops, free bodies and tides, with numbers in place of letters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TypeAlias

from rigidcli.core import precession
from rigidcli.core.arithmetic import Arithmetic
from rigidcli.document.document import Document
from rigidcli.document.motion import Tide, Top
from rigidcli.report import Field, Step, Value
from rigidcli.studies.body import principal_omega
from rigidcli.studies.common import field_of
from rigidcli.studies.writing import filled, law

Results: TypeAlias = Mapping[str, Value]  # the results of a section by their keys


def steps(document: Document, results: Mapping[str, Results]) -> Iterator[Step]:
    """The way to the `results` for the sections of the document."""
    n = document.arithmetic
    if document.top is not None and "top" in results:
        yield from _top(document.top, results["top"], n)
    if results.get("free", {}).get("body_rate") is not None:
        yield _free(document, results["free"])
    if document.tide is not None and "tide" in results:
        yield _tide(document.tide, results["tide"], n)


def _shown(section: str, results: Results, *keys: str) -> tuple[Field, ...]:
    """The results with these keys as the report has them, without those that have no value."""
    fields = (field_of("precess", f"{section}.{key}", results.get(key)) for key in keys)
    return tuple(replace(entry, key="", cells={}) for entry in fields if entry.value is not None)


def _top(section: Top, top: Results, n: Arithmetic) -> Iterator[Step]:
    letters = {"M": "mass", "g": "gravity", "R": "distance", "lambda1": "lambda1", "lambda3": "lambda3"}
    letters |= {"omega3": "spin", "theta": "tilt"}
    numbers = {letter: top[key] for letter, key in letters.items() if top[key] is not None}
    if top.get("torque_magnitude") is not None:
        yield Step(
            "Torque of the weight",
            "The weight acts at R from the pivot, and the torque R x M g is horizontal, across the axis.",
            (filled("M*g*R*sin(theta)", n, **numbers), *_shown("top", top, "torque_magnitude")),
        )
    if top["gyroscopic_rate"] is not None:
        momentum, rate = n.tidied(top["lambda3"] * top["spin"]), top["gyroscopic_rate"]
        yield Step(
            "Gyroscopic precession",
            "A fast top has L = lambda3 omega3 along its axis. The torque turns it, so that Omega L "
            "sin(theta) is M g R sin(theta).",
            (
                *law("lambda3*omega3", "L", "L", momentum, "kg m^2/s", n, **numbers),
                *law("M*g*R/(lambda3*omega3)", "Omega", r"\Omega", rate, "rad/s", n, **numbers),
            ),
        )
    if "slow_rate" in top:
        fall = top["mass"] * top["gravity"] * top["distance"]
        upward = top["lambda1"] * precession.cosine(top["tilt"], n)
        discriminant = n.tidied((top["lambda3"] * top["spin"]) ** 2 - 4 * upward * fall)
        text, unit = "lambda3^2*omega3^2 - 4*lambda1*cos(theta)*M*g*R", "kg^2 m^4/s^2"
        yield Step(
            "Steady precession",
            "At a constant tilt, Omega is a root of this quadratic. The roots are real where the "
            "discriminant is not negative.",
            (
                filled("lambda1*cos(theta)*Omega^2 - lambda3*omega3*Omega + M*g*R", n, **numbers),
                *law(text, "discriminant", "D", discriminant, unit, n, **numbers),
                *_shown("top", top, "slow_rate", "fast_rate"),
            ),
        )
    if top.get("theta_min") is not None:
        yield _nutation(section, top, n)
    if "sleeping_spin" in top:
        yield Step(
            "Upright",
            "Upright, the top sleeps if lambda3^2 omega3^2 > 4 lambda1 M g R.",
            (
                filled("sqrt(4*lambda1*M*g*R)/lambda3", n, **numbers),
                *_shown("top", top, "sleeping_spin", "spin"),
            ),
        )


def _nutation(section: Top, top: Results, n: Arithmetic) -> Step:
    """The cubic in u = cos(theta), and its turning points; for floats only."""
    start = top["slow_rate"] if section.precession is None else section.precession
    cosine, sine = precession.cosine(top["tilt"], n), precession.sine(top["tilt"], n)
    a = top["lambda3"] * top["spin"] / top["lambda1"]
    beta = 2 * top["mass"] * top["gravity"] * top["distance"] / top["lambda1"]
    b = sine**2 * start + a * cosine
    alpha = section.nutation**2 + sine**2 * start**2 + beta * cosine
    cubic = filled("(1 - u^2)*(alpha - beta*u) - (b - a*u)^2", n, alpha=alpha, beta=beta, a=a, b=b)
    limits = (("theta_max", "1"), ("theta_min", "2"))
    return Step(
        "Nutation",
        "With u = cos(theta), a = lambda3 omega3/lambda1, b = p_phi/lambda1, beta = 2 M g R/lambda1, and "
        "alpha from the energy, (du/dt)^2 is this cubic (Goldstein, section 5.7). The axis nutates between "
        "two of the roots.",
        (
            cubic,
            *(Field("", float(precession.cosine(top[key], n)), f"u{k}", f"u_{k}") for key, k in limits),
            *_shown("top", top, "theta_min", "theta_max"),
        ),
    )


def _free(document: Document, free: Results) -> Step:
    n, frame = document.arithmetic, document.physical.frame
    axis = next((group[0] for group in frame.groups if len(group) == 1), 2)
    omega, L = principal_omega(document, frame), free["angular_momentum"]
    numbers = {"lambda1": frame.moments[1], "lambda3": frame.moments[axis], "omega3": omega[axis], "L": L}
    return Step(
        "Free motion",
        "Across the symmetry axis e3 both moments are lambda1, and Euler's equations are linear: omega turns "
        "about e3 in the body at (lambda3 - lambda1)/lambda1 omega3, and e3 about L in space at L/lambda1.",
        (
            filled("(lambda3 - lambda1)*omega3/lambda1", n, **numbers),
            *_shown("free", free, "body_rate"),
            filled("L/lambda1", n, **numbers),
            *_shown("free", free, "space_rate"),
        ),
    )


def _tide(section: Tide, tide: Results, n: Arithmetic) -> Step:
    numbers = {"H": section.bulge, "epsilon": section.obliquity, "omega": section.spin}
    fields: list[Field] = []
    for place, one in enumerate(section.perturbers, 1):
        text = "3/2*mu/(a^3*(1 - e^2)^(3/2))*(1 - 3/2*sin(i)^2)*H*cos(epsilon)/omega"
        orbit = {"mu": one.pull, "a": one.distance, "e": one.eccentricity, "i": one.inclination}
        fields.append(filled(text, n, one.name or str(place), **orbit, **numbers))
    return Step(
        "Precession by tides",
        "A perturber with G m = mu at the distance a pulls at the bulge H = (C - A)/C. On average over the "
        "orbit, it turns the axis at 3/2 mu/(a^3 (1 - e^2)^(3/2)) (1 - 3/2 sin(i)^2) H cos(epsilon)/omega.",
        (*fields, *_shown("tide", tide, "rate")),
    )
