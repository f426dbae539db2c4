"""Expressions in other forms, by laws that hold for all real numbers, and others that only look like them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence

from hypothesis import strategies as st

from rigidcli.language.tree import (
    Call,
    Constant,
    Name,
    Negative,
    Node,
    Number,
    Power,
    Product,
    Reciprocal,
    Sum,
    operands,
    rebuilt,
)

POSITIVE = ("m", "k")
REAL = ("x", "y", "p_x")

Rule = Callable[[Node], Node | None]


def number(value: float) -> Number:
    return Number(f"{value:g}", value)


ONE, TWO, HALF = number(1), number(2), number(0.5)


def _product(*factors: Node) -> Node:
    return Product(factors)


def _sum(*terms: Node) -> Node:
    return Sum(terms)


def _over(above: Node, below: Node) -> Node:
    return Product((above, Reciprocal(below)))


def _square(x: Node) -> Node:
    return Power(x, TWO)


# --- laws


def _commuted(node: Node) -> Node | None:
    match node:
        case Sum(terms):
            return Sum(terms[::-1])
        case Product(factors):
            return Product(factors[::-1])
    return None


def _grouped(node: Node) -> Node | None:
    match node:
        case Sum((first, second, *rest)) if rest:
            return _sum(first, _sum(second, *rest))
        case Product((first, second, *rest)) if rest:
            return _product(first, _product(second, *rest))
    return None


def _distributed(node: Node) -> Node | None:
    match node:
        case Product(factors):
            for place, factor in enumerate(factors):
                if isinstance(factor, Sum):
                    return Sum(
                        tuple(Product((*factors[:place], t, *factors[place + 1 :])) for t in factor.terms)
                    )
    return None


def _one_denominator(node: Node) -> Node | None:
    match node:
        case Sum((Product((above, Reciprocal(below))), *rest)):
            return _over(_sum(above, _product(_sum(*rest) if len(rest) > 1 else rest[0], below)), below)
    return None


def _squared_out(node: Node) -> Node | None:
    match node:
        case Power(Sum((a, b)), Number(_, 2.0)):
            return _sum(_square(a), _product(TWO, a, b), _square(b))
        case Power(base, Number(_, 2.0)):
            return _product(base, base)
        case Power(base, Number(_, 3.0)):
            return _product(_square(base), base)
    return None


def _as_power(node: Node) -> Node | None:
    match node:
        case Reciprocal(operand):
            return Power(operand, Negative(ONE))
        case Call("sqrt", (x,)):
            return Power(x, HALF)
        case Power(base, Number(_, 2.0)):
            return Power(base, _over(number(4), TWO))
    return None


def _other_function(node: Node) -> Node | None:
    match node:
        case Call("sin", (x,)):
            return Call("cos", (_sum(x, Negative(_over(Constant("pi"), TWO))),))
        case Call("cos", (x,)):
            return _sum(ONE, Negative(_product(TWO, _square(Call("sin", (_over(x, TWO),))))))
        case Call("tan", (x,)):
            return _over(Call("sin", (x,)), Call("cos", (x,)))
        case Call("exp", (x,)):
            return _square(Call("exp", (_over(x, TWO),)))
        case Call("sqrt", (x,)):
            return Call("exp", (_product(HALF, Call("log", (x,))),))
        case Power(Call("sin", (x,)), Number(_, 2.0)):
            return _sum(ONE, Negative(_square(Call("cos", (x,)))))
        case Power(Call("cos", (x,)), Number(_, 2.0)):
            return _over(_sum(ONE, Call("cos", (_product(TWO, x),))), TWO)
        case Name(name) if name in POSITIVE:
            return Call("exp", (Call("log", (node,)),))
    return None


def _halved_angle(node: Node) -> Node | None:
    match node:
        case Call("sin", (x,)):
            half = _over(x, TWO)
            return _product(TWO, Call("sin", (half,)), Call("cos", (half,)))
        case Call("cos", (x,)):
            half = _over(x, TWO)
            return _sum(_square(Call("cos", (half,))), Negative(_square(Call("sin", (half,)))))
    return None


def _padded(node: Node) -> Node:
    return _sum(node, number(0))


def _times_one(node: Node) -> Node:
    return _product(ONE, node)


def _negated_twice(node: Node) -> Node:
    return Negative(_product(number(1), Negative(node)))


def _with_circle(node: Node) -> Node:
    x = Name("x")
    return _product(node, _sum(_square(Call("sin", (x,))), _square(Call("cos", (x,)))))


def _there_and_back(node: Node) -> Node:
    return _sum(_sum(node, Name("k")), Negative(Name("k")))


def _up_and_down(node: Node) -> Node:
    return _over(_product(node, Name("m")), Name("m"))


def _another_number(node: Node) -> Node | None:
    match node:
        case Number(text, value) if "e" not in text:
            return _over(number(2 * value), TWO) if value == round(value, 3) else None
    return None


LAWS: Sequence[Rule] = (
    _commuted, _grouped, _distributed, _one_denominator, _squared_out, _as_power, _other_function,
    _halved_angle, _padded, _times_one, _negated_twice, _with_circle, _there_and_back, _up_and_down,
    _another_number,
)  # fmt: skip


# --- what is not the same


def _another_coefficient(by: float) -> Rule:
    def change(node: Node) -> Node | None:
        return number(round(node.value * by, 6)) if isinstance(node, Number) and node.value else None

    return change


def _another_sign(node: Node) -> Node:
    return node.operand if isinstance(node, Negative) else Negative(node)


def _another_name(node: Node) -> Node | None:
    if isinstance(node, Name):
        names = POSITIVE if node.name in POSITIVE else REAL
        if node.name in names:
            return Name(names[(names.index(node.name) + 1) % len(names)])
    return None


def _another_exponent(node: Node) -> Node | None:
    match node:
        case Power(base, Number(_, value)):
            return Power(base, number(value + 1))
        case Name():
            return _square(node)
    return None


def _another_trig(node: Node) -> Node | None:
    match node:
        case Call("sin" | "cos" as function, arguments):
            return Call("cos" if function == "sin" else "sin", arguments)
        case Call("sqrt", (x,)):
            return x
    return None


def _without_a_term(node: Node) -> Node | None:
    match node:
        case Sum((_, *rest)):
            return Sum(tuple(rest)) if len(rest) > 1 else rest[0]
        case Reciprocal(operand):
            return operand
    return None


MISTAKES: Sequence[Rule] = (
    _another_coefficient(2.0), _another_coefficient(0.5), _another_coefficient(1.001), _another_sign,
    _another_name, _another_exponent, _another_trig, _without_a_term,
)  # fmt: skip


_DECIMAL = re.compile(r"([0-9]+)\.([0-9]+)")


def in_fractions(written: str) -> str:
    """The text with fractions in place of decimals, which cannot pass for rounded ones."""
    return _DECIMAL.sub(lambda found: f"({found[1]}{found[2]}/1{'0' * len(found[2])})", written)


# --- anywhere in a tree


def parts(node: Node) -> Iterator[Node]:
    """All nodes of a tree, the root first."""
    yield node
    for inner in operands(node):
        yield from parts(inner)


def changed_at(node: Node, place: int, rule: Rule) -> Node | None:
    """The tree with a rule applied to the node at this place in `parts`; None where it does not apply."""
    counter = iter(range(10**9))
    applied: list[bool] = []

    def walk(inner: Node) -> Node:
        if next(counter) == place:
            new = rule(inner)
            applied.append(new is not None)
            for _ in list(parts(inner))[1:]:
                next(counter)
            return inner if new is None else new
        return rebuilt(inner, walk)

    new = walk(node)
    return new if applied and applied[0] else None


def changed(rules: Sequence[Rule], most: int) -> Callable[[st.DrawFn, Node], Node]:
    """Draws a tree with up to so many rules applied, one after another, each where it does apply."""

    def draw_one(draw: st.DrawFn, node: Node) -> Node:
        for _ in range(draw(st.integers(1, most))):
            count = sum(1 for _ in parts(node))
            places = draw(st.lists(st.integers(0, count - 1), min_size=3, max_size=3))
            rule = draw(st.sampled_from(rules))
            new = next((n for p in places if (n := changed_at(node, p, rule)) is not None), None)
            node = node if new is None else new
        return node

    return draw_one


# --- expressions with a value almost everywhere

_LEAVES = st.one_of(
    st.sampled_from(POSITIVE + REAL).map(Name), st.sampled_from([1.0, 2.0, 3.0, 0.5, 1.5, 9.81]).map(number)
)


def _safe(x: Node) -> Node:
    return _sum(ONE, _square(x))


def _grown(children: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    several = st.lists(children, min_size=2, max_size=3).map(tuple)
    return st.one_of(
        several.map(Sum),
        several.map(Product),
        st.tuples(children, children).map(lambda ab: _sum(ab[0], Negative(ab[1]))),
        st.tuples(children, st.sampled_from(POSITIVE)).map(lambda ab: _over(ab[0], Name(ab[1]))),
        st.tuples(children, children).map(lambda ab: _over(ab[0], _safe(ab[1]))),
        children.map(_square),
        children.map(lambda x: Power(x, number(3))),
        children.map(lambda x: Call("sin", (x,))),
        children.map(lambda x: Call("cos", (x,))),
        children.map(lambda x: Call("sqrt", (_safe(x),))),
        children.map(lambda x: Call("exp", (Call("sin", (x,)),))),
    )


EXPRESSIONS: st.SearchStrategy[Node] = st.recursive(_LEAVES, _grown, max_leaves=8)


@st.composite
def rewritten(draw: st.DrawFn, node: Node, most: int = 8) -> Node:
    """The same function in another form."""
    return changed(LAWS, most)(draw, node)


@st.composite
def mistaken(draw: st.DrawFn, node: Node) -> Node:
    """The expression with one thing changed; it may still be the same function."""
    return changed(MISTAKES, 1)(draw, node)


# --- what is nearly nothing

_PLACES = st.sampled_from(
    ["60", "123.4", "(-77.7)", "2.5e4", "9.9e5", "1e7", "1e9", "(-1e12)", "0.123", "1e-3"]
)
_WIDTHS = st.sampled_from(["1", "1e2", "1e4", "1e6", "1e12"])
_SIZES = st.sampled_from(["1", "1e-3", "1e-9", "1e-15", "1e-30", "1e-60", "1e-200", "1e3", "1e12"])

_HIDDEN = (
    "abs({x} - {a}) + {x} - {a}", "abs({x} - {a}) - {x} + {a}", "sqrt(({x} - {a})^2) + {x} - {a}",
    "(({x} - {a})^4)^(1/4) - {x} + {a}", "sign({x} - {a}) + 1", "sign({x}^3 - {a}) - 1",
    "(abs({x} - {a}) + {x} - {a})*(abs({x} - {a} - 0.01) - {x} + {a} + 0.01)",
    "exp(-{s}*({x} - {a})^2)", "1/cosh({s}*({x} - {a}))", "1 - tanh({s}*({x} - {a}))^2",
    "1/(1 + {s}*({x} - {a})^2)^40", "exp(-{s}*(cos({x}) - 0.7)^2)", "log(1 + exp(-{s}*({x} - {a})^2))",
    "pi/2 - atan(exp({s}*abs({x} - {a})))", "exp(-exp({x}^2 + {s}))", "log(1 + exp(1e5*{x}))",
    "tanh({s}*({x} - {a})) - sign({x} - {a})", "exp(-1/{x}^2)", "sin(1e8*{x})*1e-12", "{x}",
    "atan(tan({x}/1e7)) - {x}/1e7", "acos(cos({x}/1e4)) - {x}/1e4", "atan2({x} - {a}, -1) - pi",
    "atan(1/({x} - {a})) + atan({x} - {a}) + pi/2", "atan(1/({x} - {a})) + atan({x} - {a}) - pi/2",
    "({x} - {a})*({x} - 0.5)*({x} + 2)", "log(({x} - {a})^2) - 2*log(abs({x} - {a}) + exp(-{s}*{x}^2))",
)  # fmt: skip
"""Functions of a real x that are zero or small at most numbers, and not at all."""

_WITH = (
    "{key} + {c}*({e})", "({key})*(1 + {c}*({e}))", "({key})*exp({c}*({e}))", "{key} + tanh({c}*({e}))",
    "({key} + {c}*({e}))*(sin({x})^2 + cos({x})^2)", "{key} + {c}*({e})*{x}",
    "({key})*(2*cos({x}/2)^2 - cos({x})) + {c}*({e})",
)  # fmt: skip
"""Ways to change a function by another one."""


@st.composite
def attacked(draw: st.DrawFn, key: str, names: Sequence[str]) -> str:
    """The text of a key, changed by what is nearly nothing in one of its real names."""
    x = draw(st.sampled_from(sorted(names)))
    hidden = draw(st.sampled_from(_HIDDEN)).format(x=x, a=draw(_PLACES), s=draw(_WIDTHS))
    return draw(st.sampled_from(_WITH)).format(key=key, x=x, c=draw(_SIZES), e=hidden)
