"""The files of the store are valid H5MD 1.1, and a reader that is not ours reads them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from pyh5md import File, element

from snooker_cli import store
from snooker_cli.config import parse
from snooker_cli.containers import Box, PeriodicBox
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


def fixed_length(attributes: h5py.AttributeManager, name: str) -> bool:
    kind = h5py.check_string_dtype(attributes.get_id(name).dtype)
    return kind is not None and kind.length is not None


def groups_with(name: str, file: h5py.File) -> list[h5py.Group]:
    found: list[h5py.Group] = []
    file.visititems(
        lambda _, item: (
            found.append(item) if isinstance(item, h5py.Group) and name in item else None
        )
    )
    return found


def test_header(opened: tuple[h5py.File, Trace]) -> None:
    header = opened[0]["h5md"]
    assert header.attrs["version"].tolist() == [1, 1]
    assert header.attrs["version"].dtype.kind == "i"
    for group, name in (("author", "name"), ("creator", "name"), ("creator", "version")):
        assert fixed_length(header[group].attrs, name)
        assert header[group].attrs[name]
    assert header["creator"].attrs["name"] == b"snooker"


def test_particles_have_a_box_that_nothing_leaves(opened: tuple[h5py.File, Trace]) -> None:
    file, _ = opened
    assert set(file["particles"]) == {"balls", "container"}
    for group in file["particles"].values():
        box = group["box"].attrs
        assert box["dimension"] == 2
        assert box["boundary"].tolist() == [b"none", b"none"]
        assert fixed_length(box, "boundary")
        number = len(group["mass"])
        for name in ("position", "velocity"):
            assert group[name]["value"].shape == (2, number, 2)


@pytest.mark.parametrize(("shape", "boundary"), [(Box, b"none"), (PeriodicBox, b"periodic")])
def test_a_box_has_its_edges(
    shape: Any, boundary: bytes, traces: dict[str, Trace], tmp_path: Path, provenance: Provenance
) -> None:
    """H5MD wants edges wherever a boundary is periodic; no other length tells the box's size."""
    trace = traces["events"]
    start, finish = (
        replace(scene, container=shape(30.0, 20.0)) for scene in (trace.start, trace.finish)
    )
    store.write(tmp_path / "box.h5", replace(trace, start=start, finish=finish), provenance)
    with h5py.File(tmp_path / "box.h5", "r") as file:
        for group in file["particles"].values():
            assert group["box"].attrs["boundary"].tolist() == [boundary, boundary]
            assert group["box/edges"][:].tolist() == [30.0, 20.0]
            assert group["box/edges"].attrs["unit"] == b"m"
    found = store.read(tmp_path / "box.h5")[0].finish
    assert found.container == shape(30.0, 20.0)


def test_elements_have_step_time_and_value_of_one_length(opened: tuple[h5py.File, Trace]) -> None:
    file, trace = opened
    elements = groups_with("value", file)
    assert len(elements) == (6 if trace.events is not None else 4 + len(SERIES_UNITS))
    for group in elements:
        assert set(group) == {"step", "time", "value"}
        assert group["step"].dtype.kind == "i"
        assert group["time"].dtype == np.float64
        assert group["step"].shape == group["time"].shape == group["value"].shape[:1]
        assert np.all(np.diff(group["step"][:]) > 0)
        assert np.all(np.diff(group["time"][:]) >= 0)


def test_collisions_are_connectivity_of_the_balls(opened: tuple[h5py.File, Trace]) -> None:
    file, trace = opened
    if trace.events is None:
        assert "connectivity" not in file
        return
    collisions = file["connectivity/collisions"]
    assert collisions["value"].shape == (300, 1, 2)
    assert file[collisions.attrs["particles_group"]] == file["particles/balls"]
    assert collisions["step"][:].tolist() == list(range(1, 301))
    assert file["observables/impulse/step"] == collisions["step"]
    assert file["observables/impulse/time"] == collisions["time"]


def test_the_time_of_day_is_in_no_dataset(opened: tuple[h5py.File, Trace]) -> None:
    """So that the same trace gives the same bytes tomorrow."""
    tracked: list[bool] = []
    opened[0].visititems(
        lambda _, item: (
            tracked.append(item.id.get_create_plist().get_obj_track_times())
            if isinstance(item, h5py.Dataset)
            else None
        )
    )
    assert len(tracked) > 10
    assert not any(tracked)


def test_units_are_written_as_the_units_module_wants_them(
    opened: tuple[h5py.File, Trace],
) -> None:
    """A sequence of factors apart by spaces: a number, or a symbol and a power."""
    file, trace = opened
    datasets: list[h5py.Dataset] = []
    file.visititems(
        lambda name, item: (
            datasets.append(item)
            if isinstance(item, h5py.Dataset) and not name.endswith("step")
            else None
        )
    )
    assert datasets
    for data in datasets:
        assert fixed_length(data.attrs, "unit")
        unit = data.attrs["unit"].decode()
        assert re.fullmatch(r"1|[A-Za-z]+(-?[1-9])?( [A-Za-z]+(-?[1-9])?)*", unit), data.name
    balls = file["particles/balls"]
    assert balls["position/value"].attrs["unit"] == b"m"
    assert balls["velocity/value"].attrs["unit"] == b"m s-1"
    assert balls["position/time"].attrs["unit"] == b"s"
    assert balls["mass"].attrs["unit"] == b"kg"
    if trace.events is not None:
        assert file["observables/impulse/value"].attrs["unit"] == b"kg m s-1"
    else:
        for name, unit in SERIES_UNITS.items():
            if name != "time":
                data = file[f"observables/summary/{name}/value"]
                assert data.attrs["unit"] == unit.encode()


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
        mass = element(balls, "mass")
        assert mass.element_type == "FixedElement"
        assert np.array_equal(mass.value[:], trace.start.masses)
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
