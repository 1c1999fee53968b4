"""Points x repeats -> threads over the engine -> files; resumes, and tells how it goes."""

from snooker_cli.runner.execution import Job, Outcome, Watcher, execute, jobs, present, versions
from snooker_cli.runner.kinds import Kind, kinds
from snooker_cli.runner.threads import LOOK

__all__ = [
    "LOOK",
    "Job",
    "Kind",
    "Outcome",
    "Watcher",
    "execute",
    "jobs",
    "kinds",
    "present",
    "versions",
]
