"""The repeats of a point -> decay constants of energy, temperature and pressure.

Every repeat is fitted by itself, and the constants are averaged.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property, partial
from itertools import compress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snooker_cli import facts, theory
from snooker_cli.analysis import observables
from snooker_cli.analysis.fitting import (
    LAWS,
    FitResult,
    Points,
    RepeatMean,
    fit_all,
    mean_over_repeats,
)
from snooker_cli.analysis.goodness import (
    LEAST_PROBABILITY,
    Goodness,
    Range,
    Samples,
    goodness,
    ranges,
)
from snooker_cli.analysis.measurement import WINDOWS, Measurement, measure
from snooker_cli.analysis.time_series import ROWS
from snooker_cli.facts import traits_of
from snooker_cli.formatting import listed, plain
from snooker_cli.scene import EPSILON
from snooker_cli.trace import StopReason, Trace

Array = NDArray[np.float64]

COLLISION_ROUNDING = 8 * EPSILON
"""Relative error of the energy of elastic balls per collision: twice that of four roundings."""


@dataclass(frozen=True)
class Quantity:
    """A quantity whose decay is fitted.

    starts_at_one : whether the fit holds the amplitude at 1, at the first of the times
    is_mean : whether it is a mean since the start, which follows a law's ``mean_model``
    is_judged : whether its laws are judged
    laws : that are fitted
    """

    starts_at_one: bool = False
    is_mean: bool = False
    is_judged: bool = False
    laws: tuple[str, ...] = tuple(LAWS)


QUANTITIES: dict[str, Quantity] = {
    "kinetic_energy": Quantity(starts_at_one=True, is_judged=True),
    "temperature": Quantity(starts_at_one=True, is_judged=True),
    "pressure": Quantity(is_mean=True, is_judged=True),
    "pressure_amplitude_1": Quantity(  # as in the source report
        starts_at_one=True, is_mean=True, laws=("exponential",)
    ),
    "local_pressure": Quantity(),
    "local_energy": Quantity(),
}
"""Every quantity that is fitted, by its name in the rows of ``snooker fit --json``."""

LOCAL = ("local_pressure", "local_energy")
"""Quantities that are means over windows of time."""

ROUNDS = 20  # fits of these at most, each at the times that follow from the one before
SETTLED = 1e-4  # change of a rate, over it, after which there is no further one


class Course(NamedTuple):
    """How a quantity of the repeats falls, in units of its first value.

    points : that are fitted, means over groups of collisions or over windows of time
    origin : (*repeats*,) the time of the first value, s
    time, value : (*repeats*, *rows*) s, and the values at rows of the curve
    """

    points: Points
    origin: Array
    time: Array
    value: Array


FURTHER = "temperature", "pressure_amplitude_1"  # only --all prints these

SAMPLING = (
    f"A fit uses at most {ROWS - 1} points of a repeat, which stand for all its collisions. "
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
    ranges, judged : gives the ranges in which the law is judged; the fits of the repeats that count
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
    ranges: Callable[[], list[Range]] = field(compare=False, repr=False)
    judged: tuple[FitResult, ...] = field(compare=False, repr=False)

    @cached_property
    def goodness(self) -> Goodness:
        """How well the law describes the logarithms; computed when it is first read."""
        return goodness(self.ranges(), self.judged)

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
            "unit": "1/s",
            "short": self.short,
            "complete": number_complete(self.ended),
            "reason": self.reason,
            "elastic": self.elastic,
            **vars(self.goodness),
        }
        return dict(plain(row))


def reported_constants(measurement: Measurement) -> Array:
    """The source report's decay constants of the energy, 1/s, by its equations 6 and 7.

    The speed is ``Measurement.collision_speed``. nan also at CoR 0, and for unequal or rough balls.
    """
    scene, speeds = measurement.scene, measurement.collision_speed
    if not facts.hold(scene, "bouncing", "equal_balls", "one_cor", "one_wall_cor", "smooth"):
        return np.full_like(speeds, math.nan)
    density = scene.number / scene.container.area
    path = theory.source_mean_free_path(density, float(scene.radii[0]))
    return theory.source_decay_constant(scene.restitution, path, speeds)


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
    return decays_of(measure(traces, since, until), quantities, since, until)


def decays_of(
    measurement: Measurement,
    quantities: Iterable[str] = tuple(QUANTITIES),
    since: float = 0.0,
    until: float = math.inf,
) -> list[Decay]:
    """`decays` of repeats that are measured between the same times."""
    scene, complete = measurement.scene, measurement.complete
    traits = traits_of(scene)
    cools = facts.hold(traits, "cooling")
    judged = complete if np.count_nonzero(complete) > 2 else np.ones_like(complete)
    ended = Counter(StopReason(ending) for ending in measurement.endings)
    result: list[Decay] = []
    energies: dict[str, Sequence[FitResult]] = {}
    for name in quantities:
        quantity, falling = QUANTITIES[name], course(measurement, name, since, until)
        held = quantity.starts_at_one and since == 0
        judging = cache(partial(_ranges, falling, quantity.is_judged & cools & judged))
        for law in quantity.laws:
            fit = partial(_fits, measurement, quantity=quantity, law=law, held=held)
            if name in LOCAL and cools:
                begun = energies[law] if law in energies else fit(falling=falling)
                fits = _fits_of_windows(falling, law, begun, fit)
            else:
                fits = fit(falling=falling)
            if name == "kinetic_energy":
                energies[law] = fits
            result.append(
                Decay(
                    quantity=name,
                    law=law,
                    held=held,
                    over_repeats=mean_over_repeats(fits),
                    ended=ended,
                    walls=facts.hold(scene, "walls"),
                    elastic=facts.hold(traits, "elastic"),
                    warm=facts.hold(traits, "warm_walls"),
                    fits=tuple(fits),
                    ranges=judging,  # for all laws once
                    judged=tuple(compress(fits, judged)),
                )
            )
    return result


def course(
    measurement: Measurement, name: str, since: float = 0.0, until: float = math.inf
) -> Course:
    """The decay of a quantity in repeats that are measured between these times, s.

    Raises ``KeyError`` for an unknown quantity.
    """
    curve, weight = measurement.curve, measurement.curve.weight
    origin, first = curve.time[:, 0], measurement.start_energy
    value, means = curve.kinetic_energy, curve.group_kinetic
    if name in LOCAL:
        return _in_windows(measurement, name, since, until)
    if name == "kinetic_energy":
        first = measurement.first_energy
        value, means = curve.energy, means + curve.group_others
    elif QUANTITIES[name].is_mean:
        begins, first = measurement.first_fitted_pressure.T
        origin = np.maximum(begins, curve.time[:, 0])
        value, means = curve.pressure, curve.group_pressure
        weight = np.where(np.isnan(means), 0.0, weight)
    elif name != "temperature":
        raise KeyError(name)
    scale = np.where(first > 0, first, 1.0)[:, np.newaxis]
    points = Points(curve.group_time, means / scale, weight)
    return Course(points, origin, curve.time, value / scale)


def _in_windows(measurement: Measurement, name: str, since: float, until: float) -> Course:
    """Means over the windows of time; of repeats with fewer collisions than windows nothing."""
    if name == "local_energy":
        value, first = measurement.windows.total_energy, measurement.first_energy
    else:
        value = measurement.windows.pressure(measurement.scene)
        first = value[np.arange(len(value)), np.argmax(value > 0, axis=1)]
    time = measurement.time[:, np.newaxis] * (np.arange(0.5, WINDOWS) / WINDOWS)
    enough = (measurement.collisions >= WINDOWS) & (measurement.time > 0)
    inside = enough[:, np.newaxis] & (time >= since) & (time <= until)
    value = value / np.where(first > 0, first, 1.0)[:, np.newaxis]
    origin = time[np.arange(len(time)), np.argmax(inside, axis=1)]
    return Course(Points(time, value, inside.astype(np.float64)), origin, time, value)


def _fits_of_windows(
    falling: Course,
    law: str,
    begun: Sequence[FitResult],
    refit: Callable[..., list[FitResult]],
) -> list[FitResult]:
    """Fits of means over windows, each at the times that follow from the one before.

    begun : fits with about these rates
    refit : a course -> its fits
    """
    for _ in range(ROUNDS):
        fits = refit(falling=_at_means(falling, law, begun))
        rates = np.array([[fit.value for fit in row] for row in (begun, fits)])
        known = rates[:, np.isfinite(rates).all(axis=0)]
        if np.all(np.abs(np.diff(known, axis=0)) <= SETTLED * np.abs(known[1])):
            break
        begun = fits
    return fits


def _at_means(falling: Course, law: str, fits: Sequence[FitResult]) -> Course:
    """Means over windows, at the times at which a fitted law has its mean over each of them.

    The middle of a window would be too late where the law falls much within it.
    """
    rate = np.array([fit.value for fit in fits])[:, np.newaxis]
    half = np.diff(falling.time[:, :2], axis=1) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        places = LAWS[law].place_of_mean(rate, falling.time - half, falling.time + half)
    times = np.where(np.isfinite(places) & (rate > 0), places, falling.time)
    used = falling.points.weight > 0
    origin = times[np.arange(len(times)), np.argmax(used, axis=1)]
    return falling._replace(points=falling.points._replace(time=times), origin=origin)


def _ranges(falling: Course, judged: "NDArray[np.bool_]") -> list[Range]:
    """The ranges in which laws are judged on some repeats."""
    if not judged.any():
        return []
    with np.errstate(divide="ignore", invalid="ignore"):
        logarithm = np.log(falling.value[judged])
    weight = falling.points.weight[judged]
    end = np.minimum(weight.sum(axis=1, keepdims=True), 1.0)
    return ranges(Samples(falling.time[judged], logarithm, np.hstack([weight, end])))


def _fits(
    measurement: Measurement, falling: Course, quantity: Quantity, law: str, held: bool
) -> list[FitResult]:
    """The fits of a law to the repeats; a mean since the start has its mean model."""
    model, scene = LAWS[law], measurement.scene
    if absent := facts.missing(traits_of(scene), ("cold", "cooling")):
        why = WARM if absent.name == "cold" else NO_LOSSES
        return [FitResult(law, False, why, n, math.nan) for n in falling.points.numbers]
    name = (quantity.is_mean and model.mean_model) or law
    origin = np.zeros_like(falling.origin) if model.power else falling.origin
    rounding = COLLISION_ROUNDING * measurement.collisions.astype(np.float64)
    return fit_all(falling.points, origin, rounding, name, 1.0 if held else None)


def fit_records(constants: Sequence[Decay]) -> dict[str, list[dict[str, Any]]]:
    """Rows and notes of ``fit --json``."""
    rows = [decay.as_json() for decay in constants if not decay.warm]
    return {"rows": rows, "notes": [note._asdict() for note in fit_notes(constants)]}


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
    StopReason.REST: "with balls too slow for double precision",
    StopReason.FAR: "too far away for double precision",
    StopReason.INTERRUPTED: "at an interruption",
    StopReason.OUT_OF_RANGE: "before a number that no result can have",
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
