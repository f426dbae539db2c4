"""The pictures of `precess`: the trace of the axis of a top, and polhodes."""

from __future__ import annotations

from collections.abc import Mapping

from rigidcli.document.document import Document
from rigidcli.errors import UsageError
from rigidcli.picture import Picture
from rigidcli.report import Value
from rigidcli.studies.euler import follow, pictures


def trace(document: Document, values: Mapping[str, Mapping[str, Value]]) -> Picture:
    """The path of the axis of a top on the sphere, for as long as `euler` follows it."""
    if values.get("top", {}).get("theta_min") is None:
        raise UsageError("it needs a `top` with `tilt` and `lambda1`, and a precession to begin with")
    motion = follow(document)
    if not motion.problem.weight.any():
        raise UsageError("the trace is that of a top with weight, and this one has none")
    return pictures.trace(motion, motion.samples())


def polhode(document: Document, values: Mapping[str, Mapping[str, Value]]) -> Picture:
    """The path of omega in a free body, for as long as `euler` follows it."""
    if "free" not in values:
        raise UsageError("it is drawn for a `body` with `motion.omega`")
    motion = follow(document)
    return pictures.polhode(motion, motion.samples())
