"""The studies as functions of documents, for `import rigidcli`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from importlib import import_module
from inspect import cleandoc
from typing import Any, TypeVar

from rigidcli.document.sources import MAPPING, Source, read
from rigidcli.errors import DocumentError
from rigidcli.result import Result

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
    progress: Callable[[float], None] | None = None,
) -> Result:
    """Motion by Euler's equations: omega, L, T and orientation in time; stability of the axes.

    COMMON
    progress : callable
        It is called with the fraction that is done.

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
    options = {"steps": steps, "picture": picture, "progress": progress}
    return _answer("euler", document, exact, settings, options, {"scene": True})


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
) -> Result:
    """From a Lagrangian to momenta, the Hamiltonian, Hamilton's equations and orbits in phase space.

    COMMON
    invariants : bool
        Search for conserved quantities also where that takes longer.
    program : bool
        Keep the equations as `program`, for the formats python, c and julia.
    progress : callable
        It is called with the fraction of the orbit that is done.

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
    options |= {"invariants": invariants, "progress": progress}
    return _answer("hamilton", document, exact, settings, options, {"scene": True})


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
        document = read(source, exact, settings)
        run = import_module(f"rigidcli.studies.{study}").run
        report = run(document, **options)
    except DocumentError as error:
        if any(problem.source.startswith(MAPPING) for problem in error.problems):
            raise DocumentError([replace(problem, line=None) for problem in error.problems]) from None
        raise
    again = None if document.ensemble is not None else partial(run, document, **(seen or {}))
    return Result(**{part.name: getattr(report, part.name) for part in fields(report)}, _again=again)
