"""Write a batch's file: short repeats at its end, a long one while it is simulated."""

import json
import logging
import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import Circle
from snooker_cli.errors import AbsentError, error_text, room_advice
from snooker_cli.fields import EVENT_COLUMNS, moving_fields
from snooker_cli.files import discard, move_into_place, own_folder, temporary_path
from snooker_cli.laws import RULES
from snooker_cli.scene import Scene
from snooker_cli.store import file_format as layout
from snooker_cli.store import hdf5
from snooker_cli.store.file_format import Fingerprint, Provenance, write_h5md_group
from snooker_cli.store.hdf5 import ROWS  # events in a chunk take 24 to 32 bytes each
from snooker_cli.store.reader import EventReader
from snooker_cli.store.value_ranges import (
    EventCheck,
    check_repeats,
    check_snapshot,
    check_snapshot_times,
)
from snooker_cli.trace import Events, Trace, joined, series_units

WAITING = 4  # chunks that may wait to be written before the simulation has to wait

COMPRESS_FROM = 4096  # numbers; compressing fewer takes more time and space than it saves

NO_KEY = "a later run cannot continue this repeat, because no key for checkpoints can be kept (%s)"

_log = logging.getLogger(__name__)


def write(path: Path, repeats: Sequence[tuple[int, Trace]], provenance: Provenance) -> None:
    """Write a batch's file, whole or not at all. Makes the point's folder.

    repeats : number and trace of each, in order

    Raises ``AbsentError`` for a file that cannot be written, and ``UnsoundError`` for values that
    the reader would refuse.
    """
    with Recorder(path) as recorder:
        for repeat, trace in repeats:
            recorder.begin(trace.start)
            if trace.events is not None:
                recorder.add(trace.events)
            for k, time in enumerate([] if trace.snapshots is None else trace.snapshots.time):
                assert trace.snapshots is not None
                recorder.add_snapshot(float(time), trace.snapshots.read(k))
            recorder.end(repeat, trace)
        recorder.finish(provenance)


class Recorder(AbstractContextManager["Recorder"]):
    """Takes the events of one repeat after another and writes their file, in bounded memory.

    Another thread compresses and writes events beyond the first chunk. Without ``finish``, the
    end of the ``with`` block leaves no file. All methods raise ``AbsentError`` for a file that
    cannot be written, and ``UnsoundError`` for values that the reader would refuse.

    continues : with the events of the single repeat in the file at this path, a checkpoint
    """

    _start: Scene
    _events: EventCheck  # of the repeat that has begun

    def __init__(self, path: Path, continues: bool = False) -> None:
        self.path = path
        self._part = temporary_path(path)
        self._fingerprint = Fingerprint()
        self._ended: list[tuple[int, Trace, Fingerprint]] = []
        self._rows = [0]
        self._pending: list[Events] = []
        self.number = 0  # of events in all
        self._written = 0
        self._times: list[float] = []  # of snapshots
        self._exits = ExitStack()
        self._file: h5py.File | None = None
        self._thread = ThreadPoolExecutor(1)
        self._tasks: deque[Future[None]] = deque()
        self._continues = continues

    def __exit__(self, *_error: object) -> None:
        self._thread.shutdown(cancel_futures=True)
        with suppress(*hdf5.UNWRITABLE):
            self._exits.close()
        discard(self._part)

    def _open(self) -> h5py.File:
        """The file, which is made when it is first needed."""
        if self._file is None:
            own_folder(self.path.parent)
            self._file, self._check = self._exits.enter_context(hdf5.new_file(self._part))
        return self._file

    def begin(self, start: Scene) -> None:
        """Begin a repeat. Its events, its snapshots and its ending follow."""
        self._start, self._events = start, EventCheck.from_start(start)
        if self._continues:
            with self._refusals():
                self._continue()

    def add(self, events: Events) -> None:
        """Take the next events of a repeat."""
        self._events.take(events)
        self._add(events)

    def _add(self, events: Events) -> None:
        self._pending.append(events)
        self.number += len(events)
        # Most repeats end within the first chunk: they need neither a thread nor a file yet.
        if self._file is None and self.number <= ROWS:
            self._fingerprint.add(events)
            return
        with self._refusals():
            self._submit(self._fingerprint.add, events)
            while self.number - self._written >= ROWS:
                pending = joined(self._pending)
                self._pending = [pending[ROWS:]]
                self._submit(self._write_chunk, self._open(), pending[:ROWS], self._written)
                self._written += ROWS

    def add_snapshot(self, time: float, scene: Scene) -> None:
        """Take the next snapshot of the only repeat of the file."""
        check_snapshot(self._start, scene)
        with self._refusals():
            self._wait(1)  # a state may be large
            self._submit(self._fingerprint.add_snapshot, time, scene)
            self._submit(self._write_snapshot, self._open(), scene, len(self._times))
            self._times.append(time)

    def _write_snapshot(self, file: h5py.File, scene: Scene, row: int) -> None:
        for field, name in layout.snapshot_elements(scene).items():
            values = field.rows([scene])
            hdf5.write_rows(file, f"{name}/value", values, field.unit, 1, row, packed=False)
        self._check()

    def _submit(self, task: Callable[..., None], *arguments: object) -> None:
        """Give the thread a task. Waits while many are left, and raises the error of one."""
        self._wait(WAITING)
        self._tasks.append(self._thread.submit(task, *arguments))

    def _wait(self, most: int) -> None:
        while len(self._tasks) > most:
            self._tasks.popleft().result()

    def _write_chunk(self, file: h5py.File, events: Events, before: int) -> None:
        _write_events(file, events, ROWS, before)
        self._check()

    def end(self, repeat: int, trace: Trace) -> None:
        """Take the ending of a repeat. Its own events are ignored; those that were added count."""
        summary = trace.summary
        if summary is None:
            self._events.end(trace)
        rows = self.number if summary is None else self._rows[-1] + len(summary.series.time)
        self._ended.append((repeat, trace, self._fingerprint))
        self._rows.append(rows)
        self._fingerprint = Fingerprint()

    def finish(self, provenance: Provenance) -> None:
        """Write the rest and put the file in its place."""
        traces = [trace for _, trace, _ in self._ended]
        check_repeats(traces)
        if self._times:
            check_snapshot_times(np.array(self._times), traces[0].stop.time)
        with self._refusals():
            self._wait(0)
            self._write_rest(self._open(), provenance)
            self._exits.close()
            move_into_place(self._part, self.path)

    def _write_rest(self, file: h5py.File, provenance: Provenance) -> None:
        """Write the summaries or the last events, and all that is not events."""
        _, traces, fingerprints = zip(*self._ended, strict=True)
        file.create_group(layout.BALLS)
        hdf5.write_rows(file, layout.STEP, np.array(1))
        if traces[0].summary is not None:
            _write_summaries(file, traces)
        else:
            rest = joined(self._pending)
            if len(rest) or not self._written:
                chunk = ROWS if self._written else _chunk(rest.time)
                _write_events(file, rest, chunk, self._written)
            file[layout.COLLISIONS].attrs["particles_group"] = file[layout.BALLS].ref
            for path in layout.EVENT_PATHS:
                if path in file:
                    hdf5.link(file, f"{path}/step", layout.STEP)
        if self._times:
            (fingerprint,) = fingerprints
            _write_snapshot_times(file, self._times, fingerprint.snapshots, traces[0].start)
        _write_scenes(file, traces)
        write_h5md_group(file)
        self._write_parameters(file, provenance)
        checkpoint = traces[-1].checkpoint
        if checkpoint is not None:
            _write_checkpoint(file, {**checkpoint, layout.HASHES: fingerprints[-1].hashes()})

    def _write_parameters(self, file: h5py.File, provenance: Provenance) -> None:
        """Write how each repeat ended, the provenance and the hash of all."""
        repeats, traces, fingerprints = zip(*self._ended, strict=True)
        source, start = json.dumps(asdict(provenance)), traces[0].start
        contents = list(map(Fingerprint.content, fingerprints, traces))
        counts = [{name: getattr(trace, name) for name in layout.COUNTS} for trace in traces]
        endings = [json.dumps(trace.stop.known() | counts[k]) for k, trace in enumerate(traces)]
        hdf5.write_rows(file, layout.REPEATS, np.array(repeats, np.int64))
        hdf5.write_rows(file, layout.ROWS, np.array(self._rows, np.int64))
        hdf5.write_rows(file, layout.ENDINGS, np.array(endings, np.bytes_))
        hdf5.write_rows(file, layout.CONTENTS, np.array(contents, np.bytes_))
        hdf5.write_rows(file, layout.PROVENANCE, np.array(source, np.bytes_))
        if start.wall_key is not None:
            keys = [trace.start.wall_key for trace in traces]
            hdf5.write_rows(file, layout.WALL_KEYS, np.array(keys, np.int64))
        parameters = file[layout.PARAMETERS].attrs
        parameters["schema_version"] = layout.SCHEMA_VERSION
        rules = RULES.dump_python(start.rules, mode="json")
        scene = json.dumps({"shape": start.container.name, **rules})
        parameters["scene"] = np.bytes_(scene, "ascii")
        parameters["content"] = np.bytes_(layout.seal(source, repeats, contents), "ascii")

    def _continue(self) -> None:
        """Begin with a copy of the file's events in full chunks, and with the rest of them."""
        with h5py.File(self.path, locking=False) as old:
            hashes = hdf5.read_rows(old, f"{layout.CHECKPOINT}/{layout.HASHES}", None)
            # Residuals that were zero in all full chunks have no hashes; they come last.
            columns = [name for name, path in layout.EVENTS.items() if path in old]
            self._fingerprint.restore(hashes, columns)
            if layout.SNAPSHOTS in old:
                self._fingerprint.snapshots = hdf5.read_text(old, layout.SNAPSHOT_HASHES)
                self._times = hdf5.read_rows(old, layout.SNAPSHOT_TIME).tolist()
                for group in (layout.SNAPSHOTS, layout.CONTAINER_SNAPSHOTS):
                    for name in (f"{group}/{element}/value" for element in old[group]):
                        if name in old:
                            old.copy(name, self._open(), name)
            reader = EventReader(old, ROWS) if layout.TIME in old else None
            number = reader.number if reader else 0
            full = self._written = self.number = number - number % ROWS
            # Full chunks are copied without unpacking. The rest is added as new events. All were
            # checked before they were written.
            for path in (f"{name}/value" for name in layout.EVENT_PATHS if full and name in old):
                old.copy(path, self._open(), path)
                data = self._open()[path].id
                data.set_extent((full, *data.shape[1:]))
            ending = json.loads(hdf5.read_text(old, layout.ENDINGS)[0])
            self._events.resume(number, ending["wall_events"], ending["time"])
            if reader and full < number:
                for events in reader.pieces(slice(full, number)):
                    self._add(events)

    @contextmanager
    def _refusals(self) -> Iterator[None]:
        """Turn what HDF5 or the system refuses into an ``AbsentError``."""
        try:
            yield
        except hdf5.UNWRITABLE as error:
            raise AbsentError(
                self.path,
                f"cannot write the result ({error_text(error)})",
                f"{room_advice(error)} or choose another folder for the run",
            ) from None


def _chunk(values: NDArray[Any]) -> int:
    """Rows of a chunk, for a column that is written at once: all, or 0 for no compression."""
    return len(values) if values.size >= COMPRESS_FROM else 0


def _write_events(file: h5py.File, events: Events, chunk: int, before: int) -> None:
    """Write the next events, as a chunk or, with 0, all at once without compression."""
    columns = events.columns
    columns["i"] = np.stack([columns["i"], columns.pop("j")], axis=1)[:, None, :]
    if layout.RESIDUAL in file:  # of an earlier repeat
        columns.setdefault("residual", np.zeros(len(events)))
    for column in EVENT_COLUMNS:
        if column.name in columns:
            values = columns[column.name]
            hdf5.write_rows(file, f"{column.path}/value", values, column.unit, chunk, before)


def _write_element(
    file: h5py.File, path: str, values: NDArray[Any], unit: str, chunk: int = 0
) -> None:
    """Write an element of H5MD whose rows are numbered from 0."""
    hdf5.write_rows(file, f"{path}/value", values, unit, chunk)
    hdf5.link(file, f"{path}/step", layout.STEP)


def _write_summaries(file: h5py.File, traces: Sequence[Trace]) -> None:
    summaries = [trace.summary for trace in traces if trace.summary is not None]
    for name, unit in series_units(traces[0].start).items():
        values = np.concatenate([getattr(summary.series, name) for summary in summaries])
        _write_element(file, f"{layout.SUMMARY}/{name}", values, unit, _chunk(values))
    counts = layout.smallest(np.concatenate([summary.speed_histogram for summary in summaries]))
    _write_element(file, f"{layout.SUMMARY}/speed_histogram", counts, "1", _chunk(counts))


def _write_scenes(file: h5py.File, traces: Sequence[Trace]) -> None:
    """Write the balls and the container at the start and the finish of each repeat."""
    scenes = [scene for trace in traces for scene in (trace.start, trace.finish)]
    start = scenes[0]
    for field in moving_fields(start):
        rows = field.rows(scenes)
        chunk = _chunk(rows) if len(traces) > 1 else 0
        _write_element(file, layout.element(field), rows, field.unit, chunk)
    radius = getattr(start.container, "radius", math.nan)
    for group, masses, radii in (
        (layout.BALLS, start.masses, start.radii),
        (layout.CONTAINER, np.array([start.container_mass]), np.array([radius])),
    ):
        hdf5.write_rows(file, f"{group}/mass", masses, "kg")
        hdf5.write_rows(file, f"{group}/radius", radii, "m")
        _write_box(file, group, start)


def _write_box(file: h5py.File, group: str, start: Scene) -> None:
    """Write the box of a group of particles."""
    box = file.create_group(f"{group}/box")
    box.attrs["dimension"] = 2
    repeats = start.container.periodic
    box.attrs["boundary"] = np.where(repeats, b"periodic", b"none").astype(np.bytes_)
    if not isinstance(start.container, Circle):
        hdf5.write_rows(file, f"{group}/box/edges", np.array(start.container.size), "m")


def _write_snapshot_times(
    file: h5py.File, times: Sequence[float], hashes: Sequence[str], start: Scene
) -> None:
    """Write when snapshots are, their hashes, and the box that H5MD wants for each group."""
    hdf5.write_rows(file, layout.SNAPSHOT_HASHES, np.array(hashes, np.bytes_))
    hdf5.write_rows(file, layout.SNAPSHOT_TIME, np.array(times), "s")
    hdf5.write_rows(file, layout.SNAPSHOT_STEP, np.arange(len(times)))
    for name in layout.snapshot_elements(start).values():
        for column, shared in (("time", layout.SNAPSHOT_TIME), ("step", layout.SNAPSHOT_STEP)):
            if f"{name}/{column}" != shared:
                hdf5.link(file, f"{name}/{column}", shared)
    for group in (layout.SNAPSHOTS, layout.CONTAINER_SNAPSHOTS):
        _write_box(file, group, start)


def _write_checkpoint(file: h5py.File, checkpoint: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays by name, and their hash; without a user's key, none."""
    for name, values in checkpoint.items():
        hdf5.write_rows(file, f"{layout.CHECKPOINT}/{name}", values)
    content = hdf5.read_attribute(file, layout.PARAMETERS, "content")
    try:
        content_hash = layout.checkpoint_hash(checkpoint, content)
    except OSError as error:
        _log.warning(NO_KEY, error_text(error))
        content_hash = "none"
    file[layout.CHECKPOINT].attrs["content"] = np.bytes_(content_hash, "ascii")
