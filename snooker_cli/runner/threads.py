"""Threads that an interrupt need not wait for, unless they have something to keep."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any, Self

from snooker_cli.runner.workers import Result, Workers


class Threads(Workers):
    """Threads for all that takes long, so that an interrupt is answered meanwhile.

    What they do is given an item, and what to call when it has something to keep: false means that
    nobody waits for it any more. After an interrupt, only threads are waited for that have
    something to keep. The others, which compile or arrange a million balls, are left behind; they
    write nothing.
    """

    def __init__(self, workers: int, cancelled: threading.Event) -> None:
        super().__init__(ThreadPoolExecutor(workers), 2 * workers, cancelled)
        self._keeps: dict[Future[Any], threading.Event] = {}
        self._lock = threading.Lock()
        self._left = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._executor.shutdown(wait=not self._cancelled.is_set(), cancel_futures=True)

    def _submit(self, function: Callable[..., Result], item: Any) -> Future[Result]:
        keeps = threading.Event()
        future = self._executor.submit(function, item, partial(self._keep, keeps))
        self._keeps[future] = keeps
        return future

    def _keep(self, keeps: threading.Event) -> bool:
        """Note that a thread has something to keep, unless nobody waits any more."""
        with self._lock:
            if not self._left:
                keeps.set()
            return not self._left

    def _leaves(self, under_way: Mapping[Future[Any], Any]) -> bool:
        with self._lock:
            self._left = not any(self._keeps[future].is_set() for future in under_way)
            return self._left

    def _result(self, future: Future[Result], _item: Any) -> Result:
        del self._keeps[future]
        return future.result()
