"""The replay of a motion in three dimensions: a figure of HTML that needs nothing from outside.

It works in a page with the policy of `page`, from a file, and in the output of a notebook, several on one
page. The data stand in a script element; `drawing.js` and `replay.js` draw them with WebGL2. The libraries of
PyPI do not serve here: k3d evaluates text, which the policy forbids, and its script alone is 2.6 MB;
anythreejs is a widget, which needs a running Python. Neither shows readings.
"""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.bodies import solids
from rigidcli.bodies.mesh_geometry import simplified
from rigidcli.core import rotation
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.picture import Picture
from rigidcli.render import Look
from rigidcli.render.values import lettered, raised, without_noise
from rigidcli.render.web.mathml import formula, prose
from rigidcli.render.web.page import resource, script_of, text
from rigidcli.report import Table, single_cells
from rigidcli.scene import Part, Scene, Stage

Rows: TypeAlias = NDArray[np.intp]  # indices of samples of a scene
# The middle of a view (3), half of its extent along x, y and z (3), and its reach from the middle.
Extent: TypeAlias = tuple[Floats, Floats, float]
MOST_TRIANGLES = 8_000  # the most triangles of one surface: 0.4 MB, and drawn in less than a millisecond
# The least and the most seconds of a replay at its ordinary speed: a reader follows a turn a second.
SHORTEST_REPLAY, LONGEST_REPLAY = 10.0, 60.0
FINEST = 64  # cells along the longest side of a surface when it begins to be made coarser: 6 MB of memory


def still(picture: Picture) -> Scene:
    """A body that rests, from a picture in space: a scene with one time and without readings."""
    parts = [
        Part(replace(mark, label=mark.label.partition(":")[0]), group=mark.label)
        for mark in picture.panels[0].marks
    ]
    return Scene(picture.title, np.zeros(1), Table("", "", ()), (Stage("the body", tuple(parts)),))


def player() -> tuple[str, str]:
    """The style and the script of all replays on a page."""
    return resource("replay.css"), script_of("drawing.js", "replay.js")


def replay(scene: Scene, look: Look, most: int, others: Mapping[str, Scene] | None = None) -> str:
    """The figure, for a page with the `player`: all text in it is escaped, and no data ends its element.

    Where the samples have more than `most` numbers, evenly chosen ones are shown, and surfaces are coarser.
    A slider chooses among the `others`, by their names, of which `scene` is the first.
    """
    scenes, arrays = list((others or {"": scene}).values()), dict[str, int]()
    share = most // len(scenes)
    # All views of a kind have the same middle and scale, so that motions can be compared.
    extents = [[_extent(each, stage) for stage in each.stages] for each in scenes]
    if len({len(each) for each in extents}) == 1:
        extents = [[_joined(alike) for alike in zip(*extents, strict=True)]] * len(scenes)
    pairs = zip(scenes, extents, strict=True)
    first, *further = [_motion(each, sizes, share, arrays) for each, sizes in pairs]
    data = {**first, "arrays": list(arrays), "digits": look.digits}
    if further:
        data["others"] = further
    return _figure(scene, list(others or ()), json.dumps(data, separators=(",", ":")))


def _motion(scene: Scene, extents: Sequence[Extent], most: int, arrays: dict[str, int]) -> dict[str, Any]:
    """A scene as it is sent, with about as many numbers as `most`; packed arrays are in `arrays`."""
    rows = _rows(scene, most)
    finest = min(MOST_TRIANGLES, most // 8)
    readings = replace(scene.readings, columns=tuple(map(without_noise, scene.readings.columns)))
    data: dict[str, Any] = {
        "stages": [
            _stage(scene, stage, extent, rows, finest, arrays)
            for stage, extent in zip(scene.stages, extents, strict=True)
        ],
        "times": _packed(scene.times[rows], "f8"),
        "readings": [
            {"unit": raised(column.unit), "values": _packed(np.asarray(column.values)[rows], "f8")}
            for column in single_cells(readings)
        ],
    }
    turns = None
    if scene.orientation is not None:
        turns = _turns(scene, rows)
        data |= {"orientation": _packed(scene.orientation[rows]), "turns": _packed(turns)}
    return data | {"seconds": _seconds(scene, turns)}


def _figure(scene: Scene, choices: Sequence[str], data: str) -> str:
    """The elements of replay.html, most of which are hidden until the script runs."""
    options = "".join(
        f"<option value={place}>{text(lettered(stage.title))}</option>"
        for place, stage in enumerate(scene.stages)
    )
    columns = single_cells(scene.readings)
    names = (formula(column.symbols[0]) if column.symbols else prose(column.cells[0]) for column in columns)
    slider = ""
    if choices:  # the values of a sweep
        slider = (
            f"<label class=choice><input type=range min=0 max={len(choices) - 1} step=1 value=0 "
            f'aria-label="Value"\ndata-names="{text(json.dumps(choices))}">'
            f"<output>{text(choices[0])}</output></label>\n"
        )
    return resource("replay.html").format(
        title=text(scene.title),
        label=text(f"{scene.title}: {scene.stages[0].title}, in three dimensions"),
        options=options,
        readings="".join(f"<div><dt>{name}</dt><dd></dd></div>" for name in names),
        choice=slider,
        # A `<` in data is written as an escape of JSON, so that no text of a document ends the element.
        data=data.replace("<", r"\u003c"),
    )


def _rows(scene: Scene, most: int) -> Rows:
    """The rows that are sent: all, or every second, third and so on, so that they fit; and the last one."""
    wide = 2 * len(single_cells(scene.readings)) + 7 * (scene.orientation is not None)
    for part in (part for stage in scene.stages for part in stage.parts if part.motion != "still"):
        wide += np.asarray(part.mark.points)[0].size
    last = len(scene.times) - 1
    return np.append(np.arange(0, last, -(-len(scene.times) * wide // most) or 1), last)


def _turns(scene: Scene, rows: Rows) -> Floats:
    """The rotation vectors (k, 3; rad, along the body's axes) of the body between the rows.

    That of the two orientations alone leaves out whole turns, which follow from the integral of omega, by
    trapezia.
    """
    steps = np.diff(scene.times)[:, None] * (scene.omega[1:] + scene.omega[:-1]) / 2
    swept = np.diff(np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])[rows], axis=0)
    q = scene.orientation[rows]
    between = rotation.compose(q[:-1] * [1, -1, -1, -1], q[1:])
    sine = np.linalg.norm(between[:, 1:], axis=1)
    along = np.where(sine[:, None] > 0, between[:, 1:], swept)
    size = np.linalg.norm(along, axis=1)
    along = along / np.where(size > 0, size, 1.0)[:, None]
    half = np.arctan2(sine, between[:, 0])
    half += np.pi * np.round((np.einsum("ij,ij->i", swept, along) / 2 - half) / np.pi)
    return np.asarray(2 * half[:, None] * along)


def _seconds(scene: Scene, turns: Floats | None) -> float:
    """The time of a replay at ordinary speed (s): that of the motion, or about a second a turn."""
    duration = float(scene.times[-1] - scene.times[0])
    count = duration if turns is None else float(np.linalg.norm(turns, axis=1).sum()) / (2 * np.pi)
    followed = min(max(count, SHORTEST_REPLAY), LONGEST_REPLAY)
    return duration if 0.4 * followed <= duration <= 2.5 * followed else followed


def _stage(
    scene: Scene, stage: Stage, extent: Extent, rows: Rows, finest: int, arrays: dict[str, int]
) -> dict[str, Any]:
    """A stage as it is sent, in units of its reach; `arrays` holds packed arrays by their place in a list.

    A surface has at most `finest` triangles.
    """
    centre, half, reach = extent
    parts = []
    for part in stage.parts:
        mark = part.mark
        points = triangles(mark.points, finest) if mark.form == "faces" else np.asarray(mark.points)
        points = points if part.motion == "still" else points[rows]
        parts.append(
            {
                **{key: getattr(mark, key) for key in ("form", "style", "quiet")},
                **{key: getattr(part, key) for key in ("motion", "carried")},
                "label": lettered(mark.label),
                "group": lettered(part.group),
                "count": int(points[0].size),
                "points": arrays.setdefault(_packed(points / reach), len(arrays)),
            }
        )
    place = {"centre": (centre / reach).tolist(), "half": (half / reach).tolist()}
    return {"flat": stage.is_flat, **place, "parts": parts}


def _joined(extents: Sequence[Extent]) -> Extent:
    """The extent of views that are shown in turn."""
    low = np.min([centre - half for centre, half, _ in extents], axis=0)
    high = np.max([centre + half for centre, half, _ in extents], axis=0)
    middle = (low + high) / 2
    reach = max(reach + float(np.linalg.norm(centre - middle)) for centre, _, reach in extents)
    return middle, (high - low) / 2, reach


def _extent(scene: Scene, stage: Stage) -> Extent:
    """The middle of a stage (3), half of its extent (3), and its reach from the middle in any direction.

    The middle is on the axis z through O where something turns.
    """
    turns = any(part.carried for part in stage.parts)
    some = np.linspace(0, len(scene.times) - 1, 24).astype(int)  # they show how far a body reaches
    places, solid = [], []
    for part in stage.parts:
        points = part.mark.points
        points = np.concatenate(points) if part.mark.form == "faces" else np.reshape(points, (-1, 3))
        if part.carried:
            some_points = points[:: 1 + len(points) // 300]
            points = rotation.turned(scene.orientation[some, None], some_points).reshape(-1, 3)
        places.append(points)
        solid += [] if part.mark.quiet else [points]
    every = np.concatenate(solid)
    centre = (every.min(axis=0) + every.max(axis=0)) / 2 * ([0, 0, 1] if turns else 1)
    offsets = np.concatenate(places) - centre
    return centre, np.abs(offsets).max(axis=0), float(np.hypot.reduce(offsets, axis=1).max()) or 1.0


def _packed(values: Floats, kind: str = "f4") -> str:
    """Numbers as base64 of floats, the least byte first."""
    return b64encode(np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()).decode()


def triangles(faces: Sequence[Floats], most: int) -> Floats:
    """The triangles (n, 3, 3) of plane faces (each k by 3), convex or not; coarser where they are more."""
    by_corners: dict[int, list[Floats]] = {}
    for face in faces:
        by_corners.setdefault(len(face), []).append(face)
    cut = np.concatenate([_cut(np.array(alike, dtype=float)) for alike in by_corners.values()])
    corners, box = cut.transpose(1, 2, 0), np.array([cut.min(axis=(0, 1)), cut.max(axis=(0, 1))])
    cells = FINEST
    while len(cut) > most and cells > 4:
        cut, cells = simplified(corners, box, cells), cells // 2
    return cut[:most]


def _cut(faces: Floats) -> Floats:
    """The triangles (m (k - 2), 3, 3) of faces (m, k, 3): fans, where these do not overlap."""
    first = np.broadcast_to(faces[:, :1], faces[:, 1:-1].shape)
    fans = np.stack([first, faces[:, 1:-1], faces[:, 2:]], axis=2)
    normals = np.cross(fans[:, :, 1] - fans[:, :, 0], fans[:, :, 2] - fans[:, :, 0])
    whole = normals.sum(axis=1)
    for place in np.flatnonzero((np.einsum("mki,mi->mk", normals, whole) < 0).any(axis=1)):
        fans[place] = solids.triangles(faces[place], FLOAT)[0]
    return fans.reshape(-1, 3, 3)
