"""The shapes as forms of body: their dimensions, and a mass or a density; solid, flat, shells and wires.

A new shape is a function in `primitives`, and a row in `PRIMITIVES`.
"""

# Annotations here are objects, not texts, which pydantic would read anew for each shape.

import inspect
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from decimal import Decimal
from functools import cache, lru_cache
from typing import Annotated, Any, ClassVar, Self, TypeAlias, TypeVar, cast, get_args, get_origin

import numpy as np
from pydantic import ConfigDict, Field, PrivateAttr, ValidationInfo, create_model, model_validator
from pydantic.config import JsonDict, JsonValue
from pydantic.fields import FieldInfo

from rigidcli.bodies import primitives, solids
from rigidcli.bodies.charts import Chart, right_angles
from rigidcli.bodies.density import SAID, Density
from rigidcli.bodies.form import Form
from rigidcli.bodies.primitives import Figure
from rigidcli.core import mass_properties, tensor
from rigidcli.core.arithmetic import FLOAT, Arithmetic, Array, Floats, Mask, Scalar
from rigidcli.errors import ValueProblem, with_article
from rigidcli.fields.dimensions import AREA_DENSITY, DENSITY, LINE_DENSITY
from rigidcli.fields.environment import BoundExpression, Environment
from rigidcli.fields.quantities import Mass
from rigidcli.fields.section import Section, environment, unknown_key
from rigidcli.fields.words import halved, keys_called, not_one_of

# A point (x, y, z in m, own axes) of a shape, which follows from its dimensions.
Anchor: TypeAlias = Callable[[Any], tuple[Any, ...]]

T = TypeVar("T")

# Steps of a net along a straight coordinate, and nine of a right angle; inside is one point in so many.
STEPS_OF_NET, ONE_INSIDE_IN = 17, 7
# How far the net of a shape is drawn in from its ends, in units of its size: beyond all rounding.
NET_DRAWN_IN = 1e-9


class NoValueError(Exception):
    """A number that depends on symbols without a value."""


def floats(value: Any, n: Arithmetic) -> Any:
    """`value` with every number in it as a float. Raises NoValueError."""
    if isinstance(value, dict):
        return {key: floats(item, n) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return tuple(floats(item, n) for item in value)
    if isinstance(value, BoundExpression):
        return BoundExpression(value.expression, floats(value.constants, n))
    if value is None or isinstance(value, str | bool | Section):
        return value
    if (number := n.value(value)) is None:
        raise NoValueError
    return number


def _complete_schema(schema: JsonDict, shape: type[Any]) -> None:
    """Tell JSON Schema the name and the anchors of a shape, and that it has a mass or a density."""
    properties = schema["properties"]
    assert isinstance(properties, dict)
    properties["shape"] = {"const": shape.word(), "title": "Shape", "type": "string"}
    anchor = shape.model_fields["anchor"].description
    properties["anchor"] = {"title": "Anchor", "description": anchor} | {"enum": ["com", *shape.ANCHORS]}
    given: list[JsonValue] = [{"required": ["mass"]}, {"required": ["density"]}]
    bare: JsonValue = {
        "properties": {"hole": {"const": True, "title": "Hole"}},
        "required": ["hole"],
        "not": {"anyOf": given},
    }
    schema["oneOf"] = [*given, bare]


def _is_list(field: FieldInfo) -> bool:
    return get_origin(field.annotation) is tuple


def _sketch(annotation: object) -> str:
    """How a list of dimensions is written: `[x, y]`, or `[[x, y, z], ...]` for vertices."""
    entries = get_args(annotation)
    corner = get_args(get_args(entries[0])[0])
    if not corner:
        return f"[{', '.join('xyz'[: len(entries)])}]"
    return "[[x, y], ...]" if len(corner) == 2 and Ellipsis not in corner else "[[x, y, z], ...]"


def _half(value: object) -> str:
    if isinstance(value, int | float | Decimal):
        return f"{float(value) / 2:g}"
    from rigidcli.fields.units import split_quantity

    written = split_quantity(str(value))
    return f"({value})/2" if written is None else f"{float(written.digits) / 2:g} {written.unit}"


class Shape(Form):
    """A primitive: dimensions, natural origin, anchors, closed-form moments for a uniform density.

    Its `primitive` makes a figure of an arithmetic and the dimensions, which are fields of a subclass. The
    `UNIT` is that of a density, which is mass `PER` volume, area or length.
    """

    model_config = ConfigDict(json_schema_extra=_complete_schema)

    ONE_OF: ClassVar = ("mass", "density")
    PER: ClassVar = AREA_DENSITY
    UNIT: ClassVar[str]
    ANCHORS: ClassVar[Mapping[str, Anchor]]
    primitive: ClassVar[Callable[..., Figure]]

    mass: Mass | None = Field(default=None, description="The mass of all of it; or give `density`")
    density: Scalar | BoundExpression | None = None
    anchor: str | None = Field(
        default=None, description="The point that is put at `position`: `com`, or another of the shape"
    )
    shape: str = Field(description="The name of the shape")

    _integrated: mass_properties.MassProperties | None = PrivateAttr(default=None)

    @classmethod
    def word(cls) -> str:
        """What stands under `shape`: that of `HalfDisk` is `half_disk`."""
        return cls.primitive.__name__

    @classmethod
    @cache
    def dimensions(cls) -> Mapping[str, str]:
        """The keys of the dimensions, as they are written: `size` is `size: [x, y, z]`."""
        return {
            key: f"{key}: {_sketch(field.annotation)}" if _is_list(field) else key
            for key, field in cls.model_fields.items()
            if key not in Shape.model_fields
        }

    @classmethod
    def summary(cls) -> str:
        """The shape and its dimensions in words."""
        written = ", ".join(f"`{dimension}`" for dimension in cls.dimensions().values())
        return f"{with_article(cls.word())} has {written}, and `mass` or `density`"

    @classmethod
    def key_for(cls, word: str, value: object) -> str | None:
        """The dimension for which `word` stands, if there is one: best a list where `value` is one."""
        names = [name for name in (word, *keys_called(word), *halved(word)) if name in cls.dimensions()]
        return next((name for name in names if cls.holds(name, value)), next(iter(names), None))

    @classmethod
    def holds(cls, key: str, value: object) -> bool:
        """Whether a dimension is a list of as many entries as `value`, or no list where that is none."""
        field = cls.model_fields[key]
        if not isinstance(value, list):
            return not _is_list(field)
        entries = get_args(field.annotation)
        return _is_list(field) and (Ellipsis in entries or len(value) == len(entries))

    @classmethod
    def _unknown(cls, key: str, raw: Mapping[str, Any], env: Environment) -> ValueProblem:
        if raw[key] == "hole":
            return ValueProblem("unknown key", hint="write `hole: true`")
        for radius in halved(key):
            if radius in cls.model_fields:
                cure = f"write `{radius}: {_half(raw[key])}`, half of the diameter"
                return unknown_key(radius, cure)
        dimension = cls.key_for(key, raw[key])
        if dimension is not None and raw.get(dimension) is None:
            hint = None if cls.holds(dimension, raw[key]) else cls.summary()
            return unknown_key(dimension, hint)
        return super()._unknown(key, raw, env)

    @classmethod
    def _unguessed(cls, key: str, raw: Mapping[str, Any], env: Environment) -> ValueProblem:
        hint = f"{cls.summary()}; any body may have {', '.join(Form.model_fields)}"
        return ValueProblem("unknown key", hint=hint)

    @model_validator(mode="after")
    def _complete(self, info: ValidationInfo) -> Self:
        if self.anchor is not None and self.anchor not in ("com", *self.ANCHORS):
            raise ValueProblem(not_one_of(self.anchor, ["com", *self.ANCHORS]), path=("anchor",))
        self.figure(environment(info).arithmetic)
        return self

    def figure(self, n: Arithmetic) -> Figure:
        """The figure of these dimensions. Raises ValueProblem where they do not go together."""
        return type(self).primitive(n, **{key: getattr(self, key) for key in self.dimensions()})

    def maps(self, n: Arithmetic) -> Sequence[Chart]:
        """The shape in coordinates of its own, in which a density is integrated."""
        return self.figure(n).charts()

    def faces(self) -> list[Floats]:
        """Plane faces of the surface (k by 3, m, own axes); a wire is one line. Needs all dimensions."""
        figure = self.model_copy(update=floats(self.__dict__, FLOAT)).figure(FLOAT)
        if figure.corners is not None:
            return [figure.corners()]
        return [face for chart in figure.charts() for face in chart.faces()]

    def pivot(self, arithmetic: Arithmetic) -> Array:
        """The point that `anchor` names; without one, the natural origin."""
        if self.anchor is None:
            return arithmetic.array([0, 0, 0])
        if self.anchor != "com":
            return arithmetic.array(self.ANCHORS[self.anchor](self))
        if isinstance(self.density, BoundExpression):
            return self.local(arithmetic).com
        return arithmetic.array(self.figure(arithmetic).geometry().centre)

    def point_named(self, anchor: str, arithmetic: Arithmetic) -> Array:
        """An anchor (3, m) where the shape is placed."""
        turn, shift = self.motion(arithmetic)
        return np.asarray(shift + turn @ arithmetic.array(self.ANCHORS[anchor](self)))

    def mean_density(self, n: Arithmetic) -> Scalar:
        """The density as given, or as it follows from the mass."""
        if self.mass is None and not isinstance(self.density, BoundExpression):
            return self.density or 0
        return (self.local(n).mass or 0) / self.figure(n).geometry().measure

    def local(self, arithmetic: Arithmetic) -> mass_properties.MassProperties:
        """Mass properties in the shape's own axes and from its natural origin."""
        if isinstance(self.density, BoundExpression):
            return self._of_field(self.density, arithmetic)
        measure, centre, second = self.figure(arithmetic).geometry()
        mass = self.mass if self.mass is not None else self.mean_density(arithmetic) * measure
        second, centre = arithmetic.array(second), arithmetic.array(centre)
        second = np.diag(second) if second.ndim == 1 else second
        return mass_properties.MassProperties(mass, centre, tensor.from_second_moments(mass, second))

    def _of_field(self, density: BoundExpression, n: Arithmetic) -> mass_properties.MassProperties:
        if self._integrated is None:
            from rigidcli.bodies.density_integrals import integrated, looked_at

            if n.exact:
                with suppress(NoValueError):  # what hangs on symbols may be positive or negative
                    shape = self.model_copy(update=floats(self.__dict__, n))
                    looked_at(shape.density, shape.maps(FLOAT), self.UNIT)
            self._integrated = integrated(density, self.figure(n), self.UNIT, n)
        return self._integrated


class Region(Shape):
    """A shape that says which points it fills."""

    MARGIN: ClassVar = NET_DRAWN_IN

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        """Which of the points (m, own axes) the shape fills, its surface included."""
        contains = self.figure(FLOAT).contains
        assert contains is not None
        return contains(x, y, z)

    def net(self) -> Floats:
        """Points of the shape (3 by n; m, own axes): a coarse net all over, and a fine one on its surface."""
        return _net(type(self).primitive, *(getattr(self, key) for key in self.dimensions()))

    def extent(self) -> tuple[Floats, float]:
        """The middle (3, m, own axes) and the radius (m) of a ball that holds the shape."""
        return _extent(type(self).primitive, *(getattr(self, key) for key in self.dimensions()))


@lru_cache(maxsize=1024)
def _net(primitive: Callable[..., Figure], *dimensions: Any) -> Floats:
    """The net of a figure, kept for other parts of the same size: images of points of its unit boxes."""
    parts = []
    for chart in primitive(FLOAT, *dimensions).charts():
        steps = (STEPS_OF_NET if turn is None else 9 * right_angles(turn) for turn in chart.coordinates)
        axes = (np.linspace(NET_DRAWN_IN, 1 - NET_DRAWN_IN, 1 + count) for count in steps)
        net = np.array([grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")])
        is_surface = ((net == NET_DRAWN_IN) | (net == 1 - NET_DRAWN_IN)).any(axis=0)
        spot = chart.at(net[:, is_surface | (np.arange(net.shape[1]) % ONE_INSIDE_IN == 0)])
        places = np.array(spot[:3]) + np.reshape(chart.origin, (3, 1))
        if not any(chart.coordinates):  # a corner of the unit box may be all of an edge: it is drawn in, too
            places += 2 * NET_DRAWN_IN * (places.mean(axis=1, keepdims=True) - places)
        parts.append(places)
    return np.hstack(parts)


@lru_cache(maxsize=10_000)
def _extent(primitive: Callable[..., Figure], *dimensions: Any) -> tuple[Floats, float]:
    """The extent of a figure. Between the points of its net, round shapes bulge by less than a per cent."""
    net = _net(primitive, *dimensions)
    middle = (net.min(axis=1) + net.max(axis=1)) / 2
    return middle, 1.01 * float(np.linalg.norm(net - middle[:, None], axis=0).max())


class Solid(Region):
    """A shape that fills a volume."""

    PER: ClassVar = DENSITY


class Lamina(Region):
    """A flat shape, of no thickness."""

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        """Which of the points (m, own axes) lie in the shape, but for rounding across its plane."""
        figure, thickness = self.figure(FLOAT), 2 * NET_DRAWN_IN * self.extent()[1]
        if figure.corners is not None:
            turn, origin = solids.plane_of(figure.corners())
            x, y, z = turn.T @ (np.array([x, y, z]) - origin[:, None])
        assert figure.contains is not None
        return figure.contains(x, y, z) & (abs(z) <= thickness)


class Shell(Shape):
    """A curved surface, of no thickness."""


class Wire(Shape):
    """A curve, of no thickness."""

    PER: ClassVar = LINE_DENSITY


def section(
    primitive: Callable[..., Figure], kind: type[Shape], anchors: Mapping[str, Anchor]
) -> type[Shape]:
    """The section of a shape: its dimensions are the parameters of its `primitive` after the first."""
    _, *parameters = inspect.signature(primitive).parameters.values()
    fields: dict[str, Any] = {one.name: (one.annotation, ...) for one in parameters}
    density = Annotated[Scalar | BoundExpression, Density(kind.PER, "positive")] | None
    fields["density"] = density, Field(default=None, description=SAID)
    title = primitive.__name__.title().replace("_", "")
    made = cast("type[Shape]", create_model(title, __base__=kind, __doc__=primitive.__doc__, **fields))
    made.primitive, made.ANCHORS, made.UNIT = primitive, anchors, kind.PER.unit
    return made


# --- all shapes, by their names

# The anchor of what stands on a base, with its origin half way up.
BASE: dict[str, Anchor] = {"base": lambda s: (0, 0, -s.height / 2)}
# The anchors of what opens from an apex at its origin.
TIP: dict[str, Anchor] = {"apex": lambda s: primitives.ORIGIN, "base": lambda s: (0, 0, s.height)}

# Whether a primitive is solid, flat, a shell or a wire, and its anchors besides the centre of mass.
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

_NAMED = {primitive.__name__: primitive for primitive in PRIMITIVES}


class MadeWhenAsked(Mapping[str, T]):
    """A mapping from `names` to values that are made when they are asked for: a document needs few."""

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


# The sections of the shapes.
SHAPES = MadeWhenAsked(_NAMED, lambda name: section(_NAMED[name], *PRIMITIVES[_NAMED[name]]))
