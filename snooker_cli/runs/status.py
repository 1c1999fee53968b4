"""The status of a run: which repeats are done, running, failed or to do, as its files show it.

A repeat is done if its file says so and is of this run. It is running if a run holds the folder's
lock and has begun to write the file; short repeats are simulated in memory, so they are to do
until their file exists. It has failed if the record of failures names it and it is not done.
"""

from collections import Counter
from collections.abc import Mapping
from datetime import UTC, datetime
from itertools import chain
from operator import itemgetter
from pathlib import Path
from typing import Any

from snooker_cli import store
from snooker_cli.files import unfinished
from snooker_cli.formatting import printable
from snooker_cli.runs.folder import failures, is_locked
from snooker_cli.runs.run import RepeatState, RepeatStatus, Run, named
from snooker_cli.trace import StopReason

COUNTS = ("done", "running", "failed", "to_do")  # each repeat is counted in one of these
LATEST = 2.5e11  # the year 9892, in s since 1970: dates end soon after it


def run_status(run: Run) -> dict[str, Any]:
    """The status of a run as ``show --json`` prints it, by the headers of its files.

    Numbers of repeats, the ``collisions`` of those that are done, and of the newest file its date
    and the command that wrote it. ``ledger`` has the same numbers of each point, the stop reasons
    of repeats that are done (``ended``), and ``remarks`` on failed repeats and unusable files.
    """
    locked = is_locked(run.directory)
    folders = run.directory.glob("point-*") if locked else ()
    writing = [named(target_of(part)) for folder in folders for part in unfinished(folder)]
    failed = failures(run)
    numbers = dict.fromkeys((*COUNTS, "collisions"), 0)
    ledger: list[dict[str, Any]] = [
        {"parameters": point.as_json(), **numbers, "ended": Counter(), "remarks": []}
        for point in run.points
    ]
    files: dict[Path, tuple[int, int, RepeatStatus]] = {}
    # Each repeat counts once: the first of done, running, failed and to do that is true of it.
    for status in chain.from_iterable(run.statuses(point.index) for point in run.points):
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
    totals = {name: sum(row[name] for row in ledger) for name in numbers}
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
        "repeats": run.experiment.repeats,
        **totals,
        "files": len(files),
        "bytes": sum(size for size, *_ in files.values()),
        "last_file": written and written.isoformat(timespec="seconds"),
        "engine_version": run.engine_version,
        "config": run.identity,
        "command": header.provenance.command if header else "",
        "ledger": ledger,
    }


def target_of(part: Path) -> Path:
    """The batch's file that a temporary file becomes."""
    return part.with_name(f"{part.name.partition('.h5.')[0]}.h5")


COMPLETE = (StopReason.COLLISIONS, StopReason.TIME)  # reasons of repeats that did not end early


def ending(reason: str) -> str:
    """The word for a stop reason: ``complete``, or why the repeat ended early."""
    return "complete" if reason in COMPLETE else reason.replace("_", " ")


def ended(point: Mapping[str, Any]) -> str:
    """How many of a point's repeats are complete, and how many ended early for each reason."""
    counts = Counter(complete=0)
    for reason, count in point["ended"].items():
        counts[ending(reason)] += count
    return ", ".join(f"{count} {word}" for word, count in counts.items() if count)
