"""What all files of so many balls have in common: groups, header, particles without values."""

from __future__ import annotations

import threading
from functools import lru_cache

import h5py
import numpy as np

from snooker_cli.scene import Shape
from snooker_cli.store import hdf5
from snooker_cli.store.hdf5 import DOUBLE, INTEGER, create
from snooker_cli.store.records import SCHEMA_VERSION


@lru_cache(maxsize=64)
def skeleton(balls: int, shape: Shape) -> bytes:
    """The bytes of a file for so many balls in such a container.

    It lacks only values, events and attributes.
    """
    name = f"skeleton-{threading.get_ident()}"
    with h5py.File(name, "w", driver="core", backing_store=False, libver=hdf5.FORMAT) as file:
        write_header(file)
        file.create_group("parameters/snooker").attrs["schema_version"] = SCHEMA_VERSION
        for group, number in (("balls", balls), ("container", 1)):
            _write_particles(file.create_group(f"particles/{group}"), number, shape)
        file.flush()
        return bytes(file.id.get_file_image())


def write_header(file: h5py.File) -> None:
    """The ``h5md`` group; its names are fixed-length strings, as the standard wants them."""
    from snooker_cli import __version__

    header = file.create_group("h5md")
    header.attrs["version"] = np.array([1, 1], dtype=np.int32)
    header.create_group("author").attrs["name"] = np.bytes_("snooker user")
    creator = header.create_group("creator")
    creator.attrs["name"] = np.bytes_("snooker")
    creator.attrs["version"] = np.bytes_(__version__)


def _write_particles(group: h5py.Group, number: int, shape: Shape) -> None:
    """Datasets for so many particles at the start and the finish, which share step and time."""
    box = group.create_group("box")
    box.attrs["dimension"] = 2
    box.attrs["boundary"] = np.array([b"periodic" if shape == "periodic" else b"none"] * 2)
    if shape != "circle":
        create(box.id, b"edges", (2,), DOUBLE, b"m")
    position, velocity = group.create_group("position"), group.create_group("velocity")
    create(position.id, b"value", (2, number, 2), DOUBLE, b"m")
    create(position.id, b"step", (2,), INTEGER, None)
    create(position.id, b"time", (2,), DOUBLE, b"s")
    create(velocity.id, b"value", (2, number, 2), DOUBLE, b"m s-1")
    velocity["step"], velocity["time"] = position["step"], position["time"]
    create(group.id, b"mass", (number,), DOUBLE, b"kg")
    create(group.id, b"radius", (number,), DOUBLE, b"m")
