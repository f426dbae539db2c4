"""An orbit as a scene: the particles of the system where they are, and the phase portraits in motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.estimate import columns
from rigidcli.document.document import Document
from rigidcli.language import code
from rigidcli.mechanics.hamilton_equations import TIME
from rigidcli.picture import Mark
from rigidcli.report import Column, Table
from rigidcli.scene import Part, Scene, Stage
from rigidcli.studies.hamilton.orbit import OrbitSolution

MOST_SHOWN = 6
"""The most coordinates whose values are read off, and whose phase portraits can be chosen."""

MOST_TRACED = 12
"""The most particles whose paths are drawn, and which are looked through for rods between them."""

RIGID = 1e-9
"""A distance that changes by less than this, in units of the size of the motion, is that of a rod."""

CONSTANT = 1e-9
"""A range below this, in units of the values, is that of rounding: it is not drawn out to fill a portrait."""

WIDTHS = (1.6, 1.0, 1.0)
"""How far a portrait goes in each direction to both sides, in units of its height to one side."""

FRAME = 1.15
"""How far the axes of a portrait go beyond the orbit, in units of its own extent."""


def scene_of(document: Document, orbit: OrbitSolution, table: Table) -> Scene | None:
    """Make the replay of an orbit; None where there is one moment only. `table` has the samples of it."""
    if len(orbit.times) < 2:
        return None
    assert document.system is not None
    names = document.system.coordinates
    stages = [*_particles(document, orbit)]
    has_particles = bool(stages)
    for place, name in enumerate(names[:MOST_SHOWN]):
        values = np.column_stack([orbit.coordinates[:, place], orbit.momenta[:, place]])
        stages.append(_portrait(values, (name, f"p_{name}"), f"phase portrait of {name}"))
    if not has_particles and len(names) in (2, 3):
        stages.append(_portrait(orbit.coordinates, names, f"orbit in {', '.join(names)}"))
    return Scene("the orbit in time", orbit.times, _readings(names, table), tuple(stages))


def _readings(names: tuple[str, ...], table: Table) -> Table:
    """t, the first coordinates and their momenta, and H."""
    known = {column.key: column for column in table.columns}
    pairs = (known[key] for name in names[:MOST_SHOWN] for key in (f"q.{name}", f"p.p_{name}"))
    shown: tuple[Column, ...] = (known[TIME], *pairs, known["H"])
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
    """The orbit (n, 2 or 3) along axes with scales of their own, which show how far it goes."""
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
