"""A tagged ball, ball 0: its path, mean squared displacement and velocity autocorrelation."""

import math
from typing import Any

import numpy as np

from snooker_cli.analysis import diffusion
from snooker_cli.analysis.observables import mean_and_error
from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import FigureBuilder
from snooker_cli.figures.figure_data import (
    NEUTRAL,
    Array,
    FigureData,
    Line,
    Points,
    Reference,
    legend_line,
    thinned,
)
from snooker_cli.formatting import short

BALL = 0  # the tagged ball. Single balls with a position come first, so that it is one of them.
FARTHEST, LAGS = 8.0, 50  # the last lag of velocities, in relaxation times; their number

MOST_STATES = 20_000_000  # of the ball in a figure, which take seconds

SLOPE, OF_TWO, SHORTEST = (5.0, 10.0), 3, -20
"""Lags between which the displacement gives D, in relaxation times; lags from one to its double,
and number of the first lag, which is 0.05 relaxation times, counted from that of 5."""

DOT = 0.1  # a path of less than this share of its container is shown without it


def tagged_path(build: FigureBuilder) -> FigureData:
    """The path of the ball in the first repeat, as it flies from collision to collision."""
    (point,) = build.points
    trace = next(build.traces(point))
    container = trace.start.container
    times = np.unique(np.append([0.0, trace.stop.time], diffusion.contact_times(trace, BALL)))
    x, y = diffusion.path(trace, BALL, times[thinned(times)])[0].T
    distance, extent = math.hypot(x[-1] - x[0], y[-1] - y[0]), max(np.ptp(x), np.ptp(y))
    around = "" if container.period is None else " The box repeats itself; the path goes on."
    if 0 < extent < DOT * (size := max(container.size)):
        around = f" The {container.title} around the path is {short(size)} m wide and not drawn."
    else:
        corners = container.outline[np.arange(-1, len(container.outline))].T
        build.lines.append(Line(corners[0], corners[1], container.title, NEUTRAL, "dashed"))
    build.lines += [
        Line(x, y, f"ball {BALL}"),
        Points(x[:1], y[:1], label="start", filled=False),
        Points(x[-1:], y[-1:], label="end", series=1),
    ]
    build.record(point, time=trace.stop.time, distance=distance, collisions=len(times) - 2)
    return build.figure(
        f"The first repeat, with every collision of the ball.{around}",
    )


def mean_squared_displacement(build: FigureBuilder) -> FigureData:
    """The mean squared displacement, its ballistic and its diffusive limit."""
    walls, limits = "", dict[float, str]()
    for index, point in enumerate(build.points):
        theory, scene = _theory(build, point), build.start(point)
        tau, slope = theory.relaxation_time, np.multiply(SLOPE, theory.relaxation_time)
        span = min(trace.stop.time for trace in build.traces(point)) - diffusion.RELAXING * tau
        most = math.log2(max(slope[1], span / 4) / slope[0])
        lags = slope[0] * 2.0 ** (np.arange(SHORTEST, int(OF_TWO * most) + 1) / OF_TWO)
        rows = _repeats(build, point, lags)[0]
        flight, diffusive = lags[lags <= 3 * tau], lags[lags >= tau / 2]
        build.lines += [
            Line(flight, theory.mean_square_speed * flight**2, None, index, "dashed"),
            Line(diffusive, 4 * theory.coefficient * diffusive, None, index, "dotted"),
        ]
        if scene.container.period is None:
            name = f"random places in the {scene.container.title}"
            limits[diffusion.farthest(scene, BALL)] = name
            walls = " With walls the displacement has a limit."
        low, high = -SHORTEST, OF_TWO - SHORTEST
        rises = (rows[:, high] - rows[:, low]) / (4 * (lags[high] - lags[low]))
        _add(build, point, index, lags, rows, rises)
    build.lines += [
        *(Reference("y", most, name) for most, name in limits.items()),
        legend_line("ballistic, ⟨v²⟩t²", "dashed"),
        legend_line("diffusive, 4Dt with Enskog's D", "dotted"),
    ]
    return build.figure(
        f"D is from the slope between {SLOPE[0]:g} and {SLOPE[1]:g} relaxation times.{walls}"
    )


def velocity_autocorrelation(build: FigureBuilder) -> FigureData:
    """The velocity autocorrelation over the measured ⟨v²⟩ at no delay, and exponential decay."""
    for index, point in enumerate(build.points):
        theory = _theory(build, point)
        lags = np.linspace(0.0, FARTHEST, LAGS) * theory.relaxation_time
        rows = _repeats(build, point, lags)[1]
        law = np.exp(-lags / theory.relaxation_time)
        build.lines.append(Line(lags, law, None, index, "dashed"))
        integrals = np.trapezoid(rows, lags, axis=1) / 2
        # ⟨v²⟩ is that of the same samples, so that the curve begins at 1.
        _add(build, point, index, lags, rows / rows[:, 0].mean(), integrals)
        build.records[-1]["mean_square_speed"] = float(rows[:, 0].mean())
    build.lines += [Reference("y", 0.0), legend_line("exp(−t/τ) with Enskog's τ", "dashed")]
    return build.figure("Half of the integral times ⟨v(0)²⟩ is D.")


def _theory(build: FigureBuilder, point: Point) -> diffusion.Diffusion:
    """What theory expects of the ball. Raises ``FigureError`` for a ball that meets no other."""
    expected = diffusion.expected(build.start(point), BALL)
    if not (0 < expected.relaxation_time < math.inf and expected.mean_square_speed > 0):
        raise FigureError("nothing moves, or one ball is alone, so it does not diffuse")
    return expected


def _repeats(build: FigureBuilder, point: Point, lags: Array) -> Array:
    """Squares and products, (2, *repeats*, *l*); ``FigureError`` if a repeat is too short."""
    states = diffusion.MOST_ORIGINS * len(lags)
    build.limit(point, MOST_STATES // len(build.points) // states)
    try:
        rows = [diffusion.correlations(trace, BALL, lags) for trace in build.traces(point)]
    except ValueError as error:
        raise FigureError(str(error)) from None
    return np.array(rows).transpose(1, 0, 2)


def _add(
    build: FigureBuilder, point: Point, index: int, lags: Array, rows: Array, constants: Array
) -> None:
    """Add the means of a point, and what its repeats (*repeats*,) have as D, m²/s."""
    build.add_points(index, build.label(point), lags, rows)
    constant, theory = mean_and_error(constants), _theory(build, point)
    numbers: dict[str, Any] = {f"theory_{key}": value for key, value in theory._asdict().items()}
    build.record(point, **numbers, diffusion_coefficient=constant)
