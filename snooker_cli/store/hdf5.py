"""HDF5 through h5py: open and check files, and pack chunks while other threads run."""

import io
import math
import zlib
from collections.abc import Callable, Iterator
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
INFLATION = 1032  # the most bytes that deflate makes of one byte, https://zlib.net/zlib_tech.html

ZLIB_HEADER = b"\x78\x01"  # of a zlib stream, RFC 1950
LAST_BLOCK = b"\x03\x00"  # the empty one at the end of deflate's blocks
NOISE_SAMPLE = 4096  # bytes that are looked at to judge whether a column is noise
SMALL = 1024  # bytes of a dataset up to which it is stored in its header


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


def check_links(file: h5py.File) -> None:
    """Raise ``ValueError`` for links that lead out of the file, and for too many links."""
    numbers = count(1)

    def is_wrong(_name: bytes, link: Any) -> bool | None:  # None: visit goes on
        return link.type != h5l.TYPE_HARD or next(numbers) > MOST_LINKS or None

    if file.id.links.visit(is_wrong, info=True):
        raise ValueError("it has a link to another place, or too many links")


def check_types(file: h5py.File) -> None:
    """Open all objects and attributes, and raise ``ValueError`` for types that no file has.

    HDF5 may crash on damaged values of variable length, so types come before values.
    """
    names = [b"."]
    file.id.links.visit(names.append)
    for name in names:
        item = h5o.open(file.id, name)
        if isinstance(item, h5g.GroupID):
            if h5o.get_info(item).rc > 1:
                raise ValueError("it has a group with two names")
        elif not isinstance(item, h5d.DatasetID):
            raise ValueError("it has an object that is neither a group nor a dataset")
        else:
            _check_type(item.get_type(), name)
        for index in range(h5a.get_num_attrs(item)):
            _check_type(h5a.open(item, index=index).get_type(), name)


def _check_type(kind: Any, name: bytes) -> None:
    """Raise ``ValueError`` unless a type is of numbers, text of fixed length or references."""
    if not isinstance(kind, TYPES) or (
        isinstance(kind, h5t.TypeStringID) and kind.is_variable_str()
    ):
        where = name.decode("utf-8", "replace")
        raise ValueError(f"{where} has neither numbers nor text of fixed length")


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
    file: h5py.File,
    path: str,
    dtype: Any = np.float64,
    rows: slice = slice(None),
    sparse: bool = False,
) -> NDArray[Any]:
    """A dataset, or some of its rows, as an array of this type; with ``None``, of its own.

    sparse : whether some of its chunks may be missing

    Raises ``ValueError``, before any memory is taken, for a dataset that is stored in another way
    than snooker does it, or whose bytes are not there.
    """
    data = h5d.open(file.id, path.encode())
    settings, stored = data.get_create_plist(), data.get_storage_size()
    filters = [settings.get_filter(k)[0] for k in range(settings.get_nfilters())]
    layout, declared, most = settings.get_layout(), math.prod(data.shape), stored
    expected = []
    known = layout in (h5d.CHUNKED, h5d.COMPACT, h5d.CONTIGUOUS)
    if layout == h5d.CHUNKED:
        expected, most = [h5z.FILTER_SHUFFLE, h5z.FILTER_DEFLATE], INFLATION * stored
        chunk, *rest = settings.get_chunk()
        known = chunk in (data.shape[0], ROWS) and rest == [*data.shape[1:]]
        size = chunk * math.prod(rest)
        declared = size if sparse else max(declared, size)
    if not known or settings.get_external_count() or filters != expected:
        raise ValueError(f"{path} is stored in a way that snooker does not use")
    size = declared * data.get_type().get_size()
    if size > most or stored > file.id.get_filesize():
        raise ValueError(f"{path} needs {size:,} bytes, and {stored:,} are stored")
    kind = data.dtype
    dtype = np.dtype(kind if dtype is None else dtype)
    if kind.kind not in "biufS" or not np.can_cast(kind, dtype, "same_kind"):
        raise ValueError(f"{path} has neither numbers of its type nor text of fixed length")
    if layout == h5d.CHUNKED:
        return _unpacked(data, chunk, rows, dtype, sparse)
    values = np.empty(data.shape, dtype)
    data.read(h5s.ALL, h5s.ALL, values, native(dtype))
    return values[rows] if data.shape else values


def _unpacked(
    data: Any, rows: int, wanted: slice, dtype: np.dtype[Any], sparse: bool
) -> NDArray[Any]:
    """Rows of a dataset in chunks that have the size which they declare.

    HDF5 would unpack all of a chunk, up to ``INFLATION`` times its bytes, before it compares. Both
    ways take the same time.
    """
    kind, rest = data.dtype, data.shape[1:]
    first, last, _ = wanted.indices(data.shape[0])
    values = np.zeros((last - first, *rest), dtype)
    size = kind.itemsize * rows * math.prod(rest)
    # Chunk by chunk: inflate at most one byte too many, undo the shuffle, keep the wanted rows.
    for start in range(first - first % rows, last, rows):
        place = (start, *(0 for _ in rest))
        if data.get_chunk_info_by_coord(place).byte_offset is None:
            if not sparse:
                raise ValueError("a chunk is missing")
            continue
        skipped, content = data.read_direct_chunk(place)
        inflate = zlib.decompressobj()
        content = inflate.decompress(content, size + 1)
        if skipped or len(content) != size or not inflate.eof:
            raise ValueError("a chunk has another size than it declares")
        # The shuffle filter puts the first bytes of all numbers first, then the second ones.
        numbers = np.frombuffer(content, np.uint8).reshape(kind.itemsize, -1).T
        numbers = np.ascontiguousarray(numbers).view(kind).reshape(rows, *rest)
        begin, end = max(start, first), min(start + rows, last)
        values[begin - first : end - first] = numbers[begin - start : end - start]
    return values


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
) -> None:
    """Write a dataset, or add a chunk to it; groups are created if need be.

    unit : in SI, an attribute
    chunk : rows in a chunk, shuffled and deflated, of a dataset that can grow; 0 for neither
    before : rows before these; those that were never written are zero and take no space
    """
    rest = values.shape[1:]
    if chunk and path in file:
        data = file[path].id
    else:
        space = h5s.create_simple(values.shape)
        if chunk:
            space = h5s.create_simple((0, *rest), (h5s.UNLIMITED, *rest))
        settings = _settings((chunk, *rest) if chunk else None, 0 < values.nbytes <= SMALL)
        data = h5d.create(file.id, path.encode(), native(values.dtype), space, *settings)
        if unit is not None:  # H5MD wants a string of fixed length
            text = np.array(unit.encode())
            kind = native(text.dtype)
            h5a.create(data, b"unit", kind, h5s.create(h5s.SCALAR)).write(text, kind)
    if not chunk:
        data.write(h5s.ALL, h5s.ALL, values, native(values.dtype))
        return
    data.set_extent((before + len(values), *rest))
    data.write_direct_chunk((before, *(0 for _ in rest)), packed(values, chunk))


@lru_cache(maxsize=64)
def _settings(chunk: tuple[int, ...] | None, small: bool) -> tuple[Any, Any]:
    """HDF5's settings for a dataset with such chunks, and for the groups above it."""
    settings, links = h5p.create(h5p.DATASET_CREATE), h5p.create(h5p.LINK_CREATE)
    settings.set_obj_track_times(False)
    if chunk:
        settings.set_chunk(chunk)
        settings.set_shuffle()
        settings.set_deflate(1)
    elif small:  # in the header, which has a checksum
        settings.set_layout(h5d.COMPACT)
    links.set_create_intermediate_group(True)
    return settings, links


def link(file: h5py.File, new: str, old: str) -> None:
    """Give an object another name."""
    file.id.links.create_hard(new.encode(), file.id, old.encode())


# Compressed here, because zlib lets other threads run. 1,034 repeats of 37 balls and 500 collisions
# take 0.18 s of processor time to simulate, 0.18 s to write, and 0.35 s with HDF5's own filters.


def packed(values: NDArray[Any], rows: int) -> bytes:
    """The values as HDF5's shuffle and deflate filters would leave a chunk of ``rows`` rows.

    Missing rows are zero. Each byte of the numbers is compressed by itself: most are noise, in
    which zlib would search longer for patterns than in all others.
    """
    padded = np.zeros((rows, *values.shape[1:]), values.dtype)
    padded[: len(values)] = values
    shuffled = np.ascontiguousarray(padded.view(np.uint8).reshape(-1, values.itemsize).T)
    pieces = []
    for row in shuffled:  # in blocks that end on a whole byte and refer to none before them
        level = 0 if _is_noise(row) else 1
        deflate = zlib.compressobj(level, wbits=-zlib.MAX_WBITS, strategy=zlib.Z_RLE)
        pieces += [deflate.compress(row.data), deflate.flush(zlib.Z_FULL_FLUSH)]
    checksum = zlib.adler32(shuffled.data).to_bytes(4, "big")
    return b"".join([ZLIB_HEADER, *pieces, LAST_BLOCK, checksum])


def _is_noise(data: NDArray[np.uint8]) -> bool:
    """Whether few neighbouring bytes are equal and no byte is frequent, judged by a sample."""
    sample = data[:: max(1, len(data) // NOISE_SAMPLE)]
    expected = len(sample) / 256
    alike = np.count_nonzero(data[1:] == data[:-1]) > len(data) / 32
    return not alike and bool(np.bincount(sample).max() < expected + 8 * math.sqrt(expected))
