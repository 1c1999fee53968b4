"""The store: what is written comes back bit for bit, as valid H5MD, or not at all."""

from __future__ import annotations

import json
import re
import subprocess
import sys
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

from snooker_cli import store
from snooker_cli.containers import Box, Circle, PeriodicBox
from snooker_cli.errors import AbsentError, StoreError
from snooker_cli.scene import Scene
from snooker_cli.store import Provenance
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
    store.write(path, traces["events"], provenance)
    return path.read_bytes()


doubles = st.floats(width=64)
"""Any double: infinities, nan, -0.0 and subnormal ones too."""

finite = st.floats(allow_nan=False, allow_infinity=False)


def columns(length: int) -> st.SearchStrategy[Any]:
    return arrays(np.float64, length, elements=doubles)


containers = st.one_of(
    st.builds(Circle, finite),
    st.builds(Box, finite, finite),
    st.builds(PeriodicBox, finite, finite),
)


@st.composite
def scenes(draw: st.DrawFn, number: int) -> Scene:
    return Scene(
        positions=draw(arrays(np.float64, (number, 2), elements=doubles)),
        velocities=draw(arrays(np.float64, (number, 2), elements=doubles)),
        radii=draw(columns(number)),
        masses=draw(columns(number)),
        container=draw(containers),
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
    names = ("radii", "masses", "container", "container_mass")
    finish = replace(
        moved,
        restitution=start.restitution,
        wall_restitution=start.wall_restitution,
        **{name: getattr(start, name) for name in names},
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


@settings(max_examples=40, deadline=None)
@given(trace=any_traces())
def test_any_trace_comes_back_bit_for_bit(
    trace: Trace, tmp_path_factory: pytest.TempPathFactory, provenance: Provenance
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.h5"
    store.write(path, trace, provenance)
    found, header = store.read(path)
    assert same_bits(found, trace)
    assert header.provenance == provenance
    checked = store.check(path)
    assert (checked.collisions, checked.provenance) == (trace.collisions, provenance)
    assert same_bits(checked.stop, trace.stop)


def test_a_simulated_trace_comes_back_bit_for_bit_and_replaces_what_was_there(
    traces: dict[str, Trace], tmp_path: Path, provenance: Provenance
) -> None:
    path = tmp_path / "a" / "b" / "new.h5"
    for trace in traces.values():
        store.write(path, trace, provenance)
        found, header = store.read(path)
        assert same_bits(found, trace)
        assert store.check(path).fingerprint == header.fingerprint == store.content_hash(trace)
        assert header.collisions == trace.collisions == 300
        assert [entry.name for entry in path.parent.iterdir()] == ["new.h5"]


def test_a_config_of_many_balls_fits(
    traces: dict[str, Trace], tmp_path: Path, provenance: Provenance
) -> None:
    """HDF5 keeps attributes of more than 64 KiB elsewhere than small ones."""
    long = replace(provenance, config=json.dumps({"list": [0.1] * 100_000}))
    store.write(tmp_path / "long.h5", traces["events"], long)
    assert store.read(tmp_path / "long.h5")[1].provenance == long


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
            if field.name == "container":
                radius = np.nextafter(scene.container.radius, 0.0)
                boxes = (Box(1.0, 2.0), Box(2.0, 1.0), PeriodicBox(1.0, 2.0))
                others += [
                    replace(trace, **{end: replace(scene, container=container)})
                    for container in (Circle(radius), *boxes)
                ]
                continue
            values = np.array(getattr(scene, field.name), dtype=np.float64)
            values.reshape(-1).view(np.uint8)[-8] ^= 1
            value = values if values.ndim else float(values)
            others.append(replace(trace, **{end: replace(scene, **{field.name: value})}))
    hashes = {store.content_hash(other) for other in (trace, *others)}
    assert len(hashes) == 1 + len(others)


# What cannot be trusted


def refused(path: Path) -> str:
    """The reason for which a file is refused, whether it is read or only checked."""
    reasons = []
    for reading in (store.read, store.check):
        with pytest.raises(StoreError) as caught:
            reading(path)
        reasons.append(caught.value.reason)
        assert str(caught.value).isprintable()
    assert reasons[0] == reasons[1]
    return reasons[0]


@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_truncated_file_is_refused(part: float, image: bytes, tmp_path: Path) -> None:
    path = tmp_path / "short.h5"
    path.write_bytes(image[: int(part * len(image))])
    assert "not a readable result" in refused(path)


def foreign_hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["temperature"] = np.arange(3.0)


def foreign_h5md(path: Path) -> None:
    with File(path, "w", creator="somebody else") as file:
        element(file.particles_group("all"), "position", store="time", shape=(3, 2), dtype=float)


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda path: None, "there is no such result"),
        (lambda path: path.write_bytes(b"cor: 0.8\n"), "not a readable result"),
        (lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n"), "not a readable result"),
        (foreign_hdf5, "not a readable result"),
        (foreign_h5md, "not a readable result"),
        (lambda path: path.mkdir(), "is a folder"),
        (lambda path: path.parent.rmdir() or path.parent.touch(), "not a readable result"),
    ],
)
def test_what_is_not_a_repeats_file_is_refused(
    make: Callable[[Path], object], reason: str, tmp_path: Path
) -> None:
    path = tmp_path / "in" / "other.h5"
    path.parent.mkdir()
    make(path)
    assert reason in refused(path)


def test_a_file_of_another_schema_is_refused(image: bytes, tmp_path: Path) -> None:
    path = tmp_path / "old.h5"
    path.write_bytes(image)
    with h5py.File(path, "r+") as file:
        file["parameters/snooker"].attrs["schema_version"] = store.SCHEMA_VERSION - 1
    assert "is in version 1 of the files' schema" in refused(path)


def test_a_flipped_bit_in_any_array_is_refused(image: bytes, tmp_path: Path) -> None:
    path = tmp_path / "flipped.h5"
    path.write_bytes(image)
    places: list[int] = []
    with h5py.File(path, "r") as file:

        def note(name: str, item: object) -> None:
            # Steps, and the times of the two states, are there for other readers only.
            unread = r".*/step|particles/.*/time"
            if isinstance(item, h5py.Dataset) and not re.fullmatch(unread, name):
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
from snooker_cli import errors
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

def content_of(stored):
    trace, header = stored
    return store.content_hash(trace), trace.stop, header.provenance

for place in places:
    damaged = bytearray(image)
    damaged[place] ^= 255
    path.write_bytes(damaged)
    print("byte", place, file=sys.stderr, flush=True)
    try:
        found = store.read(path)
    except errors.StoreError:
        continue
    except Exception as error:
        print(f"byte {place}: {type(error).__name__}: {error}")
        continue
    if content_of(found) != content_of(whole):
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


def test_a_place_that_cannot_be_written_is_refused(
    traces: dict[str, Trace], tmp_path: Path, provenance: Provenance
) -> None:
    (tmp_path / "plain").write_text("x")
    (tmp_path / "folder").mkdir()
    for place in ("plain/one.h5", "plain/in/one.h5", "folder"):
        with pytest.raises(AbsentError, match="cannot write the result"):
            store.write(tmp_path / place, traces["events"], provenance)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["folder", "plain"]


def everything(path: Path) -> dict[str, Any]:
    """All values and attributes of a file, by name."""
    held: dict[str, Any] = {}

    def keep(name: str, item: h5py.Group | h5py.Dataset) -> None:
        values = item[()].tobytes() if isinstance(item, h5py.Dataset) else None
        held[name] = values, sorted((key, str(value)) for key, value in item.attrs.items())

    with h5py.File(path) as file:
        file.visititems(keep)
    return held


def test_no_flipped_byte_is_overlooked_by_any_reader(
    traces: dict[str, Trace], tmp_path: Path, provenance: Provenance
) -> None:
    """What ``check`` lets pass is the same for h5py: those bytes hold nothing."""
    path = tmp_path / "repeat.h5"
    store.write(path, traces["events"], provenance)
    sound, whole = path.read_bytes(), everything(path)
    found = 0
    for place in range(5, len(sound), 97):
        damaged = bytearray(sound)
        damaged[place] ^= 0xFF
        path.write_bytes(damaged)
        try:
            store.check(path)
        except StoreError:
            found += 1
        else:
            assert everything(path) == whole, place
    assert found > len(sound) / 97 / 2


def test_a_file_keeps_the_rules_against_collapse(
    traces: dict[str, Trace], tmp_path: Path, provenance: Provenance
) -> None:
    """And its content hash depends on them."""
    plain = traces["events"]
    hashes = set()
    for rule in ({}, {"elastic_below": 0.3}, {"contact_duration": 0.3}, {"slides": True}):
        start, finish = (replace(scene, **rule) for scene in (plain.start, plain.finish))
        trace = replace(plain, start=start, finish=finish)
        store.write(tmp_path / "a.h5", trace, provenance)
        found = store.read(tmp_path / "a.h5")[0].start
        for name in ("elastic_below", "contact_duration", "slides"):
            assert getattr(found, name) == getattr(start, name)
        hashes.add(store.content_hash(trace))
    assert len(hashes) == 4
