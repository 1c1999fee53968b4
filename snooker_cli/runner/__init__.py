"""Points x repeats -> threads over the engine -> files; resumes, and tells how it goes."""

from snooker_cli.runner.execution import Outcome, Watcher, execute, versions
from snooker_cli.runner.kinds import Kind, kinds
from snooker_cli.runner.ledger import Entry, Job, Ledger, PointLedger, entry, jobs, ledger
from snooker_cli.runner.threads import LOOK
from snooker_cli.runner.verification import Verdict, verify

__all__ = [
    "LOOK",
    "Entry",
    "Job",
    "Kind",
    "Ledger",
    "Outcome",
    "PointLedger",
    "Verdict",
    "Watcher",
    "entry",
    "execute",
    "jobs",
    "kinds",
    "ledger",
    "verify",
    "versions",
]
