"""``snooker run``: simulate every point and repeat of a config, or show what that would take."""

from __future__ import annotations

import math
import re
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from snooker_cli import runs
from snooker_cli.cli.options import AsJson, ConfigPath, EngineName, Jobs, Overrides
from snooker_cli.cli.output import first, point_table, print_result
from snooker_cli.config import Point, load
from snooker_cli.errors import ExitCode, UserError
from snooker_cli.exit_codes import leave
from snooker_cli.formatting import counted, duration, listed, point_label, printable, size
from snooker_cli.progress import RunProgress, complete, execute_watched, notice, stopping_on_signals
from snooker_cli.runs import Run
from snooker_cli.runs.batch import CHECKPOINT_INTERVAL, RepeatResult
from snooker_cli.runs.execution import POLL_INTERVAL, processors
from snooker_cli.runs.plan import checked, is_excessive, run_plan
from snooker_cli.runs.status import ended
from snooker_cli.trace import StopReason

if TYPE_CHECKING:
    from snooker_cli.runs.dask_executor import DaskExecutor  # loaded only if it is needed

Result = TypeVar("Result")

MOST_COLLAPSED = 3  # repeats with a wall trap or collapse whose messages are printed


def run(
    config: ConfigPath,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="The run's folder [runs/CONFIG's name]."),
    ] = None,
    override: Overrides = None,
    jobs: Jobs = None,
    executor: Annotated[
        str, typer.Option("--executor", help="threads, or dask=tcp://HOST:PORT of a scheduler.")
    ] = "threads",
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Replace the results in the folder, of any config.")
    ] = False,
    part: Annotated[
        str | None,
        typer.Option("--part", metavar="K/N", help="Only every N-th batch from the K-th on."),
    ] = None,
    engine: Annotated[
        EngineName | None,
        typer.Option("--engine", hidden=True, help="Of all points [the best for each]."),
    ] = None,
    checkpoint: Annotated[
        float,
        typer.Option(
            "--checkpoint", metavar="MINUTES", min=0.0, help="Save unfinished repeats this often."
        ),
    ] = CHECKPOINT_INTERVAL / 60,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only show the engine, time and disk.")
    ] = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", help="--dry-run: also what is modelled and left out.")
    ] = False,
    yes: Annotated[
        bool, typer.Option("--yes", help="Allow a run over a week or over the free disk space.")
    ] = False,
    no_collapse: Annotated[
        bool,
        typer.Option(
            "--no-collapse", hidden=True, help="Exit code 5 after a wall trap or collapse."
        ),
    ] = False,
    as_json: AsJson = False,
    no_progress: Annotated[bool, typer.Option("--no-progress", help="No progress bar.")] = False,
) -> None:
    """Simulate all points and repeats of CONFIG and store them.

    Stored repeats are checked and kept. After an interrupt, run the same command again to finish; a
    long repeat continues where it was saved.
    More repeats, collisions or time extend the run. During an extension, analyses use the existing
    data. A repeat that ends in a wall trap or inelastic collapse is kept up to that time. Results
    of a forced --engine have other bits, so they never mix with others.

    The workers of a dask scheduler must share the run's folder. The scheduler has --jobs batches of
    repeats at a time [1024]. Without a scheduler, --part 1/4 to --part 4/4 on several machines
    share the work and the folder.
    """
    share = _part(part)
    if share and fresh:
        raise UserError("--part and --fresh: parts delete nothing; delete the folder first")
    cancelled = threading.Event()
    with stopping_on_signals(cancelled), ExitStack() as exits:
        loaded = _awaited(lambda: load(config, override or ()), cancelled)
        points, scene_classes = _awaited(lambda: checked(loaded, engine), cancelled)
        target = Run(out or runs.RUNS / config.stem, loaded.experiment, points, engine)
        cluster = _awaited(lambda: _cluster(executor, jobs, cancelled), cancelled)
        workers = threads = jobs or processors()
        if cluster is not None:
            exits.enter_context(cluster)
            workers = processors()
            threads = max(1, min(cluster.threads, jobs or cluster.threads))

        def plan(fresh: bool) -> dict[str, Any]:
            return _awaited(lambda: run_plan(target, scene_classes, threads, fresh), cancelled)

        if dry_run:
            if change := runs.planned_change(target, fresh=fresh):
                notice(change)
            found = plan(fresh)
            print_result(
                found, as_json, [*_plan_lines(found, verbose), *target.common_random_notes]
            )
            return
        if not yes:
            runs.planned_change(target, fresh=fresh)
            # Stored files are checked only if the whole run would be too much.
            if is_excessive(plan(True)) and is_excessive(found := plan(fresh)):
                raise UserError(
                    _estimate(found),
                    "set fewer collisions or repeats, set `record: summary` to save disk, or give "
                    "--yes",
                )
        analyses = [] if fresh else target.analyses()
        outcomes, watcher = execute_watched(
            target,
            fresh=fresh,
            bar=not no_progress,
            part=share,
            cancelled=cancelled,
            workers=workers,
            executor=cluster,
            interval=60 * checkpoint,
            processes=True,
        )
    if removed := [path for path in analyses if not path.exists()]:
        again = listed([f"`snooker {path.stem} {target.directory}`" for path in removed])
        names = listed([path.name for path in removed])
        notice(f"removed {names}, because the run has changed; run {again} again")
    simulated = not all(each.cached for each in outcomes)
    if simulated and not fresh and target.figures():
        folder = target.figures_folder
        notice(f"{folder}: these figures are older; run `snooker plot {target.directory}` again")
    summary = _summary(target, outcomes, watcher)
    print_result(summary, as_json, _summary_lines(target, outcomes, summary))
    if cancelled.is_set():
        done = complete(outcomes, len(points) * loaded.experiment.repeats)
        command = "the same command without --fresh" if fresh else "the same command again"
        notice(f"interrupted: {done}; run {command} to finish")
        leave(ExitCode.INTERRUPTED)
    if any(each.error for each in outcomes):
        raise typer.Exit(ExitCode.SOME_FAILED)
    if no_collapse and any(each.stop and each.stop.reason.collapsed for each in outcomes):
        raise typer.Exit(ExitCode.COLLAPSED)


def _part(text: str | None) -> tuple[int, int] | None:
    """K and N of ``--part``. Raises ``UserError``."""
    match = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text or "")
    found = (int(match[1]), int(match[2])) if match else None
    if text is not None and not (found and 1 <= found[0] <= found[1]):
        raise UserError(f"--part {text}: give K/N with 1 ≤ K ≤ N, as in 3/16")
    return found


def _cluster(executor: str, at_once: int | None, cancelled: threading.Event) -> DaskExecutor | None:
    """The workers that ``--executor`` names; None for threads. Raises ``SnookerError``."""
    name, _, address = executor.partition("=")
    if executor == "threads":
        return None
    if name != "dask":
        raise UserError(
            f"--executor {executor}: there is no such executor",
            "give threads, or dask=tcp://HOST:PORT for the workers of a dask scheduler",
        )
    from snooker_cli.runs.dask_executor import DaskExecutor

    cluster = DaskExecutor(address, at_once, cancelled)
    if cluster.threads == 0:
        notice(f"the dask scheduler at {address} has no workers yet; waiting for them")
    return cluster


def _awaited(function: Callable[[], Result], cancelled: threading.Event) -> Result:
    """The result of a function that has nothing to save: once cancelled, the process ends."""
    future = ThreadPoolExecutor(1).submit(function)
    while not wait([future], POLL_INTERVAL).done:
        if cancelled.is_set():
            leave(ExitCode.INTERRUPTED)
    return future.result()


def _plan_lines(plan: dict[str, Any], verbose: bool) -> Iterator[str]:
    """The plan as text; `verbose` adds what is modelled and what is left out."""
    yield (
        f"{counted(plan['points'], 'point')}, {counted(plan['repeats'], 'repeat')} each: "
        f"{plan['cached']:,} stored in {plan['run']}, {plan['to_do']:,} to do"
    )
    for one in plan["kinds"]:
        balls = one["balls"]
        numbers = f"{balls[0]:,}" if len(balls) == 1 else f"{balls[0]:,} to {balls[-1]:,}"
        noun = "ball" if balls == [1] else "balls"
        yield ""
        points = point_label(one["points"][0])
        if one["points"][1:]:
            last = point_label(one["points"][-1])
            points = f"{counted(len(one['points']), 'point')}, {points} to {last}"
        yield f"{points}: {numbers} {noun}, {one['to_do']:,} to do"
        models = dict(one["models"])
        yield f"  engine    {one['engine']}"
        if ratios := [each for each in one["critical_ratios"] if each is not None]:
            values = " to ".join(dict.fromkeys(f"{f(ratios):.2g}" for f in (min, max)))
            yield f"  L/L_c     {values}: vortices and clusters grow above 1"
        yield f"  records   {'events' if models.pop('events') else 'a summary'}"
        for heading, wanted in (("modelled", True), ("left out", False))[: 2 * verbose]:
            names = [name for name, is_so in models.items() if is_so is wanted]
            yield f"  {heading}  {listed(names) if names else 'nothing'}"
    yield ""
    yield _estimate(plan)
    if plan["cools_out"]:
        yield (
            "This may take much longer: without walls, balls that cool drift together in the end, "
            "and hardly collide."
        )


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


def _summary(run: Run, outcomes: Sequence[RepeatResult], watcher: RunProgress) -> dict[str, Any]:
    """What ``--json`` prints."""
    simulated, seconds = watcher.simulated, watcher.seconds
    by_point: list[list[RepeatResult]] = [[] for _ in run.points]
    for each in outcomes:
        by_point[each.point].append(each)
    return {
        "run": str(run.directory),
        "events": simulated,
        "seconds": round(seconds, 3),
        "compiling_seconds": round(watcher.compiling, 3),
        "events_per_second": round(simulated / seconds) if seconds > 0 else 0,
        "points": [
            _point_summary(point, mine) for point, mine in zip(run.points, by_point, strict=True)
        ],
    }


def _point_summary(point: Point, outcomes: Sequence[RepeatResult]) -> dict[str, Any]:
    """The repeats of a point, those that ended early, and the errors of those that failed."""
    stops = [(each.repeat, each.stop) for each in outcomes if each.stop]
    reasons = Counter(str(each.stop.reason) if each.stop else "failed" for each in outcomes)
    complete = (StopReason.COLLISIONS, StopReason.TIME)
    return {
        "parameters": point.as_json(),
        "repeats": len(outcomes),
        "cached": sum(each.cached for each in outcomes),
        "collisions": sum(each.collisions for each in outcomes),
        "ended": dict(reasons),
        "stops": [
            {"repeat": k, **stop.known()} for k, stop in stops if stop.reason not in complete
        ],
        "errors": [each.error for each in outcomes if each.error],
    }


def _summary_lines(
    run: Run, outcomes: Sequence[RepeatResult], summary: dict[str, Any]
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
    ]
    yield from point_table("point | >repeats | >collisions | ended", rows)
    if kept := sum(outcome.unstored for outcome in outcomes):
        files = "The older, longer file was" if kept == 1 else f"{kept} older, longer files were"
        yield f"{files} kept."
    collapsed = [
        printable(f"point {outcome.point}, repeat {outcome.repeat}: {outcome.stop.message}")
        for outcome in outcomes
        if outcome.stop and outcome.stop.reason.collapsed
    ]
    yield from first(collapsed, MOST_COLLAPSED, " such repeats")
    yield from _collapse_hints(run, outcomes)
    cached = sum(outcome.cached for outcome in outcomes)
    were = "was" if cached == 1 else "were"
    stored = f", {counted(cached, 'repeat')} {were} already stored" if cached else ""
    compiling = summary["compiling_seconds"]
    after = f" after {compiling:.0f} s of compiling" if compiling >= 1 else ""
    speed = f"{summary['seconds']:.2f} s ({summary['events_per_second']:,} events/s)"
    events = counted(summary["events"], "event")
    yield f"{events} in {speed}{after}{stored}; results in {run.directory}"


def _collapse_hints(run: Run, outcomes: Sequence[RepeatResult]) -> list[str]:
    """How the config can be changed so that collapsed repeats continue, each way once."""
    ways = []
    for point, reason in sorted({(each.point, each.stop.reason) for each in outcomes if each.stop}):
        experiment = run.points[point].experiment
        lossy = min(experiment.cor, experiment.effective_wall_cor) < 1.0
        if reason is StopReason.WALL_TRAP and experiment.collapse == "stop":
            fixed = math.isinf(experiment.container.mass)
            otherwise = "`collapse: slide` (exact, fixed container) or `collapse: {tc: 0.01}`"
            ways.append("`collapse: slide` (exact)" if fixed else otherwise)
        if reason is StopReason.COLLAPSE and experiment.collapse in ("stop", "slide") and lossy:
            ways.append("`collapse: {tc: 0.01}`")
    return [f"To continue such repeats, set {way}." for way in dict.fromkeys(ways)]
