r"""LaTeX and the signs of a keyboard that has more than ASCII, as plain text.

    plain(r"\frac{p_{\theta}^2}{2m} + mgl\cos\theta")      # ((p_theta ^2 )/(2m)) + mgl cos theta
    plain("ẍ = −½ω²")                                      # xddot = -(1/2)omega^2

The result is what somebody would type who knows no LaTeX; `typed` reads it. Fractions come with parentheses,
matrices as lists of rows with semicolons, derivatives as `xdot`.
"""

from __future__ import annotations

import re
import unicodedata

from rigidcli.errors import ExpressionError
from rigidcli.language.tokens import GREEK, GREEK_LETTERS, LOWERED, MAX_TEXT, SUPERSCRIPT
from rigidcli.language.words import CALLED

MAX_NESTING = 60
"""The most braces inside each other, so that recursion never ends the program."""

_FRACTION_SIGNS = "½¼¾⅓⅔⅕⅖⅗⅘⅙⅚⅛⅜⅝⅞"
_MIXED = re.compile(rf"(?<![\w.,])(\d+)([{_FRACTION_SIGNS}])")
"""A whole number and a fraction that is added to it: `12½`."""

_SIGNS = str.maketrans(
    GREEK_LETTERS
    | {"∞": " inf ", "√": " sqrt ", "ℓ": "ell"}
    | {sign: f"({unicodedata.normalize('NFKC', sign).replace('⁄', '/')})" for sign in _FRACTION_SIGNS}
    | dict.fromkeys("−–—‐‑", "-")
    | dict.fromkeys("·⋅×∗•", "*")
    | dict.fromkeys("≈≃≅≡∈", "=")
    | {"÷": "/", "⁄": "/", "∕": "/", "‖": "|", "º": "°", "˚": "°"}
    | dict.fromkeys("′’‘´ʹ", "'")
    | dict.fromkeys("⇒⟹→⟶∴", "=>")
    | dict.fromkeys("\u2061\u2062\u2063\u2064✓✔", " ")
    | {"\N{TILDE OPERATOR}": "="}
    | {"″": "''", "”": "''"}
    | dict.fromkeys("\N{NO-BREAK SPACE}\N{THIN SPACE}\N{NARROW NO-BREAK SPACE}\N{EN SPACE}\t", " ")
    | dict.fromkeys("\N{ZERO WIDTH SPACE}\N{ZERO WIDTH NO-BREAK SPACE}", "")
    | dict(zip("₀₁₂₃₄₅₆₇₈₉", (f"_{digit}" for digit in "0123456789"), strict=True))
)  # fmt: skip
DOTS = "\N{COMBINING DOT ABOVE}\N{COMBINING DIAERESIS}"
_DOTTED = re.compile(r"([^\W\d_](?:\w{0,9}\d)?)(\u0308|\u0307\u0307|\u0307)(_?\d+)?")

_SPACES = ("tag", "quad", "qquad", "thinspace", "space", *",;:! >")
_DROPPED = (
    "left", "right", "big", "Big", "bigl", "bigr", "Bigl", "Bigr", "bigg", "biggl", "biggr", "displaystyle",
    "textstyle", "rm", "it", "bf", "limits", "hline", *"()[]",
)  # fmt: skip
_WORDS = {
    **{name: f" {name}" for name in (*GREEK, *map(str.capitalize, GREEK), "hbar", "ell", *CALLED)},
    "varphi": " phi", "vartheta": " theta", "varepsilon": " epsilon", "varrho": " rho", "varsigma": " sigma",
    "cdot": "*", "times": "*", "ast": "*", "div": "/", "approx": "=", "simeq": "=", "prime": "'", "circ": "°",
    "lbrace": "(", "rbrace": ")", "lbrack": "[", "rbrack": "]", "lvert": "|", "rvert": "|", "vert": "|",
    **dict.fromkeys(("Rightarrow", "implies", "rightarrow", "to", "therefore", "Longrightarrow"), "=>"),
    "infty": " inf ", "imath": "i", "jmath": "j", "iff": "=>", "pm": "±",
    "degree": "°", "newline": "\n", "\\": "\n", "cr": "\n",
    "{": "(", "}": ")", **{sign: sign for sign in "%&_#"},
    **dict.fromkeys(_SPACES, " "), **dict.fromkeys(_DROPPED, ""),
}  # fmt: skip
"""What commands without an argument come to."""
_CONTENT = {
    "mathrm", "text", "textrm", "mathbf", "mathit", "mathsf", "operatorname", "boldsymbol", "bm", "vec",
    "hat", "mbox", "textit", "textbf", "mathcal", "mathscr", "mathfrak", "mathtt", "mathbb", "pmb", "emph",
    "unit", "si", "boxed", "num", "textsf", "underline",
}  # fmt: skip
_FRACTIONS = {"frac", "dfrac", "tfrac", "cfrac", "nicefrac"}
_MATRICES = {"pmatrix", "bmatrix", "matrix", "Bmatrix", "smallmatrix", "array"}
_LINES = {"aligned", "cases", "split", "gathered", "align", "gather", "equation", "eqnarray"}
_SYSTEM = re.compile(
    r"(?s)\\left\s*\\\{\s*\\begin\{(?:array\}\{\w*|aligned)\}(.*?)\\end\{\w+\}\s*\\right\s*\."
)
_TOKEN = re.compile(r"\\([A-Za-z]+\*?|.)|(\{)|(\})|([_^])|\$+|[^\\{}_^$]", re.DOTALL)
_DERIVATIVE = re.compile(r"\s*d\s*(?:\^\s*(2)\s*)?(?P<name>[^\W\d]\w*'*)?\s*")
_BY_TIME = re.compile(r"\s*d\s*t\s*(?:\^\s*2\s*)?")

_WORD = re.compile("〖([^〖〗]*)〗")
"""The brackets that Word writes around what belongs together."""

_MATHEMATICA = re.compile(r"\\\[([A-Z][a-z]+)\]")
_OVER = re.compile(r"\{([^{}]*)\\over\b\s*([^{}]*)\}")
_LABEL = re.compile(r"\\(?:label|ref|eqref)\s*\{[^{}]*\}|\\(?:nonumber|notag)\b")

_FONTS = re.compile("[\u2102-\u2138\uff01-\uff5e\U0001d400-\U0001d7ff]")
"""Letters in the fonts of Word and others, and of full width."""


def plain(text: str) -> str:
    """A text without LaTeX, in ASCII as far as its signs have ASCII spellings.

    Raises ExpressionError: braces do not match, or a command has no meaning in a formula.
    """
    if len(text) > MAX_TEXT:
        message = f"an answer has at most {MAX_TEXT} characters, this has {len(text)}"
        raise ExpressionError(message, code="too_large")
    if text.isascii() and not set("\\{}$").intersection(text):
        return text
    text = _WORD.sub(lambda group: f" {group[1]} " if group[1].isalpha() else f"({group[1]})", text)
    text = _OVER.sub(r"\\frac{\1}{\2}", _LABEL.sub("", _MATHEMATICA.sub(lambda name: name[1].lower(), text)))
    text = _FONTS.sub(lambda letter: unicodedata.normalize("NFKC", letter[0]), text)
    text = _MIXED.sub(r"(\1 + \2)", text)
    text = unicodedata.normalize("NFD", undotted(text)).replace("\u0301", "").replace("\u0300", "")
    text = re.sub(SUPERSCRIPT, lambda match: f"^{match[0].translate(LOWERED)} ", text).translate(_SIGNS)
    text = re.sub("&?=&?", "=", _SYSTEM.sub(r"\\begin{cases}\1\\end{cases}", text))
    return _LatexToPlain(text).whole() if set("\\{}$").intersection(text) else text


def undotted(text: str) -> str:
    """A text with names for letters that have dots: xdot and x_1ddot for x and x_1 with one dot and two."""
    marked = text.replace("\N{DOT ABOVE}", DOTS[0]).replace("\N{DIAERESIS}", DOTS[1])
    letters = unicodedata.normalize("NFD", marked)
    if not any(dots in letters for dots in DOTS):
        return text
    return _DOTTED.sub(lambda m: f"{m[1]}{m[3] or ''}{'dot' if m[2] == DOTS[0] else 'ddot'}", letters)


class _LatexToPlain:
    def __init__(self, text: str) -> None:
        self.text = text
        self.place = 0
        self.depth = 0

    def whole(self) -> str:
        written = self.group("")
        if self.place < len(self.text):
            raise ExpressionError("a brace `}` closes nothing")
        return written

    def group(self, end: str) -> str:
        """The plain text up to the closing brace, or up to `\\end`; the brace is passed."""
        self.depth += 1
        if self.depth > MAX_NESTING:
            raise ExpressionError(f"nested deeper than {MAX_NESTING} levels")
        written: list[str] = []
        while match := _TOKEN.match(self.text, self.place):
            command, opened, closed, script = match.groups()
            if closed or command == "end":
                break
            self.place = match.end()
            if command is not None:
                written.append(self.command(command))
            elif opened:
                inner = self.group("}")
                written.append(inner if inner.strip() == "," else f"({inner})")
            elif script:
                before = written[-1].strip() if written else ""
                written.append(self.script(script, is_single=before in CALLED))
            elif not match[0].startswith("$"):
                is_blank = match[0] == "~" and "".join(written).strip()
                written.append(" " if is_blank else match[0])
        self.depth -= 1
        here = self.text[self.place : self.place + 1]
        if end == "}" and here != "}":
            raise ExpressionError("a brace `{` is never closed")
        self.place += len(end) if end == "}" else 0
        return "".join(written)

    def argument(self) -> str:
        """The plain text of the group, the command or the one character that follows."""
        while self.text[self.place : self.place + 1].isspace():
            self.place += 1
        match = _TOKEN.match(self.text, self.place)
        if match is None or match[3]:
            raise ExpressionError("a LaTeX command lacks its argument")
        self.place = match.end()
        if match[2]:
            return self.group("}")
        return match[0] if match[1] is None else self.command(match[1])

    def script(self, sign: str, *, is_single: bool = False) -> str:
        """A power, or an index as part of a name; a power of a function is one digit without braces."""
        braced = self.text[self.place : self.place + 1] in ("{", "\\")
        if sign == "^":
            power = self.argument() if braced else ""
            if power.strip() in ("°", "'", "''"):
                return power.strip()
            if re.fullmatch(r"\s*[-+]?\s*\d+\s*", power):
                return f"^{power.replace(' ', '').lstrip('+')} "
            if not braced and is_single and self.text[self.place : self.place + 1].isdigit():
                return f"^{self.argument()} "
            return f"^({power})" if braced else "^"
        return f"_{_index(self.argument())} " if braced else "_"

    def command(self, name: str) -> str:
        if name == "sqrt":
            return self.root()
        if name in _WORDS:
            self.place += self.text.startswith(".", self.place) and name in ("left", "right")
            return _WORDS[name]
        if name in _CONTENT:
            return self.argument()
        if name in _FRACTIONS:
            return self.fraction()
        if name in ("dot", "ddot"):
            return self.dotted(name)
        if name == "begin":
            return self.environment()
        raise ExpressionError(f"the LaTeX command `\\{name[:24]}` has no meaning in an answer")

    def fraction(self) -> str:
        above, below = self.argument(), self.argument()
        top = _DERIVATIVE.fullmatch(above)
        if top is not None and _BY_TIME.fullmatch(below):
            return f" {top['name']}{'ddot' if top[1] else 'dot'} " if top["name"] else " d/dt "
        return f"(({above})/({below}))"

    def root(self) -> str:
        if not self.text.startswith("[", self.place):
            return f" sqrt({self.argument()})"
        end = self.text.find("]", self.place)
        if end < 0:
            raise ExpressionError("`\\sqrt[` is never closed")
        index = self.text[self.place + 1 : end]
        self.place = end + 1
        return f"(({self.argument()})^(1/({plain(index)})))"

    def dotted(self, dots: str) -> str:
        """A name with its index, then its dots: `\\dot{x}_1` is x_1dot."""
        name = re.sub(r"[()\s]", "", self.argument())
        if (index := re.compile(r"\s*_").match(self.text, self.place)) is not None:
            self.place = index.end()
            name += "_" + _index(self.argument())
        return f" {name}{dots} "

    def environment(self) -> str:
        """An environment: a matrix as a list of rows, aligned equations as lines."""
        name = self.argument().strip("()*")
        if name not in _MATRICES | _LINES:
            raise ExpressionError(f"the LaTeX environment `{name[:24]}` has no meaning in an answer")
        if name == "array" and self.text.startswith("{", self.place):
            self.argument()
        inner = self.group("end")
        if not self.text.startswith("\\end", self.place):
            raise ExpressionError(f"`\\begin{{{name}}}` is never ended")
        self.place += len("\\end")
        self.argument()
        if name in _LINES:
            return inner.replace("&", " ")
        return matrix(inner)


def matrix(text: str) -> str:
    """Lines with `&` between their entries as a list of rows: `[[1; 2]; [3; 4]]`."""
    rows = [f"[{row.replace('&', ';')}]" for row in text.split("\n") if row.strip()]
    return f"[{'; '.join(rows)}]"


def _index(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "", text)
