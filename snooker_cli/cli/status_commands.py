"""``snooker ls``, ``show`` and ``verify``: the state of runs and of their files."""

import sys
from collections.abc import Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import track

from snooker_cli.cli.options import AsJson, Jobs, RunName
from snooker_cli.cli.output import first, point_table, print_result, table
from snooker_cli.errors import ExitCode, RunError, StoreError
from snooker_cli.formatting import counted, listed, point_label, printable, size
from snooker_cli.progress import notice
from snooker_cli.runs import State, open_run, runs_in
from snooker_cli.runs.execution import processors
from snooker_cli.runs.status import COUNTS, ended, run_status
from snooker_cli.runs.verification import verify as verdicts

COUNT_HEADINGS = ">done | >running | >failed | >to do | >collisions"
MOST_REMARKS = 10


def ls(
    directory: Annotated[
        Path, typer.Argument(metavar="[DIR]", help="A folder of runs, or one run.")
    ] = Path("runs"),
    as_json: AsJson = False,
) -> None:
    """List the runs in DIR and the state of their repeats.

    A repeat is done if its file is complete and belongs to the run's config and engine version.
    `snooker verify` also reads the content of the files. Short repeats count as to do until their
    file is written.
    """
    found: list[dict[str, Any]] = []
    for path in runs_in(directory):
        try:
            found.append(run_status(open_run(path)))
            del found[-1]["ledger"]
        except RunError as error:
            notice(str(error))
            found.append({"run": str(path), "error": str(error)})
    if not found and not as_json:
        notice(f"{directory}: contains no runs")
        return
    headings = f"run | >points | >repeats | {COUNT_HEADINGS} | >size | last file | >engine | config"
    rows = [_row(one) for one in found if "error" not in one]
    print_result(found, as_json, table(headings, rows))


def show(run: RunName, as_json: AsJson = False) -> None:
    """Show the state of RUN: points, ends of repeats, files."""
    opened = open_run(run)
    status = run_status(opened)
    ledger = status.pop("ledger")
    content = status | {
        "title": opened.experiment.title,
        "common_random": opened.experiment.common_random,
        "analyses": [path.name for path in opened.analyses()],
        "figures": [path.name for path in opened.figures()],
        "ledger": ledger,
    }
    print_result(content, as_json, [*_status_lines(content), *opened.common_random_notes])


def _counts(record: Mapping[str, Any]) -> list[str]:
    return [f"{record[name]:,}" for name in (*COUNTS, "collisions")]


def _row(one: Mapping[str, Any]) -> list[str]:
    """A run's row in the list."""
    return [
        Path(one["run"]).name,
        f"{one['points']:,}",
        f"{one['repeats']:,}",
        *_counts(one),
        size(one["bytes"]),
        _local_time(one["last_file"]),
        _engine(one),
        one["config"],
    ]


def _status_lines(content: Mapping[str, Any]) -> Iterator[str]:
    """What ``show`` shows as text."""
    title = f" ({printable(content['title'])})" if content["title"] else ""
    state = f"{content['run']}: {content['state']}{title}"
    yield f"{state}; engine {_engine(content)}, config {content['config']}"
    points = content["ledger"]
    rows = [[point_label(one["parameters"]), *_counts(one), ended(one)] for one in points]
    yield from point_table(f"point | {COUNT_HEADINGS} | ended", rows)
    remarks = [
        f"point {k}, repeat {one['repeat']}: {one['remark']}"
        for k, point in enumerate(points)
        for one in point["remarks"]
    ]
    yield from first(remarks, MOST_REMARKS, "; --json prints all")
    contents = [f"{counted(content['files'], 'file')} of {size(content['bytes'])}"]
    contents += content["analyses"]
    if content["figures"]:
        contents.append(counted(len(content["figures"]), "figure file"))
    yield listed(contents)
    if content["command"]:
        yield f"last file {_local_time(content['last_file'])}, by: {printable(content['command'])}"


def _engine(one: Mapping[str, Any]) -> str:
    """The engine version, and the engine's name if it was forced."""
    return " ".join([str(one["engine_version"]), one["engine"] or ""]).rstrip()


def _local_time(text: str | None) -> str:
    """A date and time in this machine's time zone, to the minute."""
    return "–" if text is None else f"{datetime.fromisoformat(text).astimezone():%Y-%m-%d %H:%M}"


def verify(
    run: RunName,
    replay: Annotated[
        bool,
        typer.Option("--replay", help="Also simulate every repeat again and compare all bits."),
    ] = False,
    jobs: Jobs = None,
    as_json: AsJson = False,
) -> None:
    """Read and check every file of RUN.

    The check covers the hash of the content, and whether the file belongs to the run. A line is
    printed for each bad file, and the exit code is then 1. Missing, interrupted and too short
    repeats are reported, but they are no error.
    """
    opened = open_run(run)
    checked = track(
        verdicts(opened, replay=replay, workers=jobs or processors()),
        "",
        total=len(opened.points) * opened.experiment.repeats,
        console=Console(stderr=True),
        transient=True,
        disable=not sys.stderr.isatty(),
    )
    found = sorted(checked, key=lambda each: (each.point, each.repeat))
    counts = {str(state): sum(each.state is state for each in found) for state in State}
    del counts[str(State.UNUSABLE)]
    bad = [
        {
            "point": each.point,
            "repeat": each.repeat,
            "path": str(each.path),
            "error": str(StoreError(each.path, each.reason, each.advice)),
        }
        for each in found
        if each.state is State.UNUSABLE
    ]
    content = {"run": str(opened.directory), "replayed": replay, **counts, "bad": bad}
    print_result(content, as_json, _verification_lines(content))
    if bad:
        raise typer.Exit(ExitCode.UNSOUND)


def _verification_lines(content: Mapping[str, Any]) -> Iterator[str]:
    """What ``verify`` prints as text."""
    yield from dict.fromkeys(one["error"] for one in content["bad"])
    how = "read and simulated again" if content["replayed"] else "read again"
    files = {one["path"] for one in content["bad"]}
    bad = f", {counted(len(files), 'bad file')}" if files else ""
    complete = counted(content["done"], "complete repeat")
    yield f"{content['run']}: {complete}{bad}, {how}"
    states = (
        ("missing", "missing"),
        ("interrupted", "interrupted"),
        ("shorter", "shorter than the extended run"),
    )
    rest = [f"{content[state]:,} {words}" for state, words in states if content[state]]
    if rest:
        yield f"{listed(rest)}; run the config again to complete them"
