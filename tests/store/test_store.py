"""The store: what is written comes back bit for bit, as valid H5MD, or not at all."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import h5py
import hostile
import numpy as np
import pytest
from pyh5md import File, element
from repeating import content_hash
from scenes import gas, lone_bouncer, report_scene, rough

from snooker_cli import store
from snooker_cli.containers import Box, Circle, PeriodicBox
from snooker_cli.engine import simulate
from snooker_cli.errors import AbsentError, StoreError, UnsoundError
from snooker_cli.laws import Constant, Driven
from snooker_cli.scene import Scene
from snooker_cli.store import Provenance
from snooker_cli.trace import (
    Events,
    Series,
    StopReason,
    Summary,
    Trace,
    joined,
)


def same_bits(one: Any, other: Any) -> bool:
    """Whether two dataclasses hold the same types and bits, all the way down."""
    if type(one) is not type(other):
        return False
    if isinstance(one, Trace | Scene | Events | Series | Summary):
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


SCENES: dict[str, Callable[[], Scene]] = {
    "fixed": lambda: gas("circle", 7, 0.2, cor=0.95, wall_cor=1.0),
    "free, unequal": lambda: gas("circle", 7, 0.2, mixed=True, container_mass=20.0),
    "periodic": lambda: gas("periodic", 60, 0.3, cor=0.9),
    "slides": lambda: replace(report_scene(radius=0.1, cor=0.8), slides=True),
    "wall trap": lone_bouncer,
    "rough": lambda: rough(gas("circle", 60, 0.2, cor=0.95)),
    "driven": lambda: replace(gas("circle", 7, 0.2, cor=0.95), wall_law=Driven(0.9, 2.0)),
    "collapse by duration": lambda: replace(gas("circle", 7, 0.2, cor=0.5), contact_duration=0.1),
}


@pytest.mark.parametrize("summary", [False, True], ids=["events", "summary"])
@pytest.mark.parametrize("name", SCENES)
def test_a_batch_comes_back_bit_for_bit(
    name: str, summary: bool, tmp_path: Path, provenance: Provenance
) -> None:
    """From 4096 numbers on, columns are compressed; long repeats have residuals of their times."""
    scene, path = SCENES[name](), tmp_path / "batch.h5"
    batch = []
    for repeat, collisions in enumerate((0, 1, 4096, 20_000)):
        start = replace(scene, velocities=(-1) ** repeat * scene.velocities)
        trace = simulate(start, collisions=collisions, summary=summary)
        stop = trace.stop._replace(message="Stöße\x00\x1b \U0001f600")
        batch.append((7 * repeat, replace(trace, stop=stop)))
    store.write(path, batch, provenance)
    for (repeat, trace), (again, header), checked in zip(
        batch, store.read(path), store.check(path), strict=True
    ):
        assert same_bits(again, trace)
        assert same_bits(header.stop, trace.stop)
        assert (header, header.repeat, header.provenance) == (checked, repeat, provenance)
        assert header.fingerprint == content_hash(trace)
        assert header.collisions == trace.collisions
        ((alone, _),) = store.read(path, [repeat])
        assert same_bits(alone, trace)
        if trace.events is not None:
            pieces = joined([events for _, events in store.read_events(path, [repeat])])
            assert same_bits(pieces, trace.events)


def test_a_run_that_was_deleted_is_not_made_again(
    traces: dict[str, Trace], tmp_path: Path, provenance: Provenance
) -> None:
    """The next run would refuse a folder that has results and no manifest."""
    with pytest.raises(AbsentError, match="No such file"):
        store.write(tmp_path / "run" / "point-0000" / "new.h5", [(7, traces["events"])], provenance)
    assert not [*tmp_path.iterdir()]


def test_content_hash_sees_every_array_and_the_ending(traces: dict[str, Trace]) -> None:
    trace = simulate(rough(traces["events"].start), collisions=300)
    events, stop = trace.events, trace.stop
    assert events is not None
    others = [
        replace(trace, stop=stop._replace(reason=StopReason.COLLAPSE)),
        replace(trace, stop=stop._replace(time=np.nextafter(stop.time, 0.0))),
        replace(trace, stop=stop._replace(accumulation_time=9.0)),
        replace(trace, stop=stop._replace(impulse_to_come=9.0)),
        replace(trace, wall_events=trace.wall_events + 1),
        replace(trace, pair_events=trace.pair_events + 1),
    ]
    for name in ("time", "i", "j", "impulse", "tangential"):
        column = getattr(events, name).copy()
        column.view(np.uint8)[-1] ^= 1
        others.append(replace(trace, events=replace(events, **{name: column})))
    for end in ("start", "finish"):
        scene = getattr(trace, end)
        radius = np.nextafter(scene.container.radius, 0.0)
        shapes = (Circle(radius), Box(1.0, 2.0), Box(2.0, 1.0), PeriodicBox(1.0, 2.0))
        others += [
            replace(trace, **{end: replace(scene, container=container)}) for container in shapes
        ]
        for field in fields(Scene):
            if field.name == "container":
                continue
            if field.name == "wall_key":
                others.append(replace(trace, **{end: replace(scene, wall_key=0)}))
                continue
            if field.name == "surface":
                for name in vars(scene.surface):
                    surface = replace(scene.surface, **{name: 0.7})
                    others.append(replace(trace, **{end: replace(scene, surface=surface)}))
                continue
            if field.name.endswith("law"):
                law = Constant(np.nextafter(getattr(scene, field.name).cor, 0.0))
                others.append(replace(trace, **{end: replace(scene, **{field.name: law})}))
                continue
            if field.name == "slides":
                others.append(replace(trace, **{end: replace(scene, slides=not scene.slides)}))
                continue
            values = np.array(getattr(scene, field.name), dtype=np.float64)
            values.reshape(-1).view(np.uint8)[-8] ^= 1
            value = values if values.ndim else float(values)
            others.append(replace(trace, **{end: replace(scene, **{field.name: value})}))
    hashes = {content_hash(other) for other in (trace, *others)}
    assert len(hashes) == 1 + len(others)


# What cannot be trusted


def foreign_h5md(path: Path) -> None:
    with File(path, "w", creator="another program") as file:
        element(file.particles_group("all"), "position", store="time", shape=(3, 2), dtype=float)


def old_schema(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_group("parameters/snooker").attrs["schema_version"] = store.READABLE[0] - 1


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda path: None, "there is no such result"),
        (lambda path: path.write_bytes(b"cor: 0.8\n"), "not a readable result"),
        (foreign_h5md, "not a readable result"),
        (old_schema, "is in version 3 of the files' schema"),
        (lambda path: path.mkdir(), "is a folder"),
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


def test_the_energy_account_of_a_summary_is_finite(tmp_path: Path, provenance: Provenance) -> None:
    """It may be below zero, by rounding."""
    trace, path = simulate(SCENES["driven"](), collisions=300, summary=True), tmp_path / "wrong.h5"
    assert trace.summary is not None
    for name in ("wall_energy", "lost_energy"):
        for value in (-1e-9, math.nan, math.inf):
            wrong = trace.summary.series.columns[name].copy()
            wrong[1] = value
            summary = replace(trace.summary, series=replace(trace.summary.series, **{name: wrong}))
            written = [(0, replace(trace, summary=summary))]
            if value < 0:
                store.write(path, written, provenance)
                assert len(store.check(path)) == 1
                continue
            with pytest.raises(UnsoundError, match=f"wrong {name} of a summary"):
                store.write(path, written, provenance)
            with hostile.unchecked():
                store.write(path, written, provenance)
            with pytest.raises(StoreError, match=f"wrong {name} of a summary"):
                store.check(path)


def test_an_impulse_is_finite_also_where_its_bound_is_none(
    tmp_path: Path, provenance: Provenance
) -> None:
    """The energy times the mass is no double."""
    scene = gas("circle", 7, 0.2)
    heavy = replace(scene, masses=np.full(7, 1e50), velocities=1e120 * scene.velocities)
    trace = simulate(heavy, collisions=5)
    assert trace.events is not None
    infinite = np.append(trace.events.impulse[:4], math.inf)
    wrong = replace(trace, events=replace(trace.events, impulse=infinite))
    store.write(tmp_path / "one.h5", [(0, trace)], provenance)
    with pytest.raises(UnsoundError, match="wrong impulse of an event"):
        store.write(tmp_path / "two.h5", [(0, wrong)], provenance)
