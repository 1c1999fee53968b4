"""A run's folder <-> one HDF5 file: every repeat's file as a group, all other files as bytes."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from snooker_cli.store import hdf5
from snooker_cli.store.parts import PACKING, packing_beside, whole
from snooker_cli.store.places import BYTES, MODIFIED, about, group_name, place
from snooker_cli.store.reading import check
from snooker_cli.store.records import AbsentError, StoreError

if TYPE_CHECKING:
    from collections.abc import Iterator

PACKED_VERSION = 1
"""Goes up when the layout of packed runs changes."""

VERSION, FILES = "packed_version", "files"
"""The root's attribute that marks a packed run, and its group of what are no repeats."""


def pack(out: Path, repeats: Sequence[Path], files: Mapping[str, Path]) -> None:
    """Write a packed run, whole or not at all.

    repeats : whole files by paths that end in ``point-0000/repeat-0000.h5``
    files : others by their names in the run's folder

    Every copy's content is checked before the packed run has its name. Raises ``StoreError``.
    """
    with _written(out):
        out.parent.mkdir(parents=True, exist_ok=True)
        with packing_beside(out), whole(out, PACKING) as part:
            with h5py.File(part, "x", libver=hdf5.FORMAT, locking=False) as packed:
                packed.attrs[VERSION] = PACKED_VERSION
                packed.create_group(FILES)
                for name, path in files.items():
                    packed[f"{FILES}/{name}"] = np.frombuffer(path.read_bytes(), np.uint8)
                for path in repeats:
                    _copy_in(packed, path)
            for path in repeats:
                check(part / path.parent.name / path.name)
            _to_disk(part)


def unpack(packed: Path, directory: Path) -> None:
    """Write what a packed run holds as files in a folder that is there.

    Every repeat's content is checked before and after. Raises ``StoreError``.
    """
    with _open(packed) as file:
        for name in packed_files(packed):
            path = directory / name
            with _written(path):
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(file[f"{FILES}/{name}"][()].tobytes())
        for relative in packed_repeats(packed):
            path = directory / relative
            check(packed / relative)
            with _written(path):
                path.parent.mkdir(exist_ok=True)
                _copy_out(file[group_name(path)], path)
                _to_disk(path)
            check(path)
            known = about(packed / relative)
            if known is not None:
                os.utime(path, ns=(known.modified, known.modified))


def is_packed_run(path: Path) -> bool:
    """Whether a file is a packed run, of whatever version."""
    with suppress(*hdf5.UNREADABLE), place(path) as root:
        return VERSION in h5py.Group(root).attrs
    return False


def packed_files(packed: Path) -> list[str]:
    """The names of what are no repeats in a packed run. Raises ``StoreError``."""
    found: list[str] = []
    with _open(packed) as file:
        file[FILES].visititems(
            lambda name, item: found.append(name) if isinstance(item, h5py.Dataset) else None
        )
    return found


def packed_file(packed: Path, name: str) -> bytes:
    """One of them. Raises ``StoreError``, or ``FileNotFoundError`` if there is none."""
    with _open(packed) as file:
        if name not in file[FILES]:
            raise FileNotFoundError(packed / name)
        return bytes(file[f"{FILES}/{name}"][()].tobytes())


def packed_repeats(packed: Path) -> list[Path]:
    """The files of the repeats, relative to the run's folder. Raises ``StoreError``."""
    with _open(packed) as file:
        return [
            Path(point) / f"{repeat}.h5"
            for point in sorted(file)
            if point != FILES
            for repeat in sorted(file[point])
        ]


def _copy_in(packed: h5py.File, path: Path) -> None:
    """Add a repeat's file as a group. Chunks are copied as they are, links stay links."""
    name, known = group_name(path), about(path)
    packed.require_group(path.parent.name)
    with h5py.File(path, "r", locking=False) as file:
        file.copy(file["/"], packed, name, expand_refs=True)
    if known is not None:
        packed[name].attrs[BYTES.decode()] = known.bytes
        packed[name].attrs[MODIFIED.decode()] = known.modified


def _copy_out(group: h5py.Group, path: Path) -> None:
    """Make a repeat's file of its group.

    The group is copied at once, as links between its parts would not stay links otherwise.
    """
    with whole(path) as part, h5py.File(part, "x", libver=hdf5.FORMAT, locking=False) as file:
        file.copy(group, file, "repeat", expand_refs=True)
        for name in list(file["repeat"]):
            file.move(f"repeat/{name}", name)
        del file["repeat"]


@contextmanager
def _open(packed: Path) -> Iterator[h5py.Group]:
    """A packed run's root. Raises ``StoreError`` for what is none, or of another version."""
    try:
        with place(packed) as root:
            file = h5py.Group(root)
            version = file.attrs[VERSION]
            if version != PACKED_VERSION:
                raise StoreError(
                    f"{packed}: is packed in version {version}, where this snooker reads version "
                    f"{PACKED_VERSION}; unpack it with the snooker that has packed it"
                )
            yield file
    except FileNotFoundError:
        raise
    except hdf5.UNREADABLE as error:
        raise StoreError(
            f"{packed}: not a readable packed run ({hdf5.said(error)}); take another copy of it"
        ) from None


@contextmanager
def _written(path: Path) -> Iterator[None]:
    """Turn what the system or HDF5 refuses to write into an ``AbsentError``."""
    try:
        yield
    except hdf5.UNWRITABLE as error:
        raise AbsentError(
            f"{path}: cannot be written ({hdf5.said(error)}); make room or give --out for "
            "another place"
        ) from None


def _to_disk(path: Path) -> None:
    """Have the system write a file out, so that it is whole before it has its name."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())
