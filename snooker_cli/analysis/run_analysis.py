"""The fits, comparisons and table of a run: read from ``fit.json`` and others, or made.

A file counts if it names these very repeats and this very code; otherwise it is made again.
"""

import hashlib
import json
import logging
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from snooker_cli import store
from snooker_cli.analysis import comparison, decay, observables
from snooker_cli.config import Point
from snooker_cli.errors import UNREADABLE, RunError, UserError
from snooker_cli.files import sources_hash, write_json
from snooker_cli.formatting import plain
from snooker_cli.runs import Run
from snooker_cli.runs.status import ending
from snooker_cli.trace import Trace

Results = Sequence[decay.Decay] | Sequence[comparison.Comparison] | Sequence["RepeatResults"]
Analyse = Callable[[Iterator[Trace]], tuple[Results, list[decay.Note]]]
Counting = Callable[[Iterator[Trace], str, int], Iterator[Trace]]
"""Repeats, a label and their number -> the repeats, while something shows how many were read."""

Records: TypeAlias = list[dict[str, Any]]

SOURCES = ("analysis/*.py", "engine/*.py", "*.py")  # they decide what an analysis finds

_log = logging.getLogger(__name__)


def uncounted(traces: Iterator[Trace], label: str, total: int) -> Iterator[Trace]:
    """The repeats; nothing shows how many were read."""
    return traces


class RepeatResults(NamedTuple):
    """A repeat's row of ``table.json``; ``Run.table`` of ``api`` explains the columns."""

    trace: Trace

    def as_json(self) -> dict[str, Any]:
        trace = self.trace
        series, fits = observables.series(trace), decay.repeat_fits(trace, "kinetic_energy")
        row = {
            "ending": ending(trace.stop.reason),
            "complete": trace.stop.reason.complete,
            "time": trace.stop.time,
            "collisions": trace.collisions,
            "wall_collisions": trace.wall_events,
            "pair_collisions": trace.pair_events,
            "temperature": observables.mean_temperature(trace),
            "pressure": observables.mean_pressure(trace),
            "mean_speed": observables.time_mean(trace, series.mean_speed),
            "energy_ratio": observables.energy_ratio(series)[-1],
            "k": fits["exponential"].value,
            "alpha": fits["haff"].value,
        }
        return dict(plain(row))


@dataclass(frozen=True)
class RunAnalysis:
    """An analysis of points of a run.

    rows, notes : JSON records; each has the ``parameters`` of its point
    path : the file that keeps analyses, by point
    unsaved : what ``save`` writes to this file; ``None`` if the file has it already
    """

    rows: Records
    notes: Records
    path: Path
    unsaved: dict[str, Any] | None = None

    def save(self) -> None:
        """Write the file, unless it has this analysis; a notice says if that is not possible."""
        try:
            if self.unsaved is not None:
                write_json(self.path, self.unsaved)
        except OSError as error:
            problem = f"cannot be written ({error.strerror}); the result is only printed"
            _log.warning("%s: %s", self.path, problem)


def fits(
    run: Run,
    since: float = 0.0,
    until: float = math.inf,
    points: Iterable[Point] | None = None,
    counting: Counting = uncounted,
) -> RunAnalysis:
    """Rows of ``Decay.as_json``, for the times from ``since`` to ``until`` (s).

    Only fits of all times have a file. Raises ``RunError`` if the points, all by default, have no
    repeat or end before that range, and ``UserError`` for a range that cannot be.
    """
    chosen = tuple(points or run.points)
    if since == 0 and until == math.inf:
        return _analysis(run, chosen, decay.analyse, counting, run.directory / "fit.json")
    if not 0 <= since < until:
        raise UserError(
            f"there is no range of times from {since:g} s to {until:g} s",
            "give seconds from the start, with 0 ≤ --from < --until",
        )
    headers = (status.header for point in chosen for status in run.statuses(point.index))
    end = max((header.stop.time for header in headers if header), default=math.inf)
    if end <= since:
        raise RunError(f"no repeat reaches {since:g} s; the longest ends at {end:.4g} s")
    return _analysis(run, chosen, lambda traces: decay.analyse(traces, since, until), counting)


def comparisons(
    run: Run, points: Iterable[Point] | None = None, counting: Counting = uncounted
) -> RunAnalysis:
    """Rows of ``Comparison.as_json``; raises ``RunError`` if the points have no repeat."""
    path = run.directory / "compare.json"
    return _analysis(run, tuple(points or run.points), comparison.compare, counting, path)


def results(run: Run, points: Iterable[Point], counting: Counting = uncounted) -> RunAnalysis:
    """A row of ``RepeatResults`` for each repeat that is there; raises ``RunError`` without one."""
    path = run.directory / "table.json"

    def rows(traces: Iterator[Trace]) -> tuple[Results, list[decay.Note]]:
        return [*map(RepeatResults, traces)], []

    return _analysis(run, tuple(points), rows, counting, path)


def shorter_note(shorter: int, present: int) -> str:
    """A sentence on the repeats that an unfinished extension has not reached; empty if none."""
    which = "the repeat" if present == 1 else f"{shorter} of {present} repeats"
    rest = "where the run did before it was extended; run the config again for the rest"
    return f"{which} {'ends' if shorter == 1 else 'end'} {rest}" if shorter else ""


def _analysis(
    run: Run,
    points: Sequence[Point],
    analyse: Analyse,
    counting: Counting,
    path: Path | None = None,
) -> RunAnalysis:
    """The analysis of points: from a file, where that has one of these very repeats, or made."""
    present = {point.index: run.present(point) for point in points}
    if not any(present.values()):
        present[points[0].index] = [0]  # reading the first repeat raises the error
    saved, kept, new = _saved(path), dict[str, Any](), False
    whole = repr((run.manifest(), sources_hash(*SOURCES))) if path else ""
    for point in run.points if path else points:
        key, files = str(point.index), map(store.file_info, run.batches(point.index))
        made_from = hashlib.sha256(repr((whole, key, *files)).encode()).hexdigest()
        entry = saved.get(key)
        if isinstance(entry, dict) and entry.get("made_from") == made_from:
            kept[key] = entry
        elif point.index in present:
            made = _made(run, point, present[point.index], analyse, counting)
            kept[key], new = {"made_from": made_from, **made}, True
    chosen = [kept[str(point.index)] for point in points]
    rows, notes = ([row for entry in chosen for row in entry[name]] for name in ("rows", "notes"))
    return RunAnalysis(rows, notes, path or run.directory, kept if path and new else None)


def _saved(path: Path | None) -> dict[str, Any]:
    """What a file of analyses holds by point, not yet checked; nothing if it is not such a file."""
    try:
        content = json.loads(path.read_text(encoding="utf-8")) if path else {}
    except UNREADABLE:
        return {}
    return content if isinstance(content, dict) else {}


def _made(
    run: Run, point: Point, present: Sequence[int], analyse: Analyse, counting: Counting
) -> dict[str, Any]:
    """Rows and notes of a point; of an unfinished run, of the repeats that it has."""
    parameters, rows = {"parameters": point.as_json()}, Records()
    wanted, there = run.experiment.repeats, len(present)
    are = "the repeat is not" if wanted == 1 else f"{there} of {wanted} repeats are"
    missing = f"{are} there; run the config again for the rest" if there < wanted else ""
    texts = missing, shorter_note(run.shorter(point), there), *run.common_random_notes
    notes = [decay.Note(text) for text in texts if text]
    if present:
        label = f"point {point.index + 1} of {len(run.points)}"
        traces = counting(run.traces(point, present), label, there)
        results, others = analyse(observables.measured_ahead(traces))
        rows, notes = [parameters | result.as_json() for result in results], notes + others
    return {"rows": rows, "notes": [parameters | note._asdict() for note in notes]}
