"""How a mean and its error come about: from the repeats, and from the hits of the wall."""

import math

import numpy as np

from snooker_cli.analysis import quantities, theories
from snooker_cli.analysis.gas import Gas
from snooker_cli.analysis.observables import mean_and_error
from snooker_cli.analysis.quantities import Quantity, main_quantities
from snooker_cli.analysis.theories import gas_kinds
from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures.counted_parts import CountedParts, measured
from snooker_cli.figures.declared_result import Result
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import (
    BY_THEORY,
    MEASURED,
    NEUTRAL,
    Array,
    Band,
    FigureData,
    Line,
    Panel,
    Points,
    Reference,
    level,
    level_band,
)
from snooker_cli.figures.series import gas_type_of
from snooker_cli.formatting import percent
from snooker_cli.theory import FINITE
from snooker_cli.trace import Trace, even_choice

FEWEST_REPEATS = 8  # of a histogram
FEWEST_BINS = 4
CURVE = 100  # vertices of a curve
HITS = 200  # of the wall, in the first repeat
TIMES = 200  # of a running mean
MOST_REPEATS = 30  # whose hits are added up


def histogram_of_repeats(build: FigureBuilder) -> FigureData:
    """How many repeats have which main result, with the mean, its error and a normal law."""
    parts, (point,) = CountedParts(build), build.points
    quantity, values = _main_result(build, parts, point)
    number, spread = len(values), float(values.std(ddof=1))
    mean, error = mean_and_error(values)
    repeats, edges = np.histogram(values, max(FEWEST_BINS, math.ceil(math.sqrt(number))))
    x, counts = np.append(edges[0], edges), np.pad(repeats, 1).astype(np.float64)
    build.lines.append(Line(x, counts, "number of repeats", 0, steps=True))
    if spread > 0:
        x = np.linspace(mean - 3 * spread, mean + 3 * spread, CURVE)
        normal = np.exp(-(((x - mean) / spread) ** 2) / 2) / (spread * math.sqrt(2 * math.pi))
        expected = normal * number * (edges[1] - edges[0])
        build.lines.append(Line(x, expected, "normal law of this spread", NEUTRAL, BY_THEORY))
    top = np.array([0.0, float(repeats.max())])
    about = np.array([mean - error, mean + error])
    build.lines += [
        Band(about, 0 * top, top[[1, 1]], "mean ± standard error", NEUTRAL),
        Line(np.array([mean, mean]), top, "mean", NEUTRAL),
    ]
    build.result = Result(quantity.name, "value")
    build.shows = f"How single repeats scatter: the number of repeats by their {quantity.words}."
    build.record(point, value=(mean, error), standard_deviation=spread, counted=float(number))
    share = "The standard error is the standard deviation over √n, n the number of repeats."
    return build.figure(
        f"{share} {parts.text if quantity.source == 'means' else ''}".strip(),
        title=f"{quantity.symbol} of each repeat: scatter of {percent(spread / abs(mean))}",
        x_label=build.result.axis_label,
    )


def _main_result(build: FigureBuilder, parts: CountedParts, point: Point) -> tuple[Quantity, Array]:
    """The quantity that says most about a point, and its value in the repeats that have one."""
    gas, constants = parts.gas(point), {}
    if gas_type_of(point) == "cooling":
        constants = {
            (decay.quantity, decay.law): np.array([fit.value for fit in decay.fits])
            for decay in build.energy_decays(point)
        }
    gas = Gas(gas.measurement, constants, gas.first_window)
    most = 0
    for quantity in main_quantities(*gas_kinds(gas.scene)):
        if quantity.measured is None:  # a figure alone has its value
            continue
        with np.errstate(divide="ignore", invalid="ignore"):
            values = measured(gas, quantity)
        values = values[np.isfinite(values)]
        if len(values) >= FEWEST_REPEATS:
            return quantity, values
        most = max(most, len(values))
    raise FigureError(
        f"it needs {FEWEST_REPEATS} or more repeats with a result, and {most} have one"
    )


def wall_impulses(build: FigureBuilder) -> FigureData:
    """The pressure since the start in each repeat, and the impulses on the wall it is made of."""
    parts, (point,) = CountedParts(build), build.points
    build.limit(point, MOST_REPEATS)
    scene, gas = build.start(point), parts.gas(point)
    hits = [_hits(trace) for trace in build.traces(point)]
    if not len(hits[0][0]):
        raise FigureError("nothing hits the wall, so there is no pressure; run longer")
    end = min(trace.stop.time for trace in build.traces(point))
    number = int(np.count_nonzero(hits[0][0] <= end))
    chosen = even_choice(number, HITS)
    time, impulses = (column[chosen] for column in hits[0])
    times = np.linspace(0.0, end, TIMES + 1)[1:]
    sums = [np.append(0.0, np.cumsum(of))[np.searchsorted(at, times, "right")] for at, of in hits]
    build.add_means(0, "simulation", times, np.array(sums) / (scene.container.wall_length * times))
    pressure = mean_and_error(gas.pressure)
    later = np.array([max(0.0, end - float(gas.means.length.mean())), end])
    build.lines.append(level(later, pressure[0], NEUTRAL, MEASURED, "mean P"))
    build.bands.append(level_band(later, *pressure, NEUTRAL))
    law = theories.theory_of(scene, quantities.PRESSURE, FINITE)
    expected = None if law is None else float(np.mean(law.value(gas)))
    if expected is not None:
        name = build.cite(quantities.PRESSURE, FINITE)
        build.lines.append(Reference("y", expected, name, BY_THEORY))
    build.record(
        point,
        pressure=pressure,
        theory=expected,
        mean_impulse=mean_and_error(impulses),
        hits=float(len(impulses)),
    )
    below = Panel((Points(time, impulses),), "J (kg m/s)")
    which = "all" if len(time) == number else "an even choice of"
    caption = f"Below: {which} {len(time)} hits of the wall in the first repeat. {parts.text}"
    return build.figure(caption, panels=(below,))


def _hits(trace: Trace) -> tuple[Array, Array]:
    """Times (s) of the hits of the wall and their impulses, kg m/s."""
    assert trace.events is not None
    at_wall = trace.events.at_wall
    return trace.events.time[at_wall], np.abs(trace.events.impulse[at_wall])
