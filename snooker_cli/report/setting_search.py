"""Search for the setting that the numbers of the source report come from."""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snooker_cli import theory
from snooker_cli.analysis.decay import Curve, curve
from snooker_cli.analysis.fitting import fit_all
from snooker_cli.analysis.observables import complete_repeats, mean_pressure, mean_speed, series
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report.source_values import SOURCE_VALUES, OurValue, SourceValue
from snooker_cli.runs import Run

Array = NDArray[np.float64]

WINDOWS = (0.2, 0.4, 1.0)  # shares of the collisions, from the start, that a curve is fitted to

FITTED: tuple[str, ...] = ("kinetic_energy", "pressure")

TARGETS = [
    SOURCE_VALUES[name]
    for name in (
        *("energy_mean_0.8", "energy_mean_0.9", "pressure_mean_0.8", "pressure_mean_0.9"),
        *("speed_0.8", "speed_0.9", "pressure"),
    )
]
"""The measured numbers that one setting has to explain together."""

PARTS = ("radius", "slip", "window", "elastic_wall", "fixed_amplitude", "extent")
"""The parts of a setting: fields of `Candidate`. Each is a choice that the search makes."""

FREEDOM = len(TARGETS) - len(PARTS)
"""Degrees of freedom of chi-square: a number for each target, less the choices."""

LIKELY = 3.84  # 95 % point of chi-square with ``FREEDOM`` degrees of freedom
RESAMPLES = 2000  # how often the ranking is repeated with resampled repeats (bootstrap, Efron 1979)
DECIDED = 0.95  # a part of a setting is decided if its value wins in this share of the resamples


class Slip(NamedTuple):
    """A mistake by a constant factor, and the powers of it in decay constants, speeds, pressures.

    text : description with ``{factor}``; empty for no slip
    """

    text: str
    decay: int = 0
    speed: int = 0
    pressure: int = 0


SLIPS = (
    Slip(""),
    Slip("time axis of the fits × {factor}", decay=-1),
    Slip("whole time axis × {factor}", decay=-1, pressure=-1),
    Slip("speed / {factor}", decay=-1, speed=-1, pressure=-2),
)


class Sample:
    """A quantity over the repeats of a point, at least two of which count.

    each : (*n*,) by repeat; nan for a repeat that does not count, because it ended early
    count : number of repeats that count
    value : mean over these
    deviation, error : standard deviation of one, standard error of the mean
    """

    def __init__(self, values: Iterable[float]) -> None:
        self.each = np.array(list(values))
        counted = self.each[np.isfinite(self.each)]
        self.count = len(counted)
        self.value, self.deviation = float(counted.mean()), float(counted.std(ddof=1))
        self.error = self.deviation / math.sqrt(self.count)

    def our_value(self, number: SourceValue) -> OurValue:
        """The mean, with the standard error for a printed mean and the deviation for one run."""
        return OurValue(self.value, self.error if number.mean else self.deviation)

    def resampled_means(self) -> Array:
        """Means over repeats that are drawn with replacement, the same for each sample; (*b*,)."""
        draws, good = _draws(len(self.each)), np.isfinite(self.each)
        return np.asarray(draws @ np.where(good, self.each, 0.0) / (draws @ good))


@cache
def _draws(count: int) -> Array:
    """How often each of the repeats is in each resample; (``RESAMPLES``, *count*)."""
    share = np.full(count, 1 / count)
    return np.random.default_rng(0).multinomial(count, share, size=RESAMPLES).astype(np.float64)


@dataclass(frozen=True)
class Candidate:
    """A setting with which the source report may have been made, and its results.

    radius : of a ball, m
    elastic_wall : whether the wall's CoR is 1 instead of the balls'
    extent : radius of the outermost ring over the container's; the source report does not state it
    window : fitted collisions
    fixed_amplitude : whether the fitted curve starts at the first data point
    changes : everything that contradicts the source report, in words
    samples : results by quantity and CoR
    """

    radius: float
    elastic_wall: bool
    extent: float
    window: int
    fixed_amplitude: bool
    slip: Slip
    changes: tuple[str, ...]
    samples: Mapping[tuple[str, float | None], Sample]

    @property
    def description(self) -> str:
        """The changes and the rings, in words."""
        return ", ".join([*self.changes, f"rings to {self.extent:g} R"])

    def our_value(self, number: SourceValue) -> OurValue | None:
        """The setting's value for a printed number; ``None`` if it does not give one."""
        sample = self.samples.get((number.quantity, number.cor))
        return None if sample is None else sample.our_value(number)

    def predicts(self, number: SourceValue) -> bool:
        """Whether half of the repeats count, and scatter by less than half of their mean.

        A setting with more scatter agrees with any number, so its agreement means nothing.
        """
        sample = self.samples.get((number.quantity, number.cor))
        if sample is None or 2 * sample.count < len(sample.each):
            return False
        return sample.value > 2 * sample.deviation

    @property
    def score(self) -> float:
        """Sum of the squared distances from the targets (chi-square)."""
        ours = [(number, self.our_value(number)) for number in TARGETS]
        return sum(math.inf if one is None else one.distance(number) ** 2 for number, one in ours)

    def resampled_scores(self) -> Array:
        """The score of a setting that predicts all targets, for each resample; (*b*,)."""
        total = np.zeros(RESAMPLES)
        for number in TARGETS:
            sample = self.samples[number.quantity, number.cor]
            uncertainty = sample.our_value(number).uncertainty(number)
            total += ((sample.resampled_means() - number.value) / uncertainty) ** 2
        return total

    @property
    def complete(self) -> int:
        """Number of complete repeats: the least of the coefficients."""
        return min(self.samples[one.quantity, one.cor].count for one in TARGETS if one.cor)


@dataclass(frozen=True)
class Search:
    """The result of a search.

    candidates : all of them, best first
    factor : of the slips
    extent : ring extent of our own configs
    early : number of repeats that ended early; they count where they are long enough
    """

    candidates: tuple[Candidate, ...]
    factor: float
    extent: float
    early: int

    @cached_property
    def ranked(self) -> list[Candidate]:
        """The candidates that predict all targets."""
        return [one for one in self.candidates if all(map(one.predicts, TARGETS))]

    @property
    def near(self) -> int:
        """Number of ranked candidates with a score below ``LIKELY``."""
        return sum(one.score < LIKELY for one in self.ranked)

    @cached_property
    def wins(self) -> list[float]:
        """For each ranked candidate, the share of the resamples in which it is the best."""
        best = np.argmin([one.resampled_scores() for one in self.ranked], axis=0)
        return [float(share) for share in np.bincount(best, minlength=len(self.ranked)) / RESAMPLES]

    def support(self, part: str) -> float:
        """The share of the resamples whose best candidate has the best one's value of a part."""
        best = getattr(self.ranked[0], part)
        both = zip(self.wins, self.ranked, strict=True)
        return sum(share for share, one in both if getattr(one, part) == best)

    def cost(self, part: str) -> float:
        """How much chi-square another value of a part of the best candidate adds at least."""
        best = getattr(self.ranked[0], part)
        others = (one.score for one in self.ranked if getattr(one, part) != best)
        return min(others, default=math.inf) - self.ranked[0].score

    @cached_property
    def profile(self) -> list[Candidate]:
        """The best of the ranked candidates for each value of each part, and all that ever win."""
        chosen = {index for index, share in enumerate(self.wins) if share > 0}
        for part in PARTS:
            values = [getattr(one, part) for one in self.ranked]
            chosen |= {values.index(value) for value in values}
        return [self.ranked[index] for index in sorted(chosen)]

    @property
    def free(self) -> OurValue:
        """The factor of a slip in time that fits the best decay constants best."""
        numerator = denominator = 0.0
        for number in TARGETS[:4]:
            ours = self.ranked[0].samples[number.quantity, number.cor]
            weight = math.hypot(number.standard_error, ours.error) ** -2
            numerator += weight * ours.value * number.value
            denominator += weight * ours.value**2
        ratio, error = numerator / denominator, denominator**-0.5
        return OurValue(self.factor / ratio, self.factor * error / ratio**2)


def search(run: Run, elastic: Run) -> Search:
    """All candidates from the audit's run, and from a run of elastic balls of other radii."""
    stated: Any = run.experiment
    windows = [round(share * stated.collisions) for share in WINDOWS]
    measured, early = _measured(run, windows)
    factor = slip_factor(run)
    balls: list[Any] = [point.experiment.balls for point in elastic.points]
    pressures = {  # Pa m, by ball radius, m
        one.radius: np.array([mean_pressure(t) for t in complete_repeats(elastic.traces(point))])
        for one, point in zip(balls, elastic.points, strict=True)
        if one.speed == stated.balls.speed
    }
    scenes = sorted({scene for scene, _ in measured})
    candidates = []
    for scene, window, fixed, slip in itertools.product(scenes, windows, (True, False), SLIPS):
        radius, elastic_wall, _ = scene
        changes = {
            f"r = {radius:g} m": radius != stated.balls.radius,
            "elastic wall": elastic_wall,
            f"first {window} collisions": window != windows[-1],
            "amplitude free": not fixed,
            slip.text.format(factor=f"{factor:g}"): slip != SLIPS[0],
        }
        made = tuple(text for text, changed in changes.items() if changed)
        found: dict[tuple[str, float | None], Array] = {}
        if radius in pressures:
            found["pressure", None] = factor**slip.pressure * pressures[radius]
        decay = factor**slip.decay
        for (place, cor), values in measured.items():
            if place == scene:
                energy, pressure = (decay * values[quantity, window, fixed] for quantity in FITTED)
                found["mean speed", cor] = factor**slip.speed * values["mean speed"]
                found["energy decay", cor] = energy
                found["temperature decay", cor] = energy  # the same, but for the container
                found["pressure decay", cor] = pressure
                found["pressure decay, doubled", cor] = 2 * pressure
        samples = {key: Sample(each) for key, each in found.items() if np.isfinite(each).sum() > 1}
        candidates.append(Candidate(*scene, window, fixed, slip, made, samples))
    candidates.sort(key=lambda one: (one.score, len(one.changes)))
    return Search(tuple(candidates), factor, stated.balls.ring_extent, early)


def slip_factor(run: Run) -> float:
    """The printed mean free path over that of the stated scene, rounded."""
    scene = starting_scene(run.experiment, 0)
    density = scene.number / scene.container.area
    path = theory.mean_free_path(density, float(scene.radii[0]))
    return float(round(SOURCE_VALUES["mean_free_path"].value / path))


def simplest(
    candidates: Iterable[Candidate], number: SourceValue
) -> tuple[Candidate, OurValue] | None:
    """The agreeing candidate with the fewest changes (then the likeliest), or else the nearest."""
    key = number.quantity, number.cor
    offers = [
        (one, one.samples[key].our_value(number)) for one in candidates if one.predicts(number)
    ]

    def rank(offer: tuple[Candidate, OurValue]) -> tuple[float, ...]:
        one, ours = offer
        distance = ours.distance(number)
        log_likelihood = -(distance**2) / 2 - math.log(ours.uncertainty(number))
        return (0, len(one.changes), -log_likelihood) if distance <= 2 else (1, distance)

    return min(offers, key=rank, default=None)


Measured = dict[tuple[tuple[float, bool, float], float], dict[Any, "Array"]]
"""By scene (radius, whether the wall is elastic, ring extent) and CoR: values by repeat.

Their keys are "mean speed" (m/s) and, for decay constants (1/s), quantity, window and whether
the amplitude is fixed. A repeat that ended before the last collision of a window has nan.
"""


def _measured(run: Run, windows: Sequence[int]) -> tuple[Measured, int]:
    """The values of every repeat, and the number of repeats that ended early."""
    found: Measured = {}
    early = 0
    for point in run.points:
        balls: Any = point.experiment.balls
        scene = balls.radius, point.experiment.effective_wall_cor == 1.0, balls.ring_extent
        traces = list(run.traces(point))
        early += len(traces) - len(complete_repeats(traces))
        values: dict[Any, Array] = {"mean speed": np.array([mean_speed(t) for t in traces])}
        times = [series(trace).time for trace in traces]
        for quantity in FITTED:
            curves = [curve(trace, quantity) for trace in traces]
            for n, fixed in itertools.product(windows, (True, False)):
                ends = np.array([time[n] if n < len(time) else math.nan for time in times])
                values[quantity, n, fixed] = decay_constants(curves, ends, fixed=fixed)
        found[scene, point.experiment.cor] = values
    return found, early


def decay_constants(curves: Sequence[Curve], ends: Array, *, fixed: bool) -> Array:
    """Exponential decay constants of curves up to their ends (s); (*n*,), 1/s.

    nan where the end is nan, or where there is no fit.
    """
    kept = [one.time <= end for one, end in zip(curves, ends, strict=True)]
    cut = [(one.time[rows], one.value[rows], 0.0) for one, rows in zip(curves, kept, strict=True)]
    return np.array([found.value for found in fit_all(cut, amplitude=1.0 if fixed else None)])
