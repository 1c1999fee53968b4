"""How far the compilation of a kernel is: its functions are counted, and watchers see it."""

import gc
import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from snooker_cli.files import write_text

NOTICE = "compiling this type of scene (first use on this machine)"
NOTICE_AFTER = 1.0  # seconds of compilation before the notice

USUAL = 130
"""Functions of a kernel that this machine has not compiled yet."""

LAST = 0.13
"""Time for the last function of a kernel, which has all others in it, over that for the others."""

Watcher = Callable[[int, int], bool]
"""Gets the number of functions that are compiled, and of all; says whether it shows them.

The first is less than the second until the kernel is complete.
"""

_log = logging.getLogger(__name__)


class Compilation:
    """The compilation that this process is at: one at a time, with others inside of it.

    Meanwhile no garbage is collected: Numba makes many objects, and hardly any garbage.
    """

    def __init__(self) -> None:
        self.watchers: list[Watcher] = []
        self._depth = self._done = 0
        self._total = USUAL
        self._shown = self._collects = False
        self._timer: threading.Timer | None = None

    def begin_function(self, kernel: str, folder: Path | None) -> None:
        """A function begins.

        kernel : its name
        folder : the cache of kernels, which keeps their numbers of functions
        """
        if self._depth == 0:
            self._collects = gc.isenabled()
            gc.disable()
            self._file = folder and folder / f"{kernel}.functions"
            self._done, self._total, self._shown = 0, known_functions(self._file), False
            self._timer = threading.Timer(NOTICE_AFTER, self._notify)
            self._timer.daemon = True
            self._timer.start()
        self._depth += 1
        if self._depth == 1:
            self._show(0, self._total)

    def end_function(self) -> None:
        """The function that began last ends; perhaps with an error."""
        self._depth -= 1
        self._done += 1
        if self._depth:
            self._show(self._done, max(self._total, self._done + 1))
            return
        if self._collects:
            gc.enable()
        assert self._timer is not None
        self._timer.cancel()
        self._show(self._done, self._done)
        if self._file is not None:
            with suppress(OSError):  # a full disk
                write_text(self._file, str(self._done))

    def _show(self, done: int, total: int) -> None:
        for watcher in self.watchers:
            self._shown |= watcher(done, total)

    def _notify(self) -> None:
        if not self._shown:
            give_notice()


COMPILATION = Compilation()


@contextmanager
def watching(notice: str, total: Callable[[], int]) -> Iterator[Callable[[], None]]:
    """Inside, watchers see functions that other processes compile.

    notice : what is said if there is no watcher that shows them
    total : how many there are in all, as far as is known at the moment

    Gives what counts one more function.
    """
    lock, done = threading.Lock(), 0
    watchers = COMPILATION.watchers

    def count() -> None:
        nonlocal done
        with lock:
            done += 1
            now = max(total(), done + 1)
            for watcher in watchers:
                watcher(done, now)

    shown = [watcher(0, total()) for watcher in watchers]
    if not any(shown):
        give_notice(notice)
    try:
        yield count
    finally:
        for watcher in watchers:
            watcher(done, done)


def known_functions(path: Path | None) -> int:
    """The number of functions that a kernel had last time."""
    with suppress(OSError, ValueError):
        if path is not None:
            return max(1, int(path.read_text("utf-8")))
    return USUAL


def seconds_left(done: int, total: int, seconds: float) -> float:
    """The time (s) that is left, if this number of functions took this time."""
    return seconds * ((1 + LAST) * total - done) / done


@cache
def give_notice(text: str = NOTICE) -> None:
    """Explain the wait, once in a process."""
    _log.info(text)
