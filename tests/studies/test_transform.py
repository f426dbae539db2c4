"""Changes of variables: the verdict, its conditions, and K, held to the motion that the old H has."""

from __future__ import annotations

from typing import Any

import mpmath
import pytest

import rigidcli
from rigidcli.language.parser import read
from rigidcli.report import Report
from tests.trees import CONTEXT, value

OSCILLATOR = "p_x**2/(2*m) + m*w**2*x**2/2"
PLANE = "(p_x**2 + p_y**2)/(2*m) + k*sqrt(x**2 + y**2) + c*x"
SPACE = "(p_x**2 + p_y**2 + p_z**2)/(2*m) + c*z - k/sqrt(x**2 + y**2 + z**2)"
R, R_3, RHO = "sqrt(x**2 + y**2)", "sqrt(x**2 + y**2 + z**2)", "sqrt(x**2 + y**2)"
FAR, CLOSE = "sqrt((x + a)**2 + y**2)", "sqrt((x - a)**2 + y**2)"
LONG, SHORT = f"(({FAR} + {CLOSE})/(2*a))", f"(({FAR} - {CLOSE})/(2*a))"
TURNED = [
    *("x*cos(w*t) + y*sin(w*t)", "-x*sin(w*t) + y*cos(w*t)"),
    *("p_x*cos(w*t) + p_y*sin(w*t)", "-p_x*sin(w*t) + p_y*cos(w*t)"),
]


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


CHANGES = {
    # H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, sections 9.2 to 9.4 and problems.
    "Galilei": ("x", OSCILLATOR, "Q P", ["x - v*t", "p_x - m*v"]),
    "shaken support": ("x", OSCILLATOR, "Q P", ["x - a*cos(b*t)", "p_x + m*a*b*sin(b*t)"]),
    "rotating frame": ("x y", PLANE, "X Y PX PY", TURNED),
    "gauge": ("x", OSCILLATOR, "Q P", ["x", "p_x + x**2*cos(t)"]),
    "free motion": ("x", OSCILLATOR, "Q P", ["x - p_x*t/m", "p_x"]),
    "logarithm": ("x", OSCILLATOR, "Q P", ["log(x)", "x*p_x"]),
    "hyperbolic sine": ("x", OSCILLATOR, "Q P", ["sinh(x)", "p_x/cosh(x)"]),
    "quotient": ("x", OSCILLATOR, "Q P", ["-p_x/x", "x**2/2"]),
    "action and angle": ("x", OSCILLATOR, "Q P", ["atan(m*w*x/p_x)", "p_x**2/(2*m*w) + m*w*x**2/2"]),
    "polar and turning": (
        "x y",
        PLANE,
        "r f pr pf",
        [R, "atan2(y, x) - w*t", f"(x*p_x + y*p_y)/{R}", "x*p_y - y*p_x"],
    ),
    "spherical": (
        "x y z",
        SPACE,
        "r f g pr pf pg",
        [
            R_3,
            f"acos(z/{R_3})",
            "atan2(y, x)",
            f"(x*p_x + y*p_y + z*p_z)/{R_3}",
            f"(z*(x*p_x + y*p_y) - (x**2 + y**2)*p_z)/{RHO}",
            "x*p_y - y*p_x",
        ],
    ),
    "parabolic": (
        "x y z",
        SPACE,
        "u v g pu pv pg",
        [
            f"{R_3} + z",
            f"{R_3} - z",
            "atan2(y, x)",
            f"(p_z + (x*p_x + y*p_y)/({R_3} + z))/2",
            f"(-p_z + (x*p_x + y*p_y)/({R_3} - z))/2",
            "x*p_y - y*p_x",
        ],
    ),
    "cylindrical": (
        "x y z",
        SPACE,
        "s g Z ps pg PZ",
        [RHO, "atan2(y, x)", "z", f"(x*p_x + y*p_y)/{RHO}", "x*p_y - y*p_x", "p_z"],
    ),
    "elliptic": (
        "x y",
        f"(p_x**2 + p_y**2)/(2*m) - k/{FAR} - c/{CLOSE}",
        "s d ps pd",
        [
            LONG,
            SHORT,
            f"a*{SHORT}*p_x + y*{LONG}/({LONG}**2 - 1)*p_y",
            f"a*{LONG}*p_x - y*{SHORT}/(1 - {SHORT}**2)*p_y",
        ],
    ),
    "conformal": (
        "x y",
        PLANE,
        "X Y PX PY",
        ["(x**2 - y**2)/2", "x*y", "(x*p_x - y*p_y)/(x**2 + y**2)", "(y*p_x + x*p_y)/(x**2 + y**2)"],
    ),
}


@pytest.mark.parametrize("name", CHANGES)
def test_new_variables_move_by_the_new_hamiltonian(name: str) -> None:
    coordinates, hamiltonian, new, formulas = CHANGES[name]
    given = dict(zip(new.split(), formulas, strict=True))
    found = transformed(coordinates, hamiltonian, "new", new, given)["transform"]
    assert found["canonical"] is True
    holds(coordinates, hamiltonian, "new", new, given, str(found["hamiltonian"]))


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


@pytest.mark.parametrize("size", [2, 3, 5, 9])
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
        ("{m: null, w: null}", True, ["m > 0", "w > 0"]),
        ("{m: null, w: 2}", True, ["m > 0"]),
        ("{m: 1, w: null}", True, ["w > 0"]),
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
        ("p_x**2/2 + c*sqrt(x**2)", {"Q": "x + 1", "P": "p_x"}, []),
    ],
)
def test_k_says_where_it_holds(hamiltonian: str, given: dict[str, str], conditions: list[str]) -> None:
    found = transformed("x", hamiltonian, "new", "Q P", given)["transform"]
    assert found["canonical"] is True
    assert found["conditions"] == conditions
    holds("x", hamiltonian, "new", "Q P", given, str(found["hamiltonian"]))


OLD = {
    "a b pa pb": [  # parabolic
        *("(a**2 - b**2)/2", "a*b", "(a*pa - b*pb)/(a**2 + b**2)", "(b*pa + a*pb)/(a**2 + b**2)"),
    ],
    "u v pu pv": [  # elliptic
        *("cosh(u)*cos(v)", "sinh(u)*sin(v)"),
        "(sinh(u)*cos(v)*pu - cosh(u)*sin(v)*pv)/(sinh(u)**2 + sin(v)**2)",
        "(cosh(u)*sin(v)*pu + sinh(u)*cos(v)*pv)/(sinh(u)**2 + sin(v)**2)",
    ],
    "r f pr pf": [  # polar and turning
        *("r*cos(f + w*t)", "r*sin(f + w*t)"),
        *("pr*cos(f + w*t) - pf*sin(f + w*t)/r", "pr*sin(f + w*t) + pf*cos(f + w*t)/r"),
    ],
}
"""x, y, p_x and p_y in new variables."""


@pytest.mark.parametrize("new", OLD)
def test_old_variables_in_new_ones(new: str) -> None:
    given = dict(zip(("x", "y", "p_x", "p_y"), OLD[new], strict=True))
    found = transformed("x y", PLANE, "old", new, given)["transform"]
    assert found["canonical"] is True
    holds("x y", PLANE, "old", new, given, str(found["hamiltonian"]))


@pytest.mark.parametrize("rate", ["w*t", "-w*t", "c*t", "a*cos(t)"])
def test_angles_that_turn_in_time(rate: str) -> None:
    given = {name: text.replace("Q", f"Q + ({rate})") for name, text in ACTION_ANGLE.items()}
    found = transformed("x", OSCILLATOR, "old", "Q P", given)["transform"]
    assert (found["canonical"], found["conditions"]) == (True, ["m > 0", "w > 0"])
    holds("x", OSCILLATOR, "old", "Q P", given, str(found["hamiltonian"]))


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
