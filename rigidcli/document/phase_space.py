"""Phase space in a document: names, an equilibrium, new variables, observables and Poisson brackets."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple, TypeAlias

from pydantic import Field, ValidationInfo
from pydantic.json_schema import JsonSchemaValue

from rigidcli.document.parameters import MOST_NAMES, in_order, read_list, read_mapping, read_name, read_names
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.environment import Environment
from rigidcli.fields.section import ReadBy, Section, environment, optional, refuse
from rigidcli.fields.words import list_meant
from rigidcli.language.expression import Expression

MOST_COORDINATES = MOST_NAMES // 2  # the most coordinates of a system, which have as many momenta
EXPRESSION_SCHEMA: JsonSchemaValue = {"type": ["number", "string"]}
EXPRESSIONS_SCHEMA: JsonSchemaValue = {"type": "object", "additionalProperties": EXPRESSION_SCHEMA}


def names_schema(least: int, most: int) -> JsonSchemaValue:
    """JSON Schema of a list of names, or of names in a text."""
    names = {"type": "array", "items": {"type": "string"}, "minItems": least, "maxItems": most}
    names["description"] = "A list of names"
    return {"anyOf": [names, {"type": "string", "description": "Names with commas between them"}]}


# Meanings of names, in messages.
MULTIPLIER, OBSERVABLE = "the multiplier of a constraint", "one of the observables"
# The names of a coordinate's velocity, of its momentum, and of its second derivative.
velocity, momentum, acceleration = "{}dot".format, "p_{}".format, "{}ddot".format


def derived_names(coordinate: str) -> dict[str, str]:
    """The names of the velocity, the momentum and the acceleration of a coordinate, each with its meaning."""
    kinds = {"velocity": velocity, "momentum": momentum, "acceleration": acceleration}
    return {of(coordinate): f"the {kind} of `{coordinate}`" for kind, of in kinds.items()}


def read_new_names(
    raw: object, info: ValidationInfo, most: int, what: str, derived: Callable[[str], dict[str, str]]
) -> tuple[str, ...]:
    """The new names in a list, each with names `derived` from it, which mean something from now on.

    Names that have a meaning already are refused. Raises ValidationError with all problems.
    """
    env = environment(info)
    if isinstance(raw, str):
        raw = re.split(r"(?:[,;\s]|\b(?:and|und|et)\b|&)+", raw.strip("[](){} "))
    if not isinstance(raw, list | tuple):
        raise ValueProblem(f"read {shown(raw)}, expected a list of {what}, such as [x, y]")
    if not 1 <= len(raw) <= most:
        raise ValueProblem(f"read {shown(raw)}, expected 1 to {most} {what}")
    names = set[str]()

    def read(entry: object, place: int) -> str:
        name = read_name(entry)
        if name in names:
            raise ValueProblem(f"{shown(entry)} stands here already")
        take(env, {name: f"one of the {what}", **derived(name)})
        names.add(name)
        return name

    return tuple(read_list(raw, read, what))


def read_equation(raw: object, read: Callable[[object], Expression], expected: str, hint: str) -> Expression:
    """The left side minus the right side of an equation, or an expression alone.

    Raises ValueProblem. For an inequality it has the `hint`, and says what is `expected` instead.
    """
    text = raw.replace("==", "=") if isinstance(raw, str) else ""
    if any(sign in text for sign in "<>\u2264\u2265"):
        raise ValueProblem(f"read {shown(raw)}: an inequality, expected {expected}", hint=hint)
    if "=" not in text:
        return read(raw)
    sides = text.split("=")
    if len(sides) > 2:
        raise ValueProblem(f"read {shown(raw)}: {len(sides)} sides, expected one equation")
    left, right = map(read, sides)
    return Expression(text, left.root - right.root, left.names | right.names)


def take(env: Environment, meanings: Mapping[str, str]) -> None:
    """Log the meanings of a name and of others that follow from it; a parameter with such a name is refused.

    Raises ValueProblem for a name that has a meaning already.
    """
    taken = {"H": "the Hamiltonian", **env.names.meanings}
    for place, (name, meaning) in enumerate(meanings.items()):
        if name in taken and place:
            raise ValueProblem(f"`{name}` would be {meaning}, and {taken[name]}")
        if name in taken:
            raise ValueProblem(f"`{name}` is {taken[name]}, expected another name")
    for name in meanings.keys() & env.declared.keys():
        message = f"`{name}` is {meanings[name]}, expected another name for a parameter"
        env.log.faults[name] = ValueProblem(message)
    env.names.meanings |= meanings


@dataclass(frozen=True, slots=True)
class Equilibrium:
    """Values of all coordinates, in the parameters. If it `is_sought`, they are the start of the search.

    Coordinates with values of their `momenta`, and the one that is `steady`, are cyclic, and turn at constant
    rates; these have no values.
    """

    values: Mapping[str, Expression]
    is_sought: bool
    momenta: Mapping[str, Expression]
    steady: str | None = None

    @property
    def turning(self) -> tuple[str, ...]:
        """The coordinates that turn at constant rates."""
        return (*self.momenta, *(() if self.steady is None else (self.steady,)))


def _read_equilibrium(raw: object, info: ValidationInfo) -> Equilibrium:
    """The equilibrium in a document: `{theta: pi}`, `{find: {theta: 3}}`, or that of a steady motion.

    Raises ValueProblem, or ValidationError with all problems.
    """
    env = environment(info)
    names = env.names.coordinates or ()
    if names and raw in (True, "find"):
        hint = f"write `{{find: {{{', '.join(f'{name}: 0' for name in names)}}}}}`, with values near it"
        raise ValueProblem(f"read {shown(raw)}, expected where to look for it", hint=hint)
    typed: Mapping[str, Any] = raw if isinstance(raw, Mapping) else {}
    spelling, of_momenta = read_names(typed)[0], {momentum(name): name for name in names}
    momenta = {of_momenta[name]: key for name, key in spelling.items() if name in of_momenta}
    steadily = {key for key, value in typed.items() if str(value).strip().lower() == "steady"}
    turning = {name: key for name, key in spelling.items() if name in names and key in steadily}
    steady, problems = next(iter(turning), None), list[ValueProblem]()
    for name, key in spelling.items():
        if name in turning and name != steady:
            hint = f"give its momentum instead: `{momentum(name)}: J`"
            problems.append(ValueProblem(f"`{steady}` is steady already", path=(key,), hint=hint))
        if name in momenta:
            message = f"read `{momentum(name)}` besides, expected one of the two"
            problems.append(ValueProblem(message, path=(key,)))
    of_cyclic = (*momenta.values(), *turning.values())
    given = {key: value for key, value in typed.items() if key not in of_cyclic}
    is_sought = given.keys() == {"find"} and "find" not in names
    if is_sought and steady is not None:
        hint = f"write `{momentum(steady)}: J`, or give the other coordinates without `find`"
        problems.append(ValueProblem("`find` needs a fixed momentum", path=(turning[steady],), hint=hint))
    inside = given["find"] if is_sought and isinstance(given["find"], Mapping) else {}
    for name, key in read_names(inside)[0].items():
        if name in of_momenta:
            hint = f"write `{{{name}: {inside[key]}, find: {{...}}}}`"
            problems.append(ValueProblem("belongs beside `find`", path=("find", key), hint=hint))
    kept = [name for name in names if name not in turning and name not in momenta]
    if names and not kept and not problems:
        problems.append(ValueProblem("no coordinate is left that rests at the equilibrium"))
    refuse("equilibrium", problems)

    def read(name: str, value: object) -> Expression:
        return env.symbolic(value)

    pairs = {key: typed[key] for key in momenta.values()}
    fixed = read_mapping(pairs, read, example="{p_phi: J}", names=tuple(of_momenta))
    values = read_mapping(
        given["find"] if is_sought else given if typed is raw else raw,
        read,
        example="{theta: 0}, {theta: 1, phi: steady}, or near it {find: {theta: 3}}",
        names=env.names.coordinates,
        needed=kept,
        below=("find",) if is_sought else (),
    )
    values = {name: values[name] for name in kept if name in values} or values  # in the order of the vectors
    return Equilibrium(values, is_sought, {of_momenta[name]: e for name, e in fixed.items()}, steady)


_SOUGHT = {"type": "object", "properties": {"find": {"title": "Find", **EXPRESSIONS_SCHEMA}}}
EQUILIBRIUM = ReadBy(_read_equilibrium, {"anyOf": [EXPRESSIONS_SCHEMA, _SOUGHT]})


def _read_new_variables(raw: object, info: ValidationInfo) -> tuple[str, ...]:
    count = 2 * len(environment(info).names.coordinates or ())
    names = read_new_names(raw, info, MOST_NAMES, "new variables", lambda name: {})
    if len(names) % 2:
        hint = "new coordinates first, then their momenta in the same order, as in [Q1, Q2, P1, P2]"
        raise ValueProblem(f"read {len(names)} names, expected an even number of them", hint=hint)
    if count and len(names) != count:
        why = "as many as there are coordinates and momenta"
        raise ValueProblem(f"read {len(names)} names, expected {count}: {why}")
    return names


def _read_side(raw: object, info: ValidationInfo) -> dict[str, Expression]:
    """The variables of one side as expressions in those of the other; the name of the field is the side."""
    env = environment(info)
    new: tuple[str, ...] | None = info.data.get("new_variables")
    coordinates = env.names.coordinates
    old = None if coordinates is None else (*coordinates, *map(momentum, coordinates))
    side, other = (new, old) if info.field_name == "new" else (old, new)

    variables = None if other is None else (*other, "t")
    given = read_mapping(
        raw,
        lambda name, value: env.symbolic(value, None, variables),
        example="{x: Q + P, p_x: P}",
        names=side,
        needed=side or (),
    )
    return {name: given[name] for name in side or given}


def _read_generating(raw: object, info: ValidationInfo) -> Expression:
    """A generating function of half of the old variables, half of the new ones, and t.

    The new ones may be in pairs, [Q1, P1, Q2, P2], if the function tells so.
    """
    env, new = environment(info), info.data.get("new_variables")
    if env.names.coordinates is None or new is None:
        return env.symbolic(raw, None, None)
    half, kind = len(new) // 2, str(info.field_name)
    old = env.names.coordinates if kind in ("F1", "F2") else tuple(map(momentum, env.names.coordinates))
    orders = ((new[:half], new[half:]), (new[::2], new[1::2]))
    first, paired = (coordinates if kind in ("F1", "F3") else momenta for coordinates, momenta in orders)
    variables = (*old, *first)
    try:
        return env.symbolic(raw, None, (*variables, "t"))
    except ValueProblem as problem:
        with suppress(ValueProblem):
            return env.symbolic(raw, None, (*old, *paired, "t"))
        if problem.hint is None:
            problem.hint = f"{kind} is a function of {', '.join(variables)} and t"
        raise


Generating: TypeAlias = Annotated[Expression, ReadBy(_read_generating, EXPRESSION_SCHEMA)]
Side: TypeAlias = Annotated[dict[str, Expression], ReadBy(_read_side, EXPRESSIONS_SCHEMA)]
NewVariables: TypeAlias = Annotated[tuple[str, ...], ReadBy(_read_new_variables, names_schema(2, MOST_NAMES))]


class Transform(Section):
    """New variables of phase space: half of them coordinates, then their momenta in the same order."""

    GENERATING: ClassVar = ("F1", "F2", "F3", "F4")
    ONE_OF: ClassVar = ("old", "new", *GENERATING)

    # The first to be read: the expressions are in these names.
    new_variables: NewVariables = Field(
        description="New coordinates, then their momenta in the same order: [Q1, Q2, P1, P2]"
    )
    old: Side | None = optional("Old coordinates and momenta, as expressions in the new variables and t")
    new: Side | None = optional("New variables, as expressions in the old coordinates, momenta and t")

    F1: Generating | None = optional("Generating function of old coordinates, new coordinates and t")
    F2: Generating | None = optional("Generating function of old coordinates, new momenta and t")
    F3: Generating | None = optional("Generating function of old momenta, new coordinates and t")
    F4: Generating | None = optional("Generating function of old momenta, new momenta and t")

    @classmethod
    def _unguessed(cls, key: str, raw: Mapping[str, Any], env: Environment) -> ValueProblem:
        if isinstance(raw[key], dict | list):
            return super()._unguessed(key, raw, env)
        names = env.names.coordinates or ()
        side = "old" if key in (*names, *map(momentum, names)) else "new"
        return cls._belongs_inside(side, key, raw[key])

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        yield from super()._contradictions(raw)
        if raw.get("new_variables") is None:
            names = ", ".join(raw["new"]) if isinstance(raw.get("new"), dict) else "Q, P"
            hint = f"write `new_variables: [{names}]`, coordinates first"
            yield ValueProblem("missing, expected their names", path=("new_variables",), hint=hint)

    @property
    def generating(self) -> tuple[str, Expression] | None:
        """The type of the generating function, such as "F1", and the function; None if there is none."""
        functions = ((kind, getattr(self, kind)) for kind in self.GENERATING)
        return next(((kind, function) for kind, function in functions if function is not None), None)

    @property
    def paired(self) -> Transform:
        """The same with new variables that are given in pairs, [Q1, P1, Q2, P2]."""
        names = self.new_variables
        return self.model_copy(update={"new_variables": (*names[::2], *names[1::2])})

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The new coordinates."""
        return self.new_variables[: len(self.new_variables) // 2]

    @property
    def momenta(self) -> tuple[str, ...]:
        """The new momenta, in the order of the new coordinates."""
        return self.new_variables[len(self.new_variables) // 2 :]


# --- observables and Poisson brackets

# The energies of the system in observables. A parameter or a function may be called T or V, too.
ENERGIES = ("H", "T", "V")


def _variables(env: Environment) -> tuple[str, ...]:
    names = env.names.coordinates or ()
    limits = [name for name, meaning in env.names.meanings.items() if meaning == MULTIPLIER]
    functions = {function.base for function in env.names.functions.values()}
    taken = {*env.declared, *env.names.meanings, *functions}
    energies = [name for name in ENERGIES if name not in taken]
    return (*names, *map(momentum, names), *map(velocity, names), *limits, *energies, "t")


def of_the_state(env: Environment) -> tuple[str, ...]:
    """What further functions of the state may be made of, besides parameters."""
    observed = [name for name, meaning in env.names.meanings.items() if meaning == OBSERVABLE]
    return tuple(dict.fromkeys([*_variables(env), *observed]))


def _read_observables(raw: object, info: ValidationInfo) -> dict[str, Expression]:
    env = environment(info)
    names = [*read_names(raw)[0]] if isinstance(raw, Mapping) else []
    variables = tuple(dict.fromkeys([*(name for name in _variables(env) if name not in names), *names]))

    def read(name: str, value: object) -> Expression:
        if name not in ENERGIES[1:]:
            take(env, {name: OBSERVABLE})
        return env.symbolic(value, None, variables)

    given = read_mapping(raw, read, example="{Lz: x*p_y - y*p_x}")
    uses = {name: e.names & given.keys() for name, e in given.items()}
    problems = list[ValueProblem]()
    in_order(uses, problems, {name: name for name in given}, "observables")
    refuse("observables", problems)
    return given


class Bracket(NamedTuple):
    """The two functions of the state in a Poisson bracket."""

    first: Expression
    second: Expression


def _read_brackets(raw: object, info: ValidationInfo) -> tuple[Bracket, ...]:
    env = environment(info)
    example = "[[Lx, Ly], [Lx, H]]"
    if not isinstance(raw, list | tuple) or not 1 <= len(raw) <= MOST_NAMES:
        pair = list_meant(raw) if isinstance(raw, str) else None
        hint = f"write `[{pair}]`" if pair and pair.count(",") == 1 else None
        if isinstance(raw, Mapping):
            hint = f"write `[{', '.join(f'[{first}, {second}]' for first, second in raw.items())}]`"
        raise ValueProblem(f"read {shown(raw)}, expected a list of pairs, such as {example}", hint=hint)
    variables = of_the_state(env)

    def read(entry: Any, place: int) -> Bracket:
        if not isinstance(entry, list | tuple) or len(entry) != 2:
            raise ValueProblem(f"read {shown(entry)}, expected a pair, such as [Lx, Ly]")
        return Bracket(*(env.symbolic(side, None, variables) for side in entry))

    return tuple(read_list(raw, read, "brackets"))


Observables: TypeAlias = dict[str, Expression]
Brackets: TypeAlias = tuple[Bracket, ...]
OBSERVABLES = ReadBy(_read_observables, EXPRESSIONS_SCHEMA)
_PAIR = {"type": "array", "items": EXPRESSION_SCHEMA, "minItems": 2, "maxItems": 2}
BRACKETS = ReadBy(_read_brackets, {"type": "array", "items": _PAIR, "minItems": 1})
