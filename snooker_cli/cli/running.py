"""``snooker run``: simulate every point and repeat of a config."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from snooker_cli.results import Run
    from snooker_cli.runner import Outcome

ConfigPath = Annotated[Path, typer.Argument(metavar="CONFIG", help="A YAML experiment.")]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "-o",
        "--override",
        metavar="KEY=VALUE",
        help="Set a key; `-o cor=0.8,0.9`, `-o cor=0.5:1.0:11` and `-o balls.rings=range(1,6)` "
        "sweep it. May be given several times.",
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON on stdout.")]


def run(
    config: ConfigPath,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="The run's folder [runs/CONFIG's name]."),
    ] = None,
    override: Overrides = None,
    jobs: Annotated[
        int | None, typer.Option("-j", "--jobs", min=1, max=1024, help="Threads [all cores].")
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Replace what is in the folder, even of another config.")
    ] = False,
    as_json: AsJson = False,
    no_progress: Annotated[bool, typer.Option("--no-progress", help="No progress bar.")] = False,
) -> None:
    """Simulate all points and repeats of CONFIG and store them.

    Repeats that are there already are checked and kept, so that an interrupted run goes on where
    it was. A repeat that ends in a wall trap or inelastic collapse is kept up to there and said.
    """
    import os
    import threading
    import time

    from snooker_cli import results
    from snooker_cli.cli.endings import Exit
    from snooker_cli.cli.progress import Bar, Lines, stopping_on_signals
    from snooker_cli.runner import execute

    loaded = checked(config, override or ())
    directory = out or results.RUNS / config.stem
    target = results.create(directory, loaded.experiment, fresh=fresh)
    cancelled = threading.Event()
    clock = time.perf_counter()
    show = Lines if no_progress else Bar
    shown = show(len(target.points), target.experiment.repeats)
    with stopping_on_signals(cancelled), shown as watcher:
        outcomes = execute(
            target, workers=jobs or os.cpu_count() or 1, watcher=watcher, cancelled=cancelled
        )
    summary = _summary(target, outcomes, time.perf_counter() - clock)
    if as_json:
        import json

        typer.echo(json.dumps(summary))
    else:
        _show(target, outcomes, summary)
    if cancelled.is_set():
        raise typer.Exit(Exit.INTERRUPTED)
    if any(outcome.error for outcome in outcomes):
        raise typer.Exit(Exit.SOME_FAILED)


def checked(config: Path, overrides: Sequence[str]) -> Any:
    """The loaded config, with every point's scene tried. Raises ``ConfigError``."""
    from snooker_cli.config import load
    from snooker_cli.runner import check_scenes
    from snooker_cli.scene import SceneError

    loaded = load(config, overrides)
    try:
        check_scenes(loaded.points())
    except SceneError as error:
        raise loaded.error(error.key, str(error)) from None
    return loaded


def _summary(run: Run, outcomes: list[Outcome], seconds: float) -> dict[str, Any]:
    """What ``--json`` prints."""
    simulated = sum(outcome.collisions for outcome in outcomes if not outcome.cached)
    points = []
    for point in run.points:
        mine = [outcome for outcome in outcomes if outcome.point == point.index]
        reasons: dict[str, int] = {}
        for outcome in mine:
            reason = "failed" if outcome.stop is None else str(outcome.stop.reason)
            reasons[reason] = reasons.get(reason, 0) + 1
        points.append(
            {
                "parameters": point.as_json(),
                "repeats": len(mine),
                "cached": sum(outcome.cached for outcome in mine),
                "collisions": sum(outcome.collisions for outcome in mine),
                "ended": reasons,
                "errors": [outcome.error for outcome in mine if outcome.error],
            }
        )
    return {
        "run": str(run.directory),
        "events": simulated,
        "seconds": round(seconds, 3),
        "events_per_second": round(simulated / seconds) if seconds > 0 else 0,
        "points": points,
    }


def _show(run: Run, outcomes: list[Outcome], summary: dict[str, Any]) -> None:
    """The table of points, what went wrong, and where the results are."""
    from snooker_cli.cli.tables import Column, point_label, print_table
    from snooker_cli.trace import StopReason

    rows = [
        [
            point_label(point["parameters"]),
            str(point["repeats"]),
            f"{point['collisions']:,}",
            ", ".join(f"{count} {reason}" for reason, count in point["ended"].items()),
        ]
        for point in summary["points"]
    ]
    print_table(
        [Column("point"), Column("repeats", True), Column("collisions", True), Column("ended")],
        rows,
    )
    unusual = [
        outcome
        for outcome in outcomes
        if outcome.error
        or (outcome.stop and outcome.stop.reason in (StopReason.WALL_TRAP, StopReason.COLLAPSE))
    ]
    for outcome in unusual[:3]:
        said = outcome.error or (outcome.stop.message if outcome.stop else "")
        typer.echo(f"point {outcome.point}, repeat {outcome.repeat}: {said}")
    if len(unusual) > 3:
        typer.echo(f"... and {len(unusual) - 3} more such repeats")
    cached = sum(outcome.cached for outcome in outcomes)
    kept = f", {cached} repeats were there already" if cached else ""
    typer.echo(
        f"{summary['events']:,} events in {summary['seconds']:.2f} s"
        f" ({summary['events_per_second']:,} events/s){kept}; results in {run.directory}"
    )
