"""The working of `inertia`: integrals or sums, turned axes, and the parallel-axis theorem, part by part."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from rigidcli.bodies.charts import Arc, Chart
from rigidcli.bodies.composites import Composite
from rigidcli.bodies.form import Form
from rigidcli.bodies.points import PointMasses
from rigidcli.bodies.shapes import Shape
from rigidcli.core import tensor
from rigidcli.core.arithmetic import Arithmetic, Array, Scalar
from rigidcli.core.mass_properties import MassProperties
from rigidcli.document.document import Document
from rigidcli.fields.environment import BoundExpression
from rigidcli.report import NOISE, Column, Field, Step, Table, Value
from rigidcli.studies.writing import free_name

MOST_POINTS = 20  # the most point masses whose terms are listed, so that the table fits on a screen
# The coordinates of second moments, with the places of the moments in a tensor.
PAIRS = tuple(("xyz"[i], "xyz"[j], i, j) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))


def steps(document: Document, asked: Array) -> Iterator[Step]:
    """The way to the tensor `asked` for (3 by 3, kg m^2), along the axes of the results."""
    body, n, physical = document.body, document.arithmetic, document.physical
    whole = physical.properties
    if body is None or whole.mass is None:
        return
    own = asked if document.frame is None else n.tidy(tensor.rotate(asked, physical.axes))
    if isinstance(body, PointMasses) and isinstance(body.points, tuple) and len(body.points) <= MOST_POINTS:
        yield from _points(body, physical.point, whole, own, n)
    elif isinstance(body, Composite):
        parts = [part.properties(n) for part in body.parts]
        names = [part.name or getattr(part, "shape", None) or "part" for part in body.parts]
        # Parts of the same name are numbered by their places.
        names = [f"{name} ({k})" if names.count(name) > 1 else name for k, name in enumerate(names, 1)]
        signs = [-1 if part.hole else 1 for part in body.parts]
        masses = [sign * (part.mass or 0) for sign, part in zip(signs, parts, strict=True)]
        yield _center(names, masses, [part.com_from(0 * part.com) for part in parts], whole, n)
        terms = []
        for name, sign, part in zip(names, signs, parts, strict=True):
            fields = list(_parallel(part, physical.point, n))
            sentence = "The tensor of this part about the centre of mass of the part"
            sentence += ", and the parallel-axis term." if len(fields) > 3 else ", which is O."
            sentence += " The part is a hole, and is taken away." if sign < 0 else ""
            yield Step(name, sentence, tuple(fields))
            terms.append(sign * sum(entry.value for entry in fields[2:]))
        columns = [n.tidy(n.array([term[i, j] for term in terms])) for _, _, i, j in PAIRS]
        yield _sum(names, [], columns, [f"I{a}{b}" for a, b, _, _ in PAIRS], own, n)
    else:
        if isinstance(body, Shape):
            yield from _shape(body, n)
        if any(component != 0 for component in n.tidy(whole.com - physical.point)):
            yield Step(
                "Parallel axes",
                "With d from O to the centre of mass, I = I_cm + M (d^2 1 - d d^T).",
                (*_parallel(whole, physical.point, n), _about_o(own)),
            )
    if document.frame is not None:
        sentence = "Along the axes of `frame`, the columns of R, the tensor is R^T I R."
        turned = _turned(physical.axes, asked, "R^T I R", r"\mathbf{R}^\mathsf{T} \mathbf{I R}")
        yield Step("Axes of the results", sentence, turned)


def _about_o(own: Array) -> Field:
    return Field("", own, "I", r"\mathbf{I}_O", "kg m^2")


def _added(head: str, terms: Array, whole: Value, unit: str, n: Arithmetic) -> Column:
    """A column of terms with their sum below; in floats, terms that are rounding are zero."""
    if not n.exact:
        least = NOISE * np.abs(terms).max()
        terms = np.where(np.abs(terms) < least, 0.0, terms) + 0.0
        whole = 0.0 if whole != "" and abs(whole) < least else whole
    return Column("", [*terms, whole], (head,), unit)


def _center(
    names: Sequence[str],
    masses: Sequence[Scalar],
    places: Sequence[Array],
    whole: MassProperties,
    n: Arithmetic,
) -> Step:
    mass, place = n.array(masses), n.tidy(n.array(places))
    products = [n.tidy(mass * v) for v in place.T]
    head = Column("", [*names, "sum"], ("",))
    columns = (
        head,
        Column("", [*mass, whole.mass], ("m",), "kg"),
        *(_added(a, v, "", "m", n) for a, v in zip("xyz", place.T, strict=True)),
        *(_added(f"m {a}", v, n.tidied(v.sum()), "kg m", n) for a, v in zip("xyz", products, strict=True)),
    )
    centre = n.tidy(whole.com_from(0 * whole.com))
    holes = " The mass of a hole is negative." if any(n.size(m) < 0 for m in masses) else ""
    return Step(
        "Centre of mass",
        f"The centre of mass is the sum of m r, divided by the mass.{holes}",
        (Field("", centre, "sum of m r / M", r"\frac{1}{M}\sum m\,\mathbf{r}", "m"),),
        (Table("", "terms of the sums", columns),),
    )


def _sum(
    names: Sequence[str],
    given: Sequence[Column],
    terms: Sequence[Array],
    heads: Sequence[str],
    own: Array,
    n: Arithmetic,
) -> Step:
    """The terms of the six entries of the tensor, one row a point or part, and their sums."""
    sums = [own[i, j] for _, _, i, j in PAIRS]
    columns = [
        _added(head, values, whole, "kg m^2", n)
        for values, whole, head in zip(terms, sums, heads, strict=True)
    ]
    return Step(
        "Inertia tensor about O",
        "Measured from O, Ixx is the sum of m (y^2 + z^2), and Ixy is the sum of -m x y."
        if given
        else "The terms of all parts are added.",
        (_about_o(own),),
        (Table("", "terms of the sums", (Column("", [*names, "sum"], ("",)), *given, *columns)),),
    )


def _shape(body: Form, n: Arithmetic) -> Iterator[Step]:
    own = body.local(n)
    density = getattr(body, "density", None)
    if isinstance(body, Shape) and n.exact:
        for chart in body.maps(n)[:MOST_CHARTS]:
            yield _in_coordinates(
                density if isinstance(density, BoundExpression) else body.mean_density(n), chart, n
            )
    if isinstance(density, BoundExpression):
        yield _density(body, density, n)
    # I = M (tr C 1 - C) for the second moments M C, so that M C = (tr I / 2) 1 - I.
    second = n.tidy(own.tensor.trace() / 2 * n.array(np.eye(3, dtype=int)) - own.tensor)
    names = {(a, b): f"{a} {b}" if a != b else f"{a}^2" for a, b, _, _ in PAIRS}
    integrals = [
        Field("", second[i, j], f"integral of {names[a, b]} dm", "", "kg m^2")
        for a, b, i, j in PAIRS
        if i == j or second[i, j] != 0
    ]
    title, symbol = "tensor along the axes of the shape", r"\mathbf{I}_\mathrm{cm}"
    whole = Field("", n.tidy(own.tensor), title, symbol, "kg m^2")
    yield Step(
        "Integrals over the body",
        "Along the axes of the shape, from the centre of mass, Ixx is the integral of (y^2 + z^2) dm, and "
        "Ixy is the integral of -x y dm.",
        (Field("", own.mass, "mass", "M", "kg"), *integrals, whole),
    )
    turn, _ = body.motion(n)
    if (turn != n.array(np.eye(3, dtype=int))).any():
        turned = n.tidy(tensor.rotate(own.tensor, turn))
        sentence = "The body is turned by R, and the tensor becomes R I R^T."
        yield Step("Turned axes", sentence, _turned(turn, turned, "R I R^T", r"\mathbf{R I R}^\mathsf{T}"))


def _turned(turn: Array, tensor: Array, product: str, symbol: str) -> tuple[Field, Field]:
    """A rotation R, and the tensor that it makes by a `product` such as R I R^T."""
    return Field("", turn, "R", r"\mathbf{R}"), Field("", tensor, product, symbol, "kg m^2")


# Names of coordinates from 0 to 1, and of angles, in the working of integrals.
COORDINATES = (("u", "v", "w"), ("phi", "theta", "psi"))
MOST_CHARTS = 3  # the most parts of a shape whose integrals are written out


def _density(body: Form, density: BoundExpression, n: Arithmetic) -> Step:
    own = body.local(n)
    fields = [Field("", own.mass, "integral of dm", "M", "kg")]
    if n.exact:
        sentence = "The integrals go over the whole body, from the origin of the shape, term by term."
        for axis, part in zip("xyz", own.com, strict=True):
            fields.append(Field("", n.tidied(own.mass * part), f"integral of {axis} dm", "", "kg m"))
    else:
        sentence = f"The integrals over dm = ({density.expression.text}) dV are worked out by quadrature."
        fields.append(Field("", own.integrated, "error, relative to the mass"))
    return Step("Integrals of the density", sentence, tuple(fields))


def _in_coordinates(density: BoundExpression | Scalar, chart: Chart, n: Arithmetic) -> Step:
    from rigidcli.bodies.density_exact import placed  # only exact densities need it

    left, symbols, limits = [list(names) for names in COORDINATES], [], []
    taken = set(density.constants) if isinstance(density, BoundExpression) else set[str]()
    for turn in chart.coordinates:
        is_angle = isinstance(turn, Arc)
        name = free_name([left[is_angle].pop(0)], frozenset(taken))
        unknown = n.symbol(name, False)
        symbols.append((n.cos(unknown), n.sin(unknown)) if is_angle else n.symbol(name, True))
        limits.append((name, turn))
    place, rho, measure = placed(density, chart, symbols)
    element = n.tidied(rho * measure)
    angles = ((name, turn) for name, turn in limits if isinstance(turn, Arc))
    spans = [Field("", turn.end, f"{name} from 0 to", "", "rad") for name, turn in angles]
    units = [name for name, turn in limits if not isinstance(turn, Arc)]
    few = "" if chart.simplex == len(units) else f" {' and '.join(units[-chart.simplex :])}"
    simplex = f",{few} together at most 1" if chart.simplex else ""
    ends = f"{', '.join(units)} from 0 to 1{simplex}" if units else "with an angle"
    places = zip("xyz", n.tidy(n.array(place)), strict=True)
    title = " ".join(["dm /", *(f"d{name}" for name, _ in limits)])
    return Step(
        "Element of mass",
        f"In coordinates of the shape, {ends}; dm is the density times the element of volume, area or "
        "length.",
        (*(Field("", part, axis, axis, "m") for axis, part in places), Field("", element, title), *spans),
    )


def _parallel(part: MassProperties, point: Array, n: Arithmetic) -> Iterator[Field]:
    """Mass, place and tensor of a part, and the parallel-axis term about the point O."""
    offset = n.tidy(part.com_from(point))
    yield Field("", part.mass, "mass", "M", "kg")
    yield Field("", offset, "d, from O to the centre of mass", r"\mathbf{d}", "m")
    symbol = r"\mathbf{I}_\mathrm{cm}"
    yield Field("", n.tidy(part.tensor), "tensor about the centre of mass", symbol, "kg m^2")
    if any(component != 0 for component in offset):
        title, symbol = "M (d^2 1 - d d^T)", r"M (d^2 \mathbf{1} - \mathbf{d} \mathbf{d}^\mathsf{T})"
        yield Field("", n.tidy(part.mass * tensor.point_tensor(offset)), title, symbol, "kg m^2")


def _points(
    body: PointMasses, point: Array, whole: MassProperties, own: Array, n: Arithmetic
) -> Iterator[Step]:
    turn, shift = body.motion(n)
    rows = n.array(body.points)
    mass, places = rows[:, 0], n.tidy(rows[:, 1:] @ turn.T + shift)
    names = [str(number + 1) for number in range(len(rows))]
    yield _center(names, list(mass), list(places), whole, n)
    x, y, z = from_o = n.tidy(places - point).T
    terms = {
        "m(y^2+z^2)": mass * (y**2 + z**2),
        "m(z^2+x^2)": mass * (z**2 + x**2),
        "m(x^2+y^2)": mass * (x**2 + y**2),
        "-m x y": -mass * x * y,
        "-m x z": -mass * x * z,
        "-m y z": -mass * y * z,
    }
    given = [_added(a, v, "", "m", n) for a, v in zip("xyz", from_o, strict=True)]
    yield _sum(names, given, [n.tidy(values) for values in terms.values()], list(terms), own, n)
