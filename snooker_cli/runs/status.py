"""The status of a run: which repeats are done, running, failed or to do, as its files show it.

A repeat is done if its file says so and is of this run. It is running if a run holds the folder's
lock and has begun to write the file; short repeats are simulated in memory, so they are to do
until their file exists. It has failed if the record of failures names it and it is not done.
"""

from collections import Counter
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path

from snooker_cli import store
from snooker_cli.config import Point
from snooker_cli.files import unfinished
from snooker_cli.formatting import printable
from snooker_cli.runs.folder import failures, is_locked
from snooker_cli.runs.run import RepeatStatus, Run, State, is_named, named


@dataclass
class PointStatus:
    """The repeats of a point.

    done, running, failed, to_do : numbers of repeats, each in one of them
    ended : the stop reasons of the repeats that are done, and how many have each
    collisions : of the repeats that are done
    remarks : number and problem of each repeat that failed or whose file is not usable
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
class RunStatus:
    """The status of all repeats of a run.

    locked : whether a `snooker run` is writing in the folder
    finished : when the last file was written, s since 1970; None without files
    command : the command that wrote it
    files, bytes : number and size of the repeats' files
    """

    run: Run
    locked: bool
    points: tuple[PointStatus, ...]
    finished: float | None
    command: str
    files: int
    bytes: int

    def total(self, name: str) -> int:
        """The sum of ``done``, ``collisions`` and so on over the points."""
        return sum(getattr(point, name) for point in self.points)


def run_status(run: Run) -> RunStatus:
    """The status of a run by the headers of its files, whose content is not checked."""
    locked = is_locked(run.directory)
    folders = run.directory.glob("point-*") if locked else ()
    parts = chain.from_iterable(map(unfinished, folders))
    writing = [named(path) for path in map(target_of, parts) if is_named(path)]
    failed = failures(run)
    points = tuple(PointStatus(point) for point in run.points)
    files: dict[Path, tuple[store.FileInfo, RepeatStatus]] = {}
    for status in chain.from_iterable(run.statuses(point.index) for point in run.points):
        item, mine = (status.point, status.repeat), points[status.point]
        if status.path not in files and (info := store.file_info(status.path)):
            files[status.path] = info, status
        if status.state is State.DONE and status.header is not None:
            mine.done += 1
            mine.ended[str(status.header.stop.reason)] += 1
            mine.collisions += status.header.collisions
        elif any(point == status.point and status.repeat in some for point, some in writing):
            mine.running += 1
        elif item in failed:
            mine.failed += 1
            mine.remarks.append((status.repeat, printable(f"failed: {failed[item]}")))
        else:
            mine.to_do += 1
            if status.reason:
                remark = "; ".join(filter(None, (status.reason, status.advice)))
                mine.remarks.append((status.repeat, remark))
    last, newest = max(files.values(), key=lambda file: file[0].modified, default=(None, None))
    header = newest.header if newest else None
    return RunStatus(
        run,
        locked,
        points,
        finished=last.modified / 1e9 if last else None,
        command=header.provenance.command if header else "",
        files=len(files),
        bytes=sum(info.size for info, _ in files.values()),
    )


def target_of(part: Path) -> Path:
    """The batch's file that a temporary file becomes."""
    return part.with_name(f"{part.name.partition('.h5.')[0]}.h5")
