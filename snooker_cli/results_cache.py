"""What follows from results: computed once and kept, up to a total size.

A command that needs it several times keeps it in ``MEMORY``. The next command finds analyses and
certificates in the user's cache folder, by a hash of all that they were made from. So nothing of a
stranger is read, and a run's folder holds its results alone.
"""

import hashlib
import json
import logging
import os
import sys
import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from contextlib import suppress
from dataclasses import is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from snooker_cli.errors import error_text
from snooker_cli.files import cache_within, discard, temporary_path

Result = TypeVar("Result")

_log = logging.getLogger(__name__)


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


# Between commands.

MOST_BYTES = 2**28
"""Bytes of the files in the cache folder: analyses of some 10,000 points."""

KEPT_PART = 0.75
"""Of these bytes, where files must go; so that the next ones have room."""

ROOM: dict[Path, int] = {}
"""Bytes that this process may add to a folder until it looks at all files there again."""


def from_cache(
    origin: Sequence[Any],
    make: Callable[[], Result],
    is_final: Callable[[Result], bool] = lambda _: True,
) -> Result:
    """What ``make`` gives, or gave before for the same origin; a value that JSON can have.

    origin : values that JSON can have: hashes of the results, of the sources and of the options
    is_final : whether a new value is kept

    Without a folder for it, or with a file that cannot be read, it is made.
    """
    folder = _folder(os.environ.get("SNOOKER_CACHE_DIR"))
    if folder is None:
        return make()
    name = hashlib.sha256(json.dumps(origin).encode()).hexdigest()
    path = folder / f"{name}.json"
    with suppress(OSError, ValueError, RecursionError):
        kept: Result = json.loads(path.read_text(encoding="utf-8"))
        with suppress(OSError):
            os.utime(path)  # it was used now
        return kept
    value = make()
    if is_final(value):
        try:
            _write(path, json.dumps(value, allow_nan=False))
        except OSError as error:
            _log.warning(
                "%s: cannot be written (%s); the result is not kept", path, error_text(error)
            )
    return value


@cache
def _folder(chosen: str | None) -> Path | None:
    """The folder of kept results, which no other user can change; ``None`` if there is none.

    chosen : the folder that the user has set for it
    """
    try:
        return cache_within(chosen, "analyses")
    except OSError as error:
        reason = error.strerror or str(error)
    advice = "set SNOOKER_CACHE_DIR to a folder that only you can write to"
    _log.warning("the folder for kept results cannot be used (%s); %s", reason, advice)
    return None


def _write(path: Path, text: str) -> None:
    """Write a file whole or not at all; others that were not used for long make room for it."""
    part = temporary_path(path)
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(path)  # not flushed to the disk: what a machine loses is made again
    finally:
        discard(part)
    folder = path.parent
    ROOM[folder] = ROOM.get(folder, 0) - len(text)  # JSON is ASCII
    if ROOM[folder] < 0:
        ROOM[folder] = MOST_BYTES - _forget_oldest(folder)


def _forget_oldest(folder: Path) -> int:
    """Delete the files that were not used for longest if all have too many bytes; bytes left."""
    files = []
    for file in folder.iterdir():
        with suppress(OSError):  # another process may forget it at the same time
            status = file.stat()
            files.append((status.st_mtime_ns, status.st_size, file))
    total = sum(size for _, size, _ in files)
    kept = MOST_BYTES if total <= MOST_BYTES else KEPT_PART * MOST_BYTES
    for _, size, file in sorted(files)[:-1]:
        if total <= kept:
            break
        discard(file)
        total -= size
    return total
