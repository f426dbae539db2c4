"""Text to tokens: the alphabet of the expression language.

Greek letters, superscripts, the fractions of Latin-1, the minus sign, the root sign and the middle dots
turn into their ASCII spelling here, so nothing behind the tokens ever sees another character; a column
still counts in the text as typed.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

from rigidcli.errors import ExpressionError
from rigidcli.language.numerals import UNSIGNED
from rigidcli.language.words import table

MAX_TEXT = 20_000  # the most characters of an expression, so that it is read in well under a second
# The most digits of one number and of its power of ten, so that its exact fraction stays small.
MAX_DIGITS, MAX_EXPONENT_DIGITS = 400, 4
# The names of the Greek letters, in their order; those of capitals begin with one.
GREEK = [
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda", "mu",
    "nu", "xi", "omicron", "pi", "rho", "sigma", "tau", "upsilon", "phi", "chi", "psi", "omega",
]  # fmt: skip
GREEK_LETTERS = (
    dict(zip("αβγδεζηθικλμνξοπρστυφχψω", GREEK, strict=True))
    | dict(zip("ΑΒΓΔΕΖΗΘΙΚΛΜΝΞΟΠΡΣΤΥΦΧΨΩ", map(str.capitalize, GREEK), strict=True))
    | {"ϑ": "theta", "ϕ": "phi", "ϵ": "epsilon", "ϱ": "rho", "ς": "sigma"}
)

_FRACTIONS = "¼½¾⅕⅖⅗⅘⅛⅜⅝⅞"  # those that are decimal numbers
_OPERATORS = {"^": "**", "\N{MINUS SIGN}": "-", "\N{MIDDLE DOT}": "*", "\N{DOT OPERATOR}": "*"}
_NAMED = GREEK_LETTERS | {"\N{MICRO SIGN}": "mu"}
_LETTER = "A-Za-z_" + "".join(_NAMED)
SUPERSCRIPT = "⁻?[⁰¹²³⁴-⁹]+"  # the pattern of a whole number that is written as an exponent
LOWERED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")  # from superscripts to what they are on the line
# The ASCII spelling of each character beyond ASCII, and the sign of powers.
_SPELLED = str.maketrans(
    _NAMED
    | _OPERATORS
    | {fraction: str(unicodedata.numeric(fraction)) for fraction in _FRACTIONS}
    | {"°": "deg", "√": "sqrt", "∛": "cbrt"}
)
_KINDS = {"degree": "name", "fraction": "number"}
_TOKEN = re.compile(
    rf"""[ \t\r\n]*+  # possessive: a blank is never tried again as another token
    (?: (?P<number> {UNSIGNED} )
      | (?P<name> [{_LETTER}][{_LETTER}0-9]* )
      | (?P<degree> ° )
      | (?P<operator> \*\* | [-+*/(),|{"".join(_OPERATORS)}] )
      | (?P<root> √³? | ∛ | (?<![\w)])³√ )
      | (?P<superscript> {SUPERSCRIPT} )
      | (?P<fraction> [{_FRACTIONS}] )
      | (?P<end> \Z )
      | (?P<stranger> . )
    )""",
    re.VERBOSE | re.DOTALL,
)

# What to write in the place of signs that the language does not have.
_HINTS = {sign: hint for signs, hint in table(__file__, "signs.tsv") for sign in signs}


# Notations, each a pattern with what is read in its place.
Rules: TypeAlias = Sequence[tuple[re.Pattern[str], str | Callable[[re.Match[str]], str]]]


def rules(*notations: tuple[str, str | Callable[[re.Match[str]], str]]) -> Rules:
    """The notations with their patterns compiled."""
    return [(re.compile(pattern), instead) for pattern, instead in notations]


def rewritten(text: str, notations: Rules) -> str:
    """The text with each notation in turn replaced by what it stands for."""
    for pattern, instead in notations:
        text = pattern.sub(instead, text)
    return text


class Token(NamedTuple):
    """A piece of an expression; `column` counts characters from 1."""

    kind: str  # `number`, `name`, `operator`, `stars` (those of a power), `superscript`, `root` or `end`
    text: str
    column: int | None
    touches: bool  # whether there is no blank between it and the token before it


def tokenize(text: str, *, as_typed: bool = True) -> list[Token]:
    """The tokens of a text, the last of them the `end`; without columns if the text is not `as_typed`.

    Raises ExpressionError: the text or one of its numbers is too long, or a character is not in the language.
    """
    if len(text) > MAX_TEXT:
        message = f"an expression has at most {MAX_TEXT} characters, this has {len(text)}"
        raise ExpressionError(message, code="too_large")
    tokens = []
    for match in _TOKEN.finditer(text):
        group = match.lastgroup or "end"
        column = match.start(group) + 1 if as_typed else None
        if group == "stranger":
            sign = match[group]
            shown = f"`{sign}`" if sign != "`" else "backquote"
            if not (sign.isascii() and sign.isprintable()):  # any terminal shows its number and name
                shown = f"character U+{ord(sign):04X} {unicodedata.name(sign, '')}".rstrip()
            raise ExpressionError(f"unexpected {shown}", column=column, hint=_HINTS.get(sign))
        kind, piece = _KINDS.get(group, group), match[group].translate(_SPELLED)
        if group in ("number", "superscript"):
            piece = piece.translate(LOWERED)
            _check_number(piece, column)
        elif group == "root":
            piece = "cbrt" if "³" in piece else piece
        elif match[group] == "**":
            kind = "stars"
        tokens.append(Token(kind, piece, column, match.start() == match.start(group)))
        if kind == "end":  # past blanks the pattern would find the end once more
            break
    return tokens


def _check_number(piece: str, column: int | None) -> None:
    digits, _, exponent = piece.lower().partition("e")
    for part, most, name in (
        (digits, MAX_DIGITS, "a number"),
        (exponent.lstrip("+-"), MAX_EXPONENT_DIGITS, "the power of ten of a number"),
    ):
        if len(part) > most:
            raise ExpressionError(f"{name} has at most {most} digits", column=column, code="too_large")
