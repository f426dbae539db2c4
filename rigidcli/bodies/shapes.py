"""The shapes by name. A new one is a class in a module whose name ends in `_shapes`, and a line here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from typing import Any

from rigidcli.bodies.shape import Shape
from rigidcli.errors import ValueProblem, nearest, shown
from rigidcli.fields.words import RELATIVES, not_one_of, other_form, shapes_called

PLACES = {
    "box": "prism_shapes.Box",
    "cube": "prism_shapes.Cube",
    "sphere": "solid_shapes.Sphere",
    "hollow_sphere": "solid_shapes.HollowSphere",
    "ellipsoid": "solid_shapes.Ellipsoid",
    "cylinder": "prism_shapes.Cylinder",
    "tube": "prism_shapes.Tube",
    "elliptic_cylinder": "prism_shapes.EllipticCylinder",
    "half_cylinder": "prism_shapes.HalfCylinder",
    "cone": "solid_shapes.Cone",
    "frustum": "solid_shapes.Frustum",
    "pyramid": "solid_shapes.Pyramid",
    "hemisphere": "solid_shapes.Hemisphere",
    "spherical_cap": "solid_shapes.SphericalCap",
    "capsule": "solid_shapes.Capsule",
    "torus": "solid_shapes.Torus",
    "tetrahedron": "solid_shapes.Tetrahedron",
    "spherical_shell": "thin_shapes.SphericalShell",
    "hemispherical_shell": "thin_shapes.HemisphericalShell",
    "cylindrical_shell": "thin_shapes.CylindricalShell",
    "conical_shell": "thin_shapes.ConicalShell",
    "plate": "flat_shapes.Plate",
    "disk": "flat_shapes.Disk",
    "annulus": "flat_shapes.Annulus",
    "half_disk": "flat_shapes.HalfDisk",
    "triangle": "flat_shapes.Triangle",
    "polygon": "flat_shapes.Polygon",
    "rod": "thin_shapes.Rod",
    "ring": "thin_shapes.Ring",
}
"""What may stand under `shape`: the module of this package that has it, and its class there."""


@cache
def _class(name: str) -> type[Shape]:
    module, _, shape = PLACES[name].partition(".")
    found: type[Shape] = getattr(import_module(f"rigidcli.bodies.{module}"), shape)
    return found


class _Shapes(Mapping[str, type[Shape]]):
    """The shapes by name; a module is loaded when one of its shapes is asked for, as a document has few."""

    def __getitem__(self, name: str) -> type[Shape]:
        return _class(name)

    def __contains__(self, name: object) -> bool:
        return name in PLACES

    def __iter__(self) -> Iterator[str]:
        return iter(PLACES)

    def __len__(self) -> int:
        return len(PLACES)


SHAPES = _Shapes()
"""The classes of the shapes."""


def shape_called(name: object, raw: Mapping[str, Any]) -> tuple[type[Shape] | None, ValueProblem | None]:
    """The shape of a name, or that for which it is a word; and its problem, unless it is that name.

    Of several the one that has most of the other keys in `raw` is meant, be it only a relative of the others.
    """
    word = name if isinstance(name, str) else ""
    named = SHAPES.get(word)
    if named is not None and raw.keys() <= named.model_fields.keys():
        lists = (key for key, value in raw.items() if isinstance(value, list) and key in named.dimensions())
        if all(named.holds(key, raw[key]) for key in lists):
            return named, None
    form = other_form(word)
    if word not in SHAPES and form is not None:
        return None, ValueProblem(f"{shown(name)} is no shape", hint=f"write `{form}` instead of `shape`")
    called = [word] if word in SHAPES else [each for each in shapes_called(word) if each in SHAPES]
    if not called:
        near = nearest(word, list(SHAPES))
        return (near and SHAPES[near]) or None, ValueProblem(not_one_of(name, list(SHAPES)))
    called += [other for each in called for other in RELATIVES.get(each, "").split()]
    best = max((SHAPES[each] for each in called), key=lambda shape: _likeness(shape, raw))
    if best.word() == word:
        return best, None
    return best, ValueProblem(f"read {shown(name)} (did you mean {best.word()}?)", hint=best.summary())


def _likeness(shape: type[Shape], raw: Mapping[str, Any]) -> int:
    """How many of the keys in `raw` are dimensions of the shape in some word: twice where the value fits."""
    found = [(shape.key_for(*item), item[1]) for item in raw.items()]
    return sum((name is not None) + shape.holds(name, value) for name, value in found)
