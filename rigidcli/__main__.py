"""The way into the program: `rigidcli`, and `python -m rigidcli`, which is the same."""

from __future__ import annotations

import gc
import os
import sys

from rigidcli import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import NoReturn

INTERRUPTED = 130

THRESHOLDS = (100_000, 20, 100)
"""Of the collection of garbage, of which there is next to none: otherwise it takes 3 % of a short run."""


def main() -> NoReturn:
    """Run the program on the command line; the process ends with its exit code, also when interrupted."""
    gc.set_threshold(*THRESHOLDS)
    # Matrices are small here: threads for them would mostly wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        # An interrupt while it loads is one like any other.
        from rigidcli.cli.app import main as program

        program()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
