"""``snooker ls``, ``show`` and ``verify``: the state of runs and of their files."""

import sys
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import track

from snooker_cli.cli.options import AsJson, Jobs, RunName
from snooker_cli.cli.output import first, print_result
from snooker_cli.cli.typer_classes import flag
from snooker_cli.errors import ExitCode, RunError, StoreError
from snooker_cli.formatting import counted, listed, point_label, printable, size, text_table
from snooker_cli.runs import State, open_run, runs_in
from snooker_cli.runs.execution import processors
from snooker_cli.runs.progress import notice
from snooker_cli.runs.status import COUNTS, ended, run_status
from snooker_cli.runs.verification import verify as verdicts

COUNT_HEADINGS = (">done", ">running", ">failed", ">to do", ">collisions")


def ls(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="A folder of runs, or one run.")
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
        except (RunError, StoreError) as error:
            notice(str(error))
            found.append({"run": str(path), "error": str(error)})
    if not found and not as_json:
        notice(f"{directory}: contains no runs")
        return
    headings = ["run", ">points", ">repeats", *COUNT_HEADINGS]
    headings += [">size", "last file", ">engine", "config"]
    rows = [
        [
            Path(one["run"]).name,
            *_counts(one, "points", "repeats"),
            size(one["bytes"]),
            _local_time(one["last_file"]),
            _engine(one),
            one["config"],
        ]
        for one in found
        if "error" not in one
    ]
    print_result(found, as_json, text_table(headings, rows))


def show(run: RunName, as_json: AsJson = False) -> None:
    """Show the state of RUN: points, ends of repeats, files."""
    opened = open_run(run)
    content = run_status(opened) | {
        "title": opened.experiment.title,
        "common_random": opened.experiment.common_random,
        "figures": [path.name for path in opened.figures()],
    }
    title = f" ({printable(content['title'])})" if content["title"] else ""
    state = f"{content['run']}: {content['state']}{title}"
    points = content["ledger"]
    rows = [[point_label(one["parameters"]), *_counts(one), ended(one)] for one in points]
    remarks = dict.fromkeys(
        f"{one.get('file') or 'point {}, repeat {}'.format(k, one['repeat'])}: {one['remark']}"
        for k, point in enumerate(points)
        for one in point["remarks"]
    )
    contents = [f"{counted(content['files'], 'file')} of {size(content['bytes'])}"]
    if content["figures"]:
        contents.append(counted(len(content["figures"]), "figure file"))
    lines = [
        f"{state}; engine {_engine(content)}, config {content['config']}",
        *first(text_table(["point", *COUNT_HEADINGS, "ended"], rows)),
        *first([*remarks], 10, "; --json prints all"),
        listed(contents),
    ]
    if content["command"]:
        written = _local_time(content["last_file"])
        lines.append(f"last file {written}, by: {printable(content['command'])}")
    print_result(content, as_json, lines + opened.common_random_notes)


def _counts(record: Mapping[str, Any], *before: str) -> list[str]:
    return [f"{record[name]:,}" for name in (*before, *COUNTS, "collisions")]


def _engine(one: Mapping[str, Any]) -> str:
    """The engine version, and the engine's name if it was forced."""
    return " ".join([str(one["engine_version"]), one["engine"] or ""]).rstrip()


def _local_time(text: str | None) -> str:
    """A date and time in this machine's time zone, to the minute."""
    return "–" if text is None else f"{datetime.fromisoformat(text).astimezone():%Y-%m-%d %H:%M}"


def verify(
    run: RunName,
    replay: Annotated[bool, flag("--replay", "Simulate every repeat again, and compare.")] = False,
    jobs: Jobs = None,
    as_json: AsJson = False,
) -> None:
    """Read and check every file of RUN, in other processes.

    The check covers the hash of the content, and whether the file belongs to the run. A file may
    crash a process or take too much time or memory. A line is printed for each bad file, and the
    exit code is then 1. Missing, interrupted and too short
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
    bad: list[dict[str, Any]] = []
    for each in found:
        if each.state is State.UNUSABLE:
            place = {"point": each.point, "repeat": each.repeat, "path": str(each.path)}
            bad.append(place | {"error": str(each.error)})
    how = "read and simulated again" if replay else "read again"
    files = len({one["path"] for one in bad})
    damage = f", {counted(files, 'bad file')}" if files else ""
    complete = counted(counts["done"], "complete repeat")
    lines = [*dict.fromkeys(one["error"] for one in bad)]
    lines.append(f"{opened.directory}: {complete}{damage}, {how}")
    states = {"missing": "", "interrupted": "", "shorter": " than the extended run"}
    if rest := [f"{counts[each]:,} {each}{more}" for each, more in states.items() if counts[each]]:
        lines.append(f"{listed(rest)}; run the config again to complete them")
    content = {"run": str(opened.directory), "replayed": replay, **counts, "bad": bad}
    print_result(content, as_json, lines)
    if bad:
        raise typer.Exit(ExitCode.UNSOUND)
