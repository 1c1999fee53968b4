"""Our value of every printed number for the stated scene, and a check of every printed claim."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis.decay import Decay, decays, reported_constant
from snooker_cli.analysis.observables import (
    ROUNDING,
    at_collisions,
    central_distances,
    energy_ratio,
    ideal_gas_ratio,
    mean_and_error,
    mean_pressure,
    mean_temperature,
    momentum,
    pair_distances,
    reduced_speed_counts,
    series,
)
from snooker_cli.figures import Selection, selected
from snooker_cli.figures.distributions import REDUCED_TEMPERATURE
from snooker_cli.figures.selection import distinct, value_at
from snooker_cli.formatting import listed, short, with_error
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report.setting_search import Sample, mean_speed
from snooker_cli.report.source_values import (
    CLOSE,
    COEFFICIENTS,
    SOURCE_CLAIMS,
    SOURCE_VALUES,
    OurValue,
    SourceClaim,
    SourceValue,
    source_value,
)
from snooker_cli.trace import SPEED_BIN

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.runs import Run
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

Runs = Mapping[str, "Run"]
Laws = Mapping[tuple[str, str], Decay]
AT_EACH = " and ".join(f"{cor:g}" for cor in COEFFICIENTS)


@dataclass(frozen=True)
class StatedResults:
    """Results of the scene as the source report states it.

    numbers : by the name of the printed number
    scene : the start of a repeat
    laws : by CoR, the decay constants over all repeats
    local : by CoR, decay constant of the pressure over that of the energy, both in time windows
    """

    numbers: dict[str, OurValue]
    scene: Scene
    laws: Mapping[float, Laws]
    local: dict[float, OurValue]


def stated_results(runs: Runs) -> StatedResults:
    """Our value of every printed number, and what the claims are checked with."""
    run = runs["restitution"]
    elastic = list(run.traces(_points(run, cor=1.0)[0]))
    scene = elastic[0].start
    samples: dict[tuple[str, float | None], Sample] = {
        ("pressure", None): Sample.over([mean_pressure(trace) for trace in elastic])
    }
    laws: dict[float, Laws] = {}
    for cor in COEFFICIENTS:
        traces = list(run.traces(_points(run, cor=cor)[0]))
        laws[cor] = {(one.quantity, one.law): one for one in decays(traces)}
        for found, sample in _cooling(cor, traces, laws[cor]).items():
            samples[found, cor] = sample
    numbers: dict[str, OurValue] = {
        **_extremes(runs["decay"]),
        **_source_formulas(scene),
    }

    def ours(number: SourceValue) -> OurValue:
        if number.quantity in ("temperature ratio", "pressure ratio"):
            return _ideal_gas_limit(runs, number)
        if number.quantity in numbers:
            return numbers[number.quantity]
        return samples[number.quantity, number.cor].our_value(number)

    return StatedResults(
        {number.name: ours(number) for number in SOURCE_VALUES},
        scene,
        laws,
        {cor: _local_ratio(found) for cor, found in laws.items()},
    )


def _points(run: Run, **values: object) -> Sequence[Point]:
    """The points with these values; ``__`` in a key stands for a dot."""
    return selected(run, Selection({key.replace("__", "."): one for key, one in values.items()}))


def _cooling(cor: float, traces: Sequence[Trace], laws: Laws) -> dict[str, Sample]:
    """The quantities of the inelastic runs."""

    def constants(quantity: str) -> Sample:
        fits = laws[quantity, "exponential"].fits
        return Sample.over([one.value for one in fits if one.converged])

    by_theory = [reported_constant(trace) for trace in traces]
    return {
        "energy decay": constants("kinetic_energy"),
        "temperature decay": constants("temperature"),
        "pressure decay": constants("pressure"),
        "pressure decay, doubled": constants("pressure").times(2),
        "mean speed": Sample.over([mean_speed(trace) for trace in traces]),
        "theory": Sample.over(by_theory),
        "tau": Sample.over([-2 * math.log(cor) / constant for constant in by_theory]),
    }


def _extremes(run: Run) -> dict[str, OurValue]:
    """The extreme distances and momentum ratios over all repeats."""
    largest, smallest, worst = -math.inf, math.inf, np.ones(2)
    for point in run.points:
        for trace in run.traces(point):
            states = at_collisions(trace)
            largest = max(largest, float(central_distances(states).max()))
            smallest = min(smallest, float(pair_distances(states, trace.start).min()))
            total = momentum(states.velocities, states.container_velocities, trace.start)
            ratios = np.vstack([worst, total / total[0]])
            worst = ratios[np.abs(ratios - 1).argmax(axis=0), [0, 1]]
    return {
        "central distance": OurValue(largest),
        "pair distance": OurValue(smallest),
        "momentum x": OurValue(float(worst[0])),
        "momentum y": OurValue(float(worst[1])),
    }


def _source_formulas(scene: Scene) -> dict[str, OurValue]:
    """Quantities of the scene by the formulas of the source report."""
    density = theory.number_density(scene.number, scene.container.area)
    radius = float(scene.radii[0])
    return {
        "density": OurValue(density),
        "cross-section": OurValue(2 * math.pi * radius),
        "mean free path": OurValue(theory.source_mean_free_path(density, radius)),
    }


def _ideal_gas_limit(runs: Runs, number: SourceValue) -> OurValue:
    """A ratio to the ideal gas at CoR 1 for small balls; it should be 1."""
    inverted = number.quantity == "temperature ratio"
    if inverted:
        run = runs["radius"]
        point = min(run.points, key=lambda point: float(value_at(point, "balls.radius")))
    else:
        run = runs["dilute"]
        (point,) = _points(run, cor=1.0, balls__radius=number.radius)
    traces = list(run.traces(point))
    scene = traces[0].start
    radius = float(scene.radii[0])
    disks = theory.fluid_state(scene.number, 1.0, radius, scene.container).pressure
    expected = disks / theory.ideal_gas_pressure(scene.number, 1.0, scene.container.area)
    ratios = np.array([ideal_gas_ratio(trace) for trace in traces])
    if inverted:
        ratios, expected = 1 / ratios, 1 / expected
    return OurValue(*mean_and_error(ratios), abs(expected - 1))


def _local_ratio(laws: Laws) -> OurValue:
    """Decay constant of the pressure over that of the energy, both in time windows."""
    pressure, energy = (
        laws[quantity, "exponential"].fits for quantity in ("local_pressure", "local_energy")
    )
    ratios = [
        one.value / other.value
        for one, other in zip(pressure, energy, strict=True)
        if one.converged and other.converged
    ]
    return OurValue(*mean_and_error(np.array(ratios)))


@dataclass(frozen=True)
class CheckedClaim:
    """A sentence of the source report, our check of it in words, and whether it holds."""

    name: str
    where: str
    claim: str
    check: str
    holds: bool


def checked_claims(runs: Runs, stated: StatedResults) -> tuple[CheckedClaim, ...]:
    """Every sentence about results that a number can decide."""
    checks = {
        **_contradictions(stated),
        **_error_propagation(),
        **_cooling_checks(runs["decay"], stated),
        **_ideal_gas_checks(runs["temperature"]),
        **_tiny_ball_checks(runs["dilute"]),
        "maxwell_boltzmann": _speed_check(runs["speeds"]),
    }
    return tuple(
        CheckedClaim(
            claim.name,
            claim.where,
            claim.text,
            *(_nearness(claim) if claim.near else checks[claim.name]),
        )
        for claim in SOURCE_CLAIMS
    )


Check = tuple[str, bool]
"""What was found, and whether the claim holds."""


def _nearness(claim: SourceClaim) -> Check:
    """Whether two printed numbers are as close as the source report says."""
    first, second = map(source_value, claim.near)
    off = abs(first.value / second.value - 1)
    return f"{first.digits} against {second.digits}: {100 * off:.1f} % apart", off <= CLOSE


def _contradictions(stated: StatedResults) -> dict[str, Check]:
    """Claims that the source report itself contradicts."""
    one, other = source_value("pressure_abstract_0.9"), source_value("pressure_mean_0.9")
    text, caption = source_value("ratio_text"), source_value("ratio_caption")
    ratios = [
        with_error(stated.numbers[each.name].value, stated.numbers[each.name].error)
        for each in (text, caption)
    ]
    density, section = source_value("density"), source_value("cross_section")
    path = source_value("mean_free_path")
    own = 1 / (math.sqrt(2) * density.value * section.value)
    return {
        "pressure_constant": (f"{other.where} prints {other.printed}", one.value == other.value),
        "radius_of_figure_17": (
            f"its caption states {caption.radius:g} m; our ratios at CoR 1 for the two radii, "
            f"{ratios[0]} and {ratios[1]}, do not decide between them",
            text.radius == caption.radius,
        ),
        "divergence": ("III C states that it grows as CoR decreases", False),
        "mean_free_path": (
            f"its n = {density.digits} and σ = {section.digits} give {own:.2f} m, not "
            f"{path.digits} m",
            OurValue(own).agrees(path),
        ),
    }


def _error_propagation() -> dict[str, Check]:
    """The uncertainties of τ and k that follow from those of the mean speeds."""
    path = source_value("mean_free_path").value
    speeds = [source_value(f"speed_{cor}") for cor in COEFFICIENTS]
    relative = [(speed.error or 0.0) / speed.value for speed in speeds]
    of_tau = [part * path / speed.value for part, speed in zip(relative, speeds, strict=True)]
    of_theory = [
        part * -2 * math.log(cor) * speed.value / path
        for part, cor, speed in zip(relative, COEFFICIENTS, speeds, strict=True)
    ]
    checks = {}
    for name, errors, places in (("tau", of_tau, 2), ("theory", of_theory, 3)):
        printed = [source_value(f"{name}_{cor}") for cor in COEFFICIENTS]

        def same(numbers: Sequence[SourceValue], errors: Sequence[float] = errors) -> list[bool]:
            return [
                abs(error - (number.error or 0.0)) <= number.half_digit
                for error, number in zip(errors, numbers, strict=True)
            ]

        text = "those of ⟨v⟩ make them " + " and ".join(f"± {one:.{places}f}" for one in errors)
        if any(same(printed[::-1])):
            text += "; the two look exchanged"
        checks[f"errors_of_{name}"] = (text, all(same(printed)))
    return checks


def _cooling_checks(run: Run, stated: StatedResults) -> dict[str, Check]:
    """Claims on energy, temperature and pressure, for the stated scene."""
    (elastic,) = _points(run, cor=1.0)
    off = max(float(np.abs(energy_ratio(series(t)) - 1).max()) for t in run.traces(elastic))
    better, total, squares = 0, 0, []
    for cor, laws in stated.laws.items():
        exponential, haff = (laws["kinetic_energy", law] for law in ("exponential", "haff"))
        better += sum(
            other.rms_residual < one.rms_residual
            for one, other in zip(exponential.fits, haff.fits, strict=True)
        )
        total += len(haff.fits)
        squares.append(f"{exponential.r_squared:.3f} against {haff.r_squared:.3f} at CoR {cor:g}")
    numbers = stated.numbers
    apart = max(
        abs(numbers[f"temperature_one_{cor}"].value / numbers[f"energy_one_{cor}"].value - 1)
        for cor in COEFFICIENTS
    )
    local = list(stated.local.values())
    low, high = (numbers[f"tau_{cor}"].value for cor in COEFFICIENTS)
    return {
        "energy_conserved": (f"ours: to {short(off, 1)}", off < ROUNDING),
        "exponential": (
            f"Haff's law has the smaller residual in {better} of {total} repeats; R² is "
            + ", ".join(squares),
            2 * better < total,
        ),
        "temperature_follows": (
            f"ours: to {short(apart, 1)}, the share of the container",
            apart < CLOSE,
        ),
        "half_rate": (
            "ours: in time windows "
            + " and ".join(with_error(ratio.value, ratio.error) for ratio in local)
            + f" times as fast, at CoR {AT_EACH}; only the mean since the start, which the source "
            "report plots, is slower",
            all(abs(ratio.value - 0.5) < abs(ratio.value - 1) for ratio in local),
        ),
        "tau_longer": (f"ours: {low:.2f} and {high:.2f} s", low > high),
    }


def _ideal_gas_checks(run: Run) -> dict[str, Check]:
    """Claims on elastic balls and the ideal gas law."""
    points = _points(run, balls__speed=getattr(run.experiment.balls, "speed", 0.0))
    radii = distinct(points, "balls.radius")
    means = [float(np.mean([ideal_gas_ratio(t) for t in run.traces(point)])) for point in points]
    smallest = means[radii.index(min(radii))]
    each = [f"{mean:.3f} at {radius:g} m" for radius, mean in zip(radii, means, strict=True)]
    return {
        "small_balls_ideal": (
            f"ours: {100 * (smallest - 1):.1f} % above it",
            abs(smallest - 1) < CLOSE,
        ),
        "worse_with_radius": (f"ours: P V/NT = {listed(each)}", means == sorted(means)),
    }


def _tiny_ball_checks(run: Run) -> dict[str, Check]:
    """Claims on CoR and the ideal gas law, with the radius in the caption of figure 17."""
    points = _points(run, balls__radius=source_value("ratio_caption").radius, cor=COEFFICIENTS)
    means, at_end, early, warm = [], [], 0, []
    for point in points:
        temperatures = []
        for trace in run.traces(point):
            temperatures.append(mean_temperature(trace))
            means.append(ideal_gas_ratio(trace))
            last = trace.finish.kinetic_energy / trace.finish.number
            at_end.append(means[-1] * temperatures[-1] / last)
            early += not trace.stop.reason.complete
        warm.append(Sample.over(temperatures))
    ratio = Sample.over(means)
    low, high = warm
    return {
        "pressure_excess": (
            f"ours below CoR 1: {with_error(ratio.mean, ratio.error)} of the ideal gas's at the "
            f"mean temperature of the same time, {np.mean(at_end):.2f} at the final temperature. "
            "The excess is that of a mean over a final value "
            f"({early} of {len(means)} repeats end in a wall trap)",
            ratio.mean - 1 > 2 * ratio.error and ratio.mean - 1 > CLOSE,
        ),
        "lower_temperatures": (
            "ours: mean temperatures of "
            + " and ".join(f"{with_error(one.mean, one.error)} J" for one in warm)
            + f" at CoR {AT_EACH}",
            high.mean - low.mean > 2 * math.hypot(low.error, high.error),
        ),
    }


def _speed_check(run: Run) -> Check:
    """The distribution of speeds against that of Maxwell and Boltzmann."""
    counts = sum(reduced_speed_counts(trace) for point in run.points for trace in run.traces(point))
    shares = np.cumsum(counts) / np.sum(counts)
    edges = np.arange(1, len(shares) + 1, dtype=np.float64) * np.float64(SPEED_BIN)
    # The reduced speed v √(m/2T) is the speed of a ball of mass 1 at this temperature.
    law = theory.maxwell_speed_cdf(edges, REDUCED_TEMPERATURE)
    number = starting_scene(run.experiment, 0).number
    finite = theory.fixed_energy_speed_cdf(edges, number, REDUCED_TEMPERATURE)
    off, expected = (float(np.abs(each - law)[:-1].max()) for each in (shares, finite))
    return (
        f"ours: cumulative shares are at most {off:.3f} apart; theory gives {expected:.3f} for "
        f"{number} balls at fixed energy",
        off < CLOSE,
    )
