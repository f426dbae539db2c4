"""What stands around the formula of an answer: a name and `=`, a chain of equalities, several answers.

    judged_member("H = T + V = p^2/(2 m)")      # ("p^2/(2 m)", ["H", "T + V"])
    judged_member("x = 3 or x = 5")             # ExpressionError: two answers

Texts are plain, as `latex.plain` leaves them.
"""

from __future__ import annotations

import re

from rigidcli.errors import ExpressionError
from rigidcli.language.functions import CALLED

TWO_ANSWERS = "two answers: give one"

_NAME = r"[^\W\d]\w*'{0,2}"
_LABEL = re.compile(
    rf"\s*[|<]?\s*(?:d\s*/\s*d\s*t\s*)?{_NAME}(?:[ \t]+{_NAME})*"
    r"(?:\s*/\s*d\s*t)?(?:\s*[(\[][^()\[\]]*[)\]])?\s*[|>]?\s*"
)
"""A name before `=`: `omega`, `H(x, p)`, `dx/dt`, `the slow rate`."""

_EQUALS = re.compile(r"(?<![<>=!]):?==?(?![>=])")
_IMPLIES = re.compile(r"=>|->")
_OR = re.compile(r"(?i)(?<=[\w)\].'])\s+(?:or|oder|ou|and|und|et)\s+|\s(?:y|[|/])\s+(?=[^\W\d][^=]*=)")
_NEXT = re.compile(rf"[\n;]|[,.]\s+(?={_LABEL.pattern}:?=)")
_SECOND = re.compile(rf"(?P<value>.*[\w)\]}}°%])\s+(?P<name>{_NAME}(?:\([\w, ]*\))?)\s*", re.DOTALL)
_CONSTANT = re.compile(r"\s*(?:const|konst|konstant|constante?|cste|cte)\.?\s*", re.IGNORECASE)
"""What may be said of a value behind a last `=`: `E = 12.5 J = const.`"""

_LEADS_TO = re.compile(rf"\A(\s*{_NAME}(?:\([\w, ]*\))?\s*)(?:->|=>)(?=[^=]*\Z)")
"""An arrow in the place of `=` behind a name."""

_OPEN, _CLOSE = "([{", ")]}"
_BRACKET = re.compile(r"[()\[\]{}]")


def two_answers() -> ExpressionError:
    """What is wrong with a text that gives several answers where one is asked."""
    return ExpressionError(TWO_ANSWERS, code="wrong_shape")


def is_label(side: str) -> bool:
    """Whether a side of an equation is a name, or words, and no formula."""
    return _LABEL.fullmatch(side) is not None and not any(
        re.search(rf"\b{name}\b", side) for name in CALLED if name in side
    )


def without_brackets(text: str) -> str:
    """The text with a filler in the place of all that stands in brackets, so that places stay."""
    masked, depth, begin = "", 0, 0
    for bracket in _BRACKET.finditer(text):
        sign, place = bracket[0], bracket.start()
        masked += "_" * (place - begin) if depth else text[begin:place]
        depth = max(0, depth - (sign in _CLOSE))
        masked += "_" if depth else sign
        depth += sign in _OPEN
        begin = place + 1
    return text if depth else masked + text[begin:]


def cut(text: str, between: re.Pattern[str]) -> list[str]:
    """The pieces of a text between the places where a pattern stands outside of brackets."""
    if not between.search(text):
        return [text]
    pieces, begin = [], 0
    for match in between.finditer(without_brackets(text)):
        pieces.append(text[begin : match.start()])
        begin = match.end()
    return [*pieces, text[begin:]]


def members(text: str) -> list[str]:
    """The members of a chain of equalities, of which the first may be a name."""
    return cut(text, _EQUALS)


def judged_member(text: str) -> tuple[str, list[str]]:
    """The last member of a chain of equalities, and the members before it.

    A text may say the same name again, in lines or behind `=>`. Raises ExpressionError for several answers.
    """
    text = _LEADS_TO.sub(r"\1=", text)
    if not re.search(r"=|\b(?:or|oder|ou|and|und|et)\b", text, re.IGNORECASE):
        return text, []
    if len(cut(text, _OR)) > 1:
        raise two_answers()
    *reasons, conclusion = cut(text, _IMPLIES)
    statements = [piece for piece in cut(conclusion, _NEXT) if piece.strip()] or [conclusion]
    chain, name = members(statements[0]), ""
    for statement in statements[1:]:
        first, *others = members(statement)
        name = name or chain[0].strip()
        if not others or (first.strip() and first.strip() != name):
            raise two_answers()
        chain += others
    for reason in reasons:
        first = members(reason)[0].strip()
        if is_label(first) and "=" in reason and first != chain[0].strip():
            raise two_answers()
    if len(chain) > 1 and _CONSTANT.fullmatch(chain[-1]):
        chain.pop()
    return chain[-1], chain[:-1]


def second_name(member: str) -> str | None:
    """What stands before the last name of a member between two `=`: that name may begin a second answer."""
    match = _SECOND.fullmatch(member)
    return match["value"] if match else None
