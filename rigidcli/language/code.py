"""Trees to code: many expressions at once as one fast function of floats, arrays or Taylor series.

    flow = function([parse("v"), parse("-k*x/m")], ["t", "x", "v"], {"k": 4.0, "m": 1.0})
    flow(math)(0.0, 1.0, 0.0)         # (0.0, -4.0)

The text that is run is written here from the nodes of the trees: arguments become v0, v1, ..., numbers are
written by `repr`, and no text of a document gets into it. An operation that comes more than once is done
once, in a statement of its own. One that comes once stands inside the operation that needs it, as storing it
takes a fifth of the time of doing it, but no deeper than Python reads with ease.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from types import ModuleType
from typing import Any, NamedTuple, TypeAlias

from rigidcli.core.kicks import Watched
from rigidcli.core.solution import Flow
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.language import expression, tree
from rigidcli.language.expression import Expression
from rigidcli.language.tree import Node, UnknownFunction, fold, insides, names_in, nodes
from rigidcli.language.words import FUNCTIONS, WITH_CORNERS

# The largest power that is written as products: they are faster, and heyoka has no powers of 0.
MOST_MULTIPLIED = 16
DEEPEST = 20  # the most operations that stand inside each other
GROWING = frozenset(["exp", "sinh", "cosh", "pow"])  # operations that may be too large for a float
KEPT = 64  # flows that are kept, as the same equations may be followed from many starts
_VARIABLE = re.compile(r"\bs\d+\b")  # a variable that holds the value of an operation
# The name of a variable, or a number where it depends on constants alone.
Value: TypeAlias = str | float


def function(
    expressions: Sequence[Expression | Node],
    arguments: Sequence[str],
    constants: Mapping[str, float],
    steps: Sequence[tuple[str, Node]] = (),
) -> Flow:
    """A flow: of `math`, `numpy` or `heyoka` it makes a function of the `arguments`, in order.

    The function gives a tuple with the value of each expression; where an expression holds none of the
    arguments, a float. `steps` are names with their values, each worked out after those before and known to
    all that follow. An unknown function has the values of its `trial`, as in tests at random points.

    With `math` and `numpy` the values agree to rounding with those of `Expression.evaluate`, but for
    intermediate values that are too large: they are infinite, and 1/x may still be 0.

    Without a finite real value, the function for floats raises an ArithmeticError or a ValueError, or gives
    inf or NaN; that for arrays always does the latter. A module that lacks a function makes the
    flow raise a ComputationError.

    Raises ExpressionError: a name has no value, or a part without arguments has no finite real value.
    """
    writer = _Writer({name: f"v{i}" for i, name in enumerate(arguments)}, constants)
    head = f"def f({', '.join(map(str, writer.values.values()))}):"
    for name, node in steps:
        writer.values[name] = writer.write(node)
    roots = [writer.write(e.root if isinstance(e, Expression) else e) for e in expressions]
    result = f"return ({''.join(f'{_text(root)}, ' for root in roots)})"
    return _flow("\n ".join([head, *_nested(writer.known, result)]), frozenset(writer.functions))


def watched(
    slopes: Sequence[Node],
    arguments: Sequence[str],
    constants: Mapping[str, float],
    steps: Sequence[tuple[str, Node]] = (),
    fixed: Sequence[str] = (),
) -> Watched:
    """What an integrator of these slopes has to look at. The first of the `arguments` is the time.

    Those that are `fixed` do not change with it: functions of the time alone have them as arguments, too.
    """
    trees, time = [*slopes, *(node for _, node in steps)], {arguments[0]}
    calls = (part for part in nodes(trees) if isinstance(part, tree.Call))
    phases = {call.arguments[0] for call in calls if call.function in ("sin", "cos", "tan")}
    inner, waves = (
        [(node, names_in(node) - constants.keys() - {*fixed}) for node in sorted(parts, key=repr)]
        for parts in (insides(trees), phases)
    )
    timed, periodic = (
        function([node for node, names in parts if names == time], [*time, *fixed], constants)
        for parts in (inner, waves)
    )
    moving = [node for node, names in inner if names - time]
    return Watched(timed, periodic, function(moving, arguments, constants, steps))


@lru_cache(maxsize=KEPT)
def _flow(text: str, functions: frozenset[str]) -> Flow:
    """The flow of this text, which uses these `functions`.

    It is the same one for the same text, so that what is compiled of it serves all starts of an ensemble.
    """
    code = compile(text, "<expressions>", "exec")

    def flow(module: ModuleType) -> Callable[..., tuple[Any, ...]]:
        names: dict[str, Any] = {"__builtins__": {}}
        names |= {name: _operation(name, module) for name in sorted(functions)}
        exec(code, names)  # noqa: S102 - written above, from numbers and the names v0, s0 and so on
        made: Callable[..., tuple[Any, ...]] = names["f"]
        return made

    return flow


def _nested(known: Mapping[str, str], result: str) -> Iterator[str]:
    """The statements: operations (the keys) with their variables, those needed once where they are needed."""
    uses = Counter(name for text in (*known, result) for name in _VARIABLE.findall(text))
    inside: dict[str, str] = {}
    depths: dict[str, int] = {}
    for text, name in [*known.items(), (result, "")]:
        depth = max((depths.get(part, 0) for part in _VARIABLE.findall(text)), default=0)
        whole = _VARIABLE.sub(lambda part: inside.get(part[0], part[0]), text)
        if uses[name] == 1 and depth < DEEPEST:
            inside[name], depths[name] = f"({whole})", depth + 1
        else:
            yield f"{name} = {whole}" if name else whole


def _operation(name: str, module: ModuleType) -> Callable[..., Any]:
    """What a function, or `pow`, is for the numbers of a module: `math`, `numpy` or `heyoka`."""
    operation: Callable[..., Any]
    if module is math:
        operation = math.pow if name == "pow" else FUNCTIONS[name].real
        operation = _or_infinite(operation, name) if name in GROWING else operation
    elif module.__name__ == "numpy":
        operation = getattr(module, "power" if name == "pow" else FUNCTIONS[name].numpy)
    elif name == "pow":
        # Of the two, heyoka wants the base to be one of its own expressions.
        return lambda base, exponent: module.expression(1.0) * base**exponent
    elif name in WITH_CORNERS:
        raise ComputationError(f"`{name}` has no Taylor series")
    else:
        operation = getattr(module, name)
    return operation


def _or_infinite(operation: Callable[..., float], name: str) -> Callable[..., float]:
    """The operation with the infinite values of IEEE 754, where `math` raises an OverflowError."""

    def extended(*values: float) -> float:
        try:
            return operation(*values)
        except OverflowError:
            import numpy as np  # which is needed this once

            with np.errstate(over="ignore"):
                return float(_operation(name, np)(*values))

    return extended


class _Writer:
    """The operations so far, each `known` by its text, and what they use."""

    __slots__ = ("constants", "functions", "known", "values")

    def __init__(self, arguments: Mapping[str, str], constants: Mapping[str, float]) -> None:
        self.values: dict[str, Value] = dict(arguments)
        self.constants = constants
        self.functions: set[str] = set()
        self.known: dict[str, str] = {}

    def let(self, text: str) -> str:
        """A variable with the value of this operation."""
        return self.known.setdefault(text, f"s{len(self.known)}")

    def write(self, node: Node) -> Value:
        """The value of a tree, after statements that make it."""
        kind = expression.numbers(
            lambda text, value: expression.finite(value),
            self.power,
            self.called,
            self.joined,
            lambda value: -value if isinstance(value, float) else self.let(f"-{value}"),
        )
        written: Value = fold(node, self.named, kind)
        return written

    def named(self, name: str) -> Value:
        return self.values[name] if name in self.values else expression.known(name, self.constants)

    def joined(self, left: Value, sign: str, right: Value) -> Value:
        if isinstance(left, float) and isinstance(right, float):
            return expression.joined(left, sign, right)
        if (left, sign) in ((0.0, "+"), (1.0, "*")):
            return right
        return self.let(f"{_text(left)} {sign} {_text(right)}")

    def power(self, base: Value, exponent: Value) -> Value:
        if isinstance(base, float) and isinstance(exponent, float):
            return expression.power(base, exponent)
        if isinstance(exponent, float) and exponent.is_integer() and abs(exponent) <= MOST_MULTIPLIED:
            return self.multiplied(_text(base), int(exponent))
        self.functions.add("pow")
        return self.let(f"pow({_text(base)}, {_text(exponent)})")

    def multiplied(self, base: str, exponent: int) -> Value:
        """An integer power, from repeated squares."""
        product, square, left = "", base, abs(exponent)
        while left:
            if left % 2:
                product = self.let(f"{product} * {square}") if product else square
            left //= 2
            if left:
                square = self.let(f"{square} * {square}")
        if not product:
            return 1.0
        return product if exponent > 0 else self.let(f"1.0 / {product}")

    def called(self, name: str, values: Sequence[Value]) -> Value:
        if isinstance(name, UnknownFunction):
            return self.tried(name, values)
        numbers = [value for value in values if isinstance(value, float)]
        if len(numbers) == len(values):
            return expression.call(name, numbers)
        self.functions.add(name)
        return self.let(f"{name}({', '.join(map(_text, values))})")

    def tried(self, function: UnknownFunction, values: Sequence[Value]) -> Value:
        """The formula that stands in for an unknown function."""
        total: Value
        total, *factors = function.trial
        for factor, x in zip(factors, values, strict=True):
            cubed = self.joined(x, "+", self.power(x, 3.0))
            total = self.joined(total, "+", self.joined(factor, "*", cubed))
        return total


def _text(value: Value) -> str:
    if isinstance(value, str):
        return value
    return f"({value!r})" if math.copysign(1.0, value) < 0 else repr(value)


# --- values in steps: what stands in several places is worked out once

Step = tuple[str, tree.Node]  # a name, and its value from names before
SIGNED = (tree.Negative, tree.Reciprocal)  # a tree with another sign, or below a fraction bar


class Formulas(NamedTuple):
    """Trees to be worked out: `steps` one after the other, each known to those that follow, and `values`."""

    steps: tuple[Step, ...]
    values: tuple[tree.Node, ...]

    @property
    def names(self) -> frozenset[str]:
        """The names in the trees, and those of the steps."""
        named = {name: tree.names_in(value) for name, value in self.steps}
        return frozenset(named).union(*named.values(), *map(tree.names_in, self.values))


def shared(steps: Sequence[Step], values: Sequence[tree.Node]) -> Formulas:
    """The same values, in which nothing but names and numbers stands twice; steps without use are left out.

    Names of new steps begin with `.s`.

    Raises ExpressionError: a number is too large for a float.
    """
    kept = _needed_steps(steps, values)
    roots = [*(value for _, value in kept), *values]
    parts = dict.fromkeys(tree.nodes(roots))
    for part in parts:
        if isinstance(part, tree.Number) and not math.isfinite(part.value):
            raise ExpressionError(f"the number {part.text[:20]}... is too large")
    # Each part counts once, in however many places it stands. A sign or a division is no part of its own.
    inside = (operand for part in parts if not isinstance(part, SIGNED) for operand in tree.operands(part))
    uses = Counter(map(_unsigned, [*roots, *inside]))
    made: list[Step] = []
    names: dict[tree.Node, tree.Name] = {}

    def write(node: tree.Node) -> tree.Node:
        if node in names:
            return names[node]
        changed = tree.rebuilt(node, write)
        if uses[node] < 2 or not tree.operands(node) or not tree.names_in(node):
            return changed
        names[node] = tree.Name(f".s{len(names) + 1}")
        made.append((names[node].name, changed))
        return names[node]

    for name, value in kept:
        made.append((name, write(value)))  # after what it is made of
    written = tuple(map(write, values))
    return Formulas(tuple(made), written)


def _needed_steps(steps: Sequence[Step], values: Iterable[tree.Node]) -> list[Step]:
    needed = set[str]().union(*map(tree.names_in, values))
    kept: list[Step] = []
    for name, value in reversed(steps):
        if name in needed:
            kept.insert(0, (name, value))
            needed |= tree.names_in(value)
    return kept


def _unsigned(node: tree.Node) -> tree.Node:
    return _unsigned(node.operand) if isinstance(node, SIGNED) else node


def solved(
    matrix: Sequence[Sequence[tree.Node]], right: Sequence[tree.Node], *, is_definite: bool = True
) -> tuple[list[Step], list[tree.Node]]:
    """Steps, and then x: a x = b is solved for a symmetric matrix (n by n) and b (n), for `code.function`.

    The factors are L D L^T without pivots, as a positive definite matrix has them: a mass matrix is one, or
    its square is. So has [[M, A^T], [A, 0]] with such an M, which is not definite. Zeros save steps. Names of
    steps begin with a dot, as no name of a document does.
    """
    size, steps = len(matrix), list[Step]()

    def named(kind: str, value: tree.Node) -> tree.Node:
        if value in (tree.ZERO, tree.ONE) or isinstance(value, tree.Name):
            return value
        steps.append((f".{kind}{len(steps)}", value))
        return tree.Name(steps[-1][0])

    # Zero has one tree from here on, however it is written.
    rows = [[tree.ZERO if getattr(entry, "value", None) == 0 else entry for entry in row] for row in matrix]
    if is_definite and any(rows[i][i] == tree.ZERO for i in range(size)):
        right = [sum((a * b for a, b in zip(row, right, strict=True)), tree.ZERO) for row in rows]
        rows = [[sum((a * b for a, b in zip(r, s, strict=True)), tree.ZERO) for s in rows] for r in rows]
    factors: list[list[tree.Node]] = [[tree.ZERO] * size for _ in rows]
    pivots, ahead = list[tree.Node](), list[tree.Node]()
    for j in range(size):
        # D_j = A_jj - sum_k L_jk^2 D_k,  L_ij = (A_ij - sum_k L_ik L_jk D_k)/D_j
        carried = [factors[j][k] * pivots[k] for k in range(j)]
        pivots.append(named("d", sum((-factors[j][k] * carried[k] for k in range(j)), rows[j][j])))
        for i in range(j + 1, size):
            entry = sum((-factors[i][k] * carried[k] for k in range(j)), rows[i][j])
            factors[i][j] = named("l", entry / pivots[j])
    for i in range(size):
        ahead.append(named("y", sum((-factors[i][k] * ahead[k] for k in range(i)), right[i])))
    answers: list[tree.Node] = [tree.ZERO] * size
    for i in reversed(range(size)):
        others = (-factors[k][i] * answers[k] for k in range(i + 1, size))
        answers[i] = named("x", sum(others, ahead[i] / pivots[i]))
    return steps, answers
