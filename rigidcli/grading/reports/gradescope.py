"""The `results.json` of a Gradescope autograder: one object an answer file, one a line.

Source: Gradescope's autograder specifications, "Output format". All texts are marked as plain text, for
Gradescope would read HTML or Markdown in others.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import orjson

from rigidcli.errors import printable
from rigidcli.grading.feedback import Feedback, remarks
from rigidcli.grading.judgement import Judged, Judgement
from rigidcli.grading.reports import Style


def render(judgements: Iterable[Judgement], style: Style) -> Iterator[str]:
    """A line for each answer file; where no feedback is given, Gradescope hides the results from students."""
    for judgement in judgements:
        tree = {
            "score": float(judgement.score),
            "output_format": "text",
            "test_output_format": "text",
            "test_name_format": "text",
            "visibility": "hidden" if style.feedback is Feedback.none else "visible",
            "stdout_visibility": "hidden",
            "extra_data": {"student": printable(judgement.student), "source": printable(judgement.source)},
            "tests": [_test(question, style.feedback) for question in judgement.questions],
        }
        yield orjson.dumps(tree).decode() + "\n"


def _test(question: Judged, feedback: Feedback) -> dict[str, object]:
    told = [remark.message for remark in remarks(question, feedback)]
    return {
        "name": printable(question.id),
        "score": float(question.score),
        "max_score": float(question.max_score),
        "status": "passed" if question.verdict == "correct" else "failed",
        "output": "" if feedback is Feedback.none else "\n".join([question.verdict, *told]),
    }
