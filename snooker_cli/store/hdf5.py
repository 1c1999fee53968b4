"""HDF5 through h5py: open and check files, read and write datasets."""

import io
import math
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, lru_cache
from itertools import count
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5g, h5l, h5o, h5p, h5s, h5t, h5z
from numpy.typing import NDArray

from snooker_cli.files import open_file

FORMAT = ("v110", "v110")  # the version whose metadata have checksums, so damage is noticed
UNWRITABLE = (OSError, RuntimeError)  # what h5py raises for a file that cannot be written
MOST_LINKS = 1000  # names in a file. snooker writes fewer than 100.
TYPES = (h5t.TypeIntegerID, h5t.TypeFloatID, h5t.TypeStringID, h5t.TypeReferenceID, h5t.TypeEnumID)
ROWS = 65536  # in a chunk of a dataset that is not written at once
FILTERS = [h5z.FILTER_SHUFFLE, h5z.FILTER_DEFLATE]  # of all chunks, except those of one row
SMALL = 1024  # bytes of a dataset up to which it is stored in its header

UNPACKED, UNPACKED_PER_BYTE = 1 << 28, 300
"""The most bytes that a file unpacks to, and more for each of its own bytes. The collisions of a
single ball that bounces at equal intervals need 250 for each."""


class _Unfailing(io.FileIO):
    """A file whose writes never fail; the first error is kept."""

    error: OSError | None = None

    def write(self, data: Any) -> int:
        rest = memoryview(data)
        try:
            while rest and not self.error:
                rest = rest[super().write(rest) :]
        except OSError as error:
            self.error = error
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        try:
            return super().truncate(size)
        except OSError as error:
            self.error = self.error or error
            return 0

    def check(self) -> None:
        """Raise the first error of a write."""
        if self.error:
            raise self.error


@contextmanager
def new_file(path: Path) -> Iterator[tuple[h5py.File, Callable[[], None]]]:
    """A new file, and a function that raises ``OSError`` if a write has failed.

    HDF5 does not see such errors: after one, it may crash when the process ends.
    """
    with _Unfailing(path, "x+") as target:
        with h5py.File(target, "w", libver=FORMAT) as file:
            yield file, target.check
        target.check()


def is_marked(path: Path) -> bool:
    """Whether HDF5 has marked a file as open for writing; it refuses to read such a file."""
    with suppress(OSError), open_file(path) as file:
        start = file.read(12)  # signature, version of the superblock, sizes, consistency flags
        return start[:8] == b"\x89HDF\r\n\x1a\n" and start[8:9] == b"\3" and start[11:] > b"\0"
    return False


def check_links(file: h5py.File) -> list[bytes]:
    """One name of each object. Raises ``ValueError`` for links out of the file and for too many."""
    names: dict[int, bytes] = {}
    numbers = count(1)

    def is_wrong(name: bytes, link: Any) -> bool | None:  # None: visit goes on
        names.setdefault(link.u, name)  # of a hard link this is the object's address
        return link.type != h5l.TYPE_HARD or next(numbers) > MOST_LINKS or None

    if file.id.links.visit(is_wrong, info=True):
        raise ValueError("it has a link to another place, or too many links")
    return [b".", *names.values()]


def check_objects(file: h5py.File, names: Iterable[bytes], sparse: str) -> None:
    """Open all objects and attributes, and raise ``ValueError`` for what no file has.

    This comes before any value is read: HDF5 may crash on damaged values of variable length, and a
    small file may declare datasets that fill the memory.

    names : of the objects
    sparse : the dataset some of whose chunks may be missing
    """
    size, most = 0, UNPACKED + UNPACKED_PER_BYTE * file.id.get_filesize()
    for name in names:
        item = h5o.open(file.id, name)
        if isinstance(item, h5d.DatasetID):
            _check_type(item.get_type(), name)
            size += _unpacked_size(item, name.decode(), sparse)
            if size > most:
                raise ValueError(f"it unpacks to more than {most:,} bytes")
        elif not isinstance(item, h5g.GroupID):
            raise ValueError("it has an object that is neither a group nor a dataset")
        for index in range(h5a.get_num_attrs(item)):
            _check_type(h5a.open(item, index=index).get_type(), name)


def _check_type(kind: Any, name: bytes) -> None:
    """Raise ``ValueError`` unless a type is of numbers, text of fixed length or references."""
    if not isinstance(kind, TYPES) or (
        isinstance(kind, h5t.TypeStringID) and kind.is_variable_str()
    ):
        where = name.decode("utf-8", "replace")
        raise ValueError(f"{where} has neither numbers nor text of fixed length")


def _unpacked_size(data: Any, path: str, sparse: str) -> int:
    """The most bytes that a dataset takes in memory.

    Raises ``ValueError`` for one that is stored in another way than snooker does it, or whose bytes
    are not there.
    """
    settings, shape = data.get_create_plist(), data.shape
    filters = [settings.get_filter(k)[0] for k in range(settings.get_nfilters())]
    size = math.prod(shape) * data.get_type().get_size()
    if settings.get_layout() == h5d.CHUNKED:
        chunk, *rest = settings.get_chunk()
        packed = chunk in (shape[0], ROWS) and filters == FILTERS
        known = (packed or (chunk == 1 and not filters)) and rest == [*shape[1:]]
        if known and path != sparse and data.get_num_chunks() < math.ceil(shape[0] / chunk):
            raise ValueError(f"{path} has a chunk that is missing")
        size = math.prod(shape) * max(data.get_type().get_size(), 8)  # counts are read as int64
    else:
        known = settings.get_layout() in (h5d.COMPACT, h5d.CONTIGUOUS) and not filters
        stored = data.get_storage_size()
        if known and size > stored:
            raise ValueError(f"{path} needs {size:,} bytes, and {stored:,} are stored")
    if not known or settings.get_external_count():
        raise ValueError(f"{path} is stored in a way that snooker does not use")
    return int(size)


# h5py's objects for datasets and attributes take three times as long as its low-level calls.


@cache
def native(dtype: Any) -> Any:
    """HDF5's type for numbers in memory, and in files."""
    return h5t.py_create(np.dtype(dtype))


def read_attribute(file: h5py.File, path: str, name: str) -> Any:
    """An attribute: a number or text."""
    attribute = h5a.open(file.id, name.encode(), obj_name=path.encode())
    _check_type(attribute.get_type(), path.encode())
    if attribute.shape != ():
        raise ValueError(f"the attribute {name} is not a single value")
    value = np.zeros((), attribute.dtype)
    attribute.read(value)
    number_or_text = value.item()
    return number_or_text.decode() if isinstance(number_or_text, bytes) else number_or_text


def read_rows(
    file: h5py.File, path: str, dtype: Any = np.float64, rows: slice = slice(None)
) -> NDArray[Any]:
    """A dataset, or some of its rows, as an array of this type; with ``None``, of its own.

    Raises ``ValueError`` for other types, and for a chunk that has another size than it declares.
    """
    data = h5d.open(file.id, path.encode())
    kind, space = data.dtype, data.get_space()
    dtype = np.dtype(kind if dtype is None else dtype)
    if kind.kind not in "biufS" or not np.can_cast(kind, dtype, "same_kind"):
        raise ValueError(f"{path} has neither numbers of its type nor text of fixed length")
    if not data.shape:
        values = np.empty((), dtype)
        data.read(h5s.ALL, h5s.ALL, values, native(dtype))
        return values
    first, last, _ = rows.indices(data.shape[0])
    rest = data.shape[1:]
    values = np.empty((last - first, *rest), dtype)
    if values.size:
        if data.get_create_plist().get_layout() == h5d.CHUNKED:
            _check_chunks(data, first, last)
        space.select_hyperslab((first, *(0 for _ in rest)), values.shape)
        data.read(h5s.create_simple(values.shape), space, values, native(dtype))
    return values


def _check_chunks(data: Any, first: int, last: int) -> None:
    """Raise ``ValueError`` if the chunks of some rows unpack to another size than they declare.

    HDF5 2.0 does not compare the sizes. It unpacks all of a chunk, which may be a thousand times
    its size, and reads beyond the end of one that is too short, which may end the process.
    """
    settings = data.get_create_plist()
    chunk, *rest = settings.get_chunk()
    if settings.get_nfilters() == 0:  # nothing is unpacked
        return
    size = data.dtype.itemsize * chunk * math.prod(rest)
    for start in range(first - first % chunk, last, chunk):
        place = (start, *(0 for _ in rest))
        if data.get_chunk_info_by_coord(place).byte_offset is None:
            continue  # HDF5 gives zeros
        skipped, content = data.read_direct_chunk(place)
        if skipped or len(zlib.decompressobj().decompress(content, size + 1)) != size:
            raise ValueError("a chunk has another size than it declares")


def length(file: h5py.File, path: str) -> int:
    """The number of rows of a dataset."""
    return int(h5d.open(file.id, path.encode()).shape[0])


def read_text(file: h5py.File, path: str) -> list[str]:
    """A dataset of ASCII text of fixed length."""
    values = read_rows(file, path, None)
    if values.dtype.kind != "S":
        raise ValueError(f"{path} is not text")
    return [text.decode() for text in values.ravel().tolist()]


def write_rows(
    file: h5py.File,
    path: str,
    values: NDArray[Any],
    unit: str | None = None,
    chunk: int = 0,
    before: int = 0,
    packed: bool = True,
) -> None:
    """Write a dataset, or add a chunk to it; groups are created if need be.

    unit : in SI, an attribute
    chunk : rows in a chunk, shuffled and deflated if ``packed``, of a dataset that can grow; 0 for
        none
    before : rows before these; those that were never written are zero and take no space
    """
    rest = values.shape[1:]
    if chunk and path in file:
        data = file[path].id
    else:
        space = h5s.create_simple(values.shape)
        if chunk:
            space = h5s.create_simple((0, *rest), (h5s.UNLIMITED, *rest))
        shape = (chunk, *rest) if chunk else None
        settings = _settings(shape, 0 < values.nbytes <= SMALL, packed)
        data = h5d.create(file.id, path.encode(), native(values.dtype), space, *settings)
        if unit is not None:  # H5MD wants a string of fixed length
            text = np.array(unit.encode())
            kind = native(text.dtype)
            h5a.create(data, b"unit", kind, h5s.create(h5s.SCALAR)).write(text, kind)
    if not chunk:
        data.write(h5s.ALL, h5s.ALL, values, native(values.dtype))
        return
    data.set_extent((before + len(values), *rest))
    space = data.get_space()
    space.select_hyperslab((before, *(0 for _ in rest)), values.shape)
    values = np.ascontiguousarray(values)
    data.write(h5s.create_simple(values.shape), space, values, native(values.dtype))


@lru_cache(maxsize=64)
def _settings(chunk: tuple[int, ...] | None, small: bool, packed: bool) -> tuple[Any, Any]:
    """HDF5's settings for a dataset with such chunks, and for the groups above it."""
    settings, links = h5p.create(h5p.DATASET_CREATE), h5p.create(h5p.LINK_CREATE)
    settings.set_obj_track_times(False)
    if chunk:
        settings.set_chunk(chunk)
        if packed:
            settings.set_shuffle()
            settings.set_deflate(1)
    elif small:  # in the header, which has a checksum
        settings.set_layout(h5d.COMPACT)
    links.set_create_intermediate_group(True)
    return settings, links


def link(file: h5py.File, new: str, old: str) -> None:
    """Give an object another name."""
    file.id.links.create_hard(new.encode(), file.id, old.encode())
