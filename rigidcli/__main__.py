"""The entry point of the program, for `rigidcli` and for `python -m rigidcli`."""

from __future__ import annotations

import gc
import os
import sys

from rigidcli import TYPE_CHECKING

if TYPE_CHECKING:
    from sys import UnraisableHookArgs
    from typing import NoReturn

INTERRUPTED = 130  # the exit code after Ctrl-C: 128 and the number of the signal, as shells expect
# Seconds within which a destructor ends: a second interrupt in the same one would be lost as well.
AGAIN_AFTER = 0.02
# Thresholds of the garbage collection, beyond usual runs: to go through half as many objects takes 30 ms.
THRESHOLDS = (200_000, 20, 100)


def main() -> NoReturn:
    """Run the program on the command line; the process ends with its exit code, also when interrupted."""
    gc.set_threshold(*THRESHOLDS)
    # Matrices are small here, and a second thread would mostly wait for the first.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # pydantic looks through all installed distributions for plugins, of which documents use none.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "1")
    sys.unraisablehook = _interrupted_in_vain
    try:
        # This import stands here, so that an interrupt while it loads ends the program in the same way.
        from rigidcli.cli.app import main as program

        program()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


def _interrupted_in_vain(error: UnraisableHookArgs) -> None:
    """Interrupt again where Ctrl-C came in a destructor, which no exception leaves; tell other errors.

    The futures of a cluster have one that takes so long that one interrupt in seven comes there.
    """
    if not issubclass(error.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(error)
        return
    import _thread
    import threading

    threading.Timer(AGAIN_AFTER, _thread.interrupt_main).start()


def run() -> NoReturn:
    """`main` in a process of its own, which ends at once.

    To take apart in order all that was loaded, heyoka's compiler among it, takes up to a tenth of a run.
    """
    # heyoka loads sympy where it is installed, for conversions that nothing here asks for: that takes 0.3 s.
    sys.modules["sympy"] = None  # type: ignore[assignment]
    code: object = 0
    try:
        main()
    except SystemExit as end:
        code = end.code
    for stream in (sys.stdout, sys.stderr):
        try:
            if stream is not None:
                stream.flush()
        except (OSError, ValueError):  # it is closed, which the user has read already
            continue
    os._exit(code if isinstance(code, int) else 0)


if __name__ == "__main__":
    if not sys.flags.safe_path:
        # `python -m` looks for modules in the current folder first, where an answer file may have their name.
        sys.path.pop(0)
    run()
