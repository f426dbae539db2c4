"""What the pictures of results show: lines, faces and labels, worked out only when a picture is asked for."""

from __future__ import annotations

from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING

from rigidcli.errors import RigidError, UsageError

if TYPE_CHECKING:
    from rigidcli.picture import Picture

BEST = "best"
"""Asks for the first kind of picture that a result has something for."""

ANY = "any"
"""Asks for the best picture where there is one, and for none where there is nothing to draw."""

KINDS: dict[str, dict[str, str]] = {
    "inertia": {"body": "pictures.bodies"},
    "axes": {"body": "pictures.bodies"},
    "precess": {
        "potential": "pictures.precess",
        "trace": "pictures.precess",
        "polhode": "pictures.precess",
    },
    "euler": {"omega": "euler.pictures", "polhode": "euler.pictures", "trace": "euler.pictures"},
    "hamilton": {
        "phase": "hamilton.pictures",
        "modes": "hamilton.pictures",
        "spectrum": "hamilton.pictures",
        "series": "hamilton.pictures",
    },
}
"""The kinds of pictures of each command, the best first, and the module of `studies` with a function of that
name, which raises UsageError where a result has nothing to show in that way."""


def require_kind(command: str, kind: str) -> None:
    """Raise UsageError unless this command has pictures of this kind."""
    known = KINDS[command]
    if kind != BEST and kind not in known:
        raise UsageError(f"`{kind}` is no picture here", hint=f"the pictures are {', '.join(known)}")


def drawn(command: str, kind: str | None, *result: object) -> tuple[Picture, ...]:
    """The picture of this kind of what a study has found; none where the kind is None, or ANY finds none.

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
    for name in KINDS[command] if kind == BEST else (kind,):
        module = import_module(f"rigidcli.studies.{KINDS[command][name]}")
        try:
            picture: Picture = getattr(module, name)(*result)
        except UsageError as error:
            reasons.append(f"{name}: {error.message}")
        else:
            return (picture,)
    raise UsageError(f"there is nothing to draw ({'; '.join(reasons)})")
