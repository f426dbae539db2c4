"""`precess`: tops under their weight, free precession, and the precession that tides drive."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from rigidcli.core import free_body, precession
from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.core.principal import body_class
from rigidcli.document.document import Document
from rigidcli.document.motion import Motion, Tide, Top
from rigidcli.errors import DocumentError, Problem, RigidError
from rigidcli.report import Column, Field, Report, Table, Value
from rigidcli.scene import Scene
from rigidcli.studies.body import lost_digits, principal_omega, require_one_start, require_spin
from rigidcli.studies.common import RESULTS, field_of, if_known, report, worked
from rigidcli.studies.pictures import drawn

UPRIGHT = math.radians(2)  # the largest tilt (rad) at which people ask whether the top sleeps
# The keys of results of the nutation that have a shorter name in `core`.
NUTATION = {"kind": "nutation_kind", "period": "nutation_period", "mean_rate": "mean_precession_rate"}
Sections: TypeAlias = dict[str, dict[str, Value]]  # results by section and key
# By section, the results that are no tables, and the field that stands for each where the document lacks the
# section: its columns of CSV are empty.
_COLUMNS: dict[str, dict[str, Field]] = {}
for _entry in RESULTS["precess"]:
    if _entry.title:
        _section, _, _key = _entry.key.partition(".")
        _COLUMNS.setdefault(_section, {})[_key] = Field("", None, unit=_entry.unit, cells=_entry.cells)


@np.errstate(over="ignore", invalid="ignore")
def run(
    document: Document, *, steps: bool = False, picture: str | None = None, scene: bool = False
) -> Report:
    """Find the precession of the document's top, free body and planet.

    Raises DocumentError for a document with none of them, or with an ensemble of angular velocities.
    """
    require_one_start(document, "precess")
    sections: Sections = {}
    notes: list[str] = []
    tables: list[Table] = []
    if document.top is not None:
        sections["top"] = _top(document, document.top, notes, tables)
    if document.body is not None and document.motion is not None and document.motion.omega is not None:
        sections["free"] = _free(document, document.motion, notes)
    if document.tide is not None:
        sections["tide"] = _tide(document.tide, document.arithmetic, notes, tables)
    if not sections:
        problem = "nothing here precesses, expected a `top`, a `tide`, or a `body` with `motion.omega`"
        raise DocumentError([Problem(document.source, problem)])
    working = worked("precess", steps, document, sections)
    pictures = drawn("precess", picture, document, sections)
    result = report(document, "precess", _fields(sections), notes, tables, working, pictures)
    return replace(result, scene=_scene(document)) if scene else result


def _scene(document: Document) -> Scene | None:
    """The motion that precesses, as `euler` follows it; None where it has letters, or cannot be followed."""
    if document.arithmetic.exact or (document.top is None and document.body is None):
        return None
    from rigidcli.studies.euler import run as follow

    if document.top is None and document.motion is not None and document.motion.torque is not None:
        free = document.motion.model_copy(update={"torque": None})
        document = document.model_copy(update={"motion": free})
    try:
        scene: Scene | None = follow(document, scene=True).scene
    except RigidError:
        return None
    return scene


def _fields(sections: Sections) -> Iterator[Field]:
    """All results: the columns of CSV are empty for a section that the document lacks."""
    for section, missing in _COLUMNS.items():
        values = sections.get(section)
        if values is None:
            yield from missing.values()
            continue
        for key in missing:
            field = if_known(field_of("precess", f"{section}.{key}", values.get(key)))
            if key == "minimum_spin" and values.get("slow_rate") is not None:
                field.diagnostic = True  # it is of interest where the top is too slow
            elif key == "sleeping" and isinstance(tilt := values.get("tilt"), float):
                field.diagnostic = tilt > UPRIGHT
            yield field


def _top(document: Document, section: Top, notes: list[str], tables: list[Table]) -> dict[str, Value]:
    """Gyroscopic precession, and where `tilt` and `lambda1` are given, steady precession and nutation."""
    n, top = document.arithmetic, document.physical.heavy_top
    require_spin(document, section, top)
    fall = top.mass * section.gravity * top.distance
    unknown = [key for key, value in (("tilt", section.tilt), ("lambda1", top.lambda1)) if value is None]
    if n.sign(section.spin) == 0 and unknown:
        raise document.refusal(
            "read zero, and without spin the gyroscopic formula has no meaning",
            "top.spin",
            hint="give `tilt` and `lambda1` for the swing of the top",
        )
    notes += top.remarks
    if document.body is not None:
        notes += lost_digits("lambda3", top.lambda3, top.axis, document.physical.tensor)
    notes += [f"`top.{key}` is not given: results that depend on it are missing" for key in unknown]
    rate = precession.gyroscopic_rate(top.lambda3, section.spin, fall, n)
    values: dict[str, Value] = {
        **{key: getattr(top, key) for key in ("mass", "distance", "lambda1", "lambda3")},
        **{key: getattr(section, key) for key in ("spin", "tilt", "gravity")},
        "gyroscopic_rate": rate,
        "gyroscopic_period": None if rate is None else precession.period(rate, n),
    }
    if section.tilt is not None:
        torque = fall * precession.sine(section.tilt, n)
        values["torque"] = n.tidy(n.array([0, torque, 0]))
        values["torque_magnitude"] = torque
    if top.lambda1 is not None:
        sleeping = precession.sleeping(top.lambda1, top.lambda3, section.spin, fall, n)
        values |= {
            "sleeping_spin": sleeping.threshold,
            "sleeping": sleeping.stability,
            "sleeping_growth_rate": sleeping.growth_rate,
            "sleeping_frequencies": None if sleeping.frequencies is None else n.array(sleeping.frequencies),
        }
    if section.tilt is not None and top.lambda1 is not None:
        given = (top.lambda1, top.lambda3, section.spin, section.tilt)
        values |= _at_tilt(section, given, fall, n, notes, tables)
    return values


def _at_tilt(
    section: Top,
    top: tuple[Scalar, Scalar, Scalar, Scalar],
    fall: Scalar,
    n: Arithmetic,
    notes: list[str],
    tables: list[Table],
) -> dict[str, Value]:
    """Steady precession of a `top` (lambda1, lambda3, spin, tilt), and nutation from its initial rates."""
    steady = precession.steady(*top, fall, n)
    values: dict[str, Value] = {
        "slow_rate": steady.slow,
        "fast_rate": steady.fast,
        "minimum_spin": steady.minimum_spin,
    }
    if steady.complex_roots:
        real, imaginary = ([root[part] for root in steady.complex_roots] for part in (0, 1))
        parts = {"re": real, "im": imaginary}
        columns = tuple(Column(key, part, (key,), "rad/s", hidden=True) for key, part in parts.items())
        tables.append(Table("top.complex_roots", "", columns, records=True))
        notes.append("the top is too slow for steady precession: it does not precess at the gyroscopic rate")
    if n.exact:
        notes.append("nutation needs elliptic integrals, which have no exact form: give numbers for it")
        return values
    start = steady.slow if section.precession is None else section.precession
    if start is None:
        notes.append("there is no steady precession to begin with: the nutation is not worked out")
        return values
    from rigidcli.core.nutation import nutation

    swinging = nutation(*top, start, section.nutation, fall, section.precession is None)
    return values | {NUTATION.get(key, key): value for key, value in swinging._asdict().items()}


def _free(document: Document, motion: Motion, notes: list[str]) -> dict[str, Value]:
    n, frame = document.arithmetic, document.physical.frame
    omega = principal_omega(document, frame)
    momentum = n.tidy(frame.moments * omega)
    values: dict[str, Value] = {
        "moments": frame.moments,
        "angular_momentum": n.hypot(*momentum),
        "kinetic_energy": n.tidied(omega @ momentum / 2),
    }
    if motion.torque is not None:
        notes.append("the free precession is that of the body without the torque")
    least = document.physical.axes @ frame.axes[0]
    notes += lost_digits("lambda1", frame.moments[0], least, document.physical.tensor)
    if body_class(frame) == "point":
        notes.append("the body is a point, which has no precession")
        return values
    alone = [group[0] for group in frame.groups if len(group) == 1]
    if len(alone) == 3:
        if n.exact:
            notes.append("the periods of an asymmetric body are elliptic integrals, which have no exact form")
            return values
        free = free_body.periods(np.diag(frame.moments), omega)
        rate = free.mean_space_rate
        return values | {
            "polhode_period": free.period,
            "flip_interval": free.flip_interval,
            "mean_space_rate": rate,
            "mean_space_period": 2 * math.pi / rate if rate else None,
        }
    # It is certain which moments are equal, also where their order depends on symbols.
    axis = alone[0] if alone else 2
    if axis == 0:
        notes.append("e3 here is the symmetry axis, which `axes` calls e1")
    spin, across = omega[axis], n.hypot(*(rate for place, rate in enumerate(omega) if place != axis))
    return values | precession.free(frame.moments[1], frame.moments[axis], spin, across, n)._asdict()


def _tide(tide: Tide, n: Arithmetic, notes: list[str], tables: list[Table]) -> dict[str, Value]:
    rates = []
    for one in tide.perturbers:
        orbit = (one.distance, one.eccentricity, one.inclination)
        rates.append(precession.tidal_rate(one.pull, *orbit, tide.bulge, tide.obliquity, tide.spin, n))
    total = n.tidied(sum(rates))
    names = [perturber.name or str(index) for index, perturber in enumerate(tide.perturbers, start=1)]
    yearly = [precession.arcseconds_per_year(rate, n) for rate in rates]
    columns = (
        Column("name", names, ("name",)),
        Column("rate", rates, ("rate",), "rad/s"),
        Column("rate_arcsec_per_year", yearly, ("in a Julian year",), "arcsec/yr"),
    )
    tables.append(Table("tide.perturbers", "precession by each perturber", columns, records=True))
    if n.sign(total) == 0:
        notes.append("the torques on the bulge have no mean effect, so that the period is infinite")
    return {
        "rate": total,
        "rate_arcsec_per_year": precession.arcseconds_per_year(total, n),
        "period_years": precession.period_in_years(total, n),
    }
