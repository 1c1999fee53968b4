"""Tells somebody who waits for the compiler that it is the compiler they wait for."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_waiting: list[_Patience] = []


@contextmanager
def when_compiling(tell: Callable[[], None], *, after: float) -> Iterator[None]:
    """Inside, ``tell`` is called, once, when compiling has taken so many seconds in all.

    Functions that are loaded from their files are not compiled.
    """
    patience = _Patience(tell, after)
    _waiting.append(patience)
    try:
        yield
    finally:
        _waiting.remove(patience)


@contextmanager
def compiling() -> Iterator[None]:
    """Inside, something is being compiled; not for two threads at once."""
    waiting = list(_waiting)
    for patience in waiting:
        patience.begin()
    try:
        yield
    finally:
        for patience in waiting:
            patience.end()


class _Patience:
    """Counts the time that compiling takes."""

    def __init__(self, tell: Callable[[], None], seconds: float) -> None:
        self.tell, self.left = tell, seconds
        self.began = 0.0
        self.timer = threading.Timer(0.0, tell)

    def begin(self) -> None:
        """A compilation begins."""
        if self.left > 0:
            self.began = time.perf_counter()
            self.timer = threading.Timer(self.left, self.tell)
            self.timer.start()

    def end(self) -> None:
        """A compilation has ended."""
        if self.left > 0:
            self.left -= time.perf_counter() - self.began
            self.timer.cancel()
