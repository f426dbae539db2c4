"""The pictures and the replay of `hamilton`: sections, paths, phase portraits, coordinates in time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Literal

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.substitution import substitute
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import columns
from rigidcli.document.document import Document
from rigidcli.errors import UsageError
from rigidcli.language import code
from rigidcli.language.text import latex_name
from rigidcli.mechanics.phase_space import TIME
from rigidcli.picture import Mark, Panel, Picture, PictureAxis
from rigidcli.report import Column, Table
from rigidcli.scene import Part, Scene, Stage
from rigidcli.studies.hamilton import orbit_table
from rigidcli.studies.hamilton.equations_of_motion import values_of_terms
from rigidcli.studies.hamilton.linear_equations import in_numbers
from rigidcli.studies.hamilton.orbit import OrbitSolution, curve
from rigidcli.studies.hamilton.system import known_values

if TYPE_CHECKING:
    from rigidcli.studies.hamilton.findings import Findings

# The most coordinates or modes that one picture shows.
MOST_PANELS = 6
# Places along each side of the grid on which H is worked out for its contours.
GRID = 161
# Contours of H beside that of the orbit's energy.
LEVELS = 9
# A coordinate that varies by less than this over a section, in units of the largest, is held fixed by it.
STILL = 1e-9
# Rates of the force at which its response is drawn.
RATES = 801
# How far a phase portrait goes beyond the orbit, in units of the orbit's width.
MARGIN = 0.35


def path(findings: Findings) -> Picture:
    """The paths of the particles, in the plane if they stay in one."""
    orbit = _required(findings.orbit)
    if positions(findings.document, orbit) is None:
        raise UsageError("it is drawn where `particles` have positions, and for the coordinates r and phi")

    def placed(samples: OrbitSolution) -> Floats:
        places = positions(findings.document, samples)
        assert places is not None
        return places.reshape(len(places), -1)

    samples = placed(curve(orbit, placed))
    places = samples.reshape(len(samples), -1, 3)
    extent = np.ptp(places.reshape(-1, 3), axis=0)
    if np.count_nonzero(extent) < 2:
        raise UsageError("it is drawn for motion that is not along a line")
    # A plane through the origin: the coordinate that changes least is left out where it stays at zero.
    still = int(np.argmin(extent + np.abs(places).max(axis=(0, 1))))
    shown = [axis for axis in range(3) if axis != still or extent[still] > 0]
    names = path_names(places.shape[1])
    marks = [Mark("dots", np.zeros((1, len(shown))), "origin", quiet=True)]
    for index, name in enumerate(names):
        line = places[:, index, shown]
        marks += [Mark(_form(orbit), line, name, style=index), Mark("dots", line[:1], style=index)]
    rulers = tuple(PictureAxis("xyz"[axis], unit="m") for axis in shown)
    title = "path of the orbit" if len(names) == 1 else "paths of the particles"
    return Picture("path", title, (Panel(rulers, tuple(marks), is_even=True),))


def phase(findings: Findings) -> Picture:
    """The orbit in the plane of each coordinate and its momentum; with contours of H if there is one."""
    orbit, names = _required(findings.orbit), findings.derivation.phase.coordinates
    panels: list[Panel] = []
    samples = curve(orbit, lambda samples: np.hstack([samples.coordinates, samples.momenta]))
    for place, name in enumerate(names[:MOST_PANELS]):
        path = np.column_stack([samples.coordinates[:, place], samples.momenta[:, place]])
        energy = _contours(findings, orbit, path) if len(names) == 1 else []
        named = not panels  # one legend is enough
        drawn = Mark(_form(orbit), path, "orbit" if named else "", style=0)
        marks = (*energy, drawn, Mark("dots", path[:1], "start" if named else "", style=1))
        panels.append(Panel((_ruler(name), _ruler(f"p_{name}")), marks))
    return Picture("phase", f"phase portrait{_of(names, 'coordinates')}", tuple(panels), _side(len(panels)))


def series(findings: Findings) -> Picture:
    """The coordinates in time."""
    orbit, names = _required(findings.orbit), findings.derivation.phase.coordinates
    return _in_time(orbit, "series", "coordinates", names, lambda samples: samples.coordinates)


def observables(findings: Findings) -> Picture:
    """The observables in time."""
    orbit = _required(findings.orbit)
    keys = [key for key in orbit.further if key.startswith("observables.")]
    if not keys:
        raise UsageError("it is drawn for `observables`")

    def values(samples: OrbitSolution) -> Floats:
        return np.column_stack([samples.further[key] for key in keys])

    return _in_time(orbit, "observables", "observables", [key.partition(".")[2] for key in keys], values)


def _in_time(
    orbit: OrbitSolution,
    kind: str,
    what: str,
    names: Sequence[str],
    values: Callable[[OrbitSolution], Floats],
) -> Picture:
    """A panel for each quantity with these names, whose `values` (k by m) samples have."""
    samples, ruler = curve(orbit, values), PictureAxis("t", "t", "s")
    lines = (np.column_stack([samples.times, x]) for x in values(samples).T)
    shown = zip(names[:MOST_PANELS], lines, strict=False)
    panels = tuple(Panel((ruler, _ruler(name)), (Mark(_form(orbit), line),)) for name, line in shown)
    return Picture(kind, f"{what} in time{_of(names, what)}", panels)


def section(findings: Findings) -> Picture:
    """The states of a section, as dots in the plane of each coordinate that moves and its momentum."""
    orbit, names = _required(findings.orbit), findings.derivation.phase.coordinates
    if not orbit.is_section:
        raise UsageError("it is drawn for an `orbit.section`")
    places = np.stack([orbit.coordinates, orbit.momenta])
    # A coordinate that the section itself holds fixed has nothing to show.
    spread = np.ptp(orbit.coordinates, axis=0)
    shown = [place for place in range(len(names)) if spread[place] > STILL * np.abs(places).max()]
    shown = (shown or [*range(len(names))])[:MOST_PANELS]
    panels = tuple(
        Panel((_ruler(names[place]), _ruler(f"p_{names[place]}")), (Mark("dots", places[:, :, place].T),))
        for place in shown
    )
    return Picture("section", f"section with {len(orbit.times)} crossings", panels, _side(len(panels)))


def modes(findings: Findings) -> Picture:
    """The displacements of each mode as arrows, one for each coordinate; quarter of a period later, too."""
    small = findings.oscillations
    if small is None or not small.modes:
        raise UsageError("it is drawn for the modes about an `equilibrium`")
    names = tuple(small.place)
    ticks = tuple(_ruler(name) for name in names)
    panels = []
    for number, (root, entries) in enumerate(small.modes[:MOST_PANELS], start=1):
        known = _values(findings.document, [root.rate, *(x for entry in entries for x in entry)])
        vector = [[float(substitute(x, known)) if isinstance(x, Expr) else x for x in z] for z in entries]
        now, later = np.array(vector).T
        parts = [(now, "", 0), (later, "a quarter later", 1)]
        places = np.column_stack([np.arange(len(names)), np.zeros(len(names))])
        rest = np.array([[-0.5, 0.0], [len(names) - 0.5, 0.0]])
        marks = [Mark("line", rest, quiet=True), Mark("dots", places, style=4)]
        for lengths, label, style in parts if later.any() else parts[:1]:
            for count, place in enumerate(np.flatnonzero(lengths)):
                end = np.array([[place, 0.0], [place, lengths[place]]])
                marks.append(Mark("arrow", end, "" if count else label, style=style))
        rate = float(substitute(root.rate, known) if isinstance(root.rate, Expr) else root.rate)
        kind = "rad/s" if root.angular else "1/s"
        title = f"mode {number}: {rate:.4g} {kind}" if rate else f"mode {number}: zero mode"
        panels.append(Panel((PictureAxis("", ticks=ticks), PictureAxis("displacement")), tuple(marks), title))
    title = f"normal modes{_of(small.modes, 'modes')}"
    return Picture("modes", title, tuple(panels), _side(len(panels)))


def resonance(findings: Findings) -> Picture:
    """Amplitudes and phases of the response to a force, by the rate of that force."""
    found, names = findings.driven, findings.derivation.phase.coordinates
    if found is None or not found.responses or found.responses[0].force.rate.is_zero:
        raise UsageError("it is drawn for linear systems that a force cos(w t) drives")
    force = found.responses[0].force
    values = _values(findings.document, (*found.motion.entries, force.rate, *force.amplitudes))
    m, c, k, f = in_numbers(found.motion, force, values)
    if not np.linalg.eigvalsh(c + c.T).min() > 0:
        raise UsageError("it is drawn for systems with damping")
    own = float(substitute(force.rate, values))
    # The free motion is slower than the square root of the trace of M^-1 K.
    w = np.linspace(0.0, 1.5 * max(own, math.sqrt(abs(np.trace(np.linalg.solve(m, k))))), RATES)
    places = np.append(w, own)[:, None, None]
    forces = np.tile(f, (len(places), 1))[..., None]
    answers = np.linalg.solve(k - places**2 * m + 1j * places * c, forces)[..., 0]
    panels = []
    for title, unit, rows in (("amplitude", "", np.abs(answers)), ("phase", "rad", -np.angle(answers) + 0.0)):
        marks = list[Mark]()
        for place, name in enumerate(names[:MOST_PANELS]):
            label = name if len(names) > 1 else ""
            marks.append(Mark("line", np.column_stack([w, rows[:-1, place]]), label, style=place))
            marks.append(Mark("dots", np.array([[own, rows[-1, place]]]), style=place))
        rulers = (PictureAxis("rate of the force", r"\omega", "rad/s"), PictureAxis(title, "", unit))
        panels.append(Panel(rulers, tuple(marks)))
    return Picture("resonance", f"response to a force{_of(names, 'coordinates')}", tuple(panels), 2)


def _form(orbit: OrbitSolution) -> Literal["line", "dots"]:
    return "dots" if orbit.is_section else "line"


def _required(orbit: OrbitSolution | None) -> OrbitSolution:
    if orbit is None:
        raise UsageError("it is drawn for an `orbit`")
    return orbit


def _ruler(name: str) -> PictureAxis:
    return PictureAxis(name, latex_name(name))


def _of(shown: Sequence[object], what: str) -> str:
    return f" of the first {MOST_PANELS} of {len(shown)} {what}" if len(shown) > MOST_PANELS else ""


def _side(count: int) -> int:
    return 1 if count == 1 else 2 if count <= 4 else 3


def _values(document: Document, expressions: Iterable[float | Expr]) -> dict[str, Expr]:
    """The values of the parameters. Raises UsageError where a symbol of the expressions has none."""
    known = known_values(document)
    used = {name for e in expressions if isinstance(e, Expr) for name in e.names}
    if missing := sorted(used - known.keys()):
        raise UsageError(f"no value is given for {', '.join(missing)}")
    return known


def _contours(findings: Findings, orbit: OrbitSolution, path: Floats) -> list[Mark]:
    """Lines of constant H in the plane of the one coordinate; none where H has no formula, or changes."""
    derivation, hamiltonian = findings.derivation, findings.derivation.hamiltonian
    if hamiltonian is None or derivation.explicit_time:
        return []
    low, high = path.min(axis=0), path.max(axis=0)
    room = np.where(high > low, MARGIN * (high - low), np.maximum(np.abs(high), 1.0))
    x, y = np.linspace(low - room, high + room, GRID).T
    parameters = {name: float(value) for name, value in findings.document.values.items()}
    states = np.column_stack([np.tile(x, GRID), np.repeat(y, GRID)])
    values = values_of_terms(hamiltonian, derivation.phase, parameters)
    heights = values(np.zeros(len(states)), *states.T).sum(axis=0).reshape(GRID, GRID)
    finite = heights[np.isfinite(heights)]
    if not len(finite) or not finite.min() < finite.max():
        return []
    others = np.quantile(finite, np.linspace(0, 1, LEVELS + 2)[1:-1])
    levels = tuple(float(level) for level in np.unique(others))
    marks = [Mark("contours", (x, y, heights), "other energies H", quiet=True, levels=levels)]
    if not derivation.energy_changes:
        energy = float(orbit.energy[0])
        marks.append(Mark("contours", (x, y, heights), "H of the orbit", style=1, levels=(energy,)))
    return marks


# The most coordinates whose values are read off, and whose phase portraits can be chosen.
MOST_SHOWN = 6
# The most particles whose paths are drawn, and which are looked through for rods between them.
MOST_TRACED = 12
# The most states of a replay: a page with two coordinates has room for them all.
MOST_REPLAYED = 7_500
# A distance that changes by less than this, in units of the size of the motion, is that of a rod.
RIGID = 1e-9
# A range below this, in units of the values, is that of rounding: it is not drawn out to fill a portrait.
CONSTANT = 1e-9
# How far a portrait goes in each direction to both sides, in units of its height to one side.
WIDTHS = (1.6, 1.0, 1.0)
# How far the axes of a portrait go beyond the orbit, in units of its own extent.
FRAME = 1.15


def scene_of(findings: Findings) -> Scene | None:
    """Make the replay of an orbit; None where there is one moment only, or a section."""
    document, orbit, system = findings.document, findings.orbit, findings.document.system
    if orbit is None or orbit.is_section or len(orbit.times) < 2 or system is None:
        return None
    names, placed = system.coordinates, positions(document, orbit) is not None

    def shown(samples: OrbitSolution) -> Floats:
        places = positions(document, samples)
        moved = [] if places is None else [places.reshape(len(places), -1)]
        return np.hstack([*moved, samples.coordinates, samples.momenta])

    path = curve(orbit, shown, MOST_REPLAYED)
    stages = [*_particles(document, path)]
    for place, name in enumerate(names[:MOST_SHOWN]):
        values = np.column_stack([path.coordinates[:, place], path.momenta[:, place]])
        stages.append(_portrait(values, (name, f"p_{name}"), f"phase portrait of {name}"))
    if not placed and len(names) in (2, 3):
        stages.append(_portrait(path.coordinates, names, f"orbit in {', '.join(names)}"))
    (table,) = orbit_table(findings._replace(orbit=path))
    return Scene("the orbit in time", path.times, _readings(names, table), tuple(stages))


def _readings(names: tuple[str, ...], table: Table) -> Table:
    """t, the first coordinates and their momenta, H, and the first multipliers and observables."""
    known = {column.key: column for column in table.columns}
    pairs = (known[key] for name in names[:MOST_SHOWN] for key in (f"q.{name}", f"p.p_{name}"))
    further = [known[key] for key in known if key.startswith(("multipliers.", "observables."))]
    shown: tuple[Column, ...] = (known[TIME], *pairs, known["H"], *further[:MOST_SHOWN])
    return Table("", "the orbit", shown, data=True)


def _particles(document: Document, orbit: OrbitSolution) -> Iterator[Stage]:
    """The particles in space, with their paths, and rods where distances do not change."""
    places = positions(document, orbit)
    if places is None:
        return
    count = places.shape[1]
    parts = [Part(Mark("line", rod, quiet=True), "sampled", group="rods") for rod in _rods(places)]
    for index, label in enumerate(path_names(count)):
        parts.append(Part(Mark("line", places[:, index], label, style=index), "traced"))
        parts.append(Part(Mark("dots", places[:, index : index + 1], style=index), "sampled"))
    if count > MOST_TRACED:
        parts.append(Part(Mark("dots", places[:, MOST_TRACED:], "further particles", style=5), "sampled"))
    parts.append(Part(Mark("dots", np.zeros((1, 3)), "origin", quiet=True)))
    yield Stage("the particles", tuple(parts), not places[:, :, 2].any())


def positions(document: Document, orbit: OrbitSolution) -> Floats | None:
    """The particles of the system along its orbit (n, k, 3); None where no positions are given.

    Without particles it is the one of the polar coordinates r and phi, if these are the coordinates.
    """
    system = document.system
    assert system is not None
    placed = [one.position for one in system.particles or () if one.position is not None]
    if not placed:
        return _polar(system.coordinates, orbit.coordinates)
    parameters = {name: float(value) for name, value in document.values.items()}
    expressions = [path for position in placed for path in position]
    flow = code.function(expressions, [TIME, *system.coordinates], parameters)
    rows = iter(columns(flow)(orbit.times, *orbit.coordinates.T))
    places = np.zeros((len(orbit.times), len(placed), 3))
    for index, position in enumerate(placed):
        for axis in range(len(position)):
            places[:, index, axis] = next(rows)
    return places


def _polar(names: Sequence[str], values: Floats) -> Floats | None:
    """The place in the plane (n, 1, 3) of polar coordinates (n, 2); None for other coordinates."""
    angle = next((name for name in ("phi", "varphi", "theta") if {*names} == {"r", name}), None)
    if angle is None:
        return None
    r, phi = values[:, names.index("r")], values[:, names.index(angle)]
    return np.stack([r * np.cos(phi), r * np.sin(phi), np.zeros_like(r)], axis=-1)[:, None]


def path_names(count: int) -> list[str]:
    """Name the paths of so many particles, as far as they are drawn."""
    return ["path"] if count == 1 else [f"path of particle {k + 1}" for k in range(min(count, MOST_TRACED))]


def _rods(places: Floats) -> Iterator[Floats]:
    """Lines (n, 2, 3) between particles (n, k, 3), or the origin, whose distance stays the same."""
    ends = np.concatenate([np.zeros_like(places[:, :1]), places[:, :MOST_TRACED]], axis=1)
    size = float(np.ptp(ends, axis=0).max())
    for i, j in combinations(range(ends.shape[1]), 2):
        length = np.linalg.norm(ends[:, i] - ends[:, j], axis=1)
        if np.ptp(length) <= RIGID * size and length[0]:
            yield ends[:, [i, j]]


def _portrait(values: Floats, names: tuple[str, ...], title: str) -> Stage:
    """An orbit (n, 2 or 3) along axes that have each a scale of their own."""
    low, high = values.min(axis=0), values.max(axis=0)
    size = np.maximum(np.abs(low), np.abs(high))
    half = np.where(high - low > CONSTANT * size, (high - low) / 2, np.where(size > 0, size, 1.0))
    path = np.zeros((len(values), 3))
    widths = np.array(WIDTHS[: len(names)])
    path[:, : len(names)] = (values - (low + high) / 2) / half * widths
    corner = np.zeros(3)
    corner[: len(names)] = -FRAME * widths
    axes = []
    for place, name in enumerate(names):
        tip = corner.copy()
        tip[place] *= -1
        label = f"{name}: {low[place]:.4g} to {high[place]:.4g}"
        axes.append(Part(Mark("arrow", np.array([corner, tip]), label, quiet=True), group="axes"))
    parts = (
        *axes,
        Part(Mark("line", path, "the whole orbit", quiet=True), "traced"),
        Part(Mark("line", path, "orbit so far", style=0), "traced"),
        Part(Mark("dots", path[:, None], "now", style=1), "sampled"),
    )
    return Stage(title, parts, len(names) == 2)
