"""The one reader of what people type: formulas, lists and tables, without a question."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.homework.base import Unreadable
from rigidcli.homework.lists import read_list
from rigidcli.homework.reading import Names, describe, read_expression, read_expressions
from rigidcli.language.text import reading
from tests.homework.asking import cases
from tests.tables import rows_of

NAMES = Names(
    {
        **dict.fromkeys(["m", "g", "z", "l", "k", "a", "M", "c", "omega", "lambda1"], "positive"),
        **dict.fromkeys(["x", "theta", "phi", "p_theta", "xdot", "xddot", "thetadot", "phidot", "t"], "real"),
    },
    coordinates=("x", "theta", "phi"),
    velocities=("xdot", "thetadot", "phidot"),
)


@cases(r"""
    formula | typed
    p_theta^2/(2 m) + m g l cos(theta) | \frac{p_\theta^2}{2m} + mgl\cos\theta
    m g z | mgz  m\,g\,z
    M a^2/6 | Ma^2/6  Ma²/6  \frac{Ma^2}{6}
    2 m (1 + c^2) | 2m(1+c^2)  2m[1 + c^2]  2m\left(1+c^{2}\right)
    xdot | dx/dt  \dot x  \dot{x}  ẋ  x'  \frac{dx}{dt}  \frac{\mathrm{d}x}{\mathrm{d}t}  d/dt x
      x_dot  \dot{x}(t)
    xddot | d^2x/dt^2  d²x/dt²  \ddot x  ẍ  x''  \frac{d^2x}{dt^2}  x''(t)
    thetadot | d(theta)/dt  \dot\theta  θ̇  \frac{d\theta}{dt}
    sin(theta)^2 phidot^2 | \sin^2\theta\,\dot\phi^2  sin(theta)^2*phidot^2  sin²θ φ̇²
    sin(theta) cos(theta) | \sin\theta\cos\theta  sinθ cosθ  sin(theta)cos(theta)
    sin(omega t) | \sin\omega t  sin(omega t)  sin ωt
    sin(2 theta) | \sin 2\theta  sin 2θ
    sin(k x) | \sin kx  sin(kx)
    asin(x) | \sin^{-1} x  \arcsin x  arcsin(x)
    a sin(x) | asin(x)  a sin x  asin x
    log(x) | \ln x  ln(x)  log x
    exp(-x) | e^{-x}  exp(-x)  \exp(-x)
    sqrt(k/m) | \sqrt{k/m}  √(k/m)  sqrt(k/m)
    m/sqrt(2) | \frac{m}{\sqrt2}  m/\sqrt{2}
    x^(1/3) | \sqrt[3]{x}
    abs(x) a | |x|a  \lvert x\rvert a
    2.5 x | 2,5 x  2.5x
    lambda1 | λ₁  \lambda_1  lambda_1  lambda1  \lambda_{1}
    p_theta | pθ  p_{\theta}  ptheta  p_θ
    x + theta^2 | x(t) + theta(t)^2
    -3.2 | - 3.2  −3,2  – 3.2
    5*10^(-3) | 5·10⁻³  5\cdot10^{-3}
    m g z | U = V = mgz  U = m z g/1 = mgz  U = mgz  $U = mgz$  U(z) = mgz.  \[ U = mgz \]
    """)
def test_a_formula_is_read_as_people_write_it(typed: str, formula: str) -> None:
    assert reading(read_expressions(typed, NAMES)[0]) == formula


@cases(r"""
    hint | typed
    more than one formula | x ; y
    a bracket is open | ((x)  \frac{x}{m
    a bracket is closed | x)  x}
    has no meaning | \foo  \begin{document}
    the sign that is missing before | 3 4  x 2
    read `mgq` | mgq
    the symbols are | q
    """)
def test_what_is_no_formula_is_refused_with_the_reason(typed: str, hint: str) -> None:
    with pytest.raises(Unreadable) as refused:
        read_expression(typed, NAMES)
    assert hint in refused.value.findings[0].detail


@pytest.mark.parametrize(
    ("typed", "entries"),
    rows_of(__file__, "lists with and without brackets"),
)
def test_lists_with_and_without_brackets(typed: Any, entries: Any) -> None:
    assert read_list(typed) == entries


@cases("""
    read_as | typed
    20.8 rad/s | 20,8 rad/s
    [1.5, 2.5] | 1,5; 2,5
    xdot = p/m; pdot = -k x | xdot = p/m, pdot = -k x
    p^2/(2 m) | \\frac{p^2}{2m}
    """)
def test_an_answer_is_described_without_its_question(typed: str, read_as: str) -> None:
    assert describe(typed) == read_as


@settings(max_examples=200)
@given(st.text("xmgp_dt0123(){}[]\\^'|,;=+-*/ .&$√²θ̇sincoqrtfa", max_size=60))
def test_any_text_is_read_or_refused(text: str) -> None:
    for read in (lambda: read_expression(text, NAMES), lambda: read_list(text), lambda: describe(text)):
        with suppress(Unreadable):
            read()
