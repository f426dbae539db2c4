"""`--plot` and `--plot-kind`: the picture that is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rigidcli.cli.failures import bad_parameter
from rigidcli.cli.output import require_apart
from rigidcli.errors import UsageError
from rigidcli.render import Traits


def picture_kind(
    command: str,
    traits: Traits,
    path: str | None,
    kind: str | None,
    files: Sequence[str],
    output: str | None,
) -> str | None:
    """The kind of picture that is asked for, if one is; refused where it cannot be drawn or written."""
    if path is None and kind is None and not traits.page:
        return None
    from rigidcli.render.plots import CHARACTERS, require_ending, require_library, use_for
    from rigidcli.studies.pictures import ANY, BEST, require_kind

    with bad_parameter("--plot"):
        require_kind(command, kind or BEST)
        if path is None:
            if traits.page:
                return kind or ANY
            raise UsageError("`--plot-kind` chooses a picture", hint="say with `--plot` where it goes")
        require_ending(path)
        if len(files) > 1:
            raise UsageError("`--plot` draws one picture, of one FILE", hint="call it for each FILE")
        require_apart(path, files)
        if path != CHARACTERS and output is not None and Path(path).resolve() == Path(output).resolve():
            raise UsageError(f"`-o` writes the results to `{path}`", hint="give the picture another name")
        require_library(use_for(path))
    return kind or BEST
