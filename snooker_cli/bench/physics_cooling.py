"""Cooling by Haff's law, the shape of its speeds, and how equal speeds become Maxwell's.

By Haff √(E0/E) grows evenly, by α a second: α is measured as its slope once the shape of the speeds
has settled. What theory says of α holds for infinitely many balls that meet uncorrelated. N balls
in a periodic box meet less often by their pair distribution (see ``physics_fluid``), and N − 1 free
velocities have a mean cube of relative speed less than Maxwell's.

a2 is set beside what is published of it, a formula: van Noije & Ernst's condition (Granular Matter
1, 57 (1998)) as Montanero & Santos linearise it (Granular Matter 2, 53 (2000)). Disks' a2 has been
simulated by others (Huthmann, Orza & Brito, Granular Matter 2, 189 (2000), cond-mat/0004079; Santos
& Montanero, Granular Matter 11, 157 (2009), arXiv:0812.3022), but their values are not at hand; a
simulation of ours stands in for them, and for the kurtosis of equal speeds as they relax.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli import theory
from snooker_cli.bench.physics_fluid import missing
from snooker_cli.bench.physics_gas import Gas, means, over_seeds
from snooker_cli.bench.physics_rows import OWN, PUBLISHED, Row
from snooker_cli.observables import meeting_temperature
from snooker_cli.words import counted

if TYPE_CHECKING:
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Summary

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


def haff_rows(gas: Gas, dilute: bool) -> list[Row]:
    """Haff's rate beside theory's with and without a2; if dilute, its evenness and a2 too."""
    scene = gas.scene(0)
    temperature = meeting_temperature(scene.kinetic_energy, scene)
    density = theory.number_density(gas.balls, scene.area)
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
    row = partial(Row, setting=gas.setting(), expected_error=0.0, whose=PUBLISHED)
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
        Row(
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


def slopes_and_shape(gas: Gas, _: Scene, summary: Summary) -> tuple[float, float, float]:
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


def relaxation_rows(gas: Gas) -> list[Row]:
    """The kurtosis after each collision of a ball from equal speeds on."""
    found = means(over_seeds(gas, partial(kurtoses, gas)))
    return [
        Row(
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


def kurtoses(gas: Gas, _: Scene, summary: Summary) -> tuple[float, ...]:
    """The kurtosis of a repeat at whole numbers of collisions a ball."""
    series = summary.series
    collisions = 2 * series.pair_events / gas.balls
    wanted = np.arange(len(KURTOSES), dtype=np.float64)
    return tuple(np.interp(wanted, collisions, series.energy_moment).tolist())
