"""What people type, read for a question: formulas in its letters, and lists and tables of entries.

Everything that cannot be read is `Unreadable`, with a finding for the student.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import chain, islice, product
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import number, symbol, total
from rigidcli.algebra.substitution import from_tree
from rigidcli.algebra.trees import to_tree
from rigidcli.document.parameters import TIME, read_name
from rigidcli.document.phase_space import acceleration, momentum, velocity
from rigidcli.errors import ExpressionError, ValueProblem, shortened, shown
from rigidcli.fields.units import Unit
from rigidcli.homework.base import KeySource, Tree, Unreadable
from rigidcli.homework.files import beside, read_file
from rigidcli.homework.lists import read_list
from rigidcli.homework.numbers import advice, may_be_in, read_units, readings_of, taken_back
from rigidcli.language import tree, typed
from rigidcli.language.latex import plain as without_latex
from rigidcli.language.parser import RATE
from rigidcli.language.text import without_doubt
from rigidcli.language.tree import Call, Node, nodes
from rigidcli.language.typed import TWO_ANSWERS, cut, is_enclosed, statements, undecorated, without_labels
from rigidcli.language.words import FUNCTIONS, Words, said, unknown

Domain: TypeAlias = Literal["positive", "real"]
# Functions that begin like an amplitude `a`.
INVERSE = frozenset(name for name in FUNCTIONS if name[0] == "a" and name[1:] in FUNCTIONS)
# Names that usually belong to what moves, and so may have either sign; others are parameters.
MOVING = re.compile(r"(x|y|z|q|u|v|theta|phi|psi|alpha|beta|gamma|p)(_?\w{1,6})?|\w+dot")


@dataclass(frozen=True, eq=False)
class Names:
    """The names that an answer may hold, and what is known of them.

    `domains` has the independent ones, `derived` names that stand for expressions in these, as a document
    defines them, and `spellings` other ways to write some. `values` has the numbers of a document's
    parameters.
    """

    domains: Mapping[str, Domain]
    spellings: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, Node] = field(default_factory=dict)
    derived: Mapping[str, Node] = field(default_factory=dict)
    coordinates: tuple[str, ...] = ()
    momenta: tuple[str, ...] = ()
    velocities: tuple[str, ...] = ()
    further: tuple[str, ...] = ()

    @cached_property
    def states(self) -> frozenset[str]:
        """Coordinates, momenta, velocities and accelerations: all that changes in time."""
        pairs = ((name, of(name)) for name in self.domains for of in (momentum, velocity))
        paired = (name for pair in pairs if self.domains.keys() >= {*pair} for name in pair)
        rates = map(acceleration, self.coordinates)
        return frozenset((*self.coordinates, *self.momenta, *self.velocities, *self.further, *rates, *paired))

    @property
    def variable(self) -> frozenset[str]:
        """Names that a constant may not hold: states, the time, and parameters that are not positive."""
        open_ = {name for name, domain in self.domains.items() if domain != "positive"}
        return self.states | open_ | {TIME}

    @cached_property
    def words(self) -> Words:
        """The names as the reader of formulas wants them."""
        real = {name for name, domain in self.domains.items() if domain == "real"}
        moving = self.states | {name for name in real if MOVING.fullmatch(name)}  # may be written as theta(t)
        return Words((*self.domains, *self.derived), self.spellings, moving)

    def without_derived(self, node: Node) -> Node:
        """The tree with the definitions of derived names put in."""
        for name in reversed(list(self.derived)):
            node = tree.bound(node, {name: self.derived[name]})
        return node


def names_of(source: KeySource, used: Iterable[str] = ()) -> Names:
    """The names that an answer to a question may hold; `used` are the names in its literal key.

    What is known of a name decides its domain, the surest source last: its form in a literal key (real if it
    looks like a coordinate, else positive), the sign of its value in the document, its motion (real), and the
    `symbols` of the question. Raises ValueProblem for a name in the question that is none.
    """
    question, document = source.question, source.document
    listed = {TIME if n == TIME else read_name(n): domain for n, domain in (question.symbols or {}).items()}
    coordinates, momenta, velocities = _moving(source)
    further: tuple[str, ...] = ()
    values, derived, of_document = dict[str, Node](), dict[str, Node](), dict[str, Domain]()
    if document is not None:
        for name, value in document.values.items():
            if (known := document.arithmetic.value(value)) is not None:
                values[name] = exactly(float(known))
        for name, definition in document.definitions.items():
            own = values.get(name, tree.ONE)
            is_positive = own != exactly(0.0) and not isinstance(own, tree.Negative)
            of_document[name] = "positive" if is_positive else "real"
            if definition is not None and definition.names and name not in listed:
                derived[name] = definition.root
        if document.transform is not None and "transform" in source.path:
            further = document.transform.new_variables
    moving = (*coordinates, *momenta, *velocities, *further, TIME)
    new = sorted(set(used).difference(of_document, listed, moving))
    by_form: dict[str, Domain] = {name: "real" if MOVING.fullmatch(name) else "positive" for name in new}
    domains = of_document | by_form | dict.fromkeys(moving, "real") | listed
    independent = {name: domain for name, domain in domains.items() if name not in derived}
    others = spellings(domains, coordinates, momenta, velocities)
    return Names(independent, others, values, derived, coordinates, momenta, velocities, further)


def _moving(source: KeySource) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """The coordinates of a question or of its document, with their momenta and velocities.

    Raises ValueProblem for another number of momenta or velocities.
    """
    question, document = source.question, source.document
    lists = (question.coordinates, question.momenta, question.velocities)
    coordinates, momenta, velocities = (tuple(map(read_name, names)) for names in lists)
    if document is not None and document.system is not None:
        coordinates = coordinates or document.system.coordinates
    for key, own in (("momenta", momenta), ("velocities", velocities)):
        if own and len(own) != len(coordinates):
            count = f"{len(own)} {key} and {len(coordinates)} coordinates"
            hint = "list the `coordinates` to which they belong, in the same order: `coordinates: [x, theta]`"
            raise ValueProblem(f"{count}, expected as many of both", path=(key,), hint=hint)
    momenta = momenta or tuple(map(momentum, coordinates))
    return coordinates, momenta, velocities or tuple(map(velocity, coordinates))


def exactly(value: float) -> Node:
    """A number as the quotient of two whole ones: a decimal would stand for all that rounds to it."""
    return to_tree(number(Fraction(repr(value))))


def spellings(
    names: Collection[str], coordinates: Iterable[str], momenta: Sequence[str], velocities: Sequence[str]
) -> dict[str, str]:
    """Unambiguous aliases of names, besides underscores that are left out or added.

    `p` of one momentum, `p_x` of the momentum of x, `p1` for `p_theta1`, `xdot1` for `x1dot`, `omega` of w.
    """
    pairs = [*in_other_letters(names)]
    pairs += [(other, name) for other in ("p", "P") for name in momenta if len(momenta) == 1]
    for q, p in zip(coordinates, momenta, strict=False):
        pairs += [(f"P_{q}", p), (f"p_{q.capitalize()}", p), (f"p_{q}", p), (f"p_{q[0]}", p)]
    pairs += [(f"p{digits[0]}", name) for name in momenta if (digits := re.search(r"\d+\Z", name))]
    indexed = ((re.fullmatch(r"(\w*?[A-Za-z])_?(\d+)(d?dot)", name), name) for name in velocities)
    pairs += [(f"{parts[1]}{parts[3]}_{parts[2]}", name) for parts, name in indexed if parts]
    meanings: dict[str, set[str]] = {}
    for other, name in pairs:
        meanings.setdefault(other, set()).add(name)
    return {other: meant.pop() for other, meant in meanings.items() if len(meant) == 1 and other not in names}


def in_other_letters(names: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Names with w for omega or omega for w, and those with l with the letter ell of print."""
    for name, (own, other) in product(names, (("w", "omega"), ("omega", "w"), ("l", "ell"))):
        if parts := re.fullmatch(rf"{own}(_?\d*)", name):
            yield f"{other}{parts[1]}", name


def read_expression(answer: Tree, names: Names | None, place: str = "", *, leading: bool = True) -> Node:
    """The formula of a key: the most usual reading, in which `asin` is the inverse. Raises Unreadable."""
    several = read_expressions(answer, names, place, leading=leading)
    return max(several, key=lambda node: sum(getattr(e, "function", "") in INVERSE for e in nodes([node])))


def read_expressions(
    answer: Tree, names: Names | None, place: str = "", *, leading: bool = True
) -> list[Node]:
    """The readings of a formula in the names of the question; without them, a name is taken whole.

    A name and `=` may be `leading`. Raises Unreadable.
    """
    if isinstance(answer, list | dict) or answer is None:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected an expression", place=place)
    text, first = undecorated(str(answer)) if leading else str(answer), None
    for part, _ in chain([(text, [])], _without_tail(text, names)):
        try:
            found = typed.expressions(part, None if names is None else names.words, leading=leading)
            return found if names is None else [_worked_out(node, names) for node in found]
        except ExpressionError as error:
            first = first or error
            if first.code != "unknown_symbol":
                break
    assert first is not None
    raise Unreadable(first.code or "parse_error", advice(first), place=place)


def _worked_out(node: Node, names: Names) -> Node:
    """The formula with d/dt (m l^2 thetadot) worked out as m l^2 thetaddot. Raises ExpressionError."""
    if not isinstance(node, Call) or node.function != RATE:
        return tree.rebuilt(node, lambda operand: _worked_out(operand, names))
    e = from_tree(names.without_derived(_worked_out(node.arguments[0], names)))
    parts = [derivative(e, TIME)]
    for state in names.states & e.names:
        rate = acceleration(state.removesuffix("dot")) if state.endswith("dot") else velocity(state)
        if rate not in names.words.names:
            raise unknown(rate, names.words)
        parts.append(derivative(e, state) * symbol(rate))
    return to_tree(total(parts))


_BLANK = re.compile(r"(?<=[\w)\]}$²³\u0307\u0308])\s+(?=[\[(]?[^\W\d_])|(?<=[)\]}])(?=[\[(][^\W\d_])")
# What is a unit and no factor: of `sqrt(g/l) m`, the m may be one too many.
_SURE_UNIT = re.compile(
    r"\b(?:rad(?:ian)?s?|kg|deg|rpm|Hz|rev|(?:joule|newton|second|meter|metre|degree)s?)\b|\A[\[(]"
)


def _without_tail(text: str, names: Names | None) -> Iterator[tuple[str, list[Unit]]]:
    """The formula without a unit or a remark that may stand behind it, with the unit, for each blank in turn.

    First come units for sure that begin with no letter of the question: of `M h^2 kg m^2`, `h^2` is no unit.
    """
    listed = set(names.words.names) if names else set()
    letters = {name.casefold() for name in listed}

    def is_doubtful(blank: re.Match[str]) -> bool:
        tail = text[blank.end() :]
        first = re.match(r"[^\W\d_²³]+", tail)
        return _SURE_UNIT.search(tail) is None or (first is not None and first[0] in listed)

    for blank in sorted(islice(_BLANK.finditer(text), 20), key=is_doubtful):
        tail = text[blank.end() :].strip()
        is_remark = re.fullmatch(r"\([^()=\d]*[^\W\d_]{3}[^()=\d]*\)", tail) and not taken_back(tail)
        # With M and L asked for, `1/3 m l^2` and `M l^2` have the wrong letters, and no unit.
        are_names = letters.issuperset(re.sub(r"[\W\d_]", "", tail.casefold()))
        is_unit = _SURE_UNIT.search(tail) or (re.search("[/^]", tail) and not are_names)
        with suppress(Unreadable, ExpressionError):
            units = read_units(without_latex(tail)) if is_unit and not is_remark else []
            if units or is_remark:
                yield text[: blank.start()], units


def odd_unit(answer: str, names: Names) -> str:
    """The unit behind a formula that cannot have it, if its letters are what they usually are; else empty."""
    text = undecorated(answer)
    for part, units in chain([(text, list[Unit]())], _without_tail(text, names)):
        with suppress(ExpressionError):
            formula = typed.expressions(part, names.words)[0]
            return "" if not units or may_be_in(units, formula) else text[len(part) :].strip()
    return ""


# --- without a question

# Words, which may be the answer to a question with a choice.
_WORDS = re.compile(r"[\w\s,.;'<>-]*[^\W\d_]{3}[\w\s,.;'<>-]*")
# What stands in an equation of motion, and not in a formula that has a name and `=` before it.
_EQUATION = re.compile(r"=\s*0\s*\Z|['′\N{COMBINING DOT ABOVE}].*=|dot|d\s*t")


def described(answer: Tree | Unreadable, path: Path) -> str:
    """An answer in the file at `path`, as it is read. Raises Unreadable where no question reads it."""
    if isinstance(answer, Unreadable):
        raise answer
    if answer is None or (isinstance(answer, str) and not answer.strip()):
        return "no answer"
    if isinstance(answer, dict) and answer.keys() & {"file", "csv"}:
        file = answer.get("file")
        text = str(answer["csv"]) if file is None else read_file(beside(file, path), shown(file))
        head, *rows = [line for line in text.splitlines() if line.strip()] or [""]
        return f"a table with {len(rows)} row{'s' * (len(rows) != 1)} below `{shortened(head)}`"
    try:
        return f"read as {shortened(describe(answer))}"
    except Unreadable:
        if isinstance(answer, str) and _WORDS.fullmatch(answer):
            return f"{shown(answer)} as it is typed: how it is read depends on the question"
        raise


def describe(answer: Tree, *, is_entry: bool = False) -> str:
    """An answer, or an entry of a list, as it is read without its question. Raises Unreadable."""
    if isinstance(answer, dict):
        return "; ".join(f"{name}: {describe(value, is_entry=is_entry)}" for name, value in answer.items())
    if isinstance(answer, list):
        entries = answer if is_entry else read_list(answer)
        return f"[{', '.join(describe(entry, is_entry=True) for entry in entries)}]"
    text = str(answer)
    with suppress(Unreadable):
        return readings_of(text)[0].read_as
    if text.count("=") > 1 or _EQUATION.search(text):
        with suppress(Unreadable):
            found = read_equations(text, None, {})
            if not found.unread:
                return found.read_as
    try:
        return without_doubt(read_expression(text, None))
    except Unreadable:
        if is_entry or (listed := read_list(text)) in ([text], [text.strip()]):
            raise
    return describe(listed, is_entry=True)


# --- equations

Sides: TypeAlias = tuple[str, Node, Node]  # the place of an equation in the answer, and its two sides


class Equations(NamedTuple):
    """The equations of an answer, and what is wrong with those that cannot be read.

    Of a chain of equalities the last member counts; each member `between` that can be read stands with it.
    """

    sides: list[Sides]
    unread: list[Unreadable]
    between: list[Sides]

    @property
    def read_as(self) -> str:
        """The equations as they are shown to the student."""
        return "; ".join(f"{without_doubt(left)} = {without_doubt(right)}" for _, left, right in self.sides)


def read_equations(
    answer: Tree,
    names: Names | None,
    tops: Mapping[str, str],
    is_true: Callable[[Node, Node], bool | str] = lambda left, right: True,
) -> Equations:
    """The equations of a mapping, of a list of texts, or of lines; of several readings one that `is_true`.

    In a mapping whose keys are all functions of the time, `x` stands for its derivative, which `tops` has.
    Raises Unreadable where no equation can be read.
    """
    found = Equations([], [], [])
    equations = list(_equations(answer, "", found.unread))
    if len(equations) > 200:  # twice the variables of the largest system that anybody writes
        raise Unreadable("too_large", f"{len(equations)} equations")
    keys = [members[0].strip() for _, members, is_key in equations if is_key]
    if names is not None:
        keys = [names.words.meaning(key) or key for key in keys]
    are_short = len(keys) == len(equations) and tops.keys() >= {*keys}
    for count, (place, (first, *between, last), _) in enumerate(equations):
        first = tops[keys[count]] if are_short else first
        try:
            readings = [read_expressions(side, names, place, leading=False) for side in (first, last)]
        except Unreadable as problem:
            found.unread.append(problem)
            continue
        pairs = list(product(*readings))
        left, right = next((pair for pair in pairs if is_true(*pair) is True), pairs[0])
        found.sides.append((place, left, right))
        for member in between:
            with suppress(Unreadable):
                found.between.append((place, read_expression(member, names, leading=False), right))
    if not found.sides:
        nothing = Unreadable("wrong_shape", "expected equations, such as `xdot = p/m`")
        raise next(iter(found.unread), nothing)
    return found


def _equations(answer: Tree, place: str, unread: list[Unreadable]) -> Iterator[tuple[str, list[str], bool]]:
    """The place and the members of every equation, and whether the first one was a key of a mapping.

    What is no equation is added to what is `unread`.
    """
    if isinstance(answer, str):
        try:
            several = _statements(answer)
        except ExpressionError as error:
            unread.append(Unreadable(error.code or "parse_error", advice(error), place=place))
            return
        for count, text in enumerate(several, 1):
            where = place or (f"equation {count}" if len(several) > 1 else "")
            number = where.removeprefix("equation ") if where[-1:].isdigit() else "1"
            text = re.sub(rf"(?<=[\w)}}\]])\s+\({number}\)\s*\Z", "", text)
            if len(texts := re.split(r"==?", text)) > 1:
                yield where, texts, False
            else:
                detail = f"no `=` in {shown(text)}: write an equation, such as `xdot = p/m`"
                unread.append(Unreadable("parse_error", detail, place=where))
    elif isinstance(answer, list):
        for count, entry in enumerate(answer, 1):
            yield from _equations(entry, f"equation {count}", unread)
    elif isinstance(answer, dict):
        for key, value in answer.items():
            if value is None and "=" in str(key):  # as YAML reads `{xdot = p/m, pdot = -k x}`
                yield from _equations(str(key), str(key), unread)
            elif isinstance(value, str) and "=" not in value:
                yield str(key), [str(key), value], True
            else:
                yield from _equations(value if isinstance(value, str) else None, str(key), unread)
    else:
        expected = "expected an expression" if place else "expected equations"
        unread.append(Unreadable("wrong_shape", f"read {shown(answer)}, {expected}", place=place))


# What does not change: `p_phi = const`, `p_phi = m r^2 phidot = const`, `p_phi is conserved`.
_CONSTANT = re.compile(rf"(?i)\A(?:[^=]*=)?([^=]+)=\s*{said('constant')}\.?\s*\Z")
_IS_CONSTANT = re.compile(rf"(?i)\s{said('is')}\s+(?={said('constant')})")
_WORDS_AHEAD = re.compile(r"\A[^=]*(?::\s(?=[^=]*=)|\b(?:are|is|sind|ist|lauten|sont|son)\s)")
# A name with a colon or an arrow for `=`.
_NAMED = re.compile(r"(?:(?<=\A)|(?<=[\n,;]))([^\S\n]*[^\W\d]\w*\s*)(?::|->|=>)")
# What stands before an equation to count it, where brackets have been masked: `a)` and `(1)`.
_PART = re.compile(
    r"(?:\A|(?<=\s))(?:[1-9a-h]|i{1,3})\)\s+|(?:\A|(?<=[\w)]\s))\([_1-9]\)\s+(?=[^\W\d]\w*dot\w*\s*=)"
)
# Beside what stands between any statements: an arrow, a bar, `and`.
_BETWEEN = re.compile(rf"=>|\s\|\s|\s&\s|\b{said('and')}|\s[y/]\s+(?=[^\W\d]\w*\s*=)")
_RATE = re.compile(r"\s*[^\W\d]\w*dot\w*\s*=")
# What stands between two equations for derivatives, where nothing but a blank does.
_NEXT_RATE = re.compile(r"(?<=[\w)\]}])\s+(?=[^\W\d]\w*dot(?:_?\w+)?\s*=)")


def _statements(answer: str) -> list[str]:
    """The equations of a text. Raises ExpressionError where one equation or another is given."""
    text = _IS_CONSTANT.sub(" = ", "\n".join(map(undecorated, without_labels(answer).splitlines())))
    if "=" in text and is_enclosed(text):
        text = text.strip()[1:-1]
    text = "\n".join(cut(typed.slopes(without_latex(text).translate(typed.POINTS)), _PART))
    if "=" not in text.replace("=>", ""):
        text = _NAMED.sub(r"\1=", text)
    if re.search(rf"\b{said('or')}", text):
        raise ExpressionError(TWO_ANSWERS, code="wrong_shape")
    several = map("=".join, statements(_BETWEEN.sub("\n", text)))
    parts = (part for each in several for part in (_NEXT_RATE.split(each) if _RATE.match(each) else [each]))
    parts = (_CONSTANT.sub(rf"{RATE}(\1) = 0", typed.END.sub("", part)) for part in parts)
    return [_WORDS_AHEAD.sub("", part).strip() for part in parts]
