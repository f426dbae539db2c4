"""Molecules as rotors: rotational constants, asymmetry and kind, about the centre of mass."""

from __future__ import annotations

import math

import numpy as np

from rigidcli.core import principal
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.document.document import Document
from rigidcli.report import Field
from rigidcli.studies.common import if_known
from rigidcli.studies.results import field_of

# The Planck constant (J s), exact since 2019 (BIPM, The International System of Units, 9th edition).
PLANCK = 6.62607015e-34
LIGHT = 299_792_458.0  # the speed of light (m/s), exact
LARGEST_CONSTANT = 1e6  # a rotational constant (GHz) that no molecule has

ROTORS = {
    "point": "an atom: it has no rotation",
    "linear": "linear: B = C",
    "spherical": "spherical top: A = B = C",
    "oblate": "oblate symmetric top: A = B > C",
    "prolate": "prolate symmetric top: A > B = C",
    "asymmetric": "asymmetric top: A > B > C",
}


def rotor_fields(document: Document, rounding: float) -> tuple[tuple[Field, ...], tuple[str, ...]]:
    """The results for a molecule with coordinates that may be off by `rounding` (m), and notes on them.

    Rotational constants are h/(8 pi^2 I) as frequencies and h/(8 pi^2 c I) as wavenumbers (G. Herzberg,
    Infrared and Raman Spectra, chapter I), and kappa is that of B. S. Ray, Z. Physik 78 (1932) 74.
    """
    body = document.physical.properties
    assert body.mass is not None
    mass, moments = float(body.mass), principal.principal_frame(body.tensor).moments
    kind, notes = _kind(moments, mass, rounding), []
    spread = math.sqrt(moments.sum() / 2 / mass)
    if document.about == "origin" and FLOAT.hypot(*body.com) > 1e-3 * spread:
        notes.append(
            "moments, axes and class are about the origin, rotational constants about the centre of mass; "
            "`--set about=com` gives all of them about the centre of mass"
        )
    is_line = kind in ("point", "linear")
    if is_line and moments[0] > 0:
        size = f"{moments[0] / moments[2]:.1g}"
        notes.append(f"the moment about the line counts as none: {size} of the others may be rounding")
    for place, (pair, other) in enumerate((("A and B", "oblate"), ("B and C", "prolate"))):
        off = 1 - moments[place] / moments[place + 1] if kind in ("spherical", other) else 0.0
        if off > principal.EQUAL_MOMENTS:
            notes.append(f"{pair} count as equal: they differ by {off:.1g}, which may be rounding")
    fields = [field_of("axes", "rotor", kind, words=ROTORS[kind])]
    for key, per_hertz in (("ghz", 1e-9), ("per_cm", 0.01 / LIGHT)):
        for letter, moment in zip("ABC", moments, strict=True):
            is_known = moment > 0 and not (is_line and letter == "A")
            value = PLANCK / (8 * math.pi**2 * float(moment)) * per_hertz if is_known else None
            if key == "ghz" and value is not None and value > LARGEST_CONSTANT:
                notes.append(
                    f"{letter} is {value:.3g} GHz, and that of H2 is 1,824 GHz: are the places right?"
                )
            fields.append(if_known(field_of("axes", f"rotational_constants_{key}.{letter}", value)))
    kappa = None
    if kind in ("oblate", "prolate", "asymmetric"):
        a, b, c = moments[0] / moments  # as the constants are to each other
        kappa = float(((b - a) + (b - c)) / (a - c))
    return (*fields, if_known(field_of("axes", "asymmetry_parameter", kappa))), tuple(notes)


def _kind(moments: Floats, mass: float, rounding: float) -> principal.BodyClass:
    """The kind of rotor; moments are equal where the rounding of coordinates may be the difference.

    `moments` (3, kg m^2) are ascending and about the centre of mass. Where atoms at distances d move by at
    most e, no moment changes by more than the sum of m (2 d e + e^2), which the Cauchy-Schwarz inequality
    bounds; the moment about a line of atoms is at most the sum of m e^2.
    """
    if moments[2] == 0:
        return "point"
    moved = math.sqrt(3) * rounding
    if moments[0] <= mass * moved**2:
        return "linear"
    change = 2 * moved * math.sqrt(mass * moments.sum() / 2) + mass * moved**2
    lower, upper = (bool(gap <= 2 * change) for gap in np.diff(moments))
    if lower and upper:
        return "spherical"
    return "oblate" if lower else "prolate" if upper else "asymmetric"
