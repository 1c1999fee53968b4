"""Every file of a run read again: its hash, whose it is and, if wanted, simulated once more."""

from __future__ import annotations

import json
import re
import threading
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from snooker_cli import store
from snooker_cli.engine import ENGINE_VERSION, simulate
from snooker_cli.errors import RunError
from snooker_cli.runs.execution import ThreadExecutor
from snooker_cli.runs.plan import arranged
from snooker_cli.runs.run import Run, State
from snooker_cli.runs.status import Job, entry, jobs
from snooker_cli.scene import Scene
from snooker_cli.store import RepeatHeader
from snooker_cli.trace import StopReason

_FILE = re.compile(r"point-(\d{4,})/repeat-(\d{4,})\.h5")


@dataclass(frozen=True)
class Verdict:
    """What became of reading a repeat again.

    state : as in the ledger; ``UNUSABLE`` if anything is wrong with the file
    collisions : that it holds
    sentence : what is wrong, or why the repeat is not done
    """

    path: Path
    point: int
    repeat: int
    state: State
    collisions: int
    sentence: str


def verify(run: Run, *, replay: bool, workers: int) -> Iterator[Verdict]:
    """A verdict for each repeat of the config, and for files of more repeats, as they come.

    replay : simulate each stored start again, with the limits and the engine that it had, and
        compare all bits of events or summary, finish and ending; memory stays bounded
    workers : threads

    Raises ``RunError`` for a replay of another engine version's results.
    """
    if replay and run.engine_version != ENGINE_VERSION:
        raise RunError(
            f"{run.directory}: holds results of engine version {run.engine_version}, which this "
            f"snooker, of version {ENGINE_VERSION}, cannot simulate again; verify it without "
            "--replay"
        )
    cancelled = threading.Event()
    with ThreadExecutor(workers, cancelled) as threads:
        try:
            yield from threads.each(
                lambda target, _: _verdict(run, target, replay, cancelled), _targets(run)
            )
        finally:
            cancelled.set()


def _targets(run: Run) -> Iterator[Job | Path]:
    """Every repeat of the config, then the files that are there besides."""
    wanted = set()
    for job in jobs(run):
        wanted.add(run.path(job.point.index, job.repeat))
        yield job
    for path in run.repeats_there():
        place = _place(path)
        if place is None or path in wanted:
            continue
        point, repeat = place
        known = point < len(run.points)
        yield Job(run.points[point], repeat, run.digests[point]) if known else path


def _place(path: Path) -> tuple[int, int] | None:
    """The point and the repeat that a file's name tells."""
    numbers = _FILE.fullmatch("/".join(path.parts[-2:]))
    return None if numbers is None else (int(numbers[1]), int(numbers[2]))


def _verdict(run: Run, target: Job | Path, replay: bool, cancelled: threading.Event) -> Verdict:
    """One file's verdict."""
    if isinstance(target, Path):
        point, repeat = _place(target) or (-1, -1)
        sentence = f"{target}: belongs to no point of this run; delete it"
        return Verdict(target, point, repeat, State.UNUSABLE, 0, sentence)
    found = entry(run, target)
    state, sentence = found.state, found.sentence
    told = found.told
    if replay and told is not None and state is not State.UNUSABLE:
        wrong = _replay_fault(run, target, told, cancelled)
        if wrong:
            state, sentence = State.UNUSABLE, f"{found.path}: {wrong}; delete it and run again"
    collisions = 0 if told is None else told.collisions
    return Verdict(found.path, target.point.index, target.repeat, state, collisions, sentence)


def _replay_fault(run: Run, job: Job, told: RepeatHeader, cancelled: threading.Event) -> str:
    """In what a repeat differs from its simulation now; nothing if in no bit."""
    assert told.start is not None
    if not _same(told.start, arranged(job.point.experiment, job.repeat)):
        return "its start is not the one that its config gives"
    config = json.loads(told.provenance.config)
    collisions, interrupted = config["collisions"], told.stop.reason is StopReason.INTERRUPTED
    if interrupted:
        collisions = told.collisions
    if collisions == 0:
        return ""
    fingerprint = store.Fingerprint()
    again = simulate(
        told.start,
        collisions=collisions,
        time=config["time"],
        summary=config["record"] == "summary",
        watch=lambda _: cancelled.is_set(),
        sink=fingerprint.add,
        engine=run.engine,
    )
    if interrupted:  # simulated to the same collision, not stopped by the user there
        again = replace(again, stop=told.stop)
    same = fingerprint.content(again) == told.fingerprint
    return "" if same or cancelled.is_set() else "simulating it again gives other bits"


def _same(one: Scene, other: Scene) -> bool:
    """Whether two scenes are the same in every bit."""
    names = [field.name for field in fields(Scene) if field.name != "container"]
    return one.container == other.container and all(
        np.asarray(getattr(one, name)).tobytes() == np.asarray(getattr(other, name)).tobytes()
        for name in names
    )
