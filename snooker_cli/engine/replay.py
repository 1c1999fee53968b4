"""A trace -> its states: at any time by its collisions, with the engine's bits, or stored ones."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snooker_cli.engine import clock, sampling
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.collision import collide, count
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.conversion import inner_images, new_states, origin_of
from snooker_cli.engine.jit import helper, inlined, kernel
from snooker_cli.engine.kernel_state import Floats, Integers, Records, State
from snooker_cli.errors import UnsoundError
from snooker_cli.fields import MOVING, carried_fields, moving_fields
from snooker_cli.scene import Scene
from snooker_cli.trace import (
    SLIDE,
    SPEED_BINS,
    Series,
    Trace,
    even_choice,
    joined,
    records_of,
    series_of,
)

ESCAPE = 1.0  # of the container's size from its centre; rounding takes balls over half of it
BATCH = (
    2**22
)  # balls times states in memory at once: 32 bytes each, three times while they are made
BRANCHES = 50  # balls that can be added in the time that changing the sums of two takes


NAMES = [field.name for field in MOVING]


@dataclass(frozen=True)
class States:
    """What moves in a scene, at some times: as in ``Scene``, with an axis more, the first.

    So ``positions`` and ``velocities`` are (*t*, *N*, 2), m and m/s, ``container_position`` and
    ``container_velocity`` (*t*, 2), and ``spins`` (*t*, *N*), rad/s, or ``None`` of smooth balls.

    time : (*t*,), s
    moving : the quantities by their names in `fields.MOVING`
    """

    time: NDArray[np.float64]
    moving: Mapping[str, NDArray[np.float64]]

    def __getattr__(self, name: str) -> Any:
        if name not in NAMES:
            raise AttributeError(f"states have no {name}; they have {', '.join(NAMES)}")
        return self.moving.get(name)

    @classmethod
    def of(cls, times: Sequence[float], scenes: Sequence[Scene]) -> "States":
        """The states of scenes at their times, s."""
        fields = moving_fields(scenes[0])
        moving = {
            field.name: np.array([getattr(scene, field.name) for scene in scenes])
            for field in fields
        }
        return cls(np.array(times), moving)

    def scene(self, start: Scene, row: int) -> Scene:
        """The scene at the time of a row."""
        return replace(start, **{name: values[row] for name, values in self.moving.items()})


def replay(trace: Trace, times: ArrayLike) -> States:
    """The states at ``times`` (s, ascending); at the time of a collision, just after it.

    Of a repeat with snapshots they are the stored ones nearest to these times; ``States.time`` has
    their own times.

    Raises ``ValueError`` if the trace has neither events nor snapshots, or for times that are not
    ascending within 0 and the trace's end; ``UnsoundError`` for events that do not follow from the
    start.
    """
    wanted = _replayable(trace, times)
    if trace.events is None:
        return _stored(trace, wanted)
    return _states(Replay(trace), wanted)


def replayed(trace: Trace, times: ArrayLike, batch: int = BATCH) -> Iterator[States]:
    """`replay` in batches, from one pass over the events; it raises ``ValueError`` at once.

    batch : balls times states in memory
    """
    wanted, size = _replayable(trace, times), max(1, batch // trace.start.number)
    parts = (wanted[k : k + size] for k in range(0, len(wanted), size))
    if trace.events is None:
        return (_stored(trace, part) for part in parts)
    run = Replay(trace)
    return (_states(run, part) for part in parts)


def stored_times(trace: Trace) -> Floats:
    """When states of a repeat are stored, s: at the start, at its snapshots and at the finish."""
    between = np.zeros(0) if trace.snapshots is None else trace.snapshots.time
    return np.unique(np.concatenate([[0.0], between, [trace.stop.time]]))


def nearest_times(trace: Trace, times: ArrayLike) -> Floats:
    """The times of states (s): those given, or without events the nearest stored ones, each once.

    Raises ``ValueError`` as `times_within`.
    """
    wanted = times_within(trace, times)
    if trace.events is not None:
        return wanted
    stored = stored_times(trace)
    return np.unique(stored[[int(np.argmin(np.abs(stored - time))) for time in wanted.tolist()]])


def state_at(trace: Trace, time: float) -> tuple[float, Scene]:
    """The scene at a time (s), and that time; without events the nearest that is stored.

    Raises ``ValueError`` for a time that is not within 0 and the end, and as `replay`.
    """
    start, finish = trace.start, trace.finish
    (time,) = nearest_times(trace, [time]).tolist()
    if trace.events is None:
        if time in (0.0, trace.stop.time):
            return time, start if time == 0.0 else finish
        assert trace.snapshots is not None
        return time, trace.snapshots.read(int(np.searchsorted(trace.snapshots.time, time)))
    return time, replay(trace, [time]).scene(start, 0)


def _stored(trace: Trace, times: Floats) -> States:
    """The stored states nearest to some times."""
    moments, scenes = zip(*(state_at(trace, time) for time in times.tolist()), strict=True)
    return States.of(moments, scenes)


def _replayable(trace: Trace, times: ArrayLike) -> Floats:
    """The times as an array. Raises ``ValueError``."""
    if trace.events is None and trace.snapshots is None:
        raise ValueError("this repeat was recorded as a summary: it has no events to replay")
    return times_within(trace, times)


def _states(run: "Replay", times: Floats) -> States:
    """The states at times that are not before those of the events carried out."""
    start = run.start
    numbers = np.searchsorted(run.events.time, times, side="right")
    states = run.all_states(numbers, times)
    # A file with other events, but right hashes, leads balls anywhere.
    reach = ESCAPE * max(start.container.size)
    if not np.all(np.abs(states.positions - states.container_position[:, np.newaxis]) < reach):
        raise UnsoundError(
            "a ball leaves the container when its stored events are carried out again",
            "find the file with `snooker verify RUN --replay`, delete it and run again",
        )
    return states


def times_within(trace: Trace, times: ArrayLike) -> NDArray[np.float64]:
    """The times (s) as an array. Raises ``ValueError`` unless they ascend within 0 and the end."""
    wanted = np.asarray(times, dtype=np.float64)
    inside = np.all((wanted >= 0) & (wanted <= trace.stop.time))  # false for nan
    if not inside or np.any(np.diff(wanted) < 0):
        raise ValueError(f"times must ascend within 0 and {trace.stop.time!r} s")
    return wanted


def series(trace: Trace, most: int | None = None) -> Series:
    """The observables at time zero and after each collision; a summary's on its grid.

    If there are more than ``most`` rows (at least 2), this many are kept, evenly, with the first
    and the last. Energies and speeds come from the replayed velocities, not from summed losses.
    """
    if trace.summary is not None:
        return trace.summary.series
    if trace.events is None:
        raise ValueError("this repeat has neither events nor a summary")
    events, slides = trace.events, trace.start.slides
    rows = len(events) + 1
    kept = even_choice(rows, most or rows)
    time = np.concatenate([[0.0], events.time])[kept]
    if slides:  # what slides presses until the end, though there is no event
        time = np.append(time, trace.stop.time)
    out = np.zeros((len(time), sampling.columns_of(trace.start)))
    run = Replay(trace)
    run.advance(len(events), kept, out, trace.stop.time if slides else NEVER)
    return series_of(trace.start, time, np.ascontiguousarray(out.T))


class Rows(NamedTuple):
    """The `series` of repeats of one point, one after the other.

    time : (*m*,), s
    columns : (*columns*, *m*), the other columns of ``Series`` in order
    starts : (*repeats* + 1,), where the rows of each repeat begin, and the end of all
    """

    time: Floats
    columns: Floats
    starts: Integers


def batch_series(traces: Sequence[Trace], times: Sequence[Floats]) -> tuple[Rows, Integers]:
    """The `series` of repeats of one point, and their balls by reduced speed at ``times`` (s).

    Balls are counted in bins of ``SPEED_BIN``, over all times of a repeat, just after a collision
    at a time; (*repeats*, ``SPEED_BINS``). Repeats must be as `is_short` says; then this is much
    faster than one by one.
    """
    recorded = [trace.events for trace in traces if trace.events is not None]
    events, starts = joined(recorded), np.cumsum([0, *map(len, recorded)])
    counts = [
        np.searchsorted(part.time, at, side="right")
        for part, at in zip(recorded, times, strict=True)
    ]
    number, repeats = traces[0].start.number, len(traces)
    rows = np.empty((len(events) + repeats, sampling.columns_of(traces[0].start)))
    histograms = np.zeros((repeats, SPEED_BINS), dtype=np.int64)
    repeat_events(
        new_states([trace.start for trace in traces]),
        records_of(events),
        starts,
        0,
        np.arange(max(map(len, recorded)) + 1),
        rows,
        NEVER,
        np.empty((2 * number * (number > BRANCHES), 3)),
        np.concatenate([*counts, np.zeros(0, np.int64)]),
        np.cumsum([0, *map(len, counts)]),
        histograms,
    )
    time = np.insert(events.time, starts[:-1], 0.0)
    columns = np.ascontiguousarray(rows.T)  # analyses read whole columns
    return Rows(time, columns, starts + np.arange(repeats + 1)), histograms


def is_short(trace: Trace) -> bool:
    """Whether `batch_series` can measure a repeat: it has events of one epoch, and no slides."""
    if trace.events is None or trace.summary is not None or trace.start.slides:
        return False
    return len(trace.events) <= clock.length(trace.start.number)


class Replay:
    """A trace whose collisions are being carried out again, and how far that is."""

    def __init__(self, trace: Trace) -> None:
        assert trace.events is not None
        self.start, self.events, self.done = trace.start, trace.events, 0
        self.states_of_one = new_states([trace.start])
        self.state = ks.state_of(self.states_of_one, 0)
        self.epoch_length = clock.length(trace.start.number)

    def advance(
        self,
        end: int,
        kept: Integers | None = None,
        rows: Floats | None = None,
        time: float = NEVER,
    ) -> None:
        """Carry out the events before ``end``, with a row after each number of them in ``kept``.

        A row after no event is one of the start. At a ``time`` (s), if any, there is a last row.
        """
        kept = np.zeros(0, dtype=np.int64) if kept is None else kept
        rows = np.zeros((0, sampling.COLUMNS)) if rows is None else rows
        number, no_samples = self.state.balls.shape[1], np.zeros(2, dtype=np.int64)
        while True:
            stop = min(end, self._epoch_end)
            record = self._record(stop)
            before, after = np.searchsorted(kept, [self.done, stop], side="right")
            dense = (after - before) * number > BRANCHES * len(record)
            first, last = before if self.done else 0, NEVER
            if stop == end and time < NEVER:
                after, last = len(rows), time - self.state.sums[ks.EPOCH]
            repeat_events(
                self.states_of_one,
                record,
                np.array([0, len(record)]),
                self.done,
                kept[first:after],
                rows[first:after],
                last,
                np.empty((2 * number * dense, 3)),
                no_samples[:0],
                no_samples,
                np.zeros((1, SPEED_BINS), dtype=np.int64),
            )
            self._carried_out(stop, record)
            if self.done == end:
                return

    def all_states(self, numbers: Integers, times: Floats) -> States:
        """The states of everything after some numbers of events, as `states` takes them."""
        start, origin = self.start, origin_of(self.start)
        balls, container = self.states(numbers, times, np.arange(start.number)[np.newaxis])
        if start.container.period is not None:
            balls[:, :2] = inner_images(balls[:, :2], start.container.period)
        rows = {False: balls, True: container[..., np.newaxis]}
        moving: dict[str, Floats] = {}
        for field in moving_fields(start):
            part, rows[field.of_container] = np.split(
                rows[field.of_container], [len(field.titles)], axis=1
            )
            values = part.transpose(0, 2, 1) if field.is_vector else part[:, 0]
            values = values[:, 0] if field.of_container else values
            moving[field.name] = values + origin if field.element == "position" else values
        return States(times, moving)

    def states(self, numbers: Integers, times: Floats, balls: Integers) -> tuple[Floats, Floats]:
        """Places and velocities of balls (*t*, 4, *m*), and of the container (*t*, 4), m and m/s.

        After these four rows come those of `fields.carried_fields`.

        numbers : (*t*,) of events before each, ascending, and not below ``done``
        times : (*t*,), s, not before the last of these events
        balls : (*t*, *m*), the balls at each time; (1, *m*) if they are the same at all
        """
        rows = 4 + sum(len(field.titles) for field in carried_fields(self.start))
        out, container = np.empty((len(numbers), rows, balls.shape[1])), np.empty((len(numbers), 4))
        row, last = 0, int(numbers[-1]) if len(numbers) else self.done
        while row < len(numbers):
            stop = min(last, self._epoch_end)
            # A state at the end of an epoch is one of the next epoch.
            side: Literal["left", "right"] = "left" if stop == self._epoch_end else "right"
            part = slice(row, int(np.searchsorted(numbers, stop, side)))
            record, epoch = self._record(stop), self.state.sums[ks.EPOCH]
            chosen = balls if len(balls) == 1 else balls[part]
            moments = Moments(numbers[part] - self.done, times[part] - epoch, chosen)
            repeat_states(self.state, record, moments, out[part], container[part])
            self._carried_out(stop, record)
            row = part.stop
        return out, container

    @property
    def _epoch_end(self) -> int:
        return self.done - self.done % self.epoch_length + self.epoch_length

    def _record(self, stop: int) -> Records:
        """The events from ``done`` to ``stop`` in the same epoch, with their clocks."""
        events = self.events[self.done : stop]
        records = records_of(events)
        records["time"] = clock.clocks(float(self.state.sums[ks.EPOCH]), events)
        return records

    def _carried_out(self, stop: int, record: Records) -> None:
        """Note that events are carried out, and begin an epoch after its number of them."""
        if stop == self._epoch_end:
            epoch = float(self.state.sums[ks.EPOCH])
            ks.begin_epoch(self.state, *clock.following(epoch, float(record["time"][-1])))
        self.done = stop


class Moments(NamedTuple):
    """When a replay writes states: `Replay.states` explains the fields.

    numbers : (*t*,) of events from the first of the record
    clocks : (*t*,), s
    balls : (*t*, *m*) or (1, *m*)
    """

    numbers: Integers
    clocks: Floats
    balls: Integers


@kernel
def repeat_events(
    states: State,
    record: Records,
    starts: Integers,
    done: int,
    kept: Integers,
    rows: Floats,
    end: float,
    tree: Floats,
    samples: Integers,
    sample_starts: Integers,
    histograms: Integers,
) -> None:
    """Carry out recorded events of stacked repeats again, measuring after some numbers of them.

    record : the events of all repeats; those of a repeat begin at its ``starts``
    done : how many were carried out before; 0 if there are several repeats
    kept : numbers of events of a repeat, after which a row is written; 0 is before the first
    rows : (events and repeats, *columns*), those of a repeat together
    end : s, the clock of a last row, after all events; NEVER without one
    tree : (2 *N*, 3), or empty. A collision changes what two balls add to the sums over all. Sums
        of pairs, of pairs of pairs and so on are a tree, of which it changes two branches only.
        Node k is the sum of nodes 2k and 2k + 1; the first ball is node N.
    samples : numbers of events that are kept, after which balls are counted by reduced speed; those
        of a repeat begin at its ``sample_starts``
    """
    leaves = len(tree) // 2
    for repeat in range(len(starts) - 1):
        state, first, last = ks.state_of(states, repeat), starts[repeat], starts[repeat + 1]
        for i in range(leaves):
            set_terms(tree[leaves + i], sampling.terms_of(i, state))
        for node in range(leaves - 1, 0, -1):
            add_pair(node, tree)
        own, row, sample = rows[first + repeat :], 0, sample_starts[repeat]
        for event in range(first - 1, last):
            now = 0.0
            if event >= first:
                now = record[event]["time"]
                i, j = carry_out(record[event], state)
                if leaves > 0:
                    climb(i, tree, state)
                    if j >= 0:
                        climb(j, tree, state)
            number = done + event + 1 - first
            if row >= len(kept) or kept[row] != number:
                continue
            from_tree = leaves > 0 and event >= first
            sums = (tree[1, 0], tree[1, 1], tree[1, 2]) if from_tree else sampling.totals(state)
            pressing = state.boundary.pressing(now, state)
            sampling.measure(own[row], sums, pressing, state)
            while sample < sample_starts[repeat + 1] and samples[sample] == number:
                sampling.count_speeds(own[row], histograms[repeat], state)
                sample += 1
            row += 1
        if end < NEVER:
            pressing = state.boundary.pressing(end, state)
            sampling.measure(own[row], sampling.totals(state), pressing, state)


@kernel
def repeat_states(
    state: State, record: Records, moments: Moments, out: Floats, container: Floats
) -> None:
    """Carry out recorded events again, and write the states at some moments on the way.

    out, container : (*t*, 4, *m*) and (*t*, 4), m and m/s
    """
    boundary, each, event = state.boundary, len(moments.balls) > 1, 0
    for row in range(len(moments.numbers)):
        while event < moments.numbers[row]:
            carry_out(record[event], state)
            event += 1
        now, balls = moments.clocks[row], moments.balls[row if each else 0]
        for column in range(len(balls)):
            x, y, u, v = boundary.flight(balls[column], now, state)
            x, y, u, v = state.frame.in_laboratory(boundary, x, y, u, v, now)
            out[row, 0, column], out[row, 1, column] = x, y
            out[row, 2, column], out[row, 3, column] = u, v
            state.surface.show(balls[column], out[row, 4:, column])
        x, y, u, v = boundary.container_flight(now, state.frame)
        container[row, 0], container[row, 1] = x, y
        container[row, 2], container[row, 3] = u, v
    while event < len(record):
        carry_out(record[event], state)
        event += 1


@inlined
def carry_out(event: Any, state: State) -> tuple[int, int]:
    """Carry out a recorded event again; its ball and partner."""
    boundary, now = state.boundary, event["time"]
    i, j = int(np.int64(event["i"])), int(np.int64(event["j"]))  # as all number balls
    if j == SLIDE:
        boundary.slide(i, now, state)
    else:
        boundary.take_off_wall(i)
        if j >= 0:
            boundary.take_off_wall(j)
        size = collide(i, j, now, state)
        state.frame.renew_frame(i, j, size, now, state)
    count(i, j, event["impulse"], state)
    return i, j


@inlined
def set_terms(node: Floats, terms: tuple[float, float, float]) -> None:
    node[0], node[1], node[2] = terms


@inlined
def add_pair(node: int, tree: Floats) -> None:
    for term in range(3):
        tree[node, term] = tree[2 * node, term] + tree[2 * node + 1, term]


@helper
def climb(i: int, tree: Floats, state: State) -> None:
    """Renew the terms of ball i and the sums above it."""
    node = len(tree) // 2 + i
    set_terms(tree[node], sampling.terms_of(i, state))
    while node > 1:
        node //= 2
        add_pair(node, tree)
