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
from collections.abc import Mapping

from rigidcli.errors import ExpressionError
from rigidcli.language import tree
from rigidcli.language.functions import ALIASES, CONSTANTS, FUNCTIONS, QUOTIENTS
from rigidcli.language.tokens import Token, tokenize

_NONE: Mapping[str, tree.UnknownFunction] = {}
"""The functions of a text in which none can be declared."""

MAX_DEPTH = 100
"""How deep parentheses, calls, signs and powers may be nested, so that recursion never ends the program."""

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


class Reader:
    """A place in some tokens, with a method for each rule that documents and answers share."""

    empty = "the expression is empty"

    def __init__(self, tokens: list[Token]) -> None:
        self.tokens = tokens
        self.index = 0
        self.token = tokens[0]
        self.depth = 0

    def refused(
        self, message: str, column: int, hint: str | None = None, code: str = "parse_error"
    ) -> ExpressionError:
        """A problem with the text; its `code` is for answers."""
        return ExpressionError(message, column=column, hint=hint)

    def advance(self) -> None:
        """Pass a token."""
        self.index += 1
        self.token = self.tokens[self.index]

    def descend(self) -> None:
        """Pass a token that puts what follows one level deeper."""
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise self.refused(f"nested deeper than {MAX_DEPTH} levels", self.token.column, code="too_large")
        self.advance()

    def whole(self) -> tree.Node:
        """The tree of the text. Raises ExpressionError."""
        if self.token.kind == "end":
            raise self.refused(self.empty, 1)
        node = self.sum()
        if self.token.kind != "end":
            raise self.misplaced()
        return node

    def sum(self) -> tree.Node:
        """Terms with signs between them."""
        terms = [self.product()]
        while (sign := self.token.text) in ("+", "-"):
            self.advance()
            term = self.product()
            terms.append(term if sign == "+" else tree.Negative(term))
        return terms[0] if len(terms) == 1 else tree.Sum(tuple(terms))

    def product(self) -> tree.Node:
        """Factors, perhaps with signs between them."""
        factors = [self.factor()]
        while True:
            operator = self.token.text
            if operator in ("*", "/"):
                self.advance()
                factor = self.factor()
                factors.append(factor if operator == "*" else tree.Reciprocal(factor))
            elif self.begins_factor():
                if isinstance(factors[-1], tree.Reciprocal):
                    raise self.unclear_quotient(factors)
                factors += self.factors()
            else:
                return product_of(factors)

    def begins_factor(self) -> bool:
        """Whether a factor begins here that has no sign before it."""
        raise NotImplementedError

    def factors(self) -> list[tree.Node]:
        """One factor, or those that a word is made of."""
        return [self.factor()]

    def factor(self) -> tree.Node:
        """A power, perhaps with a sign of its own."""
        sign = self.token.text
        if sign not in ("-", "+"):
            return self.raised()
        operand = self.deeper()
        return operand if sign == "+" else tree.Negative(operand)

    def raised(self) -> tree.Node:
        """What has no sign, perhaps with an exponent."""
        raise NotImplementedError

    def deeper(self) -> tree.Node:
        """The factor behind a sign or `**`, one level deeper."""
        self.descend()
        operand = self.factor()
        self.depth -= 1
        return operand

    def arguments(self) -> tuple[tree.Node, ...]:
        """What stands in parentheses behind a function, between commas."""
        opening = self.token
        self.descend()
        found = list[tree.Node]()
        if self.token.text != ")":
            found.append(self.sum())
            while self.token.text == ",":
                self.advance()
                found.append(self.sum())
        self.close(opening)
        self.depth -= 1
        return tuple(found)

    def require_arity(self, name: str, arity: int, arguments: tuple[tree.Node, ...], column: int) -> None:
        """Raise ExpressionError where a function has another number of arguments."""
        if len(arguments) != arity:
            words = f"`{name}` takes {arity} argument{'s' if arity > 1 else ''}, not {len(arguments)}"
            raise self.refused(words, column)

    def close(self, opening: Token) -> None:
        """Pass the sign that ends what `opening` began."""
        if self.token.kind == "end":
            raise self.refused(f"`{opening.text}` is never closed", opening.column)
        if self.token.text != (")" if opening.text == "(" else opening.text):
            raise self.misplaced()
        self.advance()

    def unclear_quotient(self, factors: list[tree.Node]) -> ExpressionError:
        """What is wrong with these factors, of which the last is a divisor, before one without a sign."""
        # Only needed here: documents without mistakes are read sooner.
        from rigidcli.language.text import text

        column = self.token.column
        *above, divisor = factors
        assert isinstance(divisor, tree.Reciprocal)
        factor = self.factor()
        kept = above if above != [tree.Number("1", 1.0)] else []
        readings = [
            text(tree.Product((*above, tree.Reciprocal(tree.Product((divisor.operand, factor)))))),
            text(tree.Product((*kept, factor, divisor))),
        ]
        if max(map(len, readings)) > _SHOWN_READING:
            readings = ["a/(b*c)", "a*c/b"]
        return self.refused(
            "a product without a sign after `/` can be read in two ways",
            column,
            f"write `{readings[0]}` or `{readings[1]}`",
        )

    def misplaced(self, hint: str | None = None) -> ExpressionError:
        """What is wrong with the token that no rule of the grammar can use here."""
        raise NotImplementedError


def product_of(factors: list[tree.Node]) -> tree.Node:
    """The product of one factor or more."""
    return factors[0] if len(factors) == 1 else tree.Product(tuple(factors))


class _Reader(Reader):
    """The grammar of documents."""

    def __init__(self, source: str, functions: Mapping[str, tree.UnknownFunction]) -> None:
        super().__init__(tokenize(source))
        self.functions = functions
        self.names: set[str] = set()

    def begins_factor(self) -> bool:
        here = self.token
        if here.text.startswith("_") and here.touches:  # the digits of 1_000
            raise self.misplaced()
        return here.kind in ("name", "root") or here.text == "("

    def raised(self) -> tree.Node:
        base = self.atom()
        if self.token.kind == "superscript":
            digits = self.token.text.removeprefix("-")
            raised = tree.Number(digits, float(digits))
            base = tree.Power(base, raised if digits == self.token.text else tree.Negative(raised))
            self.advance()
            if self.token.text == "**" or self.token.kind == "superscript":
                raise self.misplaced("group powers of powers with parentheses")
        return tree.Power(base, self.deeper()) if self.token.text == "**" else base

    def atom(self) -> tree.Node:
        token = self.token
        if token.kind == "number":
            self.advance()
            return tree.Number(token.text, float(token.text))
        if token.kind == "name":
            self.advance()
            is_function = token.text in FUNCTIONS or token.text in ALIASES or token.text in QUOTIENTS
            return self.call(token) if is_function else self.named(token)
        if token.kind == "root":
            return self.root()
        if token.text != "(":
            raise self.misplaced()
        self.descend()
        node = self.sum()
        self.close(token)
        self.depth -= 1
        return node

    def named(self, token: Token) -> tree.Node:
        """A constant or a symbol, which has been passed already."""
        name = token.text
        if self.token.text == "(" and self.token.touches:
            if name in self.functions:
                return self.call(token)
            if self.tokens[self.index + 1].text == "t":
                hint = f"what depends on the time stands without it: write `{name[:_SHOWN]}`"
                raise ExpressionError(f"`{name[:_SHOWN]}` is not a function", column=token.column, hint=hint)
            raise _no_function(token, self.functions is not _NONE)
        if name in CONSTANTS:
            return tree.Constant(name)
        self.names.add(name)
        return tree.Name(name)

    def root(self) -> tree.Call:
        """The root of the number, name, function or parenthesis that follows its sign."""
        sign = self.token
        self.descend()
        operand = self.atom()
        self.depth -= 1
        before, here = self.tokens[self.index - 1], self.token
        runs_on = before.kind == "number" and here.touches and (here.kind == "name" or here.text == "(")
        if runs_on or here.text == "**" or here.kind == "superscript":
            raise ExpressionError(
                "it is not clear where the root ends", column=sign.column, hint="write `sqrt(...)`"
            )
        return tree.Call("sqrt", (operand,))

    def call(self, function: Token) -> tree.Node:
        """A function, whose name has been passed already, and its arguments."""
        name, opening = function.text, self.token
        if opening.text != "(":
            is_raised = opening.text == "**" or opening.kind == "superscript"
            raise ExpressionError(
                f"`{name}` is a function and needs its argument in parentheses",
                column=function.column,
                hint=f"write `{name}(...)`{', and a power of it behind that' if is_raised else ''}",
            )
        arguments = self.arguments()
        name = self.functions.get(name, ALIASES.get(name, name))
        arity = FUNCTIONS[name].arity if name in FUNCTIONS else 1
        if isinstance(name, tree.UnknownFunction):
            arity = len(name.parameters)
        self.require_arity(function.text, arity, arguments, function.column)
        if function.text in QUOTIENTS and name == function.text:
            above, below = QUOTIENTS[name]
            over = tree.Call(above, arguments) if above else tree.Number("1", 1.0)
            return tree.Product((over, tree.Reciprocal(tree.Call(below, arguments))))
        return tree.Call(name, arguments)

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
            hint = "a comma stands between arguments; the decimal sign is a point"
        elif before is not None and before.text == here.text == "/":
            hint = "division is one `/`"
        return ExpressionError(f"unexpected `{shown}`", column=here.column, hint=hint)


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
