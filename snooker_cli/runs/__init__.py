"""A run: its folder, its points and repeats, and how they are simulated."""

from snooker_cli.runs.folder import RUNS as RUNS
from snooker_cli.runs.folder import create as create
from snooker_cli.runs.folder import locked as locked
from snooker_cli.runs.folder import locked_for_part as locked_for_part
from snooker_cli.runs.folder import open_run as open_run
from snooker_cli.runs.folder import planned_change as planned_change
from snooker_cli.runs.folder import runs_in as runs_in
from snooker_cli.runs.run import MANIFEST as MANIFEST
from snooker_cli.runs.run import RepeatStatus as RepeatStatus
from snooker_cli.runs.run import Run as Run
from snooker_cli.runs.run import State as State
