"""The workers of a running Dask cluster, to which `processes` hands out work."""

from __future__ import annotations

import logging
import sys
import threading
import warnings
from collections.abc import Iterator
from concurrent.futures import CancelledError, TimeoutError
from contextlib import contextmanager
from importlib import util
from typing import Any

import rigidcli
from rigidcli.errors import ComputationError, UsageError

# Seconds within which a scheduler must answer: one that is there does so in a tenth of a second.
ANSWERS_WITHIN = 5.0
# Seconds to wait for the first worker: one that is started on demand takes half of them.
WORKERS_WITHIN = 60.0
# The fewest workers for which packs are queued: more may start when there is work for them.
LEAST_WORKERS = 16


@contextmanager
def opened(address: str) -> Iterator[tuple[Any, int]]:
    """A client of the scheduler at an address, with `submit` of an executor, and the number of its workers.

    Raises UsageError where no such cluster is reached, and ComputationError where it is lost on the way. What
    was handed out and is no longer wanted is cancelled.
    """
    if util.find_spec("distributed") is None:
        raise UsageError("distributed is not installed", hint="python -m pip install 'rigidcli[cluster]'")
    before = logging.root.manager.disable
    # All that the user should read about a connection is written here, once.
    logging.disable(logging.CRITICAL)
    client: Any = None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            client = _reached(address)
        _require_same(client)
        yield client, max(LEAST_WORKERS, len(client.nthreads()))
    except Exception as error:  # noqa: BLE001 - whatever goes wrong far away
        raise _in_words(error, address) from None
    finally:
        if client is not None:
            client.close(timeout=1)
        logging.disable(before)


def _reached(address: str) -> Any:
    """The client of the scheduler at an address. Raises UsageError where none answers.

    Client waits for ever at an open port where nobody speaks, so it connects in a thread of its own.
    """
    from distributed import Client

    outcome: list[Any] = []

    def reach() -> None:
        try:
            outcome.append(Client(address, timeout=ANSWERS_WITHIN, set_as_default=False))
        except Exception as error:  # noqa: BLE001 - raised where it is waited for
            outcome.append(error)

    thread = threading.Thread(target=reach, daemon=True)
    thread.start()
    thread.join(2 * ANSWERS_WITHIN)
    if outcome and not isinstance(outcome[0], Exception):
        return outcome[0]
    reason = _first_line(outcome[0]) if outcome else "nobody there speaks as a scheduler does"
    raise UsageError(
        f"no Dask scheduler answers at `{address}`: {reason}",
        hint="`dask scheduler` prints its address when it starts; `-j 4` works with 4 processes here",
    )


def _versions() -> dict[str, str]:
    """The versions that must be the same here and at the workers."""
    return {"rigidcli": rigidcli.__version__, "Python": f"{sys.version_info[0]}.{sys.version_info[1]}"}


def _require_same(client: Any) -> None:
    """Raise UsageError where there is no worker, or one has other versions, or none."""
    try:
        client.wait_for_workers(1, timeout=WORKERS_WITHIN)
    except TimeoutError:
        hint = f"start one: `dask worker {client.scheduler.address}`"
        raise UsageError("the cluster has no workers", hint=hint) from None
    ours = _versions()
    for worker, theirs in sorted(client.run(_versions, on_error="return").items()):
        if isinstance(theirs, BaseException):
            problem = f"the worker {worker} cannot load rigidcli: {_first_line(theirs)}"
        elif theirs != ours:
            there, here = (" and ".join(map(" ".join, versions.items())) for versions in (theirs, ours))
            problem = f"the worker {worker} has {there}, and here is {here}"
        else:
            continue
        raise UsageError(problem, hint="install the same versions on all machines")


def _in_words(error: Exception, address: str) -> Exception:
    """The error of a cluster in words for the user; other errors are returned as they are."""
    if isinstance(error, CancelledError | TimeoutError | OSError):
        return ComputationError(
            f"the scheduler at `{address}` was lost, or has given up this work",
            hint="start it and call again; what is printed so far is right",
        )
    return error


def _first_line(error: BaseException) -> str:
    """What an error says, without the places in the code."""
    return str(error).strip().partition("\n")[0]
