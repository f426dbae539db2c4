"""The commands that print starters, schemas and explanations: `new`, `schema` and `explain`."""

from __future__ import annotations

import re
import shlex
from enum import StrEnum
from importlib import resources
from typing import Annotated

import typer

from rigidcli.cli.failures import Failures, complain
from rigidcli.cli.options import OutputPath
from rigidcli.cli.output import Output, is_file
from rigidcli.errors import Problem, UsageError, shown
from rigidcli.fields.texts import ending
from rigidcli.sandbox import usable_cores

Kind = StrEnum(
    "Kind",
    "shape points parts section tensor density mesh molecule robot symbols motion free driven top planet "
    "system oscillations assignment answers gradescope",
)
"""The starters: files of that name in `rigidcli/starters`, mostly with the ending `.yaml`."""

GALLERY = "gallery"
"""The word for pages of all examples, in place of a starter."""

ENDINGS = {Kind.molecule: ".xyz", Kind.robot: ".urdf", Kind.gradescope: ".sh"}
"""The endings of the starters that are no YAML."""


def _kind(typed: str) -> str:
    """The kind of this name. Raises BadParameter for another word, with the kind that is meant."""
    if typed in (*Kind, GALLERY):
        return typed
    from rigidcli.bodies.shapes import SHAPES
    from rigidcli.errors import did_you_mean, nearest
    from rigidcli.fields.words import SHAPES_BY_WORD, STARTERS, folded

    word = folded(typed)
    shape = word if word in SHAPES else SHAPES_BY_WORD.get(word, (None,))[0]
    near = STARTERS.get(word, ("shape" if shape else nearest(word, list(Kind)),))[0]
    message = f"read {shown(typed)}, expected one of {', '.join((*Kind, GALLERY))}{did_you_mean(near)}"
    if shape is not None and near == "shape":
        message += f"; write `rigidcli new shape`, and in it `shape: {shape}`"
    if ending(typed) in (".yaml", ".yml", ".urdf", ".xyz"):
        message += f"; the name of a file stands after `-o`: `rigidcli new -o {typed}`"
    raise typer.BadParameter(message)


def new(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            help=f"One of {', '.join((*Kind, GALLERY))}.",
            parser=_kind,
            autocompletion=lambda: [*Kind, GALLERY],
        ),
    ] = Kind.shape,
    output: OutputPath = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file PATH.")] = False,
) -> None:
    """Print a commented file to start from.

    A document of some kind, a robot, a molecule, an assignment, an answer file, or Gradescope's autograder.
    `gallery -o FOLDER/` writes a page for each example, and an index with pictures.

    Example: rigidcli new top -o top.yaml
    """
    if kind == GALLERY:
        failures = Failures()
        with failures.of("new gallery"):
            if output is None:
                raise UsageError("it writes many pages", hint="`rigidcli new gallery -o FOLDER/`")
            from rigidcli.cli.gallery import write_gallery

            write_gallery(output, usable_cores())
        raise typer.Exit(failures.code)
    if output is not None and is_file(output) and not force:
        hint = "`--force` overwrites it"
        complain(str(Problem(output, "the file exists, and is not overwritten", hint=hint)))
        raise typer.Exit(UsageError.exit_code)
    starter = resources.files("rigidcli").joinpath("starters", kind + ENDINGS.get(Kind(kind), ".yaml"))
    text = starter.read_text(encoding="utf-8")
    with Output(output) as target:
        target.write(text)
    if output is not None and is_file(output):
        command = _COMMAND.search(text)
        following = f"; next: {_FILE.sub(lambda _: shlex.quote(output), command[0])}" if command else ""
        complain(f"wrote {output}{following}")


_COMMAND = re.compile(r"rigidcli [a-z]+(?: -[-a-z]+)* FILE[.a-z]*")
"""The first command that a starter names for itself."""

_FILE = re.compile("FILE[.a-z]*")
"""The name of the starter's own file in that command."""


SchemaKind = StrEnum("SchemaKind", "document assignment answers")
"""The kinds of files that have a schema."""


def schema(
    kind: Annotated[
        SchemaKind, typer.Argument(metavar="KIND", help=f"One of {', '.join(SchemaKind)}.")
    ] = SchemaKind.document,
    output: OutputPath = None,
) -> None:
    """Print the JSON Schema of a kind of file, for editors.

    Example: rigidcli schema -o .rigidcli.schema.json
    """
    import orjson

    from rigidcli.reference.entries import WRITTEN_FILES
    from rigidcli.reference.schema import json_schema

    _, root = WRITTEN_FILES[kind]
    with Output(output) as target:
        target.write(orjson.dumps(json_schema(root), option=orjson.OPT_INDENT_2).decode() + "\n")


def explain(
    path: Annotated[
        str | None,
        typer.Argument(
            metavar="PATH", help="A key, shape, unit, function, result or mistake.", show_default=False
        ),
    ] = None,
) -> None:
    """Explain a key, shape, unit, function, result or mistake.

    Example: rigidcli explain body.shape.cone
    """
    from rigidcli.reference.pages import explain as page
    from rigidcli.reference.pages import overview

    failures = Failures()
    with failures.of("explain"), Output(None) as target:
        target.write(overview() if path is None else page(path))
    raise typer.Exit(failures.code)
