"""A run: its folder, its points and repeats, and how they are simulated."""

from snooker_cli.runs.folder import (
    FAILURES,
    RUNS,
    create,
    extension,
    failures,
    forget_failures,
    held,
    holds_results,
    is_held,
    note_failure,
    open_run,
    planned,
    runs_in,
)
from snooker_cli.runs.run import ANALYSES, FIGURE_KEYS, MANIFEST, Run, State

__all__ = [
    "ANALYSES",
    "FAILURES",
    "FIGURE_KEYS",
    "MANIFEST",
    "RUNS",
    "Run",
    "State",
    "create",
    "extension",
    "failures",
    "forget_failures",
    "held",
    "holds_results",
    "is_held",
    "note_failure",
    "open_run",
    "planned",
    "runs_in",
]
