"""One row a question, for spreadsheets and scripts: no text in it can become a formula."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

import orjson

from rigidcli.errors import printable
from rigidcli.grading.feedback import codes, remarks
from rigidcli.grading.judgement import Judgement
from rigidcli.grading.reports import Style

HEADER = ("student", "question", "verdict", "score", "max_score", "codes", "message")

# Where semicolons separate cells, as they do in much of Europe, one within a text begins a new cell.
_FORMULA = re.compile(r'(^|;)([\s"]*)(?=[=+\-@＝＋－＠﹦﹢﹣﹫])')


def render(judgements: Iterable[Judgement], style: Style) -> Iterator[str]:
    """The header, then the rows of each answer file."""
    if style.header:
        yield row(*HEADER)
    for judgement in judgements:
        lines = []
        for question in judgement.questions:
            told = remarks(question, style.feedback)
            lines.append(
                row(
                    judgement.student,
                    question.id,
                    question.verdict,
                    float(question.score),
                    float(question.max_score),
                    " ".join(codes(told)),
                    "; ".join(remark.message for remark in told),
                )
            )
        yield "".join(lines)


def row(*cells: str | float | None) -> str:
    """A line of cells: texts, numbers in the shortest text that reads back the same, or nothing."""
    return ",".join(map(_cell, cells)) + "\n"


def _cell(value: str | float | None) -> str:
    if value is None:
        return ""
    if not isinstance(value, str):
        return orjson.dumps(value).decode()
    text = harmless(value)
    return f'"{text.replace(chr(34), chr(34) * 2)}"' if any(mark in text for mark in ',;"') else text


def harmless(text: str) -> str:
    """A text that no spreadsheet takes for a formula: an apostrophe stands before what could begin one."""
    return _FORMULA.sub(r"\1\2'", printable(text))
