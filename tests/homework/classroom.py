"""A class of 120 and its hand-ins by the table layouts.yaml, in which student n has n points."""

from __future__ import annotations

import csv
import io
import unicodedata
import zipfile
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Literal

import yaml

TABLE = yaml.safe_load(Path(__file__).with_name("layouts.yaml").read_text(encoding="utf-8"))
LAYOUTS: Mapping[str, list[str]] = TABLE["layouts"]
SIZE = 120

QUESTIONS = 7
"""Questions of 1, 2, 4, ... points: right answers to some of them add up to any number up to 127."""

ASSIGNMENT = "assignment: Week 3\nquestions:\n" + "".join(
    f"  q{k}: {{answer: {k + 2}, kind: number, points: {2**k}}}\n" for k in range(QUESTIONS)
)


def answers(points: int) -> str:
    """An answer file of so many points."""
    right = [f"  q{k}: {k + 2 if points >> k & 1 else 99}\n" for k in range(QUESTIONS)]
    return f"answers:\n{''.join(right)}"


def ascii_letters(text: str) -> str:
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return "".join(char for char in plain if char.isalnum() or char in " _")


def student(number: int, first: str, last: str) -> SimpleNamespace:
    """A student by all that a platform calls one."""
    word = ascii_letters((last or first).casefold()).replace(" ", "")[:5]
    login = TABLE["logins"].get(number, f"{word or 'x'}{number:02}")
    together = f"{last}, {first}" if first and last else first or last
    transcribed = together.replace("ü", "ue").replace("ö", "oe").replace(", ", "_")
    name = f"{first} {last}".strip()
    return SimpleNamespace(
        number=number, first=first, last=last, login=login, name=name, sorted=together,
        email=f"{login}@uni.example.edu", ident=300000 + 7 * number, platform=5000 + number,
        chance=5001 + number % SIZE,
        section=number % 3, word="".join(name.split()), ascii=ascii_letters(transcribed).replace(" ", "_"),
        glued="".join(filter(str.isalnum, together.casefold())),
    )  # fmt: skip


STUDENTS = [
    student(number, *names)
    for number, names in enumerate(
        [*TABLE["names"], *([first, last] for last in TABLE["last"] for first in TABLE["first"])][:SIZE], 1
    )
]


def roster(layout: str) -> str:
    """The list of students that the platform exports."""
    target = io.StringIO()
    _, head, cells = LAYOUTS[layout]
    rows = [cells.format(s=s).split("|") for s in STUDENTS]
    csv.writer(target, lineterminator="\n").writerows([head.split("|"), *rows])
    return target.getvalue()


def handed_in(layout: str, normal_form: Literal["NFC", "NFD"]) -> dict[str, bytes]:
    """The files of the class by their names, in a normal form of Unicode."""
    files = {}
    for s in STUDENTS:
        name, data = LAYOUTS[layout][0].format(s=s), answers(s.number).encode()
        if name.endswith(".zip"):
            target = io.BytesIO()
            with zipfile.ZipFile(target, "w") as archive:
                archive.writestr("hw3/hw3.yaml", data)
                archive.writestr("__MACOSX/hw3/._hw3.yaml", b"\0")
            data = target.getvalue()
        files[unicodedata.normalize(normal_form, name)] = data
    if layout == "gradescope":
        entry = 'submission_{s.platform}: {{":submitters": [{{":name": "{s.name}", ":email": {s.email}}}]}}\n'
        people = "".join(entry.format(s=s) for s in STUDENTS)
        files["export/submission_metadata.yml"] = people.encode()
    return files


def write(folder: Path, files: Mapping[str, bytes]) -> Path:
    """The folder with these files, or an archive of them if it has such a name."""
    if folder.suffix == ".zip":
        with zipfile.ZipFile(folder, "w") as archive:
            for name, data in files.items():
                archive.writestr(name, data)
        return folder
    for name, data in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    return folder
