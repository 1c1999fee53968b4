"""What theory predicts for a scene, added to the table of what its repeats measured."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli import kinetic, theory
from snooker_cli.compare.table import Comparison, Table
from snooker_cli.observables import elastic, equal_balls
from snooker_cli.trace import SPEED_BIN, SPEED_BINS
from snooker_cli.words import listed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene

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
        if not elastic(scene):
            left_out += ["distribution of speeds", "decay constants", "energy left"]
        elif not _one(scene.masses):
            left_out.append("mean speed")
        return f"the balls differ, and theory is for equal ones: no {listed(left_out)}"
    if kinetic.rates(scene, 1.0) is None:
        left_out += [] if elastic(scene) else ["Haff's α"]
        return (
            f"the balls fill {scene.packing_fraction:.2f} of the area, and theory is for a fluid: "
            f"no {listed(left_out)}"
        )
    return ""


def shape(scene: Scene) -> str:
    """What the container's shape means for the comparisons; empty for one with walls."""
    if scene.shape != "periodic":
        return ""
    said = "no walls: the pressure is the virial's, (N T + ΣJd/2t)/V"
    if scene.number > 1 and kinetic.free_velocities(scene) is None:
        why = "two balls have one speed" if scene.number == 2 else "the balls' masses differ"
        if not kinetic.at_rest(scene):
            why = "the balls' centre of mass moves on for ever"
        said += f"; no law of speeds at fixed energy, as {why}"
    return said


def ideal_gas(table: Table, scene: Scene) -> None:
    """The ideal gas law, which knows neither radii nor dissipation."""
    number, area = scene.number, scene.area
    pressure, warm = table.column("pressure"), table.column("temperature")
    ideal = theory.ideal_gas_pressure(number, 1.0, area) * warm
    table.add("pressure", "Pa m", pressure, "ideal gas law", ideal)
    by_pressure = theory.ideal_gas_temperature(1.0, area, number) * pressure
    table.add("temperature", "J", warm, "ideal gas law, PV/N", by_pressure)
    table.add("PV/NT", "1", pressure / ideal, "ideal gas law", 1.0)


def hard_disks(table: Table, scene: Scene) -> None:
    """Equations of state and collision rates of equal hard disks in the scene's container."""
    if not equal_balls(scene):
        return
    number, radius, mass = scene.number, float(scene.radii[0]), float(scene.masses[0])
    room, walls = kinetic.container(scene), scene.shape != "periodic"
    pressure, warm = table.column("pressure"), table.column("temperature")
    ideal = theory.ideal_gas_pressure(number, 1.0, room.area)
    at_one = {}
    if walls:
        at_one["accessible area"] = theory.accessible_wall_pressure(number, 1.0, room)
    state = kinetic.state(scene, 1.0)
    if state is not None:
        at_one |= {
            "van der Waals": theory.van_der_waals_pressure(number, 1.0, room.area, radius),
            "hard disks, Padé": theory.bulk_pressure(number, 1.0, radius, room.area),
        }
        if walls:
            at_one["hard disks with a wall"] = state.pressure
        elif scene.restitution < 1:
            # The impulses of a Maxwellian gas are (1 + e)/2 of the elastic ones.
            weaker = (1 + scene.restitution) / 2
            at_one["hard disks, impulses (1 + e)/2"] = ideal + weaker * (state.pressure - ideal)
    # Without walls balls meet at a temperature of their own; with them this is one.
    met = table.column("meeting_temperature") / warm
    ratios = {model: 1 + (value / ideal - 1) * met for model, value in at_one.items()}
    for model, ratio in ratios.items():
        table.add("pressure", "Pa m", pressure, model, ratio * ideal * warm)
    for model, ratio in ratios.items():
        if model.startswith("hard disks"):
            table.add("PV/NT", "1", pressure / (ideal * warm), model, ratio)
    _virial(table, scene, state, met)
    _rates(table, scene, room, mass)


def _virial(
    table: Table, scene: Scene, state: theory.FluidState | None, met: NDArray[np.float64]
) -> None:
    """PV/NT by the virial, which the wall's is not, and what others have simulated."""
    found, walls = table.column("virial_ratio"), scene.shape != "periodic"
    if state is not None and walls:
        bulk = float(theory.compressibility(scene.packing_fraction))
        table.add("PV/NT by the virial", "1", found, "hard disks, Padé", bulk)
        table.add("PV/NT by the virial", "1", found, "hard disks with a wall", state.virial_ratio)
    published = None if walls else theory.published_ratio(scene.packing_fraction)
    if published is not None and elastic(scene):
        ratio = 1 + (published.ratio - 1) * met
        table.add("PV/NT", "1", found, published.source, ratio)


def _rates(table: Table, scene: Scene, room: theory.Container, mass: float) -> None:
    """Collision rates and the mean free path."""
    rates, number = kinetic.rates(scene, 1.0), scene.number
    root = table.column("root_temperature")
    if scene.shape != "periodic":
        wall = table.column("wall_rate")
        speed = theory.fixed_energy_mean_speed(number, 1.0, mass)
        ideal_rate = theory.wall_rate(speed, room)
        table.add("wall rate of a ball", "1/s", wall, "ideal gas", ideal_rate * root)
        if rates is not None:
            predicted = rates.wall * root
            table.add("wall rate of a ball", "1/s", wall, "hard disks with a wall", predicted)
    if rates is None:
        return
    density, radius = theory.number_density(number, room.area), float(scene.radii[0])
    pairs, met = table.column("pair_rate"), table.column("root_meeting_temperature")
    dilute = theory.ball_ball_rate(density, radius, 1.0, mass=mass)
    table.add("ball-ball rate of a ball", "1/s", pairs, "Boltzmann", dilute * met)
    table.add("ball-ball rate of a ball", "1/s", pairs, "Enskog", rates.ball_ball * met)
    for model, length in (
        ("Boltzmann", theory.boltzmann_mean_free_path(density, radius)),
        ("Enskog", rates.mean_free_path),
        ("report, 1/(√2 n 2πr)", theory.report_mean_free_path(density, radius)),
    ):
        table.add("mean free path", "m", table.column("mean_speed") / pairs, model, length)


def cooling(table: Table, scene: Scene) -> None:
    """Decay constants and the energy that is left, where a gas of equal balls loses energy."""
    if elastic(scene) or scene.number == 1 or not equal_balls(scene):
        return
    reported = table.column("reported_constant")
    found = table.column("decay_constant")
    table.add("decay constant of energy", "1/s", found, "report, −2 ln e/τ", reported)
    half = np.array([theory.report_pressure_decay_constant(k) for k in reported])
    found = table.column("pressure_decay_constant")
    table.add("decay constant of pressure", "1/s", found, "report, −ln e/τ", half)
    inelastic, wall_inelastic = scene.restitution, scene.wall_restitution
    rates = kinetic.rates(scene, 1.0)
    if rates is not None:
        lost = theory.cooling_rate(inelastic, rates.ball_ball, wall_inelastic, rates.wall)
        alpha = theory.haff_rate(lost) * np.sqrt(table.column("start_temperature"))
        found = table.column("haff_rate")
        table.add("Haff's α", "1/s", found, "Enskog rates at the start", alpha)
    pairs, walls = table.column("pair_events"), table.column("wall_events")
    left = theory.energy_ratio_by_events(scene.number, inelastic, pairs, wall_inelastic, walls)
    table.add("energy left at the end", "1", table.column("energy_left"), "by event count", left)


def speeds(table: Table, scene: Scene, counts: NDArray[np.int64]) -> None:
    """Mean speed, kurtosis and the distribution of speeds."""
    number = scene.number
    if number < 2 or not (equal_balls(scene) or elastic(scene)):
        return
    free = kinetic.free_velocities(scene)
    if _one(scene.masses):
        mass, root = float(scene.masses[0]), table.column("root_temperature")
        speed = table.column("mean_speed")
        maxwell = theory.maxwell_mean_speed(1.0, mass)
        table.add("mean speed", "m/s", speed, "Maxwell-Boltzmann", maxwell * root)
        if free is not None:
            at_fixed = theory.fixed_energy_mean_speed(free, 1.0, mass)
            table.add("mean speed", "m/s", speed, "fixed energy", at_fixed * root)
    # The reduced speed v √(m/2T) is the speed of a ball with m = 1 at T = 1/2.
    laws: list[tuple[str, float, Callable[..., Any], tuple[float, ...]]] = [
        ("Maxwell-Boltzmann", 2.0, theory.maxwell_speed_cdf, (0.5,)),
    ]
    if free is not None:
        kurtosis, cumulative = theory.fixed_energy_kurtosis(free), theory.fixed_energy_speed_cdf
        laws.append(("fixed energy", kurtosis, cumulative, (free, 0.5)))
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
