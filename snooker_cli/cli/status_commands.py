"""``snooker ls``, ``show`` and ``verify``: the state of runs and of their files."""

from pathlib import Path
from typing import Annotated, Any

import typer

import snooker_cli as snooker
from snooker_cli import options
from snooker_cli.cli.output import print_result
from snooker_cli.cli.parameters import RunName, takes
from snooker_cli.errors import ExitCode, UserError, notice


@takes(options.AS_JSON)
def ls(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="A folder of runs, or one run.")
    ] = Path("runs"),
    *,
    as_json: bool,
) -> None:
    """List the runs in DIR and the state of their repeats.

    A repeat is done if its file is complete and belongs to the run's config and engine version.
    `snooker verify` also reads the content of the files. Short repeats count as to do until their
    file is written.
    """
    found = snooker.statuses(directory)
    for status in found:
        if "error" in status:
            notice(status["error"])
    if not found and not as_json:
        notice(f"{directory}: contains no runs")
        return
    print_result(found, as_json, found.lines)


@takes(options.HASHES, options.HASHES_POINT, options.HASHES_REPEAT, options.AS_JSON)
def show(
    run: RunName, *, hashes: bool, point: int | None, repeat: int | None, as_json: bool
) -> None:
    """Show the state of RUN: points, ends of repeats, files.

    With --hash, show hashes of the collisions of each repeat instead. Two repeats with the same
    hash have the same collisions to the bit. The page of `snooker live` shows the same hashes.
    """
    opened = snooker.open(run)
    if not hashes and (point is not None or repeat is not None):
        raise UserError("--point and --repeat choose repeats for --hash", "add --hash")
    result = opened.hashes(point, repeat) if hashes else opened.status()
    print_result(result, as_json, result.lines)


@takes(
    *(options.REPLAY, options.EXACT, options.EXACT_POINT, options.EXACT_REPEAT),
    *(options.EXACT_COLLISIONS, options.CERTIFICATE, options.REPLACE, options.JOBS),
    options.AS_JSON,
)
def verify(
    run: RunName,
    *,
    replay: bool,
    exact: bool,
    point: int | None,
    repeat: int,
    out: Path | None,
    jobs: int | None,
    as_json: bool,
    **how: Any,
) -> None:
    """Read and check every file of RUN.

    The check covers the hash of the content, the range of each value, and whether the file has the
    run's config and starts as the config says. It does not simulate. A line is printed for each bad
    file, and the exit code is then 1. Missing, interrupted and too short repeats are reported, but
    they are no error.

    --exact reads no other files than those of one repeat of each point, and computes it again with
    intervals that contain the true numbers. The result is the number of events that are certainly
    those of the scene, and bounds of their errors. Chaos ends this after some hundred events; that
    is no error. Summaries, snapshots and endings are compared with a new simulation. The exit code
    is 1 if one differs, if an event is wrong for another reason than rounding, or if the stored end
    or finish does not follow from the events. It needs the extra `reference`.
    """
    opened = snooker.open(run)
    if not exact and (point is not None or repeat or out is not None):
        raise UserError("--point, --repeat and --out need --exact")
    if exact:
        verdicts = opened.prove(point, repeat, out=out, **how)
    else:
        verdicts = opened.verify(replay=replay, jobs=jobs)
    print_result(verdicts, as_json, verdicts.lines)
    if not verdicts.sound:
        raise typer.Exit(ExitCode.UNSOUND)
    if verdicts.interrupted:
        raise typer.Exit(ExitCode.INTERRUPTED)
