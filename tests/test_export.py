"""``snooker export --out``: Parquet and H5MD files that other programs read as what they are."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import hostile
import numpy as np
import pytest
from pyh5md import File, element
from scenes import gas, rough

from snooker_cli import export, store
from snooker_cli.engine import replay, replayed, simulate
from snooker_cli.export import (
    EVENTS,
    STATES,
    states_table,
)
from snooker_cli.store import Provenance, RepeatHeader
from snooker_cli.trace import Trace

Snooker = Callable[..., Any]

POINT = ("small", "--point", "1", "--repeat", "2")
FILE = Path("point-0001/repeats-0000-0002.h5")


@pytest.fixture
def trace(finished: Path) -> Trace:
    """Point 1, repeat 2, of the finished run."""
    ((found, _),) = store.read(finished / FILE, [2])
    return found


def exported(snooker: Snooker, out: str, *options: str) -> Path:
    """The written file, whose name alone is printed."""
    ended = snooker("export", *POINT, "--out", out, "--replace", *options)
    assert (ended.code, ended.out, ended.err) == (0, f"{out}\n", "")
    assert list(Path().glob(f"{out}*")) == [Path(out)]
    return Path(out)


# CSV


@pytest.mark.parametrize("options", [(), ("--states", "--times", "0,0.5,1.25")])
def test_a_csv_has_the_same_doubles(
    options: tuple[str, ...], trace: Trace, snooker: Snooker
) -> None:
    """In a file as on stdout."""
    text = exported(snooker, "a.csv", *options).read_text()
    assert text == snooker("export", *POINT, *options).out
    assert trace.events is not None
    expected = states_table(replay(trace, [0, 0.5, 1.25])) if options else vars(trace.events)
    first, *rows = csv.reader(text.splitlines())
    assert first == list(STATES if options else EVENTS)[:-1]  # the last is that of rough balls
    for name, column in zip(first, zip(*rows, strict=True), strict=True):
        assert np.array_equal(np.array(column, dtype=expected[name].dtype), expected[name])


def test_a_table_of_states_has_the_container_then_the_balls(trace: Trace) -> None:
    (states,) = replayed(trace, np.array([0.0, trace.stop.time]))
    table = states_table(states)
    start, finish = trace.start, trace.finish
    number = start.number + 1
    assert table["ball"].tolist() == 2 * list(range(-1, start.number))
    assert table["time"].tolist() == number * [0.0] + number * [trace.stop.time]
    assert np.array_equal(table["x"][1:number], start.positions[:, 0])
    assert np.array_equal(table["v"][number + 1 :], finish.velocities[:, 1])
    assert (table["x"][0], table["y"][0]) == tuple(states.container_position[0])
    assert (table["u"][number], table["v"][number]) == tuple(states.container_velocity[1])


def test_frames_are_even(trace: Trace, snooker: Snooker) -> None:
    end = trace.stop.time
    for options, expected in (
        ((), [0, end]),
        (("--times", "0:1:5"), [0, 0.25, 0.5, 0.75, 1]),
        (("--frames", "4"), np.linspace(0, end, 4)),
    ):
        rows = csv.DictReader(snooker("export", *POINT, "--states", *options).out.splitlines())
        times = [float(row["time"]) for row in rows if row["ball"] == "-1"]
        assert times == list(expected)


# Parquet


def read_parquet(path: Path) -> Any:
    return pytest.importorskip("pyarrow.parquet").ParquetFile(path)


def test_parquet_has_the_same_numbers_their_units_and_origin(
    trace: Trace, snooker: Snooker
) -> None:
    header = store.check(Path("runs/small") / FILE)[2]
    some = ("--states", "--times", "0,0.5")
    states = states_table(replay(trace, [0.0, 0.5]))
    for options, units, expected, size in (
        ((), EVENTS, vars(trace.events), {"events": 150}),
        (some, STATES, states, {"frames": 2}),
    ):
        out = exported(snooker, "a.parquet", *options)
        table = read_parquet(out).read()
        assert table.column_names == list(units)[:-1]
        for name in table.column_names:
            column = table[name].to_numpy()
            assert column.dtype == expected[name].dtype
            assert column.tobytes() == expected[name].tobytes()
            assert table.schema.field(name).metadata == {b"unit": units[name].encode()}
        about = json.loads(table.schema.metadata[b"snooker"])
        assert about.items() >= size.items()
        assert about["bits"] == header.fingerprint
        assert about["provenance"] == vars(header.provenance) | {"repeat": 2}
        assert about["ending"] == {**header.stop.known(), "balls": list(header.stop.balls)}


def test_without_pyarrow_the_message_has_the_command(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    ended = snooker("export", *POINT, "--out", "a.parquet")
    assert (ended.code, ended.out) == (2, "")
    assert "pip install" in ended.err
    assert not list(Path().glob("a.parquet*"))


# Rough balls


ROUGH = """\
container: {radius: 10.0}
balls: {count: 7, radius: 1.0, speed: 10.0, spin: {temperature: 50}}
cor: 0.9
tangential_cor: 0.5
collisions: 60
"""


def columns_of(text: str) -> dict[str, np.ndarray[Any, Any]]:
    """The columns of a CSV."""
    first, *rows = csv.reader(text.splitlines())
    return dict(zip(first, np.array(rows, dtype=np.float64).T, strict=True))


def test_rough_balls_have_a_column_more(here: Path, snooker: Snooker) -> None:
    """Events the tangential impulse, states the spin; the container does not turn."""
    Path("turning.yaml").write_text(ROUGH)
    assert snooker("run", "turning.yaml").code == 0
    ((trace, _),) = store.read(next(Path("runs/turning/point-0000").iterdir()))
    events, states = (
        columns_of(snooker("export", "turning", *options).out) for options in ((), ("--states",))
    )
    assert (list(events), list(states)) == (list(EVENTS), list(STATES))
    assert trace.events is not None
    assert np.array_equal(events["tangential_impulse"], trace.events.tangential)
    spins = states["spin"].reshape(2, 8)
    assert np.array_equal(spins[:, 0], [0.0, 0.0])
    assert np.array_equal(spins[0, 1:], trace.start.spins)
    assert np.array_equal(spins[1, 1:], trace.finish.spins)
    for options, units in (((), EVENTS), (("--states",), STATES)):
        out = ("--out", "a.parquet", "--replace")
        assert snooker("export", "turning", *options, *out).code == 0
        table, name = read_parquet(Path("a.parquet")).read(), list(units)[-1]
        assert np.array_equal(table[name].to_numpy(), (states if options else events)[name])
        assert table.schema.field(name).metadata == {b"unit": units[name].encode()}


# H5MD


@pytest.fixture(params=["circle", "periodic", "rough"])
def written(
    request: pytest.FixtureRequest, tmp_path: Path, provenance: Provenance
) -> tuple[Path, Trace, Any]:
    """States of a scene in a file, its trace and the states."""
    options: dict[str, Any] = {
        "circle": {"container_mass": 20.0, "mixed": True},
        "periodic": {},
        "rough": {"mixed": True},
    }[request.param]
    scene = gas(request.param.replace("rough", "box"), 60, 0.3, **options)
    trace = simulate(rough(scene) if request.param == "rough" else scene, collisions=60)
    times = np.linspace(0, trace.stop.time, 7)
    batches = replayed(trace, times, batch=2 * trace.start.number)
    path = tmp_path / "states.h5md"
    header = RepeatHeader(7, trace.stop, 30, 30, provenance, "bits", trace.start.rules)
    export.write_states(path, trace.start, header, times, batches)
    return path, trace, replay(trace, times)


def test_an_independent_reader_reads_the_states(written: tuple[Path, Trace, Any]) -> None:
    path, trace, states = written
    with File(path, "r") as file:
        group = file.particles_group("trajectory")
        for name, values in (("position", states.positions), ("velocity", states.velocities)):
            found = element(group, name)
            assert found.element_type == "TimeElement"
            assert np.array_equal(found.time[:], states.time)
            assert np.array_equal(found.value[:, :, :2], values)
            assert not np.any(found.value[:, :, 2])
        assert ("angular_velocity" in group) == (states.spins is not None)
        if states.spins is not None:
            turning = element(group, "angular_velocity").value[:]
            assert np.array_equal(turning[:, :, 2], states.spins)
            assert not np.any(turning[:, :, :2])
        assert np.array_equal(element(group, "mass").value[:], trace.start.masses)
        assert np.array_equal(element(group, "radius").value[:], trace.start.radii)
        position, velocity = (
            element(file["observables"], f"container_{name}").value[:, :2]
            for name in ("position", "velocity")
        )
        assert np.array_equal(position, states.container_position)
        assert np.array_equal(velocity, states.container_velocity)


def test_mdanalysis_reads_the_states(written: tuple[Path, Trace, Any]) -> None:
    """Without a topology, in m and m/s; it keeps single precision."""
    analysis = pytest.importorskip("MDAnalysis")
    path, trace, states = written
    options = {"n_atoms": trace.start.number, "convert_units": False, "to_guess": ()}
    universe = analysis.Universe(str(path), **options)
    assert len(universe.trajectory) == 7
    for k, step in enumerate(universe.trajectory):
        assert step.time == states.time[k]
        assert np.array_equal(step.positions[:, :2], states.positions[k].astype(np.float32))
        assert np.array_equal(step.velocities[:, :2], states.velocities[k].astype(np.float32))
        assert not np.any(step.positions[:, 2])
        assert np.allclose(step.dimensions[:2], trace.start.container.size, rtol=1e-6)
        assert step.dimensions[2] > 0
        assert step.dimensions[3:].tolist() == [90, 90, 90]
        assert np.array_equal(step.data["container_position"][:2], states.container_position[k])
    assert universe.trajectory.units["time"] == "s"
    assert universe.trajectory.units["velocity"] == "m/s"


def test_ase_reads_the_states(written: tuple[Path, Trace, Any], provenance: Provenance) -> None:
    """ASE keeps momenta, and divides them by the masses: two roundings."""
    ase = pytest.importorskip("ase.io")
    path, trace, states = written
    start, out = trace.start, path.with_suffix(".xyz")
    batches = replayed(trace, states.time, batch=2 * start.number)
    header = RepeatHeader(7, trace.stop, 30, 30, provenance, "bits", start.rules)
    export.write_states(out, start, header, states.time, batches)
    frames = ase.read(out, index=":")
    assert [frame.info["Time"] for frame in frames] == states.time.tolist()
    for k, frame in enumerate(frames):
        assert np.array_equal(frame.positions[:, :2], states.positions[k])
        assert np.array_equal(frame.get_masses(), start.masses)
        assert np.array_equal(frame.arrays["radius"], start.radii)
        assert ("angular_velocity" in frame.arrays) == (states.spins is not None)
        if states.spins is not None:
            turning = frame.arrays["angular_velocity"]
            assert np.array_equal(turning[:, 2], states.spins[k])
            assert not np.any(turning[:, :2])
        velocities = frame.get_velocities()
        np.testing.assert_allclose(velocities[:, :2], states.velocities[k], rtol=2**-51, atol=0)
        assert not np.any(velocities[:, 2])
        assert frame.pbc.tolist() == [not start.container.has_wall] * 2 + [False]
        assert frame.cell.lengths()[:2].tolist() == list(start.container.size)
        # The cell is that of the container at each time, which moves if it is free.
        centre = frame.info["Origin"][:2] + frame.cell.lengths()[:2] / 2
        np.testing.assert_allclose(centre, states.container_position[k], atol=1e-12)
    types: dict[str, set[tuple[float, float]]] = {}
    for name, radius, mass in zip(frame.symbols, start.radii, start.masses, strict=True):
        types.setdefault(name, set()).add((radius, mass))
    assert all(len(sizes) == 1 for name, sizes in types.items() if name != "X")


def test_a_damaged_repeat_is_not_exported(finished: Path, trace: Trace, snooker: Snooker) -> None:
    path = finished / FILE
    image = bytearray(path.read_bytes())
    image[image.index(trace.events.impulse.tobytes()) + 2] ^= 16
    path.write_bytes(image)
    for options in ((), ("--out", "a.csv"), ("--out", "a.parquet"), ("--out", "a.h5md")):
        ended = snooker("export", *POINT, *options)
        assert (ended.code, ended.out) == (1, "")
        assert "its content has changed" in ended.err
    ended = snooker("show", "small", "--hash", "--point", "1")
    assert (ended.code, ended.out) == (1, "")  # else it would be of collisions that never happened
    assert not list(Path().glob("a.*"))


def test_states_that_leave_the_container_are_not_exported(finished: Path, snooker: Snooker) -> None:
    """The file has right hashes, but its events do not follow from its start."""
    hostile.times(1e20)(finished / FILE)
    ended = snooker("export", *POINT, "--states", "--frames", "9")
    assert (ended.code, ended.out) == (1, "")
    assert "a ball leaves the container" in ended.err
    assert "verify RUN --replay" in ended.err
    assert "other bits" in snooker("verify", "small", "--replay").out
