"""A scene -> its fluid, rates and conserved energy, and theory's values for measured means."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis.observables import NO_WALLS, ROUNDING, drift_energy, elastic, equal_balls
from snooker_cli.containers import Circle, Container
from snooker_cli.formatting import listed
from snooker_cli.trace import SPEED_BIN, SPEED_BINS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene

    Array = NDArray[np.float64]
    Means = Mapping[str, Array]


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
    known = scene.number > 2 and _alike(scene.masses) and at_rest(scene)
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
    (x, y), (u, v) = (
        (scene.positions - scene.container_position).T,
        (scene.velocities - scene.container_velocity).T,
    )
    turning, reach = (
        float(np.sum(scene.masses * (x * v - y * u))),
        container.radius - scene.radii[0],
    )
    least = theory.angular_momentum_floor(turning, scene.number, reach, float(scene.masses[0]))
    return float(least / scene.kinetic_energy)


# Theory's values for measured means: the rows of `snooker compare`, and notes for their reader.


class Prediction(NamedTuple):
    """A measured quantity, its values over the repeats, and a model's for it (or for each)."""

    quantity: str
    model: str
    measured: Array
    predicted: Array | float


def hard_disks(scene: Scene, means: Means) -> Iterator[Prediction]:
    """Pressures and rates of an ideal gas, and of equal hard disks in the scene's container."""
    ideal = theory.ideal_gas_pressure(scene.number, 1.0, scene.container.area)
    pressure, warm, virial = means["pressure"], means["temperature"], means["virial_ratio"]
    found = pressure / (ideal * warm)
    yield Prediction("pressure", "ideal gas law", pressure, ideal * warm)
    yield Prediction("temperature", "ideal gas law, PV/N", warm, pressure / ideal)
    yield Prediction("PV/NT", "ideal gas law", found, 1.0)
    if not equal_balls(scene):
        return
    state, walls, packing = (
        scene_state(scene, 1.0),
        scene.container.has_wall,
        scene.packing_fraction,
    )
    # Without walls balls meet at a temperature of their own; with them this is one.
    met = means["meeting_temperature"] / warm
    ratios = {model: 1 + (z - 1) * met for model, z in _compressibilities(scene, state).items()}
    for model, ratio in ratios.items():
        yield Prediction("pressure", model, pressure, ratio * ideal * warm)
    for model, ratio in ratios.items():
        if model.startswith("hard disks"):
            yield Prediction("PV/NT", model, found, ratio)
    if state is not None and walls:
        bulk = theory.compressibility(packing)
        yield Prediction("PV/NT by the virial", "hard disks, Padé", virial, bulk)
        model = "hard disks with a wall"
        yield Prediction("PV/NT by the virial", model, virial, state.virial_ratio)
    published = theory.published_ratio(packing)
    if published is not None and elastic(scene) and not walls:
        yield Prediction("PV/NT", published.source, virial, 1 + (published.ratio - 1) * met)
    yield from _rates(scene, means)


def _compressibilities(scene: Scene, state: theory.FluidState | None) -> dict[str, float]:
    """PV/NT of equal balls by model, with T the temperature at which balls meet."""
    number, radius, container = scene.number, float(scene.radii[0]), scene.container
    ideal = theory.ideal_gas_pressure(number, 1.0, container.area)
    pressures = {}
    if container.has_wall:
        accessible = theory.accessible_wall_pressure(number, 1.0, radius, container)
        pressures["accessible area"] = accessible
    if state is not None:
        excluded = theory.van_der_waals_pressure(number, 1.0, container.area, radius)
        pressures["van der Waals"] = excluded
        bulk = ideal * theory.compressibility(scene.packing_fraction)
        pressures["hard disks, Padé"] = bulk
        if container.has_wall:
            pressures["hard disks with a wall"] = state.pressure
        elif scene.restitution < 1:
            # The impulses of a Maxwellian gas are (1 + e)/2 of the elastic ones.
            weaker = ideal + (1 + scene.restitution) / 2 * (state.pressure - ideal)
            pressures["hard disks, impulses (1 + e)/2"] = weaker
    return {model: pressure / ideal for model, pressure in pressures.items()}


def _rates(scene: Scene, means: Means) -> Iterator[Prediction]:
    """Collision rates and the mean free path of equal balls."""
    rates, number, container = scene_rates(scene, 1.0), scene.number, scene.container
    radius, mass = float(scene.radii[0]), float(scene.masses[0])
    wall, pairs, quantity = means["wall_rate"], means["pair_rate"], "wall rate of a ball"
    if container.has_wall:
        speed = theory.fixed_energy_mean_speed(number, 1.0, mass) * means["root_temperature"]
        chords = theory.wall_rate(1.0, container.accessible(radius))
        yield Prediction(quantity, "ideal gas", wall, chords * speed)
        if rates is not None:
            predicted = rates.wall * means["root_temperature"]
            yield Prediction(quantity, "hard disks with a wall", wall, predicted)
    if rates is None:
        return
    density = theory.number_density(number, container.area)
    dilute = theory.ball_ball_rate(density, radius, 1.0, mass=mass)
    for model, rate in (("Boltzmann", dilute), ("Enskog", rates.ball_ball)):
        predicted = rate * means["root_meeting_temperature"]
        yield Prediction("ball-ball rate of a ball", model, pairs, predicted)
    for model, length in (
        ("Boltzmann", theory.mean_free_path(density, radius)),
        ("Enskog", rates.mean_free_path),
        ("source report, 1/(√2 n 2πr)", theory.source_mean_free_path(density, radius)),
    ):
        yield Prediction("mean free path", model, means["mean_speed"] / pairs, length)


def cooling(scene: Scene, means: Means) -> Iterator[Prediction]:
    """Decay constants and the energy that is left, where a gas of equal balls loses energy."""
    if elastic(scene) or scene.number == 1 or not equal_balls(scene):
        return
    reported, model = means["reported_constant"], "source report, −2 ln e/τ"
    yield Prediction("decay constant of energy", model, means["decay_constant"], reported)
    found, model = means["pressure_decay_constant"], "source report, −ln e/τ"
    yield Prediction("decay constant of pressure", model, found, reported / 2)
    e, wall_e, rates = scene.restitution, scene.wall_restitution, scene_rates(scene, 1.0)
    if rates is not None:
        alpha = theory.haff_rate(theory.cooling_rate(e, rates.ball_ball, wall_e, rates.wall))
        predicted = alpha * np.sqrt(means["start_temperature"])
        yield Prediction("Haff's α", "Enskog rates at the start", means["haff_rate"], predicted)
    pairs, walls, left = means["pair_events"], means["wall_events"], means["energy_left"]
    predicted = theory.energy_ratio_by_events(scene.number, e, pairs, wall_e, walls)
    yield Prediction("energy left at the end", "by event count", left, predicted)


class SpeedLaw(NamedTuple):
    """A distribution of speeds: its kurtosis, and the share of speeds below each histogram bin."""

    model: str
    kurtosis: float
    shares: Array


def speed_laws(scene: Scene) -> list[SpeedLaw]:
    """The laws that the balls' speeds may follow; none for one ball, or where none applies."""
    if scene.number < 2 or not (equal_balls(scene) or elastic(scene)):
        return []
    # The reduced speed v √(m/2T) is the speed of a ball with m = 1 at T = 1/2.
    edges = np.linspace(0.0, (SPEED_BINS - 1) * SPEED_BIN, SPEED_BINS)
    heat, free = 0.5, free_velocities(scene)
    laws = [SpeedLaw("Maxwell-Boltzmann", 2.0, theory.maxwell_speed_cdf(edges, heat))]
    if free is not None:
        kurtosis, shares = theory.fixed_energy_kurtosis, theory.fixed_energy_speed_cdf
        laws.append(SpeedLaw("fixed energy", kurtosis(free), shares(edges, free, heat)))
    if 0 < scene.restitution < 1:
        a2 = theory.sonine_coefficient(scene.restitution)
        below = theory.sonine_speed_cdf(edges, heat, a2)
        laws.append(SpeedLaw("homogeneous cooling, a2", 2 * (1 + a2), below))
    return laws


def speeds(scene: Scene, means: Means) -> Iterator[Prediction]:
    """The mean speed of balls of one mass, and the kurtosis of speeds."""
    laws = speed_laws(scene)
    if laws and _alike(scene.masses):
        mass, free = float(scene.masses[0]), free_velocities(scene)
        speed, root = means["mean_speed"], means["root_temperature"]
        maxwell = theory.maxwell_mean_speed(1.0, mass) * root
        yield Prediction("mean speed", "Maxwell-Boltzmann", speed, maxwell)
        if free is not None:
            fixed = theory.fixed_energy_mean_speed(free, 1.0, mass) * root
            yield Prediction("mean speed", "fixed energy", speed, fixed)
    for law in laws:
        yield Prediction("kurtosis of speeds", law.model, means["kurtosis"], law.kurtosis)


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
        elif not _alike(scene.masses):
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
    if scene.number == 1 or free_velocities(scene) is not None:
        return NO_WALLS
    why = "two balls have one speed" if scene.number == 2 else "the balls' masses differ"
    if not at_rest(scene):
        why = "the balls' centre of mass moves on for ever"
    return f"{NO_WALLS}; the law of speeds at fixed energy is missing, because {why}"


def _alike(values: Array) -> bool:
    """Whether all values are the same."""
    return bool(np.all(values == values[0]))
