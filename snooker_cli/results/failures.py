"""The record of repeats that failed: a line of JSON each, of a run's last attempt alone.

Nothing else of a run is written twice: what is done is told by the repeats' own files, which a
record cannot contradict, as a repeat whose file is whole has not failed.
"""

from __future__ import annotations

import json
from contextlib import suppress

from snooker_cli.results.run import Run

FAILURES = "failures.jsonl"


def note_failure(run: Run, point: int, repeat: int, error: str) -> bool:
    """Add a failure; false if it cannot be, as on a full disk, which may be why."""
    line = json.dumps({"point": point, "repeat": repeat, "error": error})
    try:
        with (run.directory / FAILURES).open("a", encoding="utf-8") as file:
            file.write(line + "\n")
    except OSError:
        return False
    return True


def failures(run: Run) -> dict[tuple[int, int], str]:
    """The error of each point and repeat that failed; a line that a kill has cut is left out."""
    found: dict[tuple[int, int], str] = {}
    with suppress(OSError):
        for line in (run.directory / FAILURES).read_text("utf-8", "replace").splitlines():
            with suppress(ValueError, KeyError, TypeError):
                one = json.loads(line)
                found[int(one["point"]), int(one["repeat"])] = str(one["error"])
    return found


def forget_failures(run: Run) -> None:
    """Remove the record, as another attempt begins."""
    with suppress(OSError):
        (run.directory / FAILURES).unlink(missing_ok=True)
