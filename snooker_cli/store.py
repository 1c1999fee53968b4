"""A trace <-> an HDF5 file, valid H5MD 1.1; this docstring is the schema.

One file a repeat. Units are in the attribute ``unit``; k_B = 1, so that temperature is in J.

=======================================  ================================================
``/h5md``                                ``version`` = [1, 1]; groups author, creator
``/parameters/snooker``                  attributes ``schema_version``, ``content`` (hash),
                                         ``provenance`` and ``ending`` (JSON)
``/particles/balls/position``            element, float64 [2, N, 2] m: start and finish
``/particles/balls/velocity``            element, float64 [2, N, 2] m s-1
``/particles/balls/mass``, ``radius``    float64 [N], kg and m
``/particles/container/position``        element, float64 [2, 1, 2] m
``/particles/container/velocity``        element, float64 [2, 1, 2] m s-1
``/particles/container/mass``            float64 [1] kg; inf if the container is fixed
``/particles/container/radius``          float64 [1] m
``/connectivity/collisions``             element, int32 [n, 1, 2]: ball, and ball or -1
``/observables/impulse``                 element, float64 [n] kg m s-1
``/observables/summary/QUANTITY``        element, float64 [g]: see ``trace.Series``
=======================================  ================================================

An element is a group of ``step``, ``time`` (s) and ``value``.
``connectivity`` and ``impulse`` share one ``step`` and one ``time`` (s), and are there if events
were recorded; ``summary`` if not. A file is written beside its place, flushed to the disk and
then renamed, so that a finished file can never be torn.
"""

from __future__ import annotations

import hashlib
import json
import os
import threading
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from snooker_cli.scene import Scene
from snooker_cli.trace import SERIES_UNITS, Events, Series, Stop, StopReason, Summary, Trace

SCHEMA_VERSION = 1
UNREADABLE = (OSError, KeyError, ValueError, TypeError, RuntimeError)
COMPRESS_FROM = 4096  # elements; below it a filter costs more time and space than it saves


class StoreError(Exception):
    """A result file that cannot be written, read or trusted; one sentence."""


@dataclass(frozen=True)
class Provenance:
    """Where a repeat comes from: all that is needed to make it again.

    config : the point's experiment as JSON; digest : of what determines its physics
    parameters : the point's swept keys and values as JSON
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


@dataclass(frozen=True)
class Stored:
    """A repeat as read from its file."""

    trace: Trace
    provenance: Provenance


def write(path: Path, trace: Trace, provenance: Provenance) -> None:
    """Write a repeat's file, whole or not at all. Raises ``StoreError``."""
    image = _image(trace, provenance)
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as file:
            file.write(image)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise StoreError(
            f"{path}: cannot write the result ({error.strerror or error}); make room or choose "
            "another folder with --out"
        ) from None


def read(path: Path) -> Stored:
    """Read a repeat's file and check its content. Raises ``StoreError``."""
    try:
        with h5py.File(path, "r") as file:
            stored = _stored(file)
            expected = file["parameters/snooker"].attrs["content"]
            said = file["parameters/snooker"].attrs["provenance"]
    except FileNotFoundError:
        raise StoreError(f"{path}: there is no such result; run it first") from None
    except UNREADABLE as error:
        raise StoreError(_unreadable(path, error)) from None
    if content_hash(stored.trace, said) != expected:
        raise StoreError(f"{path}: its content has changed since it was written; run it again")
    return stored


def read_provenance(path: Path) -> tuple[Provenance, Stop]:
    """A file's provenance and ending alone, without its data. Raises ``StoreError``."""
    try:
        with h5py.File(path, "r") as file:
            return _provenance(file), _stop(_ending(file))
    except UNREADABLE as error:
        raise StoreError(_unreadable(path, error)) from None


def _unreadable(path: Path, error: Exception) -> str:
    """The sentence for a file that HDF5 or the schema does not take."""
    if path.is_dir():
        return f"{path}: is a folder where a result's file should be; delete it and run again"
    said = (str(error).splitlines() or [type(error).__name__])[0]
    return f"{path}: not a readable result of snooker ({said}); delete it and run again"


def content_hash(trace: Trace, provenance: str = "") -> str:
    """SHA-256 over every array of the trace, its ending, and the provenance's JSON."""
    digest = hashlib.sha256(provenance.encode())
    for scene in (trace.start, trace.finish):
        for field in fields(scene):
            digest.update(np.asarray(getattr(scene, field.name), dtype="<f8").tobytes())
    columns = [] if trace.events is None else list(vars(trace.events).values())
    if trace.summary is not None:
        columns += [*vars(trace.summary.series).values(), trace.summary.speed_histogram]
    for column in columns:
        digest.update(column.astype(column.dtype.newbyteorder("<"), copy=False).tobytes())
    counts = (trace.wall_events, trace.pair_events)
    digest.update(repr((sorted(vars(trace.stop).items()), counts)).encode())
    return digest.hexdigest()


def _image(trace: Trace, provenance: Provenance) -> bytes:
    """The file's bytes, made in memory."""
    # HDF5 knows files by name, those in memory too: threads need different ones.
    name = f"snooker-{threading.get_ident()}"
    # Version 1.10 of the format has checksums in its metadata: a damaged file is refused.
    with h5py.File(name, "w", driver="core", backing_store=False, libver=("v110", "v110")) as file:
        _write_header(file)
        attributes = file.create_group("parameters/snooker").attrs
        attributes["schema_version"] = SCHEMA_VERSION
        said = json.dumps(asdict(provenance))
        attributes["content"] = content_hash(trace, said)
        attributes["provenance"] = said
        attributes["ending"] = json.dumps(
            {
                **asdict(trace.stop),
                "wall_events": trace.wall_events,
                "pair_events": trace.pair_events,
                "restitution": trace.start.restitution,
                "wall_restitution": trace.start.wall_restitution,
            }
        )
        _write_particles(file, trace)
        if trace.events is not None:
            _write_events(file, trace.events)
        if trace.summary is not None:
            _write_summary(file, trace.summary)
        file.flush()
        return bytes(file.id.get_file_image())


def _write_header(file: h5py.File) -> None:
    """The ``h5md`` group; its names are fixed-length strings, as the standard wants them."""
    from snooker_cli import __version__

    header = file.create_group("h5md")
    header.attrs["version"] = np.array([1, 1], dtype=np.int32)
    header.create_group("author").attrs["name"] = np.bytes_("snooker user")
    creator = header.create_group("creator")
    creator.attrs["name"] = np.bytes_("snooker")
    creator.attrs["version"] = np.bytes_(__version__)


def _write_particles(file: h5py.File, trace: Trace) -> None:
    """Balls and container at the start and the finish."""
    start, finish = trace.start, trace.finish
    step, time = np.array([0, trace.collisions]), np.array([0.0, trace.stop.time])
    groups = {
        "balls": (
            (start.positions, finish.positions),
            (start.velocities, finish.velocities),
            start.masses,
            start.radii,
        ),
        "container": (
            (start.container_position[None], finish.container_position[None]),
            (start.container_velocity[None], finish.container_velocity[None]),
            np.array([start.container_mass]),
            np.array([start.container_radius]),
        ),
    }
    for name, (positions, velocities, masses, radii) in groups.items():
        group = file.create_group(f"particles/{name}")
        box = group.create_group("box")
        box.attrs["dimension"] = 2
        box.attrs["boundary"] = np.array([b"none", b"none"])
        position = _write_element(group, "position", np.stack(positions), "m", step, time)
        shared = position["step"], position["time"]
        _write_element(group, "velocity", np.stack(velocities), "m s-1", *shared)
        _write_data(group, "mass", masses, "kg")
        _write_data(group, "radius", radii, "m")


def _write_events(file: h5py.File, events: Events) -> None:
    """Who collided with whom, when, and how hard."""
    pairs = np.stack([events.i, events.j], axis=1)[:, None, :]
    steps = np.arange(1, len(events) + 1)
    group = file.create_group("connectivity")
    element = _write_element(group, "collisions", pairs, "1", steps, events.time)
    element.attrs["particles_group"] = file["particles/balls"].ref
    shared = element["step"], element["time"]
    _write_element(file.create_group("observables"), "impulse", events.impulse, "kg m s-1", *shared)


def _write_summary(file: h5py.File, summary: Summary) -> None:
    """The columns of a summary on one shared grid of times."""
    group = file.create_group("observables/summary")
    columns = {**vars(summary.series), "speed_histogram": summary.speed_histogram}
    time = columns.pop("time")
    shared: tuple[Any, Any] = (np.arange(len(time)), time)
    for name, column in columns.items():
        element = _write_element(group, name, column, SERIES_UNITS.get(name, "1"), *shared)
        shared = element["step"], element["time"]


def _write_element(
    parent: h5py.Group, name: str, value: NDArray[Any], unit: str, step: Any, time: Any
) -> h5py.Group:
    """An H5MD element; ``step`` and ``time`` are data, or another element's, then shared."""
    group = parent.create_group(name)
    _write_data(group, "value", value, unit)
    for column, data, column_unit in (("step", step, None), ("time", time, "s")):
        if isinstance(data, h5py.Dataset):
            group[column] = data
        else:
            _write_data(group, column, data, column_unit)
    return group


def _write_data(group: h5py.Group, name: str, value: NDArray[Any], unit: str | None) -> None:
    """A dataset with its unit, compressed if it is large."""
    if value.size >= COMPRESS_FROM:
        data = group.create_dataset(
            name, data=value, compression="gzip", compression_opts=1, shuffle=True
        )
    else:
        data = group.create_dataset(name, data=value)
    if unit is not None:
        _write_unit(data, unit.encode())


def _write_unit(data: h5py.Dataset, unit: bytes) -> None:
    """The attribute ``unit``, a fixed-length string; five times as fast as ``data.attrs``."""
    kind = h5py.h5t.C_S1.copy()
    kind.set_size(len(unit))
    kind.set_strpad(h5py.h5t.STR_NULLPAD)
    attribute = h5py.h5a.create(data.id, b"unit", kind, h5py.h5s.create(h5py.h5s.SCALAR))
    attribute.write(np.array(unit))


def _stored(file: h5py.File) -> Stored:
    """The trace and provenance in an open file."""
    ending = _ending(file)
    balls, container = file["particles/balls"], file["particles/container"]
    # Each dataset is opened once: opening is what takes the time in a small file.
    positions, velocities = balls["position/value"][()], balls["velocity/value"][()]
    radii, masses = balls["radius"][()], balls["mass"][()]
    places, motions = container["position/value"][()], container["velocity/value"][()]
    container_radius, container_mass = container["radius"][()], container["mass"][()]
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
        )
        for k in (0, 1)
    )
    events = summary = None
    if "connectivity" in file:
        collisions = file["connectivity/collisions"]
        pairs = collisions["value"][()][:, 0]
        events = Events(
            time=collisions["time"][()],
            i=np.ascontiguousarray(pairs[:, 0]),
            j=np.ascontiguousarray(pairs[:, 1]),
            impulse=file["observables/impulse/value"][()],
        )
    else:
        group = file["observables/summary"]
        time = group["kinetic_energy/time"][()]
        columns = {name: group[f"{name}/value"][()] for name in SERIES_UNITS if name != "time"}
        summary = Summary(
            series=Series(time=time, **columns),
            speed_histogram=group["speed_histogram/value"][()],
        )
    trace = Trace(
        start=start,
        finish=finish,
        stop=_stop(ending),
        wall_events=ending["wall_events"],
        pair_events=ending["pair_events"],
        events=events,
        summary=summary,
    )
    return Stored(trace, _provenance(file))


def _provenance(file: h5py.File) -> Provenance:
    """The provenance in an open file."""
    return Provenance(**json.loads(file["parameters/snooker"].attrs["provenance"]))


def _ending(file: h5py.File) -> dict[str, Any]:
    """How the repeat ended, in an open file."""
    return dict(json.loads(file["parameters/snooker"].attrs["ending"]))


def _stop(ending: dict[str, Any]) -> Stop:
    """The ending as it was in the trace."""
    return Stop(
        reason=StopReason(ending["reason"]),
        time=ending["time"],
        balls=tuple(ending["balls"]),
        message=ending["message"],
    )
