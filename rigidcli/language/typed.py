r"""The one reader of what people type: formulas in a question's own letters.

    words = Words(["m", "g", "z", "p_theta", "theta"])
    expression(r"\frac{p_\theta^2}{2m} + mgz", words)      # the tree of p_theta**2/(2*m) + m*g*z

Beyond the language of documents: LaTeX, names that are run together (`mgz`), functions without brackets
(`sin^2 theta`), square brackets, bars, decimal commas, `dx/dt`, primes, `x(t)`, and a name and `=` in front.
What can be read in two ways is refused, and both are named. No text is given to anything that could run it.

    sum     = product (("+" | "-") product)*
    product = factor (["*" | "/"] factor)*
    factor  = ("-" | "+") factor | atom ["^" factor]
    atom    = number | word | function ["^" number] argument | "(" sum ")" | "|" sum "|"
    argument = "(" sum ("," sum)* ")" | [number] word ["t"]
"""

from __future__ import annotations

import re
from typing import NamedTuple

from rigidcli.errors import ExpressionError, shown
from rigidcli.language import tree
from rigidcli.language.functions import ALIASES, CONSTANTS, FUNCTIONS
from rigidcli.language.latex import plain
from rigidcli.language.text import text as written
from rigidcli.language.vocabulary import Words, unknown, unreadable

MAX_DEPTH = 100
"""How deep brackets, calls, signs and powers may be nested, so that recursion never ends the program."""

MAX_DIGITS = 400
"""The most digits of a number, so that its exact fraction stays small."""

_ANGLE = re.compile(r"(theta|phi|psi|alpha|beta|gamma|chi|vartheta)[_0-9]*")
"""Names that are the whole argument of a sine, so that `sin theta x` has one meaning."""

_LEADING = re.compile(r"\s*(?!\d)[\w']+(?:\s*\((?:[\w',\s]|dot)*\))?\s*(?::=|={1,2}|:)(?!=)|\s*[~=]")
"""A name before the answer: `H =`, `H(x, p) =`; or the sign of `~20.8`."""
_MEMBERS = re.compile(r"\A(?:[^\[{,;\n]|(?<=\d),(?=\d))*=")
_NAME = r"[^\W\d]\w*+"
_SLOPE = re.compile(
    rf"\bd\s*(?P<second>\^\s*2|2(?=\s*[\(\w]))?\s*(?:(?P<name>{_NAME})|\(\s*(?P<inner>{_NAME})\s*\))"
    rf"\s*/\s*(?P<open>\()?\s*d\s*t\s*(?:\^?\s*2)?\s*(?(open)\))(?!\w)"
    rf"|(?P<opened>\()?\s*\bd\s*/\s*d\s*t\b\s*(?(opened)\))\s*(?P<bracket>\()?\s*(?P<behind>{_NAME})\s*(?(bracket)\))"
)
"""`dx/dt`, `d^2 x/dt^2`, `d(theta)/dt`, `d/dt x`."""

_PRIMED = re.compile(rf"({_NAME})('{{1,2}}|\")(?:\(t\))?")
_TOKEN = re.compile(
    r"""\s*+(?: (?P<number> (?: \d++ \.?+ \d*+ | \.\d++ ) (?: [eE][+-]?\d++ (?!\w) )?+ )
      | (?P<name> [^\W\d]\w*+ )
      | (?P<sign> \*\* | [-+*/^()\[\],|] )
      | (?P<end> \Z ) | (?P<stranger> . ) )""",
    re.VERBOSE | re.DOTALL,
)
_BRACKETS = {"[": "(", "]": ")", "**": "^"}


def expression(text: str, words: Words | None, *, leading: bool = True) -> tree.Node:
    """The tree of a formula in these words; without words, a name is taken whole, whatever it is.

    A name and `=` may be `leading`.

    Raises:
        ExpressionError: the text is no formula, or can be read in two ways. Its `code` is `unknown_symbol`
            for a name that the question does not have, `too_large` beyond the bounds.
    """
    found = plain(text)
    return _Reader(slopes(unnamed(found) if leading else found), words).whole()


def unnamed(text: str) -> str:
    """A plain text without the name, the sign and other members before the answer, and its final dot."""
    leading = _LEADING.match(text)
    rest = text if leading is None else _MEMBERS.sub("", text[leading.end() :])
    return re.sub(r"(?<![\d\s])\.\s*\Z|[;,\s]+\Z", "", rest)


def slopes(text: str) -> str:
    """A plain text with `xdot` for `dx/dt` and `x'`, and with points for decimal commas."""
    text = _SLOPE.sub(
        lambda found: (
            f" {found['name'] or found['inner'] or found['behind']}{'ddot' if found['second'] else 'dot'} "
        ),
        text,
    )
    text = _PRIMED.sub(lambda found: f"{found[1]}{'dot' if found[2] == chr(39) else 'ddot'} ", text)
    return text if "atan2" in text else re.sub(r"(?<=\d),(?=\d)", ".", text)


class _Token(NamedTuple):
    kind: str
    text: str
    touches: bool
    """Whether there is no blank before it."""


def _tokens(text: str) -> list[_Token]:
    found = []
    for match in _TOKEN.finditer(text):
        kind = match.lastgroup or "end"
        piece = match[kind]
        if kind == "stranger":
            raise unreadable(f"unexpected {shown(piece)}", _HINTS.get(piece))
        if kind == "number" and (len(piece) > MAX_DIGITS or len(piece.lower().partition("e")[2]) > 5):
            raise unreadable(f"a number has at most {MAX_DIGITS} digits", code="too_large")
        found.append(_Token(kind, _BRACKETS.get(piece, piece), match.start() == match.start(kind)))
        if kind == "end":
            break
    return found


_HINTS = {
    "=": "give one formula, with at most a name before it",
    "±": "give one value",
    "<": "there are no comparisons",
    ">": "there are no comparisons",
    "!": "there is no factorial",
    "∂": "work out the derivatives",
    "°": "angles are in radians: multiply by `pi/180`",
    "%": "write `/100`",
    ";": "give one formula",
    ":": "a ratio is written with `/`",
}


class _Reader:
    """A place in the tokens of one text, with a method for each rule of the grammar."""

    def __init__(self, text: str, words: Words | None) -> None:
        self.words = words
        self.tokens = _tokens(text)
        self.index = 0
        self.depth = 0
        self.bars = 0

    @property
    def token(self) -> _Token:
        return self.tokens[self.index]

    def deeper(self) -> None:
        """Pass a token that puts what follows one level deeper."""
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise unreadable(f"nested deeper than {MAX_DEPTH} levels", code="too_large")
        self.index += 1

    def whole(self) -> tree.Node:
        if self.token.kind == "end":
            raise unreadable("the answer is empty")
        node = self.sum()
        if self.token.kind != "end":
            raise self.misplaced()
        return node

    def sum(self) -> tree.Node:
        terms = [self.product()]
        while (sign := self.token.text) in ("+", "-") and self.token.kind == "sign":
            self.index += 1
            term = self.product()
            terms.append(term if sign == "+" else tree.Negative(term))
        return terms[0] if len(terms) == 1 else tree.Sum(tuple(terms))

    def begins_factor(self) -> bool:
        """Whether a factor without a sign may begin here."""
        token = self.token
        return token.kind == "name" or token.text == "(" or (token.text == "|" and not self.bars)

    def product(self) -> tree.Node:
        factors = [self.factor()]
        while True:
            sign = self.token.text
            if sign in ("*", "/") and self.token.kind == "sign":
                self.index += 1
                factor = self.factor()
                factors.append(factor if sign == "*" else tree.Reciprocal(factor))
            elif self.begins_factor():
                if isinstance(divided := factors[-1], tree.Reciprocal):
                    raise self.unclear_quotient(factors[:-1], divided.operand)
                is_word, factor = self.token.kind == "name", self.factor()
                factors += factor.factors if is_word and isinstance(factor, tree.Product) else [factor]
            else:
                return _product(factors)

    def unclear_quotient(self, above: list[tree.Node], divisor: tree.Node) -> ExpressionError:
        """What is wrong with `1/2 m`."""
        factor = self.factor()
        below = tree.Reciprocal(tree.Product((divisor, factor)))
        kept = above if above != [tree.Number("1", 1.0)] else []
        readings = _product([*above, below]), _product([*kept, factor, tree.Reciprocal(divisor)])
        one, other = (written(reading) for reading in readings)
        hint = f"write `{one}` or `{other}`"[:200]
        return unreadable("a product without a sign after `/` can be read in two ways", hint)

    def factor(self) -> tree.Node:
        sign = self.token.text
        if sign in ("-", "+"):
            self.deeper()
            operand = self.factor()
            self.depth -= 1
            return operand if sign == "+" else tree.Negative(operand)
        *before, base = self.atoms()
        if self.token.text == "^":
            base = (
                tree.Call("exp", (self.exponent(),))
                if self.is_euler(base)
                else tree.Power(base, self.exponent())
            )
        return _product([*before, base])

    def exponent(self) -> tree.Node:
        self.deeper()
        exponent = self.factor()
        self.depth -= 1
        return exponent

    def is_euler(self, base: tree.Node) -> bool:
        """Whether this is the number e, which is no letter of the question."""
        return base == tree.Name("e") and self.words is not None and self.words.meaning("e") is None

    def atoms(self) -> list[tree.Node]:
        """A number, a bracket, a function, or the names that a word is the product of."""
        token = self.token
        if token.kind == "number":
            self.index += 1
            return [tree.Number(token.text, float(token.text))]
        if token.kind == "name":
            self.index += 1
            return self.word(token.text)
        if token.text not in ("(", "|"):
            raise self.misplaced()
        self.deeper()
        self.bars += token.text == "|"
        outer, self.bars = self.bars, self.bars if token.text == "|" else 0
        node = self.sum()
        self.bars = outer
        self.close(token.text)
        self.bars -= token.text == "|"
        self.depth -= 1
        return [node if token.text == "(" else tree.Call("abs", (node,))]

    def close(self, opening: str) -> None:
        if self.token.text != {"(": ")", "|": "|"}[opening]:
            raise unreadable(f"`{opening}` is never closed") if self.token.kind == "end" else self.misplaced()
        self.index += 1

    def word(self, word: str) -> list[tree.Node]:
        """What a word means, which has been passed already."""
        parts = self.parts(word)
        nodes: list[tree.Node] = []
        for place, part in enumerate(parts):
            is_name = self.words is not None and self.words.meaning(part) == part
            if part in CONSTANTS and not is_name:
                nodes.append(tree.Constant(part))
            elif (part in FUNCTIONS or part in ALIASES) and not is_name:
                if place + 1 < len(parts):  # the rest of the word is its argument, as in `sinx`
                    inner: list[tree.Node] = [tree.Name(name) for name in parts[place + 1 :]]
                    return [*nodes, tree.Call(part, (_product(inner),))]
                nodes.append(self.call(part))
            else:
                nodes.append(tree.Name(part))
        if self.is_of_time(parts[-1]):
            self.index += 3
        return nodes

    def parts(self, word: str) -> tuple[str, ...]:
        if self.words is None:
            return (word,)
        if (name := self.words.meaning(word)) is not None:
            return (name,)
        if (
            word in FUNCTIONS
            or word in ALIASES
            or word in CONSTANTS
            or (word == "e" and self.token.text == "^")
        ):
            return (word,)
        ways = self.words.products(word)
        if len(ways) == 2:
            first, second = (" ".join(way) for way in ways)
            raise unreadable(
                f"`{word}` can be read as `{first}` and as `{second}`", "put blanks or `*` between names"
            )
        if not ways:
            raise unknown(word, self.words)
        return ways[0]

    def is_of_time(self, name: str) -> bool:
        """Whether `(t)` follows a name that depends on the time."""
        following = [token.text for token in self.tokens[self.index : self.index + 3]]
        is_moving = self.words is None or name in self.words.moving
        touches = self.token.touches or name.endswith("dot")
        return following == ["(", "t", ")"] and touches and is_moving

    def call(self, function: str) -> tree.Node:
        """A function, whose name has been passed already, perhaps with a power, and its arguments."""
        power: tree.Node | None = None
        if self.token.text == "^":
            power = self.exponent()
        if power == tree.Negative(tree.Number("1", 1.0)):
            if f"a{function}" not in FUNCTIONS:
                raise unreadable(f"the inverse of `{function}` is not clear", f"write `1/{function}(...)`")
            function, power = f"a{function}", None
        function = ALIASES.get(function, function)
        arguments = self.arguments() if self.token.text == "(" else (self.bare(function, power),)
        arity = FUNCTIONS[function].arity
        if len(arguments) != arity:
            raise unreadable(f"`{function}` takes {arity} argument{'s'[: arity - 1]}, not {len(arguments)}")
        node = tree.Call(function, arguments)
        return node if power is None else tree.Power(node, power)

    def arguments(self) -> tuple[tree.Node, ...]:
        self.deeper()
        outer, self.bars = self.bars, 0
        found = [self.sum()]
        while self.token.text == ",":
            self.index += 1
            found.append(self.sum())
        self.close("(")
        self.depth -= 1
        self.bars = outer
        return tuple(found)

    def bare(self, function: str, power: tree.Node | None) -> tree.Node:
        """The argument of a function without brackets: `2 theta`, `omega t`, `kx`."""
        factors: list[tree.Node] = []
        if self.token.kind == "number":
            factors += self.atoms()
            if function == "sqrt" and not (self.token.kind == "name" and self.token.touches):
                return factors[0]
        if self.token.kind == "name" and self.token.text not in FUNCTIONS:
            self.deeper()
            factors += self.word(self.tokens[self.index - 1].text)
            self.depth -= 1
        if not factors:
            raise unreadable(f"`{function}` needs its argument in brackets", f"write `{function}(...)`")
        if self.token.text == "t" and factors[-1] != tree.Name("t"):
            self.index += 1
            factors.append(tree.Name("t"))
        argument = _product(factors)
        last = factors[-1]
        is_angle = isinstance(last, tree.Name) and (_ANGLE.match(last.name) or last.name == "t")
        behind = self.token.kind == "name" and self.token.text not in FUNCTIONS and not is_angle
        divided = self.token.text == "/" and self.tokens[self.index + 1].kind == "number"
        if self.token.text == "^" or (len(factors) > 1 if function == "sqrt" else behind or divided):
            first = written(tree.Call(function, (argument,)))
            hint = f"write `{first}`, or brackets around all of the argument"[:200]
            raise unreadable(f"`{function}` without brackets can be read in two ways", hint)
        return argument

    def misplaced(self) -> ExpressionError:
        """What is wrong with the token that no rule of the grammar can use here."""
        here, before = self.token, self.tokens[self.index - 1] if self.index else None
        if here.kind == "end":
            return unreadable("the formula ends too early")
        if here.kind == "number" and before is not None and before.kind != "sign":
            return unreadable(f"no sign before `{here.text[:24]}`")
        if here.text == ")":
            return unreadable("`)` closes nothing")
        return unreadable(f"unexpected `{here.text[:24]}`")


def _product(factors: list[tree.Node]) -> tree.Node:
    return factors[0] if len(factors) == 1 else tree.Product(tuple(factors))
