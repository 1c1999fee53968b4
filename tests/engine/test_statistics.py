"""Averages over many runs against the physics: equilibrium, speeds and cooling.

The numbers were computed for this project with independent throw-away code, unless they are laws.
Differences are measured in standard errors: at most 4 of a mean over seeds, 3 over blocks of a run.
"""

import functools
import math
from dataclasses import dataclass

import numpy as np
import pytest
from exact import exact_events
from numpy.typing import NDArray
from scenes import NEIGHBOURS, gas, report_scene
from scipy import stats
from single_fit import fit

from snooker_cli.analysis.decay import decays
from snooker_cli.engine import replay, series, simulate
from snooker_cli.trace import CONTAINER, StopReason, Trace

N, R, SPEED = 37, 10.0, 10.0
SIGMAS = 4

LONG = pytest.mark.long


def standard_error(values: NDArray[np.float64]) -> float:
    return float(np.std(values, ddof=1)) / math.sqrt(len(values))


# --- equilibrium ----------------------------------------------------------------------------


@functools.cache
def equilibrium(radius: float) -> dict[str, NDArray[np.float64]]:
    """Of each of 100 runs of 10,000 events: pressure, ball-ball and wall collisions a second."""
    rows = []
    for repeat in range(100):
        trace = simulate(report_scene(repeat, radius=radius), collisions=10_000)
        force = trace.events.impulse[trace.events.at_wall].sum() / trace.stop.time
        rates = trace.pair_events / trace.stop.time, trace.wall_events / trace.stop.time
        rows.append((force / (2 * math.pi * R), *rates))
    return dict(zip(("pressure", "pair", "wall"), np.array(rows).T, strict=True))


# Mean and its error over 400 seeds, and the relative spread of a seed where it is stated.
@pytest.mark.parametrize(
    ("radius", "quantity", "expected", "error", "spread"),
    [
        (1.0, "pressure", 17.18, 0.03, 0.015),
        (1.0, "pair", 240.8, 0.4, 0.015),
        (1.0, "wall", 61.11, 0.03, 0.013),
        (0.1, "pressure", 5.9917, 0.0002, None),
        (0.1, "pair", 10.81, 0.005, None),
        (0.1, "wall", 21.30, 0.005, None),
    ],
)
def test_elastic_gas_in_the_circle(radius, quantity, expected, error, spread):
    values = equilibrium(radius)[quantity]
    own_error = (
        standard_error(values) if spread is None else spread * expected / math.sqrt(len(values))
    )
    assert abs(values.mean() - expected) < SIGMAS * own_error + error
    # What is compared is worth comparing: the seeds do not scatter more than that.
    assert standard_error(values) < 0.003 * expected


# --- speeds ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def speeds() -> NDArray[np.float64]:
    """v^2/(N v0^2) of all balls of 20 runs, each at 200 times half a second apart.

    That is some 6 collisions a ball, after which speeds have forgotten each other. Shape
    (20, 200, N).
    """
    runs = []
    for repeat in range(20):
        trace = simulate(report_scene(repeat), time=110.0)
        velocities = replay(trace, np.arange(10.0, 110.0, 0.5)).velocities
        runs.append(np.sum(velocities**2, axis=2) / (N * SPEED**2))
    return np.array(runs)


def test_kurtosis_of_speeds_at_fixed_energy(speeds):
    """<v^4>/<v^2>^2 = 2N/(N + 1)."""
    of_runs = np.mean(speeds**2, axis=(1, 2)) * N**2
    assert abs(of_runs.mean() - 2 * N / (N + 1)) < SIGMAS * standard_error(of_runs)
    assert standard_error(of_runs) < 0.01  # Maxwell and Boltzmann's 2 is 0.053 away


def test_distribution_of_speeds_at_fixed_energy(speeds):
    """v^2/(N v0^2) ~ Beta(1, N - 1), by Kolmogorov and Smirnov at the 0.1 % level (1.95).

    The balls of a snapshot share a fixed energy, which only brings them closer to the law.
    """
    distance = stats.kstest(speeds.ravel(), stats.beta(1, N - 1).cdf).statistic
    assert distance < 1.95 / math.sqrt(speeds.size)


# --- cooling --------------------------------------------------------------------------------

SEEDS = 400


def cooled(radius: float, cor: float, wall_cor: float) -> list[Trace]:
    """500 events from rings 2.7 m apart in a container of 1e7 kg, by seed."""
    changes = {"radius": radius, "cor": cor, "wall_cor": wall_cor}
    return [
        simulate(report_scene(k, container_mass=1e7, ring_extent=0.81, **changes), collisions=500)
        for k in range(SEEDS)
    ]


def decay_constants(traces: list[Trace]) -> NDArray[np.float64]:
    """k of each seed: E0 exp(-kt) fitted to all events, from the start to the last."""
    return np.array([fit.value for fit in decays(traces, ["kinetic_energy"])[0].fits])


def haff_constant(traces: list[Trace]) -> float:
    """Alpha of their mean: E0/(1 + alpha t)^2 fitted to the means of t and E after each event."""
    found = [series(trace) for trace in traces]
    times = np.mean([each.time for each in found], axis=0)
    energies = [each.kinetic_energy + each.container_energy for each in found]
    ratios = np.mean([energy / energy[0] for energy in energies], axis=0)
    return fit(times, ratios, "haff", amplitude=1.0, start=0.0).value


@pytest.mark.parametrize(
    ("cor", "wall_cor", "time", "k", "alpha"),
    [
        (0.9, 0.9, (3.38, 0.17, 0.01), (1.06, 0.09, 0.01), 0.717),
        pytest.param(0.9, 1.0, (2.93, 0.15, 0.01), (0.878, 0.074, 0.001), 0.582, marks=LONG),
        pytest.param(0.8, 0.8, (6.6, 0.8, 0.1), (1.93, 0.23, 0.01), 1.300, marks=LONG),
        pytest.param(0.8, 1.0, (5.11, 0.43, 0.01), (1.58, 0.19, 0.01), 1.067, marks=LONG),
    ],
)
def test_cooling_gas_up_to_event_500(cor, wall_cor, time, k, alpha):
    """When event 500 comes, and both constants; of time and k the mean, spread and last digit."""
    traces = cooled(1.0, cor, wall_cor)
    reached = [trace for trace in traces if trace.stop.reason is StopReason.COLLISIONS]
    trapped = [trace for trace in traces if trace.stop.reason is StopReason.WALL_TRAP]
    assert len(reached) + len(trapped) == SEEDS
    times = np.array([trace.stop.time for trace in reached])
    for values, (mean, spread, digit) in (
        (times, time),
        (decay_constants(reached[::4]), k),  # a quarter has the mean to 1.2 %
    ):
        # Two means over seeds are compared, and one is printed in a few digits.
        error = math.hypot(standard_error(values), spread / math.sqrt(SEEDS))
        assert abs(values.mean() - mean) < SIGMAS * error + digit / 2
        assert error < 0.015 * mean
    # The error of the mean curve's alpha is that over twenty parts; the table's is as large.
    parts = np.array([haff_constant(reached[part::20]) for part in range(20)])
    error = math.sqrt(2) * standard_error(parts)
    assert abs(haff_constant(reached) - alpha) < SIGMAS * error + 0.001 / 2
    assert error < 0.01 * alpha
    if (cor, wall_cor) == (0.8, 0.8):
        assert_traps(trapped)
    else:
        assert not trapped


def assert_traps(trapped: list[Trace]) -> None:
    """6 of 400 were counted that never reached event 500.

    A trap is declared when it is certain. Runs that had up to event 500 only some more bounces
    to go, which doubles can still tell apart, would have got there: they are not of the 6. The
    normal speed is gone, to rounding, after log(epsilon)/log(e) bounces.
    """
    bounces = math.log(2.0**-52) / math.log(0.8)
    stuck = sum(500 - len(trace.events) > bounces for trace in trapped)
    assert abs(stuck - 6) < SIGMAS * math.sqrt(stuck + 6)  # two counts of rare events
    for trace in trapped:
        assert_nothing_comes_between(trace)


def assert_nothing_comes_between(trace: Trace) -> None:
    """The exact twin goes on from a trap: no other ball reaches the one that bounces.

    Others may collide with each other, far from it.
    """
    ball = trace.stop.balls[0]
    events = [(event.i, event.j) for event in exact_events(trace.finish, 40)]
    assert {pair for pair in events if ball in pair} == {(ball, CONTAINER)}
    assert events.count((ball, CONTAINER)) > 20


def test_dilute_gas_with_a_lossy_wall_ends_in_wall_traps():
    """396 of 400 do; the other 4 got to event 500, on average after 37 s."""
    traces = cooled(0.1, 0.8, 0.8)
    trapped = [trace for trace in traces if trace.stop.reason is StopReason.WALL_TRAP]
    reached = [trace for trace in traces if trace.stop.reason is StopReason.COLLISIONS]
    assert len(trapped) + len(reached) == SEEDS
    assert abs(len(reached) - 4) < SIGMAS * math.sqrt(len(reached) + 4)
    for trace in trapped[:20]:
        assert_nothing_comes_between(trace)
    # So few have no spread of their own. That of all seeds up to their traps, as a share of the
    # mean, is taken for all three, which are times or their inverses.
    every = decay_constants(traces[::10])
    share = np.std(every, ddof=1) / every.mean() * math.sqrt(1 / len(reached) + 1 / 4)
    for found, printed, digit in (
        (np.mean([trace.stop.time for trace in reached]), 37.0, 1.0),
        (decay_constants(reached).mean(), 0.21, 0.01),
        (haff_constant(reached), 0.148, 0.001),
    ):
        assert abs(found - printed) < SIGMAS * share * printed + digit / 2


# --- a fluid in a periodic box ----------------------------------------------------------------

# With N balls, zero momentum and a fixed energy E, averages differ from those of an infinite fluid
# by known parts of 1/N:
# - velocities: relative ones have the temperature E/(N - 1), because N - 1 of them are free;
# - places: the number of balls does not fluctuate as in a part of a large fluid. So the pressure is
#   lower by (T/2V) P''/P', with derivatives by the density (Lebowitz & Percus, Phys. Rev. 122, 1675
#   (1961)). For the second virial coefficient this is the count of pairs, N(N - 1)/2.

FLUID = 576
BLOCKS = 20
SETTLING = 50 * FLUID
"""Events until nothing is left of the lattice: each ball has had 100."""


@dataclass(frozen=True)
class Fluid:
    """Of each block of a run: (Z - 1) by the virial, and collisions of a ball a second."""

    virial: NDArray[np.float64]
    rate: NDArray[np.float64]
    density: float
    temperature: float


@functools.cache
def fluid(packing: float) -> Fluid:
    """In each block a ball collides 50 times, which leaves little of what the last one knew."""
    scene = gas("periodic", FLUID, packing)
    trace = simulate(scene, collisions=SETTLING + 500 * FLUID, search=NEIGHBOURS)
    assert trace.wall_events == 0
    edges = np.linspace(SETTLING, trace.collisions, BLOCKS + 1).astype(int) - 1
    spans = np.diff(trace.events.time[edges])
    impulses = np.diff(np.cumsum(trace.events.impulse)[edges])
    temperature = scene.kinetic_energy / (FLUID - 1)
    return Fluid(
        virial=impulses * 2.0 * scene.radii[0] / (2 * FLUID * temperature * spans),
        rate=2 * np.diff(edges) / (FLUID * spans),
        density=FLUID / scene.container.area,
        temperature=temperature,
    )


def lacking(packing: float, ratio: float) -> float:
    """What Z lacks with N balls: (1/2N) n P''/P', by Henderson's Z = (1 + x^2/8)/(1 - x)^2."""
    step = 1e-4
    x = packing + step * np.array([-1.0, 0.0, 1.0])
    pressure = x * (1 + x**2 / 8) / (1 - x) ** 2
    first = (pressure[2] - pressure[0]) / (2 * step)
    second = (pressure[2] - 2 * pressure[1] + pressure[0]) / step**2
    assert ratio == pytest.approx(pressure[1] / packing, rel=0.01)
    return packing * second / first / (2 * FLUID)


# Padé [4/5] of ten virial coefficients; the last is simulated, Erpenbeck & Luban, at twice the
# volume of close packing.
RATIOS = {0.1: 1.23614, 0.3: 2.06326, 0.5: 4.1062, math.pi / (4 * math.sqrt(3)): 3.4243}


@pytest.mark.parametrize("packing", RATIOS)
def test_equation_of_state_by_the_virial(packing):
    """Z = 1 + sum J d/(2 FLUID T t)."""
    expected = RATIOS[packing] - lacking(packing, RATIOS[packing])
    values = 1.0 + fluid(packing).virial
    assert abs(values.mean() - expected) < 3 * standard_error(values)
    assert standard_error(values) < 0.004 * expected


@pytest.mark.parametrize("packing", [0.01, 0.1, 0.3])
def test_collision_rate_is_enskogs(packing):
    """2 d n chi sqrt(pi T), with chi = (Z - 1)/(2 x) and Z - 1 = 2x + 4 (.782) x^2 if dilute."""
    ratio = RATIOS.get(packing, 1 + 2 * packing + 0.7820044 * (2 * packing) ** 2)
    here = fluid(packing)
    chi = (ratio - 1 - lacking(packing, ratio)) / (2 * packing)
    expected = 4.0 * here.density * chi * math.sqrt(math.pi * here.temperature)
    assert abs(here.rate.mean() - expected) < 3 * standard_error(here.rate)
    assert standard_error(here.rate) < 0.004 * expected
