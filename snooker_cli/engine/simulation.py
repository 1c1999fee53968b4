"""A scene in, a trace out: both engines, and a run in chunks that can be watched and stopped."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.containers import Box, Circle
from snooker_cli.engine import all_pairs, cell_grid, cell_prediction, cells, clock, sampling
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.clock import CELL_FULL, FULL, NOTHING_LEFT, OUT_OF_MARGIN
from snooker_cli.engine.event_queue import new_tree
from snooker_cli.engine.sliding import turn_all
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
    from snooker_cli.engine.kernel_state import Floats, Recorded, Setup
    from snooker_cli.engine.sampling import Grid
    from snooker_cli.scene import Scene

CHUNK = 65536
"""Events between two looks at whether the user wants to stop; some 30 ms of work."""

SMALL_CHUNK = 8192
"""The same for so many balls that their memory is slow."""

REORDERED = 4096
"""Balls from which on those in neighbouring cells are kept near each other in memory."""

REORDER_AFTER = 20
"""Events per ball after which balls are put into the order of their cells again."""

FEW, FEW_IN_FREE, MOST = 45, 150, 400
"""Balls up to which all pairs are faster than cells, times the packing's fourth root; at most."""

BALLS_PER_CELL, DILUTE = 1.0, 0.4
"""In a packed gas, and in a dilute one over the cube root of the packing."""

MARGIN = 0.1
"""How far a free container may move until all is predicted again, of a cell's side."""

RENEWAL = 400
"""Crossings that take as long as to predict all again does with few balls."""


# The two engines, each with the arrays of one simulation


class Engine(ABC):
    """A simulation under way."""

    state: ks.State

    def __init__(self, scene: Scene, setup: Setup) -> None:
        self.scene = scene
        self.state = ks.new_state(scene, setup, self._memory())

    def _memory(self) -> Floats | None:
        """Memory for the balls."""
        return None

    @abstractmethod
    def advance(self, recorded: Recorded, grid: Grid, limit: int) -> int:
        """Simulate at most ``limit`` events; why it stopped."""

    def next_epoch(self, epoch: float, shift: float) -> None:
        """Set all clocks back by a shift, s, to the beginning of an epoch."""
        self.state = self.state.next_epoch(epoch, shift)

    def scene_at(self, time: float) -> Scene:
        """The scene when clocks show a time (s), at or after the last event."""
        scene, state = self.scene, self.state
        balls, labels, container = state.balls, state.labels, state.container
        if state.slides is not None:
            balls = balls.copy()
            turn_all(time, balls, state.slides)
        origin = ks.origin_of(scene)
        positions, velocities = np.empty((2, scene.number, 2))
        # Not all at once: of a million balls, new memory would take a third of a second.
        for first in range(0, scene.number, SMALL_CHUNK):
            some = slice(first, first + SMALL_CHUNK)
            x, y, u, v, clocks = balls[: ks.BALL_ROWS, some]
            ages = time - clocks
            position = np.column_stack([x + u * ages, y + v * ages])
            if state.period is not None:
                position -= state.period * np.rint(position / state.period)
            columns = labels[some] if len(labels) else some
            positions[columns] = position + origin
            velocities[columns] = np.column_stack([u, v])
        moved = replace(scene, positions=positions, velocities=velocities)
        if container is None:
            return moved
        return replace(
            moved,
            container_position=container[:2] + container[2:4] * (time - container[4]),
            container_velocity=container[2:4].copy(),
        )


class AllPairs(Engine):
    """Few balls in a circle."""

    def __init__(self, scene: Scene, setup: Setup) -> None:
        super().__init__(scene, setup)
        self.agenda = all_pairs.new_agenda(self.state)

    def advance(self, recorded: Recorded, grid: Grid, limit: int) -> int:
        """Simulate at most ``limit`` events; why it stopped."""
        slides = self.state.slides
        return int(all_pairs.advance(self.state, slides, self.agenda, recorded, grid, limit))

    def next_epoch(self, epoch: float, shift: float) -> None:
        """Set all clocks back by a shift, s, to the beginning of an epoch."""
        super().next_epoch(epoch, shift)
        self.agenda.times[:] -= shift


class InCells(Engine):
    """Many balls, or a box."""

    def __init__(self, scene: Scene, setup: Setup) -> None:
        super().__init__(scene, setup)
        mesh = cell_grid.new_mesh(scene, cell_side(scene))
        links = np.zeros((cell_grid.LINK_ROWS, scene.number), dtype=np.int32, order="F")
        none = np.zeros(0, dtype=np.int32)
        self.cells = cell_grid.Cells(
            mesh=mesh,
            members=none,
            occupancy=none,
            at_wall=none.astype(np.bool_),
            near=none,
            links=links,
            tags=_tags(self.state.balls),
            tree=new_tree(scene.number),
            margin=None,
        )
        self.cells.tags[cell_grid.FORMER] = ks.NO_PARTNER
        self.ordered_at = 0
        self.renewed_at = 0.0
        self._set_capacity(4)
        self._renew_margin(0.0)
        self._fill()

    def _memory(self) -> Floats:
        """Memory in which each ball is a line of the processor's cache."""
        number = self.scene.number
        return ks.aligned_zeros(cell_grid.CELL_BALL_ROWS * number).reshape(number, -1).T

    def advance(self, recorded: Recorded, grid: Grid, limit: int) -> int:
        """Simulate at most ``limit`` events; why it stopped."""
        if self.scene.number >= REORDERED:
            self._keep_order()
        begun, renewals = self.state.collisions, 0
        while True:
            done = self.state.collisions - begun
            rest = recorded.part(slice(done, None))
            answer = int(cells.advance(self.state, self.cells, rest, grid, limit - done))
            if answer == CELL_FULL:
                self._set_capacity(2 * self.capacity)
                self._fill()
            elif answer == OUT_OF_MARGIN and self.cells.margin is not None:
                self._renew_margin(float(self.cells.margin.place[cell_grid.UNTIL]))
                self._fill()
                renewals += 1
                if renewals * (RENEWAL + self.scene.number) >= cells.CROSSINGS_AT_ONCE * limit:
                    answer = FULL
            if answer not in (CELL_FULL, OUT_OF_MARGIN):
                idle = answer == FULL and self.state.collisions == begun
                return NOTHING_LEFT if idle and self._moves_as_one() else answer

    def next_epoch(self, epoch: float, shift: float) -> None:
        """Set all clocks back by a shift, s, to the beginning of an epoch."""
        super().next_epoch(epoch, shift)
        self.state.balls[[cell_grid.CONTACT_TIME, cell_grid.CROSSING_TIME]] -= shift
        self.cells.tree.times[:] -= shift  # what is equal stays equal: nodes and children agree
        self.renewed_at -= shift
        if self.cells.margin is not None:
            self.cells.margin.place[cell_grid.UNTIL] -= shift

    def _moves_as_one(self) -> bool:
        """Whether no ball of a periodic box, or in a free container, moves relative to anything."""
        velocities, container = self.state.balls[[ks.U, ks.V]], self.state.container
        if container is not None:
            velocities = np.column_stack([velocities, container[[ks.U, ks.V]]])
        endless = self.state.period is not None or container is not None
        return endless and not np.ptp(velocities, axis=1).any()

    def _fill(self) -> None:
        """Put the balls into cells and predict everything again.

        As of the last event; or as of when cells were put round a free container's place since:
        before that it was elsewhere.
        """
        now = max(float(self.state.sums[ks.NOW]), self.renewed_at)
        if self.cells.margin is not None:
            self.cells.margin.brinks[0] = 0
        self.cells.links[cell_grid.BRINK] = 0
        while not cell_prediction.fill(now, self.state, self.cells):
            self._set_capacity(2 * self.capacity)

    @property
    def capacity(self) -> int:
        """How many balls a cell can have."""
        return int(self.cells.members.shape[1])

    def _set_capacity(self, capacity: int) -> None:
        """Make new, empty cells for this many balls each."""
        mesh = self.cells.mesh
        number = mesh.rows << mesh.shift
        margin = 0.0 if self.state.container is None else MARGIN * mesh.width
        self.cells = self.cells._replace(
            members=np.zeros((number, capacity), dtype=np.int32),
            occupancy=np.zeros(number, dtype=np.int32),
            at_wall=cell_grid.cells_at_wall(self.scene, mesh, margin),
            near=np.zeros(9 * capacity + 4, dtype=np.uint32),
        )

    def _renew_margin(self, now: float) -> None:
        """Put cells round a free container's place at a time, s."""
        container, mesh = self.state.container, self.cells.mesh
        if container is not None:
            margin = cell_grid.new_margin(container, MARGIN * mesh.width, now, self.scene.number)
            mesh = cell_grid.centred(mesh, *margin.place[: cell_grid.WIDTH])
            self.cells = self.cells._replace(margin=margin, mesh=mesh)
            self.renewed_at = now

    def _keep_order(self) -> None:
        """Put the balls into the order of their cells, if there have been events enough."""
        state, old = self.state, self.cells
        labels, number = state.labels, self.scene.number
        if len(labels) and state.collisions < self.ordered_at + REORDER_AFTER * number:
            return
        order = np.argsort(old.links[cell_grid.CELL], kind="stable")
        place = np.empty(number, dtype=np.int32)
        place[order] = np.arange(number, dtype=np.int32)
        balls = self._memory()
        np.take(state.balls.T, order, axis=0, out=balls.T)
        self.state = state._replace(
            balls=balls,
            labels=(labels if len(labels) else np.arange(number, dtype=np.int32))[order],
            radii=None if state.radii is None else state.radii[order],
            masses=None if state.masses is None else state.masses[order],
        )
        links = np.asfortranarray(old.links[:, order])
        self.cells = old._replace(links=links, tags=_tags(balls))
        former = self.cells.tags[cell_grid.FORMER]
        former[former >= 0] = place[former[former >= 0]]
        self.ordered_at = state.collisions
        self._fill()


def _tags(balls: Floats) -> ks.Indices:
    """The balls' memory as 32-bit integers."""
    return balls.T.view(np.int32).T


def engine_for(scene: Scene, name: str | None = None) -> type[AllPairs] | type[InCells]:
    """The faster engine for a scene, or that of a name: "allpairs" or "cells".

    All pairs are for balls that slide, however many they are.

    Raises ``ValueError`` for all pairs in a box, for balls that slide in cells, and for balls that
    slide where there is no fixed circle.
    """
    in_circle = isinstance(scene.container, Circle)
    if scene.slides and (not in_circle or scene.free):
        raise ValueError("balls slide along the fixed wall of a circle only: set collapse: stop")
    if scene.slides and name == "cells":
        raise ValueError("the engine cells lets no ball slide: use allpairs")
    if name == "allpairs" and not in_circle:
        raise ValueError(f"the engine allpairs knows no {scene.container.title}: use cells")
    if name is None:
        few = scene.number <= few_at(scene.packing_fraction, free=scene.free)
        name = "allpairs" if scene.slides or (few and in_circle) else "cells"
    return AllPairs if name == "allpairs" else InCells


def few_at(packing_fraction: float, *, free: bool) -> int:
    """Number of balls in a circle up to which all pairs are faster than cells, by measurement.

    A dilute gas has more crossings of cells, and a free container moves all walls at each hit.
    """
    # Of square roots, which are exactly rounded: a scene gets the same engine on every machine.
    root = math.sqrt(math.sqrt(packing_fraction))
    return int(min((FEW_IN_FREE if free else FEW) / root, MOST))


def cell_side(scene: Scene) -> float:
    """Side of the cells, m: so wide that crossings take no longer than looking at partners.

    With n balls to an area and a mean free path l, crossings cost as l / side and partners as
    n side^2. The least is where n side^2 goes as (n l^3)^(1/3) or, in diameters, as the packing's
    cube root to -1.
    """
    balls = max(BALLS_PER_CELL, DILUTE * scene.packing_fraction ** (-1 / 3))
    return math.sqrt(balls * scene.container.area / scene.number)


# A run


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
    sink : called with the events of each chunk; the trace then has none, so memory stays bounded
    engine : "allpairs" or "cells" instead of the faster one

    Raises ``ValueError`` if neither limit is given.
    """
    if collisions is None and time is None:
        raise ValueError("a run needs a number of collisions or a time to end at")
    setup = ks.Setup.of(scene, math.inf if time is None else time)
    run = _Run(engine_for(scene, engine)(scene, setup), summary, sink)
    wanted = ks.NO_LIMIT if collisions is None else collisions
    while True:
        before = run.events
        answer = run.chunk(wanted - before)
        stop_wanted = watch is not None and watch(run.events - before)
        if run.events >= wanted:
            return run.trace(StopReason.COLLISIONS)
        if answer != FULL:
            return run.trace(_REASONS[answer])
        if stop_wanted:
            return run.trace(StopReason.INTERRUPTED)


def specialisation(scene: Scene, *, engine: str | None = None) -> dict[str, bool]:
    """What the kernel is compiled for: it has only what the scene needs."""
    in_cells = engine_for(scene, engine) is InCells
    return {
        "cells": in_cells,
        "balls sorted by cells": in_cells and scene.number >= REORDERED,
        "straight walls": isinstance(scene.container, Box),
        "periodic images": scene.container.period is not None,
        "moving container": scene.free,
        "unequal balls": ks.has_unequal_balls(scene),
        "sliding along the wall": scene.slides,
    }


_REASONS = {
    clock.TIME: StopReason.TIME,
    clock.NOTHING_LEFT: StopReason.NOTHING_LEFT,
    clock.WALL_TRAP: StopReason.WALL_TRAP,
    clock.COLLAPSE: StopReason.COLLAPSE,
}


class _Run:
    """A simulation under way and the chunks recorded so far."""

    def __init__(
        self, engine: Engine, summary: bool, sink: Callable[[Events], None] | None
    ) -> None:
        self.engine, self.scene, self.setup = engine, engine.scene, engine.state.setup
        self.now = 0.0
        self.grid = sampling.new_grid(self.scene) if summary else sampling.no_grid()
        self.summary = summary
        self.chunks: list[Events] = []
        self.sink = self.chunks.append if sink is None else sink

    @property
    def events(self) -> int:
        """Collisions so far."""
        return self.engine.state.collisions

    def chunk(self, limit: int) -> int:
        """Advance by a chunk of events, at most by a limit; the kernel's answer."""
        before, number = self.events, self.scene.number
        epoch_length = clock.length(number)
        size = CHUNK if number < REORDERED else SMALL_CHUNK
        limit = min(limit, size, epoch_length - before % epoch_length)
        recorded = ks.new_record(0 if self.summary else limit)
        answer = self.engine.advance(recorded, self.grid, limit)
        sums = self.engine.state.sums
        epoch, now = float(sums[ks.EPOCH]), float(sums[ks.NOW])
        self.now = epoch + now
        if not self.summary:
            clocks, i, j, impulse = recorded.part(slice(self.events - before))
            time, residual = clock.times(epoch, clocks)
            self.sink(Events(time, i, j, impulse, residual))
        if self.events > before and self.events % epoch_length == 0:
            self.engine.next_epoch(*clock.following(epoch, now))
        return answer

    def trace(self, reason: StopReason) -> Trace:
        """Everything so far, as a finished trace."""
        stop, counts = self._stop(reason), self.engine.state.counts
        collided = counts[ks.WALL_EVENTS] + 2 * counts[ks.PAIR_EVENTS]
        return Trace(
            start=self.scene,
            finish=self.engine.scene_at(self._clock(stop)),
            stop=stop,
            wall_events=int(counts[ks.WALL_EVENTS]),
            pair_events=int(counts[ks.PAIR_EVENTS]),
            events=joined(self.chunks) if self.chunks else None,
            summary=self._summary(stop) if self.summary else None,
            work=Work(
                predictions=int(counts[ks.PREDICTIONS]),
                crossings=int(counts[ks.CROSSINGS]),
                queue_updates=int(collided + counts[ks.CROSSINGS] + counts[ks.STALE]),
            ),
        )

    def _clock(self, stop: Stop) -> float:
        """What clocks show at the end, s."""
        return stop.time - float(self.engine.state.sums[ks.EPOCH])

    def _stop(self, reason: StopReason) -> Stop:
        """How the run ended, with a message."""
        now, limit, events = self.now, self.setup.time_limit, self.events
        if reason is StopReason.COLLISIONS:
            return Stop(reason, now, (), f"{events:,} collisions reached at {now:.9g} s")
        if reason is StopReason.TIME:
            return Stop(reason, limit, (), f"{limit:.9g} s reached after {events:,} collisions")
        if reason is StopReason.NOTHING_LEFT:
            end = limit if math.isfinite(limit) else now
            message = f"no further collision can happen after {events:,}, at {now:.9g} s"
            return Stop(reason, end, (), message)
        if reason is StopReason.INTERRUPTED:
            return Stop(reason, now, (), f"interrupted after {events:,} collisions at {now:.9g} s")
        saved = "1 collision is saved" if events == 1 else f"{events:,} collisions are saved"
        first, second = self._last_balls()
        if reason is StopReason.WALL_TRAP:
            message = (
                f"wall trap: from {now:.9g} s on, ball {first} is trapped at the wall and hits it "
                f"infinitely often before anything else happens; {saved}"
            )
            return Stop(reason, now, (first,), message)
        at_wall = second == CONTAINER
        pair = f"ball {first} and the wall" if at_wall else f"balls {first} and {second}"
        message = (
            f"{self._endless(first, at_wall)}: the clock stands at {now:.17g} s while collisions "
            f"continue, the last of {pair}; {saved}"
        )
        return Stop(reason, now, (first,) if at_wall else (first, second), message)

    def _last_balls(self) -> tuple[int, int]:
        """The balls of the last event, in the scene's numbers."""
        state = self.engine.state
        first, second = state.counts[[ks.FIRST, ks.SECOND]].tolist()
        if len(state.labels):
            first, second = (
                int(state.labels[ball]) if ball >= 0 else ball for ball in (first, second)
            )
        return first, second

    def _endless(self, ball: int, at_wall: bool) -> str:
        """What has collisions without end, with this ball in the last of them."""
        scene, digit = self.scene, clock.CLOCK_DIGITS * self.now
        if at_wall and isinstance(scene.container, Circle):
            here = self.engine.scene_at(float(self.engine.state.sums[ks.NOW]))
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
        state, grid, end = self.engine.state, self.grid, self._clock(stop)
        row, histogram = np.zeros(sampling.COLUMNS), np.zeros(SPEED_BINS, dtype=np.int64)
        sampling.sample_until(end, grid, state, state.slides)
        sampling.sample(row, histogram, end, state, state.container, state.slides)
        times, rows = sampling.times_and_rows(grid)
        columns = np.ascontiguousarray(np.vstack([grid.rows[rows], row]).T)
        return Summary(
            series=Series(np.append(times, stop.time), *columns),
            speed_histogram=np.vstack([grid.histogram[rows], histogram]),
        )
