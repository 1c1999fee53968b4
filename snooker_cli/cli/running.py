"""``snooker run``: simulate every point and repeat of a config."""

from __future__ import annotations

import os
from collections import Counter
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snooker_cli.cli import completion
from snooker_cli.cli.tables import tell

if TYPE_CHECKING:
    from collections.abc import Sequence

    from snooker_cli.cli.progress import Lines
    from snooker_cli.config import Loaded, Point
    from snooker_cli.results import Run
    from snooker_cli.runner import Kind, Outcome

ConfigPath = Annotated[Path, typer.Argument(metavar="CONFIG", help="A YAML experiment.")]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "-o",
        "--override",
        metavar="KEY=VALUE",
        help="Set a key; `-o cor=0.8,0.9`, `-o cor=0.5:1.0:11` and `-o balls.rings=range(1,6)` "
        "sweep it. May be given several times.",
        autocompletion=completion.overrides,
    ),
]
MOST_ROWS = 200
"""Points in the table that is printed; a terminal keeps about as many lines."""


class Engine(StrEnum):
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
        Engine | None,
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

    from snooker_cli import results
    from snooker_cli.cli.endings import Exit, leave
    from snooker_cli.cli.executing import reached, scheduler_of
    from snooker_cli.cli.progress import Bar, Lines, awaited, stopping_on_signals
    from snooker_cli.runner import execute

    scheduler = scheduler_of(executor)
    cancelled = threading.Event()
    with stopping_on_signals(cancelled), ExitStack() as exits:
        loaded, _, kinds = awaited(lambda: checked(config, override or (), engine), cancelled)
        directory = out or _folder(config)
        cores, cluster = os.cpu_count() or 1, None
        workers = threads = jobs or cores
        if scheduler is not None:
            cluster = awaited(lambda: reached(scheduler, jobs, cancelled), cancelled)
            exits.enter_context(cluster)
            workers = cores
            threads = max(1, min(cluster.threads, jobs or cluster.threads))
        if dry_run:
            from snooker_cli.cli.planning import plan, show

            target = results.planned(directory, loaded.experiment, fresh=fresh, engine=engine)
            _say_extension(target, fresh)
            show(awaited(lambda: plan(target, kinds, threads, fresh), cancelled), as_json=as_json)
            return
        if not yes:
            from snooker_cli.cli.planning import refuse_excess

            target = results.planned(directory, loaded.experiment, fresh=fresh, engine=engine)
            awaited(lambda: refuse_excess(target, kinds, threads, fresh), cancelled)
        watching = Lines if no_progress else Bar
        with results.held(directory):
            target = results.planned(directory, loaded.experiment, fresh=fresh, engine=engine)
            _say_extension(target, fresh)
            target = results.create(directory, loaded.experiment, fresh=fresh, engine=engine)
            with watching(len(target.points), target.experiment.repeats) as watcher:
                outcomes = execute(
                    target, workers=workers, watcher=watcher, cancelled=cancelled, cluster=cluster
                )
    summary = _summary(target, outcomes, watcher)
    if as_json:
        import json

        tell(json.dumps(summary))
    else:
        _show(target, outcomes, summary)
    if cancelled.is_set():
        _say_how_to_go_on(target, outcomes, fresh)
        leave(Exit.INTERRUPTED)
    if any(outcome.error for outcome in outcomes):
        raise typer.Exit(Exit.SOME_FAILED)
    if no_collapse and any(each.stop and each.stop.reason.collapsed for each in outcomes):
        raise typer.Exit(Exit.COLLAPSED)


def _folder(config: Path) -> Path:
    """Where the results of a config go if nothing else is said. Raises ``UserError``."""
    from snooker_cli import results
    from snooker_cli.cli.endings import UserError

    if config.stem in (".", ".."):
        raise UserError(f"{config}: its name is none for a folder; give --out, or rename it")
    return results.RUNS / config.stem


def checked(
    config: Path, overrides: Sequence[str], engine: str | None = None
) -> tuple[Loaded, tuple[Point, ...], list[Kind]]:
    """The loaded config, its points and the kinds of their scenes, all of them tried.

    Raises ``ConfigError``.
    """
    from snooker_cli.config import load
    from snooker_cli.runner import kinds
    from snooker_cli.scene import SceneError

    loaded = load(config, overrides)
    try:
        points = loaded.points()
        return loaded, points, kinds(points, engine)
    except SceneError as error:
        raise loaded.error(error.key, str(error)) from None


def _summary(run: Run, outcomes: list[Outcome], watcher: Lines) -> dict[str, Any]:
    """What ``--json`` prints."""
    from snooker_cli.trace import StopReason

    as_asked = (StopReason.COLLISIONS, StopReason.TIME)
    simulated = sum(outcome.collisions for outcome in outcomes if not outcome.cached)
    seconds = watcher.seconds
    by_point: list[list[Outcome]] = [[] for _ in run.points]
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


def _work(outcomes: list[Outcome]) -> dict[str, float] | None:
    """What the engine did for each collision of the repeats simulated now; none without any."""
    collisions = sum(outcome.collisions for outcome in outcomes)
    if collisions == 0:
        return None
    works = [outcome.work for outcome in outcomes if outcome.work]
    names = ("predictions", "crossings", "queue_updates")
    return {name: sum(getattr(work, name) for work in works) / collisions for name in names}


def _show(run: Run, outcomes: list[Outcome], summary: dict[str, Any]) -> None:
    """The table of points, what ended early, and where the results are.

    Of repeats that failed it has the numbers alone: the watcher has told them as they failed.
    """
    from snooker_cli.cli.going_on import advice
    from snooker_cli.cli.tables import Column, point_label, print_table
    from snooker_cli.words import counted

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


def _say_extension(run: Run, fresh: bool) -> None:
    """How the run extends the one that is there, if it does."""
    from snooker_cli.cli.progress import say
    from snooker_cli.results import extension

    if not fresh and (sentence := extension(run)):
        say(sentence)


def _say_how_to_go_on(run: Run, outcomes: list[Outcome], fresh: bool) -> None:
    """After an interrupt: what is there, and how to get the rest."""
    from snooker_cli.cli.progress import say
    from snooker_cli.trace import StopReason
    from snooker_cli.words import counted

    ended = [outcome.stop.reason for outcome in outcomes if outcome.stop]
    done = len(ended) - ended.count(StopReason.INTERRUPTED)
    command = "the same command without --fresh" if fresh else "the same command"
    wanted = counted(len(run.points) * run.experiment.repeats, "repeat")
    say(f"interrupted with {done:,} of {wanted} done; {command} goes on where it stopped")
