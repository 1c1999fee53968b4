"""Export a repeat for other programs: tables as CSV or Parquet, states as H5MD or XYZ in 3D."""

import csv
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from io import StringIO
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from snooker_cli import __version__
from snooker_cli.engine import States
from snooker_cli.errors import UserError, error_text, install_advice, room_advice
from snooker_cli.fields import (
    EVENT_COLUMNS,
    MOVING,
    MovingField,
    carried_fields,
    moving_fields,
)
from snooker_cli.files import atomic_write
from snooker_cli.plugins import PluginError, Table, check_function
from snooker_cli.scene import Scene
from snooker_cli.store import RepeatHeader, hdf5
from snooker_cli.store.file_format import PROVENANCE, write_h5md_group
from snooker_cli.trace import CONTAINER, Events

Columns = dict[str, NDArray[Any]]  # columns of one length, by name

EVENTS = {column.title: column.unit for column in EVENT_COLUMNS if column.title}
STATES = {"time": "s", "ball": "1"}
STATES |= {title: field.unit for field in MOVING for title in field.titles}
"""The columns of both tables and their units; ball -1 is the container, which does not turn.

Only rough balls have the last one of both.
"""

CSV_LINES = 1 << 16  # lines of CSV that are formatted at a time

H5MD_CHUNK = 1 << 18  # bytes of a chunk in H5MD, approximately

DEFLATED = {"shuffle": True, "compression": "gzip", "compression_opts": 1}


@contextmanager
def _exported(path: Path) -> Iterator[Path]:
    """A temporary path that becomes the file. Raises ``UserError`` if it cannot be written."""
    try:
        with atomic_write(path, given=True) as part:
            yield part
            if not part.exists():
                raise UserError(f"{path}: the format {path.suffix} has written no file")
    except hdf5.UNWRITABLE as error:
        raise UserError(
            f"{path}: cannot be written ({error_text(error)})",
            f"{room_advice(error)} or choose another file",
        ) from None


def events_table(events: Events) -> Columns:
    """The columns of ``EVENTS``."""
    columns = events.columns
    return {c.title: columns[c.name] for c in EVENT_COLUMNS if c.title and c.name in columns}


def states_table(states: States) -> Columns:
    """The columns of ``STATES``: at each time the container, then all balls."""
    moments, number = len(states.time), states.positions.shape[1]
    columns: dict[str, NDArray[np.float64]] = {}
    for field in MOVING:
        if (values := states.moving.get(field.name)) is not None:
            parts = values.reshape(moments, -1, len(field.titles))  # of balls, or the container
            for k, title in enumerate(field.titles):
                column = columns.setdefault(title, np.zeros((moments, 1 + number)))
                column[:, slice(0, 1) if field.of_container else slice(1, None)] = parts[..., k]
    return {
        "time": np.repeat(states.time, 1 + number),
        "ball": np.tile(np.arange(CONTAINER, number, dtype=np.int32), moments),
        **{title: column.ravel() for title, column in columns.items()},
    }


def csv_lines(units: Mapping[str, str], tables: Iterable[Columns]) -> Iterator[str]:
    """A CSV, many lines at a time: the columns' names, then texts, and numbers with all digits.

    units : of all columns that the tables can have, in order

    The names come after the first table was read, which may fail.
    """
    for k, table in enumerate(tables):
        names = [name for name in units if name in table]
        if k == 0:
            yield ",".join(names) + "\n"
        columns = [table[name] for name in names]
        for first in range(0, len(columns[0]), CSV_LINES):
            values = (column[first : first + CSV_LINES].tolist() for column in columns)
            lines = StringIO()
            csv.writer(lines, lineterminator="\n").writerows(zip(*values, strict=True))
            yield lines.getvalue()


def origin(header: RepeatHeader) -> dict[str, Any]:
    """Where a repeat comes from, for the metadata of a Parquet file."""
    provenance = asdict(header.provenance) | {"repeat": header.repeat}
    stop = header.stop.known()
    return {
        "snooker": __version__,
        "bits": header.fingerprint,
        "ending": stop,
        "provenance": provenance,
    }


def write_csv(
    part: Path, units: Mapping[str, str], tables: Iterable[Columns], _about: Mapping[str, Any]
) -> None:
    """Write the CSV of tables to a new file."""
    with part.open("x", encoding="ascii", newline="") as file:
        file.writelines(csv_lines(units, tables))


def write_parquet(
    part: Path, units: Mapping[str, str], tables: Iterable[Columns], about: Mapping[str, Any]
) -> None:
    """Write tables to a new file as row groups; one table is in memory at a time.

    about : where they come from; JSON of the schema's metadata ``snooker``

    Raises ``UserError`` without pyarrow.
    """
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise UserError(
            "a Parquet file needs pyarrow",
            f"{install_advice('parquet')}, or export as CSV",
        ) from None
    tables = iter(tables)
    first = next(tables)
    units = {name: unit for name, unit in units.items() if name in first}
    fields = [
        pa.field(name, pa.array(first[name]).type, nullable=False, metadata={"unit": unit})
        for name, unit in units.items()
    ]
    doubles = [name for name in units if first[name].dtype.kind == "f"]
    others = [name for name in units if name not in doubles]
    schema = pa.schema(fields, metadata={"snooker": json.dumps(dict(about))})
    # Splitting the bytes of doubles, like HDF5's shuffle, saves a fifth of the space.
    options = {"use_dictionary": others, "use_byte_stream_split": doubles, "compression": "zstd"}
    with parquet.ParquetWriter(part, schema, **options) as writer:
        for table in chain([first], tables):
            columns = [pa.array(table[name]) for name in units]
            writer.write_batch(pa.record_batch(columns, schema=schema))


SYMBOLS = ("H", "He", "Li", "Be", "B", "C", "N", "O", "X")
"""Elements, which programs read, for species by radius and mass; the last one for all others."""

XYZ_HEAD = (
    '{}\nLattice="{!r} 0 0 0 {!r} 0 0 0 {!r}" Origin="{!r} {!r} {!r}" pbc="{}" '
    "Properties=species:S:1:pos:R:3:velo:R:3:radius:R:1:mass:R:1:masses:R:1:momenta:R:3 "
    "Time={!r}\n"
)
XYZ_BALL = "{} {!r} {!r} 0 {!r} {!r} 0 {!r} {!r} {!r} {!r} {!r} 0"


def write_xyz(
    part: Path,
    start: Scene,
    _header: RepeatHeader,
    _times: NDArray[np.float64],
    batches: Iterable[States],
) -> None:
    """Write states to a new file as extended XYZ with z = 0.

    Each frame has the rectangle around the container as its cell, periodic along axes without
    walls, and the time in s. Numbers read back as the same doubles. OVITO knows `velo` and `mass`,
    ASE `momenta` and `masses`. Rough balls have `angular_velocity`, about z.
    """
    carried = carried_fields(start)
    more = "".join(f":{field.element}:R:3" for field in carried)
    head = XYZ_HEAD.replace(" Time", f"{more} Time")
    spaces = ["{!r} {!r} 0" if field.is_vector else "0 0 {!r}" for field in carried]
    ball = " ".join([XYZ_BALL, *spaces]) + "\n"
    sizes = np.column_stack([start.radii, start.masses])
    masses = start.masses[:, np.newaxis]
    group = np.unique(sizes, axis=0, return_inverse=True)[1].ravel()
    names = [SYMBOLS[k] for k in np.minimum(group, len(SYMBOLS) - 1)]
    cell = np.array([*start.container.size, 2 * float(np.max(start.radii))])
    pbc = " ".join("FT"[repeats] for repeats in (*start.container.periodic, False))
    with part.open("x", encoding="ascii", newline="") as file:
        for batch in batches:
            for k, time in enumerate(batch.time.tolist()):
                corner = np.append(batch.container_position[k], 0.0) - cell / 2
                edges = (*cell.tolist(), *corner.tolist())
                file.write(head.format(start.number, *edges, pbc, time))
                states = [batch.positions[k], batch.velocities[k], sizes, masses]
                states.append(masses * batch.velocities[k])
                states += [batch.moving[field.name][k].reshape(len(sizes), -1) for field in carried]
                balls = zip(names, np.hstack(states).tolist(), strict=True)
                file.writelines(ball.format(name, *row) for name, row in balls)


def write_h5md(
    part: Path,
    start: Scene,
    header: RepeatHeader,
    times: NDArray[np.float64],
    batches: Iterable[States],
) -> None:
    """Write states to a new file of H5MD in three dimensions, z = 0."""
    with hdf5.new_file(part) as (file, check):
        write_h5md_group(file)
        parameters = file.create_group("parameters/snooker")
        parameters.attrs["bits"] = np.bytes_(header.fingerprint, "ascii")
        source = json.dumps(asdict(header.provenance) | {"repeat": header.repeat})
        hdf5.write_rows(file, PROVENANCE, np.array(source, np.bytes_))
        datasets = _create_states(file, start, times)
        row = 0
        for batch in batches:
            rows = slice(row, row + len(batch.time))
            for field, data in datasets.items():
                data[rows] = _in_space(field, batch.moving[field.name])
            row = rows.stop
            check()


def _in_space(field: MovingField, states: NDArray[np.float64]) -> NDArray[np.float64]:
    """A field of ``States`` in three dimensions: spins are about z, all else has z = 0."""
    if not field.is_vector:
        return np.pad(states[..., np.newaxis], [(0, 0), (0, 0), (2, 0)])
    return np.pad(states, [(0, 0)] * (states.ndim - 1) + [(0, 1)])


def _create_states(
    file: h5py.File, start: Scene, times: NDArray[np.float64]
) -> dict[MovingField, h5py.Dataset]:
    """Write all but the states; their empty datasets."""
    group = file.create_group("particles/trajectory")
    position = group.create_group("position")
    position["step"], position["time"] = np.arange(len(times)), times
    position["time"].attrs["unit"] = "s"

    def element(path: str, shape: tuple[int, ...], unit: str) -> h5py.Dataset:
        """An element's dataset in chunks of whole frames."""
        holder = file.require_group(path)
        frame = (len(times), *shape)
        rows = min(len(times), max(1, H5MD_CHUNK // (8 * int(np.prod(shape)))))
        data = holder.create_dataset("value", frame, float, chunks=(rows, *shape), **DEFLATED)
        if holder != position:
            holder["step"], holder["time"] = position["step"], position["time"]
        # MDAnalysis refuses lengths in m as a unit of the dataset.
        unit_holder = holder if path.endswith(("trajectory/position", "edges")) else data
        unit_holder.attrs["unit"] = unit
        return data

    width, height = start.container.size
    edges = element("particles/trajectory/box/edges", (3,), "m")
    edges[:] = [width, height, 2 * float(np.max(start.radii))]
    boundary = [b"periodic" if repeats else b"none" for repeats in start.container.periodic]
    group["box"].attrs["dimension"] = 3
    group["box"].attrs["boundary"] = np.array([*boundary, b"none"])
    for name, values, unit in (("mass", start.masses, "kg"), ("radius", start.radii, "m")):
        group[name] = values
        group[name].attrs["unit"] = unit
    return {
        field: element(f"observables/{field.name}", (3,), field.unit)
        if field.of_container
        else element(f"particles/trajectory/{field.element}", (start.number, 3), field.unit)
        for field in moving_fields(start)
    }


# The formats of files.


class Format(NamedTuple):
    """A format of files, which has tables or states, or both.

    ending : of the names of files, in small letters: ``.xyz``
    title : in messages: ``extended XYZ``
    write_tables : the path of a new file, the units of all columns that tables can have, the
        tables, and where they come from, which JSON can have
    write_states : the path of a new file, the start and the header of the repeat, the times of all
        frames (*t*,), s, and the frames, some at a time, in order

    Both write the file; it gets its name when they return.
    """

    ending: str
    title: str
    write_tables: (
        Callable[[Path, Mapping[str, str], Iterable[Columns], Mapping[str, Any]], None] | None
    ) = None
    write_states: (
        Callable[[Path, Scene, RepeatHeader, NDArray[np.float64], Iterable[States]], None] | None
    ) = None


OWN = (
    Format(".csv", "CSV", write_tables=write_csv),
    Format(".parquet", "Parquet", write_tables=write_parquet),
    Format(".h5md", "H5MD", write_states=write_h5md),
    Format(".h5", "H5MD", write_states=write_h5md),
    Format(".xyz", "extended XYZ", write_states=write_xyz),
)


def _taken(thing: object) -> tuple[str, Format]:
    """What a distribution adds to ``FORMATS``. Raises ``PluginError``."""
    if not isinstance(thing, Format):
        raise PluginError("it is no Format", "name an object of this class")
    if not re.fullmatch(r"\.[a-z0-9]+", thing.ending):
        raise PluginError(f"its ending is {thing.ending!r}", "give a dot and small letters")
    if thing.write_tables is None and thing.write_states is None:
        raise PluginError("it writes neither tables nor states", "give it one of the functions")
    check_function(thing.write_tables, "write_tables", "path", "units", "tables", "about")
    check_function(thing.write_states, "write_states", "path", "start", "header", "times", "states")
    return thing.ending, thing


FORMATS = Table("snooker.exports", {known.ending: known for known in OWN}, _taken)
"""The formats of files by the endings of their names."""


def format_of(path: Path) -> Format | None:
    """The format of a file by the ending of its name; ``None`` if there is none."""
    return FORMATS.get(path.suffix.lower())


def export_endings() -> list[str]:
    """The endings of the names of all formats."""
    return [*FORMATS]


def has_only_states(path: Path) -> bool:
    """Whether a file of this name has states and no tables."""
    known = format_of(path)
    return known is not None and known.write_tables is None


def write_tables(
    path: Path, units: Mapping[str, str], tables: Iterable[Columns], about: Mapping[str, Any]
) -> None:
    """Write tables, whole or not at all. Raises ``UserError`` if the file cannot be written.

    path, about : with the ending of a format; as of ``Format``
    """
    write = FORMATS[path.suffix.lower()].write_tables
    assert write is not None
    with _exported(path) as part:
        write(part, units, tables, about)


def write_states(
    path: Path,
    start: Scene,
    header: RepeatHeader,
    times: NDArray[np.float64],
    batches: Iterable[States],
) -> None:
    """Write states, whole or not at all. Raises ``UserError`` if the file cannot be written.

    path : with the ending of a format; the others : as of ``Format``
    """
    write = FORMATS[path.suffix.lower()].write_states
    assert write is not None
    with _exported(path) as part:
        write(part, start, header, times, batches)
