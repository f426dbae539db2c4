"""The answer to a document as Python has it: a mapping that shows itself as a table, a page or a formula."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigidcli.errors import RigidError, UsageError
from rigidcli.report import Report
from rigidcli.suggestions import guess

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, slots=True, repr=False)
class Result(Report):
    """The answer to a document: a mapping from the fields of the json output to their values.

    A field is also an attribute, `result.moments`, unless it has the name of a method, or of a keyword.

    It shows itself as the table of the command line, in notebooks as the page: with formulas, the picture and
    the replay of a motion. `units` has the units of its fields, and `to_dataframe` makes a table for pandas.
    """

    # Repeats the study with pictures and the replay of a motion; it is not pickled.
    _again: Callable[..., Report] | None = field(default=None, repr=False, compare=False)

    def __getitem__(self, key: str) -> Any:
        tree = self.tree
        if key in tree:
            return tree[key]
        raise KeyError(f"{key}: no such result{guess(key, tree)}")

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name in Result.__dataclass_fields__:
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError as error:
            raise AttributeError(error.args[0]) from None

    def __dir__(self) -> list[str]:
        return sorted({*object.__dir__(self), *self})

    def __reduce__(self) -> tuple[type[Result], tuple[Any, ...]]:
        return Result, tuple(getattr(self, part.name) for part in fields(Report))

    def __repr__(self) -> str:
        from rigidcli.render import Format, Look, renderer

        return "".join(renderer(Format.table)([self], Look())).rstrip()

    def _repr_html_(self) -> str:
        from rigidcli.render import Look
        from rigidcli.render.html import fragment
        from rigidcli.render.plots import has_library
        from rigidcli.studies.pictures import ANY

        # The replay of a motion and a picture are made when they are seen: most results never are. A result
        # whose study cannot be repeated, for a file of points is gone, is seen without them.
        shown: Report = self
        if self._again is not None:
            with suppress(RigidError):
                seen = self._again(picture=ANY if has_library("drawing") else None)
                shown = replace(self, scene=seen.scene, pictures=self.pictures or seen.pictures)
        return fragment(shown, Look())

    def _repr_latex_(self) -> str:
        from rigidcli.render import Look
        from rigidcli.render.latex import formulas

        return formulas(self, Look())

    def to_dataframe(self) -> pd.DataFrame:
        """The columns of csv as a DataFrame of pandas; `attrs["units"]` has their units.

        It is the trajectory or orbit, or else one row with the results. Raises UsageError without pandas.
        """
        try:
            import pandas as pd
        except ImportError:
            raise UsageError("pandas is not installed", hint="python -m pip install pandas") from None
        from rigidcli.render import Look
        from rigidcli.render.parquet import piece

        cells = piece(self, Look())
        frame = pd.DataFrame(cells.columns)
        frame.attrs["units"] = dict(cells.units)
        return frame

    def save_picture(self, path: str | os.PathLike[str]) -> None:
        """Write the picture to a file, .png, .svg or .pdf: the one that was asked for, or else the best one.

        Raises RigidError where there is none, for other endings, and without matplotlib.
        """
        from rigidcli.render.plots import picture_file, require_ending
        from rigidcli.studies.pictures import BEST

        require_ending(os.fspath(path))
        seen = self if self.pictures or self._again is None else self._again(picture=BEST)
        if not seen.pictures:
            raise UsageError("there is no picture here")
        Path(path).write_bytes(picture_file(seen, os.fspath(path)))
