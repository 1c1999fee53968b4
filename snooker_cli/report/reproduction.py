"""The report's sentences that can be checked, checked with its own numbers and with ours."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import containers, theory
from snooker_cli.analysis.decay import Decay, Law, Quantity, decays, reported_constant
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
    PUBLISHED,
    OurValue,
    Property,
    SourceValue,
    published,
)
from snooker_cli.trace import SPEED_BIN

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.runs import Run
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace


# Our value of every printed number, for the scene exactly as the report states it.

Runs = Mapping[str, "Run"]
Laws = Mapping[tuple[Quantity, Law], Decay]


@dataclass(frozen=True)
class Stated:
    """What the stated scene gives.

    numbers : by the name of the printed number
    scene : the start of a repeat
    laws : by CoR, the decay constants over all repeats
    local : by CoR, how many times as fast as the energy the pressure decays in windows of time
    """

    numbers: dict[str, OurValue]
    scene: Scene
    laws: Mapping[float, Laws]
    local: dict[float, OurValue]


def as_stated(runs: Runs) -> Stated:
    """Our value of every printed number, and what the report's sentences are checked with."""
    whole = runs["restitution"]
    elastic = list(whole.traces(point_of(whole, cor=1.0)))
    scene = elastic[0].start
    singles = {**_exact(runs["decay"]), **_of_the_scene(scene)}
    samples: dict[tuple[Property, float | None], Sample] = {
        ("pressure", None): Sample.over([mean_pressure(trace) for trace in elastic])
    }
    laws: dict[float, Laws] = {}
    local = {}
    for cor in COEFFICIENTS:
        traces = list(whole.traces(point_of(whole, cor=cor)))
        laws[cor] = {(one.quantity, one.law): one for one in decays(traces)}
        local[cor] = _local_ratio(laws[cor])
        for of, sample in _cooling(cor, traces, laws[cor]).items():
            samples[of, cor] = sample
    numbers = {}
    for number in PUBLISHED:
        if number.of in ("temperature ratio", "pressure ratio"):
            numbers[number.name] = _limit(runs, number.of, number.radius)
        elif number.of in singles:
            numbers[number.name] = singles[number.of]
        else:
            numbers[number.name] = samples[number.of, number.cor].beside(number)
    return Stated(numbers, scene, laws, local)


def point_of(run: Run, **values: float) -> Point:
    """The first point with these values; in keys, ``__`` stands for a point."""
    where = {key.replace("__", "."): value for key, value in values.items()}
    return selected(run, Selection(where))[0]


def _cooling(cor: float, traces: Sequence[Trace], laws: Laws) -> dict[Property, Sample]:
    """What the report takes from its inelastic runs."""

    def constants(quantity: Quantity) -> Sample:
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


def _exact(run: Run) -> dict[Property, OurValue]:
    """The extremes over all repeats of the scene of the figures: distances and momentum."""
    largest, smallest, worst = -math.inf, math.inf, np.ones(2)
    for point in run.points:
        for trace in run.traces(point):
            states = at_collisions(trace)
            largest = max(largest, float(central_distances(states).max()))
            smallest = min(smallest, float(pair_distances(states, trace.start).min()))
            total = momentum(states, trace.start)
            ratios = total / total[0]
            found = np.take_along_axis(ratios, np.abs(ratios - 1).argmax(axis=0)[None], axis=0)[0]
            worst = np.where(np.abs(found - 1) > np.abs(worst - 1), found, worst)
    return {
        "central distance": OurValue(largest),
        "pair distance": OurValue(smallest),
        "momentum x": OurValue(float(worst[0])),
        "momentum y": OurValue(float(worst[1])),
    }


def _of_the_scene(scene: Scene) -> dict[Property, OurValue]:
    """What follows from the scene alone, by the report's formulas."""
    density = theory.number_density(scene.number, scene.area)
    radius = float(scene.radii[0])
    return {
        "density": OurValue(density),
        "cross-section": OurValue(2 * math.pi * radius),
        "mean free path": OurValue(theory.report_mean_free_path(density, radius)),
    }


def _limit(runs: Runs, of: Property, radius: float | None) -> OurValue:
    """A ratio to the ideal gas of elastic balls so small that it should be 1."""
    if of == "temperature ratio":
        run = runs["radius"]
        point = min(run.points, key=lambda point: float(value_at(point, "balls.radius")))
    else:
        run = runs["dilute"]
        point = selected(run, Selection({"cor": 1.0, "balls.radius": radius}))[0]
    traces = list(run.traces(point))
    scene = traces[0].start
    radius = float(scene.radii[0])
    circle = containers.circle(scene.container_radius, radius)
    disks = theory.fluid_state(scene.number, 1.0, radius, circle).pressure
    expected = disks / theory.ideal_gas_pressure(scene.number, 1.0, scene.area)
    ratios = np.array([ideal_gas_ratio(trace) for trace in traces])
    if of == "temperature ratio":
        ratios, expected = 1 / ratios, 1 / expected
    return OurValue(*mean_and_error(ratios), abs(expected - 1))


def _local_ratio(laws: Laws) -> OurValue:
    """Decay constant of the pressure in windows of time over that of the energy in the same."""
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
class Claim:
    """A sentence of the report, where it stands, what the check gives, and whether it holds."""

    where: str
    claim: str
    check: str
    holds: bool


def claims(runs: Runs, stated: Stated) -> tuple[Claim, ...]:
    """Every sentence about results that has a number, or that a number can decide."""
    return (
        *_agreements(),
        *_contradictions(stated),
        *_uncertainties(),
        *_cooling_claims(runs["decay"], stated),
        *_ideal_gas(runs),
        *_tiny_balls(runs["dilute"]),
        _speeds(runs["speeds"]),
    )


def _agreements() -> Iterator[Claim]:
    """The report's "within 5 %", with its own numbers."""
    low, high = COEFFICIENTS
    for where, name, other, what in (
        ("abstract", f"energy_abstract_{low}", f"theory_{low}", "k is {} of its theory"),
        ("III A", f"energy_mean_{low}", f"theory_{low}", "k is {} of its theory"),
        ("abstract", f"energy_mean_{high}", f"theory_{high}", "k is {} of its theory"),
        ("III B", f"doubled_{low}", f"energy_mean_{low}", "twice the pressure's k is {} of k"),
        ("III B", f"doubled_{high}", f"energy_mean_{high}", "twice the pressure's k is {} of k"),
    ):
        first, second = published(name), published(other)
        off = abs(first.value / second.value - 1)
        yield Claim(
            where,
            f"At CoR {first.cor:g} {what.format(f'within {100 * CLOSE:g} %')}.",
            f"{first.digits} against {second.digits}: {100 * off:.1f} % apart",
            off <= CLOSE,
        )


def _contradictions(stated: Stated) -> Iterator[Claim]:
    """Where the report says two things."""
    short_k, long_k = published("pressure_abstract_0.9"), published("pressure_mean_0.9")
    yield Claim(
        short_k.where,
        f"The {short_k.what} is {short_k.printed}.",
        f"{long_k.where} has {long_k.printed}",
        short_k.value == long_k.value,
    )
    text, caption = published("ratio_text"), published("ratio_caption")
    given = [
        with_error(stated.numbers[one.name].value, stated.numbers[one.name].error)
        for one in (text, caption)
    ]
    yield Claim(
        text.where,
        f"Figure 17 has balls of {text.radius:g} m.",
        f"its caption says {caption.radius:g} m; the ratio at CoR 1 is {given[0]} and {given[1]} "
        "there, so that it cannot tell which",
        text.radius == caption.radius,
    )
    yield Claim(
        "abstract",
        "The divergence from the ideal gas law grows when CoR increases.",
        "III C says that it grows as CoR decreases",
        False,
    )
    density, section = published("density"), published("cross_section")
    path = published("mean_free_path")
    own = 1 / (math.sqrt(2) * density.value * section.value)
    yield Claim(
        path.where,
        "λ is 1/(√2 n σ).",
        f"its n = {density.digits} and σ = {section.digits} give {own:.2f} m, not {path.digits} m",
        OurValue(own).agrees(path),
    )


def _uncertainties() -> Iterator[Claim]:
    """What the uncertainties of the mean speeds make of those of τ and k."""
    path = published("mean_free_path").value
    of_tau, of_constant = [], []
    for cor in COEFFICIENTS:
        speed = published(f"speed_{cor}")
        relative = (speed.error or 0.0) / speed.value
        of_tau.append(relative * path / speed.value)
        of_constant.append(relative * -2 * math.log(cor) * speed.value / path)
    for name, symbol, own, places in (("tau", "τ", of_tau, 2), ("theory", "k", of_constant, 3)):
        numbers = [published(f"{name}_{cor}") for cor in COEFFICIENTS]
        printed = " and ".join(f"± {number.uncertainty}" for number in numbers)
        following = " and ".join(f"± {value:.{places}f}" for value in own)
        crossed = [_rounds(a, b) for a, b in zip(own, reversed(numbers), strict=True)]
        yield Claim(
            numbers[0].where,
            f"The uncertainties of {symbol} by its theory are {printed}.",
            f"those of ⟨v⟩ make them {following}"
            + ("; the two look exchanged" if any(crossed) else ""),
            all(_rounds(a, b) for a, b in zip(own, numbers, strict=True)),
        )


def _rounds(value: float, number: SourceValue) -> bool:
    """Whether a value is the number's uncertainty to its last digit."""
    return abs(value - (number.error or 0.0)) <= number.half_digit


def _cooling_claims(run: Run, stated: Stated) -> Iterator[Claim]:
    """Sentences on energy, temperature and pressure, for the scene as stated."""
    elastic = selected(run, Selection({"cor": 1.0}))[0]
    off = max(float(np.abs(energy_ratio(series(t)) - 1).max()) for t in run.traces(elastic))
    yield Claim(
        "fig. 3", "Energy is conserved at CoR 1.", f"ours: to {short(off, 1)}", off < ROUNDING
    )
    better, total, squares = 0, 0, []
    for cor in COEFFICIENTS:
        laws = stated.laws[cor]
        one, haff = (laws["kinetic_energy", law] for law in ("exponential", "haff"))
        better += sum(
            b.rms_residual < a.rms_residual for a, b in zip(one.fits, haff.fits, strict=True)
        )
        total += len(one.fits)
        squares.append(f"{one.r_squared:.3f} against {haff.r_squared:.3f} at CoR {cor:g}")
    yield Claim(
        "III A, fig. 3",
        "Energy decays exponentially below CoR 1.",
        f"Haff's law leaves the smaller residual in {better} of {total} repeats: R² = "
        + ", ".join(squares),
        2 * better < total,
    )
    apart = max(
        abs(
            stated.numbers[f"temperature_one_{cor}"].value
            / stated.numbers[f"energy_one_{cor}"].value
            - 1
        )
        for cor in COEFFICIENTS
    )
    yield Claim(
        "figs. 8, 9",
        "Temperature decays as energy does.",
        f"ours: to {short(apart, 1)}, the share of the container",
        apart < CLOSE,
    )
    ratios = [stated.local[cor] for cor in COEFFICIENTS]
    yield Claim(
        "II C",
        "Pressure decays at half the rate of energy.",
        "ours: in windows of time "
        + " and ".join(with_error(ratio.value, ratio.error) for ratio in ratios)
        + f" times as fast, at CoR {' and '.join(f'{cor:g}' for cor in COEFFICIENTS)}; only the "
        "mean since the start, which the report plots, lags behind",
        all(abs(ratio.value - 0.5) < abs(ratio.value - 1) for ratio in ratios),
    )
    low, high = (stated.numbers[f"tau_{cor}"].value for cor in COEFFICIENTS)
    yield Claim(
        "III A", "τ is longer at the smaller CoR.", f"ours: {low:.2f} and {high:.2f} s", low > high
    )


def _ideal_gas(runs: Runs) -> Iterator[Claim]:
    """Sentences on elastic balls and the ideal gas law."""
    run = runs["temperature"]
    speed = getattr(run.experiment.balls, "speed", 0.0)
    points = selected(run, Selection({"balls.speed": speed}))
    radii = distinct(points, "balls.radius")
    ratios = [Sample.over([ideal_gas_ratio(t) for t in run.traces(point)]) for point in points]
    smallest = min(zip(radii, ratios, strict=True))
    yield Claim(
        "fig. 13",
        f"At r = {smallest[0]:g} m simulation and ideal gas nearly overlap.",
        f"ours: {100 * (smallest[1].mean - 1):.1f} % above it",
        abs(smallest[1].mean - 1) < CLOSE,
    )
    means = [ratio.mean for ratio in ratios]
    each = [f"{mean:.3f} at {radius:g} m" for radius, mean in zip(radii, means, strict=True)]
    yield Claim(
        "III C, figs. 13–16",
        "The ideal gas law gets worse as the balls grow.",
        f"ours: P V/NT = {listed(each)}",
        means == sorted(means),
    )


def _tiny_balls(run: Run) -> Iterator[Claim]:
    """Sentences on CoR and the ideal gas law, with the caption's radius of figure 17."""
    radius = published("ratio_caption").radius
    points = selected(run, Selection({"balls.radius": radius, "cor": COEFFICIENTS}))
    means, ends, early, warm = [], [], 0, []
    for point in points:
        temperatures = []
        for trace in run.traces(point):
            temperatures.append(mean_temperature(trace))
            means.append(ideal_gas_ratio(trace))
            last = trace.finish.kinetic_energy / trace.finish.number
            ends.append(means[-1] * temperatures[-1] / last)
            early += not trace.stop.reason.complete
        warm.append(Sample.over(temperatures))
    ratio = Sample.over(means)
    error = ratio.deviation / math.sqrt(ratio.count)
    yield Claim(
        "III C, fig. 17",
        "As CoR falls the pressure exceeds the ideal gas's.",
        f"ours below CoR 1: {with_error(ratio.mean, error)} of the ideal gas's at the mean "
        f"temperature of the same time, {np.mean(ends):.2f} at that of its end: the excess is that "
        f"of a mean over a last value ({early} of {len(means)} repeats end in a wall trap)",
        ratio.mean - 1 > 2 * error and ratio.mean - 1 > CLOSE,
    )
    errors = [one.deviation / math.sqrt(one.count) for one in warm]
    yield Claim(
        "III C, fig. 17",
        "Points of smaller CoR lie at lower temperatures.",
        "ours: mean temperatures of "
        + " and ".join(
            f"{with_error(one.mean, error)} J" for one, error in zip(warm, errors, strict=True)
        )
        + f" at CoR {' and '.join(f'{point.experiment.cor:g}' for point in points)}",
        warm[1].mean - warm[0].mean > 2 * math.hypot(*errors),
    )


def _speeds(run: Run) -> Claim:
    """The distribution of speeds against Maxwell and Boltzmann's."""
    counts = sum(reduced_speed_counts(trace) for point in run.points for trace in run.traces(point))
    shares = np.cumsum(counts) / np.sum(counts)
    edges = np.arange(1, len(shares) + 1, dtype=np.float64) * np.float64(SPEED_BIN)
    # The reduced speed v √(m/2T) is the speed of a ball of mass 1 at this temperature.
    law = theory.maxwell_speed_cdf(edges, REDUCED_TEMPERATURE)
    number = starting_scene(run.experiment, 0).number
    finite = theory.fixed_energy_speed_cdf(edges, number, REDUCED_TEMPERATURE)
    off, due = (float(np.abs(each - law)[:-1].max()) for each in (shares, finite))
    return Claim(
        "fig. 18",
        "Speeds follow Maxwell–Boltzmann.",
        f"ours: cumulative shares are at most {off:.3f} apart, where {number} balls at fixed "
        f"energy should be {due:.3f} apart",
        off < CLOSE,
    )
