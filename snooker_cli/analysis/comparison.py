"""What a point's repeats measured, beside the predictions of theory."""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli import theory
from snooker_cli.analysis import observables, predictions
from snooker_cli.analysis.decay import Note, early_notes, number_complete
from snooker_cli.analysis.predictions import EQUILIBRIUM, UNITS, SpeedLaw
from snooker_cli.formatting import plain
from snooker_cli.scene import Scene
from snooker_cli.trace import SPEED_BINS, StopReason, Trace

_Table: TypeAlias = defaultdict[tuple[str, str], list[list[float]]]
"""Measured and predicted values of the repeats, by quantity and model."""

RELAXING, LEAST_RELAXING = 15, 5
"""Collisions of a ball while equal speeds relax; the fewest, where a kurtosis of 1.95 is 1.83."""

LEAST_EXPECTED = 8
"""Balls expected in the first and last bin of the chi-square; bins with fewer are merged."""

CHI_SQUARE = "χ² of the speed distribution, per degree of freedom"


@dataclass(frozen=True)
class Comparison:
    """A measured quantity beside a prediction, both means over the repeats.

    error : standard error of the measured mean
    difference, difference_error : of measured less predicted, repeat by repeat, because many
        predictions follow the repeat's own temperature
    samples : speeds behind a distribution; ``None`` for a mean over the repeats
    complete, simulated : of all repeats of the point, those that reached their requested end
    """

    quantity: str
    model: str
    measured: float
    error: float
    predicted: float
    difference: float
    difference_error: float
    repeats: int
    samples: int | None = None
    complete: int = 0
    simulated: int = 0

    @property
    def in_errors(self) -> float:
        """The difference in standard errors; nan if the repeats agree but for rounding."""
        rounding = observables.ROUNDING * max(abs(self.measured), abs(self.predicted))
        known = self.difference_error > rounding  # false for nan
        return self.difference / self.difference_error if known else math.nan

    def as_json(self) -> dict[str, Any]:
        """A row of ``compare.json``; what is not a number is null."""
        row = {"quantity": self.quantity, "unit": UNITS.get(self.quantity, "1"), **vars(self)}
        return dict(plain(row | {"difference_in_errors": self.in_errors}))


def relaxing(number: int, of_a_ball: int = RELAXING) -> int:
    """Ball-ball collisions in which a gas of ``number`` balls relaxes; none for one ball."""
    return math.ceil(of_a_ball * number / 2) if number > 1 else 0


def relaxed_at(trace: Trace) -> float | None:
    """Time (s) after ``relaxing(N)`` ball-ball collisions, or half of all; ``None`` if too few."""
    number, half, columns = trace.start.number, trace.pair_events // 2, observables.series(trace)
    if half < relaxing(number, LEAST_RELAXING):
        return None
    skipped = min(half, relaxing(number))
    time = float(columns.time[np.searchsorted(columns.pair_events, skipped)])
    return time if time < trace.stop.time else None


def compare(traces: Iterable[Trace]) -> tuple[list[Comparison], list[Note]]:
    """A point's repeats beside every theory that applies, and notes for a reader.

    Pressures, rates and speeds are those of the part of each repeat after its relaxation.
    """
    ended: Counter[StopReason] = Counter()
    equilibrium: _Table = defaultdict(list)
    cooling: _Table = defaultdict(list)
    counts = np.zeros(SPEED_BINS, dtype=np.int64)
    scene: Scene | None = None
    used = relaxed = 0
    for trace in traces:
        ended[trace.stop.reason] += 1
        if trace.collisions == 0:
            continue
        scene, calm = trace.start, observables.before_collapse(trace)
        since, used = relaxed_at(calm), used + 1
        with np.errstate(divide="ignore", invalid="ignore"):  # rows without a value are left out
            parts = [(cooling, predictions.cooling(trace))]
            if since is not None:
                relaxed += 1
                kinds = predictions.pressures, predictions.rates, predictions.speeds
                parts += [(equilibrium, rows(calm, since)) for rows in kinds]
                counts += observables.reduced_speed_counts(calm, since)
            for table, rows in parts:
                for quantity, model, *values in rows:
                    table[quantity, model].append(values)
    notes, total = early_notes(ended), ended.total()
    if used < total:
        which = "the repeat" if total == 1 else f"{total - used} of {total} repeats"
        notes.append(Note(f"{which} {'has' if total - used == 1 else 'have'} no collisions"))
    if scene is None:
        return [], notes
    if scene.number > 1:
        fewest = 2 * relaxing(scene.number, LEAST_RELAXING)
        few = f"; left out: {used - relaxed} of {used} repeats, with fewer than {fewest}"
        skipped = f"the first {relaxing(scene.number)} ball-ball collisions, at most half"
        note = f"pressures, rates and speeds skip {skipped} (relaxation)" + few * (relaxed < used)
        notes.append(Note(note, ", ".join((*EQUILIBRIUM, CHI_SQUARE))))
    notes += predictions.notes(scene)
    laws = predictions.speed_laws(scene) if counts.any() else []
    comparisons = [
        *_compared(equilibrium, notes),
        *(_chi_square(law, counts, relaxed) for law in laws),
        *_compared(cooling, notes),
    ]
    if ratio := theory.critical_ratio(scene, scene.restitution):
        none = math.nan, math.nan, math.nan, math.nan
        comparisons.append(Comparison("L/L_c", "critical length", ratio, *none, used))
        notes.append(Note(f"L/L_c: {theory.CRITICAL}", "L/L_c"))
    complete = number_complete(ended)
    return [replace(row, complete=complete, simulated=total) for row in comparisons], notes


def _compared(table: _Table, notes: list[Note]) -> Iterator[Comparison]:
    """The rows that have a value; ``notes`` gets a sentence for each of the others."""
    for (quantity, model), pairs in table.items():
        values = np.array(pairs, dtype=np.float64)
        good = values[np.all(np.isfinite(values), axis=1)]
        if not len(good):
            known = bool(np.any(np.isfinite(values[:, 0])))
            why = "the theory has no value here" if known else "it could not be measured"
            notes.append(Note(f"{quantity} ({model}) is missing: {why}", quantity, model))
            continue
        difference = good[:, 0] - good[:, 1]
        yield Comparison(
            quantity,
            model,
            *observables.mean_and_error(good[:, 0]),
            predicted=float(good[:, 1].mean()),
            difference=float(difference.mean()),
            difference_error=float(observables.standard_errors(difference)),
            repeats=len(good),
        )


def _chi_square(law: SpeedLaw, counts: NDArray[np.int64], repeats: int) -> Comparison:
    """Pearson's chi-square per degree of freedom of a speed histogram; one if the law holds."""
    samples = int(counts.sum())
    expected = np.diff(law.shares, append=1.0) * samples
    for _ in range(2):  # from either end
        while len(expected) > 2 and expected[-1] < LEAST_EXPECTED:
            expected = np.append(expected[:-2], expected[-2:].sum())
            counts = np.append(counts[:-2], counts[-2:].sum())
        expected, counts = expected[::-1], counts[::-1]
    freedom = len(expected) - 1
    value = float(np.sum((counts - expected) ** 2 / expected)) / freedom
    numbers = math.nan, 1.0, value - 1, math.sqrt(2 / freedom)
    return Comparison(CHI_SQUARE, law.model, value, *numbers, repeats, samples)
