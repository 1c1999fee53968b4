"""What is there of a run and whether it can be trusted: states, hashes, checks and proofs."""

import json
from collections.abc import Iterable, Mapping
from datetime import datetime
from itertools import groupby
from operator import attrgetter, itemgetter
from pathlib import Path
from typing import Any

from snooker_cli import options, store
from snooker_cli.api.output_files import check_free
from snooker_cli.api.results import CommandResult, CommandResults, Verdicts, first
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.errors import UserError, explained, notice
from snooker_cli.files import write_text
from snooker_cli.formatting import counted, listed, point_label, printable, short, size, text_table
from snooker_cli.runs import RepeatState, RunFolder, open_run, runs_in
from snooker_cli.runs.folder import former_kept
from snooker_cli.runs.processes import processors
from snooker_cli.runs.progress import counting, reporting
from snooker_cli.runs.run import hidden_collapses
from snooker_cli.runs.status import COUNTS, ended, run_status
from snooker_cli.runs.verification import verify
from snooker_cli.trace import event_hashes

COUNT_HEADINGS = (">done", ">running", ">failed", ">to do", ">collisions")


def statuses_in(folder: Path) -> CommandResults:
    """What ``snooker.statuses`` returns."""
    found: list[dict[str, Any]] = []
    paths = runs_in(folder)
    former = [path for path in paths if former_kept(path)]
    for path in paths:
        try:
            opened = open_run(path)
            with reporting() as show:
                status = run_status(opened, show)
            del status["ledger"], status["former"]
        except Exception as error:  # of one run, which hides no other
            status = {"run": str(path), "error": explained(error)[1]}
        found.append(status)
    if former:
        files = "analysis.json or point-*/exact-*.json of an older version"
        notice(f"{counted(len(former), 'run')} with {files}, which nothing reads; delete them")
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
        for status in found
        if "error" not in status
    ]
    return CommandResults(found, text_table(headings, rows))


def status_of(run: RunFolder) -> CommandResult:
    """What ``Run.status`` returns."""
    with reporting() as show:
        status = run_status(run, show)
    content = status | {
        "title": run.config.title,
        "common_random": run.config.common_random,
        "figures": [path.name for path in run.figures()],
    }
    hidden = hidden_collapses(run)
    row_of = {row["point"]: row for row in content["ledger"]}
    for point, number in hidden:
        remark = f"has collapsed, which engine version {run.engine_version} did not recognise"
        row_of[point]["remarks"].append({"repeat": number, "remark": remark})
    title = f" ({printable(content['title'])})" if content["title"] else ""
    state = f"{content['run']}: {content['state']}{title}"
    points = content["ledger"]
    rows = [
        [point_label(of_point["parameters"]), *_counts(of_point), ended(of_point)]
        for of_point in points
    ]
    remarks: dict[str, None] = {}  # one for the repeats of a file
    for of_point in points:
        for remark in of_point["remarks"]:
            place = remark.get("file") or f"point {of_point['point']}, repeat {remark['repeat']}"
            remarks[f"{place}: {remark['remark']}"] = None
    contents = [f"{counted(content['files'], 'file')} of {size(content['bytes'])}"]
    if content["figures"]:
        contents.append(counted(len(content["figures"]), "figure file"))
    lines = [
        f"{state}; engine {content['engine_version']}, config {content['config']}",
        *first(text_table(["point", *COUNT_HEADINGS, "ended"], rows)),
        *first([*remarks], 10, ""),
        *first([_not_listed(point) for point in content["former"]], 10, ""),
        *[f"Run the config with {options.FRESH} to end such repeats at the collapse."][
            : len(hidden)
        ],
        listed(contents),
    ]
    if content["command"]:
        written = _local_time(content["last_file"])
        lines.append(f"last file {written}, by: {printable(content['command'])}")
    return CommandResult(content, lines + run.common_random_notes)


def hashes_of(run: RunFolder, point: int | None, repeat: int | None) -> CommandResults:
    """What ``Run.hashes`` returns. Memory stays bounded: events are read in parts."""
    run.chosen(point, repeat or 0)
    found: list[dict[str, Any]] = []
    for chosen in run.points if point is None else [run.by_number[point]]:
        if not chosen.config.keeps_events:
            record = chosen.config.record
            problem = f"{run.name} was run with `record: {record}`: it has no events to hash"
            raise UserError(problem, "run the config with `record: events`")
        there = [
            status
            for status in run.statuses(chosen.index)
            if status.state is not RepeatState.MISSING and repeat in (None, status.repeat)
        ]
        for status in there:
            status.raise_if_unusable()
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
    lines = first(
        text_table([">point", ">repeat", ">collisions", "SHA-256"], rows), noun=" lines", rest=""
    )
    if not found:
        lines = [f"{run.directory}: no repeat is there yet; run the config to make it"]
    return CommandResults(found, lines)


def _not_listed(point: Mapping[str, Any]) -> str:
    """A line on a point that the sweep no longer has."""
    label = point_label(point["parameters"])
    return f"point {point['point']} ({label}): stored, but the sweep no longer lists it"


def _counts(record: Mapping[str, Any], *before: str) -> list[str]:
    return [f"{record[name]:,}" for name in (*before, *COUNTS, "collisions")]


def _local_time(text: str | None) -> str:
    """A date and time in this machine's time zone, to the minute; in UTC if that is no zone."""
    if text is None:
        return "–"
    time, zone = datetime.fromisoformat(text), ""
    try:
        time = time.astimezone()
    except ValueError:  # such as for TZ=UTC+99
        zone = " UTC"
    return f"{time:%Y-%m-%d %H:%M}{zone}"


def verified(run: RunFolder, *, replay: bool, jobs: int | None) -> Verdicts:
    """What ``Run.verify`` returns."""
    verdicts = verify(run, replay=replay, workers=jobs or processors())
    total = len(run.points) * run.config.repeats
    found = sorted(counting(verdicts, "", total), key=lambda status: (status.point, status.repeat))
    counts = {str(state): sum(status.state is state for status in found) for state in RepeatState}
    del counts[str(RepeatState.UNUSABLE)]
    bad = [
        {
            "point": status.point,
            "repeat": status.repeat,
            "path": str(status.path),
            "error": str(status.error),
        }
        for status in found
        if status.state is RepeatState.UNUSABLE
    ]
    what = ["hashes", "ranges of values"]
    what += ["starts"] * run.can_be_replayed + ["all bits by a new simulation"] * replay
    files = len({repeat["path"] for repeat in bad})
    damage = f", {counted(files, 'bad file')}" if files else ""
    complete = counted(counts["done"], "complete repeat")
    lines = [*dict.fromkeys(str(repeat["error"]) for repeat in bad)]
    lines.append(f"{run.directory}: {complete}{damage}; checked: {', '.join(what)}")
    states = {"missing": "", "interrupted": "", "shorter": " than the extended run"}
    if rest := [f"{counts[name]:,} {name}{more}" for name, more in states.items() if counts[name]]:
        lines.append(f"{listed(rest)}; run the config again to complete them")
    content = {"run": str(run.directory), "replayed": replay, **counts, "bad": bad}
    result = Verdicts(content, lines)
    result.sound = not bad
    return result


def proofs(
    run: RunFolder, point: int | None, repeat: int, collisions: int, out: Path | None, replace: bool
) -> Verdicts:
    """What ``Run.prove`` returns."""
    from snooker_cli.validation.proof import ERRORS, proven

    chosen = [*run.by_number] if point is None else [point]
    if out is not None and len(chosen) > 1:
        raise UserError(
            f"{options.OUT} writes the certificate of one repeat", f"give {options.POINT} too"
        )
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
        label = point_label(run.by_number[number].as_json())
        share = "all" if certain == proof["stored"] else f"the first {certain:,} of"
        again = ", simulated again" if proof["summary"] else ""
        lines.append(
            f"{run.name}, point {label}, repeat {repeat}{again}: {share} {stored} are certain"
        )
        lines += [proof["reason"]] if proof["reason"] else []
        lines += _bounds(proof["bounds"], ERRORS)
        if proof["verdict"] == "interrupted":
            break
    verdicts = {record["verdict"] for record in records}
    if not verdicts & {"interrupted", "wrong"}:
        start = "the config's" if run.engine_version == ENGINE_VERSION else "the stored"
        lines.append(f"The bodies and the order of these events are certain, from {start} start.")
        recorded = {number: run.by_number[number].config.record for number in chosen}
        rest = (_about_the_rest(record, recorded[record["point"]]) for record in records)
        lines += dict.fromkeys(rest)
    result = Verdicts({"run": str(run.directory), "exact": records}, lines)
    result.sound, result.interrupted = "wrong" not in verdicts, "interrupted" in verdicts
    return result


def _about_the_rest(proof: Mapping[str, Any], record: str) -> str:
    """What was compared of a repeat besides its events, in a sentence or two.

    record : what the config records
    """
    sentences, parts = ["The stored end and finish follow from all stored events."], "ending is"
    if proof["summary"]:
        snapshots = ", snapshots" if record == "snapshots" else ""
        sentences, parts = [], f"summary{snapshots}, finish and ending are"
    if proof["ending"] == "certain":
        sentences.append("No further event is possible up to the end.")
    elif proof["ending"] == "simulated":
        to_the_bit = ", to the bit" if proof["summary"] else ""
        sentences.append(f"The stored {parts} as in a new simulation{to_the_bit}.")
    elif proof["ending"] == "unchecked":
        sentences.append(f"The stored {parts} not checked: that needs the engine that made them.")
    return " ".join(sentences)


def _bounds(bounds: Iterable[Mapping[str, Any]], errors: Mapping[str, str]) -> list[str]:
    """A table of the errors of events up to some numbers of them; empty if there are none."""
    cells = [
        [f"{bound['events']:,}", *(short(bound[name], 2) for name in errors)] for bound in bounds
    ]
    within = [f">{name}s within, {unit}" for name, unit in errors.items()]
    return text_table([">up to event", *within], cells) if cells else []
