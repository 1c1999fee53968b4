"""A run: its folder, its points and repeats, and how they are simulated."""

from snooker_cli.runs.folder import RUNS, create, locked, open_run, planned_change, runs_in
from snooker_cli.runs.run import MANIFEST, RepeatStatus, Run, State

__all__ = ["MANIFEST", "RUNS", "RepeatStatus", "Run", "State"]
__all__ += ["create", "locked", "open_run", "planned_change", "runs_in"]
