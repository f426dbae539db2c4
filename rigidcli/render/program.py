"""Programs of the equations of motion that run by themselves and print csv: in Python with scipy, and in C99.

The parts of a program stand in `python.txt` and `c.txt`. A program holds names of a document only as
identifiers, which are letters, digits and underscores, and differ from the words of the language. It holds
other text of a document only in comments of one line. In C, names of the document end in an underscore, which
no name of C, its libraries or the program does.
"""

from __future__ import annotations

import builtins
import keyword
import textwrap
from collections.abc import Iterable
from string import Template
from typing import NamedTuple

import numpy as np

from rigidcli.errors import UsageError
from rigidcli.language.code import Formulas
from rigidcli.language.text import text
from rigidcli.language.tree import Call, Constant, Name, Negative, Node, Number, Power, rebuilt
from rigidcli.render import Look, templates
from rigidcli.report import Report, Run

WIDTH = 100  # the width of lines in characters; longer ones are broken at blanks
FUNCTIONS = {"abs": "fabs"}  # the functions that these languages call by another name than documents do


class Language(NamedTuple):
    """What differs from language to language.

    `parts`: the file with the parts of a program. No name of a document may be one of the `words`; each gets
    the `suffix`. `power` is the sign of a power with a whole exponent, and empty where it is a call of `pow`,
    as all other powers are. A `constant` is a line with a name and a number, for which `missing` stands where
    there is no value. In functions, `local` begins and `end` ends a line with a name and a formula.
    """

    parts: str
    comment: str
    words: frozenset[str]
    suffix: str
    power: str
    constant: str
    missing: str
    local: str
    end: str


# The names that programs in Python define or import themselves.
_OWN = "H START SIZES TIMES copysign f fabs nan np pi pow solution solve_ivp sqrt state t"
_WORDS = frozenset([*_OWN.split(), *keyword.kwlist, *keyword.softkwlist, *dir(builtins)])
# Python raises an error for a fractional power of a negative number by `pow`; `**` has a complex number. In C
# it is not a number.
PYTHON = Language("python.txt", "#", _WORDS, "", "**", "{} = {}", "nan", "", "")
C = Language(
    "c.txt", "//", frozenset(["H"]), "_", "", "static const double {} = {};", "NAN", "const double ", ";"
)


def python(report: Report, look: Look) -> str:
    """The program in Python for a report: it needs scipy, and follows the orbit with `solve_ivp`."""
    source = _Source(report, PYTHON)
    program, run = source.program, source.program.run
    unpack = f"    {', '.join(source.names[name] for name in program.variables)} = state\n"
    rates = [source.line("        {},", tree) for tree in program.rates.values]
    functions = source.functions(rates, dict.fromkeys(["", *program.quantities], unpack))
    constants, main, libraries = source.constants(), source.nothing(), ""
    if run is not None:
        even = _even_times(run)
        shown, calls = source.printed()
        times = "np.linspace(0.0, {!r}, {})".format(*even) if even else f"np.array([{_numbers(run.times)}])"
        state = "*state" if shown == len(program.variables) else f"*state[:{shown}]"
        end = "TIMES[-1]" if run.times[-1] else "1.0"
        main = source.orbit(run, times=times, end=end, cells=", ".join([state, *calls]))
        libraries = "import numpy as np\nfrom scipy.integrate import solve_ivp\n\n"
    used = source.used | ({"nan"} if "nan" in constants else set())
    used = (used | {"copysign"} if "sign" in used else used) - {"sign"}
    names = sorted(FUNCTIONS.get(name, name) for name in used)
    imports = f"from math import {', '.join(names)}\n\n" if names else ""
    return f"{source.heading()}\n{imports}{libraries}{constants}\n{functions}{main}"


def c(report: Report, look: Look) -> str:
    """The program in C99 for a report: it takes Runge-Kutta steps, and needs no library."""
    source = _Source(report, C)
    program, run = source.program, source.program.run

    def unpacked(formulas: Formulas) -> str:
        named = formulas.names
        lines = [] if program.time in named else ["    (void)t;\n"]
        for place, name in enumerate(program.variables):
            if name in named:
                lines.append(f"    const double {source.names[name]} = state[{place}];\n")
        return "".join(lines)

    rates = [source.line(f"    rates[{k}] = {{}};", tree) for k, tree in enumerate(program.rates.values)]
    every = {"": program.rates, **program.quantities}
    functions = source.functions(rates, {name: unpacked(formulas) for name, formulas in every.items()})
    constants = "static const double pi = 3.141592653589793;\n" if "pi" in source.used else ""
    main = source.nothing()
    if run is not None:
        even = _even_times(run)
        shown, calls = source.printed()
        cells = [*(f"state[{place}]" for place in range(shown)), *calls]
        main = source.orbit(
            run,
            times="" if even else f"static const double TIMES[SAMPLES] = {{{_numbers(run.times)}}};\n",
            next=f"sample * ({even[0]!r} / (SAMPLES - 1))" if even else "TIMES[sample]",
            cells="".join(f'        printf(",%.17g", {cell});\n' for cell in cells),
        )
    includes = "#include <math.h>\n#include <stdio.h>\n"
    return f"{source.heading()}\n{includes}\n{constants}{source.constants()}{functions}{main}"


class _Source:
    """The names of a program in a language, and its parts written with them."""

    def __init__(self, report: Report, language: Language) -> None:
        if report.program is None:
            raise UsageError("there are no equations of motion here", hint="`hamilton` writes programs")
        self.program, self.language = report.program, language
        self._parts = templates(language.parts)
        self.names: dict[str, str] = {}
        self.used: set[str] = set()
        """The functions that the written formulas call, with `pow` and `pi`, by their names in documents."""
        program, taken = report.program, set(language.words)
        steps = [name for each in (program.rates, *program.quantities.values()) for name, _ in each.steps]
        others = [name for name in program.quantities if name not in language.words]
        for name in dict.fromkeys([*program.constants, *program.variables, *others, *steps]):
            new = name.lstrip("._") or "x"
            new = (f"x{new}" if new[0].isdigit() else new) + language.suffix
            while new in taken:
                new += "_"
            taken.add(new)
            self.names[name] = new

    def _part(self, name: str, /, **words: str) -> str:
        variables = ", ".join(self.program.variables)
        return Template(self._parts[name]).substitute(words, variables=variables)

    def heading(self) -> str:
        """Comments with the command that runs the program and the remarks on the system.

        The first two lines hold no text of the document: Python would take `coding: ...` for an encoding.
        """
        mark = self.language.comment
        first, use = "a program, written by rigidcli. It is run by", "usage"
        if self.program.run is None:
            first, use = "functions, written by rigidcli. A program of yours has them by", "library"
        first = f"{mark} Equations of motion as {first}"
        return f"{first}\n{mark}     {self._part(use)}{mark}\n{self._comment(*self.program.about)}"

    def orbit(self, run: Run, **words: str) -> str:
        """The part that follows the orbit from its start and prints it."""
        words |= {"start": _numbers(run.start), "sizes": _numbers(run.sizes)}
        words |= {"count": str(len(run.start)), "samples": str(len(run.times))}
        return self._part("orbit", head=",".join(self.program.columns), **words)

    def nothing(self) -> str:
        """The comment in place of an orbit."""
        words = "The document has no orbit, so that nothing is run here. " + self._part("nothing")
        return "\n" + self._comment(words.rstrip())

    def _comment(self, *paragraphs: str) -> str:
        """Lines of comment. None ends in a backslash, or in the trigraph of C that stands for one."""
        lines: list[str] = []
        for paragraph in paragraphs:
            printable = "".join(c if c.isprintable() else " " for c in paragraph)
            lines += _wrapped(printable.replace("\\", "/").replace("?/", "? /")) or [""]
        return "".join(f"{self.language.comment} {line}".rstrip() + "\n" for line in lines)

    def constants(self) -> str:
        """A line for each constant, with a remark where it has another name, or no value."""
        language, lines = self.language, []
        for name, value in self.program.constants.items():
            new = self.names[name]
            notes = [f"{name} of the document"] if new != name + language.suffix else []
            notes += ["it has no value in the document: give it one here"] if value is None else []
            line = language.constant.format(new, language.missing if value is None else repr(value))
            lines.append(line + (f"  {language.comment} {'; '.join(notes)}\n" if notes else "\n"))
        return "".join(lines)

    def functions(self, rates: Iterable[str], unpacked: dict[str, str]) -> str:
        """The functions of the `rates`, which are lines, and of the quantities.

        By its name, or "" of the rates, the state of each function is `unpacked` by lines at its beginning.
        """
        program, end = self.program, self.language.end
        values, steps = "".join(f"{line}\n" for line in rates), self._steps(program.rates)
        written = self._part("rates", steps=unpacked[""] + steps, values=values)
        for name, formulas in program.quantities.items():
            value = self.line(f"    return {{}}{end}", formulas.values[0])
            steps = unpacked[name] + self._steps(formulas)
            words = {"name": name, "function": self._function(name), "steps": steps, "value": value}
            written += self._part("quantity", **words)
        return (self._part("sign") if "sign" in self.used else "") + written

    def _function(self, quantity: str) -> str:
        """The name of the function of a quantity; that of H is H, and no parameter has this name."""
        return quantity if quantity in self.language.words else self.names[quantity]

    def printed(self) -> tuple[int, list[str]]:
        """The number of variables that are printed after the time, and the calls that follow them."""
        calls = [f"{self._function(name)}(t, state)" for name in self.program.quantities]
        return len(self.program.columns) - 1 - len(calls), calls

    def _steps(self, formulas: Formulas) -> str:
        begin, end = self.language.local, self.language.end
        return "".join(
            self.line(f"    {begin}{self.names[name]} = {{}}{end}", tree) + "\n"
            for name, tree in formulas.steps
        )

    def line(self, template: str, tree: Node) -> str:
        """A line with the formula of a tree; if it is too long, it is broken inside of parentheses."""
        formula = text(self._translated(tree), self.language.power or "**")
        if len(line := template.format(formula)) <= WIDTH:
            return line
        indent = " " * (len(template) - len(template.lstrip()))
        return "\n".join(_wrapped(template.format(f"({formula})"), indent + "    "))

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
                if self.language.power and whole is not None:
                    return Power(base, raised)
                return self._call("pow", (base, raised))
            case Call(function, arguments):
                return self._call(function, tuple(map(self._translated, arguments)))
        return rebuilt(node, self._translated)

    def _call(self, function: str, arguments: tuple[Node, ...]) -> Node:
        self.used.add(function)
        return Call(FUNCTIONS.get(function, function), arguments)


def _even_times(run: Run) -> tuple[float, int] | None:
    """The last time and the number of times, if they are evenly spaced from zero on; else None."""
    even = np.linspace(0.0, run.times[-1], len(run.times))
    if len(even) < 2 or np.abs(run.times - even).max() > 1e-9 * even[1]:
        return None
    return float(even[-1]), len(even)


def _numbers(values: Iterable[float]) -> str:
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
