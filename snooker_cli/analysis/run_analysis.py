"""The fits and comparisons of a run: read from ``fit.json`` and ``compare.json``, or made.

A file counts only if it was made from these very repeats, by this very code.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from snooker_cli import store
from snooker_cli.analysis import comparison, decay
from snooker_cli.errors import RunError
from snooker_cli.files import write_json

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.runs import Run
    from snooker_cli.trace import Trace

    Found = Sequence[decay.Decay] | Sequence[comparison.Comparison]

Records: TypeAlias = list[dict[str, Any]]


@dataclass(frozen=True)
class RunAnalysis:
    """An analysis of every point of a run.

    rows, notes : JSON records; each has the ``parameters`` of its point
    path, saved : the file that keeps them, and whether it has them
    made_from : hash of the run, its repeats and the code
    """

    rows: Records
    notes: Records
    path: Path
    made_from: str
    saved: bool

    def save(self) -> None:
        """Write the file, unless it has this analysis. Raises ``RunError``."""
        content = {"made_from": self.made_from, "rows": self.rows, "notes": self.notes}
        try:
            if not self.saved:
                write_json(self.path, content)
        except OSError as error:
            raise RunError(
                f"{self.path}: cannot be written ({error.strerror}), so that the result is only "
                "printed; make the run's folder writable, or copy it"
            ) from None


def fits(run: Run) -> RunAnalysis:
    """Rows of ``Decay.as_json``; raises ``RunError`` if the run has no repeat."""
    return _read_or_made(run, "fit.json", decay.analyse)


def comparisons(run: Run) -> RunAnalysis:
    """Rows of ``Comparison.as_json``; raises ``RunError`` if the run has no repeat."""
    return _read_or_made(run, "compare.json", comparison.compare)


def shorter_note(shorter: int, present: int) -> str:
    """A sentence on the repeats that an unfinished extension has not reached; empty if none."""
    which = "the repeat" if present == 1 else f"{shorter} of {present} repeats"
    rest = "where the run did before it was extended; run the config again for the rest"
    return f"{which} {'ends' if shorter == 1 else 'end'} {rest}" if shorter else ""


def _read_or_made(
    run: Run, name: str, analyse: Callable[[Iterator[Trace]], tuple[Found, list[str]]]
) -> RunAnalysis:
    """An analysis from its file if that is of these repeats, else made now.

    Of an unfinished run, the repeats that are present are analysed.
    """
    path = run.directory / name
    present = {point.index: run.present(point) for point in run.points}
    made_from = _made_from(run)
    try:
        saved = json.loads(path.read_text(encoding="utf-8"))
        if saved["made_from"] == made_from:
            return RunAnalysis(saved["rows"], saved["notes"], path, made_from, saved=True)
    except (OSError, ValueError, TypeError, KeyError):
        pass  # there is no file, or it is not an analysis: make one
    rows: Records = []
    notes: Records = []
    for point in run.points:
        parameters, numbers = {"parameters": point.as_json()}, present[point.index]
        sentences = _missing_notes(run, point, len(numbers))
        # If no point has a repeat, reading the first one raises the error.
        if numbers or not any(present.values()):
            found, others = analyse(run.traces(point, numbers))
            rows += [parameters | one.as_json() for one in found]
            sentences += others
        notes += [parameters | {"note": sentence} for sentence in sentences]
    return RunAnalysis(rows, notes, path, made_from, saved=False)


def _missing_notes(run: Run, point: Point, present: int) -> list[str]:
    """Sentences on the repeats that a point still lacks, or that are too short."""
    wanted = run.experiment.repeats
    are = "the repeat is not" if wanted == 1 else f"{present} of {wanted} repeats are"
    rest = f"{are} there; run the config again for the rest" if present < wanted else ""
    return list(filter(None, [rest, shorter_note(run.shorter(point), present)]))


def _made_from(run: Run) -> str:
    """SHA-256 over the run, the size and date of each file, and the code."""
    paths = [path for point in run.points for path in run.batches(point.index)]
    files = [(path.parent.name, path.name, store.file_info(path)) for path in paths]
    return hashlib.sha256(repr((run.manifest(), files, _code())).encode()).hexdigest()


@cache
def _code() -> str:
    """SHA-256 over the sources that decide what an analysis finds."""
    package, found = Path(__file__).parents[1], hashlib.sha256()
    for pattern in ("analysis/*.py", "engine/*.py", "theory/*.py", "*.py"):
        for source in sorted(package.glob(pattern)):
            found.update(source.read_bytes())
    return found.hexdigest()
