"""Which setting do the report's numbers come from: a search over what it may have used."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis.decay import Quantity, curve
from snooker_cli.analysis.fitting import fit
from snooker_cli.analysis.observables import mean_pressure, series
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report.source_values import OurValue, Property, SourceValue, published

if TYPE_CHECKING:
    from snooker_cli.runs import Run
    from snooker_cli.trace import Trace


PARTS = (0.2, 0.4, 1.0)
"""Parts of the collisions that a curve is fitted to, from the start."""

FITTED: tuple[Quantity, ...] = ("kinetic_energy", "pressure")
"""What is fitted for it."""

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
"""The 95 % point of chi-square with as many degrees of freedom as there are targets."""


@dataclass(frozen=True)
class Slip:
    """A mistake by a factor, by the powers in which it enters the numbers."""

    words: str
    decay: int = 0
    speed: int = 0
    pressure: int = 0


SLIPS = (
    Slip(""),
    Slip("time axis of the fits × {factor}", decay=-1),
    Slip("whole time axis × {factor}", decay=-1, pressure=-1),
    Slip("speed / {factor}", decay=-1, speed=-1, pressure=-2),
)
"""At a tenth of the speed all takes ten times as long, and the pressure is a hundredth."""


@dataclass(frozen=True)
class CandidateSetting:
    """One way the report may have been made.

    radius : of a ball, m
    elastic_wall : whether the container's CoR was 1 instead of the balls'
    extent : radius of the outermost ring over the container's; the report leaves it open
    window : collisions that were fitted
    held : whether the fitted curve was held to the data's start
    slip : a mistake by a factor
    changes : what goes against the report's statements, in words
    """

    radius: float
    elastic_wall: bool
    extent: float
    window: int
    held: bool
    slip: Slip
    changes: tuple[str, ...]

    def words(self) -> str:
        """The setting in words: what it changes, and the rings."""
        return ", ".join([*self.changes, f"rings to {self.extent:g} R"])


@dataclass(frozen=True)
class Sample:
    """A quantity over repeats: mean, standard deviation of one repeat, number of repeats."""

    mean: float
    deviation: float
    count: int

    @classmethod
    def over(cls, values: Sequence[float]) -> Sample:
        """Of the values of at least two repeats."""
        return cls(float(np.mean(values)), float(np.std(values, ddof=1)), len(values))

    def beside(self, number: SourceValue) -> OurValue:
        """As the printed number was made: a mean has a standard error, one run the spread."""
        return OurValue(self.mean, self.deviation / math.sqrt(self.count if number.mean else 1))

    def times(self, factor: float) -> Sample:
        """The sample in other units."""
        return Sample(self.mean * factor, self.deviation * factor, self.count)


Samples = Mapping[tuple[Property, float | None], Sample]


@dataclass(frozen=True)
class Candidate:
    """A setting, and what it gives: a sample for each property and CoR that it has."""

    setting: CandidateSetting
    samples: Samples

    def beside(self, number: SourceValue) -> OurValue | None:
        """What the setting gives for a printed number; ``None`` if it has nothing to do with it."""
        sample = self._sample(number)
        return None if sample is None else sample.beside(number)

    def _sample(self, number: SourceValue) -> Sample | None:
        """Of a printed number's property; the temperature decays as the energy does."""
        if number.of == "pressure decay, doubled":
            sample = self.samples.get(("pressure decay", number.cor))
            return None if sample is None else sample.times(2)
        temperature = number.of == "temperature decay"
        of: Property = "energy decay" if temperature else number.of
        return self.samples.get((of, number.cor))

    def predicts(self, name: str) -> bool:
        """Whether it says something of a printed number: runs scatter by under half their mean.

        A setting whose curves may as well rise explains any number, and so none.
        """
        number = published(name)
        sample = self._sample(number)
        return sample is not None and sample.mean > 2 * sample.deviation

    @property
    def score(self) -> float:
        """Sum of squared distances from the targets; smaller is better."""
        ours = {name: self.beside(published(name)) for name in TARGETS}
        return sum(
            math.inf if one is None else one.distance(published(name)) ** 2
            for name, one in ours.items()
        )


@dataclass(frozen=True)
class Search:
    """What was searched.

    candidates : all of them, best first; ranked : those that predict all targets
    factor : of the slips; extent : of our own rings
    early : repeats of the run that ended early, and are fitted up to there
    """

    candidates: tuple[Candidate, ...]
    ranked: tuple[Candidate, ...]
    factor: float
    extent: float
    early: int


def search(run: Run, pressures: Mapping[float, Sample]) -> Search:
    """All candidates that the audit's run offers; ``pressures`` as below."""
    found, scenes, early = _measured(run)
    stated: Any = run.experiment
    windows = _windows(run)
    factor = slip_factor(run)
    coefficients = sorted({point.experiment.cor for point in run.points})
    candidates = []
    for scene, window, held, slip in itertools.product(scenes, windows, (True, False), SLIPS):
        radius, elastic_wall, extent = scene
        changes = {
            f"r = {radius:g} m": radius != stated.balls.radius,
            "elastic wall": elastic_wall,
            f"first {window} collisions": window != windows[-1],
            "amplitude free": not held,
            slip.words.format(factor=f"{factor:g}"): slip != SLIPS[0],
        }
        made = tuple(words for words, changed in changes.items() if changed)
        samples: dict[tuple[Property, float | None], Sample] = {}
        if radius in pressures:
            samples["pressure", None] = pressures[radius].times(factor**slip.pressure)
        for cor in coefficients:
            wanted: dict[Property, tuple[tuple[Any, ...], int]] = {
                "mean speed": ((*scene, cor, "mean speed"), slip.speed),
                "energy decay": ((*scene, cor, "kinetic_energy", window, held), slip.decay),
                "pressure decay": ((*scene, cor, "pressure", window, held), slip.decay),
            }
            for of, (key, power) in wanted.items():
                if len(found.get(key, ())) > 1:
                    samples[of, cor] = Sample.over(found[key]).times(factor**power)
        setting = CandidateSetting(radius, elastic_wall, extent, window, held, slip, made)
        candidates.append(Candidate(setting, samples))
    candidates.sort(key=lambda one: (one.score, len(one.setting.changes)))
    ranked = tuple(one for one in candidates if all(map(one.predicts, TARGETS)))
    return Search(tuple(candidates), ranked, factor, stated.balls.ring_extent, early)


def pressures(run: Run, speed: float) -> dict[float, Sample]:
    """Pressure (Pa m) by ball radius (m) at CoR 1 and a speed; from where balls start or how
    the wall cools them it does not depend."""
    found = {}
    for point in run.points:
        balls: Any = point.experiment.balls
        if balls.speed == speed:
            found[balls.radius] = Sample.over([mean_pressure(each) for each in run.traces(point)])
    return found


def mean_speed(trace: Trace) -> float:
    """Mean over the collisions of the balls' mean speed after each, m/s."""
    return float(series(trace).mean_speed[1:].mean())


def slip_factor(run: Run) -> float:
    """How many times too long the printed mean free path is for the stated scene, rounded."""
    scene = starting_scene(run.experiment, 0)
    density = theory.number_density(scene.number, scene.area)
    path = theory.boltzmann_mean_free_path(density, float(scene.radii[0]))
    return float(round(published("mean_free_path").value / path))


def simplest(
    candidates: Iterable[Candidate], number: SourceValue
) -> tuple[Candidate, OurValue] | None:
    """The candidate that explains a number by itself: of those that agree, the fewest changes.

    Of as many changes the likeliest; if none agrees, the nearest.
    """
    offers = [
        (one, ours)
        for one in candidates
        if one.predicts(number.name) and (ours := one.beside(number)) is not None
    ]
    if not offers:
        return None

    def rank(offer: tuple[Candidate, OurValue]) -> tuple[float, ...]:
        one, ours = offer
        away = ours.distance(number)
        likely = -(away**2) / 2 - math.log(ours.uncertainty(number))
        return (0, len(one.setting.changes), -likely) if away <= 2 else (1, away)

    return min(offers, key=rank)


def profile(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The best candidate of all, and the best for each value of each part of the setting."""
    chosen: dict[int, Candidate] = {}
    for part in ("radius", "elastic_wall", "extent", "window", "held", "slip"):
        seen = set()
        for index, one in enumerate(candidates):
            value = getattr(one.setting, part)
            if value not in seen:
                seen.add(value)
                chosen[index] = one
    return [chosen[index] for index in sorted(chosen)]


def free_factor(one: Candidate, factor: float) -> OurValue:
    """The slip in time that explains the decay constants best if it is left free."""
    top = bottom = 0.0
    for name in TARGETS:
        number = published(name)
        ours = one.beside(number)
        if ours is not None and number.of in ("energy decay", "pressure decay"):
            weight = math.hypot(number.standard_error, ours.error) ** -2
            top += weight * ours.value * number.value
            bottom += weight * ours.value**2
    ratio, error = top / bottom, bottom**-0.5
    return OurValue(factor / ratio, factor * error / ratio**2)


def _measured(
    run: Run,
) -> tuple[dict[tuple[Any, ...], list[float]], list[tuple[float, bool, float]], int]:
    """What every repeat gives: by scene, CoR, quantity and, of a fit, window and whether held.

    A scene is radius, whether the wall is elastic, and ring extent; second, all of them in order;
    third, how many repeats ended early.
    """
    found: dict[tuple[Any, ...], list[float]] = {}
    scenes, early = set(), 0
    for point in run.points:
        balls: Any = point.experiment.balls
        scene = balls.radius, point.experiment.effective_wall_cor == 1.0, balls.ring_extent
        scenes.add(scene)
        for trace in run.traces(point):
            early += not trace.stop.reason.complete
            for key, value in _of_one(trace, _windows(run)).items():
                found.setdefault((*scene, point.experiment.cor, *key), []).append(value)
    return found, sorted(scenes), early


def _of_one(trace: Trace, windows: Sequence[int]) -> dict[tuple[Any, ...], float]:
    """Mean speed over the collisions (m/s) and decay constants (1/s) of one repeat."""
    times = series(trace).time
    found: dict[tuple[Any, ...], float] = {("mean speed",): mean_speed(trace)}
    for quantity in FITTED:
        whole = curve(trace, quantity)
        for window in windows:
            kept = whole.time <= times[min(window, len(times) - 1)]
            for held in (True, False):
                amplitude = 1.0 if held else None
                result = fit(whole.time[kept], whole.value[kept], amplitude=amplitude)
                if result.converged:
                    found[quantity, window, held] = result.value
    return found


def _windows(run: Run) -> list[int]:
    """Collisions up to which curves are fitted."""
    return [round(part * (run.experiment.collisions or 0)) for part in PARTS]
