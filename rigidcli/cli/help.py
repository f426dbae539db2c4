"""The help of a command, with arguments by the names that people give them: `FILE...`, without types."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from typer.core import TyperArgument, TyperCommand, TyperGroup

from rigidcli.errors import shown


class Command(TyperCommand):
    """A command whose help has usage and arguments as manual pages have."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """What follows the command: options, then the arguments, in brackets those that may be left out."""
        return ["[OPTIONS]", *(name if needed else f"[{name}]" for name, needed, _ in self._arguments(ctx))]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write what arguments and options mean."""
        records = [
            record
            for param in self.get_params(ctx)
            if param.param_type_name == "option" and (record := param.get_help_record(ctx)) is not None
        ]
        arguments = [(name, text) for name, _, text in self._arguments(ctx)]
        for title, rows in (("Arguments", arguments), ("Options", records)):
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)

    def _arguments(self, ctx: Any) -> list[tuple[str, bool, str]]:
        """The arguments: name, whether it is needed, and what it means."""
        return [
            (
                f"{param.metavar or param.name}{'...' if param.nargs != 1 else ''}",
                param.required,
                param.help or "",
            )
            for param in self.get_params(ctx)
            if isinstance(param, TyperArgument)
        ]


class Commands(TyperGroup):
    """The commands; one that is forgotten before a FILE is told."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that `args` begin with. Ends the program, with its usage, where there is none."""
        if args and args[0] not in self.commands and Path(args[0]).exists():
            ctx.fail(f"{shown(args[0])} is a file; a command stands before it: `rigidcli axes {args[0]}`")
        return super().resolve_command(ctx, args)
