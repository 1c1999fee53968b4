"""Files are valid H5MD 1.1: an independent reader reads them.

``test_file_format`` compares names, types, shapes and units with the documented ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest
from pyh5md import File, element
from scenes import gas

from snooker_cli import store
from snooker_cli.config import parse
from snooker_cli.engine import simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.store import Provenance
from snooker_cli.trace import SERIES_UNITS, Trace


@pytest.fixture(scope="module", params=["events", "summary"])
def opened(
    request: pytest.FixtureRequest,
    traces: dict[str, Trace],
    tmp_path_factory: pytest.TempPathFactory,
    provenance: Provenance,
) -> Iterator[tuple[h5py.File, Trace]]:
    """An open file and the trace that is in it."""
    path = tmp_path_factory.mktemp("opened") / "repeat.h5"
    store.write(path, traces[request.param], provenance)
    with h5py.File(path, "r") as file:
        yield file, traces[request.param]


def items(file: h5py.File, kind: type) -> list[h5py.Group | h5py.Dataset]:
    """Everything of a kind in a file."""
    found: list[h5py.Group | h5py.Dataset] = []
    file.visititems(lambda _, item: found.append(item) if isinstance(item, kind) else None)
    return found


@pytest.mark.parametrize("shape", ["box", "periodic"])
def test_a_box_has_edges_and_boundaries(shape: str, tmp_path: Path, provenance: Provenance) -> None:
    """H5MD wants edges wherever a boundary is periodic."""
    start = gas(shape, 60, 0.3, aspect=1.5)
    store.write(tmp_path / "box.h5", simulate(start, collisions=3), provenance)
    boundary = b"periodic" if shape == "periodic" else b"none"
    with h5py.File(tmp_path / "box.h5", "r") as file:
        for group in file["particles"].values():
            assert group["box"].attrs["boundary"].tolist() == [boundary, boundary]
            assert group["box/edges"][:].tolist() == list(start.container.size)
    assert store.read(tmp_path / "box.h5")[0].finish.container == start.container


def test_elements_have_step_time_and_value_of_one_length(opened: tuple[h5py.File, Trace]) -> None:
    file, trace = opened
    elements = [group for group in items(file, h5py.Group) if "value" in group]
    assert len(elements) == (6 if trace.events is not None else 4 + len(SERIES_UNITS))
    for group in elements:
        assert group["step"].shape == group["time"].shape == group["value"].shape[:1]
        assert np.all(np.diff(group["step"][:]) > 0)
        assert np.all(np.diff(group["time"][:]) >= 0)


def test_collisions_are_connectivity_of_the_balls(opened: tuple[h5py.File, Trace]) -> None:
    file, trace = opened
    if trace.events is None:
        assert "connectivity" not in file
        return
    collisions = file["connectivity/collisions"]
    assert file[collisions.attrs["particles_group"]] == file["particles/balls"]
    assert collisions["step"][:].tolist() == list(range(1, 301))
    assert file["observables/impulse/step"] == collisions["step"]
    assert file["observables/impulse/time"] == collisions["time"]


def test_large_columns_are_compressed_by_what_every_reader_has(
    small_config: str, tmp_path: Path, provenance: Provenance
) -> None:
    elastic = starting_scene(parse(small_config, overrides=["cor=1"]).experiment, 0)
    store.write(tmp_path / "large.h5", simulate(elastic, collisions=5000), provenance)
    with h5py.File(tmp_path / "large.h5", "r") as file:
        impulse, mass = file["observables/impulse/value"], file["particles/balls/mass"]
        assert (impulse.compression, impulse.shuffle) == ("gzip", True)
        assert mass.compression is None


def test_an_independent_reader_reads_it(opened: tuple[h5py.File, Trace]) -> None:
    ours, trace = opened
    with File(ours.filename, "r") as file:
        balls = file.particles_group("balls")
        for name, values in (("position", "positions"), ("velocity", "velocities")):
            found = element(balls, name)
            assert found.element_type == "TimeElement"
            assert found.time[:].tolist() == [0.0, trace.stop.time]
            assert found.step[:].tolist() == [0, trace.collisions]
            for k, scene in enumerate((trace.start, trace.finish)):
                assert np.array_equal(found.get_by_idx(k), getattr(scene, values))
        assert np.array_equal(element(balls, "mass").value[:], trace.start.masses)
        wall = element(file.particles_group("container"), "position")
        assert np.array_equal(wall.get_by_idx(1), [trace.finish.container_position])
        if trace.events is not None:
            collisions = element(file["connectivity"], "collisions")
            assert np.array_equal(collisions.time[:], trace.events.time)
            assert np.array_equal(collisions.value[:, 0, 0], trace.events.i)
            assert np.array_equal(collisions.value[:, 0, 1], trace.events.j)
            impulse = element(file["observables"], "impulse")
            assert np.array_equal(impulse.value[:], trace.events.impulse)
        else:
            assert trace.summary is not None
            energy = element(file["observables/summary"], "kinetic_energy")
            assert np.array_equal(energy.time[:], trace.summary.series.time)
            assert np.array_equal(energy.value[:], trace.summary.series.kinetic_energy)
