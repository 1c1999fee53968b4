"""The repeats of a point -> decay constants of energy, temperature and pressure.

Every repeat is fitted by itself and the constants are averaged: the points of one curve are
correlated, so that the error of a fit to one curve, or to an averaged one, is far too small.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis.fitting import FitResult, Model, RepeatMean, ensemble, fit
from snooker_cli.analysis.observables import (
    after_collisions,
    cumulative_pressure,
    energy_ratio,
    equal_balls,
    over_first,
    temperature,
    window_energy,
    window_pressure,
)
from snooker_cli.formatting import listed
from snooker_cli.trace import StopReason

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.trace import Trace


Quantity = Literal["kinetic_energy", "temperature", "pressure", "local_pressure", "local_energy"]
Law = Literal["exponential", "haff"]

SKIPPED_COLLISIONS = 50
"""Collisions before the cumulative pressure is fitted, as in the report: it starts at zero."""

WINDOWS = 20
"""Windows of time in which the local pressure and energy are taken."""

COLLISION_ROUNDING = 8 * float(np.finfo(np.float64).eps)
"""What a collision of elastic balls may change of their energy.

A speed after it is some four roundings off, its square twice as many.
"""

QUANTITIES: dict[Quantity, str] = {
    "kinetic_energy": "kinetic energy of balls and container over that at the start",
    "temperature": "temperature of the balls over that at the start",
    "pressure": f"mean pressure since the start, after {SKIPPED_COLLISIONS} collisions",
    "local_pressure": f"pressure in {WINDOWS} windows of time",
    "local_energy": f"mean of the energy over that at the start, in {WINDOWS} windows of time",
}
"""What is fitted: with a point a collision, or a window."""

SAMPLING = (
    "One point a collision, or every few of very many, for energy, temperature and pressure, of a "
    "summary read between its rows; "
    f"{WINDOWS} windows of time for the local ones."
)
"""How curves are sampled, as a fit's reader has to know."""

WITHOUT_WALLS = (
    "no walls: the pressure is the virial's, (N T + ΣJd/2t)/V, and Haff's law that of a gas that "
    "stays even, without clusters"
)
"""What the constants of a periodic box are."""

LAWS: tuple[Law, ...] = ("exponential", "haff")


@dataclass(frozen=True)
class Curve:
    """One repeat's decay: times (s) and values over the first, and what a fit of it needs.

    amplitude : 1.0 if the curve starts at one, ``None`` if the fit is to find where it starts
    haff : Haff's law for this quantity; a cumulative mean follows its root
    rounding : relative size of what may be rounding in the values
    """

    time: NDArray[np.float64]
    value: NDArray[np.float64]
    amplitude: float | None
    haff: Model
    rounding: float = 0.0


@dataclass(frozen=True)
class Decay:
    """A decay constant of a point: over its repeats, and how well the law fits.

    r_squared, rms_residual : mean over the repeats
    ended : how many repeats ended for which reason
    walls : whether the container has walls; without, pressures are the virial's
    """

    quantity: Quantity
    law: Law
    over_repeats: RepeatMean
    r_squared: float
    rms_residual: float
    ended: Mapping[StopReason, int]
    walls: bool
    fits: tuple[FitResult, ...]

    @property
    def short(self) -> int:
        """Repeats that ended before what was asked for."""
        return sum(number for reason, number in self.ended.items() if not reason.complete)

    @property
    def reason(self) -> str | None:
        """Why fits failed, the most frequent reason first; None if none has."""
        reasons = Counter(result.message for result in self.fits if not result.converged)
        return " ".join(message for message, _ in reasons.most_common()) or None


def reported_constant(trace: Trace) -> float:
    """The source report's decay constant of the energy for a repeat (1/s); pressure's is half.

    k = -2 ln(CoR) <v>/lambda, lambda = 1/(sqrt(2) n 2 pi r), its equations 6 and 7, where <v> is
    the mean over the collisions of the balls' mean speed after each. nan at CoR 0, for unequal
    balls, and for a repeat without collisions.
    """
    scene, found = trace.start, after_collisions(trace)
    if scene.restitution == 0 or not equal_balls(scene) or len(found.time) < 2:
        return math.nan
    density = theory.number_density(scene.number, scene.container.area)
    path = theory.report_mean_free_path(density, float(scene.radii[0]))
    speed = float(found.mean_speed[1:].mean())
    return theory.report_decay_constant(scene.restitution, path, speed)


def curve(trace: Trace, quantity: Quantity) -> Curve:
    """The decay of a quantity in one repeat."""
    rounding = COLLISION_ROUNDING * trace.collisions
    if quantity == "local_pressure":
        time, values = window_pressure(trace, WINDOWS)
        return Curve(time, over_first(values), None, "haff", rounding)
    if quantity == "local_energy":
        time, values = window_energy(trace, WINDOWS)
        return Curve(time, values, None, "haff", rounding)
    found = after_collisions(trace)
    if quantity == "kinetic_energy":
        return Curve(found.time, energy_ratio(found), 1.0, "haff", rounding)
    if quantity == "temperature":
        values = over_first(temperature(found, trace.start.number))
        return Curve(found.time, values, 1.0, "haff", rounding)
    settled = found.wall_events + found.pair_events >= SKIPPED_COLLISIONS
    time, values = cumulative_pressure(trace, found)
    settled = settled[found.time > 0]
    return Curve(time[settled], over_first(values[settled]), None, "haff_root", rounding)


def fit_curve(decay: Curve, law: Law) -> FitResult:
    """Fit one repeat's decay; Haff's law counts time from the start of the run."""
    held = decay.amplitude is not None
    return fit(
        decay.time,
        decay.value,
        "exponential" if law == "exponential" else decay.haff,
        amplitude=decay.amplitude,
        start=0.0 if held or law == "haff" else None,
        rounding=decay.rounding,
    )


def decays(
    traces: Iterable[Trace], quantities: Sequence[Quantity] = tuple(QUANTITIES)
) -> list[Decay]:
    """Decay constants over the repeats of a point, for each quantity and law."""
    fits: dict[tuple[Quantity, Law], list[FitResult]] = {
        (quantity, law): [] for quantity in quantities for law in LAWS
    }
    ended: Counter[StopReason] = Counter()
    walls = True
    for trace in traces:
        ended[trace.stop.reason] += 1
        walls = trace.start.container.has_wall
        for quantity in quantities:
            decay = curve(trace, quantity)
            for law in LAWS:
                fits[quantity, law].append(fit_curve(decay, law))
    return [
        Decay(
            quantity=quantity,
            law=law,
            over_repeats=ensemble(results),
            r_squared=_mean([result.r_squared for result in results]),
            rms_residual=_mean([result.rms_residual for result in results]),
            ended=ended,
            walls=walls,
            fits=tuple(results),
        )
        for (quantity, law), results in fits.items()
    ]


def record(decay: Decay, parameters: dict[str, Any]) -> dict[str, Any]:
    """A decay constant as JSON: ``value`` ± ``error``, the mean and its standard error."""
    found = decay.over_repeats
    return {
        "parameters": parameters,
        "quantity": decay.quantity,
        "model": decay.law,
        "value": _finite(found.mean),
        "error": _finite(found.standard_error),
        "repeats": found.count,
        "failed": found.failed,
        "short": decay.short,
        "reason": decay.reason,
        "unit": "s-1",
        "standard_deviation": _finite(found.standard_deviation),
        "bootstrap_error": _finite(found.bootstrap_error),
        "bootstrap_interval": [_finite(found.bootstrap_low), _finite(found.bootstrap_high)],
        "max_min_half_range": _finite(found.max_min_half_range),
        "r_squared": _finite(decay.r_squared),
        "rms_residual": _finite(decay.rms_residual),
    }


def notes(found: Sequence[Decay]) -> list[str]:
    """What a reader of a point's decay constants has to know, in sentences."""
    if not found:
        return []
    failures: dict[tuple[str, int], dict[Quantity, list[Law]]] = {}
    for each in found:
        if each.reason is not None:
            of_reason = failures.setdefault((each.reason, each.over_repeats.failed), {})
            of_reason.setdefault(each.quantity, []).append(each.law)
    said = [] if found[0].walls else [WITHOUT_WALLS]
    said.append(used_up_to_there(found[0].ended))
    for (reason, failed), laws in failures.items():
        names = [
            quantity.replace("_", " ") + ("" if len(which) == len(LAWS) else f" ({which[0]})")
            for quantity, which in laws.items()
        ]
        of = "" if len(found[0].fits) == 1 else f" in {failed} of {len(found[0].fits)} repeats"
        said.append(f"no fit of {listed(names)}{of}: {reason}")
    return [sentence for sentence in said if sentence]


_EARLY = {
    StopReason.WALL_TRAP: "in a wall trap",
    StopReason.COLLAPSE: "in a collapse",
    StopReason.NOTHING_LEFT: "with no collision ahead",
    StopReason.INTERRUPTED: "at an interruption",
}
"""What ends a repeat before the collisions or the time that were asked for."""


def early_endings(
    ended: Mapping[StopReason, int], reasons: Mapping[StopReason, str] = _EARLY
) -> str:
    """How many repeats ended early, for which of these reasons; empty if none did."""
    counts = {words: ended[reason] for reason, words in reasons.items() if ended.get(reason)}
    if not counts:
        return ""
    short, total = sum(counts.values()), sum(ended.values())
    who = "the repeat" if total == 1 else f"{short} of {total} repeats"
    each = [words if len(counts) == 1 else f"{count} {words}" for words, count in counts.items()]
    return f"{who} ended early, {listed(each)}"


def used_up_to_there(ended: Mapping[StopReason, int]) -> str:
    """How many repeats lack something that could have happened, and that the rest is used."""
    lacking = {reason: words for reason, words in _EARLY.items() if not reason.complete}
    said = early_endings(ended, lacking)
    used = "is" if sum(ended.get(reason, 0) for reason in lacking) == 1 else "are"
    return f"{said}, and {used} used up to there" if said else ""


def _mean(values: Sequence[float]) -> float:
    """Mean of the finite values, nan if there are none."""
    finite = [value for value in values if math.isfinite(value)]
    return sum(finite) / len(finite) if finite else math.nan


def _finite(value: float) -> float | None:
    """JSON has no nan: absent instead."""
    return value if math.isfinite(value) else None
