"""The decay constants of the energy over many CoR, beside the report's formula and theory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli import kinetic, theory
from snooker_cli.decay import Law, decays, reported_constant
from snooker_cli.gallery.caption import setting
from snooker_cli.gallery.picture import Layer, Line, Picture, Points
from snooker_cli.gallery.repeats import one_repeat, repeats
from snooker_cli.gallery.selection import Selection, along, inelastic_points, require_motion
from snooker_cli.observables import mean_and_error, meeting_temperature
from snooker_cli.words import short, with_error

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.results import Run

_CONSTANTS: tuple[tuple[Law, str, str], ...] = (
    ("exponential", "k", "k, exponential fitted"),
    ("haff", "alpha", "α, Haff's law fitted"),
)


def decay_against_cor(run: Run, selection: Selection) -> Picture:
    """The decay constants of the energy against the CoR, beside the report's and kinetic theory."""
    (points,) = along(inelastic_points(run, selection), "cor")
    require_motion(one_repeat(run, points[0], selection).start)
    records = [_decay(run, point, selection) for point in points]
    cors = np.array([point.experiment.cor for point in points])
    laws = _laws(run, points, selection)
    layers = list(laws)
    reported = np.array([each["report_k"] for each in records])
    known = np.isfinite(reported)
    draw = np.count_nonzero(known) > 1
    if draw:
        layers.insert(0, Line(cors[known], reported[known], "k by the report", 0, "dashed"))
    for index, (_, name, text) in enumerate(_CONSTANTS):
        values = np.array([each[name] for each in records])
        errors = np.array([each[f"{name}_error"] for each in records])
        good = np.isfinite(values)
        bars = errors[good] if np.all(np.isfinite(errors[good])) else None
        layers.append(Points(cors[good], values[good], None, bars, text, index))
    ends = [
        f"{symbol} from {with_error(records[0][name], records[0][f'{name}_error'])} to "
        + with_error(records[-1][name], records[-1][f"{name}_error"])
        for symbol, name in (("k", "k"), ("α", "alpha"))
    ]
    formula = ""
    if known.any():
        span = [short(each) for each in reported[known][[0, -1]]]
        formula = (
            "The report's own k = −2 ln(CoR)⟨v⟩/λ, with λ = 1/(√2 n 2πr) and ⟨v⟩ the mean over all "
            f"collisions, {f'goes from {span[0]} to {span[1]}' if draw else f'is {span[0]}'} s⁻¹. "
        )
    if laws:
        formula += "Dotted: that k with Enskog's λ and the balls' mean speed at the start. "
    return Picture(
        kind="decay-against-cor",
        title="Decay constants of the energy",
        x_label="coefficient of restitution",
        y_label="decay constant (s⁻¹)",
        layers=tuple(layers),
        caption=f"Between CoR {cors[0]:g} and {cors[-1]:g} the fits give {' and '.join(ends)} s⁻¹"
        + (", means and standard errors over the repeats. " if run.experiment.repeats > 1 else ". ")
        + formula
        + setting(run, points, selection),
        numbers={
            "points": records,
            "ended_early": sum(each["ended_early"] for each in records),
        },
        y_log=True,
    )


def _decay(run: Run, point: Point, selection: Selection) -> dict[str, Any]:
    """The decay constants of a point's energy over its repeats, as JSON."""
    traces = list(repeats(run, point, selection))
    found = {each.law: each for each in decays(traces, ("kinetic_energy",))}
    record: dict[str, Any] = {"parameters": point.as_json()}
    for law, name, _ in _CONSTANTS:
        over = found[law].over_repeats
        record |= {name: over.mean, f"{name}_error": over.standard_error, "repeats": over.count}
    reported, error = mean_and_error(np.array([reported_constant(trace) for trace in traces]))
    record |= {"report_k": reported, "report_k_error": error}
    return record | {"ended_early": found["haff"].short}


def _laws(run: Run, points: Sequence[Point], selection: Selection) -> list[Layer]:
    """Kinetic theory's α, and the report's formula with its rate; none where there is no theory."""
    scene = one_repeat(run, points[0], selection).start
    rates = kinetic.rates(scene, meeting_temperature(scene.kinetic_energy, scene))
    if rates is None:
        return []
    cors = [point.experiment.cor for point in points]
    # The report's logarithm has no value at CoR 0.
    grid = np.linspace(max(cors[0], 0.01), cors[-1], 100)
    wall = points[0].experiment.wall_cor
    path, speed = rates.mean_free_path, rates.mean_speed
    report = [theory.report_decay_constant(float(e), path, speed) for e in grid]
    losses = [
        theory.cooling_rate(
            float(e), rates.ball_ball, float(e) if wall is None else wall, rates.wall
        )
        for e in grid
    ]
    alpha = [theory.haff_rate(each) for each in losses]
    return [
        Line(grid, np.array(report), "k, Enskog's λ, first ⟨v⟩", 0, "dotted"),
        Line(grid, np.array(alpha), "α, kinetic theory", 1, "solid"),
    ]
