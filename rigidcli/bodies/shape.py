"""The base classes of shapes, which have dimensions and a mass or a density."""

# Annotations here are objects, not texts, which pydantic would read anew for each shape.

import re
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from decimal import Decimal
from functools import cache
from typing import Annotated, Any, ClassVar, Self, get_args, get_origin

import numpy as np
from pydantic import ConfigDict, Field, PrivateAttr, ValidationInfo, model_validator
from pydantic.config import JsonDict, JsonValue
from pydantic.fields import FieldInfo

from rigidcli.bodies.charts import Chart
from rigidcli.bodies.density import SAID, Density
from rigidcli.bodies.form import Form
from rigidcli.bodies.geometry import Bounds, Geometry
from rigidcli.core import mass_properties, tensor
from rigidcli.core.arithmetic import FLOAT, Arithmetic, Array, Floats, Mask, Scalar
from rigidcli.errors import ValueProblem, with_article
from rigidcli.fields.dimensions import AREA_DENSITY, DENSITY, LINE_DENSITY
from rigidcli.fields.environment import Formula
from rigidcli.fields.quantities import Length, Mass, OptionalLength
from rigidcli.fields.section import Section, environment
from rigidcli.fields.typed_numbers import split_quantity
from rigidcli.fields.words import halved, keys_called, not_one_of


class NoValueError(Exception):
    """A number that depends on symbols without a value."""


def floats(value: Any, n: Arithmetic) -> Any:
    """`value` with every number in it as a float. Raises NoValueError."""
    if isinstance(value, dict):
        return {key: floats(item, n) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return tuple(floats(item, n) for item in value)
    if isinstance(value, Formula):
        return Formula(value.expression, floats(value.constants, n))
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
    if get_origin(get_args(entries[0])[0]) is tuple:
        return "[[x, y, z], ...]"
    return f"[{', '.join('xyz'[: len(entries)])}]"


def _half(value: object) -> str:
    """Half of a length, as it is written."""
    if isinstance(value, int | float | Decimal):
        return f"{float(value) / 2:g}"
    written = split_quantity(str(value))
    return f"({value})/2" if written is None else f"{float(written.digits) / 2:g} {written.unit}"


class Shape(Form):
    """A primitive: dimensions, natural origin, anchors, closed-form moments for a uniform density.

    A subclass gives its `geometry` and its `maps`, and names its `ANCHORS`.
    """

    model_config = ConfigDict(json_schema_extra=_complete_schema)

    ONE_OF: ClassVar = ("mass", "density")
    UNIT: ClassVar = "kg/m^2"
    ANCHORS: ClassVar[Mapping[str, Callable[[Any], tuple[Scalar, Scalar, Scalar]]]] = {}

    mass: Mass | None = Field(default=None, description="The mass of all of it; or give `density`")
    density: Scalar | Formula | None = None
    anchor: str | None = Field(
        default=None, description="The point that is put at `position`: `com`, or another of the shape"
    )
    shape: str = Field(description="The name of the shape")

    _integrated: mass_properties.MassProperties | None = PrivateAttr(default=None)

    @classmethod
    def word(cls) -> str:
        """What stands under `shape`: that of `HalfDisk` is `half_disk`."""
        return re.sub("(?<=[a-z])(?=[A-Z])", "_", cls.__name__).lower()

    @classmethod
    @cache
    def dimensions(cls) -> Mapping[str, str]:
        """The keys of the dimensions, each as it is written: `size` is `size: [x, y, z]`."""
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
    def holds(cls, key: str | None, value: object) -> bool:
        """Whether a dimension is there, and a list of as many entries where `value` is a list."""
        if key is None:
            return False
        field = cls.model_fields[key]
        if not isinstance(value, list):
            return not _is_list(field)
        entries = get_args(field.annotation)
        return _is_list(field) and (Ellipsis in entries or len(value) == len(entries))

    @classmethod
    def _unknown(cls, key: str, raw: Mapping[str, Any]) -> ValueProblem:
        for radius in halved(key):
            if radius in cls.model_fields:
                return ValueProblem(
                    f"a diameter is not read, expected `{radius}`",
                    hint=f"write `{radius}: {_half(raw[key])}`, which is half of it",
                )
        dimension = cls.key_for(key, raw[key])
        if dimension is not None and raw.get(dimension) is None:
            hint = None if cls.holds(dimension, raw[key]) else cls.summary()
            return ValueProblem(f"unknown key (did you mean {dimension}?)", hint=hint)
        problem = super()._unknown(key, raw)
        if problem.hint is not None:
            problem.hint = f"{cls.summary()}; any body may have {', '.join(Form.model_fields)}"
        return problem

    @model_validator(mode="after")
    def _complete(self, info: ValidationInfo) -> Self:
        if self.anchor is not None and self.anchor not in ("com", *self.ANCHORS):
            raise ValueProblem(not_one_of(self.anchor, ["com", *self.ANCHORS]), path=("anchor",))
        self.check(environment(info).arithmetic)
        return self

    def check(self, n: Arithmetic) -> None:
        """Raise ValueProblem where dimensions do not go together."""

    @abstractmethod
    def geometry(self, n: Arithmetic) -> Geometry:
        """Measure, centre and spread from the dimensions."""

    @abstractmethod
    def maps(self, n: Arithmetic) -> Sequence[Chart]:
        """The shape in coordinates of its own, in which a density is integrated."""

    def faces(self) -> list[Floats]:
        """The surface as plane faces (each k by 3, m) in the shape's own axes; a wire is one line (k by 3).

        All dimensions must have a value.
        """
        shape = self.model_copy(update=floats(self.__dict__, FLOAT))
        return [face for chart in shape.maps(FLOAT) for face in chart.faces()]

    def pivot(self, arithmetic: Arithmetic) -> Array:
        """The point that `anchor` names; without one, the natural origin."""
        if self.anchor is None:
            return arithmetic.array([0, 0, 0])
        if self.anchor == "com":
            varies = isinstance(self.density, Formula)
            return arithmetic.array(
                self.local(arithmetic).com if varies else self.geometry(arithmetic).centre
            )
        return arithmetic.array(self.ANCHORS[self.anchor](self))

    def point_named(self, anchor: str, arithmetic: Arithmetic) -> Array:
        """An anchor (3, m) where the shape is placed."""
        turn, shift = self.motion(arithmetic)
        place: Array = shift + turn @ arithmetic.array(self.ANCHORS[anchor](self))
        return place

    def mean_density(self, n: Arithmetic) -> Scalar:
        """The density as given, or as it follows from the mass."""
        if self.mass is not None:
            return self.mass / self.geometry(n).measure
        if isinstance(self.density, Formula):
            return (self.local(n).mass or 0) / self.geometry(n).measure
        return self.density or 0

    def local(self, arithmetic: Arithmetic) -> mass_properties.MassProperties:
        """Mass properties in the shape's own axes and from its natural origin."""
        if isinstance(self.density, Formula):
            return self._of_field(self.density, arithmetic)
        measure, centre, second, _ = self.geometry(arithmetic)
        mass = self.mass if self.mass is not None else self.mean_density(arithmetic) * measure
        second, centre = arithmetic.array(second), arithmetic.array(centre)
        if second.ndim == 1:
            inertia = tensor.Inertia.of(tensor.from_second_moments(mass, np.diag(second)))
        else:
            inertia = tensor.Inertia.of_sums(mass, centre, mass * second)
        return mass_properties.MassProperties(mass, centre, inertia, tensor.misplaced(centre))

    def _of_field(self, density: Formula, n: Arithmetic) -> mass_properties.MassProperties:
        """The same for a density that varies; the integrals are taken once."""
        if self._integrated is None:
            from rigidcli.bodies.density_integrals import integrated, looked_at

            if n.exact:
                with suppress(NoValueError):  # what hangs on symbols may be positive or negative
                    shape = self.model_copy(update=floats(self.__dict__, n))
                    looked_at(shape.density, shape.maps(FLOAT), self.UNIT)
            self._integrated = integrated(density, self.maps(n), self.geometry(n), self.UNIT, n)
        return self._integrated


class Region(Shape):
    """A shape that says which points it fills; `CONVEX` if it holds the way between any two of them."""

    CONVEX: ClassVar = True

    def bounds(self) -> Bounds:
        """The least box round the shape, from its `geometry` unless a subclass knows better."""
        return self.geometry(FLOAT).bounds

    @abstractmethod
    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        """Which of the points (m, local axes) the shape fills, its surface included."""

    def corners(self) -> Floats:
        """Vertices (k by 3, m, own axes), which no grid finds; most shapes have none."""
        return np.array(getattr(self, "vertices", ()), dtype=np.float64).reshape(-1, 3)

    def plane(self) -> tuple[Array, Array]:
        """Rotation (3 by 3) and displacement (3, m) from the axes of `bounds` and `contains` to its own."""
        return np.eye(3), np.zeros(3)


class Hollow(Region):
    """A round shape with a round hole in its middle.

    It stands last among the bases of a shape: the first that has a field, such as `density`, decides.
    """

    CONVEX: ClassVar = False
    outer_radius: Length
    inner_radius: OptionalLength

    def check(self, n: Arithmetic) -> None:
        """Raise ValueProblem unless the hole leaves something."""
        if n.sign(self.outer_radius - self.inner_radius) in (0, -1):
            read = f"read {n.size(self.inner_radius):.6g} m"
            raise ValueProblem(f"{read}, expected less than outer_radius", path=("inner_radius",))

    def is_between(self, square: Floats) -> Mask:
        """Whether points at a distance of this square from the middle (m^2) are outside of the hole."""
        return (square <= self.outer_radius**2) & (square >= self.inner_radius**2)


class Solid(Region):
    """A shape that fills a volume."""

    UNIT: ClassVar = "kg/m^3"
    density: Annotated[Scalar | Formula, Density(DENSITY, "positive")] | None = Field(
        default=None, description=SAID
    )


class Lamina(Region):
    """A flat shape, of no thickness; to `bounds` and `contains` its `plane` is z = 0."""

    density: Annotated[Scalar | Formula, Density(AREA_DENSITY, "positive")] | None = Field(
        default=None, description=SAID
    )


class Shell(Shape):
    """A curved surface, of no thickness."""

    density: Annotated[Scalar | Formula, Density(AREA_DENSITY, "positive")] | None = Field(
        default=None, description=SAID
    )


class Wire(Shape):
    """A curve, of no thickness."""

    UNIT: ClassVar = "kg/m"
    density: Annotated[Scalar | Formula, Density(LINE_DENSITY, "positive")] | None = Field(
        default=None, description=SAID
    )
