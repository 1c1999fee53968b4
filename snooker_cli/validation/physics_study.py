"""``snooker bench physics``: gases beside known values of their pressure, rates and speeds.

Gases are simulated in threads. A mean over seeds, with its error, is beside each known value.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis.observables import mean_and_error, mean_pressure, standard_errors
from snooker_cli.analysis.steady_state import expected_temperatures
from snooker_cli.config import Experiment
from snooker_cli.containers import SHAPES
from snooker_cli.engine import States, replay, series, simulate
from snooker_cli.formatting import listed, short, with_error
from snooker_cli.laws import Viscoelastic
from snooker_cli.neighbours import Floats
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs.execution import processors
from snooker_cli.trace import Series, Trace
from snooker_cli.validation.study import (
    LEGENDS,
    PLANS,
    STRICT,
    Cells,
    Record,
    Study,
    header_lines,
    lattice_gas,
    table,
)

ALLOWED = 3.0  # allowed standard errors

ONLY_OPEN = "only with open"
"""The agreement of a row that deviates by more than ``ALLOWED``, but within what is open."""


@dataclass(frozen=True)
class GasSample:
    """Equal balls of 1 m and 1 kg that start on a lattice with Maxwell's speeds.

    settling, collisions : collisions with balls that each ball has before and while measuring
    seeds : repeats
    speed : root mean square at the start, m/s
    keys : further keys of the config, such as the temperature of the wall
    """

    __pydantic_config__: ClassVar = STRICT

    balls: int
    packing: float
    settling: float
    collisions: float
    seeds: int
    cor: float = 1.0
    shape: str = "periodic"
    speed: float = 10.0
    keys: Mapping[str, Any] = field(default_factory=dict)

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

    @property
    def energy(self) -> float:
        """Kinetic energy of a ball at the start, J, on average."""
        return self.speed**2 / 2

    @property
    def temperature(self) -> float:
        """Temperature at which balls meet each other at the start, J."""
        return self.energy * self.balls / self.free

    @property
    def collision_rate(self) -> float:
        """Enskog's rate of collisions of a ball with others, 1/s."""
        density = self.packing / math.pi  # of balls of radius 1
        contact = theory.contact_value(self.packing)
        return theory.ball_ball_rate(density, 1.0, self.temperature, contact)

    @property
    def met_share(self) -> float:
        """Collisions of a ball with exactly N − 1 others over those by ``collision_rate``."""
        infinite = 2 * self.packing * theory.contact_value(self.packing)  # Z − 1
        return 1 - theory.missing_ratio(self.packing, self.balls) / infinite

    @property
    def experiment(self) -> Experiment:
        """The config of these gases."""
        balls = {"count": self.balls, "radius": 1.0, "packing": self.packing, "speed": self.speed}
        return lattice_gas({"shape": self.shape}, self.cor, self.keys, **balls)

    def samples(
        self,
        measure: Callable[["GasSample", Trace], Sequence[float] | Floats],
        summary: bool = False,
    ) -> Floats:
        """The measured values of each seed, a row each; the same for any number of threads."""
        events = self.settling_events + self.measured_events

        def measured(seed: int) -> Sequence[float] | Floats:
            scene = starting_scene(self.experiment, seed)
            return measure(self, simulate(scene, collisions=events, summary=summary))

        with ThreadPoolExecutor(processors()) as pool:
            return np.array(list(pool.map(measured, range(self.seeds))))

    def means(self, measure: Callable[["GasSample", Series], Sequence[float]]) -> Floats:
        """Mean and standard error over seeds of each measured value of a summary, a row each."""

        def measured(gas: GasSample, trace: Trace) -> Sequence[float]:
            return measure(gas, evenly(series(trace)))

        rows = self.samples(measured, summary=True)
        return np.array([mean_and_error(column) for column in rows.T])


def known_value(
    group: str,
    quantity: str,
    gas: GasSample,
    measured: Sequence[float],
    expected: float,
    source: str,
    *,
    expected_error: float = 0.0,
    known: float = 0.0,
    systematic: float = 0.0,
) -> Record:
    """The row of the mean of a quantity over seeds beside an expected value.

    measured : with its standard error
    source : of the expected value, author and year
    expected_error : standard error of the expected value, as far as it is known
    known : what a finite number of balls adds to the expected value, by theory
    systematic : how far the expected value may be off otherwise, by bound or estimate; it never
        hides a deviation of more than ``ALLOWED``
    """
    mean, error = measured
    difference, both_errors = mean - expected, math.hypot(error, expected_error)
    # Of the difference, what theory predicts for a finite number of balls does not count.
    left = difference - known
    if abs(left) <= ALLOWED * both_errors:
        agreement = "yes"
    else:
        agreement = ONLY_OPEN if abs(left) <= ALLOWED * both_errors + systematic else "no"
    events = {"settling": gas.settling_events, "collisions": gas.measured_events}
    return {
        "group": group,
        "quantity": quantity,
        "setting": vars(gas) | events,
        "measured": mean,
        "error": error,
        "expected": expected,
        "expected_error": expected_error,
        "source": source,
        "known": known,
        "systematic": systematic,
        "difference": difference,
        "both_errors": both_errors,
        "left_in_errors": left / both_errors,
        "agreement": agreement,
    }


def evenly(series: Series) -> Series:
    """The rows of a summary that are on the even grid, and the last, for means over rows."""
    time = series.time
    rows = np.append(time[:-1] % (time[-2] - time[-3]) == 0, True)
    return series[rows]


STATE, RATE = "equation of state", "collision rate"

VIRIALS = "Padé of ten virial coefficients, Clisby & McCoy 2006"
ENSKOG = "Enskog, contact value of that Padé"

PUBLISHED_PRECISION = 1e-4
"""Relative error of published simulated Z, and of the Padé above ``SERIES_EXACT``, where its last
coefficients matter."""

SERIES_EXACT = 0.4


def fluid_rows(gas: GasSample) -> Iterator[Record]:
    """Z beside published simulations, if there are any, and the Padé; the collision rate."""
    packing = gas.packing
    ratio, rate = gas.means(ratio_and_rate)
    precision = PUBLISHED_PRECISION if packing > SERIES_EXACT else 0.0
    sources = [(theory.compressibility(packing), precision, VIRIALS)]
    simulated = theory.published_ratio(packing)
    if simulated is not None:
        sources.insert(0, (simulated.ratio, PUBLISHED_PRECISION, simulated.source))
    for value, relative, source in sources:
        yield known_value(
            *(STATE, "Z = PV/NT", gas, ratio, value, source),
            expected_error=relative * value,
            known=-theory.missing_ratio(packing, gas.balls),
        )
    expected = gas.collision_rate
    yield known_value(
        *(RATE, "collisions of a ball, 1/s", gas, rate, expected, ENSKOG),
        expected_error=precision * expected,
        known=expected * (gas.met_share * theory.fixed_energy_factor(gas.free) - 1),
    )


def ratio_and_rate(gas: GasSample, series: Series) -> tuple[float, float]:
    """Z by the virial, and collisions of a ball per second, of a repeat after settling."""
    since = int(np.searchsorted(series.pair_events, gas.settling_events))
    time, virial, events = (
        float(column[-1] - column[since])
        for column in (series.time, series.pair_virial, series.pair_events)
    )
    thermal = gas.balls * gas.temperature
    return 1 + virial / (2 * thermal * time), 2 * events / (gas.balls * time)


HAFF, SHAPE = "Haff's law", "speeds of a cooling gas"

SONINE_RATE = 0.001
"""What a2 alone may leave out of the cooling rate, relative, by ``theory.sonine_coefficient``."""

SONINE_ERROR = 0.005  # error of a2 itself, from the same source, at a CoR of 0.5 and above

SONINE = "van Noije & Ernst 1998, linearised as by Montanero & Santos 2000"

DIRECT = "direct simulation Monte Carlo, 16 × 100,000 particles"

DIRECT_A2: Mapping[float, Sequence[float]] = PLANS["direct_a2"]
"""a2 and its standard error by CoR."""


def haff_rows(gas: GasSample, dilute: bool = False) -> Iterator[Record]:
    """Haff's rate beside theory; in a dilute gas also whether it is constant, and a2."""
    slope, even, a2 = gas.means(slopes_and_shape)
    alpha = theory.haff_rate(theory.cooling_rate(gas.cor, gas.collision_rate))
    systematic = SONINE_RATE + gas.packing
    haff = "Haff 1983, Enskog, a2 after van Noije & Ernst 1998"
    yield known_value(
        *(HAFF, "Haff's rate, 1/s", gas, slope, alpha, haff),
        # N balls collide less often, and at fixed energy.
        known=alpha * (gas.met_share * finite_loss(gas) - 1),
        systematic=systematic * alpha,
    )
    if not dilute:
        return
    quantity = "slope of √(E0/E), later over earlier half"
    yield known_value(HAFF, quantity, gas, even, 1.0, "Haff 1983", systematic=systematic)
    if gas.cor in DIRECT_A2:
        expected, error = DIRECT_A2[gas.cor]
        yield known_value(SHAPE, "a2", gas, a2, expected, DIRECT, expected_error=error)
    expected = theory.sonine_coefficient(gas.cor)
    yield known_value(SHAPE, "a2", gas, a2, expected, SONINE, systematic=SONINE_ERROR)


def finite_loss(gas: GasSample) -> float:
    """Loss per second of N balls at fixed energy over that of Maxwell's speeds, as many balls meet.

    The mean relative speed has the factor c_N, and N collisions of (N E) `share_in_collision`.
    """
    share = gas.balls * theory.share_in_collision(2 * gas.free)
    return theory.fixed_energy_factor(gas.free) * share


def slopes_and_shape(gas: GasSample, series: Series) -> tuple[float, float, float]:
    """Slope of √(E0/E) (1/s), that of the later half over that of the earlier, and a2.

    The halves have equally many collisions. a2 is relative to N − 1 balls at fixed energy.
    """
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


# Speeds of few balls at fixed energy, which have the Beta law exactly

SPEEDS = "speeds at fixed energy"

BETA = "Beta law, exact"


def speed_rows(gas: GasSample) -> Iterator[Record]:
    """Mean speed and kurtosis of the speeds of a gas, and its pressure on walls."""
    speed, kurtosis, pressure = gas.means(speeds)
    expected = theory.fixed_energy_mean_speed(gas.free, gas.energy)
    yield known_value(SPEEDS, "mean speed, m/s", gas, speed, expected, BETA)
    expected = theory.fixed_energy_kurtosis(gas.free)
    yield known_value(SPEEDS, "⟨v⁴⟩/⟨v²⟩²", gas, kurtosis, expected, BETA)
    container = starting_scene(gas.experiment, 0).container
    if container.has_wall:
        yield wall_pressure(ELASTIC, gas, pressure, gas.energy)


def speeds(gas: GasSample, series: Series) -> tuple[float, float, float]:
    """Mean speed and kurtosis over the rows of the even grid after settling; the pressure."""
    rows = slice(int(np.searchsorted(series.pair_events, gas.settling_events)), -1)
    mean, kurtosis = series.mean_speed[rows], series.energy_moment[rows]
    return float(np.mean(mean)), float(np.mean(kurtosis)), pressure_since(gas, series, rows.start)


def pressure_since(gas: GasSample, series: Series, row: int) -> float:
    """The pressure on walls after a row, Pa m; nan without walls."""
    impulse = float(series.wall_impulse[-1] - series.wall_impulse[row])
    length = starting_scene(gas.experiment, 0).container.wall_length
    time = float(series.time[-1] - series.time[row])
    return impulse / length / time if length else math.nan


ELASTIC = "pressure between elastic walls"

SCALED_PARTICLES = 0.01
"""Relative error of the pressure on walls by scaled particle theory, see ``theory.fluid_state``.

It was chosen from these results: between elastic walls, where nothing else is open, 37 balls in a
box at packing 0.2 have 0.43 % more than theory, and 7 balls 0.6 %.
"""


def wall_pressure(
    group: str, gas: GasSample, measured: Sequence[float], temperature: float
) -> Record:
    """The row of the pressure on walls at a temperature (J), beside scaled particle theory."""
    container = starting_scene(gas.experiment, 0).container
    expected = theory.fluid_state(gas.balls, temperature, 1.0, container).pressure
    source = f"{theory.FINITE}; Helfand et al. 1961"
    names = group, "pressure, Pa m", gas, measured, expected, source
    return known_value(*names, systematic=SCALED_PARTICLES * expected)


# Gases whose walls give energy, and balls whose restitution depends on speed

WARM = "elastic balls and a thermal wall"


def thermal_rows(gas: GasSample) -> Iterator[Record]:
    """Temperature and kurtosis of balls between walls of one temperature, and their pressure."""
    walls = gas.keys["wall_temperature"]
    temperature, fourth, pressure = gas.means(steady)
    yield known_value(WARM, "temperature, J", gas, temperature, walls, "the wall's, canonical")
    kurtosis = fourth / walls**2
    yield known_value(WARM, "⟨v⁴⟩/⟨v²⟩²", gas, kurtosis, 2.0, "Maxwell's, canonical")
    yield wall_pressure(WARM, gas, pressure, walls)


def steady(gas: GasSample, series: Series) -> tuple[float, float, float]:
    """Means after settling: temperature (J), (m v²/2)² (J²), and the pressure (Pa m)."""
    since = int(np.searchsorted(series.pair_events, gas.settling_events))
    energies = series.kinetic_energy[since:-1] / gas.balls
    squares = series.energy_moment[since:-1] * energies**2
    pressure = pressure_since(gas, series, since)
    return float(np.mean(energies)), float(np.mean(squares)), pressure


DRIVEN = "a gas that its wall drives"


def driven_rows(gas: GasSample) -> Iterator[Record]:
    """The temperature of a dilute, nearly elastic gas whose wall is driven."""
    (expected,) = expected_temperatures(starting_scene(gas.experiment, 0)).values()
    yield known_value(
        *(DRIVEN, "temperature, J", gas, gas.means(steady)[0], expected),
        "balance of energy, Kumaran 1998",
        systematic=(1 - gas.cor**2) * expected,
    )


STEADY = "a channel that its walls drive"

SLABS = 12  # of equal width, across a channel

LOCAL_STATE = 0.01
"""Relative error of a pressure by the local density and temperature: collisions reach a diameter
far, and speeds are not Maxwell's. An estimate."""


def channel_rows(gas: GasSample) -> Iterator[Record]:
    """The pressure in slabs of a channel over that on its walls (Barrat & Trizac 2002).

    The stress across it is n [T_x + (1 + e) η χ T]. With T instead of its part T_x across, this is
    the equation of state; it holds as far as T is isotropic.
    """
    across, state, excess = gas.samples(slab_pressures).transpose(1, 0, 2)
    middle = np.arange(SLABS) // (SLABS // 3) == 1
    anisotropy = float(excess[:, middle].mean())
    for name, values, slabs, open_part in (
        ("pressure across, middle third over wall", across, middle, LOCAL_STATE),
        ("pressure across, outer thirds over wall", across, ~middle, LOCAL_STATE),
        ("nT[1 + (1 + e)ηχ], middle third over wall", state, middle, LOCAL_STATE + anisotropy),
    ):
        measured = mean_and_error(values[:, slabs].mean(axis=1))
        source = "Barrat & Trizac 2002"
        yield known_value(STEADY, name, gas, measured, 1.0, source, systematic=open_part)


def slab_pressures(gas: GasSample, trace: Trace) -> Floats:
    """Pressure across and by the equation of state, over that on the walls, and (T_x − T)/T.

    The three are the rows; the columns are the slabs.
    """
    settled, states = settled_states(gas, trace, trace.start.container.size[0] / 10)
    (width, height), e = trace.start.container.size, gas.cor
    edges = np.linspace(1 - width / 2, width / 2 - 1, SLABS + 1)
    x, (u, v) = states.positions[:, :, 0].ravel(), states.velocities.reshape(-1, 2).T
    balls = np.histogram(x, edges)[0]
    along_x, along_y = (np.histogram(x, edges, weights=part**2)[0] / balls for part in (u, v))
    temperature = (along_x + along_y) / 2
    density = balls / (len(states.time) * height * np.diff(edges))
    collisional = (1 + e) * math.pi * density * theory.contact_value(math.pi * density)
    relative = density / mean_pressure(trace, settled)
    across, state = along_x + collisional * temperature, temperature * (1 + collisional)
    return np.array([relative * across, relative * state, along_x / temperature - 1])


def settled_states(gas: GasSample, trace: Trace, way: float) -> tuple[float, States]:
    """When a gas has settled (s), and its states since then.

    way : m, of a ball of the starting temperature from one state to the next
    """
    assert trace.events is not None
    pairs = np.cumsum(trace.events.j >= 0)
    settled = float(trace.events.time[np.searchsorted(pairs, gas.settling_events)])
    step = way / math.sqrt(gas.energy)
    return settled, replay(trace, np.arange(settled, trace.stop.time, step))


SOFTER = "cooling with e(v)"


def viscoelastic_rows(gas: GasSample) -> Iterator[Record]:
    """The time to cool beside the integral over the temperature of the cooling rate."""
    (ratio, hot, cold, a2) = gas.means(cooling)
    # What follows from the measured speeds: how much the measured a2 changes the integral.
    ends = float(hot[0]), float(cold[0])
    slower = cooling_time(gas, *ends, float(a2[0])) / cooling_time(gas, *ends)
    yield known_value(
        *(SOFTER, "time to cool, over Maxwell's", gas, ratio, 1.0, "e(v) of Bizon et al. 1998"),
        known=slower / (gas.met_share * finite_loss(gas)) - 1,
        systematic=SONINE_RATE + gas.packing,
    )


def cooling(gas: GasSample, series: Series) -> tuple[float, float, float, float]:
    """Time to cool after settling over `cooling_time`, both temperatures (J), and a2."""
    since = int(np.searchsorted(series.pair_events, gas.settling_events))
    hot, cold = (float(series.kinetic_energy[row]) / gas.free for row in (since, -1))
    time = float(series.time[-1] - series.time[since])
    kurtosis = float(np.mean(series.energy_moment[since:]))
    a2 = kurtosis / theory.fixed_energy_kurtosis(gas.free) - 1
    return time / cooling_time(gas, hot, cold), hot, cold, a2


def cooling_time(gas: GasSample, hot: float, cold: float, a2: float = 0.0) -> float:
    """∫ dT/(ζ T) between two temperatures, s, with the cooling rate ζ of Enskog's collisions."""
    law = Viscoelastic(gas.cor, gas.keys["cor_speed"])
    temperatures = np.geomspace(hot, cold, 201)
    losses = theory.mean_loss(law, temperatures, a2=a2)
    rates = gas.collision_rate * np.sqrt(temperatures / gas.temperature) * losses / 2
    return -float(np.trapezoid(1 / rates, np.log(temperatures)))


HEAT = "heat conduction of elastic balls"

MAXWELLS_JUMP = 0.25
"""Relative error of Maxwell's jump of temperature, see ``theory.temperature_jump``."""

MIDDLE = 0.5  # of the way from the middle to the walls: there the gradient of T is measured


def conduction_rows(gas: GasSample) -> Iterator[Record]:
    """Flux of heat, conductivity and jump of temperature between walls of two temperatures."""
    fluxes, slopes, temperature, packing = gas.samples(conduction).T
    state = float(packing.mean()), 1.0, float(temperature.mean())
    expected, jump = theory.thermal_conductivity(*state), theory.temperature_jump(*state)
    walls = gas.keys["wall_temperature"]
    difference = walls["right"] - walls["left"]
    width = starting_scene(gas.experiment, 0).container.size[0] - 2
    open_part, whole = MAXWELLS_JUMP * jump, width + 2 * jump
    yield known_value(
        *(HEAT, "flux of heat, J/(m s)", gas, mean_and_error(fluxes)),
        *(expected * difference / whole, "Enskog and Maxwell's jump"),
        systematic=expected * difference / whole * 2 * open_part / whole,
    )
    conductivity = ratio_of_means(fluxes, slopes)
    yield known_value(
        *(HEAT, "conductivity, 1/s", gas, conductivity, expected, "Enskog, Gass 1971"),
        systematic=float(packing.mean()) * expected,
    )
    across, error = ratio_of_means(np.full(gas.seeds, difference), slopes)
    jumps = (across - width) / 2, error / 2
    name = "jump over gradient, m"
    yield known_value(HEAT, name, gas, jumps, jump, "Maxwell 1879", systematic=open_part)


def conduction(gas: GasSample, trace: Trace) -> tuple[float, float, float, float]:
    """Flux of heat to the left, gradient of T, T and packing; the last three in the middle."""
    assert trace.events is not None
    events, size = trace.events, trace.start.container.size
    reach = size[0] / 2 - 1
    # Between two states no ball crosses half of the channel, so its side is that of its next hit.
    settled, states = settled_states(gas, trace, reach / 6)
    duration = trace.stop.time - settled
    x = states.positions[:, :, 0]
    hits = np.flatnonzero(events.at_wall & (events.time > settled))
    right = x[np.searchsorted(states.time, events.time[hits]) - 1, events.i[hits]] > 0
    given = np.diff(series(trace).kinetic_energy)[hits]
    flux = (given[right].sum() - given[~right].sum()) / (2 * size[1] * duration)
    middle = abs(x) < MIDDLE * reach
    energies = np.sum(states.velocities**2, axis=2)[middle] / 2
    slope = np.polyfit(x[middle], energies, 1)[0]
    packing = gas.balls * middle.mean() * math.pi / (2 * MIDDLE * reach * size[1])
    return float(flux), float(slope), float(energies.mean()), float(packing)


def ratio_of_means(values: Floats, others: Floats) -> tuple[float, float]:
    """The ratio of two means over seeds, and its standard error to first order."""
    ratio = float(values.mean() / others.mean())
    return ratio, float(standard_errors(values - ratio * others) / abs(others.mean()))


ROWS: Mapping[str, Callable[[GasSample], Iterator[Record]]] = {
    "fluids": fluid_rows,
    "cooling": partial(haff_rows, dilute=True),
    "cooling_denser": haff_rows,
    "speeds": speed_rows,
    "thermal": thermal_rows,
    "driven": driven_rows,
    "driven_channel": channel_rows,
    "viscoelastic": viscoelastic_rows,
    "conduction": conduction_rows,
}
"""The rows of a gas, by what the gas is measured for."""


@dataclass(frozen=True)
class PhysicsStudy(Study):
    """The gases to measure, by what they are measured for; see plans.yaml."""

    name = "physics"
    libraries = ("numpy", "numba")

    gases: Mapping[str, Sequence[GasSample]]

    def results(self, report: Callable[[str], None]) -> Record:
        """The rows, first those whose expected value leaves nothing open, and notes on them."""
        rows: list[Record] = []
        for purpose, gases in self.gases.items():
            for gas in gases:
                words = purpose.replace("_", ", ")
                report(f"{words}: {gas.balls} balls, packing {gas.packing:.4g}, CoR {gas.cor:g}")
                rows += ROWS[purpose](gas)
        groups = list(dict.fromkeys(row["group"] for row in rows))
        rows.sort(key=lambda row: (row["systematic"] > 0, groups.index(row["group"])))
        chance = {"allowed_errors": ALLOWED, "by_chance": by_chance(rows)}
        return chance | {"notes": LEGENDS["physics"], "rows": rows}

    @staticmethod
    def passed(record: Record) -> bool:
        return all(row["agreement"] != "no" for row in record["rows"])

    @staticmethod
    def tables(record: Record) -> Iterator[str]:
        yield from header_lines(record)
        for group in dict.fromkeys(row["group"] for row in record["rows"]):
            yield from ("", group)
            shown = [row | row["setting"] for row in record["rows"] if row["group"] == group]
            yield from table(shown, CELLS, left=("quantity", "walls", "agrees", "source"))
        yield ""
        yield from record["notes"]
        yield verdict(record["rows"])


def by_chance(rows: Sequence[Record]) -> float:
    """How many rows without an open part would deviate by more than ``ALLOWED`` by chance alone.

    By Student's t of the seeds: rows of few seeds have uncertain errors.
    """
    from scipy.stats import t  # takes time to load

    seeds = [row["setting"]["seeds"] for row in rows if not row["systematic"]]
    return float(sum(2 * t.sf(ALLOWED, number - 1) for number in seeds))


def verdict(rows: Sequence[Record]) -> str:
    """The number of rows that agree, and the names and deviations of the others."""
    agreeing = sum(row["agreement"] == "yes" for row in rows)
    closed = sum(not row["systematic"] for row in rows)
    sentence = (
        f"{agreeing} of {len(rows)} rows agree within {ALLOWED:g} standard errors; by chance alone "
        f"{by_chance(rows):.2g} of the {closed} without an open part would not"
    )
    for answer, words in ((ONLY_OPEN, "only with what is open"), ("no", "not")):
        names = [
            f"{row['quantity']} at packing {row['setting']['packing']:.4g} and "
            f"CoR {row['setting']['cor']:g} ({_left(row)})"
            for row in rows
            if row["agreement"] == answer
        ]
        if names:
            sentence += f"; {words}: {listed(names)}"
    return sentence


def _left(row: Record) -> str:
    return f"{row['left_in_errors']:+.1f}".replace("-", "−")


def walls(setting: Record) -> str:
    """The shape of a gas with its walls, and a CoR that depends on the speed."""
    parts = [str(setting["shape"])]
    for key, value in setting["keys"].items():
        sides = value.values() if isinstance(value, Mapping) else (value,)
        amount = " and ".join(f"{side:g}" for side in sides)
        texts = {"wall_temperature": f"{amount} J", "wall_speed": f"driven, {amount} m/s"}
        texts |= {"cor_speed": f"e(v) up to {amount} m/s"}
        parts += [texts[key]] if key in texts else []
    return ", ".join(parts)


CELLS: Cells = {
    "quantity": lambda row: str(row["quantity"]),
    "walls": walls,
    "start, m/s": lambda row: f"{row['speed']:g}",
    "N": lambda row: f"{row['balls']:,}",
    "packing": lambda row: f"{row['packing']:.4g}",
    "CoR": lambda row: f"{row['cor']:g}",
    "seeds × collisions": lambda row: f"{row['seeds']} × {row['collisions']:,}",
    "measured": lambda row: with_error(row["measured"], row["error"]),
    "expected": lambda row: short(row["expected"], 6),
    "known": lambda row: short(row["known"] or None, 2),
    "left, in errors": _left,
    "open": lambda row: short(row["systematic"] or None, 2),
    "agrees": lambda row: str(row["agreement"]),
    "source": lambda row: str(row["source"]),
}
"""The table of rows with their gases."""
