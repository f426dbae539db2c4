"""The shapes of bodies: dimensions, anchors and axes, from their classes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args, get_origin

from rigidcli.bodies.shape import Shape
from rigidcli.bodies.shapes import SHAPES
from rigidcli.core.arithmetic import FLOAT
from rigidcli.reference.fields import first_sentence, said
from rigidcli.reference.page import page, paragraph, rows


class _Typed(str):
    """A dimension by its name, which anchors use as if it were a number."""

    __slots__ = ()

    def __neg__(self) -> _Typed:
        return _Typed(f"-{self}")

    def __truediv__(self, other: object) -> _Typed:
        return _Typed(f"{self}/{other}")

    def __iter__(self) -> Iterator[_Typed]:
        return map(_Typed, "xyz")

    def __getitem__(self, index: Any) -> _Typed:
        return _Typed("xyz"[index])


class _Dimensions:
    """A shape whose dimensions are their names."""

    def __getattr__(self, name: str) -> _Typed:
        return _Typed(name)


def shape_page(head: str, shape: type[Shape]) -> str:
    """What a shape is, its dimensions, and its anchors where they lie along z."""
    own = [(shape.dimensions()[name], said(shape.model_fields[name])) for name in shape.dimensions()]
    names = _Dimensions()
    anchors = [(name, f"({', '.join(map(str, place(names)))})") for name, place in shape.ANCHORS.items()]
    shared = {name: field for name, field in shape.model_fields.items() if name not in shape.dimensions()}
    return page(
        head,
        paragraph(first_sentence(shape)),
        "dimensions\n" + rows(own),
        "anchors, in the shape's own axes\n"
        + rows([*anchors, ("com", "the centre of mass")])
        + _sketch(shape),
        "any shape has\n" + rows([(name, said(field)) for name, field in shared.items()]),
    )


def _sketch(shape: type[Shape]) -> str:
    """The origin, the centre of mass and the anchors in their order along z; nothing where these are one."""
    fields = {name: shape.model_fields[name] for name in shape.dimensions()}
    if any(name == "vertices" for name in fields):
        return ""
    sample: dict[str, Any] = {
        name: tuple(1.0 for _ in get_args(field.annotation)) if get_origin(field.annotation) is tuple else 1.0
        for name, field in fields.items()
    }
    sample |= {name: 0.5 for name in fields if name.startswith(("inner", "top", "minor", "cap"))}
    drawn = shape.model_construct(None, **sample)
    places = {"O": 0.0, "com": float(drawn.geometry(FLOAT).centre[2])}
    places |= {name: float(place(drawn)[2]) for name, place in shape.ANCHORS.items()}
    heights = sorted(set(places.values()))
    if len(heights) == 1:
        return ""
    points = ["=".join(name for name, z in places.items() if z == height) for height in heights]
    return f"\n  {' ---- '.join(points)} ---> z    (O is the origin of its own axes)"


def dimension_page(name: str) -> str | None:
    """A dimension of shapes, and which have it; None for another name."""
    having = [shape for shape in SHAPES.values() if name in shape.dimensions()]
    if not having:
        return None
    return page(
        f"{name}: a dimension of shapes",
        rows([(each.word(), said(each.model_fields[name])) for each in having]),
    )


def shapes_page(head: str = "shapes") -> str:
    """All shapes, each with its dimensions."""
    listed = [(name, ", ".join(shape.dimensions().values())) for name, shape in SHAPES.items()]
    return page(head, rows(listed), "`rigidcli explain cone` tells more of one.")
