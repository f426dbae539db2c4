"""The program `rigidcli`: its commands, and the last word on how it ends."""

from __future__ import annotations

import sys
from typing import Annotated, NoReturn

import typer

from rigidcli import __version__
from rigidcli.cli.axes import axes
from rigidcli.cli.check import check
from rigidcli.cli.euler import euler
from rigidcli.cli.hamilton import hamilton
from rigidcli.cli.inertia import inertia
from rigidcli.cli.new import new
from rigidcli.cli.output import complain
from rigidcli.cli.precess import precess
from rigidcli.cli.schema import schema
from rigidcli.cli.validate import validate
from rigidcli.errors import ComputationError, printable

COMMANDS = (inertia, axes, precess, euler, hamilton, check, validate, schema, new)

app = typer.Typer(
    name="rigidcli",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for _command in COMMANDS:
    app.command()(_command)


def _show_version(asked: bool) -> None:
    if asked:
        typer.echo(f"rigidcli {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit."),
    ] = False,
) -> None:
    """Inertia, principal axes, precession and motion of bodies described in YAML."""


def main() -> NoReturn:
    """Run the program on the command line; the process ends with its exit code.

    Raises KeyboardInterrupt when it is interrupted.
    """
    try:
        app(prog_name="rigidcli")
    except (Exception, SystemExit) as error:  # the last resort: a traceback tells a user nothing
        if _interrupted(error):
            raise KeyboardInterrupt from error
        if isinstance(error, SystemExit):
            # Nobody reads the help to its end: that is no failure, though typer calls it one.
            sys.exit(0 if isinstance(error.__context__, BrokenPipeError) else error.code)
        complain(
            f"rigidcli: internal error, please report it: {type(error).__name__}: {printable(str(error))}"
        )
        sys.exit(ComputationError.exit_code)
    sys.exit(0)


def _interrupted(error: BaseException | None) -> bool:
    """Whether an interrupt is behind an error, as it is where one hits a library that is being loaded."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
