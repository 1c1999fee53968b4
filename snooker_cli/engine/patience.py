"""Tells somebody who waits for the compiler that it is the compiler they wait for."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from snooker_cli.engine.compiling import COMPILED


@contextmanager
def when_compiling(tell: Callable[[], None], *, after: float) -> Iterator[None]:
    """Inside, ``tell`` is called, once, when compiling has taken so many seconds in all.

    Functions that are loaded from the cache are not compiled.
    """
    if not COMPILED:
        yield
        return
    from numba.core import event

    class Listener(event.Listener):
        """Passes the compiler's events on."""

        def on_start(self, _event: object) -> None:
            patience.begin()

        def on_end(self, _event: object) -> None:
            patience.end()

    patience = _Patience(tell, after)
    with event.install_listener("numba:compile", Listener()):
        yield


class _Patience:
    """Counts the time in the outermost of compilations inside one another."""

    def __init__(self, tell: Callable[[], None], seconds: float) -> None:
        self.tell, self.left = tell, seconds
        self.depth = 0
        self.began = 0.0
        self.timer = threading.Timer(0.0, tell)

    def begin(self) -> None:
        """A compilation begins."""
        self.depth += 1
        if self.depth == 1 and self.left > 0:
            self.began = time.perf_counter()
            self.timer = threading.Timer(self.left, self.tell)
            self.timer.start()

    def end(self) -> None:
        """A compilation has ended."""
        self.depth -= 1
        if self.depth == 0 and self.left > 0:
            self.left -= time.perf_counter() - self.began
            self.timer.cancel()
