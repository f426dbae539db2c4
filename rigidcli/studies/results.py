"""The results of the studies: their names in JSON, and what people see of them. Values are for the studies.

A result is added here, and gets its value in its study. `title`, `symbol` and `unit` stand in tables; `means`
says more than fits there, or what a result is that no table shows.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rigidcli.report import Field, Value

_ENTRIES = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}

INERTIA = (
    Field("mass", None, "mass", "M", "kg", {"mass": ()}),
    Field(
        "center_of_mass",
        None,
        "centre of mass",
        r"\mathbf{R}",
        "m",
        {f"com_{axis}": (index,) for index, axis in enumerate("xyz")},
        means="null where a tensor without a mass is given about another point",
    ),
    Field("about", None, "about the point O", r"\mathbf{O}", "m", means="the coordinates of O"),
    Field(
        "tensor",
        None,
        "inertia tensor about O",
        r"\mathbf{I}_O",
        "kg m^2",
        {f"I{name}": place for name, place in _ENTRIES.items()},
        means="3 by 3; off the diagonal stand products of inertia, -sum m x y",
    ),
    Field("tensor_com", None, "about the centre of mass", r"\mathbf{I}_\mathrm{cm}", "kg m^2"),
    Field(
        "integration_error",
        None,
        "error of integration",
        diagnostic=True,
        means="estimated for a density that varies, relative to the mass; left out where none does",
    ),
)
"""The results of `inertia`, with which `axes` begins, all along the axes of `frame`."""

AXIS = (
    Field("axis_moment", None, "moment about the axis", "I", "kg m^2", {"axis_moment": ()}),
    Field("radius_of_gyration", None, "its radius of gyration", "k", "m", means="the root of moment/mass"),
)
"""The results of `inertia` and `axes` where the document has an `axis`."""

ROTOR = (
    Field(
        "rotor",
        None,
        "rotor",
        cells={"rotor": ()},
        means="the class of the molecule; moments that differ by the rounding of coordinates are equal here",
    ),
    *(
        Field(
            f"{key}.{letter}",
            None,
            f"rotational constant {letter}",
            letter if unit == "GHz" else rf"\tilde{{{letter}}}",
            unit,
            {f"{letter}_GHz": ()} if unit == "GHz" else {},
            means="A >= B >= C; null where there is no moment about that axis",
        )
        for key, unit in (("rotational_constants_ghz", "GHz"), ("rotational_constants_per_cm", "1/cm"))
        for letter in "ABC"
    ),
    Field(
        "asymmetry_parameter",
        None,
        "Ray's asymmetry parameter",
        r"\kappa",
        cells={"kappa": ()},
        means="(2 B - A - C)/(A - C): -1 of a prolate, 1 of an oblate rotor",
    ),
)
"""The results of `axes` for a molecule, about its centre of mass."""

MESH = (
    Field("mesh.triangles", None, "triangles of the mesh"),
    Field(
        "mesh.components",
        None,
        "its parts that hang together",
        means="null for a mesh of more than 300,000 triangles, where counting them would take too long",
    ),
    Field(
        "mesh.watertight",
        None,
        "watertight",
        means="whether it is closed, after `repair` if that is asked for",
    ),
    Field(
        "mesh.winding",
        None,
        "winding",
        means="as the file has it: outward, or inward and turned; null if open",
    ),
    Field("mesh.volume", None, "volume", "V", "m^3", means="that inside; null if the mesh is open"),
    Field("mesh.area", None, "area", "A", "m^2"),
    Field(
        "mesh.bounding_box",
        None,
        "bounding box (rows)",
        "",
        "m",
        means="least and largest x, y and z in the file",
    ),
    Field("mesh.unit", None, "unit of the file", means="that of `scale`; else a guess by the size"),
)
"""The results of `inertia` and `axes` of a body that is a mesh, along the axes of its file."""

AXES = (
    *INERTIA,
    Field(
        "moments",
        None,
        "principal moments",
        r"\lambda_{1,2,3}",
        "kg m^2",
        {f"lambda{k + 1}": (k,) for k in range(3)},
        counts=True,
        means="lambda1, lambda2, lambda3, ascending",
    ),
    Field(
        "axes",
        None,
        "principal axes (rows)",
        r"\mathbf{e}_{1,2,3}",
        cells={f"e{k + 1}{axis}": (k, j) for k in range(3) for j, axis in enumerate("xyz")},
        means="rows e1, e2, e3: unit vectors, right-handed, in the order of the moments",
    ),
    Field("groups", None, means="indices of equal moments, from 0: [[0], [1, 2]] says lambda2 = lambda3"),
    Field(
        "class",
        None,
        "class",
        cells={"class": ()},
        means="point, linear, spherical, oblate, prolate or asymmetric: of the tensor about O",
    ),
    Field("residual", None, means="the largest |I e - lambda e|, in units of lambda3"),
    Field(
        "omega",
        None,
        "angular velocity",
        r"\boldsymbol{\omega}",
        "rad/s",
        {f"w{k + 1}": (k,) for k in range(3)},
    ),
    Field(
        "angular_momentum",
        None,
        "angular momentum about O",
        r"\mathbf{L}",
        "kg m^2/s",
        {f"L{k + 1}": (k,) for k in range(3)},
    ),
    Field("kinetic_energy", None, "kinetic energy", "T", "J", {"T": ()}, means="T = omega.L/2"),
    Field(
        "angle",
        None,
        "angle between omega and L",
        r"\angle(\boldsymbol{\omega}, \mathbf{L})",
        "rad",
        {"angle": ()},
        means="null where omega or L is zero",
    ),
    Field("wobbles", None, "wobbles when left alone", means="whether omega x L differs from zero"),
    Field(
        "holding_torque",
        None,
        "torque that holds omega",
        r"\boldsymbol{\omega}\times\mathbf{L}",
        "N m",
        means="omega x L: what keeps omega as it is",
    ),
    *AXIS,
    *MESH,
    *ROTOR,
)
"""The results of `axes`; those from `omega` on are there with it, an `axis`, a mesh or a molecule."""

SECTIONS: dict[str, tuple[Field, ...]] = {
    "top": (
        Field("mass", None, "mass", "M", "kg"),
        Field("distance", None, "from pivot to centre of mass", "R", "m"),
        Field("lambda1", None, "moment across the axis", r"\lambda_1", "kg m^2"),
        Field("lambda3", None, "moment about the axis", r"\lambda_3", "kg m^2"),
        Field("spin", None, "spin", r"\omega_3", "rad/s"),
        Field("tilt", None, "tilt", r"\theta", "rad"),
        Field("gravity", None, "gravity", "g", "m/s^2"),
        Field("torque", None, "torque, leaning towards x", r"\boldsymbol{\Gamma}", "N m", counts=True),
        Field("torque_magnitude", None, "its magnitude", r"\Gamma", "N m"),
        Field("gyroscopic_rate", None, "gyroscopic precession", r"M g R/\lambda_3\omega_3", "rad/s"),
        Field("gyroscopic_period", None, "its period", "", "s"),
        Field("gyroscopic_error", None, "its error, as the top is not infinitely fast"),
        Field("slow_rate", None, "slow steady precession", r"\Omega_\mathrm{slow}", "rad/s"),
        Field("fast_rate", None, "fast steady precession", r"\Omega_\mathrm{fast}", "rad/s"),
        Field("minimum_spin", None, "least spin for steady precession", r"\omega_\mathrm{min}", "rad/s"),
        Field("sleeping_spin", None, "least spin to sleep upright", r"\omega_\mathrm{sleep}", "rad/s"),
        Field("sleeping", None, "upright"),
        Field("sleeping_growth_rate", None, "growth of its fall from upright", "", "1/s"),
        Field("sleeping_frequencies", None, "rates of its wobble upright", "", "rad/s", counts=True),
        Field("theta_min", None, "least tilt", r"\theta_\mathrm{min}", "rad"),
        Field("theta_max", None, "greatest tilt", r"\theta_\mathrm{max}", "rad"),
        Field("phi_dot_at_theta_min", None, "precession at the least tilt", "", "rad/s"),
        Field("phi_dot_at_theta_max", None, "precession at the greatest tilt", "", "rad/s"),
        Field("nutation_period", None, "period of nutation", "", "s"),
        Field("precession_per_nutation", None, "precession in a nutation", r"\Delta\phi", "rad"),
        Field("mean_precession_rate", None, "mean precession", r"\overline{\dot\phi}", "rad/s"),
        Field("nutation_kind", None, "nutation"),
    ),
    "free": (
        Field("moments", None, "principal moments about O", r"\lambda_{1,2,3}", "kg m^2", counts=True),
        Field("angular_momentum", None, "angular momentum", "L", "kg m^2/s"),
        Field("kinetic_energy", None, "kinetic energy", "T", "J"),
        Field("body_rate", None, "omega about e3 in the body", r"\Omega_\mathrm{body}", "rad/s"),
        Field("body_period", None, "its period", "", "s"),
        Field("space_rate", None, "e3 about L in space", r"\Omega_\mathrm{space}", "rad/s"),
        Field("space_period", None, "its period", "", "s"),
        Field("spin_rate", None, "spin about e3 besides", r"\dot\psi", "rad/s"),
        Field("wobble_to_spin_ratio", None, "wobble to spin"),
        Field("body_cone_angle", None, "angle between omega and e3", "", "rad"),
        Field("space_cone_angle", None, "angle between omega and L", "", "rad"),
        Field("axis_angle", None, "angle between e3 and L", r"\theta", "rad"),
        Field("polhode_period", None, "period of omega in the body", r"\tau", "s"),
        Field("flip_interval", None, "time between flips", r"\tau/2", "s"),
        Field("mean_space_rate", None, "mean rate about L", r"\overline{\dot\phi}", "rad/s"),
        Field("mean_space_period", None, "its period", "", "s"),
    ),
    "tide": (
        Field("rate", None, "precession, retrograde", r"\dot\psi", "rad/s"),
        Field("rate_arcsec_per_year", None, "in seconds of arc a Julian year", "", "arcsec/yr"),
        Field("period_years", None, "its period in Julian years", "", "yr"),
    ),
}
"""The results of each section of a document, still without values, in the order in which they are shown.

A vector, each of whose entries `counts` by itself, has no column in CSV.
"""

MEANS = {
    "torque": "of the weight about the pivot, along the space axes, with the top leaning towards +x",
    "torque_magnitude": "of the torque: M g R sin(tilt)",
    "gyroscopic_rate": "of a fast top, signed: M g R/(lambda3 spin)",
    "gyroscopic_period": "of gyroscopic precession: 2 pi/|rate|",
    "gyroscopic_error": "of the gyroscopic rate against the slow steady one, relative",
    "slow_rate": "exact, and signed; null where the top is too slow to precess steadily",
    "fast_rate": "exact, and signed; the other root of the same equation",
    "minimum_spin": "at this tilt; 0 where the top can precess steadily at any spin",
    "sleeping_spin": "2 sqrt(M g R lambda1)/lambda3",
    "sleeping": "stable, unstable or marginal: the top that spins upright",
    "sleeping_growth_rate": "null where it is stable",
    "sleeping_frequencies": "the two of small motion about upright; null where that is unstable",
    "theta_min": "of the tilt from the vertical, in the nutation that follows from the initial rates",
    "theta_max": "of the tilt from the vertical, in the nutation that follows from the initial rates",
    "phi_dot_at_theta_min": "the rate of phi where the axis turns back",
    "phi_dot_at_theta_max": "the rate of phi where the axis turns back",
    "nutation_period": "the time from one least tilt to the next",
    "precession_per_nutation": "the angle by which phi grows in one period of nutation",
    "mean_precession_rate": "precession in a nutation, over its period",
    "nutation_kind": "looping, cuspidal, wavy, steady or none",
    "body_rate": "as seen in the body, signed: (lambda3 - lambda1) omega3/lambda1",
    "body_period": "of omega about e3 in the body",
    "space_rate": "L/lambda1, for a symmetric body",
    "space_period": "of e3 about L in space",
    "spin_rate": "psi-dot: of the body about e3, besides its turning about L",
    "wobble_to_spin_ratio": "space_rate/|omega3|: how often e3 goes round in one turn of the body",
    "body_cone_angle": "half the opening of the body cone",
    "space_cone_angle": "half the opening of the space cone",
    "axis_angle": "constant in free precession",
    "polhode_period": "of an asymmetric body",
    "flip_interval": "half the period of omega: of an asymmetric body",
    "mean_space_rate": "the mean precession of an asymmetric body",
    "mean_space_period": "of the mean turning about L",
    "rate": "the sum over all perturbers, positive; it is retrograde where C > A",
    "period_years": "years of 365.25 days; null where the rate is 0",
}
"""What results of the sections mean besides, by their keys."""

TRAJECTORY = tuple(
    Field(
        f"trajectory.{key}",
        None,
        title,
        symbols,
        unit,
        {cell: (k,) for k, cell in enumerate(cells.split())},
        means=means,
    )
    for key, title, symbols, unit, cells, means in (
        ("t", "time", "t", "s", "t", ""),
        (
            "omega",
            "angular velocity",
            r"\omega_{1}, \omega_{2}, \omega_{3}",
            "rad/s",
            "w1 w2 w3",
            "along the axes of the body, as the document or its `frame` has them",
        ),
        ("angular_momentum", "angular momentum", "L_{1}, L_{2}, L_{3}", "kg m^2/s", "L1 L2 L3", "as omega"),
        ("kinetic_energy", "kinetic energy", "T", "J", "T", "T = omega.L/2"),
        (
            "orientation",
            "orientation",
            "q_{0}, q_{1}, q_{2}, q_{3}",
            "",
            "q0 q1 q2 q3",
            "the unit quaternion that turns from the body to space; q0 is its scalar",
        ),
        (
            "angular_momentum_space",
            "angular momentum in space",
            "L_{x}, L_{y}, L_{z}",
            "kg m^2/s",
            "Lx Ly Lz",
            "along the axes of space",
        ),
        (
            "angles",
            "Euler angles",
            r"\phi, \theta, \psi",
            "rad",
            "phi theta psi",
            "of a top, or in the sequence that `motion.angles` names",
        ),
    )
)
"""The samples of `euler`: each with its columns, and with the symbol of each column."""

EULER = (
    Field(
        "moments",
        None,
        "principal moments about O",
        r"\lambda_{1,2,3}",
        "kg m^2",
        {f"lambda{k + 1}": (k,) for k in range(3)},
        counts=True,
        means="ascending",
    ),
    Field("axes", None, "principal axes e1, e2, e3 (rows)", r"\mathbf{e}_{1,2,3}"),
    Field("angular_momentum", None, "angular momentum", "L", "kg m^2/s", means="its magnitude at t = 0"),
    Field("kinetic_energy", None, "kinetic energy", "T", "J", means="at t = 0"),
    Field("motion", None, "motion", means="its kind, such as principal, oblate, separatrix, driven"),
    Field("period", None, "period of omega in the body", r"\tau", "s", means="null if none or infinite"),
    Field("flip_interval", None, "time between flips", r"\tau/2", "s"),
    Field("turns_per_flip", None, "turns about L between flips"),
    Field("mean_space_rate", None, "mean rate about L", r"\overline{\dot\phi}", "rad/s"),
    Field(
        "stability",
        None,
        means="for each principal axis its moment, whether rotation about it is stable, and the rate",
    ),
    Field("method", None, "method", diagnostic=True, means="closed form, or the integrator"),
    Field("steps", None, diagnostic=True, means="steps of numerical integration"),
    Field("trusted_digits", None, "digits of the orientation to trust"),
    Field("drift.energy", None, "drift of the energy balance", diagnostic=True, means="relative"),
    Field("drift.angular_momentum", None, "drift of the angular momentum", diagnostic=True, means="relative"),
    Field("drift.quaternion", None, diagnostic=True, means="how far the quaternion is from a unit one"),
    Field("trajectory", None, means="samples in time: omega, L and T in the body, orientation, L in space"),
    *TRAJECTORY,
)
"""The results of `euler`."""

HAMILTON = (
    Field("coordinates", None, means="names of the coordinates"),
    Field("velocities", None, means="names of their velocities"),
    Field("momenta", None, means="names of their momenta"),
    Field("lagrangian", None, "Lagrangian", "L"),
    Field("momentum_definitions", None, means="each momentum as dL/d(velocity)"),
    Field("velocity_solutions", None, means="each velocity in coordinates and momenta"),
    Field("hamiltonian", None, "Hamiltonian", "H", means="null where the velocities have no closed form"),
    Field(
        "equations", None, means="Hamilton's equations: the time derivative of each coordinate and momentum"
    ),
    Field("matrix", None, symbol="A", means="A of z' = A z + offset, where the equations are linear"),
    Field("offset", None, symbol=r"\mathbf{b}", means="what linear equations have besides A z"),
    Field("eigenvalues", None, means="those of the matrix"),
    Field(
        "frequencies",
        None,
        "frequencies",
        r"\omega",
        "rad/s",
        means="angular frequencies of the linear motion",
    ),
    Field("stability", None, "stability", means="of linear equations: stable, marginal or unstable"),
    Field("cyclic", None, "cyclic coordinates", means="coordinates that H does not contain"),
    Field("conserved", None, "conserved", means="names of conserved momenta, and H if it is conserved"),
    Field("explicit_time", None, means="whether H contains t"),
    Field("dH_dt", None, "dH/dt", r"\frac{\mathrm{d}H}{\mathrm{d}t}"),
    Field("natural", None, "natural coordinates", means="whether positions depend on them without t"),
    Field("natural_reason", None, means="why they are natural, or not"),
    Field(
        "lagrange_equations", None, means="for each coordinate an expression that vanishes along the motion"
    ),
    Field("accelerations", None, means="the second derivative of each coordinate"),
    Field("equilibrium", None, means="the coordinates about which small oscillations are told"),
    Field(
        "modes",
        None,
        means="{rate, frequency, period, vector, stable}; the rate is angular (rad/s), or growth (1/s)",
    ),
    Field("energy", None, symbol="T + V", means="the energy T + V in coordinates and momenta"),
    Field("h_equals_energy", None, "H = T + V", means="true, false, or null where it is not known"),
    Field(
        "verified",
        None,
        "residual of the equations of motion",
        diagnostic=True,
        means="against Euler-Lagrange, at random points",
    ),
    Field("invariants", None, "conserved, too", means="further conserved expressions"),
    Field("branches", None, means="solutions for the velocities, where there are several"),
    Field("transform.canonical", None, "canonical change of variables"),
    Field("transform.conditions", None, means='where it is canonical, and K holds: ["w > 0"]'),
    Field("transform.brackets", None, means="Poisson brackets of the new variables that are wrong"),
    Field("transform.hamiltonian", None, "new Hamiltonian", "K"),
    Field("transform.equations", None, means="Hamilton's equations in the new variables"),
    Field("orbit.method", None, "method", diagnostic=True),
    Field("orbit.steps", None, diagnostic=True, means="steps of numerical integration"),
    Field("orbit.trusted_digits", None, "digits of the orbit to trust"),
    Field("orbit.drift", None, means="relative drift of what is conserved"),
    Field("orbit.t", None, unit="s", means="the times of the samples"),
    Field("orbit.q", None, means="the coordinates at these times, by their names"),
    Field("orbit.p", None, means="the momenta at these times, by their names"),
    Field("orbit.H", None, means="the Hamiltonian at these times"),
)
"""The results of `hamilton`; those of `transform` and `orbit` need these sections in the document."""

ROW = {
    "euler": (
        *("angular_momentum", "kinetic_energy", "motion", "period", "flip_interval", "turns_per_flip"),
        *("mean_space_rate", "method", "steps", "trusted_digits"),
        *("drift.energy", "drift.angular_momentum", "drift.quaternion"),
    ),
    "hamilton": (
        *("stability", "explicit_time", "natural", "h_equals_energy"),
        *("orbit.method", "orbit.steps", "orbit.trusted_digits"),
    ),
}
"""Scalars that are columns of CSV under their own keys, where a row is a document and not a sample."""


def _with_columns(study: str, fields: tuple[Field, ...]) -> tuple[Field, ...]:
    return tuple(
        replace(field, cells={field.key: ()}) if field.key in ROW[study] else field for field in fields
    )


RESULTS: dict[str, tuple[Field, ...]] = {
    "inertia": (*INERTIA, *AXIS, *MESH),
    "axes": AXES,
    "precess": (
        *(
            replace(field, key=f"{section}.{field.key}", means=MEANS.get(field.key, field.means))
            for section, fields in SECTIONS.items()
            for field in fields
        ),
        Field(
            "top.complex_roots",
            None,
            means="where there is no steady precession: the roots, {re, im}",
            unit="rad/s",
        ),
        Field("tide.perturbers", None, means="the rate that each perturber causes"),
    ),
    "euler": _with_columns("euler", EULER),
    "hamilton": _with_columns("hamilton", HAMILTON),
}
"""The results of each study, by the name of its command."""


_BY_KEY = {(study, field.key): field for study, fields in RESULTS.items() for field in reversed(fields)}


def told(study: str, key: str, value: Value, /, words: str = "", **changes: Any) -> Field:
    """The result of a study with its value, words for it, and what else is different about it this time."""
    field = _BY_KEY[study, key].with_value(value, words)
    return replace(field, **changes) if changes else field
