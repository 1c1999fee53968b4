"""Sizes of clusters, at several times where the gas cools."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from figure_runs import PERIODIC, STORED, layers, made, shown, traces, why_not

from snooker_cli.analysis import structure
from snooker_cli.engine import state_at, stored_times
from snooker_cli.figures.figure_data import Line
from snooker_cli.runs import RunFolder
from snooker_cli.scene import Scene


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    return made(tmp_path_factory.mktemp("stored") / "run", text=STORED)


def states(run: RunFolder, share: float) -> list[Scene]:
    """The stored states of the repeats nearest to a share of their time."""
    found = []
    for trace in traces(run, 0):
        times = stored_times(trace)
        nearest = times[np.argmin(np.abs(times - share * trace.stop.time))]
        found.append(state_at(trace, nearest)[1])
    return found


def share_in_clusters(scene: Scene, size: float) -> float:
    """By the label of each ball."""
    labels = structure.cluster_labels(scene.positions, scene)
    return float(np.mean([np.sum(labels == label) >= size for label in labels]))


def test_a_gas_that_cools_has_four_times(stored: RunFolder) -> None:
    figure = shown(stored, "cluster-sizes")
    curves = [line for line in layers(figure, Line) if line.label]
    assert len(curves) == 4
    assert figure.shades == pytest.approx([0, 1 / 3, 2 / 3, 1])
    for curve, part in zip(curves, (0.0, 0.01, 0.1, 0.99), strict=True):
        assert curve.y[0] == 1.0
        assert np.all(np.diff(curve.y) <= 0)
        for place in range(0, len(curve.x), 3):
            expected = np.mean(
                [share_in_clusters(scene, curve.x[place]) for scene in states(stored, part)]
            )
            assert curve.y[place] == pytest.approx(expected)
    assert len(curves[-1].x) > len(curves[0].x)  # clusters grow


def test_the_result_is_that_of_the_last_states(stored: RunFolder) -> None:
    last = states(stored, 0.99)
    sizes = [structure.mean_cluster(s.positions, s.velocities, s)[0] for s in last]
    numbers = shown(stored, "cluster-sizes").numbers
    (row,) = numbers.get("points", [numbers])
    assert row["mean"] == pytest.approx(np.mean(sizes))


def test_points_are_shown_beside_each_other(tmp_path: Path) -> None:
    """Each has one curve: cooling ones the last state, elastic ones a mean."""
    run = made(tmp_path / "run", text=PERIODIC)
    curves = [line for line in layers(shown(run, "cluster-sizes"), Line) if line.label]
    assert len(curves) == 3
    dense = made(tmp_path / "dense", "balls.radius=1.5", text=PERIODIC)
    assert "elastic balls are one cluster too" in why_not(dense, "cluster-sizes")
