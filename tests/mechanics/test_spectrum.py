"""Stability, frequencies and eigenvalues of linear systems, against closed forms and numpy."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import rigidcli
from rigidcli.mechanics.numeric_spectrum import numeric_spectrum
from rigidcli.report import Report

SYMMETRIC = "((p_x + q*B*y/2)**2 + (p_y - q*B*x/2)**2)/(2*m)"
LANDAU = "(p_x**2 + (p_y - q*B*x)**2)/(2*m)"
FREE = "(p_x**2 + p_y**2)/2"
ROTATING = f"{FREE} - w*(x*p_y - y*p_x)"
TROJAN = f"{FREE} + p_x*y - p_y*x + x**2/8 - 5*y**2/8 - 3*sqrt(3)/4*(1 - 2*mu)*x*y"
"""About L4 of the plane three-body problem: stable below mu = (1 - sqrt(23/27))/2 = 0.0385."""


def linear(hamiltonian: str, parameters: str = "") -> Report:
    momenta = sorted(set(re.findall(r"p_(\w+)", hamiltonian)))
    return rigidcli.hamilton(
        rigidcli.loads(
            f"parameters: {{{parameters}}}\n"
            f"system: {{coordinates: [{', '.join(momenta)}], hamiltonian: '{hamiltonian}'}}\n",
        )
    )


def chain(size: int, spring: str, walls: str = "0") -> str:
    kinetic = " + ".join(f"p_x{i}**2/2" for i in range(size))
    springs = " + ".join(f"{spring}*(x{i} - x{i + 1})**2/2" for i in range(size - 1))
    return f"{kinetic} + {springs} + {walls}*(x0**2 + x{size - 1}**2)/2"


CASES = {
    # A (A^2 + w^2) = 0: the centre of the circle rests.
    "field, symmetric gauge": (SYMMETRIC, "q: 1, B: 0.3, m: 0.1", "stable", [3.0]),
    "field, Landau's gauge": (LANDAU, "q: 1, B: 0.3, m: 0.1", "stable", [3.0]),
    "field of pi": (SYMMETRIC, "q: 1, B: pi, m: 2", "stable", [math.pi / 2]),
    "field in space": (f"{LANDAU} + p_z**2/2", "q: 1, B: 0.3, m: 0.1", "marginal", [3.0]),
    "field and saddle": (f"{LANDAU} - k*x**2/2", "q: 1, B: 1, m: 1, k: 4", "unstable", []),
    "stiff and slow": (f"{FREE} + 1e16*(x - y)**2/2 + (x + y)**2/2", "", "stable", [2**0.5, 2e16**0.5]),
    "stiff and free": (f"{FREE} + 1e16*(x - y)**2/2", "", "marginal", [2e16**0.5]),
    "stiff and growing": (f"{FREE} + 1e16*(x - y)**2/2 - (x + y)**2/2", "", "unstable", [2e16**0.5]),
    "stiff, apart": (f"{FREE} + 1e16*x**2/2 + 1e-16*y**2/2", "", "stable", [1e-8, 1e8]),
    "isotropic": (f"{FREE} + 0.3*(x**2 + y**2)/2", "", "stable", [0.3**0.5]),
    "isotropic, turned": (
        f"{FREE} + 0.3*(0.6*x + 0.8*y)**2/2 + 0.3*(0.8*x - 0.6*y)**2/2",
        "",
        "stable",
        [0.3**0.5],
    ),
    "ring of three": (
        "(p_x**2 + p_y**2 + p_z**2)/2 + 0.1*((x - y)**2 + (y - z)**2 + (z - x)**2)/2",
        "",
        "marginal",
        [0.3**0.5],
    ),
    "rotating, slow": (f"{ROTATING} + (x**2 + y**2)/2", "w: 1/2", "stable", [0.5, 1.5]),
    "rotating, resonant": (f"{ROTATING} + (x**2 + y**2)/2", "w: 1", "stable", [2.0]),
    "rotating, fast": (f"{ROTATING} + (x**2 + y**2)/2", "w: 3", "stable", [2.0, 4.0]),
    "rotating, free": (ROTATING, "w: 1", "marginal", [1.0]),
    "opposite signs": (f"{FREE} - p_y**2 + x**2/2 - y**2/2", "", "stable", [1.0]),
    "opposite signs, coupled": (f"{FREE} - p_y**2 + x**2/2 - y**2/2 + x*y/10", "", "unstable", []),
    "Trojans of Jupiter": (TROJAN, "mu: 0.00095", "stable", None),
    "Trojans of Pluto": (TROJAN, "mu: 0.11", "unstable", None),
    "free chain": (
        chain(12, "0.3"),
        "",
        "marginal",
        [2 * 0.3**0.5 * math.sin(j * math.pi / 24) for j in range(1, 12)],
    ),
    "crossed fields": ("(p_x + 0.7*y)**2/2 + (p_y - 0.7*x)**2/2 + 3*y", "", "marginal", [1.4]),
    "nilpotent": ("p_x*y + 0*p_y", "", "marginal", []),
    "rest": ("0*p_x", "", "stable", []),
}


@pytest.mark.parametrize("name", CASES)
def test_stability_of_numbers(name: str) -> None:
    hamiltonian, parameters, stability, frequencies = CASES[name]
    found = linear(hamiltonian, parameters)
    assert found["stability"] == stability
    if frequencies is not None:
        assert list(found["frequencies"]) == pytest.approx(frequencies, rel=1e-13)
    assert len(found["eigenvalues"]) == 2 * len(found["coordinates"])

    if not parameters:
        matrix = np.array([[float(e) for e in row] for row in found["matrix"]])
        traces = [np.trace(np.linalg.matrix_power(matrix, k)) for k in (2, 4)]
        sums = [sum(complex(pair["re"], pair["im"]) ** k for pair in found["eigenvalues"]) for k in (2, 4)]
        assert sums == pytest.approx(traces, rel=1e-12, abs=1e-12)


SYMBOLS = {
    "spring": ("p_x**2/(2*m) + k*x**2/2", "m: null, k: null", "stable", ["sqrt(k/m)"]),
    "spring, pushed": ("p_x**2/(2*m) + k*x**2/2", "m: null, k: -4", "unstable", []),
    "rod": ("p_x**2/(2*m) - m*w**2*x**2/2", "m: null, w: null", "unstable", []),
    "field, symmetric gauge": (SYMMETRIC, "q: null, B: null, m: null", "stable", ["B*q/m"]),
    "field, Landau's gauge": (LANDAU, "q: null, B: null, m: null", "stable", ["B*q/m"]),
    "field in space": (f"{LANDAU} + p_z**2/2", "q: null, B: null, m: null", "marginal", ["B*q/m"]),
    "coupled": (
        f"{FREE} + k*(x**2 + y**2)/2 + c*(x - y)**2/2",
        "k: null, c: null",
        "stable",
        ["sqrt(k)", "sqrt(2*c + k)"],
    ),
    "ring of three": (
        "(p_x**2 + p_y**2 + p_z**2)/(2*m) + k*((x - y)**2 + (y - z)**2 + (z - x)**2)/2",
        "m: null, k: null",
        "marginal",
        ["sqrt(3*k/m)"],
    ),
    "saddle": (f"{FREE} + c*x*y", "c: null", "unstable", ["sqrt(c)"]),
    "opposite signs": (f"{FREE} - p_y**2 + x**2/2 - y**2/2 + c*x*y", "c: null", "unstable", []),
    "in a rotating frame": (f"{ROTATING} + k*(x**2 + y**2)/2", "k: null, w: null", "stable", None),
    "two springs and a wall": (
        "p_x**2/(2*m) + p_y**2/(2*M) + k*x**2/2 + K*(x - y)**2/2",
        "m: null, M: null, k: null, K: null",
        "stable",
        None,
    ),
    "of one sign or the other": (f"{FREE} + (k - g)*x**2 + y**2", "k: null, g: null", None, None),
    "nearly of one sign": (f"{FREE} + (k - g/100)*x**2 + y**2", "k: null, g: null", None, None),
    # A field E across B makes the charge drift at E/B; a weight only shifts a spring.
    "crossed fields": (f"{SYMMETRIC} + E*y", "q: null, B: null, m: null, E: null", "marginal", ["B*q/m"]),
    "spring with a weight": ("p_x**2/(2*m) + k*x**2/2 + m*g*x", "m: null, k: null, g: null", "stable", None),
    "Penning's trap": (f"{LANDAU} - k*(x**2 + y**2)/4", "q: null, B: null, m: null, k: null", None, None),
}


@pytest.mark.parametrize("name", SYMBOLS)
def test_stability_of_symbols(name: str) -> None:
    hamiltonian, parameters, stability, frequencies = SYMBOLS[name]
    found = linear(hamiltonian, parameters)
    assert found["stability"] == stability
    if frequencies is not None:
        assert [str(e) for e in found["frequencies"]] == frequencies
    if stability is not None:
        point = {key: 0.7 + 0.1 * i for i, key in enumerate(re.findall(r"(\w+):", parameters))}
        point |= {key: float(text) for key, text in re.findall(r"(\w+): (-?\d+)", parameters)}
        matrix = np.array([[e.evaluate(**point) for e in row] for row in found["matrix"]], dtype=float)
        expected = np.sort_complex(np.round(np.linalg.eigvals(matrix) ** 2, 6))
        values = [
            complex(*(pair[key].evaluate(**point) for key in ("re", "im"))) ** 2
            for pair in found["eigenvalues"]
        ]
        assert np.sort_complex(np.round(values, 6)) == pytest.approx(expected, abs=3e-6)


@pytest.mark.parametrize(
    ("matrix", "stability"),
    [
        ([[0, 1], [0, 0]], "marginal"),
        ([[0, 0], [0, 0]], "stable"),
        ([[0, 1], [4, 0]], "unstable"),
        ([[0, 1e-30], [-4e30, 0]], "stable"),
        ([[-1, 0], [0, -2]], "stable"),
        ([[0, 1], [-1, -0.1]], "stable"),
        ([[0, 1], [-1, 0.1]], "unstable"),
        ([[0, 1], [0, -1]], "stable"),
    ],
)
def test_matrices_of_any_kind(matrix: list[list[float]], stability: str) -> None:
    found = numeric_spectrum(matrix)
    assert found.stability == stability
    expected = np.sort_complex(np.linalg.eigvals(np.array(matrix, dtype=float)))
    assert [complex(*map(float, pair)) for pair in found.eigenvalues] == pytest.approx(
        list(expected), rel=1e-9
    )
