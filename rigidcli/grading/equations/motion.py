"""The motion that equations are held against: its states, and how every derivative follows from them.

A state has values of `functions` of the time: coordinates, or whatever the equations are for. With momenta
or velocities of their own name beside them, which are `auxiliary`, first-order equations for both, and
equations of second order for the functions alone, say the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property, lru_cache

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import Expr, number, symbol, total
from rigidcli.algebra.field import Point, depends_on_signs, reduced
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.document.variables import acceleration, momentum, velocity
from rigidcli.errors import ExpressionError
from rigidcli.grading.expressions.formula import Domain, Vocabulary, spellings
from rigidcli.language.tree import Node
from rigidcli.mechanics.energies import TIME

FEW = 60
"""Points of the field among which one is looked for that has values."""

POINTS = 4096
"""Points of the field that are kept."""


@dataclass(frozen=True, eq=False)
class Motion:
    """What moves, and how.

    `second` has the functions whose second derivatives are known, `rates` the derivatives that the key tells.
    `domains` has all that is independent: states, parameters and the time, of which some parameters have
    `fixed` values; `parameters` are derived from others. `known` has all further names, derivatives above
    all, each in those before. Random points follow from the `seed`. A mistake has changed the `base`.
    """

    functions: tuple[str, ...]
    second: tuple[str, ...]
    auxiliary: tuple[str, ...]
    rates: Mapping[str, Expr]
    domains: Mapping[str, Domain]
    parameters: Mapping[str, Expr] = field(default_factory=dict)
    known: Mapping[str, Expr] = field(default_factory=dict)
    momenta: tuple[str, ...] = ()
    fixed: Mapping[str, Fraction] = field(default_factory=dict)
    seed: str = ""
    base: Motion | None = None

    @property
    def tops(self) -> tuple[str, ...]:
        """The highest derivative of each function."""
        return tuple(acceleration(f) if f in self.second else velocity(f) for f in self.functions)

    @property
    def accelerations(self) -> frozenset[str]:
        """The names of all second derivatives."""
        return frozenset(map(acceleration, self.functions))

    @property
    def middles(self) -> tuple[str, ...]:
        """First derivatives of functions that have second ones."""
        return tuple(map(velocity, self.second))

    @property
    def auxiliary_rates(self) -> tuple[str, ...]:
        """Derivatives of what is auxiliary."""
        return tuple(map(velocity, self.auxiliary))

    @property
    def partners(self) -> Mapping[str, str]:
        """The auxiliary function of each function that has one."""
        if self.first_order:
            return dict(zip(self.functions, self.auxiliary, strict=False))
        return {q: v for v in self.auxiliary for q in self.functions if self.known[v] == symbol(velocity(q))}

    @property
    def jets(self) -> tuple[str, ...]:
        """All that equations may be solved for: derivatives, and what is auxiliary."""
        return (*self.tops, *self.auxiliary_rates, *self.auxiliary, *self.middles)

    @property
    def first_order(self) -> bool:
        """Whether the key has no second derivatives."""
        return self.accelerations.isdisjoint(self.rates)

    @property
    def told(self) -> dict[str, str]:
        """The derivative that the key tells, of each function and of what is auxiliary."""
        return {
            name: next(rate for rate in (acceleration(name), velocity(name)) if rate in self.rates)
            for name in self.names
            if velocity(name) in self.rates or acceleration(name) in self.rates
        }

    @property
    def names(self) -> tuple[str, ...]:
        """All functions, with what is auxiliary."""
        return self.functions + self.auxiliary

    @cached_property
    def symbols(self) -> Mapping[str, Expr]:
        """What the independent and the derived names are in exact expressions."""
        own = {name: symbol(name, domain == "positive") for name, domain in self.domains.items()}
        return own | dict(self.parameters)

    @cached_property
    def depends_on_signs(self) -> bool:
        """Whether a derivative depends on what is positive."""
        return any(map(depends_on_signs, self.known.values()))

    def exact(self, node: Node) -> Expr:
        """The exact expression of a tree. Raises ExpressionError."""
        return from_tree(node, self.symbols)

    def in_states(self, e: Expr) -> Expr:
        """The expression with all derivatives put in. Raises ExpressionError."""
        for name, known in reversed([*self.known.items()]):
            e = substitute(e, {name: known})
        return e

    def point(self, place: int) -> Point | None:
        """A random point of the finite field on the motion, if this one has values."""
        return _point(self, place)

    def free_point(self, place: int) -> Point:
        """A random point of the finite field where derivatives are of no motion."""
        point = Point(f"{self.seed} {place}", {})
        for name, domain in self.domains.items():
            point.values[name] = (point.square if domain == "positive" else point.element)(name)
        point.values |= {name: point.value(number(value)) for name, value in self.fixed.items()}
        return point

    def changed(self, changes: Mapping[str, Expr]) -> Motion:
        """The motion with other derivatives. Second ones follow from those of what is auxiliary."""
        return replace(
            self,
            rates={name: changes.get(name, e) for name, e in self.rates.items()},
            known={name: changes.get(name, e) for name, e in self.known.items()},
            base=self,
        )

    def vocabulary(self, told: bool) -> Vocabulary:
        """The names that an answer may use."""
        every = (*self.names, *self.middles, *self.auxiliary_rates, *self.tops)
        names: dict[str, Domain] = {**dict.fromkeys(every, "real"), **self.domains}
        other = spellings(names, self.momenta, self.middles or self.tops)
        short = [(spelling, meant) for spelling, meant in other.items() if meant in self.names]
        for name, meant in [*((name, name) for name in self.names), *short]:
            for spelling, rate in _respelled(name, meant):
                if rate in names and spelling not in names:
                    other.setdefault(spelling, rate)
        return Vocabulary(names, {n: to_tree(e) for n, e in self.parameters.items()}, other, told)


@lru_cache(POINTS)
def _point(motion: Motion, place: int) -> Point | None:
    start = None if motion.base is None else motion.base.point(place)
    if motion.base is not None and start is None:
        return None
    # Only what is changed is worked again.
    changed = {n for n, e in motion.known.items() if motion.base is None or e is not motion.base.known[n]}
    point = motion.free_point(place) if start is None else Point(start.seed, start.values)
    try:
        for name, e in motion.known.items():
            if name in changed or not changed.isdisjoint(e.names):
                changed.add(name)
                point.values[name] = point.value(e)
    except (ValueError, ExpressionError):
        return None
    return point


def _respelled(name: str, meant: str) -> list[tuple[str, str]]:
    """Other spellings of derivatives: `x_dot`, `xdotdot`, of a momentum `pdot_x` and `pdot`."""
    first, second = velocity(meant), acceleration(meant)
    pairs = [
        (velocity(name), first),
        (f"{name}_dot", first),
        (acceleration(name), second),
        (f"{name}_ddot", second),
        (f"{name}dotdot", second),
    ]
    head, _, tail = name.partition("_")
    if tail:
        pairs += [(f"{head}dot_{tail}", first), (f"{head}_dot_{tail}", first), (f"{head}ddot_{tail}", second)]
    return pairs


def paired(names: Sequence[str], rates: Mapping[str, Expr]) -> tuple[str, ...]:
    """The functions among `names` that are momenta, or else velocities, of the others; () for neither."""
    momenta = tuple(momentum(name) for name in names if momentum(name) in names)
    if len(momenta) * 2 == len(names):
        return momenta
    moved = {name: single for name in names if (single := _single(rates[velocity(name)])) in names}
    velocities = tuple(dict.fromkeys(single for single in moved.values() if single not in moved))
    return velocities if len(velocities) * 2 == len(names) == 2 * len(moved) else ()


def _single(e: Expr) -> str:
    """The symbol that an expression is."""
    name = next(iter(e.names), "")
    return name if e in (symbol(name), symbol(name, True)) else ""


def with_derivatives(motion: Motion) -> Motion:
    """The motion with all its derivatives.

    Where first-order rates of auxiliary functions determine the state, second derivatives follow by
    d/dt f(q, a, t) = sum_z df/dz zdot + df/dt.
    """
    rates = {name: motion.exact(to_tree(e)) for name, e in motion.rates.items()}
    if not motion.first_order or not motion.auxiliary:
        return replace(motion, rates=rates, known={**rates, **motion.known})
    plain = replace(motion, functions=motion.names, second=(), auxiliary=(), rates=rates, known=rates)
    try:
        of_time = {acceleration(f): _chain(rates[velocity(f)], motion.names) for f in motion.functions}
        slopes = [[derivative(rates[velocity(f)], a) for a in motion.auxiliary] for f in motion.functions]
    except ExpressionError:
        return plain
    if not _is_regular(slopes, plain):
        return plain
    return replace(motion, second=motion.functions, rates=rates, known=rates | of_time)


def _chain(e: Expr, names: Iterable[str]) -> Expr:
    """The derivative by time, in which the rates of the names stay names."""
    parts = [derivative(e, name) * symbol(velocity(name)) for name in names]
    return total([*parts, derivative(e, TIME)])


def _is_regular(matrix: Sequence[Sequence[Expr]], motion: Motion) -> bool:
    """Whether a square matrix has full rank at some point of the field."""
    for point in filter(None, map(motion.point, range(FEW))):
        with suppress(ValueError, ExpressionError):
            return len(reduced([[point.value(e) for e in row] for row in matrix])) == len(matrix[0])
    return False
