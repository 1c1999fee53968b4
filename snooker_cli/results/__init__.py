"""A run's folder: its manifest, its repeats, and what they are to the run."""

from snooker_cli.results.extension import extension
from snooker_cli.results.failures import FAILURES, failures, forget_failures, note_failure
from snooker_cli.results.folder import (
    RUNS,
    create,
    held,
    holds_results,
    is_held,
    open_run,
    planned,
    runs_in,
)
from snooker_cli.results.run import (
    ANALYSES,
    FIGURE_KEYS,
    MANIFEST,
    Run,
    RunError,
    State,
    write_json,
)

__all__ = [
    "ANALYSES",
    "FAILURES",
    "FIGURE_KEYS",
    "MANIFEST",
    "RUNS",
    "Run",
    "RunError",
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
    "write_json",
]
