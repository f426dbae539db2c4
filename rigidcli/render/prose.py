"""Sentences and titles of results: the formulas in them as LaTeX, and the words between."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TypeAlias

from rigidcli.language.text import latex_name
from rigidcli.language.tokens import GREEK
from rigidcli.language.words import FUNCTIONS

Token: TypeAlias = re.Match[str]
_GREEK = "|".join((*GREEK, "Gamma", "Delta", "Omega", "Phi", "Psi"))
# The parts of a formula. A hyphen between letters is a part of a word: `j-th`, `T-handle`.
_TOKEN = re.compile(
    rf"""
    (?P<product>(?<=omega)\ x\ (?=[A-Z]\b)|(?<=\bR)\ x\ (?=M\ g))   # of vectors
    |(?P<function>\b(?:{"|".join(FUNCTIONS)})(?=\())
    |\bd(?P<coordinate>[a-z]\w*)/dt\b
    |(?P<differential>\bd[A-Z]\w*(?=/d)|(?<=/)d\w+|\bdm\b(?!-))
    |(?P<symbol>(?<![\w'])(?:(?:{_GREEK}|[A-Za-z])\d*(?:_\w+)?|I[xyz]{{2}}|(?:{_GREEK}|[a-z]\w*)d?dot)(?![\w']|-[a-z]{{3}}))
    |(?P<number>(?<![\w.])\d+(?:\.\d+)?(?:e-?\d+)?(?!\w|\.\d))
    |(?P<power>\*\*-?|\^-?)
    |(?P<sign>[<>]=|\ [-+=<>]\ |(?<!\w)-(?=[\w(])|(?<=\))-|[*/+=<>(){{}}])
    |(?P<blank>\ )
    """,
    re.VERBOSE,
)
_SIGNS = {"<=": r"\le ", ">=": r"\ge ", "*": r"\,", "{": r"\{", "}": r"\}"}
# Signs at which no formula begins, and at which none ends.
_NO_BEGINNING, _NO_END = tuple(")/*+=<>}"), tuple("(/*+-=<>{")
_VECTORS: Mapping[str, str] = {name: rf"\mathbf{{{name}}}" for name in ("L", "N", "R", "g")} | {
    "omega": r"\boldsymbol{\omega}"
}
_TENSORS: Mapping[str, str] = {name: rf"\mathbf{{{name}}}" for name in ("1", "I", "R", "d", "e")} | {
    "I_cm": r"\mathbf{I}_{\mathrm{cm}}"
}
# Words about the motion of a body, in which L alone is the angular momentum, and not a Lagrangian.
_OF_BODIES = re.compile(r"\babout L\b|\bomega\b|\be[123]\b")
_TENSOR = re.compile(r"I_cm|lambda 1|[A-Z]\^T")  # what only formulas of tensors have


def typeset(words: str) -> Iterator[tuple[str, bool]]:
    """The words in pieces, each with whether it is a formula, which then is LaTeX for math mode.

    A formula is a run of symbols, numbers and signs with at least one symbol. The article `a` is none.
    """
    done = 0
    for run in _runs(words):
        for tokens in _formulas(run, words):
            if tokens[0].start() > done:
                yield words[done : tokens[0].start()], False
            done = tokens[-1].end()
            formula = words[tokens[0].start() : done]
            is_vector = formula == "omega" or (formula == "L" and _OF_BODIES.search(words) is not None)
            yield _latex(tokens, formula, is_vector), True
    if done < len(words):
        yield words[done:], False


def _runs(words: str) -> Iterator[list[Token]]:
    """The tokens that follow each other without other text between them."""
    run: list[Token] = []
    for token in _TOKEN.finditer(words):
        if run and run[-1].end() != token.start():
            yield run
            run = []
        run.append(token)
    if run:
        yield run


def _formulas(run: list[Token], words: str) -> Iterator[list[Token]]:
    """The formulas in a run: it is cut at articles, and at brackets whose other half is not in it."""
    for place, token in enumerate(run):
        if _is_article(run, place, words) or _is_open(run, token[0]):
            yield from _formulas(run[:place], words)
            yield from _formulas(run[place + 1 :], words)
            return
    while run and (run[0].lastgroup in ("blank", "power") or run[0][0].strip() in _NO_BEGINNING):
        run = run[1:]
    while run and (run[-1].lastgroup in ("blank", "power", "product") or run[-1][0].strip() in _NO_END):
        run = run[:-1]
    if {"symbol", "coordinate", "differential", "function"} & {token.lastgroup for token in run}:
        yield run


def _is_open(run: Sequence[Token], text: str) -> bool:
    """Whether a text is a bracket, of a kind that opens in the run more or less often than it closes."""
    texts = [token[0] for token in run]
    return any(text in pair and texts.count(pair[0]) != texts.count(pair[1]) for pair in ("()", "{}"))


def _is_article(run: Sequence[Token], place: int, words: str) -> bool:
    """Whether a token is the article `a` (`A` at the beginning of a sentence), and no symbol."""
    token = run[place]
    if token[0] == "A":
        return token.start() == 0 or words[: token.start()].endswith(". ")
    if token[0] != "a":
        return False
    sides = run[:place][::-1], run[place + 1 :]
    beside = [next((near for near in side if near.lastgroup != "blank"), None) for side in sides]
    if any(near is not None and near.lastgroup in ("sign", "power") for near in beside):
        return False
    return None in beside  # a factor of a product has others on both sides


def _latex(tokens: Sequence[Token], formula: str, is_vector: bool = False) -> str:
    bold: Mapping[str, str] = {}
    if _TENSOR.search(formula):
        bold = _TENSORS
    elif is_vector or " x " in formula:
        bold = _VECTORS
    written, place = "", 0
    while place < len(tokens):
        token, place = tokens[place], place + 1
        if token.lastgroup == "power" and place < len(tokens):
            end = _end_of_operand(tokens, place)
            is_bracket = tokens[place][0] == "("
            exponent = tokens[place + 1 : end - 1] if is_bracket else tokens[place:end]
            minus = "-" * token[0].endswith("-")
            written += f"^{{{minus}{_latex(exponent, '')}}}"
            place = end
        else:
            # The square of the vector d is that of its length.
            is_square = token[0] == "d" and [each[0] for each in tokens[place : place + 2]] == ["^", "2"]
            written += _piece(token, {} if is_square else bold)
    return written


def _end_of_operand(tokens: Sequence[Token], place: int) -> int:
    """The place behind the operand that begins here: one token, or all up to a closing bracket."""
    depth = 0
    for end in range(place, len(tokens)):
        depth += (tokens[end][0] == "(") - (tokens[end][0] == ")")
        if depth == 0:
            return end + 1
    return len(tokens)


def _piece(token: Token, bold: Mapping[str, str]) -> str:
    text = token[0]
    match token.lastgroup:
        case "symbol" | "number" if text in bold:
            return bold[text]
        case "symbol" if re.fullmatch("e[123]", text):
            return rf"\mathbf{{e}}_{{{text[1]}}}"
        case "symbol" if re.fullmatch("I[xyz]{2}", text):
            return f"I_{{{text[1:]}}}"
        case "symbol":
            return latex_name(text)
        case "coordinate":
            return latex_name(f"{token['coordinate']}dot")
        case "differential":
            return f"d{latex_name(text[1:])}"
        case "function":
            return rf"\{text}" if text in ("sin", "cos", "tan") else rf"\mathrm{{{text}}}"
        case "product":
            return r"\times "
        case "sign":
            return _SIGNS.get(text, text)
        case "blank":
            return r"\,"
        case "power":
            return ""
    return text
