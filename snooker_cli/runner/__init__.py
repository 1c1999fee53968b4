"""Points x repeats -> an executor over the engine -> files; resumes, and tells how it goes."""

from snooker_cli.runner.execution import Watcher, execute
from snooker_cli.runner.kinds import Kind, kinds
from snooker_cli.runner.ledger import Entry, Ledger, entry, jobs, ledger
from snooker_cli.runner.repeat import Outcome, versions
from snooker_cli.runner.verification import Verdict, verify
from snooker_cli.runner.workers import LOOK

__all__ = [
    "LOOK",
    "Entry",
    "Kind",
    "Ledger",
    "Outcome",
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
