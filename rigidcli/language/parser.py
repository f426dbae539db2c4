"""Tokens to trees: the grammar of what people type, in documents and in answers.

    sum      = product (("+" | "-") product)*
    product  = factor (["*" | "/"] factor)*
    factor   = ("-" | "+") factor | atom ["**" exponent | superscript]
    atom     = number ["deg"] | word | function argument | "(" sum ")" | "|" sum "|" | root operand
    argument = "(" sum ("," sum)* ")" | operand

Where neither `*` nor `/` stands between two factors, they are multiplied: `2 m g x`, `2(x + 1)`. A word is a
name, or the product of known names that it spells. Where there are no brackets, people differ in how far a
divisor, an exponent, a root and the argument of a function reach; each such place has some usual readings,
the most usual first, and a `way` says which of them is taken in each kind of place (see `of_tokens`).
The text is read by these rules alone and is never given to anything that could run it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from enum import Enum
from functools import cache
from itertools import product

from rigidcli.errors import ExpressionError, nearest
from rigidcli.language import tree
from rigidcli.language.tokens import Token, tokenize
from rigidcli.language.words import (
    ALIASES,
    CALLED,
    CONSTANTS,
    DEFINED,
    FUNCTIONS,
    PROGRAMS,
    SHORT,
    Words,
    unknown,
)

NO_FUNCTIONS: Mapping[str, tree.UnknownFunction] = {}
"""The functions of a text in which none can be declared."""

MAX_DEPTH = 100
"""How deep parentheses, calls, signs and powers may be nested, so that recursion never ends the program."""

MOST_READINGS, MOST_WAYS = 8, 32
"""The most readings of one text, and the most ways in which it is read to find them."""

RATE = "Ddt"
"""The name of d/dt before a bracket, whose derivative by the time is for others to work out."""

_CLOSING = {"(": ")", "|": "|"}
_SHOWN = 24
"""The most characters of a name that a message repeats."""

_DEGREES = frozenset(["deg", "degree", "degrees", "Grad"])
_E = tree.Name("e")
_ONE = tree.Number("1", 1.0)
_DEGREE = (tree.Constant("pi"), tree.Reciprocal(tree.Number("180", 180.0)))

_ANGLE = re.compile(r"(theta|phi|psi|alpha|beta|gamma|chi|vartheta)[_0-9]*")
"""Names that are usually the whole argument of a function: `sin theta x`."""

_LONG = sorted(CALLED - {"atan2", *SHORT}, key=len, reverse=True)
_HEAD = re.compile(rf"({'|'.join(_LONG)})(\d+)(\w*)")
"""A function with its argument behind it in one word: `sin2theta`."""


class Reach(Enum):
    """Where an operand without brackets ends: in `sin 2 x + 1`, behind x or behind 2."""

    ALL = "up to the next sum or function"
    RUN = "as far as no blank stands between"
    FIRST = "its first factor"


ALL, RUN, FIRST = Reach
OTHER_WAYS = (None, FIRST, RUN, ALL)
"""How far operands reach in the readings of a text: as is usual in each place, or alike in all."""


def read(
    source: str, functions: Mapping[str, tree.UnknownFunction] = NO_FUNCTIONS
) -> tuple[tree.Node, frozenset[str]]:
    """The most usual tree of a text, and the names in it; it may call `functions` without a formula, too.

    Raises ExpressionError: the text is not in the language, with the column where it stops being so.
    """
    root = of_tokens(tokenize(source), functions, None)[0]
    return root, frozenset(tree.names_in(root))


def of_tokens(
    tokens: Sequence[Token], functions: Mapping[str, tree.UnknownFunction], words: Words | None
) -> list[tree.Node]:
    """The usual readings of a text that differ, the most usual first; without `words` a word is one name.

    Raises ExpressionError where the text can be read in no way.
    """
    failure: ExpressionError | None = None
    usual = _Grammar(tokens, functions, words, {})
    found: dict[tree.Node, None] = {}
    try:
        node = usual.whole()
        if not usual.places:  # what is hashed goes deeper into the stack
            return [node]
        found[node] = None
    except ExpressionError as error:
        failure = error
    ways = product(*(range(count) for count in usual.places.values()))
    rarer = sorted(ways, key=lambda way: (sum(1 for place in way if place), sum(way)))[1:MOST_WAYS]
    for way in rarer:
        with suppress(ExpressionError):
            grammar = _Grammar(tokens, functions, words, dict(zip(usual.places, way, strict=True)))
            found.setdefault(grammar.whole())
    if failure is not None and not found:
        raise failure
    return list(found)[:MOST_READINGS]


class _Grammar:
    """A place in the tokens of one text, with a method for each rule of the grammar.

    `places` counts the readings of each kind of place that was met, of which the `way` says which one is
    taken: without a word of it the first. `barred` says of the brackets that are open whether they are bars:
    a bar then closes, and else it opens.
    """

    def __init__(
        self,
        tokens: Sequence[Token],
        functions: Mapping[str, tree.UnknownFunction],
        words: Words | None,
        way: Mapping[str, int],
    ) -> None:
        self.tokens = list(tokens)
        self.index = 0
        self.token = self.tokens[0]
        self.depth = 0
        self.functions = functions
        self.words = words
        self.way = way
        self.places: dict[str, int] = {}
        self.barred = [False]
        self.is_open = words is None or words.is_open

    def advance(self, count: int = 1) -> None:
        self.index += count
        self.token = self.tokens[self.index]

    def passed(self) -> Token:
        token = self.token
        self.advance()
        return token

    def deeper(self) -> None:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            message = f"nested deeper than {MAX_DEPTH} levels"
            raise ExpressionError(message, column=self.token.column, code="too_large")

    def descend(self) -> Token:
        """Pass an opening bracket, a sign or a root: what follows is nested one level deeper."""
        self.deeper()
        opening = self.passed()
        if opening.text in _CLOSING:
            self.barred.append(opening.text == "|")
        return opening

    def close(self, opening: Token) -> None:
        if self.token.kind == "end":
            raise ExpressionError(f"`{opening.text}` is never closed", column=opening.column)
        if self.token.text != _CLOSING[opening.text]:
            raise self.misplaced()
        self.depth -= 1
        self.barred.pop()
        self.advance()

    def meets(self, place: str, count: int) -> int:
        """Note that a kind of place has `count` readings; return the one that this way takes."""
        if count > 1:
            self.places[place] = max(count, self.places.get(place, 1))
        return min(self.way.get(place, 0), count - 1)

    def reach(self, place: str, orders: Sequence[Reach]) -> Reach:
        """How far an operand reaches in this way; `orders` are the usual reaches, the most usual first."""
        reach = OTHER_WAYS[self.way.get(place, 0)]
        return reach if reach is not None and reach in orders else orders[0]

    def whole(self) -> tree.Node:
        if self.token.kind == "end":
            raise ExpressionError("the expression is empty", column=self.token.column and 1)
        node = self.sum()
        if self.token.kind != "end":
            raise self.misplaced()
        return node

    def sum(self) -> tree.Node:
        first = self.product()
        if self.token.text not in ("+", "-"):
            return first
        terms = [first]
        while (sign := self.token.text) in ("+", "-"):
            self.advance()
            term = self.product()
            terms.append(term if sign == "+" else tree.Negative(term))
        return tree.Sum(tuple(terms))

    def product(self, reach: Reach | None = None) -> tree.Node:
        """Factors side by side; those of an operand without brackets end where its `reach` does."""
        factors = self.factor()
        while self.goes_on(reach):
            operator = self.token.text
            if operator in ("*", "/"):
                self.advance()
            elif operator.startswith("_") and self.token.touches:  # the digits of 1_000
                raise self.misplaced()
            factors += self.divisor(factors[-1], reach) if operator == "/" else self.factor()
        return multiplied(factors)

    def divisor(self, above: tree.Node, reach: Reach | None) -> list[tree.Node]:
        """The factors behind `/`: the first ones are below the bar, in `a/b c` either b or b c."""
        is_fraction = isinstance(above, tree.Number) and self.token.kind == "number"
        is_group = self.token.text == "("
        below = self.factor()
        is_complete = is_group or (is_fraction and not self.token.touches)
        run = len(below)
        while not is_complete and self.begins_factor() and self.goes_on(reach):
            touches = self.token.touches
            further = self.factor()
            if touches and run == len(below):
                run += len(further)
            below = below + further
        ends = [len(below)] if is_complete else list(dict.fromkeys([run, 1, len(below)]))
        end = ends[self.meets("number" if is_fraction else "divisor", len(ends))]
        return [tree.Reciprocal(multiplied(below[:end])), *below[end:]]

    def begins_factor(self) -> bool:
        here = self.token
        opens = here.text == "(" or (here.text == "|" and not self.barred[-1])
        return here.kind in ("name", "root") or opens or self.is_fraction()

    def ahead(self, count: int) -> list[Token]:
        """The next tokens, the last of them again and again behind the end."""
        several = self.tokens[self.index : self.index + count]
        return several + [self.tokens[-1]] * (count - len(several))

    def is_fraction(self) -> bool:
        """Whether a fraction of two numbers follows behind a blank, as in `M R^2 2/5`."""
        first, bar, below = self.ahead(3)
        if first.kind != "number" or first.touches or self.is_open:
            return False
        before, last = self.tokens[self.index - 2], self.tokens[self.index - 1]
        return below.kind == "number" and bar.text == "/" and (last.kind != "number" or before.text == "**")

    def goes_on(self, reach: Reach | None) -> bool:
        """Whether the next token continues a product, or an operand of this `reach`."""
        here = self.token
        is_operator = here.text in ("*", "/")
        if reach is None or not (is_operator or self.begins_factor()):
            return is_operator or self.begins_factor()
        following = self.tokens[self.index + is_operator]
        if self.is_function(following) or (following.text == "(" and not (is_operator or here.touches)):
            return False
        is_run = here.touches and (not is_operator or (following.touches and here.text == "/"))
        return reach is ALL or (reach is RUN and is_run)

    def is_function(self, token: Token) -> bool:
        """Whether a word begins with the name of a function."""
        word = token.text
        if token.kind != "name" or (self.words is not None and self.words.meaning(word)):
            return token.kind == "root"
        if word in SHORT:
            return False
        return word in CALLED or any(
            word.startswith(name) for name in ("sin", "cos", "tan", "exp", "ln", "log")
        )

    def factor(self) -> list[tree.Node]:
        """A signed operand or a power; a word such as `mgz` gives several factors."""
        sign = self.token.text
        if sign in ("-", "+"):
            self.descend()
            operand = self.factor()
            self.depth -= 1
            return operand if sign == "+" else [tree.Negative(multiplied(operand))]
        # A name is read here, and not there, as each level of calls takes one place less on the stack so.
        *before, base = self.named(self.passed()) if self.token.kind == "name" else self.atoms()
        if self.token.kind == "superscript":
            base = self.power(base, self.superscript())
            if self.token.text == "**" or self.token.kind == "superscript":
                raise self.misplaced("group powers of powers with parentheses")
        if self.token.text == "**":
            base = self.power(base, self.exponent(base))
        return [*before, base]

    def superscript(self) -> tree.Node:
        raised = self.passed().text
        digits = raised.removeprefix("-")
        number = tree.Number(digits, float(digits))
        return number if digits == raised else tree.Negative(number)

    def is_euler(self, base: tree.Node) -> bool:
        """Whether a base is the number e, which is no letter of the question."""
        return base == _E and not self.is_open and self.words is not None and self.words.meaning("e") is None

    def power(self, base: tree.Node, exponent: tree.Node) -> tree.Node:
        """A base with its exponent; e is the number where it is no letter of the question."""
        return tree.Call("exp", (exponent,)) if self.is_euler(base) else tree.Power(base, exponent)

    def exponent(self, base: tree.Node | None) -> tree.Node:
        """What stands behind the sign of a power; in documents `**` has the order of all programs."""
        is_group = self.tokens[self.index - 1].text == ")"
        if self.descend().kind == "stars" and self.is_open:
            exponent = multiplied(self.factor())
            self.depth -= 1
            return exponent
        first, second, third = self.ahead(4)[self.token.text in ("-", "+") :][:3]
        orders: tuple[Reach, ...] = (FIRST,)
        if base is not None and self.is_euler(base):
            orders = (ALL, RUN, FIRST)
        elif isinstance(base, tree.Number) and first.kind == "name":
            # With a sign behind it, 2^n/x has the order of all programs in a document.
            orders = (FIRST,) if self.is_open and second.text in ("*", "/") else (RUN, FIRST)
        if len(orders) == 1 and first.kind == third.kind == "number" and second.text == "/":
            exponent = self.fraction(first.text, third.text, is_group)
        elif len(orders) == 1 or first.text == "(":
            exponent = multiplied(self.factor())
        else:
            start = self.index
            exponent = self.product(self.reach("exponent", orders))
            if self.index > start + 1 or self.token.text == "/" or self.begins_factor():
                self.meets("exponent", len(OTHER_WAYS))
        self.depth -= 1
        return exponent

    def fraction(self, above: str, below: str, is_group: bool) -> tree.Node:
        """The exponent `1/2`, or the number before its `/`: x^2/2 is half a square, x^1/2 is a root.

        In answers `(a + b)^3/2` may be a power of 3/2, too; a document has the order of all programs.
        """
        ways = [False]
        if above == "1" and float(below):
            ways = [True, False]
        elif not self.is_open and (is_group or below == "2") and float(below) and float(above) % float(below):
            ways = [False, True]
        exponent = multiplied(self.factor())
        if ways[self.meets("fraction", len(ways))]:
            self.advance()
            exponent = tree.Product((exponent, tree.Reciprocal(multiplied(self.atoms()))))
        return exponent

    def atoms(self) -> list[tree.Node]:
        """What a power may follow: a number, a name, a bracket; of `mgz^2` three factors, the last raised."""
        kind = self.token.kind
        if kind == "number":
            digits = self.passed().text
            number = tree.Number(digits, float(digits))
            is_angle = self.token.kind == "name" and self.token.text in _DEGREES
            if is_angle and not (self.words is not None and self.words.meaning(self.token.text)):
                self.advance()
                return [tree.Product((number, *_DEGREE))]
            return [number]
        if kind == "root":
            sign = self.descend()
            operand = self.operand("sqrt", sign)
            self.depth -= 1
            return [tree.Call("sqrt", (operand,))]
        if self.token.text not in _CLOSING:
            raise self.misplaced()
        opening = self.descend()
        inner = self.sum()
        self.close(opening)
        return [tree.Call("abs", (inner,)) if opening.text == "|" else inner]

    def named(self, token: Token) -> list[tree.Node]:
        """The factors that a word stands for; its token has been passed."""
        name, words = token.text, self.words
        calls = self.token.text == "(" and self.token.touches
        meant = words.meaning(name) if words else None
        if meant is not None and not (calls and name in self.functions):
            return self.symbol(meant, token)
        if calls and (called := self.before_bracket(token)):
            return [called]
        if name in CALLED and (name not in SHORT or self.is_called(name)):
            is_amplitude = name[0] == "a" and name[1:] in CALLED and not self.is_open
            if is_amplitude and words and words.meaning("a") and self.meets("inverse", 2) == 0:
                return self.again(token, "a", name[1:])
            if calls and not self.is_half():  # here, and not below, for one place less on the stack
                return [applied(token, ALIASES.get(name, name), self.arguments())]
            return [self.call(token)]
        if name in CONSTANTS:
            if calls and words is not None and words.is_open:
                raise self.no_function(token)
            return [tree.Constant(name)]
        if words is not None and (head := _HEAD.fullmatch(name)):
            return self.again(token, *filter(None, head.groups()))
        is_power = self.token.text == "**"
        if name == "E" and is_power and self.is_euler(_E):  # as Mathematica writes it
            return [_E]
        if words is None or (name == _E.name and is_power):
            return self.symbol(name, token)
        before = name[:-1]
        is_euler = name[-1] == _E.name and is_power and self.is_euler(_E)
        if is_euler and (words.meaning(before) or words.products(before)):
            return self.again(token, before, _E.name)
        ways = words.products(name, self.token.kind in ("name", "number") or self.token.text == "(")
        if not ways and words.is_open:
            return self.symbol(name, token)
        if not ways:
            raise unknown(name, words)
        parts = ways[self.meets("spelling", len(ways))]
        if parts[0] in CALLED:
            self.put(token, *parts)
            return [self.call(self.passed())]
        if not CALLED.isdisjoint(parts):
            return self.again(token, *parts)
        if self.is_of_time(parts[-1]):
            self.advance(3)
        return [tree.Constant(p) if p in CONSTANTS and words.meaning(p) != p else tree.Name(p) for p in parts]

    def before_bracket(self, token: Token) -> tree.Node | None:
        """What a word means before a bracket alone: d/dt, `dot(x)`, a declared function, `pow`."""
        name = token.text
        if name == RATE and self.words is not None and self.words.moving:
            return tree.Call(RATE, self.arguments())
        if name in ("dot", "ddot") and self.tokens[self.index + 2].text == ")":
            of = self.tokens[self.index + 1].text
            self.advance(3)
            return tree.Name(f"{of}{name}")
        function = self.functions.get(name) or PROGRAMS.get(name)
        return applied(token, function, self.arguments()) if function else None

    def again(self, token: Token, *parts: str) -> list[tree.Node]:
        """The factors that the parts of a word stand for, which has just been passed."""
        self.put(token, *parts)
        return self.named(self.passed())

    def is_called(self, name: str) -> bool:
        """Whether a short name of a function, which may also be letters, stands before an argument."""
        opens = self.token.text == "(" and self.token.touches
        if self.words is None or self.words.is_open:
            return opens
        if not (opens or self.token.kind in ("name", "number")):
            return False
        return not self.words.products(name) or self.meets("alias", 2) == 0

    def put(self, token: Token, *parts: str) -> None:
        """Replace the word just passed by its parts; the first of them is the next token."""
        pieces = [
            Token("number" if part[0].isdigit() else "name", part, token.column, token.touches or place > 0)
            for place, part in enumerate(parts)
        ]
        self.tokens[self.index : self.index] = pieces
        self.token = self.tokens[self.index]

    def symbol(self, name: str, token: Token) -> list[tree.Node]:
        """A name, perhaps with `(t)` behind it."""
        if self.is_of_time(name):
            self.advance(3)
        elif self.is_open and self.token.text == "(" and self.token.touches and self.words is not None:
            if self.tokens[self.index + 1].text == "t":
                hint = f"what depends on the time stands without it: write `{name[:_SHOWN]}`"
                raise ExpressionError(f"`{name[:_SHOWN]}` is not a function", column=token.column, hint=hint)
            raise self.no_function(token)
        return [tree.Name(name)]

    def is_of_time(self, name: str) -> bool:
        """Whether `(t)` follows a name that depends on the time."""
        following = [token.text for token in self.ahead(3)]
        touches = self.token.touches or name.endswith("dot")
        is_moving = self.words is None or name in self.words.moving
        return following == ["(", "t", ")"] and touches and is_moving

    def call(self, token: Token) -> tree.Node:
        """A function call, perhaps with a power before its argument; its name has been passed."""
        power: tree.Node | None = None
        if self.token.kind == "superscript":
            power = self.superscript()
        elif self.token.text == "**":
            power = self.exponent(None)
        function = ALIASES.get(token.text, token.text)
        if power == tree.Negative(_ONE):
            if f"a{function}" not in FUNCTIONS:
                message = f"the inverse of `{function}` is not clear"
                raise ExpressionError(message, hint=f"write `1/{function}(...)`", column=token.column)
            function, power = f"a{function}", None
        if self.token.text == "(" and not self.is_half():
            arguments = self.arguments()
        else:
            self.deeper()
            argument = self.operand(function, token)
            self.depth -= 1
            arguments = (argument,)
            if power is None and isinstance(argument, tree.Power) and self.meets("raised", 2):
                arguments, power = (argument.base,), argument.exponent
        node = applied(token, function, arguments)
        return node if power is None else tree.Power(node, power)

    def is_half(self) -> bool:
        """Whether the next tokens are `(1/2)theta`, as `½θ` is written after its signs were replaced."""
        _, above, bar, below, end, behind = self.ahead(6)
        is_fraction = above.kind == below.kind == "number" and bar.text == "/" and end.text == ")"
        return is_fraction and behind.kind == "name" and behind.touches

    def operand(self, function: str, token: Token) -> tree.Node:
        """The argument of a function, or of a root, that stands without brackets: `sin 2 x`."""
        here, following = self.ahead(2)
        is_root = function == "sqrt"
        place = "root" if is_root else "argument"
        begins = here.kind == "number" or self.begins_factor()
        if not begins and token.kind == "root":
            raise self.misplaced()
        if not (begins or (here.text == "-" and not is_root and self.words is not None)):
            raise ExpressionError(
                f"`{token.text}` is a function and needs its argument in parentheses",
                column=token.column,
                hint=f"write `{token.text}(...)`",
            )
        if here.text == "(" and is_root:
            return multiplied(self.atoms())
        is_next = following.kind == "name" or following.text == "("
        orders: tuple[Reach, ...] = (ALL, FIRST) if here.kind == "number" else (ALL, RUN, FIRST)
        if is_root:
            is_alone = here.kind == "number" and not (is_next and following.touches)
            orders = (FIRST, ALL) if is_alone else (RUN, FIRST, ALL)
            orders = orders[: -1 if self.is_open else None]
        elif here.kind == "name" and _ANGLE.fullmatch(here.text) and following.kind == "name":
            orders = (FIRST, ALL) if following.text != "t" else orders
        start, reach = self.index, self.reach(place, orders)
        if reach is not FIRST:
            operand = self.product(reach)
        else:
            factors = list(self.factor())
            if not is_root and here.kind == "number" and self.token.kind == "name":
                factors += [] if self.is_function(self.token) else self.factor()
            if not is_root and self.token.text == "t" and factors[-1] != tree.Name("t"):
                factors += self.factor()
            operand = multiplied(factors)
        is_divided = self.token.text == "/" and is_root and orders[0] is RUN
        if self.index > start + 1 or self.begins_factor() or is_divided:
            self.meets(place, len(OTHER_WAYS) if len(orders) > 1 else 1)
        return operand

    def arguments(self) -> tuple[tree.Node, ...]:
        opening = self.descend()
        arguments = [] if self.token.text == ")" else [self.sum()]
        while arguments and self.token.text == ",":
            self.advance()
            arguments.append(self.sum())
        self.close(opening)
        return tuple(arguments)

    def misplaced(self, hint: str | None = None) -> ExpressionError:
        """The error for a token that fits no rule of the grammar here."""
        here = self.token
        before = self.tokens[self.index - 1] if self.index else here
        shown = here.text if len(here.text) <= _SHOWN else f"{here.text[:_SHOWN]}..."
        if here.kind == "end":
            return ExpressionError("the expression ends too early", column=here.column)
        if before.kind in ("number", "name", "root", "superscript") or before.text == ")":
            if here.kind in ("number", "name") and before is not here:
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
        elif before is not here and before.text == here.text == "/":
            hint = "division is one `/`"
        return ExpressionError(f"unexpected `{shown}`", column=here.column, hint=hint)

    def no_function(self, token: Token) -> ExpressionError:
        """The error for a name that is called like a function."""
        name = token.text[:_SHOWN]
        near = nearest(name, tuple(FUNCTIONS))
        hint = f"a product is written `{name}*(...)`; the functions are {' '.join(FUNCTIONS)}"
        if near:
            hint = f"did you mean `{near}`? A product is written `{name}*(...)`"
        elif self.functions is not NO_FUNCTIONS:
            slope = re.fullmatch(r"d(\w+?)(_d\w+)+", name)
            declared = f"`functions: {{{slope[1] if slope else name}: [x]}}`"
            hint = f"a function of x without a formula is declared in the system by {declared}; {hint}"
        return ExpressionError(f"`{name}` is not a function", column=token.column, hint=hint)


def multiplied(factors: Sequence[tree.Node]) -> tree.Node:
    """The product of the factors, or the factor if there is one only."""
    return factors[0] if len(factors) == 1 else tree.Product(tuple(factors))


def applied(typed: Token, name: str, arguments: tuple[tree.Node, ...]) -> tree.Node:
    """A function call, or the formula that stands for it: cot(x) is cos(x)/sin(x).

    Raises ExpressionError for too many or too few arguments.
    """
    formula, *parameters = "", *("x" * FUNCTIONS[name].arity if name in FUNCTIONS else "x")
    if isinstance(name, tree.UnknownFunction):
        parameters = list(name.parameters)
    elif name in DEFINED:
        formula, *parameters = DEFINED[name]
    if len(arguments) != len(parameters):
        count = f"{len(parameters)} argument{'s' * (len(parameters) > 1)}"
        raise ExpressionError(f"`{typed.text}` takes {count}, not {len(arguments)}", column=typed.column)
    if not formula:
        return tree.Call(name, arguments)
    return tree.bound(_formula(formula), dict(zip(parameters, arguments, strict=True)))


@cache
def _formula(text: str) -> tree.Node:
    return read(text)[0]
