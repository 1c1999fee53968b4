"""Signals that end a command. The first module to load, so it loads little itself."""

from __future__ import annotations

import atexit
import os
import signal
import sys
from contextlib import contextmanager

TYPE_CHECKING = False  # type checkers take it as true
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from typing import Any, NoReturn

INTERRUPTED = 130  # the exit code

STOPPING = [signal.SIGINT, signal.SIGTERM]
"""Ctrl-C, what `kill` and batch systems send, and a lost connection, but not after `nohup`."""
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
    STOPPING.append(signal.SIGHUP)


def unignored() -> list[int]:
    """``STOPPING``, without those that the parent process ignores."""
    return [number for number in STOPPING if signal.getsignal(number) is not signal.SIG_IGN]


@contextmanager
def handling(
    handler: Callable[[int, object], None], numbers: Iterable[int] | None = None
) -> Iterator[None]:
    """Inside, a function handles these signals.

    numbers : by default ``unignored``
    """
    if numbers is None:
        numbers = unignored()
    previous = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, before in previous.items():
            signal.signal(number, before)


def begin_process() -> None:
    """From now on signals end the process as ``end_interrupted``; at its very end they do nothing.

    Python stops handling signals before it deletes its modules, which takes up to a second. All
    is stored by then, so a signal would only change the exit code.
    """
    numbers = unignored()
    for number in numbers:
        signal.signal(number, end_interrupted)

    @atexit.register  # the first one, so that it is called last
    def ignore() -> None:
        for number in numbers:
            signal.signal(number, signal.SIG_IGN)


def end_interrupted(*_signal: object) -> NoReturn:
    """End the process now, after an interrupt.

    While modules load, an exception would not do: those in C print it and continue, or raise
    another one.
    """
    try:
        os.write(2, b"snooker: interrupted\n")
    finally:  # whether or not there still is a terminal
        os._exit(INTERRUPTED)


@contextmanager
def raising() -> Iterator[list[int]]:
    """Inside, an interrupt raises ``KeyboardInterrupt``; gives the signals that came.

    Python drops an exception that is raised in a callback, for example when HDF5 deletes objects.
    The process then ends there.
    """
    came: list[int] = []
    before = sys.unraisablehook

    def interrupt(number: int, _frame: object) -> None:
        came.append(number)
        raise KeyboardInterrupt

    def dropped(unraisable: Any) -> None:
        if unraisable.exc_type is KeyboardInterrupt:
            end_interrupted()
        before(unraisable)

    sys.unraisablehook = dropped
    try:
        with handling(interrupt):
            yield came
    finally:
        sys.unraisablehook = before
