"""A scene in, a trace out: both engines, and a run in chunks that can be watched and stopped."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import chain
from operator import attrgetter
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import Circle
from snooker_cli.engine import all_pairs, cell_grid, cell_prediction, cells, clock, sampling
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.clock import CELL_FULL, FULL, NOTHING_LEFT, OUT_OF_MARGIN
from snooker_cli.engine.event_queue import new_tree
from snooker_cli.engine.kernel_state import Floats, Indices, Integers, Recorded, State
from snooker_cli.engine.sampling import Grid
from snooker_cli.engine.sliding import FLAT, turn_all
from snooker_cli.scene import Scene
from snooker_cli.trace import (
    CONTAINER,
    SPEED_BINS,
    Events,
    Stop,
    StopReason,
    Summary,
    Trace,
    Work,
    joined,
)

Sink: TypeAlias = Callable[[Events], None]
CHUNK, SMALL_CHUNK = 65536, 8192
"""Events until the user can stop a run, some 30 ms of work; and of ``REORDERED`` balls or more."""

MOST_EVENTS, MOST_SUMMARIES = 700_000, 64
"""Events of a chunk of many repeats, and summaries of one call: some 16 MB."""

REORDERED = 4096
"""Balls from which on those in neighbouring cells are kept near each other in memory."""

REORDER_AFTER = 20  # events per ball after which balls are put into the order of their cells again

FEW, FEW_IN_FREE, MOST = 48, 150, 1000
"""Balls up to which all pairs are faster than cells, times the packing to the 3/8; at most."""

BALLS_PER_CELL, DILUTE = 1.0, 0.4
"""In a packed gas, and in a dilute one over the cube root of the packing."""

MARGIN, RENEWAL = 0.1, 400
"""Way of a free container, in cells, until all is predicted again, and its cost in crossings."""

NEARLY_ELASTIC, HALVINGS = 1e-3, 7
"""Of ``chord_sum``: 1 - e up to which terms are too many, and halvings of the arc tangent."""


# Repeats under way, and the two engines


class Engine(ABC):
    """Repeats of one point under way: their arrays, and what has been recorded.

    states : stacked; ``InCells`` shares only sums and counts with it
    active : (*a*,), the repeats that have not ended; all have had ``done`` events
    grids : stacked; ``None`` if events are recorded
    reasons : why each repeat ended; ``INTERRUPTED`` while it is active
    times : (*repeats*,), of the last event, s
    chunks : of each repeat, its events so far
    """

    def __init__(
        self, scenes: Sequence[Scene], time_limit: float = math.inf, summary: bool = False
    ) -> None:
        repeats = len(scenes)
        self.scenes, self.time_limit = scenes, time_limit
        self.states = ks.new_states(scenes, time_limit, self._memory())
        self.grids = sampling.new_grids(scenes) if summary else None
        self.active, self.done = np.arange(repeats), 0
        self.reasons = [StopReason.INTERRUPTED] * repeats
        self.times = np.zeros(repeats)
        self.chunks: list[list[Events]] = [[] for _ in scenes]

    def _memory(self) -> Floats | None:
        """Memory for the balls, stacked; ``None`` for an array in rows."""
        return None

    @abstractmethod
    def advance(self, records: Recorded, answers: Integers, limit: int) -> None:
        """Simulate at most ``limit`` events of each active repeat, and answer why it stopped.

        records, answers : a row for each active repeat
        """

    @abstractmethod
    def state_of(self, repeat: int) -> State:
        """The state of a repeat."""

    @abstractmethod
    def next_epoch(self, repeat: int, epoch: float, shift: float) -> None:
        """Set all clocks of a repeat back by a shift, s, to the beginning of an epoch."""

    @abstractmethod
    def parts(self) -> dict[str, Any]:
        """All arrays and numbers that decide how the repeats go on, in named tuples, by name."""

    def restore(self, saved: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
        """Continue a single repeat from what ``saved`` gave; returns the new parts."""
        found = {name: _restored(name, part, saved) for name, part in self.parts().items()}
        sums, counts = self.states.sums[0], self.states.counts[0]
        self.times[0] = sums[ks.EPOCH] + sums[ks.NOW]
        self.done = int(counts[ks.WALL_EVENTS] + counts[ks.PAIR_EVENTS])
        return found

    def saved(self) -> dict[str, NDArray[Any]]:
        """Copies of all arrays and numbers of a single repeat, for ``restore``."""
        return dict(chain.from_iterable(_saved(*part) for part in self.parts().items()))

    @abstractmethod
    def sample_to_end(self, grids: Grid, clocks: Floats, rows: Floats, histograms: Indices) -> None:
        """Complete the grids, and write a row for when each repeat's clocks show a time, s."""

    @abstractmethod
    def scenes_at(self, clocks: Floats) -> list[Scene]:
        """The scene of each repeat when its clocks show a time, s, at or after the last event."""

    def chunk(self, wanted: int, sink: Sink | None = None) -> int:
        """Simulate and record a chunk of events, up to ``wanted`` of each repeat; how many."""
        active, before, number = self.active, self.done, self.scenes[0].number
        epoch_length = clock.length(number)
        size = CHUNK if number < REORDERED else SMALL_CHUNK
        size = min(size, max(MOST_EVENTS // len(active), 1))
        limit = min(wanted - before, size, epoch_length - before % epoch_length)
        records = ks.new_record(len(active), limit if self.grids is None else 0)
        answers = np.zeros(len(active), dtype=np.int64)
        self.advance(records, answers, limit)
        epochs, clocks = self.states.sums[active][:, [ks.EPOCH, ks.NOW]].T
        counts = self.states.counts[active]
        done = counts[:, ks.WALL_EVENTS] + counts[:, ks.PAIR_EVENTS]
        self.times[active] = epochs + clocks
        if self.grids is None:
            self._keep(records, epochs.tolist(), (done - before).tolist(), sink)
        for row in np.flatnonzero((done > before) & (done % epoch_length == 0)).tolist():
            following = clock.following(float(epochs[row]), float(clocks[row]))
            self.next_epoch(int(active[row]), *following)
        ended = (done >= wanted) | (answers != FULL)
        for row in np.flatnonzero(ended).tolist():
            reached = done[row] >= wanted
            reason = StopReason.COLLISIONS if reached else _REASONS[int(answers[row])]
            self.reasons[active[row]] = reason
        self.active, self.done = active[~ended], int(np.max(done))
        return int(np.sum(done - before))

    def _keep(
        self, records: Recorded, epochs: list[float], numbers: list[int], sink: Sink | None
    ) -> None:
        """Keep the recorded events of each active repeat, or give them to the sink."""
        rows = zip(*records, self.active.tolist(), epochs, numbers, strict=True)
        for clocks, i, j, impulse, repeat, epoch, number in rows:
            time, residual = clock.times(epoch, clocks[:number])
            events = Events(time, i[:number], j[:number], impulse[:number], residual)
            (self.chunks[repeat].append if sink is None else sink)(events)

    def traces(self) -> list[Trace]:
        """Everything so far, as finished traces."""
        counts = self.states.counts.tolist()
        stops = [self._stop(repeat, count) for repeat, count in enumerate(counts)]
        times = [stop.time for stop in stops]
        clocks = np.array(times) - self.states.sums[:, ks.EPOCH]
        summaries = self._summaries(clocks, times)
        finishes = self.scenes_at(clocks)
        rows = zip(self.scenes, finishes, stops, counts, self.chunks, summaries, strict=True)
        return [
            Trace(
                start=start,
                finish=finish,
                stop=stop,
                wall_events=count[ks.WALL_EVENTS],
                pair_events=count[ks.PAIR_EVENTS],
                events=joined(chunks) if chunks else None,
                summary=summary,
                work=_work(count),
            )
            for start, finish, stop, count, chunks, summary in rows
        ]

    def _summaries(self, clocks: Floats, times: list[float]) -> Sequence[Summary | None]:
        """The summary of each repeat up to a time, given on its clocks too, s."""
        if self.grids is None:
            return [None] * len(times)
        rows = np.empty((len(times), sampling.COLUMNS))
        histograms = np.empty((len(times), SPEED_BINS), dtype=np.int32)
        self.sample_to_end(self.grids, clocks, rows, histograms)
        return [
            sampling.summary(sampling.grid_of(self.grids, repeat), *last)
            for repeat, last in enumerate(zip(times, rows, histograms, strict=True))
        ]

    def _stop(self, repeat: int, counts: list[int]) -> Stop:
        """How a repeat ended, with a message."""
        reason, now, limit = self.reasons[repeat], float(self.times[repeat]), self.time_limit
        events = counts[ks.WALL_EVENTS] + counts[ks.PAIR_EVENTS]
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
        labels = self.state_of(repeat).labels
        first, second = (
            int(labels[ball]) if ball >= 0 and len(labels) else ball
            for ball in (counts[ks.FIRST], counts[ks.SECOND])
        )
        if reason is StopReason.WALL_TRAP:
            lasts, given = self._bounces_to_come(repeat, counts[ks.FIRST], first)
            end, what = now + lasts, "stays at the wall, because the wall CoR is 0"
            if self.scenes[repeat].wall_restitution > 0.0:
                what = (
                    f"bounces infinitely often at the wall, until {end:.9g} s, and gives it "
                    f"{given:.6g} kg m/s more"
                )
            message = f"wall trap: from {now:.9g} s on, ball {first} {what}; {saved}"
            return Stop(reason, now, (first,), message, end, given)
        at_wall = second == CONTAINER
        pair = f"ball {first} and the wall" if at_wall else f"balls {first} and {second}"
        message = (
            f"{self._endless(repeat, first, at_wall)}: collisions continue, but time stays "
            f"at {now:.17g} s; the last collision is of {pair}; {saved}"
        )
        return Stop(reason, now, (first,) if at_wall else (first, second), message)

    def _bounces_to_come(self, repeat: int, column: int, ball: int) -> tuple[float, float]:
        """How long a trapped ball still bounces, s, and the impulse on the wall, kg m/s.

        Seen from a free container, a ball bounces as in a fixed one; its mass is the reduced one.
        """
        scene, state = self.scenes[repeat], self.state_of(repeat)
        if scene.wall_restitution == 0.0:
            return 0.0, 0.0
        row = state.balls[:4, column]
        if state.container is not None:
            row = row - state.container[:4]
        x, y, u, v = row.tolist()
        square, inward, cross = x * x + y * y, max(-(x * u + y * v), 0.0), abs(x * v - y * u)
        lasts = 2.0 * (square / cross) * chord_sum(inward / cross, scene.wall_restitution)
        mass = float(scene.masses[ball]) / (1.0 + float(scene.masses[ball]) / scene.container_mass)
        share = (1.0 + scene.wall_restitution) / (1.0 - scene.wall_restitution)
        return lasts, mass * share * inward / math.sqrt(square)

    @cached_property
    def _last_scenes(self) -> list[Scene]:
        """The scene of each repeat at its last event."""
        return self.scenes_at(self.states.sums[:, ks.NOW])

    def _endless(self, repeat: int, ball: int, at_wall: bool) -> str:
        """What has collisions without end, with this ball in the last of them."""
        scene, digit = self.scenes[repeat], clock.CLOCK_DIGITS * float(self.times[repeat])
        if at_wall and isinstance(scene.container, Circle):
            here = self._last_scenes[repeat]
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


def chord_sum(q: float, restitution: float) -> float:
    """Sum of q e^k/(1 + (q e^k)^2) over all k from 0, with only + - * / and roots, for equal bits.

    q : normal over tangential speed after a hit; 2 a/v_t times the sum is how long all chords last
    restitution : e of the wall, below 1

    Near e = 1 this is the formula of Euler and Maclaurin, with the arc tangent as the integral.
    """
    d, total = 1.0 - restitution, 0.0
    if d > NEARLY_ELASTIC:
        while FLAT < q < math.inf:
            total += q / (1.0 + q * q)
            q *= restitution
        return total + q / d
    h = d * (1.0 + d * (1 / 2 + d * (1 / 3 + d * (1 / 4 + d * (1 / 5 + d / 6)))))  # -ln e
    q = min(q, 1e150)  # whose square is finite; its arc tangent is already pi/2
    total = q / (1.0 + q * q) * (0.5 + h / 12.0 * (2.0 / (1.0 + q * q) - 1.0))
    for _ in range(HALVINGS):
        q = q / (1.0 + math.sqrt(1.0 + q * q))
    z = q * q
    arc = q * (1.0 - z * (1 / 3 - z * (1 / 5 - z * (1 / 7 - z / 9))))
    return total + 2.0**HALVINGS * arc / h


def _saved(name: str, part: Any) -> Iterator[tuple[str, NDArray[Any]]]:
    """Copies of the arrays and numbers of a part, by name."""
    if isinstance(part, tuple):
        for field, value in part._asdict().items():  # type: ignore[attr-defined]  # a NamedTuple
            yield from _saved(f"{name}.{field}", value)
    elif part is not None:
        yield name, np.array(part, order="C")


def _restored(name: str, part: Any, saved: Mapping[str, NDArray[Any]]) -> Any:
    """A part with what was saved: arrays keep their memory and its order."""
    if isinstance(part, tuple):
        values = part._asdict()  # type: ignore[attr-defined]  # a NamedTuple
        return type(part)(*(_restored(f"{name}.{key}", values[key], saved) for key in values))
    if isinstance(part, np.ndarray):
        part[...] = saved[name]
        return part
    return None if part is None else type(part)(saved[name])


def _work(counts: list[int]) -> Work:
    """The kernel's work, from ``State.counts``."""
    walls, pairs, crossings = (counts[k] for k in (ks.WALL_EVENTS, ks.PAIR_EVENTS, ks.CROSSINGS))
    return Work(
        predictions=counts[ks.PREDICTIONS],
        crossings=crossings,
        queue_updates=walls + 2 * pairs + crossings + counts[ks.STALE],
    )


class AllPairs(Engine):
    """Few balls in a circle: one call of the kernel simulates all repeats."""

    def __init__(
        self, scenes: Sequence[Scene], time_limit: float = math.inf, summary: bool = False
    ) -> None:
        super().__init__(scenes, time_limit, summary)
        self.agendas = all_pairs.new_agendas(len(scenes), scenes[0].number)

    def advance(self, records: Recorded, answers: Integers, limit: int) -> None:
        states, slides = self.states, self.states.slides
        all_pairs.advance(
            states, slides, self.agendas, records, self.grids, self.active, answers, limit
        )

    def state_of(self, repeat: int) -> State:
        return ks.state_of(self.states, repeat)

    def next_epoch(self, repeat: int, epoch: float, shift: float) -> None:
        self.state_of(repeat).next_epoch(epoch, shift)
        self.agendas.times[repeat] -= shift

    def parts(self) -> dict[str, Any]:
        return {"states": self.states, "agendas": self.agendas, "grids": self.grids}

    def sample_to_end(self, grids: Grid, clocks: Floats, rows: Floats, histograms: Indices) -> None:
        states, slides = self.states, self.states.slides
        sampling.sample_to_end(clocks, grids, states, slides, rows, histograms)

    def scenes_at(self, clocks: Floats) -> list[Scene]:
        balls, container = self.states.balls, self.states.container
        if self.states.slides is not None:
            balls = balls.copy()
            turn_all(clocks, balls, self.states.slides)
        x, y, u, v, at = balls.transpose(1, 0, 2)
        ages = clocks[:, np.newaxis] - at
        positions = np.stack([x + u * ages, y + v * ages], axis=2)
        positions += np.stack([ks.origin_of(scene) for scene in self.scenes])[:, np.newaxis]
        moved = [
            replace(scene, positions=position, velocities=velocity)
            for scene, position, velocity in zip(
                self.scenes, positions, np.stack([u, v], axis=2), strict=True
            )
        ]
        if container is None:
            return moved
        velocities = container[:, 2:4].copy()
        places = container[:, :2] + velocities * (clocks - container[:, 4])[:, np.newaxis]
        return [
            replace(scene, container_position=place, container_velocity=velocity)
            for scene, place, velocity in zip(moved, places, velocities, strict=True)
        ]


class InCells(Engine):
    """Many balls, or a box: a single repeat."""

    def __init__(
        self, scenes: Sequence[Scene], time_limit: float = math.inf, summary: bool = False
    ) -> None:
        (self.scene,) = scenes
        super().__init__(scenes, time_limit, summary)
        self.state = ks.state_of(self.states, 0)
        self.grid = None if self.grids is None else sampling.grid_of(self.grids, 0)
        self.cells = cell_grid.new_cells(
            self.scene, cell_side(self.scene), self.state.balls, new_tree(self.scene.number)
        )
        self.ordered_at = 0
        self.renewed_at = 0.0
        self._renew_margin(0.0)
        self._fill(capacity=4)

    def _memory(self) -> Floats:
        """Stacked memory in which each ball is a line of the processor's cache."""
        number = self.scene.number
        memory = ks.aligned_zeros(cell_grid.CELL_BALL_ROWS * number)
        return memory.reshape(number, -1).T[np.newaxis]

    def advance(self, records: Recorded, answers: Integers, limit: int) -> None:
        answers[0] = self.advance_one(Recorded(*(column[0] for column in records)), limit)

    def advance_one(self, recorded: Recorded, limit: int) -> int:
        """Simulate at most ``limit`` events; why it stopped."""
        if self.scene.number >= REORDERED:
            self._keep_order()
        begun, renewals = self.state.collisions, 0
        while True:
            done = self.state.collisions - begun
            rest = recorded.part(slice(done, None))
            answer = int(cells.advance(self.state, self.cells, rest, self.grid, limit - done))
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

    def state_of(self, repeat: int) -> State:
        return self.state

    def next_epoch(self, repeat: int, epoch: float, shift: float) -> None:
        self.state.next_epoch(epoch, shift)
        self.state.balls[[cell_grid.CONTACT_TIME, cell_grid.CROSSING_TIME]] -= shift
        self.cells.tree.times[:] -= shift  # what is equal stays equal: nodes and children agree
        self.renewed_at -= shift
        if self.cells.margin is not None:
            self.cells.margin.place[cell_grid.UNTIL] -= shift

    def parts(self) -> dict[str, Any]:
        names = ("state", "cells", "grid", "ordered_at", "renewed_at")
        return {name: getattr(self, name) for name in names}

    def restore(self, saved: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
        self.state = self.state._replace(labels=np.zeros_like(saved["state.labels"]))
        self._fill(saved["cells.members"].shape[1])
        found = super().restore(saved)
        vars(self).update(found)
        return found

    def sample_to_end(self, grids: Grid, clocks: Floats, rows: Floats, histograms: Indices) -> None:
        end, state = float(clocks[0]), self.state
        sampling.sample_until(end, sampling.grid_of(grids, 0), state, None)
        sampling.sample(rows[0], histograms[0], end, state, state.container, None)

    def scenes_at(self, clocks: Floats) -> list[Scene]:
        scene, state, time = self.scene, self.state, clocks[0]
        balls, labels, container = state.balls, state.labels, state.container
        origin = ks.origin_of(scene)
        positions, velocities = np.empty((2, scene.number, 2))
        # Not all at once: of a million balls, new memory would take a third of a second.
        for first in range(0, scene.number, SMALL_CHUNK):
            some = slice(first, first + SMALL_CHUNK)
            x, y, u, v, at = balls[: ks.BALL_ROWS, some]
            ages = time - at
            position = np.column_stack([x + u * ages, y + v * ages])
            if state.period is not None:
                position -= state.period * np.rint(position / state.period)
            columns = labels[some] if len(labels) else some
            positions[columns] = position + origin
            velocities[columns] = np.column_stack([u, v])
        moved = replace(scene, positions=positions, velocities=velocities)
        if container is None:
            return [moved]
        velocity = container[2:4].copy()
        place = container[:2] + velocity * (time - container[4])
        return [replace(moved, container_position=place, container_velocity=velocity)]

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
        balls = self._memory()[0]
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
    return int(min((FEW_IN_FREE if free else FEW) / (root * math.sqrt(root)), MOST))


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
    checkpoint: Mapping[str, NDArray[Any]] | None = None,
) -> Trace:
    """Simulate a scene until a number of collisions or a time, whichever comes first.

    collisions : ball-ball and wall collisions together
    time : s
    summary : record observables on a grid of times instead of the events
    watch : called after each chunk with the number of new events; a true answer stops the run
    sink : called with the events of each chunk; the trace then has none, so memory stays bounded
    engine : "allpairs" or "cells" instead of the faster one
    checkpoint : of the trace of the same call that ``watch`` stopped; the repeat then goes on from
        there with the same bits, and only later events are recorded

    Raises ``ValueError`` if neither limit is given, or if the engine cannot simulate the scene.
    """
    if collisions is None and time is None:
        raise ValueError("a run needs a number of collisions or a time to end at")
    wanted = ks.NO_LIMIT if collisions is None else collisions
    run = engine_for(scene, engine)([scene], math.inf if time is None else time, summary)
    if checkpoint is not None:
        run.restore(checkpoint)
    stop_wanted: object = False
    while len(run.active) and not stop_wanted:
        number = run.chunk(wanted, sink)
        stop_wanted = watch is not None and watch(number)
    saved = run.saved() if len(run.active) else None  # before the last row of a summary
    (trace,) = run.traces()
    return replace(trace, checkpoint=saved)


def simulate_batch(
    scenes: Sequence[Scene],
    *,
    collisions: int | None = None,
    time: float | None = None,
    summary: bool = False,
    watch: Callable[[int], object] | None = None,
    engine: str | None = None,
) -> list[Trace]:
    """Simulate repeats of one point, with few balls in one call; the traces are ``simulate``'s.

    scenes : they differ in positions and velocities only
    collisions, time, summary, engine : as in ``simulate``
    watch : called after each chunk with the number of new events of all; it may raise

    Raises ``ValueError`` if scenes differ otherwise, and in the cases of ``simulate``.
    """
    if collisions is None and time is None:
        raise ValueError("a run needs a number of collisions or a time to end at")
    if not scenes:
        return []
    _check_alike(scenes)
    tell = watch or (lambda _: None)
    kind = engine_for(scenes[0], engine)
    # Cells take as long as one repeat after the other: their kernel is called for each.
    wanted = ks.NO_LIMIT if collisions is None else collisions
    size = 1 if kind is InCells else MOST_SUMMARIES if summary else len(scenes)
    traces: list[Trace] = []
    for first in range(0, len(scenes), size):
        run = kind(scenes[first : first + size], math.inf if time is None else time, summary)
        while len(run.active):
            tell(run.chunk(wanted))
        traces += run.traces()
    return traces


def _check_alike(scenes: Sequence[Scene]) -> None:
    """Raise ``ValueError`` if scenes differ in more than positions and velocities."""
    first, *others = scenes
    rules = _rules(first)
    for other in others:
        alike = all(
            getattr(first, name) is getattr(other, name)
            or np.array_equal(getattr(first, name), getattr(other, name))
            for name in ("radii", "masses")
        )
        if not alike or _rules(other) != rules:
            raise ValueError("the scenes of a batch differ in more than positions and velocities")


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
        "unequal balls": not scene.equal_balls,
        "sliding along the wall": scene.slides,
    }


_rules = attrgetter(
    "container",
    "container_mass",
    "restitution",
    "wall_restitution",
    "contact_duration",
    "elastic_below",
    "slides",
)

_REASONS = {
    clock.TIME: StopReason.TIME,
    clock.NOTHING_LEFT: StopReason.NOTHING_LEFT,
    clock.WALL_TRAP: StopReason.WALL_TRAP,
    clock.COLLAPSE: StopReason.COLLAPSE,
}
