"""The help of a command, with arguments by the names that people give them: `FILE...`, without types."""

from __future__ import annotations

from typing import Any

from typer import BadParameter
from typer.core import TyperArgument, TyperCommand, TyperOption


class Option(TyperOption):
    """An option that takes no time where it is not given: typer builds a validator of pydantic for each."""

    def process_value(self, ctx: Any, value: Any) -> Any:
        """The value, checked; a default is as it is."""
        if self.required or not (value is None or value is self.default):
            try:
                return super().process_value(ctx, value)
            except BadParameter as error:
                error.message = error.message.removeprefix("Value error, ")
                raise
        value = () if value is None and self.multiple else value
        return value if self.callback is None else self.callback(ctx, self, value)


class Command(TyperCommand):
    """A command whose help has usage and arguments as manual pages have."""

    def __init__(self, *args: Any, **settings: Any) -> None:
        super().__init__(*args, **settings)
        for param in self.params:
            if type(param) is TyperOption:
                param.__class__ = Option

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """The usage behind the command: options, then arguments, in brackets if they may be left out."""
        return ["[OPTIONS]", *(name if needed else f"[{name}]" for name, needed, _ in self._arguments(ctx))]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write what arguments and options mean."""
        sections = {"Arguments": [(name, text) for name, _, text in self._arguments(ctx)], "Options": []}
        for param in self.get_params(ctx):
            if param.param_type_name == "option" and (record := param.get_help_record(ctx)) is not None:
                sections.setdefault(getattr(param, "rich_help_panel", None) or "Options", []).append(record)
        for title, rows in sections.items():
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
