"""One repeat's decay beside its exponential and Haff's law, and the means over the repeats."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.decay import LAWS, SKIPPED_COLLISIONS, Curve, Law, Quantity, curve, fit_curve
from snooker_cli.fit import Ensemble, FitResult, ensemble, fitted_curve
from snooker_cli.gallery.caption import early, setting
from snooker_cli.gallery.picture import Layer, Line, Note, Picture, PictureError
from snooker_cli.gallery.repeats import facts, one_repeat, repeats
from snooker_cli.gallery.rows import thinned
from snooker_cli.gallery.selection import (
    Selection,
    described,
    elastic,
    require_motion,
    single_point,
    there,
    varying,
)
from snooker_cli.gallery.spread import SPREAD, at_common_times, bands
from snooker_cli.words import short, with_error

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.results import Run

RATE = "s⁻¹"
_NAMES: dict[Law, str] = {"exponential": "exponential", "haff": "Haff"}


def energy_fit(run: Run, selection: Selection) -> Picture:
    """Decay of the kinetic energy of balls and container."""
    return _fit(run, selection, "kinetic_energy", "energy-fit", "Kinetic energy")


def temperature_fit(run: Run, selection: Selection) -> Picture:
    """Decay of the temperature."""
    return _fit(run, selection, "temperature", "temperature-fit", "Temperature")


def pressure_fit(run: Run, selection: Selection) -> Picture:
    """Decay of the mean pressure since the start, after the first collisions."""
    return _fit(run, selection, "pressure", "pressure-fit", "Cumulative pressure")


def _fit(run: Run, selection: Selection, quantity: Quantity, kind: str, title: str) -> Picture:
    point = single_point(run, selection)
    if elastic(point):
        raise PictureError("nothing decays where all collisions are elastic; take cor below 1")
    trace = one_repeat(run, point, selection)
    require_motion(trace.start)
    shown, which = curve(trace, quantity), there(run, point, selection)[0]
    fits = {law: fit_curve(shown, law) for law in LAWS}
    if not any(result.converged for result in fits.values()):
        raise PictureError(f"this repeat cannot be fitted: {fits['exponential'].message}")
    whole = Selection(selection.where)
    traces = list(repeats(run, point, whole))
    curves = [curve(trace, quantity) for trace in traces]
    means = {law: ensemble(fit_curve(each, law) for each in curves) for law in LAWS}
    symbols: dict[Law, str] = {"exponential": "κ" if quantity == "pressure" else "k", "haff": "α"}
    steps = quantity != "pressure"
    begun = [(each.time, each.value) for each in curves if len(each.time) > 1]
    spread = bands(*at_common_times(begun, steps=steps), 0, f"all {len(begun)} repeats, {SPREAD}")
    layers = [*spread, *_curves(shown, fits, symbols, which, steps=steps)]
    layers += [
        Note(
            f"mean of {means[law].count} repeats: {symbols[law]} = "
            + with_error(means[law].mean, means[law].standard_error, RATE)
        )
        for law in LAWS
        if means[law].count > 1
    ]
    if quantity == "pressure":
        layers.append(Note("κ is what the report calls k/2"))
    return Picture(
        kind=kind,
        title=f"{title} and its fits" + _where(point, run),
        x_label="time (s)",
        y_label={
            "kinetic_energy": "kinetic energy, E(t)/E(0)",
            "temperature": "temperature, T(t)/T(0)",
        }.get(quantity, f"pressure, P(t)/P({SKIPPED_COLLISIONS} collisions)"),
        layers=tuple(layers),
        caption=f"{_caption(fits, means, symbols, early(facts(run, point, whole, single=False)))} "
        + (f"Band: {SPREAD}. " if spread else "")
        + setting(run, [point], selection, single=True),
        numbers=_numbers(point, fits, means, which),
        x_limits=(0.0, None),
        y_limits=(0.0, None),
    )


def _curves(
    shown: Curve, fits: dict[Law, FitResult], symbols: dict[Law, str], repeat: int, *, steps: bool
) -> list[Layer]:
    """The repeat's curve and the laws fitted to it, with value ± error of this fit alone."""
    kept = thinned(shown.time)
    name = f"simulation, repeat {repeat}"
    layers: list[Layer] = [
        Line(shown.time[kept], shown.value[kept], name, 0, steps=steps, broad=True)
    ]
    fine = np.linspace(shown.time[0], shown.time[-1], 300)
    for series, law in enumerate(LAWS, start=1):
        result = fits[law]
        if result.converged:
            text = with_error(result.value, result.error, RATE)
            name = f"{_NAMES[law]} of repeat {repeat}: {symbols[law]} = {text}"
            layers.append(Line(fine, fitted_curve(result, fine), name, series))
    return layers


def _caption(
    fits: dict[Law, FitResult],
    means: dict[Law, Ensemble],
    symbols: dict[Law, str],
    ended: str,
) -> str:
    """What the fits say, in sentences."""
    this = [
        f"{symbols[law]} = {with_error(fits[law].value, fits[law].error, RATE)} "
        f"({_NAMES[law]}, R² = {fits[law].r_squared:.4f})"
        for law in LAWS
        if fits[law].converged
    ]
    text = f"This repeat alone gives {' and '.join(this)}."
    over = [
        f"{symbols[law]} = {with_error(means[law].mean, means[law].standard_error, RATE)} "
        f"(half range {short(means[law].max_min_half_range, 2)})"
        for law in LAWS
        if means[law].count > 1
    ]
    if over:
        text += f" Means over the repeats, with standard errors: {' and '.join(over)}"
        text += f"; {ended}." if ended else "."
    return text


def _numbers(
    point: Point, fits: dict[Law, FitResult], means: dict[Law, Ensemble], repeat: int
) -> dict[str, Any]:
    """The fits as JSON: ``k`` of the exponential (κ of a pressure), ``alpha`` of Haff's law."""
    numbers: dict[str, Any] = {"parameters": point.as_json(), "repeat": repeat}
    names: dict[Law, str] = {"exponential": "k", "haff": "alpha"}
    for law, name in names.items():
        numbers |= {
            name: fits[law].value,
            f"{name}_error": fits[law].error,
            f"{name}_r_squared": fits[law].r_squared,
            f"{name}_mean": means[law].mean,
            f"{name}_standard_error": means[law].standard_error,
            f"{name}_half_range": means[law].max_min_half_range,
            f"{name}_repeats": means[law].count,
        }
    return numbers


def _where(point: Point, run: Run) -> str:
    """The point's place in the title, if the run has others."""
    text = ", ".join(described(point, key) for key in varying(run.points))
    return f": {text}" if text else ""
