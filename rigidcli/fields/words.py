"""Words that people use for shapes and keys, and what a document calls these.

No such word is read as if it were the document's own: an answer to it names the right word, so that a file
looks alike whoever wrote it, and editors know its keys.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from importlib import resources
from typing import Any

from rigidcli.errors import ValueProblem, nearest, shown

OTHER_FORMS = {
    "points: [[1, 0, 0, 0]]": "point particle point_mass pointmass points mass_point molecule point_masses",
    "points: [[1, 0, 0, -1], [1, 0, 0, 1]]": "dumbbell dumb_bell barbell two_balls two_masses",
    "moments: [1, 2, 3]": "tensor inertia_tensor inertia rigid_body top gyroscope",
    "parts: [{shape: sphere, radius: 1, mass: 1}]": "composite compound union group assembly difference",
}
"""Words for bodies that are no shapes: how such a body is written instead, and the words."""

_LINES = resources.files("rigidcli.fields").joinpath("words.csv").read_text("utf-8").splitlines()

_ROWS = [line.split(",") for line in _LINES[1:]]
"""The kind of a row, a name of the documents, and words that may stand for it."""


def _by_word(kind: str) -> dict[str, tuple[str, ...]]:
    """The names in the rows of this kind by their words; of several names the first ones are meant first."""
    names: dict[str, tuple[str, ...]] = {}
    for row, name, words in _ROWS:
        for word in words.split() if row == kind else ():
            names[word] = (*names.get(word, ()), name)
    return names


SHAPES_BY_WORD = _by_word("shape")
"""The shapes for which a word may stand; of several the one that has the other keys is meant."""

RELATIVES = {name: words for row, name, words in _ROWS if row == "relative"}
"""Shapes that are easily taken for another shape, and are meant where the keys are their own."""

KEYS_BY_WORD = _by_word("key")
"""The keys for which a word may stand; the first that a section has, and that is not there yet, is meant."""

HALVED = _by_word("half")
"""The keys of half the quantity that a word names, such as the radius for a diameter."""

SYMBOLIC = _by_word("symbol")
"""Words that stand for the value of a parameter that has none; a document says `null`."""

_ADJECTIVES = re.compile(r"^(solid|uniform|homogeneous|thin|full|round|circular|straight|flat)_")
"""Adjectives before the name of a shape that do not make it another shape."""


def folded(word: str) -> str:
    """A word in the spelling of keys: `Hollow cylinder` is `hollow_cylinder`."""
    return re.sub(r"[\s\-]+", "_", word.strip().casefold())


def shapes_called(word: str) -> tuple[str, ...]:
    """The shapes for which a word may stand; none for other words."""
    plain = folded(word)
    bare = _ADJECTIVES.sub("", plain)
    if bare != plain and plain not in SHAPES_BY_WORD:
        return SHAPES_BY_WORD.get(bare, (bare,))
    return SHAPES_BY_WORD.get(plain, (plain,))


def other_form(word: str) -> str | None:
    """How a body that is no shape is written, if the word is one for such a body."""
    return next((form for form, words in OTHER_FORMS.items() if folded(word) in words.split()), None)


def with_colon(typed: str) -> str | None:
    """What was meant by `shape cube`, `shape:cube` or `shape = cube`: `shape: cube`; None for other texts."""
    typo = re.fullmatch(r"\s*([A-Za-z_]\w*)(?:\s*[:=]\s*(.+?)|\s+(\S+))\s*", typed, re.DOTALL)
    if typo is None:
        return None
    value = re.split(r"\s+[A-Za-z_]\w*\s*[:=]", typo[2] or typo[3])[0]  # without the keys that follow
    return f"{typo[1]}: {value[0] + '...' if value[0] in '{[' else value}"


def halved(word: str) -> tuple[str, ...]:
    """The keys that hold half of the quantity that a word names; none for other words."""
    return HALVED.get(folded(word), ())


_DIGITS = re.compile(r"-?\.?\d")
"""The beginning of a number."""


def list_meant(typed: str) -> str | None:
    """The list `[1, 2, 3]` that was meant by `1, 2, 3`, `1 2 3`, `1; 2; 3` or `(1, 2, 3)`, if it was."""
    bare = typed.strip("[]() ")
    entries = re.split(r"\s*;\s*" if ";" in bare else r"\s*,\s*" if "," in bare else r"\s+", bare)
    numbers = "," in bare or all(map(_DIGITS.match, entries))
    return f"[{', '.join(entries)}]" if numbers and len(entries) > 1 else None


_VELOCITY = "v{0} v_{0} {0}_dot {0}d d{0} d{0}dt d{0}_dt {0}prime {0}_prime vel_{0} velocity_{0}"
"""Words for the velocity of a coordinate that has the name {0}."""


def variable_called(word: str, variables: Iterable[str]) -> str | None:
    """The velocity or momentum among some variables for which a word may stand: `xdot` for `vx`."""
    momenta = [name for name in variables if name.startswith("p_")]
    velocities = [name for name in variables if name.endswith("dot")]
    for only, words in ((velocities, ("v", "vel", "velocity")), (momenta, ("p", "momentum"))):
        if len(only) == 1 and word in words:
            return only[0]
    called = (name for name in velocities if word in _VELOCITY.format(name.removesuffix("dot")).split())
    return next(called, None)


def keys_called(word: str) -> tuple[str, ...]:
    """The keys for which a word may stand; none for other words."""
    return KEYS_BY_WORD.get(word) or KEYS_BY_WORD.get(folded(word), ())


AS_WRITTEN = "write `{}`: a colon, and a blank after it"
"""The hint for a key and its value that have become one text."""


def bracketed(raw: Mapping[str, Any]) -> tuple[dict[str, Any], list[ValueProblem]]:
    """A mapping with lists for `size: 1, 2, 3` in braces, with the problems of the keys 2 and 3."""
    groups: list[tuple[str, list[Any]]] = []
    for key, value in raw.items():
        if groups and value is None and _DIGITS.match(key):
            groups[-1][1].append(key)
        else:
            groups.append((key, [value]))
    mended: dict[str, Any] = {}
    problems = list[ValueProblem]()
    for key, entries in groups:
        if len(entries) > 2:  # of two, the comma may be that of a decimal
            typed = ", ".join(map(str, entries))
            hint = f"write `{key}: [{typed}]`"
            problems.append(ValueProblem("a list stands in brackets", path=(key,), hint=hint, typed=typed))
            mended[key] = entries
        else:
            mended |= {key: entries[0], **dict.fromkeys(entries[1:])}
    return mended, problems


def key_slip(key: str, keys: Collection[str]) -> ValueProblem | None:
    """The problem of a key such as `shape:cube`, which is one of the `keys` with its value."""
    if key[:1].isdigit():
        hint = (
            "a comma begins the next entry; the sign in a decimal is a point, and a list stands in brackets"
        )
        return ValueProblem("no key and value", hint=hint, typed=key)
    cure = with_colon(key)
    if cure is None or {cure.partition(":")[0], *keys_called(cure.partition(":")[0])}.isdisjoint(keys):
        return None
    return ValueProblem("no key and value", hint=AS_WRITTEN.format(cure), typed=key)


def not_one_of(raw: object, words: Sequence[str]) -> str:
    """The message for a value that is none of the `words`."""
    called = [key for key in keys_called(raw) if key in words] if isinstance(raw, str) else []
    near = called[0] if called else nearest(raw, list(words)) if isinstance(raw, str) else None
    if near is not None:
        return f"read {shown(raw)} (did you mean {near}?)"
    return f"read {shown(raw)}, expected one of {', '.join(words)}"
