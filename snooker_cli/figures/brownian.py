"""The path of ball 0; mean squared displacement and velocity autocorrelation of its species."""

import math
from collections.abc import Set
from itertools import pairwise
from typing import Any

import numpy as np

from snooker_cli.analysis import diffusion, quantities, theories
from snooker_cli.analysis.observables import mean_and_error, standard_errors
from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import (
    BY_THEORY,
    EXTRAPOLATED,
    NEUTRAL,
    Array,
    FigureData,
    Layer,
    Line,
    Points,
    Reference,
    legend_line,
    thinned,
)
from snooker_cli.formatting import least_to_most, short
from snooker_cli.scene import EPSILON

BALL = 0  # the tagged ball. Single balls with a position come first, so that it is one of them.
FARTHEST, LAGS = 8.0, 50  # the last lag of velocities, in relaxation times; their number

MOST_STATES = 20_000_000  # of the ball in a figure, which take seconds

SLOPE, OF_TWO, SHORTEST = (5.0, 10.0), 3, -20
"""Lags between which the displacement gives D, in relaxation times; lags from one to its double,
and number of the first lag, which is 0.05 relaxation times, counted from that of 5."""

CLEAR = 2.0  # errors from zero from which on a logarithm is drawn

DOT = 0.25  # a path of less than this share of its container is shown without it
PARTS = 6  # of a path at most, each with the colour and the marker of its time


def tagged_path(build: FigureBuilder) -> FigureData:
    """The path of the ball in the first repeat, as it flies from collision to collision."""
    (point,) = build.points
    trace = next(build.traces(point))
    container = trace.start.container
    times = np.unique(np.append([0.0, trace.stop.time], diffusion.contact_times(trace, BALL)))
    even = _round_times(float(times[-1]))
    shown = np.unique(np.append(times[thinned(times)], even))
    x, y = diffusion.path(trace, BALL, shown)[0].T
    distance, extent = math.hypot(x[-1] - x[0], y[-1] - y[0]), max(np.ptp(x), np.ptp(y))
    around = "" if container.period is None else " The box repeats itself; the path goes on."
    if 0 < extent < DOT * (size := max(container.size)):
        around = f" The {container.title} around the path is {short(size)} m wide and not drawn."
    else:
        corners = container.outline[np.arange(-1, len(container.outline))].T
        build.lines.append(Line(corners[0], corners[1], container.title, NEUTRAL, thin=True))
    ends = np.searchsorted(shown, np.append(0.0, even))
    parts = [*pairwise(ends.tolist())]
    for series, (first, last) in enumerate(parts):
        part = slice(first, last + 1)
        build.lines.append(Line(x[part], y[part], series=series))
    named = ["0", *map(short, even.tolist())]
    build.lines.append(Points(x[:1], y[:1], label="start", series=NEUTRAL, filled=False))
    build.lines += [
        Points(x[[last]], y[[last]], None, f"after {named[series + 1]} s", series)
        for series, (_, last) in enumerate(parts)
    ]
    build.record(point, time=trace.stop.time, distance=distance, collisions=len(times) - 2)
    build.headline = f"{short(distance)} m from its start after {short(trace.stop.time)} s"
    return build.figure(
        f"The first repeat, with every collision of the ball.{around}",
        shades=[series / max(len(parts) - 1, 1) for series in range(len(parts))],
        scale=[f"{begin} to {end}" for begin, end in pairwise(named)],
        scale_label="time (s)",
    )


def _round_times(end: float) -> Array:
    """Up to ``PARTS`` times after the start, s: multiples of 1, 2 or 5 times a power of ten."""
    decade = 10.0 ** math.floor(math.log10(end / PARTS))
    step = next(
        step for step in (decade, 2 * decade, 5 * decade, 10 * decade) if end <= PARTS * step
    )
    return np.append(np.arange(step, end * (1 - EPSILON), step), end)


def mean_squared_displacement(build: FigureBuilder) -> FigureData:
    """The mean squared displacement, its ballistic and its diffusive limit; below, over 4Dt."""
    walls, limits, panel = "", dict[float, str](), list[Layer]([Reference("y", 1.0)])
    longest, tagged = np.empty(0), set[int]()
    for index, point in enumerate(build.points):
        theory, scene = _theory(build, point), build.start(point)
        tau, slope = theory.relaxation_time, np.multiply(SLOPE, theory.relaxation_time)
        span = min(trace.stop.time for trace in build.traces(point)) - diffusion.RELAXING * tau
        most = math.log2(max(slope[1], span / 4) / slope[0])
        lags = slope[0] * 2.0 ** (np.arange(SHORTEST, int(OF_TWO * most) + 1) / OF_TWO)
        rows = _repeats(build, point, lags, tagged)[0]
        limit = math.inf
        if scene.container.period is None:
            limit = diffusion.farthest(scene, BALL)
            limits[limit] = f"random places in the {scene.container.title}"
            walls = " With walls the displacement has a limit."
        flight, far = lags[lags <= tau], 4 * theory.coefficient * lags
        diffusive = (lags >= 2 * tau) & (far <= limit)
        build.lines += [
            Line(flight / tau, theory.mean_square_speed * flight**2, None, index, EXTRAPOLATED),
            Line(lags[diffusive] / tau, far[diffusive], None, index, EXTRAPOLATED),
        ]
        langevin = _langevin(lags / tau)
        free = far * langevin <= limit
        expected = far[free] * langevin[free]
        build.lines.append(Line(lags[free] / tau, expected, None, index, BY_THEORY))
        longest = max(longest, lags / tau, key=len)
        mean, errors = (rows / far).mean(axis=0), standard_errors(rows / far)
        panel.append(Points(lags / tau, mean, errors, None, index))
        low, high = -SHORTEST, OF_TWO - SHORTEST
        rises = (rows[:, high] - rows[:, low]) / (4 * (lags[high] - lags[low]))
        build.add_points(index, build.label(point), lags / tau, rows)
        _record(build, point, rises)
    build.lines += [
        *(Reference("y", most, name) for most, name in limits.items()),
        legend_line("Langevin's equation, Enskog's τ", BY_THEORY),
        legend_line("limits ⟨v²⟩t² and 4Dt", EXTRAPOLATED),
    ]
    panel.append(Line(longest, _langevin(longest), None, NEUTRAL, BY_THEORY))
    return build.figure(
        f"D is from the slope between {SLOPE[0]:g} and {SLOPE[1]:g} τ. {_tagged(tagged)} "
        f"Below: over 4Dt, D of theory.{walls}",
        panel=tuple(panel),
        panel_label="MSD / 4Dt",
    )


def _langevin(time: Array) -> Array:
    """The mean squared displacement over 4Dt by Langevin's equation; times are over τ."""
    return np.asarray(1 + np.expm1(-time) / time)


def velocity_autocorrelation(build: FigureBuilder) -> FigureData:
    """The velocity autocorrelation over ⟨v²⟩ at no delay; below, less an exponential decay."""
    panel, tagged = list[Layer]([Reference("y", 0.0)]), set[int]()
    for index, point in enumerate(build.points):
        theory = _theory(build, point)
        delays = np.linspace(0.0, FARTHEST, LAGS)
        lags = delays * theory.relaxation_time
        rows = _repeats(build, point, lags, tagged)[1]
        law = np.exp(-delays)
        build.lines.append(Line(delays, law, None, index, BY_THEORY))
        integrals = np.trapezoid(rows, lags, axis=1) / 2
        # ⟨v²⟩ is that of the same samples, so that the curve begins at 1.
        square = float(rows[:, 0].mean())
        mean = rows.mean(axis=0) / square
        errors = standard_errors((rows - mean * rows[:, :1]) / square)  # of a ratio of means
        panel.append(Points(delays, mean - law, errors, None, index))
        known = ~(mean <= CLEAR * np.nan_to_num(errors))  # a logarithm of noise shows nothing
        until = slice(len(mean) if known.all() else int(np.argmin(known)))
        label = build.label(point) or "simulation"
        build.lines.append(Points(delays[until], mean[until], errors[until], label, index))
        _record(build, point, integrals)
        build.records[-1]["mean_square_speed"] = square
    build.lines.append(legend_line("exp(−t/τ) with Enskog's τ", BY_THEORY))
    return build.figure(
        f"D is half of the integral up to {FARTHEST:g} τ times ⟨v(0)²⟩. {_tagged(tagged)} "
        f"Markers end where they are within {CLEAR:g} errors of zero; below: all of them, minus "
        "exp(−t/τ).",
        panel=tuple(panel),
        panel_label="minus exp(−t/τ)",
    )


def _tagged(balls: Set[int]) -> str:
    """The sentence on how many balls of a repeat are shown."""
    if balls == {1}:
        return "The tagged ball is ball 0; no other is of its species."
    return f"Means over {least_to_most(balls, str)} balls of the species of ball 0."


def _theory(build: FigureBuilder, point: Point) -> diffusion.Diffusion:
    """What theory expects of the ball. Raises ``FigureError`` for a ball that meets no other."""
    expected = diffusion.expected(build.start(point), BALL)
    if not (0 < expected.relaxation_time < math.inf and expected.mean_square_speed > 0):
        raise FigureError("nothing moves, or one ball is alone, so it does not diffuse")
    return expected


def _repeats(build: FigureBuilder, point: Point, lags: Array, tagged: set[int]) -> Array:
    """Squares and products, (2, *repeats*, *l*); ``FigureError`` if a repeat is too short.

    tagged : gets the number of balls of a repeat
    """
    states = diffusion.MOST_ORIGINS * len(lags)
    build.limit(point, MOST_STATES // len(build.points) // states)
    rows = []
    for trace in build.traces(point):
        balls = diffusion.tagged_balls(trace, len(lags))
        tagged.add(len(balls))
        try:
            rows.append(diffusion.correlations(trace, balls, lags))
        except ValueError as error:
            raise FigureError(str(error)) from None
    return np.array(rows).transpose(1, 0, 2)


def _record(build: FigureBuilder, point: Point, constants: Array) -> None:
    """Record what the repeats (*repeats*,) of a point have as D, m²/s, beside theory."""
    constant, theory = mean_and_error(constants), _theory(build, point)
    build.cite(quantities.DIFFUSION, theories.ENSKOG)
    numbers: dict[str, Any] = {f"theory_{key}": value for key, value in theory._asdict().items()}
    build.record(point, **numbers, diffusion_coefficient=constant)
