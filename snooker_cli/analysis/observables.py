"""Scenes, states and traces -> energy, momentum, distances, and speeds; means with errors."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from snooker_cli.engine import States, replay, replayed
from snooker_cli.engine.replay import Replay
from snooker_cli.laws import SIDES
from snooker_cli.scene import TINY, Scene
from snooker_cli.theory import Real
from snooker_cli.trace import (
    SPEED_BIN,
    SPEED_BINS,
    Events,
    StopReason,
    Summary,
    Trace,
    even_choice,
)

Array = NDArray[np.float64]

INSTANT = 1e-9  # collisions nearer than this share of the time since the start are at one instant


def instants(time: Array) -> NDArray[np.intp]:
    """The last row of each instant; a collapse has many collisions at one instant."""
    return np.flatnonzero(np.append(np.diff(time) > INSTANT * time[1:], True))


def collisions_per_ball(pair_events: Array, number: int) -> Array:
    """How often a ball met another one, in the mean: twice the collisions between balls over N.

    Hits of the wall do not count. All documents, figures and the relaxation have this meaning.
    """
    return 2 * pair_events / number


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


# A trace -> energy, temperature and pressure, over time and as means.

NO_WALLS = "no walls: the pressure is (E + ΣJd/2t)/A, with impulses J and distances d of contacts"
"""How a pressure is measured in a periodic box, for its reader."""

ROUNDING = 1e-12  # relative spread below which repeats differ by nothing but rounding


def total_energy(scene: Scene) -> float:
    """Kinetic energy of the balls, with their spins, and of the container, J."""
    return scene.kinetic_energy + scene.container_energy + scene.spin_energy


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
    """Angular momentum about the origin, kg m^2/s, with that of spins.

    A free container counts as a point mass.
    """
    (x, y), (u, v) = scene.positions.T, scene.velocities.T
    total = float(np.sum(scene.masses * (x * v - y * u)))
    if scene.surface is not None and scene.spins is not None:
        moments = scene.surface.inertia * scene.masses * scene.radii**2
        total += float(moments @ scene.spins)
    if scene.free:
        (x, y), (u, v) = scene.container_position, scene.container_velocity
        total += scene.container_mass * float(x * v - y * u)
    return total


def meeting_temperature(
    kinetic_energy: Real, scene: Scene, drift: Real | float | None = None
) -> Real:
    """Temperature in the frame of the balls' centre of mass, J, which decides how often they meet.

    drift : E_drift of that centre, J; by default that of the scene

    Without walls it is (E - E_drift)/(N - 1); with walls it is E/N.
    """
    if scene.container.has_wall or scene.number == 1:
        return kinetic_energy / scene.number
    moving = scene.drift_energy if drift is None else drift
    return (kinetic_energy - moving) / (scene.number - 1)


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


# States of a trace -> distances and speeds.

MOST_BALLS = 2**22  # balls times states in memory at once, some hundred megabytes
STATES_IN_WINDOW = 5
COLLISIONS_BETWEEN = 5.0  # collisions of a ball between two times at which its speed counts


def at_collisions(trace: Trace, most: int = 2000) -> States:
    """The states at time zero and after each collision: an even choice of at most ``most``.

    Fewer of many balls, so that they fit in memory. Raises ``ValueError`` without events.
    """
    if trace.events is None:
        raise ValueError("this repeat was recorded as a summary: it has no states to show")
    most = max(2, min(most, MOST_BALLS // trace.start.number))
    rows = even_choice(len(trace.events) + 1, most)
    return replay(trace, np.concatenate([[0.0], trace.events.time])[rows])


def at_equal_steps(trace: Trace, steps: int) -> States:
    """The states in the middle of steps of time that are equally long, over the whole repeat.

    Raises ``ValueError`` without events.
    """
    return replay(trace, (np.arange(steps) + 0.5) * (trace.stop.time / steps))


def central_distances(states: States) -> Array:
    """Distances of the balls from the container's centre; (*t* *N*,), m."""
    offsets = states.positions - states.container_position[:, None]
    return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]).ravel())


def shares_across(trace: Trace, windows: int) -> Array:
    """Share of the balls' energy in motion across, towards the walls and back, in windows of time.

    Along ``Container.across``. (*windows*,), means over a few states in each; nan unless walls give
    energy, without events, and in a container without such a direction.
    """
    scene, shares = trace.start, np.full(windows, math.nan)
    few = min(STATES_IN_WINDOW, MOST_BALLS // (scene.number * windows))
    has_all = trace.events is not None and trace.summary is None
    if not (scene.wall_law.adds_energy and has_all) or few < 1:
        return shares
    if (direction := scene.container.across) is None:
        return shares
    parts = (np.arange(windows * few) + 0.5) / (windows * few)
    states = replay(trace, parts * trace.stop.time)
    velocities = states.velocities
    across = velocities[..., "xy".find(direction)] ** 2
    if direction == "radius":
        offsets = states.positions - states.container_position[:, None]
        along = np.einsum("tic,tic->ti", offsets, velocities)
        across = along**2 / np.maximum(np.sum(offsets**2, axis=2), TINY)
    energies = (values @ scene.masses for values in (across, np.sum(velocities**2, axis=2)))
    with np.errstate(invalid="ignore"):
        return np.asarray(np.divide(*energies).reshape(windows, few).mean(axis=1))


def wall_energies(trace: Trace, kinetic_energy: Array, edges: Array) -> Array:
    """Energy that each straight wall gives to the balls between edges (*n* + 1,), s; J.

    kinetic_energy : J, of the balls at the start and after each event of a repeat with events

    (*n*, *sides*), in the order of ``Container.sides``.
    """
    scene, events = trace.start, trace.events
    assert events is not None
    sides = [SIDES.index(side) for side in scene.container.sides]
    given, gain = np.zeros((len(edges) - 1, len(sides))), np.diff(kinetic_energy)
    late = (events.time > edges[0]) | (edges[0] == 0)  # collisions at time zero count
    hits = np.flatnonzero(events.at_wall & late)
    balls = events.i[hits].astype(np.int64)
    after = Replay(trace).states(hits + 1, events.time[hits], balls[:, np.newaxis])[0]
    places = after[:, :2, 0]
    reach = np.array(scene.container.size) / 2 - scene.radii[balls, None]
    gaps = np.hstack([reach + places, reach - places])[:, [0, 2, 1, 3]]  # as in ``SIDES``
    window = np.clip(np.searchsorted(edges, events.time[hits]) - 1, 0, len(edges) - 2)
    np.add.at(given, (window, np.argmin(gaps[:, sides], axis=1)), gain[hits])
    return given


def pair_distances(states: States, scene: Scene) -> Array:
    """Distances of all pairs of balls, by their nearest images; (*t* *N*(*N*-1)/2,), m."""
    first, second = np.triu_indices(states.positions.shape[1], k=1)
    offsets = states.positions[:, first] - states.positions[:, second]
    offsets = scene.container.nearest_image(offsets)
    return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]).ravel())


def sampling_times(trace: Trace, since: float = 0.0) -> Array:
    """Fixed times after ``since`` (s), ``COLLISIONS_BETWEEN`` collisions of a ball apart.

    Speeds then are nearly independent, and not biased towards fast balls as at events.
    """
    length = trace.stop.time - since
    if trace.summary is not None:
        known = trace.summary.series
        pairs = float(known.pair_events[-1])
        if since > 0:  # collisions at time zero count
            pairs -= float(np.interp(since, known.time, known.pair_events))
    else:
        assert trace.events is not None  # collisions at time zero count
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
