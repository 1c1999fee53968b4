"""The repeats of a point -> decay constants of energy, temperature and pressure.

Every repeat is fitted by itself, and the constants are averaged.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snooker_cli import theory
from snooker_cli.analysis import observables
from snooker_cli.analysis.fitting import (
    LAWS,
    LEAST_PROBABILITY,
    MOST_VALUES,
    FitResult,
    Goodness,
    RepeatMean,
    fit_all,
    goodness,
    mean_over_repeats,
)
from snooker_cli.analysis.observables import after_collisions, elastic, over_first, so_far
from snooker_cli.formatting import listed, plain, short
from snooker_cli.memory import MEMORY
from snooker_cli.scene import EPSILON
from snooker_cli.trace import Series, StopReason, Trace

Array = NDArray[np.float64]
TimeCourse = tuple[Array, Array]

SKIPPED_COLLISIONS = 50
"""Collisions before the cumulative pressure is fitted, as in the source report: it starts at 0."""

WINDOWS = 20  # windows of time for the local pressure and energy

COLLISION_ROUNDING = 8 * EPSILON
"""Relative error of the energy of elastic balls per collision: twice that of four roundings."""


@dataclass(frozen=True)
class Quantity:
    """A quantity whose decay is fitted.

    course : a repeat -> times (s) and values over the first
    at : a repeat and times -> values there, in any unit; ``None`` if no law is judged
    starts_at_one : whether the fit holds the amplitude at 1, at the first of the times
    is_mean : whether it is a mean since the start, which follows a law's ``mean_model``
    laws : that are fitted
    """

    course: Callable[[Trace], TimeCourse]
    at: Callable[[Trace, Array], Array] | None = None
    starts_at_one: bool = False
    is_mean: bool = False
    laws: tuple[str, ...] = tuple(LAWS)


def _from_start(column: Callable[[Series], Array]) -> Quantity:
    """A quantity that only collisions change, as a column of the series."""

    def course(trace: Trace) -> TimeCourse:
        columns = after_collisions(trace)
        return columns.time, over_first(column(columns))

    def at(trace: Trace, times: Array) -> Array:
        return so_far(trace, column(observables.series(trace)), times)

    return Quantity(course, at, starts_at_one=True)


def _pressure(trace: Trace) -> TimeCourse:
    columns = after_collisions(trace)
    settled = (columns.wall_events + columns.pair_events >= SKIPPED_COLLISIONS)[columns.time > 0]
    time, values = observables.cumulative_pressure(trace, columns)
    return time[settled], over_first(values[settled])


def _pressure_at(trace: Trace, times: Array) -> Array:
    edges = np.append(0.0, times)
    return np.cumsum(observables.pressures(trace, edges) * np.diff(edges)) / times


def _in_windows(means: Callable[[Trace, Array], Array]) -> Callable[[Trace], TimeCourse]:
    """Means between the edges of equal windows; none for fewer collisions than windows."""

    def course(trace: Trace) -> TimeCourse:
        some = trace.collisions >= WINDOWS and trace.stop.time > 0
        edges = np.linspace(0.0, trace.stop.time, WINDOWS + 1)[: None if some else 0]
        return (edges[:-1] + edges[1:]) / 2, means(trace, edges)

    return course


def _local_pressures(trace: Trace, edges: Array) -> Array:
    return over_first(observables.pressures(trace, edges))


def _local_energies(trace: Trace, edges: Array) -> Array:
    ratio = observables.energy_ratio(observables.series(trace))
    return observables.time_means(trace, ratio, edges)


QUANTITIES: dict[str, Quantity] = {
    "kinetic_energy": _from_start(observables.energy_ratio),
    "temperature": _from_start(lambda columns: columns.kinetic_energy),
    "pressure": Quantity(_pressure, _pressure_at, is_mean=True),
    "pressure_amplitude_1": Quantity(  # as in the source report
        _pressure, starts_at_one=True, is_mean=True, laws=("exponential",)
    ),
    "local_pressure": Quantity(_in_windows(_local_pressures)),
    "local_energy": Quantity(_in_windows(_local_energies)),
}
"""Every quantity that is fitted, by its name in ``fit.json``."""

FURTHER = "temperature", "pressure_amplitude_1"  # only --all prints these

SAMPLING = (
    "Fits use every collision (fewer in long runs; summaries are interpolated). "
    f'"Local" means averages over {WINDOWS} windows of time. '
    "The pressure is a mean since the start; for Haff's law its fit is A/(1 + αt). "
    f"Models: {'; '.join(f'{name} {model.formula}' for name, model in LAWS.items())}."
)
"""What a reader of fits has to know."""

JUDGEMENT = (
    "p is the probability that a law which holds deviates as much from ln y in windows of time "
    "(Hotelling's test over the complete repeats, three or more). "
    f"A law is refused where p is below {LEAST_PROBABILITY:g}. "
    '"Holds" is the time until which the law holds, out of the judged time. "End/fit" is '
    "the value at the end over the fit. Local quantities are not judged."
)
"""What a reader of the judgement of a law has to know."""

NO_LOSSES = "All collisions are elastic, so nothing decays."


class Note(NamedTuple):
    """A sentence for a reader, with names of the rows that it is about; empty if all."""

    note: str
    quantity: str = ""
    model: str = ""


@dataclass(frozen=True)
class Curve:
    """The decay of a quantity in one repeat: times (s), values over the first, their rounding.

    held : whether the fit holds the amplitude at 1
    elastic : whether no collision loses energy, so that any constant is noise
    """

    quantity: Quantity
    time: Array
    value: Array
    rounding: float
    held: bool
    elastic: bool = False


@dataclass(frozen=True)
class Decay:
    """A decay constant of a point: over its repeats, and how well the law fits.

    quantity, law : names in ``QUANTITIES`` and ``LAWS``
    held : whether the fits hold the amplitude at 1
    ended : number of repeats by their stop reason
    walls : whether the container has walls; without them, pressures are the virial's
    elastic : whether no collision loses energy, so that nothing is fitted
    fits : of each repeat
    judged : times (s) and ln y of each repeat that is judged, and its fit
    """

    quantity: str
    law: str
    held: bool
    over_repeats: RepeatMean
    ended: Mapping[StopReason, int]
    walls: bool
    elastic: bool
    fits: tuple[FitResult, ...]
    judged: tuple[list[TimeCourse], list[FitResult]] = field(compare=False, repr=False)

    @cached_property
    def goodness(self) -> Goodness:
        """How well the law describes the logarithms; computed when it is first read."""
        return goodness(*self.judged)

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
        """A row of ``fit.json``: ``value`` ± ``error`` are the mean and its standard error."""
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
    """``1.5/6.1``: until when the law of a row of ``fit.json`` holds, of the judged time (s)."""
    holds, end = short(row["holds_to"]), short(row["judged_to"])
    return "–" if holds == "–" else f"{holds}/{end}"


def reported_constant(trace: Trace) -> float:
    """The source report's decay constant of the energy for a repeat (1/s), equations 6 and 7.

    The speed is `observables.mean_speed`, with its nan. nan also at CoR 0, and for unequal balls.
    """
    scene, speed = trace.start, observables.mean_speed(trace)
    if scene.restitution == 0 or not (scene.equal_balls and scene.constant_laws):
        return math.nan
    density = scene.number / scene.container.area
    path = theory.source_mean_free_path(density, float(scene.radii[0]))
    return theory.source_decay_constant(scene.restitution, path, speed)


def curve(trace: Trace, quantity: str, since: float = 0.0, until: float = math.inf) -> Curve:
    """The decay of a quantity in one repeat, between two times (s).

    The values are over the first one of the repeat. From a later time on, the amplitude is free.
    Raises ``KeyError`` for an unknown quantity.
    """
    known = QUANTITIES[quantity]
    time, value = known.course(trace)
    kept = (time >= since) & (time <= until)
    rounding, held = COLLISION_ROUNDING * trace.collisions, known.starts_at_one and since == 0
    return Curve(known, time[kept], value[kept], rounding, held, elastic(trace.start))


def fit_curves(curves: Sequence[Curve], law: str) -> list[FitResult]:
    """Fit a point's curves of a quantity with a law; a mean since the start with its mean model."""
    model, first = LAWS[law], curves[0]
    if first.elastic:
        lengths = (len(decaying.time) for decaying in curves)
        return [FitResult(law, False, NO_LOSSES, length, math.nan) for length in lengths]
    return fit_all(
        [(decaying.time, decaying.value, decaying.rounding) for decaying in curves],
        (first.quantity.is_mean and model.mean_model) or law,
        amplitude=1.0 if first.held else None,
        start=0.0 if model.has_pole else None,
    )


def repeat_fits(trace: Trace, quantity: str) -> dict[str, FitResult]:
    """The fits of a repeat's ``curve`` by law, made once."""
    whole = curve(trace, quantity)
    return _fitted([trace], [whole], quantity, 0.0, math.inf)[0]


def _fitted(
    traces: Sequence[Trace], curves: Sequence[Curve], *key: Any
) -> list[dict[str, FitResult]]:
    """The fits of repeats' curves by law, together and made once; ``key`` says which curves."""
    fits = [MEMORY.find(("fits", key), trace) for trace in traces]
    new = [row for row, known in enumerate(fits) if known is None]
    if new:
        chosen, laws = [curves[row] for row in new], curves[0].quantity.laws
        results = zip(*(fit_curves(chosen, law) for law in laws), strict=True)
        for row, by_law in zip(new, results, strict=True):
            fits[row] = dict(zip(laws, by_law, strict=True))
            MEMORY.keep(("fits", key), fits[row], traces[row])
    return fits


def _logarithms(trace: Trace, decaying: Curve) -> TimeCourse:
    """Times and ln y between the rows of a curve; empty if it is not judged.

    The rows are just after collisions, where the energy is less than around them.
    """
    if decaying.quantity.at is None or decaying.elastic or len(decaying.time) < 3:
        return np.empty(0), np.empty(0)
    rows = observables.instants(decaying.time)
    time = decaying.time[rows]
    time = np.concatenate([time[:1], (time[:-1] + time[1:]) / 2])
    with np.errstate(divide="ignore", invalid="ignore"):
        values = np.log(decaying.quantity.at(trace, time))
        values += np.log(decaying.value[rows[0]]) - values[0]
    good = np.isfinite(values)
    return time[good], values[good]


def _together(traces: Iterable[Trace]) -> Iterator[list[Trace]]:
    """The repeats in lists: as many as are fitted at once, and fit in memory."""
    some: list[Trace] = []
    values = 0
    for trace in traces:
        some.append(trace)
        values += trace.collisions + 1
        if values >= MOST_VALUES:
            yield some
            some, values = [], 0
    if some:
        yield some


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
    reasons: list[StopReason] = []
    walls = lossless = True
    fits: dict[str, list[dict[str, FitResult]]] = {name: [] for name in quantities}
    curves: dict[str, list[TimeCourse]] = {name: [] for name in quantities}
    for some in _together(traces):
        reasons += [trace.stop.reason for trace in some]
        walls, lossless = some[0].start.container.has_wall, elastic(some[0].start)
        for name in quantities:
            decaying = [curve(trace, name, since, until) for trace in some]
            curves[name] += map(_logarithms, some, decaying)
            fits[name] += _fitted(some, decaying, name, since, until)
    judged = [row for row, reason in enumerate(reasons) if reason.complete]
    judged = judged if len(judged) > 2 else list(range(len(reasons)))
    ended, result = Counter(reasons), []
    for name, law in [(key, law) for key in quantities for law in QUANTITIES[key].laws]:
        results = tuple(by_law[law] for by_law in fits[name])
        chosen = [curves[name][row] for row in judged], [results[row] for row in judged]
        held, over = QUANTITIES[name].starts_at_one and since == 0, mean_over_repeats(results)
        result.append(Decay(name, law, held, over, ended, walls, lossless, results, chosen))
    return result


def analyse(
    traces: Iterable[Trace], since: float = 0.0, until: float = math.inf
) -> tuple[list[Decay], list[Note]]:
    """All decay constants of a point, and notes for a reader."""
    constants = decays(traces, since=since, until=until)
    notes, total = early_notes(constants[0].ended), len(constants[0].fits)
    if constants[0].elastic:
        return constants, [*notes, Note(NO_LOSSES)]
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
    return constants, notes


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
