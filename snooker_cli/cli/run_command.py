"""``snooker run``: simulate every point and repeat of a config, or show what that would take."""

import os
from typing import Any

import typer

from snooker_cli import options
from snooker_cli.api.simulating import PlannedRun
from snooker_cli.cli.output import print_result
from snooker_cli.cli.parameters import ConfigPath, takes
from snooker_cli.errors import ExitCode, notice


@takes(
    *(options.RUN_OUT, options.OVERRIDES, options.JOBS, options.EXECUTOR, options.FRESH),
    *(options.PART, options.CHECKPOINT, options.DRY_RUN, options.YES, options.AS_JSON),
    options.NO_PROGRESS,
)
def run(
    config: ConfigPath,
    *,
    minutes: float,
    dry_run: bool,
    yes: bool,
    as_json: bool,
    no_progress: bool,
    **how: Any,
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
    request = PlannedRun(config, **how)
    if dry_run:
        plan = request.plan()
        if plan.change:
            notice(plan.change)
        print_result(plan, as_json, plan.lines)
    else:
        finish(request, minutes, yes=yes, as_json=as_json, progress=not no_progress)


def finish(
    request: PlannedRun,
    minutes: float = options.CHECKPOINT.default,
    *,
    yes: bool = False,
    as_json: bool = False,
    progress: bool = True,
) -> None:
    """Simulate what is missing of a run and print what came out; exit code 4 for a failure.

    The arguments are those of ``run``.
    """
    outcome = request.carry_out(checkpoint=60 * minutes, yes=yes, progress=progress, processes=True)
    print_result(outcome, as_json, outcome.lines)
    if outcome.interrupted:
        command = "the same command without --fresh" if request.fresh else "the same command again"
        notice(f"interrupted: {outcome.done}; run {command} to finish")
        os._exit(ExitCode.INTERRUPTED)  # Python would wait for threads with nothing to save
    if outcome.errors:
        raise typer.Exit(ExitCode.SOME_FAILED)
