"""Gases that are simulated and measured, and rows of measured beside known values."""

import math
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from snooker_cli import theory
from snooker_cli.config import Config
from snooker_cli.containers import SHAPES
from snooker_cli.engine import States, replay, series, simulate
from snooker_cli.neighbours import Floats
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs.processes import processors
from snooker_cli.scene import Scene
from snooker_cli.trace import Trace
from snooker_cli.validation.study import Record, lattice_gas

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
    def config(self) -> Config:
        """The config of these gases."""
        balls = {"count": self.balls, "radius": 1.0, "packing": self.packing, "speed": self.speed}
        return lattice_gas({"shape": self.shape}, self.cor, self.keys, **balls)

    def start(self, seed: int = 0) -> Scene:
        """The start of a repeat."""
        return starting_scene(self.config, seed)

    def samples(
        self, measure: Callable[["GasSample", Trace], dict[str, Any]], summary: bool = False
    ) -> dict[str, Floats]:
        """The measured values of all seeds, by name; the same for any number of threads."""
        events = self.settling_events + self.measured_events

        def measured(seed: int) -> dict[str, Any]:
            return measure(self, simulate(self.start(seed), collisions=events, summary=summary))

        with ThreadPoolExecutor(processors()) as pool:
            results = list(pool.map(measured, range(self.seeds)))
        return {name: np.array([result[name] for result in results]) for name in results[0]}


def averages(gas: GasSample, trace: Trace) -> dict[str, float]:
    """What a summary gives after settling: means over time and changes; SI units.

    The slopes are those of √(E0/E), of all the time and of its halves, which have equally many
    collisions. ``energy`` is a ball's, and ``fourth`` its mean square. ``hot`` and ``cold`` are
    temperatures at the start and the end.
    """
    columns = series(trace)
    # The rows on the even grid, for means over rows, and the last row.
    even = np.append(columns.time[:-1] % (columns.time[-2] - columns.time[-3]) == 0, True)
    settled = columns[even & (columns.pair_events >= gas.settling_events)]
    middle = (gas.settling_events + int(settled.pair_events[-1])) // 2
    half = np.searchsorted(settled.pair_events, middle)
    edges = [0, int(half), -1]
    root = np.sqrt(columns.kinetic_energy[0] / settled.kinetic_energy)
    earlier, later = np.diff(root[edges]) / np.diff(settled.time[edges])
    changing = settled.time, settled.pair_virial, settled.pair_events
    time, virial, meetings, impulse = (
        float(column[-1] - column[0]) for column in (*changing, settled.wall_impulse)
    )
    length, energies = trace.start.container.wall_length, settled.kinetic_energy / gas.balls
    return {
        "time": time,
        "Z": 1 + virial / (2 * gas.balls * gas.temperature * time),
        "rate": 2 * meetings / (gas.balls * time),
        "pressure": impulse / length / time if length else math.nan,
        "slope": float(root[-1] - root[0]) / time,
        "earlier slope": float(earlier),
        "later slope": float(later),
        "a2": float(np.mean(settled.energy_moment)) / theory.fixed_energy_kurtosis(gas.free) - 1,
        "speed": float(np.mean(settled.mean_speed[:-1])),
        "kurtosis": float(np.mean(settled.energy_moment[:-1])),
        "energy": float(np.mean(energies[:-1])),
        "fourth": float(np.mean(settled.energy_moment[:-1] * energies[:-1] ** 2)),
        "hot": float(settled.kinetic_energy[0]) / gas.free,
        "cold": float(settled.kinetic_energy[-1]) / gas.free,
    }


def known_value(
    group: str,
    quantity: str,
    gas: GasSample,
    measured: tuple[float, float],
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


def settled_states(gas: GasSample, trace: Trace, way: float) -> tuple[float, States]:
    """When a gas has settled (s), and its states since then.

    way : m, of a ball of the starting temperature from one state to the next
    """
    assert trace.events is not None
    pairs = np.cumsum(trace.events.j >= 0)
    settled = float(trace.events.time[np.searchsorted(pairs, gas.settling_events)])
    step = way / math.sqrt(gas.energy)
    return settled, replay(trace, np.arange(settled, trace.stop.time, step))


DIRECT = "direct simulation Monte Carlo, 16 × 100,000 particles"
"""The source of values without correlations in space: tests/validation/direct_simulation.py."""
