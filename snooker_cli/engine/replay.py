"""A trace's start and its list of collisions -> the state at any time, with the engine's bits."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snooker_cli.engine import clock, sampling
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.collision import collide, count, slide
from snooker_cli.engine.conversion import flown, new_states, origin_of, write_curved
from snooker_cli.engine.jit import helper, inlined, kernel
from snooker_cli.engine.kernel_state import Floats, Integers, Recorded, State
from snooker_cli.errors import UnsoundError
from snooker_cli.trace import SLIDE, SPEED_BINS, Series, Trace, joined

ESCAPE = 1.0  # of the container's size from its centre; rounding takes balls over half of it
BRANCHES = 50  # balls that can be added in the time that changing the sums of two takes


@dataclass(frozen=True)
class States:
    """Positions and velocities of everything at given times (*t*,), s.

    positions, velocities : (*t*, *N*, 2), m and m/s
    container_positions, container_velocities : (*t*, 2), m and m/s
    """

    time: NDArray[np.float64]
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    container_positions: NDArray[np.float64]
    container_velocities: NDArray[np.float64]


def replay(trace: Trace, times: ArrayLike) -> States:
    """The states at ``times`` (s, ascending); at the time of a collision, just after it.

    Raises ``ValueError`` if the trace has no events, or for times that are not ascending within
    0 and the trace's end; ``UnsoundError`` for events that do not follow from the start.
    """
    if trace.events is None:
        raise ValueError("this repeat was recorded as a summary: it has no events to replay")
    wanted = times_within(trace, times)
    origin = origin_of(trace.start)
    out = np.empty((len(wanted), 4, trace.start.number))
    container_out = np.zeros((len(wanted), 4))
    run = Replay(trace)
    done = np.searchsorted(trace.events.time, wanted, side="right")
    for k, instant in enumerate(wanted):
        run.advance(int(done[k]))
        run.write_state(float(instant), out[k], container_out[k])
    positions = out[:, :2].transpose(0, 2, 1)
    if trace.start.container.period is not None:
        period = np.array(trace.start.container.period)
        positions = positions - period * np.rint(positions / period)
    # A file with other events, but right hashes, leads balls anywhere.
    reach = ESCAPE * max(trace.start.container.size)
    if not np.all(np.abs(positions - container_out[:, np.newaxis, :2]) < reach):
        raise UnsoundError(
            "a ball leaves the container when its stored events are carried out again",
            "find the file with `snooker verify RUN --replay`, delete it and run again",
        )
    return States(
        time=wanted,
        positions=positions + origin,
        velocities=out[:, 2:].transpose(0, 2, 1),
        container_positions=container_out[:, :2] + origin,
        container_velocities=container_out[:, 2:],
    )


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
    kept = np.linspace(0, rows - 1, min(rows, most or rows)).round().astype(np.int64)
    time = np.concatenate([[0.0], events.time])[kept]
    if slides:  # what slides presses until the end, though there is no event
        time = np.append(time, trace.stop.time)
    out = np.zeros((len(time), sampling.columns_of(trace.start)))
    run = Replay(trace)
    run.measure(out[0], 0.0)
    run.advance(len(events), kept[1:], out[1:])
    if slides:
        run.measure(out[-1], trace.stop.time)
    return Series(time, *np.ascontiguousarray(out.T))


class Rows(NamedTuple):
    """The `series` of repeats of one point, one after the other.

    time : (*m*,), s
    values : (*m*, *columns*), the other columns of ``Series`` in order
    starts : (*repeats* + 1,), where the rows of each repeat begin, and the end of all
    """

    time: Floats
    values: Floats
    starts: Integers


def batch_series(traces: Sequence[Trace], times: Sequence[Floats]) -> tuple[Rows, Integers]:
    """The `series` of repeats of one point, and their balls by reduced speed at ``times`` (s).

    Balls are counted in bins of ``SPEED_BIN``, over all times of a repeat, just after a collision
    at a time; (*repeats*, ``SPEED_BINS``). Repeats must be as `is_short` says; then this is much
    faster than one by one.
    """
    columns = [trace.events for trace in traces if trace.events is not None]
    events, starts = joined(columns), np.cumsum([0, *map(len, columns)])
    counts = [
        np.searchsorted(column.time, at, side="right")
        for column, at in zip(columns, times, strict=True)
    ]
    number, repeats = traces[0].start.number, len(traces)
    values = np.empty((len(events) + repeats, sampling.columns_of(traces[0].start)))
    histograms = np.zeros((repeats, SPEED_BINS), dtype=np.int64)
    time = np.ascontiguousarray(events.time)
    repeat_batch(
        new_states([trace.start for trace in traces]),
        Recorded(time, events.i, events.j, events.impulse),
        starts,
        np.arange(1, max(map(len, columns)) + 1),
        values,
        np.empty((2 * number * (number > BRANCHES), 3)),
        np.concatenate([*counts, np.zeros(0, np.int64)]),
        np.cumsum([0, *map(len, counts)]),
        histograms,
    )
    time = np.insert(time, starts[:-1], 0.0)
    return Rows(time, values, starts + np.arange(repeats + 1)), histograms


def is_short(trace: Trace) -> bool:
    """Whether `batch_series` can measure a repeat: it has events of one epoch, and no slides."""
    if trace.events is None or trace.summary is not None or trace.start.slides:
        return False
    return len(trace.events) <= clock.length(trace.start.number)


class Replay:
    """A trace whose collisions are being carried out again, and how far that is."""

    def __init__(self, trace: Trace) -> None:
        assert trace.events is not None
        self.events, self.free, self.done = trace.events, trace.start.free, 0
        self.state = ks.state_of(new_states([trace.start]), 0)
        self.epoch_length = clock.length(trace.start.number)

    def advance(self, end: int, kept: Integers | None = None, rows: Floats | None = None) -> None:
        """Carry out the events before ``end``, with a row after each number of them in ``kept``."""
        kept = np.zeros(0, dtype=np.int64) if kept is None else kept
        rows = np.zeros((0, sampling.COLUMNS)) if rows is None else rows
        state = self.state
        while self.done < end:
            stop = min(end, self.done - self.done % self.epoch_length + self.epoch_length)
            events, epoch = self.events[self.done : stop], float(state.sums[ks.EPOCH])
            clocks = clock.clocks(epoch, events)
            record = Recorded(clocks, events.i, events.j, events.impulse)
            part = slice(*np.searchsorted(kept, [self.done, stop], side="right"))
            number = state.balls.shape[1]
            dense = len(kept[part]) * number > BRANCHES * len(events)
            tree = np.empty((2 * number * dense, 3))
            repeat_events(state, record, self.done, kept[part], rows[part], tree)
            self.done = stop
            if stop % self.epoch_length == 0:
                state.next_epoch(*clock.following(epoch, float(clocks[-1])))

    def measure(self, row: Floats, time: float) -> None:
        """Write the observables at a time (s) into a row."""
        state = self.state
        clock = time - state.sums[ks.EPOCH]
        pressed = sampling.pressing(state.boundary, clock, state)
        histogram = np.zeros(SPEED_BINS, dtype=np.int32)  # of no interest here
        sampling.sample(row, histogram, pressed, state)

    def write_state(self, time: float, out: Floats, container_out: Floats) -> None:
        """Write position and velocity of all balls and of the container at a time, s."""
        state, boundary = self.state, self.state.boundary
        clock = np.asarray(time - state.sums[ks.EPOCH])
        out[...] = flown(state.balls, clock)
        begins = self.done < len(self.events) and self.events.j[self.done] == SLIDE
        settling = int(self.events.i[self.done]) if begins else ks.NO_PARTNER
        write_curved(boundary, float(clock), settling, state, out)
        if self.free:
            container_out[...] = flown(boundary.motion[:, np.newaxis], clock)[:, 0]


@kernel
def repeat_events(
    state: State, record: Recorded, done: int, kept: Integers, rows: Floats, tree: Floats
) -> None:
    """Carry out recorded events again, measuring after those numbers of events that are kept.

    tree : (2 *N*, 3), or empty. A collision changes what two balls add to the sums over all. Sums
        of pairs, of pairs of pairs and so on are a tree, of which it changes two branches only.
        Node k is the sum of nodes 2k and 2k + 1; the first ball is node N.
    """
    boundary = state.boundary
    row, leaves = 0, len(tree) // 2
    for i in range(leaves):
        set_terms(tree[leaves + i], sampling.terms_of(i, state))
    for node in range(leaves - 1, 0, -1):
        add_pair(node, tree)
    for event in range(len(record.time)):
        now, i, j = record.time[event], record.i[event], record.j[event]
        if j == SLIDE:
            slide(boundary, i, now, state)
        else:
            ks.take_off_wall(boundary, i)
            if j >= 0:
                ks.take_off_wall(boundary, j)
            collide(i, j, now, state)
        count(i, j, record.impulse[event], state)
        if leaves > 0:
            climb(i, tree, state)
            if j >= 0:
                climb(j, tree, state)
        if row < len(kept) and kept[row] == done + event + 1:
            sums = (tree[1, 0], tree[1, 1], tree[1, 2]) if leaves > 0 else sampling.totals(state)
            sampling.measure(rows[row], sums, sampling.pressing(boundary, now, state), state)
            row += 1


@kernel
def repeat_batch(
    states: State,
    record: Recorded,
    starts: Integers,
    every: Integers,
    rows: Floats,
    tree: Floats,
    samples: Integers,
    sample_starts: Integers,
    histograms: Integers,
) -> None:
    """`repeat_events` of many repeats, measuring before the first and after every event.

    record : the events of all repeats; those of a repeat begin at its ``starts``
    rows : (events and repeats, *columns*)
    samples : numbers of events of a repeat, after which its balls are counted by reduced speed
    """
    for repeat in range(len(starts) - 1):
        state = ks.state_of(states, repeat)
        first, number = starts[repeat], starts[repeat + 1] - starts[repeat]
        own = rows[first + repeat :]
        sampling.measure(own[0], sampling.totals(state), 0.0, state)
        done, sample = 0, sample_starts[repeat]
        while done < number or sample < sample_starts[repeat + 1]:
            end = number
            if sample < sample_starts[repeat + 1]:
                end = samples[sample]
            part = Recorded(
                record.time[first + done : first + end],
                record.i[first + done : first + end],
                record.j[first + done : first + end],
                record.impulse[first + done : first + end],
            )
            repeat_events(state, part, done, every[done:end], own[done + 1 :], tree)
            done = end
            if sample < sample_starts[repeat + 1]:
                sampling.count_speeds(own[done], histograms[repeat], state)
                sample += 1


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
