"""What a point's repeats measured, beside the predictions of theory."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snooker_cli import facts, theory
from snooker_cli.analysis import notes as reader_notes
from snooker_cli.analysis import observables, theories
from snooker_cli.analysis.decay import (
    Decay,
    Note,
    decays_of,
    early_notes,
)
from snooker_cli.analysis.gas import Gas, SpeedLaw, late_quarters
from snooker_cli.analysis.measurement import (
    LEAST_RELAXING,
    Measurement,
    measure,
    pairs_of,
    relaxing,
    typical_pairs,
)
from snooker_cli.analysis.quantities import (
    CHI_SQUARE,
    CRITICAL_RATIO,
    QUANTITIES,
    SPECIES_RATIO,
    SPIN_RATIO,
)
from snooker_cli.analysis.stationarity import Change, change_of, stationary_part_of
from snooker_cli.analysis.steady_means import steady_means
from snooker_cli.analysis.theories import NO_THEORY, TheoryRow, gas_kinds
from snooker_cli.formatting import plain
from snooker_cli.trace import StopReason, Trace

LEAST_EXPECTED = 8
"""Balls expected in the first and last bin of the chi-square; bins with fewer are merged."""


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
        """A row of ``compare --json``; what is not a number is null."""
        row = {"quantity": self.quantity, "unit": QUANTITIES[self.quantity].unit, **vars(self)}
        return dict(plain(row | {"difference_in_errors": self.in_errors}))


def compare(traces: Iterable[Trace]) -> tuple[list[Comparison], list[Note]]:
    """`comparisons_of` of repeats."""
    repeats = list(traces)
    measurement = measure(repeats, pairs=pairs_of(repeats), observables_of=theories.observables)
    return comparisons_of(measurement, decays_of(measurement))


def comparisons_of(
    measurement: Measurement, constants: Sequence[Decay]
) -> tuple[list[Comparison], list[Note]]:
    """A point's repeats beside every theory that applies, and notes for a reader.

    constants : the decay constants of these repeats

    Pressures, rates and speeds are those of the part of each repeat after its relaxation.
    """
    ended, scene = Counter(map(StopReason, measurement.endings)), measurement.scene
    notes, total = early_notes(ended), ended.total()
    if facts.hold(scene, "warm_walls"):
        return _in_steady_state(measurement, notes)
    moved = measurement.collisions > 0
    moving = measurement.chosen(moved)
    relaxed = moving.chosen(np.isfinite(moving.relaxed.length))
    used, relaxed_count = len(moving.time), len(relaxed.time)
    if used < total:
        which = "the repeat" if total == 1 else f"{total - used} of {total} repeats"
        notes.append(Note(f"{which} {'has' if total - used == 1 else 'have'} no collisions"))
    if not used:
        return [], notes
    if scene.number > 1:
        compared = (entry.quantity for entry in theories.holding(scene))
        means = (quantity.name for quantity in compared if quantity.source == "means")
        affected = dict.fromkeys([*means, CHI_SQUARE.name])
        notes.append(Note(_relaxation(measurement, used - relaxed_count), ", ".join(affected)))
    if relaxed_count:
        notes.append(steady_means(measurement).note)
    notes += [*reader_notes.of_scene(scene), *theories.absences(scene)]
    changes = ratio_changes(measurement).items()
    notes += [
        Note(f"{name}: {change.sentence}", name) for name, change in changes if change.refused
    ]
    fitted = {
        (decay.quantity, decay.law): np.array([fit.value for fit in decay.fits])[moved]
        for decay in constants
    }
    comparisons: list[Comparison] = []
    with np.errstate(divide="ignore", invalid="ignore"):  # rows without a value are left out
        if relaxed_count:
            rows = theories.rows(Gas(relaxed), "means", "curve", "snapshots")
            comparisons += _compared(rows, relaxed_count, notes)
            counts = relaxed.speeds.sum(axis=0)
            laws = theories.speed_laws(scene).items() if counts.any() else ()
            comparisons += [_chi_square(*law, counts, relaxed_count) for law in laws]
        comparisons += _compared(theories.rows(Gas(moving, fitted), "decay"), used, notes)
    ratio = theories.value_of(scene, CRITICAL_RATIO, theories.CRITICAL)
    if ratio is not None:
        none, name = (math.nan, math.nan, math.nan, math.nan), CRITICAL_RATIO.name
        comparisons.append(Comparison(name, theories.CRITICAL, ratio, *none, used))
        notes.append(Note(f"{name}: {theory.CRITICAL}", name))
    return _of_repeats(comparisons, measurement), notes


def ratio_changes(measurement: Measurement) -> dict[str, Change]:
    """Whether T₁/T₂ and T_rot/T_tr of a gas that no wall heats change within their means."""
    complete, changes = measurement.chosen(measurement.complete), dict[str, Change]()
    names = {entry.quantity.name for entry in theories.holding(measurement.scene)}
    if facts.hold(measurement.scene, "warm_walls"):
        return changes
    with np.errstate(divide="ignore", invalid="ignore"):
        if SPIN_RATIO.name in names:
            changes[SPIN_RATIO.name] = change_of(late_quarters(complete))
        if SPECIES_RATIO.name in names:
            changes[SPECIES_RATIO.name] = species_change(complete)
    return changes


def species_change(measurement: Measurement) -> Change:
    """Whether T₁/T₂ of these repeats changes within the part that its mean is over."""
    first, second = np.moveaxis(measurement.species_quarters, 2, 0)
    return change_of(first / second)


def state_of(measurement: Measurement) -> dict[str, Any]:
    """What findings need of a point besides its rows, as JSON.

    ``kinds`` of gas; ``stationary``: of a gas that walls keep warm, whether it has a stationary
    part, and the sentence on it; ``changes``: those of ratios of temperatures, by quantity
    """
    scene, stationary = measurement.scene, None
    if facts.hold(scene, "warm_walls"):
        part = stationary_part_of(measurement)
        stationary = {"found": part.first_window is not None, "sentence": part.note}
    changes = ratio_changes(measurement)
    return {
        "kinds": list(gas_kinds(scene)),
        "stationary": stationary,
        "changes": {name: change.as_json() for name, change in changes.items()},
    }


def _relaxation(measurement: Measurement, short: int) -> str:
    """The sentence on the relaxation; short : the number of repeats without a part after it."""
    what, number = "pressures, rates and speeds", measurement.scene.number
    if measurement.skipped is None:
        pairs = typical_pairs(zip(measurement.events[:, 1], measurement.complete, strict=True))
        needed = 2 * relaxing(number, LEAST_RELAXING)
        have = f"the repeats have {math.floor(pairs)} ball-ball collisions on average"
        return f"{what} are missing: {have}, and the relaxation needs {needed}; make the run longer"
    of_all = f"; left out: {short} of {len(measurement.time)} repeats, which are too short"
    skip = f"skip the first {measurement.skipped} ball-ball collisions of each repeat (relaxation)"
    return f"{what} {skip}{of_all * (short > 0)}"


def _in_steady_state(
    measurement: Measurement, notes: list[Note]
) -> tuple[list[Comparison], list[Note]]:
    """The comparisons of a gas that walls keep warm: in its stationary part, if there is one."""
    part = stationary_part_of(measurement)
    notes = [*notes, Note(part.note)]
    if part.first_window is None:
        return [], notes
    complete = measurement.chosen(measurement.complete)
    with np.errstate(divide="ignore", invalid="ignore"):
        rows = theories.rows(
            Gas(complete, first_window=part.first_window), "means", "curve", "snapshots"
        )
        comparisons = list(_compared(rows, len(complete.time), notes))
    notes.append(steady_means(measurement, part.first_window).note)
    notes += reader_notes.of_steady_part(complete, part.first_window)
    notes += theories.absences(measurement.scene)
    return _of_repeats(comparisons, measurement), notes


def _of_repeats(comparisons: Iterable[Comparison], measurement: Measurement) -> list[Comparison]:
    """The rows with the numbers of repeats of their point."""
    complete = int(np.count_nonzero(measurement.complete))
    total = len(measurement.time)
    return [replace(row, complete=complete, simulated=total) for row in comparisons]


def _compared(rows: Iterable[TheoryRow], repeats: int, notes: list[Note]) -> Iterator[Comparison]:
    """The rows that have a value; ``notes`` gets a sentence for each of the others."""
    for quantity, model, *columns in rows:
        values = np.array([np.broadcast_to(column, repeats) for column in columns])
        needed = values[:1] if model == NO_THEORY else values
        good = values[:, np.all(np.isfinite(needed), axis=0)]
        if not good.size:
            known = bool(np.any(np.isfinite(values[0])))
            name, why = quantity.name, quantity.unmeasured
            if known:
                why = "the theory has no value here"
            if why:
                notes.append(Note(f"{name} ({model}) is missing: {why}", name, model))
            continue
        difference = good[0] - good[1]
        yield Comparison(
            quantity.name,
            model,
            *observables.mean_and_error(good[0]),
            predicted=float(good[1].mean()),
            difference=float(difference.mean()),
            difference_error=float(observables.standard_errors(difference)),
            repeats=len(difference),
        )


def _chi_square(model: str, law: SpeedLaw, counts: NDArray[np.int64], repeats: int) -> Comparison:
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
    return Comparison(CHI_SQUARE.name, model, value, *numbers, repeats, samples)
