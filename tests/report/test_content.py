"""What only the figures of the reproduction show."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from figure_runs import DECAYING, layers, made, shown, traces

from snooker_cli import theory
from snooker_cli.analysis.decay import reported_constant
from snooker_cli.figures.figure_data import Line, Points
from snooker_cli.report.content import figure_data


def test_only_the_reproduction_shows_the_formula_of_the_source_report(tmp_path: Path) -> None:
    run = made(tmp_path / "run", *DECAYING)
    own = shown(run, "decay-against-cor")
    assert "report" not in own.caption + "".join(str(each.label) for each in layers(own, Line))
    found = figure_data({"run": run}, "decay-against-cor", "run")
    assert len(found.layers) == len(own.layers) + 2
    reported, enskog = layers(found, Line)[:2]
    assert reported.label == "k by the source report"
    for index in (0, 1):
        constants = [reported_constant(trace) for trace in traces(run, index)]
        assert reported.y[index] == pytest.approx(np.mean(constants), rel=1e-14)
        assert found.numbers["points"][index]["report_k"] == reported.y[index]
    k = layers(own, Points)[0]
    assert reported.series == enskog.series == k.series
    assert enskog.label == "k, mean free path after Enskog"
    assert "Enskog's λ = 1/(√2 n 4rχ), χ for the size of the balls" in found.caption
    density, contact = 19 / (100 * math.pi), float(theory.contact_value(0.19))
    path = theory.mean_free_path(density, 1.0, contact)
    speed = theory.fixed_energy_mean_speed(19, 50.0)
    assert enskog.y[0] == pytest.approx(-2 * math.log(0.8) * speed / path, rel=1e-12)
