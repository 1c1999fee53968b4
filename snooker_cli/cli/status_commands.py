"""``snooker verify``: read every file of a run again, and simulate it again."""

from __future__ import annotations

import os
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snooker_cli.cli.analysis_commands import RunName
from snooker_cli.cli.output import tell
from snooker_cli.cli.run_command import MOST_ROWS, AsJson, Jobs

if TYPE_CHECKING:
    from collections.abc import Iterator

    from snooker_cli.runs import RepeatStatus, Run
    from snooker_cli.runs.status import RunStatus


# ``snooker ls`` and ``show``: what there is of runs, as their files tell it.

COUNTS = ("done", "running", "failed", "to_do")
"""The ledger: each repeat is in one of them."""

MOST_REMARKS = 10


def ls(
    directory: Annotated[
        Path, typer.Argument(metavar="[DIR]", help="A folder of runs, or one run.")
    ] = Path("runs"),
    as_json: AsJson = False,
) -> None:
    """List the runs in DIR: what is done, running, failed and to do, as their files tell it.

    A repeat counts as done if its file says that it is whole and of the run's config and engine
    version; `snooker verify` reads the content, too. Short repeats, which are simulated in memory,
    are to do until their file is there.
    """
    import json

    from snooker_cli.cli.output import print_table
    from snooker_cli.cli.progress_bar import say
    from snooker_cli.errors import RunError
    from snooker_cli.formatting import Column
    from snooker_cli.runs import open_run, runs_in
    from snooker_cli.runs.status import run_status

    found: list[dict[str, Any]] = []
    for path in runs_in(directory):
        try:
            found.append(_summary(run_status(open_run(path))))
        except RunError as error:
            say(str(error))
            found.append({"run": str(path), "error": str(error)})
    if as_json:
        tell(json.dumps(found))
        return
    if not found:
        say(f"{directory}: there are no runs in it")
        return
    print_table(
        [
            Column("run"),
            Column("points", True),
            Column("repeats", True),
            *(Column(name.replace("_", " "), True) for name in COUNTS),
            Column("collisions", True),
            Column("size", True),
            Column("last file"),
            Column("engine", True),
            Column("config"),
        ],
        [_row(one) for one in found if "error" not in one],
    )


def show(run: RunName, as_json: AsJson = False) -> None:
    """Show what there is of RUN: its ledger by point, how repeats ended, files and analyses."""
    import json

    from snooker_cli.runs import open_run
    from snooker_cli.runs.status import run_status

    opened = open_run(run)
    status = run_status(opened)
    content = _summary(status) | {
        "title": opened.experiment.title,
        "analyses": [path.name for path in opened.analyses()],
        "figures": [path.name for path in opened.figures()],
        "ledger": [
            {
                "parameters": one.point.as_json(),
                **{name: getattr(one, name) for name in COUNTS},
                "collisions": one.collisions,
                "ended": dict(one.ended),
                "remarks": [
                    {"repeat": repeat, "remark": sentence} for repeat, sentence in one.remarks
                ],
            }
            for one in status.points
        ],
    }
    if as_json:
        tell(json.dumps(content))
    else:
        _print(content)


def _summary(status: RunStatus) -> dict[str, Any]:
    """What ``ls --json`` prints of a run."""
    run = status.run
    counts = {name: status.total(name) for name in COUNTS}
    unfinished = "unfinished" if counts["failed"] + counts["to_do"] else "done"
    last = None if status.finished is None else datetime.fromtimestamp(status.finished, UTC)
    return {
        "run": str(run.directory),
        "state": "running" if status.locked else unfinished,
        "points": len(run.points),
        "repeats": run.experiment.repeats,
        **counts,
        "collisions": status.total("collisions"),
        "files": status.files,
        "bytes": status.bytes,
        "last_file": None if last is None else last.isoformat(timespec="seconds"),
        "engine_version": run.engine_version,
        "engine": run.engine,
        "config": run.identity,
        "command": status.command,
    }


def _row(one: dict[str, Any]) -> list[str]:
    """A run's line in the list."""
    from snooker_cli.formatting import size

    return [
        Path(one["run"]).name,
        f"{one['points']:,}",
        f"{one['repeats']:,}",
        *(f"{one[name]:,}" for name in COUNTS),
        f"{one['collisions']:,}",
        size(one["bytes"]),
        _moment(one["last_file"]),
        _engine(one),
        one["config"],
    ]


def _print(content: dict[str, Any]) -> None:
    """A run for people."""
    from snooker_cli.cli.output import point_label, print_table
    from snooker_cli.formatting import Column, counted, listed, size

    title = f" ({content['title']})" if content["title"] else ""
    tell(
        f"{content['run']}: {content['state']}{title}; engine {_engine(content)}, config "
        f"{content['config']}"
    )
    ledger = content["ledger"]
    print_table(
        [
            Column("point"),
            *(Column(name.replace("_", " "), True) for name in COUNTS),
            Column("collisions", True),
            Column("ended"),
        ],
        [
            [
                point_label(one["parameters"]),
                *(f"{one[name]:,}" for name in COUNTS),
                f"{one['collisions']:,}",
                ", ".join(f"{count} {reason}" for reason, count in one["ended"].items()),
            ]
            for one in ledger[:MOST_ROWS]
        ],
    )
    if len(ledger) > MOST_ROWS:
        tell(f"... and {len(ledger) - MOST_ROWS:,} more points; --json tells of all")
    remarks = [
        f"point {k}, repeat {one['repeat']}: {one['remark']}"
        for k, point in enumerate(ledger)
        for one in point["remarks"]
    ]
    for remark in remarks[:MOST_REMARKS]:
        tell(remark)
    if len(remarks) > MOST_REMARKS:
        tell(f"... and {len(remarks) - MOST_REMARKS:,} more; --json tells of all")
    there = [f"{counted(content['files'], 'file')} of {size(content['bytes'])}"]
    there += content["analyses"]
    if content["figures"]:
        there.append(counted(len(content["figures"]), "figure file"))
    tell(listed(there))
    if content["command"]:
        tell(f"last file {_moment(content['last_file'])}, by: {content['command']}")


def _engine(one: dict[str, Any]) -> str:
    """The engine version, and which engine if all points were told to have the same."""
    forced = f" {one['engine']}" if one["engine"] else ""
    return f"{one['engine_version']}{forced}"


def _moment(text: str | None) -> str:
    """A moment in this machine's time, to the minute."""
    return "–" if text is None else f"{datetime.fromisoformat(text).astimezone():%Y-%m-%d %H:%M}"


def verify(
    run: RunName,
    replay: Annotated[
        bool,
        typer.Option("--replay", help="Simulate every repeat again, too, and compare all bits."),
    ] = False,
    jobs: Jobs = None,
    as_json: AsJson = False,
) -> None:
    """Read every file of RUN again: its content by its hash, and whether it is of this run.

    A line is printed for each bad file, and the exit code is then 1. Repeats that are missing,
    interrupted or shorter than an extended run's are told, but are no fault.
    """
    import json

    from snooker_cli.errors import ExitCode
    from snooker_cli.runs import State, open_run

    opened = open_run(run)
    verdicts = sorted(
        _followed(opened, replay, jobs or os.cpu_count() or 1),
        key=lambda verdict: (verdict.point, verdict.repeat),
    )
    bad = [verdict for verdict in verdicts if verdict.state is State.UNUSABLE]
    counts = {
        str(state): sum(verdict.state is state for verdict in verdicts)
        for state in State
        if state is not State.UNUSABLE
    }
    content: dict[str, Any] = {
        "run": str(opened.directory),
        "replayed": replay,
        **counts,
        "bad": [
            {
                "point": verdict.point,
                "repeat": verdict.repeat,
                "path": str(verdict.path),
                "error": str(verdict.error),
            }
            for verdict in bad
        ],
    }
    if as_json:
        tell(json.dumps(content))
    else:
        for line in _lines(content):
            tell(line)
    if bad:
        raise typer.Exit(ExitCode.UNSOUND)


def _followed(run: Run, replay: bool, workers: int) -> Iterator[RepeatStatus]:
    """The verdicts, with a progress bar on a terminal."""
    from rich.console import Console
    from rich.progress import track

    from snooker_cli.runs.verification import verify as verdicts

    return iter(
        track(
            verdicts(run, replay=replay, workers=workers),
            "",
            total=len(run.points) * run.experiment.repeats,
            console=Console(stderr=True),
            transient=True,
            disable=not sys.stderr.isatty(),
        )
    )


def _lines(content: dict[str, Any]) -> Iterator[str]:
    """The verdict for people."""
    from snooker_cli.formatting import counted, listed

    for one in content["bad"]:
        yield one["error"]
    how = "read and simulated again" if content["replayed"] else "read again"
    bad = f", {counted(len(content['bad']), 'bad file')}" if content["bad"] else ""
    whole = counted(content["done"], "whole repeat")
    yield f"{content['run']}: {whole}{bad}, {how}"
    left = [
        f"{content[state]:,} {words}"
        for state, words in (
            ("missing", "missing"),
            ("interrupted", "interrupted"),
            ("shorter", "shorter than the run is now"),
        )
        if content[state]
    ]
    if left:
        yield f"{listed(left)}; run the config again, which does them"
