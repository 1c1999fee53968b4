"""The fits, comparisons and table of a run, made together and kept.

One pass over the repeats of a point gives all three. The next command finds them in the user's
cache folder, by a hash of the repeats and of this code.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from snooker_cli.analysis import decay
from snooker_cli.analysis.decay import Note
from snooker_cli.analysis.measurement import Measurement, measure, typical_pairs
from snooker_cli.analysis.quantities import QUANTITIES
from snooker_cli.analysis.theories import THEORIES, observables
from snooker_cli.config import Point
from snooker_cli.errors import RunError, UserError
from snooker_cli.files import sources_hash
from snooker_cli.options import FIT_SINCE, FIT_UNTIL
from snooker_cli.plugins import origins
from snooker_cli.results_cache import MEMORY, from_cache
from snooker_cli.runs import RunFolder
from snooker_cli.runs.run import RepeatState, RepeatStatus
from snooker_cli.trace import Trace

Counting = Callable[[Iterator[Trace], str, int], Iterator[Trace]]
"""Repeats, a label and their number -> the repeats, while something shows how many were read."""

JsonRows: TypeAlias = list[dict[str, Any]]

SOURCES = ("analysis/*.py", "engine/*.py", "runs/*.py", "*.py")
"""Whatever decides what an analysis finds."""

NOTHING: dict[str, JsonRows] = {"rows": [], "notes": []}
NO_STATE: dict[str, Any] = {"kinds": [], "stationary": None, "changes": {}}


def uncounted(traces: Iterator[Trace], label: str, total: int) -> Iterator[Trace]:
    """The repeats; nothing shows how many were read."""
    return traces


class RunAnalysis(NamedTuple):
    """An analysis of points of a run: JSON records with the ``parameters`` of their point.

    states : of each point, what findings need of it besides its rows
    """

    rows: JsonRows
    notes: JsonRows
    states: JsonRows


def fits(
    run: RunFolder,
    since: float = 0.0,
    until: float = math.inf,
    points: Iterable[Point] | None = None,
    counting: Counting = uncounted,
) -> RunAnalysis:
    """Rows of ``Decay.as_json``, for the times from ``since`` to ``until`` (s).

    Only fits of all times are kept. Raises ``RunError`` if the points, all by default, have no
    repeat or end before that range, and ``UserError`` for a range that cannot be.
    """
    chosen = tuple(points or run.points)
    if since == 0 and until == math.inf:
        return _joined(run, chosen, _entries(run, chosen, counting), "fits")
    if not 0 <= since < until:
        raise UserError(
            f"there is no range of times from {since:g} s to {until:g} s",
            f"give seconds from the start, with 0 ≤ {FIT_SINCE} < {FIT_UNTIL}",
        )
    headers = (status.header for point in chosen for status in run.statuses(point.index))
    end = max((header.stop.time for header in headers if header), default=math.inf)
    if end <= since:
        raise RunError(f"no repeat reaches {since:g} s; the longest ends at {end:.4g} s")

    entries = []
    for point in chosen:
        records = NOTHING
        if present := run.present(point):
            traces = _traces(run, point, present, counting)()
            span = since, until
            records = decay.fit_records(
                decay.decays_of(measure(traces, *span), decay.QUANTITIES, *span)
            )
        entries.append({"fits": records})
    return _joined(run, chosen, entries, "fits")


def comparisons(
    run: RunFolder, points: Iterable[Point] | None = None, counting: Counting = uncounted
) -> RunAnalysis:
    """Rows of ``Comparison.as_json``; raises ``RunError`` if the points have no repeat."""
    chosen = tuple(points or run.points)
    return _joined(run, chosen, _entries(run, chosen, counting), "comparisons")


def table_columns(
    run: RunFolder, points: Sequence[Point], counting: Counting = uncounted
) -> list[dict[str, list[Any]]]:
    """The columns of ``Run.table`` of ``api`` by point, with a value for each repeat that is there.

    A point without a repeat has no columns. Raises ``RunError`` if no point has a repeat.
    """
    return [entry["table"] for entry in _entries(run, points, counting)]


def shorter_note(shorter: int, present: int) -> str:
    """A sentence on the repeats that an unfinished extension has not reached; empty if none."""
    which = "the repeat" if present == 1 else f"{shorter} of {present} repeats"
    rest = "where the run did before it was extended; run the config again for the rest"
    return f"{which} {'ends' if shorter == 1 else 'end'} {rest}" if shorter else ""


def _joined(
    run: RunFolder, points: Sequence[Point], entries: Sequence[dict[str, Any]], name: str
) -> RunAnalysis:
    """The rows and notes of all points, and notes on the repeats that a run should have."""
    rows, notes, states = JsonRows(), JsonRows(), JsonRows()
    for point, entry in zip(points, entries, strict=True):
        parameters, wanted = {"parameters": point.as_json()}, run.requested(point)
        there = len(run.present(point))
        are = "the repeat is not" if wanted == 1 else f"{there} of {wanted} repeats are"
        missing = f"{are} there; run the config again for the rest" if there < wanted else ""
        texts = missing, shorter_note(run.shorter(point), there), *run.common_random_notes
        own = [Note(text)._asdict() for text in texts if text]
        rows += [parameters | row | {"requested": wanted} for row in entry[name]["rows"]]
        notes += [parameters | note for note in own + entry[name]["notes"]]
        counts = {"repeats": there, "requested": wanted}
        states.append(parameters | counts | entry.get("state", NO_STATE))
    return RunAnalysis(rows, notes, states)


def _entries(run: RunFolder, points: Sequence[Point], counting: Counting) -> list[dict[str, Any]]:
    """All results of points, from their runs: those that were made from these very repeats, or new.

    Raises ``RunError`` if no repeat is there.
    """
    if not any(map(run.present, points)):
        next(run.traces(points[0]))  # raises the error
    entries = []
    for own_run, point in map(run.origin, points):
        repeats = _fingerprints(own_run.statuses(point.index))
        origin = sources_hash(*SOURCES), *origins(QUANTITIES, THEORIES), *repeats
        make = partial(_results, own_run, point, counting)
        entries.append(from_cache(origin, make))
    return entries


def measurement_of(
    run: RunFolder, point: Point, repeats: Sequence[int], traces: Callable[[], Iterator[Trace]]
) -> Measurement:
    """The measurement of some repeats of a point, which stays in memory for the next analysis.

    traces : gives these repeats, if they must be read
    """
    statuses, wanted = run.statuses(point.index), set(repeats)
    there = [status for status in statuses if status.repeat in wanted]
    usable = [s for s in statuses if s.state not in (RepeatState.MISSING, RepeatState.UNUSABLE)]
    key = "measurement", point.index, *_fingerprints(there)
    if len(there) < len(usable):
        of_all = "measurement", point.index, *_fingerprints(usable)
        measured: Measurement | None = MEMORY.find(of_all, run)
        if measured is not None:
            return measured.chosen(np.array([status.repeat in wanted for status in usable]))
    pairs = typical_pairs(_pair_counts(statuses))

    def make() -> Measurement:
        return measure(traces(), pairs=pairs, observables_of=observables)

    return MEMORY.get(key, make, run)


def _fingerprints(statuses: Sequence[RepeatStatus]) -> Iterator[str]:
    """What identifies the repeats that are there. Raises ``StoreError`` as reading them does."""
    for status in statuses:
        if status.state is not RepeatState.MISSING:
            status.raise_if_unusable()
            yield f"{status.repeat} {status.header.fingerprint if status.header else ''}"


def _pair_counts(statuses: Sequence[RepeatStatus]) -> Iterator[tuple[int, bool]]:
    """Collisions between balls of each repeat that is there, and whether it is complete."""
    for status in statuses:
        if status.header is not None:
            yield status.header.pair_events, status.header.stop.reason.complete


def _traces(
    run: RunFolder, point: Point, present: Sequence[int], counting: Counting
) -> Callable[[], Iterator[Trace]]:
    """Gives the repeats of a point, while something shows how many were read."""
    return lambda: counting(run.traces(point, present), run.place(point), len(present))


def _results(run: RunFolder, point: Point, counting: Counting) -> dict[str, Any]:
    """Fits, comparisons and table of a point; of an unfinished run, of the repeats that it has."""
    present = run.present(point)
    if not present:
        return {"fits": NOTHING, "comparisons": NOTHING, "table": {}, "state": NO_STATE}
    measurement = measurement_of(run, point, present, _traces(run, point, present, counting))

    from snooker_cli.analysis.point_results import all_results  # kept results do without

    return all_results(measurement)
