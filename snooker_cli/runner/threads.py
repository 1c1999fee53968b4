"""Threads that an interrupt need not wait for, unless they have something to keep."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from functools import partial
from typing import Self, TypeVar

LOOK = 0.02
"""Seconds after which whoever waits for threads looks whether the run is cancelled."""

Item = TypeVar("Item")
Result = TypeVar("Result")


class Threads:
    """Threads for all that takes long, so that an interrupt is answered meanwhile.

    After it, only those are waited for that have something to keep. The others, which compile or
    arrange a million balls, are left behind; they write nothing.
    """

    def __init__(self, workers: int, cancelled: threading.Event) -> None:
        self._workers, self._cancelled = workers, cancelled
        self._pool = ThreadPoolExecutor(workers)
        self._lock = threading.Lock()
        self._left = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._pool.shutdown(wait=not self._cancelled.is_set(), cancel_futures=True)

    def each(
        self, function: Callable[[Item, Callable[[], bool]], Result], items: Iterable[Item]
    ) -> Iterator[Result]:
        """Results for items as they come; the first ones only, once the run is cancelled.

        function : is given an item, and what to call when it has something to keep: false means
            that nobody waits for it any more
        """
        under_way: dict[Future[Result], threading.Event] = {}
        todo = iter(items)
        while not self._leaves(under_way.values()):
            while len(under_way) < 2 * self._workers and not self._cancelled.is_set():
                item = next(todo, None)
                if item is None:
                    break
                keeps = threading.Event()
                future = self._pool.submit(function, item, partial(self._keep, keeps))
                under_way[future] = keeps
            if not under_way:
                return
            for future in wait(under_way, LOOK, FIRST_COMPLETED).done:
                del under_way[future]
                yield future.result()

    def _keep(self, keeps: threading.Event) -> bool:
        """Note that a thread has something to keep, unless nobody waits any more."""
        with self._lock:
            if not self._left:
                keeps.set()
            return not self._left

    def _leaves(self, under_way: Iterable[threading.Event]) -> bool:
        """Whether the run is cancelled, and no thread has anything to keep."""
        with self._lock:
            self._left = self._cancelled.is_set() and not any(one.is_set() for one in under_way)
            return self._left
