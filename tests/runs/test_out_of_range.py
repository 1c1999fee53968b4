"""Repeats with numbers that no result can have end before these, and are not simulated again."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from repeating import batches_of, done, made, stopped

from snooker_cli import store
from snooker_cli.engine import simulation
from snooker_cli.errors import UnsoundError
from snooker_cli.runs import batch, out_of_range, verification
from snooker_cli.runs.run import RepeatState
from snooker_cli.runs.verification import verify
from snooker_cli.store import Provenance
from snooker_cli.trace import Events, StopReason, Trace

FIRST = 60
"""Collisions after which the engines of these tests go wrong; repeats have 150."""

Change = Callable[[Trace], Trace]


def wrong_events(events: Events, before: int) -> Events:
    """The events with an impulse that is no number after the first ``FIRST``."""
    impulse = events.impulse.copy()
    impulse[max(FIRST - before, 0) :] = np.nan
    return replace(events, impulse=impulse)


def wrong_impulse(trace: Trace) -> Trace:
    return trace if trace.events is None else replace(trace, events=wrong_events(trace.events, 0))


def wrong_finish(trace: Trace) -> Trace:
    velocities = trace.finish.velocities.copy()
    velocities[3] = np.nan
    return replace(trace, finish=replace(trace.finish, velocities=velocities))


def wrong_ending(trace: Trace) -> Trace:
    return replace(trace, stop=trace.stop._replace(accumulation_time=np.nan))


def wrong_summary(trace: Trace) -> Trace:
    if trace.summary is None:
        return trace
    energy = trace.summary.series.kinetic_energy.copy()
    energy[-1] = np.inf
    series = replace(trace.summary.series, kinetic_energy=energy)
    return replace(trace, summary=replace(trace.summary, series=series))


@contextmanager
def wrong_engine(change: Change) -> Iterator[None]:
    """Inside, repeats of more than ``FIRST`` collisions are changed."""
    simulate, simulate_batch = batch.simulate, batch.simulate_batch

    def changed(trace: Trace) -> Trace:
        return change(trace) if trace.collisions > FIRST else trace

    def wrong(*given: Any, sink: Any = None, **how: Any) -> Trace:
        before = 0

        def take(events: Events) -> None:
            nonlocal before
            if change is wrong_impulse:
                events, before = wrong_events(events, before), before + len(events)
            sink(events)

        return changed(simulate(*given, sink=sink and take, **how))

    with pytest.MonkeyPatch.context() as patched:
        for module in (batch, out_of_range, verification):
            patched.setattr(module, "simulate", wrong)
        traces = lambda *given, **how: [*map(changed, simulate_batch(*given, **how))]  # noqa: E731
        patched.setattr(batch, "simulate_batch", traces)
        yield


CASES = [
    (wrong_impulse, "events", "wrong impulse of an event"),
    (wrong_finish, "events", "wrong speed of a ball"),
    (wrong_ending, "events", "wrong ending"),
    (wrong_summary, "summary", "wrong kinetic_energy of a summary"),
]


@pytest.mark.parametrize("size", [1, 3])
@pytest.mark.parametrize(("change", "record", "fault"), CASES)
def test_a_repeat_ends_before_a_number_that_no_result_can_have(
    change: Change, record: str, fault: str, size: int, tmp_path: Path, one_point: str
) -> None:
    """Alone or in a batch. It is done, and can be read and simulated again."""
    if record == "summary":
        one_point = one_point.replace("collisions: 150", "collisions: 1000")
    run = made(tmp_path / "run", one_point, "repeats=3", f"record={record}")
    with wrong_engine(change), batches_of(size):
        first, again = done(run), done(run)
        verdicts = [*verify(run, replay=True, workers=1)]
    assert {(result.stop.reason, result.collisions) for result in first if result.stop} == {
        (StopReason.OUT_OF_RANGE, FIRST)
    }
    for result in first:
        assert result.stop is not None
        assert result.stop.message.startswith(f"out of range: after {FIRST} collisions, at ")
        assert f"({fault})" in result.stop.message
    assert all(result.cached for result in again)
    assert {verdict.state for verdict in verdicts} == {RepeatState.DONE}
    assert {trace.collisions for trace in run.traces(run.points[0])} == {FIRST}


def test_a_repeat_that_was_interrupted_ends_there_too(
    tmp_path: Path, one_point: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It begins again, because what is wrong may be in its checkpoint."""
    monkeypatch.setattr(simulation, "CHUNK", 20)
    run = made(tmp_path / "run", one_point, "repeats=1")
    with wrong_engine(wrong_finish):
        (before,) = stopped(run, 40)
        (result,) = done(run)
    assert before.stop is not None
    assert result.stop is not None
    assert (before.stop.reason, before.collisions) == (StopReason.INTERRUPTED, 40)
    assert (result.stop.reason, result.collisions) == (StopReason.OUT_OF_RANGE, FIRST)
    assert result.continued == 0
    assert store.check(run.path(0, [0]))


def test_a_forged_ending_out_of_range_is_found(tmp_path: Path, one_point: str) -> None:
    """Of a repeat that goes on well after its last event."""
    run = made(tmp_path / "run", one_point, "repeats=1")
    with wrong_engine(wrong_impulse):
        done(run)
    (verdict,) = verify(run, replay=True, workers=1)
    assert verdict.state is RepeatState.UNUSABLE


def test_a_repeat_whose_start_cannot_be_stored_fails(tmp_path: Path, one_point: str) -> None:
    """With a sentence; the others of its batch are stored."""
    run = made(tmp_path / "run", one_point, "repeats=3")
    bad = run.points[0].config

    def check(traces: list[Trace]) -> None:
        if any(store.scene_hash(trace.start) == hashes[1] for trace in traces):
            raise UnsoundError("wrong place of a ball")

    starts = batch.starting_scenes(bad, range(3))
    hashes = [store.scene_hash(start) for start in starts]
    with pytest.MonkeyPatch.context() as patched:
        for name in ("value_ranges", "writer"):
            patched.setattr(getattr(store, name), "check_repeats", check)
        patched.setattr(store, "check_repeats", check)
        results = done(run)
    assert [result.error for result in results] == [
        None,
        "its result cannot be stored (wrong place of a ball); choose units in which lengths, "
        "masses, speeds and times are nearer to 1",
        None,
    ]


# The writer


WRONG: list[tuple[Change, str]] = [
    (wrong_impulse, "impulse of an event"),
    (wrong_finish, "speed of a ball"),
    (wrong_ending, "ending"),
    (lambda trace: replace(trace, pair_events=trace.pair_events + 1), "number of events"),
]


@pytest.mark.parametrize(("change", "fault"), WRONG)
def test_the_writer_writes_no_file_that_the_reader_refuses(
    change: Change, fault: str, traces: dict[str, Trace], tmp_path: Path, provenance: Provenance
) -> None:
    with pytest.raises(UnsoundError, match=f"wrong {fault}"):
        store.write(tmp_path / "one.h5", [(0, change(traces["events"]))], provenance)
    assert not [*tmp_path.iterdir()]
