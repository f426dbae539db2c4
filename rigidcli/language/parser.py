"""Tokens to tree: the grammar of the expression language.

    sum     = product (("+" | "-") product)*
    product = factor (["*" | "/"] factor)*
    factor  = ("-" | "+") factor | atom ["**" factor | superscript]
    atom    = number | name | function "(" sum ("," sum)* ")" | "(" sum ")" | root atom

Where neither `*` nor `/` stands between two factors, they are multiplied: `2 m g x`, `2(x + 1)`. The second
of them begins with a name, a parenthesis or a root, and the first is no divisor: `1/2 m` could be
read in two ways. A name that touches a parenthesis is a function: `f(x)` is no product, `x (a + b)` is one.
The text is read by these rules alone and is never given to anything that could run it.
"""

from __future__ import annotations

import difflib
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

from rigidcli.errors import ExpressionError
from rigidcli.language import tree
from rigidcli.language.functions import ALIASES, CALLED, CONSTANTS, FUNCTIONS, QUOTIENTS
from rigidcli.language.tokens import Token, tokenize

_NONE: Mapping[str, tree.UnknownFunction] = {}
"""The functions of a text in which none can be declared."""

MAX_DEPTH = 100
"""How deep parentheses, calls, signs and powers may be nested, so that recursion never ends the program."""

CLOSING = {"(": ")", "|": "|"}
"""The signs that close others."""

_OPERAND = ("number", "name", "root")
_SHOWN = 24
"""The most characters of a name that a message repeats."""

_SHOWN_READING = 60
"""The most characters of a reading of an unclear quotient that a message proposes."""


def read(
    source: str, functions: Mapping[str, tree.UnknownFunction] = _NONE
) -> tuple[tree.Node, frozenset[str]]:
    """The tree of a text, and the names in it; it may call `functions` without a formula, too.

    Raises:
        ExpressionError: the text is not in the language, with the column where it stops being so.
    """
    reader = _Reader(source, functions)
    return reader.whole(), frozenset(reader.names)


class Grammar(ABC):
    """A place in the tokens of one text, with a method for each rule of the grammar."""

    __slots__ = ("depth", "index", "token", "tokens")

    NO_COMMA = "a comma stands between arguments; the decimal sign is a point"
    """The hint where a comma has no meaning."""

    def __init__(self, tokens: list[Token]) -> None:
        self.tokens = tokens
        self.index = 0
        self.token = self.tokens[0]
        self.depth = 0

    def advance(self, count: int = 1) -> None:
        """Pass some tokens."""
        self.index += count
        self.token = self.tokens[self.index]

    def passed(self) -> Token:
        """Pass a token, and return it."""
        token = self.token
        self.advance()
        return token

    def descend(self) -> Token:
        """Pass a token that puts what follows one level deeper."""
        self.depth += 1
        if self.depth > MAX_DEPTH:
            message = f"nested deeper than {MAX_DEPTH} levels"
            raise ExpressionError(message, column=self.token.column, code="too_large")
        return self.passed()

    def close(self, opening: Token) -> None:
        """Pass the sign that closes what `opening` began."""
        if self.token.kind == "end":
            raise ExpressionError(f"`{opening.text}` is never closed", column=opening.column)
        if self.token.text != CLOSING[opening.text]:
            raise self.misplaced()
        self.depth -= 1
        self.advance()

    def whole(self) -> tree.Node:
        """The expression, which is all of the text."""
        if self.token.kind == "end":
            raise ExpressionError("the expression is empty", column=self.token.column and 1)
        node = self.sum()
        if self.token.kind != "end":
            raise self.misplaced()
        return node

    def sum(self) -> tree.Node:
        """A sum, or the one product that it is."""
        first = self.product()
        if self.token.text not in ("+", "-"):
            return first
        terms = [first]
        while (sign := self.token.text) in ("+", "-"):
            self.advance()
            term = self.product()
            terms.append(term if sign == "+" else tree.Negative(term))
        return tree.Sum(tuple(terms))

    def product(self) -> tree.Node:
        """A product, or the one factor that it is."""
        factors = [self.factor()]
        while True:
            operator = self.token.text
            if operator in ("*", "/"):
                self.advance()
                factor = self.factor()
                factors.append(factor if operator == "*" else tree.Reciprocal(factor))
            elif self.begins_factor():
                if operator.startswith("_") and self.token.touches:  # the digits of 1_000
                    raise self.misplaced()
                if isinstance(factors[-1], tree.Reciprocal):
                    raise self.unclear_quotient(factors)
                factors += self.further()
            else:
                return multiplied(factors)

    def begins_factor(self) -> bool:
        """Whether a factor without a sign begins here."""
        return self.token.kind in ("name", "root") or self.token.text == "("

    def further(self) -> Sequence[tree.Node]:
        """A factor without a sign, or the several that it is made of."""
        return [self.factor()]

    def factor(self) -> tree.Node:
        """A sign and its operand, or a power."""
        sign = self.token.text
        if sign in ("-", "+"):
            self.descend()
            operand = self.factor()
            self.depth -= 1
            return operand if sign == "+" else tree.Negative(operand)
        # A name is read here, and not there, as each level of calls takes one place less on the stack so.
        *before, base = self.named(self.passed()) if self.token.kind == "name" else self.atoms()
        if self.token.kind == "superscript":
            digits = self.token.text.removeprefix("-")
            raised = tree.Number(digits, float(digits))
            base = tree.Power(base, raised if digits == self.token.text else tree.Negative(raised))
            self.advance()
            if self.token.text == "**" or self.token.kind == "superscript":
                raise self.misplaced("group powers of powers with parentheses")
        if self.token.text == "**":
            base = self.power(base, self.exponent())
        return multiplied([*before, base])

    def exponent(self) -> tree.Node:
        """What stands behind the sign of a power."""
        self.descend()
        exponent = self.factor()
        self.depth -= 1
        return exponent

    def power(self, base: tree.Node, exponent: tree.Node) -> tree.Node:
        """A base with its exponent."""
        return tree.Power(base, exponent)

    def atoms(self) -> Sequence[tree.Node]:
        """The factor before a power; or several, such as names run together, of which the last is raised."""
        kind = self.token.kind
        if kind == "number":
            digits = self.passed().text
            return [tree.Number(digits, float(digits))]
        if kind == "name":
            return self.named(self.passed())
        if kind == "root":
            return [self.root()]
        if self.token.text != "(":
            raise self.misplaced()
        opening = self.descend()
        inner = self.sum()
        self.close(opening)
        return [inner]

    @abstractmethod
    def named(self, token: Token) -> Sequence[tree.Node]:
        """What a name means, which has been passed already."""

    def root(self) -> tree.Call:
        """The root of the number, name, function or parenthesis that follows its sign."""
        sign = self.descend()
        operand = multiplied(self.atoms())
        self.depth -= 1
        before, here = self.tokens[self.index - 1], self.token
        runs_on = before.kind == "number" and here.touches and (here.kind == "name" or here.text == "(")
        if runs_on or here.text == "**" or here.kind == "superscript":
            raise ExpressionError(
                "it is not clear where the root ends", column=sign.column, hint="write `sqrt(...)`"
            )
        return tree.Call("sqrt", (operand,))

    def arguments(self) -> tuple[tree.Node, ...]:
        """The arguments of a function, with its parentheses."""
        opening = self.descend()
        arguments = [] if self.token.text == ")" else [self.sum()]
        while arguments and self.token.text == ",":
            self.advance()
            arguments.append(self.sum())
        self.close(opening)
        return tuple(arguments)

    def unclear_quotient(self, factors: list[tree.Node]) -> ExpressionError:
        """What is wrong with these factors, of which the last is a divisor, before one without a sign."""
        # Only needed here: documents without mistakes are read sooner.
        from rigidcli.language.text import reading

        column = self.token.column
        *above, divisor = factors
        assert isinstance(divisor, tree.Reciprocal)
        factor = self.factor()
        kept = above if above != [tree.Number("1", 1.0)] else []
        readings = [
            reading(tree.Product((*above, tree.Reciprocal(tree.Product((divisor.operand, factor)))))),
            reading(tree.Product((*kept, factor, divisor))),
        ]
        if max(map(len, readings)) > _SHOWN_READING:
            readings = ["a/(b*c)", "a*c/b"]
        return ExpressionError(
            "a product without a sign after `/` can be read in two ways",
            column=column,
            hint=f"write `{readings[0]}` or `{readings[1]}`",
        )

    def misplaced(self, hint: str | None = None) -> ExpressionError:
        """What is wrong with the token that no rule of the grammar can use here."""
        here = self.token
        before = self.tokens[self.index - 1] if self.index else None
        shown = here.text if len(here.text) <= _SHOWN else f"{here.text[:_SHOWN]}..."
        if here.kind == "end":
            return ExpressionError("the expression ends too early", column=here.column)
        if before is not None and (before.kind in (*_OPERAND, "superscript") or before.text == ")"):
            if here.kind in ("number", "name"):
                left = "(...)" if before.text == ")" else before.text[-_SHOWN:]
                hint = f"write `{left}*{shown}`" if before.kind == "name" or before.text == ")" else None
                if before.kind == here.kind == "number":
                    hint = f"commas separate the entries of a list: `{left}, {shown}`"
                hint = "digits stand without `_`" if here.text[0] == "_" else hint
                return ExpressionError(f"no operator before `{shown}`", column=here.column, hint=hint)
            if here.text == ")":
                return ExpressionError("`)` closes nothing", column=here.column)
        if here.text == ",":
            hint = self.NO_COMMA
        elif before is not None and before.text == here.text == "/":
            hint = "division is one `/`"
        return ExpressionError(f"unexpected `{shown}`", column=here.column, hint=hint)


def multiplied(factors: Sequence[tree.Node]) -> tree.Node:
    """The product of some factors, or the one that there is."""
    return factors[0] if len(factors) == 1 else tree.Product(tuple(factors))


class _Reader(Grammar):
    """The grammar of documents, in which names are taken whole, and `functions` may have no formula."""

    __slots__ = ("functions", "names")

    def __init__(self, source: str, functions: Mapping[str, tree.UnknownFunction]) -> None:
        super().__init__(tokenize(source))
        self.functions = functions
        self.names: set[str] = set()

    def named(self, token: Token) -> Sequence[tree.Node]:
        """A function with its arguments, a constant or a symbol."""
        name, is_followed = token.text, self.token.text == "("
        if name in CALLED or (is_followed and self.token.touches and name in self.functions):
            if not is_followed:
                is_raised = self.token.text == "**" or self.token.kind == "superscript"
                raise ExpressionError(
                    f"`{name}` is a function and needs its argument in parentheses",
                    column=token.column,
                    hint=f"write `{name}(...)`{', and a power of it behind that' if is_raised else ''}",
                )
            meant = self.functions.get(name, ALIASES.get(name, name))
            return [applied(token, meant, self.arguments())]
        if is_followed and self.token.touches:
            if self.tokens[self.index + 1].text == "t":
                hint = f"what depends on the time stands without it: write `{name[:_SHOWN]}`"
                raise ExpressionError(f"`{name[:_SHOWN]}` is not a function", column=token.column, hint=hint)
            raise _no_function(token, self.functions is not _NONE)
        if name in CONSTANTS:
            return [tree.Constant(name)]
        self.names.add(name)
        return [tree.Name(name)]


def applied(typed: Token, name: str, arguments: tuple[tree.Node, ...]) -> tree.Node:
    """A function of some arguments, or the quotient that it is.

    Raises ExpressionError for too many or too few.
    """
    arity = FUNCTIONS[name].arity if name in FUNCTIONS else 1
    if isinstance(name, tree.UnknownFunction):
        arity = len(name.parameters)
    if len(arguments) != arity:
        message = f"`{typed.text}` takes {arity} argument{'s' if arity > 1 else ''}, not {len(arguments)}"
        raise ExpressionError(message, column=typed.column)
    if name not in QUOTIENTS or isinstance(name, tree.UnknownFunction):
        return tree.Call(name, arguments)
    above, below = QUOTIENTS[name]
    over = tree.Call(above, arguments) if above else tree.Number("1", 1.0)
    return tree.Product((over, tree.Reciprocal(tree.Call(below, arguments))))


def _no_function(token: Token, may_be_declared: bool) -> ExpressionError:
    name = token.text[:_SHOWN]
    near = difflib.get_close_matches(name.lower(), FUNCTIONS, n=1)
    if near:
        hint = f"did you mean `{near[0]}`? A product is written `{name}*(...)`"
    else:
        hint = f"a product is written `{name}*(...)`; the functions are {' '.join(FUNCTIONS)}"
    if may_be_declared and not near:
        slope = re.fullmatch(r"d(\w+?)(_d\w+)+", name)
        declared = f"`functions: {{{slope[1] if slope else name}: [x]}}`"
        hint = f"a function of x without a formula is declared in the system by {declared}; {hint}"
    return ExpressionError(f"`{name}` is not a function", column=token.column, hint=hint)
