"""What a question asks for, before its kind makes a key of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from rigidcli.grading.question import Question

if TYPE_CHECKING:
    from rigidcli.document.document import Document
    from rigidcli.report import Report

Tree: TypeAlias = Any
"""An answer as it was typed: texts (numbers too), None, and lists and mappings of them."""


@dataclass(frozen=True, slots=True, eq=False)
class Asked:
    """The right answer and where it is from.

    A literal key is a `Tree` in `value`, read by the same rules as a student's answer. One from a document
    has the document and the report of its study, the `path` of the ask (`("inertia", "tensor")`), and in
    `value` what the report has there (floats, arrays, trees of expressions, texts), in SI units `unit`. Of a
    trajectory there is a `second` report: of the same document, worked with a coarser tolerance. `name` is
    that of the question.
    """

    question: Question
    value: Any
    unit: str = ""
    path: tuple[str, ...] = ()
    document: Document | None = None
    report: Report | None = None
    second: Report | None = None
    name: str = ""
