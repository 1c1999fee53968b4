"""A scene in, a trace out: both engines, and a run in chunks that can be watched and stopped."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from snooker_cli.containers import Circle
from snooker_cli.engine import all_pairs, cell_grid, cell_prediction, cells, clock, sampling
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.clock import CELL_FULL, FULL, NOTHING_LEFT, OUT_OF_MARGIN
from snooker_cli.engine.event_queue import new_tree
from snooker_cli.engine.sliding import turn_all
from snooker_cli.trace import CONTAINER, Events, Stop, StopReason, Trace, Work, joined

if TYPE_CHECKING:
    from snooker_cli.engine.kernel_state import Floats, Recorded, Setup
    from snooker_cli.engine.sampling import Grid
    from snooker_cli.scene import Scene

Sink: TypeAlias = Callable[[Events], None]
CHUNK, SMALL_CHUNK = 65536, 8192
"""Events until the user can stop a run, some 30 ms of work; and of ``REORDERED`` balls or more."""

REORDERED = 4096
"""Balls from which on those in neighbouring cells are kept near each other in memory."""

REORDER_AFTER = 20
"""Events per ball after which balls are put into the order of their cells again."""

FEW, FEW_IN_FREE, MOST = 45, 150, 400
"""Balls up to which all pairs are faster than cells, times the packing's fourth root; at most."""

BALLS_PER_CELL, DILUTE = 1.0, 0.4
"""In a packed gas, and in a dilute one over the cube root of the packing."""

MARGIN, RENEWAL = 0.1, 400
"""Way of a free container, in cells, until all is predicted again, and its cost in crossings."""


# A run, and its two engines


class Engine(ABC):
    """A simulation under way: its arrays, and what has been recorded; as in ``simulate``."""

    def __init__(
        self, scene: Scene, setup: Setup, summary: bool = False, sink: Sink | None = None
    ) -> None:
        self.scene, self.summary, self.now = scene, summary, 0.0
        self.state = ks.new_state(scene, setup, self._memory())
        self.time_limit = setup.time_limit
        self.grid = sampling.new_grid(scene) if summary else sampling.no_grid()
        self.chunks: list[Events] = []
        self.sink = self.chunks.append if sink is None else sink

    def _memory(self) -> Floats | None:
        """Memory for the balls."""
        return None

    @abstractmethod
    def advance(self, recorded: Recorded, grid: Grid, limit: int) -> int:
        """Simulate at most ``limit`` events; why it stopped."""

    def next_epoch(self, epoch: float, shift: float) -> None:
        """Set all clocks back by a shift, s, to the beginning of an epoch."""
        self.state = self.state.next_epoch(epoch, shift)

    def chunk(self, limit: int) -> int:
        """Simulate and record a chunk of events, at most ``limit``; why it stopped."""
        before, number = self.state.collisions, self.scene.number
        epoch_length = clock.length(number)
        size = CHUNK if number < REORDERED else SMALL_CHUNK
        limit = min(limit, size, epoch_length - before % epoch_length)
        recorded = ks.new_record(0 if self.summary else limit)
        answer = self.advance(recorded, self.grid, limit)
        epoch, now = map(float, self.state.sums[[ks.EPOCH, ks.NOW]])
        self.now, done = epoch + now, self.state.collisions
        if not self.summary:
            clocks, i, j, impulse = recorded.part(slice(done - before))
            time, residual = clock.times(epoch, clocks)
            self.sink(Events(time, i, j, impulse, residual))
        if done > before and done % epoch_length == 0:
            self.next_epoch(*clock.following(epoch, now))
        return answer

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

    def trace(self, reason: StopReason) -> Trace:
        """Everything so far, as a finished trace."""
        stop, counts = self._stop(reason), self.state.counts
        end = stop.time - float(self.state.sums[ks.EPOCH])
        summary = sampling.summary(end, stop.time, self.grid, self.state) if self.summary else None
        walls, pairs, crossings = map(int, counts[[ks.WALL_EVENTS, ks.PAIR_EVENTS, ks.CROSSINGS]])
        return Trace(
            start=self.scene,
            finish=self.scene_at(end),
            stop=stop,
            wall_events=walls,
            pair_events=pairs,
            events=joined(self.chunks) if self.chunks else None,
            summary=summary,
            work=Work(
                predictions=int(counts[ks.PREDICTIONS]),
                crossings=crossings,
                queue_updates=walls + 2 * pairs + crossings + int(counts[ks.STALE]),
            ),
        )

    def _stop(self, reason: StopReason) -> Stop:
        """How the run ended, with a message."""
        state, events = self.state, self.state.collisions
        now, limit = self.now, self.time_limit
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
        first, second = (
            int(state.labels[ball]) if ball >= 0 and len(state.labels) else int(ball)
            for ball in state.counts[[ks.FIRST, ks.SECOND]]
        )
        if reason is StopReason.WALL_TRAP:
            message = (
                f"wall trap: from {now:.9g} s on, ball {first} is trapped at the wall and hits it "
                f"infinitely often before anything else happens; {saved}"
            )
            return Stop(reason, now, (first,), message)
        at_wall = second == CONTAINER
        pair = f"ball {first} and the wall" if at_wall else f"balls {first} and {second}"
        message = (
            f"{self._endless(first, at_wall)}: collisions continue, but time stays "
            f"at {now:.17g} s; the last collision is of {pair}; {saved}"
        )
        return Stop(reason, now, (first,) if at_wall else (first, second), message)

    def _endless(self, ball: int, at_wall: bool) -> str:
        """What has collisions without end, with this ball in the last of them."""
        scene, digit = self.scene, clock.CLOCK_DIGITS * self.now
        if at_wall and isinstance(scene.container, Circle):
            here = self.scene_at(float(self.state.sums[ks.NOW]))
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


class AllPairs(Engine):
    """Few balls in a circle."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.agenda = all_pairs.new_agenda(self.state)

    def advance(self, recorded: Recorded, grid: Grid, limit: int) -> int:
        slides = self.state.slides
        return int(all_pairs.advance(self.state, slides, self.agenda, recorded, grid, limit))

    def next_epoch(self, epoch: float, shift: float) -> None:
        super().next_epoch(epoch, shift)
        self.agenda.times[:] -= shift


class InCells(Engine):
    """Many balls, or a box."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.cells = cell_grid.new_cells(
            self.scene, cell_side(self.scene), self.state.balls, new_tree(self.scene.number)
        )
        self.ordered_at = 0
        self.renewed_at = 0.0
        self._renew_margin(0.0)
        self._fill(capacity=4)

    def _memory(self) -> Floats:
        """Memory in which each ball is a line of the processor's cache."""
        number = self.scene.number
        return ks.aligned_zeros(cell_grid.CELL_BALL_ROWS * number).reshape(number, -1).T

    def advance(self, recorded: Recorded, grid: Grid, limit: int) -> int:
        if self.scene.number >= REORDERED:
            self._keep_order()
        begun, renewals = self.state.collisions, 0
        while True:
            done = self.state.collisions - begun
            rest = recorded.part(slice(done, None))
            answer = int(cells.advance(self.state, self.cells, rest, grid, limit - done))
            if answer == CELL_FULL:
                self._fill(2 * self.capacity)
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

    @property
    def capacity(self) -> int:
        """How many balls a cell can have."""
        return int(self.cells.members.shape[1])

    def _fill(self, capacity: int | None = None) -> None:
        """Put the balls into cells, new ones if of another capacity, and predict everything."""
        if capacity is not None:
            margin = 0.0 if self.state.container is None else MARGIN * self.cells.mesh.width
            self.cells = cell_grid.with_capacity(self.cells, capacity, self.scene, margin)
        # As of the last event, or of when cells were put round a free container since.
        now = max(float(self.state.sums[ks.NOW]), self.renewed_at)
        if self.cells.margin is not None:
            self.cells.margin.brinks[0] = 0
        self.cells.links[cell_grid.BRINK] = 0
        if not cell_prediction.fill(now, self.state, self.cells):
            self._fill(2 * self.capacity)

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
        self.cells = old._replace(links=links, tags=cell_grid.tags_of(balls))
        former = self.cells.tags[cell_grid.FORMER]
        former[former >= 0] = place[former[former >= 0]]
        self.ordered_at = state.collisions
        self._fill()


def engine_for(scene: Scene, name: str | None = None) -> type[AllPairs] | type[InCells]:
    """The faster engine for a scene, or that of a name: "allpairs" or "cells".

    Raises ``ValueError`` for another name, for all pairs in a box, and for balls that slide in
    cells or outside of a fixed circle.
    """
    in_circle = isinstance(scene.container, Circle)
    if name not in {None, "allpairs", "cells"}:
        raise ValueError(f"there is no engine {name}: use allpairs or cells")
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
    """Side of the cells, m, at which crossings and the search of partners cost least.

    With n balls per area and a mean free path l they cost as l / side and n side^2. At the least,
    n side^2 goes as the inverse cube root of the packing.
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
    sink: Sink | None = None,
    engine: str | None = None,
) -> Trace:
    """Simulate a scene until a number of collisions or a time, whichever comes first.

    collisions : ball-ball and wall collisions together
    time : s
    summary : record observables on a grid of times instead of the events
    watch : called after each chunk with the number of new events; a true answer stops the run
    sink : called with the events of each chunk; the trace then has none, so memory stays bounded
    engine : "allpairs" or "cells" instead of the faster one

    Raises ``ValueError`` if neither limit is given, or if the engine cannot simulate the scene.
    """
    if collisions is None and time is None:
        raise ValueError("a run needs a number of collisions or a time to end at")
    setup = ks.Setup.of(scene, math.inf if time is None else time)
    run = engine_for(scene, engine)(scene, setup, summary, sink)
    wanted = ks.NO_LIMIT if collisions is None else collisions
    while True:
        before = run.state.collisions
        answer = run.chunk(wanted - before)
        done = run.state.collisions
        stop_wanted = watch is not None and watch(done - before)
        if done >= wanted:
            return run.trace(StopReason.COLLISIONS)
        if answer != FULL:
            return run.trace(_REASONS[answer])
        if stop_wanted:
            return run.trace(StopReason.INTERRUPTED)


def specialisation(scene: Scene, *, engine: str | None = None) -> dict[str, bool]:
    """What the kernel is compiled for: it has only what the scene needs."""
    in_cells = engine_for(scene, engine) is InCells
    in_circle = isinstance(scene.container, Circle)
    return {
        "cells": in_cells,
        "balls sorted by cells": in_cells and scene.number >= REORDERED,
        "straight walls": scene.container.has_wall and not in_circle,
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
