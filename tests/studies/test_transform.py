"""Changes of variables: the verdict, its conditions, and K, held to the motion that the old H has."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mpmath
import pytest
import yaml

import rigidcli
from rigidcli.language.parser import read
from rigidcli.report import Report
from tests.trees import CONTEXT, value

CHANGES = yaml.safe_load(Path(__file__).with_name("changes.yaml").read_text(encoding="utf-8"))
OSCILLATOR = "p_x**2/(2*m) + m*w**2*x**2/2"


def transformed(coordinates: str, hamiltonian: str, change: str, new: str, given: dict[str, str]) -> Report:
    """What `hamilton` says of a change; all parameters are without values."""
    names = {name for text in (hamiltonian, *given.values()) for name in read(text)[1]}
    known = {"t", *new.split(), *coordinates.split(), *(f"p_{q}" for q in coordinates.split())}
    parameters = ", ".join(f"{name}: null" for name in sorted(names - known))
    lines = "".join(f"    {name}: '{text}'\n" for name, text in given.items())
    return rigidcli.hamilton(
        rigidcli.loads(
            f"parameters: {{{parameters}}}\n"
            f"system: {{coordinates: [{', '.join(coordinates.split())}], hamiltonian: '{hamiltonian}'}}\n"
            f"transform:\n  new_variables: [{', '.join(new.split())}]\n  {change}:\n{lines}"
        )
    )


def gradient(text: str, point: dict[str, Any], names: list[str]) -> mpmath.matrix:
    """The derivatives of a text by names, from differences with many digits."""
    tree = read(text)[0]
    return CONTEXT.matrix(
        [CONTEXT.diff(lambda x, n=name: value(tree, point | {n: x}), point[name]) for name in names]
    )


def holds(coordinates: str, hamiltonian: str, change: str, new: str, given: dict[str, str], k: str) -> None:
    """By K, the new variables move as they do where the old ones move by H."""
    old = [*coordinates.split(), *(f"p_{q}" for q in coordinates.split())]
    sides = [(old, hamiltonian), (new.split(), k)]
    (names, h), (others, other_h) = sides if change == "new" else reversed(sides)
    texts = (hamiltonian, k, *given.values())
    symbols = sorted(set().union(*(read(text)[1] for text in texts)) | {*names, "t"})
    for seed in (3, 4):
        point = {name: CONTEXT.mpf((37 * i + 61 * seed) % 89 + 31) / 71 for i, name in enumerate(symbols)}
        there = point | {name: value(read(given[name])[0], point) for name in others}
        size = len(names) // 2
        slopes, other_slopes = gradient(h, point, names), gradient(other_h, there, others)
        flow = [*slopes[size:], *(-slope for slope in slopes[:size])]
        expected = [*other_slopes[size:], *(-slope for slope in other_slopes[:size])]
        for name, rate in zip(others, expected, strict=True):
            moved = gradient(given[name], point, [*names, "t"])
            found = sum(a * b for a, b in zip(moved, [*flow, 1], strict=True))
            assert abs(found - rate) < 1e-15 * (1 + abs(rate)), name


@pytest.mark.parametrize("name", CHANGES)
def test_new_variables_move_by_the_new_hamiltonian(name: str) -> None:
    case = CHANGES[name]
    change = "new" if "new" in case else "old"
    new = case.get("variables") or " ".join(case["new"])
    given = case[change]
    found = transformed(case["coordinates"], case["hamiltonian"], change, new, given)["transform"]
    assert found["canonical"] is True
    holds(case["coordinates"], case["hamiltonian"], change, new, given, str(found["hamiltonian"]))


def jacobi(size: int) -> dict[str, str]:
    """Each body seen from the centre of mass of those before it, and the centre of all."""
    given = {}
    for i in range(1, size):
        weight = "+".join(f"m{j}" for j in range(i))
        centre, push = ("+".join(f"{left}{j}" for j in range(i)) for left in ("x", "p_x"))
        centre = "+".join(f"m{j}*x{j}" for j in range(i))
        given[f"Q{i}"] = f"x{i} - ({centre})/({weight})"
        given[f"P{i}"] = f"(({weight})*p_x{i} - m{i}*({push}))/({weight}+m{i})"
    weight = "+".join(f"m{j}" for j in range(size))
    given["Q0"] = "(" + "+".join(f"m{j}*x{j}" for j in range(size)) + f")/({weight})"
    given["P0"] = "+".join(f"p_x{j}" for j in range(size))
    return given


@pytest.mark.parametrize("size", [2, 5])
def test_jacobi_coordinates_of_any_number_of_bodies(size: int) -> None:
    coordinates = " ".join(f"x{i}" for i in range(size))
    new = " ".join(f"{letter}{i}" for letter in "QP" for i in range(size))
    kinetic = " + ".join(f"p_x{i}**2/(2*m{i})" for i in range(size))
    report = transformed(coordinates, f"{kinetic} - k/abs(x0 - x1)", "new", new, jacobi(size))
    expected = ["P0**2/(2*(" + "+".join(f"m{j}" for j in range(size)) + "))", "-k/abs(Q1)"]
    for i in range(1, size):
        weight = "+".join(f"m{j}" for j in range(i))
        expected.append(f"P{i}**2*({weight}+m{i})/(2*({weight})*m{i})")
    names = {*new.split(), "k", *(f"m{i}" for i in range(size))}
    point = {name: CONTEXT.mpf(7 * i % 31 + 3) / 13 for i, name in enumerate(sorted(names))}
    found = str(report["transform"]["hamiltonian"])
    assert value(read(found)[0], point) == pytest.approx(
        value(read(" + ".join(expected))[0], point), rel=1e-30
    )
    assert len(found) < 2 * len(" + ".join(expected))


ACTION_ANGLE = {"x": "sqrt(2*P/(m*w))*sin(Q)", "p_x": "sqrt(2*P*m*w)*cos(Q)"}


@pytest.mark.parametrize(
    ("parameters", "canonical", "conditions"),
    [
        ("{m: null, w: null}", True, []),
        ("{m: null, w: 2}", True, []),
        ("{m: 1, w: 2}", True, []),
        ("{m: 1, w: -2}", False, []),
    ],
)
def test_signs_of_parameters_may_decide(parameters: str, canonical: bool, conditions: list[str]) -> None:
    lines = "".join(f"    {name}: {text}\n" for name, text in ACTION_ANGLE.items())
    found = rigidcli.hamilton(
        rigidcli.loads(
            f"parameters: {parameters}\nsystem: {{coordinates: [x], hamiltonian: {OSCILLATOR}}}\n"
            f"transform:\n  new_variables: [Q, P]\n  old:\n{lines}"
        )
    )["transform"]
    assert (found["canonical"], found["conditions"]) == (canonical, conditions)
    assert (str(found["hamiltonian"]) == "P*w") == canonical


@pytest.mark.parametrize(
    ("hamiltonian", "given", "conditions"),
    [
        ("p_x**2/2 + c*x", {"Q": "x**2/2", "P": "p_x/x"}, ["x > 0"]),
        ("p_x**2/2 + c*x**4", {"Q": "x**2/2", "P": "p_x/x"}, []),
        ("p_x**2/2 + x**2", {"Q": "abs(x)", "P": "p_x"}, ["x > 0"]),
        ("p_x**2/2 + c*sin(x)**2", {"Q": "sin(x)", "P": "p_x/cos(x)"}, []),
        ("p_x**2/2 + c*abs(x)", {"Q": "x + 1", "P": "p_x"}, []),
    ],
)
def test_k_says_where_it_holds(hamiltonian: str, given: dict[str, str], conditions: list[str]) -> None:
    found = transformed("x", hamiltonian, "new", "Q P", given)["transform"]
    assert found["canonical"] is True
    assert found["conditions"] == conditions
    holds("x", hamiltonian, "new", "Q P", given, str(found["hamiltonian"]))


def test_exponentials_are_written_once() -> None:
    given = {"x": "X*exp(a*t)", "p_x": "(P - b*X)*exp(-a*t)"}
    found = str(transformed("x", OSCILLATOR, "old", "X P", given)["transform"]["hamiltonian"])
    assert "exp(2*a*t)" in found
    assert "exp(-2*a*t)" in found
    holds("x", OSCILLATOR, "old", "X P", given, found)


def test_a_way_back_that_is_not_found_is_admitted() -> None:
    report = transformed("x", OSCILLATOR, "new", "Q P", {"Q": "x + exp(x)", "P": "p_x/(1 + exp(x))"})
    assert report["transform"]["canonical"] is True
    assert report["transform"]["hamiltonian"] is None
    assert any("not found" in note for note in report.notes)


GENERATING = yaml.safe_load(Path(__file__).with_name("generating.yaml").read_text(encoding="utf-8"))
SIGNS = {"F1": (1, -1), "F2": (1, 1), "F3": (-1, -1), "F4": (-1, 1)}
"""The signs of dF/d(old argument) and dF/d(new argument), from Goldstein's table 9.1."""


def generating_text(case: dict[str, Any], kind: str) -> str:
    """A document with the generating function of a row; all parameters are without values."""
    coordinates, new = case["coordinates"].split(), case["new"].split()
    known = {"t", *new, *coordinates, *(f"p_{q}" for q in coordinates)}
    names = {n for key in ("hamiltonian", kind) for n in read(case[key])[1]} - known
    system = {"coordinates": coordinates, "hamiltonian": case["hamiltonian"]}
    transform = {"new_variables": new, kind: case[kind]}
    return yaml.safe_dump({"parameters": dict.fromkeys(names), "system": system, "transform": transform})


@pytest.mark.parametrize("name", GENERATING)
def test_a_generating_function_makes_its_change_and_k(name: str) -> None:
    case = GENERATING[name]
    (kind,) = SIGNS.keys() & case.keys()
    old = [*case["coordinates"].split(), *(f"p_{q}" for q in case["coordinates"].split())]
    new, half = case["new"].split(), len(old) // 2
    names = {n for key in ("hamiltonian", kind, "K") for n in read(case[key])[1]} - {*old, *new, "t"}
    text = generating_text(case, kind)
    found = rigidcli.hamilton(rigidcli.loads(text))["transform"]
    assert found["canonical"] is True
    assert all(found[side] for side in case.get("solved", ()))
    side = "old" if found["old"] else "new"
    given = {n: str(e) for n, e in found[side].items()}
    change = (case["coordinates"], case["hamiltonian"], side, case["new"], given)
    holds(*change, str(found["hamiltonian"]))
    symbols = sorted({*names, *old, *new, "t"})
    point = {n: CONTEXT.mpf((41 * i) % 83 + 29) / 67 for i, n in enumerate(symbols)} | case.get("at", {})
    # K itself, with what depends on the time alone; and the relations of the function.
    assert abs(value(read(str(found["hamiltonian"]))[0], point) - value(read(case["K"])[0], point)) < 1e-15
    point |= {n: value(read(text)[0], point) for n, text in given.items()}
    for phase, momenta, sign in zip((old, new), (kind in "F3 F4", kind in "F2 F4"), SIGNS[kind], strict=True):
        for i in range(half):
            argument, other = phase[i + half * momenta], phase[i + half * (not momenta)]
            (slope,) = gradient(case[kind], point, [argument])
            assert abs(point[other] - sign * slope) < 1e-15, other


def both_ways(point: dict[str, Any], new: Any, old: Any) -> dict[str, Any]:
    """The old variables at a point, by way of the new ones."""
    for side in (new, old):
        point = point | {n: value(read(str(e))[0], point) for n, e in side.items()}
    return point


@pytest.mark.parametrize(
    "name", [name for name in GENERATING if len(GENERATING[name].get("solved", ())) == 2]
)
def test_old_and_new_variables_are_inverse_to_each_other(name: str) -> None:
    case = GENERATING[name]
    (kind,) = SIGNS.keys() & case.keys()
    found = rigidcli.hamilton(rigidcli.loads(generating_text(case, kind)))["transform"]
    names = [*found["old"], "t", "m", "k", "w"]
    for seed in range(8):
        point = {n: CONTEXT.mpf((37 * i + 61 * seed) % 89 + 31) / 71 for i, n in enumerate(names)}
        point |= {n: -point[n] for i, n in enumerate(found["old"]) if seed >> i & 1}
        there = both_ways(point, found["new"], found["old"])
        assert all(abs(there[n] - point[n]) < 1e-15 for n in found["old"])


def test_an_inverse_on_one_branch_is_told() -> None:
    # x = sqrt(Q) is the inverse of Q = x^2 where x > 0.
    case = {"coordinates": "x", "hamiltonian": "p_x**2/2", "new": "Q P", "F2": "P*x**2"}
    text = generating_text(case, "F2")
    (note,) = rigidcli.hamilton(rigidcli.loads(text)).notes
    assert "on one branch alone, as near x = " in note


@pytest.mark.parametrize(
    ("kind", "function"),
    [("F1", "x**2*cot(Q1)/2 + y**2*cot(Q2)/2"), ("F2", "x*J2 + y*J1"), ("F4", "p_x*J1 + p_y*J2")],
)
def test_a_generating_function_tells_new_variables_in_pairs(kind: str, function: str) -> None:
    case = {"coordinates": "x y", "hamiltonian": "(p_x**2 + p_y**2 + x**2 + y**2)/2", kind: function}
    texts = [generating_text(case | {"new": new}, kind) for new in ("Q1 J1 Q2 J2", "Q1 Q2 J1 J2")]
    pairs, halves = (rigidcli.hamilton(rigidcli.loads(text))["transform"] for text in texts)
    assert str(pairs["hamiltonian"]) == str(halves["hamiltonian"])
    assert {name: str(e) for name, e in pairs["old"].items()} == {
        name: str(e) for name, e in halves["old"].items()
    }
