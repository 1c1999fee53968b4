"""A run: its folder, its points and repeats, and how they are simulated."""

from snooker_cli.runs.folder import (
    RUNS,
    continued,
    create,
    locked,
    open_run,
    planned_change,
    runs_in,
)
from snooker_cli.runs.run import MANIFEST, RepeatState, RepeatStatus, RunFolder

__all__ = ["MANIFEST", "RUNS", "RepeatState", "RepeatStatus", "RunFolder"]
__all__ += ["continued", "create", "locked", "open_run", "planned_change", "runs_in"]
