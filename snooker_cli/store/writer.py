"""Write a repeat's file: short repeats at their end, long ones while they are simulated."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import Circle
from snooker_cli.errors import AbsentError
from snooker_cli.files import discard, move_into_place, temporary_path
from snooker_cli.scene import Scene
from snooker_cli.store import file_format as layout
from snooker_cli.store import hdf5
from snooker_cli.store.file_format import Fingerprint, Provenance, write_h5md_group
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
    end of the ``with`` block leaves no file. All methods raise ``AbsentError`` for a file that
    cannot be written.
    """

    def __init__(self, path: Path, start: Scene) -> None:
        self.path, self.start = path, start
        self._part = temporary_path(path)
        self._fingerprint = Fingerprint()
        self._pending: list[Events] = []
        self._written = 0
        self._file: h5py.File | None = None
        self._thread = ThreadPoolExecutor(1)
        self._chunks: deque[Future[None]] = deque()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._thread.shutdown(cancel_futures=True)
        if self._file is not None:
            with suppress(*hdf5.UNWRITABLE):
                self._file.close()
        discard(self._part)

    def add(self, events: Events) -> None:
        """Take the next events."""
        self._pending.append(events)
        number = sum(map(len, self._pending))
        if self._file is None and number <= ROWS:
            return
        with self._refusals():
            if self._file is None:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self._file = hdf5.open_file(self._part, "x")
            while number >= ROWS:
                self._wait(WAITING)
                pending = joined(self._pending)
                self._pending = [pending[ROWS:]]
                number -= ROWS
                chunk = self._thread.submit(self._write_events, self._file, pending[:ROWS], ROWS)
                self._chunks.append(chunk)

    def finish(self, trace: Trace, provenance: Provenance) -> None:
        """Write the rest and put the file in its place.

        trace : its own events are ignored; those that were added are written
        """
        with self._refusals():
            if self._file is not None:
                self._wait(0)
                self._write_rest(self._file, trace, provenance)
                self._file.close()
            else:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                # In memory first: HDF5 may crash if a full disk refuses a whole file.
                with hdf5.open_file(self._part, "memory") as file:
                    self._write_rest(file, trace, provenance)
                    file.flush()
                    self._part.write_bytes(file.id.get_file_image())
            move_into_place(self._part, self.path)

    def _write_rest(self, file: h5py.File, trace: Trace, provenance: Provenance) -> None:
        """Write the summary or the last events, and all that is not events."""
        if trace.summary is not None:
            _write_summary(file, trace.summary)
        else:
            rest = joined(self._pending)
            self._write_events(file, rest, ROWS if self._file else _chunk(rest.time))
        _write_scenes(file, trace)
        _write_parameters(file, trace, provenance, self._fingerprint)

    def _wait(self, most: int) -> None:
        """Wait until at most this many chunks are left to write. Raises the error of one."""
        while len(self._chunks) > most:
            self._chunks.popleft().result()

    def _write_events(self, file: h5py.File, events: Events, chunk: int) -> None:
        """Write the next events, as a chunk or, with 0, all at once without compression."""
        before, self._written = self._written, self._written + len(events)
        if before and not len(events):
            return
        self._fingerprint.add(events)
        steps = np.arange(before + 1, self._written + 1, dtype=np.int64)
        pairs = np.stack([events.i, events.j], axis=1)[:, None, :]
        for path, values, unit in (
            (f"{layout.COLLISIONS}/value", pairs, "1"),
            (f"{layout.COLLISIONS}/step", steps, None),
            (f"{layout.COLLISIONS}/time", events.time, "s"),
            (f"{layout.IMPULSE}/value", events.impulse, "kg m s-1"),
        ):
            hdf5.write_rows(file, path, values, unit, chunk, before)
        if before == 0:
            file[layout.COLLISIONS].attrs["particles_group"] = file.create_group(layout.BALLS).ref
            hdf5.share_time(file, layout.IMPULSE, layout.COLLISIONS)
        if events.residual is not None:
            first = layout.RESIDUAL not in file
            hdf5.write_rows(file, f"{layout.RESIDUAL}/value", events.residual, "s", chunk, before)
            if first:
                hdf5.share_time(file, layout.RESIDUAL, layout.COLLISIONS)

    @contextmanager
    def _refusals(self) -> Iterator[None]:
        """Turn what HDF5 or the system refuses into an ``AbsentError``."""
        try:
            yield
        except hdf5.UNWRITABLE as error:
            raise AbsentError(
                self.path,
                f"cannot write the result ({hdf5.error_text(error)})",
                "make room or choose another folder with --out",
            ) from None


# The parts of a file.


def _chunk(values: NDArray[Any]) -> int:
    """The rows of the one chunk of a column that is written at once; 0 without compression."""
    return len(values) if values.size >= COMPRESS_FROM else 0


def _write_summary(file: h5py.File, summary: Summary) -> None:
    """Write the columns of a summary, which share one grid of times."""
    columns = {**vars(summary.series), "speed_histogram": summary.speed_histogram}
    time = columns.pop("time")
    hdf5.write_rows(file, f"{layout.SUMMARY_TIME}/step", np.arange(len(time)), None, _chunk(time))
    hdf5.write_rows(file, f"{layout.SUMMARY_TIME}/time", time, "s", _chunk(time))
    for name, values in columns.items():
        element, unit = f"{layout.SUMMARY}/{name}", SERIES_UNITS.get(name, "1")
        hdf5.write_rows(file, f"{element}/value", values, unit, _chunk(values))
        if element != layout.SUMMARY_TIME:
            hdf5.share_time(file, element, layout.SUMMARY_TIME)


def _write_scenes(file: h5py.File, trace: Trace) -> None:
    """Write the balls and the container at the start and the finish."""
    start, finish = trace.start, trace.finish
    step, time = np.array([0, trace.collisions]), np.array([0.0, trace.stop.time])
    balls = (
        np.stack([start.positions, finish.positions]),
        np.stack([start.velocities, finish.velocities]),
        start.masses,
        start.radii,
    )
    container = (
        np.stack([start.container_position, finish.container_position])[:, None, :],
        np.stack([start.container_velocity, finish.container_velocity])[:, None, :],
        np.array([start.container_mass]),
        np.array([getattr(start.container, "radius", math.nan)]),
    )
    for group, (positions, velocities, masses, radii) in (
        (layout.BALLS, balls),
        (layout.CONTAINER, container),
    ):
        for name, values, unit in (
            ("position/value", positions, "m"),
            ("position/step", step, None),
            ("position/time", time, "s"),
            ("velocity/value", velocities, "m s-1"),
            ("mass", masses, "kg"),
            ("radius", radii, "m"),
        ):
            hdf5.write_rows(file, f"{group}/{name}", values, unit)
        hdf5.share_time(file, f"{group}/velocity", f"{group}/position")
        box = file.create_group(f"{group}/box")
        box.attrs["dimension"] = 2
        boundary = b"none" if start.container.has_wall else b"periodic"
        box.attrs["boundary"] = np.array([boundary] * 2)
        if not isinstance(start.container, Circle):
            hdf5.write_rows(file, f"{group}/box/edges", np.array(start.container.size), "m")


def _write_parameters(
    file: h5py.File, trace: Trace, provenance: Provenance, fingerprint: Fingerprint
) -> None:
    """Write the h5md group, how the repeat ended, its provenance and the hash of all."""
    write_h5md_group(file)
    start, source = trace.start, json.dumps(asdict(provenance))
    ending = {
        **asdict(trace.stop),
        "wall_events": trace.wall_events,
        "pair_events": trace.pair_events,
        "shape": start.container.name,
        **{name: getattr(start, name) for name in layout.RULES},
    }
    parameters = file.create_group(layout.PARAMETERS).attrs
    parameters["schema_version"] = layout.SCHEMA_VERSION
    parameters["content"] = fingerprint.content(trace, source)
    parameters["provenance"] = source
    parameters["ending"] = json.dumps(ending)
