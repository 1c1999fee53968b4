"""Averages of gases in cells against the physics: a periodic box's fluid, and all pairs' circle.

In a periodic box of N balls with zero momentum and a fixed energy E, averages are off from those
of an infinite one by parts of 1/N that are known:
- velocities: relative ones are those of the temperature E/(N - 1), for N - 1 of them are free;
- places: their number does not fluctuate as it does in a part of a large fluid, so that the
  pressure is lower by (T/2V) P''/P', with derivatives by the density (Lebowitz & Percus, Phys. Rev.
  122, 1675 (1961)), which for the second virial coefficient is the count of pairs, N(N - 1)/2.
Differences are measured in standard errors, of blocks of a run or of runs, and 3 are let pass.
"""

import functools
import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import gas, is_wall
from scipy import stats
from test_statistics import standard_error

from snooker_cli.engine import simulate

SIGMAS = 3

# --- periodic ---------------------------------------------------------------------------------

N = 576
BLOCKS = 20
SETTLING = 50 * N
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
    scene = gas("periodic", N, packing)
    trace = simulate(scene, collisions=SETTLING + 500 * N, engine="cells")
    assert trace.wall_events == 0
    edges = np.linspace(SETTLING, trace.collisions, BLOCKS + 1).astype(int) - 1
    spans = np.diff(trace.events.time[edges])
    impulses = np.diff(np.cumsum(trace.events.impulse)[edges])
    temperature = scene.kinetic_energy / (N - 1)
    return Fluid(
        virial=impulses * 2.0 * scene.radii[0] / (2 * N * temperature * spans),
        rate=2 * np.diff(edges) / (N * spans),
        density=N / scene.container.area,
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
    return packing * second / first / (2 * N)


# Padé [4/5] of ten virial coefficients; the last is simulated, Erpenbeck & Luban, at twice the
# volume of close packing.
RATIOS = {0.1: 1.23614, 0.3: 2.06326, 0.5: 4.1062, math.pi / (4 * math.sqrt(3)): 3.4243}


@pytest.mark.parametrize("packing", RATIOS)
def test_equation_of_state_by_the_virial(packing):
    """Z = 1 + sum J d/(2 N T t)."""
    expected = RATIOS[packing] - lacking(packing, RATIOS[packing])
    values = 1.0 + fluid(packing).virial
    assert abs(values.mean() - expected) < SIGMAS * standard_error(values)
    assert standard_error(values) < 0.004 * expected


@pytest.mark.parametrize("packing", [0.01, 0.1, 0.3])
def test_collision_rate_is_enskogs(packing):
    """2 d n chi sqrt(pi T), with chi = (Z - 1)/(2 x) and Z - 1 = 2x + 4 (.782) x^2 if dilute."""
    ratio = RATIOS.get(packing, 1 + 2 * packing + 0.7820044 * (2 * packing) ** 2)
    here = fluid(packing)
    chi = (ratio - 1 - lacking(packing, ratio)) / (2 * packing)
    expected = 4.0 * here.density * chi * math.sqrt(math.pi * here.temperature)
    assert abs(here.rate.mean() - expected) < SIGMAS * standard_error(here.rate)
    assert standard_error(here.rate) < 0.004 * expected


def test_speeds_are_a_maxwellians():
    """By Kolmogorov and Smirnov at the 0.1 % level (1.95): v^2/(2T) is exponential, to 1/N."""
    speeds = []
    for seed in range(5):
        finish = simulate(gas("periodic", N, 0.3, seed=seed), collisions=SETTLING).finish
        assert np.allclose(finish.masses @ finish.velocities, 0.0, atol=1e-9)
        speeds.append(np.sum(finish.velocities**2, axis=1) * (N - 1) / finish.kinetic_energy / 2)
    distance = stats.kstest(np.ravel(speeds), stats.expon.cdf).statistic
    assert distance < 1.95 / math.sqrt(5 * N)


# --- circle -----------------------------------------------------------------------------------

SEEDS = 12


def circle(engine: str, packing: float, first: int) -> NDArray[np.float64]:
    """Pressure, ball-ball and wall collisions a second of runs of 300 balls; (SEEDS, 3)."""
    rows = []
    for seed in range(first, first + SEEDS):
        scene = gas("circle", 300, packing, seed=seed)
        events = simulate(scene, collisions=21_000, engine=engine).events
        late = slice(6000, None)
        span = events.time[-1] - events.time[5999]
        wall = is_wall(events)[late]
        force = events.impulse[late][wall].sum() / span
        rows.append(
            (force / scene.container.wall_length, np.sum(~wall) / span, np.sum(wall) / span)
        )
    return np.array(rows)


@pytest.mark.parametrize("packing", [0.02, 0.4])
def test_cells_and_all_pairs_give_the_same_gas_in_the_circle(packing):
    """Other seeds, so that the two samples know nothing of each other."""
    cells, pairs = circle("cells", packing, 0), circle("allpairs", packing, SEEDS)
    for own, other in zip(cells.T, pairs.T, strict=True):
        error = math.hypot(standard_error(own), standard_error(other))
        assert abs(own.mean() - other.mean()) < SIGMAS * error
        assert error < 0.01 * own.mean()
