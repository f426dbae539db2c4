"""Documents as a program gives them: a mapping, a text, the path to a file, or one that is read already."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

from rigidcli.document.document import Document
from rigidcli.document.files import load
from rigidcli.document.load import loads
from rigidcli.errors import DocumentError, Problem, UsageError

Source: TypeAlias = Document | Mapping[str, Any] | str | os.PathLike[str]
"""A document, read already or not: what it says as a mapping, its text in YAML, or the path to its file."""

MAPPING = "<mapping>"
"""What messages call a document that was given as a mapping, which has no lines."""

_TEXT = re.compile(r"\n|:\s|\{")
"""What the text of a document has, and the path to a file has not."""


def read(source: Source, exact: bool, settings: Sequence[str]) -> Document:
    """The document of a source. Raises DocumentError, and UsageError for a document with `settings`."""
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
    entries = dict(enumerate(value)) if isinstance(value, list) else value
    for step, entry in entries.items() if isinstance(entries, dict) else ():
        yield from _not_finite(entry, f"{path}.{step}" if path else str(step))


def _plain(value: Any) -> Any:
    """Arrays and other numbers as json has them; exact expressions, fractions and paths as text."""
    if hasattr(value, "tolist"):
        return value.tolist()
    return dict(value) if isinstance(value, Mapping) else str(value)
