"""Write a repeat's file: short repeats at once from memory, long ones while they are simulated."""

from __future__ import annotations

import json
import math
import threading
from contextlib import suppress
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from queue import Queue
from typing import Any, Self

import h5py
import numpy as np
from h5py import h5f, h5g
from numpy.typing import NDArray

from snooker_cli.containers import Circle, Container
from snooker_cli.errors import AbsentError
from snooker_cli.files import discard, move_into_place, temporary_path
from snooker_cli.scene import Scene
from snooker_cli.store import hdf5
from snooker_cli.store.file_format import (
    BALLS,
    COLLISIONS,
    CONTAINER,
    IMPULSE,
    PARAMETERS,
    RESIDUAL,
    SCHEMA_VERSION,
    SUMMARY,
    Fingerprint,
    Provenance,
    write_h5md_group,
)
from snooker_cli.trace import SERIES_UNITS, Events, Summary, Trace, joined

ROWS = 65536
"""Events in a chunk of a file, 24 to 32 bytes each; longer repeats are written in chunks."""

WAITING = 4
"""Chunks that may wait to be written before the simulation has to wait."""

COMPRESS_FROM = 4096
"""Smaller datasets are not compressed: that would cost more time and space than it saves."""


def write(path: Path, trace: Trace, provenance: Provenance) -> None:
    """Write a repeat's file, whole or not at all. Raises ``AbsentError``."""
    with Recorder(path, trace.start) as recorder:
        if trace.events is not None:
            recorder.add(trace.events)
        recorder.finish(trace, provenance)


class Recorder:
    """Takes a repeat's events while they are simulated and writes its file, in bounded memory.

    Another thread compresses and writes events beyond the first chunk. Without ``finish``, the
    end of the ``with`` block leaves no file.
    """

    def __init__(self, path: Path, start: Scene) -> None:
        self.path, self.start = path, start
        self._part = temporary_path(path)
        self._fingerprint = Fingerprint()
        self._pending: list[Events] = []
        self._pending_rows = 0
        self._stream: _Stream | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        if self._stream is not None:
            self._stream.close()
        discard(self._part)

    def add(self, events: Events) -> None:
        """Take the next events. Raises ``AbsentError`` if earlier ones could not be written."""
        self._pending.append(events)
        self._pending_rows += len(events)
        if self._stream is None and self._pending_rows <= ROWS:
            return
        try:
            if self._stream is None:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self._stream = _Stream(self._part, self.start, self._fingerprint)
            while self._pending_rows >= ROWS:
                self._stream.put(self._take(ROWS))
        except hdf5.UNWRITABLE as error:
            raise self._refusal(error) from None

    def finish(self, trace: Trace, provenance: Provenance) -> None:
        """Write the rest and put the file in its place. Raises ``AbsentError``.

        trace : its own events are ignored; those that were added are written
        """
        try:
            if self._stream is not None:
                self._stream.put(self._take(self._pending_rows))
                self._stream.finish(trace, provenance)
            else:
                image = self._image(trace, provenance)
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self._part.write_bytes(image)
            move_into_place(self._part, self.path)
        except hdf5.UNWRITABLE as error:
            raise self._refusal(error) from None

    def _take(self, rows: int) -> Events:
        """Remove the first of the pending events."""
        pending = joined(self._pending)
        self._pending = [pending[rows:]]
        self._pending_rows -= rows
        return pending[:rows]

    def _image(self, trace: Trace, provenance: Provenance) -> bytes:
        """The bytes of a short repeat's file."""
        image = empty_file(self.start.number, type(self.start.container))
        file = hdf5.open_image(image, f"repeat-{threading.get_ident()}")
        try:
            root = h5g.open(file, b"/")
            if trace.summary is None:
                events = self._take(self._pending_rows)
                self._fingerprint.add(events)
                write_events(root, events, chunk=_chunk(events.time))
            else:
                write_summary(root, trace.summary)
            write_scenes(root, trace, provenance, self._fingerprint)
            h5f.flush(file)
            return bytes(file.get_file_image())
        finally:
            file.close()

    def _refusal(self, error: Exception) -> AbsentError:
        return AbsentError(
            self.path,
            f"cannot write the result ({hdf5.error_text(error)})",
            "make room or choose another folder with --out",
        )


class _Stream:
    """A file on the disk to which a thread adds chunks of ``ROWS`` events."""

    def __init__(self, part: Path, start: Scene, fingerprint: Fingerprint) -> None:
        part.write_bytes(empty_file(start.number, type(start.container)))
        self._file = hdf5.open_file(part, write=True)
        self._root = h5g.open(self._file, b"/")
        self._fingerprint = fingerprint
        self._error: Exception | None = None
        self._queue: Queue[Events | None] = Queue(WAITING)
        self._thread = threading.Thread(target=self._work)
        self._thread.start()

    def put(self, events: Events) -> None:
        """Queue events; all but the last must be ``ROWS``. Raises an error of earlier ones."""
        if self._error is not None:
            raise self._error
        self._queue.put(events)

    def finish(self, trace: Trace, provenance: Provenance) -> None:
        """Write what is not events, and close the file."""
        self._stop()
        if self._error is not None:
            raise self._error
        write_scenes(self._root, trace, provenance, self._fingerprint)
        self._file.close()

    def close(self) -> None:
        """Close the file, finished or not."""
        self._stop()
        with suppress(*hdf5.UNWRITABLE):
            self._file.close()

    def _stop(self) -> None:
        """End the thread after it has emptied the queue."""
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join()

    def _work(self) -> None:
        """Write what is queued; after an error, only empty the queue."""
        written = 0
        while (events := self._queue.get()) is not None:
            try:
                if self._error is None and len(events):
                    self._fingerprint.add(events)
                    write_events(self._root, events, written, ROWS)
                    written += len(events)
            except Exception as error:  # raised by the next ``put``
                self._error = error


# The parts of a file.


@lru_cache(maxsize=64)
def empty_file(balls: int, shape: type[Container]) -> bytes:
    """The bytes of a file without events, and with neither values nor attributes of a repeat.

    Creating these groups and datasets again takes longer than all other writing.
    """
    name = f"empty-{threading.get_ident()}"
    with h5py.File(name, "w", driver="core", backing_store=False, libver=hdf5.FORMAT) as file:
        write_h5md_group(file)
        file.create_group("parameters/snooker").attrs["schema_version"] = SCHEMA_VERSION
        for group, number in ((BALLS, balls), (CONTAINER, 1)):
            _create_particles(file, group, number, shape)
        file.flush()
        return bytes(file.id.get_file_image())


def _create_particles(file: h5py.File, group: bytes, number: int, shape: type[Container]) -> None:
    """Create the datasets of a group of particles at the start and the finish."""
    root = file["/"].id
    box = file.create_group(group.decode() + "box")
    box.attrs["dimension"] = 2
    box.attrs["boundary"] = np.array([b"none" if shape.has_wall else b"periodic"] * 2)
    if not issubclass(shape, Circle):
        hdf5.create(root, group + b"box/edges", (2,), np.float64, "m")
    hdf5.create(root, group + b"position/value", (2, number, 2), np.float64, "m")
    hdf5.create(root, group + b"position/step", (2,), np.int64)
    hdf5.create(root, group + b"position/time", (2,), np.float64, "s")
    hdf5.create(root, group + b"velocity/value", (2, number, 2), np.float64, "m s-1")
    _share_time(root, group + b"velocity/", group + b"position/")
    hdf5.create(root, group + b"mass", (number,), np.float64, "kg")
    hdf5.create(root, group + b"radius", (number,), np.float64, "m")


def write_events(root: Any, events: Events, before: int = 0, chunk: int = 0) -> None:
    """Write events after ``before`` others, as a chunk; 0 for all at once without compression."""
    steps = np.arange(before + 1, before + 1 + len(events), dtype=np.int64)
    pairs = np.stack([events.i, events.j], axis=1)[:, None, :]
    _write_rows(root, COLLISIONS + b"value", pairs, "1", chunk, before)
    _write_rows(root, COLLISIONS + b"step", steps, None, chunk, before)
    _write_rows(root, COLLISIONS + b"time", events.time, "s", chunk, before)
    _write_rows(root, IMPULSE + b"value", events.impulse, "kg m s-1", chunk, before)
    if before == 0:
        hdf5.write_reference(root, COLLISIONS, b"particles_group", b"particles/balls")
        _share_time(root, IMPULSE, COLLISIONS)
    if events.residual is not None:
        first = not hdf5.exists(root, RESIDUAL + b"value")
        _write_rows(root, RESIDUAL + b"value", events.residual, "s", chunk, before)
        if first:
            _share_time(root, RESIDUAL, COLLISIONS)


def write_summary(root: Any, summary: Summary) -> None:
    """Write the columns of a summary, which share one grid of times."""
    columns = {**vars(summary.series), "speed_histogram": summary.speed_histogram}
    time = columns.pop("time")
    shared = SUMMARY + b"kinetic_energy/"
    for name, values in columns.items():
        group = SUMMARY + name.encode() + b"/"
        _write_rows(root, group + b"value", values, SERIES_UNITS.get(name, "1"), _chunk(values))
        if group == shared:
            _write_rows(root, group + b"step", np.arange(len(time)), None, _chunk(time))
            _write_rows(root, group + b"time", time, "s", _chunk(time))
        else:
            _share_time(root, group, shared)


def _chunk(values: NDArray[Any]) -> int:
    """The rows of the one chunk of a column that is written at once; 0 without compression."""
    return len(values) if values.size >= COMPRESS_FROM else 0


def _write_rows(
    root: Any, path: bytes, values: NDArray[Any], unit: str | None, chunk: int, before: int = 0
) -> None:
    """Write a column, or the chunk of it after ``before`` rows."""
    if not hdf5.exists(root, path):
        shape = (0 if chunk else len(values), *values.shape[1:])
        hdf5.create(root, path, shape, values.dtype, unit, chunk)
    if chunk:
        hdf5.append(root, path, before, values, chunk)
    else:
        hdf5.fill(root, path, values)


def _share_time(root: Any, group: bytes, source: bytes) -> None:
    """Link steps and times of an element to those of another."""
    for name in (b"step", b"time"):
        hdf5.link(root, group + name, source + name)


def write_scenes(root: Any, trace: Trace, provenance: Provenance, fingerprint: Fingerprint) -> None:
    """Write the start, the finish, how the repeat ended, and its provenance."""
    start, finish = trace.start, trace.finish
    step, time = np.array([0, trace.collisions]), np.array([0.0, trace.stop.time])
    groups = {
        BALLS: (
            (start.positions, finish.positions),
            (start.velocities, finish.velocities),
            start.masses,
            start.radii,
        ),
        CONTAINER: (
            (start.container_position[None], finish.container_position[None]),
            (start.container_velocity[None], finish.container_velocity[None]),
            np.array([start.container_mass]),
            np.array([getattr(start.container, "radius", math.nan)]),
        ),
    }
    for group, (positions, velocities, masses, radii) in groups.items():
        hdf5.fill(root, group + b"position/step", step)
        hdf5.fill(root, group + b"position/time", time)
        hdf5.fill(root, group + b"position/value", np.stack(positions))
        hdf5.fill(root, group + b"velocity/value", np.stack(velocities))
        hdf5.fill(root, group + b"mass", masses)
        hdf5.fill(root, group + b"radius", radii)
        if not isinstance(start.container, Circle):
            hdf5.fill(root, group + b"box/edges", np.array(start.container.size))
    ending = {
        **asdict(trace.stop),
        "wall_events": trace.wall_events,
        "pair_events": trace.pair_events,
        "shape": start.container.name,
        "restitution": start.restitution,
        "wall_restitution": start.wall_restitution,
        "contact_duration": start.contact_duration,
        "elastic_below": start.elastic_below,
        "slides": start.slides,
    }
    source = json.dumps(asdict(provenance))
    parameters = h5g.open(root, PARAMETERS)
    hdf5.write_text(parameters, b"content", fingerprint.content(trace, source))
    hdf5.write_text(parameters, b"provenance", source)
    hdf5.write_text(parameters, b"ending", json.dumps(ending))
