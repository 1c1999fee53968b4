"""Read a batch's file: its repeats, checked against their hashes, or their headers only."""

import json
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, get_type_hints

import h5py
import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from snooker_cli.containers import SHAPES, Circle
from snooker_cli.errors import AbsentError, DeniedError, StoreError, UnsoundError, error_text
from snooker_cli.fields import ALWAYS, EVENT_COLUMNS, MOVING
from snooker_cli.laws import RULES, CollisionRules
from snooker_cli.scene import Scene
from snooker_cli.store import file_format as layout
from snooker_cli.store import hdf5
from snooker_cli.store.file_format import Fingerprint, Provenance, RepeatHeader
from snooker_cli.store.value_ranges import (
    SUMMARY_ROWS,
    EventCheck,
    check_ending,
    check_repeats,
    check_snapshot,
    check_snapshot_times,
    require,
)
from snooker_cli.trace import (
    SPEED_BINS,
    Events,
    Series,
    Snapshots,
    Stop,
    StopReason,
    Summary,
    Trace,
    joined,
    series_units,
)

LOCKED = (
    "is locked: a program such as HDFView, MATLAB or h5py has it open for writing, or ended "
    "without closing it",
    "close it there; if none has it open, unlock it with `h5clear -s FILE`, or delete it and run "
    "again",
)
"""The reason and the advice for a file that another program may be changing."""

HEADERS = [
    name.encode()
    for name in (
        layout.PARAMETERS,
        layout.REPEATS,
        layout.CONTENTS,
        layout.PROVENANCE,
        layout.ENDINGS,
    )
]
"""Where headers are."""

EVENTS_AT_A_TIME = 1 << 20  # events that are read at a time where they are not kept


def file_info(path: Path) -> tuple[int, int] | None:
    """Size in bytes and time of the last change, ns since 1970, of a file; None if it is gone."""
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError:  # such as a loop of links: who reads the file will say so
        return 0, 0
    return status.st_size, status.st_mtime_ns


def read(path: Path, wanted: Collection[int] | None = None) -> list[tuple[Trace, RepeatHeader]]:
    """Read and check all repeats of a batch's file, or those of some numbers, in order.

    Raises ``StoreError``.
    """
    with _opened(path) as file:
        return list(_verified_repeats(file, path, wanted, keep_events=True))


def check(path: Path) -> list[RepeatHeader]:
    """Check a batch's file in bounded memory. Raises ``StoreError``.

    Checks the hash of the content too.
    """
    with _opened(path) as file:
        return [header for _, header in _verified_repeats(file, path, None, keep_events=False)]


def read_headers(path: Path) -> list[RepeatHeader]:
    """Read the headers of a file's repeats without checking the content. Raises ``StoreError``."""
    with _opened(path, only_headers=True) as file:
        return _headers(file, path)


def read_checkpoint(path: Path) -> dict[str, NDArray[Any]] | None:
    """The arrays from which a repeat is continued; ``None`` without.

    Checks the rest of the file too. Raises ``StoreError``, also for arrays of another user.
    """
    with _opened(path) as file:
        if layout.CHECKPOINT not in file:
            return None
        list(_verified_repeats(file, path, None, keep_events=False))
        names = file[layout.CHECKPOINT]
        checkpoint = {
            name: hdf5.read_rows(file, f"{layout.CHECKPOINT}/{name}", None) for name in names
        }
        written = hdf5.read_attribute(file, layout.CHECKPOINT, "content")
        content, reason = _parameter(file, "content"), ""
        try:
            if layout.checkpoint_hash(checkpoint, content) != written:
                reason = "its checkpoint is damaged, or of another user, machine or version"
        except OSError as error:
            reason = f"its checkpoint cannot be checked without your key ({error_text(error)})"
        if reason:
            raise StoreError(path, reason, "run it again")
        return checkpoint


def read_events(path: Path, repeats: Iterable[int]) -> Iterator[tuple[int, Events]]:
    """The events of repeats of a file, and which repeat they are of; their hash is not checked.

    They come in pieces, one or more of each repeat, so that memory is bounded. Raises
    ``StoreError``.
    """
    with _opened(path) as file:
        headers = _headers(file, path)
        numbers = [header.repeat for header in headers]
        rows, reader = _rows(file, headers), EventReader(file, EVENTS_AT_A_TIME)
        for repeat in repeats:
            for events in reader.pieces(rows[numbers.index(repeat)]):
                yield repeat, events


def read_last_events(
    path: Path, repeats: Collection[int], most: int
) -> Iterator[tuple[int, Scene, Events]]:
    """The number, the start and the last events, at most this many, of repeats of a file.

    Their hash is not checked. Raises ``StoreError``.
    """
    with _opened(path) as file:
        headers = _headers(file, path)
        rows, reader = _rows(file, headers), EventReader(file, most)
        chosen = [k for k, header in enumerate(headers) if header.repeat in repeats]
        for k, trace in zip(chosen, _traces(file, headers, rows, chosen), strict=True):
            last = slice(max(rows[k].start, rows[k].stop - most), rows[k].stop)
            yield headers[k].repeat, trace.start, joined([*reader.pieces(last)])


@contextmanager
def _opened(path: Path, *, only_headers: bool = False) -> Iterator[h5py.File]:
    """A batch's file whose objects are checked, or those of its headers. Raises ``StoreError``."""
    try:
        if path.exists() and not path.is_file():
            raise OSError("not a file")
        with h5py.File(path, locking=False) as file:  # once in its place, it never changes
            names = hdf5.check_links(file)
            version = _parameter(file, "schema_version")
            if version not in layout.READABLE:
                raise StoreError(
                    path,
                    f"is in version {version} of the files' schema, where this snooker reads "
                    f"versions {' and '.join(map(str, layout.READABLE))}",
                    "run it again",
                )
            hdf5.check_objects(
                file, HEADERS if only_headers else names, sparse=f"{layout.RESIDUAL}/value"
            )
            yield file
    except FileNotFoundError:
        raise AbsentError(
            path, "there is no such result", "run the config, which simulates what is missing"
        ) from None
    except PermissionError:
        raise DeniedError(path) from None
    except MemoryError:
        raise DeniedError(path, "needs more memory than there is", "close other programs") from None
    except StoreError:
        raise
    except Exception as error:  # whatever HDF5, JSON or a value raises is damage
        if hdf5.is_marked(path):
            raise DeniedError(path, *LOCKED) from None
        reason = f"not a readable result of snooker ({error_text(error)})"
        if path.is_dir():
            reason = "is a folder where a result's file should be"
        raise StoreError(path, reason, "delete it and run again") from None


def _parameter(file: h5py.File, name: str) -> Any:
    return hdf5.read_attribute(file, layout.PARAMETERS, name)


def _shape_and_rules(file: h5py.File) -> tuple[str, CollisionRules]:
    """The name of the container's shape, and what collisions do. Raises ``UnsoundError``."""
    written = {**json.loads(_parameter(file, "scene"))}
    shape = written.pop("shape")
    if _parameter(file, "schema_version") == layout.OLDEST:
        from snooker_cli.store import version_4  # of such files alone

        written = version_4.rules(written)
    try:
        return shape, RULES.validate_json(json.dumps(written))
    except ValidationError as error:
        (where, *_) = error.errors()[0]["loc"] or ("rules",)
        raise UnsoundError(f"wrong {where}") from None


def _headers(file: h5py.File, path: Path) -> list[RepeatHeader]:
    numbers = hdf5.read_rows(file, layout.REPEATS, np.int64).tolist()
    contents = hdf5.read_text(file, layout.CONTENTS)
    (source,) = hdf5.read_text(file, layout.PROVENANCE)
    if layout.seal(source, numbers, contents) != _parameter(file, "content"):
        raise _changed(path)
    origin = json.loads(source)
    origin.pop("engine", None)  # files up to engine version 8 have it
    provenance = Provenance(**origin)
    for name, kind in get_type_hints(Provenance).items():
        require(isinstance(getattr(provenance, name), kind), f"{name} in its provenance")
    ascend = all(first < second for first, second in pairwise([-1, *numbers]))
    require(len(numbers) > 0 and ascend, "numbers of its repeats")
    endings = json.loads(f"[{','.join(hdf5.read_text(file, layout.ENDINGS))}]")
    (_, rules), is_summary = _shape_and_rules(file), layout.SUMMARY in file
    return [
        RepeatHeader(number, *_ending(ending), provenance, content, rules, is_summary)
        for number, ending, content in zip(numbers, endings, contents, strict=True)
    ]


def _ending(stored: dict[str, Any]) -> tuple[Stop, int, int]:
    """How a repeat ended, and its collisions with the wall and between balls."""
    counts = [stored.pop(name) for name in layout.COUNTS]
    stop = Stop(StopReason(stored.pop("reason")), balls=tuple(stored.pop("balls")), **stored)
    check_ending(stop, *counts)
    return stop, *counts


def _rows(file: h5py.File, headers: Sequence[RepeatHeader]) -> list[slice]:
    """Which rows of the events or summaries each repeat has."""
    column = layout.TIME if "connectivity" in file else f"{layout.SUMMARY}/time"
    ends = hdf5.read_rows(file, layout.ROWS, np.int64).tolist()
    last = hdf5.length(file, f"{column}/value")
    require(ends[0] == 0 and ends[-1] == last and sorted(ends) == ends, "rows of its repeats")
    counts = [last - first for first, last in pairwise(ends)]
    if column == layout.TIME:
        require(counts == [header.collisions for header in headers], "number of events")
    else:
        require(max(counts) <= SUMMARY_ROWS, "rows of its summaries")
    return [slice(first, last) for first, last in pairwise(ends)]


def _verified_repeats(
    file: h5py.File, path: Path, wanted: Collection[int] | None, *, keep_events: bool
) -> Iterator[tuple[Trace, RepeatHeader]]:
    """Repeats whose content has the hash that was written, with or without their events."""
    headers = _headers(file, path)
    rows = _rows(file, headers)
    chosen = [k for k, header in enumerate(headers) if wanted is None or header.repeat in wanted]
    if wanted is not None and len(chosen) < len(wanted):
        raise _changed(path)
    traces = _traces(file, headers, rows, chosen)
    if layout.SNAPSHOTS in file:
        require(len(headers) == 1, "number of repeats with snapshots")
        traces = [replace(one, snapshots=_snapshots(file, path, one)) for one in traces]
    at_a_time = max(rows[-1].stop, 1) if keep_events else EVENTS_AT_A_TIME
    reader = EventReader(file, at_a_time) if "connectivity" in file else None
    # Values are checked besides the hash: whoever invents numbers can make a right hash.
    for k, trace in zip(chosen, traces, strict=True):
        fingerprint = Fingerprint()
        if reader:
            check = EventCheck.from_start(trace.start)
            for events in reader.pieces(rows[k], check):
                fingerprint.add(events)
                if keep_events:  # which are in one piece
                    trace = replace(trace, events=events)
            check.end(trace)
        if trace.snapshots:
            fingerprint.snapshots = hdf5.read_text(file, layout.SNAPSHOT_HASHES)
            for row in range(0 if keep_events else len(trace.snapshots)):
                _snapshot(file, path, trace, row)
        if fingerprint.content(trace) != headers[k].fingerprint:
            raise _changed(path)
        yield trace, headers[k]._replace(start=layout.scene_hash(trace.start))


def read_snapshot(path: Path, trace: Trace, row: int) -> Scene:
    """The state of a snapshot, checked by its hash. Raises ``StoreError``.

    trace : of the file's repeat
    """
    with _opened(path) as file:
        return _snapshot(file, path, trace, row)


def _snapshot(file: h5py.File, path: Path, trace: Trace, row: int) -> Scene:
    """The state of a snapshot. Raises ``StoreError`` or ``ValueError`` for what was changed."""
    rows, number = slice(row, row + 1), trace.start.number
    moving: dict[str, Any] = {}
    for field, name in layout.snapshot_elements(trace.start).items():
        values = hdf5.read_rows(file, f"{name}/value", rows=rows)
        require(values.shape == (1, *field.shape(number)), "number of balls in a snapshot")
        moving[field.name] = field.of_row(values[0])
    scene = replace(trace.start, **moving)
    check_snapshot(trace.start, scene)
    (time,) = hdf5.read_rows(file, layout.SNAPSHOT_TIME, rows=rows).tolist()
    if layout.snapshot_hash(time, scene) != hdf5.read_text(file, layout.SNAPSHOT_HASHES)[row]:
        raise _changed(path)
    return scene


def _snapshots(file: h5py.File, path: Path, trace: Trace) -> Snapshots | None:
    """The snapshots of a file's only repeat, which are read when they are needed."""
    if layout.SNAPSHOTS not in file:
        return None
    times = hdf5.read_rows(file, layout.SNAPSHOT_TIME)
    names = layout.snapshot_elements(trace.start).values()
    lengths = {hdf5.length(file, f"{name}/value") for name in names}
    hashes = len(hdf5.read_text(file, layout.SNAPSHOT_HASHES))
    require(lengths == {len(times)} == {hashes}, "number of snapshots")
    check_snapshot_times(times, trace.stop.time)
    return Snapshots(times, partial(read_snapshot, path, trace))


def _changed(path: Path) -> StoreError:
    return StoreError(path, "its content has changed since it was written", "run it again")


def _traces(
    file: h5py.File, headers: Sequence[RepeatHeader], rows: list[slice], chosen: Sequence[int]
) -> list[Trace]:
    """Some of the traces of a file, checked, without their events."""
    (masses, radii), (container_mass, lengths) = (
        [hdf5.read_rows(file, f"{group}/{name}") for name in ("mass", "radius")]
        for group in (layout.BALLS, layout.CONTAINER)
    )
    same = masses.shape == radii.shape == (radii.size,) and container_mass.shape == (1,)
    require(same and radii.size > 0 and lengths.shape == (1,), "number of balls or repeats")
    name, collision_rules = _shape_and_rules(file)
    rules, shape = dict(vars(collision_rules)), SHAPES[name]
    if not issubclass(shape, Circle):
        lengths = hdf5.read_rows(file, f"{layout.BALLS}/box/edges")[: len(shape.keys)]
    keys = [None] * len(headers)
    if collision_rules.wall_law.is_random:
        keys = hdf5.read_rows(file, layout.WALL_KEYS, np.int64).tolist()
        require(len(keys) == len(headers) and np.min(keys) >= 0, "wall_key")
    rules |= {"container": shape(*lengths.tolist()), "container_mass": float(container_mass[0])}
    columns = {}
    for field in MOVING:
        if field.needs != ALWAYS and rules.get(field.needs) is None:
            continue
        what, name = f"number of {field.name}", f"{layout.element(field)}/value"
        require(name in file, what)
        columns[field] = hdf5.read_rows(file, name)
        require(columns[field].shape == (2 * len(headers), *field.shape(radii.size)), what)

    def scene(row: int) -> Scene:
        moving = {field.name: field.of_row(values[row]) for field, values in columns.items()}
        own = moving | rules | {"wall_key": keys[row // 2]}
        return Scene(radii=radii, masses=masses, **own)

    summaries = (
        [None] * len(headers) if "connectivity" in file else _summaries(file, rows, scene(0))
    )
    traces = []
    for k in chosen:
        stop, counts = headers[k].stop, (headers[k].wall_events, headers[k].pair_events)
        ends = scene(2 * k), scene(2 * k + 1)
        traces.append(Trace(*ends, stop, *counts, events=None, summary=summaries[k]))
    if traces:
        check_repeats(traces)
    return traces


class EventReader:
    """Reads and checks the events of a file in blocks of rows. The last block stays in memory.

    Many short repeats are in one block, and a long repeat is in many blocks.

    at_a_time : rows of a block
    """

    def __init__(self, file: h5py.File, at_a_time: int) -> None:
        self._file, self._size = file, at_a_time
        columns = [c for c in EVENT_COLUMNS if file.id.links.exists(c.path.encode())]
        self._columns = [column for column in columns if column.path != layout.COLLISIONS]
        self.number = hdf5.length(file, f"{layout.TIME}/value")
        lengths = {hdf5.length(file, f"{column.path}/value") for column in columns}
        require(lengths == {self.number}, "lengths of the columns of events")
        self._balls = hdf5.length(file, f"{layout.BALLS}/radius")
        _, rules = _shape_and_rules(file)
        self._slides = rules.slides
        present = {ALWAYS, *(name for name, rule in vars(rules).items() if rule is not None)}
        wanted = {c.name for c in EVENT_COLUMNS if c.title and c.needs in present}
        require({c.name for c in columns if c.title} == wanted, "columns of events")
        self._start, self._block = -1, Events(*(np.zeros(0, kind) for kind in "diid"))

    def pieces(self, rows: slice, check: EventCheck | None = None) -> Iterator[Events]:
        """The events of one repeat, or the last of them, block by block; at least one piece.

        check : takes each piece; without it, that of a repeat whose start is not known
        """
        check = check or EventCheck(self._balls, slides=self._slides)
        last = max(rows.stop, rows.start + 1)
        # Blocks begin at multiples of their size, so that the next repeat can use the last block.
        for start in range(rows.start - rows.start % self._size, last, self._size):
            if start != self._start:
                self._block = self._read_block(slice(start, start + self._size))
                self._start = start
            events = self._block[max(rows.start - start, 0) : max(rows.stop - start, 0)]
            check.take(events)
            if events.residual is not None and not events.residual.any():
                events = replace(events, residual=None)  # another repeat of the file has some
            yield events

    def _read_block(self, rows: slice) -> Events:
        """The events in these rows."""
        pairs = hdf5.read_rows(self._file, f"{layout.COLLISIONS}/value", np.int32, rows)
        i, j = np.ascontiguousarray(pairs[:, 0].T)
        columns = {
            column.name: hdf5.read_rows(self._file, f"{column.path}/value", rows=rows)
            for column in self._columns
        }
        return Events(i=i, j=j, **columns)


def _summaries(file: h5py.File, rows: Sequence[slice], start: Scene) -> list[Summary]:
    columns = {
        name: hdf5.read_rows(file, f"{layout.SUMMARY}/{name}/value") for name in series_units(start)
    }
    counts = hdf5.read_rows(file, f"{layout.SUMMARY}/speed_histogram/value", np.int64)
    shapes = {values.shape for values in columns.values()}
    require(shapes == {counts.shape[:1]}, "lengths of the columns of the summary")
    require(counts.shape[1:] == (SPEED_BINS,), "speed_histogram of a summary")
    return [
        Summary(Series(**{name: values[own] for name, values in columns.items()}), counts[own])
        for own in rows
    ]
