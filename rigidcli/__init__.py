"""Rigid-body and Hamiltonian mechanics: documents in, inertia tensors, principal axes and motion out.

    import rigidcli

    document = rigidcli.load("configs/cube_corner.yaml")
    result = rigidcli.axes(document)
    result["moments"]        # array([ 2., 11., 11.])

`load` and `loads` read documents, `inertia`, `axes`, `precess`, `euler` and `hamilton` answer them with a
report, which maps the fields of the JSON output to floats, numpy arrays, texts and trees of expressions
(`rigidcli.symbolic.language.text.text` makes texts of these). Problems are raised as
`rigidcli.errors.RigidError`.
"""

from __future__ import annotations

TYPE_CHECKING = False
"""As in `typing`, which takes longer to load than all there is before the program can be interrupted."""

__version__ = "0.1.0"

__all__ = ["__version__", "axes", "euler", "hamilton", "inertia", "load", "loads", "precess"]

if TYPE_CHECKING:
    from typing import Any

    from rigidcli.model.load import load, loads
    from rigidcli.studies.axes import run as axes
    from rigidcli.studies.euler import run as euler
    from rigidcli.studies.hamilton import run as hamilton
    from rigidcli.studies.inertia import run as inertia
    from rigidcli.studies.precess import run as precess

_LAZY = {
    "load": ("rigidcli.model.load", "load"),
    "loads": ("rigidcli.model.load", "loads"),
    "axes": ("rigidcli.studies.axes", "run"),
    "euler": ("rigidcli.studies.euler", "run"),
    "hamilton": ("rigidcli.studies.hamilton", "run"),
    "inertia": ("rigidcli.studies.inertia", "run"),
    "precess": ("rigidcli.studies.precess", "run"),
}


def __getattr__(name: str) -> Any:
    """Load a part of the package when it is first asked for: `--help` needs none of them."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    module, attribute = _LAZY[name]
    return getattr(import_module(module), attribute)
