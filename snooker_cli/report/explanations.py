"""Named explanations of the source report's numbers, each simulated and judged by chi-square."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli import theory
from snooker_cli.analysis.decay import Curve, curve
from snooker_cli.analysis.fitting import Curves, fit_all
from snooker_cli.analysis.observables import complete_repeats, mean_pressure, mean_speed, series
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report.source_values import (
    AGREES,
    EXPLANATIONS,
    LORD,
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

LIKELY = 0.95
"""An explanation is rejected if its chi-square is above this quantile of simulated ones."""

DRAWS, GROUP, SEED = 50_000, 5, 1947
"""Simulated groups, of as many runs as a printed mean has; the quantile is good to about 0.1."""

HOPELESS = 40.0
"""A chi-square that is rejected without simulated ones; their quantiles are far below."""

DECADE = np.geomspace(0.1**0.5, 10**0.5, 1001)
"""Factors around a printed number, for the share that agrees by accident."""


@dataclass(frozen=True)
class Setting:
    """What differs from the scene and the fits that the source report states.

    small_in_fits, small_elsewhere : whether balls of a tenth of the radius are behind the fits, and
        behind mean speeds and the pressure
    elastic_wall : whether the wall's CoR is 1 instead of the balls'
    first_collisions : whether the fits end after ``SHARE`` of the collisions
    free_amplitude : whether the fitted curve need not start at the first point
    slip : whether the time axis of the fits is too long by ``Explanations.factor``
    rings_in_fits, rings_elsewhere : the ring extent of the balls behind the fits, and behind mean
        speeds; nan: that of the stated scene
    """

    small_in_fits: bool = False
    small_elsewhere: bool = False
    elastic_wall: bool = False
    first_collisions: bool = False
    free_amplitude: bool = False
    slip: bool = False
    rings_in_fits: float = math.nan
    rings_elsewhere: float = math.nan


COMBINATIONS = [Setting(*made) for made in itertools.product((False, True), repeat=6)]
"""All combinations of changes, with the rings of the stated scene."""


def with_rings(extents: Mapping[bool, Sequence[float]]) -> Iterator[Setting]:
    """All combinations of changes and ring extents; extents by whether the balls are small."""
    for setting in COMBINATIONS:
        small, others = setting.small_in_fits, setting.small_elsewhere
        for fits in extents[small]:
            for rest in [fits] if small == others else extents[others]:
                yield replace(setting, rings_in_fits=fits, rings_elsewhere=rest)


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

    @cached_property
    def targets(self) -> list[tuple[SourceValue, OurValue]]:
        """The targets that have a value, with it."""
        ours = [(number, self.our_value(number)) for number in TARGETS]
        return [(number, value) for number, value in ours if value is not None]

    @property
    def score(self) -> float:
        """Chi-square: the sum of the squared distances from the targets that have a value."""
        return sum(value.distance(number) ** 2 for number, value in self.targets)

    @property
    def whole(self) -> bool:
        """Whether it has a value for every target; else its score is a lower bound."""
        return len(self.targets) == len(TARGETS)

    @cached_property
    def simulated_scores(self) -> Array:
        """Chi-squares of groups of ``GROUP`` repeats of its own, (``DRAWS``,).

        A group is treated as the runs of the source report: its means are rounded, and their
        errors follow from ranges. A group has the same repeats for all targets of a CoR, so that
        they are correlated as in one run.
        """
        rng, scores = np.random.default_rng(SEED), np.zeros(DRAWS)
        chosen = {cor: rng.random((GROUP, DRAWS)) for cor in {number.cor for number in TARGETS}}
        for number, ours in self.targets:
            values = self.samples[number.quantity, number.cor].values
            peers = [
                self.samples[other.quantity, other.cor].values
                for other, _ in self.targets
                if other.cor == number.cor
            ]
            same = [peer for peer in peers if len(peer) == len(values)]
            values = values[np.isfinite(same).all(axis=0)]
            runs = values[(chosen[number.cor] * len(values)).astype(np.intp)]
            mean, error = runs[0], np.zeros(DRAWS)
            if number.mean:
                mean, error = runs.mean(axis=0), LORD * np.ptp(runs, axis=0) / 2
            interval = ours.uncertainty(replace(number, printed=number.digits)) - ours.error
            uncertainty = interval + np.hypot(error, ours.error)
            scores += ((mean.round(number.decimals) - ours.value) / uncertainty) ** 2
        return scores

    @cached_property
    def limit(self) -> float:
        """The quantile ``LIKELY`` of `simulated_scores`."""
        return float(np.quantile(self.simulated_scores, LIKELY))

    @property
    def rejected(self) -> bool:
        """Whether chi-square is above its limit, however many choices were made."""
        return self.score > HOPELESS or self.score > self.limit

    def as_json(self) -> dict[str, Any]:
        """Its values of the targets and what follows from them."""
        values = {number.name: self.our_value(number) for number in TARGETS}
        given = {name: None if value is None else asdict(value) for name, value in values.items()}
        judged = {"score": self.score, "whole": self.whole, "rejected": self.rejected}
        return {"name": self.name, **judged, "limit": self.limit, "values": given}


@dataclass(frozen=True)
class Explanations:
    """All explanations.

    named : by their changes: the stated scene first, the best combination with the stated rings
        last but one, the best of all last
    factor : the printed mean free path over that of the stated balls, rounded
    early, repeats : repeats that ended early, of all that were simulated
    extents : ring extents of small and of the stated balls that were tried
    tried, whole : number of combinations of changes and ring extents, and of those with a value for
        every target
    possible : those of them that are not rejected, the best first
    slipped : the best one with a wrong time axis
    """

    named: tuple[Explanation, ...]
    factor: float
    early: int
    repeats: int
    extents: Mapping[bool, Sequence[float]]
    tried: int
    whole: int
    possible: tuple[Explanation, ...]
    slipped: Explanation

    @property
    def best(self) -> Explanation:
        """The combination with the least chi-square."""
        return self.named[-1]

    def offers(self, number: SourceValue) -> list[tuple[Explanation, OurValue]]:
        """The explanations that predict a number, with its value."""
        return [
            (explanation, ours)
            for explanation in self.named[1:]
            if explanation.predicts(number) and (ours := explanation.our_value(number)) is not None
        ]

    def simplest(self, number: SourceValue) -> tuple[Explanation, OurValue] | None:
        """The first that agrees with a number by itself, or else the nearest; with its value."""
        offers = self.offers(number)
        agreeing = [offer for offer in offers if offer[1].agrees(number)]
        return next(
            iter(agreeing), min(offers, key=lambda offer: offer[1].distance(number), default=None)
        )

    def chance(self, number: SourceValue) -> float:
        """Share of the decade around a printed number that an explanation agrees with.

        The decade is uniform in the logarithm.
        """
        grid, agrees = number.value * DECADE, np.zeros(len(DECADE), dtype=bool)
        for _, ours in self.offers(number):
            agrees |= np.abs(grid - ours.value) <= AGREES * ours.uncertainty(number)
        return float(agrees.mean())


def chi_square_limit(numbers: int) -> float:
    """The quantile ``LIKELY`` of a chi-square distribution."""
    from scipy import special  # takes time to load

    return float(special.chdtri(numbers, 1 - LIKELY))


def explain(runs: Sequence[Run], elastic: Run) -> Explanations:
    """All explanations from the audit's runs, and from a run of elastic balls of other radii.

    runs : the first has the rings of the stated scene, the others have further ring extents
    """
    scene = starting_scene(runs[0].experiment, 0)
    path = theory.mean_free_path(scene.number / scene.container.area, float(scene.radii[0]))
    factor = float(round(SOURCE_VALUES["mean_free_path"].value / path))
    stated: Any = runs[0].experiment
    last, early, repeats = round(SHARE * stated.collisions), 0, 0
    measured: dict[tuple[bool, float, bool, float], dict[Any, Array]] = {}
    extents: dict[bool, list[float]] = {False: [], True: []}
    for run in runs:
        for point in run.points:
            given: Any = point.experiment
            small, rings = given.balls.radius < stated.balls.radius, given.balls.ring_extent
            if rings not in extents[small]:
                extents[small].append(rings)
            traces = list(run.traces(point))
            early += len(traces) - len(complete_repeats(traces))
            repeats += len(traces)
            key = small, rings, given.effective_wall_cor == 1.0, given.cor
            measured[key] = _measured(traces, (last, stated.collisions))
    radii = stated.balls.radius, stated.balls.radius / factor
    pressures: dict[bool, Array] = {}
    for point in elastic.points:
        balls: Any = point.experiment.balls
        if balls.radius in radii and balls.speed == stated.balls.speed:
            traces = complete_repeats(elastic.traces(point))
            pressures[balls.radius < stated.balls.radius] = np.array([*map(mean_pressure, traces)])
    own_rings = stated.balls.ring_extent

    def explanation(setting: Setting) -> Explanation:
        window = last if setting.first_collisions else stated.collisions
        samples: Samples = {("pressure", None): Sample(pressures[setting.small_elsewhere])}
        rings = [
            own_rings if math.isnan(extent) else extent
            for extent in (setting.rings_in_fits, setting.rings_elsewhere)
        ]
        for cor in dict.fromkeys(cor for *_, cor in measured):
            fits = measured[setting.small_in_fits, rings[0], setting.elastic_wall, cor]
            rest = measured[setting.small_elsewhere, rings[1], setting.elastic_wall, cor]
            samples["mean speed", cor] = Sample(rest["mean speed"])
            for quantity, fitted in FITTED.items():
                constants = fits[fitted, window, not setting.free_amplitude]
                samples[quantity, cor] = Sample(constants / (factor if setting.slip else 1.0))
            # But for the container, the temperature is the energy.
            samples["temperature decay", cor] = samples["energy decay", cor]
            doubled = 2 * samples["pressure decay", cor].values
            samples["pressure decay, doubled", cor] = Sample(doubled)
        name = _name(setting, stated.balls.radius / factor, factor, last, rings, own_rings)
        return Explanation(name, samples)

    def best(settings: Sequence[Setting]) -> list[tuple[Setting, Explanation]]:
        """Those with a value of each target, which alone compete; the best first."""
        made = [(setting, explanation(setting)) for setting in settings]
        whole = [pair for pair in made if pair[1].whole]
        return sorted(whole, key=lambda pair: pair[1].score)

    settings = [*with_rings(extents)]
    ranked = best(settings)
    return Explanations(
        named=(
            *(explanation(Setting(**changes)) for changes in EXPLANATIONS),
            best(COMBINATIONS)[0][1],
            ranked[0][1],
        ),
        factor=factor,
        early=early,
        repeats=repeats,
        extents=extents,
        tried=len(settings),
        whole=len(ranked),
        possible=tuple(one for _, one in ranked if not one.rejected),
        slipped=next(one for setting, one in ranked if setting.slip),
    )


def _name(
    setting: Setting,
    small: float,
    factor: float,
    last: int,
    rings: Sequence[float],
    own_rings: float,
) -> str:
    """The changes of a setting, in words; ring extents behind the fits and elsewhere."""
    where = "" if setting.small_elsewhere else " in the fits only"
    one_scene = setting.small_in_fits == setting.small_elsewhere
    of_fits = "rings" if one_scene else "rings of the fits"
    words = {
        f"balls of {small:g} m{where}": setting.small_in_fits,
        f"balls of {small:g} m outside of the fits": setting.small_elsewhere
        and not setting.small_in_fits,
        f"{of_fits} to {rings[0]:g} R": rings[0] != own_rings,
        f"other rings to {rings[1]:g} R": rings[1] != own_rings and not one_scene,
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
