"""What theory predicts for a scene, added to the table of what its repeats measured."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli import theory
from snooker_cli.compare.table import Comparison, Table
from snooker_cli.observables import equal_balls
from snooker_cli.trace import SPEED_BIN, SPEED_BINS
from snooker_cli.words import listed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene

DENSEST_FLUID = 0.65
"""Packing fraction above which disks begin to order, where no theory here speaks of them."""

LEAST_EXPECTED = 8
"""Balls expected in a bin of the chi-square at either end; bins with fewer are taken together."""


def exceptions(scene: Scene) -> str:
    """Which theories do not hold for the balls, and why; empty if all do."""
    if scene.number == 1:
        return (
            "one ball meets no other: no equations of state, ball-ball rates, mean free path, "
            "distribution of speeds and decay of a gas"
        )
    left_out = ["equations of state", "collision rates", "mean free path"]
    if not equal_balls(scene):
        if not _elastic(scene):
            left_out += ["distribution of speeds", "decay constants", "energy left"]
        elif not _one(scene.masses):
            left_out.append("mean speed")
        return f"the balls differ, and theory is for equal ones: no {listed(left_out)}"
    if _rates(scene) is None:
        left_out += [] if _elastic(scene) else ["Haff's α"]
        return (
            f"the balls fill {scene.packing_fraction:.2f} of the area, and theory is for a fluid: "
            f"no {listed(left_out)}"
        )
    return ""


def ideal_gas(table: Table, scene: Scene) -> None:
    """The ideal gas law, which knows neither radii nor dissipation."""
    number, area = scene.number, math.pi * scene.container_radius**2
    pressure, warm = table.column("pressure"), table.column("temperature")
    ideal = theory.ideal_gas_pressure(number, 1.0, area) * warm
    table.add("pressure", "Pa m", pressure, "ideal gas law", ideal)
    by_pressure = theory.ideal_gas_temperature(1.0, area, number) * pressure
    table.add("temperature", "J", warm, "ideal gas law, PV/N", by_pressure)
    table.add("PV/NT", "1", pressure / ideal, "ideal gas law", 1.0)


def hard_disks(table: Table, scene: Scene) -> None:
    """Equations of state and collision rates of equal hard disks in a circle."""
    if not equal_balls(scene):
        return
    number, radius, mass = scene.number, float(scene.radii[0]), float(scene.masses[0])
    outer, area = scene.container_radius, math.pi * scene.container_radius**2
    pressure, warm = table.column("pressure"), table.column("temperature")
    root = table.column("root_temperature")
    at_one = {"accessible area": theory.accessible_wall_pressure(number, 1.0, radius, outer)}
    rates = _rates(scene) if number > 1 else None
    if rates is not None:
        at_one |= {
            "van der Waals": theory.van_der_waals_pressure(number, 1.0, area, radius),
            "hard disks, Padé": theory.bulk_pressure(number, 1.0, radius, outer),
            "hard disks with a wall": theory.circle_state(number, 1.0, radius, outer).pressure,
        }
    for model, value in at_one.items():
        table.add("pressure", "Pa m", pressure, model, value * warm)
    ideal = theory.ideal_gas_pressure(number, 1.0, area)
    for model, value in at_one.items():
        if model.startswith("hard disks"):
            table.add("PV/NT", "1", pressure / (ideal * warm), model, value / ideal)
    wall = table.column("wall_rate")
    speed = theory.fixed_energy_mean_speed(number, 1.0, mass)
    ideal_rate = theory.wall_rate(speed, outer - radius)
    table.add("wall rate of a ball", "1/s", wall, "ideal gas", ideal_rate * root)
    if rates is None:
        return
    table.add("wall rate of a ball", "1/s", wall, "hard disks with a wall", rates.wall * root)
    density, pairs = theory.number_density(number, outer), table.column("pair_rate")
    dilute = theory.ball_ball_rate(density, radius, 1.0, mass=mass)
    table.add("ball-ball rate of a ball", "1/s", pairs, "Boltzmann", dilute * root)
    table.add("ball-ball rate of a ball", "1/s", pairs, "Enskog", rates.ball_ball * root)
    for model, length in (
        ("Boltzmann", theory.boltzmann_mean_free_path(density, radius)),
        ("Enskog", rates.mean_free_path),
        ("report, 1/(√2 n 2πr)", theory.report_mean_free_path(density, radius)),
    ):
        table.add("mean free path", "m", table.column("mean_speed") / pairs, model, length)


def cooling(table: Table, scene: Scene) -> None:
    """Decay constants and the energy that is left, where a gas of equal balls loses energy."""
    if _elastic(scene) or scene.number == 1 or not equal_balls(scene):
        return
    reported = table.column("reported_constant")
    found = table.column("decay_constant")
    table.add("decay constant of energy", "1/s", found, "report, −2 ln e/τ", reported)
    half = np.array([theory.report_pressure_decay_constant(k) for k in reported])
    found = table.column("pressure_decay_constant")
    table.add("decay constant of pressure", "1/s", found, "report, −ln e/τ", half)
    inelastic, wall_inelastic = scene.restitution, scene.wall_restitution
    rates = _rates(scene)
    if rates is not None:
        lost = theory.cooling_rate(inelastic, rates.ball_ball, wall_inelastic, rates.wall)
        alpha = theory.haff_rate(lost) * np.sqrt(table.column("start_temperature"))
        found = table.column("haff_rate")
        table.add("Haff's α", "1/s", found, "Enskog rates at the start", alpha)
    pairs, walls = table.column("pair_events"), table.column("wall_events")
    left = theory.energy_ratio_by_events(scene.number, inelastic, pairs, wall_inelastic, walls)
    table.add("energy left at the end", "1", table.column("energy_left"), "by event count", left)


def _rates(scene: Scene) -> theory.CollisionRates | None:
    """How equal balls collide at a temperature of 1 J; ``None`` where they are no fluid."""
    if scene.packing_fraction > DENSEST_FLUID:
        return None
    radius, mass = float(scene.radii[0]), float(scene.masses[0])
    try:
        return theory.collision_rates(scene.number, 1.0, radius, scene.container_radius, mass)
    except ValueError:
        return None


def speeds(table: Table, scene: Scene, counts: NDArray[np.int64]) -> None:
    """Mean speed, kurtosis and the distribution of speeds."""
    number = scene.number
    if number < 2 or not (equal_balls(scene) or _elastic(scene)):
        return
    if _one(scene.masses):
        mass, root = float(scene.masses[0]), table.column("root_temperature")
        speed = table.column("mean_speed")
        maxwell = theory.maxwell_mean_speed(1.0, mass)
        at_fixed = theory.fixed_energy_mean_speed(number, 1.0, mass)
        table.add("mean speed", "m/s", speed, "Maxwell-Boltzmann", maxwell * root)
        table.add("mean speed", "m/s", speed, "fixed energy", at_fixed * root)
    # The reduced speed v √(m/2T) is the speed of a ball with m = 1 at T = 1/2.
    laws: list[tuple[str, float, Callable[..., Any], tuple[float, ...]]] = [
        ("Maxwell-Boltzmann", 2.0, theory.maxwell_speed_cdf, (0.5,)),
        (
            "fixed energy",
            theory.fixed_energy_kurtosis(number),
            theory.fixed_energy_speed_cdf,
            (number, 0.5),
        ),
    ]
    if 0 < scene.restitution < 1:
        a2 = theory.sonine_coefficient(scene.restitution)
        laws.append(("homogeneous cooling, a2", 2 * (1 + a2), theory.sonine_speed_cdf, (0.5, a2)))
    for model, kurtosis, _, _ in laws:
        table.add("kurtosis of speeds", "1", table.column("kurtosis"), model, kurtosis)
    if counts.sum() > 0:
        edges = np.arange(SPEED_BINS, dtype=np.float64) * np.float64(SPEED_BIN)
        for model, _, cumulative, arguments in laws:
            shares = np.append(cumulative(edges, *arguments), 1.0)
            table.rows.append(_chi_square(model, counts, shares, len(table.columns)))


def _chi_square(
    model: str, counts: NDArray[np.int64], cumulative: NDArray[np.float64], repeats: int
) -> Comparison:
    """Pearson's chi-square per degree of freedom of a speed histogram; one if the law holds."""
    samples = int(counts.sum())
    expected = np.diff(cumulative) * samples
    for _ in range(2):  # from either end
        while len(expected) > 2 and expected[-1] < LEAST_EXPECTED:
            expected = np.append(expected[:-2], expected[-2:].sum())
            counts = np.append(counts[:-2], counts[-2:].sum())
        expected, counts = expected[::-1], counts[::-1]
    freedom = len(expected) - 1
    value = float(np.sum((counts - expected) ** 2 / expected)) / freedom
    return Comparison(
        quantity="χ² of the speed distribution, per degree of freedom",
        unit="1",
        model=model,
        measured=value,
        error=math.nan,
        predicted=1.0,
        difference=value - 1,
        difference_error=math.sqrt(2 / freedom),
        repeats=repeats,
        samples=samples,
    )


def _one(values: NDArray[np.float64]) -> bool:
    """Whether all values are the same."""
    return bool(np.all(values == values[0]))


def _elastic(scene: Scene) -> bool:
    """Whether no collision loses energy."""
    return scene.restitution == scene.wall_restitution == 1.0
