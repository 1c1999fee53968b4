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
        ending, provenance = _parameter(file, "ending"), _parameter(file, "provenance")
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
            version = file[layout.PARAMETERS].attrs["schema_version"]
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


def _parameter(file: h5py.File, name: str) -> dict[str, Any]:
    """An attribute that is JSON."""
    return dict(json.loads(file[layout.PARAMETERS].attrs[name]))


def _checked(file: h5py.File, path: Path, *, keep_events: bool) -> tuple[Trace, RepeatHeader]:
    """A repeat whose content has the hash that was written, with or without its events."""
    fingerprint = Fingerprint()
    trace = _trace(file)
    if trace.summary is None:
        for events in _events(file, None if keep_events else EVENTS_AT_A_TIME):
            fingerprint.add(events)
            if keep_events:
                trace = replace(trace, events=events)
    parameters = file[layout.PARAMETERS].attrs
    if fingerprint.content(trace, parameters["provenance"]) != parameters["content"]:
        raise _changed(path)
    provenance = Provenance(**_parameter(file, "provenance"))
    content = fingerprint.content(trace)
    return trace, RepeatHeader(trace.stop, trace.collisions, provenance, trace.start, content)


def _changed(path: Path) -> StoreError:
    return StoreError(path, "its content has changed since it was written", "run it again")


def _is_numbered(file: h5py.File, trace: Trace) -> bool:
    """Whether collisions or rows are counted from the first on, and both scenes have their step."""
    for group in (layout.BALLS, layout.CONTAINER):
        steps, times = file[f"{group}/position/step"][:], file[f"{group}/position/time"][:]
        if [*steps, *times] != [0, trace.collisions, 0.0, trace.stop.time]:
            return False
    element, first = (layout.COLLISIONS, 1) if trace.summary is None else (layout.SUMMARY_TIME, 0)
    steps = file[f"{element}/step"]
    return all(
        np.array_equal(steps[rows], np.arange(first + rows.start, first + rows.stop))
        for rows in _pieces(len(steps), EVENTS_AT_A_TIME)
    )


def _pieces(number: int, at_a_time: int) -> Iterator[slice]:
    """Slices that cover ``number`` rows; at least one."""
    for start in range(0, max(number, 1), at_a_time):
        yield slice(start, min(start + at_a_time, number))


def _trace(file: h5py.File) -> Trace:
    """A trace without its events."""
    ending = _parameter(file, "ending")
    balls, container = file[layout.BALLS], file[layout.CONTAINER]
    shape, lengths = SHAPES[ending["shape"]], container["radius"]
    if not issubclass(shape, Circle):
        lengths = balls["box/edges"]
    common = {
        "radii": balls["radius"][:],
        "masses": balls["mass"][:],
        "container": shape(*lengths[:].tolist()),
        "container_mass": float(container["mass"][0]),
        **{name: ending[name] for name in layout.RULES if name in ending},
    }
    start, finish = (
        Scene(
            positions=balls["position/value"][k],
            velocities=balls["velocity/value"][k],
            container_position=container["position/value"][k, 0],
            container_velocity=container["velocity/value"][k, 0],
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
        summary=None if "connectivity" in file else _summary(file[layout.SUMMARY]),
    )


def _stop(ending: dict[str, Any]) -> Stop:
    names = (field.name for field in fields(Stop))
    stop = Stop(**{name: ending[name] for name in names})
    return replace(stop, reason=StopReason(stop.reason), balls=tuple(stop.balls))


def _events(file: h5py.File, at_a_time: int | None) -> Iterator[Events]:
    """The events in pieces, or all at once."""
    times, pairs = file[f"{layout.COLLISIONS}/time"], file[f"{layout.COLLISIONS}/value"]
    impulses = file[f"{layout.IMPULSE}/value"]
    residuals = file.get(f"{layout.RESIDUAL}/value")
    for rows in _pieces(len(times), at_a_time or max(len(times), 1)):
        i, j = np.ascontiguousarray(pairs[rows, 0].T)
        residual = None if residuals is None else residuals[rows]
        yield Events(times[rows], i, j, impulses[rows], residual)


def _summary(group: h5py.Group) -> Summary:
    """A summary's columns."""
    columns = {name: group[f"{name}/value"][:] for name in SERIES_UNITS if name != "time"}
    time = group.file[f"{layout.SUMMARY_TIME}/time"][:]
    return Summary(Series(time=time, **columns), group["speed_histogram/value"][:])
