"""Vectors, moments, matrices and tensors: answers with their verdicts, worked out by hand."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rigidcli.errors import DocumentError
from tests.check.asking import asked, codes, judged, table, told, typed

Floats = NDArray[np.float64]

CUBE = "[[8, -3, -3], [-3, 8, -3], [-3, -3, 8]]"
MATRIX = "[[1, 2, 0], [-3, 4, 5], [6, 7, 9]]"
KM, LAW = "symbols: {k: positive, m: positive}", "symbols: {m: positive, g: positive, theta: real}"
SHORT = {
    "CUBE": CUBE,
    "MATRIX": MATRIX,
    "KM": KM,
    "PLATES": f"'M a^2/12 * {CUBE}'",
    "MA": "symbols: {M: positive, a: positive}",
    "LAW": LAW,
    "FIGURES": "tolerance: {significant_figures: 3}",
}


def question(kind: str, key: str, options: str = "") -> str:
    options = SHORT.get(options, options)
    return f"{{kind: {kind}, answer: {SHORT.get(key, key)}{', ' * bool(options)}{options}}}"


@table("""
    kind | key | options | share | said | answer
    # Notation: brackets, blanks, semicolons, decimal commas, units behind all, names, LaTeX.
    vector | [1 cm, -2 cm, 0 cm] | | 1 | | [1 cm, -20 mm, 0 m]  [1, -2, 0]  '[1, -2, 0] cm'  '(1, -2, 0) cm'
    '1; -2; 0'  '1, -2, 0'  '1,0; -2,0; 0'  'r = [0.01, -0.02, 0] m'  {x: 1, y: -2 cm, z: 0}
    {r_x: 1, r_y: -2, r_z: 0}
    '{x: 1, y: -2, z: 0} cm'  [1e-2 m, −2, -0.0]  '\\begin{pmatrix} 1 \\\\ -2 \\\\ 0 \\end{pmatrix} cm'
    [[1], [-2], [0]]
    [1/100 m, -sqrt(4), sin(0)]  '1 -2 0'  '[1.00, -2.01, 0.00] cm'  [1, -2, 3e-7]  {1: 1, 2: -2, 3: 0}
    vector | [1 cm, 2 cm, 0 cm] | | 0 | unit_incompatible@component-1 | [1 kg, 2 cm, 0]
    vector | [1, 2] | | 0 | unit_incompatible@component-1 | [1 cm, 2 cm]
    vector | [1 cm, -2 cm, 0 cm] | unit: required | 1 | | [1 cm, -2 cm, 0]  '[1, -2, 0] cm'
    vector | [1 cm, -2 cm, 0 cm] | unit: required | 0 | unit_missing | [1, -2, 0]  '[1, -2, 0]'
    vector | [1 cm, -2 cm, 0 cm] | unit: required | 0 | outside_tolerance | [7, 8, 9]
    vector | [1, 2] | unit: required | 1 | | [1, 2]
    vector | [1 deg, 2 deg] | unit: required | 1 | | [1, 2]
    # Directions.
    vector | [0, 3, 4] | direction: sense | 1 | | [0, 300, 400]  [0, 3, 4]
    vector | [0, 3, 4] | direction: parallel | 1 | | [0, 300, 400]  [0, -0.6, -0.8]
    vector | [0, 3, 4] | direction: sign_free | 1 | | [0, 3, 4]  [0, -3, -4]
    vector | [0, 3, 4] | direction: sign_free | 0 | components_permuted | [0, 4, 3]
    vector | [0, 3, 4] | direction: sense | 0 | sign_error | [0, -3, -4]
    vector | [0, 3, 4] | direction: sense | 0 | outside_tolerance | [0, 0, 0]  [1, 3, 4]
    vector | [0, 3, 4] | direction: parallel | 0 | outside_tolerance | [0, 0, 0]
    vector | [0, 3, 4] | direction: sense, normalized: required | 1 | | [0, 0.6, 0.8]
    vector | [0, 3, 4] | direction: parallel, normalized: required | 1 | | [0, -0.6, -0.8]
    vector | [0, 3, 4] | direction: sense, normalized: required | 0 | axis_not_normalised | [0, 3, 4]
    vector | [0, 3, 4] | direction: sense, normalized: required | 0 | outside_tolerance | [0, 0.8, 0.7]
    # Mistakes with names.
    vector | [1, 2, 3] | | 0 | sign_error | [-1, -2, -3]
    vector | [1, 2, 3] | | 0 | power_of_ten | [0.01, 0.02, 0.03]
    vector | [1, 2, 3] | | 0 | constant_factor | [2, 4, 6]  [1.7, 3.4, 5.1]
    vector | [1, 2, 3] | | 0 | components_permuted | [3, 1, 2]
    vector | [1, 2, 3] | | 2/3 | component_wrong@component-3 | [1, 2, 4]  [1, 2, -3]
    vector | [1 rad/s, 2, 3] | | 0 | degrees_radians | [180/pi, 360/pi, 540/pi]
    vector | [1 rad/s, 2, 3] | | 0 | frequency_vs_angular_frequency | [2*pi, 4*pi, 6*pi]
    vector | [0, 0, 4] | | 0 | constant_factor | [0, 0, 2]
    vector | [0, 0, 4] | | 0 | outside_tolerance | [0, 0, 2.2]  [0, 0, 17]
    vector | [1234 m, 2 m] | | 0 | undecided | '[1,234; 2]'
    # Moments: right ones less surplus ones.
    moments | [2 kg m^2, 11, 11] | | 1 | | '[2, 11, 11] kg m^2'  '[11, 2, 11]'  '11 2 11'
    'lambda_1 = 2, lambda_2 = lambda_3 = 11'  [lambda_1 = 2, lambda_2=lambda_3=11]
    {x: 2, y: 11, z: 11}
    {lambda1: 11, lambda2: 2, lambda3: 11 kg m^2}  '{I1: 2e7, I2: 11e7, I3: 11e7} g cm^2'
    moments | [3, 5, 6] | | 2/3 | wrong_shape | [3, 5]  [3, 5, 6, 6]
    moments | [3, 5, 6] | | 1/3 | wrong_shape | [3, 5, 6, 6, 6]  [6]
    moments | [2, 11, 11] | | 2/3 | wrong_shape | [2, 11]  [11, 2]  [2, 11, 11, 5]
    moments | [2, 11, 11] | | 2/3 | component_wrong@moment-2 | [2, 2, 11]  [2, 5, 11]
    moments | [2, 11, 11] | | 2/3 | component_wrong@moment-1 | [3, 11, 11]  [-2, 11, 11]
    moments | [2, 11, 11] | | 0 | sign_error | [-2, -11, -11]
    moments | [2, 11, 11] | | 0 | power_of_ten | [0.2, 1.1, 1.1]
    moments | [2, 11, 11] | | 0 | constant_factor | [7, 38.5, 38.5]
    moments | [2, 11, 11] | | 0 | outside_tolerance | [7, 8, 9]
    moments | [0, 1, 1] | | 0 | outside_tolerance | [0, 3, 4]
    moments | [2, 5, 11] | order: ascending | 1 | | [2, 5, 11]
    moments | [2, 5, 11] | order: ascending | 0 | wrong_order | [11, 2, 5]
    moments | [2, 5, 11] | order: ascending | 1/3 | wrong_order | [11, 5, 2]
    # Matrices: zeros and ones earn nothing, but wrong ones cost.
    matrix | MATRIX | | 1 | | MATRIX  '[[1, 2, 0]; [-3, 4, 5]; [6, 7, 9]]'
    '\\begin{pmatrix} 1 & 2 & 0 \\\\ -3 & 4 & 5 \\\\ 6 & 7 & 9 \\end{pmatrix}'
    '1/2 * [[2, 4, 0], [-6, 8, 10], [12, 14, 18]]'
    matrix | [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]] | | 0 | outside_tolerance |
    [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    matrix | [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]] | | 3/4 | component_wrong@row-3,-column-3 |
    [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, -1]]
    matrix | [[1, 0], [0, 1]] | | 0 | outside_tolerance | [[0, 0], [0, 2]]
    matrix | MATRIX | | 1/7 | transposed | [[1, -3, 6], [2, 4, 7], [0, 5, 9]]
    matrix | MATRIX | | 0 | power_of_ten | [[10, 20, 0], [-30, 40, 50], [60, 70, 90]]
    matrix | MATRIX | | 0 | sign_error | [[-1, -2, 0], [3, -4, -5], [-6, -7, -9]]
    matrix | MATRIX | | 5/7 | component_wrong@row-2,-column-1;-row-3,-column-2 |
    [[1, 2, 0], [3, 4, 5], [6, -7, 9]]
    # Tensors: six components.
    tensor | CUBE | | 1 | | CUBE  {Ixx: 8, Iyy: 8, Izz: 8, Ixy: -3, Ixz: -3, Iyz: -3}
    {I11: 8, i_22: 8, 'I_{zz}': 8, Iyx: -3, Izx: -3, I23: -3}  'I = [[8, -3, -3], [-3, 8, -3], [-3, -3, 8]]'
    tensor | CUBE | | 1/2 | products_of_inertia_sign | [[8, 3, 3], [3, 8, 3], [3, 3, 8]]
    tensor | CUBE | | 1/2 | products_of_inertia_missing | [[8, 0, 0], [0, 8, 0], [0, 0, 8]]
    tensor | CUBE | | 0 | sign_error | [[-8, 3, 3], [3, -8, 3], [3, 3, -8]]
    tensor | CUBE | | 0 | other_frame | [[2, 0, 0], [0, 11, 0], [0, 0, 11]]
    tensor | CUBE | | 5/6 | not_symmetric@Ixy | [[8, -3, -3], [3, 8, -3], [-3, -3, 8]]
    tensor | CUBE | | 2/3 | not_symmetric@Ixy component_wrong@Izz | [[8, -2, -3], [-4, 8, -3], [-3, -3, 9]]
    tensor | CUBE | | 5/6 | component_wrong@Iyy | [[8, -3, -3], [-3, 7, -3], [-3, -3, 8]]
    tensor | CUBE | | 0 | outside_tolerance | [[4, 1, 0], [1, 5, 0], [0, 0, 4]]
    tensor | [[2, 0, 0], [0, 3, 0], [0, 0, 4]] | | 0 | outside_tolerance |
    [[2.5, 0, 0], [0, 3.5, 0], [0, 0, 4.7]]
    tensor | [[1, 0, 0], [0, 2, 0], [0, 0, 3]] | | 2/3 | component_wrong@Ixy |
    [[1, 0.05, 0], [0.05, 2, 0], [0, 0, 3]]
    tensor | CUBE | 'products: plus' | 1/2 | products_of_inertia_sign | [[8, 3, 3], [3, 8, 3], [3, 3, 8]]
    # Figures: as many as are asked, and half a unit of the last.
    vector | [1/6, 5/6] | FIGURES | 1 | | [0.167, 0.833]  [0.1667, 0.8333]  [1/6, 5/6]
    vector | [1/6, 5/6] | FIGURES | 0 | too_few_sig_figs | [0.17, 0.83]
    vector | [1/6, 5/6] | FIGURES | 1/2 | too_few_sig_figs@component-1 | [0.17, 0.833]
    vector | [1/6, 5/6] | FIGURES | 0 | outside_tolerance | [0.2, 0.8]  [0.18, 0.84]
    vector | [1/6, 5/6] | | 1/2 | component_wrong@component-1 | [0.17, 0.83]
    moments | [9.99, 10.0] | FIGURES | 1 | | [9.952, 9.988]  [9.988, 9.952]
    # Symbols.
    vector | [m*g*sin(theta), 0, -m*g] | LAW | 1 | | [g*m*sin(-theta)*(-1), m - m, -g/(1/m)]
    ['mg\\sin\\theta', 0, -mg]
    vector | [m*g*sin(theta), 0, -m*g] | LAW | 2/3 | component_wrong@component-1 | [m*g*theta, 0, -m*g]
    [g*m*abs(sin(theta)), 0, -m*g]
    vector | [m*g*sin(theta), 0, -m*g] | LAW | 0 | sign_error | [-m*g*sin(theta), 0, m*g]
    vector | [sqrt(k/m), 0, -2*k] | KM | 0 | number_for_symbol@component-1,-component-3 | [2, 0, -3]
    vector | [sqrt(k/m), 0, -2*k] | KM | 2/3 | number_for_symbol@component-1 | [2, 0, -2*k]
    vector | [k*m, k] | 'KM, direction: sense' | 1 | | [2*k*m^2, 2*k*m]
    moments | [sqrt(k/m), k] | KM | 1 | | [k, 'k^(1/2)/sqrt(m)']
    moments | [sqrt(k/m), k] | KM | 1/2 | component_wrong@moment-1 | [2*k*m, k]
    moments | [sqrt(k/m), k] | KM | 0 | constant_factor | [2*k, 2*sqrt(k/m)]
    matrix | [[0, 1/m], [-k, 0]] | KM | 1/2 | number_for_symbol@row-1,-column-2 | [[0, 0.5], [-k, 0]]
    tensor | PLATES | MA | 1 | |
    'Ma^2/12 * [[8, -3, -3], [-3, 8, -3], [-3, -3, 8]]'
    '\\frac{M a^2}{12} [[8, -3, -3], [-3, 8, -3], [-3, -3, 8]]'
    {Ixx: 2Ma^2/3, Iyy: 2Ma²/3, Izz: 0.667*M*a^2, Ixy: -M*a^2/4, Ixz: -0.25Ma^2, Iyz: -Ma^2/4}
    """)
def test_an_array(kind: str, key: str, options: str, share: str, said: str, answer: Any) -> None:
    for short, long in SHORT.items():
        options = options.strip("'").replace(short, long)
    answer = typed(SHORT.get(answer, "")) if isinstance(answer, str) and answer in SHORT else answer
    outcome = judged(asked(question(kind, key, options)), answer)
    assert told(outcome) == said
    assert outcome.share == pytest.approx(float(Fraction(share)))


RIGHT = {"vector": "[1 cm, -2 cm, 0 cm]", "moments": "[2, 11, 11]", "matrix": MATRIX, "tensor": CUBE}


@table("""
    kind | code | answer
    vector | unit_incompatible | '[1, -2, 0] kg'
    vector | wrong_shape | '[1, -2] cm'  [1, 2]  []  [1, 2, [3]]  {x: 1}  {x: 1, y: -2}  {x: 1, y: -2, w: 0}
    {}
    vector | not_a_number | [1, 2 +- 0.1, 3]  [1, 2, three]  [1, 2, nan]  [1, 2, 1e999]
    [1, 2, __import__('os').system('id')]
    vector | wrong_shape | {x: 1, X: -2, z: 0}  [1, 2, null]
    moments | wrong_shape | []
    moments | unit_incompatible | [2, 11, 11 m]
    matrix | wrong_shape | 1  []  [[]]  [[1, 2], 3]  [[1, 2], [3]]  {a: 1}  [[1, 2], [4, 5]]
    tensor | wrong_shape | 8  [[8, 3], [3, 8]]  [8, 8, 8]  {Ixx: 8, Iyy: 8, Izz: 8}
    {Ixx: 8, Iyy: 8, Izz: 8, Ixy: -3, Ixz: -3, Iyw: -3}
    tensor | duplicate_key | {Ixx: 8, ixx: 8}
    """)
def test_what_cannot_be_read(kind: str, code: str, answer: Any) -> None:
    outcome = judged(asked(question(kind, RIGHT[kind])), answer)
    assert (outcome.verdict, outcome.share, codes(outcome)[0]) == ("invalid", 0.0, code)


@table("""
    kind | options | answer
    vector | | 17.25 kg, 2 m  [17.25, [2]]  []  [17.25 kg, 2 m]
    vector | direction: parallel | [0, 0]
    moments | order: ascending | [17.25*a, b]
    matrix | | [[17.25], [1, 2]]  [[]]
    tensor | | 17.25  [[17.25, 0], [0, 17.25]]  [[17.25, 1, 0], [0, 2, 0], [0, 0, 3]]
    """)
def test_bad_keys_are_refused_without_being_told(kind: str, options: str, answer: Any) -> None:
    with pytest.raises(DocumentError) as refused:
        asked(question(kind, json.dumps(answer), options))
    assert "17.25" not in str(refused.value)


# --- keys from documents


def about(points: list[tuple[float, ...]], origin: Any) -> Floats:
    """Sum m (r^2 1 - r r^T), r taken from the origin given."""
    total = np.zeros((3, 3))
    for mass, *place in points:
        r = np.array(place) - np.array(origin)
        total += mass * (r @ r * np.eye(3) - np.outer(r, r))
    return total


def rows(values: Any) -> list[list[str]]:
    return [[repr(float(value)) for value in row] for row in values]


def mistaken(points: list[tuple[float, ...]], origin: Floats, turn: Floats) -> dict[str, Floats]:
    """The tensor about the origin along the columns of `turn`, and what comes out under mistakes."""
    masses, places = np.array(points)[:, 0], np.array(points)[:, 1:]
    com = masses @ places / masses.sum()
    d = turn.T @ (origin - com)
    central = turn.T @ about(points, com) @ turn
    steiner = masses.sum() * (d @ d * np.eye(3) - np.outer(d, d))
    right = central + steiner
    found = {
        "": right,
        "products_of_inertia_sign": 2 * np.diag(np.diag(right)) - right,
        "products_of_inertia_missing": np.diag(np.diag(right)),
        "parallel_axis_missing": central,
        "parallel_axis_sign": central - steiner,
        "power_of_ten": right / 100,
        "constant_factor": right * 2.7,
        "other_frame": turn @ right @ turn.T,
    }
    for order in list(itertools.permutations(range(3)))[1:]:
        found[f"components_permuted {order}"] = right[np.ix_(order, order)]
    return found


def are_apart(tensors: dict[str, Floats]) -> bool:
    scale, values = np.abs(tensors[""]).max(), list(tensors.values())
    return all(np.abs(a - b).max() > 0.05 * scale for k, a in enumerate(values) for b in values[:k])


COORDINATES = st.integers(-4, 4).map(float)
POINTS = st.lists(st.tuples(st.integers(1, 5).map(float), *[COORDINATES] * 3), min_size=2, max_size=6)


@settings(max_examples=15, deadline=None)
@given(POINTS, st.tuples(*[COORDINATES] * 3), st.sampled_from(["minus", "plus"]))
def test_mistakes_on_the_way_to_a_tensor(
    points: list[tuple[float, ...]], origin: tuple[float, ...], products: str
) -> None:
    turn = Rotation.from_rotvec(math.radians(50) * np.array([1, 2, 3]) / math.sqrt(14)).as_matrix()
    frame = {"axis": [1, 2, 3], "angle": "50 deg"}
    tensors = mistaken(points, np.array(origin), turn)
    assume(are_apart(tensors))
    document = json.dumps({"body": {"points": points}, "about": origin, "frame": frame})
    item = asked(f"{{ask: inertia.tensor, products: {products}}}", document)
    signs = 2 * np.eye(3) - 1 if products == "plus" else np.ones((3, 3))
    for code, tensor in tensors.items():
        outcome = judged(item, rows(tensor * signs))
        assert codes(outcome)[:1] == code.split()[:1]
        assert (outcome.verdict == "correct") == (not code)


def test_moments_of_mistaken_tensors() -> None:
    points: list[tuple[float, ...]] = [(1, 1, 0, 0), (2, 0, 1, 1), (3, 0.5, 1, -1)]
    origin = np.array([1.0, -1, 2])
    item = asked("{ask: axes.moments}", json.dumps({"body": {"points": points}, "about": origin.tolist()}))
    tensors = mistaken(points, origin, np.eye(3))
    for code in ("", "products_of_inertia_sign", "products_of_inertia_missing", "parallel_axis_missing"):
        outcome = judged(item, [repr(float(each)) for each in np.linalg.eigvalsh(tensors[code])[::-1]])
        assert codes(outcome) == code.split()


SPINNING = """
body: {points: [[1, 1, 0, 0], [2, 0, 1, 1], [3, 0, 1, -1]]}
frame: {axis: [0, 0, 1], angle: 40 deg}
motion: {omega: [1, 2, 3]}
"""


def test_angular_momentum_in_other_axes() -> None:
    momentum = np.array([[10.0, 0, 0], [0, 6, 1], [0, 1, 6]]) @ [1, 2, 3]
    turn = Rotation.from_rotvec([0, 0, math.radians(40)]).as_matrix()
    item = asked("{ask: axes.angular_momentum}", SPINNING)
    along = turn.T @ momentum
    assert judged(item, [f"{value:.3g}" for value in along]).verdict == "correct"
    assert judged(item, [f"{value * 1000:.4g} g m^2/s" for value in along]).verdict == "correct"
    outcome = judged(item, [repr(float(value)) for value in momentum])
    assert codes(outcome) == ["other_frame"]
    assert outcome.share == pytest.approx(1 / 3)


def test_a_centre_of_mass_at_the_origin() -> None:
    """0.1 + 0.2 - 0.3 is not zero in floats, but the centre of mass is."""
    points = [[1, 0.1, 3, 0], [1, 0.2, -3, 0], [1, -0.3, 0, 1], [1, 0, 0, -1]]
    item = asked("{ask: inertia.center_of_mass}", f"body: {{points: {points}}}")
    assert judged(item, ["0", "1e-16", "-3e-17"]).verdict == "correct"
    assert judged(item, ["0.1", "0", "0"]).share == pytest.approx(2 / 3)


CORNER = "parameters: {M: null, a: null}\nbody: {shape: cube, side: a, mass: M, anchor: corner}"
SPRING = """
parameters: {m: 1 kg, w: 2 rad/s, k: m*w^2}
system: {coordinates: [x], kinetic: m*xdot^2/2, potential: k*x^2/2}
"""


@table("""
    ask | document | share | said | answer
    inertia.tensor | CORNER | 1 | | 'Ma^2/12 [[8, -3, -3], [-3, 8, -3], [-3, -3, 8]]'
    inertia.tensor | CORNER | 1/2 | parallel_axis_missing |
    '\\frac{M a^2}{6} \\begin{pmatrix} 1 & 0 & 0 \\\\ 0 & 1 & 0 \\\\ 0 & 0 & 1 \\end{pmatrix}'
    inertia.tensor | CORNER | 0 | unknown_symbol@row-1,-column-1 | 'm*a^2/6 [[1, 0, 0], [0, 1, 0], [0, 0, 1]]'
    axes.moments | CORNER | 1 | | [11*M*a^2/12, a*a*M/6, M*a**2*(1 - 1/12)]
    axes.moments | CORNER | 2/3 | wrong_shape | [11*M*a^2/12, a*a*M/6]
    inertia.center_of_mass | CORNER | 1 | | [a/2, 0.5*a, a - a/2]
    inertia.center_of_mass | CORNER | 0 | constant_factor | [a, a, a]
    inertia.center_of_mass | CORNER | 2/3 | component_wrong@component-1 | ['log(-a)', a/2, a/2]
    hamilton.matrix | SPRING | 1 | | [[0, 1/m], [-k, 0]]  [[0, k/(m*k)], [-m*w^2, sin(0)]]
    hamilton.matrix | SPRING | 0 | transposed | [[0, -k], [1/m, 0]]
    hamilton.matrix | SPRING | 0 | number_for_symbol@row-1,-column-2;-row-2,-column-1 | [[0, 1], [-4, 0]]
    hamilton.matrix, numbers: allowed | SPRING | 1 | | [[0, 1], [-4, 0]]  [[0, 1/m], [-4, 0]]
    hamilton.matrix, numbers: allowed | SPRING | 1/2 | component_wrong@row-2,-column-1 | [[0, 1], [4, 0]]
    """)
def test_documents_with_symbols(ask: str, document: str, share: str, said: str, answer: Any) -> None:
    outcome = judged(asked(f"{{ask: {ask}}}", {"CORNER": CORNER, "SPRING": SPRING}[document]), answer)
    if said == "parallel_axis_missing":
        share = "0"  # no component of the corner's tensor is right
    assert told(outcome) == said
    assert outcome.share == pytest.approx(float(Fraction(share)))


@pytest.mark.parametrize(
    "more", ["abs(a - 3) + a - 3", "exp(-1e6*(a - 0.9)^2)", "log(1 + exp(1e3*(a - 20)))"]
)
@pytest.mark.parametrize(("kind", "key"), [("vector", ["m*a", "2*m*a"]), ("moments", ["m*a^2", "2*m*a^2"])])
def test_what_vanishes_at_most_values_of_a_symbol_is_not_right(kind: str, key: list[str], more: str) -> None:
    item = asked({"kind": kind, "answer": key, "symbols": {"m": "positive", "a": "positive"}})
    assert judged(item, key).verdict == "correct"
    assert judged(item, [f"{key[0]} + m*({more})", key[1]]).verdict != "correct"


# --- right is never wrong, and wrong never right

SHAPES = {"vector": (3,), "moments": (3,), "matrix": (2, 3), "tensor": (3, 3)}
UNITS = {"m": 1.0, "cm": 100.0, "km": 1e-3, "ft": 1 / 0.3048}
SIZES = st.one_of(st.sampled_from([0.0, 1.0, -1.0, 2.0, 1e-9, 1e9]), st.floats(0.1, 10), st.floats(-10, -0.1))
SCALES = st.sampled_from([1e-90, 1e-30, 1.0, 37.0, 1e30, 1e90])
NOISE = st.sampled_from([0.0, 1e-16, -3e-17, 1e-15])


@st.composite
def keys(draw: st.DrawFn) -> tuple[str, Floats]:
    """A kind, and an array with an entry that is not zero."""
    kind = draw(st.sampled_from(sorted(SHAPES)))
    values = np.resize(np.array(draw(st.lists(SIZES, min_size=9, max_size=9))), SHAPES[kind]) * draw(SCALES)
    values = (values + values.T) / 2 if kind == "tensor" else values
    assume(values.any())
    return kind, values


def tree(values: Any, form: str) -> Any:
    return [tree(value, form) for value in values] if np.ndim(values) else form.format(float(values))


@settings(max_examples=60, deadline=None)
@given(keys(), st.sampled_from([None, 1e-6, 0.02]), st.data())
def test_right_is_never_wrong(made: tuple[str, Floats], relative: float | None, data: st.DataObject) -> None:
    kind, values = made
    tolerance = {} if relative is None else {"tolerance": {"relative": relative}}
    item = asked({"kind": kind, "answer": tree(values, "{!r} m"), **tolerance})
    off = np.resize(data.draw(st.lists(st.floats(-0.9, 0.9), min_size=9, max_size=9)), values.shape)
    noise = data.draw(NOISE) * np.abs(values).max()
    near = np.where(
        values == 0, noise, values * (1 + (off + off.T if kind == "tensor" else off) / 2 * (relative or 0.01))
    )
    if kind == "moments":
        near = near[list(data.draw(st.permutations(range(3))))]
    unit, per = data.draw(st.sampled_from(sorted(UNITS.items())))
    style = data.draw(st.sampled_from(["{:.17g}", "-(-({:.17g}))", "({:.17g})*sqrt(4)/2"]))
    behind = f"{tree(near * per, style)} {unit}".replace("'", "")
    answer = data.draw(st.sampled_from([tree(near * per, f"{style} {unit}"), behind, tree(near, style)]))
    assert judged(item, answer).verdict == "correct"


CHANGES: dict[str, Callable[[Floats], Floats]] = {
    "another order": lambda values: np.roll(values, 1, axis=-1),
    "another sign": lambda values: -values,
    "zeros": np.zeros_like,
    "half": lambda values: values / 2,
    "a power of ten": lambda values: values * 10,
}


@settings(max_examples=60, deadline=None)
@given(keys(), st.sampled_from(["one entry off", *CHANGES]), st.data())
def test_wrong_is_never_right(made: tuple[str, Floats], change: str, data: st.DataObject) -> None:
    kind, values = made
    answer = values.copy() if change == "one entry off" else CHANGES[change](values).copy()
    largest = np.abs(values).max()
    if change == "one entry off":
        place = tuple(data.draw(st.integers(0, size - 1)) for size in values.shape)
        answer[place] += data.draw(st.floats(0.011, 100)) * (abs(values[place]) or largest)
    limits = 0.0101 * np.where(values == 0, largest, np.abs(values))
    orders = [list(order) for order in itertools.permutations(range(3))] if kind == "moments" else [...]
    assume(not any((np.abs(answer[order] - values) <= limits).all() for order in orders))
    outcome = judged(asked({"kind": kind, "answer": tree(values, "{!r} m")}), tree(answer, "{:.17g}"))
    assert outcome.verdict in ("partial", "incorrect")
    assert outcome.share < 1
    assert change != "zeros" or outcome.share == 0
    assert not any(finding.detail for finding in outcome.findings)
