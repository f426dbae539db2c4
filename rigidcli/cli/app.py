"""The program `rigidcli`: its commands, and its exit code where an error reaches the top."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Annotated, NoReturn

import typer

from rigidcli import STUDIES, __version__
from rigidcli.cli.help import Command, Commands
from rigidcli.cli.output import LESS, complain
from rigidcli.errors import ComputationError, Problem, printable

COMMANDS = (*STUDIES, "check", "validate", "explain", "schema", "new")
"""The commands: each is a function in a module of this package that has its name."""

app = typer.Typer(
    name="rigidcli",
    cls=Commands,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for _name in COMMANDS:
    app.command(cls=Command)(getattr(import_module(f"rigidcli.cli.{_name}"), _name))


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
    """Inertia, principal axes, precession, motion and Hamiltonians, from YAML.

    Begin with `rigidcli new -o cube.yaml` and `rigidcli axes cube.yaml`; `rigidcli explain` tells what
    may stand in a document.
    """


def main() -> NoReturn:
    """Run the program on the command line; the process ends with its exit code.

    Raises KeyboardInterrupt when it is interrupted.
    """
    try:
        app(prog_name="rigidcli")
    except (Exception, SystemExit) as error:  # a traceback tells a user nothing
        if _interrupted(error):
            raise KeyboardInterrupt from error
        if isinstance(error, SystemExit):
            # A reader of the help who closes the pipe early is no failure, though typer calls it one.
            sys.exit(0 if isinstance(error.__context__, BrokenPipeError) else error.code)
        if isinstance(error, MemoryError):
            complain(str(Problem("rigidcli", "there is too little memory", hint=LESS)))
            sys.exit(ComputationError.exit_code)
        complain(
            f"rigidcli: internal error, please report it: {type(error).__name__}: {printable(str(error))}"
        )
        sys.exit(ComputationError.exit_code)
    sys.exit(0)


def _interrupted(error: BaseException | None) -> bool:
    """Whether an interrupt caused an error; an import that is interrupted may raise another one."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
