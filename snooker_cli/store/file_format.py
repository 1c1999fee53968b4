"""What a batch's file holds: headers of its repeats, where it comes from, hashes of its content.

docs/file-format.md names every dataset and attribute.
"""

import hashlib
import json
import math
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from snooker_cli import __version__
from snooker_cli.containers import Box, Circle, Container
from snooker_cli.fields import EVENT_COLUMNS, REQUIRED, MovingField, moving_fields
from snooker_cli.files import sources_hash, user_hash
from snooker_cli.laws import RULES, CollisionRules, Constant
from snooker_cli.scene import Scene
from snooker_cli.trace import Events, Stop, Trace

SCHEMA_VERSION = 5  # goes up when the files change
OLDEST = 4  # that is read, see ``version_4``
READABLE = OLDEST, SCHEMA_VERSION

BALLS, CONTAINER = "particles/balls", "particles/container"
EVENTS = {column.name: column.path for column in EVENT_COLUMNS}
EVENT_PATHS = tuple(dict.fromkeys(EVENTS.values()))
COLLISIONS, TIME, RESIDUAL = EVENTS["i"], EVENTS["time"], EVENTS["residual"]
SUMMARY = "observables/summary"

SNAPSHOTS, CONTAINER_SNAPSHOTS = "particles/snapshots", "particles/container_snapshots"

PARAMETERS = "parameters/snooker"
STEP = f"{PARAMETERS}/step"  # of all elements of H5MD: the rows of each are numbered from 0
REPEATS, ROWS, ENDINGS, CONTENTS, PROVENANCE, WALL_KEYS, SNAPSHOT_HASHES = (
    f"{PARAMETERS}/{name}"
    for name in ("repeat", "rows", "ending", "content", "provenance", "wall_key", "snapshot")
)

SNAPSHOT_TIME, SNAPSHOT_STEP = f"{SNAPSHOTS}/position/time", f"{SNAPSHOTS}/position/step"
"""When the states of all elements are, which are of the one repeat in the file."""

COUNTS = ("wall_events", "pair_events")  # of an ending, besides the fields of its stop

CHECKPOINT = "checkpoint"
HASHES = "hashes"  # in the checkpoint, the hashes of past events


@dataclass(frozen=True)
class Provenance:
    """All that is needed to simulate a batch again.

    config : the point's experiment as JSON
    digest : of what in it determines the physics
    parameters : the point's swept keys and values as JSON
    versions : of Python and the libraries, as JSON
    started : ISO 8601, UTC
    seconds : that the simulation of all repeats took
    """

    config: str
    digest: str
    parameters: str
    point: int
    engine_version: int
    versions: str
    machine: str
    command: str
    started: str
    seconds: float


class RepeatHeader(NamedTuple):
    """What a file says of one of its repeats, without its events.

    wall_events, pair_events : its collisions with the wall and between balls
    fingerprint : hash of the trace, see `Fingerprint`
    rules : what collisions do
    summary : whether it has a summary instead of events
    start : the `scene_hash` of its start; empty if the content was not read
    """

    repeat: int
    stop: Stop
    wall_events: int
    pair_events: int
    provenance: Provenance
    fingerprint: str
    rules: CollisionRules
    summary: bool = False
    start: str = ""

    @property
    def collisions(self) -> int:
        """All collisions of the repeat."""
        return self.wall_events + self.pair_events


HASHED_ROWS = 65536  # events that are hashed together

HASHED_LENGTHS = (*Circle.keys, *Box.keys)
"""Lengths of containers that are always hashed, as nan if a shape lacks them."""


class Fingerprint:
    """SHA-256 of all that a file holds of a repeat; events and snapshots are added in pieces.

    Each ``HASHED_ROWS`` of a column are hashed by themselves, and then their hashes. So a repeat
    that is continued needs only the hashes of its past events.
    """

    def __init__(self) -> None:
        self._columns = {name: hashlib.sha256() for name in REQUIRED}
        self._hashes: dict[str, list[bytes]] = {name: [] for name in self._columns}
        self._number = 0
        self.snapshots: list[str] = []  # the `snapshot_hash` of each

    def add_snapshot(self, time: float, scene: Scene) -> None:
        """Add the next snapshot."""
        self.snapshots.append(snapshot_hash(time, scene))

    def add(self, events: Events) -> None:
        """Add the next events. Residuals are hashed if one is not zero."""
        # Pieces end where a block of ``HASHED_ROWS`` ends: each block has a hash of its own.
        while len(events):
            full, rest = divmod(self._number, HASHED_ROWS)
            part, events = events[: HASHED_ROWS - rest], events[HASHED_ROWS - rest :]
            columns = part.columns
            for name, values in columns.items():
                # From the first residual that is not zero: all rows before it count as zeros.
                if name not in self._columns and (name != "residual" or values.any()):
                    self._columns[name] = hashlib.sha256(bytes(8 * rest))
                    zeros = hashlib.sha256(bytes(8 * HASHED_ROWS)).digest()
                    self._hashes[name] = [zeros] * full
            self._number += len(part)
            for name, column in self._columns.items():
                column.update(_bytes(columns[name]) if name in columns else bytes(8 * len(part)))
                if self._number % HASHED_ROWS == 0:
                    self._hashes[name].append(column.digest())
                    self._columns[name] = hashlib.sha256()

    def hashes(self) -> NDArray[np.uint8]:
        """(*columns*, *n*, 32) The hashes of all full ``HASHED_ROWS``."""
        everything = b"".join(chain(*self._hashes.values()))
        return np.frombuffer(everything, np.uint8).reshape(len(self._hashes), -1, 32)

    def restore(self, hashes: NDArray[np.uint8], names: Iterable[str]) -> None:
        """Begin after as many rows as ``hashes`` gave hashes for.

        names : of the columns that may be there, in the order of ``EVENT_COLUMNS``
        """
        for name, column in zip(names, hashes, strict=False):
            self._columns[name] = hashlib.sha256()
            self._hashes[name] = [row.tobytes() for row in column]
        self._number = HASHED_ROWS * hashes.shape[1]

    def content(self, trace: Trace) -> str:
        """The hash of the events added and of the rest of a trace."""
        digest = hashlib.sha256(_scene_bytes(trace.start) + _scene_bytes(trace.finish))
        for name, column in self._columns.items():
            last, hashes = column.digest(), self._hashes[name]
            digest.update(hashlib.sha256(b"".join([*hashes, last])).digest() if hashes else last)
        if trace.summary is not None:
            digest.update(b"".join(map(_bytes, trace.summary.series.columns.values())))
            digest.update(_bytes(smallest(trace.summary.speed_histogram)))
        digest.update("".join(self.snapshots).encode())
        counts = (trace.wall_events, trace.pair_events)
        digest.update(repr((sorted(trace.stop.known().items()), counts)).encode())
        return digest.hexdigest()


def seal(provenance: str, repeats: Sequence[int], contents: Sequence[str]) -> str:
    """SHA-256 of a file: its provenance as JSON, and the numbers and hashes of its repeats."""
    return hashlib.sha256(json.dumps([provenance, [*repeats], [*contents]]).encode()).hexdigest()


def checkpoint_hash(checkpoint: Mapping[str, NDArray[Any]], content: str) -> str:
    """A hash of the arrays of a checkpoint, by their names, that only this user can make.

    content : the hash of all else in the file

    Kernels use such arrays without a check, so those of a stranger, or of an engine with other
    sources, are dangerous. Raises ``OSError`` without a key.
    """
    digest = user_hash(content + sources_hash("engine/*.py", "laws.py"))
    for name, values in sorted(checkpoint.items()):
        digest.update(f"{name} {values.dtype.str} {values.shape}".encode())
        digest.update(_bytes(values))
    return digest.hexdigest()


def scene_hash(scene: Scene) -> str:
    """SHA-256 of all values of a scene."""
    return hashlib.sha256(_scene_bytes(scene)).hexdigest()


def element(field: MovingField) -> str:
    """The element of what moves, at the start and the finish of each repeat."""
    return f"{CONTAINER if field.of_container else BALLS}/{field.element}"


def snapshot_elements(scene: Scene) -> dict[MovingField, str]:
    """The elements of the snapshots of a repeat."""
    return {
        field: f"{CONTAINER_SNAPSHOTS if field.of_container else SNAPSHOTS}/{field.element}"
        for field in moving_fields(scene)
    }


def snapshot_hash(time: float, scene: Scene) -> str:
    """SHA-256 of what moves, at a time, s."""
    columns = (getattr(scene, field.name) for field in moving_fields(scene))
    return hashlib.sha256(b"".join(map(_bytes, (time, *columns)))).hexdigest()


def _scene_bytes(scene: Scene) -> bytes:
    """All values of a scene in the order of the fingerprint."""
    sizes, rules = _shared_bytes(scene.container, scene.container_mass, scene.rules)
    moving = [_bytes(getattr(scene, field.name)) for field in moving_fields(scene)]
    balls = (*moving[:2], _bytes(scene.radii), _bytes(scene.masses))
    key = b"" if scene.wall_key is None else struct.pack("<q", scene.wall_key)
    # Fields that not all scenes have come last, so that hashes of the others stay.
    return b"".join([*balls, sizes, *moving[2:4], rules, key, *moving[4:]])


@lru_cache(maxsize=4, typed=True)
def _shared_bytes(container: Container, mass: float, rules: CollisionRules) -> tuple[bytes, bytes]:
    """What all scenes of a batch have in common: the container, and how balls collide.

    Rules but the CoR are hashed only if they are not zero or false, so that earlier hashes stay.
    """
    lengths, always = dict(vars(container)), (rules.pair_law.cor, rules.wall_law.cor)
    first, *others = (lengths.pop(key, math.nan) for key in HASHED_LENGTHS)
    later = chain(*(item for item in (_hashed_rules(rules) | lengths).items() if item[1]))
    values = [*always, container.name, *others, *later]
    return _bytes(first) + _bytes(mass), b"".join(map(_bytes, values))


def _hashed_rules(rules: CollisionRules) -> dict[str, Any]:
    """Rules in the form of hashes, which is older than that of files: a constant law is its CoR."""
    written: dict[str, Any] = RULES.dump_python(rules, mode="json")
    laws = {name: written.pop(name) for name in ("pair_law", "wall_law")}
    return written | {name: law for name, law in laws.items() if law["name"] != Constant.name}


def smallest(counts: NDArray[np.int64]) -> NDArray[Any]:
    """Counts as the smallest unsigned integers that hold all of them."""
    if not counts.size or counts.min() < 0:
        return counts
    return counts.astype(np.min_scalar_type(counts.max()))


def _bytes(value: NDArray[Any] | float | str | dict[str, Any]) -> Any:
    """The bytes of an array, of a number as a double, of text, or of JSON."""
    if isinstance(value, dict):
        value = json.dumps(value)
    if isinstance(value, str):
        return value.encode()
    if not isinstance(value, np.ndarray):
        return struct.pack("<d", value)
    return np.ascontiguousarray(value).data


def write_h5md_group(file: h5py.File) -> None:
    """Write the ``h5md`` group; H5MD wants its names as strings of fixed length."""
    header = file.create_group("h5md")
    header.attrs["version"] = np.array([1, 1], dtype=np.int32)
    header.create_group("author").attrs["name"] = np.bytes_("snooker user")
    creator = header.create_group("creator")
    creator.attrs["name"] = np.bytes_("snooker")
    creator.attrs["version"] = np.bytes_(__version__)
