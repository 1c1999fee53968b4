"""The fits and comparisons of a run: read from ``fit.json`` and ``compare.json``, or made.

A file counts only if this user's process made it from these very repeats, by this very code.
"""

import hashlib
import json
import math
import secrets
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

from snooker_cli import store
from snooker_cli.analysis import comparison, decay
from snooker_cli.analysis.observables import measured_ahead
from snooker_cli.config import Point
from snooker_cli.errors import UNREADABLE, RunError, UserError
from snooker_cli.files import user_hash, write_json
from snooker_cli.progress import counting
from snooker_cli.runs import Run
from snooker_cli.trace import Trace

Found = Sequence[decay.Decay] | Sequence[comparison.Comparison]
Analyse = Callable[[Iterator[Trace]], tuple[Found, list[str]]]

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

    def seal(self) -> str:
        """A hash of all that only this user can make: no other file is trusted."""
        content = json.dumps([self.made_from, self.rows, self.notes])
        try:
            return user_hash(content).hexdigest()
        except OSError:
            return secrets.token_hex()  # a later process makes the analysis again

    def save(self) -> None:
        """Write the file, unless it has this analysis. Raises ``RunError``."""
        content = {"made_from": self.seal(), "rows": self.rows, "notes": self.notes}
        try:
            if not self.saved:
                write_json(self.path, content)
        except OSError as error:
            raise RunError(
                f"{self.path}: cannot be written ({error.strerror}), so that the result is only "
                "printed; make the run's folder writable, or copy it"
            ) from None


def fits(run: Run, since: float = 0.0, until: float = math.inf) -> RunAnalysis:
    """Rows of ``Decay.as_json``, for the times from ``since`` to ``until`` (s).

    Only fits of all times have a file. Raises ``RunError`` if the run has no repeat or ends before
    that range, and ``UserError`` for a range that cannot be.
    """
    if since == 0 and until == math.inf:
        return _read_or_made(run, "fit.json", decay.analyse)
    if not 0 <= since < until:
        raise UserError(
            f"there is no range of times from {since:g} s to {until:g} s",
            "give seconds from the start, with 0 ≤ --from < --to",
        )
    statuses = (each for point in run.points for each in run.statuses(point.index))
    end = max((each.header.stop.time for each in statuses if each.header), default=math.inf)
    if end <= since:
        raise RunError(f"no repeat reaches {since:g} s; the longest ends at {end:.4g} s")
    return _made(run, "fit.json", lambda traces: decay.analyse(traces, since, until))


def comparisons(run: Run) -> RunAnalysis:
    """Rows of ``Comparison.as_json``; raises ``RunError`` if the run has no repeat."""
    return _read_or_made(run, "compare.json", comparison.compare)


def shorter_note(shorter: int, present: int) -> str:
    """A sentence on the repeats that an unfinished extension has not reached; empty if none."""
    which = "the repeat" if present == 1 else f"{shorter} of {present} repeats"
    rest = "where the run did before it was extended; run the config again for the rest"
    return f"{which} {'ends' if shorter == 1 else 'end'} {rest}" if shorter else ""


def _read_or_made(run: Run, name: str, analyse: Analyse) -> RunAnalysis:
    """An analysis from its file if that is of these repeats, else made now."""
    path, made_from = run.directory / name, _made_from(run)
    try:
        saved = json.loads(path.read_text(encoding="utf-8"))
        found = RunAnalysis(saved["rows"], saved["notes"], path, made_from, saved=True)
        if saved["made_from"] == found.seal():
            return found
    except UNREADABLE:
        pass  # there is no file, or it is not an analysis: make one
    return replace(_made(run, name, analyse), made_from=made_from, saved=False)


def _made(run: Run, name: str, analyse: Analyse) -> RunAnalysis:
    """An analysis that is not for the file; of an unfinished run, of the repeats that it has."""
    present = {point.index: run.present(point) for point in run.points}
    rows: Records = []
    notes: Records = []
    for point in run.points:
        parameters, numbers = {"parameters": point.as_json()}, present[point.index]
        sentences = _notes_on_repeats(run, point, len(numbers))
        # If no point has a repeat, reading the first one raises the error.
        if numbers or not any(present.values()):
            found, others = analyse(read(run, point, numbers))
            rows += [parameters | one.as_json() for one in found]
            sentences += others
        notes += [parameters | {"note": sentence} for sentence in sentences]
    return RunAnalysis(rows, notes, run.directory / name, "", saved=True)


def read(run: Run, point: Point, present: Sequence[int]) -> Iterator[Trace]:
    """These repeats of a point, measured in threads; a terminal shows how many have been read."""
    label = f"point {point.index + 1} of {len(run.points)}"
    return measured_ahead(counting(run.traces(point, present), label, len(present)))


def _notes_on_repeats(run: Run, point: Point, present: int) -> list[str]:
    """Sentences on a point's repeats: those missing or short, and common starts."""
    wanted = run.experiment.repeats
    are = "the repeat is not" if wanted == 1 else f"{present} of {wanted} repeats are"
    rest = f"{are} there; run the config again for the rest" if present < wanted else ""
    short = shorter_note(run.shorter(point), present)
    return [*filter(None, [rest, short]), *run.common_random_notes]


def _made_from(run: Run) -> str:
    """SHA-256 over the run, the size and date of each file, and the code."""
    paths = [path for point in run.points for path in run.batches(point.index)]
    files = [(path.parent.name, path.name, store.file_info(path)) for path in paths]
    return hashlib.sha256(repr((run.manifest(), files, _code())).encode()).hexdigest()


@cache
def _code() -> str:
    """SHA-256 over the sources that decide what an analysis finds."""
    package, found = Path(__file__).parents[1], hashlib.sha256()
    for pattern in ("analysis/*.py", "engine/*.py", "*.py"):
        for source in sorted(package.glob(pattern)):
            found.update(source.read_bytes())
    return found.hexdigest()
