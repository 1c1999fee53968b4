"""``snooker bench physics``: gases beside known values of their pressure, rates and speeds.

Gases are simulated in threads. A mean over seeds, with its error, is beside each known value.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis.observables import mean_and_error
from snooker_cli.containers import SHAPES
from snooker_cli.engine import simulate
from snooker_cli.formatting import listed, short, with_error
from snooker_cli.neighbours import Floats
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs.execution import processors
from snooker_cli.trace import Series
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

ALLOWED = 4.0  # allowed standard errors: by chance a few dozen rows exceed three, not four

ONLY_OPEN = "only with open"
"""The agreement of a row that deviates by more than ``ALLOWED``, but within what is open."""

START_TEMPERATURE = 50.0
"""Kinetic energy of a ball of 1 kg at the start, J, on average: half of the square of 10 m/s."""


@dataclass(frozen=True)
class GasSample:
    """Equal balls of 1 m and 1 kg that start on a lattice at ``START_TEMPERATURE``.

    settling, collisions : collisions with balls that each ball has before and while measuring
    seeds : repeats
    """

    __pydantic_config__: ClassVar = STRICT

    balls: int
    packing: float
    settling: float
    collisions: float
    seeds: int
    cor: float = 1.0
    shape: str = "periodic"

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
    def temperature(self) -> float:
        """Temperature at which balls meet each other at the start, J."""
        return START_TEMPERATURE * self.balls / self.free

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

    def means(self, measure: Callable[["GasSample", Series], tuple[float, ...]]) -> Floats:
        """Mean and standard error over seeds of each measured value, a row each.

        The same for any number of threads.
        """
        balls = {"count": self.balls, "radius": 1.0, "packing": self.packing}
        experiment = lattice_gas({"shape": self.shape}, self.cor, **balls)
        events = self.settling_events + self.measured_events

        def measured(seed: int) -> tuple[float, ...]:
            scene = starting_scene(experiment, seed)
            summary = simulate(scene, collisions=events, summary=True, engine="cells").summary
            assert summary is not None
            return measure(self, evenly(summary.series))

        with ThreadPoolExecutor(processors()) as pool:
            rows = np.array(list(pool.map(measured, range(self.seeds))))
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
    """Mean speed and kurtosis of the speeds of a gas."""
    speed, kurtosis = gas.means(speeds)
    expected = theory.fixed_energy_mean_speed(gas.free, START_TEMPERATURE)
    yield known_value(SPEEDS, "mean speed, m/s", gas, speed, expected, BETA)
    expected = theory.fixed_energy_kurtosis(gas.free)
    yield known_value(SPEEDS, "⟨v⁴⟩/⟨v²⟩²", gas, kurtosis, expected, BETA)


def speeds(gas: GasSample, series: Series) -> tuple[float, float]:
    """Mean speed and kurtosis over the rows of the even grid after settling."""
    rows = slice(int(np.searchsorted(series.pair_events, gas.settling_events)), -1)
    return float(np.mean(series.mean_speed[rows])), float(np.mean(series.energy_moment[rows]))


ROWS: Mapping[str, Callable[[GasSample], Iterator[Record]]] = {
    "fluids": fluid_rows,
    "cooling": partial(haff_rows, dilute=True),
    "cooling_denser": haff_rows,
    "speeds": speed_rows,
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
        return {"allowed_errors": ALLOWED, "notes": LEGENDS["physics"], "rows": rows}

    @staticmethod
    def passed(record: Record) -> bool:
        return all(row["agreement"] != "no" for row in record["rows"])

    @staticmethod
    def tables(record: Record) -> Iterator[str]:
        yield from header_lines(record)
        for group in dict.fromkeys(row["group"] for row in record["rows"]):
            yield from ("", group)
            shown = [row | row["setting"] for row in record["rows"] if row["group"] == group]
            yield from table(shown, CELLS, left=("quantity", "agrees", "source"))
        yield ""
        yield from record["notes"]
        yield verdict(record["rows"])


def verdict(rows: Sequence[Record]) -> str:
    """The number of rows that agree, and the names and deviations of the others."""
    agreeing = sum(row["agreement"] == "yes" for row in rows)
    sentence = f"{agreeing} of {len(rows)} rows agree within {ALLOWED:g} standard errors"
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


CELLS: Cells = {
    "quantity": lambda row: row["quantity"] + f", {row['shape']}" * SHAPES[row["shape"]].has_wall,
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
