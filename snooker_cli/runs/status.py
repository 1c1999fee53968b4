"""What there is of each repeat of a run: done, running, failed or to do.

All of it is told by the files: a repeat is done if its own file says so and is of this run. It is
running if a run holds the folder and has begun to write the repeat's file; short repeats are
simulated in memory, and are to do until their file is there. It has failed if the record of the
last attempt's failures says so and it is not done.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from snooker_cli import files, store
from snooker_cli.config import Point
from snooker_cli.errors import StoreError
from snooker_cli.runs.folder import failures, is_held
from snooker_cli.runs.run import Run, State
from snooker_cli.store import RepeatHeader


@dataclass(frozen=True)
class Job:
    """A repeat to do, and its point's digest."""

    point: Point
    repeat: int
    digest: str


@dataclass(frozen=True)
class Entry:
    """What there is of one repeat.

    told : what its file says of itself, if there is one that can be read
    sentence : why it is not done, if there is a file
    """

    job: Job
    path: Path
    state: State
    told: RepeatHeader | None = None
    sentence: str = ""


@dataclass
class PointLedger:
    """The repeats of a point.

    done, running, failed, to_do : all of the config's repeats, each in one of them
    ended : why those that are done ended, and how many
    collisions : of those that are done
    remarks : a sentence for each repeat that failed or whose file does not count
    """

    point: Point
    done: int = 0
    running: int = 0
    failed: int = 0
    to_do: int = 0
    ended: Counter[str] = field(default_factory=Counter)
    collisions: int = 0
    remarks: list[tuple[int, str]] = field(default_factory=list)


@dataclass(frozen=True)
class Ledger:
    """What there is of a run.

    held : a `snooker run` is writing in the folder
    finished : when the last file was put in its place, s since 1970; none without files
    command : what made that file
    files, bytes : of all repeats that are there
    """

    run: Run
    held: bool
    points: tuple[PointLedger, ...]
    finished: float | None
    command: str
    files: int
    bytes: int

    def total(self, name: str) -> int:
        """The sum over the points of ``done``, ``collisions`` and so on."""
        return sum(getattr(point, name) for point in self.points)


def jobs(run: Run) -> Iterator[Job]:
    """Every repeat of every point."""
    for point, identity in zip(run.points, run.digests, strict=True):
        for repeat in range(run.experiment.repeats):
            yield Job(point, repeat, identity)


def entry(run: Run, job: Job, look: Callable[[Path], RepeatHeader] = store.check) -> Entry:
    """What there is of a repeat.

    look : ``store.check``, or ``store.read_header`` where it is enough what the file says of itself
    """
    path = run.path(job.point.index, job.repeat)
    if store.file_info(path) is None:
        return Entry(job, path, State.MISSING)
    try:
        told = look(path)
    except StoreError as error:
        return Entry(job, path, State.UNUSABLE, sentence=str(error))
    state, sentence = run.state(job.point, job.repeat, told)
    return Entry(job, path, state, told, sentence)


def ledger(run: Run) -> Ledger:
    """What there is of a run, by what its files say of themselves."""
    held = is_held(run.directory)
    begun = set(_begun(run)) if held else set()
    failed = failures(run)
    points = tuple(PointLedger(point) for point in run.points)
    newest: tuple[float, str] | None = None
    number = size = 0
    for job in jobs(run):
        found = entry(run, job, store.read_header)
        _count(points[job.point.index], found, found.path in begun, failed)
        about = store.file_info(found.path)
        if about is None:
            continue
        number, size = number + 1, size + about.size
        if newest is None or about.modified / 1e9 > newest[0]:
            newest = about.modified / 1e9, found.told.provenance.command if found.told else ""
    finished, command = newest or (None, "")
    return Ledger(run, held, points, finished, command, number, size)


def _begun(run: Run) -> Iterator[Path]:
    """The files that are being written."""
    for folder in run.directory.glob("point-*"):
        for part in files.unfinished(folder):
            yield folder / f"{part.name.partition('.h5.')[0]}.h5"


def _count(
    point: PointLedger, found: Entry, begun: bool, failed: dict[tuple[int, int], str]
) -> None:
    """Enter a repeat."""
    repeat = found.job.repeat
    error = failed.get((point.point.index, repeat))
    if found.state is State.DONE and found.told is not None:
        point.done += 1
        point.ended[str(found.told.stop.reason)] += 1
        point.collisions += found.told.collisions
    elif begun:
        point.running += 1
    elif error is not None:
        point.failed += 1
        point.remarks.append((repeat, f"failed: {error}"))
    else:
        point.to_do += 1
        if found.sentence:
            point.remarks.append((repeat, found.sentence.removeprefix(f"{found.path}: ")))
