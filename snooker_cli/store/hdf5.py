"""HDF5 through h5py's low-level calls, which are many times faster for small datasets."""

from __future__ import annotations

import itertools
import math
import os
import zlib
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5f, h5g, h5o, h5p, h5r, h5s, h5t
from numpy.typing import NDArray

FORMAT = ("v110", "v110")
"""The version of HDF5's file format: its metadata have checksums, so damage is noticed."""

UNREADABLE = (OSError, KeyError, ValueError, TypeError, RuntimeError)
UNWRITABLE = (OSError, RuntimeError)
"""What h5py raises for a file that cannot be read, and for one that cannot be written."""

TYPES = {
    np.dtype(np.float64): h5t.NATIVE_DOUBLE,
    np.dtype(np.int64): h5t.NATIVE_INT64,
    np.dtype(np.int32): h5t.NATIVE_INT32,
}
TEXT = h5t.py_create(h5py.string_dtype(), logical=True)
TEXT_IN_MEMORY = h5t.py_create(h5py.string_dtype())

ZLIB_HEADER, LAST_BLOCK = b"\x78\x01", b"\x03\x00"
"""The first bytes of a zlib stream (RFC 1950), and the empty block at the end of deflate's."""

LARGEST_STORED_BLOCK = 65535
NOISE_SAMPLE = 4096


# Files.


def open_file(path: Path, *, write: bool = False) -> Any:
    """A file on the disk, without locks: while written it has one user, then it never changes."""
    settings = _access()
    settings.set_file_locking(False, True)
    return h5f.open(os.fsencode(path), h5f.ACC_RDWR if write else h5f.ACC_RDONLY, settings)


def open_image(image: bytes, name: str) -> Any:
    """A file in memory that starts with these bytes; ``name`` must be unique among threads."""
    settings = _access()
    settings.set_fapl_core(1 << 16, False)
    settings.set_file_image(image)
    return h5f.open(name.encode(), h5f.ACC_RDWR, settings)


def _access() -> Any:
    settings = h5p.create(h5p.FILE_ACCESS)
    settings.set_libver_bounds(h5f.LIBVER_V110, h5f.LIBVER_V110)
    settings.set_fclose_degree(h5f.CLOSE_STRONG)
    return settings


def open_all(group: Any) -> None:
    """Open everything below a group, and all attributes. Raises what HDF5 finds damaged."""
    for name in list(group):
        item = h5o.open(group, name)
        for index in range(h5a.get_num_attrs(item)):
            h5a.open(item, index=index)
        if isinstance(item, h5g.GroupID):
            open_all(item)


def error_text(error: Exception) -> str:
    """The first line of an error of HDF5 or of the system."""
    if isinstance(error, OSError) and error.errno:
        return os.strerror(error.errno)
    return (str(error).splitlines() or [type(error).__name__])[0]


# Groups and links.


def exists(place: Any, path: bytes) -> bool:
    """Whether there is something at a path."""
    steps = itertools.accumulate(path.split(b"/"), lambda above, name: above + b"/" + name)
    return all(place.links.exists(step) for step in steps)


def link(place: Any, path: bytes, target: bytes) -> None:
    """Give what is at ``target`` another name."""
    place.links.create_hard(path, place, target)


def _create_groups(place: Any, path: bytes) -> None:
    """Create the groups that a path runs through."""
    parent = path.rpartition(b"/")[0]
    if parent and not exists(place, parent):
        _create_groups(place, parent)
        h5g.create(place, parent, None, _timeless(h5p.GROUP_CREATE))


def _timeless(kind: Any) -> Any:
    """Creation settings without the time of day, so that the same trace gives the same file."""
    settings = h5p.create(kind)
    settings.set_obj_track_times(False)
    return settings


# Datasets.


def create(
    place: Any,
    path: bytes,
    shape: tuple[int, ...],
    dtype: Any,
    unit: str | None = None,
    chunk: int = 0,
) -> Any:
    """A dataset without values, in groups that are created if need be.

    chunk : rows in a chunk, shuffled and deflated, of a dataset that can grow; 0 for neither
    """
    _create_groups(place, path)
    settings = _timeless(h5p.DATASET_CREATE)
    space = h5s.create_simple(shape)
    if chunk:
        settings.set_chunk((chunk, *shape[1:]))
        settings.set_shuffle()
        settings.set_deflate(1)
        space = h5s.create_simple(shape, (h5s.UNLIMITED, *shape[1:]))
    data = h5d.create(place, path, TYPES[np.dtype(dtype)], space, settings)
    if unit is not None:
        kind = _fixed_string(len(unit))
        attribute = h5a.create(data, b"unit", kind, h5s.create(h5s.SCALAR))
        attribute.write(np.array(unit.encode()), kind)
    return data


@cache
def _fixed_string(length: int) -> Any:
    """The type of a string of fixed length, which H5MD wants for units."""
    kind = h5t.C_S1.copy()
    kind.set_size(length)
    kind.set_strpad(h5t.STR_NULLPAD)
    return kind


def fill(place: Any, path: bytes, values: NDArray[Any]) -> None:
    """Write all values of a dataset."""
    data = h5d.open(place, path)
    data.write(h5s.ALL, h5s.ALL, np.ascontiguousarray(values), TYPES[values.dtype])


def append(place: Any, path: bytes, start: int, values: NDArray[Any], chunk: int) -> None:
    """Add a chunk to a dataset at row ``start``; only the last may have fewer than ``chunk`` rows.

    Rows that were never written, before ``start``, are zero and take no space.
    """
    data = h5d.open(place, path)
    data.set_extent((start + len(values), *values.shape[1:]))
    data.write_direct_chunk((start, *(0 for _ in values.shape[1:])), packed(values, chunk))


def length(place: Any, path: bytes) -> int:
    """The number of rows of a dataset."""
    return int(h5d.open(place, path).shape[0])


def get(
    place: Any, path: bytes, dtype: Any = np.float64, rows: slice | None = None
) -> NDArray[Any]:
    """A dataset, or some of its rows, as an array of this type."""
    data = h5d.open(place, path)
    first, last = (0, data.shape[0]) if rows is None else (rows.start, rows.stop)
    values = np.empty((last - first, *data.shape[1:]), dtype)
    here = there = h5s.ALL
    if len(values) < data.shape[0]:
        here, there = h5s.create_simple(values.shape), data.get_space()
        there.select_hyperslab((first, *(0 for _ in values.shape[1:])), values.shape)
    data.read(here, there, values, TYPES[values.dtype])
    return values


# Attributes.


def write_text(place: Any, name: bytes, text: str) -> None:
    """Write a text attribute of any length."""
    attribute = h5a.create(place, name, TEXT, h5s.create(h5s.SCALAR))
    attribute.write(np.array(text, dtype=h5py.string_dtype()), TEXT_IN_MEMORY)


def read_text(place: Any, name: bytes) -> str:
    """An attribute that ``write_text`` wrote."""
    text = np.zeros((), dtype=h5py.string_dtype())
    h5a.open(place, name).read(text, TEXT_IN_MEMORY)
    return bytes(text[()]).decode()


def read_number(place: Any, name: bytes) -> int:
    """An attribute that is an integer."""
    number = np.zeros((), np.int64)
    h5a.open(place, name).read(number, h5t.NATIVE_INT64)
    return int(number)


def write_reference(place: Any, path: bytes, name: bytes, target: bytes) -> None:
    """Write an attribute of the object at ``path`` that refers to the one at ``target``."""
    kind = h5t.STD_REF_OBJ
    attribute = h5a.create(h5o.open(place, path), name, kind, h5s.create(h5s.SCALAR))
    reference = h5r.create(place, target, h5r.OBJECT)
    attribute.write(np.array(reference, dtype=h5py.ref_dtype), h5t.py_create(h5py.ref_dtype))


# A chunk's bytes, compressed here because zlib, unlike HDF5, lets other threads run.


def packed(values: NDArray[Any], rows: int) -> bytes:
    """The values as HDF5's shuffle and deflate filters would leave a chunk of ``rows`` rows.

    Missing rows are zero. Each byte of the numbers is compressed by itself: most are noise, in
    which zlib would search longer for patterns than in all others.
    """
    if len(values) < rows:
        padded = np.zeros((rows, *values.shape[1:]), values.dtype)
        padded[: len(values)] = values
        values = padded
    bytewise = np.ascontiguousarray(values).view(np.uint8).reshape(-1, values.itemsize)
    shuffled = np.ascontiguousarray(bytewise.T)
    pieces = [ZLIB_HEADER]
    for k, row in enumerate(shuffled):
        if k > 0 and np.array_equal(row, shuffled[k - 1]):
            pieces.append(pieces[-1])
        elif values.dtype.kind == "f" and is_noise(row):
            pieces.append(stored(row))
        else:
            pieces.append(deflated(row, counting=values.dtype == np.int64))
    return b"".join([*pieces, LAST_BLOCK, zlib.adler32(shuffled.data).to_bytes(4, "big")])


def is_noise(data: NDArray[np.uint8]) -> bool:
    """Whether few neighbouring bytes are equal and no byte is frequent, judged by a sample."""
    sample = data[:: max(1, len(data) // NOISE_SAMPLE)]
    expected = len(sample) / 256
    alike = np.count_nonzero(data[1:] == data[:-1]) > len(data) / 32
    return not alike and bool(np.bincount(sample).max() < expected + 8 * math.sqrt(expected))


def stored(data: NDArray[np.uint8]) -> bytes:
    """Uncompressed bytes in deflate's stored blocks (RFC 1951, 3.2.4)."""
    pieces = []
    for start in range(0, len(data), LARGEST_STORED_BLOCK):
        piece = data[start : start + LARGEST_STORED_BLOCK]
        size = len(piece).to_bytes(2, "little")
        pieces += [b"\0", size, bytes(255 - byte for byte in size), piece.tobytes()]
    return b"".join(pieces)


def deflated(data: NDArray[np.uint8], *, counting: bool) -> bytes:
    """Bytes in deflate's blocks that end on a whole byte and refer to none before them.

    counting : for steps, which have long patterns; for other data, runs of one byte are enough
    """
    strategy = zlib.Z_DEFAULT_STRATEGY if counting else zlib.Z_RLE
    deflate = zlib.compressobj(1, wbits=-zlib.MAX_WBITS, strategy=strategy)
    return deflate.compress(data.data) + deflate.flush(zlib.Z_FULL_FLUSH)
