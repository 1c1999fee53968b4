"""The repeats of a point -> decay constants of energy, temperature and pressure.

Every repeat is fitted by itself, and the constants are averaged.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis import observables
from snooker_cli.analysis.fitting import LAWS, FitResult, RepeatMean, fit, mean_over_repeats
from snooker_cli.analysis.observables import after_collisions, over_first
from snooker_cli.formatting import listed, plain
from snooker_cli.scene import EPSILON
from snooker_cli.trace import StopReason, Trace

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    TimeCourse = tuple[Array, Array]

SKIPPED_COLLISIONS = 50
"""Collisions before the cumulative pressure is fitted, as in the source report: it starts at 0."""

WINDOWS = 20
"""Windows of time for the local pressure and energy."""

COLLISION_ROUNDING = 8 * EPSILON
"""Relative error of the energy of elastic balls per collision: twice that of four roundings."""


def _energy(trace: Trace) -> TimeCourse:
    found = after_collisions(trace)
    return found.time, observables.energy_ratio(found)


def _temperature(trace: Trace) -> TimeCourse:
    found = after_collisions(trace)
    return found.time, over_first(found.kinetic_energy)


def _pressure(trace: Trace) -> TimeCourse:
    found = after_collisions(trace)
    settled = (found.wall_events + found.pair_events >= SKIPPED_COLLISIONS)[found.time > 0]
    time, values = observables.cumulative_pressure(trace, found)
    return time[settled], over_first(values[settled])


def _in_windows(trace: Trace, means: Callable[[Array], Array]) -> TimeCourse:
    """Means between the edges of equal windows; none for a repeat without length."""
    edges = np.linspace(0.0, trace.stop.time, WINDOWS + 1)[: None if trace.stop.time > 0 else 0]
    return (edges[:-1] + edges[1:]) / 2, means(edges)


def _local_pressure(trace: Trace) -> TimeCourse:
    return _in_windows(trace, lambda edges: over_first(observables.pressures(trace, edges)))


def _local_energy(trace: Trace) -> TimeCourse:
    ratio = observables.energy_ratio(observables.series(trace))
    return _in_windows(trace, lambda edges: observables.time_means(trace, ratio, edges))


@dataclass(frozen=True)
class Quantity:
    """A quantity whose decay is fitted.

    label : for an axis
    course : a repeat -> times (s) and values over the first
    starts_at_one : whether the fit holds the amplitude at 1, at the first of the times
    is_mean : whether it is a mean since the start, which follows a law's ``mean_model``
    laws : that are fitted
    """

    label: str
    course: Callable[[Trace], TimeCourse]
    starts_at_one: bool = False
    is_mean: bool = False
    laws: tuple[str, ...] = tuple(LAWS)

    @property
    def amplitude(self) -> str:
        """What the fit does with the amplitude, in words."""
        return "fixed at 1" if self.starts_at_one else "free"


QUANTITIES: dict[str, Quantity] = {
    "kinetic_energy": Quantity("kinetic energy, E(t)/E(0)", _energy, starts_at_one=True),
    "temperature": Quantity("temperature, T(t)/T(0)", _temperature, starts_at_one=True),
    "pressure": Quantity(
        f"pressure, P(t)/P({SKIPPED_COLLISIONS} collisions)", _pressure, is_mean=True
    ),
    "pressure_amplitude_1": Quantity(
        "pressure as in the source report, amplitude 1",
        _pressure,
        starts_at_one=True,
        is_mean=True,
        laws=("exponential",),
    ),
    "local_pressure": Quantity("pressure in windows of time", _local_pressure),
    "local_energy": Quantity("energy in windows of time, E/E(0)", _local_energy),
}
"""Every quantity that is fitted, by its name in ``fit.json``."""

SAMPLING = (
    "Fits use every collision (fewer in long runs; summaries are interpolated). "
    f'"Local" means averages over {WINDOWS} windows of time. '
    "The pressure is a mean since the start; for Haff's law its fit is A/(1 + αt). "
    "The source report fixes A at 1, also for the pressure; the best A is not 1 there. "
    f"Models: {'; '.join(f'{name} {model.formula}' for name, model in LAWS.items())}."
)
"""What a reader of fits has to know."""

WITHOUT_WALLS = f"{observables.NO_WALLS}; Haff's law is for a gas without clusters"


@dataclass(frozen=True)
class Curve:
    """The decay of a quantity in one repeat: times (s), values over the first, their rounding."""

    quantity: Quantity
    time: Array
    value: Array
    rounding: float


@dataclass(frozen=True)
class Decay:
    """A decay constant of a point: over its repeats, and how well the law fits.

    quantity, law : names in ``QUANTITIES`` and ``LAWS``
    ended : number of repeats by their stop reason
    walls : whether the container has walls; without them, pressures are the virial's
    fits : of each repeat
    """

    quantity: str
    law: str
    over_repeats: RepeatMean
    ended: Mapping[StopReason, int]
    walls: bool
    fits: tuple[FitResult, ...]

    @property
    def short(self) -> int:
        """Number of repeats that stopped before the requested end."""
        return sum(self.ended.values()) - complete(self.ended)

    @property
    def r_squared(self) -> float:
        """Mean over the repeats."""
        return _mean(result.r_squared for result in self.fits)

    @property
    def rms_residual(self) -> float:
        """Mean over the repeats."""
        return _mean(result.rms_residual for result in self.fits)

    @property
    def reason(self) -> str | None:
        """Why fits failed, the most frequent reason first; ``None`` if none has."""
        reasons = Counter(result.message for result in self.fits if not result.converged)
        return " ".join(message for message, _ in reasons.most_common()) or None

    def as_json(self) -> dict[str, Any]:
        """A row of ``fit.json``: ``value`` ± ``error`` are the mean and its standard error."""
        found = self.over_repeats
        content: dict[str, Any] = plain(
            {
                "quantity": self.quantity,
                "model": self.law,
                "amplitude": QUANTITIES[self.quantity].amplitude,
                "value": found.mean,
                "error": found.standard_error,
                "repeats": found.count,
                "failed": found.failed,
                "short": self.short,
                "complete": complete(self.ended),
                "reason": self.reason,
                "unit": "s-1",
                "standard_deviation": found.standard_deviation,
                "bootstrap_error": found.bootstrap_error,
                "bootstrap_interval": [found.bootstrap_low, found.bootstrap_high],
                "max_min_half_range": found.max_min_half_range,
                "r_squared": self.r_squared,
                "rms_residual": self.rms_residual,
            }
        )
        return content


def reported_constant(trace: Trace) -> float:
    """The source report's decay constant of the energy for a repeat (1/s), equations 6 and 7.

    The speed is `observables.mean_speed`, with its nan. nan also at CoR 0, and for unequal balls.
    """
    scene, speed = trace.start, observables.mean_speed(trace)
    if scene.restitution == 0 or not observables.equal_balls(scene):
        return math.nan
    density = theory.number_density(scene.number, scene.container.area)
    path = theory.source_mean_free_path(density, float(scene.radii[0]))
    return theory.source_decay_constant(scene.restitution, path, speed)


def curve(trace: Trace, quantity: str) -> Curve:
    """The decay of a quantity in one repeat. Raises ``KeyError`` for an unknown quantity."""
    known = QUANTITIES[quantity]
    return Curve(known, *known.course(trace), COLLISION_ROUNDING * trace.collisions)


def fit_curve(decay: Curve, law: str) -> FitResult:
    """Fit one repeat's decay with a law or, for a mean since the start, with its mean model."""
    model, quantity = LAWS[law], decay.quantity
    return fit(
        decay.time,
        decay.value,
        (quantity.is_mean and model.mean_model) or law,
        amplitude=1.0 if quantity.starts_at_one else None,
        start=0.0 if model.has_pole else None,
        rounding=decay.rounding,
    )


_FITS: WeakKeyDictionary[Trace, dict[str, dict[str, FitResult]]] = WeakKeyDictionary()
"""Fits of the repeats in memory, by quantity and law."""


def repeat_fits(trace: Trace, quantity: str) -> dict[str, FitResult]:
    """The fits of one repeat by law, made once. Raises ``KeyError`` for an unknown quantity."""
    known = _FITS.setdefault(trace, {})
    if quantity not in known:
        found = curve(trace, quantity)
        known[quantity] = {law: fit_curve(found, law) for law in found.quantity.laws}
    return known[quantity]


def decays(traces: Iterable[Trace], quantities: Sequence[str] = tuple(QUANTITIES)) -> list[Decay]:
    """Decay constants over the repeats of a point, for each quantity and law.

    Raises ``KeyError`` for an unknown quantity.
    """
    keys = [(quantity, law) for quantity in quantities for law in QUANTITIES[quantity].laws]
    fits: dict[tuple[str, str], list[FitResult]] = {key: [] for key in keys}
    ended: Counter[StopReason] = Counter()
    walls = True
    for trace in traces:
        ended[trace.stop.reason] += 1
        walls = trace.start.container.has_wall
        for quantity, law in keys:
            fits[quantity, law].append(repeat_fits(trace, quantity)[law])
    return [
        Decay(*key, mean_over_repeats(results), ended, walls, tuple(results))
        for key, results in fits.items()
    ]


def analyse(traces: Iterable[Trace]) -> tuple[list[Decay], list[str]]:
    """All decay constants of a point, and notes for a reader: early ends and failed fits."""
    found = decays(traces)
    notes = ["" if found[0].walls else WITHOUT_WALLS, early_note(found[0].ended)]
    failures: dict[tuple[str, int], list[str]] = {}
    for each in found:
        if each.reason is not None:
            failures.setdefault((each.reason, each.over_repeats.failed), []).append(each.quantity)
    for (reason, failed), quantities in failures.items():
        names = listed([name.replace("_", " ") for name in dict.fromkeys(quantities)])
        of = "" if len(found[0].fits) == 1 else f" in {failed} of {len(found[0].fits)} repeats"
        notes.append(f"no fit of {names}{of}: {reason}")
    return found, list(filter(None, notes))


_EARLY = {
    StopReason.WALL_TRAP: "in a wall trap",
    StopReason.COLLAPSE: "in a collapse",
    StopReason.NOTHING_LEFT: "with no collision ahead",
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
    each = [words if len(counts) == 1 else f"{count} {words}" for words, count in counts.items()]
    return f"{which} ended early, {listed(each)}"


def early_note(ended: Mapping[StopReason, int]) -> str:
    """How many repeats miss collisions that could have happened; empty if none do."""
    endings = early_endings(ended, [reason for reason in _EARLY if not reason.complete])
    if not endings:
        return ""
    return f"{endings}; averages over collisions leave them out, the rest uses them to their end"


def complete(ended: Mapping[StopReason, int]) -> int:
    """Number of repeats that reached their requested end, of all that `ended` counts."""
    return sum(number for reason, number in ended.items() if reason.complete)


def _mean(values: Iterable[float]) -> float:
    """Mean of the finite values, nan if there are none."""
    finite = [value for value in values if math.isfinite(value)]
    return sum(finite) / len(finite) if finite else math.nan
