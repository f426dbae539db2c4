"""LaTeX of this package as MathML, which browsers set without a network and without a script."""

from __future__ import annotations

import html
import re
from xml.etree.ElementTree import Element, tostring

from rigidcli.render.latex import pieces
from rigidcli.render.prose import typeset
from rigidcli.render.web.page import text

_FUNCTION = (
    r"\\(?:(?:arc)?(?:sin|cos|tan)|sinh|cosh|tanh|ln|det|mathrm\{(?:ar(?:sin|cos|tan)h|atan2|sgn)\})"
    r"(?![a-z])"
)
# LaTeX that latex2mathml or browsers cannot set, as regular expressions, and replacements that both can set.
# Browsers have no bold letters except in Unicode, and put no space about the name of a function.
_DIALECT = {
    r"\\\\\[1ex\]": r"\\\\",
    r"\\operatorname\b": r"\\mathrm",
    r"\\mathrm\{(\w)\}": r"\\text{\1}",
    r"\\boldsymbol\{\\omega\}": "\N{MATHEMATICAL BOLD ITALIC SMALL OMEGA}",
    r"\\boldsymbol\{\\Gamma\}": "\N{MATHEMATICAL BOLD CAPITAL GAMMA}",
    r"\\mathbf\{1\}": "\N{MATHEMATICAL BOLD DIGIT ONE}",
    rf"(?<=[\w)}}]) ?(?={_FUNCTION})": r"\\,",
    rf"({_FUNCTION}(?:\^\{{\d+\}})?) ?(?=\w|\\(?!left))": r"\1\\,",
}
# A list of numbers in brackets, which need not be higher than a line, and its unit.
_LIST = re.compile(r"\\left\(((?:(?!\\(?:frac|left|sqrt)).)*,\\, .*)\\right\)(.*)", re.DOTALL)


def formula(latex: str) -> str:
    """A formula as MathML, which wraps between the terms of a sum and the entries of a list.

    LaTeX that cannot be converted, or for which the library is missing, stays as it is in dollar signs, which
    most notebooks set.
    """
    try:
        terms = (_entries(piece) for piece in pieces(latex))
        return "<wbr>".join(
            " ".join(_converted(entry, place > 0) for entry in entries) for place, entries in enumerate(terms)
        )
    except Exception:  # noqa: BLE001 - whatever the library stumbles over, a person can read the LaTeX
        return f'<span class="latex">${html.escape(latex)}$</span>'


def prose(words: str) -> str:
    """Words as text of a page, with the formulas among them as MathML."""
    return "".join(formula(piece) if is_formula else text(piece) for piece, is_formula in typeset(words))


def _entries(piece: str) -> list[str]:
    """A piece of a formula, cut behind each entry if it ends in a list."""
    found = _LIST.search(piece)
    if not found:
        return [piece]
    first, *others = found[1].split(",\\, ")
    entries = [f"{piece[: found.start()]}({first}", *others]
    return [*(f"{entry}," for entry in entries[:-1]), f"{entries[-1]}){found[2]}"]


def _converted(latex: str, follows: bool) -> str:
    """A piece of a formula; if it `follows` another, the sign at the beginning stands between both."""
    from latex2mathml.converter import convert_to_element

    for ours, theirs in _DIALECT.items():
        latex = re.sub(ours, theirs, latex)
    math: Element = convert_to_element(latex)
    del math.attrib["xmlns"]
    for row in math.iter():
        row.text = row.text and html.unescape(row.text)  # the library writes characters as entities
    for row in math.iter():
        _tidy(row, follows and row is math[0])
    return tostring(math, encoding="unicode")


def _tidy(row: Element, follows: bool) -> None:
    """Join the letters of a word, and mark signs by whether they stand before one term or between two."""
    before: Element | None = None
    for node in list(row):
        if node.get("mathvariant") == "normal" and before is not None and before.get("mathvariant"):
            before.text = f"{before.text}{node.text}"
            row.remove(node)
            continue
        if node.tag == "mo" and node.text in ("-", "+", "\N{MINUS SIGN}"):
            is_first = before is None or (before.tag == "mo" and before.get("form") != "postfix")
            node.set("form", "infix" if follows or not is_first else "prefix")
        if node.text == "/":
            node.attrib |= {"lspace": "0", "rspace": "0"}
        before, follows = node, False
