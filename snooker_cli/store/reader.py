"""A repeat's file -> its trace, checked against the hash that is in it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from h5py import h5g
from numpy.typing import NDArray

from snooker_cli.errors import AbsentError, StoreError
from snooker_cli.scene import Scene
from snooker_cli.store import hdf5
from snooker_cli.store.file_format import (
    RESIDUAL,
    SCHEMA_VERSION,
    Checked,
    Fingerprint,
    Provenance,
    RepeatHeader,
    Stored,
)
from snooker_cli.trace import SERIES_UNITS, Events, Series, Stop, StopReason, Summary, Trace

AT_ONCE = 1 << 20
"""Events that are read at a time where they need not be kept."""


@dataclass(frozen=True)
class About:
    """A repeat's file as the system knows it.

    bytes : its size
    modified : when it was put in its place, ns since 1970
    """

    bytes: int
    modified: int


def about(path: Path) -> About | None:
    """What the system knows of a repeat's file; ``None`` if there is none."""
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return About(status.st_size, status.st_mtime_ns)


def read(path: Path) -> Stored:
    """Read a repeat's file and check its content. Raises ``StoreError``."""
    with _opened(path) as root:
        trace, provenance, _ = _verified(root, path, keep=True)
    return Stored(trace, provenance)


def check(path: Path) -> Checked:
    """Check a repeat's file, in bounded memory. Raises ``StoreError``.

    Its content, by the hash; that HDF5 can open all there is; and what is only there for other
    readers: the numbers of collisions, and the steps and times of start and finish.
    """
    with _opened(path) as root:
        trace, provenance, fingerprint = _verified(root, path, keep=False)
        hdf5.open_all(root)
        if not _is_numbered(root, trace):
            raise _changed(path)
    bits = fingerprint.content(trace, "")
    return Checked(trace.stop, trace.collisions, provenance, trace.start, bits)


def glance(path: Path) -> RepeatHeader:
    """What a repeat's file says of itself; its content is not looked at. Raises ``StoreError``."""
    with _opened(path) as root:
        own = _own(root, path)
        ending = json.loads(hdf5.read_text(own, b"ending"))
        provenance = Provenance(**json.loads(hdf5.read_text(own, b"provenance")))
        return RepeatHeader(
            _stop(ending), ending["wall_events"] + ending["pair_events"], provenance
        )


def events(path: Path) -> Iterator[Events]:
    """A repeat's events, some at a time, in bounded memory; ``check`` is who checks them.

    Raises ``StoreError``.
    """
    with _opened(path) as root:
        _own(root, path)
        yield from _events(root, AT_ONCE)


def _verified(root: Any, path: Path, *, keep: bool) -> tuple[Trace, Provenance, Fingerprint]:
    """A repeat whose content is as it was written; its events only if they are to be kept."""
    fingerprint = Fingerprint()
    own = _own(root, path)
    trace = _trace(root)
    if trace.summary is None:
        for events in _events(root, None if keep else AT_ONCE):
            fingerprint.add(events)
            if keep:
                trace = replace(trace, events=events)
    expected, said = hdf5.read_text(own, b"content"), hdf5.read_text(own, b"provenance")
    provenance = Provenance(**json.loads(said))
    if fingerprint.content(trace, said) != expected:
        raise _changed(path)
    return trace, provenance, fingerprint


def _changed(path: Path) -> StoreError:
    """What is said of a file with other values than were written."""
    return StoreError(f"{path}: its content has changed since it was written; run it again")


def _is_numbered(root: Any, trace: Trace) -> bool:
    """Whether collisions or rows are counted one by one, and start and finish stand at theirs."""
    for group in (b"particles/balls/position/", b"particles/container/position/"):
        steps = hdf5.get(root, group + b"step", np.int64)
        times = hdf5.get(root, group + b"time")
        if [*steps, *times] != [0, trace.collisions, 0.0, trace.stop.time]:
            return False
    summary = trace.summary is not None
    path = (
        b"observables/summary/kinetic_energy/step" if summary else b"connectivity/collisions/step"
    )
    number, first = hdf5.length(root, path), 0 if summary else 1
    for start in range(0, number, AT_ONCE):
        rows = slice(start, min(start + AT_ONCE, number))
        counted = np.arange(first + rows.start, first + rows.stop)
        if not np.array_equal(hdf5.get(root, path, np.int64, rows), counted):
            return False
    return True


def _own(root: Any, path: Path) -> Any:
    """The group of what is ours alone. Raises ``StoreError`` for another version's."""
    own = h5g.open(root, b"parameters/snooker")
    schema = hdf5.read_number(own, b"schema_version")
    if schema != SCHEMA_VERSION:
        raise StoreError(
            f"{path}: is in version {schema} of the files' schema, where this snooker reads "
            f"version {SCHEMA_VERSION}; run it again"
        )
    return own


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """A repeat's group; what HDF5 or the schema does not take is raised as ``StoreError``."""
    try:
        file = hdf5.to_read(path)
        try:
            yield h5g.open(file, b"/")
        finally:
            file.close()
    except FileNotFoundError:
        raise AbsentError(
            f"{path}: there is no such result; run the config, which does what is missing"
        ) from None
    except hdf5.UNREADABLE as error:
        if path.is_dir():
            raise StoreError(
                f"{path}: is a folder where a result's file should be; delete it and run again"
            ) from None
        raise StoreError(
            f"{path}: not a readable result of snooker ({hdf5.said(error)}); delete it and run "
            "again"
        ) from None


def _trace(root: Any) -> Trace:
    """All of a trace but its events."""
    ending = json.loads(hdf5.read_text(h5g.open(root, b"parameters/snooker"), b"ending"))
    positions, velocities, masses, radii = _particles(root, b"particles/balls/")
    places, motions, container_mass, container_radius = _particles(root, b"particles/container/")
    sides = {}
    if ending["shape"] != "circle":
        width, height = hdf5.get(root, b"particles/balls/box/edges").tolist()
        sides = {"width": width, "height": height}
    start, finish = (
        Scene(
            positions=positions[k],
            velocities=velocities[k],
            radii=radii,
            masses=masses,
            container_radius=float(container_radius[0]),
            container_mass=float(container_mass[0]),
            container_position=places[k, 0],
            container_velocity=motions[k, 0],
            restitution=ending["restitution"],
            wall_restitution=ending["wall_restitution"],
            shape=ending["shape"],
            contact_duration=ending.get("contact_duration", 0.0),
            elastic_below=ending.get("elastic_below", 0.0),
            slides=ending.get("slides", False),
            **sides,
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
        summary=None if b"connectivity" in root else _summary(root),
    )


def _stop(ending: dict[str, Any]) -> Stop:
    """How a repeat ended."""
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


def _events(root: Any, at_once: int | None) -> Iterator[Events]:
    """The events, so many at a time, or all; at least once."""
    number = hdf5.length(root, b"connectivity/collisions/time")
    size = at_once or max(number, 1)
    long = hdf5.exists(root, b"observables/residual")
    for start in range(0, max(number, 1), size):
        rows = slice(start, min(start + size, number))
        pairs = hdf5.get(root, b"connectivity/collisions/value", np.int32, rows)
        yield Events(
            time=hdf5.get(root, b"connectivity/collisions/time", rows=rows),
            i=np.ascontiguousarray(pairs[:, 0, 0]),
            j=np.ascontiguousarray(pairs[:, 0, 1]),
            impulse=hdf5.get(root, b"observables/impulse/value", rows=rows),
            residual=hdf5.get(root, RESIDUAL, rows=rows) if long else None,
        )


def _summary(root: Any) -> Summary:
    """A summary's columns."""
    group = h5g.open(root, b"observables/summary")
    names = [name for name in SERIES_UNITS if name != "time"]
    columns = {name: hdf5.get(group, f"{name}/value".encode()) for name in names}
    return Summary(
        series=Series(time=hdf5.get(group, b"kinetic_energy/time"), **columns),
        speed_histogram=hdf5.get(group, b"speed_histogram/value", np.int64),
    )
