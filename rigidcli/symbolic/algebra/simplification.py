"""Shorter forms of exact expressions, and whether one vanishes."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from typing import Any

from rigidcli.errors import ExpressionError
from rigidcli.symbolic.algebra.allowance import Allowance
from rigidcli.symbolic.algebra.atoms import Applied, Atom, Group, Monomial, Pi, Surd, Symbol
from rigidcli.symbolic.algebra.calculus import expand, mapped, rebuilt
from rigidcli.symbolic.algebra.expressions import ONE, Expr, factored, gathered, product, total
from rigidcli.symbolic.algebra.polynomials import quotient
from rigidcli.symbolic.algebra.roots import Rational
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.algebra.trigonometry import (
    elementary_angles,
    exponentials_merged,
    has_functions,
    shortened,
)
from rigidcli.symbolic.language.text import text
from rigidcli.symbolic.language.tree import FUNCTIONS

MAX_TERMS_TO_TIDY = 300
"""A sum of more terms is left as it is."""

MAX_STEPS_TO_TIDY = 20_000
"""In one call, beyond which further forms are not looked for."""

_STEPS_TO_WRITE = 50

MAX_DEPTH_TO_TIDY = 12
"""Of functions and groups inside each other, beyond which only the outermost are made shorter."""

_POINTS = 3
_TRIALS = 40
_BITS = 200
_DOUBT = 1e-3
_BALLS_DOUBT = 1e-35

_LARGEST_ARGUMENT = 1e15
"""Of a function: exp(exp(...)) would need more digits than there is memory for."""

_RANGES = tuple(
    (Fraction(low), Fraction(width))
    for low, width in (("1/4", 2), (-2, 2), (-1, 2), ("1/50", "1/10"), (10, 100), (-100, 200))
)
"""Of the points where expressions are compared: the least value, and how far up they go."""


def tidy(e: Expr) -> Expr:
    """The form with the shortest text among some that are equal to `e` wherever that has a value.

    They are: multiplied out, shortened by the laws of sines and cosines, over one denominator that is divided
    out where it can be, with common factors taken out of all terms or of those with the same
    functions and velocities.
    """
    return _tidied(e, Allowance(MAX_STEPS_TO_TIDY))


def _tidied(e: Expr, allowance: Allowance) -> Expr:
    if len(e.terms) > MAX_TERMS_TO_TIDY or _is_plain(e):
        return e
    inner = e
    if e.depth <= MAX_DEPTH_TO_TIDY:
        with suppress(ExpressionError):
            inner = mapped(e, lambda atom: _tidied_atom(atom, allowance))
    forms = list(dict.fromkeys([e, *_forms(inner, allowance)]))
    return shortest(forms)


def shortest(forms: Sequence[Expr]) -> Expr:
    """The form with the shortest text; of several, the first by that text."""
    return forms[0] if len(forms) == 1 else min(forms, key=_length)


def _is_plain(e: Expr) -> bool:
    """Whether it is one product of numbers and powers of symbols."""
    return len(e.terms) < 2 and all(isinstance(atom, (Symbol, Pi, Surd)) for atom in e.atoms)


def _tidied_atom(atom: Atom, allowance: Allowance) -> Expr | None:
    if isinstance(atom, (Symbol, Pi, Surd)):
        return None
    return rebuilt(atom, lambda inner: _tidied(inner, allowance))


def _length(e: Expr) -> tuple[int, str]:
    written = text(to_tree(e))
    return len(written), written


def _forms(e: Expr, allowance: Allowance) -> Iterator[Expr]:
    """Forms of an expression; one that becomes too large is passed over."""
    known: set[Expr] = set()
    for change in (_unchanged, _shortened, _over_one_denominator):
        with suppress(ExpressionError):
            form = change(e, allowance)
            if form not in known:
                allowance.spend(_STEPS_TO_WRITE * len(form.terms))
                known.add(form)
                yield form
                yield _with_factors(form)
                yield _collected(form)


def _unchanged(e: Expr, allowance: Allowance) -> Expr:
    return e


def _shortened(e: Expr, allowance: Allowance) -> Expr:
    return _reduced(expand(e, allowance), allowance)


def _reduced(e: Expr, allowance: Allowance) -> Expr:
    if len(e.terms) > MAX_TERMS_TO_TIDY:
        return e
    e = exponentials_merged(e)
    return shortened(e, allowance) if has_functions(e) else e


def _with_factors(e: Expr) -> Expr:
    """One product: what all terms have in common, times a group of the rest."""
    coefficient, monomial = factored(e)
    return gathered(coefficient, dict(monomial))


def _collected(e: Expr) -> Expr:
    """Terms with the same functions, groups and velocities together, their common factors taken out."""
    parts: dict[Monomial, dict[Monomial, Rational]] = {}
    for monomial, coefficient in e.ordered:
        shared = tuple(factor for factor in monomial if not _is_parameter(factor[0]))
        parts.setdefault(shared, {})[monomial] = coefficient
    return total(_with_factors(Expr(part)) for part in parts.values())


def _is_parameter(atom: Atom) -> bool:
    return isinstance(atom, (Pi, Surd)) or (isinstance(atom, Symbol) and not atom.is_rate)


def _over_one_denominator(e: Expr, allowance: Allowance) -> Expr:
    """A fraction whose numerator is multiplied out, and divided by the denominator if that leaves no rest."""
    coefficient, monomial = factored(expand(e, allowance))
    above = [(atom, n) for atom, n in monomial if isinstance(atom, Group) and n > 0 and n.denominator == 1]
    below = [(atom, n) for atom, n in monomial if isinstance(atom, Group) and n < 0 and n.denominator == 1]
    rest = {atom: n for atom, n in monomial if (atom, n) not in above and (atom, n) not in below}
    numerator = _shortened(product([gathered(1, {atom: n}) for atom, n in above]), allowance)
    outside, common = factored(numerator)
    numerator = ONE
    for atom, n in common:
        if isinstance(atom, Group) and n > 0 and n.denominator == 1:
            numerator *= gathered(1, {atom: n})
        else:
            rest[atom] = rest.get(atom, 0) + n
    numerator = expand(numerator, allowance)
    denominators = []
    for atom, n in below:
        divisor = _shortened(gathered(1, {atom: 1}), allowance)
        left = int(-n)
        while left and (smaller := quotient(numerator, divisor, allowance)) is not None:
            numerator = smaller
            left -= 1
        if (
            left
            and numerator.as_number is None
            and (inverse := quotient(divisor, numerator, allowance)) is not None
        ):
            numerator = ONE
            denominators.append(inverse)
            left -= 1
        denominators.extend([divisor] * left)
    fraction = product([numerator, *(divisor**-1 for divisor in denominators)])
    return product([gathered(coefficient * outside, rest), fraction])


def is_zero(e: Expr) -> bool:
    """Whether an expression vanishes wherever it has a value.

    Values at random points tell it from zero, or laws prove it to be zero; where neither is sure, values
    of 200 bits with a proved bound of their error decide. An expression for which no point with a value is
    found is not zero unless that is proved.
    """
    if not e.terms:
        return True
    if _seems_zero(e, _FLOATS, _DOUBT) is False:
        return False
    try:
        allowance = Allowance(MAX_STEPS_TO_TIDY)
        reduced = _numerator(elementary_angles(e, allowance), allowance)
    except ExpressionError:
        reduced = e
    if not reduced.terms:
        return True
    if _seems_zero(reduced, _FLOATS, _DOUBT) is False:
        return False
    from flint import ctx

    with ctx.workprec(_BITS):
        return _seems_zero(e, _balls(), _BALLS_DOUBT) is True


def _numerator(e: Expr, allowance: Allowance) -> Expr:
    """What vanishes where the expression does, multiplied out."""
    coefficient, monomial = factored(e)
    above = [gathered(coefficient, {atom: n}) for atom, n in monomial if n > 0 and isinstance(atom, Group)]
    return elementary_angles(product(above), allowance) if above else e


_Functions = Mapping[str, Callable[..., Any]]

_FLOATS: _Functions = {
    **{name: function.real for name, function in FUNCTIONS.items()},
    "power": pow,
    "number": float,
    "pi": lambda: FUNCTIONS["acos"].real(-1.0),
}


def _balls() -> _Functions:
    """The functions of python-flint's balls: numbers with a proved bound of their error."""
    from flint import arb, fmpq

    def method(name: str) -> Callable[[Any], Any]:
        return lambda x: getattr(x, name)()

    return {
        **{name: method(name) for name in FUNCTIONS},
        "abs": abs,
        "sign": method("sgn"),
        "atan2": arb.atan2,
        "power": pow,
        "number": lambda value: arb(fmpq(value.numerator, value.denominator)),
        "pi": arb.pi,
    }


def enclosed(e: Expr, point: Mapping[str, Fraction], bits: int) -> Any:
    """The value of an expression as a ball of so many bits; its names have values in `point`.

    Raises ValueError or ArithmeticError where it has no finite real value.
    """
    from flint import ctx

    with ctx.workprec(bits):
        return _value(e, point, _balls())


def _seems_zero(e: Expr, functions: _Functions, doubt: float) -> bool | None:
    """Whether its values are lost in the rounding of its terms; None if it has none at any point tried."""
    source = random.Random(20)  # noqa: S311 - points that are the same every time
    names = sorted(e.names)
    found = 0
    for trial in range(_TRIALS):
        low, width = _RANGES[trial % len(_RANGES)]
        point = {name: low + width * Fraction(source.randrange(1, 1009), 1009) for name in names}
        try:
            values = [_value(Expr({m: c}), point, functions) for m, c in e.ordered]
            different = abs(sum(values)) > doubt * sum(map(abs, values))
        except (ArithmeticError, ValueError):
            continue
        if different:
            return False
        found += 1
        if found == _POINTS:
            break
    return True if found else None


def _value(e: Expr, point: Mapping[str, Fraction], functions: _Functions) -> Any:
    number = functions["number"]
    value = number(Fraction(0))
    for monomial, coefficient in e.ordered:
        part = number(Fraction(coefficient))
        for atom, exponent in monomial:
            base = _value_of_atom(atom, point, functions)
            if exponent != 1:
                whole = exponent.denominator == 1
                base = functions["power"](base, int(exponent) if whole else number(Fraction(exponent)))
            if isinstance(base, complex) or not (isinstance(base, float) or base.is_finite()):
                raise ValueError("no real value")
            part *= base
        value += part
    return value


def _value_of_atom(atom: Atom, point: Mapping[str, Fraction], functions: _Functions) -> Any:
    match atom:
        case Symbol(name=name, positive=positive):
            return functions["number"](abs(point[name]) if positive else point[name])
        case Surd(value=value):
            return functions["number"](Fraction(value))
        case Group(inner=inner):
            return _value(inner, point, functions)
        case Applied(function=function, arguments=arguments):
            values = [_value(argument, point, functions) for argument in arguments]
            if any(abs(argument) > _LARGEST_ARGUMENT for argument in values):
                raise OverflowError
            return functions["power" if function == "pow" else function](*values)
        case _:
            return functions["pi"]()
