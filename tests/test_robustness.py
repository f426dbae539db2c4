"""Whatever stands in a document: an exit code of the contract, whole JSON or nothing, never a traceback."""

from __future__ import annotations

import copy
import json
from functools import cache
from typing import Any, NoReturn

import numpy as np
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from rigidcli.bodies.composites import Composite, KnownTensor
from rigidcli.bodies.points import PointMasses
from rigidcli.bodies.shapes import SHAPES
from rigidcli.document.document import Document
from rigidcli.document.motion import Motion, Tide, Top
from rigidcli.document.phase_space import Transform
from rigidcli.document.system import Orbit, Particle, System
from rigidcli.document.yaml_reader import read_tree
from rigidcli.fields.section import Section
from tests.tables import rows_of

from .conftest import ROOT, Program

BOUNDED = settings(
    derandomize=True,
    phases=[Phase.explicit, Phase.generate],  # to shrink a failure takes a minute
    # `program` gives the streams anew for every run: one of it serves all examples.
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


def judge(program: Program, text: str, *options: str, command: str = "axes") -> None:
    """Run a command with `-f json` on a text, and hold the outcome against the contract."""
    outcome = program(command, "-f", "json", "-", *options, stdin=text)
    assert outcome.code in (0, 3, 4)
    assert "Traceback" not in outcome.err
    assert all(line.isprintable() for line in outcome.err.split("\n"))
    if outcome.code:
        assert outcome.err
        assert outcome.out == ""
    else:
        assert outcome.out.endswith("}\n")
        result = json.loads(outcome.out, parse_constant=refuse)
        assert result["schema"] == f"rigidcli.{command}/1"
        if command == "axes":
            judge_result(result)


def refuse(constant: str) -> NoReturn:
    raise AssertionError(f"{constant} in JSON")


def judge_result(result: dict[str, Any]) -> None:
    """What holds for every body there is."""
    if isinstance(result["moments"][0], str):
        return
    moments, axes, tensor = (np.array(result[key]) for key in ("moments", "axes", "tensor"))
    scale = moments[2] or 1.0
    slack = 1e-9 * scale
    assert moments[0] >= 0
    assert list(moments) == sorted(moments)
    assert moments[2] <= moments[0] + moments[1] + slack
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(axes @ (tensor / scale) @ axes.T, np.diag(moments / scale), atol=1e-9)


# --- documents of configs/, changed in a few places


def parts_of(tree: Any) -> list[tuple[Any, Any]]:
    """Every place in a tree: its container, and the key or index there."""
    if isinstance(tree, dict):
        inner = list(tree.items())
    elif isinstance(tree, list):
        inner = list(enumerate(tree))
    else:
        return []
    return [place for key, value in inner for place in ((tree, key), *parts_of(value))]


MODELS: list[type[Section]] = [Document, Motion, System, Orbit, Transform, Particle, Top, Tide]
MODELS += [*SHAPES.values(), PointMasses, Composite, KnownTensor]
KEYS = sorted({key for model in MODELS for key in model.model_fields} | {"euler", "quaternion", "a", "m"})
NUMBERS = st.one_of(
    st.integers(-3, 30),
    st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from([0, -0.0, 1e-300, 5e-324, 1e-50, 1e50, 1e150, 1e308, -1, 10**400, 0.1 + 0.2]),
)
WORDS = """com origin body principal cube corner nan inf 1_000 0x10 zxz cloud.csv /dev/zero .. sin t (((
    5cm pi/6 a 2*a a/0 -a sqrt(-1) 9**9**9 \x1b[31m"""
QUANTITIES = ["5 cm", "30 deg", "1800 rpm", "2.7 g/cm^3", "3 s", "1e999 m", "1e-400 m", "5 furlong"]
TEXTS = st.sampled_from([*WORDS.split(), *QUANTITIES, ""]) | st.text(max_size=6)
SCALARS = NUMBERS | TEXTS | st.booleans()
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(KEYS), inner, max_size=3),
    max_leaves=6,
)
NUMERIC = ["cone_top", "cube_corner", "flywheel", "known_tensor", "three_masses", "triangular_plate", "water"]
MOVING = ["tennis_racket", "feynman_plate", "openstax_gyroscope", "top_looping", "top_sleeping", "earth"]
SYSTEMS = rows_of(__file__, "systems")


@cache
def config(name: str) -> Any:
    return read_tree((ROOT / f"configs/{name}.yaml").read_text(), name)


@st.composite
def changed(draw: st.DrawFn, names: list[str]) -> Any:
    """A document of configs/ with one to three values replaced, removed, repeated or renamed."""
    tree = copy.deepcopy(config(draw(st.sampled_from(names))))
    for _ in range(draw(st.integers(1, 3))):
        container, key = draw(st.sampled_from(parts_of(tree) or [({}, "x")]))
        match draw(st.sampled_from(["replace", "replace", "remove", "repeat", "rename"])):
            case "replace":
                container[key] = draw(VALUES)
            case "remove" if key in container or isinstance(container, list):
                del container[key]
            case "repeat" if isinstance(container, list):
                container.append(copy.deepcopy(container[key]))
            case "rename" if isinstance(container, dict) and key in container:
                container[draw(st.sampled_from(KEYS))] = container.pop(key)
            case _:
                pass
    return tree


@settings(BOUNDED, max_examples=100)
@given(tree=changed(NUMERIC))
def test_changed_documents(tree: Any, program: Program) -> None:
    judge(program, json.dumps(tree))


@settings(BOUNDED, max_examples=60)
@given(tree=changed(MOVING), command=st.sampled_from(["precess", "euler"]))
def test_changed_motions(tree: Any, command: str, program: Program) -> None:
    judge(program, json.dumps(tree), "-s", "motion.samples=11", command=command)


@settings(BOUNDED, max_examples=60)
@given(tree=changed(SYSTEMS))
def test_changed_systems(tree: Any, program: Program) -> None:
    judge(program, json.dumps(tree), "-s", "orbit=null", command="hamilton")


# --- bodies of any shape with any numbers


LENGTHS = st.floats(1e-50, 1e50) | st.floats(1e-3, 1e3) | st.sampled_from([1, 2, "5 cm", "1e-40 m", 1e50])


@st.composite
def placed_shape(draw: st.DrawFn) -> dict[str, Any]:
    name = draw(st.sampled_from(sorted(SHAPES)))
    body: dict[str, Any] = {
        "shape": name,
        draw(st.sampled_from(["mass", "density"])): draw(st.floats(1e-60, 1e60)),
    }
    for key, field in SHAPES[name].model_fields.items():
        if not field.is_required() or key == "shape":
            continue
        count = {"size": 2 if name == "plate" else 3, "semi_axes": 2 if "cyl" in name else 3, "base": 2}.get(
            key, 0
        )
        if key == "vertices":
            vertex = st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3)
            least = {"tetrahedron": 4, "triangle": 3}.get(name)
            body[key] = draw(st.lists(vertex, min_size=least or 3, max_size=least or 6))
        else:
            body[key] = draw(st.lists(LENGTHS, min_size=count, max_size=count)) if count else draw(LENGTHS)
    if draw(st.booleans()):
        body["position"] = draw(st.lists(st.floats(-1e20, 1e20), min_size=3, max_size=3))
    if draw(st.booleans()):
        body["axis"] = draw(st.lists(st.floats(-1e160, 1e160), min_size=3, max_size=3))
    return body


@st.composite
def any_body(draw: st.DrawFn) -> dict[str, Any]:
    body = draw(placed_shape())
    if draw(st.integers(0, 3)) == 0:
        parts = [body, draw(placed_shape())]
        parts[1]["hole"] = draw(st.booleans())
        body = {"parts": parts}
    omega = draw(st.lists(st.floats(-1e160, 1e160), min_size=3, max_size=3))
    about = draw(
        st.sampled_from(["origin", "com"]) | st.lists(st.floats(-1e50, 1e50), min_size=3, max_size=3)
    )
    return {"body": body, "about": about, "motion": {"omega": omega}}


@settings(BOUNDED, max_examples=50)
@given(tree=any_body())
def test_bodies_of_any_size(tree: dict[str, Any], program: Program) -> None:
    judge(program, json.dumps(tree))


# --- trees and texts of any kind


@settings(BOUNDED, max_examples=25)
@given(tree=st.dictionaries(st.sampled_from(KEYS), VALUES, max_size=5))
def test_random_trees(tree: dict[str, Any], program: Program) -> None:
    judge(program, json.dumps(tree))


@settings(BOUNDED, max_examples=25)
@given(
    text=st.text(max_size=100)
    | st.text(st.sampled_from("bodyshapecube:{}[],-\n\t 1.\"'#&*!|>%@"), max_size=80)
)
def test_random_texts(text: str, program: Program) -> None:
    judge(program, text)


@settings(BOUNDED, max_examples=20)
@given(
    path=st.lists(
        st.sampled_from(["body", "points", "parts", "0", "1", "-1", "mass", "parameters", "é"]), max_size=4
    ),
    value=VALUES,
)
def test_random_settings(path: list[str], value: object, program: Program) -> None:
    setting = f"{'.'.join(['body', *path])}={json.dumps(value)}"
    judge(program, json.dumps(config("three_masses")), "--set", setting)
