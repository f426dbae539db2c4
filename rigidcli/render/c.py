"""A program in C99 for each report: it takes Runge-Kutta steps, prints csv, and needs no library.

Names of the document end in an underscore there, which no name of C, its libraries or this program does.
"""

from __future__ import annotations

from rigidcli.language.sharing import Formulas
from rigidcli.render import Look
from rigidcli.render.programs import Language, Source
from rigidcli.report import Report

C = Language("//", frozenset(["H"]), suffix="_")
"""C; a fractional power of a negative number is not a number."""

STEPS = """
// Takes classical Runge-Kutta steps from one time to another.
static void take(int steps, double from, double to, double z[VARIABLES])
{
    static const double at[4] = {0, 0.5, 0.5, 1}, share[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};
    const double dt = (to - from) / steps;
    for (int n = 0; n < steps; n++) {
        double k[VARIABLES] = {0}, sum[VARIABLES] = {0}, y[VARIABLES];
        for (int stage = 0; stage < 4; stage++) {
            for (int i = 0; i < VARIABLES; i++) y[i] = z[i] + at[stage] * dt * k[i];
            f(from + (n + at[stage]) * dt, y, k);
            for (int i = 0; i < VARIABLES; i++) sum[i] += share[stage] * k[i];
        }
        for (int i = 0; i < VARIABLES; i++) z[i] += dt * sum[i];
    }
}

// Takes 4 steps and, from the same state, 8; where these differ, each half of the time by itself.
// Errors are 1e-11 of the SIZES of the variables on the way, as rounding is in the way of less.
static int follow(double from, double to, double z[VARIABLES], int halvings)
{
    double coarse[VARIABLES], fine[VARIABLES];
    int same = 1;
    for (int i = 0; i < VARIABLES; i++) coarse[i] = fine[i] = z[i];
    take(4, from, to, coarse);
    take(8, from, to, fine);
    for (int i = 0; i < VARIABLES; i++) same = same && fabs(fine[i] - coarse[i]) <= 1e-11 * SIZES[i];
    for (int i = 0; same && i < VARIABLES; i++) z[i] = fine[i];
    const double middle = from + (to - from) / 2;
    return same || (halvings && follow(from, middle, z, halvings - 1) && follow(middle, to, z, halvings - 1));
}
"""


def piece(report: Report, look: Look) -> str:
    """The program for a report."""
    source = Source(report, C)
    program = source.program
    slope_texts = enumerate(map(source.formula, program.rates.values))
    slopes = (source.broken(f"    rates[{place}] = ", e, ";") + "\n" for place, e in slope_texts)
    head = "(double t, const double state[]"
    functions = f"\n// The derivatives of {', '.join(program.variables)} by time.\n"
    functions += f"void f{head}, double rates[])\n{{\n{_locals(source, program.rates)}{''.join(slopes)}}}\n"
    for name, formulas in program.quantities.items():
        value = source.broken("    return ", source.formula(formulas.values[0]), ";")
        functions += f"\ndouble {source.function(name)}{head})\n{{\n{_locals(source, formulas)}{value}\n}}\n"
    if "sign" in source.used:
        functions = "\nstatic double sign(double x) { return (x > 0) - (x < 0); }\n" + functions
    constants = "static const double pi = 3.141592653589793;\n" if "pi" in source.used else ""
    constants += source.constants("static const double ", ";", "NAN")
    heading = source.heading("cc -O2 program.c -o program -lm && ./program > orbit.csv")
    return f"{heading}\n#include <math.h>\n#include <stdio.h>\n\n{constants}{functions}{_main(source)}"


def _locals(source: Source, formulas: Formulas) -> str:
    """The values of the variables that are used, and of steps, in a function."""
    unused = "" if source.program.time in formulas.names else "    (void)t;\n"
    values = (f"    const double {name} = state[{i}];\n" for i, name in source.variables(formulas))
    return unused + "".join(values) + source.lines(formulas, "    const double ", ";")


def _main(source: Source) -> str:
    """The part that follows the orbit and prints it."""
    program, run = source.program, source.program.run
    if run is None:
        return "\n" + source.comment(
            "The document has no orbit, so that nothing is run here. f gives the rates of "
            f"{', '.join(program.variables)} at a time, for any method of integration."
        )
    even = source.times()
    times = f"static const double TIMES[SAMPLES] = {{{source.numbers(run.times)}}};\n" if even is None else ""
    at = "TIMES[sample]" if even is None else f"sample * ({even[0]!r} / (SAMPLES - 1))"
    shown, called = source.printed
    cells = [*(f"state[{place}]" for place in range(shown)), *called]
    prints = "".join(f'        printf(",%.17g", {cell});\n' for cell in cells)
    return f"""
enum {{ VARIABLES = {len(program.variables)}, SAMPLES = {len(run.times)} }};

static const double START[VARIABLES] = {{{source.numbers(run.start)}}};
static const double SIZES[VARIABLES] = {{{source.numbers(run.sizes)}}};
{times}{STEPS}
int main(void)
{{
    double t = 0, state[VARIABLES];
    for (int i = 0; i < VARIABLES; i++) state[i] = START[i];
    puts("{",".join(program.columns)}");
    for (int sample = 0; sample < SAMPLES; sample++) {{
        const double next = {at};
        if (next > t && !follow(t, next, state, 40)) {{
            fprintf(stderr, "no Runge-Kutta steps are short enough after t = %.6g\\n", t);
            return 1;
        }}
        t = next;
        printf("%.17g", t);
{prints}        putchar('\\n');
    }}
    return 0;
}}
"""
