"""Search for the setting that the numbers of the source report come from."""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis.decay import curve
from snooker_cli.analysis.fitting import fit
from snooker_cli.analysis.observables import mean_pressure, series
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report.source_values import OurValue, SourceValue, source_value

if TYPE_CHECKING:
    from snooker_cli.runs import Run
    from snooker_cli.trace import Trace

WINDOWS = (0.2, 0.4, 1.0)
"""Shares of the collisions, from the start, that a curve is fitted to."""

FITTED: tuple[str, ...] = ("kinetic_energy", "pressure")

TARGETS = (
    "energy_mean_0.8",
    "energy_mean_0.9",
    "pressure_mean_0.8",
    "pressure_mean_0.9",
    "speed_0.8",
    "speed_0.9",
    "pressure",
)
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
class CandidateSetting:
    """One way in which the source report may have been made.

    radius : of a ball, m
    elastic_wall : whether the wall's CoR is 1 instead of the balls'
    extent : radius of the outermost ring over the container's; the source report does not state it
    window : fitted collisions
    fixed_amplitude : whether the fitted curve starts at the first data point
    changes : everything that contradicts the source report, in words
    """

    radius: float
    elastic_wall: bool
    extent: float
    window: int
    fixed_amplitude: bool
    slip: Slip
    changes: tuple[str, ...]

    @property
    def description(self) -> str:
        """The changes and the rings, in words."""
        return ", ".join([*self.changes, f"rings to {self.extent:g} R"])


@dataclass(frozen=True)
class Sample:
    """A quantity over repeats: mean, standard deviation of one repeat, number of repeats."""

    mean: float
    deviation: float
    count: int

    @classmethod
    def over(cls, values: Sequence[float]) -> Sample:
        """Sample of the values of at least two repeats."""
        return cls(float(np.mean(values)), float(np.std(values, ddof=1)), len(values))

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


Samples = Mapping[tuple[str, float | None], Sample]


@dataclass(frozen=True)
class Candidate:
    """A setting and its results: a sample for each property and CoR."""

    setting: CandidateSetting
    samples: Samples

    def our_value(self, number: SourceValue) -> OurValue | None:
        """The setting's value for a printed number; ``None`` if it does not give one."""
        sample = self._sample(number)
        return None if sample is None else sample.our_value(number)

    def _sample(self, number: SourceValue) -> Sample | None:
        """The sample for a printed number; the temperature decays as the energy does."""
        if number.quantity == "pressure decay, doubled":
            sample = self.samples.get(("pressure decay", number.cor))
            return None if sample is None else sample.times(2)
        temperature = number.quantity == "temperature decay"
        wanted: str = "energy decay" if temperature else number.quantity
        return self.samples.get((wanted, number.cor))

    def predicts(self, name: str) -> bool:
        """Whether single runs scatter by less than half of the mean of a printed number.

        A setting with more scatter agrees with any number, so its agreement means nothing.
        """
        sample = self._sample(source_value(name))
        return sample is not None and sample.mean > 2 * sample.deviation

    @property
    def score(self) -> float:
        """Sum of the squared distances from the targets (chi-square)."""
        ours = {name: self.our_value(source_value(name)) for name in TARGETS}
        return sum(
            math.inf if one is None else one.distance(source_value(name)) ** 2
            for name, one in ours.items()
        )


@dataclass(frozen=True)
class Search:
    """The result of a search.

    candidates : all of them, best first
    ranked : those that predict all targets
    factor : of the slips
    extent : ring extent of our own configs
    early : number of repeats that ended early; they are fitted up to their end
    """

    candidates: tuple[Candidate, ...]
    ranked: tuple[Candidate, ...]
    factor: float
    extent: float
    early: int


def search(run: Run, pressures: Mapping[float, Sample]) -> Search:
    """All candidates from the audit's run, and ``pressures`` from ``elastic_pressures``."""
    measured, early = _measured(run)
    stated: Any = run.experiment
    windows, factor = _windows(run), slip_factor(run)
    scenes = sorted({scene for scene, _ in measured})
    candidates = []
    for scene, window, fixed, slip in itertools.product(scenes, windows, (True, False), SLIPS):
        radius, elastic_wall, extent = scene
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
        sources: tuple[tuple[str, Any, int], ...] = (
            ("mean speed", "mean speed", slip.speed),
            ("energy decay", ("kinetic_energy", window, fixed), slip.decay),
            ("pressure decay", ("pressure", window, fixed), slip.decay),
        )
        for (place, cor), values in measured.items():
            for wanted, key, power in sources:
                if place == scene and len(values[key]) > 1:
                    samples[wanted, cor] = Sample.over(values[key]).times(factor**power)
        setting = CandidateSetting(radius, elastic_wall, extent, window, fixed, slip, made)
        candidates.append(Candidate(setting, samples))
    candidates.sort(key=lambda one: (one.score, len(one.setting.changes)))
    ranked = tuple(one for one in candidates if all(map(one.predicts, TARGETS)))
    return Search(tuple(candidates), ranked, factor, stated.balls.ring_extent, early)


def elastic_pressures(run: Run, speed: float) -> dict[float, Sample]:
    """Pressure (Pa m) by ball radius (m) at CoR 1 and a start speed (m/s)."""
    found = {}
    for point in run.points:
        balls: Any = point.experiment.balls
        if balls.speed == speed:
            found[balls.radius] = Sample.over([mean_pressure(each) for each in run.traces(point)])
    return found


def mean_speed(trace: Trace) -> float:
    """Mean speed of the balls, averaged over the states after each collision (m/s)."""
    return float(series(trace).mean_speed[1:].mean())


def slip_factor(run: Run) -> float:
    """The printed mean free path over that of the stated scene, rounded."""
    scene = starting_scene(run.experiment, 0)
    density = theory.number_density(scene.number, scene.container.area)
    path = theory.mean_free_path(density, float(scene.radii[0]))
    return float(round(source_value("mean_free_path").value / path))


def simplest(
    candidates: Iterable[Candidate], number: SourceValue
) -> tuple[Candidate, OurValue] | None:
    """The agreeing candidate with the fewest changes (then the likeliest), or else the nearest."""
    offers = [
        (one, ours)
        for one in candidates
        if one.predicts(number.name) and (ours := one.our_value(number)) is not None
    ]

    def rank(offer: tuple[Candidate, OurValue]) -> tuple[float, ...]:
        one, ours = offer
        distance = ours.distance(number)
        log_likelihood = -(distance**2) / 2 - math.log(ours.uncertainty(number))
        return (0, len(one.setting.changes), -log_likelihood) if distance <= 2 else (1, distance)

    return min(offers, key=rank, default=None)


def profile(candidates: Sequence[Candidate]) -> list[Candidate]:
    """From candidates, best first: the best for each value of each part of the setting."""
    chosen: dict[int, Candidate] = {}
    for part in ("radius", "elastic_wall", "extent", "window", "fixed_amplitude", "slip"):
        seen = set()
        for index, one in enumerate(candidates):
            value = getattr(one.setting, part)
            if value not in seen:
                seen.add(value)
                chosen[index] = one
    return [chosen[index] for index in sorted(chosen)]


def free_factor(one: Candidate, factor: float) -> OurValue:
    """The factor of the slip in time that fits the decay constants best."""
    numerator = denominator = 0.0
    for number in map(source_value, TARGETS):
        ours = one.our_value(number)
        if ours is not None and number.quantity in ("energy decay", "pressure decay"):
            weight = math.hypot(number.standard_error, ours.error) ** -2
            numerator += weight * ours.value * number.value
            denominator += weight * ours.value**2
    ratio, error = numerator / denominator, denominator**-0.5
    return OurValue(factor / ratio, factor * error / ratio**2)


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


def _windows(run: Run) -> list[int]:
    """Numbers of collisions, from the start, that curves are fitted to."""
    return [round(share * (run.experiment.collisions or 0)) for share in WINDOWS]
