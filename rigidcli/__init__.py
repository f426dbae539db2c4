"""Rigid-body and Hamiltonian mechanics: documents in, inertia tensors, principal axes and motion out.

    import rigidcli

    document = rigidcli.load("configs/cube_corner.yaml")
    result = rigidcli.axes(document)
    result["moments"]        # array([ 2., 11., 11.])

`load` and `loads` read documents, `inertia`, `axes`, `precess`, `euler` and `hamilton` answer them with a
report, which maps the fields of the JSON output to floats, numpy arrays, texts and exact expressions
(`rigidcli.symbolic.algebra.expressions.Expr`). Problems are raised as `rigidcli.errors.RigidError`.
"""

from __future__ import annotations

TYPE_CHECKING = False
"""As in `typing`, which would take longer to load than all else before the program can be interrupted."""

__version__ = "0.1.0"

STUDIES = ("inertia", "axes", "precess", "euler", "hamilton")
"""The studies: each is the function `run` of a module in `rigidcli.studies`, and a command of that name."""

__all__ = ["STUDIES", "__version__", "load", "loads", *STUDIES]

if TYPE_CHECKING:
    from collections.abc import Callable

    from rigidcli.model.load import load, loads
    from rigidcli.report import Report


def __getattr__(name: str) -> Callable[..., Report]:
    """Load a function of the package when it is first asked for: `--help` needs none of them."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    place, function = ("studies." + name, "run") if name in STUDIES else ("model.load", name)
    loaded: Callable[..., Report] = getattr(import_module(f"rigidcli.{place}"), function)
    return loaded
