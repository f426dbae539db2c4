"""A program in C99 for each report: it takes Runge-Kutta steps, prints csv, without a library."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rigidcli.language.sharing import Formulas
from rigidcli.render import Look
from rigidcli.render.programs import Language, Source
from rigidcli.report import Report

TOLERANCE = "1e-11"
"""Error of the steps between two samples: rounding would be in the way of less."""

HALVINGS = 40
"""How often the time between two samples is halved at most: enough to pass a sudden change of a force."""

WORDS = """
auto break case char const continue default do double else enum extern float for goto if inline int long
register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
alignas alignof bool constexpr false nullptr static_assert thread_local true typeof typeof_unqual
and and_eq asm bitand bitor catch class compl concept consteval constinit const_cast decltype delete
dynamic_cast explicit export friend mutable namespace new noexcept not not_eq operator or or_eq private
protected public reinterpret_cast requires static_cast template this throw try typeid typename using virtual
wchar_t xor xor_eq far near huge interrupt fortran linux unix i386 arm mips sun
"""
"""The words that C keeps for itself, also in later versions, in C++, and as macros of some compilers."""

MATH = """
acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cos cosh erf erfc exp exp10 exp2 expm1 fabs fdim
floor fma fmax fmaximum fmin fminimum fmod frexp gamma hypot ilogb isinf isfinite isnan isnormal isunordered
isgreater isgreaterequal islessequal isless islessgreater j0 j1 jn ldexp lgamma lgamma_r lgammaf_r lgammal_r
llrint llround log log10 log1p log2 logb logp1 lrint lround modf nan nearbyint nextafter nextdown nexttoward
nextup pow pow10 powr remainder remquo rint round roundeven rootn rsqrt scalb scalbln scalbn significand
signbit signgam sin sincos sinh sinpi cospi tanpi sqrt compoundn tan tanh tgamma trunc y0 y1 yn drem finite
infnan matherr fpclassify issignaling iszero canonicalize totalorder llogb fromfp ufromfp getpayload
setpayload
"""
"""The functions of math.h, in all its versions; each has two more, with f and with l behind its name."""

OTHERS = """
main printf fprintf puts putchar stdout stderr stdin exit NULL EOF FILE BUFSIZ INFINITY NAN HUGE HUGE_VAL
HUGE_VALF HUGE_VALL OVERFLOW UNDERFLOW DOMAIN SING PLOSS TLOSS MAXFLOAT DBL_MAX FLT_MAX SEEK_SET SEEK_CUR
SEEK_END TMP_MAX L_tmpnam L_ctermid P_tmpdir FILENAME_MAX FOPEN_MAX FP_NAN FP_INFINITE FP_ZERO FP_SUBNORMAL
FP_NORMAL FP_ILOGB0 FP_ILOGBNAN FP_FAST_FMA FP_FAST_FMAF FP_FAST_FMAL MATH_ERRNO MATH_ERREXCEPT
math_errhandling M_E M_LOG2E M_LOG10E M_LN2 M_LN10 M_PI M_PI_2 M_PI_4 M_1_PI M_2_PI M_2_SQRTPI M_SQRT2
M_SQRT1_2 RAND_MAX getline getdelim getc getw getchar gets putc puts putw remove rename renameat rewind
scanf sprintf snprintf vprintf vfprintf vsprintf vsnprintf vscanf vsscanf vfscanf vdprintf dprintf sscanf
fscanf tmpfile tmpnam tmpnam_r tempnam ungetc fopen fclose fread fwrite fputs fputc fgets fgetc fseek fseeko
ftell ftello fflush freopen fileno fdopen fmemopen open_memstream feof ferror clearerr perror popen pclose
setbuf setbuffer setvbuf setlinebuf ctermid cuserid fgetpos fsetpos flockfile ftrylockfile funlockfile
getc_unlocked getchar_unlocked putc_unlocked putchar_unlocked clearerr_unlocked feof_unlocked
ferror_unlocked fflush_unlocked fgetc_unlocked fputc_unlocked fread_unlocked fwrite_unlocked fileno_unlocked
off_t size_t ssize_t va_list fpos_t float_t double_t index rindex bcmp bcopy bzero abs abort div labs malloc
calloc realloc free memcpy memset memcmp strlen strcmp ffs time clock signal select read write open close
START SIZES TIMES SAMPLES DURATION VARIABLES HALVINGS TOLERANCE H f t state rates sign pi take follow
"""
"""Further names that the library of C or compilers know, and those that these programs have of their own."""

C = Language(
    comment="//",
    power="",
    fractional=True,
    functions={"abs": "fabs"},
    words=frozenset([*WORDS.split(), *OTHERS.split()])
    | {name + end for name in MATH.split() for end in ("", "f", "l")},
)
"""C; a fractional power of a negative number is not a number."""

PI = "static const double pi = 3.141592653589793;\n"

SIGN = """
static double sign(double x)
{
    return (x > 0) - (x < 0);
}
"""

STEPS = """
// Takes classical Runge-Kutta steps from one time to another.
static void take(long steps, double from, double to, double z[VARIABLES])
{
    const double dt = (to - from) / steps;
    double k1[VARIABLES], k2[VARIABLES], k3[VARIABLES], k4[VARIABLES], next[VARIABLES];
    for (long n = 0; n < steps; n++) {
        const double now = from + n * dt;
        f(now, z, k1);
        for (int i = 0; i < VARIABLES; i++) next[i] = z[i] + dt / 2 * k1[i];
        f(now + dt / 2, next, k2);
        for (int i = 0; i < VARIABLES; i++) next[i] = z[i] + dt / 2 * k2[i];
        f(now + dt / 2, next, k3);
        for (int i = 0; i < VARIABLES; i++) next[i] = z[i] + dt * k3[i];
        f(now + dt, next, k4);
        for (int i = 0; i < VARIABLES; i++) z[i] += dt / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
    }
}

// Takes 4 steps and, from the same state, 8; where these differ, each half of the time by itself.
// Returns 0 if HALVINGS of the time are not enough.
static int follow(double from, double to, double z[VARIABLES], int halvings)
{
    double coarse[VARIABLES], fine[VARIABLES];
    int same = 1;
    for (int i = 0; i < VARIABLES; i++) coarse[i] = fine[i] = z[i];
    take(4, from, to, coarse);
    take(8, from, to, fine);
    for (int i = 0; i < VARIABLES; i++) same = same && fabs(fine[i] - coarse[i]) <= TOLERANCE * SIZES[i];
    for (int i = 0; same && i < VARIABLES; i++) z[i] = fine[i];
    if (same || halvings == 0) return same;
    const double middle = from + (to - from) / 2;
    return follow(from, middle, z, halvings - 1) && follow(middle, to, z, halvings - 1);
}
"""
"""What follows the state. Names of the document may be hidden here, where none is used."""


def render(reports: Iterable[Report], look: Look) -> Iterator[str]:
    """A program for each report."""
    for report in reports:
        yield _written(Source(report, C))


def _written(source: Source) -> str:
    program = source.program
    slopes = (
        source.broken(f"    rates[{place}] = ", source.formula(tree), ";") + "\n"
        for place, tree in enumerate(program.rates.values)
    )
    functions = f"""
// The derivatives of {", ".join(program.variables)} by time.
void f(double t, const double state[], double rates[])
{{
{_locals(source, program.rates)}{"".join(slopes)}}}
"""
    for name, formulas in program.quantities.items():
        value = source.broken("    return ", source.formula(formulas.values[0]), ";")
        functions += f"""
double {source.function(name)}(double t, const double state[])
{{
{_locals(source, formulas)}{value}
}}
"""
    constants = source.constants("static const double ", ";", "NAN")
    constants = (PI if "pi" in source.used else "") + constants
    functions = (SIGN if "sign" in source.used else "") + functions
    includes = "#include <math.h>\n"
    if program.run is not None:
        includes += "#include <stdio.h>\n"
    heading = source.heading("cc -O2 program.c -o program -lm && ./program > orbit.csv")
    return f"{heading}\n{includes}\n{constants}{functions}{_main(source)}"


def _locals(source: Source, formulas: Formulas) -> str:
    """The values of the variables that are used, and of steps, in a function."""
    unused = "" if source.program.time in formulas.names else "    (void)t;\n"
    values = (f"    const double {name} = state[{i}];\n" for i, name in source.variables(formulas))
    return unused + "".join(values) + source.lines(formulas, "    const double ", ";")


def _main(source: Source) -> str:
    """What follows the orbit and prints it."""
    program, run = source.program, source.program.run
    if run is None:
        return "\n" + source.comment(
            "The document has no orbit, so that nothing is run here. f gives the rates of "
            f"{', '.join(program.variables)} at a time, for any method of integration."
        )
    size, even = len(program.variables), source.times()
    samples = len(run.times)
    times = f"static const double TIMES[SAMPLES] = {{{source.numbers(run.times)}}};\n"
    at = "TIMES[sample]"
    if even is not None:
        times = f"static const double DURATION = {even[0]!r};\n"
        at = "sample * (DURATION / (SAMPLES - 1))"
    shown, called = source.printed
    cells = [*(f"state[{place}]" for place in range(shown)), *called]
    prints = "".join(f'        printf(",%.17g", {cell});\n' for cell in cells)
    return f"""
enum {{ VARIABLES = {size}, SAMPLES = {samples} }};

static const double START[VARIABLES] = {{{source.numbers(run.start)}}};
// The sizes of the variables on the way: errors between two samples are measured by them.
static const double SIZES[VARIABLES] = {{{source.numbers(run.sizes)}}};
static const double TOLERANCE = {TOLERANCE};
static const int HALVINGS = {HALVINGS};
{times}{STEPS}
int main(void)
{{
    double t = 0, state[VARIABLES];
    for (int i = 0; i < VARIABLES; i++) state[i] = START[i];
    puts("{",".join(program.columns)}");
    for (long sample = 0; sample < SAMPLES; sample++) {{
        const double next = {at};
        if (next > t && !follow(t, next, state, HALVINGS)) {{
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
