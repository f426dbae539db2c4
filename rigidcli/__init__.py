"""Rigid-body and Hamiltonian mechanics: documents in, inertia tensors, principal axes and motion out.

    import rigidcli

    result = rigidcli.axes("configs/cube_corner.yaml")     # or a mapping, or the text of a document
    result["moments"]        # array([ 2., 11., 11.])

`inertia`, `axes`, `precess`, `euler` and `hamilton` answer documents with a `Result`, which maps the fields
of the JSON output to floats, numpy arrays, texts and exact expressions, and shows itself as a table. `load`
and `loads` read a document once for several of them, `load_all` the links of a robot. Errors are a
`RigidError`; a refused document is a `DocumentError`, which lists its problems, as `validate` does. `check`
judges homework.
"""

from __future__ import annotations

from rigidcli.commands import STUDIES

TYPE_CHECKING = False
"""As in `typing`, which would take longer to load than all else before the program can be interrupted."""

__version__ = "0.1.0"

_PLACES = {
    **dict.fromkeys(STUDIES, "api"),
    **dict.fromkeys(("check", "validate"), "api"),
    "Result": "result",
    **dict.fromkeys(("load", "load_all", "loads"), "document.load"),
    **dict.fromkeys(("DocumentError", "RigidError"), "errors"),
    "Document": "document.document",
}
"""The modules of what the package offers."""

__all__ = [
    "STUDIES",
    "Document",
    "DocumentError",
    "Result",
    "RigidError",
    "__version__",
    "axes",
    "check",
    "euler",
    "hamilton",
    "inertia",
    "load",
    "load_all",
    "loads",
    "precess",
    "validate",
]

if TYPE_CHECKING:
    from typing import Any

    from rigidcli.api import axes, check, euler, hamilton, inertia, precess, validate
    from rigidcli.document.document import Document
    from rigidcli.document.load import load, load_all, loads
    from rigidcli.errors import DocumentError, RigidError
    from rigidcli.result import Result


def __getattr__(name: str) -> Any:
    """Load a part of the package when it is first asked for: `--help` needs none of them."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"rigidcli.{_PLACES[name]}"), name)


def __dir__() -> list[str]:
    """What the package offers, for completion."""
    return sorted(__all__)
