r"""The one reader of what people type: formulas in a question's own letters.

    words = Words(["m", "g", "z", "p_theta", "theta"])
    expression(r"\frac{p_\theta^2}{2m} + mgz", words)      # the tree of p_theta**2/(2*m) + m*g*z

Beyond the language of documents: LaTeX, names that are run together (`mgz`), functions without brackets
(`sin^2 theta`), square brackets, bars, decimal commas, `dx/dt`, primes, `x(t)`, and a name and `=` in front.
What can be read in two ways is refused, and both are named. No text is given to anything that could run it.
Sums, products and factors are those of `parser`.

    atom    = number | word | function ["^" number] argument | "(" sum ")" | "|" sum "|"
    argument = "(" sum ("," sum)* ")" | [number] word ["t"]
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cached_property

from rigidcli.errors import ExpressionError, nearest, shown
from rigidcli.language import tree
from rigidcli.language.functions import ALIASES, CALLED, CONSTANTS, FUNCTIONS
from rigidcli.language.latex import plain
from rigidcli.language.parser import CLOSING, Grammar, applied, multiplied
from rigidcli.language.statements import judged_member
from rigidcli.language.text import text as written
from rigidcli.language.tokens import Token, tokenize

LONGEST_PRODUCT = 40
"""The most letters of names that are run together: more is a sentence, and no product."""

MOST_LISTED = 40
"""The most names that a message lists."""

_E = tree.Name("e")

_ANGLE = re.compile(r"(theta|phi|psi|alpha|beta|gamma|chi|vartheta)[_0-9]*")
"""Names that are the whole argument of a sine, so that `sin theta x` has one meaning."""

_LEADING = re.compile(r"\s*(?!\d)[\w']+(?:/dt|\s*\((?:[\w',\s]|dot)*\))?\s*(?::=|={1,2}|:)(?!=)|\s*[~=]")
"""A name before the answer: `H =`, `H(x, p) =`, `dx/dt =`; or the sign of `~20.8`."""
_COLON = re.compile(r"\s*(?!\d)[\w']+(?:\s*\([\w',\s]*\))?\s*:(?!=)|\s*[~=]")
_MEMBERS = re.compile(r"\A(?:[^\[{,;\n]|(?<=\d),(?=\d))*=")
_NAME = r"[^\W\d]\w*+"
_SLOPE = re.compile(
    rf"\bd\s*(?P<second>\^\s*2|2(?=\s*[\(\w]))?\s*(?:(?P<name>{_NAME})|\(\s*(?P<inner>{_NAME})\s*\))"
    rf"\s*/\s*(?P<open>\()?\s*d\s*t\s*(?:\^?\s*2)?\s*(?(open)\))(?!\w)"
    rf"|(?P<opened>\()?\s*\bd\s*/\s*d\s*t\b\s*(?(opened)\))\s*(?P<bracket>\()?\s*(?P<behind>{_NAME})\s*(?(bracket)\))"
)
"""`dx/dt`, `d^2 x/dt^2`, `d(theta)/dt`, `d/dt x`."""

_PRIMED = re.compile(rf"({_NAME})('{{1,2}}|\")(?:\(t\))?")
_POINTS = str.maketrans("[]", "()")
"""Square brackets are parentheses."""


class Words:
    """The names that an answer may hold, in all the ways in which people spell them.

    Of `spellings`, each means a name. Underscores may be left out or added where that leaves one meaning.
    `moving` are the names that depend on the time, and may be written as `x(t)`.
    """

    def __init__(
        self, names: Iterable[str], spellings: Mapping[str, str] | None = None, moving: Collection[str] = ()
    ) -> None:
        self.names = tuple(names)
        self.spellings = dict(spellings or {})
        self.moving = frozenset(moving)

    @cached_property
    def _meanings(self) -> dict[str, str]:
        """What every spelling means."""
        bare: dict[str, set[str]] = {}
        for word, name in (*((name, name) for name in self.names), *self.spellings.items()):
            bare.setdefault(word.replace("_", ""), set()).add(name)
        single = {word: meant.pop() for word, meant in bare.items() if len(meant) == 1}
        return single | self.spellings | {name: name for name in self.names}

    def meaning(self, word: str) -> str | None:
        """The name that a word is, or None."""
        meanings = self._meanings
        return meanings.get(word) or meanings.get(word.replace("_", ""))

    def products(self, word: str) -> list[tuple[str, ...]]:
        """The products of names and functions, or pi, that a word spells: at most two that differ.

        From the end of the word: what its last letters spell is a name times what is spelled behind that.
        """
        end = len(word)
        spelled: dict[int, list[tuple[str, ...]]] = {end: [()]}
        for start in reversed(range(end if end <= LONGEST_PRODUCT else 0)):
            products: dict[tuple[str, ...], tuple[str, ...]] = {}
            for cut in range(start + 1, end + 1):
                part = word[start:cut]
                meant = part if part in CALLED or part in CONSTANTS else self.meaning(part)
                if meant is None or part[0] == "_":
                    continue
                for rest in spelled[cut]:
                    products.setdefault(tuple(sorted((meant, *rest))), (meant, *rest))
            spelled[start] = list(products.values())[:2]
        return spelled.get(0, [])


def unknown(word: str, words: Words) -> ExpressionError:
    """What is wrong with a name that the question does not have."""
    near = nearest(word, words.names) if len(word) <= LONGEST_PRODUCT else None
    listed = ", ".join(f"`{name}`" for name in words.names[:MOST_LISTED]) or "none"
    more = ", ..." if len(words.names) > MOST_LISTED else ""
    message = f"read {shown(word)}" + (f" (did you mean `{near}`?)" if near else "")
    return ExpressionError(message, hint=f"the symbols are {listed}{more}", code="unknown_symbol")


def expression(text: str, words: Words | None, *, leading: bool = True) -> tree.Node:
    """The tree of a formula in these words; without words, a name is taken whole, whatever it is.

    A name and `=` may be `leading`; of a chain of equalities this is the last member.

    Raises:
        ExpressionError: the text is no formula, or can be read in two ways. Its `code` is `unknown_symbol`
            for a name that the question does not have, `too_large` beyond the bounds.
    """
    formula = plain(text)
    return _Reader(slopes(last_member(formula)[0] if leading else formula), words).whole()


def last_member(text: str) -> tuple[str, list[str]]:
    """The last member of a chain of equalities in a plain text, without a final dot, and those before it.

    A name and a colon, or a sign that says `about`, may stand in front. Raises ExpressionError.
    """
    leading = _COLON.match(text)
    last, before = judged_member(text if leading is None else text[leading.end() :])
    return re.sub(r"(?<![\d\s])\.\s*\Z|[;,\s]+\Z", "", last), before


def unnamed(text: str) -> str:
    """A plain text without the name, the sign and other members before the answer, and its final dot."""
    leading = _LEADING.match(text)
    rest = text if leading is None else _MEMBERS.sub("", text[leading.end() :])
    return re.sub(r"(?<![\d\s])\.\s*\Z|[;,\s]+\Z", "", rest)


def slopes(text: str) -> str:
    """A plain text with `xdot` for `dx/dt` and `x'`, and with points for decimal commas."""
    text = _SLOPE.sub(
        lambda match: (
            f" {match['name'] or match['inner'] or match['behind']}{'ddot' if match['second'] else 'dot'} "
        ),
        text,
    )
    text = re.sub(r"(?<=\w)-(d?dot)\b", r"\1", text)
    text = _PRIMED.sub(lambda match: f"{match[1]}{'dot' if match[2] == chr(39) else 'ddot'} ", text)
    return text if "atan2" in text else re.sub(r"(?<=\d),(?=\d)", ".", text)


class _Reader(Grammar):
    """The grammar of answers: names that are run together, functions without brackets, bars."""

    NO_COMMA = "a comma stands between arguments, or between digits"

    def __init__(self, text: str, words: Words | None) -> None:
        super().__init__(tokenize(text.translate(_POINTS), as_typed=False))
        self.words = words
        self.barred = [False]
        """Of the brackets that are open, whether they are bars: a bar then closes, and else it opens."""

    def descend(self) -> Token:
        """Pass a token that puts what follows one level deeper."""
        opening = super().descend()
        if opening.text in CLOSING:
            self.barred.append(opening.text == "|")
        return opening

    def close(self, opening: Token) -> None:
        """Pass the sign that closes what `opening` began."""
        super().close(opening)
        self.barred.pop()

    def begins_factor(self) -> bool:
        """Whether a factor without a sign begins here."""
        return super().begins_factor() or (self.token.text == "|" and not self.barred[-1])

    def further(self) -> Sequence[tree.Node]:
        """A factor without a sign, or the names that a word is the product of; a cotangent is one factor."""
        is_word, factor = self.token.kind == "name", self.factor()
        parts = factor.factors if is_word and isinstance(factor, tree.Product) else (factor,)
        return [factor] if isinstance(parts[-1], tree.Reciprocal) else parts

    def power(self, base: tree.Node, exponent: tree.Node) -> tree.Node:
        """A base with its exponent; e is the number where it is no letter of the question."""
        is_letter = self.words is None or self.words.meaning("e") is not None
        return super().power(base, exponent) if is_letter or base != _E else tree.Call("exp", (exponent,))

    def atoms(self) -> Sequence[tree.Node]:
        """A number, a bracket, a function, or the names that a word is the product of."""
        if self.token.text != "|":
            return super().atoms()
        opening = self.descend()
        inner = self.sum()
        self.close(opening)
        return [tree.Call("abs", (inner,))]

    def named(self, token: Token) -> Sequence[tree.Node]:
        """What a word means, which has been passed already."""
        parts = self.parts(token.text)
        nodes: list[tree.Node] = []
        for place, part in enumerate(parts):
            is_name = self.words is not None and self.words.meaning(part) == part
            if part in CONSTANTS and not is_name:
                nodes.append(tree.Constant(part))
            elif part in CALLED and not is_name:
                if place + 1 < len(parts):  # the rest of the word is its argument, as in `sinx`
                    inner: list[tree.Node] = [tree.Name(name) for name in parts[place + 1 :]]
                    return [*nodes, applied(token, ALIASES.get(part, part), (multiplied(inner),))]
                nodes.append(self.call(token._replace(text=part)))
            else:
                nodes.append(tree.Name(part))
        if self.is_of_time(parts[-1]):
            self.advance(3)
        return nodes

    def parts(self, word: str) -> tuple[str, ...]:
        """The names, functions and constants that a word is made of."""
        if self.words is None:
            return (word,)
        if (name := self.words.meaning(word)) is not None:
            return (name,)
        is_euler = word == _E.name and self.token.text == "**"
        if is_euler or word in CALLED or word in CONSTANTS:
            return (word,)
        ways = self.words.products(word)
        if len(ways) == 2:
            first, second = (" ".join(way) for way in ways)
            message = f"`{word}` can be read as `{first}` and as `{second}`"
            raise ExpressionError(message, hint="put blanks or `*` between names")
        if not ways:
            raise unknown(word, self.words)
        return ways[0]

    def is_of_time(self, name: str) -> bool:
        """Whether `(t)` follows a name that depends on the time."""
        following = [token.text for token in self.tokens[self.index : self.index + 3]]
        is_moving = self.words is None or name in self.words.moving
        touches = self.token.touches or name.endswith("dot")
        return following == ["(", "t", ")"] and touches and is_moving

    def call(self, token: Token) -> tree.Node:
        """A function, whose name has been passed already, perhaps with a power, and its arguments."""
        function = token.text
        power = self.exponent() if self.token.text == "**" else None
        if power == tree.Negative(tree.Number("1", 1.0)):
            if f"a{function}" not in FUNCTIONS:
                message = f"the inverse of `{function}` is not clear"
                raise ExpressionError(message, hint=f"write `1/{function}(...)`")
            function, power = f"a{function}", None
        function = ALIASES.get(function, function)
        arguments = self.arguments() if self.token.text == "(" else (self.bare(function),)
        node = applied(token, function, arguments)
        return node if power is None else tree.Power(node, power)

    def bare(self, function: str) -> tree.Node:
        """The argument of a function without brackets: `2 theta`, `omega t`, `kx`."""
        factors: list[tree.Node] = []
        if self.token.kind == "number":
            factors += self.atoms()
            if function == "sqrt" and not (self.token.kind == "name" and self.token.touches):
                return factors[0]
        if self.token.kind == "name" and self.token.text not in CALLED:
            factors += self.named(self.descend())
            self.depth -= 1
        if not factors:
            message = f"`{function}` needs its argument in brackets"
            raise ExpressionError(message, hint=f"write `{function}(...)`")
        if self.token.text == "t" and factors[-1] != tree.Name("t"):
            self.advance()
            factors.append(tree.Name("t"))
        argument = multiplied(factors)
        last = factors[-1]
        is_angle = isinstance(last, tree.Name) and (_ANGLE.match(last.name) or last.name == "t")
        behind = self.token.kind == "name" and self.token.text not in CALLED and not is_angle
        divided = self.token.text == "/" and self.tokens[self.index + 1].kind == "number"
        if self.token.text == "**" or (len(factors) > 1 if function == "sqrt" else behind or divided):
            first = written(tree.Call(function, (argument,)))
            hint = f"write `{first}`, or brackets around all of the argument"[:200]
            raise ExpressionError(f"`{function}` without brackets can be read in two ways", hint=hint)
        return argument
