"""Integrals of a density over a shape in exact numbers, where they have a closed form that can be found."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.expressions import Expr, expr, power
from rigidcli.algebra.functions import apply
from rigidcli.algebra.reading import from_tree
from rigidcli.bodies.charts import Chart
from rigidcli.bodies.density import PAIRS, symmetric
from rigidcli.bodies.multiple_integrals import Coordinates
from rigidcli.core import tensor
from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ComputationError, ExpressionError, ValueProblem
from rigidcli.fields.environment import Formula

MAX_STEPS = 400_000
"""Steps in multiplying out all ten integrands: about two seconds."""


def exact_properties(formula: Formula, charts: Sequence[Chart], n: Arithmetic) -> MassProperties:
    """Mass, centre of mass and tensor.

    Raises ComputationError where no closed form is found, and ValueProblem for a mass that is not positive.
    """
    allowance = Allowance(MAX_STEPS)
    sums = n.array(np.zeros(10, dtype=int))
    try:
        for chart in charts:
            found = (_sums(formula, each, allowance, n) for each in (chart, *chart.slices))
            known = next((each for each in found if each is not None), None)
            if known is None:
                raise _no_closed_form()
            sums = sums + known
        mass, first = sums[0], sums[1:4]
        if n.sign(mass) in (0, -1):
            raise ValueProblem("the density leaves no mass", path=("density",))
        com = n.tidy(first / mass)
        second = symmetric(sums[4:]) - mass * np.outer(com, com)
        inertia = tensor.Inertia.of_sums(mass, com, n.tidy(second))
    except ExpressionError as error:
        raise _no_closed_form() from error
    return MassProperties(n.tidy(n.array([mass]))[0], com, inertia)


class Placed(NamedTuple):
    """A point of a shape in coordinates: its place (x, y, z), the density there, and the measure."""

    place: Sequence[Expr]
    density: Expr
    measure: Expr


def placed(density: Formula | Scalar, chart: Chart, symbols: Sequence[Any]) -> Placed:
    """A density in the coordinates of a chart; those that are angles are pairs of a cosine and a sine.

    Raises ExpressionError where it has no value, or is too large.
    """
    spot = chart.place(*symbols)
    place = [expr(part) + start for part, start in zip(spot[:3], chart.origin, strict=True)]
    if not isinstance(density, Formula):
        return Placed(place, expr(density), expr(spot.measure))
    s = _root(place[:2]) if spot.s is None else expr(spot.s)
    r = _root(place) if spot.r is None else expr(spot.r)
    known = dict(zip("xyzsr", (*place, s, r), strict=True))
    constants = {name: expr(value) for name, value in density.constants.items()}
    varying = from_tree(density.expression.root, {**known, **constants})
    return Placed(place, varying, expr(spot.measure))


def _sums(formula: Formula, chart: Chart, allowance: Allowance, n: Arithmetic) -> Any:
    """The integrals of the density, of it times x, y, z, and of it times their products (10); or None."""
    coordinates = Coordinates(chart.coordinates, n)
    place, density, measure = placed(formula, chart, coordinates.symbols)
    weight = density * measure
    moments = [expr(1), *place, *(place[i] * place[j] for i, j in PAIRS)]
    found = [coordinates.integral(weight * moment, allowance) for moment in moments]
    return None if None in found else n.array(found)


def _root(components: Sequence[Expr]) -> Expr:
    moving = [part for part in components if not part.is_zero]
    if len(moving) == 1:
        return apply("abs", *moving)
    return power(sum((part**2 for part in moving), expr(0)), Fraction(1, 2))


def _no_closed_form() -> ComputationError:
    return ComputationError(
        "no closed form is found for the integrals of the density",
        hint="polynomials have one, and functions of one coordinate that suits the shape; for numbers, give "
        "every parameter a value, and leave out `--exact`",
    )
