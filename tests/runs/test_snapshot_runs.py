"""Runs with `record: snapshots`: what is stored, when, and what is noticed."""

from __future__ import annotations

import math
from pathlib import Path

import h5py
import numpy as np
import pytest
from repeating import done, file_of, made

from snooker_cli.config import parse
from snooker_cli.engine import simulate
from snooker_cli.errors import StoreError
from snooker_cli.runs.plan import batch_size, first_scene, snapshot_times
from snooker_cli.runs.run import RepeatState
from snooker_cli.runs.verification import verify

SNAPSHOTS = """\
container: {shape: periodic, width: 20}
balls: {count: 60, radius: 0.3, mass: 1, speed: 1}
cor: 0.9
time: 30
record: snapshots
snapshots: [1, 10, 20]
"""


def test_a_changed_snapshot_is_noticed(tmp_path: Path) -> None:
    """By verification, and by whoever reads this snapshot; the others are read without it."""
    run = made(tmp_path / "run", SNAPSHOTS)
    done(run)
    assert [status.state for status in verify(run, replay=True, workers=1)] == [RepeatState.DONE]
    trace = run.read(run.points[0], 0)
    assert trace.snapshots.time.tolist() == [1.0, 10.0, 20.0]
    replayed = simulate(trace.start, time=30.0, snapshots=[1.0, 10.0, 20.0])
    for k in range(3):
        for name in ("positions", "velocities"):
            stored, again = (getattr(one.snapshots.read(k), name) for one in (trace, replayed))
            assert np.array_equal(stored, again)
    with h5py.File(file_of(run, 0, 0), "r+") as file:
        file["particles/snapshots/position/value"][1, 0, 0] *= 1 - 1e-15
    (status,) = verify(run, replay=False, workers=1)
    assert status.state is RepeatState.UNUSABLE
    trace.snapshots.read(0)
    with pytest.raises(StoreError, match="changed"):
        trace.snapshots.read(1)


def times_of(*overrides: str, end: float = 1e9) -> tuple[float, ...]:
    config = parse(SNAPSHOTS.replace("snapshots: [1, 10, 20]\n", ""), overrides=overrides).config
    return snapshot_times(config, first_scene(config, 0), end)


def test_times_of_a_decade() -> None:
    """60 balls at 1 m/s in (20 m)^2 move the mean distance of 2.6 m in 2.6 s."""
    assert times_of("snapshots={per_decade: 2}", "time=1e3") == (
        *(1.0, 3.162, 10.0, 31.62, 100.0, 316.2, 1000.0),
    )
    ten = times_of()
    assert ten[:4] == (1.0, 1.259, 1.585, 1.995)
    assert (len(ten), ten[-1]) == (15, 25.12)  # up to 30 s
    assert times_of("time=null", "collisions=2000", end=2.0) == ten[:4]
    assert times_of("balls.speed=10")[0] == 0.1
    assert times_of("record=events", "snapshots=null") == ()


def test_few_collisions_are_stored_instead() -> None:
    """They are smaller, and give the state at any time."""
    few = parse(SNAPSHOTS, overrides=("time=null", "collisions=999")).config
    assert (few.keeps_events, few.stored_times) == (True, ())
    many = parse(SNAPSHOTS, overrides=("time=null", "collisions=1000")).config
    assert (many.keeps_events, many.stored_times) == (False, (1.0, 10.0, 20.0))
    assert batch_size(many) == 1 < batch_size(few)


def test_a_summary_has_no_snapshots_and_the_same_start(tmp_path: Path) -> None:
    stored, summary = (
        made(tmp_path / "a", SNAPSHOTS),
        made(tmp_path / "b", SNAPSHOTS.replace("snapshots: [1, 10, 20]\n", ""), "record=summary"),
    )
    traces = []
    for run in (stored, summary):
        done(run)
        traces.append(run.read(run.points[0], 0))
    first, second = (trace.summary.series.columns for trace in traces)
    assert all(np.array_equal(first[name], second[name]) for name in first)
    assert traces[1].snapshots is None
    assert math.isclose(traces[0].finish.kinetic_energy, first["kinetic_energy"][-1], rel_tol=1e-12)
