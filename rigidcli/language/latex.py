r"""LaTeX and the signs of a keyboard that has more than ASCII, as plain text.

    plain(r"\frac{p_{\theta}^2}{2m} + mgl\cos\theta")      # ((p_theta ^2 )/(2m)) + mgl cos theta
    plain("ẍ = −½ω²")                                      # xddot = -(1/2)omega^2

The result is what somebody would type who knows no LaTeX; `typed` reads it. Fractions come with parentheses,
matrices as lists of rows with semicolons, derivatives as `xdot`.

Commands become words or single signs first. Then groups in braces are replaced from the inside out, each by
what stands before it.
"""

from __future__ import annotations

import re
import unicodedata

from rigidcli.errors import ExpressionError
from rigidcli.language.tokens import GREEK, GREEK_LETTERS, LOWERED, MAX_TEXT, SUPERSCRIPT, rewritten, rules
from rigidcli.language.words import CALLED, undotted

# The most braces inside each other; twice as many rounds of replacements are enough for them.
MAX_NESTING = 60

# --- signs

_FRACTION_SIGNS = "½¼¾⅓⅔⅕⅖⅗⅘⅙⅚⅛⅜⅝⅞"
_SIGNS = str.maketrans(
    GREEK_LETTERS
    | {"∞": " inf ", "√": " sqrt ", "∛": " cbrt ", "∜": " sqrt sqrt ", "ℓ": "ell", "ⅇ": "e"}
    | {sign: f"({unicodedata.normalize('NFKC', sign).replace('⁄', '/')})" for sign in _FRACTION_SIGNS}
    | dict.fromkeys("−–—‐‑", "-")
    | dict.fromkeys("·⋅×∗•", "*")
    | dict.fromkeys("≈≃≅≡∈∼", "=")
    | {"÷": "/", "⁄": "/", "∕": "/", "‖": "|", "º": "°", "˚": "°", "″": "''", "”": "''"}
    | dict.fromkeys("′’‘´ʹ", "'")
    | dict.fromkeys("⇒⟹→⟶∴", "=>")
    # marks that say nothing: invisible signs of Word, check marks, arrows and accents on letters
    | dict.fromkeys("\u2061\u2062\u2063\u2064✓✔", " ")
    | dict.fromkeys("\N{ZERO WIDTH SPACE}\N{ZERO WIDTH NO-BREAK SPACE}\u0300\u0301\u0304", "")
    | {"\N{COMBINING RIGHT ARROW ABOVE}": "\N{COMBINING CIRCUMFLEX ACCENT}"}
    | dict.fromkeys("\N{NO-BREAK SPACE}\N{THIN SPACE}\N{NARROW NO-BREAK SPACE}\N{EN SPACE}\t", " ")
    | dict(zip("₀₁₂₃₄₅₆₇₈₉", (f"_{digit}" for digit in "0123456789"), strict=True))
)


def _in_ascii(match: re.Match[str]) -> str:
    return unicodedata.normalize("NFKC", match[0]).replace("−", "-").replace("ɑ", "a")


# --- commands: what each comes to; those with an argument in braces come to a sign of their own

_FRACTION, _ROOT, _DOT, _DDOT, _VECTOR, _CONTENT, _MATRIX, _LINES, _END = map(chr, range(0xE010, 0xE019))
# What is left of `\hat`, `\vec` and bold letters, until lists are read.
HAT = "\N{COMBINING CIRCUMFLEX ACCENT}"

_BY_MEANING = {
    "=>": "Rightarrow Longrightarrow implies rightarrow to therefore iff", "=": "approx simeq", "±": "pm",
    "*": "cdot times ast", "/": "div", "'": "prime", "°": "circ degree", "|": "lvert rvert vert",
    "[": "lbrack", "]": "rbrack", "i": "imath", "j": "jmath", "∂": "partial",
    " phi": "varphi", " theta": "vartheta", " epsilon": "varepsilon", " rho": "varrho", " sigma": "varsigma",
    "\n": "newline cr \\", "%": "%", "&": "&", "_": "_", "#": "#", " inf ": "infty",
    " ": "tag quad qquad thinspace space , ; : ! >",
    "(": "lbrace { langle", ")": "rbrace } rangle",
    "": """left right big Big bigl bigr Bigl Bigr bigg biggl biggr displaystyle textstyle rm it bf limits
        hline nonumber notag ( ) [ ]""",
    _FRACTION: "frac dfrac tfrac cfrac nicefrac", _ROOT: "sqrt", _DOT: "dot", _DDOT: "ddot",
    _VECTOR: "hat vec mathbf boldsymbol bm widehat overrightarrow", "T": "top",
    _CONTENT: """mathrm text textrm mathit mathsf operatorname mbox textit textbf mathcal mathscr mathfrak
        mathtt mathbb pmb emph unit si boxed num textsf underline bar overline""",
    _MATRIX: "pmatrix bmatrix matrix Bmatrix smallmatrix array",
    _LINES: "aligned cases split gathered align gather equation eqnarray",
}  # fmt: skip
_MEANINGS = {name: f" {name}" for name in (*GREEK, *map(str.capitalize, GREEK), "hbar", "ell", *CALLED)} | (
    {name: meaning for meaning, names in _BY_MEANING.items() for name in names.split()} | {" ": " "}
)
_OF_ARGUMENTS = "|".join(name for name, meaning in _MEANINGS.items() if _FRACTION <= meaning <= _CONTENT)
_BARE = rf"(\\(?!(?:{_OF_ARGUMENTS})(?![A-Za-z]))[A-Za-z]+|[^\s\\{{}}\[])"

# What other programs write, in LaTeX; and braces around arguments of one sign or command.
_TO_LATEX = rules(
    ("〖([^〖〗]*)〗", lambda group: f" {group[1]} " if group[1].isalpha() else f"({group[1]})"),  # Word
    (r"■\(((?:[^()]|\((?:[^()]|\([^()]*\))*\))*)\)", lambda rows: matrix(rows[1].replace("@", "\n"))),
    (r"\\\[([A-Z][a-z]+)\]", lambda name: name[1].lower()),  # Mathematica
    (r"\\(?:label|ref|eqref)\s*\{[^{}]*\}", ""),
    (r"\{([^{}]*)\\over\b\s*([^{}]*)\}", r"\\frac{\1}{\2}"),
    ("[\u2102-\u2138\uff01-\uff5e\U0001d400-\U0001d7ff]", _in_ascii),  # letters of Word and of full width
    (rf"(?<![\w.,])(\d+)([{_FRACTION_SIGNS}])", r"(\1 + \2)"),  # a whole number and a fraction: 12½
    ("([⁰¹²³⁴-⁹]+)⁄([₀-₉]+)", lambda over: f"({_in_ascii(over)})".replace("⁄", "/")),
    (r"(?<![\w)])([³⁴])\s*√|√\s*([³⁴])(?=[\w(])", lambda root: "∛" if "³" in root[0] else "∜"),
    (r"(?<=[^\W\d])[⁻⁺]?[ᵃ-ᵛᶜᶻⁱⁿ]+", lambda power: f"^({_in_ascii(power)})"),
)
_TO_GROUPS = rules(
    (
        r"(?s)\\left\s*\\\{\s*\\begin\{(?:array\}\{\w*|aligned)\}(.*?)\\end\{\w+\}\s*\\right\s*\.",
        r"\\begin{cases}\1\\end{cases}",
    ),
    ("&?=&?", "="),
    (rf"(\\(?:{'|'.join(sorted(CALLED))})\s*\^)(\d)", r"\1{\2}"),  # a power of a function is one digit
    (rf"(\\(?:{_OF_ARGUMENTS}))(?![A-Za-z])\s*(\[[^\[\]]*\])?\s*(?!\[){_BARE}", r"\1\2{\3}"),
    (rf"(\\(?:d|t|c|nice)?frac\s*\{{[^{{}}]*\}})\s*{_BARE}", r"\1{\2}"),
    (r"([_^])(\\[A-Za-z]+)", r"\1{\2}"),
)


# A power or primes before an index, which mean the same behind it: `p^2_theta`.
_BEFORE_INDEX = re.compile(r"(?<=[^\W\d_])(\^(?:\d|\{\d\})|[²³]|'{1,2})_(\{[^{}]*\}|\\[a-zA-Z]+|[^\W_]+)")


def plain(text: str) -> str:
    """A text without LaTeX, in ASCII as far as its signs have ASCII spellings.

    Raises ExpressionError: braces do not match, or a command has no meaning in a formula.
    """
    return with_hats(text).replace(HAT, "")


def with_hats(text: str) -> str:
    """A plain text in which letters keep the hats of unit vectors. Raises ExpressionError."""
    if len(text) > MAX_TEXT:
        message = f"an answer has at most {MAX_TEXT} characters, this has {len(text)}"
        raise ExpressionError(message, code="too_large")
    text = _BEFORE_INDEX.sub(r"_\2\1", text)
    if text.isascii() and not set("\\{}$").intersection(text):
        return text
    text = unicodedata.normalize("NFD", undotted(rewritten(text, _TO_LATEX)))
    text = re.sub(SUPERSCRIPT, lambda match: f"^{match[0].translate(LOWERED)} ", text).translate(_SIGNS)
    return _without_braces(text) if set("\\{}$").intersection(text) else text


# --- groups, once commands are signs


def _command(match: re.Match[str]) -> str:
    if match["end"]:
        return _END
    name = match["environment"] or match["command"]
    meaning = _MEANINGS.get(name)
    if meaning is None or (meaning in (_MATRIX, _LINES)) is not bool(match["environment"]):
        kind = "environment `" if match["environment"] else "command `\\"
        raise ExpressionError(f"the LaTeX {kind}{name[:24]}` has no meaning in an answer")
    return meaning


_COMMAND = re.compile(
    r"\\begin\s*\{(?P<environment>\w+)\*?\}(?:(?<=array\})\{[^{}]*\})?|(?P<end>\\end\s*\{[^{}]*\})"
    r"|\\(?:(?:left|right)\s*\.|(?P<command>[A-Za-z]+|.)\*?)",
    re.DOTALL,
)
_GROUP = r"\s*\{([^{}]*)\}"
_RATE = re.compile(r"\s*d\s*(?:\^\s*(2)\s*)?(?P<name>[^\W\d]\u0302?\w*'*)?\s*")


def _fraction(match: re.Match[str]) -> str:
    above, below = match.groups()
    rate = _RATE.fullmatch(above)
    if rate is not None and re.fullmatch(r"\s*d\s*t\s*(?:\^\s*2\s*)?", below):
        return f" {rate['name']}{'ddot' if rate[1] else 'dot'} " if rate["name"] else " d/dt "
    return f"(({above})/({below}))"


def _power(match: re.Match[str]) -> str:
    power = match[1].strip()
    if power in ("°", "'", "''"):
        return power
    return f"^{power.lstrip('+')} " if re.fullmatch(r"[-+]?\d+", power.replace(" ", "")) else f"^({match[1]})"


def _dotted(match: re.Match[str]) -> str:
    """A name with its index, then its dots: `\\dot{x}_1` is x_1dot."""
    name, index = re.sub(r"[()\s]", "", match[2]), _index(match[3] or match[4] or "")
    return f" {name}{'_' * bool(index)}{index}{'dot' if match[1] == _DOT else 'ddot'} "


def _index(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "", text)


def matrix(text: str) -> str:
    """Lines with `&` between their entries as a list of rows: `[[1; 2]; [3; 4]]`."""
    rows = [f"[{row.replace('&', ';')}]" for row in text.split("\n") if row.strip()]
    return f"[{'; '.join(rows)}]"


# Innermost groups, each by the sign before it.
_GROUPS = rules(
    (rf"([{_DOT}{_DDOT}]){_GROUP}(?:\s*_\s*(?:\{{([^{{}}]*)\}}|(\w)))?", _dotted),
    (rf"{_FRACTION}{_GROUP}{_GROUP}", _fraction),
    (rf"({_FRACTION}{_GROUP})\s*(\w)(?![A-Za-z])", r"\1{\3}"),
    (rf"{_ROOT}\[([^\[\]]*)\]{_GROUP}", r"((\2)^(1/(\1)))"),
    (rf"{_ROOT}{_GROUP}", r" sqrt(\1)"),
    (rf"{_VECTOR}{_GROUP}", rf"\1{HAT}"),
    (rf"{_CONTENT}{_GROUP}", r"\1"),
    (rf"_{_GROUP}", lambda index: f"_{_index(index[1])} "),
    (rf"\^{_GROUP}", _power),
    (rf"{_MATRIX}([^{{}}{_MATRIX}{_LINES}{_END}]*){_END}", lambda inner: matrix(inner[1])),
    (rf"{_LINES}([^{{}}{_MATRIX}{_LINES}{_END}]*){_END}", lambda inner: inner[1].replace("&", " ")),
    (r"\{\s*,\s*\}", ","),  # the decimal comma of LaTeX
)
# Braces that only hold together; those behind a sign or another group may be arguments.
_BRACES = re.compile(rf"(?<![}}\]{_FRACTION}-{_CONTENT}])\{{([^{{}}]*)\}}")
_UNFINISHED = (
    {"{": "a brace `{` is never closed", "}": "a brace `}` closes nothing"}
    | dict.fromkeys([_FRACTION, _DOT, _DDOT], "a LaTeX command lacks its argument")
    | dict.fromkeys([_MATRIX, _LINES], "an environment of LaTeX is never ended")
    | {_END: "an environment of LaTeX ends that was not begun"}
)


def _without_braces(text: str) -> str:
    text = re.sub(r"\}\s+\{", "}{", rewritten(text, _TO_GROUPS).replace("$", ""))
    text = _COMMAND.sub(_command, text)
    text = re.sub(r"(?<=\S)~", " ", text)
    before = ""
    for _ in range(2 * MAX_NESTING):
        before, text = text, rewritten(text, _GROUPS)
        if text == before and (text := _BRACES.sub(r"(\1)", text)) == before:
            break
    for sign, problem in _UNFINISHED.items():
        if sign in text:
            raise ExpressionError(problem)
    text = re.sub(r"(_\w+) (?=')", r"\1", text)  # of `p_\theta'`
    return text.replace(_ROOT, " sqrt ").replace(_VECTOR, "").replace(_CONTENT, "")
