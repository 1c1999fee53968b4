"""``snooker export``: its numbers read back as the same doubles."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from command_line import Snooker

from snooker_cli import store
from snooker_cli.engine import replay
from snooker_cli.trace import Trace


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(text.splitlines()))


@pytest.fixture
def trace(finished: Path) -> Trace:
    """Point 1, repeat 2."""
    return store.read(finished / "point-0001" / "repeat-0002.h5")[0]


def test_exported_events_read_back_as_the_same_doubles(trace: Trace, snooker: Snooker) -> None:
    ended = snooker("export", "small", "--point", "1", "--repeat", "2")
    assert (ended.code, ended.err) == (0, "")
    found, events = rows(ended.out), trace.events
    assert events is not None
    assert list(found[0]) == ["time", "i", "j", "impulse"]
    for name, kind in (("time", float), ("impulse", float), ("i", int), ("j", int)):
        assert [kind(row[name]) for row in found] == getattr(events, name).tolist()
    assert "-1" in {row["j"] for row in found}


@pytest.mark.parametrize("asked", [None, "0,0.5,1.25", "0:1:5"])
def test_exported_states_read_back_as_the_same_doubles(
    asked: str | None, trace: Trace, snooker: Snooker
) -> None:
    times = {None: [0.0, trace.stop.time], "0:1:5": [0.0, 0.25, 0.5, 0.75, 1.0]}.get(
        asked, [0.0, 0.5, 1.25]
    )
    options = [] if asked is None else ["--times", asked]
    ended = snooker("export", "small", "--point", "1", "--repeat", "2", "--states", *options)
    assert ended.code == 0, ended.err
    found = rows(ended.out)
    assert list(found[0]) == ["time", "ball", "x", "y", "u", "v"]
    assert [int(row["ball"]) for row in found] == len(times) * [-1, 0, 1, 2, 3, 4, 5, 6]
    assert [float(row["time"]) for row in found] == np.repeat(times, 8).tolist()
    numbers = np.array([[float(row[name]) for name in "xyuv"] for row in found])
    states = replay(trace, times)
    expected = np.concatenate(
        [
            np.concatenate([states.container_positions[:, None], states.positions], axis=1),
            np.concatenate([states.container_velocities[:, None], states.velocities], axis=1),
        ],
        axis=2,
    )
    assert np.array_equal(numbers, expected.reshape(-1, 4))
    if asked is None:
        assert np.array_equal(numbers[1:8, :2], trace.start.positions)
        assert np.array_equal(numbers[9:, 2:], trace.finish.velocities)
