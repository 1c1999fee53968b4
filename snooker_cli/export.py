"""A repeat -> tables and frames for other programs: CSV, Parquet, H5MD."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import h5py
import numpy as np
from numpy.typing import NDArray

from snooker_cli.engine import replay, times_within
from snooker_cli.errors import AbsentError, UserError
from snooker_cli.scene import Scene
from snooker_cli.store import Provenance, hdf5, whole
from snooker_cli.store.file_format import write_header
from snooker_cli.trace import CONTAINER

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from snooker_cli.engine import States
    from snooker_cli.trace import Events, Trace


# A file for other programs: whole or not at all, and a sentence if it cannot be.


@contextmanager
def written(path: Path) -> Iterator[Path]:
    """A name for what becomes the file at the end; its folder is made.

    Raises ``UserError`` if the system refuses.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as part:
            yield part
    except OSError as error:
        raise UserError(
            f"{path}: cannot be written ({error.strerror or error}); make room or choose another "
            "file"
        ) from None


# States of a repeat at chosen times -> an H5MD file in three dimensions, for other programs.

CHUNK = 1 << 18
"""Bytes of a chunk, about: small frames share one."""


class Frames(Protocol):
    """States at some times, as ``engine.States`` has them."""

    @property
    def time(self) -> NDArray[np.float64]: ...
    @property
    def positions(self) -> NDArray[np.float64]: ...
    @property
    def velocities(self) -> NDArray[np.float64]: ...
    @property
    def container_positions(self) -> NDArray[np.float64]: ...
    @property
    def container_velocities(self) -> NDArray[np.float64]: ...


def write_states(
    path: Path,
    start: Scene,
    times: NDArray[np.float64],
    batches: Iterable[Frames],
    provenance: Provenance,
    content: str,
) -> None:
    """Write states, whole or not at all. Raises ``AbsentError``.

    times : (*t*,) s, of all frames; batches : the frames, some at a time, in order
    content : what identifies the collisions that the states are replayed from
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with (
            whole(path) as part,
            h5py.File(part, "x", libver=hdf5.FORMAT, locking=False) as file,
        ):
            write_header(file)
            own = file.create_group("parameters/snooker")
            own.attrs["bits"] = content
            own.attrs["provenance"] = json.dumps(asdict(provenance))
            _fill(_elements(file, start, times), batches)
    except hdf5.UNWRITABLE as error:
        raise AbsentError(
            f"{path}: cannot be written ({hdf5.said(error)}); make room or choose another file"
        ) from None


def _elements(file: h5py.File, start: Scene, times: NDArray[np.float64]) -> dict[str, h5py.Dataset]:
    """Everything but the states: time, box, masses, radii; and the datasets for the states."""
    group = file.create_group("particles/trajectory")
    frames, balls = len(times), start.number
    step, time = np.arange(frames), times
    elements = {
        "positions": ("particles/trajectory/position", (frames, balls, 3), "m"),
        "velocities": ("particles/trajectory/velocity", (frames, balls, 3), "m s-1"),
        "container_positions": ("observables/container_position", (frames, 3), "m"),
        "container_velocities": ("observables/container_velocity", (frames, 3), "m s-1"),
        "edges": ("particles/trajectory/box/edges", (frames, 3), "m"),
    }
    first: h5py.Group | None = None
    data = {}
    for name, (place, shape, unit) in elements.items():
        element = file.create_group(place)
        data[name] = _states(element, shape)
        holder = element if name in ("positions", "edges") else data[name]
        holder.attrs["unit"] = unit
        if first is None:
            element["step"], element["time"] = step, time
            element["time"].attrs["unit"] = "s"
            first = element
        else:
            element["step"], element["time"] = first["step"], first["time"]
    width, height = start.size
    data.pop("edges")[:] = [width, height, 2 * float(np.max(start.radii))]
    box = group["box"]
    box.attrs["dimension"] = 3
    boundary = b"periodic" if start.shape == "periodic" else b"none"
    box.attrs["boundary"] = np.array([boundary, boundary, b"none"])
    for name, values, unit in (("mass", start.masses, "kg"), ("radius", start.radii, "m")):
        group[name] = values
        group[name].attrs["unit"] = unit
    return data


def _states(element: h5py.Group, shape: tuple[int, ...]) -> h5py.Dataset:
    """The empty ``value`` of an element, in chunks of whole frames."""
    a_frame = 8 * int(np.prod(shape[1:]))
    rows = min(shape[0], max(1, CHUNK // a_frame))
    chunks = (rows, *shape[1:])
    return element.create_dataset(
        "value",
        shape,
        np.float64,
        chunks=chunks,
        shuffle=True,
        compression="gzip",
        compression_opts=1,
    )


def _fill(data: dict[str, Any], batches: Iterable[Frames]) -> None:
    """Write the states, z being zero."""
    row = 0
    for batch in batches:
        rows = slice(row, row + len(batch.time))
        for name, values in data.items():
            states = getattr(batch, name)
            padded = np.zeros((*states.shape[:-1], 3))
            padded[..., :2] = states
            values[rows] = padded
        row = rows.stop


# A trace and times -> the states then, a batch at a time, in bounded memory.

MOST = 1 << 22
"""Balls times frames in a batch: 32 bytes each, and as much again twice while it is made."""


def frames(trace: Trace, times: NDArray[np.float64], most: int = MOST) -> Iterator[States]:
    """The states at ``times`` (s), some at a time.

    Each batch is replayed from the start, as only so its bits are those of the simulation.

    Raises ``ValueError`` for times that are not ascending within 0 and the trace's end.
    """
    times = times_within(trace, times)  # now, and not when the first of them are asked for
    at_once = max(1, most // trace.start.number)
    firsts = range(0, len(times), at_once)
    return (replay(trace, times[first : first + at_once]) for first in firsts)


# Events and states -> tables: columns with units, some rows at a time; and their CSV.

Table = dict[str, "NDArray[Any]"]
"""Columns of one length, by name."""

EVENTS = {"time": "s", "i": "1", "j": "1", "impulse": "kg m s-1"}
STATES = {"time": "s", "ball": "1", "x": "m", "y": "m", "u": "m s-1", "v": "m s-1"}
"""The columns of both tables and their units; ball -1 is the container."""

LINES = 1 << 16
"""Lines of CSV made at a time."""


def events_table(events: Events) -> Table:
    """The columns of ``EVENTS``."""
    return {name: getattr(events, name) for name in EVENTS}


def states_table(states: States) -> Table:
    """The columns of ``STATES``: at each time the container and all balls."""
    number = states.positions.shape[1] + 1
    x, y = _columns(states.container_positions, states.positions)
    u, v = _columns(states.container_velocities, states.velocities)
    balls = np.arange(CONTAINER, number - 1, dtype=np.int32)
    return {
        "time": np.repeat(states.time, number),
        "ball": np.tile(balls, len(states.time)),
        "x": x,
        "y": y,
        "u": u,
        "v": v,
    }


def csv_lines(units: Mapping[str, str], tables: Iterable[Table]) -> Iterator[str]:
    """The lines of a CSV: the columns' names, then numbers that read back as the same doubles.

    Nothing comes before the first table is there: it may be that it cannot be read.
    """
    line = ",".join(["{!r}"] * len(units)) + "\n"
    for k, table in enumerate(tables):
        if k == 0:
            yield ",".join(units) + "\n"
        columns = [table[name] for name in units]
        for first in range(0, len(columns[0]), LINES):
            some = (column[first : first + LINES].tolist() for column in columns)
            yield from (line.format(*row) for row in zip(*some, strict=True))


def _columns(container: NDArray[np.float64], balls: NDArray[np.float64]) -> NDArray[np.float64]:
    """The two coordinates, each of the container and then the balls, time after time."""
    together = np.concatenate([container[:, None], balls], axis=1)
    return np.ascontiguousarray(together.reshape(-1, 2).T)


def write_csv(path: Path, units: Mapping[str, str], tables: Iterable[Table]) -> None:
    """Write the CSV of tables, whole or not at all. Raises ``UserError``."""
    with written(path) as part, part.open("x", encoding="ascii", newline="") as file:
        file.writelines(csv_lines(units, tables))


# Tables -> a Parquet file, a row group each, with units and provenance in its schema.

WHOLE_NUMBERS = ("i", "j", "ball")


def write_parquet(
    path: Path, units: Mapping[str, str], tables: Iterable[Table], about: Mapping[str, Any]
) -> None:
    """Write tables with these columns, whole or not at all, in the memory that one of them takes.

    about : where they come from; JSON of the schema's metadata ``snooker``

    Raises ``UserError`` without pyarrow, or if the file cannot be written.
    """
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise UserError(
            "a Parquet file needs pyarrow; install it with `pip install 'snooker[parquet]'`, or "
            "export as CSV"
        ) from None
    kinds = {name: pa.int32() if name in WHOLE_NUMBERS else pa.float64() for name in units}
    fields = [
        pa.field(name, kinds[name], nullable=False, metadata={"unit": unit})
        for name, unit in units.items()
    ]
    schema = pa.schema(fields, metadata={"snooker": json.dumps(dict(about))})
    # The bytes of doubles side by side, as HDF5's shuffle has them: a fifth smaller, and faster.
    packing = {
        "compression": "zstd",
        "use_dictionary": [name for name in units if name in WHOLE_NUMBERS],
        "use_byte_stream_split": [name for name in units if name not in WHOLE_NUMBERS],
    }
    with written(path) as part, parquet.ParquetWriter(part, schema, **packing) as writer:
        for table in tables:
            columns = [pa.array(table[name]) for name in units]
            writer.write_batch(pa.record_batch(columns, schema=schema))


__all__ = [
    "EVENTS",
    "STATES",
    "Table",
    "csv_lines",
    "events_table",
    "frames",
    "states_table",
    "write_csv",
    "write_parquet",
]
