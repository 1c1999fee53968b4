"""The repeats of a point -> decay constants of energy, temperature and pressure.

Every repeat is fitted by itself, and the constants are averaged.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snooker_cli import theory
from snooker_cli.analysis import observables
from snooker_cli.analysis.fitting import (
    LAWS,
    LEAST_PROBABILITY,
    Curves,
    FitResult,
    Goodness,
    Range,
    RepeatMean,
    Samples,
    fit_all,
    goodness,
    mean_over_repeats,
    ranges,
)
from snooker_cli.analysis.measurement import (
    ENERGY,
    POINTS,
    PRESSURE,
    SKIPPED_COLLISIONS,
    TEMPERATURE,
    WINDOWS,
    Measurements,
    measure,
)
from snooker_cli.analysis.observables import after_collisions, elastic, over_first
from snooker_cli.formatting import listed, plain, short
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import Series, StopReason, Trace

Array = NDArray[np.float64]

COLLISION_ROUNDING = 8 * EPSILON
"""Relative error of the energy of elastic balls per collision: twice that of four roundings."""


class Curve(NamedTuple):
    """The decay of a quantity in a repeat: times (s) and values over the first."""

    time: Array
    value: Array


@dataclass(frozen=True)
class Quantity:
    """A quantity whose decay is fitted.

    course : a repeat -> its values after each collision or in windows of time
    column : of the curves of ``Measurements``; ``None`` if means in windows are fitted
    starts_at_one : whether the fit holds the amplitude at 1, at the first of the times
    is_mean : whether it is a mean since the start, which follows a law's ``mean_model``
    is_judged : whether its laws are judged
    laws : that are fitted
    """

    course: Callable[[Trace], Curve]
    column: int | None = None
    starts_at_one: bool = False
    is_mean: bool = False
    is_judged: bool = False
    laws: tuple[str, ...] = tuple(LAWS)


def _from_start(values: Callable[[Series], Array]) -> Callable[[Trace], Curve]:
    """The course of a quantity that only collisions change."""

    def course(trace: Trace) -> Curve:
        columns = after_collisions(trace)
        return Curve(columns.time, over_first(values(columns)))

    return course


def _pressure(trace: Trace) -> Curve:
    columns = after_collisions(trace)
    settled = (columns.wall_events + columns.pair_events >= SKIPPED_COLLISIONS)[columns.time > 0]
    time, values = observables.cumulative_pressure(trace, columns)
    return Curve(time[settled], over_first(values[settled]))


def _in_windows(means: Callable[[Trace, Array], Array]) -> Callable[[Trace], Curve]:
    """Means between the edges of equal windows; none for fewer collisions than windows."""

    def course(trace: Trace) -> Curve:
        enough = trace.collisions >= WINDOWS and trace.stop.time > 0
        edges = np.linspace(0.0, trace.stop.time, WINDOWS + 1)[: None if enough else 0]
        return Curve((edges[:-1] + edges[1:]) / 2, means(trace, edges))

    return course


def _local_pressures(trace: Trace, edges: Array) -> Array:
    return over_first(observables.pressures(trace, edges))


def _local_energies(trace: Trace, edges: Array) -> Array:
    ratio = observables.energy_ratio(observables.series(trace))
    return observables.time_means(trace, ratio, edges)


QUANTITIES: dict[str, Quantity] = {
    "kinetic_energy": Quantity(
        _from_start(observables.energy_ratio), ENERGY, starts_at_one=True, is_judged=True
    ),
    "temperature": Quantity(
        _from_start(lambda columns: columns.kinetic_energy),
        TEMPERATURE,
        starts_at_one=True,
        is_judged=True,
    ),
    "pressure": Quantity(_pressure, PRESSURE, is_mean=True, is_judged=True),
    "pressure_amplitude_1": Quantity(  # as in the source report
        _pressure, PRESSURE, starts_at_one=True, is_mean=True, laws=("exponential",)
    ),
    "local_pressure": Quantity(_in_windows(_local_pressures)),
    "local_energy": Quantity(_in_windows(_local_energies)),
}
"""Every quantity that is fitted, by its name in the rows of ``snooker fit --json``."""

FURTHER = "temperature", "pressure_amplitude_1"  # only --all prints these

SAMPLING = (
    f"A fit uses at most {POINTS} points of a repeat, which stand for all its collisions. "
    f'"Local" means averages over {WINDOWS} windows of time. '
    "The pressure is a mean since the start; for Haff's law its fit is A/(1 + αt). "
    f"Models: {'; '.join(f'{name} {model.formula}' for name, model in LAWS.items())}."
)
"""What a reader of fits has to know."""

JUDGEMENT = (
    "p is the probability that a law which holds deviates as much from ln y in windows of time "
    "(Hotelling's test over the complete repeats, three or more). "
    f"A law is refused where p is below {LEAST_PROBABILITY:g}. "
    '"Holds" is the time until which the law is not refused, out of the judged time. "End/fit" is '
    "the value at the end over the fit. Local quantities are not judged."
)
"""What a reader of the judgement of a law has to know."""

NO_LOSSES = "All collisions are elastic, so nothing decays."

WARM = (
    "Walls give energy, so the gas does not cool down and has no decay constants; "
    "`snooker compare` has its stationary state."
)


class Note(NamedTuple):
    """A sentence for a reader, with names of the rows that it is about; empty if all."""

    note: str
    quantity: str = ""
    model: str = ""


@dataclass(frozen=True)
class Decay:
    """A decay constant of a point: over its repeats, and how well the law fits.

    quantity, law : names in ``QUANTITIES`` and ``LAWS``
    held : whether the fits hold the amplitude at 1
    ended : number of repeats by their stop reason
    walls : whether the container has walls; without them, pressures are the virial's
    elastic : whether no collision loses energy, so that nothing is fitted
    warm : the same if walls give energy
    fits : of each repeat
    judged : gives the ranges in which the law is judged; and the fits of the repeats that count
    """

    quantity: str
    law: str
    held: bool
    over_repeats: RepeatMean
    ended: Mapping[StopReason, int]
    walls: bool
    elastic: bool
    warm: bool
    fits: tuple[FitResult, ...]
    judged: tuple[Callable[[], list[Range]], list[FitResult]] = field(compare=False, repr=False)

    @cached_property
    def goodness(self) -> Goodness:
        """How well the law describes the logarithms; computed when it is first read."""
        judged, fits = self.judged
        return goodness(judged(), fits)

    @property
    def short(self) -> int:
        """Number of repeats that stopped before the requested end."""
        return sum(self.ended.values()) - number_complete(self.ended)

    @property
    def reason(self) -> str | None:
        """Why fits failed, the most frequent reason first; ``None`` if none has."""
        reasons = Counter(result.message for result in self.fits if not result.converged)
        return " ".join(message for message, _ in reasons.most_common()) or None

    def as_json(self) -> dict[str, Any]:
        """A row of ``snooker fit --json``; ``value`` ± ``error``: the mean, its standard error."""
        row = {
            "quantity": self.quantity,
            "model": self.law,
            "amplitude": "fixed at 1" if self.held else "free",
            **vars(self.over_repeats),
            "unit": "s-1",
            "short": self.short,
            "complete": number_complete(self.ended),
            "reason": self.reason,
            "elastic": self.elastic,
            **vars(self.goodness),
        }
        return dict(plain(row))


def range_held(row: Mapping[str, Any]) -> str:
    """``1.5/6.1``: until when the law of a row of fits holds, of the judged time (s)."""
    holds, end = short(row["holds_to"]), short(row["judged_to"])
    return "–" if holds == "–" else f"{holds}/{end}"


def reported_constant(trace: Trace) -> float:
    """The source report's decay constant of the energy for a repeat (1/s), equations 6 and 7.

    The speed is `observables.mean_speed`, with its nan. nan also at CoR 0, and for unequal balls.
    """
    return float(reported_constants(trace.start, np.array([observables.mean_speed(trace)]))[0])


def reported_constants(scene: Scene, speeds: Array) -> Array:
    """`reported_constant` of repeats with these mean speeds of the balls, m/s; 1/s."""
    if scene.restitution == 0 or not (scene.equal_balls and scene.constant_laws):
        return np.full_like(speeds, math.nan)
    density = scene.number / scene.container.area
    path = theory.source_mean_free_path(density, float(scene.radii[0]))
    return theory.source_decay_constant(scene.restitution, path, speeds)


def curve(trace: Trace, quantity: str) -> Curve:
    """The decay of a quantity in a repeat, after each collision. Raises ``KeyError``."""
    return QUANTITIES[quantity].course(trace)


def repeat_fits(trace: Trace, quantity: str) -> dict[str, FitResult]:
    """The fits of a quantity in a repeat, by law. Raises ``KeyError`` for an unknown quantity."""
    return {decay.law: decay.fits[0] for decay in decays([trace], (quantity,))}


def decays(
    traces: Iterable[Trace],
    quantities: Sequence[str] = tuple(QUANTITIES),
    since: float = 0.0,
    until: float = math.inf,
) -> list[Decay]:
    """Decay constants over the repeats of a point, for each quantity and law.

    since, until : the times (s) that are fitted
    Laws are judged on complete repeats, if there are three or more, else on all.
    Raises ``KeyError`` for an unknown quantity.
    """
    return measured_decays(measure(traces, since, until), quantities, since, until)


def measured_decays(
    measured: Measurements,
    quantities: Sequence[str] = tuple(QUANTITIES),
    since: float = 0.0,
    until: float = math.inf,
) -> list[Decay]:
    """`decays` of repeats that are measured between the same times."""
    scene, complete = measured.scene, measured.complete
    judged = complete if np.count_nonzero(complete) > 2 else np.ones_like(complete)
    ended = Counter(StopReason(ending) for ending in measured.endings)
    result = []
    for name in quantities:
        quantity, curves = QUANTITIES[name], _curves(measured, name, since, until)
        held = quantity.starts_at_one and since == 0
        samples = Samples(np.empty((0, 0)), np.empty((0, 0)), np.empty(0, np.int64))
        if quantity.is_judged and not (elastic(scene) or scene.wall_law.gains):
            time, logarithm = np.moveaxis(measured.samples[judged, quantity.column], 1, 0)
            samples = Samples(time, logarithm, measured.numbers[judged, quantity.column])
        judging = cache(partial(ranges, samples))  # for all laws once
        for law in quantity.laws:
            fits = _fits(curves, quantity, law, held, scene)
            chosen = [fit for fit, counts in zip(fits, judged, strict=True) if counts]
            over, walls = mean_over_repeats(fits), scene.container.has_wall
            facts = held, over, ended, walls, elastic(scene), scene.wall_law.gains, tuple(fits)
            result.append(Decay(name, law, *facts, (judging, chosen)))
    return result


def _curves(measured: Measurements, name: str, since: float, until: float) -> Curves:
    """The points of the repeats that are fitted, of curves or of windows of time."""
    quantity = QUANTITIES[name]
    if quantity.column is None:
        pressure = measured.windows.pressure(measured.scene)
        firsts = pressure[np.arange(len(pressure)), np.argmax(pressure > 0, axis=1)]
        value = pressure / np.where(firsts > 0, firsts, 1.0)[:, np.newaxis]
        if name == "local_energy":
            scale = np.where(measured.first_energy > 0, measured.first_energy, 1.0)
            value = measured.windows.total_energy / scale[:, np.newaxis]
        centres = np.arange(0.5, WINDOWS) / WINDOWS
        time: Array = measured.time[:, np.newaxis] * centres
        enough = (measured.collisions >= WINDOWS) & (measured.time > 0)
        inside = enough[:, np.newaxis] & (time >= since) & (time <= until)
        weight = np.where(inside, 1.0, 0.0)
        first = time[np.arange(len(time)), np.argmax(inside, axis=1)]
    else:
        weight, time, value = (measured.points[:, quantity.column, row] for row in range(3))
        # The first sample is the curve's first row; a point may lie beside it.
        first = measured.samples[:, quantity.column, 0, 0]
    used = weight > 0
    starts = np.cumsum([0, *used.sum(axis=1)])
    rounding = COLLISION_ROUNDING * measured.collisions.astype(np.float64)
    return Curves(starts, first, time[used], value[used], weight[used], rounding)


def _fits(
    curves: Curves, quantity: Quantity, law: str, held: bool, scene: Scene
) -> list[FitResult]:
    """The fits of a law to the curves of a quantity; a mean since the start has its mean model."""
    model = LAWS[law]
    if elastic(scene) or scene.wall_law.gains:
        why = WARM if scene.wall_law.gains else NO_LOSSES
        return [FitResult(law, False, why, n, math.nan) for n in curves.numbers().tolist()]
    name = (quantity.is_mean and model.mean_model) or law
    return fit_all(
        curves, name, amplitude=1.0 if held else None, start=0.0 if model.power else None
    )


def fit_notes(constants: Sequence[Decay]) -> list[Note]:
    """Notes for a reader of a point's decay constants."""
    notes, total = early_notes(constants[0].ended), len(constants[0].fits)
    if constants[0].elastic:
        return [*notes, Note(NO_LOSSES)]
    if constants[0].warm:
        return [*notes, Note(WARM)]
    if not constants[0].walls:
        notes.append(Note(observables.NO_WALLS, "pressure, local_pressure"))
        notes.append(Note("Haff's law is for a gas without clusters", model="haff"))
    failures: dict[tuple[str, int], list[str]] = {}
    for decay in constants:
        if decay.reason is not None and decay.quantity not in FURTHER:
            same = failures.setdefault((decay.reason, decay.over_repeats.failed), [])
            same.append(decay.quantity)
    for (reason, failed), quantities in failures.items():
        names = listed([name.replace("_", " ") for name in dict.fromkeys(quantities)])
        of = f" in {failed} of {total} repeats" if total > 1 else ""
        notes.append(Note(f"no fit of {names}{of}: {reason}", names))
    return notes


_EARLY = {
    StopReason.WALL_TRAP: "in a wall trap",
    StopReason.COLLAPSE: "in a collapse",
    StopReason.NOTHING_LEFT: "with no collision ahead",
    StopReason.IDLE: "without a collision for very long",
    StopReason.INTERRUPTED: "at an interruption",
}
"""Why a repeat stops before the requested collisions or time."""


def early_endings(
    ended: Mapping[StopReason, int], reasons: Iterable[StopReason] = tuple(_EARLY)
) -> str:
    """How many repeats ended early, for which of these reasons; empty if none did."""
    counts = {_EARLY[reason]: ended[reason] for reason in reasons if ended.get(reason)}
    if not counts:
        return ""
    short, total = sum(counts.values()), sum(ended.values())
    which = "the repeat" if total == 1 else f"{short} of {total} repeats"
    endings = [words if len(counts) == 1 else f"{count} {words}" for words, count in counts.items()]
    return f"{which} ended early, {listed(endings)}"


def early_notes(ended: Mapping[StopReason, int]) -> list[Note]:
    """How many repeats miss collisions that could have happened; empty if none do."""
    endings = early_endings(ended, [reason for reason in _EARLY if not reason.complete])
    what = "averages over collisions leave them out, the rest uses them to their end"
    return [Note(f"{endings}; {what}")] if endings else []


def number_complete(ended: Mapping[StopReason, int]) -> int:
    """Number of repeats that reached their requested end, of all that `ended` counts."""
    return sum(number for reason, number in ended.items() if reason.complete)
