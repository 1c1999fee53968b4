"""Read a repeat's file: checked against its hash, or its header only."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from h5py import h5g
from numpy.typing import NDArray

from snooker_cli.containers import SHAPES, Circle
from snooker_cli.errors import AbsentError, StoreError
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
    RepeatHeader,
)
from snooker_cli.trace import SERIES_UNITS, Events, Series, Stop, StopReason, Summary, Trace

EVENTS_AT_A_TIME = 1 << 20
"""Events that are read at a time where they are not kept."""


class FileInfo(NamedTuple):
    """Size in bytes and time of the last change, ns since 1970, of a repeat's file."""

    size: int
    modified: int


def file_info(path: Path) -> FileInfo | None:
    """Size and age of a repeat's file; None if there is none."""
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return FileInfo(status.st_size, status.st_mtime_ns)


def read(path: Path) -> tuple[Trace, RepeatHeader]:
    """Read a repeat's file and check its content. Raises ``StoreError``."""
    with _opened(path) as (root, parameters):
        return _checked(root, parameters, path, keep_events=True)


def check(path: Path) -> RepeatHeader:
    """Check a repeat's file in bounded memory. Raises ``StoreError``.

    Checks the hash of the content, that HDF5 can open every object, and the numbers and times
    that only other readers use.
    """
    with _opened(path) as (root, parameters):
        trace, header = _checked(root, parameters, path, keep_events=False)
        hdf5.open_all(root)
        if not _is_numbered(root, trace):
            raise _changed(path)
    return header


def read_header(path: Path) -> RepeatHeader:
    """Read a file's header without checking its content. Raises ``StoreError``."""
    with _opened(path) as (_, parameters):
        ending = json.loads(hdf5.read_text(parameters, b"ending"))
        provenance = Provenance(**json.loads(hdf5.read_text(parameters, b"provenance")))
        return RepeatHeader(
            _stop(ending), ending["wall_events"] + ending["pair_events"], provenance
        )


def read_events(path: Path) -> Iterator[Events]:
    """A repeat's events in pieces, in bounded memory and unchecked. Raises ``StoreError``."""
    with _opened(path) as (root, _):
        yield from _events(root, EVENTS_AT_A_TIME)


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Any, Any]]:
    """A file's root and the group of snooker's own attributes. Raises ``StoreError``."""
    try:
        file = hdf5.open_file(path)
        try:
            parameters = h5g.open(file, PARAMETERS)
            version = hdf5.read_number(parameters, b"schema_version")
            if version != SCHEMA_VERSION:
                raise StoreError(
                    path,
                    f"is in version {version} of the files' schema, where this snooker reads "
                    f"version {SCHEMA_VERSION}",
                    "run it again",
                )
            yield h5g.open(file, b"/"), parameters
        finally:
            file.close()
    except FileNotFoundError:
        raise AbsentError(
            path, "there is no such result", "run the config, which simulates what is missing"
        ) from None
    except hdf5.UNREADABLE as error:
        reason = f"not a readable result of snooker ({hdf5.error_text(error)})"
        if path.is_dir():
            reason = "is a folder where a result's file should be"
        raise StoreError(path, reason, "delete it and run again") from None


def _checked(
    root: Any, parameters: Any, path: Path, *, keep_events: bool
) -> tuple[Trace, RepeatHeader]:
    """A repeat whose content has the hash that was written, with or without its events."""
    fingerprint = Fingerprint()
    trace = _trace(root, parameters)
    if trace.summary is None:
        for events in _events(root, None if keep_events else EVENTS_AT_A_TIME):
            fingerprint.add(events)
            if keep_events:
                trace = replace(trace, events=events)
    source = hdf5.read_text(parameters, b"provenance")
    provenance = Provenance(**json.loads(source))
    if fingerprint.content(trace, source) != hdf5.read_text(parameters, b"content"):
        raise _changed(path)
    content = fingerprint.content(trace)
    return trace, RepeatHeader(trace.stop, trace.collisions, provenance, trace.start, content)


def _changed(path: Path) -> StoreError:
    return StoreError(path, "its content has changed since it was written", "run it again")


def _is_numbered(root: Any, trace: Trace) -> bool:
    """Whether collisions or rows are counted from the first on, and both scenes have their step."""
    for group in (BALLS, CONTAINER):
        steps = hdf5.get(root, group + b"position/step", np.int64)
        times = hdf5.get(root, group + b"position/time")
        if [*steps, *times] != [0, trace.collisions, 0.0, trace.stop.time]:
            return False
    path, first = COLLISIONS + b"step", 1
    if trace.summary is not None:
        path, first = SUMMARY + b"kinetic_energy/step", 0
    return all(
        np.array_equal(
            hdf5.get(root, path, np.int64, rows), np.arange(first + rows.start, first + rows.stop)
        )
        for rows in _pieces(hdf5.length(root, path), EVENTS_AT_A_TIME)
    )


def _pieces(number: int, at_a_time: int) -> Iterator[slice]:
    """Slices that cover ``number`` rows; at least one."""
    for start in range(0, max(number, 1), at_a_time):
        yield slice(start, min(start + at_a_time, number))


def _trace(root: Any, parameters: Any) -> Trace:
    """A trace without its events."""
    ending = json.loads(hdf5.read_text(parameters, b"ending"))
    positions, velocities, masses, radii = _particles(root, BALLS)
    places, motions, container_mass, container_radius = _particles(root, CONTAINER)
    shape, lengths = SHAPES[ending["shape"]], container_radius
    if not issubclass(shape, Circle):
        lengths = hdf5.get(root, BALLS + b"box/edges")
    container = shape(*lengths.tolist())
    start, finish = (
        Scene(
            positions=positions[k],
            velocities=velocities[k],
            radii=radii,
            masses=masses,
            container=container,
            container_mass=float(container_mass[0]),
            container_position=places[k, 0],
            container_velocity=motions[k, 0],
            restitution=ending["restitution"],
            wall_restitution=ending["wall_restitution"],
            contact_duration=ending.get("contact_duration", 0.0),
            elastic_below=ending.get("elastic_below", 0.0),
            slides=ending.get("slides", False),
        )
        for k in (0, 1)
    )
    return Trace(
        start=start,
        finish=finish,
        stop=_stop(ending),
        wall_events=ending["wall_events"],
        pair_events=ending["pair_events"],
        events=None,
        summary=None if hdf5.exists(root, b"connectivity") else _summary(root),
    )


def _stop(ending: dict[str, Any]) -> Stop:
    return Stop(
        reason=StopReason(ending["reason"]),
        time=ending["time"],
        balls=tuple(ending["balls"]),
        message=ending["message"],
    )


def _particles(root: Any, group: bytes) -> list[NDArray[np.float64]]:
    """Positions, velocities, masses and radii."""
    names = (b"position/value", b"velocity/value", b"mass", b"radius")
    return [hdf5.get(root, group + name) for name in names]


def _events(root: Any, at_a_time: int | None) -> Iterator[Events]:
    """The events in pieces, or all at once."""
    number = hdf5.length(root, COLLISIONS + b"time")
    has_residual = hdf5.exists(root, RESIDUAL)
    for rows in _pieces(number, at_a_time or max(number, 1)):
        pairs = hdf5.get(root, COLLISIONS + b"value", np.int32, rows)
        yield Events(
            time=hdf5.get(root, COLLISIONS + b"time", rows=rows),
            i=np.ascontiguousarray(pairs[:, 0, 0]),
            j=np.ascontiguousarray(pairs[:, 0, 1]),
            impulse=hdf5.get(root, IMPULSE + b"value", rows=rows),
            residual=hdf5.get(root, RESIDUAL + b"value", rows=rows) if has_residual else None,
        )


def _summary(root: Any) -> Summary:
    """A summary's columns."""
    names = [name for name in SERIES_UNITS if name != "time"]
    columns = {name: hdf5.get(root, SUMMARY + name.encode() + b"/value") for name in names}
    return Summary(
        series=Series(time=hdf5.get(root, SUMMARY + b"kinetic_energy/time"), **columns),
        speed_histogram=hdf5.get(root, SUMMARY + b"speed_histogram/value", np.int64),
    )
