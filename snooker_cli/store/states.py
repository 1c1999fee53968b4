"""States of a repeat at chosen times -> an H5MD file in three dimensions, for other programs.

What reads trajectories of molecules wants three dimensions, z being 0 here, a group of particles
named ``trajectory``, and a box with edges for each frame. The unit m of positions and edges is an
attribute of the element and not of its ``value``: MDAnalysis refuses lengths in m there, and knows
units only as strings of any length.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any, Protocol

import h5py
import numpy as np
from numpy.typing import NDArray

from snooker_cli.scene import Scene
from snooker_cli.store import hdf5
from snooker_cli.store.parts import whole
from snooker_cli.store.records import AbsentError, Provenance
from snooker_cli.store.skeleton import write_header

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
