r"""What people type as answers: formulas in a question's own letters, and what stands around them.

    words = Words(["m", "g", "z", "p_theta", "theta"])
    expressions(r"\frac{p_\theta^2}{2m} + mgz", words)      # [the tree of p_theta**2/(2*m) + m*g*z]
    judged_member("H = T + V = p^2/(2 m)")                  # ("p^2/(2 m)", ["H", "T + V"])
    judged_member("x = 3 or x = 5")                         # ExpressionError: two answers
    undecorated("The answer is **3.12** (3 s.f.).")         # "3.12"

Beside the grammar of `parser`: LaTeX, square brackets, decimal commas, `dx/dt`, primes, and a name and `=` in
front. No text is given to anything that could run it.
"""

from __future__ import annotations

import re

from rigidcli.errors import ExpressionError
from rigidcli.language import tree
from rigidcli.language.latex import plain
from rigidcli.language.parser import RATE, of_tokens
from rigidcli.language.tokens import tokenize
from rigidcli.language.words import CALLED, Words

# --- decoration: what no judge reads

LONGEST_DECORATED = 4000
"""The most characters of an answer that anybody decorates: patterns take long for more."""

DECIMAL = r"(?:\d*[.,]\d+|\d+\.?)"
"""The pattern of a decimal number as people type it, without a sign and a power of ten."""

QUOTES = '"“”„‟«»`″'
_PAIRS = {"'": "'", "‘": "’", "‚": "‘", "‹": "›"}

_BEFORE = re.compile(
    r"""(?xi) \s* (?:
      (?:so|thus|hence|therefore|also|donc|somit|daher)\b [,:]?
    | (?:(?:my|the|our|die|das|la|le|el|final)\s+)* (?:answer|ans|result|solution|ergebnis|antwort
        |lösung|réponse|rép|résultat|respuesta|resultado|solución|risposta|risultato)\b
        \.? \s* (?:is|ist|est|es|lautet)?\b
        (?:\s+(?:approximately|about))? \s* [:=]?
    | (?:it|this|that|that's|it's|das|es|c'est) \s+ (?:is|ist|equals)\b | it's\b | c'est\b
    | (?:[^\W\d_]+['’]?\s+){1,7} (?:is|ist|est|es|beträgt|vaut|vale|equals|be|are|sind|sont|son|gives
        |lauten|è) \s+
        (?=(?:about|approximately|roughly|etwa|ca\.?|environ|circa)?\s*[-+~≈]?\s*[\d([{√\\.]|sqrt)
    | (?:(?!in\b)[^\W\d_]+\s+){1,6} [^\W\d_]+ \s* : \s* (?=[-+~≈]?\s*[\d(]) (?=[^:=]*\Z)
    | (?:i|we) \s+ (?:get|got|find|found|obtain|have)\b
    | (?:gives|yields|ergibt|donne|i\s+think|probably|wahrscheinlich|vermutlich|probablement) \s+
        (?=[-+~≈]?\s*[\d.])
    | (?:about|approximately|approx|around|roughly|circa|ca|etwa|ungefähr|ungefaehr|rund|environ|env
        |unos|aproximadamente|aprox|nearly|almost|à\ peu\ près|más\ o\ menos|c(?=\.\s))\b \.?
    | (?:[•▪‣] | · \s | \* \s+) (?=\S)
    | \#+ \s
    | [≈~≃≅∼∴] | => | [⇒→⟶] | -{1,2}>
    ) \s*"""
)
_BEHIND = re.compile(
    r"""(?xi) \s* (?:
      [(\[] \s* (?: (?:to\s+|auf\s+)? \d \s* (?: s\.?\s*f\.?
        | sig\.?(?:nificant)?\s*fig(?:ure)?s?\.? | d\.?\s*p\.? | decimals?
        | decimal\s+places? | gültige\s+ziffern | stellen | c\.?\s*s\.? )
        | approx(?:\.|imately)? | about | rounded | gerundet | arrondi | ca\.? | exact(?:ly)?
        | SI(?:\s+units)? ) \s* [)\]]
    | [(\[] \s* (?: exact(?:ly)? | i\.e\.? | unrounded | [≈=] ) [^()\[\]]* [)\]]
    | \s (?:to\s+) \d \s* (?: s\.?\s*f\.? | sig\.?\s*figs?\.? | significant\s+figures | decimal\s+places? )
    | \s (?:approx(?:\.|imately)? | rounded | gerundet)
    | [:;]-?[)D] | [\u2600-\u27bf\U0001f300-\U0001faff\ufe0f]+
    | (?<=[^\s.\\]) (?<!right) [.!]+ | (?<!\\) [,;]
    ) \s* \Z"""
)
_UNIT_AHEAD = re.compile(
    r"(?:[^\d:=,;()]*\s)?in\s+(?P<unit>[^\W\d_][\w^/·*²³ -]{0,15})\s*[:=]\s*(?P<value>[^:=]*[\d)\]}])",
    re.DOTALL,
)
"""A unit in front: `E in J: 12.5`."""

_COUNTED = re.compile(r"\s*\(?(?P<label>[a-h]|i{1,3}|iv|[1-9])[.)]\s+", re.IGNORECASE)
"""What stands before the parts of an answer: `a)`, `(1)`, `2.`, `iii)`."""

_SEQUENCES = ("a", "b", "c", "d", "e", "f", "g", "h"), ("i", "ii", "iii", "iv"), tuple("123456789")

_UNIT = r"[^\W\d_][\w^/. ·*²³⁻-]*?"
_UNCERTAINTY = re.compile(
    rf"(?P<open>\()?(?P<value>\d[\d.,]*(?:[eE][-+]?\d+)?(?P<unit>\s*{_UNIT})?)\s*(?:±|\+/?[-−]|-/?\+|\\pm)\s*"
    rf"{DECIMAL}(?:\s*%)?(?(unit)(?:\s*{_UNIT}(?=\s*\)?\s*\Z))?)\s*(?(open)\)|(?![\w(]*\())"
)

_TAG = re.compile(r"</?(?:br|p|b|i|em|strong|div|span)\b[^<>]*>|&nbsp;")


def undecorated(text: str) -> str:
    """An answer without quotes, bold marks, `the answer is`, `about` and the like."""
    before = ""
    text = text.strip()
    if len(text) > LONGEST_DECORATED:
        return text
    if "<" in text or "&" in text:  # from an editor in a browser
        text = re.sub(r"<sup>(.*?)</sup>", r"^(\1)", re.sub(r"<sub>(.*?)</sub>", r"_\1", text))
        text = _TAG.sub(" ", text).strip()
    text = without_labels(text)
    if ahead := _UNIT_AHEAD.fullmatch(text):
        text = f"{ahead['value']} {ahead['unit'].strip()}"
    while text != before:
        before = text
        if text.startswith(("**", "__")) and text.count(text[:2]) > 1:
            text = text[2:].replace(text[:2], "", 1)
        if len(text) > 2 and text[0] == text[-1] and text[0] in "*_" and text.count(text[0]) == 2:
            text = text[1:-1]
        if text[:1] in QUOTES or (text[-1:] in QUOTES and not re.search(r"\d\s*[\"″]\Z", text)):
            text = text.strip(QUOTES)
        if len(text) > 1 and _PAIRS.get(text[0]) == text[-1]:
            text = text[1:-1]
        text = _BEHIND.sub("", text)
        begun = _BEFORE.match(text)
        text = (text if begun is None or begun.end() == len(text) else text[begun.end() :]).strip()
    return text


def without_labels(text: str) -> str:
    """A text without bullets or labels before all its lines: `1) 3` and `2) 5` are `3` and `5`.

    Labels count the lines. One line alone has a label only if its bracket has no partner, as in `a) 3`.
    """
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if len(lines) > 1 and all(line[:2] in ("- ", "* ", "• ") for line in lines):
        return "\n".join(line[2:].strip() for line in lines)
    matches = [match for line in lines if (match := _COUNTED.match(line))]
    labels = tuple(match["label"].lower() for match in matches)
    is_counted = any(labels == each[: len(labels)] for each in _SEQUENCES)
    if not labels or len(labels) < len(lines) or not is_counted:
        return text
    if len(lines) == 1 and ("(" in matches[0][0] or ")" not in matches[0][0]):
        return text
    return "\n".join(line[match.end() :] for line, match in zip(lines, matches, strict=True))


def without_uncertainty(text: str) -> str:
    """A number without the uncertainty behind it: `(3.12 ± 0.02) m` is `3.12 m`."""
    return _UNCERTAINTY.sub(lambda match: f"{match['value']} ", text)


# --- names, signs of equality and other answers around a formula: plain texts, as `latex.plain` leaves them

TWO_ANSWERS = "two answers: give one"

_WORD = r"[^\W\d]\w*'{0,2}"
_LABEL = re.compile(
    rf"\s*[|<]?\s*(?:d\s*/\s*d\s*t\s*)?{_WORD}(?:[ \t]+{_WORD})*"
    r"(?:\s*/\s*d\s*t)?(?:\s*[(\[][^()\[\]]*[)\]])?\s*[|>]?\s*"
)
"""A name before `=`: `omega`, `H(x, p)`, `dx/dt`, `the slow rate`."""

_EQUALS = re.compile(r"(?<![<>=!]):?==?(?![>=])")
_IMPLIES = re.compile(r"=>|->")
_OR = re.compile(r"(?i)(?<=[\w)\].'])\s+(?:or|oder|ou|and|und|et)\s+|\s(?:y|[|/])\s+(?=[^\W\d][^=]*=)")
_NEXT = re.compile(rf"[\n;]|[,.]\s+(?={_LABEL.pattern}:?=)")
_SECOND = re.compile(rf"(?P<value>.*[\w)\]}}°%])\s+(?P<name>{_WORD}(?:\([\w, ]*\))?)\s*", re.DOTALL)
_CONSTANT = re.compile(r"\s*(?:const|konst|konstant|constante?|cste|cte)\.?\s*", re.IGNORECASE)
"""What may be said of a value behind a last `=`: `E = 12.5 J = const.`"""

_LEADS_TO = re.compile(rf"\A(\s*{_WORD}(?:\([\w, ]*\))?\s*)(?:->|=>)(?=[^=]*\Z)")
"""An arrow in the place of `=` behind a name."""

_OPEN, _CLOSE = "([{", ")]}"
_BRACKET = re.compile(r"[()\[\]{}]")


def two_answers() -> ExpressionError:
    """The error for several answers where one is asked."""
    return ExpressionError(TWO_ANSWERS, code="wrong_shape")


def is_label(side: str) -> bool:
    """Whether a side of `=` only names what follows: `H(x, p)`, `the slow rate`."""
    return _LABEL.fullmatch(side) is not None and not any(
        re.search(rf"\b{name}\b", side) for name in CALLED if name in side
    )


def without_brackets(text: str) -> str:
    """The text with `_` for each character in brackets: of the same length, so that places stay valid."""
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
    """The text cut where the pattern stands outside of brackets."""
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
    """Of `3 fast`, as in `slow = 3 fast = 5`, the `3`: the name behind it may begin a second answer."""
    match = _SECOND.fullmatch(member)
    return match["value"] if match else None


# --- formulas

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
    formula = slopes(formula.translate(POINTS))
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
