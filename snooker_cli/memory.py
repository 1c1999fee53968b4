"""Results that a command needs several times: computed once and kept, up to a total size."""

import sys
import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import is_dataclass
from typing import Any, TypeVar

import numpy as np

Result = TypeVar("Result")


class Memory:
    """Results by key. Beyond ``most`` bytes, it forgets those that were used longest ago.

    It forgets the results of an owner when this object is deleted. The newest result always stays.

    size : bytes of all results that are kept
    """

    def __init__(self, most: int) -> None:
        self.most, self.size = most, 0
        self._kept: OrderedDict[Hashable, tuple[Any, int]] = OrderedDict()
        self._lock = threading.RLock()  # an owner may be deleted while a result is kept

    def find(self, key: Hashable, owner: object = None) -> Any:
        """The result with a key; ``None`` if there is none."""
        with self._lock:
            if (key, id(owner)) not in self._kept:
                return None
            self._kept.move_to_end((key, id(owner)))
            return self._kept[key, id(owner)][0]

    def keep(self, key: Hashable, result: Result, owner: object = None) -> Result:
        """Keep a result, which is returned. Keys of different owners are different."""
        name, number = (key, id(owner)), size_of(result)
        if owner is not None:
            weakref.finalize(owner, self._forget, name).atexit = False
        with self._lock:
            self._forget(name)
            while self._kept and self.size + number > self.most:
                self._forget(next(iter(self._kept)))
            self._kept[name] = result, number
            self.size += number
        return result

    def get(self, key: Hashable, make: Callable[[], Result], owner: object = None) -> Result:
        """The result with a key, which ``make`` computes if it is not kept."""
        known: Result | None = self.find(key, owner)
        return self.keep(key, make(), owner) if known is None else known

    def _forget(self, name: Hashable) -> None:
        with self._lock:
            self.size -= self._kept.pop(name, (None, 0))[1]


SAMPLE = 20  # members of a list that are counted; the others have about the same size


def size_of(value: object) -> int:
    """About the bytes of a value: of its arrays, and of its members, one by one."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, list | tuple):
        return sum(map(size_of, value[:SAMPLE])) * len(value) // max(len(value[:SAMPLE]), 1)
    if isinstance(value, dict):
        return sum(map(size_of, value.values()))
    if is_dataclass(value):
        return sum(map(size_of, vars(value).values()))
    return sys.getsizeof(value)


MEMORY = Memory(2**30)
"""Scenes, headers, repeats, their series and fits: a gigabyte, so some 10 million collisions."""
