"""Units: every entry against pint, the grammar, and what is refused; quantities as they are typed."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import pint
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from rigidcli.errors import ValueProblem
from rigidcli.fields import dimensions, units
from rigidcli.fields.dimensions import (
    Dimension,
)
from rigidcli.fields.environment import Environment
from rigidcli.fields.units import known_names, parse_unit, split_quantity
from tests.conftest import Program
from tests.tables import rows_of

PINT_SPELLING = {"gn": "g_n", "rev": "revolution"}
PINT_LACKS = {  # Nominal solar and terrestrial values, IAU 2015 resolution B3; G of CODATA 2022.
    "lbm": 0.45359237,
    **dict.fromkeys(["R_sun", "solar_radius", "solar_radii"], 6.957e8),
    **dict.fromkeys(["R_earth", "earth_radius", "earth_radii"], 6.3781e6),
    **dict.fromkeys(["M_sun", "solar_mass", "solar_masses"], 1.3271244e20 / 6.67430e-11),
    **dict.fromkeys(["M_earth", "earth_mass", "earth_masses"], 3.986004e14 / 6.67430e-11),
    "GM_sun": 1.3271244e20,
    "GM_earth": 3.986004e14,
}


KNOWN = "units are those of the SI with their prefixes, and others of mechanics, `rigidcli explain units`"


@pytest.fixture(scope="module")
def registry() -> Any:
    return pint.UnitRegistry(non_int_type=Fraction)


@cache
def pi_in(registry: Any) -> Fraction:
    """The number that pint has for pi."""
    value: Fraction = registry.Quantity(Fraction(1), "pi").to_root_units().magnitude
    return value


def agrees(name: str, registry: Any) -> bool:
    """Whether a unit is exactly what pint has under its name.

    But for the dalton, which is measured, and the parsec, which pint has by the tangent of an arcsecond.
    """
    pi = pi_in(registry)
    theirs = registry.Quantity(Fraction(1), PINT_SPELLING.get(name, name)).to_root_units()
    root = parse_unit("1")
    for root_name, power in theirs.unit_items():
        root = root.times(parse_unit(root_name), int(power))
    unit = parse_unit(name)
    ratio = unit.factor * pi**unit.pi_power / (theirs.magnitude * root.factor)
    tolerance = Fraction(1, 10**11) if name.endswith(("pc", "parsec", "parsecs")) else Fraction(0)
    if name.endswith(("Da", "dalton", "daltons")) or name in ("u", "amu"):
        tolerance = Fraction(1, 10**8)
    return abs(ratio - 1) <= tolerance and unit.dimension._replace(cycle=0) == root.dimension


def test_every_name_of_the_table_agrees_with_pint(registry: Any) -> None:
    names = known_names()
    assert len(names) == len(set(names))
    names = [name for name in names if name not in PINT_LACKS and name != "1"]
    assert [name for name in names if not agrees(name, registry)] == []


@pytest.mark.parametrize("name", PINT_LACKS)
def test_what_pint_lacks_is_what_its_definition_says(name: str) -> None:
    assert parse_unit(name).scale == pytest.approx(PINT_LACKS[name], rel=2e-16, abs=0)


def test_explain_lists_every_unit(program: Program) -> None:
    listed = re.findall(r"\w+", program("explain", "units").out)
    assert {names.split()[0] for names, *_ in units.TABLE} <= set(listed)


def test_what_else_pint_has_is_read_as_the_same_or_refused(
    registry: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Names that look like a known unit with a prefix, too: `hbar` is no hectobar."""
    # To find what was meant takes nearly all the time of a refusal.
    monkeypatch.setattr("rigidcli.fields.units._hint_for", lambda name: None)
    read = 0
    for name in dir(registry):
        with suppress(ValueProblem):
            assert agrees(parse_unit(name).text, registry)
            read += 1
    assert read > 100


@pytest.mark.parametrize(
    ("text", "scale", "dimension"),
    rows_of(__file__, "grammar"),
)
def test_the_grammar(text: str, scale: float, dimension: str) -> None:
    unit = parse_unit(text)
    assert unit.text == text.strip()
    assert unit.dimension == (getattr(dimensions, dimension) if dimension else Dimension(time=-1))
    assert unit.scale == pytest.approx(scale, rel=2e-16)


def test_a_quantity_is_rounded_once() -> None:
    assert 1.1 * parse_unit("cm").scale != 0.011
    assert parse_unit("cm").si(Fraction("1.1")) == 0.011
    assert parse_unit("deg").si(Fraction(180)) == 3.141592653589793
    with pytest.raises(ValueProblem, match="a value in `km` is too large"):
        parse_unit("km").si(Fraction(10) ** 306)


@given(
    st.lists(
        st.tuples(st.sampled_from(["m", "kg", "deg", "ft", "N"]), st.integers(-12, 12)),
        min_size=1,
        max_size=8,
    )
)
def test_a_product_multiplies_and_a_quotient_undoes_it(parts: list[tuple[str, int]]) -> None:
    text = " ".join(f"{name}^{power}" for name, power in parts)
    product, alone = parse_unit(text), parse_unit(f"1/({text})")
    expected = parse_unit("1")
    for name, power in parts:
        expected = expected.times(parse_unit(name), power)
    assert replace(product, text="1") == expected
    assert replace(product.times(alone), text="1") == parse_unit("1")


@given(st.text(alphabet="mskgNd °µ²⁻1290^*/()-._ж\n", max_size=30))
def test_any_text_is_read_or_refused(text: str) -> None:
    with suppress(ValueProblem):
        assert parse_unit(text).scale > 0


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    rows_of(__file__, "what is refused"),
)
def test_what_is_refused(text: str, message: str, hint: str | None) -> None:
    with pytest.raises(ValueProblem) as caught:
        parse_unit(text)
    assert (caught.value.message, caught.value.hint) == (message, hint)


@pytest.mark.parametrize(
    ("text", "parts"),
    rows_of(__file__, "split quantity"),
)
def test_split_quantity(text: str, parts: list[object] | None) -> None:
    assert split_quantity(text) == (parts and tuple(parts))


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    yaml.safe_load(Path(__file__).with_name("typed.yaml").read_text(encoding="utf-8")),
)
def test_a_quantity_is_read_as_people_write_it(text: str, dimension: str | None, value: float | None) -> None:
    of = None if dimension is None else getattr(dimensions, dimension)
    if value is None:
        with pytest.raises(ValueProblem):
            Environment().read(text, of)
    else:
        assert Environment().read(text, of) == pytest.approx(value, rel=1e-15)
