"""Lists in other clothes than brackets: unit vectors, tables with bars, transposes, entries told twice."""

from __future__ import annotations

import re
import unicodedata

from rigidcli.language.latex import matrix
from rigidcli.language.statements import cut, without_brackets

AXES = {"i": 0, "j": 1, "k": 2, "x": 0, "y": 1, "z": 2, "1": 0, "2": 1, "3": 2}

_E = "\ue000"
"""The sign that stands before the axis of a unit vector, once it is found."""

_DRESS = r"\\(?:hat|vec|mathbf|mathrm|boldsymbol|bm|bf|widehat|overrightarrow)\s*"
_LATEX_UNIT = re.compile(
    rf"(?:{_DRESS})+\{{?\s*(?:{_DRESS})*\{{?\s*(?:e\s*\}}*\s*_\s*\{{?\s*([xyz123])|\\?([ijk](?:math)?|[xyz]))"
    r"(?![A-Za-z])\s*\}*"
)
_HATTED = re.compile("([ijkxyz])[\u0302\u20d7]|e[\u0302\u20d7]?_?([xyz123])(?![\\w])")
_PLAIN_UNIT = re.compile(r"(?<![A-Za-z_\\])(?:e_?\{?([xyz123])\}?|([ijk]))(?![\w(\ue000])")
_BARE_UNIT = re.compile(r"(?<![A-Za-z_\\])([xyz])(?![\w(])")
_TERM = re.compile(r"\s*(?P<before>[^\ue000]*?)[\s*·]*\ue000(?P<axis>[012])\s*(?P<behind>[^\ue000]*?)\s*")
_NEXT_TERM = re.compile(r"(?<=[\w)\]])\s*(?=[-+])|(?<=[\ue000][012])\s*(?=[-+])")

_TWICE = {
    2: "twice|double|doppelt|zweifach|2 ?[x×]|x ?2|2 ?times|2-?fold|twofold|multiplicity 2|deux fois|doble",
    3: "three times|thrice|triple|dreifach|3 ?x|x ?3|3-?fold|multiplicity 3",
}
_SEVERAL = {
    count: re.compile(rf"\s*[(\[]\s*(?:{words})\s*[)\]]", re.IGNORECASE) for count, words in _TWICE.items()
}
_BOTH_SIGNS = re.compile(
    r"(?P<name>[^=±]*=)?\s*(?P<a>[^=±]+?)\s*(?:±|\+/?-)\s*(?P<b>.*(?:sqrt|√|[A-Za-z(]).*)", re.DOTALL
)
_TRANSPOSED = re.compile(
    r"(?<=[)\]}])\s*(?:\^\s*[({]?\s*(?:\\(?:mathsf|mathrm|text)\s*\{?\s*)?(?:\\top|top|⊤|T|t|tr)\s*[)}]{0,2}|ᵀ|'|\.T)(?!\w)"
)
_SHARED = re.compile(r"(?P<name>\\?[A-Za-zλω]+)_?\{?(?P<one>[1-9₁-₉])\s*,\s*(?P<two>[1-9₁-₉])\}?\s*=")
_CELL = re.compile(r"\s*[-+\u2212]?[\d.,/ ]+")
_ARROWS = str.maketrans({"⟨": "(", "⟩": ")", "〈": "(", "〉": ")", **dict.fromkeys("⎡⎢⎣⎤⎥⎦⎛⎜⎝⎞⎟⎠", " ")})


def undressed(text: str) -> str:
    """The text of a list with brackets, commas and lines only, before LaTeX is read."""
    text = _TRANSPOSED.sub("", text.translate(_ARROWS)).replace(r"\langle", "(").replace(r"\rangle", ")")
    text = re.sub(r"(?s)(\A|=)\s*<([^<>=]*[,;][^<>=]*)>", r"\1 (\2)", text)
    text = _SHARED.sub(r"\g<name>_\g<one> = \g<name>_\g<two> = ", text)
    if not re.search(r"[,;\n]", text):
        text = re.sub(r"\([^()|]+(?:\|[^()|]+)+\)", lambda row: row[0].replace("|", ";"), text)
    lines = text.strip().splitlines()
    if len(lines) > 1 and all(line.lstrip().startswith("- ") for line in lines):  # as in YAML
        return "\n".join(line.lstrip().removeprefix("- ") for line in lines)
    return _from_table(text)


def _from_table(text: str) -> str:
    """A table between bars as lines: `| 8 | -3 |` is `8; -3`."""
    lines = [line.strip() for line in text.strip().splitlines()]
    is_table = all(re.fullmatch(r"\|.*\|", line) for line in lines)
    if not is_table or (len(lines) == 1 and lines[0].count("|") < 4):
        return text
    rows = [line[1:-1].split("|") for line in lines]
    is_rule = re.compile(r"[\s:-]*-[\s:-]*").fullmatch
    rules = [place for place, row in enumerate(rows) if all(map(is_rule, row))]
    below = rows[rules[0] + 1 :] if rules else rows  # what stands above a rule are heads
    if rules and len(below) + 1 == len(rows[0]) and all(map(_CELL.fullmatch, rows[0])):
        below = [*rows[: rules[0]], *below]  # but for the first row of a matrix
    return "\n".join("; ".join(cell.strip() for cell in row) for row in below or rows)


def from_columns(text: str) -> str:
    """Rows of LaTeX without their environment, in which a double backslash is a new line already."""
    if "&" not in text or "[" in text:
        return text
    return matrix(text) if "\n" in text.strip() else text.replace("&", ";")


def spread(entry: str) -> list[str]:
    """The entries that one stands for: `b = c = 11`, `11 (twice)`, and `10 ± sqrt(7)`."""
    *names, value = entry.split("=")
    if len(names) > 1 and all(name.strip(" \\").isidentifier() for name in names):
        several = names[:1] if len(spread(value)) == len(names) else names  # `b = c = 10 ± sqrt(7)` are two
        return [each for name in several for each in spread(f"{name}={value}")]
    for count, words in _SEVERAL.items():
        if words.search(entry):
            return [words.sub("", entry)] * count
    if both := _BOTH_SIGNS.fullmatch(entry):
        return [f"{both['a']} - {both['b']}", f"{both['a']} + {both['b']}"]
    return [entry]


def in_unit_vectors(text: str) -> list[str] | None:
    """The components of a sum such as `2 j + 12 k` or `2 \\hat{y}`, with a unit behind it; or None."""
    text = unicodedata.normalize("NFD", text.replace("\u2212", "-").replace("–", "-"))
    text = re.sub(r"\\[,;:! ]", " ", text).rpartition("=")[2].strip().strip("$").strip()
    found = _LATEX_UNIT.sub(_marked, text)
    for pattern in (_HATTED, _PLAIN_UNIT, _BARE_UNIT):
        found = found if _E in found else pattern.sub(_marked, found)
    if _E not in found or re.search(r"[,;\n]", without_brackets(found)):
        return None
    factor, unit = "", ""
    if whole := re.fullmatch(r"(?s)([^()\ue000]*)\((.*\ue000.*)\)([^()\ue000]*)", found):
        factor, found, unit = (part.strip().rstrip("*·") for part in whole.groups())
    components = ["", "", ""]
    terms = [term for term in cut(found, _NEXT_TERM) if term.strip()]
    for place, term in enumerate(terms):
        parts = _TERM.fullmatch(term)
        if parts is None:
            return None
        before, behind, axis = parts["before"].strip(), parts["behind"].strip(), int(parts["axis"])
        if behind and place == len(terms) - 1 and before:
            unit, behind = unit or behind, ""
        value = before if before not in ("", "+", "-") else f"{before}1"
        value = f"{value}*({behind.lstrip('*· ')})" if behind else value
        components[axis] += f" + ({value})" if components[axis] else value.lstrip("+ ")
    if unit.strip().startswith(("*", "/")):
        return None
    written = [component or "0" for component in components]
    written = [f"({factor})*({component})" for component in written] if factor else written
    return [f"{component} {unit}".strip() for component in written]


def _marked(unit_vector: re.Match[str]) -> str:
    axis = next(filter(None, unit_vector.groups()))
    return f" {_E}{AXES[axis[0]]} "
