"""The pictures of `hamilton`: sections, paths, phase portraits, coordinates in time, and modes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import UsageError
from rigidcli.language.text import latex_name
from rigidcli.picture import Mark, Panel, Picture, Ruler
from rigidcli.studies.hamilton.equations_of_motion import values_of_terms
from rigidcli.studies.hamilton.scene import path_names, positions

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rigidcli.document.document import Document
    from rigidcli.studies.hamilton.findings import Findings
    from rigidcli.studies.hamilton.orbit import OrbitSolution

MOST_PANELS = 6
"""The most coordinates or modes that one picture shows."""

GRID = 161
"""Places along each side of the grid on which H is worked out for its contours."""

LEVELS = 9
"""Contours of H beside that of the orbit's energy."""

STILL = 1e-9
"""A coordinate that varies by less than this over a section, in units of the largest, is held fixed by it."""

MARGIN = 0.35
"""How far a phase portrait goes beyond the orbit, in units of the orbit's width."""


def path(findings: Findings) -> Picture:
    """The paths of the particles, in the plane if they stay in one."""
    orbit = _required(findings.orbit)
    places = positions(findings.document, orbit)
    if places is None:
        raise UsageError("it is drawn where `particles` have positions, and for the coordinates r and phi")
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
    rulers = tuple(Ruler("xyz"[axis], unit="m") for axis in shown)
    title = "path of the orbit" if len(names) == 1 else "paths of the particles"
    return Picture("path", title, (Panel(rulers, tuple(marks), is_even=True),))


def phase(findings: Findings) -> Picture:
    """The orbit in the plane of each coordinate and its momentum; with contours of H if there is one."""
    orbit, names = _required(findings.orbit), findings.derivation.phase.coordinates
    panels: list[Panel] = []
    for place, name in enumerate(names[:MOST_PANELS]):
        path = np.column_stack([orbit.coordinates[:, place], orbit.momenta[:, place]])
        energy = _contours(findings, orbit, path) if len(names) == 1 else []
        named = not panels  # one legend is enough
        drawn = Mark(_form(orbit), path, "orbit" if named else "", style=0)
        marks = (*energy, drawn, Mark("dots", path[:1], "start" if named else "", style=1))
        panels.append(Panel((_ruler(name), _ruler(f"p_{name}")), marks))
    return Picture("phase", f"phase portrait{_of(names, 'coordinates')}", tuple(panels), _side(len(panels)))


def series(findings: Findings) -> Picture:
    """The coordinates in time."""
    orbit, names = _required(findings.orbit), findings.derivation.phase.coordinates
    panels = tuple(
        Panel(
            (Ruler("t", "t", "s"), _ruler(name)),
            (_in_time(orbit, values),),
        )
        for name, values in zip(names[:MOST_PANELS], orbit.coordinates.T, strict=False)
    )
    return Picture("series", f"coordinates in time{_of(names, 'coordinates')}", panels)


def observables(findings: Findings) -> Picture:
    """The observables in time."""
    orbit = _required(findings.orbit)
    samples = {key.partition(".")[2]: x for key, x in orbit.further.items() if key.startswith("observables.")}
    if not samples:
        raise UsageError("it is drawn for `observables`")
    panels = tuple(
        Panel(
            (Ruler("t", "t", "s"), _ruler(name)),
            (_in_time(orbit, values),),
        )
        for name, values in [*samples.items()][:MOST_PANELS]
    )
    return Picture("observables", f"observables in time{_of([*samples], 'observables')}", panels)


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
        vector = _numbers(findings.document, [*entries])
        parts = [(vector[:, 0], "", 0), (vector[:, 1], "a quarter later", 1)]
        places = np.column_stack([np.arange(len(names)), np.zeros(len(names))])
        rest = np.array([[-0.5, 0.0], [len(names) - 0.5, 0.0]])
        marks = [Mark("line", rest, quiet=True), Mark("dots", places, style=4)]
        for lengths, label, style in parts:
            ends = [
                np.array([[place, 0.0], [place, length]]) for place, length in enumerate(lengths) if length
            ]
            marks += [
                Mark("arrow", end, "" if place else label, style=style) for place, end in enumerate(ends)
            ]
            if not np.any(vector[:, 1]):
                break
        rate = float(_numbers(findings.document, [(root.rate, 0.0)])[0, 0])
        kind = "rad/s" if root.angular else "1/s"
        title = f"mode {number}: {rate:.4g} {kind}" if rate else f"mode {number}: zero mode"
        panels.append(Panel((Ruler("", ticks=ticks), Ruler("displacement")), tuple(marks), title))
    title = f"normal modes{_of(small.modes, 'modes')}"
    return Picture("modes", title, tuple(panels), _side(len(panels)))


def _form(orbit: OrbitSolution) -> Literal["line", "dots"]:
    """States of a section have nothing between them."""
    return "dots" if orbit.is_section else "line"


def _in_time(orbit: OrbitSolution, values: Floats) -> Mark:
    return Mark(_form(orbit), np.column_stack([orbit.times, values]))


def _required(orbit: OrbitSolution | None) -> OrbitSolution:
    if orbit is None:
        raise UsageError("it is drawn for an `orbit`")
    return orbit


def _ruler(name: str) -> Ruler:
    return Ruler(name, latex_name(name))


def _of(shown: Sequence[object], what: str) -> str:
    """A title ends with this where there are more coordinates or modes than the picture shows."""
    return f" of the first {MOST_PANELS} of {len(shown)} {what}" if len(shown) > MOST_PANELS else ""


def _side(count: int) -> int:
    """One panel stands in one column, up to four stand in two, and more stand in three."""
    return 1 if count == 1 else 2 if count <= 4 else 3


def _numbers(document: Document, pairs: Sequence[tuple[float | Expr, float | Expr]]) -> Floats:
    """Turn pairs of numbers, or of exact expressions without symbols, into floats (n, 2).

    Raises UsageError where a symbol has no value.
    """
    known = {name: float(value) for name, value in document.values.items() if name not in document.symbols}
    missing = sorted(
        {name for pair in pairs for e in pair if isinstance(e, Expr) for name in e.names - {*known}}
    )
    if missing:
        raise UsageError(f"no value is given for {', '.join(missing)}")
    rows = [[e.evaluate(**known) if isinstance(e, Expr) else e for e in pair] for pair in pairs]
    return np.array(rows, dtype=np.float64)


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
