"""A repeat -> its file: in memory and at once if it is short, as its events come if it is long."""

from __future__ import annotations

import os
import platform
import re
import secrets
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from queue import Queue
from typing import Self

from h5py import h5f, h5g

from snooker_cli.errors import AbsentError
from snooker_cli.scene import Scene
from snooker_cli.store import hdf5
from snooker_cli.store.file_format import (
    Fingerprint,
    Provenance,
    append_events,
    create_events,
    skeleton,
    write_events,
    write_frame,
    write_summary,
)
from snooker_cli.trace import Events, Trace, joined

# The name of a file while it is being written: nobody else's, and known for this machine's.


def part_beside(path: Path) -> Path:
    """A new name beside ``path``, for writing what then replaces it."""
    return path.with_name(f"{path.name}.{_machine()}-{secrets.token_hex(8)}.part")


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A name beside ``path`` for what replaces it at the end, or is gone if anything goes wrong."""
    part = part_beside(path)
    try:
        yield part
        part.replace(path)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def parts_of_this_machine(directory: Path) -> Iterator[Path]:
    """What this machine has begun to write in a folder and not finished."""
    return directory.glob(f"*.{_machine()}-*.part")


@cache
def _machine() -> str:
    """The machine's name, as far as it can be in the name of a file."""
    return re.sub(r"[^A-Za-z0-9]", "_", platform.node())[:40]


ROWS = 65536
"""Events in a chunk of a file, 24 to 32 bytes each; longer repeats are written as they come."""

WAITING = 4
"""Chunks that may wait to be written before the simulation is held up."""


def write(path: Path, trace: Trace, provenance: Provenance) -> None:
    """Write a repeat's file, whole or not at all. Raises ``AbsentError``."""
    with Recorder(path, trace.start) as recorder:
        if trace.events is not None:
            recorder.add(trace.events)
        recorder.finish(trace, provenance)


class Recorder:
    """Takes a repeat's events as they come and makes its file, in bounded memory.

    Events beyond the first chunk are compressed and written by a thread of their own. Leaving the
    ``with`` block before ``finish`` leaves nothing behind.
    """

    def __init__(self, path: Path, start: Scene) -> None:
        self.path, self.start = path, start
        self._part = part_beside(path)
        self._fingerprint = Fingerprint()
        self._pending: list[Events] = []
        self._waiting = 0
        self._stream: _Stream | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        if self._stream is not None:
            self._stream.close()
        with suppress(OSError):
            self._part.unlink(missing_ok=True)

    def add(self, events: Events) -> None:
        """Take the next events. Raises ``AbsentError`` if those before could not be written."""
        self._pending.append(events)
        self._waiting += len(events)
        if self._stream is None and self._waiting <= ROWS:
            return
        try:
            if self._stream is None:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self._stream = _Stream(self._part, self.start, self._fingerprint)
            while self._waiting >= ROWS:
                self._stream.put(self._next(ROWS))
        except hdf5.UNWRITABLE as error:
            raise self._refusal(error) from None

    def finish(self, trace: Trace, provenance: Provenance) -> None:
        """Write the rest and put the file in its place. Raises ``AbsentError``.

        trace : its own events are not looked at, but those that were added
        """
        try:
            if self._stream is not None:
                self._stream.put(self._next(self._waiting))
                self._stream.finish(trace, provenance)
            else:
                image = self._image(trace, provenance)
                self.path.parent.mkdir(parents=True, exist_ok=True)
                with self._part.open("xb") as file:
                    file.write(image)
            with self._part.open("rb+") as file:
                os.fsync(file.fileno())
            self._part.replace(self.path)
        except hdf5.UNWRITABLE as error:
            raise self._refusal(error) from None

    def _next(self, rows: int) -> Events:
        """So many of the events that wait, which then do so no more."""
        waiting = joined(self._pending)
        self._pending = [waiting[rows:]]
        self._waiting -= rows
        return waiting[:rows]

    def _image(self, trace: Trace, provenance: Provenance) -> bytes:
        """The bytes of a short repeat's file."""
        name = f"repeat-{threading.get_ident()}"
        file = hdf5.in_memory(skeleton(self.start.number, self.start.shape), name)
        try:
            root = h5g.open(file, b"/")
            if trace.summary is None:
                events = self._next(self._waiting)
                self._fingerprint.add(events)
                write_events(root, events)
            else:
                write_summary(root, trace.summary)
            write_frame(root, trace, provenance, self._fingerprint)
            h5f.flush(file)
            return bytes(file.get_file_image())
        finally:
            file.close()

    def _refusal(self, error: Exception) -> AbsentError:
        """The sentence for a file that cannot be written."""
        return AbsentError(
            f"{self.path}: cannot write the result ({hdf5.said(error)}); make room or choose "
            "another folder with --out"
        )


class _Stream:
    """A file on the disk that grows by chunks of ``ROWS`` events, in a thread of its own."""

    def __init__(self, part: Path, start: Scene, fingerprint: Fingerprint) -> None:
        with part.open("xb") as file:
            file.write(skeleton(start.number, start.shape))
        self._file = hdf5.on_disk(part)
        self._root = h5g.open(self._file, b"/")
        self._columns = create_events(self._root, ROWS)
        self._fingerprint = fingerprint
        self._error: Exception | None = None
        self._queue: Queue[Events | None] = Queue(WAITING)
        self._thread = threading.Thread(target=self._work)
        self._thread.start()

    def put(self, events: Events) -> None:
        """Have events written; all but the last must be ``ROWS``. Raises what went wrong before."""
        if self._error is not None:
            raise self._error
        self._queue.put(events)

    def finish(self, trace: Trace, provenance: Provenance) -> None:
        """Write what is not events, and close the file."""
        self._stop()
        if self._error is not None:
            raise self._error
        write_frame(self._root, trace, provenance, self._fingerprint)
        self._file.close()

    def close(self) -> None:
        """Let go of the file, finished or not."""
        self._stop()
        with suppress(*hdf5.UNWRITABLE):
            self._file.close()

    def _stop(self) -> None:
        """End the thread when it has written what waits."""
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join()

    def _work(self) -> None:
        """Write what comes; after an error, only take it."""
        written = 0
        while (events := self._queue.get()) is not None:
            try:
                if self._error is None and len(events):
                    self._fingerprint.add(events)
                    append_events(self._root, self._columns, events, written, ROWS)
                    written += len(events)
            except Exception as error:  # raised where events are put
                self._error = error
