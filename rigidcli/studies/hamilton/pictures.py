"""The pictures and the replay of `hamilton`: sections, paths, phase portraits, coordinates in time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import chain, combinations
from typing import Literal

import numpy as np

from rigidcli.algebra.substitution import substitute
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import columns
from rigidcli.document.document import Document
from rigidcli.errors import UsageError
from rigidcli.language import code
from rigidcli.language.text import latex_name
from rigidcli.language.tree import ZERO
from rigidcli.mechanics.phase_space import TIME
from rigidcli.picture import Mark, Panel, Picture, PictureAxis
from rigidcli.report import Table
from rigidcli.scene import Part, Scene, Stage
from rigidcli.studies.hamilton import Findings, orbit_table
from rigidcli.studies.hamilton.equations_of_motion import Samples, compiled
from rigidcli.studies.hamilton.linear_equations import in_numbers
from rigidcli.studies.hamilton.orbit import OrbitSolution, curve
from rigidcli.studies.hamilton.system import known_values

# The most coordinates that one picture or replay shows.
MOST_SHOWN = 6
# Places along each side of the grid on which H is worked out for its contours.
GRID = 161
# Contours of H beside that of the orbit's energy.
LEVELS = 9
# Rates of the force at which its response is drawn.
RATES = 801
# How far a phase portrait goes beyond the orbit, in units of the orbit's width.
MARGIN = 0.35
# What varies by less than this, in units of its size, is constant: a distance, or a coordinate in a section.
CONSTANT = 1e-9
# The most particles whose paths are drawn, and which are looked through for rods between them.
MOST_TRACED = 12
# The most states of a replay: a page with two coordinates has room for them all.
MOST_REPLAYED = 7_500
# How far a portrait goes in each direction to both sides, in units of its height to one side.
WIDTHS = (1.6, 1.0, 1.0)
# How far the axes of a portrait go beyond the orbit, in units of its own extent.
FRAME = 1.15


def path(findings: Findings) -> Picture:
    """The paths of the particles, in the plane if they stay in one."""
    orbit, placed = _required(findings.orbit), positions(findings.document)
    if placed is None:
        raise UsageError("it is drawn where `particles` have positions, and for the coordinates r and phi")
    places = placed(curve(orbit, lambda samples: placed(samples).reshape(len(samples.times), -1)))
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
    pairs, panels = findings.derivation.sample_keys, []
    for place, (axes, line) in enumerate(_lines(findings, pairs)):
        energy = _contours(findings, line.points) if len(pairs) == 1 else []
        # One legend is enough.
        orbit, start = ("", "") if place else ("orbit", "start")
        marks = (*energy, replace(line, label=orbit), Mark("dots", line.points[:1], start, style=1))
        panels.append(Panel(axes, marks))
    return _picture("phase", "phase portrait", panels, pairs, "coordinates")


def section(findings: Findings) -> Picture:
    """The states of a section, as dots in the plane of each coordinate that moves and its momentum."""
    orbit, pairs = _required(findings.orbit), findings.derivation.sample_keys
    if not orbit.is_section:
        raise UsageError("it is drawn for an `orbit.section`")
    samples = orbit.samples
    # A coordinate that the section itself holds fixed has nothing to show.
    size = np.abs(samples.columns(chain(*pairs))).max()
    shown = [pair for pair in pairs if np.ptp(samples.values[pair[0]]) > CONSTANT * size] or pairs
    panels = [Panel(axes, (line,)) for axes, line in _lines(findings, shown)]
    return _picture("section", f"section with {len(samples.times)} crossings", panels)


def series(findings: Findings) -> Picture:
    """The coordinates in time."""
    return _in_time(findings, "series", "coordinates", [q for q, _ in findings.derivation.sample_keys])


def observables(findings: Findings) -> Picture:
    """The observables in time."""
    keys = [key for key in _required(findings.orbit).samples.values if key.startswith("observables.")]
    if not keys:
        raise UsageError("it is drawn for `observables`")
    return _in_time(findings, "observables", "observables", keys)


def _in_time(findings: Findings, kind: str, what: str, keys: Sequence[str]) -> Picture:
    panels = [Panel(axes, (line,)) for axes, line in _lines(findings, [(TIME, key) for key in keys])]
    return replace(_picture(kind, f"{what} in time", panels, keys, what), columns=1)


def _lines(
    findings: Findings, pairs: Sequence[tuple[str, str]]
) -> Iterator[tuple[tuple[PictureAxis, ...], Mark]]:
    """Axes for the first pairs of quantities, such as t and x, with the orbit in their plane."""
    orbit, keys = _required(findings.orbit), {*chain(*pairs)} - {TIME}
    shown = curve(orbit, lambda samples: samples.columns(keys))
    for pair in pairs[:MOST_SHOWN]:
        names = (key.rpartition(".")[2] for key in pair)
        yield _axes(*names), Mark(_form(orbit), shown.columns(pair))


def resonance(findings: Findings) -> Picture:
    """Amplitudes and phases of the response to a force, by the rate of that force."""
    found, names = findings.driven, findings.derivation.phase.coordinates
    if found is None or not found.responses or found.responses[0].force.rate.is_zero:
        raise UsageError("it is drawn for linear systems that a force cos(w t) drives")
    force, document = found.responses[0].force, findings.document
    known = known_values(document)
    entries = [force.rate, *force.amplitudes, *force.behind, *found.motion.entries]
    if missing := sorted({name for e in entries for name in e.names} - known.keys()):
        raise UsageError(f"no value is given for {', '.join(missing)}")
    own = float(substitute(force.rate, known))
    m, c, k, f = in_numbers(found.motion, force, known)
    if not np.linalg.eigvalsh(c + c.T).min() > 0:
        raise UsageError("it is drawn for systems with damping")
    # The free motion is slower than the square root of the trace of M^-1 K.
    w = np.linspace(0.0, 1.5 * max(own, math.sqrt(abs(np.trace(np.linalg.solve(m, k))))), RATES)
    places = np.append(w, own)[:, None, None]
    forces = np.tile(f, (len(places), 1))[..., None]
    answers = np.linalg.solve(k - places**2 * m + 1j * places * c, forces)[..., 0]
    panels = []
    for title, unit, rows in (("amplitude", "", np.abs(answers)), ("phase", "rad", -np.angle(answers) + 0.0)):
        marks = list[Mark]()
        for place, name in enumerate(names[:MOST_SHOWN]):
            label = name if len(names) > 1 else ""
            marks.append(Mark("line", np.column_stack([w, rows[:-1, place]]), label, style=place))
            marks.append(Mark("dots", np.array([[own, rows[-1, place]]]), style=place))
        rulers = (PictureAxis("rate of the force", r"\omega", "rad/s"), PictureAxis(title, "", unit))
        panels.append(Panel(rulers, tuple(marks)))
    return _picture("resonance", "response to a force", panels, names, "coordinates")


def _picture(
    kind: str, title: str, panels: Sequence[Panel], every: Sequence[object] = (), what: str = ""
) -> Picture:
    """A picture, whose title says if it shows the first only of `every` quantity of a kind."""
    of = f" of the first {MOST_SHOWN} of {len(every)} {what}" if len(every) > MOST_SHOWN else ""
    square = math.ceil(math.sqrt(len(panels)))
    return Picture(kind, title + of, tuple(panels), square)


def _form(orbit: OrbitSolution) -> Literal["line", "dots"]:
    return "dots" if orbit.is_section else "line"


def _required(orbit: OrbitSolution | None) -> OrbitSolution:
    if orbit is None:
        raise UsageError("it is drawn for an `orbit`")
    return orbit


def _axes(*names: str) -> tuple[PictureAxis, ...]:
    return tuple(PictureAxis(name, latex_name(name), "s" if name == TIME else "") for name in names)


def _contours(findings: Findings, path: Floats) -> list[Mark]:
    """Lines of constant H in the plane of the one coordinate; none where H has no formula, or changes."""
    derivation, hamiltonian = findings.derivation, findings.derivation.hamiltonian
    if hamiltonian is None or derivation.explicit_time:
        return []
    low, high = path.min(axis=0), path.max(axis=0)
    room = np.where(high > low, MARGIN * (high - low), np.maximum(np.abs(high), 1.0))
    x, y = np.linspace(low - room, high + room, GRID).T
    parameters = {name: float(value) for name, value in findings.document.values.items()}
    states = np.column_stack([np.tile(x, GRID), np.repeat(y, GRID)])
    height = compiled([hamiltonian], derivation.phase.names, parameters)
    heights = height(np.zeros(len(states)), *states.T).reshape(GRID, GRID)
    finite = heights[np.isfinite(heights)]
    if not len(finite) or not finite.min() < finite.max():
        return []
    others = np.quantile(finite, np.linspace(0, 1, LEVELS + 2)[1:-1])
    levels = tuple(float(level) for level in np.unique(others))
    marks = [Mark("contours", (x, y, heights), "other energies H", quiet=True, levels=levels)]
    if not derivation.energy_changes:
        energy = float(_required(findings.orbit).samples.values["H"][0])
        marks.append(Mark("contours", (x, y, heights), "H of the orbit", style=1, levels=(energy,)))
    return marks


# --- the replay


def scene_of(findings: Findings) -> Scene | None:
    """Make the replay of an orbit; None where there is one moment only, or a section."""
    orbit, names = findings.orbit, findings.derivation.phase.coordinates
    pairs = findings.derivation.sample_keys
    if orbit is None or orbit.is_section or len(orbit.samples.times) < 2:
        return None
    placed = positions(findings.document)

    def shown(samples: Samples) -> Floats:
        places = [] if placed is None else [placed(samples).reshape(len(samples.times), -1)]
        return np.hstack([*places, samples.columns(chain(*pairs))])

    path = curve(orbit, shown, MOST_REPLAYED)
    stages = [] if placed is None else [_particles(placed(path))]
    for name, pair in zip(names[:MOST_SHOWN], pairs, strict=False):
        stages.append(_portrait(path.columns(pair), (name, f"p_{name}"), f"phase portrait of {name}"))
    if placed is None and len(names) in (2, 3):
        title = f"orbit in {', '.join(names)}"
        stages.append(_portrait(path.columns(q for q, _ in pairs), names, title))
    (table,) = orbit_table(replace(findings, orbit=orbit._replace(samples=path)))
    columns = {column.key: column for column in table.columns}
    # The first coordinates and their momenta, and the first multipliers and observables.
    further = [key for key in columns if key.startswith(("multipliers.", "observables."))]
    keys = [TIME, *chain(*pairs[:MOST_SHOWN]), "H", *further[:MOST_SHOWN]]
    readings = Table("", "the orbit", tuple(columns[key] for key in keys), data=True)
    return Scene("the orbit in time", path.times, readings, tuple(stages))


def _particles(places: Floats) -> Stage:
    """The particles (n, k, 3) in space, with their paths, and rods where distances do not change."""
    count = places.shape[1]
    parts = [Part(Mark("line", rod, quiet=True), "sampled", group="rods") for rod in _rods(places)]
    for index, label in enumerate(path_names(count)):
        parts.append(Part(Mark("line", places[:, index], label, style=index), "traced"))
        parts.append(Part(Mark("dots", places[:, index : index + 1], style=index), "sampled"))
    if count > MOST_TRACED:
        parts.append(Part(Mark("dots", places[:, MOST_TRACED:], "further particles", style=5), "sampled"))
    parts.append(Part(Mark("dots", np.zeros((1, 3)), "origin", quiet=True)))
    return Stage("the particles", tuple(parts), not places[:, :, 2].any())


def positions(document: Document) -> Callable[[Samples], Floats] | None:
    """What tells the places (n, k, 3) of the particles along an orbit; None where no positions are given.

    Without particles it is the one of the polar coordinates r and phi, if these are the coordinates.
    """
    system = document.system
    assert system is not None
    placed = [one.position for one in system.particles or () if one.position is not None]
    names = list(system.coordinates)
    angle = next((name for name in ("phi", "varphi", "theta") if {*names} == {"r", name}), None)
    if placed:
        parameters = {name: float(value) for name, value in document.values.items()}
        paths = [path for position in placed for path in (*position, ZERO, ZERO)[:3]]
        flow = columns(code.function(paths, [TIME, *names], parameters))
        return lambda samples: (
            flow(samples.times, *samples.states.T[: len(names)])
            .reshape(len(placed), 3, -1)
            .transpose(2, 0, 1)
        )
    if angle is None:
        return None

    def polar(samples: Samples) -> Floats:
        r, phi = samples.values["q.r"], samples.values[f"q.{angle}"]
        return np.stack([r * np.cos(phi), r * np.sin(phi), np.zeros_like(r)], axis=-1)[:, None]

    return polar


def path_names(count: int) -> list[str]:
    """Name the paths of so many particles, as far as they are drawn."""
    return ["path"] if count == 1 else [f"path of particle {k + 1}" for k in range(min(count, MOST_TRACED))]


def _rods(places: Floats) -> Iterator[Floats]:
    """Lines (n, 2, 3) between particles (n, k, 3), or the origin, whose distance stays the same."""
    ends = np.concatenate([np.zeros_like(places[:, :1]), places[:, :MOST_TRACED]], axis=1)
    size = float(np.ptp(ends, axis=0).max())
    for i, j in combinations(range(ends.shape[1]), 2):
        length = np.linalg.norm(ends[:, i] - ends[:, j], axis=1)
        if np.ptp(length) <= CONSTANT * size and length[0]:
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
