"""Pictures as small charts of characters, by plotext."""

from __future__ import annotations

import textwrap

import numpy as np
import plotext

from rigidcli.core.arithmetic import Floats
from rigidcli.picture import Mark, Panel
from rigidcli.report import Report

# Columns of a chart for no terminal, and rows of every chart, which leave a terminal room for results.
WIDTH, HEIGHT = 72, 20
SIGNS = ("*", "o", "+", "x", "#", "@")  # characters for the marks by their style
# The directions to the right and up along x, y, z, seen from an azimuth of 35 and 22 degrees up.
VIEW = np.array([[-0.57357644, 0.81915204, 0.0], [-0.30686185, -0.21486592, 0.92718385]])


def drawn(report: Report, width: int | None) -> str:
    """The first picture of a report; panels stand one below the other."""
    (picture, *_) = report.pictures
    parts = [report.about(picture.title)]
    parts += [_panel(panel, min(width or WIDTH, 2 * WIDTH)) for panel in picture.panels]
    return "\n".join(parts) + "\n"


def _panel(panel: Panel, width: int) -> str:
    """One panel; a panel in space is seen from the side, without a scale."""
    figure = plotext.figure
    figure.clear()
    figure.theme("colorless")
    figure.plot_size(width, HEIGHT)
    solid = len(panel.rulers) == 3
    names = [f"{ruler.name} ({ruler.unit})" if ruler.unit else ruler.name for ruler in panel.rulers]
    for mark in panel.marks:
        for points in _lines(mark):
            places = points @ VIEW.T if solid else points
            kept = np.isfinite(places).all(axis=1)
            signal = figure.signal(*places[kept].T.tolist(), marker=_sign(mark))
            signal.lines(mark.form != "dots")
            figure.draw(signal)
    figure.label(names[0] if not solid else f"seen along {', '.join(names)}", axis="x")
    if not solid:
        figure.label(names[1], axis="y")
    if solid:
        figure.ruler("both").ticks([])
    signs = (f"{_sign(mark)} {mark.label}" for mark in panel.marks if mark.label and mark.form != "contours")
    head = "  ".join([*([panel.title] if panel.title else []), *signs])
    lines = [*textwrap.wrap(head, width), *plotext.uncolorize(str(figure.build())).splitlines()]
    return "\n".join(line.rstrip() for line in lines)


def _sign(mark: Mark) -> str:
    return "." if mark.quiet else SIGNS[mark.style]


def _lines(mark: Mark) -> list[Floats]:
    """The lines of a mark that can be drawn with characters."""
    if mark.form == "contours":
        return []
    if mark.form == "faces":
        return [np.vstack([face, face[:1]]) for face in mark.points]
    return [np.asarray(mark.points, dtype=float)]
