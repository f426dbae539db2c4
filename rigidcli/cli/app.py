"""The program `rigidcli`: its commands with their help, and its exit code where an error reaches the top."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup

from rigidcli import __version__
from rigidcli.cli.output import LESS, complain
from rigidcli.commands import COMMANDS
from rigidcli.errors import ComputationError, Problem, printable, shown


def _value(param: Any, validated: Callable[[Any, Any], Any], context: Any, given: Any) -> Any:
    """The value of an option or an argument; a default or a text is not `validated` by typer.

    It would build validators for that, and load pydantic, which takes 60 ms.
    """
    if given is None or given is param.default:
        is_valid = not param.required
    else:
        kind = getattr(param, "type_descriptor", None)  # older versions of typer have none
        is_valid = kind is not None and kind.annotation in (str, list[str]) and not kind.parameter_info.parser
    if not is_valid:
        return validated(context, given)
    value = () if given is None and param.multiple else list(given) if isinstance(given, tuple) else given
    return value if param.callback is None else param.callback(context, param, value)


class _Lean:
    """A command, or their group, that loads little."""

    def get_params(self, ctx: Any) -> list[Any]:
        """The arguments and options, `--help` and those that typer adds among them."""
        params: list[Any] = super().get_params(ctx)  # type: ignore[misc]  # of typer's class
        for param in params:
            if "process_value" not in vars(param):
                param.process_value = partial(_value, param, param.process_value)
        return params


class ManualCommand(_Lean, TyperCommand):
    """A command whose help has usage and arguments as manual pages have."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the arguments; errors are without the words that pydantic puts before them."""
        try:
            return super().parse_args(ctx, args)
        except typer.BadParameter as error:
            error.message = error.message.removeprefix("Value error, ")
            raise

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """The usage behind the command: options, then arguments, in brackets if they may be left out."""
        arguments = [param for param in self.params if isinstance(param, TyperArgument)]
        names = [_name(param) if param.required else f"[{_name(param)}]" for param in arguments]
        return ["[OPTIONS]", *names]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the meanings of arguments and options."""
        sections: dict[str, list[tuple[str, str]]] = {"Arguments": [], "Options": []}
        for param in self.get_params(ctx):
            if isinstance(param, TyperArgument):
                sections["Arguments"].append((_name(param), param.help or ""))
            elif (record := param.get_help_record(ctx)) is not None:
                sections.setdefault(getattr(param, "rich_help_panel", None) or "Options", []).append(record)
        for title, rows in sections.items():
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


def _name(argument: TyperArgument) -> str:
    return f"{argument.metavar or argument.name}{'...' if argument.nargs != 1 else ''}"


class Commands(_Lean, TyperGroup):
    """The commands, each loaded when it is used; a FILE without a command gets a hint."""

    def list_commands(self, ctx: Any) -> list[str]:
        """The names of the commands."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, name: str) -> Any:
        """The command of this name; None where there is none."""
        if name in COMMANDS and name not in self.commands:
            self.add_command(_command(name))
        return super().get_command(ctx, name)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The first of the `args` as a command. Ends the program, after the usage, where it is none."""
        if args and args[0] not in COMMANDS:
            if Path(args[0]).exists():
                ctx.fail(f"{shown(args[0])} is a file; a command stands before it: `rigidcli axes {args[0]}`")
            for name in COMMANDS:  # the message compares the word with all of them
                self.get_command(ctx, name)
        return super().resolve_command(ctx, args)


@cache
def _command(name: str) -> Any:
    """The command of this name. typer makes its options from the signature of its function."""
    module = import_module(f"rigidcli.cli.{COMMANDS[name].module or 'computing'}")
    alone = typer.Typer(add_completion=False, rich_markup_mode=None)
    run = module.command_of(name) if COMMANDS[name].needs else getattr(module, name)
    alone.command(cls=ManualCommand)(run)
    return typer.main.get_command(alone)


app = typer.Typer(
    name="rigidcli",
    cls=Commands,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


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

    Begin with `rigidcli new -o cube.yaml` and `rigidcli axes cube.yaml`; `rigidcli explain` says what
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
        said = f"{type(error).__name__}: {printable(str(error))}"
        complain(f"rigidcli: internal error, please report it: {said}")
        sys.exit(ComputationError.exit_code)
    sys.exit(0)


def _interrupted(error: BaseException | None) -> bool:
    """Whether an interrupt caused an error: an interrupted import may raise another one."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
