"""The working of `precess`: the laws of tops, free bodies and tides, with numbers in place of letters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rigidcli.core import precession
from rigidcli.core.arithmetic import Arithmetic
from rigidcli.document.document import Document
from rigidcli.document.motion import Tide, Top
from rigidcli.report import Field, Step, Value
from rigidcli.studies.steps.writing import filled, law


def precess_steps(document: Document, results: Mapping[str, Mapping[str, Value]]) -> Iterator[Step]:
    """The way to the `results` for the sections of the document."""
    n = document.arithmetic
    if document.top is not None and "top" in results:
        yield from _top(document.top, results["top"], n)
    if "free" in results:
        yield from _free(results["free"], n)
    if document.tide is not None and "tide" in results:
        yield from _tide(document.tide, results["tide"], n)


def _top(section: Top, top: Mapping[str, Value], n: Arithmetic) -> Iterator[Step]:
    letters = {"M": "mass", "g": "gravity", "R": "distance", "lambda1": "lambda1", "lambda3": "lambda3"}
    letters |= {"omega3": "spin", "theta": "tilt"}
    numbers = {letter: top[key] for letter, key in letters.items() if top[key] is not None}
    if top.get("torque_magnitude") is not None:
        yield Step(
            "Torque of the weight",
            "The weight acts at R from the pivot, and the torque R x M g is horizontal, across the axis.",
            law("M*g*R*sin(theta)", "torque", r"\Gamma", top["torque_magnitude"], "N m", n, **numbers),
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
        yield _steady(top, numbers, n)
    if top.get("theta_min") is not None:
        yield _nutation(section, top, n)
    if "sleeping_spin" in top:
        least, symbol = top["sleeping_spin"], r"\omega_\mathrm{sleep}"
        yield Step(
            "Upright",
            "Upright, the top sleeps if lambda3^2 omega3^2 > 4 lambda1 M g R.",
            (
                *law("sqrt(4*lambda1*M*g*R)/lambda3", "least spin", symbol, least, "rad/s", n, **numbers),
                Field("", top["spin"], "spin of the top", r"\omega_3", "rad/s"),
            ),
        )


def _steady(top: Mapping[str, Value], numbers: Mapping[str, Value], n: Arithmetic) -> Step:
    fall = top["mass"] * top["gravity"] * top["distance"]
    upward = top["lambda1"] * precession.cosine(top["tilt"], n)
    discriminant = n.tidied((top["lambda3"] * top["spin"]) ** 2 - 4 * upward * fall)
    text, unit = "lambda3^2*omega3^2 - 4*lambda1*cos(theta)*M*g*R", "kg^2 m^4/s^2"
    rates = [
        Field("", top[f"{word}_rate"], word, rf"\Omega_\mathrm{{{word}}}", "rad/s")
        for word in ("slow", "fast")
        if top[f"{word}_rate"] is not None
    ]
    return Step(
        "Steady precession",
        "At a constant tilt, Omega is a root of this quadratic. The roots are real where the discriminant is "
        "not negative.",
        (
            filled("lambda1*cos(theta)*Omega^2 - lambda3*omega3*Omega + M*g*R", n, **numbers),
            *law(text, "discriminant", "D", discriminant, unit, n, **numbers),
            *rates,
        ),
    )


def _nutation(section: Top, top: Mapping[str, Value], n: Arithmetic) -> Step:
    """The cubic in u = cos(theta), and its turning points; for floats only."""
    start = top["slow_rate"] if section.precession is None else section.precession
    cosine, sine = precession.cosine(top["tilt"], n), precession.sine(top["tilt"], n)
    a = top["lambda3"] * top["spin"] / top["lambda1"]
    beta = 2 * top["mass"] * top["gravity"] * top["distance"] / top["lambda1"]
    b = sine**2 * start + a * cosine
    alpha = section.nutation**2 + sine**2 * start**2 + beta * cosine
    cubic = filled("(1 - u^2)*(alpha - beta*u) - (b - a*u)^2", n, alpha=alpha, beta=beta, a=a, b=b)
    limits = (("theta_max", "u1"), ("theta_min", "u2"))
    return Step(
        "Nutation",
        "With u = cos(theta), a = lambda3 omega3/lambda1, b = p_phi/lambda1, beta = 2 M g R/lambda1, and "
        "alpha from the energy, (du/dt)^2 is this cubic (Goldstein, section 5.7). The axis nutates between "
        "two of the roots.",
        (
            cubic,
            *(Field("", float(precession.cosine(top[key], n)), name, name, "") for key, name in limits),
            Field("", top["theta_min"], "least tilt", r"\theta_\mathrm{min}", "rad"),
            Field("", top["theta_max"], "greatest tilt", r"\theta_\mathrm{max}", "rad"),
        ),
    )


def _free(free: Mapping[str, Value], n: Arithmetic) -> Iterator[Step]:
    if "body_rate" not in free:
        yield Step(
            "Free motion",
            "The three moments differ. omega moves along the polhode, on which T and L are constant, with a "
            "period that is an elliptic integral.",
            (
                Field("", free["angular_momentum"], "angular momentum", "L", "kg m^2/s"),
                Field("", free["kinetic_energy"], "kinetic energy", "T", "J"),
            ),
        )
        return
    yield Step(
        "Free motion",
        "Across the symmetry axis both moments are lambda1, and Euler's equations are linear: omega turns "
        "about e3 in the body at (lambda3 - lambda1)/lambda1 omega3, and e3 about L in space at L/lambda1.",
        (
            Field("", free["moments"], "principal moments", r"\lambda_{1,2,3}", "kg m^2", counts=True),
            Field("", free["body_rate"], "omega about e3", r"\Omega_\mathrm{body}", "rad/s"),
            Field("", free["angular_momentum"], "L", "L", "kg m^2/s"),
            Field("", free["space_rate"], "L/lambda1", r"L/\lambda_1", "rad/s"),
        ),
    )


def _tide(section: Tide, tide: Mapping[str, Value], n: Arithmetic) -> Iterator[Step]:
    bulge: Any = section.ellipticity
    if section.moments is not None:
        bulge = precession.ellipticity(section.moments)
    numbers = {"H": bulge, "epsilon": section.obliquity, "omega": section.spin}
    fields: list[Field] = []
    for place, perturber in enumerate(section.perturbers, 1):
        gm: Any = perturber.gm
        if perturber.mass is not None:
            gm = precession.gravitational_parameter(perturber.mass)
        fields.append(
            filled(
                "3/2*mu/(a^3*(1 - e^2)^(3/2))*(1 - 3/2*sin(i)^2)*H*cos(epsilon)/omega",
                n,
                perturber.name or str(place),
                mu=gm,
                a=perturber.distance,
                e=perturber.eccentricity,
                i=perturber.inclination,
                **numbers,
            )
        )
    yield Step(
        "Precession by tides",
        "A perturber with G m = mu at the distance a pulls at the bulge H = (C - A)/C. On average over the "
        "orbit, it turns the axis at 3/2 mu/(a^3 (1 - e^2)^(3/2)) (1 - 3/2 sin(i)^2) H cos(epsilon)/omega.",
        (*fields, Field("", tide["rate"], "sum", r"\dot\psi", "rad/s")),
    )
