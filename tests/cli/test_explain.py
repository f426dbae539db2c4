"""`explain`: everything has a page of at most 80 columns, made of what the program itself is made of."""

from __future__ import annotations

import pytest

from rigidcli.bodies.shapes import SHAPES
from rigidcli.errors import EXIT_CODES, RigidError
from rigidcli.fields.units import TABLE
from rigidcli.language.functions import FUNCTIONS
from rigidcli.reference import index, keys, tables
from rigidcli.reference.fields import said
from tests.conftest import Program
from tests.shapes import DIMENSIONS


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ("", ["document", "shapes", "units", "functions", "results", "mistakes", "exit-codes"]),
        ("document", ["body", "about", "system", "orbit"]),
        ("body", ["box, cube", "With `points`", "given_about", "position"]),
        ("body.shape", [*SHAPES]),
        ("body.shape.cone", ["opening to +z", "radius", "base  (0, 0, height)"]),
        ("cylinder", ["base  (0, 0, -height/2)"]),
        ("plate", ["corner  (-x/2, -y/2, 0)", "size: [x, y]"]),
        ("body.parts.0.radius", ["a positive length (m)", "needed"]),
        ("radius", ["sphere", "cone", "ring"]),
        ("motion.omega", ["Angular velocity at t = 0 (rad/s)", "a list of 3"]),
        ("motion.torque", ["With `body`", "With `space`", "With `gravity`"]),
        ("orbit.method", ["auto or symplectic", "default  auto"]),
        ("top.gravity", ["9.80665", "(m/s^2)"]),
        ("questions.kind", ["trajectory"]),
        ("rpm", ["0.10471975512 rad/s", "angular velocity"]),
        ("km/h", ["0.277777777778 m/s"]),
        ("units", ["length (m)", "in, ft", "micron"]),
        ("atan2", ["atan2(y, x)", "-pi to pi"]),
        ("axes.groups", ["indices of equal moments"]),
        ("groups", ["axes.groups"]),
        ("inertia", ["tensor_com", "(kg m^2)"]),
        ("precess.top", ["top.gyroscopic_rate", "(rad/s)"]),
        ("precess.top.gyroscopic_rate", ["LaTeX", "rad/s"]),
        ("angular_momentum", ["axes.angular_momentum", "euler.angular_momentum", "kg m^2/s"]),
        ("sign_error", ["has the wrong sign"]),
        ("mistakes", ["products_of_inertia_sign", "unit_missing"]),
        ("exit-codes", [f"{code}" for code in EXIT_CODES]),
    ],
)
def test_a_page_tells_what_something_is(path: str, told: list[str], program: Program) -> None:
    outcome = program("explain", *([path] if path else []))
    assert (outcome.code, outcome.err) == (0, "")
    missing = [words for words in told if words not in outcome.out]
    assert not missing, outcome.out


@pytest.mark.parametrize(
    ("path", "guess"),
    [
        ("axes.grups", "axes.groups"),
        ("body.pionts", "body.points"),
        ("body.shape.cnoe", "body.shape.cone"),
        ("motoin", "motion"),
        ("motion.omga", "motion.omega"),
        ("funtions", "functions"),
        ("xyzzy", None),
        ("", None),
        ("a..b", None),
        ("\x1b[31m", None),
    ],
)
def test_what_is_unknown_gets_a_guess(path: str, guess: str | None, program: Program) -> None:
    outcome = program("explain", path)
    assert (outcome.code, outcome.out) == (2, "")
    assert (f"did you mean {guess}?" in outcome.err) == (guess is not None)
    assert "`rigidcli explain` lists" in outcome.err


def everything() -> list[str]:
    paths = [*index.TOPICS, *SHAPES, *(".".join(key.path) for key in keys.every())]
    paths += [f"{command}.{field.key}" for command, fields in tables.results().items() for field in fields]
    return [
        *paths,
        *(names.split()[0] for names, *_ in TABLE),
        *tables.mistakes(),
        *tables.results(),
        *FUNCTIONS,
    ]


def test_everything_has_a_page_that_fits() -> None:
    for path in everything():
        page = index.explain(path)
        assert page.count("\n") > 1, path
        assert all(len(line) <= 80 and line == line.rstrip() for line in page.splitlines()), page
    assert all(len(line) <= 80 for line in index.overview().splitlines())


def test_a_result_that_refers_to_another_says_to_which() -> None:
    for command, fields in tables.results().items():
        for field in fields:
            if field.title.startswith("its ") or field.title.endswith(" besides"):
                assert field.means, f"{command}.{field.key}"


@pytest.mark.parametrize(
    ("column", "result"), [("Ixy", "tensor"), ("e1x", "axes"), ("lambda2", "moments"), ("w3", "omega")]
)
def test_a_column_is_explained_by_its_result(column: str, result: str) -> None:
    assert f"axes.{result}" in index.explain(column)


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("q0", ["euler.trajectory.orientation", "scalar", "`motion.torque`"]),
        ("ux", ["`motion.torque`", "e3"]),
        ("w2", ["euler.trajectory.omega", "axes.omega", "`motion.torque`"]),
        ("Lz", ["euler.trajectory.angular_momentum_space", "space"]),
        ("phi", ["euler.trajectory.angles", "rad"]),
        ("A_GHz", ["rotational_constants_ghz.A", "GHz"]),
    ],
)
def test_columns_and_variables_of_torques_are_explained(name: str, told: list[str]) -> None:
    page = index.explain(name)
    for words in told:
        assert words in page


def test_every_column_of_a_motion_is_explained(program: Program) -> None:
    """The heads of the csv file, those of a top included."""
    header = program("euler", "configs/top_looping.yaml", "-f", "csv", "-q").out.partition("\n")[0]
    for column in header.split(","):
        assert "euler.trajectory." in index.explain(column) or column in "tT"


def test_every_key_is_told_what_it_holds() -> None:
    for key in keys.every():
        assert key.field is not None
        assert said(key.field).strip(), key.path
    for shape in SHAPES.values():
        assert set(shape.dimensions()) == {
            entry.split(":")[0].strip() for entry in _keys(DIMENSIONS[shape.word()])
        }


def _keys(dimensions: str) -> list[str]:
    """`size: [1, 2], height: 3` -> its keys."""
    from rigidcli.document.syntax import read_tree

    return list(read_tree(f"{{{dimensions}}}", ""))


def test_exit_codes_are_those_of_the_errors() -> None:
    kinds, codes = [RigidError], set()
    while kinds:
        kind = kinds.pop()
        kinds += kind.__subclasses__()
        codes.add(kind.exit_code)
    assert codes <= set(EXIT_CODES)


# --- help
