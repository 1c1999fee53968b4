"""The repeats of a point -> decay constants of energy, temperature and pressure.

Every repeat is fitted by itself and the constants are averaged: the points of one curve are
correlated, so that the error of a fit to one curve, or to an averaged one, is far too small.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from snooker_cli.fit import Ensemble, FitResult, Model, ensemble, fit
from snooker_cli.observables import (
    cumulative_pressure,
    energy_ratio,
    over_first,
    series,
    temperature,
    window_pressure,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.trace import Trace

Quantity = Literal["kinetic_energy", "temperature", "pressure", "local_pressure"]
Law = Literal["exponential", "haff"]

SKIPPED_COLLISIONS = 50
"""Collisions before the cumulative pressure is fitted, as in the report: it starts at zero."""

WINDOWS = 20
"""Windows of time in which the local pressure is taken."""

QUANTITIES: dict[Quantity, str] = {
    "kinetic_energy": "kinetic energy of balls and container over that at the start",
    "temperature": "temperature of the balls over that at the start",
    "pressure": f"mean pressure since the start, after {SKIPPED_COLLISIONS} collisions",
    "local_pressure": f"pressure in {WINDOWS} windows of time",
}
"""What is fitted."""

LAWS: tuple[Law, ...] = ("exponential", "haff")


@dataclass(frozen=True)
class Curve:
    """One repeat's decay: times (s) and values over the first, and what a fit of it needs.

    amplitude : 1.0 if the curve starts at one, ``None`` if the fit is to find where it starts
    haff : Haff's law for this quantity; a cumulative mean follows its root
    """

    time: NDArray[np.float64]
    value: NDArray[np.float64]
    amplitude: float | None
    haff: Model


@dataclass(frozen=True)
class Decay:
    """A decay constant of a point: over its repeats, and how well the law fits.

    r_squared : mean over the repeats; short : repeats that ended before what was asked for
    """

    quantity: Quantity
    law: Law
    over_repeats: Ensemble
    r_squared: float
    rms_residual: float
    short: int
    fits: tuple[FitResult, ...]


def curve(trace: Trace, quantity: Quantity) -> Curve:
    """The decay of a quantity in one repeat."""
    found = series(trace)
    if quantity == "kinetic_energy":
        return Curve(found.time, energy_ratio(found), 1.0, "haff")
    if quantity == "temperature":
        values = over_first(temperature(found, trace.start.number))
        return Curve(found.time, values, 1.0, "haff")
    radius = trace.start.container_radius
    if quantity == "pressure":
        settled = found.wall_events + found.pair_events >= SKIPPED_COLLISIONS
        time, values = cumulative_pressure(found, radius)
        settled = settled[found.time > 0]
        time, values = time[settled], values[settled]
        return Curve(time, _over_first(values), None, "haff_root")
    time, values = window_pressure(found, radius, WINDOWS, trace.stop.time)
    return Curve(time, _over_first(values), None, "haff")


def fit_curve(decay: Curve, law: Law) -> FitResult:
    """Fit one repeat's decay; Haff's law counts time from the start of the run."""
    if law == "exponential":
        start = 0.0 if decay.amplitude is not None else None
        return fit(decay.time, decay.value, amplitude=decay.amplitude, start=start)
    return fit(decay.time, decay.value, decay.haff, amplitude=decay.amplitude, start=0.0)


def decays(
    traces: Iterable[Trace], quantities: Sequence[Quantity] = tuple(QUANTITIES)
) -> list[Decay]:
    """Decay constants over the repeats of a point, for each quantity and law."""
    fits: dict[tuple[Quantity, Law], list[FitResult]] = {
        (quantity, law): [] for quantity in quantities for law in LAWS
    }
    short = 0
    for trace in traces:
        short += not trace.stop.reason.complete
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
            short=short,
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
        "unit": "s-1",
        "standard_deviation": _finite(found.standard_deviation),
        "bootstrap_error": _finite(found.bootstrap_error),
        "bootstrap_interval": [_finite(found.bootstrap_low), _finite(found.bootstrap_high)],
        "max_min_half_range": _finite(found.max_min_half_range),
        "r_squared": _finite(decay.r_squared),
        "rms_residual": _finite(decay.rms_residual),
    }


def _over_first(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The values over the first of them that is not zero: there may be no wall hit before."""
    positive = values[values > 0]
    return values / positive[0] if len(positive) else values


def _mean(values: Sequence[float]) -> float:
    """Mean of the finite values, nan if there are none."""
    finite = [value for value in values if math.isfinite(value)]
    return sum(finite) / len(finite) if finite else math.nan


def _finite(value: float) -> float | None:
    """JSON has no nan: absent instead."""
    return value if math.isfinite(value) else None
