"""The main result of a run against a swept key, beside theory."""

import math
from collections.abc import Sequence

import numpy as np

from snooker_cli.analysis.comparison import comparisons_of
from snooker_cli.analysis.decay import decays_of
from snooker_cli.analysis.measurement import Measurement
from snooker_cli.analysis.observables import collisions_per_ball
from snooker_cli.analysis.theories import value_of_start
from snooker_cli.analysis.trend import Trend, trend_of
from snooker_cli.config import ConfigError, Point, unit_of, with_values
from snooker_cli.errors import FigureError, SceneError
from snooker_cli.figures.declared_result import Result
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import (
    BY_THEORY,
    Array,
    FigureData,
    Line,
    Points,
    legend_line,
    more_than_a_decade,
)
from snooker_cli.figures.series import axis_label, changing_with, described
from snooker_cli.formatting import counted
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs.selection import value_at
from snooker_cli.scene import Scene

MOST_NAMED = 3  # points that a caption names


def against_key(build: FigureBuilder) -> FigureData:
    """The main result of each point against the swept key, with theory also between the points."""
    key = build.key
    key_unit = unit_of(build.points[0].config, key)
    drawn: list[Trend] = []
    for index, group in enumerate(build.groups):
        rows = []
        for point in group:
            measurement = build.measurement(point)
            compared, _ = comparisons_of(measurement, decays_of(measurement))
            rows += [{"parameters": point.as_json(), **row.as_json()} for row in compared]
        words = {float(value_at(point, key)): described(point, key) for point in group}
        for trend in filter(None, [trend_of(rows, key, key_unit, words)]):
            drawn.append(trend)
            x, y, error = trend.x, trend.column("measured"), trend.column("error")
            label = build.name_of(group)
            build.lines.append(Points(x, y, error, label, index))
            if trend.theory:
                expected = trend.column("predicted")
                build.cite(trend.quantity, trend.rows[0]["model"])
                build.lines.append(Line(*_curve(build, group, trend), None, index, BY_THEORY))
                build.add_residuals(index, x, y, trend.column("difference_error"), expected)
            for row in trend.rows:
                (point,) = (p for p in group if p.as_json() == row["parameters"])
                build.record(
                    point,
                    value=(row["measured"], row["error"]),
                    theory=row["predicted"],
                    difference=(row["difference"], row["difference_error"]),
                )
    if not drawn:
        raise FigureError(
            f"no two points along {key} have the same main result and theory; sweep more values of "
            "it, or run longer"
        )
    first = drawn[0]
    build.lines += [legend_line(name, BY_THEORY) for name in {t.theory for t in drawn} if name]
    symbol = first.quantity.symbol
    build.result = Result(first.rows[0]["quantity"], "value", theory="theory")
    build.beside_theory = len(drawn) == 1
    seen = f"{first.sentence()}." if build.beside_theory else ""
    build.shows = (
        f"{build.result.name} of each point{', and ' + first.theory if first.theory else ''}."
    )
    x_label = axis_label(build.points[0], key)
    values = np.concatenate([trend.column("measured") for trend in drawn])
    linked = [axis_label(build.points[0], name) for name in changing_with(build.points, key)]
    others = ", ".join(label.partition(" (")[0] for label in linked)
    also = f"Along with it changes: {others}." if linked else ""
    title = f"{symbol} against {x_label.partition(' (')[0]}"
    build.fields = {**build.fields, "title": title}
    return build.figure(
        " ".join(filter(None, [seen, also, _left_out(build)])),
        x_label=x_label,
        y_label=build.result.axis_label,
        logarithmic=more_than_a_decade([values]) and bool(values.min() > 0),
    )


FINE = 100  # places of a curve of theory
MOST_BALLS = 100_000  # balls that are placed for a curve


def _curve(build: FigureBuilder, points: Sequence[Point], trend: Trend) -> tuple[Array, Array]:
    """Places and values of the theory of a trend, between its points too where the start has it.

    What else was measured for a prediction changes it by a factor, which is drawn between points.
    """
    x, predicted = trend.x, trend.column("predicted")
    grid = places_between(build, points[0], trend.key, x)
    known = [point for point in points if float(value_at(point, trend.key)) in x]
    each = [_collisions(build.measurement(point)) for point in known]
    pairs = zip(grid.tolist(), np.interp(grid, x, each), strict=True)
    values = np.array([_at_start(points[0], trend, place, until) for place, until in pairs])
    factors = predicted / values[np.isin(grid, x)]
    if not np.isfinite(factors).all():
        return x, predicted
    finite = np.isfinite(values)
    return grid[finite], values[finite] * np.interp(grid[finite], x, factors)


def _collisions(measurement: Measurement) -> float:
    """The mean number of collisions of a ball with others."""
    pairs = measurement.curve.pair_events[:, -1]
    return float(collisions_per_ball(pairs, measurement.scene.number).mean())


def _at_start(point: Point, trend: Trend, place: float, collisions: float) -> float:
    """The theory of a trend at the start of a point with another value of the key, or nan."""
    scene = start_with(point, trend.key, place)
    if scene is None:
        return math.nan
    value = value_of_start(scene, trend.quantity, trend.rows[0]["model"], collisions)
    return math.nan if value is None else value


def places_between(build: FigureBuilder, point: Point, key: str, x: Array) -> Array:
    """Values of a key from the first to the last of points at x, for a curve of theory.

    They are only those of the points if other keys change with it, or if balls are too many.
    """
    grid = np.linspace(x[0], x[-1], FINE)
    grid = np.union1d(np.round(grid) if isinstance(value_at(point, key), int) else grid, x)
    too_many = len(grid) * build.start(point).number > MOST_BALLS
    return x if changing_with(build.points, key) or too_many else grid


def start_with(point: Point, key: str, place: float) -> Scene | None:
    """A start of a point with another value of a key; ``None`` if its balls have no room."""
    whole = isinstance(value_at(point, key), int)
    try:
        changed = with_values(point.config, {key: int(place) if whole else place})
        return starting_scene(changed, 0)
    except (ConfigError, SceneError):
        return None


def _left_out(build: FigureBuilder) -> str:
    """A sentence on the points that have another main result than the others, or none."""
    shown = [record["parameters"] for record in build.records]
    missing = [build.label(p) or "" for p in build.points if p.as_json() not in shown]
    if not missing:
        return ""
    number = f"{len(missing)} of {counted(len(build.points), 'point')}"
    named = missing if len(missing) <= MOST_NAMED else [*missing[:MOST_NAMED], "others"]
    reason = "without this result or this theory"
    return f"Left out: {number} {reason} ({'; '.join(named)})."
