"""The shapes by name, and the words that people have for them. A new one is a primitive, and a row here."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache
from typing import Any, TypeVar

from rigidcli.bodies import primitives
from rigidcli.bodies.shape import Anchor, Lamina, Shape, Shell, Solid, Wire, section
from rigidcli.errors import ValueProblem, did_you_mean, nearest, shown
from rigidcli.fields.words import RELATIVES, lists_meant, not_one_of, other_form, shapes_called

BASE: dict[str, Anchor] = {"base": lambda s: (0, 0, -s.height / 2)}
"""The anchor of what stands on a base, with its origin half way up."""

TIP: dict[str, Anchor] = {"apex": lambda s: primitives.ORIGIN, "base": lambda s: (0, 0, s.height)}
"""The anchors of what opens from an apex at its origin."""

PRIMITIVES: dict[Callable[..., Any], tuple[type[Shape], dict[str, Anchor]]] = {
    primitives.box: (Solid, {"corner": lambda s: tuple(-side / 2 for side in s.size)}),
    primitives.cube: (Solid, {"corner": lambda s: 3 * (-s.side / 2,)}),
    primitives.sphere: (Solid, {}),
    primitives.hollow_sphere: (Solid, {}),
    primitives.ellipsoid: (Solid, {}),
    primitives.cylinder: (Solid, BASE),
    primitives.tube: (Solid, BASE),
    primitives.elliptic_cylinder: (Solid, BASE),
    primitives.half_cylinder: (Solid, {}),
    primitives.cone: (Solid, TIP),
    primitives.frustum: (Solid, {"top": lambda s: (0, 0, s.height)}),
    primitives.pyramid: (Solid, {"apex": lambda s: (0, 0, s.height)}),
    primitives.hemisphere: (Solid, {}),
    primitives.spherical_cap: (Solid, {}),
    primitives.capsule: (Solid, {}),
    primitives.torus: (Solid, {}),
    primitives.tetrahedron: (Solid, {}),
    primitives.prism: (Solid, BASE),
    primitives.spherical_shell: (Shell, {}),
    primitives.hemispherical_shell: (Shell, {}),
    primitives.cylindrical_shell: (Shell, BASE),
    primitives.conical_shell: (Shell, TIP),
    primitives.plate: (Lamina, {"corner": lambda s: (-s.size[0] / 2, -s.size[1] / 2, 0)}),
    primitives.disk: (Lamina, {}),
    primitives.annulus: (Lamina, {}),
    primitives.half_disk: (Lamina, {}),
    primitives.triangle: (Lamina, {}),
    primitives.polygon: (Lamina, {}),
    primitives.rod: (Wire, {"end": lambda s: (0, 0, -s.length / 2)}),
    primitives.ring: (Wire, {}),
}
"""Whether a primitive is solid, flat, a shell or a wire, and its anchors besides the centre of mass."""

_NAMED = {primitive.__name__: primitive for primitive in PRIMITIVES}


T = TypeVar("T")


class MadeWhenAsked(Mapping[str, T]):
    """A mapping of these `names`, of which a document needs few: a value is made when it is asked for."""

    def __init__(self, names: Collection[str], make: Callable[[str], T]) -> None:
        self.names, self.make = names, cache(make)

    def __getitem__(self, name: str) -> T:
        if name not in self.names:
            raise KeyError(name)
        return self.make(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


SHAPES = MadeWhenAsked(_NAMED, lambda name: section(_NAMED[name], *PRIMITIVES[_NAMED[name]]))
"""The sections of the shapes."""


def shape_called(name: object, raw: Mapping[str, Any]) -> tuple[type[Shape] | None, ValueProblem | None]:
    """The shape of a name, or that for which it is a word; and its problem, unless it is that name.

    Of several the one that has most of the other keys in `raw` is meant, be it only a relative of the others.
    """
    if isinstance(name, dict):
        words = [word for pair in name.items() for word in pair if isinstance(word, str) and word in SHAPES]
        hint = f"write `shape: {words[0] if words else 'box'}`, and its dimensions beside it"
        return None, ValueProblem("read a mapping, expected the name of a shape", hint=hint)
    word = name if isinstance(name, str) else ""
    named = SHAPES.get(word)
    if named is not None and raw.keys() <= named.model_fields.keys():
        lists = (key for key, value in raw.items() if isinstance(value, list) and key in named.dimensions())
        if all(named.holds(key, raw[key]) for key in lists):
            return named, None
    form = other_form(word)
    if word not in SHAPES and form is not None:
        return None, ValueProblem(f"{shown(name)} is no shape", hint=f"write `{form}` instead of `shape`")
    called = [word] if word in SHAPES else [shape for shape in shapes_called(word) if shape in SHAPES]
    if not called:
        near = nearest(word, list(SHAPES))
        return SHAPES[near] if near else None, ValueProblem(not_one_of(name, list(SHAPES)))
    called += [relative for shape in called for relative in RELATIVES.get(shape, "").split()]
    best = max((SHAPES[shape] for shape in called), key=lambda shape: _likeness(shape, raw))
    if best.word() in (word, word.replace("disc", "disk")):  # both spellings are English
        return best, None
    return best, ValueProblem(f"read {shown(name)}{did_you_mean(best.word())}", hint=best.summary())


def _likeness(shape: type[Shape], raw: Mapping[str, Any]) -> int:
    """How many of the keys in `raw` are dimensions of the shape in some word: twice where the value fits."""
    keys = {key: shape.key_for(key, value) for key, value in raw.items()}
    lists = [words for _, _, words in lists_meant(raw, shape.model_fields)]
    called = sum(1 + shape.holds(name, raw[key]) for key, name in keys.items() if name is not None)
    return called + 2 * sum(map(len, lists))
