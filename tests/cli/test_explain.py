"""`explain`: everything has a page of at most 80 columns, made of what the program itself is made of."""

from __future__ import annotations

from rigidcli.bodies.shapes import SHAPES
from rigidcli.check.base import CODES
from rigidcli.errors import EXIT_CODES, RigidError
from rigidcli.fields.units import TABLE
from rigidcli.language.functions import FUNCTIONS
from rigidcli.reference import index, keys
from rigidcli.studies.results import RESULTS
from tests.conftest import Program
from tests.shapes import DIMENSIONS


def everything() -> list[str]:
    paths = [*index.TOPICS, *SHAPES, *(".".join(key.path) for key in keys.every())]
    paths += [f"{command}.{field.key}" for command, fields in RESULTS.items() for field in fields]
    return [
        *paths,
        *(names.split()[0] for names, *_ in TABLE),
        *CODES,
        *RESULTS,
        *FUNCTIONS,
    ]


def test_everything_has_a_page_that_fits() -> None:
    for path in everything():
        page = index.explain(path)
        assert page.count("\n") > 1, path
        assert all(len(line) <= 80 and line == line.rstrip() for line in page.splitlines()), page
    assert all(len(line) <= 80 for line in index.overview().splitlines())


def test_a_result_that_refers_to_another_says_to_which() -> None:
    for command, fields in RESULTS.items():
        for field in fields:
            if field.title.startswith("its ") or field.title.endswith(" besides"):
                assert field.means, f"{command}.{field.key}"


def test_every_column_of_a_motion_is_explained(program: Program) -> None:
    """The heads of the csv file, those of a top included."""
    header = program("euler", "configs/top_looping.yaml", "-f", "csv", "-q").out.partition("\n")[0]
    for column in header.split(","):
        assert "euler.trajectory." in index.explain(column) or column in "tT"


def test_every_key_is_told_what_it_holds() -> None:
    for key in keys.every():
        assert keys.summary(key).strip(), key.path
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
