"""A scene in, a trace out: both engines, and a repeat in chunks that can be watched and stopped."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from decimal import Context, Decimal
from itertools import chain, combinations
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import Circle
from snooker_cli.engine import all_pairs, cell_grid, cells, clock, sampling
from snooker_cli.engine import cell_memory as cm
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.clock import CELL_FULL, FULL, IDLE, NOTHING_LEFT, OUT_OF_MARGIN
from snooker_cli.engine.contact import never_meet
from snooker_cli.engine.conversion import (
    check_restored,
    copied,
    new_states,
    require,
    restored,
    scenes_at,
    within,
)
from snooker_cli.engine.event_queue import new_tree, nodes_agree
from snooker_cli.engine.kernel_state import Floats, Indices, Integers, Recorded, State, UnequalBalls
from snooker_cli.engine.sampling import Grid
from snooker_cli.engine.sliding import bounces_to_come
from snooker_cli.laws import Constant
from snooker_cli.scene import Scene
from snooker_cli.trace import (
    CONTAINER,
    SPEED_BINS,
    Events,
    Stop,
    StopReason,
    Summary,
    Trace,
    joined,
)

Sink: TypeAlias = Callable[[Events], None]
CHUNK, SMALL_CHUNK = 65536, 8192
"""Events until the user can stop a repeat, some 30 ms; and of ``REORDERED`` balls or more."""

MOST_EVENTS, MOST_SUMMARIES = 700_000, 64
"""Events of a chunk of many repeats, and summaries of one call: some 16 MB."""

REORDERED = 4096
"""Balls from which on those in neighbouring cells are kept near each other in memory."""

REORDER_AFTER = 20  # events per ball after which balls are put into the order of their cells again

FEW, FEW_IN_FREE, MOST = 48, 150, 1000
"""Balls up to which all pairs are faster than cells, times the packing to the 3/8; at most."""

BALLS_PER_CELL, DILUTE = 1.0, 0.4
"""In a packed gas, and in a dilute one over the cube root of the packing."""

IDLE_CALLS = 100
"""Calls in a row of only crossings after which a repeat without a time limit ends, 10 s."""

MOST_PROVEN = 1000  # balls up to which all pairs are looked at before that

RENEWAL = 400  # cost of predicting all again, in crossings

MOTION = {"positions", "velocities", "container_position", "container_velocity", "wall_key"}
"""The fields of a scene in which repeats of a point may differ."""


# Repeats under way, and the two engines


class Engine(ABC):
    """Repeats of one point under way: their arrays, and what has been recorded.

    states : stacked
    active : (*a*,), the repeats that have not ended; all have had ``done`` events
    grids : stacked; ``None`` if events are recorded
    reasons : why each repeat ended; ``INTERRUPTED`` while it is active
    times : (*repeats*,), of the last event, s
    chunks : of each repeat, its events so far
    parts : the names of all that decides how the repeats go on: named tuples of arrays and numbers

    Raises ``ValueError`` if neither limit is given.
    """

    parts: ClassVar[tuple[str, ...]] = ("states", "grids")

    def __init__(
        self,
        scenes: Sequence[Scene],
        collisions: int | None,
        time: float | None,
        summary: bool = False,
    ) -> None:
        if collisions is None and time is None:
            raise ValueError("a simulation needs a number of collisions or a time to end at")
        self.scenes, repeats = scenes, len(scenes)
        self.wanted = ks.NO_LIMIT if collisions is None else collisions
        self.time_limit = math.inf if time is None else time
        self.states = new_states(scenes, self.time_limit, self._memory())
        self.grids = sampling.new_grids(scenes) if summary else None
        self.active, self.done = np.arange(repeats), 0
        self.reasons = [StopReason.INTERRUPTED] * repeats
        self.times = np.zeros(repeats)
        self.chunks: list[list[Events]] = [[] for _ in scenes]
        self._begin()

    def _memory(self) -> Floats | None:
        """Memory for the balls, stacked; ``None`` for an array in rows."""
        return None

    @abstractmethod
    def _begin(self) -> None:
        """Make what only this engine has."""

    @abstractmethod
    def advance(self, records: Recorded, answers: Integers, limit: int) -> None:
        """Simulate at most ``limit`` events of each active repeat, and answer why it stopped.

        records, answers : a row for each active repeat
        """

    def next_epoch(self, repeat: int, epoch: float, shift: float) -> None:
        """Set all clocks of a repeat back by a shift, s, to the beginning of an epoch."""
        ks.state_of(self.states, repeat).next_epoch(epoch, shift)

    def restore(self, saved: Mapping[str, NDArray[Any]]) -> None:
        """Continue a single repeat from what ``saved`` gave.

        Raises ``CheckpointError`` for arrays that no repeat of this scene has.
        """
        for name in self.parts:
            setattr(self, name, restored(name, getattr(self, name), saved))
        check_restored(self.states, new_states(self.scenes))
        if self.grids is not None:
            used, early, step = self.grids.used, self.grids.early, self.grids.step
            require(within(used, 0, sampling.ROWS + 2) and np.all((step > 0) & (step < math.inf)))
            require(within(early, 0, sampling.EARLY_ROWS + 1))
        self._check_restored()
        sums, counts = self.states.sums[0], self.states.counts[0]
        self.times[0] = sums[ks.EPOCH] + sums[ks.NOW]
        self.done = int(counts[ks.WALL_EVENTS] + counts[ks.PAIR_EVENTS])
        require(self.done <= self.wanted)

    @abstractmethod
    def _check_restored(self) -> None:
        """Raise ``CheckpointError`` for damage in what only this engine has."""

    def saved(self) -> dict[str, NDArray[Any]]:
        """Copies of all arrays and numbers of a single repeat, for ``restore``."""
        return dict(chain.from_iterable(copied(name, getattr(self, name)) for name in self.parts))

    @abstractmethod
    def sample_to_end(self, grids: Grid, clocks: Floats, rows: Floats, histograms: Indices) -> None:
        """Complete the grids, and write a row for when each repeat's clocks show a time, s."""

    def chunk(self, sink: Sink | None = None) -> int:
        """Simulate a chunk of events, and keep them or give them to the sink; how many."""
        active, before, number = self.active, self.done, self.scenes[0].number
        epoch_length = clock.length(number)
        size = CHUNK if number < REORDERED else SMALL_CHUNK
        size = min(size, max(MOST_EVENTS // len(active), 1))
        limit = min(self.wanted - before, size, epoch_length - before % epoch_length)
        shape = len(active), limit if self.grids is None else 0
        first, second = np.empty((2, *shape), dtype=np.int32)
        records = Recorded(np.empty(shape), first, second, np.empty(shape))
        answers = np.zeros(len(active), dtype=np.int64)
        self.advance(records, answers, limit)
        epochs, clocks = self.states.sums[active][:, [ks.EPOCH, ks.NOW]].T
        counts = self.states.counts[active]
        done = counts[:, ks.WALL_EVENTS] + counts[:, ks.PAIR_EVENTS]
        self.times[active] = epochs + clocks
        if self.grids is None:
            rows = active.tolist(), epochs.tolist(), (done - before).tolist()
            for *columns, repeat, epoch, new in zip(*records, *rows, strict=True):
                if new == 0 and self.chunks[repeat]:
                    continue
                if new < limit:  # a view would keep the whole chunk in memory
                    columns = [column[:new].copy() for column in columns]
                clock_times, i, j, impulse = columns
                time, residual = clock.times(epoch, clock_times)
                events = Events(time, i, j, impulse, residual)
                (self.chunks[repeat].append if sink is None else sink)(events)
        for row in np.flatnonzero((done > before) & (done % epoch_length == 0)).tolist():
            following = clock.following(float(epochs[row]), float(clocks[row]))
            self.next_epoch(int(active[row]), *following)
        ended = (done >= self.wanted) | (answers != FULL)
        for row in np.flatnonzero(ended).tolist():
            reason = 0 if done[row] >= self.wanted else int(answers[row])
            self.reasons[active[row]] = list(StopReason)[reason]
        self.active, self.done = active[~ended], int(np.max(done))
        return int(np.sum(done - before))

    def traces(self) -> list[Trace]:
        """Everything so far, as finished traces."""
        counts = self.states.counts.tolist()
        stops = [self._stop(repeat, count) for repeat, count in enumerate(counts)]
        times = [stop.time for stop in stops]
        clocks = np.array(times) - self.states.sums[:, ks.EPOCH]
        summaries = self._summaries(clocks, times)
        finishes = scenes_at(self.scenes, self.states, clocks)
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
            )
            for start, finish, stop, count, chunks, summary in rows
        ]

    def _summaries(self, clocks: Floats, times: list[float]) -> Sequence[Summary | None]:
        """The summary of each repeat up to a time, given on its clocks too, s."""
        if self.grids is None:
            return [None] * len(times)
        rows = np.empty((len(times), sampling.columns_of(self.scenes[0])))
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
        messages = {
            StopReason.COLLISIONS: f"{events:,} collisions reached at {now:.9g} s",
            StopReason.TIME: f"{limit:.9g} s reached after {events:,} collisions",
            StopReason.NOTHING_LEFT: (
                f"no further collision can happen after {events:,}, at {now:.9g} s"
            ),
            StopReason.IDLE: (
                f"no collision in {IDLE_CALLS * cells.CROSSINGS_AT_ONCE:,} crossings of cells "
                f"after {events:,} collisions, at {now:.9g} s; give a time to end at"
            ),
            StopReason.INTERRUPTED: f"interrupted after {events:,} collisions at {now:.9g} s",
        }
        if reason in messages:
            waits = reason in (StopReason.TIME, StopReason.NOTHING_LEFT) and math.isfinite(limit)
            return Stop(reason, limit if waits else now, (), messages[reason])
        saved = "1 collision is saved" if events == 1 else f"{events:,} collisions are saved"
        scene, labels, column = self.scenes[repeat], self.states.labels, counts[ks.FIRST]
        first, second = (
            int(labels[ball]) if ball >= 0 and len(labels) else ball
            for ball in (column, counts[ks.SECOND])
        )
        if reason is StopReason.WALL_TRAP:
            lasts, given = bounces_to_come(column, ks.state_of(self.states, repeat))
            end, what = now + lasts, "stays at the wall, because the wall CoR is 0"
            if not isinstance(scene.wall_law, Constant):
                what = (
                    f"bounces ever faster at the wall: it stops until {end:.9g} s and gives it at "
                    f"most {given:.6g} kg m/s more, if no other ball hits it"
                )
            elif scene.wall_restitution > 0.0:
                what = (
                    f"bounces infinitely often at the wall, until {end:.9g} s, and gives it "
                    f"{given:.6g} kg m/s more"
                )
            message = f"wall trap: from {now:.9g} s on, ball {first} {what}; {saved}"
            return Stop(reason, now, (first,), message, end, given)
        balls, pair, cor = [first, second], f"balls {first} and {second}", scene.restitution
        if second == CONTAINER:
            balls, pair, cor = [first], f"ball {first} and the wall", scene.wall_restitution
        # An elastic ball that moves along the wall touches it at every moment, and loses nothing.
        what = "inelastic collapse" if cor < 1.0 else "collisions without end"
        message = (
            f"{what}: collisions continue, but time stays "
            f"at {now:.17g} s; the last collision is of {pair}; {saved}"
        )
        return Stop(reason, now, tuple(balls), message)


class AllPairs(Engine):
    """Few balls in a circle: one call of the kernel simulates all repeats."""

    parts = (*Engine.parts, "agendas")

    def _begin(self) -> None:
        self.agendas = all_pairs.new_agendas(len(self.scenes), self.scenes[0].number)

    def advance(self, records: Recorded, answers: Integers, limit: int) -> None:
        all_pairs.advance(
            self.states, self.agendas, records, self.grids, self.active, answers, limit
        )

    def next_epoch(self, repeat: int, epoch: float, shift: float) -> None:
        super().next_epoch(repeat, epoch, shift)
        self.agendas.times[repeat] -= shift

    def sample_to_end(self, grids: Grid, clocks: Floats, rows: Floats, histograms: Indices) -> None:
        sampling.sample_to_end(clocks, grids, self.states, rows, histograms)

    def _check_restored(self) -> None:
        times, links, number = *self.agendas, self.scenes[0].number
        require(np.all(times >= 0.0) and np.all(times[:, :, number:] == math.inf))
        require(within(links[:, all_pairs.PARTNER], ks.NOT_SEARCHED, number))
        require(within(links[:, all_pairs.LAST], ks.NO_PARTNER, number))
        require(links[:, [all_pairs.EVENTS, all_pairs.BOUNCES]] >= 0)


class InCells(Engine):
    """Many balls, or a box: a single repeat."""

    parts = (*Engine.parts, "cells", "ordered_at", "renewed_at", "idle")

    def _begin(self) -> None:
        (self.scene,) = self.scenes
        self.grid = None if self.grids is None else sampling.grid_of(self.grids, 0)
        scene, tree = self.scene, new_tree(self.scene.number)
        # With n balls per area and a mean free path l, crossings cost as l / side and searches as
        # n side^2. At the least, n side^2 goes as the inverse cube root of the packing. The cells
        # decide bits, and libraries of C round powers differently; this one is rounded correctly.
        root = Context(prec=40).power(Decimal(scene.packing_fraction), Decimal(-1 / 3))
        balls = max(BALLS_PER_CELL, DILUTE * float(root))
        side = math.sqrt(balls * scene.container.area / scene.number)
        self.cells = cell_grid.new_cells(scene, side, self.state.balls, tree)
        self.ordered_at = self.idle = 0
        self.renewed_at = 0.0
        self._renew_margin(0.0)
        self._fill()

    @property
    def state(self) -> State:
        return ks.state_of(self.states, 0)

    def _memory(self) -> Floats:
        """Stacked memory in which each ball is a line of the processor's cache."""
        return cm.ball_memory(self.scenes[0].number)[np.newaxis]

    def advance(self, records: Recorded, answers: Integers, limit: int) -> None:
        if self.scene.number >= REORDERED:
            self._keep_order()
        begun, renewals, answer = self.state.collisions, 0, CELL_FULL
        while answer in (CELL_FULL, OUT_OF_MARGIN):
            done = self.state.collisions - begun
            rest = Recorded(*(column[0][done:] for column in records))
            answer = int(cells.advance(self.state, self.cells, rest, self.grid, limit - done))
            if answer == CELL_FULL:
                self._fill(2 * self.cells.members.shape[1])
            elif answer == OUT_OF_MARGIN and self.cells.margin is not None:
                self._renew_margin(float(self.cells.margin.place[cells.UNTIL]))
                self._fill()
                renewals += 1
                if renewals * (RENEWAL + self.scene.number) >= cells.CROSSINGS_AT_ONCE:
                    answer = FULL
        self.idle = self.idle + 1 if answer == FULL and self.state.collisions == begun else 0
        # No velocity changes while a repeat is idle, and one proof is enough.
        if self.idle == 1 and self._nothing_can_meet():
            answer = NOTHING_LEFT
        endless = self.scene.container.period is not None and self.time_limit == math.inf
        answers[0] = IDLE if endless and self.idle >= IDLE_CALLS else answer

    def next_epoch(self, repeat: int, epoch: float, shift: float) -> None:
        super().next_epoch(repeat, epoch, shift)
        self.state.balls[[cm.CONTACT_TIME, cm.CROSSING_TIME]] -= shift
        self.cells.tree.times[:] -= shift  # what is equal stays equal: nodes and children agree
        self.renewed_at -= shift
        if self.cells.margin is not None:
            self.cells.margin.place[cells.UNTIL] -= shift

    def restore(self, saved: Mapping[str, NDArray[Any]]) -> None:
        labels, members = (
            np.asarray(saved.get(name)) for name in ("states.labels", "cells.members")
        )
        require(labels.ndim == 1 and len(labels) in (0, self.scene.number))
        require(members.ndim == 2 and len(members) == len(self.cells.members))
        require(members.shape[1] >= cm.LEAST_MEMBERS)
        self.states = self.states._replace(labels=np.zeros(len(labels), dtype=np.int32))
        self._fill(members.shape[1])
        self.mesh = self.cells.mesh
        super().restore(saved)

    def _check_restored(self) -> None:
        balls, links, number = self.state.balls, self.cells.links, self.scene.number
        members, occupancy, mesh = self.cells.members, self.cells.occupancy, self.cells.mesh
        corner = [mesh.left, mesh.bottom]
        require(mesh._replace(left=self.mesh.left, bottom=self.mesh.bottom) == self.mesh)
        require(np.isfinite([*corner, self.renewed_at]))
        require(~np.isnan(balls[[cm.CONTACT_TIME, cm.CROSSING_TIME]]))
        require(within(self.cells.tags[cm.FORMER], ks.NO_PARTNER, number))
        require(within(links[cm.PARTNER], ks.NOT_SEARCHED, number))
        require(links[cm.BOUNCES] >= 0)
        # Each ball is where its links say, and cells have no other members.
        cell, row = links[cm.CELL], links[cm.PLACE]
        require(within(members, 0, number) and within(cell, 0, len(members)))
        counted = np.bincount(cell, minlength=len(members))
        require((occupancy == counted) & (counted <= members.shape[1]))
        require((row >= 0) & (row < occupancy[cell]))
        require(members[cell, row] == np.arange(number))
        require(nodes_agree(self.cells.tree))
        if self.cells.margin is not None:
            place, brink, (brinks,) = self.cells.margin
            require(0 <= brinks <= number and not np.any(np.isnan(place)))
            require(np.array_equal(np.sort(brink[:brinks]), np.flatnonzero(links[cm.BRINK])))
        require(self.idle >= 0 and self.ordered_at >= 0)

    def sample_to_end(self, grids: Grid, clocks: Floats, rows: Floats, histograms: Indices) -> None:
        sampling.sample_until(float(clocks[0]), sampling.grid_of(grids, 0), self.state)
        sampling.sample(rows[0], histograms[0], 0.0, self.state)

    def _nothing_can_meet(self) -> bool:
        """Whether it is certain that no ball meets another, or the wall of a free container."""
        state, number = self.state, self.scene.number
        container = self.scene.container
        velocities, period = state.balls[[ks.U, ks.V]], container.period
        if container.has_wall and period is not None and np.any(velocities[0]):
            return False
        if self.scene.free:
            velocities = np.column_stack([velocities, state.boundary.motion[[ks.U, ks.V]]])
        # Of the least speeds the square is zero, and predictions find no contact.
        if not np.any(np.ptp(velocities, axis=1) ** 2):
            return period is not None or self.scene.free
        if period is None or number > MOST_PROVEN:
            return False
        balls, radii = state.balls[: ks.BALL_ROWS].T.tolist(), self.scene.radii
        # In a channel no ball moves across by now, and no image across is nearer than the ball.
        return all(
            never_meet(balls[i], balls[k], radii[i] + radii[k], container.size)
            for i, k in combinations(range(number), 2)
        )

    def _fill(self, capacity: int | None = None) -> None:
        """Put the balls into cells, perhaps of another capacity, and predict everything."""
        if capacity is not None:
            members, near = cm.room_for(capacity, len(self.cells.occupancy))
            self.cells = self.cells._replace(members=members, near=near)
        # As of the last event, or of when cells were put round a free container since.
        now = max(float(self.state.sums[ks.NOW]), self.renewed_at)
        if self.cells.margin is not None:
            self.cells.margin.brinks[0] = 0
        self.cells.links[cm.BRINK] = 0
        if not cells.fill(now, self.state, self.cells):
            self._fill(2 * self.cells.members.shape[1])

    def _renew_margin(self, now: float) -> None:
        """Put cells round a free container's place at a time, s."""
        if self.scene.free:
            self.cells = cells.with_margin(self.cells, self.state.boundary.motion, now)
            self.renewed_at = now

    def _keep_order(self) -> None:
        """Put the balls into the order of their cells, if there have been events enough."""
        state, old = self.state, self.cells
        labels, number = state.labels, self.scene.number
        if len(labels) and state.collisions < self.ordered_at + REORDER_AFTER * number:
            return
        order = np.argsort(old.links[cm.CELL], kind="stable")
        rank = np.empty(number, dtype=np.int32)
        rank[order] = np.arange(number, dtype=np.int32)
        sizes = state.sizes
        if isinstance(sizes, UnequalBalls):
            sizes = UnequalBalls(sizes.radii[order], sizes.masses[order])
        memory = self._memory()
        balls = memory[0]
        np.take(state.balls.T, order, axis=0, out=balls.T)
        self.states = self.states._replace(
            balls=memory,
            labels=(labels if len(labels) else np.arange(number, dtype=np.int32))[order],
            sizes=sizes,
        )
        links = np.asfortranarray(old.links[:, order])
        self.cells = old._replace(links=links, tags=cm.tags_of(balls))
        former = self.cells.tags[cm.FORMER]
        former[former >= 0] = rank[former[former >= 0]]
        self.ordered_at = state.collisions
        self._fill()


def engine_for(scene: Scene, name: str | None = None) -> type[AllPairs] | type[InCells]:
    """The faster engine for a scene, or that of a name: "allpairs" or "cells".

    Raises ``ValueError`` for another name, for all pairs in a box, and for balls that slide in
    cells or outside of a fixed circle.
    """
    in_circle = isinstance(scene.container, Circle)
    few = scene.number <= few_at(scene.packing_fraction, free=scene.free)
    chosen = name or ("allpairs" if in_circle and (few or scene.slides) else "cells")
    if chosen not in ("allpairs", "cells"):
        raise ValueError(f"there is no engine {name}: use allpairs or cells")
    if scene.slides and (chosen == "cells" or scene.free):
        raise ValueError("only engine allpairs lets balls slide, along the fixed wall of a circle")
    if chosen == "allpairs" and not in_circle:
        raise ValueError(f"the engine allpairs knows no {scene.container.title}: use cells")
    return AllPairs if chosen == "allpairs" else InCells


def few_at(packing_fraction: float, *, free: bool) -> int:
    """Balls in a circle up to which all pairs are faster than cells, see docs/engine.md."""
    # Of square roots, which are exactly rounded: a scene gets the same engine on every machine.
    root = math.sqrt(math.sqrt(packing_fraction))
    return int(min((FEW_IN_FREE if free else FEW) / (root * math.sqrt(root)), MOST))


# A repeat


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
    watch : called after each chunk with the number of new events; a true answer stops the repeat
    sink : called with the events of each chunk; the trace then has none, so memory stays bounded
    engine : "allpairs" or "cells" instead of the faster one
    checkpoint : of the trace of the same call that ``watch`` stopped; the repeat then goes on from
        there with the same bits, and only later events are recorded

    Raises ``ValueError`` if neither limit is given, or if the engine cannot simulate the scene.
    """
    run = engine_for(scene, engine)([scene], collisions, time, summary)
    if checkpoint is not None:
        run.restore(checkpoint)
    while len(run.active):
        number = run.chunk(sink)
        if watch is not None and watch(number):
            break
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
    if not scenes:
        return []
    for name in vars(scenes[0]).keys() - MOTION:
        first, *others = (getattr(scene, name) for scene in scenes)
        if not all(other is first or np.array_equal(other, first) for other in others):
            raise ValueError("the scenes of a batch differ in more than positions and velocities")
    tell = watch or (lambda _: None)
    kind = engine_for(scenes[0], engine)
    # Cells take as long as one repeat after the other: their kernel is called for each.
    size = 1 if kind is InCells else MOST_SUMMARIES if summary else len(scenes)
    traces: list[Trace] = []
    for begin in range(0, len(scenes), size):
        run = kind(scenes[begin : begin + size], collisions, time, summary)
        while len(run.active):
            tell(run.chunk())
        traces += run.traces()
    return traces


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
