r"""What people type as answers: formulas in a question's own letters, and what stands around them.

    words = Words(["m", "g", "z", "p_theta", "theta"])
    expressions(r"\frac{p_\theta^2}{2m} + mgz", words)      # [the tree of p_theta**2/(2*m) + m*g*z]
    statements("x = 2 a = 3; y = 5")                        # [["x ", " 2 a ", " 3"], [" y ", " 5"]]
    last_member("H = T + V = p^2/(2 m)")                    # (" p^2/(2 m)", ["H", " T + V "])
    last_member("x = 3 or x = 5")                           # ExpressionError: two answers
    undecorated("The answer is **3.12** (3 s.f.).")         # "3.12"

Beside the grammar of `parser`: LaTeX, square brackets, decimal commas, `dx/dt`, primes, and a name and `=` in
front. No text is given to anything that could run it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress

from rigidcli.errors import ExpressionError
from rigidcli.language import tree
from rigidcli.language.latex import plain
from rigidcli.language.parser import RATE, of_tokens
from rigidcli.language.tokens import GREEK, rewritten, rules, tokenize
from rigidcli.language.words import CALLED, Words, in_digits, said

# --- decoration: what no judge reads

# The most characters of an answer that anybody decorates: patterns take long for more.
LONGEST_DECORATED = 4000
# The pattern of a decimal number as people type it, without a sign and a power of ten.
DECIMAL = r"(?:\d*[.,]\d+|\d+\.?)"
QUOTES = '"“”„‟«»`″'
# A word of a sentence, such as `tension` and `d'inertie`.
_WORDS_AHEAD = r"[^\W\d_]+(?:['’][^\W\d_]+)?['’]?"
_BEFORE = rf"""(?xi) \A (?> \s* (?:
      {said("so")} [,:]?
    | (?:{said("article")}\s+)* {said("answer")} \.? \s* {said("is")}? (?:\s+{said("about")})? \s* [:=]?
    | {said("it")} \s+ {said("is")} | it's\b | c'est\b
    | (?:{_WORDS_AHEAD}\s+){{1,7}} {said("is")} \s+ (?={said("about")}?\.?\s*[-+~≈]?\s*[\d([{{√\\.$]|sqrt)
    | (?:{_WORDS_AHEAD}\s+){{2,7}} {said("is")} \s+ (?!{said("a", "article")})
        (?=[-+]\s*[^\W\d]|[^\W\d]{{1,2}}(?:[_^(*/²³]|\s*[*/^]))
    | (?:(?!in\b){_WORDS_AHEAD}\s+){{1,6}} {_WORDS_AHEAD}(?:_\w+)? \s* : \s*
        (?=[-+~≈]?\s*[\d([\\]) (?=[^:=]*\Z)
    | [a-z] \s+ {said("is")} \s+ (?=\S)
    | (?:i|we) \s+ {said("get")}
    | {said("gives", "believe")} \s+ (?=[-+~≈]?\s*[\d.])
    | (?: {said("about")} | c(?=\.\s) | {said("nearly")}(?=\s+[-+~]?(?:[\d.(√\\]|sqrt)) ) \.?
    | (?:[•▪‣] | · \s | \* \s+) (?=\S)
    | \#+ \s
    | [≈~≃≅∼∴] | => | [⇒→⟶] | -{{1,2}}>
    ) \s* ) (?!\Z)"""
_BEHIND = rf"""(?xi) \s* (?:
      [(\[] \s* (?: (?:to\s+|auf\s+)? \d \s* (?: s\.?\s*f\.?
        | sig\.?(?:nificant)?\s*fig(?:ure)?s?\.? | d\.?\s*p\.? | decimals?
        | decimal\s+places? | gültige\s+ziffern | stellen | c\.?\s*s\.? )
        | {said("about", "rounded")} \.? | SI(?:\s+units)? ) \s* [)\]]
    | [(\[] \s* (?: exact(?:ly)? | i\.e\.? | unrounded | [≈=] ) [^()\[\]]* [)\]]
    | \s (?:to\s+) \d \s* (?: s\.?\s*f\.? | sig\.?\s*figs?\.? | significant\s+figures | decimal\s+places? )
    | \s (?:approx(?:imately)? | rounded | gerundet) \.?
    | [“”„‟«»`] | (?<=[^\s\d]) \s* ["″]  # 3" are seconds of arc
    | [:;]-?[)D] | [\u2600-\u27bf\U0001f300-\U0001faff\ufe0f]+
    | (?<=[^\s.\\]) (?<!right) [.!]+ | \s!+ | (?<!\\) [,;]
    ) \s* \Z"""
# What stands before the parts of an answer: `a)`, `(1)`, `2.`, `iii)`.
_COUNTED = re.compile(r"\s*\(?(?P<label>[a-h]|i{1,3}|iv|[1-9])[.)]\s+", re.IGNORECASE)
_SEQUENCES = ("a", "b", "c", "d", "e", "f", "g", "h"), ("i", "ii", "iii", "iv"), tuple("123456789")

_DRESS = rules(
    (r"<sub>(.*?)</sub>", r"_\1"),
    (r"<sup>(.*?)</sup>", r"^(\1)"),
    (r"</?(?:br|p|b|i|em|strong|div|span)\b[^<>]*>|&nbsp;", " "),
    (  # a unit in front: `E in J: 12.5`
        r"(?s)\A\s*(?:[^\d:=,;()]*\s)?in\s+([^\W\d_][\w^/·*²³ -]{0,15}?)\s*[:=]\s*([^:=]*[\d)\]}])\s*\Z",
        r"\2 \1",
    ),
    (r"(?s)\A(\*\*|__)(.*?)\1", r"\2"),  # bold in Markdown
    (r"(?s)\A([*_])((?:(?!\1).)+)\1\Z", r"\2"),  # italic
    (rf"(?s)\A[{QUOTES}]+(.*?)[{QUOTES}]*\Z", r"\1"),
    (r"(?s)\A(?:'(.*)'|‘(.*)’|‚(.*)‘|‹(.*)›)\Z", r"\1\2\3\4"),
    (_BEHIND, ""),
    (_BEFORE, ""),
)


def undecorated(text: str) -> str:
    """An answer without quotes, bold marks, `the answer is`, `about` and the like."""
    before, text = "", text.strip()
    if len(text) > LONGEST_DECORATED:
        return text
    while text != before:
        before = text
        text = in_digits(rewritten(without_labels(text), _DRESS).strip())
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


# --- names, signs of equality and other answers around a formula: plain texts, as `latex.plain` leaves them

TWO_ANSWERS = "two answers: give one"

_WORD = r"[^\W\d]\w*'{0,2}"
# A name before `=`: `omega`, `H(x, p)`, `dx/dt`, `the slow rate`.
_LABEL = re.compile(
    rf"\s*[|<]?\s*(?:d\s*/\s*d\s*t\s*)?{_WORD}(?:[ \t]+{_WORD})*"
    r"(?:\s*/\s*d\s*t)?(?:\s*[(\[][^()\[\]]*[)\]])?\s*[|>]?\s*"
)
_EQUALS = re.compile(r"(?<![<>=!]):?==?(?![>=])")
_AND = re.compile(rf"(?i)(?<=[\w)\].'])\s+{said('or', 'and')}\s+|\s(?:y|[|/])\s+(?=[^\W\d][^=]*=)")
# What stands between statements: a line, a semicolon, and a comma or a dot before another `=`.
_BETWEEN = re.compile(r"[\n;]|(?:,(?!\d)|[,.]\s)\s*+(?=[^=,;\n]{0,200}+(?<![<>!])=(?!>))")
# A name behind a value, as in `slow = 3 fast = 5`, which may begin a second answer.
SECOND_NAME = re.compile(rf"(?s)(?<=[\w)\]}}°%])\s+{_WORD}(?:\([\w, ]*\))?\s*\Z")
# An arrow in the place of `=` behind a name.
_LEADS_TO = re.compile(rf"\A(\s*{_WORD}(?:\([\w, ]*\))?\s*)(?:->|=>)(?=[^=]*\Z)")
# A name and a colon before the answer, as in `H:` and `H(x, p):`; or the sign of `~20.8`.
_COLON = re.compile(r"\A(?:\s*(?!\d)[\w']+(?:\s*\([\w',\s]*\))?\s*:(?!=)|\s*[~=])")
END = re.compile(r"(?<!\d)\.\s*\Z|[;,\s]+\Z")

_BRACKET = re.compile(r"[()\[\]{}]")


def is_label(side: str) -> bool:
    """Whether a side of `=` only names what follows: `H(x, p)`, `the slow rate`."""
    return _LABEL.fullmatch(side) is not None and CALLED.isdisjoint(re.findall(r"\w+", side))


def divisor(side: str) -> str:
    """What a name is divided by on a side of `=`: `M a^2/12` in `I/(M a^2/12)`; empty where it is not."""
    name, bar, below = slopes(side).partition("/")
    is_one = len(cut(below.strip(), re.compile(r"[-+/*\s]"))) == 1
    return below.strip() if bar and is_one and re.fullmatch(rf"\s*{_WORD}\s*", name) else ""


def closings_of(text: str) -> dict[int, int]:
    """Where the brackets of a text are closed, by where they open. Raises ExpressionError."""
    opened, ends = list[int](), dict[int, int]()
    for bracket in _BRACKET.finditer(text):
        if bracket[0] in "([{":
            opened.append(bracket.start())
        elif opened:
            ends[opened.pop()] = bracket.start()
    if opened:
        raise ExpressionError(f"`{text[opened[-1]]}` is never closed")
    return ends


def is_enclosed(text: str) -> bool:
    """Whether a text begins with a bracket that its end closes. Raises ExpressionError."""
    text = text.strip()
    return text[:1] in tuple("([{") and closings_of(text)[0] == len(text) - 1


def without_brackets(text: str) -> str:
    """The text with `_` for each character in brackets: of the same length, so that places stay valid."""
    masked, passed = text, -1
    with suppress(ExpressionError):
        for start, end in sorted(closings_of(text).items()):
            if start > passed:
                masked, passed = masked[: start + 1] + "_" * (end - start - 1) + masked[end:], end
    return masked


def cut(text: str, between: re.Pattern[str]) -> list[str]:
    """The text cut where the pattern stands outside of brackets."""
    if not between.search(text):
        return [text]
    pieces, begin = [], 0
    for match in between.finditer(without_brackets(text)):
        pieces.append(text[begin : match.start()])
        begin = match.end()
    return [*pieces, text[begin:]]


def statements(text: str) -> list[list[str]]:
    """What a plain text says, one statement after the other: each is the members of a chain of equalities.

    A line that begins or ends with `=` goes on with its neighbour.
    """
    text = re.sub(r"\n(?==(?!>))|(?<=[^<>]=)\n", " ", re.sub(r"[^\S\n]*\n\s*", "\n", text))
    return [cut(piece, _EQUALS) for piece in cut(text, _BETWEEN) if piece.strip(" \t\r,.")]


# Energies, and the sums that are made of them.
_ENERGY, _ENERGIES = re.compile(r"[TKUV](?:_?\w+)?"), re.compile(r"[HEL](?:_?\w+)?(?:\s*\(.*\))?")


def _is_working(own: str, values: Sequence[str], name: str, members: Sequence[str]) -> bool:
    """Whether a statement leads to another: `By Huygens, T = ..`, `T = 1/f = ..` behind f, H behind V."""
    if not values:
        return re.fullmatch(r"(?:[^\W\d_]+\s+)+[^\W\d_]{3,}", own) is not None
    is_used = any(re.search(rf"(?<!\w){re.escape(own)}(?!\w)", member) for member in members[:-1])
    return is_used or bool(_ENERGY.fullmatch(own) and _ENERGIES.fullmatch(name))


def last_member(text: str) -> tuple[str, list[str]]:
    """The last member of a chain of equalities in a plain text, without a final dot, and those before it.

    A name and a colon, or a sign that says `about`, may stand in front. The text may say the same name again,
    in lines or behind `=>`. Raises ExpressionError for several answers.
    """
    text = _COLON.sub("", re.sub(r"(?<=\w)\s*~\s*(?=[-+.\d])", " = ", text))
    text = _LEADS_TO.sub(r"\1=", text)
    if "=" not in text and not _AND.search(text):
        return END.sub("", text), []
    *reasons, conclusion = map(statements, cut(text, re.compile("=>|->")))
    *earlier, (name, *members) = conclusion or [[text]]
    told = [each for reason in reasons for each in reason if each[1:] and is_label(each[0])]
    told = [each for each in told if each[-1].strip() != "0"]  # `det(I - λ1) = 0 => λ = 2` solves an equation
    before = [name.strip()]
    for own, *values in (*told, *earlier):
        if own.strip() in ("", name.strip()):
            before += values
        elif members and re.fullmatch(rf"{re.escape(name.strip())}\s*(?:\^|\*\*)\s*2", own.strip()):
            before += [f"sqrt({value})" for value in values]  # `w^2 = 4, w = 2`
        elif not (members and _is_working(own.strip(), values, name.strip(), members)):
            raise ExpressionError(TWO_ANSWERS, code="wrong_shape")
    if (earlier and not members) or len(cut(text, _AND)) > 1:
        raise ExpressionError(TWO_ANSWERS, code="wrong_shape")
    *before, last = [*before, *members]
    if before and re.fullmatch(rf"(?i)\s*{said('constant')}\.?\s*", last):  # `E = 12.5 J = const.`
        *before, last = before
    return END.sub("", last), before


# --- formulas

_NAME = r"[^\W\d]\w*+"
_FUNCTIONS = rules(  # as programs write them: np.sqrt(x), Cos[x], SQRT(x)
    (r"\b(?:np|numpy|[Mm]ath|sp|sympy)\.(?=[a-zP])", ""),
    (
        r"\b((?:Arc|arc|ARC)?(?:Sin|Cos|Tan|SIN|COS|TAN)[hH]?|Sqrt|SQRT|Exp|EXP|Log|LOG|Ln|LN|Abs|ABS)(?=\s*[\[(])",
        lambda call: call[1].lower().replace("arc", "a"),
    ),
)


def _rate(match: re.Match[str]) -> str:
    """The derivative by the time, as its name: `of` has what is derived, `two` what tells the second one."""
    parts = match.groupdict()
    name = next(part for key, part in parts.items() if key.startswith("of") and part)
    return f" {name}{'ddot' if any(part for key, part in parts.items() if key.startswith('two')) else 'dot'} "


_D_DT = r"\bd\s*/\s*d\s*t\b"
_SLOPE = (
    rf"\bd\s*(?P<two>\^\s*2|2(?=\s*[\(\w]))?\s*(?:(?P<of>{_NAME})|\(\s*(?P<of_>{_NAME})\s*\))"
    r"\s*/\s*(?P<open>\()?\s*d\s*(?:t|\(\s*t\s*\))\s*(?:\^?\s*2)?\s*(?(open)\))(?!\w)"
    rf"|(?:(?P<opened>\()\s*)?{_D_DT}\s*(?(opened)\))\s*(?P<bracket>\()?\s*(?P<of__>{_NAME})\s*(?(bracket)\))"
)
_CALLED_D = (
    rf"'?\b(?:[dD]iff|D|Derivative)\s*\(\s*(?P<of>{_NAME})(?:\(t\))?\s*,"
    r"\s*(?:t\s*(?:(?P<two>,\s*[t2]|\$\s*2)\s*)?|\(t,\s*(?P<two_>2)\))\s*\)"
)
_RATES = rules(
    (_SLOPE, _rate),  # dx/dt, d^2 x/dt^2, d(theta)/dt, d/dt x
    (rf"{_D_DT}\s*(?=[(\[])", f" {RATE}"),
    (r"(?<=[\w)\]])\s*\.(?=[*/^])|%(?=(?:e|pi)\b)|@\([\w, ]*\)", ""),  # Matlab's p.^2 and @(x), Maxima's %pi
    (_CALLED_D, _rate),  # diff(x(t), t), D(x, t), Derivative(x, (t, 2))
    (r"\bdouble[- ]dot\b", "ddot"),
    (r"(?<=\w)[- ](d?dot)\b", r"\1"),
    (r"(?<=[a-z0-9])_?(D?Dot)\b", lambda dots: dots[1].lower()),
    (r"_?dot_?dot\b", "ddot"),
    (rf"(?<![^\W\d])(?P<of>{_NAME})(?:(?P<two>''|\")|')(?:\(t\))?", _rate),
)

POINTS = str.maketrans("[]", "()")  # square brackets are parentheses


def expressions(text: str, words: Words | None, *, leading: bool = True) -> list[tree.Node]:
    """The readings of a formula in these words, the most usual first; without words, a name is taken whole.

    A name and `=` may be `leading`; of a chain of equalities this is the last member.

    Raises ExpressionError: the text is no formula. Its `code` is `unknown_symbol` for a name that the
    question does not have, `too_large` beyond the bounds.
    """
    formula = rewritten(plain(text), _FUNCTIONS)
    if leading:
        formula, before = last_member(formula)
        name = formula.strip() if words and re.fullmatch(rf"\s*{_NAME}\s*", formula) else ""
        if words and name and before and not (words.meaning(name) or words.products(name)):
            formula = before[-1]  # `... = E` names the result
    formula = slopes(formula.translate(POINTS))
    if re.match(r"\s*(?:\+/?-|-\+)", formula):
        raise ExpressionError(TWO_ANSWERS, code="wrong_shape")
    formula = re.sub(r"\bP[iI]\b", lambda pi: pi[0] if words and words.products(pi[0]) else "pi", formula)
    return of_tokens(tokenize(formula, as_typed=False), {}, words)


def slopes(text: str) -> str:
    """A plain text with `xdot` for `dx/dt` and `x'`, and with points for decimal commas."""
    text = rewritten(text, _RATES)
    return text if re.search("atan2|pow|POW|Pow", text) else re.sub(r"(?<=\d),(?=\d)", ".", text)


# --- what stands left of `=`

# A letter, or the name of a Greek one, with its index or dots. What is no letter is a word.
_LETTER = re.compile(rf"(?:{'|'.join([*GREEK, *map(str.capitalize, GREEK)])}|[^\W\d_])(?:d?dot|_\w+|\d)*")
# Letters in one word, as in `lω`; while `pθ` and `Fθ` are names with an index.
_RUN_TOGETHER = re.compile(rf"[IMRgklmr]{{1,2}}(?:{'|'.join(GREEK)})(?:d?dot)?")
_CHANGE = frozenset(["d", "delta", "Delta", "A"])  # what stands before one name, or is an article
_RATE = re.compile(r"[A-Z](?:_\w+)?d{1,2}ot")
# Two energies whose sum, or difference, is an energy.
_SUM_OF_ENERGIES = re.compile(r"\s*(?:[TKE]\w*\s*[-+]\s*[VUE]\w*|[VU]\w*\s*\+\s*[TK]\w*)\s*")


def without_arguments(side: str) -> str:
    """A side of `=` without brackets at its end: `H` for `H(x, p)`."""
    return re.sub(r"(?<=[\w'])\s*[(\[][^()\[\]]*[)\]]\s*\Z", "", side)


def is_name(side: str) -> bool:
    """Whether what stands left of `=` names one quantity: no number, product, sum, power or derivative.

    Words are a name, and so is a letter with its arguments: `the slow rate`, `H(x, p)`.
    """
    side = slopes(side.replace("'", "")).strip(" |<>")  # `I'` is another inertia
    side = without_arguments(side) if is_label(side) else side
    try:
        root = expressions(side, None, leading=False)[0]
    except ExpressionError:
        return is_label(side)
    names = tree.names_in(root)
    match root:
        case tree.Name(name):
            return not (_RUN_TOGETHER.fullmatch(name) or _RATE.fullmatch(name))
        case tree.Product(factors) if all(isinstance(factor, tree.Name) for factor in factors):
            return not all(map(_LETTER.fullmatch, names)) or not names.isdisjoint(_CHANGE)
        case tree.Sum():
            return _SUM_OF_ENERGIES.fullmatch(side) is not None
    return False
