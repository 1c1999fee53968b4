"""The store: what is written comes back bit for bit, as valid H5MD, or not at all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pyh5md import File, element
from repeating import content_hash

from snooker_cli import store
from snooker_cli.containers import (
    LEAST_AMOUNT,
    LEAST_TIME,
    MOST_AMOUNT,
    Box,
    Circle,
    PeriodicBox,
)
from snooker_cli.errors import AbsentError, StoreError
from snooker_cli.laws import Constant
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.store import Provenance, hdf5
from snooker_cli.trace import (
    SPEED_BINS,
    Events,
    Series,
    Stop,
    StopReason,
    Summary,
    Trace,
    joined,
)


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
def image(
    traces: dict[str, Trace], tmp_path_factory: pytest.TempPathFactory, provenance: Provenance
) -> bytes:
    """The bytes of a file with events."""
    path = tmp_path_factory.mktemp("image") / "whole.h5"
    store.write(path, [(7, traces["events"])], provenance)
    return path.read_bytes()


doubles = st.floats(allow_nan=False, allow_infinity=False)
"""Any finite double: -0.0 and subnormal ones too."""

positive = st.floats(0, exclude_min=True, allow_infinity=False)
amounts = st.floats(LEAST_AMOUNT, MOST_AMOUNT)
lengths = st.floats(100 * LEAST_AMOUNT, MOST_AMOUNT)
speeds = st.just(0.0) | st.floats(1e-90, 1e90) | st.floats(-1e90, -1e-90)
times = st.just(0.0) | st.floats(LEAST_TIME, allow_infinity=False)
shares = st.floats(0, 1)
fixed = st.just(np.inf)


def columns(length: int, elements: st.SearchStrategy[float] = doubles) -> st.SearchStrategy[Any]:
    return arrays(np.float64, length, elements=elements)


containers = st.one_of(
    st.builds(Circle, lengths),
    st.builds(Box, lengths, lengths),
    st.builds(PeriodicBox, lengths, lengths),
)


@st.composite
def scenes(draw: st.DrawFn, number: int) -> Scene:
    container = draw(containers)
    slides = isinstance(container, Circle) and draw(st.booleans())
    return Scene(
        positions=draw(arrays(np.float64, (number, 2), elements=shares)) * min(container.size),
        velocities=draw(arrays(np.float64, (number, 2), elements=speeds)),
        radii=draw(columns(number, st.floats(0.01, 0.09))) * min(container.size),
        masses=draw(columns(number, amounts)),
        container=container,
        container_mass=draw(fixed if slides else positive | fixed),
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        pair_law=Constant(draw(shares)),
        wall_law=Constant(draw(shares)),
        contact_duration=draw(shares),
        elastic_below=draw(positive | st.just(0.0)),
        slides=slides,
    )


@st.composite
def batches(draw: st.DrawFn) -> list[tuple[int, Trace]]:
    """Traces of the same balls and container, by the numbers of their repeats."""
    scene, summaries = draw(scenes(draw(st.integers(1, 4)))), draw(st.booleans())
    numbers = draw(st.lists(st.integers(0, 10**6), min_size=1, max_size=3, unique=True))
    return [(number, draw(any_traces(scene, summaries))) for number in sorted(numbers)]


def impulses_up_to(start: Scene, length: int) -> np.ndarray[Any, Any]:
    """Ascending impulses, of which the last one takes the energy at the start."""
    return np.linspace(0, np.sqrt(2 * start.kinetic_energy * start.masses.max()), length)


@st.composite
def any_traces(draw: st.DrawFn, scene: Scene, summaries: bool) -> Trace:
    places, motion = (
        arrays(np.float64, (scene.number, 2), elements=each) for each in (shares, speeds)
    )
    start, finish = (
        replace(scene, positions=draw(places) * min(scene.container.size)) for _ in range(2)
    )
    start = replace(start, velocities=draw(motion))
    finish = replace(finish, velocities=-start.velocities)  # the energy does not grow
    # From 4096 numbers on, columns are compressed.
    length = draw(st.sampled_from([0, 1, 5, 4095, 4096, 5000]))
    events = summary = None
    counted = (draw(st.integers(1, 2**62)), draw(st.integers(1, 2**62)))
    if not summaries:
        random = np.random.default_rng(draw(st.integers(0, 2**32)))
        i = random.integers(0, scene.number, length, dtype=np.int32)
        j = random.integers(-2 if scene.slides else -1, scene.number, length, dtype=np.int32)
        j[i == j] = -1
        time = np.sort(draw(columns(length, times)))
        events = Events(time, i, j, draw(shares) * impulses_up_to(start, length))
        residual = draw(columns(length, st.floats(-1, 1))) * EPSILON * time
        if draw(st.booleans()) and residual.any():
            events = replace(events, residual=residual)
    else:
        length = min(max(length, 1), 600)
        time, rising = np.sort(draw(columns(length, times))), np.sort(draw(columns(length, shares)))
        rising[-1] = 1
        zeros, (_, impulse) = np.zeros(length), impulses_up_to(start, 2)
        energy = start.kinetic_energy * (1 + draw(columns(length, shares))) / 2
        sums = (impulse, impulse * start.radii.max(), *counted)
        rows = (time, energy, zeros, *(rising * each for each in sums), zeros, rising)
        counts = arrays(np.int64, (length, SPEED_BINS), elements=st.integers(0, scene.number))
        summary = Summary(Series(*rows), draw(counts))
    last = 0.0 if len(time) == 0 else float(time[-1])
    stop = Stop(
        draw(st.sampled_from([each for each in StopReason if each is not StopReason.TIME])),
        last if summaries else max(last, draw(times)),
        tuple(draw(st.lists(st.integers(0, scene.number - 1), max_size=2))),
        draw(st.text(max_size=40)),
        *draw(st.tuples(st.none() | positive, st.none() | positive)),
    )
    if events is not None:
        counted = (at_wall := int(events.at_wall.sum()), length - at_wall)
    return Trace(start, finish, stop, *counted, events, summary)


@settings(max_examples=25, deadline=None)
@given(batch=batches())
def test_any_batch_comes_back_bit_for_bit(
    batch: list[tuple[int, Trace]],
    tmp_path_factory: pytest.TempPathFactory,
    provenance: Provenance,
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.h5"
    store.write(path, batch, provenance)
    found = store.read(path)
    assert [header.repeat for _, header in found] == [repeat for repeat, _ in batch]
    for (repeat, trace), (again, header), checked in zip(
        batch, found, store.check(path), strict=True
    ):
        assert same_bits(again, trace)
        assert (header, checked.stop) == (checked, header.stop)
        assert header.fingerprint == content_hash(trace)
        assert (header.collisions, header.provenance) == (trace.collisions, provenance)
        assert same_bits(header.stop, trace.stop)
        ((alone, _),) = store.read(path, [repeat])
        assert same_bits(alone, trace)
        if trace.events is not None:
            pieces = joined([*store.read_events(path, repeat)])
            assert same_bits(pieces, trace.events)


def test_a_simulated_trace_comes_back_bit_for_bit_and_replaces_what_was_there(
    traces: dict[str, Trace], tmp_path: Path, provenance: Provenance
) -> None:
    path = tmp_path / "point-0000" / "new.h5"
    for trace in traces.values():
        store.write(path, [(7, trace)], provenance)
        ((found, header),) = store.read(path)
        assert same_bits(found, trace)
        assert store.check(path) == [header]
        assert header.fingerprint == content_hash(trace)
        assert header.collisions == trace.collisions == 300
        assert [entry.name for entry in path.parent.iterdir()] == ["new.h5"]


def test_a_run_that_was_deleted_is_not_made_again(
    traces: dict[str, Trace], tmp_path: Path, provenance: Provenance
) -> None:
    """The next run would refuse a folder that has results and no manifest."""
    with pytest.raises(AbsentError, match="No such file"):
        store.write(tmp_path / "run" / "point-0000" / "new.h5", [(7, traces["events"])], provenance)
    assert not [*tmp_path.iterdir()]


def test_content_hash_sees_every_array_and_the_ending(traces: dict[str, Trace]) -> None:
    trace = traces["events"]
    events, stop = trace.events, trace.stop
    assert events is not None
    others = [
        replace(trace, stop=replace(stop, reason=StopReason.COLLAPSE)),
        replace(trace, stop=replace(stop, time=np.nextafter(stop.time, 0.0))),
        replace(trace, stop=replace(stop, accumulation_time=9.0)),
        replace(trace, stop=replace(stop, impulse_to_come=9.0)),
        replace(trace, wall_events=trace.wall_events + 1),
        replace(trace, pair_events=trace.pair_events + 1),
    ]
    for name in ("time", "i", "j", "impulse"):
        column = getattr(events, name).copy()
        column.view(np.uint8)[-1] ^= 1
        others.append(replace(trace, events=replace(events, **{name: column})))
    for end in ("start", "finish"):
        scene = getattr(trace, end)
        radius = np.nextafter(scene.container.radius, 0.0)
        shapes = (Circle(radius), Box(1.0, 2.0), Box(2.0, 1.0), PeriodicBox(1.0, 2.0))
        others += [replace(trace, **{end: replace(scene, container=each)}) for each in shapes]
        for field in fields(Scene):
            if field.name == "container":
                continue
            if field.name == "wall_key":
                others.append(replace(trace, **{end: replace(scene, wall_key=0)}))
                continue
            values = np.array(getattr(scene, field.name), dtype=np.float64)
            values.reshape(-1).view(np.uint8)[-8] ^= 1
            value = values if values.ndim else float(values)
            if field.name.endswith("law"):
                value = Constant(*values.tolist())
            others.append(replace(trace, **{end: replace(scene, **{field.name: value})}))
    hashes = {content_hash(other) for other in (trace, *others)}
    assert len(hashes) == 1 + len(others)


# What cannot be trusted


def foreign_h5md(path: Path) -> None:
    with File(path, "w", creator="another program") as file:
        element(file.particles_group("all"), "position", store="time", shape=(3, 2), dtype=float)


def old_schema(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_group("parameters/snooker").attrs["schema_version"] = store.SCHEMA_VERSION - 1


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda path: None, "there is no such result"),
        (lambda path: path.write_bytes(b"cor: 0.8\n"), "not a readable result"),
        (lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n"), "not a readable result"),
        (foreign_h5md, "not a readable result"),
        (old_schema, "is in version 3 of the files' schema"),
        (lambda path: path.mkdir(), "is a folder"),
        (lambda path: path.parent.rmdir() or path.parent.touch(), "not a readable result"),
    ],
)
def test_a_file_that_is_no_repeat_is_refused(
    make: Callable[[Path], object], reason: str, tmp_path: Path
) -> None:
    path = tmp_path / "in" / "other.h5"
    path.parent.mkdir()
    make(path)
    for reading in (store.read, store.check, store.read_headers):
        with pytest.raises(StoreError) as caught:
            reading(path)
        assert reason in caught.value.reason
        assert str(caught.value).isprintable()


@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_truncated_file_is_refused(part: float, image: bytes, tmp_path: Path) -> None:
    path = tmp_path / "short.h5"
    path.write_bytes(image[: int(part * len(image))])
    for reading in (store.read, store.check):
        with pytest.raises(StoreError, match="not a readable result"):
            reading(path)


def everything(path: Path) -> dict[str, Any]:
    """All values and attributes of a file, by name."""
    held: dict[str, Any] = {}

    def keep(name: str, item: h5py.Group | h5py.Dataset) -> None:
        values = item[()].tobytes() if isinstance(item, h5py.Dataset) else None
        held[name] = values, sorted((key, str(value)) for key, value in item.attrs.items())

    with h5py.File(path) as file:
        file.visititems(keep)
    return held


def test_a_flipped_byte_is_noticed_or_holds_nothing(image: bytes, tmp_path: Path) -> None:
    """In every array, in what HDF5 itself reads, and everywhere else: no reader overlooks one."""
    path = tmp_path / "flipped.h5"
    path.write_bytes(image)
    whole, content = everything(path), store.read(path)[0][1].fingerprint
    arrays: dict[str, int] = {}
    with h5py.File(path) as file:

        def note(name: str, item: object) -> None:
            if isinstance(item, h5py.Dataset):
                values = item[()].tobytes()
                start = image.find(values)
                assert start > 0
                arrays[name] = start + len(values) // 2

        file.visititems(note)
    assert len(arrays) == 17
    places = {*arrays.values(), *range(0, 300, 3), *range(5, len(image), 193)}
    for name in (b"SNOD", b"HEAP", b"TREE", b"content", b"provenance", b"ending"):
        if (start := image.find(name)) >= 0:
            places |= set(range(max(0, start - 40), start + 40, 3))
    noticed = set()
    for place in places:
        damaged = bytearray(image)
        damaged[place] ^= 0xFF
        path.write_bytes(damaged)
        try:
            store.check(path)
        except StoreError:
            noticed.add(place)
        else:
            assert everything(path) == whole, place
            assert store.read(path)[0][1].fingerprint == content, place
    assert noticed >= set(arrays.values())
    assert len(noticed) > len(places) / 2


# What cannot be written


def test_a_place_that_cannot_be_written_is_refused(
    traces: dict[str, Trace], tmp_path: Path, provenance: Provenance
) -> None:
    (tmp_path / "plain").write_text("x")
    (tmp_path / "folder").mkdir()
    for place in ("plain/one.h5", "plain/in/one.h5", "folder"):
        with pytest.raises(AbsentError, match="cannot write the result"):
            store.write(tmp_path / place, [(7, traces["events"])], provenance)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["folder", "plain"]


def test_a_lack_of_memory_is_a_file_that_cannot_be_read(
    image: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lacks(*_: object) -> None:
        raise MemoryError

    path = tmp_path / "large.h5"
    path.write_bytes(image)
    monkeypatch.setattr(hdf5, "check_links", lacks)
    with pytest.raises(StoreError, match=r"large\.h5: not a readable result .*MemoryError"):
        store.check(path)
