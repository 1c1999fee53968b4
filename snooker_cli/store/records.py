"""What a repeat's file says of itself, and the error for a file that fails."""

from __future__ import annotations

from dataclasses import dataclass

from snooker_cli.scene import Scene
from snooker_cli.trace import Stop, Trace

SCHEMA_VERSION = 2
"""Goes up when files change; 2 hashes each column of events by itself."""


class StoreError(Exception):
    """A result file that cannot be read or trusted; one sentence."""


class AbsentError(StoreError):
    """A result file that is not there, or that cannot be written; one sentence."""


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
    def told(self) -> Told:
        """What the file says of itself, without the collisions."""
        return Told(self.trace.stop, self.trace.collisions, self.provenance)


@dataclass(frozen=True)
class Told:
    """What a repeat's file says of itself."""

    stop: Stop
    collisions: int
    provenance: Provenance


@dataclass(frozen=True)
class Checked(Told):
    """What is known of a repeat whose file has been checked without keeping its events.

    start : the scene at time 0
    bits : ``content_hash`` of its trace, without provenance: the same for the same collisions
    """

    start: Scene
    bits: str
