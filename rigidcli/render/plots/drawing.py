"""Pictures as files, by matplotlib: the same bytes each time, whatever the user's own settings are."""

from __future__ import annotations

import io
import logging
import math
import re
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from rigidcli.core.arithmetic import Floats
from rigidcli.picture import Mark, Picture, PictureAxis
from rigidcli.render.values import raised
from rigidcli.report import Report

# Colours of marks by their style, which colour-blind readers can distinguish.
# Source: M. Okabe, K. Ito, Color Universal Design (2008): blue, vermillion, green, purple, black, sky blue.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000", "#56B4E9")
# Line styles, which distinguish the same marks in print without colours.
LINES: tuple[Any, ...] = ("-", (0, (6, 2)), (0, (6, 2, 1.5, 2)), (0, (1.5, 1.5)), (0, (3, 1.5)), "-")
DOTS = ("o", "s", "^", "D", "P", "o")  # signs for dots, likewise
GREY = "#7F7F7F"  # the colour of quiet marks, which are there for orientation
VIEW = (22.0, 35.0)  # the direction from which solid panels are seen: elevation and azimuth in degrees
# Settings that differ from matplotlib's own. Texts in svg stay texts, which keeps files short.
# Powers of ten stand in the labels of directions, so that numbers beside them are plain text, which is fast.
SETTINGS = {
    "svg.hashsalt": "rigidcli",
    "svg.fonttype": "none",
    "font.size": 9.0,
    "axes.grid": True,
    "grid.linewidth": 0.4,
    "grid.alpha": 0.5,
    "axes.formatter.limits": (-5, 5),
    "lines.linewidth": 1.4,
}
# Entries with times and versions, which files leave out.
METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
SIZE = (5.6, 3.8)  # width and height of a single panel, in inches
# The least bend of a surface at an edge that is drawn: round sides are made of planes that bend by less.
CREASE = math.radians(30)


def drawn(report: Report, ending: str, *, is_clear: bool = False) -> bytes:
    """The first picture of a report as a file with this ending, on white ground unless it is clear."""
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it reports the fonts that it looks for
    (picture, *_) = report.pictures
    file = io.BytesIO()
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(SETTINGS)
        figure = figure_of(picture, report.about(picture.title))
        figure.savefig(file, format=ending, dpi=150, metadata=METADATA[ending], transparent=is_clear)
    return _shortened(file.getvalue()) if ending == "svg" else file.getvalue()


def _shortened(svg: bytes) -> bytes:
    """The same picture with coordinates cut to hundredths of a point, and without names that nothing uses."""
    svg = re.sub(rb'(?s) id="[a-zA-Z0-9]+_[0-9]+"| <metadata>.*</metadata>', b"", svg)
    return re.sub(rb' d="[^"]*"', lambda path: re.sub(rb"(\.[0-9]{2})[0-9]+", rb"\1", path[0]), svg)


def figure_of(picture: Picture, title: str) -> Figure:
    """The picture as a figure of matplotlib, with its title above."""
    columns = picture.columns
    rows = -(-len(picture.panels) // columns)
    solid = len(picture.panels[0].rulers) == 3
    width = SIZE[0] * (1 if columns == 1 else 0.62 * columns)
    height = 5.2 if solid else SIZE[1] * (1 if rows == 1 else 0.55 * rows) * (1 if columns == 1 else 1.15)
    alone = len(picture.panels) == 1
    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(title, fontsize=10, parse_math=False, wrap=True)
    for place, panel in enumerate(picture.panels, start=1):
        axes: Any = figure.add_subplot(rows, columns, place, projection="3d" if solid else None)
        if solid:
            axes.computed_zorder = False  # marks are drawn in their order
            axes.view_init(*VIEW)
            axes.set_proj_type("ortho")
            axes.set_box_aspect((1, 1, 1), zoom=1.02)
            axes.locator_params(nbins=4)  # few numbers, which would touch
        for mark in panel.marks:
            DRAW[mark.form](axes, mark)
        if panel.is_even:
            axes.set_aspect("equal", adjustable="datalim")
        for way, ruler in zip("xyz", panel.rulers, strict=False):
            _measure(axes, way, ruler)
        if panel.title:
            axes.set_title(panel.title, fontsize=9, parse_math=False)
        if not alone and axes.get_legend_handles_labels()[1]:
            axes.legend(loc="best", fontsize=7.5, framealpha=0.8)
    if alone and (count := len(figure.axes[0].get_legend_handles_labels()[1])):
        ncols = min(count, 2 if count > 4 else 3)
        figure.legend(loc="outside lower center", ncols=ncols, frameon=False, fontsize=8.5)
    return figure


def _measure(axes: Any, way: str, ruler: PictureAxis) -> None:
    """Label a direction with its symbol and unit, and a power of ten where its numbers ask for one."""
    axis = getattr(axes, f"{way}axis")
    low, high = getattr(axes, f"get_{way}lim")()
    largest = max(abs(low), abs(high))
    if high - low < 1e-9 * largest:  # the rounding of a constant is not drawn out to fill the panel
        getattr(axes, f"set_{way}lim")(*sorted((0.9 * low, 1.1 * low)))
    unit = raised(ruler.unit)
    if not 0.02 <= largest < 2e4:
        exponent = math.floor(math.log10(largest or 1.0) / 3) * 3
        axis.set_major_formatter(
            lambda value, _: f"{value / 10.0**exponent:.4g}".replace("-", "\N{MINUS SIGN}")
        )
        unit = f"10{raised(f'^{exponent}')} {unit}".strip()
    axis.set_label_text(f"{_name(ruler)} ({unit})" if unit else _name(ruler))


def _name(ruler: PictureAxis) -> str:
    """The symbol as a formula where there is one, else the plain name."""
    return f"${ruler.symbol}$" if ruler.symbol else ruler.name.replace("$", r"\$")


def _look(mark: Mark) -> dict[str, Any]:
    if mark.quiet:
        look: dict[str, Any] = {"color": GREY, "linewidth": 0.6}
    else:
        look = {"color": COLOURS[mark.style], "linestyle": LINES[mark.style]}
    return look | ({"label": mark.label.replace("$", r"\$")} if mark.label else {})


def _line(axes: Any, mark: Mark) -> None:
    """A line; parts on the far side of a surface are thin and pale."""
    points = np.asarray(mark.points, dtype=float)
    look = _look(mark)
    if mark.normals is None:
        axes.plot(*points.T, **look)
        return
    elevation, azimuth = np.radians(VIEW)
    along = np.cos(elevation)
    front = mark.normals @ [along * np.cos(azimuth), along * np.sin(azimuth), np.sin(elevation)] >= 0
    # One more point on either side, so that no gap is left.
    near = front | np.roll(front, 1) | np.roll(front, -1)
    axes.plot(*np.where(near[:, None], points, np.nan).T, **look)
    style = ":" if mark.quiet else look["linestyle"]
    behind = look | {"label": "_", "linestyle": style, "linewidth": 0.7, "alpha": 0.55}
    axes.plot(*np.where(front[:, None], np.nan, points).T, **behind)


def _dots(axes: Any, mark: Mark) -> None:
    points = np.asarray(mark.points, dtype=float)
    size = 6.0 if len(points) <= 20 else 3.0 if len(points) <= 200 else 1.2
    look = _look(mark) | {"linestyle": "none", "marker": DOTS[mark.style], "markersize": size}
    axes.plot(*points.T, **look)


def _arrow(axes: Any, mark: Mark) -> None:
    start, end = points = np.asarray(mark.points, dtype=float)
    look = _look(mark)
    if len(start) == 2:
        axes.plot(*points.T, **look)
        head = {"arrowstyle": "-|>", "color": look["color"], "lw": 1.4, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", end, start, arrowprops=head)
        return
    shaft = {"color": look["color"], "linestyle": look["linestyle"], "linewidth": 1.6}
    axes.quiver(*start, *(end - start), arrow_length_ratio=0.08, **shaft)
    axes.plot([], [], [], **look)  # for the legend


def _faces(axes: Any, mark: Mark) -> None:
    colour = "#FFFFFF" if mark.quiet else COLOURS[mark.style]
    faces = Poly3DCollection(list(mark.points), facecolors=colour, shade=len(mark.points) > 1, alpha=0.28)
    faces.set(edgecolor="none", clip_on=False)
    if edges := [] if mark.is_rough else _creases(mark.points):
        axes.add_collection3d(Line3DCollection(edges, color=GREY, linewidth=0.5, clip_on=False))
    if mark.label:  # in the legend in its own colour, which is not that of any face in its light
        look = {"marker": "s", "markersize": 9, "linestyle": "none", "alpha": 0.5, "mec": GREY}
        axes.plot([], [], [], **(_look(mark) | look | {"color": colour}))
    axes.add_collection3d(faces)
    axes.auto_scale_xyz(*np.vstack(list(mark.points)).T)


def _creases(faces: Sequence[Floats]) -> list[Floats]:
    """The edges (each 2 by 3) of plane faces where the surface ends, or bends by more than CREASE.

    The diagonals that cut plane sides into triangles, and the edges of a round side, are none.
    """
    size = float(np.abs(np.vstack(list(faces))).max()) or 1.0
    beside: dict[frozenset[tuple[float, ...]], list[tuple[Floats, Floats]]] = {}
    for face in faces:
        fan = np.cross(face[1:-1] - face[0], face[2:] - face[0]).sum(axis=0)
        normal = fan / (np.linalg.norm(fan) or 1.0)
        corners = list(map(tuple, np.round(face / size, 9).tolist()))  # equal but for rounding
        for place, corner in enumerate(corners):
            before = corners[place - 1]
            # Two faces with the same sense of turning go along a common edge in opposite directions.
            side = normal if before < corner else -normal
            if before != corner and normal.any():
                beside.setdefault(frozenset((before, corner)), []).append((face[[place - 1, place]], side))
    least = -math.cos(CREASE)
    return [edge for (edge, side), *others in beside.values() if not others or others[0][1] @ side > least]


def _contours(axes: Any, mark: Mark) -> None:
    look = _look(mark)
    style = {"linestyles": ":" if mark.quiet else "--", "linewidths": 0.8}
    axes.contour(*mark.points, levels=list(mark.levels), colors=look["color"], **style)
    if mark.label:
        axes.plot([], [], **(look | {"linestyle": style["linestyles"], "linewidth": 0.8}))


# How each form of mark is drawn.
DRAW = {"line": _line, "dots": _dots, "arrow": _arrow, "faces": _faces, "contours": _contours}
