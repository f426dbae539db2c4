"""Words that people use for shapes and keys, and what a document calls these.

No such word is read as if it were the document's own: an answer to it names the right word, so that a file
looks alike whoever wrote it, and editors know its keys.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

from rigidcli.errors import ValueProblem, nearest, shown


def _by_word(rows: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """For each word of the right side the left sides in whose rows it stands."""
    found: dict[str, tuple[str, ...]] = {}
    for name, words in rows.items():
        for word in words.split():
            found[word] = (*found.get(word, ()), name)
    return found


SHAPES_BY_WORD = _by_word(
    {
        "box": "cuboid brick block parallelepiped rectangular_prism rect_prism bar beam slab plank board",
        "cube": "cuboid brick block die hexahedron",
        "sphere": "ball globe orb planet marble bead bullet",
        "hollow_sphere": "hollow_ball thick_shell spherical_layer",
        "ellipsoid": "egg spheroid oval rugby_ball football oblate_spheroid prolate_spheroid",
        "rod": "stick wire pole bar beam needle string line segment spoke pencil rope slender_rod",
        "cylinder": "stick pole bar wheel flywheel coin puck drum roller log solid_disk pencil",
        "tube": "pipe hollow_cylinder washer cylinder_hollow thick_ring bushing sleeve annular_cylinder",
        "frustum": "truncated_cone cone_frustum conical_frustum bucket",
        "hemisphere": "half_sphere semisphere half_ball dome",
        "spherical_cap": "cap ball_cap spherical_segment dome",
        "capsule": "pill stadium spherocylinder",
        "torus": "donut doughnut bagel tire tyre solid_ring",
        "spherical_shell": "shell bubble thin_sphere balloon soap_bubble",
        "hemispherical_shell": "bowl half_shell thin_hemisphere",
        "cylindrical_shell": "can thin_cylinder thin_tube thin_pipe",
        "conical_shell": "funnel thin_cone hollow_cone ice_cream_cone",
        "plate": "rectangle square sheet panel lamina card book door rectangular_plate slab",
        "disk": "disc circle circular_plate record",
        "annulus": "washer annular_disk annular_disc hollow_disk hollow_disc disk_with_hole",
        "half_disk": "half_disc semicircle semi_circle half_circle semidisk",
        "polygon": "pentagon hexagon octagon trapezoid trapezium parallelogram rhombus l_shape quadrilateral",
        "ring": "hoop loop circle_wire thin_ring wheel_rim rim circular_wire",
    }
)
"""The shapes for which a word may stand; of several the one that has the other keys is meant."""

OTHER_FORMS = {
    "points: [[1, 0, 0, 0]]": "point particle point_mass pointmass points mass_point molecule point_masses",
    "points: [[1, 0, 0, -1], [1, 0, 0, 1]]": "dumbbell dumb_bell barbell two_balls two_masses",
    "moments: [1, 2, 3]": "tensor inertia_tensor inertia rigid_body top gyroscope",
    "parts: [{shape: sphere, radius: 1, mass: 1}]": "composite compound union group assembly difference",
}
"""Words for what is no shape but another form of body: how it is written instead, and the words."""

RELATIVES = {
    "box": "cube",
    "cube": "box",
    "sphere": "hollow_sphere ellipsoid spherical_cap",
    "cylinder": "tube elliptic_cylinder frustum",
    "cone": "frustum",
    "plate": "box polygon",
    "disk": "annulus cylinder tube",
    "annulus": "tube disk",
    "rod": "cylinder box tube",
    "ring": "annulus torus tube cylinder",
}
"""Shapes that are easily taken for another one, which are meant where the keys are theirs."""

KEYS_BY_WORD = _by_word(
    {
        # dimensions
        "size": "side sides edge edges edge_length dimensions dims lengths extents length width depth height"
        " thickness breadth w h l",
        "side": "size edge edges sides edge_length length a",
        "radius": "r R radii outer_radius base_radius rad",
        "outer_radius": "radius r r_outer router outer r2 ro",
        "inner_radius": "r_inner rinner inner hole_radius r1 ri bore_radius",
        "major_radius": "R radius outer_radius ring_radius big_radius",
        "minor_radius": "r tube_radius inner_radius small_radius cross_section_radius a",
        "bottom_radius": "radius base_radius r1 lower_radius outer_radius",
        "top_radius": "r2 upper_radius inner_radius",
        "height": "length h l depth thickness width altitude",
        "length": "height h l len size extent",
        "semi_axes": "axes radii semiaxes radius abc half_axes size",
        "base": "size side base_size base_side",
        "vertices": "points corners vertex nodes",
        # bodies
        "shape": "type kind form geometry primitive solid object",
        "mass": "m weight masse total_mass",
        "density": "rho density_kg material",
        "position": "at center centre offset translate translation pos location origin place shift xyz",
        "rotation": "rotate orientation turn euler quaternion attitude",
        "axis": "direction along normal symmetry_axis",
        "points": "particles masses point_masses atoms",
        "mesh": "stl obj ply off cad surface triangles file",
        "scale": "unit units scaling scale_factor",
        "parts": "components pieces bodies objects shapes children elements",
        "inertia": "tensor inertia_tensor I moment_of_inertia",
        "moments": "principal_moments eigenvalues",
        "com": "center_of_mass centre_of_mass cm cog center centre",
        "Ixy": "Iyx",
        # the document
        "name": "title label id",
        "parameters": "params constants variables values symbols parameter const vars",
        "body": "bodies object solid rigid_body mass_body",
        "about": "pivot point origin fixed_point reference_point O",
        "frame": "axes basis rotation coordinate_system",
        "motion": "movement kinematics state",
        "top": "gyroscope gyro spinning_top",
        "system": "lagrangian_system mechanics",
        "orbit": "trajectory integrate simulation simulate solve",
        # motion, orbits, tops
        "omega": "w angular_velocity spin rate velocity rotation_rate omega0",
        "torque": "torques moment moments force external_torque",
        "gravity": "g gravitational_acceleration",
        "duration": "time t_end tmax t_max end stop T until length t tf",
        "samples": "n N num count steps n_samples number npoints",
        "step": "dt timestep time_step h delta_t",
        "times": "t_eval t time_points ts",
        "tolerance": "tol rtol accuracy error precision",
        "initial": "initial_conditions ic ics start state y0 initial_values init x0",
        "method": "integrator solver scheme",
        "spin": "omega rotation spin_rate w omega3 angular_velocity psi_dot psidot",
        "tilt": "theta angle inclination theta0 lean",
        "distance": "R l h lever com_distance semi_major_axis a height length r",
        "lambda1": "I1 A I_perp Ixx",
        "lambda3": "I3 C I_axis Izz",
        # systems
        "coordinates": "q qs variables coords generalized_coordinates coordinate generalised_coordinates",
        "lagrangian": "L lagrange Lagrange lagrangean",
        "kinetic": "T KE kinetic_energy ke K",
        "potential": "V U PE potential_energy pe",
        "hamiltonian": "H hamilton Hamilton",
        "forces": "force friction damping drag Q generalized_forces generalised_forces",
        "gm": "GM mu",
        # assignments
        "questions": "question problems tasks exercises",
        "answer": "solution key value expected correct",
        "ask": "result path field quantity",
        "relative": "rel rtol",
        "absolute": "abs atol",
        "significant_figures": "sig_figs sigfigs figures digits significant_digits",
    }
)
"""The keys for which a word may stand; the first that a section has, and that is not there yet, is meant."""

HALVED = _by_word(
    {
        "radius": "diameter diam dia outer_diameter",
        "outer_radius": "diameter diam dia outer_diameter",
        "inner_radius": "inner_diameter bore",
    }
)
"""The keys for twice the value of which a word stands."""

_ADJECTIVES = re.compile(r"^(solid|uniform|homogeneous|thin|full|round|circular|straight|flat)_")
"""What stands before the name of a shape without making another one of it."""


def folded(word: str) -> str:
    """A word in the spelling of keys: `Hollow cylinder` is `hollow_cylinder`."""
    return re.sub(r"[\s\-]+", "_", word.strip().casefold())


def shapes_called(word: str) -> tuple[str, ...]:
    """The shapes for which a word may stand; none for a word that is not known."""
    plain = folded(word)
    bare = _ADJECTIVES.sub("", plain)
    if bare != plain and plain not in SHAPES_BY_WORD:
        return SHAPES_BY_WORD.get(bare, (bare,))
    return SHAPES_BY_WORD.get(plain, (plain,))


def other_form(word: str) -> str | None:
    """How a body that is no shape is written, if the word is one for such a body."""
    return next((form for form, words in OTHER_FORMS.items() if folded(word) in words.split()), None)


def with_colon(typed: str) -> str | None:
    """What was meant by `shape cube`, `shape:cube` or `shape = cube`: `shape: cube`; None for other texts."""
    found = re.fullmatch(r"\s*([A-Za-z_]\w*)(?:\s*[:=]\s*(.+?)|\s+(\S+))\s*", typed, re.DOTALL)
    if found is None:
        return None
    value = re.split(r"\s+[A-Za-z_]\w*\s*[:=]", found[2] or found[3])[0]  # without the keys that follow
    return f"{found[1]}: {value[0] + '...' if value[0] in '{[' else value}"


def halved(word: str) -> tuple[str, ...]:
    """The keys that hold half of what a word tells; none for a word that is not known."""
    return HALVED.get(folded(word), ())


_VELOCITY = "v{0} v_{0} {0}_dot {0}d d{0} d{0}dt d{0}_dt {0}prime {0}_prime vel_{0} velocity_{0}"
"""Words for the velocity of a coordinate that has the name {0}."""


def variable_called(word: str, variables: Iterable[str]) -> str | None:
    """The velocity or momentum among some variables for which a word may stand: `xdot` for `vx`."""
    momenta = [name for name in variables if name.startswith("p_")]
    velocities = [name for name in variables if name.endswith("dot")]
    for only, words in ((velocities, ("v", "vel", "velocity")), (momenta, ("p", "momentum"))):
        if len(only) == 1 and word in words:
            return only[0]
    called = (name for name in velocities if word in _VELOCITY.format(name.removesuffix("dot")).split())
    return next(called, None)


def keys_called(word: str) -> tuple[str, ...]:
    """The keys for which a word may stand; none for a word that is not known."""
    return KEYS_BY_WORD.get(word) or KEYS_BY_WORD.get(folded(word), ())


AS_WRITTEN = "write `{}`: a colon, and a blank after it"
"""What to do about a key and its value that have become one text."""


def bracketed(raw: Mapping[str, Any]) -> tuple[dict[str, Any], list[ValueProblem]]:
    """A mapping with lists for `size: 1, 2, 3` in braces, where 2 and 3 are keys; and these problems."""
    groups: list[tuple[str, list[Any]]] = []
    for key, value in raw.items():
        if groups and value is None and _DIGITS.match(key):
            groups[-1][1].append(key)
        else:
            groups.append((key, [value]))
    mended: dict[str, Any] = {}
    problems = list[ValueProblem]()
    for key, entries in groups:
        if len(entries) > 2:  # of two, the comma may be that of a decimal
            typed = ", ".join(map(str, entries))
            hint = f"write `{key}: [{typed}]`"
            problems.append(ValueProblem("a list stands in brackets", path=(key,), hint=hint, typed=typed))
            mended[key] = entries
        else:
            mended |= {key: entries[0], **dict.fromkeys(entries[1:])}
    return mended, problems


_DIGITS = re.compile(r"-?\.?\d")
"""How a number begins."""


def key_slip(key: str, known: Collection[str]) -> ValueProblem | None:
    """The problem of a key such as `shape:cube`, which is one of the `known` keys with its value."""
    if key[:1].isdigit():
        hint = (
            "a comma begins the next entry; the sign in a decimal is a point, and a list stands in brackets"
        )
        return ValueProblem("no key and value", hint=hint, typed=key)
    cure = with_colon(key)
    if cure is None or {cure.partition(":")[0], *keys_called(cure.partition(":")[0])}.isdisjoint(known):
        return None
    return ValueProblem("no key and value", hint=AS_WRITTEN.format(cure), typed=key)


def not_one_of(raw: object, words: Sequence[str]) -> str:
    """The message for a value that is none of the `words`."""
    called = [key for key in keys_called(raw) if key in words] if isinstance(raw, str) else []
    near = called[0] if called else nearest(raw, list(words)) if isinstance(raw, str) else None
    if near is not None:
        return f"read {shown(raw)} (did you mean {near}?)"
    return f"read {shown(raw)}, expected one of {', '.join(words)}"
