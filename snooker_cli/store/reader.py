"""Read a repeat's file: checked against its hash, or its header only."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import SHAPES, Circle
from snooker_cli.errors import AbsentError, StoreError
from snooker_cli.scene import Scene
from snooker_cli.store import file_format as layout
from snooker_cli.store import hdf5
from snooker_cli.store.file_format import Fingerprint, Provenance, RepeatHeader
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
    with _opened(path) as file:
        return _checked(file, path, keep_events=True)


def check(path: Path) -> RepeatHeader:
    """Check a repeat's file in bounded memory. Raises ``StoreError``.

    Checks the hash of the content, that HDF5 can open every object, and the numbers and times
    that only other readers use.
    """
    with _opened(path) as file:
        trace, header = _checked(file, path, keep_events=False)
        hdf5.open_all(file.id)
        if not _is_numbered(file, trace):
            raise _changed(path)
    return header


def read_header(path: Path) -> RepeatHeader:
    """Read a file's header without checking its content. Raises ``StoreError``."""
    with _opened(path) as file:
        ending, provenance = (
            json.loads(_parameter(file, name)) for name in ("ending", "provenance")
        )
        collisions = ending["wall_events"] + ending["pair_events"]
        return RepeatHeader(_stop(ending), collisions, Provenance(**provenance))


def read_events(path: Path) -> Iterator[Events]:
    """A repeat's events in pieces, in bounded memory and unchecked. Raises ``StoreError``."""
    with _opened(path) as file:
        yield from _events(file, EVENTS_AT_A_TIME)


@contextmanager
def _opened(path: Path) -> Iterator[h5py.File]:
    """A repeat's file. Raises ``StoreError``."""
    try:
        with hdf5.open_file(path) as file:
            version = _parameter(file, "schema_version")
            if version != layout.SCHEMA_VERSION:
                raise StoreError(
                    path,
                    f"is in version {version} of the files' schema, where this snooker reads "
                    f"version {layout.SCHEMA_VERSION}",
                    "run it again",
                )
            yield file
    except FileNotFoundError:
        raise AbsentError(
            path, "there is no such result", "run the config, which simulates what is missing"
        ) from None
    except hdf5.UNREADABLE as error:
        reason = f"not a readable result of snooker ({hdf5.error_text(error)})"
        if path.is_dir():
            reason = "is a folder where a result's file should be"
        raise StoreError(path, reason, "delete it and run again") from None


def _parameter(file: h5py.File, name: str) -> Any:
    """One of snooker's own attributes."""
    return hdf5.read_attribute(file, layout.PARAMETERS, name)


def _checked(file: h5py.File, path: Path, *, keep_events: bool) -> tuple[Trace, RepeatHeader]:
    """A repeat whose content has the hash that was written, with or without its events."""
    fingerprint = Fingerprint()
    trace = _trace(file, json.loads(_parameter(file, "ending")))
    if trace.summary is None:
        for events in _events(file, None if keep_events else EVENTS_AT_A_TIME):
            fingerprint.add(events)
            if keep_events:
                trace = replace(trace, events=events)
    source = _parameter(file, "provenance")
    if fingerprint.content(trace, source) != _parameter(file, "content"):
        raise _changed(path)
    content, provenance = fingerprint.content(trace), Provenance(**json.loads(source))
    return trace, RepeatHeader(trace.stop, trace.collisions, provenance, trace.start, content)


def _changed(path: Path) -> StoreError:
    return StoreError(path, "its content has changed since it was written", "run it again")


def _is_numbered(file: h5py.File, trace: Trace) -> bool:
    """Whether collisions or rows are counted from the first on, and both scenes have their step."""
    for group in (layout.BALLS, layout.CONTAINER):
        steps = hdf5.read_rows(file, f"{group}/position/step", np.int64)
        times = hdf5.read_rows(file, f"{group}/position/time")
        if [*steps, *times] != [0, trace.collisions, 0.0, trace.stop.time]:
            return False
    element, first = (layout.COLLISIONS, 1) if trace.summary is None else (layout.SUMMARY_TIME, 0)
    counted = f"{element}/step"
    return all(
        np.array_equal(
            hdf5.read_rows(file, counted, np.int64, rows),
            np.arange(first + rows.start, first + rows.stop),
        )
        for rows in _pieces(hdf5.length(file, counted), EVENTS_AT_A_TIME)
    )


def _pieces(number: int, at_a_time: int) -> Iterator[slice]:
    """Slices that cover ``number`` rows; at least one."""
    for start in range(0, max(number, 1), at_a_time):
        yield slice(start, min(start + at_a_time, number))


def _trace(file: h5py.File, ending: dict[str, Any]) -> Trace:
    """A trace without its events."""
    positions, velocities, masses, radii = _particles(file, layout.BALLS)
    places, motions, container_mass, lengths = _particles(file, layout.CONTAINER)
    shape = SHAPES[ending["shape"]]
    if not issubclass(shape, Circle):
        lengths = hdf5.read_rows(file, f"{layout.BALLS}/box/edges")[: len(shape.keys)]
    common = {
        "radii": radii,
        "masses": masses,
        "container": shape(*lengths.tolist()),
        "container_mass": float(container_mass[0]),
        **{name: ending[name] for name in layout.RULES if name in ending},
    }
    start, finish = (
        Scene(
            positions=positions[k],
            velocities=velocities[k],
            container_position=places[k, 0],
            container_velocity=motions[k, 0],
            **common,
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
        summary=None if "connectivity" in file else _summary(file),
    )


def _particles(file: h5py.File, group: str) -> list[NDArray[np.float64]]:
    """Positions and velocities at the start and the finish, masses and radii."""
    names = ("position/value", "velocity/value", "mass", "radius")
    return [hdf5.read_rows(file, f"{group}/{name}") for name in names]


def _stop(ending: dict[str, Any]) -> Stop:
    names = (field.name for field in fields(Stop))
    stop = Stop(**{name: ending[name] for name in names})
    return replace(stop, reason=StopReason(stop.reason), balls=tuple(stop.balls))


def _events(file: h5py.File, at_a_time: int | None) -> Iterator[Events]:
    """The events in pieces, or all at once."""
    number = hdf5.length(file, f"{layout.COLLISIONS}/time")
    has_residual = file.id.links.exists(layout.RESIDUAL.encode())
    for rows in _pieces(number, at_a_time or max(number, 1)):
        pairs = hdf5.read_rows(file, f"{layout.COLLISIONS}/value", np.int32, rows)
        i, j = np.ascontiguousarray(pairs[:, 0].T)
        time = hdf5.read_rows(file, f"{layout.COLLISIONS}/time", rows=rows)
        impulse = hdf5.read_rows(file, f"{layout.IMPULSE}/value", rows=rows)
        residual = None
        if has_residual:
            residual = hdf5.read_rows(file, f"{layout.RESIDUAL}/value", rows=rows)
        yield Events(time, i, j, impulse, residual)


def _summary(file: h5py.File) -> Summary:
    """A summary's columns."""
    names = [name for name in SERIES_UNITS if name != "time"]
    columns = {name: hdf5.read_rows(file, f"{layout.SUMMARY}/{name}/value") for name in names}
    return Summary(
        Series(time=hdf5.read_rows(file, f"{layout.SUMMARY_TIME}/time"), **columns),
        hdf5.read_rows(file, f"{layout.SUMMARY}/speed_histogram/value", np.int64),
    )
