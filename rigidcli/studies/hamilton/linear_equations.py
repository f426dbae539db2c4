"""Linear equations of motion: their matrix with its eigenvalues, the stability, and the steady response.

A system that is driven by forces f cos(w t + a) or f sin(w t + a) has a steady response:

    M q'' + C q' + K q = f cos(w t)   has the solution   q = Re(X exp(i w t)),   (K - w^2 M + i w C) X = f.

So a coordinate swings with the amplitude |X_i|, and lags behind the force by the phase -arg X_i. Where i w is
a rate of the free motion, as that of an oscillator without damping, the response grows as t sin(w t) instead.
Forces of one rate are added up, as f cos(w t) + g sin(w t) = Re((f - i g) exp(i w t)).
Source: J. R. Taylor, Classical Mechanics, sections 5.5 and 5.6.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.algebra import matrices
from rigidcli.algebra.arithmetic import inequality, sign, sqrt
from rigidcli.algebra.atoms import Applied, Atom
from rigidcli.algebra.bounds import Rational
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ONE, PI, ZERO, Expr, atomic, expr, factored, gathered, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.simplification import shortest, tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero
from rigidcli.core.arithmetic import EPS, Array
from rigidcli.document.document import Document
from rigidcli.errors import ExpressionError
from rigidcli.language.text import latex, latex_name, reading
from rigidcli.mechanics.phase_space import TIME
from rigidcli.mechanics.small_oscillations import LinearMotion, Root, Values, spectrum
from rigidcli.report import Field, Step
from rigidcli.studies.common import if_known
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.system import known_values, row_of, step

# The most coordinates whose response is written in letters: determinants of more fill a page.
MOST_IN_LETTERS = 3
# A rate of the free motion this near to that of the force, in units of it, is the same.
IN_RESONANCE = 1e-9
# The widest matrix that people are shown: a terminal has room for no more.
MOST_COLUMNS = 8
# The keys of the results that follow from the matrix of linear equations.
SPECTRUM = ("eigenvalues", "frequencies", "stability")
STABILITY = {
    "stable": "stable: motion stays bounded",
    "marginal": "marginal: deviations grow like a power of t, slower than an exponential",
    "unstable": "unstable: motion grows exponentially",
}


def fields(document: Document, derivation: Derivation) -> list[Field]:
    """The matrix of linear equations, and what its eigenvalues tell."""
    if derivation.linear is None:
        return [Field(key, None) for key in ("matrix", "offset", *SPECTRUM)]
    (matrix, offset), names = derivation.linear, derivation.phase.names
    shift = " + b" if offset.any() else ""
    title, is_small = f"A of z' = A z{shift}, z = ({', '.join(names)})", len(names) <= MOST_COLUMNS
    shown = [
        row_of("matrix", matrix, title=title if is_small else ""),
        row_of("offset", offset, title="b" if shift and is_small else ""),
    ]
    roots = _roots(matrix, document, derivation)
    if roots is None:
        return shown + [Field(key, None) for key in SPECTRUM]
    pairs = [pair for root in roots for pair in eigenvalues(root)]
    if isinstance(pairs[0][0], float):
        pairs.sort()
    stability = stability_of(roots)
    is_shifted = any(not e.is_zero and TIME not in e.names for e in offset)
    if stability == "stable" and is_shifted:
        # There is a point of rest if b is orthogonal to all that A^T takes to zero. Else motion grows.
        left = matrices.null_vectors(matrix.T.tolist())
        stability = "stable" if all(is_zero(total(v * offset)) for v in left) else "marginal"
    # Stability is a question about an equilibrium, and none about free fall, where nothing swings or grows.
    is_hidden = document.equilibrium is None or not any(root.angular or root.growth for root in roots)
    driven = ", apart from what b(t) drives" if any(TIME in e.names for e in offset) else ""
    # The angular frequencies of what swings without growing, each once.
    angular = list(dict.fromkeys(root.angular for root in roots if root.angular and not root.growth))
    is_numeric = all(isinstance(rate, float) for rate in angular)
    kind, unit = (float, "rad/s") if is_numeric else (object, "")
    cells = {f"frequencies.{k}": (k,) for k in range(len(angular))}
    frequencies = row_of("frequencies", np.array(angular, dtype=kind), cells=cells, unit=unit)
    frequencies.title *= bool(angular)
    return [
        *shown,
        Field("eigenvalues", [{"re": re, "im": im} for re, im in pairs]),
        frequencies,
        row_of("stability", stability, STABILITY[stability] + driven, diagnostic=is_hidden),
    ]


def _roots(matrix: Array, document: Document, derivation: Derivation) -> list[Root] | None:
    """The roots; None where the matrix changes with the time, or the signs of symbols decide."""
    if _changes(matrix):
        return None
    known = known_values(document)
    try:
        if not document.exact_results:
            matrix = np.frompyfunc(lambda e: substitute(e, known), 1, 1)(matrix)
        motion, is_free = LinearMotion.of_matrix(matrix), not derivation.is_forced
        roots = spectrum(motion, known, document.exact_results, is_free, needs_vectors=False)
    except ExpressionError:
        return None
    return None if roots is None or any(root.condition is not None for root in roots) else roots


def _changes(matrix: Array) -> bool:
    """Whether a matrix changes with the time, or may do so by an unknown function."""
    return any(TIME in e.names or e.unknown for e in matrix.flat)


def eigenvalues(root: Root) -> list[tuple[Any, Any]]:
    """The real and imaginary parts of all eigenvalues that a root stands for."""
    sides = (-1, 1) if root.is_paired and root.growth else (1,)
    return [
        (a * root.growth, b * root.angular) for a in sides for b in ((-1, 1) if root.angular else (1,))
    ] * root.times


def stability_of(roots: Sequence[Root]) -> str:
    """Whether motion stays bounded: no rate grows, and equal ones have as many vectors."""
    if any(root.growth and root.is_stable is False for root in roots):
        return "unstable"
    return "stable" if all(root.is_whole for root in roots) else "marginal"


# --- the steady response

# A result in letters or as a number; None where there is none.
Quantity: TypeAlias = Expr | float | None


class DrivingForce(NamedTuple):
    """Forces f (n) times a `function`, and g (n) `behind` it, times that a quarter turn later.

    The function is cos or sin of w t + a, or 1 for constant forces, where w = 0.
    """

    function: Expr
    rate: Expr
    amplitudes: Array
    behind: Array


class CoordinateResponse(NamedTuple):
    """The amplitude of a coordinate and its phase (rad); or how much the amplitude grows a second."""

    amplitude: Quantity = None
    phase: Quantity = None
    growth: Quantity = None


class Response(NamedTuple):
    """The steady response of each coordinate to a force.

    `matrix` is K - w^2 M + i w C, its real and its imaginary part. The amplitude of a single coordinate is
    largest at the `peak`: the rate of the force, and that amplitude, which is None without damping.
    """

    force: DrivingForce
    rate: Quantity
    matrix: tuple[Array, Array]
    swings: dict[str, CoordinateResponse]
    peak: tuple[Quantity, Quantity] | None = None

    @property
    def written(self) -> str:
        """The function of the force as people read it."""
        return "a constant force" if self.force.rate.is_zero else reading(self.force.function.tree())

    @property
    def record(self) -> dict[str, Any]:
        """The response as JSON has it."""
        keys, (re, im) = CoordinateResponse._fields, (part.tolist() for part in self.matrix)
        parts = {key: {q: getattr(swing, key) for q, swing in self.swings.items()} for key in keys}
        peak = None if self.peak is None else {"rate": self.peak[0], "amplitude": self.peak[1]}
        about = {"force": self.force.function, "rate": self.rate}
        return {**about, **parts, "peak": peak, "matrix": {"re": re, "im": im}}

    def rows(self, key: str, mark: str) -> Iterator[Field]:
        """Each number for people, and for CSV under a key; symbols end with a mark of the force."""
        for part, title, symbol, unit in (
            ("amplitude", "amplitude of {} for", "A", ""),
            ("phase", "phase of {} behind", r"\delta", "rad"),
            ("growth", "growth a second of {} for", r"\dot A", ""),
        ):
            for q, swing in self.swings.items():
                value, cells = getattr(swing, part), {f"{key}.{part}.{q}": ()}
                words, sign = f"{title.format(q)} {self.written}", f"{symbol}_{{{latex_name(q)}{mark}}}"
                here = unit if isinstance(value, float) else ""
                yield if_known(Field("", value, words, sign, here, cells))
        if self.peak is not None:
            rate, largest = self.peak
            unit, sign = "rad/s" if isinstance(rate, float) else "", rf"_{{\text{{res}}{mark}}}"
            yield Field("", rate, f"resonance for {self.written} at", rf"\omega{sign}", unit)
            yield if_known(Field("", largest, f"largest amplitude for {self.written}", f"A{sign}"))


class Driven(NamedTuple):
    """The responses of a `motion` to its forces, and the quality factor of a single damped coordinate.

    The free motion beside them `grows`, if that is known; `trouble` says why there are no responses.
    """

    responses: tuple[Response, ...]
    quality: Quantity
    motion: LinearMotion
    grows: bool = False
    trouble: str = ""

    def notes(self) -> Iterator[str]:
        """What is not written in symbols, what holds for some of their values only, and motion that grows."""
        if self.trouble:
            yield f"the response to driving forces is not worked out: {self.trouble}"
        if self.grows and self.responses:
            yield "the free motion grows, and leaves the response to the force"
        for place, one in enumerate(self.responses):
            if all(swing.amplitude is None and swing.growth is None for swing in one.swings.values()):
                yield (
                    f"the response X to {one.written} is not written in letters: `response.{place}.matrix` "
                    "times X is the force; with values for all parameters it is given in numbers"
                )
            if one.peak is not None and isinstance(one.peak[0], Expr) and one.peak[1] is not None:
                yield f"the driven amplitude has a largest value where {inequality(one.peak[0] ** 2)}"

    def fields(self) -> list[Field]:
        """Report the responses as JSON has them, and each number for people and for CSV."""
        shown = [Field("response", [one.record for one in self.responses])] if self.responses else []
        for place, one in enumerate(self.responses):
            mark = f",{latex(one.force.function.tree())}" if len(self.responses) > 1 else ""
            shown += one.rows(f"response.{place}", mark)
        return shown if self.quality is None else [*shown, row_of("quality", self.quality)]

    def steps(self) -> Iterator[Step]:
        """Lead to the amplitudes and phases."""
        for one in self.responses:
            given = (
                (one.matrix[0], "K - w^2 M", r"K - \omega^2 M"),
                (one.matrix[1], "w C", r"\omega C"),
                (one.force.amplitudes, "f", r"\mathbf{f}"),
                *([(one.force.behind, "g", r"\mathbf{g}")] if one.force.behind.any() else []),
            )
            shown = [Field("", part, title, symbol) for part, title, symbol in given]
            swings = [row for row in one.rows("", "") if row.value is not None]
            yield step("response", [*shown, *swings], force=one.written)


def driven(document: Document, derivation: Derivation) -> Driven | None:
    """The steady response of a system; None where it is not linear, or neither driven nor damped."""
    if derivation.linear is None:
        return None
    matrix, offset = derivation.linear
    is_driven = any(TIME in e.names for e in offset)
    is_damped = len(offset) == 2 and not is_zero(matrix.trace())
    if not (is_driven or is_damped) or _changes(matrix):
        return None
    motion = LinearMotion.of_matrix(matrix)
    try:
        if motion.is_of_first_order:
            return None
        forces = _forces(motion, matrix, offset)
        names = derivation.phase.coordinates
        found = [_response(document, names, motion, force) for force in forces if is_driven]
        m, c, k = (part[0, 0] for part in motion)
        has_quality = is_damped and sign(c) == 1 and sign(k) == 1
        quality = _value(document, tidy(sqrt(k * m) / c)) if has_quality else None
        responses = tuple(one for one in found if one is not None)
        free = _roots(matrix, document, derivation) if responses else None
        return Driven(responses, quality, motion, free is not None and stability_of(free) == "unstable")
    except ExpressionError as error:
        return Driven((), None, motion, trouble=error.message)


def _forces(motion: LinearMotion, matrix: Array, offset: Array) -> list[DrivingForce]:
    """The forces f of M q'' + C q' + K q = f, those of one rate together.

    There are none where one is no sum of sines and cosines of w t + a, such as a pulse.
    """
    # With q' = A q + B p + a and p' = D q + E p + b they are f = b + M a' - E M a.
    size = len(offset) // 2
    moved = motion.masses @ offset[:size]
    lost = matrix[size:, size:] @ moved
    waves = list[tuple[int, Expr, Expr]]()  # each is a coefficient times the cosine of an angle at a place
    for place in range(size):
        force = offset[size + place] + derivative(moved[place], TIME) - lost[place]
        for monomial, factor in expand(force).terms.items():
            still = tuple((atom, power) for atom, power in monomial if TIME not in atom.names)
            angle = _angle_of([(atom, power) for atom, power in monomial if TIME in atom.names])
            if angle is None:
                return []
            waves.append((place, angle, Expr({still: factor})))
    alike: dict[Expr, list[tuple[int, Expr, Expr]]] = {}
    for wave in waves:
        rate = tidy(derivative(wave[1], TIME))
        same = next((w for w in alike if is_zero(w - rate) or is_zero(w + rate)), rate)
        alike.setdefault(same, []).append(wave)
    # Constant forces come last.
    return [_together(size, alike[rate]) for rate in sorted(alike, key=lambda rate: rate.is_zero)]


def _angle_of(factors: Sequence[tuple[Atom, Rational]]) -> Expr | None:
    """The angle w t + a whose cosine a single factor is, or zero without factors; else None."""
    if not factors:
        return ZERO
    ((atom, power), *others) = factors
    if others or power != 1 or not isinstance(atom, Applied) or atom.function not in ("sin", "cos"):
        return None
    angle = _angle(atom)
    return None if TIME in derivative(angle, TIME).names else angle


def _angle(wave: Applied[Expr]) -> Expr:
    """The angle whose cosine a sine or cosine is."""
    angle = expr(wave.arguments[0])
    return angle - PI / 2 if wave.function == "sin" else angle


def _together(size: int, waves: Sequence[tuple[int, Expr, Expr]]) -> DrivingForce:
    """The force that waves of one rate are together, each a coefficient times the cosine of an angle."""
    atoms = (atom for _, angle, _ in waves for atom in apply("cos", angle).atoms)
    timed = [atom for atom in atoms if isinstance(atom, Applied) and TIME in atom.names]
    function, start = ONE, ZERO
    if timed:
        first = min(timed, key=lambda wave: (wave.function != "cos", wave.key))
        function, start = atomic(first), _angle(first)
    along, behind = (np.array([ZERO] * size, dtype=object) for _ in range(2))
    for place, angle, c in waves:
        # cos(u + d) = cos d cos u - sin d sin u
        ahead, turned = tidy(angle - start), tidy(-angle - start)
        d = turned if TIME in ahead.names else ahead
        along[place] += c * apply("cos", d)
        behind[place] -= c * apply("sin", d)
    rate = tidy(derivative(start, TIME))
    return DrivingForce(function, rate, _short(along), _short(behind))


def _short(array: Array) -> Array:
    return np.array([tidy(e) for e in array.flat], dtype=object).reshape(array.shape)


def _value(document: Document, e: Expr | None) -> Quantity:
    """A result with the values of the parameters put in; in letters where they have none."""
    if e is None or document.exact_results:
        return e
    e = substitute(e, known_values(document))
    return e if e.names else float(e)


def _response(
    document: Document, names: Sequence[str], motion: LinearMotion, force: DrivingForce
) -> Response | None:
    """The response to a force; None where a constant force has none."""
    w, known = force.rate, known_values(document)
    real, imaginary = _short(motion.pencil(ZERO, -(w**2))), _short(motion.rates * w)
    entries, rate = (*motion.entries, w, *force.amplitudes, *force.behind), _value(document, w)
    if not document.exact_results and all(e.names <= known.keys() for e in entries):
        swings = list(_in_numbers(motion, force, known))
    else:
        in_letters = _in_letters(motion, force, real, imaginary)
        swings = [CoordinateResponse(*(_value(document, e) for e in swing)) for swing in in_letters]
    swings = swings or [CoordinateResponse()] * len(names)
    if not rate and all(swing.amplitude is None for swing in swings):
        return None
    peak = None
    if len(names) == 1 and (found := _peak(motion, force, {} if document.exact_results else known)):
        peak = _value(document, found[0]), _value(document, found[1])
    return Response(force, rate, (real, imaginary), dict(zip(names, swings, strict=True)), peak)


def _in_letters(
    motion: LinearMotion, force: DrivingForce, real: Array, imaginary: Array
) -> Iterator[tuple[Expr | None, ...]]:
    """The amplitude, phase and growth of each coordinate; nothing where they would fill a page."""
    (f, *others), g = force.amplitudes, force.behind[0]
    a, b, mass = real[0, 0], imaginary[0, 0], motion.masses[0, 0]
    size = sqrt(f**2 + g**2) if g else abs(f)
    if not others and is_zero(a) and is_zero(b) and not force.rate.is_zero:
        yield None, None, tidy(size / (2 * mass * force.rate))
    elif not others and g:
        # (a + i b) X = f - i g
        yield tidy(size / sqrt(a**2 + b**2)), apply("atan2", tidy(f * b + g * a), tidy(f * a - g * b)), None
    elif not others and not is_zero(b):
        # (a + i b) X = f has |X| = |f|/sqrt(a^2 + b^2) and the phase atan2(b, a). The mass stands before the
        # root, as in F/(m sqrt((w0^2 - w^2)^2 + (2 b w)^2)), or in it.
        scaled = [(tidy(f / s), tidy(a / s), tidy(b / s)) for s in (ONE, mass)]
        amplitude = shortest([abs(f) / apply("sqrt", a**2 + b**2) for f, a, b in scaled])
        lag = shortest([apply("atan2", b, a) for _, a, b in scaled])
        # A negative force is half a turn behind.
        yield amplitude, tidy(lag + PI * (1 - apply("sign", f)) / 2), None
    elif len(real) <= MOST_IN_LETTERS and not imaginary.any():
        # X = (K - w^2 M)^-1 (f - i g). Where it is real, phases are 0 or pi.
        for row in matrices.inverse(real.tolist()) or ():
            answer, late = (tidy(total(part * row)) for part in (force.amplitudes, force.behind))
            if late:
                yield tidy(sqrt(answer**2 + late**2)), apply("atan2", late, answer), None
                continue
            number, monomial = factored(answer)
            # A divisor has the sign of its inverse.
            side = apply("sign", gathered(number, {atom: max(n, -n) for atom, n in monomial}))
            yield abs(answer), PI * (1 - side) / 2, None


def _peak(motion: LinearMotion, force: DrivingForce, known: Values) -> tuple[Expr, Expr | None] | None:
    """The rate of the force with the largest amplitude, sqrt(k/m - c^2/(2 m^2)), and that amplitude."""
    (f,), (m, c, k) = force.amplitudes, (part[0, 0] for part in motion)
    squared = tidy(k / m) - c**2 / (2 * m**2)
    there, damping = substitute(squared, known), substitute(c, known)
    # A force whose size depends on its rate, as that of an unbalanced wheel or a base, has another peak. So
    # it may be with parts that depend on the rate apart, of which a number does not tell.
    g, own = force.behind[0], force.rate.names
    is_fixed = own.isdisjoint(f.names | g.names) and not force.rate.is_zero and bool(own or not g)
    size = sqrt(f**2 + g**2) if g else abs(f)
    if not is_fixed or sign(k) != 1 or sign(there) not in (None, 1) or sign(damping) == -1:
        return None
    largest = None if is_zero(damping) else size / (c * apply("sqrt", tidy(k / m) - c**2 / (4 * m**2)))
    return apply("sqrt", squared), largest


def in_numbers(motion: LinearMotion, force: DrivingForce, values: Values) -> tuple[NDArray[Any], ...]:
    """M, C, K (n by n each) and f - i g (n, complex) for these values of the parameters."""
    in_floats = np.vectorize(lambda e: float(substitute(e, values)), otypes=[np.float64])
    m, c, k, f, g = map(in_floats, (*motion, force.amplitudes, force.behind))
    return m, c, k, f - 1j * g


def _in_numbers(motion: LinearMotion, force: DrivingForce, values: Values) -> Iterator[CoordinateResponse]:
    """The response of each coordinate, which grows by the modes that have the rate of the force."""
    m, c, k, f = in_numbers(motion, force, values)
    w, size = float(substitute(force.rate, values)), len(f)
    # z' = A z has the coordinates and the velocities in z.
    first_order = np.block([[np.zeros((size, size)), np.eye(size)], [-np.linalg.solve(m, np.hstack([k, c]))]])
    rates, vectors = np.linalg.eig(first_order)
    near = np.abs(rates - 1j * w) <= IN_RESONANCE * max(abs(w), EPS * np.abs(rates).max())
    if not near.any():
        grown, answer = np.zeros(size), np.linalg.solve(k - w**2 * m + 1j * w * c, f)
    elif np.linalg.cond(vectors) * EPS > IN_RESONANCE:
        grown, answer = np.full(size, np.nan), np.full(size, np.nan + 0j)
    else:
        forces = np.append(np.zeros(size), np.linalg.solve(m, f))
        shares: NDArray[np.complex128] = np.linalg.solve(vectors, forces)
        grown, sizes = np.abs(vectors[:, near] @ shares[near])[:size], np.abs(vectors) @ np.abs(shares)
        grown[grown <= IN_RESONANCE * sizes[:size]] = 0.0  # no force acts on the modes that have its rate
        answer = (vectors @ np.where(near, 0.0, shares / np.where(near, 1.0, 1j * w - rates)))[:size]
    for x, rate in zip(answer, grown.tolist(), strict=True):
        steady = CoordinateResponse(float(np.abs(x)), float(-np.angle(x) + 0.0))
        yield CoordinateResponse(growth=rate if math.isfinite(rate) else None) if rate else steady
