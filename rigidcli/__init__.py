"""Rigid-body and Hamiltonian mechanics: documents in, inertia tensors, principal axes and motion out.

    import rigidcli

    result = rigidcli.axes("configs/cube_corner.yaml")     # or a mapping, or the text of a document
    result["moments"]        # array([ 2., 11., 11.])

The studies `inertia`, `axes`, `precess`, `euler` and `hamilton` answer a document with a `Result`, which maps
the fields of the JSON output to floats, numpy arrays, texts and exact expressions. It is shown as a table,
and in notebooks as a page. A document is a mapping, a text, the path to a file, or what `load` has read.

Options of the studies: `exact` computes with rationals and symbols; `settings` are values by their keys, such
as {"body.mass": 3}; `steps` shows the working; `picture` is the kind that `Result.save_picture` writes.
`euler` and `hamilton` call `progress` with the fraction that is done; `hamilton` keeps a `program`.

Errors are a `RigidError`. A document that is refused is a `DocumentError`, whose `problems` have line, key,
message and hint.
"""

from __future__ import annotations

from rigidcli.commands import STUDIES

# As in `typing`, which would take longer to load than all else before the program can be interrupted.
TYPE_CHECKING = False

__version__ = "0.1.0"

# The modules of what the package offers.
_PLACES = {
    **dict.fromkeys(STUDIES, "api"),
    **dict.fromkeys(("check", "validate"), "api"),
    "Result": "result",
    **dict.fromkeys(("load", "load_all", "loads"), "document.load"),
    **dict.fromkeys(("DocumentError", "RigidError"), "errors"),
    "Document": "document.document",
}

# What `help` shows. The classes have pages of their own, such as `help(rigidcli.Result)`.
__all__ = [
    "STUDIES",
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
    from rigidcli.document.document import Document as Document
    from rigidcli.document.load import load, load_all, loads
    from rigidcli.errors import DocumentError as DocumentError
    from rigidcli.errors import RigidError as RigidError
    from rigidcli.result import Result as Result


def __getattr__(name: str) -> Any:
    """Load a part of the package when it is first asked for: `--help` needs none of them."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"rigidcli.{_PLACES[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*__all__, *_PLACES, "__version__"})
