"""What a point's repeats measured, beside the predictions of theory."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.analysis import observables, predictions
from snooker_cli.analysis.decay import curve, early_note, fit_curve, reported_constant
from snooker_cli.analysis.observables import series
from snooker_cli.analysis.predictions import Prediction, SpeedLaw
from snooker_cli.formatting import plain
from snooker_cli.trace import SPEED_BINS, StopReason

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

    Array = NDArray[np.float64]

RELAXING = 5
"""Ball-ball collisions of a ball after which a gas that started at one speed counts as relaxed.

The kurtosis of its speeds has then come from 1 to 1.83 of 1.95.
"""

LEAST_EXPECTED = 8
"""Balls expected in the first and last bin of the chi-square; bins with fewer are merged."""

CHI_SQUARE = "χ² of the speed distribution, per degree of freedom"

UNITS = {
    "pressure": "Pa m",
    "temperature": "J",
    "wall rate of a ball": "1/s",
    "ball-ball rate of a ball": "1/s",
    "mean free path": "m",
    "decay constant of energy": "1/s",
    "decay constant of pressure": "1/s",
    "Haff's α": "1/s",
    "mean speed": "m/s",
}
"""Units of the quantities that have one."""


@dataclass(frozen=True)
class Comparison:
    """A measured quantity beside a prediction, both means over the repeats.

    error : standard error of the measured mean
    difference, difference_error : of measured less predicted, repeat by repeat, because many
        predictions follow the repeat's own temperature
    samples : speeds behind a distribution; ``None`` for a mean over the repeats
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

    @property
    def in_errors(self) -> float:
        """The difference in standard errors; nan if the repeats agree but for rounding."""
        if not self.difference_error > observables.ROUNDING * max(
            abs(self.measured), abs(self.predicted)
        ):
            return math.nan
        return self.difference / self.difference_error

    def as_json(self) -> dict[str, Any]:
        """A row of ``compare.json``; what is not a number is null."""
        first = {"quantity": self.quantity, "unit": UNITS.get(self.quantity, "1")}
        content: dict[str, Any] = plain(
            first | vars(self) | {"difference_in_errors": self.in_errors}
        )
        return content


def measured(trace: Trace, since: float) -> dict[str, float]:
    """Means over time of one repeat from a time (s) to its end.

    pressure : on the wall, or by the virial, Pa m; virial_ratio : PV/NT of the balls by the virial
    temperature, root_temperature : of T and of its root, J and J^(1/2)
    meeting_temperature, root_meeting_temperature : the same of the temperature at which balls meet
    mean_speed : m/s; kurtosis : <v^4>/<v^2>^2
    pair_rate, wall_rate : collisions of one ball per second
    """
    found, scene = series(trace), trace.start
    warm = observables.temperature(found, scene.number)
    met = observables.meeting_temperature(found.kinetic_energy, scene)

    def mean(values: Array) -> float:
        return observables.time_mean(trace, values, since)

    def rate(counts: Array) -> float:
        gained = observables.gained(trace, counts, since)
        return gained / (scene.number * (trace.stop.time - since))

    return {
        "pressure": observables.mean_pressure(trace, since),
        "virial_ratio": observables.virial_ratio(trace, since),
        "temperature": mean(warm),
        "root_temperature": mean(np.sqrt(warm)),
        "meeting_temperature": mean(met),
        "root_meeting_temperature": mean(np.sqrt(np.maximum(met, 0.0))),
        "mean_speed": mean(found.mean_speed),
        "kurtosis": mean(found.energy_moment),
        "pair_rate": 2 * rate(found.pair_events),
        "wall_rate": rate(found.wall_events),
    }


def lost(trace: Trace) -> dict[str, float]:
    """How one repeat lost its energy, from start to end.

    decay_constant, pressure_decay_constant, haff_rate : fitted, 1/s
    reported_constant : what the source report predicts for the first, 1/s
    start_temperature : at which balls meet, J
    pair_events, wall_events : collisions, without those of a collapse
    energy_left : kinetic energy after them over that at the start
    """
    energy, calm = curve(trace, "kinetic_energy"), observables.before_collapse(trace)
    start = trace.start
    return {
        "decay_constant": fit_curve(energy, "exponential").value,
        "pressure_decay_constant": fit_curve(curve(trace, "pressure"), "exponential").value,
        "haff_rate": fit_curve(energy, "haff").value,
        "reported_constant": reported_constant(trace),
        "start_temperature": observables.meeting_temperature(start.kinetic_energy, start),
        "pair_events": calm.pair_events,
        "wall_events": calm.wall_events,
        "energy_left": float(observables.energy_ratio(series(calm))[-1]),
    }


def relaxing(number: int) -> int:
    """Ball-ball collisions in which a gas of ``number`` balls relaxes; none for one ball."""
    return math.ceil(RELAXING * number / 2) if number > 1 else 0


def relaxed_at(trace: Trace) -> float | None:
    """When a repeat has relaxed, s; ``None`` if fewer than as many collisions follow."""
    needed, found = relaxing(trace.start.number), series(trace)
    if trace.pair_events < 2 * needed:
        return None
    time = float(found.time[np.searchsorted(found.pair_events, needed)])
    return time if time < trace.stop.time else None


def compare(traces: Iterable[Trace]) -> tuple[list[Comparison], list[str]]:
    """A point's repeats beside every theory that applies, and notes for a reader, in sentences.

    Pressures, rates and speeds are those of the part of each repeat after its relaxation.
    """
    ended: Counter[StopReason] = Counter()
    relaxed: list[dict[str, float]] = []
    losses: list[dict[str, float]] = []
    counts = np.zeros(SPEED_BINS, dtype=np.int64)
    scene: Scene | None = None
    for trace in traces:
        ended[trace.stop.reason] += 1
        if trace.collisions == 0:
            continue
        scene = trace.start
        losses.append(lost(trace))
        calm = observables.before_collapse(trace)
        since = relaxed_at(calm)
        if since is not None:
            relaxed.append(measured(calm, since))
            counts += observables.reduced_speed_counts(calm, since)
    notes, total = [early_note(ended)], ended.total()
    idle = total - len(losses)
    if idle:
        which = "the repeat" if total == 1 else f"{idle} of {total} repeats"
        notes.append(f"{which} {'has' if idle == 1 else 'have'} no collisions")
    rows: list[Comparison] = []
    if scene is not None:
        notes.append(_relaxation_note(relaxing(scene.number), len(losses), len(relaxed)))
        notes += [predictions.shape_note(scene), predictions.missing_note(scene)]
        with np.errstate(divide="ignore", invalid="ignore"):  # rows without a value are left out
            if relaxed:
                means = _columns(relaxed)
                rows += _rows(predictions.hard_disks(scene, means), notes)
                rows += _rows(predictions.speeds(scene, means), notes)
            if counts.any():
                laws = predictions.speed_laws(scene)
                rows += [_chi_square(law, counts, len(relaxed)) for law in laws]
            rows += _rows(predictions.cooling(scene, _columns(losses)), notes)
    return rows, list(filter(None, notes))


def _columns(repeats: list[dict[str, float]]) -> dict[str, Array]:
    """Each measured quantity over the repeats."""
    return {name: np.array([float(one[name]) for one in repeats]) for name in repeats[0]}


def _rows(found: Iterable[Prediction], notes: list[str]) -> Iterator[Comparison]:
    """The predictions that have a value; a note for each of the others."""
    for quantity, model, values, prediction in found:
        predicted = np.broadcast_to(prediction, values.shape)
        good = np.isfinite(values) & np.isfinite(predicted)
        if not np.any(good):
            known = bool(np.any(np.isfinite(values)))
            why = "the theory has no value here" if known else "it could not be measured"
            notes.append(f"{quantity} ({model}) is missing: {why}")
            continue
        difference = (values - predicted)[good]
        yield Comparison(
            quantity,
            model,
            *observables.mean_and_error(values[good]),
            predicted=float(predicted[good].mean()),
            difference=float(difference.mean()),
            difference_error=float(observables.standard_errors(difference)),
            repeats=len(difference),
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
    return Comparison(
        quantity=CHI_SQUARE,
        model=law.model,
        measured=value,
        error=math.nan,
        predicted=1.0,
        difference=value - 1,
        difference_error=math.sqrt(2 / freedom),
        repeats=repeats,
        samples=samples,
    )


def _relaxation_note(needed: int, repeats: int, relaxed: int) -> str:
    """Which collisions the means over time skip, and how many repeats are too short for them."""
    if not needed:
        return ""
    if relaxed == repeats:
        return (
            f"pressures, rates and speeds skip the first {needed} ball-ball collisions (relaxation)"
        )
    which = "the repeat is" if repeats == 1 else f"{repeats - relaxed} of {repeats} repeats are"
    return (
        f"{which} too short for pressures, rates and speeds: {2 * needed} ball-ball collisions "
        f"are needed ({needed} for the relaxation)"
    )
