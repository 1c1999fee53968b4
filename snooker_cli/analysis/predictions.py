"""What theory predicts for a scene, as rows beside the measured means of its repeats."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis.observables import (
    ROUNDING,
    drift_energy,
    elastic,
    equal_balls,
    mean_and_error,
)
from snooker_cli.containers import Circle, Container
from snooker_cli.formatting import listed
from snooker_cli.trace import SPEED_BIN, SPEED_BINS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene


# A scene -> its fluid, its collision rates, and the energy it keeps.

DENSEST_FLUID = 0.65
"""Packing fraction above which disks begin to order, where no theory here holds."""

HEAVY = 1000.0
"""A free container this many times as heavy as the balls keeps their angular momentum."""


def fluid(
    number: float, temperature: float, radius: float, container: Container
) -> theory.FluidState | None:
    """The state of equal hard disks; ``None`` if they are too dense to be a fluid."""
    if container.packing_fraction(number * radius**2) > DENSEST_FLUID:
        return None
    try:
        return theory.fluid_state(number, temperature, radius, container)
    except ValueError:
        return None


def scene_state(scene: Scene, temperature: float) -> theory.FluidState | None:
    """The state of a scene's balls; ``None`` for one ball, unequal ones, or a dense packing."""
    if scene.number < 2 or not equal_balls(scene):
        return None
    return fluid(scene.number, temperature, float(scene.radii[0]), scene.container)


def scene_rates(scene: Scene, temperature: float) -> theory.CollisionRates | None:
    """Enskog's collision rates of a scene at a temperature (J); ``None`` as in `scene_state`."""
    if scene_state(scene, temperature) is None:
        return None
    radius, mass = float(scene.radii[0]), float(scene.masses[0])
    return theory.collision_rates(scene.number, temperature, radius, scene.container, mass)


def at_rest(scene: Scene) -> bool:
    """Whether the balls' centre of mass is at rest, but for rounding."""
    return drift_energy(scene) <= ROUNDING * scene.kinetic_energy


def free_velocities(scene: Scene) -> int | None:
    """Number of balls in the law of speeds at fixed energy; ``None`` where it does not hold.

    With walls all of them. Without walls one less, because total momentum is kept, and only for
    balls of one mass whose centre of mass is at rest.
    """
    if scene.container.has_wall:
        return scene.number
    known = scene.number > 2 and _one(scene.masses) and at_rest(scene)
    return scene.number - 1 if known else None


def floor(scene: Scene) -> float:
    """Least energy of the balls by conservation laws, over that at the start.

    A circle keeps their angular momentum about its centre, a periodic box their momentum. nan where
    nothing is kept (a box, a light circle), and in a circle for unequal balls.
    """
    container = scene.container
    if scene.kinetic_energy == 0:
        return math.nan
    if not container.has_wall:
        return drift_energy(scene) / scene.kinetic_energy
    light = scene.container_mass < HEAVY * float(np.sum(scene.masses))
    if not isinstance(container, Circle) or light or not equal_balls(scene):
        return math.nan
    offsets = scene.positions - scene.container_position
    velocities = scene.velocities - scene.container_velocity
    turning = offsets[:, 0] * velocities[:, 1] - offsets[:, 1] * velocities[:, 0]
    least = theory.angular_momentum_floor(
        float(np.sum(scene.masses * turning)),
        scene.number,
        container.radius - float(scene.radii[0]),
        float(scene.masses[0]),
    )
    return least / scene.kinetic_energy


# Measured quantities beside predictions: the rows of a comparison, and notes for their reader.

CHI_SQUARE = "χ² of the speed distribution, per degree of freedom"

UNITS = {
    "pressure": "Pa m",
    "temperature": "J",
    "PV/NT": "1",
    "PV/NT by the virial": "1",
    "wall rate of a ball": "1/s",
    "ball-ball rate of a ball": "1/s",
    "mean free path": "m",
    "decay constant of energy": "1/s",
    "decay constant of pressure": "1/s",
    "Haff's α": "1/s",
    "energy left at the end": "1",
    "mean speed": "m/s",
    "kurtosis of speeds": "1",
    CHI_SQUARE: "1",
}
"""Every quantity that is compared, and its unit."""


@dataclass(frozen=True)
class Comparison:
    """A measured quantity beside a prediction, both means over the repeats.

    error : standard error of the measured mean
    difference_error : of the mean of measured less predicted, repeat by repeat, since many
        predictions follow the repeat's own temperature
    samples : speeds behind a distribution; ``None`` for a mean over the repeats
    """

    quantity: str
    unit: str
    model: str
    measured: float
    error: float
    predicted: float
    difference: float
    difference_error: float
    repeats: int
    samples: int | None = None

    @property
    def in_errors(self) -> float:
        """The difference in standard errors; nan if there is no error."""
        if not self.difference_error > 0:
            return math.nan
        if self.difference_error < ROUNDING * max(abs(self.measured), abs(self.predicted)):
            return math.nan  # the repeats agree to rounding: that is no measure of their spread
        return self.difference / self.difference_error


@dataclass(frozen=True)
class ComparisonTable:
    """Rows made from measured quantities over the repeats, and notes on rows that are missing.

    repeats : for each repeat, its measured quantities by name
    """

    repeats: Sequence[Mapping[str, float]]
    rows: list[Comparison]
    notes: list[str]

    def column(self, name: str) -> NDArray[np.float64]:
        """A measured quantity over the repeats."""
        return np.array([one[name] for one in self.repeats], dtype=np.float64)

    def add(self, quantity: str, values: Any, model: str, predicted: Any) -> None:
        """A row; ``predicted`` is a number or a column over the repeats."""
        values = np.asarray(values, dtype=np.float64)
        predicted = np.broadcast_to(np.asarray(predicted, dtype=np.float64), values.shape)
        good = np.isfinite(values) & np.isfinite(predicted)
        if not np.any(good):
            known = bool(np.any(np.isfinite(values)))
            why = "the theory has no value here" if known else "it could not be measured"
            self.notes.append(f"{quantity} ({model}) is missing: {why}")
            return
        values, predicted = values[good], predicted[good]
        mean, error = mean_and_error(values)
        difference = values - predicted
        deviation = float(difference.std(ddof=1)) if len(difference) > 1 else math.nan
        self.rows.append(
            Comparison(
                quantity=quantity,
                unit=UNITS[quantity],
                model=model,
                measured=mean,
                error=error,
                predicted=float(predicted.mean()),
                difference=float(difference.mean()),
                difference_error=deviation / math.sqrt(len(difference)),
                repeats=len(values),
            )
        )


LEAST_EXPECTED = 8
"""Balls expected in the first and last bin of the chi-square; bins with fewer are merged."""


def missing_note(scene: Scene) -> str:
    """Which rows are missing for these balls, and why; empty if none are."""
    missing = ["equations of state", "collision rates", "mean free path"]
    if scene.number == 1:
        why = "one ball meets no other"
        missing += ["distribution of speeds", "decay constants", "energy left"]
    elif not equal_balls(scene):
        why = "the theory needs equal balls"
        if not elastic(scene):
            missing += ["distribution of speeds", "decay constants", "energy left"]
        elif not _one(scene.masses):
            missing.append("mean speed")
    elif scene_rates(scene, 1.0) is None:
        why = (
            f"the theory needs a fluid, and the balls fill {scene.packing_fraction:.2f} of the area"
        )
        missing += [] if elastic(scene) else ["Haff's α"]
    else:
        return ""
    return f"{why}, so these rows are missing: {listed(missing)}"


def shape_note(scene: Scene) -> str:
    """What a container without walls changes; empty for one with walls."""
    if scene.container.has_wall:
        return ""
    note = "no walls: the pressure is the virial's, (N T + ΣJd/2t)/V"
    if scene.number > 1 and free_velocities(scene) is None:
        why = "two balls have one speed" if scene.number == 2 else "the balls' masses differ"
        if not at_rest(scene):
            why = "the balls' centre of mass moves on for ever"
        note += f"; the law of speeds at fixed energy is missing, because {why}"
    return note


def ideal_gas(table: ComparisonTable, scene: Scene) -> None:
    """The ideal gas law, without radii and dissipation."""
    number, area = scene.number, scene.container.area
    pressure, warm = table.column("pressure"), table.column("temperature")
    ideal = theory.ideal_gas_pressure(number, 1.0, area) * warm
    table.add("pressure", pressure, "ideal gas law", ideal)
    by_pressure = pressure / theory.ideal_gas_pressure(number, 1.0, area)
    table.add("temperature", warm, "ideal gas law, PV/N", by_pressure)
    table.add("PV/NT", pressure / ideal, "ideal gas law", 1.0)


def hard_disks(table: ComparisonTable, scene: Scene) -> None:
    """Equations of state and collision rates of equal hard disks in the scene's container."""
    if not equal_balls(scene):
        return
    number, radius, mass = scene.number, float(scene.radii[0]), float(scene.masses[0])
    container = scene.container
    walls = container.has_wall
    pressure, warm = table.column("pressure"), table.column("temperature")
    ideal = theory.ideal_gas_pressure(number, 1.0, container.area)
    at_one = {}
    if walls:
        at_one["accessible area"] = theory.accessible_wall_pressure(number, 1.0, radius, container)
    state = scene_state(scene, 1.0)
    if state is not None:
        at_one |= {
            "van der Waals": theory.van_der_waals_pressure(number, 1.0, container.area, radius),
            "hard disks, Padé": ideal * theory.compressibility(scene.packing_fraction),
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
        table.add("pressure", pressure, model, ratio * ideal * warm)
    for model, ratio in ratios.items():
        if model.startswith("hard disks"):
            table.add("PV/NT", pressure / (ideal * warm), model, ratio)
    _virial(table, scene, state, met)
    _rates(table, scene, mass)


def _virial(
    table: ComparisonTable, scene: Scene, state: theory.FluidState | None, met: NDArray[np.float64]
) -> None:
    """PV/NT by the virial, and published simulations."""
    found, walls = table.column("virial_ratio"), scene.container.has_wall
    if state is not None and walls:
        bulk = float(theory.compressibility(scene.packing_fraction))
        table.add("PV/NT by the virial", found, "hard disks, Padé", bulk)
        table.add("PV/NT by the virial", found, "hard disks with a wall", state.virial_ratio)
    published = None if walls else theory.published_ratio(scene.packing_fraction)
    if published is not None and elastic(scene):
        ratio = 1 + (published.ratio - 1) * met
        table.add("PV/NT", found, published.source, ratio)


def _rates(table: ComparisonTable, scene: Scene, mass: float) -> None:
    """Collision rates and the mean free path."""
    rates, number = scene_rates(scene, 1.0), scene.number
    radius = float(scene.radii[0])
    root = table.column("root_temperature")
    if scene.container.has_wall:
        wall = table.column("wall_rate")
        speed = theory.fixed_energy_mean_speed(number, 1.0, mass)
        ideal_rate = theory.wall_rate(speed, scene.container.accessible(radius))
        table.add("wall rate of a ball", wall, "ideal gas", ideal_rate * root)
        if rates is not None:
            predicted = rates.wall * root
            table.add("wall rate of a ball", wall, "hard disks with a wall", predicted)
    if rates is None:
        return
    density = theory.number_density(number, scene.container.area)
    pairs, met = table.column("pair_rate"), table.column("root_meeting_temperature")
    dilute = theory.ball_ball_rate(density, radius, 1.0, mass=mass)
    table.add("ball-ball rate of a ball", pairs, "Boltzmann", dilute * met)
    table.add("ball-ball rate of a ball", pairs, "Enskog", rates.ball_ball * met)
    for model, length in (
        ("Boltzmann", theory.mean_free_path(density, radius)),
        ("Enskog", rates.mean_free_path),
        ("source report, 1/(√2 n 2πr)", theory.source_mean_free_path(density, radius)),
    ):
        table.add("mean free path", table.column("mean_speed") / pairs, model, length)


def cooling(table: ComparisonTable, scene: Scene) -> None:
    """Decay constants and the energy that is left, where a gas of equal balls loses energy."""
    if elastic(scene) or scene.number == 1 or not equal_balls(scene):
        return
    reported = table.column("reported_constant")
    found = table.column("decay_constant")
    table.add("decay constant of energy", found, "source report, −2 ln e/τ", reported)
    half = np.array([theory.source_pressure_decay_constant(k) for k in reported])
    found = table.column("pressure_decay_constant")
    table.add("decay constant of pressure", found, "source report, −ln e/τ", half)
    inelastic, wall_inelastic = scene.restitution, scene.wall_restitution
    rates = scene_rates(scene, 1.0)
    if rates is not None:
        lost = theory.cooling_rate(inelastic, rates.ball_ball, wall_inelastic, rates.wall)
        alpha = theory.haff_rate(lost) * np.sqrt(table.column("start_temperature"))
        found = table.column("haff_rate")
        table.add("Haff's α", found, "Enskog rates at the start", alpha)
    pairs, walls = table.column("pair_events"), table.column("wall_events")
    left = theory.energy_ratio_by_events(scene.number, inelastic, pairs, wall_inelastic, walls)
    table.add("energy left at the end", table.column("energy_left"), "by event count", left)


def speeds(table: ComparisonTable, scene: Scene, counts: NDArray[np.int64]) -> None:
    """Mean speed, kurtosis and the distribution of speeds."""
    number = scene.number
    if number < 2 or not (equal_balls(scene) or elastic(scene)):
        return
    free = free_velocities(scene)
    if _one(scene.masses):
        mass, root = float(scene.masses[0]), table.column("root_temperature")
        speed = table.column("mean_speed")
        maxwell = theory.maxwell_mean_speed(1.0, mass)
        table.add("mean speed", speed, "Maxwell-Boltzmann", maxwell * root)
        if free is not None:
            at_fixed = theory.fixed_energy_mean_speed(free, 1.0, mass)
            table.add("mean speed", speed, "fixed energy", at_fixed * root)
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
        table.add("kurtosis of speeds", table.column("kurtosis"), model, kurtosis)
    if counts.sum() > 0:
        edges = np.arange(SPEED_BINS, dtype=np.float64) * np.float64(SPEED_BIN)
        for model, _, cumulative, arguments in laws:
            shares = np.append(cumulative(edges, *arguments), 1.0)
            table.rows.append(_chi_square(model, counts, shares, len(table.repeats)))


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
        quantity=CHI_SQUARE,
        unit=UNITS[CHI_SQUARE],
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
