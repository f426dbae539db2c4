"""What `import rigidcli` offers: the studies as functions of documents, and results that show themselves."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from importlib import import_module
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from rigidcli.errors import DocumentError, Problem, RigidError, UsageError
from rigidcli.report import Report, Table, single_cells

if TYPE_CHECKING:
    import pandas as pd

    from rigidcli.core.integrate import Engine
    from rigidcli.model.document import Document

Source: TypeAlias = "Document | Mapping[str, Any] | str | os.PathLike[str]"
"""A document, read already or not: what it says as a mapping, its text in YAML, or the path to its file."""

MAPPING = "<mapping>"
"""What messages call a document that was given as a mapping, which has no lines."""

_TEXT = re.compile(r"\n|:\s|\{")
"""What the text of a document has, and the path to a file has not."""

_COMMON = """Parameters
----------
document : Document, mapping, str or path
    What a document says as a mapping (arrays and exact expressions may stand in it), its text in YAML,
    the path to its file or to that of a body, such as a .csv, or what `rigidcli.load` has read.
exact : bool
    Exact arithmetic: decimals are rationals, and parameters without a value stay symbols.
settings : sequence of str
    Values to override, such as ``["body.mass=3"]``.
steps : bool
    Show the working, too.
picture : str
    Work out a picture of this kind, such as "polhode", or the "best" one; `Result.save_picture` writes it."""
"""What stands for COMMON in the help of the studies: the parameters that all of them have."""

_REST = """

Raises
------
rigidcli.RigidError
    The document is refused, which is a `rigidcli.DocumentError` whose `problems` have line, key,
    message and hint; or the result cannot be computed.
"""
"""What ends the help of the studies."""

_Function = TypeVar("_Function", bound=Callable[..., Any])


@dataclass(frozen=True, slots=True, repr=False)
class Result(Report):
    """The answer to a document: a mapping from the fields of the json output to their values.

    It shows itself as the table of the command line, in notebooks as the page: with formulas, the picture and
    the replay of a motion. `units` has the units of its fields, and `to_dataframe` makes a table for pandas.
    """

    _again: Callable[..., Report] | None = field(default=None, repr=False, compare=False)
    """Works the study out again, with what is only made to be seen; it stays behind when a result is sent."""

    def __reduce__(self) -> tuple[type[Result], tuple[Any, ...]]:
        return Result, tuple(getattr(self, part.name) for part in fields(Report))

    def __repr__(self) -> str:
        from rigidcli.render import Format, Look, renderer

        return "".join(renderer(Format.table)([self], Look(steps=True))).rstrip()

    def _repr_html_(self) -> str:
        from rigidcli.render import Look
        from rigidcli.render.html import fragment

        return fragment(self._as_seen(), Look(steps=True))

    def _repr_latex_(self) -> str:
        from rigidcli.render import Look
        from rigidcli.render.latex import formulas

        return formulas(self, Look())

    def to_dataframe(self, table: str | None = None) -> pd.DataFrame:
        """A table as a DataFrame of pandas, with the columns of csv; `attrs["units"]` has their units.

        Without a name, it is the trajectory or orbit, or else one row with the results. By its name it is
        another table, such as "stability" of `euler`. Raises UsageError where there is no such table, and
        where pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError:
            raise UsageError("pandas is not installed", hint="python -m pip install pandas") from None
        chosen = self._table(table)
        if chosen is None:
            cells = {
                name: (entry.value if entry.value is None or not place else entry.value[place], entry.unit)
                for entry in self.fields
                for name, place in entry.cells.items()
            }
            frame = pd.DataFrame({name: [value] for name, (value, _) in cells.items()}, index=[self.name])
            units = {name: unit for name, (_, unit) in cells.items() if unit}
        else:
            columns = single_cells(chosen)
            frame = pd.DataFrame({column.cells[0]: column.values for column in columns})
            units = {column.cells[0]: column.unit for column in columns if column.unit}
        frame.attrs["units"] = units
        return frame

    def save_picture(self, path: str | os.PathLike[str]) -> None:
        """Write the picture that was asked for to a file, .png, .svg or .pdf.

        Raises UsageError where there is none, for other endings, and without matplotlib.
        """
        from rigidcli.render.plots import picture_file, require_ending

        require_ending(os.fspath(path))
        if not self.pictures:
            raise UsageError("there is no picture here", hint='ask for one, as in axes(..., picture="best")')
        Path(path).write_bytes(picture_file(self, os.fspath(path)))

    def _as_seen(self) -> Report:
        """The result with what a page has: the scene of a motion, and a picture where there is one.

        They are worked out when they are to be seen, as most results never are. A result whose study cannot
        be worked again, as when a file of points is gone, is seen without them.
        """
        from rigidcli.render.plots import has_library
        from rigidcli.studies.pictures import ANY

        if self._again is None:
            return self
        try:
            seen = self._again(picture=ANY if has_library("drawing") else None)
        except RigidError:
            return self
        return replace(self, scene=seen.scene, pictures=self.pictures or seen.pictures)

    def _table(self, name: str | None) -> Table | None:
        """The table of this name; without a name that of the data, if there is one."""
        for table in self.tables:
            if table.key == name or (name is None and table.data):
                return table
        if name is None:
            return None
        known = ", ".join(f"`{table.key}`" for table in self.tables) or "none"
        raise UsageError(f"there is no table `{name}` here", hint=f"the tables are {known}")


def _study(function: _Function) -> _Function:
    """The function, its help completed with what all studies have in common."""
    function.__doc__ = cleandoc(function.__doc__ or "").replace("COMMON", _COMMON) + _REST
    return function


@_study
def inertia(
    document: Source,
    *,
    exact: bool = False,
    settings: Sequence[str] = (),
    steps: bool = False,
    picture: str | None = None,
) -> Result:
    """Mass, centre of mass, and the inertia tensor about a point.

    COMMON

    Returns
    -------
    Result
        `mass` (kg), `center_of_mass` (3, m), `about` (3, m), `tensor` (3 by 3, kg m^2) about that point, and
        `tensor_com` about the centre of mass. Products of inertia are -sum m x y.

    Examples
    --------
    >>> rigidcli.inertia({"body": {"shape": "cube", "side": 1, "mass": 12}})["mass"]
    12.0
    """
    return _answer("inertia", document, exact, settings, {"steps": steps, "picture": picture})


@_study
def axes(
    document: Source,
    *,
    exact: bool = False,
    settings: Sequence[str] = (),
    steps: bool = False,
    picture: str | None = None,
) -> Result:
    """Principal moments and axes, and L and T where the document has an angular velocity.

    COMMON

    Returns
    -------
    Result
        What `inertia` tells, and `moments` (3, kg m^2, ascending), `axes` (3 by 3, rows e1, e2, e3),
        `groups` of equal moments, `class`, `residual`; with `motion.omega` also `omega` (3, rad/s),
        `angular_momentum` (3, kg m^2/s), `kinetic_energy` (J), `angle` (rad) between omega and L, and
        `wobbles`. Of a molecule also `rotor`, `rotational_constants_ghz` and `rotational_constants_per_cm`,
        each with A, B and C (null where there is none), and `asymmetry_parameter`.

    Examples
    --------
    >>> rigidcli.axes("body: {shape: cube, side: 1, mass: 12, anchor: corner}")["class"]
    'prolate'
    """
    return _answer("axes", document, exact, settings, {"steps": steps, "picture": picture})


@_study
def precess(
    document: Source,
    *,
    exact: bool = False,
    settings: Sequence[str] = (),
    steps: bool = False,
    picture: str | None = None,
) -> Result:
    """Precession: of tops under gravity, of free bodies, and of planets by tides.

    COMMON

    Returns
    -------
    Result
        `top`, `free` and `tide`, as far as they apply: mappings of rates (rad/s), periods (s) and angles
        (rad).

    Examples
    --------
    >>> top = {"mass": 0.3, "distance": 0.05, "lambda3": 0.000375, "spin": "20 rps", "gravity": 9.8}
    >>> round(rigidcli.precess({"top": top})["top"]["gyroscopic_rate"], 2)
    3.12
    """
    return _answer("precess", document, exact, settings, {"steps": steps, "picture": picture})


@_study
def euler(
    document: Source,
    *,
    exact: bool = False,
    settings: Sequence[str] = (),
    steps: bool = False,
    picture: str | None = None,
    engine: Engine = "auto",
    progress: Callable[[float], None] | None = None,
    max_steps: int | None = None,
) -> Result:
    """Motion by Euler's equations: omega, L, T and orientation in time; stability of the axes.

    COMMON
    engine : {"auto", "runge-kutta", "taylor"}
        What integrates driven motion; "taylor" needs the extra of that name.
    progress : callable
        It is called with the fraction that is done.
    max_steps : int
        The most steps of an integration; by default 1,000,000.

    Returns
    -------
    Result
        `moments`, `axes`, `motion`, periods and rates, `stability`, `trusted_digits`, and `trajectory`
        with `t` (n, s), `omega` (n by 3, rad/s, along the document's body axes) and `orientation` (n by 4,
        quaternions from body to space, scalar first).

    Examples
    --------
    >>> body = {"moments": [1, 2, 3], "mass": 1}
    >>> result = rigidcli.euler({"body": body, "motion": {"omega": [0, 1e-3, 2], "duration": 10}})
    >>> result["motion"]
    'about_highest'
    """
    motion = {"engine": engine, "max_steps": max_steps}
    options = {"steps": steps, "picture": picture, "progress": progress, **motion}
    return _answer("euler", document, exact, settings, options, {"scene": True, **motion})


@_study
def hamilton(
    document: Source,
    *,
    exact: bool = False,
    settings: Sequence[str] = (),
    steps: bool = False,
    picture: str | None = None,
    invariants: bool = False,
    program: bool = False,
    progress: Callable[[float], None] | None = None,
    max_steps: int | None = None,
) -> Result:
    """From a Lagrangian to momenta, the Hamiltonian, Hamilton's equations and orbits in phase space.

    COMMON
    invariants : bool
        Search for conserved quantities also where that takes longer.
    program : bool
        Keep the equations as `program`, for the formats python, c and julia.
    progress : callable
        It is called with the fraction of the orbit that is done.
    max_steps : int
        The most steps of an integration; by default 1,000,000.

    Returns
    -------
    Result
        `lagrangian`, `momentum_definitions`, `hamiltonian`, `equations`, `conserved` and more: exact
        expressions, which `str()` writes and `evaluate(m=1, x=0.5)` turns into numbers; with an `orbit` its
        samples.

    Examples
    --------
    >>> system = {"coordinates": ["x"], "lagrangian": "m*xdot**2/2 - k*x**2/2"}
    >>> rigidcli.hamilton({"system": system, "parameters": {"m": None, "k": None}})["hamiltonian"]
    p_x**2/(2*m) + k*x**2/2
    """
    options: dict[str, Any] = {"steps": steps, "picture": picture, "program": program}
    options |= {"invariants": invariants, "progress": progress, "max_steps": max_steps}
    return _answer("hamilton", document, exact, settings, options, {"scene": True, "max_steps": max_steps})


def _answer(
    study: str,
    source: Source,
    exact: bool,
    settings: Sequence[str],
    options: Mapping[str, Any],
    seen: Mapping[str, Any] | None = None,
) -> Result:
    """The result of a study of this name with these options; with those of `seen` it is worked to be seen."""
    try:
        document = _read(source, exact, settings)
        run = import_module(f"rigidcli.studies.{study}").run
        report = run(document, **options)
    except DocumentError as error:
        if any(problem.source.startswith(MAPPING) for problem in error.problems):
            raise DocumentError([replace(problem, line=None) for problem in error.problems]) from None
        raise
    again = None if document.ensemble is not None else partial(run, document, **(seen or {}))
    return Result(**{part.name: getattr(report, part.name) for part in fields(report)}, _again=again)


def _read(source: Source, exact: bool, settings: Sequence[str]) -> Document:
    """The document itself."""
    from rigidcli.model.document import Document
    from rigidcli.model.files import load
    from rigidcli.model.load import loads

    if isinstance(source, Document):
        if exact or settings:
            raise UsageError(
                "the document has been read already", hint="give `exact` and `settings` to `load`"
            )
        return source
    if isinstance(source, Mapping):
        try:
            text = json.dumps(source, default=_plain)
        except (TypeError, ValueError, RecursionError) as error:
            raise DocumentError([Problem(MAPPING, f"cannot be read: {error}")]) from None
        if problems := list(_not_finite(json.loads(text))) if "NaN" in text or "Infinity" in text else ():
            raise DocumentError(problems)
        return loads(text, source=MAPPING, exact=exact, settings=settings)
    if isinstance(source, str) and _TEXT.search(source):
        return loads(source, exact=exact, settings=settings)
    return load(source, exact=exact, settings=settings)


def _not_finite(value: Any, path: str = "") -> Iterator[Problem]:
    """The problems of numbers that are none, in a value at the `path` of a mapping."""
    if isinstance(value, float) and not math.isfinite(value):
        yield Problem(MAPPING, f"read `{value}`, expected a finite number", key=path)
    entries = (
        value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    )
    for step, entry in entries:
        yield from _not_finite(entry, f"{path}.{step}" if path else str(step))


def _plain(value: Any) -> Any:
    """Arrays and other numbers as json has them; exact expressions, fractions and paths as text."""
    return (
        value.tolist()
        if hasattr(value, "tolist")
        else dict(value)
        if isinstance(value, Mapping)
        else str(value)
    )
