"""``snooker run``: simulate every point and repeat of a config, or show what that would take."""

from __future__ import annotations

import math
import os
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from snooker_cli import runs
from snooker_cli.cli.exit_codes import STOPPING, handling, leave
from snooker_cli.cli.options import AsJson, ConfigPath, EngineName, Overrides, checked
from snooker_cli.cli.output import (
    Bar,
    Lines,
    notice,
    point_label,
    print_json,
    print_line,
    print_some,
    print_table,
)
from snooker_cli.config import Experiment
from snooker_cli.errors import ExitCode, UserError
from snooker_cli.formatting import Column, counted, duration, listed, size
from snooker_cli.runs import Run
from snooker_cli.runs.execution import POLL_INTERVAL, execute
from snooker_cli.runs.plan import SceneClass, is_excessive, run_plan
from snooker_cli.runs.repeat import RepeatResult
from snooker_cli.trace import StopReason

if TYPE_CHECKING:
    from snooker_cli.runs.dask_executor import DaskExecutor  # loaded only if it is needed

Result = TypeVar("Result")

MOST_ROWS = 200
"""Points in the table that is printed; a terminal keeps about as many lines."""

MOST_COLLAPSED = 3
"""Repeats with a wall trap or collapse whose messages are printed."""


def run(
    config: ConfigPath,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="The run's folder [runs/CONFIG's name]."),
    ] = None,
    override: Overrides = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            "-j",
            "--jobs",
            min=1,
            max=1024,
            help="Threads [all cores]; with dask, repeats that the scheduler has at a time [1024].",
        ),
    ] = None,
    executor: Annotated[
        str,
        typer.Option(
            "--executor",
            metavar="EXECUTOR",
            help="threads, or dask=tcp://HOST:PORT for the workers of a dask scheduler, which "
            "must share the run's folder [threads].",
            show_default=False,
        ),
    ] = "threads",
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Replace the results in the folder, of any config.")
    ] = False,
    engine: Annotated[
        EngineName | None,
        typer.Option("--engine", help="Engine for all points [the best one for each]."),
    ] = None,
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="Only show the plan: what is modelled, time and disk."),
    ] = False,
    yes: Annotated[
        bool,
        typer.Option(
            "--yes", help="Allow a run longer than a week or larger than the free disk space."
        ),
    ] = False,
    no_collapse: Annotated[
        bool,
        typer.Option(
            "--no-collapse",
            help="End with exit code 5 if a repeat ends in a wall trap or collapse.",
        ),
    ] = False,
    as_json: AsJson = False,
    no_progress: Annotated[bool, typer.Option("--no-progress", help="No progress bar.")] = False,
) -> None:
    """Simulate all points and repeats of CONFIG and store them.

    Stored repeats are checked and kept. After an interrupt, run the same command again to finish.
    More repeats, collisions or time extend the run. During an extension, analyses use the existing
    data. A repeat that ends in a wall trap or inelastic collapse is kept up to that time. Results
    of a forced --engine have other bits, so they never mix with others.
    """
    scheduler = _scheduler(executor)
    cancelled = threading.Event()
    with _stopping_on_signals(cancelled), ExitStack() as exits:
        loaded, points, scene_classes = _awaited(
            lambda: checked(config, override or (), engine), cancelled
        )
        experiment, directory = loaded.experiment, out or _default_folder(config)
        cores, cluster = os.cpu_count() or 1, None
        workers = threads = jobs or cores
        if scheduler is not None:
            cluster = _awaited(lambda: _connected(scheduler, jobs, cancelled), cancelled)
            exits.enter_context(cluster)
            workers = cores
            threads = max(1, min(cluster.threads, jobs or cluster.threads))
        target = Run(directory, experiment, points, engine)
        if dry_run:
            _print_change(runs.planned_change(target, fresh=fresh))
            plan = _awaited(lambda: run_plan(target, scene_classes, threads, fresh), cancelled)
            if as_json:
                print_json(plan)
            else:
                print_line("\n".join(_plan_lines(plan)))
            return
        if not yes:
            runs.planned_change(target, fresh=fresh)
            _awaited(lambda: _refuse_excess(target, scene_classes, threads, fresh), cancelled)
        with runs.locked(directory):
            _print_change(runs.create(target, fresh=fresh))
            progress = Lines if no_progress else Bar
            with progress(len(target.points), experiment.repeats) as watcher:
                outcomes = execute(
                    target, workers=workers, watcher=watcher, cancelled=cancelled, executor=cluster
                )
    summary = _summary(target, outcomes, watcher)
    if as_json:
        print_json(summary)
    else:
        _print_summary(target, outcomes, summary)
    if cancelled.is_set():
        complete = sum(
            outcome.stop is not None and outcome.stop.reason is not StopReason.INTERRUPTED
            for outcome in outcomes
        )
        wanted = counted(len(target.points) * experiment.repeats, "repeat")
        command = "the same command without --fresh" if fresh else "the same command again"
        notice(f"interrupted: {complete:,} of {wanted} complete; run {command} to finish")
        leave(ExitCode.INTERRUPTED)
    if any(outcome.error for outcome in outcomes):
        raise typer.Exit(ExitCode.SOME_FAILED)
    if no_collapse and any(each.stop and each.stop.reason.collapsed for each in outcomes):
        raise typer.Exit(ExitCode.COLLAPSED)


def _scheduler(executor: str) -> str | None:
    """The address of the dask scheduler that ``--executor`` names; none for threads."""
    name, _, address = executor.partition("=")
    if executor == "threads":
        return None
    if name != "dask":
        raise UserError(
            f"--executor {executor}: there is no such executor",
            "give threads, or dask=tcp://HOST:PORT for the workers of a dask scheduler",
        )
    from snooker_cli.runs.dask_executor import check_address

    check_address(address)
    return address


def _connected(address: str, at_once: int | None, cancelled: threading.Event) -> DaskExecutor:
    """The workers of a scheduler. Raises ``RunError``."""
    from snooker_cli.runs.dask_executor import DaskExecutor

    cluster = DaskExecutor(address, at_once, cancelled)
    if cluster.threads == 0:
        notice(f"the dask scheduler at {address} has no workers yet; waiting for them")
    return cluster


@contextmanager
def _stopping_on_signals(cancelled: threading.Event) -> Iterator[None]:
    """Inside, Ctrl-C and SIGTERM set ``cancelled``; the simulated part is then saved."""

    def stop(_number: int, _frame: object) -> None:
        if not cancelled.is_set():
            notice("stopping; saving the current repeats")
        cancelled.set()

    with handling(stop, STOPPING):
        yield


def _awaited(function: Callable[[], Result], cancelled: threading.Event) -> Result:
    """The result of a function that has nothing to save: once cancelled, the process ends."""
    future = ThreadPoolExecutor(1).submit(function)
    while not wait([future], POLL_INTERVAL).done:
        if cancelled.is_set():
            leave(ExitCode.INTERRUPTED)
    return future.result()


def _default_folder(config: Path) -> Path:
    """The folder of a config's run without ``--out``. Raises ``UserError``."""
    if config.stem in (".", ".."):
        raise UserError(f"{config}: its name gives no folder name", "give --out, or rename it")
    return runs.RUNS / config.stem


def _print_change(change: str) -> None:
    """Print how the run extends or reduces the stored one, if it does."""
    if change:
        notice(change)


def _refuse_excess(
    run: Run, scene_classes: Sequence[SceneClass], workers: int, fresh: bool
) -> None:
    """Raise ``UserError`` for a run that may take very long or more disk than is free."""
    # Stored files are checked only if the whole run would be too much.
    if not is_excessive(run_plan(run, scene_classes, workers, fresh=True)):
        return
    plan = run_plan(run, scene_classes, workers, fresh)
    if is_excessive(plan):
        raise UserError(
            _estimate(plan),
            "set fewer collisions or repeats, set `record: summary` to save disk, or give --yes",
        )


def _plan_lines(plan: dict[str, Any]) -> Iterator[str]:
    """The plan as text."""
    yield (
        f"{counted(plan['points'], 'point')}, {counted(plan['repeats'], 'repeat')} each: "
        f"{plan['cached']:,} stored in {plan['run']}, {plan['to_do']:,} to do"
    )
    for one in plan["kinds"]:
        balls = one["balls"]
        numbers = f"{balls[0]:,}" if len(balls) == 1 else f"{balls[0]:,} to {balls[-1]:,}"
        noun = "ball" if balls == [1] else "balls"
        yield ""
        yield f"{_points_label(one['points'])}: {numbers} {noun}, {one['to_do']:,} to do"
        models = dict(one["models"])
        yield f"  engine    {one['engine']}: {one['because']}"
        yield f"  records   {'events' if models.pop('events') else 'a summary'}"
        for heading, wanted in (("modelled", True), ("left out", False)):
            names = [name for name, is_so in models.items() if is_so is wanted]
            yield f"  {heading}  {listed(names) if names else 'nothing'}"
    yield ""
    yield _estimate(plan)


def _points_label(points: Sequence[dict[str, Any]]) -> str:
    first = point_label(points[0])
    if len(points) == 1:
        return first
    return f"{counted(len(points), 'point')}, {first} to {point_label(points[-1])}"


def _estimate(plan: dict[str, Any]) -> str:
    """The sentence about time and disk."""
    if plan["to_do"] == 0:
        return "nothing to do"
    disk, free = "", plan["free_bytes"]
    if plan["bytes"] is not None:
        disk = f", about {size(plan['bytes'])}"
        if free is not None and plan["bytes"] > free:
            disk += f", but only {size(free)} are free"
    if plan["collisions"] is None:
        return (
            "no estimate of the time: repeats end at a time, not after a number of collisions"
            + disk
        )
    return (
        f"at most {plan['collisions']:,} collisions: about {duration(plan['seconds'])} on "
        f"{counted(plan['threads'], 'thread')}{disk}"
    )


def _summary(run: Run, outcomes: Sequence[RepeatResult], watcher: Lines) -> dict[str, Any]:
    """What ``--json`` prints."""
    simulated = sum(outcome.collisions for outcome in outcomes if not outcome.cached)
    seconds = watcher.seconds
    by_point: list[list[RepeatResult]] = [[] for _ in run.points]
    for outcome in outcomes:
        by_point[outcome.point].append(outcome)
    points = []
    for point, mine in zip(run.points, by_point, strict=True):
        reasons = Counter(
            "failed" if outcome.stop is None else str(outcome.stop.reason) for outcome in mine
        )
        points.append(
            {
                "parameters": point.as_json(),
                "repeats": len(mine),
                "cached": sum(outcome.cached for outcome in mine),
                "collisions": sum(outcome.collisions for outcome in mine),
                "ended": dict(reasons),
                "stops": [
                    {"repeat": outcome.repeat, **vars(outcome.stop)}
                    for outcome in mine
                    if outcome.stop
                    and outcome.stop.reason not in (StopReason.COLLISIONS, StopReason.TIME)
                ],
                "errors": [outcome.error for outcome in mine if outcome.error],
                "work": _work_per_collision(mine),
            }
        )
    return {
        "run": str(run.directory),
        "events": simulated,
        "seconds": round(seconds, 3),
        "compiling_seconds": round(watcher.compiling, 3),
        "events_per_second": round(simulated / seconds) if seconds > 0 else 0,
        "points": points,
    }


def _work_per_collision(outcomes: Sequence[RepeatResult]) -> dict[str, float] | None:
    """What the engine did for each collision of the repeats simulated now; none without any."""
    done = [(each.work, each.collisions) for each in outcomes if each.work is not None]
    collisions = sum(number for _, number in done)
    if collisions == 0:
        return None
    names = ("predictions", "crossings", "queue_updates")
    return {name: sum(getattr(work, name) for work, _ in done) / collisions for name in names}


def _print_summary(run: Run, outcomes: Sequence[RepeatResult], summary: dict[str, Any]) -> None:
    """Print the table of points, early ends, and where the results are.

    Failed repeats are only counted: their errors were printed as they failed.
    """
    points = summary["points"]
    wanted = run.experiment.repeats
    rows = [
        [
            point_label(point["parameters"]),
            str(wanted) if point["repeats"] == wanted else f"{point['repeats']} of {wanted}",
            f"{point['collisions']:,}",
            ", ".join(f"{count} {reason}" for reason, count in point["ended"].items()),
        ]
        for point in points[:MOST_ROWS]
    ]
    print_table(
        [Column("point"), Column("repeats", True), Column("collisions", True), Column("ended")],
        rows,
    )
    if len(points) > MOST_ROWS:
        print_line(f"... and {len(points) - MOST_ROWS:,} more points; --json prints all")
    if kept := sum(outcome.unstored for outcome in outcomes):
        files = "The older, longer file was" if kept == 1 else f"{kept} older, longer files were"
        print_line(f"{files} kept.")
    collapsed = [
        f"point {outcome.point}, repeat {outcome.repeat}: {outcome.stop.message}"
        for outcome in outcomes
        if outcome.stop and outcome.stop.reason.collapsed
    ]
    print_some(collapsed, MOST_COLLAPSED, " such repeats")
    for hint in _collapse_hints(run, outcomes):
        print_line(hint)
    cached = sum(outcome.cached for outcome in outcomes)
    were = "was" if cached == 1 else "were"
    stored = f", {counted(cached, 'repeat')} {were} already stored" if cached else ""
    compiling = summary["compiling_seconds"]
    after = f" after {compiling:.0f} s of compiling" if compiling >= 1 else ""
    print_line(
        f"{counted(summary['events'], 'event')} in {summary['seconds']:.2f} s"
        f" ({summary['events_per_second']:,} events/s){after}{stored}; results in {run.directory}"
    )


def _collapse_hints(run: Run, outcomes: Sequence[RepeatResult]) -> list[str]:
    """How the config can be changed so that collapsed repeats continue, each way once."""
    ends = {(each.point, each.stop.reason) for each in outcomes if each.stop}
    ways = [_way_to_continue(run.points[point].experiment, why) for point, why in sorted(ends)]
    return [f"To continue such repeats, set {way}." for way in dict.fromkeys(filter(None, ways))]


def _way_to_continue(experiment: Experiment, reason: StopReason) -> str:
    """The config keys with which a repeat that ended so continues; empty without any."""
    if reason is StopReason.WALL_TRAP and experiment.collapse == "stop":
        if math.isinf(experiment.container.mass):
            return "`collapse: slide` (exact)"
        return "`collapse: slide` (exact, fixed container) or `collapse: {tc: 0.01}`"
    lossy = min(experiment.cor, experiment.effective_wall_cor) < 1.0
    if reason is StopReason.COLLAPSE and experiment.collapse in ("stop", "slide") and lossy:
        return "`collapse: {tc: 0.01}`"
    return ""
