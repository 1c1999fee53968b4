"""The one seam to whoever works: an executor, given so much at a time until a run is cancelled."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Executor, Future
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

LOOK = 0.02
"""Seconds after which whoever waits for workers looks whether the run is cancelled."""

Item = TypeVar("Item")
Result = TypeVar("Result")


class Workers(ABC):
    """What threads of this process have in common with workers on other machines.

    at_once : items that the executor has at a time; the others are kept back
    """

    def __init__(self, executor: Executor, at_once: int, cancelled: threading.Event) -> None:
        self._executor, self._at_once, self._cancelled = executor, at_once, cancelled

    def each(self, function: Callable[..., Result], items: Iterable[Item]) -> Iterator[Result]:
        """Results for items as they come; the first ones only, once the run is cancelled."""
        under_way: dict[Future[Result], Item] = {}
        ended: SimpleQueue[Future[Result]] = SimpleQueue()
        todo = iter(items)
        while not (self._cancelled.is_set() and self._leaves(under_way)):
            while len(under_way) < self._at_once and not self._cancelled.is_set():
                item = next(todo, None)
                if item is None:
                    break
                future = self._submit(function, item)
                under_way[future] = item
                future.add_done_callback(ended.put)
            if not under_way:
                return
            try:
                future = ended.get(timeout=LOOK)
            except Empty:
                continue
            yield self._result(future, under_way.pop(future))

    @abstractmethod
    def _submit(self, function: Callable[..., Result], item: Any) -> Future[Result]:
        """Give an item to the executor."""

    @abstractmethod
    def _leaves(self, under_way: Mapping[Future[Any], Any]) -> bool:
        """Whether a cancelled run waits for nothing any more of what is under way."""

    @abstractmethod
    def _result(self, future: Future[Result], item: Any) -> Result:
        """What has become of an item."""
