"""``snooker run``: simulate every point and repeat of a config."""

from __future__ import annotations

import math
import os
import threading
from collections import Counter
from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snooker_cli.cli import options
from snooker_cli.cli.output import tell
from snooker_cli.errors import ExitCode, UserError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from snooker_cli.cli.progress_bar import Lines
    from snooker_cli.config import Experiment, Loaded, Point
    from snooker_cli.runs import Run
    from snooker_cli.runs.dask_executor import DaskExecutor
    from snooker_cli.runs.folder import Change
    from snooker_cli.runs.plan import SceneClass
    from snooker_cli.runs.repeat import RepeatResult
    from snooker_cli.trace import StopReason


# ``--executor``: who simulates a run's repeats.

THREADS = "threads"


def scheduler_of(executor: str) -> str | None:
    """The address of the dask scheduler that ``--executor`` names; none for threads.

    Raises ``UserError`` for another kind and ``RunError`` for what is no address.
    """
    kind, _, address = executor.partition("=")
    if executor == THREADS:
        return None
    if kind != "dask":
        raise UserError(
            f"--executor {executor}: there is no such executor; say {THREADS}, or "
            "dask=tcp://HOST:PORT for the workers of a dask scheduler"
        )
    from snooker_cli.runs.dask_executor import check_address

    check_address(address)
    return address


def reached(address: str, at_once: int | None, cancelled: threading.Event) -> DaskExecutor:
    """The workers of a scheduler; tells that none are there. Raises ``RunError``."""
    from snooker_cli.cli.progress_bar import say
    from snooker_cli.runs.dask_executor import DaskExecutor

    cluster = DaskExecutor(address, at_once, cancelled)
    if cluster.threads == 0:
        say(f"the dask scheduler at {address} has no workers yet; waiting for them")
    return cluster


# What to set in a config so that repeats go on past infinitely many collisions.

SLIDE = "collapse: slide lets trapped balls slide along the wall, exactly, and the repeats go on"
SLIDE_IF_FIXED = (
    "collapse: {tc: 0.01} has repeats with trapped balls go on; exactly, in a fixed container, "
    "collapse: slide does"
)
TC = "collapse: {tc: 0.01} has repeats with collapsed balls go on"


def advice(run: Run, outcomes: list[RepeatResult]) -> list[str]:
    """A sentence for each way out of what some repeats ended in."""
    ends = {(each.point, each.stop.reason) for each in outcomes if each.stop}
    return list(
        dict.fromkeys(
            said
            for point, reason in sorted(ends)
            for said in _ways_on(run.points[point].experiment, reason)
        )
    )


def _ways_on(experiment: Experiment, reason: StopReason) -> Iterator[str]:
    """What has repeats go on that ended so, if the config asks for nothing of the kind."""
    from snooker_cli.trace import StopReason

    if reason is StopReason.WALL_TRAP and experiment.collapse == "stop":
        yield SLIDE_IF_FIXED if math.isfinite(experiment.container.mass) else SLIDE
    lossy = min(experiment.cor, experiment.effective_wall_cor) < 1.0
    if reason is StopReason.COLLAPSE and experiment.collapse in ("stop", "slide") and lossy:
        yield TC


# ``snooker run --dry-run``: what a run would do, what it models, and about how long it takes.


def show(content: dict[str, Any], *, as_json: bool) -> None:
    """Print a plan."""
    import json

    if as_json:
        tell(json.dumps(content, allow_nan=False))
        return
    for line in _lines(content):
        tell(line)


def refuse_excess(run: Run, kinds: Sequence[SceneClass], workers: int, fresh: bool = False) -> None:
    """Raise ``UserError`` for what may take very long or more disk than is free."""
    from snooker_cli.errors import UserError
    from snooker_cli.runs.plan import is_excessive, run_plan

    # The files that are there are checked only if all of them anew would be too much.
    if not is_excessive(run_plan(run, kinds, workers, fresh=True)):
        return
    content = run_plan(run, kinds, workers, fresh)
    if is_excessive(content):
        raise UserError(
            f"{_estimate(content)}; give fewer collisions or repeats, or record: summary to take "
            "less disk, or --yes if it is meant"
        )


def _lines(content: dict[str, Any]) -> Iterator[str]:
    """The plan for people."""
    from snooker_cli.formatting import counted, listed

    there = "is" if content["cached"] == 1 else "are"
    yield (
        f"{counted(content['points'], 'point')}, {counted(content['repeats'], 'repeat')} each: "
        f"{content['cached']:,} {there} in {content['run']} already, {content['to_do']:,} to do"
    )
    for kind in content["kinds"]:
        balls = kind["balls"]
        numbers = f"{balls[0]:,}" if len(balls) == 1 else f"{balls[0]:,} to {balls[-1]:,}"
        noun = "ball" if balls == [1] else "balls"
        yield ""
        yield f"{_where(kind)}: {numbers} {noun}, {kind['to_do']:,} to do"
        models = dict(kind["models"])
        yield f"  engine    {kind['engine']}: {kind['because']}"
        yield f"  records   {'events' if models.pop('events') else 'a summary'}"
        for heading, wanted in (("modelled", True), ("left out", False)):
            names = [name for name, is_so in models.items() if is_so is wanted]
            yield f"  {heading}  {listed(names) if names else 'nothing'}"
    yield ""
    yield _estimate(content)


def _where(kind: dict[str, Any]) -> str:
    """The points of a kind."""
    from snooker_cli.cli.output import point_label
    from snooker_cli.formatting import counted

    points = kind["points"]
    if len(points) == 1:
        return point_label(points[0])
    return f"{counted(len(points), 'point')}, {point_label(points[0])} to {point_label(points[-1])}"


def _estimate(content: dict[str, Any]) -> str:
    """The sentence about time and disk."""
    from snooker_cli.formatting import counted, size

    if content["to_do"] == 0:
        return "nothing is left to do"
    disk, free = "", content["free_bytes"]
    if content["bytes"] is not None:
        disk = f", and about {size(content['bytes'])}"
        if free is not None and content["bytes"] > free:
            disk += f", where {size(free)} are free"
    if content["collisions"] is None:
        return (
            "a repeat that ends at a time, not after so many collisions, may take any time" + disk
        )
    longer = ", or far longer if balls cool until they hardly meet" if content["cools_out"] else ""
    return (
        f"at most {content['collisions']:,} collisions: about {_duration(content['seconds'])} on "
        f"{counted(content['threads'], 'thread')}{longer}{disk}"
    )


def _duration(seconds: float) -> str:
    """A time to two digits, which is more than is known of it."""
    from snooker_cli.formatting import rough

    if seconds < 1.0:
        return "a second"
    for unit, size in (("years", 3.156e7), ("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2 * size:
            return f"{rough(seconds / size)} {unit}"
    return f"{rough(seconds)} s"


ConfigPath = Annotated[Path, typer.Argument(metavar="CONFIG", help="A YAML experiment.")]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "-o",
        "--override",
        metavar="KEY=VALUE",
        help="Set a key; `-o cor=0.8,0.9`, `-o cor=0.5:1.0:11` and `-o balls.rings=range(1,6)` "
        "sweep it. May be given several times.",
        autocompletion=options.overrides,
    ),
]
MOST_ROWS = 200
"""Points in the table that is printed; a terminal keeps about as many lines."""


class EngineName(StrEnum):
    """The engines that a study can ask for."""

    ALL_PAIRS = "allpairs"
    CELLS = "cells"


AsJson = Annotated[bool, typer.Option("--json", help="Print JSON on stdout.")]
Jobs = Annotated[
    int | None, typer.Option("-j", "--jobs", min=1, max=1024, help="Threads [all cores].")
]


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
            help="Threads [all cores]; with dask, the repeats that the scheduler has at a time "
            "[1024].",
        ),
    ] = None,
    executor: Annotated[
        str,
        typer.Option(
            "--executor",
            metavar="KIND",
            help="Who simulates: threads, or dask=tcp://HOST:PORT for the workers of a dask "
            "scheduler, which must share the run's folder [threads].",
            show_default=False,
        ),
    ] = "threads",
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Replace what is in the folder, even of another config.")
    ] = False,
    engine: Annotated[
        EngineName | None,
        typer.Option("--engine", help="Engine for all points [for each what suits it]."),
    ] = None,
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run", help="Only show what would be done, what is modelled, time and disk."
        ),
    ] = False,
    yes: Annotated[
        bool,
        typer.Option("--yes", help="Begin even what may take weeks, or more disk than is free."),
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

    Repeats that are there already are checked and kept, so that an interrupted run goes on where
    it was; more repeats, collisions or time extend it, and until that is finished other commands
    take each repeat as long as it is. A repeat that ends in a wall trap or inelastic collapse is
    kept up to there and said. Results of a forced --engine are not mixed with others: their bits
    differ.
    """
    import threading
    from contextlib import ExitStack

    from snooker_cli import runs
    from snooker_cli.cli.exit_codes import leave
    from snooker_cli.cli.progress_bar import Bar, Lines, awaited, stopping_on_signals
    from snooker_cli.runs.execution import execute
    from snooker_cli.runs.plan import run_plan

    scheduler = scheduler_of(executor)
    cancelled = threading.Event()
    with stopping_on_signals(cancelled), ExitStack() as exits:
        loaded, points, scene_classes = awaited(
            lambda: checked(config, override or (), engine), cancelled
        )
        target = runs.Run(out or _folder(config), loaded.experiment, points, engine)
        cores, cluster = os.cpu_count() or 1, None
        workers = threads = jobs or cores
        if scheduler is not None:
            cluster = awaited(lambda: reached(scheduler, jobs, cancelled), cancelled)
            exits.enter_context(cluster)
            workers = cores
            threads = max(1, min(cluster.threads, jobs or cluster.threads))
        if dry_run:
            _say_change(runs.planned_change(target, fresh=fresh))
            show(
                awaited(lambda: run_plan(target, scene_classes, threads, fresh), cancelled),
                as_json=as_json,
            )
            return
        if not yes:
            runs.planned_change(target, fresh=fresh)
            awaited(lambda: refuse_excess(target, scene_classes, threads, fresh), cancelled)
        watching = Lines if no_progress else Bar
        with runs.locked(target.directory):
            _say_change(runs.create(target, fresh=fresh))
            with watching(len(target.points), target.experiment.repeats) as watcher:
                outcomes = execute(
                    target, workers=workers, watcher=watcher, cancelled=cancelled, executor=cluster
                )
    summary = _summary(target, outcomes, watcher)
    if as_json:
        import json

        tell(json.dumps(summary))
    else:
        _show(target, outcomes, summary)
    if cancelled.is_set():
        _say_how_to_go_on(target, outcomes, fresh)
        leave(ExitCode.INTERRUPTED)
    if any(outcome.error for outcome in outcomes):
        raise typer.Exit(ExitCode.SOME_FAILED)
    if no_collapse and any(each.stop and each.stop.reason.collapsed for each in outcomes):
        raise typer.Exit(ExitCode.COLLAPSED)


def _folder(config: Path) -> Path:
    """Where the results of a config go if nothing else is said. Raises ``UserError``."""
    from snooker_cli import runs
    from snooker_cli.errors import UserError

    if config.stem in (".", ".."):
        raise UserError(f"{config}: its name is none for a folder; give --out, or rename it")
    return runs.RUNS / config.stem


def checked(
    config: Path, overrides: Sequence[str], engine: str | None = None
) -> tuple[Loaded, tuple[Point, ...], list[SceneClass]]:
    """The loaded config, its points and the kinds of their scenes, all of them tried.

    Raises ``ConfigError``.
    """
    from snooker_cli.config import load
    from snooker_cli.errors import SceneError
    from snooker_cli.runs.plan import scene_classes

    loaded = load(config, overrides)
    try:
        points = loaded.points()
        return loaded, points, scene_classes(points, engine)
    except SceneError as error:
        raise loaded.error(error.key, str(error)) from None


def _summary(run: Run, outcomes: list[RepeatResult], watcher: Lines) -> dict[str, Any]:
    """What ``--json`` prints."""
    from snooker_cli.trace import StopReason

    as_asked = (StopReason.COLLISIONS, StopReason.TIME)
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
                    if outcome.stop and outcome.stop.reason not in as_asked
                ],
                "errors": [outcome.error for outcome in mine if outcome.error],
                "work": _work([each for each in mine if each.work is not None]),
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


def _work(outcomes: list[RepeatResult]) -> dict[str, float] | None:
    """What the engine did for each collision of the repeats simulated now; none without any."""
    collisions = sum(outcome.collisions for outcome in outcomes)
    if collisions == 0:
        return None
    works = [outcome.work for outcome in outcomes if outcome.work]
    names = ("predictions", "crossings", "queue_updates")
    return {name: sum(getattr(work, name) for work in works) / collisions for name in names}


def _show(run: Run, outcomes: list[RepeatResult], summary: dict[str, Any]) -> None:
    """The table of points, what ended early, and where the results are.

    Of repeats that failed it has the numbers alone: the watcher has told them as they failed.
    """
    from snooker_cli.cli.output import point_label, print_table
    from snooker_cli.formatting import Column, counted

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
    if unstored := sum(outcome.unstored for outcome in outcomes):
        files = "file stays as it was" if unstored == 1 else "files stay as they were"
        tell(f"{unstored} {files}, no shorter than what was simulated now")
    if len(points) > MOST_ROWS:
        tell(f"... and {len(points) - MOST_ROWS:,} more points; --json tells of all")
    collapsed = [
        (outcome, outcome.stop.message)
        for outcome in outcomes
        if outcome.stop and outcome.stop.reason.collapsed
    ]
    for outcome, said in collapsed[:3]:
        tell(f"point {outcome.point}, repeat {outcome.repeat}: {said}")
    if len(collapsed) > 3:
        tell(f"... and {counted(len(collapsed) - 3, 'more such repeat')}")
    for way in advice(run, outcomes):
        tell(f"in the config, {way}")
    cached = sum(outcome.cached for outcome in outcomes)
    were = "was" if cached == 1 else "were"
    kept = f", {counted(cached, 'repeat')} {were} there already" if cached else ""
    compiling = summary["compiling_seconds"]
    after = f" after {compiling:.0f} s of compiling" if compiling >= 1 else ""
    tell(
        f"{counted(summary['events'], 'event')} in {summary['seconds']:.2f} s"
        f" ({summary['events_per_second']:,} events/s){after}{kept}; results in {run.directory}"
    )


def _say_change(change: Change) -> None:
    """How the run extends or reduces the one in its folder, if it does."""
    from snooker_cli.cli.progress_bar import say

    if change.description:
        say(change.description)


def _say_how_to_go_on(run: Run, outcomes: list[RepeatResult], fresh: bool) -> None:
    """After an interrupt: what is there, and how to get the rest."""
    from snooker_cli.cli.progress_bar import say
    from snooker_cli.formatting import counted
    from snooker_cli.trace import StopReason

    ended = [outcome.stop.reason for outcome in outcomes if outcome.stop]
    done = len(ended) - ended.count(StopReason.INTERRUPTED)
    command = "the same command without --fresh" if fresh else "the same command"
    wanted = counted(len(run.points) * run.experiment.repeats, "repeat")
    say(f"interrupted with {done:,} of {wanted} done; {command} goes on where it stopped")
