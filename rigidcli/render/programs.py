"""The parts of programs of equations of motion that all languages share, from names to formulas.

A program holds names of a document only as identifiers, which are letters, digits and underscores, and differ
from the words of the language. It holds other text of a document only in comments of one line.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from rigidcli.errors import UsageError
from rigidcli.language.sharing import Formulas
from rigidcli.language.text import text
from rigidcli.language.tree import Call, Constant, Name, Negative, Node, Number, Power, rebuilt
from rigidcli.program import Program
from rigidcli.report import Report

WIDTH = 100
"""The width of lines in characters; longer ones are broken at blanks."""

FUNCTIONS = {"abs": "fabs"}
"""The functions that these languages call by another name than documents do."""


@dataclass(frozen=True, slots=True)
class Language:
    """The comments, names and powers of a language.

    No name of a document may be one of the `words`; each gets the `suffix`. `power` is the sign of a power
    with a whole exponent, and empty where it is a call of `pow`, as all other powers are.
    """

    comment: str
    words: frozenset[str]
    power: str = ""
    suffix: str = ""


class Source:
    """A program in a language, piece by piece."""

    def __init__(self, report: Report, language: Language) -> None:
        if report.program is None:
            raise UsageError("there are no equations of motion here", hint="`hamilton` writes programs")
        self.program: Program = report.program
        self.language = language
        self.names: dict[str, str] = {}
        self.used: set[str] = set()
        """The functions that the written formulas call, with `pow` and `pi`, by their names in documents."""
        taken = set(language.words)
        program = report.program
        formulas = [program.rates, *program.quantities.values()]
        steps = [name for each in formulas for name, _ in each.steps]
        others = [name for name in program.quantities if name not in language.words]
        for name in dict.fromkeys([*program.constants, *program.variables, *others, *steps]):
            new = name.lstrip("._") or "x"
            new = (f"x{new}" if new[0].isdigit() else new) + language.suffix
            while new in taken:
                new += "_"
            taken.add(new)
            self.names[name] = new

    def function(self, quantity: str) -> str:
        """The name of the function of a quantity; the function of H is H, and no parameter has this name."""
        return quantity if quantity in self.language.words else self.names[quantity]

    def heading(self, usage: str) -> str:
        """Comments with the command that runs the program and the remarks on the system.

        The first two lines hold no text of the document.
        """
        first = "Equations of motion as a program, written by rigidcli. It is run by"
        mark = self.language.comment
        return f"{mark} {first}\n{mark}     {usage}\n{mark}\n" + self.comment(*self.program.about)

    def comment(self, *paragraphs: str) -> str:
        """Lines of comment. None ends in a backslash, or in the trigraph of C that stands for one."""
        lines: list[str] = []
        for paragraph in paragraphs:
            printable = "".join(c if c.isprintable() else " " for c in paragraph)
            lines += _wrapped(printable.replace("\\", "/").replace("?/", "? /")) or [""]
        return "".join(f"{self.language.comment} {line}".rstrip() + "\n" for line in lines)

    def constants(self, before: str, after: str, missing: str) -> str:
        """A line for each constant, between the texts `before` and `after`; `missing` stands for no value."""
        mark = self.language.comment
        lines = []
        for name, value in self.program.constants.items():
            new = self.names[name]
            notes = [f"{name} of the document"] if new != name + self.language.suffix else []
            notes += ["it has no value in the document: give it one here"] if value is None else []
            line = f"{before}{new} = {missing if value is None else repr(value)}{after}"
            lines.append(line + (f"  {mark} {'; '.join(notes)}" if notes else ""))
        return "".join(f"{line}\n" for line in lines)

    def variables(self, formulas: Formulas | None = None) -> Iterator[tuple[int, str]]:
        """The place and the name of every variable, or of the variables in the formulas."""
        for place, name in enumerate(self.program.variables):
            if formulas is None or name in formulas.names:
                yield place, self.names[name]

    def unpacked(self, formulas: Formulas) -> str:
        """The values of the variables, and of steps, in a function of a language that unpacks a list."""
        names = ", ".join(name for _, name in self.variables())
        return f"    {names} = state\n" + self.lines(formulas, "    ", "")

    @property
    def printed(self) -> tuple[int, list[str]]:
        """The number of variables that are printed after the time, and the calls that follow them."""
        calls = [f"{self.function(name)}(t, state)" for name in self.program.quantities]
        return len(self.program.columns) - 1 - len(calls), calls

    def lines(self, formulas: Formulas, before: str, after: str) -> str:
        """The steps of formulas, one a line."""
        return "".join(
            self.broken(f"{before}{self.names[name]} = ", self.formula(tree), after) + "\n"
            for name, tree in formulas.steps
        )

    def broken(self, before: str, formula: str, after: str) -> str:
        """A line; if it is too long, it is broken inside of parentheses."""
        if len(before) + len(formula) + len(after) <= WIDTH:
            return before + formula + after
        indent = " " * (len(before) - len(before.lstrip()))
        return "\n".join(_wrapped(f"{before}({formula}){after}", indent + "    "))

    def formula(self, tree: Node) -> str:
        """A tree in this language."""
        return text(self._translated(tree), self.language.power or "**")

    def _translated(self, node: Node) -> Node:
        """The tree with floats for numbers, names of this program, and calls for powers."""
        match node:
            case Name(name):
                return Name(self.names.get(name, name))
            case Number(_, value):
                return Number(repr(value), value)
            case Constant(name):
                self.used.add(name)
            case Power(base, exponent):
                base, whole = self._translated(base), _whole(exponent)
                raised = self._translated(exponent) if whole is None else whole
                if not self.language.power or whole is None:
                    return self._call("pow", (base, raised))
                return Power(base, raised)
            case Call(function, arguments):
                translated = tuple(self._translated(argument) for argument in arguments)
                return self._call(function, translated)
        return rebuilt(node, lambda operand: self._translated(operand))

    def _call(self, function: str, arguments: tuple[Node, ...]) -> Node:
        self.used.add(function)
        return Call(FUNCTIONS.get(function, function), arguments)

    def times(self) -> tuple[float, int] | None:
        """The last time and the number of times, if they are evenly spaced from zero on; else None."""
        assert self.program.run is not None
        times = self.program.run.times
        even = np.linspace(0.0, times[-1], len(times))
        if len(times) < 2 or np.abs(times - even).max() > 1e-9 * even[1]:
            return None
        return float(times[-1]), len(times)

    def numbers(self, values: Iterable[float]) -> str:
        """Numbers in a row, broken where that is too long; brackets of the language go around it."""
        written = ", ".join(repr(float(value)) for value in values)
        if len(written) <= WIDTH - 20:
            return written
        return "\n    " + "\n".join(_wrapped(written, "    ")) + "\n"


def _wrapped(line: str, indent: str = "") -> list[str]:
    """A line cut at blanks, with an indent before all parts but the first."""
    return textwrap.wrap(
        line, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )


def _whole(exponent: Node) -> Node | None:
    """An exponent that is a whole number, written as one; None for any other."""
    inner = exponent.operand if isinstance(exponent, Negative) else exponent
    if not isinstance(inner, Number) or not inner.value.is_integer() or abs(inner.value) >= 2**31:
        return None
    whole = Number(str(int(inner.value)), inner.value)
    return Negative(whole) if inner is not exponent else whole
