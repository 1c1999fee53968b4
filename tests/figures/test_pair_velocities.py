"""The figure of velocity correlations: its references, its times, and errors over repeats."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from figure_runs import BOX, PERIODIC, STORED, layers, made, shown, traces, why_not

from snooker_cli.analysis.velocity_correlations import correlations, distance_edges, pair_sums
from snooker_cli.engine import state_at, stored_times
from snooker_cli.figures.figure_data import Band, FigureData, Line, Reference
from snooker_cli.runs import RunFolder

NAME = "velocity-correlations"


def result(figure: FigureData) -> dict[str, Any]:
    """The numbers of the only point."""
    (numbers,) = figure.numbers.get("points", [figure.numbers])
    return dict(numbers)


@pytest.fixture(scope="module")
def elastic(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    return made(tmp_path_factory.mktemp("elastic") / "run", "cor=1", "wall_cor=null", text=PERIODIC)


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    return made(tmp_path_factory.mktemp("stored") / "run", text=STORED)


def test_elastic_balls_have_the_reference_of_fixed_momentum(elastic: RunFolder) -> None:
    figure = shown(elastic, NAME)
    (reference,) = [layer for layer in figure.layers if isinstance(layer, Reference)]
    assert reference.value == result(figure)["theory"] == pytest.approx(-1 / 63)
    assert [panel.label for panel in figure.panels] == ["across", "vorticity"]
    across, turning = figure.panels
    assert reference.value in [line.value for line in across.layers if isinstance(line, Reference)]
    assert 1.0 in [line.value for line in turning.layers if isinstance(line, Reference)]
    assert all(any(isinstance(layer, Band) for layer in panel.layers) for panel in figure.panels)
    assert "Theory: fixed momentum (exact: −1/(N − 1))." in figure.caption


@pytest.mark.parametrize(
    ("text", "overrides", "theory"),
    [
        (BOX, ["cor=1"], 0.0),
        (BOX, ["cor=1", "container.shape=channel"], None),
        (BOX, ["cor=0.9"], None),
    ],
)
def test_walls_that_take_momentum_have_another(
    text: str, overrides: list[str], theory: float | None, tmp_path: Path
) -> None:
    figure = shown(made(tmp_path / "run", *overrides, text=text), NAME)
    assert result(figure)["theory"] == theory
    values = {layer.value for layer in figure.layers if isinstance(layer, Reference)}
    assert values == {0.0}


def test_a_gas_that_cools_has_several_times(stored: RunFolder) -> None:
    """The last curve is that of the last states, with its error over the repeats."""
    figure = shown(stored, NAME)
    curves = layers(figure, Line)
    assert [line.label[:4] for line in curves if line.label] == ["t = "] * 3
    assert figure.shades == pytest.approx([0, 1 / 3, 2 / 3, 1])  # 0 is the start, as in others
    assert [line.series for line in curves if line.label] == [1, 2, 3]
    edges = distance_edges(traces(stored, 0)[0].start)
    rows = []
    for trace in traces(stored, 0):
        times = stored_times(trace)
        scene = state_at(trace, times[np.argmin(np.abs(times - 0.99 * trace.stop.time))])[1]
        rows.append(correlations(pair_sums(scene.positions, scene.velocities, scene, edges)))
    along, across, turning = np.mean(rows, axis=0)
    assert curves[2].y == pytest.approx(along, rel=1e-9)
    for panel, mean in zip(figure.panels, (across, turning), strict=True):
        lines = [layer for layer in panel.layers if isinstance(layer, Line)]
        assert len(lines) == 3
        assert lines[-1].y == pytest.approx(mean, rel=1e-9)
    assert result(figure)["nearest"] == pytest.approx(along[0])


def test_runs_that_cannot_give_it(mixture: RunFolder, warm: RunFolder) -> None:
    assert "the balls' masses differ" in why_not(mixture, NAME)
    assert "needs the balls' states" in why_not(warm, NAME)
