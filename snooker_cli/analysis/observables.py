"""A trace -> its series over time, temperature, pressure, momentum, distances and speeds."""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from snooker_cli import engine, theory
from snooker_cli.containers import Circle
from snooker_cli.engine import States, replay, replayed
from snooker_cli.engine.replay import Replay
from snooker_cli.memory import MEMORY
from snooker_cli.neighbours import near_pairs
from snooker_cli.scene import TINY, Scene
from snooker_cli.theory import Real
from snooker_cli.trace import (
    SPEED_BIN,
    SPEED_BINS,
    Events,
    Series,
    StopReason,
    Summary,
    Trace,
)

Array = NDArray[np.float64]

INSTANT = 1e-9  # collisions nearer than this share of the time since the start are at one instant

# Limits: the points of a curve; balls times collisions that are measured (about a second); the rows
# of a series (some 300 megabytes). Beyond a limit, an even choice is used.
MOST_POINTS, MOST_MEASURED, MOST_ROWS = 2**16, 2**28, 2**22


def series(trace: Trace) -> Series:
    """The observables at time zero and after each collision; a summary's on its grid.

    They stay in memory with the repeat, because an analysis asks for them several times.
    """
    most = max(2, min(MOST_ROWS, MOST_MEASURED // trace.start.number))
    return MEMORY.get("series", lambda: engine.series(trace, most), trace)


def instants(time: Array) -> NDArray[np.intp]:
    """The last row of each instant; a collapse has many collisions at one instant."""
    return np.flatnonzero(np.append(np.diff(time) > INSTANT * time[1:], True))


def before_collapse(trace: Trace) -> Trace:
    """The repeat without the collisions of a collapse, which are all at one instant.

    A summary keeps the rows of its grid before that instant.
    """
    if trace.stop.reason is not StopReason.COLLAPSE:
        return trace
    summary, end = trace.summary, (1 - INSTANT) * trace.stop.time
    if summary is None:
        assert trace.events is not None
        events = trace.events[: int(np.count_nonzero(trace.events.time < end))]
        at_wall = int(np.count_nonzero(events.at_wall))
        return replace(trace, events=events, wall_events=at_wall, pair_events=len(events) - at_wall)
    rows = max(1, int(np.count_nonzero(summary.series.time < end)))
    calm = summary.series[:rows]
    return replace(
        trace,
        stop=trace.stop._replace(time=float(calm.time[-1])),
        wall_events=int(calm.wall_events[-1]),
        pair_events=int(calm.pair_events[-1]),
        summary=Summary(calm, summary.speed_histogram[:rows]),
    )


def after_collisions(trace: Trace) -> Series:
    """The series at the start and after each collision: a row per instant, ``MOST_POINTS`` at most.

    A summary is interpolated: number j of the m collisions between two rows of its grid is at the
    mean position of the j-th of m random ones, j/(m + 1) of the way, in a gas that cools by Haff's
    law. The collisions between the last two rows of a repeat that ended early, in ever faster
    bounces, are one instant, at its end.
    """
    columns = series(trace)
    if len(columns.time) < 2:
        return columns
    if trace.summary is None:
        rows = 1 + instants(columns.time[1:])
        rows = np.append(0, rows[_evenly(len(rows), MOST_POINTS)])
        return columns[rows]
    events = columns.wall_events + columns.pair_events
    known = int(events[-1] if trace.stop.reason.complete else events[-2])
    number = 1.0 + _evenly(known, MOST_POINTS)
    before = np.searchsorted(events, number) - 1
    order, between = number - events[before], events[before + 1] - events[before]
    speed = np.sqrt(np.where(columns.kinetic_energy > 0, columns.kinetic_energy, 1.0))
    slowing = np.log(speed[before + 1] / speed[before])
    rest = slice(len(events) - (known < events[-1]), None)

    def read(name: str) -> Array:
        column, powers = getattr(columns, name), _POWERS.get(name, 0) * slowing
        part = order / (between + (name == "time"))
        # The sum of q^(px) over x from 0 to a part, over that to 1; q is how speeds change.
        falling = np.where(powers == 0, 1.0, powers)
        part = np.where(powers == 0, part, np.expm1(part * falling) / np.expm1(falling))
        change = column[before + 1] - column[before]
        return np.concatenate([column[:1], column[before] + part * change, column[rest]])

    return Series(**{name: read(name) for name in columns.columns})


_POWERS = dict.fromkeys(("wall_impulse", "pair_virial", "mean_speed"), 1)
_POWERS |= {"time": -1, "kinetic_energy": 2}
"""The power of the speed that a collision changes a column by, as in Haff's law."""


def _evenly(count: int, most: int) -> NDArray[np.intp]:
    """An even choice of at most ``most`` of ``count`` rows, with the first and the last."""
    return np.linspace(0, count - 1, min(count, most)).round().astype(np.intp)


def so_far(trace: Trace, column: Array, times: Array) -> Array:
    """A column of the series that only collisions add to, at times; after collisions at that time.

    column : (*g*,), a column of ``series(trace)``; times : (*n*,), s; the result is (*n*,)

    Between the rows of a summary, or of a series without all collisions, it is interpolated.
    """
    known = series(trace).time
    if not has_all(trace):
        return np.asarray(np.interp(times, known, column))
    values = column[np.searchsorted(known, times, side="right") - 1]
    if trace.start.slides:  # after the last event, balls that slide press steadily
        last = np.interp(times, known[-2:], column[-2:])
        values = np.where(times > known[-2], last, values)
    return np.asarray(values)


def gains(trace: Trace, column: Array, edges: Array) -> Array:
    """What collisions add to a column (*g*,) of the series between edges (*n* + 1,), s; (*n*,)."""
    known = so_far(trace, column, edges)
    if len(edges) and edges[0] == 0:
        known[0] = 0.0  # collisions at time zero count
    return np.diff(known)


def gained(trace: Trace, column: Array, since: float) -> float:
    """What collisions add to a column of the series from a time (s) to the end."""
    return float(gains(trace, column, np.array([since, trace.stop.time]))[0])


def integrals(trace: Trace, values: Array, times: Array) -> Array:
    """Integrals over time of rows of the series, from the start to each time (s)."""
    edges, rows = np.unique(np.append(0.0, times), return_inverse=True)
    parts = time_means(trace, values, edges) * np.diff(edges)
    return np.append(0.0, np.cumsum(parts))[rows[1:]]


def time_means(trace: Trace, values: Array, edges: Array) -> Array:
    """Means over time of a column (*g*,) of the series between edges (*n* + 1,), s; (*n*,).

    The edges increase. A value is constant from one collision to the next; rows that are not
    collisions are interpolated. Each window is computed by itself, because values before it may be
    larger by any factor.
    """
    if len(edges) < 2:
        return np.empty(0)
    known = series(trace).time
    inside = known[(known > edges[0]) & (known < edges[-1])]
    times = np.union1d(inside, edges)
    if has_all(trace):
        held = values[np.searchsorted(known, times[:-1], side="right") - 1]
    else:
        # In the middle of a part, because a value may jump at its ends.
        held = np.interp((times[:-1] + times[1:]) / 2, known, values)
    windows = np.searchsorted(times, edges[:-1])
    # Above the least value, so that a constant has its mean without rounding.
    least = np.minimum.reduceat(held, windows)
    above = held - np.repeat(least, np.diff(np.append(windows, len(held))))
    return np.asarray(least + np.add.reduceat(above * np.diff(times), windows) / np.diff(edges))


def time_mean(trace: Trace, values: Array, since: float = 0.0) -> float:
    """Mean over time of rows of the series, from a time (s) to the end; nan without a span."""
    if not trace.stop.time > since:
        return math.nan
    return float(time_means(trace, values, np.array([since, trace.stop.time]))[0])


def has_all(trace: Trace) -> bool:
    """Whether the series has a row for every collision."""
    rows = 1 + trace.start.slides  # the start, and the end where balls may slide
    return trace.events is not None and len(series(trace).time) == len(trace.events) + rows


# A trace -> energy, temperature and pressure, over time and as means.

NO_WALLS = "no walls: the pressure is (E + ΣJd/2t)/A, with impulses J and distances d of contacts"
"""How a pressure is measured in a periodic box, for its reader."""

ROUNDING = 1e-12  # relative spread below which repeats differ by nothing but rounding


def total_energy(scene: Scene) -> float:
    """Kinetic energy of the balls and the container, J."""
    return scene.kinetic_energy + scene.container_energy


def losses(start: Scene, events: Events) -> float:
    """Energy that collisions take, J: the sum of (1 - e)/(1 + e) J^2/(2 mu), all with one CoR."""
    masses = np.append(start.masses, start.container_mass)  # j = -1 is the last
    e = np.where(events.at_wall, start.wall_restitution, start.restitution)
    inverse = 1 / masses[events.i] + 1 / masses[events.j]
    return float(np.sum((1 - e) / (1 + e) * events.impulse**2 * inverse / 2))


def momentum(velocities: Array, container_velocities: Array, scene: Scene) -> Array:
    """Total momentum of the balls and a free container; (..., 2), kg m/s.

    velocities : (..., *N*, 2), m/s; container_velocities : (..., 2), m/s
    """
    total = np.einsum("...ic,i->...c", velocities, scene.masses)
    return np.asarray(total + scene.container_mass * container_velocities if scene.free else total)


def total_momentum(scene: Scene) -> Array:
    """`momentum` of a scene; (2,), kg m/s."""
    return momentum(scene.velocities, scene.container_velocity, scene)


def total_angular_momentum(scene: Scene) -> float:
    """Angular momentum about the origin, kg m^2/s; a free container counts as a point mass."""
    (x, y), (u, v) = scene.positions.T, scene.velocities.T
    total = float(np.sum(scene.masses * (x * v - y * u)))
    if scene.free:
        (x, y), (u, v) = scene.container_position, scene.container_velocity
        total += scene.container_mass * float(x * v - y * u)
    return total


def rotation_energy(trace: Trace) -> float:
    """Energy of a rigid rotation with the balls' angular momentum at the start, J.

    The places are those in the end, about the centre of the container. See
    `theory.rotation_energy`.
    """
    start, finish = trace.start, trace.finish  # the centre starts at the origin
    places = finish.positions - finish.container_position
    inertia = float(start.masses @ np.sum(places**2, axis=1))
    return theory.rotation_energy(total_angular_momentum(start), inertia)


def complete_repeats(traces: Iterable[Trace]) -> list[Trace]:
    """The repeats that reached their requested end, for averages over events.

    A repeat that ended early lacks its last, slowest collisions, so that its average is biased.
    """
    return [trace for trace in traces if trace.stop.reason.complete]


def mean_speed(trace: Trace) -> float:
    """Mean speed of the balls, averaged over the states after each collision (m/s).

    nan without collisions, and for a repeat that `complete_repeats` leaves out.
    """
    columns = after_collisions(trace)
    known = len(columns.time) > 1 and trace.stop.reason.complete
    return float(columns.mean_speed[1:].mean()) if known else math.nan


def mean_free_path(trace: Trace, since: float = 0.0) -> float:
    """Mean path of a ball between collisions with other balls, from a time (s) to the end, m."""
    columns, length = series(trace), trace.stop.time - since
    pairs = 2 * np.float64(gained(trace, columns.pair_events, since)) / trace.start.number
    return float(time_mean(trace, columns.mean_speed, since) * length / pairs)


def drift_energy(scene: Scene) -> float:
    """Kinetic energy of the balls' centre of mass, p^2/(2 sum m), J; a periodic box keeps it."""
    return float(np.sum((scene.masses @ scene.velocities) ** 2) / (2 * np.sum(scene.masses)))


def meeting_temperature(kinetic_energy: Real, scene: Scene) -> Real:
    """Temperature in the frame of the balls' centre of mass, J, which decides how often they meet.

    Without walls it is (E - E_drift)/(N - 1); with walls it is E/N.
    """
    if scene.container.has_wall or scene.number == 1:
        return kinetic_energy / scene.number
    return (kinetic_energy - drift_energy(scene)) / (scene.number - 1)


def energy_ratio(columns: Series) -> Array:
    """Kinetic energy of balls and container over that at the start; 0 if all is at rest."""
    return over_first(columns.kinetic_energy + columns.container_energy)


def over_first(values: Array) -> Array:
    """Values over the first positive one; unchanged if none is positive."""
    positive = values[values > 0]
    return np.asarray(values / positive[0] if len(positive) else values)


def elastic(scene: Scene) -> bool:
    """Whether no collision of a scene loses or gives energy."""
    gains = scene.pair_law.gains or (scene.container.has_wall and scene.wall_law.gains)
    kept = theory.elastic(scene.restitution, scene.wall_restitution, scene.container)
    return kept and not gains


def standard_errors(rows: Array) -> Array:
    """Standard errors of the means over the first axis of (*n*, ...); nan for one row."""
    if len(rows) < 2:
        return np.full(rows.shape[1:], math.nan)
    return np.asarray(rows.std(axis=0, ddof=1) / math.sqrt(len(rows)))


def mean_and_error(values: Array) -> tuple[float, float]:
    """Mean over the repeats with a value, and its standard error; without a value both are nan.

    The error is nan for one repeat, and for repeats that differ by rounding alone.
    """
    values = values[np.isfinite(values)]
    if not len(values):
        return math.nan, math.nan
    mean, error = float(values.mean()), float(standard_errors(values))
    spread = error * math.sqrt(len(values))
    return mean, math.nan if spread <= ROUNDING * abs(mean) else error


def settled_top(time: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """The largest value after the first tenth of the time: what an axis of a mean needs to show.

    Before, a mean since the start is that of a few hits, and may be many times as large.
    """
    return float(np.max(values[time >= time[0] + 0.1 * (time[-1] - time[0])]))


def cumulative_pressure(trace: Trace, columns: Series) -> tuple[Array, Array]:
    """Times after zero and the mean pressure since the start, s and Pa m, at rows of a series.

    With walls ΣJ/(L t): the impulses on the wall over its full length and the time. Without walls
    (E + ΣJd/(2t))/A, with the mean kinetic energy E and the impulses J and contact distances d of
    collisions between balls.
    """
    scene, later = trace.start, columns.time > 0
    time = columns.time[later]
    if scene.container.has_wall:
        return time, columns.wall_impulse[later] / (scene.container.wall_length * time)
    moving = integrals(trace, series(trace).kinetic_energy, time)
    return time, (moving + columns.pair_virial[later] / 2) / (scene.container.area * time)


def pressures(trace: Trace, edges: Array) -> Array:
    """Mean pressures, Pa m, as in ``cumulative_pressure``, between edges (*n* + 1,), s; (*n*,)."""
    columns, scene, widths = series(trace), trace.start, np.diff(edges)
    if scene.container.has_wall:
        return gains(trace, columns.wall_impulse, edges) / (scene.container.wall_length * widths)
    moving = time_means(trace, columns.kinetic_energy, edges)
    return (moving + gains(trace, columns.pair_virial, edges) / (2 * widths)) / scene.container.area


def mean_pressure(trace: Trace, since: float = 0.0) -> float:
    """Mean pressure from a time (s) to the end, Pa m; 0 without a span."""
    end = trace.stop.time
    return float(pressures(trace, np.array([since, end]))[0]) if end > since else 0.0


def mean_temperature(trace: Trace, since: float = 0.0) -> float:
    """Mean of T = <KE> from a time (s) to the end, J (k_B = 1); nan without a span."""
    return time_mean(trace, series(trace).kinetic_energy / trace.start.number, since)


def ideal_gas_ratio(trace: Trace, since: float = 0.0) -> float:
    """P V / (N T) from a time (s) to the end, with the temperature's mean; 1 for an ideal gas."""
    scene, warm = trace.start, mean_temperature(trace, since)
    if not warm > 0:
        return math.nan
    return mean_pressure(trace, since) * scene.container.area / (scene.number * warm)


def virial_ratio(trace: Trace, since: float = 0.0) -> float:
    """1 + sum J d / (2 N T t) from a time (s) to the end: Z of the balls, with any walls."""
    moving = trace.start.number * mean_temperature(trace, since)
    if not moving > 0:
        return math.nan
    virial = gained(trace, series(trace).pair_virial, since) / (trace.stop.time - since)
    return 1 + virial / (2 * moving)


# States of a trace -> distances and speeds.

MOST_BALLS = 2**22  # balls times states in memory at once, some hundred megabytes
STATES_IN_WINDOW = 5
FIRST_GAP = 0.05  # mean spacings between surfaces, half of the first up to which pairs are searched
COLLISIONS_BETWEEN = 5.0  # collisions of a ball between two times at which its speed counts


def at_collisions(trace: Trace, most: int = 2000) -> States:
    """The states at time zero and after each collision: an even choice of at most ``most``.

    Fewer of many balls, so that they fit in memory. Raises ``ValueError`` without events.
    """
    if trace.events is None:
        raise ValueError("this repeat was recorded as a summary: it has no states to show")
    most = max(2, min(most, MOST_BALLS // trace.start.number))
    rows = _evenly(len(trace.events) + 1, most)
    return replay(trace, np.concatenate([[0.0], trace.events.time])[rows])


def at_equal_steps(trace: Trace, steps: int) -> States:
    """The states in the middle of steps of time that are equally long, over the whole repeat.

    Raises ``ValueError`` without events.
    """
    return replay(trace, (np.arange(steps) + 0.5) * (trace.stop.time / steps))


def central_distances(states: States) -> Array:
    """Distances of the balls from the container's centre; (*t* *N*,), m."""
    offsets = states.positions - states.container_positions[:, None]
    return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]).ravel())


def shares_across(trace: Trace, windows: int) -> Array:
    """Share of the balls' energy in motion across, towards the walls and back, in windows of time.

    In a circle that is along the radius, else along x. (*windows*,), means over a few states in
    each; nan unless walls give energy, and without events.
    """
    scene, shares = trace.start, np.full(windows, math.nan)
    few = min(STATES_IN_WINDOW, MOST_BALLS // (scene.number * windows))
    if not scene.wall_law.gains or trace.events is None or trace.summary is not None or few < 1:
        return shares
    parts = (np.arange(windows * few) + 0.5) / (windows * few)
    states = replay(trace, parts * trace.stop.time)
    across, velocities = states.velocities[..., 0] ** 2, states.velocities
    if isinstance(scene.container, Circle):
        offsets = states.positions - states.container_positions[:, None]
        along = np.einsum("tic,tic->ti", offsets, velocities)
        across = along**2 / np.maximum(np.sum(offsets**2, axis=2), TINY)
    energies = (values @ scene.masses for values in (across, np.sum(velocities**2, axis=2)))
    with np.errstate(invalid="ignore"):
        return np.asarray(np.divide(*energies).reshape(windows, few).mean(axis=1))


def wall_energies(trace: Trace, edges: Array) -> Array:
    """Energy that each straight wall gives to the balls between edges (*n* + 1,), s; J.

    (*n*, *sides*), in the order of ``Container.sides``; nan without all events.
    """
    scene, sides = trace.start, len(trace.start.container.sides)
    given = np.zeros((len(edges) - 1, sides))
    if trace.events is None or trace.summary is not None or not has_all(trace):
        return np.full_like(given, math.nan)
    events, gain = trace.events, np.diff(series(trace).kinetic_energy)
    late = (events.time > edges[0]) | (edges[0] == 0)  # collisions at time zero count
    hits = np.flatnonzero(events.at_wall & late)
    balls = events.i[hits].astype(np.int64)
    after = Replay(trace).states(hits + 1, events.time[hits], balls[:, np.newaxis])[0]
    places = after[:, :2, 0]
    reach = np.array(scene.container.size) / 2 - scene.radii[balls, None]
    gaps = np.hstack([reach + places, reach - places])[:, [0, 2, 1, 3]]  # left, right, bottom, top
    window = np.clip(np.searchsorted(edges, events.time[hits]) - 1, 0, len(edges) - 2)
    np.add.at(given, (window, np.argmin(gaps[:, :sides], axis=1)), gain[hits])
    return given


def pair_distances(states: States, scene: Scene) -> Array:
    """Distances of all pairs of balls, by their nearest images; (*t* *N*(*N*-1)/2,), m."""
    first, second = np.triu_indices(states.positions.shape[1], k=1)
    offsets = states.positions[:, first] - states.positions[:, second]
    offsets = scene.container.nearest_image(offsets)
    return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]).ravel())


def closest(states: States, scene: Scene) -> tuple[float, float]:
    """The least distance of two balls in any of the states, and the farthest that two overlap, m.

    The overlap is negative if none do. Neighbours are found with cells, so that many balls cost
    little; in a periodic box the balls have to be many.
    """
    container, radii = scene.container, scene.radii
    least, overlap, smallest = math.inf, -math.inf, float(radii.min())
    first_gap = FIRST_GAP * math.sqrt(container.area / scene.number)
    for places, centre in zip(states.positions, states.container_positions, strict=True):
        here, gap = math.inf, first_gap
        # Small balls farther apart may have nearer centres than large ones that touch.
        while here - 2 * smallest > gap:
            gap = 2 * gap if here == math.inf else here - 2 * smallest
            for i, j, distances in near_pairs(places - centre, radii, gap, container.period):
                here = min(here, float(distances.min(initial=math.inf)))
                gaps = distances - radii[i] - radii[j]
                overlap = max(overlap, -float(gaps.min(initial=math.inf)))
        least = min(least, here)
    return least, overlap


def sampling_times(trace: Trace, since: float = 0.0) -> Array:
    """Fixed times after ``since`` (s), ``COLLISIONS_BETWEEN`` collisions of a ball apart.

    Speeds then are nearly independent, and not biased towards fast balls as at events.
    """
    length = trace.stop.time - since
    if trace.events is None or trace.summary is not None:
        pairs = gained(trace, series(trace).pair_events, since) if length > 0 else 0.0
    else:  # collisions at time zero count
        first = np.searchsorted(trace.events.time, since, side="right") if since > 0 else 0
        pairs = float(np.count_nonzero(trace.events.j[first:] >= 0))
    if not (length > 0 and pairs > 0):
        return np.empty(0)
    interval = length * (COLLISIONS_BETWEEN * trace.start.number / 2) / pairs
    times = since + np.arange(1, int(length / interval) + 1, dtype=np.float64) * interval
    return np.asarray(np.minimum(times, trace.stop.time))


def reduced_speed_counts(trace: Trace, since: float = 0.0) -> NDArray[np.int64]:
    """Balls by reduced speed v sqrt(m/2T), over the sampling times, in bins of ``SPEED_BIN``."""
    times = sampling_times(trace, since=since)
    if trace.summary is not None:
        rows = np.searchsorted(trace.summary.series.time, times, side="right") - 1
        return np.asarray(trace.summary.speed_histogram[np.unique(rows)].sum(axis=0))
    counts = np.zeros(SPEED_BINS, dtype=np.int64)
    for states in replayed(trace, times):
        energies = 0.5 * trace.start.masses * np.sum(states.velocities**2, axis=2)
        means = energies.mean(axis=1, keepdims=True)
        reduced = np.sqrt(energies / np.where(means > 0, means, 1.0))
        bins = np.fmin(reduced / SPEED_BIN, SPEED_BINS - 1).astype(int)  # also of inf and nan
        counts += np.bincount(bins.ravel(), minlength=SPEED_BINS)
    return counts
