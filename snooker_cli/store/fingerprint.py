"""A trace's content -> a hash, fed with the events as they come."""

from __future__ import annotations

import hashlib
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snooker_cli.trace import Events, Trace

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
