"""Every number the report prints beside ours for the scene as stated, with what explains it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli import theory
from snooker_cli.compare import compare, measure
from snooker_cli.decay import WINDOWS, decays
from snooker_cli.fit import fit
from snooker_cli.observables import (
    at_collisions,
    central_distances,
    energy_ratio,
    momentum,
    pair_distances,
    series,
)
from snooker_cli.report.published import PUBLISHED, Published, published
from snooker_cli.report.search import TARGETS, Candidate, best, search
from snooker_cli.words import with_error

if TYPE_CHECKING:
    from snooker_cli.results import Run
    from snooker_cli.trace import Trace

REPRODUCED = "reproduced"
EXPLAINED = "not as stated; explained"
LIKELY = 9.488
"""The 95 % point of chi-square with four degrees of freedom."""

UNEXPLAINED = "not as stated; unexplained"


@dataclass(frozen=True)
class Ours:
    """A value of ours and its uncertainty, in the printed number's unit."""

    value: float
    error: float = 0.0


@dataclass(frozen=True)
class Row:
    """A printed number, ours as stated, what explains it best, and the verdict."""

    number: Published
    ours: Ours
    explanation: str
    explained: Ours | None
    verdict: str


@dataclass(frozen=True)
class Claim:
    """A sentence of the report that can be checked, what the check gives, and whether it holds."""

    claim: str
    check: str
    holds: bool


@dataclass(frozen=True)
class Audit:
    """The whole audit.

    finding : the candidate that explains all decay constants best, with its score
    near : how many candidates score below ``LIKELY``
    """

    rows: tuple[Row, ...]
    claims: tuple[Claim, ...]
    finding: Candidate
    score: float
    candidates: int
    near: int


@dataclass(frozen=True)
class Runs:
    """The runs the audit is made from."""

    decay: Run
    radius: Run
    dilute: Run
    audit: Run


def audit(runs: Runs) -> Audit:
    """Measure, search, and judge every printed number."""
    candidates = search(runs.audit)
    finding = best(candidates, TARGETS)
    stated = _as_stated(runs)
    explained = _explanations(finding, runs, stated)
    rows = []
    for number in PUBLISHED:
        ours = stated[number.name]
        explanation, value = explained.get(number.name, ("", None))
        if _same(number, ours):
            rows.append(Row(number, ours, "the scene as stated", None, REPRODUCED))
        else:
            good = value is not None and _same(number, value)
            rows.append(Row(number, ours, explanation, value, EXPLAINED if good else UNEXPLAINED))
    return Audit(
        rows=tuple(rows),
        claims=(*_claims(stated), *_ideal_gas_claims(runs.dilute)),
        finding=finding,
        score=finding.score(TARGETS),
        candidates=len(candidates),
        near=sum(one.score(TARGETS) < LIKELY for one in candidates),
    )


def _same(number: Published, ours: Ours) -> bool:
    """Whether a value is the printed one within twice the uncertainty of both."""
    return abs(ours.value - number.value) <= 2 * math.hypot(number.tolerance, ours.error)


def _as_stated(runs: Runs) -> dict[str, Ours]:
    """Our value of every printed number, for the scene exactly as the report states it."""
    found: dict[str, Ours] = {}
    for point in runs.decay.points:
        cor, traces = point.experiment.cor, list(runs.decay.traces(point))
        if cor == 1.0:
            _elastic(traces, found)
        else:
            _inelastic(cor, traces, found)
    density = theory.number_density(37, 10.0)
    path = theory.report_mean_free_path(density, 1.0)
    found["density"] = Ours(density)
    found["cross_section"] = Ours(2 * math.pi * 1.0)
    found["mean_free_path"] = Ours(path)
    for cor in (0.8, 0.9):
        speed = found[f"speed_{cor}"]
        relative = speed.error / speed.value
        tau = path / speed.value
        constant = theory.report_decay_constant(cor, path, speed.value)
        found[f"tau_{cor}"] = Ours(tau, tau * relative)
        found[f"theory_{cor}"] = Ours(constant, constant * relative)
    smallest = min(runs.radius.points, key=lambda point: point.experiment.balls.radius)  # type: ignore[union-attr]
    ratio = _compared(runs.radius, smallest, "PV/NT")
    found["equipartition"] = Ours(1 / ratio.value, ratio.error)
    elastic = [point for point in runs.dilute.points if point.experiment.cor == 1.0]
    found["dilute"] = _compared(runs.dilute, elastic[0], "PV/NT")
    return found


def _compared(run: Run, point: Any, quantity: str) -> Ours:
    """A measured quantity of a point, mean and standard error over its repeats."""
    row = next(row for row in compare(run.traces(point)) if row.quantity == quantity)
    return Ours(row.measured, row.error)


def _elastic(traces: list[Trace], found: dict[str, Ours]) -> None:
    """What the report takes from its elastic runs."""
    states = at_collisions(traces[0])
    found["largest_distance"] = Ours(float(central_distances(states).max()))
    found["smallest_distance"] = Ours(float(pair_distances(states).min()))
    total = momentum(states, traces[0].start)
    for axis, name in enumerate(("momentum_x", "momentum_y")):
        ratios = total[:, axis] / total[0, axis]
        found[name] = Ours(float(ratios[np.argmax(np.abs(ratios - 1))]))
    row = next(row for row in compare(traces) if row.quantity == "pressure")
    found["pressure"] = Ours(row.measured, row.error)


def _inelastic(cor: float, traces: list[Trace], found: dict[str, Ours]) -> None:
    """What the report takes from its inelastic runs; uncertainties its way, (max - min)/2."""
    laws = {(one.quantity, one.law): one for one in decays(traces)}
    for name, quantity in (("energy", "kinetic_energy"), ("pressure", "pressure")):
        one = laws[quantity, "exponential"]  # type: ignore[index]
        spread = one.over_repeats.max_min_half_range
        found[f"{name}_one_{cor}"] = Ours(one.fits[0].value, one.fits[0].error)
        found[f"{name}_mean_{cor}"] = Ours(one.over_repeats.mean, spread)
    pressure = found[f"pressure_mean_{cor}"]
    found[f"doubled_{cor}"] = Ours(2 * pressure.value, 2 * pressure.error)
    ratios = []
    for trace, pressure_fit in zip(traces, laws["local_pressure", "exponential"].fits, strict=True):
        ratios.append(pressure_fit.value / _windowed_energy_constant(trace))
    error = float(np.std(ratios, ddof=1)) / math.sqrt(len(ratios))
    found[f"local_{cor}"] = Ours(float(np.mean(ratios)), error)
    warm = laws["temperature", "exponential"].over_repeats
    found[f"temperature_{cor}"] = Ours(warm.mean, warm.max_min_half_range)
    speeds = [float(series(trace).mean_speed.mean()) for trace in traces]
    found[f"speed_{cor}"] = Ours(float(np.mean(speeds)), (max(speeds) - min(speeds)) / 2)


def _windowed_energy_constant(trace: Trace) -> float:
    """Exponential constant of the energy's means in the windows of the local pressure, 1/s."""
    found = series(trace)
    energy = energy_ratio(found)
    # The energy is a staircase: its integral is straight between the collisions.
    time = np.append(found.time, trace.stop.time)
    integral = np.concatenate([[0.0], np.cumsum(energy * np.diff(time))])
    edges = np.linspace(0.0, trace.stop.time, WINDOWS + 1)
    means = np.diff(np.interp(edges, time, integral)) / np.diff(edges)
    return fit((edges[:-1] + edges[1:]) / 2, means).value


def _explanations(
    finding: Candidate, runs: Runs, stated: dict[str, Ours]
) -> dict[str, tuple[str, Ours | None]]:
    """What explains each number that does not come out as stated."""
    words = finding.setting.words()
    found: dict[str, tuple[str, Ours | None]] = {}
    for cor in (0.8, 0.9):
        for name in ("energy", "pressure"):
            mean, deviation = finding.values[f"{name}_mean_{cor}"]
            found[f"{name}_mean_{cor}"] = (words, Ours(mean, deviation / math.sqrt(5)))
            found[f"{name}_one_{cor}"] = (words, Ours(mean, deviation))
        mean, deviation = finding.values[f"pressure_mean_{cor}"]
        found[f"doubled_{cor}"] = (words, Ours(2 * mean, 2 * deviation / math.sqrt(5)))
        speed = _speed_in(finding, runs.audit, cor)
        found[f"speed_{cor}"] = ("elastic wall, r = 1 m, 10 m/s", speed)
        printed_path, printed_speed = published("mean_free_path"), published(f"speed_{cor}")
        tau = printed_path.value / printed_speed.value
        found[f"tau_{cor}"] = ("its λ over its ⟨v⟩", Ours(tau))
        found[f"theory_{cor}"] = ("−2 ln(CoR) over its τ", Ours(-2 * math.log(cor) / tau))
    boltzmann = theory.boltzmann_mean_free_path(stated["density"].value, 1.0)
    found["mean_free_path"] = (
        f"ten times 1/(2√2 n d) = {boltzmann:.4f} m of disks with r = 1 m, which is also what "
        "σ = 4r gives with r = 0.1 m",
        Ours(10 * boltzmann),
    )
    implied = 1 / (math.sqrt(2) * stated["density"].value * published("mean_free_path").value)
    found["cross_section"] = (
        f"4r with r = 0.1 m; its own λ implies {implied:.4f} m; its text's 2πr gives neither",
        Ours(4 * 0.1, 0.0005),
    )
    return found


def _speed_in(finding: Candidate, run: Run, cor: float) -> Ours:
    """Mean speed over the collisions in the finding's scene, and its spread, (max - min)/2."""
    setting = finding.setting
    for point in run.points:
        balls: Any = point.experiment.balls
        if (
            point.experiment.cor == cor
            and balls.radius == setting.radius
            and balls.ring_extent == setting.extent
            and (point.experiment.effective_wall_cor == 1.0) == setting.elastic_wall
        ):
            speeds = [float(series(trace).mean_speed.mean()) for trace in run.traces(point)]
            return Ours(float(np.mean(speeds)), (max(speeds) - min(speeds)) / 2)
    raise ValueError(f"the audit's run has no point for {setting.words()}")


def _claims(stated: dict[str, Ours]) -> tuple[Claim, ...]:
    """The report's sentences about its numbers, checked with its numbers and with ours."""
    claims = []
    for cor in (0.8, 0.9):
        fitted, predicted = published(f"energy_mean_{cor}"), published(f"theory_{cor}")
        off = abs(fitted.value / predicted.value - 1)
        claims.append(
            Claim(
                f"At CoR {cor} the fitted k is within 5 % of its theory.",
                f"{fitted.value:g} against {predicted.value:g}: {off:.1%} apart",
                off <= 0.05,
            )
        )
        doubled = published(f"doubled_{cor}")
        off = abs(doubled.value / fitted.value - 1)
        claims.append(
            Claim(
                f"At CoR {cor} twice the pressure's k is within 5 % of the energy's.",
                f"{doubled.value:g} against {fitted.value:g}: {off:.1%} apart",
                off <= 0.05,
            )
        )
    for cor in (0.8, 0.9):
        energy, warm = stated[f"energy_mean_{cor}"], stated[f"temperature_{cor}"]
        off = abs(warm.value / energy.value - 1)
        claims.append(
            Claim(
                f"At CoR {cor} temperature decays as energy does.",
                f"ours: {off:.0e} apart, what the container takes",
                off < 1e-3,
            )
        )
        ratio = stated[f"local_{cor}"]
        claims.append(
            Claim(
                f"At CoR {cor} pressure decays at half the rate of energy.",
                f"ours: in windows of time it decays {with_error(ratio.value, ratio.error)} times "
                "as fast as the energy in the same windows; only the mean since the start, which "
                "the report plots, lags behind",
                abs(ratio.value - 0.5) < abs(ratio.value - 1.0),
            )
        )
    return tuple(claims)


def _ideal_gas_claims(run: Run) -> tuple[Claim, ...]:
    """What the report says of CoR and the ideal gas law, checked on its tiny balls."""
    point = next(
        point
        for point in run.points
        if point.experiment.cor == 0.8 and point.experiment.balls.radius == 0.01  # type: ignore[union-attr]
    )
    means, ends, trapped = [], [], 0
    for trace in run.traces(point):
        found = measure(trace)
        area = math.pi * trace.start.container_radius**2
        ideal = theory.ideal_gas_pressure(trace.start.number, 1.0, area)
        last = trace.finish.kinetic_energy / trace.start.number
        means.append(found.pressure / (ideal * found.temperature))
        ends.append(found.pressure / (ideal * last))
        trapped += not trace.stop.reason.complete
    return (
        Claim(
            "As CoR falls the simulated pressure exceeds the ideal one (fig. 17).",
            f"ours at CoR 0.8: {np.mean(means):.3f} of the ideal pressure at the mean temperature "
            f"of the same time, {np.mean(ends):.2f} at the temperature of its end: the excess is "
            f"that of a mean over a last value ({trapped} of {len(means)} repeats end in a wall "
            "trap)",
            False,
        ),
        Claim(
            "The divergence from the ideal gas law grows when CoR increases (abstract).",
            "its section III C says that it grows as CoR decreases: the two contradict each other",
            False,
        ),
    )
