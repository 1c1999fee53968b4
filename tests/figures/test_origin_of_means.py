"""How a mean comes about: results of single repeats, and hits of the wall."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from figure_runs import ELASTIC, layers, made, shown, traces, why_not

from snooker_cli import theory
from snooker_cli.analysis.run_analysis import comparisons
from snooker_cli.engine import series
from snooker_cli.figures.figure_data import Band, Line, Points, Reference
from snooker_cli.figures.origin_of_means import HITS
from snooker_cli.runs import RunFolder
from snooker_cli.trace import even_choice


def row_of(run: RunFolder, quantity: str, model: str = "", **parameters: float) -> dict[str, float]:
    """The first row of `compare` on a quantity of a point, and on a theory if it is given."""
    chosen = {key.replace("__", "."): value for key, value in parameters.items()}
    return next(
        row
        for row in comparisons(run).rows
        if row["quantity"] == quantity
        and model in row["model"]
        and chosen.items() <= row["parameters"].items()
    )


def test_a_histogram_of_repeats_has_the_mean_of_compare(tmp_path: Path) -> None:
    run = made(tmp_path / "run", "cor=0.8", "repeats=12")
    found = shown(run, "result-histogram")
    outline, mean, normal = layers(found, Line)
    row, (record,) = row_of(run, "Haff's α"), found.numbers["points"]
    assert (record["value"], record["value_error"]) == (row["measured"], row["error"])
    assert mean.x.tolist() == [record["value"]] * 2
    (band,) = layers(found, Band)
    half = (band.x[1] - band.x[0]) / 2
    assert half == pytest.approx(record["standard_deviation"] / np.sqrt(12), rel=1e-9)
    assert half == pytest.approx(row["error"], rel=1e-9)
    assert outline.y.sum() == 12
    assert outline.steps
    # The normal law has as many repeats, but for its tails beyond three deviations.
    width = outline.x[2] - outline.x[1]
    assert np.trapezoid(normal.y, normal.x) / width == pytest.approx(12, rel=0.005)
    assert found.x_label == "α (s⁻¹)"


def test_few_repeats_make_no_histogram(decaying: RunFolder) -> None:
    reason = why_not(decaying, "result-histogram", cor=0.8)
    assert reason == "it needs 8 or more repeats with a result, and 3 have one"


def test_impulses_on_the_wall_add_up_to_the_pressure(decaying: RunFolder) -> None:
    found = shown(decaying, "wall-impulses", cor=1.0)
    line, later = [line for line in layers(found, Line) if len(line.x)]
    (points,) = found.panels[0].layers
    assert isinstance(points, Points)
    columns = series(traces(decaying, 2)[0])
    steps = np.diff(columns.wall_impulse)
    own = steps[(steps > 0) & (columns.time[1:] <= line.x[-1])]
    assert points.y == pytest.approx(own[even_choice(len(own), HITS)], rel=1e-9)
    assert line.x[-1] == min(trace.stop.time for trace in traces(decaying, 2))
    length, ends = 20 * np.pi, []
    for trace in traces(decaying, 2):
        of_repeat = series(trace)
        last = np.searchsorted(of_repeat.time, line.x[-1], side="right") - 1
        ends.append(of_repeat.wall_impulse[last] / (length * line.x[-1]))
    assert line.y[-1] == pytest.approx(np.mean(ends), rel=1e-9)
    row, (record,) = row_of(decaying, "pressure", cor=1.0), found.numbers["points"]
    assert (record["pressure"], record["pressure_error"]) == (row["measured"], row["error"])
    assert (later.label, *later.y) == ("mean P", record["pressure"], record["pressure"])
    assert 0 < later.x[0] < later.x[1] == line.x[-1]
    references = {reference.label: reference.value for reference in layers(found, Reference)}
    assert references["hard disks, finite N"] == record["theory"]


def test_the_collision_rate_is_that_of_compare_beside_enskogs(tmp_path: Path) -> None:
    """In a panel of the equation of state, over Boltzmann's rate, which makes it χ."""
    run = made(tmp_path / "run", *ELASTIC, "collisions=2000", "balls.radius=0.5,1.0")
    found = shown(run, "equation-of-state")
    *points, curve = found.panels[0].layers
    assert isinstance(curve, Line)
    for record, marker in zip(found.numbers["points"], points, strict=True):
        row = row_of(run, "ball-ball rate of a ball", "Boltzmann", **record["parameters"])
        over = record["rate_over_boltzmann"]
        assert over == pytest.approx(row["measured"] / row["predicted"], rel=1e-3)
        assert isinstance(marker, Points)
        assert (marker.x.tolist(), marker.y.tolist()) == ([record["packing"]], [over])
        chi = float(theory.contact_value(record["packing"]))
        assert np.interp(record["packing"], curve.x, curve.y) == pytest.approx(chi, rel=1e-3)
        assert over == pytest.approx(chi, rel=0.1)  # walls raise the density inside
