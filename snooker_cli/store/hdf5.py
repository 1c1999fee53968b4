"""HDF5 by its low-level calls: many times as fast for files of many small datasets."""

from __future__ import annotations

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

DOUBLE, INTEGER, BALL = h5t.NATIVE_DOUBLE, h5t.NATIVE_INT64, h5t.NATIVE_INT32
TEXT = h5t.py_create(h5py.string_dtype(), logical=True)
TEXT_HERE = h5t.py_create(h5py.string_dtype())
"""A text of any length in a file, and as NumPy has it."""

FORMAT = ("v110", "v110")
"""The version of HDF5's format that has checksums in its metadata; see ``access``."""

ZLIB_HEADER, LAST_BLOCK = b"\x78\x01", b"\x03\x00"
"""How a stream of zlib's begins (RFC 1950), and the empty block that ends one of deflate's."""

MOST_STORED = 65535
"""Bytes in a stored block."""

SAMPLE = 4096

UNREADABLE = (OSError, KeyError, ValueError, TypeError, RuntimeError)
UNWRITABLE = (OSError, RuntimeError)
"""What h5py raises for a file that cannot be read, and for one that cannot be written."""


@cache
def fixed_string(length: int) -> Any:
    """The type of a string of fixed length, as H5MD wants its names and units."""
    kind = h5t.C_S1.copy()
    kind.set_size(length)
    kind.set_strpad(h5t.STR_NULLPAD)
    return kind


def access(*, in_memory: bool) -> Any:
    """How a file is opened.

    Version 1.10 of the format has checksums in its metadata: a damaged file is refused. Files
    under way are no one else's and finished ones never change: neither needs a lock, and on some
    network disks none can be had.
    """
    settings = h5p.create(h5p.FILE_ACCESS)
    settings.set_libver_bounds(h5f.LIBVER_V110, h5f.LIBVER_V110)
    settings.set_fclose_degree(h5f.CLOSE_STRONG)
    if in_memory:
        settings.set_fapl_core(1 << 16, False)
    else:
        settings.set_file_locking(False, True)
    return settings


def write_unit(data: Any, unit: bytes) -> None:
    """The attribute ``unit``, a string of fixed length."""
    kind = fixed_string(len(unit))
    attribute = h5a.create(data, b"unit", kind, h5s.create(h5s.SCALAR))
    attribute.write(np.array(unit), kind)


def timeless(kind: Any) -> Any:
    """How something is created without the time of day in it: the same trace, the same file."""
    settings = h5p.create(kind)
    settings.set_obj_track_times(False)
    return settings


def create_group(place: Any, path: bytes) -> None:
    """An empty group."""
    h5g.create(place, path, None, timeless(h5p.GROUP_CREATE))


def create(place: Any, path: bytes, shape: tuple[int, ...], kind: Any, unit: bytes | None) -> Any:
    """A dataset of fixed shape, without its data."""
    space = h5s.create_simple(shape)
    data = h5d.create(place, path, kind, space, timeless(h5p.DATASET_CREATE))
    if unit is not None:
        write_unit(data, unit)
    return data


def create_chunked(
    place: Any, path: bytes, rows: int, shape: tuple[int, ...], kind: Any, unit: bytes | None
) -> Any:
    """An empty dataset that grows by chunks of so many rows, each shuffled and deflated."""
    settings = timeless(h5p.DATASET_CREATE)
    settings.set_chunk((rows, *shape))
    settings.set_shuffle()
    settings.set_deflate(1)
    space = h5s.create_simple((0, *shape), (h5s.UNLIMITED, *shape))
    data = h5d.create(place, path, kind, space, settings)
    if unit is not None:
        write_unit(data, unit)
    return data


def append_chunk(data: Any, start: int, values: NDArray[Any], chunk: bytes) -> None:
    """Add a chunk, made by ``packed``, at row ``start``; only the last may be short of rows."""
    data.set_extent((start + len(values), *values.shape[1:]))
    data.write_direct_chunk((start, *(0 for _ in values.shape[1:])), chunk)


def packed(values: NDArray[Any], rows: int) -> bytes:
    """The values as HDF5's shuffle and deflate leave a chunk of so many rows, others zero.

    Made here because zlib lets other threads run meanwhile, and HDF5 does not; and because the
    shuffled bytes can be taken one kind at a time. Most bytes of a random number are noise, in
    which zlib would look for patterns longer than in all the rest.
    """
    if len(values) < rows:
        padded = np.zeros((rows, *values.shape[1:]), values.dtype)
        padded[: len(values)] = values
        values = padded
    bytewise = np.ascontiguousarray(values).view(np.uint8).reshape(-1, values.itemsize)
    shuffled = np.ascontiguousarray(bytewise.T)
    pieces = [ZLIB_HEADER]
    for k, kind in enumerate(shuffled):
        if k > 0 and np.array_equal(kind, shuffled[k - 1]):
            pieces.append(pieces[-1])
        elif values.dtype.kind == "f" and is_noise(kind):
            pieces.append(stored(kind))
        else:
            pieces.append(deflated(kind, counting=values.dtype == np.int64))
    return b"".join([*pieces, LAST_BLOCK, zlib.adler32(shuffled.data).to_bytes(4, "big")])


def is_noise(data: NDArray[np.uint8]) -> bool:
    """Whether bytes are neither alike in rows nor some of them frequent, judged by a sample."""
    sample = data[:: max(1, len(data) // SAMPLE)]
    expected = len(sample) / 256
    alike = np.count_nonzero(data[1:] == data[:-1]) > len(data) / 32
    return not alike and bool(np.bincount(sample).max() < expected + 8 * math.sqrt(expected))


def stored(data: NDArray[np.uint8]) -> bytes:
    """Bytes as they are, in deflate's stored blocks (RFC 1951, 3.2.4)."""
    pieces = []
    for start in range(0, len(data), MOST_STORED):
        piece = data[start : start + MOST_STORED]
        length = len(piece).to_bytes(2, "little")
        pieces += [b"\0", length, bytes(255 - byte for byte in length), piece.tobytes()]
    return b"".join(pieces)


def deflated(data: NDArray[np.uint8], *, counting: bool) -> bytes:
    """Bytes in deflate's blocks that end on a whole byte and look back at none before them.

    Between random numbers there is nothing to find but runs of the same byte: looking for no more
    takes half the time and the same space. Counting on, as steps do, makes longer patterns.
    """
    strategy = zlib.Z_DEFAULT_STRATEGY if counting else zlib.Z_RLE
    deflate = zlib.compressobj(1, wbits=-zlib.MAX_WBITS, strategy=strategy)
    return deflate.compress(data.data) + deflate.flush(zlib.Z_FULL_FLUSH)


def put(place: Any, values: NDArray[Any], kind: Any, path: bytes = b"") -> None:
    """Fill a dataset that is there: this one, or the one at ``path`` from here."""
    data = h5d.open(place, path) if path else place
    data.write(h5s.ALL, h5s.ALL, np.ascontiguousarray(values), kind)


def get(
    place: Any, path: bytes, dtype: Any = np.float64, rows: slice | None = None
) -> NDArray[Any]:
    """A dataset, or some rows of it that are there, as an array of this type."""
    data = h5d.open(place, path)
    shape = data.shape
    if rows is None or rows == slice(0, shape[0]):
        values = np.empty(shape, dtype)
        data.read(h5s.ALL, h5s.ALL, values, h5t.py_create(values.dtype))
        return values
    values = np.empty((rows.stop - rows.start, *shape[1:]), dtype)
    space = data.get_space()
    space.select_hyperslab((rows.start, *(0 for _ in shape[1:])), values.shape)
    data.read(h5s.create_simple(values.shape), space, values, h5t.py_create(values.dtype))
    return values


def open_all(group: Any) -> None:
    """Open everything below a group, and all attributes; raises what HDF5 finds to be damaged."""
    for name in list(group):
        item = h5o.open(group, name)
        for index in range(h5a.get_num_attrs(item)):
            h5a.open(item, index=index)
        if isinstance(item, h5g.GroupID):
            open_all(item)


def in_memory(image: bytes, name: str) -> Any:
    """A file in memory that starts as a copy of another's bytes.

    name : HDF5 knows files by name, those in memory too: threads need different ones
    """
    settings = access(in_memory=True)
    settings.set_file_image(image)
    return h5f.open(name.encode(), h5f.ACC_RDWR, settings)


def on_disk(path: Path) -> Any:
    """A file on the disk, to be added to."""
    return h5f.open(os.fsencode(path), h5f.ACC_RDWR, access(in_memory=False))


def to_read(path: Path) -> Any:
    """A finished file."""
    return h5f.open(os.fsencode(path), h5f.ACC_RDONLY, access(in_memory=False))


def length(place: Any, path: bytes) -> int:
    """The rows of a dataset."""
    return int(h5d.open(place, path).shape[0])


def exists(place: Any, name: bytes) -> bool:
    """Whether there is something of that name, in groups that are there."""
    return bool(place.links.exists(name))


def link(place: Any, path: bytes, target: bytes) -> None:
    """Another name for what is at ``target``."""
    place.links.create_hard(path, place, target)


def write_text(place: Any, name: bytes, text: str) -> None:
    """An attribute of any length."""
    attribute = h5a.create(place, name, TEXT, h5s.create(h5s.SCALAR))
    attribute.write(np.array(text, dtype=h5py.string_dtype()), TEXT_HERE)


def read_text(place: Any, name: bytes) -> str:
    """What ``write_text`` wrote."""
    text = np.zeros((), dtype=h5py.string_dtype())
    h5a.open(place, name).read(text, TEXT_HERE)
    return bytes(text[()]).decode()


def read_number(place: Any, name: bytes) -> int:
    """An attribute that is a whole number."""
    number = np.zeros((), np.int64)
    h5a.open(place, name).read(number, INTEGER)
    return int(number)


def write_reference(place: Any, name: bytes, root: Any, path: bytes) -> None:
    """An attribute that refers to the object at ``path``."""
    attribute = h5a.create(place, name, h5t.STD_REF_OBJ, h5s.create(h5s.SCALAR))
    reference = h5r.create(root, path, h5r.OBJECT)
    attribute.write(np.array(reference, dtype=h5py.ref_dtype), h5t.py_create(h5py.ref_dtype))


def said(error: Exception) -> str:
    """What an error of HDF5 or of the system says, in some words."""
    if isinstance(error, OSError) and error.errno:
        return os.strerror(error.errno)
    return (str(error).splitlines() or [type(error).__name__])[0]
