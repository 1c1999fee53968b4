"""What a repeat's file holds: its header, where it comes from, and the hash of its content.

docs/file-format.md names every dataset and attribute.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import Box, Circle
from snooker_cli.scene import Scene
from snooker_cli.trace import Events, Stop, Trace

SCHEMA_VERSION = 2
"""Goes up when the files change; 2 hashes each column of events by itself."""

BALLS, CONTAINER = "particles/balls", "particles/container"
COLLISIONS = "connectivity/collisions"
IMPULSE, RESIDUAL = "observables/impulse", "observables/residual"
SUMMARY = "observables/summary"
SUMMARY_TIME = f"{SUMMARY}/kinetic_energy"
"""The quantity whose steps and times all others of a summary share."""

PARAMETERS = "parameters/snooker"

RULES = ("restitution", "wall_restitution", "contact_duration", "elastic_below", "slides")
"""The fields of a scene that are stored in the JSON of the ending."""


@dataclass(frozen=True)
class Provenance:
    """All that is needed to simulate a repeat again.

    config : the point's experiment as JSON
    digest : of what in it determines the physics
    parameters : the point's swept keys and values as JSON
    versions : of Python and the libraries, as JSON
    started : ISO 8601, UTC
    seconds : that the simulation took
    engine : "allpairs" or "cells" if the user chose one
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
class RepeatHeader:
    """What a repeat's file says of itself, without its events.

    start : the scene at time 0; None if the content was not checked
    fingerprint : ``content_hash`` of the trace; empty if the content was not checked
    """

    stop: Stop
    collisions: int
    provenance: Provenance
    start: Scene | None = None
    fingerprint: str = ""


HASHED_IF_SET = ("contact_duration", "elastic_below", "slides")
"""Fields of a scene that older files lack: they are hashed only if not zero or false."""

HASHED_LENGTHS = (*Circle.keys, *Box.keys)
"""Lengths of containers that are always hashed, as nan if a shape lacks them."""


class Fingerprint:
    """SHA-256 of all that a repeat's file holds; events may be added in pieces."""

    def __init__(self) -> None:
        self._columns = {name: hashlib.sha256() for name in ("time", "i", "j", "impulse")}
        self._number = 0

    def add(self, events: Events) -> None:
        """Add the next events. Residuals before the first one count as zero."""
        if events.residual is not None and "residual" not in self._columns:
            self._columns["residual"] = hashlib.sha256(bytes(8 * self._number))
        for name, column in self._columns.items():
            column.update(_bytes(getattr(events, name)))
        self._number += len(events)

    def content(self, trace: Trace, provenance: str = "") -> str:
        """The hash of the events added, the rest of a trace, and the provenance's JSON."""
        digest = hashlib.sha256(provenance.encode())
        for scene in (trace.start, trace.finish):
            for value in _hashed_values(scene):
                text = isinstance(value, str)
                digest.update(
                    value.encode() if text else _bytes(np.asarray(value, dtype=np.float64))
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


def content_hash(trace: Trace) -> str:
    """SHA-256 of every array of a trace and of how it ended."""
    fingerprint = Fingerprint()
    if trace.events is not None:
        fingerprint.add(trace.events)
    return fingerprint.content(trace)


def _hashed_values(scene: Scene) -> Iterator[Any]:
    """All values of a scene in the order of the fingerprint."""
    lengths = dict(vars(scene.container))
    first, *others = (lengths.pop(key, math.nan) for key in HASHED_LENGTHS)
    values = {**vars(scene), "container": first}
    later = {name: values.pop(name) for name in HASHED_IF_SET} | lengths
    yield from (*values.values(), scene.container.name, *others)
    for name, value in later.items():
        if value:
            yield from (name, value)


def _bytes(values: NDArray[Any]) -> memoryview:
    """The values' bytes in little-endian order."""
    return np.ascontiguousarray(values, values.dtype.newbyteorder("<")).data


def write_h5md_group(file: h5py.File) -> None:
    """Write the ``h5md`` group; H5MD wants its names as strings of fixed length."""
    from snooker_cli import __version__

    header = file.create_group("h5md")
    header.attrs["version"] = np.array([1, 1], dtype=np.int32)
    header.create_group("author").attrs["name"] = np.bytes_("snooker user")
    creator = header.create_group("creator")
    creator.attrs["name"] = np.bytes_("snooker")
    creator.attrs["version"] = np.bytes_(__version__)
