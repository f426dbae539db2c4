"""What is claimed on speed: each job with its peer, and how to run both."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import yaml

CONFIGS = Path(__file__).resolve().parents[2] / "configs"

IDLE = ("-c", "import numpy, scipy.integrate")
"""What a peer takes that has nothing to do."""


@dataclass(frozen=True, slots=True)
class Claim:
    """A job beside a peer: the arguments of `rigidcli` and those of Python, with {n} for its `size`.

    `make` is what make.py makes of the size, and `quick` a size that takes no time. Where all of the job
    would take minutes, the peer does {part} of it, one of `parts`, and its time beyond IDLE is multiplied.
    `each` tells what one of many in a job takes. `needs` are modules of the peer.
    `without` is a module that `rigidcli` does not find in this job, as if it were not installed.
    The rows that are at the `front` stand in the project's README, too.
    """

    name: str
    job: str
    beside: str
    ours: str
    theirs: str
    size: int = 1
    quick: int = 1
    make: str = ""
    needs: tuple[str, ...] = ()
    parts: int = 1
    each: bool = False
    without: str = ""
    front: bool = False


def _read() -> tuple[Claim, ...]:
    text = Path(__file__).with_name("claims.yaml").read_text(encoding="utf-8")
    entries = yaml.safe_load(text.replace("{configs}", str(CONFIGS)))
    return tuple(Claim(**{**entry, "needs": tuple(entry.get("needs", ()))}) for entry in entries)


CLAIMS = _read()
"""What is claimed, in the order of the table."""
