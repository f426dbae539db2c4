"""Stability, frequencies and eigenvalues of linear systems, against closed forms and numpy."""

from __future__ import annotations

import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import yaml

import rigidcli
from rigidcli.algebra.expressions import number
from rigidcli.language.expression import real
from rigidcli.language.parser import read
from rigidcli.mechanics.small_oscillations import LinearMotion, spectrum
from rigidcli.report import Report
from rigidcli.studies.hamilton.linear_equations import eigenvalues, stability_of
from tests.tables import rows_of

SPECTRA = yaml.safe_load(Path(__file__).with_name("spectra.yaml").read_text(encoding="utf-8"))


def linear(hamiltonian: str, parameters: str = "") -> Report:
    momenta = sorted(set(re.findall(r"p_(\w+)", hamiltonian)))
    return rigidcli.hamilton(
        rigidcli.loads(
            f"parameters: {{{parameters}}}\n"
            f"system: {{coordinates: [{', '.join(momenta)}], hamiltonian: '{hamiltonian}'}}\n",
        )
    )


@pytest.mark.parametrize("name", SPECTRA["numbers"])
def test_stability_of_numbers(name: str) -> None:
    hamiltonian, parameters, stability, frequencies = SPECTRA["numbers"][name]
    found = linear(hamiltonian, parameters)
    assert found["stability"] == stability
    if frequencies is not None:
        known = [real(read(str(each))[0], {}) for each in frequencies]
        assert list(found["frequencies"]) == pytest.approx(known, rel=1e-13)
    assert len(found["eigenvalues"]) == 2 * len(found["coordinates"])

    if not parameters:
        matrix = np.array([[float(e) for e in row] for row in found["matrix"]])
        traces = [np.trace(np.linalg.matrix_power(matrix, k)) for k in (2, 4)]
        sums = [sum(complex(pair["re"], pair["im"]) ** k for pair in found["eigenvalues"]) for k in (2, 4)]
        assert sums == pytest.approx(traces, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("name", SPECTRA["symbols"])
def test_stability_of_symbols(name: str) -> None:
    hamiltonian, parameters, stability, frequencies = SPECTRA["symbols"][name]
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
    rows_of(__file__, "matrices of any kind"),
)
def test_matrices_of_any_kind(matrix: list[list[float]], stability: str) -> None:
    exact = np.array([[number(Fraction(e)) for e in row] for row in matrix])
    roots = spectrum(LinearMotion.of_matrix(exact), {}, is_exact=False, is_free=False)
    assert roots is not None
    assert stability_of(roots) == stability
    expected = np.sort_complex(np.linalg.eigvals(np.array(matrix, dtype=float)))
    found = [complex(*pair) for root in roots for pair in eigenvalues(root)]
    assert np.sort_complex(np.array(found)) == pytest.approx(list(expected), rel=1e-9)
