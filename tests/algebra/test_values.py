"""What is zero and what is not, whatever rounding says."""

from __future__ import annotations

import pytest

from rigidcli.algebra.values import is_zero
from tests.trees import expression

R = "sqrt(x**2 + y**2)"


@pytest.mark.parametrize(
    "text",
    [
        # One product with a factor that is zero: its floats are noise of its own size.
        f"a*(x**2/{R} + y**2/{R} - {R})",
        f"(x/{R} - x*{R}/(x**2 + y**2))*sin(y)/b",
        "m*c**2*(1/sqrt(1 - v**2/c**2) - sqrt(1 - v**2/c**2) - v**2/(c**2*sqrt(1 - v**2/c**2)))",
        f"({R} - x)*({R} + x) - y**2",
        "sqrt(x + 1)*sqrt(x - 1)*(sqrt(x**2 - 1)/(sqrt(x + 1)*sqrt(x - 1)) - 1)",
        "exp(x)*(sinh(x) + exp(-x)/2 - exp(x)/2)",
        "sin(10**20*x)**2 + cos(10**20*x)**2 - 1",
        "sin(10**20*x + y) - sin(10**20*x)*cos(y) - cos(10**20*x)*sin(y)",
        "abs(x)*sign(x) - x",
        "sqrt(x**2) - abs(x)",
        "log(x**2*y**2) - log(x**2) - log(y**2)",
        "sqrt(-x)*(sqrt(-x)*sqrt(-y)/sqrt(x*y) - 1)",
        "(x + 10**30)*(x - 10**30) - x**2 + 10**60",
        "sin(x)**2 + cos(x)**2 - 1",
        "sin(2*x) - 2*sin(x)*cos(x)",
        "tan(x) - sin(x)/cos(x)",
        "log(a**2*b**2) - 2*log(abs(a)) - 2*log(abs(b))",
        "exp(x)*exp(-x) - 1",
        "1/(1/a + 1/b) - a*b/(a + b)",
        "sqrt(2 + sqrt(3)) - (sqrt(6) + sqrt(2))/2",
        "sin(1e9*x)**2 + cos(1e9*x)**2 - 1",
        "sin(2e9*x) - 2*sin(1e9*x)*cos(1e9*x)",
        "cosh(2*x) - cosh(x)**2 - sinh(x)**2",
        "asin(x) + acos(x) - pi/2",
        "(x + y)**5 - x**5 - 5*x**4*y - 10*x**3*y**2 - 10*x**2*y**3 - 5*x*y**4 - y**5",
    ],
)
def test_zeros(text: str) -> None:
    assert is_zero(expression(text))


@pytest.mark.parametrize(
    "text",
    [
        "x - y",
        "10**-40",
        "sin(x)**2 + cos(x)**2 - 1 + 10**-60",
        "sign(x)*sign(y) - 1",
        "sign(x)*sign(y)*sign(z) - 1",
        "sqrt(x**2) - x",
        "sqrt(x*y)*sqrt(x/y) - x",
        "atan(x) + atan(1/x) - pi/2",
        "atan2(y, x) - atan(y/x)",
        "exp(x)/exp(y) - 1",
        "sqrt(-1 - x**2)",
        "(x + 10**30)**2 - x**2 - 2*10**30*x - 10**60 + 10**-30",
        "1e-30",
        "1e-30 + sin(x)**2 + cos(x)**2 - 1",
        "x - (1 - 1e-15)*x",
        "abs(x) - x",
        "sin(x) - x",
        "pi - 3.14159265358979323846",
        "log(x - 1000)",
        "sqrt(-1 - x**2) + x",
        "exp(-x**2)",
    ],
)
def test_what_is_not_zero(text: str) -> None:
    assert not is_zero(expression(text))
