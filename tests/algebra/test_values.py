"""What is zero and what is not, whatever rounding says."""

from __future__ import annotations

import pytest

from rigidcli.algebra.values import is_zero
from tests.algebra.test_expressions import FORMS
from tests.trees import expression


@pytest.mark.parametrize("text", FORMS["zero"])
def test_zeros(text: str) -> None:
    assert is_zero(expression(text))


@pytest.mark.parametrize("text", FORMS["not zero"])
def test_what_is_not_zero(text: str) -> None:
    assert not is_zero(expression(text))
