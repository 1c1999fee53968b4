"""Ctrl-C and SIGTERM: answered from the first moment on, with a sentence, and never lost."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

STOPPING = (signal.SIGINT, signal.SIGTERM)
"""What asks a command to end: Ctrl-C, and what `kill` and batch systems send."""

AGAIN = 0.02
"""Seconds until an interrupt that was lost is raised again."""


@contextmanager
def answered(handler: Callable[[int, object], None], numbers: Iterable[int]) -> Iterator[None]:
    """Inside, a function answers these signals."""
    previous = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, before in previous.items():
            signal.signal(number, before)


def not_ignored(*more: int) -> list[int]:
    """Ctrl-C, SIGTERM and more signals; not those that our starter has us ignore."""
    numbers = (*STOPPING, *more)
    return [each for each in numbers if signal.getsignal(each) is not signal.SIG_IGN]


@contextmanager
def at_once() -> Iterator[None]:
    """Inside, where modules are loaded and nothing is under way, an interrupt ends the process.

    To raise an exception there is no way: modules in C print it and go on, or make it another one.
    """

    def end(_number: int, _frame: object) -> None:
        os.write(2, b"snooker: interrupted\n")
        os._exit(130)

    with answered(end, not_ignored()):
        yield


@contextmanager
def raising() -> Iterator[list[int]]:
    """Inside, an interrupt raises ``KeyboardInterrupt``; gives the numbers of those that came.

    Python drops an exception that is raised where nobody can catch it, as in the callbacks with
    which HDF5's objects are deleted after a long read: it is then raised again.
    """
    came: list[int] = []
    before = sys.unraisablehook

    def interrupt(number: int, _frame: object) -> None:
        came.append(number)
        raise KeyboardInterrupt

    def lost(unraisable: sys.UnraisableHookArgs) -> None:
        if sys.platform != "win32" and unraisable.exc_type is KeyboardInterrupt:
            signal.setitimer(signal.ITIMER_REAL, AGAIN)
        else:
            before(unraisable)

    alarm = () if sys.platform == "win32" else (signal.SIGALRM,)
    sys.unraisablehook = lost
    try:
        with answered(interrupt, not_ignored(*alarm)):
            yield came
    finally:
        sys.unraisablehook = before
