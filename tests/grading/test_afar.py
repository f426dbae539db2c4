"""Answer files that other machines judge: as they are judged here, or not at all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from rigidcli.errors import ComputationError
from rigidcli.grading.afar import everywhere
from rigidcli.grading.asked import Asked
from rigidcli.grading.batch import run
from rigidcli.grading.judge import Item
from rigidcli.grading.judgement import Judgement
from rigidcli.grading.kinds import KINDS
from rigidcli.grading.question import Question
from rigidcli.grading.roster import Paper
from rigidcli.sandbox import Limits


def in_turn(work: Callable[[Any], Iterable[Any]], tasks: Iterable[Any]) -> Iterator[Any]:
    """A cluster of one worker, which is on this machine."""
    for task in tasks:
        yield from work(task)


def judgements(files: Iterable[Path], spread: Any = None, **options: Any) -> list[Judgement]:
    key = KINDS["number"].read_key(Asked(Question.model_validate({"kind": "number", "answer": "1"}), "1"))
    elsewhere = None if spread is None else partial(everywhere, spread)
    papers = [Paper(file.stem, file) for file in files]
    return list(run({"q": Item(KINDS["number"], key, 1.0)}, papers, 1, elsewhere=elsewhere, **options))


def test_files_are_judged_as_they_are_here(tmp_path: Path) -> None:
    texts = {
        "right": "answers: {q: 1}\n",
        "wrong": "answers: {q: 2}\n",
        "broken": "answers: [\n",
        "deep": f"answers: {{q: {'[' * 3000}{']' * 3000}}}\n",
        "large": "#" * 1_000_001,
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    (tmp_path / "link.yaml").symlink_to("right.yaml")
    files = [*sorted(tmp_path.iterdir()), tmp_path / "nowhere.yaml", tmp_path / "right.yaml"]
    told: list[float] = []
    assert judgements(files, in_turn, progress=told.append) == judgements(files)
    assert told == pytest.approx([(k + 1) / len(files) for k in range(len(files))])


def test_limits_hold_there(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("answers: {q: 1}\n")
    (found,) = judgements([tmp_path / "a.yaml"], in_turn, limits=Limits(handed=10))
    assert found.questions[0].codes == ("too_large",)


@pytest.mark.parametrize("change", ["text", "beside", "named", "folder"])
def test_a_machine_that_sees_other_files_is_told(change: str, tmp_path: Path) -> None:
    folder = tmp_path / "answers"
    folder.mkdir()
    (folder / "a.yaml").write_text("answers: {q: {file: a.csv}}\n")
    (folder / "a.csv").write_text("t,x\n")

    def elsewhere(work: Callable[[Any], Iterable[Any]], tasks: Iterable[Any]) -> Iterator[Any]:
        made = list(tasks)
        if change == "text":
            (folder / "a.yaml").write_text("answers: {q: 2}\n")
        elif change == "beside":
            (folder / "orbit.csv").write_text("t,x\n")
        elif change == "folder":
            folder.rename(tmp_path / "moved")
        found = list(in_turn(work, made))
        if change == "named":
            (folder / "a.csv").write_text("t,y\n")
        return iter(found)

    with pytest.raises(ComputationError, match="sees other files where") as refused:
        judgements([folder / "a.yaml"], elsewhere)
    assert refused.value.hint is not None
