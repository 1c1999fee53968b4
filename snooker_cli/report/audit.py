"""The audit: every printed number next to ours for the stated scene; every sentence checked."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis.decay import Decay, decays, reported_constant
from snooker_cli.analysis.fitting import LEAST_PROBABILITY, hotelling
from snooker_cli.analysis.measurement import pairs_of, relaxation, relaxed_at
from snooker_cli.analysis.observables import (
    ROUNDING,
    at_collisions,
    central_distances,
    complete_repeats,
    energy_ratio,
    ideal_gas_ratio,
    mean_and_error,
    mean_free_path,
    mean_pressure,
    mean_speed,
    mean_temperature,
    momentum,
    pair_distances,
    pressures,
    reduced_speed_counts,
    series,
    so_far,
    standard_errors,
    time_means,
)
from snooker_cli.analysis.predictions import finite_ratio, speed_laws
from snooker_cli.figures import Selection, selected
from snooker_cli.figures.selection import distinct, value_at
from snooker_cli.formatting import listed, ratio, short
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report.explanations import GROUP, Explanations
from snooker_cli.report.source_values import (
    CLAIMS,
    CLOSE,
    COEFFICIENTS,
    SOURCE_VALUES,
    OurValue,
    Sample,
    SourceValue,
    at_each_coefficient,
    value_text,
)
from snooker_cli.runs import Run
from snooker_cli.scene import Scene
from snooker_cli.trace import Trace

Runs = Mapping[str, Run]
Laws = Mapping[tuple[str, str], Decay]


@dataclass(frozen=True)
class StatedResults:
    """Results of the scene as the source report states it, over its complete repeats.

    numbers : by the name of the printed number
    scene : the start of a repeat
    laws : by CoR, the decay constants by quantity and law
    mean_free_path, relaxed_path : measured at CoR 1, of the whole repeats and after relaxation, m
    windows : by CoR, the gas in windows of time
    mean_pressure_slopes : by CoR, d ln P/d ln E of the mean pressure since the start
    groups : by CoR, the number of groups of ``GROUP`` repeats, and of those that do not refuse
        Haff's law
    """

    numbers: dict[str, OurValue]
    scene: Scene
    laws: Mapping[float, Laws]
    mean_free_path: OurValue
    relaxed_path: OurValue
    windows: Mapping[float, "InWindows"]
    mean_pressure_slopes: Mapping[float, OurValue]
    groups: Mapping[float, tuple[int, int]]


WINDOWS = 8

SETTLED = 0.75
"""Time from which the mean pressure since the start falls, s; before, it is that of a few hits."""


@dataclass(frozen=True)
class InWindows:
    """A gas in ``WINDOWS`` equal windows of time, up to the end of the shortest repeat.

    ratios : P V/(N T) of the means over repeats in each window, with standard errors
    theory : P V/(N T) of this many hard disks of this size and CoR in the container
    probability : that of deviations as large if all ratios are that (Hotelling's test); nan for too
        few repeats
    cooling : T of the first window over that of the last
    repeats, end : number of repeats; end of the last window, s
    """

    ratios: list[OurValue]
    theory: float
    probability: float
    cooling: float
    repeats: int
    end: float


def in_windows(traces: Sequence[Trace]) -> InWindows:
    """Complete repeats of a point in windows of time."""
    end, repeats = min(trace.stop.time for trace in traces), len(traces)
    edges, area = np.linspace(0.0, end, WINDOWS + 1), traces[0].start.container.area
    work = area * np.array([pressures(trace, edges) for trace in traces])
    energy = np.array([time_means(t, series(t).kinetic_energy, edges) for t in traces])
    ratios = work.mean(axis=0) / energy.mean(axis=0)
    errors = standard_errors(work - ratios * energy) / energy.mean(axis=0)  # to first order
    scene = traces[0].start
    disks = finite_ratio(scene.number, float(scene.radii[0]), scene.container, scene.restitution)
    expected = disks.pressure if disks else math.nan
    probability, excess = math.nan, (work - expected * energy) / energy.mean(axis=0)
    if repeats > WINDOWS:
        mean, covariance = excess.mean(axis=0), np.cov(excess, rowvar=False) / repeats
        squares = float(mean @ np.linalg.solve(covariance, mean))
        probability = hotelling(squares, WINDOWS, repeats)[1]
    cooling = float(energy[:, 0].mean() / energy[:, -1].mean())
    values = list(map(OurValue, ratios, errors))
    return InWindows(values, expected, probability, cooling, repeats, end)


def mean_pressure_slope(traces: Sequence[Trace]) -> OurValue:
    """d ln P/d ln E, with the mean pressure P since the start and the energy E of the balls.

    It is the ratio of the mean changes of both logarithms over repeats of a point, from
    ``SETTLED`` to the end of the shortest one. Haff's law has 1/2: P goes as 1/(1 + αt).
    """
    times = np.array([SETTLED, min(trace.stop.time for trace in traces)])
    logs = np.log(
        [
            [
                so_far(t, series(t).wall_impulse, times) / times,
                so_far(t, series(t).kinetic_energy, times),
            ]
            for t in traces
        ]
    )
    pressure, energy = np.diff(logs, axis=2)[..., 0].T
    slope = float(pressure.mean() / energy.mean())
    error = standard_errors(pressure - slope * energy) / abs(energy.mean())  # to first order
    return OurValue(slope, float(error))


def groups_that_hold(traces: Sequence[Trace], size: int = GROUP) -> tuple[int, int]:
    """Number of groups of successive repeats, and of those that do not refuse Haff's law."""
    probabilities = [
        next(
            decay for decay in decays(group, ("kinetic_energy",)) if decay.law == "haff"
        ).goodness.probability
        for group in (traces[k : k + size] for k in range(0, len(traces) - size + 1, size))
    ]
    return len(probabilities), sum(p >= LEAST_PROBABILITY for p in probabilities)


def stated_results(runs: Runs) -> StatedResults:
    """Our value of every printed number, and what the claims are checked with."""
    run = runs["restitution"]
    elastic = complete_repeats(run.traces(selected(run, Selection({"cor": 1.0}))[0]))
    scene = elastic[0].start
    samples: dict[tuple[str, float | None], Sample] = {
        ("pressure", None): Sample(map(mean_pressure, elastic))
    }
    laws: dict[float, Laws] = {}
    windows, slopes, groups = {}, {}, {}
    for cor in COEFFICIENTS:
        # The figures have read and fitted these repeats.
        traces = complete_repeats(run.traces(selected(run, Selection({"cor": cor}))[0]))
        laws[cor] = {(decay.quantity, decay.law): decay for decay in decays(traces)}
        windows[cor], slopes[cor] = in_windows(traces), mean_pressure_slope(traces)
        groups[cor] = groups_that_hold(traces)
        for quantity, sample in _cooling(cor, traces, laws[cor]).items():
            samples[quantity, cor] = sample
    density = scene.number / scene.container.area
    radius = float(scene.radii[0])
    single = {
        **_extremes(runs["decay"]),
        "density": OurValue(density),
        "cross-section": OurValue(2 * math.pi * radius),
        "mean free path": OurValue(theory.source_mean_free_path(density, radius)),
    }

    def ours(number: SourceValue) -> OurValue:
        if number.quantity in ("temperature ratio", "pressure ratio"):
            return _ideal_gas_limit(runs, number)
        sample = samples.get((number.quantity, number.cor))
        return single[number.quantity] if sample is None else sample.our_value(number)

    numbers = {name: ours(number) for name, number in SOURCE_VALUES.items()}
    skipped = relaxation(scene.number, pairs_of(elastic))
    paths = [
        (mean_free_path(trace), mean_free_path(trace, relaxed_at(trace, skipped) or math.nan))
        for trace in elastic
    ]
    whole, relaxed = (OurValue(*mean_and_error(column)) for column in np.array(paths).T)
    return StatedResults(numbers, scene, laws, whole, relaxed, windows, slopes, groups)


def _cooling(cor: float, traces: Sequence[Trace], laws: Laws) -> dict[str, Sample]:
    fitted = {"energy": "kinetic_energy", "temperature": "temperature", "pressure": "pressure"}
    fitted_decays = {
        f"{name} decay": Sample(x.value for x in laws[key, "exponential"].fits if x.converged)
        for name, key in fitted.items()
    }
    by_theory = [reported_constant(trace) for trace in traces]
    return fitted_decays | {
        "pressure decay, doubled": Sample(2 * fitted_decays["pressure decay"].values),
        "mean speed": Sample(map(mean_speed, traces)),
        "theory": Sample(by_theory),
        "tau": Sample(-2 * math.log(cor) / constant for constant in by_theory),
    }


def _extremes(run: Run) -> dict[str, OurValue]:
    largest, smallest, momenta = -math.inf, math.inf, []
    for trace in (trace for point in run.points for trace in run.traces(point)):
        states = at_collisions(trace)
        largest = max(largest, float(central_distances(states).max()))
        smallest = min(smallest, float(pair_distances(states, trace.start).min()))
        total = momentum(states.velocities, states.container_velocities, trace.start)
        momenta.append(total / total[0])
    ratios = np.vstack(momenta)
    x, y = ratios[np.abs(ratios - 1).argmax(axis=0), [0, 1]].tolist()
    return {
        "central distance": OurValue(largest),
        "pair distance": OurValue(smallest),
        "momentum x": OurValue(x),
        "momentum y": OurValue(y),
    }


def _ideal_gas_limit(runs: Runs, number: SourceValue) -> OurValue:
    """A ratio to the ideal gas at CoR 1 for small balls; it should be 1."""
    inverted = number.quantity == "temperature ratio"
    if inverted:
        run = runs["radius"]
        point = min(run.points, key=lambda point: float(value_at(point, "balls.radius")))
    else:
        run = runs["dilute"]
        (point,) = selected(run, Selection({"cor": 1.0, "balls.radius": number.radius}))
    traces = complete_repeats(run.traces(point))
    scene = traces[0].start
    radius = float(scene.radii[0])
    disks = theory.fluid_state(scene.number, 1.0, radius, scene.container).pressure
    expected = disks / theory.ideal_gas_pressure(scene.number, 1.0, scene.container.area)
    ratios = np.array([ideal_gas_ratio(trace) for trace in traces])
    if inverted:
        ratios, expected = 1 / ratios, 1 / expected
    return OurValue(*mean_and_error(ratios), abs(expected - 1))


Checks = dict[str, tuple[bool | None, dict[str, Any]]]
"""By the name of a claim: whether it holds, and what the text of the check refers to."""


def checked_claims(runs: Runs, stated: StatedResults) -> list[dict[str, Any]]:
    """Every sentence about results that a number can decide, with our check and its result.

    Keys: ``name``, ``where``, ``claim``, ``check`` (in words), ``holds``; ``None`` if nothing
    decides.
    """
    ratios = [value_text(stated.numbers[name]) for name in ("ratio_text", "ratio_caption")]
    checks: Checks = {
        "radius_of_figure_17": (None, {"ratios": listed(ratios)}),
        **_cooling_checks(runs["decay"], stated),
        **_ideal_gas_checks(runs["temperature"]),
        **_tiny_ball_checks(runs["sliding"], stated.numbers["ratio_caption"]),
        "maxwell_boltzmann": _speed_check(runs["speeds"]),
    }
    rows = []
    for name, claim in CLAIMS.items():
        # The numbers of the source report decide some sentences alone.
        holds, values = checks.get(name, (claim.get("holds"), {}))
        check = claim["check"].format(**values)
        row = {"name": name, "where": claim["where"], "claim": claim["text"], "check": check}
        rows.append({**row, "holds": None if holds is None else bool(holds)})
    return rows


def _cooling_checks(run: Run, stated: StatedResults) -> Checks:
    (elastic,) = selected(run, Selection({"cor": 1.0}))
    off = max(float(np.abs(energy_ratio(series(t)) - 1).max()) for t in run.traces(elastic))
    holds, judged, local = True, [], []
    for cor, laws in stated.laws.items():
        exponential, haff = (
            laws["kinetic_energy", law].goodness for law in ("exponential", "haff")
        )
        holds = holds and exponential.probability >= LEAST_PROBABILITY
        chi, of_haff = (ratio(law.chi_squared_per_degree) for law in (exponential, haff))
        judged.append(f"{chi} against {of_haff} at CoR {cor:g}")
        windows = (laws[name, "exponential"].fits for name in ("local_pressure", "local_energy"))
        pairs = zip(*windows, strict=True)
        both = [pair for pair in pairs if all(fit.converged for fit in pair)]
        local.append(Sample(pressure.value / energy.value for pressure, energy in both))
    numbers = stated.numbers
    apart = max(
        abs(numbers[f"temperature_one_{cor}"].value / numbers[f"energy_one_{cor}"].value - 1)
        for cor in COEFFICIENTS
    )
    low, high = (numbers[f"tau_{cor}"].value for cor in COEFFICIENTS)
    return {
        "energy_conserved": (off < ROUNDING, {"off": short(off, 1)}),
        "exponential": (holds, {"judged": listed(judged)}),
        "temperature_follows": (apart < CLOSE, {"apart": short(apart, 1)}),
        "half_rate": (
            all(abs(ratio.value - 0.5) < abs(ratio.value - 1) for ratio in local),
            {
                "ratios": listed([value_text(ratio) for ratio in local]),
                "of_mean": listed([*map(value_text, stated.mean_pressure_slopes.values())]),
                "since": SETTLED,
            },
        ),
        "tau_longer": (low > high, {"low": low, "high": high}),
    }


def _ideal_gas_checks(run: Run) -> Checks:
    points = selected(run, Selection({"balls.speed": getattr(run.experiment.balls, "speed", 0.0)}))
    radii = distinct(points, "balls.radius")
    means = [float(np.mean([ideal_gas_ratio(t) for t in run.traces(point)])) for point in points]
    above = means[radii.index(min(radii))] - 1
    ratios = [f"{mean:.3f} at {radius:g} m" for radius, mean in zip(radii, means, strict=True)]
    return {
        "small_balls_ideal": (abs(above) < CLOSE, {"above": 100 * above}),
        "worse_with_radius": (means == sorted(means), {"ratios": listed(ratios)}),
    }


def _tiny_ball_checks(run: Run, elastic: OurValue) -> Checks:
    """Claims on CoR and the ideal gas law, with the radius in the caption of figure 17.

    Most repeats would end in a wall trap, so these are the ones with balls that slide on.
    elastic : P V/(N T) at CoR 1
    """
    radius = SOURCE_VALUES["ratio_caption"].radius
    means, ends, warm = [], [], []
    where = {"balls.radius": radius, "cor": COEFFICIENTS, "collapse": "slide"}
    points = selected(run, Selection(where))
    for point in points:
        traces, temperatures, ratios, at_end = complete_repeats(run.traces(point)), [], [], []
        for trace in traces:
            temperatures.append(mean_temperature(trace))
            ratios.append(ideal_gas_ratio(trace))
            last = trace.finish.kinetic_energy / trace.finish.number
            at_end.append(ratios[-1] * temperatures[-1] / last)
        warm.append(Sample(temperatures))
        means.append(Sample(ratios))
        ends.append(Sample(at_end))
    every = np.concatenate([sample.values for sample in means])
    ratio, (low, high) = Sample(every), warm
    least = ends[0]
    grows = abs(elastic.value - 1) - abs(least.value - 1)
    by_cor, ends_by_cor = (at_each_coefficient([*map(value_text, each)]) for each in (means, ends))
    return {
        "pressure_excess": (
            ratio.value - 1 > max(2 * ratio.error, CLOSE),
            {
                "ratio": value_text(ratio),
                "least": every.min(),
                "most": every.max(),
                "at_end": np.mean([sample.value for sample in ends]),
                "complete": len(every),
                "total": len(points) * run.experiment.repeats,
            },
        ),
        "divergence": (
            grows > 2 * math.hypot(elastic.error, least.error),
            {"ratios": f"{by_cor}; {value_text(elastic)} at CoR 1", "at_end": ends_by_cor},
        ),
        "lower_temperatures": (
            high.value - low.value > 2 * math.hypot(low.error, high.error),
            {"low": value_text(low), "high": value_text(high)},
        ),
    }


def _speed_check(run: Run) -> tuple[bool, dict[str, Any]]:
    counts = sum(reduced_speed_counts(trace) for point in run.points for trace in run.traces(point))
    shares = np.cumsum(counts)[:-1] / np.sum(counts)
    scene = starting_scene(run.experiment, 0)
    maxwell, fixed_energy, *_ = (law.shares[1:] for law in speed_laws(scene))
    off, expected = (float(np.abs(law - maxwell).max()) for law in (shares, fixed_energy))
    return off < CLOSE, {"off": off, "expected": expected, "number": scene.number}


REPRODUCED = "reproduced"
FOLLOWS = "from its own numbers"
FORMULA = "one formula fits"
EXPLAINED = "explained"
UNEXPLAINED = "not explained"


@dataclass(frozen=True)
class AuditRow:
    """A printed number and the verdict on it.

    ours : our value for the stated scene
    common : our value for the best combination of explanations; ``None`` if it gives none
    explanation, explained : the first that agrees with this number alone, or the nearest: in words,
        and its value
    chance : share of a decade around the printed number that an explanation agrees with; ``None``
        unless explanations decide
    """

    number: SourceValue
    ours: OurValue
    common: OurValue | None
    verdict: str
    explanation: str = ""
    explained: OurValue | None = None
    chance: float | None = None


@dataclass(frozen=True)
class Audit:
    """The whole audit.

    claims : see ``checked_claims``
    stated : results of the scene as the source report states it
    repeats, complete : behind our values below CoR 1, and how many of them are complete
    """

    rows: tuple[AuditRow, ...]
    claims: list[dict[str, Any]]
    explanations: Explanations
    stated: StatedResults
    repeats: int
    complete: int

    def row(self, name: str) -> AuditRow:
        """The row of a printed number."""
        return next(row for row in self.rows if row.number.name == name)

    @property
    def by_explanation(self) -> list[AuditRow]:
        """The rows that explanations decide."""
        return [row for row in self.rows if row.chance is not None]

    def as_json(self) -> dict[str, Any]:
        """All numbers of the audit."""
        slopes = {f"{cor:g}": asdict(one) for cor, one in self.stated.mean_pressure_slopes.items()}
        return {
            "slip": self.explanations.factor,
            "tried": self.explanations.tried,
            "possible": [one.name for one in self.explanations.possible],
            "mean_pressure_slopes": slopes,
            "mean_free_path": asdict(self.stated.mean_free_path),
            "complete": self.complete,
            "explanations": [explanation.as_json() for explanation in self.explanations.named],
            "numbers": [asdict(row) for row in self.rows],
            "claims": self.claims,
        }


def audit(runs: Runs, explanations: Explanations) -> Audit:
    """The audit from the runs of the reproduction and the explanations from two of them.

    Raises ``RunError`` or ``StoreError`` for a run that cannot be read.
    """
    stated = stated_results(runs)
    return Audit(
        rows=tuple(_row(number, stated, explanations) for number in SOURCE_VALUES.values()),
        claims=checked_claims(runs, stated),
        explanations=explanations,
        stated=stated,
        repeats=len(COEFFICIENTS) * runs["restitution"].experiment.repeats,
        complete=sum(
            len(laws["kinetic_energy", "exponential"].fits) for laws in stated.laws.values()
        ),
    )


def _row(number: SourceValue, stated: StatedResults, explanations: Explanations) -> AuditRow:
    """The verdict: from the stated scene if that agrees, else a formula, else an explanation."""
    ours, common = stated.numbers[number.name], explanations.best.our_value(number)
    # The first answer that fits counts: the stated scene, a formula, then an explanation.
    if ours.agrees(number):
        return AuditRow(number, ours, common, REPRODUCED)
    if number.follows:
        return AuditRow(number, ours, common, FOLLOWS, number.follows)
    formulas = _path_and_section(stated, explanations.factor)
    if number.name in formulas:
        text, value = formulas[number.name]
        verdict = FORMULA if value.rounds_to(number) else UNEXPLAINED
        return AuditRow(number, ours, common, verdict, text, value)
    offer = explanations.simplest(number)
    if offer is None:
        return AuditRow(number, ours, common, UNEXPLAINED)
    verdict = EXPLAINED if offer[1].agrees(number) else UNEXPLAINED
    chance = explanations.chance(number)
    return AuditRow(number, ours, common, verdict, offer[0].name, offer[1], chance)


def _path_and_section(stated: StatedResults, factor: float) -> dict[str, tuple[str, OurValue]]:
    density, radius = stated.numbers["density"].value, float(stated.scene.radii[0])
    path = theory.mean_free_path(density, radius)
    implied = 1 / (math.sqrt(2) * density * SOURCE_VALUES["mean_free_path"].value)
    return {
        "mean_free_path": (
            f"{factor:g} × 1/(√2 n 4r) at r = {radius:g} m, or that of r = {radius / factor:g} m",
            OurValue(factor * path),
        ),
        "cross_section": (
            f"what its λ needs, which is 4r at r = {implied / 4:.4f} m",
            OurValue(implied),
        ),
    }
