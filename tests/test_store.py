"""The store: what is written comes back bit for bit, as valid H5MD, or not at all."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import fields, replace
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pyh5md import File, element

from snooker_cli import store
from snooker_cli.arrange import arrange
from snooker_cli.config import parse
from snooker_cli.engine import simulate
from snooker_cli.scene import Scene
from snooker_cli.store import Provenance, StoreError
from snooker_cli.trace import (
    SERIES_UNITS,
    SPEED_BINS,
    Events,
    Series,
    Stop,
    StopReason,
    Summary,
    Trace,
)

PROVENANCE = Provenance(
    config='{"title": "Stöße", "container": {"mass": null}}',
    digest="0" * 64,
    parameters='{"cor": 0.9}',
    point=3,
    repeat=7,
    engine_version=1,
    versions='{"python": "3.11.9"}',
    machine="x86_64",
    command="snooker run µ.yaml -o cor=0.9",
    started="2024-02-29T12:00:00.000+00:00",
    seconds=0.1 + 0.2,
)

CONFIG = """\
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 2, radius: 1.0, speed: 10.0}
cor: 0.9
collisions: 300
"""


def same_bits(one: Any, other: Any) -> bool:
    """Whether two dataclasses hold the same types and bits, all the way down."""
    if type(one) is not type(other):
        return False
    if isinstance(one, Trace | Scene | Events | Series | Summary | Stop):
        return all(
            same_bits(getattr(one, field.name), getattr(other, field.name)) for field in fields(one)
        )
    if isinstance(one, np.ndarray):
        return (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
    return repr(one) == repr(other)


@pytest.fixture(scope="module")
def traces() -> dict[str, Trace]:
    """The same scene recorded both ways."""
    scene = arrange(parse(CONFIG).experiment, 0)
    return {
        "events": simulate(scene, collisions=300),
        "summary": simulate(scene, collisions=300, summary=True),
    }


@pytest.fixture(scope="module")
def image(traces: dict[str, Trace], tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The bytes of a file with events."""
    path = tmp_path_factory.mktemp("image") / "whole.h5"
    store.write(path, traces["events"], PROVENANCE)
    return path.read_bytes()


doubles = st.floats(width=64)
"""Any double: infinities, nan, -0.0 and subnormal ones too."""

finite = st.floats(allow_nan=False, allow_infinity=False)


def columns(length: int) -> st.SearchStrategy[Any]:
    return arrays(np.float64, length, elements=doubles)


@st.composite
def scenes(draw: st.DrawFn, number: int) -> Scene:
    return Scene(
        positions=draw(arrays(np.float64, (number, 2), elements=doubles)),
        velocities=draw(arrays(np.float64, (number, 2), elements=doubles)),
        radii=draw(columns(number)),
        masses=draw(columns(number)),
        container_radius=draw(finite),
        container_mass=draw(st.floats(allow_nan=False)),
        container_position=draw(columns(2)),
        container_velocity=draw(columns(2)),
        restitution=draw(finite),
        wall_restitution=draw(finite),
    )


@st.composite
def any_traces(draw: st.DrawFn) -> Trace:
    start = draw(scenes(draw(st.integers(1, 4))))
    moved = draw(scenes(start.number))
    unchanging = ("radii", "masses", "container_radius", "container_mass")
    finish = replace(
        moved,
        restitution=start.restitution,
        wall_restitution=start.wall_restitution,
        **{name: getattr(start, name) for name in unchanging},
    )
    # From 4096 numbers on, columns are compressed.
    length = draw(st.sampled_from([0, 1, 5, 4095, 4096, 5000]))
    events = summary = None
    if draw(st.booleans()):
        balls = np.random.default_rng(draw(st.integers(0, 2**32))).integers(
            -1, 2**31, (2, length), dtype=np.int32
        )
        events = Events(draw(columns(length)), balls[0], balls[1], draw(columns(length)))
    else:
        length = min(length, 600)
        counts = arrays(np.int64, (length, SPEED_BINS), elements=st.integers(-(2**63), 2**63 - 1))
        summary = Summary(Series(*(draw(columns(length)) for _ in SERIES_UNITS)), draw(counts))
    stop = Stop(
        draw(st.sampled_from(StopReason)),
        draw(finite),
        tuple(draw(st.lists(st.integers(0, 2**31), max_size=2))),
        draw(st.text(max_size=40)),
    )
    count = st.integers(0, 2**62)
    return Trace(start, finish, stop, draw(count), draw(count), events, summary)


@settings(max_examples=60, deadline=None)
@given(trace=any_traces())
def test_any_trace_comes_back_bit_for_bit(
    trace: Trace, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.h5"
    store.write(path, trace, PROVENANCE)
    stored = store.read(path)
    assert same_bits(stored.trace, trace)
    assert stored.provenance == PROVENANCE


@pytest.mark.parametrize("kind", ["events", "summary"])
def test_a_simulated_trace_comes_back_bit_for_bit(
    kind: str, traces: dict[str, Trace], tmp_path: Path
) -> None:
    path = tmp_path / "a" / "b" / "new.h5"
    store.write(path, traces[kind], PROVENANCE)
    assert same_bits(store.read(path).trace, traces[kind])
    assert store.read_provenance(path) == (PROVENANCE, traces[kind].stop)
    assert [entry.name for entry in path.parent.iterdir()] == ["new.h5"]


def test_the_same_trace_gives_the_same_file(
    traces: dict[str, Trace], image: bytes, tmp_path: Path
) -> None:
    store.write(tmp_path / "again.h5", traces["events"], PROVENANCE)
    assert (tmp_path / "again.h5").read_bytes() == image


def test_a_config_of_many_balls_fits(traces: dict[str, Trace], tmp_path: Path) -> None:
    """HDF5 keeps attributes of more than 64 KiB elsewhere than small ones."""
    long = replace(PROVENANCE, config=json.dumps({"list": [0.1] * 100_000}))
    store.write(tmp_path / "long.h5", traces["events"], long)
    assert store.read(tmp_path / "long.h5").provenance == long


def test_writing_replaces_what_was_there(traces: dict[str, Trace], tmp_path: Path) -> None:
    path = tmp_path / "one.h5"
    path.write_text("something else")
    path.with_name("one.h5.part").write_text("left behind by a kill")
    store.write(path, traces["events"], PROVENANCE)
    store.write(path, traces["summary"], PROVENANCE)
    assert same_bits(store.read(path).trace, traces["summary"])
    assert [entry.name for entry in tmp_path.iterdir()] == ["one.h5"]


def test_content_hash_sees_every_array_and_the_ending(traces: dict[str, Trace]) -> None:
    trace = traces["events"]
    events, stop = trace.events, trace.stop
    assert events is not None
    others = [
        replace(trace, stop=replace(stop, reason=StopReason.COLLAPSE)),
        replace(trace, stop=replace(stop, time=np.nextafter(stop.time, 0.0))),
        replace(trace, wall_events=trace.wall_events + 1),
        replace(trace, pair_events=trace.pair_events + 1),
    ]
    for name in ("time", "i", "j", "impulse"):
        column = getattr(events, name).copy()
        column.view(np.uint8)[-1] ^= 1
        others.append(replace(trace, events=replace(events, **{name: column})))
    for end in ("start", "finish"):
        scene = getattr(trace, end)
        for field in fields(Scene):
            values = np.array(getattr(scene, field.name), dtype=np.float64)
            values.reshape(-1).view(np.uint8)[-8] ^= 1
            value = values if values.ndim else float(values)
            others.append(replace(trace, **{end: replace(scene, **{field.name: value})}))
    hashes = {store.content_hash(other) for other in (trace, *others)}
    assert len(hashes) == 1 + len(others)


# H5MD 1.1


@pytest.fixture(scope="module", params=["events", "summary"])
def opened(
    request: pytest.FixtureRequest,
    traces: dict[str, Trace],
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[tuple[h5py.File, Trace]]:
    """An open file and the trace that is in it."""
    path = tmp_path_factory.mktemp("opened") / "repeat.h5"
    store.write(path, traces[request.param], PROVENANCE)
    with h5py.File(path, "r") as file:
        yield file, traces[request.param]


def fixed_length(attributes: h5py.AttributeManager, name: str) -> bool:
    kind = h5py.check_string_dtype(attributes.get_id(name).dtype)
    return kind is not None and kind.length is not None


def groups_with(name: str, file: h5py.File) -> list[h5py.Group]:
    found: list[h5py.Group] = []
    file.visititems(
        lambda _, item: found.append(item) if isinstance(item, h5py.Group) and name in item else None
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


def test_collisions_are_connectivity_of_the_balls(traces: dict[str, Trace], image: bytes) -> None:
    with h5py.File(BytesIO(image), "r") as file:
        collisions = file["connectivity/collisions"]
        assert collisions["value"].shape == (300, 1, 2)
        assert file[collisions.attrs["particles_group"]] == file["particles/balls"]
        assert collisions["step"][:].tolist() == list(range(1, 301))
        assert file["observables/impulse/step"] == collisions["step"]
        assert file["observables/impulse/time"] == collisions["time"]
    assert traces["events"].collisions == 300


def test_units_are_written_as_the_units_module_wants_them(
    opened: tuple[h5py.File, Trace],
) -> None:
    """A sequence of factors apart by spaces: a number, or a symbol and a power."""
    file, trace = opened
    datasets: list[h5py.Dataset] = []
    file.visititems(
        lambda name, item: datasets.append(item)
        if isinstance(item, h5py.Dataset) and not name.endswith("step")
        else None
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


def test_large_columns_are_compressed_by_what_every_reader_has(tmp_path: Path) -> None:
    elastic = arrange(parse(CONFIG, overrides=["cor=1"]).experiment, 0)
    store.write(tmp_path / "large.h5", simulate(elastic, collisions=5000), PROVENANCE)
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


# What cannot be trusted


def refused(path: Path) -> str:
    """The sentence with which a file is refused."""
    with pytest.raises(StoreError) as caught:
        store.read(path)
    sentence = str(caught.value)
    assert sentence.startswith(f"{path}: ")
    assert sentence.isprintable(), sentence
    return sentence


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    assert "there is no such result" in refused(tmp_path / "absent.h5")
    with pytest.raises(StoreError, match=r"absent\.h5"):
        store.read_provenance(tmp_path / "absent.h5")


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9, 0.999])
def test_a_truncated_file_is_refused(part: float, image: bytes, tmp_path: Path) -> None:
    path = tmp_path / "short.h5"
    path.write_bytes(image[: int(part * len(image))])
    assert "not a readable result" in refused(path)
    with pytest.raises(StoreError, match=r"short\.h5"):
        store.read_provenance(path)


@pytest.mark.parametrize("content", [b"", b"cor: 0.8\n", b"\x89HDF\r\n\x1a\n"])
def test_a_file_that_is_not_hdf5_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "other.h5"
    path.write_bytes(content)
    assert "not a readable result" in refused(path)


def test_a_foreign_hdf5_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "foreign.h5"
    with h5py.File(path, "w") as file:
        file["temperature"] = np.arange(3.0)
    assert "not a readable result" in refused(path)


def test_another_programs_h5md_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "foreign.h5"
    with File(path, "w", creator="somebody else") as file:
        element(file.particles_group("all"), "position", store="time", shape=(3, 2), dtype=float)
    assert "not a readable result" in refused(path)


def test_a_directory_is_refused(tmp_path: Path) -> None:
    refused(tmp_path)


def test_a_path_through_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("x")
    refused(tmp_path / "plain" / "repeat.h5")


def test_a_flipped_bit_in_any_array_is_refused(image: bytes, tmp_path: Path) -> None:
    path = tmp_path / "flipped.h5"
    path.write_bytes(image)
    places: list[int] = []
    with h5py.File(path, "r") as file:

        def note(name: str, item: object) -> None:
            # Steps, and the times of the two states, are there for other readers only.
            unread = name.endswith("step") or name.startswith("particles") and name.endswith("time")
            if isinstance(item, h5py.Dataset) and not unread:
                places.append(item.id.get_offset() + item.id.get_storage_size() // 2)

        file.visititems(note)
    assert len(places) == 11
    for place in places:
        damaged = bytearray(image)
        damaged[place] ^= 1
        path.write_bytes(damaged)
        refused(path)


DAMAGE = """
import random, sys
from pathlib import Path
from snooker_cli import store

image, path = Path(sys.argv[1]).read_bytes(), Path(sys.argv[2])
places = [random.Random(1).randrange(len(image)) for _ in range(200)]
# What HDF5 itself reads: headers of the file, of groups and of attributes.
places += range(0, 300, 3)
for name in (b"SNOD", b"HEAP", b"TREE", b"content", b"provenance", b"ending"):
    start = image.find(name)
    if start >= 0:
        places += range(max(0, start - 40), start + 40)
whole = store.read(Path(sys.argv[1]))

def told(stored):
    return store.content_hash(stored.trace), stored.trace.stop, stored.provenance

for place in places:
    damaged = bytearray(image)
    damaged[place] ^= 255
    path.write_bytes(damaged)
    print("byte", place, file=sys.stderr, flush=True)
    try:
        found = store.read(path)
    except store.StoreError:
        continue
    except Exception as error:
        print(f"byte {place}: {type(error).__name__}: {error}")
        continue
    if told(found) != told(whole):
        print(f"byte {place}: taken for good with another content")
"""


def test_no_flipped_byte_is_taken_for_another_result(image: bytes, tmp_path: Path) -> None:
    """A damaged file is refused, or the damage is where nothing is read from.

    In a process of its own: HDF5's C code must not fall over it either.
    """
    (tmp_path / "whole.h5").write_bytes(image)
    done = subprocess.run(
        [sys.executable, "-c", DAMAGE, tmp_path / "whole.h5", tmp_path / "damaged.h5"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"ended after {done.stderr[-100:]}"
    assert done.stdout == ""


# What cannot be written


def test_a_folder_that_cannot_be_made_is_said(traces: dict[str, Trace], tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("x")
    for path in (tmp_path / "plain" / "one.h5", tmp_path / "plain" / "in" / "one.h5"):
        with pytest.raises(StoreError) as caught:
            store.write(path, traces["events"], PROVENANCE)
        assert str(caught.value).startswith(f"{path}: cannot write the result (")
        assert "--out" in str(caught.value)


def test_a_place_that_is_taken_by_a_folder_is_said(
    traces: dict[str, Trace], tmp_path: Path
) -> None:
    path = tmp_path / "one.h5"
    path.mkdir()
    with pytest.raises(StoreError, match=r"one\.h5: cannot write the result"):
        store.write(path, traces["events"], PROVENANCE)
    assert [entry.name for entry in tmp_path.iterdir()] == ["one.h5"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_is_said(traces: dict[str, Trace], tmp_path: Path) -> None:
    (tmp_path / "one.h5.part").symlink_to("/dev/full")
    with pytest.raises(StoreError, match=r"one\.h5: cannot write the result \(No space left"):
        store.write(tmp_path / "one.h5", traces["events"], PROVENANCE)
    assert list(tmp_path.iterdir()) == []
