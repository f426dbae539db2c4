"""Numbers and quantities: right in every spelling and unit, wrong when they are off, and told why."""

from __future__ import annotations

import math
import pickle
import re
import time
from decimal import ROUND_HALF_DOWN, ROUND_HALF_UP, Decimal
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from rigidcli.document.load import load
from rigidcli.document.syntax import read_tree
from rigidcli.errors import ValueProblem
from rigidcli.fields import units
from rigidcli.grading import numbers
from rigidcli.grading.asked import Asked
from rigidcli.grading.codes import CODES
from rigidcli.grading.feedback import sentence
from rigidcli.grading.kinds.number import Number
from rigidcli.grading.numbers import read_number, read_written
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import Question, Tolerance
from rigidcli.grading.scalars import Key
from rigidcli.grading.units import read_unit
from rigidcli.report import Field, Report
from rigidcli.studies import precess
from tests.grading.asking import Asking, answers, cases, require_examples

judged = Asking("number").judged

many = settings(max_examples=100, deadline=None)
some = settings(max_examples=60, deadline=None)  # where each example judges dozens of answers

NUMBER = Number()


def literal(answer: str, **options: Any) -> Key:
    question = Question.model_validate({"answer": answer, **options})
    return NUMBER.read_key(Asked(question, answer))


def computed(value: object, si: str = "", path: tuple[str, ...] = (), **options: Any) -> Key:
    question = Question.model_validate({"ask": ".".join(path) or "x", **options})
    report = Report("test/1", "", "", "", (Field(".".join(path[1:]), value),))
    return NUMBER.read_key(Asked(question, value, si, path, report=report))


def told(key: Key, answer: Any) -> str:
    """The verdict on a right answer, else the codes."""
    outcome = judged(key, answer)
    assert outcome.share == (outcome.verdict == "correct")
    return " ".join(finding.code for finding in outcome.findings) or outcome.verdict


def figures(n: int, how: str = "value") -> dict[str, Any]:
    return {"tolerance": {"significant_figures": n, "figures": how}}


# --- reading


@pytest.mark.parametrize(
    ("text", "value", "mantissa", "unit"),
    [
        ("20.8", 20.8, "20.8", None),
        (" +20.8 ", 20.8, "20.8", None),
        ("- 5", -5.0, "5", None),
        ("-- 5", 5.0, "", None),
        ("20 + -5", 15.0, "", None),
        ("20.8 /s", 20.8, "20.8", "1/s"),
        ("20.8/s^2", 20.8, "20.8", "1/s^2"),
        ("104/5 / min", 20.8, "", "1/ min"),
        ("8/π", 8 / math.pi, "", None),
        ("6/sqrt(4)", 3.0, "", None),
        ("−5.0e−3", -0.005, "5.0", None),
        (".5", 0.5, ".5", None),
        ("5.", 5.0, "5.", None),
        ("2.08*10^1", 20.8, "2.08", None),
        ("2.08 × 10^(-3)", 0.00208, "2.08", None),
        ("2.08x10**+3 kg", 2080.0, "2.08", "kg"),
        ("1e5 m", 1e5, "1", "m"),
        ("1e5m", 1e5, "1", "m"),
        ("5cm", 5.0, "5", "cm"),
        ("30°", 30.0, "30", "°"),
        ("12%", 12.0, "12", "%"),
        ("5 1/s", 5.0, "5", "1/s"),
        ("0e9999", 0.0, "0", None),
        ("1/2", 0.5, "", None),
        ("1e-3*2", 0.002, "", None),
        ("2e5 / 4", 50_000.0, "", None),
        ("sqrt(2)/3", math.sqrt(2) / 3, "", None),
        ("2*π", 2 * math.pi, "", None),
        ("2 * pi rad/s", 2 * math.pi, "", "rad/s"),
        ("sqrt(2) / 3 kg m^2", math.sqrt(2) / 3, "", "kg m^2"),
        ("1/2 1/s", 0.5, "", "1/s"),
        ("--5", 5.0, "", None),
    ],
)
def test_a_number_is_read_as_typed(text: str, value: float, mantissa: str, unit: str | None) -> None:
    written = read_written(text)
    assert written.value == pytest.approx(value, rel=1e-15)
    assert (written.mantissa, written.unit) == (mantissa, unit)


@pytest.mark.parametrize(
    ("text", "figures", "least", "ambiguous"),
    [
        ("20.8", 3, 3, False),
        ("0.0208", 3, 3, False),
        ("0.02080", 4, 4, False),
        ("200", 3, 1, True),
        ("2010", 4, 3, True),
        ("200.", 3, 3, False),
        ("200.0", 4, 4, False),
        ("2.00e2", 3, 3, False),
        ("20e1", 2, 2, False),
        ("00200", 3, 1, True),
        ("5", 1, 1, False),
        ("0", 1, 1, False),
        ("2*pi", 0, 0, False),
        ("-1.50*10^3 m", 3, 3, False),
    ],
)
def test_figures_are_counted(text: str, figures: int, least: int, ambiguous: bool) -> None:
    written = read_written(text)
    assert (written.figures, written.least_figures, written.ambiguous) == (figures, least, ambiguous)


@cases(
    """
    code | hint | text
    not_a_number | `twenty` has no value | twenty
    not_a_number | decimal sign is a point | 20,8  20,8 rad/s
    not_a_number | nothing stands between digits | 1_000
    not_a_number | no blank stands between digits | 1 000 m
    not_a_number | FULLWIDTH | ０.５
    not_a_number | decimal digits | 0x10
    not_a_number | one side of an equation | 2*omega = 20.8 rad/s  omega == 20.8 rad/s
      omega = T = 20.8 rad/s
    not_a_number | an uncertainty is not read | 20.8 ± 0.1  20.8+-0.1 kg m^2  20.8 +− 0.1  20.8 -+ 0.1
      20.8 +/- 0.1 kg m^2  20.8 kg m^2 ± 1 %  (20.8 +- 0.1) kg m^2
    not_a_number | `t` has no value | 20 /t
    not_a_number | `true` has no value | true
    not_a_finite_number | range | 1e400  1e999999999
    not_a_finite_number | too small | 1e-400
    not_a_finite_number | division by zero | 1/0
    not_a_finite_number | too large | 10**10**10
    not_a_finite_number | real value | sqrt(-1)
    unit_incompatible | unknown unit `cubits` | 20 cubits
    unit_incompatible | unknown unit `kgms`: units stand apart | 20 kgms
    unit_incompatible | out of bounds | 20 kg m^99
    unit_incompatible | unexpected `+` | 20 kg + 1 g
    """,
    ("not_a_number", "empty", ""),
    ("not_a_number", "nested", "(" * 200),
    ("not_a_finite_number", "", "inf"),
    ("not_a_finite_number", "", "-.nan"),
    ("not_a_finite_number", "", "NaN kg m^2"),
    ("not_a_finite_number", "", "inf kg m^2"),
    ("not_a_finite_number", "", "-∞"),
    ("too_large", "401 characters", "1" * 401),
)
def test_what_is_no_number_is_invalid_and_told_why(text: str, code: str, hint: str) -> None:
    outcome = judged(literal("3 kg m^2"), text)
    assert outcome.verdict == "invalid"
    (finding,) = outcome.findings
    assert finding.code == code
    assert hint in finding.detail


@cases(
    """
    key | answer
    20.8 rad/s | omega = 20.8 rad/s  ω=20.8 rad/s  omega_1 = 20.8
    0.025 kg m^2 | 2.5 x 10^-2 kg m^2  2.5 x 10⁻² kg m²  2.5·10⁻² kg·m²  I_zz = 2.5 × 10⁻²kg.m²
      0.025 kg.m^2  0.025 kg·m^2  0.025 kg-m^2
    2.5e12 m | 2.5 x 10¹² m
    3 N m | 3 N-m  3 N·m  3 N.m
    0.05 m | 5cm
    0.5 | 1/2
    omega = 0.5 rad/s | 1/2 rad/s
    2*pi rad | 2*π rad
    0 | cos(pi/2)  sin(pi)  sqrt(2)^2 - 2  1 - 0.9 - 0.1
    cos(pi/2) | 0
    cos(pi/2) m | 0 m
    1 - 0.9 - 0.1 | 0
    """,
    ("20.8 rad/s", "  phi_dot  =  20.8 1/s"),
)
def test_spellings_of_homework(key: str, answer: str) -> None:
    assert told(literal(key, tolerance={"relative": 1e-12}), answer) == "correct"
    assert told(literal(key), key) == "correct"


def test_a_key_has_no_uncertainty() -> None:
    with pytest.raises(ValueProblem, match="cannot be read"):
        literal("20.8 +- 0.1 rad/s")


@settings(max_examples=200, deadline=None)
@given(st.one_of(st.text(max_size=60), st.text("0123456789.,eE+-*/^()_ xπ×·°%mskgradpiN⁻²³", max_size=450)))
def test_any_text_is_judged_or_refused(text: str) -> None:
    key = literal("20.8 rad/s")
    begin = time.process_time()
    outcome = judged(key, text)
    assert time.process_time() - begin < 0.5
    assert outcome.verdict in ("correct", "incorrect", "invalid")


@many
@given(
    st.floats(allow_nan=False, allow_infinity=False).filter(bool),
    st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from(
        ["m", "Qm", "qm", "Qm^3/m^2", "qm^3/m^2", "qm^12/m^11", "qm^4/Qm^3", "Qm^4/qm^3", "pc", "ly"]
    ),
    st.sampled_from(
        [{}, {"significant_figures": 3}, {"absolute": 1e-30}, {"significant_figures": 2, "figures": "strict"}]
    ),
    st.sampled_from([None, "1e-300 m", "1 m", "1e300 m"]),
)
def test_numbers_and_units_of_any_size_are_judged(
    reference: float, answer: float, unit: str, tolerance: dict[str, Any], modulo: str | None
) -> None:
    if modulo is not None and abs(reference) > 1e6 * float(modulo.split()[0]):
        with pytest.raises(ValueProblem, match="too many periods"):
            computed(reference, "m", modulo=modulo)
        return
    for key in (
        computed(reference, "m", tolerance=tolerance, modulo=modulo),
        literal(f"{reference!r} m", tolerance=tolerance, modulo=modulo),
    ):
        assert judged(key, f"{answer!r} {unit}").verdict in ("correct", "incorrect", "invalid")
        assert judged(key, f"{reference!r} {unit}").verdict in ("correct", "incorrect", "invalid")
        assert told(key, f"{reference:.16e} m") in ("correct", "wrong_shape")


@cases("""
    same | text
    rad/s | rad/sec  rads/s  Radians/Second
    rpm | RPM
    m/s^2 | m/s2  m s⁻²
    kg/m^3 | kg m-3
    kg m^2 | kg·m²  Kg m2  kgm^2  kgm2
    N m | Nm
    N m/rad | Nm/rad
    N m^2/kg^2 | Nm^2/kg^2
    kg m^2/s | kgm²/s
    g cm^2 | gcm**2
    J/(kg m^2) | J/kgm^2
    1/(N m) | 1/Nm
    um | μm
    s^2 | sec²
    N | Newtons
    Hz | hz
    """)
def test_units_of_homework(text: str, same: str) -> None:
    one, other = read_unit(text), units.parse_unit(same)
    assert (one.factor, one.pi_power, one.dimension) == (other.factor, other.pi_power, other.dimension)


@pytest.mark.parametrize(
    "text", ["mM", "mil", "gss", "parsnip", "м", "_pint", "__class__", "x10", "degC", "e", "K" * 300]
)
def test_other_units_are_unknown(text: str) -> None:
    with pytest.raises(Unreadable) as caught:
        read_unit(text)
    assert caught.value.finding.code == "unit_incompatible"


def test_numbers_have_units_or_are_plain() -> None:
    metre = units.parse_unit("m")
    got = [read_number(text, metre) for text in ("1 cm", "2*pi", "-3", "5 in")]
    assert got == pytest.approx([0.01, 2 * math.pi, -3, 0.127], rel=1e-15)
    assert read_number("12 %") == pytest.approx(0.12)
    assert read_number("180 deg") == pytest.approx(math.pi)
    for text, code in (("1 kg", "unit_incompatible"), ("x", "not_a_number")):
        with pytest.raises(Unreadable) as caught:
            read_number(text, metre, place="entry 2")
        assert (caught.value.finding.code, caught.value.finding.place) == (code, "entry 2")


# --- right in every form, and wrong when off

SCALES: dict[str, dict[str, float]] = {
    "rad/s": {"1/s": 1, "rpm": math.pi / 30, "deg/s": math.pi / 180, "rev/s": 2 * math.pi, "rad/min": 1 / 60},
    "kg m^2": {"g cm^2": 1e-7, "kg*cm^2": 1e-4, "g m²": 1e-3, "lb ft^2": 0.45359237 * 0.3048**2},
    "m/s": {"km/h": 1 / 3.6, "cm/s": 0.01, "mph": 1609.344 / 3600, "ft/s": 0.3048},
    "s": {"ms": 1e-3, "min": 60, "h": 3600, "yr": 31_557_600, "sec": 1},
    "m": {"cm": 0.01, "km": 1000, "in": 0.0254, "ft": 0.3048, "mm": 1e-3},
    "rad": {"deg": math.pi / 180, "rev": 2 * math.pi, "°": math.pi / 180, "mrad": 1e-3},
    "N m": {"J": 1, "N cm": 0.01, "kg m^2/s^2": 1, "erg": 1e-7},
    "Hz": {"1/s": 1, "kHz": 1000, "rev/s": 1, "rpm": 1 / 60},
    "": {"%": 0.01, "rad": 1},
}
"""SI units, with others and how much of the SI unit one of them is: by the definitions of the units."""

DIGITS = st.integers(1000, 99_999)
POWERS = st.one_of(st.integers(-8, 8), st.sampled_from([-160, -47, 24, 37]))
SIGNS = st.sampled_from([1, -1])


@st.composite
def decimals(draw: st.DrawFn) -> Decimal:
    """Numbers of four or five figures, of any size and sign."""
    return Decimal(draw(DIGITS) * draw(SIGNS)).scaleb(draw(POWERS) - 4)


def spelled(draw: st.DrawFn, value: Decimal) -> str:
    """A decimal number in one of the ways in which people write it; all of its digits are kept."""
    mantissa, _, power = f"{value:e}".partition("e")
    forms = [f"{value:e}", f"{mantissa}*10^{int(power)}", f"{mantissa} × 10**({int(power)})"]
    if abs(value.adjusted()) < 12:
        forms += [f"{value:f}", f"{value:f}", f"+{value:f}" if value > 0 else f"- {-value:f}"]
    text = draw(st.sampled_from(forms))
    return text.replace("-", "−") if draw(st.booleans()) else text


def rewritten(draw: st.DrawFn, value: Decimal) -> str:
    """The same number as an expression, or just spelled in another way."""
    text = spelled(draw, value)
    plain = f"({value:e})"
    forms = [
        text,
        text,
        f"{plain}/2 + {plain}*0.5",
        f"-(-{plain})",
        f"7*{plain}/sqrt(49)",
        f"{plain}*pi/(2*asin(1))",
    ]
    return draw(st.sampled_from(forms))


@many
@given(st.data(), decimals(), st.sampled_from(sorted(SCALES)))
def test_right_in_any_spelling_and_unit(data: st.DataObject, value: Decimal, unit: str) -> None:
    key = literal(f"{value:e} {unit}".strip(), tolerance={"relative": 1e-9})
    other = data.draw(st.sampled_from(["", *SCALES[unit]])) or unit
    scale = SCALES[unit].get(other, 1.0)
    typed = Decimal(f"{float(value) / scale:.17g}") if scale != 1.0 else value
    answer = f"{data.draw(st.composite(rewritten)(typed))} {other}".strip()
    assert told(key, answer) == "correct", answer
    # The same from a document, whose numbers come without their text.
    assert told(computed(np.float64(value), unit, tolerance={"relative": 1e-9}), answer) == "correct"


@many
@given(
    st.data(),
    decimals(),
    st.sampled_from(sorted(SCALES)),
    st.sampled_from([1e-1, 1e-2, 1e-3, 1e-6]),
    st.floats(-2, 2),
    SIGNS,
)
def test_a_relative_tolerance_is_a_limit(
    data: st.DataObject, value: Decimal, unit: str, relative: float, size: float, sign: int
) -> None:
    key = literal(f"{value:e} {unit}".strip(), tolerance={"relative": relative})
    assume(abs(size) > 1e-4)
    off = sign * relative * 10**size
    other, scale = data.draw(st.sampled_from([(unit, 1.0), *SCALES[unit].items()]))
    answer = f"{float(value) * (1 + off) / scale:.16e} {other}".strip()
    assert (told(key, answer) == "correct") == (size < 0), answer


@many
@given(decimals(), st.floats(0.01, 3), SIGNS, st.sampled_from([("m", 1.0), ("cm", 0.01), ("ft", 0.3048)]))
def test_an_absolute_tolerance_is_in_si_units(
    value: Decimal, ratio: float, sign: int, unit: tuple[str, float]
) -> None:
    assume(abs(ratio - 1) > 1e-3)
    absolute = abs(float(value)) / 7
    assume(1e-160 < absolute < 1e90)
    key = literal(f"{value:e} m", tolerance={"absolute": absolute})
    name, scale = unit
    answer = f"{(float(value) + sign * ratio * absolute) / scale:.16e} {name}"
    assert (told(key, answer) == "correct") == (ratio < 1)


def rounded(value: Decimal, n: int, how: str) -> Decimal:
    """To n significant figures, by the arithmetic of decimals."""
    return value.quantize(Decimal(1).scaleb(value.adjusted() + 1 - n), how)


@some
@given(st.data(), decimals(), st.integers(1, 4), st.sampled_from([ROUND_HALF_UP, ROUND_HALF_DOWN]))
@example(None, Decimal("9.995"), 3, ROUND_HALF_UP)
@example(None, Decimal("9.9999"), 2, ROUND_HALF_UP)
@example(None, Decimal("-0.99951"), 3, ROUND_HALF_UP)
def test_rounded_to_the_figures_asked_for(
    data: st.DataObject | None, value: Decimal, n: int, how: str
) -> None:
    right = rounded(value, n, how)
    right = rounded(right, n, how)  # 9.996 becomes 10.00, and that 10.0
    texts = [f"{right:e} m", f"{right:e}m"]
    if data is not None:
        texts.append(f"{data.draw(st.composite(spelled)(right))} m")
    for mode in ("value", "written", "at_least"):
        key = literal(f"{value:e} m", **figures(n, mode))
        assert [told(key, text) for text in texts] == ["correct"] * len(texts), mode
    assert told(literal(f"{value:e} m", **figures(n, "strict")), texts[0]) == "correct"
    # One unit of the last figure away from the nearest, it is wrong in every mode.
    step = Decimal(1).scaleb(value.adjusted() + 1 - n)
    for wrong in (right + step, right - step):
        if abs(wrong - value) > step / 2:
            for mode in ("value", "written", "strict", "at_least"):
                assert told(literal(f"{value:e} m", **figures(n, mode)), f"{wrong:e} m") != "correct"


@some
@given(decimals(), st.integers(2, 4), st.sampled_from(["cm", "ft", "in", "km"]))
def test_figures_count_in_the_unit_that_is_typed(value: Decimal, n: int, unit: str) -> None:
    number = Decimal(f"{float(value) / SCALES['m'][unit]:.12g}")
    right = rounded(rounded(number, n, ROUND_HALF_UP), n, ROUND_HALF_UP)
    step = Decimal(1).scaleb(number.adjusted() + 1 - n)
    for mode in ("value", "written", "strict", "at_least"):
        key = literal(f"{value:e} m", **figures(n, mode))
        assert told(key, f"{right:e} {unit}") == "correct"
        for wrong in (right + step, right - step):
            if abs(wrong - number) > step * Decimal("0.501"):
                assert told(key, f"{wrong:e} {unit}") != "correct"


@some
@given(decimals(), st.integers(1, 3), st.integers(1, 3))
def test_how_many_figures_are_written(value: Decimal, n: int, more: int) -> None:
    exact = rounded(value, n, ROUND_HALF_UP)
    assume(exact.adjusted() == value.adjusted())
    keys = {
        mode: literal(f"{exact:e} m", **figures(n, mode))
        for mode in ("value", "written", "strict", "at_least")
    }
    longer = f"{rounded(exact, n + more, ROUND_HALF_UP):e} m"
    assert told(keys["value"], longer) == told(keys["at_least"], longer) == "correct"
    assert told(keys["written"], longer) == told(keys["strict"], longer) == "wrong_shape"
    assert f"{n + more} significant figures" in judged(keys["strict"], longer).findings[0].detail
    if n > 1 and rounded(exact, n - 1, ROUND_HALF_UP) == exact:
        shorter = f"{rounded(exact, n - 1, ROUND_HALF_UP):e} m"
        assert told(keys["value"], shorter) == "correct"
        assert {told(keys[mode], shorter) for mode in ("written", "strict", "at_least")} == {
            "too_few_sig_figs"
        }


@pytest.mark.parametrize(
    ("key", "n", "answer", "expected"),
    [  # value, written, strict, at_least
        ("200", 1, "200", ("correct", "correct", "sig_figs_ambiguous", "correct")),
        ("200", 2, "200", ("correct", "correct", "sig_figs_ambiguous", "correct")),
        ("200", 3, "200", ("correct", "correct", "sig_figs_ambiguous", "correct")),
        ("200", 4, "200", ("correct", "too_few_sig_figs", "too_few_sig_figs", "too_few_sig_figs")),
        ("200", 3, "200.", ("correct", "correct", "correct", "correct")),
        ("200", 3, "2.00e2", ("correct", "correct", "correct", "correct")),
        ("200", 2, "200.", ("correct", "wrong_shape", "wrong_shape", "correct")),
        ("2340", 2, "2340", ("correct", "wrong_shape", "wrong_shape", "correct")),
        ("0.05", 3, "0.0500", ("correct", "correct", "correct", "correct")),
        ("0.05", 3, "0.05", ("correct", "too_few_sig_figs", "too_few_sig_figs", "too_few_sig_figs")),
        ("9.995", 3, "10.0", ("correct", "correct", "correct", "correct")),
        ("9.995", 3, "10", ("correct", "too_few_sig_figs", "too_few_sig_figs", "too_few_sig_figs")),
        ("9.995", 3, "9.99", ("correct", "correct", "correct", "correct")),
        ("20.83", 4, "20.8", ("precision_insufficient", *["too_few_sig_figs"] * 3)),
        ("20.83", 3, "20.7", ("outside_tolerance",) * 4),
        ("0", 3, "0", ("correct",) * 4),
        ("0", 3, "0.001", ("outside_tolerance",) * 4),
    ],
)
def test_figures_on_their_limits(key: str, n: int, answer: str, expected: tuple[str, ...]) -> None:
    modes = ("value", "written", "strict", "at_least")
    assert tuple(told(literal(key, **figures(n, mode)), answer) for mode in modes) == expected


def test_a_reference_a_rounding_below_a_power_of_ten_is_that_power() -> None:
    for reference in (1 - 1e-15, 1.0, 1 + 1e-15):
        key = computed(reference, "m", **figures(2))
        assert [told(key, f"{text} m") for text in ("1.0", "1.04", "0.96", "1.06", "0.94")] == [
            *["correct"] * 3,
            *["outside_tolerance"] * 2,
        ]


def test_an_expression_has_no_figures() -> None:
    for mode in ("value", "written", "strict", "at_least"):
        outcome = judged(literal("0.5", **figures(2, mode)), "1/2")
        assert outcome.verdict == "invalid"
        assert outcome.findings[0].code == "not_a_number"
        assert "significant figures" in outcome.findings[0].detail
    assert told(literal("1/2"), "0.5") == told(literal("0.5"), "1/2") == "correct"
    assert told(literal("2*pi rad/s", **figures(3)), "6.28 rad/s") == "correct"


# --- units and mistakes

OMEGA = "20.8 rad/s"


@cases("""
    expected | answer
    correct | 20.8 rad/s  20.8rad/s  20.8 1/s  198.6 rpm  3.31 rev/s  1192 deg/s
    unit_missing | 20.8  7  0
    wrong_unit_right_number | 20.8 rpm  20.8 Hz  20.8 deg/s  20.8 krad/s
    frequency_vs_angular_frequency | 3.31 Hz  3.31 rad/s  131 rad/s
    unit_incompatible | 5 Hz  20.8 rad  20.8 kg  20.8 rad/s^2
    sign_error | -20.8 rad/s  -199 rpm
    power_of_ten | 208 rad/s  0.0208 rad/s
    degrees_radians | 1192 rad/s  0.363 rad/s
    unit_conversion | 199 rad/s  2.18 rpm  1250 rad/s
    constant_factor | 10.4 rad/s  41.6 rad/s  99.3 rpm  14.7 rad/s
    precision_insufficient | 21 rad/s
    outside_tolerance | 200 rpm  25.1 rad/s  0 rad/s
    """)
def test_an_angular_velocity(answer: str, expected: str) -> None:
    assert told(literal(OMEGA, kind="quantity", unit="required", **figures(3)), answer) == expected


@answers(
    """
    key | options | expected | answer
    20 m | {} | correct | 20.02 m  19.98 m  1998 cm
    20 m | {} | outside_tolerance | 20.03 m  19.97 m
    # At a fifth, a factor of 3 is also one of 3.6 (km/h), of 2.54 (inches), of pi ...
    10 m/s | {tolerance: 0.2} | outside_tolerance | 31 m/s
    # ... and 0.5 is half of 0.75 but for a factor of 2/3, or its first digit.
    0.75 m | {tolerance: 1e-3} | outside_tolerance | 1 m
    # A number without a unit is in that of the key.
    1800 rpm | {} | correct | 1800  188.496 rad/s  1800 rpm
    1800 rpm | {} | unit_conversion | 188.496
    1800 rpm | {} | sign_error | -1800
    1800 rpm | {unit: required} | unit_missing | 1800
    20.8 | {} | wrong_shape | []  [20.8]  {value: 20.8, unit: rad/s}
    # Zero is zero in any unit, and what is not zero is not.
    0 m | {} | correct | 0  0 m  0.0 cm  -0 m  1-1 m  0e5
    0 m | {} | outside_tolerance | 1e-9 m
    0 m | {unit: required} | unit_missing | 1e-9
    0 m | {tolerance: {absolute: 1e-6}} | correct | 1e-9 m
    1e-160 m | {} | outside_tolerance | 0 m
    1e-17 rad | {} | outside_tolerance | 0 rad
    1e-17 | {} | outside_tolerance | 0  cos(pi/2)
    0 | {} | outside_tolerance | 1e-17  sin(3.14159265358979)  1 - 0.9 - 0.1000000000000001
    cos(pi/2) | {} | outside_tolerance | 6.123e-17
    0.025 kg m^2 | {} | power_of_ten | 2.5 x 10² kg m^2
    20.8 rad/s | {} | not_a_number | omega = omega
    # A period does not widen a relative tolerance.
    1 rad | {modulo: 2*pi} | correct | 1.0009  7.2832
    1 rad | {modulo: 2*pi} | outside_tolerance | 1e300  1.002
    0 rad | {modulo: 2*pi} | correct | 6.283
    180 deg | {modulo: 360 deg} | correct | -180 deg
    180 deg | {} | sign_error | -180 deg
    """,
    ("20.8", "{}", "not_a_number", None),
)
def test_what_is_told_of_a_number(key: str, options: str, expected: str, answer: Any) -> None:
    assert told(literal(key, **read_tree(options, "")), answer) == expected


def test_what_only_looks_like_it_is_wrong() -> None:
    for answer in ("1e4", "12345.6", "1e7", "100"):
        assert told(literal("1 rad", modulo="2*pi"), answer) != "correct"
    assert told(literal("0.025 kg m^2"), "2.5 x 10-2 kg m^2") != "correct"


def test_units_of_results() -> None:
    for kind in ("number", "quantity"):
        assert told(computed(188.4955592, "rad/s", kind=kind), "188.496") == "correct"
    assert told(computed(188.4955592, "rad/s", unit="required"), "188.496") == "unit_missing"
    for answer in ("0", "0 m", "0.0 cm", "-0 m", "1-1 m", "0e5"):
        assert told(computed(0.0, "m"), answer) == "correct"
    assert told(computed(1e-17, "rad"), "0 rad") == "correct"  # an angle has a scale of its own
    assert told(computed(1e-17, "m"), "0 m") == told(computed(1e-6, "rad"), "0 rad") == "outside_tolerance"


@cases("""
    key | expected | answer
    10 m/s | unit_conversion | 36 m/s  2.7778 m/s
    10 m/s | correct | 36 km/h
    10 m/s | wrong_unit_right_number | 10 km/h
    90 s | unit_conversion | 5400 s  1.5 s  0.025 s
    90 s | correct | 1.5 min
    90 s | frequency_vs_angular_frequency | 14.324 s
    5 m | unit_conversion | 12.7 m  1.524 m
    5 m | power_of_ten | 500 m  0.05 m
    5 m | correct | 500 cm
    5 cm | wrong_unit_right_number | 5 m
    5 cm | correct | 0.05 m  5
    5 cm | power_of_ten | 0.05 cm  0.05
    2 m^2 | unit_conversion | 12.9032 m^2
    7 kg | unit_conversion | 15.4324 kg
    7 kg | wrong_unit_right_number | 7 lb
    1800 rpm | correct | 188.496 rad/s
    1800 rpm | wrong_unit_right_number | 1800 rad/s
    1800 rpm | frequency_vs_angular_frequency | 30 Hz
    30 deg | degrees_radians | 0.523599  1718.873 rad  pi/6
    30 deg | correct | 30  pi/6 rad  30°
    30 deg | wrong_unit_right_number | 30 rad
    30 deg/s | degrees_radians | 1718.873 rad/s
    0.523599 rad | degrees_radians | 0.00913852 deg  30  30 rad  0.0091385 rad
    0.523599 rad | correct | 30 deg
    3.3 Hz | correct | 3.3 1/s  3.3 rev/s  198 rpm
    3.3 Hz | wrong_unit_right_number | 3.3 rad/s
    3.3 Hz | frequency_vs_angular_frequency | 20.7345 rad/s  20.7345 Hz
    0.25 | correct | 25 %  25%  1/4  0.25 rad
    0.25 | power_of_ten | 25
    0.25 | unit_incompatible | 0.25 m
    0.25 | unit_conversion | 0.9
    25 % | correct | 25
    25 % | power_of_ten | 1/4
    2 N m | correct | 2 J  2 Nm
    2 N m | unit_incompatible | 2 N
    2 N m | unit_conversion | 19.6133 N m
    """)
def test_other_units_and_mistakes(key: str, answer: str, expected: str) -> None:
    assert told(literal(key), answer) == expected


def test_numbers_without_a_unit_are_in_that_of_the_report() -> None:
    path = ("precess", "tide", "rate_arcsec_per_year")
    key = computed(-50.3, "arcsec/yr", path, unit="optional", tolerance={"absolute": 0.1})
    assert told(key, "-50.25") == told(key, "-50.35 arcsec/yr") == "correct"
    assert told(key, "-50.5") == "outside_tolerance"
    assert told(key, "50.3") == "precession_sense"


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        (("precess", "top", "slow_rate"), "precession_sense"),
        (("precess", "free", "body_rate"), "precession_sense"),
        (("precess", "top", "phi_dot_at_theta_min"), "precession_sense"),
        (("precess", "top", "sleeping_growth_rate"), "sign_error"),
        (("precess", "top", "spin"), "sign_error"),
        (("hamilton", "rate"), "sign_error"),
        ((), "sign_error"),
    ],
)
def test_the_sense_of_a_precession(path: tuple[str, ...], expected: str) -> None:
    assert told(computed(-2.5, "rad/s", path), "2.5 rad/s") == expected


RING = [[1, math.cos(2 * math.pi * k / 7), math.sin(2 * math.pi * k / 7), 0] for k in range(7)]
"""Seven equal masses on a ring: by symmetry, its products of inertia are zero."""


def of_document(text: str, ask: str, si: str, **options: Any) -> Key:
    key: Key = Asking("quantity").computed(text, ask, si, **options)
    return key


@pytest.mark.parametrize(
    ("text", "ask", "si"),
    [
        (f"body: {{points: {RING}}}", "inertia.tensor.0.1", "kg m^2"),
        (f"body: {{points: {RING}}}", "inertia.center_of_mass.0", "m"),
        (f"body: {{points: {RING}}}\nframe: {{axis: [0, 0, 1], angle: 0.3}}", "inertia.tensor.1.0", "kg m^2"),
        ("body: {points: [[3, 0.1, 0.2, 0.3], [3, -0.1, -0.2, -0.3]]}", "inertia.center_of_mass.2", "m"),
    ],
)
def test_a_key_that_is_rounding_noise_is_zero(text: str, ask: str, si: str) -> None:
    key = of_document(text, ask, si)
    for answer in ("0", f"0 {si}", "0.0", "-0", "1e-17", f"{key.reference!r} {si}", "cos(pi/2)"):
        assert told(key, answer) == "correct"
    for answer in ("1e-3", "-0.1", "1", f"1e-6 {si}"):
        assert told(key, answer) not in ("correct", "power_of_ten", "sign_error", "constant_factor")
    require_examples("number", key)


def test_a_small_entry_that_is_no_noise_is_not_zero() -> None:
    text = "body: {points: [[1, 1, 0, 0], [1, -1, 0, 0], [1e-9, 1, 1, 0]]}"
    assert told(of_document(text, "inertia.tensor.0.1", "kg m^2"), "0") == "outside_tolerance"
    text = "body: {inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 1e-15]], mass: 1}"
    assert told(of_document(text, "axes.moments.0", "kg m^2"), "0") in ("correct", "outside_tolerance")


def test_products_of_inertia_with_a_plus_sign() -> None:
    text = "body: {shape: cube, side: 1, mass: 12, anchor: corner}"
    minus, plus = (of_document(text, "inertia.tensor.0.1", "", products=sign) for sign in ("minus", "plus"))
    assert (told(minus, "-3"), told(plus, "3")) == ("correct", "correct")
    assert (told(minus, "3"), told(plus, "-3")) == ("sign_error", "sign_error")
    assert told(of_document(text, "inertia.tensor.1.1", "", products="plus"), "8") == "correct"


# --- modulo


@many
@given(
    st.floats(-10, 10),
    st.integers(-1000, 1000),
    st.floats(-0.49, 0.49),
    st.sampled_from([("2*pi", 2 * math.pi), ("360 deg", 2 * math.pi), ("pi", math.pi), ("1.5 rad", 1.5)]),
    st.booleans(),
)
def test_equal_modulo_a_period(
    angle: float, turns: int, off: float, modulo: tuple[str, float], degrees: bool
) -> None:
    text, period = modulo
    key = literal(f"{angle:.16e} rad", modulo=text, tolerance={"absolute": 1e-4})

    def typed(value: float) -> str:
        return f"{math.degrees(value):.15e} deg" if degrees else f"{value:.15e}"

    assert told(key, typed(angle + turns * period)) == "correct"
    if abs(off) > 1e-3:
        assert told(key, typed(angle + (turns + off) * period)) != "correct"


@pytest.mark.parametrize("modulo", ["0", "-1 rad", "360 kg", "x", "1/0"])
def test_a_period_is_an_amount_of_what_is_asked(modulo: str) -> None:
    with pytest.raises(ValueProblem) as caught:
        literal("30 deg", modulo=modulo)
    assert caught.value.path == ("modulo",)


# --- keys


@answers(
    """
    answer | options
    20.8791 rad/s | {kind: number}
    20.8791 | {kind: quantity}
    20.8791 warp | {}
    20,8791 | {}
    20.8791e999 | {}
    20.8791*x | {}
    1e-300 um^12 | {}
    """,
    ("20.8791", figures(3) | {"tolerance": {"figures": "written"}}),
)
def test_a_bad_key_is_refused_without_its_value(answer: str, options: dict[str, Any]) -> None:
    with pytest.raises(ValueProblem) as caught:
        literal(answer, **options)
    text = f"{caught.value.message} {caught.value.hint}"
    assert "8791" not in text
    assert "1e-300" not in text


@pytest.mark.parametrize(
    "value", [None, True, "stable", [1.0, 2.0], np.array([1.0]), np.bool_(True), math.nan, -math.inf, {}, 1j]
)
def test_what_is_no_number_makes_no_key(value: object) -> None:
    with pytest.raises(ValueProblem):
        computed(value, "rad/s")


def test_numbers_of_any_type_make_keys() -> None:
    for value in (3, 3.0, np.float64(3), np.int64(3), np.array(3.0)[()]):
        assert told(computed(value, "kg"), "3 kg") == "correct"


def test_a_key_from_a_document() -> None:
    # The wheel of OpenStax, University Physics 1, example 11.5: it precesses at r g/(h^2 omega).
    document = load("configs/openstax_gyroscope.yaml")
    report = precess.run(document)
    value = report["top"]["gyroscopic_rate"]
    question = Question.model_validate({"document": "x", "ask": "precess.top.gyroscopic_rate"})
    path = ("precess", "top", "gyroscopic_rate")
    key = NUMBER.read_key(Asked(question, value, "rad/s", path, document, report))
    assert told(key, f"{value:.5g} rad/s") == "correct"
    assert told(key, f"{value * 30 / math.pi:.5g} rpm") == "correct"
    assert told(key, f"{-value:.5g} rad/s") == "precession_sense"


def test_a_key_passes_through_a_pipe() -> None:
    key = literal("20.8 rad/s", modulo="3 rad/s")
    assert pickle.loads(pickle.dumps(key)).told == key.told


# --- what a student is told


@some
@given(decimals(), decimals(), decimals(), st.sampled_from(["", " m", " cm", " kg", "foo"]))
def test_nothing_told_hangs_on_the_reference(one: Decimal, two: Decimal, answer: Decimal, unit: str) -> None:
    outcomes = [judged(literal(f"{value:e} m"), f"{answer:f}{unit}") for value in (one, two)]
    messages = [{finding.code: sentence(finding) for finding in outcome.findings} for outcome in outcomes]
    for code in messages[0].keys() & messages[1].keys():
        assert messages[0][code] == messages[1][code]


def test_only_those_who_may_read_it_are_told_the_reference() -> None:
    (finding,) = judged(literal("20.8791 rad/s"), "3 rad/s").findings
    assert sentence(finding, full=True) == f"{CODES['outside_tolerance']}; expected 20.8791 rad/s"
    assert sentence(finding) == CODES["outside_tolerance"]


# --- examples


KEYS = [
    ("20.8 rad/s", figures(3)),
    ("20.8 rad/s", figures(3, "strict")),
    ("9.9951 m", figures(3, "written")),
    ("2500 J", figures(2, "at_least")),
    ("1/2", {}),
    ("sqrt(2)/3 kg m^2", {"unit": "optional"}),
    ("0", {}),
    ("0 m", {}),
    ("12 %", {}),
    ("3.3 Hz", {}),
    ("-7e-12 s", {"tolerance": {"relative": 0.2}}),
    ("30 deg", {"modulo": "360 deg"}),
    ("0.4 rad", {"modulo": "pi", **figures(3, "strict")}),
    ("20 m", {"tolerance": {"absolute": 0.5}}),
    ("6.6e37 kg m^2", {}),
    ("1e-160 kg", {}),
    ("6e300 deg", {}),
    ("3 lb ft^2", {}),
]


@pytest.mark.parametrize(("answer", "options"), KEYS)
def test_examples_are_judged_as_they_were_made(answer: str, options: dict[str, Any]) -> None:
    key = literal(answer, **options)
    codes = require_examples("number", key)
    assert None in codes
    assert "unit_incompatible" in codes
    if float(re.split("[ /]", answer)[0].replace("sqrt(2)", "1")):
        assert {"sign_error", "power_of_ten"} <= codes
    assert ("unit_missing" in codes) == (key.required and key.reference != 0)


@settings(max_examples=10, deadline=None)
@given(decimals(), st.sampled_from(sorted(SCALES)), st.sampled_from([{}, figures(2), figures(4, "written")]))
def test_examples_of_any_key(value: Decimal, unit: str, options: dict[str, Any]) -> None:
    key = literal(f"{value:e} {unit}".strip(), **options)
    require_examples("number", key)


# --- tolerances


@pytest.mark.parametrize("reference", [1e-320, 1e-160, -3.0, 1e37, 1.7976931348623157e308])
def test_margins_of_any_size(reference: float) -> None:
    for tolerance in (Tolerance(), Tolerance(significant_figures=3), Tolerance(relative=0.0)):
        assert 0 <= numbers.margin(reference, tolerance) < abs(reference)


def test_entries_that_are_zero_are_judged_by_the_largest() -> None:
    reference = np.array([[1.0, 1e-15], [0.0, -2.0]])
    gaps = np.abs(np.array([[1.0, 0.0], [1e-3, -2.1]]) - reference)
    near = gaps <= numbers.margins(reference[np.newaxis], Tolerance())[0]
    assert near.tolist() == [[True, True], [True, False]]
