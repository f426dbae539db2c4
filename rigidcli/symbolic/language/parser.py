"""Tokens to tree: the grammar of the expression language.

    sum     = product (("+" | "-") product)*
    product = factor (("*" | "/") factor)*
    factor  = ("-" | "+") factor | atom ["**" factor]
    atom    = number | name | function "(" sum ("," sum)* ")" | "(" sum ")"

The text is read by these rules alone and is never given to anything that could run it.
"""

from __future__ import annotations

import difflib

from rigidcli.errors import ExpressionError
from rigidcli.symbolic.language.tokens import Token, tokenize
from rigidcli.symbolic.language.tree import (
    CONSTANTS,
    FUNCTIONS,
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
)

MAX_DEPTH = 100
"""How deep parentheses, calls, signs and powers may be nested, so that recursion never ends the program."""

_OPERAND = ("number", "name")
_SHOWN = 24
"""The most characters of a name that a message repeats."""


def read(text: str) -> tuple[Node, frozenset[str]]:
    """The tree of a text, and the names in it.

    Raises:
        ExpressionError: the text is not in the language, with the column where it stops being so.
    """
    reader = _Reader(text)
    return reader.whole(), frozenset(reader.names)


class _Reader:
    """A place in the tokens of one text, with a method for each rule of the grammar."""

    __slots__ = ("depth", "index", "names", "token", "tokens")

    def __init__(self, text: str) -> None:
        self.tokens = tokenize(text)
        self.index = 0
        self.token = self.tokens[0]
        self.depth = 0
        self.names: set[str] = set()

    def advance(self) -> None:
        self.index += 1
        self.token = self.tokens[self.index]

    def descend(self) -> None:
        """Pass a token that puts what follows one level deeper."""
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise ExpressionError(f"nested deeper than {MAX_DEPTH} levels", column=self.token.column)
        self.advance()

    def whole(self) -> Node:
        if self.token.kind == "end":
            raise ExpressionError("the expression is empty", column=1)
        node = self.sum()
        if self.token.kind != "end":
            raise self.misplaced()
        return node

    def sum(self) -> Node:
        first = self.product()
        if self.token.text not in ("+", "-"):
            return first
        terms = [first]
        while (sign := self.token.text) in ("+", "-"):
            self.advance()
            term = self.product()
            terms.append(term if sign == "+" else Negative(term))
        return Sum(tuple(terms))

    def product(self) -> Node:
        first = self.factor()
        if self.token.text not in ("*", "/"):
            return first
        factors = [first]
        while (operator := self.token.text) in ("*", "/"):
            self.advance()
            factor = self.factor()
            factors.append(factor if operator == "*" else Reciprocal(factor))
        return Product(tuple(factors))

    def factor(self) -> Node:
        sign = self.token.text
        if sign in ("-", "+"):
            self.descend()
            operand = self.factor()
            self.depth -= 1
            return operand if sign == "+" else Negative(operand)
        base = self.atom()
        if self.token.text != "**":
            return base
        self.descend()
        exponent = self.factor()
        self.depth -= 1
        return Power(base, exponent)

    def atom(self) -> Node:
        token = self.token
        if token.kind == "number":
            self.advance()
            return Number(token.text, float(token.text))
        if token.kind == "name":
            self.advance()
            return self.call(token) if token.text in FUNCTIONS else self.named(token)
        if token.text != "(":
            raise self.misplaced()
        self.descend()
        node = self.sum()
        self.close(token)
        self.depth -= 1
        return node

    def named(self, token: Token) -> Node:
        """A constant or a symbol, which has been passed already."""
        name = token.text
        if self.token.text == "(":
            raise _no_function(token)
        if name in CONSTANTS:
            return Constant(name)
        self.names.add(name)
        return Name(name)

    def call(self, function: Token) -> Call:
        """A function, whose name has been passed already, and its arguments."""
        name, opening = function.text, self.token
        if opening.text != "(":
            raise ExpressionError(
                f"`{name}` is a function and needs its argument in parentheses",
                column=function.column,
                hint=f"write `{name}(...)`",
            )
        self.descend()
        arguments: list[Node] = []
        if self.token.text != ")":
            arguments.append(self.sum())
            while self.token.text == ",":
                self.advance()
                arguments.append(self.sum())
        self.close(opening)
        self.depth -= 1
        arity = FUNCTIONS[name].arity
        if len(arguments) != arity:
            raise ExpressionError(
                f"`{name}` takes {arity} argument{'s' if arity > 1 else ''}, not {len(arguments)}",
                column=function.column,
            )
        return Call(name, tuple(arguments))

    def close(self, opening: Token) -> None:
        """Pass the parenthesis that ends what `opening` began."""
        if self.token.kind == "end":
            raise ExpressionError("`(` is never closed", column=opening.column)
        if self.token.text != ")":
            raise self.misplaced()
        self.advance()

    def misplaced(self) -> ExpressionError:
        """What is wrong with the token that no rule of the grammar can use here."""
        here = self.token
        before = self.tokens[self.index - 1] if self.index else None
        text = here.text if len(here.text) <= _SHOWN else f"{here.text[:_SHOWN]}..."
        if here.kind == "end":
            return ExpressionError("the expression ends too early", column=here.column)
        if before is not None and (before.kind in _OPERAND or before.text == ")"):
            if here.kind in _OPERAND or here.text == "(":
                return _no_operator(before, here, text)
            if here.text == ")":
                return ExpressionError("`)` closes nothing", column=here.column)
        hint = None
        if here.text == ",":
            hint = "a comma stands between arguments; the decimal sign is a point"
        elif before is not None and before.text == here.text == "/":
            hint = "division is one `/`"
        return ExpressionError(f"unexpected `{text}`", column=here.column, hint=hint)


def _no_operator(before: Token, here: Token, shown: str) -> ExpressionError:
    hint = None
    if not before.kind == here.kind == "number":
        left = "(...)" if before.text == ")" else before.text[-_SHOWN:]
        hint = f"write `{left}*{'(...)' if here.text == '(' else shown}`"
        if before.kind == "number" and here.kind == "name":
            hint += f"; if `{shown}` is a unit, give the quantity as a parameter"
    return ExpressionError(f"no operator before `{shown}`", column=here.column, hint=hint)


def _no_function(token: Token) -> ExpressionError:
    name = token.text[:_SHOWN]
    near = difflib.get_close_matches(name.lower(), FUNCTIONS, n=1)
    if near:
        hint = f"did you mean `{near[0]}`? A product is written `{name}*(...)`"
    else:
        hint = f"a product is written `{name}*(...)`; the functions are {' '.join(FUNCTIONS)}"
    return ExpressionError(f"`{name}` is not a function", column=token.column, hint=hint)
