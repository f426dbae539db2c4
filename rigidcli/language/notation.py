"""The table of readings: what people type, and what it usually means, the most usual first."""

from __future__ import annotations

from typing import Literal, NamedTuple


class Notation(NamedTuple):
    """A text that people type, with its usual `readings` in the order in which they are tried.

    In a document the `first` is taken, or the one that `fits` its names and dimensions; of several that fit
    none is.
    """

    typed: str
    readings: tuple[str, ...]
    document: Literal["first", "fits", "answers only"] = "first"


NOTATION = (
    Notation("1/2 k x^2", ("(1/2) k x^2",)),
    Notation("½kx²", ("(1/2) k x^2",)),
    Notation("p^2/2m", ("p^2/(2 m)", "(p^2/2) m"), "fits"),
    Notation("g/Ml", ("g/(M l)", "(g/M) l"), "fits"),
    Notation("k/m x", ("(k/m) x", "k/(m x)"), "fits"),
    Notation("(g/l)^1/2", ("(g/l)^(1/2)", "((g/l)^1)/2"), "fits"),
    Notation("e^-k t", ("exp(-k t)", "exp(-k) t"), "answers only"),
    Notation("sqrt g/l", ("sqrt(g/l)", "sqrt(g)/l"), "fits"),
    Notation("√2 x", ("sqrt(2) x", "sqrt(2 x)"), "answers only"),
    Notation("sin2θ", ("sin(2 theta)",)),
    Notation("sin θ/2", ("sin(theta/2)", "sin(theta)/2"), "fits"),
    Notation("cos ωt", ("cos(omega t)",)),
    Notation(r"\cos^22\theta", ("cos(2 theta)^2",)),
    Notation("cos θ^2", ("cos(theta^2)", "cos(theta)^2"), "fits"),
    Notation("acos(θ)", ("a cos(theta)", "acos(theta)"), "answers only"),
    Notation("arccos(x)", ("acos(x)",)),
    Notation("tg(x)", ("tan(x)", "t g x")),
    Notation("mgz", ("m g z",)),
    Notation("sin 30°", ("sin(30 pi/180)",)),
    Notation("|x|", ("abs(x)",)),
    Notation("dot(x)", ("xdot",)),
    Notation(r"\frac{p^2}{2m}", ("p^2/(2 m)",)),
)
"""Formulas."""

QUANTITIES = (
    Notation("1,234", ("1.234", "1234"), "answers only"),
    Notation("1 234,5", ("1234.5",), "answers only"),
    Notation("125 000", ("125000",), "answers only"),
    Notation("21 rads^-1", ("21 rad^-1", "21 rad s^-1"), "fits"),
    Notation("3 ms⁻²", ("3 ms^-2", "3 m s^-2"), "fits"),
    Notation("21 rad/s = 201 rpm", ("201 rpm; the members before it must be equal",), "answers only"),
)
"""Numbers and units, of which the one that fits the dimension is taken."""
