"""``snooker run``: simulate every point and repeat of a config, or show what that would take."""

from __future__ import annotations

import os
import re
import threading
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snooker_cli import runs, theory
from snooker_cli.cli.options import AsJson, ConfigPath, Jobs, Overrides, flag, option
from snooker_cli.cli.output import first, print_result
from snooker_cli.errors import ExitCode, UserError, notice
from snooker_cli.formatting import (
    counted,
    duration,
    point_label,
    printable,
    rough,
    size,
    text_table,
)
from snooker_cli.runs import Run
from snooker_cli.runs.batch import CHECKPOINT_INTERVAL, RepeatResult
from snooker_cli.runs.execution import processors, share_of
from snooker_cli.runs.plan import LAW, checked, is_excessive, run_plan
from snooker_cli.runs.progress import execute_watched, reporting, run_summary, share_done
from snooker_cli.runs.starting_state import load
from snooker_cli.runs.status import continuing, ended

if TYPE_CHECKING:
    from snooker_cli.runs.dask_executor import DaskExecutor  # loaded only if it is needed


def run(
    config: ConfigPath,
    out: Annotated[Path | None, option("DIR", "The run's folder [runs/CONFIG's name].")] = None,
    override: Overrides = None,
    jobs: Jobs = None,
    executor: Annotated[str, option("NAME", "threads, or dask=tcp://HOST:PORT.")] = "threads",
    fresh: Annotated[bool, flag("--fresh", "Replace all results in the folder.")] = False,
    part: Annotated[str | None, option("K/N", "Only every N-th batch from the K-th on.")] = None,
    checkpoint: Annotated[
        float, option("MINUTES", "Save unfinished repeats this often.", min=0)
    ] = CHECKPOINT_INTERVAL / 60,
    dry_run: Annotated[bool, flag("--dry-run", "Only show the search, time and disk.")] = False,
    yes: Annotated[bool, flag("--yes", "Allow runs over a week or the free disk space.")] = False,
    as_json: AsJson = False,
    no_progress: Annotated[bool, flag("--no-progress", "No progress bar.")] = False,
) -> None:
    """Simulate all points and repeats of CONFIG and store them.

    Stored repeats are checked and kept. After an interrupt, run the same command again to finish; a
    long repeat continues where it was saved.
    More repeats, collisions or time extend the run. During an extension, analyses use the existing
    data. A repeat that ends in a wall trap or inelastic collapse is kept up to that time.

    The workers of a dask scheduler must share the run's folder. The scheduler has --jobs batches of
    repeats at a time [1024]. Without a scheduler, --part 1/4 to --part 4/4 on several machines
    share the work and the folder.
    """
    cancelled = threading.Event()
    loaded = load(config, override or ())
    with reporting() as show:
        points, scene_classes = checked(loaded, show)
    target = Run(out or runs.RUNS / config.stem, loaded.experiment, points)
    share, idle = (None, "") if part is None else _share(target, part, fresh)
    cluster = _cluster(executor, jobs, cancelled)
    with cluster or nullcontext():
        threads = jobs or processors()
        if cluster is not None:
            threads = max(1, min(cluster.threads, jobs or cluster.threads))
        plan = partial(run_plan, target, scene_classes, threads, share=share)
        change = runs.planned_change(target, fresh=fresh)
        if dry_run:
            if change:
                notice(change)
            planned = plan(fresh=fresh)
            lines = [*_plan_lines(planned, part), *target.common_random_notes]
            print_result(planned, as_json, [idle] if idle else lines)
            return
        # Stored files are checked only if the whole run would be too much.
        if not yes and is_excessive(plan(fresh=True)) and is_excessive(left := plan(fresh=fresh)):
            ways = "set fewer collisions or repeats, or `record: summary`, or give --yes"
            raise UserError(_estimate(left), ways)
        results, progress = execute_watched(
            target,
            fresh=fresh,
            bar=not no_progress,
            part=share,
            cancelled=cancelled,
            workers=processors() if cluster else threads,
            executor=cluster,
            interval=60 * checkpoint,
            processes=True,
        )
    if not all(result.cached for result in results) and target.figures():
        again = f"run `snooker plot {target.directory}` again"
        notice(f"{target.figures_folder}: these figures are older; {again}")
    summary = run_summary(target, results, progress)
    lines = [idle] if idle else [*_summary_lines(target, results, summary)]
    print_result(summary, as_json, lines)
    if cancelled.is_set():
        done = share_done(results, len(points) * loaded.experiment.repeats)
        command = "the same command without --fresh" if fresh else "the same command again"
        notice(f"interrupted: {done}; run {command} to finish")
        os._exit(ExitCode.INTERRUPTED)  # Python would wait for threads with nothing to save
    if any(result.error for result in results):
        raise typer.Exit(ExitCode.SOME_FAILED)


def _share(run: Run, part: str, fresh: bool) -> tuple[set[tuple[int, int]], str]:
    """What ``share_of`` gives for ``--part``. Raises ``UserError``."""
    match = re.fullmatch(r"(\d{1,6})/(\d{1,6})", part)
    k, n = (int(match[1]), int(match[2])) if match else (0, 0)
    if not 1 <= k <= n:
        raise UserError(f"--part {part}: give K/N with 1 ≤ K ≤ N, as in 3/16")
    if fresh:
        raise UserError("--part and --fresh: parts delete nothing; delete the folder first")
    return share_of(run, k, n)


def _cluster(executor: str, at_once: int | None, cancelled: threading.Event) -> DaskExecutor | None:
    """The workers that ``--executor`` names; None for threads. Raises ``SnookerError``."""
    name, _, address = executor.partition("=")
    if executor == "threads":
        return None
    if name != "dask":
        raise UserError(f"--executor {executor}: give threads, or dask=tcp://HOST:PORT")
    from snooker_cli.runs.dask_executor import DaskExecutor

    cluster = DaskExecutor(address, at_once, cancelled)
    if cluster.threads == 0:
        notice(f"the dask scheduler at {address} has no workers yet; waiting for them")
    return cluster


def _plan_lines(plan: dict[str, Any], part: str | None) -> Iterator[str]:
    """The plan as text."""
    of_part = f"; part {part}" if part else ""
    yield (
        f"{counted(plan['points'], 'point')}, {counted(plan['repeats'], 'repeat')} each{of_part}: "
        f"{plan['cached']:,} stored in {plan['run']}, {plan['to_do']:,} to do"
    )
    for scenes in plan["kinds"]:
        balls, points = scenes["balls"], scenes["points"]
        fewest = f"{balls[0]:,} to " if balls[1:] else ""
        title = point_label(points[0])
        if points[1:]:
            title = f"{counted(len(points), 'point')}, {title} to {point_label(points[-1])}"
        yield ""
        yield f"{title}: {fewest}{counted(balls[-1], 'ball')}, {scenes['to_do']:,} to do"
        yield f"  search    {scenes['search']}"
        if ratios := [ratio for ratio in scenes["critical_ratios"] if ratio is not None]:
            values = " to ".join(dict.fromkeys(f"{f(ratios):.2g}" for f in (min, max)))
            yield f"  L/L_c     {values}: {theory.CRITICAL}"
        laws = [name.removeprefix(LAW) for name in scenes["models"] if name.startswith(LAW)]
        if laws:
            yield f"  laws      {', '.join(laws)}"
        yield f"  records   {'events' if scenes['models']['events'] else 'a summary'}"
    yield ""
    yield _estimate(plan)
    if plan["cools_out"]:
        yield (
            "This may take much longer: without walls, balls that cool drift together in the end, "
            "and hardly collide."
        )


def _estimate(plan: dict[str, Any]) -> str:
    if plan["to_do"] == 0:
        return "nothing to do"
    number = f"at most {plan['collisions']:,} collisions"
    if plan["by_time"]:
        number = f"about {rough(plan['collisions'])} collisions by kinetic theory"
    threads = counted(plan["threads"], "thread")
    time = f"{number}: about {duration(plan['seconds'])} on {threads}"
    disk = f", about {size(plan['bytes'])}"
    if plan["free_bytes"] is not None and plan["bytes"] > plan["free_bytes"]:
        disk += f", but only {size(plan['free_bytes'])} are free"
    return time + disk


def _summary_lines(
    run: Run, results: Sequence[RepeatResult], summary: dict[str, Any]
) -> Iterator[str]:
    """The table of points, early ends, and where the results are.

    Failed repeats are only counted: their errors were printed as they failed.
    """
    wanted = run.experiment.repeats
    rows = [
        [
            point_label(point["parameters"]),
            str(wanted) if point["repeats"] == wanted else f"{point['repeats']} of {wanted}",
            f"{point['collisions']:,}",
            ended(point),
        ]
        for point in summary["points"]
        if point["repeats"]  # a part of a run has none of some points
    ]
    yield from first(text_table(["point", ">repeats", ">collisions", "ended"], rows))
    if kept := sum(result.unstored for result in results):
        files = "The older, longer file was" if kept == 1 else f"{kept} older, longer files were"
        yield f"{files} kept."
    collapsed = [
        printable(f"point {result.point}, repeat {result.repeat}: {result.stop.message}")
        for result in results
        if result.stop and result.stop.reason.collapsed
    ]
    yield from first(collapsed, 3, " such repeats")
    yield from _collapse_hints(run, results)
    if number := summary["simultaneous"]:
        verb = "has" if number == 1 else "have"
        yield (
            f"{counted(number, 'collision')} {verb} exactly the time of another of the same ball. "
            "They happen one after the other, in a fixed order (docs/how-it-works.md)."
        )
    done = []
    if summary["events"]:
        compiling = summary["compiling_seconds"]
        after = f" after {compiling:.0f} s of compiling" if compiling >= 1 else ""
        speed = f"{summary['seconds']:.2f} s ({summary['events_per_second']:,} events/s)"
        done.append(f"{counted(summary['events'], 'event')} in {speed}{after}")
    if cached := sum(result.cached for result in results):
        were = "was" if cached == 1 else "were"
        done.append(f"{counted(cached, 'repeat')} {were} already stored")
    yield f"{', '.join(done) or 'no events'}; results in {run.directory}"


def _collapse_hints(run: Run, results: Sequence[RepeatResult]) -> list[str]:
    """How the config can be changed so that collapsed repeats continue, each way once."""
    reasons = {(result.point, result.stop.reason) for result in results if result.stop}
    ways = (continuing(run.points[point].experiment, reason) for point, reason in sorted(reasons))
    return [f"To continue such repeats, set {way}." for way in dict.fromkeys(filter(None, ways))]
