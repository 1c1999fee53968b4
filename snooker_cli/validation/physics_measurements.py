"""Gases to measure: their scenes, their repeats in threads, and the means over seeds."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis.observables import mean_and_error, meeting_temperature
from snooker_cli.config import parse
from snooker_cli.containers import SHAPES
from snooker_cli.engine import simulate
from snooker_cli.formatting import counted
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.trace import SPEED_BIN, SPEED_BINS, Series, Summary
from snooker_cli.validation.study import EXACT, OWN, PUBLISHED, KnownValue, Parameters

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Series, Summary

    Array = NDArray[np.float64]


TEMPLATE = """
container: {{shape: {shape}}}
balls: {{count: {balls}, radius: 1.0, packing: {packing!r}, speed: 10.0, speeds: {speeds}}}
cor: {cor!r}
collisions: 1
seed: 1
"""


@dataclass(frozen=True)
class GasSample:
    """Equal balls of 1 m and 1 kg that start on a lattice with a temperature of 50 J.

    settling, collisions : a ball's with others, in a periodic box, before measuring and meanwhile
    seeds : repeats
    """

    balls: int
    packing: float
    settling: float
    collisions: float
    seeds: int
    cor: float = 1.0
    shape: str = "periodic"
    speeds: str = "maxwell"

    def scene(self, seed: int) -> Scene:
        """The start of a repeat."""
        text = TEMPLATE.format(
            shape=self.shape,
            balls=self.balls,
            packing=self.packing,
            speeds=self.speeds,
            cor=self.cor,
        )
        return starting_scene(parse(text).experiment, seed)

    @property
    def settling_events(self) -> int:
        """Collisions of all balls together until measuring begins: two balls share one."""
        return round(self.settling * self.balls / 2)

    @property
    def measured_events(self) -> int:
        """The same while it goes on."""
        return round(self.collisions * self.balls / 2)

    @property
    def free(self) -> int:
        """Balls that the law of speeds counts: a periodic box without momentum has one less."""
        return self.balls - (not SHAPES[self.shape].has_wall)

    def setting(self) -> Parameters:
        """What a row tells of it."""
        return Parameters(
            shape=self.shape,
            balls=self.balls,
            packing=self.packing,
            cor=self.cor,
            settling=self.settling_events,
            collisions=self.measured_events,
            seeds=self.seeds,
        )


def over_seeds(gas: GasSample, measure: Callable[[Scene, Summary], tuple[float, ...]]) -> Array:
    """What is measured of each repeat, a row each; the same for any number of threads."""

    def one(seed: int) -> tuple[float, ...]:
        scene = gas.scene(seed)
        events = gas.settling_events + gas.measured_events
        summary = simulate(scene, collisions=events, summary=True, engine="cells").summary
        assert summary is not None
        return measure(scene, evenly(summary))

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return np.array(list(pool.map(one, range(gas.seeds))))


def evenly(summary: Summary) -> Summary:
    """A summary with the last row and those of the even grid, for means over its rows."""
    time = summary.series.time
    rows = np.append(time[:-1] % (time[-2] - time[-3]) == 0, True)
    series = Series(*(column[rows] for column in vars(summary.series).values()))
    return Summary(series, summary.speed_histogram[rows])


def means(rows: Array) -> list[tuple[float, float]]:
    """Mean and standard error of each column over the repeats."""
    return [mean_and_error(column) for column in rows.T]


# Pressure and collision rate of elastic disks in a periodic box, beside what is published.

STATE, RATE = "equation of state", "collision rate"

VIRIALS = "Padé of ten virial coefficients, Clisby & McCoy 2006"
ENSKOG = "Enskog, contact value of that Padé"

PUBLISHED_PRECISION = 1e-4
"""Relative error of simulated Z where they are published, and of the Padé at their packings, where
its last coefficients matter; at a packing of 0.4 and below these change nothing that is seen."""

SERIES_EXACT = 0.4


def fluid_rows(gas: GasSample) -> list[KnownValue]:
    """Z beside the simulations of others, where there are any, and the Padé; the rate."""
    scene = gas.scene(0)
    number, packing = gas.balls, gas.packing
    density = theory.number_density(number, scene.container.area)
    temperature = meeting_temperature(scene.kinetic_energy, scene)
    (ratio, ratio_error), (rate, rate_error) = means(over_seeds(gas, partial(ratio_and_rate, gas)))
    lacking = missing(packing, number)
    precision = PUBLISHED_PRECISION if packing > SERIES_EXACT else 0.0
    simulated = theory.published_ratio(packing)
    sources = [(theory.compressibility(packing), precision, VIRIALS)]
    if simulated is not None:
        sources.insert(0, (simulated.ratio, PUBLISHED_PRECISION, simulated.source))
    found = [
        KnownValue(
            group=STATE,
            quantity="Z = PV/NT",
            setting=gas.setting(),
            measured=ratio,
            error=ratio_error,
            expected=value,
            expected_error=relative * value,
            whose=PUBLISHED,
            source=source,
            known=-lacking,
        )
        for value, relative, source in sources
    ]
    contact = theory.contact_value(packing)
    radius = float(scene.radii[0])
    expected = theory.ball_ball_rate(density, radius, temperature, contact)
    fewer = 1 - lacking / (2 * packing * contact)
    found.append(
        KnownValue(
            group=RATE,
            quantity="collisions of a ball, 1/s",
            setting=gas.setting(),
            measured=rate,
            error=rate_error,
            expected=expected,
            expected_error=precision * expected,
            whose=PUBLISHED,
            source=ENSKOG,
            known=expected * (fewer * theory.fixed_energy_factor(gas.free) - 1),
        )
    )
    return found


def ratio_and_rate(gas: GasSample, scene: Scene, summary: Summary) -> tuple[float, float]:
    """Z by the virial, and collisions of a ball per second, of a repeat once it has settled."""
    series = summary.series
    since = int(np.searchsorted(series.pair_events, gas.settling_events))
    time, virial, events = (
        float(column[-1] - column[since])
        for column in (series.time, series.pair_virial, series.pair_events)
    )
    warm = gas.balls * meeting_temperature(scene.kinetic_energy, scene)
    return 1 + virial / (2 * warm * time), 2 * events / (gas.balls * time)


def missing(packing: float, number: int) -> float:
    """What Z lacks with N balls in a periodic box: n P''/(2 N P')."""
    step = 1e-4
    x = packing + step * np.array([-1.0, 0.0, 1.0])
    pressure = x * theory.compressibility(x)
    first = (pressure[2] - pressure[0]) / (2 * step)
    second = (pressure[2] - 2 * pressure[1] + pressure[0]) / step**2
    return float(packing * second / first / (2 * number))


# Cooling by Haff's law, the shape of its speeds, and how equal speeds become Maxwell's.

HAFF, SHAPE, RELAXATION = "Haff's law", "speeds of a cooling gas", "kurtosis relaxation"

SONINE_RATE = 0.001
"""Of the cooling rate, by ``theory.sonine_coefficient``: what a2 alone may leave out."""

SONINE_ERROR = 0.005
"""Of a2 itself, from the same place, at a CoR of 0.5 and above."""

SONINE = "van Noije & Ernst 1998, linearised as by Montanero & Santos 2000"

INDEPENDENT = "independent code of this project"

SIMULATED_A2 = {0.95: -0.0211, 0.9: -0.0298, 0.8: -0.0263, 0.7: -0.0017}
"""a2 by CoR: Boltzmann's equation by direct simulation, with independent code of this project."""

SIMULATED_A2_ERROR = 0.0004

KURTOSES = (1.00, 1.26, 1.47, 1.63, 1.75, 1.83, 1.89)
"""⟨v⁴⟩/⟨v²⟩² after 0 … 6 collisions a ball from equal speeds, elastic, in a large system.

By independent code of this project too; to half a last digit.
"""

KURTOSIS_PRECISION = 0.005


def haff_rows(gas: GasSample, dilute: bool) -> list[KnownValue]:
    """Haff's rate beside theory's with and without a2; if dilute, its evenness and a2 too."""
    scene = gas.scene(0)
    temperature = meeting_temperature(scene.kinetic_energy, scene)
    density = theory.number_density(gas.balls, scene.container.area)
    contact = theory.contact_value(gas.packing)
    rate = theory.ball_ball_rate(density, float(scene.radii[0]), temperature, contact)
    alpha = theory.haff_rate(theory.cooling_rate(gas.cor, rate))
    (slope, slope_error), (even, even_error), (a2, a2_error) = means(
        over_seeds(gas, partial(slopes_and_shape, gas))
    )
    fewer = 1 - missing(gas.packing, gas.balls) / (2 * gas.packing * contact)
    cube = mean_cube(gas.free)
    without = theory.haff_rate(
        -math.log(theory.energy_ratio_by_events(1, gas.cor, rate / 2, 1.0, 0.0))
    )
    bare = (slope - without * fewer * cube) / slope_error
    open_part = SONINE_RATE + gas.packing
    correlated = (
        f"a3 and beyond, {SONINE_RATE:g} of it, and correlated collisions, which Enskog leaves "
        "out: a part of the order of the packing"
    )
    row = partial(KnownValue, setting=gas.setting(), expected_error=0.0, whose=PUBLISHED)
    found = [
        row(
            group=HAFF,
            quantity="Haff's rate, 1/s",
            measured=slope,
            error=slope_error,
            expected=alpha,
            source="Haff 1983, Enskog, a2 after van Noije & Ernst 1998",
            known=alpha * (fewer * cube - 1),
            systematic=open_part * alpha,
            reason=correlated,
            note=f"without a2 {bare:+.1f} errors would be left".replace("-", "−"),
        )
    ]
    if not dilute:
        return found
    return [
        *found,
        row(
            group=HAFF,
            quantity="slope of √(E0/E), later over earlier half",
            measured=even,
            error=even_error,
            expected=1.0,
            source="Haff 1983",
            systematic=open_part,
            reason=correlated,
        ),
        row(
            group=SHAPE,
            quantity="a2",
            measured=a2,
            error=a2_error,
            expected=theory.sonine_coefficient(gas.cor),
            source=SONINE,
            systematic=SONINE_ERROR,
            reason="linear in a2 and without a3",
        ),
        KnownValue(
            group=SHAPE,
            quantity="a2",
            setting=gas.setting(),
            measured=a2,
            error=a2_error,
            expected=SIMULATED_A2[gas.cor],
            expected_error=SIMULATED_A2_ERROR,
            whose=OWN,
            source=f"Boltzmann's equation, {INDEPENDENT}",
        ),
    ]


def mean_cube(free: int) -> float:
    """Mean |u|³ of a velocity component of N balls at fixed energy, over Maxwell's.

    N^(3/2) Γ(N)/Γ(N + 3/2): the 2N components are uniform on a sphere.
    """
    return theory.fixed_energy_factor(free) * free / (free + 0.5)


def slopes_and_shape(gas: GasSample, _: Scene, summary: Summary) -> tuple[float, float, float]:
    """Slope of √(E0/E) (1/s), that of the later half over that of the earlier, and a2.

    The halves have as many collisions each. a2 is over the law of N − 1 balls at fixed energy.
    """
    series = summary.series
    root = np.sqrt(series.kinetic_energy[0] / series.kinetic_energy)
    half = gas.measured_events // 2
    first, middle = np.searchsorted(
        series.pair_events, [gas.settling_events, gas.settling_events + half]
    )
    earlier, later, whole = (
        float((root[end] - root[start]) / (series.time[end] - series.time[start]))
        for start, end in ((first, middle), (middle, -1), (first, -1))
    )
    kurtosis = float(np.mean(series.energy_moment[first:]))
    return whole, later / earlier, kurtosis / theory.fixed_energy_kurtosis(gas.free) - 1


def relaxation_rows(gas: GasSample) -> list[KnownValue]:
    """The kurtosis after each collision of a ball from equal speeds on."""
    found = means(over_seeds(gas, partial(kurtoses, gas)))
    return [
        KnownValue(
            group=RELAXATION,
            quantity=f"kurtosis after {counted(collisions, 'collision')} a ball",
            setting=gas.setting(),
            measured=kurtosis,
            error=error,
            expected=expected,
            expected_error=0.0,
            whose=OWN,
            source=INDEPENDENT,
            # Taking off the drift widens equal speeds by 2/N; at the end N − 1 of them are free.
            systematic=KURTOSIS_PRECISION + 2 / gas.balls,
            reason="printed to two digits, and 2/N for finite N",
        )
        for collisions, ((kurtosis, error), expected) in enumerate(
            zip(found, KURTOSES, strict=True)
        )
        if collisions
    ]


def kurtoses(gas: GasSample, _: Scene, summary: Summary) -> tuple[float, ...]:
    """The kurtosis of a repeat at whole numbers of collisions a ball."""
    series = summary.series
    collisions = 2 * series.pair_events / gas.balls
    wanted = np.arange(len(KURTOSES), dtype=np.float64)
    return tuple(np.interp(wanted, collisions, series.energy_moment).tolist())


# Speeds of few balls at fixed energy, beside the Beta law, which is exact for them.

SPEEDS = "speeds at fixed energy"

BETA = "Beta law, exact"

APART = 5.0
"""Collisions of a ball between two readings; ⟨v⁴⟩ has by then forgotten nine tenths."""

LEAST_SHARE = 2e-3
"""Of the balls in a bin of χ², faster ones being in the last; so that no bin is nearly empty."""

DRAWS, DRAWN_TIMES = 300, 200
"""Values of χ² that are drawn, each of so many readings: its law does not depend on how many."""


def speed_rows(gas: GasSample) -> list[KnownValue]:
    """Mean speed, kurtosis and χ² of the speeds of a gas."""
    temperature = gas.scene(0).kinetic_energy / gas.balls
    found = over_seeds(gas, partial(speeds, gas))
    (speed, speed_error), (kurtosis, kurtosis_error) = means(found[:, :2])
    counts = found[:, 2:].sum(axis=0)
    shares = expected_shares(gas.free, temperature)
    drawn = np.array([chi_square(each, shares) for each in drawn_counts(gas)])
    bins = len(shares)
    times = round(float(counts.sum()) / gas.balls)
    row = partial(
        KnownValue,
        group=SPEEDS,
        setting=gas.setting(),
        expected_error=0.0,
        whose=EXACT,
        source=BETA,
    )
    read = f"read at {times:,} times, {APART:g} collisions of a ball apart or more"
    return [
        row(
            quantity="mean speed, m/s",
            measured=speed,
            error=speed_error,
            expected=theory.fixed_energy_mean_speed(gas.free, temperature),
            note=read,
        ),
        row(
            quantity="⟨v⁴⟩/⟨v²⟩²",
            measured=kurtosis,
            error=kurtosis_error,
            expected=theory.fixed_energy_kurtosis(gas.free),
        ),
        row(
            quantity=f"χ² of {bins} bins",
            measured=chi_square(counts, shares),
            error=float(np.std(drawn, ddof=1)),
            expected=float(np.mean(drawn)),
            note=f"± is its spread in {DRAWS} draws from that law",
        ),
    ]


def speeds(gas: GasSample, _: Scene, summary: Summary) -> tuple[float, ...]:
    """Mean speed and kurtosis over the readings of a repeat, and balls by reduced speed."""
    series, readings = summary.series, reading_rows(gas, summary.series)
    return (
        float(np.mean(series.mean_speed[readings])),
        float(np.mean(series.energy_moment[readings])),
        *summary.speed_histogram[readings].sum(axis=0).tolist(),
    )


def reading_rows(gas: GasSample, series: Series) -> NDArray[np.intp]:
    """Rows of the even grid once a repeat has settled, so many apart that balls have collided.

    By the mean rate. The last row, which is off the grid, is not among them.
    """
    first = int(np.searchsorted(series.pair_events, gas.settling_events))
    speed_rows = np.arange(first, len(series.time) - 1)
    collisions = 2 * (series.pair_events[speed_rows[-1]] - series.pair_events[first]) / gas.balls
    return speed_rows[:: max(1, math.ceil(APART * (len(speed_rows) - 1) / collisions))]


def expected_shares(free: int, temperature: float) -> Array:
    """Shares of balls in the bins of reduced speed by the exact law, the fast ones merged."""
    edges = math.sqrt(2 * temperature) * SPEED_BIN * np.arange(SPEED_BINS, dtype=np.float64)
    above = 1.0 - theory.fixed_energy_speed_cdf(edges, free, temperature)
    kept = above[above >= LEAST_SHARE]
    return np.append(-np.diff(kept), kept[-1])


def chi_square(counts: Array, shares: Array) -> float:
    """χ² of counts by reduced speed against shares whose last bin has all faster ones."""
    last = len(shares) - 1
    merged = np.append(counts[:last], counts[last:].sum())
    expected = merged.sum() * shares
    return float(np.sum((merged - expected) ** 2 / expected))


def drawn_counts(gas: GasSample) -> Array:
    """Balls by reduced speed, as chance makes them in some readings; a row each."""
    generator = np.random.default_rng(1)
    found = []
    for _ in range(DRAWS):
        velocities = generator.normal(size=(DRAWN_TIMES, gas.balls, 2))
        if not SHAPES[gas.shape].has_wall:
            velocities -= velocities.mean(axis=1, keepdims=True)
        squares = np.sum(velocities**2, axis=2)
        reduced = np.sqrt(squares / squares.mean(axis=1, keepdims=True))
        bins = np.minimum((reduced / SPEED_BIN).astype(int), SPEED_BINS - 1)
        found.append(np.bincount(bins.ravel(), minlength=SPEED_BINS))
    return np.array(found)
