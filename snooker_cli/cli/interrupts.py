"""Ctrl-C and SIGTERM: answered from the first moment on, with a sentence, and never lost."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

AGAIN = 0.02
"""Seconds until an interrupt that was lost is raised again."""


@contextmanager
def handled(handler: Callable[[int, object], None], *more: int) -> Iterator[None]:
    """Inside, a function answers Ctrl-C, SIGTERM and more; not what our starter has us ignore."""
    previous = {
        number: signal.signal(number, handler)
        for number in (signal.SIGINT, signal.SIGTERM, *more)
        if signal.getsignal(number) is not signal.SIG_IGN
    }
    try:
        yield
    finally:
        for number, before in previous.items():
            signal.signal(number, before)


@contextmanager
def at_once() -> Iterator[None]:
    """Inside, where modules are loaded and nothing is under way, an interrupt ends the process.

    To raise an exception there is no way: modules in C print it and go on, or make it another one.
    """

    def end(_number: int, _frame: object) -> None:
        os.write(2, b"snooker: interrupted\n")
        os._exit(130)

    with handled(end):
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
        with handled(interrupt, *alarm):
            yield came
    finally:
        sys.unraisablehook = before
