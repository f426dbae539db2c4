r"""What people type as answers: formulas in a question's own letters.

    words = Words(["m", "g", "z", "p_theta", "theta"])
    expressions(r"\frac{p_\theta^2}{2m} + mgz", words)      # [the tree of p_theta**2/(2*m) + m*g*z]

Beside the grammar of `parser`: LaTeX, square brackets, decimal commas, `dx/dt`, primes, and a name and `=` in
front. No text is given to anything that could run it.
"""

from __future__ import annotations

import re

from rigidcli.language import tree
from rigidcli.language.latex import plain
from rigidcli.language.parser import RATE, of_tokens
from rigidcli.language.statements import is_label, judged_member, members, two_answers
from rigidcli.language.tokens import tokenize
from rigidcli.language.words import Words

_COLON = re.compile(r"\s*(?!\d)[\w']+(?:\s*\([\w',\s]*\))?\s*:(?!=)|\s*[~=]")
"""A name and a colon before the answer, as in `H:` and `H(x, p):`; or the sign of `~20.8`."""
_END = re.compile(r"(?<![\d\s])\.\s*\Z|[;,\s]+\Z")
_NAME = r"[^\W\d]\w*+"
_SLOPE = re.compile(
    rf"\bd\s*(?P<second>\^\s*2|2(?=\s*[\(\w]))?\s*(?:(?P<name>{_NAME})|\(\s*(?P<inner>{_NAME})\s*\))"
    rf"\s*/\s*(?P<open>\()?\s*d\s*(?:t|\(\s*t\s*\))\s*(?:\^?\s*2)?\s*(?(open)\))(?!\w)"
    rf"|(?P<opened>\()?\s*\bd\s*/\s*d\s*t\b\s*(?(opened)\))\s*(?P<bracket>\()?\s*(?P<behind>{_NAME})\s*(?(bracket)\))"
)
"""`dx/dt`, `d^2 x/dt^2`, `d(theta)/dt`, `d/dt x`."""

_PRIMED = re.compile(rf"({_NAME})('{{1,2}}|\")(?:\(t\))?")
_PROGRAMS = re.compile(
    r"\b(?:np|numpy|[Mm]ath|sp|sympy)\.(?=[a-zP])|\b((?:Arc|arc|ARC)?(?:Sin|Cos|Tan|SIN|COS|TAN)[hH]?"
    r"|Sqrt|SQRT|Exp|EXP|Log|LOG|Ln|LN|Abs|ABS)(?=\s*[\[(])"
)
"""Functions as programs write them: `np.sqrt(x)`, `Cos[x]`, `SQRT(x)`."""

_BY_TIME = r"t\s*(?:(?P<twice>,\s*[t2]|\$\s*2)\s*)?|\(t,\s*(?P<second>2)\)"
_OF_PROGRAMS = re.compile(
    rf"'?\b(?:[dD]iff|D|Derivative)\s*\(\s*(?P<of>{_NAME})(?:\(t\))?\s*,\s*(?:{_BY_TIME})\s*\)"
)
"""`diff(x(t), t)`, `D(x, t)` and `Derivative(x, (t, 2))`."""

_ELEMENTWISE = re.compile(r"(?<=[\w)\]])\s*\.(?=[*/^])|%(?=(?:e|pi)\b)|@\([\w, ]*\)")
"""Signs of Matlab and Maxima without a meaning here: `p.^2`, `%pi`, `@(x)`."""

_EITHER_SIGN = re.compile(r"\s*(?:\+/?-|-\+)")
_PI = re.compile(r"\b(?:Pi|PI)\b")

POINTS = str.maketrans("[]", "()")
"""Square brackets are parentheses."""


def expressions(text: str, words: Words | None, *, leading: bool = True) -> list[tree.Node]:
    """The readings of a formula in these words, the most usual first; without words, a name is taken whole.

    A name and `=` may be `leading`; of a chain of equalities this is the last member.

    Raises:
        ExpressionError: the text is no formula. Its `code` is `unknown_symbol` for a name that the question
            does not have, `too_large` beyond the bounds.
    """
    formula = _PROGRAMS.sub(lambda call: (call[1] or "").lower().replace("arc", "a"), plain(text))
    if leading:
        formula, before = last_member(formula)
        is_named = re.fullmatch(rf"\s*{_NAME}\s*", formula) and words is not None
        if (
            before
            and is_named
            and words
            and not (words.meaning(formula.strip()) or words.products(formula.strip()))
        ):
            formula = before[-1]  # `... = E` names the result
    formula = slopes(formula).translate(POINTS)
    if _EITHER_SIGN.match(formula):
        raise two_answers()
    formula = _PI.sub(lambda sign: sign[0] if words and words.products(sign[0]) else "pi", formula)
    return of_tokens(tokenize(formula, as_typed=False), {}, words)


def last_member(text: str) -> tuple[str, list[str]]:
    """The last member of a chain of equalities in a plain text, without a final dot, and those before it.

    A name and a colon, or a sign that says `about`, may stand in front. Raises ExpressionError.
    """
    text = re.sub(r"\s*\n\s*(?==(?!>))|(?<=[^<>]=)\s*\n\s*", " ", text)
    last, before = judged_member(_begun(re.sub(r"(?<=\w)\s*~\s*(?=[-+.\d])", " = ", text)))
    return _END.sub("", last), before


def unnamed(text: str) -> str:
    """A plain text without the name, the sign and other members before the answer, and its final dot."""
    begun = _begun(text)
    name, *others = members(begun)
    return _END.sub("", (others[-1].strip() if others and is_label(name) else "") or begun)


def _begun(text: str) -> str:
    leading = _COLON.match(text)
    return text if leading is None else text[leading.end() :]


def slopes(text: str) -> str:
    """A plain text with `xdot` for `dx/dt` and `x'`, and with points for decimal commas."""
    text = _SLOPE.sub(
        lambda match: (
            f" {match['name'] or match['inner'] or match['behind']}{'ddot' if match['second'] else 'dot'} "
        ),
        text,
    )
    text = re.sub(r"\bd\s*/\s*d\s*t\s*(?=[(\[])", f" {RATE}", text)
    text = _OF_PROGRAMS.sub(
        lambda match: f" {match['of']}{'ddot' if match['twice'] or match['second'] else 'dot'} ",
        _ELEMENTWISE.sub("", text),
    )
    text = re.sub(r"(?<=\w)[- ](d?dot)\b", r"\1", re.sub(r"\bdouble[- ]dot\b", "ddot", text))
    text = re.sub(r"(?<=[a-z0-9])_?(D?Dot)\b", lambda dots: dots[1].lower(), text)
    text = re.sub(r"_?dot_?dot\b", "ddot", text)
    text = _PRIMED.sub(lambda match: f"{match[1]}{'dot' if match[2] == chr(39) else 'ddot'} ", text)
    return text if re.search("atan2|pow|POW|Pow", text) else re.sub(r"(?<=\d),(?=\d)", ".", text)
