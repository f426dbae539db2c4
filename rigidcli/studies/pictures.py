"""Pictures of results as data: lines, faces and labels, worked out when a picture is asked for."""

from __future__ import annotations

from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING

from rigidcli.commands import COMMANDS
from rigidcli.errors import RigidError, UsageError
from rigidcli.suggestions import guess

if TYPE_CHECKING:
    from rigidcli.picture import Picture

BEST = "best"  # asks for the first kind of picture that the result can be drawn as
ANY = "any"  # asks for the best picture, or for none where there is nothing to draw


def require_kind(command: str, kind: str) -> None:
    """Raise UsageError unless this command has pictures of this kind."""
    if kind != BEST and kind not in COMMANDS[command].pictures:
        hint = f"kinds of pictures here: {', '.join(COMMANDS[command].pictures)}"
        raise UsageError(f"`{kind}` is no picture here{guess(kind, COMMANDS[command].pictures)}", hint=hint)


def drawn(command: str, kind: str | None, *result: object) -> tuple[Picture, ...]:
    """The picture of this kind; none where the kind is None, or where ANY has nothing to draw.

    Raises UsageError where there is nothing to show, with all reasons.
    """
    if kind is None:
        return ()
    if kind == ANY:
        with suppress(RigidError):
            return drawn(command, BEST, *result)
        return ()
    require_kind(command, kind)
    reasons = []
    for name in COMMANDS[command].pictures if kind == BEST else (kind,):
        module = import_module(f"rigidcli.studies.{COMMANDS[command].pictures[name]}")
        try:
            picture: Picture = getattr(module, name)(*result)
        except UsageError as error:
            reasons.append(f"{name}: {error.message}")
        else:
            return (picture,)
    raise UsageError(f"there is nothing to draw ({'; '.join(reasons)})")
