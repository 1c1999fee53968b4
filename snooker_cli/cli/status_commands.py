"""``snooker ls``, ``show`` and ``verify``: the state of runs and of their files."""

import json
from collections.abc import Mapping
from datetime import datetime
from itertools import groupby
from operator import attrgetter, itemgetter
from pathlib import Path
from typing import Annotated, Any

import typer

from snooker_cli import store
from snooker_cli.cli.options import AsJson, Jobs, Replace, RunName, flag, option
from snooker_cli.cli.output import check_free, first, print_result
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.errors import ExitCode, RunError, StoreError, UserError, notice
from snooker_cli.files import write_text
from snooker_cli.formatting import (
    counted,
    listed,
    point_label,
    printable,
    short,
    size,
    text_table,
)
from snooker_cli.runs import RepeatState, Run, open_run, runs_in
from snooker_cli.runs.execution import processors
from snooker_cli.runs.progress import counting, reporting
from snooker_cli.runs.run import hidden_collapses
from snooker_cli.runs.status import COUNTS, ended, run_status
from snooker_cli.runs.verification import verify as verdicts
from snooker_cli.trace import event_hashes

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
    statuses: list[dict[str, Any]] = []
    for path in runs_in(directory):
        try:
            opened = open_run(path)
            with reporting() as show_text:
                status = run_status(opened, show_text)
            del status["ledger"]
        except (RunError, StoreError) as error:
            notice(str(error))
            status = {"run": str(path), "error": str(error)}
        statuses.append(status)
    if not statuses and not as_json:
        notice(f"{directory}: contains no runs")
        return
    headings = ["run", ">points", ">repeats", *COUNT_HEADINGS]
    headings += [">size", "last file", ">engine", "config"]
    rows = [
        [
            Path(status["run"]).name,
            *_counts(status, "points", "repeats"),
            size(status["bytes"]),
            _local_time(status["last_file"]),
            str(status["engine_version"]),
            status["config"],
        ]
        for status in statuses
        if "error" not in status
    ]
    print_result(statuses, as_json, text_table(headings, rows))


def show(
    run: RunName,
    hashes: Annotated[
        bool, flag("--hash", "Print a hash of the first 1,000, 10,000 … and of all collisions.")
    ] = False,
    point: Annotated[int | None, option("N", "Hashes: only this point, from 0.", min=0)] = None,
    repeat: Annotated[int | None, option("N", "Hashes: only this repeat, from 0.", min=0)] = None,
    as_json: AsJson = False,
) -> None:
    """Show the state of RUN: points, ends of repeats, files.

    With --hash, show hashes of the collisions of each repeat instead. Two repeats with the same
    hash have the same collisions to the bit. The page of `snooker live` shows the same hashes.
    """
    opened = open_run(run)
    if hashes:
        _show_hashes(opened, point, repeat, as_json)
        return
    if point is not None or repeat is not None:
        raise UserError("--point and --repeat choose repeats for --hash", "add --hash")
    with reporting() as show_text:
        status = run_status(opened, show_text)
    content = status | {
        "title": opened.experiment.title,
        "common_random": opened.experiment.common_random,
        "figures": [path.name for path in opened.figures()],
    }
    hidden = hidden_collapses(opened)
    for of_point, number in hidden:
        remark = f"has collapsed, which engine version {opened.engine_version} did not recognise"
        content["ledger"][of_point]["remarks"].append({"repeat": number, "remark": remark})
    title = f" ({printable(content['title'])})" if content["title"] else ""
    state = f"{content['run']}: {content['state']}{title}"
    points = content["ledger"]
    rows = [
        [point_label(of_point["parameters"]), *_counts(of_point), ended(of_point)]
        for of_point in points
    ]
    remarks: dict[str, None] = {}  # one for the repeats of a file
    for number, of_point in enumerate(points):
        for remark in of_point["remarks"]:
            place = remark.get("file") or f"point {number}, repeat {remark['repeat']}"
            remarks[f"{place}: {remark['remark']}"] = None
    contents = [f"{counted(content['files'], 'file')} of {size(content['bytes'])}"]
    if content["figures"]:
        contents.append(counted(len(content["figures"]), "figure file"))
    lines = [
        f"{state}; engine {content['engine_version']}, config {content['config']}",
        *first(text_table(["point", *COUNT_HEADINGS, "ended"], rows)),
        *first([*remarks], 10, "; --json prints all"),
        *["Run the config with --fresh to end such repeats at the collapse."][: len(hidden)],
        listed(contents),
    ]
    if content["command"]:
        written = _local_time(content["last_file"])
        lines.append(f"last file {written}, by: {printable(content['command'])}")
    print_result(content, as_json, lines + opened.common_random_notes)


def _show_hashes(opened: Run, point: int | None, repeat: int | None, as_json: bool) -> None:
    """Print the hashes of the collisions of repeats that are there."""
    opened.chosen(point or 0, repeat or 0)
    found: list[dict[str, Any]] = []
    for chosen in opened.points if point is None else [opened.points[point]]:
        if not chosen.experiment.keeps_events:
            problem = f"{opened.name} was run with `record: summary`: it has no events to hash"
            raise UserError(problem, "run the config with `record: events`")
        there = [
            status
            for status in opened.statuses(chosen.index)
            if status.state is not RepeatState.MISSING and repeat in (None, status.repeat)
        ]
        for status in there:
            status.accept()
        # Repeats of one file follow each other, so each file is read once.
        for path, of_file in groupby(there, key=attrgetter("path")):
            store.check(path)
            events = store.read_events(path, [status.repeat for status in of_file])
            for number, pieces in groupby(events, key=itemgetter(0)):
                found.append(
                    {
                        "point": chosen.index,
                        "parameters": chosen.as_json(),
                        "repeat": number,
                        "hashes": event_hashes(events for _, events in pieces),
                    }
                )
    rows = [
        [f"{row['point']}", f"{row['repeat']}", f"{number:,}", text]
        for row in found
        for number, text in row["hashes"]
    ]
    lines = first(text_table([">point", ">repeat", ">collisions", "SHA-256"], rows), rest=" lines")
    if not found:
        lines = [f"{opened.directory}: no repeat is there yet; run the config to make it"]
    print_result(found, as_json, lines)


def _counts(record: Mapping[str, Any], *before: str) -> list[str]:
    return [f"{record[name]:,}" for name in (*before, *COUNTS, "collisions")]


def _local_time(text: str | None) -> str:
    """A date and time in this machine's time zone, to the minute."""
    return "–" if text is None else f"{datetime.fromisoformat(text).astimezone():%Y-%m-%d %H:%M}"


def verify(
    run: RunName,
    replay: Annotated[bool, flag("--replay", "Simulate every repeat again, and compare.")] = False,
    exact: Annotated[bool, flag("--exact", "Prove which events of a repeat are certain.")] = False,
    point: Annotated[int | None, option("N", "With --exact: this point [all].", min=0)] = None,
    repeat: Annotated[int, option("N", "With --exact: this repeat of a point.", min=0)] = 0,
    collisions: Annotated[int, option("N", "With --exact: at most these.", min=1)] = 10_000,
    out: Annotated[Path | None, option("FILE", "With --exact: write the certificate.")] = None,
    replace: Replace = False,
    jobs: Jobs = None,
    as_json: AsJson = False,
) -> None:
    """Read and check every file of RUN.

    The check covers the hash of the content, and whether the file has the run's config and starts
    as the config says. A line is printed for each bad file, and the exit code is then 1. Missing,
    interrupted and too short repeats are reported, but they are no error.

    --exact reads no other files than those of one repeat of each point, and computes it again with
    intervals that contain the true numbers. The result is the number of events that are certainly
    those of the scene, and bounds of their errors. Chaos ends this after some hundred events; that
    is no error. The exit code is 1 if an event is wrong for another reason than rounding, or if the
    stored end or finish does not follow from the events. The result is kept beside the repeat. It
    needs the extra `reference`.
    """
    opened = open_run(run)
    if exact:
        _prove(opened, point, repeat, collisions, out, replace, as_json)
        return
    if point is not None or repeat or out is not None:
        raise UserError("--point, --repeat and --out need --exact")
    verified = verdicts(opened, replay=replay, workers=jobs or processors())
    total = len(opened.points) * opened.experiment.repeats
    statuses = sorted(
        counting(verified, "", total), key=lambda status: (status.point, status.repeat)
    )
    counts = {
        str(state): sum(status.state is state for status in statuses) for state in RepeatState
    }
    del counts[str(RepeatState.UNUSABLE)]
    bad = [
        {
            "point": status.point,
            "repeat": status.repeat,
            "path": str(status.path),
            "error": str(status.error),
        }
        for status in statuses
        if status.state is RepeatState.UNUSABLE
    ]
    how = "read and simulated again" if replay else "read again"
    files = len({repeat["path"] for repeat in bad})
    damage = f", {counted(files, 'bad file')}" if files else ""
    complete = counted(counts["done"], "complete repeat")
    lines = [*dict.fromkeys(str(repeat["error"]) for repeat in bad)]
    lines.append(f"{opened.directory}: {complete}{damage}, {how}")
    states = {"missing": "", "interrupted": "", "shorter": " than the extended run"}
    if rest := [f"{counts[name]:,} {name}{more}" for name, more in states.items() if counts[name]]:
        lines.append(f"{listed(rest)}; run the config again to complete them")
    content = {"run": str(opened.directory), "replayed": replay, **counts, "bad": bad}
    print_result(content, as_json, lines)
    if bad:
        raise typer.Exit(ExitCode.UNSOUND)


def _prove(
    run: Run,
    point: int | None,
    repeat: int,
    collisions: int,
    out: Path | None,
    replace: bool,
    as_json: bool,
) -> None:
    """Print how many events of repeats are certain; write the certificate of a single one."""
    from snooker_cli.validation.proof import ERRORS, proven

    chosen = [*range(len(run.points))] if point is None else [point]
    if out is not None and len(chosen) > 1:
        raise UserError("--out writes the certificate of one repeat", "give --point too")
    if out is not None:
        check_free(out, replace)
    records, lines = [], []
    for number in chosen:
        proof = proven(run, number, repeat, collisions, counting)
        if out is not None:
            write_text(out, json.dumps(proof) + "\n", given=True)
        records.append(
            {key: proof[key] for key in proof if key not in ("scene", "events", "versions")}
        )
        certain, stored = proof["certain"], counted(proof["stored"], "event")
        label = point_label(run.points[number].as_json())
        share = "all" if certain == proof["stored"] else f"the first {certain:,} of"
        again = ", simulated again" if proof["summary"] else ""
        lines.append(
            f"{run.name}, point {label}, repeat {repeat}{again}: {share} {stored} are certain"
        )
        lines += [proof["reason"]] if proof["reason"] else []
        cells = [
            [f"{bound['events']:,}", *(short(bound[name], 2) for name in ERRORS)]
            for bound in proof["bounds"]
        ]
        if cells:
            within = [f">{name}s within, {unit}" for name, unit in ERRORS.items()]
            lines += text_table([">up to event", *within], cells)
        if proof["verdict"] == "interrupted":
            break
    verdicts = {record["verdict"] for record in records}
    if not verdicts & {"interrupted", "wrong"}:
        start = "the config's" if run.engine_version == ENGINE_VERSION else "the stored"
        lines.append(f"The bodies and the order of these events are certain, from {start} start.")
        summary = "The stored summary is not compared; `--replay` does that."
        finish = "The stored end and finish follow from all stored events."
        lines.append(summary if any(record["summary"] for record in records) else finish)
    print_result({"run": str(run.directory), "exact": records}, as_json, lines)
    if verdicts & {"interrupted", "wrong"}:
        raise typer.Exit(ExitCode.UNSOUND if "wrong" in verdicts else ExitCode.INTERRUPTED)
