"""Forms of body against explicit clouds of points, holes good and bad, known tensors, every way to turn."""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import rigidcli
from rigidcli.bodies.composites import Composite
from rigidcli.bodies.shapes import Region
from rigidcli.errors import DocumentError
from tests.bodies.test_shapes import loaded, result, scaled
from tests.tables import rows_of

Floats = NDArray[np.float64]
Body = Mapping[str, Any]

few = settings(max_examples=30)


def refusal(body: Body, **rest: Any) -> str:
    with pytest.raises(DocumentError) as caught:
        loaded(body, **rest)
    return str(caught.value)


def sums(points: Any, about: Sequence[float] | None = None) -> tuple[float, Floats, Floats]:
    """Mass, centre, and tensor about the centre or a point, of rows m, x, y, z: term by term."""
    rows = np.asarray(points, dtype=float)
    mass = float(math.fsum(rows[:, 0]))
    com = np.array([math.fsum(rows[:, 0] * rows[:, k]) for k in (1, 2, 3)]) / mass
    tensor = np.zeros((3, 3))
    for m, *place in rows:
        x, y, z = np.array(place) - (com if about is None else np.array(about))
        tensor += m * np.array(
            [
                [y * y + z * z, -x * y, -x * z],
                [-x * y, x * x + z * z, -y * z],
                [-x * z, -y * z, x * x + y * y],
            ]
        )
    return mass, com, tensor


def same(found: Any, points: Any, tolerance: float = 1e-13) -> None:
    """The result is that of the cloud, to `tolerance` of what M times its extent squared is."""
    mass, com, central = sums(points)
    _, _, about = sums(points, found["about"])
    reach = max(1.0, float(np.abs(np.asarray(points, dtype=float)[:, 1:]).max()))
    assert found["mass"] == pytest.approx(mass, rel=tolerance, abs=0)
    assert np.abs(found["center_of_mass"] - com).max() <= tolerance * reach
    assert np.abs(found["tensor_com"] - central).max() <= tolerance * mass * reach**2
    assert (
        np.abs(found["tensor"] - about).max()
        <= tolerance * mass * (reach + np.abs(found["about"]).max()) ** 2
    )


def moved(points: Any, turn: Any, shift: Any) -> Floats:
    rows = np.asarray(points, dtype=float)
    return np.hstack([rows[:, :1], rows[:, 1:] @ np.asarray(turn).T + np.asarray(shift)])


CLOUD: list[list[float]] = [[1, 1, 0, 0.5], [2, -0.5, 2, 0], [0.5, 0, -1, 3], [1.5, 0.25, 0.75, -1]]

# --- point masses


def test_points_inline_as_rows_mappings_and_quantities() -> None:
    expected: list[list[float]] = [[1, 1, 0, 0], [2, 0, 1, 1], [0.25, -0.03, 0, 2]]
    same(result({"points": expected}), expected)
    mappings = [{"mass": m, "position": place} for m, *place in expected]
    same(result({"points": mappings}), expected)
    mixed = [[1, 1, 0, 0], {"mass": "2 kg", "position": [0, "100 cm", "1 m"]}, ["250 g", "-3 cm", 0, "2 m"]]
    same(result({"points": mixed}), expected)
    with_parameters = [["m", "a", 0, 0], ["2*m", 0, "a", "a"], ["m/4", "-3*a/100", 0, "2*a"]]
    same(result({"points": with_parameters}, parameters={"m": 1, "a": 1}), expected)


def test_one_point_and_points_about_another() -> None:
    same(result({"points": [[2, 1, 2, 3]]}), [[2, 1, 2, 3]])
    same(result({"points": CLOUD}, about=[3, -2, 1]), CLOUD)
    same(result({"points": CLOUD}, about="com"), CLOUD)


@pytest.mark.parametrize(
    "row", [[0, 1, 1, 1], [-1, 0, 0, 0], [1, 2, 3], [1, 2, 3, 4, 5], {"mass": 1}, ["1 m", 0, 0, 0]]
)
def test_what_is_no_point_mass_is_refused(row: Any) -> None:
    assert "points" in refusal({"points": [[1, 0, 0, 0], row]})


def test_points_from_a_file_are_placed_as_well(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    cloud = np.hstack([rng.uniform(0.1, 2, (300, 1)), rng.normal(size=(300, 3))])
    np.save(tmp_path / "cloud.npy", cloud)
    columns = "\n".join(",".join(repr(float(v)) for v in (x, m, z, y)) for m, x, y, z in cloud)
    (tmp_path / "cloud.csv").write_text(f"x,m,z,y\n{columns}\n")
    turn = Rotation.from_rotvec([0, 0, math.pi / 6]).as_matrix()
    for file in ("cloud.npy", "cloud.csv"):
        text = json.dumps(
            {
                "body": {
                    "points": file,
                    "position": [1, 2, 3],
                    "rotation": {"axis": [0, 0, 1], "angle": math.pi / 6},
                }
            }
        )
        same(rigidcli.inertia(rigidcli.loads(text, folder=tmp_path)), moved(cloud, turn, [1, 2, 3]))


# --- every way to turn

SEQUENCES = [
    "".join(axes) for axes in itertools.product("xyz", repeat=3) if axes[0] != axes[1] and axes[1] != axes[2]
]
QUATERNION = [0.3, -0.4, 1.2, 0.5]
MATRIX = Rotation.from_euler("ZYX", [0.2, -1.3, 2.9]).as_matrix()
SPELLINGS: list[tuple[dict[str, Any], Floats]] = [
    ({"axis": [1, 2, -2], "angle": 0.7}, Rotation.from_rotvec(np.array([1, 2, -2]) / 3 * 0.7).as_matrix()),
    ({"axis": [0, 0, -5], "angle": "30 deg"}, Rotation.from_rotvec([0, 0, -math.pi / 6]).as_matrix()),
    ({"axis": [0, 1, 0], "angle": "pi/3"}, Rotation.from_rotvec([0, math.pi / 3, 0]).as_matrix()),
    ({"euler": [0.4, 1.0, -2.0]}, Rotation.from_euler("ZXZ", [0.4, 1.0, -2.0]).as_matrix()),
    ({"euler": ["10 deg", "pi/4", 0]}, Rotation.from_euler("ZXZ", [10, 45, 0], degrees=True).as_matrix()),
    ({"rpy": [0.4, 1.0, -2.0]}, Rotation.from_euler("xyz", [0.4, 1.0, -2.0]).as_matrix()),
    ({"quaternion": QUATERNION}, Rotation.from_quat([*QUATERNION[1:], QUATERNION[0]]).as_matrix()),
    ({"quaternion": [-7, 0, 0, 0]}, np.eye(3)),
    ({"matrix": MATRIX.tolist()}, MATRIX),
    *(
        (
            {"euler": [0.4, 1.0, -2.0], "sequence": name},
            Rotation.from_euler(name.upper(), [0.4, 1, -2]).as_matrix(),
        )
        for name in SEQUENCES
    ),
]


@pytest.mark.parametrize(
    ("rotation", "turn"), SPELLINGS, ids=lambda value: None if isinstance(value, np.ndarray) else str(value)
)
def test_every_spelling_of_a_rotation(rotation: dict[str, Any], turn: Floats) -> None:
    shift = [1, -2, 0.5]
    same(result({"points": CLOUD, "rotation": rotation, "position": shift}), moved(CLOUD, turn, shift))
    # As a frame, its axes are those that the turned x, y, z point along: components there are R^T v.
    same(result({"points": CLOUD}, frame=rotation), moved(CLOUD, turn.T, [0, 0, 0]))


AXES: list[list[float]] = rows_of(__file__, "axes")


@pytest.mark.parametrize("axis", AXES)
def test_axis_turns_z_onto_it_the_short_way(axis: list[float]) -> None:
    unit = np.array(axis) / np.linalg.norm(axis)
    across = np.cross([0, 0, 1], unit)
    angle = math.atan2(float(np.linalg.norm(across)), float(unit[2]))
    # Along -z any turn across z would do; the interface leaves it open and the code says: about x.
    n = across / np.linalg.norm(across) if np.linalg.norm(across) > 0 else np.array([1.0, 0, 0])
    turn = Rotation.from_rotvec(n * angle).as_matrix()
    same(result({"points": CLOUD, "axis": axis, "position": [1, 1, 1]}), moved(CLOUD, turn, [1, 1, 1]))


@pytest.mark.parametrize(
    ("rotation", "word"),
    rows_of(__file__, "what is no rotation is refused"),
)
def test_what_is_no_rotation_is_refused(rotation: dict[str, Any], word: str) -> None:
    text = refusal({"points": CLOUD, "rotation": rotation})
    assert word in text
    assert "body.rotation" in text


# --- placing every form


def _equimomental(mass: float, com: Any, second: Any) -> list[list[float]]:
    """Six points with this mass, centre and mean r r^T about it: pairs along the axes of the ellipsoid."""
    values, vectors = np.linalg.eigh(np.array(second, dtype=float))
    arms = [s * math.sqrt(3 * max(v, 0.0)) * vectors[:, k] for k, v in enumerate(values) for s in (1, -1)]
    return [[mass / 6, *(np.array(com) + arm)] for arm in arms]


# A box by its corner, a half disk, the same cloud as points and as a tensor, moments, and a composite.
BOX = {"shape": "box", "size": [2, 4, 6], "mass": 3, "anchor": "corner"}
BOX_CLOUD = _equimomental(3, [1, 2, 3], np.diag([4, 16, 36]) / 12)
HALF = {"shape": "half_disk", "radius": 2, "mass": 5}
HALF_CLOUD = _equimomental(5, [0, 8 / (3 * math.pi), 0], np.diag([1, 1 - (8 / (3 * math.pi)) ** 2, 0]))
MASS, COM, CENTRAL = sums(CLOUD)
KNOWN = {"inertia": CENTRAL.tolist(), "mass": MASS, "com": COM.tolist()}
MOMENTS = {"moments": [4, 5, 7], "mass": 2, "com": [1, 0, -1]}
MOMENTS_CLOUD = _equimomental(2, [1, 0, -1], np.diag([8 / 2, 6 / 2, 2 / 2]) / 2)
FORMS: list[tuple[Body, Any]] = [
    ({"points": CLOUD}, CLOUD),
    (BOX, BOX_CLOUD),
    (HALF, HALF_CLOUD),
    (KNOWN, CLOUD),
    (MOMENTS, MOMENTS_CLOUD),
    ({"parts": [BOX, KNOWN]}, [*BOX_CLOUD, *CLOUD]),
]


def test_the_clouds_stand_for_the_forms_in_any_place() -> None:
    place = {"axis": [2, -1, 2], "position": [3, -1, 0.5]}
    for body, cloud in FORMS:
        same(result(body), cloud)
        same(result({**body, **place}), moved(cloud, TURNS[0][1], place["position"]))
    assert sums(MOMENTS_CLOUD)[2] == pytest.approx(np.diag([4, 5, 7]), abs=1e-14)


# --- composites

SHORT = np.array([1, 2, 0]) / math.sqrt(5) * math.acos(2 / 3)  # along z x axis, by the angle between
TURNS: list[tuple[dict[str, Any], Floats]] = [
    ({"axis": [2, -1, 2]}, Rotation.from_rotvec(SHORT).as_matrix()),
    *(({"rotation": rotation}, turn) for rotation, turn in SPELLINGS[:8]),
]


@st.composite
def placements(draw: st.DrawFn) -> tuple[dict[str, Any], Floats, Floats]:
    extra, turn = draw(st.sampled_from(TURNS))
    shift = np.array([draw(st.integers(-16, 16)) / 4 for _ in range(3)])
    return extra | {"position": shift.tolist()}, turn, shift


@st.composite
def nested(draw: st.DrawFn, depth: int = 3) -> tuple[dict[str, Any], Floats]:
    """A composite, and the cloud of which it is made."""
    parts, clouds = [], []
    for _ in range(draw(st.integers(1, 3))):
        if depth and draw(st.booleans()):
            part, cloud = draw(nested(depth - 1))
        else:
            form, points = draw(st.sampled_from(FORMS[:5]))
            part, cloud = dict(form), np.array(points, dtype=float)
        place, turn, shift = draw(placements())
        parts.append(part | place)
        clouds.append(moved(cloud, turn, shift))
    return {"parts": parts}, np.vstack(clouds)


@few
@given(nested(), placements(), st.sampled_from(["origin", "com", [1, 2, -3]]))
def test_nested_composites_equal_all_their_points(
    tree: tuple[dict[str, Any], Floats], place: Any, about: Any
) -> None:
    body, cloud = tree
    extra, turn, shift = place
    same(result(body | extra, about=about), moved(cloud, turn, shift))


# --- holes: bad ones


def solid(shape: str, density: Any = 1.0, **rest: Any) -> dict[str, Any]:
    return {"shape": shape, "density": density, **rest}


def cut(shape: str, density: Any = 1.0, **rest: Any) -> dict[str, Any]:
    return {"shape": shape, "density": density, "hole": True, **rest}


CUBE = solid("cube", side=2)
PLATE = solid("plate", size=[4, 4])
HOLES: dict[str, Any] = yaml.safe_load(Path(__file__).with_name("holes.yaml").read_text(encoding="utf-8"))
CONVEX: dict[str, dict[str, Any]] = HOLES["convex"]


@pytest.mark.parametrize("name", HOLES["bad"])
def test_a_bad_hole_is_refused(name: str) -> None:
    """Wherever the whole stands, and one level down."""
    parts = HOLES["bad"][name]
    place = {"rotation": {"euler": [0.3, 0.8, 1.9]}, "position": [1, 2, 3]}
    for body in ({"parts": parts}, {"parts": [{"parts": parts, **place}]}):
        assert re.search("hole|taken away", refusal(body))


@pytest.mark.parametrize("scale", [1e-10, 1e-3, 1e6])
def test_bad_holes_are_bad_at_any_scale(scale: float) -> None:
    refusal(
        {"parts": [solid("cube", side=2 * scale), cut("cube", side=scale, position=[0, 0.51 * scale, 0])]}
    )
    refusal(
        {"parts": [solid("disk", radius=2 * scale), cut("disk", radius=scale, position=[0, 1.01 * scale, 0])]}
    )


def test_the_refusal_names_the_hole() -> None:
    text = refusal({"parts": [CUBE, {"parts": [cut("sphere", radius=0.1, position=[5, 0, 0]), CUBE]}]})
    assert "body.parts.1.parts.0" in text
    text = refusal(
        {"parts": [CUBE, cut("sphere", radius=0.1), cut("sphere", radius=0.5, position=[0, 0, 0.6])]}
    )
    assert "body.parts.2" in text


def test_one_slip_is_one_problem() -> None:
    for slip in (
        {"parts": [CUBE, {"shape": "sphere", "radius": 0.1, "hole": "maybe"}]},
        {"inertia": [[1, 0], [0, 1]], "mass": 1},
    ):
        assert len(refusal(slip).splitlines()) == 1


def test_areas_are_told_per_area() -> None:
    text = refusal({"parts": [PLATE, cut("disk", radius=0.5, density=2)]})
    assert "kg/m^3" not in text
    assert "kg/m^2" in text


# --- holes: good ones


@pytest.mark.parametrize("name", HOLES["good"])
def test_a_good_hole_is_accepted(name: str) -> None:
    parts = HOLES["good"][name]
    whole = result({"parts": parts})
    place = {"rotation": {"euler": [0.3, 0.8, 1.9]}, "position": [1, 2, 3]}
    # As a part that is turned and moved; or each part turned by itself, where none has a place of its own.
    body = {"parts": [{"parts": parts, **place}]}
    if not any(part.keys() & {"position", "axis", "rotation"} for part in parts):
        body = {"parts": [part | place for part in parts]}
    assert result(body)["mass"] == pytest.approx(whole["mass"], rel=1e-14, abs=0)


SIDE_BY_SIDE = [solid("box", size=[4, 4, 4], position=[x, 0, 0]) for x in (-2, 2)]


@pytest.mark.parametrize(
    ("shape", "d"),
    [
        ("hollow_sphere", {"outer_radius": 1, "inner_radius": 1 - 1e-11}),
        ("tube", {"outer_radius": 1, "inner_radius": 1 - 1e-11, "height": 1}),
        ("torus", {"major_radius": 1, "minor_radius": 1e-11}),
        ("annulus", {"outer_radius": 1, "inner_radius": 1 - 1e-11}),
    ],
)
def test_a_thin_hole_is_seen_where_it_is(shape: str, d: dict[str, float]) -> None:
    plates = [solid("plate", size=[4, 4], position=[x, 0, 0]) for x in (-2, 2)]
    sides = plates if shape == "annulus" else SIDE_BY_SIDE
    whole = PLATE if shape == "annulus" else solid("cube", side=4)
    for parts, mass in ((sides, 2), ([whole], 1)):
        found = result({"parts": [*parts, cut(shape, **d)]})["mass"]
        assert found == pytest.approx(mass * (4**2 if shape == "annulus" else 4**3))
        with pytest.raises(DocumentError, match="the hole reaches outside the body"):
            result({"parts": [*parts, cut(shape, **d, position=[0, 1.5, 0])]})


@pytest.mark.parametrize(
    "body", [solid("box", size=[40, 1, 1]), solid("tube", outer_radius=9, inner_radius=0, height=1)]
)
def test_many_holes_take_little_more_than_one(body: Body, monkeypatch: pytest.MonkeyPatch) -> None:
    looked_at, contains = [0], Region.contains

    def counted(self: Region, x: Any, y: Any, z: Any) -> Any:
        looked_at[0] += np.size(x) * (self.shape == "cylinder")
        return contains(self, x, y, z)

    monkeypatch.setattr(Region, "contains", counted)
    counts = []
    for count in (1, 4, 7):
        looked_at[0] = 0
        hole = cut("cylinder", radius=0.1, height=1 - count / 100)
        result({"parts": [body, *(hole | {"position": [x, 0, 0]} for x in range(count))]})
        counts.append(looked_at[0])
    assert counts[2] < 5 * (counts[0] or 1)  # each is compared with its own points; these are made once


def test_parts_are_looked_at_once_for_all_holes_without_a_density(monkeypatch: pytest.MonkeyPatch) -> None:
    looked, leaves = [0], Composite.leaves

    def counted(self: Composite, arithmetic: Any) -> Any:
        looked[0] += 1
        return leaves(self, arithmetic)

    monkeypatch.setattr(Composite, "leaves", counted)
    hole = {"shape": "sphere", "radius": 0.1, "hole": True}
    holes = [hole | {"position": [x, 0, 0]} for x in range(20)]
    found = result({"parts": [solid("box", 3.0, size=[41, 1, 1]), *holes]})
    assert found["mass"] == pytest.approx(3 * (41 - 20 * 4 * math.pi / 3 * 0.1**3), rel=1e-14)
    assert looked[0] < 4


def test_holes_in_turned_parts_side_by_side() -> None:
    # Two boxes that share a face, each turned and placed by itself, as a drawing would have them.
    rng = np.random.default_rng(8)
    for _ in range(40):
        wide, other, angle = rng.uniform(0.1, 2, 3)
        turn = Rotation.from_rotvec([0, 0, angle]).as_matrix()
        rotation = {"rotation": {"axis": [0, 0, 1], "angle": angle}}
        parts = [
            solid("box", size=[wide, 1, 1], position=(turn @ [wide / 2, 0, 0]).tolist(), **rotation),
            solid("box", size=[other, 1, 1], position=(turn @ [-other / 2, 0, 0]).tolist(), **rotation),
            cut("cylinder", radius=0.04, height=0.5, **rotation),
        ]
        assert result({"parts": parts})["mass"] > 0


@pytest.mark.parametrize("shape", CONVEX)
@pytest.mark.parametrize("factor", [0.3, 0.99])
def test_a_smaller_copy_fits_into_every_convex_shape(shape: str, factor: float) -> None:
    d = CONVEX[shape]
    small = {key: scaled(value, factor) for key, value in d.items()}
    place = {"rotation": {"euler": [0.3, 0.8, 1.9]}, "anchor": "com", "position": [1, 2, 3]}
    whole, less = result(solid(shape, **d, **place)), result(cut(shape, **small, **place) | {"hole": False})
    rest = result({"parts": [solid(shape, **d, **place), cut(shape, **small, **place)]})
    assert rest["mass"] == pytest.approx(whole["mass"] - less["mass"], rel=1e-12, abs=0)
    expected = whole["tensor_com"] - less["tensor_com"]
    assert np.abs(rest["tensor_com"] - expected).max() <= 1e-13 * np.abs(whole["tensor_com"]).max()


@pytest.mark.parametrize("shape", CONVEX)
@pytest.mark.parametrize("factor", [1.02, 3.0])
def test_a_larger_copy_fits_into_no_shape(shape: str, factor: float) -> None:
    d = CONVEX[shape]
    large = {key: scaled(value, factor) for key, value in d.items()}
    place = {"rotation": {"euler": [0.3, 0.8, 1.9]}, "anchor": "com", "position": [1, 2, 3]}
    flat = shape in ("plate", "disk", "half_disk", "triangle", "polygon")
    size = {"size": [50, 50]} if flat else {"side": 50}
    other = solid("plate" if flat else "cube", **size, position=[100, 0, 0])
    # A large body far away, so that neither the mass nor the tensor of the whole is absurd.
    refusal({"parts": [solid(shape, **d, **place), other, cut(shape, **large, **place)]})


@settings(max_examples=40, derandomize=True)
@given(
    st.lists(st.integers(-64, 64), min_size=4, max_size=4).filter(any),
    st.sampled_from(["sphere", "cube", "cylinder", "ellipsoid", "tetrahedron", "cone"]),
    st.booleans(),
)
@example([-8, -9, -6, 0], "cylinder", False)
@example([40, 7, 31, -12], "cone", True)
def test_one_per_cent_decides_in_any_direction(quaternion: list[int], shape: str, fits: bool) -> None:
    # A slab just as thick as the hole, turned anyhow: what sticks out by 1 % of half its width is found.
    turn = Rotation.from_quat([*quaternion[1:], quaternion[0]]).as_matrix()
    normal = turn[:, 2]
    d = CONVEX[shape]
    low, high = -_support(shape, d, -normal), _support(shape, d, normal)
    middle, half = (low + high) / 2, (high - low) / 2
    slab = solid(
        "box",
        size=[100, 100, 2 * half * (1 + 1e-9 if fits else 0.99)],
        rotation={"quaternion": quaternion},
        position=(middle * normal).tolist(),
    )
    body = {"parts": [slab, cut(shape, **d)]}
    if fits:
        assert result(body)["mass"] > 0
    else:
        refusal(body)


def _support(shape: str, d: Mapping[str, Any], n: Floats) -> float:
    """How far the shape reaches along the unit vector n: the support function of convex geometry."""
    across = math.hypot(n[0], n[1])
    if shape == "tetrahedron":
        return float(max(np.array(d["vertices"]) @ n))
    if shape == "cube":
        return float(d["side"] / 2 * np.abs(n).sum())
    if shape == "cylinder":
        return float(d["radius"] * across + d["height"] / 2 * abs(n[2]))
    if shape == "cone":
        return float(max(0.0, d["radius"] * across + d["height"] * n[2]))
    return float(np.linalg.norm(n * np.array(d.get("semi_axes", 3 * [d.get("radius", 1)]))))


# --- holes that make another shape


@pytest.mark.parametrize(
    ("parts", "whole"),
    [
        (
            [solid("cylinder", radius=2, height=3), cut("cylinder", radius=0.5, height=3)],
            solid("tube", outer_radius=2, inner_radius=0.5, height=3),
        ),
        (
            [solid("sphere", radius=2), cut("spherical_cap", radius=2, cap_height=3, axis=[0, 0, -1])],
            solid("spherical_cap", radius=2, cap_height=1),
        ),
        (
            [
                solid("plate", size=[3, 4], anchor="corner"),
                cut("plate", size=[2, 3], anchor="corner", position=[1, 1, 0]),
            ],
            solid("polygon", vertices=[[0, 0], [3, 0], [3, 1], [1, 1], [1, 4], [0, 4]]),
        ),
        (
            # A refilled hole is a body of two densities.
            [solid("sphere", radius=2), cut("sphere", radius=1), solid("sphere", radius=1, density=5)],
            {
                "parts": [
                    solid("hollow_sphere", outer_radius=2, inner_radius=1),
                    solid("sphere", radius=1, density=5),
                ]
            },
        ),
    ],
)
def test_what_a_hole_leaves(parts: list[dict[str, Any]], whole: dict[str, Any]) -> None:
    found, expected = result({"parts": parts}), result(whole)
    assert found["mass"] == pytest.approx(expected["mass"], rel=1e-14, abs=0)
    assert np.abs(found["center_of_mass"] - expected["center_of_mass"]).max() < 1e-14
    uncut = result({"parts": parts[:1]})
    # What is left keeps the digits that the uncut body had.
    scale = np.abs(uncut["tensor"]).max()
    for key in ("tensor", "tensor_com"):
        assert np.abs(found[key] - expected[key]).max() <= 1e-14 * scale


# --- known tensors

ELSEWHERE = [2.0, -1.0, 0.5]


@pytest.mark.parametrize(
    ("given_about", "point"), [("com", None), ("origin", [0.0, 0.0, 0.0]), (ELSEWHERE, ELSEWHERE)]
)
@pytest.mark.parametrize("about", ["com", "origin", [1, 2, 3]])
def test_a_tensor_given_about_any_point(given_about: Any, point: Any, about: Any) -> None:
    body = {
        "inertia": sums(CLOUD, point)[2].tolist(),
        "mass": MASS,
        "com": COM.tolist(),
        "given_about": given_about,
    }
    same(result(body, about=about), CLOUD)
    turn = Rotation.from_euler("ZXZ", [0.4, 1, -2]).as_matrix()
    placed = body | {"rotation": {"euler": [0.4, 1, -2]}, "position": [1, 2, 3]}
    same(result(placed, about=about), moved(CLOUD, turn, [1, 2, 3]))


def test_moments_lie_along_the_forms_axes() -> None:
    found = result({"moments": [2, 3, 4], "mass": 1})
    assert found["tensor"].tolist() == np.diag([2, 3, 4]).tolist()
    turned = result({"moments": [2, 3, 4], "mass": 1, "rotation": {"axis": [0, 0, 1], "angle": "90 deg"}})
    assert turned["tensor"] == pytest.approx(np.diag([3, 2, 4]), abs=1e-15)
    about = result({"moments": [2, 3, 4], "mass": 2, "com": [1, 0, 0], "given_about": "origin"})
    assert about["tensor"] == pytest.approx(np.diag([2, 3, 4]), abs=1e-15)
    assert about["tensor_com"] == pytest.approx(np.diag([2, 1, 2]), abs=1e-15)


@pytest.mark.parametrize(
    ("body", "law"),
    rows_of(__file__, "what no body can have is refused"),
)
def test_what_no_body_can_have_is_refused(body: Body, law: str) -> None:
    assert law in refusal(body)


@pytest.mark.parametrize(
    "moments", [[1, 1, 2], [0, 1, 1], [1, 1, 1], [1e-47, 1e-47, 2e-47], [8.0e37, 8.0e37, 8.03e37], [0, 0, 0]]
)
def test_limits_of_what_bodies_can_have(moments: list[float]) -> None:
    found = result({"moments": moments, "mass": 1e-26 if 0 < max(moments) < 1e-40 else 1})
    assert np.diag(found["tensor"]).tolist() == moments


def test_a_tensor_must_be_symmetric() -> None:
    base: list[list[float]] = [[2.0, 0.5, 0], [0.5, 2, 0], [0, 0, 3]]
    fine = [row.copy() for row in base]
    fine[0][1] += 2e-9
    assert result({"inertia": fine, "mass": 1})["tensor"][0, 1] == pytest.approx(0.5 + 1e-9, rel=1e-12, abs=0)
    base[0][1] += 4e-9
    assert "symmetric" in refusal({"inertia": base, "mass": 1})


# --- known tensors without a mass


def test_without_a_mass_what_needs_it_is_null() -> None:
    found = result({"moments": [2, 3, 4]})
    assert found["mass"] is None
    assert found["tensor"].tolist() == np.diag([2, 3, 4]).tolist()
    about_origin = result({"moments": [2, 3, 4], "com": [1, 0, 0], "given_about": "origin"})
    assert about_origin["mass"] is None
    assert about_origin["tensor"].tolist() == np.diag([2, 3, 4]).tolist()
    assert about_origin["tensor_com"] is None


def test_without_a_mass_it_is_given_about_the_point_asked_for() -> None:
    for body, about in (
        ({"moments": [2, 3, 4]}, "com"),
        ({"moments": [2, 3, 4], "com": [1, 2, 3]}, "com"),
        ({"moments": [2, 3, 4], "com": [1, 2, 3]}, [1, 2, 3]),
        ({"moments": [2, 3, 4], "com": [1, 2, 3], "given_about": "origin"}, "origin"),
        ({"moments": [2, 3, 4], "com": [1, 2, 3], "given_about": [4, 5, 6]}, [4, 5, 6]),
        ({"moments": [2, 3, 4], "position": [1, 2, 3]}, [1, 2, 3]),
        ({"moments": [2, 3, 4], "position": [1, 2, 3], "given_about": [1, 0, 0]}, [2, 2, 3]),
    ):
        assert result(body, about=about)["tensor"].tolist() == np.diag([2, 3, 4]).tolist()
    for body, about in (
        ({"moments": [2, 3, 4], "com": [1, 2, 3]}, "origin"),
        ({"moments": [2, 3, 4]}, [1, 0, 0]),
        ({"moments": [2, 3, 4], "com": [1, 2, 3], "given_about": "origin"}, "com"),
        ({"moments": [2, 3, 4], "com": [1, 2, 3], "given_about": "origin"}, [1, 2, 3]),
    ):
        assert "mass" in refusal(body, about=about)


@pytest.mark.parametrize(
    ("body", "about"),
    rows_of(__file__, "the point is the same to rounding"),
)
def test_the_point_is_the_same_to_rounding(body: dict[str, Any], about: Any) -> None:
    found = result({"moments": [2, 2, 4], **body}, about=about)
    assert found["tensor"] == pytest.approx(np.diag([2, 2, 4]), abs=1e-15)
