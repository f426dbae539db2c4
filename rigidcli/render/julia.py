"""A program in Julia for each report: it follows the orbit with OrdinaryDiffEq and prints csv."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rigidcli.render import Look
from rigidcli.render.programs import TOLERANCE, Language, Source
from rigidcli.report import Report

WORDS = """
baremodule begin break catch const continue do else elseif end export false finally for function global if
import let local macro module quote return struct true try using while in isa where outer public abstract
mutable primitive type as
"""
"""The words that Julia keeps for itself, and those that it keeps in some places."""

OWN = """
H START SIZES TIMES f t state rates parameters solution ODEProblem OrdinaryDiffEq Vern9 solve println join
range zip length error pi NaN abs acos acosh asin asinh atan atanh cos cosh exp log sign sin sinh sqrt tan
tanh Main Base Core
"""
"""The names that these programs have of their own, or use."""

JULIA = Language(
    comment="#",
    power="^",
    fractional=False,
    functions={"atan2": "atan"},
    words=frozenset([*WORDS.split(), *OWN.split()]),
)
"""Julia; a fractional power of a negative number is an error."""


def render(reports: Iterable[Report], look: Look) -> Iterator[str]:
    """A program for each report."""
    for report in reports:
        yield _written(Source(report, JULIA))


def _written(source: Source) -> str:
    program = source.program
    slopes = (
        source.broken(f"    rates[{place}] = ", source.formula(tree), "") + "\n"
        for place, tree in enumerate(program.rates.values, start=1)
    )
    functions = f"""
"The derivatives of {", ".join(program.variables)} by time."
function f(rates, state, parameters, t)
{source.unpacked(program.rates)}{"".join(slopes)}    return nothing
end
"""
    for name, formulas in program.quantities.items():
        value = source.broken("    return ", source.formula(formulas.values[0]), "")
        functions += f"""
"The value of {name}."
function {source.function(name)}(t, state)
{source.unpacked(formulas)}{value}
end
"""
    constants = source.constants("const ", "", "NaN")
    imports = "" if program.run is None else "using OrdinaryDiffEq: ODEProblem, Vern9, solve\n\n"
    heading = source.heading("julia program.jl > orbit.csv")
    return f"{heading}\n{imports}{constants}{functions}{_main(source)}"


def _main(source: Source) -> str:
    """What follows the orbit and prints it."""
    program, run = source.program, source.program.run
    if run is None:
        return "\n" + source.comment(
            "The document has no orbit, so that nothing is run here. With OrdinaryDiffEq, an orbit from the "
            f"values `start` of {', '.join(program.variables)} is "
            "solve(ODEProblem(f, start, (0.0, duration)), Vern9())."
        )
    even = source.times()
    times = f"[{source.numbers(run.times)}]" if even is None else "range(0.0, {!r}, length={})".format(*even)
    shown, called = source.printed
    end = "TIMES[end]" if run.times[-1] else "1.0"
    return f"""
const START = [{source.numbers(run.start)}]
# The sizes of the variables on the way: errors are measured by them.
const SIZES = [{source.numbers(run.sizes)}]
const TIMES = {times}

solution = solve(
    ODEProblem(f, START, (0.0, {end})), Vern9();
    reltol={TOLERANCE}, abstol={TOLERANCE} * SIZES, saveat=TIMES, maxiters=10^9,
)
length(solution.t) == length(TIMES) || error("the orbit ends early")
println("{",".join(program.columns)}")
for (t, state) in zip(solution.t, solution.u)
    println(join([t; state[1:{shown}]; {"; ".join(called)}], ","))
end
"""
