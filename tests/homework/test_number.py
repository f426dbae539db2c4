"""Numbers and quantities: right in every spelling and unit, wrong when they are off, with the slip named."""

from __future__ import annotations

import math
import time
from decimal import ROUND_HALF_DOWN, ROUND_HALF_UP, Decimal
from pathlib import Path
from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rigidcli.errors import DocumentError
from rigidcli.fields.units import parse_unit
from rigidcli.homework.base import Unreadable
from rigidcli.homework.judge import Item, outcome
from rigidcli.homework.numbers import read_units, readings_of
from tests.homework.asking import Asking, cases, details, judged

many = settings(max_examples=100)

QUANTITY = Asking("quantity")


def literal(answer: str, **options: Any) -> Item:
    """A question for a number, or for a quantity where the answer has a unit."""
    return Asking("quantity" if readings_of(answer)[0].unit else "number").literal(answer, **options)


def told(key: Item, answer: Any) -> str:
    """`correct`, or the code of what is wrong."""
    return QUANTITY.told(key, answer).removeprefix("incorrect ").removeprefix("invalid ")


# --- reading


@pytest.mark.parametrize(
    ("text", "value", "figures", "unit"),
    [
        ("20.8", 20.8, 3, None),
        (" +20.8 ", 20.8, 3, None),
        ("- 5", -5.0, 1, None),
        ("-- 5", 5.0, 0, None),
        ("20 + -5", 15.0, 0, None),
        ("20.8 /s", 20.8, 3, "1/s"),
        ("20.8/s^2", 20.8, 3, "1/s^2"),
        ("104/5 / min", 20.8, 0, "1/ min"),
        ("8/π", 8 / math.pi, 0, None),
        ("6/sqrt(4)", 3.0, 0, None),
        ("−5.0e−3", -0.005, 2, None),
        (".5", 0.5, 1, None),
        ("5.", 5.0, 1, None),
        ("2.08*10^1", 20.8, 3, None),
        ("2.08 × 10^(-3)", 0.00208, 3, None),
        ("2.08x10**+3 kg", 2080.0, 3, "kg"),
        ("1e5 m", 1e5, 1, "m"),
        ("1e5m", 1e5, 1, "m"),
        ("5cm", 5.0, 1, "cm"),
        ("30°", 30.0, 2, "deg"),
        ("12%", 12.0, 2, "%"),
        ("5 1/s", 5.0, 1, "1/s"),
        ("0e9999", 0.0, 1, None),
        ("1/2", 0.5, 0, None),
        ("1e-3*2", 0.002, 0, None),
        ("2e5 / 4", 50_000.0, 0, None),
        ("sqrt(2)/3", math.sqrt(2) / 3, 0, None),
        ("2*π", 2 * math.pi, 0, None),
        ("2π rad/s", 2 * math.pi, 0, "rad/s"),
        ("sqrt(2) / 3 kg m^2", math.sqrt(2) / 3, 0, "kg m^2"),
        ("1/2 1/s", 0.5, 0, "1/s"),
        # decimal commas, LaTeX, names, and signs that say `about`
        ("20,8", 20.8, 3, None),
        ("20,8 rad/s", 20.8, 3, "rad/s"),
        ("2,5e-3 m", 0.0025, 2, "m"),
        ("1,125e-3", 0.001125, 4, None),
        ("omega = 20.8 rad/s", 20.8, 3, "rad/s"),
        ("ω₃ = 20.8 rad/s", 20.8, 3, "rad/s"),
        (r"\omega_3 \approx 20{,}8\,\mathrm{rad/s}", 20.8, 3, "rad/s"),
        (r"$2.08\times 10^{1}~\text{rad}\,\text{s}^{-1}$", 20.8, 3, "rad s^-1"),
        (r"\frac{\pi}{3}\ \mathrm{rad}", math.pi / 3, 0, "rad"),
        (r"30^\circ", 30.0, 2, "deg"),
        ("~20.8", 20.8, 3, None),
        ("≈ 20.8 rad/s", 20.8, 3, "rad/s"),
        ("0.02080", 0.0208, 4, None),
        ("2.00e2", 200.0, 3, None),
        ("1,234,567", 1_234_567.0, 7, None),
        ("1,234.5", 1234.5, 5, None),
        ("1.234,5 kg", 1234.5, 5, "kg"),
        ("125 000 N/m", 125_000.0, 6, "N/m"),
        ("1'000", 1000.0, 4, None),
        ("**3.12**", 3.12, 3, None),
        ("“3.12”", 3.12, 3, None),
        ("about 3.12", 3.12, 3, None),
        ("ca. 3,12", 3.12, 3, None),
        ("3.12 (3 s.f.)", 3.12, 3, None),
        ("the answer is 3.12 m.", 3.12, 3, "m"),
        ("3.12 ± 0.02", 3.12, 3, None),
        ("(20.8 +- 0.1) kg m^2", 20.8, 3, "kg m^2"),
        ("20.8 kg m^2 ± 1 %", 20.8, 3, "kg m^2"),
        ("23° 26' 24\"", 23.44, 4, "deg"),
        (r"\SI{20.8}{rad/s}", 20.8, 3, "rad/s"),
        ("20.8 rad/s.", 20.8, 3, "rad/s"),
    ],
)
def test_a_number_is_read_as_typed(text: str, value: float, figures: int, unit: str | None) -> None:
    number = readings_of(text)[0]
    assert number.typed == pytest.approx(value, rel=1e-15)
    assert (number.figures, number.unit and number.unit.text) == (figures, unit)


@cases(
    """
    code | hint | text
    not_a_number | `twenty` has no value | twenty
    not_a_number | give | 1_000  1 00 m
    not_a_number | `true` has no value | true
    not_a_number | range | 1e400  1e999999999
    not_a_number | too small | 1e-400
    not_a_number | division by zero | 1/0
    not_a_number | too large | 10**10**10
    not_a_number | real value | sqrt(-1)
    not_a_number | `inf` has no value | inf  inf kg m^2  -∞
    not_a_number | give the number and its unit | -.nan
    unit_incompatible | `cubits` is no unit | 20 cubits
    unit_incompatible | `kgmsx` is no unit | 20 kgmsx
    unit_incompatible | `x10` is no unit | 0x10
    unit_incompatible | give the number and its unit | 20 kg m^99  20 kg + 1  20 kg/
    not_a_number | give the number and its unit | roughly speaking 20 kg  3;4
    """,
    ("too_large", "nested", "(" * 200),
    ("too_large", "401 characters", "1" * 401),
    ("wrong_shape", "one number", ["20.8"]),
    ("wrong_shape", "one number", {"value": "20.8", "unit": "rad/s"}),
)
def test_what_is_no_number_is_invalid_with_the_reason(text: Any, code: str, hint: str) -> None:
    found = judged(literal("3 kg m^2"), text)
    assert found.verdict == "invalid"
    assert [finding.code for finding in found.findings] == [code]
    assert hint in details(found)


@settings(max_examples=200)
@given(
    st.one_of(st.text(max_size=60), st.text("0123456789.,eE+-*/^()_ xπ×·°%mskgradpiN⁻²³\\{}", max_size=450))
)
def test_any_text_is_judged_or_refused(text: str) -> None:
    begin = time.process_time()
    verdict = judged(literal("20.8 rad/s"), text).verdict
    assert time.process_time() - begin < 2
    assert verdict in ("correct", "incorrect", "invalid", "review", "missing")


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
    one, other = readings_of(f"1 {text}")[0].unit, parse_unit(same)
    assert one is not None
    assert (one.factor, one.pi_power, one.dimension) == (other.factor, other.pi_power, other.dimension)


@pytest.mark.parametrize(
    "text", ["mM", "mil", "gss", "parsnip", "м", "_pint", "__class__", "x10", "degC", "°C"]
)
def test_other_units_are_unknown(text: str) -> None:
    with pytest.raises(Unreadable) as caught:
        read_units(text)
    assert caught.value.findings[0].code == "unit_incompatible"


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


@st.composite
def decimals(draw: st.DrawFn) -> Decimal:
    """Numbers of four or five figures, of any size and sign."""
    power = draw(st.one_of(st.integers(-8, 8), st.sampled_from([-47, 24, 37])))
    return Decimal(draw(st.integers(1000, 99_999)) * draw(st.sampled_from([1, -1]))).scaleb(power - 4)


def spelled(draw: st.DrawFn, value: Decimal) -> str:
    """A decimal number in one of the ways in which people write it, or as an expression."""
    mantissa, _, power = f"{value:e}".partition("e")
    forms = [f"{value:e}", f"{mantissa}*10^{int(power)}", f"{mantissa} × 10**({int(power)})"]
    forms += [f"{mantissa.replace('.', ',')}e{int(power)}", rf"{mantissa}\cdot 10^{{{int(power)}}}"]
    forms += [f"({value:e})/2 + ({value:e})*0.5", f"-(-({value:e}))", f"7*({value:e})/sqrt(49)"]
    if abs(value.adjusted()) < 12:
        forms += [f"{value:f}", f"+{value:f}" if value > 0 else f"- {-value:f}"]
    text = draw(st.sampled_from(forms))
    return text.replace("-", "−") if draw(st.booleans()) else text


@many
@given(st.data(), decimals(), st.sampled_from(sorted(SCALES)))
def test_right_in_any_spelling_and_unit(data: st.DataObject, value: Decimal, unit: str) -> None:
    key = literal(f"{value:e} {unit}".strip(), tolerance={"relative": 1e-9})
    other = data.draw(st.sampled_from(["", *SCALES[unit]])) or unit
    scale = SCALES[unit].get(other, 1.0)
    typed = Decimal(f"{float(value) / scale:.17g}") if scale != 1.0 else value
    answer = f"{data.draw(st.composite(spelled)(typed))} {other}".strip()
    assert told(key, answer) == "correct", answer


@many
@given(
    st.data(),
    decimals(),
    st.sampled_from(sorted(SCALES)),
    st.sampled_from([None, 1e-1, 1e-3, 1e-6]),
    st.floats(-2, 2),
    st.sampled_from([1, -1]),
)
def test_a_relative_tolerance_is_a_limit(
    data: st.DataObject, value: Decimal, unit: str, relative: float | None, size: float, sign: int
) -> None:
    key = literal(f"{value:e} {unit}".strip(), tolerance={"relative": relative})
    assume(abs(size) > 1e-4)
    off = sign * (relative or 0.01) * 10**size
    other, scale = data.draw(st.sampled_from([(unit, 1.0), *SCALES[unit].items()]))
    answer = f"{float(value) * (1 + off) / scale:.16e} {other}".strip()
    assert (told(key, answer) == "correct") == (size < 0), answer


@many
@given(
    decimals(),
    st.floats(0.01, 3),
    st.sampled_from([1, -1]),
    st.sampled_from([("m", 1.0), ("cm", 0.01), ("ft", 0.3048)]),
)
def test_an_absolute_tolerance_is_in_si_units(
    value: Decimal, ratio: float, sign: int, unit: tuple[str, float]
) -> None:
    assume(abs(ratio - 1) > 1e-3)
    absolute = abs(float(value)) / 7
    key = literal(f"{value:e} m", tolerance={"absolute": absolute})
    name, scale = unit
    answer = f"{(float(value) + sign * ratio * absolute) / scale:.16e} {name}"
    assert (told(key, answer) == "correct") == (ratio < 1)


def rounded(value: Decimal, n: int, how: str) -> Decimal:
    """To n significant figures, by the arithmetic of decimals; 9.996 becomes 10.00, and that 10.0."""
    once = value.quantize(Decimal(1).scaleb(value.adjusted() + 1 - n), how)
    return once.quantize(Decimal(1).scaleb(once.adjusted() + 1 - n), how)


@many
@given(
    st.sampled_from(["m", "cm", "ft"]),
    decimals(),
    st.integers(1, 4),
    st.sampled_from([ROUND_HALF_UP, ROUND_HALF_DOWN]),
)
def test_rounded_to_the_figures_asked_for(unit: str, value: Decimal, n: int, how: str) -> None:
    """Half a unit of the last figure is allowed, in the unit that is typed."""
    number = Decimal(f"{float(value) / SCALES['m'].get(unit, 1.0):.12g}")
    right, step = rounded(number, n, how), Decimal(1).scaleb(number.adjusted() + 1 - n)
    key = literal(f"{value:e} m", tolerance={"significant_figures": n})
    assert told(key, f"{right:e} {unit}") == "correct"
    for wrong in (right + step, right - step):
        if abs(wrong - number) > step * Decimal("0.501"):
            assert told(key, f"{wrong:e} {unit}") != "correct"


def test_a_key_has_the_kind_of_its_unit() -> None:
    for kind, answer, words in [
        ("quantity", "20.8", "has a unit"),
        ("number", "20.8 m", "no unit"),
        ("quantity", "1e400 m", "cannot be read as a number"),
    ]:
        with pytest.raises(DocumentError, match=words):
            Asking(kind).literal(answer)


@cases("""
    read_as | answer
    20.8 rad/s | 20,8  omega = 20.8 rad/s  ~20.8
    0.002455 rad/s | 0.002455
    0.001125 rad/s | 1,125e-3
    """)
def test_a_student_sees_how_a_number_was_read(answer: str, read_as: str) -> None:
    assert outcome(literal("20.8 rad/s"), answer, Path("answers.yaml"))[1] == read_as
