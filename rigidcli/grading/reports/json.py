"""One compact JSON object an answer file, one a line: the contract `rigidcli.check/1`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import orjson

from rigidcli.errors import printable
from rigidcli.grading.feedback import Feedback, remarks
from rigidcli.grading.judgement import Judged, Judgement
from rigidcli.grading.reports import Style

SCHEMA = "rigidcli.check/1"


def render(judgements: Iterable[Judgement], style: Style) -> Iterator[str]:
    """A line for each answer file."""
    for judgement in judgements:
        tree = {
            "schema": SCHEMA,
            "student": printable(judgement.student),
            "source": printable(judgement.source),
            "score": float(judgement.score),
            "max_score": float(judgement.max_score),
            "questions": [_question(question, style.feedback) for question in judgement.questions],
        }
        yield orjson.dumps(tree).decode() + "\n"


def _question(question: Judged, feedback: Feedback) -> dict[str, object]:
    return {
        "id": printable(question.id),
        "verdict": question.verdict,
        "score": float(question.score),
        "max_score": float(question.max_score),
        "feedback": remarks(question, feedback),
    }
