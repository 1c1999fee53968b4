"""The status of a run: which repeats are done, running, failed or to do, as its files show it.

A repeat is done if its file says so and is of this run. It is running if a run holds the folder's
lock and has begun to write the file; short repeats are simulated in memory, so they are to do
until their file exists. It has failed if the record of failures names it and it is not done.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import UTC, datetime
from itertools import chain
from operator import itemgetter
from pathlib import Path
from typing import Any

from snooker_cli import facts, store
from snooker_cli.config import Config, Point
from snooker_cli.files import unfinished
from snooker_cli.formatting import counted, printable
from snooker_cli.runs.folder import failures, is_locked
from snooker_cli.runs.run import RepeatState, RepeatStatus, RunFolder, point_and_repeats
from snooker_cli.trace import StopReason

COUNTS = ("done", "running", "failed", "to_do")  # each repeat is counted in one of these
LATEST = 2.5e11  # the year 9892, in s since 1970: dates end soon after it


def run_status(run: RunFolder, reading: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """The status of a run as ``show --json`` prints it, by the headers of its files.

    reading : gets a text about what is read now, for a display of progress

    Numbers of repeats, the ``collisions`` of those that are done, and of the newest file its date
    and the command that wrote it. ``ledger`` has the same numbers of each point, the stop reasons
    of repeats that are done (``ended``), and ``remarks`` on failed repeats and unusable files.
    ``former`` has the points that the sweep no longer lists.
    """
    locked = is_locked(run.directory)
    folders = run.directory.glob("point-*") if locked else ()
    parts = chain.from_iterable(map(unfinished, folders))
    writing = [point_and_repeats(target_of(part)) for part in parts]
    failed = failures(run)
    numbers = dict.fromkeys((*COUNTS, "collisions"), 0)
    ledger: dict[int, dict[str, Any]] = {
        point.index: {
            "point": point.index,
            "parameters": point.as_json(),
            **numbers,
            "ended": Counter(),
            "remarks": [],
        }
        for point in run.points
    }
    files: dict[Path, tuple[int, int, RepeatStatus]] = {}
    # Each repeat counts once: the first of done, running, failed and to do that is true of it.
    for status in _read(run, reading):
        row, item, remark = ledger[status.point], (status.point, status.repeat), ""
        if status.path not in files and (info := store.file_info(status.path)):
            files[status.path] = *info, status
        if status.state is RepeatState.DONE and status.header is not None:
            state = "done"
            row["ended"][str(status.header.stop.reason)] += 1
            row["collisions"] += status.header.collisions
        elif any(point == status.point and status.repeat in repeats for point, repeats in writing):
            state = "running"
        elif item in failed:
            state, remark = "failed", printable(f"failed: {failed[item]}")
        else:
            state = "to_do"
            if status.error:
                remark = "; ".join(filter(None, (status.error.reason, status.error.advice)))
        row[state] += 1
        if remark:
            unusable = state == "to_do" and status.state is RepeatState.UNUSABLE
            file = {"file": str(status.path)} if unusable else {}
            row["remarks"].append({"repeat": status.repeat, "remark": remark} | file)
    totals = {name: sum(row[name] for row in ledger.values()) for name in numbers}
    state = "unfinished" if totals["failed"] + totals["to_do"] else "done"
    header = written = None
    if files:  # an archive may give a file any date
        _, modified, newest = max(files.values(), key=itemgetter(1))
        written = datetime.fromtimestamp(min(max(modified / 1e9, 0.0), LATEST), UTC)
        header = newest.header
    return {
        "run": str(run.directory),
        "state": "running" if locked else state,
        "points": len(run.points),
        "repeats": run.config.repeats,
        **totals,
        "files": len(files),
        "bytes": sum(size for size, *_ in files.values()),
        "last_file": written and written.isoformat(timespec="seconds"),
        "engine_version": run.engine_version,
        "config": run.identity,
        "command": header.provenance.command if header else "",
        "ledger": [*ledger.values()],
        "former": [{"point": p.index, "parameters": p.as_json()} for p in run.former],
    }


def _read(run: RunFolder, reading: Callable[[str], None]) -> Iterator[RepeatStatus]:
    """Whether each repeat is done, point after point."""
    for place, point in enumerate(run.points, 1):
        reading(f"{run.name}: reading the files of point {place:,} of {len(run.points):,}")
        yield from run.statuses(point.index)


def target_of(part: Path) -> Path:
    """The batch's file that a temporary file becomes."""
    return part.with_name(f"{part.name.partition('.h5.')[0]}.h5")


COMPLETE = (StopReason.COLLISIONS, StopReason.TIME)  # reasons of repeats that did not end early


def ending(reason: str) -> str:
    """The word for a stop reason: ``complete``, or why the repeat ended early."""
    return "complete" if reason in COMPLETE else reason.replace("_", " ")


def continuing(config: Config, reason: StopReason) -> str:
    """What a config sets so that repeats with such an end continue; empty if there is no way."""
    traits = facts.traits_of(config)
    if reason is StopReason.WALL_TRAP and config.collapse == "stop":
        if not facts.hold(traits, "smooth_wall", "one_wall_cor"):
            return "`collapse: {tc: 0.01}`"
        if facts.hold(traits, "fixed"):
            return "`collapse: slide` (exact)"
        return "`collapse: slide` (exact, fixed container) or `collapse: {tc: 0.01}`"
    if reason is StopReason.COLLAPSE and config.collapse in ("stop", "slide"):
        return "`collapse: {tc: 0.01}`" if facts.hold(traits, "lossy") else ""
    return ""


def early_warning(run: RunFolder, points: Iterable[Point]) -> str:
    """A sentence if most repeats of points ended early, with what helps; empty if they did not."""
    total, ways, unfinished_repeats = 0, Counter[str](), False
    for point in points:
        for header in filter(None, (status.header for status in run.statuses(point.index))):
            total += 1
            if not (reason := header.stop.reason).complete:
                interrupted = reason is StopReason.INTERRUPTED
                ways["" if interrupted else continuing(point.config, reason)] += 1
                unfinished_repeats |= interrupted
    if 2 * ways.total() <= total:
        return ""
    helps = " or ".join(filter(None, (way for way, _ in ways.most_common())))
    advice = f"; to continue them, set {helps} in the config" if helps else ""
    if unfinished_repeats:
        advice = "; run the config again to finish them"
    most = f"{ways.total():,} of {counted(total, 'repeat')}"
    return f"{most} ended early, so that results rest on their beginnings{advice}"


def ended(point: Mapping[str, Any]) -> str:
    """How many of a point's repeats are complete, and how many ended early for each reason."""
    counts = Counter(complete=0)
    for reason, count in point["ended"].items():
        counts[ending(reason)] += count
    return ", ".join(f"{count} {word}" for word, count in counts.items() if count)
