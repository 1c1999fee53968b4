"""The engine's door: a scene in, a trace out, in chunks so that it can be watched and stopped."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from snooker_cli.engine import endings, engines, epochs, layout, sampling, slide
from snooker_cli.scene import Scene
from snooker_cli.trace import (
    CONTAINER,
    SPEED_BINS,
    Events,
    Series,
    Stop,
    StopReason,
    Summary,
    Trace,
    Work,
    joined,
)

CHUNK = 65536
"""Events between two looks at whether the user wants to stop; some 30 ms of work."""

SMALL_CHUNK = 8192
"""The same for so many balls that their memory is slow."""

NO_LIMIT = 2**62


def simulate(
    scene: Scene,
    *,
    collisions: int | None = None,
    time: float | None = None,
    summary: bool = False,
    watch: Callable[[int], bool] | None = None,
    sink: Callable[[Events], None] | None = None,
    engine: str | None = None,
) -> Trace:
    """Simulate a scene until a number of collisions or a time, whichever comes first.

    collisions : ball-ball and wall collisions together
    time : s
    summary : record observables on a grid of times instead of the events
    watch : called after each chunk with the number of new events; a true answer stops the run
    sink : given the events of each chunk, which it may keep; the trace then has none, so that
        memory stays bounded
    engine : "allpairs" or "cells" instead of what suits the scene

    Raises ``ValueError`` if neither limit is given.
    """
    if collisions is None and time is None:
        raise ValueError("a run needs a number of collisions or a time to end at")
    run = _Run(scene, collisions, time, summary, sink, engine)
    while True:
        before = run.events
        answer = run.chunk()
        stop_wanted = watch is not None and watch(run.events - before)
        if answer != endings.FULL:
            return run.trace(_REASONS[answer])
        if stop_wanted:
            done = run.events >= run.setup.collision_limit
            return run.trace(StopReason.COLLISIONS if done else StopReason.INTERRUPTED)


def specialisation(scene: Scene, *, engine: str | None = None) -> dict[str, bool]:
    """What the kernel is compiled for: only what the scene needs is modelled."""
    in_cells = engines.engine_for(scene, engine) is engines.InCells
    return {
        "cells": in_cells,
        "balls sorted by cells": in_cells and scene.number >= engines.REORDERED,
        "straight walls": scene.shape == "box",
        "periodic images": scene.shape == "periodic",
        "moving container": scene.free,
        "unequal balls": layout.unlike(scene)[0] is not None,
        "sliding along the wall": scene.slides,
    }


_REASONS = {
    endings.COLLISIONS: StopReason.COLLISIONS,
    endings.TIME: StopReason.TIME,
    endings.NOTHING_LEFT: StopReason.NOTHING_LEFT,
    endings.WALL_TRAP: StopReason.WALL_TRAP,
    endings.COLLAPSE: StopReason.COLLAPSE,
}


class _Run:
    """One simulation under way: the kernel's arrays and the chunks recorded so far."""

    def __init__(
        self,
        scene: Scene,
        collisions: int | None,
        time: float | None,
        summary: bool,
        sink: Callable[[Events], None] | None,
        kind: str | None,
    ) -> None:
        self.scene = scene
        self.masses = layout.unlike(scene)[1]
        self.setup = layout.Setup.of(
            scene,
            math.inf if time is None else time,
            NO_LIMIT if collisions is None else collisions,
        )
        self.engine = engines.engine_for(scene, kind)(scene, self.setup)
        self.epoch_length = epochs.length(scene.number)
        self.now = 0.0
        self.grid = sampling.new_grid(scene) if summary else sampling.no_grid()
        self.summary = summary
        self.chunks: list[Events] = []
        self.sink = self.chunks.append if sink is None else sink

    @property
    def events(self) -> int:
        """Collisions so far."""
        return int(self.engine.counts[layout.WALL_EVENTS] + self.engine.counts[layout.PAIR_EVENTS])

    def chunk(self) -> int:
        """Advance by a chunk of events at most; the kernel's answer."""
        before = self.events
        size = CHUNK if self.scene.number < engines.REORDERED else SMALL_CHUNK
        room = min(size, max(1, self.setup.collision_limit))
        room = min(room, self.epoch_length - before % self.epoch_length)
        recorded = layout.room_for(0 if self.summary else room)
        answer = self.engine.advance(recorded, self.grid, room)
        sums, filled = self.engine.sums, slice(self.events - before)
        self.now = float(sums[layout.EPOCH] + sums[layout.NOW])
        if not self.summary:
            time, residual = epochs.times(float(sums[layout.EPOCH]), recorded.time[filled])
            columns = recorded.i[filled], recorded.j[filled], recorded.impulse[filled]
            self.sink(Events(time, *columns, residual))
        if self.events > before and self.events % self.epoch_length == 0:
            epoch, shift = epochs.following(float(sums[layout.EPOCH]), float(sums[layout.NOW]))
            self.engine.set_back(shift)
            sums[layout.EPOCH] = epoch
        return answer

    def trace(self, reason: StopReason) -> Trace:
        """Everything so far, as a finished trace."""
        stop = self._stop(reason)
        return Trace(
            start=self.scene,
            finish=self._finish(self._clock(stop)),
            stop=stop,
            wall_events=int(self.engine.counts[layout.WALL_EVENTS]),
            pair_events=int(self.engine.counts[layout.PAIR_EVENTS]),
            events=joined(self.chunks) if self.chunks else None,
            summary=self._summary(stop) if self.summary else None,
            work=self._work(),
        )

    def _work(self) -> Work:
        """What the engine has done so far."""
        counts = self.engine.counts
        collided = counts[layout.WALL_EVENTS] + 2 * counts[layout.PAIR_EVENTS]
        crossings = counts[layout.CROSSINGS]
        return Work(
            predictions=int(counts[layout.PREDICTIONS]),
            crossings=int(crossings),
            queue_updates=int(collided + crossings + counts[layout.STALE]),
        )

    def _clock(self, stop: Stop) -> float:
        """What clocks show at the end, s."""
        return stop.time - float(self.engine.sums[layout.EPOCH])

    def _finish(self, time: float) -> Scene:
        """The scene when clocks are at ``time``, at or after the last event."""
        balls, container, labels = self.engine.state, self.engine.container, self.engine.labels
        if self.engine.slides is not None:
            balls = balls.copy()
            slide.turn_all(time, balls, self.engine.slides)
        period, origin = layout.period_of(self.scene), layout.origin_of(self.scene)
        positions, velocities = np.empty((2, self.scene.number, 2))
        # Not all at once: of a million balls, new memory would take a third of a second.
        for first in range(0, self.scene.number, SMALL_CHUNK):
            some = slice(first, first + SMALL_CHUNK)
            x, y, u, v, clock = balls[: layout.BALL_ROWS, some]
            velocity, ages = np.column_stack([u, v]), time - clock
            position = np.column_stack([x + u * ages, y + v * ages])
            if period is not None:
                position -= period * np.rint(position / period)
            whose = labels[some] if len(labels) else some
            positions[whose], velocities[whose] = position + origin, velocity
        moved = replace(self.scene, positions=positions, velocities=velocities)
        if container is None:
            return moved
        return replace(
            moved,
            container_position=container[:2] + container[2:4] * (time - container[4]),
            container_velocity=container[2:4].copy(),
        )

    def _stop(self, reason: StopReason) -> Stop:
        """The ending in words."""
        now = self.now
        first, second = (int(ball) for ball in self.engine.counts[[layout.FIRST, layout.SECOND]])
        whom = (
            f"ball {first} and the wall" if second == CONTAINER else f"balls {first} and {second}"
        )
        events = self.events
        kept = "1 collision is kept" if events == 1 else f"{events:,} collisions are kept"
        if reason is StopReason.COLLISIONS:
            return Stop(reason, now, (), f"{events:,} collisions reached at {now:.9g} s")
        if reason is StopReason.TIME:
            limit = self.setup.time_limit
            return Stop(reason, limit, (), f"{limit:.9g} s reached after {events:,} collisions")
        if reason is StopReason.NOTHING_LEFT:
            end = self.setup.time_limit if math.isfinite(self.setup.time_limit) else now
            idle = f"no collision lies ahead after {events:,} and {now:.9g} s"
            return Stop(reason, end, (), idle)
        if reason is StopReason.WALL_TRAP:
            return Stop(
                reason,
                now,
                (first,),
                f"wall trap: from {now:.9g} s on, ball {first} hits the wall infinitely often "
                f"before anything else happens, each hit weaker by the wall's CoR "
                f"{self.setup.wall_restitution:g}; it would slide along the wall; "
                f"{kept}",
            )
        if reason is StopReason.COLLAPSE:
            balls = tuple(ball for ball in (first, second) if ball != CONTAINER)
            return Stop(
                reason,
                now,
                balls,
                f"{self._endless(first, second)}: the clock stands at {now:.17g} s while "
                f"collisions go on, the last of {whom}; {kept}",
            )
        return Stop(reason, now, (), f"interrupted after {events:,} collisions at {now:.9g} s")

    def _endless(self, ball: int, other: int) -> str:
        """What it is that has collisions without end, the last of these two."""
        scene, digit = self.scene, endings.CLOCK_DIGITS * self.now
        if other == CONTAINER and scene.shape == "circle":
            here = self._finish(float(self.engine.sums[layout.NOW]))
            x, y = here.positions[ball] - here.container_position
            u, v = here.velocities[ball] - here.container_velocity
            square = u * u + v * v
            # A chord lasts 2 a v_n/v^2, which here does not move the clock.
            if square > 0.0 and 2.0 * abs(x * u + y * v) <= digit * square:
                return f"ball {ball} moves along the wall and touches it at every moment"
        if scene.restitution == 1.0 and (
            scene.wall_restitution == 1.0 or scene.shape == "periodic"
        ):
            return "collisions without end"
        return "inelastic collapse"

    def _summary(self, stop: Stop) -> Summary:
        """The grid's rows before the end and one more at it."""
        engine, grid, end = self.engine, self.grid, self._clock(stop)
        balls = engine.balls()
        state = (balls, engine.container, self.setup, self.masses, engine.sums, engine.counts)
        row, histogram = np.zeros(sampling.COLUMNS), np.zeros(SPEED_BINS, dtype=np.int64)
        if engine.slides is None:
            sampling.sample_until(end, grid, *state)
        else:
            sliding = balls, self.setup, self.masses, engine.slides
            slide.sample_sliding(end, grid, *sliding, engine.sums, engine.counts)
        sampling.sample(row, histogram, *state)
        if engine.slides is not None:
            row[sampling.WALL_IMPULSE] += slide.pressing(end, *sliding)
        times, rows = sampling.times_and_rows(grid)
        columns = np.ascontiguousarray(np.vstack([grid.rows[rows], row]).T)
        return Summary(
            series=Series(np.append(times, stop.time), *columns),
            speed_histogram=np.vstack([grid.histogram[rows], histogram]),
        )
