"""What a repeat's file says of itself, and the error for a file that fails."""

from __future__ import annotations

import hashlib
import json
import threading
from dataclasses import asdict, dataclass, fields
from functools import lru_cache
from typing import Any

import h5py
import numpy as np
from h5py import h5g
from numpy.typing import NDArray

from snooker_cli.scene import Scene, Shape
from snooker_cli.store import hdf5
from snooker_cli.store.hdf5 import DOUBLE, INTEGER, create
from snooker_cli.trace import SERIES_UNITS, Events, Stop, Summary, Trace

SCHEMA_VERSION = 2
"""Goes up when files change; 2 hashes each column of events by itself."""


@dataclass(frozen=True)
class Provenance:
    """Where a repeat comes from: all that is needed to make it again.

    config : the point's experiment as JSON; digest : of what determines its physics
    parameters : the point's swept keys and values as JSON
    engine : "allpairs" or "cells" if it was told to be that one
    """

    config: str
    digest: str
    parameters: str
    point: int
    repeat: int
    engine_version: int
    versions: str
    machine: str
    command: str
    started: str
    seconds: float
    engine: str | None = None


@dataclass(frozen=True)
class Stored:
    """A repeat as read from its file."""

    trace: Trace
    provenance: Provenance

    @property
    def told(self) -> RepeatHeader:
        """What the file says of itself, without the collisions."""
        return RepeatHeader(self.trace.stop, self.trace.collisions, self.provenance)


@dataclass(frozen=True)
class RepeatHeader:
    """What a repeat's file says of itself."""

    stop: Stop
    collisions: int
    provenance: Provenance


@dataclass(frozen=True)
class Checked(RepeatHeader):
    """What is known of a repeat whose file has been checked without keeping its events.

    start : the scene at time 0
    bits : ``content_hash`` of its trace, without provenance: the same for the same collisions
    """

    start: Scene
    bits: str


# A trace's content -> a hash, fed with the events as they come.

LATER = ("contact_duration", "elastic_below", "slides")
"""Of a scene, what files of before do not have: it counts only where it is not zero or false."""


class Fingerprint:
    """SHA-256 over all that a repeat's file holds; the events can be given in pieces."""

    def __init__(self) -> None:
        self._columns = {name: hashlib.sha256() for name in ("time", "i", "j", "impulse")}
        self._number = 0

    def add(self, events: Events) -> None:
        """Take the next events. A residual counts from where there is one; before it is zero."""
        if events.residual is not None and "residual" not in self._columns:
            self._columns["residual"] = hashlib.sha256(bytes(8 * self._number))
        for name, column in self._columns.items():
            column.update(_bytes(getattr(events, name)))
        self._number += len(events)

    def content(self, trace: Trace, provenance: str) -> str:
        """The hash over the events given, the rest of a trace, and the provenance's JSON."""
        digest = hashlib.sha256(provenance.encode())
        for scene in (trace.start, trace.finish):
            for field in fields(scene):
                value = getattr(scene, field.name)
                if field.name in LATER:
                    if not value:
                        continue
                    digest.update(field.name.encode())
                said = isinstance(value, str)
                digest.update(
                    value.encode() if said else _bytes(np.asarray(value, dtype=np.float64))
                )
        for column in self._columns.values():
            digest.update(column.digest())
        if trace.summary is not None:
            for values in vars(trace.summary.series).values():
                digest.update(_bytes(values))
            digest.update(_bytes(trace.summary.speed_histogram))
        counts = (trace.wall_events, trace.pair_events)
        digest.update(repr((sorted(vars(trace.stop).items()), counts)).encode())
        return digest.hexdigest()


def content_hash(trace: Trace, provenance: str = "") -> str:
    """SHA-256 over every array of the trace, its ending, and the provenance's JSON."""
    fingerprint = Fingerprint()
    if trace.events is not None:
        fingerprint.add(trace.events)
    return fingerprint.content(trace, provenance)


def _bytes(values: NDArray[Any]) -> memoryview:
    """The values' bytes as little-endian machines have them."""
    return np.ascontiguousarray(values, values.dtype.newbyteorder("<")).data


# What all files of so many balls have in common: groups, header, particles without values.


@lru_cache(maxsize=64)
def skeleton(balls: int, shape: Shape) -> bytes:
    """The bytes of a file for so many balls in such a container.

    It lacks only values, events and attributes.
    """
    name = f"skeleton-{threading.get_ident()}"
    with h5py.File(name, "w", driver="core", backing_store=False, libver=hdf5.FORMAT) as file:
        write_header(file)
        file.create_group("parameters/snooker").attrs["schema_version"] = SCHEMA_VERSION
        for group, number in (("balls", balls), ("container", 1)):
            _write_particles(file.create_group(f"particles/{group}"), number, shape)
        file.flush()
        return bytes(file.id.get_file_image())


def write_header(file: h5py.File) -> None:
    """The ``h5md`` group; its names are fixed-length strings, as the standard wants them."""
    from snooker_cli import __version__

    header = file.create_group("h5md")
    header.attrs["version"] = np.array([1, 1], dtype=np.int32)
    header.create_group("author").attrs["name"] = np.bytes_("snooker user")
    creator = header.create_group("creator")
    creator.attrs["name"] = np.bytes_("snooker")
    creator.attrs["version"] = np.bytes_(__version__)


def _write_particles(group: h5py.Group, number: int, shape: Shape) -> None:
    """Datasets for so many particles at the start and the finish, which share step and time."""
    box = group.create_group("box")
    box.attrs["dimension"] = 2
    box.attrs["boundary"] = np.array([b"periodic" if shape == "periodic" else b"none"] * 2)
    if shape != "circle":
        create(box.id, b"edges", (2,), DOUBLE, b"m")
    position, velocity = group.create_group("position"), group.create_group("velocity")
    create(position.id, b"value", (2, number, 2), DOUBLE, b"m")
    create(position.id, b"step", (2,), INTEGER, None)
    create(position.id, b"time", (2,), DOUBLE, b"s")
    create(velocity.id, b"value", (2, number, 2), DOUBLE, b"m s-1")
    velocity["step"], velocity["time"] = position["step"], position["time"]
    create(group.id, b"mass", (number,), DOUBLE, b"kg")
    create(group.id, b"radius", (number,), DOUBLE, b"m")


# What a repeat adds to its file's skeleton: events or summary, values of particles, attributes.

COMPRESS_FROM = 4096  # elements; below it a filter costs more time and space than it saves

COLUMNS: dict[bytes, tuple[tuple[int, ...], Any, bytes | None]] = {
    b"connectivity/collisions/value": ((1, 2), hdf5.BALL, b"1"),
    b"connectivity/collisions/step": ((), hdf5.INTEGER, None),
    b"connectivity/collisions/time": ((), hdf5.DOUBLE, b"s"),
    b"observables/impulse/value": ((), hdf5.DOUBLE, b"kg m s-1"),
}
"""The columns of events: shape of a row, type, unit."""

RESIDUAL = b"observables/residual/value"
LONG = {RESIDUAL: ((), hdf5.DOUBLE, b"s")}
"""One more, of long repeats only."""

KINDS = {"f": hdf5.DOUBLE, "i": hdf5.INTEGER}
"""The types of a summary's columns, by NumPy's letter."""


def create_events(root: Any, rows: int, *, chunked: bool = True) -> dict[bytes, Any]:
    """The columns of events: empty ones in chunks of so many rows, or with so many rows."""
    for group in (
        b"connectivity",
        b"connectivity/collisions",
        b"observables",
        b"observables/impulse",
    ):
        hdf5.create_group(root, group)
    columns = {
        path: hdf5.create_chunked(root, path, rows, shape, kind, unit)
        if chunked
        else hdf5.create(root, path, (rows, *shape), kind, unit)
        for path, (shape, kind, unit) in COLUMNS.items()
    }
    _link_time(root, b"observables/impulse/")
    collisions = h5g.open(root, b"connectivity/collisions")
    hdf5.write_reference(collisions, b"particles_group", root, b"particles/balls")
    return columns


def append_events(
    root: Any, columns: dict[bytes, Any], events: Events, before: int, rows: int
) -> None:
    """Add a chunk of events after so many others.

    The residual's column is made when there is one; the rows before, which are zero, take no room.
    """
    if events.residual is not None and RESIDUAL not in columns:
        hdf5.create_group(root, b"observables/residual")
        columns[RESIDUAL] = hdf5.create_chunked(root, RESIDUAL, rows, *LONG[RESIDUAL])
        _link_time(root, b"observables/residual/")
    for path, values in _event_columns(events, before).items():
        hdf5.append_chunk(columns[path], before, values, hdf5.packed(values, rows))


def write_events(root: Any, events: Events) -> None:
    """All events at once."""
    number = len(events)
    if number >= COMPRESS_FROM:
        append_events(root, create_events(root, number), events, 0, number)
        return
    columns = create_events(root, number, chunked=False)
    if events.residual is not None:
        hdf5.create_group(root, b"observables/residual")
        columns[RESIDUAL] = hdf5.create(root, RESIDUAL, (number,), *LONG[RESIDUAL][1:])
        _link_time(root, b"observables/residual/")
    for path, values in _event_columns(events, 0).items():
        hdf5.put(columns[path], values, (COLUMNS | LONG)[path][1])


def _event_columns(events: Events, before: int) -> dict[bytes, NDArray[Any]]:
    """Events as they stand in a file."""
    steps = np.arange(before + 1, before + 1 + len(events))
    pairs = np.stack([events.i, events.j], axis=1)[:, None, :]
    columns: dict[bytes, NDArray[Any]] = dict(
        zip(COLUMNS, (pairs, steps, events.time, events.impulse), strict=True)
    )
    return columns if events.residual is None else columns | {RESIDUAL: events.residual}


def _link_time(root: Any, group: bytes) -> None:
    """Give a quantity of events their numbers and times."""
    for name in (b"step", b"time"):
        hdf5.link(root, group + name, b"connectivity/collisions/" + name)


def write_summary(root: Any, summary: Summary) -> None:
    """The columns of a summary, which share one grid of times."""
    hdf5.create_group(root, b"observables")
    hdf5.create_group(root, b"observables/summary")
    columns = {**vars(summary.series), "speed_histogram": summary.speed_histogram}
    time = columns.pop("time")
    shared = b""
    for name, values in columns.items():
        group = f"observables/summary/{name}".encode()
        hdf5.create_group(root, group)
        _write_column(root, group + b"/value", values, SERIES_UNITS.get(name, "1").encode())
        if shared:
            hdf5.link(root, group + b"/step", shared + b"/step")
            hdf5.link(root, group + b"/time", shared + b"/time")
        else:
            _write_column(root, group + b"/step", np.arange(len(time)), None)
            _write_column(root, group + b"/time", time, b"s")
            shared = group


def _write_column(root: Any, path: bytes, values: NDArray[Any], unit: bytes | None) -> None:
    """A dataset with its unit, compressed if it is large."""
    kind = KINDS[values.dtype.kind]
    if values.size >= COMPRESS_FROM:
        rows = len(values)
        data = hdf5.create_chunked(root, path, rows, values.shape[1:], kind, unit)
        hdf5.append_chunk(data, 0, values, hdf5.packed(values, rows))
    else:
        hdf5.put(hdf5.create(root, path, values.shape, kind, unit), values, kind)


def write_frame(root: Any, trace: Trace, provenance: Provenance, fingerprint: Fingerprint) -> None:
    """Balls and container at the start and the finish, how it ended, and where it comes from."""
    start, finish = trace.start, trace.finish
    step, time = np.array([0, trace.collisions]), np.array([0.0, trace.stop.time])
    groups = {
        b"particles/balls/": (
            (start.positions, finish.positions),
            (start.velocities, finish.velocities),
            start.masses,
            start.radii,
        ),
        b"particles/container/": (
            (start.container_position[None], finish.container_position[None]),
            (start.container_velocity[None], finish.container_velocity[None]),
            np.array([start.container_mass]),
            np.array([start.container_radius]),
        ),
    }
    for group, (positions, velocities, masses, radii) in groups.items():
        hdf5.put(root, step, hdf5.INTEGER, group + b"position/step")
        for name, values in (
            (b"position/time", time),
            (b"position/value", np.stack(positions)),
            (b"velocity/value", np.stack(velocities)),
            (b"mass", masses),
            (b"radius", radii),
        ):
            hdf5.put(root, values, hdf5.DOUBLE, group + name)
        if start.shape != "circle":
            edges = np.array([start.width, start.height])
            hdf5.put(root, edges, hdf5.DOUBLE, group + b"box/edges")
    ending = {
        **asdict(trace.stop),
        "wall_events": trace.wall_events,
        "pair_events": trace.pair_events,
        "shape": start.shape,
        "restitution": start.restitution,
        "wall_restitution": start.wall_restitution,
        "contact_duration": start.contact_duration,
        "elastic_below": start.elastic_below,
        "slides": start.slides,
    }
    said = json.dumps(asdict(provenance))
    own = h5g.open(root, b"parameters/snooker")
    hdf5.write_text(own, b"content", fingerprint.content(trace, said))
    hdf5.write_text(own, b"provenance", said)
    hdf5.write_text(own, b"ending", json.dumps(ending))
