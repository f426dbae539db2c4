"""Tokens to trees: the grammar of what people type, in documents and in answers.

    sum      = product (("+" | "-") product)*
    product  = factor (["*" | "/"] factor)*
    factor   = ("-" | "+") factor | atom ["**" exponent | superscript]
    atom     = number ["deg"] | word | function argument | "(" sum ")" | "|" sum "|"
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
from itertools import product

from rigidcli.errors import ExpressionError, shortened
from rigidcli.language import tree
from rigidcli.language.tokens import Token, tokenize
from rigidcli.language.words import ALIASES, CALLED, CONSTANTS, DEFINED, FUNCTIONS, SHORT, Words, unknown
from rigidcli.suggestions import nearest

# The functions of a text in which none can be declared.
NO_FUNCTIONS: Mapping[str, tree.UnknownFunction] = {}
# How deep parentheses, calls, signs and powers may be nested, so that recursion never ends the program.
MAX_DEPTH = 100
# The most readings of one text, and the most ways in which it is read to find them.
MOST_READINGS, MOST_WAYS = 8, 32
MOST_AHEAD = 6  # how many tokens are looked at in one go: behind the end come so many more ends
# The name of d/dt before a bracket, whose derivative by the time is for others to work out.
RATE = "Ddt"
_CLOSING = {"(": ")", "|": "|"}
_ROOTS = ("sqrt", "cbrt")
_SHOWN = 24  # the most characters of a piece that a message repeats
_E = tree.Name("e")

# Names that are usually the whole argument of a function: `sin theta x`.
_ANGLE = re.compile(r"(theta|phi|psi|alpha|beta|gamma|chi|vartheta)[_0-9]*")
# A function with its argument behind it in one word: `sin2theta`.
_HEAD = re.compile(rf"({'|'.join(sorted(CALLED - {'atan2', *SHORT}, key=len, reverse=True))})(\d+)(\w*)")


class Reach(Enum):
    """Where an operand without brackets ends: in `sin 2 x + 1`, behind x or behind 2."""

    ALL = "up to the next sum or function"
    RUN = "as far as no blank stands between"
    FIRST = "its first factor"


ALL, RUN, FIRST = Reach
# How far operands reach in the readings of a text: as is usual in each place, or alike in all.
OTHER_WAYS = (None, FIRST, RUN, ALL)


def read(source: str) -> tuple[tree.Node, frozenset[str]]:
    """The most usual tree of a text, and the names in it.

    Raises ExpressionError: the text is not in the language, with the column where it stops being so.
    """
    root = of_tokens(tokenize(source), NO_FUNCTIONS, None)[0]
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
        self.tokens = [*tokens, *[tokens[-1]] * MOST_AHEAD]
        self.index = 0
        self.token = self.tokens[0]
        self.depth = -1  # of what stands in no bracket it is 0
        self.functions = functions
        self.words = words
        self.way = way
        self.places: dict[str, int] = {}
        self.barred = [False]
        self.is_open = words is None or words.is_open
        # Whether e is the number, and no letter of the question.
        self.has_euler = not self.is_open and self.meaning("e") is None

    def meaning(self, word: str) -> str | None:
        return self.words.meaning(word) if self.words else None

    def advance(self, count: int = 1) -> Token:
        """Pass tokens, and return the first of them."""
        passed = self.tokens[self.index]
        self.index += count
        self.token = self.tokens[self.index]
        return passed

    def ahead(self, count: int) -> list[Token]:
        return self.tokens[self.index : self.index + count]

    def close(self, opening: Token) -> None:
        if self.token.kind == "end":
            raise ExpressionError(f"`{opening.text}` is never closed", column=opening.column)
        if self.token.text != _CLOSING[opening.text]:
            raise self.misplaced()
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
        terms = [self.product()]
        while self.token.text in ("+", "-"):
            sign = self.advance().text
            term = self.product()
            terms.append(term if sign == "+" else tree.Negative(term))
        return terms[0] if len(terms) == 1 else tree.Sum(tuple(terms))

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
        ends = list(dict.fromkeys([run, 1, len(below)]))
        end = ends[self.meets("number" if is_fraction else "divisor", len(ends))]
        return [tree.Reciprocal(multiplied(below[:end])), *below[end:]]

    def begins_factor(self) -> bool:
        here = self.token
        opens = here.text == "(" or (here.text == "|" and not self.barred[-1])
        return here.kind in ("name", "root") or opens or self.is_fraction()

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
        if token.kind != "name" or word in SHORT or self.meaning(word):
            return token.kind == "root"
        return word in CALLED or word.startswith(("sin", "cos", "tan", "exp", "ln", "log"))

    def factor(self) -> list[tree.Node]:
        """A signed operand or a power; a word such as `mgz` gives several factors."""
        self.depth += 1
        if self.depth > MAX_DEPTH:
            message = f"nested deeper than {MAX_DEPTH} levels"
            raise ExpressionError(message, column=self.token.column, code="too_large")
        if self.token.text in ("-", "+"):
            sign = self.advance().text
            factors = self.factor()
            factors = factors if sign == "+" else [tree.Negative(multiplied(factors))]
        else:
            # A name is read here, and not there, as each level of calls takes one place less on the stack so.
            is_named = self.token.kind in ("name", "root")
            factors = self.named(self.advance()) if is_named else self.atoms()
            if self.token.kind == "superscript":
                factors[-1] = self.power(factors[-1], self.superscript())
                if self.token.text == "**" or self.token.kind == "superscript":
                    raise self.misplaced("group powers of powers with parentheses")
            if self.token.text == "**":
                factors[-1] = self.power(factors[-1], self.exponent(factors[-1]))
        self.depth -= 1
        return factors

    def superscript(self) -> tree.Node:
        raised = self.advance().text
        digits = raised.removeprefix("-")
        number = tree.Number(digits, float(digits))
        return number if digits == raised else tree.Negative(number)

    def power(self, base: tree.Node, exponent: tree.Node) -> tree.Node:
        is_euler = base == _E and self.has_euler
        return tree.Call("exp", (exponent,)) if is_euler else tree.Power(base, exponent)

    def exponent(self, base: tree.Node | None) -> tree.Node:
        """What stands behind the sign of a power; in documents `**` has the order of all programs."""
        is_group = self.tokens[self.index - 1].text == ")"
        if self.advance().kind == "stars" and self.is_open:
            return multiplied(self.factor())
        is_signed = self.token.text in ("-", "+")
        first, second, third = self.ahead(4)[is_signed:][:3]
        orders: tuple[Reach, ...] = ()
        if base == _E and self.has_euler:
            orders = (ALL, RUN, FIRST)
        elif isinstance(base, tree.Number) and first.kind == "name":
            # With a sign behind it, 2^n/x has the order of all programs in a document.
            orders = () if self.is_open and second.text in ("*", "/") else (RUN, FIRST)
        elif first.kind == third.kind == "number" and second.text == "/":
            return self.fraction(first.text, third.text, is_group)
        if not orders or first.text == "(":
            return multiplied(self.factor())
        start = self.index
        exponent = self.product(self.reach("exponent", orders))
        if self.index > start + 1 or self.token.text == "/" or self.begins_factor():
            self.meets("exponent", len(OTHER_WAYS))
        return exponent

    def fraction(self, above: str, below: str, is_group: bool) -> tree.Node:
        """The exponent `1/2`, or the number before its `/`: x^2/2 is half a square, x^1/2 is a root.

        In answers `(a + b)^3/2` may be a power of 3/2, too; a document has the order of all programs.
        """
        is_usual = above == "1" and float(below) != 0
        may_be = not self.is_open and (is_group or below == "2") and float(below) != 0
        may_be = may_be and float(above) % float(below) != 0
        exponent = multiplied(self.factor())
        way = self.meets("fraction", 3 if is_usual or may_be else 1)
        if (is_usual, True, False)[way]:
            self.advance()
            exponent = tree.Product((exponent, tree.Reciprocal(multiplied(self.atoms()))))
        return exponent

    def atoms(self) -> list[tree.Node]:
        """What a power may follow, and is no word: a number, or a sum in brackets."""
        if self.token.kind == "number":
            digits = self.advance().text
            number = tree.Number(digits, float(digits))
            if self.token.text not in ("deg", "degree", "degrees", "Grad") or self.meaning(self.token.text):
                return [number]
            self.advance()
            turn = tree.Reciprocal(tree.Number("180", 180.0))
            return [tree.Product((number, tree.Constant("pi"), turn))]
        if self.token.text not in _CLOSING:
            raise self.misplaced()
        opening = self.advance()
        self.barred.append(opening.text == "|")
        inner = self.sum()
        self.close(opening)
        return [tree.Call("abs", (inner,)) if opening.text == "|" else inner]

    def named(self, token: Token) -> list[tree.Node]:
        """The factors that a word stands for; its token has been passed."""
        name, words = token.text, self.words
        calls = self.token.text == "(" and self.token.touches
        meant = self.meaning(name)
        if meant is not None and not (calls and name in self.functions):
            return self.symbol(meant, token)
        if calls and (called := self.before_bracket(token)):
            return [called]
        if name in CALLED and (name not in SHORT or self.is_called(name)):
            is_amplitude = name[0] == "a" and name[1:] in CALLED and not self.is_open and self.meaning("a")
            if is_amplitude and self.meets("inverse", 2) == 0:
                return self.named(self.put(token, "a", name[1:]))
            if calls and not self.is_half(token):  # here, and not below, for one place less on the stack
                return [applied(token, ALIASES.get(name, name), self.arguments())]
            return [self.call(token)]
        if name in CONSTANTS:
            if calls and words is not None and words.is_open:
                raise self.no_function(token)
            return [tree.Constant(name)]
        if words is None:
            return self.symbol(name, token)
        if name not in SHORT and (head := _HEAD.fullmatch(name)):
            return self.named(self.put(token, *filter(None, head.groups())))
        if self.token.text == "**" and self.has_euler:
            if name in ("e", "E"):  # the second as Mathematica writes it
                return [_E]
            if name[-1] == "e" and (words.meaning(name[:-1]) or words.products(name[:-1])):
                return self.named(self.put(token, name[:-1], "e"))
        ways = words.products(name, self.token.kind in ("name", "number") or self.token.text == "(")
        if not ways and words.is_open:
            return self.symbol(name, token)
        if not ways:
            raise unknown(name, words)
        parts = ways[self.meets("spelling", len(ways))]
        if parts[0] in CALLED:
            return [self.call(self.put(token, *parts))]
        if not CALLED.isdisjoint(parts):
            return self.named(self.put(token, *parts))
        if self.is_of_time(parts[-1]):
            self.advance(3)
        return [tree.Constant(p) if p in CONSTANTS and words.meaning(p) != p else tree.Name(p) for p in parts]

    def before_bracket(self, token: Token) -> tree.Node | None:
        """What a word means before a bracket alone: d/dt, `dot(x)`, a declared function, `pow`."""
        name = token.text
        if name == RATE and self.words is not None and self.words.moving:
            return tree.Call(RATE, self.arguments())
        _, argument, end = self.ahead(3)
        if name in ("dot", "ddot") and end.text == ")":
            self.advance(3)
            return tree.Name(f"{argument.text}{name}")
        function = self.functions.get(name, name)
        is_known = name in self.functions or (name in DEFINED and name not in CALLED)
        return applied(token, function, self.arguments()) if is_known else None

    def is_called(self, name: str) -> bool:
        """Whether a short name of a function, which may also be letters, stands before an argument."""
        calls = self.token.text == "(" and self.token.touches
        if self.words is None or self.words.is_open:
            return calls
        begins = calls or self.token.kind in ("name", "number")
        return begins and (not self.words.products(name) or self.meets("alias", 2) == 0)

    def put(self, token: Token, *parts: str) -> Token:
        """Replace the word just passed by its parts, and pass the first of them."""
        self.tokens[self.index : self.index] = [
            Token("number" if part[0].isdigit() else "name", part, token.column, token.touches or place > 0)
            for place, part in enumerate(parts)
        ]
        return self.advance()

    def symbol(self, name: str, token: Token) -> list[tree.Node]:
        """A name, perhaps with `(t)` behind it."""
        if self.is_of_time(name):
            self.advance(3)
        elif self.words and self.is_open and self.token.text == "(" and self.token.touches:
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
        if token.kind == "root" and (self.token.kind == "superscript" or self.token.text == "**"):
            raise self.misplaced("`sqrt(x)^3` is the power of a root, `∛x` is a cube root")
        if self.token.kind == "superscript":
            power = self.superscript()
        elif self.token.text == "**":
            power = self.exponent(None)
        function = ALIASES.get(token.text, token.text)
        if power == tree.Negative(tree.Number("1", 1.0)):
            if f"a{function}" not in FUNCTIONS:
                message = f"the inverse of `{function}` is not clear"
                raise ExpressionError(message, hint=f"write `1/{function}(...)`", column=token.column)
            function, power = f"a{function}", None
        if self.token.text == "(" and not self.is_half(token):
            arguments = self.arguments()
        else:
            argument = self.operand(function, token)
            arguments = (argument,)
            is_word = token.kind == "name"  # behind the sign, √x² is the root of a square
            if power is None and isinstance(argument, tree.Power) and is_word and self.meets("raised", 2):
                arguments, power = (argument.base,), argument.exponent
        node = applied(token, function, arguments)
        return node if power is None else tree.Power(node, power)

    def is_half(self, function: Token) -> bool:
        """Whether the next tokens are `(1/2)theta`, as `½θ` is written after its signs were replaced.

        A root ends with its bracket: `sqrt(1/2)x` has one reading.
        """
        if ALIASES.get(function.text, function.text) in _ROOTS:
            return False
        _, above, bar, below, end, behind = self.ahead(MOST_AHEAD)
        is_fraction = above.kind == below.kind == "number" and bar.text == "/" and end.text == ")"
        return is_fraction and behind.kind == "name" and behind.touches

    def operand(self, function: str, token: Token) -> tree.Node:
        """The argument of a function that stands without brackets: `sin 2 x`."""
        here, following = self.ahead(2)
        is_root = function in _ROOTS
        is_number = here.kind == "number"
        begins = is_number or self.begins_factor()
        if not (begins or (here.text == "-" and not is_root and self.words)):
            raise ExpressionError(
                f"`{token.text}` is a function and needs its argument in parentheses",
                column=token.column,
                hint=f"write `{token.text}(...)`",
            )
        orders: tuple[Reach, ...] = (ALL, FIRST) if is_number else (ALL, RUN, FIRST)
        if is_root:
            is_run = following.touches and (following.kind == "name" or following.text == "(")
            orders = (FIRST, ALL) if is_number and not is_run else (RUN, FIRST, ALL)
            orders = orders[: -1 if self.is_open else None]
        elif here.kind == "name" and _ANGLE.fullmatch(here.text) and following.kind == "name":
            orders = (FIRST, ALL) if following.text != "t" else orders
        place = "root" if is_root else "argument"
        start, reach = self.index, self.reach(place, orders)
        if reach is not FIRST:
            operand = self.product(reach)
        else:
            factors = self.factor()
            if not is_root and is_number and self.token.kind == "name" and not self.is_function(self.token):
                factors += self.factor()
            if not is_root and self.token.text == "t" and factors[-1] != tree.Name("t"):
                factors += self.factor()
            operand = multiplied(factors)
        is_divided = self.token.text == "/" and is_root and orders[0] is RUN
        if self.index > start + 1 or self.begins_factor() or is_divided:
            self.meets(place, len(OTHER_WAYS) if len(orders) > 1 else 1)
        return operand

    def arguments(self) -> tuple[tree.Node, ...]:
        opening = self.advance()
        self.barred.append(False)
        arguments = [] if self.token.text == ")" else [self.sum()]
        while arguments and self.token.text == ",":
            self.advance()
            arguments.append(self.sum())
        self.close(opening)
        return tuple(arguments)

    def misplaced(self, hint: str | None = None) -> ExpressionError:
        """The error for a token that fits no rule of the grammar here."""
        here = self.token
        before = self.tokens[self.index - 1] if self.index else Token("", "", None, touches=False)
        piece = shortened(here.text, _SHOWN)
        message = f"unexpected `{piece}`"
        is_behind = before.kind in ("number", "name", "superscript") or before.text == ")"
        if here.kind == "end":
            message = "the expression ends too early"
        elif is_behind and here.kind in ("number", "name"):
            message = f"no operator before `{piece}`"
            if here.text[0] == "_":
                hint = "digits stand without `_`"
            elif before.kind == "number":
                hint = f"commas separate the entries of a list: `{before.text[-_SHOWN:]}, {piece}`"
            elif before.kind != "superscript":
                hint = f"write `{'(...)' if before.text == ')' else before.text[-_SHOWN:]}*{piece}`"
        elif here.text == ")" and (is_behind or not self.index):
            message = "`)` closes nothing"
        elif here.text == ",":
            hint = "a comma stands between arguments; the decimal sign is a point"
        elif before.text == here.text == "/":
            hint = "division is one `/`"
        return ExpressionError(message, column=here.column, hint=hint)

    def no_function(self, token: Token) -> ExpressionError:
        """The error for a name that is called like a function."""
        name = token.text[:_SHOWN]
        hint = f"a product is written `{name}*(...)`; the functions are {' '.join(FUNCTIONS)}"
        if [following.text for following in self.ahead(2)] == ["(", "t"]:
            hint = f"what depends on the time stands without it: write `{name}`"
        elif near := nearest(name, FUNCTIONS):
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
    formula, *parameters = DEFINED.get(name) or (
        "",
        *"xy"[: FUNCTIONS[name].arity if name in FUNCTIONS else 1],
    )
    if isinstance(name, tree.UnknownFunction):
        formula, *parameters = ("", *name.parameters)
    if len(arguments) != len(parameters):
        count = f"{len(parameters)} argument{'s' * (len(parameters) > 1)}"
        raise ExpressionError(f"`{typed.text}` takes {count}, not {len(arguments)}", column=typed.column)
    if not formula:
        return tree.Call(name, arguments)
    return tree.bound(read(formula)[0], dict(zip(parameters, arguments, strict=True)))
