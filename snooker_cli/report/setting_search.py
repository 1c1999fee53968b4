"""Search for the setting that the numbers of the source report come from."""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis.decay import curve
from snooker_cli.analysis.fitting import fit
from snooker_cli.analysis.observables import mean_pressure, series
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report.source_values import SOURCE_VALUES, OurValue, SourceValue

if TYPE_CHECKING:
    from snooker_cli.runs import Run
    from snooker_cli.trace import Trace

WINDOWS = (0.2, 0.4, 1.0)
"""Shares of the collisions, from the start, that a curve is fitted to."""

FITTED: tuple[str, ...] = ("kinetic_energy", "pressure")

TARGETS = [
    SOURCE_VALUES[name]
    for name in (
        *("energy_mean_0.8", "energy_mean_0.9", "pressure_mean_0.8", "pressure_mean_0.9"),
        *("speed_0.8", "speed_0.9", "pressure"),
    )
]
"""The measured numbers that one setting has to explain together."""

LIKELY = 14.07
"""95 % point of chi-square with one degree of freedom for each target."""


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


@dataclass(frozen=True)
class Sample:
    """A quantity over repeats: mean, standard deviation of one repeat, number of repeats."""

    mean: float
    deviation: float
    count: int

    @classmethod
    def over(cls, values: Iterable[float]) -> Sample:
        """Sample of the values of at least two repeats."""
        each = list(values)
        return cls(float(np.mean(each)), float(np.std(each, ddof=1)), len(each))

    @property
    def error(self) -> float:
        """Standard error of the mean."""
        return self.deviation / math.sqrt(self.count)

    def our_value(self, number: SourceValue) -> OurValue:
        """The mean, with the standard error for a printed mean and the deviation for one run."""
        return OurValue(self.mean, self.error if number.mean else self.deviation)

    def times(self, factor: float) -> Sample:
        """The sample with mean and deviation times a factor."""
        return Sample(self.mean * factor, self.deviation * factor, self.count)


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
        """Whether single runs scatter by less than half of the mean of a printed number.

        A setting with more scatter agrees with any number, so its agreement means nothing.
        """
        sample = self.samples.get((number.quantity, number.cor))
        return sample is not None and sample.mean > 2 * sample.deviation

    @property
    def score(self) -> float:
        """Sum of the squared distances from the targets (chi-square)."""
        ours = [(number, self.our_value(number)) for number in TARGETS]
        return sum(math.inf if one is None else one.distance(number) ** 2 for number, one in ours)


@dataclass(frozen=True)
class Search:
    """The result of a search.

    candidates : all of them, best first
    factor : of the slips
    extent : ring extent of our own configs
    early : number of repeats that ended early; they are fitted up to their end
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
    def profile(self) -> list[Candidate]:
        """The best of the ranked candidates for each value of each part of a setting."""
        chosen: set[int] = set()
        for part in ("radius", "elastic_wall", "extent", "window", "fixed_amplitude", "slip"):
            values = [getattr(one, part) for one in self.ranked]
            chosen |= {values.index(value) for value in values}
        return [self.ranked[index] for index in sorted(chosen)]

    @property
    def free(self) -> OurValue:
        """The factor of a slip in time that fits the best decay constants best."""
        numerator = denominator = 0.0
        for number in TARGETS:
            ours = self.ranked[0].our_value(number)
            if ours is not None and number.quantity in ("energy decay", "pressure decay"):
                weight = math.hypot(number.standard_error, ours.error) ** -2
                numerator += weight * ours.value * number.value
                denominator += weight * ours.value**2
        ratio, error = numerator / denominator, denominator**-0.5
        return OurValue(self.factor / ratio, self.factor * error / ratio**2)


def search(run: Run, elastic: Run) -> Search:
    """All candidates from the audit's run, and from a run of elastic balls of other radii."""
    measured, early = _measured(run)
    stated: Any = run.experiment
    windows, factor = _windows(run), slip_factor(run)
    pressures = _elastic_pressures(elastic, stated.balls.speed)
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
        samples: dict[tuple[str, float | None], Sample] = {}
        if radius in pressures:
            samples["pressure", None] = pressures[radius].times(factor**slip.pressure)
        energy, pressure = (("kinetic_energy", window, fixed), ("pressure", window, fixed))
        sources: tuple[tuple[str, Any, float], ...] = (
            ("mean speed", "mean speed", factor**slip.speed),
            ("energy decay", energy, factor**slip.decay),
            ("temperature decay", energy, factor**slip.decay),  # the same, but for the container
            ("pressure decay", pressure, factor**slip.decay),
            ("pressure decay, doubled", pressure, 2 * factor**slip.decay),
        )
        for (place, cor), values in measured.items():
            for wanted, key, times in sources:
                if place == scene and len(values[key]) > 1:
                    samples[wanted, cor] = Sample.over(values[key]).times(times)
        candidates.append(Candidate(*scene, window, fixed, slip, made, samples))
    candidates.sort(key=lambda one: (one.score, len(one.changes)))
    return Search(tuple(candidates), factor, stated.balls.ring_extent, early)


def _elastic_pressures(run: Run, speed: float) -> dict[float, Sample]:
    """Pressure (Pa m) by ball radius (m) at CoR 1 and a start speed (m/s)."""
    balls: list[Any] = [point.experiment.balls for point in run.points]
    return {
        one.radius: Sample.over(map(mean_pressure, run.traces(point)))
        for one, point in zip(balls, run.points, strict=True)
        if one.speed == speed
    }


def mean_speed(trace: Trace) -> float:
    """Mean speed of the balls, averaged over the states after each collision (m/s)."""
    return float(series(trace).mean_speed[1:].mean())


def slip_factor(run: Run) -> float:
    """The printed mean free path over that of the stated scene, rounded."""
    scene = starting_scene(run.experiment, 0)
    density = theory.number_density(scene.number, scene.container.area)
    path = theory.mean_free_path(density, float(scene.radii[0]))
    return float(round(SOURCE_VALUES["mean_free_path"].value / path))


def simplest(
    candidates: Iterable[Candidate], number: SourceValue
) -> tuple[Candidate, OurValue] | None:
    """The agreeing candidate with the fewest changes (then the likeliest), or else the nearest."""
    offers = [
        (one, ours)
        for one in candidates
        if one.predicts(number) and (ours := one.our_value(number)) is not None
    ]

    def rank(offer: tuple[Candidate, OurValue]) -> tuple[float, ...]:
        one, ours = offer
        distance = ours.distance(number)
        log_likelihood = -(distance**2) / 2 - math.log(ours.uncertainty(number))
        return (0, len(one.changes), -log_likelihood) if distance <= 2 else (1, distance)

    return min(offers, key=rank, default=None)


Measured = dict[tuple[tuple[float, bool, float], float], dict[Any, list[float]]]
"""By scene (radius, whether the wall is elastic, ring extent) and CoR: values of the repeats.

Their keys are "mean speed" (m/s) and, for decay constants (1/s), quantity, window and whether
the amplitude is fixed.
"""


def _measured(run: Run) -> tuple[Measured, int]:
    """The values of every repeat, and the number of repeats that ended early."""
    found: Measured = {}
    early = 0
    for point in run.points:
        balls: Any = point.experiment.balls
        scene = balls.radius, point.experiment.effective_wall_cor == 1.0, balls.ring_extent
        values = found.setdefault((scene, point.experiment.cor), defaultdict(list))
        for trace in run.traces(point):
            early += not trace.stop.reason.complete
            values["mean speed"].append(mean_speed(trace))
            times = series(trace).time
            for quantity in FITTED:
                whole = curve(trace, quantity)
                for window, fixed in itertools.product(_windows(run), (True, False)):
                    kept = whole.time <= times[min(window, len(times) - 1)]
                    amplitude = 1.0 if fixed else None
                    result = fit(whole.time[kept], whole.value[kept], amplitude=amplitude)
                    if result.converged:
                        values[quantity, window, fixed].append(result.value)
    return found, early


def _windows(run: Run) -> Sequence[int]:
    """Numbers of collisions, from the start, that curves are fitted to."""
    return [round(share * (run.experiment.collisions or 0)) for share in WINDOWS]
