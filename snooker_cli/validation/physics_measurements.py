"""Gases beside known values: their scenes, repeats in threads, and means over seeds."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis.observables import mean_and_error, meeting_temperature
from snooker_cli.config import parse
from snooker_cli.containers import SHAPES
from snooker_cli.engine import simulate
from snooker_cli.formatting import counted
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.trace import SPEED_BIN, SPEED_BINS, Series, Summary

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene

    Array = NDArray[np.float64]

ALLOWED = 4.0
"""Allowed standard errors: by chance a few dozen rows exceed three, not four."""

PUBLISHED, EXACT, OWN = "published", "exact", "own"
"""The origin of an expected value: a published simulation or theory; a law without an error; or a
simulation by independent code of this project, which is a check and no authority."""

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

    settling, collisions : collisions with balls that each ball has before and while measuring
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
        return starting_scene(parse(TEMPLATE.format(**vars(self))).experiment, seed)

    @property
    def settling_events(self) -> int:
        """Collisions of all balls together before measuring: two balls share one."""
        return round(self.settling * self.balls / 2)

    @property
    def measured_events(self) -> int:
        """Collisions of all balls together while measuring."""
        return round(self.collisions * self.balls / 2)

    @property
    def free(self) -> int:
        """Free velocities of balls: a periodic box without momentum has one less."""
        return self.balls - (not SHAPES[self.shape].has_wall)

    def means(self, measure: Callable[[GasSample, Scene, Summary], tuple[float, ...]]) -> Array:
        """Mean and standard error over seeds of each measured value, a row each."""
        return np.array([mean_and_error(column) for column in self.repeats(measure).T])

    def repeats(self, measure: Callable[[GasSample, Scene, Summary], tuple[float, ...]]) -> Array:
        """What is measured of each repeat, a row each; the same for any number of threads."""

        def one(seed: int) -> tuple[float, ...]:
            scene = self.scene(seed)
            events = self.settling_events + self.measured_events
            summary = simulate(scene, collisions=events, summary=True, engine="cells").summary
            assert summary is not None
            return measure(self, scene, evenly(summary))

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return np.array(list(pool.map(one, range(self.seeds))))


@dataclass(frozen=True)
class KnownValue:
    """The mean of a quantity over seeds beside an expected value.

    error, expected_error : standard errors; the second as far as it is known
    whose : ``PUBLISHED``, ``EXACT`` or ``OWN``, of the expected value
    source : of the expected value, author and year
    known : what a finite number of balls adds to the expected value, by theory
    systematic : how far the expected value may be off for another reason, by bound or estimate
    reason : this reason
    """

    group: str
    quantity: str
    gas: GasSample
    measured: float
    error: float
    expected: float
    whose: str
    source: str
    expected_error: float = 0.0
    known: float = 0.0
    systematic: float = 0.0
    reason: str = ""
    note: str = ""

    @property
    def difference(self) -> float:
        """Measured less expected."""
        return self.measured - self.expected

    @property
    def both_errors(self) -> float:
        """Standard error of the difference."""
        return math.hypot(self.error, self.expected_error)

    @property
    def left_in_errors(self) -> float:
        """The difference without the known part, in standard errors."""
        return (self.difference - self.known) / self.both_errors

    @property
    def agrees(self) -> bool:
        """Whether the rest is within the allowed errors and the systematic one."""
        left = abs(self.difference - self.known)
        return left <= ALLOWED * self.both_errors + self.systematic

    def as_json(self) -> dict[str, Any]:
        """The fields and what follows from them."""
        gas = self.gas
        setting = {key: getattr(gas, key) for key in ("shape", "balls", "packing", "cor", "seeds")}
        setting |= {"settling": gas.settling_events, "collisions": gas.measured_events}
        fields = {key: value for key, value in asdict(self).items() if key != "gas"}
        return fields | {
            "setting": setting,
            "difference": self.difference,
            "both_errors": self.both_errors,
            "in_errors": self.difference / self.both_errors,
            "left_in_errors": self.left_in_errors,
            "agrees": self.agrees,
        }


def evenly(summary: Summary) -> Summary:
    """The rows of a summary that are on the even grid, and the last, for means over rows."""
    time = summary.series.time
    rows = np.append(time[:-1] % (time[-2] - time[-3]) == 0, True)
    series = Series(*(column[rows] for column in vars(summary.series).values()))
    return Summary(series, summary.speed_histogram[rows])


# Pressure and collision rate of elastic disks in a periodic box

STATE, RATE = "equation of state", "collision rate"

VIRIALS = "Padé of ten virial coefficients, Clisby & McCoy 2006"
ENSKOG = "Enskog, contact value of that Padé"

PUBLISHED_PRECISION = 1e-4
"""Relative error of published simulated Z, and of the Padé above ``SERIES_EXACT``, where its last
coefficients matter."""

SERIES_EXACT = 0.4


def fluid_rows(gas: GasSample) -> Iterator[KnownValue]:
    """Z beside published simulations, if there are any, and the Padé; the collision rate."""
    scene, packing = gas.scene(0), gas.packing
    (ratio, ratio_error), (rate, rate_error) = gas.means(ratio_and_rate)
    lacking = missing(packing, gas.balls)
    precision = PUBLISHED_PRECISION if packing > SERIES_EXACT else 0.0
    sources = [(theory.compressibility(packing), precision, VIRIALS)]
    simulated = theory.published_ratio(packing)
    if simulated is not None:
        sources.insert(0, (simulated.ratio, PUBLISHED_PRECISION, simulated.source))
    for value, relative, source in sources:
        yield KnownValue(
            *(STATE, "Z = PV/NT", gas, ratio, ratio_error, value, PUBLISHED, source),
            expected_error=relative * value,
            known=-lacking,
        )
    contact = theory.contact_value(packing)
    expected = collision_rate(gas, scene)
    fewer = 1 - lacking / (2 * packing * contact)
    yield KnownValue(
        *(RATE, "collisions of a ball, 1/s", gas, rate, rate_error, expected, PUBLISHED, ENSKOG),
        expected_error=precision * expected,
        known=expected * (fewer * theory.fixed_energy_factor(gas.free) - 1),
    )


def collision_rate(gas: GasSample, scene: Scene) -> float:
    """Enskog's rate of collisions of a ball with others, 1/s."""
    return theory.ball_ball_rate(
        theory.number_density(gas.balls, scene.container.area),
        float(scene.radii[0]),
        meeting_temperature(scene.kinetic_energy, scene),
        theory.contact_value(gas.packing),
    )


def ratio_and_rate(gas: GasSample, scene: Scene, summary: Summary) -> tuple[float, float]:
    """Z by the virial, and collisions of a ball per second, of a repeat after settling."""
    series = summary.series
    since = int(np.searchsorted(series.pair_events, gas.settling_events))
    time, virial, events = (
        float(column[-1] - column[since])
        for column in (series.time, series.pair_virial, series.pair_events)
    )
    thermal = gas.balls * meeting_temperature(scene.kinetic_energy, scene)
    return 1 + virial / (2 * thermal * time), 2 * events / (gas.balls * time)


def missing(packing: float, number: int) -> float:
    """What Z lacks with N balls in a periodic box: n P''/(2 N P')."""
    step = 1e-4
    x = packing + step * np.array([-1.0, 0.0, 1.0])
    pressure = x * theory.compressibility(x)
    first = (pressure[2] - pressure[0]) / (2 * step)
    second = (pressure[2] - 2 * pressure[1] + pressure[0]) / step**2
    return float(packing * second / first / (2 * number))


# Haff's law of cooling, the speeds of a cooling gas, and how equal speeds become Maxwell's

HAFF, SHAPE, RELAXATION = "Haff's law", "speeds of a cooling gas", "kurtosis relaxation"

SONINE_RATE = 0.001
"""What a2 alone may leave out of the cooling rate, relative, by ``theory.sonine_coefficient``."""

SONINE_ERROR = 0.005
"""Error of a2 itself, from the same source, at a CoR of 0.5 and above."""

SONINE = "van Noije & Ernst 1998, linearised as by Montanero & Santos 2000"

INDEPENDENT = "independent code of this project"

SIMULATED_A2 = {0.95: -0.0211, 0.9: -0.0298, 0.8: -0.0263, 0.7: -0.0017}
"""a2 by CoR: Boltzmann's equation by direct simulation, with independent code of this project."""

SIMULATED_A2_ERROR = 0.0004

KURTOSES = (1.00, 1.26, 1.47, 1.63, 1.75, 1.83, 1.89)
"""⟨v⁴⟩/⟨v²⟩² after 0 … 6 collisions a ball from equal speeds, elastic, in a large system.

From independent code of this project, to half a last digit.
"""

KURTOSIS_PRECISION = 0.005


def haff_rows(gas: GasSample, dilute: bool) -> Iterator[KnownValue]:
    """Haff's rate beside theory; in a dilute gas also whether it is constant, and a2."""
    rate, contact = collision_rate(gas, gas.scene(0)), theory.contact_value(gas.packing)
    alpha = theory.haff_rate(theory.cooling_rate(gas.cor, rate))
    (slope, slope_error), (even, even_error), (a2, a2_error) = gas.means(slopes_and_shape)
    # What N balls change: their collisions are fewer, and their energy is fixed.
    factor = (1 - missing(gas.packing, gas.balls) / (2 * gas.packing * contact)) * mean_cube(
        gas.free
    )
    without = theory.haff_rate(
        -math.log(theory.energy_ratio_by_events(1, gas.cor, rate / 2, 1.0, 0.0))
    )
    left = f"{(slope - without * factor) / slope_error:+.1f}".replace("-", "−")
    systematic = SONINE_RATE + gas.packing
    reason = (
        f"a3 and beyond, {SONINE_RATE:g} of it, and correlated collisions, which Enskog leaves "
        "out: a part of the order of the packing"
    )
    haff = "Haff 1983, Enskog, a2 after van Noije & Ernst 1998"
    yield KnownValue(
        *(HAFF, "Haff's rate, 1/s", gas, slope, slope_error, alpha, PUBLISHED, haff),
        known=alpha * (factor - 1),
        systematic=systematic * alpha,
        reason=reason,
        note=f"without a2 {left} errors would be left",
    )
    if not dilute:
        return
    quantity = "slope of √(E0/E), later over earlier half"
    yield KnownValue(
        *(HAFF, quantity, gas, even, even_error, 1.0, PUBLISHED, "Haff 1983"),
        systematic=systematic,
        reason=reason,
    )
    expected = theory.sonine_coefficient(gas.cor)
    yield KnownValue(
        *(SHAPE, "a2", gas, a2, a2_error, expected, PUBLISHED, SONINE),
        systematic=SONINE_ERROR,
        reason="linear in a2 and without a3",
    )
    source = f"Boltzmann's equation, {INDEPENDENT}"
    yield KnownValue(
        *(SHAPE, "a2", gas, a2, a2_error, SIMULATED_A2[gas.cor], OWN, source),
        expected_error=SIMULATED_A2_ERROR,
    )


def mean_cube(free: int) -> float:
    """Mean |u|³ of a velocity component of N balls at fixed energy, over Maxwell's.

    N^(3/2) Γ(N)/Γ(N + 3/2): the 2N components are uniform on a sphere.
    """
    return theory.fixed_energy_factor(free) * free / (free + 0.5)


def slopes_and_shape(gas: GasSample, _: Scene, summary: Summary) -> tuple[float, float, float]:
    """Slope of √(E0/E) (1/s), that of the later half over that of the earlier, and a2.

    The halves have equally many collisions. a2 is relative to N − 1 balls at fixed energy.
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


def relaxation_rows(gas: GasSample) -> Iterator[KnownValue]:
    """The kurtosis after each collision of a ball, from equal speeds on."""
    found = list(zip(gas.means(kurtoses), KURTOSES, strict=True))
    for collisions, ((kurtosis, error), expected) in enumerate(found[1:], start=1):
        quantity = f"kurtosis after {counted(collisions, 'collision')} a ball"
        yield KnownValue(
            *(RELAXATION, quantity, gas, kurtosis, error, expected, OWN, INDEPENDENT),
            # Removing the drift widens equal speeds by 2/N; at the end N − 1 of them are free.
            systematic=KURTOSIS_PRECISION + 2 / gas.balls,
            reason="printed to two digits, and 2/N for finite N",
        )


def kurtoses(gas: GasSample, _: Scene, summary: Summary) -> tuple[float, ...]:
    """The kurtosis of a repeat at whole numbers of collisions a ball."""
    series = summary.series
    collisions = 2 * series.pair_events / gas.balls
    return tuple(np.interp(np.arange(len(KURTOSES)), collisions, series.energy_moment).tolist())


# Speeds of few balls at fixed energy, which have the Beta law exactly

SPEEDS = "speeds at fixed energy"

BETA = "Beta law, exact"

APART = 5.0
"""Collisions of a ball between two readings; ⟨v⁴⟩ has forgotten nine tenths by then."""

LEAST_SHARE = 2e-3
"""Least share of the balls in a bin of χ²; the last bin has all faster ones."""

DRAWS, DRAWN_TIMES = 300, 200
"""Random values of χ², and readings in each; its law does not depend on the number of readings."""


def speed_rows(gas: GasSample) -> Iterator[KnownValue]:
    """Mean speed, kurtosis and χ² of the speeds of a gas."""
    temperature = gas.scene(0).kinetic_energy / gas.balls
    found = gas.repeats(speeds)
    speed, kurtosis = (mean_and_error(column) for column in found[:, :2].T)
    counts = found[:, 2:].sum(axis=0)
    shares = expected_shares(gas.free, temperature)
    drawn = np.array([chi_square(each, shares) for each in drawn_counts(gas)])
    times = round(float(counts.sum()) / gas.balls)
    chi = chi_square(counts, shares), float(np.std(drawn, ddof=1))
    mean_speed = theory.fixed_energy_mean_speed(gas.free, temperature)
    exact_kurtosis = theory.fixed_energy_kurtosis(gas.free)
    row = partial(KnownValue, SPEEDS, whose=EXACT, source=BETA, gas=gas)
    for quantity, (measured, error), expected, note in (
        (
            "mean speed, m/s",
            speed,
            mean_speed,
            f"read at {times:,} times, {APART:g} collisions of a ball apart or more",
        ),
        ("⟨v⁴⟩/⟨v²⟩²", kurtosis, exact_kurtosis, ""),
        (
            f"χ² of {len(shares)} bins",
            chi,
            float(np.mean(drawn)),
            f"± is its spread in {DRAWS} draws from that law",
        ),
    ):
        yield row(quantity, measured=measured, error=error, expected=expected, note=note)


def speeds(gas: GasSample, _: Scene, summary: Summary) -> tuple[float, ...]:
    """Mean speed and kurtosis over the readings of a repeat, and balls by reduced speed.

    Readings are rows of the even grid after settling; by the mean rate, balls collide ``APART``
    times between them. The last row, which is off the grid, is not a reading.
    """
    series = summary.series
    first, last = (
        int(np.searchsorted(series.pair_events, gas.settling_events)),
        len(series.time) - 2,
    )
    collisions = 2 * (series.pair_events[last] - series.pair_events[first]) / gas.balls
    readings = slice(first, last + 1, max(1, math.ceil(APART * (last - first) / collisions)))
    return (
        float(np.mean(series.mean_speed[readings])),
        float(np.mean(series.energy_moment[readings])),
        *summary.speed_histogram[readings].sum(axis=0).tolist(),
    )


def expected_shares(free: int, temperature: float) -> Array:
    """Exact shares of balls in the bins of reduced speed, with the fast bins merged."""
    edges = math.sqrt(2 * temperature) * SPEED_BIN * np.arange(SPEED_BINS, dtype=np.float64)
    above = 1.0 - theory.fixed_energy_speed_cdf(edges, free, temperature)
    kept = above[above >= LEAST_SHARE]
    return np.append(-np.diff(kept), kept[-1])


def chi_square(counts: Array, shares: Array) -> float:
    """χ² of counts by reduced speed against shares whose last bin has all faster balls."""
    last = len(shares) - 1
    merged = np.append(counts[:last], counts[last:].sum())
    expected = merged.sum() * shares
    return float(np.sum((merged - expected) ** 2 / expected))


def drawn_counts(gas: GasSample) -> Array:
    """Random balls by reduced speed in some readings; a row for each draw."""
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
