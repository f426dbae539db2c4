"""The working that `--steps` shows: it leads to the results, and its formulas hold."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import rigidcli
from rigidcli.algebra.expressions import Expr
from rigidcli.language.expression import real
from rigidcli.report import Step
from tests.conftest import ROOT, Program

BLOCK = """
body:
  parts:
    - {name: block, shape: box, size: [1, 2, 3], mass: 4, position: [1, 0, -1], axis: [1, 2, 2]}
    - {name: hole, shape: cylinder, radius: 0.2, height: 0.5, mass: 0.03, position: [1, 0.1, -1], hole: true}
about: [0.5, 0.5, 0]
motion: {omega: [0.3, -1, 2], duration: 2, samples: 401}
"""


def test_columns_with_letters_have_no_units_in_their_heads(program: Program) -> None:
    shown = program("inertia", "--steps", str(ROOT / "configs" / "three_equal_masses.yaml")).out
    assert "     m  x    y    z  m x    m y    m z\n" in shown
    assert "kg" not in shown
    assert (
        "m(y^2+z^2) (kg m^2)"
        in program("inertia", "--steps", str(ROOT / "configs" / "three_masses.yaml")).out
    )


def value(step: Step, title: str) -> Any:
    """What a step says under this title."""
    return next(entry.value for entry in step.fields if entry.title == title)


def evaluated(formula: Any, **numbers: float) -> float:
    """A formula with numbers for its names."""
    return real(formula.tree(), numbers)


def test_the_cube_reads_like_a_textbook(program: Program) -> None:
    out = program("axes", "configs/cube_symbolic.yaml", "--steps").out
    lines = [" ".join(line.split()) for line in out.splitlines()]
    for line in (
        "integral of x^2 dm M a^2/12",
        "with mu M a^2/12",
        "det(I - lambda 1) -lambda^3 + 24 mu lambda^2 - 165 mu^2 lambda + 242 mu^3",
        "in factors (2 mu - lambda) (11 mu - lambda)^2",
        "lambda2 = lambda3 11 M a^2/12",
        "row echelon form 1 0 -1",
        "e1 (sqrt(3)/3, sqrt(3)/3, sqrt(3)/3)",
    ):
        assert line in lines
    assert "any two orthogonal vectors of length one in this plane serve, such as e2 and e3." in out
    assert "paragraph" in program("axes", "configs/cube_symbolic.yaml", "--steps", "-f", "latex").out


def listed(step: Step, head: str) -> list[Any]:
    """The column of a step's table under this head."""
    return next(list(column.values) for column in step.tables[0].columns if column.cells == (head,))


def test_parts_and_their_parallel_axis_terms_add_up() -> None:
    result = rigidcli.inertia(BLOCK, steps=True)
    center, block, hole, last = result.steps
    terms = [
        sign * (value(step, "tensor about the centre of mass") + value(step, "M (d^2 1 - d d^T)"))
        for step, sign in ((block, 1), (hole, -1))
    ]
    assert np.allclose(sum(terms), result["tensor"], rtol=1e-12)
    assert np.array_equal(value(last, "I"), result["tensor"])
    for head, place in (("Ixx", (0, 0)), ("Iyz", (1, 2))):
        added = [*(term[place] for term in terms), result["tensor"][place]]
        assert listed(last, head) == pytest.approx(added)
    assert listed(center, "m")[:2] == [4, -0.03]
    for k, axis in enumerate("xyz"):
        own = [m * x for m, x in zip(listed(center, "m")[:2], listed(center, axis), strict=False)]
        assert listed(center, f"m {axis}") == pytest.approx([*own, sum(own)])
        assert sum(own) / 3.97 == pytest.approx(result["center_of_mass"][k])


@pytest.mark.parametrize(
    "body",
    [
        "{points: [[1, 1, 0, 0], [2, 0, 1, 1], [3, 0, 1, -1]]}",
        "{shape: cube, side: 2, mass: 3, anchor: corner}",
    ],
)
def test_angular_momentum_energy_and_torque_are_worked_component_by_component(body: str) -> None:
    result = rigidcli.axes(f"body: {body}\nmotion: {{omega: [0.5, -1, 2]}}", steps=True)
    step = result.steps[-1]
    for title, key in (("L", "angular_momentum"), ("N", "holding_torque")):
        worked = [evaluated(value(step, title + axis)) for axis in "xyz"]
        assert worked == pytest.approx(list(result[key]), rel=1e-12)
    assert evaluated(value(step, "T")) == pytest.approx(result["kinetic_energy"], rel=1e-12)


def test_integrals_make_the_tensor_of_a_shape() -> None:
    document = "body: {shape: tetrahedron, vertices: [[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], mass: 2}"
    step = rigidcli.inertia(document, steps=True).steps[0]
    second = np.zeros((3, 3))
    for i, a in enumerate("xyz"):
        second[i, i] = value(step, f"integral of {a}^2 dm")
        for j, b in list(enumerate("xyz"))[i + 1 :]:
            second[i, j] = second[j, i] = value(step, f"integral of {a} {b} dm")
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3.0]]) - np.array([1, 2, 3]) / 4
    # Of a tetrahedron about its centre of mass: M/20 times the sum over its corners.
    assert np.allclose(second, 2 * corners.T @ corners / 20, atol=1e-14)
    tensor = value(step, "tensor along the axes of the shape")
    assert np.allclose(tensor, np.trace(second) * np.eye(3) - second, atol=1e-14)


@pytest.mark.parametrize(
    "shape",
    [
        "{shape: cone, radius: 2, height: 3, mass: M}",
        "{shape: hemisphere, radius: 2, density: M}",
        "{shape: conical_shell, radius: 1, height: 2, mass: M}",
    ],
)
def test_elements_of_mass_add_up_to_the_integrals(shape: str) -> None:
    steps = rigidcli.inertia(f"parameters: {{M: null}}\nbody: {shape}\n", steps=True).steps
    elements = [step for step in steps if step.title == "Element of mass"]
    node, weight = (part / 2 for part in np.polynomial.legendre.leggauss(20))
    mass, first, square = 0.0, 0.0, 0.0
    for step in elements:
        *places, element = step.fields[:4]
        ends = {field.title.split()[0]: float(field.value) for field in step.fields[4:]}
        names = [word.removeprefix("d") for word in element.title.split()[2:]]
        nodes = np.meshgrid(*(ends.get(name, 1.0) * (node + 0.5) for name in names), indexing="ij")
        weights = np.prod(np.meshgrid(*(ends.get(n, 1.0) * weight for n in names), indexing="ij"), axis=0)
        known = dict(zip(names, nodes, strict=True)) | {"M": 1.0}
        x, _, z, dm = (field.value.evaluate(**known) * np.ones_like(weights) for field in (*places, element))
        mass += (weights * dm).sum()
        first += (weights * dm * z).sum()
        square += (weights * dm * x**2).sum()
    integrals = next(step for step in steps if step.title == "Integrals over the body")
    assert evaluated(value(integrals, "mass"), M=1) == pytest.approx(mass, rel=1e-12)
    assert evaluated(value(integrals, "integral of x^2 dm"), M=1) == pytest.approx(square, rel=1e-12)
    com = rigidcli.inertia(f"parameters: {{M: null}}\nbody: {shape}\n")["center_of_mass"][2]
    assert evaluated(com, M=1) * mass == pytest.approx(first, abs=1e-12 * mass)


def test_the_polynomial_is_the_determinant_and_the_echelon_form_has_the_axes() -> None:
    result = rigidcli.axes(BLOCK, steps=True)
    tensor, moments = result["tensor"], result["moments"]
    polynomial = next(step for step in result.steps if step.title == "Principal moments")
    for x in (-1.0, 0.3, 7.0):
        determinant = np.linalg.det(tensor - x * np.eye(3))
        for title in ("det(I - lambda 1)", "in factors"):
            found = evaluated(value(polynomial, title), **{"lambda": x})
            assert found == pytest.approx(determinant, rel=1e-9)
    own = [step for step in result.steps if step.title.startswith("Axis of")]
    assert len(own) == 3
    for k, step in enumerate(own):
        axis = value(step, f"e{k + 1}")
        assert np.array_equal(axis, result["axes"][k])
        echelon = value(step, "row echelon form")
        assert np.allclose(echelon @ axis, 0, atol=1e-9)
        assert np.linalg.matrix_rank(echelon) == 2
        assert np.allclose((tensor - moments[k] * np.eye(3)), value(step, "I - lambda 1"), atol=1e-12)


@pytest.mark.parametrize("moments", [[1, 1, 1], [1, 2, 2], [2, 2, 3], [0, 1, 1], [0, 0, 0]])
def test_equal_moments_have_steps(moments: list[float]) -> None:
    tensor = {"moments": moments, "mass": 1, "rotation": {"axis": [1, 2, 3], "angle": 0.4}}
    result = rigidcli.axes({"body": tensor}, steps=True)
    (step,) = (step for step in result.steps if step.title == "Principal moments")
    roots = [f.value for f in step.fields for name in f.title.split(" = ") if name.startswith("lambda")]
    assert roots == pytest.approx(result["moments"])


def test_the_formulas_of_a_top_have_the_values_of_the_results() -> None:
    result = rigidcli.precess(ROOT / "configs" / "openstax_gyroscope.yaml", steps=True)
    by_title = {step.title: step for step in result.steps}
    top = result["top"]
    for step, formula, key in (
        ("Torque of the weight", "M g R sin(theta)", "torque_magnitude"),
        ("Gyroscopic precession", "M g R/(lambda3 omega3)", "gyroscopic_rate"),
        ("Upright", "sqrt(4 lambda1 M g R)/lambda3", "sleeping_spin"),
    ):
        assert evaluated(value(by_title[step], formula)) == pytest.approx(top[key], rel=1e-12)
    quadratic = by_title["Steady precession"].fields[0].value
    for key in ("slow_rate", "fast_rate"):
        assert evaluated(quadratic, Omega=top[key]) == pytest.approx(0, abs=1e-12)


def test_the_cubic_vanishes_at_the_turning_points() -> None:
    result = rigidcli.precess(ROOT / "configs" / "top_looping.yaml", steps=True)
    step = next(step for step in result.steps if step.title == "Nutation")
    cubic = step.fields[0].value
    scale = evaluated(cubic, u=np.cos((result["top"]["theta_min"] + result["top"]["theta_max"]) / 2))
    assert scale > 0
    for key in ("theta_min", "theta_max"):
        assert evaluated(cubic, u=np.cos(result["top"][key])) == pytest.approx(0, abs=1e-9 * scale)


@pytest.mark.parametrize(
    "torque",
    [
        "",
        "torque: {gravity: 9.81}",
        "torque: {body: [-0.5*w1, 2*w3, sin(t)]}",
        "torque: {space: [0, 1, 2]}",
    ],
)
def test_eulers_equations_hold_along_the_motion(torque: str) -> None:
    result = rigidcli.euler(
        BLOCK.replace("duration", f"{torque}, duration" if torque else "duration"), steps=True
    )
    first, trajectory = result.steps[0], result["trajectory"]
    omega = trajectory["omega"] @ result["axes"].T
    slope = np.gradient(omega, trajectory["t"], axis=0, edge_order=2)[200]
    q0, *q = trajectory["orientation"][200]
    # The rows are the axes of space, in components along the axes of the body.
    turn = (q0**2 - np.dot(q, q)) * np.eye(3) + 2 * np.outer(q, q)
    turn += 2 * q0 * np.array([[0, -q[2], q[1]], [q[2], 0, -q[0]], [-q[1], q[0], 0]])
    names = dict(zip(("w1", "w2", "w3"), omega[200], strict=True)) | {"t": trajectory["t"][200]}
    names |= dict(zip(("u1", "u2", "u3"), result["axes"] @ turn[2], strict=True))
    w = trajectory["omega"][200]
    given = turn.T @ [0, 1, 2] if "space" in torque else [-0.5 * w[0], 2 * w[2], np.sin(names["t"])]
    names |= dict(zip(("N1", "N2", "N3"), result["axes"] @ given, strict=True))
    for k in range(3):
        right = evaluated(value(first, f"lambda{k + 1} dw{k + 1}/dt"), **names)
        assert right == pytest.approx(result["moments"][k] * slope[k], rel=2e-3, abs=1e-3)


def test_eulers_equations_have_the_torque_of_the_document_in_them(program: Program) -> None:
    out = program("euler", "configs/damped_satellite.yaml", "--steps", "-q").out
    assert re.search(r"^lambda3 dw3/dt +\(90 - 90\) w1 w2 - 0\.05 w3$", out, re.MULTILINE)
    assert "N3" not in out


def test_eulers_equations_near_each_axis_have_the_rates_of_the_stability() -> None:
    result = rigidcli.euler(BLOCK, steps=True)
    step = next(step for step in result.steps if step.title == "Stability")
    for number, row in enumerate(result["stability"], 1):
        slope = evaluated(value(step, f"x'' about e{number}"), w=1.0, x=1.0)
        assert slope == pytest.approx((-1 if row["stable"] else 1) * row["rate_per_spin"] ** 2, rel=1e-9)


def test_the_steps_of_hamilton_show_the_results_themselves() -> None:
    result = rigidcli.hamilton(ROOT / "configs" / "kepler_polar.yaml", steps=True)
    titles = [step.title for step in result.steps]
    assert titles[:5] == ["Lagrangian", "Momenta", "Velocities", "Hamiltonian", "Hamilton's equations"]
    assert value(result.steps[3], "Hamiltonian") == result["hamiltonian"]
    numbers = {"m": 2.0, "gm": 3.0, "r": 1.7, "p_r": 0.4, "p_phi": -1.1}
    substituted = evaluated(value(result.steps[3], "p_q qdot - L"), **numbers)
    assert substituted == pytest.approx(result["hamiltonian"].evaluate(**numbers), rel=1e-12)
    assert titles[-1] == "Energy"  # that p_phi is conserved, dL/dphi = 0 says
    plane = "system: {coordinates: [x, y], lagrangian: (xdot^2 + ydot^2)/2 - (x^2 + y^2)^2}"
    proof = rigidcli.hamilton(rigidcli.loads(plane), steps=True).steps[-1]
    assert proof.title == "Angular momentum about z is conserved"
    assert value(proof, "sum of df/dq dH/dp") == value(proof, "sum of df/dp dH/dq")


@pytest.mark.parametrize("is_numeric", [True, False])
def test_the_polynomial_of_modes_is_the_determinant_of_the_matrices(is_numeric: bool) -> None:
    numbers = {"m": 2.0, "g": 9.5, "l": 0.7, "k": 3.0}
    given = [f"parameters.{name}={number}" for name, number in numbers.items() if is_numeric]
    result = rigidcli.hamilton(ROOT / "configs/coupled_pendulums.yaml", settings=given, steps=True)
    step = next(step for step in result.steps if step.title == "Small oscillations")
    masses, stiffness = (
        np.array([e.evaluate(**numbers) if isinstance(e, Expr) else e for e in value(step, name).flat])
        for name in "MK"
    )
    forms = [field.value for field in step.fields if field.title == "det(K - omega^2 M)"]
    assert len(forms) == 1
    for form in forms:
        for omega in (0.3, 2.5):
            exact = np.linalg.det((stiffness - omega**2 * masses).reshape(2, 2))
            assert evaluated(form, omega=omega, **numbers) == pytest.approx(exact, rel=1e-12)
    assert not step.tables  # the modes stand above


@pytest.mark.parametrize(
    ("config", "numbers"),
    [
        ("coupled_pendulums", {"m": 2.0, "g": 9.5, "l": 0.7, "k": 3.0}),
        ("double_pendulum", {}),
    ],
)
def test_the_vectors_of_modes_solve_their_equations(config: str, numbers: dict[str, float]) -> None:
    values = {"m": 2.0, "g": 9.5, "l": 0.7, "k": 3.0, "m1": 1.0, "m2": 2.0, "l1": 0.5, "l2": 0.9}
    settings: dict[str, Any] = {f"parameters.{name}": number for name, number in numbers.items()}
    settings |= {} if config == "coupled_pendulums" else {"equilibrium": {"theta1": 0, "theta2": 0}}
    result = rigidcli.hamilton(ROOT / f"configs/{config}.yaml", settings=settings, steps=True)
    steps = [step for step in result.steps if step.title.startswith("Vector of mode")]
    assert len(steps) == len(result["modes"]) == 2
    for step, mode in zip(steps, result["modes"], strict=True):

        def number(e: Any) -> float:
            return e.evaluate(**{name: values[name] for name in e.names}) if isinstance(e, Expr) else float(e)

        matrix = np.array([[number(e) for e in row] for row in value(step, "K - omega^2 M")])
        vector = np.array([number(e) for e in value(step, "v")])
        assert matrix @ vector == pytest.approx(np.zeros(2), abs=1e-9 * np.abs(matrix).max())
        assert number(value(step, "omega^2")) == pytest.approx(number(mode["rate"]) ** 2)
        first = step.fields[2]
        assert first.title == "theta1"
        assert evaluated(first.value, theta2=vector[1], **values) == pytest.approx(vector[0])


def test_brackets_of_a_change_of_variables_are_worked() -> None:
    result = rigidcli.hamilton(ROOT / "configs/taylor_13_25.yaml", steps=True)
    step = next(step for step in result.steps if step.title == "Bracket {q, p_q}")
    worked, bracket = [field.value for field in step.fields if field.title == "{q, p_q}"]
    at = {"Q": 0.4, "P": 1.7}
    assert bracket == result["transform"]["brackets"]["{q, p_q}"]
    assert evaluated(worked, **at) == pytest.approx(1, rel=1e-12)
    slopes = [evaluated(value(step, name), **at) for name in ("dq/dQ", "dp_q/dP", "dq/dP", "dp_q/dQ")]
    assert slopes[0] * slopes[1] - slopes[2] * slopes[3] == pytest.approx(1, rel=1e-12)
    assert value(result.steps[-1], "new Hamiltonian") == result["transform"]["hamiltonian"]


def test_a_wrong_bracket_is_worked_and_two_pairs_have_six() -> None:
    change = "transform: {new_variables: [Q, R, P, S], new: {Q: x + y, R: y, P: p_x, S: p_y}}"
    system = f"system: {{coordinates: [x, y], lagrangian: xdot^2/2 + ydot^2/2 - x^2}}\n{change}\n"
    result = rigidcli.hamilton(rigidcli.loads(system), steps=True)
    steps = {step.title: step for step in result.steps if step.title.startswith("Bracket")}
    assert len(steps) == len(result["transform"]["brackets"]) == 6
    assert "only if this one is 0" in steps["Bracket {Q, S}"].sentence
    assert result["transform"]["canonical"] is False
    assert evaluated(value(steps["Bracket {Q, S}"], "{Q, S}")) == 1
    assert result.steps[-1].title != "Hamiltonian in the new variables"


def test_energies_and_lagrange_equations_are_put_together_from_their_parts() -> None:
    result = rigidcli.hamilton(ROOT / "configs/double_pendulum.yaml", steps=True)
    by_title = {step.title: step for step in result.steps}
    names = ("theta1", "theta2", "theta1dot", "theta2dot", "theta1ddot", "theta2ddot")
    at = dict(zip(names, (0.3, -1.1, 0.7, 1.9, -0.4, 0.6), strict=True))
    at |= {"m1": 1.5, "m2": 0.8, "l1": 0.9, "l2": 1.2, "g": 9.8}

    def found(title: str, name: str) -> float:
        return evaluated(value(by_title[title], name), **at)

    speeds = [sum(found("Lagrangian", f"d{axis}{k}/dt") ** 2 for axis in "xy") for k in (1, 2)]
    kinetic = (at["m1"] * speeds[0] + at["m2"] * speeds[1]) / 2
    heights = at["m1"] * found("Lagrangian", "y1") + at["m2"] * found("Lagrangian", "y2")
    assert found("Lagrangian", "T") == pytest.approx(kinetic, rel=1e-13)
    assert found("Lagrangian", "V") == pytest.approx(at["g"] * heights, rel=1e-13)
    assert found("Lagrangian", "Lagrangian") == pytest.approx(kinetic - at["g"] * heights, rel=1e-13)
    for q in ("theta1", "theta2"):
        parts = [found("Lagrange's equations", name) for name in (f"d/dt dL/d{q}dot", f"dL/d{q}")]
        whole = found("Lagrange's equations", f"Lagrange, {q}: 0 =")
        assert whole == pytest.approx(parts[0] - parts[1], rel=1e-12)


def test_polynomials_keep_away_from_names_of_the_document() -> None:
    document = """
parameters: {omega: null, lambda: null}
system: {coordinates: [x], lagrangian: omega*xdot^2/2 - lambda*x^2/2}
equilibrium: {x: 0}
"""
    texts = document, document.partition("equilibrium")[0]
    steps = {s.title: s for text in texts for s in rigidcli.hamilton(text, steps=True).steps}
    numbers = {"omega": 2.0, "lambda": 3.0}
    assert evaluated(value(steps["Matrix form"], "det(A - Lambda 1)"), Lambda=0.5, **numbers) == 0.25 + 1.5
    assert evaluated(value(steps["Small oscillations"], "det(K - Omega^2 M)"), Omega=0.5, **numbers) == 2.5


def test_steps_tell_what_forces_add() -> None:
    drag = "system: {coordinates: [x], kinetic: xdot^2/2, potential: x^2/2, forces: {x: -xdot}}\n"
    forced, free = (
        {step.title: step for step in rigidcli.hamilton(rigidcli.loads(text), steps=True).steps}
        for text in (drag, drag.replace(", forces: {x: -xdot}", ""))
    )
    for title, word in [("Hamilton's", "plus the force"), ("Lagrange's", "is the force")]:
        assert word in forced[f"{title} equations"].sentence
        assert "force" not in free[f"{title} equations"].sentence
    assert "the power of the forces" in forced["Energy"].sentence
    # What shifts no equation is not shown.
    assert [field.title for field in free["Matrix form"].fields if "offset" in field.title] == []


def test_latex_is_a_document_by_itself_on_demand(program: Program) -> None:
    configs = [f"configs/{name}.yaml" for name in ("cube_symbolic", "three_masses")]
    fragments = program("axes", *configs, "-f", "latex", "--steps").out
    text = program("axes", *configs, "-f", "latex", "--steps", "--standalone").out
    assert text.startswith("\\documentclass")
    assert text.endswith("\\end{document}\n")
    assert text.count("\\begin{document}") == 1
    assert text.count("\\section*{") == 2
    assert text.count("\\begin{align*}") == fragments.count("\\begin{align*}")
