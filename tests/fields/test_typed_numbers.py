"""Quantities as they are typed."""

from __future__ import annotations

import pytest

from rigidcli.fields.typed_numbers import split_quantity


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("5 cm", ("5", "cm", False)),
        ("-1.5e3 kg m^2", ("-1.5e3", "kg m^2", False)),
        ("−.5  °/s ", ("-.5", "°/s", False)),
        ("3 1/s", ("3", "1/s", False)),
        ("1e5 Å", ("1e5", "Å", False)),
        ("5 m - 3 m", ("5", "m - 3 m", False)),
        ("5cm", ("5", "cm", True)),
        ("2e3x", ("2e3", "x", True)),
        ("2e", ("2", "e", True)),
        ("6*10^24 kg", ("6e24", "kg", False)),
        ("6 · 10⁻²kg", ("6e-2", "kg", True)),
        ("6*10**−2 kg", ("6e-2", "kg", False)),
        ("6*10 kg", None),
        ("5² m", None),
        ("31/s", None),
        ("7", None),
        ("2*a", None),
        ("2 - 3", None),
        ("1/2", None),
        ("5 (m/s)", None),
        ("", None),
    ],
)
def test_split_quantity(text: str, parts: tuple[str, str, bool] | None) -> None:
    assert split_quantity(text) == parts
