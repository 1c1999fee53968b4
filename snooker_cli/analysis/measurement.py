"""Repeats of a point -> what fits, comparisons, tables and figures need of them.

A repeat may have millions of collisions. One pass over them keeps a few numbers, means over windows
of time, and a curve of at most ``ROWS`` rows. All arrays have the repeats as first axis.
"""

import math
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snooker_cli import facts, theory
from snooker_cli.analysis import observables, structure
from snooker_cli.analysis.observables import INSTANT
from snooker_cli.analysis.time_series import (
    AT_WALL,
    BETWEEN,
    KINETIC,
    Averages,
    Collisions,
    Curve,
    TimeSeries,
    has_all,
    series,
)
from snooker_cli.engine import batch_series, is_short, stored_times
from snooker_cli.laws import Sides
from snooker_cli.scene import Scene
from snooker_cli.trace import SPEED_BINS, StopReason, Trace, even_choice

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]

WINDOWS = 20  # windows of time for the local pressure and energy

RELAXING, LEAST_RELAXING = 15, 5
"""Collisions per ball while equal speeds relax; the fewest, where a kurtosis of 1.95 is 1.83."""

SPECIES_STATES = 60  # of a repeat, for the temperatures of its species
STATES = 60  # of a repeat, for quantities of single states

ObservablesOf = Callable[[Scene], Mapping[str, structure.Observable]]
"""The quantities of a gas that have a value in one state, by their names."""


def no_observables(_scene: Scene) -> dict[str, structure.Observable]:
    """No quantities of single states."""
    return {}


MOST_TOGETHER = 2**18  # rows that are measured together, so that they fit in memory


@dataclass(frozen=True)
class Measurement:
    """All that analyses need of the repeats of a point; each array has a row for each repeat.

    scene : the start of the first repeat
    windows, whole, relaxed : averages over ``WINDOWS`` equal windows of time; over all of it; after
        the relaxation, nan in repeats that are too short
    curve : between the times that are fitted
    first_fitted_pressure : (*repeats*, 2) time (s) and mean pressure since the start (Pa m)
        just after ``SKIPPED_COLLISIONS``, or later if no ball has hit the wall; nan in shorter
        repeats
    across : (*repeats*, WINDOWS) as in `observables.shares_across`
    by_side : (*repeats*, WINDOWS, *sides*) as in `observables.wall_energies`, J; nan unless the
        laws of straight walls differ
    rotation_energy : J, see `theory.rotation_energy`, of the balls' angular momentum at the start
        and their places in the end, about the centre of the container; nan outside of circles
    skipped : collisions between balls in the relaxation, see `relaxation`
    first_energy, last_energy, calm_energy : J, of balls with their spins and container at the
        start, at the end and before a collapse
    start_energy, drift_energy : J, of the balls at the start and of their centre of mass
    collision_speed : mean speed of the balls after collisions, m/s; nan unless complete
    speeds : (*repeats*, SPEED_BINS) balls by reduced speed after the relaxation
    species_shares : (*repeats*, 2) mean kinetic energy of a ball of each of two species over that
        of a ball, after the relaxation; nan in repeats that are too short or have no events, and no
        columns for other numbers of species
    species_quarters : (*repeats*, 4, 2) the same over the quarters of the states behind it
    observables : names of quantities of single states
    state_times : (*repeats*, STATES) times of states after the relaxation, of a gas that walls keep
        warm since the start, s; nan where there is no state
    in_states : (*repeats*, STATES, *observables*) the quantities there
    events, calm_events : (*repeats*, 2) collisions at the wall and between balls; the latter before
        a collapse
    time : when each repeat ended, s
    endings : words of ``StopReason``
    """

    scene: Scene
    windows: Averages
    whole: Averages
    relaxed: Averages
    curve: Curve
    first_fitted_pressure: Array
    across: Array
    by_side: Array
    rotation_energy: Array
    skipped: int | None
    first_energy: Array
    last_energy: Array
    calm_energy: Array
    start_energy: Array
    drift_energy: Array
    collision_speed: Array
    speeds: Integers
    species_shares: Array
    species_quarters: Array
    observables: tuple[str, ...]
    state_times: Array
    in_states: Array
    events: Integers
    calm_events: Integers
    time: Array
    endings: "NDArray[Any]"

    def chosen(self, repeats: Flags) -> "Measurement":
        """The measurement of some of the repeats."""
        return self if repeats.all() else _joined([self], lambda columns: columns[0][repeats])

    @property
    def collisions(self) -> Integers:
        """All collisions of each repeat."""
        return np.asarray(self.events.sum(axis=1))

    @property
    def complete(self) -> Flags:
        """Whether each repeat reached its requested end."""
        return np.array([StopReason(ending).complete for ending in self.endings], dtype=bool)


# The relaxation, which all repeats of a point skip


def relaxing(number: int, of_a_ball: int = RELAXING) -> int:
    """Ball-ball collisions in which a gas of ``number`` balls relaxes; none for one ball.

    of_a_ball : as in `observables.collisions_per_ball`
    """
    return math.ceil(of_a_ball * number / 2) if number > 1 else 0


def typical_pairs(repeats: Iterable[tuple[int, bool]]) -> float:
    """Mean number of collisions between balls of the complete repeats, or of all if none is.

    repeats : for each, its collisions between balls and whether it is complete; nan without any
    """
    ended = list(repeats)
    complete = [pairs for pairs, whole in ended if whole]
    counted = complete or [pairs for pairs, _ in ended]
    return sum(counted) / len(counted) if counted else math.nan


def pairs_of(traces: Iterable[Trace]) -> float:
    """The `typical_pairs` of repeats."""
    return typical_pairs((trace.pair_events, trace.stop.reason.complete) for trace in traces)


def relaxation(number: int, pairs: float) -> int | None:
    """Collisions between balls that all repeats of a point skip; ``None`` if there are too few.

    number, pairs : balls; the `typical_pairs` of the point

    The same for all repeats, because one that chose its own would choose by its result. They are 15
    of each ball, but at most half; with fewer than 5, speeds are not mixed.
    """
    if math.isnan(pairs):
        return None
    skipped = min(relaxing(number), math.floor(pairs / 2))
    return skipped if skipped >= relaxing(number, LEAST_RELAXING) else None


def relaxed_at(calm: Trace, skipped: int | None) -> float:
    """Time (s) after the skipped collisions between balls; nan for a repeat that is too short.

    calm : a repeat without the collisions of a collapse

    A repeat that ended early needs 5 more collisions of each ball.
    """
    after = 0 if calm.stop.reason.complete else relaxing(calm.start.number, LEAST_RELAXING)
    if skipped is None or calm.pair_events < skipped + after:
        return math.nan
    if calm.summary is not None:
        columns = calm.summary.series
        time = float(columns.time[np.searchsorted(columns.pair_events, skipped)])
    else:
        assert calm.events is not None
        pairs = np.flatnonzero(calm.events.j >= 0)
        time = float(calm.events.time[pairs[skipped - 1]]) if skipped else 0.0
    return time if time < calm.stop.time else math.nan


# Traces -> a measurement


def measure(
    traces: Iterable[Trace],
    since: float = 0.0,
    until: float = math.inf,
    pairs: float = math.nan,
    observables_of: ObservablesOf = no_observables,
) -> Measurement:
    """What analyses need of the repeats of a point, one or more.

    since, until : times (s) between which the curve lies
    pairs : the `typical_pairs` of the point; without it, there is nothing after the relaxation
    observables_of : what is measured in single states

    Repeats are measured in threads, most of it without Python's lock, while others are read.
    """
    parts: list[Measurement] = []
    waiting: deque[Any] = deque()
    from snooker_cli.runs.processes import processors  # loads multiprocessing

    most = processors()
    with ThreadPoolExecutor(most) as pool:
        for together in _together(traces):
            waiting.append(pool.submit(_measured, together, (since, until), pairs, observables_of))
            if not parts and len(waiting) == 1:
                waiting[0].exception()  # waits: only one thread compiles the kernels
            while len(waiting) > most:
                parts.append(waiting.popleft().result())
        parts += [future.result() for future in waiting]
    return _joined(parts, np.concatenate)


def _joined(parts: Sequence[Measurement], function: Callable[[Any], Any]) -> Measurement:
    """A measurement whose arrays a function makes of those of the parts; the scene is the first."""
    values: dict[str, Any] = {}
    for name, value in vars(parts[0]).items():
        columns = [getattr(part, name) for part in parts]
        if isinstance(value, Averages | Curve):
            values[name] = type(value)(*map(function, zip(*columns, strict=True)))
        else:
            values[name] = function(columns) if isinstance(value, np.ndarray) else value
    return Measurement(**values)


def _together(traces: Iterable[Trace]) -> Iterator[list[Trace]]:
    """The repeats in lists that are measured at once."""
    together, rows = list[Trace](), 0
    for trace in traces:
        together.append(trace)
        rows += trace.collisions + 1
        if rows >= MOST_TOGETHER:
            yield together
            together, rows = [], 0
    if together:
        yield together


# A file may hold values whose squares are no doubles; they give infinities and nan.
@np.errstate(over="ignore", invalid="ignore")
def _measured(
    traces: Sequence[Trace],
    limits: tuple[float, float],
    pairs: float,
    observables_of: ObservablesOf,
) -> Measurement:
    """`measure` of repeats that fit in memory together."""
    scene, skipped = traces[0].start, relaxation(traces[0].start.number, pairs)
    calm = [observables.before_collapse(trace) for trace in traces]
    relaxed = np.array([relaxed_at(trace, skipped) for trace in calm])
    rows, speeds = _series(traces, calm, relaxed)
    shares, quarters = _species_shares(scene, calm, relaxed)
    in_states = observables_of(scene)
    state_times, values = _in_states(in_states.values(), calm, relaxed)
    lasts, starts = np.array([trace.stop.time for trace in traces]), rows.starts
    ends = _calm_ends(rows, traces)
    edges = np.linspace(0.0, lasts, WINDOWS + 1, axis=1)
    windows = rows.averages(edges, starts[1:])
    calm_lasts = np.array([trace.stop.time for trace in calm])
    after = rows.averages(np.stack([relaxed, calm_lasts], axis=1), ends)
    collisions = Collisions(rows, traces)
    curve, first_fitted_pressure = collisions.curve(*limits)
    kinetic = rows.columns[KINETIC]
    energies = kinetic + rows.other_energy
    sides = np.full((len(traces), WINDOWS, len(scene.container.sides)), math.nan)
    if isinstance(scene.wall_law, Sides):
        for k in np.flatnonzero(rows.held).tolist():
            own = kinetic[starts[k] : starts[k + 1]]
            sides[k] = observables.wall_energies(traces[k], own, edges[k])
    return Measurement(
        scene=scene,
        windows=windows,
        whole=windows.from_window(0),
        relaxed=Averages(*(column[:, 0] for column in after)),
        curve=curve,
        first_fitted_pressure=first_fitted_pressure,
        across=np.stack([observables.shares_across(trace, WINDOWS) for trace in traces]),
        by_side=sides,
        rotation_energy=_rotation_energies(traces),
        skipped=skipped,
        first_energy=energies[starts[:-1]],
        last_energy=energies[starts[1:] - 1],
        calm_energy=energies[ends - 1],
        start_energy=kinetic[starts[:-1]],
        drift_energy=rows.drift,
        collision_speed=collisions.mean_speed(),
        speeds=speeds,
        species_shares=shares,
        species_quarters=quarters,
        observables=tuple(in_states),
        state_times=state_times,
        in_states=values,
        events=np.array([(trace.wall_events, trace.pair_events) for trace in traces]),
        calm_events=rows.columns[AT_WALL : BETWEEN + 1, ends - 1].T.astype(np.int64),
        time=lasts,
        endings=np.array([trace.stop.reason.value for trace in traces]),
    )


def _series(
    traces: Sequence[Trace], calm: Sequence[Trace], relaxed: Array
) -> tuple[TimeSeries, Integers]:
    """The series of repeats, and their balls by reduced speed after the relaxation (s)."""
    if all(map(is_short, traces)):
        times = [
            np.empty(0) if math.isnan(since) else observables.sampling_times(trace, since)
            for trace, since in zip(calm, relaxed, strict=True)
        ]
        found, speeds = batch_series(traces, times)
        held = np.ones(len(traces), dtype=bool)
        return TimeSeries(traces, *found, held), speeds
    speeds = np.zeros((len(traces), SPEED_BINS), dtype=np.int64)
    for counts, trace, since in zip(speeds, calm, relaxed, strict=True):
        if not math.isnan(since):
            counts[:] = observables.reduced_speed_counts(trace, since)
    parts = [series(trace) for trace in traces]
    held = np.array([has_all(*pair) for pair in zip(traces, parts, strict=True)])
    time, *values = (
        np.concatenate([getattr(part, name) for part in parts]) for name in parts[0].columns
    )
    starts = np.cumsum([0, *(len(part.time) for part in parts)])
    return TimeSeries(traces, time, np.array(values), starts, held), speeds


def _species_shares(scene: Scene, calm: Sequence[Trace], relaxed: Array) -> tuple[Array, Array]:
    """`Measurement.species_shares` and ``species_quarters``, over states at even collisions."""
    if not facts.hold(scene, "two_species"):
        return np.empty((len(calm), 0)), np.empty((len(calm), 4, 0))
    counts = np.array([len(balls) for balls in structure.species(scene)])
    temperature = partial(structure.species_temperature, walls=facts.hold(scene, "walls"))
    shares, quarters = np.full((len(calm), 2), math.nan), np.full((len(calm), 4, 2), math.nan)
    for repeat, (trace, since) in enumerate(zip(calm, relaxed, strict=True)):
        times = np.empty(0) if trace.snapshots is None else trace.snapshots.time
        if trace.events is not None:
            times = trace.events.time
        if math.isnan(since):
            continue
        times = times[times > since]
        if len(times):
            times = times[even_choice(len(times), SPECIES_STATES)]
            warm = structure.over_time(temperature, trace, times)
            of_states = warm * scene.number / (warm @ counts)[:, np.newaxis]
            shares[repeat] = np.mean(of_states, axis=0)
            if len(times) >= 4:
                quarters[repeat] = [part.mean(axis=0) for part in np.array_split(of_states, 4)]
    return shares, quarters


def _in_states(
    functions: Collection[structure.Observable], calm: Sequence[Trace], relaxed: Array
) -> tuple[Array, Array]:
    """`Measurement.state_times` and ``in_states``, over states at even times, or those stored."""
    times = np.full((len(calm), STATES), math.nan)
    values = np.full((len(calm), STATES, len(functions)), math.nan)
    for repeat, (trace, after) in enumerate(zip(calm, relaxed.tolist(), strict=True)):
        since = 0.0 if facts.hold(trace.start, "warm_walls") else after
        has_states = trace.events is not None or trace.snapshots is not None
        if not functions or not has_states or math.isnan(since):
            continue
        own = np.linspace(since, trace.stop.time, STATES + 1)[1:]
        if trace.events is None:
            stored = stored_times(trace)
            own = stored[stored > since]
            own = own[even_choice(len(own), STATES)]
        times[repeat, : len(own)] = own
        values[repeat, : len(own)] = structure.over_time(
            lambda *state: [function(*state) for function in functions], trace, own
        )
    return times, values


def _calm_ends(rows: TimeSeries, traces: Sequence[Trace]) -> Integers:
    """The end of the rows of each repeat before a collapse, which is all at one instant."""
    ends = rows.starts[1:].copy()
    for repeat, trace in enumerate(traces):
        if trace.stop.reason is StopReason.COLLAPSE:
            own = rows.time[rows.starts[repeat] : ends[repeat]]
            calm = int(np.searchsorted(own, (1 - INSTANT) * trace.stop.time))
            ends[repeat] = rows.starts[repeat] + max(1, calm)
    return ends


def _rotation_energies(traces: Sequence[Trace]) -> Array:
    """`Measurement.rotation_energy` of repeats."""
    scene = traces[0].start  # its centre is the origin
    if scene.number == 1 or not scene.container.keeps_rotation:
        return np.full(len(traces), math.nan)
    ends = [trace.finish for trace in traces]
    places = np.stack([scene.positions - scene.container_position for scene in ends])
    inertia = np.sum(places**2, axis=2) @ scene.masses
    turning = [observables.total_angular_momentum(trace.start) for trace in traces]
    pairs = zip(turning, inertia.tolist(), strict=True)
    return np.array([theory.rotation_energy(*pair) for pair in pairs])
