"""Read a batch's file: its repeats, checked against their hashes, or their headers only."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
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
    """Size in bytes and time of the last change, ns since 1970, of a batch's file."""

    size: int
    modified: int


def file_info(path: Path) -> FileInfo | None:
    """Size and age of a batch's file; None if there is none."""
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return FileInfo(status.st_size, status.st_mtime_ns)


def read(path: Path, wanted: Collection[int] | None = None) -> list[tuple[Trace, RepeatHeader]]:
    """Read and check all repeats of a batch's file, or those of some numbers, in order.

    Raises ``StoreError``.
    """
    with _opened(path) as file:
        return list(_checked(file, path, wanted, keep_events=True))


def check(path: Path) -> list[RepeatHeader]:
    """Check a batch's file in bounded memory. Raises ``StoreError``.

    Checks the hash of the content, and that HDF5 can open every object.
    """
    with _opened(path) as file:
        headers = [header for _, header in _checked(file, path, None, keep_events=False)]
        hdf5.open_all(file.id)
    return headers


def read_headers(path: Path) -> list[RepeatHeader]:
    """Read the headers of a file's repeats without checking the content. Raises ``StoreError``."""
    with _opened(path) as file:
        return _headers(file, path)


def read_checkpoint(path: Path) -> dict[str, NDArray[Any]] | None:
    """The arrays from which a repeat is continued; ``None`` without. Raises ``StoreError``."""
    with _opened(path) as file:
        if layout.CHECKPOINT not in file:
            return None
        group = file[layout.CHECKPOINT]
        found = {name: np.asarray(data[()]) for name, data in group.items()}
        if layout.checkpoint_hash(found) != group.attrs["content"]:
            raise _changed(path)
        return found


def read_events(path: Path, repeat: int) -> Iterator[Events]:
    """A repeat's events in pieces, in bounded memory and unchecked. Raises ``StoreError``."""
    with _opened(path) as file:
        numbers = [header.repeat for header in _headers(file, path)]
        rows = _rows(file)[numbers.index(repeat)]
        yield from map(_without_zeros, events_in(file, rows, EVENTS_AT_A_TIME))


@contextmanager
def _opened(path: Path) -> Iterator[h5py.File]:
    """A batch's file. Raises ``StoreError``."""
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


def _headers(file: h5py.File, path: Path) -> list[RepeatHeader]:
    """What a file says of its repeats."""
    numbers = hdf5.read_rows(file, layout.REPEATS, np.int64).tolist()
    contents = hdf5.read_text(file, layout.CONTENTS)
    source = _parameter(file, "provenance")
    if layout.seal(source, numbers, contents) != _parameter(file, "content"):
        raise _changed(path)
    provenance = Provenance(**json.loads(source))
    endings = map(json.loads, hdf5.read_text(file, layout.ENDINGS))
    return [
        RepeatHeader(
            number, _stop(one), one["wall_events"] + one["pair_events"], provenance, content
        )
        for number, one, content in zip(numbers, endings, contents, strict=True)
    ]


def _rows(file: h5py.File) -> list[slice]:
    """Which rows of the events or summaries each repeat has."""
    ends = hdf5.read_rows(file, layout.ROWS, np.int64).tolist()
    return [slice(*each) for each in pairwise(ends)]


def _checked(
    file: h5py.File, path: Path, wanted: Collection[int] | None, *, keep_events: bool
) -> Iterator[tuple[Trace, RepeatHeader]]:
    """Repeats whose content has the hash that was written, with or without their events."""
    headers, rows = _headers(file, path), _rows(file)
    chosen = [k for k, header in enumerate(headers) if wanted is None or header.repeat in wanted]
    if wanted is not None and len(chosen) < len(wanted):
        raise _changed(path)
    traces = _traces(file, chosen)
    columns = None
    if keep_events and "connectivity" in file and len(chosen) > 1:
        columns = next(events_in(file, slice(None), None))
    for k, trace in zip(chosen, traces, strict=True):
        fingerprint = Fingerprint()
        if trace.summary is None:
            at_a_time = None if keep_events else EVENTS_AT_A_TIME
            parts = events_in(file, rows[k], at_a_time) if columns is None else [columns[rows[k]]]
            for events in map(_without_zeros, parts):
                fingerprint.add(events)
                if keep_events:
                    trace = replace(trace, events=events)
        if fingerprint.content(trace) != headers[k].fingerprint:
            raise _changed(path)
        yield trace, headers[k]


def _changed(path: Path) -> StoreError:
    return StoreError(path, "its content has changed since it was written", "run it again")


def _traces(file: h5py.File, chosen: Sequence[int]) -> list[Trace]:
    """Some of the traces of a file, without their events."""
    balls, container = (_particles(file, group) for group in (layout.BALLS, layout.CONTAINER))
    lengths = container.radius
    rules = json.loads(_parameter(file, "scene"))
    shape = SHAPES[rules.pop("shape")]
    if not issubclass(shape, Circle):
        lengths = hdf5.read_rows(file, f"{layout.BALLS}/box/edges")[: len(shape.keys)]
    common = {
        "radii": balls.radius,
        "masses": balls.mass,
        "container": shape(*lengths.tolist()),
        "container_mass": float(container.mass[0]),
        **rules,
    }
    endings = [json.loads(each) for each in hdf5.read_text(file, layout.ENDINGS)]
    summaries = [None] * len(endings) if "connectivity" in file else _summaries(file)
    found = []
    for k in chosen:
        start, finish = (
            Scene(
                positions=balls.position[row],
                velocities=balls.velocity[row],
                container_position=container.position[row, 0],
                container_velocity=container.velocity[row, 0],
                **common,
            )
            for row in (2 * k, 2 * k + 1)
        )
        found.append(
            Trace(
                start=start,
                finish=finish,
                stop=_stop(endings[k]),
                wall_events=endings[k]["wall_events"],
                pair_events=endings[k]["pair_events"],
                events=None,
                summary=summaries[k],
            )
        )
    return found


class Particles(NamedTuple):
    """Of balls or the container: at the start and the finish of each repeat, and for good."""

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    mass: NDArray[np.float64]
    radius: NDArray[np.float64]


def _particles(file: h5py.File, group: str) -> Particles:
    names = ("position/value", "velocity/value", "mass", "radius")
    return Particles(*(hdf5.read_rows(file, f"{group}/{name}") for name in names))


def _stop(ending: dict[str, Any]) -> Stop:
    return Stop(
        StopReason(ending["reason"]),
        ending["time"],
        tuple(ending["balls"]),
        ending["message"],
        ending.get("accumulation_time"),
        ending.get("impulse_to_come"),
    )


def events_in(file: h5py.File, rows: slice, at_a_time: int | None) -> Iterator[Events]:
    """The events in these rows, in pieces or all at once; at least one piece."""
    first, last, _ = rows.indices(hdf5.length(file, f"{layout.TIME}/value"))
    has_residual = file.id.links.exists(layout.RESIDUAL.encode())
    at_a_time = at_a_time or max(last - first, 1)
    for start in range(first, max(last, first + 1), at_a_time):
        some = slice(start, min(start + at_a_time, last))
        pairs = hdf5.read_rows(file, f"{layout.COLLISIONS}/value", np.int32, some)
        i, j = np.ascontiguousarray(pairs[:, 0].T)
        time = hdf5.read_rows(file, f"{layout.TIME}/value", rows=some)
        impulse = hdf5.read_rows(file, f"{layout.IMPULSE}/value", rows=some)
        residual = None
        if has_residual:
            residual = hdf5.read_rows(file, f"{layout.RESIDUAL}/value", rows=some)
        yield Events(time, i, j, impulse, residual)


def _without_zeros(events: Events) -> Events:
    """Events without residuals if those are all zero: another repeat of the file has some."""
    if events.residual is None or events.residual.any():
        return events
    return replace(events, residual=None)


def _summaries(file: h5py.File) -> list[Summary]:
    """The summaries of all repeats."""
    columns = {
        name: hdf5.read_rows(file, f"{layout.SUMMARY}/{name}/value") for name in SERIES_UNITS
    }
    counts = hdf5.read_rows(file, f"{layout.SUMMARY}/speed_histogram/value", np.int64)
    return [
        Summary(Series(**{name: values[rows] for name, values in columns.items()}), counts[rows])
        for rows in _rows(file)
    ]
