"""``snooker run``: simulate every point and repeat of a config, or show what that would take."""

import os
from pathlib import Path
from typing import Annotated

import typer

from snooker_cli import api
from snooker_cli.cli.options import AsJson, ConfigPath, Jobs, Overrides, flag, option
from snooker_cli.cli.output import print_result
from snooker_cli.errors import ExitCode, notice


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
    ] = api.CHECKPOINT_INTERVAL / 60,
    dry_run: Annotated[
        bool, flag("--dry-run", "Only show the search, time, disk and typical scales.")
    ] = False,
    yes: Annotated[bool, flag("--yes", "Allow runs over a week or the free disk space.")] = False,
    as_json: AsJson = False,
    no_progress: Annotated[bool, flag("--no-progress", "No progress bar or lines.")] = False,
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
    request = api.Request(
        config, override, out=out, fresh=fresh, jobs=jobs, executor=executor, part=part
    )
    if dry_run:
        plan = request.plan()
        if plan.change:
            notice(plan.change)
        print_result(plan, as_json, plan.lines)
        return
    outcome = request.carry_out(
        checkpoint=60 * checkpoint, yes=yes, progress=not no_progress, processes=True
    )
    print_result(outcome, as_json, outcome.lines)
    if outcome.interrupted:
        command = "the same command without --fresh" if fresh else "the same command again"
        notice(f"interrupted: {outcome.done}; run {command} to finish")
        os._exit(ExitCode.INTERRUPTED)  # Python would wait for threads with nothing to save
    if outcome.errors:
        raise typer.Exit(ExitCode.SOME_FAILED)
