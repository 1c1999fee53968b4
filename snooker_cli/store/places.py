"""Where a repeat is: in a file of its own, or in a packed run, by a path that leads through it.

``runs/decay/point-0000/repeat-0003.h5`` is a file. If ``runs/decay.h5`` is one, of a packed run,
``runs/decay.h5/point-0000/repeat-0003.h5`` is the group ``point-0000/repeat-0003`` in it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from h5py import h5g

from snooker_cli.store import hdf5

BYTES, MODIFIED = b"bytes", b"modified"
"""The attributes of a packed repeat: what its file had been."""


@dataclass(frozen=True)
class About:
    """A repeat's file as the system knows it, or knew it before it was packed.

    bytes : its size
    modified : when it was put in its place, ns since 1970; both are 0 if that cannot be read
    """

    bytes: int
    modified: int


def about(path: Path) -> About | None:
    """What is known of a repeat's file without trusting it; ``None`` if there is none."""
    try:
        if _packed_run(path) is None:
            status = path.stat()
            return About(status.st_size, status.st_mtime_ns)
        with place(path) as root:
            return About(hdf5.read_number(root, BYTES), hdf5.read_number(root, MODIFIED))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except hdf5.UNREADABLE:
        return About(0, 0)


def is_packed(path: Path) -> bool:
    """Whether a path leads to a repeat in a packed run."""
    return _packed_run(path) is not None


@contextmanager
def place(path: Path) -> Iterator[Any]:
    """The open group that holds a repeat; raises what HDF5 does, and ``FileNotFoundError``."""
    packed = _packed_run(path)
    file = hdf5.to_read(packed or path)
    try:
        root = h5g.open(file, b"/")
        if packed is None:
            yield root
        elif (name := group_name(path).encode()) in root:
            yield h5g.open(root, name)
        else:
            raise FileNotFoundError(path)
    finally:
        file.close()


def group_name(path: Path) -> str:
    """The group in which a packed run has a repeat, by the last two parts of its file's path."""
    return f"{path.parent.name}/{path.stem}"


def _packed_run(path: Path) -> Path | None:
    """The packed run that a path leads through."""
    outer = path.parent.parent
    return outer if outer.is_file() else None
