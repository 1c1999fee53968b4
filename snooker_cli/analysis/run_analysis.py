"""The fits and comparisons of a run: read from ``fit.json`` and ``compare.json``, or made.

A file counts only if it was made from these very repeats, by this very code.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
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

Records: TypeAlias = list[dict[str, Any]]

KEYS = {"made_from", "rows", "notes"}
"""Of the JSON file."""


@dataclass(frozen=True)
class RunAnalysis:
    """An analysis of every point of a run.

    rows, notes : JSON records; each has the ``parameters`` of its point
    path : the file that keeps them
    made_from : hash of the run, its repeats and the code
    saved : whether the file has them
    """

    rows: Records
    notes: Records
    path: Path
    made_from: str
    saved: bool

    def save(self) -> None:
        """Write the file, unless it has this analysis. Raises ``RunError``."""
        if self.saved:
            return
        try:
            content = {"made_from": self.made_from, "rows": self.rows, "notes": self.notes}
            write_json(self.path, content)
        except OSError as error:
            raise RunError(
                f"{self.path}: cannot be written ({error.strerror}), so that the result is only "
                "printed; make the run's folder writable, or copy it"
            ) from None


def fits(run: Run) -> RunAnalysis:
    """Decay constants, see ``decay.record``; raises ``RunError`` if the run has no repeat."""
    return _read_or_made(run, "fit.json", _fitted)


def comparisons(run: Run) -> RunAnalysis:
    """Rows of ``comparison.record``; raises ``RunError`` if the run has no repeat."""
    return _read_or_made(run, "compare.json", _compared)


def shorter_note(shorter: int, present: int) -> str:
    """A sentence on the repeats that an unfinished extension has not reached; empty if none."""
    if not shorter:
        return ""
    which = "the repeat" if present == 1 else f"{shorter} of {present} repeats"
    verb = "ends" if shorter == 1 else "end"
    return (
        f"{which} {verb} where the run did before it was extended; run the config again for the "
        "rest"
    )


_Analysed: TypeAlias = tuple[Records, list[str]]


def _fitted(traces: Iterator[Trace], parameters: dict[str, Any]) -> _Analysed:
    found = decay.decays(traces)
    return [decay.record(one, parameters) for one in found], decay.notes(found)


def _compared(traces: Iterator[Trace], parameters: dict[str, Any]) -> _Analysed:
    found = comparison.compare(traces)
    return [comparison.record(row, parameters) for row in found.rows], list(found.notes)


def _read_or_made(
    run: Run, name: str, analyse: Callable[[Iterator[Trace], dict[str, Any]], _Analysed]
) -> RunAnalysis:
    """An analysis from its file if that is of these repeats, else made now.

    Of an unfinished run, the repeats that are present are analysed.
    """
    path = run.directory / name
    present = {point.index: run.present(point) for point in run.points}
    made_from = _made_from(run, present)
    content = _content(path)
    if content.get("made_from") == made_from:
        return RunAnalysis(content["rows"], content["notes"], path, made_from, saved=True)
    rows: Records = []
    notes: Records = []
    for point in run.points:
        parameters, numbers = point.as_json(), present[point.index]
        said = _missing_notes(run, point, len(numbers))
        # If no point has a repeat, reading the first one raises the error.
        if numbers or not any(present.values()):
            found, sentences = analyse(run.traces(point, numbers), parameters)
            rows += found
            said += sentences
        notes += [{"parameters": parameters, "note": sentence} for sentence in said]
    return RunAnalysis(rows, notes, path, made_from, saved=False)


def _missing_notes(run: Run, point: Point, present: int) -> list[str]:
    """Sentences on the repeats that a point still lacks, or that are too short."""
    wanted = run.experiment.repeats
    are = "the repeat is not" if wanted == 1 else f"{present} of {wanted} repeats are"
    rest = f"{are} there; run the config again for the rest" if present < wanted else ""
    return list(filter(None, [rest, shorter_note(run.shorter(point), present)]))


def _content(path: Path) -> dict[str, Any]:
    """The saved analysis; empty if there is none that can be read."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) and content.keys() >= KEYS else {}


def _made_from(run: Run, present: Mapping[int, list[int]]) -> str:
    """SHA-256 over the run, the size and date of each repeat's file, and the code."""
    files = [
        (index, repeat, store.file_info(run.path(index, repeat)))
        for index, numbers in present.items()
        for repeat in numbers
    ]
    return hashlib.sha256(repr((run.manifest(), files, _code())).encode()).hexdigest()


@cache
def _code() -> str:
    """SHA-256 over the sources that decide what an analysis finds."""
    package = Path(__file__).parents[1]
    found = hashlib.sha256()
    for pattern in ("analysis/*.py", "engine/*.py", "theory/*.py", "*.py"):
        for source in sorted(package.glob(pattern)):
            found.update(source.read_bytes())
    return found.hexdigest()
