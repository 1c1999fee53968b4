"""What values a repeat can have: the writer and the reader both check them here.

So no file gets its name that would be refused when it is read. What is checked needs no simulation:
each value has a range, which follows from the start, and times have an order. Every function and
method raises ``UnsoundError`` for a wrong value.
"""

import math
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import LEAST_TIME, MOST_SPEED, Circle
from snooker_cli.errors import SceneError, UnsoundError
from snooker_cli.laws import Sides
from snooker_cli.scene import EPSILON, Scene, check_speeds, sizes_are_possible
from snooker_cli.trace import CONTAINER, SLIDE, Events, Stop, StopReason, Summary, Trace

GROWING = ("time", "wall_impulse", "pair_virial", "wall_events", "pair_events")  # of a summary
GIVEN = ("wall_energy", "lost_energy")  # of a summary; rounding makes them negative
SUM_ROUNDING = 1e-9  # by which a sum may seem to shrink

SUMMARY_ROWS = 10_000  # of a repeat, at most; the engine makes fewer

WITH_RANGES = {"time", "i", "j", "impulse", "tangential", "residual"}
"""The columns of events that `EventCheck` knows; others are finite."""

MOST = 1e200  # J, kg m/s and so on, where the energy at the start is no limit


def require(holds: object, what: str) -> None:
    """Raise ``UnsoundError`` for what no simulation gives."""
    if not holds:
        raise UnsoundError(f"wrong {what}")


def fault_of(trace: Trace) -> str:
    """What is wrong with a repeat in memory, as an error names it; empty if it is sound."""
    try:
        check_repeats([trace])
        if trace.events is not None:
            check = EventCheck.from_start(trace.start)
            check.take(trace.events)
            check.end(trace)
    except UnsoundError as error:
        return error.problem
    return ""


def check_repeats(traces: Sequence[Trace]) -> None:
    """Check all values of repeats of one point but their events and their snapshots."""
    first = traces[0].start
    sizes = first.radii, first.masses, [*first.container.lengths.values()]
    require(sizes_are_possible(*sizes), "radius, mass or length")
    require(first.container_mass > 0, "mass of the container")
    fixed, law = math.isinf(first.container_mass), first.wall_law
    require(not first.slides or (fixed and isinstance(first.container, Circle)), "rules")
    require(fixed or not law.adds_energy, "rules")
    require(not isinstance(law, Sides) or bool(first.container.sides), "rules")
    scenes = [scene for trace in traces for scene in (trace.start, trace.finish)]
    check_motion(first, scenes)
    with _scene_errors():
        starts, spins = scenes[::2], [scene.spins for scene in scenes[::2]]
        velocities = np.array([scene.velocities for scene in starts])
        check_speeds(first, velocities, None if spins[0] is None else np.array(spins))
    for trace in traces:
        check_ending(trace.stop, trace.wall_events, trace.pair_events)
        require(all(ball < first.number for ball in trace.stop.balls), "balls in an ending")
        energy = most_energy(trace.start)
        require(energy_of(trace.finish) <= energy, "speed of a ball")
        if trace.summary is not None:
            check_summary(trace.summary, trace, energy)


@contextmanager
def _scene_errors() -> Iterator[None]:
    """Inside, a ``SceneError`` becomes an ``UnsoundError``."""
    try:
        yield
    except SceneError as error:
        raise UnsoundError(error.problem) from None


def check_motion(first: Scene, scenes: Sequence[Scene]) -> None:
    """Check the places and spins of balls, and the motion of the container.

    first : one of the scenes, for what all have in common
    """
    with _scene_errors():
        first.container.check_radii(first.radii)
    places = np.array([[scene.container_position] for scene in scenes])
    speeds = np.array([scene.container_velocity for scene in scenes])
    require(np.all(np.abs(speeds) <= MOST_SPEED), "speed of the container")
    positions = np.array([scene.positions for scene in scenes])
    room = max(first.container.size) + 4 * EPSILON * np.abs(places)
    with np.errstate(all="ignore"):
        require(np.all(np.abs(positions - places) <= room), "place of a ball")
        if first.spins is not None:
            spins = np.array([scene.spins for scene in scenes])
            require(np.all(first.masses * (first.radii * spins) ** 2 < math.inf), "spin of a ball")


def energy_of(scene: Scene) -> float:
    """The energy of the balls, J; infinite or no number if that of a ball is."""
    with np.errstate(over="ignore", invalid="ignore"):
        return scene.kinetic_energy + scene.spin_energy


def most_energy(start: Scene) -> float:
    """The most energy that a repeat with this start has at any time, J."""
    if start.wall_law.adds_energy:
        return MOST
    with np.errstate(over="ignore", invalid="ignore"):
        return 2 * (energy_of(start) + start.container_energy)  # 2 for rounding in all collisions


def check_ending(stop: Stop, wall_events: int, pair_events: int) -> None:
    """Check how a repeat ended, also the types, and its collisions of both types."""
    sound, time = type(stop.message) is str, stop.time
    for number in (wall_events, pair_events, *stop.balls):
        sound &= type(number) is int and number >= 0
    for value in (time, stop.accumulation_time, stop.impulse_to_come):
        sound &= value is None or (type(value) in (float, int) and 0 <= value < math.inf)
    # Balls that touch may collide, or be trapped, at time zero.
    sound = sound and time is not None and (time >= LEAST_TIME or time == 0)
    require(sound and (time > 0 or stop.reason is not StopReason.TIME), "ending")


class EventCheck:
    """Checks the events of a repeat, piece by piece.

    balls : their number
    slides : whether they may slide
    most : the largest impulse of a collision, kg m/s
    number, at_wall : of sound events so far; those before a wrong one count
    """

    def __init__(self, balls: int, *, slides: bool, most: float = sys.float_info.max) -> None:
        self.balls, self.most = balls, most
        self.least_partner = SLIDE if slides else CONTAINER
        self.number = self.at_wall = 0
        self.last = 0.0  # time of the last event, s

    @classmethod
    def from_start(cls, start: Scene) -> "EventCheck":
        """The check of a repeat with this start.

        A speed of approach v has an energy of m v^2/2 at least, and an impulse of 2 m v at most.
        So has a slip, whose m is less.
        """
        most = 2 * math.sqrt(2 * most_energy(start) * float(np.max(start.masses)))
        return cls(start.number, slides=start.slides, most=min(most, sys.float_info.max))

    def resume(self, number: int, at_wall: int, last: float) -> None:
        """Go on after events that were checked before; the last of them is at a time, s."""
        self.number, self.at_wall, self.last = number, at_wall, last

    def take(self, events: Events) -> None:
        """Check the next events."""
        if len(events) == 0:
            return
        checked = self._soundness(events)
        wrong = {what: int(np.argmin(sound)) for what, sound in checked if not sound.all()}
        first = min(wrong.values(), default=len(events))
        self.number += first
        self.at_wall += int(np.count_nonzero(events.j[:first] < 0))
        for what, row in wrong.items():
            require(row > first, what)
        self.last = float(events.time[-1])

    def _soundness(self, events: Events) -> Iterator[tuple[str, NDArray[np.bool_]]]:
        """What may be wrong, and whether it is right in each event."""
        time, i, j, impulse = events.time, events.i, events.j, events.impulse
        # Replaying writes to the arrays of these balls.
        known = (i >= 0) & (j >= self.least_partner) & (np.maximum(i, j) < self.balls)
        yield "ball in an event", known & (i != j)
        ascends = (time == 0) | ((time >= LEAST_TIME) & (time < math.inf))
        ascends[0] &= time[0] >= self.last
        ascends[1:] &= time[1:] >= time[:-1]
        yield "order of the times of events", ascends
        if events.residual is not None:
            small = np.abs(events.residual) <= 2 * EPSILON * np.abs(time)
            yield "residual of a time", small
        most: Any = self.most
        if self.least_partner == SLIDE:  # these have the impulse of infinitely many bounces
            most = np.where(j == SLIDE, max(MOST, most), most)
        yield "impulse of an event", (impulse >= 0) & (impulse <= most)
        if events.tangential is not None:
            yield "tangential impulse of an event", np.abs(events.tangential) <= most
        for name in events.columns.keys() - WITH_RANGES:
            yield f"{name} of an event", np.isfinite(events.columns[name])

    def end(self, trace: Trace) -> None:
        """Check that these are all events of a repeat, up to its end."""
        require(self.last <= trace.stop.time, "end, which is before an event")
        require(self.number == trace.collisions, "number of events")
        require(self.at_wall == trace.wall_events, "number of events at the wall")


def check_summary(summary: Summary, trace: Trace, energy: float) -> None:
    """Check a summary.

    energy : the most that the repeat has at any time, J
    """
    counts = summary.speed_histogram
    require(len(counts) <= SUMMARY_ROWS, "rows of its summaries")
    energies = ("kinetic_energy", "container_energy", "spin_energy")
    most = dict.fromkeys(energies, energy) | {"time": trace.stop.time}
    most |= {name: getattr(trace, name) for name in ("wall_events", "pair_events")}
    for name, values in summary.series.columns.items():
        least = -MOST if name in GIVEN else 0.0
        sound = len(values) and values.min() >= least and values.max() <= most.get(name, MOST)
        if name in GROWING:
            sound = sound and np.all(values[1:] >= (1 - SUM_ROUNDING) * values[:-1])
        require(sound, f"{name} of a summary")
    first = summary.series.kinetic_energy[0]  # by which others are divided
    require(2 * first >= trace.start.kinetic_energy, "kinetic_energy of a summary")
    in_range = counts.min() >= 0 and counts.max() <= trace.start.number
    require(in_range, "speed_histogram of a summary")


def check_snapshot_times(times: NDArray[np.float64], end: float) -> None:
    """Check the times of all snapshots of a repeat that ends at a time, s."""
    ascend = len(times) and np.all(np.diff(times) > 0) and times[0] > 0 and times[-1] <= end
    require(ascend, "times of snapshots")


def check_snapshot(start: Scene, state: Scene) -> None:
    """Check the state of a snapshot of a repeat with this start."""
    check_motion(start, [state])
    require(energy_of(state) <= most_energy(start), "speed of a ball in a snapshot")
