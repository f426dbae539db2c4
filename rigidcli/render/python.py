"""A program in Python for each report: it needs scipy, follows the orbit with `solve_ivp` and prints csv."""

from __future__ import annotations

import builtins
import keyword

from rigidcli.render import Look
from rigidcli.render.programs import FUNCTIONS, Language, Source
from rigidcli.report import Report

OWN = "H START SIZES TIMES copysign f fabs nan np pi pow solution solve_ivp sqrt state t"
"""The names that these programs define or import themselves."""

PYTHON = Language("#", frozenset([*OWN.split(), *keyword.kwlist, *keyword.softkwlist, *dir(builtins)]), "**")
"""Python; a fractional power of a negative number is an error of `pow`, and a complex number otherwise."""

SIGN = '''
def sign(x):
    """The sign of a number: 1.0, -1.0, or 0.0 of zero."""
    return copysign(1.0, x) if x else 0.0

'''


def piece(report: Report, look: Look) -> str:
    """The program for a report."""
    source = Source(report, PYTHON)
    program = source.program
    rates = "".join(source.broken("        ", source.formula(e), ",") + "\n" for e in program.rates.values)
    functions = f"""
def f(t, state):
    \"\"\"The derivatives of {", ".join(program.variables)} by time.\"\"\"
{source.unpacked(program.rates)}    return [
{rates}    ]

"""
    for name, formulas in program.quantities.items():
        value = source.broken("    return ", source.formula(formulas.values[0]), "")
        functions += f"""
def {source.function(name)}(t, state):
    \"\"\"The value of {name}.\"\"\"
{source.unpacked(formulas)}{value}

"""
    constants = source.constants("", "", "nan")
    main = _main(source)
    if "sign" in source.used:
        functions = SIGN + functions
        source.used |= {"copysign"}
    if "nan" in constants:
        source.used |= {"nan"}
    names = sorted(FUNCTIONS.get(name, name) for name in source.used - {"sign"})
    imports = [f"from math import {', '.join(names)}\n\n"] if names else []
    if program.run is not None:
        imports.append("import numpy as np\nfrom scipy.integrate import solve_ivp\n\n")
    # The first two lines are our own: Python would take `coding: ...` in them for an encoding.
    return (
        f"{source.heading('python program.py > orbit.csv')}\n{''.join(imports)}{constants}\n{functions}{main}"
    )


def _main(source: Source) -> str:
    """The part that follows the orbit and prints it."""
    program, run = source.program, source.program.run
    if run is None:
        call = "solve_ivp(f, (0, duration), start, rtol=1e-10, atol=1e-10)"
        return "\n" + source.comment(
            "The document has no orbit, so that nothing is run here. With scipy.integrate.solve_ivp, an "
            f"orbit from the values `start` of {', '.join(program.variables)} is {call}."
        )
    even = source.times()
    times = (
        f"np.array([{source.numbers(run.times)}])"
        if even is None
        else "np.linspace(0.0, {!r}, {})".format(*even)
    )
    shown, called = source.printed
    values = "*state" if shown == len(program.variables) else f"*state[:{shown}]"
    end = "TIMES[-1]" if run.times[-1] else "1.0"
    return f"""
START = [{source.numbers(run.start)}]
# The sizes of the variables on the way: errors are measured by them.
SIZES = np.array([{source.numbers(run.sizes)}])
TIMES = {times}

if __name__ == "__main__":
    solution = solve_ivp(
        f, (0.0, {end}), START, "DOP853", TIMES, rtol=1e-12, atol=1e-12 * SIZES
    )
    if not solution.success:
        raise SystemExit(solution.message)
    print("{",".join(program.columns)}")
    for t, state in zip(solution.t.tolist(), solution.y.T.tolist()):
        print(t, {values}, {", ".join(called)}, sep=",")
"""
