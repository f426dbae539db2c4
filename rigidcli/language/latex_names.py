"""Names as LaTeX: what physicists mean by `omega_x`, `x1dot` and `mass`."""

from __future__ import annotations

import re

from rigidcli.language.tokens import GREEK

_LATIN = {
    "omicron": "o", "Alpha": "A", "Beta": "B", "Epsilon": "E", "Zeta": "Z", "Eta": "H", "Iota": "I",
    "Kappa": "K", "Mu": "M", "Nu": "N", "Omicron": "O", "Rho": "P", "Tau": "T", "Chi": "X",
}  # fmt: skip
"""Greek letters that look like Latin ones, for which LaTeX has no commands."""

_COMMANDS = {*GREEK, *map(str.capitalize, GREEK), "hbar", "ell"} - _LATIN.keys()
"""Names that are LaTeX commands as they stand."""

_DECORATED = re.compile(r"(?P<letters>[A-Za-z]+)(?P<digits>[0-9]*)(?P<indices>(?:_[A-Za-z0-9]+)*)")


def latex_name(name: str) -> str:
    r"""An identifier as LaTeX: `omega_x` is `\omega_{x}`, `x1dot` is `\dot{x}_{1}`, `mass` is upright."""
    dots = next((dots for dots in ("ddot", "dot") if name.endswith(dots) and name != dots), "")
    parts = _DECORATED.fullmatch(name.removesuffix(dots))
    if parts is None:
        return rf"\mathrm{{{name}}}".replace("_", r"\_")
    letters = _latex_letters(parts["letters"])
    if dots:
        letters = rf"\{dots}{{{letters}}}"
    indices = [index for index in (parts["digits"], *parts["indices"].split("_")) if index]
    written = ",".join(index if index.isdigit() else latex_name(index) for index in indices)
    return f"{letters}_{{{written}}}" if written else letters


def _latex_letters(letters: str) -> str:
    if letters in _COMMANDS:
        return rf"\{letters}"
    if letters in _LATIN:
        return rf"\mathrm{{{_LATIN[letters]}}}"
    return letters if len(letters) == 1 or letters.isdigit() else rf"\mathrm{{{letters}}}"
