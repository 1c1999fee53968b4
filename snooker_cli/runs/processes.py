"""Processes of this machine that a command begins: in safe-path mode, and they end with it."""

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

from snooker_cli.errors import RunError
from snooker_cli.signals import STOPPING

SAFE_PATH = "PYTHONSAFEPATH"  # in the environment of a process that begins, as its option -P


def processors() -> int:
    """How many processors this process may use: a batch system or `taskset` may allow a part."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def using_shared_memory() -> Iterator[None]:
    """Inside, a system that refuses locks between processes causes a ``RunError``."""
    try:
        yield
    except OSError as error:
        raise RunError(
            f"no processes can begin: shared memory (/dev/shm) cannot be used ({error.strerror})",
            "make room there, and check its permissions",
        ) from None


@contextmanager
def safe_path() -> Iterator[None]:
    """Inside, Python begins processes without the current folder on their path.

    Anyone may have put a module there, such as ``multiprocessing.py``, with which they begin.
    """
    before = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[SAFE_PATH]
        else:
            os.environ[SAFE_PATH] = before


class Processes(ProcessPoolExecutor):
    """Processes that leave signals to this one, and end with it.

    begin, arguments : called once in each process

    Raises ``RunError`` without shared memory.
    """

    def __init__(
        self, workers: int, begin: Callable[..., None] | None = None, *arguments: Any
    ) -> None:
        context = get_context("spawn")
        lifeline, self._lifeline = context.Pipe(duplex=False)
        with using_shared_memory(), safe_path():
            super().__init__(workers, context, _begin_process, (lifeline, begin, arguments))

    def submit(self, *call: Any, **named: Any) -> Future[Any]:
        """As of any executor; the first call begins the processes."""
        with safe_path():
            return super().submit(*call, **named)

    def kill(self) -> None:
        """End all processes now. After one has died, others may wait for its locks for ever."""
        self._lifeline.close()


def _begin_process(
    lifeline: Connection, begin: Callable[..., None] | None, arguments: Sequence[Any]
) -> None:
    for number in STOPPING:
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_after, args=(lifeline,), daemon=True).start()
    if begin:
        begin(*arguments)


def _end_after(lifeline: Connection) -> None:
    """End this process when the other end of a pipe is closed, or its process ends."""
    with suppress(EOFError, OSError):
        lifeline.recv()
    os._exit(1)
