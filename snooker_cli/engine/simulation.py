"""The engine's door: a scene in, a trace out, in chunks so that it can be watched and stopped."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from snooker_cli.containers import Box, Circle
from snooker_cli.engine import (
    all_pairs,
    cell_grid,
    cell_prediction,
    cells,
    clock,
    event_queue,
    kernel_state,
    sampling,
    sliding,
)
from snooker_cli.engine.clock import CELL_FULL, FULL, NOTHING_LEFT, OUT_OF_MARGIN
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

if TYPE_CHECKING:
    from snooker_cli.engine.kernel_state import Floats, Indices, Integers, Recorded
    from snooker_cli.engine.sampling import Grid
    from snooker_cli.scene import Scene


# The two engines, each with the arrays of one simulation: all pairs for few balls, else cells.

REORDERED = 4096
"""Balls from which on those in neighbouring cells are kept near each other in memory."""

REORDER_AFTER = 20
"""Events a ball after which balls are put into the order of their cells again."""

FEW, FEW_IN_FREE, MOST = 45, 150, 400
"""Balls up to which all pairs are faster than cells, times the packing's fourth root; at most."""

BALLS_A_CELL, DILUTE = 1.0, 0.4
"""Balls to a cell in a packed gas, and in a dilute one, there over the cube root of the packing."""

MARGIN = 0.1
"""How far a free container may move until all is predicted again, of a cell's side."""

RENEWAL = 400
"""Crossings that take as long as to predict all again does with few balls."""


class Engine(Protocol):
    """A simulation under way."""

    setup: kernel_state.Setup
    state: Floats
    container: Floats | None
    slides: Integers | None
    labels: Indices
    sums: Floats
    counts: Integers

    def advance(self, recorded: Recorded, grid: Grid, room: int) -> int:
        """Simulate at most ``room`` events; why it stopped."""

    def balls(self) -> Floats:
        """The balls' rows as in ``layout``, in the scene's order."""

    def set_back(self, shift: float) -> None:
        """Set all clocks back by a time, s."""


class AllPairs:
    """Few balls in a circle."""

    def __init__(self, scene: Scene, setup: kernel_state.Setup) -> None:
        self.setup = setup
        self.state = kernel_state.balls_of(scene)
        self.container = kernel_state.container_of(scene)
        self.radii, self.masses = kernel_state.unlike(scene)
        self.agenda = np.full((kernel_state.AGENDA_ROWS, scene.number), math.inf)
        self.slides = kernel_state.slides_of(scene)
        self.labels = np.zeros(0, dtype=np.int32)
        self.links = np.full(
            (kernel_state.LINK_ROWS, scene.number), kernel_state.NOBODY, dtype=np.int64
        )
        self.links[[kernel_state.COUNT, kernel_state.BOUNCES]] = 0
        self.sums, self.counts = kernel_state.new_sums(scene), kernel_state.new_counts()
        all_pairs.prepare(
            self.state, self.container, self.setup, self.radii, self.agenda, self.links
        )

    def advance(self, recorded: Recorded, grid: Grid, room: int) -> int:
        """Simulate at most ``room`` events; why it stopped."""
        answer = all_pairs.advance(
            self.state,
            self.container,
            self.slides,
            self.setup,
            self.radii,
            self.masses,
            self.agenda,
            self.links,
            self.sums,
            self.counts,
            recorded,
            grid,
            room,
        )
        return int(answer)

    def balls(self) -> Floats:
        """The balls' rows as in ``layout``, in the scene's order."""
        return self.state

    def set_back(self, shift: float) -> None:
        """Set all clocks back by a time, s."""
        _set_back(self, shift)
        self.agenda -= shift


class InCells:
    """Many balls, or a box."""

    def __init__(self, scene: Scene, setup: kernel_state.Setup) -> None:
        number = scene.number
        self.scene, self.setup = scene, setup
        self._hold(kernel_state.lines(kernel_state.CELL_BALL_ROWS * number).reshape(number, -1).T)
        self.state[: kernel_state.BALL_ROWS] = kernel_state.balls_of(scene)
        self.container = kernel_state.container_of(scene)
        self.slides: Integers | None = None
        self.box = kernel_state.half_sides_of(scene)
        self.period = kernel_state.period_of(scene)
        self.radii, self.masses = kernel_state.unlike(scene)
        self.tags[kernel_state.FORMER] = kernel_state.NOBODY
        self.links = np.zeros((kernel_state.CELL_LINK_ROWS, number), dtype=np.int32, order="F")
        self.mesh = cell_grid.new_mesh(scene, side_of(scene))
        self.cells = self._new_cells(4)
        self.tree = event_queue.new_tree(number)
        self.labels = np.zeros(0, dtype=np.int32)  # whose row is whose, once they are re-ordered
        self.margin = self._margin()
        self.sums, self.counts = kernel_state.new_sums(scene), kernel_state.new_counts()
        self.ordered_at = 0
        self.renewed_at = 0.0
        self._fill()

    def advance(self, recorded: Recorded, grid: Grid, room: int) -> int:
        """Simulate at most ``room`` events; why it stopped."""
        if self.scene.number >= REORDERED:
            self._keep_order()
        return self._advance(recorded, grid, room)

    def balls(self) -> Floats:
        """The balls' rows as in ``layout``, in the scene's order."""
        if not len(self.labels):
            return self.state
        ordered = np.empty_like(self.state)
        ordered[:, self.labels] = self.state
        return ordered

    def set_back(self, shift: float) -> None:
        """Set all clocks back by a time, s."""
        _set_back(self, shift)
        self.state[[kernel_state.CONTACT_TIME, kernel_state.CROSSING_TIME]] -= shift
        self.tree.times[:] -= shift  # what is equal stays equal: nodes and children agree
        self.renewed_at -= shift
        if self.margin is not None:
            self.margin.place[cell_prediction.UNTIL] -= shift

    def _advance(self, recorded: Recorded, grid: Grid, room: int) -> int:
        """Simulate, and see to the cells on the way."""
        begun, renewals = self._events, 0
        while True:
            done = self._events - begun
            answer = int(
                cells.advance(
                    self.state,
                    self.container,
                    self.margin,
                    self.box,
                    self.period,
                    self.setup,
                    self.radii,
                    self.masses,
                    self.links,
                    self.tags,
                    self.mesh,
                    self.cells,
                    self.near,
                    self.tree,
                    self.labels,
                    self.sums,
                    self.counts,
                    recorded.after(done),
                    grid,
                    room - done,
                )
            )
            if answer == CELL_FULL:
                self._widen()
                self._fill()
            elif answer == OUT_OF_MARGIN and self.margin is not None:
                self.renewed_at = float(self.margin.place[cell_prediction.UNTIL])
                self.margin = self._margin(self.renewed_at)
                self._fill()
                renewals += 1
                if renewals * (RENEWAL + self.scene.number) >= cells.CROSSINGS_AT_ONCE * room:
                    answer = FULL
            if answer not in (CELL_FULL, OUT_OF_MARGIN):
                idle = answer == FULL and self._events == begun
                return NOTHING_LEFT if idle and self._moves_as_one() else answer

    def _hold(self, state: Floats) -> None:
        """Take on the balls' lines, which are floats and integers in the same memory."""
        self.state = state
        self.tags = state.T.view(np.int32).T

    def _moves_as_one(self) -> bool:
        """Whether no ball of a periodic box, or in a free container, moves relative to anything."""
        velocities = self.state[[kernel_state.U, kernel_state.V]]
        if self.container is not None:
            velocities = np.column_stack(
                [velocities, self.container[[kernel_state.U, kernel_state.V]]]
            )
        endless = self.period is not None or self.container is not None
        return endless and not np.ptp(velocities, axis=1).any()

    def _fill(self) -> None:
        """Put the balls into cells and have everything predicted.

        As of the last event; or as of when cells were put round a free container's place since:
        before that it was elsewhere.
        """
        now = max(float(self.sums[kernel_state.NOW]), self.renewed_at)
        if self.margin is not None:
            self.margin.brinks[0] = 0
        self.links[kernel_state.BRINK] = 0
        while True:
            filled = cells.fill(
                now,
                self.state,
                self.period,
                self.links,
                self.tags,
                self.mesh,
                self.cells,
                self.tree,
            )
            if filled:
                self.near = np.zeros(9 * self.cells.members.shape[1] + 4, dtype=np.uint32)
                return
            self._widen()

    def _widen(self) -> None:
        """Give every cell twice the room."""
        self.cells = self._new_cells(2 * self.cells.members.shape[1])

    def _new_cells(self, capacity: int) -> cell_grid.Cells:
        margin = 0.0 if self.container is None else MARGIN * self.mesh.width
        return cell_grid.new_cells(self.scene, self.mesh, capacity, margin)

    def _margin(self, now: float = 0.0) -> cell_prediction.Margin | None:
        """Put cells round a free container; where it may be, from ``now`` (s) on, in them."""
        if self.container is None:
            return None
        margin = cell_prediction.new_margin(
            self.container, MARGIN * self.mesh.width, now, self.scene.number
        )
        self.mesh = cell_grid.centred(self.mesh, *margin.place[: cell_prediction.WIDTH])
        return margin

    @property
    def _events(self) -> int:
        return int(self.counts[kernel_state.WALL_EVENTS] + self.counts[kernel_state.PAIR_EVENTS])

    def _keep_order(self) -> None:
        """Put the balls into the order of their cells, if there have been events enough."""
        if len(self.labels) and self._events < self.ordered_at + (
            REORDER_AFTER * self.scene.number
        ):
            return
        order = np.argsort(self.links[kernel_state.CELL], kind="stable")
        place = np.empty(len(order), dtype=np.int32)
        place[order] = np.arange(len(order), dtype=np.int32)
        labels = self.labels if len(self.labels) else np.arange(len(order), dtype=np.int32)
        self.labels = np.ascontiguousarray(labels[order])
        state = kernel_state.lines(self.state.size).reshape(len(order), -1)
        np.take(self.state.T, order, axis=0, out=state)
        self._hold(state.T)
        self.links = np.asfortranarray(self.links[:, order])
        last = self.tags[kernel_state.FORMER]
        last[last >= 0] = place[last[last >= 0]]
        self.radii = None if self.radii is None else self.radii[order]
        self.masses = None if self.masses is None else self.masses[order]
        self.ordered_at = self._events
        self._fill()


def _set_back(engine: Engine, shift: float) -> None:
    """Set back the clocks that both engines have, and the time until which they simulate."""
    engine.setup = engine.setup._replace(time_limit=engine.setup.time_limit - shift)
    engine.state[kernel_state.CLOCK] -= shift
    engine.sums[kernel_state.NOW] -= shift
    if engine.container is not None:
        engine.container[kernel_state.CLOCK] -= shift


def engine_for(scene: Scene, kind: str | None = None) -> type[AllPairs] | type[InCells]:
    """What suits a scene, or what it is told to be: "allpairs" or "cells".

    Balls that slide are for all pairs, however many they are.

    Raises ``ValueError`` for all pairs in a box, for balls that slide in cells, and for balls that
    slide where there is no fixed circle.
    """
    in_circle = isinstance(scene.container, Circle)
    if scene.slides and (not in_circle or scene.free):
        raise ValueError("balls slide along the fixed wall of a circle only: set collapse: stop")
    if scene.slides and kind == "cells":
        raise ValueError("the engine cells lets no ball slide: use allpairs")
    if kind == "allpairs" and not in_circle:
        raise ValueError(f"the engine allpairs knows no {scene.container.title}: use cells")
    if kind is None:
        few = scene.number <= few_at(scene.packing_fraction, free=scene.free)
        kind = "allpairs" if scene.slides or (few and in_circle) else "cells"
    return AllPairs if kind == "allpairs" else InCells


def few_at(packing_fraction: float, *, free: bool) -> int:
    """How many balls in a circle all pairs are faster for than cells, by measurement.

    A dilute gas has more crossings of cells, and a free container moves all walls at each hit.
    """
    # Of square roots, which are exactly rounded: a scene gets the same engine on every machine.
    root = math.sqrt(math.sqrt(packing_fraction))
    return int(min((FEW_IN_FREE if free else FEW) / root, MOST))


def side_of(scene: Scene) -> float:
    """Side of the cells, m: wide enough that crossings are no more than looking at partners.

    With n balls to an area and a mean free path l, crossings cost as l / side and partners as
    n side^2: the least is where n side^2 goes as (n l^3)^(1/3) or, in diameters, as the packing's
    cube root to -1.
    """
    balls = max(BALLS_A_CELL, DILUTE * scene.packing_fraction ** (-1 / 3))
    return math.sqrt(balls * scene.container.area / scene.number)


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
        if answer != clock.FULL:
            return run.trace(_REASONS[answer])
        if stop_wanted:
            done = run.events >= run.setup.collision_limit
            return run.trace(StopReason.COLLISIONS if done else StopReason.INTERRUPTED)


def specialisation(scene: Scene, *, engine: str | None = None) -> dict[str, bool]:
    """What the kernel is compiled for: only what the scene needs is modelled."""
    in_cells = engine_for(scene, engine) is InCells
    return {
        "cells": in_cells,
        "balls sorted by cells": in_cells and scene.number >= REORDERED,
        "straight walls": isinstance(scene.container, Box),
        "periodic images": scene.container.period is not None,
        "moving container": scene.free,
        "unequal balls": kernel_state.unlike(scene)[0] is not None,
        "sliding along the wall": scene.slides,
    }


_REASONS = {
    clock.COLLISIONS: StopReason.COLLISIONS,
    clock.TIME: StopReason.TIME,
    clock.NOTHING_LEFT: StopReason.NOTHING_LEFT,
    clock.WALL_TRAP: StopReason.WALL_TRAP,
    clock.COLLAPSE: StopReason.COLLAPSE,
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
        self.masses = kernel_state.unlike(scene)[1]
        self.setup = kernel_state.Setup.of(
            scene,
            math.inf if time is None else time,
            NO_LIMIT if collisions is None else collisions,
        )
        self.engine = engine_for(scene, kind)(scene, self.setup)
        self.epoch_length = clock.length(scene.number)
        self.now = 0.0
        self.grid = sampling.new_grid(scene) if summary else sampling.no_grid()
        self.summary = summary
        self.chunks: list[Events] = []
        self.sink = self.chunks.append if sink is None else sink

    @property
    def events(self) -> int:
        """Collisions so far."""
        return int(
            self.engine.counts[kernel_state.WALL_EVENTS]
            + self.engine.counts[kernel_state.PAIR_EVENTS]
        )

    def chunk(self) -> int:
        """Advance by a chunk of events at most; the kernel's answer."""
        before = self.events
        size = CHUNK if self.scene.number < REORDERED else SMALL_CHUNK
        room = min(size, max(1, self.setup.collision_limit))
        room = min(room, self.epoch_length - before % self.epoch_length)
        recorded = kernel_state.room_for(0 if self.summary else room)
        answer = self.engine.advance(recorded, self.grid, room)
        sums, filled = self.engine.sums, slice(self.events - before)
        self.now = float(sums[kernel_state.EPOCH] + sums[kernel_state.NOW])
        if not self.summary:
            time, residual = clock.times(float(sums[kernel_state.EPOCH]), recorded.time[filled])
            columns = recorded.i[filled], recorded.j[filled], recorded.impulse[filled]
            self.sink(Events(time, *columns, residual))
        if self.events > before and self.events % self.epoch_length == 0:
            epoch, shift = clock.following(
                float(sums[kernel_state.EPOCH]), float(sums[kernel_state.NOW])
            )
            self.engine.set_back(shift)
            sums[kernel_state.EPOCH] = epoch
        return answer

    def trace(self, reason: StopReason) -> Trace:
        """Everything so far, as a finished trace."""
        stop = self._stop(reason)
        return Trace(
            start=self.scene,
            finish=self._finish(self._clock(stop)),
            stop=stop,
            wall_events=int(self.engine.counts[kernel_state.WALL_EVENTS]),
            pair_events=int(self.engine.counts[kernel_state.PAIR_EVENTS]),
            events=joined(self.chunks) if self.chunks else None,
            summary=self._summary(stop) if self.summary else None,
            work=self._work(),
        )

    def _work(self) -> Work:
        """What the engine has done so far."""
        counts = self.engine.counts
        collided = counts[kernel_state.WALL_EVENTS] + 2 * counts[kernel_state.PAIR_EVENTS]
        crossings = counts[kernel_state.CROSSINGS]
        return Work(
            predictions=int(counts[kernel_state.PREDICTIONS]),
            crossings=int(crossings),
            queue_updates=int(collided + crossings + counts[kernel_state.STALE]),
        )

    def _clock(self, stop: Stop) -> float:
        """What clocks show at the end, s."""
        return stop.time - float(self.engine.sums[kernel_state.EPOCH])

    def _finish(self, time: float) -> Scene:
        """The scene when clocks are at ``time``, at or after the last event."""
        balls, container, labels = self.engine.state, self.engine.container, self.engine.labels
        if self.engine.slides is not None:
            balls = balls.copy()
            sliding.turn_all(time, balls, self.engine.slides)
        period, origin = kernel_state.period_of(self.scene), kernel_state.origin_of(self.scene)
        positions, velocities = np.empty((2, self.scene.number, 2))
        # Not all at once: of a million balls, new memory would take a third of a second.
        for first in range(0, self.scene.number, SMALL_CHUNK):
            some = slice(first, first + SMALL_CHUNK)
            x, y, u, v, clock = balls[: kernel_state.BALL_ROWS, some]
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
        first, second = (
            int(ball) for ball in self.engine.counts[[kernel_state.FIRST, kernel_state.SECOND]]
        )
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
        scene, digit = self.scene, clock.CLOCK_DIGITS * self.now
        if other == CONTAINER and isinstance(scene.container, Circle):
            here = self._finish(float(self.engine.sums[kernel_state.NOW]))
            x, y = here.positions[ball] - here.container_position
            u, v = here.velocities[ball] - here.container_velocity
            square = u * u + v * v
            # A chord lasts 2 a v_n/v^2, which here does not move the clock.
            if square > 0.0 and 2.0 * abs(x * u + y * v) <= digit * square:
                return f"ball {ball} moves along the wall and touches it at every moment"
        elastic_wall = scene.wall_restitution == 1.0 or not scene.container.has_wall
        if scene.restitution == 1.0 and elastic_wall:
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
            slide_state = balls, self.setup, self.masses, engine.slides
            sliding.sample_sliding(end, grid, *slide_state, engine.sums, engine.counts)
        sampling.sample(row, histogram, *state)
        if engine.slides is not None:
            row[sampling.WALL_IMPULSE] += sliding.pressing(end, *slide_state)
        times, rows = sampling.times_and_rows(grid)
        columns = np.ascontiguousarray(np.vstack([grid.rows[rows], row]).T)
        return Summary(
            series=Series(np.append(times, stop.time), *columns),
            speed_histogram=np.vstack([grid.histogram[rows], histogram]),
        )
