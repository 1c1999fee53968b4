"""States as a text dump of LAMMPS, which OVITO, VMD and MDAnalysis read."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from snooker_cli.extending import Format, RepeatHeader, Scene, States

HEAD = """\
ITEM: TIMESTEP
{step}
ITEM: TIME
{time!r}
ITEM: NUMBER OF ATOMS
{number}
ITEM: BOX BOUNDS {bounds}
{low[0]!r} {high[0]!r}
{low[1]!r} {high[1]!r}
{low[2]!r} {high[2]!r}
ITEM: ATOMS id type x y z vx vy vz radius mass
"""


def write(
    part: Path,
    start: Scene,
    _header: RepeatHeader,
    _times: np.ndarray,
    batches: Iterable[States],
) -> None:
    """Write a frame for each state; types number the sizes and masses of the balls."""
    sizes = np.column_stack([start.radii, start.masses])
    types = np.unique(sizes, axis=0, return_inverse=True)[1].ravel() + 1
    half = np.array([*start.container.size, 2 * np.max(start.radii)]) / 2
    repeats = (*start.container.periodic, False)
    bounds = " ".join("pp" if periodic else "ff" for periodic in repeats)
    with part.open("x", encoding="ascii") as file:
        step = 0
        for batch in batches:
            for k, time in enumerate(batch.time.tolist()):
                centre = np.append(batch.container_position[k], 0.0)
                box = {"low": (centre - half).tolist(), "high": (centre + half).tolist()}
                frame = {"step": step, "time": time, "number": start.number, "bounds": bounds}
                file.write(HEAD.format(**frame, **box))
                moving = np.hstack([batch.positions[k], batch.velocities[k], sizes]).tolist()
                rows = zip(types, moving, strict=True)
                for ball, (kind, (x, y, u, v, radius, mass)) in enumerate(rows, 1):
                    row = f"{x!r} {y!r} 0 {u!r} {v!r} 0 {radius!r} {mass!r}"
                    file.write(f"{ball} {kind} {row}\n")
                step += 1


DUMP = Format(ending=".lammpstrj", title="dump of LAMMPS", write_states=write)
