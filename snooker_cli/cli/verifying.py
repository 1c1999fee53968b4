"""``snooker verify``: read every file of a run again, and simulate it again."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snooker_cli.cli.analysing import RunName
from snooker_cli.cli.running import AsJson, Jobs
from snooker_cli.cli.tables import tell

if TYPE_CHECKING:
    from collections.abc import Iterator

    from snooker_cli.results import Run
    from snooker_cli.runner import Verdict


def verify(
    run: RunName,
    replay: Annotated[
        bool,
        typer.Option("--replay", help="Simulate every repeat again, too, and compare all bits."),
    ] = False,
    jobs: Jobs = None,
    as_json: AsJson = False,
) -> None:
    """Read every file of RUN again: its content by its hash, and whether it is of this run.

    A line is printed for each bad file, and the exit code is then 1. Repeats that are missing,
    interrupted or shorter than an extended run's are told, but are no fault.
    """
    import json

    from snooker_cli.cli.endings import Exit
    from snooker_cli.results import State, open_run

    opened = open_run(run)
    verdicts = sorted(
        _followed(opened, replay, jobs or os.cpu_count() or 1),
        key=lambda verdict: (verdict.point, verdict.repeat),
    )
    bad = [verdict for verdict in verdicts if verdict.state is State.UNUSABLE]
    counts = {
        str(state): sum(verdict.state is state for verdict in verdicts)
        for state in State
        if state is not State.UNUSABLE
    }
    content: dict[str, Any] = {
        "run": str(opened.directory),
        "replayed": replay,
        **counts,
        "bad": [
            {
                "point": verdict.point,
                "repeat": verdict.repeat,
                "path": str(verdict.path),
                "error": verdict.sentence,
            }
            for verdict in bad
        ],
    }
    if as_json:
        tell(json.dumps(content))
    else:
        for line in _lines(content):
            tell(line)
    if bad:
        raise typer.Exit(Exit.UNSOUND)


def _followed(run: Run, replay: bool, workers: int) -> Iterator[Verdict]:
    """The verdicts, with a progress bar on a terminal."""
    from rich.console import Console
    from rich.progress import track

    from snooker_cli.runner import verify as verdicts

    return iter(
        track(
            verdicts(run, replay=replay, workers=workers),
            "",
            total=len(run.points) * run.experiment.repeats,
            console=Console(stderr=True),
            transient=True,
            disable=not sys.stderr.isatty(),
        )
    )


def _lines(content: dict[str, Any]) -> Iterator[str]:
    """The verdict for people."""
    from snooker_cli.words import counted, listed

    for one in content["bad"]:
        yield one["error"]
    how = "read and simulated again" if content["replayed"] else "read again"
    bad = f", {counted(len(content['bad']), 'bad file')}" if content["bad"] else ""
    whole = counted(content["done"], "whole repeat")
    yield f"{content['run']}: {whole}{bad}, {how}"
    left = [
        f"{content[state]:,} {words}"
        for state, words in (
            ("missing", "missing"),
            ("interrupted", "interrupted"),
            ("shorter", "shorter than the run is now"),
        )
        if content[state]
    ]
    if left:
        yield f"{listed(left)}; run the config again, which does them"
