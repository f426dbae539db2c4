"""Problems of a text in the words of a document, from complaints of pydantic and of the parser of YAML.

A parser complains where the text stops making sense, which may be lines after the mistake. The lines before
that place are matched with the table of slips.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from decimal import Decimal
from importlib import resources
from typing import Any, NamedTuple

from pydantic import ValidationError

from rigidcli.errors import UNKNOWN_KEY, Excerpt, Path, Problem, ValueProblem, in_yaml, shown
from rigidcli.fields import words
from rigidcli.fields.units import is_unit

TO_BEGIN = "`rigidcli new` prints a document to start from"  # the hint for what is no document
STANDARD_GRAVITY = 9.80665  # the acceleration (m/s^2) by which a weight is divided for a mass


def explain(error: ValidationError) -> list[ValueProblem]:
    """The problems that pydantic complains of, in the words of a document."""
    explained: dict[tuple[Path, bool], ValueProblem] = {}
    for complaint in error.errors(include_url=False):
        # pydantic marks a complaint about a key itself.
        path = tuple(key for key in complaint["loc"] if key != "[key]")
        kind, read, context = complaint["type"], complaint["input"], complaint.get("ctx", {})
        if isinstance(problem := context.get("error"), ValueProblem):
            problem.below(*path)
        elif kind == "missing" and isinstance(last := path[-1], int):
            # A list that is too short lacks each of its last entries; that is one problem.
            problem = ValueProblem(f"read {shown(read)}, expected {last + 1} entries", path=path[:-1])
            entries = read[0] if len(read) == 1 else None
            if isinstance(entries, str):
                entries = re.split(r"\s*[,;]\s*|\s+", entries.strip())
            if isinstance(entries, list) and len(entries) == last + 1:
                problem.hint = f"write `{in_yaml(entries)}`"
                explained = {place: each for place, each in explained.items() if place[0][:-1] != path[:-1]}
            if len(read) == 2 and isinstance(read[1], list) and len(read[1]) == last:
                problem.hint = f"write `{in_yaml([read[0], *read[1]])}`"
        elif kind == "missing":
            problem = ValueProblem("missing", path=path)
        elif kind == "too_short" and len(read) >= context["min_length"]:
            continue  # it is long enough, and some entries have problems of their own
        elif kind == "tuple_type" and (path[:-1], False) in explained:
            continue
        else:
            problem = _of_type(path, kind, read, context, complaint["msg"])
        key = next((key for key in reversed(problem.path) if isinstance(key, str)), "")
        if (meant := _value_meant(key, read, problem.message)) is not None and (
            problem.hint is None or isinstance(read, str)
        ):
            problem.hint = f"write `{meant}`"
        place = (problem.path, problem.code == UNKNOWN_KEY)
        is_shorter = kind == "missing" and isinstance(path[-1], int)  # the last entry that lacks tells of all
        first = explained.get(place)
        # The advice to put a text in quotes is given only where it has no other problem.
        if first is None or not first.hint or first.code == "parse_error" or is_shorter:
            explained[place] = problem
    cured = {path for (path, unknown), problem in explained.items() if unknown and problem.hint}
    return [each for (path, unknown), each in explained.items() if unknown or each.hint or path not in cured]


def _value_meant(key: str, read: Any, message: str) -> str | None:
    """The value to write in place of one of the wrong type, or of a word; None if nothing is known."""
    if isinstance(read, str):
        return _by_text(key, read, message)
    if isinstance(read, dict):
        return _by_mapping(key, read, message)
    return _by_list(key, read, message) if isinstance(read, list) else None


_MODULES = re.compile(r"\b(?:np|numpy|math|sp|sympy)\.(?=\w)")  # before functions, in Python


def _by_text(key: str, read: str, message: str) -> str | None:
    if key == "section":
        return f"{{at: {read}}}"
    if key == "position" and "expected a list" in message and re.fullmatch(r"[^\W\d]\w*", read):
        return f"[{read}, 0, 0]"
    bare = _MODULES.sub("", read)
    is_function = bare != read and "expected a list" not in message
    if ":" in read and not re.search("time|duration|step|period", key):
        return None
    return words.value_meant(key, read) or (bare if is_function else _number_meant(read, message))


def _by_mapping(key: str, read: Mapping[str, Any], message: str) -> str | None:
    if key == "lagrangian":
        energies = ("kinetic", "potential")
        called = {
            name: [key for key in words.keys_called(name) if key in energies] or [name] for name in read
        }
        return ", ".join(f"{called[name][0]}: {value}" for name, value in read.items())
    if all(value is None for value in read.values()):
        return f"[{', '.join(read)}]" if read and all(name[:1].isdigit() for name in read) else None
    if key == "coordinates" and message.startswith("read"):
        return in_yaml([*read])
    if {*read} == {*"xyz"} and message.startswith("read"):
        return in_yaml([read[axis] for axis in "xyz"])
    if {*read} == {"xyz", "rpy"}:
        position, angles = (words.list_meant(str(value)) for value in (read["xyz"], read["rpy"]))
        return f"{position}` and `rotation: {{rpy: {angles}}}"
    if "value" in read and {*read} <= {"value", "unit"}:
        return f"{read['value']} {read.get('unit', '')}".strip()
    for name, entries, given in words.lists_meant(read, [key]):
        return in_yaml(entries) if name == key and len(given) == len(read) else None
    return None


def _by_list(key: str, read: list[Any], message: str) -> str | None:
    is_mapping = "expected a mapping" in message
    if len(read) == 1 and "expected a" in message and "list" not in message[17:]:
        return in_yaml(read[0]) if isinstance(read[0], dict) == is_mapping else None
    if "expected an acceleration" in message:
        sizes = [str(entry).lstrip("-") for entry in read if entry]
        return sizes[0] if len(sizes) == 1 else None
    if is_mapping and key == "particles" and not any(isinstance(entry, list | dict) for entry in read):
        return in_yaml({"mass": read[0], "position": read[1:]})
    if is_mapping:
        forms = words.FORMS_OF_LISTS.get(f"{key}{len(read)}", ())
        return next((in_yaml({form: read}) for form in forms), None)
    if len(read) == 2 and not isinstance(read[0], str | list | dict):
        if isinstance(read[1], str) and is_unit(read[1]):
            return f"{read[0]} {read[1]}"
        return str(read[1]) if read[0] == 0 and "expected a time" in message else None
    return None


_NOTATIONS: tuple[tuple[str, str, Callable[..., str]], ...] = (
    ("is a force (N), expected a mass", r"(\d+\.?\d*) *N", lambda n: f"{float(n) / STANDARD_GRAVITY:.6g} kg"),
    ("unexpected `,`", r"(-?\d+),(?!\d{3}\b)(\d+)( *[^\W\d].*)?", "{}.{}{}".format),
    ("unit", r"(\S+?) *[xX] *10 *(?:\^|\*\*)? *([-+]?\d+)(.*)", "{}e{}{}".format),
    ("unexpected `.` in a unit", r"(.*\w)\.", "{}".format),
    ("unexpected `~`", r"[ ~]+([^ ~].*)", "{}".format),
    ("", r"(?P<unit>[^\W\d]\w*) +(-?[\d.]+)", "{1} {0}".format),  # cm 5
    ("", r"(-?[\d.]+) *[\[(](?P<unit>[^\W\d]\w*)[\])]", "{} {}".format),  # 5 [cm]
    ("unknown unit `d", r"([\d.]+)d([-+]?\d+)", "{}e{}".format),  # of Fortran
    ("", r"(\d+)(?:'| *ft *)(\d+)(?:\"| *in)?", lambda feet, inches: f"{12 * int(feet) + int(inches)} in"),
    ("", r"(\d+) *h *(\d+)(?: *m(?:in)?)?", lambda hours, minutes: f"{60 * int(hours) + int(minutes)} min"),
    (
        "unexpected `:`",
        r"(?:(\d+):)?(\d+):([0-5]?\d)",
        lambda hours, minutes, s: f"{3600 * int(hours or 0) + 60 * int(minutes) + int(s)} s",
    ),
)
"""Notations of numbers: words of the message, the text, whose `unit` must be one, and the number for it."""


def _number_meant(read: str, message: str) -> str | None:
    """The number that a text in another notation means, such as 1,5 for 1.5."""
    for said, pattern, number in _NOTATIONS:
        if said in message and (match := re.fullmatch(pattern, read)):
            unit = match.groupdict().get("unit")
            return number(*match.groups(default="")) if unit is None or is_unit(unit) else None
    return None


def _of_type(path: Path, kind: str, read: Any, context: Mapping[str, Any], message: str) -> ValueProblem:
    expected = words.EXPECTED.get(kind, str(context.get("expected", message)))
    expected = expected.format(**context).replace("'", "")
    problem = ValueProblem(f"read {shown(read)}, expected {expected}", path=path)
    if kind == "tuple_type" and path[-1] == 0:
        # A list of numbers where one of lists is expected: one problem for all its entries.
        problem.message, problem.path = f"read entry {shown(read)}, expected {expected}", path[:-1]
        problem.hint = next(filter(None, map(words.FLAT_LISTS.get, words.keys_called(str(path[-2])))), None)
        if isinstance(read, str) and (meant := words.list_meant(read)):
            problem.hint = f"each entry is a list: write `{meant}`"
    elif kind == "too_long" and path[-1] == "inertia" and len(read) == 6:
        entries = in_yaml(dict(zip(("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"), read, strict=True)))
        problem.hint = f"name the entries, as in `inertia: {entries}`"
    elif kind == "too_long" and path[-1] in ("inertia", "matrix") and len(read) == 9:
        rows = in_yaml([read[row : row + 3] for row in (0, 3, 6)])
        problem.hint = f"write its rows: `{path[-1]}: {rows}`"
    elif kind == "too_long":
        surplus = len(read) - context["max_length"]
        comma = r"(?<![\w.])(-?\d+), (\d*[1-9]\d*)(?![\w.])"  # two entries may be the decimal `0,5`
        points, mended = re.subn(comma, r"\1.\2", ", ".join(map(str, read)), count=surplus)
        if mended == surplus:
            problem.hint = f"a decimal has a point, as in `[{points}]`: a comma begins the next entry"
    elif kind == "string_type" and type(read) in (int, float, Decimal):
        problem.hint = f'write it in quotes: "{read}"'
    elif kind == "tuple_type" and isinstance(read, str) and (diagonal := words.DIAGONAL.fullmatch(read)):
        problem.hint = f"write `moments: [{diagonal[1]}]`"
    elif kind == "tuple_type" and path[-1] == "times" and (meant := words.times_meant(str(read))):
        problem.hint = meant
    elif kind == "tuple_type" and isinstance(read, str) and (meant := words.list_meant(read)):
        problem.hint, problem.typed = f"write `{meant}`", read
    elif kind == "tuple_type" and isinstance(read, dict) and path[-1] in words.LISTS_OF_MAPPINGS:
        problem.message = "read a mapping, expected a list of mappings"
        problem.hint = f"write `{path[-1]}: [{{...}}, {{...}}]`, {words.LISTS_OF_MAPPINGS[path[-1]]}"
    elif kind == "dict_type" and path == ("parameters",):
        names = ", ".join(f"{name}: null" for name in re.findall(r"[^\W\d]\w*", str(read)))
        if isinstance(read, list) and all(isinstance(entry, dict) for entry in read):
            pairs = [{e["name"]: e["value"]} if {*e} == {"name", "value"} else e for e in read]
            names = in_yaml({name: value for pair in pairs for name, value in pair.items()})[1:-1]
        names = (isinstance(read, str) and words.with_colon(read)) or names
        problem.hint = f"write `parameters: {{{names}}}`, with values where there are some"
    return problem


def markup(text: str, source: str) -> Problem:
    """The problem of a text that is XML or HTML."""
    head = text[:1000].casefold()
    name, hint = next(says.split(": ", 1) for word, says in words.MARKUPS.items() if word in head)
    line = text[: text.index("<")].count("\n")
    excerpt = Excerpt.of(text.splitlines()[line], text.splitlines()[line].index("<") + 1)
    return Problem(source, f"this is {name}, expected YAML", line + 1, "", hint, "parse_error", excerpt)


class Slip(NamedTuple):
    """A slip: the line and column (from 1) where it stands, a message, and a hint."""

    line: int
    column: int
    message: str
    hint: str | None = None


# The table writes KEY for this beginning of a line with a key.
_KEY = r" *(?:- +)*(?P<key>[A-Za-z_]\w*)"
# Characters of a line in which a slip is sought: patterns take long on lines that no person types.
LONGEST_LINE = 500

_TABLE = resources.files("rigidcli.document").joinpath("slips.tsv").read_text("utf-8").splitlines()[1:]
# Slips in a line: the lines where they are sought, a pattern, whose group `at` is the place, message, hint.
_RULES = [line.split("\t") for line in _TABLE]

_QUOTED = re.compile(r"\"(?:[^\"\\]|\\.)*\"|'[^']*'|(?<!\S)#.*")
"""Quoted texts and comments, in which brackets mean nothing."""

_PAIRS = {"{": "}", "[": "]"}  # opening brackets, each with the bracket that closes it


def find_slip(text: str, error: Any) -> Slip | None:
    """The slip behind an error of PyYAML; None for an error without a place."""
    mark = error.problem_mark or error.context_mark
    if mark is None:
        return None
    lines = text.splitlines() or [""]
    noticed, context, problem = min(mark.line, len(lines) - 1), str(error.context), str(error.problem)
    here, sign = Slip(noticed + 1, mark.column + 1, problem), lines[noticed][mark.column : mark.column + 1]
    slip = _by_rules(lines, range(noticed + 1), "above") or _by_rules(lines, [noticed], "here")
    if slip is None and ("flow" not in context or noticed):
        slip = _by_rules(lines, range(noticed + 1), "open")
    if slip is not None:
        return slip
    if "quoted" in context and "escape" in problem:
        hint = "in single quotes a backslash is only a backslash"
        return here._replace(message="this backslash begins no escape", hint=hint)
    if "quoted" in context and (begin := error.context_mark) is not None:
        return Slip(begin.line + 1, begin.column + 1, "this quote is not closed", "close it on its own line")
    if "flow" in context:
        return _in_brackets(lines, noticed, mark.column)
    if "cannot start any token" in problem and sign != "\t":
        hint = f"a text that begins with `{sign}` stands in quotes"
        return here._replace(message="this sign begins no value", hint=hint)
    plain = _QUOTED.sub(lambda match: " " * len(match[0]), lines[noticed])
    for opening, closing in _PAIRS.items():
        if plain.count(closing) > plain.count(opening):
            message = f"this `{closing}` closes no bracket"
            return Slip(noticed + 1, plain.rindex(closing) + 1, message, "leave it out")
    before = lines[noticed][: mark.column]
    if re.fullmatch(r"\s*\w*", before) and ("block" in context or "mapping values" in problem):
        hint = "the entries of a mapping, or of a list, begin in the same column"
        column = len(before) - len(before.lstrip()) + 1
        here = Slip(noticed + 1, column, "the indentation fits no line above", hint)
    if "<document start>" in problem:
        here = here._replace(message="there is text below the end of the document", hint="leave it out")
    written = [n for n in range(noticed) if lines[n].strip() and not lines[n].lstrip().startswith("#")]
    return (
        _by_rules(lines, {noticed, max(noticed - 1, 0)}, "tab")
        or _by_rules(lines, written[:-2:-1], "last")
        or _by_rules(lines, written[:-3:-1], "before")
        or _by_rules(lines, [noticed], "end")
        or here
    )


def _by_rules(lines: list[str], numbers: Iterable[int], where: str) -> Slip | None:
    """The slip in the first of these lines that has one, by the rules for such lines."""
    rules = [(pattern.replace("KEY", _KEY), *says) for of, pattern, *says in _RULES if of == where]
    for number in (number for number in numbers if 0 < len(lines[number]) <= LONGEST_LINE):
        for pattern, message, hint in rules:
            if match := re.match(pattern, lines[number]):
                found = match.groupdict(default="")
                hint = hint.format(meant=words.list_meant(found.get("value", "")), **found)
                return Slip(number + 1, match.start("at") + 1, message, re.sub(" `$", "`", hint))
    return None


def _in_brackets(lines: list[str], line: int, column: int) -> Slip:
    """The slip within brackets: a bracket that is not closed, or a missing comma."""
    opened: list[tuple[int, int, str]] = []
    plain = (_QUOTED.sub(lambda match: " " * len(match[0]), text) for text in lines)
    signs = ((n, place, sign) for n, text in enumerate(plain) for place, sign in enumerate(text))
    for number, place, sign in signs:
        if sign in _PAIRS:
            opened.append((number, place, sign))
        elif opened and sign in _PAIRS.values():
            if _PAIRS[opened[-1][2]] != sign:
                break
            opened.pop()
    if opened:
        number, place, sign = opened[-1]
        hint = f"close the bracket by `{_PAIRS[sign]}`"
        if re.search(r"\s#.*" + re.escape(_PAIRS[sign]), lines[number]):
            hint += ", before `#`: what stands behind it is a comment"
        return Slip(number + 1, place + 1, f"this `{sign}` is not closed", hint)
    before = re.search(r"[\w.]*\W*$", lines[line][:column])
    start = column if before is None or lines[line][column : column + 1] != ":" else before.start()
    hint = "entries are separated by commas, as in `{a: 1, b: 2}`"
    return Slip(line + 1, start + 1, "expected a comma, or the end of this list or mapping", hint)
