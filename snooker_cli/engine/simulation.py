"""A scene in, a trace out: a repeat in chunks that can be watched and stopped."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain, combinations, islice
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import Circle
from snooker_cli.engine import cell_grid, cells, clock, event_loop, everyone, sampling
from snooker_cli.engine import cell_memory as cm
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.clock import (
    CELL_FULL,
    FULL,
    IDLE,
    NEW_FRAME,
    NOTHING_LEFT,
    OUT_OF_MARGIN,
    TIME,
)
from snooker_cli.engine.contact import never_meet
from snooker_cli.engine.conversion import copied, new_states, restored, scenes_at
from snooker_cli.engine.event_queue import new_tree
from snooker_cli.engine.frames import FARTHEST, MovingFrame
from snooker_cli.engine.kernel_state import Floats, Indices, Integers, Records, State, UnequalBalls
from snooker_cli.engine.prefetch import PROGRESS, no_chains
from snooker_cli.engine.sliding import bounces_to_come
from snooker_cli.fields import MOVING, record_type_of
from snooker_cli.laws import Constant
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, Events, Snapshots, Stop, StopReason, Summary, Trace, joined

Sink: TypeAlias = Callable[[Events], None]
Watch: TypeAlias = Callable[[int, float], object]
StateSink: TypeAlias = Callable[[float, Scene], None]
CHUNK, SMALL_CHUNK = 65536, 8192
"""Events until the user can stop a repeat, some 30 ms; and of ``REORDERED`` balls or more."""

MOST_EVENTS, MOST_SUMMARIES = 700_000, 64
"""Events of a chunk of many repeats, and summaries of one call: some 16 MB."""

REORDERED = 4096
"""Balls from which on those in neighbouring cells are kept near each other in memory."""

REORDER_AFTER = 20  # events per ball after which balls are put into the order of their cells again

FEW, FEW_IN_FREE, MOST = 48, 150, 1000
"""Balls up to which a search among everyone is faster, times the packing to the 3/8; at most."""

BALLS_PER_CELL, DILUTE = 1.0, 0.4
"""In a packed gas, and in a dilute one over the cube root of the packing."""

IDLE_CALLS = 100
"""Calls in a row of only crossings after which a repeat without a time limit ends, 10 s."""

MOST_PROVEN = 1000  # balls of which all pairs are looked at before that

PAIRS_AT_ONCE = 1000  # of these, until the user can stop the repeat: 0.1 s, because they are exact

RENEWAL = 400  # cost of predicting all again, in crossings

MOTION = {"wall_key", *(field.name for field in MOVING)}
"""The fields of a scene in which repeats of a point may differ."""


# Repeats under way


class Simulation(ABC):
    """Repeats of one point under way: their arrays, and what has been recorded.

    states : stacked; they alone decide how the repeats go on
    search : what each ball does next, found anew from the states at any time
    active : (*a*,), the repeats that have not ended; all have had ``done`` events
    samples : stacked, of summaries
    reasons : why each repeat ended; ``INTERRUPTED`` while it is active
    times : (*repeats*,), of the last event, s
    chunks : of each repeat, its events so far
    snapshots : times at which a single repeat gives its state, s, ascending
    taken : how many of them it has given
    at_snapshot : whether the last chunk ended there, so that no event is at its end

    Raises ``ValueError`` if neither limit is given, if balls should slide elsewhere than along the
    fixed wall of a circle, or among neighbours, and for times of snapshots that do not ascend from
    0 on, or of several repeats.
    """

    search: Any
    lets_slide: ClassVar[bool] = False

    def __init__(
        self,
        scenes: Sequence[Scene],
        collisions: int | None,
        time: float | None,
        summary: bool = False,
        snapshots: Sequence[float] = (),
    ) -> None:
        if collisions is None and time is None:
            raise ValueError("a simulation needs a number of collisions or a time to end at")
        in_circle = isinstance(scenes[0].container, Circle) and not scenes[0].free
        if scenes[0].slides and not (in_circle and self.lets_slide):
            raise ValueError("balls slide along the fixed wall of a circle, found among everyone")
        if len(snapshots) and (len(scenes) > 1 or np.any(np.diff(snapshots, prepend=-0.0) < 0)):
            raise ValueError("times of snapshots must ascend from 0 on")
        self.scenes, repeats = scenes, len(scenes)
        self.snapshots, self.taken = np.array(snapshots, dtype=np.float64), 0
        self.kept: list[tuple[float, Scene]] = []
        self.at_snapshot = False
        self.wanted = ks.NO_LIMIT if collisions is None else collisions
        self.time_limit = math.inf if time is None else time
        self.states = new_states(scenes, self.time_limit, self._memory())
        self.summary = summary
        self.samples = sampling.new_grids(scenes) if summary else sampling.NoSamples(None)
        self.active, self.done = np.arange(repeats), 0
        self.reasons = [StopReason.INTERRUPTED] * repeats
        self.times = np.zeros(repeats)
        self.chunks: list[list[Events]] = [[] for _ in scenes]
        self._make_search()

    def _memory(self) -> tuple[Floats, Indices] | None:
        """Memory for balls and their history, stacked; ``None`` for arrays in rows."""
        return None

    @abstractmethod
    def _make_search(self) -> None:
        """Make the search, which has not found anything yet."""

    @abstractmethod
    def _predict_anew(self, repeat: int) -> None:
        """Let the search find everything anew, from the state."""

    def _room(self, repeats: int, events: int) -> Records:
        """Records of repeats with room for some events of each."""
        return np.empty((repeats, events), record_type_of(self.scenes[0]))

    def advance(self, records: Records, answers: Integers, limit: int, ends: Floats) -> None:
        """Simulate at most ``limit`` events of each active repeat, and answer why it stopped.

        records, answers : a row for each active repeat
        ends : of each, what its clocks show at the time up to which to simulate, s
        """
        event_loop.advance(
            self.states, self.search, records, self.samples, self.active, answers, limit, ends
        )

    def restore(self, saved: Mapping[str, NDArray[Any]]) -> None:
        """Continue a single repeat from what ``saved`` gave.

        Raises ``CheckpointError`` for arrays of another shape or type. Kernels use their numbers
        without a check: files have a hash of them that only this user can make.
        """
        restored("states", plain(self.states), saved)  # in their place
        if self.summary:
            self.samples = restored("grids", self.samples, saved)
        if len(self.snapshots):
            self.taken = restored("taken", self.taken, saved)
        sums, counts = self.states.sums[0], self.states.counts[0]
        self.times[0] = sums[ks.EPOCH] + sums[ks.NOW]
        self.done = int(counts[ks.WALL_EVENTS] + counts[ks.PAIR_EVENTS])
        self._make_search()

    def saved(self) -> dict[str, NDArray[Any]]:
        """Copies of all that decides how a single repeat goes on, for ``restore``."""
        parts: dict[str, Any] = {"states": plain(self.states)}
        parts |= {"grids": self.samples} if self.summary else {}
        parts |= {"taken": self.taken} if len(self.snapshots) else {}
        return dict(chain.from_iterable(copied(name, part) for name, part in parts.items()))

    def chunk(
        self, sink: Sink | None = None, states: StateSink | None = None, most: int = CHUNK
    ) -> int:
        """Simulate a chunk of at most ``most`` events, up to the next snapshot; how many.

        The events, and the state at a snapshot, are kept or given to the sinks.
        """
        active, before, number = self.active, self.done, self.scenes[0].number
        epoch_length = clock.length(number)
        size = CHUNK if number < REORDERED else SMALL_CHUNK
        size = min(size, max(MOST_EVENTS // len(active), 1), most)
        limit = min(self.wanted - before, size, epoch_length - before % epoch_length)
        records = self._room(len(active), 0 if self.summary else limit)
        answers = np.zeros(len(active), dtype=np.int64)
        ends = last = self.states.sums[active, ks.TIME_LIMIT]
        if self.taken < len(self.snapshots):
            ends = np.minimum(last, self.snapshots[self.taken] - self.states.sums[:, ks.EPOCH])
        self.advance(records, answers, limit, ends)
        # The time of a snapshot ends no repeat.
        self.at_snapshot = bool(np.any(ends < last) and answers[0] == TIME)
        if self.at_snapshot:
            self._take_snapshot(states)
            answers[0] = FULL
        epochs, clocks = self.states.sums[active][:, [ks.EPOCH, ks.NOW]].T
        counts = self.states.counts[active]
        done = counts[:, ks.WALL_EVENTS] + counts[:, ks.PAIR_EVENTS]
        self.times[active] = epochs + clocks
        if not self.summary:
            rows = active.tolist(), epochs.tolist(), (done - before).tolist()
            for own, repeat, epoch, new in zip(records, *rows, strict=True):
                if new == 0 and self.chunks[repeat]:
                    continue
                columns = {name: own[name][:new].copy() for name in records.dtype.names or ()}
                columns["time"], residual = clock.times(epoch, columns["time"])
                events = Events(**columns, residual=residual)
                (self.chunks[repeat].append if sink is None else sink)(events)
        for row in np.flatnonzero((done > before) & (done % epoch_length == 0)).tolist():
            following = clock.following(float(epochs[row]), float(clocks[row]))
            ks.begin_epoch(ks.state_of(self.states, int(active[row])), *following)
            self._predict_anew(int(active[row]))
        ended = (done >= self.wanted) | (answers != FULL)
        for row in np.flatnonzero(ended).tolist():
            reason = 0 if done[row] >= self.wanted else int(answers[row])
            self.reasons[active[row]] = list(StopReason)[reason]
        self.active, self.done = active[~ended], int(np.max(done))
        return int(np.sum(done - before))

    @property
    def share(self) -> float:
        """``share_done`` of the repeats on average; 1 of those that have ended."""
        counts = self.states.counts[self.active]
        events = counts[:, ks.WALL_EVENTS] + counts[:, ks.PAIR_EVENTS]
        shares = share_done(events, self.times[self.active], self.wanted, self.time_limit)
        ended = len(self.scenes) - len(self.active)
        return (ended + float(np.sum(shares))) / len(self.scenes)

    def _take_snapshot(self, states: StateSink | None) -> None:
        """Keep the state of a single repeat at the next time, or give it to a sink."""
        time = float(self.snapshots[self.taken])
        clocks = np.array([time]) - self.states.sums[:, ks.EPOCH]
        (scene,) = scenes_at(self.scenes, self.states, clocks)
        if states is None:
            self.kept.append((time, scene))
        else:
            states(time, scene)
        self.taken += 1

    def traces(self, states: StateSink | None = None) -> list[Trace]:
        """Everything so far, as finished traces.

        states : gets the snapshots after the last event
        """
        counts = self.states.counts.tolist()
        stops = [self._stop(repeat, count) for repeat, count in enumerate(counts)]
        times = [stop.time for stop in stops]
        if (
            self.reasons[0] is not StopReason.INTERRUPTED
        ):  # else the repeat may continue before them
            while self.taken < len(self.snapshots) and self.snapshots[self.taken] <= times[0]:
                self._take_snapshot(states)
        kept = None
        if self.kept:
            moments, scenes = zip(*self.kept, strict=True)
            kept = Snapshots(np.array(moments), scenes.__getitem__)
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
                snapshots=kept,
            )
            for start, finish, stop, count, chunks, summary in rows
        ]

    def _summaries(self, clocks: Floats, times: list[float]) -> Sequence[Summary | None]:
        """The summary of each repeat up to a time, given on its clocks too, s."""
        if isinstance(self.samples, sampling.NoSamples):
            return [None] * len(times)
        self._finish_samples(clocks)
        return [
            sampling.summary(scene, self.samples.of_repeat(repeat), time)
            for repeat, (scene, time) in enumerate(zip(self.scenes, times, strict=True))
        ]

    def _finish_samples(self, clocks: Floats) -> None:
        """Complete the samples of each repeat up to a time on its clocks, s."""
        repeats = len(clocks)
        event_loop.advance(
            self.states,
            self.search,
            self._room(repeats, 0),
            self.samples,
            np.arange(repeats),
            np.zeros(repeats, dtype=np.int64),
            event_loop.FINISH,
            clocks,
        )

    def _beside(self, repeat: int) -> str:
        """What speeds are relative to, in words: nothing, unless all balls share a velocity."""
        if not isinstance(self.states.frame, MovingFrame):
            return ""
        speed = float(np.hypot(*self.states.frame.motion[repeat, [ks.U, ks.V]]))
        return f", beside the {speed:.3g} m/s that all share," if speed > 0.0 else ""

    def _way(self, repeat: int) -> str:
        """What has gone too far, in words."""
        if self.scenes[repeat].slides:
            return f"a ball slides more than {FARTHEST / (2 * math.pi):,.0f} times round"
        state = ks.state_of(self.states, repeat)
        x, y, _, _ = state.boundary.container_flight(float(state.sums[ks.NOW]), state.frame)
        return f"the container is {math.hypot(x, y):.3g} m away"

    def _stop(self, repeat: int, counts: list[int]) -> Stop:
        """How a repeat ended, with a message."""
        reason, now, limit = self.reasons[repeat], float(self.times[repeat]), self.time_limit
        events = counts[ks.WALL_EVENTS] + counts[ks.PAIR_EVENTS]
        number = "1 collision" if events == 1 else f"{events:,} collisions"
        messages = {
            StopReason.COLLISIONS: f"{number} reached at {now:.9g} s",
            StopReason.TIME: f"{limit:.9g} s reached after {number}",
            StopReason.NOTHING_LEFT: (
                f"no further collision can happen after {events:,}, at {now:.9g} s"
            ),
            StopReason.IDLE: (
                f"no collision in {IDLE_CALLS * cells.CROSSINGS_AT_ONCE:,} crossings of cells "
                f"after {number}, at {now:.9g} s; give a time to end at"
            ),
            StopReason.REST: (
                f"all balls are slower than {clock.SLOWEST:g} m/s{self._beside(repeat)} after "
                f"{number}, at {now:.9g} s: squares of speeds are no numbers of double precision"
            ),
            StopReason.FAR: (
                f"{self._way(repeat)} after {number}, at {now:.9g} s: places have lost half of "
                "their digits"
            ),
            StopReason.INTERRUPTED: f"interrupted after {number} at {now:.9g} s",
        }
        if reason in messages:
            waits = reason in (StopReason.TIME, StopReason.NOTHING_LEFT) and math.isfinite(limit)
            return Stop(reason, limit if waits else now, (), messages[reason])
        saved = f"{number} {'is' if events == 1 else 'are'} saved"
        scene, labels, column = self.scenes[repeat], self.states.labels, counts[ks.FIRST]
        first, second = (
            int(labels[ball]) if ball >= 0 and len(labels) else ball
            for ball in (column, counts[ks.SECOND])
        )
        if reason is StopReason.WALL_TRAP:
            lasts, given = bounces_to_come(column, ks.state_of(self.states, repeat))
            end, what = now + lasts, "stays at the wall, because the wall CoR is 0"
            rubs = scene.surface is not None and scene.surface.rubs_wall
            bounces = scene.wall_restitution > 0.0
            if not isinstance(scene.wall_law, Constant) or (rubs and bounces):
                what = (
                    f"bounces ever faster at the wall: it stops by {end:.9g} s and gives it at "
                    f"most {given:.6g} kg m/s more, if no other ball hits it"
                )
            elif bounces:
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


def plain(states: State) -> State:
    """The states with the balls in the scene's order, and no more rows than all searches have."""
    balls, history, labels, sizes = states.balls, states.history, states.labels, states.sizes
    balls, history = balls[:, : ks.BALL_ROWS], history[:, : ks.HISTORY_ROWS]
    if len(labels):
        order = np.argsort(labels)
        former = history[:, ks.FORMER]
        history = np.where(former >= 0, labels[former], former)[:, np.newaxis]
        history = np.concatenate([states.history[:, : ks.FORMER], history], axis=1)[:, :, order]
        balls, labels = balls[:, :, order], labels[:0]
        if isinstance(sizes, UnequalBalls):
            sizes = UnequalBalls(sizes.radii[order], sizes.masses[order])
    return states._replace(balls=balls, history=history, labels=labels, sizes=sizes)


class AmongEveryone(Simulation):
    """Few balls: one call of the kernel simulates all repeats."""

    lets_slide = True

    def _make_search(self) -> None:
        self.search = everyone.new_search(len(self.scenes), self.scenes[0].number)

    def _predict_anew(self, repeat: int) -> None:
        self.search.begun[repeat] = False


class AmongNeighbours(Simulation):
    """Many balls: a single repeat, whose balls are in cells."""

    cell_factor = 1.0  # how many times as wide as usual cells are: of no effect but on the speed

    def _make_search(self) -> None:
        (self.scene,) = self.scenes
        scene = self.scene
        # With n balls per area and a mean free path l, crossings cost as l / side and searches as
        # n side^2. At the least, n side^2 goes as the inverse cube root of the packing.
        balls = max(BALLS_PER_CELL, DILUTE / scene.packing_fraction ** (1 / 3))
        side = self.cell_factor * math.sqrt(balls * scene.container.area / scene.number)
        grid = cell_grid.new_cells(scene, side, new_tree(scene.number))
        self.search = cells.Neighbours(grid, np.zeros(PROGRESS, np.int64), np.zeros(1))
        self.ordered_at = self.idle = 0
        self.proof: Iterator[bool] | None = None  # that nothing can meet, while it is under way
        self.renewed_at = 0.0
        self._renew_margin(float(self.state.sums[ks.NOW]))
        self._fill()

    @property
    def state(self) -> State:
        return ks.state_of(self.states, 0)

    def _memory(self) -> tuple[Floats, Indices]:
        """Stacked memory in which each ball is a line of the processor's cache."""
        balls, history = cm.ball_memory(self.scenes[0].number)
        return balls[np.newaxis], history[np.newaxis]

    def advance(self, records: Records, answers: Integers, limit: int, ends: Floats) -> None:
        answer = FULL if self.proof else self._advance(records, limit, float(ends[0]))
        if self.proof:  # no velocity changes meanwhile
            holds = next(self.proof, None)
            if holds is None:
                answer = NOTHING_LEFT
            if not holds:
                self.proof = None
        endless = self.scene.container.period is not None and self.time_limit == math.inf
        answers[0] = IDLE if endless and self.idle >= IDLE_CALLS else answer

    def _advance(self, records: Records, limit: int, end: float) -> int:
        """Simulate with at most `cells.CROSSINGS_AT_ONCE`; why it stopped.

        After crossings alone, a proof that nothing can meet begins; one is enough.
        """
        if self.scene.number >= REORDERED:
            self._keep_order()
        no_chains(self.search.cells.tree.bits, self.search.progress)
        begun, renewals, answer = self.state.collisions, 0, CELL_FULL
        while answer in (CELL_FULL, OUT_OF_MARGIN, NEW_FRAME):
            done = self.state.collisions - begun
            rest, samples = records[0, done:], self.samples.of_repeat(0)
            answer = event_loop.advance_alone(
                self.state, self.search, rest, samples, limit - done, end
            )
            if answer == CELL_FULL:
                self._fill(2 * self.search.cells.members.shape[1])
            elif answer == NEW_FRAME:
                self._predict_anew(0)
            elif answer == OUT_OF_MARGIN:
                self._renew_margin(float(self.search.cells.margin.region[cells.UNTIL]))
                self._fill()
                renewals += 1
                if renewals * (RENEWAL + self.scene.number) >= cells.CROSSINGS_AT_ONCE:
                    answer = FULL
        self.idle = self.idle + 1 if answer == FULL and self.state.collisions == begun else 0
        if self.idle == 1:
            self.proof = self._parts_of_proof()
        return int(answer)

    def _finish_samples(self, clocks: Floats) -> None:
        (records,), samples = self._room(1, 0), self.samples.of_repeat(0)
        end = float(clocks[0])
        event_loop.advance_alone(self.state, self.search, records, samples, event_loop.FINISH, end)

    def _predict_anew(self, repeat: int) -> None:
        self._renew_margin(float(self.state.sums[ks.NOW]))
        self._fill()

    def _parts_of_proof(self) -> Iterator[bool]:
        """Parts of the proof that no ball meets another, or the wall of a free container.

        It is certain if all of them hold.
        """
        state, number = self.state, self.scene.number
        container = self.scene.container
        velocities, period = state.balls[[ks.U, ks.V]], container.period
        between_walls = ~np.array(container.periodic)
        if container.keeps_drift() and np.any(velocities[between_walls]):
            yield False
            return
        if self.scene.free:
            velocities = np.column_stack([velocities, state.boundary.motion[[ks.U, ks.V]]])
        # Of the least speeds the square is zero, and predictions find no contact.
        if not np.any(np.ptp(velocities, axis=1) ** 2):
            yield period is not None or self.scene.free
            return
        if period is None or number > MOST_PROVEN:
            yield False
            return
        balls, radii = state.balls[: ks.BALL_ROWS].T.tolist(), self.scene.radii
        # In a channel no ball moves across by now, and no image across is nearer than the ball.
        pairs = combinations(range(number), 2)
        while part := list(islice(pairs, PAIRS_AT_ONCE)):
            yield all(
                never_meet(balls[i], balls[k], radii[i] + radii[k], container.size) for i, k in part
            )

    def _fill(self, capacity: int | None = None) -> None:
        """Put the balls into cells, perhaps of another capacity, and predict everything."""
        grid = self.search.cells
        if capacity is not None:
            members, near = cm.room_for(capacity, len(grid.occupancy))
            grid = grid._replace(members=members, near=near)
            self.search = self.search._replace(cells=grid)
        # As of the last event, or of when cells were put round a free container since.
        now = max(float(self.state.sums[ks.NOW]), self.renewed_at)
        if isinstance(grid.margin, cells.MovingMargin):
            grid.margin.brinks[0] = 0
        grid.links[cm.BRINK] = 0
        if not cells.fill(now, self.state, grid):
            self._fill(2 * grid.members.shape[1])

    def _renew_margin(self, now: float) -> None:
        """Put cells round a free container's place at a time, s."""
        self.renewed_at = now
        if self.scene.free:
            grid = cells.with_margin(self.search.cells, self.state.boundary.motion, now)
            self.search = self.search._replace(cells=grid)

    def _keep_order(self) -> None:
        """Put the balls into the order of their cells, if there have been events enough."""
        state, number = self.state, self.scene.number
        labels = state.labels if len(state.labels) else np.arange(number, dtype=np.int32)
        if len(state.labels) and state.collisions < self.ordered_at + REORDER_AFTER * number:
            return
        order = np.argsort(self.search.cells.links[cm.CELL], kind="stable")
        rank = np.empty(number, dtype=np.int32)
        rank[order] = np.arange(number, dtype=np.int32)
        balls, history = self._memory()
        np.take(state.balls.T, order, axis=0, out=balls[0].T)
        former = history[0, ks.FORMER]
        former[former >= 0] = rank[former[former >= 0]]
        sizes = state.sizes
        if isinstance(sizes, UnequalBalls):
            sizes = UnequalBalls(sizes.radii[order], sizes.masses[order])
        self.states = self.states._replace(
            balls=balls, history=history, labels=labels[order], sizes=sizes
        )
        self.ordered_at = state.collisions
        self._fill()


def usual_search(scene: Scene) -> type[Simulation]:
    """The faster search for a scene; both give the same bits."""
    few = scene.number <= few_at(scene.packing_fraction, free=scene.free)
    in_circle = isinstance(scene.container, Circle)
    return AmongEveryone if in_circle and (few or scene.slides) else AmongNeighbours


def share_done(
    collisions: Any, time: Any, most: int | None, limit: float | None
) -> NDArray[np.float64]:
    """How far repeats are on their way to the nearer of their limits, from 0 to 1.

    collisions, time : reached, of each repeat; time in s
    most, limit : the collisions and the time (s) that end a repeat; at least one is given
    """
    of_collisions = 0.0 if most is None else np.asarray(collisions) / max(most, 1)
    of_time = 0.0 if limit is None else np.asarray(time) / limit
    return np.minimum(np.maximum(of_collisions, of_time), 1.0)


def few_at(packing_fraction: float, *, free: bool) -> int:
    """Balls in a circle up to which a search among everyone is faster, see docs/engine.md."""
    return int(min((FEW_IN_FREE if free else FEW) / packing_fraction**0.375, MOST))


# A repeat


def simulate(
    scene: Scene,
    *,
    collisions: int | None = None,
    time: float | None = None,
    summary: bool = False,
    snapshots: Sequence[float] = (),
    watch: Watch | None = None,
    sink: Sink | None = None,
    states: StateSink | None = None,
    search: type[Simulation] | None = None,
    checkpoint: Mapping[str, NDArray[Any]] | None = None,
) -> Trace:
    """Simulate a scene until a number of collisions or a time, whichever comes first.

    collisions : ball-ball and wall collisions together
    time : s
    summary : record observables on a grid of times instead of the events
    snapshots : times (s, ascending) at which the state is recorded too; those after the end are not
        reached
    watch : called after each chunk with the number of new events and the ``share_done``; a true
        answer stops the repeat
    sink : called with the events of each chunk; the trace then has none, so memory stays bounded
    states : the same for snapshots: called with the time and the scene of each
    search : ``AmongEveryone`` or ``AmongNeighbours`` instead of the faster one, for tests
    checkpoint : of the trace of the same call that ``watch`` stopped; the repeat then goes on from
        there with the same bits, and only later events and snapshots are recorded

    Raises ``ValueError`` as `Simulation`.
    """
    run = (search or usual_search(scene))([scene], collisions, time, summary, snapshots)
    if checkpoint is not None:
        run.restore(checkpoint)
    stops = False
    while len(run.active):
        number = run.chunk(sink, states, 1 if stops else CHUNK)
        stops |= watch is not None and bool(watch(number, run.share))
        # The time of an interrupted repeat is that of its last event, so snapshots come before it.
        if stops and not run.at_snapshot:
            break
    saved = run.saved() if len(run.active) else None  # before the last row of a summary
    (trace,) = run.traces(states)
    return replace(trace, checkpoint=saved)


def simulate_batch(
    scenes: Sequence[Scene],
    *,
    collisions: int | None = None,
    time: float | None = None,
    summary: bool = False,
    watch: Watch | None = None,
    search: type[Simulation] | None = None,
) -> list[Trace]:
    """Simulate repeats of one point, with few balls in one call; the traces are ``simulate``'s.

    scenes : they differ in positions and velocities only
    collisions, time, summary, search : as in ``simulate``
    watch : called after each chunk with the number of new events of all, and their ``share_done``
        on average; it may raise

    Raises ``ValueError`` if scenes differ otherwise, and in the cases of ``simulate``.
    """
    if not scenes:
        return []
    for name in vars(scenes[0]).keys() - MOTION:
        first, *others = (getattr(scene, name) for scene in scenes)
        if not all(other is first or np.array_equal(other, first) for other in others):
            raise ValueError("the scenes of a batch differ in more than positions and velocities")
    kind = search or usual_search(scenes[0])
    # Cells take as long as one repeat after the other: their kernel is called for each.
    size = 1 if kind is AmongNeighbours else MOST_SUMMARIES if summary else len(scenes)
    traces: list[Trace] = []
    for begin in range(0, len(scenes), size):
        run = kind(scenes[begin : begin + size], collisions, time, summary)
        while len(run.active):
            number = run.chunk()
            if watch is not None:
                watch(number, (begin + run.share * len(run.scenes)) / len(scenes))
        traces += run.traces()
    return traces


def specialisation(scene: Scene) -> dict[str, bool]:
    """What the kernel is compiled for: it has only what the scene needs."""
    in_cells = usual_search(scene) is AmongNeighbours
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
