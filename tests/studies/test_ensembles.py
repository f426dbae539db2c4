"""Ensembles: each start moves as it does alone, whatever it is, and whatever the others are."""

from __future__ import annotations

import json
import math
import re
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp

import rigidcli
from rigidcli.core import free_body
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import RigidError
from rigidcli.report import Report
from rigidcli.studies.ensembles import reports, summaries
from rigidcli.studies.hamilton.many_orbits import together
from tests.conftest import Program
from tests.tables import rows_of

SAME = 1e-12
"""What a motion worked in arrays may differ by from the same motion alone, in units of the largest."""

BODIES = {
    "asymmetric": np.diag([1.0, 2.0, 3.0]),
    "turned": np.array([[2.0, 0.1, 0.2], [0.1, 3.0, 0.3], [0.2, 0.3, 4.0]]),
    "oblate": np.diag([1.0, 1.0, 1.5]),
    "prolate": np.diag([1.0, 3.0, 3.0]),
    "nearly oblate": np.diag([1.0, 1.0 + 1e-13, 1.5]),
    "slender": np.diag([1e-9, 2.0, 2.0 + 1e-9]),
    "sphere": np.diag([2.0, 2.0, 2.0]),
    "molecule": np.diag([1e-47, 2e-47, 2.5e-47]),
}

SPECIAL = rows_of(__file__, "special")
"""Rest, principal axes, the neighbourhood of the intermediate one, separatrices, tiny and huge (rad/s)."""


def starts(count: int) -> tuple[Floats, Floats]:
    """So many angular velocities and orientations."""
    source = np.random.default_rng(5)
    quaternions = source.normal(size=(count, 4))
    return source.normal(size=(count, 3)), quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


def require_same(body: Floats, omegas: Floats, quaternions: Floats, times: Floats, within: float) -> None:
    omega, orientation = free_body.motions(body, omegas, quaternions, times)
    for place in range(len(omegas)):
        alone = slice(place, place + 1)
        own_omega, own_orientation = free_body.motions(body, omegas[alone], quaternions[alone], times)
        assert np.abs(omega[place] - own_omega).max() <= within * np.abs(own_omega).max()
        assert np.abs(orientation[place] - own_orientation).max() <= within


@pytest.mark.parametrize("name", BODIES)
def test_arrays_of_bodies_move_as_each_does_alone(name: str) -> None:
    omegas, quaternions = starts(12)
    require_same(BODIES[name], omegas, quaternions, np.linspace(0, 100, 23), SAME)


def test_special_starts_stand_among_others() -> None:
    omegas, quaternions = np.array(SPECIAL, dtype=float), starts(len(SPECIAL))[1]
    require_same(BODIES["asymmetric"], omegas, quaternions, np.linspace(0, 10, 7), SAME)


BODY = {"moments": [1, 2, 3], "mass": 1}


def ensemble(omega: Any, **motion: Any) -> dict[str, Any]:
    return {"body": BODY, "motion": {"omega": omega, "duration": 5, "samples": 4, **motion}}


@pytest.mark.parametrize(
    "motion",
    rows_of(__file__, "the python interface has all samples with their start"),
)
def test_the_python_interface_has_all_samples_with_their_start(motion: dict[str, Any]) -> None:
    given = [[1, 0.5, 2], [0, 0, 1], [0.1, 1, -0.2]]
    found = rigidcli.euler(ensemble(given, **motion))
    trajectory = found["trajectory"]
    assert found["starts"] == 3
    assert trajectory["start"].tolist() == [0] * 4 + [1] * 4 + [2] * 4
    for place, omega in enumerate(given):
        alone = rigidcli.euler(ensemble(omega, **motion))["trajectory"]
        rows = slice(4 * place, 4 * place + 4)
        for key in alone:
            assert trajectory[key][rows] == pytest.approx(alone[key], rel=SAME, abs=1e-14), key


def test_an_ensemble_has_no_exact_results() -> None:
    with pytest.raises(RigidError, match="an ensemble has no exact results"):
        rigidcli.euler(ensemble([[1, 2, 3], [0, 1, 0]]), exact=True)


def test_orbits_of_an_ensemble_are_those_of_its_starts() -> None:
    system = {"coordinates": ["x"], "lagrangian": "xdot**2/2 - 2*x**2"}
    given = [{"x": 1, "xdot": 0}, {"x": 0.5, "xdot": "pi"}]

    def orbit(initial: Any) -> Any:
        found = {"system": system, "orbit": {"initial": initial, "duration": 3, "samples": 4}}
        return rigidcli.hamilton(found)["orbit"]

    found = orbit(given)
    for place, start in enumerate(given):
        alone = orbit(start)
        rows = slice(4 * place, 4 * place + 4)
        assert found["q"]["x"][rows].tolist() == alone["q"]["x"].tolist()
        assert found["p"]["p_x"][rows].tolist() == alone["p"]["p_x"].tolist()


SWARMS = yaml.safe_load((Path(__file__).parent / "swarms.yaml").read_text())


# heyoka alone steps over a wall, and tells no digit then.
BY_HEYOKA = [(name, "taylor") for name in SWARMS if name != "wall"]


@pytest.mark.parametrize(("name", "method"), [*((name, "auto") for name in SWARMS), *BY_HEYOKA])
def test_each_of_many_orbits_is_the_one_that_it_is_alone(name: str, method: str) -> None:
    """To 1e-9 or the digits told, which hold against an orbit to 1e-15; errors are those of the start."""
    if method == "taylor":
        pytest.importorskip("heyoka", reason="the extra `taylor` is not installed")
    swarm, source = SWARMS[name], np.random.default_rng(7)
    low, high = (np.array([*map(float, swarm[end].values())]) for end in ("low", "high"))
    given = [
        dict(zip(swarm["low"], row, strict=True))
        for row in source.uniform(low, high, (40, len(low))).tolist()
    ]
    sampling = {
        "duration": swarm.get("duration", 10),
        "samples": 7,
        "tolerance": swarm.get("tolerance", 1e-12),
    }

    def document(start: Any, **changes: Any) -> Any:
        orbit = {"initial": start, **sampling, **changes}
        keys = {key: swarm[key] for key in ("system", "observables") if key in swarm}
        return rigidcli.loads(json.dumps({**keys, "orbit": orbit}))

    def values(orbit: Any) -> Any:
        return np.array([*orbit["q"].values(), *orbit["p"].values()])

    rows, digits, errors = {}, {}, {}
    several = reports(document(given, method=method), rigidcli.hamilton, "few", range(40), together)
    for place, part in several:
        if isinstance(part, RigidError):
            errors[place] = str(part)
            continue
        table = part.tables[0].columns
        for index in range(0, len(table[0].values), 6):
            start = int(table[0].values[index])
            rows[start] = np.array(
                [column.values[index : index + 6] for column in table[2 : 2 + len(swarm["low"])]]
            )
            digits[start] = next(field.value for field in part.fields if field.key.endswith("trusted_digits"))
    assert sorted([*rows, *errors]) == [*range(40)]
    some = np.unique(np.linspace(0, 6, 6).astype(int))
    for place in list(errors)[:2]:
        with pytest.raises(RigidError, match=re.escape(errors[place])):
            rigidcli.hamilton(document(given[place]))
    for place in list(rows)[::5]:
        alone = rigidcli.hamilton(document(given[place]))["orbit"]
        dense = rigidcli.hamilton(document(given[place], samples=601, tolerance=1e-15))["orbit"]
        true = values(dense)[:, np.linspace(0, 600, 7).astype(int)[some]]
        size = np.abs(values(dense)).max(axis=1, keepdims=True)
        size[size == 0] = 1
        apart, miss = (np.abs((rows[place] - other) / size).max() for other in (values(alone)[:, some], true))
        assert apart < max(1e-9, 10 ** (0.5 - min(digits[place], alone["trusted_digits"])))
        assert miss < 10 ** (0.5 - digits[place])


SWEEPS = yaml.safe_load((Path(__file__).parent / "sweeps.yaml").read_text())


@pytest.mark.parametrize("name", SWEEPS)
def test_each_orbit_of_a_sweep_is_the_one_that_it_is_alone(program: Program, name: str) -> None:
    swept = dict(SWEEPS[name])
    sweep, conserved = swept.pop("sweep"), {"H", *swept.pop("conserved", ())}
    orbit = {"initial": swept.pop("initial"), "duration": swept.pop("duration", 10), "samples": 7}
    text = json.dumps({**swept, "orbit": orbit})
    options = [part for key in sweep for part in ("--sweep", key)]
    outcome = program("hamilton", "-q", "-f", "json", "-j", "1", *options, "-", stdin=text)
    assert program("hamilton", "-q", "-f", "json", "-j", "2", *options, "-", stdin=text) == outcome
    rows, refused = (
        [json.loads(line) for line in outcome.out.splitlines()],
        outcome.err.count("\nat ") + outcome.err.startswith("at "),
    )
    assert len(rows) + refused == math.prod(int(key.rpartition(":")[2]) for key in sweep)
    for row in rows[::6]:
        one = [f"--set={key}={value!r}" for key, value in row["swept"].items()]
        alone = json.loads(program("hamilton", "-q", "-f", "json", *one, "-", stdin=text).out)
        mine, other = row["orbit"], alone["orbit"]
        within = max(1e-9, 10 ** (0.5 - min(mine["trusted_digits"], other["trusted_digits"])))
        for kind in ("q", "p"):
            for variable, values in other[kind].items():
                assert mine[kind][variable] == pytest.approx(values, rel=within, abs=within)
        assert mine["drift"].keys() == other["drift"].keys() >= conserved
        assert max(mine["drift"].values()) < max(within, 10 * max(other["drift"].values()))
        for key, found in alone.get("observables", {}).items():
            assert row["observables"][key]["mean"] == pytest.approx(found["mean"], rel=within, abs=within)


PENDULUM = {"coordinates": ["x"], "lagrangian": "xdot**2/2 + cos(x)"}
SWARM = [{"x": 2.9 + x, "p_x": p} for x in (-0.03, 0.01, 0.02) for p in (-0.02, 0, 0.03)]


def test_many_starts_are_drawn_in_phase_space_at_four_times(program: Program, tmp_path: Path) -> None:
    document = {"system": PENDULUM, "orbit": {"initial": SWARM * 2, "duration": 9, "samples": 4}}
    picture = tmp_path / "swarm.svg"
    outcome = program("hamilton", "-", "--plot", str(picture), stdin=json.dumps(document))
    assert (outcome.code, outcome.err) == (0, "")
    assert all(f"t = {t} s" in picture.read_text() for t in (0, 3, 6, 9))
    refused = program(
        "hamilton", "-", "--plot", str(picture), "--plot-kind", "series", stdin=json.dumps(document)
    )
    assert refused.code == 2
    assert "a picture shows one start" in refused.err


def test_the_summary_of_orbits_is_that_of_an_independent_integration() -> None:
    times = np.linspace(0, 20, 6)
    follow = partial(solve_ivp, method="DOP853", t_eval=times, rtol=1e-11, atol=1e-13)
    starts = [list(start.values()) for start in SWARM]
    paths = np.array([follow(lambda t, y: [y[1], -np.sin(y[0])], (0, 20), start).y for start in starts])
    orbit = {"initial": SWARM, "duration": 20, "samples": len(times)}
    document = rigidcli.loads(json.dumps({"system": PENDULUM, "orbit": orbit}))
    parts = [report for _, report in reports(document, rigidcli.hamilton, "few", range(len(SWARM)))]
    (summary,) = summaries(part for part in parts if isinstance(part, Report))
    for table, values in zip(summary.tables, (paths[:, 0], paths[:, 1]), strict=False):
        found = np.array([column.values for column in table.columns[1:]])
        expected = [values.mean(axis=0), values.std(axis=0), values.min(axis=0), values.max(axis=0)]
        assert found == pytest.approx(np.array(expected), abs=1e-8)


def test_heyoka_follows_many_orbits_at_once_where_it_pays(program: Program) -> None:
    """Rows do not depend on which starts go together, nor on one beside them whose series ends."""
    pytest.importorskip("heyoka", reason="the extra `taylor` is not installed")
    system = {"coordinates": ["x", "y"], "hamiltonian": "(p_x**2 + p_y**2 + x**2 + y**2)/2 + x**2*y - y**3/3"}
    starts = [{"x": 0, "y": k / 100, "p_x": 0.2, "p_y": 0.1} for k in range(20)]
    starts[11] |= {"y": 2, "p_y": 1}  # beyond the saddle, it falls to infinity

    def outcome(starts: list[dict[str, float]], times: list[float], **more: object) -> tuple[list[str], str]:
        orbit = {"initial": starts, "times": times, **more}
        found = program(
            "hamilton", "-f", "csv", "-j", "1", "-", stdin=json.dumps({"system": system, "orbit": orbit})
        )
        return [row.partition(",")[2] for row in found.out.splitlines()[1:]], found.err

    together, errors = outcome(starts, [0, 50], method="taylor")
    assert "start 11: -: the orbit becomes infinite" in errors
    assert "followed together by Taylor series (heyoka)" in errors
    assert together[6:] == outcome(starts[3:], [0, 50], method="taylor")[0]
    assert "heyoka" not in outcome(starts, [0, 50])[1]
    assert "followed together by Taylor series (heyoka)" in outcome(starts, [25_000])[1]
    assert outcome(starts, [0], method="taylor") == outcome(starts, [0])


def test_rows_of_chaotic_orbits_do_not_depend_on_the_other_starts(program: Program) -> None:
    """One start in eight has a second solution: which one it is must not show in the rows."""
    system = {"coordinates": ["x", "y"], "hamiltonian": "(p_x**2 + p_y**2 + x**2 + y**2)/2 + x**2*y - y**3/3"}
    starts = [{"x": 0, "y": k / 100 - 0.2, "p_x": 0.47, "p_y": 0.1} for k in range(20)]

    def rows(starts: list[dict[str, float]]) -> list[str]:
        orbit = {"initial": starts, "duration": 400, "samples": 2}
        outcome = program("hamilton", "-f", "csv", "-", stdin=json.dumps({"system": system, "orbit": orbit}))
        assert "no digit is certain" in outcome.err
        return [row.partition(",")[2] for row in outcome.out.splitlines()[1:]]

    assert rows(starts)[6:] == rows(starts[3:])
