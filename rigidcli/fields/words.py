"""Words that people use for shapes and keys, and what a document calls these.

Such a word is refused with a message that names the right one: all documents have the same keys, and editors
know them.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rigidcli.errors import ValueProblem, in_yaml, shown
from rigidcli.suggestions import did_you_mean, nearest

_LINES = Path(__file__).with_name("words.csv").read_text("utf-8").splitlines()
# The kind of a row, a name of the documents, and words that may stand for it.
_ROWS = [line.split(",", 2) for line in _LINES[1:]]
_OF_LISTS = ("entries", "components")  # the kinds of rows with the keys that may stand for a list


def _by_word(kind: str) -> dict[str, tuple[str, ...]]:
    """The names in the rows of this kind by each of their words, in the order of the table."""
    names: dict[str, tuple[str, ...]] = {}
    for row, name, words in _ROWS:
        for word in words.split() if row == kind else ():
            names[word] = (*names.get(word, ()), name)
    return names


def _texts(kind: str) -> dict[str, str]:
    """The texts in the rows of this kind by their names."""
    return {name: text for row, name, text in _ROWS if row == kind}


# Words for bodies that are no shapes: how such a body is written instead, and the words.
OTHER_FORMS = {form: called for called, form in _texts("form").items()}
# Names that are no units, because readers may take them for something else: the reason, and a hint.
NO_UNITS = _texts("no unit")
EXPECTED = _texts("expected")  # what pydantic expects, by the type of its error, in the words of a document
# The shapes that a word may mean; the other keys of the body decide between them.
SHAPES_BY_WORD = _by_word("shape")
# Shapes that are easily confused with another shape; the given keys decide.
RELATIVES = _texts("relative")
# The keys that a word may mean: the first one that the section has and that is not given yet.
KEYS_BY_WORD = _by_word("key")
# The keys of half the quantity that a word names, such as the radius for a diameter.
HALVED = _by_word("half")
# Keys with a list for which several keys may stand; components that are not given are zero.
LISTS = [(key, words.split(), kind == "components") for kind, key, words in _ROWS if kind in _OF_LISTS]
HINTS = _texts("hint")  # the hints for keys that no section has
FLAT_LISTS = _texts("flat")  # the cures for a list of numbers under keys that expect lists in it
LISTS_OF_MAPPINGS = _texts("mappings")  # what is said of a mapping under keys that expect several in a list
MARKUPS = _texts("markup")  # texts that begin as XML does, by a word in them: what they are, and the cure
# Units for words, also of other languages; and for what homework writes, in these very letters.
UNITS_BY_WORD, SPELLED_UNITS = _by_word("unit"), _by_word("spelled")
STARTERS = _by_word("new")  # the kinds of starters for which a word may stand
# Words for the velocity and the momentum of a coordinate {0}, the {1}-th one, and for the coordinate itself,
# also under `forces`; and words for each of these where there is only one.
_VARIABLES = {kind: words for kind, name, words in _ROWS if "{0}" in name}
_ONLY = _by_word("only")
# The key that a list without a key belongs to, by the key above it and the number of its entries.
FORMS_OF_LISTS = _by_word("whole")
# Words that stand for the value of a parameter that has none; a document says `null`.
SYMBOLIC = _by_word("symbol")
# Adjectives before the name of a shape that do not make it another shape.
_ADJECTIVES = re.compile(r"^(solid|uniform|homogeneous|thin|full|round|circular|straight|flat)_")


def folded(word: str) -> str:
    """A word in the spelling of keys: `Hollow cylinder` and `- hollowCylinder` are `hollow_cylinder`."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", word.strip(" \t-*•\"'“”„‘’`"))
    return re.sub(r"[\s\-]+", "_", words.casefold())


def value_meant(key: str, word: str) -> str | None:
    """What is written for a word such as `z` under `axis`, or the name of a material under `density`."""
    kinds = [f"={called}" for called in (key, *keys_called(key))]
    rows = [(name, words.split()) for kind, name, words in _ROWS if kind in kinds]
    name = next((name for name, words in rows if word.casefold() in words), None)
    return name.replace(" ", ", ") if name and name[0] == "[" else name


def lists_meant(raw: Mapping[str, Any], keys: Collection[str]) -> Iterator[tuple[str, list[Any], list[str]]]:
    """The lists for which several keys of a mapping stand: the key of each, its entries, and the typed keys.

    `keys` are those that a section has: what is given of them already is not meant by others.
    """
    typed = {folded(key): key for key in raw if key not in keys}
    for key, words, may_be_zero in LISTS if typed else ():
        found = [typed[word] for word in words if word in typed]
        if key in keys and raw.get(key) is None and (len(found) == len(words) or (found and may_be_zero)):
            yield key, [raw[typed[word]] if word in typed else 0 for word in words], found
            typed = {word: name for word, name in typed.items() if name not in found}
            raw = {**raw, key: found}


def shapes_called(word: str) -> tuple[str, ...]:
    """The shapes for which a word may stand; none for other words."""
    plain = folded(word)
    bare = _ADJECTIVES.sub("", plain)
    return SHAPES_BY_WORD.get(plain) or SHAPES_BY_WORD.get(bare, (bare,))


def other_form(word: str) -> str | None:
    """How a body that is no shape is written, if the word is one for such a body."""
    return next((form for form, words in OTHER_FORMS.items() if folded(word) in words.split()), None)


# A key and its value in a text that is no mapping by mistake.
_PAIR = re.compile(r"([A-Za-z_]\w*)\s*[:=：]\s*(.+?)(?=[,;\s]\s*[A-Za-z_]\w*\s*[:=：]|\s*$)", re.DOTALL)


def with_colon(typed: str) -> str | None:
    """The YAML for `shape cube` or `shape:cube side = 1`: `shape: cube, side: 1`; None for other texts."""
    pairs = _PAIR.findall(typed[:1000]) or re.findall(r"^\s*([A-Za-z_]\w*)\s+(\S+)\s*$", typed)
    if not pairs or not re.match(r"[\s({]*" + pairs[0][0], typed):
        return None
    if pairs[0][1].startswith("{") and typed.count("{") == typed.count("}"):
        return re.sub(r"([A-Za-z_]\w*)\s*[:=：]\s*", r"\1: ", typed.strip())
    values = (value[0] + "..." if value[0] in "{[" and value[-1] not in "}]" else value for _, value in pairs)
    return ", ".join(
        f"{key}: {value.lstrip('= ').rstrip(',;)} ')}" for (key, _), value in zip(pairs, values, strict=True)
    )


def halved(word: str) -> tuple[str, ...]:
    """The keys that hold half of the quantity that a word names; none for other words."""
    return HALVED.get(folded(word), ())


_DIGITS = re.compile(r"-?\.?\d")  # the beginning of a number


def list_meant(typed: str) -> str | None:
    """The list `[1, 2, 3]` for `1, 2, 3`, `1 2 3`, `1; 2; 3` or `(1, 2, 3)`; None for other texts."""
    lines = [line for line in typed.splitlines() if line.strip()]
    if len(lines) > 1:
        rows = [list_meant(line) or "" for line in lines]
        return f"[{', '.join(rows)}]" if all(rows) else None
    sizes = r"(?:(?<=\d)\s*|\s+)[x×]\s*(?=[\d.])"
    unit = re.search(r"(?<=[\d)>\]}])\s*([^\W\d][^\W\d]*(?:[/^*]\w+)*)$", typed.strip()[-20:])
    if unit and not re.search(r"[)>\]}]", typed) and not re.search(sizes, typed[:60]):
        unit = None
    bare = typed.strip().removesuffix(unit[1] if unit else "").strip("[](){}<> ")
    by = next((sign for sign in ";," if sign in bare), sizes if re.search(sizes, bare) else r"\s+")
    entries = re.split(rf"\s*(?:{by})\s*", bare)
    if len(entries) < 2 or "(" in bare or not ("," in bare or all(map(_DIGITS.match, entries))):
        return None
    return in_yaml(
        [f"{entry} {unit[1]}" if unit and not entry.endswith(unit[1]) else entry for entry in entries]
    )


def variable_called(word: str, variables: Collection[str]) -> str | None:
    """The variable for which a word may stand: `xdot` for `vx`, `x` for `x0` and for the force `Q_x`."""
    if (omega := re.fullmatch(r"omega_?([123xyz])", word)) and f"w{omega[1]}" in variables:
        return f"w{omega[1]}"
    word = re.sub(r"(_?0|_?init(ial)?|\((0|t)\))$", "", word)  # initial values
    if word in variables:
        return word
    momenta = [name for name in variables if name.startswith("p_")]
    velocities = [name for name in variables if name.endswith("dot")]
    others = [name for name in variables if name not in (*momenta, *velocities)]
    rest = "coordinate" if momenta or velocities else "force"
    for kind, names in (("velocity", velocities), ("momentum", momenta), (rest, others)):
        if len(names) == 1 and kind in _ONLY.get(word, ()):
            return names[0]
        for number, name in enumerate(names, start=1):
            coordinate = name.removesuffix("dot").removeprefix("p_")
            if word in _VARIABLES[kind].format(coordinate, number).split():
                return name
    return None


def mapping_meant(raw: object, names: Sequence[str], needed: Collection[str]) -> str | None:
    """The mapping `{x: 1, p_x: 0}` for values without keys, in the order of the `names`; None if unclear."""
    if isinstance(raw, str) and (function := re.fullmatch(r"\s*\[?(\w+)\(([\w, ]+)\)\]?\s*", raw)):
        return f"{{{function[1]}: [{function[2]}]}}"
    if isinstance(raw, str) and "=" in raw and (pairs := with_colon(raw)):
        return f"{{{pairs}}}"
    entries = raw if isinstance(raw, list) else [raw]
    if isinstance(raw, list) and len(raw) == 1 and isinstance(raw[0], str) and not names:
        return mapping_meant(raw[0], names, needed)
    plain = not any(isinstance(entry, dict | list | bool) or entry is None for entry in entries)
    if not plain or len(entries) not in (len(needed), 2 * len(needed)) or len(entries) > len(names):
        return None
    return in_yaml(dict(zip(names, entries, strict=False)))


def keys_called(word: str) -> tuple[str, ...]:
    """The keys for which a word may stand, its own spelling as a key among them."""
    plain, names = folded(word), KEYS_BY_WORD.get(word)
    return (plain, *KEYS_BY_WORD.get(plain, ())) if names is None else (*names, plain)


DIAGONAL = re.compile(r"diag\(\[?([^()\[\]]*)\]?\)")  # a diagonal matrix, as in Python
# Times from a beginning to an end, and their number or step: `0:10:100`, `linspace(0, 10, 100)`.
_SPAN = re.compile(r"(?:np\.)?(?:(linspace|arange)\(|())0(?:\.0*)?([:,]) *([^:,]+)\3 *([^:,()]+)\)?")


def times_meant(typed: str) -> str | None:
    """The cure for a function of Python, or a range, in place of times; None for other texts."""
    span = _SPAN.fullmatch(typed)
    count = "step" if span and span[1] == "arange" else "samples"
    return span and f"instead write `duration: {span[4]}` and `{count}: {span[5]}`"


AS_WRITTEN = "write `{}`: a colon, and a blank after it"  # for a key and its value that are one text


def bracketed(raw: Mapping[str, Any]) -> tuple[dict[str, Any], list[ValueProblem]]:
    """A mapping with values joined that commas have cut, such as `{size: 1, 2, 3}`, and their problems."""
    groups: list[tuple[str, list[Any]]] = []
    for key, value in raw.items():
        last = groups[-1][1][-1] if groups else None
        text = last if isinstance(last, str) and not _DIGITS.match(last.lstrip("(")) else ""
        if text.count("(") > text.count(")"):
            groups[-1][1][-1] = f"{last}, {key}" if value is None else f"{last}, {key}: {value}"
        elif groups and value is None and _DIGITS.match(key):
            groups[-1][1].append(key)
        else:
            groups.append((key, [value]))
    mended: dict[str, Any] = {}
    problems = list[ValueProblem]()
    for key, entries in groups:
        mended[key] = entries[0]
        if len(entries) == 1 and entries[0] is not raw[key]:
            cure = f'write `{key}: "{entries[0]}"`'
            slip = ValueProblem("in braces a text with a comma stands in quotes", path=(key,), hint=cure)
            slip.typed, slip.code = str(raw[key]), "parse_error"
            problems.append(slip)
        if len(entries) > 1:
            entries = [entry.strip(" ()<>") if isinstance(entry, str) else entry for entry in entries]
            typed, cure = ", ".join(map(str, entries)), f"write `{key}: {in_yaml(entries)}`"
            message, mended[key] = "a list stands in brackets", entries
            if len(entries) == 2 and entries[1][0].isdigit():  # the comma may be that of a decimal
                mended[key] = ".".join(map(str, entries))
                message = f"read `{entries[0]}` and `{entries[1]}`: the sign in a decimal is a point"
                if re.match(r"\d{3}\.", entries[1]):
                    mended[key] = "".join(map(str, entries))
                    message = f"read `{entries[0]}` and `{entries[1]}`: thousands stand without a comma"
                cure = f"write `{key}: {mended[key]}`, or a list in brackets"
            problems.append(ValueProblem(message, path=(key,), hint=cure, typed=typed))
    return mended, problems


def key_slip(key: str, keys: Collection[str]) -> ValueProblem | None:
    """The problem of a key such as `shape:cube`, which is one of the `keys` with its value."""
    cure = None if folded(key) in keys else with_colon(key)
    if cure is None or {cure.partition(":")[0], *keys_called(cure.partition(":")[0])}.isdisjoint(keys):
        return None
    return ValueProblem("no key and value", hint=AS_WRITTEN.format(cure), typed=key)


def not_one_of(raw: object, words: Sequence[str]) -> str:
    """The message for a value that is none of the `words`."""
    called = [key for key in keys_called(raw) if key in words] if isinstance(raw, str) else []
    near = called[0] if called else nearest(raw, words) if isinstance(raw, str) else None
    if near is not None:
        return f"read {shown(raw)}{did_you_mean(near)}"
    return f"read {shown(raw)}, expected one of {', '.join(words)}"
