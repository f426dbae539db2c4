"""How a report looks in each format: texts in tests/golden, read by a person before they were kept there.

After a wanted change: RIGIDCLI_GOLDEN=write python -m pytest tests/render, then look at the difference.
"""

from __future__ import annotations

import os
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from rigidcli.algebra.expressions import number, symbol
from rigidcli.render import Format, Look, renderer
from rigidcli.report import Column, Field, Report, Table

GOLDEN = Path(__file__).parents[1] / "golden"

M, a = symbol("M", True), symbol("a", True)
TENSOR = M * a**2 / 12 * np.array([[8, -3, -3], [-3, 8, -3], [-3, -3, 8]], dtype=object)

NUMBERS = Report(
    "rigidcli.example/1",
    "numbers",
    "numbers.yaml",
    "floats of all sizes",
    (
        Field("mass", 12.0, "mass", "M", "kg", {"mass": ()}),
        Field("small", 1.2345678901e-47, "small number", "s", "kg m^2", {"small": ()}),
        Field("unknown", None, "unknown", "u", "kg", {"unknown": ()}),
        Field(
            "vector", np.array([0.1, -2.0, 3e20]), "vector", r"\mathbf{v}", "m", {"v_x": (0,), "v_z": (2,)}
        ),
        Field(
            "noise",
            np.array([[1.0, 1e-17, 0.25], [1e-17, 20.0, 0.0], [0.25, 0.0, 300.0]]),
            "with rounding noise",
            r"\mathbf{A}",
            "kg m^2",
            {"Axy": (0, 1)},
        ),
        Field(
            "class",
            "prolate",
            "class",
            cells={"class": ()},
            words="prolate top: lambda1 < lambda2, e1 & 100 %",
        ),
        Field(
            "moments", np.array([1e-20, 1.0, 1.0]), "moments", r"\lambda", "kg m^2", {"l1": (0,)}, counts=True
        ),
        Field("slender", np.diag([1.0, 1.0, 1e-20]), "slender", r"\mathbf{S}", "kg m^2", {"Szz": (2, 2)}),
        Field("groups", [[0], [1, 2]]),
    ),
)
SYMBOLS = Report(
    "rigidcli.example/1",
    'hostile \x1b[31m "name", [red]',
    "symbols.yaml",
    "exact numbers",
    (
        Field("mass", M, "mass", "M", "kg", {"mass": ()}),
        Field("third", number(Fraction(1, 3)), "a third", "t", "m", {"third": ()}),
        Field("com", np.array([a / 2, a / 2, 0 * a]), "centre", r"\mathbf{R}", "m", {"com_x": (0,)}),
        Field("tensor", TENSOR, "tensor", r"\mathbf{I}", "kg m^2", {"Ixx": (0, 0), "Ixy": (0, 1)}),
    ),
)
times = np.linspace(0.0, 2.0, 41)
TABLES = Report(
    "rigidcli.example/1",
    "tables, of 2 kinds",
    "tables.yaml",
    "records and data",
    (
        Field("top.spin", 2.5, "spin", r"\omega_3", "rad/s", {"top.spin": ()}),
        Field("", None, cells={"free.rate": ()}),
        Field("top.drift", 1e-13, "drift", diagnostic=True),
        Field("top.kind", "wavy", "nutation", cells={"top.kind": ()}, words="wavy: L^2 > 2 T lambda2"),
    ),
    tables=(
        Table(
            "top.roots",
            "the roots",
            (
                Column("name", ["first", "<2nd> \x1b[31m_&"], ("name",)),
                Column("stable", [True, None], ("stable",)),
                Column("re", [-1.5, 1e-9], ("re",), "rad/s"),
                Column("hidden", [1.0, 2.0], ("hidden",), hidden=True),
            ),
            records=True,
        ),
        Table("top.none", "nothing", (Column("re", [], ("re",)),), records=True),
        Table(
            "trajectory",
            "the motion",
            (
                Column("t", times, ("t",), "s", ("t",)),
                Column("omega", np.outer(times, [1.0, -1e-17, 1e6]), ("w1", "w2", "w3"), "rad/s"),
                Column("energy", 1e-30 * times, ("T",), "J", hidden=True),
                Column("noisy", np.cos(times) + 1e-12 * times, ("n",), noise=0.6),
            ),
            data=True,
        ),
    ),
)
LOOKS = {
    "table": (Format.table, Look()),
    "table_narrow": (Format.table, Look(width=40, digits=3)),
    "table_colour": (Format.table, Look(width=80, colour=True)),
    "json": (Format.json, Look(digits=2, colour=True)),
    "csv": (Format.csv, Look(digits=2, colour=True)),
    "csv_bare": (Format.csv, Look(header=False)),
    "latex": (Format.latex, Look(digits=3)),
    "table_columns": (Format.table, Look(columns=("T", "w1"))),
    "table_verbose": (Format.table, Look(verbose=True)),
    "csv_units": (Format.csv, Look(unit_header=True)),
    "json_columns": (Format.json, Look(columns=("T", "w1"))),
    "csv_columns": (Format.csv, Look(columns=("T", "w1"), several=True)),
}


@pytest.mark.parametrize("report", [NUMBERS, SYMBOLS, TABLES], ids=["numbers", "symbols", "tables"])
@pytest.mark.parametrize("look", LOOKS)
def test_a_report_looks_as_it_did(look: str, report: Report) -> None:
    form, wanted = LOOKS[look]
    text = "".join(renderer(form)([report, report], wanted))
    path = GOLDEN / f"{look}_{report.source.partition('.')[0]}.txt"
    if os.environ.get("RIGIDCLI_GOLDEN") == "write":
        path.write_text(text)
    assert text == path.read_text()
