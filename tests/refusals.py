"""What is wrong with the text of a document."""

from __future__ import annotations

import pytest

from rigidcli.document.load import loads
from rigidcli.errors import DocumentError, Problem


def problems(text: str) -> list[Problem]:
    """All problems for which a text is refused."""
    with pytest.raises(DocumentError) as caught:
        loads(text, source="f.yaml")
    return list(caught.value.problems)


def told(text: str) -> tuple[str, str]:
    """Key, and message with hint, of the one problem of a text."""
    (problem,) = problems(text)
    assert problem.line is not None
    return problem.key, f"{problem.message} {problem.hint or ''}"
