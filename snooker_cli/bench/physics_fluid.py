"""Pressure and collision rate of elastic disks in a periodic box, beside what is published.

In a periodic box of N balls without momentum and with the energy E, means are off from those of an
infinite one by parts of 1/N that are known:

- Velocities: N − 1 of them are free, and the squares of relative ones are exactly those of the
  temperature T = E/(N − 1), which is used throughout. The mean of their magnitudes is larger by
  the fixed-energy factor of N − 1 balls.
- Places: their number does not fluctuate as it does in a part of a large fluid, so that Z lacks
  n P''/(2 N P'), with derivatives by the density (Lebowitz & Percus, Phys. Rev. 122, 1675 (1961)).

Z is 1 + ΣJd/(2 N T t), with the impulses J of collisions at centres d apart. Pressure and rate come
from the same repeats and both tell of the pair distribution at contact, so that they are not
independent; the impulses are what the pressure adds. In equilibrium Enskog's rate is exact if that
distribution is, so that the error of its expected value is the Padé's.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import theory
from snooker_cli.bench.physics_gas import Gas, means, over_seeds
from snooker_cli.bench.physics_rows import PUBLISHED, Row
from snooker_cli.observables import meeting_temperature

if TYPE_CHECKING:
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Summary

STATE, RATE = "equation of state", "collision rate"

VIRIALS = "Padé of ten virial coefficients, Clisby & McCoy 2006"
ENSKOG = "Enskog, contact value of that Padé"

PUBLISHED_PRECISION = 1e-4
"""Relative error of simulated Z where they are published, and of the Padé at their packings, where
its last coefficients matter; at a packing of 0.4 and below these change nothing that is seen."""

SERIES_EXACT = 0.4


def rows(gas: Gas) -> list[Row]:
    """Z beside the simulations of others, where there are any, and the Padé; the rate."""
    scene = gas.scene(0)
    number, packing = gas.balls, gas.packing
    density = theory.number_density(number, scene.area)
    temperature = meeting_temperature(scene.kinetic_energy, scene)
    (ratio, ratio_error), (rate, rate_error) = means(over_seeds(gas, partial(ratio_and_rate, gas)))
    lacking = missing(packing, number)
    precision = PUBLISHED_PRECISION if packing > SERIES_EXACT else 0.0
    simulated = theory.published_ratio(packing)
    sources = [(theory.compressibility(packing), precision, VIRIALS)]
    if simulated is not None:
        sources.insert(0, (simulated.ratio, PUBLISHED_PRECISION, simulated.source))
    found = [
        Row(
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
        Row(
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


def ratio_and_rate(gas: Gas, scene: Scene, summary: Summary) -> tuple[float, float]:
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
