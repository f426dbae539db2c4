"""The parameters of a document: names, and values that may use each other in any order."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from decimal import Decimal
from graphlib import CycleError, TopologicalSorter
from typing import Any, TypeVar

from rigidcli.errors import ExpressionError, Path, ValueProblem, at, gathered, shown
from rigidcli.fields.environment import Environment
from rigidcli.fields.section import refuse
from rigidcli.fields.units import is_unit
from rigidcli.fields.words import SYMBOLIC, bracketed, folded, mapping_meant, variable_called, with_colon
from rigidcli.language.expression import Expression, parse
from rigidcli.language.text import reading
from rigidcli.language.tree import Constant, Name
from rigidcli.language.words import CONSTANTS, RESERVED
from rigidcli.suggestions import did_you_mean, nearest

_T = TypeVar("_T")

TIME = "t"  # the name of the time, in documents where there is one
MOST_NAMES = 256  # the most names in a mapping: the coordinates and momenta of 128 masses
_NAME = re.compile(r"[^\W\d]\w*")  # A name in a text
# The meanings of reserved names; any other reserved name is a function.
_RESERVED_FOR = {TIME: "the time", **dict.fromkeys(CONSTANTS, "a constant")}


def read_parameters(env: Environment, raw: Any, *, has_time: bool) -> list[ValueProblem]:
    """Put the parameters in `raw` into the environment. Returns their problems, each with its path.

    In a document that `has_time`, `t` is the time, and no parameter.

    In exact arithmetic, a parameter without a value becomes a positive symbol. With floats, such a parameter
    and all that depend on it stay without a value.
    """
    if not isinstance(raw, Mapping):  # its names are not reported as undeclared, too
        env.declare(_NAME.findall(str(raw)))
        return []
    n = env.arithmetic
    raw, slips = bracketed(raw)
    spelling, problems = read_names(raw, has_time=has_time)
    problems += slips
    env.nameless = raw.keys() - spelling.values()
    env.declare([*spelling, *(name for key in env.nameless for name in _NAME.findall(key))])
    parameters = env.declared
    uses: dict[str, frozenset[str]] = {}
    for name, key in spelling.items():
        with gathered(problems, key):
            _require_value(name, raw[key], spelling)
            typed = parameters[name].typed = None if raw[key] is None else env.typed(raw[key])
            uses[name] = typed.names & spelling.keys() if isinstance(typed, Expression) else frozenset()
    for name in in_order(uses, problems, spelling):
        parameters[name] = parameter = parameters.pop(name)
        with gathered(problems, spelling[name]):
            symbols = (parameters[other].symbols for other in uses[name])
            parameter.symbols = frozenset([name] if parameter.typed is None else ()).union(*symbols)
            if parameter.typed is None:
                parameter.value = n.symbol(name, True) if n.exact else None
            elif n.exact or not parameter.symbols:
                parameter.value = env.worked(parameter.typed, None)
            else:
                env.admit(parameter.typed, None)
            parameter.dimension = None if parameter.typed is None else env.dimension(parameter.typed)
            parameter.is_broken = False
    return [problem.below("parameters") for problem in problems]


def _require_value(name: str, value: object, names: Collection[str]) -> None:
    """Raise ValueProblem for a word, or the name itself, where a parameter stays a symbol."""
    word = folded(value) if isinstance(value, str) else None
    hint = None
    if isinstance(value, dict) and "value" in value and {*value} <= {"value", "unit"}:
        hint = f"write `{name}: {value['value']} {value.get('unit', '')}".rstrip() + "`"
    elif isinstance(value, list) and len(value) > 1:
        hint = f"one after another: `--sweep parameters.{name}={','.join(map(str, value))}`"
    if hint is not None:
        raise ValueProblem(f"read {shown(value)}, expected a number", hint=hint)
    if value == name or (word in SYMBOLIC and value not in names):
        hint = f"a symbol has no value: write `{name}: null`"
        raise ValueProblem(f"read {shown(value)}, expected a number, or null for a symbol", hint=hint)


def read_names(raw: Mapping[str, Any], *, has_time: bool = True) -> tuple[dict[str, str], list[ValueProblem]]:
    """The names of a mapping, each with its key as it is typed, and the problems of other keys."""
    spelling: dict[str, str] = {}
    problems: list[ValueProblem] = []
    for key in raw:
        with gathered(problems, key):
            unit = re.fullmatch(r"([^\W\d]\w*) *[(\[]([^\W\d]\w*)[)\]]", key)
            if unit and is_unit(unit[2]) and isinstance(raw[key], int | Decimal):
                hint = f"a unit stands behind the number: write `{unit[1]}: {raw[key]} {unit[2]}`"
                raise ValueProblem(f"read {shown(key)}, expected a name", hint=hint)
            if re.fullmatch(r"[A-Za-z]\w*(?:[ -]+\w+)+", key, re.ASCII):
                hint = f"write `{re.sub('[ -]+', '_', key)}`"
                raise ValueProblem(f"read {shown(key)}, expected a name without blanks", hint=hint)
            name = read_name(key, has_time=has_time)
            if name in spelling:
                raise ValueProblem(f"the same name as {shown(spelling[name])}, in another spelling")
            spelling[name] = key
    return spelling, problems


def read_list(raw: Iterable[object], read: Callable[[Any, int], _T], what: str) -> list[_T]:
    """The entries of a list, each read by a function of the entry and its place.

    Raises ValidationError with the problems of all entries, which are `what`.
    """
    values, problems = list[_T](), list[ValueProblem]()
    for place, entry in enumerate(raw):
        with gathered(problems, place):
            values.append(read(entry, place))
    refuse(what, problems)
    return values


def read_mapping(
    raw: object,
    read: Callable[[str, Any], _T],
    *,
    example: str,
    names: Sequence[str] | None = None,
    needed: Iterable[str] = (),
    besides: Callable[[Mapping[str, str]], Iterable[ValueProblem]] = lambda spelling: (),
    below: Path = (),
) -> dict[str, _T]:
    """The values of a mapping by their names, each read by the function `read`.

    Other names than `names` are refused, if these are given, and all `needed` names must be there. `besides`
    yields further problems, from the names and their keys. The path `below` leads from the value of the field
    to the mapping. Raises ValueProblem, or ValidationError with all problems.
    """
    with at(*below):
        if not isinstance(raw, Mapping):
            cure = mapping_meant(raw, names or (), (*needed,) or names or ())
            message = f"read {shown(raw)}, expected a mapping, such as {example}"
            raise ValueProblem(message, hint=cure and f"write `{cure}`")
        if len(raw) > MOST_NAMES:
            raise ValueProblem(f"read {len(raw)} entries, expected at most {MOST_NAMES}")
    spelling, problems = read_names(raw)
    values, meant = {}, set[str]()
    for name, key in spelling.items():
        with gathered(problems, key):
            if names is not None and name not in names:
                near = variable_called(name, names) or nearest(name, names)
                meant |= {near} if near else set()
                raise ValueProblem(f"unknown name{did_you_mean(near)}", hint=f"expected {', '.join(names)}")
            values[name] = read(name, raw[key])
    if len(spelling) == len(raw):  # what is misspelt may be what it lacks
        missing = [name for name in needed if name not in {*spelling, *meant}]
        problems += [ValueProblem("missing", path=(name,)) for name in missing]
        problems += () if meant else besides(spelling)
    refuse("mapping", [problem.below(*below) for problem in problems])
    return values


def read_name(key: object, *, has_time: bool = True) -> str:
    """The ASCII spelling of a name in a document. Raises ValueProblem for any other text.

    In a document that `has_time`, the name `t` is reserved.
    """
    root = None
    if isinstance(key, str):
        with contextlib.suppress(ExpressionError):
            root = Name(key) if key in RESERVED else parse(key).root
    if isinstance(root, Constant | Name) and root.name in RESERVED and (has_time or root.name != TIME):
        what = _RESERVED_FOR.get(root.name, "a function")
        raise ValueProblem(f"{shown(key)} is reserved: it is {what}, expected another name")
    if not isinstance(root, Name):
        cure = with_colon(key) if isinstance(key, str) and "=" in key else None
        hint = cure and f"write `{cure}`"
        if isinstance(key, str) and (applied := re.match(r"\s*(\w+)\s*\(", key)):
            hint = f"write `{applied[1]}`, without an argument"
        message = f"read {shown(key)}, expected a name: letters, digits and `_`, no digit first"
        if isinstance(key, str) and root is not None and (call := re.fullmatch(r"([a-z]\w*?)(\d+)", key)):
            message = f"read {shown(key)}, which is {reading(root)}, expected another name"
            hint = f"write `{call[1]}_{call[2]}`"
        raise ValueProblem(message, hint=hint)
    return root.name


def in_order(
    uses: Mapping[str, frozenset[str]],
    problems: list[ValueProblem],
    spelling: Mapping[str, str],
    what: str = "parameters",
) -> list[str]:
    """The names, each after those that it uses, without names in a circle and those that depend on one."""
    sorter = TopologicalSorter(uses)
    try:
        sorter.prepare()
    except CycleError as error:  # the names outside of circles come all the same
        *names, _ = reversed(error.args[1])
        first = names.index(min(names))
        circle = [*names[first:], *names[: first + 1]]
        message = f"{what} in a circle: {' -> '.join(circle)}"
        problems.append(ValueProblem(message, path=(spelling[circle[0]],)))
    order: list[str] = []
    while ready := sorter.get_ready():
        order += ready
        sorter.done(*ready)
    return [name for name in order if name in uses]
