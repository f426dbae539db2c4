"""Exact expressions without signs and absolute values: in parts of the coordinates on which these hang."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise, product
from typing import Any, TypeAlias

from rigidcli.algebra.atoms import Applied, Atom, Group
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import Expr, atomic, expr, factored, number
from rigidcli.algebra.functions import apply
from rigidcli.algebra.substitution import mapped, rebuilt, substitute
from rigidcli.bodies.charts import Turn
from rigidcli.core.arithmetic import Arithmetic

Span: TypeAlias = tuple[Any, Any]
"""A part of a coordinate, from the one to the other (Expr); of an angle, by its turns from zero (`Turn`)."""

MOST_PARTS = 64
"""The most parts into which signs may cut the coordinates."""

LINEAR = {(0,), (1,)}, {(0, 0), (1, 0), (0, 1)}
"""The powers in what is linear in a coordinate; in the cosine and the sine of an angle."""


def without_signs(
    e: Expr, names: Sequence[Sequence[str]], spans: Sequence[Span], n: Arithmetic
) -> list[tuple[Expr, Sequence[Span]]] | None:
    """The expression in each of the parts into which signs and absolute values cut the `spans`.

    `names` are those of the coordinates, of an angle those of its cosine and sine. None where a sign hangs on
    more than one coordinate, or where it is not known in what part it is which.
    """
    place = {name: k for k, own in enumerate(names) for name in own}
    inner = {
        factor for atom in _signs(e) for factor, _ in _factors(atom) if not factor.names.isdisjoint(place)
    }
    if not inner:
        return [(e, spans)]
    cuts: list[list[Any]] = [[start, end] for start, end in spans]
    for factor in inner:
        on = {place[name] for name in factor.names if name in place}
        zeros = _zeros(factor, names[min(on)], spans[min(on)], n) if len(on) == 1 else None
        if zeros is None:
            return None
        cuts[on.pop()][1:1] = zeros
    ordered = [_in_order(own, n) for own in cuts]
    parts: list[tuple[Expr, Sequence[Span]]] = []
    for part in product(*(pairwise(own or ()) for own in ordered)):
        middle = {
            name: value
            for own, span in zip(names, part, strict=True)
            for name, value in zip(own, _middle(*span, n), strict=True)
        }
        known = {factor: n.sign(n.tidy(n.array([substitute(factor, middle)]))[0]) for factor in inner}
        if not all(known.values()) or len(parts) == MOST_PARTS:
            return None
        parts.append((_signed(e, known), part))
    return parts or None


def _signs(e: Expr) -> Iterator[Applied[Expr]]:
    """The signs and absolute values in an expression, at any depth."""
    for atom in e.atoms:
        if isinstance(atom, Applied) and atom.function in ("abs", "sign"):
            yield atom
        for below in (
            atom.arguments if isinstance(atom, Applied) else (atom.inner,) if isinstance(atom, Group) else ()
        ):
            yield from _signs(below)


def _factors(atom: Applied[Expr]) -> list[tuple[Expr, int]]:
    """What the sign of an argument is the product of, with exponents; apart from a number."""
    return [(atomic(factor), int(exponent)) for factor, exponent in factored(atom.arguments[0])[1]]


def _signed(e: Expr, known: dict[Expr, int | None]) -> Expr:
    """The expression with these signs of factors."""

    def change(atom: Atom) -> Expr | None:
        if isinstance(atom, Applied) and atom.function in ("abs", "sign"):
            content, _ = factored(atom.arguments[0])
            moved, rest = number(content), expr(1)
            sign = 1 if content > 0 else -1
            for factor, exponent in _factors(atom):
                if factor in known:
                    moved, sign = moved * factor**exponent, sign * (known[factor] or 1) ** exponent
                else:
                    rest *= factor**exponent
            return sign * apply(atom.function, rest) * (moved if atom.function == "abs" else 1)
        return rebuilt(atom, whole) if isinstance(atom, Applied | Group) else None

    def whole(inner: Expr) -> Expr:
        return mapped(inner, change)

    return whole(e)


def _zeros(e: Expr, names: Sequence[str], span: Span, n: Arithmetic) -> list[Any] | None:
    """Where an expression that is linear in a coordinate passes zero inside a span; None if not known."""
    found = coefficients(e, names)
    if found is None or not found.keys() <= LINEAR[len(names) - 1]:
        return None
    start, end = span
    if not isinstance(end, Turn) or not isinstance(start, Turn):
        root = n.tidy(n.array([-found.get((0,), expr(0)) / found[(1,)]]))[0]
        return _inside([(root, root)], start, end, n)
    level, a, b = (n.tidy(n.array([found.get(powers, expr(0))]))[0] for powers in ((0, 0), (1, 0), (0, 1)))
    # a c + b s + level = 0 on the circle: the foot of the perpendicular, and both ways along the line.
    square = a * a + b * b
    reach = n.tidy(n.array([square - level * level]))[0]
    if n.sign(reach) in (0, -1):
        return []
    if n.sign(reach) is None:
        return None
    ends = []
    for side in (1, -1):
        way = side * n.sqrt(reach)
        c, s = n.tidy(n.array([(-a * level - b * way) / square, (-b * level + a * way) / square]))
        angle = n.atan2(s, c)
        ends.append((angle if n.sign(angle) != -1 else angle + 2 * n.pi, c, s))
    return _inside([(angle, Turn(angle, c, s)) for angle, c, s in ends], start.end, end.end, n)


def _inside(places: list[tuple[Any, Any]], start: Any, end: Any, n: Arithmetic) -> list[Any] | None:
    """Those of the places that are between two others; None if it is not known."""
    kept = []
    for place, what in places:
        signs = n.sign(place - start), n.sign(end - place)
        if None in signs and not {0, -1}.intersection(signs):
            return None
        kept.extend([what] if signs == (1, 1) else [])
    return kept


def _in_order(cuts: Sequence[Any], n: Arithmetic) -> Sequence[Any] | None:
    """Cuts from the least to the largest, each once, the first and the last being so; None if not known."""
    start, *inner, end = cuts
    values = [n.value(cut.end if isinstance(cut, Turn) else cut) for cut in inner]
    if len(set(inner)) < 2:
        return [start, *set(inner), end]
    if None in values:
        return None
    by_value = dict(zip(values, inner, strict=True))
    return [
        start,
        *(by_value[value] for value in sorted(value for value in by_value if value is not None)),
        end,
    ]


def _middle(start: Any, end: Any, n: Arithmetic) -> Sequence[Any]:
    """A coordinate in the middle of a span; of an angle its cosine and sine."""
    if isinstance(start, Turn) and isinstance(end, Turn):
        angle = (start.end + end.end) / 2
        return n.cos(angle), n.sin(angle)
    return ((start + end) / 2,)
