"""A plan whose tasks the workers of a running Dask cluster work out, instead of processes of this machine."""

from __future__ import annotations

import logging
import pickle
import sys
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib import util
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar

import rigidcli
from rigidcli.cli.failures import complain
from rigidcli.errors import ComputationError, UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping

_Task = TypeVar("_Task")
_Result = TypeVar("_Result")

ANSWERS_WITHIN = 5.0
"""Seconds within which a scheduler must answer: one that is there does so in a tenth of a second."""

PACK = 0.25
"""Seconds that a worker is busy with what it is handed at a time: fifty times what handing it over takes."""

MOST_TASKS = 256
"""The most tasks that are handed to a worker at a time, which bounds what their results take."""

COUNTED_EVERY = 10.0
"""Seconds after which the workers are counted again, since some may come and go."""

_ALONE = threading.Lock()
"""Held by the thread of a worker that works: the arithmetic has settings that its threads would share."""


def on_cluster(
    work: Callable[[_Task], Iterable[_Result]], tasks: Iterable[_Task], address: str, ahead: int
) -> Iterator[_Result]:
    """All results of each task, in the order of the tasks, worked out by the cluster of the scheduler there.

    For each worker, `ahead` packs of tasks are handed out before their results are asked for. What a worker
    had and did not bring back, the scheduler hands to another one; here, each result is taken once. What was
    handed out and is no longer wanted is cancelled. Raises UsageError where no such cluster is reached, and
    ComputationError where it is lost on the way.
    """
    rest = iter(tasks)
    with _client(address) as client:
        _require_same(client)
        waiting: deque[Any] = deque()
        try:
            size, counted, workers = 1, 0.0, 1
            while True:
                if time.monotonic() - counted > COUNTED_EVERY:
                    counted, workers = time.monotonic(), max(1, len(client.nthreads()))
                while len(waiting) < ahead * workers and (pack := list(islice(rest, size))):
                    # Each pack is work of its own, also where it looks like another.
                    waiting.append(client.submit(_worked, work, pack, pure=False))
                if not waiting:
                    return
                count, seconds, data = waiting.popleft().result()
                yield from pickle.loads(data)  # noqa: S301 - from the cluster, which runs our code
                size = min(MOST_TASKS, 2 * size, max(1, round(count * PACK / max(seconds, 1e-6))))
        except Exception as error:  # noqa: BLE001 - what can go wrong far away is told, or raised again
            raise _told(error, address) from None
        finally:
            _cancel(client, waiting)


def everywhere(work: Callable[[_Task], Iterable[_Result]], task: _Task, address: str) -> None:
    """Let each worker of the cluster do the same task, where it may differ what is there to be done."""
    with _client(address) as client:
        each = [
            client.submit(_worked, work, [task], pure=False, workers=[worker], allow_other_workers=True)
            for worker in client.nthreads()
        ]
        try:
            for future in each:
                future.result()
        except Exception as error:  # noqa: BLE001 - what can go wrong far away is told, or raised again
            raise _told(error, address) from None


def _worked(work: Callable[[_Task], Iterable[_Result]], pack: list[_Task]) -> tuple[int, float, bytes]:
    """How many tasks a pack has, how long they took (s), and their results, as a worker hands them back."""
    with _ALONE:
        begin = time.perf_counter()
        results = [result for task in pack for result in work(task)]
        return len(pack), time.perf_counter() - begin, pickle.dumps(results, pickle.HIGHEST_PROTOCOL)


@contextmanager
def _client(address: str) -> Iterator[Any]:
    """What hands work to the scheduler at an address; raises UsageError where none answers."""
    if util.find_spec("distributed") is None:
        raise UsageError("distributed is not installed", hint="python -m pip install 'rigidcli[cluster]'")

    before = logging.root.manager.disable
    # What the user should know of a connection is told once, here.
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            client = _reached(address)
    except (OSError, ValueError, TypeError, ImportError, RuntimeError) as error:
        logging.disable(before)
        raise UsageError(
            f"no Dask scheduler answers at `{address}`: {_first_line(error)}",
            hint="`dask scheduler` prints its address when it starts; `-j 4` works with 4 processes here",
        ) from None
    try:
        yield client
    finally:
        client.close(timeout=1)
        logging.disable(before)


def _reached(address: str) -> Any:
    """The client of the scheduler at an address; raises what distributed does, or TimeoutError.

    It waits on and on where a port is open and nobody speaks, and so does that in a thread of its own.
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
    if not outcome:
        raise TimeoutError("nobody there speaks as a scheduler does")
    if isinstance(outcome[0], Exception):
        raise outcome[0]
    return outcome[0]


def _cancel(client: Any, waiting: deque[Any]) -> None:
    """Let the scheduler forget what is queued; where it is gone, so is the queue."""
    try:
        client.cancel(list(waiting))
    except Exception:  # noqa: BLE001 - there is nobody left to tell
        waiting.clear()


def _versions() -> Mapping[str, str]:
    """What must be the same here and where results are worked out."""
    return {"rigidcli": rigidcli.__version__, "Python": f"{sys.version_info[0]}.{sys.version_info[1]}"}


def _require_same(client: Any) -> None:
    """Raise UsageError where a worker has other versions, or none; tell where there is no worker yet."""
    ours = _versions()
    found = client.run(_versions, on_error="return")
    if not found:
        complain("note: the cluster has no workers yet, and is waited for")
    for worker, theirs in sorted(found.items()):
        if isinstance(theirs, BaseException):
            problem = f"the worker {worker} cannot load rigidcli: {_first_line(theirs)}"
        elif theirs != ours:
            problem = f"the worker {worker} has {_listed(theirs)}, and here is {_listed(ours)}"
        else:
            continue
        raise UsageError(problem, hint="install the same versions on all machines")


def _listed(versions: Mapping[str, str]) -> str:
    return " and ".join(map(" ".join, versions.items()))


def _told(error: Exception, address: str) -> Exception:
    """The error as the user is told of it; the same one where it is none of the cluster."""
    from concurrent.futures import CancelledError, TimeoutError

    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return ComputationError(
            "workers of the cluster ended, one after the other, with the same part of the work",
            hint="their logs tell why; mostly they need more memory (`dask worker --memory-limit`)",
        )
    if isinstance(error, CancelledError | TimeoutError | OSError):
        return ComputationError(
            f"the scheduler at `{address}` was lost, or has given up this work",
            hint="start it and call again; what is printed so far is right",
        )
    if isinstance(error, ImportError | AttributeError | MemoryError):
        return ComputationError(
            f"a worker of the cluster cannot do this: {_first_line(error) or 'there is too little memory'}",
            hint="workers need the same extras of rigidcli, and enough memory",
        )
    return error


def _first_line(error: BaseException) -> str:
    """What an error says, without the places in the code."""
    return str(error).strip().partition("\n")[0]
