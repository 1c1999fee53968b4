"""Small runs for the tests of figures, and helpers that read figures."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import repeating

from snooker_cli import containers, theory
from snooker_cli.errors import FigureError
from snooker_cli.figures.figure_data import MEASURED, NEUTRAL, Band, FigureData, Line, Reference
from snooker_cli.figures.registry import FIGURES
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection
from snooker_cli.trace import Trace

BASE = """\
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 2, radius: 1.0, speed: 10.0}
cor: 0.9
wall_cor: 1.0
collisions: 200
repeats: 3
"""

ELASTIC = ("cor=1", "record=summary", "container.mass=.inf")

DECAYING = ("cor=0.8,0.9,1.0",)
WARM = (*ELASTIC, "collisions=1000", "balls.radius=0.2,1.0", "balls.speed=5,10,20")

BOX = """\
container: {shape: box, width: 20, height: 14}
balls: {count: 37, radius: 0.6, speed: 10.0}
cor: 0.9
collisions: 400
repeats: 3
sweep: {cor: [0.8, 0.9, 1.0]}
"""

PERIODIC = """\
container: {shape: periodic, width: 30, height: 20}
balls: {count: 64, radius: 0.6, speed: 10.0, speeds: maxwell}
cor: 0.9
wall_cor: 0.5
collisions: 500
repeats: 3
sweep: {cor: [0.8, 0.9, 1.0]}
"""

STORED = """\
container: {shape: periodic, width: 40}
balls: {count: 600, radius: 0.5, speed: 1, start: random}
cor: 0.8
collisions: 30000
repeats: 2
record: snapshots
"""

ROUGH = """\
container: {shape: periodic, width: 200}
balls: {count: 60, radius: 1, speed: 5, speeds: maxwell, start: random}
cor: 0.9
tangential_cor: 0.5
collisions: 1200
repeats: 4
"""

MIXTURE = """\
container: {shape: periodic, width: 24, height: 20}
balls:
  - {count: 30, radius: 0.6, mass: 4.0, speed: 5.0, speeds: maxwell}
  - {count: 30, radius: 0.4, mass: 1.0, speed: 10.0, speeds: maxwell}
cor: 0.7
collisions: 900
repeats: 3
"""

HEATED = """\
container: {shape: channel, width: 20, height: 12}
balls: {count: 40, radius: 0.5, speed: 10.0, speeds: maxwell, start: random}
cor: 1.0
wall_temperature: {left: 50.0, right: 50.0}
collisions: 24000
repeats: 6
sweep: {wall_temperature.right: [50.0, 100.0]}
"""

DRIVEN = """\
container: {radius: 10.0}
balls: {count: 40, radius: 0.2, speed: 40.0, speeds: maxwell, start: random}
cor: 0.9
wall_cor: 1.0
wall_speed: 1.0
collisions: 16000
repeats: 4
sweep: {cor: [0.9, 0.95], balls.radius: [0.1, 0.5]}
"""

ADRIFT = """\
container: {shape: periodic, width: 16, height: 16}
balls:
  list:
    - {position: [-5.0, 1.0], velocity: [9.0, 3.0], radius: 1.0}
    - {position: [-1.0, 0.0], velocity: [6.0, 3.0], radius: 1.0}
    - {position: [4.0, 0.5], velocity: [5.0, 3.0], radius: 1.0}
cor: 0.9
collisions: 60
"""


def made(directory: Path, *overrides: str, text: str = BASE) -> RunFolder:
    """A finished run of a config."""
    run = repeating.made(directory, text, *overrides)
    assert not any(result.error for result in repeating.done(run))
    return run


def traces(run: RunFolder, index: int) -> list[Trace]:
    return list(run.traces(run.points[index]))


def layers(figure: FigureData, layer_type: type[Any]) -> list[Any]:
    return [layer for layer in figure.layers if isinstance(layer, layer_type)]


MADE: dict[str, FigureData] = {}
"""Figures of this session's runs, which do not change."""


def shown(run: RunFolder, name: str, repeat: int | None = None, **where: Any) -> FigureData:
    """A figure of a run, made once."""
    keys = {key.replace("__", "."): value for key, value in where.items()}
    selection = Selection(keys, repeat)
    called = f"{run.directory} {run.name} {name} {selection}"  # runs side by side have one folder
    if called not in MADE:
        MADE[called] = FIGURES[name].make(run, selection)
    return MADE[called]


def why_not(run: RunFolder, name: str, repeat: int | None = None, **where: Any) -> str:
    with pytest.raises(FigureError) as caught:
        shown(run, name, repeat, **where)
    return str(caught.value)


SYMBOLS = "T_rot", "T_tr", "E_th", "k_P", "N_c", "v_x"
"""With an index; names of JSON have longer words around it."""


def check_caption(figure: FigureData) -> None:
    """Assert that a caption has no name of JSON or of a config, and its result the unit."""
    caption = figure.caption
    for symbol in SYMBOLS:
        caption = caption.replace(symbol, "")
    for wrong in (r"\w_\w", r"[a-z]\.[a-z]", r"\w+=", ": from", " at all to ", "nan", "None"):
        assert not re.search(wrong, caption), (figure.kind, figure.caption)
    rows = figure.numbers.get("points", [])
    for name in {*figure.numbers, *(name for row in rows for name in row)} - {"theory"}:
        assert f"{name.replace('_', ' ').capitalize()}:" not in caption, figure.kind
    declared = FIGURES[figure.kind].result
    sentences = figure.caption.split(". ") if declared and declared.unit else []
    for sentence in sentences:
        if declared and re.match(f"{re.escape(declared.name)}( .*)? (=|is) ", sentence):
            values = 1 + (" is between " in sentence)
            assert sentence.count(f" {declared.unit}") >= values, (figure.kind, sentence)


def around(band: Band, curves: list[tuple[Any, Any]], logarithmic: bool = False) -> None:
    """Assert that a band is the mean ± standard deviation of curves, straight between points.

    It goes on as long as two of them remain.

    logarithmic : whether these are of the logarithm
    """
    if logarithmic:
        band = replace(band, low=np.log(band.low), high=np.log(band.high))
    assert band.x[0] == max(time[0] for time, _ in curves)
    assert band.x[-1] == sorted(time[-1] for time, _ in curves)[-2]
    for k in (0, 100, len(band.x) - 1):
        there = [pair for pair in curves if band.x[k] <= pair[0][-1]]
        values = [float(np.interp(band.x[k], time, column)) for time, column in there]
        values = np.log(values) if logarithmic else values
        mean, deviation = np.mean(values), np.std(values, ddof=1)
        # The mean of the ratios to a start of one is 1 there but for rounding.
        assert band.low[k] == pytest.approx(mean - deviation, rel=1e-12, abs=1e-15)
        assert band.high[k] == pytest.approx(mean + deviation, rel=1e-12, abs=1e-15)


def in_circle(temperature: float, radius: float) -> float:
    """Pressure of 19 hard disks in the circle of 10 m, by theory."""
    circle = containers.Circle(10.0)
    return theory.fluid_state(19, temperature, radius, circle).pressure


def unnamed_lines(figure: FigureData) -> list[str]:
    """Lines that neither a name nor a legend's entry explains, with the panel that they are in.

    The even line of a panel of residuals is explained by its axis.
    """
    panels = {figure.y_label: figure.layers, **{p.label: p.layers for p in figure.all_panels}}
    shown = [layer for each in panels.values() for layer in each]
    named = [layer for layer in shown if getattr(layer, "label", None)]
    styles = {
        (layer.style, getattr(layer, "series", NEUTRAL))
        for layer in named
        if isinstance(layer, Line | Reference)
    }
    series = {getattr(layer, "series", NEUTRAL) for layer in named}
    missing = []
    for where, layers_of_panel in panels.items():
        for layer in layers_of_panel:
            if isinstance(layer, Line) and len(layer.x):
                by_series = layer.style == MEASURED and (layer.series in series or figure.scale)
                of_all = any(style == layer.style for style, _ in styles)
                if not (layer.label or by_series or of_all):
                    missing.append(f"{where}: {layer.style} line of series {layer.series}")
            of_axis = where != figure.y_label or (getattr(layer, "style", ""), NEUTRAL) in styles
            if isinstance(layer, Reference) and not (layer.label or of_axis):
                missing.append(f"{where}: {layer.style} at {layer.value}")
    return missing
