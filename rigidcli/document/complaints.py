"""What pydantic complains of, in the words of a document."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from decimal import Decimal
from typing import Any

from pydantic import ValidationError

from rigidcli.errors import Path, ValueProblem, shown
from rigidcli.fields.section import AT_TOP

_TYPES = {
    "tuple_type": "a list, such as [0, 0, 1]",
    "dict_type": "a mapping",
    "model_type": "a mapping",
    "string_type": "a text",
    "bool_type": "true or false",
    "int_type": "a whole number",
    "greater_than_equal": "at least {ge}",
    "less_than_equal": "at most {le}",
}
"""What pydantic's complaints about a type or a bound expect, in the words of a document."""


_FLAT = {
    "inertia": "principal moments are written `moments: [1, 2, 3]`, a tensor by its rows",
    "points": "each point is a list, also a single one: `points: [[m, x, y, z]]`",
}
"""What to write for a list of numbers where one of lists is expected."""


def _with_points(entries: Sequence[object], length: int) -> tuple[str, str] | None:
    """A hint for a list that is too long by the commas of decimals, and the first of those as it is typed.

    None where no such commas make it so long.
    """
    texts, first = [str(entry) for entry in entries], None
    place = 0
    while place + 1 < len(texts) and len(texts) > length:
        whole, decimals = texts[place : place + 2]
        if re.fullmatch(r"-?\d+", whole) and re.fullmatch(r"\d*[1-9]\d*", decimals):
            first = first or f"{whole},{decimals}"
            texts[place : place + 2] = [f"{whole}.{decimals}"]
        place += 1
    if first is None or len(texts) != length:
        return None
    return f"a decimal has a point, as in `[{', '.join(texts)}]`: a comma begins the next entry", first


def explain(error: ValidationError) -> list[ValueProblem]:
    """Every complaint of pydantic, in the document's words."""
    explained: dict[Path, ValueProblem] = {}
    for complaint in error.errors(include_url=False):
        path = tuple(key for key in complaint["loc"] if key != "[key]")  # a key of a mapping is meant itself
        kind, read = complaint["type"], complaint["input"]
        context = complaint.get("ctx", {})
        if isinstance(own := context.get("error"), ValueProblem):
            problem = own.below(*path)
            if own.message == AT_TOP:
                problem.message = f"belongs beside `{path[0]}`, at the top of the document"
        elif kind == "missing" and isinstance(last := path[-1], int):
            # A list that is too short lacks each of its last entries; that is one problem.
            problem = ValueProblem(f"read {shown(read)}, expected {last + 1} entries", path=path[:-1])
        elif kind == "missing":
            problem = ValueProblem("missing", path=path)
        elif kind == "too_short" and len(read) >= context["min_length"]:
            continue  # long enough, but for the entries that have problems of their own
        elif kind in ("too_long", "too_short"):
            bound = context.get("max_length", context.get("min_length"))
            expected = f"at {'most' if kind == 'too_long' else 'least'} {bound}"
            entries = "entry" if bound == 1 else "entries"
            problem = ValueProblem(f"read {shown(read)}, expected {expected} {entries}", path=path)
            if kind == "too_long" and (cure := _with_points(read, context["max_length"])) is not None:
                problem.hint, problem.typed = cure
        elif kind == "tuple_type" and path[:-1] in explained:
            continue
        else:
            problem = _of_type(path, kind, read, context, complaint["msg"])
        explained[problem.path] = problem
    return list(explained.values())


def _of_type(path: Path, kind: str, read: Any, context: Mapping[str, Any], message: str) -> ValueProblem:
    """The problem of a value of the wrong type, or beyond a bound."""
    expected = _TYPES.get(kind, str(context.get("expected", message))).format(**context).replace("'", "")
    problem = ValueProblem(f"read {shown(read)}, expected {expected}", path=path)
    if kind == "tuple_type" and path[-1] == 0:
        # A list of numbers where one of lists is expected: one problem for all its entries.
        problem.message, problem.path = f"read entry {shown(read)}, expected {expected}", path[:-1]
        problem.hint = _FLAT.get(str(path[-2]))
    elif kind == "string_type" and type(read) in (int, float, Decimal):
        problem.hint = f'write it in quotes: "{read}"'
    elif kind == "tuple_type" and isinstance(read, str) and "," in read:
        problem.hint, problem.typed = f"write `[{read.strip('[]() ')}]`", read
    elif kind == "tuple_type" and isinstance(read, dict) and path[-1] == "parts":
        problem.hint = "write `parts: [{...}, {...}]`, where `name` may stand in each of the braces"
    elif kind == "dict_type" and path == ("parameters",):
        names = ", ".join(f"{name}: null" for name in re.findall(r"[^\W\d]\w*", str(read)))
        problem.hint = f"write `parameters: {{{names}}}`, with values where there are some"
    return problem
