"""A run: its folder, its points and repeats, and how they are simulated."""

from snooker_cli.runs.folder import (
    FAILURES,
    RUNS,
    create,
    holds_results,
    is_locked,
    locked,
    locked_for_part,
    open_run,
    planned_change,
    runs_in,
)
from snooker_cli.runs.run import ANALYSES, FIGURE_KEYS, MANIFEST, RepeatStatus, Run, State

__all__ = [
    "ANALYSES",
    "FAILURES",
    "FIGURE_KEYS",
    "MANIFEST",
    "RUNS",
    "RepeatStatus",
    "Run",
    "State",
    "create",
    "holds_results",
    "is_locked",
    "locked",
    "locked_for_part",
    "open_run",
    "planned_change",
    "runs_in",
]
