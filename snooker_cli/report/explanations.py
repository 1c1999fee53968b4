"""Named explanations of the source report's numbers, each simulated and judged by chi-square."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli import theory
from snooker_cli.analysis.decay import Curve, curve
from snooker_cli.analysis.fitting import Curves, fit_all
from snooker_cli.analysis.observables import complete_repeats, mean_pressure, mean_speed, series
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report.source_values import (
    EXPLANATIONS,
    SOURCE_VALUES,
    TARGETS,
    OurValue,
    Sample,
    SourceValue,
)
from snooker_cli.runs import Run
from snooker_cli.trace import Trace

Array = NDArray[np.float64]

Samples: TypeAlias = dict[tuple[str, float | None], Sample]
"""Results by quantity and CoR."""

SHARE = 0.4  # of the collisions, from the start: what "first collisions" fits

FITTED = {"energy decay": "kinetic_energy", "pressure decay": "pressure"}

LIKELY = 14.07
"""95 % point of chi-square with a degree of freedom for each target; a fitted choice lowers it."""


@dataclass(frozen=True)
class Setting:
    """What differs from the scene and the fits that the source report states.

    small_in_fits, small_elsewhere : whether balls of a tenth of the radius are behind the fits, and
        behind mean speeds and the pressure
    elastic_wall : whether the wall's CoR is 1 instead of the balls'
    first_collisions : whether the fits end after ``SHARE`` of the collisions
    free_amplitude : whether the fitted curve need not start at the first point
    slip : whether the time axis of the fits is too long by ``Explanations.factor``
    """

    small_in_fits: bool = False
    small_elsewhere: bool = False
    elastic_wall: bool = False
    first_collisions: bool = False
    free_amplitude: bool = False
    slip: bool = False


COMBINATIONS = [
    Setting(*made) for made in itertools.product((False, True), repeat=len(fields(Setting)))
]


@dataclass(frozen=True)
class Explanation:
    """A setting with its results.

    name : its changes, in words
    samples : results by quantity and CoR
    """

    name: str
    samples: Samples

    def our_value(self, number: SourceValue) -> OurValue | None:
        """The value for a printed number; ``None`` if fewer than half of the repeats have one."""
        sample = self.samples.get((number.quantity, number.cor))
        if sample is None or sample.count < max(2, len(sample.values) / 2):
            return None
        return sample.our_value(number)

    def predicts(self, number: SourceValue) -> bool:
        """Whether the repeats scatter by less than half of their mean.

        More scatter agrees with any number, so that its agreement means nothing.
        """
        if self.our_value(number) is None:
            return False
        sample = self.samples[number.quantity, number.cor]
        return sample.value > 2 * sample.deviation

    @property
    def score(self) -> float:
        """Chi-square: the sum of the squared distances from the targets that have a value."""
        ours = [(number, self.our_value(number)) for number in TARGETS]
        return sum(value.distance(number) ** 2 for number, value in ours if value is not None)

    def as_json(self) -> dict[str, Any]:
        """Its values of the targets and what follows from them."""
        values = {number.name: self.our_value(number) for number in TARGETS}
        given = {name: None if value is None else asdict(value) for name, value in values.items()}
        judged = {"score": self.score, "whole": self.whole, "rejected": self.rejected}
        return {"name": self.name, **judged, "values": given}

    @property
    def whole(self) -> bool:
        """Whether it has a value for every target; else its score is a lower bound."""
        return None not in map(self.our_value, TARGETS)

    @property
    def rejected(self) -> bool:
        """Whether chi-square is above its 95 % point, however many choices were made."""
        return self.score > LIKELY


@dataclass(frozen=True)
class Explanations:
    """All explanations.

    named : by their changes, the stated scene first, the best combination of all last
    factor : the printed mean free path over that of the stated balls, rounded
    early, repeats : repeats that ended early, of all that were simulated
    """

    named: tuple[Explanation, ...]
    factor: float
    early: int
    repeats: int

    @property
    def best(self) -> Explanation:
        """The combination with the least chi-square."""
        return self.named[-1]

    def simplest(self, number: SourceValue) -> tuple[Explanation, OurValue] | None:
        """The first that agrees with a number by itself, or else the nearest; with its value."""
        offers = [
            (explanation, ours)
            for explanation in self.named[1:]
            if explanation.predicts(number) and (ours := explanation.our_value(number)) is not None
        ]
        agreeing = [offer for offer in offers if offer[1].agrees(number)]
        return next(
            iter(agreeing), min(offers, key=lambda offer: offer[1].distance(number), default=None)
        )


def explain(run: Run, elastic: Run) -> Explanations:
    """All explanations from the audit's run, and from a run of elastic balls of other radii."""
    scene = starting_scene(run.experiment, 0)
    path = theory.mean_free_path(scene.number / scene.container.area, float(scene.radii[0]))
    factor = float(round(SOURCE_VALUES["mean_free_path"].value / path))
    stated: Any = run.experiment
    last, early = round(SHARE * stated.collisions), 0
    measured: dict[tuple[bool, bool, float], dict[Any, Array]] = {}
    for point in run.points:
        given: Any = point.experiment
        traces = list(run.traces(point))
        early += len(traces) - len(complete_repeats(traces))
        key = given.balls.radius < stated.balls.radius, given.effective_wall_cor == 1.0, given.cor
        measured[key] = _measured(traces, (last, stated.collisions))
    radii = stated.balls.radius, stated.balls.radius / factor
    pressures: dict[bool, Array] = {}
    for point in elastic.points:
        balls: Any = point.experiment.balls
        if balls.radius in radii and balls.speed == stated.balls.speed:
            traces = complete_repeats(elastic.traces(point))
            pressures[balls.radius < stated.balls.radius] = np.array([*map(mean_pressure, traces)])

    def explanation(setting: Setting) -> Explanation:
        window = last if setting.first_collisions else stated.collisions
        samples: Samples = {("pressure", None): Sample(pressures[setting.small_elsewhere])}
        for cor in dict.fromkeys(cor for *_, cor in measured):
            fits = measured[setting.small_in_fits, setting.elastic_wall, cor]
            rest = measured[setting.small_elsewhere, setting.elastic_wall, cor]
            samples["mean speed", cor] = Sample(rest["mean speed"])
            for quantity, fitted in FITTED.items():
                constants = fits[fitted, window, not setting.free_amplitude]
                samples[quantity, cor] = Sample(constants / (factor if setting.slip else 1.0))
            # But for the container, the temperature is the energy.
            samples["temperature decay", cor] = samples["energy decay", cor]
            doubled = 2 * samples["pressure decay", cor].values
            samples["pressure decay, doubled", cor] = Sample(doubled)
        name = _name(setting, stated.balls.radius / factor, factor, last)
        return Explanation(name, samples)

    # The best of all combinations of changes; only those with a value of each target compete.
    whole = (candidate for candidate in map(explanation, COMBINATIONS) if candidate.whole)
    best = min(whole, key=lambda candidate: candidate.score)
    named = (*(explanation(Setting(**changes)) for changes in EXPLANATIONS), best)
    return Explanations(named, factor, early, len(run.points) * stated.repeats)


def _name(setting: Setting, small: float, factor: float, last: int) -> str:
    """The changes of a setting, in words."""
    where = "" if setting.small_elsewhere else " in the fits only"
    words = {
        f"balls of {small:g} m{where}": setting.small_in_fits,
        f"balls of {small:g} m outside of the fits": setting.small_elsewhere
        and not setting.small_in_fits,
        "elastic wall": setting.elastic_wall,
        f"first {last} collisions": setting.first_collisions,
        "free amplitude": setting.free_amplitude,
        f"time axis of the fits × {factor:g}": setting.slip,
    }
    return ", ".join(text for text, made in words.items() if made) or "as stated"


def _measured(traces: Sequence[Trace], windows: Sequence[int]) -> dict[Any, Array]:
    """Values by repeat: "mean speed", m/s, and decay constants by fit, 1/s.

    A fit is a quantity, its last collision (nan without it), and whether the amplitude is held.
    """
    values: dict[Any, Array] = {"mean speed": np.array([mean_speed(t) for t in traces])}
    times = [series(trace).time for trace in traces]
    for quantity in FITTED.values():
        curves = [curve(trace, quantity) for trace in traces]
        for n, held in itertools.product(windows, (True, False)):
            ends = np.array([time[n] if n < len(time) else math.nan for time in times])
            values[quantity, n, held] = decay_constants(curves, ends, held=held)
    return values


def decay_constants(curves: Sequence[Curve], ends: Array, *, held: bool) -> Array:
    """Exponential decay constants of curves up to their ends (s); (*n*,), 1/s.

    nan where the end is nan, or where there is no fit.
    """
    cut = []
    for decaying, end in zip(curves, ends, strict=True):
        rows = decaying.time <= end
        cut.append((decaying.time[rows], decaying.value[rows], 0.0))
    fits = fit_all(Curves.of(cut), amplitude=1.0 if held else None)
    return np.array([fit.value for fit in fits])
