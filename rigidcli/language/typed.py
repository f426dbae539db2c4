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

from rigidcli.errors import ExpressionError, shown
from rigidcli.language import tree
from rigidcli.language.functions import ALIASES, CONSTANTS, FUNCTIONS
from rigidcli.language.latex import plain
from rigidcli.language.parser import Reader, product_of
from rigidcli.language.text import text as written
from rigidcli.language.tokens import MAX_DIGITS, Token
from rigidcli.language.vocabulary import Words, unknown, unreadable

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
      | (?P<operator> \*\* | [-+*/^()\[\],|] )
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


def _tokens(text: str) -> list[Token]:
    found = []
    for match in _TOKEN.finditer(text):
        kind = match.lastgroup or "end"
        piece = match[kind]
        if kind == "stranger":
            raise unreadable(f"unexpected {shown(piece)}", _HINTS.get(piece))
        if kind == "number" and (len(piece) > MAX_DIGITS or len(piece.lower().partition("e")[2]) > 5):
            raise unreadable(f"a number has at most {MAX_DIGITS} digits", code="too_large")
        place = match.start(kind)
        found.append(Token(kind, _BRACKETS.get(piece, piece), place + 1, match.start() == place))
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


class _Reader(Reader):
    """The grammar of answers."""

    empty = "the answer is empty"

    def __init__(self, text: str, words: Words | None) -> None:
        super().__init__(_tokens(text))
        self.words = words
        self.bars = 0

    def refused(
        self, message: str, column: int, hint: str | None = None, code: str = "parse_error"
    ) -> ExpressionError:
        return unreadable(message, hint, code)

    def begins_factor(self) -> bool:
        token = self.token
        return token.kind == "name" or token.text == "(" or (token.text == "|" and not self.bars)

    def factors(self) -> list[tree.Node]:
        is_word, factor = self.token.kind == "name", self.factor()
        return list(factor.factors) if is_word and isinstance(factor, tree.Product) else [factor]

    def raised(self) -> tree.Node:
        *before, base = self.atoms()
        if self.token.text == "^":
            exponent = self.deeper()
            # The number e is no letter of the question.
            is_euler = base == tree.Name("e") and self.words is not None and self.words.meaning("e") is None
            base = tree.Call("exp", (exponent,)) if is_euler else tree.Power(base, exponent)
        return product_of([*before, base])

    def atoms(self) -> list[tree.Node]:
        """A number, a bracket, a function, or the names that a word is the product of."""
        token = self.token
        if token.kind == "number":
            self.advance()
            return [tree.Number(token.text, float(token.text))]
        if token.kind == "name":
            self.advance()
            return self.word(token.text)
        if token.text not in ("(", "|"):
            raise self.misplaced()
        self.descend()
        self.bars += token.text == "|"
        outer, self.bars = self.bars, self.bars if token.text == "|" else 0
        node = self.sum()
        self.bars = outer
        self.close(token)
        self.bars -= token.text == "|"
        self.depth -= 1
        return [node if token.text == "(" else tree.Call("abs", (node,))]

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
                    return [*nodes, tree.Call(part, (product_of(inner),))]
                nodes.append(self.call(part))
            else:
                nodes.append(tree.Name(part))
        if self.is_of_time(parts[-1]):
            for _ in range(3):
                self.advance()
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
            power = self.deeper()
        if power == tree.Negative(tree.Number("1", 1.0)):
            if f"a{function}" not in FUNCTIONS:
                raise unreadable(f"the inverse of `{function}` is not clear", f"write `1/{function}(...)`")
            function, power = f"a{function}", None
        function = ALIASES.get(function, function)
        arguments = self.arguments() if self.token.text == "(" else (self.bare(function, power),)
        self.require_arity(function, FUNCTIONS[function].arity, arguments, self.token.column)
        node = tree.Call(function, arguments)
        return node if power is None else tree.Power(node, power)

    def arguments(self) -> tuple[tree.Node, ...]:
        outer, self.bars = self.bars, 0
        found = super().arguments()
        self.bars = outer
        return found

    def bare(self, function: str, power: tree.Node | None) -> tree.Node:
        """The argument of a function without brackets: `2 theta`, `omega t`, `kx`."""
        factors: list[tree.Node] = []
        if self.token.kind == "number":
            factors += self.atoms()
            if function == "sqrt" and not (self.token.kind == "name" and self.token.touches):
                return factors[0]
        if self.token.kind == "name" and self.token.text not in FUNCTIONS:
            self.descend()
            factors += self.word(self.tokens[self.index - 1].text)
            self.depth -= 1
        if not factors:
            raise unreadable(f"`{function}` needs its argument in brackets", f"write `{function}(...)`")
        if self.token.text == "t" and factors[-1] != tree.Name("t"):
            self.advance()
            factors.append(tree.Name("t"))
        argument = product_of(factors)
        last = factors[-1]
        is_angle = isinstance(last, tree.Name) and (_ANGLE.match(last.name) or last.name == "t")
        behind = self.token.kind == "name" and self.token.text not in FUNCTIONS and not is_angle
        divided = self.token.text == "/" and self.tokens[self.index + 1].kind == "number"
        if self.token.text == "^" or (len(factors) > 1 if function == "sqrt" else behind or divided):
            first = written(tree.Call(function, (argument,)))
            hint = f"write `{first}`, or brackets around all of the argument"[:200]
            raise unreadable(f"`{function}` without brackets can be read in two ways", hint)
        return argument

    def misplaced(self, hint: str | None = None) -> ExpressionError:
        """What is wrong with the token that no rule of the grammar can use here."""
        here, before = self.token, self.tokens[self.index - 1] if self.index else None
        if here.kind == "end":
            return unreadable("the formula ends too early")
        if here.kind == "number" and before is not None and before.kind != "operator":
            return unreadable(f"no sign before `{here.text[:24]}`")
        if here.text == ")":
            return unreadable("`)` closes nothing")
        return unreadable(f"unexpected `{here.text[:24]}`")
