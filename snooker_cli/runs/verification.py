"""Verify a run: read every file, check its hash and origin, and simulate it again on request."""

from __future__ import annotations

import json
import re
import threading
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from snooker_cli import store
from snooker_cli.engine import ENGINE_VERSION, simulate
from snooker_cli.errors import RunError
from snooker_cli.runs.execution import ThreadExecutor
from snooker_cli.runs.plan import first_scene
from snooker_cli.runs.run import RepeatStatus, Run, State
from snooker_cli.scene import Scene
from snooker_cli.store import RepeatHeader
from snooker_cli.trace import StopReason

_FILE = re.compile(r"point-(\d{4,})/repeat-(\d{4,})\.h5")


def verify(run: Run, *, replay: bool, workers: int) -> Iterator[RepeatStatus]:
    """The status of each repeat of the config, then of files of other repeats, as they come.

    replay : simulate each start again, with the same limits and engine, and compare all bits of
        events or summary, finish and ending, in bounded memory
    workers : threads

    Raises ``RunError`` for a replay of another engine version's results.
    """
    if replay and run.engine_version != ENGINE_VERSION:
        raise RunError(
            f"{run.directory}: holds results of engine version {run.engine_version}, which this "
            f"snooker, of version {ENGINE_VERSION}, cannot simulate again",
            "verify it without --replay",
        )
    wanted = dict.fromkeys(run.repeats())
    others = [item for path in run.files() if (item := _numbers(path)) and item not in wanted]
    cancelled = threading.Event()
    with ThreadExecutor(workers, cancelled) as threads:
        try:
            yield from threads.each(
                lambda item, _: _verified(run, item, replay, cancelled), [*wanted, *others]
            )
        finally:
            cancelled.set()


def _numbers(path: Path) -> tuple[int, int] | None:
    """The point and the repeat in a file's name; None if it has another name."""
    numbers = _FILE.fullmatch("/".join(path.parts[-2:]))
    return None if numbers is None else (int(numbers[1]), int(numbers[2]))


def _verified(
    run: Run, item: tuple[int, int], replay: bool, cancelled: threading.Event
) -> RepeatStatus:
    """The status of one file."""
    point, repeat = item
    if point >= len(run.points):
        path, reason = run.path(point, repeat), "belongs to no point of this run"
        return RepeatStatus(point, repeat, path, State.UNUSABLE, None, reason, "delete it")
    status = run.repeat_status(point, repeat)
    if replay and status.header is not None and status.state is not State.UNUSABLE:
        reason = _replay_fault(run, status.header, cancelled)
        if reason:
            advice = "delete it and run again"
            return replace(status, state=State.UNUSABLE, reason=reason, advice=advice)
    return status


def _replay_fault(run: Run, header: RepeatHeader, cancelled: threading.Event) -> str:
    """How a repeat differs from its simulation now; empty if no bit does."""
    source, start = header.provenance, header.start
    assert start is not None
    if not _same_bits(start, first_scene(run.points[source.point].experiment, source.repeat)):
        return "its start is not the one that its config gives"
    config = json.loads(source.config)
    interrupted = header.stop.reason is StopReason.INTERRUPTED
    collisions = header.collisions if interrupted else config["collisions"]
    if collisions == 0:
        return ""
    fingerprint = store.Fingerprint()
    again = simulate(
        start,
        collisions=collisions,
        time=config["time"],
        summary=config["record"] == "summary",
        watch=lambda _: cancelled.is_set(),
        sink=fingerprint.add,
        engine=run.engine,
    )
    if interrupted:  # it now stops at that collision for another reason
        again = replace(again, stop=header.stop)
    same = fingerprint.content(again) == header.fingerprint
    return "" if same or cancelled.is_set() else "simulating it again gives other bits"


def _same_bits(one: Scene, other: Scene) -> bool:
    """Whether two scenes are the same in every bit."""
    names = [field.name for field in fields(Scene) if field.name != "container"]
    return one.container == other.container and all(
        np.asarray(getattr(one, name)).tobytes() == np.asarray(getattr(other, name)).tobytes()
        for name in names
    )
